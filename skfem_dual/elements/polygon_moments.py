"""Moments of polygons.

Source of the moments of a polygon as sums over its sides: C. Steger, On the calculation of
arbitrary moments of polygons, Technische Universitaet Muenchen, FGBV-96-05 (1996).
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..grids.polygons import Polygons, readonly
from ..kernels.compiled import inputs, vectorised
from ..kernels.threads import Threads

#: nanoseconds that a moment of a cell takes, with its sides
EACH = 12
#: points summed together
TOGETHER = 16


def polygon_moments(polygons: Polygons, degree: int, cells: ndarray | None = None) -> ndarray:
    """Integrals of ``x^i y^j / (i! j!)`` about the centroid of each polygon.

    Parameters
    ----------
    polygons : Polygons
    degree : int
        The greatest sum of i and j.
    cells : (k,) array of int, optional
        Polygons that are meant; by default all.

    Returns
    -------
    (degree + 1, degree + 1, k) array of float
        Zero where the sum is greater.
    """
    centres = polygons.centroids
    if cells is None:
        cells = np.arange(len(polygons))
    else:
        centres = centres.take(cells, axis=1)
    outline = polygons.p, polygons.indices, polygons.offsets, np.ones(len(polygons))
    out = moments_about(Loads(*outline, cells, cells + 1), centres, degree)
    out[1:2, 0] = out[0, 1:2] = 0.0  # about the centroid they vanish
    return out


class Loads(NamedTuple):
    """Loads of some polygons each.

    Attributes
    ----------
    p : (2, npoints) array of float
    indices : (k,) array of int
        Vertices of all polygons, counter-clockwise, one polygon after the other.
    offsets : (npolygons + 1,) array of int
        Where those of each polygon begin.
    density : (npolygons,) array of float
        Load per area.
    first, last : (n,) array of int
        The first polygon of each load, and the one behind its last.
    """

    p: ndarray
    indices: ndarray
    offsets: ndarray
    density: ndarray
    first: ndarray
    last: ndarray


def moments_about(loads: Loads, centres: ndarray, degree: int) -> ndarray:
    """Moments of loads about one point of each.

    Over the triangle of the point and a side, a monomial's integral is one along the side.
    """
    p, indices, offsets, density, first, last = loads
    indices, offsets, first, last = (
        np.asarray(a, np.int32) for a in (indices, offsets, first, last)
    )
    known = Loads(*inputs(p, indices, offsets, density, first, last))
    n = len(first)
    out = np.zeros((degree + 1, degree + 1, n))
    args = known, *inputs(centres), factorials(degree), _gauss(degree // 2 + 1)
    with Threads() as run:
        run(lambda k: _moments(k.start, k.stop, *args, out), n, EACH * (degree + 1) ** 2)
    return out


@cache
def factorials(degree: int) -> ndarray:
    """Those up to it."""
    return readonly(np.cumprod(np.arange(degree + 1).clip(1)), float)


@cache
def _gauss(n: int) -> tuple[ndarray, ...]:
    """Points and weights; eigenvalues that take longer than the moments of some hundred cells."""
    return inputs(*np.polynomial.legendre.leggauss(n))


@vectorised
def _moments(begin, end, loads, centres, factorials, rule, out):
    """Sums over the Gauss points of all sides of a load, of powers of x times powers of y."""
    p, indices, offsets, density, first, last = loads
    gauss, weights = rule
    n, most = factorials.shape[0], 0
    for k in range(begin, end):
        most = max(most, offsets[last[k]] - offsets[first[k]])
    room = most * gauss.shape[0] + TOGETHER
    x, y, powers = np.empty((n + 1, room)), np.empty((n + 1, room)), np.arange(n)
    over = 1 / ((powers[:, None] + powers + 2) * factorials[:, None] * factorials)
    for k in range(begin, end):
        count = 0
        for polygon in range(first[k], last[k]):
            before = indices[offsets[polygon + 1] - 1]
            vx, vy = p[0, before] - centres[0, k], p[1, before] - centres[1, k]
            for at in range(offsets[polygon], offsets[polygon + 1]):
                wx, wy = p[0, indices[at]] - centres[0, k], p[1, indices[at]] - centres[1, k]
                cross = density[polygon] * (vx * wy - vy * wx)
                for g in range(gauss.shape[0]):
                    s = (1 + gauss[g]) / 2
                    x[n, count], y[n, count] = vx + s * (wx - vx), vy + s * (wy - vy)
                    x[0, count], y[0, count] = weights[g] / 2 * cross, 1.0
                    count += 1
                vx, vy = wx, wy
        while count % TOGETHER:  # zeros: the compiler takes so many at a time
            x[n, count] = y[n, count] = x[0, count] = y[0, count] = 0.0
            count += 1
        for i in range(1, n):
            for s in range(count):
                x[i, s] = x[i - 1, s] * x[n, s]
                y[i, s] = y[i - 1, s] * y[n, s]
        for i in range(n):
            for j in range(n - i):
                total = 0.0
                for s in range(count):
                    total += x[i, s] * y[j, s]
                out[i, j, k] = total * over[i, j]
