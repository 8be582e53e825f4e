"""Dense and fast summation against exact matrices."""

import importlib
import sys
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from plans import disc, perturbed, rectangle
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementTriP0,
    ElementTriP1,
    ElementVector,
    MeshQuad,
    MeshTri,
)

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
    flexible_settlement,
    transfer,
)
from skfem_dual.contact import loaded_cells
from skfem_dual.elements.edge_correction import EdgeCorrection
from skfem_dual.elements.influence import influence_matrix
from skfem_dual.elements.slopes import Slopes
from skfem_dual.errors import ConvergenceError, MeshError
from skfem_dual.grids import generate
from skfem_dual.grids.generate import disc as even_disc
from skfem_dual.grids.partition import Partition
from skfem_dual.operators import attempts, entries, resources
from skfem_dual.operators.influence_operator import RTOL, InfluenceOperator

GROUNDS = {
    "homogeneous": HalfSpace(2.0, 0.3),
    "graded": GradedHalfSpace.init_linear(2.0, 0.25, 1.5),
    "layered": LayeredHalfSpace([Layer(0.7, 2.0, 0.3)], "bonded"),
}


def steep():
    """Refined again and again towards a point on the edge: cells over a range of 100 : 1."""
    mesh = MeshTri.init_circle(3)
    for k in range(7):
        near = np.hypot(*(mesh.p[:, mesh.t].mean(axis=1) - [[1.0], [0.0]])) < 0.35 * 0.5**k
        mesh = mesh.refined(np.nonzero(near)[0])
    return mesh


BASES = {
    "dual cells": DualMesh.from_mesh(disc(4)).basis(),
    "steep dual cells": DualMesh.from_mesh(steep()).basis(),
    "triangles": CellBasis(perturbed(rectangle(14), 0.01), ElementTriP0()),
}


SHORT = {("layered", "triangles")}
PAIRS = [
    pytest.param(
        *pair,
        marks=[] if "homogeneous" in pair or pair in SHORT else [pytest.mark.slow],
    )
    for pair in product(GROUNDS, BASES)
]
ONE_BY_ONE = [
    pytest.param(ground, marks=[] if ground == "homogeneous" else [pytest.mark.slow])
    for ground in GROUNDS
]


@pytest.mark.parametrize(("ground", "name"), PAIRS)
def test_both_methods_meet_the_exact_matrix(name, ground):
    ground, basis = GROUNDS[ground], BASES[name]
    exact = RigidPunch(ground, basis).matrix
    total, norm = np.abs(exact).sum(axis=1), np.linalg.norm(exact, axis=1)
    rng = np.random.default_rng(0)
    n = len(exact)
    signs = rng.choice([-1.0, 1.0], (n, 4))
    q = np.hstack([np.ones((n, 1)), rng.random((n, 2))])
    for method, rtol in (("fast", 1e-4), ("fast", 1e-6), ("dense", 1e-4), ("dense", 1e-6)):
        operator = InfluenceOperator(ground, basis, rtol, method)
        assert operator.method == method
        assert operator.error <= rtol
        assert operator.row_error <= 10 * rtol
        # on all rows: some are worse than those that were looked at
        assert np.abs((operator @ q - exact @ q) / total[:, None]).max() < 10 * rtol
        assert np.abs((operator.roughly(q) - operator @ q) / total[:, None]).max() < 1e-6
        if method == "fast":  # by the first terms of all expansions
            short = operator.summation.coarse
            found = operator._entries.summed(short, q, operator.slopes.of_rows)
            assert np.abs((found - exact @ q) / total[:, None]).max() < 2e-2
            assert (
                np.abs(operator.coarsely(q[:, :1]) - exact @ q[:, :1]).max() < 2e-2 * total.max()
            )
        rows = np.sum((operator @ signs - exact @ signs) ** 2, axis=1) / 4 / norm**2
        assert np.sqrt(rows.mean()) < 20 * rtol
    operator = InfluenceOperator(ground, basis, 0.0, "dense")
    assert np.abs(operator.to_dense() - exact).max() < 1e-13 * exact.max()


