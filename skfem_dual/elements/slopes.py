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
from ..kernels.compiled import compiled, inlined, inputs
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
        own = weights.partition
        return cls(own, weights, _slope_matrix(own, weights), weights.second_moments)

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
        """Least value of ``q + g . (x - y)`` in each cell, shape (n,) or (n, k): where it is
        negative the pressure changes its sign."""
        polygons = self.partition.polygons
        cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
        arm = polygons.p[:, polygons.indices] - self.centroids[:, cell]
        rise = np.einsum("iv...,iv->v...", self.of(pressure)[:, cell], arm)
        return pressure + np.minimum.reduceat(rise, polygons.offsets[:-1])


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
    n, polygons = len(partition), partition.polygons
    vertices = inputs(_places(partition)[polygons.indices], polygons.offsets)
    y, mean, weighted = partition.centroids, np.ones(n), np.zeros(n, dtype=bool)
    if weights is not None:
        weighted, mean = weights.weighted, weights.mean
        y = weights.centroids
    given = inputs(partition.centroids, y, mean, weighted)
    starts, columns, values = _rows(*vertices, polygons.p.shape[1], *given)
    starts = np.append(starts, starts[1:] + len(columns))
    return csr_matrix((values.ravel(), np.tile(columns, 2), starts), shape=(2 * n, n))


@compiled
def _rows(places, offsets, npoints, centroids, y, mean, weighted):
    """Rows of the matrix of slopes, of which those along x and along y have the same columns."""
    starts = np.zeros(offsets.shape[0], np.int64)
    columns = _around(places, offsets, npoints, mean, weighted, starts)
    values = np.empty((2, len(columns)))
    _fill(columns, starts, centroids, y, mean, weighted, values)
    return starts, columns, values


@compiled
def _around(places, offsets, npoints, mean, weighted, starts):
    """Each cell and those that share a vertex with it, ascending; the first of each in ``starts``.

    Where the law of the edge is not known in them, a weighted cell cannot compare itself.
    """
    n = offsets.shape[0] - 1
    first, of_cell = np.zeros(npoints + 1, np.int64), np.empty(places.shape[0], np.int64)
    for place in places:
        first[place + 1] += 1
    for k in range(npoints):
        first[k + 1] += first[k]
    at = first.copy()
    for j in range(n):
        for place in places[offsets[j] : offsets[j + 1]]:
            of_cell[at[place]] = j
            at[place] += 1
    columns, seen = np.empty(0, np.int32), np.full(n, -1)
    for room in (False, True):  # counted before they are put
        if room:
            for j in range(n):
                starts[j + 1] += starts[j]
            columns, at, seen[:] = np.empty(starts[n], np.int32), starts.copy(), -1
        for j in range(n):
            for place in places[offsets[j] : offsets[j + 1]]:
                for i in of_cell[first[place] : first[place + 1]]:
                    if seen[i] == j:
                        continue
                    seen[i] = j
                    if i != j and weighted[i] and np.isnan(mean[j]):
                        continue
                    if room:
                        columns[at[i]] = j
                        at[i] += 1
                    else:
                        starts[i + 1] += 1
    return columns


@compiled
def _fill(columns, starts, centroids, y, mean, weighted, values):
    """Values of the matrix of slopes along x and along y."""
    for i in range(starts.shape[0] - 1):
        begin, end = starts[i], starts[i + 1]
        c = y if weighted[i] else centroids
        xx, xy, yy = 0.0, 0.0, 0.0
        for k in range(begin, end):
            ax, ay = c[0, columns[k]] - c[0, i], c[1, columns[k]] - c[1, i]
            xx, xy, yy = xx + ax * ax, xy + ax * ay, yy + ay * ay
        xx, xy, yy = _pseudoinverse(xx, xy, yy)
        own, own_x, own_y = begin, 0.0, 0.0
        for k in range(begin, end):
            j = columns[k]
            ax, ay = c[0, j] - c[0, i], c[1, j] - c[1, i]
            gx, gy = xx * ax + xy * ay, xy * ax + yy * ay
            own_x, own_y = own_x - gx, own_y - gy
            ratio = mean[i] / mean[j] if weighted[i] else 1.0
            values[0, k], values[1, k] = gx * ratio, gy * ratio
            if j == i:
                own = k
        values[0, own], values[1, own] = own_x, own_y


@inlined
def _pseudoinverse(xx, xy, yy):
    """Of a symmetric matrix that is not negative."""
    half = np.hypot((xx - yy) / 2, xy)
    most = (xx + yy) / 2 + half
    least = max(most - 2 * half, 0.0)
    if most == 0.0:
        return 0.0, 0.0, 0.0
    if least > ON_A_LINE * most:
        det = xx * yy - xy * xy
        return yy / det, -xy / det, xx / det
    scale = most * (most - least)
    return (xx - least) / scale, xy / scale, (yy - least) / scale
