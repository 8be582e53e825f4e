"""What substrates have in common whose moduli depend on depth."""

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_array
from ..kernels.once import computed_once
from .hankel import RadialTable
from .shear import ShearTable
from .strata import Strata
from .substrates import HalfSpace
from .symbols import Symbol, wave_numbers


def checked_waves(k: ArrayLike) -> ndarray:
    """Wave numbers, positive; errors as `checked_array`."""
    waves = checked_array("k", k, ("n",))
    if not (waves > 0).all():
        i = int(np.argmin(waves > 0))
        raise ValueError(f"expected positive wave numbers k, got {waves[i]:g} at index {i}")
    return waves


class Stratified:
    """A ground that gives its compliance by wave number.

    The influence function is split into ``c / r`` of the surface moduli, closed on polygons, and
    a remainder with a logarithm at ``r = 0``, kept in a table that is built when first needed.
    """

    @property
    def surface(self) -> HalfSpace:
        """The homogeneous half-space with the moduli of the surface."""
        raise NotImplementedError

    @property
    def strata(self) -> Strata:
        """The layers, with moduli over that of the surface."""
        raise NotImplementedError

    def compliance(self, k: ndarray) -> ndarray:
        """``k E0 P`` at the surface: Q11, Q12, Q22 of shape (3, n)."""
        return self.strata.compliance(checked_waves(k))

    @property
    def lengths(self) -> tuple[float, float]:
        """The least and the greatest length over which the moduli vary."""
        raise NotImplementedError

    @property
    def singular_coefficient(self) -> float:
        """c of the part c / r of the influence function, closed on polygons."""
        return self.surface.singular_coefficient

    @property
    def algebraic(self) -> bool:
        """Whether the moduli vary at the surface, so that the symbol decays like powers."""
        return True

    @computed_once
    def remainder(self) -> RadialTable:
        """The influence function less c / r, times the surface modulus E0, and its primitive."""
        return RadialTable.from_symbol(self.rest_of_symbol, self.lengths)

    @computed_once
    def rest_of_symbol(self) -> Symbol:
        """``k E0`` times the symbol of the influence function, less that of c / r."""
        c0 = 2 * (1 - self.surface.poisson**2)
        values = self.compliance(wave_numbers(self.lengths))[2] - c0
        return Symbol.from_values(values, self.lengths, self.algebraic)

    @computed_once
    def shear(self) -> ShearTable:
        """The same of horizontal forces."""
        strata = self.strata
        self.check_holding()

        def compliances(k: ndarray) -> ndarray:
            return np.vstack([strata.compliance(k), strata.compliance_across(k)])

        options = self.surface.poisson, self.lengths, self.algebraic
        return ShearTable.from_compliances(compliances, self.remainder, *options)

    def check_holding(self) -> None:
        """Refuse layers on a smooth rigid base: there, horizontal forces move them anywhere."""
        if self.strata.base == "smooth":
            raise ValueError(
                "expected ground that holds horizontal forces, got layers on a smooth rigid "
                'base, on which they slide away. Remedy: the base "bonded"'
            )

    @property
    def error(self) -> float:
        """Estimated error of the influence function, relative to that of the surface moduli."""
        return self.remainder.error / (self.singular_coefficient * self.surface.young)

    @property
    def farthest(self) -> float:
        """Largest distance for which the influence function is known."""
        return self.remainder.farthest

    def influence(self, r: ArrayLike) -> ndarray:
        """Settlement of the surface at distance ``r`` from a unit vertical force.

        Raises
        ------
        ValueError
            Beyond ``farthest``.
        """
        r = np.abs(checked_array("r", r, None))
        table = self.remainder
        rest = table.evaluate(table.omega, r) / self.surface.young
        return self.surface.influence(r) + rest

    def symbol(self, k: ArrayLike) -> ndarray:
        """Fourier transform of the influence function."""
        waves = np.abs(checked_array("k", k, None))
        q = self.compliance(np.atleast_1d(waves).ravel())[2].reshape(waves.shape)
        return q / (waves * self.surface.young)

    def primitive(self, radius: ArrayLike) -> ndarray:
        """Integral of ``influence(r) r`` from 0 to ``radius``."""
        radius = checked_array("radius", radius, None)
        table = self.remainder
        rest = radius * table.evaluate(table.primitive_over_r, radius) / self.surface.young
        return self.surface.primitive(radius) + rest
