import numpy as np
import pytest
from plans import annulus, disc, perturbed, rectangle
from scipy.spatial import ConvexHull
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import (
    ConvergenceError,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    ResolutionWarning,
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


def crusted(ratio, thickness, n):
    ground = LayeredHalfSpace([Layer(thickness, 1.0, 0.3)], HalfSpace(1 / ratio, 0.3))
    return RigidPunch(ground, DualMesh.from_mesh(fine_disc(n=n)).basis())


def test_ground_that_pulls_under_a_mere_settlement_has_no_kern():
    """Inside a plan on a crust: no mesh mends that, which was the remedy."""
    for n in 100, 300:
        with pytest.raises(ConvergenceError, match="There is none: the ground would have to pull"):
            crusted(6, 0.6, n).kern()


def test_a_kern_by_hardly_any_pressure_is_rough():
    punch = crusted(8, 1.0, 100)
    with pytest.warns(ResolutionWarning, match=r"fall to 1.2 % of their mean on cell \d+ at"):
        coarse = punch.kern()
    with pytest.warns(ResolutionWarning, match="fall to"):  # whoever asks is told
        assert np.array_equal(punch.kern(), coarse)
    assert np.hypot(*coarse).max() > 0.29  # 0.228 with 1000 cells
    assert np.hypot(*crusted(6, 1.0, 100).kern()).max() == pytest.approx(0.4242, rel=0.02)


@pytest.mark.parametrize("cells", [(4, 12), (12, 36), (36, 12)])
def test_kern_on_cells_longer_than_wide(cells):
    """Planes through a row of cells run wild across it: it was down to a twentieth."""
    nx, ny = (np.linspace(0.0, 1.0, n + 1) for n in cells)
    square = RigidPunch(UNIT, CellBasis(MeshQuad.init_tensor(nx, ny), ElementQuad0()))
    assert np.ptp(square.kern(), axis=1) == pytest.approx(0.43, rel=0.05)
