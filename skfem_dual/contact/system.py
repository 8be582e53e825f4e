"""The equations of bodies on the ground, whatever bodies and whatever ground.

Pressures p of the cells and a position s obey ``D p + gap = planes' s`` in contact and
``balance resultants p = given``, equations (3) to (5) of the paper; the position follows from the
Schur complement, the stiffness ``resultants D^-1 planes'``.
"""

from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy import ndarray

from ..errors import ConvergenceError
from ..grids.partition import Partition
from ..kernels.limits import limited_threads
from ..kernels.once import computed_once
from ..kernels.progress import bars_shown, timed
from ..messages import without_remedy
from ..operators.dense_solver import ITERATED, DenseSolver
from ..operators.factors import Factors
from ..operators.flattened import FlattenedOperator
from ..operators.influence_operator import InfluenceOperator
from ..operators.iterative import MOST as ITERATIONS
from ..operators.iterative import solve_many
from ..operators.preconditioner import approximate_inverse
from ..operators.symmetric_matrix import SymmetricMatrix
from ..operators.toeplitz import BlockToeplitz
from ..operators.yielding import TOO_SOFT, YieldingOperator
from .cell_forces import CellForces
from .load import Constraints
from .positions import apart, by_force, noise
from .problem import Contact, ContactProblem
from .unilateral import MOST, How, active_set, beginning, conjugate_gradients, solve_scaled

#: violation of the conditions on the gap to which iterations with a matrix go by default, and
#: how many there are before an active set ends what they began
EXACTLY, FEW = 1e-13, 100
UNANSWERED = "no force was found under which the settlement is the one imposed"
#: cells smaller by so much than the median one may keep iterations from converging
SLIVER = 1e-3
#: accuracy of gaps from which the active set is begun
ROUGHLY = 1e-6
#: up to so many cells the matrix is a dense one with exact entries, if no tolerance is given
DENSE = 4000


