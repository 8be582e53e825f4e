"""What edge-weighted cells add to the settlements under uniform ones.

Near a cell its weighted triangles are cut into strips between levels of the distance to the edge;
each strip carries its exact mean of the weight as a uniform load. Far from it the first moment of
the weight acts as a dipole. The matrix of edge-weighted cells is the sum of uniform entries, a
sparse near and a smooth far correction, each of which any operator can take.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from ..kernels.compiled import compiled, inputs
from ..kernels.threads import in_blocks
from .edge_weights import EdgeWeights
from .influence import _rib_integral

#: points nearer to a cell's centroid than so many of its radii take the exact correction
NEAR = 2.5
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
    ) -> "EdgeCorrection":
        """Correction of a substrate with the influence ``coefficient / r`` near its origin.

        ``strips`` is their number in a triangle that reaches from the edge on.
        """
        centroids = weights.partition.centroids
        dipoles = coefficient * weights.moment
        return cls(x, centroids, _near(weights, coefficient, x, dipoles, strips), dipoles)

    def add_to(self, matrix: ndarray) -> None:
        """Add the correction to a dense matrix of shape (m, n)."""
        cells = np.nonzero(self.dipoles.any(axis=0))[0]
        args = inputs(self.centroids, self.dipoles, cells)

        def work(rows: slice) -> None:
            _add_dipoles(*inputs(self.x[:, rows]), *args, matrix[rows])

        in_blocks(work, self.x.shape[1])
        near = self.near.tocoo()
        matrix[near.row, near.col] += near.data

    def apply(self, q: ndarray) -> ndarray:
        """The correction times mean pressures ``q`` of shape (n,)."""
        out = np.zeros(self.x.shape[1])
        cells = np.nonzero(self.dipoles.any(axis=0))[0]
        loads = inputs(self.centroids[:, cells], self.dipoles[:, cells] * q[cells])

        def work(rows: slice) -> None:
            _sum_dipoles(*inputs(self.x[:, rows]), *loads, out[rows])

        in_blocks(work, self.x.shape[1])
        return out + self.near @ q


def _near(
    weights: EdgeWeights, coefficient: float, x: ndarray, dipoles: ndarray, strips: int
) -> csr_matrix:
    partition, fan = weights.partition, weights.fan
    cells = np.nonzero(weights.weighted)[0]
    own = weights.weighted[fan.cell]
    spokes = np.hypot(*(fan.p[:, fan.t[:, own]] - partition.centroids[:, None, fan.cell[own]]))
    radii = np.maximum.reduceat(spokes.max(axis=0), np.searchsorted(fan.cell[own], cells))
    points = cKDTree(x.T).query_ball_point(partition.centroids[:, cells].T, NEAR * radii)
    counts = np.array([len(i) for i in points], dtype=np.int64)
    rows = np.concatenate([*points, np.empty(0)]).astype(np.int32)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    values = np.zeros(len(rows))
    args = inputs(x, fan.p, fan.t, weights.root, weights.mean, fan.starts)
    cells, offsets, rows = inputs(cells, offsets, rows)

    def work(some: slice) -> None:
        _strip_sums(*args, strips, cells[some], offsets[some.start : some.stop + 1], rows, values)

    in_blocks(work, len(cells))
    values *= coefficient
    column = np.repeat(cells, counts)
    d = x[:, rows] - partition.centroids[:, column]
    r = np.hypot(*d)
    apart = r > 0
    values[apart] -= np.sum(dipoles[:, column] * d, axis=0)[apart] / r[apart] ** 3
    return csr_matrix((values, (rows, column)), shape=(x.shape[1], len(partition)))


@compiled
def _segment(x, y, ax, ay, bx, by):
    """Integral of 1/r over the triangle of the point (x, y) and a directed segment."""
    lx, ly = bx - ax, by - ay
    length = np.sqrt(lx * lx + ly * ly)
    if length == 0.0:
        return 0.0
    r1 = np.sqrt((x - ax) ** 2 + (y - ay) ** 2)
    r2 = np.sqrt((x - bx) ** 2 + (y - by) ** 2)
    return _rib_integral(x, y, ax, ay, lx, ly, length, r1, r2)


@compiled
def _strip_sums(x, p, t, root, mean, starts, most, cells, offsets, rows, values):
    """Integrals of (w / mean(w) - 1) / r over some cells, w constant in strips."""
    for k in range(cells.shape[0]):
        j = cells[k]
        for piece in range(starts[j], starts[j + 1]):
            v0, v1, v2 = t[0, piece], t[1, piece], t[2, piece]
            # vertices by ascending distance; the sense of rotation goes into the sign
            sign = 1.0
            if root[v0] > root[v1]:
                v0, v1, sign = v1, v0, -sign
            if root[v1] > root[v2]:
                v1, v2, sign = v2, v1, -sign
            if root[v0] > root[v1]:
                v0, v1, sign = v1, v0, -sign
            s0, s1, s2 = root[v0], root[v1], root[v2]
            phi0, phi1, phi2 = s0 * s0, s1 * s1, s2 * s2
            strips = max(FEWEST, int(np.ceil(most * (s2 - s0) / s2)))
            # levels equidistant in the root, with the middle vertex among them
            before = 0.0
            ex, ey, bx, by = p[0, v0], p[1, v0], p[0, v0], p[1, v0]
            lower, width = s0, 0.0
            if phi1 == phi0:
                bx, by = p[0, v1], p[1, v1]
                width = 1.0
            level, passed = 1, phi1 == phi0
            while level <= strips:
                upper = s0 + (s2 - s0) * level / strips if level < strips else s2
                if not passed and upper >= s1:
                    upper, passed = s1, True
                    if s1 == s2:
                        level += 1
                else:
                    level += 1
                phi = upper * upper
                e = (phi - phi0) / (phi2 - phi0) if phi2 > phi0 else 1.0
                ex1 = p[0, v0] + e * (p[0, v2] - p[0, v0])
                ey1 = p[1, v0] + e * (p[1, v2] - p[1, v0])
                if phi <= phi1:
                    b = (phi - phi0) / (phi1 - phi0) if phi1 > phi0 else 1.0
                    bx1 = p[0, v0] + b * (p[0, v1] - p[0, v0])
                    by1 = p[1, v0] + b * (p[1, v1] - p[1, v0])
                    width1 = b
                else:
                    b = (phi - phi1) / (phi2 - phi1)
                    bx1 = p[0, v1] + b * (p[0, v2] - p[0, v1])
                    by1 = p[1, v1] + b * (p[1, v2] - p[1, v1])
                    width1 = 1.0 - b
                # exact mean of w in the strip, whose width is linear in phi
                if upper + lower > 0.0 and width + width1 > 0.0:
                    grow = (width1 - width) * (upper + 2 * lower) / (3 * (upper + lower))
                    w = 4 * (width + grow) / ((upper + lower) * (width + width1))
                else:
                    w = mean[j]
                density = w / mean[j] - 1
                for i in range(offsets[k], offsets[k + 1]):
                    x0, y0 = x[0, rows[i]], x[1, rows[i]]
                    values[i] += sign * (
                        (density - before) * _segment(x0, y0, ex, ey, bx, by)
                        + density
                        * (_segment(x0, y0, bx, by, bx1, by1) - _segment(x0, y0, ex, ey, ex1, ey1))
                    )
                ex, ey, bx, by = ex1, ey1, bx1, by1
                lower, width, before = upper, width1, density
            for i in range(offsets[k], offsets[k + 1]):
                x0, y0 = x[0, rows[i]], x[1, rows[i]]
                values[i] -= sign * before * _segment(x0, y0, ex, ey, bx, by)


@compiled
def _add_dipoles(x, centroids, dipoles, cells, matrix):
    for i in range(x.shape[1]):
        for j in cells:
            dx, dy = x[0, i] - centroids[0, j], x[1, i] - centroids[1, j]
            r2 = dx * dx + dy * dy
            if r2 > 0.0:
                matrix[i, j] += (dipoles[0, j] * dx + dipoles[1, j] * dy) / (r2 * np.sqrt(r2))


@compiled
def _sum_dipoles(x, centroids, dipoles, out):
    for i in range(x.shape[1]):
        total = 0.0
        for j in range(centroids.shape[1]):
            dx, dy = x[0, i] - centroids[0, j], x[1, i] - centroids[1, j]
            r2 = dx * dx + dy * dy
            if r2 > 0.0:
                total += (dipoles[0, j] * dx + dipoles[1, j] * dy) / (r2 * np.sqrt(r2))
        out[i] += total
