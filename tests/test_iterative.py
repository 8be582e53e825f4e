"""Iterative solutions against direct ones."""

import numpy as np
import pytest
from marks import slow
from plans import disc, sin_graded
from skfem import MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace, RigidPunch
from skfem_dual.grids import generate
from skfem_dual.operators import iterative
from skfem_dual.operators.influence_operator import InfluenceOperator
from skfem_dual.operators.iterative import solve_many
from skfem_dual.operators.preconditioner import Preconditioner

GROUNDS = {
    "homogeneous": HalfSpace(3.0, 0.2),
    "graded": GradedHalfSpace.init_linear(2.0, 0.25, 0.5),
    "layered": LayeredHalfSpace([Layer(0.7, 2.0, 0.3)], "bonded"),
}


def planes(basis):
    """Settlements of a punch by a unit settlement and unit tilts."""
    x = basis.partition.centroids
    return np.vstack([np.ones(x.shape[1]), x]).T


@pytest.mark.parametrize(
    "ground",
    ["homogeneous", *slow("graded", "layered")],
)
@pytest.mark.parametrize("method", ["dense", "fast"])
def test_direct_solution(ground, method):
    ground = GROUNDS[ground]
    basis = DualMesh.from_mesh(disc(4)).basis()
    expected = np.linalg.solve(RigidPunch(ground, basis).matrix, planes(basis))
    operator = InfluenceOperator(ground, basis, 1e-6, method)
    found = solve_many(operator, planes(basis), 1e-8)
    assert found.success
    assert f"{found.iterations[1]} iterations to" in found.message
    assert np.linalg.norm(found.solution - expected) < 2e-5 * np.linalg.norm(expected)
    residual = np.linalg.norm(operator @ found.solution - planes(basis), axis=0)
    assert np.all(residual <= 1.0001e-8 * np.linalg.norm(planes(basis), axis=0))
    assert len(found.residuals) == 3
    assert [len(column) - 1 for column in found.residuals] == list(found.iterations)
    assert not found.solution.flags.writeable
    for column in found.residuals:
        assert column[0] == 1.0
        assert column[-1] <= 1e-8
        assert np.all(np.diff(column[:-1]) <= 1e-12)


def test_circle():
    """Settlement and tilt of a rigid disc, exact: F = 2 a W0 E*, M = 4/3 a^3 L E*."""
    basis = DualMesh.from_mesh(disc(6)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 1e-6, "fast")
    found = solve_many(operator, planes(basis), 1e-7)
    assert found.success
    acting = np.vstack([np.ones(operator.shape[1]), operator.weights.centroids])
    resultants = acting * basis.partition.areas @ found.solution
    assert resultants == pytest.approx(np.diag([2, 4 / 3, 4 / 3]), rel=2e-4, abs=1e-4)
    assert max(found.iterations) < 19


def test_iterations_hardly_depend_on_the_mesh():
    counts = []
    for mesh in (disc(4), disc(6), sin_graded(MeshTri.init_circle(5))):
        basis = DualMesh.from_mesh(mesh).basis()
        operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 1e-5, "fast")
        one = planes(basis)[:, :1]
        found = solve_many(operator, one)  # to 1e-6, by products in single precision
        assert found.success
        assert np.linalg.norm(operator @ found.solution - one) <= 1.2e-6 * np.linalg.norm(one)
        counts.append(found.iterations[0])
    assert max(counts) <= 6


@pytest.mark.parametrize("hardness", slow(60.0, 4.0, 10.0))
def test_stiff_crusts_take_few_iterations(hardness):
    """Beyond the near field cells act through the ground below, not as the crust alone would."""
    ground = LayeredHalfSpace([Layer(0.2, hardness, 0.25)], HalfSpace(1.0, 0.25))
    basis = DualMesh.from_mesh(generate.disc(n=2500)).basis()
    operator = InfluenceOperator(ground, basis, 1e-6, "fast")
    found = solve_many(operator, planes(basis)[:, :1])
    assert found.success
    assert found.iterations[0] <= 10


def test_preconditioner_is_an_approximate_inverse():
    basis = DualMesh.from_mesh(disc(4)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 1e-6)
    inverse = Preconditioner.from_operator(operator)
    matrix = operator.to_dense()
    product = np.stack([inverse @ column for column in matrix.T], axis=1)
    values = np.linalg.eigvals(product)
    assert values.real.min() > 0.5
    # of high waves nothing is left to do
    assert np.median(np.abs(values - 1)) < 0.3


