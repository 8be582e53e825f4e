"""Cases of one punch together: what they take where it lifts off is shared by all of them."""

from collections.abc import Sequence

import numpy as np

from ..kernels.once import remember
from .along_lines import has_law, on_each
from .solution import PunchSolution
from .work import Alone

#: cells of cases that are looked at together: what they take stays in the cache
CELLS = 10_000


def prepare(solutions: Sequence[PunchSolution]) -> None:
    """Find where contact ends, and what flat punches settle by it, under one punch that lifts off.

    The solutions keep what is found, as if each had looked for it.
    """
    lifting = [each for each in solutions if (each.gap > 0).any()]
    step = max(CELLS // len(lifting[0].gap), 1) if lifting else 1
    for begin in range(0, len(lifting), step):
        some = lifting[begin : begin + step]
        _find_regions(some)
        _find_positions([s.member for s in some if isinstance(s.member, Alone) and s.success])


def _find_regions(solutions: Sequence[PunchSolution]) -> None:
    pressure = np.stack([each.pressure_in_points for each in solutions])
    gap = np.stack([each.gap for each in solutions])
    triangles = solutions[0].punch.footprint.triangles
    found = triangles.fitted_each(pressure, gap, solutions[0].contact_modulus)
    for each, region in zip(solutions, found, strict=True):
        remember(each, "contact_region", each.region_of(region))
        if isinstance(each.member, Alone) and each.line is None:
            remember(each.member, "region", region)


def _find_positions(members: Sequence[Alone]) -> None:
    some = [each for each in members if each.works and has_law(each.punch.work, each.contact)]
    if some:
        contacts, positions = [each.contact for each in some], [each.position for each in some]
        regions = [[each.region] for each in some]
        found = on_each(some[0].punch.work, contacts, positions, regions)
        for each, compliances in zip(some, found, strict=True):
            remember(each, "on_line", compliances)