@pytest.mark.parametrize("ground", ONE_BY_ONE)
@pytest.mark.parametrize("method", ["dense", "fast"])
def test_rows_and_diagonal_are_exact(ground, method):
    ground, basis = GROUNDS[ground], BASES["dual cells"]
    exact = RigidPunch(ground, basis).matrix
    operator = InfluenceOperator(ground, basis, 1e-4, method)
    some = [3, 200, 544]
    assert operator.rows(some) == pytest.approx(exact[some], rel=1e-10, abs=1e-15)
    assert operator.diagonal() == pytest.approx(exact.diagonal(), rel=1e-12)
    assert np.abs(operator.to_dense() - exact).sum(axis=1).max() < 1e-3 * exact.sum(axis=1).min()


@pytest.mark.parametrize("away", [4.0, 30.0])
@pytest.mark.parametrize("ground", ["homogeneous", "layered"])
def test_points_all_beside_the_plan(ground, away):
    """With no cell near any of them there is no remainder near either: it was an error."""
    basis = DualMesh.from_mesh(disc(5)).basis()
    cells = basis.partition
    x = np.random.default_rng(0).random((2, 2000)) + np.array([[away], [0.0]])
    exact, fast = (
        InfluenceOperator.from_partition(GROUNDS[ground], cells, x, None, rtol, method)
        for rtol, method in ((0.0, "dense"), (1e-6, "fast"))
    )
    loads = np.ones(len(cells))
    settled = np.abs(InfluenceOperator(GROUNDS[ground], basis) @ loads).max()
    assert fast @ loads == pytest.approx(exact @ loads, abs=2e-6 * settled)


@pytest.mark.parametrize("seed", [5, 7])
def test_long_and_thin_cells(seed):
    """One row in six was off ten times as far as those that were looked at."""
    x = np.sort(np.append([0.0, 1.0], np.random.default_rng(seed).random(30)))
    basis = CellBasis(MeshQuad.init_tensor(x, np.linspace(0, 1, 40) ** 2), ElementQuad0())
    operator = InfluenceOperator(GROUNDS["homogeneous"], basis, 1e-6, "fast")
    exact = operator.rows(np.arange(basis.N)).sum(axis=1)
    assert operator @ np.ones(basis.N) == pytest.approx(exact, rel=2e-6)


def test_paper_scheme_with_nodes():
    basis = BASES["dual cells"]
    exact = RigidPunch(GROUNDS["homogeneous"], basis, edge="constant", collocation="node").matrix
    for method in ("dense", "fast"):
        operator = InfluenceOperator(
            GROUNDS["homogeneous"], basis, 1e-6, method, edge="constant", collocation="node"
        )
        q = np.ones(len(exact))
        assert operator @ q == pytest.approx(exact @ q, rel=5e-6)


@pytest.mark.parametrize("ground", ONE_BY_ONE)
def test_other_points(ground):
    """Inside, on the edge, near by and far off; a single one as well."""
    ground = GROUNDS[ground]
    basis = BASES["steep dual cells"]
    punch = RigidPunch(ground, basis)
    rng = np.random.default_rng(1)
    x = np.hstack([rng.uniform(-1.5, 1.5, (2, 300)), [[30.0, 1.0], [5.0, 0.0]]])
    exact = influence_matrix(ground, punch.partition, x, punch.weights)
    c = ground.singular_coefficient
    EdgeCorrection.from_weights(punch.weights, c, x).add_to(exact)
    alone = influence_matrix(ground.surface, punch.partition, x)
    q = rng.random(len(punch.partition))
    arguments = ground, punch.partition, x, punch.weights, 1e-6
    for method in ("fast", "dense"):
        operator = InfluenceOperator.from_partition(*arguments, method)
        assert operator.shape == exact.shape
        # beyond rigid bottoms next to nothing settles
        scale = np.maximum(np.abs(exact) @ q, 0.01 * alone @ q)
        assert np.abs((operator @ q - exact @ q) / scale).max() < 1e-5
    again = operator.at(x[:, :1])
    assert abs((again @ q)[0] - exact[0] @ q) < 1e-5 * scale[0]
    with pytest.raises(ValueError, match="square"):
        again.diagonal()


@pytest.mark.parametrize("method", ["dense", "fast"])
def test_same_bits_every_time(method, monkeypatch):
    import numba

    basis = BASES["steep dual cells"]
    q = np.random.default_rng(0).standard_normal(len(basis.partition))
    found = []
    for threads in (1, 2):
        monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", threads)
        operator = InfluenceOperator(GROUNDS["graded"], basis, 1e-5, method)
        found += [operator @ q, operator @ q]
    assert all(np.array_equal(found[0], other) for other in found)


