"""Piecewise constants on the cells of a couple of dual grids, as an skfem basis."""

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy import ndarray
from skfem import (
    CellBasis,
    Dofs,
    Element,
    ElementQuad1,
    ElementTriP0,
    ElementTriP1,
    FacetBasis,
    Mesh,
    MeshTri,
)

from ..arguments import (
    checked_array,
    checked_choice,
    checked_indices,
    checked_instance,
    checked_integer,
    checked_mask,
    checked_points,
)
from ..kernels.once import computed_once
from ..messages import shown
from .dual_mesh import DualMesh
from .mappings import own_mapping
from .partition import Partition

#: what scikit-fem finds of a tag or a function
Found = Callable[[Any], ndarray]

#: highest order of the quadrature rules of scikit-fem on triangles, and of any use on facets
HIGHEST, MOST_ON_FACETS = 19, 100


class CellwiseBasis(CellBasis):
    """Piecewise constants on dual cells or on triangles over the common refinement.

    The DOF of a triangle of the refinement is the number of its cell, so everything scikit-fem
    does with a `CellBasis` works: forms, `project`, `interpolate`, `interpolator`, `plot`.
    Bases of both grids share their quadrature points and combine in one form. Common refinement
    and quadrature are made when they are first asked for: boundary elements need neither.

    Parameters
    ----------
    dual : DualMesh
        The couple of grids.
    grid : {"dual", "primal"}
        Whether the functions are constant on dual cells or on triangles.
    intorder : int, optional
        Order of the quadrature on the common refinement.
    quadrature : tuple of arrays, optional
        Points and weights on the reference triangle, instead of ``intorder``.
    elements : optional
        Subset of the triangles of the common refinement, in any form skfem takes, or a
        mask.

    Raises
    ------
    TypeError, ValueError
        If an argument is something else than what it must be, or names a triangle or a subdomain
        that does not exist.

    Examples
    --------
    >>> from skfem import BilinearForm, MeshTri
    >>> dual = DualMesh.from_mesh(MeshTri().refined(2))
    >>> overlap = BilinearForm(lambda u, v, w: u * v).assemble(dual.primal_basis(), dual.basis())
    >>> overlap.shape
    (25, 32)
    >>> bool(np.allclose(overlap.sum(axis=1).ravel(), dual.areas))
    True
    """

    def __init__(
        self,
        dual: DualMesh,
        grid: Literal["dual", "primal"] = "dual",
        *,
        intorder: int | None = None,
        quadrature: tuple[ndarray, ndarray] | None = None,
        elements: Any = None,
    ):
        checked_instance("dual", dual, DualMesh, "DualMesh.from_mesh(mesh)")
        checked_choice("grid", grid, ("dual", "primal"))
        if intorder is not None:
            intorder = checked_integer("intorder", intorder, at_least=0, at_most=HIGHEST)
        if quadrature is not None:
            quadrature = checked_quadrature(quadrature)
        self.dual = dual
        self.grid = grid
        self.elem = ElementTriP0()
        self._deferred = intorder, quadrature
        if elements is not None or quadrature is not None:
            self._set_up(elements)
            self.__dict__["_ready"] = True

    @computed_once
    def _ready(self) -> bool:
        self._set_up()
        return True

    def _set_up(self, elements: Any = None) -> None:
        """What a `CellBasis` consists of."""
        intorder, quadrature = self._deferred
        mesh = self.dual.refinement
        every = mesh.nelements, mesh.subdomains
        elements = subset("elements", elements, *every, mesh.normalize_elements)
        dofs = Dofs(mesh, self.elem)
        own = self.grid == "dual"
        cells = self.dual.refinement_cells if own else np.arange(mesh.nelements) // 6
        dofs.interior_dofs = dofs.element_dofs = np.array(cells, dtype=np.int32)[None]
        dofs.N = self.N
        super().__init__(
            mesh,
            self.elem,
            mapping=own_mapping(mesh),
            intorder=intorder,
            quadrature=quadrature,
            elements=elements,
            dofs=dofs,
            disable_doflocs=True,
        )
        self.doflocs = np.array(self.partition.centroids)

    def __getattr__(self, name: str) -> Any:
        # only asked for what is not there yet
        if not name.startswith("_") and "_deferred" in self.__dict__ and self._ready:
            if name in self.__dict__:
                return self.__dict__[name]
            if isinstance(getattr(type(self), name, None), property):  # that raised this error
                return object.__getattribute__(self, name)
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @computed_once
    def basis(self) -> list:
        """Values of the basis functions at the quadrature points."""
        self._ready  # noqa: B018
        return self.__dict__["basis"]

    @property
    def N(self) -> int:
        """Number of cells."""
        return len(self.partition)

    @property
    def partition(self) -> Partition:
        """The cells, in the order of the DOFs."""
        return self.dual.partition if self.grid == "dual" else self.dual.primal_partition

    def with_element(self, elem: Element) -> CellBasis:
        """A basis of other elements on the common refinement, with the same quadrature.

        For ElementTriP0 it is this basis, not constants on the triangles of the refinement.

        Raises
        ------
        TypeError
            If ``elem`` is no element.
        """
        checked_instance("elem", elem, Element)
        if isinstance(elem, ElementTriP0):
            return self.with_elements(self.tind)
        return CellBasis(
            self.mesh, elem, mapping=self.mapping, quadrature=self.quadrature, elements=self.tind
        )

    def with_elements(self, elements: Any = None) -> "CellwiseBasis":
        """This basis on a subset of the triangles of the common refinement; same numbering.

        Parameters
        ----------
        elements : optional
            The triangles, in any form skfem takes, or a mask; all by default.

        Raises
        ------
        TypeError, ValueError
            If they are something else, none, or do not exist.
        """
        return CellwiseBasis(self.dual, self.grid, quadrature=self.quadrature, elements=elements)

    def boundary(
        self,
        facets: Any = None,
        intorder: int | None = None,
        quadrature: tuple[ndarray, ndarray] | None = None,
    ) -> FacetBasis:
        """Traces on the boundary of the domain, with the same DOFs.

        Parameters
        ----------
        facets : optional
            Facets of the common refinement, in any form skfem takes, or a mask; by default all
            on the boundary.
        intorder, quadrature : optional
            As of the basis.

        Raises
        ------
        NotImplementedError
            Of a basis on a subset of the triangles.
        TypeError, ValueError
            If facets do not exist or the quadrature is none.
        """
        if self.tind is not None:
            raise NotImplementedError(
                "boundary() of a basis on a subset of elements is not supported. "
                "Remedy: take the boundary of the whole basis and name its facets"
            )
        every = self.mesh.nfacets, self.mesh.boundaries
        facets = subset("facets", facets, *every, self.mesh.normalize_facets)
        if intorder is not None:
            intorder = checked_integer("intorder", intorder, at_least=0, at_most=MOST_ON_FACETS)
        if quadrature is not None:
            quadrature = checked_quadrature(quadrature, 1)
        return FacetBasis(
            self.mesh,
            self.elem,
            mapping=own_mapping(self.mesh),
            facets=facets,
            intorder=intorder,
            quadrature=quadrature,
            dofs=self.dofs,
        )


