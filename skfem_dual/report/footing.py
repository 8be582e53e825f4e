"""What is read off the cases of one footing, for pages and for programs alike."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray

from ..contact.footprint import Footprint
from ..grids.outline import distance_to_segments, edge_ribs, near_edge
from ..ground.periodic import PeriodicGround
from ..messages import place
from ..plans.search import Accuracy
from ..plans.solve import PlanSolution
from ..solutions.cases_solution import CasesSolution, Extreme
from ..solutions.punch_solution import PunchSolution
from .details import Details
from .numbers import LEVEL, Standing, distance_inside, pulled_area, reach
from .page import DASH
from .results import point_names, wanted_names


@dataclass(frozen=True, eq=False)
class UnderCases(ABC):
    """A footing or a structure under its k cases.

    Attributes
    ----------
    name : str
        As it is called beside others.
    cases
        Its answers.
    details : Details
        Units, allowable pressure and points wanted.
    """

    name: str
    cases: Any
    details: Details

    @property
    def repeats(self) -> bool:
        """Whether the pressures repeat, and their place depends on where a period begins."""
        return isinstance(self.plan.substrate, PeriodicGround)

    @property
    @abstractmethod
    def plan(self) -> Footprint:
        """Its cells."""

    @property
    @abstractmethod
    def success(self) -> ndarray:
        """Whether contact was found, shape (k,)."""

    @property
    @abstractmethod
    def pulled_share(self) -> ndarray:
        """Area on which the ground would have to pull over that of the plan, shape (k,)."""

    @property
    @abstractmethod
    def mean_pressure(self) -> ndarray:
        """Force over the area in contact, shape (k,)."""

    @property
    @abstractmethod
    def largest_pressure(self) -> ndarray:
        """Largest mean on a circle, shape (k,)."""

    def called(self, text: str) -> str:
        """Something of it, as it is called beside other bodies."""
        return f"{self.name}, {text}" if self.name else text

    @cached_property
    def wanted(self) -> dict[str, ndarray]:
        """The points wanted on the plan, by their names."""
        x = self.details.own_points
        if not x.size:
            return {}
        on, names = np.nonzero(points_on(self.plan, x))[0], wanted_names(x)
        return {names[i]: x[:, i] for i in on}

    @abstractmethod
    def table(self) -> list[dict[str, Any]]:
        """A row for each case, for programs, numbers in the units that went in."""

    def rows(self) -> list[dict[str, Any]]:
        """The same, and a row for each case of which there is no solution at all."""
        return self.table() + self.without_solution(self.table()[0], np.nan)

    def without_solution(self, like: dict[str, Any], value: Any) -> list[dict[str, Any]]:
        """What is told of cases without any, by the keys of another and a value for most."""
        nothing = dict.fromkeys(like, value) | {"success": False}
        told = self.details.unsolved.items()
        return [nothing | {"name": name, "message": why} for name, why in told]

    @property
    def utilisation(self) -> ndarray:
        """Mean and largest pressure over the allowable one, shape (2, k); NaN without one, and
        where the equations do not hold."""
        allowable = np.nan if self.details.allowable is None else self.details.allowable
        found = np.array([self.mean_pressure, self.largest_pressure])
        return np.where(self.success, found, np.nan) / allowable


@dataclass(frozen=True, eq=False)
class Footing(UnderCases):
    """One footing under its k cases, which are a `CasesSolution`."""

    cases: CasesSolution

    @classmethod
    def of(cls, name: str, solution: PunchSolution | CasesSolution, details: Details) -> "Footing":
        """Of cases, or of the one case of a single solution."""
        if isinstance(solution, PunchSolution):
            single = solution.punch.footprint, ("load",), (solution.load,), (solution,)
            solution = CasesSolution(*single, (solution.message,))
        return cls(name, solution, details)

    @property
    def plan(self) -> Footprint:
        """Its cells."""
        return self.cases.footprint

    @property
    def names(self) -> tuple[str, ...]:
        """Of the cases."""
        return self.cases.names

    @property
    def messages(self) -> tuple[str, ...]:
        """What was found in the cases, or why not."""
        return self.cases.messages

    @property
    def success(self) -> ndarray:
        """Whether contact was found, shape (k,)."""
        return self.cases.success

    @property
    def largest_pressure(self) -> ndarray:
        """Largest mean on a circle, shape (k,)."""
        return self.cases.largest_pressure

    @property
    def solutions(self) -> tuple[PunchSolution | None, ...]:
        """Of the cases."""
        return self.cases.solutions

    @property
    def mean_settlement(self) -> ndarray:
        """That of the centroid, shape (k,)."""
        arm = self.plan.centre - np.array(self.plan.origin)
        return self.cases.settlement + arm @ self.cases.tilt

    @property
    def contact_share(self) -> ndarray:
        """Area in contact over that of the plan, shape (k,)."""
        return self.cases.contact_share

    @cached_property
    def pulled_share(self) -> ndarray:
        """See `UnderCases.pulled_share`; 0 without a solution."""
        pulled = [0.0 if s is None else pulled_area(s) for s in self.cases.solutions]
        return np.array(pulled) / self.plan.partition.areas.sum()

    @cached_property
    def extremes(self) -> tuple[Extreme, ...]:
        """The cases that govern, of those with success."""
        return self.cases.envelope() if self.success.any() else ()

    @cached_property
    def governing(self) -> int:
        """The case with the largest pressure among those with success, else the first solved."""
        if self.extremes:
            return self.extremes[0].number
        solved = [k for k, s in enumerate(self.cases.solutions) if s is not None]
        return solved[0] if solved else 0

    @property
    def deformation(self) -> float:
        """Largest settlement in a case with success, or in the one shown, over the extent of the
        plan."""
        if self.standing is None:
            return 0.0
        size = self.standing.size
        others = np.abs(self.cases.largest_settlement[self.success]) / size
        return max(self.standing.deformation, float(others.max(initial=0.0)))

    def table(self) -> list[dict[str, Any]]:
        """A row for each case."""
        return self.cases.table()

    @property
    def accuracy(self) -> Accuracy | None:
        """How its mesh was chosen, if it was."""
        for solution in self.cases.solutions:
            if isinstance(solution, PlanSolution):
                return solution.accuracy
        return self.details.accuracy.get(self.name)

    @cached_property
    def standings(self) -> list[Standing | None]:
        """Of each case; None where it has no solution."""
        units = self.details.units
        return [None if s is None else Standing(s, units) for s in self.cases.solutions]

    @property
    def standing(self) -> Standing | None:
        """Of the governing case; None if no case has a solution."""
        return self.standings[self.governing]

    @cached_property
    def points(self) -> dict[str, ndarray]:
        """Corners and extremes of the plan, and the points wanted on it, by their names."""
        if self.standing is None:
            return {}
        corners = dict(zip(point_names(self.standing), self.standing.points.T, strict=True))
        return corners | self.wanted

    @cached_property
    def settlements(self) -> ndarray:
        """Of the points in each case, shape (k, m)."""
        arms = np.array(list(self.points.values())).reshape(-1, 2) - self.cases.footprint.origin
        return self.cases.settlement[:, None] + self.cases.tilt.T @ arms.T

    @cached_property
    def tilts(self) -> ndarray:
        """Tilts to read, shape (2, k): none where they make no difference to the settlements."""
        size = np.hypot(*np.ptp(self.cases.footprint.partition.polygons.p, axis=1))
        level = np.abs(self.cases.tilt) * size <= LEVEL * np.abs(self.cases.largest_settlement)
        return np.where(level, 0.0, self.cases.tilt)

    @cached_property
    def radius(self) -> float:
        """Radius of the circle whose mean pressure is compared."""
        return self.cases.circles.radius

    @cached_property
    def mean_pressure(self) -> ndarray:
        """Force over the area in contact, shape (k,)."""
        found = [np.nan if s is None else s.mean_pressure for s in self.cases.solutions]
        return np.array(found)

    @cached_property
    def lift_off_reserve(self) -> ndarray:
        """Factor on the distance of the resultant from the centroid until it leaves the kern,
        shape (k,); NaN without kern or resultant, or with the centroid outside the kern."""
        return self._reserve(None if self.standing is None else self.standing.kern)

    @cached_property
    def overturning_reserve(self) -> ndarray:
        """The same until it reaches the edge of the plan's convex hull, shape (k,)."""
        return self._reserve(self.hull)

    @cached_property
    def kern_use(self) -> ndarray:
        """Distance of the resultant from the centroid over that of the kern's edge, shape (k,).

        NaN without kern or resultant."""
        with np.errstate(divide="ignore"):
            return 1 / self.lift_off_reserve

    @cached_property
    def overturning_use(self) -> ndarray:
        """The same over that of the edge of the plan's convex hull, shape (k,)."""
        with np.errstate(divide="ignore"):
            return 1 / self.overturning_reserve

    @cached_property
    def edge_distance(self) -> ndarray:
        """Distance of the resultant from the edge of the plan's convex hull, shape (k,)."""
        return distance_inside(self.hull, self.resultants)

    @cached_property
    def hull(self) -> ndarray:
        """Convex hull of the plan, shape (2, m)."""
        return self.plan.hull

    @cached_property
    def resultants(self) -> ndarray:
        """Points of the resultants, shape (2, k); NaN where there is none, it pulls, or it
        repeats."""
        acts = self.cases.force > (np.inf if self.repeats else 0.0)
        return np.where(acts, self.cases.point, np.nan)

    def _reserve(self, polygon: ndarray | None) -> ndarray:
        if polygon is None:
            return np.full(len(self.cases), np.nan)
        return reach(polygon, self.plan.centre, self.resultants)