@pytest.mark.parametrize("method", ["dense", "fast"])
@pytest.mark.parametrize("ground", ["homogeneous", "layered"])
def test_threads_share_an_operator(ground, method):
    operator = InfluenceOperator(GROUNDS[ground], BASES["steep dual cells"], 1e-4, method)
    columns = np.random.default_rng(0).standard_normal((20, operator.shape[1]))
    expected = [operator @ column for column in columns]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(3):
            assert np.array_equal(list(pool.map(operator.dot, columns)), expected)


def test_weights_and_points_as_they_are():
    """What the class makes of a basis can be given ready-made."""
    soil, basis = GROUNDS["homogeneous"], BASES["dual cells"]
    partition = Partition.from_basis(basis)
    law = RigidPunch(soil, basis).footprint.slopes
    x = np.random.default_rng(0).uniform(-1, 1, (2, 30))
    of_basis = InfluenceOperator(soil, basis, collocation=x)
    of_cells = InfluenceOperator.from_partition(soil, partition, x, law)
    assert of_basis.rtol == of_cells.rtol == RTOL
    exact = RigidPunch(soil, basis).influence(x)
    for operator in (of_basis, of_cells):
        assert (
            np.abs(operator.to_dense() - exact).sum(axis=1).max() < 1e-5 * exact.sum(axis=1).min()
        )
    uniform = InfluenceOperator.from_partition(soil, partition, x)
    assert uniform.weights is None
    again = InfluenceOperator(soil, basis, edge="constant", collocation=x)
    assert np.array_equal(uniform.to_dense(), again.to_dense())


def test_products_are_linear_and_take_columns():
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES["triangles"], 1e-5, "fast")
    rng = np.random.default_rng(0)
    q = rng.standard_normal((operator.shape[1], 3))
    together = operator @ q
    assert together[:, 1] == pytest.approx(operator @ q[:, 1], abs=1e-13)
    assert operator @ (2 * q[:, 0] - q[:, 2]) == pytest.approx(
        2 * together[:, 0] - together[:, 2], abs=1e-10
    )
    assert operator @ np.ones(operator.shape[1], int) == pytest.approx(
        operator @ np.ones(operator.shape[1])
    )
    with pytest.raises(NotImplementedError):
        operator.rmatvec(q[:, 0])
    dense = InfluenceOperator(GROUNDS["homogeneous"], BASES["triangles"], 1e-5, "dense")
    assert dense.rmatvec(q[:, 0]) == pytest.approx(dense.to_dense().T @ q[:, 0])


@pytest.mark.parametrize(
    ("pressure", "kind", "message"),
    [
        (np.ones(7), ValueError, r"pressure of shape \(25,\) or \(25, k\).*, got \(7,\)"),
        (np.ones((7, 2)), ValueError, r"got \(7, 2\)"),
        (np.ones((25, 1, 1)), ValueError, r"got \(25, 1, 1\)"),
        (2.0, ValueError, r"got \(\)"),
        (None, TypeError, "pressure as an array of numbers, got None"),
        ([[1.0, 2.0], [3.0]], TypeError, "array of numbers, got .*, of unequal parts"),
        (np.full(25, np.nan), ValueError, "finite pressure, got nan at index 0"),
        (np.full(25, complex(0.0, np.inf)), ValueError, "finite pressure, got inf at index 0"),
    ],
)
def test_pressures_that_are_none(pressure, kind, message):
    operator = InfluenceOperator(GROUNDS["homogeneous"], DualMesh.from_mesh(rectangle(4)).basis())
    with pytest.raises(kind, match=message):
        operator @ pressure
    if not np.isscalar(pressure):
        with pytest.raises(kind, match=message):
            operator.dot(pressure)


