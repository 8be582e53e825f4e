"""The nearest of a few points, in one picture or in many."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..kernels.compiled import inputs, vectorised

#: pairs of points that are looked at one by one, in some milliseconds
ONE_BY_ONE = 2**20
#: squares of distances that differ by a smaller part of them are equal
TIE = 1e-4
#: so many points more are looked at, as on regular grids up to four are as near as the last one,
#: and so many times as many while all of them are
TIED = 4


class Nearest(NamedTuple):
    """Points nearest to m others.

    Attributes
    ----------
    number : (m, k) array of int
        Those of the points, ascending by distance but for ties.
    square : (m, k) array of float
        Squares of the distances; infinite where a picture has fewer points.
    share : (m, k) array of float
        How much each counts: one, or as large a part as there are places left, of those that are
        equally far, or nothing.
    """

    number: ndarray
    square: ndarray
    share: ndarray


def nearest(x: ndarray, starts: ndarray, at: ndarray, of: ndarray, count: int) -> Nearest:
    """The ``count`` points nearest to others, in pictures.

    All that are as far as the last one are among them, with equal shares of the places that are
    left: neither the order of the points nor rounding decides which of them are meant.

    Parameters
    ----------
    x : (2, n) array of float
        Points, those of a picture one after the other.
    starts : (k + 1,) array of int
        The first ones of k pictures.
    at : (2, m) array of float
        Other points.
    of : (m,) array of int
        Their pictures.
    count : int
        How many are looked for.
    """
    most, more = int(np.diff(starts).max(initial=0)), TIED
    while True:
        number, square = _sorted(x, starts, at, of, min(count + more, max(most, count)))
        last = square[:, count - 1 : count]
        found = (square <= (1 + TIE) * last) & np.isfinite(square)
        if not found[:, count + more - 1 :].any():
            break
        more *= TIED
    with_ties = found.sum(axis=1).max(initial=count)
    number, square, found = (each[:, :with_ties] for each in (number, square, found))
    if with_ties == count:
        return Nearest(number, square, found.astype(float))
    nearer = square < (1 - TIE) * last
    tied = found & ~nearer
    places = count - nearer.sum(axis=1, keepdims=True)
    share = np.where(tied, places / tied.sum(axis=1, keepdims=True).clip(1), nearer)
    return Nearest(number, square, share)


def _sorted(
    x: ndarray, starts: ndarray, at: ndarray, of: ndarray, count: int
) -> tuple[ndarray, ndarray]:
    """Numbers and squares of distances, ascending, shape (m, count)."""
    m = at.shape[1]
    if len(starts) == 2 and x.shape[1] * m > max(ONE_BY_ONE, count * m):
        distance, near = cKDTree(x.T).query(at.T, range(1, count + 1))
        return near, distance**2
    near, square = np.zeros((m, count), dtype=np.int64), np.empty((m, count))
    _nearest(*inputs(x, starts, at, of), near, square)
    return near, square


@vectorised
def _nearest(x, starts, at, of, near, square):
    count = near.shape[1]
    for i in range(at.shape[1]):
        x0, y0, farthest = at[0, i], at[1, i], np.inf
        square[i, :] = np.inf
        for j in range(starts[of[i]], starts[of[i] + 1]):
            dx, dy = x[0, j] - x0, x[1, j] - y0
            r = dx * dx + dy * dy
            if r < farthest:
                k = count - 1
                while k > 0 and square[i, k - 1] > r:
                    square[i, k], near[i, k] = square[i, k - 1], near[i, k - 1]
                    k -= 1
                square[i, k], near[i, k] = r, j
                farthest = square[i, count - 1]
