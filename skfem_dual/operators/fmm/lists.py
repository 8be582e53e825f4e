"""Which cells act on which points of a quadtree directly, and which through one expansion only.

The lists of Carrier, Greengard and Rokhlin, SIAM J. Sci. Stat. Comput. 9 (1988) 669, but for
cells in boxes of any level:

========  ==========================================================================  ============
their     here                                                                        acts by
========  ==========================================================================  ============
V list    `Quadtree.families`: boxes of one level that are not adjacent, but whose    M2L
          parents are
U list    ``p2p`` of `near_lists`: cells beside a leaf                                P2P
X list    ``p2l``: cells beside a box, a side of it away or more, if it has more      P2L
          points than an expansion has terms
W list    ``m2p``: smaller boxes beside a leaf that do not touch it, if they have     M2P
          more cells than an expansion has terms
========  ==========================================================================  ============
"""

from dataclasses import dataclass
from typing import NamedTuple

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

    def filled(self) -> "Lists":
        """Without the boxes whose list is empty."""
        some = self.counts > 0
        return Lists(
            self.boxes[some], np.append(self.starts[:-1][some], self.starts[-1]), self.items
        )


class NearLists(NamedTuple):
    """What acts without a pair of expansions.

    Attributes
    ----------
    p2p : Lists
        Of every leaf with points: cells that act on them directly.
    p2l : Lists
        Of boxes with many points: cells that act on the local expansion.
    m2p : Lists
        Of leaves with points: smaller boxes whose multipole expansion acts on the points.
    """

    p2p: Lists
    p2l: Lists
    m2p: Lists


class Circles(NamedTuple):
    """Circles around the cells: ``centres`` of shape (2, n), ``radii`` of shape (n,)."""

    centres: ndarray
    radii: ndarray


class Room(NamedTuple):
    """Where a loop writes the list of each box, in two rounds.

    Attributes
    ----------
    places : array of int
        In the first round it takes the length of each list, in the second it tells the start.
    items : array of int
        In the second round it takes the items.
    """

    places: ndarray
    items: ndarray


def near_lists(tree: Quadtree, centres: ndarray, radii: ndarray, terms: int) -> NearLists:
    """Lists of what acts without a pair of expansions.

    Parameters
    ----------
    tree : Quadtree
    centres, radii : (2, n), (n,) array of float
        Circles around the cells, in the order of the tree.
    terms : int
        Terms of an expansion.
    """
    boxes, circles = tree.boxes, Circles(*inputs(centres, radii))
    leaves = tree.leaves
    crowded = np.nonzero(tree.targets[1] - tree.targets[0] > terms)[0]
    p2p, p2l, m2p = (_empty(len(some)) for some in (leaves, crowded, leaves))
    _lists_of_leaves(leaves, boxes, circles, terms, p2p, m2p, False)
    p2p, m2p = _sized(p2p), _sized(m2p)
    _lists_of_leaves(leaves, boxes, circles, terms, p2p, m2p, True)
    _p2l_lists(crowded, boxes, circles, p2l, False)
    p2l = _sized(p2l)
    _p2l_lists(crowded, boxes, circles, p2l, True)
    return NearLists(
        Lists(leaves, *p2p), Lists(crowded, *p2l).filled(), Lists(leaves, *m2p).filled()
    )


def _empty(n: int) -> Room:
    return Room(np.empty(n, np.int64), np.empty(0, np.int32))


def _sized(counted: Room) -> Room:
    """Room for lists that are counted."""
    starts = np.concatenate([[0], np.cumsum(counted.places)])
    return Room(starts, np.empty(starts[-1], np.int32))


@compiled
def _apart(box, cell, boxes, circles):
    """Whether the field of a cell is smooth in a box: the gap is a side of the box or more."""
    dx = abs(circles.centres[0, cell] - boxes.middle[0, box])
    dy = abs(circles.centres[1, cell] - boxes.middle[1, box])
    return max(dx, dy) - circles.radii[cell] >= 3 * boxes.half[box]


@compiled
def _touching(leaf, other, boxes):
    """Whether a box of the leaf's level or a smaller one touches the leaf."""
    shift = boxes.level[other] - boxes.level[leaf]
    for axis in range(2):
        begin = boxes.place[axis, leaf] << shift
        end = (boxes.place[axis, leaf] + 1) << shift
        if not begin - 1 <= boxes.place[axis, other] <= end:
            return False
    return True


@compiled
def _beside(leaf, at, boxes, circles, terms, p2p, fill):
    """Cells of boxes adjacent to the leaf and to those around it, for its P2P list from ``at``.

    Not those that act on the local expansion of the smallest box in between that has one worth it.
    """
    box, expanding = leaf, -1
    while box >= 0:
        for other in boxes.adjacent[box]:
            if other < 0:
                break
            for cell in range(boxes.sources[0, other], boxes.own[other]):
                if expanding >= 0 and _apart(expanding, cell, boxes, circles):
                    continue
                if fill:
                    p2p.items[at] = cell
                at += 1
        if expanding < 0 and boxes.targets[1, box] - boxes.targets[0, box] > terms:
            expanding = box
        box = boxes.parent[box]
    return at


@compiled
def _lists_of_leaves(leaves, boxes, circles, terms, p2p, m2p, fill):
    first, nchildren, sources = boxes.first, boxes.nchildren, boxes.sources
    stack = np.empty(256, np.int64)
    for k in range(leaves.shape[0]):
        leaf = leaves[k]
        cells = _beside(leaf, p2p.places[k] if fill else 0, boxes, circles, terms, p2p, fill)
        smaller = m2p.places[k] if fill else 0
        for colleague in boxes.adjacent[leaf]:
            if colleague < 0:
                break
            size = 0
            for child in range(first[colleague], first[colleague] + nchildren[colleague]):
                stack[size] = child
                size += 1
            while size > 0:
                size -= 1
                other = stack[size]
                stop = boxes.own[other]
                if _touching(leaf, other, boxes):
                    for child in range(first[other], first[other] + nchildren[other]):
                        stack[size] = child
                        size += 1
                elif sources[1, other] - sources[0, other] > terms:
                    if fill:
                        m2p.items[smaller] = other
                    smaller += 1
                    continue
                else:
                    stop = sources[1, other]
                for cell in range(sources[0, other], stop):
                    if fill:
                        p2p.items[cells] = cell
                    cells += 1
        if not fill:
            p2p.places[k] = cells
            m2p.places[k] = smaller


@compiled
def _p2l_lists(crowded, boxes, circles, p2l, fill):
    for k in range(crowded.shape[0]):
        cells = p2l.places[k] if fill else 0
        above = boxes.parent[crowded[k]]
        box = above
        while box >= 0:
            for other in boxes.adjacent[box]:
                if other < 0:
                    break
                for cell in range(boxes.sources[0, other], boxes.own[other]):
                    if not _apart(crowded[k], cell, boxes, circles):
                        continue
                    # a larger box between has taken it already
                    if box != above and _apart(above, cell, boxes, circles):
                        continue
                    if fill:
                        p2l.items[cells] = cell
                    cells += 1
            box = boxes.parent[box]
        if not fill:
            p2l.places[k] = cells