def test_products_with_operators_and_numbers():
    operator = InfluenceOperator(GROUNDS["homogeneous"], DualMesh.from_mesh(rectangle(4)).basis())
    q = np.linspace(0.0, 1.0, 25)
    assert (operator @ operator) @ q == pytest.approx(operator @ (operator @ q))
    assert (2.0 * operator) @ q == pytest.approx(2.0 * (operator @ q))
    assert operator.dot(2.0) @ q == pytest.approx(2.0 * (operator @ q))
    assert operator @ list(q) == pytest.approx(operator.to_dense() @ q)
    assert operator @ (1j * q) == pytest.approx(1j * (operator @ q))
    assert (operator @ q[:, None]).shape == (25, 1)


MESH = perturbed(rectangle(12), 0.03)


@pytest.mark.parametrize("method", ["dense", "fast"])
def test_numbers_of_any_kind(method):
    """Bytes in the other order, single precision, whole and complex numbers are what they say."""
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES["triangles"], 1e-5, method)
    q = np.arange(1.0, operator.shape[1] + 1)
    expected = operator @ q
    for kind in (">f8", "f4", "i8", "longdouble"):
        assert operator @ q.astype(kind) == pytest.approx(expected, rel=1e-13)
    assert operator @ (2j * q) == pytest.approx(2j * expected, rel=1e-13)


@settings(max_examples=4)
@given(st.floats(-1e4, 1e4), st.floats(1e-6, 1e6), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_moved_scaled_turned_and_renumbered(shift, factor, quarters, seed):
    rng = np.random.default_rng(seed)
    turn = np.round(np.linalg.matrix_power([[0.0, -1.0], [1.0, 0.0]], quarters))
    number = rng.permutation(MESH.p.shape[1])
    p = (factor * (turn @ MESH.p + shift))[:, np.argsort(number)]
    other = MeshTri(np.ascontiguousarray(p), number[MESH.t])
    q = rng.random(MESH.p.shape[1])
    soil = GROUNDS["homogeneous"]
    first, second = (
        InfluenceOperator(soil, DualMesh.from_mesh(m).basis(), 1e-6, "fast") for m in (MESH, other)
    )
    moved = np.empty_like(q)
    moved[number] = q
    assert (second @ moved)[number] == pytest.approx(factor * (first @ q), rel=5e-6)


def test_choice():
    soil = GROUNDS["homogeneous"]
    small = InfluenceOperator(soil, DualMesh.from_mesh(disc(2)).basis())
    large = InfluenceOperator(soil, DualMesh.from_mesh(disc(6)).basis(), 1e-4)
    assert (small.method, large.method) == ("dense", "fast")
    assert "dense summation from 41 cells" in repr(small)
    assert "fast summation" in repr(large)
    assert large.estimate.memory / 4 < large.memory < large.estimate.memory


@pytest.mark.parametrize("name", ["steep dual cells", "triangles"])
def test_other_points_take_what_is_known_of_the_cells(name):
    """Points anywhere in the plan, in boxes that held none, beyond it: as exact as others are."""
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES[name], 1e-6, "fast")
    p = operator.partition.polygons.p
    rng = np.random.default_rng(0)
    for x in (p, p.mean(axis=1, keepdims=True) + 3 * rng.uniform(-1, 1, (2, 50))):
        other = operator.at(x)
        assert other.method == "dense" or other.summation is not None
        other = InfluenceOperator(
            operator.substrate, operator.partition, 1e-6, "fast", edge=operator.slopes,
            collocation=x, like=operator,
        )  # fmt: skip
        q = rng.random(len(operator.partition))
        exact = other.rows(np.arange(0, x.shape[1], 7)) @ q
        assert (other @ q)[::7] == pytest.approx(exact, rel=3e-6)
        # beyond the root there are no boxes
        shared = other.summation.far_fields[0].p2m is operator.summation.far_fields[0].p2m
        assert shared == (x is p)
    strange = InfluenceOperator(HalfSpace(1.0, 0.0), BASES[name], 1e-4, "fast")
    with pytest.raises(ValueError, match=r"another ground.*Remedy: operator\.at"):
        InfluenceOperator(
            operator.substrate, operator.partition, edge=operator.slopes, like=strange
        )


def test_vectors_in_blocks(monkeypatch):
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES["dual cells"], 1e-6, "fast")
    q = np.random.default_rng(0).random((len(operator.partition), 7))
    together = operator @ q
    assert together[:, 4] == pytest.approx(operator @ q[:, 4], rel=1e-13)
    monkeypatch.setattr(attempts, "MANY", 100)
    assert operator @ q == pytest.approx(together, rel=1e-13)


