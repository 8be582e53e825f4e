"""Cells that the line of contact crosses, with pressures on the side in contact only.

Pressures end there like the root of the distance s to the line, and what moves the line a little
adds some that grow like ``s^(-1/2)``; both times the law of the edge of the plan, which the line
may meet. They are taken as uniform on small triangles, by their means.

Source: K. L. Johnson, Contact Mechanics (1985), section 5.1.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_matrix, csr_matrix, eye_array

from ..grids.fan import Fan
from ..grids.lines import signed_distance
from ..grids.partition import Partition
from ..grids.polygons import Polygons
from .edge_weights import EdgeWeights, mean_weight
from .graded_rule import graded

#: cells farther from the line than so many times their size are not looked at
REACH = 4.0


@dataclass(frozen=True, eq=False)
class LineLaw:
    """One of both pressures on crossed cells.

    Attributes
    ----------
    density : (m, n) csr_matrix
        Pressure on each triangle by unit mean pressure on each cell.
    carried : (n, n) csr_matrix
        Mean pressures by those of the cells whose centroids are in contact: other crossed cells
        carry as much, over the law, as their neighbours do.
    relative : (n,) array of float
        What mean pressures are at the centroids, the law of the plan's edge apart.
    """

    density: csr_matrix
    carried: csr_matrix
    relative: ndarray


@dataclass(frozen=True, eq=False)
class CrossedCells:
    """Triangles that fill the part of crossed cells that is in contact.

    Attributes
    ----------
    triangles : Partition
        The m triangles.
    cell, part : (m,) array of int
        Cell of each, and part of the cell, as of `Fan`.
    crossed, in_contact : (n,) array of bool
        Whether the line crosses each cell, and whether its centroid is in contact.
    laws : tuple of LineLaw
        Pressures like ``s^(1/2)`` and like ``s^(-1/2)``.
    """

    triangles: Partition
    cell: ndarray
    part: ndarray
    crossed: ndarray
    in_contact: ndarray
    laws: tuple[LineLaw, LineLaw]

    @classmethod
    def from_lines(
        cls,
        partition: Partition,
        fan: Fan,
        weights: EdgeWeights,
        lines: list[ndarray],
        touching: ndarray,
    ) -> Self | None:
        """Those of some lines; None if they cross no cell.

        Parameters
        ----------
        partition : Partition
            The n cells.
        fan : Fan
            Triangles of all of them.
        weights : EdgeWeights
            The law of the edge of the plan.
        lines : list of (2, k) array of float
            Lines with contact to their left.
        touching : (n,) array of bool
            Cells in contact, as far from the lines as they are not crossed.
        """
        size = np.sqrt(partition.areas)
        middle = signed_distance(partition.centroids, lines)
        near = np.abs(middle) < REACH * size
        own = near[fan.cell]
        used = np.unique(fan.t[:, own])
        depth = np.zeros(fan.p.shape[1])
        depth[used] = signed_distance(fan.p[:, used], lines)
        depth[np.abs(depth) < 1e-9 * size.min()] = 0.0
        crossed = near.copy()
        for side in (depth > 0, depth < 0):
            crossed &= np.bincount(fan.cell, own & side[fan.t].any(axis=0), len(near)) > 0
        if not crossed.any():
            return None
        own = crossed[fan.cell]
        fan = replace(fan, t=fan.t[:, own], cell=fan.cell[own], part=fan.part[own])
        fan, depth = fan.cut_at_zero(depth)
        own = (depth[fan.t] > 0).any(axis=0)
        t = fan.t[:, own]
        p, t, of = _quarters(fan.p, t)
        cell, part = fan.cell[own][of], fan.part[own][of]
        in_contact = np.where(near, middle > 0, touching)
        depth = np.append(depth, signed_distance(p[:, len(depth) :], lines))
        depth = depth.clip(1e-12 * size.min())  # never zero, as is the root of the law of the edge
        square, law = depth[t], _edge_law(weights, p, t, cell)
        rising, growing = _roots(square)
        triangles = _partition(p, t)
        at_middle = np.where(in_contact, np.abs(middle), np.nan)
        laws = []
        for values, power in ((rising, 0.5), (growing, -0.5)):
            load = np.bincount(cell, values * law * triangles.areas, len(near))
            mean = np.where(crossed, load / partition.areas, np.nan)
            there = at_middle**power * weights.in_cells
            laws.append(_law(partition, cell, values * law, mean, there, in_contact))
        return cls(triangles, cell, part, crossed, in_contact, (laws[0], laws[1]))


def _quarters(p: ndarray, t: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """Points and triangles, each cut in four, and the number of the triangle each lies in."""
    m, n = t.shape[1], p.shape[1]
    middles = ((p[:, t] + p[:, np.roll(t, -1, axis=0)]) / 2).reshape(2, -1)
    (a, b, c), (ab, bc, ca) = t, n + np.arange(3 * m).reshape(3, m)
    parts = [a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]
    return np.hstack([p, middles]), np.hstack([*map(np.array, parts)]), np.tile(np.arange(m), 4)


def _partition(p: ndarray, t: ndarray) -> Partition:
    """Triangles as cells, whatever their shape and whether they cover a region."""
    m = t.shape[1]
    polygons = Polygons(p, t.T.ravel(), np.arange(0, 3 * m + 1, 3))
    begin, end = t.ravel(), np.roll(t, -1, axis=0).ravel()
    key = np.minimum(begin, end) * np.int64(p.shape[1]) + np.maximum(begin, end)
    _, first, rib = np.unique(key, return_index=True, return_inverse=True)
    f2c = np.full((2, len(first)), -1)
    f2c[np.where(begin == begin[first][rib], 0, 1), rib] = np.tile(np.arange(m), 3)
    facets, outside = np.stack([begin, end])[:, first], np.full(len(first), -1)
    return Partition(polygons, facets, f2c, polygons.centroids, outside)


def _edge_law(weights: EdgeWeights, p: ndarray, t: ndarray, cell: ndarray) -> ndarray:
    """Mean of the law of the edge over triangles."""
    used, at = np.unique(t, return_inverse=True)
    root = np.sqrt(weights.phi_at(p[:, used]))[at.reshape(t.shape)]
    root = root.clip(1e-10 * root.max())
    return mean_weight(*root) * weights.factor(cell, np.sqrt(np.mean(root**2, axis=0)))


def _roots(square: ndarray) -> tuple[ndarray, ndarray]:
    """Means over triangles of the root of what is linear, (3, m), and of its inverse."""
    whole = np.repeat(np.eye(3)[..., None], square.shape[1], axis=2)
    root, inverse = np.zeros((2, square.shape[1]))
    for at, load in graded(whole, square, 2):  # exact
        root += np.sum(load * np.einsum("ikq,ik->kq", at, square), axis=1)
        inverse += load.sum(axis=1)
    return root, inverse


def _law(
    partition: Partition,
    cell: ndarray,
    values: ndarray,
    mean: ndarray,
    there: ndarray,
    in_contact: ndarray,
) -> LineLaw:
    """From values on triangles, means over crossed cells, and values at centroids in contact."""
    n, f2c, crossed = len(partition), partition.f2c, ~np.isnan(mean)
    density = csr_matrix((values / mean[cell], (np.arange(len(cell)), cell)), (len(cell), n))
    pairs = np.hstack([f2c, f2c[::-1]])[:, np.tile(f2c[1] >= 0, 2)]
    pairs = pairs[:, (crossed & ~in_contact)[pairs[0]] & in_contact[pairs[1]]]
    own, other = np.unique(pairs, axis=1)
    x = partition.centroids
    share = 1 / np.sum((x[:, own] - x[:, other]) ** 2, axis=0)
    share *= mean[own] / np.where(crossed, mean, there)[other] / np.bincount(own, share, n)[own]
    carried = csr_matrix(coo_matrix((share, (own, other)), shape=(n, n)) + eye_array(n))
    relative = np.where(crossed & in_contact, there / mean, 1.0)
    return LineLaw(density, carried, relative)
