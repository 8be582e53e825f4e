"""Structures under their load cases, alone or beside footings, as sections of a report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy import ndarray

from ..bodies.plates import Plate
from ..contact.footprint import Footprint
from ..io import CaseRow
from ..messages import listed
from ..solutions.bearing import Circles, bearing_pressure
from ..solutions.cases_solution import COUPLE, Extreme, extremes_of
from ..solutions.elastic_solution import ElasticSolution
from .depth import depth_section
from .footing import UnderCases, unsolved_rows
from .input import mesh_figure
from .numbers import LoadedPlan
from .page import (
    NONE,
    Html,
    amount,
    coordinate,
    percent,
    placed,
    section,
    table,
    titled,
)
from .results import axes_of, in_words, isobars_figure, point_names
from .structure import (
    a_little_inside,
    deflection_figure,
    deflections_on,
    input_rows,
    largest_gap,
)


@dataclass(frozen=True, eq=False)
class Structure(UnderCases):
    """One structure under its k cases; what `Footing` is for a rigid one."""

    cases: Mapping[str, ElasticSolution]

    @property
    def plate(self) -> Plate | None:
        """What it is made of, if that was said."""
        return self.details.plates.get(self.name)

    @property
    def columns(self) -> Sequence[CaseRow]:
        """What stands on it, if that was said."""
        return self.details.columns.get(self.name, ())

    @property
    def plan(self) -> Footprint:
        """Its cells."""
        return self.standings[0].solution.punch.footprint

    @property
    def names(self) -> tuple[str, ...]:
        """Of the cases."""
        return tuple(self.cases)

    @property
    def messages(self) -> tuple[str, ...]:
        """What was found in the cases, or why not."""
        return tuple(solution.message for solution in self.cases.values())

    @property
    def solutions(self) -> tuple[ElasticSolution, ...]:
        """Of the cases."""
        return tuple(self.cases.values())

    @cached_property
    def mean_settlement(self) -> ndarray:
        """Mean deflection of the plan, shape (k,)."""
        areas = self.plan.partition.areas
        return np.array([areas @ s.cell_deflections for s in self.solutions]) / areas.sum()

    @cached_property
    def points(self) -> dict[str, ndarray]:
        """Corners and extremes of the plan, and the points wanted on it, by their names."""
        corners = dict(zip(point_names(self.standing), self.standing.points.T, strict=True))
        return corners | self.wanted

    @cached_property
    def settlements(self) -> ndarray:
        """Deflections of the points in each case, shape (k, m)."""
        inside = a_little_inside(self.standing, np.array(list(self.points.values())).T)
        return np.array([solution.deflection(inside) for solution in self.solutions])

    @cached_property
    def standings(self) -> list[LoadedPlan]:
        """With the resultant of each case."""
        return [LoadedPlan(solution, self.details.units) for solution in self.cases.values()]

    @cached_property
    def acting_points(self) -> ndarray:
        """Points of the resultants, shape (2, k); NaN where there is none."""
        points = [plan.acting_point for plan in self.standings]
        return np.array([np.full(2, np.nan) if x is None else x for x in points]).T

    @cached_property
    def couples(self) -> ndarray:
        """Moments (mx, my) of resultants that act in no point, shape (2, k)."""
        return np.array([solution.couple for solution in self.solutions]).T

    @property
    def has_couples(self) -> bool:
        """Whether some case that was solved has such moments."""
        return bool(self.couples[:, self.success].any())

    @cached_property
    def success(self) -> ndarray:
        """Whether contact was found, shape (k,)."""
        return np.array([solution.success for solution in self.cases.values()])

    @cached_property
    def deflections(self) -> ndarray:
        """Least and largest of the points and the vertices of the cells, shape (k, 2)."""
        found = [deflections_on(plan.solution, plan)[1] for plan in self.standings]
        return np.array([(w.min(), w.max()) for w in found])

    @cached_property
    def largest_gap(self) -> ndarray:
        """Of the points and the corners of the plan, shape (k,)."""
        return np.array([largest_gap(plan.solution, plan) for plan in self.standings])

    @cached_property
    def mean_pressure(self) -> ndarray:
        """Force over the area in contact, shape (k,)."""
        return np.array([solution.mean_pressure for solution in self.solutions])

    @cached_property
    def largest_pressure(self) -> ndarray:
        """Largest mean on a circle, shape (k,)."""
        return np.array([bearing_pressure(solution) for solution in self.cases.values()])

    @cached_property
    def contact_share(self) -> ndarray:
        """Area in contact over that of the plan, shape (k,)."""
        return np.array([1 - plan.lifted_share for plan in self.standings])

    @cached_property
    def pulled_share(self) -> ndarray:
        """See `UnderCases.pulled_share`."""
        return np.array([plan.pulled_area / plan.plan_area for plan in self.standings])

    @property
    def radius(self) -> float:
        """Radius of the circle whose mean pressure is compared."""
        return Circles.of(self.plan).radius

    @cached_property
    def extremes(self) -> tuple[Extreme, ...]:
        """The cases that govern, of those with success."""
        if not self.success.any():
            return ()
        largest = {
            "largest_pressure": self.largest_pressure,
            "largest_settlement": self.deflections[:, 1],
            "deflection_difference": np.ptp(self.deflections, axis=1),
        }
        least = {"contact_share": self.contact_share}
        return extremes_of(self.names, self.success, largest, least)

    @property
    def governing(self) -> int:
        """The case with the largest pressure among those with success, else the first."""
        return int(np.argmax(np.where(self.success, self.largest_pressure, -np.inf)))

    @property
    def deformation(self) -> float:
        """Largest deflection over the extent of the plan."""
        return float(np.abs(self.deflections).max()) / self.standing.size

    def table(self) -> list[dict[str, Any]]:
        """A row for each case, for programs, numbers in the units that went in; with the columns
        `COUPLE` where cases have moments without a force."""
        x, y = self.acting_points
        columns = {
            "name": self.names,
            "force": [plan.force for plan in self.standings],
            "x": x,
            "y": y,
            "least_deflection": self.deflections[:, 0],
            "largest_deflection": self.deflections[:, 1],
            "mean_settlement": self.mean_settlement,
            "largest_pressure": self.largest_pressure,
            "contact_share": self.contact_share,
            "success": self.success,
            "message": self.messages,
            **(dict(zip(COUPLE, self.couples, strict=True)) if self.has_couples else {}),
        }
        values = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
        return [dict(zip(columns, row, strict=True)) for row in values]

    @property
    def standing(self) -> LoadedPlan:
        """Plan and resultant of the governing case."""
        return self.standings[self.governing]


def structure_table(body: Structure, mesh_name: str) -> Html:
    """What it is."""
    rows = input_rows(body.standing.solution, body.standing, mesh_name, body.plate)
    return table(rows, (f"Structure {body.name}".rstrip(), "", "Unit"))


def deflections_section(body: Structure) -> Html:
    """Forces, deflections and contact in each case, points over all cases."""
    units, size = body.details.units, body.standing.size
    sink = units.displacement
    head = ["Case", f"Force of the ground [{units.force.symbol}]"]
    head += [f"acting at [{units.length.symbol}]"]
    head += [f"{m} [{units.moment.symbol}]" for m in COUPLE if body.has_couples]
    head += [f"{which} deflection [{sink.symbol}]" for which in ("Least", "Largest")]
    head += [f"Largest gap [{sink.symbol}]", "In contact"]
    rows = [
        (
            name if plan.solution.success else f"{name} (NO SOLUTION)",
            amount(plan.force, units.force),
            placed(at, size),
            *(amount(moment, units.moment) for moment in couple if body.has_couples),
            amount(least, sink, 4),
            amount(most, sink, 4),
            amount(gap, sink, 4),
            percent(share),
        )
        for name, plan, at, couple, (least, most), gap, share in zip(
            body.names,
            body.standings,
            body.acting_points.T,
            body.couples.T,
            body.deflections,
            body.largest_gap,
            body.contact_share,
            strict=True,
        )
    ]
    rows += unsolved_rows(body, head)
    return section(
        titled("Results", body.name),
        table(rows, head, "", numeric=True),
        NONE if not body.success.any() else _points(body),
    )


def _points(body: Structure) -> Html:
    """Deflections of corners, and of the points wanted on it, over all cases."""
    plan, units = body.standing, body.details.units
    sink, good = units.displacement, np.nonzero(body.success)[0]
    rows = [
        (
            name,
            *(coordinate(c, plan.size) for c in point),
            amount(values.min(), sink),
            amount(values.max(), sink),
            body.names[good[int(np.argmax(values))]],
        )
        for (name, point), values in zip(
            body.points.items(), body.settlements[good].T, strict=True
        )
    ]
    head = ["Point", *axes_of(units), f"Least [{sink.symbol}]", f"Largest [{sink.symbol}]", "Case"]
    return table(rows, head, "Deflections of corners and points over all cases", numeric=True)


def pictures_section(body: Structure, called: Mapping[str, str]) -> Html:
    """The mesh, deflections and isobars of the cases that govern."""
    parts = [mesh_figure(body.standing.solution, body.standing)]
    numbers: dict[int, list[str]] = {}
    for extreme in body.extremes:
        if extreme.quantity == "contact_share" and extreme.value >= 1:
            continue  # that of any case
        numbers.setdefault(extreme.number, []).append(called[extreme.quantity].lower())
    for k, what in (numbers or {0: []}).items():
        plan = body.standings[k]
        governs = f", which governs {listed(what)}" if what else ""
        why = f"Case {body.names[k]}{governs}: {in_words(plan)}. "
        parts.append(deflection_figure(plan.solution, plan, why))
        parts.append(isobars_figure(plan.solution, plan, why))
    head = "Deflections and pressure of the governing cases"
    return section(titled(head, body.name), *parts)


def depth_of_structure(body: Structure) -> Html:
    """In its governing case."""
    name = body.names[body.governing]
    return depth_section(body.standing.solution, body.details, body.name, name)
