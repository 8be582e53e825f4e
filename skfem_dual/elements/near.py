"""Exact settlements at some points under some cells, in dense blocks.

As in `influence_matrix`: ribs in closed form, the remainder along the ribs nearby and by moments
farther off; of edge-weighted cells the series, to which `EdgeCorrection.near` adds what is
missing near by. Sources: those of `ribs` and `remainder`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import factorial
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..ground.hankel import RadialTable
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs, vectorised
from .edge_weights import EdgeWeights, load_centroids
from .moments import Series, far_influence, load_moments
from .pieces import Pieces
from .radial_series import DEGREE, FEW, RadialSeries, add_series
from .remainder import POINTS, AlongRibs, along_ribs
from .ribs import FAR, atanh_series, rib_integral

#: the remainder is integrated along the ribs of cells up to so many of their radii at least and
#: at most
LEAST_REACH, ALONG_RIBS = 1.5, 5.0
#: derivatives multiply errors of a table by no more
SMOOTH = 100.0
#: distances in an octave where its slope is taken
STEPS = 12
#: terms are taken for no less
TINY = 1e-300
#: Gauss points for an error of the remainder of 1e-6
FEWER = 4


class CellRibs(NamedTuple):
    """Ribs of cells, for blocks of some of them.

    Attributes
    ----------
    geometry : (nribs, 5) array of float
        Begin of each rib, the vector to its end, its length.
    left, right : (nribs,) array of int
        Its cells, -1 for none.
    around : (k,) array of int
        Ribs of all cells, one cell after the other.
    starts : (n + 1,) array of int
        Where those of each cell begin.
    """

    geometry: ndarray
    left: ndarray
    right: ndarray
    around: ndarray
    starts: ndarray

    @classmethod
    def from_partition(cls, partition: Partition, cells: ndarray) -> Self:
        """Of ``cells`` of a partition, all or some, in the order given."""
        number = np.full(len(partition) + 1, -1, np.int32)
        number[cells] = np.arange(len(cells))
        left, right = number[partition.f2c]
        order = np.argsort(left, kind="stable").astype(np.int32)
        order = order[(left[order] >= 0) | (right[order] >= 0)]
        left, right = left[order], right[order]
        both = np.concatenate([left, right])
        around = np.argsort(both, kind="stable").astype(np.int32)[np.count_nonzero(both < 0) :]
        starts = np.searchsorted(both[around], np.arange(len(cells) + 1))
        del both
        around %= len(left)
        geometry, p = np.empty((len(left), 5)), partition.polygons.p
        begin, end = partition.facets[:, order]
        for axis in range(2):
            geometry[:, axis] = p[axis, begin]
            geometry[:, 2 + axis] = p[axis, end] - p[axis, begin]
        geometry[:, 4] = np.hypot(geometry[:, 2], geometry[:, 3])
        return cls(*inputs(geometry, left, right, around, starts))


class Blocks(NamedTuple):
    """Which entries a block has: see `NearField.fill`.

    Attributes
    ----------
    x : (2, m) array of float
    rows : (2, nblocks) array of int
    starts : (nblocks + 1,) array of int
    cells : (k,) array of int
    """

    x: ndarray
    rows: ndarray
    starts: ndarray
    cells: ndarray


class Remainder(NamedTuple):
    """The part of an influence function that is not c / r, as `_add_remainder` takes it.

    Attributes
    ----------
    series : RadialSeries
        Of the cells.
    near : AlongRibs
        Of the same cells.
    least : (n,) array of float
        Squares of the distances from which on the series serve.
    factor : float
        1 / E0.
    """

    series: RadialSeries
    near: AlongRibs
    least: ndarray
    factor: float


@dataclass(frozen=True, eq=False)
class NearField:
    """Settlements under unit mean pressure on cells, in an order of the cells.

    Attributes
    ----------
    ribs : CellRibs
    coefficient : float
        c of the part c / r.
    far : Series
        What edge-weighted cells add.
    number : (n,) array of int
        Number of each cell among these, -1 of the others.
    remainder : Remainder or None
        None without a remainder.
    """

    ribs: CellRibs
    coefficient: float
    far: Series
    number: ndarray
    remainder: Remainder | None

    @classmethod
    def from_partition(
        cls,
        substrate: Substrate,
        partition: Partition,
        weights: EdgeWeights | None,
        cells: ndarray,
        rtol: float | None = None,
    ) -> Self:
        """Of ``cells`` of a partition, all or some, in the order given.

        The remainder has the error ``rtol`` relative to c / r; without it there is none.
        """
        c = substrate.singular_coefficient
        remainder = None
        if rtol is not None and len(cells) and (table := substrate.remainder) is not None:
            remainder = _remainder(substrate, table, partition, weights, cells, rtol)
        far, number = Series.none(), np.full(len(partition), -1, np.int32)
        if weights is not None:
            far, number = Series.from_weights(weights, c), weights.number
        (number,) = inputs(number[cells])
        return cls(CellRibs.from_partition(partition, cells), c, far, number, remainder)

    def fill(
        self, x: ndarray, rows: ndarray, columns: tuple[ndarray, ndarray], values: ndarray
    ) -> None:
        """Blocks of entries, one after the other.

        Parameters
        ----------
        x : (2, m) array of float
            Field points.
        rows : (2, nblocks) array of int
            Points of a block are those from ``rows[0]`` to ``rows[1]``.
        columns : pair of arrays of int
            Starts and items of the list of cells of each block.
        values : array of float
            Room for all blocks, each with its rows one after the other.
        """
        starts, cells = columns
        blocks = Blocks(*inputs(x, rows, starts, np.asarray(cells, np.int32)))
        # one more than the column of each cell, 0 for none: memory that is not touched costs none
        column = np.zeros(len(self.number) + 1, np.int32)
        known = self.ribs, self.coefficient, self.far, self.number
        _fill_singular(blocks, *known, column, values)
        if self.remainder is not None:
            _add_remainder(blocks, self.remainder, values)


def _remainder(
    substrate: Substrate,
    table: RadialTable,
    partition: Partition,
    weights: EdgeWeights | None,
    cells: ndarray,
    rtol: float,
) -> Remainder:
    """With the error ``rtol`` relative to c / r."""
    pieces = Pieces.from_partition(partition, weights)
    around = load_centroids(partition, weights)
    radius = partition.polygons.radii[cells]
    around = around.take(cells, axis=1)
    first, last = inputs(pieces.first[cells], pieces.last[cells])
    own = pieces._replace(first=first, last=last)
    moments = load_moments(own, around, DEGREE + 2)
    young = substrate.surface.young
    known = substrate.singular_coefficient * young, table, radius, rtol, moments
    reach = np.minimum(_reach(*known, DEGREE, _of_logarithm), ALONG_RIBS * radius)
    if SMOOTH * table.error >= known[0] * rtol:  # its derivatives are worth nothing
        reach = np.full(radius.shape, np.inf)
    few = _reach(*known, FEW, _of_any)
    (least,) = inputs(np.maximum(reach, radius + table.nearest) ** 2)
    return Remainder(
        RadialSeries.from_moments(around, moments, table, few),
        AlongRibs.from_table(table, own, FEWER if rtol >= 1e-6 else POINTS),
        least,
        1 / young,
    )


def _reach(
    coefficient: float,
    table: RadialTable,
    radius: ndarray,
    rtol: float,
    moments: ndarray,
    degree: int,
    term: Callable[[ndarray, int], ndarray],
) -> ndarray:
    """Distances from which on the series up to a ``degree`` will do for the remainder, (n,).

    The next terms of a logarithm that is as steep as the remainder there, or half way, against
    the ``coefficient`` of 1 / r; each by its ``term``, over the load of the cells.
    """
    octaves = np.log2(table.farthest / table.nearest)
    r = np.geomspace(table.nearest, table.farthest, int(STEPS * octaves))
    steep = np.abs(np.gradient(table.evaluate(table.omega, r), np.log(r)))
    steep[STEPS:] = np.maximum(steep[STEPS:], steep[:-STEPS])
    reach, load = LEAST_REACH * radius, moments[0, 0]
    for k in (degree + 1, degree + 2):
        beyond = np.maximum.accumulate((steep / (k * coefficient * r ** (k - 1)))[::-1])[::-1]
        first = np.searchsorted(1 / beyond.clip(TINY), term(moments, k) / (rtol * load))
        reach = np.maximum(reach, np.append(r, np.inf)[first])
    return reach


def _of_logarithm(moments: ndarray, k: int) -> ndarray:
    """The integral of (x + i y)^k."""
    return factorial(k) * np.abs(sum(1j**j * moments[k - j, j] for j in range(k + 1)))


def _of_any(moments: ndarray, k: int) -> ndarray:
    """The same where the function is not harmonic: all moments of that degree, taken positive."""
    return factorial(k) * sum(np.abs(moments[k - j, j]) for j in range(k + 1))


@compiled
def _fill_singular(blocks, ribs, c, far, number, column, values):
    """Entries of c / r and of the series."""
    x, rows, starts, cells = blocks
    widest, highest = 0, 0
    for block in range(rows.shape[1]):
        widest = max(widest, starts[block + 1] - starts[block])
        highest = max(highest, rows[1, block] - rows[0, block])
    room, part, r = np.empty((widest, highest)), np.empty(highest), np.empty((2, highest))
    offset = 0
    for block in range(rows.shape[1]):
        some = cells[starts[block] : starts[block + 1]]
        x0, y0 = x[0, rows[0, block] : rows[1, block]], x[1, rows[0, block] : rows[1, block]]
        width, height = some.shape[0], x0.shape[0]
        entries = room[:width]
        entries[:, :height] = 0.0
        for k in range(width):
            column[some[k]] = k + 1
        _add_cells(x0, y0, some, column, ribs, c, entries, part, r)
        _add_series(x0, y0, some, number, far, entries)
        for k in range(width):
            column[some[k]] = 0
        for i in range(height):
            for k in range(width):
                values[offset + i * width + k] = entries[k, i]
        offset += width * height


@vectorised
def _add_cells(x, y, cells, column, ribs, c, entries, part, r):
    """Add c times the integrals of 1/r to the row of ``entries`` of each cell.

    ``column`` has one more than that row of each cell of the plan, 0 for those of no interest;
    ``part`` and ``r`` are for temporary use.
    """
    geometry, left, right, around, starts = ribs
    for k in range(cells.shape[0]):
        cell = cells[k]
        for a in range(starts[cell], starts[cell + 1]):
            rib = around[a]
            plus, minus = column[left[rib]] - 1, column[right[rib]] - 1
            if plus >= 0 and left[rib] != cell:
                continue  # it is the turn of the other cell
            ax, ay, lx, ly, length = geometry[rib]
            for i in range(x.shape[0]):
                dx, dy = x[i] - ax, y[i] - ay
                ex, ey = dx - lx, dy - ly
                r[0, i], r[1, i] = np.sqrt(dx * dx + dy * dy), np.sqrt(ex * ex + ey * ey)
            for i in range(x.shape[0]):
                q = 1 / (r[0, i] + r[1, i])
                series = atanh_series(length * length * (q * q))
                part[i] = 2 * (lx * (y[i] - ay) - ly * (x[i] - ax)) * q * series
            for i in range(x.shape[0]):
                r1, r2 = r[0, i], r[1, i]
                if r1 + r2 <= FAR * length:
                    part[i] = rib_integral(x[i], y[i], ax, ay, lx, ly, length, r1, r2)
            if plus >= 0:
                for i in range(x.shape[0]):
                    entries[plus, i] += c * part[i]
            if minus >= 0:
                for i in range(x.shape[0]):
                    entries[minus, i] -= c * part[i]


@vectorised
def _add_series(x, y, cells, number, far, entries):
    """Add what edge-weighted cells add outside of their circles."""
    middles, squares, terms = far
    for k in range(cells.shape[0]):
        j = number[cells[k]]
        if j >= 0:
            for i in range(x.shape[0]):
                dx, dy = x[i] - middles[0, j], y[i] - middles[1, j]
                entries[k, i] += far_influence(dx, dy, squares[j], terms, j)


@compiled
def _add_remainder(blocks, remainder, values):
    """Add entries of the remainder: the series everywhere, then what is too near anew."""
    x, rows, starts, cells = blocks
    series, near, least, factor = remainder
    at = 0
    for block in range(rows.shape[1]):
        some = cells[starts[block] : starts[block + 1]]
        x0, y0 = x[0, rows[0, block] : rows[1, block]], x[1, rows[0, block] : rows[1, block]]
        part = np.zeros((x0.shape[0], some.shape[0]))
        add_series(x0, y0, some, series, factor, part)
        for i in range(x0.shape[0]):
            for k in range(some.shape[0]):
                j = some[k]
                dx, dy = x0[i] - series.centres[0, j], y0[i] - series.centres[1, j]
                if dx * dx + dy * dy <= least[j]:
                    part[i, k] = factor * along_ribs(x0[i], y0[i], j, near)
                values[at] += part[i, k]
                at += 1
