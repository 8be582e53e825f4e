"""Settlement by the part of an influence function that is not c / r.

It is smooth but for a logarithm at r = 0. Far cells act through their area and second moments,
near cells by quadrature along their ribs, which leaves the substrate's primitive only.
Edge-weighted cells act around their weighted centroids from afar; near by, each triangle of their
fan acts with its own mean and centroid of the weight.

Source of the hyperbolic sine that takes the nearly singular part from a rib's quadrature:
P. R. Johnston and D. Elliott, A sinh transformation for evaluating nearly singular boundary
element integrals, Int. J. Numer. Meth. Engng 62 (2005).
"""

from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..ground.hankel import RadialTable, table_value
from ..kernels.compiled import compiled, inputs
from .edge_weights import EdgeWeights

#: cells nearer than so many of their radii are integrated along their ribs
ALONG_RIBS = 5.0
#: Gauss points on each side of the foot of the perpendicular on a rib
POINTS = 6


class FarCells(NamedTuple):
    """Cells as they act from afar.

    Attributes
    ----------
    middles : (2, n) array of float
        Centroids.
    reach : (n,) array of float
        Points farther than this from a centroid are far.
    acting : (2, n) array of float
        Centroids of the loads.
    areas : (n,) array of float
    second : (3, n) array of float
        Second moments of the loads about their centroids: xx, xy, yy.
    """

    middles: ndarray
    reach: ndarray
    acting: ndarray
    areas: ndarray
    second: ndarray


class Pieces(NamedTuple):
    """Uniformly loaded polygons that stand for cells near by.

    Attributes
    ----------
    vertices : (2, k) array of float
        Those of all pieces, one after the other.
    begin, end : (npieces,) array of int
        Where those of each piece begin and end.
    density : (npieces,) array of float
        Load per area under a unit mean pressure on the cell.
    shift : (2, npieces) array of float
        From the centroid of a piece to where its load acts.
    first, last : (n,) array of int
        The first piece of each cell, and the one behind its last.
    """

    vertices: ndarray
    begin: ndarray
    end: ndarray
    density: ndarray
    shift: ndarray
    first: ndarray
    last: ndarray

    @classmethod
    def from_partition(cls, partition: Partition, weights: EdgeWeights | None) -> Self:
        """A cell is one piece; of an edge-weighted one each triangle is."""
        polygons = partition.polygons
        n = len(polygons)
        weighted = np.zeros(n, dtype=bool) if weights is None else weights.weighted
        whole = np.nonzero(~weighted)[0]
        cell, sizes = whole, polygons.sizes[whole].astype(np.int64)
        keep = np.repeat(~weighted, polygons.sizes)
        p, indices = polygons.p, polygons.indices[keep]
        density, shift = np.ones(len(whole)), np.zeros((2, len(whole)))
        if weights is not None:
            fan = weights.fan
            own = weighted[fan.cell]
            mean, off = weights.of_triangles
            cell = np.concatenate([cell, fan.cell[own]])
            sizes = np.concatenate([sizes, np.full(np.count_nonzero(own), 3)])
            indices = np.concatenate([indices, p.shape[1] + fan.t[:, own].T.ravel()])
            p = np.hstack([p, fan.p])
            density = np.concatenate([density, mean[own] / weights.mean[fan.cell[own]]])
            shift = np.hstack([shift, off[:, own]])
        order = np.argsort(cell, kind="stable")
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        first = np.searchsorted(cell[order], np.arange(n + 1))
        return cls(
            *inputs(
                p[:, indices], offsets[:-1][order], offsets[1:][order],
                density[order], shift[:, order], first[:-1], first[1:],
            )
        )  # fmt: skip


class Radial(NamedTuple):
    """A `RadialTable` and the rule by which its primitive is integrated along ribs.

    Attributes
    ----------
    omega, primitive_over_r : (panels, degree + 1) array of float
    start, width : float
        As in `RadialTable`.
    gauss, gauss_weights : (k,) array of float
        Rule on [-1, 1].
    """

    omega: ndarray
    primitive_over_r: ndarray
    start: float
    width: float
    gauss: ndarray
    gauss_weights: ndarray

    @classmethod
    def from_table(cls, table: RadialTable, points: int) -> Self:
        """With so many Gauss points."""
        omega, primitive_over_r = inputs(table.omega, table.primitive_over_r)
        gauss = inputs(*np.polynomial.legendre.leggauss(points))
        return cls(omega, primitive_over_r, table.start, table.width, *gauss)


