"""Axes of matplotlib in which plans are drawn to scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from ..contact.region import ContactRegion
from ..messages import shown
from .field import Field
from .isolines import NO_MARKS, samples, within
from .levels import roundest
from .style import MISSING, OUTLINE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar
    from matplotlib.tri import Triangulation

#: powers of ten between which coordinates are written with all their digits, as those of sites
PLAIN = -5, 9
#: heights of the letters of a legend that the ticks above it take
BELOW = 2.4
#: width of a plan over its height below which there is no room for the numbers of two ticks
NARROW = 0.15
#: and height over width
LOW = 0.045


def pyplot() -> Any:
    """matplotlib.pyplot, or an error that names the remedy."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError(MISSING.format("matplotlib")) from error
    return plt


def letter(share: float) -> float:
    """Points of a letter, as a part of the size of type in matplotlib's settings."""
    return float(share * pyplot().rcParams["font.size"])


def checked_axes(ax: Axes | None) -> Axes | None:
    """``ax`` itself, if it is one of matplotlib or None; otherwise a TypeError."""
    if ax is not None and not isinstance(ax, pyplot().Axes):
        raise TypeError(f"expected matplotlib's Axes for ax, got {shown(ax)}")
    return ax


def diagram(ax: Axes | None, size: tuple[float, float]) -> Axes:
    """Axes for curves over numbers, new ones of some inches if none are given."""
    plt = pyplot()
    ax = checked_axes(ax) or plt.figure(figsize=size, layout="compressed").add_subplot()
    ax.spines[["top", "right"]].set_visible(False)
    ax.show = plt.show  # type: ignore[union-attr]
    return ax


def prepared(ax: Axes | None, p: ndarray) -> Axes:
    """The axes to draw the points ``p`` in, with a method show as skfem's have."""
    plt = pyplot()
    ax = checked_axes(ax)
    from matplotlib.ticker import MaxNLocator

    if ax is None:
        width, height = np.ptp(p, axis=1) / np.ptp(p, axis=1).max()
        size = (max(5.5 * width, 3.4) + 1.6, max(5.5 * height, 1.5) + 0.9)
        ax = plt.figure(figsize=size, layout="compressed").add_subplot()
    ax.set_aspect("equal")
    ax.spines[:].set_visible(False)
    extents = np.ptp(p, axis=1) / np.ptp(p, axis=1).max()
    for axis, extent in zip((ax.xaxis, ax.yaxis), extents):
        axis.set_major_locator(MaxNLocator(1 + int(4 * extent), steps=[1, 2, 5, 10]))
    if extents[0] < NARROW:  # two numbers would lie on each other
        ax.set_xticks([roundest(float(p[0].min()), float(p[0].max()))])
    if extents[1] < LOW:
        ax.set_yticks([roundest(float(p[1].min()), float(p[1].max()))])
    ax.ticklabel_format(useOffset=False, scilimits=PLAIN)
    ax.tick_params(labelsize=letter(0.9))
    ax.show = plt.show  # type: ignore[union-attr]
    return ax


def inked(ax: Axes, color: str = OUTLINE) -> Any:
    """A colour of lines; for that of outlines the one of type, which any background lets see."""
    return ax.xaxis.label.get_color() if color == OUTLINE else color


def room_for(lines: int, p: ndarray) -> float:
    """Factor on widths of so many lines on either side of a plan, by what is left between them
    where it is far longer than wide."""
    extents = np.ptp(p, axis=1)
    return float(min(1.0, 100 * extents.min() / extents.max() / lines))


def triangulation(field: Field | ContactRegion) -> Triangulation:
    """The triangles for matplotlib."""
    from matplotlib.tri import Triangulation

    return Triangulation(field.p[0], field.p[1], field.t.T)


def draw_segments(
    ax: Axes, p: ndarray, facets: ndarray, color: str, width: float, label: str | None = None
) -> None:
    """Segments between pairs of points."""
    from matplotlib.collections import LineCollection

    segments = list(p[:, facets].transpose(2, 1, 0))
    ax.add_collection(
        LineCollection(
            segments,
            colors=color,
            linewidths=width,
            capstyle="round",
            label=label,
            clip_on=False,  # an outline lies half outside the axes
        )
    )
    ax.autoscale_view()


def marks_on(ax: Axes, low: ndarray, high: ndarray, step: float) -> ndarray:
    """Points of what has been plotted within a box, (2, k): along lines not farther apart than a
    step."""
    from matplotlib.collections import PathCollection

    marks = [NO_MARKS]
    for line in ax.lines:
        p = np.array(line.get_xydata(), dtype=float).T
        drawn = line.get_linestyle() not in ("None", " ", "") and p.shape[1] > 1
        segments = within(np.stack([p[:, :-1], p[:, 1:]], axis=-1), low, high)
        marks.append(samples(segments, step) if drawn else p)
    for scatter in ax.findobj(PathCollection, include_self=False):
        marks.append(np.ma.filled(scatter.get_offsets(), np.nan).reshape(-1, 2).T)
    found = np.hstack(marks)
    return found[:, np.isfinite(found).all(axis=0)]


def data_per_point(ax: Axes) -> float:
    """How much of the coordinates a point of type is, in the axes as they are laid out now."""
    figure = ax.get_figure(root=True)  # of which it may be in a part
    if figure and (layout := figure.get_layout_engine()):
        layout.execute(figure)
    ax.apply_aspect()
    pixels = ax.transData.transform([[0.0, 0.0], [1.0, 0.0]])
    return float(ax.figure.dpi / 72 / np.ptp(pixels[:, 0]))


def legend_below(ax: Axes, columns: int) -> None:
    """Names of the lines under a plan and its ticks, however high it is, in as many columns as
    the figure has room for."""
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0)}
    style: dict[str, Any] = {"frameon": False, "fontsize": letter(0.9)}
    for n in range(columns, 0, -1):
        names = ax.legend(**place, borderaxespad=BELOW, ncols=n, **style)
        if names.get_window_extent().width <= ax.figure.bbox.width:
            break


def scalar_bar(ax: Axes, colored: ScalarMappable, title: str, **options: Any) -> Colorbar:
    """A scalar bar along the longer side of the axes."""
    width, height = np.ptp(ax.dataLim.get_points(), axis=0)
    slender = max(1.0, height / (4 * width))  # sizes are parts of the width
    engine = ax.figure.get_layout_engine()
    # one that is constrained only puts the title of a bar with so much room off the figure
    compressed = engine is None or getattr(engine, "_compress", True)
    place: dict[str, Any] = (
        {
            "location": "bottom",
            "pad": 0.1,
            "aspect": max(40, 1.5 * width / height),  # long enough for its numbers
            "fraction": 0.4 if compressed else 0.15,
        }
        if width > 2 * height
        else {
            "location": "right",
            "pad": 0.03 * slender,
            "aspect": 25 * max(1.0, 0.4 * slender),
            "fraction": min(0.15 * slender, 0.5),
        }
    )
    bar = ax.figure.colorbar(colored, ax=ax, label=title, **place, **options)
    bar.ax.tick_params(labelsize=letter(0.9))
    return bar
