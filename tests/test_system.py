"""The same punch with a matrix and with an operator in its place."""

import numpy as np
import pytest
from marks import slow
from plans import disc, perturbed, rectangle
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    RigidPunch,
    Symmetry,
)
from skfem_dual.contact import loaded_cells
from skfem_dual.operators import iterative
from skfem_dual.operators.influence_operator import InfluenceOperator
from skfem_dual.operators.symmetric_matrix import SymmetricMatrix

GROUNDS = {
    "homogeneous": HalfSpace(1.0, 0.0),
    "graded": GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0),
    "layered": LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], base="bonded"),
}


@pytest.fixture
def large(monkeypatch):
    """All but the smallest systems count as large ones."""
    monkeypatch.setattr(loaded_cells, "DENSE", 50)


@pytest.mark.parametrize(
    ("grid", "ground"),
    [
        ("dual", "layered"),
        ("primal", "homogeneous"),
        *slow(("dual", "homogeneous"), ("dual", "graded")),
        *slow(("primal", "graded"), ("primal", "layered")),
    ],
)
def test_iterated_solutions_are_those_of_the_factorised_matrix(ground, grid, large):
    dual = DualMesh.from_mesh(perturbed(disc(4), 0.01))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    whole = RigidPunch(GROUNDS[ground], basis, rtol=1e-7)
    assert isinstance(whole.operator, InfluenceOperator)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loaded_cells, "DENSE", 10**6)
        exact = RigidPunch(GROUNDS[ground], basis)
        assert isinstance(exact.operator, np.ndarray)
        for load in ({"force": 1.0, "at": (0.1, 0.05)}, {"force": 1.0, "at": (0.5, 0.1)}):
            expected = exact.solve(**load)
            found = whole.solve(**load)
            assert found.success
            assert found.message == expected.message
            settlement, tilt = expected.collocated_settlement, expected.collocated_tilt
            assert found.collocated_settlement == pytest.approx(settlement, rel=1e-6)
            assert found.collocated_tilt == pytest.approx(tilt, rel=1e-5)
            difference = np.linalg.norm(found.pressure - expected.pressure)
            assert difference < 2e-5 * np.linalg.norm(expected.pressure)
            assert np.abs(found.resultant_residual).max() < 1e-9


def test_large_shaped_punches(large):
    dual = DualMesh.from_mesh(rectangle(16))
    of = RigidPunch(GROUNDS["homogeneous"], dual.basis(), gap=Paraboloid(1.0))
    found = of.solve(0.2)
    assert found.iterations < 25
    assert found.settlement == pytest.approx((0.15) ** (2 / 3), rel=3e-3)
    bilateral = of.solve(0.2, unilateral=False)
    assert bilateral.pressure.min() < 0


def test_what_needs_a_matrix_says_so(large):
    of = RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(3)).basis())
    with pytest.raises(ValueError, match="dense matrix for the active set, got 145 cells"):
        of.solve(1.0, (0.6, 0.0), method="active-set")
    with pytest.raises(ValueError, match="dense matrix for the condition number"):
        _ = of.condition_number


def test_iterations_that_do_not_converge_are_told(large, monkeypatch):
    monkeypatch.setattr(iterative, "MOST", 1)
    of = RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(4)).basis())
    with pytest.warns(ConvergenceWarning, match="have not converged"):
        found = of.solve(1.0, unilateral=False)
    assert not found.success
    assert "have not converged" in found.message


def test_progress_bars(large, capsys):
    of = RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(3)).basis())
    of.solve(1.0, (0.6, 0.0), progress=True)
    shown = capsys.readouterr().err
    assert "GMRES" in shown
    assert "contact" in shown
    of.solve(1.0, (0.6, 0.1))
    assert capsys.readouterr() == ("", "")


def test_many_points(monkeypatch):
    """Displacements at many points are summed fast, to the tolerance."""
    from skfem_dual.contact import pressed

    found = RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(4)).basis()).solve(1.0)
    x = np.random.default_rng(0).uniform(-2, 2, (2, 500))
    expected = found.displacement(x)
    monkeypatch.setattr(pressed, "FEW", 10)
    assert found.displacement(x) == pytest.approx(expected, rel=1e-5)
    # a tolerance of 0 is one: the same sums as at few points
    exact = RigidPunch(GROUNDS["homogeneous"], found.punch.basis, rtol=0).solve(1.0)
    at_many = exact.displacement(x)
    monkeypatch.undo()
    assert np.array_equal(at_many, exact.displacement(x))


@pytest.mark.parametrize(
    ("rtol", "error"), [(-1.0, ValueError), (0.5, ValueError), ("fine", TypeError)]
)
def test_bad_tolerances(rtol, error):
    with pytest.raises(error, match="rtol"):
        RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(1)).basis(), rtol=rtol)


def test_symmetric_plans():
    """Blocks of the symmetry give what the full matrix gives, under any load."""
    basis = DualMesh.from_mesh(disc(4)).basis()
    full = RigidPunch(GROUNDS["homogeneous"], basis)
    half = RigidPunch(GROUNDS["homogeneous"], basis, symmetry="auto")
    assert isinstance(half.operator, SymmetricMatrix)
    for load in ({"force": 1.0, "at": (0.1, 0.05)}, {"force": 1.0, "at": (0.5, 0.1)}):
        expected, found = full.solve(**load), half.solve(**load)
        assert found.pressure == pytest.approx(expected.pressure, rel=1e-9, abs=1e-9)
        assert found.message == expected.message
    assert half.condition_number == pytest.approx(full.condition_number, rel=1e-6)
    given = Symmetry.detect(half.partition, half.collocation_points, half.weights)
    assert RigidPunch(GROUNDS["homogeneous"], basis, symmetry=given).solve(
        1.0
    ).settlement == pytest.approx(full.solve(1.0).settlement)


def test_plans_without_symmetry():
    basis = DualMesh.from_mesh(perturbed(disc(3), 0.02)).basis()
    of = RigidPunch(GROUNDS["homogeneous"], basis, symmetry="auto")
    assert isinstance(of.operator, np.ndarray)
    with pytest.raises(TypeError, match='symmetry "auto" or a Symmetry, got 4'):
        RigidPunch(GROUNDS["homogeneous"], basis, symmetry=4)
    other = DualMesh.from_mesh(disc(2)).basis().partition
    with pytest.raises(ValueError, match="symmetry of the 145 cells, got one of 41"):
        RigidPunch(GROUNDS["homogeneous"], basis, symmetry=Symmetry.detect(other)).solve(1.0)


@pytest.mark.slow
def test_nodes_that_nearly_coincide():
    """Iterations stall there and say why; a matrix does not."""
    x = np.sort([*np.linspace(-1, 1, 70), 0.31234, 0.31234 + 1e-6])
    cells = CellBasis(MeshQuad.init_tensor(x, np.linspace(-1, 1, 60)), ElementQuad0())
    with pytest.warns(ConvergenceWarning, match="cells far smaller than others.*rtol=0"):
        stalled = RigidPunch(HalfSpace(1.0, 0.25), cells).solve(1.0, at=(0.1, 0.05))
    assert not stalled.success
    found = RigidPunch(HalfSpace(1.0, 0.25), cells, rtol=0).solve(1.0, at=(0.1, 0.05))
    assert found.success
    assert found.settlement == pytest.approx(stalled.settlement, rel=1e-4)
