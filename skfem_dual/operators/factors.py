"""Factors of matrices, for any number of threads at a time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.linalg import get_lapack_funcs, lu_factor
from scipy.sparse.linalg import LinearOperator, eigsh

from ..grids.polygons import readonly
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.once import computed_once
from ..kernels.threads import Threads

TINY, EPS = float(np.finfo(float).tiny), float(np.finfo(float).eps)
#: rounding errors of double precision over those of single
PER_SINGLE = EPS / float(np.finfo(np.float32).eps)


#: real matrices of so many rows are factorised in single precision: in half the time
SINGLE = 500
#: for up to so many right-hand sides at a time refinement is sooner done than factors in double
#: precision, and in up to so many steps
FEW, STEPS = 16, 6
#: so many columns are sooner solved for one by one: BLAS copies the whole matrix for them together
APART = 4


@dataclass(frozen=True, eq=False)
class Factors:
    """LU factors of a square matrix.

    Those of large real matrices are in single precision: solutions are refined by residuals in
    double precision, to its accuracy. Where steps do not become shorter as fast as they should,
    for many right-hand sides and for transposed matrices factors `in_double` are made.

    Source: N. J. Higham, Accuracy and Stability of Numerical Algorithms (2002), chapter 12.

    Attributes
    ----------
    lu : (n, n) array
        Both factors, as LAPACK has them; in single precision those of the transposed matrix over
        its largest entry.
    pivots : (n,) array of int
        Rows that were exchanged.
    matrix : (n, n) array or None
        The matrix, if the factors are in single precision.
    scale : float
        Its largest entry then.
    """

    lu: ndarray
    pivots: ndarray
    matrix: ndarray | None = None
    scale: float = 1.0

    @classmethod
    def from_matrix(cls, matrix: ndarray, single: bool = True) -> "Factors":
        """Of a square array of finite numbers; of a large one in single precision if allowed."""
        if not single or len(matrix) < SINGLE or matrix.dtype != np.float64:
            return cls(*_factors(matrix))
        lu, pivots, scale = _in_single(matrix)
        return cls(lu, pivots, matrix, scale)

    @computed_once
    def in_double(self) -> "Factors":
        """Those in double precision, or complex."""
        return self if self.matrix is None else Factors(*_factors(self.matrix))

    def solve(self, rhs: ndarray, trans: int = 0) -> ndarray:
        """Solutions for right-hand sides (n,) or (n, k); of the transposed matrix with 1, of the
        conjugate one with 2.
        """
        if self.matrix is None:
            return self._substituted(rhs, trans)
        if trans == 0 and 0 < rhs.size <= FEW * len(rhs):
            found = self._refined(self.matrix, rhs)
            if found is not None:
                return found
        return self.in_double._substituted(rhs, trans)

    def _substituted(self, rhs: ndarray, trans: int) -> ndarray:
        """``getrs`` of LAPACK counts pivots from one, and scipy shifts them in place for as long
        as the call takes: a second thread would see other rows. Each call takes a copy."""
        if rhs.size == 0:
            return np.zeros(rhs.shape, self.lu.dtype)
        (getrs,) = get_lapack_funcs(("getrs",), (self.lu, rhs))
        pivots = self.pivots.copy()
        if rhs.ndim == 2 and 0 < rhs.shape[1] <= APART:
            each = [getrs(self.lu, pivots, column, trans=trans)[0] for column in rhs.T]
            return np.stack(each, axis=1)
        return getrs(self.lu, pivots, rhs, trans=trans)[0]

    def _refined(self, matrix: ndarray, rhs: ndarray) -> ndarray | None:
        """Solutions to rounding errors; None where steps do not fall fast."""
        found, last, floor = self @ rhs, 1.0, 0.0
        for _ in range(STEPS):
            step = self @ (rhs - _settled(matrix, found))
            found += step
            size = float((np.abs(step).max(axis=0) / np.abs(found).max(axis=0).clip(TINY)).max())
            floor = floor or size * len(rhs) * PER_SINGLE  # condition and growth are in this one
            if size * size <= EPS * last:  # the next one would not be seen
                return found
            if not size < 0.1 * last:  # rounding errors of residuals, or of the factors
                return found if last <= floor else None
            last = size
        return None

    def condition_number(self, matrix: ndarray) -> float:
        """Condition number in the 2-norm of the ``matrix`` that these are the factors of."""
        factors = self.in_double

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
            return scale * factors.solve(v, trans)

        top = largest(lambda v: scaled.T @ (scaled @ v))
        bottom = largest(lambda v: inverse(inverse(v, trans=1)))
        return float(np.sqrt(top * bottom))

    def __matmul__(self, rhs: ndarray) -> ndarray:
        """Solutions by the factors alone, to their precision."""
        if self.matrix is None:
            return self._substituted(rhs, 0)
        size = np.abs(rhs).max(axis=0).clip(TINY)  # in any units
        return self._substituted((rhs / size).astype(np.float32), 1) * (size / self.scale)


@dataclass(frozen=True, eq=False)
class RoughFactors:
    """LU factors in single precision of a matrix that is not kept: an approximate inverse.

    What they are multiplied by is in double precision, so that products are the same linear map
    to its rounding, which iterations may ask for.

    Attributes
    ----------
    lu, pivots, scale
        As of `Factors`, the first transposed.
    """

    lu: ndarray
    pivots: ndarray
    scale: float

    @classmethod
    def from_matrix(cls, matrix: ndarray) -> "RoughFactors":
        """Of a square array of finite numbers."""
        lu, pivots, scale = _in_single(matrix)
        return cls(lu.T, pivots, scale)

    def solve(self, rows: ndarray) -> ndarray:
        """Solutions for right-hand sides in rows, (k, n)."""
        out = rows / self.scale
        _substitute(*inputs(self.lu, self.pivots), out)
        return out


@vectorised
def _substitute(lu, pivots, rows):
    """Solutions in place of right-hand sides, by factors of the transposed matrix."""
    n = lu.shape[0]
    for i in range(n):
        for row in rows:
            total = 0.0
            for j in range(i):
                total += lu[i, j] * row[j]
            row[i] = (row[i] - total) / lu[i, i]
    for i in range(n - 1, -1, -1):
        for row in rows:
            total = 0.0
            for j in range(i + 1, n):
                total += lu[i, j] * row[j]
            row[i] -= total
    for i in range(n - 1, -1, -1):
        for row in rows:
            row[i], row[pivots[i]] = row[pivots[i]], row[i]


def _in_single(matrix: ndarray) -> tuple[ndarray, ndarray, float]:
    """Factors of the transposed matrix over its largest entry, and this."""
    scale = float(max(matrix.max(), -matrix.min()))
    single = np.empty(matrix.shape, np.float32)
    np.multiply(matrix, 1 / scale, out=single, casting="same_kind")
    return *_factors(single.T), scale


def _factors(array: ndarray) -> tuple[ndarray, ndarray]:
    lu, pivots = lu_factor(array, overwrite_a=array.dtype == np.float32)
    lu.setflags(write=False)
    return lu, readonly(pivots)


def _settled(matrix: ndarray, found: ndarray) -> ndarray:
    """A matrix times solutions."""
    if found.ndim == 2 and 0 < found.shape[1] <= APART:
        return FewColumns(matrix) @ found
    return matrix @ found


@dataclass(frozen=True, eq=False)
class FewColumns:
    """A matrix whose entries are read once for all columns, which BLAS does for many only."""

    matrix: ndarray

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and columns."""
        return self.matrix.shape

    def __matmul__(self, q: ndarray) -> ndarray:
        """The product with an array of shape (n, k)."""
        out = np.empty((q.shape[1], len(self.matrix)))
        matrix, columns = inputs(self.matrix, q.T)
        with Threads() as run:
            run(lambda k: _multiply(k.start, k.stop, matrix, columns, out), len(out.T), q.size)
        return out.T


