"""Forces on cells as the unknowns of contact: the steps of conjugate gradients between them.

They do not pull and balance the load; motions of the punch leave gaps without a resultant.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import prod
from operator import truediv
from typing import NamedTuple, cast

import numpy as np
from numpy import ndarray
from scipy.linalg.lapack import dgesv

from ..kernels.compiled import inputs, vectorised
from ..kernels.once import computed_once
from ..operators.iterative import Product
from .problem import ContactProblem

#: few equations are told apart from singular ones by the determinant over the diagonal
CLEAR = 1e-8
#: squares of arms, over those of all cells, that are rounding: of cells in a row
NIL = 1e-16
#: decreases of so much of that without resultants to keep are rounding: they are a tenth and more
ROUNDING = 1e-16
#: parts of forces that are rounding where those with a resultant are taken away
SPENT = 1e-13
#: forces that are summed up one after the other
TOGETHER = 1024


class Step(NamedTuple):
    """Where one iteration goes: direction, the cells it changes, gaps and decrease there, zero
    where the few cells in contact leave no direction but rounding."""

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
        without_resultant = self.projection(working)
        apart = np.where(working, self.scale * gap, 0.0)
        slope = without_resultant(apart)
        if (inverse := self.problem.inverse) is not None:
            # between projections on both sides it is as symmetric as it is alone
            slope = without_resultant(self._spread * (inverse @ (slope / self.scale)))
        direction = slope
        if before is not None and not overlap.any():
            beta = max(0.0, slope @ (gap - before.gap) / before.decrease)
            direction = without_resultant(slope + beta * before.direction)
        decrease, whole = float(gap @ slope), float(gap @ apart)
        return Step(direction, working, gap, decrease if decrease > ROUNDING * whole else 0.0)

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

    def projection(self, working: ndarray) -> Callable[[ndarray], ndarray]:
        """What leaves forces on the working cells, changed so that they have no resultant."""
        sides = np.where(working, self.sides, 0.0)
        stiffness = sides @ self.acting.T

        def project(force: ndarray) -> ndarray:
            out = np.where(working, force, 0.0)
            least = SPENT * np.abs(out)
            out -= _least(stiffness, self.acting @ out) @ sides
            out[np.abs(out) <= least] = 0.0  # on few cells of a body all forces have resultants
            return out

        return project

    def balanced(self, force: ndarray) -> ndarray | None:
        """The forces nearest to ``force`` that do not pull and have the given resultants.

        They are ``max(force + scale * (mu @ acting), 0)``; the few multipliers mu maximise a
        concave function, by Newton's method. None if there are no such forces.
        """
        mu, pressed = self._multipliers(force)
        if pressed is None:  # far larger than those given they leave rounding of themselves
            _, pressed = self._multipliers(force + mu @ self.sides)
        return pressed

    def _multipliers(self, force: ndarray) -> tuple[ndarray, ndarray | None]:
        """The multipliers, and the forces if they have the given resultants."""
        scale, given = self.scale, self.problem.given
        known = inputs(force, self.acting, self.sides)

        def dual(mu: ndarray, pressed: ndarray) -> float:
            return 0.5 * np.sum(pressed**2 / scale) - mu @ given

        mu = np.zeros(len(given))
        pressed, felt, borne, stiffness = _pressed(*known, mu)
        for _ in range(200):
            error = felt - given
            size = _largest(given) + _largest(borne)
            if (off := _largest(error)) <= 1e-14 * size:
                break
            # from nothing on all cells are pressed on; a little of them always: those that are may
            # be too few to balance anything
            free = stiffness if pressed.any() else self._all
            step = _least(free + 1e-8 * self._all, error)
            for _ in range(40 if off > 1e-12 * size else 1):  # rounding is not searched
                trial = _pressed(*known, mu - step)
                nearer = _largest(trial[1] - given) < off
                if nearer or dual(mu - step, trial[0]) < dual(mu, pressed):
                    break
                step = step / 2
            else:
                break  # as near as rounding lets
            mu = mu - step
            pressed, felt, borne, stiffness = trial
        return mu, pressed if _largest(felt - given) <= 1e-12 * size else None


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
    here = np.empty(k)
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
            here[a] = size
            for b in range(a + 1):
                if here[a] == 0.0 or here[b] == 0.0:  # bodies elsewhere
                    continue
                side, total = sides[b][first : first + TOGETHER], 0.0
                for j in range(own.shape[0]):
                    total += arm[j] * side[j] if own[j] > 0 else 0.0
                stiffness[a, b] += total
    for a in range(k):
        for b in range(a):
            stiffness[b, a] = stiffness[a, b]
    return pressed, felt, borne, stiffness


def _largest(few: ndarray) -> float:
    """The largest magnitude of a few numbers, sooner than numpy finds it."""
    return max(map(abs, few.tolist()), default=0.0)


def _least(matrix: ndarray, rhs: ndarray) -> ndarray:
    """Solution of a few equations, the least one where they do not tell it."""
    if len(rhs) == 0:
        return rhs
    # a third of the time of numpy's, which copies and checks
    factors, _, solution, failed = dgesv(matrix, rhs)
    pivots, diagonal = (a.diagonal().tolist() for a in (factors, matrix))
    clear = min(diagonal) > NIL * max(diagonal)  # and no product that numbers do not hold
    if not failed and clear and abs(prod(map(truediv, pivots, diagonal))) > CLEAR:
        return solution
    return np.linalg.pinv(matrix) @ rhs
