"""Distance to lines."""

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from .planar import cross

#: segments whose distance is looked at
NEAREST = 8
#: points at a time, so that what they take stays in the cache
CHUNK = 4096


def segments(lines: list[ndarray]) -> tuple[ndarray, ndarray]:
    """Begins and ends of the segments of lines of shape (2, k), those without length left out."""
    a = np.hstack([line[:, :-1] for line in lines])
    b = np.hstack([line[:, 1:] for line in lines])
    real = np.hypot(*(b - a)) > 0
    return a[:, real], b[:, real]


def signed_distance(x: ndarray, lines: list[ndarray]) -> ndarray:
    """Distance of points of shape (2, m) to the nearest line, positive to its left.

    Of segments those with the nearest middles are looked at: lines are finer than they are far.
    """
    a, b = segments(lines)
    middles = cKDTree((a + b).T / 2)
    out = np.empty(x.shape[1])
    for begin in range(0, x.shape[1], CHUNK):
        part = x[:, begin : begin + CHUNK]
        near = middles.query(part.T, min(NEAREST, a.shape[1]))[1].reshape(part.shape[1], -1)
        along, arm = (b - a)[:, near], part[:, :, None] - a[:, near]
        s = (np.sum(along * arm, axis=0) / np.sum(along**2, axis=0)).clip(0, 1)
        distance = np.sum((arm - s * along) ** 2, axis=0)
        nearest = np.argmin(distance, axis=1)[:, None]
        side = np.take_along_axis(cross(along, arm), nearest, axis=1)
        distance = np.sqrt(np.take_along_axis(distance, nearest, axis=1))
        out[begin : begin + CHUNK] = np.copysign(distance, side)[:, 0]
    return out
