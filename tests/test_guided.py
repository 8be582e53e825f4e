"""Pressures and motions in one search."""

import numpy as np
import pytest
from plans import disc

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.contact.problem import ContactProblem
from skfem_dual.contact.unilateral import active_set
from skfem_dual.operators.dense_solver import TwoLevels
from skfem_dual.operators.guided import Guided, Part

PUNCH = RigidPunch(HalfSpace(1.0, 0.25), DualMesh.from_mesh(disc(4)).basis())
PARTITION = PUNCH.partition
INSIDE = np.nonzero(np.hypot(*PARTITION.centroids - 0.1) < 0.6)[0]


@pytest.mark.parametrize("motions", [0, 1, 3])
def test_both_are_those_of_all_equations(motions):
    """As the whole matrix of pressures and motions has them, without resultants."""
    matrix = PUNCH.matrix[np.ix_(INSIDE, INSIDE)]
    x, k = PARTITION.centroids[:, INSIDE], len(INSIDE)
    planes = np.vstack([np.ones(k), x])[:motions]
    acting = planes * PARTITION.areas[INSIDE]
    inverse = TwoLevels.from_matrix(PUNCH.matrix, PARTITION)
    rest = np.exp(x[0]) * np.cos(5 * x[1])
    found = Guided.of(matrix, planes, acting, Part(inverse, INSIDE, len(PARTITION))).solve(rest, 1)
    whole = np.block([[matrix, -planes.T], [acting, np.zeros((motions, motions))]])
    expected = np.linalg.solve(whole, np.append(rest, np.zeros(motions)))
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-10 * np.abs(expected).max())
    assert np.abs(acting @ found[:k]).max(initial=0) < 1e-13 * np.abs(found[:k]).max()


def test_nothing_is_left_to_do():
    guided = Guided.of(np.eye(3), np.ones((1, 3)), np.ones((1, 3)), np.eye(3))
    assert not guided.solve(np.full(3, 1e-16), 1.0).any()


@pytest.mark.parametrize("useless", [False, True])
def test_contact_is_that_by_factors(useless, monkeypatch):
    """Also where the approximate inverse leads nowhere; begun with cells that do not touch."""
    n, given = len(PARTITION), np.array([1.0, 0.6, 0.1])
    planes = PUNCH.planes(PUNCH.collocation_points)
    known = PARTITION.areas, np.zeros(n), planes, PUNCH.resultants, given
    expected = active_set(ContactProblem(PUNCH.matrix, *known), np.ones(n, dtype=bool))
    inverse = TwoLevels.from_matrix(PUNCH.matrix, PARTITION)
    if useless:
        inverse = np.random.default_rng(0).standard_normal((n, n))
    monkeypatch.setattr("skfem_dual.contact.unilateral.SOONER", 1)
    problem = ContactProblem(PUNCH.matrix, *known, inverse)
    found = active_set(problem, np.ones(n, dtype=bool))
    assert found.success
    assert 0.3 * n < found.touching.sum() < 0.8 * n
    assert found.history == expected.history
    assert np.array_equal(found.touching, expected.touching)
    largest = expected.pressure.max()
    assert found.pressure == pytest.approx(expected.pressure, abs=1e-11 * largest)
    assert found.motion == pytest.approx(expected.motion, rel=1e-12)
