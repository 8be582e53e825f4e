"""Exact settlements at some points under some cells, in dense blocks.

As in `influence_matrix`: ribs in closed form, the remainder along the ribs nearby and by moments
farther off; of edge-weighted cells the dipoles, to which `EdgeCorrection.near` adds what is
missing near by.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..ground.hankel import RadialTable
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs, vectorised
from .edge_weights import EdgeWeights
from .influence import _rib_integral
from .moments import load_moments, radii
from .remainder import NEAR, POINTS, _along_ribs, _from_afar, _pieces

#: the remainder is integrated along the ribs of cells up to so many of their radii at least
NEAREST = 1.5
#: Gauss points for an error of the remainder of 1e-6
FEWER = 4


@dataclass(frozen=True, eq=False)
class NearField:
    """Settlements under unit mean pressure on cells, in an order of the cells.

    Attributes
    ----------
    ribs : tuple of arrays
        Begin and vector of each rib, its cells on the left and on the right; ribs of each cell.
    dipoles : tuple of arrays
        Centroids and dipoles of the cells.
    remainder : tuple of arrays
        What `remainder_rows` takes; empty without a remainder.
    """

    ribs: tuple
    dipoles: tuple
    remainder: tuple

    @classmethod
    def build(
        cls,
        substrate: Substrate,
        partition: Partition,
        weights: EdgeWeights | None,
        cells: ndarray,
        rtol: float | None = None,
    ) -> "NearField":
        """Of the ``cells`` of a partition in the order given, all of them.

        The remainder has the error ``rtol`` relative to c / r; without it there is none.
        """
        n = len(partition)
        number = np.empty(n + 1, np.int32)
        number[cells] = np.arange(n)
        number[n] = -1
        left, right = number[partition.f2c]
        order = np.argsort(left, kind="stable")
        a, b = partition.polygons.p[:, partition.facets[:, order]].swapaxes(0, 1)
        left, right = left[order], right[order]
        both = np.concatenate([left, right])
        around = np.argsort(both, kind="stable")[np.count_nonzero(both < 0) :]
        starts = np.searchsorted(both[around], np.arange(n + 1))
        along = b - a
        geometry = np.vstack([a, along, np.hypot(*along)[None]]).T
        around = (around % len(left)).astype(np.int32)
        ribs = inputs(geometry, left, right, around, starts)
        c = substrate.singular_coefficient
        dipoles = np.zeros((2, n)) if weights is None else weights.moment[:, cells]
        remainder: tuple = ()
        if rtol is not None and (table := substrate.remainder) is not None:
            polygons = partition.polygons
            acting = polygons.centroids if weights is None else weights.centroids
            p, indices, begin, sizes, first, density, shift = _pieces(partition, weights)
            moments = load_moments(partition, weights, 4)
            coefficient = c * substrate.surface.young
            reach = _reach(coefficient, table, radii(polygons), moments, rtol)
            gauss = np.polynomial.legendre.leggauss(FEWER if rtol >= 1e-6 else POINTS)
            second = np.stack([2 * moments[2, 0], moments[1, 1], 2 * moments[0, 2]])
            loads = reach[cells], acting[:, cells], polygons.areas[cells], second[:, cells]
            pieces = p, indices, begin, sizes, first[cells], first[cells + 1], density, shift
            tables = inputs(table.omega, table.primitive_over_r)
            remainder = (
                *inputs(*loads, *pieces), *tables, table.start, table.width, *inputs(*gauss),
                1 / substrate.surface.young,
            )  # fmt: skip
        return cls((*ribs, c), inputs(partition.centroids[:, cells], c * dipoles), remainder)

    def fill(
        self, x: ndarray, rows: ndarray, columns: tuple[ndarray, ndarray], values: ndarray
    ) -> None:
        """Blocks of entries, one after the other.

        Parameters
        ----------
        x : (2, m) array of float
            Field points.
        rows : (2, nblocks) array of int
            Points of a block are those from ``rows[0]`` to ``rows[1]``.
        columns : pair of arrays of int
            Starts and items of the list of cells of each block.
        values : array of float
            Room for all blocks, each with its rows one after the other.
        """
        starts, cells = columns
        blocks = inputs(x, rows, starts, np.asarray(cells, np.int32))
        _fill_singular(*blocks, *self.ribs, *self.dipoles, values)
        if self.remainder:
            _fill_remainder(*blocks, self.dipoles[0], *self.remainder, values)


def _reach(
    coefficient: float, table: RadialTable, radius: ndarray, moments: ndarray, rtol: float
) -> ndarray:
    """Distances from which on the moments of cells will do for the remainder, shape (n,).

    Derivatives of a logarithm, the steepest part of it, times the next moments, against the
    ``coefficient`` of 1 / r.
    """
    step = 1.01
    nearer, farther = (table.evaluate(table.omega, r) for r in (radius, step * radius))
    slope = np.abs(farther - nearer) / (np.log(step) * coefficient * rtol)
    m = np.abs(moments) / moments[0, 0]
    third = sum(m[i, 3 - i] for i in range(4))
    fourth = sum(m[i, 4 - i] for i in range(5))
    reach = np.maximum(np.sqrt(2 * slope * third), np.cbrt(6 * slope * fourth))
    return reach.clip(NEAREST * radius, NEAR * radius)


@vectorised
def _rib_integrals(x, y, ax, ay, lx, ly, length, cross, reach):
    """`_rib_integral` at several points, if all are so far that it is a short series.

    ``cross`` takes the result; ``reach`` is for temporary use.
    """
    least = np.inf
    for i in range(x.shape[0]):
        dx, dy = x[i] - ax, y[i] - ay
        ex, ey = dx - lx, dy - ly
        cross[i] = lx * dy - ly * dx
        reach[i] = np.sqrt(dx * dx + dy * dy) + np.sqrt(ex * ex + ey * ey)
        least = min(least, reach[i])
    if not least > 4 * length:
        return False
    for i in range(x.shape[0]):
        z = (length / reach[i]) ** 2
        s = z / 21 + 1 / 19
        s = s * z + 1 / 17
        s = s * z + 1 / 15
        s = s * z + 1 / 13
        s = s * z + 1 / 11
        s = s * z + 1 / 9
        s = s * z + 1 / 7
        s = s * z + 1 / 5
        s = s * z + 1 / 3
        s = s * z + 1
        cross[i] *= 2 * s / reach[i]
    return True


@compiled
def _fill_singular(
    x, rows, starts, cells, geometry, left, right, around, around_starts, c, centroids, dipoles,
    values,
):  # fmt: skip
    column = np.full(centroids.shape[1] + 1, -1, np.int32)  # the last: outside of the plan
    widest, highest = 0, 0
    for block in range(rows.shape[1]):
        widest = max(widest, starts[block + 1] - starts[block])
        highest = max(highest, rows[1, block] - rows[0, block])
    room, part, scratch = np.empty((widest, highest)), np.empty(highest), np.empty(highest)
    offset = 0
    for block in range(rows.shape[1]):
        begin, end = starts[block], starts[block + 1]
        x0, y0 = x[0, rows[0, block] : rows[1, block]], x[1, rows[0, block] : rows[1, block]]
        width, height = end - begin, x0.shape[0]
        entries = room[:width]
        entries[:, :height] = 0.0
        for k in range(begin, end):
            column[cells[k]] = k - begin
        for k in range(begin, end):
            cell = cells[k]
            for a in range(around_starts[cell], around_starts[cell + 1]):
                rib = around[a]
                plus, minus = column[left[rib]], column[right[rib]]
                if plus >= 0 and left[rib] != cell:
                    continue  # it is the turn of the other cell
                ax, ay, lx, ly, length = geometry[rib]
                if not _rib_integrals(x0, y0, ax, ay, lx, ly, length, part, scratch):
                    for i in range(height):
                        dx, dy = x0[i] - ax, y0[i] - ay
                        r1 = np.sqrt(dx * dx + dy * dy)
                        r2 = np.sqrt((dx - lx) ** 2 + (dy - ly) ** 2)
                        part[i] = _rib_integral(x0[i], y0[i], ax, ay, lx, ly, length, r1, r2)
                if plus >= 0:
                    for i in range(height):
                        entries[plus, i] += c * part[i]
                if minus >= 0:
                    for i in range(height):
                        entries[minus, i] -= c * part[i]
            mx, my = dipoles[0, cell], dipoles[1, cell]
            if mx != 0.0 or my != 0.0:
                for i in range(height):
                    dx, dy = x0[i] - centroids[0, cell], y0[i] - centroids[1, cell]
                    r2 = dx * dx + dy * dy
                    if r2 > 0.0:
                        entries[k - begin, i] += (mx * dx + my * dy) / (r2 * np.sqrt(r2))
        for k in range(begin, end):
            column[cells[k]] = -1
        for i in range(height):
            for k in range(width):
                values[offset + i * width + k] = entries[k, i]
        offset += width * height


@compiled
def _fill_remainder(
    x, rows, starts, cells, centroids, reach, acting, areas, second, p, indices, begin, sizes,
    first, last, density, shift, omega, phi, start, width, gauss, weights, factor, values,
):  # fmt: skip
    at = 0
    for block in range(rows.shape[1]):
        for i in range(rows[0, block], rows[1, block]):
            for k in range(starts[block], starts[block + 1]):
                j = cells[k]
                dx, dy = x[0, i] - centroids[0, j], x[1, i] - centroids[1, j]
                if dx * dx + dy * dy > reach[j] ** 2:
                    value = _from_afar(
                        omega, start, width, x[0, i] - acting[0, j], x[1, i] - acting[1, j],
                        areas[j], second[0, j], second[1, j], second[2, j],
                    )  # fmt: skip
                else:
                    value = 0.0
                    for piece in range(first[j], last[j]):
                        value += density[piece] * _along_ribs(
                            x[0, i] - shift[0, piece], x[1, i] - shift[1, piece], p, indices,
                            begin[piece], begin[piece] + sizes[piece], phi, start, width,
                            gauss, weights,
                        )  # fmt: skip
                values[at] += factor * value
                at += 1
