"""Stresses and displacements below cells on any ground, against independent solutions."""

import dataclasses

import burmister
import numpy as np
import pytest
from marks import slow
from plans import disc, perturbed, polar, rectangle
from scipy.integrate import simpson
from scipy.special import j1
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
    RigidPunches,
)
from skfem_dual.elements.depth import components
from skfem_dual.elements.influence import surface_displacement
from skfem_dual.elements.stresses import displacements, stresses
from skfem_dual.elements.strips import CellLoads
from skfem_dual.grids.generate import disc as polygon_of_disc
from skfem_dual.grids.partition import Partition
from skfem_dual.solutions.below import displacement_below, stress_below, vertical_section

SOIL = HalfSpace(2.0, 0.3)
DUAL = DualMesh.from_mesh(MeshTri.init_lshaped().refined(1))
PRESSURE = np.random.default_rng(0).uniform(-1, 2, len(DUAL))
POINTS = np.random.default_rng(1).uniform([-1.5, -1.5, 0.3], [1.5, 1.5, 2], (40, 3)).T
FORCE = PRESSURE @ DUAL.partition.areas
CRUST = LayeredHalfSpace([Layer(0.8, 5.0, 0.2)], HalfSpace(1.0, 0.4))
ROCK = LayeredHalfSpace([Layer(0.5, 1.0, 0.3), Layer(1.5, 0.2, 0.4)], "bonded")
LINEAR = GradedHalfSpace.init_linear(2.0, 0.3, 1.0)


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


def all_fields(ground, partition, pressure, x):
    """Six stresses and three displacements under uniform cells."""
    return components(ground, [CellLoads(partition, pressure, None)], x)


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


@pytest.mark.parametrize("poisson", [0.3, 0.5, *slow(0.0)])
@pytest.mark.parametrize(
    "partition",
    [DUAL.partition, Partition.from_mesh(polar(2, 7))],
    ids=["re-entrant dual cells", "polar cells"],
)
def test_point_forces_integrated(partition, poisson):
    pressure = np.random.default_rng(2).uniform(-1, 2, len(partition))
    x = POINTS[:, :6]
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


def whole_plane(depth):
    """Points at a depth and weights of a rule for all of their plane."""
    s, w = np.polynomial.legendre.leggauss(40)
    slope, turn = np.pi / 4 * (s + 1), 2 * np.pi * np.arange(24) / 24
    r = depth * np.tan(slope)
    x = np.stack([np.outer(r, np.cos(turn)), np.outer(r, np.sin(turn))]).reshape(2, -1)
    weight = np.repeat(np.pi / 4 * w * depth / np.cos(slope) ** 2 * r * 2 * np.pi / 24, 24)
    return np.vstack([x, np.full(len(weight), depth)]), weight


@pytest.mark.parametrize(
    ("ground", "tolerance"),
    [(SOIL, 1e-11), (CRUST, 1e-6), *slow((LINEAR, 1e-6), (ROCK, 1e-6))],
    ids=["homogeneous", "layer", "linear", "rock"],
)
def test_force_crosses_every_plane(ground, tolerance):
    x, weight = whole_plane(2.0)
    found = stresses(ground, DUAL.partition, PRESSURE, x)
    moments = DUAL.partition.centroids @ (PRESSURE * DUAL.partition.areas)
    assert found.sigma_z @ weight == pytest.approx(FORCE, rel=tolerance)
    assert x[:2] @ (found.sigma_z * weight) == pytest.approx(moments, abs=1e4 * tolerance)
    assert [found.tau_zx @ weight, found.tau_yz @ weight] == pytest.approx([0, 0], abs=tolerance)


@pytest.mark.parametrize("ground", [CRUST, *slow(LINEAR)], ids=["layer", "linear"])
def test_reciprocity(ground):
    """Betti's theorem for what lies below a plane: two loads work equally on each other there."""
    x, weight = whole_plane(1.0)
    other = DUAL.partition.centroids[0] ** 2
    one, two = (all_fields(ground, DUAL.partition, q, x) for q in (PRESSURE, other))
    works = [
        (a[[5, 4, 2]] * b[[6, 7, 8]]).sum(axis=0) @ weight for a, b in ((one, two), (two, one))
    ]
    assert works[0] == pytest.approx(works[1], rel=1e-6)
    assert abs(works[0]) > 1e-2


