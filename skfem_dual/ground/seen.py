"""Ground as cells see it that are far larger than its thinnest layers."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..kernels.once import computed_once
from .hankel import RadialTable
from .rigid_disc import LARGEST_DISC
from .strata import Strata
from .stratified import Stratified
from .substrates import HalfSpace, Substrate

#: layers thinner than so many sizes of a cell are no part of what varies inside it; the influence
#: function is that of c / r in so many sizes: discs of 40 to 3900 cells, layers 20 times as soft
#: and 30 times as stiff as the ground below
THIN, AWAY = 0.03, 0.1
#: unless the cells' waves feel something else, as layers on a rigid base that are springs, or the
#: modulus they feel grows by more than this power of their length, as it does with the depth, or
#: the influence function is another at so many times that distance
ALIKE, POWER, FARTHER = 0.3, 0.3, 3.0
#: and power from which on settlements are closer if pressures do not vary inside cells: discs of
#: 150 to 2300 cells, dual ones and triangles, moduli like powers 0.2 to 1 of the depth, layers of
#: 0.001 and 0.003 radii, 3 to 10 000 times as soft as what is below, and on a rigid base
EVEN = 0.6
#: and the same from waves of so much of cells to those of cells: 0.5 to 1.2 of such springs, up to
#: 0.3 of skins on layers
EVEN_INSIDE = 0.45
#: the law of a disc reaches through cells if it is so many times as large
THROUGH = 3.0
#: where waves of cells feel ground so many times as stiff as the surface, what is weighted and
#: what is not nearly cancel
HARD = 20.0


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
    size = _far_larger(ground, areas)
    if not isinstance(ground, Stratified) or size is None or abs(_power(ground, size)) > POWER:
        return ground
    seen = Seen(ground, AWAY * size)
    inside = FARTHER * seen.distance * ground.influence(FARTHER * seen.distance)
    alike = np.array([_hardness(seen, size), seen.singular_coefficient / inside])
    return seen if (np.abs(alike - 1) <= ALIKE).all() else ground


def even_at_edge(ground: Substrate, areas: ndarray) -> bool:
    """Whether settlements of a flat base are closer if pressures do not vary inside cells of some
    areas at its edge.

    So they are where pressures hardly grow to it, as on springs: on thin soft layers, or where the
    modulus is proportional to the depth; where the surface is far softer than what cells feel; and
    where the law of no disc reaches through a cell.
    """
    size = _far_larger(ground, areas)
    if not isinstance(ground, Stratified) or size is None:
        return False
    # under a skin on a layer longer waves alone feel springs
    if _power(ground, size) > EVEN and _power(ground, AWAY * size, 1 / AWAY) > EVEN_INSIDE:
        return True
    if seen_by(ground, areas) is not ground:
        return False
    reach, hardness = LARGEST_DISC * ground.lengths[0], _hardness(ground, size)
    # a thin layer of much the same ground may lie anywhere
    level = size <= reach or abs(_power(ground, reach, size / reach)) <= POWER
    known = THROUGH * size <= reach or (hardness <= 1 + ALIKE and level)
    return hardness > HARD or not known


def modulus_felt(ground: Stratified, size: float) -> float:
    """E / (1 - nu^2) of homogeneous ground that waves twice as long as ``size`` feel alike."""
    k = np.pi / size
    if ground.lengths[0] < THIN * size:
        return float(2 / (k * ground.symbol(k)))
    # the table of what entries are made of, at hand, is close enough
    of_surface = 2 * (1 - ground.surface.poisson**2)
    rest = float(ground.rest_of_symbol(np.array([k]))[0])
    return 2 * ground.surface.young / (of_surface + rest)


def _hardness(ground: Stratified, size: float) -> float:
    """How many times as stiff as its part ``c / r`` waves of cells of this size feel a ground."""
    return np.pi * ground.singular_coefficient * modulus_felt(ground, size)


def _far_larger(ground: Substrate, areas: ndarray) -> float | None:
    """Size of cells of some areas, if they are far larger than what varies in the ground."""
    if not (isinstance(ground, Stratified) and len(areas)):
        return None
    size = float(np.sqrt(areas.mean()))
    return size if ground.lengths[0] < THIN * size else None


def _power(ground: Stratified, size: float, longer: float = 4.0) -> float:
    """Power of their length like which the modulus that waves feel grows, from those of cells of
    this size to ones so many times as long: 0 of homogeneous ground, 1 of springs."""
    k = np.pi / size * np.array([1.0, 1 / longer])
    short, long = k * ground.symbol(k)
    return float(-np.log(long / short) / np.log(longer))
