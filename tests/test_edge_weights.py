"""Distance to the edge, and moments of the weights, against brute force and quadrature."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from plans import disc, perturbed, polar, rectangle
from scipy.integrate import dblquad
from scipy.spatial import Delaunay
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshTri

from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace, RigidPunch
from skfem_dual.elements.edge_weights import EdgeWeights, _mean_share, mean_weight
from skfem_dual.elements.moments import load_moments, pressure_moments
from skfem_dual.elements.pieces import Pieces
from skfem_dual.grids import generate
from skfem_dual.grids.corners import signed_areas
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.outline import distance_to_segments, edge_ribs
from skfem_dual.grids.partition import Partition
from skfem_dual.ground.rigid_disc import edge_law


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 60), st.integers(0, 2**32 - 1), st.floats(0, 4))
def test_distance_equals_brute_force(n, seed, spread):
    """Segments of lengths over several orders of magnitude."""
    rng = np.random.default_rng(seed)
    a = rng.uniform(-1, 1, (2, n))
    b = a + rng.standard_normal((2, n)) * 10 ** rng.uniform(-spread, 0, n)
    x = np.hstack([rng.uniform(-3, 3, (2, 200)), a, (a + b) / 2])
    along, to = (b - a)[:, None], x[:, :, None] - a[:, None]
    s = np.clip(np.sum(to * along, 0) / np.sum(along**2, 0), 0, 1)
    expected = np.hypot(*(to - s * along)).min(axis=1)
    for one_by_one in (n, 0):  # then by trees
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("skfem_dual.grids.outline.ONE_BY_ONE", one_by_one)
            assert distance_to_segments(x, a, b) == pytest.approx(expected, abs=1e-15)


def test_distance_in_a_disc():
    mesh = disc(4)
    a, b = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]].swapaxes(0, 1)
    x = mesh.p[:, mesh.interior_nodes()]
    found = distance_to_segments(x, a, b)
    apothem = np.hypot(*(a + b)).min() / 2
    assert (found <= np.hypot(*mesh.p).max() - np.hypot(*x) + 1e-12).all()
    assert (found >= apothem - np.hypot(*x) - 1e-12).all()


@settings(max_examples=15, deadline=None)
@given(st.tuples(*[st.floats(0.05, 3)] * 3))
def test_means_over_a_triangle_equal_quadrature(roots):
    a, b, c = (np.array(r) for r in roots)

    def average(f):
        return dblquad(
            lambda v, u: f(u, v) / np.sqrt(a**2 * (1 - u - v) + b**2 * u + c**2 * v),
            0, 1, 0, lambda u: 1 - u, epsrel=1e-9,
        )[0] * 2  # fmt: skip

    assert mean_weight(a, b, c) == pytest.approx(average(lambda u, v: 1.0), rel=1e-7)
    assert _mean_share(a, b, c) == pytest.approx(average(lambda u, v: 1 - u - v), rel=1e-7)


def test_means_at_the_edge():
    """One and two vertices on the edge; the shares add up."""
    tiny, one = np.array(1e-20), np.array(1.0)
    assert mean_weight(tiny, tiny, one) == pytest.approx(8 / 3)
    assert mean_weight(tiny, one, one) == pytest.approx(4 / 3)
    assert _mean_share(one, tiny, tiny) == pytest.approx(8 / 15)
    assert _mean_share(tiny, tiny, one) == pytest.approx(16 / 15)
    a, b, c = np.random.default_rng(0).random((3, 100))
    total = _mean_share(a, b, c) + _mean_share(b, c, a) + _mean_share(c, a, b)
    assert total == pytest.approx(mean_weight(a, b, c))


BASES = {
    "dual": DualMesh.from_mesh(perturbed(rectangle(5), 0.05)).basis(),
    "re-entrant": DualMesh.from_mesh(MeshTri.init_lshaped().refined(1)).basis(),
    "primal": DualMesh.from_mesh(rectangle(5)).primal_basis(),
    "triangles": CellBasis(disc(1), ElementTriP0()),
    "polar": CellBasis(polar(3, 8), ElementQuad0()),
}


LAYER = LayeredHalfSpace([Layer(0.2, 1.0, 0.25)], "bonded")


def weights_of(basis, law=None):
    partition = Partition.from_basis(basis)
    return EdgeWeights(partition, Fan.from_basis(basis), edge_ribs(partition), law=law)


@pytest.mark.parametrize("name", BASES)
def test_fan_fills_the_cells(name):
    partition, fan = Partition.from_basis(BASES[name]), Fan.from_basis(BASES[name])
    assert np.bincount(fan.cell, fan.areas) == pytest.approx(partition.areas, rel=1e-12)
    assert np.array_equal(np.diff(fan.starts), np.bincount(fan.cell))
    # points inside, and beside the plan
    x = fan.p[:, fan.t].mean(axis=1)
    assert np.array_equal(fan.locate(x), np.arange(fan.t.shape[1]))
    assert np.array_equal(fan.locate(np.array([[9.0], [9.0]])), [-1])
    share = np.random.default_rng(0).dirichlet([1, 1, 1], fan.t.shape[1]).T
    points = np.sum(fan.p[:, fan.t] * share, axis=1)
    found = fan.locate(points)
    assert fan.coordinates(found, points).min() > -1e-9
    assert np.sum(fan.p[:, fan.t[:, found]] * fan.coordinates(found, points), 1) == (
        pytest.approx(points)
    )
    # every vertex of a cell belongs to the plan
    assert (fan.locate(partition.polygons.p) >= 0).all()


@pytest.mark.parametrize("cells", [(64, 2), *slow(((2, 64),)), (128, 1)])
def test_points_are_located_among_thin_triangles(cells, monkeypatch):
    """As many circles hold a point, whatever the shape of the triangles, in any portions."""
    lines = [np.linspace(0, 1, n + 1) for n in cells]
    fan = Fan.from_basis(CellBasis(MeshTri.init_tensor(*lines), ElementTriP0()))
    x = np.random.default_rng(0).uniform(-0.1, 1.1, (2, 5000))
    pairs, coordinates = [], Fan.coordinates

    def counted(self, triangle, x):
        pairs.append(len(triangle))
        return coordinates(self, triangle, x)

    monkeypatch.setattr(Fan, "coordinates", counted)
    found = fan.locate(x)
    assert sum(pairs) < 8 * x.shape[1]
    monkeypatch.setattr("skfem_dual.grids.fan.TOGETHER", 7)
    assert np.array_equal(fan.locate(x), found)
    assert np.array_equal(found >= 0, ((x >= 0) & (x <= 1)).all(axis=0))
    inside = found >= 0
    assert coordinates(fan, found[inside], x[:, inside]).min() >= 0


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_phi_is_the_distance(grid):
    """Also in corners, which triangles with all nodes on the edge cut off."""
    dual = DualMesh.from_mesh(rectangle(6))
    weights = weights_of(dual.basis() if grid == "dual" else dual.primal_basis())
    used = np.unique(weights.fan.t)
    distance = 1 - np.abs(weights.fan.p[:, used]).max(axis=0)
    assert weights.root[used] ** 2 == pytest.approx(distance)
    assert (weights.root > 0).all()


@pytest.mark.parametrize("law", [None, edge_law(LAYER, 1.0)], ids=["plain", "layer"])
@pytest.mark.parametrize("name", BASES)
def test_moments_equal_sums_over_small_triangles(name, law):
    """Midpoint rule on 64^2 parts of each triangle, against the means."""
    weights = weights_of(BASES[name], law)
    partition, fan = weights.partition, weights.fan
    fine = MeshTri.init_refdom().refined(6)
    u, v = fine.p[:, fine.t].mean(axis=1)
    share = np.stack([1 - u - v, u, v])
    x = np.einsum("ikt,ks->its", fan.p[:, fan.t], share)
    root = np.sqrt(np.einsum("kt,ks->ts", weights.root[fan.t] ** 2, share))
    w = 1 / root
    if law is not None:
        place = np.sqrt(law.reach) * np.linspace(0, 1, len(law.factors))
        w *= np.interp(root, place, law.factors)
    mean = np.bincount(fan.cell, fan.areas * w.mean(axis=1)) / partition.areas
    first = np.stack([np.bincount(fan.cell, fan.areas * (w * xi).mean(axis=1)) for xi in x])
    centroids = np.where(weights.weighted, first / (mean * partition.areas), partition.centroids)
    assert np.hypot(*weights.moment)[~weights.weighted] == pytest.approx(0)
    off = np.hypot(*(weights.centroids - centroids)) / np.sqrt(partition.areas)
    # where w is singular the midpoint rule loses some of the first row
    at_edge = np.minimum.reduceat(weights.root[fan.t].min(axis=0), fan.starts[:-1]) < 1e-9
    assert weights.mean[~at_edge] == pytest.approx(mean[~at_edge], rel=1e-4)
    assert weights.mean[at_edge] == pytest.approx(mean[at_edge], rel=0.1)
    assert off[~at_edge].max(initial=0) < 1e-4
    assert off[at_edge].max() < 2e-2


@pytest.mark.parametrize("name", BASES)
def test_load_of_a_cell(name):
    """Its size and first moment are exact, its second moments nearly; against sums as above."""
    weights = weights_of(BASES[name])
    partition, fan, on = weights.partition, weights.fan, weights.weighted
    moments = pressure_moments(partition, weights, 2)
    assert moments[0, 0] == pytest.approx(partition.areas, rel=1e-12)
    pieces = Pieces.from_partition(partition, weights)
    first = load_moments(pieces, weights.centroids, 1)
    assert first[[1, 0], [0, 1]] == pytest.approx(0, abs=1e-14)
    fine = MeshTri.init_refdom().refined(6)
    u, v = fine.p[:, fine.t].mean(axis=1)
    share = np.stack([1 - u - v, u, v])
    root = np.sqrt(np.einsum("kt,ks->ts", weights.root[fan.t] ** 2, share))
    load = weights.relative(np.repeat(fan.cell, share.shape[1]), root.ravel()).reshape(root.shape)
    assert (load[~on[fan.cell]] == 1).all()
    total = np.bincount(fan.cell, fan.areas * load.mean(axis=1))
    assert total == pytest.approx(partition.areas, rel=0.1)
    x, y = np.einsum("ikt,ks->its", fan.p[:, fan.t], share) - weights.centroids[:, fan.cell, None]
    second = np.stack(
        [np.bincount(fan.cell, fan.areas * (load * z).mean(axis=1)) for z in (x * x, x * y, y * y)]
    )
    polar_moment = second[0] + second[2]
    of_pieces = np.stack([2 * moments[2, 0], moments[1, 1], 2 * moments[0, 2]])
    arm = moments[[1, 0], [0, 1]] / partition.areas  # they are about the centroids of the cells
    assert arm == pytest.approx(weights.centroids - partition.centroids, abs=1e-14)
    of_pieces -= partition.areas * arm[[0, 0, 1]] * arm[[0, 1, 1]]
    off = np.abs(of_pieces - second) / polar_moment
    assert off[:, on].max() < 0.1
    assert off[:, ~on].max(initial=0.0) < 1e-3


@pytest.mark.parametrize("name", BASES)
def test_cells_far_from_the_edge_are_left_out(name):
    basis = BASES[name]
    partition = Partition.from_basis(basis)
    some = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
    full = replace(some, fan=Fan.from_basis(basis).with_cells_of(some.fan))
    assert np.array_equal(some.weighted, full.weighted)
    assert some.mean[full.weighted] == pytest.approx(full.mean[full.weighted], rel=1e-14)
    assert some.moment == pytest.approx(full.moment, rel=1e-12, abs=1e-15)
    triangles = np.nonzero(some.weighted[full.fan.cell])[0]
    roots = some.roots_in(full.fan, triangles)
    assert roots == pytest.approx(full.root[full.fan.t[:, triangles]], rel=1e-14)
    assert some.fan.p.shape[1] == len(np.unique(some.fan.t))
    nodes = np.intersect1d(some.fan.numbers, basis.mesh.t)
    at_nodes = some.fan.p[:, some.fan.places(nodes)]
    assert np.array_equal(at_nodes, full.fan.p[:, nodes])


def test_law_of_the_ground_in_the_weight():
    """w is phi^(-1/2) times the factor, in all cells alike."""
    law = edge_law(LAYER, 1.0)
    weights, plain = weights_of(BASES["dual"], law), weights_of(BASES["dual"])
    cells = np.nonzero(weights.weighted & plain.weighted)[0]
    root = np.full(len(cells), 0.4)
    found = weights.relative(cells, root) * weights.mean[cells]
    place = np.sqrt(law.reach) * np.linspace(0, 1, len(law.factors))
    assert found == pytest.approx(np.interp(0.4, place, law.factors) / 0.4)
    assert plain.relative(cells, root) * plain.mean[cells] == pytest.approx(1 / 0.4)


def test_few_cells_of_a_fine_mesh_are_near_the_edge():
    basis = DualMesh.from_mesh(disc(6)).basis()
    partition = Partition.from_basis(basis)
    weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
    near = np.unique(weights.fan.cell)
    assert weights.weighted[near].sum() == weights.weighted.sum()
    assert len(near) < 0.7 * len(partition)


def test_weighted_cells_lie_along_the_edge():
    dual = DualMesh.from_mesh(disc(5))
    weights = weights_of(dual.basis())
    r = np.hypot(*dual.centroids)
    assert weights.weighted[dual.mesh.boundary_nodes()].all()
    # a cell of width h varies by more than 10 % where it lies nearer than about 5 h
    h = np.sqrt(np.median(dual.areas))
    assert r[weights.weighted].min() > 1 - 8 * h
    assert weights.weighted[r > 1 - 2 * h].all()
    # the weight draws the load to the edge
    outward = np.sum(weights.moment * dual.centroids, axis=0)
    assert (outward[dual.mesh.boundary_nodes()] > 0).all()


def test_seam_and_middle_of_a_polar_grid_are_no_edge():
    partition = Partition.from_mesh(polar(3, 8))
    ribs = edge_ribs(partition)
    assert len(ribs) == 8
    middles = partition.polygons.p[:, partition.facets[:, ribs]].mean(axis=1)
    assert np.hypot(*middles) == pytest.approx(np.cos(np.pi / 8))


def test_relative_weight():
    weights = weights_of(BASES["dual"])
    cells = np.arange(len(weights.partition))
    at_nodes = weights.relative(cells, weights.root[cells])
    assert (at_nodes[~weights.weighted] == 1).all()
    assert np.isinf(
        weights.relative(cells[weights.weighted], np.zeros(weights.weighted.sum()))
    ).all()


@pytest.mark.parametrize(("shift", "scale"), [((4e5, -5.4e6), 1.0), ((0.0, 0.0), 0.001)])
def test_site_coordinates_and_units_do_not_change_the_law(shift, scale):
    """Points of the edge are off it by rounding; triangles are as far as four sides of theirs."""
    square, hole = [(0, 0), (3, 0), (3, 3), (0, 3)], [(1, 1), (2, 1), (2, 2), (1, 2)]
    mesh = generate.polygon(square, holes=[hole], n=110)
    bases = (DualMesh.from_mesh(m).basis() for m in (mesh, mesh.scaled(scale).translated(shift)))
    here, there = (
        EdgeWeights.from_basis(basis, basis.partition, edge_ribs(basis.partition))
        for basis in bases
    )
    assert there.fan.t.shape == here.fan.t.shape
    assert there.moment / scale**3 == pytest.approx(here.moment, abs=1e-7)


@pytest.mark.parametrize("grid", ["basis", "primal_basis"])
def test_site_coordinates_leave_pressures_their_digits(grid):
    """Differences of site coordinates are exact: only the vertices of cells are rounded, by 1e-9
    of the plan."""
    site, mesh = np.array([[5e5], [5.4e6]]), generate.rectangle(2.0, 1.0, n=600).scaled(0.3)
    there = MeshTri(mesh.p + site, mesh.t)
    here = MeshTri(there.p - site, mesh.t)
    found, expected = (
        RigidPunch(HalfSpace(1.0, 0.3), getattr(DualMesh.from_mesh(m), grid)(), origin=origin)
        for m, origin in ((there, site[:, 0]), (here, (0.0, 0.0)))
    )
    assert np.abs(found.matrix / expected.matrix - 1).max() < 1e-6
    found, expected = (punch.solve(1.0, (0.02, 0.03)) for punch in (found, expected))
    assert found.settlement == pytest.approx(expected.settlement, rel=1e-9)
    assert found.pressure == pytest.approx(expected.pressure, rel=1e-6)


def test_points_far_away_change_nothing_at_others():
    punch = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(rectangle(4)).basis())
    solution = punch.solve(1.0)
    edge = punch.basis.dual.mesh.p[0].max()
    beside = [[edge + 1e-6], [0.0]]
    assert solution.pressure_at(beside) == [0.0]
    assert solution.pressure_at(np.hstack([beside, [[1e12], [0.0]]])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("height", [2e-3, 5e-4])
def test_a_thin_cell_on_the_edge_changes_little(height):
    """Of a square, in any units and at any angle: along the axes settlements were rounding."""
    at = np.linspace(0, 1, 6)
    x, y = np.meshgrid(at, at[1:])
    p = np.hstack([[[0, 1, 0.43], [0, 0, height]], np.stack([x.ravel(), y.ravel()])])
    t = Delaunay(p.T).simplices.T
    t = t[:, np.abs(signed_areas(p, t)) > 1e-12]

    def settlement(scale, angle):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        basis = CellBasis(MeshTri(scale * turn @ p, np.ascontiguousarray(t)), ElementTriP0())
        middle = scale * turn @ [0.5, 0.5]
        found = RigidPunch(HalfSpace(1.0, 0.0), basis, origin=tuple(middle)).solve(1.0)
        assert found.success
        return scale * found.settlement

    for scale, angle in ((1.0, 0.0), (2.0, 0.0), (1000.0, 0.0), (1.0, 0.5)):
        assert settlement(scale, angle) == pytest.approx(0.8678, rel=2e-4)


def test_sides_across_the_plan_are_no_edge():
    """Of a strip one triangle wide, whose nodes all lie on the edge."""
    mesh = MeshTri.init_tensor(np.linspace(0, 10, 41), np.array([0.0, 1.0]))
    punch = RigidPunch(HalfSpace(1.0, 0.0), CellBasis(mesh, ElementTriP0()), origin=(5, 0.5))
    found = punch.solve(1.0)
    side = np.nonzero(mesh.f2t[1] >= 0)[0]
    middles = mesh.p[:, mesh.facets[:, side]].mean(axis=1)
    assert (found.pressure_at(middles) < 2 * found.mean_pressure).all()


def test_an_annulus_a_few_triangles_wide():
    """On triangles with two nodes on the edge it settled by 9e-3 too much."""
    dual = DualMesh.from_mesh(generate.annulus(0.97, 1.0, n=600))
    by_cells, by_triangles = (
        RigidPunch(HalfSpace(1.0, 0.0), basis).solve(1.0).settlement
        for basis in (dual.basis(), dual.primal_basis())
    )
    assert by_triangles == pytest.approx(by_cells, rel=5e-4)


@pytest.mark.parametrize("unit", [1.0, 0.1, 1e-3, 7.0])
def test_even_grids_have_the_symmetry_of_their_plan_in_any_unit(unit):
    """Sides that are bent by just 0.04 are not decided upon by rounding."""
    grid = MeshTri.init_tensor(np.linspace(0, 3, 11), np.linspace(0, 1, 6)).scaled(unit)
    soil, middle = HalfSpace(1.0, 0.0), (1.5 * unit, 0.5 * unit)
    basis = DualMesh.from_mesh(grid).basis()
    found = RigidPunch(soil, basis, origin=middle).solve(1.0, unilateral=False)
    assert np.abs(found.tilt).max() < 1e-11 / unit**2
