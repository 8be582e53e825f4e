"""Force and moments of scikit-fem fields, put right by the least change."""

from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, LinearForm

from ..errors import ConvergenceError

#: parts of a resultant that rounding leaves
LEFT = 1e-9
#: points that lie so wide, over how long they lie, are in a line
LINE = 1e-6
#: how often values below zero are left out
TRIALS = 30


def field_resultant(basis: CellBasis, values: ndarray, origin: ArrayLike = (0.0, 0.0)) -> ndarray:
    """Integrals of a field, and of it times x and y from an origin, shape (3,)."""
    return _integrals(basis, np.asarray(origin, dtype=float)) @ values


def _integrals(basis: CellBasis, origin: ndarray) -> ndarray:
    def arm(w: Any) -> list:
        return [1.0, w.x[0] - origin[0], w.x[1] - origin[1]]

    return np.stack(
        [LinearForm(lambda v, w, k=k: v * arm(w)[k]).assemble(basis) for k in range(3)]
    )


def balanced(
    basis: CellBasis,
    values: ndarray,
    resultant: ndarray,
    origin: ArrayLike,
    part: ndarray | None = None,
) -> ndarray:
    """The field nearest to one given that has a force and first moments.

    The change is least in the sum of squares of the changes over the values they change, and so
    a linear function times the field: what is zero stays so. A field without negative values gets
    none.

    Parameters
    ----------
    basis : CellBasis
        Of a scalar field.
    values : (N,) array of float
        Its vector.
    resultant : (3,) array of float
        Integrals of the field and of it times x and y, from ``origin``.
    origin : pair of float
        The point the moments refer to.
    part : (N,) array of bool, optional
        Which values may change, unless too few of them are not zero, or those in a line.

    Raises
    ------
    ConvergenceError
        If what does not vanish of it, and may change, cannot carry them, or only with negative
        values in a field without.
    """
    # about the middle: far from the origin moments hide what is left of the force
    centre = basis.mesh.p.mean(axis=1)
    resultant = np.array(resultant, dtype=float)
    resultant[1:] -= resultant[0] * (centre - np.asarray(origin, dtype=float))
    integrals = _integrals(basis, centre)
    size = np.ptp(basis.mesh.p, axis=1).max()
    scale = np.array([1.0, size, size])
    x = basis.doflocs - centre[:, None]
    planes = np.vstack([np.ones(x.shape[1]), x / size])

    def nearest(given: ndarray) -> ndarray | None:
        missing = (resultant - integrals @ given) / scale
        if not missing.any():
            return given.copy()
        free = np.abs(given)
        if part is not None and can_balance(basis.doflocs, part & (given != 0)):
            free = np.where(part, free, 0.0)
        shares = planes * free
        matrix = integrals @ shares.T / scale[:, None]
        factor = np.linalg.lstsq(matrix, missing, rcond=None)[0]
        left = np.abs(matrix @ factor - missing).max()
        pressed = np.abs(integrals[0]) @ np.abs(given)  # without a resultant it is the measure
        measure = max(pressed, np.abs(resultant / scale).max())
        return given + factor @ shares if left <= LEFT * measure else None

    found, pressed = nearest(values), bool((values >= 0).all())
    for _ in range(TRIALS if pressed else 0):
        if found is None or (found >= 0).all():
            break
        found = nearest(found.clip(0.0))  # what would pull is left out
    if found is None or (pressed and found.min() < -LEFT * found.max()):
        raise ConvergenceError(
            "too few nodes have pressures that could carry force and moments without tension. "
            "Remedy: smaller cells where contact is; or pressure_field with a larger refine, "
            "nodal_pressure with conserve=False"
        )
    return found


def can_balance(x: ndarray, part: ndarray, wide: float = 0.05) -> bool:
    """Whether some of the points ``x`` are at least three and far from lying in a line, by how
    ``wide`` they lie over how long."""
    if np.count_nonzero(part) < 3:
        return False
    arm = x[:, part] - x[:, part].mean(axis=1, keepdims=True)
    widths = np.linalg.svd(arm, compute_uv=False)
    return bool(widths[1] > wide * widths[0])


def resist(x: ndarray, touching: ndarray) -> bool:
    """Whether cells in contact resist tilts: not if they are few or their points lie in a line."""
    return can_balance(x, touching, LINE)
