"""Footings of the command line that bend: plates under columns, alone or beside rigid ones."""

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np
from skfem import LinearForm

from .. import DualMesh, ElasticPunch, Plan, Plate, Punches, RigidPunch, column_load
from ..arguments import checked_integer
from ..bodies.plates import excess_under_columns, require_memory
from ..errors import ResolutionWarning, warn
from ..io import CaseRow
from ..messages import place
from ..plans.read import SUFFIXES
from ..solutions.elastic_solution import ElasticSolution
from .footings import Base, CaseRows, names_of, only, punches_of, single_load
from .messages import how_of
from .outlines import is_outline

#: of the outline of a plate
CELLS = 600
#: errors of deflections under columns that are told
ROUGH = 0.025


def plates_of(options: argparse.Namespace) -> dict[str, Plate]:
    """What the footings that bend are made of, by their names.

    Raises
    ------
    ValueError
        If a name is no footing or comes twice, or there are options that plates do not know.
    """
    names, found = names_of(options), dict[str, Plate]()
    for name, plate in options.plate:
        meant = names if name is None else [name]
        for each in meant:
            if each not in names:
                raise ValueError(
                    f"expected a footing among {', '.join(names)}, the names of the mesh files, "
                    f"for --plate, got {each}"
                )
            if each in found:
                raise ValueError(f"expected one --plate for {each}, got several")
            found[each] = plate
    if not found:
        if options.cells is not None:
            raise ValueError("expected --plate with --cells, got none. Remedy: --accuracy")
        return found
    meshes = [path for name, path in zip(names, options.mesh) if name in found]
    if options.cells is not None and not any(map(is_outline, meshes)):
        raise ValueError(
            f"expected --cells with an outline ({', '.join(SUFFIXES)}), got the mesh {meshes[0]}"
        )
    if options.collocation != "centroid":
        raise ValueError(
            f"expected no --collocation {options.collocation} with --plate. Remedy: leave it out"
        )
    for name in ("moments", "settlement", "tilt", "horizontal", "torsion"):
        if getattr(options, name) is not None:
            raise ValueError(
                f"expected no --{name} with --plate. Remedy: --force with --at, or columns in "
                "--loads, whose moments take sides bx, by"
            )
    if len(found) == len(names):
        for name in ("accuracy", "time_limit"):
            if getattr(options, name) is not None:
                raise ValueError(
                    f"expected no --{name.replace('_', '-')} with --plate, whose error is not "
                    "estimated. Remedy: --cells, and compare two numbers of them"
                )
    return found


def grid_of_outline(options: argparse.Namespace, plan: Plan) -> DualMesh:
    """Of about as many cells as are wanted.

    Raises
    ------
    ValueError, MemoryError
        If they are too few for a mesh, or too many for the memory at hand.
    """
    n = CELLS if options.cells is None else checked_integer("--cells", options.cells, at_least=5)
    require_memory(n)
    try:
        return DualMesh.from_mesh(plan.mesh(n=n))
    except ValueError as error:
        text = str(error).replace("expected n from", "expected --cells from")
        raise type(error)(text) from error


