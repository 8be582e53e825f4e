"""Settlement of the ground under uniformly loaded polygonal cells.

What c / r contributes is a sum over the ribs of the cells, see `ribs`; what the influence function
has beyond that is added by `remainder`.

Source: K. L. Johnson, Contact Mechanics (1985), section 3.3, pressure applied to a polygonal
region.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import LARGEST, checked_array
from ..grids.partition import Partition
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights
from .remainder import Add, add_rows, remainder_blocks
from .ribs import FAR, FARTHER, Ribs, atanh_series, rib_integral, short_series

#: rows of a matrix that are filled together
BLOCK = 96
#: points that are looked at together at most, always multiples of the second, and their distances
#: from vertices that are kept at a time
WIDTH, STEP, ROOM = 32, 8, 2**22
#: sums that are copied together, few enough for caches
TILE = 32
#: nanoseconds that a rib takes, about
RIB = 2


def influence_matrix(
    substrate: Substrate,
    partition: Partition,
    x: ArrayLike,
    weights: EdgeWeights | None = None,
    others: Sequence[Add] = (),
) -> ndarray:
    """Settlements at points under unit pressure on each cell: the d_ij of (5).

    Parameters
    ----------
    substrate : Substrate
        The ground.
    partition : Partition
        The loaded cells.
    x : (2, m) array of float
        Field points anywhere on the surface, also on ribs and nodes.
    weights : EdgeWeights, optional
        How the load varies inside edge-weighted cells, for what the influence function has
        beyond c / r; for c / r the variation is left to `EdgeCorrection`.
    others : sequence of callables, optional
        What is added, as `EdgeCorrection.add`, while rows are at hand.

    Returns
    -------
    (m, ncells) array of float
        Settlement per unit pressure, positive into the ground.

    Examples
    --------
    The centre of a square with sides 2 settles by 8 asinh(1) / (pi E*):

    >>> from skfem import MeshQuad
    >>> from skfem_dual import HalfSpace
    >>> square = Partition.from_mesh(MeshQuad.init_tensor([-1.0, 1.0], [-1.0, 1.0]))
    >>> D = influence_matrix(HalfSpace(1.0, 0.0), square, [[0.0], [0.0]])
    >>> bool(np.isclose(D[0, 0], 8 * np.arcsinh(1) / np.pi, rtol=1e-14))
    True
    """
    x = as_points(x)
    matrix = np.zeros((x.shape[1], len(partition)))
    ribs, c = Ribs.from_partition(partition), substrate.singular_coefficient
    each = RIB * ribs.facets.shape[1]
    (factors,) = inputs(np.broadcast_to([[c], [-c]], ribs.f2c.shape))

    def work(rows: slice) -> None:
        for first in range(rows.start, rows.stop, BLOCK):
            some = slice(first, min(first + BLOCK, rows.stop))
            _add(*inputs(x[:, some]), ribs, ribs.f2c, factors, matrix[some])
            for add in others:
                add(some, matrix[some])

    with Threads() as run:
        run(work, x.shape[1], each)
        for cells, add in remainder_blocks(substrate, partition, weights, x):
            run(partial(add_rows, add, matrix[:, cells]), x.shape[1])
    return matrix


def surface_displacement(
    substrate: Substrate,
    partition: Partition,
    pressure: ndarray,
    x: ArrayLike,
    weights: EdgeWeights | None = None,
) -> ndarray:
    """Settlements at points ``x`` of shape (2, m) under pressures of the cells; no matrix.

    Pressures are of shape (n,) or (n, k), the settlements (m,) or (m, k).
    """
    x = as_points(x)
    # each rib counts with the jump of the pressure across it
    jump = np.append(pressure, np.zeros((1, *pressure.shape[1:])), axis=0)[partition.f2c]
    jump = substrate.singular_coefficient * (jump[0] - jump[1])
    out = np.zeros((x.shape[1], *pressure.shape[1:]))
    columns = out.reshape(len(out), jump[0].size)
    ribs = Ribs.from_partition(partition)
    each = RIB * ribs.facets.shape[1]
    jump = jump.reshape(len(jump), columns.shape[1]).T
    sums = np.broadcast_to(np.arange(len(jump), dtype=np.int32)[:, None], jump.shape)
    known = ribs, *inputs(sums, jump)
    with Threads() as run:
        run(lambda rows: _add(*inputs(x[:, rows]), *known, columns[rows]), x.shape[1], each)
    add_remainder(substrate, partition, pressure, x, weights, out)
    return out


def add_remainder(
    substrate: Substrate,
    partition: Partition,
    pressure: ndarray,
    x: ndarray,
    weights: EdgeWeights | None,
    out: ndarray,
) -> None:
    """Add the part of `surface_displacement` by the influence function beyond c / r, if any."""
    with Threads() as run:
        for cells, add in remainder_blocks(substrate, partition, weights, x):
            run(partial(_add_product, add, pressure[cells], out), x.shape[1])


def _add_product(add: Add, pressure: ndarray, out: ndarray, rows: slice) -> None:
    """Add the settlements under pressures of some cells to some rows of ``out``."""
    block = np.zeros((rows.stop - rows.start, len(pressure)))
    add(rows, block)
    out[rows] += block @ pressure


def as_points(x: ArrayLike) -> ndarray:
    """``x`` as coordinates of shape (2, m).

    Raises
    ------
    TypeError, ValueError
        If it has another shape or is not finite.
    """
    return _within(checked_array("x", x, (2, "m"), each="point"))


def flat_points(x: ArrayLike) -> tuple[ndarray, tuple[int, ...]]:
    """Points of any shape (2, ...) as coordinates of shape (2, m), and the shape behind the 2.

    Raises
    ------
    TypeError, ValueError
        If there are no two coordinates, or one is not finite.
    """
    points = checked_array("x", x, (2, "..."), each="point")
    return _within(points.reshape(2, -1)), points.shape[1:]


def _within(points: ndarray) -> ndarray:
    """Points whose distances are numbers."""
    if (np.abs(points) > LARGEST).any():
        i = int(np.nonzero((np.abs(points) > LARGEST).any(axis=0))[0][0])
        raise ValueError(f"expected coordinates of x up to {LARGEST:g}, got more at point {i}")
    return points


@compiled
def _width(points, nodes):
    """How many points are looked at together."""
    return min(WIDTH, -(-points // STEP) * STEP, max(ROOM // nodes, 1))


@compiled
def _block(x, first, x0, y0):
    """The points from the number ``first`` on, the last again and again; returns how many."""
    count = min(len(x0), x.shape[1] - first)
    for i in range(len(x0)):
        x0[i], y0[i] = x[0, first + min(i, count - 1)], x[1, first + min(i, count - 1)]
    return count


@vectorised
def _distances(p, x0, y0, r):
    """Put the distances of nodes p from the points of a block into ``r``."""
    for k in range(p.shape[1]):
        px, py = p[0, k], p[1, k]
        for i in range(len(x0)):
            dx, dy = x0[i] - px, y0[i] - py
            r[k, i] = np.sqrt(dx * dx + dy * dy)


@vectorised
def _add(x, ribs, rows, factors, out):
    """Add integrals of 1/r to ``out`` of shape (m, nsums): that of a rib counts in the sums
    ``rows[:, rib]``, -1 for none, times ``factors[:, rib]``."""
    p, facets, _ = ribs
    width = _width(x.shape[1], p.shape[1])
    x0, y0, values = np.empty(width), np.empty(width), np.empty(width)
    r = np.empty((p.shape[1], width))
    total = np.empty((out.shape[1] + 1, width))  # the last for none
    for first in range(0, x.shape[1], width):
        count = _block(x, first, x0, y0)
        _distances(p, x0, y0, r)
        total[:] = 0.0
        # loops stand here: in functions of their own they would count references for every rib
        for f in range(facets.shape[1]):
            a, b = facets[0, f], facets[1, f]
            ax, ay, lx, ly = p[0, a], p[1, a], p[0, b] - p[0, a], p[1, b] - p[1, a]
            square = lx * lx + ly * ly
            length, near = np.sqrt(square), 0
            for i in range(width):
                near += r[a, i] + r[b, i] <= FARTHER * length
            if near == 0:
                for i in range(width):
                    q = 1 / (r[a, i] + r[b, i])
                    series = short_series(square * (q * q))
                    values[i] = 2 * (lx * (y0[i] - ay) - ly * (x0[i] - ax)) * q * series
            else:
                for i in range(width):
                    q = 1 / (r[a, i] + r[b, i])
                    series = atanh_series(square * (q * q))
                    values[i] = 2 * (lx * (y0[i] - ay) - ly * (x0[i] - ax)) * q * series
                for i in range(width):
                    r1, r2 = r[a, i], r[b, i]
                    if r1 + r2 <= FAR * length:
                        values[i] = rib_integral(x0[i], y0[i], ax, ay, lx, ly, length, r1, r2)
            for s in range(rows.shape[0]):
                row, factor = rows[s, f], factors[s, f]
                for i in range(width):
                    total[row, i] += factor * values[i]
        for start in range(0, out.shape[1], TILE):
            for i in range(count):
                for j in range(start, min(start + TILE, out.shape[1])):
                    out[first + i, j] += total[j, i]
