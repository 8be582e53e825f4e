"""Elastic substrates: what the ground is made of.

Source: K. L. Johnson, Contact Mechanics (1985), section 3.2, for the settlement under a force.
"""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Protocol, SupportsFloat

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_array, checked_number, checked_size
from ..messages import apart, shown
from .strata import Strata, Stratum

if TYPE_CHECKING:
    from .hankel import RadialTable


class Substrate(Protocol):
    """What boundary elements ask of the ground.

    Attributes
    ----------
    singular_coefficient : float
        c of the part c / r of the influence function, closed on polygons.
    remainder : RadialTable or None
        The rest of it and its primitive, times the surface modulus.
    surface : HalfSpace
        The homogeneous half-space with the moduli of the surface.
    """

    @property
    def singular_coefficient(self) -> float: ...

    @property
    def remainder(self) -> "RadialTable | None": ...

    @property
    def surface(self) -> "HalfSpace": ...

    def influence(self, r: ArrayLike) -> ndarray:
        """Settlement of the surface at distance ``r`` from a unit vertical force."""
        ...

    def symbol(self, k: ArrayLike) -> ndarray:
        """Fourier transform of the influence function."""
        ...

    def primitive(self, radius: ArrayLike) -> ndarray:
        """Integral of ``influence(r) r`` from 0 to ``radius``."""
        ...


@dataclass(frozen=True)
class HalfSpace:
    """Homogeneous, isotropic elastic half-space (Boussinesq).

    Parameters
    ----------
    young : float
        Young's modulus E, in any consistent unit of pressure.
    poisson : float
        Poisson's ratio, from 0 to 1/2.

    Raises
    ------
    TypeError
        If a modulus is not a number.
    ValueError
        If ``young`` is not positive or ``poisson`` lies outside [0, 1/2].

    Examples
    --------
    >>> soil = HalfSpace(young=30e6, poisson=0.25)
    >>> soil.contact_modulus
    32000000.0
    """

    young: float
    poisson: float

    def __post_init__(self) -> None:
        young, poisson = checked_moduli(self.young, self.poisson)
        object.__setattr__(self, "young", young)
        object.__setattr__(self, "poisson", poisson)

    @property
    def surface(self) -> "HalfSpace":
        """The half-space itself."""
        return self

    @property
    def strata(self) -> Strata:
        """The one stratum it consists of, with the modulus over itself."""
        return Strata((Stratum(np.inf, partial(_constant, self.poisson), True),), None)

    @property
    def contact_modulus(self) -> float:
        """E* = E / (1 - nu^2)."""
        return self.young / (1 - self.poisson**2)

    @property
    def singular_coefficient(self) -> float:
        """c of the part c / r of the influence function, closed on polygons."""
        return 1 / (np.pi * self.contact_modulus)

    @property
    def remainder(self) -> None:
        """What the influence function has beyond c / r: nothing."""
        return None

    def influence(self, r: ArrayLike) -> ndarray:
        """Settlement of the surface at distance ``r`` from a unit vertical force.

        ``(1 - nu^2) / (pi E r)``; infinite at ``r = 0``. Of the shape of ``r``, whose sign does
        not count; positive into the ground.

        Raises
        ------
        TypeError, ValueError
            If distances are no numbers, or not finite.
        """
        with np.errstate(divide="ignore"):
            return self.singular_coefficient / np.abs(checked_array("r", r, None))

    def symbol(self, k: ArrayLike) -> ndarray:
        """Fourier transform of the influence function, ``2 / (E* k)``.

        Infinite for ``k = 0``; of the shape of ``k``, whose sign does not count.

        Raises
        ------
        TypeError, ValueError
            If wave numbers are no numbers, or not finite.
        """
        with np.errstate(divide="ignore"):
            return 2 / (self.contact_modulus * np.abs(checked_array("k", k, None)))

    def primitive(self, radius: ArrayLike) -> ndarray:
        """Integral of ``influence(r) r`` from 0 to ``radius``.

        Of the shape of ``radius``, whose sign does not count.

        Raises
        ------
        TypeError, ValueError
            If radii are no numbers, or not finite.
        """
        return self.singular_coefficient * np.abs(checked_array("radius", radius, None))


def _constant(poisson: float, z: ndarray) -> tuple[ndarray, ndarray]:
    return np.ones(z.shape), np.full(z.shape, poisson)


def checked_moduli(young: SupportsFloat, poisson: SupportsFloat) -> tuple[float, float]:
    """Young's modulus and Poisson's ratio as numbers in their range.

    Raises
    ------
    TypeError, ValueError
        As `HalfSpace`.
    """
    young, poisson = checked_number("young", young), checked_number("poisson", poisson)
    if young <= 0:
        raise ValueError(f"expected a positive Young's modulus, got young={young:g}")
    young = checked_size("young", young)
    if not 0 <= poisson <= 0.5:
        got = apart(poisson, 0.5)[0]
        raise ValueError(f"expected Poisson's ratio from 0 to 0.5, got poisson={got}")
    return young, poisson


def checked_substrate(value: object) -> None:
    """Refuse what is no ground, with a TypeError."""
    if isinstance(value, type) or not hasattr(value, "singular_coefficient"):
        raise TypeError(f"expected a substrate such as HalfSpace, got {shown(value)}")
