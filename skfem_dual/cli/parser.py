"""The commands and their options."""

import argparse
from contextlib import suppress
from datetime import date, datetime
from functools import partial
from typing import Any

from .. import Plate, __version__
from ..terminal import Parser, number
from ..units import LENGTHS
from .grids import check, dual
from .plates import CELLS
from .solve import solve

EXAMPLES = """\
examples:
  one force on a plan, its centroid for origin, with a report:
    skfem-dual solve footing.msh --young 30e3 --poisson 0.3 --units kN,m \\
      --force 1200 --at 0.10 0.05 --allowable 200 --report report.html
  twelve load cases on layers:
    skfem-dual solve footing.msh --substrate layers.csv --units kN,m \\
      --loads cases.csv --table out.csv --report report.html --title "Pier 3"
  a raft 0.5 m thick under columns, with name, force, x, y, bx, by in columns.csv:
    skfem-dual solve raft.csv --plate 0.5,30e6,0.2 --substrate layers.csv --units kN,m \\
      --loads columns.csv --vtu raft.vtu --report raft.html
  two neighbouring footings, with the columns name, footing, force, mx, my in pair.csv:
    skfem-dual solve left.msh right.msh --young 30e3 --poisson 0.3 --units kN,m \\
      --loads pair.csv --json results.json

exit codes: 0; 2 after an error, or where a picture asked for has nothing to show, told in one line
on stderr; 3 if the numbers do not solve the problem, which the table, stderr and the files then
say; 4 if they do, but the accuracy asked for was not reached; 130 if interrupted.
"""


def day(text: str) -> date:
    """A date of the command line, with the time of day if it has one."""
    with suppress(ValueError):
        return date.fromisoformat(text)
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a date YYYY-MM-DD, got {text!r}") from None


def plate(text: str) -> tuple[str | None, Plate]:
    """What footings are made of, and the name of the one that is meant."""
    name, named, values = text.rpartition("=")
    numbers = [number(value) for value in values.split(",")]
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(
            f"expected thickness, Young's modulus and Poisson's ratio T,E,NU, got {text!r}"
        )
    try:
        return (name if named else None), Plate(*numbers)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def pair_of(text: str) -> tuple[float, float]:
    """Two coordinates with a comma between."""
    x, comma, y = text.partition(",")
    if not comma:
        raise argparse.ArgumentTypeError(f"expected two numbers X,Y, got {text!r}")
    return number(x), number(y)


