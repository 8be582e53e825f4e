"""Polynomials over r on polygons against quadrature, and those that stand for moments."""

from math import factorial

import numpy as np
import pytest

from skfem_dual.elements.law_polynomials import LOWER_TERMS, TERMS, law_polynomials
from skfem_dual.elements.polygon_moments import polygon_moments
from skfem_dual.elements.polygon_sums import KNOWN, LANES, STEP, add_sides, put_side
from skfem_dual.grids.polygons import Polygons
from skfem_dual.kernels.compiled import inputs

PENTAGON = np.array([[0.0, 1.0, 1.3, 0.6, -0.1], [0.0, 0.1, 0.8, 1.2, 0.7]])
MIDDLE, SIZE = np.array([0.6, 0.5]), 1.1
EXPONENTS = [(d - j, j) for d in range(5) for j in range(d + 1)]


def value(terms, x, middle=MIDDLE, size=SIZE):
    u, v = (x - middle.reshape(2, *[1] * (x.ndim - 1))) / size
    return sum(t * u**i * v**j for t, (i, j) in zip(terms, EXPONENTS, strict=False))


def sums_over(corners, x, terms):
    """What `add_sides` makes of a polygon at one point."""
    sides, count = np.empty((corners.shape[1], KNOWN)), 0
    room = np.empty(TERMS), np.empty(TERMS), np.empty(TERMS)
    from_middle = corners - MIDDLE[:, None]
    for a, b in zip(from_middle.T, np.roll(from_middle, -1, axis=1).T, strict=True):
        count = put_side(sides, count, *a, *b, *inputs(terms), SIZE, room)
    sums = np.empty((4, LANES))
    px, py = (np.full(STEP, c) for c in x - MIDDLE)
    add_sides(px, py, sides, count, np.empty((6, len(sides) * LANES)), sums)
    assert (sums[:, :STEP] == sums[:, :1]).all()
    return sums[:, 0]


def by_rays(corners, x, terms):
    """Along rays from the point polynomials are integrated exactly, over their angles by Gauss."""
    t, w = np.polynomial.legendre.leggauss(60)
    t, w = (1 + t) / 2, w / 2
    total = np.zeros(4)
    for a, b in zip(corners.T, np.roll(corners, -1, axis=1).T, strict=True):
        a, d = a - x, b - a
        ends = a[:, None] + np.outer(d, t)
        cross, length = a[0] * d[1] - a[1] * d[0], np.hypot(*ends)
        points = x[:, None, None] + ends[..., None] * t
        first, second = value(terms[:TERMS], points) @ w, value(terms[TERMS:], points) @ (w * t)
        weight = cross * w / length
        unit = weight * (0.5 + second) * ends
        total += [weight @ first, weight.sum(), *unit.sum(axis=1)]
    return total


@pytest.mark.parametrize("x", [(0.5, 0.6), (1.25, 0.3), (2.5, -1.0), (-0.4, 0.35)])
def test_against_quadrature(x):
    terms = np.random.default_rng(0).normal(size=TERMS + LOWER_TERMS)
    found, expected = (f(PENTAGON, np.array(x), terms) for f in (sums_over, by_rays))
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("x", [PENTAGON[:, 1], (PENTAGON[:, 0] + PENTAGON[:, 1]) / 2])
def test_on_the_outline(x):
    """Continuous there, in a corner and on a side."""
    terms = np.random.default_rng(1).normal(size=TERMS + LOWER_TERMS)
    beside = x + 1e-9 * (MIDDLE - x)
    found = sums_over(PENTAGON, x, terms)
    assert found == pytest.approx(sums_over(PENTAGON, beside, terms), abs=1e-6)


def test_without_a_polynomial():
    """The pressure is one, its polynomial none."""
    x, none = np.array([1.25, 0.3]), np.zeros(TERMS + LOWER_TERMS)
    found = sums_over(PENTAGON, x, np.empty(0))
    assert found == pytest.approx(by_rays(PENTAGON, x, none), rel=1e-12)


def test_polynomials_have_the_moments_they_stand_for():
    """Of a polynomial they are that, but for degrees beyond theirs; in slivers, too."""
    thin = np.array([[0.9, -0.3], [0.4, 0.7]]) @ np.diag([1.0, 1e-4]) @ PENTAGON
    p = np.hstack([PENTAGON, thin])
    polygons = Polygons(p, np.arange(10), [0, 5, 10])
    known = polygon_moments(polygons, 8)
    size, terms = np.sqrt(polygons.areas), np.random.default_rng(2).normal(size=TERMS)
    moments = np.zeros((5, 5, 2))
    for i, j in EXPONENTS:
        for t, (a, b) in zip(terms, EXPONENTS, strict=True):
            product = factorial(i + a) * factorial(j + b) * known[i + a, j + b]
            moments[i, j] += t * product / size ** (a + b) / factorial(i) / factorial(j)
    found = law_polynomials(polygons, moments, np.arange(2))
    assert found[0, :TERMS] == pytest.approx(terms, abs=1e-8)
    for cell in range(2):
        centroid = polygons.centroids[:, cell]
        corners = p[:, 5 * cell : 5 * cell + 5]
        given = value(terms, corners, centroid, size[cell])
        assert value(found[cell, :TERMS], corners, centroid, size[cell]) == pytest.approx(
            given, abs=1e-5 * np.abs(given).max()
        )
    lower = found[0, TERMS:]
    for i, j in EXPONENTS[:LOWER_TERMS]:
        total = sum(
            t * factorial(i + a) * factorial(j + b) * known[i + a, j + b, 0] / size[0] ** (a + b)
            for t, (a, b) in zip(lower, EXPONENTS, strict=False)
        )
        expected = factorial(i) * factorial(j) * moments[i, j, 0]
        assert total == pytest.approx(expected, abs=1e-10 * size[0] ** (i + j + 2))
