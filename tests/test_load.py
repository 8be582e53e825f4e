import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from skfem_dual import DualMesh, HalfSpace, Load, RigidPunch
from skfem_dual.contact.hull import Hull
from skfem_dual.contact.load import Constraints
from skfem_dual.errors import warnings_kept
from skfem_dual.grids.generate import rectangle

ORIGIN = np.array([0.3, -0.2])
LOADS = {
    "force": Load(force=2.0, at=(0.1, 0.2), moments=(0.3, -0.4)),
    "guided": Load(force=2.0, tilt=(0.1, 0.2)),
    "placed": Load(settlement=0.5, tilt=(0.1, 0.2)),
    "pushed": Load(settlement=0.5, at=(0.1, 0.2), moments=(0.3, -0.4)),
}


@pytest.mark.parametrize("name", LOADS)
def test_as_many_motions_as_equations(name):
    found = LOADS[name].constraints(ORIGIN)
    k = {"force": 3, "guided": 1, "placed": 0, "pushed": 2}[name]
    assert found.motions.shape == (3, k)
    assert found.balance.shape == (k, 3)
    assert found.given.shape == (k,)
    assert found.conjugate == (name != "pushed")


def test_motions_keep_what_is_imposed():
    """Whatever the free motions, settlement of the origin and tilt are those given."""
    for name in ("placed", "pushed", "guided"):
        load = LOADS[name]
        c = load.constraints(ORIGIN)
        for y in np.random.default_rng(0).standard_normal((3, c.motions.shape[1])):
            position = c.fixed + c.motions @ y
            if load.settlement is not None:
                assert position[0] + position[1:] @ ORIGIN == pytest.approx(0.5)
            if load.tilt is not None:
                assert position[1:] == pytest.approx(load.tilt)


def test_balance_is_about_the_load():
    """A force at the load point with the moments of (4) balances, wherever it is seen from."""
    load = LOADS["force"]
    c = load.constraints(ORIGIN)
    x = ORIGIN + load.point
    assert c.balance @ (load.force * np.array([1.0, *x])) == pytest.approx(c.given)
    pushed = LOADS["pushed"].constraints(ORIGIN)
    x = ORIGIN + np.array([0.1, 0.2]) + np.array([-0.3, -0.4]) / 7.0
    assert pushed.balance @ (7.0 * np.array([1.0, *x])) == pytest.approx(pushed.given)


def test_several_bodies():
    parts = [load.constraints(ORIGIN) for load in LOADS.values()]
    found = Constraints.together(parts)
    assert found.motions.shape == (12, 6)
    assert not found.conjugate
    assert Constraints.together(parts[:3]).conjugate
    assert Constraints.together(parts[:1]).motions == pytest.approx(parts[0].motions)


def test_where_the_resultant_must_act():
    assert Load(force=2.0, at=(0.1, 0.2), moments=(0.3, -0.4)).point == pytest.approx((-0.05, 0.0))
    assert Load(force=2.0).point == (0.0, 0.0)
    assert Load(force=0.0).point is None
    assert Load(force=1.0, tilt=(0, 0)).point is None
    assert Load(settlement=1.0).point == (0.0, 0.0)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 200), st.floats(0.0, 3.0))
def test_hull_of_few_points_is_that_of_all(seed, n, squareness):
    """Points in a square or a disc, many on its edge or in one place."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (2, n)).round(1 if squareness > 1 else 15)
    points = np.hstack([points, points[:, :2]])
    if squareness > 2:
        points /= np.hypot(*points).clip(1)
    hull, expected = Hull(points), ConvexHull(points.T).equations
    x = rng.uniform(-2, 2, (2, 20))
    for at in x.T:
        beyond = (expected @ [*at, 1.0]).max()
        assert hull.beyond(at) == pytest.approx(beyond, abs=1e-9)
        assert hull.holds(at) == Hull(points[:, ::-1]).holds(at) == (beyond <= 0)


def test_hull_of_points_on_turned_sides_far_away():
    """Corners do not count as points inside, which they are by rounding."""
    rng = np.random.default_rng(0)
    for angle in rng.uniform(0, 2 * np.pi, 100):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = np.stack([rng.uniform(-1, 1, 150), rng.choice([-1.0, 1.0], 150)])
        x = turn @ rng.uniform(-1.2, 1.2, 2) + 5e6
        points = turn @ points + 5e6
        beyond = (ConvexHull(points.T).equations @ [*x, 1.0]).max()
        assert Hull(points).beyond(x) == pytest.approx(beyond, abs=1e-8)


def test_points_on_a_line_have_no_hull():
    for points in (np.zeros((2, 1)), np.ones((2, 9)), np.array([[0.0, 1, 2], [0, 1, 2]])):
        assert Hull(points).beyond(np.array([5.0, 3.0])) == -np.inf
        assert Hull(points).holds(np.array([5.0, 3.0]))


@pytest.mark.parametrize("at", [(5.0, 5.0), (0.98, 1.49), (0.0, 9.0), (1.0, 0.0)])
def test_loads_moved_as_told_are_carried(at):
    """The distance to the farthest line of a side was told, which off a corner is too little."""
    punch = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(rectangle(2.0, 3.0, n=100)).basis())
    with pytest.raises(ValueError, match="towards the middle") as error:
        punch.solve(1.0, at=at)
    distance = float(re.search(r"more than (\S+) towards", str(error.value))[1])
    x = np.array(at)
    moved = x * (1 - 1.02 * distance / np.hypot(*x))
    with warnings_kept():  # on few cells
        assert punch.solve(1.0, at=tuple(moved)).force == pytest.approx(1.0, rel=1e-9)
    with pytest.raises(ValueError, match="towards the middle"):
        punch.solve(1.0, at=tuple(x * (1 - 0.98 * distance / np.hypot(*x))))


def test_reactions_to_settlements_act_where_they_must():
    assert Load(settlement=0.01, at=(0.1, 0)).point == (0.1, 0.0)
    assert Load(settlement=0.01).point == (0.0, 0.0)
    assert Load(settlement=0.01, moments=(1.0, 0.0)).point is None
    assert Load(settlement=0.01, tilt=(0.0, 0.0)).point is None
    assert Load(force=0.0).point is None


@pytest.mark.parametrize("name", ["force", "settlement", "torsion"])
def test_denormal_loads_are_refused(name):
    """Plans under them were solved without end."""
    given = {"force": 1.0} if name == "torsion" else {}
    with pytest.raises(ValueError, match=rf"the size of {name} of at least 2.23e-308, got 1e-320"):
        Load(**given | {name: -1e-320})