@dataclass(frozen=True, eq=False)
class ContactSystem:
    """Pressures on n cells and a position of m components.

    Attributes
    ----------
    matrix : (n, n) array of float, SymmetricMatrix or operator
        Settlement of each collocation point under unit pressure on each cell. The first two are
        solved with, operators only multiplied by but for those of few cells on a regular grid.
    planes : (m, n) array of float
        Settlement of the collocation points by each component of the position.
    resultants : (m, n) array of float
        Force or moment conjugate to it by unit pressure on each cell.
    gap : (n,) array of float
        Gap between punch and ground before contact.
    areas : (n,) array of float
        Areas of the cells.
    timings : dict
        Takes the seconds of the factorisation.
    nearby : matrix-like, optional
        Inverse of a matrix that differs in few cells, an approximate one or factors.
    partition : Partition, optional
        The cells, if they tell how to do without factors.
    """

    matrix: ndarray | SymmetricMatrix | InfluenceOperator | FlattenedOperator | YieldingOperator
    planes: ndarray
    resultants: ndarray
    gap: ndarray
    areas: ndarray
    timings: dict[str, float] = field(default_factory=dict)
    nearby: Any = None
    partition: Partition | None = None

    @computed_once
    def factors(self) -> Any:
        """Factors of the matrix, or what does without, if that is an array."""
        with timed(self.timings, "factorisation"):
            if isinstance(self.matrix, SymmetricMatrix):
                return self.matrix.factors
            matrix = np.asarray(self.array)
            if self.partition is None or len(matrix) < ITERATED:
                return Factors.from_matrix(matrix)
            return DenseSolver.from_matrix(matrix, self.partition)

    @property
    def _iterated(self) -> bool:
        """Whether the matrix is given and needs no factors."""
        many = self.partition is not None and len(self.areas) >= ITERATED
        return many and isinstance(self.matrix, np.ndarray)

    @computed_once
    def preconditioner(self) -> Any:
        """Approximate inverse of the matrix, if that is an operator."""
        if self.nearby is not None:
            return self.nearby
        with timed(self.timings, "preconditioner"):
            if isinstance(self.matrix, InfluenceOperator):
                return approximate_inverse(self.matrix)
            return cast(FlattenedOperator, self.matrix).preconditioner

    @property
    def _dense(self) -> bool:
        """Whether the matrix can be factorised."""
        return self._given or (self._regular is not None and len(self.areas) <= DENSE)

    @property
    def _given(self) -> bool:
        """Whether the matrix is not an operator."""
        return isinstance(self.matrix, (np.ndarray, SymmetricMatrix))

    @property
    def _regular(self) -> BlockToeplitz | None:
        """The matrix, if it is that of cells on a regular grid."""
        return self.matrix.toeplitz if isinstance(self.matrix, InfluenceOperator) else None

    @property
    def _singular(self) -> bool:
        """Whether a uniform pressure settles nothing, as on periodic ground."""
        return self._regular is not None and self._regular.singular

    @property
    def formed(self) -> bool:
        """Whether the matrix is there, or is formed where iterations do not end soon."""
        under = self.matrix.ground if isinstance(self.matrix, YieldingOperator) else self.matrix
        return isinstance(under, (np.ndarray, SymmetricMatrix))

    @computed_once
    def array(self) -> Any:
        """The matrix as something that can be factorised, if it can be."""
        operator: Any = self.matrix if self._regular is None else self._regular
        return operator if self._given else operator.to_dense()

    @property
    def approximate(self) -> Any:
        """What is nearly the inverse of the matrix; None of one that needs no factors."""
        if self.nearby is not None:
            return self.nearby
        if self._regular is not None:
            return self._regular.inverse
        if self._given and self.gap.any() and not self._iterated:
            return None  # shaped punches begin with no contact, and factors take longer
        return self.factors if self._given else self.preconditioner

    @property
    def unit_pressures(self) -> ndarray:
        """Pressures by each unit component of the position, shape (n, m)."""
        return self._by_position[0]

    @property
    def shape_pressures(self) -> ndarray:
        """Pressures that would close the gap, shape (n,)."""
        return self._by_shape[0][:, 0]

    @property
    def failure(self) -> str:
        """Why unit pressures were not found, if iterations did not converge."""
        return "; ".join(filter(None, (self._by_position[1], self._by_shape[1])))

    @computed_once
    def _by_position(self) -> tuple[ndarray, str]:
        return self._inverse(self.planes.T)

    @computed_once
    def _by_shape(self) -> tuple[ndarray, str]:
        gap = self.gap[:, None]
        return self._inverse(gap) if gap.any() else (np.zeros_like(gap), "")

    def _inverse(self, rhs: ndarray) -> tuple[ndarray, str]:
        """Pressures under which the collocation points settle as given, shape (n, k).

        With them why iterations did not converge, if they did not.
        """
        if self._singular:
            raise ValueError(
                "expected ground without a period: on a PeriodicGround settlements do not tell "
                "the pressures. Remedy: solve under a force"
            )
        if self._dense:
            return self.factors.solve(rhs), ""
        operator, preconditioner = cast(InfluenceOperator, self.matrix), self.preconditioner
        how: dict[str, Any] = {"preconditioner": preconditioner}
        if self.formed:  # no more products than the matrix takes
            how["most"] = min(max(len(rhs) // max(rhs.shape[1], 1), 1), ITERATIONS)
        rtol = max(operator.rtol, 1e-12)  # no more accurate than the operator
        with timed(self.timings, "iterations"):
            answer = solve_many(operator, rhs, rtol, bars_shown(), **how)
        exact = operator.rtol < 1e-12 and getattr(operator, "method", "") == "dense"
        if not answer.success and (self.formed or exact):
            return self.factors.solve(rhs), ""
        return answer.solution, "" if answer.success else answer.message + self._slivers

    @property
    def _slivers(self) -> str:
        """What keeps iterations from converging, if cells are far smaller than others."""
        least, share = int(self.areas.argmin()), self.areas.min() / np.median(self.areas)
        if share > SLIVER:
            return ""
        return (
            f"; likely cause: cells far smaller than others, number {least} has {share:.1e} of "
            "their median area. Remedy: a mesh without nodes that nearly coincide, or rtol=0 for "
            "a matrix"
        )

    @computed_once
    def stiffness(self) -> ndarray:
        """Resultants by each unit component of the position, shape (m, m)."""
        return self.resultants @ self.unit_pressures

    @computed_once
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm.

        Raises
        ------
        ValueError
            If the matrix is not an array.
        """
        if self._singular:
            return float("inf")
        if isinstance(self.matrix, SymmetricMatrix):
            return self.matrix.condition_number
        if not self._dense:
            raise ValueError(
                "expected a dense matrix for the condition number, got an operator. Remedy: a "
                f"coarser mesh; up to {DENSE} cells the matrix is dense"
            )
        return self.factors.condition_number(self.array)

    def bilateral(self, constraints: Constraints) -> tuple[Contact, ndarray]:
        """Contact and position where all cells are in contact and the ground may pull.

        Raises
        ------
        ConvergenceError
            If the bodies can move without resistance.
        """
        motions, balance, unit = self.scaled(constraints)
        fixed = self.stiffness @ constraints.fixed - self.resultants @ self.shape_pressures
        motion = solve_scaled(
            balance @ self.stiffness @ motions, constraints.given / unit - balance @ fixed
        )
        position = constraints.fixed + motions @ motion
        pressure = self.unit_pressures @ position - self.shape_pressures
        gap = self.matrix @ pressure + self.gap - position @ self.planes
        full = np.ones(len(gap), dtype=bool)
        return Contact(pressure, motion, gap, full, not self.failure, self.failure), position

    def can_balance(self, constraints: Constraints) -> bool:
        """Whether pressures without tension balance the forces given."""
        forces = CellForces.from_problem(self.problem(constraints))
        return forces.balanced(np.zeros(len(self.areas))) is not None

    def solve(
        self, constraints: Constraints, how: How, start: ndarray | None = None
    ) -> tuple[Contact, ndarray]:
        """Contact and position under what is imposed, from pressures to begin with.

        By default conjugate gradients find it, with a matrix to rounding errors; the active set
        where they do not end soon, unless there are too many cells.

        Raises
        ------
        ValueError
            If the method needs a matrix that is too large.
        ConvergenceError
            If the bodies can move without resistance, or loads are too large for numbers.
        """
        if how.unilateral:
            contact, position = self._unilateral(constraints, how, start)
        else:
            contact, position = self.bilateral(constraints)
        if not (np.isfinite(contact.pressure).all() and np.isfinite(position).all()):
            raise ConvergenceError("the loads are too large for floating-point numbers")
        return contact, position

    def _unilateral(
        self, constraints: Constraints, how: How, start: ndarray | None
    ) -> tuple[Contact, ndarray]:
        _, method, gap_rtol = how
        if method == "active-set" and not self._dense:
            raise ValueError(
                f"expected a dense matrix for the active set, got {self.matrix.shape[0]} cells. "
                'Remedy: method="cg", or a coarser mesh'
            )
        known = start is not None  # an answer nearby
        if start is None and not self.gap.any():
            full, position = self.bilateral(constraints)
            if (full.pressure >= -1e-13 * np.abs(full.pressure).max()).all():
                return replace(full, pressure=full.pressure.clip(0)), position
            start = full.pressure.clip(0)
        problem = self.problem(constraints)
        if constraints.conjugate:
            contact = self._contact(problem, how, start)
            if not contact.success or noise(problem, contact):
                other = apart(problem, True) or apart(problem)
                if other is None and method != "active-set":
                    other = self._from_all(problem, gap_rtol)
                contact = other or contact
        else:
            contact = self._beside(constraints, problem, how, start, known)
        return contact, constraints.fixed + self.scaled(constraints)[0] @ contact.motion

    def _beside(
        self,
        constraints: Constraints,
        problem: ContactProblem,
        how: How,
        start: ndarray | None,
        known: bool,
    ) -> Contact:
        """Contact where the reaction acts beside what is imposed, for which there may be several:
        the one nearby that is known; of one body none, or that of the force next to the one of
        full contact."""
        # of several bodies forces would be looked for within each other
        soon = known or len(self.planes) > 3
        roads = [
            lambda: apart(problem, True),
            lambda: self._elsewhere(constraints, problem, how),
            lambda: apart(problem),
        ]
        roads.insert(0 if soon else 2, lambda: self._directly(problem, how, start))
        for road in roads:
            found = road()
            if found is not None:
                return found
        return Contact.nowhere(problem, message=UNANSWERED)

    def problem(self, constraints: Constraints) -> ContactProblem:
        """What is left for a method: free motions that move the bodies by about one."""
        motions, balance, unit = self.scaled(constraints)
        return ContactProblem(
            matrix=self.matrix if self._regular is None else self._regular,
            areas=self.areas,
            gap=self.gap - constraints.fixed @ self.planes,
            planes=motions.T @ self.planes,
            resultants=balance @ self.resultants,
            given=constraints.given / unit,
            inverse=self.approximate,
            conjugate=constraints.conjugate,
        )

    def _from_all(self, problem: ContactProblem, gap_rtol: float) -> Contact | None:
        """Contact found from pressures on all cells: from too few no descent leads on."""
        every = np.ones(len(self.areas))
        settled = np.abs(problem.matrix @ every).max()
        if not settled > 0:  # on a period
            return None
        start = np.abs(problem.gap.min()) / settled * every
        contact = self._gradients(problem, start, gap_rtol)
        if contact.success and self._given:
            polished = active_set(problem, contact.pressure > 0)
            contact = polished if polished.success else contact
        return contact if contact.success else None

    def _elsewhere(
        self, constraints: Constraints, problem: ContactProblem, how: How
    ) -> Contact | None:
        """The same by the force under which the settlement is the one imposed."""
        if how.method != "cg" and self._dense:  # from a rough answer the active set is soon there
            found = self._by_force(constraints, problem, How(True, "cg", ROUGHLY))
            if found is None:
                return None
            polished = active_set(replace(problem, matrix=self.array), found[0].pressure > 0)
            if polished.success:
                return polished
        found = self._by_force(constraints, problem, how)
        if found is None:
            return None
        contact, position = found
        motions = self.scaled(constraints)[0]
        motion = np.linalg.lstsq(motions, position - constraints.fixed, rcond=None)[0]
        gap = self.matrix @ contact.pressure + self.gap - position @ self.planes
        return replace(contact, motion=motion, gap=gap)

    def _by_force(
        self, constraints: Constraints, problem: ContactProblem, how: How
    ) -> tuple[Contact, ndarray] | None:
        """Contact and position, each force from the contact found last; None if none is found."""
        last: ndarray | None = None

        def solve(given: Constraints) -> tuple[Contact, ndarray]:
            nonlocal last
            answer = self._unilateral(given, how, last)
            last = answer[0].pressure if answer[0].success else last
            return answer

        height = np.abs(self.gap - problem.gap).max() + np.ptp(self.gap)
        return by_force(constraints, self.stiffness, height, solve, how.gap_rtol)

    def _directly(
        self, problem: ContactProblem, how: How, start: ndarray | None
    ) -> Contact | None:
        """The same by the active set, if there are few cells and it finds one."""
        if how.method == "cg" or not (self._dense or self.formed):
            return None
        contact = self._active_set(problem, start)
        return contact if contact.success and not noise(problem, contact) else None

    def _active_set(self, problem: ContactProblem, start: ndarray | None) -> Contact:
        own = replace(problem, matrix=self.array)
        return active_set(own, beginning(start, len(self.areas)), singular=self._singular)

    def _contact(self, problem: ContactProblem, how: How, start: ndarray | None) -> Contact:
        """Contact by one method, or by the active set from where conjugate gradients ended."""
        n, (_, method, gap_rtol) = len(self.areas), how
        if method == "active-set":
            return self._active_set(problem, start)
        if method == "auto" and self.formed:
            found = self._gradients(problem, start, EXACTLY if self._given else gap_rtol, FEW)
        else:
            found = self._gradients(problem, start, gap_rtol)
        if found.success or method == "cg" or not (self.formed or self._dense):
            return found
        problem, history = replace(problem, matrix=self.array), found.history
        for pressure in (found.pressure, start) if found.touching.any() else (start,):
            polished = active_set(problem, beginning(pressure, n))
            history += polished.history
            if polished.success:
                break
        return replace(polished, history=history)

    def _gradients(
        self, problem: ContactProblem, start: ndarray | None, gap_rtol: float, most: int = MOST
    ) -> Contact:
        # threads of BLAS go on waiting for work, in the way of those of the products
        with nullcontext() if self._dense else limited_threads(1, "blas"):
            found = conjugate_gradients(problem, start, gap_rtol, most, bars_shown())
        if not found.success and isinstance(self.matrix, YieldingOperator):
            reason = without_remedy(found.message)
            found = replace(found, message=f"{reason}; {TOO_SOFT}")
        return found

    def scaled(self, constraints: Constraints) -> tuple[ndarray, ndarray, ndarray]:
        """Free motions that move the punch by about one, the balance by the same units."""
        unit = np.abs(constraints.motions.T @ self.planes).max(axis=1, initial=0.0)
        unit[unit == 0] = 1.0
        return constraints.motions / unit, constraints.balance / unit[:, None], unit
