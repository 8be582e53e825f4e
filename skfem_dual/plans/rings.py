"""Closed outlines of straight sides and arcs."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..grids.curves import Width, along
from ..grids.planar import cross
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly, computed_once
from .sides import Sides

#: an arc has a node for so much of its angle at least
COARSEST = np.pi / 6
#: directions that differ by less, in radians, make no corner
SMOOTH = 1e-4


@dataclass(frozen=True, eq=False)
class Ring(ReadOnly):
    """A closed line with ``corners`` (2, k) and bulges (k,) of the sides that start there.

    It is a boundary as those of `grids.curves`; its polygons have the area within it.
    """

    corners: ndarray
    bulges: ndarray

    @classmethod
    def circle(cls, centre: ndarray, radius: float) -> "Ring":
        """A circle, as two halves."""
        ends = centre[:, None] + radius * np.array([[1.0, -1.0], [0.0, 0.0]])
        return cls(readonly(ends), readonly(np.ones(2)))

    @computed_once
    def sides(self) -> Sides:
        """Its sides."""
        return Sides(self.corners, np.roll(self.corners, -1, axis=1), self.bulges)

    @property
    def reversed(self) -> "Ring":
        """The same in the other sense."""
        return Ring(readonly(self.corners[:, ::-1]), readonly(-np.roll(self.bulges[::-1], -1)))

    @property
    def area(self) -> float:
        """Area within, negative if clockwise."""
        return float(self._moments[0])

    @property
    def first_moments(self) -> ndarray:
        """Integrals of the coordinates within, negative if clockwise."""
        return self._moments[1:] + self._moments[0] * self.corners[:, 0]

    @computed_once
    def _moments(self) -> ndarray:
        """Area and first moments from the first corner, for the digits far from the origin."""
        local = Sides(
            self.corners - self.corners[:, :1], self.sides.end - self.corners[:, :1], self.bulges
        )
        twice = cross(local.start, local.end)
        first = ((local.start + local.end) * twice).sum(axis=1) / 6 + local.moments().sum(axis=1)
        return np.append(twice.sum() / 2 + local.areas().sum(), first)

    @property
    def length(self) -> float:
        """Perimeter."""
        return float(self.sides.length.sum())

    @computed_once
    def box(self) -> ndarray:
        """Lower left and upper right corner as columns."""
        x = self.sides.extremes()
        return np.stack([x.min(axis=1), x.max(axis=1)], axis=1)

    @computed_once
    def turns(self) -> ndarray:
        """Change of direction in each corner, from -pi to pi, positive to the left."""
        begin, end = self.sides.directions
        return np.pi - np.mod(np.pi - begin + np.roll(end, 1), 2 * np.pi)

    @computed_once
    def is_circle(self) -> bool:
        """Whether it is one circle."""
        sides = self.sides
        if not (sides.curved.all() and np.all(np.abs(self.turns) < SMOOTH)):
            return False
        apart = np.hypot(*(sides.centre - sides.centre[:, :1])) + np.ptp(sides.radius)
        return bool(apart.max() < 1e-9 * sides.radius[0])

    @property
    def _least(self) -> ndarray:
        """Fewest pieces of each side."""
        arcs = np.ceil(np.abs(self.sides.angle) / COARSEST - 1e-9).astype(int)
        return np.where(self.sides.curved, np.maximum(arcs, 2), 1)

    @property
    def least(self) -> int:
        """Smallest number of points."""
        return int(self._least.sum())

    def points(self, k: int, width: Width | None = None) -> ndarray:
        """``k`` points, equally spaced on each side, or some as far apart as ``width`` has it, in
        its sense; shape (2, k)."""
        if self.is_circle:
            least = np.array([self.least])
            _, share = along(k, np.array([self.length]), least, self._around, width)
            return self.moved_to_area(self._around(0, share), np.zeros(len(share), dtype=int))
        side, share = along(k, self.sides.length, self._least, self.sides.at, width)
        return self.moved_to_area(self.sides.at(side, share), side)

    def _around(self, _side: object, share: ndarray) -> ndarray:
        """Points of a circle, at shares of all of it; shape (2, n)."""
        angle, centre = 2 * np.pi * share, self.sides.centre[:, :1]
        arm = self.corners[:, :1] - centre
        turned = np.stack([-arm[1], arm[0]]) * np.sign(self.bulges[0])
        return centre + np.cos(angle) * arm + np.sin(angle) * turned

    def moved_to_area(self, x: ndarray, side: ndarray) -> ndarray:
        """Points in order along the ring, those inside arcs moved along their radii.

        The polygon through them then has the area of the arcs, where these have inner points.

        Parameters
        ----------
        x : (2, n) array of float
            Points on or near the ring.
        side : (n,) array of int
            The side each lies on; corners belong to the side that starts there.
        """
        x = x.copy()
        if self.is_circle:
            arm = x - self.sides.centre[:, :1]
            arm = self.sides.radius[0] * arm / np.hypot(*arm)
            factor = _factors(np.hstack([arm, arm[:, :1]]), 2 * np.pi, closed=True)
            return self.sides.centre[:, :1] + factor * arm
        for i in np.nonzero(self.sides.curved)[0]:
            inner = np.nonzero(side == i)[0][1:]
            if len(inner) == 0:
                continue
            centre, radius = self.sides.centre[:, i : i + 1], self.sides.radius[i]
            ends = self.sides.start[:, i : i + 1], self.sides.end[:, i : i + 1]
            arm = np.hstack([ends[0], x[:, inner], ends[1]]) - centre
            arm = radius * arm / np.hypot(*arm)
            factor = _factors(arm, np.abs(self.sides.angle[i]), closed=False)
            x[:, inner] = centre + factor * arm[:, 1:-1]
        return x

    def depth(self, x: ndarray) -> ndarray:
        """Distance of points to the ring, negative outside."""
        return np.where(self.sides.winding(x) != 0, 1, -1) * self.sides.distance(x)


def _factors(arm: ndarray, angle: float, *, closed: bool) -> ndarray:
    """Factors of radii under which points have the area of an arc.

    Each is moved about as far as its own chords need: those of other length leave the arc where
    it is, and second moments of the area are right, too, to the fourth order.

    Parameters
    ----------
    arm : (2, n) array of float
        Points in order along the arc from its centre; the first again at the end if it is
        ``closed``, otherwise both ends stay.
    angle : float
        That of the arc.

    Returns
    -------
    (n - 1,) or (n - 2,) array of float
        Of all points, or of those between the ends.
    """
    along = np.sum(arm[:, :-1] * arm[:, 1:], axis=0)
    step = np.abs(np.arctan2(cross(arm[:, :-1], arm[:, 1:]), along))
    # sectors miss step^3 / 12 each, half of which the points on both sides move by: where an end
    # stays all of it falls to the other one, or moments would be off
    missed = step**3
    if not closed:
        missed[[0, -1]] *= 2
    shift = (missed + np.roll(missed, 1)) / (step + np.roll(step, 1))
    shift = np.append(shift, shift[0] if closed else 0.0)
    shift[0] *= closed
    a, b, sine = shift[:-1], shift[1:], np.sin(step)
    square, linear, missing = np.sum(a * b * sine), np.sum((a + b) * sine), angle - sine.sum()
    factor = 1 + 2 * missing / (linear + np.sqrt(linear**2 + 4 * square * missing)) * shift
    return factor[:-1] if closed else factor[1:-1]
