import pickle

import numpy as np
import pytest
from plans import disc
from skfem import (
    CellBasis,
    ElementQuad1,
    ElementTetP1,
    ElementTriP0,
    ElementTriP1,
    ElementVector,
    MeshQuad,
    MeshTet,
    MeshTri,
)

from skfem_dual import (
    Cone,
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    ResolutionWarning,
    RigidPunch,
    RoundedCylinder,
    Sphere,
)
from skfem_dual.grids import generate

X = np.random.default_rng(0).uniform(-1, 1, (2, 50))
R = np.hypot(X[0] - 0.2, X[1] + 0.1)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (Paraboloid(3.0, (0.2, -0.1)), R**2 / 6),
        (Sphere(3.0, (0.2, -0.1)), 3 - np.sqrt(9 - R**2)),
        (Cone(0.2, (0.2, -0.1)), R * np.tan(0.2)),
        (RoundedCylinder(0.5, 2.0, (0.2, -0.1)), np.where(R > 0.5, (R - 0.5) ** 2 / 4, 0)),
    ],
)
def test_shapes(shape, expected):
    assert shape(X) == pytest.approx(expected)
    assert pickle.loads(pickle.dumps(shape)) == shape


def test_a_gap_in_every_form():
    """A function, one value per cell and a field of scikit-fem are the same punch."""
    dual = DualMesh.from_mesh(disc(4))
    soil, shape = HalfSpace(1.0, 0.3), Paraboloid(1.0)
    called = RigidPunch(soil, dual.basis(), gap=shape)
    listed = RigidPunch(soil, dual.basis(), gap=shape(called.collocation_points))
    basis = CellBasis(dual.mesh, ElementTriP1())
    field = RigidPunch(soil, dual.basis(), gap=(basis, basis.project(lambda x: shape(x))))
    one, two, three = (p.solve(0.1) for p in (called, listed, field))
    assert called.edge == "constant"
    assert two.pressure == pytest.approx(one.pressure)
    assert three.settlement == pytest.approx(one.settlement, rel=1e-2)


def test_a_gap_on_quadrilaterals_at_site_coordinates():
    """scikit-fem's own interpolation does not converge there."""
    at = np.array([5e5, 4e6])
    dual = DualMesh.from_mesh(disc(3).translated(at))
    basis = CellBasis(MeshQuad().refined(3).scaled(3.0).translated(at - 1.5), ElementQuad1())
    field = basis.doflocs[0] - at[0] + 2 * (basis.doflocs[1] - at[1])
    punch = RigidPunch(HalfSpace(1.0, 0.3), dual.basis(), gap=(basis, field))
    x = punch.collocation_points - at[:, None]
    assert punch.initial_gap == pytest.approx(x[0] + 2 * x[1], abs=1e-8)


def zeros(mesh, element):
    basis = CellBasis(mesh, element)
    return basis, np.zeros(basis.N)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Paraboloid(-1.0), ValueError, "positive radius, got -1"),
        (lambda: Paraboloid(1.0, 3.0), TypeError, "two numbers for centre"),
        (lambda: Cone(2.0), ValueError, "below 1.57"),
        (lambda: RoundedCylinder(1.0, 0.0), ValueError, "positive rounding"),
        (lambda: Sphere(1.0)([[2.0], [0.0]]), ValueError, "within the radius 1"),
    ],
)
def test_bad_shapes(make, error, message):
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize(
    ("gap", "error", "message"),
    [
        (np.zeros(3), ValueError, "a gap for each of the 41 collocation points"),
        (lambda x: x, ValueError, r"got shape \(2, 41\)"),
        (lambda x: x[0] / 0 * 0, ValueError, "finite gaps; the first that is not"),
        (np.ma.masked_less(np.arange(41), 1), ValueError, "gap without masked values, got some"),
        (lambda x: np.ma.masked_less(x[0], 0), ValueError, "gap without masked values, got some"),
        ("sphere", TypeError, "function of x or numbers"),
        ([[1], [2, 3]], TypeError, "gap as an array of numbers"),
        ((1, 2), TypeError, "pair of a skfem CellBasis"),
        (
            zeros(MeshTri().refined(2), ElementTriP1()),
            ValueError,
            r"covers the plan for gap; the first .* is 3 at \(-0.95234.* in all. Remedy: a mesh",
        ),
        (
            zeros(MeshTri().refined(2), ElementVector(ElementTriP1())),
            TypeError,
            "scalar field on a 2-D mesh for gap, got a basis of ElementVector on a MeshTri1",
        ),
        (
            zeros(MeshTet(), ElementTetP1()),
            TypeError,
            "scalar field on a 2-D mesh for gap, got a basis of ElementTetP1 on a MeshTet1",
        ),
    ],
)
def test_bad_gaps(gap, error, message):
    basis = DualMesh.from_mesh(disc(2)).basis()
    with np.errstate(all="ignore"), pytest.raises(error, match=message):
        RigidPunch(HalfSpace(1.0, 0.0), basis, gap=gap)


