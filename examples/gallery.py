"""Running an example as a script: ``python examples/exNN_name.py [--save DIR]``."""

import argparse
from collections.abc import Callable
from pathlib import Path


def run(main: Callable, visualize: Callable) -> None:
    """Solve, print the result, and show the pictures or save them as files.

    ``visualize`` takes what ``main`` returns and gives pictures by their names, each a pyvista
    Plotter or matplotlib Axes.
    """
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--save", metavar="DIR", type=Path, help="write the pictures there")
    folder = parser.parse_args().save
    result = main()
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


def common_legend(figure, ax) -> None:
    """The legend of one panel under all of them."""
    lines, labels = ax.get_legend_handles_labels()
    figure.legend(
        lines, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=9
    )
