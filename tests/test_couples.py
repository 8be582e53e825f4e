import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from plans import annulus, disc, perturbed, polar, rectangle, two_holes, two_parts
from scipy.spatial import Voronoi
from skfem import MeshTri

from skfem_dual import DualMesh, MeshError, check_mesh
from skfem_dual.grids import generate
from skfem_dual.grids.couples import GridCouple, boundary_nodes
from skfem_dual.grids.duality import check_dual
from skfem_dual.grids.extremal import maximal_couple, minimal_couple
from skfem_dual.grids.partition import Partition
from skfem_dual.grids.planar import containing
from skfem_dual.grids.polygons import Polygons
from skfem_dual.grids.quality import MeshQuality
from skfem_dual.grids.rectangles import rectangular_couple
from skfem_dual.grids.voronoi import delaunay_voronoi


def lattice(n, jitter=0.0, seed=0):
    """A hexagon of equilateral triangles, the inner points moved at random."""
    i, j = np.meshgrid(np.arange(-n, n + 1), np.arange(-n, n + 1))
    ring = np.maximum(np.maximum(abs(i), abs(j)), abs(i + j))
    inner = ring[ring <= n] < n
    p = np.stack([i + j / 2, np.sqrt(3) / 2 * j])[:, ring <= n]
    return p + inner * np.random.default_rng(seed).uniform(-jitter, jitter, p.shape)


PLANS = {
    "one triangle": MeshTri.init_refdom(),
    "square": rectangle(6),
    "disc": disc(3),
    "random": perturbed(rectangle(8), 0.03),
    "re-entrant": MeshTri.init_lshaped().refined(2),
    "annulus": annulus(3, 24),
    "two holes": two_holes(),
    "two parts": two_parts(2.3),
    "adaptive": MeshTri().refined(2).refined(np.array([3, 4, 11])),
}
COUPLES = {
    "1-type": lambda: GridCouple.from_dual(DualMesh.from_mesh(disc(2))),
    "rectangles": lambda: rectangular_couple(range(5), range(4)),
    "maximal": lambda: maximal_couple(annulus(3, 12)),
    "minimal": lambda: minimal_couple(disc(2)),
    "Voronoi": lambda: delaunay_voronoi(lattice(3, 0.05)),
    "Voronoi in the hull": lambda: delaunay_voronoi(lattice(2), "hull"),
}


@pytest.fixture(params=PLANS)
def plan(request):
    return PLANS[request.param]


@pytest.fixture(params=COUPLES)
def couple(request):
    return COUPLES[request.param]()


def violated(couple):
    """Offending indices by the words in brackets: definition and condition."""
    return {
        (c.expected.split("(")[-1].rstrip(")"), c.entity): c.offending.tolist()
        for c in check_dual(couple).violated
    }


def condition(couple, words):
    (found,) = [c for c in check_dual(couple).conditions if words in c.expected]
    return found


# ---------------------------------------------------------------------- the check itself


def test_good_couples(couple):
    report = check_dual(couple)
    assert report.ok
    assert "FAIL" not in repr(report)
    assert "Definition 1, condition 4" in repr(report)


def test_one_type(plan):
    dual = DualMesh.from_mesh(plan)
    assert check_dual(dual).ok
    # told to be something else it is not: boundary nodes are on the edge of their cells
    couple = GridCouple.from_dual(dual)
    wrong = violated(replace(couple, kind="2-type"))
    at_edge = np.unique(dual.mesh.boundary_nodes()).tolist()
    assert wrong["Definition 1, condition 2", "cell of B"] == at_edge


def with_points(grid, p):
    return replace(grid, polygons=Polygons(p, grid.polygons.indices, grid.polygons.offsets))


