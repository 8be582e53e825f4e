"""Positions of bodies under what is imposed on them, by how they move under forces."""

import numpy as np
from numpy import ndarray

from ..operators.small_compliance import generalised_inverse
from .load import Constraints

#: a frame so many times as stiff as the ground leaves it no digits in their sum
STIFF = 1e5


def position_under(
    constraints: Constraints, unit: ndarray, compliance: ndarray, shift: ndarray
) -> ndarray:
    """Motions of unit size under what is imposed.

    Parameters
    ----------
    constraints : Constraints
        What is imposed on the m components of the position.
    unit : (m,) array of float
        Largest settlements by motions of unit size.
    compliance : (m, m) array of float
        Motions of unit size by forces on them.
    shift : (m,) array of float
        Motions of unit size without a force.

    Returns
    -------
    (m,) array of float
    """
    stiffness = np.linalg.inv(compliance)
    motions, fixed = unit[:, None] * constraints.motions, unit * constraints.fixed
    balance, pushed = constraints.balance * unit, stiffness @ shift
    if constraints.frame is not None:
        frame = constraints.frame / np.outer(unit, unit)
        if np.abs(frame).max() > STIFF * np.abs(stiffness).max():
            return _under_stiff_frame(constraints, unit, stiffness, shift)
        stiffness = stiffness + frame
    given = constraints.given - balance @ (stiffness @ fixed - pushed)
    # in numbers near one, whatever the unit of length
    rows, columns = np.abs(balance).max(axis=1), np.abs(motions).max(axis=0)
    balance, motions = balance / rows[:, None], motions / columns
    y = np.linalg.solve(balance @ stiffness @ motions, given / rows)
    return fixed + motions @ y


def _under_stiff_frame(
    constraints: Constraints, unit: ndarray, stiffness: ndarray, shift: ndarray
) -> ndarray:
    """Motions of unit size under the load and a frame that is far stiffer than the ground, whose
    stiffness they resist with forces on such motions.

    By what both yield: in the sum of both stiffnesses the digits of that of the ground would be
    lost.
    """
    motions = unit[:, None] * constraints.motions
    resists = motions.T @ stiffness @ motions
    ground = np.linalg.inv(resists)
    moved = -ground @ (motions.T @ stiffness @ (unit * constraints.fixed - shift))
    frame = constraints.motions.T @ constraints.frame @ constraints.motions
    yields, free = generalised_inverse(frame, resists.diagonal())
    loads = constraints.given - constraints.motions.T @ (constraints.frame @ constraints.fixed)
    size = np.sqrt(ground.diagonal())  # of motions under unit forces: equations without units
    both = (ground + yields.displacements(np.eye(len(loads)))) / np.outer(size, size)
    free = free / size[:, None]
    free = free / np.linalg.norm(free, axis=0)
    n, m = free.shape
    matrix = np.block([[both, -free], [free.T, np.zeros((m, m))]])
    given = (yields.displacements(loads) - moved) / size
    forces = np.linalg.solve(matrix, np.append(given, free.T @ (loads * size)))[:n] / size
    return unit * (constraints.fixed + constraints.motions @ (ground @ forces + moved))
