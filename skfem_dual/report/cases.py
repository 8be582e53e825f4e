"""Several load cases or footings, as sections of a report."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..ground.substrates import Substrate
from .bearing import bearing_of_footings, points_section
from .checks import error_section, solver_section
from .depth import depth_of_footing
from .figures import mesh_picture
from .footing import Between, Footing, between
from .input import edge_rule, extent_rows, ground_table, said_of, signs_of_moments
from .numbers import Standing
from .page import (
    DASH,
    NONE,
    Html,
    amount,
    figure,
    joined,
    notice,
    one_to,
    paragraph,
    percent,
    place,
    section,
    short_list,
    symbol,
    table,
)
from .results import in_words, isobars_figure, plan_figure, read
from .sliding import sliding_section

#: quantities of the envelope as engineers call them
CALLED = {
    "largest_pressure": "Largest pressure",
    "largest_settlement": "Largest settlement",
    "slope": "Largest tilt",
    "contact_share": "Least part in contact",
}


def cases_sections(footings: Sequence[Footing], mesh_name: str, version: str) -> list[Html]:
    """All of a report but its head."""
    pairs = between(list(footings))
    parts = [_notices(footings), _in_short(footings, pairs), _input(footings, mesh_name)]
    parts += [_results(footing) for footing in footings]
    parts += [_envelope(footings), bearing_of_footings(footings), points_section(footings, pairs)]
    parts += [_pictures(footing) for footing in footings]
    parts += [sliding_section(footing) for footing in footings]
    parts += [depth_of_footing(footing) for footing in footings]
    first = footings[0]
    for each in footings:
        if each.standing is not None:
            case = each.cases.names[each.governing]
            parts.append(error_section(each.standing, each.accuracy, case, each.name))
    if first.standing is not None:
        units = first.details.units
        parts.append(solver_section(first.standing.solution, version, units))
    return parts


def _notices(footings: Sequence[Footing]) -> Html:
    notices = []
    for footing in footings:
        cases = footing.cases
        for k in np.nonzero(~cases.success)[0]:
            heading = f"NO SOLUTION in the case {footing.called(cases.names[k])}"
            notices.append(notice("fault", heading, f"{cases.messages[k]}."))
    for remark in dict.fromkeys(footings[0].details.remarks):
        if not any(remark in message for f in footings for message in f.cases.messages):
            notices.append(notice("caution", "Caution", remark))
    return joined(notices)


def _in_short(footings: Sequence[Footing], pairs: Sequence[Between]) -> Html:
    """The envelope of all footings."""
    items: list[tuple[str, Any]] = []
    for quantity, called in CALLED.items():
        found = [
            (e.value, f.called(e.name), f)
            for f in footings
            if f.cases.success.any()
            for e in f.cases.envelope()
            if e.quantity == quantity
        ]
        if found:
            pick = min if quantity == "contact_share" else max
            value, where, footing = pick(found, key=lambda item: item[0])
            items.append((f"{called}: {where}", _value(quantity, value, footing)))
    if footings[0].details.allowable is not None:
        used = np.nanmax([np.nanmax(footing.utilisation) for footing in footings])
        items.append(("Largest pressure / allowable", percent(used)))
    if pairs:
        worst = max(pairs, key=lambda pair: pair.distortion)
        items.append(("Angular distortion between footings", one_to(worst.distortion)))
    solved = sum(int(footing.cases.success.sum()) for footing in footings)
    total = sum(len(footing.cases) for footing in footings)
    items.append(("Cases with a solution", f"{solved} of {total}"))
    return short_list(items)


def _value(quantity: str, value: float, footing: Footing) -> Html:
    units = footing.details.units
    if quantity == "contact_share":
        return percent(value)
    if quantity == "slope":
        return read(value, units.slope)
    pressure = quantity == "largest_pressure"
    return read(value, units.pressure if pressure else units.displacement)


def _input(footings: Sequence[Footing], mesh_name: str) -> Html:
    units = footings[0].details.units
    parts: list[Html] = []
    for footing in footings:
        standing = footing.standing
        if standing is None:
            continue
        punch = standing.solution.punch
        rows: list[tuple] = [
            ("Mesh", footing.name or mesh_name, NONE),
            ("Cells with a pressure each", punch.grid_description, NONE),
            ("Pressure inside the cells", edge_rule(punch), NONE),
            *extent_rows(standing),
            (
                "Origin of settlement and moments",
                place(punch.origin, standing.size),
                symbol(units.length),
            ),
        ]
        parts.append(table(rows, (f"Footing {footing.name}".rstrip(), "", "Unit")))
    cases = [_loads(footing) for footing in footings]
    substrate: Substrate = footings[0].cases.footprint.substrate
    parts += [*cases, signs_of_moments(), ground_table(substrate, units)]
    said = "Forces, pressures and settlements are positive into the ground."
    parts.append(paragraph(said_of(units), said))
    return section("Input", *parts)


def _loads(footing: Footing) -> Html:
    cases, units = footing.cases, footing.details.units
    size = 1.0 if footing.standing is None else footing.standing.size
    rows = []
    for name, load in zip(cases.names, cases.loads):
        force = DASH if load.force is None else amount(load.force, units.force)
        m1, m2 = load.moments or (0.0, 0.0)
        at = np.array(load.at or (0.0, 0.0)) + cases.footprint.origin
        where = joined([place(at, size)]) if load.tilt is None else DASH
        moments = (amount(m, units.moment) if m else "0" for m in (m2, -m1))
        rows.append((name, force, where, *moments))
    head = ["Case", f"Force [{units.force.symbol}]", f"acting at [{units.length.symbol}]"]
    head += [f"M{axis} [{units.moment.symbol}]" for axis in "xy"]
    return table(rows, head, f"Load cases {footing.name}".rstrip(), numeric=True)


def _results(footing: Footing) -> Html:
    cases, units = footing.cases, footing.details.units
    sink, slope, pressure = units.displacement, units.slope, units.pressure
    head = [
        "Case",
        f"Settlement of the origin [{sink.symbol}]",
        f"Lx [{slope.symbol}]",
        f"Ly [{slope.symbol}]",
        f"Largest settlement [{sink.symbol}]",
        f"Largest pressure [{pressure.symbol}]",
        "In contact",
    ]
    kern = bool(np.isfinite(footing.kern_use).any())
    head += ["Kern used"] if kern else []
    rows = [
        (
            cases.names[k] if cases.success[k] else f"{cases.names[k]} (NO SOLUTION)",
            amount(cases.settlement[k], sink, 4),
            *(amount(tilt, slope, 4) for tilt in cases.tilt[:, k]),
            amount(cases.largest_settlement[k], sink, 4),
            amount(cases.largest_pressure[k], pressure, 4),
            percent(cases.contact_share[k]),
            *([percent(footing.kern_use[k])] if kern else []),
        )
        for k in range(len(cases))
    ]
    return section(
        f"Results{', ' if footing.name else ''}{footing.name}",
        table(rows, head, "", numeric=True),
        paragraph(
            "The base settles by W0 + Lx x + Ly y, with x and y from the origin.",
            " Kern used is the distance of the resultant from the centroid over that of the "
            "kern's edge: up to 100 % the whole base keeps contact."
            if kern
            else "",
        ),
    )


def _envelope(footings: Sequence[Footing]) -> Html:
    rows = []
    for footing in footings:
        if not footing.cases.success.any():
            continue
        for extreme in footing.cases.envelope():
            value = _value(extreme.quantity, extreme.value, footing)
            rows.append((footing.called(CALLED[extreme.quantity]), value, extreme.name))
    return section(
        "Envelope", table(rows, ("Quantity", "Value", "Governing case"), "", numeric=True)
    )


def _pictures(footing: Footing) -> Html:
    """Mesh and plan, and isobars of the cases that govern."""
    standing, cases = footing.standing, footing.cases
    if standing is None:
        return NONE
    caption = "Mesh of the plan" + (" and its dual grid." if standing.dual is not None else ".")
    parts = [
        figure(mesh_picture(standing.solution, standing), caption, caption),
        plan_figure(standing, "The plan with its corners"),
    ]
    numbers = {footing.governing: ["the largest pressure"]} if not cases.success.any() else {}
    for extreme in cases.envelope() if cases.success.any() else ():
        if extreme.quantity == "contact_share" and extreme.value >= 1:
            continue  # that of any case
        numbers.setdefault(extreme.number, []).append(CALLED[extreme.quantity].lower())
    for k, what in numbers.items():
        solution = cases.solutions[k]
        if solution is None:
            continue
        shown = Standing(solution, footing.details.units)
        why = f"Case {cases.names[k]}, which governs {' and '.join(what)}: {in_words(shown)}. "
        parts.append(isobars_figure(solution, shown, why))
    return section(
        f"Pressure of the governing cases{', ' if footing.name else ''}{footing.name}", *parts
    )
