"""Integrals over polygons at points near them, many sides together.

As in `ribs` they are sums over the sides, of any segments with their factors. The gradient of r is
the unit vector away from the field point: by Gauss's theorem the integral of that over a polygon
is that of r along its sides, times their outward normals.

Source: D. R. Wilton et al., Potential integrals for uniform and linear source distributions on
polygonal and polyhedral domains, IEEE Trans. Antennas Propag. 32 (1984).
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.nearby import in_circles
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from .ribs import FAR, atanh_series

#: segments that are looked at together, and what is known of each
WIDTH, ROWS = 32, 8
#: logarithm of 2, and the square root of 1/2 as an integer of the same bits
LOG2, ROOT_HALF = float(np.log(2.0)), int(np.sqrt(0.5).view(np.int64))


class Pairs(NamedTuple):
    """Cells and the points near them.

    Attributes
    ----------
    cells : (k,) array of int
    x : (2, npairs) array of float
        Points, those of a cell one after the other.
    offsets : (k + 1,) array of int
        The first point of each cell.
    points : (npairs,) array of int
        Their numbers.
    """

    cells: ndarray
    x: ndarray
    offsets: ndarray
    points: ndarray

    @classmethod
    def within(cls, radii: ndarray, cells: ndarray, centres: ndarray, x: ndarray) -> Self:
        """Points ``x`` in circles around the ``centres`` of some cells."""
        points, offsets = in_circles(radii, centres, x)
        return cls(*inputs(cells.astype(np.int32), x.take(points, axis=1), offsets, points))


@compiled
def put_segment(segments, count, ax, ay, bx, by, load):
    """Put a segment behind ``count`` others, unless it is a point; returns how many there are.

    ``segments`` of shape (ROWS, k) has the begin of each, the unit vector to its end, its length
    and its ``load``: by how much that on its left is more than on its right where it begins, and
    by how much that grows along x and y. There is room for `WIDTH` more than are put.
    """
    lx, ly = bx - ax, by - ay
    length = np.sqrt(lx * lx + ly * ly)
    if length == 0.0:
        return count
    segments[0, count], segments[1, count] = ax, ay
    segments[2, count], segments[3, count] = lx / length, ly / length
    segments[4, count] = length
    segments[5, count], segments[6, count], segments[7, count] = load
    return count + 1


@inlined
def from_point(dx, dy, ux, uy, length):
    """Where a segment along (ux, uy) lies from a point at (dx, dy) from where it begins.

    Its height over the point, how far along it begins, the distances of both its ends, and the
    ratio whose logarithm is the integral of 1 / r along it, one where that is multiplied by zero.
    """
    ex, ey = dx - length * ux, dy - length * uy
    d1, d2 = np.sqrt(dx * dx + dy * dy), np.sqrt(ex * ex + ey * ey)
    h, t1 = ux * dy - uy * dx, -(ux * dx + uy * dy)
    t2 = t1 + length
    on_line = abs(h) <= 1e-17 * length or d1 == 0.0 or d2 == 0.0
    h = 0.0 if on_line else h
    u1, u2 = d1 + abs(t1), d2 + abs(t2)
    above = u2 if t1 >= 0 else (u1 if t2 <= 0 else u1 * u2)
    below = u1 if t1 >= 0 else (u2 if t2 <= 0 else h * h)
    return h, t1, d1, d2, 1.0 if on_line else above / below


@vectorised
def add_segments(x, begin, end, segments, count, sums):
    """Add to ``sums`` what some segments give to integrals at the points from begin to end.

    Parameters
    ----------
    x : (2, m) array of float
        Points.
    begin, end : int
        Those that are meant.
    segments : (ROWS, k) array of float
        See `put_segment`. The polygon is on their left.
    count : int
        Number of segments.
    sums : (3, m) array of float
        Integrals of the loads over r, and times both components of the unit vectors from the
        points.
    """
    room = np.empty((7, WIDTH))
    bits = room.view(np.int64)
    for k in range(count, -(-count // WIDTH) * WIDTH):
        for row in range(ROWS):
            segments[row, k] = segments[row, 0] if row < 5 else 0.0
    for point in range(begin, end):
        x0, y0 = x[0, point], x[1, point]
        total, across, upward = 0.0, 0.0, 0.0
        for first in range(0, count, WIDTH):
            for i in range(WIDTH):
                dx, dy = x0 - segments[0, first + i], y0 - segments[1, first + i]
                ux, uy = segments[2, first + i], segments[3, first + i]
                length = segments[4, first + i]
                h, t1, d1, d2, ratio = from_point(dx, dy, ux, uy, length)
                room[0, i] = ratio
                room[1, i], room[2, i], room[3, i] = h, (t1 + length) * d2 - t1 * d1, d1 + d2
                room[6, i] = (d2 * d2 * d2 - d1 * d1 * d1) / 3
            # no logarithm of several numbers is known: that of 2^k m is k log(2) + log(m)
            for i in range(WIDTH):
                power = (bits[0, i] - ROOT_HALF) >> 52
                bits[4, i] = bits[0, i] - (power << 52)
                room[5, i] = power
            for i in range(WIDTH):
                m, h, together, k = room[4, i], room[1, i], room[3, i], first + i
                ux, uy, length = segments[2, k], segments[3, k], segments[4, k]
                near = together <= FAR * length
                q = (m - 1 if near else length) / (m + 1 if near else together)
                log2 = room[5, i] * LOG2 if near else 0.0
                value = h * (log2 + 2 * q * atanh_series(q * q))
                along = 0.5 * (room[2, i] + h * value)
                # the load in the line of the point, and its growth across the segment
                gx, gy = segments[6, k], segments[7, k]
                here = segments[5, k] + gx * (x0 - segments[0, k]) + gy * (y0 - segments[1, k])
                rise = gx * uy - gy * ux
                total += here * value + rise * along
                outward, forward = (here + rise * h) * along, rise * room[6, i]
                across += uy * outward + ux * forward - gx * h * along / 3
                upward += uy * forward - ux * outward - gy * h * along / 3
        sums[0, point] += total
        sums[1, point] += across
        sums[2, point] += upward
