"""The edge of a plan: its ribs, and the distance to them."""

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..kernels.compiled import inputs, vectorised
from .partition import Partition
from .polygons import readonly

#: pairs of a point and a segment that are looked at one by one, in some milliseconds
ONE_BY_ONE = 2**22
#: points from which on threads look for the nearest, as starting them takes its time
MANY = 5000


def distance_to_segments(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """Distance of points to the nearest of some segments.

    Parameters
    ----------
    x : (2, m) array of float
        The points.
    a, b : (2, n) array of float
        Ends of the segments, n > 0.

    Returns
    -------
    (m,) array of float
        Exact up to rounding; the cost is nearly linear in m where there are many.
    """
    if x.shape[1] * a.shape[1] <= ONE_BY_ONE:
        distance = np.empty(x.shape[1])
        _least_distances(*inputs(x, a, b - a), distance)
        return distance
    half = np.hypot(*(b - a)) / 2
    workers = -1 if x.shape[1] > MANY else 1
    # the nearest point is an end of a segment, or the foot of a perpendicular: then the middle is
    # not farther than the hypotenuse of the distance and half the length. Segments of one octave
    # of lengths at a time, so that this leaves few candidates
    distance = cKDTree(np.hstack([a, b]).T).query(x.T, workers=workers)[0]
    octave = np.round(np.log2(half / half.max()).clip(-60))
    for level in np.unique(octave):
        mine = np.nonzero(octave == level)[0]
        tree, reach = cKDTree(((a + b)[:, mine] / 2).T), half[mine].max()
        radius = 1.000001 * np.hypot(distance, reach)
        near = tree.query_ball_point(x.T, radius, workers=workers)
        pairs = np.repeat(np.arange(len(near)), [len(candidates) for candidates in near])
        segment = mine[np.concatenate([*near, np.empty(0)]).astype(int)]
        np.minimum.at(distance, pairs, _distance(x[:, pairs], a[:, segment], b[:, segment]))
    return distance


def _distance(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """Distance of each point to its segment."""
    along, offset = b - a, x - a
    s = np.sum(offset * along, axis=0) / np.sum(along**2, axis=0).clip(np.finfo(float).tiny)
    return np.hypot(*(offset - np.clip(s, 0, 1) * along))


@vectorised
def _least_distances(x, a, along, distance):
    """Distances of points to the nearest of segments from ``a`` by ``along``."""
    distance[:] = np.inf
    for k in range(a.shape[1]):
        ax, ay, lx, ly = a[0, k], a[1, k], along[0, k], along[1, k]
        square = max(lx * lx + ly * ly, 1e-300)
        for i in range(x.shape[1]):
            dx, dy = x[0, i] - ax, x[1, i] - ay
            s = min(max((dx * lx + dy * ly) / square, 0.0), 1.0)
            dx, dy = dx - s * lx, dy - s * ly
            distance[i] = min(distance[i], dx * dx + dy * dy)
    for i in range(x.shape[1]):
        distance[i] = np.sqrt(distance[i])


def edge_ribs(partition: Partition) -> ndarray:
    """Ribs on the edge of a plan: with a cell on one side only, and none in the same place.

    In a polar grid the two banks of the seam and the points in the middle are no edge.
    """
    ribs = np.nonzero(partition.f2c[1] == -1)[0]
    a, b = partition.polygons.p[:, partition.facets[:, ribs]].swapaxes(0, 1)
    length = np.hypot(*(b - a))
    size = np.sqrt(partition.areas.sum())
    real = length > 1e-12 * size
    ends = np.vstack([np.minimum(a, b), np.maximum(a, b)])[:, real].T
    pairs = cKDTree(ends).query_pairs(1e-10 * size, output_type="ndarray")
    return readonly(np.delete(ribs[real], np.unique(pairs)), np.int32)
