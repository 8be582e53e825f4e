"""Fields of scikit-fem as VTU files."""

from os import PathLike

import numpy as np
from numpy import ndarray
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementQuad1,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    Mesh,
    MeshQuad,
    MeshQuad1DG,
    MeshTri,
    MeshTri1DG,
)

from ..arguments import checked_array, checked_instance
from ..elements.shape_functions import require_places
from ..grids.cellwise import CellwiseBasis
from ..grids.mappings import bends, places_of
from .elements import positive
from .polygons import write_polygons
from .writing import require_vtu, vtu_name, write_whole

#: what VTK calls elements, by the number of their vertices
SIDES = {3: "triangle", 4: "quad"}


def write_field(
    path: str | PathLike, basis: CellBasis, values: ndarray, name: str = "pressure"
) -> None:
    """Write a field to a VTU file, for ParaView and others.

    Parameters
    ----------
    path : str or path
        Name of the file, ending in ``.vtu``.
    basis : CellBasis
        Constants on cells of any kind, dual cells too; ElementTriP1, ElementTriP2 or
        ElementQuad1. Of a basis on some elements these are written, of dual cells the triangles
        of the common refinement.
    values : (N,) array of float
        Its vector.
    name : str
        What the data are called in the file.

    Raises
    ------
    TypeError
        If the basis or the elements are others, or quadrilaterals are curved; values are no
        numbers, or the name no text.
    ValueError
        If the suffix or the number of values does not fit, a value is not finite, or the name
        is empty, cannot be printed, or of constants on dual cells is ``cell``, which is that of
        their numbers; or if a basis of the first order or more does not know where its DOFs are.
    OSError
        If the file cannot be written.
    """
    import meshio

    checked_instance("basis", basis, CellBasis)
    require_vtu(path)
    written = vtu_name(name)
    values = checked_array("values", values, (basis.N,), each="DOF")
    if len(basis.mesh.t) not in SIDES:
        name = type(basis.mesh).__name__
        raise TypeError(f"expected a mesh of triangles or quadrilaterals, got a {name}")
    if isinstance(basis, CellwiseBasis) and basis.tind is None:
        write_polygons(path, basis.partition.polygons, {name: values})
        return
    curved = _is_curved(basis.mesh)
    if curved:
        basis, values = _on_curves(basis, values)
    if isinstance(basis.mesh, (MeshTri1DG, MeshQuad1DG)):
        basis, values = _with_vertices_apart(basis, values)
    kind = SIDES[len(basis.mesh.t)]
    p, cells, at_points = basis.mesh.p, basis.mesh.t, True
    if curved and isinstance(basis.elem, ElementTriP0):
        p, cells, kind = basis.mesh.doflocs, basis.mesh.dofs.element_dofs, "triangle6"
    if isinstance(basis.elem, (ElementTriP0, ElementQuad0)):
        at_points = False
        cells = cells if basis.tind is None else cells[:, basis.tind]
        values = values[basis.element_dofs[0]]
    elif isinstance(basis.elem, (ElementTriP1, ElementTriP2, ElementQuad1)):
        require_places("a field", basis)
        # scikit-fem and VTK number vertices and middles of sides alike
        p, cells = basis.doflocs, basis.element_dofs
        kind += "6" if isinstance(basis.elem, ElementTriP2) else ""
    else:
        raise TypeError(
            "expected constants, ElementTriP1, ElementTriP2 or ElementQuad1, got "
            f"{type(basis.elem).__name__}. Remedy: transfer the field to one of them"
        )
    mesh = meshio.Mesh(
        np.vstack([p, np.zeros(p.shape[1])]).T,
        [(kind, positive(p, cells).T)],
        point_data={written: values} if at_points else {},
        cell_data={} if at_points else {written: [values]},
    )
    write_whole(path, lambda part: meshio.write(part, mesh, file_format="vtu"))


def _with_vertices_apart(basis: CellBasis, values: ndarray) -> tuple[CellBasis, ndarray]:
    """The same field where elements have vertices of their own, as on discontinuous and periodic
    meshes, of which the numbers in ``t`` are not those of places."""
    elem, given = basis.elem, basis.mesh
    if not isinstance(elem, (ElementTriP0, ElementQuad0, ElementTriP1, ElementQuad1)):
        raise TypeError(
            f"expected constants, ElementTriP1 or ElementQuad1 on a {type(given).__name__}, got "
            f"{type(elem).__name__}. Remedy: transfer the field to one of them"
        )
    p, cells = places_of(given)
    mesh = (MeshTri if len(cells) == 3 else MeshQuad)(p, cells, sort_t=False)
    apart = CellBasis(mesh, elem, elements=basis.tind)
    own = np.zeros(apart.N)
    own[apart.element_dofs] = values[basis.element_dofs]
    return apart, own


def _is_curved(mesh: Mesh) -> bool:
    """Whether sides of elements of the second order are not straight."""
    return bool(bends(mesh).max() > 1e-12 * np.ptp(mesh.p, axis=1).max())


def _on_curves(basis: CellBasis, values: ndarray) -> tuple[CellBasis, ndarray]:
    """The same field of the order of its curved triangles, which VTK writes with it."""
    if isinstance(basis.elem, ElementTriP1):
        fine = basis.with_element(ElementTriP2())
        out = np.zeros(fine.N)
        out[fine.nodal_dofs[0]] = values[basis.nodal_dofs[0]]
        ends = values[basis.nodal_dofs[0][basis.mesh.facets]]
        out[fine.facet_dofs[0]] = ends.mean(axis=0)
        return fine, out
    if not isinstance(basis.elem, (ElementTriP0, ElementTriP2)):
        raise TypeError(
            "expected constants, ElementTriP1 or ElementTriP2 on triangles where cells are "
            f"curved, got {type(basis.elem).__name__} on a {type(basis.mesh).__name__}. Remedy: "
            "transfer the field to a mesh of these, or one with straight sides"
        )
    return basis, values
