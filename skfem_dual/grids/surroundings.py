"""The ground around a plan, cut into triangles: where its surface is looked at beside a body."""

import numpy as np
from numpy import ndarray
from scipy.spatial import Delaunay

from .corners import signed_areas
from .fan import Fan
from .outline import distance_to_segments, edge_ribs
from .partition import Partition

#: triangles along the greater extent of a plan, at least
ACROSS = 24


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
    h = max(size / ACROSS, np.hypot(*(b - a)).max())
    steps = np.ceil((high - low + 2 * beyond * size) / h).astype(int)
    lines = [
        np.linspace(lo - beyond * size, hi + beyond * size, n + 1)
        for lo, hi, n in zip(low, high, steps)
    ]
    grid = np.array(np.meshgrid(*lines)).reshape(2, -1)
    # so far away the ribs of the edge are sides of Delaunay triangles
    free = (fan.locate(grid) < 0) & (distance_to_segments(grid, a, b) > 0.55 * h)
    p = np.hstack([edge, grid[:, free]])
    t = Delaunay((p - p.mean(axis=1, keepdims=True)).T).simplices.T
    t = t[:, fan.locate(p[:, t].mean(axis=1)) < 0]
    turn = 2 * signed_areas(p, t)
    full = np.abs(turn) > 1e-9 * h**2
    return p, np.where(turn > 0, t, t[[0, 2, 1]])[:, full]
