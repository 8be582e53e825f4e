"""What edge-weighted cells add to the settlements under uniform ones.

Near a cell its weighted triangles are cut into strips between levels of the distance to the edge;
each strip carries its exact mean of the weight as a uniform load. Far from it the first moment of
the weight acts as a dipole. The matrix of edge-weighted cells is the sum of uniform entries, a
sparse near and a smooth far correction, each of which any operator can take.

The strips are this project's own; each is integrated by its ribs, see `ribs`.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from ..kernels.compiled import compiled, inlined, inputs
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights, Factors
from .moments import Dipoles, dipole_influence
from .segments import WIDTH, Pairs, add_segments, put_segment

#: points nearer to a cell's centroid than so many of its radii take the exact correction
IN_STRIPS = 2.5
#: points nearer to it, over the root of its area, are in its centroid
IN_MIDDLE = 5e-6
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
    centroids : (2, n) array of float
        Centroids of the cells.
    near : (m, n) csr_matrix
        Correction near the cells, less their dipoles.
    dipoles : (2, n) array of float
        Dipole of each cell; zero where the weight is constant.
    """

    x: ndarray
    centroids: ndarray
    near: csr_matrix
    dipoles: ndarray

    @classmethod
    def from_weights(
        cls, weights: EdgeWeights, coefficient: float, x: ndarray, strips: int = STRIPS
    ) -> Self:
        """Correction of a substrate with the influence ``coefficient / r`` near its origin.

        ``strips`` is their number in a triangle that reaches from the edge on.
        """
        centroids = weights.partition.centroids
        dipoles = coefficient * weights.moment
        x = snapped(x, centroids, np.sqrt(weights.partition.areas))
        return cls(x, centroids, _near(weights, coefficient, x, dipoles, strips), dipoles)

    def add_to(self, matrix: ndarray) -> None:
        """Add the correction to a dense matrix of shape (m, n)."""
        cells, dipoles = self._weighted()

        def work(rows: slice) -> None:
            _add_dipoles(*inputs(self.x[:, rows], cells), dipoles, matrix[rows])

        with Threads() as run:
            run(work, self.x.shape[1])
        near = self.near.tocoo()
        matrix[near.row, near.col] += near.data

    def apply(self, q: ndarray) -> ndarray:
        """The correction times mean pressures ``q`` of shape (n,)."""
        out = np.zeros(self.x.shape[1])
        cells, dipoles = self._weighted()
        loaded = Dipoles(*inputs(dipoles.middles, dipoles.moments * q[cells]))

        def work(rows: slice) -> None:
            _sum_dipoles(*inputs(self.x[:, rows]), loaded, out[rows])

        with Threads() as run:
            run(work, self.x.shape[1])
        return out + self.near @ q

    def _weighted(self) -> tuple[ndarray, Dipoles]:
        """Cells that have a dipole, and those."""
        cells = np.nonzero(self.dipoles.any(axis=0))[0]
        return cells, Dipoles(*inputs(self.centroids[:, cells], self.dipoles[:, cells]))


class Triangles(NamedTuple):
    """Triangles that fill cells, and the weight on them.

    Attributes
    ----------
    p : (2, k) array of float
        Vertices.
    t : (3, ntriangles) array of int
        Vertices of each triangle, those of a cell one after the other.
    root : (k,) array of float
        Square root of phi at the vertices.
    starts : (n + 1,) array of int
        The first triangle of each cell.
    mean : (n,) array of float
        Mean of w over each cell.
    factors : Factors
        The law of each cell over phi^(-1/2).
    """

    p: ndarray
    t: ndarray
    root: ndarray
    starts: ndarray
    mean: ndarray
    factors: Factors

    @classmethod
    def of(cls, weights: EdgeWeights) -> Self:
        """Of the fan of some weights."""
        fan, factors = weights.fan, Factors(*inputs(*weights.factors))
        p, t, root, starts, mean = inputs(fan.p, fan.t, weights.root, fan.starts, weights.mean)
        return cls(p, t, root, starts, mean, factors)


def snapped(x: ndarray, centroids: ndarray, sizes: ndarray) -> ndarray:
    """Points, but centroids of cells where these are as good as there: next to the middle of a
    dipole what it adds and what is taken off again would drown all else."""
    if np.array_equal(x, centroids):
        return x
    distance, nearest = cKDTree(centroids.T).query(x.T)
    return np.where(distance < IN_MIDDLE * sizes[nearest], centroids[:, nearest], x)


def _near(
    weights: EdgeWeights, coefficient: float, x: ndarray, dipoles: ndarray, strips: int
) -> csr_matrix:
    partition, fan = weights.partition, weights.fan
    cells = np.nonzero(weights.weighted)[0]
    own = weights.weighted[fan.cell]
    spokes = np.hypot(*(fan.p[:, fan.t[:, own]] - partition.centroids[:, None, fan.cell[own]]))
    radii = np.maximum.reduceat(spokes.max(axis=0), np.searchsorted(fan.cell[own], cells))
    pairs = Pairs.within(IN_STRIPS * radii, cells, partition.centroids[:, cells], x)
    sums, triangles = np.zeros((3, len(pairs.points))), Triangles.of(weights)
    with Threads() as run:
        run(lambda k: _strip_sums(k.start, k.stop, pairs, triangles, strips, sums), len(cells))
    values = coefficient * sums[0]
    column = np.repeat(cells, np.diff(pairs.offsets))
    d = pairs.x - partition.centroids[:, column]
    r = np.hypot(*d)
    apart = r > 0
    values[apart] -= np.sum(dipoles[:, column] * d, axis=0)[apart] / r[apart] ** 3
    return csr_matrix((values, (pairs.points, column)), shape=(x.shape[1], len(partition)))


