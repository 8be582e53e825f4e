"""Settlements under pressures on cells, integrated near by, by moments farther off.

Farther from a cell than some of its radii its load acts by moments up to the fourth degree, see
`along_arms`, to which slopes inside it add dipoles. Nearer by it is integrated, see `NearSums`.
"""

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.compiled import inputs, vectorised
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights, load_centroids
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
    squares = (INSIDE * partition.polygons.radii) ** 2
    far = inputs(partition.centroids, squares, forces, terms)
    near = NearSums.from_cells(partition, weights, np.arange(n), REACH, x)
    middles = load_centroids(partition, weights)
    out = np.zeros((len(q), x.shape[1]))
    (points,) = inputs(x)
    with Threads() as run:
        run(lambda k: _add_far(k.start, k.stop, points, *far, out), x.shape[1], CELL * n)
    _add_near(near, *inputs(middles, q, g), *far, out)
    return out.T.reshape(-1, *pressure.shape[1:])


@vectorised
def _add_far(begin, end, points, centroids, squares, forces, terms, out):
    """Add what the moments of all cells make of some points."""
    sets = forces.shape[0]
    x0, y0, f = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    x, y, xx, xy = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    total = np.empty((sets, WIDTH))
    for first in range(begin, end, WIDTH):
        count = min(WIDTH, end - first)
        for i in range(WIDTH):
            at = first + min(i, count - 1)
            x0[i], y0[i] = points[0, at], points[1, at]
        total[:] = 0.0
        for j in range(squares.shape[0]):
            cx, cy, square = centroids[0, j], centroids[1, j], squares[j]
            for i in range(WIDTH):
                f[i], x[i], y[i], xx[i], xy[i] = arms(x0[i] - cx, y0[i] - cy, square)
            for s in range(sets):
                own, force = terms[s], forces[s, j]
                for i in range(WIDTH):
                    higher = along_arms(f[i], x[i], y[i], xx[i], xy[i], own, j)
                    total[s, i] += f[i] * force + higher
        for s in range(sets):
            for i in range(count):
                out[s, first + i] += total[s, i]


@vectorised
def _add_near(near, middles, q, g, centroids, squares, forces, terms, out):
    """Add integrals near cells, less what their moments make there."""
    x, points, column, sums = near.pairs.x, near.pairs.points, near.column, near.sums
    for k in range(column.shape[0]):
        i, j = points[k], column[k]
        f, ax, ay, xx, xy = arms(x[0, k] - centroids[0, j], x[1, k] - centroids[1, j], squares[j])
        along = sums[1, k] + sums[0, k] * (x[0, k] - middles[0, j])
        across = sums[2, k] + sums[0, k] * (x[1, k] - middles[1, j])
        for s in range(q.shape[0]):
            exact = q[s, j] * sums[0, k] + g[s, 0, j] * along + g[s, 1, j] * across
            out[s, i] += exact - f * forces[s, j] - along_arms(f, ax, ay, xx, xy, terms[s], j)
