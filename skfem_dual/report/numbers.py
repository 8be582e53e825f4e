"""What engineers read off a solution: corners of the plan, reserves against lifting off."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.spatial import ConvexHull

from ..errors import ConvergenceError, MeshError, warnings_kept
from ..grids.cellwise import CellwiseBasis
from ..grids.dual_mesh import DualMesh
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..grids.planar import contours, convex_hull, cross
from ..ground.periodic import PeriodicGround
from ..solutions.bounds import Bounds, why_none
from ..solutions.punch_solution import PunchSolution
from ..units import PLAIN, Units

#: from this turn on a vertex of the outline is a corner, unless so many of them are that they are
#: the nodes of a curve on a coarse mesh
SHARP, MANY = np.deg2rad(20.0), 12
#: with more of them, and middles of ribs between at most, it is a circle
ALIKE = 6
#: what counts as nothing, over the size of what it belongs to
NEGLIGIBLE = 1e-9
#: difference of the settlements below which a punch is level, over the largest of them: less than
#: the error of any of them
LEVEL = 5e-5


def outline_corners(partition: Partition) -> ndarray:
    """Corners of a plan and its holes, re-entrant ones too, shape (2, k).

    Vertices with a sharp turn, along each contour from its lowest one on the left, the largest
    contour first; none of a contour with so many that they are nodes of a curve, nor of one that
    turns alike wherever facets meet, as coarse circles do.
    """
    ribs = edge_ribs(partition)
    facets = partition.facets[:, ribs]  # their cells to the left
    contour, order = contours(facets, partition.f2c[0, ribs])
    found = []
    for k in range(contour.max() + 1):
        p = partition.polygons.p[:, facets[0, order[contour == k]]]
        after = np.roll(p, -1, axis=1) - p
        before = np.roll(after, 1, axis=1)
        turn = np.arctan2(cross(before, after), (before * after).sum(axis=0))
        sharp = np.abs(turn) > SHARP
        around = abs(np.sign(turn[sharp]).sum())
        if sharp.any() and around <= (MANY if 2 * around < len(turn) else ALIKE):
            own = p[:, sharp]
            size = np.ptp(p, axis=1).max()
            first = np.lexsort(np.round((own - p.min(axis=1, keepdims=True)) / size, 9))[0]
            found.append((-size, np.roll(own, -first, axis=1)))
    return np.hstack([np.empty((2, 0)), *(own for _, own in sorted(found, key=lambda f: f[0]))])


def characteristic_points(p: ndarray, corners: ndarray) -> ndarray:
    """Points of a plan whose settlements say most.

    Its corners and, in the directions of x and y, the extreme points where none is: the four
    corners of a rectangle, the four extreme points of a circle, the two corners of a half-circle
    with its crown.

    Parameters
    ----------
    p : (2, n) array of float
        Points that span the plan.
    corners : (2, m) array of float
        Corners of its outline; none of a smooth one.

    Returns
    -------
    (2, k) array of float
        Counter-clockwise around the middle, from the lowest on the left; corners that are given
        keep their order and come first.
    """
    hull = convex_hull(p)
    size, chosen, given = np.ptp(hull, axis=1).max(), corners, corners.shape[1]
    for along in np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]):
        reach = along @ hull
        extreme = reach >= reach.max() - 1e-6 * size
        if not (along @ chosen >= reach.max() - 1e-6 * size).any():
            chosen = np.column_stack([chosen, hull[:, extreme].mean(axis=1)])
    centre = hull.mean(axis=1, keepdims=True)
    angle = np.arctan2(*(chosen - centre)[::-1])
    angle = (angle + np.pi - 1e-6) % (2 * np.pi)
    angle[:given] = np.arange(given) - given
    return chosen[:, np.argsort(angle)]


def distance_inside(polygon: ndarray, x: ndarray) -> ndarray:
    """Distances of points, (2,) or (2, n), from the edge of a convex polygon (2, k), negative
    outside."""
    middle = polygon.mean(axis=1)
    equations = ConvexHull((polygon - middle[:, None]).T).equations
    return -((x.T - middle) @ equations[:, :2].T + equations[:, 2]).max(axis=-1)


def reach(polygon: ndarray, centre: ndarray, x: ndarray) -> ndarray:
    """How many times the arms from a centre to points, (2,) or (2, n), fit into a convex polygon.

    Infinite without an arm, NaN if the centre itself is outside.
    """
    equations = ConvexHull((polygon - centre[:, None]).T).equations
    arm = x.T - centre
    if (equations[:, 2] >= 0).any():
        return np.full(arm.shape[:-1], np.nan)
    negligible = np.hypot(*arm.T) <= NEGLIGIBLE * np.ptp(polygon, axis=1).max()
    # of each side: the part of its distance from the centre that the arm covers
    covered = (arm @ equations[:, :2].T / -equations[:, 2]).max(axis=-1)
    return np.where(negligible, np.inf, 1 / np.where(negligible, 1.0, covered))


def pulled_area(solution: Any) -> float:
    """Area of the cells on which the ground would have to pull."""
    return float(solution.footprint.partition.areas[solution.pressure < 0].sum())


@dataclass(frozen=True, eq=False)
class LoadedPlan:
    """The plan of a body and the resultant on it.

    All coordinates are those of the mesh.

    Attributes
    ----------
    solution : PunchSolution or ElasticSolution
        What it is read off.
    units : Units
        Of its numbers, and those to read.
    """

    solution: Any
    units: Units = PLAIN

    @cached_property
    def origin(self) -> ndarray:
        """Point to which settlement and moments refer, shape (2,)."""
        return np.array(self.solution.punch.origin)

    @property
    def dual(self) -> DualMesh | None:
        """The dual grid, if the mesh has one."""
        basis = self.solution.punch.basis
        return basis.dual if isinstance(basis, CellwiseBasis) else None

    @cached_property
    def hull(self) -> ndarray:
        """Convex hull of the plan, shape (2, k)."""
        return self.solution.punch.footprint.hull

    @cached_property
    def points(self) -> ndarray:
        """`characteristic_points` of the plan with all its corners, shape (2, k)."""
        footprint = self.solution.punch.footprint
        seen = footprint.corners is None
        corners = outline_corners(footprint.partition) if seen else footprint.corners
        return characteristic_points(self.hull, corners)

    @property
    def size(self) -> float:
        """Greater extent of the plan along x or y."""
        return float(np.ptp(self.hull, axis=1).max())

    @cached_property
    def load(self) -> float:
        """Sum of the pressures whatever their sign, the measure of what is negligible."""
        punch = self.solution.punch
        return float(np.abs(self.solution.pressure) @ punch.partition.areas)

    @property
    def force(self) -> float:
        """Resultant of the pressures, without rounding errors where moments leave none."""
        return self.solution.acting_force

    @cached_property
    def acting_point(self) -> ndarray | None:
        """Where the resultant acts, also one that pulls; None if there is none to speak of."""
        return self.origin + self.solution.centre_of_pressure if self.force else None

    @property
    def force_point(self) -> ndarray | None:
        """Where the resultant acts; None if there is none to speak of, it pulls, or it repeats."""
        return self.acting_point if self.force > 0 and not self.repeats else None

    @property
    def repeats(self) -> bool:
        """Whether the pressures repeat, and their place depends on where a period begins."""
        return isinstance(self.solution.footprint.substrate, PeriodicGround)

    @property
    def plan_area(self) -> float:
        """Area of the plan."""
        return float(self.solution.punch.partition.areas.sum())

    @property
    def lifted_share(self) -> float:
        """Part of the plan out of contact."""
        share = 1 - self.solution.contact_area / self.plan_area
        return share if share > NEGLIGIBLE else 0.0

    @property
    def pulled_area(self) -> float:
        """Area of the cells under tension."""
        return pulled_area(self.solution)

    @property
    def scale(self) -> ndarray:
        """The sum of the pressures, and that times the square root of the area of the plan:
        measures of forces and of both moments, shape (3,)."""
        return (self.load or 1.0) * np.array([1.0, *[np.sqrt(self.plan_area)] * 2])


@dataclass(frozen=True, eq=False)
class Standing(LoadedPlan):
    """How a punch stands: its plan, where the resultant acts, and how far that is from trouble.

    All coordinates are those of the mesh.

    Attributes
    ----------
    solution : PunchSolution
        What it is read off.
    units : Units
        Of its numbers, and those to read.
    """

    solution: PunchSolution

    @property
    def imposed(self) -> ndarray:
        """Force and first moments about the origin that were imposed, NaN where free, (3,).

        Under an imposed settlement the moments are those of the reaction at its point.
        """
        load = self.solution.load
        moments = np.full(2, np.nan)
        if load.tilt is None:
            force = self.solution.force if load.force is None else load.force
            moments = load.moments_of(force)
        return np.array([np.nan if load.force is None else load.force, *moments])

    @property
    def imbalance(self) -> ndarray:
        """Residuals of what was imposed over their `scale`, shape (3,); NaN where free."""
        return np.abs(self.solution.resultant - self.imposed) / self.scale

    @cached_property
    def _kern(self) -> tuple[ndarray | None, str]:
        punch = self.solution.punch
        if punch.gap is not None:
            return None, "none: the contact of a shaped punch depends on the force"
        if self.solution.others:
            return None, "not computed for neighbouring punches on the same ground"
        try:
            return punch.kern() + self.origin[:, None], ""
        except ConvergenceError as error:
            return None, str(error)

    @property
    def kern(self) -> ndarray | None:
        """Polygon of the force positions with full contact; None if there is none."""
        return self._kern[0]

    @property
    def no_kern(self) -> str:
        """Why there is no kern; empty if there is one."""
        return self._kern[1]

    @cached_property
    def _bounds(self) -> tuple[Bounds | None, str]:
        if reason := why_none(self.solution):
            return None, reason
        try:
            with warnings_kept():  # told with the solution itself
                return self.solution.bounds, ""
        except (ValueError, MeshError, ConvergenceError) as error:
            return None, str(error)

    @property
    def bounds(self) -> Bounds | None:
        """`PunchSolution.bounds`; None if there are none."""
        return self._bounds[0]

    @property
    def no_bounds(self) -> str:
        """Why there are no bounds; empty if there are."""
        return self._bounds[1]

    @property
    def within_kern(self) -> bool | None:
        """Whether the resultant acts in the kern; None without one of both."""
        if self.kern is None or self.force_point is None:
            return None
        return bool(distance_inside(self.kern, self.force_point) >= -NEGLIGIBLE * self.size)

    @property
    def lift_off_reserve(self) -> float:
        """Factor on the distance of the resultant from the plan's centroid until it leaves the
        kern; NaN without a kern or resultant, or with the centroid outside the kern."""
        return self._reserve(self.kern)

    @property
    def overturning_reserve(self) -> float:
        """The same until it reaches the edge of the plan's convex hull."""
        return self._reserve(self.hull)

    def _reserve(self, polygon: ndarray | None) -> float:
        if polygon is None or self.force_point is None:
            return np.nan
        return float(reach(polygon, self.solution.punch.centre, self.force_point))

    @property
    def edge_distance(self) -> float:
        """Distance of the resultant from the edge of the plan's convex hull, negative outside;
        NaN without a resultant."""
        if self.force_point is None:
            return np.nan
        return float(distance_inside(self.hull, self.force_point))

    @property
    def deformation(self) -> float:
        """Largest settlement over the extent of the plan."""
        return float(np.abs(self.settlement_of_hull).max() / self.size)

    @cached_property
    def settlement_of_hull(self) -> ndarray:
        """Settlements of the vertices of the hull, the largest and smallest of the plan among
        them, shape (k,)."""
        return self.solution.punch_displacement(self.hull)

    def is_level(self, slope: float) -> bool:
        """Whether a slope makes no difference to speak of between the settlements."""
        return abs(slope) * self.size <= LEVEL * np.abs(self.settlement_of_hull).max()
