"""Solutions with LU factors that several threads share."""

from numpy import ndarray
from scipy.linalg import lu_solve


def solve_factorised(factors: tuple[ndarray, ndarray], rhs: ndarray, trans: int = 0) -> ndarray:
    """As `scipy.linalg.lu_solve`, from any number of threads at a time.

    ``getrs`` of LAPACK counts pivots from one, and scipy shifts them in place for as long as the
    call takes: a second thread would see other rows. Each call takes a copy.
    """
    lu, pivots = factors
    return lu_solve((lu, pivots.copy()), rhs, trans=trans)
