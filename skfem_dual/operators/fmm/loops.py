"""Compiled loops of the fast summation over boxes; the order of all sums is fixed."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ...ground.hankel import table_value
from ...kernels.compiled import compiled, inputs, vectorised

#: cells whose multipole expansions are computed together
CELLS = 16
#: expansions that are translated together
MOST = 256


class Clusters(NamedTuple):
    """Boxes and the cells that they hold themselves.

    Attributes
    ----------
    cells : (2, k) array of int
        Box ``k`` has the cells ``cells[0, k]`` to ``cells[1, k]``.
    middle, half : (2, k), (k,) array of float
        Centres of the boxes and the half-widths to which coordinates of loads refer.
    """

    cells: ndarray
    middle: ndarray
    half: ndarray


class Loads(NamedTuple):
    """Cells under unit pressure, as `add_multipoles` takes them.

    Attributes
    ----------
    centres : (2, n) array of float
    squares : (n,) array of float
        Areas over pi.
    moments : (k, n) array of float
        Those of `elements.moments.Multipoles` about the centres in units of area and box, in the
        order of `Chebyshev.degrees`, which add up to less than ``orders``.
    orders : int
    """

    centres: ndarray
    squares: ndarray
    moments: ndarray
    orders: int


class Layout(NamedTuple):
    """Where the entries of a sparse matrix of dense blocks are.

    Attributes
    ----------
    rows : (2, k) array of int
        Block ``k`` has the rows ``rows[0, k]`` to ``rows[1, k]``; no two blocks share one.
    starts, columns : arrays of int
        It has the columns ``columns[starts[k]:starts[k + 1]]``.
    offsets : (k + 1,) array of int
        Its entries begin at ``offsets[k]``, row by row.
    """

    rows: ndarray
    starts: ndarray
    columns: ndarray
    offsets: ndarray

    @classmethod
    def from_lists(cls, rows: ndarray, starts: ndarray, columns: ndarray) -> "Layout":
        """Of blocks one after the other."""
        sizes = np.diff(starts) * (rows[1] - rows[0])
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        kinds = np.int64, np.int64, np.int32, np.int64
        arrays = rows, starts, columns, offsets
        return cls(*inputs(*(np.asarray(a, kind) for a, kind in zip(arrays, kinds))))


@vectorised
def _chebyshev(s, t):
    """T_a(s) and its derivatives for several s, `CELLS` for each degree, in the rows of ``t``."""
    t[:2] = 0.0
    two = t.dtype.type(2)  # whole numbers would make single precision double
    for c in range(CELLS):
        t[0, c], t[1, c], t[1, CELLS + c] = 1.0, s[c], 1.0
    for a in range(1, t.shape[0] - 1):
        for c in range(CELLS):
            t[a + 1, c] = two * s[c] * t[a, c] - t[a - 1, c]
        for d in range(1, t.shape[1] // CELLS):
            at, f = d * CELLS, t.dtype.type(2 * d)
            for c in range(CELLS):
                before = f * t[a, at - CELLS + c] - t[a - 1, at + c]
                t[a + 1, at + c] = two * s[c] * t[a, at + c] + before


@vectorised
def add_multipoles(begin, end, boxes, clusters, loads, order, q, dipoles, multipole):
    """Add pressures and dipoles of cells to the multipole expansions of their boxes.

    Box ``boxes[k]`` has the cells of `Clusters` number ``k``, of `Loads` ``loads``. Pressures
    ``q`` are of shape (s, n), dipoles (s, 2, n), or (s, 2, 0) if there are none; ``multipole`` is
    of shape (s, nboxes, terms).
    """
    cells, middle, half = clusters.cells, clusters.middle, clusters.half
    centres, squares, moments = loads.centres, loads.squares, loads.moments
    sets, some, kind = q.shape[0], dipoles.shape[2] > 0, multipole.dtype
    # of the polynomials in x, and of the loads times those in y: scalar products of both
    x = np.empty((order, loads.orders * CELLS), kind)
    y = np.empty_like(x)
    loaded = np.empty((sets * order, loads.orders * CELLS), kind)
    place, own = np.zeros((2, CELLS), kind), np.zeros((len(moments), CELLS), kind)
    load, unit = np.empty((sets, 3, CELLS), kind), np.empty(CELLS, kind)
    for k in range(begin, end):
        f, box = 1 / half[k], boxes[k]
        for first in range(cells[0, k], cells[1, k], CELLS):
            count = min(CELLS, cells[1, k] - first)
            load[:] = 0.0
            for i in range(2):
                for c in range(count):
                    place[i, c] = (centres[i, first + c] - middle[i, k]) * f
            for s in range(sets):
                for c in range(count):
                    load[s, 0, c] = np.pi * squares[first + c] * q[s, first + c]
                if some:
                    for i in range(2):
                        for c in range(count):
                            load[s, 1 + i, c] = f * dipoles[s, i, first + c]
            for row in range(len(moments)):
                for c in range(count):
                    own[row, c] = moments[row, first + c]
            _chebyshev(place[0], x)
            _chebyshev(place[1], y)
            _load(own, y, load, unit, loaded)
            for s in range(sets):
                term = 0
                for degree in range(order):
                    for a in range(degree + 1):
                        along, across = x[a], loaded[s * order + degree - a]
                        total = multipole.dtype.type(0)
                        for c in range(along.shape[0]):
                            total += along[c] * across[c]
                        multipole[s, box, term] += total
                        term += 1


@vectorised
def _load(moments, y, load, unit, out):
    """Put what derivatives of polynomials in x are multiplied with, a row for each load and each
    polynomial in y."""
    order, orders = y.shape[0], y.shape[1] // CELLS
    for b in range(order):
        for i in range(orders):
            row = i * (i + 3) // 2
            for c in range(CELLS):
                unit[c] = moments[row, c] * y[b, c]
            for j in range(1, orders - i):
                row += i + j
                for c in range(CELLS):
                    unit[c] += moments[row, c] * y[b, j * CELLS + c]
            # those along y go with no derivative in x, those along x with the first
            at, other, derivative = i * CELLS, max(2 - i, 0), max(1 - i, 0) * CELLS
            for s in range(load.shape[0]):
                r = s * order + b
                if other > 0:
                    for c in range(CELLS):
                        dipole = load[s, other, c] * y[b, derivative + c]
                        out[r, at + c] = load[s, 0, c] * unit[c] + dipole
                else:
                    for c in range(CELLS):
                        out[r, at + c] = load[s, 0, c] * unit[c]


@compiled
def look_up(coefficients, start, width, r, out):
    """A radial table at many distances."""
    for i in range(r.shape[0]):
        out[i] = table_value(coefficients, start, width, r[i])


@vectorised
def translate(begin, end, first, sources, matrices, given, out):
    """Add expansions, each times a matrix, to others: M2M, M2L and L2L.

    Boxes ``first + begin`` to ``first + end`` of ``out``, shape (s, nboxes, terms), take from the
    box in each column of their row of ``sources``, -1 for none, with the matrix of that column.
    """
    width, height = matrices.shape[1:]
    sets = given.shape[0]
    together = max(MOST // sets, 1)
    taken = np.empty((together * sets, width), matrices.dtype)
    product = np.empty((together * sets, height), matrices.dtype)
    boxes = np.empty(together, np.int64)
    for start in range(begin, end, together):
        for k in range(sources.shape[1]):
            count = 0
            for box in range(start, min(start + together, end)):
                other = sources[box, k]
                if other >= 0:
                    boxes[count] = first + box
                    for s in range(sets):
                        for j in range(width):
                            taken[count * sets + s, j] = given[s, other, j]
                    count += 1
            if count > 0:
                np.dot(taken[: count * sets], matrices[k], product[: count * sets])
                for i in range(count):
                    for s in range(sets):
                        for j in range(height):
                            out[s, boxes[i], j] += product[i * sets + s, j]


@vectorised
def block_products(begin, end, layout, values, vectors, out):
    """Add blocks with the `Layout` ``layout`` times parts of vectors to parts of ``out``.

    Vectors are rows of both. Every entry is read once for three of them.
    """
    rows, starts, columns, offsets = layout.rows, layout.starts, layout.columns, layout.offsets
    widest, sets = 0, vectors.shape[0]
    for k in range(begin, end):
        widest = max(widest, starts[k + 1] - starts[k])
    part = np.empty((sets, widest))
    for k in range(begin, end):
        width = starts[k + 1] - starts[k]
        for s in range(sets):
            for j in range(width):
                part[s, j] = vectors[s, columns[starts[k] + j]]
        at = offsets[k]
        for i in range(rows[0, k], rows[1, k]):
            for s in range(0, sets - 2, 3):
                one, two, three = 0.0, 0.0, 0.0
                for j in range(width):
                    value = values[at + j]
                    one += value * part[s, j]
                    two += value * part[s + 1, j]
                    three += value * part[s + 2, j]
                out[s, i] += one
                out[s + 1, i] += two
                out[s + 2, i] += three
            for s in range(sets - sets % 3, sets):
                total = 0.0
                for j in range(width):
                    total += values[at + j] * part[s, j]
                out[s, i] += total
            at += width


@vectorised
def l2p(begin, end, leaves, boxes, x, order, local, out):
    """Add the local expansions of some leaves at their points."""
    targets, middle, half = boxes.targets, boxes.middle, boxes.half
    tx, ty, values = np.empty(order), np.empty(order), np.empty(local.shape[2])
    tx[0], ty[0] = 1.0, 1.0
    for k in range(begin, end):
        box = leaves[k]
        for i in range(targets[0, box], targets[1, box]):
            sx = (x[0, i] - middle[0, box]) / half[box]
            sy = (x[1, i] - middle[1, box]) / half[box]
            tx[1], ty[1] = sx, sy
            for a in range(1, order - 1):
                tx[a + 1] = 2 * sx * tx[a] - tx[a - 1]
                ty[a + 1] = 2 * sy * ty[a] - ty[a - 1]
            at = 0
            for degree in range(order):
                for a in range(degree + 1):
                    values[at] = tx[a] * ty[degree - a]
                    at += 1
            for s in range(local.shape[0]):
                total = 0.0
                for j in range(at):
                    total += local[s, box, j] * values[j]
                out[s, i] += total
