"""Points, segments and polygons in the plane: which contain, cross or cover each other."""

from collections.abc import Iterator
from itertools import chain

import numpy as np
from numpy import ndarray
from scipy.spatial import ConvexHull, cKDTree
from skfem import Mesh

from .polygons import Polygons

#: what is nearer than this part of a segment or polygon counts as touching it
MARGIN = 1e-10
#: angle up to which facets from one node lie along each other, where coordinates have six digits
ALONG = 1e-5
#: pairs of segments looked at together, for the memory to stay small
CHUNK = 2**20


def cross(u: ndarray, v: ndarray) -> ndarray:
    """The third component of the vector product."""
    return u[0] * v[1] - u[1] * v[0]


def convex_hull(p: ndarray) -> ndarray:
    """Vertices of the convex hull of points (2, n), counter-clockwise, shape (2, k)."""
    middle = (p.min(axis=1) + p.max(axis=1)) / 2  # far from the origin digits would be lost
    return p[:, ConvexHull((p - middle[:, None]).T).vertices]


def directed_sides(mesh: Mesh, facets: ndarray) -> tuple[ndarray, ndarray]:
    """Begin and end of k facets on the boundary, with the domain on their left, shape (2, k); and
    the middles of their elements, (2, k)."""
    a, b = mesh.facets[:, facets]
    inside = mesh.p.take(mesh.t.take(mesh.f2t[0, facets], axis=1), axis=1).mean(axis=1)
    begin = mesh.p.take(a, axis=1)
    on_left = cross(mesh.p.take(b, axis=1) - begin, inside - begin) > 0
    return np.where(on_left, [a, b], [b, a]), inside


def rounding(*points: ndarray) -> float:
    """How far coordinates of this magnitude may lie from where they should be."""
    return 8 * np.finfo(float).eps * max(np.abs(p).max(initial=0.0) for p in points)


def ragged(counts: ndarray) -> tuple[ndarray, ndarray]:
    """Owner of each item, and its position there, if owner ``i`` has ``counts[i]`` items.

    >>> [a.tolist() for a in ragged(np.array([2, 0, 3]))]
    [[0, 0, 2, 2, 2], [0, 1, 0, 1, 2]]
    """
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]


