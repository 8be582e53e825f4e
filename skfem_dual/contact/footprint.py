"""The cells under a body, how the pressure varies inside them, and where they are collocated.

It is all that pressures, gaps and their equations depend on, whatever the body is: rigid, bending,
alone or one of many. The equations are (5) of the paper.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from skfem import CellBasis
from skfem.assembly.basis import AbstractBasis

from ..arguments import Pair, checked_choice, checked_number, checked_pair
from ..elements.edge_correction import EdgeCorrection
from ..elements.edge_weights import EdgeWeights
from ..elements.influence import as_points
from ..elements.load_matrix import load_matrix
from ..elements.resolution import too_coarse
from ..elements.slope_correction import SlopeCorrection
from ..elements.slopes import Slopes
from ..errors import ResolutionWarning, warn
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.fan import Fan
from ..grids.partition import Partition
from ..ground.periodic import PeriodicGround, checked_ground
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..operators.entries import ALIKE, LARGE, SAMPLES, Entries, some_rows
from ..operators.flattened import FlattenedOperator
from ..operators.influence_operator import COARSEST, RTOL, InfluenceOperator
from ..operators.resources import require_memory
from ..operators.symmetric_matrix import SymmetricMatrix
from ..operators.symmetry import Symmetry
from .edges import EdgeBoundaries, weights_of
from .load import Hull
from .region import PlanTriangles
from .system import DENSE

#: from so many cells on a regular grid on products are those of transforms
REGULAR = 256

Edge = Literal["singular", "constant"]
Collocation = Literal["centroid", "node"]
Ground = ndarray | InfluenceOperator | FlattenedOperator
Operator = Ground | SymmetricMatrix


class ExactRows(NamedTuple):
    """Some rows of the exact matrix of settlements, (k, n), and their numbers."""

    numbers: ndarray
    rows: ndarray


@dataclass(frozen=True, eq=False, repr=False)
class LoadedCells:
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

    def entries(self, x: ndarray) -> Entries:
        """What unit pressures on the cells make of points of shape (2, m)."""
        return Entries(self.substrate, self.partition, as_points(x), self.weights, self.slopes)

    def influence(self, x: ndarray) -> ndarray:
        """Settlement of points of shape (2, m) under unit pressure on each cell, (m, n)."""
        return self.entries(x).matrix()

    def settlements(self, x: ndarray, pressure: ndarray, rough: bool = False) -> ndarray:
        """The same times mean pressures of the cells, (n,) or (n, k), with no matrix; ``rough`` as
        of `Entries.settlements`."""
        return self.entries(x).settlements(pressure, rough)

    def edge_correction(self, x: ndarray) -> EdgeCorrection | None:
        """What the variation of the pressure inside the cells adds to settlements at ``x``."""
        weights, c = self.weights, self.substrate.singular_coefficient
        return None if weights is None else EdgeCorrection.from_weights(weights, c, as_points(x))

    @property
    def regular(self) -> bool:
        """Whether transforms are sooner done than a matrix is made."""
        return self.weights is None and len(self) >= REGULAR and self.partition.lattice is not None

    def slope_correction(self, x: ndarray) -> SlopeCorrection | None:
        """What its slopes inside the cells add."""
        slopes, known = self.slopes, (self.substrate, as_points(x))
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
        return InfluenceOperator.from_partition(self.substrate, self.partition, x, law, rtol)

    def operator(self, rtol: float) -> ndarray | InfluenceOperator:
        """From the cells to their collocation points; a matrix where that is small and sooner.

        Raises
        ------
        MemoryError
            If the memory at hand will not do until the answer.
        """
        if not self.few and not self.regular:
            require_memory(len(self), rtol, self.substrate.remainder is not None)
        operator = self.fast_operator(self.collocation_points, rtol)
        return operator.to_dense() if self.few and operator.method == "dense" else operator

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


@dataclass(frozen=True, eq=False, repr=False)
class Footprint(LoadedCells):
    """The cells under one body.

    Attributes
    ----------
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the plan; cell ``i`` is that of DOF ``i``.
    edge, collocation
        As of `RigidPunch`.
    origin : pair of float
        The point to which resultants refer.
    rtol : float or None
        Accuracy of settlements under given pressures; None: exact while that is a small matrix.
    """

    basis: CellBasis
    edge: Edge
    collocation: Collocation
    origin: Pair
    rtol: float | None

    @classmethod
    def from_basis(
        cls,
        substrate: Substrate,
        basis: CellBasis,
        edge: Edge = "singular",
        edge_boundaries: EdgeBoundaries | None = None,
        collocation: Collocation = "centroid",
        origin: Pair = (0.0, 0.0),
        rtol: float | None = None,
    ) -> "Footprint":
        """Of a basis of piecewise constants; arguments as of `RigidPunch`.

        Raises
        ------
        TypeError, ValueError, MeshError
            If an argument is not what it must be, or they contradict each other.
        """
        checked_ground(substrate)
        checked_choice("collocation", collocation, ("centroid", "node"))
        checked_choice("edge", edge, ("singular", "constant"))
        if edge == "singular" and collocation == "node":
            raise ValueError(
                'expected collocation "centroid" with edge "singular", got "node". Remedy: '
                'edge="constant" for the paper\'s scheme'
            )
        if edge == "singular" and isinstance(substrate, PeriodicGround):
            raise ValueError('expected edge "constant" on a PeriodicGround, which has no edge')
        if edge == "constant" and edge_boundaries is not None:
            raise ValueError('expected edge "singular" where edge_boundaries are named')
        origin = checked_pair("origin", origin)
        if rtol is not None:
            rtol = checked_number("rtol", rtol, at_least=0, at_most=COARSEST)
        partition = Partition.from_basis(basis)
        if coarse := too_coarse(substrate, partition, edge == "singular"):
            warn(coarse, ResolutionWarning)
        law: tuple[EdgeWeights | None, Slopes | None] = None, None
        if edge == "singular":
            weights = weights_of(substrate, basis, partition, edge_boundaries)
            law = weights, Slopes.from_weights(weights)
        points = partition.nodes if collocation == "node" else partition.centroids
        return cls(substrate, partition, *law, points, basis, edge, collocation, origin, rtol)

    @computed_once
    def fan(self) -> Fan:
        """Triangles that fill the cells, also those of the weights."""
        fan = Fan.from_basis(self.basis)
        return fan if self.weights is None else fan.with_cells_of(self.weights.fan)

    @computed_once
    def triangles(self) -> PlanTriangles:
        """Triangles on which regions of contact are drawn."""
        return PlanTriangles.of(self.partition, nodal_mesh(self.basis), self.weights)

    @computed_once
    def smooth(self) -> Slopes:
        """Slopes of pressures that follow those around, by no law of an edge."""
        return Slopes.from_partition(self.partition)

    @computed_once
    def centre(self) -> ndarray:
        """Centroid of the plan, about which all is computed: no cancellation far from it."""
        areas = self.partition.areas
        return self.partition.centroids @ areas / areas.sum()

    def load_matrix(self, basis: AbstractBasis, **options: Any) -> csr_matrix:
        """Loads on finite elements by unit mean pressures; where cells have slopes, by unit slopes
        along x and y too: see `load_matrix`."""
        law, sloped = (self.partition, self.weights, self.fan), self.slopes is not None
        return load_matrix(*law, basis, moments=sloped, **options)

    def with_slopes(self, matrix: csr_matrix) -> csr_matrix:
        """From (k, 3 n), for mean pressures and slopes, to (k, n), with the slopes by them."""
        n = len(self)
        if self.slopes is None:
            return matrix
        return csr_matrix(matrix[:, :n] + matrix[:, n:] @ self.slopes.matrix)

    @property
    def acting(self) -> ndarray:
        """Point through which the pressure of each cell acts, shape (2, n)."""
        return self.partition.centroids if self.weights is None else self.weights.centroids

    @computed_once
    def hulls(self) -> tuple[Hull, Hull]:
        """Convex hulls of where pressures act, and of the plan, from the centre."""
        return hulls([self], self.centre)

    def planes(self, x: ndarray) -> ndarray:
        """Settlement at ``x`` by unit settlement of the plan's centroid and unit tilts."""
        return np.vstack([np.ones(x.shape[1]), x - self.centre[:, None]])

    @computed_once
    def resultants(self) -> ndarray:
        """Force and first moments about the plan's centroid of unit pressures, shape (3, n)."""
        resultants = self.planes(self.acting) * self.partition.areas
        if self.slopes is not None:
            resultants[1:] += self.slopes.first_moments
        return resultants

    def resultant(self, pressure: ndarray) -> ndarray:
        """Integrals of ``p``, ``p x`` and ``p y`` from the origin, shape (3,)."""
        resultant = self.resultants @ pressure
        resultant[1:] += resultant[0] * (self.centre - self.origin)
        return resultant

    def mean_moments(self, pressure: ndarray, slopes: ndarray) -> ndarray:
        """Means of ``p x`` and ``p y`` over each cell, from the origin of coordinates, (2, n)."""
        means = self.acting * pressure
        if self.slopes is not None:
            second = self.slopes.second_moments
            means += np.einsum("ijn,jn->in", second, slopes) / self.partition.areas
        return means

    def pressure_factors(self, x: ndarray) -> tuple[ndarray, ndarray, ndarray]:
        """Pressure at points of shape (2, m) over the mean of their cells.

        Mask of the points inside the plan; of these the cells and the ratio, infinite on an edge.
        """
        triangle = self.fan.locate(x)
        inside = triangle >= 0
        cell = self.fan.cell[triangle[inside]]
        ratio, weights = np.ones(len(cell)), self.weights
        if weights is None:
            return inside, cell, ratio
        own = weights.weighted[cell]
        (point,), triangle = np.nonzero(inside), triangle[inside][own]
        at = self.fan.coordinates(triangle, x[:, point[own]])
        phi = np.sum(at * weights.roots_in(self.fan, triangle) ** 2, axis=0)
        phi[phi < 1e-12 * weights.root.max() ** 2] = 0.0  # on the edge but for rounding
        ratio[own] = weights.relative(cell[own], np.sqrt(phi))
        return inside, cell, ratio

    @property
    def tolerance(self) -> float:
        """Accuracy of what is summed up."""
        return RTOL if self.rtol is None else self.rtol

    @property
    def on_dual_cells(self) -> bool:
        """Whether the cells are those of a dual grid."""
        return isinstance(self.basis, CellwiseBasis) and self.basis.grid == "dual"

    @property
    def description(self) -> str:
        """Number and kind of the cells and the collocation, for tables."""
        kind = {3: "triangles", 4: "quadrilaterals"}.get(self.partition.polygons.sizes.max())
        kind = "dual cells" if self.on_dual_cells else kind
        return f"{len(self)} {kind}, {self.edge} edge, {self.collocation} collocation"


def slices_of(parts: Sequence[LoadedCells]) -> list[slice]:
    """Where the cells of each part are among those of all."""
    ends = np.cumsum([0, *map(len, parts)])
    return [slice(a, b) for a, b in pairwise(ends.tolist())]


def hulls(parts: Sequence[Footprint], centre: ndarray) -> tuple[Hull, Hull]:
    """Convex hulls of where the pressures of a body act, and of its plan, from its centre."""
    acting = np.hstack([part.acting for part in parts])
    corners = np.hstack([part.partition.polygons.p for part in parts])
    return Hull(acting - centre[:, None]), Hull(corners - centre[:, None])
