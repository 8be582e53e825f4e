"""How smooth pressures bend inside the cells, by the means of those around.

Slopes alone leave jumps between cells, and the mean in place of the greatest value where a
pressure has its peak. By the means of the cells up to the second ring the pressure in one is::

    p = q + g . (x - c) + (x - c) . H (x - c) / 2 - <(x - c) . H (x - c)> / 2

where ``< >`` is the mean over the cell, so that q remains the mean. Slope g and curvature H are
those nearest, in the mean square, to the means of the other cells, nearer ones first. They are
there where they explain these better than a plane does and leave the pressure positive.

Source: T. J. Barth, Recent developments in high order k-exact reconstruction on unstructured
meshes, AIAA Paper 93-0668 (1993).
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from .slopes import Slopes

#: cells of which a quadratic follows the means, at least
FEWEST = 8
#: eigenvalues of its equations, over the greatest, below which it is not known
ON_A_CONIC = 1e-3
#: the square of what it leaves unexplained, over that of a plane, at most
BETTER = 0.2


class Curvature(NamedTuple):
    """Pressures of the second degree inside n cells.

    Attributes
    ----------
    slopes : (2, n) array of float
        In the centroids.
    bends : (3, n) array of float
        Second derivatives along xx, xy and yy; zero where the pressure is linear.
    spread : (3, n) array of float
        Means of the products of the coordinates from the centroid.
    """

    slopes: ndarray
    bends: ndarray
    spread: ndarray

    @classmethod
    def of(cls, slopes: Slopes, pressure: ndarray) -> Self:
        """Where cells have ``slopes``, under mean pressures of shape (n,), none negative."""
        partition, n = slopes.partition, len(pressure)
        own = slopes.sloped
        cell, other = _rings(slopes, own)
        xx, xy, yy = partition.polygons.second_moments / partition.areas
        spread, size = np.array([xx, xy, yy]), np.sqrt(partition.areas)[cell]
        x, y = (partition.centroids[:, other] - partition.centroids[:, cell]) / size
        mean = np.array([x * x, x * y, y * y]) + (spread[:, other] - spread[:, cell]) / size**2
        terms = np.array([x, y, mean[0] / 2, mean[1], mean[2] / 2])
        weight, rise = 1 / (x * x + y * y) ** 2, pressure[other] - pressure[cell]

        def sums(values: ndarray) -> ndarray:
            return np.bincount(cell, weight * values, n)

        matrix = np.array([[sums(a * b) for a in terms] for b in terms]).transpose(2, 0, 1)
        right = np.array([sums(a * rise) for a in terms]).T
        known = own & (np.bincount(cell, minlength=n) >= FEWEST)
        matrix[~known] = np.eye(5)
        value = np.linalg.eigvalsh(matrix)
        known &= value[:, 0] > ON_A_CONIC * value[:, -1]
        matrix[~known] = np.eye(5)
        found = np.linalg.solve(matrix, right[..., None])[..., 0]
        plane = np.linalg.solve(matrix[:, :2, :2], right[:, :2, None])[..., 0]
        total = sums(rise * rise)
        left = total - np.sum(found * right, axis=1)
        known &= left <= BETTER * (total - np.sum(plane * right[:, :2], axis=1))
        size = np.sqrt(partition.areas)
        curved = cls(found[:, :2].T / size, found[:, 2:].T / size**2, spread)
        known &= curved._least(slopes, pressure) >= 0
        linear = slopes.of(pressure)
        bends = np.where(known, curved.bends, 0.0)
        return cls(np.where(known, curved.slopes, linear), bends, spread)

    def _least(self, slopes: Slopes, pressure: ndarray) -> ndarray:
        """What the pressure in each cell does not fall below, shape (n,)."""
        polygons = slopes.partition.polygons
        cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
        arm = polygons.p[:, polygons.indices] - slopes.partition.centroids[:, cell]
        rise = np.minimum.reduceat(
            np.sum(self.slopes[:, cell] * arm, axis=0), polygons.offsets[:-1]
        )
        reach = np.maximum.reduceat(np.sum(arm * arm, axis=0), polygons.offsets[:-1])
        xx, xy, yy = self.bends
        lowest = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
        return pressure + rise + lowest.clip(max=0) * reach / 2 - self._mean

    @property
    def _mean(self) -> ndarray:
        """Mean of the terms of second degree over each cell."""
        return np.array([0.5, 1.0, 0.5]) @ (self.bends * self.spread)

    def rise(self, cell: ndarray, arm: ndarray) -> ndarray:
        """Pressure less its mean in some cells, at points of shape (2, ...) from the centroids."""
        x, y = arm
        xx, xy, yy = self.bends[:, cell]
        bent = (xx * x * x + yy * y * y) / 2 + xy * x * y - self._mean[cell]
        return np.sum(self.slopes[:, cell] * arm, axis=0) + bent


def _rings(slopes: Slopes, own: ndarray) -> tuple[ndarray, ndarray]:
    """Pairs of cells with slopes, the second up to the second ring around the first."""
    around = abs(slopes.matrix[: len(own)]) + abs(slopes.matrix[len(own) :])
    beside = csr_matrix((np.ones(around.nnz), around.indices, around.indptr), shape=around.shape)
    pairs = (beside @ beside).tocoo()
    keep = own[pairs.row] & own[pairs.col] & (pairs.row != pairs.col)
    return pairs.row[keep], pairs.col[keep]
