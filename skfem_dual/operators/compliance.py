"""What a structure yields under loads: a generalised inverse of its stiffness, and its motions.

A free structure moves without resistance: its stiffness K is singular, and solved by a symmetric
generalised inverse, see `Split`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, diags

from ..arguments import checked_indices
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .semidefinite import Split, whole_work

#: eigenvalues that may be zero are up to so many times what rigid motions of the whole leave, or
#: rounding
NOISE, EPS = 16, float(np.finfo(float).eps)
#: work of rigid motions, over that of entries, that is exact; forces over what the rounding of a
#: row makes them at most, as motions are sums of such of kinds
EXACT, ROWS = 1e-12, 4.0
#: shapes on which the stiffness does less work, over that of its entries, are rigid motions
RIGID = 1e-8
#: and up to so many times the largest of a matrix that is decomposed to rounding
SMALL = 1e-12
#: shapes are motions that the factors found, if so much of them is in their span
SAME = 0.999
#: entries may differ from those of the transpose by so many times the diagonal
ASYMMETRY = 1e-9


@dataclass(frozen=True, eq=False)
class Compliance:
    """Displacements of a structure under loads.

    Parameters
    ----------
    stiffness : (N, N) csc_matrix
        Symmetric and positive semidefinite, whatever the units of its DOFs.
    fixed : (k,) array of int
        DOFs that are held.
    places : (dim, N) array of float, optional
        Where the DOFs are: those of one node, in the same place, are eliminated together. NaN of
        bubbles, as in scikit-fem.
    kinds : (N,) array of int, optional
        Which value or derivative there each DOF is, from 0.

    Raises
    ------
    ValueError
        If the stiffness is not symmetric, is negative, or a DOF that is not held has none.
    """

    stiffness: csc_matrix
    fixed: ndarray
    places: ndarray | None = None
    kinds: ndarray | None = None

    def __post_init__(self) -> None:
        K, d = self.stiffness, self.stiffness.diagonal()
        free = self._free
        bad = free[~(d[free] > 0)]
        if len(bad):
            raise ValueError(
                f"expected a positive stiffness of every DOF, got {d[bad[0]]:g} of DOF "
                f"{bad[0]}, {len(bad)} in all. Remedy: hold DOFs without stiffness, D="
            )
        scale = np.zeros(len(d))
        scale[free] = 1 / np.sqrt(d[free])
        off = diags(scale) @ (K - K.T) @ diags(scale)
        if off.nnz and np.abs(off.data).max() > ASYMMETRY:
            i, j = (int(k[np.abs(off.data).argmax()]) for k in off.nonzero())
            raise asymmetric(K, i, j)
        self._inverse  # noqa: B018 - a stiffness that is not positive is refused now

    @computed_once
    def _free(self) -> ndarray:
        free = np.ones(self.stiffness.shape[0], dtype=bool)
        free[self.fixed] = False
        return np.nonzero(free)[0]

    @computed_once
    def _scaled(self) -> tuple[csc_matrix, ndarray]:
        """Stiffness of the free DOFs with a diagonal of ones, and their units."""
        K = self.stiffness[self._free][:, self._free]
        unit = 1 / np.sqrt(K.diagonal())
        return (diags(unit) @ (K + K.T) @ diags(unit) / 2).tocsc(), unit

    @computed_once
    def _inverse(self) -> Split:
        n = len(self._free)
        node = np.arange(n)
        if self.places is not None:
            x = self.places[:, self._free]
            placed = np.nonzero(np.isfinite(x).all(axis=0))[0]  # others, as bubbles, are alone
            found = np.unique(x[:, placed], axis=1, return_inverse=True)[1].reshape(len(placed))
            node[placed] = n + found
        return Split.from_matrix(self._scaled[0], node, self._rounding)

    @computed_once
    def units(self) -> ndarray:
        """Displacement of each DOF by which it has an energy of 1/2; zero of those held."""
        out = np.zeros(self.stiffness.shape[0])
        out[self._free] = self._scaled[1]
        return readonly(out)

    @computed_once
    def motions(self) -> ndarray:
        """Displacements without resistance, a basis of them, shape (N, m)."""
        unit, null = self._scaled[1], self._inverse.null
        if null.shape[1]:
            # factors tell them to the digits that the softest bending leaves, shapes to all
            known = self._known(self._rounding if np.isfinite(self._rounding) else 0.0)
            # not those that springs resist: work of a few is little beside that of all entries
            span = np.linalg.qr(null)[0]
            known = known[:, np.linalg.norm(span.T @ known, axis=0) > SAME]
            others = np.linalg.svd(null - known @ (known.T @ null), full_matrices=False)[0]
            null = np.hstack([known, others])[:, : null.shape[1]]
        out = np.zeros((self.stiffness.shape[0], null.shape[1]))
        out[self._free] = unit[:, None] * null
        size = np.abs(out).max(axis=0, initial=0.0)
        return readonly(out / np.where(size > 0, size, 1.0))

    def _known(self, rounding: float) -> ndarray:
        """Sums of linear shapes, on which the stiffness does no more than so much of the work of
        its entries, in units of the free DOFs and orthonormal, (n, k)."""
        matrix, unit = self._scaled
        moved, work, whole = _by_work(matrix, self._shapes[self._free] / unit[:, None])
        return moved[:, work <= rounding * whole]

    def resisted_by_rounding(self, errors: csc_matrix) -> int:
        """Number of rigid motions that resist by what the stiffness of all DOFs is off where
        nothing is held; ``errors`` tell how far its entries may be.

        That is seen where DOFs of a kind all move alike, which strains nothing that is soft:
        forces are in every row as small as such errors make them, as those of springs on some
        DOFs are not.
        """
        if self.places is None or not errors.data.any():
            return 0
        alike = self._shapes[:, :: 1 + len(self.places)]
        matrix, moved, work, whole = self._worked(alike)
        share, forces = np.abs(work) / whole, ROWS * (self._in_units(errors) @ np.abs(moved))
        off = (share > EXACT) & (np.abs(matrix @ moved) <= forces).all(axis=0)
        if not off.any():
            return 0
        matrix, unit = self._scaled
        _, work, whole = _by_work(matrix, self._shapes[self._free] / unit[:, None])
        most = NOISE * share[off].max()
        return int(np.count_nonzero((work > EXACT * whole) & (work <= most * whole)))

    @computed_once
    def _rounding(self) -> float:
        """Work of the stiffness that is none, over that of its entries: of rigid motions of the
        whole, held DOFs too; any if shapes tell no such motion."""
        if self.places is None:
            return SMALL
        _, _, work, whole = self._worked(self._shapes)
        left = np.abs(work) / whole
        return NOISE * max(EPS, *left[left < RIGID]) if (left < RIGID).any() else np.inf

    def _worked(self, shapes: ndarray) -> tuple[csc_matrix, ndarray, ndarray, ndarray]:
        """The stiffness of all DOFs, held ones too, with a diagonal of ones, and `_by_work`."""
        matrix, d = self._in_units(self.stiffness), self.stiffness.diagonal()
        return matrix, *_by_work(matrix, (shapes * np.sqrt(d)[:, None])[d > 0])

    def _in_units(self, matrix: csc_matrix) -> csc_matrix:
        """A matrix of the DOFs that have a stiffness, in units in which its diagonal is one."""
        d = self.stiffness.diagonal()
        some = np.nonzero(d > 0)[0]
        root = diags(1 / np.sqrt(d[some]))
        return (root @ matrix[some][:, some] @ root).tocsc()

    @property
    def _shapes(self) -> ndarray:
        """Displacements in which DOFs of one kind are one or a coordinate and all others zero,
        (N, k). Rigid motions are sums of such, where derivatives are along the axes, without
        DOFs that have no place, as bubbles."""
        if self.places is None or self.kinds is None:
            return np.empty((self.stiffness.shape[0], 0))
        placed = np.isfinite(self.places).all(axis=0)
        x = self.places - self.places[:, placed].mean(axis=1, keepdims=True)
        x = np.where(placed, x / max(np.abs(x[:, placed]).max(), EPS), 0.0)
        linear, kinds = np.vstack([placed, x]), np.unique(self.kinds[placed])
        return np.vstack([linear * (self.kinds == kind) for kind in kinds]).T

    def displacements(self, loads: ndarray) -> ndarray:
        """Displacements under loads of shape (N,) or (N, k), zero where the structure is held.

        Of a free structure up to its motions, and under loads that are balanced; what is not
        is balanced by forces on some of its DOFs.
        """
        unit = self._scaled[1].reshape(-1, *(1,) * (loads.ndim - 1))
        out = np.zeros(loads.shape)
        out[self._free] = unit * self._inverse.solve(unit * loads[self._free])
        return out


@dataclass(frozen=True, eq=False)
class BalancedCompliance:
    """Displacements of a structure whose loads the ground balances, not single DOFs of it.

    Forces on single DOFs of a solid that weak springs keep from sliding push it far aside, and
    rounding is what is left of its deflections. With ``P = 1 - B (Z' B)^-1 Z'`` its compliance is
    ``P' C P``.

    Attributes
    ----------
    structure : Compliance
        C, of N DOFs.
    motions : (N, m) array of float
        Z, without resistance.
    bearing : (N, m) array of float
        B, loads that can balance those that do work on the motions.
    """

    structure: Compliance
    motions: ndarray
    bearing: ndarray

    def displacements(self, loads: ndarray) -> ndarray:
        """Displacements under loads of shape (N,) or (N, k), on which the bearing does no work."""
        Z, B = self.motions, self.bearing
        work = Z.T @ B
        moved = self.structure.displacements(loads - B @ np.linalg.solve(work, Z.T @ loads))
        return moved - Z @ np.linalg.solve(work.T, B.T @ moved)


@dataclass(frozen=True, eq=False)
class Structures:
    """Structures that are not connected, their DOFs one after the other."""

    parts: tuple[BalancedCompliance, ...]

    def displacements(self, loads: ndarray) -> ndarray:
        """As of `BalancedCompliance`, of all of them."""
        ends = np.cumsum([len(part.motions) for part in self.parts])[:-1]
        own = np.split(loads, ends) if self.parts else []
        moved = [part.displacements(f) for part, f in zip(self.parts, own, strict=True)]
        return np.concatenate(moved) if moved else np.zeros(loads.shape)


def asymmetric(K: Any, i: int, j: int) -> ValueError:
    """What is wrong with a stiffness that differs from its transpose there."""
    return ValueError(
        f"expected a symmetric stiffness, got K[{i}, {j}] = {K[i, j]:g} and "
        f"K[{j}, {i}] = {K[j, i]:g}. Remedy: the matrix as assembled, DOFs that are held by D= "
        "instead of enforce, or K + K.T less the diagonal if one triangle is stored"
    )


def checked_dofs(D: Any, n: int) -> ndarray:
    """DOFs out of n, in any form that scikit-fem's `condense` takes.

    Raises
    ------
    TypeError, ValueError
        If they are no integers, or out of range.
    """
    if D is None:
        return np.empty(0, dtype=int)
    if isinstance(D, dict):
        return np.unique(np.hstack([checked_dofs(part, n) for part in (None, *D.values())]))
    if not isinstance(D, np.ndarray) and hasattr(D, "flatten"):
        D = D.flatten()
    return np.unique(checked_indices("D", D, n, each="place"))


def _by_work(matrix: csc_matrix, shapes: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """Orthonormal sums of shapes, by the work that the matrix does on them; that and `_whole`."""
    span, _ = np.linalg.qr(shapes)
    work, vectors = np.linalg.eigh(span.T @ (matrix @ span))
    moved = span @ vectors
    return moved, work, whole_work(matrix, moved)
