"""Drawing grids, fields and isobars with matplotlib: figures in vector formats."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray
from skfem import CellBasis, Mesh2D

from ..contact.solution import EdgeCoefficient
from ..grids.checks import MeshReport
from ..grids.couples import GridCouple
from ..grids.dual_mesh import DualMesh
from .field import CONTINUOUS, Field
from .isolines import label_points
from .levels import (
    choose_levels,
    color_range,
    common_exponent,
    short_numbers,
    title_with_factor,
)
from .style import COLORMAP, MISSING, OUTLINE, band_colors, fineness, layers

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: colours and dashes of curves in one picture, told apart in grey as well
LINES = (("#1a1a1a", "-"), ("#c8401f", "--"), ("#2c6fbb", "-."), ("#7a7a7a", ":"))


def draw(
    grid: Mesh2D | DualMesh | GridCouple,
    *,
    nodes: bool = False,
    report: MeshReport | None = None,
    legend: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw a mesh, or both grids of a couple together as in Fig. 5 of the paper.

    Parameters
    ----------
    grid : MeshTri, MeshQuad, DualMesh or GridCouple
        What to draw.
    nodes : bool
        Whether to mark the nodes, of both grids if there are two.
    report : MeshReport, optional
        What `check_mesh` found: where required conditions are violated is marked.
    legend : bool
        Whether to name the lines below the picture.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        It has ``show()``; ``ax.figure.savefig("grid.svg")`` writes a file.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError
        If ``grid`` is something else.
    MeshError
        If its coordinates are not finite or vertices do not exist.
    """
    drawn = list(layers(grid, nodes, report))
    ax = _prepare(ax, drawn[0].p)
    for layer in drawn:
        if layer.facets is None:
            size = 0.7 * layer.width
            style: dict[str, Any] = {
                "color": layer.color,
                "markersize": size,
                "markeredgewidth": 0,
            }
            ax.plot(*layer.p, "o", label=layer.label, **style)
        else:
            _lines(ax, layer.p, layer.facets, layer.color, 0.6 * layer.width, layer.label)
    if legend:
        ax.legend(
            loc="upper center", bbox_to_anchor=(0.5, -0.07), ncols=3, frameon=False, fontsize=9
        )
    return ax


def plot(
    basis: CellBasis,
    values,
    *,
    title: str | None = None,
    clim: Sequence[float] | None = None,
    cmap: str = COLORMAP,
    edges: bool = False,
    ax: Axes | None = None,
) -> Axes:
    """Colour the cells or the triangles by their values.

    Parameters
    ----------
    basis : CellBasis
        Constants on cells (CellwiseBasis, ElementTriP0, ElementQuad0), drawn flat, or
        continuous of first order (ElementTriP1, ElementQuad1), drawn smoothly.
    values : (N,) array of float
        One value per DOF.
    title : str, optional
        Quantity and unit, beside the scalar bar.
    clim : (low, high), optional
        Ends of the colour range. By default those of the values, but at most 1.5 interquartile
        ranges of the area beyond the quartiles, which the singular edge of a punch exceeds;
        the scalar bar ends in a point there.
    cmap : str
        Name of a matplotlib colour map.
    edges : bool
        Whether to draw the edges of the cells.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        It has ``show()``; ``ax.figure.savefig("pressure.pdf")`` writes a file.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError, ValueError
        If ``basis`` is of another kind, the values are not finite or not one per DOF, or
        ``clim`` is not increasing.
    """
    field = Field.from_basis(basis, values)
    low, high, below, beyond = color_range(field, clim)
    ax = _prepare(ax, field.p)
    # antialiasing would leave white seams between the triangles of one cell
    kind: dict[str, Any] = {"antialiased": False} if field.flat else {"shading": "gouraud"}
    colored = ax.tripcolor(
        _triangulation(field),
        field.values,
        cmap=cmap,
        vmin=low,
        vmax=high,
        rasterized=True,  # thousands of triangles become one image inside a vector graphic
        **kind,
    )
    if edges:
        width = 0.7 * fineness(len(np.unique(field.cells)))
        _lines(ax, field.p, field.ribs, OUTLINE, width)
    _lines(ax, field.p, field.outline, OUTLINE, 1.2)
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[below, beyond]
    exponent = common_exponent([low, high])
    bar = _bar(ax, colored, title_with_factor(title, exponent), extend=extend)
    ticks = bar.get_ticks()
    ticks = ticks[(ticks >= low) & (ticks <= high)]
    bar.set_ticks(ticks, labels=short_numbers(ticks, exponent))
    return ax


