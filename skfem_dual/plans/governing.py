"""The loads of a plan that govern how fine its mesh has to be."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..bodies.punch import RigidPunch
from ..errors import MeshError, warnings_kept
from ..solutions.punch_solution import PunchSolution
from .problem import Problem

#: part of the contact of a load that may lie where no load that is judged has some
ELSEWHERE = 0.2


def governing(problem: Problem) -> Problem:
    """The same with fewer loads: that which acts farthest from the origin, and those that govern.

    These are the ones with the largest pressure, settlement and tilt and the least contact on the
    coarsest mesh. Loads that pull or turn the plan over have no say, nor have those so near its
    edge that the first meshes carry none there.

    Raises
    ------
    ValueError
        If all loads do.
    """
    if len(problem.loads) == 1:
        return problem
    faults = [problem.fault(load) for load in problem.loads]
    if all(faults):
        raise ValueError(
            f"expected a load that pressures balance, got {len(faults)} of which none is; the "
            f"first: {faults[0]}"
        )
    points = np.array([load.point or (0.0, 0.0) for load in problem.loads])
    stands = np.array([not fault for fault in faults])
    inwards = np.argsort(-np.hypot(*points.T), kind="stable")
    with warnings_kept():
        farthest, punch = _first_solved(problem, [int(k) for k in inwards if stands[k]])
        loads = [load.upright if stands[k] else load for k, load in enumerate(problem.loads)]
        cases = punch.solve_many(loads, unilateral=problem.unilateral)
    judged = {farthest}
    if cases.success.any():
        judged |= {extreme.number for extreme in cases.envelope()}
        judged = _with_contact_elsewhere(judged, cases.solutions, problem.plan.area)
    return replace(problem, loads=tuple(problem.loads[k] for k in sorted(judged)))


def _first_solved(problem: Problem, numbers: Sequence[int]) -> tuple[int, RigidPunch]:
    """The first of some loads that a coarse mesh carries, and the punch on that mesh."""
    for k in numbers:
        try:
            alone = replace(problem, loads=(problem.loads[k],))
            return k, alone.on_coarsest().solutions[0].punch
        except MeshError:  # whatever the load
            raise
        except ValueError as error:
            trouble = error
    raise trouble


def _with_contact_elsewhere(
    judged: set[int], solutions: Sequence[PunchSolution | None], area: float
) -> set[int]:
    """Those and cases in contact where none of them is, as long as less than half of the plan is
    looked at: only where cases that are judged touch meshes become finer."""
    found = {k: s for k, s in enumerate(solutions) if s is not None and s.success}
    areas = next(iter(found.values())).footprint.partition.areas
    touched = np.zeros(len(areas), dtype=bool)
    for k in judged & found.keys():
        touched[found[k].contact] = True
    for k, solution in found.items():
        if 2 * areas[touched].sum() > area:
            break
        own = solution.contact
        if areas[own[~touched[own]]].sum() > ELSEWHERE * areas[own].sum():
            judged = judged | {k}
            touched[own] = True
    return judged