def test_a_moved_node(couple):
    """Out of its cell, but not so far that a polygon turns over."""
    p = couple.b.polygons.p.copy()
    inside = [q for q in couple.node_in_a if q not in boundary_nodes(couple.b)]
    node = inside[len(inside) // 2]
    cell = int(np.nonzero(couple.node_in_a == node)[0][0])
    corners = couple.a.polygons[cell]
    p[:, node] += 1.2 * (corners.mean(axis=1) - corners[:, 0]) + 1e-3
    wrong = violated(replace(couple, b=with_points(couple.b, p)))
    assert wrong["Definition 1, condition 2", "cell of A"] == [cell]
    assert cell in wrong["Definition 1, condition 3", "cell of A"]
    # a rib at the node no longer crosses the one corresponded to it
    at_node = (couple.b.facets[:, couple.ribs[1]] == node).any(axis=0)
    crossing = wrong["Definition 1, condition 4", "rib of A"]
    assert crossing
    assert set(crossing) <= set(couple.ribs[0, at_node])


def test_a_dual_mesh_is_not_trusted():
    dual = DualMesh.from_mesh(disc(2))
    p = dual.p.copy()
    p[:, 5] = dual.mesh.p[:, dual.mesh.t[0, 5]] * 1.01 - 0.001
    wrong = violated(replace(dual, partition=with_points(dual.partition, p)))
    assert 5 in wrong["Definition 1, condition 2", "cell of A"]


def beside(one, other):
    """Two grids as one, which share no points."""
    points, cells, ribs = one.polygons.p.shape[1], len(one), one.facets.shape[1]
    return Partition(
        Polygons.together([one.polygons, other.polygons]),
        np.hstack([one.facets, other.facets + points]),
        np.hstack([one.f2c, np.where(other.f2c < 0, -1, other.f2c + cells)]),
        np.hstack([one.nodes, other.nodes]),
        np.hstack([one.boundary, np.where(other.boundary < 0, -1, other.boundary + ribs)]),
    )


@pytest.mark.parametrize(("apart", "ok"), [(2.0, True), (1.7, False), (0.5, False)])
def test_parts_that_overlap(apart, ok):
    """Each by itself is dual; together they are no partition."""
    one, two = (rectangular_couple(np.arange(3.0) + x, range(3)) for x in (0.0, apart))
    (m, n), ribs = (grid.polygons.p.shape[1] for grid in (one.a, one.b)), one.ribs
    shift = [[one.a.facets.shape[1]], [one.b.facets.shape[1]]]
    couple = GridCouple(
        "2-type",
        beside(one.a, two.a),
        beside(one.b, two.b),
        np.append(one.node_in_a, two.node_in_a + n),
        np.append(one.node_in_b, two.node_in_b + m),
        np.hstack([ribs, two.ribs + shift]),
    )
    x = np.random.default_rng(0).uniform(0, 2 + apart, (2, 300))
    _, point, depth = containing(couple.a.polygons, x)
    assert (np.bincount(point[depth > 0]).max() == 1) == ok
    assert (len(condition(couple, "covered twice by A").offending) == 0) == ok
    assert check_dual(couple).ok == ok


def test_a_cell_that_crosses_itself():
    couple = rectangular_couple(range(4), range(4), around="all")
    p = couple.b.polygons.p.copy()
    p[:, [5, 10]] = [[2.2, 1.6], [-2.0, -2.5]]
    bow = replace(couple, b=with_points(couple.b, p))
    assert condition(bow, "cells of B whose sides do not cross").offending.tolist() == [4]
    assert not check_dual(bow).ok


def test_swapped_cell_numbers(couple):
    for name, entity in (("node_in_a", "cell of A"), ("node_in_b", "cell of B")):
        node = getattr(couple, name).copy()
        i, j = 1, len(node) - 1
        node[[i, j]] = node[[j, i]]
        wrong = violated(replace(couple, **{name: node}))
        assert wrong["Definition 1, condition 2", entity] == [i, j]
        # and the graphs do not fit: all ribs beside these cells
        other = {"node_in_a": couple.a, "node_in_b": couple.b}[name]
        row = 0 if name == "node_in_a" else 1
        beside = np.isin(other.f2c[:, couple.ribs[row]], [i, j]).any(axis=0)
        found = wrong["Definition 1, condition 1", f"rib of {'AB'[row]}"]
        assert set(found) <= set(couple.ribs[row, beside])
        assert len(found) >= 2


def test_a_wrong_rib(couple):
    facets = couple.b.facets.copy()
    rib = int(couple.ribs[1, 3])
    facets[0, rib] = np.setdiff1d(np.arange(couple.b.polygons.p.shape[1]), facets[:, rib])[0]
    wrong = violated(replace(couple, b=replace(couple.b, facets=facets)))
    assert rib in wrong["Definition 1, condition 1", "rib of B"]
    assert wrong["the ribs of B as sides of its cells", "cell of B"]


def test_wrong_pairs_of_ribs(couple):
    ribs = couple.ribs.copy()
    ribs[1, [2, 5]] = ribs[1, [5, 2]]
    wrong = violated(replace(couple, ribs=ribs))
    assert set(ribs[0, [2, 5]]) <= set(wrong["Definition 1, condition 1", "rib of A"])
    assert set(ribs[0, [2, 5]]) <= set(wrong["Definition 1, condition 4", "rib of A"])


def test_a_missing_pair_of_ribs(couple):
    wrong = violated(replace(couple, ribs=np.delete(couple.ribs, 4, axis=1)))
    assert wrong == {
        ("Definition 1, condition 1", "rib of A"): [couple.ribs[0, 4]],
        ("Definition 1, condition 1", "rib of B"): [couple.ribs[1, 4]],
    }


def test_a_missing_cell():
    """An inner node of A without a cell of B, a hole in a dual grid."""
    dual = GridCouple.from_dual(DualMesh.from_mesh(disc(2)))
    inner = int(np.setdiff1d(np.arange(len(dual.b)), boundary_nodes(dual.a))[0])
    keep = np.delete(np.arange(len(dual.b)), inner)
    number = np.full(len(dual.b) + 1, -1)
    number[keep] = np.arange(len(keep))
    f2c = np.sort(number[dual.b.f2c], axis=0)[::-1]
    turned = number[dual.b.f2c[0]] != f2c[0]
    sizes = dual.b.polygons.sizes
    polygons = Polygons(
        dual.b.polygons.p,
        dual.b.polygons.indices[np.repeat(np.arange(len(sizes)) != inner, sizes)],
        np.append(0, np.cumsum(sizes[keep])),
    )
    b = replace(
        dual.b,
        polygons=polygons,
        facets=np.where(turned, dual.b.facets[::-1], dual.b.facets),
        f2c=f2c,
        nodes=dual.b.nodes[:, keep],
    )
    wrong = violated(replace(dual, b=b, node_in_b=keep))
    assert wrong["Definition 3, condition 1", "node of A"] == [inner]
    assert len(wrong["Definition 2", "rib of B"]) == sizes[inner]


def test_another_domain():
    dual = GridCouple.from_dual(DualMesh.from_mesh(rectangle(3)))
    p = dual.b.polygons.p.copy()
    edge = boundary_nodes(dual.b)
    p[:, edge] *= 1.01
    wrong = violated(replace(dual, b=with_points(dual.b, p)))
    assert len(wrong["Definition 2", "rib of B"]) == 24
    assert len(wrong["Definition 2", "rib of A"]) == 12


def test_arrays_that_do_not_fit(couple):
    for change in (
        {"node_in_a": couple.node_in_a[1:]},
        {"node_in_b": couple.node_in_b + 10**6},
        {"ribs": couple.ribs[0]},
        {"ribs": couple.ribs + couple.a.facets.shape[1]},
        {"ribs": -couple.ribs},
        {"unbounded": [-1]},
    ):
        with pytest.raises(MeshError, match="expected"):
            replace(couple, **change)
    with pytest.raises(ValueError, match="got '3-type'"):
        replace(couple, kind="3-type")
    with pytest.raises(TypeError, match="expected a Partition for b, got None"):
        replace(couple, b=None)


@pytest.mark.parametrize("thing", [None, MeshTri(), np.eye(2)])
def test_other_things_are_refused(thing):
    with pytest.raises(TypeError, match="GridCouple or a DualMesh"):
        check_dual(thing)


def test_census_and_pickle(couple):
    again = pickle.loads(pickle.dumps(couple))
    assert np.array_equal(again.ribs, couple.ribs)
    assert f"B: {len(couple.b)} cells" in repr(again)
    for array in (couple.node_in_a, couple.node_in_b, couple.ribs, couple.unbounded):
        assert not array.flags.writeable


# -------------------------------------------------------------- around each node, Section 5


def test_nodes_around_each_node(couple):
    for around, cells, node, other in (
        (couple.around_a, couple.b, couple.node_in_b, couple.a),
        (couple.around_b, couple.a, couple.node_in_a, couple.b),
    ):
        assert around.shape == (other.polygons.p.shape[1], cells.polygons.p.shape[1])
        assert set(around.data) == {1.0}
        filled = np.nonzero(np.diff(around.indptr))[0]
        inner = np.setdiff1d(np.arange(around.shape[0]), boundary_nodes(other))
        assert set(inner) <= set(filled) or couple.kind == "minimal"
        for i in filled:
            row = around.indices[around.indptr[i] : around.indptr[i + 1]]
            (cell,) = np.nonzero(node == i)[0]
            assert set(row) == set(
                cells.polygons.indices[cells.polygons.offsets[cell] :][
                    : cells.polygons.sizes[cell]
                ]
            )
            # the node is among them, so they surround it
            hull = cells.polygons.p[:, row] - other.polygons.p[:, [i]]
            angle = np.sort(np.arctan2(*hull))
            assert np.diff(np.append(angle, angle[0] + 2 * np.pi)).max() < np.pi + 1e-9


def test_nodes_around_in_rectangles():
    """Fig. 15: four nodes around each node of B and each inner node of A."""
    k = 5
    couple = rectangular_couple(range(k), range(k))
    a, b = couple.a.polygons.p, couple.b.polygons.p
    assert (np.diff(couple.around_b.indptr) == 4).all()
    inner = ((a > 0) & (a < k - 1)).all(axis=0)
    assert np.array_equal(np.diff(couple.around_a.indptr), 4 * inner)
    assert couple.around_b @ a.T / 4 == pytest.approx(b.T)
    assert (couple.around_a @ b.T / 4)[inner] == pytest.approx(a.T[inner])


def test_boundary_nodes_of_a_one_type_couple_are_not_surrounded():
    dual = DualMesh.from_mesh(disc(2))
    around = GridCouple.from_dual(dual).around_a
    valence = np.bincount(dual.mesh.t.ravel())
    valence[dual.mesh.boundary_nodes()] = 0
    assert np.array_equal(np.diff(around.indptr), valence)


# -------------------------------------------------------------------------------- rectangles


def coordinates(n):
    return st.lists(st.floats(0.2, 3.0), min_size=n, max_size=n).map(np.cumsum)


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_random_rectangles(data):
    """Definitions 3 and 4 and Proposition 1, with holes, gaps and a mask; or a refusal."""
    nx, ny = data.draw(st.integers(2, 7)), data.draw(st.integers(2, 7))
    x, y = data.draw(coordinates(nx)), data.draw(coordinates(ny))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    missing = rng.random((nx - 1, ny - 1)) < data.draw(st.sampled_from([0, 0.05, 0.3]))
    around = data.draw(st.sampled_from(["inner", "all", "mask"]))
    if around == "mask":
        present = np.pad(~missing, 1)
        inner = present[1:, 1:] & present[1:, :-1] & present[:-1, 1:] & present[:-1, :-1]
        around = inner | (rng.random((nx, ny)) < 0.5)
    try:
        couple = rectangular_couple(x, y, missing=missing, around=around)
    except MeshError:
        # a full rectangle with an inner node always has both
        assert missing.any() or min(nx, ny) == 2 or not isinstance(around, str)
        return
    assert check_dual(couple).ok
    assert check_dual(couple.swapped()).ok
    assert couple.a.areas.sum() == pytest.approx(
        (np.outer(np.diff(x), np.diff(y))[~missing]).sum()
    )
    # the nodes of B in A are the barycentres
    assert couple.b.polygons.p[:, couple.node_in_a] == pytest.approx(couple.a.centroids)


def test_extremal_rectangles():
    """Fig. 2a: of k x k and (k - 1) x (k - 1) nodes; one's B is the other's A."""
    x, y = np.array([0.0, 1, 3, 4]), np.array([0.0, 2, 3])
    least = rectangular_couple(x, y)
    assert (len(least.a), len(least.b)) == (6, 2)
    most = least.swapped()
    assert most.kind == "maximal"
    assert condition(most, "maximal").ok
    assert not condition(least, "maximal").ok
    assert condition(least, "minimal").ok
    assert len(rectangular_couple(x, y, around="all").b) == 12


def test_a_couple_of_general_type():
    """Fig. 2b: neither maximal nor minimal."""
    around = np.zeros((6, 5), dtype=bool)
    around[1:, 1:-1] = around[:-1, 1:3] = True
    couple = rectangular_couple(range(6), range(5), around=around)
    assert couple.kind == "2-type"
    assert check_dual(couple).ok
    assert not condition(couple, "maximal").ok
    assert not condition(couple, "minimal").ok
    assert check_dual(couple.swapped()).ok


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x": [0, 1], "y": range(9)}, "no minimal dual grid"),
        ({"x": [0, 2, 1], "y": [0, 1]}, "increasing coordinates x"),
        ({"x": [0, 1], "y": [0, np.nan]}, "finite y, got nan at index 1"),
        ({"x": range(4), "y": range(4), "missing": [True]}, r"missing of shape \(3, 3\)"),
        ({"x": [0, 1], "y": [0, 1], "missing": [[True]]}, "not missing"),
        ({"x": range(4), "y": range(4), "around": np.ones((3, 3), bool)}, r"shape \(4, 4\)"),
        (
            {"x": range(4), "y": range(4), "around": np.zeros((4, 4), bool)},
            r"around every inner node .*\(1, 1\), \(1, 2\), \(2, 1\), \(2, 2\) have none",
        ),
        (
            {"x": range(6), "y": range(5), "missing": np.eye(5, 4, -1, dtype=bool)},
            "next to a node with a cell",
        ),
        (
            {"x": range(4), "y": range(4), "missing": np.eye(3, dtype=bool) & (np.arange(3) == 1)}
            | {"around": "all"},
            r"leave gaps and holes of A open .* rectangles \(1, 1\)",
        ),
    ],
)
def test_rectangles_without_a_dual(arguments, message):
    with pytest.raises(MeshError, match=message):
        rectangular_couple(**arguments)


