"""Rigid bodies on the ground, one or several: contact under loads, found and verified."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from ..kernels.limits import threads_for_matrix
from .footprint import ExactRows, LoadedCells
from .load import Constraints, Load
from .one_sign import contact_of, solved
from .problem import Contact
from .solution import PunchSolution
from .system import ContactSystem, Method
from .verify import Verification

#: contact and position by equations with some flat cells, from pressures to begin with, if any
Shared = Callable[[ContactSystem, ndarray, ndarray | None], tuple[Contact, ndarray] | None]


class How(NamedTuple):
    """How contact is found; arguments of `RigidPunch.solve`."""

    unilateral: bool
    method: Method
    gap_rtol: float


class RigidBodies(ABC):
    """What is solved under one set of loads or many: a punch, or several.

    Attributes
    ----------
    timings : dict of str to float
        Seconds of assembly and factorisation.
    """

    timings: dict[str, float]

    @property
    @abstractmethod
    def cells(self) -> LoadedCells:
        """The cells of all punches."""

    @property
    @abstractmethod
    def operator(self) -> Any:
        """From all cells to their collocation points."""

    @property
    @abstractmethod
    def system(self) -> ContactSystem:
        """The equations."""

    @property
    def exact_rows(self) -> ExactRows | None:
        """Some rows of the matrix, computed apart from it; None if there are none."""
        return self.cells.exact_rows

    @property
    @abstractmethod
    def _rtol(self) -> float:
        """Accuracy of the operator's products."""

    @abstractmethod
    def flattened_resultants(self, flat: ndarray) -> ndarray:
        """Forces and moments of unit pressures where some cells are flat, (n,) array of bool."""

    def flattened_system(self, flat: ndarray) -> ContactSystem:
        """The equations where some cells are flat."""
        operator = self.cells.flattened_operator(self.operator, flat)
        acting = self.flattened_resultants(flat)
        nearby = self.system.approximate
        return replace(self.system, matrix=operator, resultants=acting, nearby=nearby)

    @abstractmethod
    def constraints(self, loads: tuple[Load, ...], unilateral: bool) -> Constraints:
        """What the loads impose; a ValueError where no pressures can balance them."""

    @abstractmethod
    def answers(
        self,
        loads: tuple[Load, ...],
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
    ) -> tuple[PunchSolution, ...]:
        """Of each punch, from contact and positions of all."""

    def verification(self, constraints: Constraints, how: How) -> Verification:
        """What is asked of an answer."""
        known = how.unilateral, self.exact_rows, self._rtol, how.gap_rtol
        return Verification(self.system, constraints, *known)

    def contact(
        self,
        constraints: Constraints,
        how: How,
        start: ndarray | None = None,
        found: tuple[Contact, ndarray] | None = None,
        shared: Shared | None = None,
    ) -> tuple[Contact, ndarray]:
        """Contact and positions, verified; ``start`` and ``found`` as of `solved`.

        What many loads have shared answers first where some cells are flat.
        """

        def find(flat: ndarray, start: ndarray | None) -> tuple[Contact, ndarray]:
            return self._find(constraints, flat, start, how, shared)

        rows = 0 if self.cells.regular else len(self.cells)
        # infinite loads are refused there
        with np.errstate(over="ignore", invalid="ignore"), threads_for_matrix(rows):
            return solved(self.cells, find, how.unilateral, start, found)

    def _find(
        self,
        constraints: Constraints,
        flat: ndarray,
        start: ndarray | None,
        how: How,
        shared: Shared | None,
    ) -> tuple[Contact, ndarray]:
        """Contact and positions where some cells are flat, (n,) array of bool, and verified."""
        system = self.flattened_system(flat) if flat.any() else self.system
        known = None if shared is None else shared(system, flat, start)
        contact, position = known or contact_of(
            system, constraints, how.unilateral, how.method, start, how.gap_rtol
        )
        verify = self.verification(constraints, how)
        rows = self.cells.flattened_rows(verify.exact, flat)
        return replace(verify, system=system, exact=rows)(contact, position), position
