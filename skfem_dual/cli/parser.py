"""The commands and their options."""

import argparse
from functools import partial
from typing import Any

from .. import __version__
from ..terminal import Parser, number
from .grids import check, dual
from .solve import solve


def build_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="skfem-dual",
        description="Dual grids of triangulations and rigid punches on an elastic half-space.",
        epilog="Exit codes: 0; 1 if check found a fault in the mesh; 2 after an error, told in "
        "one line on stderr; 3 if solve found no solution that holds; 130 if interrupted. Files "
        "are written before the table is printed.",
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


def _add_outputs(command: argparse.ArgumentParser, **outputs: str) -> None:
    for name, what in outputs.items():
        command.add_argument(f"--{name}", metavar="FILE", help=f"write {what} to this file")
