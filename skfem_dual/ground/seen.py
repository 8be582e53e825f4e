"""Ground as cells see it that are far larger than its thinnest layers."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..kernels.once import computed_once
from .hankel import RadialTable
from .strata import Strata
from .stratified import Stratified
from .substrates import HalfSpace, Substrate

#: layers thinner than so many sizes of a cell are no part of what varies inside it; the influence
#: function is that of c / r in so many sizes: discs of 40 to 3900 cells, layers 20 times as soft
#: and 30 times as stiff as the ground below
THIN, AWAY = 0.03, 0.1
#: unless the cells' waves feel something else, as layers on a rigid base that are springs
ALIKE = 0.3


@dataclass(frozen=True, eq=False)
class Seen(Stratified):
    """The same ground with a part ``c / r`` that is its influence function at a distance.

    Pressures that vary inside a cell act through c / r as they are, through the remainder by their
    means over parts of the cell. Under a skin far thinner than the cell the two parts of the
    influence function nearly cancel in all of the cell, if c is that of the skin.

    Attributes
    ----------
    ground : Stratified
        The ground.
    distance : float
        Where its influence function is c / r, far less than a cell and more than the skin.
    """

    ground: Stratified
    distance: float

    @property
    def surface(self) -> HalfSpace:
        """That of the ground."""
        return self.ground.surface

    @property
    def strata(self) -> Strata:
        """Those of the ground."""
        return self.ground.strata

    @property
    def lengths(self) -> tuple[float, float]:
        """Those of the ground."""
        return self.ground.lengths

    @property
    def algebraic(self) -> bool:
        """As of the ground."""
        return self.ground.algebraic

    @property
    def singular_coefficient(self) -> float:
        """c of the part c / r."""
        return self.distance * float(self.ground.influence(self.distance))

    @computed_once
    def remainder(self) -> RadialTable:
        """What is left, as of the ground."""
        less = self.ground.singular_coefficient - self.singular_coefficient
        return self.ground.remainder.with_pole(less * self.surface.young)

    def influence(self, r: ArrayLike) -> ndarray:
        """That of the ground."""
        return self.ground.influence(r)

    def primitive(self, radius: ArrayLike) -> ndarray:
        """That of the ground."""
        return self.ground.primitive(radius)

    def __repr__(self) -> str:
        return repr(self.ground)


def seen_by(ground: Substrate, areas: ndarray) -> Substrate:
    """The ground as cells of some areas see it."""
    if not (isinstance(ground, Stratified) and len(areas)):
        return ground
    size = float(np.sqrt(areas.mean()))
    if ground.lengths[0] >= THIN * size:
        return ground
    seen, k = Seen(ground, AWAY * size), np.pi / size
    alike = 2 * np.pi * seen.singular_coefficient / (k * float(ground.symbol(k)))
    return seen if abs(alike - 1) <= ALIKE else ground
