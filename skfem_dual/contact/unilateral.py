"""Contact that is found: pressures p >= 0, gaps g >= 0 and p g = 0 in every cell.

Gaps are those of the collocation points, ``g = D p + gap - y @ planes``: settlement of the ground
and shape of the punch, less the motions y of the punch. The motions are unknown as well and the
resultants of the pressures are given in their place.

Two methods find the same answer: a primal-dual active set (Hintermueller, Ito and Kunisch, 2002;
block pivoting of Judice and Pires, 1994, keeps it from cycling), which solves equations between
the cells in contact, and projected conjugate gradients in the manner of Polonsky and Keer (1999),
which only multiply by D.
"""

from dataclasses import dataclass
from math import prod
from typing import NamedTuple, cast

import numpy as np
from numpy import ndarray
from scipy.linalg.lapack import dgesv
from tqdm import tqdm

from ..arguments import checked_number
from ..errors import ConvergenceError
from ..kernels.compiled import inputs, vectorised
from ..kernels.once import computed_once
from .problem import Contact, ContactProblem, Product

#: the largest tolerance of gaps
COARSEST = 1e-2
#: iterations of the conjugate gradients after which to give up
MOST = 1000
#: few equations are told apart from singular ones by the determinant over the diagonal
CLEAR = 1e-8
#: forces that are summed up one after the other
TOGETHER = 1024


