"""Equations with a large dense matrix for pressures and the motions of a punch, by iterations.

Pressures settle their points as motions do and have given resultants. In each iteration the
approximate inverse of the matrix tells pressures, and motions that leave them without resultant:
so one search leads to both, where the matrix alone has one for each motion, too.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy import ndarray

from .dense_solver import ROUNDING
from .factors import FewColumns
from .iterative import Product, solve_many

#: iterations after which factors are sooner made: where contact is scattered
MOST = 24


@dataclass(frozen=True, eq=False)
class Guided:
    """Settlements of k points by pressures on their cells, less those by m motions.

    Attributes
    ----------
    matrix : (k, k) array of float
        Settlement of each point under unit pressure on each cell.
    planes : (m, k) array of float
        By unit motions.
    inverse : Balanced
        An approximate inverse.
    """

    matrix: ndarray
    planes: ndarray
    inverse: "Balanced"

    @classmethod
    def of(cls, matrix: ndarray, planes: ndarray, acting: ndarray, inverse: Product) -> Self:
        """By an approximate ``inverse`` of the matrix; ``acting`` are resultants of unit
        pressures, (m, k)."""
        spread = np.array([inverse @ plane for plane in planes]).reshape(planes.shape)
        return cls(matrix, planes, Balanced(inverse, acting, spread.T))

    @property
    def spread(self) -> ndarray:
        """About the pressures by unit motions, shape (k, m)."""
        return self.inverse.spread

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of points, and of pressures and motions."""
        return len(self.matrix), len(self.matrix) + len(self.planes)

    def __matmul__(self, q: ndarray) -> ndarray:
        """Of pressures and motions (k + m, c)."""
        pressures, motions = np.split(q, [len(self.matrix)])
        return FewColumns(self.matrix) @ pressures - self.planes.T @ motions

    def solve(self, rest: ndarray, size: float) -> ndarray | None:
        """Pressures without resultant and motions that do so much, (k,) to (k + m,), to rounding
        errors of settlements of a ``size``; None where iterations do not end soon."""
        norm = float(np.linalg.norm(rest))
        if norm <= ROUNDING * size:
            return np.zeros(self.shape[1])
        rtol = min(ROUNDING * max(size / norm, 1.0), 0.5)
        found = solve_many(self, rest[:, None], rtol, preconditioner=self.inverse, most=MOST)
        return found.solution[:, 0] if found.success else None


@dataclass(frozen=True, eq=False)
class Balanced:
    """An approximate inverse of `Guided`, whose pressures have no resultants.

    Attributes
    ----------
    inverse : Product
        That of the matrix.
    acting : (m, k) array of float
        Resultants of unit pressures.
    spread : (k, m) array of float
        About the pressures by unit motions.
    """

    inverse: Product
    acting: ndarray
    spread: ndarray

    def __matmul__(self, w: ndarray) -> ndarray:
        """Pressures and motions (k + m, c) for settlements (k, c)."""
        pressure = self.inverse @ w
        motion = -np.linalg.solve(self.acting @ self.spread, self.acting @ pressure)
        return np.concatenate([pressure + self.spread @ motion, motion])


@dataclass(frozen=True, eq=False)
class Part:
    """An approximate inverse of a matrix of n rows, between some of its rows and columns.

    Attributes
    ----------
    inverse : Product
        That of all.
    cells : (k,) array of int
        Numbers of rows and columns.
    n : int
        How many there are in all.
    """

    inverse: Product
    cells: ndarray
    n: int

    def __matmul__(self, w: ndarray) -> ndarray:
        """Approximate pressures under settlements ``w`` of shape (k,) or (k, c)."""
        whole = np.zeros((self.n, *w.shape[1:]))
        whole[self.cells] = w
        return (self.inverse @ whole)[self.cells]
