"""Stresses and displacements below uniformly loaded cells, against independent solutions."""

import dataclasses

import numpy as np
import pytest
from plans import disc, perturbed, polar, rectangle
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch, RigidPunches
from skfem_dual.contact.below import displacement_below, stress_below, vertical_section
from skfem_dual.elements.influence import surface_displacement
from skfem_dual.elements.stresses import displacements, stresses
from skfem_dual.grids.partition import Partition

SOIL = HalfSpace(2.0, 0.3)
DUAL = DualMesh.from_mesh(MeshTri.init_lshaped().refined(1))
PRESSURE = np.random.default_rng(0).uniform(-1, 2, len(DUAL))
POINTS = np.random.default_rng(1).uniform([-1.5, -1.5, 0.3], [1.5, 1.5, 2], (40, 3)).T
FORCE = PRESSURE @ DUAL.partition.areas


def point_force(x, nu):
    """Six stresses, and 2 G times three displacements, of a unit force (Johnson, (3.18-19))."""
    x, y, z = x
    rr, R = x**2 + y**2, np.sqrt(x**2 + y**2 + z**2)
    c, a = (1 - 2 * nu) / rr, (1 - z / R) / rr
    components = [
        c * (a * (x**2 - y**2) + z * y**2 / R**3) - 3 * z * x**2 / R**5,
        c * (a * (y**2 - x**2) + z * x**2 / R**3) - 3 * z * y**2 / R**5,
        -3 * z**3 / R**5,
        c * (a * x * y * 2 - x * y * z / R**3) - 3 * x * y * z / R**5,
        -3 * y * z**2 / R**5,
        -3 * x * z**2 / R**5,
        -(x * z / R**3 - (1 - 2 * nu) * x / (R * (R + z))),
        -(y * z / R**3 - (1 - 2 * nu) * y / (R * (R + z))),
        -(z**2 / R**3 + 2 * (1 - nu) / R),
    ]
    return -np.array(components) / (2 * np.pi)


def by_quadrature(partition, pressure, x, nu, n=30):
    """Point forces over all cells: Gauss, on the triangles of each side and the centroid."""
    s, w = np.polynomial.legendre.leggauss(n)
    s, w = (s + 1) / 2, w / 2
    total = 0.0
    for i, q in enumerate(pressure):
        polygon, o = partition.polygons[i], partition.centroids[:, i : i + 1]
        for a, b in zip(polygon.T, np.roll(polygon, -1, axis=1).T, strict=True):
            a, b = a[:, None] - o, b[:, None] - o
            u, v = (k.ravel() for k in np.meshgrid(s, s))
            weight = np.outer(w, w).ravel() * v * (a[0] * b[1] - a[1] * b[0])
            at = o + v * (a + u * (b - a))
            d = x[:, :, None] - np.vstack([at, 0 * u])[:, None]
            total = total + q * point_force(d, nu) @ weight
    return total


