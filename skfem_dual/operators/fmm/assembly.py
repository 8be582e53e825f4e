"""The matrices of the fast summation that depend on cells and points, and its translations."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy import ndarray

from ...elements.near import NearField
from ...kernels.threads import Threads
from .chebyshev import Chebyshev, Compressed, Kernel
from .families import FamilyTranslation
from .linear_maps import SparseBlocks, Translation
from .lists import Lists
from .loops import Layout
from .quadtree import Quadtree

#: from half-width to the matrices of M2L
MultipoleToLocal = Callable[[float], Compressed]


def m2m_translation(tree: Quadtree, chebyshev: Chebyshev, level: int) -> Translation:
    """From the children of the boxes of a level."""
    begin, end = tree.levels[level : level + 2]
    sources = np.full((end - begin, 4), -1, np.int32)
    children = np.arange(end, tree.levels[level + 2])
    sources[tree.parent[children] - begin, tree.quarter[children]] = children
    matrices = [chebyshev.m2m(quarter) for quarter in range(4)]
    return Translation(int(begin), sources, np.array(matrices))


def m2l_translations(
    tree: Quadtree, families: list[ndarray], factors: MultipoleToLocal
) -> tuple[FamilyTranslation, ...]:
    """Between the boxes of each level, by its `Quadtree.families`."""
    return tuple(
        FamilyTranslation.of(int(first), beside, factors(tree.size / 2 ** (level + 1)))
        for level, (first, beside) in enumerate(zip(tree.levels, families))
        if (beside >= 0).any()
    )


def l2l_translation(tree: Quadtree, chebyshev: Chebyshev, level: int) -> Translation:
    """From the parents of the boxes of a level."""
    boxes = np.arange(tree.levels[level], tree.levels[level + 1])
    sources = np.where(tree.quarter[boxes, None] == np.arange(4), tree.parent[boxes, None], -1)
    matrices = [chebyshev.l2l(quarter) for quarter in range(4)]
    return Translation(int(boxes[0]), sources, np.array(matrices))


def p2p_blocks(
    near: NearField, x: ndarray, rows: ndarray, lists: Lists, place: ndarray, dtype: type
) -> SparseBlocks:
    """From cells to points, exactly; ``rows`` are the points of each list, and ``place`` where
    each cell is among those of ``near``."""
    layout, starts = Layout.from_lists(rows, lists.starts, lists.items), lists.starts
    offsets = layout.offsets
    values = np.empty(offsets[-1], dtype)

    def work(k: slice) -> None:
        own, first = place[lists.items[starts[k.start] : starts[k.stop]]], starts[k.start]
        part = np.empty(offsets[k.stop] - offsets[k.start])
        near.fill(x, rows[:, k], (starts[k.start : k.stop + 1] - first, own), part)
        values[offsets[k.start] : offsets[k.stop]] = part

    with Threads() as run:
        run(work, len(offsets) - 1)
    return SparseBlocks(layout, values)


def p2l_blocks(
    tree: Quadtree,
    chebyshev: Chebyshev,
    near: NearField,
    lists: Lists,
    place: ndarray,
    dtype: type,
) -> SparseBlocks:
    """From cells to local expansions, by the exact settlements of the points of interpolation."""
    points, terms = chebyshev.grid.shape[1], chebyshev.terms
    middle, half = tree.middle[:, lists.boxes], tree.half[lists.boxes]
    x = middle[:, :, None] + half[:, None] * chebyshev.grid[:, None]
    first = np.arange(len(lists.boxes))
    rows = np.stack([first * points, (first + 1) * points])
    settled = p2p_blocks(near, x.reshape(2, -1), rows, lists, place, np.float64)
    parts = [
        (chebyshev.coefficients.T @ settled.values[begin:end].reshape(points, -1)).ravel()
        for begin, end in pairwise(settled.layout.offsets)
    ]
    rows = np.stack([lists.boxes, lists.boxes + 1]) * terms
    values = np.concatenate([*parts, np.empty(0)])
    return SparseBlocks(Layout.from_lists(rows, lists.starts, lists.items), values.astype(dtype))


def m2p_blocks(
    tree: Quadtree, chebyshev: Chebyshev, kernel: Kernel, x: ndarray, lists: Lists, dtype: type
) -> SparseBlocks:
    """From multipole expansions of boxes to single points of larger boxes."""
    terms = chebyshev.terms
    rows = tree.targets[:, lists.boxes]
    columns = (lists.items[:, None] * terms + np.arange(terms)).ravel()
    layout = Layout.from_lists(rows, lists.starts * terms, columns)
    values = np.empty(layout.offsets[-1], dtype)
    # every box and every point of the leaf, many at a time
    heights = rows[1] - rows[0]
    pairs = np.repeat(np.arange(len(heights)), lists.counts * heights)
    begin = np.repeat(layout.offsets[:-1] // terms, lists.counts * heights)
    point, box = np.divmod(np.arange(len(pairs)) - begin, lists.counts[pairs])
    point, box = rows[0, pairs] + point, lists.items[lists.starts[pairs] + box]
    of_pairs = values.reshape(-1, terms)

    def work(some: slice) -> None:
        b = box[some]
        offset = (x[:, point[some]] - tree.middle[:, b]) / tree.half[b]
        of_pairs[some] = chebyshev.m2p(kernel, tree.half[b], offset)

    with Threads() as run:
        run(work, len(pairs))
    return SparseBlocks(layout, values)


def first_rows(blocks: SparseBlocks, terms: int, few: int) -> SparseBlocks:
    """To the first few of the ``terms`` of each local expansion, of `p2l_blocks`."""
    rows, starts, columns, offsets = blocks.layout
    inside = np.arange(offsets[-1]) - np.repeat(offsets[:-1], np.diff(offsets))
    kept = inside < np.repeat(few * np.diff(starts), np.diff(offsets))
    layout = Layout.from_lists(rows // terms * few, starts, columns)
    return SparseBlocks(layout, blocks.values[kept])


def first_columns(blocks: SparseBlocks, terms: int, few: int) -> SparseBlocks:
    """From the first few of the ``terms`` of each multipole expansion, of `m2p_blocks`."""
    rows, starts, columns, _ = blocks.layout
    columns = columns.reshape(-1, terms)[:, :few] // terms * few + np.arange(few)
    layout = Layout.from_lists(rows, starts // terms * few, columns.ravel())
    return SparseBlocks(layout, blocks.values.reshape(-1, terms)[:, :few].ravel())
