"""How large triangles are around facets on the boundary that are far shorter than the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

#: growth of their size per distance from such facets, and so many times the mean length or less
#: makes a facet one
STEEPER, SHORT = 0.4, 0.5


@dataclass(frozen=True, eq=False)
class ShortFacets:
    """Facets on the boundary that are shorter than those around, as sides may be.

    Attributes
    ----------
    classes : list of pairs
        Trees of middles of facets and their lengths, ascending, of each size some.
    least : float
        The shortest length.
    """

    classes: list[tuple[cKDTree, ndarray]]
    least: float

    @classmethod
    def of(cls, boundary: Sequence[ndarray], edge: float) -> "ShortFacets | None":
        """Of boundaries whose facets have the mean length ``edge``; None where none is short."""
        onward = np.hstack([np.diff(q, axis=1, append=q[:, :1]) for q in boundary])
        length, middle = np.hypot(*onward), np.hstack(boundary) + onward / 2
        least = float(length.min())
        if least > SHORT * edge:
            return None
        size = np.floor(np.log2(length / least)).astype(int)
        some = [np.nonzero((size == k) & (length < edge))[0] for k in range(size.max() + 1)]
        trees = [(cKDTree(middle[:, own].T), length[own]) for own in some if len(own)]
        return cls(trees, least)

    def width(self, x: ndarray, most: float) -> ndarray:
        """Lengths of facets in points of shape (2, n): growing from those of short ones."""
        width = np.full(x.shape[1], most)
        for tree, length in self.classes:  # the shortest first: fewer and fewer points are asked
            (wide,) = np.nonzero(width > length.min())
            if len(wide):
                reach = (most - length.min()) / STEEPER + length.max()
                far, nearest = tree.query(x.T[wide], distance_upper_bound=reach)
                own = np.append(length, most)[nearest]
                grown = own + STEEPER * np.maximum(far - own / 2, 0.0)
                width[wide] = np.minimum(width[wide], grown)
        return width
