"""What cells do to points beside them, P2P, with their dipoles.

Where single precision will do with room to spare, entries are kept in half of its memory: what
charges in the centroids do is computed anew in every product, as it is of dipoles, and what is
beyond that, far less but for the greatest of a row, is kept in short integers.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ...elements.cell_dipoles import Circles, Fall
from ...elements.near import NearField
from ...elements.near_slopes import AT_REST
from ...ground.hankel import square_value
from ...kernels.compiled import compiled, inputs, vectorised
from ...kernels.threads import Threads
from .linear_maps import Run
from .lists import Lists
from .loops import Layout

#: greatest short integer
GREATEST = 32767


class Runs(NamedTuple):
    """Which cells act on which points: those beside each other in the tree one after the other.

    Attributes
    ----------
    rows : (2, k) array of int
        Block ``k`` has the points ``rows[0, k]`` to ``rows[1, k]``.
    starts : (k + 1,) array of int
        It has the runs ``starts[k]`` to ``starts[k + 1]``.
    cells : (2, nruns) array of int
        Those of each run are ``cells[0]`` to ``cells[1]``.
    offsets : (k + 1,) array of int
        The entries of each block begin there, row by row.
    """

    rows: ndarray
    starts: ndarray
    cells: ndarray
    offsets: ndarray

    @classmethod
    def from_layout(cls, layout: Layout) -> Self:
        """Of columns one after the other."""
        rows, starts, columns, offsets = layout
        begins = np.ones(len(columns) + 1, bool)
        begins[1:-1] = np.diff(columns) != 1
        begins[starts] = True
        (at,) = np.nonzero(begins)
        cells = np.stack([columns[at[:-1]], columns[at[1:] - 1] + 1])
        return cls(*inputs(rows, np.searchsorted(at, starts).astype(np.int32), cells, offsets))


class Rows(NamedTuple):
    """Entries row by row, as kernels take them.

    Attributes
    ----------
    values : array of float or int
        All entries but the greatest of each row, less those of charges, in units of their row.
    units, greatest : (m,) array of float
        These units, and the greatest entries.
    own : (m,) array of int
        Where the greatest is in its row.
    charge : float
        Of a cell over the square of the radius of its circle; zero if values are not short.
    """

    values: ndarray
    units: ndarray
    greatest: ndarray
    own: ndarray
    charge: float


@dataclass(frozen=True, eq=False)
class NearEntries:
    """Exact entries of near cells, and what dipoles of these do; all in the order of the tree.

    Attributes
    ----------
    runs : Runs
        Which cells act on which points.
    rows : Rows
        The entries.
    x : (2, m) array of float
        The points.
    circles : Circles
        The cells.
    fall : Fall
        How dipoles act.
    """

    runs: Runs
    rows: Rows
    x: ndarray
    circles: Circles
    fall: Fall

    @classmethod
    def from_lists(
        cls,
        near: NearField,
        x: ndarray,
        points: ndarray,
        lists: Lists,
        place: ndarray,
        circles: Circles,
        fall: Fall,
        dtype: type,
    ) -> Self:
        """Of lists of cells that act on the ``points`` ``points[0, k]`` to ``points[1, k]``.

        ``place`` tells where each cell is among those of ``near``. Entries are kept as ``dtype``,
        short integers on homogeneous ground only.
        """
        layout, starts = Layout.from_lists(points, lists.starts, lists.items), lists.starts
        short, m = dtype == np.int16, x.shape[1]
        kind = np.float32 if short else dtype
        values: ndarray = np.empty(layout.offsets[-1], dtype)
        units: ndarray = np.ones(m, kind)
        greatest, own = np.empty_like(units), np.zeros(m, np.int32)
        charge = np.pi * fall.coefficient if short else 0.0

        def work(k: slice) -> None:
            cells, first = place[lists.items[starts[k.start] : starts[k.stop]]], starts[k.start]
            part = np.empty(layout.offsets[k.stop] - layout.offsets[k.start])
            near.fill(x, points[:, k], (starts[k.start : k.stop + 1] - first, cells), part)
            known = layout, x, circles, charge, *inputs(part)
            _keep(k.start, k.stop, *known, values, units, greatest, own)

        with Threads() as run:
            run(work, len(starts) - 1)
        values, units, greatest, own = inputs(values, units, greatest, own)
        runs, kept = Runs.from_layout(layout), Rows(values, units, greatest, own, charge)
        return cls(runs, kept, x, circles, fall)

    @property
    def nbytes(self) -> int:
        """Memory."""
        kept = *self.runs, *self.rows[:4], self.x, *self.circles
        return sum(a.nbytes for a in kept)

    def add(
        self, q: ndarray, dipoles: ndarray | None, out: ndarray, dtype: type, run: Run
    ) -> None:
        """Add what pressures (s, n) and dipoles (s, 2, n) make, summed as ``dtype``, to
        settlements (s, m)."""
        most = _greatest(q)
        if dipoles is None:
            dipoles = np.empty((len(q), 2, 0))
        else:
            cube = self.circles.squares.max() ** 1.5
            most = np.maximum(most, _greatest(dipoles.reshape(len(q), -1)) / cube)
        loads = *inputs(q, dipoles, np.where(most > 0.0, most, 1.0)), np.dtype(dtype)
        known = self.runs, self.rows, self.x, self.circles, self.fall, *loads, out
        run(lambda k: _add_near(k.start, k.stop, *known), len(self.runs.starts) - 1)


def _greatest(rows: ndarray) -> ndarray:
    """The greatest number of each row, taken positive, without an array of these."""
    return np.maximum(rows.max(axis=1), -rows.min(axis=1))


@compiled
def charge_at(dx, dy, square, charge):
    """What a cell's charge does in a point, nothing in its middle."""
    r2 = dx * dx + dy * dy
    return charge * square / np.sqrt(r2) if r2 > AT_REST * square else 0.0