def remainder_rows(
    table: RadialTable, partition: Partition, weights: EdgeWeights | None, x: ndarray
) -> Callable[[slice, float, ndarray], None]:
    """A function ``add(rows, factor, matrix)`` that adds the integrals over all cells.

    Parameters
    ----------
    table : RadialTable
        Of the substrate.
    partition : Partition
        The cells.
    weights : EdgeWeights, optional
        How the load varies inside the cells; not at all by default.
    x : (2, m) array of float
        Field points; ``rows`` is a slice of them, ``matrix`` has their rows.

    Raises
    ------
    ValueError
        If the plan and the points reach farther than the table.
    """
    polygons = partition.polygons
    table.evaluate(table.omega, np.hypot(*np.ptp(np.hstack([polygons.p, x]), axis=1)))
    owner = np.repeat(np.arange(len(polygons)), polygons.sizes)
    spoke = np.hypot(*(polygons.p[:, polygons.indices] - polygons.centroids[:, owner]))
    reach = ALONG_RIBS * np.maximum.reduceat(spoke, polygons.offsets[:-1])
    acting = polygons if weights is None else weights
    far = FarCells(
        *inputs(polygons.centroids, reach, acting.centroids, polygons.areas, acting.second_moments)
    )
    pieces, radial = Pieces.from_partition(partition, weights), Radial.from_table(table, POINTS)

    def add(rows: slice, factor: float, matrix: ndarray) -> None:
        _add(*inputs(x[:, rows]), far, pieces, radial, factor, matrix)

    return add


@compiled
def add_remainder(x, y, cells, far, pieces, radial, factor, values):
    """Add the integrals over some cells, seen from (x, y), times ``factor`` to ``values``."""
    middles, reach, acting, areas, second = far
    vertices, begin, end, density, shift, first, last = pieces
    omega, primitive_over_r, start, width, gauss, weights = radial
    for k in range(cells.shape[0]):
        j = cells[k]
        dx, dy = x - middles[0, j], y - middles[1, j]
        if dx * dx + dy * dy > reach[j] ** 2:
            dx, dy = x - acting[0, j], y - acting[1, j]
            integral = _by_moments(
                dx, dy, areas[j], second[0, j], second[1, j], second[2, j], omega, start, width
            )
        else:
            integral = 0.0
            for piece in range(first[j], last[j]):
                integral += density[piece] * _along_ribs(
                    x - shift[0, piece], y - shift[1, piece], vertices, begin[piece], end[piece],
                    primitive_over_r, start, width, gauss, weights,
                )  # fmt: skip
        values[k] += factor * integral


@compiled
def _by_moments(dx, dy, area, xx, xy, yy, coefficients, start, width):
    """Integral over a far cell by its area and second moments, with derivatives in ln r."""
    r2 = dx * dx + dy * dy
    s = max((np.log(r2) / 2 - start) / width, 0.0)
    panel = min(int(s), coefficients.shape[0] - 1)
    t = 2 * (s - panel) - 1
    f, d1, d2 = 0.0, 0.0, 0.0
    for power in range(coefficients.shape[1] - 1, -1, -1):
        d2 = d2 * t + 2 * d1
        d1 = d1 * t + f
        f = f * t + coefficients[panel, power]
    d1, d2 = d1 * 2 / width, d2 * 4 / (width * width)
    along = (xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy) / r2
    across = xx + yy - along
    return area * f + ((d2 - d1) * along + d1 * across) / (2 * r2)


@compiled
def _along_ribs(x, y, vertices, begin, end, coefficients, start, width, gauss, weights):
    """Integral over a polygon: on each rib of h T(|h| cosh v) dv, T the primitive over r."""
    total = 0.0
    for a in range(begin, end):
        b = a + 1 if a + 1 < end else begin
        lx, ly = vertices[0, b] - vertices[0, a], vertices[1, b] - vertices[1, a]
        length = np.sqrt(lx * lx + ly * ly)
        if length == 0.0:
            continue
        dx, dy = x - vertices[0, a], y - vertices[1, a]
        h = (lx * dy - ly * dx) / length
        if abs(h) <= 1e-16 * length:
            continue
        t1 = -(lx * dx + ly * dy) / length
        v1, v2 = np.arcsinh(t1 / abs(h)), np.arcsinh((t1 + length) / abs(h))
        middle = min(max(0.0, v1), v2)
        for low, high in ((v1, middle), (middle, v2)):
            half = (high - low) / 2
            if half > 0.0:
                part = 0.0
                for g in range(gauss.shape[0]):
                    r = abs(h) * np.cosh(low + half * (gauss[g] + 1))
                    part += weights[g] * table_value(coefficients, start, width, r)
                total += h * half * part
    return total


@compiled
def _add(x, far, pieces, radial, factor, matrix):
    cells = np.arange(matrix.shape[1])
    for i in range(x.shape[1]):
        add_remainder(x[0, i], x[1, i], cells, far, pieces, radial, factor, matrix[i])