@pytest.mark.parametrize(
    ("ground", "weighted"),
    [(ROCK, True), *slow((CRUST, True), (ROCK, False), (LINEAR, False))],
    ids=["rock, weighted", "crust, weighted", "rock", "linear"],
)
def test_surface_of_stratified_ground_is_the_limit(ground, weighted):
    """The settlements have other tables, those of the surface."""
    punch = RigidPunch(ground, DUAL.basis(), edge="singular" if weighted else "constant")
    solution = punch.solve(1.0, at=(-0.1, -0.1), unilateral=False)
    x = np.array([[-0.31, 0.23, -0.87, 0.48, 2.0], [0.12, -0.35, -0.74, 0.53, 3.0]])
    deep = np.vstack([x, np.full(5, 1e-7)])
    w, expected = displacement_below(solution, deep)[2], solution.ground_displacement(x)
    # there the variation in these few cells acts from afar as a dipole
    tolerance = (2e-3 if weighted else 1e-4) * expected.max()
    assert w == pytest.approx(expected, abs=tolerance)
    sigma = stress_below(solution, deep)
    if not weighted:
        expected = solution.pressure_at(x)
        assert sigma.sigma_z == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    # where strips end, their tractions jump a little
    assert np.abs([sigma.tau_yz, sigma.tau_zx]).max() < 3e-3 * np.abs(solution.pressure).max()


def round_polar(rings, sectors):
    """Polar quadrilaterals with the area of the circle."""
    angle = 2 * np.pi / sectors
    mesh = polar(rings, sectors)
    return MeshQuad(mesh.p * np.sqrt(angle / np.sin(angle)), mesh.t)


@pytest.mark.parametrize(("ratio", "expected"), [(10, 0.292), *slow((1, 0.646), (100, 0.081))])
def test_burmister(ratio, expected):
    """sigma_z / q on the axis in the interface, a = h, nu = 1/2 (L. Fox, Computations of traffic
    stresses in a simple road structure, 1948)."""
    ground = LayeredHalfSpace([Layer(1.0, ratio, 0.5)], HalfSpace(1.0, 0.5))
    partition = Partition.from_mesh(round_polar(2, 400))
    x = [[0.0], [0.0], [1.0]]
    s = stresses(ground, partition, np.ones(len(partition)), x)
    assert s.sigma_z[0] == pytest.approx(expected, abs=1e-3)
    layers = [(1.0, ratio, 0.5), (np.inf, 1.0, 0.5)]
    k = 40 * np.linspace(0, 1, 3001)[1:] ** 2
    symbol = np.array([-burmister.amplitudes(layers, None, q, 1.0)[1] for q in k])
    exact = simpson(symbol * j1(k) * 2 * np.sqrt(40 * k), x=np.sqrt(k / 40))
    assert s.sigma_z[0] == pytest.approx(exact, abs=2e-5)


def test_gibson():
    """nu = 1/2, E in proportion to z: Boussinesq's stresses, settlements only under the load."""
    ground = GradedHalfSpace.init_linear(1e-3, 0.5, 1e3)
    x = np.array([[-0.3, -0.2, 0.3, 1.7], [0.1, -0.4, 0.2, 0.2], [0.4, 0.8, 0.8, 0.5]])
    found = np.array(stresses(ground, DUAL.partition, PRESSURE, x))
    expected = np.array(stresses(HalfSpace(1.0, 0.5), DUAL.partition, PRESSURE, x))
    assert found == pytest.approx(expected, abs=5e-3 * np.abs(expected).max())


def test_interface_of_layers():
    """What acts across an interface is continuous, by Hooke's law the rest is not."""
    x = np.array([[0.2, 0.2, 0.2], [-0.3, -0.3, -0.3], [0.8 - 1e-9, 0.8, 0.8 + 1e-9]])
    above, there, below = all_fields(CRUST, DUAL.partition, PRESSURE, x).T
    assert above == pytest.approx(there, rel=1e-6)
    same = [2, 4, 5, 6, 7, 8]
    assert below[same] == pytest.approx(there[same], rel=1e-6)
    assert np.abs(below[:2] - there[:2]).min() > 0.01
    # strains along the interface
    for young, nu, s in ((5.0, 0.2, above), (1.0, 0.4, below)):
        along = (s[0] - nu * (s[1] + s[2])) / young
        assert along == pytest.approx((above[0] - 0.2 * (above[1] + above[2])) / 5.0, rel=1e-5)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units(scale):
    ground = LayeredHalfSpace([Layer(0.8 * scale, 5e6, 0.2)], HalfSpace(1e6, 0.4))
    mesh = MeshTri(scale * DUAL.mesh.p, DUAL.mesh.t)
    x = POINTS[:, :4]
    one = all_fields(CRUST, DUAL.partition, PRESSURE, x)
    other = all_fields(ground, DualMesh.from_mesh(mesh).partition, PRESSURE, scale * x)
    other[6:] *= 1e6 / scale
    assert other == pytest.approx(one, rel=1e-6, abs=1e-8)


