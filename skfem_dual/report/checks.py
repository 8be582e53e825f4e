"""What tells how far a solution is to be trusted, as sections of a report."""

import platform
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy
import skfem

from ..contact.bounds import why_none
from ..contact.pressures import CellPressures
from ..contact.solution import PunchSolution
from ..post.estimate import CoupleEstimate, estimate_error
from ..units import Unit, Units
from .numbers import Standing
from .page import (
    DASH,
    NONE,
    Html,
    amount,
    escaped,
    joined,
    notice,
    number,
    paragraph,
    percent,
    section,
    small,
    symbol,
    table,
)

#: from these values on a reader is warned: settlement over the extent of the plan, difference of
#: both grids over the settlement, residual of the load over the load
DEFORMED, COARSE, UNBALANCED = 0.1, 0.02, 1e-6
#: residual of the load, over the load, that is only rounding
ROUNDING = 1e-12


def warnings_of(
    solution: PunchSolution,
    standing: Standing,
    couple: PunchSolution | None,
    remarks: Sequence[str],
) -> Html:
    """What a reader must know before the results."""
    notices = []
    if not solution.success:
        notices.append(
            notice(
                "fault",
                "NOT CONVERGED: do not use these results",
                f"The contact was not found: {solution.message}.",
            )
        )

    def caution(*parts: Any) -> None:
        notices.append(notice("caution", "Caution", *parts))

    if couple is not None and not couple.success:
        caution(f"The solution on the other grid did not converge: {couple.message}.")
    if standing.pulled_area > 0:
        share = percent(standing.pulled_area / standing.plan_area)
        caution("The ground would have to pull on ", share, " of the plan, which soil does not.")
    if standing.edge_distance < 0:
        caution("The resultant acts beyond the convex hull of the plan: the punch turns over.")
    deepest = np.abs(standing.settlement_of_hull).max() / standing.size
    if deepest > DEFORMED:
        share = percent(deepest)
        caution(
            "The largest settlement is ", share, " of the extent of the plan, far beyond small "
            "deformations. Check the units of load and moduli.",
        )  # fmt: skip
    if np.nan_to_num(standing.imbalance).max() > UNBALANCED:
        caution("The pressures do not balance the load, see the check of the resultant.")
    if couple is not None:
        what, scale = "settlements", np.abs(standing.settlement_of_hull).max()
        difference = abs(couple.settlement - solution.settlement)
        if solution.load.settlement is not None:
            what, scale = "forces", standing.load
            difference = abs(couple.force - solution.force)
        if difference > COARSE * scale:
            share = percent(difference / scale)
            caution(f"The {what} on both grids differ by ", share, ". Use a finer mesh.")
    told = {solution.message} | ({couple.message} if couple is not None else set())
    for remark in dict.fromkeys(remarks):
        if remark not in told:
            caution(remark)
    return joined(notices)


def resultant_section(solution: PunchSolution, standing: Standing) -> Html:
    """The load against the resultant of the pressures."""
    force, moment = standing.units.force.symbol, standing.units.moment.symbol
    names = f"Force [{force}]", *(f"First moment along {axis} [{moment}]" for axis in "xy")
    relative = standing.imbalance
    rows = [
        (
            name,
            "free" if np.isnan(imposed) else number(imposed, 7),
            # zero but for rounding where that is imposed
            number(found if imposed != 0 or relative[i] > ROUNDING else 0.0, 7),
            number(found - imposed, 2),
            number(relative[i], 2),
        )
        for i, (name, imposed, found) in enumerate(
            zip(names, standing.imposed, solution.resultant)
        )
    ]
    return section(
        "Check of the resultant",
        table(rows, ("", "Imposed", "Of the pressures", "Residual", "Relative"), numeric=True),
        paragraph(
            "First moments are the integrals of p x and p y, with x and y from the origin. "
            "Relative are residuals to the sum of all pressures, for moments times the square "
            "root of the area of the plan."
        ),
    )


