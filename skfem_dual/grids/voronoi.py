"""Delaunay triangulations and Voronoi cells, the classic couple of dual graphs (Fig. 2c)."""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.spatial import Delaunay, QhullError
from skfem import MeshTri

from ..arguments import LARGEST, SMALLEST, checked_points
from ..errors import MeshError
from ..messages import shown
from .checks import triangulation_conditions
from .corners import Corners, barycentres, signed_areas, unit
from .couples import GridCouple, grid_of
from .general import facet_numbers
from .partition import Partition
from .planar import MARGIN, cross, rounding
from .polygons import some
from .report import require

#: triangles flatter than this on the hull are rounding errors of points on one line
FLAT = 1e-10


def delaunay_voronoi(
    points: ArrayLike, clip: Literal["hull"] | ArrayLike | None = None
) -> GridCouple:
    """The Delaunay triangulation A of points and their Voronoi cells B.

    B satisfies Definitions 1 and 3 if and only if all triangles are acute-angled: otherwise a
    circumcentre, which is a node of B, lies outside its triangle. Test it with `check_dual`.

    Parameters
    ----------
    points : (2, n) array of float
        The points, nodes of A and centres of the cells of B.
    clip : "hull" or (2, k) array of float, optional
        What the cells of B are clipped to: the convex hull of the points, which makes the
        couple 1-type, or a convex polygon around them. By default the bounding box grown by a
        quarter on all sides.

    Returns
    -------
    GridCouple
        Cell ``i`` of B belongs to point ``i``; ``node_in_a`` is the circumcentre of each
        triangle, -1 if it was clipped away; ``unbounded`` are the cells at the hull.

    Raises
    ------
    TypeError, ValueError
        If points or ``clip`` are no numbers, or some are masked.
    MeshError
        If the points are not finite, coincide or lie on one line, or ``clip`` is not a convex
        polygon around them.

    Examples
    --------
    >>> delaunay_voronoi([[0, 2, 1, 3], [0, 0, 1.5, 1.6]])
    <skfem_dual GridCouple object>
      Kind: 2-type, B maximal
      A: 2 cells, 5 ribs, 4 nodes, area 3.05
      B: 4 cells, 13 ribs, 10 nodes, area 10.8
      Corresponded ribs: 5
      Cells of B cut off: 4
    """
    mesh = _delaunay(checked_points("points", points, least=3, error=MeshError))
    n, to_hull = mesh.p.shape[1], isinstance(clip, str) and clip == "hull"
    p, cell, indices, node_in_a = _voronoi(mesh, None if to_hull else _clip_polygon(clip, mesh.p))
    offsets = np.searchsorted(cell, np.arange(n + 1))
    facets, f2c = _ribs(cell, indices)
    a = Partition.from_mesh(mesh)
    centres = np.where(node_in_a < 0, barycentres(mesh), p[:, node_in_a])
    # a rib of B between two cells is corresponded to the facet between their points
    shared = np.nonzero(f2c[1] >= 0)[0]
    place = facet_numbers(mesh, *f2c[:, shared])
    paired = place != -1
    return GridCouple(
        "1-type" if to_hull else "maximal",
        replace(a, nodes=centres),
        grid_of(p, indices, offsets, facets, f2c, mesh.p),
        node_in_a,
        np.arange(n),
        np.stack([place[paired], shared[paired]]),
        mesh.boundary_nodes(),
    )


def _voronoi(mesh: MeshTri, clip: ndarray | None) -> tuple[ndarray, ndarray, ndarray, ndarray]:
    """Clipped Voronoi cells of a Delaunay triangulation, counter-clockwise.

    Returns the vertices, for each corner of a cell the cell and the vertex, and the vertex that
    is the circumcentre of each triangle, -1 if it was clipped away.
    """
    corners = Corners(mesh)
    hull = mesh.boundary_facets()
    starts = np.nonzero(corners.twin == -1)[0]
    starts = starts[np.argsort(corners.facet[starts])]
    onset = corners.node[starts]  # first node of each facet of the hull, domain to the left
    opposite = mesh.facets[:, hull].sum(axis=0) - onset
    # rounding errors of the clipping are relative to one
    middle, scale = mesh.p.mean(axis=1)[:, None], float(np.ptp(mesh.p, axis=1).max())
    x = (mesh.p - middle) / scale
    if clip is None:
        begin, end = x[:, onset], x[:, opposite]
    else:
        begin = (clip - middle) / scale
        end = np.roll(begin, -1, axis=1)
    lines = _half_planes(begin, end)
    beyond = (lines @ np.vstack([x, np.ones(x.shape[1])]) < -MARGIN).any(axis=0)
    if clip is not None and beyond.any():
        raise MeshError(f"expected points inside clip; {some(np.nonzero(beyond)[0])} are not")
    # first a box: it cuts the infinite cells, so that few are left for each of the others
    low, high = begin.min(axis=1), begin.max(axis=1)
    box = np.array([[1, 0, -low[0]], [-1, 0, high[0]], [0, 1, -low[1]], [0, -1, high[1]]])
    # a triangle's circumcentre; for a facet of the hull the infinite point perpendicular to it
    along = x[:, opposite] - x[:, onset]
    infinite = np.vstack([along[1], -along[0], np.zeros(len(hull))])
    vertices = _normalised(np.hstack([_circumcentres(x, mesh.t), infinite]))
    cell, indices = _fans(corners, onset, opposite)
    vertices, cell, indices = _clipped(vertices, cell, indices, np.vstack([box, lines]))
    if clip is None:
        vertices, cell, indices = _with_sites(vertices, cell, indices, x, onset)
    kept, indices = np.unique(indices, return_inverse=True)
    number = np.full(vertices.shape[1], -1)
    number[kept] = np.arange(len(kept))
    p = middle + scale * vertices[:2, kept] / vertices[2, kept]
    return p, cell, indices, number[: mesh.nelements]


