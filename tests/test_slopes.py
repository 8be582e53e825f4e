"""Slopes of the pressure inside the cells: exact functions, quadrature, invariances."""

import numpy as np
import pytest
from marks import slow
from plans import perturbed
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, InfluenceOperator, RigidPunch
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.elements.load_matrix import points_in_pieces
from skfem_dual.elements.slope_correction import SlopeCorrection
from skfem_dual.elements.slopes import Slopes, _plane
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import disc
from skfem_dual.grids.outline import edge_ribs
from skfem_dual.grids.partition import Partition
from skfem_dual.operators.entries import Entries

SOIL, GRADED = HalfSpace(1.0, 0.0), GradedHalfSpace.init_linear(1.0, 0.25, 0.5)
MESH = perturbed(MeshTri.init_tensor(*[np.linspace(-1, 1, 15)] * 2), 0.02)
FINE = perturbed(MeshTri.init_tensor(*[np.linspace(-1, 1, 23)] * 2), 0.02)
BASES = {
    "dual": DualMesh.from_mesh(MESH).basis(),
    "triangles": CellBasis(MESH, ElementTriP0()),
    "quadrilaterals": CellBasis(
        MeshQuad.init_tensor(*[np.linspace(-1, 1, 13)] * 2), ElementQuad0()
    ),
}


def slopes_of(basis):
    partition = Partition.from_basis(basis)
    return Slopes.from_weights(EdgeWeights.from_basis(basis, partition, edge_ribs(partition)))


def whole(fan, times=0):
    """All triangles of a fan in quarters, several times, as pieces."""
    triangle = np.arange(len(fan.cell))
    v = np.repeat(np.eye(3)[..., None], len(triangle), axis=2)
    for _ in range(times):
        a, b, c = v.swapaxes(0, 1)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        v = np.concatenate([np.stack(part, axis=1) for part in parts], axis=2)
        triangle = np.tile(triangle, 4)
    return triangle, v


@pytest.mark.parametrize("name", BASES)
def test_linear_functions_are_found(name):
    """Of a linear factor near the edge, of a linear pressure inside, the slopes are exact."""
    slopes = slopes_of(DualMesh.from_mesh(FINE).basis() if name == "dual" else BASES[name])
    weights, partition = slopes.weights, slopes.weights.partition
    on, (a, b, c) = weights.weighted, (2.0, 0.3, -0.7)
    mean = np.where(np.isnan(weights.mean), 0.0, weights.mean)
    for x, scale, rows in (
        (weights.centroids, mean, on),
        (partition.centroids, np.ones(len(on)), ~on),
    ):
        found = slopes.of(scale * (a + b * x[0] + c * x[1]))
        assert rows.sum() > 3
        assert found[:, rows] == pytest.approx(np.outer((b, c), scale[rows]), abs=1e-9)
    assert slopes.of(mean)[:, on] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("name", BASES)
def test_second_moments_are_those_of_the_law(name):
    slopes = slopes_of(BASES[name])
    weights = slopes.weights
    fan = Fan.from_basis(BASES[name])
    points = points_in_pieces(None, fan, whole(fan, 2), 4)
    near = np.isin(points.cell, weights.fan.cell)
    triangle = weights.fan.locate(points.x[:, near])
    corners = weights.root[weights.fan.t[:, triangle]] ** 2
    phi = np.sum(weights.fan.coordinates(triangle, points.x[:, near]) * corners, axis=0)
    load = points.weight.copy()
    load[near] *= weights.relative(points.cell[near], np.sqrt(phi))
    arm = points.x - weights.centroids[:, points.cell]
    for i in range(2):
        for j in range(2):
            expected = np.bincount(points.cell, load * arm[i] * arm[j])
            # the quadrature does not know the singularity on the edge
            scale = np.abs(slopes.second_moments).max()
            assert slopes.second_moments[i, j] == pytest.approx(expected, abs=0.09 * scale)


