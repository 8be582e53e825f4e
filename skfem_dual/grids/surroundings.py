"""The ground around a plan, cut into triangles: where its surface is looked at beside a body."""

import numpy as np
from numpy import ndarray
from scipy.spatial import Delaunay

from .corners import signed_areas
from .fan import Fan
from .outline import distance_to_segments, edge_ribs
from .partition import Partition

#: triangles along the greater extent of a plan far from it, and of its smallest part beside it, at
#: least
ACROSS = 24
#: rows of triangles before they become twice as large
ROWS = 4
#: parts of a plan beyond which triangles are larger, for their number to stay small
CROWD = 12
#: least size of triangles over the extent of the plan
LEAST = 1e-3


def surroundings(partition: Partition, fan: Fan, beyond: float) -> tuple[ndarray, ndarray]:
    """Triangles from the edge of a plan outwards, over its holes too.

    Parameters
    ----------
    partition : Partition
        The plan.
    fan : Fan
        Its triangles.
    beyond : float
        Width of the ground around it, over the greater extent of the plan.

    Returns
    -------
    p : (2, n) array of float
        Points; vertices of the edge of the plan are the first.
    t : (3, k) array of int
        Triangles, counter-clockwise.
    """
    corners = partition.facets[:, edge_ribs(partition)]
    a, b = partition.polygons.p[:, corners].swapaxes(0, 1)
    edge = partition.polygons.p[:, np.unique(corners)]
    low, high = edge.min(axis=1), edge.max(axis=1)
    size = (high - low).max()
    low, high = low - beyond * size, high + beyond * size
    least, parts = _least_extent(partition)
    finest = max(least / ACROSS, np.hypot(*(b - a)).max()) * max(1.0, (parts / CROWD) ** 0.5)
    margin = max(beyond, LEAST) * size
    if margin < finest:  # a narrow one takes triangles as small, and ribs cut in pieces
        finest = margin
        edge = np.hstack([edge, _between(a, b, finest)])
    levels = int(np.ceil(np.log2(max(size / (ACROSS * finest), 1.0))))
    # grids of twice the width of the one before where the edge is so many of these away
    points, inner = [], 0.55 * finest
    for h in finest * 2.0 ** np.arange(levels + 1):
        outer = ROWS * h if h < size / ACROSS else np.inf
        grid = _grid(edge, low, high, h, outer)
        distance = distance_to_segments(grid, a, b)
        points.append(grid[:, (distance > inner) & (distance <= outer)])
        inner = outer
    grid = np.hstack(points)
    # so far away the ribs of the edge are sides of Delaunay triangles
    grid = grid[:, fan.locate(grid) < 0]
    p = np.hstack([edge, grid])
    t = Delaunay((p - p.mean(axis=1, keepdims=True)).T).simplices.T
    t = t[:, fan.locate(p[:, t].mean(axis=1)) < 0]
    turn = 2 * signed_areas(p, t)
    full = np.abs(turn) > 1e-9 * finest**2
    return p, np.where(turn > 0, t, t[[0, 2, 1]])[:, full]


def _between(a: ndarray, b: ndarray, size: float) -> ndarray:
    """Points that cut segments from a to b, (2, n), in pieces up to a size, (2, m)."""
    pieces = np.ceil(np.hypot(*(b - a)) / size).astype(int)
    own = np.repeat(np.arange(len(pieces)), pieces - 1)
    first = np.cumsum(pieces - 1) - (pieces - 1)
    share = (np.arange(len(own)) - first[own] + 1) / pieces[own]
    return a[:, own] + share * (b - a)[:, own]


def _least_extent(partition: Partition) -> tuple[float, int]:
    """The smallest of the greater extents of the parts of a plan, and how many these are."""
    part, of = partition.parts(np.ones(len(partition), bool)), partition.polygons.indices
    part = np.repeat(np.unique(part, return_inverse=True)[1], partition.polygons.sizes)
    low, high = np.full((2, 2, part.max() + 1), [[[np.inf]], [[-np.inf]]])
    for axis, x in enumerate(partition.polygons.p[:, of]):
        np.minimum.at(low[axis], part, x)
        np.maximum.at(high[axis], part, x)
    return float((high - low).max(axis=0).min()), low.shape[1]


def _grid(edge: ndarray, low: ndarray, high: ndarray, h: float, reach: float) -> ndarray:
    """Points of a regular grid between two corners that are about ``reach`` from points of the
    edge or nearer, (2, n)."""
    steps = np.ceil((high - low) / h).astype(int)
    step = (high - low) / steps
    if np.isinf(reach):
        at = np.indices(steps + 1).reshape(2, -1)
    else:
        around = np.ceil(reach / step).astype(int)
        arms = np.stack(np.meshgrid(*(np.arange(-n, n + 1) for n in around))).reshape(2, -1)
        nodes = np.unique(np.rint((edge - low[:, None]) / step[:, None]).astype(int), axis=1)
        at = (nodes[:, :, None] + arms[:, None]).reshape(2, -1)
        at = np.unique(at, axis=1)
        at = at[:, ((at >= 0) & (at <= steps[:, None])).all(axis=0)]
    return low[:, None] + step[:, None] * at