@vectorised
def _multiply(begin, end, matrix, columns, out):
    """Four rows and three columns at a time: entries are read once for these."""
    last, most = end - 1, columns.shape[0] - 1
    for i in range(begin, end, 4):
        k, m, n = min(i + 1, last), min(i + 2, last), min(i + 3, last)
        for s in range(0, columns.shape[0], 3):
            t, u = min(s + 1, most), min(s + 2, most)
            i_s, i_t, i_u, k_s, k_t, k_u = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            m_s, m_t, m_u, n_s, n_t, n_u = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(columns.shape[1]):
                x, y, z = columns[s, j], columns[t, j], columns[u, j]
                a, b, c, d = matrix[i, j], matrix[k, j], matrix[m, j], matrix[n, j]
                i_s, i_t, i_u = i_s + a * x, i_t + a * y, i_u + a * z
                k_s, k_t, k_u = k_s + b * x, k_t + b * y, k_u + b * z
                m_s, m_t, m_u = m_s + c * x, m_t + c * y, m_u + c * z
                n_s, n_t, n_u = n_s + d * x, n_t + d * y, n_u + d * z
            out[s, i], out[t, i], out[u, i] = i_s, i_t, i_u
            out[s, k], out[t, k], out[u, k] = k_s, k_t, k_u
            out[s, m], out[t, m], out[u, m] = m_s, m_t, m_u
            out[s, n], out[t, n], out[u, n] = n_s, n_t, n_u


def submatrix(matrix: ndarray, rows: ndarray, columns: ndarray) -> ndarray:
    """Some rows and columns, by their numbers from zero: in a third of the time of numpy's."""
    out = np.empty((len(rows), len(columns)), matrix.dtype)
    _take(*inputs(matrix, rows, columns), out)
    return out


@compiled
def _take(matrix, rows, columns, out):
    for i in range(rows.shape[0]):
        row = matrix[rows[i]]
        for j in range(columns.shape[0]):
            out[i, j] = row[columns[j]]
