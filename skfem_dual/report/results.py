"""Position, pressures and stability of a punch, as sections of a report."""

from string import ascii_uppercase

import numpy as np
from numpy import ndarray

from ..contact.pressures import CellPressures
from ..contact.solution import PunchSolution
from .figures import isobar_picture, plan_picture
from .numbers import Plan, Standing
from .page import (
    NONE,
    Html,
    L,
    P,
    coordinate,
    figure,
    joined,
    number,
    one_to,
    paragraph,
    percent,
    place,
    section,
    short_list,
    small,
    table,
)


def in_short(solution: PunchSolution, standing: Standing) -> Html:
    """The figures one looks for first."""
    slope = float(np.hypot(*solution.tilt))
    return short_list(
        [
            ("Settlement of the origin", number(solution.settlement)),
            ("Tilt", one_to(slope, standing.is_level(slope))),
            ("Resultant force", number(standing.force)),
            ("In contact", percent(solution.contact_area / standing.plan_area)),
            ("Contact", "found" if solution.success else "NOT CONVERGED"),
        ]
    )


def position_section(solution: PunchSolution, standing: Standing) -> Html:
    """Settlement, tilts, settlements of the corners."""
    w = standing.settlement_of_hull
    (lx, ly), hull = solution.tilt, standing.hull
    slope = float(np.hypot(lx, ly))
    least, most = int(np.argmin(w)), int(np.argmax(w))
    centre = float(solution.punch_displacement(solution.punch.centre[:, None])[0])
    rows: list[tuple] = [
        ("Settlement W0 of the origin", number(solution.settlement), L),
        ("Settlement of the centroid of the plan", number(centre), L),
        ("Tilt Lx, along x", _slope(lx, standing), Html("rad")),
        ("Tilt Ly, along y", _slope(ly, standing), Html("rad")),
        ("Tilt in all", _slope(slope, standing), Html("rad")),
    ]
    if not standing.is_level(slope):
        azimuth = float(np.degrees(np.arctan2(ly, lx)).round(3))
        note = small("from the x axis, anticlockwise")
        rows.append((joined(["Direction in which it goes down", note]), number(azimuth, 4), "°"))
    rows += [
        ("Largest settlement", value_at(w[most], hull[:, most], standing), L),
        ("Smallest settlement", value_at(w[least], hull[:, least], standing), L),
        ("Difference of both", number(w[most] - w[least]), L),
    ]
    names = point_names(standing)
    settled = solution.punch_displacement(standing.points)
    corners = [
        (name, coordinate(x, standing.size), coordinate(y, standing.size), number(s))
        for name, x, y, s in zip(names, *standing.points, settled)
    ]
    return section(
        "Settlement and tilt",
        table(rows, ("Position of the punch", "", "Unit")),
        table(
            corners,
            ("Point", "x [L]", "y [L]", "Settlement [L]"),
            "Settlements at the corners and extremes of the plan",
            numeric=True,
        ),
        paragraph(
            "The punch is rigid: it settles by W0 + Lx x + Ly y, with x and y from the origin."
        ),
    )


def point_names(plan: Plan) -> list[str]:
    """A, B, C and so on, for the characteristic points."""
    return list(ascii_uppercase[: plan.points.shape[1]])


def value_at(value: float, x: ndarray, plan: Plan) -> Html:
    """A value and its place."""
    return joined([number(value), " at ", place(x, plan.size)])


def _slope(slope: float, standing: Standing) -> Html:
    return joined([number(slope), Html("<br>"), one_to(slope, standing.is_level(slope))])


def pressure_section(solution: CellPressures, plan: Plan) -> Html:
    """Contact and pressures, with isobars."""
    punch, p = solution.punch, solution.pressure
    most, least = int(np.argmax(p)), int(np.argmin(p))
    places = punch.partition.centroids
    sharp = punch.gap is None or punch.edge == "singular"
    mean = solution.mean_pressure if plan.force else 0.0
    rows: list[tuple] = [
        ("Contact", solution.message, NONE),
        ("Contact area", number(solution.contact_area), Html("L²")),
        ("of the area of the plan", percent(solution.contact_area / plan.plan_area), NONE),
        ("Mean pressure on the contact area", number(mean), P),
        ("Largest mean pressure of a cell", number(p[most]), P),
        ("in the cell around", place(places[:, most], plan.size), L),
        ("Smallest mean pressure of a cell", number(p[least]), P),
    ]
    if punch.weights is not None:
        edge = solution.edge_coefficient()
        k = int(np.argmax(edge.values))
        there = value_at(edge.values[k], edge.x[:, k], plan)
        rows.append(("Largest strength at the edge", there, Html("F/L<sup>3/2</sup>")))
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
        _isobars(solution, plan),
    )


def _isobars(solution: CellPressures, plan: Plan) -> Html:
    try:
        picture, quantity = isobar_picture(solution, plan)
    except ValueError as error:  # no pressure, or the same everywhere
        return paragraph(f"No isobars: {error}.")
    caption = f"Isobars of {quantity}"
    if solution.contact_region.edge:
        caption += " and the edge of contact; there is no contact where it is grey"
    return figure(picture, f"Isobars of {quantity} on the plan", caption + ".")


def standing_section(solution: PunchSolution, standing: Standing) -> Html:
    """Kern and overturning."""
    point, names = standing.force_point, point_names(standing)
    rows: list[tuple] = []
    if point is None:
        rows.append(("Resultant", "no force into the ground that would act in a point", NONE))
    else:
        rows.append(("The resultant acts at", place(point, standing.size), L))
    if standing.kern is None:
        rows.append(("Kern", standing.no_kern, NONE))
    elif point is not None:
        rows.append(("Within the kern", _within(standing), NONE))
    rows.append(("Part of the plan out of contact", percent(standing.lifted_share), NONE))
    if point is not None:
        rows += [
            ("Distance to the edge of the convex hull", number(standing.edge_distance), L),
            (
                joined(["Reserve against lifting off", small("1 or more: full contact")]),
                _reserve(standing.lift_off_reserve),
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
        paragraph(
            "While the resultant acts within the kern, a flat punch keeps full contact. The "
            "reserves tell how many times the distance of the resultant from the centroid of the "
            "plan may grow, under the same force, until it leaves the kern or the convex hull of "
            "the plan. The ground is elastic here: its bearing capacity is not checked, and it "
            "yields before a punch turns over."
        ),
        figure(
            plan_picture(standing, names),
            "The plan with its kern and the point where the resultant acts",
            "The plan with the points of the table of settlements",
            "." if standing.kern is None else " and its kern.",
        ),
    )


def _within(standing: Standing) -> str:
    if standing.within_kern:
        return "yes: full contact"
    if standing.pulled_area > 0:
        return "no: the ground has to pull, or the punch would lift off"
    if standing.lifted_share == 0:
        return "no: the punch lifts off, by less than the cells resolve"
    return "no: the punch lifts off"


def _reserve(factor: float) -> Html | str:
    return "the force acts in the centroid" if factor == np.inf else number(factor, 3)
