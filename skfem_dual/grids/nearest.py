"""The nearest of a few points, in one picture or in many."""

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..kernels.compiled import inputs, vectorised

#: pairs of points that are looked at one by one, in some milliseconds
ONE_BY_ONE = 2**20
#: squares of distances that differ by a smaller part are equal, and the first point is the nearer
TIE = 1e-9


def nearest(
    x: ndarray, starts: ndarray, at: ndarray, of: ndarray, count: int
) -> tuple[ndarray, ndarray]:
    """Numbers and squares of distances of the points nearest to others, in pictures.

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

    Returns
    -------
    (m, count) arrays of int and float
        Ascending; where a picture has fewer points, zero and infinite.
    """
    m = at.shape[1]
    if len(starts) == 2 and x.shape[1] * m > max(ONE_BY_ONE, count * m):
        distance, near = cKDTree(x.T).query(at.T, count)
        return near.reshape(m, count), distance.reshape(m, count) ** 2
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
            least = r * (1 + TIE)  # rounding decides nothing on mirror lines
            if least < farthest:
                k = count - 1
                while k > 0 and square[i, k - 1] > least:
                    square[i, k], near[i, k] = square[i, k - 1], near[i, k - 1]
                    k -= 1
                square[i, k], near[i, k] = r, j
                farthest = square[i, count - 1]
