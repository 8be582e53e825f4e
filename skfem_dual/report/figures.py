"""The pictures of a report, as data that a page can hold."""

from __future__ import annotations

import io
import re
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy import ndarray
from skfem import CellBasis, ElementQuad1, ElementTriP1

from ..elements.stresses import Stresses
from ..grids.cellwise import nodal_mesh
from ..solutions.below import Profile
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.pressures import CellPressures
from ..units import Units
from ..visuals.axes import draw_segments, prepared, pyplot
from ..visuals.field import Field
from ..visuals.isolines import smooth_line
from ..visuals.levels import equal_steps
from ..visuals.matplotlib import draw, isobars, plot_kern, plot_profile
from ..visuals.offscreen import one_at_a_time
from ..visuals.style import CONTACT, OUTLINE
from ..visuals.subject import pressure_scale
from .numbers import LoadedPlan, Standing
from .page import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: up to so many lines, or elements with isobars, a picture is a vector graphic
LINES = 20_000
#: resolution of other pictures, in points per inch
RESOLUTION = 110
#: so far beyond the plan, in parts of its size, the point of the force is still drawn
BEYOND = 0.25
#: inches of the height of a plan, where it is far longer than high, with names beside its points
FLAT = 0.6
#: margins around its names, over width and height, and at least over the longer of them
MARGIN, LEAST = 0.09, 0.03
#: directions in which a plan is looked for, and how far away, in parts of its size
AROUND, NEAR = 32, 1e-3
#: lines of equal deflection, about
LEVELS = 9


def mesh_picture(solution: CellPressures, plan: LoadedPlan) -> Picture:
    """The mesh and its dual grid, if it has one."""
    mesh = nodal_mesh(solution.punch.basis)
    grid = mesh if plan.dual is None else plan.dual

    def drawn(ax: Axes) -> None:
        draw(grid, legend=False, ax=ax)
        _one_path_each(ax)
        _name_axes(ax, plan)

    return _embedded(drawn, mesh.p, vector=4 * mesh.nelements <= LINES)


def isobar_picture(solution: CellPressures, plan: LoadedPlan) -> tuple[Picture, str]:
    """Isobars with the edge of contact and the point of the resultant, and their quantity.

    Raises
    ------
    ValueError
        If the pressure has no isobars, for it is constant or zero.
    """
    scale, quantity = None, pressure_scale(solution)[1]
    region, mesh = solution.contact_region, nodal_mesh(solution.punch.basis)
    if plan.units.named:
        unit = plan.units.pressure
        scale, quantity = 1 / unit.factor, f"pressure [{unit.symbol}]"

    def drawn(ax: Axes) -> None:
        if region.edge:
            ax.plot([], [], color=CONTACT, linewidth=2.2, label="edge of contact")
        _mark_force(ax, plan)  # labels keep off it
        isobars(solution, ax=ax, title=quantity, scale=scale)
        _name_axes(ax, plan)

    vector = mesh.nelements <= LINES
    return _embedded(drawn, mesh.p, bar=1.1, vector=vector), quantity


def deflection_picture(solution: ElasticSolution, plan: LoadedPlan) -> Picture:
    """Lines of equal deflection of the base, with the edge of contact.

    Raises
    ------
    ValueError
        If the deflection is the same everywhere.
    """
    mesh, region = nodal_mesh(solution.punch.basis), solution.contact_region
    basis = CellBasis(mesh, ElementTriP1() if len(mesh.t) == 3 else ElementQuad1())
    unit = plan.units.displacement
    read = unit.factor * solution.deflection(mesh.p)
    # to both ends: where a plate bends most it is looked at most
    levels = equal_steps(read.min(), read.max(), LEVELS) if np.ptp(read) > 0 else None
    title = f"deflection [{unit.symbol}]" if plan.units.named else "deflection"

    def drawn(ax: Axes) -> None:
        for line in region.edge:
            ax.plot(*smooth_line(line), color=CONTACT, linewidth=2.2)
        if region.edge:
            ax.plot([], [], color=CONTACT, linewidth=2.2, label="edge of contact")
        _mark_force(ax, plan)  # labels keep off it and the edge
        isobars(basis, read, levels, title=title, ax=ax)
        _name_axes(ax, plan)

    return _embedded(drawn, mesh.p, bar=1.1, vector=mesh.nelements <= LINES)


def plan_picture(standing: Standing, names: list[str], wanted: Mapping[str, ndarray]) -> Picture:
    """The plan with its named points and those wanted, its kern and the point of the resultant."""
    punch = standing.solution.punch

    def drawn(ax: Axes) -> None:
        if standing.kern is None:
            field = Field.from_basis(punch.basis, np.zeros(punch.basis.N))
            draw_segments(prepared(ax, field.p), field.p, field.outline, OUTLINE, 1.4)
        else:
            plot_kern(punch, ax=ax)
            ax.legend().remove()  # in favour of that of the whole figure
        _one_path_each(ax)
        _mark_force(ax, standing)
        ax.plot(*punch.centre, "s", color=OUTLINE, markersize=3.5, label="centroid of the plan")
        ax.plot(*standing.points, "o", color=OUTLINE, markersize=3.5)
        for name, x, along in zip(names, standing.points.T, off_the_plan(standing).T):
            place: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9}
            ax.annotate(name, x, 9 * along, textcoords="offset points", **place)
        for name, (x, y) in wanted.items():
            ax.plot(x, y, "x", color=OUTLINE, markersize=5)
            ax.annotate(name, (x, y), (4, 4), textcoords="offset points", fontsize=9)
        extents = np.ptp(standing.hull, axis=1)
        ax.margins(*np.maximum(MARGIN, LEAST * extents.max() / extents))
        _name_axes(ax, standing)

    return _embedded(drawn, standing.hull)


