"""Positions of flat punches that lift off, by the work of pressures that end along a line.

Found by cells, contact ends between them, which leaves the tilt a part in a thousand off where
contact is small. So the line is drawn where it ends, and in the cells that it crosses pressures
vanish like the root of the distance, those of unit forces grow like its inverse, as the line moves
with the force, see `CrossedCells`. The line is drawn a second time by the better pressures, half
way between both: from one side it would swing to the other.

Where the line meets the edge of the plan the contact runs into a narrow strip, and the pressure is
that of a strip: ``(s / d)^(1/2)`` with the distance d to the edge.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix, hstack

from ..elements.crossed import CrossedCells
from ..grids.lines import Segments
from ..grids.nearest import nearest
from ..grids.polygons import readonly
from ..kernels.once import computed_once, remember
from ..operators.factors import Factors
from ..operators.symmetric_matrix import SymmetricMatrix
from .footprint import Footprint
from .problem import Contact
from .region import ContactRegion
from .sectors import Sectors

Regions = Sequence[ContactRegion]
Position = Callable[[ndarray], ndarray]
Compliances = tuple[ndarray, ndarray]

_MATRICES = ndarray, SymmetricMatrix

#: cells in contact from which on it has such a line, and up to how many it is cheap to draw it
FEWEST, MOST = 30, 3000
#: contact with more of a punch's plan tilts it right to 1e-4 as its cells have it, and settles it
#: to 4e-5: circles up to e = a / 2
WIDE = 0.75
#: lines that end nearer to a corner of the plan than so many cells have no such law
BESIDE = 3.0


class Points(NamedTuple):
    """Settlement of points by unit pressures on the cells of flat punches.

    Attributes
    ----------
    x : (2, k) array of float
        The points.
    rows : (k, n) array of float
        With the slopes of all cells.
    slopes : SlopeCorrection
        What these add.
    """

    x: ndarray
    rows: ndarray
    slopes: Any


@dataclass(frozen=True, eq=False)
class LineWork:
    """Cells of flat punches that lines cross, and the equations of pressures that end there.

    Attributes
    ----------
    work : Work
        The punches.
    under : tuple of CrossedCells or None
        The cells crossed under each punch.
    crossed, in_contact, flat : (n,) array of bool
        As of `CrossedCells`, and the cells without slopes.
    """

    work: Any
    under: tuple[CrossedCells | None, ...]
    crossed: ndarray
    in_contact: ndarray
    flat: ndarray

    @classmethod
    def of_each(
        cls, work: Any, regions: Sequence[Regions], contacts: Sequence[Contact]
    ) -> list["LineWork | None"]:
        """In each case, by regions of contact under the punches; None where no cell is crossed."""
        touching = np.stack([contact.touching for contact in contacts])
        under: list[list[CrossedCells | None]] = []
        for j, ((cells, *_), own) in enumerate(zip(work.parts, work.own, strict=True)):
            lines = _lines(cells, [region[j] for region in regions], touching[:, own])
            law = cells.partition, cells.fan, cells.weights
            under.append(CrossedCells.from_lines(*law, lines, touching[:, own]))
        cases = zip(contacts, zip(*under, strict=True), strict=True)
        return [cls._of(work, each, contact) for contact, each in cases]

    @classmethod
    def _of(
        cls, work: Any, under: tuple[CrossedCells | None, ...], contact: Contact
    ) -> "LineWork | None":
        if all(found is None for found in under):
            return None
        in_contact, crossed = contact.touching.copy(), np.zeros(len(contact.touching), dtype=bool)
        for own, found in zip(work.own, under, strict=True):
            if found is not None:
                in_contact[own], crossed[own] = found.in_contact, found.crossed
        flat = crossed if contact.flat is None else crossed | contact.flat
        return cls(work, under, crossed, in_contact, flat)

    @property
    def _parts(self) -> Iterator[tuple[Any, slice, CrossedCells]]:
        """Punches under which cells are crossed, where their cells are, and the crossed ones."""
        for part, own, found in zip(self.work.parts, self.work.own, self.under, strict=True):
            if found is not None:
                yield part, own, found

    @computed_once
    def columns(self) -> tuple[ndarray, csr_matrix]:
        """Cells by which slopes are lost or come, and the slopes that do, (2 n, c)."""
        (rows, cells, values), n = self.work.slopes, len(self.flat)
        own = self.crossed[cells]
        # crossed cells leave the slopes around them only, flat ones have none
        used = (self.flat[rows % n] != own) & (own | self.in_contact[cells])
        touched = self.crossed.copy()
        touched[cells[used]] = True
        columns, place = np.nonzero(touched)[0], np.cumsum(touched) - 1
        starts = np.append(0, np.cumsum(np.bincount(rows[used], minlength=2 * n)))
        entries = np.where(own, values, -values)[used], place[cells[used]], starts
        return columns, csr_matrix(entries, shape=(2 * n, len(columns)))

    @computed_once
    def change(self) -> ndarray:
        """By how much the pressures of these cells settle the collocation points otherwise than
        `Work.at_cells` has it, but for crossed ones, which do nothing by it; (c, n)."""
        _find_changes(self.work, [self])
        return self.change

    @computed_once
    def by_crossed(self) -> tuple[ndarray, ndarray]:
        """What crossed cells settle the collocation points by both laws, (2, k, n); their
        numbers."""
        by, cells = zip(*self._by_crossed(self.work.at_cells.x), strict=True)
        return np.concatenate(by, axis=1), np.concatenate(cells)

    def _by_crossed(self, x: ndarray) -> Iterator[tuple[ndarray, ndarray]]:
        """What crossed cells under each punch settle points, see `CrossedCells`; their numbers."""
        for (cells, *_), own, found in self._parts:
            yield found.influence(cells.substrate, x), found.cells + own.start

    @computed_once
    def laws(self) -> tuple[ndarray, ndarray]:
        """`pressures` by both."""
        return self.pressures(0), self.pressures(1)

    @computed_once
    def others(self) -> ndarray:
        """The same of cells that are not crossed, (n, 2 m)."""
        return np.where(self.crossed[:, None], 0.0, np.hstack(self.laws))

    def settled(self, points: Points, whole: ndarray, some: ndarray | slice) -> list[ndarray]:
        """Settlements of some points under both laws, (k, m) each; ``whole`` of all points those
        by `others` with all slopes."""
        of = self.work.problem.cells.slopes.of
        turned = np.where(self.flat[:, None], 0.0, of(np.hstack(self.laws))) - of(self.others)
        settled = np.hsplit((whole + points.slopes.apply(turned))[some], 2)
        for by, cells in self._by_crossed(np.ascontiguousarray(points.x[:, some])):
            for out, matrix, pressure in zip(settled, by, self.laws, strict=True):
                out += matrix.T @ pressure[cells]
        return settled

    def _carried(self, law: int) -> tuple[ndarray, ndarray, ndarray]:
        """Crossed cells out of contact, their neighbours and shares, see `LineLaw`."""
        of = [(found.laws[law], own.start) for _, own, found in self._parts]
        pairs = np.hstack([law.pairs + start for law, start in of])
        return pairs[0], pairs[1], np.concatenate([law.share for law, _ in of])

    @computed_once
    def _equations(self) -> tuple[ndarray, Factors, ndarray, ndarray]:
        """Of the first law: cells in contact, factors of their matrix; which of them are crossed
        or carry what crossed ones do, and what the second law adds by these, (t, k)."""
        (touching,), (columns, _) = np.nonzero(self.in_contact), self.columns
        by, cells = self.by_crossed
        by, change, rows = by[:, :, touching], self.change[:, touching], self.work.columns
        place = np.full(len(rows), -1)
        place[touching] = np.arange(len(touching))
        transposed, inside = _part(rows, touching, touching), self.in_contact[columns]
        transposed[place[columns[inside]]] += change[inside]
        outer, inner, _ = self._carried(0)
        own = self.in_contact[cells]
        special = np.union1d(cells[own], inner)
        # those out of contact have neither rows nor slopes of their own
        without = _part(rows, outer, touching) + change[np.searchsorted(columns, outer)]
        parts = np.zeros((2, len(special), len(touching)))
        for law, part in enumerate(parts):
            part[np.searchsorted(special, cells[own])] = by[law, own]
            carried = without + by[law, np.searchsorted(cells, outer)]
            share = self._carried(law)[2][:, None]
            np.add.at(part, np.searchsorted(special, inner), carried * share)
        transposed[place[special]] += parts[0]
        factors = Factors.from_matrix(transposed.T)
        return touching, factors, place[special], (parts[1] - parts[0]).T

    def pressures(self, law: int) -> ndarray:
        """By motions of unit size, (n, m)."""
        touching, factors, special, more = self._equations
        planes = self.work.problem.system.planes[:, touching] / self.work.unit[:, None]
        found = factors.solve(planes.T if law == 0 else np.hstack([planes.T, more]))
        if law == 1:  # by Woodbury's formula
            found, spread = np.hsplit(found, [len(planes)])
            left = np.eye(len(special)) + spread[special]
            found = found - spread @ np.linalg.solve(left, found[special])
        pressures = np.zeros((len(self.flat), len(planes)))
        pressures[touching] = found
        outer, inner, share = self._carried(law)
        np.add.at(pressures, outer, share[:, None] * pressures[inner])
        return pressures

    @computed_once
    def _flattened(self) -> ndarray:
        """Forces and moments of unit pressures where flat cells have no slopes."""
        (rows, cells, values), problem = self.work.slopes, self.work.problem
        resultants, n = problem.system.resultants.copy(), len(self.flat)
        moments = problem.cells.slopes.second_moments.reshape(2, 2 * n)[:, rows]
        lost = np.where(self.flat[rows % n], values, 0.0) * moments
        lost = np.stack([np.bincount(cells, each, n) for each in lost])
        for (_, body, _), own in zip(self.work.parts, self.work.own, strict=True):
            resultants[3 * body + 1 : 3 * body + 3, own] -= lost[:, own]
        return resultants

    def by_forces(self, law: int, pressures: ndarray) -> ndarray:
        """Motions of unit size by forces on them, as the collocation points have them."""
        resultants = self._flattened.copy()
        for (cells, body, _), own, found in self._parts:
            crossed, n = found.cells, len(cells)
            arms = found.centroids * found.areas * found.laws[law].density
            moments = np.stack([np.bincount(found.cell, arm, n)[crossed] for arm in arms])
            moments -= (cells.acting * cells.partition.areas)[:, crossed]
            resultants[3 * body + 1 : 3 * body + 3, crossed + own.start] += moments
        return np.linalg.inv(resultants / self.work.unit[:, None] @ pressures)

    def under_load(self, position: Position) -> tuple[ndarray, ndarray]:
        """Pressures under the load at the centroids of the cells, the law of the plan's edge
        apart, and gaps; (n,) each."""
        unit = self.pressures(0)
        motion = position(self.by_forces(0, unit))
        pressure = unit @ motion
        moved = motion / self.work.unit @ self.work.problem.system.planes
        by, cells = self.by_crossed
        settled = self.work.at_cells.rows @ pressure + pressure[self.columns[0]] @ self.change
        settled += pressure[cells] @ by[0]
        for _, own, found in self._parts:
            pressure[own] *= found.laws[0].relative
        inside = self.in_contact
        return np.where(inside, pressure, 0.0).clip(0), np.where(
            inside, 0.0, settled - moved
        ).clip(0)

    def compliances(self, own: Sectors, at_own: Points, whole: ndarray) -> Compliances:
        """Motions of unit size by forces on them, as of `Work`.

        ``own`` are the `sectors`; ``whole`` what those of all cells settle by `others` with all
        slopes.
        """
        work, (pressures, others) = self.work, self.laws
        by_points, unit = self.by_forces(0, pressures), others @ self.by_forces(1, others)
        settled, _ = self.settled(at_own, at_own.rows @ self.others, slice(None))
        apart = settled.T - work.planes_at(own)
        done = (unit[own.cell].T * own.load) @ apart.T
        cell = work.sectors.cell
        away = np.nonzero(~self.crossed[cell] & self.in_contact[cell])[0]
        loads = work.loads_of(unit, self.flat)[:, away]
        settled, grown = self.settled(work.at_sectors, whole, away)
        far = np.zeros(work.planes.shape)
        far[:, away] = grown.T - work.planes[:, away]
        close = work.close(far)
        apart = settled.T - work.planes[:, away]
        kept, every = (
            by_points + (done + (loads * some) @ apart.T) @ by_points
            for some in (close[cell[away]], 1.0)
        )
        return kept, every

    def sectors(self) -> Sectors:
        """Parts of the crossed cells that are in contact, under the pressures that grow."""
        out = []
        for _, own, found in self._parts:
            parts = int(found.part.max()) + 1
            key = found.cell.astype(np.int64) * parts + found.part
            key, at = np.unique(key, return_inverse=True)
            cell = key // parts
            load = found.areas * found.laws[1].density
            total = np.bincount(at, load)
            x = [np.bincount(at, load * a) / total for a in found.centroids]
            out.append(Sectors(np.stack(x), cell + own.start, total))
        return Sectors(*(np.concatenate(each, axis=-1) for each in zip(*out, strict=True)))


def _part(matrix: ndarray, rows: ndarray, columns: ndarray) -> ndarray:
    """Some rows and columns, three times as soon as by both at once."""
    return matrix.take(rows, axis=0).take(columns, axis=1)


def has_law(work: Any, contact: Contact) -> bool:
    """Whether pressures that end along lines are looked for.

    Not where contact covers three quarters of each plan or fewer than 30 cells, nor where no
    matrix of up to 3000 cells is known.
    """
    touching, known = contact.touching, isinstance(work.problem.operator, _MATRICES)
    weighted = all(part.footprint.weights is not None for part in work.parts)
    if not (known and weighted and len(touching) <= MOST and touching.sum() >= FEWEST):
        return False
    parts = zip(work.parts, work.own, strict=True)
    return not all(_wide(part.footprint, touching[own]) for part, own in parts)


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
    drawn = {i: each for i, each in enumerate(LineWork.of_each(work, regions, contacts)) if each}
    if drawn:
        regions = _half_way(work, drawn, positions, regions)
        again = LineWork.of_each(work, regions, [contacts[i] for i in drawn])
        drawn = {i: each for i, each in zip(drawn, again, strict=True) if each}
    if not drawn:
        return answers
    _find_changes(work, list(drawn.values()))
    own = {i: each.sectors() for i, each in drawn.items()}
    entries = work.problem.cells.entries(np.hstack([some.x for some in own.values()]))
    rows, begin = entries.matrix(), 0
    whole = work.at_sectors.rows @ np.hstack([each.others for each in drawn.values()])
    wholes = np.split(whole, len(drawn), axis=1)
    for (i, each), settled in zip(drawn.items(), wholes, strict=True):
        here = np.arange(begin, begin + len(own[i].cell))
        begin += len(here)
        points = Points(own[i].x, rows[here], entries.sloping.at(here))
        answers[i] = each.compliances(own[i], points, settled)
    return answers


def _find_changes(work: Any, lined: Sequence[LineWork]) -> None:
    """`LineWork.change` of several."""
    points, ends = work.at_cells, np.cumsum([len(each.columns[0]) for each in lined])
    change = np.zeros((len(points.rows), ends[-1]))
    points.slopes.add(change, hstack([each.columns[1] for each in lined], format="csr"))
    for each, own in zip(lined, np.split(change, ends[:-1], axis=1), strict=True):
        found, crossed = np.ascontiguousarray(own.T), each.crossed[each.columns[0]]
        found[crossed] -= work.columns[each.crossed]
        remember(each, "change", found)


def _half_way(
    work: Any,
    drawn: dict[int, LineWork],
    positions: Sequence[Position],
    regions: Sequence[Regions],
) -> list[list[ContactRegion]]:
    """Regions half way to those of the pressures under the loads, of cases with some numbers."""
    _find_changes(work, list(drawn.values()))
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
    gap = np.stack([np.where(each.touching, 0.0, each.gap.clip(0)) for each in contacts])
    every = zip(parts, own, strict=True)
    each = [regions_under(part, pressure[:, some], gap[:, some]) for part, some in every]
    return [list(case) for case in zip(*each, strict=True)]


def regions_under(cells: Footprint, pressure: ndarray, gap: ndarray) -> list[ContactRegion]:
    """Where one punch touches the ground, in k cases; pressures and gaps (k, n)."""
    return cells.triangles.fitted_each(pressure, gap, cells.substrate.surface.contact_modulus)


def _wide(cells: Footprint, touching: ndarray) -> bool:
    """Whether cells in contact are most of the plan of a punch."""
    areas = cells.partition.areas
    return bool(areas[touching].sum() > WIDE * areas.sum())


def _lines(cells: Footprint, regions: Regions, touching: ndarray) -> Segments:
    """Lines that have a law under one punch, in k cases; cells in contact (k, n)."""
    level = np.stack([region.level for region in regions])
    level[[_wide(cells, each) for each in touching]] = 1.0
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
    closest = nearest(x, np.array([0, x.shape[1]]), ends, np.zeros(len(picture), dtype=int), 1)[0]
    return np.unique(picture[away < BESIDE * size[closest[:, 0]]])
