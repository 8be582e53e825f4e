import numpy as np
import pytest
from elastic_shapes import plate
from plans import disc, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import (
    ConvergenceError,
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Load,
    Paraboloid,
    RigidPunch,
    load_path,
    moment_rotation,
)
from skfem_dual.visuals.matplotlib import plot_moment_rotation

UNIT = HalfSpace(1.0, 0.0)


def punch(mesh, **options):
    return RigidPunch(UNIT, DualMesh.from_mesh(mesh).basis(), **options)


@pytest.fixture(scope="module")
def raft():
    return plate(1.0, n=60)


def test_a_path_is_its_loads_one_by_one():
    of = punch(disc(3))
    loads = [{"force": 1.0, "at": (e, 0.1)} for e in (0.1, 0.4, 0.5, 0.6, 0.2)]
    path = load_path(of, loads)
    assert path.success
    assert len(path) == 5
    for found, load in zip(path.solutions, loads, strict=True):
        assert found.pressure == pytest.approx(of.solve(**load).pressure, abs=1e-10)
    assert path.force == pytest.approx(1.0)
    assert path.moments[0] == pytest.approx([0.1, 0.4, 0.5, 0.6, 0.2])
    assert path.tilt.shape == (2, 5)
    assert path[1].settlement == path.settlement[1]
    assert (np.diff(path.contact_area[:4]) < 0).all()
    assert "5 of 5 found" in repr(path)
    assert load_path(of, []).tilt.shape == (2, 0)
    again = load_path(of, [Load(**load) for load in loads])
    assert np.array_equal(again.settlement, path.settlement)


def test_a_sphere_pressed_in_and_out():
    """Cells come into contact and leave it; the way back is the way there."""
    of = punch(rectangle(16), gap=Paraboloid(1.0))
    forces = [0.05, 0.1, 0.2, 0.1, 0.05]
    path = load_path(of, [{"force": f} for f in forces])
    assert path.settlement[[4, 3]] == pytest.approx(path.settlement[[0, 1]])
    # exact: settlement in proportion to force ** (2 / 3)
    ratio = path.settlement[2] / path.settlement[1]
    assert ratio == pytest.approx(2 ** (2 / 3), rel=1e-2)


def test_a_structure_along_a_path(raft):
    """As alone, and twice that; it bends, so that no settlement and tilt tell where it is."""
    of, f = raft.punch, raft.f
    path = load_path(of, [{"f": k * f} for k in (1.0, 2.0)])
    assert path[1].pressure == pytest.approx(2 * raft.pressure, rel=1e-6, abs=1e-8)
    assert path.force == pytest.approx([1.0, 2.0])
    assert "  2            {:.5g} to {:.5g}".format(*path[1].deflection_range) in repr(path)
    with pytest.raises(TypeError, match=r"a structure that bends. Remedy: \[s.deflection\(x\)"):
        _ = path.settlement


def test_which_load_is_impossible():
    with pytest.raises(ValueError, match="load 1: expected a resultant within the plan"):
        load_path(punch(disc(2)), [{"force": 1.0}, {"force": 1.0, "at": (2.0, 0.0)}])


def test_options_of_a_path():
    alone, options = punch(disc(2)), r"keys of the options among \['progress', .*'gap_rtol'\]"
    for curve, loads in ((load_path, [{"force": 1.0}]), (moment_rotation, 1.0)):
        with pytest.raises(TypeError, match=f"{options}, got 'start'"):
            curve(alone, loads, start=None)
        with pytest.raises(ValueError, match="gap_rtol"):
            curve(alone, loads, gap_rtol=1.0)
        with pytest.raises(TypeError, match="True or False for progress"):
            curve(alone, loads, progress="no")


@pytest.mark.parametrize(
    ("load", "options", "message"),
    [
        ({"g": 1.0}, {}, r"keys of load 1 among \['f', .*'x'\], got 'g'"),
        ({"force": 1.0}, {}, "keys of load 1 among .*, got 'force'"),
        ({"start": None}, {}, "keys of load 1 among .*, got 'start'"),
        ({}, {"start": None}, "keys of the options among .*, got 'start'"),
        ({"method": "cg"}, {"method": "cg"}, "method in load 1 or for all loads, got both"),
        ({"f": "none"}, {}, "load 1: expected f as an array of numbers"),
        (2.0, {}, "a Mapping for load 1, got 2.0"),
    ],
)
def test_keys_of_loads_on_a_structure(raft, load, options, message):
    second = {"f": raft.f} | load if isinstance(load, dict) else load
    with pytest.raises(TypeError, match=message):
        load_path(raft.punch, [{"f": raft.f}, second], **options)
    with pytest.raises(TypeError, match="expected f in load 0, got"):
        load_path(raft.punch, [{"method": "cg"}])


