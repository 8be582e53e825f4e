"""Outlines on the command line: a plan, and the mesh that its loads take."""

import argparse
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import Accuracy, DualMesh, Load, Plan
from ..arguments import Pair
from ..errors import MeshWarning
from ..ground.substrates import Substrate
from ..plans.corners import ring_of
from ..plans.drawings import unit_of_drawing
from ..plans.governing import governing
from ..plans.problem import Problem
from ..plans.read import SUFFIXES
from ..plans.solve import reached
from ..plans.tables import corners_of_text, unit_of_table
from ..units import LENGTHS, Units
from .messages import how_of

#: error allowed unless ``--accuracy`` is given
ACCURACY = 1e-3
#: what tells the unit of an outline, and where it stands
HEADER = "its header"
UNIT_OF = {
    ".dxf": (unit_of_drawing, "$INSUNITS"),
    **dict.fromkeys((".csv", ".txt"), (unit_of_table, HEADER)),
}


class GivenCorners(str):
    """What stands for the name of a file where the corners are given; files may have it too."""

    __slots__ = ()


def take_corners(options: argparse.Namespace) -> None:
    """Let the corners stand among the footings, and refuse options that have no use.

    Raises
    ------
    ValueError
        If there is no footing, one too many, or an option that its kind does not know.
    """
    if (options.corners is None) == (not options.mesh):
        had = "got neither" if options.corners is None else "got both"
        raise ValueError(f"expected either MESH or --corners, {had}")
    if options.corners is not None:
        options.mesh = [GivenCorners("corners")]
    outlines = [path for path in options.mesh if is_outline(path)]
    chosen = "accuracy", "time_limit"
    if not outlines:
        for name in (*chosen, "layer", "drawn_in"):
            if getattr(options, name) is not None:
                raise ValueError(
                    f"expected --{name.replace('_', '-')} with an outline "
                    f"({', '.join(SUFFIXES)}), got the mesh {options.mesh[0]}"
                )
        return
    if options.layer is not None and not any(path.lower().endswith(".dxf") for path in outlines):
        raise ValueError(f"expected --layer with a drawing (.dxf), got {outlines[0]}")
    if options.drawn_in is not None and not options.units:
        raise ValueError(
            f"expected --units with --drawn-in, to which {options.drawn_in} are changed, got none"
        )
    usual = {
        "grid": "dual",
        "edge": None,
        "edge_boundaries": None,
        "collocation": "centroid",
    }
    for name, value in usual.items():
        if getattr(options, name) != value:
            raise ValueError(
                f"expected a mesh with --{name.replace('_', '-')}, got the outline {outlines[0]}, "
                "whose mesh is chosen for the usual method. Remedy: leave it out"
            )


def is_outline(path: str) -> bool:
    """Whether a footing is an outline, by its name."""
    return isinstance(path, GivenCorners) or Path(path).suffix.lower() in SUFFIXES


def plan_of(options: argparse.Namespace, path: str) -> Plan:
    """The plan in a file, or of the corners given, in the units of all input."""
    if isinstance(path, GivenCorners):
        corners = corners_of_text(options.corners)
        ring = ring_of("--corners", [c[:2] for c in corners], [c[2] for c in corners])
        plan = Plan.from_rings([ring])
    else:
        kind = Path(path).suffix.lower()
        plan = Plan.read(path, layer=options.layer if kind == ".dxf" else None)
        if kind in UNIT_OF:
            read, where = UNIT_OF[kind]
            if options.drawn_in is None or where == HEADER:  # drawings are corrected by that
                _tell_of_unit(path, read(Path(path)), where, options.units, options.drawn_in)
    if options.drawn_in is None:
        return plan
    own, wanted = LENGTHS[options.drawn_in][0], LENGTHS[Units(options.units).length.symbol][0]
    return plan.scaled(own / wanted)


def _tell_of_unit(
    path: str, own: str | None, where: str, units: str | None, drawn_in: str | None
) -> None:
    """Tell of an outline that says it is in another unit, in drawings often wrong.

    Raises
    ------
    ValueError
        If the heading of a table says it, and nothing tells the units of other input.
    """
    if not units:
        if own is not None and where == HEADER:
            raise ValueError(
                f"{path}: expected units of all input beside that of the heading, got none and "
                f"{own}. Remedy: --units kN,m, with --drawn-in {own} if that differs; or a "
                "heading without a unit"
            )
        return
    wanted = Units(units).length.symbol if drawn_in is None else drawn_in
    if own not in (None, wanted) and drawn_in is not None:
        warnings.warn(
            f"{path} says that it is drawn in {own} ({where}), --drawn-in says {wanted}, which is "
            f"taken. Remedy: --drawn-in {own}, or no unit in the heading if that is wrong",
            MeshWarning,
            stacklevel=2,
        )
    elif own not in (None, wanted):
        scaled = f"--drawn-in {own} to change it to {wanted}, " if own in LENGTHS else ""
        warnings.warn(
            f"{path} says that it is drawn in {own} ({where}), --units says {wanted}, which "
            f"is taken. Remedy: {scaled}--drawn-in {wanted} if that is wrong",
            MeshWarning,
            stacklevel=2,
        )


def solve_outline(
    options: argparse.Namespace,
    plan: Plan,
    ground: Substrate,
    origin: Pair,
    loads: Sequence[Mapping[str, Any]],
) -> tuple[DualMesh, Accuracy | None]:
    """The grid that is fine enough for those of the loads that govern, and how it was chosen.

    The coarsest for a table of which no load can be balanced: each case is told of as one.
    """
    given = tuple(Load(**load) for load in loads)
    problem = Problem(
        plan, ground, given, origin, **how_of(options), time_limit=options.time_limit
    )
    if options.loads is not None and all(problem.fault(load) for load in given):
        x, y = plan.centroid - origin
        central = replace(problem, loads=(Load(force=1.0, at=(float(x), float(y))),))
        return central.on_coarsest().solutions[0].punch.basis.dual, None
    accuracy = ACCURACY if options.accuracy is None else options.accuracy
    found, record = reached(governing(problem), accuracy)
    return found.solutions[0].punch.basis.dual, record
