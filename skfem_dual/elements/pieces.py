"""Uniformly loaded polygons that stand for cells.

A cell is one of them. Of an edge-weighted cell each triangle of its fan is one, with its own mean
of the weight, moved to where its load acts.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.compiled import inputs
from .edge_weights import EdgeWeights


class Pieces(NamedTuple):
    """Uniformly loaded polygons, those of a cell one after the other.

    Attributes
    ----------
    vertices : (2, k) array of float
        Those of all pieces, counter-clockwise, one piece after the other.
    offsets : (npieces + 1,) array of int
        Where those of each piece begin.
    density : (npieces,) array of float
        Load per area under a unit mean pressure on the cell.
    first, last : (n,) array of int
        The first piece of each cell, and the one behind its last.
    """

    vertices: ndarray
    offsets: ndarray
    density: ndarray
    first: ndarray
    last: ndarray

    @classmethod
    def from_partition(cls, partition: Partition, weights: EdgeWeights | None) -> Self:
        """Of all cells."""
        polygons = partition.polygons
        n = len(polygons)
        weighted = np.zeros(n, dtype=bool) if weights is None else weights.weighted
        cell = np.nonzero(~weighted)[0]
        sizes, density = polygons.sizes[cell].astype(np.int64), np.ones(len(cell))
        corners = polygons.indices[np.repeat(~weighted, polygons.sizes)]
        vertices = polygons.p.take(corners, axis=1)
        if weights is not None:
            fan = weights.fan
            own = np.nonzero(weighted[fan.cell])[0]
            mean, off = weights.of_triangles
            triangles = fan.p.take(fan.t[:, own].T, axis=1) + off[:, own, None]
            cell = np.concatenate([cell, fan.cell[own]])
            sizes = np.concatenate([sizes, np.full(len(own), 3)])
            density = np.concatenate([density, mean[own] / weights.mean[fan.cell[own]]])
            vertices = np.hstack([vertices, triangles.reshape(2, -1)])
        return cls.of_polygons(vertices, sizes, density, cell, n)

    @classmethod
    def of_polygons(
        cls, vertices: ndarray, sizes: ndarray, density: ndarray, cell: ndarray, n: int
    ) -> Self:
        """Of the vertices of polygons, one after the other, their densities and which of n cells
        each of them belongs to."""
        order = np.argsort(cell, kind="stable")
        vertices = vertices.take(np.argsort(np.repeat(cell, sizes), kind="stable"), axis=1)
        offsets = np.concatenate([[0], np.cumsum(sizes[order])])
        first = np.searchsorted(cell[order], np.arange(n + 1))
        return cls(*inputs(vertices, offsets, density[order], first[:-1], first[1:]))

    def with_triangles(self, x: ndarray, density: ndarray, cell: ndarray) -> Self:
        """With triangles of corners (2, 3, k) in place of what their cells had."""
        n, sizes = len(self.first), np.diff(self.offsets)
        own = np.repeat(np.arange(n), self.last - self.first)
        keep = ~np.isin(own, cell)
        vertices = self.vertices[:, np.repeat(keep, sizes)]
        return type(self).of_polygons(
            np.hstack([vertices, x.swapaxes(1, 2).reshape(2, -1)]),
            np.concatenate([sizes[keep], np.full(len(cell), 3)]),
            np.concatenate([self.density[keep], density]),
            np.concatenate([own[keep], cell]),
            n,
        )

    def of(self, cells: ndarray) -> Self:
        """Those of some cells, ascending."""
        count = self.last[cells] - self.first[cells]
        last = np.cumsum(count)
        piece = np.arange(last[-1]) + np.repeat(self.first[cells] - last + count, count)
        sizes = np.diff(self.offsets)[piece]
        ends = np.cumsum(sizes)
        vertex = np.arange(ends[-1]) + np.repeat(self.offsets[piece] - ends + sizes, sizes)
        vertices = self.vertices.take(vertex, axis=1)
        own = np.append(0, ends), self.density[piece], last - count, last
        return type(self)(*inputs(vertices, *own))
