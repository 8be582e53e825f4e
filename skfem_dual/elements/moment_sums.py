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
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights, load_centroids
from .moments import INSIDE, Multipoles, along_arms, arms, moved, series_terms
from .near_sums import NearSums
from .slopes import Slopes

#: cells nearer than so many of their radii are integrated; no point of a regular mesh is just
#: there
REACH = 3.03
#: points that are looked at together, in multiples of the second
WIDTH, STEP = 64, 8
#: radii of a group beyond which its cells act together, cells that are too few for groups, and
#: cells near a point for each in a group, about: as many groups are far as cells are near; sides
#: of boxes are no multiples of those of cells
APART, FEW, NEAR, UNEVEN = 4.0, 600, 25, 1.03
#: nanoseconds that a cell takes, about
CELL = 1


class Boxes(NamedTuple):
    """Points in square boxes about the middle of a plan: mirrored ones are in mirrored boxes.

    Attributes
    ----------
    order : (n,) array of int
        The points, one box after the other.
    starts : (k + 1,) array of int
        Where each box begins.
    centres : (2, k) array of float
        Means of the points.
    radii : (k,) array of float
        Of circles around these that the points, or circles around them, reach.
    """

    order: ndarray
    starts: ndarray
    centres: ndarray
    radii: ndarray

    @classmethod
    def of(cls, x: ndarray, radii: ndarray, middle: ndarray, side: float) -> Self:
        """Of points (2, n) with circles of some radii, (n,)."""
        place = np.rint((x - middle[:, None]) / side)
        order = np.lexsort(place)
        x, place = x.take(order, axis=1), place.take(order, axis=1)
        new = np.append(True, (place[:, 1:] != place[:, :-1]).any(axis=0))
        (starts,) = np.nonzero(new[: len(order)])
        counts = np.diff(starts, append=len(order))
        centres = np.add.reduceat(x, starts, axis=1) / counts
        reach = np.hypot(*(x - np.repeat(centres, counts, axis=1))) + radii[order]
        ends = np.append(starts, len(order))
        return cls(*inputs(order, ends, centres, np.maximum.reduceat(reach, starts)))


class Acting(NamedTuple):
    """Cells in the order of their boxes, and then these, as they act by their moments.

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
    def of(cls, groups: Boxes, partition: Partition, moments: ndarray) -> Self:
        """With moments of the cells under s loads, as of `Multipoles`, (s, 5, 5, n)."""
        moments = moments.take(groups.order, axis=-1)
        middles = partition.centroids.take(groups.order, axis=1)
        squares = (INSIDE * partition.polygons.radii[groups.order]) ** 2
        arm = middles - np.repeat(groups.centres, np.diff(groups.starts), axis=1)
        whole = [np.add.reduceat(moved(m, arm), groups.starts[:-1], axis=-1) for m in moments]
        moments = np.concatenate([moments, whole], axis=-1)
        middles = np.hstack([middles, groups.centres])
        squares = np.append(squares, np.zeros(len(groups.radii)))
        terms = np.stack([series_terms(own) for own in moments])
        return cls(*inputs(middles, squares, moments[:, 0, 0], terms))


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
    groups, points, apart = _boxes(partition, x)
    number = np.empty(n, np.int64)
    number[groups.order] = np.arange(n)
    acting = Acting.of(groups, partition, moments)
    near = NearSums.from_cells(partition, weights, np.arange(n), REACH, x)
    centroids, boxes = load_centroids(partition, weights), len(points.radii)
    out = np.zeros((len(q), x.shape[1]))
    known = *inputs(x), points, groups, acting, apart, out
    with Threads() as run:
        each = CELL * n * x.shape[1] // max(boxes, 1)
        run(lambda k: _add_far(k.start, k.stop, *known), boxes, each)
    _add_near(near, *inputs(number[near.column], centroids, q, g), acting, out)
    return out.T.reshape(-1, *pressure.shape[1:])


def _boxes(partition: Partition, x: ndarray) -> tuple[Boxes, Boxes, float]:
    """Those of cells and points, and how many radii of groups of cells these act from; of few
    cells one each, which is near."""
    n, centroids = len(partition), partition.centroids
    middle = (centroids.min(axis=1) + centroids.max(axis=1)) / 2
    side, apart = np.inf, np.inf
    if n >= FEW:
        apart, side = APART, np.sqrt(UNEVEN * np.sqrt(n / NEAR) * partition.areas.mean())
    cells = Boxes.of(centroids, partition.polygons.radii, middle, side)
    return cells, Boxes.of(x, np.zeros(x.shape[1]), middle, side), apart


@vectorised
def _add_far(begin, end, x, points, groups, acting, apart, out):
    """Add what moments of cells, or of groups far off, make of the points in some boxes."""
    middles, squares, forces, terms = acting
    order, starts, centres, radii = points
    sets, n = forces.shape[0], groups.order.shape[0]
    x0, y0, f = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    dx, dy, xx, xy = np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH), np.empty(WIDTH)
    total, own = np.empty((sets, WIDTH)), np.empty(squares.shape[0], np.int64)
    for box in range(begin, end):
        some = 0
        for k in range(groups.radii.shape[0]):
            ax, ay = centres[0, box] - middles[0, n + k], centres[1, box] - middles[1, n + k]
            if np.sqrt(ax * ax + ay * ay) >= apart * groups.radii[k] + radii[box]:
                own[some] = n + k
                some += 1
            else:
                for j in range(groups.starts[k], groups.starts[k + 1]):
                    own[some] = j
                    some += 1
        for first in range(starts[box], starts[box + 1], WIDTH):
            count = min(WIDTH, starts[box + 1] - first)
            full = -(-count // STEP) * STEP
            for i in range(full):
                at = order[first + min(i, count - 1)]
                x0[i], y0[i] = x[0, at], x[1, at]
            total[:] = 0.0
            for j in own[:some]:
                cx, cy, square = middles[0, j], middles[1, j], squares[j]
                for i in range(full):
                    f[i], dx[i], dy[i], xx[i], xy[i] = arms(x0[i] - cx, y0[i] - cy, square)
                for s in range(sets):
                    of_load, force = terms[s], forces[s, j]
                    for i in range(full):
                        higher = along_arms(f[i], dx[i], dy[i], xx[i], xy[i], of_load, j)
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