def test_rectangles_of_something_else():
    with pytest.raises(ValueError, match='around "inner" or "all", got \'outer\''):
        rectangular_couple(range(4), range(4), around="outer")
    with pytest.raises(TypeError, match="missing as an array of booleans, got an array of float"):
        rectangular_couple(range(4), range(4), missing=np.ones((3, 3)))


# ---------------------------------------------------------------------------- triangulations


def test_maximal(plan):
    couple = maximal_couple(plan)
    assert check_dual(couple).ok
    assert len(couple.b) == plan.p.shape[1]
    assert check_dual(couple.swapped()).ok
    assert couple.b.areas.sum() > couple.a.areas.sum()
    # the same cells as the 1-type dual inside
    dual = DualMesh.from_mesh(plan)
    inner = dual.mesh.interior_nodes()
    assert couple.b.areas[inner] == pytest.approx(dual.areas[inner])


def test_minimal():
    for mesh in (disc(3), disc(4), annulus(3, 24), perturbed(disc(3), 0.02)):
        couple = minimal_couple(mesh)
        assert check_dual(couple).ok
        assert len(couple.b) == len(mesh.interior_nodes())
        assert check_dual(couple.swapped()).ok
        assert couple.b.areas.sum() < couple.a.areas.sum()


def test_meshes_without_a_minimal_dual():
    with pytest.raises(MeshError, match=r"inner node in every triangle.*triangles 0 have"):
        minimal_couple(MeshTri.init_refdom())
    with pytest.raises(MeshError, match=r"triangles 6, 7 have none.*flip"):
        minimal_couple(MeshTri.init_lshaped().refined(2))


