"""Laws of the edge over cells as polynomials, for what they settle nearby.

Where the law varies over a cell by a factor of up to three, the polynomial with the same moments
stands for it: what it settles is known by the sides of the cell alone, see `polygon_sums`.
"""

import numpy as np
from numpy import ndarray

from ..grids.polygons import Polygons
from ..kernels.compiled import compiled, inputs, vectorised
from .polygon_moments import factorials, polygon_moments

#: degree of the polynomial for the settlement, and of that for the first moments of the law
DEGREE, LOWER = 4, 2
#: number of their coefficients, of x^i y^j: those of one degree together, by ascending j
TERMS, LOWER_TERMS = (DEGREE + 1) * (DEGREE + 2) // 2, (LOWER + 1) * (LOWER + 2) // 2
#: a monomial is left out if only so much of its square is not that of those before it: in slivers
NIL = 1e-13


def law_polynomials(polygons: Polygons, moments: ndarray, cells: ndarray) -> ndarray:
    """Polynomials whose moments over some cells are given ones, as far as their degrees go.

    Parameters
    ----------
    polygons : Polygons
        All cells.
    moments : (DEGREE + 1, DEGREE + 1, k) array of float
        Integrals of ``x^i y^j / (i! j!)`` times a law about the centroids of the cells.
    cells : (k,) array of int
        The cells.

    Returns
    -------
    (k, TERMS + LOWER_TERMS) array of float
        Coefficients of both polynomials in the coordinates from the centroid over the root of
        the area.
    """
    out = np.empty((len(cells), TERMS + LOWER_TERMS))
    whole = polygon_moments(polygons, 2 * DEGREE, cells)
    size = np.sqrt(polygons.areas[cells])
    _fit(*inputs(size, whole, moments, factorials(2 * DEGREE)), out)
    return out


@vectorised
def _fit(size, whole, moments, factorials, out):
    gram, value = np.empty((TERMS, TERMS)), np.empty(TERMS)
    own = np.empty((2 * DEGREE + 1, 2 * DEGREE + 1))
    for cell in range(size.shape[0]):
        power = 1 / size[cell] ** 2
        for degree in range(2 * DEGREE + 1):
            for b in range(degree + 1):
                factor = power * factorials[degree - b] * factorials[b]
                own[degree - b, b] = whole[degree - b, b, cell] * factor
                if degree <= DEGREE:
                    value[degree * (degree + 1) // 2 + b] = moments[degree - b, b, cell] * factor
            power /= size[cell]
        _put_products(own, gram)
        _factorise(gram, value)
        _substitute(gram, value, out[cell, :TERMS])
        _substitute(gram, value, out[cell, TERMS:])


@compiled
def _put_products(own, gram):
    """Integrals of products of monomials, from those of monomials."""
    row = 0
    for degree in range(DEGREE + 1):
        for b in range(degree + 1):
            column = 0
            for other in range(degree + 1):
                for d in range(other + 1):
                    gram[row, column] = own[degree - b + other - d, b + d]
                    column += 1
            row += 1


@compiled
def _factorise(matrix, value):
    """Cholesky's factor in place, and the solution with it in ``value``."""
    n, degree, largest = value.shape[0], 0, 0.0
    for i in range(n):
        if i == degree * (degree + 1) // 2:  # the first monomial of a degree
            degree += 1
            largest = 0.0
            for j in range(i, min(i + degree, n)):
                largest = max(largest, matrix[j, j])
        for j in range(i):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total * matrix[j, j]
        rest = matrix[i, i]
        for k in range(i):
            rest -= matrix[i, k] * matrix[i, k]
            value[i] -= matrix[i, k] * value[k]
        # the inverse of the diagonal, zero where the monomial is left out: also one that is small
        # beside others of its degree, as across a thin cell, whose coefficient has no bounds
        matrix[i, i] = 1 / np.sqrt(rest) if rest > NIL * largest else 0.0
        value[i] *= matrix[i, i]


@compiled
def _substitute(factor, value, out):
    """The solution by the transposed factor, of as many rows as ``out`` has."""
    n = out.shape[0]
    for i in range(n):
        out[i] = value[i]
    for i in range(n - 1, -1, -1):
        out[i] *= factor[i, i]
        for k in range(i):
            out[k] -= factor[i, k] * out[i]
