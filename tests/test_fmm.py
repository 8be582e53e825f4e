"""The quadtree, its lists and the expansions behind the fast summation."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import chebyshev
from plans import disc, perturbed, rectangle

from skfem_dual import DualMesh
from skfem_dual.elements.polygon_moments import polygon_moments
from skfem_dual.kernels.compiled import inputs
from skfem_dual.operators.fmm.assembly import m2l_translations
from skfem_dual.operators.fmm.chebyshev import PADDING, Chebyshev, compressed
from skfem_dual.operators.fmm.lists import near_lists
from skfem_dual.operators.fmm.loops import Clusters, Layout, Loads, add_multipoles
from skfem_dual.operators.fmm.near_entries import Runs
from skfem_dual.operators.fmm.quadtree import BESIDE, OFFSETS, Quadtree


def random_circles(seed, n, m, ratio):
    """Circles with radii over a range, clustered, and points; some coincide."""
    rng = np.random.default_rng(seed)
    spread = rng.choice([1.0, 0.1, 0.01], n)
    centres = rng.uniform(-1, 1, (2, n)) * spread + rng.choice([0.0, 0.7], n)
    x = np.hstack([centres[:, np.arange(m // 2) % n], rng.uniform(-2, 2, (2, m - m // 2))])
    return centres, spread * 0.05 * ratio ** rng.uniform(-1, 0, n), x


@settings(max_examples=6)
@given(st.integers(0, 10**6), st.integers(1, 200), st.integers(1, 200), st.integers(1, 60))
def test_every_cell_acts_once_on_every_point(seed, n, m, terms):
    """Directly, through a pair of boxes, or through one expansion only: exactly once in all."""
    centres, radius, x = random_circles(seed, n, m, 100.0)
    tree = Quadtree.from_circles(centres, radius, x, 8, 1.5, 0.1)
    assert np.array_equal(np.sort(tree.cells), np.arange(n))
    assert np.array_equal(np.sort(tree.points), np.arange(m))
    count = np.zeros((m, n), int)

    def act(points, cells):
        count[np.ix_(np.arange(*points), cells)] += 1

    for level in range(len(tree.levels) - 1):
        table, boxes = tree.families(level), np.arange(*tree.levels[level : level + 2])
        for row, k in zip(*np.nonzero(table >= 0), strict=True):
            own, beside = (boxes[4 * i : 4 * i + 4] for i in (row, table[row, k]))
            step = tree.place[:, tree.parent[beside]] - tree.place[:, tree.parent[own]]
            assert (step == BESIDE[k][:, None]).all()
            for box, other in product(own, beside):
                if np.abs(tree.place[:, other] - tree.place[:, box]).max() > 1:
                    act(tree.targets[:, box], np.arange(*tree.sources[:, other]))
    lists = near_lists(tree, centres[:, tree.cells], radius[tree.cells], terms)
    for number, found in enumerate(lists):
        for k, box in enumerate(found.boxes):
            items = found.items[found.starts[k] : found.starts[k + 1]]
            if number == 2:
                items = np.concatenate([np.arange(*tree.sources[:, i]) for i in items])
                assert len(items) > terms
            act(tree.targets[:, box], items)
    assert (count == 1).all()


@settings(max_examples=10)
@given(st.integers(0, 10**6))
def test_boxes(seed):
    centres, radius, x = random_circles(seed, 300, 200, 10.0)
    tree = Quadtree.from_circles(centres, radius, x, 10, 1.5, 0.07)
    for b in range(len(tree)):
        own = tree.cells[tree.sources[0, b] : tree.own[b]]
        inside = tree.cells[slice(*tree.sources[:, b])]
        points = tree.points[slice(*tree.targets[:, b])]
        for p in (centres[:, inside], x[:, points]):
            assert np.all(np.abs(p - tree.middle[:, b : b + 1]) <= 1.0000001 * tree.half[b])
        if b > 0:  # the root takes what is too large for any box
            assert np.all(radius[own] * 1.5 <= tree.half[b] * 1.0000001)
        if tree.nchildren[b]:
            children = np.arange(tree.first[b], tree.first[b] + tree.nchildren[b])
            assert np.all(tree.parent[children] == b)
        beside = tree.adjacent[b][tree.adjacent[b] >= 0]
        assert np.all(np.abs(tree.place[:, beside] - tree.place[:, b : b + 1]) <= 1)


def test_one_large_cell_does_not_keep_small_ones_together():
    rng = np.random.default_rng(0)
    centres = np.hstack([rng.uniform(-0.1, 0.1, (2, 2000)), [[0.01], [0.02]]])
    radius = np.append(np.full(2000, 1e-3), 1.0)
    tree = Quadtree.from_circles(centres, radius, centres, 20, 1.5, 0.01)
    lists = near_lists(tree, centres[:, tree.cells], radius[tree.cells], 45)
    assert lists.p2p.counts.max() < 300


def polynomials(chebyshev_terms, s):
    """The terms at points ``s`` of shape (2, m); shape (m, terms)."""
    a, b = chebyshev_terms.degrees
    x, y = (chebyshev.chebvander(v, chebyshev_terms.order - 1) for v in s)
    return x[:, a] * y[:, b]


@pytest.mark.parametrize("kernel", [lambda r: 1 / r, lambda r: -np.log(r)], ids=["1/r", "ln r"])
def test_expansions_converge(kernel):
    """Loads in one box, moved up, across, down: geometric convergence with the order."""
    rng = np.random.default_rng(1)
    errors = []
    for order in (4, 6, 8, 10, 12):
        terms = Chebyshev(order)
        m2l = terms.m2l(kernel, 2.0)
        error = 0.0
        for k in range(0, len(OFFSETS), 3):
            load, quarter = rng.uniform(-1.1, 1.1, (2, 20)), rng.integers(4)
            side = 2 * np.array([[quarter % 2], [quarter // 2]]) - 1
            x = rng.uniform(-1, 1, (2, 10))
            moments = polynomials(terms, load / PADDING).sum(0) @ terms.m2m(quarter)
            local = moments @ m2l[k] @ terms.l2l(quarter)
            y = load + side + 4 * OFFSETS[k][:, None]
            exact = kernel(np.hypot(*((x + side)[:, :, None] - y[:, None]))).sum(axis=1)
            error = max(error, np.abs(polynomials(terms, x) @ local / exact - 1).max())
        errors.append(error)
    assert errors[-1] < 2e-6
    assert np.all(np.diff(np.log(errors)) < -1)


def test_field_beside_a_box():
    rng = np.random.default_rng(2)
    terms, half = Chebyshev(12), 0.5
    load = rng.uniform(-1, 1, (2, 30))
    x = np.array([[3.1, -3.5, 0.5], [0.2, 3.0, -3.2]])
    field = terms.m2p(lambda r: 1 / r, np.full(3, half), x)
    found = field @ polynomials(terms, load / PADDING).sum(axis=0)
    exact = (1 / (half * np.hypot(*(x[:, :, None] - load[:, None])))).sum(axis=1)
    assert found == pytest.approx(exact, rel=1e-6)


def test_moments_of_polygons():
    dual = DualMesh.from_mesh(perturbed(rectangle(4), 0.06))
    polygons = dual.partition.polygons
    m = polygon_moments(polygons, 4)
    assert m[0, 0] == pytest.approx(polygons.areas, rel=1e-13)
    xx, xy, yy = polygons.second_moments
    assert np.allclose([2 * m[2, 0], m[1, 1], 2 * m[0, 2]], [xx, xy, yy], rtol=1e-11, atol=1e-17)
    # the third and fourth of a cell by its triangles and a rule exact for them
    j = 7
    v = polygons[j] - polygons.centroids[:, j : j + 1]
    s, w = np.polynomial.legendre.leggauss(5)
    s, w = (s + 1) / 2, w / 2
    expected = np.zeros((5, 5))
    for a, b in zip(v.T, np.roll(v, -1, axis=1).T, strict=True):
        cross = a[0] * b[1] - a[1] * b[0]
        for r, wr in zip(s, w, strict=True):
            for t, wt in zip(s, w, strict=True):
                x, y = r * (a + t * (b - a))
                for i in range(5):
                    for k in range(5 - i):
                        expected[i, k] += wr * wt * r * cross * x**i * y**k
    factorial = np.array([1, 1, 2, 6, 24])
    scale = polygons.radii[j] ** np.add.outer(np.arange(5), np.arange(5)) * polygons.areas[j]
    error = np.abs(m[:, :, j] * np.outer(factorial, factorial) - expected)
    assert (error <= 1e-14 * scale).all()


def test_multipole_expansions_are_integrals_of_the_polynomials():
    """Of degrees up to that of the moments exactly, by moments alone; dipoles are derivatives."""
    polygons = DualMesh.from_mesh(disc(2)).partition.polygons
    degree, n = 5, len(polygons)
    terms = Chebyshev(degree + 1)
    middle, half = np.array([[0.1], [-0.2]]), np.array([1.3])
    disc_of_cells = Clusters(*inputs(np.array([[0], [n]]), middle, half))
    moments = polygon_moments(polygons, degree) / polygons.areas
    moments = np.array([moments[i, j] / half ** (i + j) for i, j in terms.degrees.T])
    loads = Loads(*inputs(polygons.centroids, polygons.areas / np.pi, moments), degree + 1)
    rng = np.random.default_rng(0)
    pressures, dipoles = inputs(rng.random((3, n)), rng.random((3, 2, n)))
    found = np.zeros((3, 2, terms.terms))
    known = *inputs(np.array([1])), disc_of_cells, loads, terms.order, pressures
    add_multipoles(0, 1, *known, *inputs(np.empty((3, 2, 0))), found)
    s, w = np.polynomial.legendre.leggauss(8)
    expected = np.zeros((3, terms.terms))
    for j in range(n):
        v, c = polygons[j], polygons.centroids[:, j]
        for a, b in zip(v.T - c, np.roll(v, -1, axis=1).T - c, strict=True):
            cross = a[0] * b[1] - a[1] * b[0]
            r, t = (g.ravel() for g in np.meshgrid((s + 1) / 2, (s + 1) / 2))
            weight = np.outer(w, w).ravel() / 4 * r * cross
            y = c[:, None] + r * (a[:, None] + t * (b - a)[:, None])
            integrals = weight @ polynomials(terms, (y - middle) / half)
            expected += pressures[:, j, None] * integrals
    assert found[:, 1] == pytest.approx(expected, abs=1e-12)
    assert not found[:, 0].any()
    add_multipoles(0, 1, *known, dipoles, found)
    for i in range(3):
        step = polygons.centroids + 1e-20j * dipoles[i]
        slope = polynomials(terms, (step - middle) / half).imag.sum(axis=0) / 1e-20
        assert found[i, 1] - 2 * expected[i] == pytest.approx(slope, abs=1e-11)


@pytest.mark.parametrize("tolerance", [0.0, 1e-5])
def test_families_act_by_their_parities(tolerance):
    """As box by box, with every matrix of its own; and cut to the first terms."""
    x = np.stack(np.meshgrid(*2 * [(np.arange(16) + 0.5) / 16])).reshape(2, -1)
    x = x[:, (x[0] < 0.5) | (x[1] > 0.25)]  # some families have none beside them
    tree = Quadtree.from_circles(x, np.full(x.shape[1], 0.01), x, 1, 1.0, 1 / 16)
    chebyshev, level = Chebyshev(5), 3
    matrices = chebyshev.m2l(lambda r: 1 / r, 1.0)
    factors = compressed(matrices, chebyshev.parities, tolerance)
    families = [tree.families(k) if k == level else np.full((1, 8), -1) for k in range(level + 1)]
    (translation,) = m2l_translations(tree, families, lambda half: factors)
    begin, end = tree.levels[level : level + 2]

    def at_once(work, m):
        work(slice(0, m))

    rng = np.random.default_rng(0)
    multipole = rng.standard_normal((2, len(tree), chebyshev.terms))
    for terms in (15, 6):
        given, (out, expected) = multipole[..., :terms], np.zeros((2, 2, len(tree), terms))
        for box, other in product(range(begin, end), repeat=2):
            way = tree.place[:, other] - tree.place[:, box]
            parents = tree.place[:, [tree.parent[other], tree.parent[box]]]
            if np.abs(way).max() > 1 and np.abs(np.diff(parents)).max() <= 1:
                k = np.nonzero((way == OFFSETS).all(axis=1))[0][0]
                expected[:, box] += given[:, other] @ matrices[k, :terms, :terms]
        scale = np.abs(expected).max()
        cut = translation if terms == 15 else translation.cut(chebyshev.parities[:terms])
        cut.add(cut.turned(given.copy(), at_once), out, at_once)
        assert out == pytest.approx(expected, abs=(1e-12 + 30 * tolerance) * scale)
        single = out.astype(np.float32) * 0
        cut.add(cut.turned(given.astype(np.float32), at_once), single, at_once)
        assert single == pytest.approx(out, abs=2e-6 * scale)


def test_runs_of_cells():
    """One after the other they are the columns, also where lists follow on each other."""
    starts, columns = np.array([0, 3, 3, 7, 9]), np.array([4, 5, 6, 7, 8, 1, 2, 3, 3])
    layout = Layout.from_lists(np.array([[0, 2, 2, 3], [2, 2, 3, 5]]), starts, columns)
    runs = Runs.from_layout(layout)
    assert runs.cells.tolist() == [[4, 7, 1, 3, 3], [7, 9, 3, 4, 4]]
    assert runs.starts.tolist() == [0, 1, 1, 3, 5]
    assert runs.offsets is layout.offsets
