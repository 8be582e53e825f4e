"""Several load cases, footings or structures, as sections of a report."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .bearing import Borne, bearing_section, differences_section, points_section
from .bodies import ReportedBody, between
from .checks import (
    ROUNDING,
    Solved,
    cautions_of,
    cautions_of_bounds,
    error_section,
    pulled,
    solver_section,
)
from .depth import depth_of_footing
from .footing import Between, Footing
from .footings import (
    footing_table,
    loads_table,
    pictures_of_footing,
    resultants_section,
    results_section,
)
from .input import ground_table, said_of, signs_of_moments
from .numbers import Standing
from .page import (
    Html,
    aligned,
    alone,
    joined,
    notice,
    number,
    one_to,
    paragraph,
    percent,
    section,
    short_list,
    table,
)
from .results import read
from .sliding import sliding_section
from .structure import cautions_of as cautions_of_structure
from .structure import columns_table, imposed_on, moments_section
from .structures import (
    Structure,
    deflections_section,
    depth_of_structure,
    pictures_section,
    structure_table,
)

#: quantities of the envelope as engineers call them
CALLED = {
    "largest_pressure": "Largest pressure",
    "largest_settlement": "Largest settlement",
    "deflection_difference": "Largest difference of deflections",
    "slope": "Largest tilt",
    "contact_share": "Least part in contact",
}


def cases_sections(bodies: Sequence[ReportedBody], mesh_name: str, version: str) -> list[Html]:
    """All of a report but its head."""
    footings = [body for body in bodies if isinstance(body, Footing)]
    structures = [body for body in bodies if isinstance(body, Structure)]
    pairs = between(bodies)
    parts = [_notices(bodies), _in_short(bodies, pairs), _input(bodies, mesh_name)]
    parts += [
        results_section(body) if isinstance(body, Footing) else deflections_section(body)
        for body in bodies
    ]
    if footings:
        parts.append(resultants_section(footings))
    parts += [moments_section(s.plate, s.cases, s.details.units, s.name) for s in structures]
    parts += [_envelope(bodies), bearing_of_bodies(bodies)]
    if footings:
        parts.append(points_section(footings))
    parts.append(differences_section(pairs, bodies[0].details.units))
    parts += [
        pictures_of_footing(body, CALLED)
        if isinstance(body, Footing)
        else pictures_section(body, CALLED)
        for body in bodies
    ]
    parts += [sliding_section(footing) for footing in footings]
    parts += [
        depth_of_footing(body) if isinstance(body, Footing) else depth_of_structure(body)
        for body in bodies
    ]
    if structures:
        parts.append(_balance(bodies))
    for each in footings:
        if each.standing is not None:
            case = each.cases.names[each.governing]
            parts.append(error_section(each.standing, each.accuracy, case, each.name))
    solved = [
        Solved(
            body.standing.solution,
            body.name,
            body.names[body.governing] if len(body.names) > 1 else "",
        )
        for body in bodies
        if body.standing is not None
    ]
    if solved:
        parts.append(solver_section(solved, version, bodies[0].details.units))
    return parts


def bearing_of_bodies(bodies: Sequence[ReportedBody]) -> Html:
    """Of each footing and structure in each case."""
    borne = [
        Borne(body.called(name), mean, largest, success)
        for body in bodies
        for name, mean, largest, success in zip(
            body.names, body.mean_pressure, body.largest_pressure, body.success, strict=True
        )
    ]
    circles, details = [body.radius for body in bodies], bodies[0].details
    return bearing_section(borne, circles, details, repeats=bodies[0].repeats)


def _notices(bodies: Sequence[ReportedBody]) -> Html:
    shown: list[Html] = []
    told: list[str] = []
    for body in bodies:
        messages = body.messages
        told += messages
        for k in np.nonzero(~body.success)[0]:
            heading = f"NO SOLUTION in the case {body.called(body.names[k])}"
            shown.append(notice("fault", heading, f"{messages[k]}."))
        shown += _cautions(body)
    for name, why in bodies[0].details.unsolved.items():
        shown.append(notice("fault", f"NO SOLUTION in the case {name}", f"{why}."))
    for remark in dict.fromkeys(bodies[0].details.remarks):
        if not any(remark in message for message in told):
            shown.append(notice("caution", "Caution", remark))
    return joined(shown)


def _cautions(body: ReportedBody) -> list[Html]:
    """What a reader must know of cases that were found: the first, and how many others."""
    found: dict[str, list[tuple[str, tuple[Any, ...]]]] = {}
    for name, plan, ok in zip(body.names, body.standings, body.success, strict=True):
        if plan is None or not ok:
            continue
        if isinstance(plan, Standing):
            cautions = cautions_of(plan)
        else:
            cautions = cautions_of_structure(plan.solution, plan)
        for parts in (*pulled(plan), *cautions):
            found.setdefault(parts[0], []).append((body.called(name), parts))
    if isinstance(body, Footing) and body.standing is not None:
        governing = body.called(body.names[body.governing])
        for parts in cautions_of_bounds(body.standing):
            found.setdefault(parts[0], []).append((governing, parts))
    shown = []
    for (called, parts), *others in found.values():
        more = f" So in {len(others)} more cases." if len(others) > 1 else ""
        more = f" So in the case {others[0][0]}." if len(others) == 1 else more
        shown.append(notice("caution", "Caution", f"{called}: ", *parts, more))
    return shown


def _in_short(bodies: Sequence[ReportedBody], pairs: Sequence[Between]) -> Html:
    """The envelope of all bodies."""
    items: list[tuple[str, Any]] = []
    for quantity, called in CALLED.items():
        found = [
            (e.value, body.called(e.name), body)
            for body in bodies
            for e in body.extremes
            if e.quantity == quantity
        ]
        if found:
            pick = min if quantity == "contact_share" else max
            value, where, body = pick(found, key=lambda item: item[0])
            items.append((f"{called}: {where}", _value(quantity, value, body)))
    if bodies[0].details.allowable is not None:
        used = np.concatenate([body.utilisation.ravel() for body in bodies])
        if np.isfinite(used).any():
            items.append(("Largest pressure / allowable", percent(np.nanmax(used))))
    if pairs:
        worst = max(pairs, key=lambda pair: pair.distortion)
        items.append(
            (f"Angular distortion: {worst.first} – {worst.second}", one_to(worst.distortion))
        )
    solved = sum(int(body.success.sum()) for body in bodies)
    total = sum(len(body.names) + len(body.details.unsolved) for body in bodies)
    items.append(("Cases with a solution", f"{solved} of {total}"))
    return short_list(items)


def _value(quantity: str, value: float, body: ReportedBody) -> Html:
    units = body.details.units
    if quantity == "contact_share":
        return percent(value)
    if quantity == "slope":
        return read(value, units.slope)
    pressure = quantity == "largest_pressure"
    return read(value, units.pressure if pressure else units.displacement)


def _input(bodies: Sequence[ReportedBody], mesh_name: str) -> Html:
    units = bodies[0].details.units
    parts: list[Html] = []
    for body in bodies:
        if isinstance(body, Structure):
            parts.append(structure_table(body, body.name or mesh_name))
            parts.append(columns_table(body.name, body.columns, body.standing))
        elif body.standing is not None:
            parts.append(footing_table(body.name, body.standing, mesh_name, units))
    loads = [loads_table(body) for body in bodies if isinstance(body, Footing)]
    columns = [c for b in bodies if isinstance(b, Structure) for c in b.columns]
    turned = any(any(column.moments) for column in columns)
    parts += [*loads, signs_of_moments()] if loads or turned else []
    parts.append(ground_table(bodies[0].plan.substrate, units))
    said = "Forces, pressures and settlements are positive into the ground."
    parts.append(paragraph(said_of(units), said))
    return section("Input", *parts)


def _envelope(bodies: Sequence[ReportedBody]) -> Html:
    rows = []
    for body in bodies:
        for extreme in body.extremes:
            value = alone(_value(extreme.quantity, extreme.value, body))
            rows.append((body.called(CALLED[extreme.quantity]), value, extreme.name))
    return section(
        "Envelope", table(rows, ("Quantity", "Value", "Governing case"), "", numeric=True)
    )


def _balance(bodies: Sequence[ReportedBody]) -> Html:
    """Loads and pressures of each body in each case."""
    units, rows = bodies[0].details.units, []
    force, moment = units.force.symbol, units.moment.symbol
    names = f"force [{force}]", *(f"first moment along {axis} [{moment}]" for axis in "xy")
    for body in bodies:
        for name, plan in zip(body.names, body.standings, strict=True):
            if plan is None:
                continue
            resultant = plan.solution.resultant
            imposed = plan.imposed if isinstance(plan, Standing) else imposed_on(plan.solution)
            left = np.abs(resultant - imposed) / plan.scale
            for what, load, found, rest, noise in zip(
                names, imposed, resultant, left, ROUNDING * plan.scale, strict=True
            ):
                shown = [number(0.0 if abs(v) <= noise else v, 7) for v in (load, found)]
                pair = map(alone, aligned(shown))
                rows.append((f"{body.called(name)}: {what}", *pair, number(rest, 2)))
    return section(
        "Check of the resultants",
        table(rows, ("", "Of the loads", "Of the pressures", "Relative residual"), numeric=True),
        paragraph(
            "First moments are the integrals of p x and p y, with x and y from the origin of each "
            "body. Loads have a dash where what holds the body takes part of them."
        ),
    )
