"""The pressure under a rigid disc, by the dual integral equations of the ground.

With the symbol ``k E0 Omega = c0 + F(k)`` and ``p^(k)``, the Hankel transform of the pressure, as
the integral of ``chi(t) cos(k t)`` over 0 < t < a, a disc of radius a settles by W evenly if

    c0 pi/2 chi(x) + int_0^a chi(t) int_0^oo F(k) cos(k x) cos(k t) dk dt = W E0.

Legendre polynomials of even degree 2n for chi turn the inner integrals into spherical Bessel
functions; under the disc they are ``P_2n(eta) / (|P_2n(0)| sqrt(a^2 - r^2))`` with
``eta^2 = 1 - r^2 / a^2``, so that nothing is inverted numerically.

Sources: I. N. Sneddon, Mixed Boundary Value Problems in Potential Theory (1966), chapter 4, for
the dual equations; N. N. Lebedev and Ia. S. Ufliand, Axisymmetric contact problem for an elastic
layer, PMM 22 (1958); M. Abramowitz and I. A. Stegun, Handbook of Mathematical Functions, 10.1.14,
for the transforms of Legendre polynomials.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy import ndarray
from scipy.special import eval_legendre, spherical_jn

from ..grids.polygons import readonly
from .stratified import Stratified
from .substrates import Substrate
from .symbols import Waves, octaves

#: wave numbers times the radius: the least, the last where F decays like 1 / k, and the last
#: times the least length of the ground where it decays exponentially
FIRST, LAST, DECAYED = 5e-5, 1600.0, 20.0
#: polynomials, and more of them per root of the ratio of the radius to the least length
POLYNOMIALS, MORE = 26, 3.0
#: discs are not larger than so many least lengths of the ground; the smallest have the plain law
SMALLEST_DISC, LARGEST_DISC = 1e-6, 1000.0
#: values of a law
VALUES = 1001
#: the factor of a law, 1 at the edge, levels off here on its way to zero and below, rounded by
#: so much, where cells at the edge are no wider than the way to its least value: pressures that
#: vary linearly over the factor follow the ground then. In cells from so many times as wide on it
#: is all they have, and levels off at zero but for the rounding
LEVEL, ROUNDED = 0.15, 0.1
FINE, COARSE = 1.25, 1.75
#: a crust bends away inside if the factor falls below the first, or below the second and rises by
#: as much again
PULLS, REBOUNDS = -0.05, 0.1
#: the first of the least values below it is where the way ends
LOW = 0.3


@dataclass(frozen=True, eq=False)
class RigidDisc:
    """A smooth rigid disc under a central force.

    Attributes
    ----------
    radius : float
    settlement : float
        Under a unit force.
    coefficients : (n,) array of float
        Those of the Legendre polynomials of even degree in the regular part of the pressure,
        ``p sqrt(a^2 - r^2)`` under a unit force, as a function of eta.
    """

    radius: float
    settlement: float
    coefficients: ndarray

    @classmethod
    @np.errstate(under="ignore")
    def on(cls, ground: Stratified, radius: float) -> "RigidDisc":
        """On a ground whose moduli depend on depth."""
        surface, ratio = ground.surface, radius / ground.lengths[0]
        c0 = 2 * (1 - surface.poisson**2)
        last = DECAYED * max(ratio, 1.0)
        if ground.algebraic:
            last = max(last, LAST)
        edges, x, k = octaves(FIRST / radius, last / radius)
        waves = Waves.from_values(edges, x, ground.rest_of_symbol(k))
        k, f = waves.points(radius, edges[-1])
        degree = 2 * np.arange(POLYNOMIALS + int(MORE * np.sqrt(ratio)))
        j = _spherical_bessel(degree, k * radius)
        matrix = (j * (f * radius)) @ j.T
        # beyond, the product of two of them is 1/2 (k a)^-2 in the mean, up to the sign
        sign = (-1.0) ** (degree // 2)
        end, at_end = edges[-1] * radius, waves.coefficients[-1].sum()
        matrix += np.outer(sign, sign) * at_end / (4 * end)
        matrix += np.diag(c0 * np.pi / 2 / (2 * degree + 1))
        b = np.linalg.solve(matrix, np.eye(len(degree))[0]) * surface.young
        force = 2 * np.pi * radius * b[0]
        return cls(radius, float(1 / force), b / np.abs(eval_legendre(degree, 0.0)) / force)

    def regular(self, d: ndarray) -> ndarray:
        """``p sqrt(a^2 - r^2)`` under a unit force at distances from the edge."""
        eta = np.sqrt(d / self.radius * (2 - d / self.radius))
        degree = 2 * np.arange(len(self.coefficients))
        return self.coefficients @ eval_legendre(degree[:, None], eta)


def _spherical_bessel(degree: ndarray, x: ndarray) -> ndarray:
    """Spherical Bessel functions of even degrees 0, 2, ... at increasing points, a row each."""
    j = np.empty((len(degree), len(x)))
    begin = np.searchsorted(x, degree[-1])  # beyond the degree they follow from the lower ones
    j[:, :begin] = spherical_jn(degree[:, None], x[:begin])
    x = x[begin:]
    below, own = np.cos(x) / x, np.sin(x) / x
    for n in range(degree[-1] + 1):
        if n % 2 == 0:
            j[n // 2, begin:] = own
        below, own = own, (2 * n + 1) / x * own - below
    return j


@dataclass(frozen=True, eq=False)
class EdgeLaw:
    """Pressure under a rigid disc over that on homogeneous ground, as a function of the distance.

    Attributes
    ----------
    reach : float
        Distance from which on the factor does not vary any more.
    factors : (n,) array of float
        The factor where the root of the distance is 0, ..., n - 1 times ``sqrt(reach) / (n - 1)``;
        1 at the edge, positive everywhere.
    pulls : bool
        Whether the ground would have to pull inside, or nearly so, as a crust does that bends
        away.
    """

    reach: float
    factors: ndarray
    pulls: bool = False

    @classmethod
    def of(cls, disc: RigidDisc, width: float = 0.0) -> "EdgeLaw":
        """Where a soft ground lies below a stiff crust, the pressure may fall to zero and below
        inside, where no weight can follow: the factor levels off, above zero where cells at the
        edge, of such a ``width``, can follow it."""
        d = disc.radius * np.linspace(0, 1, VALUES) ** 2
        regular = disc.regular(d)
        factor = regular / regular[0]
        least = factor.min()
        dips = (factor[1:-1] < factor[:-2]) & (factor[1:-1] <= factor[2:]) & (factor[1:-1] < LOW)
        bottom = d[1 + np.argmax(dips) if dips.any() else np.argmin(factor)]
        level = np.interp(width, [FINE * bottom, COARSE * bottom], [LEVEL, 0.0])
        above = (factor + level + np.hypot(factor - level, ROUNDED)) / 2
        rebounds = least < REBOUNDS and factor[-1] - least > REBOUNDS
        return cls(disc.radius, readonly(above / above[0]), bool(rebounds or least < PULLS))

    @property
    def steepness(self) -> float:
        """Greatest power of the distance like which ``d^(-1/2)`` times the factor varies."""
        slope = np.diff(np.log(self.factors)) / np.diff(
            np.log(np.arange(len(self.factors)).clip(0.5))
        )
        return float(np.abs(slope / 2 - 0.5).max())


def edge_law(substrate: Substrate, size: float, width: float = 0.0) -> EdgeLaw | None:
    """The law of a ground for plans as large as a disc of radius ``size`` and cells of such a
    ``width`` at their edge; None if the ground is homogeneous, or as good as that under plans so
    small."""
    if not isinstance(substrate, Stratified) or size < SMALLEST_DISC * substrate.lengths[0]:
        return None
    return _law(substrate, size, width)


@lru_cache(maxsize=16)
def _law(ground: Stratified, size: float, width: float) -> EdgeLaw:
    return EdgeLaw.of(_disc(ground, min(size, LARGEST_DISC * ground.lengths[0])), width)


@lru_cache(maxsize=16)
def _disc(ground: Stratified, radius: float) -> RigidDisc:
    return RigidDisc.on(ground, radius)
