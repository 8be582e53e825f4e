"""Pressures in corners against their integral equation, and the corners of meshes."""

import numpy as np
import pytest
from plans import annulus, disc, ellipse, rectangle
from scipy.special import digamma, hyp2f1
from skfem import CellBasis, ElementTriP0, MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch, bearing_pressure, refine_to_contact
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.elements.wedge_law import across, bends, exponent, wedge_factor
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import polygon
from skfem_dual.grids.outline import Wedges, edge_ribs, wedges
from skfem_dual.grids.partition import Partition

SOIL = HalfSpace(1.0, 0.0)
#: Morrison and Lewis (1976): interior angle in degrees, nu
EXPONENTS = {
    60: 0.24010020, 90: 0.29658439, 108: 0.33180859, 120: 0.35635481, 135: 0.38861358,
    180: 0.5, 225: 0.64219762, 240: 0.69748457, 270: 0.81465526, 300: 0.91903878,
}  # fmt: skip


def residual(angle, nu, n=24):
    """Largest value of the integral of ``f P_nu(-cos)`` over the corner, f of unit mean.

    With theta = angle / 2 (1 - cos t) the logarithm in ``|cos t - cos t'|`` is integrated by its
    series of Chebyshev polynomials.
    """
    t = (np.arange(n) + 0.5) * np.pi / n
    c = np.cos(t)
    apart = np.abs(c[:, None] - c)
    s = np.sin(angle / 4 * apart) ** 2
    # P_nu(-cos) has sin(pi nu) / pi P_nu(cos) times the logarithm of s; up to s^6 is enough
    ratio = (-nu + np.arange(6)) * (nu + 1 + np.arange(6)) / (1 + np.arange(6)) ** 2
    at_s = sum(a * s**k for k, a in enumerate(np.cumprod(np.append(1.0, ratio))))
    singular = 2 * np.sin(np.pi * nu) / np.pi * at_s
    here = np.eye(n, dtype=bool)
    kernel = hyp2f1(-nu, nu + 1, 1, 1 - np.where(here, 0.5, s))
    smooth = kernel - singular * np.log(np.where(here, 1.0, apart))
    limit = np.euler_gamma + digamma(nu + 1) + np.log(angle / 4)
    smooth[here] = np.cos(np.pi * nu) + 2 * np.sin(np.pi * nu) / np.pi * limit
    m = np.arange(1, n)
    waves = np.cos(np.outer(m, t))
    logarithm = -np.pi / n * (np.log(2) + 2 * (waves.T / m) @ waves)
    f = across(angle, angle / 2 * (1 - np.abs(c)), *bends(angle)) ** -0.5 * np.sin(t)
    return np.abs((logarithm * singular + np.pi / n * smooth) @ (f / f.mean())).max()


@pytest.mark.parametrize(("degrees", "nu"), EXPONENTS.items())
def test_exponents(degrees, nu):
    """Linear between the angles of the table."""
    assert exponent(np.radians(degrees)) == pytest.approx(nu, abs=3e-4 if degrees % 15 else 1e-8)


@pytest.mark.parametrize("degrees", [30, 60, 90, 120, 155, 180, 200, 225, 270])
def test_no_settlement_under_the_law_of_a_corner(degrees):
    angle = np.radians(degrees)
    nu = float(exponent(angle))
    found = residual(angle, nu)
    assert found < 4e-3
    assert residual(angle, nu + 0.03) > 5 * found


def test_shape_at_the_sides_and_without_a_corner():
    near = np.linspace(0, np.pi / 2, 9)
    assert across(np.pi, near, *bends(np.pi)) == pytest.approx(np.sin(near), abs=1e-5)
    for angle in np.radians([40, 90, 250]):
        assert across(angle, 1e-6, *bends(angle)) == pytest.approx(1e-6, rel=1e-4)


def corners_of(mesh):
    return wedges(mesh, mesh.boundary_facets())


L_SHAPE = MeshTri.init_lshaped().refined(2)


