"""Solutions with shared factors."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.linalg import lu_factor

from skfem_dual.operators.factors import solve_factorised


@pytest.mark.parametrize("trans", [0, 1])
def test_threads_share_factors(trans):
    """LAPACK shifts pivots in place while it solves: every call needs its own."""
    rng = np.random.default_rng(0)
    matrix = rng.standard_normal((400, 400))
    factors = lu_factor(matrix)
    rhs = rng.standard_normal((400, 200))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda b: solve_factorised(factors, b, trans), list(rhs.T) * 10))
    product = (matrix.T if trans else matrix) @ np.transpose(found)
    assert np.abs(product - np.tile(rhs, 10)).max() < 1e-9
