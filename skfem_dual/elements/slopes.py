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
from ..kernels.compiled import compiled, inputs
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
        moments = partition.polygons.second_moments[[0, 1, 1, 2]].reshape(2, 2, -1)
        return cls(partition, None, _slope_matrix(partition, None), readonly(moments))

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
        """Least value of ``q + g . (x - y)`` in each cell, shape (n,): where it is negative the
        pressure changes its sign."""
        polygons = self.partition.polygons
        cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
        arm = polygons.p[:, polygons.indices] - self.centroids[:, cell]
        rise = np.sum(self.of(pressure)[:, cell] * arm, axis=0)
        return pressure + np.minimum.reduceat(rise, polygons.offsets[:-1])


def _around(partition: Partition, weights: EdgeWeights | None) -> tuple[ndarray, ndarray]:
    """Cells that share a vertex with each, itself among them, ascending; where each list begins,
    and the lists."""
    polygons = partition.polygons
    place = _places(partition)[polygons.indices]
    at = np.ones(len(place), dtype=bool), place, polygons.offsets
    vertices = csr_matrix(at, shape=(len(polygons), polygons.p.shape[1]))
    around = vertices @ vertices.T
    around.sort_indices()
    starts, others = around.indptr, around.indices
    if weights is not None:
        # where the law of the edge is not known there, a weighted cell cannot compare itself
        left_out = np.isnan(weights.mean)[others]
        left_out &= np.repeat(weights.weighted, np.diff(starts))
        if left_out.any():
            starts = np.concatenate([[0], np.cumsum(~left_out)])[starts]
            others = others[~left_out]
    return starts, others


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
    starts, others = _around(partition, weights)
    law = c, np.zeros(n, dtype=bool), np.ones(n)
    if weights is not None:
        law = weights.centroids, weights.weighted, weights.mean
    values = np.empty((2, len(others)))
    _fit_planes(*inputs(starts, others, c, *law), values)
    rows = np.append(starts, starts[-1] + starts[1:])
    return csr_matrix((values.ravel(), np.tile(others, 2), rows), shape=(2 * n, n))


@compiled
def _fit_planes(starts, others, c, y, weighted, mean, values):
    """Slopes of planes through each cell, nearest to those around it, by unit mean pressures."""
    for i in range(starts.shape[0] - 1):
        middles = y if weighted[i] else c
        xx, xy, yy = 0.0, 0.0, 0.0
        for at in range(starts[i], starts[i + 1]):
            j = others[at]
            dx, dy = middles[0, j] - middles[0, i], middles[1, j] - middles[1, i]
            xx, xy, yy = xx + dx * dx, xy + dx * dy, yy + dy * dy
        # the inverse of the moments, by their eigenvalues
        mid, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
        most = mid + half
        least = (xx * yy - xy * xy) / most if most > 0.0 else 0.0
        if least > ON_A_LINE * most:
            det = most * least
            xx, xy, yy = yy / det, -xy / det, xx / det
        elif most > 0.0:
            over = most * (2 * half)
            xx, xy, yy = (xx - mid + half) / over, xy / over, (yy - mid + half) / over
        own, along, across = 0, 0.0, 0.0
        for at in range(starts[i], starts[i + 1]):
            j = others[at]
            own = at if j == i else own
            dx, dy = middles[0, j] - middles[0, i], middles[1, j] - middles[1, i]
            u, v = xx * dx + xy * dy, xy * dx + yy * dy
            ratio = mean[i] / mean[j] if weighted[i] else 1.0
            values[0, at], values[1, at] = u * ratio, v * ratio
            along, across = along + u, across + v
        values[0, own], values[1, own] = -along, -across


def second_moments(weights: EdgeWeights) -> ndarray:
    """Those of `Slopes`, of all cells."""
    cells, m = weights.cells, weights.moments
    out = weights.partition.polygons.second_moments[[0, 1, 1, 2]].reshape(2, 2, -1)
    off = weights.centroids[:, cells] - weights.partition.centroids[:, cells]
    out[..., cells] += np.array([[2 * m[2, 0], m[1, 1]], [m[1, 1], 2 * m[0, 2]]])
    out[..., cells] -= weights.partition.areas[cells] * off[:, None] * off
    return out
