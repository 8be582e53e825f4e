"""What a report is of: footings and structures by their names, each under its cases."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from ..arguments import checked_instance
from ..bodies.elastic import ElasticPunch
from ..contact.shapes import gap_values
from ..solutions.cases_solution import CasesSolution
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.group_solution import PunchesSolution
from ..solutions.punch_solution import PunchSolution
from .details import Details
from .footing import Between, Footing, require_points_on
from .structures import Structure

ReportedBody = Footing | Structure
#: distance of centroids over the extent of a body up to which they are in the same place
SAME = 1e-9


def bodies_of(solution: Any, details: Details) -> list[ReportedBody]:
    """The bodies of a report: one without a name, or several by their names.

    Solutions of one and the same body are its cases, also within a mapping of bodies.

    Parameters
    ----------
    solution
        As of `report_html`.
    details : Details
        Whose points are looked for on the plans.

    Raises
    ------
    TypeError, ValueError
        If something else is among them, cases are of different bodies, bodies stand on different
        ground, or points wanted are on none of the plans.
    """
    if isinstance(solution, PunchesSolution):
        solution = _named({"load": solution})
    elif isinstance(solution, Mapping) and solution and _all_of(PunchesSolution, solution):
        solution = _named(solution)
    if not isinstance(solution, Mapping) or _is_one(solution):
        solution = {"": solution}
    if not solution:
        raise ValueError("expected solutions of some bodies by their names, got none")
    bodies = []
    for name, found in solution.items():
        checked_instance("the name of a footing", name, str)
        bodies.append(_body(name, found, details))
    plans = [body.plan for body in bodies]
    grounds = {id(plan.substrate): plan.substrate for plan in plans}
    first, *others = grounds.values()
    if any(other != first for other in others):
        raise ValueError(
            "expected bodies on the same ground, got several. Remedy: a report for each ground"
        )
    require_points_on(plans, details.own_points)
    for of in ("accuracy", "plates", "columns"):
        if unknown := [name for name in getattr(details, of) if name not in solution]:
            alone = ". Remedy: {name: {case: solution}} for the name of a body alone"
            raise ValueError(
                f"expected {of} by the names of bodies, {list(solution)}, got {unknown}"
                f"{alone if list(solution) == [''] else ''}"
            )
    return bodies


def _named(cases: Mapping[str, PunchesSolution]) -> dict[str, Any]:
    """The solutions of several bodies in some cases by their names, numbers of those that have
    none."""
    names = [list(found.punches.names) for found in cases.values()]
    if any(set(others) != set(names[0]) for others in names):
        raise ValueError(f"expected cases of the same bodies, got bodies {names}")
    return {name: {case: found[name] for case, found in cases.items()} for name in names[0]}


def _all_of(kind: type, solutions: Mapping) -> bool:
    return all(isinstance(each, kind) for each in solutions.values())


def _is_one(solutions: Mapping) -> bool:
    """Whether solutions are cases of one body; one alone is of a structure, or a footing."""
    footings = len(solutions) > 1 and _all_of(PunchSolution, solutions)
    known = footings or _all_of(ElasticSolution, solutions)
    return known and _count(list(solutions.values())) == 1


def _count(solutions: Sequence[Any]) -> int:
    """Of how many bodies solutions are."""
    bodies: list[Any] = []
    for punch in {id(each.punch): each.punch for each in solutions}.values():
        if not any(_same(punch, body) for body in bodies):
            bodies.append(punch)
    return len(bodies)


def _same(a: Any, b: Any) -> bool:
    """Whether two punches are one but for the edge, which the contact of a shaped one chooses, or
    copies of each other, as from other processes."""
    if type(a) is not type(b) or a.substrate != b.substrate or a.origin != b.origin:
        return False
    pairs = [_content(punch) for punch in (a, b)]
    return all(np.array_equal(one, other) for one, other in zip(*pairs, strict=True))


def _content(punch: Any) -> list[Any]:
    """Arrays that tell a body from others on the same ground."""
    polygons = punch.partition.polygons
    middles = punch.partition.centroids
    gap = () if punch.gap is None else gap_values(punch.gap, middles)
    content = [polygons.p, polygons.indices, polygons.offsets, gap]
    if isinstance(punch, ElasticPunch):
        K, trace = punch.compliance.stiffness, punch.trace
        content += [K.data, K.indices, K.indptr, punch.compliance.fixed, trace.data, trace.indices]
    return content


def _body(name: str, found: Any, details: Details) -> ReportedBody:
    kinds = PunchSolution, CasesSolution, ElasticSolution, Mapping
    checked_instance(f"footing {name!r}", found, kinds)
    if isinstance(found, ElasticSolution):
        return Structure(name, {"load": found}, details)
    if not isinstance(found, Mapping):
        return Footing.of(name, found, details)
    if not found:
        raise ValueError(f"expected cases of {name!r} by their names, got none")
    for case, each in found.items():
        checked_instance(f"the name of a case of {name!r}", case, str)
        checked_instance(f"case {case!r} of {name!r}", each, (PunchSolution, ElasticSolution))
    if (count := _count(list(found.values()))) > 1:
        raise ValueError(
            f"expected cases of one body for {name!r}, got solutions of {count}. Remedy: "
            "a name for each body"
        )
    if isinstance(next(iter(found.values())), ElasticSolution):
        return Structure(name, dict(found), details)
    each = tuple(found.values())
    loads, messages = (tuple(getattr(s, what) for s in each) for what in ("load", "message"))
    cases = CasesSolution(each[0].punch.footprint, tuple(found), loads, each, messages)
    return Footing(name, cases, details)


def between(bodies: Sequence[ReportedBody]) -> list[Between]:
    """The differences of all pairs of bodies with centroids apart, in common cases."""
    found = []
    for a, b in combinations(bodies, 2):
        arm = b.plan.centre - a.plan.centre
        distance = float(np.hypot(*arm))
        if distance <= SAME * np.sqrt(a.plan.partition.areas.sum()):
            continue  # one lies in a hole of the other
        first, second = (
            dict(
                zip(body.names, np.where(body.success, body.mean_settlement, np.nan), strict=True)
            )
            for body in (a, b)
        )
        difference = {
            name: float(second[name] - first[name]) for name in a.names if name in second
        }
        sizes = {name: abs(value) for name, value in difference.items() if np.isfinite(value)}
        if sizes:
            case = max(sizes, key=sizes.__getitem__)
            found.append(Between(a.name, b.name, distance, difference[case], case))
    return found
