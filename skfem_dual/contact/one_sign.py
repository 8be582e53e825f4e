"""Pressures that are nowhere negative, inside the cells too.

Slopes inside the cells follow from the cells around. Where contact ends these have no pressure,
and a slope would make that of the cell negative in a part of it: such a cell stays flat. So the
equations are solved with all slopes, then without those that turn the sign, until none is left.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy import ndarray

from ..grids.polygons import readonly
from .problem import Contact

#: solutions after which all cells are flat
MOST = 5
#: cases that are looked at together
TOGETHER = 16


class Flattening(Protocol):
    """Cells of which some may be flat, see `LoadedCells`."""

    def __len__(self) -> int: ...

    def turning(self, pressure: ndarray, /) -> ndarray: ...


Answer = tuple[Contact, ndarray]
Solve = Callable[[ndarray, ndarray | None], Answer]
SolveEach = Callable[[list[int], ndarray, ndarray], list[Answer]]


def solved(
    cells: Flattening, solve: Solve, unilateral: bool, start: ndarray | None = None
) -> Answer:
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
    """
    # infinite loads are refused by whoever solves
    with np.errstate(over="ignore", invalid="ignore"):
        found = solve(np.zeros(len(cells), dtype=bool), start)
        if not unilateral:
            return found
        return solved_each(cells, [found], lambda _, flat, starts: [solve(flat[0], starts[0])])[0]


def solved_each(cells: Flattening, found: Sequence[Answer], solve: SolveEach) -> list[Answer]:
    """The same in several cases, from what was found with all slopes.

    Parameters
    ----------
    cells : Flattening
        The n cells.
    found : sequence of Contact and (m,) array of float
        With no cell flat.
    solve : callable
        Contact and positions in the cases with some numbers, for cells of which some are flat,
        (k, n) array of bool, from pressures (k, n).
    """
    answers, history = list(found), [contact.history for contact, _ in found]
    flat = np.zeros((len(answers), len(cells)), dtype=bool)
    some = np.arange(len(answers))
    for number in range(1, MOST):
        some = some[[answers[i][0].success for i in some]]
        pressure = np.array([answers[i][0].pressure for i in some]).reshape(-1, len(cells))
        turning = [
            cells.turning(pressure[k : k + TOGETHER].T).T for k in range(0, len(some), TOGETHER)
        ]
        turns = np.concatenate([flat[:0], *turning]) & ~flat[some]
        left = turns.any(axis=1)
        some = some[left]
        if not len(some):
            break
        flat[some] |= turns[left] if number < MOST - 1 else True
        new = solve(some.tolist(), flat[some], pressure[left])
        for i, answer in zip(some.tolist(), new, strict=True):
            answers[i], history[i] = answer, history[i] + answer[0].history
    return [
        (replace(contact, history=own, flat=readonly(cut) if cut.any() else None), position)
        for (contact, position), own, cut in zip(answers, history, flat, strict=True)
    ]
