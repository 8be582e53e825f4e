"""Symbols of influence functions, the Fourier transforms of these over wave numbers, and back.

The symbol of c / r is split off. Of the rest, what decays like powers of the wave number is fitted
by functions with closed transforms; what is left is integrated between the zeros of waves.

Sources: I. S. Gradshteyn and I. M. Ryzhik, Table of Integrals, Series, and Products, 6.565.4, for
the closed transforms; C. W. Clenshaw, A note on the summation of Chebyshev series, Math. Tables
Aids Comput. 9 (1955).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.special import erfc, gamma, j0, kv

#: Chebyshev nodes of the symbol in an octave of k, and powers of 1/k in its tail
NODES, TERMS = 20, 6
#: distances reach from the first to the last of these times the least and the greatest length
NEAREST, FARTHEST = 1e-8, 1e6
#: wave numbers up to this over r count; beyond, the smooth symbol is cut off smoothly
CUTOFF = 150.0
#: octaves of wave numbers end at so many over the least length; beyond, powers of 1/k are left,
#: fitted from a tenth of them on
GREATEST = 200.0
#: rule on [-1, 1]
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False)
class Tail:
    """Sum of ``weights[i] k (k^2 + b^2)^(-1 - m/2)``, m = ``first`` + i: the part of a symbol like
    powers of 1/k.

    Attributes
    ----------
    b : float
    weights : (n,) array of float
        None for a symbol that decays faster.
    first : int
    """

    b: float
    weights: ndarray
    first: int = 0

    @classmethod
    def from_values(cls, k: ndarray, f: ndarray, least: float, terms: int, first: int = 0) -> Self:
        """Least squares for the values of a symbol at great wave numbers."""
        plain = cls(3 / least, np.ones(terms), first)
        if not terms:
            return plain
        great = k > GREATEST / 10 / least
        scale = k[great]
        matrix = np.stack([t[great] * scale for t in plain.terms(k)], axis=1)
        norm = np.abs(matrix).max(axis=0)
        weights = np.linalg.lstsq(matrix / norm, f[great] * scale, rcond=None)[0] / norm
        return cls(plain.b, weights, first)

    def terms(self, k: ndarray) -> list[ndarray]:
        """Each term with the weight 1."""
        return [k * (k**2 + self.b**2) ** (-1 - m / 2) for m in self._orders]

    @property
    def _orders(self) -> range:
        return range(self.first, self.first + len(self.weights))

    def symbol(self, k: ndarray) -> ndarray:
        """The sum at wave numbers."""
        terms = zip(self.weights, self.terms(k), strict=True)
        return sum((w * t for w, t in terms), np.zeros_like(k))

    def add_transform(self, omega: ndarray, r: ndarray) -> ndarray:
        """``omega`` and the integrals of the sum times J0(k r)."""
        b = self.b
        for m, w in zip(self._orders, self.weights, strict=True):
            omega = omega + w * (r / (2 * b)) ** (m / 2) * kv(m / 2, b * r) / gamma(1 + m / 2)
        return omega


@dataclass(frozen=True, eq=False)
class Waves:
    """A symbol that is negligible for great wave numbers, by Chebyshev series in octaves.

    Attributes
    ----------
    edges : (octaves + 1,) array of float
        Wave numbers.
    coefficients : (octaves, NODES) array of float
    last : float
        From here on the symbol is negligible.
    """

    edges: ndarray
    coefficients: ndarray
    last: float

    @classmethod
    def from_values(cls, edges: ndarray, x: ndarray, f: ndarray) -> Self:
        """Through the values ``f`` at the nodes ``x`` in [-1, 1] of each octave."""
        matrix = np.polynomial.chebyshev.chebvander(x, NODES - 1)
        coefficients = np.linalg.solve(matrix, f.T).T
        size = np.abs(f).max()
        here = np.nonzero(np.abs(f).max(axis=1) > 1e-14 * max(size, 1e-300))[0]
        return cls(edges, coefficients, edges[here[-1] + 1] if len(here) else edges[1])

    def symbol(self, k: ndarray) -> ndarray:
        """It at wave numbers from the first octave on; zero behind the last."""
        octave = np.searchsorted(self.edges, k, side="right") - 1
        octave = np.minimum(octave, len(self.coefficients) - 1)
        begin, end = self.edges[octave], self.edges[octave + 1]
        t = (2 * k - begin - end) / (end - begin)
        values = _clenshaw(self.coefficients[octave.ravel()], t.reshape(-1, 1)).reshape(k.shape)
        return np.where(k <= self.edges[-1], values, 0.0)

    def transform(self, r: ndarray) -> ndarray:
        """Integrals of the symbol times J0(k r), for distances of one panel."""
        # far waves cancel each other: a smooth cut leaves an error below any power of 1 / CUTOFF
        cut = CUTOFF / r[:, None]
        q, values = self.points(float(r.max()), min(self.last, 2 * float(cut.max())))
        waves = j0(q * r[:, None]) * erfc(6 * (q / cut - 1.5)) / 2
        return waves @ values

    def points(self, length: float, last: float) -> tuple[ndarray, ndarray]:
        """Wave numbers up to the octave of ``last``, and the symbol there times their weights.

        They integrate the symbol times waves of ``k length``. Below the first octave the symbol
        is what it is there.
        """
        ends = self.edges[: np.searchsorted(self.edges, last) + 1]
        pieces = np.ceil(np.diff(ends) * length / np.pi).astype(int)
        octave = np.repeat(np.arange(len(pieces)), pieces)
        step = (np.diff(ends) / pieces)[octave]
        position = np.arange(len(octave)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        begin = ends[octave] + position * step
        k = begin[:, None] + step[:, None] * (GAUSS + 1) / 2
        t = 2 * (k - ends[octave][:, None]) / np.diff(ends)[octave][:, None] - 1
        values = _clenshaw(self.coefficients[octave], t) * GAUSS_WEIGHTS * step[:, None] / 2
        below = ends[0] * self.coefficients[0] @ (-1.0) ** np.arange(NODES)
        return np.append(0.0, k), np.append(below, values)


@dataclass(frozen=True, eq=False)
class Symbol:
    """``F(k) = k E0 Omega - c0``: what decays like powers of 1/k, and the rest."""

    tail: Tail
    waves: Waves

    @classmethod
    def from_values(
        cls, f: ndarray, lengths: tuple[float, float], algebraic: bool, first: int = 0
    ) -> Self:
        """Through the values ``f`` at `wave_numbers`, shape (n,).

        Parameters
        ----------
        f : (n,) array of float
        lengths : pair of float
            The least and the greatest length of the ground.
        algebraic : bool
            Whether F decays like powers of 1/k, as above a gradient, and not exponentially.
        first : int
            The first of these powers is 1 more: 0, or -1 for what does not decay.
        """
        edges, x, k = _octaves_of(lengths)
        f = f.reshape(k.shape)
        tail = Tail.from_values(k, f, lengths[0], TERMS if algebraic else 0, first)
        return cls(tail, Waves.from_values(edges, x, f - tail.symbol(k)))

    def __call__(self, k: ndarray) -> ndarray:
        """F at wave numbers from the least of `wave_numbers` on."""
        return self.tail.symbol(k) + self.waves.symbol(k)


def _octaves_of(lengths: tuple[float, float]) -> tuple[ndarray, ndarray, ndarray]:
    least, greatest = lengths
    return octaves(1e-3 / (FARTHEST * greatest), GREATEST / least)


def wave_numbers(lengths: tuple[float, float]) -> ndarray:
    """Where the symbol of a ground with these lengths must be known, shape (n,)."""
    return _octaves_of(lengths)[2].ravel()


def greater(least: float) -> ndarray:
    """Some wave numbers beyond all octaves, ascending: where the symbol is not its tail, moduli
    vary over less than the least length."""
    return GREATEST / least * np.logspace(0.3, 6, 12)


def off_tail(rest: Callable[[ndarray], ndarray], least: float) -> float:
    """How far a symbol F is from its tail at `greater` wave numbers, if it has no octaves yet."""
    k, beyond = octaves(GREATEST / 10 / least, GREATEST / least)[2].ravel(), greater(least)
    f = rest(np.append(k, beyond))
    tail = Tail.from_values(k, f[: len(k)], least, TERMS)
    return float(np.abs(f[len(k) :] - tail.symbol(beyond)).max())


def octaves(low: float, high: float) -> tuple[ndarray, ndarray, ndarray]:
    """Ends of octaves of wave numbers, Chebyshev nodes, and wave numbers there in each octave."""
    edges = low * 2.0 ** np.arange(int(np.ceil(np.log2(high / low))) + 1)
    x = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    return edges, x, (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * x


def _clenshaw(coefficients: ndarray, t: ndarray) -> ndarray:
    """Chebyshev series, one for each row of ``t``."""
    b1 = b2 = np.zeros_like(t)
    for c in coefficients.T[:0:-1]:
        b1, b2 = c[:, None] + 2 * t * b1 - b2, b1
    return coefficients[:, :1] + t * b1 - b2