def isobars(
    basis: CellBasis,
    values,
    levels: int | Sequence[float] | ndarray | None = None,
    *,
    title: str | None = None,
    labels: bool = True,
    cmap: str = COLORMAP,
    ax: Axes | None = None,
) -> Axes:
    """Draw bands between isobars of a continuous field, the isobars and their values.

    Parameters
    ----------
    basis : CellBasis
        A continuous basis of first order (ElementTriP1 or ElementQuad1).
    values : (N,) array of float
        One value per DOF.
    levels : int or sequence of float, optional
        The values of the isobars, or how many. By default eight round numbers that part the
        area about equally.
    title : str, optional
        Quantity and unit, beside the scalar bar; big numbers get a common factor there.
    labels : bool
        Whether to write the values on the isobars, once each where there is room.
    cmap : str
        Name of a matplotlib colour map.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        It has ``show()``; ``ax.figure.savefig("isobars.pdf")`` writes a file.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError, ValueError
        If ``basis`` is of another kind, the values are constant, not finite or not one per DOF,
        or the levels do not increase or none is between the values.
    """
    field = Field.from_basis(basis, values, CONTINUOUS)
    chosen = choose_levels(field, levels)
    exponent = common_exponent(chosen)
    texts = short_numbers(chosen, exponent)
    ax = _prepare(ax, field.p)
    triangles = _triangulation(field)
    # matplotlib fills between at least two levels: the ends of the range are levels too
    filled = np.concatenate([[field.values.min()], chosen, [field.values.max()]])
    inside = (chosen > filled[0]) & (chosen < filled[-1])
    colors = band_colors(cmap, len(chosen) + 1)
    single = len(chosen) == 1
    bands = ax.tricontourf(
        triangles,
        field.values,
        levels=filled if single and inside.all() else chosen,
        colors=colors,
        extend="neither" if single else "both",
    )
    lines = ax.tricontour(
        triangles,
        field.values,
        levels=chosen,
        colors=OUTLINE,
        linewidths=0.7,
        linestyles="solid",
    )
    _lines(ax, field.p, field.outline, OUTLINE, 1.4)
    if labels:
        from matplotlib.patheffects import withStroke

        points = label_points(field, chosen)
        written = ax.clabel(
            lines,
            fmt=dict(zip(chosen, texts)),
            manual=list(points.values()),
            fontsize=8,
            colors=OUTLINE,
            inline_spacing=3,
        )
        for text in written:
            text.set_path_effects([withStroke(linewidth=1.5, foreground="#ffffff99")])
    bar = _bar(ax, bands, title_with_factor(title, exponent), spacing="uniform")
    bar.set_ticks(chosen, labels=texts)
    return ax


def plot_edge(
    coefficient: EdgeCoefficient, *, title: str | None = None, ax: Axes | None = None
) -> Axes:
    """Plot the strength of the pressure's singularity along the contours of a plan.

    Parameters
    ----------
    coefficient : EdgeCoefficient
        From ``solution.edge_coefficient()``.
    title : str, optional
        Name and unit of the coefficient, beside its axis.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        One line for each contour over the length along it, the plan to the left.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError
        If ``coefficient`` is something else.
    """
    if not isinstance(coefficient, EdgeCoefficient):
        raise TypeError(f"expected an EdgeCoefficient, got {type(coefficient).__name__}")
    plt = _pyplot()
    ax = ax or plt.figure(figsize=(6.5, 3.8), layout="compressed").add_subplot()
    contours = np.unique(coefficient.contour)
    for contour, (color, style) in zip(contours, cycle(LINES)):
        own = coefficient.contour == contour
        ax.plot(
            coefficient.arc[own],
            coefficient.values[own],
            style,
            color=color,
            label=f"contour {contour}",
        )
    if len(contours) > 1:
        ax.legend(frameon=False, fontsize=9)
    ax.set_xlim(0, coefficient.arc.max())
    low, high = min(0, 1.1 * coefficient.values.min()), max(0, 1.1 * coefficient.values.max())
    if low < high:
        ax.set_ylim(low, high)
    ax.set_xlabel("length along the contour")
    ax.set_ylabel(title or r"$\lim\, p\,\sqrt{d}$")
    ax.spines[["top", "right"]].set_visible(False)
    ax.show = plt.show  # type: ignore[union-attr]
    return ax


def _pyplot() -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError(MISSING.format("matplotlib")) from error
    return plt


def _prepare(ax: Axes | None, p: ndarray) -> Axes:
    """The axes to draw the points ``p`` in, with a method show as skfem's have."""
    plt = _pyplot()
    from matplotlib.ticker import MaxNLocator

    if ax is None:
        width, height = np.ptp(p, axis=1) / np.ptp(p, axis=1).max()
        size = (max(5.5 * width, 3.4) + 1.6, max(5.5 * height, 1.5) + 0.9)
        ax = plt.figure(figsize=size, layout="compressed").add_subplot()
    ax.set_aspect("equal")
    ax.spines[:].set_visible(False)
    for axis, extent in zip((ax.xaxis, ax.yaxis), np.ptp(p, axis=1) / np.ptp(p, axis=1).max()):
        axis.set_major_locator(MaxNLocator(1 + int(4 * extent), steps=[1, 2, 5, 10]))
    ax.ticklabel_format(useOffset=False)
    ax.tick_params(labelsize=9)
    ax.show = plt.show  # type: ignore[union-attr]
    return ax


def _triangulation(field: Field):
    from matplotlib.tri import Triangulation

    return Triangulation(field.p[0], field.p[1], field.t.T)


def _lines(
    ax: Axes, p: ndarray, facets: ndarray, color: str, width: float, label: str | None = None
) -> None:
    from matplotlib.collections import LineCollection

    lines = list(p[:, facets].transpose(2, 1, 0))
    ax.add_collection(
        LineCollection(
            lines,
            colors=color,
            linewidths=width,
            capstyle="round",
            label=label,
            clip_on=False,  # an outline lies half outside the axes
        )
    )
    ax.autoscale_view()


def _bar(ax: Axes, colored, title: str, **options):
    """A scalar bar along the longer side of the axes."""
    width, height = np.ptp(ax.dataLim.get_points(), axis=0)
    place: dict[str, Any] = (
        {"location": "bottom", "pad": 0.1, "aspect": 40, "fraction": 0.4}
        if width > 2 * height
        else {"location": "right", "pad": 0.03, "aspect": 25}
    )
    bar = ax.figure.colorbar(colored, ax=ax, label=title, **place, **options)
    bar.ax.tick_params(labelsize=9)
    return bar
