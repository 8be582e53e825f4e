"""Which cells act on which points of a quadtree directly, and which through boxes.

Boxes of one level that are not adjacent act on each other through their expansions. What remains
is near: a cell acts on every point of a box directly, unless the box has more points than an
expansion has terms and lies far enough from the cell; and a box acts by its expansion on single
points of larger boxes beside it, if it has more cells than that.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ...kernels.compiled import compiled, inputs
from .quadtree import Quadtree


@dataclass(frozen=True, eq=False)
class Lists:
    """Ragged lists of boxes: that of ``boxes[k]`` is ``items[starts[k]:starts[k + 1]]``."""

    boxes: ndarray
    starts: ndarray
    items: ndarray

    @property
    def counts(self) -> ndarray:
        """Length of each list."""
        return np.diff(self.starts)


def near_lists(
    tree: Quadtree, centres: ndarray, radii: ndarray, terms: int
) -> tuple[Lists, Lists, Lists]:
    """Lists of what acts without a pair of expansions.

    Parameters
    ----------
    tree : Quadtree
    centres, radii : (2, n), (n,) array of float
        Circles around the cells, in the order of the tree.
    terms : int
        Terms of an expansion.

    Returns
    -------
    near : Lists
        Of every leaf with points: cells that act on them directly.
    inward : Lists
        Of boxes with many points: cells that act on the local expansion.
    outward : Lists
        Of leaves with points: smaller boxes whose outgoing expansion acts on the points.
    """
    boxes = (
        *inputs(
            tree.parent, tree.first, tree.nchildren, tree.level, tree.place, tree.sources,
            tree.own, tree.targets, tree.adjacent, tree.middle, tree.half, centres, radii,
        ), terms,
    )  # fmt: skip
    leaves = tree.leaves
    many = np.nonzero(tree.targets[1] - tree.targets[0] > terms)[0]
    nothing = np.empty(0, np.int32)

    def ragged(counts: ndarray) -> tuple[ndarray, ndarray]:
        starts = np.concatenate([[0], np.cumsum(counts)])
        return starts, np.empty(starts[-1], np.int32)

    near, outward = np.empty(len(leaves), np.int64), np.empty(len(leaves), np.int64)
    _near(leaves, *boxes, near, outward, nothing, nothing, False)
    near, near_items = ragged(near)
    outward, outward_items = ragged(outward)
    _near(leaves, *boxes, near, outward, near_items, outward_items, True)
    inward = np.empty(len(many), np.int64)
    _inward(many, *boxes, inward, nothing, False)
    inward, inward_items = ragged(inward)
    _inward(many, *boxes, inward, inward_items, True)

    def lists(boxes: ndarray, starts: ndarray, items: ndarray) -> Lists:
        some = np.diff(starts) > 0
        return Lists(boxes[some], np.append(starts[:-1][some], starts[-1]), items)

    return (
        Lists(leaves, near, near_items),
        lists(many, inward, inward_items),
        lists(leaves, outward, outward_items),
    )


@compiled
def _apart(box, cell, middle, half, centres, radii):
    """Whether the field of a cell is smooth in a box: the gap is a side of the box or more."""
    dx = abs(centres[0, cell] - middle[0, box])
    dy = abs(centres[1, cell] - middle[1, box])
    return max(dx, dy) - radii[cell] >= 3 * half[box]


@compiled
def _near(
    leaves, parent, first, nchildren, level, place, sources, own, targets, adjacent, middle, half,
    centres, radii, terms, near, outward, near_items, outward_items, fill,
):  # fmt: skip
    stack = np.empty(256, np.int64)
    for k in range(leaves.shape[0]):
        leaf = leaves[k]
        cells = near[k] if fill else 0
        boxes = outward[k] if fill else 0
        # cells of boxes adjacent to the leaf and to those around it, unless they act on the
        # local expansion of the smallest box in between that has one worth it
        box, expanding = leaf, -1
        while box >= 0:
            for other in adjacent[box]:
                if other < 0:
                    break
                for cell in range(sources[0, other], own[other]):
                    if expanding >= 0 and _apart(expanding, cell, middle, half, centres, radii):
                        continue
                    if fill:
                        near_items[cells] = cell
                    cells += 1
            if expanding < 0 and targets[1, box] - targets[0, box] > terms:
                expanding = box
            box = parent[box]
        # boxes smaller than the leaf
        for beside in adjacent[leaf]:
            if beside < 0:
                break
            size = 0
            for child in range(first[beside], first[beside] + nchildren[beside]):
                stack[size] = child
                size += 1
            while size > 0:
                size -= 1
                other = stack[size]
                shift = level[other] - level[leaf]
                touching = True
                for axis in range(2):
                    begin = place[axis, leaf] << shift
                    end = (place[axis, leaf] + 1) << shift
                    touching = touching and begin - 1 <= place[axis, other] <= end
                stop = own[other]
                if touching:
                    for child in range(first[other], first[other] + nchildren[other]):
                        stack[size] = child
                        size += 1
                elif sources[1, other] - sources[0, other] > terms:
                    if fill:
                        outward_items[boxes] = other
                    boxes += 1
                    continue
                else:
                    stop = sources[1, other]
                for cell in range(sources[0, other], stop):
                    if fill:
                        near_items[cells] = cell
                    cells += 1
        if not fill:
            near[k] = cells
            outward[k] = boxes


@compiled
def _inward(
    many, parent, first, nchildren, level, place, sources, own, targets, adjacent, middle, half,
    centres, radii, terms, inward, items, fill,
):  # fmt: skip
    for k in range(many.shape[0]):
        cells = inward[k] if fill else 0
        above = parent[many[k]]
        box = above
        while box >= 0:
            for other in adjacent[box]:
                if other < 0:
                    break
                for cell in range(sources[0, other], own[other]):
                    if not _apart(many[k], cell, middle, half, centres, radii):
                        continue
                    # a larger box between has taken it already
                    if box != above and _apart(above, cell, middle, half, centres, radii):
                        continue
                    if fill:
                        items[cells] = cell
                    cells += 1
            box = parent[box]
        if not fill:
            inward[k] = cells
