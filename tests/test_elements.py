"""Elements in files, of which none is turned over."""

import meshio
import numpy as np
import pytest
import pyvista
from elastic_shapes import block, plate
from skfem import (
    CellBasis,
    ElementQuad1,
    ElementTriP1,
    ElementTriP2,
    MeshHex,
    MeshQuad,
    MeshTet,
    MeshTri,
)

from skfem_dual.io import write_field, write_structure
from skfem_dual.io.elements import positive
from skfem_dual.io.structures import KINDS

VTK = {"triangle": 5, "triangle6": 22, "quad": 9, "tetra": 10, "hexahedron": 12}


def sizes(kind, p, cells):
    """As VTK integrates them."""
    points = np.vstack([p, np.zeros((3 - len(p), p.shape[1]))]).T
    grid = pyvista.UnstructuredGrid({VTK[kind]: cells.T}, points)
    return grid.compute_cell_sizes().cell_data["Volume" if len(p) == 3 else "Area"]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", [MeshTet, MeshHex])
def test_volumes_are_positive(kind, mirrored):
    mesh = kind().refined(1)
    p = mesh.p * [[1.0], [1.0], [-1.0 if mirrored else 1.0]]
    name, order = KINDS[kind]
    cells = positive(p, mesh.t[order])
    assert np.array_equal(np.sort(cells, axis=0), np.sort(mesh.t, axis=0))
    volumes = sizes(name, p, cells)
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("mesh", "element"),
    [
        (MeshTri().refined(2), ElementTriP1()),
        (MeshTri().refined(2), ElementTriP2()),
        (MeshQuad().refined(1).mirrored((1.0, 0.0)), ElementQuad1()),
    ],
)
def test_normals_of_fields_are_upwards(mesh, element, tmp_path):
    basis = CellBasis(mesh, element)
    write_field(tmp_path / "field.vtu", basis, basis.doflocs[0] + 2 * basis.doflocs[1])
    found = meshio.read(tmp_path / "field.vtu")
    cells = found.cells[0].data
    a, b, c = (found.points[cells[:, k], :2].T for k in (0, 1, 2))
    (ux, uy), (vx, vy) = b - a, c - a
    assert (ux * vy - uy * vx > 0).all()
    if isinstance(element, ElementTriP2):  # each middle between its ends
        middles = (
            found.points[cells[:, :3]] + found.points[np.roll(cells[:, :3], -1, axis=1)]
        ) / 2
        assert found.points[cells[:, 3:]] == pytest.approx(middles)
    assert found.point_data["pressure"] == pytest.approx(found.points[:, :2] @ [1.0, 2.0])


def test_structures_have_their_volume_and_area(tmp_path):
    for body, size in ((block(), "Volume"), (plate(), "Area")):
        solution = body.punch.solve(body.f)
        write_structure(tmp_path / "structure.vtu", solution)
        grid = pyvista.read(tmp_path / "structure.vtu")
        part = grid.extract_cells(np.flatnonzero(grid.cell_data["part"] == 0))
        measured = part.compute_cell_sizes().cell_data[size]
        assert measured.min() > 0
        mesh = solution.punch.structure.mesh
        total = CellBasis(mesh, mesh.elem()).dx.sum()
        assert part.integrate_data()[size][0] == pytest.approx(total)
