"""What tells how far a solution is to be trusted, as sections of a report."""

import platform
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
import skfem

from ..messages import listed
from ..plans.search import Accuracy
from ..solutions.pressures import CellPressures
from ..solutions.punch_solution import PunchSolution
from ..units import Units
from .numbers import LoadedPlan, Standing
from .page import (
    DASH,
    NONE,
    Html,
    aligned,
    alone,
    amount,
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

#: from these values on a reader is warned: settlement over the extent of the plan, half the width
#: of its bounds over the settlement, residual of the load over the load
DEFORMED, COARSE, UNBALANCED = 0.1, 0.02, 1e-6
#: residual of the load, over the load, that is only rounding
ROUNDING = 1e-12


def notices(
    plan: LoadedPlan, what: str, cautions: Iterable[tuple[Any, ...]], remarks: Sequence[str]
) -> Html:
    """What a reader must know before the results: whether ``what`` was sought is not found, what
    the ground cannot do, other cautions in parts, and remarks."""
    solution, shown = plan.solution, []
    if not solution.success:
        heading = "NOT CONVERGED: do not use these results"
        shown.append(notice("fault", heading, f"The {what} was not found: {solution.message}."))
    cautions = [*pulled(plan), *cautions]
    told = [(remark,) for remark in dict.fromkeys(remarks) if remark != solution.message]
    return joined([*shown, *(notice("caution", "Caution", *c) for c in (*cautions, *told))])


def pulled(plan: LoadedPlan) -> Iterator[tuple[Any, ...]]:
    """What the ground cannot do, in parts of a sentence."""
    if plan.pulled_area > 0:
        share = percent(plan.pulled_area / plan.plan_area)
        yield "The ground would have to pull on ", share, " of the plan, which soil does not."


def warnings_of(standing: Standing, remarks: Sequence[str]) -> Html:
    """Notices about a punch."""
    of_both = *cautions_of(standing), *cautions_of_bounds(standing)
    return notices(standing, "contact", of_both, remarks)


def cautions_of(standing: Standing) -> Iterator[tuple[Any, ...]]:
    """What does not look right, in parts of sentences."""
    if standing.edge_distance < 0:
        yield ("The resultant acts beyond the convex hull of the plan: the punch turns over.",)
    if standing.deformation > DEFORMED:
        yield (
            "The largest settlement is ", percent(standing.deformation), " of the extent of the "
            "plan, far beyond small deformations. Check the units of load and moduli.",
        )  # fmt: skip
    if np.nan_to_num(standing.imbalance).max() > UNBALANCED:
        yield ("The pressures do not balance the load, see the check of the resultant.",)


def cautions_of_bounds(standing: Standing) -> Iterator[tuple[Any, ...]]:
    """The same of the error of discretisation, which takes another solution."""
    if standing.bounds is not None:
        low, high = standing.bounds.settlement
        scale = np.abs(standing.settlement_of_hull).max()
        if high - low > 2 * COARSE * scale:
            share = percent((high - low) / (2 * scale))
            yield "The settlement is known to within ", share, " only. Use a finer mesh."


def resultant_section(solution: PunchSolution, standing: Standing) -> Html:
    """The load against the resultant of the pressures."""
    force, moment = standing.units.force.symbol, standing.units.moment.symbol
    names = f"Force [{force}]", *(f"First moment along {axis} [{moment}]" for axis in "xy")
    relative = standing.imbalance
    rows = []
    for name, imposed, found, left in zip(
        names, standing.imposed, solution.resultant, relative, strict=True
    ):
        given = "free" if np.isnan(imposed) else number(imposed, 7)
        # zero but for rounding where that is imposed
        carried = number(found if imposed != 0 or left > ROUNDING else 0.0, 7)
        shown = map(alone, aligned([given, carried]))
        rows.append((name, *shown, alone(number(found - imposed, 2)), number(left, 2)))
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
    standing: Standing, accuracy: Accuracy | None, case: str = "", footing: str = ""
) -> Html:
    """Between which values the exact position is expected, and how the mesh was chosen."""
    title = "How far the numbers may be off" + (f", {footing}" if footing else "")
    parts = [] if accuracy is None else [_accuracy(accuracy)]
    bounds, units = standing.bounds, standing.units
    if bounds is None:
        return section(title, *parts, paragraph("No bounds are known: ", standing.no_bounds, "."))
    sizes = abs(bounds.settlement.mean()), *[float(np.hypot(*standing.solution.tilt))] * 2
    level = standing.is_level(sizes[1])
    named = [
        (f"Settlement at the load [{units.displacement.symbol}]", units.displacement),
        *((f"Tilt L{axis} [{units.slope.symbol}]", units.slope) for axis in "xy"),
    ]
    if standing.solution.load.force is None:
        named[0] = f"Settlement of the origin [{units.displacement.symbol}]", units.displacement
    found = [bounds.settlement, *bounds.tilt]
    sides = bounds.settlement_by, *bounds.tilt_by
    rows = []
    for i, ((name, unit), (low, high), side) in enumerate(zip(named, found, sides, strict=True)):
        half = (high - low) / 2
        share = percent(half / sizes[i]) if sizes[i] > 0 and not (i and level) else DASH
        by = "imposed" if "proven" in side else "found"
        ends = map(alone, aligned([amount(low, unit, 6), amount(high, unit, 6)]))
        shown = *ends, alone(amount(half, unit, 2))
        rows.append((name, *shown, share, by))
    x, y = bounds.at
    where = joined(["(", number(x, 4), ", ", number(y, 4), ")"])
    return section(
        title,
        *parts,
        table(rows, ("", "From", "To", "Half the width", "Relative", "By"), numeric=True),
        paragraph(
            f"Of the case {case}. " if case else "",
            "Between these values the exact settlement of the point ", where, " from the origin "
            "and the exact tilts are expected, for this ground and this plan of straight facets. "
            "They follow from the same problem solved on the other grid of the mesh; not proven, "
            "but found in nearly all of the cases whose exact answers are known. Tilts are "
            "compared with the tilt in all. Pressures have none."
        ),
    )  # fmt: skip


