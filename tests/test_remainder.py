"""The remainder's integrals over cells, against quadrature of the influence function."""

import numpy as np
import pytest
from marks import slow
from plans import perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace, RigidPunch
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.elements.influence import influence_matrix, surface_displacement
from skfem_dual.elements.near import NearField
from skfem_dual.elements.pieces import Pieces
from skfem_dual.grids.outline import edge_ribs
from skfem_dual.grids.partition import Partition

TRIANGLES = ElementTriP0()
RULE = np.polynomial.legendre.leggauss(24)
GROUNDS = {
    "graded": GradedHalfSpace.init_linear(2.0, 0.25, 1.5),
    "layered": LayeredHalfSpace([Layer(0.7, 2.0, 0.3)], "bonded"),
}
BASES = {
    "dual": DualMesh.from_mesh(perturbed(rectangle(4), 0.06)).basis(),
    "re-entrant": DualMesh.from_mesh(MeshTri.init_lshaped().refined(1)).basis(),
    "triangles": CellBasis(perturbed(rectangle(3), 0.05), ElementTriP0()),
    "polar": CellBasis(polar(2, 8), ElementQuad0()),
}


def by_quadrature(primitive, polygon, x):
    """Over the signed triangles of the point and the sides; Phi along each ray."""
    gauss, weights = RULE
    distances, factors = [], []
    for a, b in zip(polygon.T - x, np.roll(polygon, -1, axis=1).T - x, strict=True):
        d = b - a
        cross = a[0] * b[1] - a[1] * b[0]
        if abs(cross) <= 1e-13 * (d @ d):
            continue
        foot = float(np.clip(-(a @ d) / (d @ d), 0, 1))
        height = abs(cross) / np.hypot(*d)
        for start, end in ((0, foot), (foot, 1)):
            if end <= start:
                continue
            # panels that shrink towards the foot
            far = np.hypot(*d) * (end - start)
            steps = max(1, int(np.ceil(np.log2(far / height + 1))) + 2)
            edges = np.concatenate([[0.0], 2.0 ** np.arange(-steps, 1)])
            if end == foot:
                edges = 1 - edges[::-1]
            widths = (end - start) * np.diff(edges) / 2
            s = start + (end - start) * edges[:-1] + np.outer(gauss + 1, widths)
            distances.append(np.hypot(*(a[:, None] + s.ravel() * d[:, None])))
            factors.append((cross * np.outer(weights, widths)).ravel() / distances[-1] ** 2)
    return np.concatenate(factors) @ primitive(np.concatenate(distances))


@pytest.mark.parametrize("ground", ["graded", *slow("layered")])
@pytest.mark.parametrize("name", BASES)
def test_entries_equal_quadrature(name, ground):
    ground, partition = GROUNDS[ground], Partition.from_basis(BASES[name])
    x = np.hstack([partition.centroids, partition.polygons.p[:, ::4]])[:, ::5]
    x = np.hstack([x, [[1.9, 0.1], [0.3, -2.5]]])
    D = influence_matrix(ground, partition, x)
    polygons = [partition.polygons[j] for j in range(len(partition))]
    expected = np.array(
        [[by_quadrature(ground.primitive, polygon, xi) for polygon in polygons] for xi in x.T]
    )
    # relative to what each entry is on homogeneous ground, far cells too
    alone = influence_matrix(ground.surface, partition, x)
    assert np.abs((D - expected) / alone).max() < 2e-9


