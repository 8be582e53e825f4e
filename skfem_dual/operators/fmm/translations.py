"""Loops of the fast summation over boxes; the order of all sums is fixed."""

import numpy as np

from ...ground.hankel import table_value
from ...kernels.compiled import compiled, vectorised

#: cells that are gathered together
CELLS = 16


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
def gather_loads(begin, end, rows, middle, half, centres, loads, a, b, offsets, values):
    """Blocks that take loads of cells to moments of their box.

    Block ``k`` has a row for each term, of the degrees ``a`` and ``b``, and the columns
    ``rows[0, k]`` to ``rows[1, k]``.
    """
    degrees, order = loads.shape[0], a.max() + 1
    shape = (order, degrees, CELLS)
    x, y, v = np.empty(shape), np.empty(shape), np.empty(shape)
    sx, sy, weight = np.zeros(CELLS), np.zeros(CELLS), np.empty(CELLS)
    total = np.empty(CELLS)
    for k in range(begin, end):
        f, width = 1 / half[k], rows[1, k] - rows[0, k]
        for start in range(0, width, CELLS):
            count, first = min(CELLS, width - start), rows[0, k] + start
            for c in range(count):
                sx[c] = (centres[0, first + c] - middle[0, k]) * f
                sy[c] = (centres[1, first + c] - middle[1, k]) * f
            _chebyshev(sx, x)
            _chebyshev(sy, y)
            v[:] = 0.0
            for i in range(degrees):
                for j in range(degrees - i):
                    scale = f ** (i + j)
                    for c in range(count):
                        weight[c] = scale * loads[i, j, first + c]
                    for m in range(order):
                        for c in range(CELLS):
                            v[m, i, c] += weight[c] * y[m, j, c]
            for term in range(a.shape[0]):
                total[:] = 0.0
                for i in range(degrees):
                    for c in range(CELLS):
                        total[c] += x[a[term], i, c] * v[b[term], i, c]
                at = offsets[k] + term * width + start
                for c in range(count):
                    values[at + c] = total[c]


@compiled
def look_up(coefficients, start, width, r, out):
    """A radial table at many distances."""
    for i in range(r.shape[0]):
        out[i] = table_value(coefficients, start, width, r[i])


@vectorised
def translate(begin, end, first, tables, matrices, given, found):
    """Add expansions, each taken by a matrix, to others.

    Boxes ``first + begin`` to ``first + end`` of ``found`` take from the box in each column of
    their row of ``tables``, -1 for none, with the matrix of that column.
    """
    width, height = matrices.shape[1:]
    most = 64 if width * height < 4000 else 16  # larger products would start threads of their own
    load, field = np.empty((most, width)), np.empty((most, height))
    boxes = np.empty(most, np.int64)
    for start in range(begin, end, most):
        for k in range(tables.shape[1]):
            count = 0
            for box in range(start, min(start + most, end)):
                other = tables[box, k]
                if other >= 0:
                    boxes[count] = first + box
                    for j in range(width):
                        load[count, j] = given[other, j]
                    count += 1
            if count > 0:
                np.dot(load[:count], matrices[k], field[:count])
                for i in range(count):
                    for j in range(height):
                        found[boxes[i], j] += field[i, j]


@vectorised
def block_products(begin, end, rows, starts, columns, offsets, values, vector, out):
    """Add dense blocks times parts of a vector to parts of ``out``.

    Block ``k`` has the rows ``rows[0, k]`` to ``rows[1, k]`` and the columns
    ``columns[starts[k]:starts[k + 1]]``; its entries begin at ``offsets[k]``.
    """
    widest = 0
    for k in range(begin, end):
        widest = max(widest, starts[k + 1] - starts[k])
    part = np.empty(widest)
    for k in range(begin, end):
        width = starts[k + 1] - starts[k]
        for j in range(width):
            part[j] = vector[columns[starts[k] + j]]
        at = offsets[k]
        for i in range(rows[0, k], rows[1, k]):
            total = 0.0
            for j in range(width):
                total += values[at + j] * part[j]
            out[i] += total
            at += width


@vectorised
def evaluate(begin, end, leaves, targets, middle, half, x, order, local, out):
    """Add the local expansions of some leaves at their points."""
    tx, ty = np.empty(order), np.empty(order)
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
            total, at = 0.0, 0
            for a in range(order):
                row = 0.0
                for b in range(order - a):
                    row += local[box, at + b] * ty[b]
                total += row * tx[a]
                at += order - a
            out[i] += total