@pytest.mark.parametrize(
    ("ground", "name"),
    [
        (SOIL, "triangles"),
        (GRADED, "quadrilaterals"),
        *slow(
            (SOIL, "dual"),
            (SOIL, "quadrilaterals"),
            (GRADED, "dual"),
            (GRADED, "triangles"),
        ),
    ],
)
def test_settlements_are_those_of_the_pressure(name, ground):
    """Against points with loads, dense enough for field points between and in the cells."""
    punch = RigidPunch(ground, BASES[name])
    law, rng = punch.footprint.slopes, np.random.default_rng(1)
    q = 1 + 0.5 * rng.random(len(punch.partition))
    x = np.hstack([rng.uniform(-1.1, 1.1, (2, 12))[:, ::3], punch.collocation_points[:, ::120]])
    cells = ground, punch.partition, x, punch.weights
    added = (Entries(*cells, law).matrix() - Entries(*cells).matrix()) @ q
    points = points_in_pieces(punch.weights, punch.fan, whole(punch.fan, 1), 16)
    arm = points.x - punch.weights.centroids[:, points.cell]
    load = points.weight * np.sum(law.of(q)[:, points.cell] * arm, axis=0)
    distances = (np.hypot(*(points.x - at[:, None])).clip(1e-4) for at in x.T)
    expected = np.array([ground.influence(r) @ load for r in distances])
    assert np.abs(added).max() > 3e-3
    # what lies beyond c / r takes cells nearby for circles
    assert added == pytest.approx(expected, abs=0.05 * np.abs(added).max())


def test_forms_of_the_correction_agree(monkeypatch):
    slopes = slopes_of(BASES["triangles"])
    partition, rng = slopes.weights.partition, np.random.default_rng(0)
    n = len(partition)
    correction = SlopeCorrection.from_slopes(slopes, SOIL, partition.centroids)
    matrix = np.zeros((n, n))
    correction.add_to(matrix, slopes)
    q = rng.standard_normal(n)
    assert correction.apply(slopes.of(q)) == pytest.approx(matrix @ q, abs=1e-13)
    assert correction.diagonal(slopes) == pytest.approx(matrix.diagonal(), abs=1e-15)
    some = np.array([3, 50, 7])
    rows = np.zeros((3, n))
    correction.at(some).add_to(rows, slopes)
    assert rows == pytest.approx(matrix[some], abs=1e-15)
    monkeypatch.setattr("skfem_dual.elements.slope_correction.FEW", 100)  # so many cells
    rows = np.zeros((3, n))
    correction.at(some).add_to(rows, slopes)
    assert rows == pytest.approx(matrix[some], abs=1e-15)
    flat = rng.random(n) < 0.3
    parts = np.zeros((n, n))
    correction.add_to(parts, slopes.without(flat))
    correction.add_to(parts, slopes.without(~flat))
    assert parts == pytest.approx(matrix, abs=1e-14)
    # linear cost: as many near entries for each cell on any mesh
    assert len(correction.near.cells) < 40 * n


def test_turned_scaled_and_renumbered():
    mesh, angle = disc(n=100), 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    order = np.random.default_rng(2).permutation(mesh.p.shape[1])
    p = np.empty_like(mesh.p)
    p[:, order] = 1e3 * (turn @ mesh.p) + np.array([[4e3], [1e3]])
    here = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis())
    there = RigidPunch(
        SOIL, DualMesh.from_mesh(MeshTri(p, order[mesh.t])).basis(), origin=(4e3, 1e3)
    )
    at = np.array([0.5, 0.2])
    one = here.solve(1.0, tuple(at))
    two = there.solve(1.0, tuple(1e3 * turn @ at))
    assert two.settlement == pytest.approx(one.settlement / 1e3)
    assert two.tilt == pytest.approx(turn @ one.tilt / 1e6, rel=1e-6)
    assert 1e6 * two.pressure[order] == pytest.approx(one.pressure, abs=1e-7)
    assert (one.flat == two.flat[order]).all()


