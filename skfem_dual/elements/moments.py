"""Cells under pressure as forces, dipoles and higher moments about one point of each cell."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.compiled import inlined, inputs
from .edge_weights import EdgeWeights
from .pieces import Pieces
from .polygon_moments import Loads, moments_about, polygon_moments

#: moments up to this degree are kept
DEGREE = 5
#: series act outside of circles of so many radii of the cells; no point of a regular mesh lies on
#: one, where rounding would tell
INSIDE = 0.97


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
    def about_centroids(
        cls,
        partition: Partition,
        weights: EdgeWeights | None,
        degree: int = DEGREE,
        cells: ndarray | None = None,
    ) -> Self:
        """For the part c / r: of uniform cells, all or some, and what edge-weighted ones add."""
        cells = np.arange(len(partition)) if cells is None else cells
        moments = polygon_moments(partition.polygons, degree, cells)
        if weights is not None:
            own = np.nonzero(weights.weighted[cells])[0]
            number = weights.number[cells[own]]
            known = min(degree + 1, len(weights.moments))
            for i in range(known):
                some = slice(min(known, degree + 1 - i))
                moments[i, some, own] += weights.moments[i, some, number]
        return cls(partition.centroids.take(cells, axis=1), moments)


class Series(NamedTuple):
    """What edge-weighted cells add outside of circles around them, as kernels take it.

    Attributes
    ----------
    middles : (2, k) array of float
        Centroids of the cells.
    squares : (k,) array of float
        Of the radii of the circles.
    terms : (14, k) array of float
        Factors in the series of 1 / r up to the fourth degree, see `far_influence`.
    """

    middles: ndarray
    squares: ndarray
    terms: ndarray

    @classmethod
    def none(cls) -> Self:
        """Of no cells."""
        return cls(*inputs(np.empty((2, 0)), np.empty(0), np.empty((14, 0))))

    @classmethod
    def from_weights(cls, weights: EdgeWeights, coefficient: float) -> Self:
        """Of the weighted cells, ascending, for the influence function ``coefficient / r``."""
        partition, cells = weights.partition, weights.cells
        squares = (INSIDE * partition.polygons.radii[cells]) ** 2
        terms = series_terms(coefficient * weights.moments)
        return cls(*inputs(partition.centroids.take(cells, axis=1), squares, terms))


def series_terms(m: ndarray) -> ndarray:
    """Factors of moments up to the fourth degree, see `Multipoles`, in `far_influence`."""
    return _TERMS @ m[:5, :5].reshape(25, *m.shape[2:])


def _terms(m: ndarray) -> ndarray:
    even, odd = m[4, 0] + m[0, 4] - m[2, 2], m[3, 1] - m[1, 3]
    terms = [
        *(m[1, 0], m[0, 1]),
        *(2 * m[0, 2] - m[2, 0], 3 * (m[2, 0] - m[0, 2]), 3 * m[1, 1]),
        *(12 * m[1, 2] - 9 * m[3, 0], 15 * (m[3, 0] - m[1, 2])),
        *(6 * m[0, 3] - 3 * m[2, 1], 15 * (m[2, 1] - m[0, 3])),
        *(9 * m[4, 0] + 24 * m[0, 4] - 12 * m[2, 2],),
        *(105 * m[2, 2] - 90 * m[4, 0] - 120 * m[0, 4], 105 * even),
        *(60 * m[1, 3] - 45 * m[3, 1], 105 * odd),
    ]
    return np.stack(terms)


#: they are linear in the moments: those of one moment each, shape (14, 25)
_TERMS = _terms(np.eye(25).reshape(5, 5, 25))


@inlined
def far_influence(dx, dy, square, terms, k):
    """Settlement at (dx, dy) from the centroid of a cell by its `Series`; zero in the circle."""
    f, x, y, xx, xy = arms(dx, dy, square)
    return along_arms(f, x, y, xx, xy, terms, k)


@inlined
def arms(dx, dy, square):
    """The inverse of the distance, zero in a circle, and products of the direction."""
    r2 = dx * dx + dy * dy
    f = 1 / np.sqrt(r2) if r2 >= square else 0.0
    x, y = f * dx, f * dy
    return f, x, y, x * x, x * y


@inlined
def along_arms(f, x, y, xx, xy, terms, k):
    """The derivatives of 1 / r along (x, y) / r, x^2 + y^2 = r^2, as polynomials of x^2 / r^2."""
    first = terms[0, k] * x + terms[1, k] * y
    second = terms[2, k] + terms[3, k] * xx + terms[4, k] * xy
    third = x * (terms[5, k] + terms[6, k] * xx) + y * (terms[7, k] + terms[8, k] * xx)
    fourth = terms[9, k] + xx * (terms[10, k] + terms[11, k] * xx)
    fourth += xy * (terms[12, k] + terms[13, k] * xx)
    return f * f * (first + f * (second + f * (third + f * fourth)))


def pressure_moments(partition: Partition, weights: EdgeWeights | None, degree: int) -> ndarray:
    """As `polygon_moments`, but of edge-weighted cells those of their `Pieces`."""
    if weights is None:
        return polygon_moments(partition.polygons, degree)
    return load_moments(Pieces.from_partition(partition, weights), partition.centroids, degree)


def load_moments(pieces: Pieces, centres: ndarray, degree: int) -> ndarray:
    """As `polygon_moments`, of the loads on the cells of ``pieces`` about points (2, n)."""
    begin, end = pieces.first.min(), pieces.last.max()
    offsets = pieces.offsets[begin : end + 1]
    vertices = pieces.vertices[:, offsets[0] : offsets[-1]]
    outline = vertices, np.arange(vertices.shape[1]), offsets - offsets[0]
    own = pieces.density[begin:end], pieces.first - begin, pieces.last - begin
    return moments_about(Loads(*outline, *own), centres, degree)


def moved(moments: ndarray, arm: ndarray) -> ndarray:
    """Moments (d + 1, d + 1, k) about points from which theirs are at ``arm``, (2, k)."""
    d = len(moments) - 1
    powers = np.zeros((2, 2 * d + 1, arm.shape[1]))
    powers[:, d] = 1.0
    for i in range(1, d + 1):
        powers[:, d + i] = powers[:, d + i - 1] * arm / i
    lower = np.subtract.outer(np.arange(d + 1), np.arange(d + 1)) + d
    x, y = powers[0][lower], powers[1][lower]
    return np.einsum("iak,abk,jbk->ijk", x, moments, y, optimize=True)


def reach_of(pieces: Pieces, centres: ndarray) -> ndarray:
    """Distance of the farthest vertex of the load of each cell from a point, shape (n,)."""
    begin, end = pieces.first[0], pieces.last[-1]
    vertices = pieces.vertices[:, pieces.offsets[begin] : pieces.offsets[end]]
    starts = pieces.offsets[pieces.first] - pieces.offsets[begin]
    sizes = np.diff(np.append(starts, vertices.shape[1]))
    return np.maximum.reduceat(np.hypot(*(vertices - np.repeat(centres, sizes, axis=1))), starts)
