"""What slopes of the pressure inside the cells add to the settlements under their means.

As of `EdgeCorrection` it is a sparse near correction, exact but for the strips of weighted cells,
and the dipoles of all cells, whose moments are the second moments of the law of the edge times
the slopes. What the influence function has beyond c / r takes the dipoles alone.

Source: D. R. Wilton et al., Potential integrals for uniform and linear source distributions on
polygonal and polyhedral domains, IEEE Trans. Antennas Propag. 32 (1984).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, csr_matrix, eye

from ..ground.hankel import SquareTable, square_value
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from ..kernels.threads import Threads
from .law_strips import STRIPS
from .near_slopes import AT_REST, NearSlopes
from .near_sums import NearSums
from .remainder import Add, add_by_rows
from .slopes import Slopes

#: rows of a matrix that are added to together, enough for the compiler to take eight at once, and
#: columns
ROWS, COLUMNS = 32, 16
#: with more cells the fields of less than so many rows are found of so many at a time, which takes
#: less room
FEW = 2**14
#: points nearer to a cell's centroid than so many of its radii take the exact correction
EXACT_RADII = 2.5
#: nanoseconds that the dipole of a cell takes, about
CELL = 4


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


@dataclass(frozen=True, eq=False)
class SlopeCorrection:
    """Settlements under ``w / mean(w) g . (x - y)`` on each cell, of `Slopes`.

    Attributes
    ----------
    x : (2, m) array of float
        Field points.
    centroids : (2, n) array of float
        Centroids of the cells, where their dipoles are.
    areas : (n,) array of float
        Areas of the cells.
    near : NearSlopes
        Under unit slopes near the cells, less their dipoles.
    second_moments : (2, 2, n) array of float
        As of `Slopes`: dipoles over slopes.
    fall : Fall
        How dipoles act.
    """

    x: ndarray
    centroids: ndarray
    areas: ndarray
    near: NearSlopes
    second_moments: ndarray
    fall: Fall

    @classmethod
    def from_slopes(
        cls, slopes: Slopes, substrate: Substrate, x: ndarray, strips: int = STRIPS
    ) -> Self:
        """At points ``x``; ``strips`` is their number in a triangle from the edge on."""
        every = np.arange(len(slopes.partition))
        near = NearSums.from_cells(slopes.partition, slopes.weights, every, EXACT_RADII, x, strips)
        return cls.from_sums(slopes, substrate, x, [near])

    @classmethod
    def from_sums(
        cls,
        slopes: Slopes,
        substrate: Substrate,
        x: ndarray,
        sums: Iterable[NearSums],
        dtype: type = float,
    ) -> Self:
        """The same by what is known near all cells, some at a time, kept as ``dtype``."""
        partition, c = slopes.partition, substrate.singular_coefficient
        near = NearSlopes.from_sums(slopes, x.shape[1], c, sums, dtype)
        fall, moments = Fall.from_substrate(substrate), slopes.second_moments
        return cls(x, partition.centroids, partition.areas, near, moments, fall)

    def diagonal(self, slopes: Slopes) -> ndarray:
        """Of the matrix of `add_to`, where the points are those of the cells; shape (n,)."""
        out = np.zeros(len(self.areas))
        (x, moments), circles = inputs(self.x, self.second_moments), self._circles
        columns = _arrays(slopes.columns)
        _add_diagonal(x, circles, self.fall, moments, self.near, columns, out)
        return out

    def at(self, i: ndarray) -> Self:
        """At the points with the numbers ``i`` only."""
        return replace(self, x=np.ascontiguousarray(self.x[:, i]), near=self.near.at(i))

    def dipoles(self, slopes: ndarray, order: ndarray | None = None) -> ndarray:
        """Those of slopes, both of shape (s, 2, n), of the cells in an ``order``."""
        order = np.arange(slopes.shape[2]) if order is None else order
        out = np.empty_like(slopes)
        _put_dipoles(*inputs(self.second_moments, slopes, order), out)
        return out

    @property
    def _circles(self) -> Circles:
        return Circles.of(self.centroids, self.areas)

    def apply(self, slopes: ndarray) -> ndarray:
        """Settlements under slopes of shape (2, n) or (2, n, k), of shape (m,) or (m, k)."""
        columns = slopes.reshape(2 * len(self.areas), -1)
        each = np.ascontiguousarray(columns.T).reshape(-1, 2, len(self.areas))
        dipoles = self.dipoles(each)
        some = np.nonzero(dipoles.any(axis=(0, 1)))[0].astype(np.int32)
        x, dipoles, some, ends = inputs(self.x, dipoles, some, np.array([0, len(some)]))
        out, circles = np.zeros((len(each), self.x.shape[1])), self._circles
        self.near.add_product(each, out)

        def work(k: slice) -> None:
            (rows,) = inputs(np.array([[k.start], [k.stop]]))
            add_near_dipoles(0, 1, x, rows, ends, some, circles, self.fall, dipoles, out)

        with Threads() as run:
            run(work, self.x.shape[1], CELL * len(self.areas))
        return out.T.reshape(-1, *slopes.shape[2:])

    def add_to(self, matrix: ndarray, slopes: Slopes, sign: float = 1.0) -> None:
        """Add ``sign`` times what ``slopes`` make of mean pressures to a dense (m, n) matrix."""
        add_by_rows(self.adding(slopes, sign), matrix, CELL * len(self.areas))

    def adding(self, slopes: Slopes, sign: float = 1.0) -> Add:
        """What does so to a block of some rows."""
        if self.x.shape[1] > ROWS or len(self.areas) <= FEW:
            return self._adding(slopes.matrix, slopes.columns, sign)
        (x, moments), circles = inputs(self.x, self.second_moments), self._circles

        def add(rows: slice, block: ndarray) -> None:
            for first in range(0, len(self.areas), FEW):
                count = min(FEW, len(self.areas) - first)
                fields = np.empty((rows.stop - rows.start, 2, count))
                for i, field in zip(range(rows.start, rows.stop), fields, strict=True):
                    _field(i, x, circles, self.fall, moments, self.near, first, field)
                slopes.add_transposed(sign * fields, block, first)

        return add

    def to_dense(self) -> ndarray:
        """Settlements under unit slopes along x of all cells, then along y; shape (m, 2 n)."""
        n = len(self.areas)
        along = [np.zeros((self.x.shape[1], n)) for _ in range(2)]
        for axis, matrix in enumerate(along):
            self.add(matrix, eye(2 * n, n, -n * axis, format="csr"))
        return np.hstack(along)

    def add(self, matrix: ndarray, slopes: csr_matrix) -> None:
        """Add what slopes of shape (2 n, k) make of k mean pressures to an (m, k) matrix."""
        add_by_rows(self._adding(slopes, slopes.tocsc()), matrix, CELL * len(self.areas))

    def _adding(self, slopes: csr_matrix, by_columns: csc_matrix, sign: float = 1.0) -> Add:
        """What does so to a block of some rows."""
        (x, moments), circles = inputs(self.x, self.second_moments), self._circles
        rows, columns = _arrays(slopes, sign), _arrays(by_columns, sign)
        (sloped,) = inputs(np.diff(slopes.indptr).reshape(2, -1).any(axis=0))

        def add(k: slice, block: ndarray) -> None:
            _add_rows(x, k.start, circles, self.fall, moments, sloped, columns, block)
            _add_near(k.start, self.near, rows, block)

        return add


def _arrays(matrix: csr_matrix | csc_matrix, factor: float = 1.0) -> tuple[ndarray, ...]:
    """Starts, numbers and values, times a factor, of its rows or columns."""
    return inputs(matrix.indptr, matrix.indices, factor * matrix.data)


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
def _put_dipoles(moments, slopes, order, out):
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
def _add_rows(x, begin, circles, fall, moments, sloped, slopes, matrix):
    """Some rows from ``begin`` on: sums over the cells around are the same for all of them."""
    middles, squares = circles
    starts, numbers, values = slopes
    n = squares.shape[0]
    local, tile = np.zeros((2 * n, ROWS)), np.empty((COLUMNS, ROWS))
    x0, y0 = np.zeros(ROWS), np.zeros(ROWS)
    for first in range(0, matrix.shape[0], ROWS):
        count = min(ROWS, matrix.shape[0] - first)
        for i in range(count):
            x0[i], y0[i] = x[0, begin + first + i], x[1, begin + first + i]
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
def _field(i, x, circles, fall, moments, near, first, out):
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
def _add_near(begin, near, slopes, matrix):
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
def _add_diagonal(x, circles, fall, moments, near, slopes, out):
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
