"""What substrates have in common whose moduli depend on depth."""

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_array
from ..errors import ConvergenceError
from ..kernels.once import computed_once
from .hankel import RadialTable
from .shear import ShearTable
from .strata import Strata
from .substrates import HalfSpace
from .symbols import Symbol, greater, wave_numbers

#: an influence function that is off by more is none
OFF = 1e-4


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
        """The influence function less c / r, times the surface modulus E0, and its primitive.

        Raises
        ------
        ConvergenceError
            If the moduli vary over less than the least length.
        """
        symbol, off = self._symbol
        if not off <= OFF:
            raise ConvergenceError(
                f"expected moduli that vary over {self.lengths[0]:.3g} or more, got some that "
                f"vary over less, by which the influence function is off by {off:.1e}. Remedy: a "
                "shorter length="
            )
        return RadialTable.from_symbol(symbol, self.lengths)

    @property
    def rest_of_symbol(self) -> Symbol:
        """``k E0`` times the symbol of the influence function, less that of c / r."""
        return self._symbol[0]

    @computed_once
    def _symbol(self) -> tuple[Symbol, float]:
        """That, and by how much the influence function is off as greater wave numbers, by moduli
        that vary over less than the least length, have more than its tail."""
        k, beyond = wave_numbers(self.lengths), greater(self.lengths[0])
        values = self._rest(np.append(k, beyond))  # together in the time of one
        symbol = Symbol.from_values(values[: len(k)], self.lengths, self.algebraic)
        off = np.abs(values[len(k) :] - symbol.tail.symbol(beyond)).max()
        return symbol, float(off) / self._of_surface

    def _rest(self, k: ndarray) -> ndarray:
        return self.compliance(k)[2] - self._of_surface

    @property
    def _of_surface(self) -> float:
        """``k E0`` times the symbol of c / r."""
        return 2 * (1 - self.surface.poisson**2)

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
        of_table = self.remainder.error / (self.singular_coefficient * self.surface.young)
        return max(of_table, self._symbol[1])

    @property
    def farthest(self) -> float:
        """Largest distance for which the influence function is known."""
        return self.remainder.farthest

    def influence(self, r: ArrayLike) -> ndarray:
        """Settlement of the surface at distance ``r`` from a unit vertical force.

        Infinite at ``r = 0``. Of the shape of ``r``, whose sign does not count; positive into the
        ground.

        Raises
        ------
        TypeError
            If distances are no numbers.
        ValueError
            If they are not finite, or beyond ``farthest``.
        """
        r = np.abs(checked_array("r", r, None))
        table = self.remainder
        rest = table.evaluate(table.omega, r) / self.surface.young
        return self.surface.influence(r) + rest

    def symbol(self, k: ArrayLike) -> ndarray:
        """Fourier transform of the influence function.

        Of the shape of ``k``, whose sign does not count.

        Raises
        ------
        TypeError, ValueError
            If wave numbers are no numbers, not finite, or zero.
        """
        waves = np.abs(checked_array("k", k, None))
        q = self.compliance(np.atleast_1d(waves).ravel())[2].reshape(waves.shape)
        return q / (waves * self.surface.young)

    def primitive(self, radius: ArrayLike) -> ndarray:
        """Integral of ``influence(r) r`` from 0 to ``radius``.

        Of the shape of ``radius``, whose sign does not count.

        Raises
        ------
        TypeError, ValueError
            If radii are no numbers, not finite, or beyond ``farthest``.
        """
        r = np.abs(checked_array("radius", radius, None))
        table = self.remainder
        rest = r * table.evaluate(table.primitive_over_r, r) / self.surface.young
        return self.surface.primitive(r) + rest