def off_the_plan(standing: Standing) -> ndarray:
    """Directions from the named points of a plan to where it is not, shape (2, k)."""
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    along = np.stack([np.cos(angle), np.sin(angle)])
    x = standing.points[:, :, None] + NEAR * standing.size * along[:, None]
    off = standing.solution.punch.footprint.fan.locate(x.reshape(2, -1)) < 0
    out = along @ off.reshape(-1, AROUND).T
    return out / np.maximum(np.hypot(*out), 1e-9)


def _name_axes(ax: Axes, plan: LoadedPlan) -> None:
    """Names and unit of the coordinates, where that is known."""
    if plan.units.named:
        unit = plan.units.length.symbol
        ax.set_xlabel(f"x [{unit}]", fontsize=9)
        ax.set_ylabel(f"y [{unit}]", fontsize=9)


@one_at_a_time
def profile_picture(profile: Profile, units: Units) -> Picture:
    """Stresses, strain and settlement to the right, depth downwards."""
    plt = pyplot()
    stress, sink = units.pressure, units.displacement
    read = replace(
        profile,
        stresses=Stresses(*(stress.factor * s for s in profile.stresses)),
        displacement=sink.factor * profile.displacement,
    )
    with plt.style.context("default"), plt.rc_context({"svg.hashsalt": "skfem_dual"}):
        first = plot_profile(read)
        figure = cast("Figure", first.figure)
        labels = f"stress [{stress.symbol}]", "vertical strain", f"settlement [{sink.symbol}]"
        for ax, label in zip(figure.axes, labels, strict=True):
            ax.set_xlabel(label, fontsize=9)
            ax.grid(color="#dddddd", linewidth=0.6)
        first.set_ylabel(f"depth [{units.length.symbol}]", fontsize=9)
        picture = _written(figure, vector=True)
        plt.close(figure)
    return picture


def _mark_force(ax: Axes, plan: LoadedPlan) -> None:
    """The point of the resultant, unless that is far from the plan."""
    point = plan.force_point
    if point is None:
        return
    low, high = plan.hull.min(axis=1), plan.hull.max(axis=1)
    margin = BEYOND * plan.size
    if ((point < low - margin) | (point > high + margin)).any():
        return
    style: dict[str, Any] = {"markeredgecolor": OUTLINE, "markerfacecolor": "white"}
    ax.plot(*point, "o", markersize=8, **style, label="resultant force", zorder=4)
    ax.plot(*point, ".", color=OUTLINE, markersize=3, zorder=5)


def _legend(figure: Figure, ax: Axes) -> None:
    """The names of all that has one, below the picture and its scalar bar."""
    if n := len(ax.get_legend_handles_labels()[0]):
        ncols = 2 if n == 4 else 3
        figure.legend(loc="outside lower center", ncols=ncols, frameon=False, fontsize=9)


def _one_path_each(ax: Axes) -> None:
    """Turn collections of lines into one path each, a fifth as long when written."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    for lines in [c for c in ax.collections if isinstance(c, LineCollection)]:
        if paths := lines.get_paths():
            patch = PathPatch(
                Path.make_compound_path(*paths),
                fill=False,
                edgecolor=lines.get_color()[0],
                linewidth=np.ravel(lines.get_linewidth())[0],
                capstyle="round",
                clip_on=False,
                zorder=lines.get_zorder(),
            )
            ax.add_patch(patch)
            line: dict[str, Any] = {"color": patch.get_edgecolor()}
            line["linewidth"] = patch.get_linewidth()
            ax.plot([], [], **line, label=lines.get_label())
        lines.remove()


@one_at_a_time
def _embedded(
    drawn: Callable[[Axes], None], p: ndarray, bar: float = 0.0, vector: bool = True
) -> Picture:
    """What is drawn into axes for the points ``p`` and a scalar bar so wide."""
    with _axes(p, bar) as (figure, ax):
        drawn(ax)
        _legend(figure, ax)
        return _written(figure, vector)


def _written(figure: Figure, vector: bool) -> Picture:
    """A figure as data for a page."""
    buffer = io.BytesIO()
    if vector:
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    else:
        figure.savefig(buffer, format="png", dpi=RESOLUTION)
    width = round(96 * figure.get_figwidth())
    if not vector:
        return Picture("data:image/png;base64," + b64encode(buffer.getvalue()).decode(), width)
    # a hundredth of a point is enough
    beyond = re.compile(r"(?<=\.\d\d)\d+")
    text = re.sub(r' d="[^"]*"', lambda d: beyond.sub("", d[0]), buffer.getvalue().decode())
    return Picture.from_svg(text, width)


@contextmanager
def _axes(p: ndarray, bar: float) -> Iterator[tuple[Figure, Axes]]:
    """Axes in a figure that no window shows, the same whatever the settings of matplotlib.

    It is smaller than a picture on its own: the same letters are larger on a narrow page.
    """
    plt = pyplot()
    from matplotlib.figure import Figure

    width, height = np.ptp(p, axis=1)
    side = 4.2 * min(1.5, np.sqrt(max(width, height) / min(width, height))) / max(width, height)
    # the scalar bar of a wide plan is below it
    beside, below = (0.0, bar) if width > 2 * height else (bar, 0.0)
    size = (max(side * width, 3.0) + 0.6 + beside, max(side * height, FLAT) + 1.0 + 0.8 * below)
    settings = {"svg.hashsalt": "skfem_dual", "figure.constrained_layout.h_pad": 0.1}
    with plt.style.context("default"), plt.rc_context(settings):
        figure = Figure(figsize=size, layout="compressed")
        yield figure, figure.add_subplot()
