"""Cells of a partition cut into triangles, on which fields inside the cells live."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.spatial import cKDTree
from skfem import CellBasis, Mesh

from ..kernels.once import computed_once
from .cellwise import CellwiseBasis
from .corners import signed_areas
from .dual_mesh import DualMesh
from .polygons import readonly


@dataclass(frozen=True, eq=False)
class Fan:
    """Triangles that fill cells of a partition, all or some.

    Attributes
    ----------
    p : (2, npoints) array of float
        Points, among them the vertices of the triangles; the nodes of the mesh come first.
    t : (3, m) array of int
        The triangles, counter-clockwise.
    cell : (m,) array of int
        Cell of each triangle, ascending.
    interpolation : (npoints, nnodes) csr_matrix
        Takes values at the nodes of the mesh to the vertices of the triangles, by linear
        interpolation. Rows of other points may be empty.
    """

    p: ndarray
    t: ndarray
    cell: ndarray
    interpolation: csr_matrix

    @classmethod
    def from_basis(cls, basis: CellBasis, cells: ndarray | None = None) -> "Fan":
        """Of a basis that is a partition, see `Partition.from_basis`; of ``cells`` only."""
        if not isinstance(basis, CellwiseBasis):
            return cls.from_mesh(basis.mesh, cells)
        if basis.grid == "dual":
            return cls.from_dual(basis.dual, cells)
        return cls.from_mesh(basis.dual.mesh, cells)

    @classmethod
    def from_dual(cls, dual: DualMesh, cells: ndarray | None = None) -> "Fan":
        """Dual cells, all or some, consist of triangles of the common refinement."""
        mesh = dual.mesh
        n, nf, m = len(dual), mesh.nfacets, mesh.nelements
        wanted = np.full(n, cells is None)
        if cells is not None:
            wanted[cells] = True
        elements = np.nonzero(wanted[mesh.t].any(axis=0))[0]
        t = dual.refined_triangles(elements)
        t = t[:, wanted[t[0]]]  # the first vertex is the node in the cell
        cell = t[0]
        facets, nodes = np.unique(mesh.t2f[:, elements]), np.unique(mesh.t[:, elements])
        a, b = mesh.p[:, mesh.facets[:, facets]].swapaxes(0, 1)
        s = np.hypot(*(dual.crossings[:, facets] - a)) / np.hypot(*(b - a))
        points = np.concatenate([nodes, np.tile(n + facets, 2), np.tile(n + nf + elements, 3)])
        given = np.concatenate(
            [nodes, mesh.facets[:, facets].ravel(), mesh.t[:, elements].ravel()]
        )
        shares = np.concatenate([np.ones(len(nodes)), 1 - s, s, np.full(3 * len(elements), 1 / 3)])
        matrix = coo_matrix((shares, (points, given)), shape=(n + nf + m, n))
        return cls._sorted(dual.refinement_nodes, t, cell, matrix)

    @classmethod
    def from_mesh(cls, mesh: Mesh, cells: ndarray | None = None) -> "Fan":
        """Triangles or quadrilaterals, all or some, cut around the mean of their vertices."""
        k, m = mesh.t.shape
        n = mesh.p.shape[1]
        cells = np.arange(m) if cells is None else np.asarray(cells)
        own = mesh.t[:, cells]
        nodes, middle = np.unique(own), n + cells
        p = np.hstack([mesh.p, mesh.p[:, mesh.t].mean(axis=1)])
        t = np.hstack([[own[i], own[(i + 1) % k], middle] for i in range(k)])
        points = np.concatenate([nodes, np.tile(middle, k)])
        given = np.concatenate([nodes, own.ravel()])
        shares = np.concatenate([np.ones(len(nodes)), np.full(k * len(cells), 1 / k)])
        matrix = coo_matrix((shares, (points, given)), shape=(n + m, n))
        return cls._sorted(p, t, np.tile(cells, k), matrix)

    @classmethod
    def _sorted(cls, p: ndarray, t: ndarray, cell: ndarray, matrix: csr_matrix) -> "Fan":
        areas = signed_areas(p, t)
        t = np.where(areas < 0, t[[0, 2, 1]], t)
        # quadrilaterals in the middle of a polar grid have sides without length
        full = np.abs(areas) > 1e-14 * np.bincount(cell, np.abs(areas))[cell]
        order = np.argsort(cell[full], kind="stable")
        return cls(
            readonly(p),
            readonly(t[:, full][:, order], np.int32),
            readonly(cell[full][order], np.int32),
            matrix.tocsr(),
        )

    @computed_once
    def areas(self) -> ndarray:
        """Area of each triangle."""
        return readonly(signed_areas(self.p, self.t))

    @computed_once
    def starts(self) -> ndarray:
        """Triangles of cell ``i``, up to the last that has some, are those from ``starts[i]`` to
        ``starts[i + 1]``."""
        return readonly(np.searchsorted(self.cell, np.arange(self.cell[-1] + 2)))

    def coordinates(self, triangle: ndarray, x: ndarray) -> ndarray:
        """Barycentric coordinates of points in triangles, one each; shape (3, m)."""
        v = self.p[:, self.t[:, triangle]] - x[:, None]
        onward, last = np.roll(v, -1, axis=1), np.roll(v, -2, axis=1)
        return (onward[0] * last[1] - onward[1] * last[0]) / (2 * self.areas[triangle])

    def locate(self, x: ndarray) -> ndarray:
        """Triangle that contains each point of shape (2, m), -1 outside all of them."""
        v = self.p[:, self.t]
        middle = v.mean(axis=1)
        # a little more than the farthest vertex: points on the boundary are inside
        reach = 1.000001 * np.hypot(*(v - middle[:, None])).max(axis=0)
        near = cKDTree(x.T).query_ball_point(middle.T, reach)
        triangle = np.repeat(np.arange(len(near)), [len(points) for points in near])
        point = np.concatenate([*near, np.empty(0)]).astype(int)
        inside = self.coordinates(triangle, x[:, point]).min(axis=0)
        deepest = np.full(x.shape[1], -1)
        order = np.argsort(inside)  # the triangle deepest around a point wins
        order = order[inside[order] > -1e-9]
        deepest[point[order]] = triangle[order]
        return deepest
