"""What the pressures of cells amount to: a force in a point, or moments alone."""

import numpy as np
from numpy import ndarray

from ..contact.footprint import Footprint
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly

#: parts of what presses that rounding may leave
LEFT = 1e-9


class Resultant(ReadOnly):
    """Force and moments of mean pressures (n,), and what of them is told."""

    footprint: Footprint
    pressure: ndarray
    resultant: ndarray

    @property
    def force(self) -> float:
        """Resultant of the pressure."""
        return float(self.resultant[0])

    @property
    def _least(self) -> float:
        """Forces up to which they may be rounding."""
        return LEFT * float(np.abs(self.pressure) @ self.footprint.partition.areas)

    @property
    def acts(self) -> bool:
        """Whether the force is more than rounding of the pressures."""
        return abs(self.force) > self._least

    @property
    def acting_force(self) -> float:
        """The force, zero where it is rounding."""
        return self.force if self.acts else 0.0

    @property
    def centre_of_pressure(self) -> ndarray:
        """Point through which the resultant acts, from the origin; NaN without a force that is
        more than rounding of the pressures."""
        return readonly(self.resultant[1:] / self.force if self.acts else np.full(2, np.nan))

    @property
    def couple(self) -> ndarray:
        """Moments (mx, my), as in tables of loads, of pressures without a force; zero of those
        that have one; shape (2,)."""
        moments, size = self.resultant[:0:-1], np.sqrt(self.footprint.partition.areas.sum())
        told = ~np.bool_(self.acts) & (np.abs(moments) > self._least * size)
        return readonly(np.where(told, moments, 0.0))