def derivatives(f, x, h):
    """Derivatives of f(x) by x, y, z in front, differences of sixth order."""
    weights = np.array([45, -45, -9, 9, 1, -1]) / (60 * h)
    steps = h * np.einsum("k,ij->kij", [1, -1, 2, -2, 3, -3], np.eye(3))
    values = f((x[:, None, None] + steps.T[..., None]).reshape(3, -1))
    values = values.reshape(*values.shape[:-1], 3, 6, x.shape[1])
    return np.moveaxis(np.einsum("k,...dkm->...dm", weights, values), -2, 0)


@pytest.mark.parametrize(
    ("ground", "x", "h", "tolerance"),
    [
        (SOIL, POINTS, 4e-3, 1e-10),
        (CRUST, POINTS[:, np.abs(POINTS[2] - 0.8) > 0.05][:, :6], 1e-2, 1e-5),
        *slow((LINEAR, POINTS[:, :1], 1e-2, 1e-5)),
    ],
    ids=["homogeneous", "layer", "linear"],
)
def test_balance_of_forces_and_law_of_hooke(ground, x, h, tolerance):
    tensor = lambda x: stresses(ground, DUAL.partition, PRESSURE, x).tensor  # noqa: E731
    found = derivatives(lambda x: all_fields(ground, DUAL.partition, PRESSURE, x), x, h)
    every = found[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(3, 3, 3, -1)
    assert np.einsum("iijm->jm", every) == pytest.approx(0, abs=tolerance)
    du = found[:, 6:]
    ratio, nu = ground.strata.moduli(x[2])
    strain, young = (du + du.swapaxes(0, 1)) / 2, ratio * ground.surface.young
    volume = nu / (1 - 2 * nu) * np.eye(3)[:, :, None] * np.einsum("iim->m", strain)
    cauchy = young / (1 + nu) * (strain + volume)
    assert tensor(x) == pytest.approx(-cauchy, abs=tolerance)


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


def rigid_circle(r, z):
    """sigma_z and tau_rz under unit force on the unit circle, closed (Sneddon 1946)."""
    q = z + 1j
    root = np.sqrt(r**2 + q**2)
    v_z, v_zz, v_rz = np.imag([1 / root, -q / root**3, -r / root**3])
    return (z * v_zz - v_z) / (2 * np.pi), z * v_rz / (2 * np.pi)


@pytest.mark.parametrize("cells", ["dual", *slow("triangles", "quadrilaterals")])
def test_law_of_the_edge_below_a_rigid_circle(cells):
    """In three tenths of a cell and in one, means around the circle, whose edge is a polygon; with
    mean pressures it is off by 0.7 and 0.1."""
    mesh = round_polar(10, 90) if cells == "quadrilaterals" else polygon_of_disc(n=300)
    if cells == "dual":
        basis = DualMesh.from_mesh(mesh).basis()
    else:
        element = ElementQuad0() if cells == "quadrilaterals" else ElementTriP0()
        basis = CellBasis(mesh, element)
    solution = RigidPunch(SOIL, basis).solve(1.0)
    h = np.sqrt(np.pi / basis.N)
    r, turn = np.linspace(0.0, 1.5, 11), np.arange(1, 13) * 0.52
    for depth, tolerance in ((0.3 * h, 2e-2), (h, 4e-3), (3 * h, 2e-3)):
        x = np.stack([np.outer(np.cos(turn), r), np.outer(np.sin(turn), r)]).reshape(2, -1)
        found = stress_below(solution, [*x, np.full(x.shape[1], depth)])
        sigma, tau = rigid_circle(r, depth)
        mean = found.sigma_z.reshape(-1, len(r)).mean(axis=0)
        assert mean * np.pi == pytest.approx(np.pi * sigma, abs=tolerance)
        shear = np.repeat(np.cos(turn), len(r)) * found.tau_zx
        shear += np.repeat(np.sin(turn), len(r)) * found.tau_yz
        mean = shear.reshape(-1, len(r)).mean(axis=0)
        assert mean * np.pi == pytest.approx(np.pi * tau, abs=tolerance)


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
    with pytest.raises(TypeError, match=r"HalfSpace, GradedHalfSpace or .*, got object"):
        stresses(object(), DUAL.partition, PRESSURE, POINTS)


def test_points_in_a_rigid_base_are_refused():
    x = [[0.0, 0.0], [0.0, 0.0], [2.0, 2.1]]
    with pytest.raises(ValueError, match=r"above the rigid base at depth 2; .* 1, with z=2\.1"):
        stresses(ROCK, DUAL.partition, PRESSURE, x)
    with pytest.raises(ValueError, match=r"pressure of shape \(\d+,\), got \(2,\)"):
        stresses(ROCK, DUAL.partition, PRESSURE[:2], POINTS)


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
    assert displacement_below(one, x)[0] == pytest.approx(0.0, abs=1e-7)
    sides = [stress_below(both[k], x).sigma_z for k in (0, 1)]
    assert sides[0] == pytest.approx(sides[1])


@pytest.mark.parametrize(
    ("length", "at"), [(1.0, 5e6), *slow((1.0, 0.0), (1e-3, 0.0), (1e3, 0.0))]
)
@pytest.mark.parametrize("kind", ["constant", "law of the edge"])
def test_clusters_far_away_act_as_their_cells(monkeypatch, kind, length, at):
    """To 1e-10 where cells are uniform; clouds of single cells are as good as 1e-6 otherwise."""
    mesh = perturbed(polygon_of_disc(n=1500), 0.005)
    dual = DualMesh.from_mesh(MeshTri(length * mesh.p + at, mesh.t))
    punch = RigidPunch(SOIL, dual.basis(), origin=(at, at))
    rng = np.random.default_rng(0)
    pressure = rng.uniform(-1, 2, len(punch.partition))
    loads = [CellLoads(punch.partition, pressure, None)]
    if kind != "constant":
        s = punch.solve(np.pi * length**2)
        loads = [CellLoads(punch.partition, s.pressure, s.footprint.weights, s.slopes)]
    x = np.vstack([rng.uniform(-1.5, 1.5, (2, 150)), 10 ** rng.uniform(-2.0, 1.0, 150)])
    x = length * x + [[at], [at], [0.0]]
    found = components(SOIL, loads, x)
    monkeypatch.setattr("skfem_dual.elements.clusters.FEW", len(pressure))
    every = components(SOIL, loads, x)
    tolerance = 1e-10 if kind == "constant" else 1e-6
    for part, size in ((slice(6), 1.0), (slice(6, 9), length)):
        assert np.abs(found[part] - every[part]).max() < tolerance * size


def test_clusters_of_graded_and_of_flat_cells(monkeypatch):
    """Sizes over three decades, loads of no sum, and a row of cells on a line."""
    x, y = np.geomspace(1, 1000, 41), np.linspace(0, 20, 21)
    for mesh in (MeshQuad.init_tensor(x, y), MeshQuad.init_tensor(np.linspace(0, 1, 801), y[:2])):
        partition = Partition.from_basis(CellBasis(mesh, ElementQuad0()))
        pressure = np.random.default_rng(0).standard_normal(len(partition))
        low, high = mesh.p.min(axis=1), mesh.p.max(axis=1)
        points = np.random.default_rng(1).uniform([*low, 0.01], [*high, 20.0], (200, 3)).T
        loads = [CellLoads(partition, pressure, None)]
        found = components(SOIL, loads, points)
        with monkeypatch.context() as patch:
            patch.setattr("skfem_dual.elements.clusters.FEW", len(pressure))
            every = components(SOIL, loads, points)
        size = np.abs(every).max(axis=1, keepdims=True)
        assert (np.abs(found - every) < 1e-10 * size).all()


def test_stresses_are_equal_to_themselves_only():
    one, other = (stresses(SOIL, DUAL.partition, PRESSURE, POINTS) for _ in range(2))
    assert {one: "one", other: "other"}[one] == "one"
    assert one == one
    assert one != other
