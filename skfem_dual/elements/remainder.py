"""Settlement by the part of an influence function that is not c / r.

It is smooth but for a logarithm at r = 0. Far cells act through their area and second moments,
near cells by quadrature along their ribs, which leaves the substrate's primitive only.
Edge-weighted cells act around their weighted centroids from afar; near by, each triangle of their
fan acts with its own mean and centroid of the weight.
"""

from collections.abc import Callable

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..ground.hankel import RadialTable
from ..kernels.compiled import compiled, inputs
from .edge_weights import EdgeWeights

#: cells nearer than so many of their radii are integrated along their ribs
NEAR = 5.0
#: Gauss points on each side of the foot of the perpendicular on a rib
POINTS = 6


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
    radius = np.maximum.reduceat(spoke, polygons.offsets[:-1])
    loads = polygons if weights is None else weights
    far = inputs(polygons.centroids, radius, loads.centroids, polygons.areas, loads.second_moments)
    tables = *inputs(table.omega, table.primitive_over_r), table.start, table.width
    gauss = inputs(*np.polynomial.legendre.leggauss(POINTS))
    pieces = inputs(*_pieces(partition, weights))

    def add(rows: slice, factor: float, matrix: ndarray) -> None:
        _add(*inputs(x[:, rows]), *far, *pieces, *tables, *gauss, factor, matrix)

    return add


def _pieces(partition: Partition, weights: EdgeWeights | None) -> tuple[ndarray, ...]:
    """Uniformly loaded polygons that stand for each cell near by.

    Points, indices and offsets as in `Polygons`; the first piece of each cell; density of each
    piece and the shift of its load from its centroid.
    """
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
    return (
        p, indices.astype(np.int64), offsets[:-1][order], sizes[order], first, density[order],
        shift[:, order],
    )  # fmt: skip


@compiled
def _lookup(coefficients, start, width, r):
    """A table at one distance; constant below its range, where it is negligible."""
    s = max((np.log(r) - start) / width, 0.0) if r > 0.0 else 0.0
    panel = min(int(s), coefficients.shape[0] - 1)
    t = 2 * (s - panel) - 1
    out = 0.0
    for power in range(coefficients.shape[1] - 1, -1, -1):
        out = out * t + coefficients[panel, power]
    return out


@compiled
def _from_afar(coefficients, start, width, dx, dy, area, xx, xy, yy):
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
def _along_ribs(x, y, p, indices, begin, end, phi, start, width, gauss, weights):
    """Integral over one cell: on each rib of h T(|h| cosh v) dv, T the primitive over r."""
    total = 0.0
    for k in range(begin, end):
        a = indices[k]
        b = indices[k + 1] if k + 1 < end else indices[begin]
        lx, ly = p[0, b] - p[0, a], p[1, b] - p[1, a]
        length = np.sqrt(lx * lx + ly * ly)
        if length == 0.0:
            continue
        dx, dy = x - p[0, a], y - p[1, a]
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
                    part += weights[g] * _lookup(phi, start, width, r)
                total += h * half * part
    return total


@compiled
def _add(
    x, centroids, radius, acting, areas, second,
    p, indices, begin, sizes, first, density, shift,
    omega, phi, start, width, gauss, weights, factor, matrix,
):  # fmt: skip
    for i in range(x.shape[1]):
        for j in range(areas.shape[0]):
            dx, dy = x[0, i] - centroids[0, j], x[1, i] - centroids[1, j]
            if dx * dx + dy * dy > (NEAR * radius[j]) ** 2:
                value = _from_afar(
                    omega, start, width, x[0, i] - acting[0, j], x[1, i] - acting[1, j],
                    areas[j], second[0, j], second[1, j], second[2, j],
                )  # fmt: skip
            else:
                value = 0.0
                for k in range(first[j], first[j + 1]):
                    value += density[k] * _along_ribs(
                        x[0, i] - shift[0, k], x[1, i] - shift[1, k], p, indices,
                        begin[k], begin[k] + sizes[k], phi, start, width, gauss, weights,
                    )  # fmt: skip
            matrix[i, j] += factor * value
