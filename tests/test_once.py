"""Attributes that are computed once, whatever threads ask for them."""

import copy
import pickle
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from threading import Barrier

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from skfem import CellBasis, ElementTriP1, FacetBasis, MeshTri
from skfem.generic_utils import OrientedBoundary

import skfem_dual
from skfem_dual.kernels.once import ReadOnly, _locks, computed_in, computed_once, remember


@dataclass(frozen=True)
class Plan:
    """Properties that count how often they are computed."""

    size: float
    counts: list

    @computed_once
    def area(self):
        self.counts.append("area")
        time.sleep(0.01)
        return self.half + self.half

    @computed_once
    def half(self):
        self.counts.append("half")
        time.sleep(0.01)
        return object() if self.size < 0 else self.size**2 / 2

    @computed_once
    def twice(self):
        time.sleep(0.01)
        return 2 * self.area


class Special(Plan):
    @computed_once
    def half(self):
        return 1.0


def at_once(n, work):
    """Answers of n threads that begin together."""
    gate = Barrier(n)

    def begin(i):
        gate.wait(timeout=10)
        return work(i)

    with ThreadPoolExecutor(n) as pool:
        return list(pool.map(begin, range(n)))


def test_computed_once_by_many_threads():
    plan = Plan(2.0, [])
    found = at_once(8, lambda i: (plan.area, plan.half, plan.twice)[i % 3])
    assert found == [(4.0, 2.0, 8.0)[i % 3] for i in range(8)]
    assert sorted(plan.counts) == ["area", "half"]
    assert not _locks


def test_pickles_while_others_compute():
    """What they add to an object is not missed while it is gone through."""

    plan = Plan(2.0, [])
    state = plan.__getstate__()
    assert plan.half == 2.0
    assert set(state) == {"size", "counts"}
    assert plan.__getstate__() == state | {"half": 2.0}


def test_threads_wait_for_the_same_property_of_the_same_object_only():
    """While one thread computes, others take what they need from other objects."""
    first, second = Plan(1.0, []), Plan(2.0, [])
    gate = Barrier(2)

    class Met(Plan):
        @computed_once
        def half(self):
            gate.wait(timeout=10)  # both are inside, or this fails
            return 0.5

    first, second = Met(1.0, []), Met(2.0, [])
    assert at_once(2, lambda i: (first, second)[i].area) == [1.0, 1.0]


def test_pools_inside_a_property_may_use_others_of_the_object():
    class Pooled(Plan):
        @computed_once
        def area(self):
            with ThreadPoolExecutor(2) as pool:
                return sum(pool.map(lambda _: self.half, range(2)))

    assert Pooled(2.0, []).area == 4.0


def test_frozen_pickled_and_inherited():
    plan = Special(3.0, [])
    assert plan.area == 2.0
    again = pickle.loads(pickle.dumps(plan))
    assert again.__dict__["area"] == 2.0
    assert again == plan
    assert isinstance(Plan.area, cached_property)


def test_arrays_are_read_only():
    given = np.zeros(3)

    class Shared:
        @computed_once
        def value(self):
            return given

    with pytest.raises(ValueError, match="read-only"):
        Shared().value[0] = 1.0
    given[0] = 2.0  # whoever made it may still write


def test_an_error_is_nothing_computed():
    class Failing:
        calls = 0

        @computed_once
        def value(self):
            type(self).calls += 1
            if self.calls < 3:
                raise ValueError("not yet")
            return self.calls

    failing = Failing()
    for _ in range(2):
        with pytest.raises(ValueError, match="not yet"):
            failing.value  # noqa: B018
    assert failing.value == failing.value == 3
    assert not _locks


def test_after_an_error_one_of_those_that_wait_tries_again():
    """Who comes in between waits, too."""
    inside, most, calls = [], [], []

    class Failing:
        @computed_once
        def value(self):
            inside.append(1)
            calls.append(1)
            most.append(len(inside))
            time.sleep(0.02)
            inside.pop()
            if len(calls) == 1:
                raise ValueError("not yet")
            return len(calls)

    failing = Failing()

    def ask(i):
        time.sleep(0.005 * i)
        try:
            return failing.value
        except ValueError:
            return failing.value

    assert at_once(9, ask) == [2] * 9
    assert max(most) == 1
    assert not _locks


def test_dictionaries_that_threads_share():
    known, calls = {}, []

    def compute():
        calls.append(1)
        time.sleep(0.01)
        return object()

    assert len(set(at_once(4, lambda _: computed_in(known, "a", compute)))) == len(calls) == 1
    assert list(known) == ["a"]
    assert not _locks


