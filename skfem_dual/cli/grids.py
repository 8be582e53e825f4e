"""``dual MESH`` and ``check MESH``: the dual grid, and whether there is one."""

import argparse

from .. import DualMesh, check_mesh
from ..io import read_mesh, write_dual
from .pictures import draw


def dual(options: argparse.Namespace) -> tuple[int, str]:
    """``dual MESH``: census, file and picture of the dual grid."""
    grid = DualMesh.from_mesh(read_mesh(options.mesh))
    if options.vtu:
        write_dual(options.vtu, grid)
    draw(options, "draw", grid)
    return 0, "\n".join(grid.lines())


def check(options: argparse.Namespace) -> tuple[int, str]:
    """``check MESH``: what a triangulation must be to have a dual grid."""
    mesh = read_mesh(options.mesh)
    report = check_mesh(mesh)
    draw(options, "draw", mesh, report=report)
    return 0 if report.ok else 1, "\n".join(report.lines())
