"""How the pressure varies from cell to cell, and so inside them beside the law of the edge.

With the mean pressure q and the law w of `EdgeWeights`, the pressure in a cell is::

    p = w / mean(w) (q + g . (x - y))

where y is the centroid of w, so that q remains the mean. The slope g follows from the cells
around, those that share a vertex: it is that of the plane through q / mean(w) of the cell, nearest
in the mean square to theirs, times mean(w). On cells that are not weighted w is constant.

Source: T. J. Barth and D. C. Jespersen, The design and application of upwind schemes on
unstructured meshes, AIAA Paper 89-0366 (1989), for linear functions from means of cells.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from ..kernels.once import ReadOnly, computed_once
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights, load_centroids

#: eigenvalues of the moments of the cells around, over the greatest, below which there is no slope
ON_A_LINE = 1e-6
#: nanoseconds that the slope of a cell takes, about
CELL = 100
#: cells whose slopes are kept at a time
TOGETHER = 1024


class Around(NamedTuple):
    """Cells around each, and what planes through their pressures depend on, as kernels take it.

    Attributes
    ----------
    starts : (n + 1,) array of int
        Where those of each cell begin; it has no slope if there are none.
    columns : (k,) array of int
        They and the cell itself, ascending.
    centroids, y : (2, n) array of float
        Centroids of the cells, and of w in them.
    mean : (n,) array of float
        Means of w.
    weighted : (n,) array of bool
        Cells that compare means of w.
    """

    starts: ndarray
    columns: ndarray
    centroids: ndarray
    y: ndarray
    mean: ndarray
    weighted: ndarray

    @classmethod
    def of(cls, partition: Partition, weights: EdgeWeights | None) -> Self:
        """Those that share a vertex."""
        n, polygons = len(partition), partition.polygons
        vertices = inputs(_places(partition)[polygons.indices], polygons.offsets)
        y, mean, weighted = partition.centroids, np.ones(n), np.zeros(n, dtype=bool)
        if weights is not None:
            y, mean, weighted = weights.centroids, weights.mean, weights.weighted
        known, starts = inputs(partition.centroids, y, mean, weighted), np.zeros(n + 1, np.int64)
        columns = _around(*vertices, polygons.p.shape[1], *known[2:], starts)
        return cls(*inputs(starts.astype(np.int32), columns), *known)

    @classmethod
    def together(cls, parts: Sequence[Self]) -> Self:
        """Of some cells and others, none of which are around these."""
        first = np.cumsum([0, *(len(part.mean) for part in parts)])
        begin = np.cumsum([0, *(len(part.columns) for part in parts)])
        ends = [part.starts[1:] + k for part, k in zip(parts, begin)]
        columns = [part.columns + np.int32(k) for part, k in zip(parts, first)]
        others = (np.concatenate(arrays, axis=-1) for arrays in list(zip(*parts))[2:])
        starts = np.concatenate([[0], *ends]).astype(np.int32)
        return cls(*inputs(starts, np.concatenate(columns), *others))

    def without(self, cells: ndarray) -> Self:
        """With none around some cells, given as (n,) array of bool."""
        counts = np.where(cells, 0, np.diff(self.starts))
        columns = self.columns[~np.repeat(cells, np.diff(self.starts))]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        return self._replace(**dict(zip(("starts", "columns"), inputs(starts, columns))))


@dataclass(frozen=True, eq=False)
class Slopes(ReadOnly):
    """Slopes of the pressure inside the n cells of a partition.

    Attributes
    ----------
    partition : Partition
        The cells.
    weights : EdgeWeights or None
        The law of the edge; None if w is constant in all cells.
    around : Around
        The cells from whose pressures slopes follow.
    second_moments : (2, 2, n) array of float
        Integrals of ``w / mean(w)`` times products of the coordinates from y.
    """

    partition: Partition
    weights: EdgeWeights | None
    around: Around
    second_moments: ndarray

    @classmethod
    def from_weights(cls, weights: EdgeWeights) -> Self:
        """Of all cells, from those around them."""
        own = weights.partition
        return cls(own, weights, Around.of(own, weights), weights.second_moments)

    @classmethod
    def from_partition(cls, partition: Partition) -> Self:
        """Of cells in which w is constant."""
        moments = partition.polygons.second_moments[[0, 1, 1, 2]].reshape(2, 2, -1)
        return cls(partition, None, Around.of(partition, None), readonly(moments))

    @property
    def centroids(self) -> ndarray:
        """Those of w in the cells, shape (2, n)."""
        return load_centroids(self.partition, self.weights)

    @computed_once
    def matrix(self) -> csr_matrix:
        """Takes mean pressures to slopes along x of all cells, then along y, (2 n, n); of many
        cells it takes far more memory than what it is made of, see `of`."""
        starts, columns, *_ = self.around
        values = np.empty((2, len(columns)))
        _fill(self.around, values)
        starts = np.append(starts, starts[1:] + len(columns))
        shape = 2 * len(self.partition), len(self.partition)
        return csr_matrix((values.ravel(), np.tile(columns, 2), starts), shape=shape)

    @computed_once
    def columns(self) -> csc_matrix:
        """The same by columns."""
        return self.matrix.tocsc()

    @property
    def along(self) -> tuple[csr_matrix, csr_matrix]:
        """Its parts for the slopes along x, and along y, (n, n) each."""
        n = self.matrix.shape[1]
        return self.matrix[:n], self.matrix[n:]

    @property
    def sloped(self) -> ndarray:
        """Whether each cell has a slope, (n,) array of bool."""
        return np.diff(self.around.starts) > 0

    def of(self, pressure: ndarray) -> ndarray:
        """Slopes under mean pressures of shape (n,) or (n, k), shape (2, n) or (2, n, k)."""
        rows = self.of_rows(pressure.reshape(len(pressure), -1).T)
        return rows.transpose(1, 2, 0).reshape(2, *pressure.shape)

    def of_rows(self, pressures: ndarray) -> ndarray:
        """The same, from (k, n) to (k, 2, n)."""
        (given,) = inputs(np.asarray(pressures, float))
        out = np.zeros((len(given), 2, given.shape[1]))
        with Threads() as run:
            run(lambda k: _slopes(k.start, k.stop, self.around, given, out), given.shape[1], CELL)
        return out

    def without(self, cells: ndarray) -> "Slopes":
        """With no slope in some cells, given as (n,) array of bool."""
        return replace(self, around=self.around.without(cells))

    def add_transposed(self, fields: ndarray, out: ndarray, first: int = 0) -> None:
        """Add the transpose of rows of the matrix times ``fields`` of shape (k, 2, m) to ``out``,
        (k, n): of the slopes of m cells, from the ``first`` on."""
        _transposed(self.around, *inputs(fields), first, out)

    @property
    def first_moments(self) -> ndarray:
        """Integrals of what unit pressures add by slopes, times x and y; shape (2, n)."""
        out = np.zeros((2, len(self.partition)))
        self.add_transposed(self.second_moments, out)
        return out

    def lowest(self, pressure: ndarray) -> ndarray:
        """Least value of ``q + g . (x - y)`` in each cell, shape (n,) or (n, k): where it is
        negative the pressure changes its sign."""
        polygons, columns = self.partition.polygons, pressure.reshape(len(pressure), -1).T
        out = np.array(columns, float)
        outlines = inputs(polygons.p, polygons.indices, polygons.offsets, self.centroids)
        _lower(*outlines, self.of_rows(columns), out)
        return out.T.reshape(pressure.shape)


def _places(partition: Partition) -> ndarray:
    """A number for the place of each vertex: the banks of a seam have the same places."""
    p = partition.polygons.p
    ends = np.unique(partition.facets[:, partition.f2c[1] == -1])
    near = 1e-10 * np.sqrt(partition.areas.sum())
    a, b = ends[cKDTree(p[:, ends].T).query_pairs(near, output_type="ndarray")].T
    if len(a) == 0:
        return np.arange(p.shape[1], dtype=np.int32)  # as of components
    same = csr_matrix((np.ones(len(a)), (a, b)), shape=(p.shape[1], p.shape[1]))
    return connected_components(same, directed=False)[1]


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
def _room(starts):
    """Room for the cells around any."""
    widest = 1
    for i in range(starts.shape[0] - 1):
        widest = max(widest, starts[i + 1] - starts[i])
    return np.empty(widest), np.empty(widest)


@vectorised
def _plane(i, starts, columns, centroids, y, mean, weighted, gx, gy):
    """Put what the slope of a cell along x and along y takes from the cells around it; returns
    where these begin and how many they are."""
    begin, width, own = starts[i], starts[i + 1] - starts[i], 0
    xx, xy, yy = 0.0, 0.0, 0.0
    for k in range(width):
        j = columns[begin + k]
        if weighted[i]:
            ax, ay = y[0, j] - y[0, i], y[1, j] - y[1, i]
        else:
            ax, ay = centroids[0, j] - centroids[0, i], centroids[1, j] - centroids[1, i]
        xx, xy, yy = xx + ax * ax, xy + ax * ay, yy + ay * ay
        gx[k], gy[k] = ax, ay
        if j == i:
            own = k
    xx, xy, yy = _pseudoinverse(xx, xy, yy)
    own_x, own_y = 0.0, 0.0
    for k in range(width):
        ax, ay = gx[k], gy[k]
        gx[k], gy[k] = xx * ax + xy * ay, xy * ax + yy * ay
        own_x, own_y = own_x - gx[k], own_y - gy[k]
    if weighted[i]:
        for k in range(width):
            ratio = mean[i] / mean[columns[begin + k]]
            gx[k], gy[k] = gx[k] * ratio, gy[k] * ratio
    if width:  # none has a slope of its own
        gx[own], gy[own] = own_x, own_y
    return begin, width


@compiled
def _fill(around, values):
    """Values of the matrix of slopes along x and along y."""
    starts, columns, centroids, y, mean, weighted = around
    gx, gy = _room(starts)
    for i in range(starts.shape[0] - 1):
        begin, width = _plane(i, starts, columns, centroids, y, mean, weighted, gx, gy)
        for k in range(width):
            values[0, begin + k], values[1, begin + k] = gx[k], gy[k]


@vectorised
def _slopes(first, last, around, pressures, out):
    """Put slopes of some cells under pressures (s, n), shape (s, 2, n)."""
    starts, columns, centroids, y, mean, weighted = around
    gx, gy = _room(starts[first : last + 1])
    for i in range(first, last):
        begin, width = _plane(i, starts, columns, centroids, y, mean, weighted, gx, gy)
        for s in range(pressures.shape[0]):
            along_x, along_y = 0.0, 0.0
            for k in range(width):
                q = pressures[s, columns[begin + k]]
                along_x, along_y = along_x + gx[k] * q, along_y + gy[k] * q
            out[s, 0, i], out[s, 1, i] = along_x, along_y


@compiled
def _transposed(around, fields, first, out):
    """Add the transpose of rows of slopes from the ``first`` on times ``fields`` (s, 2, m)."""
    starts, columns, centroids, y, mean, weighted = around
    count = fields.shape[2]
    for begin in range(0, count, TOGETHER):
        ends = starts[first + begin : first + min(begin + TOGETHER, count) + 1]
        gx, gy = np.empty(ends[-1] - ends[0]), np.empty(ends[-1] - ends[0])
        for i in range(len(ends) - 1):
            own_x, own_y = gx[ends[i] - ends[0] :], gy[ends[i] - ends[0] :]
            _plane(first + begin + i, starts, columns, centroids, y, mean, weighted, own_x, own_y)
        for s in range(fields.shape[0]):  # one row of `out` after the other: caches hold it
            for i in range(len(ends) - 1):
                along_x, along_y = fields[s, 0, begin + i], fields[s, 1, begin + i]
                for k in range(ends[i], ends[i + 1]):
                    out[s, columns[k]] += gx[k - ends[0]] * along_x + gy[k - ends[0]] * along_y


@compiled
def _lower(p, indices, offsets, centroids, slopes, out):
    """Add the least rise in each cell under slopes (s, 2, n) to (s, n)."""
    for s in range(slopes.shape[0]):
        for j in range(offsets.shape[0] - 1):
            least = np.inf
            for point in indices[offsets[j] : offsets[j + 1]]:
                dx, dy = p[0, point] - centroids[0, j], p[1, point] - centroids[1, j]
                least = min(least, slopes[s, 0, j] * dx + slopes[s, 1, j] * dy)
            out[s, j] += least


@inlined
def _pseudoinverse(xx, xy, yy):
    """Of a symmetric matrix that is not negative."""
    half = np.sqrt((xx - yy) ** 2 / 4 + xy * xy)
    most = (xx + yy) / 2 + half
    least = max(most - 2 * half, 0.0)
    if most == 0.0:
        return 0.0, 0.0, 0.0
    if least > ON_A_LINE * most:
        det = xx * yy - xy * xy
        return yy / det, -xy / det, xx / det
    scale = most * (most - least)
    return (xx - least) / scale, xy / scale, (yy - least) / scale