def subset(name: str, value: Any, size: int, tags: dict[str, ndarray] | None, found: Found) -> Any:
    """Indices of some elements or facets, in any form scikit-fem takes, or those of a mask.

    ``found`` are those of a tag or a function. Oriented boundaries stay so.
    """
    if value is None:
        return None
    indices = _indices(name, value, size, tags or {}, found)
    if indices.size == 0:
        raise ValueError(f"expected some of the {size} for {name}, got none")
    return indices


def _indices(name: str, value: Any, size: int, tags: dict[str, ndarray], found: Found) -> ndarray:
    if isinstance(value, str):
        if value not in tags:
            raise ValueError(f"expected tags among {sorted(tags)} for {name}, got {shown(value)}")
        return found(value)
    if callable(value) and not isinstance(value, type):
        return found(partial(_one_each, name, value))
    if isinstance(value, ndarray):
        if value.dtype == bool:
            return np.flatnonzero(checked_mask(name, value, (size,)))
        checked_indices(name, value, size)
        return value
    if isinstance(value, (list, tuple, set)):
        value = list(value)
        kinds = str, list, tuple, set, ndarray
        if any(isinstance(part, kinds) or callable(part) for part in value):
            parts = [[None] if part is None else part for part in value]
            own = [_indices(name, part, size, tags, found) for part in parts]
            return np.unique(np.concatenate(own))
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    return np.unique(checked_indices(name, [value] if whole else value, size))


def _one_each(name: str, function: Callable[[ndarray], Any], midpoints: ndarray) -> ndarray:
    """Whether a function takes the element or facet about each midpoint."""
    taken, shape = np.asarray(function(midpoints)), midpoints.shape[1:]
    if taken.shape != shape:
        raise ValueError(
            f"expected a function that returns a mask of shape {shape} for midpoints of shape "
            f"{midpoints.shape} for {name}, got shape {taken.shape}"
        )
    return taken


def checked_quadrature(value: Any, dim: int = 2) -> tuple[ndarray, ndarray]:
    """Points (dim, n) and weights (n,) of a rule on the reference triangle or interval."""
    try:
        points, weights = value
    except (TypeError, ValueError):
        raise TypeError(
            f"expected points and weights for quadrature, got {shown(value)}"
        ) from None
    points = checked_points("quadrature[0]", points, dim, least=1)
    return points, checked_array("quadrature[1]", weights, points.shape[1:])


def nodal_mesh(basis: CellBasis) -> Mesh:
    """The mesh whose nodes or cells the functions of ``basis`` belong to."""
    return basis.dual.mesh if isinstance(basis, CellwiseBasis) else basis.mesh


def nodal_values(basis: CellBasis, values: ndarray) -> tuple[CellBasis, ndarray]:
    """Values of cells as a continuous first-order field on the mesh.

    The nodes of dual cells take over the values of their cells; elsewhere a node takes the mean
    over the cells around it, weighted by area.

    Parameters
    ----------
    basis : CellBasis
        Piecewise constants, as for `RigidPunch`.
    values : (N,) or (k, N) array of float
        One value for each cell, or for each of the k vertices of each cell of the mesh, which dual
        cells are not.

    Returns
    -------
    basis : CellBasis
        ElementTriP1 or ElementQuad1 on the mesh.
    values : (nnodes,) array of float
        Its vector.

    Raises
    ------
    ValueError
        If there are not as many values.
    """
    values = np.asarray(values, dtype=float)
    mesh = nodal_mesh(basis)
    on_nodes = isinstance(basis, CellwiseBasis) and basis.grid == "dual"
    if values.shape != (basis.N,) and (on_nodes or values.shape != (len(mesh.t), basis.N)):
        raise ValueError(f"expected values of shape ({basis.N},), got {values.shape}")
    element = ElementTriP1() if isinstance(mesh, MeshTri) else ElementQuad1()
    nodal = CellBasis(mesh, element, mapping=own_mapping(mesh))
    if on_nodes:
        return nodal, values.copy()
    weights = np.broadcast_to(Partition.from_basis(basis).areas, mesh.t.shape)
    total = np.bincount(mesh.t.ravel(), (weights * values).ravel())
    return nodal, total / np.bincount(mesh.t.ravel(), weights.ravel())
