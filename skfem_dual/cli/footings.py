"""Meshes, ground and loads of the command line, and their solution."""

import argparse
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from .. import (
    Accuracy,
    CasesSolution,
    DualMesh,
    HalfSpace,
    Plan,
    PunchSolution,
    RigidPunch,
    RigidPunches,
)
from ..arguments import Pair
from ..contact.hull import Hull
from ..errors import MeshWarning
from ..grids.corners import signed_areas
from ..grids.outline import ROUNDED, distance_to_segments, inside_loops, near_edge
from ..ground.substrates import Substrate
from ..io import CaseRow, read_cases, read_mesh, read_substrate
from ..messages import place
from ..report.footing import point_beside
from ..terminal import as_typed
from ..units import LENGTHS, Units
from .messages import how_of, in_options
from .outlines import is_outline, plan_of, solve_outline

#: rows of each footing in each case, by the names of both
CaseRows = dict[str, dict[str, list[CaseRow]]]

#: metres from which on the width of a plan is in another unit
WIDE = 1000.0


@dataclass(frozen=True, eq=False)
class Base:
    """One footing: its mesh by its name, and where its origin comes from.

    Attributes
    ----------
    name : str
        Of the file, without its suffix.
    path : str
        Of the file.
    mesh : MeshTri
        Its plan.
    dual : DualMesh
        The dual grid.
    origin : pair of float
        Where settlement and moments refer to.
    origin_is : str
        How that was chosen.
    accuracy : Accuracy, optional
        How the mesh was chosen, if that of an outline.
    outline, corners : (2, k) array of float, optional
        Hull and corners of that.
    """

    name: str
    path: str
    mesh: MeshTri
    dual: DualMesh
    origin: Pair
    origin_is: str
    accuracy: Accuracy | None = None
    outline: ndarray | None = None
    corners: ndarray | None = None


def read_bases(
    options: argparse.Namespace,
    ground: Substrate,
    times: dict[str, float],
    grids: Mapping[str, Callable[[Plan], DualMesh]],
    cases: CaseRows | None,
) -> list[Base]:
    """The footings named; tells of an origin off the plan, and the times of reading.

    Outlines get a mesh that is fine enough for their loads, those named in ``grids`` theirs.
    """
    names, bases, begin = names_of(options), [], perf_counter()
    plans = [plan_of(options, p) if is_outline(p) else read_mesh(p) for p in options.mesh]
    times["import"] = perf_counter() - begin
    _require_points_on(plans, options.point)
    for name, path, plan in zip(names, options.mesh, plans, strict=True):
        read = perf_counter()
        if isinstance(plan, MeshTri):
            edge, centre = plan.p, centroid(plan)
        else:
            x, y = plan.centroid.tolist()
            edge, centre = plan.hull, (x, y)
        origin = centre if options.origin is None else tuple(options.origin)
        chosen = "centroid of the plan" if options.origin is None else "from --origin"
        if options.drawn_in is None:
            _tell_of_size(Units(options.units), path, edge)
        hull = Hull(edge - np.reshape(origin, (2, 1)))
        _require_from_origin(options, hull, origin)
        beyond = hull.beyond(np.zeros(2))
        if options.origin is not None and beyond > 0:
            warnings.warn(
                f"the origin {place(origin)} is {beyond:.3g} off the plan, "
                "settlement and moments refer to it. Remedy: leave out --origin for the "
                f"centroid, {place(centre)}",
                MeshWarning,
                stacklevel=1,
            )
        accuracy = None
        if isinstance(plan, MeshTri):
            dual = DualMesh.from_mesh(plan)
        else:
            try:
                if name in grids:
                    dual = grids[name](plan)
                else:
                    loads = _loads(options, cases, name, origin)
                    dual, accuracy = solve_outline(options, plan, ground, origin, loads)
            except ValueError as error:
                footing = f"footing {name}: " if len(names) > 1 else ""
                raise type(error)(f"{footing}{error}") from error
        times["dual"] = times.get("dual", 0.0) + perf_counter() - read
        of_plan = () if isinstance(plan, MeshTri) else (plan.hull, plan.corners)
        bases.append(Base(name, path, dual.mesh, dual, origin, chosen, accuracy, *of_plan))
    return bases


