"""Pressures that are nowhere negative, inside the cells too.

Slopes inside the cells follow from the cells around. Where contact ends these have no pressure,
and a slope would make that of the cell negative in a part of it: such a cell stays flat. So the
equations are solved with all slopes, then without those that turn the sign, until none is left.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, Self

import numpy as np
from numpy import ndarray

from ..errors import ConvergenceError
from ..grids.polygons import readonly
from .load import Constraints
from .problem import Contact
from .system import ContactSystem, Method

#: solutions after which all cells are flat
MOST = 5


class Flattening(Protocol):
    """Cells of which some may be flat, see `LoadedCells`."""

    def __len__(self) -> int: ...

    def flattened(self, flat: ndarray, /) -> Self: ...

    def turning(self, pressure: ndarray, /) -> ndarray: ...


Solve = Callable[[ndarray, ndarray | None], tuple[Contact, ndarray]]


def contact_of(
    system: ContactSystem,
    constraints: Constraints,
    unilateral: bool,
    method: Method,
    start: ndarray | None,
    gap_rtol: float,
) -> tuple[Contact, ndarray]:
    """Contact and position under one set of loads.

    Raises
    ------
    ConvergenceError
        If the loads are too large for floating-point numbers, or as the system.
    """
    if unilateral:
        contact, position = system.unilateral(constraints, method, start, gap_rtol)
    else:
        contact, position = system.bilateral(constraints)
    if not (np.isfinite(contact.pressure).all() and np.isfinite(position).all()):
        raise ConvergenceError("the loads are too large for floating-point numbers")
    return contact, position


def solved(
    cells: Flattening,
    solve: Solve,
    unilateral: bool,
    start: ndarray | None = None,
    found: tuple[Contact, ndarray] | None = None,
) -> tuple[Contact, ndarray]:
    """Contact whose pressures are nowhere negative, unless the ground may pull, and position.

    Parameters
    ----------
    cells : Flattening
        The n cells.
    solve : callable
        Contact and position for cells of which some are flat, (n,) array of bool, from pressures
        to begin with.
    unilateral : bool
        Whether the ground does not pull.
    start : (n,) array of float, optional
        Pressures to begin with.
    found : Contact and (m,) array of float, optional
        What `solve` answers where no cell is flat, if that is known.
    """
    flat = np.zeros(len(cells), dtype=bool)
    history: tuple[float, ...] = ()
    for number in range(MOST):
        contact, position = found or solve(flat, start)
        found = None
        history += contact.history
        if not (unilateral and contact.success):
            break
        turning = cells.flattened(flat).turning(contact.pressure)
        if not turning.any():
            break
        flat = flat | turning if number < MOST - 2 else np.ones_like(flat)
        start = contact.pressure
    known = readonly(flat) if flat.any() else None
    return replace(contact, history=history, flat=known), position
