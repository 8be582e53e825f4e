"""The equations of rigid bodies on the ground, whatever bodies and whatever ground."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter
from typing import Literal

import numpy as np
import scipy.linalg
from numpy import ndarray
from scipy.sparse.linalg import LinearOperator, eigsh

from ..operators.influence_operator import InfluenceOperator
from ..operators.iterative import solve_many
from ..operators.preconditioner import Preconditioner
from ..operators.symmetric_matrix import SymmetricMatrix
from .load import Constraints
from .unilateral import Contact, ContactProblem, active_set, conjugate_gradients, solve_scaled

Method = Literal["auto", "active-set", "cg"]
#: up to so many cells the answer of the conjugate gradients is polished by a direct solution
POLISHED = 3000
#: up to so many cells the matrix is a dense one with exact entries, if no tolerance is given
DENSE = 4000


@dataclass(frozen=True, eq=False)
class ContactSystem:
    """Pressures on n cells and a position of m components.

    Attributes
    ----------
    matrix : (n, n) array of float, SymmetricMatrix or InfluenceOperator
        Settlement of each collocation point under unit pressure on each cell. The first two
        are factorised, an operator only multiplied by.
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
    failures : list of str
        Takes what iterations did not converge.
    """

    matrix: ndarray | SymmetricMatrix | InfluenceOperator
    planes: ndarray
    resultants: ndarray
    gap: ndarray
    areas: ndarray
    timings: dict[str, float] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list, init=False)

    @cached_property
    def factors(self) -> tuple[ndarray, ndarray]:
        """Factors of the matrix, if that is an array."""
        with timed(self.timings, "factorisation"):
            return scipy.linalg.lu_factor(self.matrix)

    @cached_property
    def preconditioner(self) -> Preconditioner:
        """Approximate inverse of the matrix, if that is an operator."""
        if not isinstance(self.matrix, InfluenceOperator):
            raise TypeError("expected an operator, got a matrix, which is factorised")
        with timed(self.timings, "preconditioner"):
            return Preconditioner.from_operator(self.matrix)

    @cached_property
    def unit_pressures(self) -> ndarray:
        """Pressures by each unit component of the position, shape (n, m)."""
        return self._inverse(self.planes.T)

    @cached_property
    def shape_pressures(self) -> ndarray:
        """Pressures that would close the gap, shape (n,)."""
        if not self.gap.any():
            return np.zeros(len(self.gap))
        return self._inverse(self.gap[:, None])[:, 0]

    def prepare(self, progress: bool) -> None:
        """Compute what serves every load, with progress bars if it is iterated."""
        if "unit_pressures" not in self.__dict__:
            self.__dict__["unit_pressures"] = self._inverse(self.planes.T, progress)

    def _inverse(self, rhs: ndarray, progress: bool = False) -> ndarray:
        """Pressures under which the collocation points settle as given, shape (n, k)."""
        if isinstance(self.matrix, SymmetricMatrix):
            with timed(self.timings, "factorisation"):
                factors = self.matrix.factors
            return factors.solve(rhs)
        if isinstance(self.matrix, np.ndarray):
            return scipy.linalg.lu_solve(self.factors, rhs)
        rtol = max(self.matrix.rtol, 1e-12)  # no more accurate than the operator
        preconditioner = self.preconditioner
        with timed(self.timings, "iterations"):
            found = solve_many(self.matrix, rhs, rtol, progress, preconditioner=preconditioner)
        if not found.success:
            self.failures.append(found.message)
        return found.solution

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

        def largest(product) -> float:
            gram = LinearOperator(matrix.shape, matvec=product, dtype=float)
            # fixed start: the same digits in every run
            start = np.random.default_rng(0).standard_normal(len(matrix))
            return float(eigsh(gram, k=1, tol=1e-8, v0=start, return_eigenvectors=False)[0])

        if len(matrix) < 3:  # too small for Lanczos
            return float(np.linalg.cond(matrix))
        scale = np.abs(matrix).max()  # in any units
        scaled = matrix / scale

        def inverse(v, trans=0):
            return scale * scipy.linalg.lu_solve(factors, v, trans=trans)

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
        failure = "; ".join(self.failures)
        return Contact(pressure, motion, gap, full, not failure, failure), position

    def unilateral(
        self,
        constraints: Constraints,
        method: Method = "auto",
        start: ndarray | None = None,
        rtol: float = 1e-10,
        progress: bool = False,
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
        rtol : float
            Accuracy of the conjugate gradients.
        progress : bool
            Whether they show a progress bar.

        Raises
        ------
        ValueError
            If ``method`` is unknown or cannot take the constraints.
        ConvergenceError
            If the bodies can move without resistance.
        """
        if method not in ("auto", "active-set", "cg"):
            raise ValueError(f'expected method "auto", "active-set" or "cg", got {method!r}')
        if method == "cg" and not constraints.conjugate:
            raise ValueError(
                'expected a settlement imposed where the reaction acts with method "cg". '
                'Remedy: method="active-set"'
            )
        motions, balance, unit = self._scaled(constraints)
        problem = ContactProblem(
            matrix=self.matrix,
            areas=self.areas,
            gap=self.gap - constraints.fixed @ self.planes,
            planes=motions.T @ self.planes,
            resultants=balance @ self.resultants,
            given=constraints.given / unit,
        )
        if start is None and not self.gap.any():
            full, position = self.bilateral(constraints)
            if (full.pressure >= -1e-13 * np.abs(full.pressure).max()).all():
                return replace(full, pressure=full.pressure.clip(0)), position
            start = full.pressure.clip(0)
        dense = not isinstance(self.matrix, InfluenceOperator)
        if not dense and (method == "active-set" or not constraints.conjugate):
            raise ValueError(
                f"expected a dense matrix for the active set, got {self.matrix.shape[0]} cells. "
                'Remedy: method="cg" with a settlement imposed where the reaction acts, or a '
                "coarser mesh"
            )
        if method == "auto" and constraints.conjugate:
            polish = dense and len(self.areas) <= POLISHED
            accuracy = 1e-4 if polish else rtol
            found = conjugate_gradients(problem, start, accuracy, progress=progress)
            if polish:
                if found.success:
                    start = found.pressure
                direct = active_set(problem, _beginning(start, len(self.areas)))
                found = replace(direct, history=found.history + direct.history)
        elif method == "cg":
            found = conjugate_gradients(problem, start, rtol, progress=progress)
        else:
            found = active_set(problem, _beginning(start, len(self.areas)))
        return found, constraints.fixed + motions @ found.motion

    def _scaled(self, constraints: Constraints) -> tuple[ndarray, ndarray, ndarray]:
        """Free motions that move the punch by about one, the balance by the same units."""
        unit = np.abs(constraints.motions.T @ self.planes).max(axis=1, initial=0.0)
        unit[unit == 0] = 1.0
        return constraints.motions / unit, constraints.balance / unit[:, None], unit


def _beginning(start: ndarray | None, n: int) -> ndarray:
    """Cells in contact to begin with: those with a pressure, all of them by default."""
    return np.ones(n, dtype=bool) if start is None else start > 0


@contextmanager
def timed(timings: dict[str, float], what: str) -> Iterator[None]:
    """Note the seconds a block takes."""
    begin = perf_counter()
    yield
    timings[what] = perf_counter() - begin
