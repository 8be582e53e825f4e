"""Distance to lines, in one picture or in many."""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..kernels.compiled import inputs, vectorised

#: segments whose distance is looked at, and up to how many in a picture all of them are
NEAREST, FEW = 8, 256
#: squares of distances that differ by so much of them are the same
TIED = 1e-12


class Segments(NamedTuple):
    """Segments of lines in k pictures.

    Attributes
    ----------
    begin, end : (2, m) array of float
        Their ends, which differ; those of a picture one after the other.
    starts : (k + 1,) array of int
        First ones of the pictures.
    """

    begin: ndarray
    end: ndarray
    starts: ndarray

    @classmethod
    def from_ends(cls, begin: ndarray, end: ndarray, picture: ndarray, k: int) -> Self:
        """Of k pictures, ascending; segments without length are left out."""
        real = np.hypot(*(end - begin)) > 0
        starts = np.searchsorted(picture[real], np.arange(k + 1))
        return cls(begin[:, real], end[:, real], starts)

    @property
    def picture(self) -> ndarray:
        """That of each, (m,)."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    def signed_distance(self, x: ndarray, of: ndarray | None = None) -> ndarray:
        """Distance of points of shape (2, n) to the nearest line, positive to its left.

        ``of`` are their pictures, all the first by default; infinite where that has no lines. Of
        many segments those with the nearest middles are looked at: lines are finer than they are
        far.
        """
        of = np.zeros(x.shape[1], dtype=int) if of is None else of.astype(int)
        out, near = np.empty(x.shape[1]), np.empty((x.shape[1], 0), dtype=np.int64)
        if len(self.starts) == 2 and self.begin.shape[1] > FEW:
            near = cKDTree((self.begin + self.end).T / 2).query(x.T, NEAREST)[1]
        along = self.end - self.begin
        _signed(*inputs(x, of, self.starts, self.begin, along, near), out)
        return out


@vectorised
def _signed(x, of, starts, a, along, near, out):
    """Distances to the segments ``near`` each point, (m, k); to all of them where k is zero."""
    k = near.shape[1]
    inverse = 1 / (along[0] ** 2 + along[1] ** 2)
    square = np.empty(max(k, a.shape[1]))
    for i in range(x.shape[1]):
        first, last = (0, k) if k else (starts[of[i]], starts[of[i] + 1])
        x0, y0, least = x[0, i], x[1, i], np.inf
        for at in range(first, last):
            j = near[i, at] if k else at
            dx, dy, lx, ly = x0 - a[0, j], y0 - a[1, j], along[0, j], along[1, j]
            s = min(max((lx * dx + ly * dy) * inverse[j], 0.0), 1.0)
            dx, dy = dx - s * lx, dy - s * ly
            square[at] = dx * dx + dy * dy
            least = min(least, square[at])
        # where two segments meet, the bisector of the angle between them tells the side
        side = 0.0
        for at in range(first, last):
            if square[at] <= (1 + TIED) * least:
                j = near[i, at] if k else at
                dx, dy = x0 - a[0, j], y0 - a[1, j]
                side += (along[0, j] * dy - along[1, j] * dx) * np.sqrt(inverse[j])
        out[i] = np.copysign(np.sqrt(least), side)
