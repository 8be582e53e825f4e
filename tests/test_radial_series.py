"""Series of smooth radial functions against sums over points."""

from math import factorial

import numpy as np
import pytest

from skfem_dual import GradedHalfSpace
from skfem_dual.elements.radial_series import RadialSeries, add_series
from skfem_dual.ground.hankel import COARSE, COARSE_DEGREE, SquareTable
from skfem_dual.kernels.compiled import inputs

X = np.array([[0.9, -0.4, 0.1, -1.3], [0.3, 0.8, -0.7, -0.2]])


def errors(function, table, size):
    """Of forces at random points of that distance about two points."""
    points = np.random.default_rng(0).uniform(-size, size, (2, 30))
    points -= points.mean(axis=1)[:, None]
    powers = ((i, j) for i in range(5) for j in range(5 - i))
    moments = np.zeros((5, 5, 1))
    for i, j in powers:
        moments[i, j] = np.sum(points[0] ** i * points[1] ** j) / factorial(i) / factorial(j)
    centres = np.array([[0.05, -0.1], [0.0, 0.02]])
    series = RadialSeries.from_moments(centres, np.tile(moments, 2), table, 1e-12)
    found = np.zeros((4, 2))
    add_series(*inputs(*X, np.array([1, 0], np.int32)), series, 2.0, found)
    away = X[:, :, None, None] - centres[:, None, ::-1, None] - points[:, None, None]
    return found - 2.0 * function(np.hypot(*away)).sum(axis=-1)


def test_order_of_the_series():
    table = SquareTable.from_function(np.log, 1e-6, 10.0, COARSE, COARSE_DEGREE)
    coarse, fine = (np.abs(errors(np.log, table, size)) for size in (0.1, 0.05))
    assert coarse.sum() / fine.sum() == pytest.approx(2**5, rel=0.1)


def test_squares_of_squares_are_exact():
    """A polynomial of the fourth degree in the coordinates."""
    table = SquareTable.from_function(lambda r: r**4, 1e-6, 10.0, COARSE, COARSE_DEGREE)
    assert errors(lambda r: r**4, table, 0.3) == pytest.approx(np.zeros((4, 2)), abs=1e-7)


def test_table_of_a_ground():
    table = GradedHalfSpace.init_linear(1.0, 0.25, 1.0).remainder

    def rest(r):
        return table.evaluate(table.omega, r)

    assert errors(rest, table.coarse, 0.03) == pytest.approx(np.zeros((4, 2)), abs=1e-6)
