"""Drawing grids, fields and isobars with matplotlib: figures in vector formats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, Mesh2D

from ..arguments import checked_flag
from ..contact.region import ContactRegion
from ..grids.checks import MeshReport
from ..grids.couples import GridCouple
from ..grids.dual_mesh import DualMesh
from .axes import (
    data_per_point,
    draw_segments,
    legend_below,
    letter,
    marks_on,
    prepared,
    room_for,
    scalar_bar,
    triangulation,
)
from .curves import plot_edge, plot_kern, plot_moment_rotation
from .depth import draw_interfaces, plot_profile
from .field import Field
from .isolines import label_boxes, smooth_line
from .levels import choose_levels, color_range, common_exponent, short_numbers, title_with_factor
from .offscreen import one_at_a_time
from .style import (
    COLORMAP,
    CONTACT,
    OUTLINE,
    SEPARATED,
    band_colors,
    checked_style,
    fineness,
    layers,
)
from .subject import Drawn, Subject

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: size of labels on isobars, over that of type
LETTER = 0.8
#: steps along the greater extent in which lines on the axes are looked at
FINE = 200
#: levels named beside the scalar bar, at most
TICKS = 20

__all__ = [
    "draw",
    "draw_interfaces",
    "isobars",
    "plot",
    "plot_edge",
    "plot_kern",
    "plot_moment_rotation",
    "plot_profile",
]


@one_at_a_time
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
    legend = checked_flag("legend", legend)
    drawn = list(layers(grid, nodes, report))
    ax = prepared(ax, drawn[0].p)
    for layer in drawn:
        if layer.facets is None:
            style: dict[str, Any] = {"color": layer.color, "markersize": 0.7 * layer.width}
            ax.plot(*layer.p, "o", label=layer.label, markeredgewidth=0, **style)
        else:
            draw_segments(ax, layer.p, layer.facets, layer.color, 0.6 * layer.width, layer.label)
    if legend:
        legend_below(ax, 3)
    return ax


@one_at_a_time
def plot(
    basis: CellBasis,
    values: ArrayLike,
    *,
    title: str | None = None,
    clim: Sequence[float] | None = None,
    cmap: str = COLORMAP,
    edges: bool = False,
    contact: ContactRegion | None = None,
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
    contact : ContactRegion, optional
        ``solution.contact_region``: its edge is drawn, and nothing but a neutral colour where
        the punch has lifted off.
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
        ``clim`` is not increasing; or ``contact`` is no region, or that of another plan.
    """
    checked_style(title, cmap, edges=edges)
    field = Field.from_basis(basis, values)
    pressed = field if contact is None else field.in_contact(contact)
    low, high, below, beyond = color_range(pressed, clim)
    ax = prepared(ax, field.p)
    # antialiasing would leave white seams between the triangles of one cell
    kind: dict[str, Any] = {"antialiased": False} if field.flat else {"shading": "gouraud"}
    colored = ax.tripcolor(
        triangulation(pressed),
        pressed.values,
        cmap=cmap,
        vmin=low,
        vmax=high,
        rasterized=True,  # thousands of triangles become one image inside a vector graphic
        **kind,
    )
    if edges:
        width = 0.7 * fineness(len(np.unique(field.cells)))
        draw_segments(ax, field.p, field.ribs, OUTLINE, width)
    draw_segments(ax, field.p, field.outline, OUTLINE, 1.2)
    _separation(ax, contact, field)
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[below, beyond]
    exponent = common_exponent([low, high])
    bar = scalar_bar(ax, colored, title_with_factor(title, exponent), extend=extend)
    ticks = bar.get_ticks()
    ticks = ticks[(ticks >= low) & (ticks <= high)]
    bar.set_ticks(ticks.tolist(), labels=short_numbers(ticks, exponent))
    return ax


