"""Whether an answer obeys the equations of contact, whatever has solved them.

Balance, gaps and signs are taken from the final pressures and the position alone: by a product of
the whole operator, and by some exact rows that neither its assembly nor its factors have seen.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ..errors import ConvergenceError
from ..operators.yielding import YieldingOperator
from .load import Constraints
from .loaded_cells import ExactRows
from .methods import find_contact
from .problem import Contact
from .system import ContactSystem
from .unilateral import How, between

#: error of a load, over the largest one imposed on the body, or else over that of its pressures
BALANCE = 1e-8
#: beside far larger loads it has fewer digits: its measure is so much of the largest of all, but
#: no more than so many times the load itself, if there is one
BESIDE, FEWER = 1e-5, 100.0
#: distances in contact and overlaps beside it, over the largest settlement of the ground
GAP = 1e-7
#: settlements by the operator less those by exact rows, over these with pressures of one sign, or
#: over a part of the largest: far from pressures layers settle by next to nothing
ROWS, PART = 1e-5, 0.1
#: gaps and rows may be off by so many times the tolerances asked for
SLACK = 30.0
#: steps of refinement after which to give up
STEPS = 3
#: under structures gaps may be off by so many times a sample of their rounding
SAMPLES = 4.0
#: rounding of deflections, over the largest settlement of the ground, that an answer may have
LOST = 1e-3
#: pressures below zero up to so much of the largest are zero
NOTHING = 1e-14
#: overlaps without contact, over the largest of what they are the difference of
ROUNDING = 64 * float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Verification:
    """What is asked of an answer.

    Attributes
    ----------
    system : ContactSystem
        The equations; only its products are used.
    constraints : Constraints
        What was imposed.
    how : How
        How it was found: whether the ground must not pull, and the tolerance of gaps.
    exact : ExactRows or None
        Settlements of some collocation points, known independently.
    rtol : float
        Tolerance of the operator.
    rounded : bool
        Whether gaps under structures may be off by their rounding.
    """

    system: ContactSystem
    constraints: Constraints
    how: How
    exact: ExactRows | None = None
    rtol: float = 0.0
    rounded: bool = True

    def __call__(
        self, contact: Contact, position: ndarray, settled: ndarray | None = None
    ) -> Contact:
        """``contact`` with the largest violation found; without success where it is too large.

        ``position`` is that of the bodies, as the system's; ``settled`` the matrix times the
        pressures, if that is known.
        """
        pressure, system = contact.pressure, self.system
        if self.how.unilateral and 0 > pressure.min() >= -NOTHING * pressure.max():
            pressure = pressure.clip(0.0)
            contact = replace(contact, pressure=pressure)
        settled = system.matrix @ pressure if settled is None else settled
        moved = position @ system.planes
        gap = settled + system.gap - moved
        touching = pressure > 0 if self.how.unilateral else np.ones(len(gap), dtype=bool)
        violation = float(np.where(touching, np.abs(gap), -gap).max().clip(0))
        whole = system.matrix
        structure = whole if isinstance(whole, YieldingOperator) else None
        ground = settled if structure is None else structure.ground @ pressure
        largest = np.abs(ground).max()
        allowed = largest * max(GAP, SLACK * self.rtol, SLACK * self.how.gap_rtol)
        if not largest > 0:
            allowed = ROUNDING * max(np.abs(moved).max(), np.abs(system.gap).max())
        faults = [*self._load_faults(pressure), *self._row_faults(pressure, settled)]
        if violation > allowed and structure is not None and self.rounded:
            rounding = structure.rounding(pressure)
            allowed += SAMPLES * rounding
            if not rounding <= LOST * largest:
                faults.append(
                    f"by rounding deflections are known to {rounding:.1e} only, where the ground "
                    f"settles by up to {largest:.1e}; likely cause: a structure far softer than "
                    "the ground, or held by far softer springs. Remedy: a stiffer one, or "
                    "flexible_settlement for loads on the ground itself"
                )
        if not violation <= allowed:
            faults.append(f"ground and body are apart in contact, or overlap, by {violation:.1e}")
        if self.how.unilateral and not pressure.min() >= 0:
            faults.append(f"the ground pulls by {-pressure.min():.1e}")
        # in any units
        if largest > 0 and not (system.areas * (pressure / np.abs(pressure).max())) @ ground > 0:
            faults.append(
                "pressures do no work on the ground, their settlement has the wrong sign; likely "
                "cause: layers thinner than the cells. Remedy: a finer mesh"
            )
        if faults and contact.success:
            message = f"the equations do not hold: {'; '.join(faults)}"
            contact = replace(contact, success=False, message=message)
        return replace(contact, residual=violation)

    def _load_faults(self, pressure: ndarray) -> Iterator[str]:
        """Loads that pressures do not balance, in units of the forces that do their work."""
        given, system = self.constraints.given, self.system
        if not len(given):
            return
        _, balance, unit = system.scaled(self.constraints)
        acting = balance @ system.resultants
        error = np.abs(acting @ pressure - given / unit)
        # the loads of a body are measured by the largest of them
        work = np.abs(acting)
        same = work @ work.T > 0
        imposed = np.where(same, np.abs(given / unit), 0.0).max(axis=1)
        # by all cells of the bodies they act on, those without an arm too
        moved = np.abs(system.planes)
        bodies = (np.abs(balance) > 0) @ (moved @ moved.T > 0)
        borne = (bodies @ (moved > 0)) @ (system.areas * np.abs(pressure))
        felt = np.where(same, borne, 0.0).max(axis=1)
        # tiny ones by pressures as well, but beside a force, whose digits these have
        forced = (same & (acting >= 0).all(axis=1)).any(axis=1)
        least = np.where(forced, 0.0, BESIDE * felt)
        own = np.where(imposed > 0, np.maximum(imposed, least), felt)
        # beside far larger loads those of a body have fewer digits, pressures without load none
        fewer = np.where(imposed > 0, FEWER * own, np.inf)
        own = np.maximum(own, np.minimum(fewer, BESIDE * own.max()))
        error = error / np.maximum(own, np.finfo(float).tiny)
        if not (worst := float(error.max())) <= BALANCE:
            yield (
                f"the load is off by {worst:.1e} of itself, at most {BALANCE:g} is expected; "
                "likely cause: loads or positions of very different sizes together"
            )

    def _row_faults(self, pressure: ndarray, settled: ndarray) -> Iterator[str]:
        """Settlements that are not those by exact rows."""
        if self.exact is None:
            return
        numbers, rows = self.exact
        error = np.abs(rows @ pressure - settled[numbers])
        felt = np.maximum(np.abs(rows) @ np.abs(pressure), PART * np.abs(settled).max())
        allowed = max(ROWS, SLACK * self.rtol) * felt
        if len(bad := np.nonzero(~(error <= allowed))[0]):
            yield (
                f"the ground under cell {numbers[bad[0]]} settles by {error[bad[0]]:.1e} more or "
                "less than the operator says; likely cause: a symmetry the cells do not have"
            )


def verified(
    system: ContactSystem,
    constraints: Constraints,
    how: How,
    start: ndarray | None,
    exact: ExactRows | None = None,
    rtol: float = 0.0,
) -> tuple[Contact, ndarray]:
    """Contact and position by the equations, and whether they obey them.

    Under a structure they are refined until they do, or as far as rounding lets.
    """
    contact, position = find_contact(system, constraints, how, start)
    # products of a structure are closer than the array formed of them
    refinable = contact.success and isinstance(system.matrix, YieldingOperator) and system.formed
    verify = Verification(system, constraints, how, exact, rtol)
    strict = replace(verify, rounded=False) if refinable else verify
    checked = strict(contact, position)
    if checked.success or not refinable:
        return checked, position
    for _ in range(STEPS):
        try:
            refined = _refined(system, constraints, contact, position)
        except ConvergenceError:  # on cells that hold it so little, rounding is what is left
            break
        again = strict(*refined)
        if not (again.success or again.residual < checked.residual):
            break
        (contact, position), checked = refined, again
        if checked.success:
            return checked, position
    return verify(contact, position), position


def _refined(
    system: ContactSystem, constraints: Constraints, contact: Contact, position: ndarray
) -> tuple[Contact, ndarray]:
    """Contact on the same cells, corrected by the gaps and forces that products leave."""
    D, planes = system.matrix, system.planes
    problem, inside = system.problem(constraints), np.nonzero(contact.touching)[0]
    left = replace(
        problem,
        matrix=system.array,
        gap=D @ contact.pressure + system.gap - position @ planes,
        given=problem.given - problem.resultants @ contact.pressure,
    )
    step, turn = between(left, inside)
    pressure = contact.pressure.copy()
    pressure[inside] += step
    position = position + system.scaled(constraints)[0] @ turn
    gap = D @ pressure + system.gap - position @ planes
    return replace(contact, pressure=pressure, motion=contact.motion + turn, gap=gap), position
