import numpy as np
import pytest

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
