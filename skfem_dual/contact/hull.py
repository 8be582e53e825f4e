"""Convex hulls of points: pressures that nowhere pull have their resultant in that of the points
where they act."""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy import ndarray
from scipy.spatial import ConvexHull, QhullError

from ..grids.planar import cross
from ..kernels.once import computed_once

#: points so near to a side of a polygon, by areas, are not inside
ROUNDING = 1e-9
#: points from which on those inside are left out before their convex hull is looked for
MANY = 100
#: and from which on they are not even kept
KEPT = 10_000
#: eight directions, counter-clockwise
EIGHT = np.array([[1.0, 1, 0, -1, -1, -1, 0, 1], [0, 1, 1, 1, 0, -1, -1, -1]]).T


@dataclass(frozen=True, eq=False)
class Hull:
    """Convex hull of some points, shape (2, n).

    Points on one line have no half-planes: they resist no tilt, which is found later.
    """

    points: ndarray

    def __post_init__(self) -> None:
        if self.points.shape[1] >= KEPT:
            object.__setattr__(self, "points", self._outer)

    @property
    def _outer(self) -> ndarray:
        """The points that are not inside the octagon."""
        amid = np.ones(self.points.shape[1], dtype=bool)
        for normal, offset in zip(*self._octagon):
            amid &= normal @ self.points > offset
        return self.points[:, ~amid]

    @computed_once
    def sides(self) -> tuple[ndarray, ndarray]:
        """Half-planes ``normals @ x + offsets <= 0``, shapes (k, 2) and (k,)."""
        points = self._outer if self.points.shape[1] >= MANY else self.points
        try:
            equations = ConvexHull(points.T).equations
        except QhullError:
            equations = np.empty((0, 3))
        return equations[:, :2], equations[:, 2]

    @computed_once
    def _octagon(self) -> tuple[ndarray, ndarray]:
        """That of the farthest points in eight directions: inside is ``normals @ x > offsets``,
        shapes (8, 2) and (8,)."""
        corners = self.points[:, [np.argmax(way @ self.points) for way in EIGHT]]
        along = np.diff(corners, axis=1, append=corners[:, :1])
        area = np.ptp(corners, axis=1).prod()
        offsets = cross(along, corners) + ROUNDING * area
        offsets[~along.any(axis=0)] = -np.inf if area > 0 else np.inf
        return np.stack([-along[1], along[0]], axis=1), offsets

    def holds(self, x: ndarray) -> bool:
        """Whether ``x`` does not lie outside; of most points inside a few points tell."""
        normals, offsets = self._octagon
        return bool((normals @ x > offsets).all()) or self.beyond(x) <= 0

    def beyond(self, x: ndarray) -> float:
        """How far ``x`` lies outside; negative inside."""
        normals, offsets = self.sides
        return float((normals @ x + offsets).max(initial=-np.inf))

    def inwards(self, x: ndarray) -> float:
        """How far ``x`` must move towards the middle of the points to lie in the hull."""
        normals, offsets = self.sides
        off = normals @ x + offsets
        if not off.max(initial=-np.inf) > 0:
            return 0.0
        way = self.points.mean(axis=1) - x
        with np.errstate(divide="ignore", invalid="ignore"):
            share = off / -(normals @ way)
        return float(share[off > 0].max() * np.hypot(*way))

    def beyond_ray(self, x: ndarray, along: ndarray) -> float:
        """The same for the point of the ray ``x + t along``, t >= 0, that is least far outside."""
        normals, offsets = self.sides
        if not along.any() or not len(offsets):
            return self.beyond(x)
        # least t, and least distance d, with normals @ (x + t along) + offsets <= d
        rate, size = normals @ along, np.ptp(self.points, axis=1).max()
        found = scipy.optimize.linprog(
            [0.0, 1.0],
            np.column_stack([rate / np.abs(rate).max(), -np.ones(len(rate))]),
            -(normals @ x + offsets) / size,
            bounds=[(0, None), (None, None)],
        )
        return float(size * found.x[1])
