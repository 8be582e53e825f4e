"""Bodies coupled by a frame: what stands on several footings resists their settlements and tilts.

With the stiffness K of the frame against the positions s of the bodies the balance of each is
``R p + K s = load``. It is a structure whose degrees of freedom are the positions: it yields by
``s = C (load - R p) + Z z`` with a generalised inverse C of K and the motions Z of the whole, and
the equations are those of a body that bends, see `ElasticPunch`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csc_matrix, csr_matrix, issparse

from ..arguments import checked_array
from ..contact.load import Constraints
from ..contact.problem import Contact
from ..contact.system import ContactSystem
from ..contact.unilateral import How
from ..contact.verify import verified
from ..kernels.once import computed_once
from ..operators.compliance import Compliance
from ..operators.yielding import YieldingOperator


@dataclass(frozen=True, eq=False)
class FramedSystem:
    """The equations of bodies on the ground and the frame on them, under one set of loads.

    Attributes
    ----------
    bodies : ContactSystem
        Of the bodies without the frame.
    stiffness : (m, m) array of float
        Of the frame against the positions of the system.
    constraints : Constraints
        What is imposed. Positions imposed are held, forces act on bodies and frame together.
    """

    bodies: ContactSystem
    stiffness: ndarray
    constraints: Constraints

    @computed_once
    def _compliance(self) -> tuple[Compliance, ndarray]:
        """What the frame yields by forces on the free motions, and the motions of the whole."""
        motions = self.constraints.motions
        return compliance(motions.T @ self.stiffness @ motions)

    @computed_once
    def _planes(self) -> ndarray:
        return self.constraints.motions.T @ self.bodies.planes

    @computed_once
    def _resultants(self) -> ndarray:
        return self.constraints.motions.T @ self.bodies.resultants

    @computed_once
    def _forces(self) -> ndarray:
        """Forces on the free motions, those by imposed positions too."""
        c = self.constraints
        return c.given - c.motions.T @ (self.stiffness @ c.fixed)

    @computed_once
    def _together(self) -> tuple[ContactSystem, Constraints]:
        """The equations for the pressures and the motions of the whole."""
        bodies, (yields, motions) = self.bodies, self._compliance
        ground: Any = bodies.matrix
        parts = csr_matrix(self._planes.T), csr_matrix(self._resultants)
        operator = YieldingOperator(ground, yields, *parts)
        moved = self.constraints.motions @ yields.displacements(self._forces)
        system = ContactSystem(
            operator.to_dense() if isinstance(ground, ndarray) else operator,
            motions.T @ self._planes,
            motions.T @ self._resultants,
            bodies.gap - (self.constraints.fixed + moved) @ bodies.planes,
            bodies.areas,
            bodies.timings,
        )
        return system, Constraints.forces(motions.T @ self._forces)

    def solve(self, how: How, start: ndarray | None, rtol: float) -> tuple[Contact, ndarray]:
        """Contact and position, from pressures to begin with; ``rtol`` is that of products.

        Raises
        ------
        ValueError
            If the loads cannot be balanced without tension, or a settlement is imposed where
            its reaction does not act.
        """
        if not self.constraints.conjugate:
            raise ValueError(
                "expected settlements imposed where their reactions act, at the origins, of "
                "bodies under a frame. Remedy: leave out at= and moments= beside settlement="
            )
        system, constraints = self._together
        if how.unilateral and not system.can_balance(constraints):
            raise ValueError(
                "expected loads that bodies under a frame balance without tension; the resultant "
                "of these pulls, or lies outside of the plans. Remedy: move them, or "
                "unilateral=False for ground that pulls"
            )
        contact, whole = verified(system, constraints, how, start, rtol=rtol)
        yields, motions = self._compliance
        moved = yields.displacements(self._forces - self._resultants @ contact.pressure)
        free = moved + motions @ whole
        return contact, self.constraints.fixed + self.constraints.motions @ free


def compliance(stiffness: ndarray) -> tuple[Compliance, ndarray]:
    """Generalised inverse of a small stiffness, and the motions that it does not resist.

    Raises
    ------
    ValueError
        If it is not symmetric and positive semidefinite.
    """
    loose = np.nonzero(~stiffness.any(axis=1))[0]
    yields = Compliance(csc_matrix(stiffness), loose)
    return yields, np.hstack([yields.motions, np.eye(len(stiffness))[:, loose]])


def checked_stiffness(stiffness: Any, bodies: int) -> ndarray:
    """Stiffness of a frame on so many bodies as an array.

    Raises
    ------
    TypeError, ValueError
        If it is something else, of another size, not symmetric or not positive semidefinite.
    """
    matrix = stiffness.toarray() if issparse(stiffness) else stiffness
    matrix = checked_array("stiffness", matrix, (3 * bodies, 3 * bodies))
    compliance(matrix)
    return matrix
