import numpy as np
import pytest
from plans import polar, rectangle
from skfem import CellBasis, ElementQuad2, ElementTriMorley, ElementTriP2

from skfem_dual.elements.point_values import locate, value_matrix


@pytest.mark.parametrize(
    "basis", [CellBasis(rectangle(5), ElementTriP2()), CellBasis(polar(6, 16), ElementQuad2())]
)
def test_values_of_a_field(basis):
    x = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 200))
    found = value_matrix(basis, x) @ (basis.doflocs[0] * 2 - basis.doflocs[1] + 3)
    assert found == pytest.approx(2 * x[0] - x[1] + 3, abs=1e-12)


def test_on_sides_the_mean_of_both():
    """Where elements do not conform; whatever the rounding, so that mirror images agree."""
    mesh = rectangle(4)
    basis = CellBasis(mesh, ElementTriMorley())
    inner = np.setdiff1d(np.arange(mesh.nfacets), mesh.boundary_facets())
    a, b = mesh.p[:, mesh.facets[:, inner]].swapaxes(0, 1)
    x, step = 0.7 * a + 0.3 * b, 1e-7 * np.array([b[1] - a[1], a[0] - b[0]])
    vector = np.random.default_rng(0).standard_normal(basis.N)
    on, left, right = (value_matrix(basis, y) @ vector for y in (x, x - step, x + step))
    assert np.abs(left - right).max() > 1e-3
    assert on == pytest.approx((left + right) / 2, abs=1e-5)
    moved = value_matrix(basis, x + 1e-4 * step) @ vector  # by 1e-11
    assert moved == pytest.approx(on, abs=1e-9)


@pytest.mark.parametrize("far", [0.0, 1e6, 1e8])
def test_points_on_sides_are_on_both_however_far_from_the_origin(far):
    mesh = rectangle(4).translated((far, 0.3 * far))
    inner = np.setdiff1d(np.arange(mesh.nfacets), mesh.boundary_facets())
    a, b = mesh.p[:, mesh.facets[:, inner]].swapaxes(0, 1)
    x = 0.7 * a + 0.3 * b  # off the sides by rounding
    point, _ = locate(mesh.p[:, mesh.t], x)
    assert np.bincount(point, minlength=len(inner)).tolist() == [2] * len(inner)


def test_points_outside():
    basis = CellBasis(rectangle(4), ElementTriP2())
    with pytest.raises(ValueError, match=r"points 1 lie outside, the first at \(1\.01, 0\)"):
        value_matrix(basis, np.array([[0.0, 1.01], [0.0, 0.0]]))
