"""Influence functions from their symbols: Hankel transforms, kept in tables over r."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..kernels.compiled import compiled, inlined
from ..kernels.once import ReadOnly, computed_once, freeze
from .symbols import FARTHEST, GAUSS, GAUSS_WEIGHTS, NEAREST, Symbol

#: degree of tables in a panel of ln r, and panels in an octave of r
DEGREE, PANELS = 7, 3
#: a table over r^2 has 2 to the power of BITS panels in an octave, each of degree SQUARES
BITS, SQUARES = 6, 4
#: the same of tables of which four derivatives are taken: they are smooth over more of r
COARSE, COARSE_DEGREE = 2, 7
#: bits of the exponent of 1, and of all exponents
ONE, EXPONENT = 1023 << 52, 2047 << 52


@dataclass(frozen=True, eq=False)
class RadialTable(ReadOnly):
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

    def __post_init__(self) -> None:
        freeze(vars(self))

    @classmethod
    def from_values(
        cls, f: ndarray, lengths: tuple[float, float], algebraic: bool, first: int = 0
    ) -> Self:
        """As `from_symbol`, of values as of `Symbol.from_values`."""
        return cls.from_symbol(Symbol.from_values(f, lengths, algebraic, first), lengths)

    @classmethod
    def from_symbol(cls, symbol: Symbol, lengths: tuple[float, float]) -> Self:
        """Invert ``F(k) = k E0 Omega - c0`` to omega_rem E0 and its primitive.

        ``lengths`` are the least and the greatest length of the ground.
        """
        least, greatest = lengths
        waves, tail = symbol.waves, symbol.tail
        width = np.log(2) / PANELS
        start = np.log(NEAREST * least)
        panels = int(np.ceil((np.log(FARTHEST * greatest) - start) / width))
        nodes, r = _nodes(start, width, panels)
        omega = np.concatenate([waves.transform(panel) for panel in r])
        omega = (tail.add_transform(omega, r.ravel()) / (2 * np.pi)).reshape(r.shape)
        powers = np.linalg.solve(np.vander(nodes, increasing=True), omega.T).T
        primitive = _primitive(omega, powers, start, width, nodes)
        over_r = np.linalg.solve(np.vander(nodes, increasing=True), (primitive / r).T).T
        # the last coefficients tell what a higher degree would add
        error = float(np.max(np.abs(powers[:, -1]) / 2**DEGREE * r[:, 0]))
        return cls(float(start), float(width), powers, over_r, error)

    def with_pole(self, charge: float) -> Self:
        """The same with ``charge / r`` more."""
        nodes, r = _nodes(self.start, self.width, len(self.omega))
        more = np.linalg.solve(np.vander(nodes, increasing=True), (charge / r).T).T
        over_r = self.primitive_over_r.copy()
        over_r[:, 0] += charge
        return replace(self, omega=self.omega + more, primitive_over_r=over_r)

    @property
    def nearest(self) -> float:
        """Smallest distance of the table; below, the primitive is what it is there."""
        return float(np.exp(self.start))

    @property
    def farthest(self) -> float:
        """Largest distance of the table."""
        return float(np.exp(self.start + self.width * len(self.omega)))

    @computed_once
    def squares(self) -> tuple["SquareTable", "SquareTable"]:
        """omega and primitive_over_r as functions of r^2."""
        omega, over_r = self.omega, self.primitive_over_r
        return self._over_squares(omega), self._over_squares(over_r)

    @computed_once
    def fall(self) -> "SquareTable":
        """``-1 / r`` times the derivative of omega, as a function of r^2."""
        slope = np.zeros_like(self.omega)
        slope[:, :-1] = self.omega[:, 1:] * np.arange(1, DEGREE + 1) * 2 / self.width

        def function(r: ndarray) -> ndarray:
            return -self.evaluate(slope, r) / r**2

        return SquareTable.from_function(function, self.nearest, self.farthest)

    @computed_once
    def coarse(self) -> "SquareTable":
        """omega as a function of r^2, in few panels."""
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
                f"table, got {r[far].max():.6g}: the plan is too large for the shortest "
                "length over which this ground varies. Remedy: ground without what the plan "
                "does not feel, a thin layer or the strong increase from a soft surface"
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
def panel_at(first, u, bits):
    """Panel of a `SquareTable` at the square ``u`` of a distance, t there, and dt / du."""
    all_bits = np.float64(u).view(np.int64)
    panel = np.uint64((all_bits >> (52 - bits)) - first)  # unsigned: none counts from the end
    mantissa = np.int64((all_bits & ((1 << (52 - bits)) - 1)) | ONE).view(np.float64)
    octave = np.int64(all_bits & EXPONENT).view(np.float64)
    return panel, (mantissa - 1.0) * (2 << bits) - 1.0, (2 << bits) / octave


@inlined
def square_value(coefficients, first, u):
    """A `SquareTable` of `BITS` at the square ``u`` of a distance in its range."""
    panel, t, _ = panel_at(first, u, BITS)
    out = coefficients[panel, SQUARES]
    for power in range(SQUARES - 1, -1, -1):
        out = out * t + coefficients[panel, power]
    return out


def _nodes(start: float, width: float, panels: int) -> tuple[ndarray, ndarray]:
    """Chebyshev nodes in [-1, 1], and the distances there in each panel."""
    nodes = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
    return nodes, np.exp(start + width * (np.arange(panels)[:, None] + (nodes + 1) / 2))


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
