"""Parts of cells in each of which the ground is looked at once, by the load that they carry."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..elements.edge_weights import EdgeWeights
from ..elements.load_matrix import points_in_pieces

#: cells over which the weight varies by less than this factor hardly part from the punch: 1.25 is
#: better on meshes graded to the edge, 1.5 on uniform ones
VARIATION = 1.5


class Sectors(NamedTuple):
    """Parts of cells near the edge: a dual cell has one in each triangle of the mesh, other cells
    have two along each side.

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
    with half of the load each on both sides of where it acts, along its longer axis."""
    fan, (mean, off) = weights.fan, weights.of_triangles
    least, most = weights.extremes(weights.root[fan.t])
    own = np.nonzero((weights.weighted & (most > VARIATION * least))[fan.cell])[0]
    load = (fan.areas * mean)[own] / weights.mean[fan.cell[own]]
    x = fan.p[:, fan.t[:, own]].mean(axis=1) + off[:, own]
    key = np.stack([fan.cell[own], fan.part[own]])
    (cell, _), sector = np.unique(key, axis=1, return_inverse=True)
    sector, m = sector.ravel(), len(cell)
    total = np.bincount(sector, load, m)
    x = np.stack([np.bincount(sector, load * a, m) for a in x]) / total
    if twofold:
        spread = _spread(weights, own, sector, x) / np.sqrt(total)
        x = np.hstack([x - spread, x + spread])
        cell, total = np.tile(cell, 2), np.tile(0.5 * total, 2)
    return Sectors(np.ascontiguousarray(x), cell, total)


def _spread(weights: EdgeWeights, own: ndarray, sector: ndarray, x: ndarray) -> ndarray:
    """Root of the greater principal second moment of the load of sectors about ``x``, along its
    axis, shape (2, m); ``own`` are the triangles of the fan in them."""
    whole = np.repeat(np.eye(3)[..., None], len(own), axis=2)
    points = points_in_pieces(weights, weights.fan, (own, whole), 2)
    at = sector[points.piece]
    arm = points.x - x[:, at]
    moments = [[np.bincount(at, points.weight * a * b) for a in arm] for b in arm]
    value, axis = np.linalg.eigh(np.moveaxis(np.array(moments), -1, 0))
    return np.sqrt(value[:, 1].clip(0.0)) * axis[:, :, 1].T
