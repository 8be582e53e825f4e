"""What a structure resists, and loads that nothing resists, told in words."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, issparse
from skfem import CellBasis, ElementVector

from ..messages import shown
from ..operators.compliance import Compliance, checked_dofs

#: work of the loads on a motion that nothing resists, over that of their parts
BALANCED = 1e-9
#: and below which it is rounding
ROUNDING = 1e-10
#: how far entries in single precision may be off
SINGLE = float(np.finfo(np.float32).eps) / 2
EPS = float(np.finfo(float).eps)
#: decimals of mantissas, and of numbers, to which these may be rounded in files
DIGITS, DECIMALS = range(3, 11), range(1, 7)
NO_BALANCE = (
    "expected loads that pressures under the plan can balance, got some that would take tension: "
    "they pull, or their resultant lies outside of the plan or beyond its outermost cells. "
    "Remedy: move them, hold the structure, D=, or unilateral=False for ground that pulls"
)


def compliance_of(structure: CellBasis, stiffness: Any, D: Any) -> Compliance:
    """Of a structure whose DOFs ``D`` are held.

    Raises
    ------
    TypeError, ValueError
        If the stiffness is no matrix of real numbers, does not fit the structure, is not
        finite, or resists a motion by nothing but rounding of single precision.
    """
    K, n = stiffness, structure.N
    if not (issparse(K) or isinstance(K, np.ndarray)):
        raise TypeError(f"expected a sparse matrix for stiffness, got {shown(K)}")
    if K.shape != (n, n):
        raise ValueError(
            f"expected a stiffness of shape ({n}, {n}) for the {n} DOFs of the structure, "
            f"got {K.shape}. Remedy: assemble it on the basis given, and name DOFs that are "
            "held by D= instead of condensing them"
        )
    if K.dtype.kind not in "biuf":
        raise TypeError(
            f"expected a stiffness of real numbers, got {K.dtype}. Remedy: K.real, if all of it "
            "is real"
        )
    single, whole = K.dtype.kind == "f" and K.dtype.itemsize < 8, K.dtype.kind in "biu"
    K = csc_matrix(K, dtype=float, copy=True)
    K.eliminate_zeros()  # entries that are stored link no DOFs
    bad = np.nonzero(~np.isfinite(K.data))[0]
    if len(bad):
        column = np.searchsorted(K.indptr, bad[0], side="right") - 1
        raise ValueError(
            f"expected a finite stiffness, got K[{K.indices[bad[0]]}, {column}] = "
            f"{K.data[bad[0]]}, {len(bad)} in all"
        )
    yields = Compliance(K, checked_dofs(D, n), structure.doflocs, _kinds(structure))
    errors = csc_matrix((_errors(K.data, single, whole), K.indices, K.indptr), shape=K.shape)
    if moving := yields.resisted_by_rounding(errors):
        raise ValueError(
            "expected a stiffness that resists by more than rounding, got one that resists "
            f"{moving} rigid motions by less, as of single precision or of few digits: as springs "
            "would that take loads from the ground. Remedy: assemble it in double precision and "
            "write it in full, or hold the structure, D="
        )
    return yields


def _of_single_precision(entries: ndarray) -> bool:
    """Whether entries have been rounded to it: they use its last digit, and none after."""
    with np.errstate(over="ignore"):
        rounded = entries.astype(np.float32)
    last = rounded.view(np.int32) & 1
    return bool((rounded == entries).all() and last.sum() > len(last) / 4)


def _errors(entries: ndarray, single: bool, whole: bool) -> ndarray:
    """How far entries may be off: by the precision, digits or decimals in which they stand."""
    size = np.abs(entries)
    if single or _of_single_precision(entries):
        return SINGLE * size
    if whole:
        return np.zeros_like(size)
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        mantissa = np.where(size > 0, size / 10.0 ** np.floor(np.log10(size)), 0.0)
    digits = _places(mantissa, DIGITS) + 1
    # with so many they may be those of single precision, but for the last
    part = max(0.5 * 10.0 ** (1 - digits), SINGLE if 7 <= digits < np.inf else 0.0)
    return np.maximum(part * size, 0.5 * 10.0 ** -_places(size, DECIMALS))


def _places(numbers: ndarray, tried: Iterable[int]) -> float:
    """Decimals that tell all of some numbers; infinite if none of those that are tried do."""
    for decimals in tried:
        scaled = numbers * 10.0**decimals
        if (np.abs(scaled - np.rint(scaled)) <= 4 * EPS * scaled).all():
            return decimals
    return np.inf


def _kinds(structure: CellBasis) -> ndarray:
    """Which of the DOFs at its place each one is, shape (N,)."""
    entities = ("nodal", "edge", "facet", "interior")
    kinds = np.zeros(structure.N, dtype=int)
    rows = [row for entity in entities for row in getattr(structure, f"{entity}_dofs")]
    for number, dofs in enumerate(rows):
        kinds[dofs] = number
    return kinds


def work_on(motions: ndarray, loads: ndarray) -> ndarray:
    """Work of loads on motions (N, m): none where it is rounding, as that of a load above the one
    pile of a raft on its tilts, by which pressures could not be measured."""
    work = motions.T @ loads
    return np.where(np.abs(work) > ROUNDING * (np.abs(motions).T @ np.abs(loads)), work, 0.0)


def require_resisted(
    structure: CellBasis, compliance: Compliance, motions: ndarray, loads: ndarray
) -> None:
    """Refuse loads that do work on motions that neither structure nor ground resists.

    Parameters
    ----------
    structure : CellBasis
        Of N DOFs.
    compliance : Compliance
        Of the structure.
    motions : (N, m) array of float
        Those that nothing resists.
    loads : (N,) array of float
        Forces on the DOFs.

    Raises
    ------
    ValueError
        If they do work on a motion.
    """
    unit = compliance.units
    moved = np.divide(np.abs(motions).T, unit, where=unit > 0, out=np.zeros(motions.T.shape))
    # work is done by some DOFs, rounding by any
    parts = moved.max(axis=1, initial=0.0) * (unit @ np.abs(loads))
    bad = np.nonzero(np.abs(motions.T @ loads) > BALANCED * parts)[0]
    if len(bad) == 0:
        return
    words = _rigid_motions(structure, motions, loads)
    if not words:
        dof = int(np.abs(motions[:, bad[0]]).argmax())
        place = ", ".join(f"{c:.4g}" for c in structure.doflocs[:, dof])
        words = [f"one with its largest displacement in DOF {dof} at ({place})"]
    raise ValueError(
        "expected loads that structure and ground can balance, got loads that do work on "
        f"motions that neither resists: {', '.join(words)}. Remedy: loads without a resultant "
        "along it, or hold a DOF there, D=; smooth ground resists no sliding"
    )


def _rigid_motions(structure: CellBasis, motions: ndarray, loads: ndarray) -> list[str]:
    """Those of a solid on which the loads do work, of the motions given."""
    if structure.mesh.dim() != 3 or not isinstance(structure.elem, ElementVector):
        return []
    x, y = structure.mesh.p[:2].mean(axis=1)
    size = np.ptp(structure.mesh.p[:2], axis=1).max()
    fields = {
        "sliding along x": lambda p: np.stack([1 + 0 * p[0], 0 * p[0], 0 * p[0]]),
        "sliding along y": lambda p: np.stack([0 * p[0], 1 + 0 * p[0], 0 * p[0]]),
        "turning about the vertical": lambda p: np.stack([y - p[1], p[0] - x, 0 * p[0]]) / size,
    }
    span, _ = np.linalg.qr(motions)
    least, words = BALANCED * np.abs(loads).sum(), []
    for name, displacement in fields.items():
        moved = structure.project(displacement)
        free = span @ (span.T @ moved)  # it may be held
        if np.allclose(free, moved, atol=1e-6) and abs(free @ loads) > least:
            words.append(f"{name}, by {free @ loads:.3g}")
    return words