@pytest.mark.parametrize(
    ("mesh", "degrees"),
    [
        (rectangle(6), [90] * 4),
        (L_SHAPE, [90] * 5 + [270]),
        (polygon(np.array([[0.0, 0.0], [2.0, 0.0], [1.0, np.sqrt(3)]]), n=60), [60] * 3),
        (MeshTri.init_symmetric(), [90] * 4),
        (disc(2), []),
        (disc(4, graded=True), []),
        (ellipse(3, 1.0, 0.3), []),
        (annulus(3, 24), []),
    ],
)
def test_corners_of_meshes(mesh, degrees):
    """Polygons that follow curves have none."""
    found = corners_of(mesh)
    assert np.sort(np.degrees(found.angle)) == pytest.approx(degrees)
    assert found.x == pytest.approx(mesh.p[:, found.node].T)


def test_where_corners_look_and_how_far():
    found = corners_of(L_SHAPE)
    inner = found.angle > np.pi
    assert found.x[inner] == pytest.approx(0, abs=1e-12)
    assert np.hypot(*found.bisector.T) == pytest.approx(1)
    inward = found.x + 0.1 * found.bisector
    fan = Fan.from_mesh(L_SHAPE)
    assert (fan.locate(inward.T) >= 0).all()
    assert found.reach[inner] == pytest.approx(1)
    assert found.reach[found.angle < np.pi].max() == pytest.approx(np.sqrt(2))
    # as the plan turns
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    there = corners_of(MeshTri(3 * turn @ L_SHAPE.p, L_SHAPE.t))
    assert there.angle == pytest.approx(found.angle)
    assert there.reach == pytest.approx(3 * found.reach)
    assert there.bisector == pytest.approx(found.bisector @ turn.T)


@pytest.mark.parametrize("degrees", [60, 90, 270])
def test_power_along_a_ray(degrees):
    angle, nu = np.radians(degrees), float(exponent(np.radians(degrees)))
    corner = Wedges(*(np.array([a]) for a in (0, (1.0, 2.0), (0.6, 0.8), angle, 1.0)))
    r = np.geomspace(1e-6, 1e-5, 4)
    x = np.array([[1.0], [2.0]]) + np.outer((0.6, 0.8), r)
    distance = r * np.sin(min(angle, np.pi) / 2)
    phi = distance * wedge_factor(corner, x, distance)
    assert np.diff(np.log(phi)) / np.diff(np.log(r)) == pytest.approx(2 - 2 * nu, abs=1e-3)
    assert wedge_factor(corner, x, np.zeros(4)) == pytest.approx(1)  # the sides stay the edge
    assert wedge_factor(corner, x + 2, distance) == pytest.approx(1)


@pytest.mark.parametrize("basis", ["dual", "primal"])
def test_cells_are_cut_towards_corners(basis):
    """Between the points of the fan phi is linear enough, where it was not by far."""
    dual = DualMesh.from_mesh(L_SHAPE)
    basis = dual.basis() if basis == "dual" else dual.primal_basis()
    partition = Partition.from_basis(basis)
    weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition))
    plain = Fan.from_basis(basis)

    def off(fan):
        x = fan.p[:, fan.t]
        own = np.hypot(*x.mean(axis=1)) < 0.4  # near the re-entrant corner
        phi = weights.phi_at(x[..., own].reshape(2, -1)).reshape(3, -1)
        middle = weights.phi_at(x[..., own].mean(axis=1))
        return np.abs(phi.mean(axis=0) / middle - 1) @ fan.areas[own]

    assert off(weights.fan) < 0.3 * off(plain)
    fan = plain.with_cells_of(weights.fan)
    assert np.bincount(fan.cell, fan.areas) == pytest.approx(partition.areas, rel=1e-12)
    assert np.array_equal(np.unique(fan.part), np.unique(plain.part))
    assert np.bincount(fan.part, fan.areas) == pytest.approx(np.bincount(plain.part, plain.areas))


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_square(grid):
    """Load on the corners, from constants on 160^2 graded cells, and pressure towards them."""
    dual = DualMesh.from_mesh(rectangle(20))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    solution = RigidPunch(SOIL, basis).solve(1.0)
    if grid == "primal":
        partition = solution.punch.partition
        beside = (np.abs(partition.centroids) > 0.9).all(axis=0)
        load = (solution.pressure * partition.areas)[beside].sum() / solution.settlement
        assert load == pytest.approx(4 * 0.026333, rel=3e-3)
    x = 1 - np.array([[0.04], [0.04]]) * 0.5 ** np.arange(3)
    p = solution.pressure_at(x)
    assert np.log2(p[1:] / p[:-1]) == pytest.approx(1 - EXPONENTS[90], abs=0.02)


