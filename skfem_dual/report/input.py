"""The input of a solution, as a section of a report."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..contact.edges import where_named
from ..contact.load import Share
from ..grids.cellwise import nodal_mesh
from ..ground.graded import GradedHalfSpace
from ..ground.layered import LayeredHalfSpace
from ..ground.periodic import PeriodicGround
from ..ground.substrates import HalfSpace, Substrate
from ..messages import listed
from ..solutions.pressures import CellPressures
from ..solutions.punch_solution import PunchSolution
from ..units import Unit, Units
from .figures import mesh_picture
from .numbers import LoadedPlan, Standing
from .page import (
    DASH,
    NONE,
    Html,
    Picture,
    amount,
    coordinate,
    figure,
    joined,
    number,
    pair,
    paragraph,
    placed,
    section,
    small,
    symbol,
    table,
)


def input_section(solution: PunchSolution, standing: Standing, mesh_name: str) -> Html:
    """Mesh, grid, punch, load, ground."""
    punch, mesh = solution.punch, nodal_mesh(solution.punch.basis)
    size, units = standing.size, standing.units
    kind = "dual cells" if punch.footprint.on_dual_cells else "cells of the mesh"
    points = {"centroid": "centroids of the cells", "node": "nodes of the other grid"}
    rows: list[tuple] = [
        ("Mesh", mesh_name, NONE),
        ("Nodes and elements", f"{mesh.p.shape[1]} nodes, {mesh.nelements} elements", NONE),
        ("Cells with a pressure each", f"{len(punch.partition)} {kind}", NONE),
        ("Pressure inside the cells", edge_rule(punch), NONE),
        ("Collocation points", points[punch.collocation], NONE),
        *extent_rows(standing),
        ("Shape of the punch", shape_of(punch.gap), NONE),
        ("Origin of settlement and moments", placed(punch.origin, size), symbol(units.length)),
    ]
    if solution.others:
        rows.append(("Neighbouring punches on the same ground", str(len(solution.others)), NONE))
    return section(
        "Input",
        table(rows, ("Mesh and punch", "", "Unit")),
        table(_load_rows(solution, standing), ("Load", "", "Unit")),
        NONE if solution.load.moments is None else signs_of_moments(),
        ground_table(punch.substrate, units),
        paragraph(
            said_of(units),
            "Forces, pressures and settlements are positive into the ground. Points are given in "
            "the coordinates of the plan, except where they are said to be from the origin.",
        ),
        mesh_figure(solution, standing),
    )


def mesh_figure(solution: CellPressures, plan: LoadedPlan) -> Html:
    """The mesh and its dual grid, if it has one."""
    caption = "Mesh of the plan" + (" and its dual grid." if plan.dual is not None else ".")
    return figure(mesh_picture(solution, plan), "The mesh of the plan and its dual grid", caption)


def said_of(units: Units) -> str:
    """What units numbers have."""
    if units.named:
        return ""
    return (
        "Units are any consistent set: L is the unit of length of the mesh, F that of force; "
        "moduli and pressures are in F/L². "
    )


def extent_rows(plan: LoadedPlan) -> list[tuple]:
    """Where the plan lies."""
    low, high, size = plan.hull.min(axis=1), plan.hull.max(axis=1), plan.size
    length, area = symbol(plan.units.length), symbol(plan.units.area)
    return [
        ("Extent of the plan, x", _range(low[0], high[0], size), length),
        ("Extent of the plan, y", _range(low[1], high[1], size), length),
        ("Area of the plan", number(plan.plan_area), area),
        ("Centroid of the plan", placed(plan.solution.punch.centre, size), length),
    ]


def _range(low: float, high: float, size: float) -> Html:
    return joined([coordinate(low, size), " to ", coordinate(high, size)])


def edge_rule(punch: Any) -> str:
    """How the pressure varies inside the cells of a body."""
    if punch.edge == "constant":
        return "constant"
    where = where_named(punch.edge_boundaries) or "the plan"
    return f"grows to the edge of {where} like the inverse square root of the distance to it"


def shape_of(gap: Any) -> str:
    """What an initial gap is given by."""
    if gap is None:
        return "flat"
    if callable(gap):
        return getattr(gap, "__name__", None) or repr(gap)
    return "a field of scikit-fem" if isinstance(gap, tuple) else "values in collocation points"


def _load_rows(solution: PunchSolution, standing: Standing) -> list[tuple]:
    load, units = solution.load, standing.units
    rows: list[tuple] = []
    origin = "the origin"
    if isinstance(load, Share):
        whose = f"{listed(load.names)}, of which this takes what is found"
        rows.append(("Loads of", whose, NONE))
        origin = f"the origin of {load.names[0]}"
        load = load.body
    if load.force is not None:
        rows.append(("Force P", amount(load.force, units.force), symbol(units.force)))
    if load.settlement is not None:
        imposed = amount(load.settlement, units.displacement)
        rows.append(("Settlement of the origin, imposed", imposed, symbol(units.displacement)))
    if load.tilt is not None:
        tilt = units.slope.factor * np.array(load.tilt)
        rows.append(("Tilt (Lx, Ly), imposed", pair(tilt), symbol(units.slope)))
    else:
        at = placed(load.at or (0.0, 0.0), standing.size)
        rows.append((f"acting at, from {origin}", at, symbol(units.length)))
    if load.moments is not None:
        m1, m2 = load.moments
        note = small(
            "about the x axis, positive where it presses down the side of larger y; about the y "
            "axis, positive where it presses down the side of larger x"
        )
        rows.append(
            (joined(["Moments (Mx, My)", note]), pair((m2, 0.0 - m1)), symbol(units.moment))
        )
    return rows


def signs_of_moments() -> Html:
    """A drawing of what positive moments do, seen along the axis each turns about."""
    views = "".join(
        f"""<g transform="translate({shift} 0)"><path d="M20 60H180" stroke="#999"/>