def _accuracy(accuracy: Accuracy) -> Html:
    """The record of a mesh that was chosen."""
    rows = [
        (str(trial.cells), number(trial.error, 2) if np.isfinite(trial.error) else DASH,
         number(trial.seconds, 3))
        for trial in accuracy.trials
    ]  # fmt: skip
    asked = number(accuracy.asked, 2)
    error = number(accuracy.error, 2) if np.isfinite(accuracy.error) else "none"
    heading = "reached" if accuracy.reached else Html("<strong>NOT REACHED</strong>")
    return joined(
        [
            paragraph(
                "The mesh was chosen for an error of ", asked, " of the settlement of any point "
                "of the plan, over that under the load: ", heading, ", estimated ", error, " from "
                "the answers on the meshes tried.",
                "" if accuracy.reached else f" {accuracy.message}.",
            ),
            table(rows, ("Cells", "Error estimated", "Seconds"), numeric=True),
        ]
    )  # fmt: skip


class Solved(NamedTuple):
    """A solution that a page shows, its body and its case, each empty where there is one only."""

    solution: CellPressures
    body: str = ""
    case: str = ""


def solver_section(solved: Sequence[Solved], version: str, units: Units) -> Html:
    """Iterations, residuals and times of each body; versions."""
    versions = {
        "skfem_dual": version,
        "scikit-fem": skfem.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "Python": platform.python_version(),
    }
    kinds = {
        True: "a rigid, smooth punch",
        False: "a structure of finite elements with a smooth base",
    }
    what = dict.fromkeys(kinds[isinstance(each.solution, PunchSolution)] for each in solved)
    told = ", ".join(f"{name} {v}" for name, v in versions.items())
    tables = [_solver_rows(each, units) for each in solved]
    tables[-1].append(("Versions", told, NONE))
    return section(
        "Solver",
        *(
            table(rows, (f"Solver, {each.body}" if each.body else "Solver", "", "Unit"))
            for each, rows in zip(solved, tables, strict=True)
        ),
        paragraph(
            f"Boundary elements on a dual grid: {listed(list(what))} without friction or adhesion "
            "on linearly elastic ground, at small deformations."
        ),
    )


def _solver_rows(solved: Solved, units: Units) -> list[tuple]:
    solution = solved.solution
    body = "punch" if isinstance(solution, PunchSolution) else "structure"
    misfit = amount(solution.displacement_residual, units.displacement, 2)
    iterated = str(solution.iterations) if solution.iterations else "none needed"
    return [
        *([("Case", solved.case, NONE)] if solved.case else []),
        ("Result", solution.message, NONE),
        ("Converged", "yes" if solution.success else Html("<strong>NO</strong>"), NONE),
        ("Iterations for the contact region", iterated, NONE),
        (
            joined(["Largest violation of the contact conditions", small("relative")]),
            number(solution.complementarity_residual, 2),
            NONE,
        ),
        (f"Largest misfit of ground and {body}", misfit, symbol(units.displacement)),
        ("Time", joined([_seconds(n, t) for n, t in solution.timings.items()], ", "), "s"),
    ]


def _seconds(name: str, value: float) -> Html:
    return joined([name, " ", number(value, 3)])
