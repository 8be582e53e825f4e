"""Expansions of radial kernels in Chebyshev polynomials of two coordinates of a box.

A box of half-width h has the coordinates ``(x - middle) / h``. Its multipole expansion are the
integrals of the polynomials ``T_a(x) T_b(y)`` of a total degree below the order times the load,
its local expansion is a sum of them. Cells stick out of their box: the coordinates of loads refer
to boxes ``PADDING`` times wider. The kernel is interpolated in the Chebyshev points of both boxes
(Fong and Darve, J. Comput. Phys. 228 (2009) 8712; they keep all products of polynomials).

All matrices are to be multiplied by expansions from the left: rows for what is given, columns for
what comes out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy import ndarray
from numpy.polynomial import chebyshev

from ...kernels.once import computed_once
from .quadtree import OFFSETS

#: half-width to which coordinates of loads refer, over that of the box
PADDING = 1.1
#: points of interpolation in one direction beyond the order
MORE = 3

Kernel = Callable[[ndarray], ndarray]


@dataclass(frozen=True)
class Chebyshev:
    """The terms of a total degree below ``order``, ascending: first those of lower orders."""

    order: int

    @computed_once
    def degrees(self) -> ndarray:
        """Degrees in x and in y, shape (2, terms)."""
        return np.array([(a, d - a) for d in range(self.order) for a in range(d + 1)]).T

    @computed_once
    def parities(self) -> ndarray:
        """Whether each term is odd in x, 1, in y, 2, or in both, 3."""
        return self.degrees[0] % 2 + 2 * (self.degrees[1] % 2)

    @property
    def terms(self) -> int:
        """Number of terms."""
        return self.order * (self.order + 1) // 2

    @computed_once
    def grid(self) -> ndarray:
        """Points of interpolation, shape (2, points)."""
        s = chebyshev.chebpts1(self.order + MORE)
        return np.stack(np.meshgrid(s, s, indexing="ij")).reshape(2, -1)

    @computed_once
    def coefficients(self) -> ndarray:
        """Takes values in the points of interpolation to terms, shape (points, terms)."""
        points = self.order + MORE
        values = chebyshev.chebvander(chebyshev.chebpts1(points), self.order - 1)
        values *= np.where(np.arange(self.order) == 0, 1.0, 2.0) / points
        a, b = self.degrees
        return (values[:, None, a] * values[None, :, b]).reshape(points**2, -1)

    def m2m(self, quarter: int) -> ndarray:
        """From the multipole expansion of a box in a quarter of another to that one's.

        Shape (terms, terms).
        """
        return self._shift(quarter, PADDING).T

    def l2l(self, quarter: int) -> ndarray:
        """From the local expansion of a box to that in a quarter of it, shape (terms, terms)."""
        return self._shift(quarter, 1.0)

    def _shift(self, quarter: int, padding: float) -> ndarray:
        """Terms of the larger box, in rows, as sums of those of its quarter."""
        s = chebyshev.chebpts1(self.order)
        back = np.linalg.inv(chebyshev.chebvander(s, self.order - 1))

        def along(side: int) -> ndarray:
            """T_a(side / (2 padding) + s / 2) as sums of T_b(s), shape (a, b)."""
            moved = side / (2 * padding) + s / 2
            return (back @ chebyshev.chebvander(moved, self.order - 1)).T

        a, b = self.degrees
        x, y = along(2 * (quarter % 2) - 1), along(2 * (quarter // 2) - 1)
        return x[a[:, None], a] * y[b[:, None], b]

    def m2l(self, kernel: Kernel, half: float) -> ndarray:
        """From multipole to local expansions of boxes of one size, at each of `OFFSETS`.

        Parameters
        ----------
        kernel : callable
            The influence at distances.
        half : float
            Half-width of the boxes.

        Returns
        -------
        (len(OFFSETS), terms, terms) array of float
            Offsets lead from the box of the local expansion to that of the load.
        """
        out = np.empty((len(OFFSETS), self.terms, self.terms))
        a, b = self.degrees
        swapped = np.lexsort((b, a + b))  # the term (b, a) of each (a, b)
        odd = np.array([1 - 2 * (d % 2) for d in (a, b)])
        for along, across in {(max(o), min(o)) for o in np.abs(OFFSETS).tolist()}:
            sources = self.grid * PADDING + [[2 * along], [2 * across]]
            r = half * np.hypot(*(self.grid[:, None] - sources[:, :, None]))
            # einsum: matrices are too small for threads of BLAS, which may have to wait for each
            # other longer than the products take
            half_way = np.einsum("pi,pq->iq", self.coefficients, kernel(r))
            matrix = np.einsum("iq,qj->ij", half_way, self.coefficients)
            for k, (x, y) in enumerate(np.abs(OFFSETS)):
                if (max(x, y), min(x, y)) == (along, across):
                    signs = odd[0] ** (OFFSETS[k, 0] < 0) * odd[1] ** (OFFSETS[k, 1] < 0)
                    turned = matrix if x >= y else matrix[np.ix_(swapped, swapped)]
                    out[k] = signs[:, None] * turned * signs
        return out

    def m2p(self, kernel: Kernel, half: ndarray, offset: ndarray) -> ndarray:
        """From multipole expansions of boxes to settlements of points, a row for each pair.

        Parameters
        ----------
        kernel : callable
        half : (m,) array of float
            Half-width of the box of each point.
        offset : (2, m) array of float
            Each point from the middle of its box, over its half-width.

        Returns
        -------
        (m, terms) array of float
        """
        dx, dy = offset[:, :, None] - PADDING * self.grid[:, None]
        values = kernel(half[:, None] * np.hypot(dx, dy))
        return np.einsum("pq,qj->pj", values, self.coefficients)


class Compressed(NamedTuple):
    """Matrices as ``left @ core @ right`` with orthonormal outer factors, common to all.

    Attributes
    ----------
    left, core, right : (m, r), (k, r, s), (s, m) array of float
    of_left, of_right : (r,), (s,) array of int
        The parities of what is kept.
    """

    left: ndarray
    core: ndarray
    right: ndarray
    of_left: ndarray
    of_right: ndarray


def compressed(matrices: ndarray, parities: ndarray, tolerance: float) -> Compressed:
    """Matrices by singular value decompositions of all rows and of all columns together.

    As Fong and Darve have them; singular values below ``tolerance`` times the largest are left
    out. What is kept has a parity each, and the largest come last.

    Parameters
    ----------
    matrices : (k, m, m) array of float
        With the mirror images of each, so that in sum they mix no parities.
    parities : (m,) array of int
        Those of the terms.
    tolerance : float
    """
    found: list[ndarray] = []
    for gram in (
        np.einsum("kij,klj->il", matrices, matrices),
        np.einsum("kji,kjl->il", matrices, matrices),
    ):
        squares, vectors = np.zeros(len(parities)), np.zeros_like(gram)
        for parity in np.unique(parities):
            own = np.nonzero(parities == parity)[0]
            squares[own], vectors[own[:, None], own] = np.linalg.eigh(gram[np.ix_(own, own)])
        kept = np.argsort(squares)[np.count_nonzero(squares <= tolerance**2 * squares.max()) :]
        found += [vectors[:, kept], parities[kept]]
    left, of_left, right, of_right = found
    core = np.einsum("krj,js->krs", np.einsum("ir,kij->krj", left, matrices), right)
    return Compressed(left, core, np.ascontiguousarray(right.T), of_left, of_right)
