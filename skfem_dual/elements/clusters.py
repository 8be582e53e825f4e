"""Cells in clusters, whose loads act from afar as points with weights.

They are halved along their longer extent until few are left; each cluster is followed by its
parts. Moments of a cluster are those of its parts, moved.
"""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..kernels.compiled import inputs
from .clouds import Clouds
from .moments import load_moments, moved, reach_of
from .pieces import Pieces
from .strips import CellLoads

#: cells up to which there is one cluster, never far, and those in clusters without parts
FEW, LEAF = 500, 24
#: degrees of clouds, and the radii of their cluster from which on they serve: to 1e-11 of the mean
#: pressure in all
CLOUDS = {12: 5.0, 9: 8.0, 6: 20.0}
#: cells whose moments are found at a time
BLOCK = 20_000


class Clusters(NamedTuple):
    """Clusters of cells, each before its parts.

    Attributes
    ----------
    clouds : Clouds
        What stands for the load of each from afar.
    of : (n,) array of int
        The cluster without parts in which each cell is.
    after : (k,) array of int
        The one behind each cluster and its parts.
    """

    clouds: Clouds
    of: ndarray
    after: ndarray

    @classmethod
    def from_loads(cls, loads: CellLoads) -> Self:
        """Of cells under their pressures."""
        n, degree = len(loads.partition), max(CLOUDS)
        if n <= FEW:
            one = np.ones(1)
            never = dict.fromkeys(CLOUDS, np.inf * one)
            moments = np.zeros((degree + 1, degree + 1, 1))
            clouds = Clouds.from_moments(np.zeros((2, 1)), one, moments, never)
            return cls(clouds, *inputs(np.zeros(n, np.int64), np.ones(1, np.int64)))
        x, pieces = loads.acting, Pieces.from_partition(loads.partition, loads.weights)
        tree = cKDTree(x.T, leafsize=LEAF)
        begin, end, after = _walked(tree.tree)
        last = np.nonzero(after == np.arange(1, len(after) + 1))[0]
        of = np.empty(n, np.int64)
        of[tree.indices] = np.repeat(last, end[last] - begin[last])
        members = [tree.indices[own] for own in map(slice, begin, end)]
        centres, radii = _circles(members, x, reach_of(pieces, x))
        moments = np.zeros((degree + 1, degree + 1, len(after)))
        for first in range(0, n, BLOCK):
            cells = np.arange(first, min(first + BLOCK, n))
            about = load_moments(pieces.of(cells), x[:, cells], degree + 1)
            own = moved(loads.moments(about, cells), x[:, cells] - centres[:, of[cells]])
            order = np.argsort(of[cells], kind="stable")
            cluster, starts = np.unique(of[cells][order], return_index=True)
            moments[..., cluster] += np.add.reduceat(own[..., order], starts, axis=-1)
        for k in np.setdiff1d(np.arange(len(after)), last)[::-1]:  # parts before their cluster
            parts = [k + 1, after[k + 1]]
            arm = centres[:, parts] - centres[:, [k]]
            moments[..., k] = moved(moments[..., parts], arm).sum(axis=-1)
        least = {d: k * radii for d, k in CLOUDS.items()}
        return cls(Clouds.from_moments(centres, radii, moments, least), *inputs(of, after))


def _circles(members: list[ndarray], x: ndarray, reach: ndarray) -> tuple[ndarray, ndarray]:
    """Centres and radii of circles around some cells at points, (2, n), that reach from there."""
    centres, radii = np.empty((2, len(members))), np.empty(len(members))
    for k, cells in enumerate(members):
        own = x[:, cells]
        centres[:, k] = (own.min(axis=1) + own.max(axis=1)) / 2
        radii[k] = (np.hypot(*(own - centres[:, k, None])) + reach[cells]).max()
    return centres, radii


def _walked(node: Any) -> tuple[ndarray, ndarray, ndarray]:
    """Begin and end of the points of each node of a tree, and the node behind its parts."""
    begin: list[int] = []
    end: list[int] = []
    after: list[int] = []

    def walk(node: Any) -> None:
        number = len(begin)
        begin.append(node.start_idx)
        end.append(node.end_idx)
        after.append(0)
        for part in (node.lesser, node.greater):
            if part is not None:
                walk(part)
        after[number] = len(begin)

    walk(node)
    return np.array(begin), np.array(end), np.array(after)
