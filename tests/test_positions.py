"""Imposed settlements: without contact, with the reaction elsewhere, and impossible ones."""

import numpy as np
import pytest
from marks import slow
from plans import disc, rectangle
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import Cone, DualMesh, HalfSpace, Paraboloid, RigidPunch, RigidPunches
from skfem_dual.contact.positions import _bracket

SOIL = HalfSpace(1.0, 0.3)
PLANS = {"disc": disc(2), "rectangle": rectangle(8, 1.0, 0.5)}
BASES = {name: DualMesh.from_mesh(mesh).basis() for name, mesh in PLANS.items()}


@pytest.mark.parametrize("method", ["auto", "active-set", "cg"])
@pytest.mark.parametrize("gap", [None, Paraboloid(1.0), Cone(0.3)])
@pytest.mark.parametrize("at", [(0.0, 0.0), (0.2, 0.1)])
def test_no_contact_is_an_answer(method, gap, at):
    solution = RigidPunch(SOIL, BASES["disc"], gap=gap).solve(
        settlement=-1e-3, at=at, method=method
    )
    assert solution.success
    assert solution.message == "no contact"
    assert not solution.pressure.any()
    assert solution.settlement == -1e-3
    assert (solution.tilt == 0).all()
    assert (solution.gap >= 1e-3 - 1e-15).all()


def test_no_force_leaves_contact_without_pressure():
    """What message, area and share of a table say is the same."""
    punch = RigidPunch(SOIL, BASES["disc"])
    cases = punch.solve_many({"none": {"force": 0.0}, "above": {"settlement": -1.0}})
    assert cases.messages == ("contact without pressure", "no contact")
    assert cases.contact_share.tolist() == [1.0, 0.0]
    whole = punch.partition.areas.sum()
    assert cases["none"].contact_area == pytest.approx(whole, rel=1e-12)
    assert cases["above"].contact_area == 0.0


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("settlement", [1e-3, 3e-3, 0.01, 0.03])
@pytest.mark.parametrize("at", [(0.03, -0.02), (0.02, 0.01)])
def test_pressed_less_than_a_cell(settlement, at):
    """The punch turns away from the ground, or a few cells bear it: gaps and loads tell."""
    of = RigidPunch(SOIL, BASES["rectangle"], gap=Paraboloid(1.0))
    solution = of.solve(settlement=settlement, at=at)
    assert solution.success
    assert solution.settlement == pytest.approx(settlement, rel=1e-12)
    x = of.collocation_points
    gap = of.initial_gap - solution.punch_displacement(x) + of.matrix @ solution.pressure
    assert gap.min() > -1e-12
    assert np.abs(gap[solution.pressure > 0]).max(initial=0.0) < 1e-12
    if solution.force > 0:
        assert solution.centre_of_pressure == pytest.approx(at, abs=1e-9)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("method", ["auto", "cg"])
@pytest.mark.parametrize("seed", [*range(3), *slow(*range(3, 6))])
def test_settlements_that_some_force_causes_are_found(seed, method):
    """Take the settlement from a solution under a force: the force is found again."""
    rng = np.random.default_rng(seed)
    for gap in (None, Paraboloid(rng.uniform(0.5, 4)), Cone(rng.uniform(0.1, 0.5))):
        for basis in BASES.values():
            force, at = rng.uniform(0.1, 2.0), rng.uniform(-0.35, 0.35, 2)
            origin = rng.uniform(-1, 1, 2)
            given = RigidPunch(SOIL, basis, gap=gap).solve(force, tuple(at))
            level = given.settlement + given.tilt @ origin
            of = RigidPunch(SOIL, basis, gap=gap, origin=tuple(origin))
            found = of.solve(settlement=level, at=tuple(at - origin), method=method)
            assert found.success
            assert found.settlement == pytest.approx(level, rel=1e-9, abs=1e-12)
            if found.force == 0 and level < 0:
                assert found.message == "no contact"  # the other answer there is
                continue
            assert found.centre_of_pressure == pytest.approx(at - origin, abs=1e-6)


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_reactions_beside_the_plan_are_refused(unit):
    mesh = rectangle(8).scaled(unit)
    of = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), origin=(1.2 * unit, 0.0))
    with pytest.raises(ValueError, match="outside the convex hull") as told:
        of.solve(settlement=unit)
    # the outermost pressures act a little inside the edge at 1
    distance = float(str(told.value).split("more than ")[1].split()[0]) / unit
    assert 0.2 < distance < 0.2 + 2 / 8
    assert of.solve(settlement=unit, at=(-1.2 * unit, 0.0)).success
    # with tension, and with the tilt given, there is an answer
    assert of.solve(settlement=unit, unilateral=False).success
    assert of.solve(settlement=unit, tilt=(0.0, 0.0)).success


