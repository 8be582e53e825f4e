"""Dipoles of cells in the fast summation.

They act through the expansions of the pressures, see `CellExpansions`. What they do near by is
computed in every product: that takes no memory.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy import ndarray

from ...elements.slope_correction import Circles, Fall, add_near_dipoles
from ...grids.partition import Partition
from ...ground.substrates import Substrate
from ...kernels.compiled import inputs
from .chebyshev import Chebyshev
from .linear_maps import Run
from .lists import Lists
from .loops import Layout
from .quadtree import Quadtree


@dataclass(frozen=True, eq=False)
class DipoleSummation:
    """Where the dipoles of cells act, cells and points in the order of the tree.

    Attributes
    ----------
    near : Layout
        Which cells act on which points one by one.
    beside : Lists
        Cells that act on the local expansion of a box.
    grid : (2, boxes, points) array of float
        Points of interpolation of these boxes.
    coefficients : (points, terms) array of float
        From values there to the expansion.
    circles : Circles
        The cells.
    fall : Fall
        How dipoles act.
    """

    near: Layout
    beside: Lists
    grid: ndarray
    coefficients: ndarray
    circles: Circles
    fall: Fall

    @classmethod
    def from_tree(
        cls,
        tree: Quadtree,
        chebyshev: Chebyshev,
        substrate: Substrate,
        partition: Partition,
        near: Layout,
        beside: Lists,
    ) -> Self:
        """Of the cells of a partition; ``near`` is the layout of P2P, ``beside`` lists of P2L."""
        cells = tree.cells
        middle, half = tree.middle[:, beside.boxes], tree.half[beside.boxes]
        return cls(
            near,
            beside,
            middle[:, :, None] + half[:, None] * chebyshev.grid[:, None],
            chebyshev.coefficients,
            Circles.of(partition.centroids[:, cells], partition.areas[cells]),
            Fall.from_substrate(substrate),
        )

    @property
    def nbytes(self) -> int:
        """Memory beside what is shared."""
        return self.grid.nbytes + sum(a.nbytes for a in self.circles)

    def add_near(
        self, x: ndarray, dipoles: ndarray, local: ndarray, out: ndarray, run: Run
    ) -> None:
        """Add what does not act through multipole expansions to local ones and to points."""
        (loads,) = inputs(dipoles)

        def add(x: ndarray, rows: ndarray, starts: ndarray, cells: ndarray, out: ndarray) -> None:
            lists = *inputs(x, rows, starts, cells), self.circles, self.fall, loads, out
            run(lambda k: add_near_dipoles(k.start, k.stop, *lists), len(starts) - 1)

        near, beside, (_, boxes, points) = self.near, self.beside, self.grid.shape
        add(x, near.rows, near.starts, near.columns, out)
        settled, first = np.zeros((len(out), boxes * points)), points * np.arange(boxes)
        rows = np.stack([first, first + points])
        add(self.grid.reshape(2, -1), rows, beside.starts, beside.items, settled)
        local[:, beside.boxes] += settled.reshape(len(out), boxes, points) @ self.coefficients
