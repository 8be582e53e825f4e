"""Fields of scikit-fem at points, and carried over to other bases."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu
from skfem import BilinearForm, CellBasis

from ..arguments import checked_array, checked_choice, checked_instance
from ..grids.cellwise import CellwiseBasis
from ..grids.fan import Fan
from ..grids.partition import Partition
from .influence import flat_points
from .load_matrix import points_in_pieces
from .overlaps import overlaps
from .shape_functions import ShapeFunctions


def _checked(basis: CellBasis, values: ArrayLike) -> ndarray:
    if not (isinstance(basis, CellBasis) and basis.mesh.dim() == 2):
        raise TypeError(f"expected a CellBasis on a 2-D mesh, got {type(basis).__name__}")
    values = checked_array("values", values, None, each="DOF")
    if values.shape != (basis.N,):
        raise ValueError(f"expected a vector of shape ({basis.N},), got {values.shape}")
    return values


def evaluate(
    basis: CellBasis, values: ndarray, x: ArrayLike, *, outside: Literal["nan", "zero"] = "nan"
) -> ndarray:
    """A field at any points.

    Parameters
    ----------
    basis : CellBasis
        Of a scalar field on triangles or convex quadrilaterals.
    values : (N,) array of float
        Its vector.
    x : (2, ...) array of float
        Points. On the boundary, and beside it by rounding, they are inside.
    outside : {"nan", "zero"}
        What stands at points outside the mesh.

    Returns
    -------
    (...) array of float
        Where the field jumps, the value in one of the elements there.

    Raises
    ------
    TypeError
        If the basis is not a `CellBasis` of scalars on a 2-D mesh.
    ValueError
        If ``values`` are not its vector, or the points no points.

    Examples
    --------
    >>> from skfem import ElementTriP1, MeshTri
    >>> basis = CellBasis(MeshTri().refined(2), ElementTriP1())
    >>> evaluate(basis, basis.doflocs[0], [[0.3, 1.0, 2.0], [0.3, 0.4, 0.0]]).tolist()
    [0.3, 1.0, nan]
    """
    values = _checked(basis, values)
    checked_choice("outside", outside, ("nan", "zero"))
    x, shape = flat_points(x)
    fan, functions = _element_fan(basis), ShapeFunctions.of(basis, None)
    triangle = fan.locate(x)
    inside = triangle >= 0
    out = np.full(x.shape[1], np.nan if outside == "nan" else 0.0)
    if inside.any():
        element = fan.cell[triangle[inside]]
        shares = functions.values(element, x[:, inside])
        out[inside] = np.sum(shares * values[basis.element_dofs[:, element]], axis=0)
    return out.reshape(shape)


def transfer(basis: CellBasis, values: ndarray, target: CellBasis) -> ndarray:
    """A field carried over to another basis, by integrals over what their meshes share.

    Parameters
    ----------
    basis : CellBasis
        Of a scalar field on triangles or convex quadrilaterals.
    values : (N,) array of float
        Its vector.
    target : CellBasis
        Of scalars, on any mesh: a refinement, or one that has nothing in common with the other.

    Returns
    -------
    (target.N,) array of float
        The nearest field of the target in the mean square, zero assumed where there was none;
        on piecewise constants the mean over each cell. It has the force of the field and, where
        the target contains linear functions, the first moments, if its mesh covers the field.

    Raises
    ------
    TypeError, ValueError
        As `evaluate`; and if a part of the field is not covered.

    Examples
    --------
    >>> from skfem import ElementTriP1, ElementTriP2, MeshTri
    >>> basis = CellBasis(MeshTri().refined(2), ElementTriP1())
    >>> fine = CellBasis(MeshTri().refined(3), ElementTriP2())
    >>> found = transfer(basis, basis.doflocs[0], fine)
    >>> bool(np.allclose(found, fine.doflocs[0]))
    True
    """
    values = _checked(basis, values)
    checked_instance("target", target, CellBasis, "CellBasis(mesh, element), or dual.basis()")
    _checked(target, np.zeros(target.N))
    if isinstance(target, CellwiseBasis) or target.elem.maxdeg == 0:
        return _loads_of_cells(basis, values, target) / Partition.from_basis(target).areas
    mass = BilinearForm(lambda u, v, w: u * v).assemble(target)
    return splu(mass.tocsc()).solve(_loads(basis, values, target))


def _loads(basis: CellBasis, values: ndarray, target: CellBasis) -> ndarray:
    """Integrals of a field times the test functions of the target."""
    fan = _element_fan(basis)
    source, there = ShapeFunctions.of(basis, None), ShapeFunctions.of(target, None)
    pieces = overlaps(fan.p[:, fan.t], there.cells)
    covered = np.bincount(pieces.first, pieces.share, len(fan.cell))
    _require_covered(fan.areas, covered * fan.areas)
    order = basis.elem.maxdeg + target.elem.maxdeg
    points = points_in_pieces(None, fan, (pieces.first, pieces.vertices), order)
    out = np.zeros(target.N)
    for part in points.chunks(2**14):
        field = source.values(part.cell, part.x) * values[basis.element_dofs[:, part.cell]]
        element = pieces.second[part.piece]
        loads = there.values(element, part.x) * (part.weight * field.sum(axis=0))
        out += np.bincount(target.element_dofs[:, element].ravel(), loads.ravel(), target.N)
    return out


def _loads_of_cells(basis: CellBasis, values: ndarray, target: CellBasis) -> ndarray:
    """The same of piecewise constants, integrated on the cells: fields may be much finer."""
    fan, source = Fan.from_basis(target), ShapeFunctions.of(basis, None)
    pieces = overlaps(fan.p[:, fan.t], source.cells)
    elements = _element_fan(basis)
    areas = np.bincount(elements.cell, elements.areas)
    shares = pieces.share * fan.areas[pieces.first]
    _require_covered(areas, np.bincount(pieces.second, shares, len(areas)))
    points = points_in_pieces(None, fan, (pieces.first, pieces.vertices), basis.elem.maxdeg)
    out = np.zeros(target.N)
    for part in points.chunks(2**14):
        element = pieces.second[part.piece]
        field = source.values(element, part.x) * values[basis.element_dofs[:, element]]
        out += np.bincount(part.cell, part.weight * field.sum(axis=0), target.N)
    return out


def _require_covered(areas: ndarray, covered: ndarray) -> None:
    """Refuse a target that leaves out a part of the triangles or elements of the field."""
    missing = (areas - covered).clip(0.0).sum()
    if missing > 1e-9 * areas.sum():
        raise ValueError(
            f"expected a target that covers the field, but {missing:.4g} of its area "
            f"{areas.sum():.6g} lies outside. Remedy: a mesh of the whole plan"
        )


def _element_fan(basis: CellBasis) -> Fan:
    """Triangles of the elements of a basis, numbered as these."""
    fan = Fan.from_mesh(basis.mesh, basis.tind)
    if basis.tind is None:
        return fan
    order = np.argsort(basis.tind)
    cell = order[np.searchsorted(basis.tind[order], fan.cell)]
    return replace(fan, cell=cell)
