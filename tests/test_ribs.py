"""Integrals of 1/r over the triangle of a point and a rib."""

import numpy as np
import pytest
from scipy.integrate import quad

from skfem_dual.elements.ribs import far_rib_integrals, rib_integral, segment_integral


def by_quadrature(x, a, b):
    """The triangle's rays in polar coordinates: their lengths over the angle."""
    a, b = a - x, b - x
    d = b - a
    cross = a[0] * b[1] - a[1] * b[0]
    value, _ = quad(
        lambda t: cross / np.hypot(*(a + t * d)), 0, 1, epsabs=0, epsrel=1e-12, limit=400
    )
    return value


A, B = np.array([0.2, -0.1]), np.array([1.0, 0.5])


@pytest.mark.parametrize(
    "x",
    [
        (0.0, 0.4),  # on the left
        (0.7, -0.3),  # on the right, the foot inside the rib
        (2.0, 2.0),  # beyond its end
        (-1.0, -0.5),  # before its begin
        (0.9, 1.2),
        # just nearer and just farther than the change to the series
        (0.6 - 0.6 * 1.93, 0.2 + 0.8 * 1.93),
        (0.6 - 0.6 * 1.95, 0.2 + 0.8 * 1.95),
        (30.0, -40.0),
    ],
)
def test_against_quadrature(x):
    x = np.array(x)
    expected = by_quadrature(x, A, B)
    assert segment_integral(*x, *A, *B) == pytest.approx(expected, rel=1e-11)
    assert segment_integral(*x, *B, *A) == pytest.approx(-expected, rel=1e-11)
    d = B - A
    r1, r2 = np.hypot(*(x - A)), np.hypot(*(x - B))
    value = rib_integral(*x, *A, *d, np.hypot(*d), r1, r2)
    assert value == pytest.approx(expected, rel=1e-11)


def test_on_the_line_of_the_rib():
    for t in (-1.0, 0.0, 0.3, 1.0, 2.0):
        assert segment_integral(*(A + t * (B - A)), *A, *B) == pytest.approx(0.0, abs=1e-15)
    assert segment_integral(0.0, 0.0, *A, *A) == 0.0


def test_many_far_points():
    """The same as one by one; if one of them is near, it says that they are not far."""
    angle = np.linspace(0, 6, 20)
    x, y = A[0] + 5 * np.cos(angle), A[1] + 5 * np.sin(angle)
    d, length = B - A, np.hypot(*(B - A))
    values, room = np.empty(20), np.empty(20)
    assert far_rib_integrals(x, y, *A, *d, length, values, room)
    expected = [segment_integral(*point, *A, *B) for point in zip(x, y, strict=True)]
    assert values == pytest.approx(expected, rel=1e-13)
    x[7], y[7] = 0.5, 0.3
    assert not far_rib_integrals(x, y, *A, *d, length, values, room)
