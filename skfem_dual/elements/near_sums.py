"""Integrals over cells, with the law of the edge in them, at points near them.

Where the law varies by a factor of up to three over a cell it stands for a polynomial, see
`law_polynomials`; it does over all cells at points outside of them. At points in or beside the
others, those at the edge, it is taken as linear on strips, see `law_strips`.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..grids.polygons import Polygons
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights
from .law_moments import Triangles
from .law_polynomials import LOWER_TERMS, TERMS
from .law_strips import Strips, kept_segments, strips_room
from .polygon_sums import KNOWN, LANES, STEP, add_sides, put_side
from .segments import Pairs, add_segments

#: steep cells are cut into strips for points nearer to centroids than so many of their radii;
#: no point of a regular mesh is just there
BESIDE = 1.23
#: nanoseconds that a point near a cell takes, about
POINT = 100


class NearSums(NamedTuple):
    """Integrals over cells at points near them, see `add_segments`.

    Attributes
    ----------
    pairs : Pairs
        Cells and the points near them.
    column : (npairs,) array of int
        The cell of each pair.
    law : (npairs,) array of float
        Of ``(w / mean(w) - 1) / r``.
    sums : (3, npairs) array of float
        With ``w / mean(w)``.
    """

    pairs: Pairs
    column: ndarray
    law: ndarray
    sums: ndarray

    @classmethod
    def from_cells(
        cls,
        partition: Partition,
        weights: EdgeWeights | None,
        cells: ndarray,
        reach: float,
        x: ndarray,
    ) -> Self:
        """Of some cells, ascending, and points nearer to them than ``reach`` of their radii;
        without weights w is constant."""
        polygons = partition.polygons
        reaches, centroids = reach * polygons.radii[cells], polygons.centroids.take(cells, axis=1)
        pairs = Pairs.within(reaches, cells, centroids, x)
        beside = (BESIDE * reaches / reach) ** 2
        size = np.sqrt(partition.areas[cells])
        outlines = inputs(polygons.p, polygons.indices, polygons.offsets)
        circles = inputs(centroids, size, beside)
        inside = Law.of(weights, polygons)
        law, sums = np.zeros(len(pairs.points)), np.zeros((3, len(pairs.points)))

        def work(k: slice) -> None:
            known = pairs, inside, outlines, circles
            _near_sums(k.start, k.stop, *known, law, sums)

        with Threads() as run:
            run(work, len(cells), POINT * len(law) // max(len(cells), 1))
        return cls(pairs, np.repeat(pairs.cells, np.diff(pairs.offsets)), law, sums)


class Law(NamedTuple):
    """How the law varies inside cells, as kernels take it.

    Attributes
    ----------
    triangles : Triangles
        Those that fill the weighted cells.
    polynomials : (k, TERMS + LOWER_TERMS) array of float
        Polynomials of the weighted cells; see `law_polynomials`.
    number : (n,) array of int
        The number of each weighted cell among them, -1 of others.
    kept : Strips
        Those of steep cells.
    pieces, sides : int
        The most triangles and sides of a cell.
    """

    triangles: Triangles
    polynomials: ndarray
    number: ndarray
    kept: Strips
    pieces: int
    sides: int

    @classmethod
    def of(cls, weights: EdgeWeights | None, polygons: Polygons) -> Self:
        """Without weights the pressure in the cells is constant."""
        n, sides = len(polygons), int(polygons.sizes.max())
        if weights is None:
            polynomials, number = inputs(
                np.empty((0, TERMS + LOWER_TERMS)), np.full(n, -1, np.int32)
            )
            none = Triangles.none(n)
            kept = Strips.of(none, np.empty((2, 0)), np.empty(0, np.int32))
            return cls(none, polynomials, number, kept, 0, sides)
        polynomials, number = inputs(weights.polynomials, weights.number)
        pieces = int(np.diff(weights.triangles.starts).max())
        return cls(weights.triangles, polynomials, number, weights.strips, pieces, sides)


@vectorised
def _near_sums(first, last, pairs, law, outlines, circles, values, sums):
    """``circles`` are centroids, roots of areas, and squares of radii in which strips serve.

    Sides, strips and points are taken from the centroid of their cell: digits are not lost far
    from the origin.
    """
    centroids, size, beside = circles
    polynomials, number, triangles = law.polynomials, law.number, law.triangles
    room, uniform = strips_room(law.kept.most, law.pieces), np.empty(0)
    sides, work = np.empty((law.sides, KNOWN)), (np.empty(TERMS), np.empty(TERMS), np.empty(TERMS))
    own, points = np.empty(LANES, np.int64), np.empty((2, LANES))
    cut, added, logs = np.empty((3, LANES)), np.empty((4, LANES)), np.empty((6, law.sides * LANES))
    for k in range(first, last):
        begin, end, j = pairs.offsets[k], pairs.offsets[k + 1], pairs.cells[k]
        if begin == end:
            continue
        middle = centroids[0, k], centroids[1, k]
        limit = -1.0
        if number[j] >= 0 and law.kept.steep[number[j]]:
            limit = beside[k]
        for near in (True, False):
            at, width = _some(begin, end, pairs.x, middle, limit, near, own, points)
            count, segments = 0, 0
            if width > 0:
                terms = uniform if near or number[j] < 0 else polynomials[number[j]]
                count = _sides(j, outlines, terms, middle, size[k], work, sides)
                if near:
                    segments = kept_segments(law.kept, number[j], triangles, j, middle, room)
            while width > 0:
                full = -(-width // STEP) * STEP
                add_sides(points[0, :full], points[1, :full], sides, count, logs, added)
                cut[:] = 0.0
                if near:
                    add_segments(points, 0, width, room[1], segments, cut)
                for i in range(width):
                    values[own[i]] = added[0, i] + cut[0, i]
                    sums[0, own[i]] = added[0, i] + added[1, i] + cut[0, i]
                    sums[1, own[i]] = added[2, i] + cut[1, i]
                    sums[2, own[i]] = added[3, i] + cut[2, i]
                at, width = _some(at, end, pairs.x, middle, limit, near, own, points)


@compiled
def _some(at, end, x, middle, limit, near, own, points):
    """Numbers and places, from the middle, of some of the points in a circle, or outside of it;
    returns where to go on and how many. The last is repeated up to a multiple of `STEP`."""
    width = 0
    while at < end and width < LANES:
        dx, dy = x[0, at] - middle[0], x[1, at] - middle[1]
        if (dx * dx + dy * dy <= limit) == near:
            own[width], points[0, width], points[1, width] = at, dx, dy
            width += 1
        at += 1
    for i in range(width, -(-width // STEP) * STEP):
        points[0, i], points[1, i] = points[0, width - 1], points[1, width - 1]
    return at, width


@compiled
def _sides(j, outlines, terms, middle, size, room, sides):
    """Put the sides of a cell, from its middle; returns how many."""
    p, indices, offsets = outlines
    cx, cy = middle
    count, last = np.int64(0), indices[offsets[j + 1] - 1]
    ax, ay = p[0, last] - cx, p[1, last] - cy
    for at in range(offsets[j], offsets[j + 1]):
        bx, by = p[0, indices[at]] - cx, p[1, indices[at]] - cy
        count = put_side(sides, count, ax, ay, bx, by, terms, size, room)
        ax, ay = bx, by
    return count