@vectorised
def _keep(begin, end, layout, x, circles, charge, given, values, units, greatest, own):
    """Put entries ``given``, some blocks one after the other, as `Rows`."""
    rows, starts, columns, offsets = layout
    at = np.uint64(0)  # unsigned: else a negative one would count from the end
    for k in range(begin, end):
        width = starts[k + 1] - starts[k]
        if width == 0:
            continue
        rest, cells = np.empty(width), np.zeros((3, width))
        for c in range(width):
            j = columns[starts[k] + c]
            cells[0, c], cells[1, c] = circles.middles[0, j], circles.middles[1, j]
            cells[2, c] = circles.squares[j]
        for i in range(rows[0, k], rows[1, k]):
            for c in range(width):
                dx, dy, square = x[0, i] - cells[0, c], x[1, i] - cells[1, c], cells[2, c]
                r2 = dx * dx + dy * dy
                g = 1.0 / np.sqrt(r2) if r2 > AT_REST * square else 0.0
                rest[c] = given[at + np.uint64(c)] - charge * square * g
            most, second, place = -1.0, 0.0, 0
            for c in range(width):
                if abs(rest[c]) > most:
                    most, second, place = abs(rest[c]), most, c
                else:
                    second = max(second, abs(rest[c]))
            own[i], greatest[i] = place, given[at + np.uint64(place)]
            f = 1.0
            if charge > 0.0:
                unit = second / GREATEST if second > 0.0 else 1.0
                units[i], f, rest[place] = unit, 1 / unit, 0.0
            out = np.uint64(offsets[k] + (i - rows[0, k]) * width)
            if charge > 0.0:
                for c in range(width):
                    values[out + np.uint64(c)] = np.rint(f * rest[c])
            else:
                for c in range(width):
                    values[out + np.uint64(c)] = rest[c]
            at += np.uint64(width)