@one_at_a_time
def isobars(
    pressure: Drawn,
    values: ArrayLike | None = None,
    levels: int | Sequence[float] | ndarray | None = None,
    *,
    title: str | None = None,
    labels: bool = True,
    cmap: str = COLORMAP,
    contact: ContactRegion | None = None,
    scale: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw bands between isobars of a continuous field, the isobars and their values.

    Parameters
    ----------
    pressure : PunchSolution, ElasticSolution, PunchesSolution or CellBasis
        A solution, whose pressure over its mean is drawn as `PunchSolution.pressure_field` has
        it, with the edge of contact; or those of neighbours, also as a sequence; or any
        continuous scalar basis, also of higher order.
    values : (N,) array of float, optional
        One value per DOF of the basis.
    levels : int or sequence of float, optional
        The values of the isobars, of a solution over ``scale``, or about how many. By default
        about eight round numbers in equal steps, zero among them where the sign changes; of a
        solution with a singular edge round numbers that divide the area about equally.
    title : str, optional
        Quantity and unit, beside the scalar bar; big numbers get a common factor there.
    labels : bool
        Whether to write the values on the isobars, once each where there is room: inside the
        plan, off other lines and labels, and off what has been plotted on ``ax``.
    cmap : str
        Name of a matplotlib colour map.
    contact : ContactRegion, optional
        Of a basis, ``solution.contact_region``: its edge is drawn, where the field falls to
        zero, and nothing but a neutral colour where the punch has lifted off.
    scale : float, optional
        What the pressure of a solution is divided by; by default its mean.
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
        If ``pressure`` is of another kind, the values are constant, not finite or not one per DOF,
        the levels do not increase or none is between the values, or ``contact`` is no region or
        that of another plan.
    """
    checked_style(title, cmap, labels=labels)
    subject = Subject.of(pressure, values, title, contact, scale)
    field, pressed = subject.field, subject.pressed
    chosen = choose_levels(pressed, levels, subject.singular)
    exponent = common_exponent(chosen)
    texts = short_numbers(chosen, exponent)
    ax = prepared(ax, field.p)
    low, high = field.p.min(axis=1), field.p.max(axis=1)
    marks = marks_on(ax, low, high, float((high - low).max()) / FINE)
    triangles = triangulation(pressed)
    # matplotlib fills between at least two levels: the ends of the range are levels too
    filled = np.concatenate([[pressed.values.min()], chosen, [pressed.values.max()]])
    inside = (chosen > filled[0]) & (chosen < filled[-1])
    colors = band_colors(cmap, len(chosen) + 1)
    single = len(chosen) == 1
    bands = ax.tricontourf(
        triangles,
        pressed.values,
        levels=filled if single and inside.all() else chosen,
        colors=colors,
        extend="neither" if single else "both",
    )
    thin = room_for(len(chosen), field.p)
    ax.tricontour(
        triangles,
        pressed.values,
        levels=chosen,
        colors=OUTLINE,
        linewidths=0.7 * thin,
        linestyles="solid",
    )
    draw_segments(ax, field.p, field.outline, OUTLINE, 1.4 * thin)
    _separation(ax, subject.contact, field)
    bar = scalar_bar(ax, bands, title_with_factor(subject.title, exponent), spacing="uniform")
    every = -(-len(chosen) // TICKS)
    bar.set_ticks(chosen[::every].tolist(), labels=texts[::every])
    if labels:
        size = letter(LETTER) * data_per_point(ax)
        _labels(ax, label_boxes(pressed, chosen, texts, size, marks), texts)
    return ax


def _labels(ax: Axes, boxes: dict[int, ndarray], texts: list[str]) -> None:
    """The values of isobars in the middles of their boxes."""
    box = {"boxstyle": "square,pad=0.1", "facecolor": "#ffffff99", "edgecolor": "none"}
    style: dict[str, Any] = {
        "fontsize": letter(LETTER),
        "color": OUTLINE,
        "ha": "center",
        "va": "center",
    }
    for i, corners in boxes.items():
        x, y = corners.mean(axis=1)
        ax.text(x, y, texts[i], bbox=box, zorder=4, **style)


def _separation(ax: Axes, contact: ContactRegion | None, field: Field) -> None:
    """The area out of contact, and the edge between."""
    if contact is None or not contact.edge:
        return
    whole = np.zeros(field.p.shape[1])
    options: dict[str, Any] = {"levels": [-1, 1], "colors": [SEPARATED], "zorder": 0.5}
    ax.tricontourf(triangulation(field), whole, **options)
    for line in contact.edge:
        ax.plot(*smooth_line(line), color=CONTACT, linewidth=2.2, zorder=3)
