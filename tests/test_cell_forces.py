import numpy as np
import pytest
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import ConvergenceWarning, DualMesh, HalfSpace, RigidPunch, Sphere
from skfem_dual.contact.cell_forces import CellForces
from skfem_dual.contact.problem import ContactProblem
from skfem_dual.grids.generate import disc


@pytest.mark.parametrize(("bodies", "n"), [(1, 7), (1, 3000), (5, 200), (40, 2500)])
def test_nearest_forces_of_several_bodies(bodies, n):
    """They do not pull, have the resultants given, and are moved by a plane under each body."""
    rng = np.random.default_rng(n)
    areas, body = rng.uniform(0.5, 2.0, n), np.sort(rng.integers(bodies, size=n))
    mine = body == np.arange(bodies)[:, None]
    planes = mine[:, None] * np.vstack([np.ones(n), rng.uniform(-1, 1, (2, n))])
    planes = planes.reshape(3 * bodies, n)
    given = planes @ rng.uniform(0, 1, n)
    problem = ContactProblem(np.empty(0), areas, np.zeros(n), planes, planes * areas, given)
    start = rng.uniform(-1, 1, n)
    force = CellForces.from_problem(problem).balanced(start)
    assert force.min() >= 0
    assert planes @ force == pytest.approx(given, abs=1e-11 * given.max())
    moved, pressed = (force - start) / np.sqrt(areas), force > 0
    mu = np.linalg.lstsq(planes[:, pressed].T, moved[pressed])[0]
    assert mu @ planes[:, pressed] == pytest.approx(moved[pressed], abs=1e-10)
    assert (start + np.sqrt(areas) * (mu @ planes))[~pressed].max(initial=0) < 1e-10


def test_contact_as_flat_as_rounding():
    """Gaps of a few cells that are zero to the last digit leave no direction to follow."""
    basis = DualMesh.from_mesh(disc(n=30)).basis()
    punch = RigidPunch(HalfSpace(30e6, 0.25), basis, gap=Sphere(1.0))
    with pytest.warns(ConvergenceWarning, match="the load alone tells their pressures"):
        solution = punch.solve(1e-3, method="cg")
    assert not solution.success
    assert solution.iterations < 20


def test_forces_far_smaller_than_those_they_are_nearest_to():
    """As under a pillar whose surroundings are far above the ground, at the first step."""
    side = np.linspace(0, 1, 21)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    punch = RigidPunch(
        HalfSpace(1.0, 0.3), cells, gap=lambda x: 1.0 * (np.hypot(x[0] - 0.5, x[1] - 0.5) > 0.2)
    )
    light, heavy = (punch.solve(force, tilt=(0, 0), method="cg") for force in (1e-14, 1e-4))
    assert light.success
    assert 1e10 * light.pressure == pytest.approx(heavy.pressure, rel=1e-4, abs=1e-8)
