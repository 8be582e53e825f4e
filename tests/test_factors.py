"""Solutions with shared factors."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from skfem_dual.operators.factors import Factors


@pytest.mark.parametrize("trans", [0, 1])
def test_threads_share_factors(trans):
    """LAPACK shifts pivots in place while it solves: every call needs its own."""
    rng = np.random.default_rng(0)
    matrix = rng.standard_normal((400, 400))
    factors = Factors.from_matrix(matrix)
    rhs = rng.standard_normal((400, 200))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda b: factors.solve(b, trans), list(rhs.T) * 10))
    product = (matrix.T if trans else matrix) @ np.transpose(found)
    assert np.abs(product - np.tile(rhs, 10)).max() < 1e-9