def test_what_others_have_computed():
    """It is kept where nothing is known yet, under names of what is computed once."""
    plan, counts = Plan(2.0, []), []
    remember(plan, "area", 9.0)
    remember(plan, "area", 8.0)
    assert plan.area == 9.0
    assert plan.counts == counts
    with pytest.raises(TypeError, match="what is computed once, got 'size'"):
        remember(plan, "size", 1.0)


@dataclass(frozen=True, eq=False)
class Heights(ReadOnly):
    """Arrays as they are kept by fields."""

    values: np.ndarray
    parts: tuple
    names: dict
    nothing: None = None


COPIES = [
    *(lambda x, p=p: pickle.loads(pickle.dumps(x, p)) for p in range(pickle.HIGHEST_PROTOCOL + 1)),
    copy.deepcopy,
]


@pytest.mark.parametrize("copied", COPIES)
def test_arrays_of_copies_are_read_only(copied):
    values = np.arange(3.0)
    again = copied(Heights(values, (values + 1, [values + 2]), {"a": values + 3}))
    arrays = again.values, again.parts[0], again.parts[1][0], again.names["a"]
    for i, array in enumerate(arrays):
        assert np.array_equal(array, values + i)
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0
    assert values.flags.writeable


def test_shallow_copies_share_arrays():
    """Which are those of a user, who may change them."""
    values = np.arange(3.0)
    again = copy.copy(Heights(values, (), {}))
    assert again.values is values
    assert values.flags.writeable


def test_corners_of_plans_are_read_only_in_copies():
    plan = skfem_dual.Plan.from_polygon([(0, 0), (2, 0), (2, 1)])
    for copied in COPIES:
        corners = copied(plan).parts[0][0].corners
        with pytest.raises(ValueError, match="read-only"):
            corners[:] = 0


def test_meshes_are_read_only():
    """Those of a grid, with their tags, and in copies; that of the user is not."""
    mesh = MeshTri().refined(2).with_boundaries({"left": lambda x: x[0] == 0})
    mesh = mesh.with_boundaries({"turned": OrientedBoundary([3], [0])})
    dual = skfem_dual.DualMesh.from_mesh(mesh)
    assert dual.refinement.nelements == 6 * mesh.nelements
    assert dual.mesh.boundaries["turned"].ori == [0]
    for each in (dual, *(copied(dual) for copied in COPIES)):
        for kept in (each.mesh, each.refinement):
            for array in (kept.doflocs, kept.t, *kept.boundaries.values(), each.mesh.f2t):
                with pytest.raises(ValueError, match="read-only"):
                    array[:] = 0
    assert mesh.boundaries["left"].flags.writeable
    finer = dual.refinement.refined()
    assert finer.nelements == 24 * mesh.nelements
    area = CellBasis(dual.refinement, ElementTriP1()).dx.sum()
    assert area == pytest.approx(1.0)
    assert FacetBasis(dual.refinement, ElementTriP1(), facets="left").dx.sum() == pytest.approx(
        1.0
    )


def test_copies_compute_nothing():
    """A basis is set up when it is asked for more than its cells."""
    basis = copy.deepcopy(skfem_dual.DualMesh.from_mesh(MeshTri().refined(1)).basis())

    @dataclass(frozen=True, eq=False)
    class Held(ReadOnly):
        basis: CellBasis

        @computed_once
        def same(self):
            return self.basis

    again = copy.deepcopy(Held(basis))
    assert again.same is again.basis
    assert "dx" not in vars(again.basis)


def test_sparse_matrices_are_read_only():
    """With entries in order, as scipy would put them in place."""
    given = csr_matrix(([1.0, 1.0, 0.0, 1.0], [1, 0, 0, 1], [0, 2, 4]), shape=(2, 2))

    @dataclass(frozen=True, eq=False)
    class Joined(ReadOnly):
        part: csr_matrix

        @computed_once
        def whole(self):
            return self.part

    joined = Joined(given)
    again = copy.deepcopy(joined)
    assert not again.part.data.flags.writeable
    for matrix in (joined.whole, again.whole):
        for array in (matrix.data, matrix.indices, matrix.indptr):
            with pytest.raises(ValueError, match="read-only"):
                array[:] = 0
        assert abs(matrix).toarray().tolist() == [[1.0, 1.0], [0.0, 1.0]]
    assert given.indices.tolist() == [1, 0, 0, 1]
    given.data[:] = 3.0  # whoever made it may still write


def test_public_classes_of_arrays_are_read_only_in_copies():
    kinds = [getattr(skfem_dual, name) for name in skfem_dual.__all__]
    arrays = np.ndarray, np.ndarray | None
    bad = [
        kind.__name__
        for kind in kinds
        if is_dataclass(kind)
        and any(field.type in arrays for field in fields(kind))
        and not issubclass(kind, ReadOnly)
    ]
    assert not bad
