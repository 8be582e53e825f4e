"""Colours and line widths of all pictures, and the lines a grid is drawn with."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import Mesh2D

from ..arguments import checked_flag, checked_instance, checked_text
from ..grids.checks import MeshReport, array_conditions
from ..grids.couples import GridCouple
from ..grids.dual_mesh import DualMesh
from ..grids.report import Condition, require
from ..messages import shown

#: readable in grey and by the colour-blind; of pressures and whatever is not named here
COLORMAP = "viridis"
#: darker where the ground settles more, and where stresses below are larger; of both signs
SETTLEMENT, STRESS, MOMENT = "YlGnBu", "magma_r", "RdBu_r"
OUTLINE, PRIMAL, DUAL, FAULT = "#1a1a1a", "#9a9a9a", "#c8401f", "#1f6fc8"
#: the edge of contact, and the part of a plan that has lifted off
CONTACT, SEPARATED = "#c8401f", "#ececec"
#: in space, the ground and what stands on it
GROUND, BODY = "#cdbfa8", "#b8bcc2"
#: fills areas that are marked out
LIGHT = "#f6d9d0"
MISSING = "{} is needed to draw. Remedy: pip install 'skfem-dual[visuals]'"


@dataclass(frozen=True, eq=False)
class DrawnLayer:
    """Lines, or points if ``facets`` is None, of one colour with one entry in the legend."""

    label: str
    p: ndarray
    facets: ndarray | None
    color: str
    width: float


def layers(
    grid: Mesh2D | DualMesh | GridCouple, nodes: bool, report: MeshReport | None = None
) -> Iterator[DrawnLayer]:
    """What a mesh or a couple of grids is drawn with, from the lowest layer to the highest.

    Raises
    ------
    TypeError
        If ``grid`` is neither a two-dimensional skfem mesh nor a DualMesh nor a GridCouple.
    MeshError
        If coordinates are not finite or vertices do not exist.
    """
    nodes = checked_flag("nodes", nodes)
    if report is not None:
        checked_instance("report", report, MeshReport, "check_mesh(mesh)")
    if isinstance(grid, GridCouple):
        if report is not None:
            raise ValueError("expected a report with a mesh or a DualMesh only, got a GridCouple")
        yield from _couple_layers(grid, nodes)
        return
    if not isinstance(grid, (Mesh2D, DualMesh)):
        raise TypeError(
            f"expected a MeshTri, MeshQuad, DualMesh or GridCouple to draw, got {shown(grid)}"
        )
    dual = grid if isinstance(grid, DualMesh) else None
    mesh = grid.mesh if isinstance(grid, DualMesh) else grid
    require(array_conditions(mesh))
    fine = fineness(mesh.nelements)
    kind = "triangulation" if mesh.elem.refdom.nnodes == 3 else "grid"
    yield DrawnLayer(
        kind, mesh.p, mesh.facets[:, mesh.f2t[1] != -1], PRIMAL if dual else OUTLINE, 1.2 * fine
    )
    if dual:
        yield DrawnLayer(
            "dual grid", dual.p, dual.facets[:, dual.corresponded >= 0], DUAL, 2 * fine
        )
    yield DrawnLayer("boundary", mesh.p, mesh.facets[:, mesh.boundary_facets()], OUTLINE, 2.4)
    if nodes:
        yield DrawnLayer(f"nodes of the {kind}", mesh.p, None, OUTLINE, 8 * fine)
    if nodes and dual:
        yield DrawnLayer("nodes of the dual grid", dual.p, None, DUAL, 6 * fine)
    for condition in report.violated if report else ():
        counts = {"node": mesh.p.shape[1], "facet": mesh.nfacets}
        if condition.offending.max() >= counts.get(condition.entity, mesh.nelements):
            raise ValueError("expected a report of the mesh drawn, got one of a larger mesh")
        yield from _fault_layers(mesh, condition)


def _fault_layers(mesh: Mesh2D, condition: Condition) -> Iterator[DrawnLayer]:
    """Where a condition is violated."""
    label, offenders = f"{condition.entity}s at fault", condition.offending
    if condition.entity == "node":
        yield DrawnLayer(label, mesh.p[:, offenders], None, FAULT, 10)
    elif condition.entity == "facet":
        yield DrawnLayer(label, mesh.p, mesh.facets[:, offenders], FAULT, 5)
        middles = mesh.p[:, mesh.facets[:, offenders]].mean(axis=1)
        yield DrawnLayer("their middles", middles, None, FAULT, 10)
    else:
        yield DrawnLayer(label, mesh.p[:, mesh.t[:, offenders]].mean(axis=1), None, FAULT, 10)


def _couple_layers(couple: GridCouple, nodes: bool) -> Iterator[DrawnLayer]:
    """Both grids with the ribs of their boundaries, which differ: B may reach beyond A."""
    fine = fineness(len(couple.a))
    pa, pb = couple.a.polygons.p, couple.b.polygons.p
    p = np.hstack([pa, pb])  # the first layer sets the extent of the picture
    a, b = couple.a.facets, couple.b.facets + pa.shape[1]
    edge_a, edge_b = ((grid.f2c < 0).any(axis=0) for grid in (couple.a, couple.b))
    yield DrawnLayer("grid A", p, a[:, ~edge_a], PRIMAL, 1.2 * fine)
    if couple.kind == "1-type":
        yield DrawnLayer("grid B", p, b[:, ~edge_b], DUAL, 2 * fine)
        yield DrawnLayer("boundary", p, a[:, edge_a], OUTLINE, 2.4)
    else:
        yield DrawnLayer("boundary of A", p, a[:, edge_a], OUTLINE, 2.4)
        yield DrawnLayer("grid B", p, b, DUAL, 2 * fine)
    if nodes:
        yield DrawnLayer("nodes of A", pa, None, OUTLINE, 8 * fine)
        yield DrawnLayer("nodes of B", pb, None, DUAL, 6 * fine)


def fineness(ncells: int) -> float:
    """Factor on line widths: thinner on finer grids, for what is between them to survive."""
    return float(np.clip(np.sqrt(600 / ncells), 0.25, 1))


def checked_style(title: str | None, cmap: str, **flags: bool) -> None:
    """Refuse titles that are no text, unknown colour maps and flags that are none."""
    try:
        from matplotlib import colormaps
    except ImportError as error:
        raise ImportError(MISSING.format("matplotlib")) from error
    if title is not None:
        checked_text("title", title)
    if checked_text("cmap", cmap) not in colormaps:
        raise ValueError(f"expected the name of a colour map for cmap, got {shown(cmap)}")
    for name, value in flags.items():
        checked_flag(name, value)


def band_colors(cmap: str, n: int) -> list[str]:
    """``n`` colours along a colour map, lightened for black lines and labels to read on them."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(0.3 + 0.7 * c[:3]) for c in colormaps[cmap](np.linspace(0, 1, n))]
