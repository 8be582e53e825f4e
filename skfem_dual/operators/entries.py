"""The matrix of settlements by its exact entries, and samples of it as a measure of errors."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain
from typing import cast

import numpy as np
from numpy import ndarray

from ..elements.edge_correction import IN_STRIPS, EdgeCorrection
from ..elements.edge_weights import EdgeWeights
from ..elements.influence import add_remainder, influence_matrix, surface_displacement
from ..elements.moment_sums import settled_by_moments
from ..elements.near import NearField
from ..elements.near_sums import NearSums
from ..elements.remainder import Add
from ..elements.slope_correction import EXACT_RADII, SlopeCorrection
from ..elements.slopes import Slopes
from ..grids.partition import Partition
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from .fmm.summation import FastSummation

#: tolerances below it are for exact entries
EXACT = 1e-8
#: more cells than the first are looked at in parts, so many and those on the edge apart: what is
#: known near all of them takes memory
MANY_CELLS, PARTS = 1000, 4
#: rows that are compared with exact ones, and entries from which on they are fewer
SAMPLES, MANY = 16, 2**22
#: of a new operator so many rows, as long as they have no more entries: among long and thin cells
#: a row in six can be off ten times as far as the others
NEW, SHORT = 64, 2**20
#: a prime: rows of a sample are in no step with those of a grid
APART = 7919
#: rows on a regular grid, which are all alike
ALIKE = 3
#: with more cells products with one vector of random signs are compared, with fewer with two, and
#: one after the other: nothing else takes as much memory
LARGE = 500_000
#: errors do not refer to less than so many times what homogeneous ground would settle
FLOOR = 0.01


@dataclass(frozen=True, eq=False)
class Entries:
    """Settlements of points under unit mean pressures on cells.

    Attributes
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
    partition : Partition
        The loaded cells.
    x : (2, m) array of float
        Field points.
    weights : EdgeWeights or None
        How the pressure varies inside the cells.
    slopes : Slopes or None
        How it follows the cells around.
    single : bool
        Whether single precision will do for what slopes add near by.
    """

    substrate: Substrate
    partition: Partition
    x: ndarray
    weights: EdgeWeights | None
    slopes: Slopes | None = None
    single: bool = False

    @computed_once
    def _corrections(self) -> tuple[EdgeCorrection | None, SlopeCorrection | None]:
        """Both take the same sums near the cells."""
        weights, slopes = self.weights, self.slopes
        if weights is None and slopes is None:  # periodic ground has no part c / r
            return None, None
        c = self.substrate.singular_coefficient
        if slopes is None:
            return EdgeCorrection.from_weights(cast(EdgeWeights, weights), c, self.x), None
        first = every = np.arange(len(self.partition))
        others: list[ndarray] = []
        if len(every) > MANY_CELLS:
            first = every[:0] if weights is None else weights.cells
            others = np.array_split(np.delete(every, first), PARTS)
        edge = self._near(first)
        sums = chain([edge], map(self._near, others))
        dtype = np.float32 if self.single else float
        return (
            None if weights is None else EdgeCorrection.from_sums(weights, c, self.x, edge),
            SlopeCorrection.from_sums(slopes, self.substrate, self.x, sums, dtype),
        )

    def _near(self, cells: ndarray) -> NearSums:
        reach = max(IN_STRIPS, EXACT_RADII)
        return NearSums.from_cells(self.partition, self.weights, cells, reach, self.x)

    @property
    def correction(self) -> EdgeCorrection | None:
        """What edge-weighted cells add."""
        return self._corrections[0]

    @property
    def sloping(self) -> SlopeCorrection | None:
        """What slopes inside the cells add."""
        return self._corrections[1]

    def matrix(self) -> ndarray:
        """All entries, (m, n)."""
        others: list[Add] = [] if self.correction is None else [self.correction.add]
        if self.slopes is not None and self.sloping is not None:
            others.append(self.sloping.adding(self.slopes))
        return influence_matrix(self.substrate, self.partition, self.x, self.weights, others)

    def settlements(self, pressure: ndarray, rough: bool = False) -> ndarray:
        """The matrix times mean pressures (n,) or (n, k), without it; (m,) or (m, k).

        ``rough``: by `settled_by_moments`, in a third of the time on homogeneous ground.
        """
        if rough:
            return self._by_moments(pressure)
        known = self.substrate, self.partition, pressure, self.x, self.weights
        settled = surface_displacement(*known)
        if self.correction is not None:
            settled += self.correction.apply(pressure)
        if self.slopes is not None and self.sloping is not None:
            settled += self.sloping.apply(self.slopes.of(pressure))
        return settled

    def _by_moments(self, pressure: ndarray) -> ndarray:
        c, slopes = self.substrate.singular_coefficient, self.slopes
        settled = settled_by_moments(c, self.partition, self.weights, slopes, pressure, self.x)
        add_remainder(self.substrate, self.partition, pressure, self.x, self.weights, settled)
        if slopes is not None and self.substrate.remainder is not None:
            dipoles = SlopeCorrection.from_sums(slopes, self.substrate, self.x, [])
            beyond = dipoles.fall._replace(coefficient=0.0)
            settled += replace(dipoles, fall=beyond).apply(slopes.of(pressure))
        return settled

    def rows(self, i: ndarray) -> ndarray:
        """Those of the points with the numbers ``i``, (len(i), n)."""
        x = np.ascontiguousarray(self.x[:, i])
        return replace(self, x=x, single=False).matrix()

    def diagonal(self) -> ndarray:
        """Those of each cell and its own point, (n,)."""
        if self.single:  # as kept for products
            return replace(self, single=False).diagonal()
        each = np.arange(len(self.partition))
        out = np.empty(len(each))
        near = NearField.from_partition(self.substrate, self.partition, self.weights, each, EXACT)
        near.fill(self.x, np.stack([each, each + 1]), (np.append(each, len(each)), each), out)
        if self.correction is not None:
            out += self.correction.near.diagonal()
        if self.slopes is not None and self.sloping is not None:
            out += self.sloping.diagonal(self.slopes)
        return out

    def summed(
        self,
        fast: FastSummation,
        q: ndarray,
        slopes: Callable[[ndarray], ndarray] | None,
        rough: bool = False,
    ) -> ndarray:
        """Settlements under mean pressures (n,) or (n, k) by a fast summation.

        ``slopes`` takes them, as (k, n), to slopes, as `Slopes.of_rows` does; ``rough`` as of
        `FastSummation.add`.
        """
        rows = q.reshape(len(q), -1).T
        settled, dipoles = np.zeros((len(rows), self.x.shape[1])), None
        if self.correction is not None:
            for own, row in zip(settled, rows, strict=True):
                own += self.correction.near @ row
        if slopes is not None and self.sloping is not None:
            dipoles = slopes(rows)
            self.sloping.near.add_product(dipoles, settled)
            for own in dipoles:  # in their place: they take no memory of their own
                own[:] = self.sloping.dipoles(own[None], fast.tree.cells)[0]
        fast.add(rows, dipoles, settled, rough)
        return settled.T.reshape(-1, *q.shape[1:])


def some_rows(points: int, cells: int, most: int = SAMPLES) -> ndarray:
    """Numbers of some rows, one in each of equal parts, the same every time."""
    count = min(most, max(MANY // cells, 2), points)
    each = np.arange(count)
    return each * points // count + each * APART % (points // count)


@dataclass(frozen=True, eq=False)
class Sample:
    """Some exact rows, against which products are checked.

    Attributes
    ----------
    numbers : (k,) array of int
    rows : (k, n) array of float
    total, norm : (k,) array of float
        What errors refer to: sums of the rows taken positive, and 2-norms.
    least : float
        Least of the sums, over that on homogeneous ground with the moduli of the surface.
    """

    numbers: ndarray
    rows: ndarray
    total: ndarray
    norm: ndarray
    least: float

    @classmethod
    def from_entries(cls, entries: Entries, most: int) -> "Sample":
        """Some rows, see `some_rows`."""
        numbers = some_rows(entries.x.shape[1], len(entries.partition), most)
        rows = entries.rows(numbers)
        total, norm, least = np.abs(rows).sum(axis=1), np.linalg.norm(rows, axis=1), 1.0
        if entries.substrate.remainder is not None:
            # settlements can be far smaller than those of c / r alone, of forces afar, in the
            # middle of a disc
            x, y, areas = (
                entries.x[:, numbers],
                entries.partition.centroids,
                entries.partition.areas,
            )
            r = np.hypot(*(x[:, :, None] - y[:, None]))
            c = entries.substrate.singular_coefficient
            alone = c * areas / np.maximum(r, np.sqrt(areas / np.pi) / 2)
            total = np.maximum(total, FLOOR * alone.sum(axis=1))
            norm = np.maximum(norm, FLOOR * np.linalg.norm(alone, axis=1))
            least = float(np.min(total / alone.sum(axis=1)))
        return cls(numbers, rows, total, norm, least)

    @classmethod
    def from_rows(cls, numbers: ndarray, rows: ndarray) -> "Sample":
        """Some rows that are known."""
        total, norm = np.abs(rows).sum(axis=1), np.linalg.norm(rows, axis=1)
        # rows of one cell that is the whole period are zero
        total, norm = (np.where(size > 0, size, 1.0) for size in (total, norm))
        return cls(numbers, rows, total, norm, 1.0)

    def errors(self, product: Callable[[ndarray], ndarray]) -> tuple[float, float]:
        """Errors of a ``product`` with the matrix: under pressures of size 1, uniform and with
        random signs, and of these in the 2-norm."""
        rng, n = np.random.default_rng(0), self.rows.shape[1]
        q = np.ones((3 if n <= LARGE else 2, n))
        for row in q[1:]:
            row -= 2.0 * rng.integers(2, size=n, dtype=np.int8)
        blocks = [q.T] if n <= LARGE else [row[:, None] for row in q]
        found = [product(some)[self.numbers] - self.rows @ some for some in blocks]
        off = np.hstack(found).T
        squares = np.mean(np.square(off[1:]), axis=0) / self.norm**2
        return float(np.max(np.abs(off) / self.total)), float(np.sqrt(squares.mean()))
