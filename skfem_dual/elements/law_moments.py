"""Moments of the law of the edge over cells, for what they do far away.

A line of constant phi through the vertex in between cuts a triangle in two, each with a side along
which phi is constant; quadrature on them is that of `graded_rule`.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..kernels.compiled import compiled, inlined, inputs, vectorised
from .graded_rule import TINY, gauss
from .polygon_moments import factorials

#: moments of fewer degrees than these are kept; constants make loops over them short
ORDERS = 5
FACTORIALS = factorials(ORDERS - 1)
#: Gauss points and weights onward from an apex, and along the side opposite to it
TAU, ALONG_TAU = gauss(ORDERS + 1)
U, ALONG_U = gauss(ORDERS // 2 + 1)
POINTS = len(TAU) * len(U)


class LawFactors(NamedTuple):
    """Factors of laws over ``phi^(-1/2)``, as kernels take them.

    Attributes
    ----------
    values : (k, m) array of float
        The factor of each law at m equidistant roots of phi from zero on; constant beyond.
    per_root : (k,) array of float
        Steps between them, over the root.
    own : (n,) array of int
        The law of each cell.
    """

    values: ndarray
    per_root: ndarray
    own: ndarray


class Triangles(NamedTuple):
    """Triangles that fill cells, and the weight on them.

    Attributes
    ----------
    p : (2, k) array of float
        Vertices.
    t : (3, ntriangles) array of int
        Vertices of each triangle, those of a cell one after the other.
    root : (k,) array of float
        Square root of phi at the vertices.
    starts : (n + 1,) array of int
        The first triangle of each cell.
    mean : (n,) array of float
        Mean of w over each cell.
    factors : LawFactors
        The law of each cell over phi^(-1/2).
    """

    p: ndarray
    t: ndarray
    root: ndarray
    starts: ndarray
    mean: ndarray
    factors: LawFactors

    @classmethod
    def none(cls, n: int) -> Self:
        """Of n cells that are not weighted."""
        own, starts = np.zeros(n, dtype=np.int32), np.zeros(n + 1, dtype=np.int64)
        p, t, root, starts, mean = inputs(
            np.empty((2, 0)), np.empty((3, 0), dtype=np.int32), np.empty(0), starts, np.ones(n)
        )
        factors = LawFactors(*inputs(np.ones((1, 2)), np.zeros(1), own))
        return cls(p, t, root, starts, mean, factors)


def law_moments(triangles: Triangles, centres: ndarray, cells: ndarray) -> ndarray:
    """Integrals of ``x^i y^j / (i! j!)`` times ``w / mean(w) - 1`` about one point of some cells.

    Parameters
    ----------
    triangles : Triangles
        Those that fill the cells.
    centres : (2, n) array of float
        A point of each cell.
    cells : (k,) array of int
        The cells, weighted ones.

    Returns
    -------
    (ORDERS, ORDERS, k) array of float
        Zero where the sum of i and j is ORDERS or more, and for i = j = 0.
    """
    out = np.zeros((ORDERS, ORDERS, len(cells)))
    _add_moments(triangles, *inputs(centres, cells), out)
    return out


@inlined
def factor_at(factors, cell, root):
    """The factor of the law of a cell where the square root of phi is ``root``."""
    values, law = factors.values, factors.own[cell]
    last = values.shape[1] - 1
    place = min(root * factors.per_root[law], float(last))
    step = min(int(place), last - 1)
    value = values[law, step]
    return value + (place - step) * (values[law, step + 1] - value)


@compiled
def by_distance(piece, triangles):
    """Vertices of a triangle by ascending distance, -1 if that reverses their rotation, else 1."""
    root, t = triangles.root, triangles.t
    v0, v1, v2, sign = t[0, piece], t[1, piece], t[2, piece], 1.0
    if root[v0] > root[v1]:
        v0, v1, sign = v1, v0, -sign
    if root[v1] > root[v2]:
        v1, v2, sign = v2, v1, -sign
    if root[v0] > root[v1]:
        v0, v1, sign = v1, v0, -sign
    return v0, v1, v2, sign


@vectorised
def _add_moments(triangles, centres, cells, out):
    p, root, starts = triangles.p, triangles.root, triangles.starts
    most = 0
    for j in cells:
        most = max(most, starts[j + 1] - starts[j])
    points, power = np.empty((3, 2 * most * POINTS)), np.empty(2 * most * POINTS)
    for k in range(cells.shape[0]):
        j, count = cells[k], 0
        cx, cy = centres[0, j], centres[1, j]
        for piece in range(starts[j], starts[j + 1]):
            low, between, high, _ = by_distance(piece, triangles)
            rise = root[high] ** 2 - root[low] ** 2
            share = (root[between] ** 2 - root[low] ** 2) / rise if rise > 0.0 else 0.0
            share = min(max(share, 0.0), 1.0)  # whatever rounding makes of equal distances
            bx, by = p[0, between] - cx, p[1, between] - cy
            # the centre first: it is far off where the coordinates are those of a site
            ox = (p[0, low] - cx) + share * (p[0, high] - p[0, low])
            oy = (p[1, low] - cy) + share * (p[1, high] - p[1, low])
            for apex in (low, high):
                corners = p[0, apex] - cx, p[1, apex] - cy, bx, by, ox, oy
                _put_points(corners, root[apex], root[between], triangles, j, points, count)
                count += POINTS
        x, y, load = points
        for a in range(ORDERS):
            for i in range(count):
                power[i] = load[i]
                load[i] *= x[i]
            for b in range(ORDERS - a):
                total = 0.0
                for i in range(count):
                    total += power[i]
                    power[i] *= y[i]
                out[a, b, k] = total / (FACTORIALS[a] * FACTORIALS[b])
        out[0, 0, k] = 0.0


@inlined
def _put_points(corners, at_apex, at_side, triangles, j, points, count):
    """Put points of a triangle with constant phi along the side opposite to its apex, and their
    loads, behind ``count`` others.

    They are some parts of the way from the apex to that side, and some parts along it.
    """
    ax, ay, bx, by, ox, oy = corners
    scale, share = 1 / triangles.mean[j], 1 / max(at_apex + at_side, TINY)
    size = 2 * share * abs((bx - ax) * (oy - ay) - (by - ay) * (ox - ax))
    for k in range(TAU.shape[0]):
        root = at_apex + (at_side - at_apex) * TAU[k]
        t = TAU[k] * (at_apex + root) * share
        over = factor_at(triangles.factors, j, root) * scale - root
        load = size * t * ALONG_TAU[k] * over
        for i in range(U.shape[0]):
            at = count + k * U.shape[0] + i
            points[0, at] = ax + t * (bx + U[i] * (ox - bx) - ax)
            points[1, at] = ay + t * (by + U[i] * (oy - by) - ay)
            points[2, at] = load * ALONG_U[i]
