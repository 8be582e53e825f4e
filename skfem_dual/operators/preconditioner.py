"""An approximate inverse of influence operators, in two levels.

Settlements that vary slowly are answered by uniform pressures on large boxes, what these leave by
solutions on small groups of cells with their neighbours, of which each group keeps its own part:
restricted additive Schwarz (Cai and Sarkis, SIAM J. Sci. Comput. 21 (1999) 792) after a coarse
space of uniform pressures (Smith, Bjorstad and Gropp, Domain Decomposition, 1996: multiplicative).
What they leave is known to percents from a short product; taken for the settlements less their
means over the boxes it would cost twice the steps.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..elements.influence import influence_matrix
from ..grids.partition import Partition
from ..grids.polygons import Polygons
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.threads import Threads
from .factors import RoughFactors
from .fmm.linear_maps import SparseBlocks
from .fmm.lists import near_lists
from .fmm.loops import Layout
from .fmm.quadtree import Quadtree
from .influence_operator import InfluenceOperator
from .known_entries import KnownEntries, look_up
from .toeplitz import Convolution

#: what a fast summation stands for, or a matrix
Acting = InfluenceOperator | ndarray
#: mean number of cells in a group of a uniform mesh
GROUP = 10
#: neighbours of a group lie so far beyond it, over the half-width of its box
OVERLAP = 0.9
#: cells of a group and its neighbours at most, the nearest, where far smaller ones are beside it
AROUND = 100
#: greatest short integer
GREATEST = 32767
#: large boxes, about; over the root of the number of cells, where that is more: a million take 9
#: steps with 3000 and 11 with 1000; and the fewest cells in one
COARSE, BY_ROOT, FEWEST = 1000, 3.0, 30


def approximate_inverse(operator: InfluenceOperator) -> "Preconditioner | Convolution":
    """What is nearly the inverse of a square operator: on a regular grid that of its symbol."""
    if operator.toeplitz is not None:
        return operator.toeplitz.inverse
    return Preconditioner.from_operator(operator)


@dataclass(frozen=True, eq=False)
class Preconditioner:
    """An approximate inverse of a square operator, for any number of threads at a time.

    Attributes
    ----------
    groups : Groups
        What answers settlements that vary from cell to cell.
    coarse : Coarse
        What answers slowly varying ones.
    acting : InfluenceOperator or None
        Tells what the latter leave; otherwise that is settlements less their means over the boxes.
    """

    groups: "Groups"
    coarse: "Coarse"
    acting: InfluenceOperator | None

    @classmethod
    def from_operator(cls, operator: InfluenceOperator) -> "Preconditioner":
        """Of an operator from cells to the collocation point of each.

        Raises
        ------
        ValueError
            If the operator is not square.
        """
        if operator.shape[0] != operator.shape[1]:
            raise ValueError(f"expected a square operator, got shape {operator.shape}")
        acting = operator.to_dense() if operator.summation is None else operator
        groups = Groups.from_operator(acting, operator.partition)
        fast = None if operator.summation is None else operator
        return cls(groups, Coarse.from_operator(operator), fast)

    def __matmul__(self, w: ndarray) -> ndarray:
        """Approximate pressures under settlements ``w`` of shape (n,) or (n, k)."""
        columns = w.reshape(len(w), -1)
        means = self.coarse.means(columns)
        out = self.coarse.on_cells(self.coarse.factors.solve(means))
        known = self.coarse.on_cells(means) if self.acting is None else self.acting.coarsely(out)
        out += self.groups @ (columns - known)
        return out.reshape(w.shape)


@dataclass(frozen=True, eq=False)
class Groups:
    """Inverses on small groups of cells and their neighbours.

    Attributes
    ----------
    cells : (n,) array of int
        The cells in the order of the blocks.
    blocks : SparseBlocks
        Rows of each group in the inverse on the group and its neighbours, as short integers.
    units : (n,) array of float
        What one is in each row of them.
    """

    cells: ndarray
    blocks: SparseBlocks
    units: ndarray

    @classmethod
    def from_operator(cls, operator: Acting, partition: Partition) -> "Groups":
        """Of the cells of a partition, with their fast operator or their matrix."""
        centroids, points = partition.centroids, np.zeros(len(partition))
        tree = _boxes(partition, GROUP, 2 * GROUP)
        cells = tree.cells  # the same order as that of the points
        near = near_lists(tree, centroids[:, cells], points, len(partition)).p2p
        middle, half = tree.middle[:, near.boxes], tree.half[near.boxes]
        known = inputs(near.starts, near.items, middle, half, centroids[:, cells])
        counts = np.empty(len(half), np.int64)
        _choose(*known, counts, np.empty(0, np.int32))
        starts = np.concatenate([[0], np.cumsum(counts)])
        items = np.empty(starts[-1], np.int32)
        _choose(*known, starts, items)
        del known
        rows = tree.targets[:, near.boxes]
        blocks, units = _inverses(operator, cells, rows, starts, items)
        return cls(cells, blocks, units)

    def __matmul__(self, w: ndarray) -> ndarray:
        """Pressures under settlements ``w`` of shape (n,) or (n, k) as if other groups had
        none."""
        rows = w.T.reshape(-1, len(w))
        inner, out = np.zeros(rows.shape), np.empty(rows.shape)
        with Threads() as run:
            self.blocks.add_product(rows.take(self.cells, axis=1), inner, run)
        for own, row in zip(out, inner, strict=True):
            own[self.cells] = self.units * row
        return out.reshape(w.T.shape).T


@dataclass(frozen=True, eq=False)
class Coarse:
    """Large boxes of cells, each taken for a square under uniform pressure.

    Attributes
    ----------
    box : (n,) array of int
        Box of each cell.
    shares : (n,) array of float
        Area of each cell over that of its box.
    factors : RoughFactors
        Of the settlements of the squares' middles.
    """

    box: ndarray
    shares: ndarray
    factors: RoughFactors

    @classmethod
    def from_operator(cls, operator: InfluenceOperator) -> "Coarse":
        """Of the cells of an operator."""
        partition = operator.partition
        n = len(partition)
        size = min(n / COARSE, n**0.5 / BY_ROOT)
        box = large_boxes(partition, max(FEWEST, int(size)))
        areas = np.bincount(box, partition.areas)
        middles = np.stack([np.bincount(box, partition.areas * x) for x in partition.centroids])
        squares = _squares(middles / areas, np.sqrt(areas))
        matrix = influence_matrix(operator.substrate, squares, squares.nodes)
        return cls(box, partition.areas / areas[box], RoughFactors.from_matrix(matrix))

    def means(self, w: ndarray) -> ndarray:
        """Those over the boxes of settlements (n, k), shape (k, nboxes)."""
        return np.array([np.bincount(self.box, self.shares * column) for column in w.T])

    def on_cells(self, values: ndarray) -> ndarray:
        """Values of the boxes (k, nboxes) on their cells, (n, k)."""
        return values.take(self.box, axis=1).T


def large_boxes(partition: Partition, size: int) -> ndarray:
    """The box of each cell, of boxes of about ``size``, (n,)."""
    tree = _boxes(partition, size, 1.6 * size)
    box = np.empty(len(partition), np.int32)
    for k, (begin, end) in enumerate(tree.targets[:, tree.leaves].T):
        box[tree.points[begin:end]] = k
    return box


def _boxes(partition: Partition, size: int, most: float) -> Quadtree:
    """Cells by their centroids in boxes of about ``size`` and at most ``most``."""
    centroids, points = partition.centroids, np.zeros(len(partition))
    unit = np.sqrt(size * np.median(partition.areas))
    return Quadtree.from_circles(centroids, points, centroids, int(most), 1.0, unit)


def _squares(middles: ndarray, sides: ndarray) -> Partition:
    """Squares that share no ribs."""
    n = len(sides)
    corners = np.array([[-0.5, 0.5, 0.5, -0.5], [-0.5, -0.5, 0.5, 0.5]])
    p = (middles[:, :, None] + sides[:, None] * corners[:, None]).reshape(2, -1)
    vertices = np.arange(4 * n).reshape(n, 4)
    facets = np.stack([vertices.ravel(), np.roll(vertices, -1, axis=1).ravel()])
    outside = np.full(4 * n, -1)
    return Partition(
        Polygons(p, vertices.ravel(), np.arange(0, 4 * n + 1, 4)),
        facets,
        np.stack([np.repeat(np.arange(n), 4), outside]),
        middles,
        outside,
    )


@compiled
def _choose(starts, items, middle, half, x, places, chosen):
    """Cells of each group and the nearest around it, ascending; without room their number."""
    for k in range(half.shape[0]):
        begin, end = starts[k], starts[k + 1]
        away, kept = np.empty(end - begin), np.empty(end - begin, np.int32)
        count = 0
        for at in range(begin, end):
            j = items[at]
            far = max(abs(x[0, j] - middle[0, k]), abs(x[1, j] - middle[1, k]))
            if far <= (1 + OVERLAP) * half[k]:
                away[count], kept[count] = far, j
                count += 1
        while count > AROUND:
            farthest = np.argmax(away[:count])
            if away[farthest] <= half[k]:
                break
            count -= 1
            away[farthest], kept[farthest] = away[count], kept[count]
        if chosen.shape[0] == 0:
            places[k] = count
            continue
        own = chosen[places[k] : places[k + 1]]
        for i in range(count):  # one after the other to its place: sorts take seconds to compile
            at = i
            while at > 0 and own[at - 1] > kept[i]:
                own[at] = own[at - 1]
                at -= 1
            own[at] = kept[i]


def _inverses(
    operator: Acting, cells: ndarray, rows: ndarray, starts: ndarray, items: ndarray
) -> tuple[SparseBlocks, ndarray]:
    """Rows of inverses of what acts nearby, in short integers, and the units of these."""
    n, known, near = len(cells), None, csr_matrix(operator.shape)
    (matrix,) = inputs(operator if isinstance(operator, ndarray) else np.empty((0, 0)))
    if not isinstance(operator, ndarray) and operator.summation is not None:
        known = KnownEntries.from_summation(operator.summation, operator, cells)
        if operator.correction is not None:
            near = operator.correction.near[cells][:, cells].tocsr()
    sparse = inputs(near.indptr, near.indices, near.data)
    layout = Layout.from_lists(rows, starts, items)
    offsets = layout.offsets
    values, units = np.empty(offsets[-1], np.int16), np.empty(n)

    def work(piece: slice) -> None:
        room = np.zeros(n, np.int32), np.empty(n, np.int32)
        for first in range(piece.start, piece.stop, 64):
            k = slice(first, min(first + 64, piece.stop))
            ends = starts[k.start : k.stop + 1]
            local = np.empty(int(np.sum(np.diff(ends) ** 2)))
            if known is None:
                _take(matrix, *inputs(cells, ends, items), local)
            else:
                look_up(*inputs(ends, items), known, *room, local)
            part = values[offsets[k.start] : offsets[k.stop]]
            _invert(*inputs(rows[:, k], ends, items), *sparse, local, units, part)

    with Threads() as run:
        run(work, rows.shape[1])
    return SparseBlocks(layout, values), units


@vectorised
def _take(matrix, cells, starts, items, out):
    """Blocks of a matrix, with the rows and columns of some items."""
    at = 0
    for k in range(starts.shape[0] - 1):
        some = cells[items[starts[k] : starts[k + 1]]]
        for i in some:
            for j in some:
                out[at] = matrix[i, j]
                at += 1


@vectorised
def _subtract(m, i, k, f, first):
    """Subtract a multiple of a row from another, from some column on."""
    for j in range(np.uint64(first), np.uint64(m.shape[1])):
        m[i, j] -= f * m[k, j]


@vectorised
def _invert(rows, starts, items, indptr, indices, data, local, units, values):
    """Rows of the inverses of square blocks, after sparse entries are added to these; rounded to
    multiples of a unit each."""
    at, out = 0, 0
    for block in range(rows.shape[1]):
        some = items[starts[block] : starts[block + 1]]
        size, own = some.shape[0], rows[1, block] - rows[0, block]
        first = np.searchsorted(some, rows[0, block])
        # rows of the inverse solve equations with the transpose, whose right-hand sides follow it
        m = np.zeros((size, size + own))
        for i in range(size):
            for j in range(size):
                m[j, i] = local[at + i * size + j]
            for k in range(indptr[some[i]], indptr[some[i] + 1]):
                j = np.searchsorted(some, indices[k])
                if j < size and some[j] == indices[k]:
                    m[j, i] += data[k]
        for i in range(own):
            m[first + i, size + i] = 1.0
        for k in range(size):
            pivot = k
            for i in range(k + 1, size):
                if abs(m[i, k]) > abs(m[pivot, k]):
                    pivot = i
            for j in range(k, size + own):
                m[k, j], m[pivot, j] = m[pivot, j], m[k, j]
            f = 1 / m[k, k]
            for i in range(k + 1, size):
                _subtract(m, i, k, f * m[i, k], k + 1)
        for k in range(size - 1, -1, -1):
            for i in range(k + 1, size):
                _subtract(m, k, i, m[k, i], size)
            for j in range(size, size + own):
                m[k, j] /= m[k, k]
        y = m[:, size:]
        for i in range(own):
            most = 0.0
            for j in range(size):
                most = max(most, abs(y[j, i]))
            units[rows[0, block] + i] = most / GREATEST
            for j in range(size):
                values[out] = np.int16(np.rint(GREATEST / most * y[j, i]))
                out += 1
        at += size * size