@pytest.mark.filterwarnings("ignore:contact on")
def test_moment_rotation():
    of = punch(disc(4))
    curve = moment_rotation(of, 2.0, direction=(3.0, 4.0), steps=8)
    assert curve.direction == pytest.approx([0.6, 0.8])
    assert curve.overturning == pytest.approx(1.0, rel=1e-2)
    assert curve.lift_off == pytest.approx(1 / 3, rel=1e-2)
    assert curve.success
    e, rotation = curve.eccentricity, curve.rotation
    assert curve.moment == pytest.approx(2 * e)
    assert np.hypot(*curve.moments) == pytest.approx(2 * e)
    full = e < 1 / 3
    # exact: 3 M / (4 a^3 E*) in full contact, softer beyond
    assert rotation[full] == pytest.approx(0.75 * curve.moment[full], rel=3e-3, abs=1e-4)
    softness = np.diff(rotation) / np.diff(curve.moment)
    assert (np.diff(softness[1:]) > -1e-3).all()
    assert softness[-1] > 10 * softness[0]
    assert (np.diff(curve.contact_area) < 1e-9).all()
    assert curve.eccentricity[-1] == pytest.approx(0.97, rel=2e-2)


@pytest.mark.filterwarnings("ignore:contact on")
def test_moment_rotation_of_a_shaped_punch_has_no_lift_off():
    curve = moment_rotation(punch(rectangle(10), gap=Paraboloid(30.0)), 1.0, steps=3)
    assert np.isnan(curve.lift_off)
    assert curve.rotation[-1] > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"direction": (0, 0)}, "expected a direction"),
        ({"steps": 1}, r"steps from 2 to 1e\+06, got 1"),
    ],
)
def test_bad_curves(options, message):
    with pytest.raises(ValueError, match=message):
        moment_rotation(punch(disc(1)), 1.0, **options)
    with pytest.raises(ValueError, match="expected a force that has a moment"):
        moment_rotation(punch(disc(1)), 0.0)
    with pytest.raises(ValueError, match="origin of the punch inside"):
        moment_rotation(punch(disc(1), origin=(5.0, 0.0)), 1.0)


def test_the_outermost_cells_are_no_limit_of_ground_that_pulls():
    """The curve ran backwards from an origin beyond them, and cells in a row ended in Qhull's."""
    mesh = MeshTri.init_tensor(np.linspace(-1, 1, 7), np.linspace(-1, 1, 7))
    footing = RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), origin=(0.95, 0.0))
    curve = moment_rotation(footing, 1.0, steps=3, unilateral=False)
    assert curve.eccentricity[-1] == pytest.approx(0.97 * 0.05)
    with pytest.raises(ValueError, match="origin of the punch inside where the pressures of its"):
        moment_rotation(footing, 1.0, steps=3)
    row = MeshQuad.init_tensor(np.linspace(0, 5, 6), np.linspace(0, 1, 2))
    shaped = {"origin": (2.5, 0.5), "gap": lambda x: 0.01 * (x[0] - 2.5) ** 2}
    with pytest.raises(ConvergenceError, match="cells in a row resist no tilt"):
        moment_rotation(RigidPunch(UNIT, CellBasis(row, ElementQuad0()), **shaped), 1.0)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize(
    ("origin", "direction"), [((0.8, 0.0), (0, 1)), ((0.0, 0.4), (1, -0.5)), ((-0.9, 0.0), (1, 0))]
)
def test_lifted_off_where_the_origin_is_outside_of_the_kern(origin, direction):
    of = punch(rectangle(6).scaled((1.0, 0.5)), origin=origin)
    curve = moment_rotation(of, 1.0, direction=direction, steps=3)
    assert curve.contact_area[0] < 0.99 * of.partition.areas.sum()
    assert curve.lift_off == 0.0
    assert plot_moment_rotation(curve).get_legend() is None  # of one curve only


def test_load_vectors_of_structures_are_loads():
    alone = plate(n=100)
    found = load_path(alone.punch, [alone.f, {"f": 2 * alone.f}])
    assert found[1].pressure == pytest.approx(2 * found[0].pressure, rel=1e-6)
    assert np.array_equal(found[0].pressure, alone.punch.solve(alone.f).pressure)


@pytest.mark.filterwarnings("ignore:the ground would have to pull")
def test_nothing_lifts_off_where_the_ground_may_pull():
    curve = moment_rotation(punch(disc(3)), 1.0, steps=4, unilateral=False)
    assert np.isnan(curve.lift_off)
    assert curve.contact_area == pytest.approx(curve.contact_area[0])
    (told,) = plot_moment_rotation(curve).get_legend().get_texts()
    assert told.get_text() == "ground pulls"


@pytest.mark.filterwarnings("ignore:contact on")
def test_moment_rotation_on_crusts_that_bend_away():
    """The middle hardly touches from the beginning; there may be no kern."""
    for ratio in (20.0, 50.0):
        crust = LayeredHalfSpace([Layer(0.2, 1.0, 0.3)], HalfSpace(1 / ratio, 0.3))
        punch = RigidPunch(crust, DualMesh.from_mesh(MeshTri.init_circle(3)).basis())
        curve = moment_rotation(punch, 1.0, steps=3)
        assert curve.lift_off == 0.0
        assert (np.diff(curve.rotation) > 0).all()
