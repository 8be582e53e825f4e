"""Triangles of weighted cells cut into strips between levels of the distance to the edge.

Each strip carries its exact mean of the weight as a uniform load. The strips are this project's
own; each is integrated by its ribs, see `segments`.
"""

import numpy as np

from ..kernels.compiled import compiled
from .law_moments import by_distance, factor_at
from .segments import WIDTH, put_segment

#: strips in a triangle that reaches from the edge on, in proportion fewer where the weight varies
#: less, and the fewest
STRIPS, FEWEST = 16, 3


@compiled
def strips_room(triangles, most):
    """Room for levels and densities of a triangle, and segments of a cell cut into strips."""
    room, pieces = max(most, FEWEST) + 2, 1
    for j in range(triangles.starts.shape[0] - 1):
        pieces = max(pieces, triangles.starts[j + 1] - triangles.starts[j])
    return (
        np.empty((room, 4)),
        np.empty((3, room)),
        np.empty((6, 3 * room * pieces + WIDTH)),
    )


@compiled
def strip_segments(triangles, j, most, room):
    """Sides of the strips of a cell, with ``w / mean(w) - 1`` on their left.

    Puts them into the ``room`` of `strips_room` and returns their number.
    """
    levels, strip, segments = room
    density = strip[0]
    count = 0
    for piece in range(triangles.starts[j], triangles.starts[j + 1]):
        strips, sign = cut_triangle(piece, triangles, j, most, levels, strip)
        before = 0.0
        for k in range(strips):
            ax, ay, bx, by = levels[k]
            ax1, ay1, bx1, by1 = levels[k + 1]
            here = sign * density[k]
            count = put_segment(segments, count, ax, ay, bx, by, here - before)
            count = put_segment(segments, count, bx, by, bx1, by1, here)
            count = put_segment(segments, count, ax, ay, ax1, ay1, -here)
            before = here
        ax, ay, bx, by = levels[strips]
        count = put_segment(segments, count, ax, ay, bx, by, -before)
    return count


@compiled
def cut_triangle(piece, triangles, j, most, levels, strip):
    """Cut a triangle of cell ``j`` into strips between levels of phi, ``most`` from the edge on.

    A level is a segment from the side between the lowest and the highest vertex to one of the
    others, whose length in parts of the longest is ``width``.

    Returns their number, and -1 if the levels run clockwise around them, else 1. ``levels`` takes
    begin and end of each level, ``strip`` what ``w / mean(w) - 1`` is between it and the next, and
    phi and the width of the level before they are moved, see `_centre`.
    """
    v0, v1, v2, sign = by_distance(piece, triangles)
    p, root, mean, law = triangles.p, triangles.root, triangles.mean[j], triangles.factors
    s0, s1, s2 = root[v0], root[v1], root[v2]
    strips = max(FEWEST, int(np.ceil(most * (s2 - s0) / s2)))
    # levels equidistant in the root, with the middle vertex among them
    lower, count = s0, 0
    ax, ay, bx, by = p[0, v0], p[1, v0], p[0, v0], p[1, v0]
    width, passed = 0.0, s1 * s1 == s0 * s0
    if passed:
        bx, by, width = p[0, v1], p[1, v1], 1.0
    density, phi, widths = strip
    levels[0] = ax, ay, bx, by
    phi[0], widths[0] = s0 * s0, width
    level = 1
    while level <= strips:
        upper = s0 + (s2 - s0) * level / strips if level < strips else s2
        if not passed and upper >= s1:
            upper, passed = s1, True
            if s1 == s2:
                level += 1
        else:
            level += 1
        ax, ay, bx, by, width1 = _level(upper, p, v0, v1, v2, s0, s1, s2)
        uniform = _mean_in_strip(lower, upper, width, width1, mean) / mean
        density[count] = uniform * _factor_in_strip(lower, upper, width, width1, law, j) - 1
        count += 1
        levels[count] = ax, ay, bx, by
        phi[count], widths[count] = upper * upper, width1
        lower, width = upper, width1
    _centre(levels, strip, count, p, v0, v1, v2, s0, s1, s2)
    return count, sign


@compiled
def _centre(levels, strip, count, p, v0, v1, v2, s0, s1, s2):
    """Move levels between strips until uniform loads on these act where those of the law do.

    Within a strip that is off the middle by a twelfth of the square of its width times the slope
    of the law's logarithm; the load of each strip remains.
    """
    density, phi, widths = strip
    lower, width = phi[0], widths[0]
    for k in range(1, count + 1):
        upper, width1 = phi[k], widths[k]
        load = (1 + density[k - 1]) * (widths[k - 1] + widths[k]) * (phi[k] - phi[k - 1])
        if k < count and phi[k] != s1 * s1:
            near = min(phi[k + 1] - phi[k], phi[k] - phi[k - 1]) / 4
            rise = (density[k] - density[k - 1]) / (density[k] + density[k - 1] + 2)
            upper += max(-near, min(near, (phi[k + 1] - phi[k - 1]) / 12 * rise))
            ax, ay, bx, by, width1 = _level(np.sqrt(upper), p, v0, v1, v2, s0, s1, s2)
            levels[k] = ax, ay, bx, by
        size = (width + width1) * (upper - lower)
        if size > 0.0:
            density[k - 1] = load / size - 1
        lower, width = upper, width1


@compiled
def _level(root, p, v0, v1, v2, s0, s1, s2):
    """Ends of the segment of a triangle on which phi is ``root^2``, and its relative length."""
    phi, phi0, phi1, phi2 = root * root, s0 * s0, s1 * s1, s2 * s2
    a = (phi - phi0) / (phi2 - phi0) if phi2 > phi0 else 1.0
    ax, ay = p[0, v0] + a * (p[0, v2] - p[0, v0]), p[1, v0] + a * (p[1, v2] - p[1, v0])
    if phi <= phi1:
        b = (phi - phi0) / (phi1 - phi0) if phi1 > phi0 else 1.0
        bx, by = p[0, v0] + b * (p[0, v1] - p[0, v0]), p[1, v0] + b * (p[1, v1] - p[1, v0])
        return ax, ay, bx, by, b
    b = (phi - phi1) / (phi2 - phi1)
    bx, by = p[0, v1] + b * (p[0, v2] - p[0, v1]), p[1, v1] + b * (p[1, v2] - p[1, v1])
    return ax, ay, bx, by, 1.0 - b


@compiled
def _mean_in_strip(lower, upper, width, width1, mean):
    """Mean of w between two roots of phi, exact, as the width is linear in phi.

    That of the whole cell where the strip is empty.
    """
    if upper + lower > 0.0 and width + width1 > 0.0:
        grow = (width1 - width) * (upper + 2 * lower) / (3 * (upper + lower))
        return 4 * (width + grow) / ((upper + lower) * (width + width1))
    return mean


@compiled
def _factor_in_strip(lower, upper, width, width1, law, cell):
    """Mean of the factor of the law there, by two points of Gauss; 1 on homogeneous ground."""
    if law.per_root[law.own[cell]] == 0.0:  # no table
        return law.values[law.own[cell], 0]
    total = weight = 0.0
    for side in (-1, 1):
        share = (1 + side / np.sqrt(3.0)) / 2
        root = lower + share * (upper - lower)
        # the width is linear in phi
        rise = share * (root + lower) / (upper + lower) if upper > 0.0 else share
        part = width + (width1 - width) * rise
        total += part * factor_at(law, cell, root)
        weight += part
    return total / weight if weight > 0.0 else 1.0