def test_pressure_between_the_edge_and_the_middle():
    """Under a circle, in any point farther than 0.1 from the edge; of the second order in h."""
    errors = []
    for n in (150, 600):
        solution = RigidPunch(SOIL, DualMesh.from_mesh(disc(n=n)).basis()).solve(1.0)
        x = np.random.default_rng(0).uniform(-1, 1, (2, 4000))
        x = x[:, np.hypot(*x) < 0.9]
        exact = 1 / (2 * np.pi * np.sqrt(1 - np.sum(x**2, axis=0)))
        errors.append(np.sqrt(np.mean((solution.pressure_at(x) / exact - 1) ** 2)))
    assert errors[1] < 2e-3
    assert errors[1] < errors[0] / 2.8


@pytest.mark.parametrize("eccentricity", [0.3, 0.5, 0.7])
def test_no_pressure_is_negative_anywhere(eccentricity):
    """Neither inside the cells nor at their corners, lifted off or not; all loads are balanced."""
    punch = RigidPunch(SOIL, DualMesh.from_mesh(disc(n=300)).basis())
    solution = punch.solve(1.0, (eccentricity, 0.1))
    rng = np.random.default_rng(0)
    x = np.hstack([rng.uniform(-1, 1, (2, 20000)), 0.9999 * punch.partition.polygons.p])
    assert solution.success
    assert np.nanmin(solution.pressure_at(x)) >= -1e-12
    assert (solution.flat is None) == (eccentricity < 1 / 3 - 0.02)
    assert solution.resultant == pytest.approx([1, eccentricity, 0.1], abs=1e-12)
    settled = solution.displacement(punch.collocation_points)
    touching = solution.pressure > 0
    expected = solution.punch_displacement(punch.collocation_points, collocated=True)
    assert settled[touching] == pytest.approx(expected[touching], abs=1e-9)


def test_operators_carry_slopes():
    """Dense, symmetric and fast ones lead to one answer, lifted off too."""
    basis = DualMesh.from_mesh(MeshTri.init_circle(3)).basis()
    dense = RigidPunch(SOIL, basis).solve(1.0, (0.5, 0.0))
    symmetric = RigidPunch(SOIL, basis, symmetry="auto").solve(1.0, (0.5, 0.0))
    assert symmetric.pressure == pytest.approx(dense.pressure, abs=1e-9)
    cells = RigidPunch(SOIL, basis).footprint
    fast = InfluenceOperator(SOIL, basis, 1e-6, "fast")
    flat = cells.flattened_operator(fast, dense.flat)
    expected = cells.flattened(dense.flat).influence(cells.collocation_points)
    assert flat @ dense.pressure == pytest.approx(expected @ dense.pressure, rel=1e-5)
    assert flat.to_dense() == pytest.approx(expected, abs=1e-6 * expected.max())


def test_strips_are_enough(monkeypatch):
    """Settlements by slopes of weighted cells converge with the number of strips."""
    found = []
    for strips in (4, 8, 32):
        monkeypatch.setattr("skfem_dual.elements.law_strips.STRIPS", strips)
        slopes = slopes_of(BASES["dual"])
        x = slopes.weights.partition.centroids
        found.append(SlopeCorrection.from_slopes(slopes, SOIL, x).apply(slopes.of(1 + x[0])))
    few, many = (np.abs(a - found[2]).max() / np.abs(found[2]).max() for a in found[:2])
    assert few < 1e-2
    assert many < few / 3


def test_cells_without_slopes_put_nothing():
    """Of the last cell that would be behind the end of an array."""
    slopes = slopes_of(BASES["dual"])
    slopes = slopes.without(np.ones(len(slopes.sloped), dtype=bool))
    nothing = np.empty(0), np.empty(0)
    begin, width = _plane.py_func(len(slopes.sloped) - 1, *slopes.around, *nothing)
    assert (begin, width) == (len(slopes.around[1]), 0)
