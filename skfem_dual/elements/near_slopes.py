"""What slopes inside cells add to settlements near them, less what dipoles stand for.

Kept point by point, both directions side by side: a product reads every cell's number once.
"""

from collections.abc import Iterable
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.threads import Threads
from .near_sums import NearSums
from .slopes import Slopes

#: points are in the middle of a dipole, and take nothing from it, up to this part of the square of
#: the radius of its circle: near corrections take the rest off again, of which in single precision
#: nothing is left nearer to it, as nodes of even meshes are to the centroids of their cells
AT_REST = 1e-2
#: nanoseconds that a point takes, about
POINT = 200


class NearSlopes(NamedTuple):
    """Settlements of points under unit slopes near them, less those of dipoles.

    Attributes
    ----------
    starts : (m + 1,) array of int
        Where the cells near each point begin.
    cells : (k,) array of int
    values : (2, k) array of float
        Under a slope along x, and along y.
    """

    starts: ndarray
    cells: ndarray
    values: ndarray

    @classmethod
    def from_sums(
        cls,
        slopes: Slopes,
        m: int,
        coefficient: float,
        sums: Iterable[NearSums],
        dtype: type = float,
    ) -> Self:
        """Of m points and what is known near some cells at a time, each in one of the ``sums``;
        settlements are kept as ``dtype``."""
        partition = slopes.partition
        known = inputs(
            slopes.centroids, partition.centroids, slopes.second_moments, partition.areas / np.pi
        )
        parts, starts = [], np.zeros(m + 1, np.int64)
        for near in sums:
            values: ndarray = np.empty((2, len(near.column)), dtype)
            _less_dipoles(coefficient, near.column, near.pairs.x, *known, near.sums, values)
            starts[1:] += np.bincount(near.pairs.points, minlength=m)
            parts.append((near.pairs.points, near.column.astype(np.int32), values))
        starts = np.cumsum(starts).astype(np.int32)
        cells, values = np.empty(starts[-1], np.int32), np.empty((2, starts[-1]), dtype)
        place = starts[:-1].copy()
        while parts:
            _put_by_points(*inputs(*parts.pop(0)), place, cells, values)
        return cls(*inputs(starts, cells, values))

    def at(self, i: ndarray) -> Self:
        """Of the points with the numbers ``i`` only."""
        counts = np.diff(self.starts)[i]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        some = np.arange(starts[-1]) + np.repeat(self.starts[i] - starts[:-1], counts)
        return type(self)(*inputs(starts, self.cells[some], self.values[:, some]))

    def add_product(self, slopes: ndarray, out: ndarray) -> None:
        """Add settlements under slopes of shape (s, 2, n) to ``out``, of shape (s, m)."""
        (slopes,) = inputs(slopes)
        with Threads() as run:
            run(lambda k: _add_sloped(k.start, k.stop, self, slopes, out), out.shape[1], POINT)

    @property
    def nbytes(self) -> int:
        """Memory."""
        return sum(a.nbytes for a in self)


@compiled
def _less_dipoles(c, cells, x, centroids, middles, moments, squares, sums, values):
    """Integrals over r with arms from the centroids of w, less the dipoles, of pairs of cells and
    points, times c."""
    for k in range(cells.shape[0]):
        j = cells[k]
        dx, dy = x[0, k] - middles[0, j], x[1, k] - middles[1, j]
        r2 = dx * dx + dy * dy
        f = 1.0 / (r2 * np.sqrt(r2)) if r2 > AT_REST * squares[j] else 0.0
        for i in range(2):
            arm = x[i, k] - centroids[i, j]
            fall = f * (moments[0, i, j] * dx + moments[1, i, j] * dy)
            values[i, k] = c * (sums[1 + i, k] + sums[0, k] * arm - fall)


@compiled
def _put_by_points(points, column, given, place, cells, values):
    """Put entries behind those that the rows of their points have."""
    for k in range(points.shape[0]):
        at = place[points[k]]
        cells[at], values[0, at], values[1, at] = column[k], given[0, k], given[1, k]
        place[points[k]] += 1


@vectorised
def _add_sloped(begin, end, near, slopes, out):
    starts, cells, values = near
    sets = slopes.shape[0]
    for i in range(begin, end):
        for s in range(0, sets - 2, 3):  # numbers and values are read once for three
            one, two, three = 0.0, 0.0, 0.0
            for k in range(starts[i], starts[i + 1]):
                j, along, across = cells[k], values[0, k], values[1, k]
                one += along * slopes[s, 0, j] + across * slopes[s, 1, j]
                two += along * slopes[s + 1, 0, j] + across * slopes[s + 1, 1, j]
                three += along * slopes[s + 2, 0, j] + across * slopes[s + 2, 1, j]
            out[s, i] += one
            out[s + 1, i] += two
            out[s + 2, i] += three
        for s in range(sets - sets % 3, sets):
            total = 0.0
            for k in range(starts[i], starts[i + 1]):
                j = cells[k]
                total += values[0, k] * slopes[s, 0, j] + values[1, k] * slopes[s, 1, j]
            out[s, i] += total
