"""Running an example as a script: ``python examples/exNN_name.py [--save DIR]``."""

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile

import numpy as np

#: inches; as wide as a phone on a phone
WIDTH = 4.8
#: of cells beside each other
SHADES = ("#f6d9d0", "#dfe6ee", "#f0b9a8", "#c3d4e6", "#f3e3c3")
#: of all pictures: large letters and thick lines on no ground, for light pages and dark ones
STYLE = {
    "font.size": 13,
    "axes.labelsize": 13,
    "axes.titlesize": 13,
    "legend.fontsize": 11.5,
    "legend.frameon": False,
    "lines.linewidth": 2.2,
    "axes.linewidth": 1.1,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "savefig.bbox": "tight",
    "savefig.dpi": 160,
}


def run(main: Callable, visualize: Callable, **options) -> None:
    """Solve, print the result, and show the pictures or save them as files.

    ``visualize`` takes what ``main`` returns and gives pictures by their names, each some axes of
    matplotlib; the first says what the example is about. The options are those of ``main``;
    numbers among its arguments can be given on the command line too.
    """
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--save", metavar="DIR", type=Path, help="write the pictures there")
    for name, argument in inspect.signature(main).parameters.items():
        default = options.get(name, argument.default)
        if isinstance(default, (int, float)):
            parser.add_argument(f"--{name}", type=type(default), default=default)
    options |= vars(parser.parse_args())
    folder = options.pop("save")
    if folder:
        try:  # before all the work
            folder.mkdir(parents=True, exist_ok=True)
            TemporaryFile(dir=folder).close()
        except OSError as error:
            parser.exit(2, f"{parser.prog}: cannot write to {folder}: {error.strerror}\n")
    result = main(**options)
    print(result)
    pictures = drawn(visualize, result)
    if folder:
        for name, picture in pictures.items():
            save(picture, folder / name)
            print(folder / f"{name}.png")
    else:
        for picture in pictures.values():
            picture.show()


def drawn(visualize: Callable, result) -> dict:
    """The pictures of a result in the style of the gallery."""
    import matplotlib.pyplot as plt

    with plt.rc_context(STYLE):
        return visualize(result)


def save(ax, path: Path) -> None:
    """Write the figure of some axes as PNG and SVG."""
    import matplotlib.pyplot as plt

    with plt.rc_context(STYLE):
        for suffix in (".png", ".svg"):
            ax.figure.savefig(path.with_suffix(suffix))


def chart(height: float = 3.3, width: float = WIDTH):
    """Axes of a figure of their own."""
    return panels(1, 1, height, width)[0]


def panels(rows: int, columns: int, height: float, width: float = WIDTH, **options) -> np.ndarray:
    """Axes in rows in one figure, which is as high as told in all."""
    import matplotlib.pyplot as plt

    options = {"figsize": (width, height), "layout": "compressed"} | options
    _, axes = plt.subplots(rows, columns, squeeze=False, **options)
    for ax in axes.flat:
        ax.show = plt.show
    return axes.ravel()


def sheet(height: float = 3.4, width: float = WIDTH):
    """A plane to draw in, to scale and without axes."""
    ax = chart(height, width)
    ax.set_aspect("equal")
    ax.set_axis_off()
    return ax


def without_axes(ax, title: str = "") -> None:
    """A drawing of grids has no need of coordinates."""
    ax.set_axis_off()
    ax.set_title(title)


def draw_plan(mesh, ax) -> None:
    """The domain of a triangulation and its boundary."""
    from matplotlib.colors import ListedColormap

    from skfem_dual.visuals.axes import draw_segments, prepared
    from skfem_dual.visuals.style import LIGHT, OUTLINE

    prepared(ax, mesh.p)
    flat = np.zeros(mesh.nelements)
    ax.tripcolor(*mesh.p, mesh.t.T, facecolors=flat, cmap=ListedColormap([LIGHT]), rasterized=True)
    draw_segments(ax, mesh.p, mesh.facets[:, mesh.boundary_facets()], OUTLINE, 1.4)
    ax.collections[-1].set_snap(False)  # upright facets of a circle would be shifted to pixels


def fill_cells(ax, polygons) -> None:
    """Fill the cells of a grid so that neighbours are told apart, below all lines."""
    from matplotlib.collections import PolyCollection

    colors = [SHADES[i % len(SHADES)] for i in range(len(polygons))]
    corners = [polygons[i].T for i in range(len(polygons))]
    ax.add_collection(PolyCollection(corners, facecolors=colors, edgecolors="none", zorder=0))


def draw_dual(dual, ax) -> None:
    """The dual grid without its triangulation: ribs between cells, and the boundary."""
    from skfem_dual.visuals.axes import draw_segments, prepared
    from skfem_dual.visuals.style import DUAL, OUTLINE, fineness

    prepared(ax, dual.p)
    inner = dual.corresponded >= 0
    draw_segments(ax, dual.p, dual.facets[:, inner], DUAL, 1.2 * fineness(len(dual)))
    draw_segments(ax, dual.p, dual.facets[:, ~inner], OUTLINE, 1.4)


def segments(ax, p, ends, color: str, width: float, style: str = "-", **more) -> None:
    """Segments between pairs of points, ``ends`` of shape (2, k)."""
    gaps = np.full((1, ends.shape[1]), np.nan)
    x, y = (np.vstack([row[ends], gaps]).T.ravel() for row in p)
    ax.plot(x, y, style, color=color, lw=width, solid_capstyle="round", **more)


def dots(ax, p, color: str, size: float = 5, **more) -> None:
    """Points."""
    ax.plot(*p, "o", color=color, ms=size, mew=0, **more)


def legend_below(ax, columns: int = 2, **options) -> None:
    """The names of the lines of some axes below all axes of their figure."""
    lines, labels = ax.get_legend_handles_labels()
    ax.figure.legend(lines, labels, loc="outside lower center", ncols=columns, **options)
