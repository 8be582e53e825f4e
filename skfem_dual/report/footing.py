"""What is read off the cases of one footing, for pages and for programs alike."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy import ndarray

from ..contact.bearing import InnerPoints
from ..contact.cases_solution import CasesSolution
from ..contact.solution import PunchSolution
from .details import Details
from .numbers import Standing, distance_inside, reach
from .results import point_names


@dataclass(frozen=True, eq=False)
class Footing:
    """One footing under its k cases.

    Attributes
    ----------
    name : str
        As it is called beside others.
    cases : CasesSolution
        Its answers.
    details : Details
        Units, allowable pressure and points wanted.
    """

    name: str
    cases: CasesSolution
    details: Details

    @classmethod
    def of(cls, name: str, solution: PunchSolution | CasesSolution, details: Details) -> "Footing":
        """Of cases, or of the one case of a single solution."""
        if isinstance(solution, PunchSolution):
            single = solution.footprint, ("load",), (solution.load,), (solution,)
            solution = CasesSolution(*single, (solution.message,))
        return cls(name, solution, details)

    @cached_property
    def governing(self) -> int:
        """The case with the largest pressure among those with success, else the first solved."""
        if self.cases.success.any():
            return self.cases.envelope()[0].number
        solved = [k for k, s in enumerate(self.cases.solutions) if s is not None]
        return solved[0] if solved else 0

    @cached_property
    def standing(self) -> Standing | None:
        """Of the governing case; None if no case has a solution."""
        solution = self.cases.solutions[self.governing]
        return None if solution is None else Standing(solution, self.details.units)

    @cached_property
    def points(self) -> dict[str, ndarray]:
        """Corners and extremes of the plan, and the points wanted, by their names."""
        if self.standing is None:
            return {}
        corners = dict(zip(point_names(self.standing), self.standing.points.T, strict=True))
        wanted = self.details.own_points.T
        return corners | {f"P{i}": x for i, x in enumerate(wanted, 1)}

    @cached_property
    def settlements(self) -> ndarray:
        """Of the points in each case, shape (k, m)."""
        arms = np.array(list(self.points.values())).reshape(-1, 2) - self.cases.footprint.origin
        return self.cases.settlement[:, None] + self.cases.tilt.T @ arms.T

    @cached_property
    def strip(self) -> float:
        """Width of the strip along a singular edge whose pressures are not compared."""
        return InnerPoints.of(self.cases.footprint).width

    @cached_property
    def mean_pressure(self) -> ndarray:
        """Force over the area in contact, shape (k,)."""
        found = [np.nan if s is None else s.mean_pressure for s in self.cases.solutions]
        return np.array(found)

    @cached_property
    def utilisation(self) -> ndarray:
        """Mean and largest pressure over the allowable one, shape (2, k); NaN without one."""
        allowable = self.details.allowable
        pressures = np.array([self.mean_pressure, self.cases.largest_pressure])
        return pressures / (np.nan if allowable is None else allowable)

    @cached_property
    def kern_use(self) -> ndarray:
        """Distance of the resultant from the centroid over that of the kern's edge, shape (k,).

        NaN without kern or resultant."""
        standing = self.standing
        if standing is None or standing.kern is None:
            return np.full(len(self.cases), np.nan)
        centre = self.cases.footprint.centre
        found = [reach(standing.kern, centre, x) for x in self._resultants]
        with np.errstate(divide="ignore"):
            return 1 / np.array(found)

    @cached_property
    def edge_distance(self) -> ndarray:
        """Distance of the resultant from the edge of the plan's convex hull, shape (k,)."""
        if self.standing is None:
            return np.full(len(self.cases), np.nan)
        hull = self.standing.hull
        return np.array([distance_inside(hull, x) for x in self._resultants])

    @property
    def _resultants(self) -> ndarray:
        """Points of the resultants, shape (k, 2)."""
        return np.where(self.cases.force > 0, self.cases.point, np.nan).T


@dataclass(frozen=True)
class Between:
    """The largest difference of two footings' settlements, at their centroids.

    Attributes
    ----------
    first, second : str
        The footings.
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


def between(footings: list[Footing]) -> list[Between]:
    """The differences of all pairs of footings, of cases with success."""
    found = []
    for a, b in combinations(footings, 2):
        centres = [footing.cases.footprint.centre for footing in (a, b)]
        settled = [
            f.cases.settlement + (c - np.array(f.cases.footprint.origin)) @ f.cases.tilt
            for f, c in zip((a, b), centres)
        ]
        difference = np.where(a.cases.success & b.cases.success, settled[1] - settled[0], np.nan)
        if np.isnan(difference).all():
            continue
        k = int(np.nanargmax(np.abs(difference)))
        distance = float(np.hypot(*(centres[1] - centres[0])))
        found.append(Between(a.name, b.name, distance, float(difference[k]), a.cases.names[k]))
    return found
