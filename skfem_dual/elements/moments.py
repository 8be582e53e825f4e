"""Cells under pressure as forces, dipoles and higher moments about one point of each cell.

Source of the moments of a polygon as sums over its sides: C. Steger, On the calculation of
arbitrary moments of polygons, Technische Universitaet Muenchen, FGBV-96-05 (1996).
"""

from dataclasses import dataclass
from math import factorial
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..grids.polygons import Polygons
from ..kernels.compiled import compiled, vectorised
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights

#: moments up to this degree are kept
DEGREE = 5


@dataclass(frozen=True, eq=False)
class Multipoles:
    """Cells under unit mean pressure, as seen from afar.

    Attributes
    ----------
    centres : (2, n) array of float
        Points to which the moments refer.
    moments : (k, k, n) array of float
        Integrals of ``x^i y^j`` times the pressure over ``i! j!``, zero for i + j >= k.
    """

    centres: ndarray
    moments: ndarray

    @classmethod
    def from_dipoles(
        cls, partition: Partition, weights: EdgeWeights | None, degree: int = DEGREE
    ) -> Self:
        """For the part c / r: uniform cells, and dipoles where they are edge-weighted."""
        moments = polygon_moments(partition.polygons, degree)
        if weights is not None:
            moments[1, 0], moments[0, 1] = weights.moment
        return cls(partition.centroids, moments)

    @classmethod
    def from_weights(cls, partition: Partition, weights: EdgeWeights | None) -> Self:
        """For the remainder: about the centroids of the pressure, of the second degree."""
        centres = partition.centroids if weights is None else weights.centroids
        return cls(centres, pressure_moments(partition, weights, 2))


class Dipoles(NamedTuple):
    """Dipoles of cells, as kernels take them.

    Attributes
    ----------
    middles : (2, n) array of float
        Centroids of the cells.
    moments : (2, n) array of float
        Times c, the coefficient of 1 / r.
    """

    middles: ndarray
    moments: ndarray


@compiled
def dipole_influence(dx, dy, mx, my):
    """Settlement at (dx, dy) from a dipole; zero in its middle."""
    r2 = dx * dx + dy * dy
    return (mx * dx + my * dy) / (r2 * np.sqrt(r2)) if r2 > 0.0 else 0.0


def pressure_moments(partition: Partition, weights: EdgeWeights | None, degree: int) -> ndarray:
    """As `polygon_moments`, but of edge-weighted cells those of `EdgeWeights.pressure_moment`."""
    moments = polygon_moments(partition.polygons, degree)
    if weights is None:
        return moments
    cells = np.nonzero(weights.weighted)[0]
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            moment = weights.pressure_moment(i, j)[cells]
            moments[i, j, cells] = moment / (factorial(i) * factorial(j))
    return moments


def polygon_moments(polygons: Polygons, degree: int) -> ndarray:
    """Integrals of ``x^i y^j / (i! j!)`` about the centroid of each polygon.

    Over the triangle of the centroid and a side, a monomial's integral is one along the side.

    Parameters
    ----------
    polygons : Polygons
    degree : int
        The greatest sum of i and j.

    Returns
    -------
    (degree + 1, degree + 1, n) array of float
        Zero where the sum is greater.
    """
    n = len(polygons)
    out = np.zeros((degree + 1, degree + 1, n))
    factorials = np.cumprod(np.arange(degree + 1).clip(1)).astype(float)
    gauss = np.polynomial.legendre.leggauss(degree // 2 + 1)
    args = polygons.p, polygons.indices, polygons.offsets, polygons.centroids, factorials, *gauss
    with Threads() as run:
        run(lambda k: _moments(k.start, k.stop, *args, out), n)
    return out


@vectorised
def _moments(begin, end, p, indices, offsets, centroids, factorials, gauss, weights, out):
    n = factorials.shape[0]
    for k in range(begin, end):
        cx, cy = centroids[0, k], centroids[1, k]
        last = indices[offsets[k + 1] - 1]
        vx, vy = p[0, last] - cx, p[1, last] - cy
        for at in range(offsets[k], offsets[k + 1]):
            wx, wy = p[0, indices[at]] - cx, p[1, indices[at]] - cy
            cross = vx * wy - vy * wx
            for g in range(gauss.shape[0]):
                s = (1 + gauss[g]) / 2
                x, y = vx + s * (wx - vx), vy + s * (wy - vy)
                power = weights[g] / 2 * cross
                for i in range(n):
                    value = power
                    for j in range(n - i):
                        out[i, j, k] += value / (i + j + 2)
                        value *= y
                    power *= x
            vx, vy = wx, wy
        for i in range(n):
            for j in range(n - i):
                out[i, j, k] /= factorials[i] * factorials[j]
        if n > 1:  # about the centroid these vanish
            out[1, 0, k] = out[0, 1, k] = 0.0


def radii(polygons: Polygons) -> ndarray:
    """Distance of the farthest vertex of each polygon from its centroid."""
    spokes = polygons.p[:, polygons.indices] - np.repeat(
        polygons.centroids, polygons.sizes, axis=1
    )
    return np.maximum.reduceat(np.hypot(*spokes), polygons.offsets[:-1])
