"""The equations of bodies on the ground, whatever bodies and whatever ground.

Pressures p of the cells and a position s obey ``D p + gap = planes' s`` in contact and
``balance resultants p = given``, equations (3) to (5) of the paper; the position follows from the
Schur complement, the stiffness ``resultants D^-1 planes'``.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter
from typing import Any, Literal

import numpy as np
import scipy.linalg
from numpy import ndarray
from scipy.sparse.linalg import LinearOperator, eigsh

from ..operators.factors import solve_factorised
from ..operators.influence_operator import InfluenceOperator
from ..operators.iterative import solve_many
from ..operators.preconditioner import Preconditioner
from ..operators.symmetric_matrix import SymmetricMatrix
from ..operators.yielding import YieldingOperator
from .load import Constraints, checked_fraction
from .unilateral import (
    CellForces,
    Contact,
    ContactProblem,
    active_set,
    conjugate_gradients,
    solve_scaled,
)

Method = Literal["auto", "active-set", "cg"]
#: up to so many cells the answer of the conjugate gradients is polished by a direct solution
POLISHED = 3000
#: up to so many cells the matrix is a dense one with exact entries, if no tolerance is given
DENSE = 4000

_bars: ContextVar[bool] = ContextVar("progress bars", default=False)


@dataclass(frozen=True, eq=False)
class ContactSystem:
    """Pressures on n cells and a position of m components.

    Attributes
    ----------
    matrix : (n, n) array of float, SymmetricMatrix, InfluenceOperator or YieldingOperator
        Settlement of each collocation point under unit pressure on each cell. The first two
        are factorised, operators only multiplied by.
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
    """

    matrix: ndarray | SymmetricMatrix | InfluenceOperator | YieldingOperator
    planes: ndarray
    resultants: ndarray
    gap: ndarray
    areas: ndarray
    timings: dict[str, float] = field(default_factory=dict)

    @cached_property
    def factors(self) -> tuple[ndarray, ndarray]:
        """Factors of the matrix, if that is an array."""
        with timed(self.timings, "factorisation"):
            return scipy.linalg.lu_factor(self.matrix)

    @cached_property
    def preconditioner(self) -> Any:
        """Approximate inverse of the matrix, if that is an operator."""
        with timed(self.timings, "preconditioner"):
            if isinstance(self.matrix, YieldingOperator):
                return self.matrix.preconditioner
            if isinstance(self.matrix, InfluenceOperator):
                return Preconditioner.from_operator(self.matrix)
        raise TypeError("expected an operator, got a matrix, which is factorised")

    @property
    def _dense(self) -> bool:
        """Whether the matrix can be factorised."""
        return isinstance(self.matrix, (np.ndarray, SymmetricMatrix))

    @property
    def unit_pressures(self) -> ndarray:
        """Pressures by each unit component of the position, shape (n, m)."""
        return self._by_position[0]

    @property
    def shape_pressures(self) -> ndarray:
        """Pressures that would close the gap, shape (n,)."""
        return self._by_shape[0][:, 0]

    @cached_property
    def _by_position(self) -> tuple[ndarray, str]:
        return self._inverse(self.planes.T)

    @cached_property
    def _by_shape(self) -> tuple[ndarray, str]:
        gap = self.gap[:, None]
        return self._inverse(gap) if gap.any() else (np.zeros_like(gap), "")

    def _inverse(self, rhs: ndarray) -> tuple[ndarray, str]:
        """Pressures under which the collocation points settle as given, shape (n, k).

        With them why iterations did not converge, if they did not.
        """
        if isinstance(self.matrix, SymmetricMatrix):
            with timed(self.timings, "factorisation"):
                factors = self.matrix.factors
            return factors.solve(rhs), ""
        if isinstance(self.matrix, np.ndarray):
            return solve_factorised(self.factors, rhs), ""
        rtol = max(self.matrix.rtol, 1e-12)  # no more accurate than the operator
        preconditioner = self.preconditioner
        with timed(self.timings, "iterations"):
            answer = solve_many(self.matrix, rhs, rtol, _bars.get(), preconditioner=preconditioner)
        return answer.solution, "" if answer.success else answer.message

    @cached_property
    def stiffness(self) -> ndarray:
        """Resultants by each unit component of the position, shape (m, m)."""
        return self.resultants @ self.unit_pressures

    @cached_property
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm.

        Raises
        ------
        ValueError
            If the matrix is not an array.
        """
        if isinstance(self.matrix, SymmetricMatrix):
            return self.matrix.condition_number
        if not isinstance(self.matrix, np.ndarray):
            raise ValueError(
                "expected a dense matrix for the condition number, got an operator. Remedy: a "
                f"coarser mesh; up to {DENSE} cells the matrix is dense"
            )
        matrix, factors = self.matrix, self.factors

        def largest(product: Callable[[ndarray], ndarray]) -> float:
            gram = LinearOperator(matrix.shape, matvec=product, dtype=float)
            # fixed start: the same digits in every run
            start = np.random.default_rng(0).standard_normal(len(matrix))
            return float(eigsh(gram, k=1, tol=1e-8, v0=start, return_eigenvectors=False)[0])

        if len(matrix) < 3:  # too small for Lanczos
            return float(np.linalg.cond(matrix))
        scale = np.abs(matrix).max()  # in any units
        scaled = matrix / scale

        def inverse(v: ndarray, trans: int = 0) -> ndarray:
            return scale * solve_factorised(factors, v, trans)

        top = largest(lambda v: scaled.T @ (scaled @ v))
        bottom = largest(lambda v: inverse(inverse(v, trans=1)))
        return float(np.sqrt(top * bottom))

    def bilateral(self, constraints: Constraints) -> tuple[Contact, ndarray]:
        """Contact and position where all cells are in contact and the ground may pull.

        Raises
        ------
        ConvergenceError
            If the bodies can move without resistance.
        """
        motions, balance, unit = self._scaled(constraints)
        fixed = self.stiffness @ constraints.fixed - self.resultants @ self.shape_pressures
        motion = solve_scaled(
            balance @ self.stiffness @ motions, constraints.given / unit - balance @ fixed
        )
        position = constraints.fixed + motions @ motion
        pressure = self.unit_pressures @ position - self.shape_pressures
        gap = self.matrix @ pressure + self.gap - position @ self.planes
        full = np.ones(len(gap), dtype=bool)
        failure = "; ".join(filter(None, (self._by_position[1], self._by_shape[1])))
        return Contact(pressure, motion, gap, full, not failure, failure), position

    def can_balance(self, constraints: Constraints) -> bool:
        """Whether pressures without tension balance the forces given."""
        forces = CellForces.from_problem(self._problem(constraints))
        return forces.balanced(np.zeros(len(self.areas))) is not None

    def unilateral(
        self,
        constraints: Constraints,
        method: Method = "auto",
        start: ndarray | None = None,
        gap_rtol: float = 1e-10,
    ) -> tuple[Contact, ndarray]:
        """Contact that is found, and the position.

        Parameters
        ----------
        constraints : Constraints
            What is imposed.
        method : {"auto", "active-set", "cg"}
            ``"auto"``: conjugate gradients, polished by the active set up to `POLISHED` cells.
        start : (n,) array of float, optional
            Pressures to begin with.
        gap_rtol : float
            Accuracy of the gaps under conjugate gradients, over the largest settlement.

        Raises
        ------
        ValueError
            If ``method`` is unknown or cannot take the constraints, or ``gap_rtol`` is not
            between 0 and 1.
        ConvergenceError
            If the bodies can move without resistance.
        """
        gap_rtol = checked_fraction("gap_rtol", gap_rtol)
        if method not in ("auto", "active-set", "cg"):
            raise ValueError(f'expected method "auto", "active-set" or "cg", got {method!r}')
        if method == "cg" and not constraints.conjugate:
            raise ValueError(
                'expected a settlement imposed where the reaction acts with method "cg". '
                'Remedy: method="active-set"'
            )
        if start is None and not self.gap.any():
            full, position = self.bilateral(constraints)
            if (full.pressure >= -1e-13 * np.abs(full.pressure).max()).all():
                return replace(full, pressure=full.pressure.clip(0)), position
            start = full.pressure.clip(0)
        if not self._dense and (method == "active-set" or not constraints.conjugate):
            raise ValueError(
                f"expected a dense matrix for the active set, got {self.matrix.shape[0]} cells. "
                'Remedy: method="cg" with a settlement imposed where the reaction acts, or a '
                "coarser mesh"
            )
        problem = self._problem(constraints)
        contact = self._contact(problem, method, constraints.conjugate, start, gap_rtol)
        return contact, constraints.fixed + self._scaled(constraints)[0] @ contact.motion

    def _problem(self, constraints: Constraints) -> ContactProblem:
        motions, balance, unit = self._scaled(constraints)
        return ContactProblem(
            matrix=self.matrix,
            areas=self.areas,
            gap=self.gap - constraints.fixed @ self.planes,
            planes=motions.T @ self.planes,
            resultants=balance @ self.resultants,
            given=constraints.given / unit,
        )

    def _contact(
        self,
        problem: ContactProblem,
        method: Method,
        conjugate: bool,
        start: ndarray | None,
        gap_rtol: float,
    ) -> Contact:
        """Contact by one method, or by conjugate gradients polished by the active set."""
        n = len(self.areas)
        if method == "active-set" or not conjugate:
            return active_set(problem, _beginning(start, n))
        if not (method == "auto" and self._dense and n <= POLISHED):
            return conjugate_gradients(problem, start, gap_rtol, progress=_bars.get())
        rough = conjugate_gradients(problem, start, 1e-4, progress=_bars.get())
        polished = active_set(problem, _beginning(rough.pressure if rough.success else start, n))
        return replace(polished, history=rough.history + polished.history)

    def _scaled(self, constraints: Constraints) -> tuple[ndarray, ndarray, ndarray]:
        """Free motions that move the punch by about one, the balance by the same units."""
        unit = np.abs(constraints.motions.T @ self.planes).max(axis=1, initial=0.0)
        unit[unit == 0] = 1.0
        return constraints.motions / unit, constraints.balance / unit[:, None], unit


def _beginning(start: ndarray | None, n: int) -> ndarray:
    """Cells in contact to begin with: those with a pressure, all of them by default."""
    return np.ones(n, dtype=bool) if start is None else start > 0


@contextmanager
def progress_bars(shown: bool) -> Iterator[None]:
    """Whether iterations inside the block show progress bars, also those that serve every load."""
    token = _bars.set(shown)
    try:
        yield
    finally:
        _bars.reset(token)


@contextmanager
def timed(timings: dict[str, float], what: str) -> Iterator[None]:
    """Note the seconds a block takes."""
    begin = perf_counter()
    yield
    timings[what] = perf_counter() - begin
