"""Ground whose pressures and settlements repeat themselves along x and along y."""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import Pair, checked_array, checked_pair, checked_size
from .substrates import HalfSpace, Substrate, checked_substrate


def checked_ground(value: object) -> None:
    """Refuse what is no ground, not even a periodic one, with a TypeError."""
    if not isinstance(value, PeriodicGround):
        checked_substrate(value)


@dataclass(frozen=True)
class PeriodicGround:
    """Any ground under pressures that repeat themselves, for cells that cover a whole period.

    A uniform pressure on a half-space without end settles it without end, so the mean settlement
    is taken for zero: settlements are relative to the mean of the surface, that of a punch too.
    Pressures are taken for waves up to those the cells resolve, trigonometric polynomials through
    the centroids of the cells, as in other codes for periodic contact.

    Parameters
    ----------
    ground : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        What it is made of.
    period : pair of float
        Lengths Lx and Ly of a period.

    Raises
    ------
    TypeError, ValueError
        If the ground is no substrate, or a length is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem import CellBasis, ElementQuad0, MeshQuad
    >>> from skfem_dual import HalfSpace, RigidPunch
    >>> side = np.linspace(0, 1, 33)
    >>> basis = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    >>> soil = PeriodicGround(HalfSpace(1.0, 0.0), (1.0, 1.0))
    >>> wave = RigidPunch(soil, basis, gap=lambda x: 0.01 * np.cos(2 * np.pi * x[0]))
    >>> pressure = wave.solve(force=0.1).pressure  # the wave is pressed flat
    >>> print(f"{pressure.max() - pressure.min():.5f}")  # 2 pi E* 0.01 and the width of a cell
    0.06253
    """

    ground: Substrate
    period: Pair

    def __post_init__(self) -> None:
        checked_substrate(self.ground)
        period = checked_pair("period", self.period)
        object.__setattr__(self, "period", tuple(checked_size("period", p) for p in period))

    @property
    def surface(self) -> HalfSpace:
        """The homogeneous half-space with the moduli of the surface."""
        return self.ground.surface

    def symbol(self, k: ArrayLike) -> ndarray:
        """Settlement by a wave of pressure of unit amplitude; zero for k = 0 by convention.

        Of the shape of ``k``, whose sign does not count.

        Raises
        ------
        TypeError, ValueError
            If wave numbers are no numbers, or not finite.
        """
        waves = np.abs(checked_array("k", k, None))
        out = np.zeros(waves.shape)
        out[waves > 0] = self.ground.symbol(waves[waves > 0])
        return out

    @property
    def singular_coefficient(self) -> NoReturn:
        """Refused with a ValueError, as all that needs settlements under a single force."""
        self._refuse()

    @property
    def remainder(self) -> NoReturn:
        """Refused."""
        self._refuse()

    def influence(self, r: ArrayLike) -> NoReturn:
        """Refused."""
        self._refuse()

    def primitive(self, radius: ArrayLike) -> NoReturn:
        """Refused."""
        self._refuse()

    def _refuse(self) -> NoReturn:
        raise ValueError(
            "expected ground without a period: on a PeriodicGround there are only the settlements "
            "of cells on a regular grid that covers a period. Remedy: RigidPunch, whose "
            "operator @ pressure they are, or the attribute ground"
        )