@pytest.mark.parametrize("gap", [0.1, 0.5])
def test_corners_do_not_look_across_gaps(gap):
    """Their law goes as far as to the edge of their own part, and of a notch to none."""
    one, far = rectangle(6), 2.0 + gap
    both = one + one.translated((far, 0.0))
    alone, beside = (wedges(m, m.boundary_facets()).reach for m in (one, both))
    assert beside == pytest.approx(np.tile(alone, 2), rel=1e-12)
    notched = polygon(
        [(0, 0), (3, 0), (3, 3), (1.6, 3), (1.6, 1), (1.4, 1), (1.4, 3), (0, 3)], n=200
    )
    found = wedges(notched, notched.boundary_facets())
    upper = (found.x[:, 1] == 3.0) & (np.abs(found.x[:, 0] - 1.5) < 0.2)
    assert found.reach[upper] == pytest.approx([1.4, 1.4], rel=1e-9)


def test_corners_know_their_own_part_only():
    """Also acute ones, which no side faces, and wherever the plan lies."""
    sharp = polygon([(0, 0), (2, 0), (1, 0.3)], n=60)
    alone = wedges(sharp, sharp.boundary_facets())
    far = sharp + rectangle(3).translated((20.0, 0.0))
    found = wedges(far, far.boundary_facets())
    for x, reach in zip(alone.x, alone.reach, strict=True):
        (own,) = np.nonzero(np.hypot(*(found.x - x).T) < 1e-6)[0]
        assert found.reach[own] == pytest.approx(reach, rel=1e-6)
    blunt = polygon([(0, 0), (4, 0), (5, 1)], n=100)
    here = wedges(blunt, blunt.boundary_facets()).reach
    away = blunt.translated((4e5, 5.3e6))
    assert wedges(away, away.boundary_facets()).reach == pytest.approx(here, rel=1e-6)


@pytest.mark.parametrize("cut", [lambda x: x[1] > 0, lambda x: x[0] > 1])
def test_corners_of_a_plan_in_parts_are_those_of_the_whole(cut):
    """Cut along or across, or in single triangles; corners on seams are corners, too."""
    mesh = MeshTri.init_tensor(np.linspace(-4, 4, 17), np.linspace(-0.5, 0.5, 5))
    mesh = mesh.remove_elements(
        np.nonzero((mesh.p[:, mesh.t].mean(axis=1) > [[1], [0]]).all(0))[0]
    )
    one = cut(mesh.p[:, mesh.t].mean(axis=1))
    parts = [mesh.restrict(np.nonzero(some)[0]) for some in (one, ~one)]
    p, t = np.hstack([part.p for part in parts]), [part.t for part in parts]
    two = MeshTri(p, np.hstack([t[0], t[1] + parts[0].p.shape[1]]))
    corners = mesh.p[:, mesh.t.T.ravel()]
    soup = MeshTri(corners, np.arange(corners.shape[1]).reshape(3, -1, order="F"))
    found = []
    for m in (mesh, two, soup):
        partition = Partition.from_mesh(m)
        edge = np.unique(partition.boundary[edge_ribs(partition)])
        own = wedges(m, edge)
        order = np.lexsort(own.x.T)
        found.append([own.x[order], own.angle[order], own.reach[order]])
    for other in found[1:]:
        for a, b in zip(other, found[0], strict=True):
            np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_line_that_folds_back_is_no_corner():
    """Parts with common nodes on a stretch of a line touch without them farther on."""
    below = MeshTri.init_tensor(np.linspace(0, 3, 10), np.linspace(-1, 0, 4))
    x = np.append(np.linspace(0, 1, 4), np.linspace(1, 3, 6)[1:])
    above = MeshTri.init_tensor(x, np.linspace(0, 1, 4))
    p, t = np.hstack([below.p, above.p]), np.hstack([below.t, above.t + below.p.shape[1]])
    found = []
    for angle in (0.0, 1.1, 2.0):
        c, s = np.cos(angle), np.sin(angle)
        mesh = MeshTri(np.array([[c, -s], [s, c]]) @ p, t)
        punch = RigidPunch(HalfSpace(1.0, 0.25), DualMesh.from_mesh(mesh).basis())
        assert punch.footprint.weights.corners.angle == pytest.approx([np.pi / 2] * 6)
        found.append(punch.solve(1.0, at=mesh.p.mean(axis=1)).settlement)
    assert found == pytest.approx([found[0]] * 3, rel=1e-9)


