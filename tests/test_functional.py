"""The functional H(U, V) of Section 5: coefficients, matrix, minimum."""

from contextlib import nullcontext, suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from plans import annulus, disc, perturbed, rectangle
from skfem import MeshTri

from skfem_dual import (
    ConvergenceError,
    DualMesh,
    GridCouple,
    MeshError,
    rectangular_couple,
)
from skfem_dual.grids.polygons import Polygons
from skfem_dual.post import functional as module
from skfem_dual.post.functional import CoupleFunctional, Neighbours, Weights, surrounding_means

GRADED = rectangular_couple([0, 0.5, 2, 3, 3.2, 5], [-1, 0, 0.3, 2, 3])
GRIDS = {
    "disc": DualMesh.from_mesh(disc(2)),
    "perturbed": DualMesh.from_mesh(perturbed(disc(2), 0.05)),
    "annulus": DualMesh.from_mesh(annulus(3, 14)),
    "uniform rectangles": rectangular_couple(range(6), range(5)),
    "graded rectangles": GRADED,
    "maximal": rectangular_couple(range(6), [0, 1, 3, 4, 6], around="all"),
}
eight = st.lists(st.floats(0.0, 50.0), min_size=8, max_size=8).map(
    lambda w: Weights(w[0] + 0.1, w[1] + 0.1, *w[2:])
)


def nodes(grids):
    if isinstance(grids, DualMesh):
        return grids.mesh.p, grids.p[:, : grids.mesh.nelements]
    return grids.a.polygons.p, grids.b.polygons.p


@pytest.mark.parametrize("grids", GRIDS.values(), ids=GRIDS)
def test_coefficients_are_positive_and_exact_for_linear_fields(grids):
    neighbours = Neighbours.of(grids)
    p, q = nodes(grids)
    for matrix, own, other, inner in zip(
        (neighbours.alpha, neighbours.beta), (p, q), (q, p), neighbours.inner, strict=True
    ):
        assert matrix.shape == (own.shape[1], other.shape[1])
        assert (matrix.data > 0).all()
        assert matrix.sum(axis=1)[inner] == pytest.approx(1.0)
        assert (matrix @ other.T)[inner] == pytest.approx(own.T[inner], abs=1e-12)
        assert inner.any()


def test_coefficients_stand_where_the_grids_correspond():
    neighbours = Neighbours.of(GRADED)
    for matrix, around in (
        (neighbours.alpha, GRADED.around_a),
        (neighbours.beta, GRADED.around_b),
    ):
        assert np.array_equal((matrix > 0).toarray(), around.toarray() > 0)
    dual = GRIDS["perturbed"]
    whole, part = Neighbours.of(GridCouple.from_dual(dual)), Neighbours.of(dual)
    m = dual.mesh.nelements
    assert abs(whole.alpha[:, :m] - part.alpha).max() == 0
    assert abs(whole.beta[:m] - part.beta).max() == 0
    assert whole.alpha[:, m:].nnz == whole.beta[m:].nnz == 0


def test_known_coefficients():
    uniform = Neighbours.of(GRIDS["uniform rectangles"])
    assert uniform.alpha.data == pytest.approx(0.25)
    assert uniform.beta.data == pytest.approx(0.25)
    dual = Neighbours.of(GRIDS["perturbed"])
    assert dual.beta.data == pytest.approx(1 / 3)
    inner, boundary = np.ones(41, dtype=bool), disc(2).boundary_nodes()
    inner[boundary] = False
    assert np.array_equal(dual.inner[0], inner)
    # equilateral triangles, regular hexagons around inner nodes: a sixth each
    mesh = MeshTri.init_tensor(np.arange(6.0), np.arange(6.0))
    shear = np.array([[1, -0.5], [0, np.sqrt(0.75)]])  # the diagonals (1, 1) get the length 1
    hexagon = Neighbours.of(DualMesh.from_mesh(MeshTri(shear @ mesh.p, mesh.t)))
    assert hexagon.alpha.data == pytest.approx(1 / 6)


def test_cells_not_around_their_nodes_are_refused():
    p = np.array([[0.0, 4, 4, 3], [0.0, 0, 4, 1]])
    cell = Polygons(p, np.arange(4), [0, 4])
    inside = surrounding_means(cell, np.array([0]), np.array([[3.5], [0.5]]), (1, 4))
    assert inside @ p.T == pytest.approx(np.array([[3.5, 0.5]]))
    assert (inside.data > 0).all()
    for hidden in ((1.0, 0.2), (5.0, 1.0), (2.0, 0.0), (4.0, 4.0)):
        with pytest.raises(MeshError, match="star-shaped about their nodes; those around nodes 0"):
            surrounding_means(cell, np.array([0]), np.array(hidden)[:, None], (1, 4))
    with pytest.raises(TypeError, match="DualMesh or a GridCouple, got MeshTri"):
        Neighbours.of(MeshTri())


