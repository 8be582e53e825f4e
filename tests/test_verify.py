"""Answers that do not obey the equations say so."""

from dataclasses import replace

import numpy as np
import pytest
from plans import disc, rectangle

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    HalfSpace,
    LayeredHalfSpace,
    MeshError,
    Paraboloid,
    RigidPunch,
    RigidPunches,
    Symmetry,
)
from skfem_dual.contact import loaded_cells
from skfem_dual.contact.load import Load
from skfem_dual.contact.methods import find_contact
from skfem_dual.contact.unilateral import How
from skfem_dual.contact.verify import Verification
from skfem_dual.errors import ResolutionWarning
from skfem_dual.grids import generate
from skfem_dual.ground.layered import Layer
from skfem_dual.operators.factors import Factors

SOIL = HalfSpace(1.0, 0.25)


def punch(mesh=None, **options):
    return RigidPunch(
        SOIL, DualMesh.from_mesh(disc(3) if mesh is None else mesh).basis(), **options
    )


@pytest.fixture(scope="module")
def answer():
    """A verification, and the answer it accepts."""
    of = punch()
    constraints = Load(1.0, (0.6, 0.0)).constraints(of.origin - of.centre)
    verify = Verification(of.system, constraints, How(), of.footprint.exact_rows)
    contact, position = find_contact(of.system, constraints, How())
    assert verify(contact, position).success
    return verify, contact, position


@pytest.mark.parametrize("size", [1e-4, 1e-6])
def test_changed_pressures_are_noticed(answer, size):
    verify, contact, position = answer
    at = int(np.argmax(contact.pressure))
    wrong = contact.pressure.copy()
    wrong[at] *= 1 + size
    found = verify(replace(contact, pressure=wrong), position)
    assert not found.success
    # exactly: the change of the force, and of the settlement under the cell
    share = wrong[at] - contact.pressure[at]
    assert f"load is off by {share * verify.system.areas[at]:.1e}" in found.message
    # the settlements elsewhere change less
    assert found.residual == pytest.approx(share * verify.system.matrix[at, at], rel=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda p, s: (p, s + np.array([1e-5, 0.0, 0.0])),
            "apart in contact, or overlap, by 1.0e-05",
        ),
        (lambda p, s: (p - 1e-5 * p.max() * (p == p.max()), s), "the load is off"),
        (lambda p, s: (np.where(p == 0, -1e-6, p), s), "the ground pulls by 1.0e-06"),
        (lambda p, s: (p * np.nan, s), "the load is off"),
        (lambda p, s: (-p, -s), "wrong sign|pulls"),
    ],
)
def test_what_is_wrong_is_told(answer, change, words):
    verify, contact, position = answer
    pressure, moved = change(contact.pressure, position)
    found = verify(replace(contact, pressure=pressure), moved)
    assert not found.success
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(found.message)


def test_rows_of_many_cells_are_not_kept(monkeypatch):
    cells = punch().footprint
    kept = cells.exact_rows
    assert cells.exact_rows is kept
    monkeypatch.setattr(loaded_cells, "LARGE", 10)
    found = cells.exact_rows
    assert found is not kept
    assert cells.exact_rows is not found
    assert np.array_equal(found.numbers, kept.numbers)
    assert np.array_equal(found.rows, kept.rows)


def test_a_wrong_operator_is_noticed_by_exact_rows(answer):
    """The solver's own product says nothing about the matrix it is made with."""
    verify, _, _ = answer
    system = replace(verify.system, matrix=verify.system.matrix * (1 + 1e-3))
    verify = replace(verify, system=system)
    contact, position = find_contact(system, verify.constraints, How())
    found = verify(contact, position)
    assert not found.success
    assert "than the operator says" in found.message
    assert replace(verify, rtol=1e-3)(contact, position).success