@pytest.mark.parametrize("ground", [*slow("graded"), "layered"])
@pytest.mark.parametrize("name", BASES)
def test_entries_of_weighted_cells_equal_quadrature(name, ground):
    """Of the pieces that stand for them."""
    ground, partition = GROUNDS[ground], Partition.from_basis(BASES[name])
    weights = EdgeWeights.from_basis(BASES[name], partition, edge_ribs(partition))
    x = np.array([[0.31, 1.2, -3.5, 40.0], [0.17, 0.4, 1.0, 3.0]])
    pieces = Pieces.from_partition(partition, weights)
    some = np.arange(len(partition))[:: max(1, len(pieces.density) // 10)]
    ends = np.append(pieces.first, len(pieces.density))

    def beyond(r):
        # the part c / r is that of uniform cells here, see `EdgeCorrection`
        return ground.primitive(r) - ground.surface.primitive(r)

    def rest(cell, xi):
        total = 0.0
        for k in range(ends[cell], ends[cell + 1]):
            v = pieces.vertices[:, pieces.offsets[k] : pieces.offsets[k + 1]]
            total += pieces.density[k] * by_quadrature(beyond, v, xi)
        return total

    alone = influence_matrix(ground.surface, partition, x)[:, some]
    D = influence_matrix(ground, partition, x, weights)[:, some]
    expected = np.array([[rest(cell, xi) for cell in some] for xi in x.T])
    assert np.abs((D - alone - expected) / alone).max() < 2e-9


@pytest.mark.parametrize("name", ["graded", *slow("layered")])
@pytest.mark.parametrize("kind", ["dual", *slow("triangles"), "structured"])
def test_rotated_plans_have_the_same_matrix(name, kind):
    """Some cells lie just where one rule takes over from another."""

    def turned(angle):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        if kind == "structured":
            line = np.linspace(-1, 1, 17)
            mesh = MeshQuad.init_tensor(line, line)
            basis = CellBasis(MeshQuad(turn @ mesh.p, mesh.t), ElementQuad0())
        else:
            mesh = rectangle(12)
            mesh = MeshTri(turn @ mesh.p, mesh.t)
            dual = kind == "dual"
            basis = DualMesh.from_mesh(mesh).basis() if dual else CellBasis(mesh, TRIANGLES)
        punch = RigidPunch(GROUNDS[name], basis)
        return punch.matrix, punch.solve(1.0, at=tuple(turn @ [0.3, 0.1]))

    plain, first = turned(0.0)
    for angle in (0.3, np.pi / 4):
        matrix, second = turned(angle)
        assert np.abs(matrix - plain).max() < 5e-10 * np.abs(plain).max()
        assert second.settlement == pytest.approx(first.settlement, rel=1e-10)
        assert second.pressure == pytest.approx(first.pressure, abs=1e-8 * first.pressure.max())


@pytest.mark.parametrize("name", GROUNDS)
def test_symmetry_leaves_no_gap_in_the_full_matrix(name):
    basis = DualMesh.from_mesh(rectangle(12)).basis()
    full = RigidPunch(GROUNDS[name], basis)
    solution = RigidPunch(GROUNDS[name], basis, symmetry="auto").solve(1.0, at=(0.2, 0.1))
    settled = full.matrix @ solution.pressure
    plane = solution.collocated_settlement + solution.collocated_tilt @ full.collocation_points
    assert np.abs(settled - plane).max() < 1e-9 * abs(solution.settlement)


def test_finer_cells_meet_the_circle():
    """The sum of all entries is the settlement under a uniform load."""
    ground = GROUNDS["graded"]
    square = Partition.from_basis(DualMesh.from_mesh(rectangle(24)).basis())
    coarse = Partition.from_basis(DualMesh.from_mesh(rectangle(3)).basis())
    x = np.array([[0.0, 0.9, 3.0], [0.0, 0.2, 1.0]])
    whole = [influence_matrix(ground, part, x).sum(axis=1) for part in (square, coarse)]
    assert whole[0] == pytest.approx(whole[1], rel=2e-5)


def test_without_a_matrix():
    ground, partition = GROUNDS["layered"], Partition.from_basis(BASES["dual"])
    rng = np.random.default_rng(0)
    pressure, x = rng.standard_normal(len(partition)), rng.uniform(-2, 2, (2, 300))
    D = influence_matrix(ground, partition, x)
    w = surface_displacement(ground, partition, pressure, x)
    assert w == pytest.approx(D @ pressure, abs=1e-12)


def test_beyond_the_table():
    tiny = GradedHalfSpace.init_linear(1.0, 0.25, 1e9)
    with pytest.raises(ValueError, match="range of the substrate's table"):
        influence_matrix(tiny, Partition.from_basis(BASES["dual"]), [[0.0], [0.0]])


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("name", BASES)
def test_pieces_carry_the_load_of_their_cells(name, weighted):
    """Its sum is the area of the cell, its centroid that of the pressure."""
    partition = Partition.from_basis(BASES[name])
    weights = None
    if weighted:
        weights = EdgeWeights.from_basis(BASES[name], partition, edge_ribs(partition))
        assert weights.weighted.any()
    pieces = Pieces.from_partition(partition, weights)
    middles = (partition if weights is None else weights).centroids
    for j in range(len(partition)):
        total, first = 0.0, np.zeros(2)
        for k in range(pieces.first[j], pieces.last[j]):
            v = pieces.vertices[:, pieces.offsets[k] : pieces.offsets[k + 1]]
            w = np.roll(v, -1, axis=1)
            cross = v[0] * w[1] - v[1] * w[0]
            load = pieces.density[k] * cross.sum() / 2
            total += load
            first += load * np.sum((v + w) * cross, axis=1) / (3 * cross.sum())
        assert total == pytest.approx(partition.areas[j], rel=1e-12)
        assert first / total == pytest.approx(middles[:, j], abs=1e-12)


def test_homogeneous_ground_has_none():
    assert HalfSpace(1.0, 0.2).remainder is None


@pytest.mark.parametrize(
    "ground",
    [
        GradedHalfSpace.init_linear(young=1.0, poisson=0.5, gradient=50.0),
        LayeredHalfSpace([Layer(0.02, 50.0, 0.3)], base=HalfSpace(1.0, 0.3)),
    ],
)
@pytest.mark.parametrize(("regular", "rtol"), [(False, 1e-6), *slow((True, 1e-5), (True, 1e-6))])
def test_series_serve_from_where_they_are_good(ground, regular, rtol):
    """Of regular hexagons, whose harmonic moments vanish, and of unequal ones."""
    mesh = perturbed(MeshTri.init_tensor(*[np.linspace(0, 1, 24)] * 2), 0.0 if regular else 0.01)
    sheared = MeshTri([[1.0, -0.5], [0.0, np.sqrt(0.75)]] @ mesh.p, mesh.t)
    cells = DualMesh.from_mesh(sheared).basis().partition
    x, each = cells.centroids, np.arange(len(cells))
    near = NearField.from_partition(ground, cells, None, each, rtol)
    found = np.empty(len(cells) ** 2)
    near.fill(x, np.array([[0], [len(cells)]]), (np.array([0, len(cells)]), each), found)
    error = found.reshape(len(cells), -1) - influence_matrix(ground, cells, x)
    r = np.hypot(*(x[:, :, None] - x[:, None])) + np.sqrt(cells.areas) / 4
    relative = np.abs(error) / (ground.singular_coefficient * cells.areas / r) / rtol
    assert relative.max() < 20
    assert relative.mean() < 0.3
