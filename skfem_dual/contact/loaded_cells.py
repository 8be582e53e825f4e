"""Cells under pressure, how it varies inside them, and what stands for their matrix.

Those under a body, a `Footprint`, and the cells of several bodies together alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..elements.balance import resist
from ..elements.edge_weights import EdgeWeights
from ..elements.influence import as_points
from ..elements.slope_correction import SlopeCorrection
from ..elements.slopes import Slopes
from ..grids.partition import Partition
from ..ground.periodic import PeriodicGround
from ..ground.seen import even_at_edge, modulus_felt, seen_by
from ..ground.stratified import Stratified
from ..ground.substrates import Substrate
from ..kernels.once import ReadOnly, computed_once
from ..operators.entries import ALIKE, EXACT, LARGE, SAMPLES, Entries, some_rows
from ..operators.flattened import FlattenedOperator
from ..operators.influence_operator import InfluenceOperator
from ..operators.resources import require_memory
from ..operators.symmetric_matrix import SymmetricMatrix
from ..operators.symmetry import Symmetry
from .system import DENSE

#: from so many cells on a regular grid on products are those of transforms
REGULAR = 256

Ground = ndarray | InfluenceOperator | FlattenedOperator
Operator = Ground | SymmetricMatrix


class ExactRows(NamedTuple):
    """Some rows of the exact matrix of settlements, (k, n), and their numbers."""

    numbers: ndarray
    rows: ndarray


@dataclass(frozen=True, eq=False, repr=False)
class LoadedCells(ReadOnly):
    """Cells on the ground, of one body or of several.

    Attributes
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    partition : Partition
        The n cells.
    weights : EdgeWeights or None
        How the pressure varies inside them towards the edge; None if it does not.
    slopes : Slopes or None
        How it follows the cells around, too.
    collocation_points : (2, n) array of float
        The point of each cell in which ground and body meet.
    """

    substrate: Substrate
    partition: Partition
    weights: EdgeWeights | None
    slopes: Slopes | None
    collocation_points: ndarray

    def __len__(self) -> int:
        return len(self.partition)

    @property
    def few(self) -> bool:
        """Whether their matrix is a small one."""
        return len(self) <= DENSE

    @property
    def resisting(self) -> bool:
        """Whether they resist tilts if all touch: not if they are few, or in one row."""
        return resist(self.collocation_points, np.ones(len(self), dtype=bool))

    @computed_once
    def ground(self) -> Substrate:
        """The ground as cells see it in which pressures vary by a law of the edge."""
        if self.weights is None:
            return self.substrate
        edge = self.partition.f2c[0, self.weights.ribs]
        return seen_by(self.substrate, self.partition.areas[edge])

    @property
    def bends_away(self) -> bool:
        """Whether their ground is a crust that bends away from the middle of the plan."""
        law = None if self.weights is None else self.weights.law
        return law is not None and law.pulls

    @computed_once
    def on_springs(self) -> bool:
        """Whether the ground acts on the cells like springs: pressures fall evenly to the line
        where contact ends."""
        return even_at_edge(self.substrate, self.partition.areas)

    @computed_once
    def contact_modulus(self) -> float:
        """E / (1 - nu^2) of the ground, as waves twice as long as the cells feel it."""
        if not isinstance(self.substrate, Stratified):
            return self.substrate.surface.contact_modulus
        return modulus_felt(self.substrate, float(np.sqrt(self.partition.areas.mean())))

    def entries(self, x: ndarray) -> Entries:
        """What unit pressures on the cells make of points of shape (2, m)."""
        return Entries(self.ground, self.partition, as_points(x), self.weights, self.slopes)

    def influence(self, x: ndarray) -> ndarray:
        """Settlement of points of shape (2, m) under unit pressure on each cell, (m, n)."""
        return self.entries(x).matrix()

    def settlements(self, x: ndarray, pressure: ndarray, rough: bool = False) -> ndarray:
        """The same times mean pressures of the cells, (n,) or (n, k), with no matrix; ``rough`` as
        of `Entries.settlements`."""
        return self.entries(x).settlements(pressure, rough)

    @property
    def regular(self) -> bool:
        """Whether transforms are sooner done than a matrix is made."""
        return self.weights is None and len(self) >= REGULAR and self.partition.lattice is not None

    def slope_correction(self, x: ndarray) -> SlopeCorrection | None:
        """What its slopes inside the cells add."""
        slopes, known = self.slopes, (self.ground, as_points(x))
        return None if slopes is None else SlopeCorrection.from_slopes(slopes, *known)

    def flattened(self, flat: ndarray) -> Self:
        """With no slopes in some cells, given as (n,) array of bool."""
        if self.slopes is None or not flat.any():
            return self
        return replace(self, slopes=self.slopes.without(flat))

    def turning(self, pressure: ndarray) -> ndarray:
        """Cells where slopes make positive pressures negative, (n,) or (n, k) array of bool."""
        out = np.zeros(pressure.shape, dtype=bool)
        if self.slopes is not None:
            sloped = self.slopes.sloped
            out[sloped] = ((pressure <= 0) | (self.slopes.lowest(pressure) < 0))[sloped]
        return out

    def slopes_of(self, pressure: ndarray) -> ndarray:
        """Slopes of the pressure in each cell, shape (2, n)."""
        return np.zeros((2, len(self))) if self.slopes is None else self.slopes.of(pressure)

    @computed_once
    def in_points(self) -> Entries:
        """What unit pressures on the cells make of the collocation points."""
        return self.entries(self.collocation_points)

    @property
    def sloping(self) -> SlopeCorrection | None:
        """What slopes inside the cells add there."""
        return self.in_points.sloping

    def unit_slopes(self) -> ndarray:
        """Settlement of the collocation points by unit slopes along x, then along y, (n, 2 n)."""
        nothing = np.zeros((len(self), 2 * len(self)))
        return nothing if self.sloping is None else self.sloping.to_dense()

    def flattened_operator(self, operator: Operator, flat: ndarray) -> Ground:
        """From `flattened` cells to their collocation points, by the ``operator`` of these."""
        if isinstance(operator, FlattenedOperator) or self.slopes is None:
            raise ValueError("expected cells that all have slopes, got flat ones")
        left_out = self.slopes.without(~flat)
        if isinstance(operator, InfluenceOperator) and operator.sloping is not None:
            return FlattenedOperator(operator, operator.sloping, left_out)
        if self.sloping is None:
            raise ValueError("expected cells that all have slopes, got flat ones")
        matrix = np.array(operator)
        self.sloping.add_to(matrix, left_out, -1.0)
        matrix.setflags(write=False)
        return matrix

    def flattened_rows(self, exact: "ExactRows | None", flat: ndarray) -> "ExactRows | None":
        """Those of `flattened` cells, by ``exact`` ones of these."""
        if exact is None or self.slopes is None or not flat.any():
            return exact
        rows, x = exact.rows.copy(), self.collocation_points[:, exact.numbers]
        sloping = self.sloping if self.few else self.slope_correction(x)
        if sloping is not None:
            sloping = sloping.at(exact.numbers) if self.few else sloping
            sloping.add_to(rows, self.slopes.without(~flat), -1.0)
        return ExactRows(exact.numbers, rows)

    def fast_operator(self, x: ndarray, rtol: float) -> InfluenceOperator:
        """From the cells to points of shape (2, m), to a tolerance."""
        law = self.weights if self.slopes is None else self.slopes
        return InfluenceOperator.from_partition(self.ground, self.partition, x, law, rtol)

    def operator(self, rtol: float) -> ndarray | InfluenceOperator:
        """From the cells to their collocation points; a matrix where that is small and sooner.

        Raises
        ------
        MemoryError
            If the memory at hand will not do until the answer.
        """
        if not self.few and not self.regular and rtol >= EXACT:  # a matrix is refused below
            require_memory(len(self), rtol, self.substrate.remainder is not None)
        operator = self.fast_operator(self.collocation_points, rtol)
        if isinstance(self.substrate, PeriodicGround):  # by transforms alone
            return operator
        sooner = operator.method == "dense" or (operator.method == "toeplitz" and not self.regular)
        return operator.to_dense() if self.few and sooner else operator

    def symmetric_matrix(self, symmetry: Symmetry) -> SymmetricMatrix:
        """The matrix by the rows of one cell of each orbit."""
        x = self.collocation_points
        return SymmetricMatrix.from_rows(symmetry, lambda i: self.influence(x[:, i]))

    @property
    def exact_rows(self) -> "ExactRows | None":
        """Some rows of the matrix; None on periodic ground, whose products are the only ones.

        Of very many cells they are not kept: they are sooner found than pressures.
        """
        if isinstance(self.substrate, PeriodicGround):
            return None
        return self._kept_rows if len(self) <= LARGE else self._some_rows()

    @computed_once
    def _kept_rows(self) -> "ExactRows":
        return self._some_rows()

    def _some_rows(self) -> "ExactRows":
        i = some_rows(len(self), len(self), ALIKE if self.regular else SAMPLES)
        return ExactRows(i, self.influence(self.collocation_points[:, i]))

    def usable_symmetry(self) -> Symmetry | None:
        """The symmetry of the cells; None if they have none, or too little for their number."""
        if isinstance(self.substrate, PeriodicGround):
            return None
        symmetry = Symmetry.detect(self.partition, self.collocation_points, self.weights)
        small = len(self) ** 2 <= DENSE**2 * symmetry.saving.memory
        return symmetry if len(symmetry.permutations) > 1 and small else None


def slices_of(parts: Sequence[LoadedCells]) -> list[slice]:
    """Where the cells of each part are among those of all."""
    ends = np.cumsum([0, *map(len, parts)])
    return [slice(a, b) for a, b in pairwise(ends.tolist())]
