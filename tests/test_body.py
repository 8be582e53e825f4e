"""Bodies are what they were when they were made, whatever becomes of what they were made of."""

import pickle
import warnings
from copy import copy, deepcopy

import numpy as np
import pytest
from elastic_bodies import SOIL, bending
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP1,
    MeshQuad,
    MeshTri,
    MeshTri2,
)

from skfem_dual import (
    DualMesh,
    ElasticPunch,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    ResolutionWarning,
    RigidPunch,
    column_load,
    sweep,
)
from skfem_dual.grids.mappings import with_own_mesh
from skfem_dual.sweeps.records import fingerprint

UNIT = HalfSpace(1.0, 0.25)


def circle():
    mesh = MeshTri.init_circle(3)
    return MeshTri(mesh.p.copy(), mesh.t.copy())


def square():
    return MeshQuad.init_tensor(np.linspace(-1, 1, 7), np.linspace(-1, 1, 6))


def answers(punch):
    pressed = punch.solve(settlement=0.3, tilt=(0, 0))
    return [pressed.force, pressed.contact_area, *pressed.pressure]


@pytest.mark.parametrize("gap", [None, Paraboloid(5.0)], ids=["flat", "dish"])
@pytest.mark.parametrize(("make", "element"), [(circle, ElementTriP0()), (square, ElementQuad0())])
def test_meshes_that_are_moved_later(make, element, gap):
    """Half of what had not been computed yet was of the mesh as it is now."""
    expected = answers(RigidPunch(UNIT, CellBasis(make(), element), gap=gap))
    mesh = make()
    early = RigidPunch(UNIT, CellBasis(mesh, element), gap=gap)
    late = RigidPunch(UNIT, CellBasis(mesh, element), gap=gap)
    assert answers(early) == expected
    mesh.p[:] *= 2
    assert [answers(p) for p in (early, late, copy(late), pickle.loads(pickle.dumps(early)))] == [
        expected
    ] * 4
    solution = early.solve(settlement=0.3, tilt=(0, 0))
    assert np.abs(solution.pressure_field()[0].mesh.p).max() == pytest.approx(1.0)


def test_structures_on_meshes_that_are_moved_later():
    mesh = circle()
    plate = CellBasis(mesh, ElementTriMorley())
    f = column_load(plate, (0.2, 0.1), 1.0)
    raft = ElasticPunch(SOIL, DualMesh.from_mesh(circle()).basis(), plate, bending.assemble(plate))
    expected = raft.solve(f).cell_deflections
    mesh.p[:] += 1
    for same in (raft, copy(raft), deepcopy(raft), pickle.loads(pickle.dumps(raft))):
        assert np.array_equal(same.solve(f).cell_deflections, expected)


def test_mappings_of_others_stay():
    """A basis on straight triangles may have the mapping of curved ones."""
    mesh = circle()
    curved = MeshTri2.from_mesh(mesh)
    basis = CellBasis(mesh, ElementTriP0(), mapping=curved.mapping())
    assert with_own_mesh(basis).mapping is basis.mapping
    own = with_own_mesh(CellBasis(mesh, ElementTriP0()))
    assert own.mapping.mesh is own.mesh is not mesh
    assert with_own_mesh(own) is own


def test_shapes_on_meshes_that_are_moved_later():
    mesh = circle()
    basis = CellBasis(mesh, ElementTriP1())
    gap = basis, 0.1 * (basis.doflocs**2).sum(axis=0)
    punch = RigidPunch(UNIT, DualMesh.from_mesh(circle()).basis(), gap=gap)
    expected = answers(punch)
    mesh.p[:] *= 3
    assert answers(copy(punch)) == expected


@pytest.mark.parametrize("name", ["young", "poisson"])
def test_moduli_that_change_their_depths(name):
    """Others were computed at the depths as they had been left."""

    def clipped(z):
        z[z > 0.5] = 0.5
        return 0.2 + 0.2 * z

    with pytest.raises(ValueError, match="read-only"):
        GradedHalfSpace(
            **{"young": lambda z: 1 + z, "poisson": 0.25, "length": 1.0, name: clipped}
        )


