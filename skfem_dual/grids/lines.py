"""Distance to lines."""

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..kernels.compiled import compiled, inputs

#: segments whose distance is looked at, and up to how many all of them are
NEAREST, FEW = 8, 256
#: squares of distances that differ by so much of them are the same
TIED = 1e-12


def segments(lines: list[ndarray]) -> tuple[ndarray, ndarray]:
    """Begins and ends of the segments of lines of shape (2, k), those without length left out."""
    a = np.hstack([line[:, :-1] for line in lines])
    b = np.hstack([line[:, 1:] for line in lines])
    real = np.hypot(*(b - a)) > 0
    return a[:, real], b[:, real]


def signed_distance(x: ndarray, lines: list[ndarray]) -> ndarray:
    """Distance of points of shape (2, m) to the nearest line, positive to its left.

    Of many segments those with the nearest middles are looked at: lines are finer than they are
    far.
    """
    a, b = segments(lines)
    out = np.empty(x.shape[1])
    near = np.empty((x.shape[1], 0), dtype=np.int64)
    if a.shape[1] > FEW:
        near = cKDTree((a + b).T / 2).query(x.T, NEAREST)[1]
    _signed(*inputs(x, a, b - a, near), out)
    return out


@compiled
def _signed(x, a, along, near, out):
    """Distances to the segments ``near`` each point, (m, k); to all of them where k is zero."""
    n, k = a.shape[1], near.shape[1]
    for i in range(x.shape[1]):
        least, nearest, side = np.inf, np.inf, 1.0
        for at in range(k or n):
            j = near[i, at] if k else at
            dx, dy, lx, ly = x[0, i] - a[0, j], x[1, i] - a[1, j], along[0, j], along[1, j]
            s = min(max((lx * dx + ly * dy) / (lx * lx + ly * ly), 0.0), 1.0)
            square = (dx - s * lx) ** 2 + (dy - s * ly) ** 2
            middle = (dx - lx / 2) ** 2 + (dy - ly / 2) ** 2
            # where two segments meet, that with the nearer middle tells the side
            tied = abs(square - least) <= TIED * least
            if middle < nearest if tied else square < least:
                least, nearest, side = square, middle, lx * dy - ly * dx
        out[i] = np.copysign(np.sqrt(least), side)
