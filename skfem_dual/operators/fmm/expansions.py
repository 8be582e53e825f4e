"""Multipole expansions of boxes, by the cells that they hold: P2M.

They are computed in every product, from few moments of each cell: kept for every term they would
take three times the memory.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray

from ...elements.cell_dipoles import Circles
from ...kernels.compiled import inputs
from ...kernels.threads import Threads
from .chebyshev import PADDING
from .linear_maps import Run
from .loops import Clusters, Loads, add_multipoles
from .quadtree import Quadtree

#: moments of some cells about their centroids, see `elements.moments.Multipoles`
Moments = Callable[[ndarray], ndarray]


def degree_of(order: int) -> int:
    """Degree of the moments of cells that expansions of an order take."""
    return order // 2


@dataclass(frozen=True, eq=False)
class CellExpansions:
    """What takes pressures and dipoles of cells, in the order of the tree, to expansions.

    Attributes
    ----------
    boxes : (k,) array of int
        Those that hold cells themselves.
    clusters : Clusters
        What they hold.
    loads : Loads
        The cells, by their circles.
    order : int
        Of the expansions.
    """

    boxes: ndarray
    clusters: Clusters
    loads: Loads
    order: int

    @classmethod
    def of(
        cls, tree: Quadtree, order: int, circles: Circles, moments: Moments, dtype: type
    ) -> Self:
        """Of cells with these circles and ``moments``, which are kept as ``dtype``."""
        boxes = np.nonzero(tree.own > tree.sources[0])[0]
        boxes = boxes[np.argsort(tree.sources[0, boxes])]
        own, half = np.stack([tree.sources[0, boxes], tree.own[boxes]]), PADDING * tree.half[boxes]
        orders = degree_of(order) + 1
        degrees = np.array([(i, d - i) for d in range(orders) for i in range(d + 1)]).T
        kept: ndarray = np.empty((degrees.shape[1], len(circles.squares)), dtype)

        def work(k: slice) -> None:
            some = slice(own[0, k.start], own[1, k.stop - 1])
            unit = np.repeat(half[k], own[1, k] - own[0, k])
            known = moments(tree.cells[some])[*degrees] / (np.pi * circles.squares[some])
            kept[:, some] = known / unit ** degrees.sum(axis=0)[:, None]

        with Threads() as run:
            run(work, len(boxes))
        clusters = Clusters(*inputs(own, tree.middle[:, boxes], half))
        boxes, kept = inputs(boxes, kept)
        return cls(boxes, clusters, Loads(*circles, kept, orders), order)

    def cut(self, order: int) -> Self:
        """Of an order that is lower, by areas and centroids of the cells alone."""
        moments = self.loads.moments[:3]
        return replace(self, loads=self.loads._replace(moments=moments, orders=2), order=order)

    @property
    def nbytes(self) -> int:
        """Memory."""
        return sum(a.nbytes for a in (self.boxes, *self.clusters, self.loads.moments))

    def add(self, q: ndarray, dipoles: ndarray | None, multipole: ndarray, run: Run) -> None:
        """Add pressures (s, n) and dipoles (s, 2, n) to expansions (s, nboxes, terms)."""
        dipoles = np.empty((len(q), 2, 0)) if dipoles is None else dipoles
        args = self.boxes, self.clusters, self.loads, self.order, *inputs(q, dipoles), multipole
        run(lambda k: add_multipoles(k.start, k.stop, *args), len(self.boxes))
