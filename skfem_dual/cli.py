"""The command line: ``python -m skfem_dual {solve,dual,check}``, or ``skfem-dual``."""

import argparse
import json
import math
import os
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from . import DualMesh, HalfSpace, PunchSolution, RigidPunch, __version__, check_mesh
from .contact.system import DENSE
from .errors import ConvergenceError
from .ground.substrates import Substrate
from .io import (
    read_mesh,
    read_substrate,
    require_outputs,
    write_dual,
    write_solution,
    write_whole,
)
from .io.guarded import require_file
from .report import solve_on_other_grid, write_report
from .startup import end_of_imports
from .terminal import Parser, is_watched, number, print_table, tell

SUFFIXES = {
    "png": (".png",),
    "svg": (".svg", ".pdf"),
    "vtu": (".vtu",),
    "json": (".json",),
    "report": (".html",),
}


#: what may come of bad input or a bad environment; anything else is a fault of the program
BAD = (
    ValueError,
    TypeError,
    OSError,
    RuntimeError,
    ImportError,
    MemoryError,
    ArithmeticError,
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Files are written before the table is printed, whatever becomes of the standard output.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process by default.

    Returns
    -------
    int
        0; 1 if ``check`` found a fault; 2 after an error, told in one line on stderr; 3 if
        ``solve`` found no solution that holds, told likewise; 130 if interrupted.
    """
    try:
        end_of_imports()
        options = _parser().parse_args(argv)
        with warnings.catch_warnings():
            warnings.simplefilter("default")
            options.warned = []
            warnings.showwarning = partial(_show_warning, options.warned)
            _check_files(options)
            code, table = options.run(options)
            print_table(table)
            return code
    except KeyboardInterrupt:
        tell("interrupted")
        return 130
    except BAD as error:
        tell(f"error: {_one_line(error)}")
        return 2


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
    _draw_isobars(options, solution)
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


def dual(options: argparse.Namespace) -> tuple[int, str]:
    """``dual MESH``: census, file and picture of the dual grid."""
    grid = DualMesh.from_mesh(read_mesh(options.mesh))
    if options.vtu:
        write_dual(options.vtu, grid)
    _draw(options, "draw", grid)
    return 0, "\n".join(grid.lines())


def check(options: argparse.Namespace) -> tuple[int, str]:
    """``check MESH``: what a triangulation must be to have a dual grid."""
    mesh = read_mesh(options.mesh)
    report = check_mesh(mesh)
    _draw(options, "draw", mesh, report=report)
    return 0 if report.ok else 1, "\n".join(report.lines())


def _draw_isobars(options: argparse.Namespace, solution: PunchSolution) -> None:
    """The pressure with the edge of contact."""
    if not (options.png or options.svg):
        return
    _draw(options, "isobars", solution)


def _draw(options: argparse.Namespace, what: str, *args: Any, **kwargs: Any) -> None:
    """Write the pictures asked for; both libraries draw by the same names."""
    if options.png:
        from .visuals import pyvista

        plotter = getattr(pyvista, what)(*args, **kwargs)
        write_whole(options.png, plotter.screenshot)
        plotter.close()
    if options.svg:
        from .visuals import matplotlib

        axes = getattr(matplotlib, what)(*args, **kwargs)
        write_whole(options.svg, axes.figure.savefig)


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


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="skfem-dual",
        description="Dual grids of triangulations and rigid punches on an elastic half-space.",
        epilog="Exit codes: 0; 1 if check found a fault in the mesh; 2 after an error, told in "
        "one line on stderr; 3 if solve found no solution that holds; 130 if interrupted. Files "
        "are written before the table is printed.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(required=True, metavar="{solve,dual,check}")

    command = commands.add_parser(
        "solve",
        help="pressures and settlement of a rigid punch whose plan is the mesh",
        description="Rigid, smooth punch on an elastic half-space. Any consistent units. Give "
        "a force or a settlement.",
        epilog="Exit codes: 0; 2 after an error; 3 if the numbers do not solve the problem, which "
        "the table, stderr and the files then say; 130 if interrupted.",
    )
    command.set_defaults(run=solve)
    command.add_argument("mesh", metavar="MESH", help="triangle mesh in any format of meshio")
    value = partial(command.add_argument, type=number, metavar="X")
    value("--young", help="Young's modulus E of a homogeneous half-space")
    value("--poisson", help="its Poisson's ratio nu")
    command.add_argument(
        "--substrate", metavar="FILE", help="graded or layered ground, a TOML file, instead"
    )
    value("--force", help="vertical force P, positive downwards")
    value("--settlement", help="settlement of the origin, instead of a force")
    pair = partial(command.add_argument, type=number, nargs=2)
    pair("--at", metavar=("EX", "EY"), help="where the force acts, from --origin")
    pair("--moments", metavar=("M1", "M2"), help="moments, with the signs of the paper's (4)")
    pair("--tilt", metavar=("LX", "LY"), help="inclinations, instead of moments")
    pair(
        "--origin",
        metavar=("X", "Y"),
        default=(0.0, 0.0),
        help="centre of the punch, (0, 0) by default; settlement and moments refer to it",
    )
    command.add_argument(
        "--bilateral",
        action="store_true",
        help="keep all cells in contact: the ground may pull where the punch would lift off",
    )
    command.add_argument("--grid", choices=("dual", "triangles"), default="dual")
    command.add_argument(
        "--edge",
        choices=("singular", "constant"),
        default="singular",
        help="whether the pressure inside a cell grows to the edge (default) or is constant",
    )
    command.add_argument(
        "--edge-boundaries",
        nargs="+",
        metavar="NAME",
        help="boundaries of the mesh that are a singular edge, all by default",
    )
    command.add_argument("--collocation", choices=("centroid", "node"), default="centroid")
    _add_outputs(
        command,
        png="isobars",
        svg="isobars (SVG or PDF)",
        vtu="cells",
        json="the results",
        report="a report with pictures (HTML)",
    )

    command = commands.add_parser("dual", help="the dual grid of the mesh")
    command.set_defaults(run=dual)
    command.add_argument("mesh", metavar="MESH", help="triangle mesh in any format of meshio")
    _add_outputs(command, png="both grids", svg="both grids (SVG or PDF)", vtu="dual cells")

    command = commands.add_parser(
        "check",
        help="whether the mesh has a dual grid, and if not, why",
        epilog="Exit codes: 0; 1 if the mesh has a fault; 2 after an error; 130 if interrupted.",
    )
    command.set_defaults(run=check)
    command.add_argument("mesh", metavar="MESH", help="triangle mesh in any format of meshio")
    marked = "the mesh with the bad places marked"
    _add_outputs(command, png=marked, svg=f"{marked} (SVG or PDF)")
    return parser


def _add_outputs(command: argparse.ArgumentParser, **outputs: str) -> None:
    for name, what in outputs.items():
        command.add_argument(f"--{name}", metavar="FILE", help=f"write {what} to this file")


def _check_files(options: argparse.Namespace) -> None:
    """Refuse input that is no file and output that cannot be written, before any work."""
    inputs = {"MESH": options.mesh}
    if getattr(options, "substrate", None) is not None:
        inputs["--substrate"] = options.substrate
    for name, path in inputs.items():
        require_file(path, f"a file for {name}")
    outputs = {f"--{n}": p for n in SUFFIXES if (p := getattr(options, n, None)) is not None}
    for name, path in outputs.items():
        suffixes = SUFFIXES[name[2:]]
        if Path(path).suffix not in suffixes:
            raise ValueError(
                f"expected a file name ending in {' or '.join(suffixes)} for {name}, got {path}"
            )
    require_outputs(outputs, inputs)
    if "--png" in outputs:
        from .visuals.offscreen import require_pyvista

        require_pyvista()
    if {"--svg", "--report"} & set(outputs):
        from .visuals.axes import pyplot

        pyplot()


def _show_warning(warned: list[str], message: Warning | str, *where: object) -> None:
    warned.append(_one_line(message))
    tell(f"warning: {warned[-1]}")


def _one_line(error: BaseException | Warning | str) -> str:
    return " ".join(str(error).split()) or type(error).__name__