@pytest.mark.parametrize(
    ("unit", "largest"),
    [(1.0, 1.0), (1.0, 1e45), *slow((1e-14, 1e14), (1e12, 1e-12), (1.0, 1e-50))],
)
def test_single_precision_in_any_units(unit, largest):
    """Near a cell cubes of distances are beyond it in metres, where these are nanometres; so are
    pressures of 1e45, and those of 1e-50."""
    basis = DualMesh.from_mesh(disc(5).scaled(unit)).basis()
    operator = InfluenceOperator(GROUNDS["homogeneous"], basis, 1e-6, "fast")
    q = np.random.default_rng(0).random((operator.shape[1], 4)) * largest
    settled = operator @ q
    assert operator.roughly(q) == pytest.approx(settled, rel=2e-6, abs=0)
    q[:, 1] = 0.0
    assert not operator.roughly(q)[:, 1].any()


def test_the_whole_way_is_refused_where_its_memory_is_missing(monkeypatch):
    punch = RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(6)).basis(), rtol=1e-6)
    n = len(punch.partition)
    needed = resources.whole(n, 1e-6, False) - resources.BEFORE * n
    monkeypatch.setattr(resources, "available_memory", lambda: 0.5 * needed)
    with pytest.raises(MemoryError, match=rf"{n} cells take.*at most {n // 2} cells"):
        punch.solve(1.0)


def test_exact_entries_of_many_cells(monkeypatch):
    """The matrix itself solves the equations of more cells than are dense by default, or tells
    its 8 bytes an entry."""
    basis = BASES["dual cells"]
    few = RigidPunch(GROUNDS["homogeneous"], basis)
    settlement = few.solve(1.0).settlement
    monkeypatch.setattr(loaded_cells, "DENSE", 100)
    many = RigidPunch(GROUNDS["homogeneous"], basis, rtol=0)
    assert many.operator.method == "dense"
    assert many.solve(1.0).settlement == pytest.approx(settlement, rel=1e-10)
    monkeypatch.setattr(resources, "available_memory", lambda: 7.0 * basis.N**2)
    with pytest.raises(MemoryError, match="dense summation with rtol=0"):
        _ = RigidPunch(GROUNDS["homogeneous"], basis, rtol=0).operator


@pytest.mark.parametrize("n", [6, *slow(8)])
def test_memory_of_the_whole_way(n):
    mesh = disc(n)
    RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(disc(6)).basis(), rtol=1e-6).solve(1.0)
    tracemalloc.start()
    try:
        punch = RigidPunch(GROUNDS["homogeneous"], DualMesh.from_mesh(mesh).basis(), rtol=1e-6)
        assert punch.solve(1.0).settlement > 0
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    expected = resources.whole(len(punch.partition), 1e-6, False)
    assert expected / 1.5 < most < 1.5 * expected


def test_memory_is_refused_before_it_is_taken(monkeypatch):
    basis = BASES["dual cells"]
    soil = GROUNDS["homogeneous"]
    monkeypatch.setattr(resources, "available_memory", lambda: 2.0 * 2**20)
    monkeypatch.setattr(attempts, "moment_matrix", None)
    monkeypatch.setattr(entries, "influence_matrix", None)
    with pytest.raises(MemoryError, match=r"at most 2 MiB.*dense.*2\.266 MiB. Remedy: method"):
        InfluenceOperator(soil, basis, method="dense")
    monkeypatch.setattr(resources, "available_memory", lambda: 1000.0)
    with pytest.raises(
        MemoryError, match=r"fast summation with rtol=1e-06 from 545 cells.*a coarser mesh"
    ):
        InfluenceOperator(soil, basis)


@pytest.mark.parametrize("rtol", [0.0, 1e-12, 0.99e-8])
def test_exact_entries_are_a_matrix_or_refused(rtol, monkeypatch):
    """No fast summation reaches such tolerances: none may stand in where the memory is short."""
    basis = BASES["dual cells"]
    monkeypatch.setattr(resources, "available_memory", lambda: 2.0 * 2**20)
    with pytest.raises(MemoryError, match=rf"dense summation with rtol={rtol:g}.*1e-08 or more"):
        InfluenceOperator(GROUNDS["homogeneous"], basis, rtol)
    monkeypatch.undo()
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES["dual cells"], rtol)
    assert operator.method == "dense"
    exact = RigidPunch(GROUNDS["homogeneous"], BASES["dual cells"]).matrix
    assert np.abs(operator.to_dense() - exact).max() < 1e-13 * exact.max()


