"""Pressures that vary inside cells as strips, each uniformly loaded, integrated by their ribs.

Each triangle of an edge-weighted cell is cut along levels of the distance to the edge, equidistant
in its root; the others' along levels of their pressure, which is linear.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..grids.planar import cross
from ..kernels.compiled import inputs
from .edge_weights import EdgeWeights, load_centroids
from .load_matrix import points_in_pieces

#: strips in a triangle that reaches from the edge on, in proportion fewer where the weight varies
#: less, and the fewest
STRIPS, FEWEST = 16, 3


#: corners of the four triangles that halving the sides of one makes
RED = [
    np.array(t) / 2
    for t in (
        [[2, 1, 1], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [1, 2, 1], [0, 0, 1]],
        [[1, 0, 0], [0, 1, 0], [1, 1, 2]],
        [[1, 0, 1], [1, 1, 0], [0, 1, 1]],
    )
]
#: least over greatest of the linear functions along whose levels unweighted cells are cut: in
#: their roots these are nearly equidistant
OFFSET = 0.4


#: strips of less than this part of their cell are left out
THIN = 1e-14


class CellLoads(NamedTuple):
    """Pressures of cells.

    Attributes
    ----------
    partition : Partition
        The n cells.
    pressure : (n,) array of float
        Their mean pressures.
    weights : EdgeWeights or None
        How the pressure varies inside them by the law of the edge; None if it does not.
    slopes : (2, n) array of float or None
        How it varies besides, see `Slopes`; None if it does not.
    """

    partition: Partition
    pressure: ndarray
    weights: EdgeWeights | None
    slopes: ndarray | None = None

    @property
    def acting(self) -> ndarray:
        """Where the mean pressures act, shape (2, n)."""
        return load_centroids(self.partition, self.weights)

    @property
    def slopes_or_zero(self) -> ndarray:
        """Slopes of all cells, zero if there are none; shape (2, n)."""
        return np.zeros((2, len(self.partition))) if self.slopes is None else self.slopes

    @property
    def weighted(self) -> ndarray:
        """Whether each cell is weighted, shape (n,)."""
        if self.weights is None:
            return np.zeros(len(self.partition), dtype=bool)
        return self.weights.weighted

    def moments(self, moments: ndarray, cells: ndarray | slice = slice(None)) -> ndarray:
        """Moments of the pressure of some cells, from those of their law of one degree more.

        ``moments`` are about `acting`, as of `load_moments`.
        """
        gx, gy = self.slopes_or_zero[:, cells]
        k = np.arange(1, len(moments))
        along = k[:, None, None] * moments[1:, :-1] * gx + k[:, None] * moments[:-1, 1:] * gy
        return self.pressure[cells] * moments[:-1, :-1] + along

    def inside(self, x: ndarray, cell: ndarray) -> ndarray:
        """``q + g . (x - y)`` at points (2, m), each in a cell."""
        return self.pressure[cell] + np.sum(
            self.slopes_or_zero[:, cell] * (x - self.acting[:, cell]), axis=0
        )


class Strips(NamedTuple):
    """Ribs of the strips of some cells, what they carry beyond the mean pressure.

    Attributes
    ----------
    begin, along : (2, k) array of float
        Where ribs begin and their directions, of unit length.
    length : (k,) array of float
    jump : (k,) array of float
        Pressure on the left beyond the mean pressure of the cell.
    starts : (ncells + 1,) array of int
        The first rib of each cell.
    """

    begin: ndarray
    along: ndarray
    length: ndarray
    jump: ndarray
    starts: ndarray

    @classmethod
    def from_loads(cls, loads: CellLoads, cells: ndarray) -> Self:
        """Of some cells, ascending."""
        weighted = loads.weighted[cells]
        parts = [_linear_strips(loads, cells[~weighted])]
        if loads.weights is not None:
            x, density, cell = weighted_strips(loads, loads.weights, cells[weighted])
            parts.append((x, density - loads.pressure[cell], cell))
        x, excess, cell = (np.concatenate(p, axis=-1) for p in zip(*parts, strict=True))
        area = area_of(x)
        keep = np.abs(area) > THIN * loads.partition.areas[cell]
        order = np.nonzero(keep)[0][np.argsort(cell[keep], kind="stable")]
        jump, along = np.sign(area) * excess, np.roll(x, -1, axis=1) - x
        x, along, jump, cell = x[..., order], along[..., order], jump[order], cell[order]
        length = np.hypot(*along)
        real = length.T > 0
        begin, along, length, jump = (
            np.moveaxis(a, -1, -2)[..., real] for a in (x, along, length, np.tile(jump, (4, 1)))
        )
        starts = np.searchsorted(
            np.repeat(cell, 4)[real.ravel()], np.append(cells, cells[-1:] + 1)
        )
        return cls(*inputs(begin, along / length, length, jump, starts))


def weighted_strips(
    loads: CellLoads, weights: EdgeWeights, cells: ndarray, strips: int = STRIPS
) -> tuple[ndarray, ndarray, ndarray]:
    """Of the strips of edge-weighted cells: corners (2, 4, k), in any turn, two of them equal at
    an apex; the load per area, and the cell."""
    fan = weights.fan
    own = np.nonzero(np.isin(fan.cell, cells))[0]
    # what varies along the edge takes smaller triangles
    halves = np.stack(RED if loads.slopes is not None else [np.eye(3)])
    part = np.repeat(np.arange(len(halves)), len(own))
    own = np.tile(own, len(halves))
    square = np.einsum("kvc,vk->ck", halves[part], weights.root[fan.t[:, own]] ** 2)
    triangle, corners = _cut(np.sqrt(square), strips)
    corners = np.einsum("kvw,wck->vck", halves[part[triangle]], corners)
    triangle = own[triangle]
    # a strip of four corners is two triangles; its load is what those carry
    pieces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]], axis=2)
    where = np.tile(triangle, 2), pieces
    points = points_in_pieces(weights, fan, where, 2)
    carried = points.weight * loads.inside(points.x, points.cell)
    load = np.bincount(points.piece, carried, 2 * len(triangle)).reshape(2, -1).sum(axis=0)
    x, cell = np.einsum("dvk,vck->dck", fan.p[:, fan.t[:, triangle]], corners), fan.cell[triangle]
    area = np.abs(area_of(x))
    wide = area > THIN * loads.partition.areas[cell]
    return x[..., wide], load[wide] / area[wide], cell[wide]


def _linear_strips(loads: CellLoads, cells: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """Of cells that are not weighted, from triangles around their centroids: corners, the load per
    area beyond the mean pressure of the cell, and the cell."""
    polygons, centres = loads.partition.polygons, loads.partition.centroids
    cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
    following = np.arange(1, len(cell) + 1)
    following[polygons.offsets[1:] - 1] = polygons.offsets[:-1]
    own = np.nonzero(np.isin(cell, cells))[0]
    cell = cell[own]
    a, b = polygons.p[:, polygons.indices[own]], polygons.p[:, polygons.indices[following[own]]]
    p = np.stack([centres[:, cell], a, b], axis=1)
    rise = np.einsum("dk,dvk->vk", loads.slopes_or_zero[:, cell], p - p[:, :1])
    most = np.maximum(np.abs(rise).max(axis=0), np.finfo(float).tiny)
    triangle, corners = _cut(np.sqrt(1 + (1 - OFFSET) / (1 + OFFSET) * rise / most), STRIPS)
    # triangles that turn the other way are taken off
    turn = np.sign(cross(a - p[:, 0], b - p[:, 0]))[triangle]
    x, cell = np.einsum("dvk,vck->dck", p[..., triangle], corners), cell[triangle]
    load = np.zeros(len(cell))
    for part in (x[:, [0, 1, 2]], x[:, [0, 2, 3]]):
        area = cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]) / 2
        load += area * loads.inside(part.mean(axis=1), cell)
    return x, turn * (_density(load, area_of(x)) - loads.pressure[cell]), cell


def area_of(x: ndarray) -> ndarray:
    """Signed areas of polygons with corners (2, c, k)."""
    arm = x[:, 1:] - x[:, :1]  # far from the origin products of coordinates have no digits left
    return cross(arm[:, :-1], arm[:, 1:]).sum(axis=0) / 2


def _density(load: ndarray, area: ndarray) -> ndarray:
    return np.divide(load, area, out=np.zeros(len(load)), where=area != 0)


def _cut(root: ndarray, strips: int) -> tuple[ndarray, ndarray]:
    """Triangles cut along levels, those of the roots of the distance at their corners (3, m), into
    so many strips where they reach from the edge on.

    Returns
    -------
    triangle : (n,) array of int
        Number of each strip's triangle.
    corners : (3, 4, n) array of float
        Barycentric coordinates of its corners, in turn; two are equal at the apex.
    """
    rank = np.argsort(root, axis=0)
    low, between, high = np.eye(3)[:, rank].swapaxes(0, 1)
    r = np.take_along_axis(root, rank, axis=0)
    rise = r[2] ** 2 - r[0] ** 2
    share = np.divide(r[1] ** 2 - r[0] ** 2, rise, out=np.zeros_like(rise), where=rise > 0)
    opposite = low + share * (high - low)
    count = np.ceil(strips * np.abs(r[1:] - r[:-1]) / r[2]).astype(int).clip(FEWEST)
    triangle, corners = [], []
    for apex, at_apex, many in ((low, r[0], count[0]), (high, r[2], count[1])):
        own = np.repeat(np.arange(root.shape[1]), many)
        step = np.arange(len(own)) - np.repeat(np.cumsum(many) - many, many)
        ends = []
        for level in (step, step + 1):
            part = level / many[own]
            sum_of_roots = at_apex[own] + r[1][own]
            way = at_apex[own] * (2 - part) + r[1][own] * part
            # phi is linear along the sides; where it does not vary any cut is as good
            way = np.divide(way, sum_of_roots, out=np.ones_like(way), where=sum_of_roots > 0)
            ends.append(np.where(level == many[own], 1.0, part * way))
        sides = [side[:, own] - apex[:, own] for side in (between, opposite)]
        at = [
            apex[:, own] + t * side
            for t, side in (
                (ends[0], sides[0]),
                (ends[1], sides[0]),
                (ends[1], sides[1]),
                (ends[0], sides[1]),
            )
        ]
        triangle.append(own)
        corners.append(np.stack(at, axis=1))
    return np.concatenate(triangle), np.concatenate(corners, axis=2)
