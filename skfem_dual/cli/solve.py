"""``solve MESH``: a rigid punch, its table and files."""

import argparse
import json
import math
import os
import warnings
from pathlib import Path
from time import perf_counter
from typing import Any

from .. import DualMesh, HalfSpace, PunchSolution, RigidPunch, __version__
from ..contact.system import DENSE
from ..errors import ConvergenceError
from ..ground.substrates import Substrate
from ..io import read_mesh, read_substrate, write_solution, write_whole
from ..report import solve_on_other_grid, write_report
from ..terminal import is_watched, tell
from .pictures import draw


def solve(options: argparse.Namespace) -> tuple[int, str]:
    """``solve MESH``: pressures under a rigid punch, as a table and files."""
    times = {}
    start = perf_counter()
    mesh = read_mesh(options.mesh)
    times["import"], start = perf_counter() - start, perf_counter()
    dual = DualMesh.from_mesh(mesh)
    times["dual"] = perf_counter() - start
    punch = RigidPunch(
        _substrate(options),
        dual.basis() if options.grid == "dual" else dual.primal_basis(),
        edge=options.edge,
        edge_boundaries=options.edge_boundaries,
        collocation=options.collocation,
        origin=options.origin,
    )
    solution = punch.solve(
        options.force,
        options.at,
        options.moments,
        settlement=options.settlement,
        tilt=options.tilt,
        unilateral=not options.bilateral,
        progress=is_watched(),
    )
    times |= solution.timings
    rows = {"Mesh": f"{options.mesh}, {len(dual)} nodes, {mesh.nelements} triangles"}
    rows |= solution.table()
    del rows["Time [s]"]  # the solution's share of it
    condition = solution.condition_number if len(solution.pressure) <= DENSE else None
    if condition is not None:
        rows["Condition number"] = f"{condition:.4g}"
    rows["Time [s]"] = ", ".join(f"{k} {v:.3f}" for k, v in times.items())
    if not solution.success:
        rows["Success"] = "NO: the numbers above do not solve the problem"
    if options.json:
        results = _without_infinities(_as_dict(options, solution, condition, times))
        text = json.dumps(results, indent=2, allow_nan=False) + "\n"
        write_whole(options.json, lambda part: Path(part).write_text(text))
    if options.vtu:
        write_solution(options.vtu, solution)
    draw(options, "isobars", solution)
    if options.report:
        _report(options, solution)
    if not solution.success:
        tell(f"no solution: {solution.message}")
    table = "\n".join(f"{name:<19}{value}" for name, value in rows.items())
    return 0 if solution.success else 3, table


def _report(options: argparse.Namespace, solution: PunchSolution) -> None:
    """The report, with the solution on the other grid to estimate the error."""
    couple = None
    try:
        couple = solve_on_other_grid(
            solution, unilateral=not options.bilateral, progress=is_watched()
        )
    except (ValueError, ConvergenceError) as error:  # the results do not depend on it
        warnings.warn(f"not solved on the other grid: {error}", stacklevel=1)
    write_report(
        options.report,
        solution,
        mesh_name=os.fsencode(Path(options.mesh).name).decode("utf-8", "replace"),
        couple=couple,
        remarks=options.warned,
    )


def _substrate(options: argparse.Namespace) -> Substrate:
    moduli = options.young, options.poisson
    if (options.substrate is None) == (None in moduli) or (
        options.substrate is not None and moduli != (None, None)
    ):
        raise ValueError("expected either --young and --poisson or --substrate FILE")
    return HalfSpace(*moduli) if options.substrate is None else read_substrate(options.substrate)


def _as_dict(
    options: argparse.Namespace, solution: PunchSolution, condition: float | None, times: dict
) -> dict:
    """The solution for other programs; pressures of the cells are in the VTU file."""
    punch = solution.punch
    return {
        "version": __version__,
        "mesh": str(options.mesh),
        "grid": options.grid,
        "cells": len(punch.partition),
        "edge": punch.edge,
        "collocation": punch.collocation,
        "origin": list(punch.origin),
        "substrate": str(punch.substrate),
        "settlement": solution.settlement,
        "tilt": solution.tilt.tolist(),
        "force": solution.force,
        "first_moments": solution.resultant[1:].tolist(),
        "contact_area": solution.contact_area,
        "pressure": {
            "min": float(solution.pressure.min()),
            "mean": solution.mean_pressure,
            "max": float(solution.pressure.max()),
        },
        "condition_number": condition,
        "iterations": solution.iterations,
        "complementarity_residual": solution.complementarity_residual,
        "resultant_residual": solution.resultant_residual.tolist(),
        "displacement_residual": solution.displacement_residual,
        "success": solution.success,
        "message": solution.message,
        "seconds": times,
    }


def _without_infinities(value: Any) -> Any:
    """The same with None for numbers that JSON does not know."""
    if isinstance(value, dict):
        return {key: _without_infinities(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_infinities(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