def unsolved_rows(body: UnderCases, head: Sequence[str]) -> list[tuple]:
    """Rows of cases of which there is no solution at all, under some heads."""
    return [(f"{name} (NO SOLUTION)", *[DASH] * (len(head) - 1)) for name in body.details.unsolved]


def require_points_on(plans: Sequence[Footprint], points: ndarray) -> None:
    """Refuse points, (2, k), beside all plans."""
    on = np.array([points_on(plan, points) for plan in plans]).any(axis=0)
    for x in points[:, ~on].T[:1]:
        edges = [distance_to_segments(x[:, None], *edge_of(plan))[0] for plan in plans]
        raise point_beside(x, min(edges))


def points_on(plan: Footprint, points: ndarray) -> ndarray:
    """Whether points, (2, k), lie on a plan, or on the edge that its facets and rounded
    coordinates stand for."""
    on = plan.fan.locate(points) >= 0
    on[~on] = near_edge(points[:, ~on], *edge_of(plan))
    return on


def point_beside(x: ndarray, distance: float) -> ValueError:
    """The error of a point on no plan, so far off the nearest."""
    return ValueError(
        f"expected points on the plan, got {place(x)}, {distance:.3g} off it. Remedy: "
        "coordinates of the plan; the settlement of the ground beside it is "
        "solution.ground_displacement(x)"
    )


def edge_of(plan: Footprint) -> tuple[ndarray, ndarray]:
    """Ends of the segments around a plan."""
    return plan.partition.ends(edge_ribs(plan.partition))


@dataclass(frozen=True)
class Between:
    """The largest difference of two bodies' mean settlements, of a rigid one that of its centroid.

    Attributes
    ----------
    first, second : str
        The bodies.
    distance : float
        Of their centroids.
    difference : float
        Settlement of the second less that of the first.
    case : str
        Where that is largest.
    """

    first: str
    second: str
    distance: float
    difference: float
    case: str

    @property
    def distortion(self) -> float:
        """Difference over distance."""
        return abs(self.difference) / self.distance
