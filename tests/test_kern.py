import numpy as np
import pytest
from plans import annulus, disc, perturbed, rectangle
from scipy.spatial import ConvexHull

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    RigidPunch,
)
from skfem_dual.grids.generate import disc as fine_disc

UNIT = HalfSpace(1.0, 0.0)


def punch(mesh, grid="dual", substrate=UNIT, **options):
    dual = DualMesh.from_mesh(mesh)
    return RigidPunch(
        substrate, dual.basis() if grid == "dual" else dual.primal_basis(), **options
    )


@pytest.mark.parametrize(
    ("substrate", "radius"),
    [
        (UNIT, 1 / 3),  # exact
        # trusted: where edge lift-off starts
        (GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0), 0.3080),
        (LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], base="bonded"), 0.2943),
    ],
)
@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_kern_of_the_circle(substrate, radius, grid):
    corners = punch(fine_disc(n=600), grid, substrate).kern()
    assert np.hypot(*corners) == pytest.approx(radius, rel=1e-2)
    assert np.hypot(*corners).mean() == pytest.approx(radius, rel=6e-3)


def test_corners_run_counter_clockwise_and_are_convex():
    x, y = punch(perturbed(rectangle(8, 1.0, 2.0), 0.02)).kern()
    area = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2
    assert area == pytest.approx(ConvexHull(np.stack([x, y]).T).volume)


def test_inside_contact_is_full_outside_the_punch_lifts_off():
    """Up to half a cell, as pressures are those of cells, not of the edge."""
    for mesh in (rectangle(14), annulus(5, 40, 0.5)):
        of = punch(mesh)
        corners = of.kern()
        for e in 0.97 * corners[:, ::4].T:
            assert of.solve(1.0, tuple(e)).message == "full contact"
        for e in 1.15 * corners[:, ::4].T:
            assert of.solve(1.0, tuple(e)).message != "full contact"


def test_origin_and_scale():
    mesh = rectangle(8)
    kern = punch(mesh).kern()
    moved = punch(mesh.scaled(3.0).translated((5.0, 7.0)), origin=(5.0, 6.0)).kern()
    # corners on one line may drop out by rounding
    found = moved - np.array([[0.0], [1.0]])
    assert found.max(axis=1) == pytest.approx(3 * kern.max(axis=1))
    assert found.min(axis=1) == pytest.approx(3 * kern.min(axis=1))


@pytest.mark.parametrize("unit", [1e-4, 1e4])
def test_kern_in_any_unit_of_length(unit):
    """Of arms that are short or long, whatever a length of one is."""
    kern, other = punch(rectangle(4)).kern(), punch(rectangle(4).scaled(unit)).kern()
    assert np.abs(other).max(axis=1) == pytest.approx(unit * np.abs(kern).max(axis=1))


def test_shaped_punches_have_none():
    with pytest.raises(ValueError, match="expected a flat punch"):
        punch(disc(2), gap=Paraboloid(1.0)).kern()