@compiled
def _strip_sums(first, last, pairs, triangles, most, sums):
    """Integrals with w / mean(w) - 1 over some cells, see `add_segments`."""
    room = strips_room(triangles, most)
    for k in range(first, last):
        begin, end = pairs.offsets[k], pairs.offsets[k + 1]
        if begin < end:
            count = strip_segments(triangles, pairs.cells[k], most, 0.0, room)
            add_segments(pairs.x, begin, end, room[2], count, sums)


@compiled
def strips_room(triangles, most):
    """Room for levels and densities of a triangle, and segments of a cell cut into strips."""
    room, pieces = max(most, FEWEST) + 2, 1
    for j in range(triangles.starts.shape[0] - 1):
        pieces = max(pieces, triangles.starts[j + 1] - triangles.starts[j])
    return np.empty((room, 4)), np.empty(room), np.empty((6, 3 * room * pieces + WIDTH))


@compiled
def strip_segments(triangles, j, most, base, room):
    """Sides of the strips of a cell, with ``base + w / mean(w) - 1`` on their left.

    Puts them into the ``room`` of `strips_room` and returns their number.
    """
    levels, density, segments = room
    count = 0
    for piece in range(triangles.starts[j], triangles.starts[j + 1]):
        strips, sign = cut_triangle(piece, triangles, j, most, levels, density)
        before = 0.0
        for k in range(strips):
            ax, ay, bx, by = levels[k]
            ax1, ay1, bx1, by1 = levels[k + 1]
            here = sign * (base + density[k])
            count = put_segment(segments, count, ax, ay, bx, by, here - before)
            count = put_segment(segments, count, bx, by, bx1, by1, here)
            count = put_segment(segments, count, ax, ay, ax1, ay1, -here)
            before = here
        ax, ay, bx, by = levels[strips]
        count = put_segment(segments, count, ax, ay, bx, by, -before)
    return count


@compiled
def cut_triangle(piece, triangles, j, most, levels, density):
    """Cut a triangle of cell ``j`` into strips between levels of phi, ``most`` from the edge on.

    A level is a segment from the side between the lowest and the highest vertex to one of the
    others, whose length in parts of the longest is ``width``.

    Returns their number, and -1 if the levels run clockwise around them, else 1. ``levels`` takes
    begin and end of each level, ``density`` what ``w / mean(w) - 1`` is between it and the next.
    """
    v0, v1, v2, sign = _by_distance(piece, triangles)
    p, root, mean, law = triangles.p, triangles.root, triangles.mean[j], triangles.factors
    s0, s1, s2 = root[v0], root[v1], root[v2]
    strips = max(FEWEST, int(np.ceil(most * (s2 - s0) / s2)))
    # levels equidistant in the root, with the middle vertex among them
    lower, count = s0, 0
    ax, ay, bx, by = p[0, v0], p[1, v0], p[0, v0], p[1, v0]
    width, passed = 0.0, s1 * s1 == s0 * s0
    if passed:
        bx, by, width = p[0, v1], p[1, v1], 1.0
    levels[0] = ax, ay, bx, by
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
        lower, width = upper, width1
    return count, sign


@compiled
def _by_distance(piece, triangles):
    """Vertices of a triangle by ascending distance, -1 if that reverses their rotation, else 1."""
    root, t = triangles.root, triangles.t
    v0, v1, v2, sign = t[0, piece], t[1, piece], t[2, piece], 1.0
    if root[v0] > root[v1]:
        v0, v1, sign = v1, v0, -sign
    if root[v1] > root[v2]:
        v1, v2, sign = v2, v1, -sign
    if root[v0] > root[v1]:
        v0, v1, sign = v1, v0, -sign
    return v0, v1, v2, sign


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


@inlined
def factor_at(factors, cell, root):
    """The factor of the law of a cell where the square root of phi is ``root``."""
    values, law = factors.values, factors.own[cell]
    last = values.shape[1] - 1
    place = min(root * factors.per_root[law], float(last))
    step = min(int(place), last - 1)
    value = values[law, step]
    return value + (place - step) * (values[law, step + 1] - value)


@compiled
def _factor_in_strip(lower, upper, width, width1, law, cell):
    """Mean of the factor of the law there, by two points of Gauss; 1 on homogeneous ground."""
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


@compiled
def _add_dipoles(x, cells, dipoles, matrix):
    middles, moments = dipoles
    for i in range(x.shape[1]):
        for k in range(cells.shape[0]):
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            matrix[i, cells[k]] += dipole_influence(dx, dy, moments[0, k], moments[1, k])


@compiled
def _sum_dipoles(x, dipoles, out):
    middles, moments = dipoles
    for i in range(x.shape[1]):
        total = 0.0
        for k in range(middles.shape[1]):
            dx, dy = x[0, i] - middles[0, k], x[1, i] - middles[1, k]
            total += dipole_influence(dx, dy, moments[0, k], moments[1, k])
        out[i] += total