def error_section(
    solution: PunchSolution, standing: Standing, couple: PunchSolution | None
) -> Html:
    """How far two solutions on dual grids are from each other."""
    title = "How far the numbers may be off"
    if couple is None:
        return section(
            title,
            paragraph("There is no solution on the other grid to compare with: not estimated."),
        )
    cells, triangles = (solution, couple) if standing.on_dual_cells else (couple, solution)
    estimate = estimate_error(cells, triangles)
    load, length, units = solution.load, np.sqrt(standing.plan_area), standing.units
    settled = np.abs(standing.settlement_of_hull).max()
    slope = float(np.hypot(*solution.tilt))
    sloping = slope * length > 1e-6 * settled

    def row(name: str, values: Sequence[float], scale: float, unit: Unit) -> tuple:
        off = abs(values[1] - values[0])
        share = percent(off / scale) if scale > 0 else DASH
        both = amount(values[0], unit, 6), amount(values[1], unit, 6)
        return f"{name} [{unit.symbol}]", *both, amount(off, unit, 2), share

    rows = []
    if load.settlement is None:
        pair_of = cells.settlement, triangles.settlement
        rows.append(row("Settlement W0", pair_of, abs(solution.settlement), units.displacement))
    else:
        forces = cells.force, triangles.force
        rows.append(row("Force", forces, abs(solution.force), units.force))
    for i, axis in enumerate("xy"):
        if load.tilt is None:
            tilts = cells.tilt[i], triangles.tilt[i]
            scale = slope if sloping else 0.0
            rows.append(row(f"Tilt L{axis}", tilts, scale, units.slope))
        else:
            moments = cells.resultant[1 + i], triangles.resultant[1 + i]
            scale = standing.load * length
            rows.append(row(f"First moment, {axis}", moments, scale, units.moment))
    areas = cells.contact_area, triangles.contact_area
    rows.append(row("Contact area", areas, standing.plan_area, units.area))
    head = ("", "Dual cells", "Triangles", "Indicator", "Relative")
    return section(
        title,
        table(rows, head, numeric=True),
        paragraph(
            "The indicator is the difference of the solutions of the same problem on the dual "
            "cells and on the triangles. It is empirical, not a bound. Tilts are compared with "
            "the tilt in all, moments with the sum of the pressures times the square root of "
            "the area of the plan, areas with that of the plan."
        ),
        paragraph(_meaning(solution, cells, estimate, units.displacement)),
    )


def _meaning(
    solution: PunchSolution, cells: PunchSolution, estimate: CoupleEstimate, unit: Unit
) -> Html:
    """What the difference of both grids is worth."""
    load = solution.load
    given_load = load.settlement is None and load.tilt is None
    flat = solution.punch.gap is None
    if estimate.bracketed[0] and given_load and flat:
        return joined(
            [
                "With constant pressures, dual cells collocated in their nodes and triangles in "
                "their centroids, the exact settlement was between both on every valid mesh "
                "tried, which is not proven: from ",
                *(amount(estimate.settlement[0], unit, 6), " to "),
                amount(estimate.settlement[1], unit, 6),
                "; the mixture in which their errors cancel to first order is ",
                *(amount(estimate.mixed_settlement, unit, 6), "."),
            ]
        )
    if cells.punch.weights is not None and flat and not why_none(solution):
        (low, high), (x, y) = solution.bounds.settlement, solution.bounds.at
        return joined(
            [
                "The exact settlement of the point ",
                *("(", number(x, 4), ", ", number(y, 4), ") from the origin is expected from "),
                *(number(low, 6), " to ", number(high, 6)),
                "; not proven, but found in all of 186 random cases with known answers.",
            ]
        )
    if cells.punch.collocation == "centroid" and flat:
        return escaped(
            "With constant pressures collocated in centroids both settlements come out too large "
            "as a rule, by more than they differ: the true error is larger than this. Singular "
            "edges, or dual cells collocated in their nodes, tell more."
        )
    return escaped("How far the true error is from it has not been measured for such a case.")


def solver_section(
    solution: CellPressures, couple: PunchSolution | None, version: str, units: Units
) -> Html:
    """Iterations, residuals, versions and times."""
    versions = {
        "skfem_dual": version,
        "scikit-fem": skfem.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "Python": platform.python_version(),
    }
    seconds = list(solution.timings.items())
    if couple is not None:
        seconds.append(("other grid", sum(couple.timings.values())))
    rigid = isinstance(solution, PunchSolution)
    body = "punch" if rigid else "structure"
    what = (
        "a rigid, smooth punch" if rigid else "a structure of finite elements with a smooth base"
    )
    misfit = amount(solution.displacement_residual, units.displacement, 2)
    iterated = str(solution.iterations) if solution.iterations else "none needed"
    rows: list[tuple] = [
        ("Result", solution.message, NONE),
        ("Converged", "yes" if solution.success else Html("<strong>NO</strong>"), NONE),
        ("Iterations for the contact region", iterated, NONE),
        (
            joined(["Largest violation of the contact conditions", small("relative")]),
            number(solution.complementarity_residual, 2),
            NONE,
        ),
        (f"Largest misfit of ground and {body}", misfit, symbol(units.displacement)),
        ("Time", joined([_seconds(n, t) for n, t in seconds], ", "), "s"),
        ("Versions", ", ".join(f"{name} {v}" for name, v in versions.items()), NONE),
    ]
    return section(
        "Solver",
        table(rows, ("Solver", "", "Unit")),
        paragraph(
            f"Boundary elements on a dual grid: {what} without friction or adhesion "
            " on linearly elastic ground, at small deformations."
        ),
    )


def _seconds(name: str, value: float) -> Html:
    return joined([name, " ", number(value, 3)])
