"""Position, pressures and stability of a punch, as sections of a report."""

from collections.abc import Mapping
from string import ascii_uppercase

import numpy as np
from numpy import ndarray

from ..errors import ConvergenceError
from ..solutions.bearing import bearing_pressure
from ..solutions.pressures import CellPressures
from ..solutions.punch_solution import PunchSolution
from ..units import Unit, Units
from .figures import isobar_picture, plan_picture
from .numbers import LoadedPlan, Standing
from .page import (
    NONE,
    Html,
    amount,
    coordinate,
    figure,
    joined,
    number,
    one_to,
    paragraph,
    percent,
    placed,
    section,
    short_list,
    small,
    symbol,
    table,
)

#: what is said of where the force acts: in a point, or on every period
RESERVES = (
    "While the resultant acts within the kern, the whole of a flat base keeps contact. The "
    "reserves tell how many times the distance of the resultant from the centroid of the plan may "
    "grow, under the same force, until it leaves the kern or the convex hull of the plan. The "
    "ground is elastic here: its bearing capacity is not checked, and it yields before a punch "
    "turns over."
)
GUIDED = "A punch whose pressures repeat is guided: it neither tilts nor turns over."


def in_short(solution: PunchSolution, standing: Standing) -> Html:
    """The figures one looks for first."""
    slope, units = float(np.hypot(*solution.tilt)), standing.units
    return short_list(
        [
            ("Settlement of the origin", read(solution.settlement, units.displacement)),
            ("Tilt", one_to(slope, standing.is_level(slope))),
            ("Resultant force", read(standing.force, units.force)),
            ("In contact", percent(1 - standing.lifted_share)),
            ("Contact", in_words(standing) if solution.success else "NOT CONVERGED"),
        ]
    )


def position_section(solution: PunchSolution, standing: Standing) -> Html:
    """Settlement, tilts, settlements of the corners."""
    w = standing.settlement_of_hull
    (lx, ly), hull = solution.tilt, standing.hull
    slope = float(np.hypot(lx, ly))
    least, most = int(np.argmin(w)), int(np.argmax(w))
    centre = float(solution.punch_displacement(solution.punch.centre[:, None])[0])
    sink, tilted = standing.units.displacement, symbol(standing.units.slope)
    rows: list[tuple] = [
        ("Settlement W0 of the origin", amount(solution.settlement, sink), symbol(sink)),
        ("Settlement of the centroid of the plan", amount(centre, sink), symbol(sink)),
        ("Tilt Lx, along x", _slope(lx, standing), tilted),
        ("Tilt Ly, along y", _slope(ly, standing), tilted),
        ("Tilt in all", _slope(slope, standing), tilted),
    ]
    if not standing.is_level(slope):
        azimuth = float(np.degrees(np.arctan2(ly, lx)).round(3))
        note = small("from the x axis, anticlockwise")
        rows.append((joined(["Direction in which it goes down", note]), number(azimuth, 4), "°"))
    rows += [
        ("Largest settlement", value_at(w[most], hull[:, most], standing), symbol(sink)),
        ("Smallest settlement", value_at(w[least], hull[:, least], standing), symbol(sink)),
        ("Difference of both", amount(w[most] - w[least], sink), symbol(sink)),
    ]
    names = point_names(standing)
    settled = solution.punch_displacement(standing.points)
    corners = [
        (name, coordinate(x, standing.size), coordinate(y, standing.size), amount(s, sink))
        for name, x, y, s in zip(names, *standing.points, settled)
    ]
    return section(
        "Settlement and tilt",
        table(rows, ("Position of the punch", "", "Unit")),
        table(
            corners,
            ("Point", *axes_of(standing.units), f"Settlement [{sink.symbol}]"),
            "Settlements at the corners and extremes of the plan",
            numeric=True,
        ),
        paragraph(
            "The punch is rigid: it settles by W0 + Lx x + Ly y, with x and y from the origin."
        ),
    )


