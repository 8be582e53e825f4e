"""Displacements of the surface by shear and normal tractions on cells."""

import numpy as np
import pytest
from marks import slow
from scipy.integrate import quad
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.elements.tangential import Tractions
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import disc


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
