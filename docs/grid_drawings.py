"""Drawings of grids, and what all drawings have in common."""

from collections.abc import Callable

import numpy as np
from gallery import dots, legend_below, segments, sheet
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from skfem import MeshTri

from skfem_dual import (
    DualMesh,
    general_triangulation,
    maximal_couple,
    minimal_couple,
    rectangular_couple,
)
from skfem_dual.grids.corners import barycentres
from skfem_dual.grids.generate import disc
from skfem_dual.visuals.matplotlib import draw
from skfem_dual.visuals.style import DUAL, FAULT, LIGHT, OUTLINE, PRIMAL

#: fills cells of the triangulation that are marked out, as LIGHT does those of dual grids
GREY = "#e4e4e4"
NOTE = {"fontsize": 9.5, "color": OUTLINE}
WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}

DRAWINGS: dict[str, Callable[[], Axes]] = {}


def drawing(function: Callable[[], Axes]) -> Callable[[], Axes]:
    """Let `draw_all` know of a drawing; its file has the name of the function."""
    DRAWINGS[function.__name__] = function
    return function


def fill(ax: Axes, corners, color: str) -> None:
    """A filled polygon below all lines, corners of shape (2, k)."""
    ax.add_patch(Polygon(corners.T, facecolor=color, edgecolor="none", zorder=0))


def patch(seed: int = 3) -> MeshTri:
    """Irregular triangles around the origin that reach beyond the drawings."""
    rng = np.random.default_rng(seed)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(9), np.arange(9), indexing="ij"))
    p = np.stack([i - 4 + 0.5 * (j - 4), np.sqrt(3) / 2 * (j - 4)])
    p = p + rng.uniform(-0.16, 0.16, p.shape)
    k = np.flatnonzero((i < 8) & (j < 8))
    t = np.hstack([[k, k + 9, k + 1], [k + 9, k + 10, k + 1]])
    return MeshTri(p, np.ascontiguousarray(t, dtype=np.int32))


def hexagon() -> MeshTri:
    """Six nodes around one, and six around these: an irregular hexagon of 24 triangles."""
    angle = np.pi / 3 * np.arange(6)
    inner = np.stack([np.cos(angle + 0.1), 0.9 * np.sin(angle + 0.1)])
    corner = 2.05 * np.stack([np.cos(angle), 0.92 * np.sin(angle)])
    middle = (corner + np.roll(corner, -1, axis=1)) / 2
    p = np.hstack([[[0.05], [0.0]], inner, corner, middle])
    k = np.arange(6)
    one, two, three = k + 1, k + 7, k + 13
    following = np.roll(one, -1)
    t = np.hstack(
        [
            [0 * k, one, following],
            [one, following, three],
            [one, two, three],
            [following, three, np.roll(two, -1)],
        ]
    )
    return MeshTri(p, np.ascontiguousarray(t, dtype=np.int32))


def cell(partition, i: int) -> np.ndarray:
    """Corners of a cell, shape (2, k)."""
    polygons = partition.polygons
    return polygons.p[:, polygons.indices[polygons.offsets[i] : polygons.offsets[i + 1]]]


@drawing
def definition1() -> Axes:
    """A window into two grids on the whole plane."""
    ax, dual = sheet(3.7, 4.2), DualMesh.from_mesh(patch())
    mesh = dual.mesh
    node = int(np.argmin(np.hypot(*(mesh.p - [[-0.7], [0.45]]))))
    triangle = int(np.argmin(np.hypot(*(barycentres(mesh) - [[0.95], [-0.5]]))))
    fill(ax, cell(dual.partition, node), LIGHT)
    fill(ax, mesh.p[:, mesh.t[:, triangle]], GREY)
    segments(ax, mesh.p, mesh.facets, PRIMAL, 1.2, label="grid A")
    ribs = dual.facets[:, dual.corresponded >= 0]
    segments(ax, dual.p, ribs, DUAL, 1.2, label="grid B")
    dots(ax, mesh.p, OUTLINE, label="nodes of A")
    dots(ax, dual.p[:, : mesh.nelements], DUAL, 4, label="nodes of B")
    facet = int(np.argmin(np.hypot(*(dual.crossings - [[0.75], [0.75]]))))
    segments(ax, mesh.p, mesh.facets[:, [facet]], OUTLINE, 3)
    segments(ax, dual.p, dual.facets[:, [facet]], DUAL, 3)
    x, y = dual.crossings[:, facet]
    ax.annotate(
        "corresponded\nribs $l$ and $l^*$",
        (x, y),
        (0.5, 1.17),
        bbox=WHITE,
        arrowprops={"arrowstyle": "-", "color": OUTLINE, "lw": 0.8},
        **NOTE,
    )
    ax.set_xlim(-1.75, 1.75)
    ax.set_ylim(-1.35, 1.6)
    legend_below(ax)
    return ax


