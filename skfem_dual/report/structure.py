"""Deflections, pressures and checks of a structure that bends, as sections of a report."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from ..bodies.plates import Plate
from ..grids.cellwise import nodal_mesh
from ..grids.outline import onto_segments
from ..io import CaseRow
from ..solutions.bearing import Circles, bearing_pressure
from ..solutions.elastic_solution import ElasticSolution
from ..units import Units
from .bearing import Borne, bearing_section
from .checks import DEFORMED, ROUNDING, UNBALANCED, Solved, notices, solver_section
from .depth import depth_section
from .details import Details
from .figures import deflection_picture
from .footing import edge_of, require_points_on
from .input import edge_rule, extent_rows, ground_table, mesh_figure, said_of, shape_of
from .numbers import LoadedPlan
from .page import (
    DASH,
    NONE,
    Html,
    amount,
    coordinate,
    figure,
    joined,
    number,
    paragraph,
    percent,
    placed,
    section,
    short_list,
    small,
    symbol,
    table,
    titled,
)
from .results import (
    axes_of,
    in_words,
    point_names,
    pressure_section,
    read,
    value_at,
    wanted_names,
)

#: points of the edge are looked at so far inside, over the distance to a cell's centroid
INSIDE = 1e-6
#: a motion that is a settlement or tilt of the base but for rounding, over its size
RIGIDLY = 1e-6


def structure_sections(
    solution: ElasticSolution, mesh_name: str, details: Details, version: str
) -> list[Html]:
    """All of a report but its head."""
    plan = LoadedPlan(solution, details.units)
    plate, columns = (
        details.plates.get(""),
        columns_table("", details.columns.get("", ()), plan),
    )
    borne = Borne("load", solution.mean_pressure, bearing_pressure(solution), solution.success)
    return [
        notices(plan, "contact region", cautions_of(solution, plan), details.remarks),
        _in_short(solution, plan),
        _input(solution, plan, mesh_name, plate, columns),
        _deflections(solution, plan, details.own_points),
        moments_section(plate, {"load": solution}, details.units),
        pressure_section(solution, plan),
        bearing_section([borne], [Circles.of(solution.punch.footprint).radius], details),
        depth_section(solution, details),
        _balance(solution, plan),
        solver_section([Solved(solution)], version, details.units),
    ]


def deflections_on(solution: ElasticSolution, plan: LoadedPlan) -> tuple[ndarray, ndarray]:
    """Collocation points and vertices of the cells, (2, m), and deflections there, (m,)."""
    punch, partition = solution.punch, solution.punch.partition
    x, ends = partition.polygons.p.copy(), np.unique(partition.facets[:, partition.f2c[1] < 0])
    x[:, ends] = a_little_inside(plan, x[:, ends])
    w = np.append(solution.cell_deflections, solution.deflection(x))
    return np.hstack([punch.collocation_points, x]), w


def largest_gap(solution: ElasticSolution, plan: LoadedPlan) -> float:
    """Of the collocation points and, under a flat base that lifts off, the corners and extremes of
    the plan."""
    largest = float(solution.gap.max())
    if solution.punch.gap is not None or not largest > 0:
        return largest
    x = a_little_inside(plan, plan.points)
    return max(largest, float(np.max(solution.ground_displacement(x) - solution.deflection(x))))


def cautions_of(solution: ElasticSolution, plan: LoadedPlan) -> Iterator[tuple[Any, ...]]:
    """What does not look right, in parts of sentences."""
    deepest = np.abs(deflections_on(solution, plan)[1]).max() / plan.size
    if deepest > DEFORMED:
        yield (
            "The largest deflection is ", percent(deepest), " of the extent of the plan, far "
            "beyond small deformations. Check the units of loads, moduli and stiffness.",
        )  # fmt: skip
    if solution.equilibrium_residual > UNBALANCED:
        yield ("The structure is not in equilibrium, see the check.",)


def _in_short(solution: ElasticSolution, plan: LoadedPlan) -> Html:
    _, w = deflections_on(solution, plan)
    return short_list(
        [
            ("Largest deflection", read(w.max(), plan.units.displacement)),
            ("Difference of deflections", read(np.ptp(w), plan.units.displacement)),
            ("Resultant force", read(plan.force, plan.units.force)),
            ("In contact", percent(1 - plan.lifted_share)),
            ("Contact", in_words(plan) if solution.success else "NOT CONVERGED"),
        ]
    )


def input_rows(
    solution: ElasticSolution, plan: LoadedPlan, mesh_name: str, plate: Plate | None
) -> list[tuple]:
    """What the structure and its plan are."""
    punch, mesh = solution.punch, nodal_mesh(solution.punch.basis)
    structure, elements = punch.structure, punch.structure.mesh
    kind = "dual cells" if punch.footprint.on_dual_cells else "cells of the mesh"
    return [
        ("Structure", "solid" if punch.boundary is not None else "plate", NONE),
        *_material(plate, plan.units),
        ("Its mesh", f"{elements.p.shape[1]} nodes, {elements.nelements} elements", NONE),
        ("Its finite elements", f"{type(structure.elem).__name__}, {structure.N} DOFs", NONE),
        ("DOFs held", str(len(punch.compliance.fixed)), NONE),
        ("Motions that only the ground resists", str(punch.motions.shape[1]), NONE),
        ("Mesh of the plan", mesh_name, NONE),
        ("Nodes and elements", f"{mesh.p.shape[1]} nodes, {mesh.nelements} elements", NONE),
        ("Cells with a pressure each", f"{len(punch.partition)} {kind}", NONE),
        ("Pressure inside the cells", edge_rule(punch), NONE),
        *extent_rows(plan),
        ("Shape of the unloaded base", shape_of(punch.gap), NONE),
        ("Origin of moments", placed(plan.origin, plan.size), symbol(plan.units.length)),
    ]


def _material(plate: Plate | None, units: Units) -> list[tuple]:
    if plate is None:
        return []
    return [
        ("Its thickness", number(plate.thickness), symbol(units.length)),
        ("Its Young's modulus", amount(plate.young, units.modulus), symbol(units.modulus)),
        ("Its Poisson's ratio", number(plate.poisson), NONE),
    ]


def moments_section(
    plate: Plate | None, cases: Mapping[str, ElasticSolution], units: Units, body: str = ""
) -> Html:
    """Least and largest bending and twisting moments of a plate in each case, and where."""
    if plate is None:
        return NONE
    unit, length = f"{units.moment.symbol}/{units.length.symbol}", units.length.symbol
    head = ["Case: moment"]
    head += [
        text for end in ("Least", "Largest") for text in (f"{end} [{unit}]", f"at [{length}]")
    ]
    rows = []
    for case, solution in cases.items():
        mesh, size = solution.punch.structure.mesh, LoadedPlan(solution, units).size
        own = solution.punch.structure.tind
        middles = mesh.p[:, mesh.t if own is None else mesh.t[:, own]].mean(axis=1)
        for name, m in zip(("mx", "my", "mxy"), plate.moments(solution), strict=True):
            ends = int(np.argmin(m)), int(np.argmax(m))
            shown = (cell for i in ends for cell in (number(m[i], 4), placed(middles[:, i], size)))
            rows.append((f"{case}: {name}", *shown))
    return section(
        titled("Bending moments", body),
        table(rows, head, "", numeric=True),
        paragraph(
            "Per length, means of the finite elements, at the middles of those: positive mx and "
            "my pull the bottom of the plate along x and along y, and the twisting moment mxy "
            "along the diagonal between both. Under a force on a point they grow with every finer "
            "mesh: give such a column its sides."
        ),
    )


def _input(
    solution: ElasticSolution, plan: LoadedPlan, mesh_name: str, plate: Plate | None, columns: Html
) -> Html:
    return section(
        "Input",
        table(input_rows(solution, plan, mesh_name, plate), ("Structure and plan", "", "Unit")),
        columns,
        ground_table(solution.punch.substrate, plan.units),
        paragraph(
            said_of(plan.units),
            "Pressures and deflections are positive into the ground. Points are given in the "
            "coordinates of the mesh.",
        ),
        mesh_figure(solution, plan),
    )


def columns_table(name: str, rows: Sequence[CaseRow], plan: LoadedPlan) -> Html:
    """What stands on it in each case, if that was said."""
    units, size = plan.units, plan.size
    length, moment, unit = units.length.symbol, units.moment.symbol, units.pressure
    shown: dict[str, list[Any]] = {
        "Case": [row.name for row in rows],
        f"Force [{units.force.symbol}]": [amount(row.force, units.force) for row in rows],
        f"acting at [{length}]": [
            placed(np.array(row.point(tuple(plan.origin.tolist()))), size)
            if row.force or any(row.moments)
            else DASH
            for row in rows
        ],
    }
    if any(any(row.sides) for row in rows):
        shown[f"over [{length}]"] = [
            joined([number(side) for side in row.sides], " × ") if any(row.sides) else DASH
            for row in rows
        ]
    for i, axis in enumerate("xy"):
        if any(row.moments[i] for row in rows):
            moments = [amount(row.moments[i], units.moment) for row in rows]
            shown[f"M{axis} [{moment}]"] = moments
    if any(row.spread for row in rows):
        shown[f"all over [{unit.symbol}]"] = [amount(row.spread, unit) for row in rows]
    if not rows:
        return NONE
    caption = f"Loads on {name or 'the structure'}"
    return table(zip(*shown.values(), strict=True), list(shown), caption, numeric=True)


def _deflections(solution: ElasticSolution, plan: LoadedPlan, wanted: ndarray) -> Html:
    """Of the base, its corners and extremes, and points that are wanted."""
    require_points_on([solution.footprint], wanted)
    (at, w), unit = deflections_on(solution, plan), plan.units.displacement
    deepest, highest = (
        value_at(w[i], at[:, i], plan) for i in (int(np.argmax(w)), int(np.argmin(w)))
    )
    rows: list[tuple] = [
        ("Largest deflection", deepest, symbol(unit)),
        (
            "Smallest deflection",
            highest,
            symbol(unit),
        ),
        ("Difference of both", amount(np.ptp(w), unit), symbol(unit)),
        ("Largest gap to the ground", amount(largest_gap(solution, plan), unit), symbol(unit)),
    ]
    x = np.hstack([plan.points, wanted])
    inside = a_little_inside(plan, x)
    names = [*point_names(plan), *wanted_names(wanted)]
    heads = "Structure", "Ground"
    points = [
        (
            name,
            coordinate(a, plan.size),
            coordinate(b, plan.size),
            amount(v, unit),
            amount(g, unit),
        )
        for name, a, b, v, g in zip(
            names,
            *x,
            solution.deflection(inside),
            solution.ground_displacement(inside),
            strict=True,
        )
    ]
    return section(
        "Deflections",
        table(rows, ("Deflection of the base", "", "Unit")),
        table(
            points,
            ("Point", *axes_of(plan.units), *(f"{what} [{unit.symbol}]" for what in heads)),
            "Deflections at the corners and extremes of the plan",
            numeric=True,
        ),
        deflection_figure(solution, plan),
    )


def deflection_figure(solution: ElasticSolution, plan: LoadedPlan, why: str = "") -> Html:
    """Lines of equal deflection, or why there are none; ``why`` begins the caption."""
    try:
        picture = deflection_picture(solution, plan)
    except ValueError as error:  # the same everywhere
        return paragraph(f"No lines of equal deflection: {error}.")
    caption = "Lines of equal deflection of the base"
    return figure(picture, caption, f"{why}{caption}.")


def a_little_inside(plan: LoadedPlan, x: ndarray) -> ndarray:
    """Points of the plan, those of the edge where neither rounding nor facets in place of arcs
    leave them outside."""
    footprint = plan.solution.punch.footprint
    off = np.nonzero(footprint.fan.locate(x) < 0)[0]
    x = x.copy()
    x[:, off] = onto_segments(x[:, off], *edge_of(footprint))
    centroids = footprint.partition.centroids
    # those of cells around re-entrant corners may lie outside
    centroids = centroids[:, footprint.fan.locate(centroids) >= 0]
    nearest = np.argmin(np.hypot(*(x[:, :, None] - centroids[:, None])), axis=1)
    return x + INSIDE * (centroids[:, nearest] - x)


def imposed_on(solution: ElasticSolution) -> ndarray:
    """Force and first moments of the loads about the origin, shape (3,).

    By the work of the loads on rigid settlement and tilts; NaN where what holds the structure
    takes part of them.
    """
    punch = solution.punch
    origin = np.array(punch.origin)[:, None]
    planes = np.vstack([np.ones(len(punch.partition)), punch.collocation_points - origin])
    moved = punch.trace @ punch.motions
    rigid = np.linalg.lstsq(moved, planes.T, rcond=None)[0]
    left = np.abs(moved @ rigid - planes.T).max(axis=0) > RIGIDLY * np.abs(planes).max(axis=1)
    return np.where(left, np.nan, solution.f @ punch.motions @ rigid)


def _balance(solution: ElasticSolution, plan: LoadedPlan) -> Html:
    """Forces of the ground and of what holds the structure, and what is left."""
    held = solution.punch.compliance.fixed
    rows: list[tuple] = [
        (
            "Resultant of the pressures",
            amount(plan.force, plan.units.force, 7),
            symbol(plan.units.force),
        )
    ]
    if plan.acting_point is not None:
        rows.append(("acting at", placed(plan.acting_point, plan.size), symbol(plan.units.length)))
    imposed = imposed_on(solution)
    if np.isfinite(imposed[0]):
        loads = amount(imposed[0], plan.units.force, 7)
        rows.append(("Resultant of the loads", loads, symbol(plan.units.force)))
        if plan.acting_point is not None and np.isfinite(imposed).all():
            at = plan.origin + imposed[1:] / imposed[0]
            rows.append(("acting at", placed(at, plan.size), symbol(plan.units.length)))
    if len(held):
        largest = np.abs(solution.reactions).max()
        scale = max(np.abs(solution.f).max(), np.finfo(float).tiny)
        shown = largest if largest > ROUNDING * scale else 0.0
        sum_ = solution.vertical_reaction
        vertical = amount(sum_ if abs(sum_) > ROUNDING * plan.load else 0.0, plan.units.force, 7)
        rows.append(("Vertical force that holds it", vertical, symbol(plan.units.force)))
        rows.append((f"Largest reaction of the {len(held)} DOFs held", number(shown), NONE))
    note = small("largest force on a free DOF that is not balanced, over the largest load")
    rows.append((joined(["Residual", note]), number(solution.equilibrium_residual, 2), NONE))
    return section("Check of the equilibrium", table(rows, ("Equilibrium", "", "Unit")))
