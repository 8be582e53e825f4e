"""Settlements under pressures on cells, integrated near by, by moments farther off.

Farther from a cell than some of its radii its load acts by moments up to the fourth degree, see
`along_arms`, to which slopes inside it add dipoles. Nearer by it is integrated, see `NearSums`.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.compiled import inputs, vectorised
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights
from .moments import INSIDE, Multipoles, along_arms, arms, series_terms
from .near_sums import NearSums
from .slopes import Slopes

#: cells nearer than so many of their radii are integrated; no point of a regular mesh is just
#: there
REACH = 3.03
#: points that are looked at together
WIDTH = 64
#: nanoseconds that a cell takes, about
CELL = 1
#: degrees of the factors in the series of 1 / r, see `along_arms`
ORDERS = np.repeat([1, 2, 3, 4], [2, 3, 4, 5])
TINY = float(np.finfo(float).tiny)


def settled_by_moments(
    coefficient: float,
    partition: Partition,
    weights: EdgeWeights | None,
    slopes: Slopes | None,
    pressure: ndarray,
    x: ndarray,
) -> ndarray:
    """Settlements under mean pressures, to some 1e-5, of many cells to 1e-6 on average.

    Parameters
    ----------
    coefficient : float
        c of the influence function c / r.
    partition : Partition
        The n cells.
    weights : EdgeWeights or None
        How the pressure varies inside them towards the edge.
    slopes : Slopes or None
        How it follows the cells around.
    pressure : (n,) or (n, k) array of float
        Mean pressures.
    x : (2, m) array of float
        Points.

    Returns
    -------
    (m,) or (m, k) array of float
    """
    n, columns = len(partition), pressure.reshape(len(pressure), -1)
    q, g = coefficient * columns.T, np.zeros((columns.shape[1], 2, n))
    moments = Multipoles.about_centroids(partition, weights).moments
    terms, forces = q[:, None] * series_terms(moments), q * moments[0, 0]
    if slopes is not None:
        g = coefficient * np.moveaxis(slopes.of(columns), -1, 0)
        terms[:, :2] += np.einsum("ijn,sjn->sin", slopes.second_moments, g)
    far = Far.from_terms(partition, forces, terms, x)
    near = NearSums.from_cells(partition, weights, np.arange(n), REACH, x)
    middles = partition.centroids if weights is None else weights.centroids
    out = np.zeros((len(q), x.shape[1]))
    with Threads() as run:
        run(lambda k: _add_far(k.start, k.stop, far, out), x.shape[1], CELL * n)
    _add_near(near, *inputs(middles, q, g), far, out)
    return out.T.reshape(-1, *pressure.shape[1:])


class Far(NamedTuple):
    """Points and moments of the cells in single precision, which takes half the time: in units of
    the size of all and of the largest force, and about their middle.

    Attributes
    ----------
    points : (2, m) array of float32
    centroids : (2, n) array of float32
        Of the cells.
    squares : (n,) array of float32
        Of the radii in which the moments do nothing.
    forces : (s, n) array of float32
        Under each of the pressures.
    terms : (s, 14, n) array of float32
        Factors of higher moments, see `along_arms`.
    units : (s,) array of float
        Of the settlements.
    """

    points: ndarray
    centroids: ndarray
    squares: ndarray
    forces: ndarray
    terms: ndarray
    units: ndarray

    @classmethod
    def from_terms(cls, partition: Partition, forces: ndarray, terms: ndarray, x: ndarray) -> Self:
        """Of cells with these forces and factors, in units of the user."""
        low, high = (end(partition.polygons.p, axis=1, keepdims=True) for end in (np.min, np.max))
        middle, size = (low + high) / 2, float((high - low).max())
        units = np.abs(forces).max(axis=1).clip(TINY) / size
        squares = (INSIDE * partition.polygons.radii / size) ** 2
        arms = [(some - middle) / size for some in (x, partition.centroids)]
        powers = size ** (ORDERS + 1.0)
        loads = forces / (size * units[:, None]), terms / (powers[:, None] * units[:, None, None])
        single = [a.astype(np.float32) for a in (*arms, squares, *loads)]
        return cls(*inputs(*single, units))


@vectorised
def _add_far(begin, end, far, out):
    """Add what the moments of all cells make of some points."""
    points, centroids, squares, forces, terms, units = far
    sets, zero = forces.shape[0], squares[0] - squares[0]
    room = np.empty((7, WIDTH), np.float32)
    x0, y0, f, x, y, xx, xy = room
    total, sums = np.empty((sets, WIDTH)), np.empty((sets, WIDTH), np.float32)
    for first in range(begin, end, WIDTH):
        count = min(WIDTH, end - first)
        for i in range(WIDTH):
            at = first + min(i, count - 1)
            x0[i], y0[i] = points[0, at], points[1, at]
        total[:] = 0.0
        for start in range(0, squares.shape[0], WIDTH):  # long sums are in double precision
            sums[:] = zero
            for j in range(start, min(start + WIDTH, squares.shape[0])):
                cx, cy, square = centroids[0, j], centroids[1, j], squares[j]
                for i in range(WIDTH):
                    f[i], x[i], y[i], xx[i], xy[i] = arms(x0[i] - cx, y0[i] - cy, square)
                for s in range(sets):
                    own, force = terms[s], forces[s, j]
                    for i in range(WIDTH):
                        higher = along_arms(f[i], x[i], y[i], xx[i], xy[i], own, j)
                        sums[s, i] += f[i] * force + higher
            total += sums
        for s in range(sets):
            for i in range(count):
                out[s, first + i] += units[s] * total[s, i]


@vectorised
def _add_near(near, middles, q, g, far, out):
    """Add integrals near cells, less what their moments make there."""
    points, centroids, squares, forces, terms, units = far
    x, number, column, sums = near.pairs.x, near.pairs.points, near.column, near.sums
    for k in range(column.shape[0]):
        i, j = number[k], column[k]
        dx, dy = points[0, i] - centroids[0, j], points[1, i] - centroids[1, j]
        f, ax, ay, xx, xy = arms(dx, dy, squares[j])
        along = sums[1, k] + sums[0, k] * (x[0, k] - middles[0, j])
        across = sums[2, k] + sums[0, k] * (x[1, k] - middles[1, j])
        for s in range(q.shape[0]):
            exact = q[s, j] * sums[0, k] + g[s, 0, j] * along + g[s, 1, j] * across
            higher = along_arms(f, ax, ay, xx, xy, terms[s], j)
            out[s, i] += exact - units[s] * (f * forces[s, j] + higher)
