"""Displacements of the surface by shear and normal tractions on cells."""

import numpy as np
import pytest
from marks import slow
from scipy.integrate import quad
from skfem import ElementTriP1, MeshTri
from skfem.quadrature import get_quadrature

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.elements.tangential import Tractions, _add
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import disc
from skfem_dual.kernels.compiled import inputs


def tractions(mesh):
    basis = DualMesh.from_mesh(mesh).basis()
    return Tractions(basis.dual.basis().partition, Fan.from_basis(basis))


def to_side_of_square(angle, x, y):
    """Distance from a point in the unit square to its side."""
    c, s = np.cos(angle), np.sin(angle)
    along = [((c > 0) - x) / c] if c else []
    along += [((s > 0) - y) / s] if s else []
    return min(along)


@pytest.mark.parametrize(("x", "y"), [(0.31, 0.22), (0.5, 0.5), *slow((0.05, 0.9), (0.25, 0.5))])
def test_integrals_inside_against_polar_coordinates(x, y):
    """Anywhere in the square, on ribs and nodes too, each is an integral over the directions."""
    found = tractions(MeshTri().refined(2)).integrals(np.array([[x], [y]])).sum(axis=2)[:, 0]
    corners = np.arctan2([-y, -y, 1 - y, 1 - y], [-x, 1 - x, 1 - x, -x])
    kinds = (
        lambda c, s: 1.0,
        lambda c, s: c * c,
        lambda c, s: c * s,
        lambda c, s: c,
        lambda c, s: s,
    )
    ends = [*corners, corners[0] + 2 * np.pi]

    def exact(kind):
        def of_direction(t):
            return kind(np.cos(t), np.sin(t)) * to_side_of_square(t, x, y)

        return sum(quad(of_direction, *ends[i : i + 2])[0] for i in range(4))

    assert found == pytest.approx([exact(kind) for kind in kinds], rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("x", [(2.3, 1.7), (0.1, -0.6)])
def test_integrals_by_slopes_against_quadrature(x):
    """Tractions that rise along x or y inside the cells, seen from beside the square."""
    basis = DualMesh.from_mesh(MeshTri().refined(1)).basis()
    fan, partition = Fan.from_basis(basis), basis.dual.basis().partition
    sheared = Tractions(partition, fan)
    sums = np.zeros((3, 5, 1, len(partition)))
    at = partition.centroids, sheared.radius, partition.centroids
    _add(np.array(x)[:, None], *inputs(*at), sheared.far, False, sums)
    exact = np.zeros_like(sums)
    places, weights = get_quadrature(ElementTriP1, 19)
    for corners, cell in zip(fan.t.T, fan.cell, strict=True):
        p = fan.p[:, corners]
        sides = p[:, 1:] - p[:, :1]
        points = p[:, :1] + sides @ places
        a, b = points - np.array(x)[:, None]
        r, area = np.hypot(a, b), abs(np.linalg.det(sides)) * weights
        kinds = np.array([1 / r, b**2 / r**3, -a * b / r**3, a / r**2, b / r**2])
        rises = np.vstack([np.ones_like(a), points - partition.centroids[:, [cell]]])
        exact[:, :, 0, cell] += np.einsum("kq,dq->dk", kinds * area, rises)
    assert sums == pytest.approx(exact, rel=1e-10, abs=1e-12)


def test_without_lateral_strain_tractions_settle_the_ground_as_pressures():
    """At nu = 0 each direction for itself; pressures have exact integrals of their own."""
    soil = HalfSpace(2.0, 0.0)
    cells = RigidPunch(soil, DualMesh.from_mesh(disc(n=100, graded=0.3)).basis()).footprint
    sheared = Tractions(cells.partition, cells.fan, cells.weights, cells.slopes)
    x = cells.collocation_points
    found = sheared.displacements(soil, np.ascontiguousarray(x))
    assert found[0, :, 0] == pytest.approx(cells.influence(x), rel=6e-3)
    assert found[1, :, 1] == pytest.approx(found[0, :, 0], rel=1e-12)
    assert abs(found[0, :, 1]).max() == 0.0


def test_far_cells_act_as_forces():
    """Cerruti's and Boussinesq's solutions, with the signs of all nine components."""
    young, nu = 3.0, 0.2
    x = np.array([[60.0], [35.0]])
    sheared = tractions(MeshTri().refined(1).translated((-0.5, -0.5)))
    found = sheared.displacements(HalfSpace(young, nu), x, normal=True).sum(axis=3)[:, 0]
    (a,), (b,) = x
    r, shear = np.hypot(a, b), young / (2 * (1 + nu))
    horizontal = [[(1 - nu) / r + nu * a * a / r**3, nu * a * b / r**3]]
    horizontal += [[nu * a * b / r**3, (1 - nu) / r + nu * b * b / r**3]]
    assert found[:2, :2] == pytest.approx(np.array(horizontal) / (2 * np.pi * shear), rel=1e-4)
    assert found[2, 2] == pytest.approx((1 - nu) / (2 * np.pi * shear * r), rel=1e-4)
    coupling = (1 - 2 * nu) / (4 * np.pi * shear * r**2) * np.array([a, b])
    assert found[2, :2] == pytest.approx(coupling, rel=1e-4)
    assert found[:2, 2] == pytest.approx(-coupling, rel=1e-4)


def test_edge_law_against_exact_traction():
    """Under 1/sqrt(1 - r^2) on the unit disc the ground moves as one: (2 - nu) pi / (4 G)."""
    nu, shear = 0.4, 1.0
    soil = HalfSpace(2 * shear * (1 + nu), nu)
    cells = RigidPunch(soil, DualMesh.from_mesh(disc(n=400)).basis()).footprint
    sheared = Tractions(cells.partition, cells.fan, cells.weights, cells.slopes)
    r = np.hypot(*cells.weights.centroids)
    mean = 1 / np.sqrt(1 - r**2)
    # the means of the cells from those of the law, exact for 1/sqrt(d) with a linear factor
    own = cells.weights.weighted
    phi = 1 - np.hypot(*cells.weights.centroids)
    mean[own] = cells.weights.mean[own] / np.sqrt(2 - phi[own])
    x = np.array([[0.0, 0.3, -0.2], [0.0, 0.4, 0.5]])
    u = sheared.displacements(soil, x)
    assert u[0, :, 0] @ mean == pytest.approx((2 - nu) * np.pi / (4 * shear), rel=2e-3)
    assert u[1, :, 0] @ mean == pytest.approx(0.0, abs=2e-3)