def test_a_slit_has_no_room_for_a_maximal_dual():
    m = rectangle(4)
    slit = np.nonzero((m.p[0] == 0) & (m.p[1] > 0.1))[0]
    t = m.t.copy()
    right = m.p[0][m.t].mean(axis=0) > 0
    for new, old in enumerate(slit, m.p.shape[1]):
        t[:, right] = np.where(t[:, right] == old, new, t[:, right])
    cut = MeshTri(np.hstack([m.p, m.p[:, slit]]), t)
    assert check_dual(DualMesh.from_mesh(cut)).ok
    with pytest.raises(MeshError, match=r"room beyond the boundary.*slit"):
        maximal_couple(cut)


def test_a_narrow_notch():
    """The cells of both sides share the room between them."""
    steps = np.append(np.linspace(0, 1, 9), np.linspace(1.02, 2, 9))
    block = MeshTri.init_tensor(steps, np.linspace(0, 2, 17))
    x = block.p[0, block.t].mean(axis=0)
    # without the thin column, whose lower part would have no dual grid
    parts = block.remove_elements(np.nonzero((x > 1) & (x < 1.02))[0])
    couple = maximal_couple(parts)
    assert check_dual(couple).ok
    edge = couple.b.polygons.p[0]
    assert ((edge > 1) & (edge < 1.01)).any()
    assert ((edge > 1.01) & (edge < 1.02)).any()