def test_reactions_with_moments():
    """Moments move the reaction: towards the plan there is an answer, away from it none."""
    of = RigidPunch(SOIL, DualMesh.from_mesh(rectangle(8)).basis(), origin=(1.2, 0.0))
    solution = of.solve(settlement=1.0, moments=(1.0, 0.0))
    assert solution.success
    assert solution.resultant[1] == pytest.approx(-1.0)
    assert solution.resultant[2] == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(ValueError, match="from the origin and moments, outside"):
        of.solve(settlement=1.0, moments=(-1.0, 0.0))


@pytest.mark.parametrize("method", ["auto", "active-set", "cg"])
def test_settlement_imposed_beside_the_lowest_point(method):
    """One cell overlaps, with an arm: forces on it alone have moments, and the punch turns."""
    line = np.linspace(-1.0, 1.0, 13)
    cells = CellBasis(MeshQuad.init_tensor(line, line), ElementQuad0())
    punch = RigidPunch(SOIL, cells, gap=Paraboloid(1.0, (0.1, -0.05)))
    s = punch.solve(settlement=0.001, method=method)
    assert s.success
    assert s.message == "no contact"
    assert (s.gap > 0).all()


@pytest.mark.filterwarnings("ignore:contact on")
def test_force_without_an_arm_is_a_load():
    """Rests on one cell in the middle: what others bear is no measure of its moments."""
    cells = DualMesh.from_mesh(disc(3)).basis()
    punch = RigidPunch(SOIL, cells, gap=Paraboloid(1.0, (0.57700241, 0.22265038)))
    s = punch.solve(settlement=0.1951377828803449)
    assert s.success
    assert s.force > 0
    assert s.centre_of_pressure == pytest.approx((0, 0), abs=1e-9)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("method", ["auto", "active-set"])
@pytest.mark.parametrize(("centre", "settlement"), [(0.8, 0.2), (0.8, 0.4), (-0.4, 0.2)])
def test_one_body_of_a_group_turns_out_of_the_way(method, centre, settlement):
    """What others bear is no measure of its rounding."""
    soil, mesh = HalfSpace(1.0, 0.0), disc(2)
    shaped = RigidPunch(soil, BASES["disc"], gap=Paraboloid(1.0, (centre, 0.0)))
    flat = RigidPunch(soil, DualMesh.from_mesh(mesh.translated((2.5, 0.0))).basis())
    loads = [{"settlement": settlement}, {"force": 1.0, "at": (2.5, 0.0)}]
    found = RigidPunches([shaped, flat]).solve(loads, method=method)
    assert found.success
    assert found[0].force == 0.0
    alone = flat.solve(1.0, (2.5, 0.0)).collocated_settlement
    assert found[1].collocated_settlement == pytest.approx(alone, rel=1e-9)


@pytest.mark.parametrize("method", ["auto", "active-set", "cg"])
def test_forces_below_which_the_punch_turns_over(method):
    """Between two steps of the search: a quarter of the first force turns it over."""
    basis = DualMesh.from_mesh(disc(3)).basis()
    of = RigidPunch(SOIL, basis, origin=(0.4, 0.0))
    beside = {"at": (-0.4, 0.0), "moments": (-0.3, 0.0)}
    given = of.solve(0.5, **beside)
    found = of.solve(settlement=given.settlement, method=method, **beside)
    assert found.success
    assert found.force == pytest.approx(0.5, rel=1e-4)
    assert found.settlement == pytest.approx(given.settlement, rel=1e-9)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("settlement", [-0.0075, 0.108])
def test_of_several_reactions_all_roads_find_one(settlement):
    """That next to the force of full contact; another tilts the punch onto a few cells."""
    basis = DualMesh.from_mesh(disc(3)).basis()
    of = RigidPunch(HalfSpace(1.0, 0.0), basis, gap=Paraboloid(1.0), origin=(-0.6, 0.0))
    load = {"settlement": settlement, "at": (1.2, 0.0), "moments": (0.03, 0.0)}
    found = [of.solve(**load, method=method) for method in ("auto", "active-set", "cg")]
    found += of.solve_many([load]).solutions
    for each in found:
        assert each.success
        assert each.force == pytest.approx(found[0].force, rel=1e-7)
    assert found[0].force > 0.4
    again = of.solve(found[0].force, at=load["at"], moments=load["moments"])
    assert again.settlement == pytest.approx(settlement, rel=1e-3, abs=1e-5)


def test_settlements_that_no_force_causes():
    """A component that turns before it comes out as imposed is searched where it turns."""
    tried = []

    def missed(force, low=0.02):
        tried.append(force)
        return (np.log(force / 3.0)) ** 2 - low if force > 0.9 else np.nan

    a, b = _bracket(missed, 1.0)
    assert missed(a) * missed(b) < 0
    assert 0.9 < a < b < 4.0
    tried.clear()
    assert _bracket(lambda force: missed(force, -0.02), 1.0) is None
    assert len(tried) < 60
    assert _bracket(lambda force: np.nan, 1.0) is None