def active_set(problem: ContactProblem, contact: ndarray, most: int = 100) -> Contact:
    """Primal-dual active set for a dense matrix.

    Parameters
    ----------
    problem : ContactProblem
        With an array for its matrix.
    contact : (n,) array of bool
        Cells to begin with.
    most : int
        Iterations after which to give up.
    """
    D, planes = np.asarray(problem.matrix), problem.planes
    contact = contact.copy()
    pressure, gap, motion = np.zeros(len(D)), problem.gap, np.zeros(len(planes))
    touching = np.zeros(len(D), dtype=bool)
    history: list[float] = []
    fewest, patience = len(D) + 1, 3
    message = f"no convergence in {most} iterations of the active set"
    for _ in range(most):
        if contact.sum() < len(planes):
            message = "contact shrank to fewer cells than the motions of the punch"
            break
        inside = np.nonzero(contact)[0]
        # one factorisation for the gap and the motions
        rhs = np.column_stack([-problem.gap[inside], planes[:, inside].T])
        unit = np.linalg.solve(D[np.ix_(inside, inside)], rhs)
        acting = problem.resultants[:, inside]
        try:
            motion = solve_scaled(acting @ unit[:, 1:], problem.given - acting @ unit[:, 0])
        except ConvergenceError:
            message = "contact shrank to cells on which the punch can tilt without resistance"
            break
        pressure = np.zeros(len(D))
        pressure[inside] = unit[:, 0] + unit[:, 1:] @ motion
        settlement = D @ pressure
        gap = settlement + problem.gap - motion @ planes
        touching = contact.copy()
        tiny = 1e-13 * np.abs(pressure).max(), 1e-13 * np.abs(settlement).max()
        wrong = np.where(contact, pressure < -tiny[0], gap < -tiny[1])
        history.append(int(wrong.sum()))
        if not wrong.any():
            return Contact(pressure.clip(0), motion, gap, contact, history=tuple(history))
        # block pivoting: all wrong cells change side as long as they become fewer, else the last
        if history[-1] < fewest:
            fewest, patience = int(history[-1]), 3
        elif patience > 0:
            patience -= 1
        else:
            wrong[: np.nonzero(wrong)[0][-1]] = False
        contact ^= wrong
    return Contact(pressure, motion, gap, touching, False, message, tuple(history))


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

    Raises
    ------
    ValueError
        If ``gap_rtol`` is not positive and up to 0.01.
    """
    gap_rtol = checked_number("gap_rtol", gap_rtol, above=0, at_most=COARSEST)
    forces, areas = CellForces.from_problem(problem), problem.areas
    motion, gap = np.zeros(len(problem.given)), problem.gap
    force = forces.balanced(np.zeros(len(areas)) if start is None else areas * start)
    if force is None:
        nothing = np.zeros(len(areas))
        return Contact(nothing, motion, gap, nothing > 0, False, "the load cannot be balanced")
    settlement = forces.settlement(force)
    before: Step | None = None
    history: list[float] = []
    message = f"no convergence in {most} iterations of the conjugate gradients"
    with tqdm(total=None, desc="contact", unit="it", disable=not progress) as bar:
        for _ in range(most):
            contact = force > 0
            motion, gap = forces.rigid_motion(settlement, contact)
            history.append(_violation(gap, contact, settlement))
            bar.update()
            bar.set_postfix_str(f"violation {history[-1]:.1e}, {contact.sum()} cells")
            if history[-1] <= gap_rtol:
                return Contact(force / areas, motion, gap, contact, history=tuple(history))
            before = forces.descent(gap, contact, before)
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


class Step(NamedTuple):
    """Where one iteration goes: direction, the cells it changes, gaps and decrease there."""

    direction: ndarray
    working: ndarray
    gap: ndarray
    decrease: float


@dataclass(frozen=True, eq=False)
class CellForces:
    """A problem in the forces on its cells, with the steps of conjugate gradients between them.

    Attributes
    ----------
    problem : ContactProblem
        The problem.
    acting : (k, n) array of float
        Resultants of unit forces on the cells.
    scale : (n,) array of float
        Forces by unit settlements but for a factor, as a diagonal matrix has it.
    """

    problem: ContactProblem
    acting: ndarray
    scale: ndarray

    @classmethod
    def from_problem(cls, problem: ContactProblem) -> "CellForces":
        """With the square roots of the areas for the scale."""
        return cls(problem, problem.resultants / problem.areas, np.sqrt(problem.areas))

    @computed_once
    def sides(self) -> ndarray:
        """Resultants of forces as large as the scale, shape (k, n)."""
        return self.acting * self.scale

    @computed_once
    def _all(self) -> ndarray:
        """Resultants of what multipliers press on all cells, (k, k)."""
        return self.sides @ self.acting.T

    @computed_once
    def _spread(self) -> ndarray:
        """Areas over what makes the inverse as large as the scale, in one cell."""
        one, middle = np.zeros(len(self.scale)), len(self.scale) // 2
        one[middle] = 1.0
        force = self.problem.areas * (cast(Product, self.problem.inverse) @ one)
        return self.problem.areas * (self.scale[middle] / force[middle])

    def settlement(self, force: ndarray) -> ndarray:
        """Of the collocation points under forces on the cells."""
        return self.problem.matrix @ (force / self.problem.areas)

    def rigid_motion(self, settlement: ndarray, contact: ndarray) -> tuple[ndarray, ndarray]:
        """Motions that leave the gaps in contact without a resultant, and the gaps they leave."""
        gap, planes = settlement + self.problem.gap, self.problem.planes
        sides = np.where(contact, self.sides, 0.0)
        # of cells that cannot tell some motion, the least one
        motion = _least(sides @ planes.T, sides @ gap)
        gap -= motion @ planes
        return motion, gap

    def descent(self, gap: ndarray, contact: ndarray, before: Step | None) -> Step:
        """The next direction, conjugate to the one before while no cell comes back.

        Cells that were let go and overlap the punch come back.
        """
        overlap = ~contact & (gap < 0)
        working = contact | overlap
        slope = self.without_resultant(self.scale * gap, working)
        if (inverse := self.problem.inverse) is not None:
            # between projections on both sides it is as symmetric as it is alone
            pressed = self._spread * (inverse @ (slope / self.scale))
            slope = self.without_resultant(pressed, working)
        direction = slope
        if before is not None and not overlap.any():
            beta = max(0.0, slope @ (gap - before.gap) / before.decrease)
            direction = self.without_resultant(slope + beta * before.direction, working)
        return Step(direction, working, gap, float(gap @ slope))

    def projected(
        self, force: ndarray, settlement: ndarray, step: Step, size: float
    ) -> tuple[ndarray, ndarray] | None:
        """Forces that do not pull at the end of a step, and their settlements.

        The step is halved until the energy decreases. None if the load cannot be balanced there.
        """
        # cells beyond the working set stay behind, however the balance shifts forces
        direction = np.where(step.working, step.direction, self.scale * step.gap)
        pressed = None
        for _ in range(20):
            pressed = self.balanced(force - size * direction)
            if pressed is not None:
                settled, change = self.settlement(pressed), pressed - force
                # energy as seen from here; the matrix is not quite symmetric, so it has no
                # energy of its own
                if change @ (step.gap + (settled - settlement) / 2) <= 0:
                    break
            size /= 2
        return None if pressed is None else (pressed, settled)

    def without_resultant(self, force: ndarray, working: ndarray) -> ndarray:
        """``force`` on the working cells, changed so that it has no resultant."""
        sides, out = np.where(working, self.sides, 0.0), np.where(working, force, 0.0)
        out -= _least(sides @ self.acting.T, self.acting @ out) @ sides
        return out

    def balanced(self, force: ndarray) -> ndarray | None:
        """The forces nearest to ``force`` that do not pull and have the given resultants.

        They are ``max(force + scale * (mu @ acting), 0)``; the few multipliers mu maximise a
        concave function, by Newton's method. None if there are no such forces.
        """
        scale, given = self.scale, self.problem.given
        known = inputs(force, self.acting, self.sides)

        def dual(mu: ndarray, pressed: ndarray) -> float:
            return 0.5 * np.sum(pressed**2 / scale) - mu @ given

        mu = np.zeros(len(given))
        pressed, felt, borne, stiffness = _pressed(*known, mu)
        for _ in range(200):
            error = felt - given
            size = np.abs(given).max(initial=0.0) + borne.max(initial=0.0)
            if (off := np.abs(error).max(initial=0.0)) <= 1e-14 * size:
                break
            # from nothing on all cells are pressed on; a little of them always: those that are may
            # be too few to balance anything
            free = stiffness if pressed.any() else self._all
            step = _least(free + 1e-8 * self._all, error)
            for _ in range(40 if off > 1e-12 * size else 1):  # rounding is not searched
                trial = _pressed(*known, mu - step)
                nearer = np.abs(trial[1] - given).max() < off
                if nearer or dual(mu - step, trial[0]) < dual(mu, pressed):
                    break
                step = step / 2
            else:
                break  # as near as rounding lets
            mu = mu - step
            pressed, felt, borne, stiffness = trial
        return pressed if np.abs(felt - given).max(initial=0.0) <= 1e-12 * size else None


@vectorised
def _pressed(
    force: ndarray, acting: ndarray, sides: ndarray, mu: ndarray
) -> tuple[ndarray, ndarray, ndarray, ndarray]:
    """Forces ``max(force + mu @ sides, 0)`` on the cells, and sums over them.

    Their resultants, the same of the sizes of ``acting``, and what multipliers add to resultants
    on the cells pressed on, (k, k). Sums of some cells at a time: one after the other, millions
    of forces would lose four digits.
    """
    k, n = acting.shape
    pressed, felt, borne, stiffness = np.empty(n), np.zeros(k), np.zeros(k), np.zeros((k, k))
    for first in range(0, n, TOGETHER):
        own = pressed[first : first + TOGETHER]
        own[:] = force[first : first + TOGETHER]
        for a in range(k):
            side, m = sides[a][first : first + TOGETHER], mu[a]
            for j in range(own.shape[0]):
                own[j] += m * side[j]
        for j in range(own.shape[0]):
            own[j] = max(own[j], 0.0)
        for a in range(k):
            arm, total, size = acting[a][first : first + TOGETHER], 0.0, 0.0
            for j in range(own.shape[0]):
                total += arm[j] * own[j]
                size += abs(arm[j]) * own[j]
            felt[a] += total
            borne[a] += size
            for b in range(a + 1):
                side, total = sides[b][first : first + TOGETHER], 0.0
                for j in range(own.shape[0]):
                    total += arm[j] * side[j] if own[j] > 0 else 0.0
                stiffness[a, b] += total
    for a in range(k):
        for b in range(a):
            stiffness[b, a] = stiffness[a, b]
    return pressed, felt, borne, stiffness


def _violation(gap: ndarray, contact: ndarray, settlement: ndarray) -> float:
    """Largest distance in contact or overlap elsewhere, over the largest settlement."""
    wrong = np.where(contact, np.abs(gap), -gap).max()
    largest = max(np.abs(settlement).max(), wrong)
    return float(wrong / largest) if largest > 0 else 0.0


def _least(matrix: ndarray, rhs: ndarray) -> ndarray:
    """Solution of a few equations, the least one where they do not tell it."""
    if len(rhs) == 0:
        return rhs
    # a third of the time of numpy's, which copies and checks
    factors, _, solution, failed = dgesv(matrix, rhs)
    pivots, diagonal = (prod(a.diagonal().tolist()) for a in (factors, matrix))
    if not failed and abs(pivots) > CLEAR * diagonal:
        return solution
    return np.linalg.pinv(matrix) @ rhs


def solve_scaled(stiffness: ndarray, given: ndarray) -> ndarray:
    """Motions under forces given, of shape (m,) or (m, k), from the stiffness of a punch.

    Raises
    ------
    ConvergenceError
        If it can move without resistance.
    """
    if len(given) == 0:
        return np.zeros(given.shape)
    rows = np.abs(stiffness).max(axis=1, keepdims=True)
    if (
        not np.isfinite(stiffness).all()
        or not rows.all()
        or np.linalg.cond(stiffness / rows) > 1e13
    ):
        raise ConvergenceError(
            "the punch can move without resistance; likely cause: a plan of a few cells on one "
            "line, cells on top of each other, or a load or origin extremely far away. Remedy: "
            "use at least three cells that do not lie on one line"
        )
    return np.linalg.solve(stiffness / rows, (given.T / rows[:, 0]).T)
