"""Adaptive quadtree over loaded cells and field points.

As in Carrier, Greengard and Rokhlin, SIAM J. Sci. Stat. Comput. 9 (1988) 669, but a cell belongs
to the smallest box it does not exceed much: large cells stay in boxes higher up and do not keep
the small ones around them from being divided further.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ...kernels.compiled import compiled, inputs
from ...kernels.once import computed_once

#: no box is divided more often than this
DEEPEST = 40
#: offsets from a box to the boxes of its level that are not adjacent to it, but whose parents are
#: adjacent to its own
OFFSETS = np.array(
    [(i, j) for i in range(-3, 4) for j in range(-3, 4) if max(abs(i), abs(j)) > 1], dtype=np.int32
)
#: those from a box to others of its level that touch it
BESIDE = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j], dtype=np.int32)


class Boxes(NamedTuple):
    """What compiled loops read of a `Quadtree`; the fields are its attributes."""

    level: ndarray
    parent: ndarray
    first: ndarray
    nchildren: ndarray
    place: ndarray
    sources: ndarray
    own: ndarray
    targets: ndarray
    adjacent: ndarray
    middle: ndarray
    half: ndarray


@dataclass(frozen=True, eq=False)
class Quadtree:
    """Boxes level by level, from the root on.

    Attributes
    ----------
    corner : (2,) array of float
        Lower left corner of the root.
    size : float
        Side of the root.
    level, parent, first, nchildren : (nboxes,) array of int
        The children of box ``b`` are ``first[b]`` to ``first[b] + nchildren[b]``.
    place : (2, nboxes) array of int
        Column and row of each box among those of its level.
    sources, own, targets : (nboxes + ...) arrays of int
        Box ``b`` and its descendants hold cells ``sources[0, b]`` to ``sources[1, b]`` in the
        order of the tree, the first of them, up to ``own[b]``, in no child; and field points
        ``targets[0, b]`` to ``targets[1, b]``.
    cells, points : (n,), (m,) arrays of int
        Numbers of the cells and of the field points in the order of the tree.
    levels : (nlevels + 1,) array of int
        Boxes of level ``k`` are ``levels[k]`` to ``levels[k + 1]``.
    adjacent : (nboxes, 9) array of int
        Boxes of the same level that touch a box, itself among them; -1 where there is none:
        its colleagues.
    """

    corner: ndarray
    size: float
    level: ndarray
    parent: ndarray
    first: ndarray
    nchildren: ndarray
    place: ndarray
    sources: ndarray
    own: ndarray
    targets: ndarray
    cells: ndarray
    points: ndarray
    levels: ndarray
    adjacent: ndarray

    @classmethod
    def from_circles(
        cls, centres: ndarray, radii: ndarray, x: ndarray, leaf: int, slack: float, unit: float
    ) -> "Quadtree":
        """Divide boxes until none holds more than ``leaf`` cells or points.

        Parameters
        ----------
        centres, radii : (2, n), (n,) array of float
            Circles around the cells.
        x : (2, m) array of float
            Field points.
        leaf : int
            Most cells that could descend, or points, of a box that is not divided.
        slack : float
            A cell stays in boxes with sides of at least ``2 slack`` times its radius.
        unit : float
            Sides of the boxes are this times powers of two: the size of box that suits the
            cells best.
        """
        low = np.minimum(centres.min(axis=1), x.min(axis=1))
        high = np.maximum(centres.max(axis=1), x.max(axis=1))
        span = max(float((high - low).max()), unit) * (1 + 1e-12)
        size = unit * 2.0 ** np.ceil(np.log2(span / unit))
        corner = (low + high) / 2 - size / 2
        with np.errstate(divide="ignore"):
            depth = np.floor(np.log2(size / (2 * slack * radii))).clip(0, DEEPEST).astype(np.int32)
        cells, points = (np.arange(a.shape[1], dtype=np.int32) for a in (centres, x))
        rows = _divide(*inputs(centres, depth, x, corner), size, leaf, cells, points)
        level, parent, first, nchildren, column, row, s0, s1, own, t0, t1 = rows.T.copy()
        place = np.stack([column, row])
        levels = np.searchsorted(level, np.arange(level[-1] + 2))
        adjacent = _adjacent(level, parent, first, nchildren, place)
        return cls(
            corner, size, level, parent, first, nchildren, place, np.stack([s0, s1]), own,
            np.stack([t0, t1]), cells, points, levels, adjacent,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.level)

    @computed_once
    def half(self) -> ndarray:
        """Half of the side of each box."""
        return self.size / 2.0 ** (self.level + 1)

    @computed_once
    def middle(self) -> ndarray:
        """Centre of each box, shape (2, nboxes)."""
        return self.corner[:, None] + (2 * self.place + 1) * self.half

    @property
    def quarter(self) -> ndarray:
        """Which quarter of its parent each box is, to the right 1, above 2."""
        return self.place[0] % 2 + 2 * (self.place[1] % 2)

    @computed_once
    def leaves(self) -> ndarray:
        """Boxes without children that hold field points."""
        return np.nonzero((self.nchildren == 0) & (self.targets[1] > self.targets[0]))[0]

    @computed_once
    def boxes(self) -> Boxes:
        """The boxes as compiled loops take them."""
        return Boxes(*inputs(*(getattr(self, name) for name in Boxes._fields)))

    def at(self, x: ndarray) -> "Quadtree | None":
        """The same boxes and cells with other field points; None if some are outside of all."""
        if (np.abs(x - self.middle[:, :1]) > self.half[0]).any():
            return None
        targets = np.empty((2, len(self)), np.int64)
        points = np.empty(x.shape[1], np.int32)
        _place(*inputs(x), self.boxes, targets, points)
        return replace(self, targets=targets, points=points)

    def families(self, level: int) -> ndarray:
        """The V lists of a level, by families of four boxes of one parent, one after the other:
        those whose parents are at each of `BESIDE`; -1 where there is none.

        Only from families with field points to those with cells; shape (nboxes // 4, len(BESIDE)).
        Boxes of both that are adjacent do not act on each other through expansions.
        """
        begin, end = self.levels[level : level + 2]
        parents = self.parent[begin:end:4] if level else np.empty(0, int)
        beside = self.adjacent[parents]
        far = (self.targets[0] < self.targets[1])[parents, None] & (beside >= 0)
        far &= ((self.sources[0] < self.sources[1]) & (self.first >= 0))[beside]
        row, beside = np.nonzero(far)[0], beside[far]
        x, y = self.place[:, beside] - self.place[:, parents[row]] + 1
        found = np.full((len(parents), 9), -1, np.int32)
        found[row, 3 * x + y] = (self.first[beside] - begin) // 4
        return np.delete(found, 4, axis=1)  # its own


@compiled
def _sort(keys, items, start, stop, nkeys, scratch):
    """Sort ``items[start:stop]`` by small keys, keeping the order of equals; the ends of each."""
    ends = np.zeros(nkeys, np.int64)
    for k in range(start, stop):
        ends[keys[items[k]]] += 1
    begin = start
    for key in range(nkeys):
        count = ends[key]
        ends[key] = begin
        begin += count
    for k in range(start, stop):
        key = keys[items[k]]
        scratch[ends[key]] = items[k]
        ends[key] += 1
    for k in range(start, stop):
        items[k] = scratch[k]
    return ends


@compiled
def _divide(centres, depth, x, corner, size, leaf, cells, points):
    """Rows of level, parent, first child, children, column, row and ranges for each box."""
    deepest = depth.max()
    boxes = np.empty((1024, 11), np.int64)
    boxes[0] = 0
    boxes[0, 1] = boxes[0, 2] = -1
    boxes[0, 7], boxes[0, 10] = cells.shape[0], points.shape[0]
    nboxes, b = 1, 0
    cell_key, point_key = np.empty(cells.shape[0], np.int8), np.empty(points.shape[0], np.int8)
    scratch = np.empty(max(cells.shape[0], points.shape[0]), np.int64)
    while b < nboxes:
        level, column, row = boxes[b, 0], boxes[b, 4], boxes[b, 5]
        s0, s1, t0, t1 = boxes[b, 6], boxes[b, 7], boxes[b, 9], boxes[b, 10]
        half = size / 2.0 ** (level + 1)
        mx, my = corner[0] + (2 * column + 1) * half, corner[1] + (2 * row + 1) * half
        descend = 0
        for k in range(s0, s1):
            j = cells[k]
            key = 0
            if depth[j] > level:
                key = 1 + (centres[0, j] > mx) + 2 * (centres[1, j] > my)
                descend += 1
            cell_key[j] = key
        if level == deepest or max(descend, t1 - t0) <= leaf:
            boxes[b, 8] = s1
            b += 1
            continue
        for k in range(t0, t1):
            i = points[k]
            point_key[i] = (x[0, i] > mx) + 2 * (x[1, i] > my)
        s_ends = _sort(cell_key, cells, s0, s1, 5, scratch)
        t_ends = _sort(point_key, points, t0, t1, 4, scratch)
        boxes[b, 8] = s_ends[0]
        if nboxes + 4 > boxes.shape[0]:
            larger = np.empty((2 * boxes.shape[0], 11), np.int64)
            for k in range(nboxes):
                for i in range(11):
                    larger[k, i] = boxes[k, i]
            boxes = larger
        boxes[b, 2] = nboxes
        for quarter in range(4):  # empty ones too: other points may be there
            box = boxes[nboxes]
            box[0], box[1], box[2], box[3], box[8] = level + 1, b, -1, 0, 0
            box[4], box[5] = 2 * column + quarter % 2, 2 * row + quarter // 2
            box[6], box[7] = s_ends[quarter], s_ends[quarter + 1]
            box[9], box[10] = t0 if quarter == 0 else t_ends[quarter - 1], t_ends[quarter]
            nboxes += 1
        boxes[b, 3] = 4
        b += 1
    return boxes[:nboxes]


@compiled
def _place(x, boxes, targets, points):
    """Ranges of points in all boxes, and their numbers in that order."""
    first, middle, parent = boxes.first, boxes.middle, boxes.parent
    leaf = np.empty(x.shape[1], np.int32)
    begin, end = targets
    end[:] = 0
    for i in range(x.shape[1]):
        b = 0
        while first[b] >= 0:
            b = first[b] + (x[0, i] > middle[0, b]) + 2 * (x[1, i] > middle[1, b])
        leaf[i] = b
        end[b] += 1
    for b in range(parent.shape[0] - 1, 0, -1):
        end[parent[b]] += end[b]
    begin[0] = 0
    for b in range(parent.shape[0]):
        at = begin[b]
        if first[b] >= 0:
            for child in range(first[b], first[b] + 4):
                begin[child] = at
                at += end[child]
        end[b] += begin[b]
    place = begin.copy()
    for i in range(x.shape[1]):
        points[place[leaf[i]]] = i
        place[leaf[i]] += 1


@compiled
def _adjacent(level, parent, first, nchildren, place):
    adjacent = np.full((level.shape[0], 9), -1, np.int32)
    adjacent[0, 0] = 0
    for b in range(1, level.shape[0]):
        count = 0
        for other in adjacent[parent[b]]:
            if other < 0:
                break
            for child in range(first[other], first[other] + nchildren[other]):
                dx, dy = place[0, child] - place[0, b], place[1, child] - place[1, b]
                if max(abs(dx), abs(dy)) <= 1:
                    adjacent[b, count] = child
                    count += 1
    return adjacent
