"""Footings under their load cases, alone or beside structures, as sections of a report."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..contact.load import Share
from ..messages import listed
from ..solutions.cases_solution import COUPLE
from ..units import Units
from .footing import Footing, unsolved_rows
from .input import edge_rule, extent_rows, mesh_figure
from .numbers import Standing
from .page import (
    DASH,
    NONE,
    Html,
    amount,
    coordinate,
    joined,
    number,
    paragraph,
    percent,
    placed,
    section,
    symbol,
    table,
    titled,
)
from .results import in_words, isobars_figure, plan_figure


def footing_table(name: str, standing: Standing, mesh_name: str, units: Units) -> Html:
    """Mesh, cells and extent of a footing."""
    punch = standing.solution.punch
    rows: list[tuple] = [
        ("Mesh", name or mesh_name, NONE),
        ("Cells with a pressure each", punch.grid_description, NONE),
        ("Pressure inside the cells", edge_rule(punch), NONE),
        *extent_rows(standing),
        (
            "Origin of settlement and moments",
            placed(punch.origin, standing.size),
            symbol(units.length),
        ),
    ]
    return table(rows, (f"Footing {name}".rstrip(), "", "Unit"))


def loads_table(footing: Footing) -> Html:
    """What acts on a footing in each case."""
    cases, units = footing.cases, footing.details.units
    size = 1.0 if footing.standing is None else footing.standing.size
    rows = []
    note, origin = NONE, np.array(cases.footprint.origin)
    for name, load in zip(cases.names, cases.loads):
        if isinstance(load, Share):
            note = paragraph(
                f"These are loads of {listed(load.names)} together, of which this footing takes "
                "what is found."
                if len(load.names) > 1
                else "The frame takes part of these loads."
            )
            origin, load = np.array(load.origin), load.body
        force = DASH if load.force is None else amount(load.force, units.force)
        m1, m2 = load.moments or (0.0, 0.0)
        at = np.array(load.at or (0.0, 0.0)) + origin
        where = joined([placed(at, size)]) if load.tilt is None else DASH
        moments = (amount(m, units.moment) if m else "0" for m in (m2, -m1))
        moved = [DASH if load.settlement is None else amount(load.settlement, units.displacement)]
        tilted = [DASH] * 2 if load.tilt is None else [amount(t, units.slope) for t in load.tilt]
        rows.append((name, force, where, *moments, *moved, *tilted))
    head = ["Case", f"Force [{units.force.symbol}]", f"acting at [{units.length.symbol}]"]
    head += [f"M{axis} [{units.moment.symbol}]" for axis in "xy"]
    motions = [f"W0 [{units.displacement.symbol}]"]
    motions += [f"L{axis} [{units.slope.symbol}]" for axis in "xy"]
    if all(cell == DASH for row in rows for cell in row[len(head) :]):
        rows, motions = [row[: len(head)] for row in rows], []
    head += motions
    return joined([table(rows, head, f"Load cases {footing.name}".rstrip(), numeric=True), note])


def results_section(footing: Footing) -> Html:
    """Where a footing goes in each case, and how it presses."""
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
            _shown(footing, k),
            amount(cases.settlement[k], sink, 4),
            *(amount(tilt, slope, 4) for tilt in footing.tilts[:, k]),
            amount(cases.largest_settlement[k], sink, 4),
            amount(cases.largest_pressure[k], pressure, 4),
            percent(cases.contact_share[k]),
            *([percent(footing.kern_use[k])] if kern else []),
        )
        for k in range(len(cases))
    ]
    rows += unsolved_rows(footing, head)
    return section(
        titled("Results", footing.name),
        table(rows, head, "", numeric=True),
        paragraph(
            "The base settles by W0 + Lx x + Ly y, with x and y from the origin.",
            " Kern used is the distance of the resultant from the centroid over that of the "
            "kern's edge: up to 100 % the whole base keeps contact."
            if kern
            else "",
        ),
    )


def resultants_section(footings: Sequence[Footing]) -> Html:
    """Where they act in each case, and how far that is from trouble."""
    units, cases = footings[0].details.units, [footing.cases for footing in footings]
    length = units.length.symbol
    turned = any(case.couple[:, case.success].any() for case in cases)
    kern = any((~np.isnan(footing.lift_off_reserve)).any() for footing in footings)
    head = ["Case", f"The resultant acts at [{length}]", *(f"e{c} [{length}]" for c in "xy")]
    head += [f"{m} [{units.moment.symbol}]" for m in COUPLE if turned]
    head += [f"Distance to the edge of the convex hull [{length}]"]
    head += ["Reserve against lifting off"] if kern else []
    head += ["Reserve against overturning"]
    rows = []
    for footing in footings:
        size = float(np.ptp(footing.hull, axis=1).max())
        acting = footing.cases.point
        eccentric = acting - np.array(footing.plan.origin)[:, None]
        reserves = [footing.lift_off_reserve] if kern else []
        reserves += [footing.overturning_reserve]
        rows += [
            (
                footing.called(_shown(footing, k)),
                placed(acting[:, k], size),
                *(coordinate(e, size) for e in eccentric[:, k]),
                *(amount(m, units.moment) for m in footing.cases.couple[:, k] if turned),
                number(footing.edge_distance[k]),
                *("∞" if reserve[k] == np.inf else number(reserve[k], 3) for reserve in reserves),
            )
            for k in range(len(footing.names))
        ]
    lifting = "leaves the kern (1 or more: whole base in contact) or " if kern else ""
    return section(
        "Resultants",
        table(rows, head, "", numeric=True),
        paragraph(
            "ex and ey are the eccentricities from the origin. The reserves tell how many times "
            "the distance of the resultant from the centroid of the plan may grow, under the "
            f"same force, until it {lifting}reaches the edge of the convex hull of the plan (1: "
            "it turns over); ∞ where it acts in the centroid.",
            " mx and my are moments without a force, which act in no point." if turned else "",
        ),
    )


def pictures_of_footing(footing: Footing, called: Mapping[str, str]) -> Html:
    """Mesh and plan, and isobars of the cases that govern."""
    standing = footing.standing
    if standing is None:
        return NONE
    parts = [
        mesh_figure(standing.solution, standing),
        plan_figure(standing, "The plan with its corners", footing.wanted),
    ]
    numbers: dict[int, list[str]] = {}
    for extreme in footing.extremes:
        if extreme.quantity == "contact_share" and extreme.value >= 1:
            continue  # that of any case
        numbers.setdefault(extreme.number, []).append(called[extreme.quantity].lower())
    for k, what in (numbers or {footing.governing: []}).items():
        if (shown := footing.standings[k]) is None:
            continue
        governs = f", which governs {listed(what)}" if what else ""
        why = f"Case {footing.names[k]}{governs}: {in_words(shown)}. "
        parts.append(isobars_figure(shown.solution, shown, why))
    return section(titled("Pressure of the governing cases", footing.name), *parts)


def _shown(footing: Footing, k: int) -> str:
    """The name of a case, and whether it lacks a solution."""
    return f"{footing.names[k]}{'' if footing.success[k] else ' (NO SOLUTION)'}"