def _delaunay(p: ndarray) -> MeshTri:
    if not np.ptp(p, axis=1).max() > SMALLEST or np.abs(p).max() > LARGEST:
        raise MeshError(
            f"expected different points up to {LARGEST:g} and farther apart than {SMALLEST:g}. "
            "Remedy: choose units in which sizes are near 1"
        )
    try:
        # far from the origin qhull would lose the digits that tell points apart
        # and at some sizes it overflows
        t = Delaunay(((p - p.mean(axis=1, keepdims=True)) * unit(p)).T).simplices.T
    except QhullError as error:
        raise MeshError("expected points that do not lie on one line") from error
    sides = np.sum((p[:, t] - p[:, np.roll(t, 1, axis=0)]) ** 2, axis=0)
    longest = sides.max(axis=0)
    flat = FLAT * longest + rounding(p) * np.sqrt(longest)
    t = t[:, np.abs(signed_areas(p, t)) > flat]
    if np.any(unused := np.bincount(t.ravel(), minlength=p.shape[1]) == 0):
        raise MeshError(
            f"expected different points; points {some(np.nonzero(unused)[0])} coincide with "
            "others or lie within rounding of the hull"
        )
    mesh = MeshTri(np.array(p, order="C"), np.ascontiguousarray(t, dtype=np.int32))
    require(triangulation_conditions(Corners(mesh)))
    return mesh


def _clip_polygon(clip: ArrayLike | None, p: ndarray) -> ndarray:
    """Corners of the polygon to clip to, counter-clockwise."""
    if clip is None:
        low, high = p.min(axis=1), p.max(axis=1)
        low, high = low - (high - low) / 4, high + (high - low) / 4
        return np.array([[low[0], high[0], high[0], low[0]], [low[1], low[1], high[1], high[1]]])
    if isinstance(clip, str):
        raise MeshError(f"expected clip to be 'hull' or a convex polygon, got {shown(clip)}")
    corners = checked_points("clip", clip, least=3, error=MeshError)
    sides = np.roll(corners, -1, axis=1) - corners
    corners = corners[:, sides.any(axis=0)]  # the last may be the first again
    sides = np.roll(corners, -1, axis=1) - corners
    length = np.hypot(*sides)
    margin = MARGIN + rounding(corners) / np.minimum(length, np.roll(length, -1))
    onward = np.roll(sides, -1, axis=1)
    turns = np.arctan2(cross(sides, onward), np.sum(sides * onward, axis=0))
    # all to one side and once round: not a star
    if not (np.isclose(abs(turns.sum()), 2 * np.pi) and (turns * turns.sum() > -margin).all()):
        raise MeshError(
            "expected clip to be a convex polygon. Remedy: its convex hull, or clip='hull'"
        )
    return corners if turns.sum() > 0 else corners[:, ::-1]


def _half_planes(begin: ndarray, end: ndarray) -> ndarray:
    """Rows (a, b, c) with ``a x + b y + c`` the distance to the left of each segment."""
    normal = np.stack([begin[1] - end[1], end[0] - begin[0]])
    normal /= np.hypot(*normal)
    return np.vstack([normal, -np.sum(normal * begin, axis=0)]).T


def _circumcentres(x: ndarray, t: ndarray) -> ndarray:
    """Homogeneous coordinates (x, y, w), w > 0: no division by the areas of flat triangles."""
    u, v = x[:, t[1]] - x[:, t[0]], x[:, t[2]] - x[:, t[0]]
    w, uu, vv = 2 * cross(u, v), np.sum(u**2, axis=0), np.sum(v**2, axis=0)
    centre = np.stack([v[1] * uu - u[1] * vv, u[0] * vv - v[0] * uu]) + w * x[:, t[0]]
    return np.vstack([centre, w]) * np.sign(w)


def _normalised(h: ndarray) -> ndarray:
    return h / np.abs(h).max(axis=0)


