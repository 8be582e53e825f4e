"""Contact that is found: pressures p >= 0, gaps g >= 0 and p g = 0 in every cell.

Gaps are those of the collocation points, ``g = D p + gap - y @ planes``: settlement of the ground
and shape of the punch, less the motions y of the punch. The motions are unknown as well and the
resultants of the pressures are given in their place.

Two methods find the same answer: a primal-dual active set (Hintermueller, Ito and Kunisch, 2002;
block pivoting of Judice and Pires, 1994, keeps it from cycling), which solves equations between
the cells in contact, and projected conjugate gradients in the manner of Polonsky and Keer (1999),
which only multiply by D.
"""

from dataclasses import replace
from typing import Literal, NamedTuple, Self, get_args

import numpy as np
from numpy import ndarray

from ..arguments import checked_choice, checked_flag, checked_number
from ..errors import ConvergenceError
from ..kernels.progress import progress_bar
from ..operators.factors import Factors, submatrix
from ..operators.guided import Guided, Part
from .cell_forces import CellForces, Step
from .problem import Contact, ContactProblem

#: the largest tolerance of gaps
COARSEST = 1e-2
#: iterations of the conjugate gradients after which to give up
MOST = 1000
#: condition number of a stiffness from which on some motion meets no resistance
FREE = 1e13
#: tilts that cells resist with arms shorter than this, over those of all, are not resisted: they
#: lie in a row, as near as coordinates have digits
ARM = 1e-10
#: parts of what a load does, and of the largest load, that are rounding
TURNED, ROUNDING = 1e-9, 1e-14
#: pressures over the largest that are rounding, as on a cell on which a body rests without a force
NIL = 1e-12
#: why conjugate gradients end before contact is found
TOO_FEW = "so few cells are in contact that the load alone tells their pressures"
#: cells in contact from which on iterations between them are sooner than a factorisation
SOONER = 800

Method = Literal["auto", "active-set", "cg"]


class How(NamedTuple):
    """How contact is found; arguments of `RigidPunch.solve`."""

    unilateral: bool = True
    method: Method = "auto"
    gap_rtol: float = 1e-10

    @classmethod
    def checked(cls, unilateral: bool, method: Method, gap_rtol: float) -> Self:
        """The same, or a TypeError or ValueError."""
        checked_choice("method", method, get_args(Method))
        gap_rtol = checked_number("gap_rtol", gap_rtol, above=0, at_most=COARSEST)
        return cls(checked_flag("unilateral", unilateral), method, gap_rtol)


