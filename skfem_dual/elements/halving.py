"""Triangles whose sides are halved until their parts are far from a point, for a rule on each."""

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from ..kernels.compiled import compiled

#: triangles are far if their size over the distance is less; they are cut so often at most
FAR, CUTS = 0.7, 12
#: shape of a stack of triangles, each with the coordinates of its corners
ROOM = 3 * CUTS + 4, 6

_at, _weights = get_quadrature(RefTri, 6)
#: barycentric coordinates of the points of a rule, and their weights, 1 together
RULE, RULE_WEIGHTS = np.vstack([1 - _at.sum(axis=0), _at]), 2 * _weights


@compiled
def size_of(triangle):
    """Square of the longest side."""
    ax, ay, bx, by, cx, cy = triangle
    size = max((bx - ax) ** 2 + (by - ay) ** 2, (cx - ax) ** 2 + (cy - ay) ** 2)
    return max(size, (cx - bx) ** 2 + (cy - by) ** 2)


@compiled
def next_part(x, y, stack, height, square, smallest):
    """Cut the last of the triangles in a stack until one is far from a point, and take that off.

    Distances are from (x, y) with a ``square`` added to theirs; triangles are not cut any more
    whose size has the square ``smallest``. Returns the height of the stack that is left, which is
    where the triangle taken off is found.
    """
    while True:
        height -= 1
        ax, ay, bx, by, cx, cy = stack[height]
        distance = (x - (ax + bx + cx) / 3) ** 2 + (y - (ay + by + cy) / 3) ** 2 + square
        if size_of(stack[height]) <= max(FAR * FAR * distance, smallest):
            return height
        dx, dy, ex, ey = (ax + bx) / 2, (ay + by) / 2, (bx + cx) / 2, (by + cy) / 2
        fx, fy = (cx + ax) / 2, (cy + ay) / 2
        parts = (
            (ax, ay, dx, dy, fx, fy),
            (dx, dy, bx, by, ex, ey),
            (fx, fy, ex, ey, cx, cy),
            (dx, dy, ex, ey, fx, fy),
        )
        for part in parts:
            for c in range(6):
                stack[height, c] = part[c]
            height += 1
