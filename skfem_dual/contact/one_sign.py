"""Pressures that are nowhere negative, inside the cells too.

Slopes inside the cells follow from the cells around. Where contact ends these have no pressure,
and a slope would make that of the cell negative in a part of it: such a cell stays flat. So the
equations are solved with all slopes, then without those that turn the sign, until none is left.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy import ndarray

from .footprint import LoadedCells
from .problem import Contact

#: solutions after which all cells are flat
MOST = 5

Solve = Callable[[ndarray, ndarray | None], tuple[Contact, ndarray]]


def solved(
    cells: LoadedCells, start: ndarray | None, solve: Solve, unilateral: bool
) -> tuple[ndarray, Contact, ndarray]:
    """Contact whose pressures are nowhere negative, unless the ground may pull.

    Parameters
    ----------
    cells : LoadedCells
        The n cells.
    start : (n,) array of float or None
        Pressures to begin with.
    solve : callable
        Contact and position for cells of which some are flat, (n,) array of bool, from pressures
        to begin with.
    unilateral : bool
        Whether the ground does not pull.

    Returns
    -------
    (n,) array of bool
        The cells that are flat in it.
    contact : Contact
    position : (m,) array of float
    """
    flat = np.zeros(len(cells), dtype=bool)
    history: tuple[float, ...] = ()
    for number in range(MOST):
        contact, position = solve(flat, start)
        history += contact.history
        if not (unilateral and contact.success):
            break
        turning = cells.flattened(flat).turning(contact.pressure)
        if not turning.any():
            break
        flat = flat | turning if number < MOST - 2 else np.ones_like(flat)
        start = contact.pressure
    return flat, replace(contact, history=history), position
