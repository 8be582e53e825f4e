"""The 1-type dual grid of a triangulation (Definition 2)."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from skfem import MeshTri
from skfem.generic_utils import OrientedBoundary

from ..arguments import checked_indices
from ..kernels.once import ReadOnly, computed_once, freeze
from .checks import array_conditions, check_type, dual_conditions, user_tags
from .corners import Corners, numbered
from .partition import Partition
from .polygons import Polygons, readonly
from .report import require

if TYPE_CHECKING:
    from .cellwise import CellwiseBasis

#: vertices of a triangle to which the six triangles of the common refinement in it belong
_PAIRS = [0, 1, 1, 2, 0, 2]


@dataclass(frozen=True, eq=False, repr=False)
class DualMesh(ReadOnly):
    """A triangulation together with its 1-type dual grid: one polygonal cell per node.

    The cell of an inner node joins the barycentres of the triangles around it directly; the
    cell of a boundary node ``P`` is the polygon ``P, D1, C1, ..., Cq, D2`` with the middles
    ``D1, D2`` of the two boundary facets (Section 3 of the paper, Fig. 3). These are not the
    median dual cells of finite volumes, which pass through the middle of every facet.

    Build it with `DualMesh.from_mesh`.

    Attributes
    ----------
    mesh : MeshTri
        The primal triangulation, a read-only copy.
    partition : Partition
        The dual cells; cell ``i`` belongs to node ``i`` of the mesh.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> dual = DualMesh.from_mesh(MeshTri().refined(3))
    >>> dual
    <skfem_dual DualMesh object>
      Cells (nodes of the triangulation): 81
      Triangles: 128, K_TV = 1.58
      Nodes: 192, ribs: 272
      Boundary nodes: 32, parts: 1, holes: 0
      Area: 1, of the cells: 0.002604 to 0.01563
    >>> bool(np.isclose(dual.areas.sum(), 1.0))
    True
    """

    mesh: MeshTri
    partition: Partition

    @classmethod
    def from_mesh(cls, mesh: MeshTri) -> "DualMesh":
        """The dual grid of any triangulation.

        Parameters
        ----------
        mesh : MeshTri
            Straight triangles, in either orientation; any number of holes and parts. Tags of
            boundaries and subdomains carry over to the common refinement.

        Raises
        ------
        TypeError
            If ``mesh`` is not a MeshTri.
        MeshError
            If it is not a triangulation (coordinates, indices, areas, facets or nodes at fault),
            or a facet is not crossed by its corresponded rib, as in Fig. 3c. The message names
            the first offenders and the remedy.
        """
        check_type(mesh)
        require(array_conditions(mesh))
        # skfem's meshes can be changed in place: own copy, derived data computed afresh
        mesh = replace(
            mesh,
            doflocs=np.array(mesh.p, dtype=float, order="C"),
            t=np.array(mesh.t, dtype=np.int32, order="C"),
            _boundaries=_own_tags(mesh.boundaries),
            _subdomains=_own_tags(mesh.subdomains),
        )
        corners = Corners(numbered(mesh))
        require(dual_conditions(corners))
        partition = _dual_partition(corners)
        # the mesh is kept: long integers of numpy, and columns that the cells of ribs have too
        mesh._t2f, mesh._facets = readonly(mesh.t2f, np.int32), partition.f2c[:, : mesh.nfacets]
        freeze(mesh)
        return cls(mesh, partition)

    def lines(self) -> list[str]:
        """The census of the grid, line by line."""
        parts, holes = self.topology
        return [
            f"Cells (nodes of the triangulation): {len(self)}",
            f"Triangles: {self.mesh.nelements}, K_TV = {self.K_TV:.2f}",
            f"Nodes: {self.p.shape[1]}, ribs: {self.facets.shape[1]}",
            f"Boundary nodes: {self.nboundary}, parts: {parts}, holes: {holes}",
            f"Area: {self.areas.sum():.4g}, of the cells: "
            f"{self.areas.min():.4g} to {self.areas.max():.4g}",
        ]

    def __repr__(self) -> str:
        return "\n  ".join(["<skfem_dual DualMesh object>", *self.lines()])

    def _repr_html_(self) -> str:
        from ..visuals.notebook import mesh_html

        return mesh_html(self)

    def __len__(self) -> int:
        return len(self.partition)

    @property
    def p(self) -> ndarray:
        """Nodes of the dual grid: barycentres, middles of boundary facets, boundary nodes."""
        return self.partition.polygons.p

    @property
    def polygons(self) -> Polygons:
        """The cells as polygons; polygon ``i`` contains node ``i`` of the mesh."""
        return self.partition.polygons

    @property
    def facets(self) -> ndarray:
        """Ribs of the dual grid, shape (2, nribs).

        Rib ``f`` is corresponded to facet ``f`` of the mesh; after these come the halves of the
        boundary facets, first those at the facets' first nodes, then those at their second.
        """
        return self.partition.facets

    @property
    def f2c(self) -> ndarray:
        """Cells to the left and to the right of each rib, -1 outside; shape (2, nribs)."""
        return self.partition.f2c

    @computed_once
    def corresponded(self) -> ndarray:
        """The primal facet each rib is corresponded to; -1 for ribs on the boundary."""
        facets = np.arange(self.facets.shape[1], dtype=np.int32)
        return readonly(np.where(facets < self.mesh.nfacets, facets, -1))

    @computed_once
    def crossings(self) -> ndarray:
        """Where each primal facet meets its corresponded rib, shape (2, nfacets); the middle of a
        boundary facet."""
        return Corners(self.mesh).crossings_of(np.arange(self.mesh.nfacets))

    @property
    def areas(self) -> ndarray:
        """Area of each dual cell."""
        return self.partition.areas

    @property
    def centroids(self) -> ndarray:
        """Area centroid of each dual cell, shape (2, ncells)."""
        return self.partition.centroids

    @property
    def nboundary(self) -> int:
        """Number of boundary nodes of the triangulation, N_b."""
        return (self.p.shape[1] - self.mesh.nelements) // 2

    @property
    def K_TV(self) -> float:
        """Number of triangles over number of dual cells (Section 4.2 of the paper)."""
        return self.mesh.nelements / len(self)

    @computed_once
    def topology(self) -> tuple[int, int]:
        """Number of parts and of holes of the domain."""
        n = len(self)
        joined = coo_matrix((np.ones(self.mesh.nfacets), self.mesh.facets), shape=(n, n))
        parts = int(connected_components(joined, directed=False)[0])
        return parts, parts - (n - self.mesh.nfacets + self.mesh.nelements)

    @computed_once
    def primal_partition(self) -> Partition:
        """The triangles as cells, their barycentres as nodes."""
        return Partition.from_mesh(self.mesh)

    @computed_once
    def refinement(self) -> MeshTri:
        """The common refinement of both grids, six triangles in every triangle.

        With the crossing ``X`` of a facet and its corresponded rib, the triangles ``(P, X, C)``
        refine the triangulation and the dual grid. Nodes: those of the mesh, the crossings in
        the order of the facets, the barycentres. Triangles ``6 j ... 6 j + 5`` lie in triangle
        ``j``; `refinement_cells` names their dual cells.
        """
        t = self.refined_triangles(np.arange(self.mesh.nelements))
        refinement = self._tagged(MeshTri(self.refinement_nodes, t))
        freeze(refinement)
        return refinement

    @property
    def refinement_nodes(self) -> ndarray:
        """Nodes of the common refinement, shape (2, k)."""
        return np.hstack([self.mesh.p, self.crossings, self.p[:, : self.mesh.nelements]])

    def some_refinement_nodes(self, numbers: ndarray) -> ndarray:
        """Those with the ``numbers``, ascending, only."""
        n, m = len(self), len(self) + self.mesh.nfacets
        a, b = np.searchsorted(numbers, [n, m]).tolist()
        crossings = Corners(self.mesh).crossings_of(numbers[a:b] - n)
        nodes = self.mesh.p.take(numbers[:a], axis=1)
        return np.hstack([nodes, crossings, self.p.take(numbers[b:] - m, axis=1)])

    def refined_triangles(self, elements: ndarray) -> ndarray:
        """Triangles of the common refinement in some triangles of the mesh, six in each."""
        mesh = self.mesh
        elements = checked_indices("elements", elements, mesh.nelements)
        crossing = len(self) + mesh.t2f.take(elements, axis=1)[[0, 0, 1, 1, 2, 2]]
        barycentre = np.broadcast_to(len(self) + mesh.nfacets + elements, crossing.shape)
        # vertices ascend as skfem wants them: its sorting leaves them in place
        node = mesh.t.take(elements, axis=1)[_PAIRS]
        t = np.stack([node, crossing, barycentre]).transpose(0, 2, 1)
        return np.ascontiguousarray(t.reshape(3, -1), dtype=np.int32)

    @computed_once
    def refinement_cells(self) -> ndarray:
        """Dual cell of each triangle of the common refinement."""
        return readonly(self.mesh.t[_PAIRS].T.ravel(), np.int32)

    def _tagged(self, refinement: MeshTri) -> MeshTri:
        """``refinement`` with the tags of the mesh."""
        mesh = self.mesh
        if mesh.subdomains:
            refinement = refinement.with_subdomains(
                {
                    name: (6 * np.asarray(tag)[:, None] + np.arange(6)).ravel()
                    for name, tag in mesh.subdomains.items()
                }
            )
        if mesh.boundaries:
            # columns of facets are in lexicographic order, so their keys ascend
            start, end = refinement.facets.astype(np.int64)
            keys = start * refinement.p.shape[1] + end
            boundaries = {}
            for name, tag in mesh.boundaries.items():
                facets = np.repeat(np.asarray(tag), 2)
                ends = mesh.facets[:, np.asarray(tag)].T.ravel().astype(np.int64)
                halves = np.searchsorted(keys, ends * refinement.p.shape[1] + len(self) + facets)
                if isinstance(tag, OrientedBoundary):
                    wanted = mesh.f2t[np.repeat(tag.ori, 2), facets]
                    ori = (refinement.f2t[0, halves] // 6 != wanted).astype(np.int32)
                    boundaries[name] = OrientedBoundary(halves, ori)
                else:
                    boundaries[name] = halves
            refinement = refinement.with_boundaries(boundaries)
        return refinement

    def basis(self, intorder: int | None = None) -> "CellwiseBasis":
        """Piecewise constants on the dual cells, as an skfem basis.

        Parameters
        ----------
        intorder : int, optional
            Order of the quadrature on the common refinement, from 0 to 19; skfem's choice for
            constants by default.

        Raises
        ------
        TypeError, ValueError
            If ``intorder`` is no whole number, or out of range.
        """
        from .cellwise import CellwiseBasis

        return CellwiseBasis(self, "dual", intorder=intorder)

    def primal_basis(self, intorder: int | None = None) -> "CellwiseBasis":
        """Piecewise constants on the triangles, with the quadrature points of `basis`.

        Parameters
        ----------
        intorder : int, optional
            As of `basis`.

        Raises
        ------
        TypeError, ValueError
            As `basis`.
        """
        from .cellwise import CellwiseBasis

        return CellwiseBasis(self, "primal", intorder=intorder)


def _own_tags(tags: dict[str, ndarray] | None) -> dict[str, ndarray] | None:
    nothing = np.empty(0, dtype=np.int32)  # an empty list is an array of floats
    own = user_tags(tags).items()
    return {
        name: np.array(tag, subok=True) if np.size(tag) else nothing for name, tag in own
    } or None


def _dual_partition(corners: Corners) -> Partition:
    """The dual cells of a mesh that satisfies `dual_conditions`."""
    mesh = corners.mesh
    n, m = mesh.p.shape[1], mesh.nelements
    boundary = mesh.boundary_facets()
    starts = np.nonzero(corners.twin == -1)[0]  # corner that starts each boundary facet
    starts = starts[np.argsort(corners.facet[starts])]
    onset = corners.node[starts]  # first node of each boundary facet, domain to the left
    opposite = mesh.facets[:, boundary].sum(axis=0) - onset
    # nodes: barycentres, middles of boundary facets, boundary nodes in the order of `onset`
    nb = len(boundary)
    middle, rank = m + np.arange(2 * nb, dtype=np.int32).reshape(2, -1)
    begins, ends = (mesh.p.take(end, axis=1) for end in mesh.facets[:, boundary])
    middles = begins + 0.5 * (ends - begins)
    p = np.hstack([corners.barycentres, middles, mesh.p.take(onset, axis=1)])

    on_boundary = np.zeros(n, dtype=bool)
    on_boundary[onset] = True
    sizes = np.bincount(corners.node, minlength=n) + 3 * on_boundary
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    indices = np.empty(offsets[-1], dtype=np.int32)
    place = offsets[corners.node] + 2 * on_boundary[corners.node] + corners.rank
    indices[place] = corners.triangle
    indices[offsets[onset]] = rank
    indices[offsets[onset] + 1] = middle
    indices[offsets[opposite + 1] - 1] = middle

    # counter-clockwise around `left` the rib runs from the triangle before the facet to the
    # one after it, which is the one whose corner at `left` starts the facet
    left, right = mesh.facets
    end = np.full(mesh.nfacets, -1, dtype=np.int32)
    begin = end.copy()
    at_left = corners.node == left[corners.facet]
    end[corners.facet[at_left]] = corners.triangle[at_left]
    begin[corners.facet[~at_left]] = corners.triangle[~at_left]
    end[boundary] = np.where(end[boundary] == -1, middle, end[boundary])
    begin[boundary] = np.where(begin[boundary] == -1, middle, begin[boundary])

    node = np.empty(n, dtype=np.int32)
    node[onset] = rank
    forward = onset == left[boundary]  # the domain lies to the left of the facet's direction
    halves = []
    for corner, away in ((left[boundary], forward), (right[boundary], ~forward)):
        ends = np.stack([node[corner], middle])
        halves.append(np.where(away, ends, ends[::-1]))
    facets = np.hstack([np.stack([begin, end]), *halves])
    outside = np.full(2 * nb, -1, np.int32)
    f2c = np.hstack([mesh.facets, np.stack([mesh.facets[:, boundary].ravel(), outside])])
    on = np.concatenate([np.full(mesh.nfacets, -1, np.int32), boundary, boundary], dtype=np.int32)
    return Partition(Polygons(p, indices, offsets), facets, f2c, mesh.p, on)