def test_auto_takes_what_fits(monkeypatch):
    basis = BASES["dual cells"]
    monkeypatch.setattr(resources, "available_memory", lambda: 2.0 * 2**20)
    operator = InfluenceOperator(GROUNDS["homogeneous"], basis, 1e-4)
    assert operator.method == "fast"


def test_expansions_that_are_known_take_no_memory_again(monkeypatch):
    """The position by work under ten million cells was refused what the operator already had."""
    cells = Partition.from_basis(BASES["dual cells"])
    common = {"method": "fast", "edge": "constant"}
    operator = InfluenceOperator(GROUNDS["homogeneous"], cells, **common)
    few = operator.x[:, :50]
    anew = InfluenceOperator(GROUNDS["homogeneous"], cells, collocation=few, **common)
    monkeypatch.setattr(resources, "available_memory", lambda: 0.9 * anew.estimate.memory)
    with pytest.raises(MemoryError, match="from 545 cells to 50 points"):
        InfluenceOperator(GROUNDS["homogeneous"], cells, collocation=few, **common)
    known = InfluenceOperator(
        GROUNDS["homogeneous"], cells, collocation=few, like=operator, **common
    )
    q = np.ones(545)
    np.testing.assert_allclose(known @ q, (operator @ q)[:50], rtol=2e-6)


def test_memory_at_hand():
    assert resources.available_memory() > 2**20


def test_points_are_its_own():
    x = np.array([[0.1, 2.0], [0.2, 0.0]])
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES["dual cells"], collocation=x)
    before = operator.rows([0, 1])
    x += 1.0
    assert np.array_equal(operator.at(operator.x).rows([0, 1]), before)


def test_rows_by_their_numbers():
    operator = InfluenceOperator(GROUNDS["homogeneous"], BASES["dual cells"])
    assert np.array_equal(operator.rows(3), operator.rows([3]))
    with pytest.raises(TypeError, match="i as an array of integers"):
        operator.rows([[1], [2, 3]])


WEIGHTS = RigidPunch(GROUNDS["homogeneous"], BASES["triangles"]).weights


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"rtol": -1.0}, ValueError, "rtol from 0 to 0.01, got -1"),
        ({"rtol": np.nan}, ValueError, "finite rtol, got nan"),
        ({"rtol": 1e-9, "method": "fast"}, ValueError, 'method="dense"'),
        ({"rtol": "1e-6"}, TypeError, "a number for rtol, got '1e-6'"),
        ({"rtol": None}, TypeError, "a number for rtol, got None"),
        ({"method": "slow"}, ValueError, "'slow'"),
        ({"edge": "round"}, ValueError, "'round'"),
        ({"edge": None}, ValueError, "EdgeWeights, got None"),
        ({"collocation": "corner"}, ValueError, "'corner'"),
        ({"collocation": [0.0, 1.0]}, ValueError, r"shape \(2, m\)"),
        ({"basis": Partition.from_basis(BASES["dual cells"])}, ValueError, "with a partition"),
        ({"edge": WEIGHTS}, ValueError, "weights of 545 cells for edge, got 392"),
        ({"substrate": HalfSpace}, TypeError, "a substrate such as HalfSpace"),
    ],
)
def test_bad_input(change, error, message):
    arguments = {"substrate": GROUNDS["homogeneous"], "basis": BASES["dual cells"]} | change
    with pytest.raises(error, match=message):
        InfluenceOperator(**arguments)


def test_bad_points():
    partition = Partition.from_basis(BASES["dual cells"])
    with pytest.raises(ValueError, match=r"shape \(2, m\)"):
        InfluenceOperator.from_partition(GROUNDS["homogeneous"], partition, np.zeros(2))
    operator = InfluenceOperator(GROUNDS["homogeneous"], partition, edge="constant")
    with pytest.raises(ValueError, match="expected at least one point to settle"):
        operator.at(np.empty((2, 0)))
    with pytest.raises(ValueError, match=r"q of shape .*, got \(\)"):
        operator.roughly(1.0)


