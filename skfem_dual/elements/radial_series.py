"""Loads on cells as seen by a smooth radial influence function: its Taylor series to the fourth
degree about a point of each cell, summed with the moments of the load.

Source: Z.-H. Duan and R. Krasny, An adaptive treecode for computing nonbonded potential energy in
classical molecular systems, J. Comput. Chem. 22 (2001), for such series of other functions.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..ground.hankel import (
    BITS,
    COARSE,
    COARSE_DEGREE,
    SQUARES,
    RadialTable,
    SquareTable,
    panel_at,
)
from ..kernels.compiled import inputs, vectorised

#: greatest degree, and that of cells farther off
DEGREE, FEW = 4, 2


class RadialSeries(NamedTuple):
    """What the kernel `add_series` takes.

    Attributes
    ----------
    centres : (2, n) array of float
        Points of the cells.
    terms : (20, n) array of float
        Factors of the derivatives of the function with respect to r^2.
    coarse, table : SquareTable
        The function, in few panels, of which derivatives are taken, and in many.
    smallest : float
        Square of the smallest distance of the tables.
    few : (n,) array of float
        Squares of the distances from which on the second degree will do.
    """

    centres: ndarray
    terms: ndarray
    coarse: SquareTable
    table: SquareTable
    smallest: float
    few: ndarray

    @classmethod
    def from_moments(
        cls, centres: ndarray, moments: ndarray, table: RadialTable, few: ndarray
    ) -> Self:
        """Of moments as of `polygon_moments` about the centres; the first ones are zero.

        From the distances ``few`` on the second degree will do.
        """
        points, terms, squares = inputs(centres, _terms(moments), few**2)
        return cls(points, terms, table.coarse, table.squares[0], table.nearest**2, squares)


def _terms(m: ndarray) -> ndarray:
    """Factors that moments give to f, f', ..., f'''' of ``f(r^2)`` times powers of (x, y).

    In `add_series` they stand in this order beside 1; 1; x^2, x y, y^2, x, y, 1; x^3, x^2 y,
    x y^2, y^3, x^2, x y, y^2; x^4, ..., y^4.
    """
    even = m[4, 0] + m[0, 4]
    second = [4 * m[2, 0], 4 * m[1, 1], 4 * m[0, 2]]
    second += [-12 * m[3, 0] - 4 * m[1, 2], -12 * m[0, 3] - 4 * m[2, 1], 12 * even + 4 * m[2, 2]]
    third = [-8 * m[3 - i, i] for i in range(4)]
    third += [48 * m[4, 0] + 8 * m[2, 2], 24 * (m[3, 1] + m[1, 3]), 48 * m[0, 4] + 8 * m[2, 2]]
    fourth = [16 * m[4 - i, i] for i in range(5)]
    return np.stack([m[0, 0], 2 * (m[2, 0] + m[0, 2]), *second, *third, *fourth])


@vectorised
def add_series(x, y, cells, series, factor, values):
    """Add ``factor`` times the integrals over some cells, seen from points, to ``values``.

    ``values`` has a row for each point and a column for each cell.
    """
    centres, terms, coarse, table, smallest, few = series
    coefficients, first = coarse
    fine, first_fine = table
    width = cells.shape[0]
    m = np.empty((terms.shape[0], width))
    cx, cy, enough = np.empty(width), np.empty(width), np.empty(width)
    for k in range(width):
        cx[k], cy[k], enough[k] = centres[0, cells[k]], centres[1, cells[k]], few[cells[k]]
    for term in range(terms.shape[0]):
        for k in range(width):
            m[term, k] = factor * terms[term, cells[k]]
    for i in range(x.shape[0]):
        for k in range(width):
            dx, dy = x[i] - cx[k], y[i] - cy[k]
            xx, xy, yy = dx * dx, dx * dy, dy * dy
            u = max(xx + yy, smallest)
            second = m[2, k] * xx + m[3, k] * xy + m[4, k] * yy
            # Horner's scheme for the polynomial and its derivatives over k!
            f1, f2 = 0.0, 0.0
            if u >= enough[k]:
                panel, t, slope = panel_at(first_fine, u, BITS)
                f = fine[panel, SQUARES]
                for power in range(SQUARES - 1, -1, -1):
                    f2 = f2 * t + f1
                    f1 = f1 * t + f
                    f = f * t + fine[panel, power]
                higher = 2 * f2 * second
            else:
                panel, t, slope = panel_at(first, u, COARSE)
                f = coefficients[panel, COARSE_DEGREE]
                f3, f4 = 0.0, 0.0
                for power in range(COARSE_DEGREE - 1, -1, -1):
                    f4 = f4 * t + f3
                    f3 = f3 * t + f2
                    f2 = f2 * t + f1
                    f1 = f1 * t + f
                    f = f * t + coefficients[panel, power]
                second += m[5, k] * dx + m[6, k] * dy + m[7, k]
                third = dx * (m[8, k] * xx + m[9, k] * xy + m[10, k] * yy) + m[11, k] * dy * yy
                third += m[12, k] * xx + m[13, k] * xy + m[14, k] * yy
                fourth = xx * (m[15, k] * xx + m[16, k] * xy + m[17, k] * yy)
                fourth += yy * (m[18, k] * xy + m[19, k] * yy)
                higher = 2 * f2 * second + slope * (6 * f3 * third + slope * 24 * f4 * fourth)
            values[i, k] += m[0, k] * f + slope * (m[1, k] * f1 + slope * higher)
