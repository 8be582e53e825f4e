"""Fields of scikit-fem at points, and carried over to other bases.

On quadrilaterals that are no parallelograms shape functions are no polynomials of the coordinates,
and no rule on pieces of elements is exact. What of a field is linear in a whole element, and its
force and first moments there, are integrated in the reference element instead, where they are: the
pieces decide on the rest alone.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu
from skfem import BilinearForm, CellBasis, ElementVector, LinearForm
from skfem.element import ElementComposite
from skfem.mapping import MappingAffine

from ..arguments import checked_array, checked_choice, checked_instance
from ..grids.cellwise import HIGHEST, CellwiseBasis
from ..grids.fan import Fan
from ..grids.mappings import bends, is_far, middle_of
from ..grids.partition import Partition
from ..grids.polygons import some
from .influence import flat_points
from .load_matrix import MISSING, Points, missing_planes, points_in_pieces
from .overlaps import overlaps
from .shape_functions import ShapeFunctions, picklable

#: elements have straight sides if their areas are those by their vertices, and the middles of
#: sides where these tell, but for so much
STRAIGHT = 1e-6
#: points at which functions are evaluated at a time
CHUNK = 2**14


def _checked(basis: CellBasis, values: ArrayLike) -> ndarray:
    if not (isinstance(basis, CellBasis) and basis.mesh.dim() == 2):
        raise TypeError(f"expected a CellBasis on a 2-D mesh, got {type(basis).__name__}")
    shapes = [np.shape(field)[:-2] for field in basis.basis[0]]
    if shapes != [()]:
        divisible = isinstance(basis.elem, (ElementVector, ElementComposite))
        remedy = ". Remedy: one of the parts by basis.split(values)" if divisible else ""
        raise TypeError(
            f"expected a basis of a scalar field, got one of {type(basis.elem).__name__}{remedy}"
        )
    ShapeFunctions.of(basis, None)  # refuses functions that have lost their digits
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
        If ``values`` are not its vector, the points no points, or sides of elements curved.

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
    middle = middle_of(basis.mesh)
    if far := is_far(basis.mesh):  # differences of coordinates lose no digits, points between do
        basis = _moved(basis, middle)
    if isinstance(target, CellwiseBasis) or target.elem.maxdeg == 0:
        fan = Fan.from_basis(target)
        fan = replace(fan, p=fan.p - middle[:, None]) if far else fan
        areas = Partition.from_basis(target).areas
        if isinstance(target, CellwiseBasis):  # as loads on them are assembled
            areas = np.bincount(target.element_dofs[0], target.dx.sum(axis=1), target.N)
        return _loads_of_cells(basis, values, fan, target.N, far) / areas
    target = _moved(target, middle) if far else target
    mass = BilinearForm(lambda u, v, w: u * v).assemble(_exact(target))
    loads, out = _loads(basis, values, target, far), np.zeros(target.N)
    used = np.unique(target.element_dofs)  # of all elements, or of those it is on
    out[used] = splu(mass.tocsc()[used][:, used]).solve(loads[used])
    return out


def _loads(basis: CellBasis, values: ndarray, target: CellBasis, far: bool) -> ndarray:
    """Integrals of a field times the test functions of the target; ``far`` if places have lost
    digits that its force and first moments are to keep."""
    fan = _element_fan(basis)
    source, there = ShapeFunctions.of(basis, None), ShapeFunctions.of(target, None)
    pieces = overlaps(fan.p[:, fan.t], there.cells)
    covered = np.bincount(pieces.first, pieces.share, len(fan.cell)) * fan.areas
    _require_covered(fan.areas, covered)
    order = min(_degree(source) + _degree(there), HIGHEST)
    points = points_in_pieces(None, fan, (pieces.first, pieces.vertices), order)
    weight = points.weight * _made_good(fan.areas, covered)[pieces.first[points.piece]]
    points = replace(points, weight=weight)
    field = _field(source, values, points, far)
    points = replace(points, cell=pieces.second[points.piece])
    out = np.zeros(target.N)
    if not isinstance(there.mapping, MappingAffine):
        elements = _Elements.of(target)
        linear = elements.linear_part(points, field)
        field = field - np.sum(linear[:, points.cell] * elements.planes(points), axis=0)
        out += elements.loads(linear)
    start = 0
    for part in points.chunks(CHUNK):
        force = part.weight * field[start : start + CHUNK]
        loads = there.values(part.cell, part.x) * force
        out += np.bincount(target.element_dofs[:, part.cell].ravel(), loads.ravel(), target.N)
        start += CHUNK
    return out


def _loads_of_cells(basis: CellBasis, values: ndarray, fan: Fan, n: int, far: bool) -> ndarray:
    """The same of n cells that a fan fills: fields may be much finer than these."""
    source = ShapeFunctions.of(basis, None)
    pieces = overlaps(fan.p[:, fan.t], source.cells)
    elements = _element_fan(basis)
    areas = np.bincount(elements.cell, elements.areas)
    shares = pieces.share * fan.areas[pieces.first]
    covered = np.bincount(pieces.second, shares, len(areas))
    _require_covered(areas, covered)
    order = min(_degree(source), HIGHEST)
    points = points_in_pieces(None, fan, (pieces.first, pieces.vertices), order)
    element = pieces.second[points.piece]
    weight = points.weight * _made_good(areas, covered)[element]
    field = _field(source, values, replace(points, weight=weight, cell=element), far)
    return np.bincount(points.cell, weight * field, n)


def _degree(functions: ShapeFunctions) -> int:
    """Of polynomials that are integrated on pieces of elements."""
    affine = isinstance(functions.mapping, MappingAffine)
    return functions.basis.elem.maxdeg + (0 if affine else 2)


def _field(source: ShapeFunctions, values: ndarray, points: Points, far: bool) -> ndarray:
    """A field at points, with its force and first moments in each element."""
    dofs = source.basis.element_dofs
    parts = [
        np.sum(source.values(part.cell, part.x) * values[dofs[:, part.cell]], axis=0)
        for part in points.chunks(CHUNK)
    ]
    field = np.concatenate([*parts, np.empty(0)])
    if isinstance(source.mapping, MappingAffine) and not far:
        return field
    elements = _Elements.of(source.basis)
    return field + np.sum(
        elements.missing(points, field, values)[:, points.cell] * elements.planes(points), axis=0
    )


def _exact(basis: CellBasis) -> CellBasis:
    """The basis about the middle of its mesh, with a rule for products of its functions."""
    mesh, degree = basis.mesh, 2 * basis.elem.maxdeg
    degree = min(degree if mesh.affine else degree + 2, HIGHEST)
    return _moved(basis, middle_of(mesh), degree)


def _moved(basis: CellBasis, origin: ndarray, intorder: int | None = None) -> CellBasis:
    """The basis in coordinates from an origin."""
    mesh, element = basis.mesh.translated(-origin), picklable(basis).elem
    return CellBasis(mesh, element, intorder=intorder, elements=basis.tind, dofs=basis.dofs)


@dataclass(frozen=True, eq=False)
class _Elements:
    """Integrals of fields over elements in the reference element, where they are exact.

    Planes are one and both coordinates of points from the middle of their element, over its size.
    """

    basis: CellBasis
    shift: ndarray
    middle: ndarray
    size: ndarray

    @classmethod
    def of(cls, basis: CellBasis) -> "_Elements":
        exact = _exact(basis)
        x = exact.global_coordinates()
        size = np.ptp(x, axis=2).max(axis=0)
        return cls(exact, middle_of(basis.mesh), x.mean(axis=2), size)

    def planes(self, points: Points) -> ndarray:
        """At points in elements; shape (3, k)."""
        x = points.x - self.shift[:, None] - self.middle[:, points.cell]
        return np.vstack([np.ones(x.shape[1]), x / self.size[points.cell]])

    def _planes(self) -> ndarray:
        """At the points of the rule in each element; shape (3, n, q)."""
        x = self.basis.global_coordinates() - self.middle[..., None]
        return np.stack([np.ones(x.shape[1:]), *(x / self.size[:, None])])

    def _whole(self, points: Points) -> ndarray:
        """Which elements the points fill, whose sides are straight."""
        areas = self.basis.dx.sum(axis=1)
        filled = np.bincount(points.cell, points.weight, len(areas))
        bent = _bent(self.basis) > MISSING * np.sqrt(areas)
        return (np.abs(filled - areas) <= MISSING * areas) & ~bent

    def missing(self, points: Points, field: ndarray, values: ndarray) -> ndarray:
        """Planes by which a field at points misses its force and first moments; shape (3, n)."""
        there = self.basis.dx * np.asarray(self.basis.interpolate(values))
        given = np.sum(there * self._planes(), axis=2)
        return missing_planes(points, self.planes(points), self._whole(points), field, given)

    def linear_part(self, points: Points, field: ndarray) -> ndarray:
        """Planes nearest to a field at points in each whole element, else none; shape (3, n)."""
        planes, whole = self.planes(points), self._whole(points)
        force = points.weight * field
        given = np.stack([np.bincount(points.cell, force * each, len(whole)) for each in planes])
        return missing_planes(points, planes, whole, np.zeros(len(field)), given)

    def loads(self, linear: ndarray) -> ndarray:
        """Integrals of planes times the test functions."""
        field = np.sum(linear[..., None] * self._planes(), axis=0)
        return LinearForm(lambda v, w: v * w["field"]).assemble(self.basis, field=field)


def _made_good(areas: ndarray, covered: ndarray) -> ndarray:
    """Factors that make slivers good which rounding leaves out of what is covered."""
    return np.divide(areas, covered, out=np.ones_like(areas), where=covered > areas / 2)


def _require_covered(areas: ndarray, covered: ndarray) -> None:
    """Refuse a target that leaves out a part of the triangles or elements of the field."""
    missing = (areas - covered).clip(0.0).sum()
    if missing > 1e-9 * areas.sum():
        raise ValueError(
            f"expected a target that covers the field, but {missing:.4g} of its area "
            f"{areas.sum():.6g} lies outside. Remedy: a mesh of the whole plan, whose facets on "
            "arcs are the same, or that reaches farther"
        )


def _element_fan(basis: CellBasis) -> Fan:
    """Triangles of the elements of a basis, numbered as these."""
    fan = Fan.from_mesh(basis.mesh, basis.tind)
    if basis.tind is None:
        _require_straight(basis, fan)
        return fan
    order = np.argsort(basis.tind)
    cell = order[np.searchsorted(basis.tind[order], fan.cell)]
    fan = replace(fan, cell=cell)
    _require_straight(basis, fan)
    return fan


def _require_straight(basis: CellBasis, fan: Fan) -> None:
    areas, straight = basis.dx.sum(axis=1), np.bincount(fan.cell, fan.areas, basis.nelems)
    as_told = np.abs(areas - straight) <= STRAIGHT * straight
    bad = np.nonzero(~(as_told & (_bent(basis) <= STRAIGHT * np.sqrt(straight))))[0]
    if len(bad):
        raise ValueError(
            f"expected elements with straight sides, got elements {some(bad)} of a "
            f"{type(basis.mesh).__name__} that are not as their vertices tell. Remedy: the field "
            "on a mesh of more, straight elements"
        )


def _bent(basis: CellBasis) -> ndarray:
    """How far the sides of each element of a basis bend at most."""
    most = bends(basis.mesh)[basis.mesh.t2f].max(axis=0)
    return most if basis.tind is None else most[basis.tind]
