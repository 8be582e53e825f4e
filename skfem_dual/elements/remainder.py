"""Settlement by the part of an influence function that is not c / r.

It is smooth but for a logarithm at r = 0. Cells act from afar as clouds of points, near by through
quadrature along the ribs of their pieces, which leaves the substrate's primitive only.

Source of the hyperbolic sine that takes the nearly singular part from a rib's quadrature:
P. R. Johnston and D. Elliott, A sinh transformation for evaluating nearly singular boundary
element integrals, Int. J. Numer. Meth. Engng 62 (2005).
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..grids.partition import Partition
from ..ground.hankel import RadialTable, SquareTable, square_value
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs
from ..kernels.threads import Threads
from .clouds import Clouds, cloud_sum
from .edge_weights import EdgeWeights, load_centroids
from .moments import load_moments, reach_of
from .pieces import Pieces

#: degrees of the clouds of exact entries, and the radii of their cells from which on they serve
CLOUDS = {10: 5.0, 8: 7.0, 6: 11.0, 5: 17.0, 4: 32.0}
#: Gauss points on each side of the foot of the perpendicular on a rib
POINTS = 8
#: a rib whose ends are together farther than so many of its lengths needs no hyperbolic sine
PLAIN = 2.5
#: cells whose clouds are made at a time, and that are looked at together
CHUNK, TOGETHER = 2**14, 32


#: adds to the rows of a block
Add = Callable[[slice, ndarray], None]


class AlongRibs(NamedTuple):
    """What `along_ribs` takes.

    Attributes
    ----------
    pieces : Pieces
        Of the cells.
    primitive_over_r : SquareTable
        As of `RadialTable`.
    smallest : float
        Square of the smallest distance of the table.
    gauss, gauss_weights : (k,) array of float
        Rule on [-1, 1] for each half of a rib.
    """

    pieces: Pieces
    primitive_over_r: SquareTable
    smallest: float
    gauss: ndarray
    gauss_weights: ndarray

    @classmethod
    def from_table(cls, table: RadialTable, pieces: Pieces, points: int) -> Self:
        """With so many Gauss points."""
        rule = inputs(*np.polynomial.legendre.leggauss(points))
        return cls(pieces, table.squares[1], table.nearest**2, *rule)


def remainder_blocks(
    substrate: Substrate, partition: Partition, weights: EdgeWeights | None, x: ndarray
) -> Iterator[tuple[slice, Add]]:
    """Exact integrals over cells, some cells after the other; none without a remainder.

    Parameters
    ----------
    substrate : Substrate
        The ground.
    partition : Partition
        The cells.
    weights : EdgeWeights, optional
        How the load varies inside the cells; not at all by default.
    x : (2, m) array of float
        Field points.

    Yields
    ------
    cells : slice
        Some of the cells.
    add : callable
        ``add(rows, block)`` adds the integrals over them to ``block``, which has a row for each
        field point of the slice ``rows`` and a column for each of these cells.

    Raises
    ------
    ValueError
        If the plan and the points reach farther than the table.
    """
    table = substrate.remainder
    if table is None:
        return
    table.evaluate(table.omega, np.hypot(*np.ptp(np.hstack([partition.polygons.p, x]), axis=1)))
    pieces = Pieces.from_partition(partition, weights)
    centres = load_centroids(partition, weights)
    nearest, _ = cKDTree(x.T).query(centres.T)
    for begin in range(0, len(partition), CHUNK):
        cells = slice(begin, min(begin + CHUNK, len(partition)))
        own = pieces._replace(first=pieces.first[cells], last=pieces.last[cells])
        clouds = _clouds(own, centres[:, cells], nearest[cells], table.nearest)
        near = AlongRibs.from_table(table, own, POINTS)
        known = clouds, table.squares[0], near, 1 / substrate.surface.young
        yield cells, partial(_add, x, known)


def _clouds(pieces: Pieces, centres: ndarray, nearest: ndarray, smallest: float) -> Clouds:
    """Of some cells; of high degrees only those that points are ``nearest`` to."""
    radius = reach_of(pieces, centres)
    least = {d: np.maximum(k * radius, radius + smallest) for d, k in CLOUDS.items()}
    degrees = np.array(list(CLOUDS))
    needed = np.maximum(np.sum(np.stack(list(least.values())) < nearest, axis=0), 1) - 1
    groups = [
        (some, load_moments(pieces.of(some), centres[:, some], degrees[k]))
        for k, some in ((k, np.nonzero(needed == k)[0]) for k in range(len(degrees)))
        if len(some)
    ]
    return Clouds.from_groups(centres, radius, groups, least)


def add_rows(add: Add, matrix: ndarray, rows: slice) -> None:
    """Add to some rows of the ``matrix`` of a block of cells; work for `Threads`."""
    add(rows, matrix[rows])


def add_by_rows(add: Add, matrix: ndarray, each: int) -> None:
    """Add to a matrix, some rows at a time, each of which takes some nanoseconds."""
    with Threads() as run:
        run(partial(add_rows, add, matrix), len(matrix), each)


def _add(
    x: ndarray,
    known: tuple[Clouds, SquareTable, AlongRibs, float],
    rows: slice,
    block: ndarray,
) -> None:
    _add_rows(*inputs(x[:, rows]), *known, block)


@compiled
def _add_rows(x, clouds, omega, near, factor, matrix):
    """Add ``factor`` times the integrals over all cells to rows of a matrix."""
    centres, radii, least, px, py, starts, weights = clouds
    for begin in range(0, matrix.shape[1], TOGETHER):
        for i in range(x.shape[1]):
            for j in range(begin, min(begin + TOGETHER, matrix.shape[1])):
                dx, dy = x[0, i] - centres[0, j], x[1, i] - centres[1, j]
                r2, cloud = dx * dx + dy * dy, 0
                while cloud < least.shape[0] and r2 > least[cloud, j]:
                    cloud += 1
                if cloud > 0:
                    a, b = starts[cloud - 1], starts[cloud]
                    integral = cloud_sum(
                        dx, dy, radii[j], px[a:b], py[a:b], weights[j, a:b],
                        omega.coefficients, omega.first,
                    )  # fmt: skip
                else:
                    integral = along_ribs(x[0, i], x[1, i], j, near)
                matrix[i, j] += factor * integral


@compiled
def along_ribs(x, y, cell, near):
    """Integral over the pieces of a cell, seen from (x, y)."""
    pieces, primitive, smallest, gauss, weights = near
    total = 0.0
    for piece in range(pieces.first[cell], pieces.last[cell]):
        total += pieces.density[piece] * _along_ribs(
            x, y, pieces.vertices, pieces.offsets[piece], pieces.offsets[piece + 1],
            primitive.coefficients, primitive.first, smallest, gauss, weights,
        )  # fmt: skip
    return total


@compiled
def _along_ribs(x, y, vertices, begin, end, coefficients, first, smallest, gauss, weights):
    """Integral over a polygon: on each rib of h T / r ds, T the primitive over r.

    Near by it is taken over v, the distance along the rib being ``|h| sinh v``.
    """
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
        ex, ey = dx - lx, dy - ly
        if np.sqrt(dx * dx + dy * dy) + np.sqrt(ex * ex + ey * ey) > PLAIN * length:
            part = 0.0
            for g in range(gauss.shape[0]):
                s = (gauss[g] + 1) / 2
                gx, gy = dx - s * lx, dy - s * ly
                r2 = max(gx * gx + gy * gy, smallest)
                part += weights[g] * square_value(coefficients, first, r2) / np.sqrt(r2)
            total += h * length / 2 * part
            continue
        t1 = -(lx * dx + ly * dy) / length
        v1, v2 = np.arcsinh(t1 / abs(h)), np.arcsinh((t1 + length) / abs(h))
        middle = min(max(0.0, v1), v2)
        for low, high in ((v1, middle), (middle, v2)):
            half = (high - low) / 2
            if half > 0.0:
                part = 0.0
                for g in range(gauss.shape[0]):
                    e = np.exp(low + half * (gauss[g] + 1))
                    r = abs(h) * (e + 1 / e) / 2
                    part += weights[g] * square_value(coefficients, first, max(r * r, smallest))
                total += h * half * part
    return total
