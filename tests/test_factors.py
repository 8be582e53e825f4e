"""Solutions with shared factors."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from skfem_dual.operators.factors import SINGLE, Factors, FewColumns, RoughFactors


@pytest.mark.parametrize("columns", [1, 3, 5])
@pytest.mark.parametrize("n", [1, 7, 66])
def test_products_of_few_columns(n, columns):
    rng = np.random.default_rng(0)
    matrix, q = rng.standard_normal((n, n)), rng.standard_normal((n, columns))
    assert FewColumns(matrix) @ q == pytest.approx(matrix @ q, rel=1e-13, abs=1e-13)


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


def nearly_singular(n, smallest):
    """A matrix with singular values from 1 to that."""
    rng = np.random.default_rng(1)
    u, v = (rng.standard_normal((n, 6)) for _ in range(2))
    u, v = (np.linalg.qr(a)[0] for a in (u, v))
    matrix = np.eye(n) - (u * (1 - np.geomspace(1, smallest, 6))) @ u.T  # along u
    return matrix + 1e-3 * smallest * u @ v.T  # not symmetric


@pytest.mark.parametrize(("smallest", "refined"), [(1e-4, True), (1e-11, False)])
def test_single_precision_is_refined_or_given_up(smallest, refined):
    """Solutions as close as those in double precision; columns in any units, one of them zero."""
    matrix = 1e-60 * nearly_singular(SINGLE, smallest)
    factors = Factors.from_matrix(matrix)
    assert factors.lu.dtype == np.float32
    exact = np.random.default_rng(0).standard_normal((SINGLE, 3)) * [1.0, 1e50, 0.0]
    found = factors.solve(matrix @ exact)
    assert np.abs(found - exact)[:, 0].max() < 1e-14 / smallest
    assert np.abs(found - exact)[:, 1].max() < 1e36 / smallest
    assert not found[:, 2].any()
    assert ("in_double" in vars(factors)) == (not refined)
    transposed = factors.solve(matrix.T @ exact[:, 0], trans=1)
    assert np.abs(transposed - exact[:, 0]).max() < 1e-14 / smallest


@pytest.mark.parametrize("unit", [1e-30, 1.0, 1e30])
def test_rough_factors_are_a_linear_map_near_the_inverse(unit):
    rng = np.random.default_rng(4)
    matrix = unit * (rng.standard_normal((300, 300)) + 10 * np.diag(rng.choice([-1.0, 1.0], 300)))
    factors, rhs = RoughFactors.from_matrix(matrix), rng.standard_normal((3, 300))
    found = factors.solve(rhs)
    assert np.abs(found @ matrix.T - rhs).max() < 1e-4
    together = factors.solve((np.array([[2.0, -3.0, 7.0]]) @ rhs) / 3)[0]
    assert together == pytest.approx((2 * found[0] - 3 * found[1] + 7 * found[2]) / 3, rel=1e-11)


def test_nothing_to_solve_for():
    """No equations, as of contact nowhere, and no right-hand sides."""
    assert Factors.from_matrix(np.empty((0, 0))).solve(np.empty((0, 1))).shape == (0, 1)
    for n in (2, 600):  # the latter in single precision
        assert Factors.from_matrix(np.eye(n)).solve(np.empty((n, 0))).shape == (n, 0)
