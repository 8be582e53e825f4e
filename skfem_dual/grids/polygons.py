"""Ragged polygons as flat arrays; knows no mesh."""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import index

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike, DTypeLike

from ..arguments import checked_indices, checked_points
from ..errors import MeshError
from ..kernels.compiled import inputs, vectorised
from ..kernels.once import ReadOnly, computed_once


def readonly(a: ArrayLike, dtype: DTypeLike | None = None) -> ndarray:
    """A C-contiguous, read-only copy of ``a``, or ``a`` itself if it is one already."""
    if isinstance(a, ndarray) and a.flags.owndata and not a.flags.writeable:  # noqa: SIM102
        if a.flags.c_contiguous and dtype in (None, a.dtype):
            return a
    out = np.array(a, dtype=dtype, order="C")
    out.setflags(write=False)
    return out


def some(indices: ArrayLike) -> str:
    """The first few of ``indices`` as text for messages.

    >>> some(range(3)), some(range(9))
    ('0, 1, 2', '0, 1, 2, 3, 4, ...')
    """
    indices = np.asarray(indices).ravel()
    text = ", ".join(str(i) for i in indices[:5])
    return text + (", ..." if len(indices) > 5 else "")


@dataclass(frozen=True, eq=False, repr=False)
class Polygons(ReadOnly):
    """Simple polygons, counter-clockwise, on shared points.

    Parameters
    ----------
    p : (2, npoints) array of float
        Coordinates of the points.
    indices : (nindices,) array of int
        Points of polygon 0 in counter-clockwise order, then of polygon 1, ...
    offsets : (npolygons + 1,) array of int
        Polygon ``i`` consists of ``indices[offsets[i]:offsets[i + 1]]``.

    Raises
    ------
    TypeError, ValueError
        If something is no array of numbers, or some are masked.
    MeshError
        If the arrays do not fit together or a polygon is not counter-clockwise.

    Examples
    --------
    >>> square = Polygons([[0, 1, 1, 0], [0, 0, 1, 1]], [0, 1, 2, 3], [0, 4])
    >>> float(square.areas[0]), square.centroids[:, 0].tolist()
    (1.0, [0.5, 0.5])
    """

    p: ndarray
    indices: ndarray
    offsets: ndarray

    def __post_init__(self) -> None:
        p = checked_points("p", self.p, error=MeshError)
        indices = checked_indices("indices", self.indices, p.shape[1], error=MeshError)
        ends = checked_indices("offsets", self.offsets, len(indices) + 1, error=MeshError)
        object.__setattr__(self, "p", readonly(p))
        object.__setattr__(self, "indices", readonly(indices, np.int32))
        object.__setattr__(self, "offsets", readonly(ends, np.int32))
        if len(ends) == 0 or ends[0] != 0 or ends[-1] != len(self.indices):
            raise MeshError("expected offsets to run from 0 to the number of indices")
        if np.any(small := np.diff(ends) < 3):
            raise MeshError(
                "expected at least three vertices in every polygon; polygons "
                f"{some(np.nonzero(small)[0])} have fewer"
            )
        # not "<= 0", which NaN would pass
        if np.any(bad := ~(self.areas > 0)):
            raise MeshError(
                "expected counter-clockwise polygons of positive area with finite vertices; "
                f"polygons {some(np.nonzero(bad)[0])} are not"
            )

    @classmethod
    def from_cells(cls, p: ArrayLike, t: ArrayLike) -> "Polygons":
        """Polygons with equally many vertices, from connectivity ``t`` of shape (k, n).

        ``p`` has shape (2, npoints), ``t`` the points of a cell in each column. They run around
        each cell in either sense; clockwise cells are reversed.

        Raises
        ------
        TypeError, ValueError, MeshError
            As the class.
        """
        p = checked_points("p", p, error=MeshError)
        t = checked_indices("t", t, p.shape[1], ("k", "n"), error=MeshError)
        v = p[:, t] - p[:, t[:1]]
        twice = np.sum(v[0] * np.roll(v[1], -1, 0) - v[1] * np.roll(v[0], -1, 0), axis=0)
        return cls(
            p, np.where(twice < 0, t[::-1], t).T.ravel(), np.arange(t.shape[1] + 1) * len(t)
        )

    @classmethod
    def together(cls, parts: Sequence["Polygons"]) -> "Polygons":
        """Those of all parts, one part after the other, which share no points."""
        points = np.cumsum([0, *(part.p.shape[1] for part in parts)])
        corners = np.cumsum([0, *(len(part.indices) for part in parts)])
        return cls(
            np.hstack([part.p for part in parts]),
            np.concatenate([part.indices + first for part, first in zip(parts, points)]),
            np.concatenate(
                [[0], *(part.offsets[1:] + first for part, first in zip(parts, corners))]
            ),
        )

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, i: int) -> ndarray:
        """Vertices of polygon ``i``, shape (2, k); negative numbers count from the last."""
        i, n = index(i), len(self)
        if not -n <= i < n:
            raise IndexError(f"expected a polygon from 0 to {n - 1}, got {i}")
        i %= n
        return self.p[:, self.indices[self.offsets[i] : self.offsets[i + 1]]]

    def __repr__(self) -> str:
        return f"<skfem_dual Polygons object>\n  Number of polygons: {len(self)}"

    @property
    def sizes(self) -> ndarray:
        """Number of vertices of each polygon."""
        return self.offsets[1:] - self.offsets[:-1]

    @property
    def areas(self) -> ndarray:
        """Area of each polygon."""
        return self._moments[0]

    @property
    def centroids(self) -> ndarray:
        """Area centroid of each polygon, shape (2, npolygons)."""
        return self._moments[1]

    @property
    def second_moments(self) -> ndarray:
        """Integrals of x^2, x y and y^2 about the centroid of each polygon, shape (3, n)."""
        out = np.empty((3, len(self)))
        _second_moments(*inputs(self.p, self.indices, self.offsets, self.centroids), out)
        out.setflags(write=False)
        return out

    @computed_once
    def radii(self) -> ndarray:
        """Distance of the farthest vertex of each polygon from its centroid."""
        out = np.empty(len(self))
        _farthest(*inputs(self.p, self.indices, self.offsets, self.centroids), out)
        out.setflags(write=False)
        return out

    @computed_once
    def _moments(self) -> tuple[ndarray, ndarray]:
        """Areas and centroids."""
        areas, centroids = np.empty(len(self)), np.empty((2, len(self)))
        _first_moments(*inputs(self.p, self.indices, self.offsets), areas, centroids)
        for a in (areas, centroids):
            a.setflags(write=False)
        return areas, centroids


