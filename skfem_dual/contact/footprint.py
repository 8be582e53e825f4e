"""The cells under a body, how the pressure varies inside them, and where they are collocated.

It is all that pressures, gaps and their equations depend on, whatever the body is: rigid, bending,
alone or one of many. The equations are (5) of the paper.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix
from skfem import CellBasis
from skfem.assembly.basis import AbstractBasis

from ..arguments import Pair, checked_array, checked_choice, checked_number, checked_pair
from ..elements.edge_weights import EdgeWeights, load_centroids
from ..elements.load_matrix import load_matrix
from ..elements.resolution import require_sizes
from ..elements.slopes import Slopes
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.fan import Fan
from ..grids.partition import Partition
from ..grids.planar import convex_hull
from ..grids.polygons import readonly
from ..ground.periodic import PeriodicGround, checked_ground
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..messages import place
from ..operators.influence_operator import COARSEST, RTOL
from .edges import EdgeBoundaries, weights_of, where_named
from .hull import Hull
from .load import Load
from .loaded_cells import LoadedCells
from .period import PeriodTriangles
from .plan_triangles import PlanTriangles

Edge = Literal["singular", "constant"]
Collocation = Literal["centroid", "node"]

#: arms of so much of the size of a plan, or of coordinates, are rounding
NIL, ROUNDING = 1e-12, 1e-15
#: squares of widths, over those of lengths, of points in a row; and rises, over those of a shape,
#: that are none
FLAT, ROUGHLY = 1e-14, 1e-9


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
    outline, corners : (2, k) array of float or None
        As of `RigidPunch`.
    edge_boundaries : str, sequence of str or of int, or None
        As of `RigidPunch`.
    """

    basis: CellBasis
    edge: Edge
    collocation: Collocation
    origin: Pair
    rtol: float | None
    outline: ndarray | None = None
    corners: ndarray | None = None
    edge_boundaries: EdgeBoundaries | None = None

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
        outline: ArrayLike | None = None,
        corners: ArrayLike | None = None,
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
        require_sizes(partition)
        if outline is not None:
            outline = _checked_outline(outline, partition)
        if corners is not None:
            corners = readonly(checked_array("corners", corners, (2, "m")))
        law: tuple[EdgeWeights | None, Slopes | None] = None, None
        if edge == "singular":
            weights = weights_of(substrate, basis, partition, edge_boundaries)
            law = weights, Slopes.from_weights(weights)
        points = partition.nodes if collocation == "node" else partition.centroids
        plan = substrate, partition, *law, points, basis
        return cls(*plan, edge, collocation, origin, rtol, outline, corners, edge_boundaries)

    @computed_once
    def hull(self) -> ndarray:
        """Corners of the plan's convex hull: of its outline, or of the cells; shape (2, k)."""
        outline = self.partition.polygons.p if self.outline is None else self.outline
        return readonly(convex_hull(outline))

    @computed_once
    def fan(self) -> Fan:
        """Triangles that fill the cells, also those of the weights."""
        fan = Fan.from_basis(self.basis)
        return fan if self.weights is None else fan.with_cells_of(self.weights.fan)

    @computed_once
    def triangles(self) -> PlanTriangles:
        """Triangles on which regions of contact are drawn."""
        plan, cells = nodal_mesh(self.basis), self.partition
        triangles = PlanTriangles.of(cells, plan, self.weights)
        if isinstance(self.substrate, PeriodicGround) and cells.lattice is not None:
            return PeriodTriangles.over(triangles, cells.lattice)
        return triangles

    @computed_once
    def smooth(self) -> Slopes:
        """Slopes of pressures that follow those around, by no law of an edge."""
        return Slopes.from_partition(self.partition)

    @computed_once
    def centre(self) -> ndarray:
        """Centroid of the plan, about which all is computed: no cancellation far from it.

        Where it is the origin but for rounding it is that: loads there have no moments.
        """
        centre, origin = self.partition.centre, np.array(self.origin, dtype=float)
        return np.where(np.abs(centre - origin) <= self._nil(centre), origin, centre)

    def _nil(self, x: ndarray) -> float:
        """Distances in the plan, and of points at ``x``, that are rounding."""
        return max(NIL * self.partition.extent, ROUNDING * np.abs(x).max(initial=0.0))

    def load_matrix(self, basis: AbstractBasis, **options: Any) -> csr_matrix:
        """Loads on finite elements by unit mean pressures; where cells have slopes, by unit slopes
        along x and y too: see `load_matrix`."""
        law, sloped = (self.partition, self.weights, self.fan), self.slopes is not None
        return load_matrix(*law, basis, moments=sloped, **options)

    def with_slopes(self, matrix: csr_matrix) -> csr_matrix:
        """From (k, 3 n), for mean pressures and slopes, to (k, n), with the slopes by them."""
        n = len(self)
        if self.slopes is None:
            return matrix if matrix.shape[1] == n else csr_matrix(matrix[:, :n])
        return csr_matrix(matrix[:, :n] + matrix[:, n:] @ self.slopes.matrix)

    @property
    def acting(self) -> ndarray:
        """Point through which the pressure of each cell acts, shape (2, n)."""
        return load_centroids(self.partition, self.weights)

    @computed_once
    def hulls(self) -> tuple[Hull, Hull]:
        """Convex hulls of where pressures act, and of the plan, from the centre."""
        return hulls([self], self.centre)

    def planes(self, x: ndarray) -> ndarray:
        """Settlement at ``x`` by unit settlement of the plan's centroid and unit tilts.

        Arms that are rounding, of points in a row along an axis, are none: no tilt is resisted by
        them.
        """
        arms = x - self.centre[:, None]
        arms[np.abs(arms).max(axis=1, initial=0.0) <= self._nil(x)] = 0.0
        return np.vstack([np.ones(x.shape[1]), arms])

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
        where = where_named(self.edge_boundaries)
        edge = f"{self.edge} edge" + f" on {where}" * bool(where)
        return f"{len(self)} {kind}, {edge}, {self.collocation} collocation"