@pytest.mark.parametrize("name", ["dual cells", *slow("steep dual cells")])
def test_the_smallest_tolerance(name):
    """Moments of cells up to a fixed degree reach 5e-8, however long the expansions are."""
    ground, basis = GROUNDS["homogeneous"], BASES[name]
    exact = RigidPunch(ground, basis).matrix
    operator = InfluenceOperator(ground, basis, 1e-8, "fast")
    q = np.ones(len(exact))
    assert np.abs(operator @ q - exact @ q).max() < 2e-8 * np.abs(exact).sum(axis=1).min()


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8])
def test_the_tolerance_holds_under_pressures_of_any_sign(rtol):
    """Of a strip with few cells, where uniform ones hide what boxes leave: 5 times, once."""
    cells = DualMesh.from_mesh(generate.rectangle(8.0, 1.0, n=300)).basis()
    ground = HalfSpace(1.0, 0.3)
    exact = InfluenceOperator(ground, cells, rtol=0).to_dense()
    operator = InfluenceOperator(ground, cells, rtol=rtol, method="fast")
    q = np.random.default_rng(3).choice([-1.0, 1.0], (len(exact), 4))
    off = np.abs(operator @ q - exact @ q) / exact.sum(axis=1)[:, None]
    assert off.max() < 2 * rtol
    assert np.mean(off > rtol) < 0.02


def test_a_tolerance_out_of_reach(monkeypatch):
    monkeypatch.setattr("skfem_dual.operators.fmm.summation.order_for", lambda rtol: 4)
    with pytest.raises(
        ConvergenceError, match=r'rtol=1e-06, the fast.*: rtol=.*, or method="dense"'
    ):
        InfluenceOperator(GROUNDS["homogeneous"], BASES["dual cells"], 1e-6, "fast")


def test_benchmark(monkeypatch, capsys):
    folder = Path(__file__).parents[1] / "benchmarks"
    monkeypatch.syspath_prepend(folder)
    monkeypatch.delitem(sys.modules, "plans", raising=False)
    fast_operator = importlib.import_module("fast_operator")
    found = fast_operator.main(sizes=(500,))
    assert all(row.error < 1e-6 for row in found.values())
    for _, lifted in fast_operator.punches(sizes=(500,)).values():
        assert lifted.settlement == pytest.approx(0.4821, rel=1e-3)
    assert "graded" in capsys.readouterr().out
    for name in ("fast_operator", "plans"):
        sys.modules.pop(name, None)


def test_elements_of_other_bases_are_cells():
    """What a solution exports can be the load of an operator."""
    soil = GROUNDS["homogeneous"]
    solution = RigidPunch(soil, DualMesh.from_mesh(disc(2)).basis()).solve(1.0)
    basis, vector = solution.pressure_field(refine=0)
    operator = InfluenceOperator(soil, basis, edge="constant", method="dense")
    means = transfer(basis, vector, CellBasis(basis.mesh, ElementTriP0()))
    expected = flexible_settlement(soil, basis, vector)
    assert operator @ means == pytest.approx(expected, rel=1e-9)
    with pytest.raises(TypeError, match=r"piecewise constants .* ElementVector"):
        InfluenceOperator(soil, CellBasis(basis.mesh, ElementVector(ElementTriP1())))


def test_the_common_refinement_is_not_made_for_products():
    """It has six triangles in each, and takes longer than all else."""
    dual = DualMesh.from_mesh(disc(2))
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), dual.basis())
    assert (operator @ np.ones(len(dual)) > 0).all()
    assert "refinement" not in vars(dual)


@pytest.mark.parametrize("method", ["dense", "fast"])
def test_products_of_nothing(method):
    dual = DualMesh.from_mesh(disc(3))
    soil = GROUNDS["layered"] if method == "dense" else HalfSpace(1.0, 0.0)
    operator = InfluenceOperator(soil, dual.basis(), method=method)
    assert (operator @ np.zeros((len(dual), 0))).shape == (len(dual), 0)


