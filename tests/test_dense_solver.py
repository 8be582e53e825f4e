"""Large dense matrices without factors."""

import numpy as np
import pytest
from marks import slow
from plans import disc, perturbed, rectangle

from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace, Paraboloid, RigidPunch
from skfem_dual.operators.dense_solver import DenseSolver

SOIL = HalfSpace(1.0, 0.25)
THIN = LayeredHalfSpace([Layer(0.1, 1.0, 0.45)], "bonded")


SQUARE, STRIP = perturbed(rectangle(20), 0.02), rectangle(60, 3.0, 0.3, graded=True)


@pytest.mark.parametrize(
    ("mesh", "ground"),
    [(SQUARE, SOIL), (STRIP, THIN), *slow((SQUARE, THIN), (STRIP, SOIL))],
)
def test_solutions_to_rounding_without_factors(mesh, ground):
    punch = RigidPunch(ground, DualMesh.from_mesh(mesh).basis())
    solver = DenseSolver.from_matrix(punch.matrix, punch.partition)
    rhs = np.column_stack([np.ones(len(punch.partition)), punch.collocation_points.T])
    found = solver.solve(rhs)
    assert found == pytest.approx(np.linalg.solve(punch.matrix, rhs), rel=1e-10)
    assert np.abs(punch.matrix @ found - rhs).max() < 1e-12 * np.abs(rhs).max()
    assert "factors" not in vars(solver)
    assert solver.solve(rhs[:, 0]) == pytest.approx(found[:, 0], rel=1e-11)
    assert solver.condition_number(punch.matrix) > 1
    assert np.array_equal(solver.solve(rhs), found)  # whoever asked before


def test_factors_where_iterations_do_not_end():
    """A matrix without a distance in it; and many right-hand sides."""
    partition = DualMesh.from_mesh(disc(3)).basis().partition
    n = len(partition)
    matrix = np.random.default_rng(0).standard_normal((n, n))
    solver = DenseSolver.from_matrix(matrix, partition)
    assert matrix @ solver.solve(np.ones(n)) == pytest.approx(np.ones(n), rel=1e-9)
    assert "factors" in vars(solver)
    punch = RigidPunch(SOIL, DualMesh.from_mesh(disc(3)).basis())
    solver = DenseSolver.from_matrix(punch.matrix, punch.partition)
    assert punch.matrix @ solver.solve(np.eye(n)) == pytest.approx(np.eye(n), abs=1e-11)


@pytest.mark.parametrize("shape", [{}, {"gap": Paraboloid(1.0)}])
def test_contact_is_that_by_factors(shape, monkeypatch):
    punches = [RigidPunch(SOIL, DualMesh.from_mesh(disc(4)).basis(), **shape) for _ in range(2)]
    direct = punches[0].solve(0.3, (0.55, 0.1))
    monkeypatch.setattr("skfem_dual.contact.system.ITERATED", 100)
    monkeypatch.setattr("skfem_dual.contact.unilateral.SOONER", 100)
    found = punches[1].solve(0.3, (0.55, 0.1))
    assert isinstance(punches[1].system.factors, DenseSolver)
    assert "factors" not in vars(punches[1].system.factors)
    np.testing.assert_array_equal(found.contact, direct.contact)
    assert found.pressure == pytest.approx(direct.pressure, rel=1e-9, abs=1e-12)
