"""Parts of cells in each of which the ground is looked at once, by the load that they carry."""

from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..elements.edge_weights import EdgeWeights
from ..elements.load_matrix import points_in_pieces
from .shapes import Gap, gap_values

#: cells over which the weight varies by less than this factor have no sectors; in no cell of a
#: regular mesh is it just that
VARIATION = 1.51
#: centroids of a cell and of its load nearer than so much of its size are one, and no direction
NIL = 1e-6


class Sectors(NamedTuple):
    """Parts of cells near the edge: a dual cell has one in each triangle of the mesh, other cells
    have two along each side; dual cells over which the weight varies little have three, one in the
    middle of the plan six.

    Attributes
    ----------
    x : (2, m) array of float
        Where the load of the sector acts.
    cell : (m,) array of int
        Its cell.
    load : (m,) array of float
        Its load by unit mean pressure on the cell.
    """

    x: ndarray
    cell: ndarray
    load: ndarray


def sectors(weights: EdgeWeights, twofold: bool = False) -> Sectors:
    """Parts of the cells in elements of the mesh, or around the middles of elements; ``twofold``
    with a part of the load each on both sides of where it acts, along its longer axis, and none in
    cells over which the weight varies little."""
    fan, (mean, off) = weights.fan, weights.of_triangles
    least, most = weights.roots
    own = np.nonzero((weights.weighted & (most > VARIATION * least))[fan.cell])[0]
    load = (fan.areas * mean)[own] / weights.mean[fan.cell[own]]
    x = fan.p.take(fan.t.take(own, axis=1), axis=1).mean(axis=1) + off.take(own, axis=1)
    (x, cell, total), sector = gathered(x, load, fan.cell[own], fan.part[own])
    if twofold:
        spread, part = _twofold(weights, own, sector, x)
        x = np.hstack([x + spread[0], x + spread[1]])
        cell, total = np.tile(cell, 2), np.append(part * total, (1 - part) * total)
    else:
        inner = _inner(weights, np.nonzero(weights.weighted & (most <= VARIATION * least))[0])
        x, cell = np.hstack([x, inner.x]), np.append(cell, inner.cell)
        total = np.append(total, inner.load)
    return Sectors(np.ascontiguousarray(x), cell, total)


def gaps_beside(gap: Gap, x: ndarray) -> ndarray | None:
    """Gap at other points than those of the cells, (2, m); None if it is known in collocation
    points only, or not in all of these."""
    if isinstance(gap, tuple) or callable(gap):
        with suppress(ValueError):
            return gap_values(gap, x)
    return None


def gathered(x: ndarray, load: ndarray, cell: ndarray, part: ndarray) -> tuple[Sectors, ndarray]:
    """Pieces of loads put together by parts of cells, and the number of each piece's sector.

    Parameters
    ----------
    x : (2, k) array of float
        Where the load of each piece acts.
    load : (k,) array of float
        Their loads.
    cell, part : (k,) array of int
        The cell and the part of it that they belong to.
    """
    parts = int(part.max(initial=0)) + 1
    key, sector = np.unique(cell.astype(np.int64) * parts + part, return_inverse=True)
    total = np.bincount(sector, load, len(key))
    middles = np.stack([np.bincount(sector, load * a, len(key)) for a in x]) / total
    return Sectors(middles, key // parts, total), sector


def _inner(weights: EdgeWeights, cells: ndarray) -> Sectors:
    """Three points in each of some cells where thirds of its load have its second moments, one
    from the load's centroid towards the edge, or away from the middle of the plan where the load
    leans to no side. A cell in the middle of the plan has six, half of them opposite the others,
    so that no direction counts more."""
    partition, areas = weights.partition, weights.partition.areas[cells]
    centroid = weights.centroids.take(cells, axis=1)
    xx, xy, yy = (weights.second_moments[..., cells] / areas)[[0, 0, 1], [0, 1, 1]]
    # the root of a matrix of two rows, by Cayley and Hamilton
    det = np.sqrt(xx * yy - xy * xy)
    root = np.array([[xx + det, xy], [xy, yy + det]]) / np.sqrt(xx + yy + 2 * det)
    middles = partition.centroids.take(cells, axis=1)
    towards, nil = centroid - middles, NIL * np.sqrt(areas)
    towards = np.where(np.hypot(*towards) < nil, middles - partition.centre[:, None], towards)
    (middle,) = np.nonzero(np.hypot(*towards) < nil)
    for k in middle:
        towards[:, k] = _farthest(partition.polygons[cells[k]] - middles[:, [k]])
    angle = np.arctan2(towards[1], towards[0]) + 2 * np.pi / 3 * np.arange(3)[:, None]
    arm = np.sqrt(2) * np.stack([np.cos(angle), np.sin(angle)])
    arm, load = np.einsum("ijn,jkn->ikn", root, arm), np.tile(areas / 3, (3, 1))
    load[:, middle] /= 2
    x, opposite = centroid[:, None] + arm, centroid[:, None, middle] - arm[..., middle]
    x = np.hstack([x.reshape(2, -1), opposite.reshape(2, -1)])
    cell = np.append(np.tile(cells, 3), np.tile(cells[middle], 3))
    return Sectors(x, cell, np.append(load, load[:, middle]))


def _farthest(x: ndarray) -> ndarray:
    """The farthest of points (2, n), of equally far ones always the same, however numbered."""
    square = np.sum(x**2, axis=0)
    x = x[:, square > (1 - NIL) * square.max()]
    return x[:, np.argmax(x[0] + 0.3 * x[1])]


def _twofold(
    weights: EdgeWeights, own: ndarray, sector: ndarray, x: ndarray
) -> tuple[ndarray, ndarray]:
    """Two points of each sector from ``x`` on, (2, 2, m), the second first, and the part of its
    load in the first, (m,): those of Gauss along the longer axis, which lie inside however the
    load grows to an end; ``own`` are the triangles of the fan in them."""
    whole = np.repeat(np.eye(3)[..., None], len(own), axis=2)
    points = points_in_pieces(weights, weights.fan, (own, whole), 3)
    at = sector[points.piece]
    arm, total = points.x - x[:, at], np.bincount(at, points.weight)
    moments = [[np.bincount(at, points.weight * a * b) / total for a in arm] for b in arm]
    value, axis = np.linalg.eigh(np.moveaxis(np.array(moments), -1, 0))
    square, along = value[:, 1], axis[:, :, 1].T
    third = np.bincount(at, points.weight * np.sum(along[:, at] * arm, axis=0) ** 3) / total
    skew = np.divide(third, 2 * square, where=square > 0, out=np.zeros(len(square)))
    far = np.sqrt(square.clip(0.0) + skew**2)
    steps, span = np.array([skew + far, skew - far]), np.where(far > 0, 2 * far, 1.0)
    return steps[:, None] * along, (far - skew) / span
