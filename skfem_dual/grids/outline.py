"""The edge of a plan: its ribs, and the distance to them."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem import Mesh

from ..kernels.compiled import inputs, vectorised
from ..kernels.threads import Threads, threads_for
from .partition import Partition
from .planar import cross, directed_sides, projected, rounding
from .polygons import readonly

#: nodes of an edge that turns by less are no corners; by more than so many times their neighbours,
#: or like a hexagon, they are
LEAST_TURN, CURVED, SHARP = np.radians(15), 2.5, np.radians(59)
#: an edge that turns by as much folds back
FOLDED = np.pi - 1e-6
#: so many segments are looked at one by one, which takes less than a search in a tree
ONE_BY_ONE = 2**14
#: segments that are looked for together
CANDIDATES = 4
#: points from which on threads look for the nearest, as starting them takes its time
MANY = 5000
#: points so far off an edge are on it: over a facet, as an arc of 30 degrees rises over its chord,
#: and over the extent of the plan, as coordinates are rounded
RISE, ROUNDED = 0.066, 1e-3
#: cosine of the angle between a segment and the way to it below which it faces a point
POINTING = 0.82


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
        Exact up to rounding. Up to `ONE_BY_ONE` segments cost m times n, more nearly m and n.
    """
    if a.shape[1] <= ONE_BY_ONE:
        distance, ribs = np.full(x.shape[1], np.inf), inputs(a, b - a)

        def work(k: slice) -> None:
            _least_distances(*inputs(x[:, k]), *ribs, distance[k])

        with Threads() as run:
            run(work, x.shape[1], a.shape[1])
        return distance
    half = np.hypot(*(b - a)) / 2
    workers = threads_for(x.shape[1], MANY)
    # the nearest point is an end of a segment, or the foot of a perpendicular: then the middle is
    # not farther than the hypotenuse of the distance and half the length. Segments of one octave
    # of lengths at a time, so that this leaves few candidates
    distance = cKDTree(np.hstack([a, b]).T).query(x.T, workers=workers)[0]
    octave = np.round(np.log2(half / half.max()).clip(-60))
    for level in np.unique(octave):
        mine = np.nonzero(octave == level)[0]
        tree, reach = cKDTree(((a + b)[:, mine] / 2).T), half[mine].max()
        radius = 1.000001 * np.hypot(distance, reach)
        # most points have few candidates, and lists of them take longer than they themselves
        some = np.arange(1, min(CANDIDATES, len(mine)) + 1)
        away, found = tree.query(x.T, some, distance_upper_bound=radius.max(), workers=workers)
        point, place = np.nonzero(away <= radius[:, None])
        segment = mine[found[point, place]]
        np.minimum.at(distance, point, _distance(x[:, point], a[:, segment], b[:, segment]))
        more = np.nonzero(away[:, -1] <= radius)[0] if len(some) < len(mine) else np.empty(0, int)
        near = tree.query_ball_point(x[:, more].T, radius[more], workers=workers)
        pairs = np.repeat(more, [len(candidates) for candidates in near])
        segment = mine[np.concatenate([*near, np.empty(0)]).astype(int)]
        np.minimum.at(distance, pairs, _distance(x[:, pairs], a[:, segment], b[:, segment]))
    return distance


