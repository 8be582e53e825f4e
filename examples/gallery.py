"""Running an example as a script: ``python examples/exNN_name.py [--save DIR]``."""

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path

import numpy as np


def run(main: Callable, visualize: Callable, **options) -> None:
    """Solve, print the result, and show the pictures or save them as files.

    ``visualize`` takes what ``main`` returns and gives pictures by their names, each a pyvista
    Plotter or matplotlib Axes. The options are those of ``main``; numbers among its arguments can
    be given on the command line too.
    """
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--save", metavar="DIR", type=Path, help="write the pictures there")
    for name, argument in inspect.signature(main).parameters.items():
        default = options.get(name, argument.default)
        if isinstance(default, (int, float)):
            parser.add_argument(f"--{name}", type=type(default), default=default)
    options |= vars(parser.parse_args())
    folder = options.pop("save")
    result = main(**options)
    print(result)
    pictures = visualize(result)
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
        for name, picture in pictures.items():
            save(picture, folder / name)
            print(folder / f"{name}.png")
    else:
        for picture in pictures.values():
            picture.show()


def save(picture, path: Path) -> None:
    """Write a picture as PNG, one of matplotlib also as SVG."""
    if hasattr(picture, "screenshot"):
        picture.screenshot(path.with_suffix(".png"))
        picture.close()
        return
    for suffix in (".png", ".svg"):
        picture.figure.savefig(path.with_suffix(suffix), dpi=150)


def panels(n: int, width: float = 3.6, height: float = 3.9):
    """Axes beside each other in one new figure of matplotlib."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, n, figsize=(n * width, height), layout="compressed")
    for ax in axes:
        ax.show = plt.show
    return figure, axes


def without_axes(ax, title: str) -> None:
    """A drawing of grids has no need of coordinates."""
    ax.set_xticks([])
    ax.set_yticks([])
    ax.set_title(title, fontsize=10)


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


def draw_dual(dual, ax) -> None:
    """The dual grid without its triangulation: ribs between cells, and the boundary."""
    from skfem_dual.visuals.axes import draw_segments, prepared
    from skfem_dual.visuals.style import DUAL, OUTLINE, fineness

    prepared(ax, dual.p)
    inner = dual.corresponded >= 0
    draw_segments(ax, dual.p, dual.facets[:, inner], DUAL, 1.2 * fineness(len(dual)))
    draw_segments(ax, dual.p, dual.facets[:, ~inner], OUTLINE, 1.4)


def sheet(width: float = 4.2, height: float = 3.4):
    """A plane to draw in, to scale and without axes."""
    import matplotlib.pyplot as plt

    ax = plt.figure(figsize=(width, height), layout="compressed").add_subplot()
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.show = plt.show
    return ax


def segments(ax, p, ends, color: str, width: float, style: str = "-", **more) -> None:
    """Segments between pairs of points, ``ends`` of shape (2, k)."""
    gaps = np.full((1, ends.shape[1]), np.nan)
    x, y = (np.vstack([row[ends], gaps]).T.ravel() for row in p)
    ax.plot(x, y, style, color=color, lw=width, solid_capstyle="round", **more)


def dots(ax, p, color: str, size: float = 5, **more) -> None:
    """Points."""
    ax.plot(*p, "o", color=color, ms=size, mew=0, **more)


def legend_below(ax, columns: int = 2) -> None:
    """The names of the lines below a drawing."""
    ax.figure.legend(loc="outside lower center", ncols=columns, frameon=False, fontsize=9)


def common_legend(figure, ax) -> None:
    """The legend of one panel under all of them."""
    lines, labels = ax.get_legend_handles_labels()
    figure.legend(
        lines, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=9
    )