def _fans(corners: Corners, onset: ndarray, opposite: ndarray) -> tuple[ndarray, ndarray]:
    """The vertices around each node, counter-clockwise: its cell, and indices of vertices.

    At a node of the hull, first the infinite point of the facet onward and last that of the
    facet back.
    """
    n_facets, m = len(onset), len(corners.node) // 3
    cell = np.concatenate([corners.node, onset, opposite])
    vertex = np.concatenate([corners.triangle, np.tile(m + np.arange(n_facets), 2)])
    rank = np.concatenate([corners.rank, np.full(n_facets, -1), np.full(n_facets, m)])
    order = np.lexsort((rank, cell))
    return cell[order], vertex[order]


def _clipped(
    vertices: ndarray, cell: ndarray, indices: ndarray, lines: ndarray
) -> tuple[ndarray, ndarray, ndarray]:
    """Convex polygons clipped by half-planes, those that need it (Sutherland and Hodgman).

    The polygons may have infinite vertices, of homogeneous coordinate ``w = 0``. Polygons that
    share a side share its new vertex.
    """
    outside = np.zeros(vertices.shape[1], dtype=bool)
    for line in lines:
        outside |= line @ vertices < -MARGIN
    untouched, (cell, indices) = _split(cell, indices, outside[indices])
    for line in lines:
        rest, (cell, indices) = _split(cell, indices, line @ vertices[:, indices] < -MARGIN)
        following = _following(cell)
        start = line @ vertices[:, indices]
        start[np.abs(start) <= MARGIN] = 0
        cut = start * start[following] < 0
        i, j = np.sort(np.stack([indices, indices[following]])[:, cut], axis=0)
        _, one, new = np.unique(
            i.astype(np.int64) * vertices.shape[1] + j, return_index=True, return_inverse=True
        )
        # from the two sides of the line, each by the distance of the other
        one = np.nonzero(cut)[0][one]
        other = following[one]
        added = (
            np.abs(start[other]) * vertices[:, indices[one]]
            + np.abs(start[one]) * vertices[:, indices[other]]
        )
        pairs = np.stack([np.where(start >= 0, indices, -1), np.full(len(indices), -1)])
        pairs[1, cut] = vertices.shape[1] + new
        vertices = np.hstack([vertices, _normalised(added)])
        cell, indices = np.repeat(cell, 2), pairs.T.ravel()
        cell, indices = np.append(rest, [cell[indices >= 0], indices[indices >= 0]], axis=1)
    cell, indices = np.append(untouched, [cell, indices], axis=1)
    order = np.argsort(cell, kind="stable")
    return vertices, cell[order], indices[order]


def _split(cell: ndarray, indices: ndarray, wanted: ndarray) -> tuple[ndarray, ndarray]:
    """Polygons without and with a vertex that is wanted."""
    chosen = np.zeros(cell.max(initial=0) + 1, dtype=bool)
    chosen[cell[wanted]] = True
    flat = np.stack([cell, indices])
    return flat[:, ~chosen[cell]], flat[:, chosen[cell]]


def _following(cell: ndarray) -> ndarray:
    """Place of the next vertex of the same polygon, in flat arrays with polygons one by one."""
    last = np.nonzero(np.append(cell[1:] != cell[:-1], True)[: len(cell)])[0]
    following = np.arange(1, len(cell) + 1)
    following[last] = np.append(0, last + 1)[: len(last)]
    return following


def _with_sites(
    vertices: ndarray, cell: ndarray, indices: ndarray, x: ndarray, sites: ndarray
) -> tuple[ndarray, ndarray, ndarray]:
    """The sites on straight parts of the hull as vertices, as corners of it are already."""
    following = _following(cell)
    p = vertices[:, indices]
    p = p[:2] / p[2]
    to_start, to_end = p - x[:, cell], p[:, following] - x[:, cell]
    size = np.hypot(*(to_end - to_start))
    across = np.abs(cross(to_start, to_end)) <= MARGIN * np.maximum(size, MARGIN)
    place = np.nonzero(
        np.isin(cell, sites) & across & (np.sum(to_start * to_end, axis=0) < -(MARGIN**2))
    )[0]
    new = vertices.shape[1] + np.arange(len(place))
    added = np.vstack([x[:, cell[place]], np.ones(len(place))])
    return (
        np.hstack([vertices, added]),
        np.insert(cell, place + 1, cell[place]),
        np.insert(indices, place + 1, new),
    )


def _ribs(cell: ndarray, indices: ndarray) -> tuple[ndarray, ndarray]:
    """The sides of polygons, each once, and the polygons to their left and right."""
    start, end = indices, indices[_following(cell)]
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((high, low))
    start, end, cell = start[order], end[order], cell[order]
    again = (np.diff(low[order]) == 0) & (np.diff(high[order]) == 0)
    first = np.nonzero(np.append(True, ~again))[0]
    right = np.append(np.where(again, cell[1:], -1), -1)
    return np.stack([start, end])[:, first], np.stack([cell, right])[:, first]