def _require_points_on(plans: Sequence[Plan | MeshTri], points: Sequence[Pair]) -> None:
    """Refuse points beside all plans, before any is solved.

    Raises
    ------
    ValueError
        If there is one; says how far it is off the nearest.
    """
    for point in points:
        x = np.reshape(point, (2, 1))
        placed = [_placed(plan, x) for plan in plans]
        if not any(on for on, _ in placed):
            raise point_beside(x[:, 0], min(distance for _, distance in placed))


def _placed(plan: Plan | MeshTri, x: np.ndarray) -> tuple[bool, float]:
    """Whether a point, (2, 1), is on a plan, and how far from its edge."""
    if isinstance(plan, Plan):
        distance = float(min(ring.sides.distance(x)[0] for ring in plan.rings))
        near = distance <= ROUNDED * np.ptp(plan.bounds, axis=1).max()
        return bool(plan.contains(x)[0] or near), distance
    a, b = plan.p[:, plan.facets[:, plan.boundary_facets()]].transpose(1, 0, 2)
    on = inside_loops(x, a, b) | near_edge(x, a, b)
    return bool(on[0]), float(distance_to_segments(x, a, b)[0])


def _tell_of_size(units: Units, path: str, edge: np.ndarray) -> None:
    """Tell of a plan that is wider than any, as of one in millimetres taken for metres."""
    if not units.named:
        return
    wide, symbol = float(np.ptp(edge, axis=1).max()), units.length.symbol
    if wide * LENGTHS[symbol][0] > WIDE:
        warnings.warn(
            f"{path} is {wide:.4g} {symbol} wide. Remedy: check that its coordinates are in the "
            "unit of --units; --drawn-in changes those of outlines",
            MeshWarning,
            stacklevel=1,
        )


def _require_from_origin(options: argparse.Namespace, hull: Hull, origin: Pair) -> None:
    """Refuse a load that is on the plan by its coordinates and far off it from the origin.

    Raises
    ------
    ValueError
        If it is; says where it is from the origin.
    """
    if options.at is None or options.bilateral:
        return
    at, moved = np.array(options.at), np.array(options.at) - origin
    if hull.beyond(at) > 0 and hull.beyond(moved) <= 0:
        raise ValueError(
            f"expected --at from the origin, {place(origin)}, got {place(options.at)}, which is "
            f"off the plan, and on it by its coordinates. Remedy: --at {moved[0]:.9g} "
            f"{moved[1]:.9g}"
        )


def _loads(
    options: argparse.Namespace, cases: CaseRows | None, name: str, origin: Pair
) -> list[dict[str, Any]]:
    """All loads of a footing, from its origin."""
    if cases is None:
        return [single_load(options)]
    return [dict(only(of[name]).load(origin)) for of in cases.values()]


def names_of(options: argparse.Namespace) -> list[str]:
    """Those of the footings, of their files without the suffix."""
    return [Path(as_typed(path)).stem for path in options.mesh]


def single_load(options: argparse.Namespace) -> dict[str, Any]:
    """The one load of the options, as arguments of `Load`."""
    moments = options.moments
    return {
        "force": options.force,
        "at": options.at,
        "moments": None if moments is None else (-moments[1], moments[0]),
        "settlement": options.settlement,
        "tilt": options.tilt,
        "horizontal": options.horizontal,
        "torsion": options.torsion,
    }


def centroid(mesh: MeshTri) -> Pair:
    """Of the plan a mesh covers."""
    p = mesh.p - mesh.p[:, :1]  # far from the origin digits would be lost
    areas = np.abs(signed_areas(p, mesh.t))
    x, y = p[:, mesh.t].mean(axis=1) @ areas / areas.sum() + mesh.p[:, 0]
    return float(x), float(y)


def ground_of(options: argparse.Namespace) -> Substrate:
    """The ground, from its two moduli or a file."""
    moduli = options.young, options.poisson
    if (options.substrate is None) == (None in moduli) or (
        options.substrate is not None and moduli != (None, None)
    ):
        raise ValueError("expected either --young and --poisson or --substrate FILE")
    return (
        HalfSpace(*moduli)
        if options.substrate is None
        else read_substrate(options.substrate, options.units)
    )


def punches_of(
    options: argparse.Namespace, ground: Substrate, bases: Sequence[Base]
) -> list[RigidPunch]:
    """The footings on their ground."""
    return [
        RigidPunch(
            ground,
            base.dual.basis() if options.grid == "dual" else base.dual.primal_basis(),
            edge=options.edge,
            edge_boundaries=options.edge_boundaries,
            collocation=options.collocation,
            origin=base.origin,
            outline=base.outline,
            corners=base.corners,
        )
        for base in bases
    ]