@drawing
def definition2() -> Axes:
    """A triangulation and the dual grid that fills the same domain."""
    ax, dual = sheet(3.7, 4.2), DualMesh.from_mesh(hexagon())
    mesh = dual.mesh
    inner, boundary = 0, 7
    fill(ax, cell(dual.partition, inner), LIGHT)
    fill(ax, cell(dual.partition, boundary), LIGHT)
    edge = mesh.f2t[1] == -1
    segments(ax, mesh.p, mesh.facets[:, ~edge], PRIMAL, 1.2, label="grid A")
    segments(ax, dual.p, dual.facets[:, dual.corresponded >= 0], DUAL, 1.6, label="grid B")
    segments(ax, mesh.p, mesh.facets[:, edge], OUTLINE, 2, label="edge of both")
    dots(ax, mesh.p, OUTLINE, label="nodes of A")
    dots(ax, dual.p[:, : mesh.nelements + dual.nboundary], DUAL, 4)
    ax.text(0.13, 0.1, "$P_i$", **NOTE)
    ax.text(1.83, 0.1, "$P_k$", ha="right", **NOTE)
    legend_below(ax)
    return ax


@drawing
def definition3() -> Axes:
    """Rectangular grids on domains of their own."""
    x, y = np.array([0, 1.0, 1.9, 3.0, 4.0]), np.array([0, 0.9, 2.0, 3.0])
    around = np.zeros((5, 4), dtype=bool)
    around[1:-1, 1:-1] = True
    around[0, 1:3] = around[1:4, 0] = around[0, 0] = True
    return couple_sheet(rectangular_couple(x, y, around=around))


def couple_sheet(couple) -> Axes:
    """Both grids of a couple with their nodes."""
    ax = sheet(3.7, 4.2)
    segments(ax, couple.a.polygons.p, couple.a.facets, PRIMAL, 1.4, label="grid A")
    segments(ax, couple.b.polygons.p, couple.b.facets, DUAL, 1.4, label="grid B")
    dots(ax, couple.a.polygons.p, OUTLINE, label="nodes of A")
    dots(ax, couple.b.polygons.p, DUAL, 4, label="nodes of B")
    legend_below(ax)
    return ax


@drawing
def definition4_minimal() -> Axes:
    """Cells around inner nodes only."""
    return couple_sheet(minimal_couple(disc(n=19)))


@drawing
def definition4_maximal() -> Axes:
    """Cells around all nodes, beyond the domain of A."""
    return couple_sheet(maximal_couple(disc(n=19)))


@drawing
def corresponded_ribs() -> Axes:
    """A facet, its rib and where they cross; the rib of a facet on the edge."""
    ax = sheet(3.0, 4.4)
    p = np.array([[0.0, 2.2, 0.9, 1.3], [0.0, 0.1, 1.6, -1.5]])
    a, b, c, d = p.T
    left, right = (a + b + c) / 3, (a + b + d) / 3
    fill(ax, np.stack([a, right, b, left], axis=1), LIGHT)
    for start, end in ((a, c), (c, b), (b, d), (d, a)):
        ax.plot(*zip(start, end, strict=True), color=PRIMAL, lw=1.2)
    ax.plot(*zip(a, b, strict=True), color=OUTLINE, lw=2.4)
    ax.plot(*zip(left, right, strict=True), color=DUAL, lw=2.4)
    s = np.linalg.solve(np.stack([b - a, left - right], axis=1), left - a)[0]
    x = a + s * (b - a)
    dots(ax, p, OUTLINE, 6)
    dots(ax, np.stack([left, right], axis=1), DUAL, 6)
    ax.plot(*x, "s", color=OUTLINE, ms=5)
    for name, place, (dx, dy) in (
        ("$a$", a, (-0.2, 0.0)),
        ("$b$", b, (0.1, 0.0)),
        ("$C_L$", left, (0.1, 0.1)),
        ("$C_R$", right, (0.1, -0.25)),
        ("$X$", x, (0.1, 0.1)),
    ):
        ax.text(place[0] + dx, place[1] + dy, name, **NOTE)
    ax.text(0.55, -0.2, "facet $l$", ha="center", **NOTE)
    ax.text(1.22, -0.22, "rib $l^*$", **NOTE)
    # on the edge
    q = np.array([[3.3, 4.9, 4.2], [-0.7, -0.5, 0.9]])
    a, b, c = q.T
    centre, middle = q.mean(axis=1), (a + b) / 2
    for start, end in ((a, c), (c, b)):
        ax.plot(*zip(start, end, strict=True), color=PRIMAL, lw=1.2)
    ax.plot(*zip(a, b, strict=True), color=OUTLINE, lw=2.4)
    ax.plot(*zip(centre, middle, strict=True), color=DUAL, lw=2.4)
    dots(ax, q, OUTLINE, 6)
    dots(ax, centre[:, None], DUAL, 6)
    ax.plot(*middle, "s", color=OUTLINE, ms=5)
    ax.text(centre[0] + 0.1, centre[1] + 0.05, "$C$", **NOTE)
    ax.text(middle[0] - 0.05, middle[1] - 0.3, "$D = X$", **NOTE)
    ax.text(4.1, -1.25, "edge of the domain", ha="center", **NOTE)
    return ax