@pytest.mark.filterwarnings("ignore:150 cells of a size")
def test_settlements_of_the_wrong_sign_are_no_success():
    """A layer far thinner than the cells: the discrete ground is not stable any more."""
    ground = LayeredHalfSpace([Layer(0.01, 1.0, 0.5)], "bonded")
    of = RigidPunch(ground, DualMesh.from_mesh(generate.disc(n=150)).basis())
    with pytest.warns(ConvergenceWarning, match="settlement has the wrong sign"):
        solution = of.solve(1.0, unilateral=False)
    assert not solution.success
    assert solution.settlement < 0


def test_where_layers_hardly_settle_operators_need_not_be_closer_than_elsewhere():
    """Lifted off a bonded layer: a corner far from the pressures settles by 1e-10 of the largest
    settlement, which the operator's tolerance is about."""
    ground = LayeredHalfSpace([Layer(0.15, 1.0, 0.25)], "bonded")
    basis = DualMesh.from_mesh(generate.rectangle(2.0, 2.0, n=300)).basis()
    exact, fast = (
        RigidPunch(ground, basis, rtol=rtol).solve(1.0, (0.5, 0.3)) for rtol in (0, 1e-6)
    )
    assert fast.success
    assert len(fast.contact) < len(fast.pressure)
    assert fast.settlement == pytest.approx(exact.settlement, rel=1e-5)


def test_tilts_beyond_the_accuracy_of_numbers():
    of = punch()
    for unilateral in (True, False):
        with pytest.warns(ConvergenceWarning, match="equations do not hold"):
            assert not of.solve(1.0, tilt=(1e14, 0), unilateral=unilateral).success


def test_loads_of_any_size_are_verified():
    of = punch()
    for size in (1e-290, 1e-30, 1e30, 1e290):
        solution = of.solve(size, at=(0.1, 0.0))
        assert solution.success
        assert solution.settlement / size == pytest.approx(of.solve(1.0, (0.1, 0.0)).settlement)


def test_foreign_symmetries_are_refused():
    square = punch(rectangle(6))
    x = square.collocation_points
    own = Symmetry.detect(square.partition, x, square.weights)
    assert own.name == "C2v"
    same = punch(rectangle(6), symmetry=own).solve(1.0)
    assert same.settlement == pytest.approx(square.solve(1.0).settlement, rel=1e-12)
    mesh = rectangle(6)
    skewed = type(mesh)(mesh.p + 0.2 * np.vstack([mesh.p[1], 0 * mesh.p[1]]), mesh.t)
    with pytest.raises(MeshError, match="got one in which cells"):
        punch(skewed, symmetry=own).solve(1.0)
    with pytest.raises(MeshError, match="expected a symmetry of the"):
        punch(symmetry=own).solve(1.0)


def test_groups_are_verified():
    pair = RigidPunches(
        [punch(disc(2).translated((x, 0.0)), origin=(x, 0.0)) for x in (-1.5, 1.5)]
    )
    loads = [{"force": 1.0}, {"force": 2.0}]
    assert pair.solve(loads).success
    pair = RigidPunches(pair.punches)
    # factors of another matrix, as of threads that disturb each other
    lu, pivots = pair.system.factors.lu, pair.system.factors.pivots
    pair.system.__dict__["factors"] = Factors(lu * (1 + 1e-3 * np.eye(len(lu))), pivots)
    with pytest.warns(ConvergenceWarning, match="equations do not hold"):
        assert not pair.solve(loads, unilateral=False).success


def test_contact_on_a_few_cells_warns():
    of = punch(gap=Paraboloid(1.0))
    with pytest.warns(ResolutionWarning, match=r"contact on \d of 145 cells, fewer than 12"):
        assert of.solve(1e-4).success
    assert of.solve(1.0).success  # on many


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("moment", [0.0, 0.1 * 3 - 0.3, 1e-12, 1e-9])
def test_moments_that_are_rounding_beside_an_imposed_settlement(moment, unilateral):
    """Pressures are no closer than they are to their own size."""
    of = punch()
    exact = of.solve(settlement=0.1, unilateral=unilateral)
    found = of.solve(settlement=0.1, moments=(moment, 0.0), unilateral=unilateral)
    assert found.success
    assert found.force == pytest.approx(exact.force, rel=1e-7)