def containing(polygons: Polygons, x: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """Which polygons contain the points of shape (2, m), or come near to them.

    Returns
    -------
    polygon, point : (k,) array of int
        The pairs of which the point lies in the circle around the polygon.
    depth : (k,) array of float
        Distance of the point from the boundary of the polygon over its thickness, the area over
        the radius of that circle;
        negative outside, and zero where rounding of the coordinates hides the side.
    """
    starts, p = polygons.offsets[:-1], polygons.p[:, polygons.indices]
    middle = (np.minimum.reduceat(p, starts, axis=1) + np.maximum.reduceat(p, starts, axis=1)) / 2
    far = np.hypot(*(p - np.repeat(middle, polygons.sizes, axis=1)))
    radius = np.maximum.reduceat(far, starts)
    blur, thickness = rounding(x, p), polygons.areas / radius
    near = cKDTree(x.T).query_ball_point(middle.T, (1 + MARGIN) * radius + blur)
    counts = np.fromiter(map(len, near), int, len(near))
    polygon = np.repeat(np.arange(len(near)), counts)
    point = np.fromiter(chain.from_iterable(near), int, len(polygon))
    depth = _depths(polygons, polygon, x[:, point])
    return polygon, point, np.where(np.abs(depth) <= blur, 0.0, depth) / thickness[polygon]


def _depths(polygons: Polygons, polygon: ndarray, x: ndarray) -> ndarray:
    """Distance of each point from the boundary of its polygon, negative outside."""
    sizes, first = polygons.sizes[polygon], polygons.offsets[polygon]
    pair, side = ragged(sizes)
    start = polygons.p[:, polygons.indices[first[pair] + side]] - x[:, pair]
    end = polygons.p[:, polygons.indices[first[pair] + (side + 1) % sizes[pair]]] - x[:, pair]
    along = end - start
    # the ray to the right enters and leaves; a vertex on it counts once
    met = (start[1] <= 0) != (end[1] <= 0)
    met &= (cross(start, along) > 0) == (along[1] > 0)
    distance = np.hypot(*(start + projected(start, along) * along))
    starts = np.cumsum(sizes) - sizes
    inside = np.add.reduceat(met.astype(int), starts) % 2 == 1
    return np.where(inside, 1, -1) * np.minimum.reduceat(distance, starts)


def projected(start: ndarray, along: ndarray) -> ndarray:
    """Parameter of the point of each segment next to the origin."""
    size = np.sum(along**2, axis=0)
    return np.clip(-np.sum(start * along, axis=0) / np.where(size > 0, size, 1), 0, 1)


def line_crossings(a: ndarray, b: ndarray, c: ndarray, d: ndarray) -> tuple[ndarray, ndarray]:
    """Where the lines ``ab`` and ``cd`` meet: 0 at the first, 1 at the second point of each.

    Not finite for parallel lines.
    """
    u, v = b - a, d - c
    with np.errstate(divide="ignore", invalid="ignore"):
        return cross(c - a, v) / cross(u, v), cross(c - a, u) / cross(u, v)


def on_segments(x: ndarray, a: ndarray, b: ndarray) -> ndarray:
    """Which points of shape (2, m) lie on any of the segments ``ab``."""
    length = np.hypot(*(b - a))
    blur = rounding(x, a, b)
    near = cKDTree(x.T).query_ball_point((a + b).T / 2, (0.5 + MARGIN) * length + blur)
    segment, _ = ragged(np.fromiter(map(len, near), int, len(near)))
    point = np.fromiter(chain.from_iterable(near), int, len(segment))
    start, along = a[:, segment] - x[:, point], (b - a)[:, segment]
    distance = np.hypot(*(start + projected(start, along) * along))
    on = np.zeros(x.shape[1], dtype=bool)
    on[point[distance <= MARGIN * length[segment] + blur]] = True
    return on


def covered_twice(p: ndarray, facets: ndarray, inside: ndarray) -> ndarray:
    """Boundary facets at which a domain that is one-to-one locally covers a place twice.

    How often a point is covered, the winding number of the boundary around it, changes at
    boundary facets only. So it is at most one everywhere if it is one beside all of them, or
    beside every piece if others end on a facet, and if no two facets cross. Facets may touch
    or coincide: so do the sides of a slit.

    Parameters
    ----------
    p : (2, npoints) array of float
        Coordinates of the points.
    facets : (2, n) array of int
        End points of the boundary facets, the domain to the left.
    inside : (2, n) array of float
        For each facet a point with which it spans a triangle inside the domain.

    Returns
    -------
    array of int
        The facets that cross another one, or beside which another part of the domain lies.
    """
    if _is_convex(p, facets):
        return np.empty(0, dtype=int)
    # turned for the sweep along y: rows of facets in the direction of an axis are common
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    middle = p[:, facets].mean(axis=(1, 2))[:, None]
    a, b = (turn @ (p[:, end] - middle) for end in facets)
    blur = rounding(p.take(facets, axis=1))
    crossed, facet, place = _met(a, b, blur)
    # pieces of the facets between the places where others end on them
    n = facets.shape[1]
    facet, place = np.append(np.arange(n), facet), np.append(np.zeros(n), place)
    order = np.lexsort((place, facet))
    facet, place = facet[order], place[order]
    last = np.append(facet[1:] != facet[:-1], True)
    after = np.where(last, 1, np.append(place[1:], 1))
    full = after - place > MARGIN + blur / np.hypot(*(b - a)[:, facet])
    facet, t, part = facet[full], ((place + after) / 2)[full], (after - place)[full]
    x = a[:, facet] + t * (b - a)[:, facet]
    x += np.minimum(1e-4, 0.3 * part) * ((turn @ (inside - middle))[:, facet] - x)
    return np.union1d(crossed, facet[_winding_numbers(x, a, b, facet) != 1])


def hanging(p: ndarray, facets: ndarray, element: ndarray) -> ndarray:
    """Nodes that boundary facets (2, n) join to a node from which another one passes them.

    Elements beside such a facet are not cut where those on its other side are. The two sides of
    a slit end in one node as well, but in the same nodes beside it; those of a sharp tip are
    sides of one ``element``, of which there is one for each facet.
    """
    node, other = np.hstack([facets, facets[::-1]])
    element = np.tile(element, 2)
    along = p.take(other, axis=1) - p.take(node, axis=1)
    length, angle = np.hypot(*along), np.arctan2(*along)
    margin = ALONG + rounding(p) / length
    # once more from the other side, where angles begin again
    again = np.tile(np.arange(len(node)), 2)
    angle = np.append(angle, angle + 2 * np.pi)
    order = np.lexsort((angle, node[again]))
    i, j = again[order[:-1]], again[order[1:]]
    shorter = np.where(length[i] < length[j], i, j)
    beside = (node[i] == node[j]) & (np.diff(angle[order]) <= margin[shorter])
    beside &= element[i] != element[j]
    differ = np.abs(length[i] - length[j]) > margin[shorter] * length[shorter]
    return np.unique(other[shorter[beside & differ]])


def self_crossing(polygons: Polygons) -> ndarray:
    """Numbers of the polygons of which two sides cross."""
    crossed, blur = [np.empty(0, int)], rounding(polygons.p)
    for first, polygon, pair in _blocks(polygons.sizes**2):
        number = first + polygon
        size, begin = polygons.sizes[number], polygons.offsets[number]
        i, j = pair // size, pair % size
        number, size, begin, i, j = (k[i < j] for k in (number, size, begin, i, j))
        a, b, c, d = (
            polygons.p[:, polygons.indices[begin + k % size]] for k in (i, i + 1, j, j + 1)
        )
        crossed.append(number[_cuts(_sides(a, b, c, d, blur))])
    return np.unique(np.concatenate(crossed))


def _sides(a: ndarray, b: ndarray, c: ndarray, d: ndarray, blur: float = 0.0) -> ndarray:
    """Distances of c and d from the lines ``ab``, then of a and b from ``cd``, in the longer of
    the two segments; zero up to ``blur``, where they touch. Shape (4, m), NaN for points."""
    one, other = np.hypot(*(b - a)), np.hypot(*(d - c))
    scale = np.maximum(one, other)
    with np.errstate(invalid="ignore"):
        sides = np.array(
            [
                *(cross(b - a, end - a) / (one * scale) for end in (c, d)),
                *(cross(d - c, end - c) / (other * scale) for end in (a, b)),
            ]
        )
    sides[np.abs(sides) * scale <= MARGIN * scale + blur] = 0
    return sides


def _cuts(sides: ndarray) -> ndarray:
    """Whether the segments of `_sides` cross inside both."""
    return (sides[0] * sides[1] < 0) & (sides[2] * sides[3] < 0)


def _is_convex(p: ndarray, facets: ndarray) -> bool:
    """Whether directed facets are one closed contour that turns to the left, once."""
    each, following = np.arange(facets.shape[1]), np.full(p.shape[1], -1)
    following[facets[0]] = each
    onward = following[facets[1]]
    if onward.min(initial=0) < 0 or not np.array_equal(following[facets[0]], each):
        return False
    along = p.take(facets[1], axis=1) - p.take(facets[0], axis=1)
    after = along.take(onward, axis=1)
    turn = np.arctan2(cross(along, after), np.sum(along * after, axis=0))
    return bool(turn.min(initial=0.0) > -MARGIN and turn.sum() < 3 * np.pi)


def _met(a: ndarray, b: ndarray, blur: float) -> tuple[ndarray, ndarray, ndarray]:
    """Segments that cross others; segments on which others end, and where from 0 to 1; their
    ends may be off by ``blur``."""
    crossed, on, place = [np.empty(0, int)], [np.empty(0, int)], [np.empty(0)]
    length = np.hypot(*(b - a))
    for i, j in near_pairs(a, b):
        sides = _sides(a[:, i], b[:, i], a[:, j], b[:, j], blur)
        cuts = _cuts(sides)
        crossed += [i[cuts], j[cuts]]
        for side, k, other, end in zip(sides, (i, i, j, j), (j, j, i, i), (a, b, a, b)):
            along = (b - a)[:, k]
            t = np.sum(along * (end[:, other] - a[:, k]), axis=0) / length[k] ** 2
            margin = MARGIN + blur / length[k]
            ends = (side == 0) & (t > margin) & (t < 1 - margin)
            on.append(k[ends])
            place.append(t[ends])
    return np.unique(np.concatenate(crossed)), np.concatenate(on), np.concatenate(place)


def near_pairs(a: ndarray, b: ndarray) -> Iterator[tuple[ndarray, ndarray]]:
    """Pairs of segments whose bounding boxes meet, each pair once."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.argsort(low[1], kind="stable")
    last = np.searchsorted(low[1, order], high[1, order], side="right")
    for block, item, position in _blocks(last - 1 - np.arange(len(order))):
        i, j = order[block + item], order[block + item + 1 + position]
        meet = (low[0, i] <= high[0, j]) & (low[0, j] <= high[0, i])
        yield i[meet], j[meet]


def _winding_numbers(x: ndarray, a: ndarray, b: ndarray, own: ndarray) -> ndarray:
    """How often the segments go round each point, which is next to its ``own`` on the left."""
    order = np.argsort(x[1])
    upward = b[1] > a[1]
    low, high = (np.searchsorted(x[1, order], f(a[1], b[1])) for f in (np.minimum, np.maximum))
    winding = np.zeros(x.shape[1], dtype=int)
    for block, item, position in _blocks(high - low):
        k = block + item
        point = order[low[k] + position]
        left = cross((b - a)[:, k], x[:, point] - a[:, k]) > 0
        left |= own[point] == k  # not left to rounding
        # a segment counts where the ray to the right meets it
        np.add.at(winding, point[upward[k] & left], 1)
        np.add.at(winding, point[~upward[k] & ~left], -1)
    return winding


def _blocks(counts: ndarray) -> Iterator[tuple[int, ndarray, ndarray]]:
    """`ragged` in blocks of about `CHUNK`: first owner, owners from there on, positions."""
    total = np.cumsum(counts)
    start = 0
    while start < len(counts):
        before = total[start] - counts[start]
        end = max(start + 1, int(np.searchsorted(total, before + CHUNK, side="right")))
        yield start, *ragged(counts[start:end])
        start = end


def contours(facets: ndarray, cells: ndarray) -> tuple[ndarray, ndarray]:
    """Numbers of the contours directed facets form, ascending, and the facets in their order.

    A closed contour begins where ``cells``, one for each facet, change.
    """
    start = {int(a): i for i, a in enumerate(facets[0])}
    following = [start.get(int(b), -1) for b in facets[1]]
    before = {i: k for k, i in enumerate(following) if i != -1}
    # open contours from their beginning, then closed ones from where a cell begins
    beginnings = [i for i in range(len(following)) if i not in before]
    beginnings += [i for i in before if cells[i] != cells[before[i]]]
    contour, order, seen = [], [], set()
    for number, i in enumerate([*beginnings, *range(len(following))]):
        while i != -1 and i not in seen:
            seen.add(i)
            order.append(i)
            contour.append(number)
            i = following[i]
    return np.unique(contour, return_inverse=True)[1], np.array(order)