def test_one_type_is_not_mutual():
    with pytest.raises(MeshError, match="not mutual"):
        GridCouple.from_dual(DualMesh.from_mesh(disc(2))).swapped()
    with pytest.raises(MeshError, match="cut off"):
        delaunay_voronoi(lattice(2)).swapped()


@st.composite
def triangulations(draw):
    """A jittered grid with triangles taken out."""
    nx, ny = draw(st.integers(2, 6)), draw(st.integers(2, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    m = MeshTri.init_tensor(np.arange(nx + 1.0), np.arange(ny + 1.0))
    m = MeshTri(m.p + rng.uniform(-0.2, 0.2, m.p.shape), m.t)
    keep = rng.random(m.nelements) > draw(st.sampled_from([0.0, 0.1, 0.4]))
    assume(keep.any())
    return m.restrict(np.nonzero(keep)[0])


@settings(max_examples=25, deadline=None)
@given(triangulations())
def test_random_triangulations(mesh):
    """Every dual grid is 1-type, and has a maximal one, for which A is minimal."""
    assume(check_mesh(mesh).ok)
    dual = DualMesh.from_mesh(mesh)
    assert check_dual(dual).ok
    couple = maximal_couple(dual)
    assert check_dual(couple).ok
    assert check_dual(couple.swapped()).ok
    try:
        couple = minimal_couple(dual)
    except MeshError:
        assert not np.isin(mesh.t, mesh.interior_nodes()).any(axis=0).all()
    else:
        assert check_dual(couple).ok
        assert check_dual(couple.swapped()).ok


# --------------------------------------------------------------------------- Delaunay-Voronoi


def test_voronoi_cells_agree_with_scipy():
    points = np.random.default_rng(1).random((2, 200))
    clip = np.array([[-1, 2, 2, -1], [-1, -1, 2, 2]])
    couple = delaunay_voronoi(points, clip)
    diagram = Voronoi(points.T)
    compared = 0
    for i, region in enumerate(diagram.regions[r] for r in diagram.point_region):
        x, y = diagram.vertices[region].T
        if -1 in region or not ((x > -1) & (x < 2) & (y > -1) & (y < 2)).all():
            continue
        area = abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2
        assert couple.b.areas[i] == pytest.approx(area, rel=1e-9)
        compared += 1
    assert compared > 170
    assert couple.b.areas.sum() == pytest.approx(9)
    at_hull = [i for i, r in enumerate(diagram.point_region) if -1 in diagram.regions[r]]
    assert couple.unbounded.tolist() == at_hull


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 40), st.sampled_from(["hull", "box", "hexagon"]))
def test_voronoi_cells_hold_the_nearest_points(seed, n, kind):
    rng = np.random.default_rng(seed)
    points = rng.random((2, n))
    turn = np.pi / 3 * np.arange(6)
    clip = {"hull": "hull", "box": None}.get(
        kind, 0.5 + 2 * np.stack([np.cos(turn), np.sin(turn)])
    )
    couple = delaunay_voronoi(points, clip)
    b = couple.b
    for i in range(len(b)):
        # any point of a cell is nearest to its own site
        share = rng.dirichlet(np.ones(b.polygons.sizes[i]), 5).T
        away = np.hypot(*((b.polygons[i] @ share)[:, :, None] - points[:, None]))
        assert (away[:, i] <= away.min(axis=1) + 1e-9).all()
    if kind == "hull":
        assert b.areas.sum() == pytest.approx(couple.a.areas.sum())
    assert condition(couple, "ribs of B as sides").ok


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 4),
    st.floats(0, 0.3),
    st.sampled_from([None, "hull"]),
)
def test_dual_if_and_only_if_acute(seed, n, jitter, clip):
    """Fig. 2c: Definitions 1 and 3, or 2, hold if and only if all triangles are acute."""
    points = lattice(n, jitter, seed)
    couple = delaunay_voronoi(points, clip)
    t = couple.a.polygons.indices.reshape(-1, 3).T
    c, b, a = MeshQuality(MeshTri(points, t.copy())).sides ** 2
    margin = ((b + c - a) / a).min()
    assume(abs(margin) > 1e-6)
    report = check_dual(couple)
    assert report.ok == (margin > 0)
    if margin <= 0:
        obtuse = set(np.nonzero(b + c - a <= 0)[0])
        missed = {("Definition 1, condition 2", "cell of A")}
        assert missed <= set(violated(couple))
        wrong = condition(couple, "node of B in each cell of A (Definition 1, condition 2")
        # exactly the obtuse triangles do not contain their circumcentres
        assert set(wrong.offending) == obtuse


