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