@pytest.mark.parametrize(
    ("gap", "message"),
    [
        (lambda x: 0.0 if x[0] < 0 else 1.0, "array of all points for gap, .* Remedy: np.where"),
        (lambda x: 1j * x[0], "numbers for gap, got an array of complex128 .* from the function"),
        (lambda x: None, "numbers for gap, got None from the function"),
    ],
)
def test_what_functions_return_is_told(gap, message):
    """They were blamed themselves, or numpy said that a truth value is ambiguous."""
    basis = DualMesh.from_mesh(MeshTri().refined(2)).basis()
    with pytest.raises((TypeError, ValueError), match=message):
        RigidPunch(HalfSpace(1.0, 0.3), basis, gap=gap)


def test_shapes_far_above_the_ground_are_told():
    """Their digits are lost in the distance, and solvers blamed the load or the cells."""
    basis = DualMesh.from_mesh(MeshTri().refined(2)).basis()
    for above in (0.0, 1e3):
        RigidPunch(HalfSpace(1.0, 0.3), basis, gap=lambda x, above=above: above + x[0])
    with pytest.warns(ResolutionWarning, match=r"begins 1e\+05 .* varies by .* least value"):
        RigidPunch(HalfSpace(1.0, 0.3), basis, gap=lambda x: 1e5 + x[0])


@pytest.mark.parametrize("radius", [1e2, 1e6, 1e8, 1e12])
def test_spheres_far_larger_than_the_plan(radius):
    """A paraboloid but for the square of the slope."""
    x = np.array([[0.1, 0.5, 0.6], [0.0, 0.2, -0.7]])
    expected = Paraboloid(radius)(x) * (1 + (x**2).sum(axis=0) / (4 * radius**2))
    np.testing.assert_allclose(Sphere(radius)(x), expected, rtol=1e-8)


@pytest.mark.parametrize("grid", ["dual", "triangles"])
def test_paraboloids_on_springs(grid):
    """Their contact ends without the root of the distance, and the surface is far softer than what
    cells feel: settlements were 5 % off, areas of contact 21 to 53 % too large."""
    spring, a = 1 / 0.91 / 0.002, 0.45
    force, mesh = spring * np.pi * a**4 / 4, generate.disc(n=300, true_area=True)
    basis = DualMesh.from_mesh(mesh).basis() if grid == "dual" else CellBasis(mesh, ElementTriP0())
    ground = LayeredHalfSpace([Layer(0.002, 1.0, 0.3)], "smooth")
    punch = RigidPunch(ground, basis, gap=Paraboloid(1.0))
    found = punch.solve(force)
    assert found.settlement == pytest.approx(a**2 / 2, rel=4e-3)
    assert punch.solve(settlement=a**2 / 2).force == pytest.approx(force, rel=8e-3)
    assert found.contact_area == pytest.approx(np.pi * a**2, rel=0.12)
