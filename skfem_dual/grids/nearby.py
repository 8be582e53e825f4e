"""Points in circles, for circles of all sizes.

Points are sorted into the squares of a grid, once for all circles of about one size: a circle
looks at the few squares that it meets.

Source: J. L. Bentley, D. F. Stanat and E. H. Williams, The complexity of finding fixed-radius near
neighbors, Inf. Process. Lett. 6 (1977) 209.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..kernels.compiled import compiled, inputs
from ..kernels.threads import Threads

#: rows and columns of squares at most
MOST = 2.0**30
#: so many pairs of a circle and a point are all looked at, sooner than points are sorted
FEW = 2**14
#: nanoseconds that a circle takes, about
CIRCLE = 300


class Squares(NamedTuple):
    """Points in the order of the squares in which they are, row by row.

    Attributes
    ----------
    x : (2, m) array of float
    numbers : (m,) array of int
        Numbers of the points.
    keys : (m,) array of int
        Row of the square of each times 2^32, and its column.
    corner : (2,) array of float
        Of the grid.
    side : float
        Of a square.
    """

    x: ndarray
    numbers: ndarray
    keys: ndarray
    corner: ndarray
    side: float

    @classmethod
    def of(cls, x: ndarray, side: float) -> Self:
        """Of points of shape (2, m), in squares with this side or larger ones."""
        corner = x.min(axis=1)
        side = max(side, float(np.ptp(x, axis=1).max()) / MOST)
        column, row = ((x - corner[:, None]) / side).astype(np.int64)
        keys = (row << 32) + column
        order = np.argsort(keys, kind="stable")
        x, numbers = x.take(order, axis=1), order.astype(np.int32)
        x, numbers, keys, corner = inputs(x, numbers, keys[order], corner)
        return cls(x, numbers, keys, corner, side)

    @classmethod
    def one(cls, x: ndarray) -> Self:
        """All points in one square."""
        m = x.shape[1]
        numbers, keys = np.arange(m, dtype=np.int32), np.zeros(m, np.int64)
        x, numbers, keys, corner = inputs(x, numbers, keys, np.zeros(2))
        return cls(x, numbers, keys, corner, np.inf)


def in_circles(radii: ndarray, centres: ndarray, x: ndarray) -> tuple[ndarray, ndarray]:
    """Numbers of the points in each circle, one circle after the other, and where those begin.

    Parameters
    ----------
    radii, centres : (k,), (2, k) array of float
        The circles.
    x : (2, m) array of float
        Points.

    Returns
    -------
    points : (npairs,) array of int
    offsets : (k + 1,) array of int

    Examples
    --------
    >>> import numpy as np
    >>> x = np.array([[0.0, 1.0, 3.0], [0.0, 0.0, 0.0]])
    >>> points, offsets = in_circles(np.array([1.5, 1.0]), x[:, :2], x)
    >>> points.tolist(), offsets.tolist()
    ([0, 1, 0, 1], [0, 2, 4])
    """
    offsets, points = np.zeros(len(radii) + 1, np.int64), np.empty(0, np.int32)
    if x.shape[1] == 0:
        return points, offsets
    if len(radii) * x.shape[1] <= FEW:
        rounds = [(np.arange(len(radii)), Squares.one(x))]
    else:
        # octaves from the largest one down: all circles of an even mesh are in one
        most = 1.000001 * float(radii.max(initial=0.0)) or 1.0
        size = np.frexp(radii / most)[1]
        sides = [(k, most * 2.0**k) for k in np.unique(size).tolist()]
        rounds = [(np.nonzero(size == k)[0], Squares.of(x, side)) for k, side in sides]
    circles = inputs(radii, centres)
    _look_around(rounds, circles, offsets[1:], points)
    np.cumsum(offsets, out=offsets)
    points = np.empty(offsets[-1], np.int32)
    _look_around(rounds, circles, offsets, points)
    return points, offsets


def _look_around(
    rounds: list[tuple[ndarray, Squares]],
    circles: tuple[ndarray, ...],
    places: ndarray,
    points: ndarray,
) -> None:
    with Threads() as run:
        for own, squares in rounds:

            def work(k: slice, own: ndarray = own, squares: Squares = squares) -> None:
                _look(*inputs(own[k]), *circles, squares, places, points)

            run(work, len(own), CIRCLE)


@compiled
def _look(own, radii, centres, squares, places, points):
    """Put the points in some circles from their ``places`` on, or without room their number."""
    x, numbers, keys, corner, side = squares
    for k in own:
        cx, cy, radius, at = centres[0, k], centres[1, k], radii[k], places[k]
        left, right = (cx - radius - corner[0]) / side, (cx + radius - corner[0]) / side
        below, above = (cy - radius - corner[1]) / side, (cy + radius - corner[1]) / side
        if right < 0.0 or above < 0.0 or left > MOST or below > MOST:
            continue
        count, first, last = 0, np.int64(max(left, 0.0)), np.int64(min(right, MOST))
        for row in range(np.int64(max(below, 0.0)), np.int64(min(above, MOST)) + 1):
            i = np.searchsorted(keys, (row << 32) + first)
            while i < keys.shape[0] and keys[i] <= (row << 32) + last:
                dx, dy = x[0, i] - cx, x[1, i] - cy
                if dx * dx + dy * dy <= radius * radius:
                    if points.shape[0] > 0:
                        points[at + count] = numbers[i]
                    count += 1
                i += 1
        if points.shape[0] == 0:
            places[k] = count
