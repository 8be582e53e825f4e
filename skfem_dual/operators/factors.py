"""Factors of matrices, for any number of threads at a time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, eigsh

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

    def condition_number(self, matrix: ndarray) -> float:
        """Condition number in the 2-norm of the ``matrix`` that these are the factors of."""

        def largest(product: Callable[[ndarray], ndarray]) -> float:
            gram = LinearOperator(matrix.shape, matvec=product, dtype=float)
            # fixed start: the same digits in every run
            start = np.random.default_rng(0).standard_normal(len(matrix))
            return float(eigsh(gram, k=1, tol=1e-8, v0=start, return_eigenvectors=False)[0])

        if len(matrix) < 3:  # too small for Lanczos
            return float(np.linalg.cond(matrix))
        scale = np.abs(matrix).max()  # in any units
        scaled = matrix / scale

        def inverse(v: ndarray, trans: int = 0) -> ndarray:
            return scale * self.solve(v, trans)

        top = largest(lambda v: scaled.T @ (scaled @ v))
        bottom = largest(lambda v: inverse(inverse(v, trans=1)))
        return float(np.sqrt(top * bottom))

    def __matmul__(self, rhs: ndarray) -> ndarray:
        return self.solve(rhs)
