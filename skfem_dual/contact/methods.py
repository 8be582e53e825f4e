"""How contact is found: by which method, from where, and what is tried where that does not do."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
from numpy import ndarray

from ..errors import ConvergenceError
from ..kernels.limits import limited_threads
from ..kernels.progress import bars_shown
from ..messages import without_remedy
from ..operators.yielding import TOO_SOFT, YieldingOperator
from .load import Constraints
from .positions import apart, by_force, noise
from .problem import Contact, ContactProblem
from .system import ContactSystem
from .unilateral import MOST, How, active_set, beginning, conjugate_gradients

#: violation of the conditions on the gap to which iterations with a matrix go by default, and
#: how many there are before an active set ends what they began
EXACTLY, FEW = 1e-13, 100
UNANSWERED = "no force was found under which the settlement is the one imposed"
#: accuracy of gaps from which the active set is begun
ROUGHLY = 1e-6


def find_contact(
    system: ContactSystem, constraints: Constraints, how: How, start: ndarray | None = None
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
        contact, position = _unilateral(system, constraints, how, start)
    else:
        contact, position = system.bilateral(constraints)
    if not (np.isfinite(contact.pressure).all() and np.isfinite(position).all()):
        raise ConvergenceError("the loads are too large for floating-point numbers")
    return contact, position


def _unilateral(
    system: ContactSystem, constraints: Constraints, how: How, start: ndarray | None
) -> tuple[Contact, ndarray]:
    _, method, gap_rtol = how
    if method == "active-set" and not system.dense:
        raise ValueError(
            f"expected a dense matrix for the active set, got {system.matrix.shape[0]} cells. "
            'Remedy: method="cg", or a coarser mesh'
        )
    known = start is not None  # an answer nearby
    if start is None and not system.gap.any():
        full, position = system.bilateral(constraints)
        if (full.pressure >= -1e-13 * np.abs(full.pressure).max()).all():
            return replace(full, pressure=full.pressure.clip(0)), position
        start = full.pressure.clip(0)
    problem = system.problem(constraints)
    if constraints.conjugate:
        contact = _contact(system, problem, how, start)
        if not contact.success or noise(problem, contact):
            other = apart(problem, True) or apart(problem)
            if other is None:
                other = _from_all(system, problem, gap_rtol)
            contact = other or contact
    else:
        contact = _beside(system, constraints, problem, how, start, known)
    return contact, constraints.fixed + system.scaled(constraints)[0] @ contact.motion


def _beside(
    system: ContactSystem,
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
    soon = known or len(system.planes) > 3
    roads = [
        lambda: apart(problem, True),
        lambda: _elsewhere(system, constraints, problem, how),
        lambda: apart(problem),
    ]
    roads.insert(0 if soon else 2, lambda: _directly(system, problem, how, start))
    for road in roads:
        found = road()
        if found is not None:
            return found
    return Contact.nowhere(problem, message=UNANSWERED)


def _from_all(system: ContactSystem, problem: ContactProblem, gap_rtol: float) -> Contact | None:
    """Contact found from pressures on all cells: from too few no descent leads on."""
    every = np.ones(len(system.areas))
    settled = np.abs(problem.matrix @ every).max()
    if not settled > 0:  # on a period
        return None
    start = np.abs(problem.gap.min()) / settled * every
    contact = _gradients(system, problem, start, gap_rtol)
    if contact.success and system.explicit:
        polished = active_set(problem, contact.pressure > 0)
        contact = polished if polished.success else contact
    return contact if contact.success else None


def _elsewhere(
    system: ContactSystem, constraints: Constraints, problem: ContactProblem, how: How
) -> Contact | None:
    """The same by the force under which the settlement is the one imposed."""
    if how.method != "cg" and system.dense:  # from a rough answer the active set is soon there
        found = _by_force(system, constraints, problem, How(True, "cg", ROUGHLY))
        if found is None:
            return None
        polished = active_set(replace(problem, matrix=system.array), found[0].pressure > 0)
        if polished.success:
            return polished
    found = _by_force(system, constraints, problem, how)
    if found is None:
        return None
    contact, position = found
    motions = system.scaled(constraints)[0]
    motion = np.linalg.lstsq(motions, position - constraints.fixed, rcond=None)[0]
    gap = system.matrix @ contact.pressure + system.gap - position @ system.planes
    return replace(contact, motion=motion, gap=gap)


def _by_force(
    system: ContactSystem, constraints: Constraints, problem: ContactProblem, how: How
) -> tuple[Contact, ndarray] | None:
    """Contact and position, each force from the contact found last; None if none is found."""
    last: ndarray | None = None

    def solve(given: Constraints) -> tuple[Contact, ndarray]:
        nonlocal last
        answer = _unilateral(system, given, how, last)
        last = answer[0].pressure if answer[0].success else last
        return answer

    height = np.abs(system.gap - problem.gap).max() + np.ptp(system.gap)
    return by_force(constraints, system.stiffness, height, solve, how.gap_rtol)


def _directly(
    system: ContactSystem, problem: ContactProblem, how: How, start: ndarray | None
) -> Contact | None:
    """The same by the active set, if there are few cells and it finds one."""
    if how.method == "cg" or not (system.dense or system.formed):
        return None
    contact = _active_set(system, problem, start)
    return contact if contact.success and not noise(problem, contact) else None


def _active_set(system: ContactSystem, problem: ContactProblem, start: ndarray | None) -> Contact:
    own = replace(problem, matrix=system.array)
    return active_set(own, beginning(start, len(system.areas)), singular=system.singular)


def _contact(
    system: ContactSystem, problem: ContactProblem, how: How, start: ndarray | None
) -> Contact:
    """Contact by one method, or by the active set from where conjugate gradients ended."""
    n, (_, method, gap_rtol) = len(system.areas), how
    if method == "active-set":
        return _active_set(system, problem, start)
    if method == "auto" and system.formed:
        found = _gradients(system, problem, start, EXACTLY if system.explicit else gap_rtol, FEW)
    else:
        found = _gradients(system, problem, start, gap_rtol)
    if found.success or method == "cg" or not (system.formed or system.dense):
        return found
    problem, history = replace(problem, matrix=system.array), found.history
    for pressure in (found.pressure, start) if found.touching.any() else (start,):
        polished = active_set(problem, beginning(pressure, n))
        history += polished.history
        if polished.success:
            break
    return replace(polished, history=history)


def _gradients(
    system: ContactSystem,
    problem: ContactProblem,
    start: ndarray | None,
    gap_rtol: float,
    most: int = MOST,
) -> Contact:
    # threads of BLAS go on waiting for work, in the way of those of the products
    with nullcontext() if system.dense else limited_threads(1, "blas"):
        found = conjugate_gradients(problem, start, gap_rtol, most, bars_shown())
    if not found.success and isinstance(system.matrix, YieldingOperator):
        reason = without_remedy(found.message)
        found = replace(found, message=f"{reason}; {TOO_SOFT}")
    return found
