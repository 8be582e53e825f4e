"""``solve MESH``: footings, their table and files."""

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from .. import ElasticPunch, ElasticSolution, PunchSolution, RigidPunch
from ..contact.system import DENSE
from ..errors import ConvergenceError, MeshWarning
from ..io import write_solution, write_structure
from ..io.cases import write_rows
from ..messages import listed
from ..report import write_data, write_report
from ..report.bodies import ReportedBody, bodies_of
from ..report.checks import DEFORMED
from ..report.data import report_data
from ..report.details import Details
from ..report.footing import Footing
from ..report.numbers import Standing
from ..report.structures import Structure
from ..terminal import as_typed, tell
from ..units import Units
from .footings import (
    Base,
    ground_of,
    punches_of,
    read_bases,
    read_loads,
    require_names,
    require_one_load,
    require_report,
    solve_cases,
    solve_one,
)
from .messages import in_options
from .outlines import take_corners
from .pictures import draw
from .plates import grid_of_outline, plates_of, solve_plates
from .tables import case_table, solution_table

#: from this part of the extent of its plan on the thickness of a plate is in another unit
THICK = 0.5
#: cases without a solution that are all named
FEW = 3


def solve(options: argparse.Namespace) -> tuple[int, str]:
    """``solve MESH``: pressures under footings, as a table and files."""
    take_corners(options)
    require_names(options)
    require_one_load(options)
    require_report(options)
    solved = _solved(options)
    solution, bases, times = solved.solution, solved.bases, solved.times
    details = solved.details
    bodies = bodies_of(solution, _with_accuracy(details, bases))
    footings = [body for body in bodies if isinstance(body, Footing)]
    standings = [footing.standing for footing in footings if footing.standing is not None]
    condition = _look_further(options, solved, standings)
    _tell_of_plates(bodies)
    before = len(options.warned)
    _tell_of_units(details, bodies)  # which reports say of themselves
    said = options.warned[before:]
    _write_data(options, bodies, times, condition)
    missing = _write_fields(options, _governing(bodies), details)
    if options.report:
        remarks = tuple(text for text in options.warned if text not in said)
        write_report(options.report, solution, details=replace(bodies[0].details, remarks=remarks))
    failed = _failed(bodies)
    if failed:
        tell(f"no solution{failed}")
    short = any(base.accuracy is not None and not base.accuracy.reached for base in bases)
    code = 3 if failed else 2 if missing else 4 if short else 0
    if options.quiet:
        return code, ""
    if isinstance(solution, PunchSolution):
        return code, solution_table(footings[0], bases[0], times, condition)
    return code, case_table(bodies, bases, times)


class _Solved(NamedTuple):
    """What was solved, with the punches, what they stand for, and the seconds of each step.

    ``details`` have plates and columns, and cases that plates cannot take.
    """

    solution: Any
    punches: Sequence[RigidPunch | ElasticPunch]
    bases: Sequence[Base]
    details: Details
    times: dict[str, float]


def _solved(options: argparse.Namespace) -> _Solved:
    """Footings, or plates, under one load or all cases."""
    details, plates = _details(options), plates_of(options)
    times: dict[str, float] = {}
    ground = ground_of(options)
    grid = partial(grid_of_outline, options)
    cases = read_loads(options)
    bases = read_bases(options, ground, times, dict.fromkeys(plates, grid), cases)
    begin = perf_counter()
    if plates:
        punches, solution, columns, impossible = solve_plates(
            options, ground, bases, plates, cases
        )
        times["all"] = perf_counter() - begin
        made = plates if len(bases) > 1 else {"": plates[bases[0].name]}
        details = replace(details, plates=made, columns=columns, unsolved=impossible)
        return _Solved(solution, punches, bases, details, times)
    rigid = punches_of(options, ground, bases)
    begin = perf_counter()
    found: Any
    if cases is None:
        found = solve_one(options, rigid[0])
        times |= found.timings
    else:
        found = solve_cases(options, bases, rigid, cases)
        times |= rigid[0].timings | {"all": perf_counter() - begin}
    return _Solved(found, rigid, bases, details, times)


def _look_further(
    options: argparse.Namespace, solved: _Solved, standings: Sequence[Standing]
) -> float | None:
    """Compute here what tables and files tell beside the solution: bounds, whose time is told,
    and kerns; the answer is the condition number, of one footing with a small matrix."""
    dense = sum(len(punch.partition) for punch in solved.punches) <= DENSE
    condition = None
    if standings and isinstance(solved.solution, PunchSolution) and dense:
        condition = standings[0].solution.condition_number
    if standings and (options.json or options.report or (dense and not options.quiet)):
        begin = perf_counter()
        for standing in standings:
            _ = standing.bounds  # known from here on
        solved.times["bounds"] = perf_counter() - begin
    if options.json or options.report:
        for standing in standings:
            _ = standing.kern  # which may warn
    return condition


