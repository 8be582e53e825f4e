"""Closed boundaries of domains: circles and polygons."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import FARTHEST, LARGEST, checked_array, checked_number, checked_points
from ..errors import MeshError
from ..kernels.once import computed_once
from ..messages import place
from .outline import distance_to_segments, inside_loops
from .planar import cross, line_crossings, rounding
from .polygons import some

#: how far apart nodes should be in points of shape (2, n)
Width = Callable[[ndarray], ndarray]
#: shares of a side at which that is asked: closer at the ends, as short sides are beyond these
ASKED = np.concatenate([[0.0], np.geomspace(1e-8, 0.02, 24), np.linspace(0.03, 0.5, 48)])
ASKED = np.concatenate([ASKED, 1 - ASKED[-2::-1]])
#: widths that differ by a smaller part are even
EVEN = 1e-3
#: corners of polygons nearer to sides and to each other than this part of the extent touch them
TOUCHING = 1e-11


@dataclass(frozen=True)
class Circle:
    """A boundary, whose polygons have the area of the circle or are inscribed in it."""

    centre: tuple[float, float]
    radius: float
    inscribed: bool = False

    @property
    def length(self) -> float:
        """Perimeter."""
        return 2 * np.pi * self.radius

    @property
    def least(self) -> int:
        """Smallest number of points."""
        return 3

    @computed_once
    def box(self) -> ndarray:
        """Lower left and upper right corner as columns."""
        return np.array(self.centre)[:, None] + self.radius * np.array([-1, 1])

    def points(self, k: int, width: "Width | None" = None) -> ndarray:
        """``k`` equally spaced points, whatever the width, counter-clockwise; shape (2, k)."""
        step = 2 * np.pi / k
        radius = self.radius * (1.0 if self.inscribed else np.sqrt(step / np.sin(step)))
        angle = step * np.arange(k)
        return np.array(self.centre)[:, None] + radius * np.stack([np.cos(angle), np.sin(angle)])

    def depth(self, x: ndarray) -> ndarray:
        """Distance of points to the boundary, negative outside."""
        return self.radius - np.hypot(*(x - np.array(self.centre)[:, None]))


@dataclass(frozen=True, eq=False)
class Polygon:
    """A boundary with the ``corners`` (2, k), counter-clockwise."""

    corners: ndarray

    @computed_once
    def _ends(self) -> ndarray:
        return np.roll(self.corners, -1, axis=1)

    @computed_once
    def _lengths(self) -> ndarray:
        return np.hypot(*(self._ends - self.corners))

    @property
    def length(self) -> float:
        """Perimeter."""
        return float(self._lengths.sum())

    @property
    def least(self) -> int:
        """Smallest number of points."""
        return self.corners.shape[1]

    @computed_once
    def box(self) -> ndarray:
        """Lower left and upper right corner as columns."""
        return np.stack([self.corners.min(axis=1), self.corners.max(axis=1)], axis=1)

    def points(self, k: int, width: "Width | None" = None) -> ndarray:
        """``k`` points, equally spaced on each side, or some as far apart as ``width`` has it,
        counter-clockwise; shape (2, k)."""
        least = np.ones(self.least, dtype=int)
        return self._at(*along(k, self._lengths, least, self._at, width))

    def _at(self, side: ndarray, share: ndarray) -> ndarray:
        """Points on sides, at shares of their lengths; shape (2, n)."""
        return self.corners[:, side] * (1 - share) + self._ends[:, side] * share

    def depth(self, x: ndarray) -> ndarray:
        """Distance of points to the boundary, negative outside."""
        distance = distance_to_segments(x, self.corners, self._ends)
        return np.where(inside_loops(x, self.corners, self._ends), distance, -distance)


class Curve(Protocol):
    """What a boundary offers."""

    @property
    def length(self) -> float:
        """Perimeter."""

    @property
    def least(self) -> int:
        """Smallest number of points."""

    @property
    def box(self) -> ndarray:
        """Lower left and upper right corner as columns."""

    def points(self, k: int, width: "Width | None" = None) -> ndarray:
        """``k`` points, or as many as distances of ``width`` take, counter-clockwise."""

    def depth(self, x: ndarray) -> ndarray:
        """Distance of points to the boundary, negative outside."""


def shares(total: int, lengths: ndarray, least: ndarray) -> ndarray:
    """``total`` parts dealt out in proportion to lengths; none gets less than ``least``."""
    exact = total * lengths / lengths.sum()
    parts = np.maximum(least, exact.astype(int))
    rest = max(0, total - parts.sum())
    parts[np.argsort(parts - exact, kind="stable")[:rest]] += 1
    while parts.sum() > total and (parts > least).any():
        parts[np.argmax(np.where(parts > least, parts - exact, -np.inf))] -= 1
    return parts


def along(
    k: int,
    lengths: ndarray,
    least: ndarray,
    at: Callable[[ndarray, ndarray], ndarray],
    width: Width | None = None,
) -> tuple[ndarray, ndarray]:
    """Sides and the shares of them where ``k`` points lie, the first of each side in its start.

    With a ``width`` as many as that takes: each side in parts of which all are as many widths
    long. ``at`` tells the points of sides and shares.
    """
    if width is None:
        parts = shares(k, lengths, least)
    else:
        number = np.repeat(np.arange(len(lengths)), len(ASKED))
        widths = width(at(number, np.tile(ASKED, len(lengths)))).reshape(-1, len(ASKED))
        low, high = widths[:, :-1], widths[:, 1:]
        even = np.abs(high - low) < EVEN * low
        # the mean of 1 / width where that is linear
        rise = np.where(even, 1.0, high - low)
        mean = np.where(even, 2 / (low + high), np.log(high / low) / rise)
        passed = np.cumsum(np.diff(ASKED) * mean * lengths[:, None], axis=1)
        parts = np.maximum(least, np.rint(passed[:, -1]).astype(int))
    side = np.repeat(np.arange(len(parts)), parts)
    first = np.cumsum(parts) - parts
    share = (np.arange(parts.sum()) - first[side]) / parts[side]
    if width is not None:
        for i in np.nonzero(parts > 1)[0]:
            own = side == i
            share[own] = np.interp(share[own] * passed[i, -1], np.append(0.0, passed[i]), ASKED)
    return side, share


def corners_of(name: str, corners: ArrayLike) -> ndarray:
    """The corners of a polygon, counter-clockwise."""
    array = checked_array(name, corners, None)
    if array.ndim == 2 and array.shape[1] == 2 < array.shape[0]:
        corners = array.T
    v = checked_points(name, corners, least=3)
    checked_number(f"coordinates of {name}", float(np.abs(v).max()), at_most=LARGEST)
    onward = np.roll(v, -1, axis=1)
    same = np.nonzero((v == onward).all(axis=0))[0]
    if len(same):
        raise ValueError(
            f"expected {name} without repeated corners, but those following corners {some(same)} "
            "are equal to them. Remedy: leave them out; the last is joined to the first"
        )
    twice = np.sum(cross(v - v[:, :1], onward - v[:, :1]))
    return v if twice > 0 else v[:, ::-1].copy()


def require_digits(box: ndarray) -> None:
    """Refuse an outline, by its box from least to greatest x and y, whose points are not apart.

    Farther off they have four digits left, or fewer.
    """
    size, away = np.ptp(box, axis=1).max(), np.abs(box).max()
    if away > FARTHEST * size:
        raise MeshError(
            f"expected an outline not farther from (0, 0) than {FARTHEST:g} times its size, "
            f"whose coordinates have digits left, got a size of {size:.3g} at {away:.3g}. "
            "Remedy: coordinates from a point nearby"
        )


def check_loops(loops: list[ndarray]) -> None:
    """Sides must not meet except in corners, and the holes lie inside the outline only."""
    a = np.hstack(loops)
    b = np.hstack([np.roll(v, -1, axis=1) for v in loops])
    require_digits(np.stack([a.min(axis=1), a.max(axis=1)], axis=1))
    digits = rounding(a)
    tolerance = TOUCHING * np.ptp(a, axis=1).max() + digits

    def same(p: ndarray, q: ndarray) -> ndarray:
        """Whether corners of all combinations are one."""
        return (np.abs(p[:, :, None] - q[:, None]) <= tolerance).all(axis=0)

    def turn(p: ndarray, q: ndarray, r: ndarray) -> ndarray:
        """Sense of the triangles of all combinations of a side and a corner."""
        u, w = (q - p)[:, :, None], r[:, None, :] - p[:, :, None]
        area, lengths = cross(u, w), (np.hypot(*u), np.hypot(*w))
        least = 1e-12 * lengths[0] * lengths[1] + digits * np.add(*lengths)
        return np.where(np.abs(area) <= least, 0, np.sign(area))

    def between(p: ndarray, q: ndarray, r: ndarray) -> ndarray:
        """Whether corners lie in the box of a side, on whose line they are."""
        low, high = np.minimum(p, q)[:, :, None], np.maximum(p, q)[:, :, None]
        return ((r[:, None] >= low - tolerance) & (r[:, None] <= high + tolerance)).all(axis=0)

    to_a, to_b = turn(a, b, a), turn(a, b, b)
    crossing = (to_a * to_b < 0) & (to_a * to_b < 0).T
    # a corner on a side that does not end in it; two sides that fold back have one, too
    touching = (to_a == 0) & between(a, b, a) & ~(same(a, a) | same(b, a))
    twice = np.triu(same(a, a), 1)
    bad = np.argwhere(crossing | touching | twice)
    if len(bad):
        i, j = bad[0]
        where = a[:, j]
        if crossing[i, j]:
            ends = (x[:, [k]] for k in (i, j) for x in (a, b))
            where = a[:, i] + line_crossings(*ends)[0] * (b - a)[:, i]
        raise ValueError(
            "expected outline and holes that neither cross nor touch themselves or each other; "
            f"they do near {place(where)}"
        )
    for i, hole in enumerate(loops[1:]):
        corner = hole[:, :1]
        if Polygon(loops[0]).depth(corner)[0] < 0:
            raise ValueError(f"expected hole {i} to lie inside the outline")
        for j, other in enumerate(loops[1:]):
            if j != i and Polygon(other).depth(corner)[0] > 0:
                raise ValueError(f"expected hole {i} to lie outside hole {j}")
