import numpy as np
import pytest
from plans import perturbed, rectangle
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Load,
    Paraboloid,
    RigidPunch,
    refine_to_contact,
)
from skfem_dual.grids.generate import disc


def sphere(mesh):
    basis = DualMesh.from_mesh(mesh).basis()
    return RigidPunch(HalfSpace(1.0, 0.0), basis, gap=Paraboloid(1.0))


def test_refinement_to_the_edge_of_contact():
    """The error falls, and faster per cell than on meshes refined everywhere."""
    a = 0.55
    found = refine_to_contact(
        sphere, perturbed(rectangle(14), 0.01), {"force": 4 / 3 * a**3}, refinements=2
    )
    assert len(found) == 3
    assert all(s.success for s in found)
    cells = np.array([len(s.pressure) for s in found])
    area = np.array([s.contact_area for s in found]) / (np.pi * a**2) - 1
    assert np.abs(area[-1]) < 2e-3
    assert np.abs(area[-1]) < np.abs(area[0]) / 4
    uniform = sphere(perturbed(rectangle(round(np.sqrt(cells[-1])) - 1), 0.005))
    uniform_area = uniform.solve(4 / 3 * a**3).contact_area / (np.pi * a**2) - 1
    assert np.abs(area[-1]) < np.abs(uniform_area)
    x = found[-1].punch.collocation_points
    small = found[-1].punch.partition.areas < 4 * found[-1].punch.partition.areas.min()
    assert np.abs(np.hypot(*x[:, small]) - a).mean() < 0.15


def test_the_edge_of_the_plan_stays_fine():
    """Facets there are halved or left alone: the pressure grows along them as before."""
    mesh = disc(n=200, graded=0.5)
    flat = lambda mesh: RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(mesh).basis())  # noqa: E731
    for s in refine_to_contact(flat, mesh, {"force": 1.0, "at": (0.6, 0.0)}, 2):
        refined = s.punch.basis.dual.mesh
        longest = refined.p[:, refined.facets[:, refined.boundary_facets()]]
        lengths = np.hypot(*(longest[:, 0] - longest[:, 1]))
        known = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]]
        assert lengths.max() <= np.hypot(*(known[:, 0] - known[:, 1])).max() * (1 + 1e-12)
        assert set(map(tuple, mesh.p[:, mesh.boundary_nodes()].T)) <= set(map(tuple, refined.p.T))


def test_full_contact_needs_no_refinement():
    flat = lambda mesh: RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(mesh).basis())  # noqa: E731
    assert len(refine_to_contact(flat, rectangle(6), {"force": 1.0})) == 1
    with pytest.raises(ValueError, match="refinements from 0 to 50, got -1"):
        refine_to_contact(flat, rectangle(6), {"force": 1.0}, -1)
    with pytest.raises(ValueError, match="got an integer of 400 digits"):
        refine_to_contact(flat, rectangle(6), {"force": 1.0}, 10**400)
    with pytest.raises(TypeError, match="expected a Mapping for load, got None"):
        refine_to_contact(flat, rectangle(6), None)


def test_a_punch_elsewhere_is_refused():
    square, load = rectangle(6), {"force": 0.1}
    quadrilaterals = CellBasis(MeshQuad().refined(3), ElementQuad0())
    makes = (
        lambda mesh: sphere(rectangle(8)),
        lambda mesh: RigidPunch(HalfSpace(1.0, 0.0), quadrilaterals, gap=Paraboloid(1.0)),
    )
    for make in makes:
        with pytest.raises(
            ValueError, match=r"on the mesh that make is given, of 49 nodes and 72"
        ):
            refine_to_contact(make, square, load)
    with pytest.raises(TypeError, match=r"expected a RigidPunch for make\(mesh\), got None"):
        refine_to_contact(lambda mesh: None, square, load)


def test_a_start_is_refused():
    mesh, load = disc(n=100), Load(force=0.5)  # what it leaves free is no key
    assert len(refine_to_contact(sphere, mesh, load, 0, horizontal=(0.0, 0.0))) == 1
    with pytest.raises(TypeError, match="expected force in the load or beside it, got it in both"):
        refine_to_contact(sphere, mesh, load, 0, force=0.2)
    with pytest.raises(TypeError, match="no start: each solution starts from the one before"):
        refine_to_contact(sphere, disc(n=60), {"force": 0.1}, 1, start=None)