def require_names(options: argparse.Namespace) -> None:
    """Refuse footings of the same name, and one origin for several."""
    names = names_of(options)
    if len(set(names)) < len(names):
        raise ValueError(f"expected meshes with different names, got {', '.join(names)}")
    if options.origin is not None and len(names) > 1:
        raise ValueError(
            "expected one mesh with --origin, got several. Remedy: leave it out; the origin of "
            "each footing is the centroid of its plan"
        )


def require_one_load(options: argparse.Namespace) -> None:
    """Refuse loads given twice, or only one for several footings."""
    single = "force", "at", "moments", "settlement", "tilt", "horizontal", "torsion"
    given = [f"--{name}" for name in single if getattr(options, name) is not None]
    if options.loads is not None and given:
        raise ValueError(f"expected either --loads or {given[0]}, got both")
    if options.loads is None and len(options.mesh) > 1:
        raise ValueError(
            "expected --loads with several meshes. Remedy: a table with the columns name, "
            "footing, force"
        )
    if options.loads is None and options.table is not None:
        raise ValueError("expected --loads with --table, got one load. Remedy: --json")


def require_report(options: argparse.Namespace) -> None:
    """Refuse what only pages and data tell where there are none."""
    if options.report is not None or options.json is not None:
        return
    for name in ("title", "project", "author", "date", "profile"):
        if getattr(options, name) is not None:
            raise ValueError(
                f"expected --report or --json with --{name}, got neither. Remedy: leave it out"
            )


def solve_one(options: argparse.Namespace, punch: RigidPunch) -> PunchSolution:
    """The one load of the options."""
    return punch.solve(**single_load(options), **how_of(options))


def solve_cases(
    options: argparse.Namespace,
    bases: Sequence[Base],
    punches: Sequence[RigidPunch],
    cases: CaseRows,
) -> dict[str, CasesSolution]:
    """All cases of the table of loads, of each footing by its name."""
    how = how_of(options)
    loads = {
        case: [only(of[base.name]).load(base.origin) for base in bases]
        for case, of in cases.items()
    }
    if len(punches) == 1:
        found = [punches[0].solve_many({case: load[0] for case, load in loads.items()}, **how)]
        names = [""]
    else:
        names = [base.name for base in bases]
        found = list(RigidPunches(punches, names=names).solve_many(loads, **how))
    return {
        name: replace(own, messages=tuple(map(in_options, own.messages)))
        for name, own in zip(names, found, strict=True)
    }


def only(rows: Sequence[CaseRow]) -> CaseRow:
    """The one line of a rigid footing in a case.

    Raises
    ------
    ValueError
        If there are several, or it is of a plate.
    """
    row, *more = rows
    if more or row.spread or any(row.sides):
        where = more[0].where if more else row.where
        raise ValueError(
            f"{where}: expected one force on a rigid footing in the case {row.name!r}, got parts "
            "of it. Remedy: their resultant; or --plate for a footing that bends"
        )
    return row


def read_loads(options: argparse.Namespace) -> CaseRows | None:
    """The table of loads; None of a single load.

    Raises
    ------
    ValueError
        If a line is wrong, or a footing is not known or has no load in a case.
    """
    if options.loads is None:
        return None
    found, names = CaseRows(), names_of(options)
    for row in read_cases(options.loads, options.units, parts=bool(options.plate)):
        footing = row.footing or (names[0] if len(names) == 1 else "")
        if footing not in names:
            raise ValueError(
                f"{row.where}: expected a footing among {', '.join(names)}, the names of the mesh "
                f"files, got {footing or 'none'}"
            )
        if len(names) > 1 and (any(row.horizontal or ()) or row.torsion):
            raise ValueError(
                f"{row.where}: expected vertical loads of several footings, got horizontal ones: "
                "how bases beside each other slide is not known. Remedy: leave out hx, hy and "
                "torsion, and a run for each of them by itself"
            )
        found.setdefault(row.name, {}).setdefault(footing, []).append(row)
    for case, of in found.items():
        if missing := [name for name in names if name not in of]:
            where = next(iter(of.values()))[0].where
            raise ValueError(
                f"{where}: expected a load of footing {missing[0]} in case {case!r} too, got "
                "none. Remedy: a line with its weight; or solve the case without that footing"
            )
    return found
