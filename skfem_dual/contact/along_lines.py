"""Positions of flat punches that lift off, in some cases at a time.

The line where contact ends is drawn by the pressures of the cells, and a second time by those that
end along it, half way between both: from one side it would swing to the other. Cases are pictures
of one plan, see `Segments`: lines, crossed cells and settlements of all are found together.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy import ndarray

from ..elements.crossed import CrossedCells
from ..elements.influence import influence_matrix
from ..grids.lines import Segments
from ..grids.nearest import nearest
from ..grids.polygons import readonly
from ..operators.symmetric_matrix import SymmetricMatrix
from .footprint import Footprint
from .line_work import Compliances, LineWork, Points, Position, find_changes
from .problem import Contact
from .region import ContactRegion

Regions = Sequence[ContactRegion]

_MATRICES = ndarray, SymmetricMatrix

#: cells in contact from which on it has such a line: with 18 to 32 tilts are 2 to 8 times closer
#: with it, with 14 off by a tenth; and up to how many it is cheap to draw it
FEWEST, MOST = 16, 3000
#: contact with more of a punch's plan tilts it right to 1e-4 as its cells have it, and settles it
#: to 4e-5: circles up to e = a / 2; no contact of equal cells covers just that
WIDE = 0.7503
#: across cells as thin, by squares of their radii over areas, the law spoils more than it gains:
#: twelve times as long as wide they tilt a strip by 2 % too little, with it, without it by 3e-4
THIN = 2.0
#: lines that end nearer to a corner of the plan than so many cells have no such law
BESIDE = 3.0


def has_law(work: Any, contact: Contact) -> bool:
    """Whether pressures that end along lines are looked for.

    Not where contact covers three quarters of each plan or fewer than 16 cells, or ends in thin
    cells or on a crust that bends away, nor under a punch of more than 3000 cells, where no matrix
    is known, or positions were imposed.
    """
    if contact.compliances is not None:
        return False
    touching, known = contact.touching, isinstance(work.system.matrix, _MATRICES)
    weighted = all(part.footprint.weights is not None for part in work.parts)
    most = max(own.stop - own.start for own in work.own)
    if not (known and weighted and most <= MOST and touching.sum() >= FEWEST):
        return False
    parts = zip(work.parts, work.own, strict=True)
    return not all(_without(part.footprint, touching[own]) for part, own in parts)


def on_each(
    work: Any,
    contacts: Sequence[Contact],
    positions: Sequence[Position],
    regions: Sequence[Regions],
) -> list[Compliances | None]:
    """Motions of unit size by forces on them, see `LineWork.compliances`, both of shape (m, m), in
    each of some cases.

    None where no line ends away from the corners of a plan. ``positions`` take such a compliance
    to the position under the load, in unit motions; ``regions`` are those of contact.
    """
    answers: list[Compliances | None] = [None] * len(contacts)
    drawn = {i: each for i, each in enumerate(_line_works(work, regions, contacts, 1)) if each}
    if drawn:
        regions = _half_way(work, drawn, positions, regions)
        again = _line_works(work, regions, [contacts[i] for i in drawn], 2)
        drawn = {i: each for i, each in zip(drawn, again, strict=True) if each}
    if not drawn:
        return answers
    find_changes(work, list(drawn.values()))
    own = {i: each.sectors() for i, each in drawn.items()}
    cells, begin = work.cells, 0
    entries = cells.entries(np.hstack([some.x for some in own.values()]))
    rows = influence_matrix(cells.ground, cells.partition, entries.x, cells.weights)
    entries.correction.add_to(rows)
    whole = work.sloped(np.hstack([each.others for each in drawn.values()]))
    wholes = np.split(whole, len(drawn), axis=1)
    for (i, each), settled in zip(drawn.items(), wholes, strict=True):
        here = np.arange(begin, begin + len(own[i].cell))
        begin += len(here)
        points = Points(own[i].x, rows[here], entries.sloping.at(here))
        answers[i] = each.compliances(own[i], points, settled)
    return answers


def _line_works(
    work: Any, regions: Sequence[Regions], contacts: Sequence[Contact], nlaws: int
) -> list[LineWork | None]:
    """In each case, by regions of contact under the punches; None where no cell is crossed."""
    touching = np.stack([contact.touching for contact in contacts])
    under: list[list[CrossedCells | None]] = []
    for j, ((cells, *_), own) in enumerate(zip(work.parts, work.own, strict=True)):
        lines = _lines(cells, [region[j] for region in regions], touching[:, own])
        law = cells.partition, cells.fan, cells.weights
        under.append(CrossedCells.from_lines(*law, lines, touching[:, own]))
    cases = zip(contacts, zip(*under, strict=True), strict=True)
    return [LineWork.of(work, each, contact, nlaws) for contact, each in cases]


def _half_way(
    work: Any,
    drawn: dict[int, LineWork],
    positions: Sequence[Position],
    regions: Sequence[Regions],
) -> list[list[ContactRegion]]:
    """Regions half way to those of the pressures under the loads, of cases with some numbers."""
    find_changes(work, list(drawn.values()))
    under = {i: each.under_load(positions[i]) for i, each in drawn.items()}
    again = {i: list(regions[i]) for i in drawn}
    for j, ((cells, *_), own) in enumerate(zip(work.parts, work.own, strict=True)):
        some = [i for i, each in drawn.items() if each.under[j] is not None]
        if some:
            pressure, gap = (np.stack([under[i][k][own] for i in some]) for k in (0, 1))
            for i, new in zip(some, regions_under(cells, pressure, gap), strict=True):
                level = readonly((regions[i][j].level + new.level) / 2)
                again[i][j] = replace(regions[i][j], level=level)
    return list(again.values())


def regions_of(
    parts: Sequence[Footprint], own: Sequence[slice], contacts: Sequence[Contact]
) -> list[list[ContactRegion]]:
    """Where each punch touches the ground, by its cells among those of all, in each case."""
    pressure = np.stack([contact.pressure for contact in contacts])
    gap = np.stack([each.clearance for each in contacts])
    every = zip(parts, own, strict=True)
    each = [regions_under(part, pressure[:, some], gap[:, some]) for part, some in every]
    return [list(case) for case in zip(*each, strict=True)]


def regions_under(cells: Footprint, pressure: ndarray, gap: ndarray) -> list[ContactRegion]:
    """Where one punch touches the ground, in k cases; pressures and gaps (k, n)."""
    return cells.triangles.fitted_each(pressure, gap, cells.contact_modulus)


def _without(cells: Footprint, touching: ndarray) -> bool:
    """Whether cells in contact are most of the plan of a punch, or contact ends in thin ones, or
    on a crust that bends away inside: between contact and what hardly touches is no such line.

    Settlements on crusts were up to 15 % off with one, tilts doubled, without it some 1e-3.
    """
    areas = cells.partition.areas
    if areas[touching].sum() > WIDE * areas.sum() or cells.bends_away:
        return True
    ends = cells.partition.across(touching)
    square = cells.partition.polygons.radii[ends] ** 2
    return bool(ends.size and np.median(square / areas[ends]) > THIN)


def _lines(cells: Footprint, regions: Regions, touching: ndarray) -> Segments:
    """Lines that have a law under one punch, in k cases; cells in contact (k, n)."""
    level = np.stack([region.level for region in regions])
    level[[_without(cells, each) for each in touching]] = 1.0
    lines = cells.triangles.edges(level)
    beside = _beside_corner(cells, lines)
    if not len(beside):
        return lines
    level[beside] = 1.0
    return cells.triangles.edges(level)


def _beside_corner(cells: Footprint, lines: Segments) -> ndarray:
    """Pictures in which a line ends next to a corner of the plan."""
    corners = None if cells.weights is None else cells.weights.corners
    if corners is None or len(corners.node) == 0 or lines.begin.shape[1] == 0:
        return np.empty(0, dtype=int)
    every = np.hstack([lines.begin, lines.end]).T
    picture = np.tile(lines.picture, 2)
    _, at, count = np.unique(
        np.column_stack([picture, every]), axis=0, return_index=True, return_counts=True
    )
    ends, picture = every[at[count == 1]].T, picture[at[count == 1]]
    away = np.hypot(*(ends[:, None] - corners.x.T[:, :, None])).min(axis=0)
    x, size = cells.partition.centroids, np.sqrt(cells.partition.areas)
    closest = nearest(x, np.array([0, x.shape[1]]), ends, np.zeros(len(picture), dtype=int), 1)
    return np.unique(picture[away < BESIDE * np.sum(size[closest.number] * closest.share, axis=1)])