@vectorised
def _add_near(begin, end, runs, near, x, circles, fall, q, dipoles, most, kind, out):
    """Add what loads of cells nearby do, summed as ``kind``.

    Lengths are in units of a cell, pressures in those of ``most``: single precision then reaches
    whatever the units.
    """
    rows, starts, near_cells, offsets = runs
    values, units, greatest, own, charge = near
    coefficient, rest, least, factor = fall
    widest, sets, some = 0, q.shape[0], dipoles.shape[2] > 0
    for k in range(begin, end):
        width = 0
        for run in range(starts[k], starts[k + 1]):
            width += near_cells[1, run] - near_cells[0, run]
        widest = max(widest, width)
    cells, squares = np.empty((3, widest)), np.empty(widest, kind)
    load, acting = np.zeros((sets, 3, widest), kind), np.zeros((3, widest), kind)
    total, charged = np.empty(sets), acting.dtype.type(charge / coefficient)
    for k in range(begin, end):
        if starts[k + 1] == starts[k]:
            continue
        width, size = 0, np.sqrt(circles.squares[near_cells[0, starts[k]]])
        f, unit = 1 / size, coefficient * size
        cube = f * f * f
        for run in range(starts[k], starts[k + 1]):
            first = near_cells[0, run]
            count = near_cells[1, run] - first
            for c in range(count):
                at, j = np.uint64(width + c), np.uint64(first + c)
                cells[0, at], cells[1, at] = circles.middles[0, j], circles.middles[1, j]
            for c in range(count):
                at, square = np.uint64(width + c), circles.squares[np.uint64(first + c)]
                cells[2, at], squares[at] = square, f * f * square
            for s in range(sets):
                scale = 1 / most[s]
                for c in range(count):
                    load[s, 0, np.uint64(width + c)] = scale * q[s, np.uint64(first + c)]
                if some:
                    scale *= cube
                    for c in range(count):
                        at, j = np.uint64(width + c), np.uint64(first + c)
                        load[s, 1, at], load[s, 2, at] = (
                            scale * dipoles[s, 0, j],
                            scale * dipoles[s, 1, j],
                        )
            width += count
        for i in range(rows[0, k], rows[1, k]):
            place = x[0, i], x[1, i]
            if charge > 0.0 or some:
                _act(width, place, cells, squares, f, charged, acting)
            if factor > 0.0 and some:
                _add_rest(width, place, cells, rest, least, factor / (f * f * coefficient), acting)
            # unsigned: else a negative one would count from the end
            at = np.uint64(offsets[k] + (i - rows[0, k]) * width)
            step = acting.dtype.type(units[i] / unit)
            for c in range(width):
                acting[0, c] += step * values[at + np.uint64(c)]
            acting[0, own[i]] = greatest[i] / unit
            _sum(width, load, acting, total)
            acting[0] = 0.0
            for s in range(sets):
                out[s, i] += unit * most[s] * total[s]


@vectorised
def _act(width, place, cells, squares, f, charged, acting):
    """Put what charges and unit dipoles along x and y in the middles of ``cells`` do, with lengths
    times ``f``."""
    x, y = place
    zero, one, rest = squares.dtype.type(0), squares.dtype.type(1), squares.dtype.type(AT_REST)
    for c in range(width):
        dx = squares.dtype.type(f * (x - cells[0, c]))
        dy = squares.dtype.type(f * (y - cells[1, c]))
        r2 = dx * dx + dy * dy
        g = one / np.sqrt(r2) if r2 > rest * squares[c] else zero
        cube = g * g * g
        acting[0, c], acting[1, c], acting[2, c] = charged * squares[c] * g, cube * dx, cube * dy


@vectorised
def _add_rest(width, place, cells, rest, least, factor, acting):
    """Add what unit dipoles do by the remainder, see `slope_correction`."""
    x, y = place
    table, first = rest.coefficients, rest.first
    for c in range(width):
        dx, dy, square = x - cells[0, c], y - cells[1, c], cells[2, c]
        r2 = dx * dx + dy * dy
        u = max(r2, square, least)
        f = factor * square_value(table, first, u) * (2 - r2 / u)
        acting[1, c] += f * dx
        acting[2, c] += f * dy


@vectorised
def _sum(width, load, acting, total):
    """Put sums of loads times what they do, what they do read once for three vectors."""
    sets = load.shape[0]
    for s in range(0, sets - 2, 3):
        one = two = three = acting.dtype.type(0)
        for c in range(width):
            e, fx, fy = acting[0, c], acting[1, c], acting[2, c]
            one += load[s, 0, c] * e + load[s, 1, c] * fx + load[s, 2, c] * fy
            two += load[s + 1, 0, c] * e + load[s + 1, 1, c] * fx + load[s + 1, 2, c] * fy
            three += load[s + 2, 0, c] * e + load[s + 2, 1, c] * fx + load[s + 2, 2, c] * fy
        total[s], total[s + 1], total[s + 2] = one, two, three
    for s in range(sets - sets % 3, sets):
        one = acting.dtype.type(0)
        for c in range(width):
            e, fx, fy = acting[0, c], acting[1, c], acting[2, c]
            one += load[s, 0, c] * e + load[s, 1, c] * fx + load[s, 2, c] * fy
        total[s] = one
