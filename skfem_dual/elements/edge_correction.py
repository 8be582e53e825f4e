"""What edge-weighted cells add to the settlements under uniform ones.

Near a cell its weighted triangles are cut into strips between levels of the distance to the edge;
each strip carries its exact mean of the weight as a uniform load. Far from it the moments of the
weight act by the series of 1 / r. The matrix of edge-weighted cells is the sum of uniform entries,
a sparse near and a smooth far correction, each of which any operator can take.

The strips are this project's own; each is integrated by its ribs, see `ribs`.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, csr_matrix

from ..grids.partition import Partition
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights
from .law_moments import Triangles, by_distance, factor_at
from .moments import INSIDE, Series, far_influence, radii
from .segments import WIDTH, Pairs, add_segments, put_segment

#: points nearer to a cell's centroid than so many of its radii take the exact correction; none of
#: a regular mesh lies just there
IN_STRIPS = 2.03
#: strips in a triangle that reaches from the edge on, in proportion fewer where the weight varies
#: less, and the fewest
STRIPS, FEWEST = 16, 3


@dataclass(frozen=True, eq=False)
class EdgeCorrection:
    """Settlements under ``w / mean(w) - 1`` on each cell, to be added to those of uniform cells.

    Attributes
    ----------
    x : (2, m) array of float
        Field points.
    cells : (k,) array of int
        Weighted cells.
    far : Series
        What these do outside of their circles.
    near : (m, n) csr_matrix
        Correction near the cells, less the series.
    """

    x: ndarray
    cells: ndarray
    far: Series
    near: csr_matrix

    @classmethod
    def from_weights(
        cls, weights: EdgeWeights, coefficient: float, x: ndarray, strips: int = STRIPS
    ) -> Self:
        """Correction of a substrate with the influence ``coefficient / r`` near its origin.

        ``strips`` is their number in a triangle that reaches from the edge on.
        """
        known = weights.partition, weights, weights.cells
        near = NearSums.from_cells(*known, IN_STRIPS, x, strips)
        return cls.from_sums(weights, coefficient, x, near)

    @classmethod
    def from_sums(
        cls, weights: EdgeWeights, coefficient: float, x: ndarray, sums: "NearSums"
    ) -> Self:
        """The same by what is known near the cells, at least near all weighted ones."""
        cells, number = weights.cells, np.cumsum(weights.weighted) - 1
        unit = Series.from_weights(weights, 1.0)
        near = np.nonzero(weights.weighted[sums.column])[0]
        k = number[sums.column[near]]
        arm = sums.pairs.x[:, near] - unit.middles[:, k]
        inside = np.sum(arm * arm, axis=0) <= (IN_STRIPS / INSIDE) ** 2 * unit.squares[k]
        near, k, arm = near[inside], k[inside], arm[:, inside]
        values = sums.law[near]
        _less_series(*inputs(arm, k), unit, values)
        n = len(weights.partition)
        starts = np.searchsorted(cells[k], np.arange(n + 1))
        columns = coefficient * values, sums.pairs.points[near], starts
        (terms,) = inputs(coefficient * unit.terms)
        matrix = csc_matrix(columns, shape=(x.shape[1], n)).tocsr()
        return cls(x, cells, unit._replace(terms=terms), matrix)

    def at(self, i: ndarray) -> Self:
        """At the points with the numbers ``i`` only."""
        return replace(self, x=np.ascontiguousarray(self.x[:, i]), near=self.near[i])

    def add_to(self, matrix: ndarray) -> None:
        """Add the correction to a dense matrix of shape (m, n)."""

        def work(rows: slice) -> None:
            _add_series(*inputs(self.x[:, rows], self.cells), self.far, matrix[rows])

        with Threads() as run:
            run(work, self.x.shape[1])
        near = self.near.tocoo()
        matrix[near.row, near.col] += near.data

    def apply(self, q: ndarray) -> ndarray:
        """The correction times mean pressures ``q`` of shape (n,) or (n, k)."""
        out = np.ascontiguousarray(self.near @ q)
        columns = out.reshape(len(out), -1)
        x, own = inputs(self.x, q[self.cells].reshape(len(self.cells), -1).T)

        def work(rows: slice) -> None:
            _sum_series(*inputs(x[:, rows]), own, self.far, columns[rows])

        with Threads() as run:
            run(work, self.x.shape[1])
        return out


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
        strips: int = STRIPS,
    ) -> Self:
        """Of some cells, ascending, and points nearer to them than ``reach`` of their radii;
        without weights w is constant."""
        polygons, n = partition.polygons, len(partition)
        reaches, centroids = reach * radii(polygons)[cells], polygons.centroids[:, cells]
        pairs = Pairs.within(reaches, cells, centroids, x)
        triangles = Triangles.none(n) if weights is None else weights.triangles
        (weighted,) = inputs(np.zeros(n, dtype=bool) if weights is None else weights.weighted)
        outlines = inputs(polygons.p, polygons.indices, polygons.offsets)
        law, sums = np.zeros(len(pairs.points)), np.zeros((3, len(pairs.points)))
        pieces, sides = np.diff(triangles.starts).max(initial=1), int(polygons.sizes.max())
        most = strips, int(pieces), sides

        def work(k: slice) -> None:
            _near_sums(k.start, k.stop, pairs, triangles, weighted, outlines, most, law, sums)

        with Threads() as run:
            run(work, len(cells))
        return cls(pairs, np.repeat(cells, np.diff(pairs.offsets)), law, sums)


@vectorised
def _near_sums(first, last, pairs, triangles, weighted, outlines, most, law, sums):
    p, indices, offsets = outlines
    room = strips_room(*most)
    segments = room[2]
    for k in range(first, last):
        begin, end, j, count = pairs.offsets[k], pairs.offsets[k + 1], pairs.cells[k], 0
        if begin == end:
            continue
        if weighted[j]:
            count = strip_segments(triangles, j, most[0], room)
            add_segments(pairs.x, begin, end, segments, count, sums)
            law[begin:end] = sums[0, begin:end]
            count = 0
        for at in range(offsets[j], offsets[j + 1]):
            a = indices[at]
            b = indices[at + 1 if at + 1 < offsets[j + 1] else offsets[j]]
            count = put_segment(segments, count, p[0, a], p[1, a], p[0, b], p[1, b], 1.0)
        add_segments(pairs.x, begin, end, segments, count, sums)


@vectorised
def _less_series(arm, number, far, values):
    """Take the series off again."""
    _, squares, terms = far
    for i in range(number.shape[0]):
        k = number[i]
        values[i] -= far_influence(arm[0, i], arm[1, i], squares[k], terms, k)


@compiled
def strips_room(most, pieces, sides):
    """Room for levels and densities of a triangle cut into ``most`` strips, and for segments of a
    cell of so many pieces cut into strips, or of so many sides."""
    room = max(most, FEWEST) + 2
    return (
        np.empty((room, 4)),
        np.empty((3, room)),
        np.empty((6, max(3 * room * pieces, sides) + WIDTH)),
    )


@compiled
def strip_segments(triangles, j, most, room):
    """Sides of the strips of a cell, with ``w / mean(w) - 1`` on their left.

    Puts them into the ``room`` of `strips_room` and returns their number.
    """
    levels, strip, segments = room
    density = strip[0]
    count = 0
    for piece in range(triangles.starts[j], triangles.starts[j + 1]):
        strips, sign = cut_triangle(piece, triangles, j, most, levels, strip)
        before = 0.0
        for k in range(strips):
            ax, ay, bx, by = levels[k]
            ax1, ay1, bx1, by1 = levels[k + 1]
            here = sign * density[k]
            count = put_segment(segments, count, ax, ay, bx, by, here - before)
            count = put_segment(segments, count, bx, by, bx1, by1, here)
            count = put_segment(segments, count, ax, ay, ax1, ay1, -here)
            before = here
        ax, ay, bx, by = levels[strips]
        count = put_segment(segments, count, ax, ay, bx, by, -before)
    return count


@compiled
def cut_triangle(piece, triangles, j, most, levels, strip):
    """Cut a triangle of cell ``j`` into strips between levels of phi, ``most`` from the edge on.

    A level is a segment from the side between the lowest and the highest vertex to one of the
    others, whose length in parts of the longest is ``width``.

    Returns their number, and -1 if the levels run clockwise around them, else 1. ``levels`` takes
    begin and end of each level, ``strip`` what ``w / mean(w) - 1`` is between it and the next, and
    phi and the width of the level before they are moved, see `_centre`.
    """
    v0, v1, v2, sign = by_distance(piece, triangles)
    p, root, mean, law = triangles.p, triangles.root, triangles.mean[j], triangles.factors
    s0, s1, s2 = root[v0], root[v1], root[v2]
    strips = max(FEWEST, int(np.ceil(most * (s2 - s0) / s2)))
    # levels equidistant in the root, with the middle vertex among them
    lower, count = s0, 0
    ax, ay, bx, by = p[0, v0], p[1, v0], p[0, v0], p[1, v0]
    width, passed = 0.0, s1 * s1 == s0 * s0
    if passed:
        bx, by, width = p[0, v1], p[1, v1], 1.0
    density, phi, widths = strip
    levels[0] = ax, ay, bx, by
    phi[0], widths[0] = s0 * s0, width
    level = 1
    while level <= strips:
        upper = s0 + (s2 - s0) * level / strips if level < strips else s2
        if not passed and upper >= s1:
            upper, passed = s1, True
            if s1 == s2:
                level += 1
        else:
            level += 1
        ax, ay, bx, by, width1 = _level(upper, p, v0, v1, v2, s0, s1, s2)
        uniform = _mean_in_strip(lower, upper, width, width1, mean) / mean
        density[count] = uniform * _factor_in_strip(lower, upper, width, width1, law, j) - 1
        count += 1
        levels[count] = ax, ay, bx, by
        phi[count], widths[count] = upper * upper, width1
        lower, width = upper, width1
    _centre(levels, strip, count, p, v0, v1, v2, s0, s1, s2)
    return count, sign


@compiled
def _centre(levels, strip, count, p, v0, v1, v2, s0, s1, s2):
    """Move levels between strips until uniform loads on these act where those of the law do.

    Within a strip that is off the middle by a twelfth of the square of its width times the slope
    of the law's logarithm; the load of each strip remains.
    """
    density, phi, widths = strip
    lower, width = phi[0], widths[0]
    for k in range(1, count + 1):
        upper, width1 = phi[k], widths[k]
        load = (1 + density[k - 1]) * (widths[k - 1] + widths[k]) * (phi[k] - phi[k - 1])
        if k < count and phi[k] != s1 * s1:
            near = min(phi[k + 1] - phi[k], phi[k] - phi[k - 1]) / 4
            rise = (density[k] - density[k - 1]) / (density[k] + density[k - 1] + 2)
            upper += max(-near, min(near, (phi[k + 1] - phi[k - 1]) / 12 * rise))
            ax, ay, bx, by, width1 = _level(np.sqrt(upper), p, v0, v1, v2, s0, s1, s2)
            levels[k] = ax, ay, bx, by
        size = (width + width1) * (upper - lower)
        if size > 0.0:
            density[k - 1] = load / size - 1
        lower, width = upper, width1


@compiled
def _level(root, p, v0, v1, v2, s0, s1, s2):
    """Ends of the segment of a triangle on which phi is ``root^2``, and its relative length."""
    phi, phi0, phi1, phi2 = root * root, s0 * s0, s1 * s1, s2 * s2
    a = (phi - phi0) / (phi2 - phi0) if phi2 > phi0 else 1.0
    ax, ay = p[0, v0] + a * (p[0, v2] - p[0, v0]), p[1, v0] + a * (p[1, v2] - p[1, v0])
    if phi <= phi1:
        b = (phi - phi0) / (phi1 - phi0) if phi1 > phi0 else 1.0
        bx, by = p[0, v0] + b * (p[0, v1] - p[0, v0]), p[1, v0] + b * (p[1, v1] - p[1, v0])
        return ax, ay, bx, by, b
    b = (phi - phi1) / (phi2 - phi1)
    bx, by = p[0, v1] + b * (p[0, v2] - p[0, v1]), p[1, v1] + b * (p[1, v2] - p[1, v1])
    return ax, ay, bx, by, 1.0 - b


@compiled
def _mean_in_strip(lower, upper, width, width1, mean):
    """Mean of w between two roots of phi, exact, as the width is linear in phi.

    That of the whole cell where the strip is empty.
    """
    if upper + lower > 0.0 and width + width1 > 0.0:
        grow = (width1 - width) * (upper + 2 * lower) / (3 * (upper + lower))
        return 4 * (width + grow) / ((upper + lower) * (width + width1))
    return mean


@compiled
def _factor_in_strip(lower, upper, width, width1, law, cell):
    """Mean of the factor of the law there, by two points of Gauss; 1 on homogeneous ground."""
    if law.per_root[law.own[cell]] == 0.0:  # no table
        return law.values[law.own[cell], 0]
    total = weight = 0.0
    for side in (-1, 1):
        share = (1 + side / np.sqrt(3.0)) / 2
        root = lower + share * (upper - lower)
        # the width is linear in phi
        rise = share * (root + lower) / (upper + lower) if upper > 0.0 else share
        part = width + (width1 - width) * rise
        total += part * factor_at(law, cell, root)
        weight += part
    return total / weight if weight > 0.0 else 1.0


@vectorised
def _add_series(x, cells, far, matrix):
    middles, squares, terms = far
    added = np.empty(cells.shape[0])
    for i in range(x.shape[1]):
        for k in range(cells.shape[0]):
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            added[k] = far_influence(dx, dy, squares[k], terms, k)
        for k in range(cells.shape[0]):
            matrix[i, cells[k]] += added[k]


@vectorised
def _sum_series(x, q, far, out):
    """Add sums with the weights q, (k, ncells), to (m, k)."""
    middles, squares, terms = far
    one = np.empty(squares.shape[0])
    for i in range(x.shape[1]):
        for k in range(one.shape[0]):
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            one[k] = far_influence(dx, dy, squares[k], terms, k)
        for s in range(q.shape[0]):
            total = 0.0
            for k in range(one.shape[0]):
                total += q[s, k] * one[k]
            out[i, s] += total