@pytest.mark.parametrize("rtol", [1e-6, 1e-7])
def test_points_beside_centroids(rtol):
    """Where a dipole in the middle of a cell would do far more than its slope does."""
    mesh = even_disc(n=900)
    basis = DualMesh.from_mesh(mesh).basis()
    operator = InfluenceOperator(HalfSpace(1.0, 0.3), basis, rtol, "fast")
    nodes = InfluenceOperator(HalfSpace(1.0, 0.3), basis, rtol, "fast", collocation="node")
    centroids, areas = operator.partition.centroids, operator.partition.areas
    turn = np.linspace(0.0, 30.0, len(areas))
    away = np.sqrt(areas / np.pi) * np.geomspace(1e-7, 0.3, len(areas))
    near = operator.at(centroids + away * np.array([np.cos(turn), np.sin(turn)]))
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(areas))
    for own in (nodes, near):
        exact = own.rows(np.arange(len(areas)))
        for q in (1 + centroids[0], signs):
            off = np.abs(own @ q - exact @ q) / exact.sum(axis=1)
            assert off.max() < 3 * rtol


def test_sizes_that_are_no_numbers_are_refused():
    mesh = MeshTri.init_circle(2)
    for size in (1e-30, 1e40):
        basis = DualMesh.from_mesh(mesh.scaled(size)).basis()
        with pytest.raises(MeshError, match="expected cells of sizes from 1e-20 to"):
            InfluenceOperator(HalfSpace(1.0, 0.3), basis, rtol=0.0)


@pytest.mark.parametrize(("thickness", "young"), [(0.001, 20.0), (0.001, 0.05), (0.004, 20.0)])
def test_on_thin_skins_as_under_a_punch(thickness, young):
    """Cells far larger than a layer see another part c / r of the ground."""
    ground = LayeredHalfSpace([Layer(thickness, young, 0.3)], HalfSpace(1.0, 0.3))
    basis = DualMesh.from_mesh(MeshTri.init_circle(3)).basis()
    operator = InfluenceOperator(ground, basis, rtol=0.0)
    matrix = RigidPunch(ground, basis).matrix
    np.testing.assert_allclose(operator.to_dense(), matrix, atol=1e-9 * matrix.max())
    x = np.array([[0.1, 0.7], [0.2, -0.3]])
    np.testing.assert_allclose(
        operator.at(x).to_dense(), RigidPunch(ground, basis).influence(x), atol=1e-9 * matrix.max()
    )


@pytest.mark.parametrize(("method", "rtol"), [("dense", 0.0), ("dense", 1e-6), ("fast", 1e-6)])
def test_slopes_without_a_law_of_the_edge(method, rtol):
    """Against quadrature over the triangles, in points beside the plan."""
    basis = CellBasis(MeshTri.init_circle(2), ElementTriP0(), intorder=15)
    partition = Partition.from_basis(basis)
    slopes, x = Slopes.from_partition(partition), np.array([[1.3, 0.2], [0.0, 1.5]]).T
    q = 1 + partition.centroids[0]
    operator = InfluenceOperator(
        HalfSpace(1.0, 0.0), partition, rtol, method, edge=slopes, collocation=x
    )
    points = np.asarray(basis.global_coordinates())
    arm = points - partition.centroids[:, :, None]
    pressure = q[:, None] + np.einsum("in,ink->nk", slopes.of(q), arm)
    far = np.hypot(*(points[..., None] - x[:, None, None]))
    exact = np.einsum("nk,nkm->m", pressure * basis.dx, 1 / far) / np.pi
    assert operator @ q == pytest.approx(exact, rel=1e-4)
    constant = InfluenceOperator.from_partition(HalfSpace(1.0, 0.0), partition, x)
    assert abs(constant @ q - exact).max() > 3e-3


@pytest.mark.parametrize("aspect", [10, 1000])
def test_coarse_matrices_of_long_cells(aspect):
    """The series of a cell does not converge just behind its ends, whatever the tolerance."""
    row = MeshQuad.init_tensor(np.linspace(0, 20, 21), np.linspace(0, 1 / aspect, 2))
    x = np.random.default_rng(1).random((2, 3000)) * [[20.0], [1 / aspect]]
    cells = CellBasis(row, ElementQuad0())
    options = {"edge": "constant", "collocation": x}
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), cells, 1e-2, "dense", **options)
    exact = operator.rows(np.arange(3000)).sum(axis=1)
    assert np.abs(operator @ np.ones(20) / exact - 1).max() < 2e-2
