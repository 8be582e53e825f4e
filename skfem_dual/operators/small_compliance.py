"""What a structure of few DOFs yields, as a frame: a generalised inverse, and its motions.

One decomposition tells both, see `compliance` for those that are factorised.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from .compliance import ASYMMETRY, SMALL, asymmetric
from .semidefinite import NULL, negative


@dataclass(frozen=True, eq=False)
class SmallCompliance:
    """Displacements of a structure of few DOFs, as a frame.

    Attributes
    ----------
    matrix : (N, N) array of float
        A generalised inverse of its stiffness.
    """

    matrix: ndarray

    def displacements(self, loads: ndarray) -> ndarray:
        """Displacements under loads of shape (N,) or (N, k), as of `Compliance`."""
        return self.matrix @ loads


def generalised_inverse(stiffness: ndarray, beside: ndarray) -> tuple[SmallCompliance, ndarray]:
    """Generalised inverse of a small stiffness, and the motions that it does not resist.

    Parameters
    ----------
    stiffness : (N, N) array of float
    beside : (N,) array of float
        About how stiff something else is against the same displacements: what is nothing beside
        it, as of a hinge that rounding has turned a little, is none.

    Raises
    ------
    ValueError
        If it is not symmetric and positive semidefinite.
    """
    n = len(stiffness)
    some, loose = (np.nonzero(stiffness.any(axis=1) == stiff)[0] for stiff in (True, False))
    d = stiffness.diagonal()
    # signs are those of the structure by itself, but for what is nothing in it
    unit = 1 / np.sqrt(np.maximum(d, SMALL * (d / beside).max(initial=0.0) * beside)[some])
    scaled = unit[:, None] * stiffness[np.ix_(some, some)] * unit
    off = np.abs(scaled - scaled.T)
    if off.max(initial=0.0) > ASYMMETRY:
        raise asymmetric(stiffness, *some[list(np.unravel_index(off.argmax(), off.shape))])
    values, vectors = np.linalg.eigh((scaled + scaled.T) / 2)
    if len(values) and values[0] < -NULL * np.abs(values).max():
        raise negative(values[0], some[np.abs(vectors[:, 0]).argmax()])
    unit = 1 / np.sqrt(np.maximum(d, beside)[some])
    values, vectors = np.linalg.eigh(unit[:, None] * stiffness[np.ix_(some, some)] * unit)
    none = values <= SMALL * max(np.abs(values).max(initial=0.0), 1.0)
    rows = unit[:, None] * vectors
    motions = np.zeros((n, np.count_nonzero(none) + len(loose)))
    motions[some, : motions.shape[1] - len(loose)] = rows[:, none]
    motions[loose, motions.shape[1] - len(loose) :] = np.eye(len(loose))
    matrix = np.zeros((n, n))
    matrix[np.ix_(some, some)] = rows[:, ~none] / values[~none] @ rows[:, ~none].T
    return SmallCompliance(matrix), motions / np.abs(motions).max(axis=0, initial=0.0)