def solve_plates(
    options: argparse.Namespace,
    ground: Any,
    bases: Sequence[Base],
    plates: dict[str, Plate],
    cases: CaseRows | None,
) -> tuple[
    list[RigidPunch | ElasticPunch],
    dict[str, dict[str, Any]],
    dict[str, list[CaseRow]],
    dict[str, str],
]:
    """The footings; their solutions in all cases by names, that of a single one empty; what
    stands on plates, likewise; and cases whose loads cannot be balanced, with the reason.

    Raises
    ------
    ValueError
        If loads do not fit a footing, or in no case can be balanced; says in which line or case.
    """
    punches = [
        _plate(options, ground, base, plates[base.name])
        if base.name in plates
        else punches_of(options, ground, [base])[0]
        for base in bases
    ]
    how = how_of(options)
    names = [base.name for base in bases]
    found: dict[str, dict[str, Any]] = {name: {} for name in names}
    cases = {"load": {names[0]: [_single_row(options)]}} if cases is None else cases
    impossible: dict[str, str] = {}
    for case, rows in cases.items():
        loads = [
            _load(punch, base, rows[base.name]) for punch, base in zip(punches, bases, strict=True)
        ]
        try:
            if len(punches) == 1:
                solutions = [punches[0].solve(loads[0], **how)]
            else:
                solutions = list(Punches(punches, names).solve(loads, **how).solutions)
        except ValueError as error:
            impossible[case] = str(error)
            if len(impossible) == len(cases):
                raise ValueError(f"case {case}: {error}") from error
            continue
        for base, solution in zip(bases, solutions, strict=True):
            found[base.name][case] = solution
    columns = {name: [row for of in cases.values() for row in of[name]] for name in plates}
    for base in bases:
        if base.name in plates:
            _warn_if_coarse(plates[base.name], base, columns[base.name], found[base.name])
    if len(bases) > 1:
        return punches, found, columns, impossible
    (name,) = found
    return punches, {"": found[name]}, {"": columns[name]}, impossible


def _plate(options: argparse.Namespace, ground: Any, base: Base, plate: Plate) -> ElasticPunch:
    cells = base.dual.basis() if options.grid == "dual" else base.dual.primal_basis()
    edges = options.edge_boundaries
    return plate.on(ground, cells, edge=options.edge, edge_boundaries=edges, origin=base.origin)


def _warn_if_coarse(
    plate: Plate, base: Base, rows: list[CaseRow], solutions: dict[str, ElasticSolution]
) -> None:
    """Warn of a column under which a plate bends too much, beside its largest deflection."""
    columns: dict[tuple[str, float, float], float] = {}
    for row in rows:  # dead and live load of a column stand in lines of their own
        if row.name in solutions:
            column = row.name, *row.point(base.origin)
            columns[column] = columns.get(column, 0.0) + row.force
    columns = {column: force for column, force in columns.items() if force > 0}
    if not columns:
        return
    at = np.array([column[1:] for column in columns]).T
    cases = [solutions[name] for name, *_ in columns]
    forces = np.array(list(columns.values()))
    excess = excess_under_columns(plate, cases[0].punch.structure, at, forces)
    excess = excess / [np.abs(case.cell_deflections).max() for case in cases]
    if (worst := excess.max()) > ROUGH:
        cells = int(np.ceil(len(base.dual) * worst / ROUGH))
        warn(
            f"the deflection under the column at {place(at[:, excess.argmax()])} is too large by "
            f"up to {100 * worst:.2g} % of the largest, as cells are for how the column bends the "
            f"plate. Remedy: --cells {cells}, or a finer mesh",
            ResolutionWarning,
        )


def _single_row(options: argparse.Namespace) -> CaseRow:
    """The one load of the options, as a line of a table."""
    load = single_load(options)
    if load["force"] is None:
        raise ValueError("expected --force or --loads with --plate, got neither")
    return CaseRow("--force", "load", "", load["force"], None, load["at"], (0.0, 0.0))


def _load(punch: RigidPunch | ElasticPunch, base: Base, rows: list[CaseRow]) -> Any:
    """The load vector of a plate, of all its columns; the one load of a rigid footing."""
    if isinstance(punch, RigidPunch):
        return only(rows).load(base.origin)
    structure = punch.structure
    f = sum(row.spread for row in rows) * LinearForm(lambda v, w: 1.0 * v).assemble(structure)
    for row in rows:
        if any(row.horizontal or ()) or row.torsion:
            raise ValueError(
                f"{row.where}: expected vertical loads of a plate, got horizontal ones. Remedy: "
                "leave out hx, hy and torsion"
            )
        at, sides = row.point(base.origin), row.sides
        try:
            if row.force or any(row.moments):
                f += column_load(structure, at, row.force, sides=sides, moments=row.moments)
        except ValueError as error:
            raise ValueError(f"{row.where}: {error}") from error
    return f
