"""``solve MESH``: rigid footings, their table and files."""

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from .. import CasesSolution, PunchSolution
from ..contact.system import DENSE
from ..io import write_cases, write_solution, write_whole
from ..report import write_report
from ..report.bodies import footings_of
from ..report.checks import DEFORMED
from ..report.data import plain, report_data
from ..report.details import Details
from ..report.footing import Footing
from ..report.numbers import Standing
from ..terminal import tell
from ..units import Units
from .footings import (
    Base,
    ground_of,
    punches_of,
    read_bases,
    require_one_load,
    solve_cases,
    solve_one,
)
from .messages import in_options
from .outlines import take_corners
from .pictures import draw
from .tables import case_table, solution_table


def solve(options: argparse.Namespace) -> tuple[int, str]:
    """``solve MESH``: pressures under rigid footings, as a table and files."""
    take_corners(options)
    require_one_load(options)
    details = _details(options)
    times: dict[str, float] = {}
    ground = ground_of(options)
    bases = read_bases(options, ground, times)
    punches = punches_of(options, ground, bases)
    begin = perf_counter()
    solution: PunchSolution | dict[str, CasesSolution]
    if options.loads is None:
        solution = solve_one(options, punches[0])
        times |= solution.timings
    else:
        solution = solve_cases(options, bases, punches)
        times |= punches[0].timings | {"all": perf_counter() - begin}
    footings = footings_of(solution, _with_accuracy(details, bases))
    standings = [footing.standing for footing in footings if footing.standing is not None]
    dense = sum(len(punch.partition) for punch in punches) <= DENSE
    condition = None
    if standings and options.loads is None and dense:
        condition = standings[0].solution.condition_number
    if standings and (options.json or options.report or (dense and not options.quiet)):
        begin = perf_counter()
        for standing in standings:
            _ = standing.bounds  # known from here on
        times["bounds"] = perf_counter() - begin
    _tell_of_units(details.units, standings)
    _write_data(options, footings, times, condition)
    if governing := _governing(footings):
        if options.vtu:
            write_solution(options.vtu, *governing)
        if options.png or options.svg:
            draw(options, "isobars", governing, **_scale(details.units))
    if options.report:
        details = replace(footings[0].details, remarks=tuple(options.warned))
        write_report(options.report, solution, details=details)
    failed = [
        f"{f'{name}: ' if len(footing.cases) > 1 else ''}{message}"
        for footing in footings
        for name, message, ok in zip(
            footing.cases.names, footing.cases.messages, footing.cases.success
        )
        if not ok
    ]
    if failed:
        tell(f"no solution: {in_options('; '.join(dict.fromkeys(failed)))}")
    short = any(base.accuracy is not None and not base.accuracy.reached for base in bases)
    code = 3 if failed else 4 if short else 0
    if options.quiet:
        return code, ""
    if isinstance(solution, PunchSolution):
        return code, solution_table(footings[0], bases[0], times, condition)
    return code, case_table(footings, bases, times)


def _tell_of_units(units: Units, standings: Sequence[Standing]) -> None:
    """Tell of settlements as of a thousand times too soft a ground, of numbers with units."""
    most = max((standing.deformation for standing in standings), default=0.0)
    if units.named and most > DEFORMED:
        tell(
            f"warning: a settlement is {100 * most:.3g} % of the extent of the plan, far beyond "
            "small deformations. Remedy: check the units of load and moduli"
        )


def _governing(footings: Sequence[Footing]) -> list[PunchSolution]:
    """Of all footings in the case with the largest pressure under one; none without a solution."""
    largest = [f.cases.largest_pressure[f.governing] if f.standing else -1.0 for f in footings]
    worst = footings[int(np.argmax(largest))]
    every = [footing.cases.solutions[worst.governing] for footing in footings]
    return [solution for solution in every if solution is not None]


def _details(options: argparse.Namespace) -> Details:
    names = [os.fsencode(Path(path).name).decode("utf-8", "replace") for path in options.mesh]
    return Details(
        title=options.title,
        project=options.project,
        author=options.author,
        date=options.date,
        mesh_name=", ".join(names),
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
    footings: Sequence[Footing],
    times: dict[str, float],
    condition: float | None,
) -> None:
    """The table of cases and the JSON file."""
    if options.table:
        names = [footing.name for footing in footings if footing.name]
        write_cases(options.table, *(footing.cases for footing in footings), footings=names)
    if options.json:
        found = report_data(footings)
        found |= {"condition_number": condition, "seconds": times}
        text = json.dumps(plain(found), indent=2, allow_nan=False) + "\n"
        write_whole(options.json, lambda part: Path(part).write_text(text))