def point_names(plan: LoadedPlan) -> list[str]:
    """A, B, C and so on, after Z a second A1, for the characteristic points; P1 is one wanted."""
    letters = ascii_uppercase.replace("P", "")
    return [
        letters[i % 25] + (str(i // 25) if i >= 25 else "") for i in range(plan.points.shape[1])
    ]


def wanted_names(points: ndarray) -> list[str]:
    """P1, P2 and so on, for the points (2, n) that are wanted."""
    return [f"P{i + 1}" for i in range(points.shape[1])]


def axes_of(units: Units) -> tuple[str, str]:
    """Heads of columns of coordinates."""
    return f"x [{units.length.symbol}]", f"y [{units.length.symbol}]"


def read(value: float, unit: Unit) -> Html:
    """A number with its unit, if that has a name."""
    named = unit.symbol[0] not in "FL"
    return joined([amount(value, unit), symbol(unit)], " ") if named else amount(value, unit)


def value_at(value: float, x: ndarray, plan: LoadedPlan) -> Html:
    """A settlement and its place."""
    return joined([amount(value, plan.units.displacement), " at ", placed(x, plan.size)])


def in_words(plan: LoadedPlan) -> str:
    """The contact as engineers say it."""
    if plan.pulled_area > 0:
        return "whole base held down: the ground pulls"
    if plan.lifted_share == 0:
        return "whole base in contact"
    return "the base lifts off" if plan.lifted_share < 1 else "no contact"


def _slope(slope: float, standing: Standing) -> Html:
    tilted = amount(slope, standing.units.slope)
    return joined([tilted, one_to(slope, standing.is_level(slope))], "<br>")


def pressure_section(solution: CellPressures, plan: LoadedPlan) -> Html:
    """Contact and pressures, with isobars."""
    punch, p = solution.punch, solution.pressure
    most, least = int(np.argmax(p)), int(np.argmin(p))
    places = punch.partition.centroids
    sharp = punch.sharp_edge
    away = bearing_pressure(solution)
    unit, length = plan.units.pressure, symbol(plan.units.length)
    rows: list[tuple] = [
        ("Contact", joined([in_words(plan), small(solution.message)]), NONE),
        ("Contact area", number(solution.contact_area), symbol(plan.units.area)),
        ("of the area of the plan", percent(1 - plan.lifted_share), NONE),
        ("Mean pressure on the contact area", amount(solution.mean_pressure, unit), symbol(unit)),
        ("Largest mean pressure on a circle", amount(away, unit), symbol(unit)),
        ("Largest mean pressure of a cell", amount(p[most], unit), symbol(unit)),
        ("in the cell around", placed(places[:, most], plan.size), length),
        ("Smallest mean pressure of a cell", amount(p[least], unit), symbol(unit)),
    ]
    if punch.weights is not None:
        edge = solution.edge_coefficient()
        k = int(np.argmax(edge.values))
        strength = amount(edge.values[k], plan.units.strength)
        there = joined([strength, " at ", placed(edge.x[:, k], plan.size)])
        rows.append(("Largest strength at the edge", there, symbol(plan.units.strength)))
    notes = []
    if sharp:
        notes.append(
            "Under a sharp edge the pressure is unbounded: the means of the cells there, "
            "and so the largest of them, grow as the mesh is refined and are no figures to "
            "design by. "
        )
    if punch.weights is not None:
        notes.append(
            "The strength at the edge is the limit of the pressure times the square root of the "
            "distance to it; away from corners it does not depend on the mesh."
        )
    return section(
        "Contact and pressure",
        table(rows, ("Pressure", "", "Unit")),
        paragraph(*notes) if notes else NONE,
        isobars_figure(solution, plan),
    )


def isobars_figure(solution: CellPressures, plan: LoadedPlan, why: str = "") -> Html:
    """Isobars, or why there are none; ``why`` begins the caption."""
    try:
        picture, quantity = isobar_picture(solution, plan)
    except (ValueError, ConvergenceError) as error:  # no pressure, or the same everywhere
        return paragraph(f"No isobars: {error}.")
    caption = f"{why}Isobars of {quantity}"
    if solution.contact_region.edge:
        caption += " and the edge of contact; there is no contact where it is grey"
    return figure(picture, f"Isobars of {quantity} on the plan", caption + ".")


def standing_section(standing: Standing, wanted: Mapping[str, ndarray]) -> Html:
    """Kern and overturning."""
    point, rows = standing.force_point, list[tuple]()
    if standing.repeats:
        rows.append(("Resultant", "repeats with the period, and acts in no one point", NONE))
    elif point is None:
        rows.append(("Resultant", "no force into the ground that would act in a point", NONE))
    else:
        rows.append(
            ("The resultant acts at", placed(point, standing.size), symbol(standing.units.length))
        )
    if standing.kern is None:
        rows.append(("Kern", standing.no_kern, NONE))
    elif point is not None:
        rows.append(("Within the kern", _within(standing), NONE))
    rows.append(("Part of the plan out of contact", percent(standing.lifted_share), NONE))
    if point is not None:
        rows += [
            (
                "Distance to the edge of the convex hull",
                number(standing.edge_distance),
                symbol(standing.units.length),
            ),
            (
                joined(["Reserve against lifting off", small("1 or more: whole base in contact")]),
                _reserve(standing.lift_off_reserve),
                NONE,
            ),
            (
                joined(["Utilisation of the kern", small("distance over that of its edge")]),
                _used(standing.lift_off_reserve),
                NONE,
            ),
            (
                joined(["Reserve against overturning", small("1: it turns over")]),
                _reserve(standing.overturning_reserve),
                NONE,
            ),
        ]
    return section(
        "Kern and overturning",
        table(rows, ("Where the force acts", "", "Unit")),
        paragraph(GUIDED if standing.repeats else RESERVES),
        plan_figure(
            standing, "The plan with its kern and the point where the resultant acts", wanted
        ),
    )


def plan_figure(standing: Standing, alt: str, wanted: Mapping[str, ndarray]) -> Html:
    """The plan with the points whose settlements are told, corners and those wanted."""
    caption = "The plan with the points of the table of settlements"
    picture = plan_picture(standing, point_names(standing), wanted)
    return figure(picture, alt, caption, "." if standing.kern is None else " and its kern.")


def _within(standing: Standing) -> str:
    if standing.within_kern:
        return "yes: whole base in contact"
    if standing.pulled_area > 0:
        return "no: the ground has to pull, or the punch would lift off"
    if standing.lifted_share == 0:
        return "no: the punch lifts off, by less than the cells resolve"
    return "no: the punch lifts off"


def _used(factor: float) -> Html | str:
    return percent(1 / factor if factor > 0 else np.nan)


def _reserve(factor: float) -> Html | str:
    return "the force acts in the centroid" if factor == np.inf else number(factor, 3)
