"""Dipoles of cells in the fast summation.

They act through the expansions of the pressures, see `CellExpansions`, and on points beside them,
see `NearEntries`. What they do is computed in every product: that takes no memory.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray

from ...elements.cell_dipoles import Circles, Fall, add_near_dipoles
from ...kernels.compiled import inputs
from .chebyshev import Chebyshev
from .linear_maps import Run
from .lists import Lists
from .quadtree import Quadtree


@dataclass(frozen=True, eq=False)
class DipoleSummation:
    """What dipoles of cells, in the order of the tree, do to local expansions: their P2L.

    Attributes
    ----------
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
        beside: Lists,
        circles: Circles,
        fall: Fall,
    ) -> Self:
        """Of the cells of a tree; ``beside`` are lists of P2L."""
        middle, half = tree.middle[:, beside.boxes], tree.half[beside.boxes]
        grid = middle[:, :, None] + half[:, None] * chebyshev.grid[:, None]
        return cls(beside, grid, chebyshev.coefficients, circles, fall)

    def cut(self, terms: int) -> Self:
        """To the first terms only."""
        return replace(self, coefficients=np.ascontiguousarray(self.coefficients[:, :terms]))

    @property
    def nbytes(self) -> int:
        """Memory beside what is shared."""
        return self.grid.nbytes

    def add_to(self, local: ndarray, dipoles: ndarray, run: Run) -> None:
        """Add what dipoles (s, 2, n) do beside boxes to their local expansions."""
        beside, (_, boxes, points) = self.beside, self.grid.shape
        settled, first = np.zeros((len(local), boxes * points)), points * np.arange(boxes)
        rows = np.stack([first, first + points])
        known = self.grid.reshape(2, -1), rows, beside.starts, beside.items
        args = *inputs(*known), self.circles, self.fall, *inputs(dipoles), settled
        run(lambda k: add_near_dipoles(k.start, k.stop, *args), boxes)
        local[:, beside.boxes] += settled.reshape(len(local), boxes, points) @ self.coefficients
