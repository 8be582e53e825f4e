"""Matrices with the symmetry of a plan: assembled and solved in independent blocks.

Allgower, Boehmer, Georg and Miranda, Exploiting symmetry in boundary element methods, SIAM J.
Numer. Anal. 29 (1992) 534; the vectors are those of `representations`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy import ndarray
from numpy.typing import DTypeLike
from scipy.linalg import svdvals

from ..kernels.limits import limited_threads
from ..kernels.once import computed_once
from .factors import Factors
from .symmetry import Symmetry

#: rows of a full matrix that are in the memory at a time
BATCH = 512


@dataclass(frozen=True, eq=False)
class SymmetricMatrix:
    """A real matrix with the symmetry of a plan, by the ``blocks`` of the components.

    ``matrix @ q`` is the product, ``np.asarray(matrix)`` the full matrix.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> basis = DualMesh.from_mesh(MeshTri.init_circle(4)).basis()
    >>> punch = RigidPunch(HalfSpace(1.0, 0.0), basis)
    >>> x = punch.collocation_points
    >>> symmetry = Symmetry.detect(punch.partition, x, punch.weights)
    >>> matrix = SymmetricMatrix.from_rows(symmetry, lambda i: punch.influence(x[:, i].copy()))
    >>> pressure = matrix.factors.solve(np.ones(545))  # under unit settlement
    >>> f"{pressure @ punch.partition.areas:.2f}"  # exact for the circle: 2
    '2.00'
    """

    symmetry: Symmetry
    blocks: tuple[ndarray, ...]

    @classmethod
    def from_rows(
        cls, symmetry: Symmetry, rows: Callable[[ndarray], ndarray]
    ) -> "SymmetricMatrix":
        """From ``rows(i)``, the rows with the numbers ``i`` of the full matrix, (len(i), n).

        They are asked for one cell of every orbit, `BATCH` at a time.
        """
        parts, cells = symmetry.components, symmetry.representatives
        blocks = tuple(np.empty((len(part), len(part)), part.shares.dtype) for part in parts)
        for start in range(0, len(cells), BATCH):
            orbits = slice(start, min(start + BATCH, len(cells)))
            of_orbits = rows(cells[orbits])
            for part, block in zip(parts, blocks):
                part.fill(block, orbits, of_orbits)
        return cls(symmetry, blocks)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the full matrix."""
        return len(self.symmetry), len(self.symmetry)

    def __matmul__(self, q: ndarray) -> ndarray:
        return self.symmetry.apply([block.__matmul__ for block in self.blocks], q)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> ndarray:
        cells, full = self.symmetry.representatives, np.empty(self.shape)
        rows = np.zeros((len(cells), len(full)))
        for part, block in zip(self.symmetry.components, self.blocks):
            for basis in part.bases:
                rows += part.real(basis[cells] @ (basis.conj() @ block.T).T)
        for motion in self.symmetry.permutations:
            full[np.ix_(motion[cells], motion)] = rows
        return np.asarray(full, dtype=dtype)

    @computed_once
    def condition_number(self) -> float:
        """Condition number in the 2-norm: the blocks have the singular values of the matrix."""
        values = np.concatenate([svdvals(block) for block in self.blocks])
        return float(values.max() / values.min())

    @computed_once
    def factors(self) -> "SymmetricFactors":
        """Factors of the blocks."""
        # threads of BLAS stand in each other's way on small blocks
        with limited_threads(1, "blas"):
            return SymmetricFactors(self.symmetry, tuple(map(Factors.from_matrix, self.blocks)))


@dataclass(frozen=True, eq=False)
class SymmetricFactors:
    """Factors of a matrix with the symmetry of a plan, of each block."""

    symmetry: Symmetry
    factors: tuple[Factors, ...]

    def solve(self, rhs: ndarray, trans: int = 0) -> ndarray:
        """Solutions for any right-hand sides, (n,) or (n, k); of the transposed matrix with 1."""
        solvers = [partial(block.solve, trans=2 * trans) for block in self.factors]
        return self.symmetry.apply(solvers, rhs)

    def __matmul__(self, rhs: ndarray) -> ndarray:
        return self.solve(rhs)