def near_edge(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """Whether points, (2, m), are on an edge of segments ``ab`` but for what facets cut off arcs
    and for rounded coordinates."""
    reach = RISE * np.hypot(*(b - a)) + ROUNDED * np.ptp(a, axis=1).max()
    return np.array([(_distance(i[:, None], a, b) <= reach).any() for i in x.T], dtype=bool)


def onto_segments(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """The nearest points on segments ``ab`` of points of shape (2, m)."""
    k = [int(np.argmin(_distance(i[:, None], a, b))) for i in x.T]
    a, b = a[:, k], b[:, k]
    return a + projected(a - x, b - a) * (b - a)


def inside_loops(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """Whether a ray from each point, of shape (2, m), meets an odd number of segments ``ab``."""
    inside = np.zeros(x.shape[1], dtype=bool)
    _met_by_rays(*inputs(x, a, b), inside)
    return inside


@vectorised
def _met_by_rays(x, a, b, odd):
    """Flip ``odd`` for each segment that a ray to the right meets."""
    for k in range(a.shape[1]):
        ax, ay, by = a[0, k], a[1, k], b[1, k]
        slope = (b[0, k] - ax) / (by - ay) if ay != by else 0.0
        for i in range(x.shape[1]):
            between = (ay > x[1, i]) != (by > x[1, i])
            odd[i] ^= between & (x[0, i] < ax + (x[1, i] - ay) * slope)


def _distance(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """Distance of each point to its segment."""
    return np.hypot(*(x - a - projected(a - x, b - a) * (b - a)))


@vectorised
def _least_distances(x, a, along, distance):
    """Distances, so far infinite, of points to the nearest of segments from ``a`` by ``along``."""
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
    a, b = partition.ends(ribs)
    length = np.hypot(*(b - a))
    size = np.sqrt(partition.areas.sum())
    real = length > 1e-12 * size
    ends = np.vstack([np.minimum(a, b), np.maximum(a, b)])[:, real].T
    pairs = cKDTree(ends).query_pairs(1e-10 * size, output_type="ndarray")
    return readonly(np.delete(ribs[real], np.unique(pairs)), np.int32)


def edge_facets(partition: Partition) -> ndarray:
    """Facets of the mesh on the edge of a plan, ascending: not those on seams."""
    return np.unique(partition.boundary[edge_ribs(partition)])


def places(x: ndarray, apart: float) -> ndarray:
    """Numbers of the places of points (2, n), one for those no farther apart than that."""
    pairs = cKDTree(x.T).query_pairs(apart, output_type="ndarray").T
    graph = coo_array((np.ones(pairs.shape[1]), pairs), (x.shape[1], x.shape[1]))
    return connected_components(graph)[1]


def on_ribs(partition: Partition, ribs: ndarray, other: Partition, others: ndarray) -> ndarray:
    """Which of k ribs have their middles on some ribs of other cells, (k,) array of bool."""
    a, b = partition.ends(ribs)
    size = np.sqrt(partition.areas.sum())
    return distance_to_segments((a + b) / 2, *other.ends(others)) < 1e-9 * size


class Wedges(NamedTuple):
    """Corners of a plan.

    Attributes
    ----------
    node : (k,) array of int
        Node of the mesh in each.
    x : (k, 2) array of float
        Where it is.
    bisector : (k, 2) array of float
        Unit vector into the plan, half way between the sides.
    angle : (k,) array of float
        Between the sides, through the plan.
    reach : (k,) array of float
        How far it is from the corner to an edge that faces it.
    """

    node: ndarray
    x: ndarray
    bisector: ndarray
    angle: ndarray
    reach: ndarray


def wedges(mesh: Mesh, facets: ndarray) -> Wedges:
    """Corners of the edge that consists of some facets of a mesh on its boundary.

    A polygon that follows a curve turns in all nodes alike: a corner turns by far more than the
    nodes beside it, or as much as a hexagon.
    """
    place = _places(mesh, facets)
    a, b = place[directed_sides(mesh, facets)[0]]
    along = mesh.p.take(b, axis=1) - mesh.p.take(a, axis=1)
    along = along / np.hypot(*along)
    n = mesh.p.shape[1]
    plain = (np.bincount(a, minlength=n) == 1) & (np.bincount(b, minlength=n) == 1)
    before, after = np.full((2, n), -1)
    after[a] = before[b] = np.arange(len(facets))
    node = np.nonzero(plain)[0]
    first, second = (along.take(side[node], axis=1) for side in (before, after))
    turn = np.full(n, np.inf)
    turn[node] = np.arctan2(cross(first, second), np.sum(first * second, axis=0))
    most = np.abs(turn[[a[before[node]], b[after[node]]]]).max(axis=0)
    size = np.abs(turn[node])
    keep = (size > LEAST_TURN) & ((size > CURVED * most) | (size > SHARP))
    keep &= size < FOLDED  # what lies on both sides of a line is one
    node, second, angle = node[keep], second[:, keep], np.pi - turn[node][keep]
    half = angle / 2
    bisector = np.array(
        [
            np.cos(half) * second[0] - np.sin(half) * second[1],
            np.sin(half) * second[0] + np.cos(half) * second[1],
        ]
    )
    p, q, x = mesh.p.take(a, axis=1), mesh.p.take(b, axis=1), mesh.p[:, node].T
    if not len(node):
        return Wedges(node, x, bisector.T, angle, np.empty(0))
    part = connected_components(coo_array((np.ones(mesh.nfacets), place[mesh.facets]), (n, n)))[1]
    own = {k: part[a] == k for k in np.unique(part[node])}
    reach = np.array(
        [
            _facing(x[i], bisector[:, i], float(angle[i]), p[:, own[k]], q[:, own[k]])
            for i, k in enumerate(part[node])
        ]
    )
    return Wedges(node, x, bisector.T, angle, reach)


def _places(mesh: Mesh, facets: ndarray) -> ndarray:
    """The first of nodes that are one across seams, for each node: facets on the boundary, other
    than those of the edge, that have the same ends. Parts that touch in a node alone keep it."""
    n, seams = mesh.p.shape[1], np.setdiff1d(mesh.boundary_facets(), facets)
    if not len(seams):
        return np.arange(n)
    ends, apart = mesh.facets[:, seams], 1e-10 * np.ptp(mesh.p, axis=1).max()
    middles = mesh.p.take(ends, axis=1).mean(axis=1)
    same = cKDTree(middles.T).query_pairs(apart, output_type="ndarray").T
    one, two = ends[:, same].swapaxes(0, 1)
    pairs = np.hstack([[one, two], [one, two[::-1]]]).reshape(2, -1)
    pairs = pairs[:, np.hypot(*np.subtract(*mesh.p[:, pairs].swapaxes(0, 1))) < apart]
    _, number = connected_components(coo_array((np.ones(pairs.shape[1]), pairs), (n, n)))
    return np.unique(number, return_index=True)[1][number]


def _facing(x: ndarray, bisector: ndarray, angle: float, a: ndarray, b: ndarray) -> float:
    """Distance of a corner to the nearest of some segments that do not point at it.

    Only those inside of its angle: what others face lies across a notch.
    """
    along, offset = b - a, x[:, None] - a
    way = offset - projected(-offset, along) * along
    r, length = np.hypot(*way), np.hypot(*along)
    facing = (np.abs(np.sum(way * along, axis=0)) < POINTING * r * length) & (r > 0)
    turn = np.arctan2(cross(bisector[:, None], -way), -bisector @ way)
    blur = 1e-9 + rounding(a, b) / np.where(r > 0, r, 1.0)
    facing &= np.abs(turn) < angle / 2 + blur
    # an open line ends in a node that no segment begins with
    farthest = max(np.hypot(*offset).max(), np.hypot(*(x[:, None] - b)).max())
    return float(r[facing].min(initial=farthest))
