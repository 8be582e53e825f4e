"""Triangles of weighted cells cut into strips between levels of the distance to the edge.

Each strip carries a linear load with the force and the moment of the law in it. The strips are
this project's own; they are integrated by their sides, see `segments`.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..kernels.compiled import compiled, inputs, vectorised
from .graded_rule import gauss
from .law_moments import Triangles, by_distance, factor_at
from .segments import ROWS, WIDTH, put_segment

#: cells over which the law varies by more than this factor are steep
STEEP = 3.1
#: steep cells whose strips are kept, at some ten thousand bytes each
KEPT = 2000
#: strips of a cell that reaches from the edge on, in proportion fewer in triangles in which the
#: root of the distance varies less, and the fewest of these
STRIPS, FEWEST = 10, 2
#: strips are not one more for so much of one, and loads do not grow over roots that differ by less
ROUNDING = 1e-6
#: Gauss points in a strip: exact for its force and moment on homogeneous ground
POINTS, ALONG = gauss(4)


class Strips(NamedTuple):
    """What weighted cells are cut into for points in or beside them, as kernels take it.

    Attributes
    ----------
    steep : (k,) array of bool
        Weighted cells that are.
    starts : (k + 1,) array of int
        Where the segments of each begin; a steep one with none is cut when it is needed.
    segments : (m, ROWS) array of float
        See `put_segment`; in coordinates from the centroid of the cell.
    most : int
        Strips of a cell that reaches from the edge on.
    """

    steep: ndarray
    starts: ndarray
    segments: ndarray
    most: int

    @classmethod
    def of(cls, triangles: Triangles, centroids: ndarray, cells: ndarray) -> Self:
        """Of weighted cells cut into `STRIPS`; ``centroids`` are those of all cells."""
        steep, starts = np.empty(len(cells), bool), np.zeros(len(cells) + 1, np.int64)
        sizes = np.diff(triangles.starts)[cells]
        _steep(triangles, *inputs(cells), STEEP, steep)
        segments = np.empty((0, ROWS))
        if 0 < steep.sum() <= KEPT:
            room = strips_room(STRIPS, int(sizes.max()))
            segments = np.empty((len(room[0]) * 3 * int(sizes[steep].sum()), ROWS))
            _cut(triangles, *inputs(centroids, cells, steep), STRIPS, room, starts, segments)
        steep, starts, segments = inputs(steep, starts, segments[: starts[-1]])
        return cls(steep, starts, segments, STRIPS)


@vectorised
def _steep(triangles, cells, most, steep):
    """Whether the law varies over cells by more than a factor."""
    for k in range(cells.shape[0]):
        least, greatest = np.inf, 0.0
        for piece in range(triangles.starts[cells[k]], triangles.starts[cells[k] + 1]):
            for i in range(3):
                root = triangles.root[triangles.t[i, piece]]
                law = factor_at(triangles.factors, cells[k], root) / root
                least, greatest = min(least, law), max(greatest, law)
        steep[k] = greatest > most * least


@vectorised
def _cut(triangles, centroids, cells, steep, most, room, starts, segments):
    """Put the strips of steep cells one after the other."""
    for k in range(cells.shape[0]):
        starts[k + 1] = starts[k]
        if steep[k]:
            j = cells[k]
            middle = centroids[0, j], centroids[1, j]
            count = strip_segments(triangles, j, middle, most, room)
            for i in range(count):
                for row in range(ROWS):
                    segments[starts[k] + i, row] = room[1][row, i]
            starts[k + 1] += count


@compiled
def strips_room(most, pieces):
    """Room for the strips of a triangle cut into ``most``, and segments of so many triangles."""
    strips = max(most, FEWEST) + 2
    return np.empty((strips, 7)), np.empty((ROWS, 3 * strips * pieces + WIDTH))


@compiled
def kept_segments(kept, k, triangles, j, middle, room):
    """`strip_segments` of cell ``j``, the weighted one with the number ``k``, by those that are
    kept if they are."""
    begin, end = kept.starts[k], kept.starts[k + 1]
    if begin == end:
        return strip_segments(triangles, j, middle, kept.most, room)
    for row in range(ROWS):
        for i in range(end - begin):
            room[1][row, i] = kept.segments[begin + i, row]
    return end - begin


@compiled
def strip_segments(triangles, j, middle, most, room):
    """Sides of the strips of a cell, with ``w / mean(w) - 1`` on their left, from its middle: at
    corners strips are so narrow that they would not fit together in coordinates of a site.

    Puts them into the ``room`` of `strips_room` and returns their number.
    """
    levels, segments = room
    count, top = np.int64(0), 0.0
    for piece in range(triangles.starts[j], triangles.starts[j + 1]):
        for vertex in triangles.t[:, piece]:
            top = max(top, triangles.root[vertex])
    for piece in range(triangles.starts[j], triangles.starts[j + 1]):
        strips, gx, gy, sign = cut_triangle(piece, triangles, j, middle, most / top, levels)
        begin, end, slope = 0.0, 0.0, 0.0  # of the strip before
        for k in range(strips + 1):
            ax, ay, bx, by = levels[k, :4]
            past, fall = end, slope
            begin, end, slope = 0.0, 0.0, 0.0
            if k < strips:
                begin, end, slope = sign * levels[k, 4], sign * levels[k, 5], sign * levels[k, 6]
                ax1, ay1, bx1, by1 = levels[k + 1, :4]
                load = begin, slope * gx, slope * gy
                count = put_segment(segments, count, bx, by, bx1, by1, load)
                load = -begin, -slope * gx, -slope * gy
                count = put_segment(segments, count, ax, ay, ax1, ay1, load)
            load = begin - past, (slope - fall) * gx, (slope - fall) * gy
            count = put_segment(segments, count, ax, ay, bx, by, load)
    return count


@compiled
def cut_triangle(piece, triangles, j, middle, most, levels):
    """Cut a triangle of cell ``j`` into strips between levels of phi, ``most`` by its root.

    A level is a segment from the side between the lowest and the highest vertex to one of the
    others. ``levels`` takes begin and end of each and, of the linear load between it and the next
    that stands for ``w / mean(w) - 1``, the values on both and the slope over phi.

    Returns the number of strips, the gradient of phi, and -1 if the levels run clockwise around
    the strips, else 1.
    """
    v0, v1, v2, sign = by_distance(piece, triangles)
    p, root = triangles.p, triangles.root
    x0, y0 = p[0, v0] - middle[0], p[1, v0] - middle[1]
    x1, y1 = p[0, v1] - middle[0], p[1, v1] - middle[1]
    x2, y2 = p[0, v2] - middle[0], p[1, v2] - middle[1]
    corners = x0, y0, x1, y1, x2, y2
    s0, s1, s2 = root[v0], root[v1], root[v2]
    # where the law is constant, as out of contact, one is enough
    share = most * (s2 - s0)
    strips = max(FEWEST, int(np.ceil(share - ROUNDING))) if share > ROUNDING else 1
    # levels equidistant in the root, with the middle vertex among them
    lower, count = s0, 0
    levels[0, 0], levels[0, 1], levels[0, 2], levels[0, 3] = x0, y0, x0, y0
    width, passed = 0.0, s1 * s1 == s0 * s0
    if passed:
        levels[0, 2], levels[0, 3], width = x1, y1, 1.0
    level = 1
    while level <= strips:
        upper = s0 + (s2 - s0) * level / strips if level < strips else s2
        if not passed and upper >= s1:
            upper, passed = s1, True
            if s1 == s2:
                level += 1
        else:
            level += 1
        ax, ay, bx, by, width1 = _level(upper, corners, s0, s1, s2)
        _put_load(levels[count], lower, upper, width, width1, triangles, j)
        count += 1
        levels[count, 0], levels[count, 1] = ax, ay
        levels[count, 2], levels[count, 3] = bx, by
        lower, width = upper, width1
    ax, ay, bx, by = x1 - x0, y1 - y0, x2 - x0, y2 - y0
    twice, one, two = ax * by - ay * bx, s1 * s1 - s0 * s0, s2 * s2 - s0 * s0
    twice = np.inf if twice == 0.0 else twice  # without area
    return count, (one * by - two * ay) / twice, (two * ax - one * bx) / twice, sign


@compiled
def _level(root, corners, s0, s1, s2):
    """Ends of the segment of a triangle on which phi is ``root^2``, and its relative length."""
    x0, y0, x1, y1, x2, y2 = corners
    phi, phi0, phi1, phi2 = root * root, s0 * s0, s1 * s1, s2 * s2
    a = (phi - phi0) / (phi2 - phi0) if phi2 > phi0 else 1.0
    ax, ay = x0 + a * (x2 - x0), y0 + a * (y2 - y0)
    if phi <= phi1:
        b = (phi - phi0) / (phi1 - phi0) if phi1 > phi0 else 1.0
        return ax, ay, x0 + b * (x1 - x0), y0 + b * (y1 - y0), b
    b = (phi - phi1) / (phi2 - phi1)
    return ax, ay, x1 + b * (x2 - x1), y1 + b * (y2 - y1), 1.0 - b


@compiled
def _put_load(level, lower, upper, width, width1, triangles, j):
    """Load of the strip between two roots of phi, of widths linear in phi; see `cut_triangle`."""
    first, last = lower * lower, upper * upper
    force, moment, size, arm, square = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(POINTS.shape[0]):
        root = lower + POINTS[k] * (upper - lower)
        rise = POINTS[k] * (root + lower) / (upper + lower) if upper > 0.0 else POINTS[k]
        part = (width + (width1 - width) * rise) * ALONG[k]
        load, part = part * factor_at(triangles.factors, j, root), part * root
        force, moment = force + load, moment + load * rise
        size, arm, square = size + part, arm + part * rise, square + part * rise * rise
    level[4:] = 0.0
    if size > 0.0:
        mean, arm, slope = force / size, arm / size, 0.0
        if upper - lower > ROUNDING * upper:
            slope = (moment / size - arm * mean) / (square / size - arm * arm)
            slope /= triangles.mean[j]
            level[6] = slope / (last - first)
        level[4] = mean / triangles.mean[j] - 1 - slope * arm
        level[5] = level[4] + slope
