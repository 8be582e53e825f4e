"""What cells do to points beside them, P2P, with their dipoles.

Where single precision will do with room to spare, entries are kept in half of its memory: what
charges in the centroids do is computed anew in every product, as it is of dipoles, and what is
beyond that, far less but for the greatest of a row, is kept in short integers.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ...elements.near import NearField
from ...elements.near_slopes import AT_REST
from ...elements.slope_correction import Circles, Fall
from ...ground.hankel import square_value
from ...kernels.compiled import compiled, inputs, vectorised
from ...kernels.threads import Threads
from .linear_maps import Run
from .lists import Lists
from .loops import Layout

#: greatest short integer
GREATEST = 32767


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
    layout : Layout
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

    layout: Layout
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
        return cls(layout, Rows(values, units, greatest, own, charge), x, circles, fall)

    @property
    def nbytes(self) -> int:
        """Memory beside what is shared."""
        return sum(a.nbytes for a in (*self.layout, *self.rows[:4]))

    def add(self, q: ndarray, dipoles: ndarray | None, out: ndarray, run: Run) -> None:
        """Add what pressures (s, n) and dipoles (s, 2, n) make to settlements (s, m)."""
        dipoles = np.empty((len(q), 2, 0)) if dipoles is None else dipoles
        known = self.layout, self.rows, self.x, self.circles, self.fall, *inputs(q, dipoles), out
        run(lambda k: _add_near(k.start, k.stop, *known), len(self.layout.starts) - 1)


@compiled
def charge_at(dx, dy, square, charge):
    """What a cell's charge does in a point, nothing in its middle."""
    r2 = dx * dx + dy * dy
    return charge * square / np.sqrt(r2) if r2 > AT_REST * square else 0.0


@compiled
def _keep(begin, end, layout, x, circles, charge, given, values, units, greatest, own):
    """Put entries ``given``, some blocks one after the other, as `Rows`."""
    rows, starts, columns, offsets = layout
    at = 0
    for k in range(begin, end):
        width = starts[k + 1] - starts[k]
        rest = np.empty(width)
        for i in range(rows[0, k], rows[1, k]):
            most, second, place = -1.0, 0.0, 0
            for c in range(width):
                rest[c] = given[at + c]
                if charge > 0.0:
                    j = columns[starts[k] + c]
                    dx, dy = x[0, i] - circles.middles[0, j], x[1, i] - circles.middles[1, j]
                    rest[c] -= charge_at(dx, dy, circles.squares[j], charge)
                if abs(rest[c]) > most:
                    most, second, place = abs(rest[c]), most, c
                else:
                    second = max(second, abs(rest[c]))
            if width > 0:
                own[i], greatest[i] = place, given[at + place]
            if charge > 0.0:
                unit = second / GREATEST if second > 0.0 else 1.0
                units[i] = unit
                for c in range(width):
                    rest[c] = np.rint(rest[c] / unit) if c != place else 0.0
            for c in range(width):
                values[offsets[k] + (i - rows[0, k]) * width + c] = rest[c]
            at += width


@vectorised
def _add_near(begin, end, layout, near, x, circles, fall, q, dipoles, out):
    """Every entry is read once for three vectors; dipoles as `slope_correction` has them."""
    rows, starts, columns, offsets = layout
    values, units, greatest, own, charge = near
    middles, squares = circles
    widest, sets, some = 0, q.shape[0], dipoles.shape[2] > 0
    for k in range(begin, end):
        widest = max(widest, starts[k + 1] - starts[k])
    cx, cy, square = np.empty(widest), np.empty(widest), np.empty(widest)
    e, fx, fy, load = (
        np.empty(widest),
        np.zeros(widest),
        np.zeros(widest),
        np.zeros((sets, 3, widest)),
    )
    coefficient, least, factor = fall.coefficient, fall.least, fall.factor
    table, first = fall.rest.coefficients, fall.rest.first
    for k in range(begin, end):
        width = starts[k + 1] - starts[k]
        for c in range(width):
            j = columns[starts[k] + c]
            cx[c], cy[c], square[c] = middles[0, j], middles[1, j], squares[j]
            for s in range(sets):
                load[s, 0, c] = q[s, j]
                if some:
                    load[s, 1, c], load[s, 2, c] = dipoles[s, 0, j], dipoles[s, 1, j]
        at = offsets[k]
        for i in range(rows[0, k], rows[1, k]):
            x0, y0, unit = x[0, i], x[1, i], units[i]
            if charge > 0.0 or some:
                for c in range(width):
                    dx, dy = x0 - cx[c], y0 - cy[c]
                    r2 = dx * dx + dy * dy
                    g = 1.0 / np.sqrt(r2) if r2 > AT_REST * square[c] else 0.0
                    f = coefficient * g * g * g
                    fx[c], fy[c] = f * dx, f * dy
                    e[c] = charge * square[c] * g + unit * values[at + c]
            else:
                for c in range(width):
                    e[c] = unit * values[at + c]
            if width > 0:
                e[own[i]] = greatest[i]
            if factor > 0.0 and some:
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
                    one += load[s, 0, c] * e[c] + load[s, 1, c] * fx[c] + load[s, 2, c] * fy[c]
                    two += (
                        load[s + 1, 0, c] * e[c]
                        + load[s + 1, 1, c] * fx[c]
                        + load[s + 1, 2, c] * fy[c]
                    )
                    three += (
                        load[s + 2, 0, c] * e[c]
                        + load[s + 2, 1, c] * fx[c]
                        + load[s + 2, 2, c] * fy[c]
                    )
                out[s, i] += one
                out[s + 1, i] += two
                out[s + 2, i] += three
            for s in range(sets - sets % 3, sets):
                total = 0.0
                for c in range(width):
                    total += load[s, 0, c] * e[c] + load[s, 1, c] * fx[c] + load[s, 2, c] * fy[c]
                out[s, i] += total
            at += width