def _checked_outline(outline: ArrayLike, partition: Partition) -> ndarray:
    """Points that span the plan of the cells, up to one cell beside these.

    Raises
    ------
    TypeError, ValueError
        If they are no points, or span another plan.
    """
    points = readonly(checked_array("outline", outline, (2, "k"), least=3))
    own, beside = partition.polygons.p, np.sqrt(partition.areas.max())
    for end in (np.min, np.max):
        if (np.abs(end(points, axis=1) - end(own, axis=1)) > beside).any():
            raise ValueError(
                "expected an outline that spans the plan, whose cells reach from "
                f"{place(own.min(axis=1))} to {place(own.max(axis=1))}, got one from "
                f"{place(points.min(axis=1))} to {place(points.max(axis=1))}. Remedy: "
                "Plan.hull of the plan of which the mesh is, in its unit"
            )
    return points


def require_even(
    cells: Footprint, shape: Callable[[ndarray], ndarray | None] | None, load: Load
) -> None:
    """Refuse a shape that rises across a row of cells under a load that leaves tilts free.

    Raises
    ------
    ValueError
        If it does, as far as it is known beside collocation points.
    """
    if shape is None or load.tilt is not None:
        return
    x = cells.collocation_points
    arms = x - x.mean(axis=1, keepdims=True)
    spread, ways = np.linalg.eigh(arms @ arms.T)
    for way in ways[:, spread <= FLAT * spread.max()].T:
        beside = np.outer(way, np.sqrt(cells.partition.areas) / 8)
        right, left = shape(x + beside), shape(x - beside)
        if right is None or left is None:
            return
        size = max(np.ptp(right), np.ptp(left), np.abs(right).max() * FLAT)
        if np.abs(right - left).max() > ROUGHLY * size:
            raise ValueError(
                "expected a shape that is even across a row of cells, which resist no tilt "
                "across it, got one that rises there. Remedy: more cells side by side, or impose "
                "tilt=(0, 0)"
            )


def hulls(parts: Sequence[Footprint], centre: ndarray) -> tuple[Hull, Hull]:
    """Convex hulls of where the pressures of a body act, and of its plan, from its centre."""
    acting = np.hstack([part.acting for part in parts])
    corners = np.hstack([part.hull for part in parts])
    return Hull(acting - centre[:, None]), Hull(corners - centre[:, None])
