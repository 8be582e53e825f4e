"""Entries of a fast summation for blocks of cells that are near each other."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..ground.hankel import SquareTable, square_value
from ..kernels.compiled import inputs, vectorised
from .fmm.near_entries import Rows, Runs, charge_at
from .fmm.summation import FastSummation
from .influence_operator import InfluenceOperator


class KnownEntries(NamedTuple):
    """Entries of a fast summation that are known, and points for the others.

    Attributes
    ----------
    point, cell : (n,) array of int
        Row and column of each cell in the order of the blocks.
    block : (n,) array of int
        Block that has each row.
    runs, rows : Runs, Rows
        Blocks of near entries, `FastSummation.p2p`.
    x, centroids : (2, n) array of float
        Collocation points and centroids.
    charges : (n,) array of float
        What unit pressures on cells leave at unit distance.
    unit : float
        That of a circle of unit radius.
    areas : (n,) array of float
        Those of the cells over the modulus of the surface, by which ``omega`` is kept.
    omega : SquareTable
        The part of the influence function that is not c / r, no panels without one.
    smallest : float
        Square of the smallest distance of this table.
    """

    point: ndarray
    cell: ndarray
    block: ndarray
    runs: Runs
    rows: Rows
    x: ndarray
    centroids: ndarray
    charges: ndarray
    unit: float
    areas: ndarray
    omega: SquareTable
    smallest: float

    @classmethod
    def from_summation(
        cls, fast: FastSummation, operator: InfluenceOperator, cells: ndarray
    ) -> "KnownEntries":
        """With the ``cells`` in the order of the blocks."""
        n = len(cells)
        rank = np.empty((2, n), np.int32)
        rank[0, fast.tree.points] = rank[1, fast.tree.cells] = np.arange(n)
        rows = fast.p2p.runs.rows
        order = np.argsort(rows[0])
        block = np.repeat(order, (rows[1] - rows[0])[order])  # all points are in one
        partition, ground = operator.partition, operator.substrate
        unit, areas = np.pi * ground.singular_coefficient, partition.areas[cells]
        omega, smallest = SquareTable(np.empty((0, 1)), 0), 0.0
        if (table := ground.remainder) is not None:
            omega, smallest = table.squares[0], table.nearest**2
        point, cell, block = inputs(rank[0, cells], rank[1, cells], block)
        x, centroids = inputs(operator.x[:, cells], partition.centroids[:, cells])
        charges, areas = inputs(unit / np.pi * areas, areas / ground.surface.young)
        kept = fast.p2p.runs, fast.p2p.rows, x, centroids, charges, unit, areas
        return cls(point, cell, block, *kept, omega, smallest)


@vectorised
def look_up(starts, items, known, stamp, place, out):
    """Square blocks with the rows and columns of some items, from `KnownEntries`; entries that are
    not known as if the pressures were in the centroids.

    ``stamp`` and ``place``, of n integers each, zero at first, are for temporary use: cells that
    act on a block of rows have one more than its number, and their place among them.
    """
    point, cell, block, kept = known.point, known.cell, known.block, known.rows
    x, centroids, charges = known.x, known.centroids, known.charges
    areas, (omega, panel), smallest = known.areas, known.omega, known.smallest
    rows, begin, near_cells, offsets = known.runs
    first, unit = rows[0], known.unit
    at, last, width = 0, -1, 0
    for k in range(starts.shape[0] - 1):
        some = items[starts[k] : starts[k + 1]]
        for i in some:
            row, b = point[i], block[point[i]]
            if b != last:
                last, width = b, 0
                for run in range(begin[b], begin[b + 1]):
                    for j in range(near_cells[0, run], near_cells[1, run]):
                        stamp[j], place[j] = b + 1, width
                        width += 1
            base, greatest = offsets[b] + (row - first[b]) * width, kept.own[row]
            for j in some:
                other = cell[j]
                near = stamp[other] == b + 1
                if near and place[other] == greatest:
                    out[at] = kept.greatest[row]
                else:
                    dx, dy = x[0, i] - centroids[0, j], x[1, i] - centroids[1, j]
                    out[at] = 0.0
                    if not near or kept.charge > 0.0:
                        out[at] = charge_at(dx, dy, charges[j] / unit, unit)
                    if not near and omega.shape[0] > 0:
                        r2 = max(dx * dx + dy * dy, smallest)
                        out[at] += areas[j] * square_value(omega, panel, r2)
                    if near:
                        out[at] += kept.units[row] * kept.values[base + place[other]]
                at += 1
