import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plans import disc, perturbed, polar, rectangle
from scipy.integrate import quad
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace
from skfem_dual.contact.exact import uniform_circle_displacement
from skfem_dual.elements.influence import influence_matrix, surface_displacement
from skfem_dual.grids.partition import Partition

SOIL = HalfSpace(1.0, 0.0)


def settlement_by_quadrature(polygon, x):
    """1/(pi E*) times the integral of 1/r over a polygon, by adaptive quadrature.

    Over each triangle of the point and a side: in x + s (a + t (b - a) - x) the integrand 1/r
    cancels against the Jacobian's s, what remains is a smooth function of t.
    """
    total = 0.0
    for a, b in zip(polygon.T - x, np.roll(polygon, -1, axis=1).T - x, strict=True):
        d = b - a
        cross = a[0] * b[1] - a[1] * b[0]
        if abs(cross) <= 1e-15 * (d @ d):
            continue
        foot = np.clip(-(a @ d) / (d @ d), 0, 1)
        for lower, upper in ((0, foot), (foot, 1)):
            if upper > lower:
                part, _ = quad(
                    lambda t: 1 / np.hypot(*(a + t * d)),  # noqa: B023
                    lower,
                    upper,
                    epsabs=0,
                    epsrel=1e-13,
                    limit=400,
                )
                total += cross * part
    return total / np.pi


@pytest.mark.parametrize(
    "partition",
    [
        DualMesh.from_mesh(perturbed(rectangle(4), 0.06)).partition,
        DualMesh.from_mesh(MeshTri.init_lshaped().refined(1)).partition,
        Partition.from_mesh(perturbed(rectangle(3), 0.05)),
        Partition.from_mesh(polar(2, 8)),
    ],
    ids=["dual cells", "re-entrant dual cells", "triangles", "polar cells"],
)
def test_entries_equal_adaptive_quadrature(partition):
    nodes = partition.polygons.p[:, ::9]  # vertices of cells
    ribs = partition.polygons.p[:, partition.facets[:, ::21]].mean(axis=2)  # points on ribs
    x = np.hstack([partition.centroids[:, ::2], nodes, ribs, [[3.0, -4.0], [0.1, 6.0]]])
    D = influence_matrix(SOIL, partition, x)
    expected = np.array(
        [
            [settlement_by_quadrature(partition.polygons[j], xi) for j in range(len(partition))]
            for xi in x.T
        ]
    )
    assert pytest.approx(expected, rel=1e-12, abs=1e-15) == D


def test_rows_do_not_depend_on_others():
    """Ribs are near, far and farther from some points, or from all that are looked at together."""
    partition = DualMesh.from_mesh(rectangle(3)).partition
    angle, r = np.linspace(0, 40, 70), np.geomspace(0.1, 60, 70)
    for x in (r * [np.cos(angle), np.sin(angle)], (r + 40) * [np.cos(angle), np.sin(angle)]):
        together = influence_matrix(SOIL, partition, x)
        alone = [influence_matrix(SOIL, partition, xi[:, None])[0] for xi in x.T]
        assert together == pytest.approx(np.array(alone), rel=1e-12)
        pressure = np.random.default_rng(0).normal(size=(len(partition), 2))
        sums = surface_displacement(SOIL, partition, pressure, x)
        assert sums == pytest.approx(together @ pressure, rel=1e-12, abs=1e-13)


def test_square_and_circle_in_closed_form():
    square = Partition.from_mesh(rectangle(6))
    w = influence_matrix(SOIL, square, [[0.0, 1.0], [0.0, 1.0]]).sum(axis=1)
    assert w == pytest.approx([8 * np.arcsinh(1) / np.pi, 4 * np.arcsinh(1) / np.pi], rel=1e-13)
    soil = HalfSpace(2.0, 0.3)
    fine = DualMesh.from_mesh(disc(5)).partition
    r = np.array([0.0, 0.4, 0.8, 1.3, 5.0])
    w = surface_displacement(soil, fine, np.full(len(fine), 3.0), [r, 0 * r])
    assert w == pytest.approx(uniform_circle_displacement(r, 3.0, 1.0, 2.0, 0.3), rel=3e-4)


def test_far_cells_act_as_forces():
    partition = DualMesh.from_mesh(disc(2)).partition
    for distance in (1e2, 1e4, 1e6):
        D = influence_matrix(SOIL, partition, [[distance], [0.0]])
        expected = partition.areas * SOIL.influence(
            np.hypot(distance - partition.centroids[0], partition.centroids[1])
        )
        # the area's second moment and rounding in the sum over the ribs
        tolerance = 0.1 / distance**2 + 1e-15 * distance
        assert D[0] == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize(
    "soil", [SOIL, LayeredHalfSpace([Layer(1.0, 2.0, 0.3)], HalfSpace(5.0, 0.2))], ids=str
)
def test_surface_displacement_is_the_matrix_times_the_pressure(soil):
    partition = DualMesh.from_mesh(perturbed(rectangle(6), 0.04)).partition
    rng = np.random.default_rng(0)
    pressures, x = rng.standard_normal((len(partition), 3)), rng.uniform(-2, 2, (2, 300))
    D = influence_matrix(soil, partition, x)
    w = surface_displacement(soil, partition, pressures, x)
    assert w == pytest.approx(D @ pressures, abs=1e-13)
    one = surface_displacement(soil, partition, pressures[:, 1], x)
    assert one == pytest.approx(w[:, 1], abs=1e-15)
    nowhere = surface_displacement(soil, partition, pressures, np.empty((2, 0)))
    assert nowhere.shape == (0, 3)


MESH = perturbed(rectangle(4), 0.05)


def matrix(mesh, x):
    return influence_matrix(SOIL, DualMesh.from_mesh(mesh).partition, x)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0, 2 * np.pi),
    st.floats(-10, 10),
    st.floats(1e-3, 1e3),
    st.integers(0, 2**32 - 1),
)
def test_invariances(angle, shift, factor, seed):
    """Rotated, moved, scaled, renumbered with triangles turned over: the same entries."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-2, 2, (2, 5))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    move = lambda p: factor * (turn @ p + shift)  # noqa: E731
    n, m = MESH.p.shape[1], MESH.nelements
    number = rng.permutation(n)
    t = number[MESH.t][:, rng.permutation(m)]
    turned = rng.random(m) < 0.5
    t[:, turned] = t[::-1, turned]
    other = MeshTri(move(MESH.p)[:, np.argsort(number)].copy(), t.copy(), sort_t=False)
    expected = factor * matrix(MESH, x)
    assert matrix(other, move(x))[:, number] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("x", "message"),
    [
        ([0.0, 0.0], r"shape \(2, m\), got \(2,\)"),
        (np.zeros((3, 2)), r"got \(3, 2\)"),
        ([[0.0, np.nan], [0.0, 0.0]], "expected finite x, got nan at point 1"),
    ],
)
def test_bad_points(x, message):
    with pytest.raises(ValueError, match=message):
        influence_matrix(SOIL, Partition.from_mesh(MESH), x)
