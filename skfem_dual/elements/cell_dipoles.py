"""What cells under slopes of the pressure do at points away from them: fields of dipoles.

Near their cells the kernels here leave to a sparse correction what dipoles are not.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..ground.hankel import SquareTable, square_value
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from .near_slopes import AT_REST

#: rows of a matrix that are added to together, enough for the compiler to take eight at once, and
#: columns
ROWS, COLUMNS = 32, 16


class Fall(NamedTuple):
    """What dipoles act by: ``-1 / r`` times the derivative of the influence function.

    Attributes
    ----------
    coefficient : float
        c of the part c / r.
    rest : SquareTable
        The same of the remainder; without one there are no panels.
    least : float
        Square of the smallest distance of the table.
    factor : float
        1 / E0.
    """

    coefficient: float
    rest: SquareTable
    least: float
    factor: float

    @classmethod
    def from_substrate(cls, substrate: Substrate) -> Self:
        """Of a ground."""
        c, table = substrate.singular_coefficient, substrate.remainder
        if table is None:
            return cls(c, SquareTable(np.empty((0, 1)), 0), 1.0, 0.0)
        return cls(c, table.fall, table.nearest**2, 1 / substrate.surface.young)


class Circles(NamedTuple):
    """Circles that stand for cells.

    Attributes
    ----------
    middles : (2, k) array of float
    squares : (k,) array of float
        Of their radii.
    """

    middles: ndarray
    squares: ndarray

    @classmethod
    def of(cls, centroids: ndarray, areas: ndarray) -> Self:
        """Of cells with these centroids and areas."""
        return cls(*inputs(centroids, areas / np.pi))


@inlined
def _fall(r2, square, fall):
    """The influence of a dipole over the component of the arm along it, at a distance.

    Over a cell the remainder is taken for the logarithm that it is there, the cell for a circle.
    """
    cube = r2 * np.sqrt(r2) if r2 > AT_REST * square else np.inf
    out = fall.coefficient / cube
    if fall.factor > 0.0:
        u = max(r2, square, fall.least)
        rest = square_value(fall.rest.coefficients, fall.rest.first, u)
        out += fall.factor * rest * (2 - r2 / u)
    return out


@compiled
def put_dipoles(moments, slopes, order, out):
    """Dipoles of cells in an order under slopes of shape (s, 2, n)."""
    for s in range(slopes.shape[0]):
        for k in range(order.shape[0]):
            j = order[k]
            x, y = slopes[s, 0, j], slopes[s, 1, j]
            out[s, 0, k] = moments[0, 0, j] * x + moments[0, 1, j] * y
            out[s, 1, k] = moments[1, 0, j] * x + moments[1, 1, j] * y


@vectorised
def add_near_dipoles(begin, end, x, rows, starts, cells, circles, fall, dipoles, out):
    """Add what dipoles of lists of cells make of points, under several loads at a time.

    The points ``rows[0, k]`` to ``rows[1, k]`` take from ``cells[starts[k]:starts[k + 1]]`` with
    their ``dipoles`` of shape (s, 2, n); ``out`` is of shape (s, m).
    """
    middles, squares = circles
    widest, sets = 0, dipoles.shape[0]
    for k in range(begin, end):
        widest = max(widest, starts[k + 1] - starts[k])
    cx, cy, square = np.empty(widest), np.empty(widest), np.empty(widest)
    fx, fy, load = np.empty(widest), np.empty(widest), np.empty((sets, 2, widest))
    coefficient, least, factor = fall.coefficient, fall.least, fall.factor
    table, first = fall.rest.coefficients, fall.rest.first
    for k in range(begin, end):
        width = starts[k + 1] - starts[k]
        for c in range(width):
            j = cells[starts[k] + c]
            cx[c], cy[c], square[c] = middles[0, j], middles[1, j], squares[j]
            for s in range(sets):
                load[s, 0, c], load[s, 1, c] = dipoles[s, 0, j], dipoles[s, 1, j]
        for i in range(rows[0, k], rows[1, k]):
            x0, y0 = x[0, i], x[1, i]
            # as `_fall`, in loops without branches
            for c in range(width):
                dx, dy = x0 - cx[c], y0 - cy[c]
                r2 = dx * dx + dy * dy
                f = coefficient / (r2 * np.sqrt(r2)) if r2 > AT_REST * square[c] else 0.0
                fx[c], fy[c] = f * dx, f * dy
            if factor > 0.0:
                for c in range(width):
                    dx, dy = x0 - cx[c], y0 - cy[c]
                    r2 = dx * dx + dy * dy
                    u = max(r2, square[c], least)
                    f = factor * square_value(table, first, u) * (2 - r2 / u)
                    fx[c] += f * dx
                    fy[c] += f * dy
            for s in range(0, sets - 2, 3):
                one, two, three = 0.0, 0.0, 0.0
                for c in range(width):
                    one += load[s, 0, c] * fx[c] + load[s, 1, c] * fy[c]
                    two += load[s + 1, 0, c] * fx[c] + load[s + 1, 1, c] * fy[c]
                    three += load[s + 2, 0, c] * fx[c] + load[s + 2, 1, c] * fy[c]
                out[s, i] += one
                out[s + 1, i] += two
                out[s + 2, i] += three
            for s in range(sets - sets % 3, sets):
                total = 0.0
                for c in range(width):
                    total += load[s, 0, c] * fx[c] + load[s, 1, c] * fy[c]
                out[s, i] += total


@vectorised
def add_sloped_rows(x, begin, circles, fall, moments, sloped, slopes, matrix):
    """Some rows from ``begin`` on: sums over the cells around are the same for all of them."""
    middles, squares = circles
    starts, numbers, values = slopes
    n = squares.shape[0]
    local, tile = np.zeros((2 * n, ROWS)), np.empty((COLUMNS, ROWS))
    x0, y0 = np.empty(ROWS), np.empty(ROWS)
    for first in range(0, matrix.shape[0], ROWS):
        count = min(ROWS, matrix.shape[0] - first)
        for i in range(ROWS):  # the last again and again: tables end somewhere
            at = begin + first + min(i, count - 1)
            x0[i], y0[i] = x[0, at], x[1, at]
        for j in range(n):
            if not sloped[j]:
                continue
            cx, cy, square = middles[0, j], middles[1, j], squares[j]
            xx, xy, yy = moments[0, 0, j], moments[0, 1, j], moments[1, 1, j]
            for i in range(ROWS):
                dx, dy = x0[i] - cx, y0[i] - cy
                f = _fall(dx * dx + dy * dy, square, fall)
                local[j, i] = f * (xx * dx + xy * dy)
                local[n + j, i] = f * (xy * dx + yy * dy)
        for start in range(0, matrix.shape[1], COLUMNS):
            width = min(COLUMNS, matrix.shape[1] - start)
            if starts[start] == starts[start + width]:
                continue
            for k in range(width):
                _combine(numbers, values, starts[start + k], starts[start + k + 1], local, tile[k])
            for i in range(count):
                for k in range(width):
                    matrix[first + i, start + k] += tile[k, i]


@inlined
def _combine(numbers, values, begin, end, rows, total):
    """Put the sum of some ``rows`` times values into ``total``, four at a time: so many are added
    before they go back to the memory."""
    total[:] = 0.0
    for at in range(begin, end, 4):
        a, b, c, d = at, min(at + 1, end - 1), min(at + 2, end - 1), min(at + 3, end - 1)
        one, two = values[a], values[b] if b > a else 0.0
        three, four = values[c] if c > b else 0.0, values[d] if d > c else 0.0
        a, b, c, d = numbers[a], numbers[b], numbers[c], numbers[d]
        for i in range(ROWS):
            low = rows[a, i] * one + rows[b, i] * two
            total[i] += low + rows[c, i] * three + rows[d, i] * four


@compiled
def put_field(i, x, circles, fall, moments, near, first, out):
    """Settlements of a point under unit slopes of cells, from the ``first`` on."""
    middles, squares = circles
    starts, cells, values = near
    for at in range(out.shape[1]):
        j = first + at
        dx, dy = x[0, i] - middles[0, j], x[1, i] - middles[1, j]
        f = _fall(dx * dx + dy * dy, squares[j], fall)
        out[0, at] = f * (moments[0, 0, j] * dx + moments[0, 1, j] * dy)
        out[1, at] = f * (moments[1, 0, j] * dx + moments[1, 1, j] * dy)
    for k in range(starts[i], starts[i + 1]):
        at = cells[k] - first
        if 0 <= at < out.shape[1]:
            out[0, at] += values[0, k]
            out[1, at] += values[1, k]


@compiled
def add_sloped_near(begin, near, slopes, matrix):
    """Add what is not that of dipoles near the points of rows, from the point ``begin`` on; the
    slopes by unit mean pressures are rows of a sparse matrix."""
    starts, cells, values = slopes
    firsts, numbers, integrals = near
    n = (starts.shape[0] - 1) // 2
    for i in range(matrix.shape[0]):
        for axis in range(2):
            for k in range(firsts[begin + i], firsts[begin + i + 1]):
                row = axis * n + numbers[k]
                for at in range(starts[row], starts[row + 1]):
                    matrix[i, cells[at]] += integrals[axis, k] * values[at]


@compiled
def add_diagonal(x, circles, fall, moments, near, slopes, out):
    """Add what the mean pressure of each cell does by slopes in its own point; the slopes by it
    are columns of a sparse matrix."""
    middles, squares = circles
    starts, numbers, values = slopes
    firsts, cells, integrals = near
    n = out.shape[0]
    for i in range(n):
        for at in range(starts[i], starts[i + 1]):
            axis, j = divmod(numbers[at], n)
            dx, dy = x[0, i] - middles[0, j], x[1, i] - middles[1, j]
            f = _fall(dx * dx + dy * dy, squares[j], fall)
            out[i] += f * values[at] * (moments[0, axis, j] * dx + moments[1, axis, j] * dy)
            for k in range(firsts[i], firsts[i + 1]):
                if cells[k] == j:
                    out[i] += values[at] * integrals[axis, k]