def _tell_of_plates(bodies: Sequence[ReportedBody]) -> None:
    """Warn of plates as thick as wide."""
    for body in bodies:
        if not isinstance(body, Structure) or body.plate is None:
            continue
        if (thick := body.plate.thickness / body.standing.size) > THICK:
            warnings.warn(
                f"the thickness of the plate is {100 * thick:.3g} % of the extent of the plan, "
                "which is no plate. Remedy: check the unit of the thickness in --plate",
                MeshWarning,
                stacklevel=1,
            )


def _tell_of_units(details: Details, bodies: Sequence[ReportedBody]) -> None:
    """Warn, of numbers with units, of settlements as of a thousand times too soft a ground."""
    most = max((body.deformation for body in bodies), default=0.0)
    if details.units.named and most > DEFORMED:
        warnings.warn(
            f"a settlement is {100 * most:.3g} % of the extent of the plan, far beyond "
            "small deformations. Remedy: check the units of lengths, loads and moduli",
            MeshWarning,
            stacklevel=1,
        )


def _write_fields(
    options: argparse.Namespace, governing: list[PunchSolution | ElasticSolution], details: Details
) -> bool:
    """VTU and pictures of the solutions of all bodies in one case; whether one could not be
    made, which is told."""
    pictures = [path for path in (options.png, options.svg) if path]
    if not governing:
        if fields := [*pictures, *filter(None, [options.vtu])]:
            tell(f"not written, as no case has a solution: {', '.join(fields)}")
        return bool(fields)
    first, *beside = governing
    if options.vtu and isinstance(first, ElasticSolution) and not beside:
        write_structure(options.vtu, first, plate=details.plates[""])
    elif options.vtu:
        write_solution(options.vtu, *governing)
    if not any(solution.pressure.any() for solution in governing):
        if pictures:
            tell(f"not written, as there is no pressure to draw: {', '.join(pictures)}")
        return bool(pictures)
    try:
        draw(options, "isobars", governing, **_scale(details.units))
    except (ValueError, ConvergenceError) as error:  # as of constant pressures
        tell(f"not written: {', '.join(pictures)}: {in_options(str(error))}")
        return True
    return False


def _failed(bodies: Sequence[ReportedBody]) -> str:
    """The cases without a solution, and why the first has none; empty if all have one."""
    unsolved = bodies[0].details.unsolved
    failed = dict(unsolved)
    for body in bodies:
        for name, message, ok in zip(body.names, body.messages, body.success, strict=True):
            if not ok:
                failed.setdefault(name, message)
    if not failed:
        return ""
    (first, why), *others = failed.items()
    count = len(bodies[0].names) + len(unsolved)
    if count == 1:
        return f": {in_options(why)}"
    which = f", {listed(list(failed))}" if len(failed) <= FEW else ""  # the table has all
    named = f"{len(failed)} of {count} cases{which}; {first}" if others else first
    return f" in {named}: {in_options(why)}"


def _governing(bodies: Sequence[ReportedBody]) -> list[PunchSolution | ElasticSolution]:
    """Of all bodies in the case with the largest pressure under one; none without a solution."""
    largest = [b.largest_pressure[b.governing] if b.standing else -1.0 for b in bodies]
    worst = bodies[int(np.argmax(largest))]
    every = [body.solutions[worst.governing] for body in bodies]
    return [solution for solution in every if solution is not None]


def _details(options: argparse.Namespace) -> Details:
    given = options.title, options.project, options.author
    title, project, author = (text and as_typed(text) for text in given)
    return Details(
        title=title,
        project=project,
        author=author,
        date=options.date,
        mesh_name=", ".join(Path(as_typed(path)).name for path in options.mesh),
        units=Units(options.units),
        allowable=options.allowable,
        points=options.point,
        profile=options.profile,
    )


def _with_accuracy(details: Details, bases: Sequence[Base]) -> Details:
    """With the records of the meshes that were chosen."""
    single = len(bases) == 1
    records = {"" if single else b.name: b.accuracy for b in bases if b.accuracy is not None}
    return replace(details, accuracy=records)


def _scale(units: Units) -> dict[str, Any]:
    """Pressures in pictures: over their mean, or in a unit, with that of the axes."""
    if not units.named:
        return {}
    unit = units.pressure
    title = f"pressure [{unit.symbol}]"
    return {"title": title, "scale": 1 / unit.factor, "length": units.length.symbol}


def _write_data(
    options: argparse.Namespace,
    bodies: Sequence[ReportedBody],
    times: dict[str, float],
    condition: float | None,
) -> None:
    """The table of cases and the JSON file."""
    if options.table:
        rows = [
            {"footing": body.name, **row} if body.name else row
            for body in bodies
            for row in body.rows()
        ]
        write_rows(options.table, rows)
    if options.json:
        found = report_data(bodies)
        known = {"condition_number": condition, "seconds": times, "remarks": options.warned}
        write_data(options.json, found | known)
