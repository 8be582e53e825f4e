"""Sides of outlines: straight edges and arcs of circles."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..grids.outline import distance_to_segments
from ..grids.planar import cross
from ..kernels.once import computed_once

#: arcs flatter than this, rise over half the chord, are straight
FLAT = 1e-9
#: bulge below which areas of arcs are sums of its powers, to 1e-12 of them
SHALLOW = 0.03
#: pairs of points and sides looked at together, for the memory to stay small
CHUNK = 2**20
#: parts of an arc whose ends stand for it in a hull: 5e-6 of the radius of a half-circle
AROUND = 512


@dataclass(frozen=True, eq=False)
class Sides:
    """Some sides, each from a start to an end.

    Attributes
    ----------
    start, end : (2, k) array of float
        Their ends.
    bulge : (k,) array of float
        Tangent of a quarter of the angle of the arc: 0 for a straight side, 1 for half a circle,
        positive if the arc turns left, counter-clockwise. As in DXF.
    """

    start: ndarray
    end: ndarray
    bulge: ndarray

    @computed_once
    def chord(self) -> ndarray:
        """From start to end, shape (2, k)."""
        return self.end - self.start

    @computed_once
    def angle(self) -> ndarray:
        """Angles of the arcs, positive if they turn left, 0 for straight sides; shape (k,)."""
        return np.where(self.curved, 4 * np.arctan(self.bulge), 0.0)

    @computed_once
    def curved(self) -> ndarray:
        """Which sides are arcs; shape (k,)."""
        return np.abs(self.bulge) > FLAT

    @computed_once
    def radius(self) -> ndarray:
        """Radii of the arcs, infinite for straight sides; shape (k,)."""
        b = np.where(self.curved, np.abs(self.bulge), np.inf)
        return np.where(self.curved, np.hypot(*self.chord) * (b + 1 / b) / 4, np.inf)

    @computed_once
    def centre(self) -> ndarray:
        """Centres of the arcs, the middles of straight sides; shape (2, k)."""
        b = np.where(self.curved, self.bulge, 1.0)
        return (self.start + self.end) / 2 + _left(self.chord) * (1 / b - b) / 4

    @computed_once
    def length(self) -> ndarray:
        """Lengths along the sides; shape (k,)."""
        radius = np.where(self.curved, self.radius, 0.0)
        return np.where(self.curved, radius * np.abs(self.angle), np.hypot(*self.chord))

    @computed_once
    def directions(self) -> tuple[ndarray, ndarray]:
        """Directions in the starts and in the ends, angles from the first axis."""
        along = np.arctan2(self.chord[1], self.chord[0])
        return along - self.angle / 2, along + self.angle / 2

    def at(self, side: ndarray, share: ndarray) -> ndarray:
        """Points on the sides, at shares of their lengths; shape (2, n)."""
        straight = self.start[:, side] * (1 - share) + self.end[:, side] * share
        arm, turn = (self.start - self.centre)[:, side], self.angle[side] * share
        arc = self.centre[:, side] + np.cos(turn) * arm + np.sin(turn) * _left(arm)
        inner = self.curved[side] & (share > 0) & (share < 1)  # ends are met exactly
        return np.where(inner, arc, straight)

    def shares(self, x: ndarray, side: ndarray) -> ndarray:
        """Shares of the lengths at which points lie on, or beside, one side each; shape (n,)."""
        chord, arm = self.chord[:, side], x - self.start[:, side]
        straight = np.sum(arm * chord, axis=0) / np.sum(chord**2, axis=0)
        if not self.curved[side].any():
            return straight
        first, arm = (self.start - self.centre)[:, side], x - self.centre[:, side]
        angle = self.angle[side]
        turn = np.arctan2(np.sign(angle) * cross(first, arm), np.sum(first * arm, axis=0))
        # as far before the start as after the end of an arc is neither
        before = (2 * np.pi - np.abs(angle)) / 2
        turn = np.mod(turn + before, 2 * np.pi) - before
        return np.where(self.curved[side], turn / np.where(angle, np.abs(angle), 1), straight)

    def areas(self) -> ndarray:
        """Areas between arcs and their chords, positive to the right of these; shape (k,)."""
        b = np.where(self.curved, self.bulge, 1.0)
        whole = ((1 + b**2) ** 2 * np.arctan(b) - b * (1 - b**2)) / (8 * b**2)
        small = np.where(self.curved & (np.abs(b) < SHALLOW), b, 0.0)
        series = small / 3 + small**3 / 15 - small**5 / 105 + small**7 / 315
        share = np.where(small == 0, whole, series)  # of the square of the chord
        return np.where(self.curved, share, 0.0) * np.sum(self.chord**2, axis=0)

    def moments(self) -> ndarray:
        """First moments of these areas; shape (2, k)."""
        b = np.where(self.curved, np.abs(self.bulge), 1.0)
        length = np.hypot(*self.chord)
        unit = np.where(length > 0, length, 1.0)
        areas = self.areas()
        # about the middle of the chord: about centres far away of flat arcs nothing would be left
        whole = 1 / 12 - np.abs(areas) / unit**2 * (1 - b**2) / (4 * b)
        small = np.where(b < SHALLOW, b, 0.0)
        series = small**2 / 15 + 2 * small**4 / 105 - small**6 / 315
        share = np.where(small == 0, whole, series) * self.curved
        outward = -np.sign(self.bulge) * _left(self.chord) / unit
        about = areas * (self.start + self.end) / 2
        return about + np.sign(self.bulge) * length**3 * share * outward

    def around(self) -> ndarray:
        """Starts, and points that divide arcs into `AROUND` parts; shape (2, n)."""
        arcs, share = np.nonzero(self.curved)[0], np.arange(1, AROUND) / AROUND
        on = self.at(np.repeat(arcs, len(share)), np.tile(share, len(arcs)))
        return np.hstack([self.start, on])

    def extremes(self) -> ndarray:
        """Ends, and the points of arcs farthest along the axes; shape (2, n)."""
        axes = np.array([[1.0, 0, -1, 0], [0, 1, 0, -1]])
        arcs = np.nonzero(self.curved)[0]
        far = self.centre[:, arcs, None] + self.radius[arcs, None] * axes[:, None]
        on = self._within(far.reshape(2, -1), np.repeat(arcs, 4))
        return np.hstack([self.start, self.end, far.reshape(2, -1)[:, on]])

    def distance(self, x: ndarray) -> ndarray:
        """Distance of points of shape (2, m) to the nearest side; shape (m,)."""
        distance, straight = np.full(x.shape[1], np.inf), ~self.curved
        if straight.any():
            distance = distance_to_segments(x, self.start[:, straight], self.end[:, straight])
        for i in np.nonzero(self.curved)[0]:
            np.minimum(distance, self.distance_to(x, np.array([i])), out=distance)
        return distance

    def distance_to(self, x: ndarray, side: ndarray) -> ndarray:
        """Distance of points to one side each; shape (m,)."""
        chord = self.chord[:, side]
        offset = x - self.start[:, side]
        s = np.sum(offset * chord, axis=0) / np.sum(chord**2, axis=0)
        straight = np.hypot(*(offset - np.clip(s, 0, 1) * chord))
        with np.errstate(invalid="ignore"):  # inf - inf of straight sides
            arc = np.abs(np.hypot(*(x - self.centre[:, side])) - self.radius[side])
        ends = np.minimum(np.hypot(*offset), np.hypot(*(x - self.end[:, side])))
        arc = np.where(self._within(x, side), arc, ends)
        return np.where(self.curved[side], arc, straight)

    def winding(self, x: ndarray) -> ndarray:
        """How often the sides, that close one or more rings, go round points; shape (m,)."""
        out = np.empty(x.shape[1], dtype=int)
        step = max(1, CHUNK // len(self.bulge))
        for i in range(0, len(out), step):
            out[i : i + step] = self._winding(x[:, i : i + step])
        return out

    def _winding(self, x: ndarray) -> ndarray:
        """Sum of the angles under which the sides are seen."""
        a, b = (end[:, None] - x[:, :, None] for end in (self.start, self.end))
        side = cross(a, b) + 0.0  # no -0.0, whose angle would be -pi
        seen = np.arctan2(side, np.sum(a * b, axis=0)).sum(axis=1)
        arcs = np.nonzero(self.curved)[0]
        if len(arcs):  # round points between chord and arc the arc goes the other way
            side, left = side[:, arcs], self.angle[arcs] > 0
            away = np.hypot(*(x[:, :, None] - self.centre[:, None, arcs]))
            between = (away < self.radius[arcs]) & np.where(left, side < 0, side >= 0)
            seen += 2 * np.pi * (between * np.where(left, 1, -1)).sum(axis=1)
        return np.rint(seen / (2 * np.pi)).astype(int)

    def _within(self, x: ndarray, side: ndarray) -> ndarray:
        """Whether points lie in the sectors of the arcs ``side``."""
        first = (self.start - self.centre)[:, side]
        arm, sense = x - self.centre[:, side], np.sign(self.angle[side])
        turn = np.arctan2(sense * cross(first, arm), np.sum(first * arm, axis=0))
        return np.mod(turn, 2 * np.pi) <= np.abs(self.angle[side]) * (1 + 1e-12)


def bulge_through(start: ndarray, through: ndarray, end: ndarray) -> float:
    """Bulge of the arc from one point to another through a third."""
    u, v = start - through, end - through
    # the angle in the third point is pi less half the angle of the arc
    half = np.pi - np.abs(np.arctan2(cross(u, v), np.dot(u, v)))
    return float(np.tan(half / 2) * np.sign(cross(v, u)))


def _left(v: ndarray) -> ndarray:
    """Vectors turned to the left by a right angle."""
    return np.stack([-v[1], v[0]])
