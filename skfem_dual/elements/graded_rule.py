"""Quadrature over triangles of functions with an inverse square root at the edge of a plan."""

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy import ndarray

from ..grids.polygons import readonly
from ..kernels.compiled import compiled, inputs

TINY = float(np.finfo(float).tiny)
#: differences of phi over phi that are rounding
LEVEL = 1e-12


def area_of(vertices: ndarray) -> ndarray:
    """Areas of triangles in barycentric coordinates of another, over its area."""
    a, b, c = vertices.swapaxes(0, 1)
    return np.abs(np.sum(a * np.cross(b, c, axis=0), axis=0))


def graded(vertices: ndarray, square: ndarray, order: int) -> Iterator[tuple[ndarray, ndarray]]:
    """Points and weights for polynomials times ``phi^(-1/2)`` on pieces of triangles.

    A line of constant phi through the vertex in between cuts a piece in two, each a triangle
    with a side along which phi is constant. Between that side and the vertex opposite, in parts
    t of the way, ``t`` and ``phi^(-1/2) dt`` are polynomials of sqrt(phi).

    Parameters
    ----------
    vertices : (3, 3, k) array of float
        Barycentric coordinates of the vertices of each piece.
    square : (3, k) array of float
        phi at the vertices of the triangles.
    order : int
        Degree of the polynomials that are integrated exactly.

    Yields
    ------
    (3, k, q) and (k, q) array of float
        Barycentric coordinates and weights, for triangles of unit area.
    """
    tau, u = gauss(order + 2), gauss(order // 2 + 1)
    given, k, q = inputs(vertices, square, *tau, *u), square.shape[1], len(tau[0]) * len(u[0])
    for apex in (0, 2):
        at, load = np.empty((3, k, q)), np.empty((k, q))
        _fill(apex, *given, at, load)
        yield at, load


@cache
def gauss(n: int) -> tuple[ndarray, ndarray]:
    """Gauss points and weights on the unit interval."""
    x, w = np.polynomial.legendre.leggauss(n)
    return readonly((1 + x) / 2), readonly(w / 2)


@compiled
def _fill(apex, vertices, square, tau, along_tau, u, along_u, at, load):
    """The rule between the vertex of least or most phi, 0 or 2, and the one in between."""
    phi, rank = np.empty(3), np.empty(3, np.int64)
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    for k in range(square.shape[1]):
        for j in range(3):
            phi[j], rank[j] = 0.0, j
            for i in range(3):
                phi[j] += vertices[i, j, k] * square[i, k]
        for first in (0, 1, 0):  # by ascending phi
            if phi[rank[first]] > phi[rank[first + 1]]:
                rank[first], rank[first + 1] = rank[first + 1], rank[first]
        rise = phi[rank[2]] - phi[rank[0]]
        share = (phi[rank[1]] - phi[rank[0]]) / rise if rise > 0.0 else 0.0
        if rise <= LEVEL * phi[rank[2]]:  # rounding does not decide where it is cut
            rank[0], rank[1], rank[2], share = 0, 1, 2, 0.0
        low, middle, high, top = rank[0], rank[1], rank[2], rank[apex]
        for i in range(3):
            a[i], b[i], c[i] = vertices[i, top, k], vertices[i, middle, k], vertices[i, low, k]
            c[i] += share * (vertices[i, high, k] - c[i])
        area = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
        area = abs(area + a[2] * (b[0] * c[1] - b[1] * c[0]))
        root, across = np.sqrt(phi[top]), np.sqrt(phi[middle])
        total = max(root + across, TINY)  # without area where both are zero
        q = 0
        for m in range(tau.shape[0]):
            r = root * (1 - tau[m]) + across * tau[m]
            t = tau[m] * (root + r) / total
            for n in range(u.shape[0]):
                for i in range(3):
                    side = b[i] * (1 - u[n]) + c[i] * u[n]
                    at[i, k, q] = a[i] * (1 - t) + side * t
                load[k, q] = 4 * area * t / total * along_tau[m] * along_u[n]
                q += 1
