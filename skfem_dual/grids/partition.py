"""A plane region cut into polygonal cells: what boundary elements need to know of a grid."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import CellBasis, ElementQuad0, ElementTriP0, Mesh, MeshQuad1

from ..arguments import checked_array, checked_indices, checked_instance
from ..errors import MeshError
from ..kernels.once import ReadOnly, computed_once, remember
from .checks import cell_conditions, check_type, triangulation_conditions
from .corners import Corners, barycentres
from .lattice import Lattice
from .planar import covered_twice, cross, directed_sides, hanging
from .polygons import Polygons, readonly
from .report import Condition, require


@dataclass(frozen=True, eq=False, repr=False)
class Partition(ReadOnly):
    """Cells, the ribs between them and the node that belongs to each cell.

    Parameters
    ----------
    polygons : Polygons
        The cells.
    facets : (2, nribs) array of int
        End points of each rib, indices into ``polygons.p``.
    f2c : (2, nribs) array of int
        Cells to the left and to the right of each rib, -1 outside.
    nodes : (2, ncells) array of float
        Node of the dual grid in each cell: where ``collocation="node"`` collocates.
    boundary : (nribs,) array of int
        Facet of the mesh on whose boundary each rib lies, -1 for ribs inside.

    Raises
    ------
    TypeError, ValueError
        If something is no `Polygons` or no array of numbers, or some are masked.
    MeshError
        If numbers are out of range, or lengths do not agree.
    """

    polygons: Polygons
    facets: ndarray
    f2c: ndarray
    nodes: ndarray
    boundary: ndarray

    def __post_init__(self) -> None:
        checked_instance("polygons", self.polygons, Polygons)
        ribs, n = np.shape(self.f2c)[-1:] or (0,), len(self.polygons)
        for name, size, shape, least in (
            ("facets", self.polygons.p.shape[1], (2, *ribs), 0),
            ("f2c", n, (2, *ribs), -1),
            ("boundary", np.iinfo(np.int32).max, ribs, -1),
        ):
            value = checked_indices(
                name, getattr(self, name), size, shape, least=least, error=MeshError
            )
            object.__setattr__(self, name, readonly(value, np.int32))
        if (self.f2c[0] < 0).any():
            raise MeshError(
                "expected a cell on the left of every rib, f2c[0], and -1 only on the right of "
                f"those on the boundary; rib {np.argmin(self.f2c[0])} has none. Remedy: turn it"
            )
        nodes = checked_array("nodes", self.nodes, (2, n), error=MeshError)
        object.__setattr__(self, "nodes", readonly(nodes, float))

    def __len__(self) -> int:
        return len(self.polygons)

    def __repr__(self) -> str:
        return (
            f"<skfem_dual Partition object>\n  Number of cells: {len(self)}\n"
            f"  Number of ribs: {self.facets.shape[1]}"
        )

    @property
    def areas(self) -> ndarray:
        """Area of each cell."""
        return self.polygons.areas

    @property
    def centroids(self) -> ndarray:
        """Area centroid of each cell, shape (2, ncells)."""
        return self.polygons.centroids

    @computed_once
    def centre(self) -> ndarray:
        """Centroid of all cells together, shape (2,)."""
        return self.centroids @ self.areas / self.areas.sum()

    @computed_once
    def extent(self) -> float:
        """The longer side of the rectangle along the axes around all cells."""
        return float(np.ptp(self.polygons.p, axis=1).max())

    @computed_once
    def neighbours(self) -> ndarray:
        """Pairs of cells with a rib between them, shape (2, k)."""
        return readonly(self.f2c[:, self.f2c[1] >= 0])

    def across(self, marked: ndarray) -> ndarray:
        """Pairs of neighbours of which one is marked, by a mask of cells (n,); shape (2, k)."""
        sides = self.neighbours
        return sides[:, marked[sides[0]] != marked[sides[1]]]

    def parts(self, marked: ndarray) -> ndarray:
        """Numbers of the parts that marked cells make beside each other, (n,) array of int."""
        pairs = self.neighbours[:, marked[self.neighbours].all(axis=0)]
        n = len(self)
        beside = coo_array((np.ones(pairs.shape[1]), pairs), (n, n))
        return connected_components(beside, directed=False)[1]

    def ends(self, ribs: ndarray) -> tuple[ndarray, ndarray]:
        """Both ends of some ribs, each of shape (2, k); their cells are to the left."""
        begin, end = self.facets[:, ribs]
        return self.polygons.p.take(begin, axis=1), self.polygons.p.take(end, axis=1)

    @computed_once
    def lattice(self) -> Lattice | None:
        """The regular grid the cells are on; None if there is none."""
        return Lattice.detect(self.polygons)

    @classmethod
    def from_mesh(cls, mesh: Mesh) -> "Partition":
        """The triangles or the convex quadrilaterals of a mesh as cells.

        Quadrilaterals may be degenerate, as in the middle of a polar grid.

        Raises
        ------
        TypeError
            If the mesh is neither a MeshTri nor a MeshQuad.
        MeshError
            If it does not cut a plane region into cells.
        """
        lattice = None
        if type(mesh) is MeshQuad1:
            require(cell_conditions(mesh))
            lattice = Lattice.of(mesh.p[:, mesh.t.T])
            if lattice is None:  # else each cell is a rectangle in a place of its own
                require(_quadrilateral_conditions(mesh))
        elif isinstance(mesh, Mesh) and mesh.elem.refdom.nnodes == 4 and mesh.dim() == 2:
            raise MeshError(
                f"expected straight quadrilaterals (MeshQuad), got {type(mesh).__name__}. "
                "Remedy: MeshQuad.from_mesh(mesh), of straight sides"
            )
        else:
            check_type(mesh)
            require(triangulation_conditions(Corners(mesh)))
        polygons = Polygons.from_cells(mesh.p, mesh.t)
        a, b = (mesh.p[:, node] for node in mesh.facets)
        inside = polygons.centroids[:, mesh.f2t[0]] - a
        on_left = cross(b - a, inside) >= 0
        partition = cls(
            polygons,
            np.where(on_left, mesh.facets, mesh.facets[::-1]),
            mesh.f2t,
            polygons.centroids if mesh.t.shape[0] == 4 else barycentres(mesh),
            np.where(mesh.f2t[1] == -1, np.arange(mesh.nfacets), -1),
        )
        remember(partition, "lattice", lattice)
        return partition

    @classmethod
    def from_basis(cls, basis: CellBasis) -> "Partition":
        """The cells on which the functions of ``basis`` are constant.

        Parameters
        ----------
        basis : CellwiseBasis or CellBasis
            ``dual.basis()``, ``dual.primal_basis()``, ``CellBasis(mesh, ElementTriP0())`` or
            ``CellBasis(mesh, ElementQuad0())``; cell ``i`` is that of DOF ``i``.

        Raises
        ------
        TypeError
            If the basis does not consist of constants on cells.
        MeshError
            If its cells are not those of its whole mesh, or the mesh has faults.
        """
        own = getattr(basis, "partition", None)
        if isinstance(basis, CellBasis) and isinstance(own, Partition):
            partition = own
        elif isinstance(basis, CellBasis) and isinstance(basis.elem, (ElementTriP0, ElementQuad0)):
            dofs = basis.dofs.element_dofs
            if not np.array_equal(dofs, np.arange(basis.mesh.nelements)[None]):
                raise MeshError(
                    "expected one DOF for every cell, in the order of the mesh. Remedy: leave out "
                    "dofs=, or use DualMesh.basis() for cells that gather triangles"
                )
            partition = cls.from_mesh(basis.mesh)
        else:
            what = type(basis).__name__
            if isinstance(basis, CellBasis):
                what += f" of {type(basis.elem).__name__}"
            raise TypeError(
                "expected a basis of piecewise constants (DualMesh.basis(), or a CellBasis of "
                f"ElementTriP0 or ElementQuad0), got {what}"
            )
        if basis.tind is not None and len(np.unique(basis.tind)) != basis.mesh.nelements:
            raise MeshError(
                f"expected a basis on all {basis.mesh.nelements} elements of its mesh, got "
                f"{len(basis.tind)}. Remedy: restrict the mesh instead, mesh.restrict(elements)"
            )
        return partition


def _quadrilateral_conditions(mesh: MeshQuad1) -> Iterator[Condition]:
    v = mesh.p[:, mesh.t]
    onward, back = np.roll(v, -1, axis=1) - v, np.roll(v, 1, axis=1) - v
    turns = cross(onward, back)
    size = np.max(np.ptp(v, axis=1), axis=0) ** 2
    one_sense = (turns >= -1e-14 * size).all(axis=0) | (turns <= 1e-14 * size).all(axis=0)
    yield Condition(
        "convex quadrilaterals of positive area",
        "quadrilateral",
        np.nonzero(~one_sense | (np.abs(turns.sum(axis=0)) <= 1e-13 * size))[0],
        "order the vertices around each cell; split cells that are not convex into triangles",
    )
    yield Condition(
        "facets shared by at most two quadrilaterals",
        "facet",
        np.nonzero(np.bincount(mesh.t2f.ravel()) > 2)[0],
        "remove the cells lying on top of others; give each cell of a polar grid "
        "its own node in the middle",
    )
    start, end = (mesh.p[:, node] for node in mesh.facets)
    long = np.hypot(*(end - start)) > 1e-12 * np.sqrt(size.max())
    inner = np.nonzero(long & (mesh.f2t[1] != -1))[0]
    along = (end - start)[:, inner]
    middles = v.mean(axis=1)
    # signs, as products of areas leave the range of numbers
    one, other = (
        np.sign(cross(along, middles[:, k] - start[:, inner])) for k in mesh.f2t[:, inner]
    )
    yield Condition(
        "the two quadrilaterals of a facet on different sides of it",
        "facet",
        inner[one * other >= 0],
        "the mesh folds over itself there: remove or remesh the cells",
    )
    outer = np.nonzero(long & (mesh.f2t[1] == -1))[0]
    facets, inside = directed_sides(mesh, outer)
    yield Condition(
        "no hanging nodes, which lie on a facet of a quadrilateral beside",
        "node",
        hanging(mesh.p, facets, mesh.f2t[0, outer]),
        "refine the cell beside as well, or use triangles, cut there",
    )
    yield Condition(
        "no place to be covered twice",
        "facet",
        outer[covered_twice(mesh.p, facets, inside)],
        "parts of the mesh with these boundary facets overlap: remove or move one",
    )
