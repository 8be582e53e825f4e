"""What leaves the solver carries what was solved."""

import numpy as np
import pytest
from plans import annulus, disc, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP2, MeshTri

from skfem_dual import DualMesh, HalfSpace, Paraboloid, RigidPunch, postprocess
from skfem_dual.elements.balance import field_resultant
from skfem_dual.grids.generate import polygon

SOIL = HalfSpace(1.0, 0.25)


def star():
    angle = np.arange(10) * np.pi / 5
    radius = np.where(np.arange(10) % 2, 0.5, 1.0)
    return polygon((radius * [np.cos(angle), np.sin(angle)]), n=250)


def two_holes():
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    hole = np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])
    holes = [np.add(hole, middle).T for middle in ((0.45, 0.4), (-0.4, -0.45))]
    return polygon(np.transpose(square), holes=holes, n=250)


PLANS = {
    "thin ring": (lambda: annulus(3, 80, inner=0.9), (0.1, 0.05)),
    "L": (lambda: MeshTri.init_lshaped().refined(3), (-0.1, 0.15)),
    "two holes": (two_holes, (0.1, -0.05)),
    "star": (star, (0.05, 0.02)),
    "disc that lifts off": (lambda: disc(3), (0.5, 0.1)),
}


@pytest.fixture(scope="module", params=PLANS)
def couple(request):
    make, at = PLANS[request.param]
    dual = DualMesh.from_mesh(make())
    return [
        RigidPunch(SOIL, basis).solve(force=2.0, at=at)
        for basis in (dual.basis(), dual.primal_basis())
    ]


def assert_carries(solution, basis, values):
    size = np.ptp(basis.mesh.p)
    found = field_resultant(basis, values, solution.punch.origin)
    error = (found - solution.resultant) / (solution.force * np.array([1, size, size]))
    np.testing.assert_allclose(error, 0.0, atol=1e-12)


def test_every_export_carries_force_and_moments(couple):
    for solution, other in (couple, couple[::-1]):
        mesh = solution.contact_region
        assert_carries(solution, *solution.pressure_field(refine=1))
        assert_carries(solution, *solution.pressure_field(refine=2, other=other))
        assert_carries(solution, *solution.nodal_pressure())
        basis = CellBasis(MeshTri(mesh.p, mesh.t), ElementTriP2())
        f, x = solution.load_vector(basis), basis.doflocs
        found = np.array([f.sum(), *(x @ f)])
        np.testing.assert_allclose(found, solution.resultant, atol=3e-12)
    assert_carries(couple[0], *postprocess(*couple))


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_field_of_the_central_circle(grid):
    """p = P / (2 pi sqrt(1 - r^2)), by distance from the edge."""
    dual = DualMesh.from_mesh(disc(4))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    field, p = RigidPunch(SOIL, basis).solve(force=2 * np.pi).pressure_field()
    r = np.hypot(*field.doflocs)
    inside = r < 1 - 0.02
    error = p[inside] * np.sqrt(1 - r[inside] ** 2) - 1
    assert np.sqrt(np.mean(error**2)) < 6e-3
    assert np.abs(error[r[inside] < 0.8]).max() < 6e-3


def test_field_of_a_sphere():
    """Hertz: p = p0 sqrt(1 - r^2 / a^2)."""
    for basis in (DualMesh.from_mesh(disc(4)).basis(), CellBasis(polar(), ElementQuad0())):
        punch = RigidPunch(SOIL, basis, gap=Paraboloid(radius=1.0))
        modulus = SOIL.contact_modulus
        a = 0.6
        solution = punch.solve(force=4 / 3 * modulus * a**3)
        field, p = solution.pressure_field()
        r = np.hypot(*field.doflocs)
        exact = 2 * modulus * a / np.pi * np.sqrt((1 - (r / a) ** 2).clip(0))
        assert np.sqrt(np.mean((p - exact) ** 2)) < 0.03 * exact.max()
        assert not p[r > a * 1.05].any()
        assert_carries(solution, field, p)


def test_wrong_refinements():
    solution = RigidPunch(SOIL, DualMesh.from_mesh(rectangle(4)).basis()).solve(1.0)
    with pytest.raises(ValueError, match="0 to 6 refinements, got 9"):
        solution.pressure_field(9)
    with pytest.raises(TypeError, match="whole number"):
        solution.pressure_field(1.5)
