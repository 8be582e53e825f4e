"""Values of the test functions of any scikit-fem basis at points in the plane of a plan."""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy import ndarray
from skfem import (
    CellBasis,
    Element,
    ElementComposite,
    ElementGlobal,
    ElementH1,
    ElementVector,
    FacetBasis,
    Mesh,
)
from skfem.assembly import Dofs
from skfem.assembly.basis import AbstractBasis
from skfem.mapping import Mapping, MappingAffine

from ..arguments import checked_integer
from ..grids.mappings import inverse, inverting, is_far, mapping_about_middle, places_of
from ..grids.polygons import some
from ..kernels.once import computed_once

_B = TypeVar("_B", bound=AbstractBasis)
#: how far functions of vertices may be from 1 in these; loads assembled with them are off by a
#: tenth of that
NODAL = 1e-3
#: sizes of a mesh between the origin and its middle from which on functions of plates lose digits
OFF_ORIGIN = 0.1
#: a point of the reference element that is in no lattice
BESIDE = 0.31, 0.57, 0.23
#: what polynomials may be off there, made of coordinates that are not about the middle of each
#: cell, and parallel sides, by rounding
COEFFICIENTS, ROUNDING = 1e-7, 1e-10


@dataclass(frozen=True, eq=False)
class ShapeFunctions:
    """Test functions on straight cells in the plane of the plan."""

    basis: AbstractBasis
    cells: ndarray
    elements: ndarray
    height: float | None
    up: ndarray | None
    component: int | None

    @computed_once
    def mapping(self) -> Mapping:
        return inverting(self.basis.mapping)

    @classmethod
    def of(cls, basis: AbstractBasis, component: int | None) -> "ShapeFunctions":
        if isinstance(basis, (CellBasis, FacetBasis)):
            for element in _parts(basis.elem):
                if isinstance(element, ElementGlobal) or element.facet_dofs > 1:
                    _require_ascending(element, basis.mesh)
                if isinstance(element, ElementGlobal) and element.V is not None:
                    _require_of_mesh(element, basis.mapping)
        if type(basis) is FacetBasis and basis.mesh.dim() == 3:
            return cls._of_facets(basis, component)
        if not (isinstance(basis, CellBasis) and basis.mesh.dim() == 2):
            on = getattr(basis, "mesh", None)
            mesh = "" if on is None else f" on a {type(on).__name__}"
            raise TypeError(
                "expected a CellBasis on a 2-D mesh or a FacetBasis on facets of a 3-D mesh, got "
                f"{type(basis).__name__}{mesh}"
            )
        mesh = basis.mesh
        elements = np.arange(mesh.nelements) if basis.tind is None else np.asarray(basis.tind)
        p, t = places_of(mesh)
        return cls(basis, p[:, t[:, elements]], elements, None, None, component)

    @classmethod
    def _of_facets(cls, basis: FacetBasis, component: int | None) -> "ShapeFunctions":
        mesh = basis.mesh
        v = mesh.p[:, mesh.facets[:, basis.find]]
        if v.shape[2] == 0:
            raise ValueError("expected facets under the plan, got a FacetBasis without facets")
        height = float(v[2].mean())
        off = np.abs(v[2] - height).max(axis=0)
        bad = np.nonzero(off > 1e-9 * np.ptp(v, axis=(1, 2)).max())[0]
        if len(bad):
            raise ValueError(
                f"expected facets in one plane z = const, as the plan is, got facets "
                f"{some(basis.find[bad])} off z = {height:g} by up to {off.max():.3g}. Remedy: "
                "name the facets on the plan when making the FacetBasis"
            )
        inside = mesh.p[2, mesh.t[:, basis.tind]].mean(axis=0)
        up = np.where(inside > height, 1.0, -1.0)  # against the outward normal
        return cls(basis, v[:2], np.asarray(basis.tind), height, up, component)

    def on(self, cells: ndarray) -> "ShapeFunctions":
        """Those of some of the cells."""
        up = None if self.up is None else self.up[cells]
        return replace(self, cells=self.cells[..., cells], elements=self.elements[cells], up=up)

    def values(self, cell: ndarray, x: ndarray) -> ndarray:
        """What unit pressure works on, shape (Nbfun, m), at a point of each cell."""
        element = self.elements[cell]
        if self.height is not None:
            x = np.vstack([x, np.full(x.shape[1], self.height)])
        local = inverse(self.mapping, x[:, :, None], element)
        if self._polynomial:
            return self._tabulated(local[..., 0], cell)
        return self._evaluated(local, cell)[..., 0]

    def _tabulated(self, local: ndarray, cell: ndarray) -> ndarray:
        """At a point of each cell, (dim, m), by the table."""
        shares = self._lattice[1] @ _monomials(local, *self._degree)
        return np.einsum("iml,lm->im", self._table[:, cell], shares)

    def _evaluated(self, local: ndarray, cell: ndarray) -> ndarray:
        """At points of the reference element, of shape (dim, q) or (dim, m, q)."""
        own, mapping = self._functions
        elements = self.elements[cell]
        point = local[:, :1]  # of one element, or one for all
        (k, at), factor = self._worked_on(own.gbasis(mapping, point, 0, tind=elements[:1]))
        values = np.zeros((self.basis.Nbfun, len(cell), local.shape[-1]))
        scalar, each = (own.elem, own.dim) if isinstance(own, ElementVector) else (own, 1)
        if type(scalar).gbasis is ElementH1.gbasis:  # the same on all elements, without mappings
            for i in range(at[0] if at else 0, len(values), each):
                values[i] = scalar.lbasis(local, i // each)[0]
        else:
            for i in range(len(values)):
                fields = own.gbasis(mapping, local, i, tind=elements)
                values[i] = np.asarray(fields[k])[at]
        return values if factor is None else values * factor[cell, None]

    @computed_once
    def _functions(self) -> tuple[Element, Mapping]:
        """The element, and the mapping to its coordinates.

        Functions of plates are polynomials of the coordinates themselves and lose digits with the
        square of the distance from the origin, those of the fifth degree sooner: they are made
        anew about the middle of the mesh.
        """
        element, mesh = self.basis.elem, self.basis.mesh
        if not (self._global and is_far(mesh, OFF_ORIGIN)):
            return element, self.mapping
        return without_functions(element), mapping_about_middle(mesh)

    @property
    def _global(self) -> bool:
        """Whether some functions are polynomials of the coordinates themselves."""
        return any(isinstance(part, ElementGlobal) for part in _parts(self.basis.elem))

    @property
    def _degree(self) -> tuple[int, int]:
        """Of polynomials on a cell: along each coordinate, and in all."""
        most, dim = self.basis.elem.maxdeg, self.mapping.mesh.dim()
        if isinstance(self.mapping, MappingAffine):
            return most, most
        each = -(-most // dim)
        return each, each * dim

    @computed_once
    def _polynomial(self) -> bool:
        """Whether the functions are polynomials of the coordinates in the reference element.

        They are on simplices. Those of plates, which take long, are on parallelograms, too: seen
        at a point beside those that determine them.
        """
        mesh = self.mapping.mesh
        if isinstance(self.mapping, MappingAffine):
            return True
        if not self._global or not _parallel(mesh, self.elements):
            return False
        cell = np.arange(len(self.elements))
        local = np.array(BESIDE[: mesh.dim()])[:, None]
        wanted = self._evaluated(local, cell)[..., 0]
        found = self._tabulated(np.tile(local, len(cell)), cell)
        off = np.abs(found - wanted).max(initial=0.0)
        return bool(off < COEFFICIENTS * np.abs(wanted).max(initial=0.0))

    @computed_once
    def _lattice(self) -> tuple[ndarray, ndarray]:
        """Points of the reference element that determine polynomials, and how."""
        each, most = self._degree
        dim = self.mapping.mesh.dim()
        steps = np.indices((each + 1,) * dim).reshape(dim, -1)
        points = steps[:, steps.sum(axis=0) <= most] / max(each, 1)
        return points, np.linalg.inv(_monomials(points, each, most))

    @computed_once
    def _table(self) -> ndarray:
        """The test functions at the points of the lattice, shape (Nbfun, ncells, q).

        Where they are polynomials this is all there is to know of them.
        """
        return self._evaluated(self._lattice[0], np.arange(len(self.elements)))

    def _worked_on(self, fields: tuple) -> tuple[tuple[int, tuple[int, ...]], ndarray | None]:
        """The field that the pressure works on, its component, and with which factor."""
        shapes = [np.shape(field)[:-2] for field in fields]
        place = place_worked_on(shapes, self.basis.elem, self.component, self.up is not None)
        return place, self.up if self.component is None and place[1] else None


def place_worked_on(
    shapes: list[tuple[int, ...]], element: Element, component: int | None, solid: bool
) -> tuple[int, tuple[int, ...]]:
    """The field, and its component, that the pressure works on, of fields of such shapes."""
    places = [(k, at) for k, shape in enumerate(shapes) for at in np.ndindex(*shape)]
    if component is not None:
        last = len(places) - 1
        return places[checked_integer("component", component, at_least=0, at_most=last)]
    scalars = [(k, ()) for k, shape in enumerate(shapes) if shape == ()]
    vectors = [(k, (2,)) for k, shape in enumerate(shapes) if shape == (3,)]
    wanted = vectors + scalars if solid else scalars + vectors
    if not wanted:
        raise TypeError(
            "expected a scalar field or a vector of three components for the pressure to "
            f"work on, got {type(element).__name__}. Remedy: say which, component="
        )
    return wanted[0]


def settling(basis: CellBasis, component: int | None) -> ndarray:
    """DOFs of a displacement by one of all of a structure, (N,), along the component that the
    pressure works on, see `load_matrix`.

    Raises
    ------
    TypeError
        If that is one of a field whose DOFs are not those of its components.
    """
    fields, solid = [np.shape(field)[:-2] for field in basis.basis[0]], basis.mesh.dim() == 3
    field, at = place_worked_on(fields, basis.elem, component, solid)
    # as scikit-fem numbers DOFs, of which it makes the bases of the fields
    plain = copy(basis)
    plain.dofs = Dofs(basis.mesh, basis.elem)
    part, dofs = plain, np.arange(plain.N)
    for split, number in ((ElementComposite, field), *((ElementVector, k) for k in at)):
        if isinstance(part.elem, split):
            part, dofs = part.split_bases()[number], dofs[part.split_indices()[number]]
    if np.shape(part.basis[0][0])[:-2] != ():
        raise TypeError(f"expected a scalar deflection, got one of {type(part.elem).__name__}")
    moved, own = np.zeros(plain.N), np.zeros(basis.N)
    # with points enough for products of its functions, whatever the basis is assembled with
    order = 2 * part.elem.maxdeg
    exact = CellBasis(part.mesh, part.elem, basis.mapping, intorder=order, elements=basis.tind)
    moved[dofs] = exact.project(1.0)
    elements = slice(None) if basis.tind is None else basis.tind
    own[basis.dofs.element_dofs[:, elements]] = moved[plain.dofs.element_dofs[:, elements]]
    return own


def _parts(element: Element) -> Iterator[Element]:
    """An element and those of which it consists."""
    yield element
    for part in [element.elem] if hasattr(element, "elem") else getattr(element, "elems", ()):
        yield from _parts(part)


def require_places(name: str, basis: AbstractBasis) -> None:
    """Refuse, with a ValueError, a basis that does not know where its DOFs are."""
    if not hasattr(basis, "doflocs"):
        raise ValueError(
            f"expected a basis for {name} that knows where its DOFs are, got one made with "
            "disable_doflocs=True. Remedy: leave that out"
        )


def ascends(mesh: Mesh) -> bool:
    """Whether the vertices of all triangles ascend, as scikit-fem sorts them unless asked not to;
    other elements have no order."""
    return len(mesh.t) != 3 or bool((np.diff(mesh.t, axis=0) > 0).all())


def _require_ascending(element: Element, mesh: Mesh) -> None:
    """Refuse functions that follow the directions of facets where those differ from triangle to
    triangle: they do not fit together, and have lost all fields but the constant ones."""
    if not ascends(mesh):
        bad = np.nonzero((np.diff(mesh.t, axis=0) <= 0).any(axis=0))[0]
        raise ValueError(
            f"expected triangles whose vertices ascend, for {type(element).__name__}, got "
            f"{some(bad)} that do not. Remedy: MeshTri(mesh.p, mesh.t), which sorts them"
        )


def _require_of_mesh(element: ElementGlobal, mapping: Mapping) -> None:
    """Refuse functions that are not those of the mesh: the first of each vertex is 1 in it.

    Plate elements keep the functions of the mesh they were first used on, as polynomials of the
    coordinates themselves, which far from the origin have no digits left.
    """
    mesh, name = mapping.mesh, type(element).__name__
    anew = f"{name}() anew for the basis of each mesh"
    if len(element.V) != mesh.nelements:
        raise ValueError(
            f"expected functions of {name} on the {mesh.nelements} elements of the mesh, got "
            f"those of {len(element.V)} elements, kept from its first use on another mesh. "
            f"Remedy: {anew}"
        )
    values = [
        np.asarray(element.gbasis(mapping, x[:, None], i * element.nodal_dofs)[0])
        for i, x in enumerate(mesh.elem.refdom.p.T)
    ]
    off = np.abs(np.array(values) - 1).max(axis=(0, 2))
    bad = np.nonzero(~(off < NODAL))[0]
    if len(bad):
        raise ValueError(
            f"expected functions of {name} that are 1 in vertices of the mesh, elements "
            f"{some(bad)} have some that are off by up to {off.max():.2g}; likely cause: "
            "coordinates far from the origin, where polynomials of them have no digits left, or "
            "functions kept from another mesh. Remedy: mesh.translated to the origin, for "
            f"structure and cells; or {anew}"
        )


def _parallel(mesh: Mesh, elements: ndarray) -> bool:
    """Whether all of some quadrilaterals are parallelograms with straight sides."""
    p, t = places_of(mesh)
    if mesh.doflocs.shape[1] > p.shape[1]:
        return False
    corners = p[:, t[:, elements]]
    linear = np.vstack([np.ones(len(mesh.t)), mesh.elem.refdom.p])
    bent = corners - np.einsum("ijk,jl->ilk", corners, np.linalg.pinv(linear) @ linear)
    sizes = np.ptp(corners, axis=1).max(axis=0)
    return bool((np.abs(bent).max(axis=(0, 1)) < ROUNDING * sizes).all())


def _monomials(x: ndarray, each: int, most: int) -> ndarray:
    """Products of powers of coordinates up to a degree of each and in all, shape (k, m)."""
    powers = np.indices((each + 1,) * len(x)).reshape(len(x), -1).T
    return np.stack([np.prod(x.T**p, axis=1) for p in powers if p.sum() <= most])


def picklable(basis: _B) -> _B:
    """The basis without the functions that plate elements make of text, which do not pickle.

    They make them again on first use.
    """
    basis = copy(basis)
    basis.elem = without_functions(basis.elem)
    basis.dofs = copy(basis.dofs)
    basis.dofs.element = basis.elem
    return basis


def without_functions(element: Element) -> Element:
    """A copy of the element without the functions it has made of text, see `picklable`."""
    element = copy(element)
    parts = vars(element)
    if isinstance(element, ElementGlobal):
        parts.pop("V", None)
        parts.pop("_pbasis", None)
    if "elem" in parts:
        parts["elem"] = without_functions(parts["elem"])
    if "elems" in parts:
        parts["elems"] = type(parts["elems"])(map(without_functions, parts["elems"]))
    return element