@vectorised
def _first_moments(p, indices, offsets, areas, centroids):
    # about the first vertex of each polygon: no cancellation far from the origin
    for k in range(areas.shape[0]):
        first = indices[offsets[k]]
        ox, oy = p[0, first], p[1, first]
        twice, x, y, vx, vy = 0.0, 0.0, 0.0, 0.0, 0.0
        for at in range(offsets[k] + 1, offsets[k + 1]):
            wx, wy = p[0, indices[at]] - ox, p[1, indices[at]] - oy
            cross = vx * wy - vy * wx
            twice += cross
            x += (vx + wx) * cross
            y += (vy + wy) * cross
            vx, vy = wx, wy
        areas[k] = twice / 2
        centroids[0, k], centroids[1, k] = ox + x / (3 * twice), oy + y / (3 * twice)


@vectorised
def _second_moments(p, indices, offsets, centroids, out):
    for k in range(out.shape[1]):
        cx, cy = centroids[0, k], centroids[1, k]
        last = indices[offsets[k + 1] - 1]
        x, y = p[0, last] - cx, p[1, last] - cy
        xx, xy, yy = 0.0, 0.0, 0.0
        for at in range(offsets[k], offsets[k + 1]):
            u, w = p[0, indices[at]] - cx, p[1, indices[at]] - cy
            cross = (x * w - y * u) / 12
            xx += cross * (x * x + x * u + u * u)
            xy += cross * (x * y + u * w + (x * w + u * y) / 2)
            yy += cross * (y * y + y * w + w * w)
            x, y = u, w
        out[0, k], out[1, k], out[2, k] = xx, xy, yy


@vectorised
def _farthest(p, indices, offsets, centres, out):
    for k in range(out.shape[0]):
        square = 0.0
        for at in range(offsets[k], offsets[k + 1]):
            dx, dy = p[0, indices[at]] - centres[0, k], p[1, indices[at]] - centres[1, k]
            square = max(square, dx * dx + dy * dy)
        out[k] = np.sqrt(square)