def test_parts_that_touch_in_a_node_keep_their_corners_beside_seams():
    """Each of two squares cut by its diagonal, all in pieces node to node."""
    square = MeshTri.init_tensor(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    upper = np.diff(square.p[:, square.t].mean(axis=1), axis=0)[0] > 0
    pieces = [square.restrict(np.nonzero(some)[0]) for some in (upper, ~upper)]
    pieces += [piece.translated((-1.0, -1.0)) for piece in pieces]
    starts = np.cumsum([0] + [piece.p.shape[1] for piece in pieces])
    t = np.hstack([piece.t + start for piece, start in zip(pieces, starts, strict=False)])
    mesh = MeshTri(np.hstack([piece.p for piece in pieces]), t)
    partition = Partition.from_mesh(mesh)
    found = wedges(mesh, np.unique(partition.boundary[edge_ribs(partition)]))
    assert found.angle == pytest.approx([np.pi / 2] * 8)
    assert found.reach == pytest.approx([1.0] * 8)


def test_what_is_told_of_a_plan_in_parts_is_that_of_the_whole():
    """Mitred: seams end in corners."""
    mesh = MeshTri.init_sqsymmetric().refined(2).translated((-0.5, -0.5)).scaled(2.0)
    x, y = mesh.p[:, mesh.t].mean(axis=1)
    part = np.where(abs(x) > abs(y), np.where(x > 0, 0, 1), np.where(y > 0, 2, 3))
    pieces = [mesh.restrict(np.nonzero(part == k)[0]) for k in range(4)]
    starts = np.cumsum([0] + [piece.p.shape[1] for piece in pieces])
    t = np.hstack([piece.t + start for piece, start in zip(pieces, starts, strict=False)])
    cut = MeshTri(np.hstack([piece.p for piece in pieces]), t)
    load = {"force": 1.0, "at": (0.1, 0.05)}
    bearing, centre = [], []
    for m in (mesh, cut):
        punch = RigidPunch(HalfSpace(1.0, 0.25), CellBasis(m, ElementTriP0()))
        bearing.append(bearing_pressure(punch.solve(**load)))
        punch = RigidPunch(HalfSpace(1.0, 0.25), CellBasis(m, ElementTriP0()), edge="constant")
        basis, field = punch.solve(1.0).pressure_field(1)
        centre.append(field[np.hypot(*basis.mesh.p) < 1e-9].max())
    assert bearing[1] == pytest.approx(bearing[0], rel=1e-3)
    assert centre[1] == pytest.approx(centre[0], rel=1e-2)

    def make(m):
        return RigidPunch(HalfSpace(1.0, 0.25), CellBasis(m, ElementTriP0()))

    with pytest.raises(ValueError, match=r"without seams.*\n?.*remove_duplicate_nodes"):
        refine_to_contact(make, cut, {"force": 1.0, "at": (0.6, 0.0)}, 1)
    assert len(refine_to_contact(make, cut.remove_duplicate_nodes(), load, 1)) >= 1
