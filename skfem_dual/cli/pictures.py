"""The pictures asked for."""

import argparse
from typing import Any

from ..io import write_whole


def draw(options: argparse.Namespace, what: str, *args: Any, **kwargs: Any) -> None:
    """Write the pictures asked for; both libraries draw by the same names."""
    if options.png:
        from ..visuals import pyvista

        plotter = getattr(pyvista, what)(*args, **kwargs)
        write_whole(options.png, plotter.screenshot)
        plotter.close()
    if options.svg:
        from ..visuals import matplotlib

        axes = getattr(matplotlib, what)(*args, **kwargs)
        write_whole(options.svg, axes.figure.savefig)
