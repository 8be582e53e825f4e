"""Compiled loops of the fast summation over boxes; the order of all sums is fixed."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ...ground.hankel import table_value
from ...kernels.compiled import compiled, inputs, vectorised

#: cells whose multipole expansions are computed together
CELLS = 16
#: boxes of which expansions are translated together, and multiplications of a product that BLAS
#: does in one thread
MOST, ALONE = 256, 2**18


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


class Moments(NamedTuple):
    """Loads as in `elements.moments`: ``centres`` (2, n) and ``moments`` (k, k, n) about them."""

    centres: ndarray
    moments: ndarray


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
    """T_a(s) and its derivatives for several s, shape (order, degrees, CELLS)."""
    t[:2] = 0.0
    for c in range(CELLS):
        t[0, 0, c], t[1, 0, c], t[1, 1, c] = 1.0, s[c], 1.0
    for a in range(1, t.shape[0] - 1):
        for c in range(CELLS):
            t[a + 1, 0, c] = 2 * s[c] * t[a, 0, c] - t[a - 1, 0, c]
        for d in range(1, t.shape[1]):
            for c in range(CELLS):
                t[a + 1, d, c] = 2 * (s[c] * t[a, d, c] + d * t[a, d - 1, c]) - t[a - 1, d, c]


@vectorised
def p2m(begin, end, clusters, loads, degrees, offsets, values):
    """Blocks that take pressures of cells to the multipole expansion of their box.

    Block ``k`` has a row for each term, of the ``degrees`` in x and y, and a column for each cell
    of `Clusters` ``clusters``; ``loads`` are `Moments`.
    """
    cells, middle, half = clusters.cells, clusters.middle, clusters.half
    centres, moments = loads.centres, loads.moments
    a, b = degrees[0], degrees[1]
    orders, order = moments.shape[0], a.max() + 1
    shape = (order, orders, CELLS)
    x, y, v = np.empty(shape), np.empty(shape), np.empty(shape)
    sx, sy, weight = np.zeros(CELLS), np.zeros(CELLS), np.empty(CELLS)
    total = np.empty(CELLS)
    for k in range(begin, end):
        f, width = 1 / half[k], cells[1, k] - cells[0, k]
        for start in range(0, width, CELLS):
            count, first = min(CELLS, width - start), cells[0, k] + start
            for c in range(count):
                sx[c] = (centres[0, first + c] - middle[0, k]) * f
                sy[c] = (centres[1, first + c] - middle[1, k]) * f
            _chebyshev(sx, x)
            _chebyshev(sy, y)
            v[:] = 0.0
            for i in range(orders):
                for j in range(orders - i):
                    scale = f ** (i + j)
                    for c in range(count):
                        weight[c] = scale * moments[i, j, first + c]
                    for m in range(order):
                        for c in range(CELLS):
                            v[m, i, c] += weight[c] * y[m, j, c]
            for term in range(a.shape[0]):
                total[:] = 0.0
                for i in range(orders):
                    for c in range(CELLS):
                        total[c] += x[a[term], i, c] * v[b[term], i, c]
                at = offsets[k] + term * width + start
                for c in range(count):
                    values[at + c] = total[c]


@vectorised
def add_dipoles(begin, end, boxes, clusters, centres, dipoles, order, multipole):
    """Add dipoles of cells to the multipole expansions of their boxes.

    Box ``boxes[k]`` has the cells of `Clusters` number ``k``, with their ``centres`` (2, n) and
    ``dipoles`` (s, 2, n); ``multipole`` is of shape (s, nboxes, terms).
    """
    cells, middle, half = clusters.cells, clusters.middle, clusters.half
    x, y = np.empty((order, 2, CELLS)), np.empty((order, 2, CELLS))
    sx, sy, px, py = np.zeros(CELLS), np.zeros(CELLS), np.zeros(CELLS), np.zeros(CELLS)
    for k in range(begin, end):
        f, box = 1 / half[k], boxes[k]
        for first in range(cells[0, k], cells[1, k], CELLS):
            count = min(CELLS, cells[1, k] - first)
            for c in range(count):
                sx[c] = (centres[0, first + c] - middle[0, k]) * f
                sy[c] = (centres[1, first + c] - middle[1, k]) * f
            px[:], py[:] = 0.0, 0.0
            _chebyshev(sx, x)
            _chebyshev(sy, y)
            for s in range(dipoles.shape[0]):
                term = 0
                for i in range(order):
                    for c in range(count):
                        along = f * dipoles[s, 0, first + c] * x[i, 1, c]
                        px[c], py[c] = along, f * dipoles[s, 1, first + c] * x[i, 0, c]
                    for j in range(order - i):
                        total = 0.0
                        for c in range(CELLS):
                            total += px[c] * y[j, 0, c] + py[c] * y[j, 1, c]
                        multipole[s, box, term] += total
                        term += 1


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
    # larger products would start threads of their own
    together = max(min(MOST, ALONE // (width * height)) // sets, 1)
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
            for a in range(order):
                for b in range(order - a):
                    values[at] = tx[a] * ty[b]
                    at += 1
            for s in range(local.shape[0]):
                total = 0.0
                for j in range(at):
                    total += local[s, box, j] * values[j]
                out[s, i] += total
