"""Quadrature over triangles of functions with an inverse square root at the edge of a plan."""

from collections.abc import Iterator

import numpy as np
from numpy import ndarray

TINY = float(np.finfo(float).tiny)


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

    Yields
    ------
    (3, k, q) and (k, q) array of float
        Barycentric coordinates and weights, for triangles of unit area.
    """
    phi = np.einsum("ijk,ik->jk", vertices, square)
    rank = np.argsort(phi, axis=0)
    phi = np.take_along_axis(phi, rank, axis=0)
    low, between, high = np.take_along_axis(vertices, rank[None], axis=1).swapaxes(0, 1)
    rise = phi[2] - phi[0]
    share = np.divide(phi[1] - phi[0], rise, out=np.zeros_like(rise), where=rise > 0)
    opposite = low + share * (high - low)
    tau, along_tau = (a[:, None] for a in gauss(order + 2))
    u, along_u = (a[None] for a in gauss(order // 2 + 1))
    root = np.sqrt(phi)
    for apex, at_apex in ((low, root[0]), (high, root[2])):
        # without area where both are zero
        total = (at_apex + root[1]).clip(TINY)[:, None, None]
        r = at_apex[:, None, None] * (1 - tau) + root[1][:, None, None] * tau
        t = tau * (at_apex[:, None, None] + r) / total
        side = between[..., None, None] * (1 - u) + opposite[..., None, None] * u
        at = apex[..., None, None] * (1 - t) + side * t
        area = area_of(np.stack([apex, between, opposite], axis=1))[:, None, None]
        load = 4 * area * t / total * along_tau * along_u
        yield at.reshape(3, len(r), -1), load.reshape(len(r), -1)


def gauss(n: int) -> tuple[ndarray, ndarray]:
    """Gauss points and weights on the unit interval."""
    x, w = np.polynomial.legendre.leggauss(n)
    return (1 + x) / 2, w / 2
