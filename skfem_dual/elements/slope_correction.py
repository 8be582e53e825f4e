"""What slopes of the pressure inside the cells add to the settlements under their means.

As of `EdgeCorrection` it is a sparse near correction, exact but for the strips of weighted cells,
and the dipoles of all cells, whose moments are the second moments of the law of the edge times
the slopes. What the influence function has beyond c / r takes the dipoles alone.

Source: D. R. Wilton et al., Potential integrals for uniform and linear source distributions on
polygonal and polyhedral domains, IEEE Trans. Antennas Propag. 32 (1984).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, csr_matrix, eye

from ..ground.substrates import Substrate
from ..kernels.compiled import inputs
from ..kernels.once import ReadOnly
from ..kernels.threads import Threads
from .cell_dipoles import (
    ROWS,
    Circles,
    Fall,
    add_diagonal,
    add_near_dipoles,
    add_sloped_near,
    add_sloped_rows,
    put_dipoles,
    put_field,
)
from .near_slopes import NearSlopes
from .near_sums import NearSums
from .remainder import Add, add_by_rows
from .slopes import Slopes

#: with more cells the fields of less than so many rows are found of so many at a time, which takes
#: less room
FEW = 2**14
#: points nearer to a cell's centroid than so many of its radii take the exact correction; no
#: point of a regular mesh is just there
EXACT_RADII = 2.53
#: nanoseconds that the dipole of a cell takes, about
CELL = 4


@dataclass(frozen=True, eq=False)
class SlopeCorrection(ReadOnly):
    """Settlements under ``w / mean(w) g . (x - y)`` on each cell, of `Slopes`.

    Attributes
    ----------
    x : (2, m) array of float
        Field points.
    centroids : (2, n) array of float
        Centroids of the cells, where their dipoles are.
    areas : (n,) array of float
        Areas of the cells.
    near : NearSlopes
        Under unit slopes near the cells, less their dipoles.
    second_moments : (2, 2, n) array of float
        As of `Slopes`: dipoles over slopes.
    fall : Fall
        How dipoles act.
    """

    x: ndarray
    centroids: ndarray
    areas: ndarray
    near: NearSlopes
    second_moments: ndarray
    fall: Fall

    @classmethod
    def from_slopes(cls, slopes: Slopes, substrate: Substrate, x: ndarray) -> Self:
        """At points ``x``."""
        every = np.arange(len(slopes.partition))
        near = NearSums.from_cells(slopes.partition, slopes.weights, every, EXACT_RADII, x)
        return cls.from_sums(slopes, substrate, x, [near])

    @classmethod
    def from_sums(
        cls,
        slopes: Slopes,
        substrate: Substrate,
        x: ndarray,
        sums: Iterable[NearSums],
        dtype: type = float,
    ) -> Self:
        """The same by what is known near all cells, some at a time, kept as ``dtype``."""
        partition, c = slopes.partition, substrate.singular_coefficient
        near = NearSlopes.from_sums(slopes, x.shape[1], c, sums, dtype)
        fall, moments = Fall.from_substrate(substrate), slopes.second_moments
        return cls(x, partition.centroids, partition.areas, near, moments, fall)

    def diagonal(self, slopes: Slopes) -> ndarray:
        """Of the matrix of `add_to`, where the points are those of the cells; shape (n,)."""
        out = np.zeros(len(self.areas))
        (x, moments), circles = inputs(self.x, self.second_moments), self._circles
        columns = _arrays(slopes.columns)
        add_diagonal(x, circles, self.fall, moments, self.near, columns, out)
        return out

    def at(self, i: ndarray) -> Self:
        """At the points with the numbers ``i`` only."""
        return replace(self, x=np.ascontiguousarray(self.x[:, i]), near=self.near.at(i))

    def dipoles(self, slopes: ndarray, order: ndarray | None = None) -> ndarray:
        """Those of slopes, both of shape (s, 2, n), of the cells in an ``order``."""
        order = np.arange(slopes.shape[2]) if order is None else order
        out = np.empty_like(slopes)
        put_dipoles(*inputs(self.second_moments, slopes, order), out)
        return out

    @property
    def _circles(self) -> Circles:
        return Circles.of(self.centroids, self.areas)

    def apply(self, slopes: ndarray) -> ndarray:
        """Settlements under slopes of shape (2, n) or (2, n, k), of shape (m,) or (m, k)."""
        columns = slopes.reshape(2 * len(self.areas), -1)
        each = np.ascontiguousarray(columns.T).reshape(-1, 2, len(self.areas))
        dipoles = self.dipoles(each)
        some = np.nonzero(dipoles.any(axis=(0, 1)))[0].astype(np.int32)
        x, dipoles, some, ends = inputs(self.x, dipoles, some, np.array([0, len(some)]))
        out, circles = np.zeros((len(each), self.x.shape[1])), self._circles
        self.near.add_product(each, out)

        def work(k: slice) -> None:
            (rows,) = inputs(np.array([[k.start], [k.stop]]))
            add_near_dipoles(0, 1, x, rows, ends, some, circles, self.fall, dipoles, out)

        with Threads() as run:
            run(work, self.x.shape[1], CELL * len(self.areas))
        return out.T.reshape(-1, *slopes.shape[2:])

    def add_to(self, matrix: ndarray, slopes: Slopes, sign: float = 1.0) -> None:
        """Add ``sign`` times what ``slopes`` make of mean pressures to a dense (m, n) matrix."""
        add_by_rows(self.adding(slopes, sign), matrix, CELL * len(self.areas))

    def adding(self, slopes: Slopes, sign: float = 1.0) -> Add:
        """What does so to a block of some rows."""
        if self.x.shape[1] > ROWS or len(self.areas) <= FEW:
            return self._adding(slopes.matrix, slopes.columns, sign)
        (x, moments), circles = inputs(self.x, self.second_moments), self._circles

        def add(rows: slice, block: ndarray) -> None:
            for first in range(0, len(self.areas), FEW):
                count = min(FEW, len(self.areas) - first)
                fields = np.empty((rows.stop - rows.start, 2, count))
                for i, field in zip(range(rows.start, rows.stop), fields, strict=True):
                    put_field(i, x, circles, self.fall, moments, self.near, first, field)
                slopes.add_transposed(sign * fields, block, first)

        return add

    def to_dense(self) -> ndarray:
        """Settlements under unit slopes along x of all cells, then along y; shape (m, 2 n)."""
        n = len(self.areas)
        along = [np.zeros((self.x.shape[1], n)) for _ in range(2)]
        for axis, matrix in enumerate(along):
            self.add(matrix, eye(2 * n, n, -n * axis, format="csr"))
        return np.hstack(along)

    def add(self, matrix: ndarray, slopes: csr_matrix) -> None:
        """Add what slopes of shape (2 n, k) make of k mean pressures to an (m, k) matrix."""
        add_by_rows(self._adding(slopes, slopes.tocsc()), matrix, CELL * len(self.areas))

    def _adding(self, slopes: csr_matrix, by_columns: csc_matrix, sign: float = 1.0) -> Add:
        """What does so to a block of some rows."""
        (x, moments), circles = inputs(self.x, self.second_moments), self._circles
        rows, columns = _arrays(slopes, sign), _arrays(by_columns, sign)
        (sloped,) = inputs(np.diff(slopes.indptr).reshape(2, -1).any(axis=0))

        def add(k: slice, block: ndarray) -> None:
            add_sloped_rows(x, k.start, circles, self.fall, moments, sloped, columns, block)
            add_sloped_near(k.start, self.near, rows, block)

        return add


def _arrays(matrix: csr_matrix | csc_matrix, factor: float = 1.0) -> tuple[ndarray, ...]:
    """Starts, numbers and values, times a factor, of its rows or columns."""
    return inputs(matrix.indptr, matrix.indices, factor * matrix.data)
