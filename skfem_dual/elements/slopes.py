"""How the pressure varies from cell to cell, and so inside them beside the law of the edge.

With the mean pressure q and the law w of `EdgeWeights`, the pressure in a cell is::

    p = w / mean(w) (q + g . (x - y))

where y is the centroid of w, so that q remains the mean. The slope g follows from the cells
around, those that share a vertex: it is that of the plane through q / mean(w) of the cell, nearest
in the mean square to theirs, times mean(w). On cells that are not weighted w is constant.

Source: T. J. Barth and D. C. Jespersen, The design and application of upwind schemes on
unstructured meshes, AIAA Paper 89-0366 (1989), for linear functions from means of cells.
"""

from dataclasses import dataclass
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
from .edge_correction import factor_at
from .edge_weights import EdgeWeights, Factors
from .graded_rule import fill, gauss_points

#: eigenvalues of the moments of the cells around, over the greatest, below which there is no slope
ON_A_LINE = 1e-6
#: triangles that are looked at together
TOGETHER = 64


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of the pressure inside the n cells of a partition.

    Attributes
    ----------
    weights : EdgeWeights
        The law of the edge.
    matrix : (2 n, n) csr_matrix
        Takes mean pressures to slopes along x of all cells, then along y.
    second_moments : (2, 2, n) array of float
        Integrals of ``w / mean(w)`` times products of the coordinates from y.
    """

    weights: EdgeWeights
    matrix: csr_matrix
    second_moments: ndarray

    @classmethod
    def from_weights(cls, weights: EdgeWeights) -> Self:
        """Of all cells, from those around them."""
        return cls(weights, _slope_matrix(weights), readonly(_second_moments(weights)))

    @property
    def along(self) -> tuple[csr_matrix, csr_matrix]:
        """Its parts for the slopes along x, and along y, (n, n) each."""
        n = self.matrix.shape[1]
        return self.matrix[:n], self.matrix[n:]

    def of(self, pressure: ndarray) -> ndarray:
        """Slopes under mean pressures of shape (n,), shape (2, n)."""
        return (self.matrix @ pressure).reshape(2, -1)

    def without(self, cells: ndarray) -> "Slopes":
        """With no slope in some cells, given as (n,) array of bool."""
        counts = np.diff(self.matrix.indptr)
        left_out = np.tile(cells, 2)
        kept = ~np.repeat(left_out, counts)
        starts = np.concatenate([[0], np.cumsum(np.where(left_out, 0, counts))])
        rows = self.matrix.data[kept], self.matrix.indices[kept], starts
        return type(self)(
            self.weights, csr_matrix(rows, shape=self.matrix.shape), self.second_moments
        )

    @computed_once
    def first_moments(self) -> ndarray:
        """Integrals of what unit pressures add by slopes, times x and y; shape (2, n)."""
        n = self.matrix.shape[1]
        ones = self.second_moments.reshape(2, 2 * n)
        return readonly((self.matrix.T @ ones.T).T)

    def lowest(self, pressure: ndarray) -> ndarray:
        """Least value of ``q + g . (x - y)`` in each cell, shape (n,): where it is negative the
        pressure changes its sign."""
        polygons = self.weights.partition.polygons
        cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
        arm = polygons.p[:, polygons.indices] - self.weights.centroids[:, cell]
        rise = np.sum(self.of(pressure)[:, cell] * arm, axis=0)
        return pressure + np.minimum.reduceat(rise, polygons.offsets[:-1])


def _around(weights: EdgeWeights) -> tuple[ndarray, ndarray]:
    """Pairs of cells that share a vertex, ascending in the first."""
    polygons = weights.partition.polygons
    place = _places(weights.partition)[polygons.indices]
    at = np.ones(len(place)), place, polygons.offsets
    vertices = csr_matrix(at, shape=(len(polygons), polygons.p.shape[1]))
    pairs = (vertices @ vertices.T).tocoo()
    cell, other = pairs.row, pairs.col
    # where the law of the edge is not known there, a weighted cell cannot compare itself
    keep = (cell != other) & ~(weights.weighted[cell] & np.isnan(weights.mean[other]))
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


def _slope_matrix(weights: EdgeWeights) -> csr_matrix:
    n = len(weights.partition)
    cell, other = _around(weights)
    weighted = weights.weighted[cell]
    y, c = weights.centroids, weights.partition.centroids
    arm = np.where(weighted, y[:, other] - y[:, cell], c[:, other] - c[:, cell])
    moments = np.array([[np.bincount(cell, a * b, n) for a in arm] for b in arm])
    shares = np.linalg.pinv(moments.transpose(2, 0, 1), rcond=ON_A_LINE, hermitian=True)
    share = np.einsum("kab,bk->ak", shares[cell], arm)
    ratio = np.where(weighted, weights.mean[cell] / weights.mean[other], 1.0)
    own = [np.bincount(cell, s, n) for s in share]
    every = np.arange(n)
    rows = np.concatenate([cell, n + cell, every, n + every])
    columns = np.concatenate([other, other, every, every])
    values = np.concatenate([*(share * ratio), *(-s for s in own)])
    return csr_matrix((values, (rows, columns)), shape=(2 * n, n))


def _second_moments(weights: EdgeWeights) -> ndarray:
    partition, fan = weights.partition, weights.fan
    xx, xy, yy = partition.polygons.second_moments
    out = np.array([[xx, xy], [xy, yy]]) * ~weights.weighted
    own = np.nonzero(weights.weighted[fan.cell])[0]
    cell, t = fan.cell[own], fan.t[:, own]
    arms = fan.p[:, t] - weights.centroids[:, None, cell]
    scale = fan.areas[own] / weights.mean[cell]
    given = inputs(arms, weights.root[t] ** 2, scale, cell)
    _add_second_moments(*given, Factors(*inputs(*weights.factors)), gauss_points(2), out)
    return out


@compiled
def _add_second_moments(arms, square, scale, cells, factors, gauss, out):
    """Of triangles with some arms of their vertices, loaded by w times their scale."""
    whole = np.zeros((3, 3, TOGETHER))
    for i in range(3):
        whole[i, i] = 1.0
    points = gauss.tau.shape[0] * gauss.u.shape[0]
    at, load = np.empty((3, TOGETHER, points)), np.empty((TOGETHER, points))
    for first in range(0, len(cells), TOGETHER):
        count = min(TOGETHER, len(cells) - first)
        for apex in (0, 2):
            fill(apex, whole, square[:, first : first + count], gauss, at, load)
            for k in range(count):
                cell, xx, xy, yy = cells[first + k], 0.0, 0.0, 0.0
                for q in range(points):
                    x = y = phi = 0.0
                    for i in range(3):
                        x += at[i, k, q] * arms[0, i, first + k]
                        y += at[i, k, q] * arms[1, i, first + k]
                        phi += at[i, k, q] * square[i, first + k]
                    weight = load[k, q] * factor_at(factors, cell, np.sqrt(phi))
                    xx += weight * x * x
                    xy += weight * x * y
                    yy += weight * y * y
                out[0, 0, cell] += scale[first + k] * xx
                out[0, 1, cell] += scale[first + k] * xy
                out[1, 0, cell] += scale[first + k] * xy
                out[1, 1, cell] += scale[first + k] * yy