def test_both_cases_of_fig_2c_occur():
    assert check_dual(delaunay_voronoi(lattice(3, 0.05))).ok
    assert check_dual(delaunay_voronoi(lattice(2), "hull")).ok
    assert not check_dual(delaunay_voronoi(np.random.default_rng(0).random((2, 40)))).ok
    # right angles: circumcentres lie on the facets
    square = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0))).reshape(2, -1)
    for clip in (None, "hull"):
        assert not check_dual(delaunay_voronoi(square, clip)).ok


def test_points_on_one_line_of_the_hull():
    """Turned, so that they are on the line to rounding only; all are nodes of B."""
    square = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0))).reshape(2, -1)
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    for points in (square, turn @ square):
        couple = delaunay_voronoi(points, "hull")
        assert len(couple.a) == 50
        assert couple.a.areas.sum() == pytest.approx(25)
        assert sorted(np.unique(couple.b.areas.round(9))) == [0.25, 0.5, 1.0]
        p = couple.b.polygons.p
        for i in boundary_nodes(couple.a):
            assert np.hypot(*(p - points[:, [i]])).min() < 1e-12


@pytest.mark.parametrize(
    ("points", "clip", "message"),
    [
        (np.zeros((3, 5)), None, r"points of shape \(2, n\)"),
        ([[0, 1, np.nan], [0, 0, 1]], None, "finite points"),
        ([[0, 1], [0, 0]], None, "points with at least 3 items"),
        ([[0, 1, 2], [0, 1, 2]], None, "one line"),
        ([[0, 1, 0, 0], [0, 0, 1, 0]], None, "coincide"),
        ([[0, 1, 0], [0, 0, 1]], "outline", "'hull' or a convex polygon"),
        ([[0, 1, 0], [0, 0, 1]], [[0, 1]], "shape"),
        ([[0, 1, 0], [0, 0, 1]], [[-1, 3, 0, -1], [-1, -1, 0, 3]], "convex polygon"),
        ([[0, 1, 0], [0, 0, 1]], [[-1, 0.5, 0.5, -1], [-1, -1, 3, 3]], "inside clip; 1 are"),
    ],
)
def test_points_and_clips_at_fault(points, clip, message):
    with pytest.raises(MeshError, match=message):
        delaunay_voronoi(points, clip)


