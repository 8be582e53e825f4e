"""Planes fitted to values at scattered points."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..grids.nearest import nearest

#: neighbours over which planes are fitted
AROUND = 7
#: planes through points nearly on one line, by the determinant of their equations, are fitted
#: with more care; planes at a time
FLAT, CHUNK = 1e-5, 4096


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """Planes fitted to the nearest values of points, for any number of values.

    Attributes
    ----------
    near : (m, around) array of int
        The points each plane follows.
    inverse : (m, 3, around) array of float
        Value and both slopes of each plane by unit values there.
    """

    near: ndarray
    inverse: ndarray

    @classmethod
    def to_nearest(cls, x: ndarray, at: ndarray) -> "PlaneFit":
        """Planes at points ``at``, shape (2, m), each following the nearest of points ``x``."""
        n, of = x.shape[1], np.zeros(at.shape[1], dtype=int)
        return cls.to(x, at, nearest(x, np.array([0, n]), at, of, min(AROUND, n))[0])

    @classmethod
    def to(cls, x: ndarray, at: ndarray, near: ndarray) -> "PlaneFit":
        """The same by the numbers of those that each follows, (m, around)."""
        inverse = np.empty((len(near), 3, near.shape[1]))
        for begin in range(0, len(near), CHUNK):
            some = slice(begin, begin + CHUNK)
            inverse[some] = _planes(x[:, near[some]] - at[:, some, None])
        return cls(near, inverse)

    def values(self, values: ndarray) -> ndarray:
        """Values of the planes by some, or by each of k rows of them; shape (m,) or (k, m)."""
        return np.sum(self.inverse[:, 0] * values[..., self.near], axis=-1)

    def __call__(self, values: ndarray) -> ndarray:
        """Value and both slopes of each plane, shape (3, m)."""
        return (self.inverse @ values[self.near][..., None])[..., 0].T


def _planes(arm: ndarray) -> ndarray:
    """Values and slopes of m planes by unit values at k points, (m, 3, k), from (2, m, k)."""
    reach = np.hypot(*arm).max(axis=1, keepdims=True)
    rows = np.stack([np.ones(arm.shape[1:]), *(arm / reach)], axis=1)
    matrix = rows @ rows.swapaxes(1, 2)
    # points on one line give no slope across it
    clear = np.linalg.det(matrix) > FLAT * np.prod(np.diagonal(matrix, axis1=1, axis2=2), axis=1)
    inverse = np.empty(rows.shape)
    inverse[clear] = np.linalg.solve(matrix[clear], rows[clear])
    inverse[~clear] = np.linalg.pinv(rows[~clear].swapaxes(1, 2), rcond=1e-6)
    inverse[:, 1:] /= reach[:, :, None]
    return inverse