def brute_force(couple, w, F, G, U, V):
    """H as printed, summed node by node."""
    total = w.A1 * sum((U - F) ** 2) + w.A2 * sum((V - G) ** 2)
    around_a, around_b = couple.around_a.tolil().rows, couple.around_b.tolil().rows
    for i, js in enumerate(around_a):
        if js:
            total += w.B1 * (F[i] - np.mean(V[js])) ** 2 + w.C1 * (U[i] - np.mean(G[js])) ** 2
            total += w.D1 * (U[i] - np.mean(V[js])) ** 2
    for j, indices in enumerate(around_b):
        if indices:
            total += w.B2 * (G[j] - np.mean(U[indices])) ** 2
            total += w.C2 * (V[j] - np.mean(F[indices])) ** 2
            total += w.D2 * (V[j] - np.mean(U[indices])) ** 2
    return total


def test_value_is_the_sum_as_printed():
    couple = GRIDS["uniform rectangles"]
    rng = np.random.default_rng(0)
    F, U = rng.normal(size=(2, 30))
    G, V = rng.normal(size=(2, 20))
    w = Weights(*rng.uniform(1, 3, 8))
    functional = CoupleFunctional(Neighbours.of(couple), w)
    assert functional.value(F, G, U, V) == pytest.approx(brute_force(couple, w, F, G, U, V))
    three = CoupleFunctional(Neighbours.of(couple), Weights.init_paper(64, 128))
    eight = Weights(64, 64, 16, 16, 0, 0, 16 * 128, 16 * 128)
    assert three.value(F, G, U, V) == pytest.approx(brute_force(couple, eight, F, G, U, V))
    printed = CoupleFunctional(Neighbours.of(couple), Weights.init_paper(64, 128, last="means"))
    eight = Weights(64, 64, 16, 16, 0, 0, 128, 128)
    assert printed.value(F, G, U, V) == pytest.approx(brute_force(couple, eight, F, G, U, V))
    with pytest.raises(ValueError, match='last "sums" or "means", got \'mean\''):
        Weights.init_paper(64, 128, last="mean")


@settings(max_examples=30)
@given(weights=eight, seed=st.integers(0, 100), name=st.sampled_from(list(GRIDS)))
def test_minimum(weights, seed, name):
    functional = CoupleFunctional(Neighbours.of(GRIDS[name]), weights)
    rng = np.random.default_rng(seed)
    F, G = (rng.normal(size=n) for n in functional.neighbours.alpha.shape)
    U, V = functional.minimise(F, G)
    least = functional.value(F, G, U, V)
    assert least <= functional.value(F, G, F, G) * (1 + 1e-12) + 1e-20
    # H is quadratic: from its minimum it grows by the matrix
    d, e = (rng.normal(size=n) for n in functional.neighbours.alpha.shape)
    step = np.concatenate([d, e])
    grown = functional.value(F, G, U + d, V + e) - least
    assert grown == pytest.approx(step @ (functional.matrix @ step), rel=1e-7)
    assert grown > 0


@settings(max_examples=30)
@given(
    weights=eight,
    name=st.sampled_from(list(GRIDS)),
    c=hnp.arrays(float, 3, elements=st.floats(-9, 9)),
)
def test_linear_fields_are_reproduced(weights, name, c):
    grids = GRIDS[name]
    functional = CoupleFunctional(Neighbours.of(grids), weights)
    F, G = (c[0] + c[1] * x[0] + c[2] * x[1] for x in nodes(grids))
    U, V = functional.minimise(F, G)
    new, old = np.concatenate([U, V]), np.concatenate([F, G])
    assert new == pytest.approx(old, abs=1e-8)


@pytest.mark.parametrize("ratio", [1e9, 1e14, 1e18])
@pytest.mark.parametrize("names", [("D1", "D2"), ("B1", "B2"), ("C1", "D2")])
@pytest.mark.parametrize("grids", GRIDS.values(), ids=GRIDS)
def test_weights_far_apart(grids, names, ratio, monkeypatch):
    """Linear fields are exact with any; what others become is right, or refused."""
    weights = Weights(1, 1, **dict.fromkeys(names, ratio))
    functional = CoupleFunctional(Neighbours.of(grids), weights)
    F, G = (7 + x[0] - 3 * x[1] for x in nodes(grids))
    for most in (module.DIRECT, 0):  # by factors, and by conjugate gradients
        monkeypatch.setattr(module, "DIRECT", most)
        new = np.concatenate(functional.minimise(F, G))
        np.testing.assert_allclose(new, np.concatenate([F, G]), atol=1e-12)
    monkeypatch.undo()
    rng = np.random.default_rng(0)
    F, G = (rng.normal(size=n) for n in functional.neighbours.alpha.shape)
    with suppress(ConvergenceError) if ratio > 1e9 else nullcontext():
        U, V = functional.minimise(F, G)
        least = functional.value(F, G, U, V)
        for size in (1e-3, -1e-3, 1.0, -1.0):  # smooth ones are those that are lost
            assert functional.value(F, G, U + size, V + size) > least


