"""Equations with a large dense matrix of settlements: few right-hand sides need no factors.

A product with the matrix takes a thousandth of the time of its factors, and some ten iterations
lead to rounding errors by an approximate inverse in two levels: small groups of cells with their
neighbours, then uniform pressures on larger boxes under what that leaves, which the matrix itself
tells (multiplicative Schwarz: Smith, Bjorstad and Gropp, Domain Decomposition, 1996).
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..grids.partition import Partition
from ..kernels.compiled import inputs, vectorised
from ..kernels.once import computed_once
from .factors import Factors, FewColumns
from .iterative import solve_many
from .preconditioner import Groups, large_boxes

#: matrices of so many rows are first tried by iterations, for up to so many right-hand sides
ITERATED, FEW = 1000, 9
#: residuals over right-hand sides at which they end, and iterations after which factors are made
ROUNDING, MOST = 1e-14, 40
#: cells of a box, about
BOX = 12


@dataclass(frozen=True, eq=False)
class DenseSolver:
    """What solves equations with a dense matrix of settlements.

    Attributes
    ----------
    matrix : (n, n) array of float
        Settlement of each collocation point under unit pressure on each cell.
    inverse : TwoLevels
        An approximate inverse.
    """

    matrix: ndarray
    inverse: "TwoLevels"

    @classmethod
    def from_matrix(cls, matrix: ndarray, partition: Partition) -> "DenseSolver":
        """Of the cells of a partition."""
        return cls(matrix, TwoLevels.from_matrix(matrix, partition))

    @computed_once
    def factors(self) -> Factors:
        """Those of the matrix."""
        return Factors.from_matrix(self.matrix)

    def solve(self, rhs: ndarray) -> ndarray:
        """Solutions for right-hand sides (n,) or (n, k)."""
        columns = rhs.reshape(len(rhs), -1)
        if columns.shape[1] <= FEW:  # whether factors are there or not: the same bits
            few = FewColumns(self.matrix)
            found = solve_many(few, columns, ROUNDING, preconditioner=self.inverse, most=MOST)
            if found.success:
                return found.solution.reshape(rhs.shape)
        return self.factors.solve(rhs)

    def __matmul__(self, w: ndarray) -> ndarray:
        """Approximate solutions for right-hand sides (n,) or (n, k)."""
        return self.inverse @ w

    def condition_number(self, matrix: ndarray) -> float:
        """As of `Factors`."""
        return self.factors.condition_number(matrix)


@dataclass(frozen=True, eq=False)
class TwoLevels:
    """An approximate inverse of a dense matrix of settlements.

    Attributes
    ----------
    groups : Groups
        What answers settlements that vary from cell to cell.
    means : (nboxes, n) csr_matrix
        Takes means over boxes.
    rows : (nboxes, n) array of float
        Means of the matrix's rows.
    box : (n,) array of int
        The box of each cell.
    coarse : Factors
        Of mean settlements under unit pressures on boxes.
    """

    groups: Groups
    means: csr_matrix
    rows: ndarray
    box: ndarray
    coarse: Factors

    @classmethod
    def from_matrix(cls, matrix: ndarray, partition: Partition) -> "TwoLevels":
        """Of the cells of a partition."""
        box, n = large_boxes(partition, BOX), len(partition)
        shares = partition.areas / np.bincount(box, partition.areas)[box]
        means = csr_matrix((shares, (box, np.arange(n))))
        rows, coarse = np.zeros(means.shape), np.zeros(2 * means.shape[:1])
        order = np.argsort(box, kind="stable")
        _put_means(*inputs(matrix, shares, box, order), rows, coarse)
        groups = Groups.from_operator(matrix, partition)
        return cls(groups, means, rows, box, Factors.from_matrix(coarse))

    def __matmul__(self, w: ndarray) -> ndarray:
        """Approximate pressures under settlements ``w`` of shape (n,) or (n, k)."""
        columns = w.reshape(len(w), -1)
        p = self.groups @ columns
        left = self.means @ columns - FewColumns(self.rows) @ p
        return (p + self.coarse.solve(left)[self.box]).reshape(w.shape)


@vectorised
def _put_means(matrix, shares, box, order, rows, coarse):
    """Means of rows over boxes, one box after the other, and their sums over boxes."""
    for i in order:
        row, share = rows[box[i]], shares[i]
        for j in range(row.shape[0]):
            row[j] += share * matrix[i, j]
    for k in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            coarse[k, box[j]] += rows[k, j]
