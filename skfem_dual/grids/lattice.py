"""Cells that are rectangles of one size in the places of a regular grid."""

from dataclasses import dataclass
from functools import reduce
from typing import Self

import numpy as np
from numpy import ndarray

from ..kernels.once import ReadOnly, computed_once
from .planar import cross
from .polygons import Polygons, readonly

#: vertices may be off their places by so many times the sides of a cell
OFF = 1e-10
#: places of the grid for each cell, at most: with more of them empty it is of no use
PLACES = 8
#: rounding of coordinates over the sides beyond which there is no grid to speak of
BLURRED = 1e-5


@dataclass(frozen=True, eq=False)
class Lattice(ReadOnly):
    """Places of cells in a regular grid along the axes.

    Attributes
    ----------
    shape : tuple of int
        Places along x and along y, (nx, ny).
    spacing : tuple of float
        Sides of a cell, (dx, dy).
    places : (n,) array of int
        Place of each cell: ``i * ny + j`` if it is the i-th along x and the j-th along y.
    blur : float
        How far rounding of coordinates may move vertices off their places, over a side.

    Examples
    --------
    >>> from skfem import MeshQuad
    >>> mesh = MeshQuad.init_tensor([0.0, 1.0, 2.0], [0.0, 0.5, 1.0, 1.5]).restrict([0, 1, 3, 5])
    >>> lattice = Lattice.detect(Polygons.from_cells(mesh.p, mesh.t))
    >>> lattice.shape, lattice.spacing, lattice.places.tolist()
    ((2, 3), (1.0, 0.5), [0, 1, 3, 5])
    """

    shape: tuple[int, int]
    spacing: tuple[float, float]
    places: ndarray
    blur: float

    def __len__(self) -> int:
        return len(self.places)

    @classmethod
    def detect(cls, polygons: Polygons) -> Self | None:
        """The lattice of some cells; None if they have none.

        Rectangles along the axes, all of one size, each in a place of its own, some places may
        be empty. Vertices may be off by 1e-10 of the sides, and by rounding far from the origin,
        as long as that is less than 1e-5 of a side.
        """
        n = len(polygons)
        if n == 0 or not (polygons.sizes == 4).all():
            return None
        return cls.of(polygons.p[:, polygons.indices].reshape(2, n, 4))

    @classmethod
    def of(cls, corners: ndarray) -> Self | None:
        """The same of quadrilaterals by their corners in either sense, shape (2, n, 4)."""
        n = corners.shape[1]
        low, high = (reduce(f, np.moveaxis(corners, 2, 0)) for f in (np.minimum, np.maximum))
        sides = high - low
        middle = (low + high) / 2
        first = middle.min(axis=1, keepdims=True)
        step = sides.mean(axis=1, keepdims=True)
        rounding = 8 * np.finfo(float).eps * np.abs(corners).max()
        off = OFF * step + rounding
        if (np.abs(sides - step) > off).any() or (rounding > BLURRED * step).any():
            return None
        at = np.rint((middle - first) / step)
        most = at.max(axis=1, keepdims=True)
        # over many cells their mean distance is known better than that of a single one
        step = np.where(most > 0, (middle.max(axis=1, keepdims=True) - first) / most.clip(1), step)
        on_place = np.abs(first + at * step - middle) <= off
        on_corner = np.minimum(corners - low[..., None], high[..., None] - corners)
        nx, ny = (int(m) + 1 for m in most[:, 0])
        if not on_place.all() or (on_corner > off[..., None]).any() or nx * ny > PLACES * n:
            return None
        places = (at[0] * ny + at[1]).astype(np.int64)
        # four vertices in the corners of a rectangle whose area they enclose
        one, other = (corners[..., k + 2] - corners[..., k] for k in range(2))
        areas = np.abs(cross(one, other)) / 2
        whole = np.abs(areas - step.prod()) <= 4 * (off * step[::-1]).sum()
        if not whole.all() or np.bincount(places).max() > 1:
            return None
        spacing = float(step[0, 0]), float(step[1, 0])
        return cls((nx, ny), spacing, readonly(places), float(rounding / min(spacing)))

    @computed_once
    def full(self) -> bool:
        """Whether all places are taken, by the cells in the order of the places."""
        nx, ny = self.shape
        return len(self) == nx * ny and bool((np.diff(self.places) == 1).all())