def active_set(
    problem: ContactProblem, contact: ndarray, most: int = 300, singular: bool = False
) -> Contact:
    """Primal-dual active set for a dense matrix.

    Parameters
    ----------
    problem : ContactProblem
        With an array for its matrix.
    contact : (n,) array of bool
        Cells to begin with.
    most : int
        Iterations after which to give up.
    singular : bool
        Whether a uniform pressure settles nothing, as on periodic ground.
    """
    if singular:
        return _lifted(problem, contact, most)
    D, planes = np.asarray(problem.matrix), problem.planes
    contact = contact.copy()
    pressure, gap, motion = np.zeros(len(D)), problem.gap, np.zeros(len(planes))
    touching = np.zeros(len(D), dtype=bool)
    history: list[float] = []
    fewest, patience, iterate = len(D) + 1, 3, True
    wrong, excess = np.zeros_like(contact), np.zeros(len(D))
    message = f"no convergence in {most} iterations of the active set"
    for _ in range(most):
        inside = np.nonzero(contact)[0]
        pressed = _pressed(problem, inside, pressure[inside] if iterate else None)
        if pressed is None:
            # where a position is imposed bodies may well be without a force
            if wrong.sum() < 2 or not problem.conjugate:
                message = "contact shrank to cells on which the punch can tilt without resistance"
                break
            # too many changed side at once: the half of them that was less wrong goes back
            changed = np.nonzero(wrong)[0]
            back = changed[np.argsort(excess[changed], kind="stable")[: len(changed) // 2]]
            contact[back] ^= True
            wrong[back] = False
            continue
        pressure = np.zeros(len(D))
        pressure[inside], motion, iterate = pressed
        settlement = D @ pressure
        gap = settlement + problem.gap - motion @ planes
        touching = contact.copy()
        least = 1e-13 * np.abs(pressure).max(), 1e-13 * np.abs(settlement).max()
        wrong = np.where(contact, pressure < -least[0], gap < -least[1])
        excess = np.where(contact, -pressure * least[1], -gap * least[0])
        history.append(int(wrong.sum()))
        if not wrong.any():
            pressure = _without_rounding(pressure)
            return Contact(pressure, motion, gap, contact, history=tuple(history))
        # block pivoting: all wrong cells change side as long as they become fewer, else the last
        if history[-1] < fewest:
            fewest, patience = int(history[-1]), 3
        elif patience > 0:
            patience -= 1
        else:
            wrong[: np.nonzero(wrong)[0][-1]] = False
        contact ^= wrong
    return Contact(pressure, motion, gap, touching, False, message, tuple(history))


def _pressed(
    problem: ContactProblem, inside: ndarray, start: ndarray | None
) -> tuple[ndarray, ndarray, bool] | None:
    """Pressures on some cells, by their numbers, and the motions of the punch, and whether
    iterations from ``start`` found them; None if it can tilt on these without resistance."""
    if len(inside) < (1 if problem.conjugate else len(problem.planes)):
        return None
    try:
        if start is not None and (found := _iterated(problem, inside, start)) is not None:
            return *found, True
        return *between(problem, inside), False
    except ConvergenceError:
        return None


def _lifted(problem: ContactProblem, contact: ndarray, most: int) -> Contact:
    """By a matrix with which the forces given settle all cells as if the punch moved farther."""
    matrix = np.asarray(problem.matrix)
    rise = np.abs(matrix).sum(axis=1).max() / np.abs(problem.resultants).sum()
    matrix = matrix + rise * problem.planes.T @ problem.resultants
    found = active_set(replace(problem, matrix=matrix, inverse=None), contact, most)
    return replace(found, motion=found.motion - rise * problem.given)


def between(problem: ContactProblem, inside: ndarray) -> tuple[ndarray, ndarray]:
    """Pressures on some cells, by their numbers, that settle as the punch moves, and its motions;
    by one factorisation for the gap and the motions."""
    matrix = submatrix(np.asarray(problem.matrix), inside, inside)
    rhs = np.column_stack([-problem.gap[inside], problem.planes[:, inside].T])
    unit, acting = Factors.from_matrix(matrix).solve(rhs), problem.resultants[:, inside]
    stiffness, given = acting @ unit[:, 1:], problem.given - acting @ unit[:, 0]
    try:
        motion = solve_scaled(stiffness, given)
    except ConvergenceError:
        if not problem.conjugate:
            raise
        motion = _least_motion(stiffness, given, np.abs(problem.planes).max(axis=1))
    return unit[:, 0] + unit[:, 1:] @ motion, motion


def _least_motion(stiffness: ndarray, given: ndarray, size: ndarray) -> ndarray:
    """The motion under forces given that moves the cells of a punch least, which settle by
    ``size`` by unit motions: in contact along a line it does not turn about it.

    Raises
    ------
    ConvergenceError
        If the forces given turn it.
    """
    size = np.where(size > 0, size, 1.0)
    force = given / size
    resists = stiffness / np.outer(size, size)
    motion = np.linalg.lstsq(resists, force, rcond=1 / FREE)[0]
    felt = TURNED * (np.abs(resists) @ np.abs(motion)) + ROUNDING * np.abs(force).max()
    if (np.abs(resists @ motion - force) > felt).any():
        raise ConvergenceError(
            "the punch can move without resistance on a few cells on one line. Remedy: smaller "
            "cells there"
        )
    return motion / size


def _iterated(
    problem: ContactProblem, inside: ndarray, near: ndarray
) -> tuple[ndarray, ndarray] | None:
    """The same by iterations from pressures ``near``; None if they do not end soon, or there are
    too few cells for them, or no approximate inverse."""
    k, n = len(inside), len(problem.areas)
    if problem.inverse is None or k < SOONER:
        return None
    planes, acting = problem.planes[:, inside], problem.resultants[:, inside]
    matrix = submatrix(np.asarray(problem.matrix), inside, inside)
    guided = Guided.of(matrix, planes, acting, Part(problem.inverse, inside, n))
    motion = solve_scaled(acting @ guided.spread, problem.given - acting @ near)
    pressure = near + guided.spread @ motion
    settled = matrix @ pressure
    rest = motion @ planes - problem.gap[inside] - settled
    found = guided.solve(rest, float(np.linalg.norm(settled)))
    return None if found is None else (pressure + found[:k], motion + found[k:])


def beginning(start: ndarray | None, n: int) -> ndarray:
    """Cells in contact to begin with: those with a pressure, all of them by default."""
    return np.ones(n, dtype=bool) if start is None else start > 0


def conjugate_gradients(
    problem: ContactProblem,
    start: ndarray | None = None,
    gap_rtol: float = 1e-10,
    most: int = MOST,
    progress: bool = False,
) -> Contact:
    """Projected conjugate gradients for any matrix or LinearOperator.

    The unknowns are the forces on the cells, so that the matrix is nearly symmetric. The inverse
    of the problem, between the cells in contact, preconditions it, or else the square roots of
    the areas. In every iteration the motions are those that leave the gaps in contact without a
    resultant, and the step ends on the forces that balance the load and do not pull, the nearest
    ones in the norm of those square roots.

    Parameters
    ----------
    problem : ContactProblem
        The work of the given forces on the motions must be the only work done; see
        `Constraints.conjugate`.
    start : (n,) array of float, optional
        Pressures to begin with, changed to balance the load; none by default.
    gap_rtol : float
        Violation of the conditions on the gap, over the largest settlement, to be reached.
    most : int
        Iterations after which to give up.
    progress : bool
        Whether to show a progress bar.
    """
    forces, areas = CellForces.from_problem(problem), problem.areas
    motion, gap = np.zeros(len(problem.given)), problem.gap
    force = forces.balanced(np.zeros(len(areas)) if start is None else areas * start)
    if force is None:
        return Contact.nowhere(problem, message="the load cannot be balanced")
    settlement = forces.settlement(force)
    before: Step | None = None
    history: list[float] = []
    message = (
        f"no convergence in {most} iterations of the conjugate gradients. Remedy: go on from this "
        "solution, start="
    )
    with progress_bar(progress, "contact", "it") as bar:
        for _ in range(most):
            contact = force > 0
            motion, gap = forces.rigid_motion(settlement, contact)
            history.append(_violation(gap, contact, settlement))
            if progress:
                bar.update()
                bar.set_postfix_str(f"violation {history[-1]:.1e}, {contact.sum()} cells")
            if history[-1] <= gap_rtol:
                pressure = _without_rounding(force / areas)
                return Contact(pressure, motion, gap, contact, history=tuple(history))
            before = forces.descent(gap, contact, before)
            if before.decrease == 0:
                if forces.problem.inverse is None or contact.sum() <= len(motion):
                    message = TOO_FEW
                    break
                # the inverse leads nowhere: on without it, more slowly
                forces, before = CellForces.from_problem(replace(problem, inverse=None)), None
                continue
            product = forces.settlement(before.direction)
            size = (gap @ before.direction) / (before.direction @ product)
            trial = force - size * before.direction
            if (trial >= 0).all():
                force, settlement = trial, settlement - size * product
                continue
            projected = forces.projected(force, settlement, before, size)
            if projected is None:
                message = "the load cannot be balanced"
                break
            force, settlement = projected
    return Contact(force / areas, motion, gap, force > 0, False, message, tuple(history))


def _without_rounding(pressure: ndarray) -> ndarray:
    return np.where(pressure > NIL * pressure.max(initial=0.0), pressure, 0.0)


def _violation(gap: ndarray, contact: ndarray, settlement: ndarray) -> float:
    """Largest distance in contact or overlap elsewhere, over the largest settlement."""
    wrong = np.where(contact, np.abs(gap), -gap).max()
    largest = max(np.abs(settlement).max(), wrong)
    return float(wrong / largest) if largest > 0 else 0.0


def solve_scaled(stiffness: ndarray, given: ndarray) -> ndarray:
    """Motions under forces given, of shape (m,) or (m, k), from the stiffness of a punch.

    Raises
    ------
    ConvergenceError
        If it can move without resistance.
    """
    if len(given) == 0:
        return np.zeros(given.shape)
    rows = np.abs(stiffness).max(axis=1)
    fixed = np.isfinite(stiffness).all() and rows.min() > ARM * rows.max()
    if fixed:
        left, sizes, right = np.linalg.svd(stiffness / rows[:, None])
        fixed = sizes[0] <= FREE * sizes[-1]
    if not fixed:
        raise ConvergenceError(
            "the punch can move without resistance; likely cause: a plan of a few cells on one "
            "line, cells on top of each other, or a load or origin extremely far away. Remedy: "
            "use at least three cells that do not lie on one line, or impose tilt=(0, 0)"
        )
    return right.T @ ((left.T @ (given.T / rows).T).T / sizes).T
