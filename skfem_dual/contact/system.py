"""The equations of bodies on the ground, whatever bodies and whatever ground.

Pressures p of the cells and a position s obey ``D p + gap = planes' s`` in contact and
``balance resultants p = given``, equations (3) to (5) of the paper; the position follows from the
Schur complement, the stiffness ``resultants D^-1 planes'``.
"""

from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.once import computed_once
from ..kernels.progress import bars_shown, timed
from ..operators.dense_solver import ITERATED, DenseSolver
from ..operators.factors import Factors
from ..operators.flattened import FlattenedOperator
from ..operators.influence_operator import InfluenceOperator
from ..operators.iterative import MOST as ITERATIONS
from ..operators.iterative import solve_many
from ..operators.preconditioner import approximate_inverse
from ..operators.symmetric_matrix import SymmetricMatrix
from ..operators.toeplitz import BlockToeplitz
from ..operators.yielding import YieldingOperator
from .cell_forces import CellForces
from .load import Constraints
from .problem import Contact, ContactProblem
from .unilateral import solve_scaled

#: cells smaller by so much than the median one may keep iterations from converging
SLIVER = 1e-3
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
    def dense(self) -> bool:
        """Whether the matrix can be factorised."""
        return self.explicit or (self._regular is not None and len(self.areas) <= DENSE)

    @property
    def explicit(self) -> bool:
        """Whether the matrix is not an operator."""
        return isinstance(self.matrix, (np.ndarray, SymmetricMatrix))

    @property
    def _regular(self) -> BlockToeplitz | None:
        """The matrix, if it is that of cells on a regular grid."""
        return self.matrix.toeplitz if isinstance(self.matrix, InfluenceOperator) else None

    @property
    def singular(self) -> bool:
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
        return operator if self.explicit else operator.to_dense()

    @property
    def approximate(self) -> Any:
        """What is nearly the inverse of the matrix; None of one that needs no factors."""
        if self.nearby is not None:
            return self.nearby
        if self._regular is not None:
            return self._regular.inverse
        if self.explicit and self.gap.any() and not self._iterated:
            return None  # shaped punches begin with no contact, and factors take longer
        return self.factors if self.explicit else self.preconditioner

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
        if self.singular:
            raise ValueError(
                "expected ground without a period: on a PeriodicGround settlements do not tell "
                "the pressures. Remedy: solve under a force"
            )
        if self.dense:
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
        if self.singular:
            return float("inf")
        if isinstance(self.matrix, SymmetricMatrix):
            return self.matrix.condition_number
        if not self.dense:
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

    def scaled(self, constraints: Constraints) -> tuple[ndarray, ndarray, ndarray]:
        """Free motions that move the punch by about one, the balance by the same units."""
        unit = np.abs(constraints.motions.T @ self.planes).max(axis=1, initial=0.0)
        unit[unit == 0] = 1.0
        return constraints.motions / unit, constraints.balance / unit[:, None], unit
