"""Loads of cells as forces, dipoles and higher moments about one point of each cell."""

from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..grids.polygons import Polygons
from ..kernels.compiled import vectorised
from ..kernels.threads import in_blocks
from .edge_weights import EdgeWeights

#: moments up to this degree are kept
DEGREE = 5


@dataclass(frozen=True, eq=False)
class Loads:
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
    def singular(
        cls, partition: Partition, weights: EdgeWeights | None, degree: int = DEGREE
    ) -> "Loads":
        """For the part c / r: uniform cells, and dipoles where they are edge-weighted."""
        moments = polygon_moments(partition.polygons, degree)
        if weights is not None:
            moments[1, 0], moments[0, 1] = weights.moment
        return cls(partition.centroids, moments)

    @classmethod
    def regular(cls, partition: Partition, weights: EdgeWeights | None) -> "Loads":
        """For the remainder."""
        centres = partition.centroids if weights is None else weights.centroids
        return cls(centres, load_moments(partition, weights, 2))


def load_moments(partition: Partition, weights: EdgeWeights | None, degree: int) -> ndarray:
    """As `polygon_moments`, but of edge-weighted cells those of `EdgeWeights.load_moment`."""
    moments = polygon_moments(partition.polygons, degree)
    if weights is None:
        return moments
    cells = np.nonzero(weights.weighted)[0]
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            moment = weights.load_moment(i, j)[cells]
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
    in_blocks(lambda k: _moments(k.start, k.stop, *args, out), n)
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