def test_shapes_of_a_variable_of_a_loop():
    """With the edge of a flat punch they were those of the last turn."""
    basis, last = DualMesh.from_mesh(circle()).basis(), {"k": 0.1}
    first = RigidPunch(UNIT, basis, gap=lambda x: last["k"] * (x**2).sum(axis=0))
    last["k"] = 0.4
    with pytest.raises(ValueError, match=r"stays as it was .* lambda x, k=k"):
        first.solve(settlement=0.3)
    last["k"] = 0.1
    with_edge = RigidPunch(UNIT, basis, edge="singular", gap=first.gap)
    last["k"] = 0.4
    with pytest.raises(ValueError, match=r"stays as it was .* lambda x, k=k"):
        with_edge.solve(settlement=0.3)


def test_moduli_of_a_variable_of_a_loop():
    last = {"k": 1.0}
    first = GradedHalfSpace(lambda z: 1 + last["k"] * np.minimum(z, 1), 0.25, 1.0)
    last["k"] = 5.0
    with pytest.raises(ValueError, match=r"stay as they were .* lambda z, k=k"):
        RigidPunch(first, DualMesh.from_mesh(circle()).basis()).solve(1.0)


def test_what_the_edge_of_a_flat_punch_takes_is_told_when_it_is_taken():
    """Not of the shape, which has none; it was told when both were made, or not at all."""
    ground = LayeredHalfSpace([Layer(0.01, 0.003, 0.49)], HalfSpace(1.0, 0.3))
    basis = DualMesh.from_mesh(MeshTri.init_circle(3)).basis()
    punch = RigidPunch(ground, basis, gap=Paraboloid(1e5))
    with pytest.warns(ResolutionWarning, match="are too coarse"):
        pressed = punch.solve(1.0)
    assert pressed.punch.edge == "singular"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "contact on", ResolutionWarning)
        inside = RigidPunch(ground, basis, gap=Paraboloid(0.3)).solve(1e-6)
    assert inside.punch.edge == "constant"


def far_above(x):
    return 1e5 + 0.1 * (x**2).sum(axis=0)


@pytest.mark.parametrize(
    ("ground", "gap", "message"),
    [
        (LayeredHalfSpace([Layer(0.01, 0.01, 0.49)], UNIT), None, "cells"),
        (UNIT, far_above, "the shape begins"),
    ],
    ids=["coarse", "far"],
)
def test_what_was_told_of_a_body_is_not_told_of_its_copies(ground, gap, message):
    """Nor with the edge of a flat one, which a shaped one has that presses over its own."""
    basis = DualMesh.from_mesh(circle()).basis()
    with pytest.warns(ResolutionWarning, match=message):
        punch = RigidPunch(ground, basis, gap=gap)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ResolutionWarning)
        for same in (copy(punch), pickle.loads(pickle.dumps(punch)), punch.sharp):
            assert len(same.initial_gap) == len(basis.partition)
            assert len(same.footprint) == len(basis.partition)


@pytest.mark.parametrize(
    "basis",
    [
        lambda: DualMesh.from_mesh(circle()).basis(),
        lambda: DualMesh.from_mesh(circle()).basis().with_elements(np.arange(9)),
        lambda: CellBasis(circle(), ElementTriP0()),
    ],
    ids=["dual", "part", "triangles"],
)
def test_a_basis_that_was_looked_at_is_the_same(basis):
    basis = basis()
    first = fingerprint(basis)
    field = basis.interpolate(np.ones(basis.N))
    assert field.shape == basis.dx.shape
    assert basis.get_dofs() is not None
    assert repr(basis)
    assert basis.mapping.detDF(basis.X).size
    assert fingerprint(basis) == first
    other = CellBasis(circle().scaled(2.0), ElementTriP0())
    assert fingerprint(other) not in {first, fingerprint(CellBasis(circle(), ElementTriP1()))}


def test_sweeps_resume_on_a_basis_that_was_looked_at(tmp_path):
    basis = DualMesh.from_mesh(circle()).basis()
    punch, file = RigidPunch(UNIT, basis), tmp_path / "r.rec"
    sweep(punch.solve, [{"force": 1.0}], file=file)
    assert repr(basis)
    assert sweep(punch.solve, [{"force": 1.0}], file=file).outcomes[0].resumed
