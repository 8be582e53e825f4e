"""The pictures asked for."""

import argparse
from contextlib import closing
from typing import Any

from ..io import write_whole


def draw(
    options: argparse.Namespace, what: str, *args: Any, length: str = "", **kwargs: Any
) -> None:
    """Write the pictures asked for; both libraries draw by the same names.

    ``length`` is the unit of the axes, where that is known.
    """
    if options.png:
        from ..visuals import pyvista
        from ..visuals.scene import name_axes

        plotter = getattr(pyvista, what)(*args, **kwargs)
        with closing(plotter):
            if length:
                name_axes(plotter, f"x, y [{length}]")
            write_whole(options.png, plotter.screenshot)
    if options.svg:
        from ..visuals import matplotlib
        from ..visuals.axes import pyplot

        axes = getattr(matplotlib, what)(*args, **kwargs)
        try:
            if length:
                axes.set(xlabel=f"x [{length}]", ylabel=f"y [{length}]")
            write_whole(options.svg, axes.figure.savefig)
        finally:
            pyplot().close(axes.figure)