def test_on_a_single_group_it_is_the_inverse():
    """To the four digits that it keeps."""
    basis = DualMesh.from_mesh(MeshTri().refined(1)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 1e-8)
    found = solve_many(operator, np.ones((9, 1)), 1e-5)
    assert found.success
    assert found.iterations[0] <= 2
    assert operator @ found.solution == pytest.approx(np.ones((9, 1)), rel=2e-5)


def test_scales():
    """Stiff ground, small plans, by powers of two which leave the rounding as it is: the same
    iterations."""
    basis = DualMesh.from_mesh(disc(3)).basis()
    tiny = DualMesh.from_mesh(disc(3).scaled(2.0**-30)).basis()
    exact = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 0.0)
    first = solve_many(exact, planes(basis)[:, :1], 1e-9)
    stiff = InfluenceOperator(HalfSpace(2.0**36, 0.0), tiny, 0.0)
    second = solve_many(stiff, planes(tiny)[:, :1], 1e-9)
    assert 2.0**66 * first.solution == pytest.approx(second.solution, rel=1e-9)
    assert first.iterations == second.iterations


def test_restarts(monkeypatch):
    monkeypatch.setattr(iterative, "RESTART", 4)
    basis = DualMesh.from_mesh(disc(4)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 1e-6)
    found = solve_many(operator, planes(basis)[:, :1], 1e-7)
    assert found.success
    assert found.iterations[0] > 5


def test_no_convergence(monkeypatch):
    monkeypatch.setattr(iterative, "MOST", 3)
    basis = DualMesh.from_mesh(disc(4)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, 1e-6)
    rhs = np.hstack([planes(basis)[:, :1], np.zeros((len(basis.partition), 1))])
    found = solve_many(operator, rhs, 1e-10)
    assert not found.success
    assert "columns [0] have not converged" in found.message
    assert found.iterations == (3, 0)
    assert found.residuals[1] == (0.0,)
    assert not found.solution[:, 1].any()


def test_progress(capsys):
    basis = DualMesh.from_mesh(disc(2)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis)
    solve_many(operator, planes(basis))
    assert capsys.readouterr() == ("", "")
    solve_many(operator, planes(basis), progress=True)
    assert "3/3" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("rhs", "rtol", "message"),
    [
        (np.ones(41), 1e-6, r"shape \(41, k\), got \(41,\)"),
        (np.ones((40, 1)), 1e-6, r"got \(40, 1\)"),
        (np.full((41, 2), np.nan), 1e-6, "finite rhs, got nan at column 0"),
        (np.ones((41, 1)), 0.0, "rtol above 0 and below 1, got 0"),
    ],
)
def test_bad_input(rhs, rtol, message):
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), DualMesh.from_mesh(disc(2)).basis())
    with pytest.raises(ValueError, match=message):
        solve_many(operator, rhs, rtol)


def test_not_square():
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), DualMesh.from_mesh(disc(2)).basis())
    other = operator.at([[0.0], [0.0]])
    with pytest.raises(ValueError, match="square"):
        Preconditioner.from_operator(other)


def test_residuals_hold_where_parts_of_the_ground_cancel(monkeypatch):
    """A thin layer that keeps its volume settles by a hundredth of its rounded parts."""
    soil = LayeredHalfSpace([Layer(0.1, 1.0, 0.5)], "bonded")
    basis = DualMesh.from_mesh(generate.disc(n=800)).basis()
    operator = InfluenceOperator(soil, basis, method="fast")
    found = solve_many(operator, planes(basis))
    assert found.success
    left = np.linalg.norm(planes(basis) - operator @ found.solution, axis=0)
    assert (left < 3.1e-6 * np.linalg.norm(planes(basis), axis=0)).all()
    monkeypatch.setattr(iterative, "CORRECTIONS", 0)  # what is left is told
    found = solve_many(operator, planes(basis))
    assert not found.success
    assert max(history[-1] for history in found.residuals) > 3e-6


@pytest.mark.parametrize("unit", [1e-200, 1e160])
def test_right_hand_sides_whose_squares_are_no_numbers(unit):
    basis = DualMesh.from_mesh(disc(3)).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, method="fast")
    rhs = planes(basis)[:, :1]
    one, other = (solve_many(operator, size * rhs) for size in (1.0, unit))
    assert other.success
    np.testing.assert_allclose(other.solution, unit * one.solution, rtol=1e-9)
