import numpy as np
import pytest

from skfem_dual.contact.cell_forces import CellForces
from skfem_dual.contact.problem import ContactProblem


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