def test_clockwise_clip():
    points, clip = lattice(2), np.array([[-3.0, 5, 5, -3], [-3, -3, 5, 5]])
    areas = delaunay_voronoi(points, clip).b.areas
    assert delaunay_voronoi(points, clip[:, ::-1]).b.areas == pytest.approx(areas)


# ------------------------------------------------------------------------------------ drawing


def test_layers(couple):
    from skfem_dual.visuals.style import layers

    drawn = {layer.label: layer for layer in layers(couple, nodes=True)}
    assert {"grid A", "grid B", "nodes of A", "nodes of B"} <= set(drawn)
    assert drawn["grid A"].color != drawn["grid B"].color
    lines = [layer for layer in drawn.values() if layer.facets is not None]
    # the first layer spans the picture
    for corner in ("min", "max"):
        found = getattr(next(iter(drawn.values())).p, corner)(axis=1)
        assert found == pytest.approx(getattr(np.hstack([x.p for x in lines]), corner)(axis=1))
    assert len(list(layers(couple, nodes=False))) == len(drawn) - 2


def test_unknown_things_are_not_drawn():
    from skfem_dual.visuals.style import layers

    with pytest.raises(TypeError, match="GridCouple to draw, got an array"):
        list(layers(polar(3, 8).p, nodes=False))


