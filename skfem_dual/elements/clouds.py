"""Loads on cells as points with weights, for influence functions that are smooth over the cell.

The points lie on rings in a circle around each cell, where they determine a polynomial of some
degree; the weights have the moments of the load up to that degree. So the integral is exact for
polynomials of that degree, and otherwise has the error of the best of them in the circle.

Source of the rings: L. Bos, Multivariate interpolation and polynomial inequalities, PhD thesis,
University of Toronto (1981).
"""

from collections.abc import Sequence
from functools import cache
from math import factorial
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.polygons import readonly
from ..ground.hankel import square_value
from ..kernels.compiled import inputs, vectorised

#: radius of the outermost ring over that of the circle: the load is denser further in
OUTERMOST = 0.7
#: degrees of clouds where integrals by halving stand for those nearer by, in the depth and of
#: tractions, and the radii of their cells from which on they serve
DEGREES = {8: 3.0, 6: 4.0, 4: 8.0, 2: 20.0}


class Clouds(NamedTuple):
    """Points and weights of some cells, for one distance after the other.

    Attributes
    ----------
    centres : (2, n) array of float
        Of the circles.
    radii : (n,) array of float
        Of the circles.
    least : (k, n) array of float
        Squares of the distances from the centre from which on each cloud serves, ascending.
    x, y : (npoints,) array of float
        Points of all clouds in the unit circle.
    starts : (k + 1,) array of int
        Where those of each cloud begin.
    weights : (n, npoints) array of float
    """

    centres: ndarray
    radii: ndarray
    least: ndarray
    x: ndarray
    y: ndarray
    starts: ndarray
    weights: ndarray

    @classmethod
    def from_moments(
        cls, centres: ndarray, radii: ndarray, moments: ndarray, least: dict[int, ndarray]
    ) -> Self:
        """Of moments about the centres, as of `polygon_moments`.

        ``least`` has the degree of each cloud and the distances from which on it serves.
        """
        every = np.arange(len(radii)), moments
        return cls.from_groups(centres, radii, [every], least)

    @classmethod
    def from_groups(
        cls,
        centres: ndarray,
        radii: ndarray,
        groups: Sequence[tuple[ndarray, ndarray]],
        least: dict[int, ndarray],
    ) -> Self:
        """The same of some cells after the other, their numbers and moments.

        Clouds of higher degrees than the moments of a cell have no weights.
        """
        points = [ring_points(degree) for degree in least]
        starts = np.cumsum([0, *(x.shape[1] for x in points)])
        weights = np.full((len(radii), starts[-1]), np.nan)
        for cells, moments in groups:
            for k, degree in enumerate(least):
                if degree < len(moments):
                    own = _weights(moments, radii[cells], degree)
                    weights[cells, starts[k] : starts[k + 1]] = own
        squares = np.stack(list(least.values())) ** 2
        every = np.hstack([np.empty((2, 0)), *points])
        return cls(*inputs(centres, radii, squares, *every, starts, weights))


def ring_points(degree: int) -> ndarray:
    """Points in the unit circle that determine a polynomial, shape (2, (d + 1) (d + 2) / 2).

    >>> ring_points(1).shape, ring_points(4).shape
    ((2, 3), (2, 15))
    """
    rings = []
    for i in range(degree // 2 + 1):
        count = 2 * degree + 1 - 4 * i
        angle = 2 * np.pi * (np.arange(count) + 0.5 * (i % 2)) / count
        radius = OUTERMOST * np.cos(np.pi * i / degree)
        rings.append(radius * np.stack([np.cos(angle), np.sin(angle)]))
    return np.hstack(rings)


def _weights(moments: ndarray, radii: ndarray, degree: int) -> ndarray:
    """Weights of the points in the unit circle that have the moments, (n, npoints)."""
    powers = _powers(degree)
    scale = np.empty((degree + 1, len(radii)))
    scale[0], scale[1:] = 1.0, 1 / radii
    np.multiply.accumulate(scale, out=scale)
    scaled = np.stack([moments[i, j] * scale[i + j] for i, j in powers], axis=-1)
    return scaled @ _by_moments(degree)


def _powers(degree: int) -> list[tuple[int, int]]:
    """Exponents of the monomials up to a degree."""
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


@cache
@np.errstate(under="ignore")  # points on the axes but for rounding
def _by_moments(degree: int) -> ndarray:
    """What each moment adds to the weights of the points, (npoints, npoints)."""
    x, powers = ring_points(degree), _powers(degree)
    monomials = [x[0] ** i * x[1] ** j / (factorial(i) * factorial(j)) for i, j in powers]
    return readonly(np.linalg.inv(np.stack(monomials)).T)


@vectorised
def cloud_sum(x, y, radius, px, py, weights, coefficients, first):
    """Sum over the points of a cloud, seen from (x, y) from its centre, of a `SquareTable`."""
    total = 0.0
    for k in range(px.shape[0]):
        dx, dy = x - radius * px[k], y - radius * py[k]
        total += weights[k] * square_value(coefficients, first, dx * dx + dy * dy)
    return total
