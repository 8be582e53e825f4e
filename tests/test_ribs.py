"""Integrals of 1/r over the triangle of a point and a rib."""

import numpy as np
import pytest
from scipy.integrate import quad

from skfem_dual.elements.ribs import FAR, FARTHER, atanh_series, rib_integral, short_series
from skfem_dual.elements.segments import ROWS, WIDTH, add_segments, put_segment


def segment_integral(x, y, ax, ay, bx, by):
    d = np.array([bx - ax, by - ay])
    ends = np.hypot(x - ax, y - ay), np.hypot(x - bx, y - by)
    return rib_integral(x, y, ax, ay, *d, np.hypot(*d), *ends)


def sums_over(x, segments):
    """What `add_segments` makes of segments, each of its ends and its load."""
    room, count, sums = np.empty((ROWS, len(segments) + WIDTH)), 0, np.zeros((3, x.shape[1]))
    for *ends, load in segments:
        count = put_segment(room, count, *ends, load if np.ndim(load) else (load, 0.0, 0.0))
    add_segments(x, 0, x.shape[1], room, count, sums)
    return sums


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
        assert segment_integral(*(A + t * (B - A)), *A, *B) == pytest.approx(0.0, abs=3e-15)
    x = np.array([[0.0, A[0], 1.8], [0.0, A[1], 1.1]])
    assert sums_over(x, [(*A, *A, 1.0)]) == pytest.approx(0.0, abs=0.0)
    assert sums_over(x, [(*A, *B, 1.0)])[0, 1:] == pytest.approx(0.0, abs=1e-15)


def test_series():
    """To rounding up to where they serve."""
    for series, farthest in ((atanh_series, FAR), (short_series, FARTHER)):
        q = np.linspace(0.01, 1, 9) / farthest
        assert [series(z) for z in q**2] == pytest.approx(np.arctanh(q) / q, rel=5e-14)


def test_many_segments():
    """The same as one by one, on either side of the change to the series, to rounding."""
    rng = np.random.default_rng(1)
    segments = rng.uniform(-1, 1, (2 * WIDTH + 5, 5)) * [1, 1, 1, 1, 3]
    x = np.hstack([rng.uniform(-1, 1, (2, 9)), rng.uniform(-9, 9, (2, 9)), segments[0, :2, None]])
    expected = [
        sum(factor * segment_integral(*point, *ends) for *ends, factor in segments)
        for point in x.T
    ]
    assert sums_over(x, segments)[0] == pytest.approx(expected, rel=1e-13, abs=1e-13)


def test_unit_vectors_over_a_rectangle():
    """Against Gauss's points, from beside and by the symmetry from the middle."""
    corners = [(0, 0), (2, 0), (2, 1), (0, 1)]
    sides = [(*a, *b, 1.0) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    x = np.array([[3.0, 1.0], [2.0, 0.5]])
    t, w = np.polynomial.legendre.leggauss(20)
    u, v = np.meshgrid(1 + t - x[0, 0], (1 + t) / 2 - x[1, 0])
    r, weight = np.hypot(u, v), np.outer(w, w) / 2
    found = sums_over(x, sides)
    by_points = [np.sum(weight / r), np.sum(weight * u / r), np.sum(weight * v / r)]
    assert found[:, 0] == pytest.approx(by_points, rel=1e-12)
    centre = 2 * np.arcsinh(2) + 4 * np.arcsinh(0.5)
    assert found[:, 1] == pytest.approx([centre, 0, 0], rel=1e-14, abs=1e-14)