@pytest.mark.parametrize("size", [1e-80, 1e-3, 1.0, 1e5, 1e78])
@pytest.mark.parametrize("away", [0.0, 1e5, 1e9])
def test_verdicts_do_not_depend_on_place_size_and_direction(size, away):
    mesh = generate.disc(n=60)
    turn = np.array([[np.cos(1), -np.sin(1)], [np.sin(1), np.cos(1)]])
    mesh = MeshTri(size * (turn @ mesh.p + [[away], [-0.7 * away]]), mesh.t)
    dual = DualMesh.from_mesh(mesh)
    for couple in (
        dual,
        minimal_couple(dual),
        maximal_couple(dual),
        delaunay_voronoi(mesh.p),
        delaunay_voronoi(mesh.p, "hull"),
    ):
        assert check_dual(couple).ok
    couple = GridCouple.from_dual(dual)
    assert not check_dual(replace(couple, node_in_b=np.roll(couple.node_in_b, 1))).ok
    shifted = dual.p + 0.01 * size * (np.arange(dual.p.shape[1]) >= dual.mesh.nelements)
    other = replace(couple.b, polygons=replace(dual.polygons, p=shifted))
    found = [c.expected for c in check_dual(replace(couple, b=other)).violated]
    assert any("boundary of A on that of B" in expected for expected in found)


@pytest.mark.parametrize("flatness", [1e-3, 1e-6, 1e-8, 1e-11])
def test_maximal_couples_of_flat_meshes_are_right_or_refused(flatness):
    mesh = MeshTri.init_tensor(np.linspace(0, 1, 6), flatness * np.linspace(0, 5, 6))
    if flatness < 1e-7:
        with pytest.raises(MeshError, match="flatter ones"):
            maximal_couple(mesh)
    else:
        assert check_dual(maximal_couple(mesh)).ok


@pytest.mark.parametrize("at", [0.0, 5e6])
def test_voronoi_cells_far_from_the_origin(at):
    """Points on a straight side of the hull made slivers there."""
    places = [(i + j / 2, j * 0.75**0.5) for i in range(8) for j in range(8) if 4 <= i + j <= 10]
    turn = np.array([[np.cos(0.77), -np.sin(0.77)], [np.sin(0.77), np.cos(0.77)]])
    couple = delaunay_voronoi(turn @ np.array(places).T + at, "hull")
    assert len(couple.a) == 66
    assert check_dual(couple).ok
    square = turn @ np.array([[0, 4, 8, 8, 0, 0.0], [0, 0, 0, 6, 6, 0]]) + at
    inside = turn @ np.mgrid[1:8, 1:6].reshape(2, -1) + at
    closed, middle = (delaunay_voronoi(inside, c) for c in (square, square[:, [0, 2, 3, 4]]))
    assert closed.b.areas.sum() == pytest.approx(48, rel=1e-7)
    concave = turn @ np.array([[0, 1, 1, 8, 8, 4, 4, 0.0], [0, 0, 0, 0, 3, 3, 6, 6]]) + at
    with pytest.raises(MeshError, match="clip to be a convex polygon"):
        delaunay_voronoi(inside, concave)
    assert closed.b.areas == pytest.approx(middle.b.areas, rel=1e-6)
