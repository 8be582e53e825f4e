"""Factors of matrices, for any number of threads at a time."""

from dataclasses import dataclass

from numpy import ndarray
from scipy.linalg import lu_factor, lu_solve

from ..grids.polygons import readonly


@dataclass(frozen=True, eq=False)
class Factors:
    """LU factors of a square matrix.

    Attributes
    ----------
    lu : (n, n) array
        Both factors, as LAPACK has them.
    pivots : (n,) array of int
        Rows that were exchanged.
    """

    lu: ndarray
    pivots: ndarray

    @classmethod
    def from_matrix(cls, matrix: ndarray) -> "Factors":
        """Of a square array of finite numbers."""
        lu, pivots = lu_factor(matrix)
        lu.setflags(write=False)
        return cls(lu, readonly(pivots))

    def solve(self, rhs: ndarray, trans: int = 0) -> ndarray:
        """Solutions for right-hand sides (n,) or (n, k); of the transposed matrix with 1, of the
        conjugate one with 2.

        ``getrs`` of LAPACK counts pivots from one, and scipy shifts them in place for as long as
        the call takes: a second thread would see other rows. Each call takes a copy.
        """
        return lu_solve((self.lu, self.pivots.copy()), rhs, trans=trans)

    def __matmul__(self, rhs: ndarray) -> ndarray:
        return self.solve(rhs)