<path d="M50 40L150 58L147.9 70L47.9 52Z" fill="#ddd" stroke="#1a1a1a"/>
<path d="M68 26A34 34 0 0 1 124 22" fill="none" stroke="#1a1a1a" stroke-width="1.5"/>
<path d="M124 22l-10 -2l7 -7z" fill="#1a1a1a"/>
<path d="M20 84H60m-6 -4l6 4l-6 4" fill="none" stroke="#1a1a1a"/>
<g font-family="sans-serif" font-size="13" fill="#1a1a1a"><text x="66" y="88">{along}</text>
<text x="128" y="16">{moment} &gt; 0</text></g></g>"""
        for shift, along, moment in ((0, "y", "Mx"), (210, "x", "My"))
    )
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="410" height="95" '
        f'viewBox="0 0 410 95">{views}</svg>'
    )
    text = (
        "Positive moments: Mx, about the x axis, presses down the side of larger y; My, about the "
        "y axis, presses down the side of larger x. A force P off the point it is given for by "
        "(ex, ey) is the same as My = P ex and Mx = P ey."
    )
    return figure(Picture.from_svg(svg, 410), "Signs of moments", text)


def ground_table(substrate: Substrate | PeriodicGround, units: Units) -> Html:
    """The ground, layer by layer."""
    if isinstance(substrate, PeriodicGround):
        length = symbol(units.length)
        rows = [(f"Along {c}", number(x), length) for c, x in zip("xy", substrate.period)]
        period = table(rows, ("Period after which pressures repeat", "", "Unit"))
        return joined([ground_table(substrate.ground, units), period])
    if isinstance(substrate, HalfSpace):
        modulus = amount(substrate.young, units.modulus)
        rows = [("Young's modulus E", modulus, symbol(units.modulus))]
        rows.append(("Poisson's ratio ν", number(substrate.poisson), NONE))
        return table(rows, ("Ground: homogeneous half-space", "", "Unit"))
    if not isinstance(substrate, LayeredHalfSpace):
        described = getattr(substrate, "description", str(substrate))
        return table([("Moduli", described, NONE)], ("Ground: graded half-space", "", "Unit"))
    return table(
        list(_layer_rows(substrate, 0.0, units.modulus)),
        (
            f"Ground: depth [{units.length.symbol}]",
            f"E at its top [{units.modulus.symbol}]",
            f"E at its bottom [{units.modulus.symbol}]",
            "ν",
        ),
        numeric=True,
    )


def _layer_rows(substrate: Substrate | str, depth: float, unit: Unit) -> Iterator[tuple]:
    below = joined(["below ", number(depth)])
    if isinstance(substrate, LayeredHalfSpace):
        for layer in substrate.layers:
            end = depth + layer.thickness
            bottom = layer.young * (1 + layer.gradient * layer.thickness)
            moduli = amount(layer.young, unit), amount(bottom, unit), number(layer.poisson)
            yield joined([number(depth), " to ", number(end)]), *moduli
            depth = end
        yield from _layer_rows(substrate.base, depth, unit)
    elif isinstance(substrate, str):
        slides = {"bonded": "the layer is bonded to it", "smooth": "the layer slides on it"}
        yield below, "rigid", slides[substrate], DASH
    elif isinstance(substrate, GradedHalfSpace):
        note = small(f"{substrate.description}, z from there")
        surface = substrate.surface
        yield joined([below, note]), amount(surface.young, unit), DASH, number(surface.poisson)
    else:
        surface = substrate.surface
        young = amount(surface.young, unit)
        yield below, young, young, number(surface.poisson)
