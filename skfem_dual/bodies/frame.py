"""Bodies coupled by a frame: what stands on several footings resists their settlements and tilts.

With the stiffness K of the frame against the positions s of the bodies the balance of each is
``R p + K s = load``. It is a structure whose degrees of freedom are the positions: it yields by
``s = C (load - R p) + Z z`` with a generalised inverse C of K and the motions Z of the whole, and
the equations are those of a body that bends, see `ElasticPunch`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix, issparse

from ..arguments import checked_array
from ..contact.load import Constraints
from ..contact.loaded_cells import ExactRows
from ..contact.methods import find_contact
from ..contact.problem import Contact
from ..contact.system import ContactSystem
from ..contact.unilateral import How
from ..contact.verify import Verification
from ..grids.polygons import some
from ..kernels.once import computed_once
from ..operators.small_compliance import SmallCompliance, generalised_inverse
from ..operators.yielding import YieldingOperator

#: parts of products that are rounding
ROUNDING = 1e-13
#: forces that are off by more, over the largest, are no equilibrium
EQUILIBRIUM = 1e-6
#: parts of the sum of all products, as if none cancelled, that may be rounding of positions
NOISE = 8 * float(np.finfo(float).eps)
#: a point so many times as far off a body as that is wide
FAR = 10.0


@dataclass(frozen=True, eq=False)
class FramedSystem:
    """The equations of bodies on the ground and the frame on them, under one set of loads.

    Attributes
    ----------
    bodies : ContactSystem
        Of the bodies without the frame.
    constraints : Constraints
        What is imposed, and the frame. Positions imposed are held, forces act on bodies and frame
        together.
    """

    bodies: ContactSystem
    constraints: Constraints

    @computed_once
    def _compliance(self) -> tuple[SmallCompliance, ndarray]:
        """What the frame yields by forces on the free motions, and the motions of the whole."""
        c = self.constraints
        return generalised_inverse(self._frame, c.motions.T**2 @ cast(ndarray, c.ground))

    @computed_once
    def _frame(self) -> ndarray:
        """Stiffness of the frame against the free motions, zero where products cancel."""
        motions, frame = self.constraints.motions, cast(ndarray, self.constraints.frame)
        return _against(motions, frame)

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
        return c.given - _product(c.motions.T, c.frame @ c.fixed)

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
        return system, Constraints.forces(_product(motions.T, self._forces))

    def require_balance(self, unilateral: bool) -> None:
        """Refuse loads that bodies and frame cannot balance.

        Raises
        ------
        ValueError
            If a settlement is imposed where its reaction does not act; where the ground does not
            pull, if loads do, or their resultant lies outside of the plans.
        """
        if not self.constraints.conjugate:
            raise ValueError(
                "expected settlements imposed where their reactions act, at the origins, of "
                "bodies under a frame. Remedy: leave out at= and moments= beside settlement="
            )
        if not unilateral:
            return
        motions, bodies = self._compliance[1].T, self.bodies
        planes, resultants = motions @ self._planes, motions @ self._resultants
        system = ContactSystem(bodies.matrix, planes, resultants, bodies.gap, bodies.areas)
        if not system.can_balance(Constraints.forces(motions @ self._forces)):
            raise ValueError(
                "expected loads that bodies under a frame balance without tension; the resultant "
                "of these pulls, or lies outside of the plans. Remedy: move them, or "
                "unilateral=False for ground that pulls"
            )

    def found(self, how: How, start: ndarray | None) -> tuple[Contact, ndarray]:
        """Contact and position, from pressures to begin with."""
        system, constraints = self._together
        contact, whole = find_contact(system, constraints, how, start)
        free = self._yielded(contact) + self._compliance[1] @ whole
        return contact, self.constraints.fixed + self.constraints.motions @ free

    def verified(
        self, how: How, exact: ExactRows | None, rtol: float, contact: Contact, position: ndarray
    ) -> Contact:
        """The contact, without success where the equations do not hold.

        ``exact`` rows are those of the ground alone, and not looked at; ``rtol`` is that of
        products.
        """
        system, constraints = self._together
        moved = np.abs(self.bodies.planes).max(axis=1)
        free = _least(self.constraints.motions, position - self.constraints.fixed, moved)
        moved = np.abs(self._planes).max(axis=1)
        whole = _least(self._compliance[1], free - self._yielded(contact), moved)
        contact = Verification(system, constraints, how, rtol=rtol)(contact, whole)
        lost = self._unbalanced(contact.pressure, free)
        if contact.success and not lost <= EQUILIBRIUM:
            message = (
                f"the equations do not hold: forces on bodies and frame are off by {lost:.1e} of "
                "the largest; likely cause: a frame of very different stiffnesses together"
            )
            contact = replace(contact, success=False, message=message)
        return contact

    def _unbalanced(self, pressure: ndarray, free: ndarray) -> float:
        """Forces on the free motions that are not balanced, more than by rounding, over the
        largest."""
        frame, pressed = self._frame, self._resultants @ pressure
        unit = 1 / np.abs(self._planes).max(axis=1)  # of motions by one somewhere
        rounding = NOISE * (np.abs(frame) @ np.abs(free))
        left = np.abs(self._forces - pressed - frame @ free) - rounding
        largest = np.abs(unit * [self._forces, pressed]).max(initial=0.0)
        return float((unit * left).max(initial=0.0) / largest) if largest > 0 else 0.0

    def _yielded(self, contact: Contact) -> ndarray:
        """Free motions under loads and pressures, but for motions of the whole."""
        forces = self._forces - self._resultants @ contact.pressure
        return self._compliance[0].displacements(forces)


def about_centroids(stiffness: ndarray, origins: Sequence[ndarray]) -> ndarray:
    """The stiffness of a frame against positions of the bodies' centroids, by that against those
    of their origins, which are as far from them."""
    shift = np.eye(len(stiffness))
    for n, origin in enumerate(origins):
        shift[3 * n, 3 * n + 1 : 3 * n + 3] = origin
    return _against(shift, stiffness)


def _against(motions: ndarray, stiffness: ndarray) -> ndarray:
    """A stiffness against some motions, zero where products cancel but for rounding."""
    found = motions.T @ stiffness @ motions
    size = np.abs(motions).T @ np.abs(stiffness) @ np.abs(motions)
    found = np.where(np.abs(found) > NOISE * size, found, 0.0)
    return (found + found.T) / 2


def about_origin(constraints: Constraints, origin: ndarray, width: float) -> Constraints:
    """The same of a body on which forces act by motions about its origin, where hinges of a frame
    are ones exactly; for their digits not by those about a point far off the body."""
    if len(constraints.given) < 3 or np.hypot(*origin) > FAR * width:
        return constraints
    motions = np.eye(3)
    motions[0, 1:] = -origin
    given = _product(motions.T, constraints.given)
    return replace(constraints, motions=motions, balance=motions.T, given=given)


def _least(matrix: ndarray, rhs: ndarray, moved: ndarray) -> ndarray:
    """Solution of a consistent system for positions, whatever their units: a unit of each moves
    bodies so far somewhere."""
    rows = moved[:, None] * matrix
    units = np.abs(rows).max(axis=0, initial=0.0)
    return np.linalg.lstsq(rows / units, moved * rhs)[0] / units


def _product(matrix: ndarray, vector: ndarray) -> ndarray:
    """Where it is but rounding, zero: loads of nothing are told from others."""
    found, size = matrix @ vector, np.abs(matrix) @ np.abs(vector)
    return np.where(np.abs(found) > ROUNDING * size, found, 0.0)


def ground_stiffness(areas: ndarray, modulus: float) -> ndarray:
    """About how stiff ground is against positions of bodies with some areas, (3 m,): as against
    those of circles, ``2 E* a`` and ``4/3 E* a^3``."""
    a = np.sqrt(areas / np.pi)
    return modulus * np.column_stack([2 * a, 4 / 3 * a**3, 4 / 3 * a**3]).ravel()


def checked_stiffness(stiffness: Any, ground: ndarray) -> ndarray:
    """Stiffness of a frame as an array, on bodies on a ground so stiff against their positions.

    Raises
    ------
    TypeError, ValueError
        If it is something else, of another size, not symmetric or not positive semidefinite.
    """
    matrix = stiffness.toarray() if issparse(stiffness) else stiffness
    matrix = checked_array("stiffness", matrix, (len(ground), len(ground)))
    if len(bad := np.nonzero(matrix.diagonal() < 0)[0]):
        raise ValueError(
            "expected a stiffness that is positive semidefinite, got negative numbers on its "
            f"diagonal, in rows {some(bad)}. Remedy: forces that move the bodies are stiffness "
            "times positions"
        )
    generalised_inverse(matrix, ground)
    return matrix
