"""Pressures of edge-weighted cells as strips, each uniformly loaded, integrated by their ribs.

Each triangle of a cell is cut along levels of the distance to the edge, equidistant in its root.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..kernels.compiled import inputs
from .edge_weights import EdgeWeights
from .load_matrix import points_in_pieces

#: strips in a triangle that reaches from the edge on, in proportion fewer where the weight varies
#: less, and the fewest
STRIPS, FEWEST = 16, 3


class Strips(NamedTuple):
    """Ribs of the strips of some cells, what they carry beyond the mean pressure.

    Attributes
    ----------
    begin, along : (2, k) array of float
        Where ribs begin and their directions, of unit length.
    length : (k,) array of float
    jump : (k,) array of float
        Pressure on the left under a unit mean pressure on the cell, less 1.
    starts : (ncells + 1,) array of int
        The first rib of each cell.
    """

    begin: ndarray
    along: ndarray
    length: ndarray
    jump: ndarray
    starts: ndarray

    @classmethod
    def from_weights(cls, weights: EdgeWeights, cells: ndarray) -> Self:
        """Of weighted cells, ascending."""
        cell, x, area, load = strip_polygons(weights, cells)
        jump = np.sign(area) * (load / np.abs(area) - 1)
        following = np.roll(x, -1, axis=1)
        length = np.hypot(*(following - x))
        order = np.argsort(cell, kind="stable")
        real = length.T[order] > 0
        cell = np.repeat(np.searchsorted(cells, cell[order]), 4)[real.ravel()]
        begin, along, length, jump = (
            np.moveaxis(a, -1, -2)[..., order, :][..., real]
            for a in (x, following - x, length, np.tile(jump, (4, 1)))
        )
        starts = np.searchsorted(cell, np.arange(len(cells) + 1))
        return cls(*inputs(begin, along / length, length, jump, starts))


class StripPolygons(NamedTuple):
    """Strips of weighted cells.

    Attributes
    ----------
    cell : (k,) array of int
        The cell of each.
    corners : (2, 4, k) array of float
        In turn, in either sense; two are equal at an apex.
    area : (k,) array of float
        Positive if the corners are counter-clockwise.
    load : (k,) array of float
        Load under a unit mean pressure on the cell.
    """

    cell: ndarray
    corners: ndarray
    area: ndarray
    load: ndarray


def strip_polygons(weights: EdgeWeights, cells: ndarray) -> StripPolygons:
    """Strips of weighted cells, ascending."""
    fan = weights.fan
    wanted = np.zeros(len(weights.partition), dtype=bool)
    wanted[cells] = True
    own = np.nonzero(wanted[fan.cell])[0]
    triangle, corners = _cut(weights.root[fan.t[:, own]])
    triangle = own[triangle]
    # a strip of four corners is two triangles; its load is what those carry
    halves = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]], axis=2)
    pieces = np.tile(triangle, 2), halves
    points = points_in_pieces(weights.partition, weights, fan, pieces, 1)
    load = np.bincount(points.piece, points.weight, 2 * len(triangle))
    load = load.reshape(2, -1).sum(axis=0)
    x = np.einsum("dvk,vck->dck", fan.p[:, fan.t[:, triangle]], corners)
    following = np.roll(x, -1, axis=1)
    area = np.sum(x[0] * following[1] - x[1] * following[0], axis=0) / 2
    keep = np.abs(area) > 1e-14 * fan.areas[triangle]
    return StripPolygons(fan.cell[triangle[keep]], x[..., keep], area[keep], load[keep])


def _cut(root: ndarray) -> tuple[ndarray, ndarray]:
    """Triangles cut along levels, those of the roots of the distance at their corners (3, m).

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
    count = np.ceil(STRIPS * np.abs(r[1:] - r[:-1]) / r[2]).astype(int).clip(FEWEST)
    triangle, corners = [], []
    for apex, at_apex, strips in ((low, r[0], count[0]), (high, r[2], count[1])):
        own = np.repeat(np.arange(root.shape[1]), strips)
        step = np.arange(len(own)) - np.repeat(np.cumsum(strips) - strips, strips)
        ends = []
        for level in (step, step + 1):
            part = level / strips[own]
            sum_of_roots = at_apex[own] + r[1][own]
            way = at_apex[own] * (2 - part) + r[1][own] * part
            # phi is linear along the sides; where it does not vary any cut is as good
            way = np.divide(way, sum_of_roots, out=np.ones_like(way), where=sum_of_roots > 0)
            ends.append(np.where(level == strips[own], 1.0, part * way))
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