def build_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    parser = Parser(
        prog="skfem-dual",
        description="Footings and rafts on the ground, and dual grids of triangulations.",
        epilog="Exit codes: 0; 1 if check found a fault in the mesh; 2 after an error, told in "
        "one line on stderr; 3 if solve found no solution that holds; 4 if it is not as accurate "
        "as asked for; 130 if interrupted, 143 if ended by SIGTERM. Files are written before the "
        "table is printed.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    commands = parser.add_subparsers(required=True, metavar="{solve,dual,check}")
    _add_solve(commands)
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


def _add_solve(commands: Any) -> None:
    """``solve MESH`` among the commands of a parser."""
    command = commands.add_parser(
        "solve",
        help="pressures and settlement of footings, rigid or plates, whose plans are meshes",
        description="Smooth punches, such as footings and rafts, on elastic ground. Give a\n"
        "force, a settlement or a table of load cases. Any consistent units, or --units.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.set_defaults(run=solve)
    command.add_argument(
        "mesh",
        metavar="MESH",
        nargs="*",
        help="triangle mesh of each footing, in any format of meshio, or its outline: corners as "
        ".csv, .wkt, .geojson or .dxf, whose mesh is chosen",
    )
    _add_outlines(command.add_argument_group("outlines"))
    _add_plates(command.add_argument_group("footings that bend"))
    _add_ground(command.add_argument_group("ground"))
    _add_loads(command.add_argument_group("loads"))
    _add_method(command.add_argument_group("method"))
    group = command.add_argument_group("report")
    for name in ("title", "project", "author"):
        group.add_argument(f"--{name}", metavar="TEXT", help=f"{name} on top of the report")
    group.add_argument("--date", metavar="DATE", type=day, help="YYYY-MM-DD; today without it")
    group.add_argument(
        "--allowable", metavar="X", type=number, help="allowable bearing pressure, force/length^2"
    )
    group.add_argument(
        "--point",
        metavar="X,Y",
        type=pair_of,
        action="append",
        default=[],
        help="a point of the plan whose settlement is wanted; any number of times",
    )
    group.add_argument(
        "--profile",
        metavar=("X", "Y"),
        type=number,
        nargs=2,
        help="the point below which stresses, strains and the shares of layers are told in "
        "--report and --json, the centroid of the plan by default",
    )
    group = command.add_argument_group("files")
    _add_outputs(
        group,
        table="the load cases as a table (CSV)",
        png="isobars, of the case with the largest pressure,",
        svg="the same isobars (SVG or PDF)",
        vtu="the cells of that case, of a plate alone with it and the ground around",
        json="all results for other programs",
        report="a report with pictures (HTML or PDF)",
    )
    group.add_argument("--quiet", action="store_true", help="print no table")
    group.add_argument(
        "--progress", action="store_true", help="show progress bars, also if nobody watches"
    )


def _add_outlines(group: Any) -> None:
    group.add_argument(
        "--corners", metavar="TEXT", help='an outline instead of MESH: "0,0 12,0 12,8 0,8"'
    )
    group.add_argument(
        "--layer",
        metavar="NAME",
        help="layer of a drawing with the outline; several are a file each",
    )
    group.add_argument(
        "--drawn-in",
        choices=tuple(LENGTHS),
        help="unit of length of the outline, if not that of --units, to which it is changed",
    )
    group.add_argument(
        "--accuracy",
        type=number,
        metavar="X",
        help="error allowed of the settlement of any point of an outline, over that under the "
        "force; 1e-3 by default",
    )
    group.add_argument(
        "--time-limit", type=number, metavar="S", help="seconds in which it must be reached"
    )


def _add_plates(group: Any) -> None:
    group.add_argument(
        "--plate",
        metavar="[NAME=]T,E,NU",
        type=plate,
        action="append",
        default=[],
        help="footings are plates of this thickness, Young's modulus and Poisson's ratio, free at "
        "their edges; with the name of a mesh file only that one, any number of times",
    )
    group.add_argument(
        "--cells",
        type=int,
        metavar="N",
        help=f"about how many cells the outline of a plate gets, {CELLS} by default",
    )


def _add_ground(group: Any) -> None:
    value = partial(group.add_argument, type=number, metavar="X")
    value("--young", help="Young's modulus E of a homogeneous half-space")
    value("--poisson", help="its Poisson's ratio nu")
    group.add_argument(
        "--substrate",
        metavar="FILE",
        help="instead: layers as CSV with the columns thickness, E, nu, or graded and layered "
        "ground as TOML",
    )
    group.add_argument(
        "--units",
        default="",
        metavar="F,L",
        help="units of force and length of all input, such as kN,m or kip,ft; results are then "
        "in mm and kPa, or in and ksf",
    )


def _add_loads(group: Any) -> None:
    value = partial(group.add_argument, type=number, metavar="X")
    value("--force", help="vertical force P, positive downwards")
    value("--settlement", help="settlement of the origin, instead of a force")
    pair = partial(group.add_argument, type=number, nargs=2)
    pair("--at", metavar=("EX", "EY"), help="where the force acts, from the origin")
    pair(
        "--moments",
        metavar=("MX", "MY"),
        help="moments about the x axis, positive where it presses down the side of larger y, and "
        "about the y axis, positive where it presses down the side of larger x",
    )
    pair("--horizontal", metavar=("HX", "HY"), help="horizontal force on the base, along x and y")
    value("--torsion", help="moment about the vertical through the origin, from x towards y")
    pair("--tilt", metavar=("LX", "LY"), help="inclinations, instead of moments")
    group.add_argument(
        "--loads",
        metavar="FILE",
        help="load cases as CSV with the columns name, force; x, y (where the force acts, in the "
        "coordinates of the plan) or ex, ey (from the origin); mx, my (moments as above); "
        "hx, hy, torsion (horizontal); footing (name of its mesh file), with several; of plates "
        "a line for each column, of a case those of its name, with bx, by (its sides) and q "
        "(force per area all over the plate)",
    )
    pair(
        "--origin",
        metavar=("X", "Y"),
        help="to which settlement and moments refer, the centroid of the plan by default",
    )
    group.add_argument(
        "--bilateral",
        action="store_true",
        help="keep all cells in contact: the ground may pull where the punch would lift off",
    )


def _add_method(group: Any) -> None:
    group.add_argument("--grid", choices=("dual", "triangles"), default="dual")
    group.add_argument(
        "--edge",
        choices=("singular", "constant"),
        help="whether the pressure inside a cell grows to the edge (by default, but on ground "
        "that acts on the cells like springs) or is constant",
    )
    group.add_argument(
        "--edge-boundaries",
        nargs="+",
        metavar="NAME",
        help="boundaries of the mesh that are a singular edge, all by default",
    )
    group.add_argument("--collocation", choices=("centroid", "node"), default="centroid")


def _add_outputs(command: Any, **outputs: str) -> None:
    for name, what in outputs.items():
        command.add_argument(f"--{name}", metavar="FILE", help=f"write {what} to this file")
