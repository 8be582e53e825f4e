"""Series of smooth radial functions against sums over points."""

from math import factorial
from types import SimpleNamespace

import numpy as np
import pytest

from skfem_dual import GradedHalfSpace
from skfem_dual.elements.radial_series import RadialSeries, add_series
from skfem_dual.ground.hankel import COARSE, COARSE_DEGREE, SquareTable
from skfem_dual.kernels.compiled import inputs

X = np.array([[0.9, -0.4, 0.1, -1.3], [0.3, 0.8, -0.7, -0.2]])


def tables(function):
    """As of a `RadialTable`."""
    between = 1e-6, 10.0
    return SimpleNamespace(
        coarse=SquareTable.from_function(function, *between, COARSE, COARSE_DEGREE),
        squares=[SquareTable.from_function(function, *between)],
        nearest=1e-6,
    )


def errors(function, table, size, few=np.inf):
    """Of forces at random points of that distance about two points."""
    points = np.random.default_rng(0).uniform(-size, size, (2, 30))
    points -= points.mean(axis=1)[:, None]
    powers = ((i, j) for i in range(5) for j in range(5 - i))
    moments = np.zeros((5, 5, 1))
    for i, j in powers:
        moments[i, j] = np.sum(points[0] ** i * points[1] ** j) / factorial(i) / factorial(j)
    centres = np.array([[0.05, -0.1], [0.0, 0.02]])
    series = RadialSeries.from_moments(centres, np.tile(moments, 2), table, np.full(2, float(few)))
    found = np.zeros((4, 2))
    add_series(*inputs(*X, np.array([1, 0], np.int32)), series, 2.0, found)
    away = X[:, :, None, None] - centres[:, None, ::-1, None] - points[:, None, None]
    return found - 2.0 * function(np.hypot(*away)).sum(axis=-1)


@pytest.mark.parametrize(("few", "order"), [(np.inf, 5), (0.0, 3)])
def test_order_of_the_series(few, order):
    """Of all terms, and of those up to the second degree."""
    table = tables(np.log)
    coarse, fine = (np.abs(errors(np.log, table, size, few)) for size in (0.1, 0.05))
    assert coarse.sum() / fine.sum() == pytest.approx(2**order, rel=0.1)


@pytest.mark.parametrize(("few", "power"), [(np.inf, 4), (0.0, 2)])
def test_powers_of_distances_are_exact(few, power):
    """Polynomials in the coordinates, of no higher degree."""

    def function(r):
        return r**power

    assert errors(function, tables(function), 0.3, few) == pytest.approx(
        np.zeros((4, 2)), abs=1e-7
    )


def test_table_of_a_ground():
    table = GradedHalfSpace.init_linear(1.0, 0.25, 1.0).remainder

    def rest(r):
        return table.evaluate(table.omega, r)

    for size, few in ((0.03, np.inf), (0.003, 0.0)):
        assert errors(rest, table, size, few) == pytest.approx(np.zeros((4, 2)), abs=1e-6)
