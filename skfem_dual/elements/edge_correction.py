"""What edge-weighted cells add to the settlements under uniform ones.

Near a cell they are integrals over it, see `near_sums`. Far from it the moments of the weight act
by the series of 1 / r. The matrix of edge-weighted cells is the sum of uniform entries, a sparse
near and a smooth far correction, each of which any operator can take.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..kernels.compiled import inputs, vectorised
from ..kernels.once import ReadOnly, computed_once
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights
from .moments import INSIDE, Series, far_influence
from .near_sums import NearSums
from .remainder import add_by_rows

#: points nearer to a cell's centroid than so many of its radii take the exact correction; none of
#: a regular mesh lies just there
IN_STRIPS = 2.03
#: nanoseconds that the series of a cell takes, about
CELL = 2


@dataclass(frozen=True, eq=False)
class EdgeCorrection(ReadOnly):
    """Settlements under ``w / mean(w) - 1`` on each cell, to be added to those of uniform cells.

    Attributes
    ----------
    x : (2, m) array of float
        Field points.
    cells : (k,) array of int
        Weighted cells.
    far : Series
        What these do outside of their circles.
    near_rows : tuple of ndarray
        Starts, columns and values of `near`.
    ncells : int
        The number n of all cells.
    """

    x: ndarray
    cells: ndarray
    far: Series
    near_rows: tuple[ndarray, ...]
    ncells: int

    @classmethod
    def from_weights(cls, weights: EdgeWeights, coefficient: float, x: ndarray) -> Self:
        """Correction of a substrate with the influence ``coefficient / r`` near its origin."""
        near = NearSums.from_cells(weights.partition, weights, weights.cells, IN_STRIPS, x)
        return cls.from_sums(weights, coefficient, x, near)

    @classmethod
    def from_sums(
        cls, weights: EdgeWeights, coefficient: float, x: ndarray, sums: NearSums
    ) -> Self:
        """The same by what is known near the cells, at least near all weighted ones."""
        unit = Series.from_weights(weights, 1.0)
        starts, columns = np.zeros(x.shape[1] + 1, np.int32), np.empty_like(sums.column)
        values, known = np.empty_like(sums.law), inputs(sums.column, sums.law, weights.number)
        count = _put_near(*known, sums.pairs, unit, starts, columns, values)
        rows = inputs(starts, columns[:count], coefficient * values[:count])
        (terms,) = inputs(coefficient * unit.terms)
        far = unit._replace(terms=terms)
        return cls(x, weights.cells, far, rows, len(weights.partition))

    @computed_once
    def near(self) -> csr_matrix:
        """Correction near the cells, less the series, (m, n)."""
        starts, columns, values = self.near_rows
        return csr_matrix((values, columns, starts), shape=(self.x.shape[1], self.ncells))

    def add(self, rows: slice, block: ndarray) -> None:
        """Add the correction to a block of some rows of a dense matrix."""
        starts, columns, values = self.near_rows
        near = starts[rows.start : rows.stop + 1], columns, values
        _add_series(*inputs(self.x[:, rows], self.cells), self.far, near, block)

    def add_to(self, matrix: ndarray) -> None:
        """Add the correction to a dense matrix of shape (m, n)."""
        add_by_rows(self.add, matrix, CELL * len(self.cells))

    def apply(self, q: ndarray) -> ndarray:
        """The correction times mean pressures ``q`` of shape (n,) or (n, k)."""
        out = np.ascontiguousarray(self.near @ q)
        columns = out.reshape(len(out), q[0].size)  # also at no points
        x, own = inputs(self.x, q[self.cells].reshape(len(self.cells), q[0].size).T)

        def work(rows: slice) -> None:
            _sum_series(*inputs(x[:, rows]), own, self.far, columns[rows])

        with Threads() as run:
            run(work, self.x.shape[1], CELL * len(self.cells))
        return out


@vectorised
def _put_near(column, law, number, pairs, far, starts, columns, values):
    """Put ``law`` of pairs that are near, less the series, one point after the other; returns how
    many."""
    middles, squares, terms = far
    x, points = pairs.x, pairs.points
    for room in (False, True):  # counted before they are put
        if room:
            for i in range(starts.shape[0] - 1):
                starts[i + 1] += starts[i]
            at = starts.copy()
        for i in range(column.shape[0]):
            j, k = column[i], number[column[i]]
            if k < 0:
                continue
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            if dx * dx + dy * dy > (IN_STRIPS / INSIDE) ** 2 * squares[k]:
                continue
            if room:
                place = at[points[i]]
                columns[place] = j
                values[place] = law[i] - far_influence(dx, dy, squares[k], terms, k)
                at[points[i]] += 1
            else:
                starts[points[i] + 1] += 1
    return starts[-1]


@vectorised
def _add_series(x, cells, far, near, matrix):
    middles, squares, terms = far
    starts, columns, values = near
    added = np.empty(cells.shape[0])
    for i in range(x.shape[1]):
        for k in range(cells.shape[0]):
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            added[k] = far_influence(dx, dy, squares[k], terms, k)
        for k in range(cells.shape[0]):
            matrix[i, cells[k]] += added[k]
        for k in range(starts[i], starts[i + 1]):
            matrix[i, columns[k]] += values[k]


@vectorised
def _sum_series(x, q, far, out):
    """Add sums with the weights q, (k, ncells), to (m, k)."""
    middles, squares, terms = far
    one = np.empty(squares.shape[0])
    for i in range(x.shape[1]):
        for k in range(one.shape[0]):
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            one[k] = far_influence(dx, dy, squares[k], terms, k)
        for s in range(q.shape[0]):
            total = 0.0
            for k in range(one.shape[0]):
                total += q[s, k] * one[k]
            out[i, s] += total
