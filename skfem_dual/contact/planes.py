"""Planes fitted to values at scattered points."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..grids.evening import UNIT
from ..grids.nearest import Nearest, nearest
from ..kernels.compiled import inputs, vectorised

#: neighbours over which planes are fitted
AROUND = 7
#: planes through points nearly on one line, by the determinant of their equations, are fitted
#: with more care
FLAT = 1e-5


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """Planes fitted to the nearest values of points, for any number of values.

    Attributes
    ----------
    near : (m, k) array of int
        The points each plane follows.
    inverse : (m, 3, k) array of float
        Value and both slopes of each plane by unit values there.
    """

    near: ndarray
    inverse: ndarray

    @classmethod
    def to_nearest(cls, x: ndarray, at: ndarray, even: ndarray = UNIT) -> "PlaneFit":
        """Planes at points ``at``, shape (2, m), each following the nearest of points ``x``, under
        a linear map, (2, 2)."""
        n, of = x.shape[1], np.zeros(at.shape[1], dtype=int)
        near = nearest(even @ x, np.array([0, n]), even @ at, of, min(AROUND, n))
        return cls.to(x, at, near)

    @classmethod
    def to(cls, x: ndarray, at: ndarray, followed: Nearest) -> "PlaneFit":
        """The same by those that each follows."""
        near, _, share = followed
        inverse, flat = np.empty((len(near), 3, near.shape[1])), np.zeros(len(near), dtype=bool)
        _put_planes(*inputs(x, at, near, share), inverse, flat)
        if flat.any():
            arm = x[:, near[flat]] - at[:, flat, None]
            inverse[flat] = _without_slope_across(arm, share[flat])
        return cls(near, inverse)

    def values(self, values: ndarray) -> ndarray:
        """Values of the planes by some, or by each of k rows of them; shape (m,) or (k, m)."""
        return np.sum(self.inverse[:, 0] * values[..., self.near], axis=-1)

    def __call__(self, values: ndarray) -> ndarray:
        """Value and both slopes of each plane, shape (3, m)."""
        return (self.inverse @ values[self.near][..., None])[..., 0].T


@vectorised
def _put_planes(
    x: ndarray, at: ndarray, near: ndarray, share: ndarray, inverse: ndarray, flat: ndarray
) -> None:
    """Values and slopes of planes by unit values at points; marks those ``flat`` on a line."""
    count = near.shape[1]
    for i in range(len(near)):
        reach = 0.0
        for k in range(count):
            j = near[i, k]
            reach = max(reach, (x[0, j] - at[0, i]) ** 2 + (x[1, j] - at[1, i]) ** 2)
        reach = np.sqrt(reach)
        total, u, v, uu, uv, vv = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(count):
            j, w = near[i, k], share[i, k]
            a, b = (x[0, j] - at[0, i]) / reach, (x[1, j] - at[1, i]) / reach
            inverse[i, 1, k], inverse[i, 2, k] = a, b
            total, u, v = total + w, u + w * a, v + w * b
            uu, uv, vv = uu + w * a * a, uv + w * a * b, vv + w * b * b
        own, beside, across = uu * vv - uv * uv, uv * v - u * vv, u * uv - uu * v
        det = total * own + u * beside + v * across
        flat[i] = not det > FLAT * total * uu * vv
        for k in range(count):
            a, b = inverse[i, 1, k], inverse[i, 2, k]
            w = share[i, k] / det
            inverse[i, 0, k] = w * (own + beside * a + across * b)
            both = u * v - total * uv
            along = beside + (total * vv - v * v) * a + both * b
            upward = across + both * a + (total * uu - u * u) * b
            inverse[i, 1, k], inverse[i, 2, k] = w * along / reach, w * upward / reach


def _without_slope_across(arm: ndarray, share: ndarray) -> ndarray:
    """The same of points on lines, by their arms (2, m, k): no slope across these."""
    reach, root = np.hypot(*arm).max(axis=1, keepdims=True), np.sqrt(share)[:, None]
    rows = root * np.stack([np.ones(arm.shape[1:]), *(arm / reach)], axis=1)
    inverse = np.linalg.pinv(rows.swapaxes(1, 2), rcond=1e-6) * root
    inverse[:, 1:] /= reach[:, :, None]
    return inverse
