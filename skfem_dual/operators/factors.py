"""Factors of a dense matrix that any number of threads may use at a time."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.linalg import lu_factor, lu_solve


@dataclass(frozen=True, eq=False)
class Factors:
    """LU factors with the pivots of their rows.

    LAPACK's ``getrs``, as scipy calls it, counts the pivots from one while it works and writes
    that into the array it is given: every solution takes a copy of its own.
    """

    lu: ndarray
    pivots: ndarray

    @classmethod
    def from_matrix(cls, matrix: ndarray) -> "Factors":
        """Of a square matrix, real or complex."""
        lu, pivots = lu_factor(matrix)
        lu.setflags(write=False)
        pivots.setflags(write=False)
        return cls(lu, pivots)

    def solve(self, rhs: ndarray, transposed: bool = False) -> ndarray:
        """Solution for right-hand sides of shape (n,) or (n, k)."""
        return lu_solve((self.lu, self.pivots.copy()), rhs, trans=int(transposed))

    def __matmul__(self, rhs: ndarray) -> ndarray:
        """The inverse times ``rhs``."""
        return self.solve(np.asarray(rhs))
