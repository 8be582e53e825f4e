"""Influence functions from their symbols: Hankel transforms, kept in tables over r.

The symbol of c / r is split off. Of the rest, what decays like powers of the wave number is fitted
by functions with closed transforms; what is left is integrated between the zeros of waves.

Sources: I. S. Gradshteyn and I. M. Ryzhik, Table of Integrals, Series, and Products, 6.565.4, for
the closed transforms; C. W. Clenshaw, A note on the summation of Chebyshev series, Math. Tables
Aids Comput. 9 (1955).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.special import erfc, gamma, j0, kv

from ..kernels.compiled import compiled, inlined

#: Chebyshev nodes of the symbol in an octave of k, and degree of tables in a panel of ln r
NODES, DEGREE = 20, 7
#: tables reach from the first to the last of these times the least and the greatest length
NEAREST, FARTHEST = 1e-8, 1e6
#: wave numbers up to this over r count; beyond, the smooth symbol is cut off smoothly
CUTOFF = 150.0
#: panels of a table in an octave of r
PANELS = 3
#: a table over r^2 has 2 to the power of BITS panels in an octave, each of degree SQUARES; the
#: bits of a double below its panel are SHIFT, those of an exponent of 1 are ONE
BITS, SQUARES = 6, 4
SHIFT, ONE = 52 - BITS, 1023 << 52
#: the same of tables whose derivatives are taken: they are smooth over more of r
COARSE, COARSE_DEGREE = 2, 7
COARSE_SHIFT, EXPONENT = 52 - COARSE, 2047 << 52
#: rule on [-1, 1]
GAUSS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False)
class RadialTable:
    """What the influence function has beyond c/r: omega_rem(r), and the integral of it times r.

    Piecewise polynomials in ln r; ``omega`` and ``primitive_over_r`` have the coefficients of
    the powers of t in [-1, 1], shape (panels, DEGREE + 1).

    Attributes
    ----------
    start : float
        Logarithm of the smallest distance.
    width : float
        Width of a panel of ln r.
    omega, primitive_over_r : (panels, DEGREE + 1) array of float
        Coefficients.
    error : float
        Estimated error of omega times r, relative to c.
    """

    start: float
    width: float
    omega: ndarray
    primitive_over_r: ndarray
    error: float

    @classmethod
    def from_symbol(
        cls, symbol: Callable[[ndarray], ndarray], lengths: tuple[float, float], algebraic: bool
    ) -> Self:
        """As `from_values`, of F as a function of wave numbers."""
        return cls.from_values(symbol(wave_numbers(lengths)), lengths, algebraic)

    @classmethod
    def from_values(
        cls, f: ndarray, lengths: tuple[float, float], algebraic: bool, first: int = 0
    ) -> Self:
        """Invert ``F(k) = k E0 Omega - c0`` to omega_rem E0 and its primitive.

        Parameters
        ----------
        f : (n,) array of float
            F at `wave_numbers`.
        lengths : pair of float
            The least and the greatest length of the ground.
        algebraic : bool
            Whether F decays like powers of 1/k, as above a gradient, and not exponentially.
        first : int
            The first of these powers is 1 more: 0, or -1 for what does not decay.
        """
        least, greatest = lengths
        edges, x, k = _octaves_of(lengths)
        f = f.reshape(k.shape)
        tail = Tail.from_values(k, f, least, 6 if algebraic else 0, first)
        waves = Waves.from_values(edges, x, f - tail.symbol(k))

        width = np.log(2) / PANELS
        start = np.log(NEAREST * least)
        panels = int(np.ceil((np.log(FARTHEST * greatest) - start) / width))
        nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
        r = np.exp(start + width * (np.arange(panels)[:, None] + (nodes + 1) / 2))
        omega = np.concatenate([waves.transform(panel) for panel in r])
        omega = (tail.add_transform(omega, r.ravel()) / (2 * np.pi)).reshape(r.shape)
        powers = np.linalg.solve(np.vander(nodes, increasing=True), omega.T).T
        primitive = _primitive(omega, powers, start, width, nodes)
        over_r = np.linalg.solve(np.vander(nodes, increasing=True), (primitive / r).T).T
        # the last coefficients tell what a higher degree would add
        error = float(np.max(np.abs(powers[:, -1]) / 2**DEGREE * r[:, 0]))
        return cls(float(start), float(width), powers, over_r, error)

    @property
    def nearest(self) -> float:
        """Smallest distance of the table; below, the primitive is what it is there."""
        return float(np.exp(self.start))

    @property
    def farthest(self) -> float:
        """Largest distance of the table."""
        return float(np.exp(self.start + self.width * len(self.omega)))

    @cached_property
    def squares(self) -> tuple["SquareTable", "SquareTable"]:
        """omega and primitive_over_r as functions of r^2."""
        omega, over_r = self.omega, self.primitive_over_r
        return self._over_squares(omega), self._over_squares(over_r)

    @cached_property
    def fall(self) -> "SquareTable":
        """``-1 / r`` times the derivative of omega, as a function of r^2."""
        slope = np.zeros_like(self.omega)
        slope[:, :-1] = self.omega[:, 1:] * np.arange(1, DEGREE + 1) * 2 / self.width

        def function(r: ndarray) -> ndarray:
            return -self.evaluate(slope, r) / r**2

        return SquareTable.from_function(function, self.nearest, self.farthest)

    @cached_property
    def coarse(self) -> "SquareTable":
        """omega as a function of r^2, in few panels, for `coarse_place`."""
        return SquareTable.from_function(
            lambda r: self.evaluate(self.omega, r),
            *(self.nearest, self.farthest),
            *(COARSE, COARSE_DEGREE),
        )

    def _over_squares(self, coefficients: ndarray) -> "SquareTable":
        distances = self.nearest, self.farthest
        return SquareTable.from_function(lambda r: self.evaluate(coefficients, r), *distances)

    def evaluate(self, coefficients: ndarray, r: ArrayLike) -> ndarray:
        """A table at distances ``r``.

        Raises
        ------
        ValueError
            If a distance lies beyond the table.
        """
        r = np.asarray(r, dtype=float)
        if np.any(far := ~(r <= self.farthest * (1 + 1e-12))):
            raise ValueError(
                f"expected distances up to {self.farthest:.6g}, the range of the substrate's "
                f"table, got {r[far].max():.6g}. Remedy: the plan is too large for the "
                "thinnest length of this ground; take the deep ground alone"
            )
        s = (np.log(np.maximum(r, self.nearest)) - self.start) / self.width
        panel = np.clip(s.astype(int), 0, len(coefficients) - 1)
        t = 2 * (s - panel) - 1
        out = np.zeros_like(t)
        for power in range(DEGREE, -1, -1):
            out = out * t + coefficients[panel, power]
        return out


@compiled
def table_value(coefficients, start, width, r):
    """A table at one distance; constant below its range, where it is negligible."""
    s = max((np.log(r) - start) / width, 0.0) if r > 0.0 else 0.0
    panel = min(int(s), coefficients.shape[0] - 1)
    t = 2 * (s - panel) - 1
    out = 0.0
    for power in range(coefficients.shape[1] - 1, -1, -1):
        out = out * t + coefficients[panel, power]
    return out


class SquareTable(NamedTuple):
    """A function of r by polynomials in r^2, found without a root or a logarithm.

    Their panels are those numbers that share sign, exponent and first bits of the mantissa.

    Attributes
    ----------
    coefficients : (panels, degree + 1) array of float
        Those of the powers of t in [-1, 1].
    first : int
        Leading bits of the first panel.
    """

    coefficients: ndarray
    first: int

    @classmethod
    def from_function(
        cls,
        function: Callable[[ndarray], ndarray],
        nearest: float,
        farthest: float,
        bits: int = BITS,
        degree: int = SQUARES,
    ) -> Self:
        """Through values between two distances, in the Chebyshev nodes of each panel."""
        first, last = (np.array([nearest, farthest]) ** 2).view(np.int64) >> (52 - bits)
        panels = last - first + (4 << bits)  # a bit more: points around cells may lie farther
        edges = (np.arange(first, first + panels + 1) << (52 - bits)).view(np.float64)
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        u = edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2
        values = function(np.sqrt(u).clip(nearest, farthest))
        powers = np.linalg.solve(np.vander(nodes, increasing=True), values.T).T
        return cls(np.ascontiguousarray(powers), int(first))


@inlined
def square_value(coefficients, first, u):
    """A `SquareTable` at the square ``u`` of a distance in its range."""
    bits = np.float64(u).view(np.int64)
    panel = np.uint64((bits >> SHIFT) - first)  # unsigned: no index counts from the end
    mantissa = np.int64((bits & ((1 << SHIFT) - 1)) | ONE).view(np.float64)
    t = (mantissa - 1.0) * (2 << BITS) - 1.0
    out = coefficients[panel, SQUARES]
    for power in range(SQUARES - 1, -1, -1):
        out = out * t + coefficients[panel, power]
    return out


@inlined
def coarse_place(first, u):
    """Panel of a `RadialTable.coarse` at the square ``u`` of a distance, t there, and dt / du."""
    bits = np.float64(u).view(np.int64)
    panel = np.uint64((bits >> COARSE_SHIFT) - first)
    mantissa = np.int64((bits & ((1 << COARSE_SHIFT) - 1)) | ONE).view(np.float64)
    octave = np.int64(bits & EXPONENT).view(np.float64)
    return panel, (mantissa - 1.0) * (2 << COARSE) - 1.0, (2 << COARSE) / octave


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
        great = k > 10 / least
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


def _octaves_of(lengths: tuple[float, float]) -> tuple[ndarray, ndarray, ndarray]:
    least, greatest = lengths
    return octaves(1e-3 / (FARTHEST * greatest), 100 / least)


def wave_numbers(lengths: tuple[float, float]) -> ndarray:
    """Where the symbol of a ground with these lengths must be known, shape (n,)."""
    return _octaves_of(lengths)[2].ravel()


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


def _primitive(
    omega: ndarray, powers: ndarray, start: float, width: float, nodes: ndarray
) -> ndarray:
    """Integrals of omega r from 0 to the nodes of each panel, shape (panels, nodes)."""
    ends = np.append(nodes, 1.0)
    s = -1 + (ends[:, None] + 1) * (GAUSS + 1) / 2
    left = start + width * np.arange(len(powers))
    r = np.exp(left[:, None, None] + width * (s + 1) / 2)
    values = np.polynomial.polynomial.polyval(s, powers.T)
    parts = (values * r * r) @ GAUSS_WEIGHTS * (width / 2 * (ends + 1) / 2)
    # below the first panel it is half of omega r^2, up to a logarithm
    first = omega[0, -1] * np.exp(2 * start) / 2
    before = first + np.cumsum(np.append(0.0, parts[:-1, -1]))
    return before[:, None] + parts[:, :-1]
