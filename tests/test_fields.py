"""What leaves the solver carries what was solved."""

import numpy as np
import pytest
from plans import annulus, disc, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP2, MeshTri

from skfem_dual import DualMesh, HalfSpace, Paraboloid, RigidPunch, evaluate, postprocess
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
    """p = P / (2 pi sqrt(1 - r^2)), by distance from the edge; cells are 0.08 wide."""
    dual = DualMesh.from_mesh(disc(4))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    solution = RigidPunch(SOIL, basis).solve(force=2 * np.pi)
    r, angle = np.random.default_rng(0).uniform([[0.0], [0.0]], [[0.995], [2 * np.pi]], (2, 9000))
    x, exact = r * [np.cos(angle), np.sin(angle)], 1 / np.sqrt(1 - r**2)
    nodal, field = (
        evaluate(*export, x, outside="zero") / exact - 1
        for export in (solution.nodal_pressure(), solution.pressure_field())
    )
    for begin, end, rms in ((0.015, 0.03, 0.03), (0.03, 0.08, 0.012), (0.08, 1.0, 0.006)):
        band = (r <= 1 - begin) & (r > 1 - end)
        assert np.sqrt(np.mean(field[band] ** 2)) < rms
        assert np.mean(nodal[band] ** 2) > 4 * np.mean(field[band] ** 2) or begin == 0.08


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
    with pytest.raises(ValueError, match="refine from 0 to 6, got 9"):
        solution.pressure_field(9)
    with pytest.raises(TypeError, match="whole number"):
        solution.pressure_field(1.5)
