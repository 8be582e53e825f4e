"""Settlements under pressures on cells, integrated near by, by moments farther off.

Farther from a cell than some of its radii its load acts by moments up to the fourth degree, see
`along_arms`, to which slopes inside it add dipoles. Nearer by it is integrated, see `NearSums`.
Far from a group of neighbours these act together, by the moments of all their loads.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.compiled import inputs, vectorised
from ..kernels.threads import GRAIN, Threads
from .edge_weights import EdgeWeights, load_centroids
from .moments import INSIDE, Multipoles, along_arms, arms, moved, series_terms
from .near_sums import NearSums
from .slopes import Slopes

#: cells nearer than so many of their radii are integrated; no point of a regular mesh is just
#: there
REACH = 3.03
#: points that are looked at together, in the same blocks however threads share them
WIDTH = GRAIN
#: radii of a group beyond which its cells act together, cells that are too few for groups, and
#: cells near a point for each in a group, about: as many groups are far as cells are near
APART, FEW, NEAR = 4.0, 1000, 25
#: nanoseconds that a cell takes, about
CELL = 1


class Groups(NamedTuple):
    """Cells in groups of neighbours, as kernels take them.

    Attributes
    ----------
    order : (n,) array of int
        The cells, one group after the other.
    starts : (k + 1,) array of int
        Where each group begins.
    centres : (2, k) array of float
    squares : (k,) array of float
        Of distances from the centres beyond which the cells act together.
    """

    order: ndarray
    starts: ndarray
    centres: ndarray
    squares: ndarray

    @classmethod
    def of(cls, partition: Partition) -> Self:
        """Of all cells; few are one group that is never far."""
        n = len(partition)
        size, apart = (round(np.sqrt(n / NEAR)), APART) if n >= FEW else (n, np.inf)
        order, starts = tiled(partition.centroids, size), np.append(np.arange(0, n, size), n)
        x, sizes = partition.centroids.take(order, axis=1), np.diff(starts)
        centres = np.add.reduceat(x, starts[:-1], axis=1) / sizes
        reach = np.hypot(*(x - np.repeat(centres, sizes, axis=1)))
        reach = np.maximum.reduceat(reach + partition.polygons.radii[order], starts[:-1])
        return cls(*inputs(order, starts, centres, (apart * reach) ** 2))


class Acting(NamedTuple):
    """Cells in the order of `Groups`, and then these, as they act by their moments.

    Attributes
    ----------
    middles : (2, n + k) array of float
        Points to which the moments refer.
    squares : (n + k,) array of float
        Of radii of circles in which the moments do not serve.
    forces : (s, n + k) array of float
        Under each of s loads.
    terms : (s, 14, n + k) array of float
        As of `series_terms`.
    """

    middles: ndarray
    squares: ndarray
    forces: ndarray
    terms: ndarray

    @classmethod
    def of(cls, groups: Groups, partition: Partition, moments: ndarray) -> Self:
        """With moments of the cells under s loads, as of `Multipoles`, (s, 5, 5, n)."""
        moments = moments.take(groups.order, axis=-1)
        middles = partition.centroids.take(groups.order, axis=1)
        squares = (INSIDE * partition.polygons.radii[groups.order]) ** 2
        arm = middles - np.repeat(groups.centres, np.diff(groups.starts), axis=1)
        whole = [np.add.reduceat(moved(m, arm), groups.starts[:-1], axis=-1) for m in moments]
        moments = np.concatenate([moments, whole], axis=-1)
        middles, squares = (
            np.hstack([middles, groups.centres]),
            np.append(squares, np.zeros(len(groups.squares))),
        )
        terms = np.stack([series_terms(own) for own in moments])
        return cls(*inputs(middles, squares, moments[:, 0, 0], terms))


def tiled(x: ndarray, size: int) -> ndarray:
    """Numbers of points (2, n) in strips, and along each of them: ``size`` in a row are near."""
    n = x.shape[1]
    strip = size * max(round(np.sqrt(n / size)), 1)
    order = np.argsort(x[0], kind="stable")
    return order[np.lexsort((x[1, order], np.arange(n) // strip))]


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
    moments = q[:, None, None] * Multipoles.about_centroids(partition, weights, 4).moments
    if slopes is not None:
        g = coefficient * np.moveaxis(slopes.of(columns), -1, 0)
        dipoles = np.einsum("ijn,sjn->sin", slopes.second_moments, g)
        moments[:, 1, 0] += dipoles[:, 0]
        moments[:, 0, 1] += dipoles[:, 1]
    groups, number = Groups.of(partition), np.empty(n, np.int64)
    number[groups.order] = np.arange(n)
    acting = Acting.of(groups, partition, moments)
    near = NearSums.from_cells(partition, weights, np.arange(n), REACH, x)
    centroids = load_centroids(partition, weights)
    out = np.zeros((len(q), x.shape[1]))
    points = inputs(x, tiled(x, WIDTH))
    with Threads() as run:
        run(
            lambda k: _add_far(k.start, k.stop, *points, groups, acting, out), x.shape[1], CELL * n
        )
    _add_near(near, *inputs(number[near.column], centroids, q, g), acting, out)
    return out.T.reshape(-1, *pressure.shape[1:])


@vectorised
def _add_far(begin, end, points, order, groups, acting, out):
    """Add what moments of cells, or of groups far off, make of some points in an order."""
    middles, squares, forces, terms = acting
    starts, distances = groups.starts, groups.squares
    sets, n = forces.shape[0], groups.order.shape[0]
    x0, y0, f = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    x, y, xx, xy = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    total, own = np.empty((sets, WIDTH)), np.empty(squares.shape[0], np.int64)
    for first in range(begin, end, WIDTH):
        count, some = min(WIDTH, end - first), 0
        for i in range(WIDTH):
            at = order[first + min(i, count - 1)]
            x0[i], y0[i] = points[0, at], points[1, at]
        for k in range(distances.shape[0]):
            cx, cy, nearest = middles[0, n + k], middles[1, n + k], np.inf
            for i in range(WIDTH):
                dx, dy = x0[i] - cx, y0[i] - cy
                nearest = min(nearest, dx * dx + dy * dy)
            if nearest >= distances[k]:
                own[some] = n + k
                some += 1
            else:
                for j in range(starts[k], starts[k + 1]):
                    own[some] = j
                    some += 1
        total[:] = 0.0
        for j in own[:some]:
            cx, cy, square = middles[0, j], middles[1, j], squares[j]
            for i in range(WIDTH):
                f[i], x[i], y[i], xx[i], xy[i] = arms(x0[i] - cx, y0[i] - cy, square)
            for s in range(sets):
                of_load, force = terms[s], forces[s, j]
                for i in range(WIDTH):
                    higher = along_arms(f[i], x[i], y[i], xx[i], xy[i], of_load, j)
                    total[s, i] += f[i] * force + higher
        for s in range(sets):
            for i in range(count):
                out[s, order[first + i]] += total[s, i]


@vectorised
def _add_near(near, numbers, centroids, q, g, acting, out):
    """Add integrals near cells, less what their moments make there; ``numbers`` are those of the
    cells among the ones that act, ``centroids`` those of their loads."""
    middles, squares, forces, terms = acting
    x, points, column, sums = near.pairs.x, near.pairs.points, near.column, near.sums
    for k in range(column.shape[0]):
        i, j, at = points[k], column[k], numbers[k]
        dx, dy = x[0, k] - middles[0, at], x[1, k] - middles[1, at]
        f, ax, ay, xx, xy = arms(dx, dy, squares[at])
        along = sums[1, k] + sums[0, k] * (x[0, k] - centroids[0, j])
        across = sums[2, k] + sums[0, k] * (x[1, k] - centroids[1, j])
        for s in range(q.shape[0]):
            exact = q[s, j] * sums[0, k] + g[s, 0, j] * along + g[s, 1, j] * across
            rough = f * forces[s, at] + along_arms(f, ax, ay, xx, xy, terms[s], at)
            out[s, i] += exact - rough
