"""The input of a solution, as a section of a report."""

from collections.abc import Iterator, Sequence
from typing import Any

from ..contact.solution import PunchSolution
from ..grids.cellwise import nodal_mesh
from ..ground.graded import GradedHalfSpace
from ..ground.layered import LayeredHalfSpace
from ..ground.substrates import HalfSpace, Substrate
from .figures import mesh_picture
from .numbers import Plan, Standing
from .page import (
    DASH,
    FL,
    NONE,
    F,
    Html,
    L,
    P,
    coordinate,
    figure,
    joined,
    number,
    pair,
    paragraph,
    place,
    section,
    small,
    table,
)


def input_section(solution: PunchSolution, standing: Standing, mesh_name: str) -> Html:
    """Mesh, grid, punch, load, ground."""
    punch, mesh = solution.punch, nodal_mesh(solution.punch.basis)
    size = standing.size
    kind = "dual cells" if standing.on_dual_cells else "cells of the mesh"
    points = {"centroid": "centroids of the cells", "node": "nodes of the other grid"}
    rows: list[tuple] = [
        ("Mesh", mesh_name, NONE),
        ("Nodes and elements", f"{mesh.p.shape[1]} nodes, {mesh.nelements} elements", NONE),
        ("Cells with a pressure each", f"{len(punch.partition)} {kind}", NONE),
        ("Pressure inside the cells", edge_rule(punch), NONE),
        ("Collocation points", points[punch.collocation], NONE),
        *extent_rows(standing),
        ("Shape of the punch", shape_of(punch.gap), NONE),
        ("Origin of settlement and moments", place(punch.origin, size), L),
    ]
    if solution.others:
        rows.append(("Neighbouring punches on the same ground", str(len(solution.others)), NONE))
    return section(
        "Input",
        table(rows, ("Mesh and punch", "", "Unit")),
        table(_load_rows(solution, standing), ("Load", "", "Unit")),
        ground_table(punch.substrate),
        paragraph(
            "Units are any consistent set: L is the unit of length of the mesh, F that of force; "
            "moduli and pressures are in F/L². Forces, pressures and settlements are positive "
            "into the ground. Points are given in the coordinates of the mesh, except where they "
            "are said to be from the origin."
        ),
        figure(
            mesh_picture(solution, standing),
            "The mesh of the plan and its dual grid",
            "Mesh of the plan" + (" and its dual grid." if standing.dual is not None else "."),
        ),
    )


def extent_rows(plan: Plan) -> list[tuple]:
    """Where the plan lies."""
    low, high, size = plan.hull.min(axis=1), plan.hull.max(axis=1), plan.size
    return [
        ("Extent of the plan, x", _range(low[0], high[0], size), L),
        ("Extent of the plan, y", _range(low[1], high[1], size), L),
        ("Area of the plan", number(plan.plan_area), Html("L²")),
        ("Centroid of the plan", place(plan.solution.punch.centre, size), L),
    ]


def _range(low: float, high: float, size: float) -> Html:
    return joined([coordinate(low, size), " to ", coordinate(high, size)])


def edge_rule(punch: Any) -> str:
    """How the pressure varies inside the cells of a body."""
    if punch.edge == "constant":
        return "constant"
    names = punch.edge_boundaries
    where = "the plan"
    if isinstance(names, str):
        where = f"the boundary {names}"
    elif isinstance(names, Sequence):
        where = f"the boundaries {', '.join(names)}"
    elif names is not None:
        where = "the boundary facets given"
    return f"grows to the edge of {where} like the inverse square root of the distance to it"


def shape_of(gap: Any) -> str:
    """What an initial gap is given by."""
    if gap is None:
        return "flat"
    if callable(gap):
        return getattr(gap, "__name__", None) or repr(gap)
    return "a field of scikit-fem" if isinstance(gap, tuple) else "values in collocation points"


def _load_rows(solution: PunchSolution, standing: Standing) -> list[tuple]:
    load = solution.load
    rows: list[tuple] = []
    if load.force is not None:
        rows.append(("Force P", number(load.force), F))
    if load.settlement is not None:
        rows.append(("Settlement of the origin, imposed", number(load.settlement), L))
    if load.tilt is not None:
        rows.append(("Tilt (Lx, Ly), imposed", pair(load.tilt), Html("rad")))
    else:
        rows.append(("acting at, from the origin", place(load.at or (0.0, 0.0), standing.size), L))
    if load.moments is not None:
        note = small("first moments of the pressure: P ex − M1 and P ey + M2")
        rows.append((joined(["Moments (M1, M2)", note]), pair(load.moments), FL))
    return rows


def ground_table(substrate: Substrate) -> Html:
    """The ground, layer by layer."""
    if isinstance(substrate, HalfSpace):
        rows = [("Young's modulus E", number(substrate.young), P)]
        rows.append(("Poisson's ratio ν", number(substrate.poisson), NONE))
        return table(rows, ("Ground: homogeneous half-space", "", "Unit"))
    if not isinstance(substrate, LayeredHalfSpace):
        described = getattr(substrate, "description", str(substrate))
        return table([("Moduli", described, NONE)], ("Ground: graded half-space", "", "Unit"))
    return table(
        list(_layer_rows(substrate, 0.0)),
        ("Ground: depth [L]", "E at its top [F/L²]", "E at its bottom [F/L²]", "ν"),
        numeric=True,
    )


def _layer_rows(substrate: Substrate | str, depth: float) -> Iterator[tuple]:
    below = joined(["below ", number(depth)])
    if isinstance(substrate, LayeredHalfSpace):
        for layer in substrate.layers:
            end = depth + layer.thickness
            bottom = layer.young * (1 + layer.gradient * layer.thickness)
            moduli = number(layer.young), number(bottom), number(layer.poisson)
            yield joined([number(depth), " to ", number(end)]), *moduli
            depth = end
        yield from _layer_rows(substrate.base, depth)
    elif isinstance(substrate, str):
        slides = {"bonded": "the layer is bonded to it", "smooth": "the layer slides on it"}
        yield below, "rigid", slides[substrate], DASH
    elif isinstance(substrate, GradedHalfSpace):
        note = small(f"{substrate.description}, z from there")
        surface = substrate.surface
        yield joined([below, note]), number(surface.young), DASH, number(surface.poisson)
    else:
        surface = substrate.surface
        young = number(surface.young)
        yield below, young, young, number(surface.poisson)
