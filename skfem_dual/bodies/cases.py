"""Load cases: one punch, or several on one ground, under many loads."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numpy import ndarray

from ..arguments import checked_instance, checked_sequence
from ..contact.footprint import Footprint
from ..contact.load import Constraints, Load, Share
from ..contact.many import ManyLoads
from ..contact.motions import require_grip
from ..contact.one_sign import solved_each
from ..contact.problem import Contact
from ..contact.unilateral import How
from ..contact.verify import Verification
from ..errors import ConvergenceError, ConvergenceWarning, ResolutionWarning, warn
from ..kernels.limits import threads_for_matrix
from ..kernels.progress import progress_bars
from ..solutions.cases_solution import CasesSolution
from ..solutions.punch_solution import PunchSolution
from .rigid import RigidBodies

Cases = Sequence[Any] | Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class CaseAnswers:
    """Answers of all punches in all cases.

    Attributes
    ----------
    names : tuple of str
        Of the cases.
    answers : tuple of tuple of PunchSolution, or None
        Of each case those of the punches; None where no pressures can balance the loads.
    messages : tuple of str
        What was found of all punches together, or why not.
    rough : tuple of str
        Warnings of contact on few cells, or hardly wider than one.
    """

    names: tuple[str, ...]
    answers: tuple[tuple[PunchSolution, ...] | None, ...]
    messages: tuple[str, ...]
    rough: tuple[str, ...]

    def of(self, number: int, cells: Footprint, loads: Sequence[Load]) -> CasesSolution:
        """Those of one punch, with the positions found where it has only a share of a load."""
        mine = tuple(None if answer is None else answer[number] for answer in self.answers)
        own = tuple(
            load if solution is None or not isinstance(load, Share) else solution.load
            for load, solution in zip(loads, mine, strict=True)
        )
        told = tuple(
            message if solution is None else solution.message
            for solution, message in zip(mine, self.messages, strict=True)
        )
        return CasesSolution(cells, self.names, own, mine, told)

    def warn(self) -> None:
        """Warn the caller of a solver of cases without success, and of rough ones."""
        k = len(self.names)
        bad = [
            f"{name!r}: {message}"
            for name, answer, message in zip(self.names, self.answers, self.messages)
            if answer is None or not all(s.success for s in answer)
        ]
        if bad:
            message = f"{len(bad)} of {k} load cases without a solution; {bad[0]}"
            warn(message, ConvergenceWarning)
        if self.rough:
            message = f"{self.rough[0]} ({len(self.rough)} of {k} load cases)"
            warn(message, ResolutionWarning)


def named(cases: Cases) -> tuple[tuple[str, ...], list[Any]]:
    """Names and loads of cases; the names of a sequence are its numbers from 1.

    Raises
    ------
    TypeError, ValueError
        If they are no sequence or mapping, there are none, or a name is no text.
    """
    if isinstance(cases, Mapping):
        names = tuple(checked_instance("the name of a load case", name, str) for name in cases)
        loads = list(cases.values())
    else:
        loads = checked_sequence("cases", cases)
        names = tuple(str(number) for number in range(1, len(loads) + 1))
    if not loads:
        raise ValueError("expected at least one load case, got none")
    return names, loads


def solve_cases(
    problem: RigidBodies,
    names: tuple[str, ...],
    loads: Sequence[tuple[Load, ...]],
    how: How,
    progress: bool,
) -> CaseAnswers:
    """Solve and verify cases; ``loads`` has the loads of the bodies in each."""
    imposed: dict[int, Constraints] = {}
    messages = [""] * len(names)
    for k, each in enumerate(loads):
        try:
            imposed[k] = problem.constraints(each, how.unilateral)
        except ValueError as error:  # the other cases do not depend on it
            messages[k] = str(error)
    answers: list[tuple[PunchSolution, ...] | None] = [None] * len(names)
    rough: list[str] = []
    over: dict[RigidBodies, list[int]] = {}
    begin = perf_counter()
    for k, (contact, position) in _verified(problem, imposed, how, progress).items():
        if contact.success and (sharp := problem.over_edge(contact.pressure)) is not None:
            over.setdefault(sharp, []).append(k)
            continue
        try:
            for load, own in zip(loads[k], problem.cells_of_bodies, strict=True):
                pressed = contact.pressure[own] != 0
                if load.shear is not None and (load.shear.any() or pressed.any()):
                    require_grip(pressed)
        except ValueError as error:
            messages[k] = str(error)
            continue
        timings = problem.timings | {"all cases": perf_counter() - begin}
        answers[k] = problem.answers(loads[k], contact, position, timings)
        messages[k] = contact.message or contact.description
        if contact.success and (few := problem.rough(contact)):
            rough.append(f"{few[0]}; first in case {names[k]!r}")
    if not how.unilateral and any(a is not None and a[0].success for a in answers):
        problem.warn_of_pulling()
    for sharp, some in over.items():
        named = tuple(names[k] for k in some)
        found = solve_cases(sharp, named, [loads[k] for k in some], how, progress)
        for k, answer, message in zip(some, found.answers, found.messages, strict=True):
            answers[k], messages[k] = answer, message
        rough += found.rough
    return CaseAnswers(names, tuple(answers), tuple(messages), tuple(rough))


def _verified(
    problem: RigidBodies, imposed: dict[int, Constraints], how: How, progress: bool
) -> dict[int, tuple[Contact, ndarray]]:
    """Contact and position in the cases, with success only where the equations hold."""
    if not imposed:
        return {}
    given, system = list(imposed.values()), problem.system
    verify = problem.verification(given[0], how)
    # threads are limited once, not for each case
    limits = threads_for_matrix(len(problem.cells))
    with np.errstate(over="ignore", invalid="ignore"), progress_bars(progress), limits:
        many = ManyLoads(system, problem.cells, given, how)
        found = many.solve()
        pressure = np.column_stack([contact.pressure for contact, _ in found])
        if not np.isfinite(pressure).all():
            raise ConvergenceError("the loads are too large for floating-point numbers")
        settled = (system.matrix @ pressure).T
        answers = [
            (replace(verify, constraints=c)(*own, w), own[1])
            for c, own, w in zip(given, found, settled, strict=True)
        ]
        if how.unilateral:
            find = partial(_flattened, problem, many, verify, how)
            answers = solved_each(problem.cells, answers, find)
        every = zip(imposed, given, answers, strict=True)
        lined = ((k, c, problem.with_line_law(c, how, own)) for k, c, own in every)
        return {k: problem.kept(c, how, own) for k, c, own in lined}


def _flattened(
    problem: RigidBodies,
    many: ManyLoads,
    verify: Verification,
    how: How,
    some: list[int],
    flat: ndarray,
    starts: ndarray,
) -> list[tuple[Contact, ndarray]]:
    """Contact and position in the cases with some numbers where some cells are flat, verified."""
    cells, answers = problem.cells, []
    found = [many.flattened(i, *known) for i, *known in zip(some, flat, starts, strict=True)]
    pressure = np.stack(
        [own[0].pressure if own else np.zeros(len(cells)) for own in found], axis=1
    )
    lost = np.where(flat.T, cells.slopes_of(pressure), 0.0)
    settled = problem.system.matrix @ pressure
    if cells.sloping is not None:
        settled = settled - cells.sloping.apply(lost)
    for i, own, cut, start, w in zip(some, found, flat, starts, settled.T, strict=True):
        given = many.constraints[i]
        if own is None:
            answers.append(problem.flattened(given, cut, start, how))
            continue
        contact, position, system, slopes = own
        exact = None if verify.exact is None else many.flattened_rows(verify.exact, slopes)
        check = replace(verify, constraints=given, system=system, exact=exact)
        answers.append((check(contact, position, w), position))
    return answers