@pytest.mark.parametrize("grids", GRIDS.values(), ids=GRIDS)
def test_matrix_is_symmetric_positive_definite_with_a_bounded_condition(grids):
    w = Weights(2.0, 3.0, 5.0, 1.0, 4.0, 2.0, 7.0, 6.0)
    matrix = CoupleFunctional(Neighbours.of(grids), w).matrix
    assert abs(matrix - matrix.T).max() < 1e-14
    values = np.linalg.eigvalsh(matrix.toarray())
    assert values[0] >= 2.0 - 1e-9
    alpha, beta = Neighbours.of(grids).alpha, Neighbours.of(grids).beta
    a, b = (np.linalg.norm(m.toarray(), 2) ** 2 for m in (alpha, beta))
    bound = 3 + max(4, 2) + max(5 * a, b) + 2 * (7 * max(1, a) + 6 * max(1, b))
    assert values[-1] <= bound


def test_iteration_finds_what_factors_find(monkeypatch):
    functional = CoupleFunctional(Neighbours.of(GRIDS["perturbed"]), Weights.init_paper(16, 256))
    rng = np.random.default_rng(1)
    F, G = (rng.normal(size=(n, 2)) for n in functional.neighbours.alpha.shape)
    direct = functional.minimise(F, G)
    monkeypatch.setattr(module, "DIRECT", 0)
    iterated = functional.minimise(F, G)
    for x, y, old in zip(direct, iterated, (F, G), strict=True):
        assert y == pytest.approx(x, abs=1e-9)
        assert x.shape == old.shape
    single = functional.minimise(F[:, 1], G[:, 1])
    assert single[0] == pytest.approx(direct[0][:, 1], abs=1e-9)


def test_iteration_that_fails_says_so(monkeypatch):
    monkeypatch.setattr(module, "DIRECT", 0)
    functional = CoupleFunctional(Neighbours.of(GRIDS["disc"]), Weights(1e-14, 1e-14, D1=1, D2=1))
    rng = np.random.default_rng(1)
    monkeypatch.setattr(module, "STEPS", 3)
    with pytest.raises(ConvergenceError, match="weights that differ less"):
        functional.minimise(*(rng.normal(size=n) for n in functional.neighbours.alpha.shape))


def test_steps_do_not_grow_with_the_grids(monkeypatch):
    monkeypatch.setattr(module, "DIRECT", 0)
    counts = []
    original = module.cg

    def counting(matrix, b, **options):
        steps = []
        out = original(matrix, b, **options, callback=steps.append)
        counts.append(len(steps))
        return out

    monkeypatch.setattr(module, "cg", counting)
    for n in (12, 48):
        neighbours = Neighbours.of(DualMesh.from_mesh(rectangle(n)))
        rng = np.random.default_rng(0)
        old = [rng.normal(size=k) for k in neighbours.alpha.shape]
        CoupleFunctional(neighbours, Weights.init_paper(16, 256)).minimise(*old)
    assert counts[1] < 1.5 * counts[0]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((-1, 1), r"A1 from 0 to 1e\+100, got -1"),
        ((1, 1, np.nan), "finite"),
        ((0, 1), "positive A1, got 0"),
    ],
)
def test_wrong_weights(values, message):
    with pytest.raises(ValueError, match=message):
        Weights(*values)


def test_wrong_values():
    functional = CoupleFunctional(Neighbours.of(GRADED), Weights(1.0, 1.0, D1=1.0))
    F, G = (np.zeros(n) for n in functional.neighbours.alpha.shape)
    with pytest.raises(
        ValueError, match=r"each of the 30 and 20 nodes, got shapes \(29,\) and \(20,\)"
    ):
        functional.minimise(F[1:], G)
    with pytest.raises(ValueError, match="finite G, got inf at node 3"):
        functional.minimise(F, np.where(np.arange(20) == 3, np.inf, G))
    with pytest.raises(ValueError, match="got shapes"):
        functional.minimise(0.0, G)
