"""Fast summation of settlements: near cells directly, far ones through a quadtree.

Loads of cells become moments in Chebyshev polynomials of their box, moments of boxes become those
of larger boxes, and act on local expansions of boxes of the same level that are not adjacent. The
kernel is only evaluated, so any radial influence function will do. One for c / r and one for the
remainder have loads of their own and share the local expansions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy import ndarray

from ...elements.edge_weights import EdgeWeights
from ...elements.moments import Multipoles, radii
from ...elements.near import NearField
from ...elements.remainder import ALONG_RIBS
from ...grids.partition import Partition
from ...ground.hankel import RadialTable
from ...ground.substrates import Substrate
from ...kernels.compiled import inputs
from ...kernels.threads import Threads
from .chebyshev import PADDING, Chebyshev, Kernel
from .lists import Lists, near_lists
from .quadtree import OFFSETS, Quadtree
from .translations import block_products, evaluate, gather_loads, look_up, translate

#: from half-width and the offsets needed to matrices as `compressed`
Crossing = Callable[[float, ndarray], tuple[ndarray, ndarray, ndarray]]
Run = Callable[[Callable[[slice], None], int], None]

#: cells, or points, of a box that is not divided
LEAF = 22
#: boxes have sides of at least twice this times the radius of their cells
SLACK = 1.3
#: mean number of cells in a leaf of a uniform mesh
OCCUPANCY = 11.0
#: from this tolerance on entries are kept in single precision
SINGLE = 1e-7


def order_for(rtol: float) -> int:
    """Order of expansions for a relative error of settlements under pressures of one sign."""
    return max(4, int(np.ceil(-2 * np.log10(rtol) - 3 - 1e-9)))


@dataclass(frozen=True, eq=False)
class Blocks:
    """Dense blocks, see `block_products`."""

    rows: ndarray
    starts: ndarray
    columns: ndarray
    values: ndarray

    @property
    def offsets(self) -> ndarray:
        """Where the entries of each block begin."""
        sizes = np.diff(self.starts) * (self.rows[1] - self.rows[0])
        return np.concatenate([[0], np.cumsum(sizes)])

    def __post_init__(self):
        kinds = {"rows": np.int64, "starts": np.int64, "columns": np.int32}
        for name, kind in kinds.items():
            object.__setattr__(self, name, *inputs(getattr(self, name).astype(kind, copy=False)))

    def add_product(self, vector: ndarray, out: ndarray, run: Run) -> None:
        """Add the blocks times ``vector`` to ``out``; no two blocks share a row."""
        blocks = inputs(self.rows, self.starts, self.columns, self.offsets, self.values, vector)
        args = *blocks, out
        run(lambda k: block_products(k.start, k.stop, *args), len(self.starts) - 1)

    @property
    def nbytes(self) -> int:
        """Memory."""
        return sum(a.nbytes for a in (self.rows, self.starts, self.columns, self.values))


@dataclass(frozen=True, eq=False)
class Translation:
    """From some expansions to those of the boxes of a level, see `translate`.

    Attributes
    ----------
    first : int
        The first box of the level.
    tables : (nboxes, k) array of int
        Boxes from which each takes.
    matrices : (k, terms, terms) array of float
    """

    first: int
    tables: ndarray
    matrices: ndarray

    def __post_init__(self):
        object.__setattr__(self, "tables", np.ascontiguousarray(self.tables, np.int32))
        object.__setattr__(self, "matrices", np.ascontiguousarray(self.matrices))

    def add(self, given: ndarray, found: ndarray, run: Run) -> None:
        """Take ``given`` and add it to ``found``, of shapes (nboxes, terms)."""
        args = self.first, self.tables, self.matrices, given, found
        run(lambda k: translate(k.start, k.stop, *args), len(self.tables))


@dataclass(frozen=True, eq=False)
class Field:
    """One kernel and the loads that act through it.

    Attributes
    ----------
    gather : Blocks
        From cells to moments of their boxes.
    across : tuple of three Translations for each level
        From moments to local expansions, by way of the directions that matter.
    outward : Blocks
        From moments of boxes to single points.
    """

    gather: Blocks
    across: tuple[tuple[Translation, Translation, Translation], ...]
    outward: Blocks


@dataclass(frozen=True, eq=False)
class FastSummation:
    """What multiplies by the matrix of settlements without forming it.

    Attributes
    ----------
    tree : Quadtree
    x : (2, m) array of float
        Field points, in the order of the tree.
    chebyshev : Chebyshev
    upward, downward : tuple of Translation
        Of moments to larger boxes, of local expansions to smaller ones.
    near : Blocks
        Entries of near cells, exact.
    inward : Blocks
        From cells to local expansions of boxes too near to theirs.
    fields : tuple of Field
        For c / r, and for the remainder.
    """

    tree: Quadtree
    x: ndarray
    chebyshev: Chebyshev
    upward: tuple[Translation, ...]
    downward: tuple[Translation, ...]
    near: Blocks
    inward: Blocks
    fields: tuple[Field, ...]

    @classmethod
    def build(
        cls,
        substrate: Substrate,
        partition: Partition,
        x: ndarray,
        weights: EdgeWeights | None,
        rtol: float,
    ) -> "FastSummation":
        """Of a relative error of about ``rtol``; see `InfluenceOperator`."""
        dtype = np.float32 if rtol >= SINGLE else np.float64
        radius = radii(partition.polygons)
        # beside a remainder no expansion meets cells that it takes for near
        layered = substrate.remainder is not None
        slack, reach = (ALONG_RIBS / 2, ALONG_RIBS * radius) if layered else (SLACK, radius)
        usual = np.quantile(radius, 0.9)  # few cells of a uniform mesh stay in larger boxes
        unit = max(np.sqrt(OCCUPANCY * np.median(partition.areas)), 2 * slack * usual)
        tree = Quadtree.build(partition.centroids, radius, x, LEAF, slack, unit)
        chebyshev = Chebyshev(order_for(rtol))
        cells = tree.cells
        near, inward, outward = near_lists(
            tree, partition.centroids[:, cells], reach[cells], chebyshev.terms
        )
        x = x[:, tree.points]
        direct = NearField.from_partition(substrate, partition, weights, cells, 10 * rtol)
        tolerance = 10 * rtol
        load, small, field = compressed(
            chebyshev.translations(substrate.surface.influence, 1.0, np.ones(len(OFFSETS), bool)),
            tolerance,
        )
        singular: Crossing = lambda half, needed: (load, small / half, field)  # noqa: E731
        laws: list[tuple[Multipoles, Kernel, Crossing]]
        laws = [
            (Multipoles.from_dipoles(partition, weights), substrate.surface.influence, singular)
        ]
        if (table := substrate.remainder) is not None:
            reached = np.hypot(*np.ptp(np.hstack([partition.polygons.p, x]), axis=1))
            table.evaluate(table.omega, reached)  # refuses what is beyond the table
            rest = _remainder(table, substrate.surface.young)
            regular: Crossing = lambda half, needed: compressed(  # noqa: E731
                chebyshev.translations(rest, half, needed), tolerance
            )
            laws.append((Multipoles.from_weights(partition, weights), rest, regular))
        levels = range(len(tree.levels) - 1)
        tables = [tree.interactions(level) for level in levels]
        fields = tuple(_field(tree, chebyshev, *law, tables, x, outward, dtype) for law in laws)
        return cls(
            tree, x, chebyshev,
            tuple(_upward(tree, chebyshev, level) for level in levels[-2::-1]),
            tuple(_downward(tree, chebyshev, level) for level in levels[1:]),
            _direct_blocks(direct, x, tree.targets[:, near.boxes], near, dtype),
            _inward_blocks(tree, chebyshev, direct, inward, dtype), fields,
        )  # fmt: skip

    @property
    def nbytes(self) -> int:
        """Memory of what is kept."""
        blocks = [self.near, self.inward]
        blocks += [b for field in self.fields for b in (field.gather, field.outward)]
        steps = [*self.upward, *self.downward]
        steps += [t for field in self.fields for level in field.across for t in level]
        return sum(b.nbytes for b in blocks) + sum(t.tables.nbytes for t in steps)

    def apply(self, q: ndarray) -> ndarray:
        """Settlements at the points under mean pressures ``q`` of the cells."""
        tree = self.tree
        q = q[tree.cells].astype(float)
        out = np.zeros(self.x.shape[1])
        local = np.zeros((len(tree), self.chebyshev.terms))
        with Threads() as run:
            for field in self.fields:
                moments = np.zeros_like(local)
                field.gather.add_product(q, moments.ravel(), run)
                for translation in self.upward:
                    translation.add(moments, moments, run)
                for enter, cross, leave in field.across:
                    narrow = np.zeros((len(enter.tables), enter.matrices.shape[2]))
                    enter.add(moments, narrow, run)
                    wide = np.zeros((len(enter.tables), leave.matrices.shape[1]))
                    cross.add(narrow, wide, run)
                    leave.add(wide, local, run)
                field.outward.add_product(moments.ravel(), out, run)
            self.inward.add_product(q, local.ravel(), run)
            for translation in self.downward:
                translation.add(local, local, run)
            leaves, order = tree.leaves, self.chebyshev.order
            args = leaves, tree.targets, tree.middle, tree.half, self.x, order, local, out
            run(lambda k: evaluate(k.start, k.stop, *args), len(leaves))
            self.near.add_product(q, out, run)
        settled = np.empty_like(out)
        settled[tree.points] = out
        return settled


def _remainder(table: RadialTable, young: float) -> Kernel:
    """The influence function beyond c / r."""

    def kernel(r: ndarray) -> ndarray:
        # corners of boxes may lie beyond the plan
        flat = np.minimum(r, table.farthest).ravel()
        out = np.empty_like(flat)
        look_up(table.omega / young, table.start, table.width, flat, out)
        return out.reshape(r.shape)

    return kernel


def _upward(tree: Quadtree, chebyshev: Chebyshev, level: int) -> Translation:
    """From the children of the boxes of a level."""
    begin, end = tree.levels[level : level + 2]
    tables = np.full((end - begin, 4), -1, np.int32)
    children = np.arange(end, tree.levels[level + 2])
    tables[tree.parent[children] - begin, tree.quarter[children]] = children
    matrices = [chebyshev.shift(quarter, PADDING).T for quarter in range(4)]
    return Translation(int(begin), tables, np.array(matrices))


def _downward(tree: Quadtree, chebyshev: Chebyshev, level: int) -> Translation:
    """From the parents of the boxes of a level."""
    boxes = np.arange(tree.levels[level], tree.levels[level + 1])
    tables = np.where(
        tree.quarter[boxes, None] == np.arange(4), tree.parent[boxes, None], -1
    ).astype(np.int32)
    matrices = [chebyshev.shift(quarter, 1.0) for quarter in range(4)]
    return Translation(int(boxes[0]), tables, np.array(matrices))


def _field(tree, chebyshev, loads, kernel, crossing, tables, x, outward, dtype) -> Field:
    across = []
    for level, table in enumerate(tables):
        needed = (table >= 0).any(axis=0)
        if not needed.any():
            continue
        load, matrices, field = crossing(tree.size / 2 ** (level + 1), needed)
        begin, end = tree.levels[level : level + 2]
        boxes = np.arange(begin, end)[:, None]
        relative = np.where(table >= 0, table - begin, -1)
        across.append(
            (
                Translation(0, boxes, load[None]),
                Translation(0, relative, matrices),
                Translation(int(begin), boxes - begin, field[None]),
            )
        )
    return Field(
        _gather_blocks(tree, chebyshev, loads, dtype),
        tuple(across),
        _outward_blocks(tree, chebyshev, kernel, x, outward, dtype),
    )


def _gather_blocks(tree: Quadtree, chebyshev: Chebyshev, loads: Multipoles, dtype: type) -> Blocks:
    """From cells to the moments of their boxes."""
    boxes = np.nonzero(tree.own > tree.sources[0])[0]
    own = np.stack([tree.sources[0, boxes], tree.own[boxes]])
    order = np.argsort(own[0])
    boxes, own = boxes[order], own[:, order]
    starts = np.append(own[0], own[1, -1])
    terms = chebyshev.terms
    rows = np.stack([boxes, boxes + 1]) * terms
    blocks = Blocks(rows, starts, np.arange(starts[-1]), np.empty(0))
    offsets = blocks.offsets
    values = np.empty(offsets[-1], dtype)
    args = inputs(
        own, tree.middle[:, boxes], PADDING * tree.half[boxes], loads.centres[:, tree.cells],
        loads.moments[:, :, tree.cells], *chebyshev.degrees,
    )  # fmt: skip

    def work(k: slice) -> None:
        part = np.empty(offsets[k.stop] - offsets[k.start])
        gather_loads(k.start, k.stop, *args, offsets - offsets[k.start], part)
        values[offsets[k.start] : offsets[k.stop]] = part

    with Threads() as run:
        run(work, len(boxes))
    return Blocks(rows, starts, blocks.columns, values)


def compressed(matrices: ndarray, tolerance: float) -> tuple[ndarray, ndarray, ndarray]:
    """Matrices as ``load @ small @ field`` with orthonormal outer factors, common to all.

    Singular values of all together below ``tolerance`` times the largest are left out.
    """
    bases = []
    for gram in (
        np.einsum("kij,klj->il", matrices, matrices),
        np.einsum("kji,kjl->il", matrices, matrices),
    ):
        squares, vectors = np.linalg.eigh(gram)
        bases.append(vectors[:, squares > (tolerance**2) * squares[-1]])
    load, field = bases
    small = np.einsum("krj,js->krs", np.einsum("ir,kij->krj", load, matrices), field)
    return load, small, np.ascontiguousarray(field.T)


def _direct_blocks(
    direct: NearField, x: ndarray, rows: ndarray, lists: Lists, dtype: type
) -> Blocks:
    """From cells to points, exactly."""
    blocks = Blocks(rows, lists.starts, lists.items, np.empty(0))
    offsets = blocks.offsets
    values = np.empty(offsets[-1], dtype)

    def work(k: slice) -> None:
        starts = lists.starts[k.start : k.stop + 1]
        part = np.empty(offsets[k.stop] - offsets[k.start])
        direct.fill(x, rows[:, k], (starts, lists.items), part)
        values[offsets[k.start] : offsets[k.stop]] = part

    with Threads() as run:
        run(work, rows.shape[1])
    return Blocks(rows, lists.starts, lists.items, values)


def _inward_blocks(
    tree: Quadtree, chebyshev: Chebyshev, direct: NearField, inward: Lists, dtype: type
) -> Blocks:
    """From cells to local expansions."""
    points, terms = chebyshev.grid.shape[1], chebyshev.terms
    middle, half = tree.middle[:, inward.boxes], tree.half[inward.boxes]
    x = middle[:, :, None] + half[:, None] * chebyshev.grid[:, None]
    first = np.arange(len(inward.boxes))
    rows = np.stack([first * points, (first + 1) * points])
    blocks = _direct_blocks(direct, x.reshape(2, -1), rows, inward, np.float64)
    offsets = blocks.offsets
    parts = [
        (chebyshev.coefficients.T @ blocks.values[begin:end].reshape(points, -1)).ravel()
        for begin, end in pairwise(offsets)
    ]
    rows = np.stack([inward.boxes, inward.boxes + 1]) * terms
    values = np.concatenate([*parts, np.empty(0)])
    return Blocks(rows, inward.starts, inward.items, values.astype(dtype))


def _outward_blocks(
    tree: Quadtree, chebyshev: Chebyshev, kernel: Kernel, x: ndarray, outward: Lists, dtype: type
) -> Blocks:
    """From moments of boxes to single points of larger boxes."""
    terms = chebyshev.terms
    rows = tree.targets[:, outward.boxes]
    columns = (outward.items[:, None] * terms + np.arange(terms)).ravel()
    blocks = Blocks(rows, outward.starts * terms, columns, np.empty(0))
    offsets = blocks.offsets
    values = np.empty(offsets[-1], dtype)
    # every box and every point of the leaf, many at a time
    heights = rows[1] - rows[0]
    pairs = np.repeat(np.arange(len(heights)), outward.counts * heights)
    within = np.arange(len(pairs)) - np.repeat(offsets[:-1] // terms, outward.counts * heights)
    point, box = np.divmod(within, outward.counts[pairs])
    point, box = rows[0, pairs] + point, outward.items[outward.starts[pairs] + box]
    table = values.reshape(-1, terms)

    def work(some: slice) -> None:
        b = box[some]
        offset = (x[:, point[some]] - tree.middle[:, b]) / tree.half[b]
        table[some] = chebyshev.outgoing(kernel, tree.half[b], offset)

    with Threads() as run:
        run(work, len(pairs))
    return Blocks(rows, outward.starts * terms, columns, values)