@drawing
def median_dual() -> Axes:
    """The cell of the paper and that of finite volumes around one node."""
    ax, mesh = sheet(3.7, 4.2), patch(5)
    dual = DualMesh.from_mesh(mesh)
    node = int(np.argmin(np.hypot(*mesh.p)))
    facets = np.nonzero((mesh.facets == node).any(axis=0))[0]
    fill(ax, cell(dual.partition, node), LIGHT)
    segments(ax, mesh.p, mesh.facets, PRIMAL, 1.2)
    ribs = dual.facets[:, facets]
    segments(ax, dual.p, ribs, DUAL, 2.2, label="cell of the paper")
    middles = mesh.p[:, mesh.facets[:, facets]].mean(axis=1)
    both = np.hstack([dual.p, middles])
    last = dual.p.shape[1] + np.arange(len(facets))
    pairs = np.hstack([[ribs[0], last], [last, ribs[1]]])
    segments(ax, both, pairs, FAULT, 1.8, "--", label="median dual cell")
    dots(ax, mesh.p, OUTLINE, 5, label="nodes")
    ax.plot(*middles, "s", color=FAULT, ms=4.5, label="middles of facets")
    dots(ax, dual.p[:, np.unique(ribs)], DUAL, 5)
    ax.set_xlim(-1.0, 1.0)
    ax.set_ylim(-0.85, 0.85)
    legend_below(ax)
    return ax


@drawing
def refinement() -> Axes:
    """The common refinement of both grids."""
    ax, dual = sheet(3.7, 4.2), DualMesh.from_mesh(hexagon())
    fine, mesh = dual.refinement, dual.mesh
    triangle = 0
    for k in range(6):
        number = 6 * triangle + k
        fill(ax, fine.p[:, fine.t[:, number]], GREY if k % 2 else LIGHT)
    segments(ax, fine.p, fine.facets, "#c9c9c9", 0.8, label="common refinement")
    segments(ax, mesh.p, mesh.facets, OUTLINE, 1.4, label="triangles")
    ribs = dual.facets[:, dual.corresponded >= 0]
    segments(ax, dual.p, ribs, DUAL, 1.6, label="dual cells")
    ax.plot(*dual.crossings, "s", color=OUTLINE, ms=3.5, label="crossings $X$")
    legend_below(ax)
    return ax


@drawing
def general() -> Axes:
    """The general triangulation."""
    ax, dual = sheet(3.7, 4.2), DualMesh.from_mesh(hexagon())
    whole = general_triangulation(dual)
    segments(ax, whole.p, whole.facets, PRIMAL, 1.3, label="general triangulation")
    dots(ax, whole.p[:, len(dual) :], DUAL, 5, label="nodes of the dual grid")
    dots(ax, dual.mesh.p, OUTLINE, 5, label="nodes of the triangulation")
    legend_below(ax, 1)
    return ax


@drawing
def collocation() -> Axes:
    """Centroids of cells and the nodes they belong to."""
    ax, dual = sheet(3.7, 4.2), DualMesh.from_mesh(hexagon())
    segments(ax, dual.p, dual.facets, DUAL, 1.2, label="dual cells")
    dots(ax, dual.mesh.p, OUTLINE, 5, label="nodes")
    style = {"color": FAULT, "ms": 7, "mew": 1.6, "label": "centroids"}
    ax.plot(*dual.centroids, "x", **style)
    legend_below(ax)
    return ax


def graded(grading) -> Axes:
    """A triangulation of a disc."""
    ax = sheet(2.8, 2.9)
    draw(disc(n=200, graded=grading), ax=ax, legend=False)
    return ax


@drawing
def graded_not() -> Axes:
    """Near uniform."""
    return graded(None)


@drawing
def graded_by_ratio() -> Axes:
    """Facets of the boundary a fifth as long as the largest."""
    return graded(0.2)


@drawing
def graded_by_law() -> Axes:
    """Drawn to the edge."""
    return graded("sine")