def all_components(partition, pressure, x, soil=SOIL):
    """Six stresses, and 2 G times three displacements."""
    two_g = soil.young / (1 + soil.poisson)
    u = displacements(soil, partition, pressure, x)
    return np.vstack([*stresses(soil, partition, pressure, x), two_g * u])


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
@pytest.mark.parametrize(
    "partition",
    [DUAL.partition, Partition.from_mesh(polar(2, 7))],
    ids=["re-entrant dual cells", "polar cells"],
)
def test_point_forces_integrated(partition, poisson):
    pressure = np.random.default_rng(2).uniform(-1, 2, len(partition))
    x = POINTS[:, :12]
    found = all_components(partition, pressure, x, HalfSpace(2.0, poisson))
    expected = by_quadrature(partition, pressure, x, poisson)
    assert found == pytest.approx(expected, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_axis_of_a_circle(poisson):
    """Johnson, (3.33)."""
    mesh = polar(1, 2000)
    partition = Partition.from_mesh(mesh)
    z = np.array([1e-3, 0.1, 0.5, 1.0, 3.0, 20.0])
    s = stresses(
        HalfSpace(1.0, poisson), partition, np.full(len(partition), 2.0), [0 * z, 0 * z, z]
    )
    c = z / np.hypot(1, z)
    radial = 1 + 2 * poisson - 2 * (1 + poisson) * c + c**3
    assert s.sigma_z == pytest.approx(2 * (1 - c**3), rel=1e-5)
    assert s.sigma_x == pytest.approx(radial, abs=1e-5)
    assert s.sigma_y == pytest.approx(radial, abs=1e-5)
    assert np.abs([s.tau_xy, s.tau_yz, s.tau_zx]).max() < 1e-13


@pytest.mark.parametrize("z", [1e-6, 0.1, 1.0, 10.0, 100.0])
def test_corner_of_a_rectangle(z):
    """Newmark 1935; Steinbrenner's sum of corners gives the middle."""
    a, b = 2.0, 3.0
    one, two, both = a * a + z * z, b * b + z * z, np.sqrt(a * a + b * b + z * z)
    corner = np.arctan(a * b / (z * both)) + a * b * z / both * (1 / one + 1 / two)
    partition = Partition.from_mesh(rectangle(4, a / 2, b / 2))
    x = np.array([[a / 2, -a / 2], [b / 2, b / 2], [z, z]])
    s = stresses(SOIL, partition, np.ones(len(partition)), x)
    assert s.sigma_z == pytest.approx(corner / (2 * np.pi), rel=1e-12)
    double = Partition.from_mesh(rectangle(4, a, b))
    middle = stresses(SOIL, double, np.ones(len(double)), [[0.0], [0.0], [z]])
    assert middle.sigma_z == pytest.approx(4 * corner / (2 * np.pi), rel=1e-12)


def test_surface_is_the_limit():
    partition = DUAL.partition
    x = np.vstack([partition.centroids, np.full(len(partition), 1e-9)])
    s = stresses(SOIL, partition, PRESSURE, x)
    assert s.sigma_z == pytest.approx(PRESSURE, abs=1e-12)
    assert np.abs([s.tau_yz, s.tau_zx]).max() < 1e-12
    # Johnson, (3.20): on the surface sigma_x + sigma_y = (1 + 2 nu) p
    assert s.sigma_x + s.sigma_y == pytest.approx((1 + 2 * SOIL.poisson) * PRESSURE, abs=1e-7)
    # at nodes and ribs of the surface too the displacements remain finite and continuous
    x = np.hstack([partition.centroids, partition.polygons.p])
    u = displacements(SOIL, partition, PRESSURE, np.vstack([x, np.full(x.shape[1], 1e-9)]))
    w = surface_displacement(SOIL, partition, PRESSURE, x)
    assert u[2] == pytest.approx(w, abs=1e-7)


def test_force_crosses_every_plane():
    depth = 2.0
    s, w = np.polynomial.legendre.leggauss(40)
    slope, turn = np.pi / 4 * (s + 1), 2 * np.pi * np.arange(80) / 80
    r = depth * np.tan(slope)
    x = np.stack([np.outer(r, np.cos(turn)), np.outer(r, np.sin(turn))]).reshape(2, -1)
    weight = np.repeat(np.pi / 4 * w * depth / np.cos(slope) ** 2 * r * 2 * np.pi / 80, 80)
    found = stresses(SOIL, DUAL.partition, PRESSURE, np.vstack([x, np.full(len(weight), depth)]))
    moments = DUAL.partition.centroids @ (PRESSURE * DUAL.partition.areas)
    assert found.sigma_z @ weight == pytest.approx(FORCE, rel=1e-11)
    assert x @ (found.sigma_z * weight) == pytest.approx(moments, abs=1e-7)
    assert [found.tau_zx @ weight, found.tau_yz @ weight] == pytest.approx([0, 0], abs=1e-12)


def derivatives(f, h=4e-3):
    """Derivatives of f(POINTS) by x, y, z in front, differences of sixth order."""
    steps = h * np.eye(3)[:, :, None]
    at = lambda k: np.array([f(POINTS + k * step) for step in steps])  # noqa: E731
    return (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + at(3) - at(-3)) / (60 * h)


def test_balance_of_forces_and_law_of_hooke():
    tensor = lambda x: stresses(SOIL, DUAL.partition, PRESSURE, x).tensor  # noqa: E731
    divergence = np.einsum("iijm->jm", derivatives(tensor))
    assert divergence == pytest.approx(0, abs=1e-10)
    du = derivatives(lambda x: displacements(SOIL, DUAL.partition, PRESSURE, x))
    strain, nu = (du + du.swapaxes(0, 1)) / 2, SOIL.poisson
    volume = nu / (1 - 2 * nu) * np.eye(3)[:, :, None] * np.einsum("iim->m", strain)
    cauchy = SOIL.young / (1 + nu) * (strain + volume)
    assert tensor(POINTS) == pytest.approx(-cauchy, abs=1e-10)


@pytest.mark.parametrize("distance", [1e2, 1e3])
def test_far_away_a_point_force(distance):
    areas, centroids = DUAL.partition.areas, DUAL.partition.centroids
    centre = np.append(centroids @ (PRESSURE * areas) / FORCE, 0)[:, None]
    x = distance * POINTS / np.linalg.norm(POINTS, axis=0) + centre
    found = all_components(DUAL.partition, PRESSURE, x)
    expected = FORCE * point_force(x - centre, SOIL.poisson)
    scale = np.linalg.norm(expected[:6], axis=0)
    # the second moments, and rounding in the sum over the ribs
    tolerance = 10 / distance**2 + 1e-14 * distance**2
    assert (np.abs(found - expected)[:6] / scale).max() < tolerance
    assert found[6:] == pytest.approx(expected[6:], abs=tolerance / distance)


def test_symmetry_of_a_square():
    partition = Partition.from_mesh(rectangle(2))
    x, ones = POINTS, np.ones(len(partition))
    s = all_components(partition, ones, x)
    mirrored = all_components(partition, ones, x * [[-1], [1], [1]])
    sign = np.array([1, 1, 1, -1, 1, -1, -1, 1, 1])[:, None]
    assert mirrored == pytest.approx(sign * s, abs=1e-13)
    swapped = all_components(partition, ones, x[[1, 0, 2]])
    assert swapped == pytest.approx(s[[1, 0, 2, 3, 5, 4, 7, 6, 8]], abs=1e-13)


@pytest.mark.parametrize(("angle", "factor"), [(0.7, 1.0), (2.0, 1e3), (-3.0, 1e-3)])
def test_tensor_turns_with_the_plan(angle, factor):
    mesh = perturbed(rectangle(4), 0.05)
    Q = np.eye(3)
    Q[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    shift = np.array([[3.0], [-2.0], [0.0]])
    other = MeshTri(factor * (Q[:2, :2] @ mesh.p + shift[:2]), mesh.t)
    one, two = (DualMesh.from_mesh(m).partition for m in (mesh, other))
    q, x = PRESSURE.mean() + np.arange(len(one)) % 3, factor * (Q @ POINTS + shift)
    turned = np.einsum("ij,jkm,lk->ilm", Q, stresses(SOIL, one, q, POINTS).tensor, Q)
    assert stresses(SOIL, two, q, x).tensor == pytest.approx(turned, abs=1e-11)
    u = factor * Q @ displacements(SOIL, one, q, POINTS)
    assert displacements(SOIL, two, q, x) == pytest.approx(u, rel=1e-10, abs=1e-11 * factor)


@pytest.fixture(scope="module")
def solution():
    return RigidPunch(SOIL, DualMesh.from_mesh(disc(4)).basis()).solve(force=np.pi)


def test_below_a_rigid_circle(solution):
    """sigma_z = p (1 + 3 z^2) / (2 (1 + z^2)^2) on the axis (Sneddon), edge weighted or not."""
    z = np.array([0.2, 0.5, 1.0, 2.0, 5.0])
    x = np.array([0 * z, 0 * z, z])
    s = stress_below(solution, x)
    assert s.sigma_z == pytest.approx((1 + 3 * z**2) / (2 * (1 + z**2) ** 2), rel=5e-3)
    assert s.sigma_z[-1] == pytest.approx(76 / 1352, rel=5e-4)
    u = displacement_below(solution, [[0.0], [0.0], [1e-6]])
    assert u[2] == pytest.approx(solution.settlement, rel=3e-3)


def test_vertical_section(solution):
    basis, values = vertical_section(solution, (-2.0, 0.0), (2.0, 0.0), 2.0, n=40)
    mesh = basis.mesh
    assert type(mesh) is MeshTri
    assert (np.ptp(mesh.p, axis=1) == (4.0, 2.0)).all()
    assert mesh.p[1].max() == 0.0
    assert basis.N == len(values) == 41 * 21
    at = lambda s, z: values[np.hypot(mesh.p[0] - s, mesh.p[1] + z) < 1e-9].item()  # noqa: E731
    expected = stress_below(solution, [[-0.5], [0.0], [1.0]]).sigma_z[0]
    assert at(1.5, 1.0) == pytest.approx(expected, rel=1e-12)
    cell = np.argmin(np.hypot(*solution.punch.partition.centroids))
    assert at(2.0, 0.0) == pytest.approx(solution.pressure[cell], rel=1e-6)
    assert abs(at(0.5, 0.0)) < 1e-6
    assert vertical_section(solution, (0.0, 0.0), (1.0, 0.0), 0.01, n=2)[0].N == 6


@pytest.mark.parametrize(
    ("x", "message"),
    [
        (np.zeros((2, 2)), r"x of shape \(3, m\), got \(2, 2\)"),
        ([0.0, 0.0, 1.0], r"got \(3,\)"),
        ([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]], "depths z > 0; the first that is not: 1, with z=0"),
        ([[0.0], [0.0], [-2.0]], "z=-2"),
        ([[0.0], [0.0], [np.nan]], "finite x, got nan at point 0"),
        ([[np.inf], [0.0], [1.0]], "finite x, got inf at point 0"),
    ],
)
@pytest.mark.parametrize("below", [stress_below, displacement_below])
def test_bad_points(solution, below, x, message):
    with pytest.raises(ValueError, match=message):
        below(solution, x)


@pytest.mark.parametrize(
    ("end", "depth", "n", "message"),
    [
        ((0, 0), 1.0, 5, "positive distance from start to end, got 0"),
        ((1, 0), 0.0, 5, "positive depth, got 0"),
        ((1, 0), 1.0, 0, r"n from 1 to 1e\+07, got 0"),
        ((1, 0), 1e9, 100, r"at most 1e\+07 cells"),
    ],
)
def test_empty_sections(solution, end, depth, n, message):
    with pytest.raises(ValueError, match=message):
        vertical_section(solution, (0, 0), end, depth, n)


def test_other_ground_is_refused():
    with pytest.raises(ValueError, match=r"homogeneous HalfSpace, got object.*Remedy"):
        stresses(object(), DUAL.partition, PRESSURE, POINTS)


def test_neighbours_press_too():
    """Two equal discs side by side: in the middle between them twice the stress of one."""
    soil = HalfSpace(1.0, 0.25)
    punches = []
    for x in (-1.5, 1.5):
        dual = DualMesh.from_mesh(disc(3).translated((x, 0.0)))
        punches.append(RigidPunch(soil, dual.basis(), origin=(x, 0.0)))
    both = RigidPunches(punches).solve([{"force": 1.0}] * 2).solutions
    x = np.array([[0.0], [0.0], [1.0]])
    one = both[0]
    alone = dataclasses.replace(one, others=())
    assert stress_below(one, x).sigma_z == pytest.approx(2 * stress_below(alone, x).sigma_z)
    assert displacement_below(one, x)[2] == pytest.approx(2 * displacement_below(alone, x)[2])
    assert displacement_below(one, x)[0] == pytest.approx(0.0, abs=1e-12)
    sides = [stress_below(both[k], x).sigma_z for k in (0, 1)]
    assert sides[0] == pytest.approx(sides[1])
