"""How the pressure varies from cell to cell, and so inside them beside the law of the edge.

With the mean pressure q and the law w of `EdgeWeights`, the pressure in a cell is::

    p = w / mean(w) (q + g . (x - y))

where y is the centroid of w, so that q remains the mean. The slope g follows from the cells
around, those that share a vertex: it is that of the plane through q / mean(w) of the cell, nearest
in the mean square to theirs, times mean(w). On cells that are not weighted w is constant.

Source: T. J. Barth and D. C. Jespersen, The design and application of upwind schemes on
unstructured meshes, AIAA Paper 89-0366 (1989), for linear functions from means of cells.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .edge_weights import EdgeWeights

#: eigenvalues of the moments of the cells around, over the greatest, below which there is no slope
ON_A_LINE = 1e-6


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of the pressure inside the n cells of a partition.

    Attributes
    ----------
    partition : Partition
        The cells.
    weights : EdgeWeights or None
        The law of the edge; None if w is constant in all cells.
    matrix : (2 n, n) csr_matrix
        Takes mean pressures to slopes along x of all cells, then along y.
    second_moments : (2, 2, n) array of float
        Integrals of ``w / mean(w)`` times products of the coordinates from y.
    """

    partition: Partition
    weights: EdgeWeights | None
    matrix: csr_matrix
    second_moments: ndarray

    @classmethod
    def from_weights(cls, weights: EdgeWeights) -> Self:
        """Of all cells, from those around them."""
        own, moments = weights.partition, second_moments(weights)
        return cls(own, weights, _slope_matrix(own, weights), readonly(moments))

    @classmethod
    def from_partition(cls, partition: Partition) -> Self:
        """Of cells in which w is constant."""
        xx, xy, yy = partition.polygons.second_moments
        moments = readonly(np.array([[xx, xy], [xy, yy]]))
        return cls(partition, None, _slope_matrix(partition, None), moments)

    @property
    def centroids(self) -> ndarray:
        """Those of w in the cells, shape (2, n)."""
        return self.partition.centroids if self.weights is None else self.weights.centroids

    @property
    def along(self) -> tuple[csr_matrix, csr_matrix]:
        """Its parts for the slopes along x, and along y, (n, n) each."""
        n = self.matrix.shape[1]
        return self.matrix[:n], self.matrix[n:]

    def of(self, pressure: ndarray) -> ndarray:
        """Slopes under mean pressures of shape (n,) or (n, k), shape (2, n) or (2, n, k)."""
        return (self.matrix @ pressure).reshape(2, *pressure.shape)

    def without(self, cells: ndarray) -> "Slopes":
        """With no slope in some cells, given as (n,) array of bool."""
        counts = np.diff(self.matrix.indptr)
        left_out = np.tile(cells, 2)
        kept = ~np.repeat(left_out, counts)
        starts = np.concatenate([[0], np.cumsum(np.where(left_out, 0, counts))])
        rows = self.matrix.data[kept], self.matrix.indices[kept], starts
        return replace(self, matrix=csr_matrix(rows, shape=self.matrix.shape))

    @computed_once
    def first_moments(self) -> ndarray:
        """Integrals of what unit pressures add by slopes, times x and y; shape (2, n)."""
        n = self.matrix.shape[1]
        ones = self.second_moments.reshape(2, 2 * n)
        return readonly((self.matrix.T @ ones.T).T)

    def lowest(self, pressure: ndarray) -> ndarray:
        """Least value of ``q + g . (x - y)`` in each cell, shape (n,) or (n, k): where it is
        negative the pressure changes its sign."""
        polygons = self.partition.polygons
        cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
        arm = polygons.p[:, polygons.indices] - self.centroids[:, cell]
        rise = np.einsum("iv...,iv->v...", self.of(pressure)[:, cell], arm)
        return pressure + np.minimum.reduceat(rise, polygons.offsets[:-1])


def _around(partition: Partition, weights: EdgeWeights | None) -> tuple[ndarray, ndarray]:
    """Pairs of cells that share a vertex, ascending in the first."""
    polygons = partition.polygons
    place = _places(partition)[polygons.indices]
    at = np.ones(len(place)), place, polygons.offsets
    vertices = csr_matrix(at, shape=(len(polygons), polygons.p.shape[1]))
    pairs = (vertices @ vertices.T).tocoo()
    cell, other = pairs.row, pairs.col
    keep = cell != other
    if weights is not None:
        # where the law of the edge is not known there, a weighted cell cannot compare itself
        keep &= ~(weights.weighted[cell] & np.isnan(weights.mean[other]))
    return cell[keep], other[keep]


def _places(partition: Partition) -> ndarray:
    """A number for the place of each vertex: the banks of a seam have the same places."""
    p = partition.polygons.p
    ends = np.unique(partition.facets[:, partition.f2c[1] == -1])
    near = 1e-10 * np.sqrt(partition.areas.sum())
    a, b = ends[cKDTree(p[:, ends].T).query_pairs(near, output_type="ndarray")].T
    if len(a) == 0:
        return np.arange(p.shape[1])
    same = csr_matrix((np.ones(len(a)), (a, b)), shape=(p.shape[1], p.shape[1]))
    return connected_components(same, directed=False)[1]


def _slope_matrix(partition: Partition, weights: EdgeWeights | None) -> csr_matrix:
    n, c = len(partition), partition.centroids
    cell, other = _around(partition, weights)
    arm, ratio = c[:, other] - c[:, cell], np.ones(len(cell))
    if weights is not None:
        weighted, y = weights.weighted[cell], weights.centroids
        arm = np.where(weighted, y[:, other] - y[:, cell], arm)
        ratio = np.where(weighted, weights.mean[cell] / weights.mean[other], 1.0)
    moments = np.array([[np.bincount(cell, a * b, n) for a in arm] for b in arm])
    shares = np.linalg.pinv(moments.transpose(2, 0, 1), rcond=ON_A_LINE, hermitian=True)
    share = np.einsum("kab,bk->ak", shares[cell], arm)
    own = [np.bincount(cell, s, n) for s in share]
    every = np.arange(n)
    rows = np.concatenate([cell, n + cell, every, n + every])
    columns = np.concatenate([other, other, every, every])
    values = np.concatenate([*(share * ratio), *(-s for s in own)])
    return csr_matrix((values, (rows, columns)), shape=(2 * n, n))


def second_moments(weights: EdgeWeights) -> ndarray:
    """Those of `Slopes`, of all cells."""
    areas, m = weights.partition.areas, weights.moments
    own = np.array([[2 * m[2, 0], m[1, 1]], [m[1, 1], 2 * m[0, 2]]])
    xx, xy, yy = weights.partition.polygons.second_moments
    off = weights.centroids - weights.partition.centroids
    return np.array([[xx, xy], [xy, yy]]) + own - areas * off[:, None] * off
