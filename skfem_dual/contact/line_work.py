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
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from ..elements.crossed import CrossedCells
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from ..operators.factors import Factors
from ..operators.symmetric_matrix import SymmetricMatrix
from .footprint import Footprint
from .problem import Contact
from .region import ContactRegion
from .sectors import Sectors

Regions = Sequence[ContactRegion]
Position = Callable[[ndarray], ndarray]
Settled = Callable[[ndarray], ndarray]

#: cells in contact from which on it has such a line, and up to how many it is cheap to draw it
FEWEST, MOST = 30, 3000
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
    def of(cls, work: Any, regions: Regions, contact: Contact) -> "LineWork | None":
        """By regions of contact under the punches; None if no cell is crossed."""
        under: list[CrossedCells | None] = []
        in_contact, crossed = contact.touching.copy(), np.zeros(len(contact.touching), dtype=bool)
        for (cells, *_), own, region in zip(work.parts, work.own, regions, strict=True):
            found = None
            if region.edge and not _beside_corner(cells, region.edge):
                law = cells.partition, cells.fan, cells.weights
                found = CrossedCells.from_lines(*law, region.edge, in_contact[own])
            if found is not None:
                in_contact[own], crossed[own] = found.in_contact, found.crossed
            under.append(found)
        if not crossed.any():
            return None
        flat = crossed if contact.flat is None else crossed | contact.flat
        return cls(work, tuple(under), crossed, in_contact, flat)

    @property
    def _parts(self) -> Iterator[tuple[Any, slice, CrossedCells]]:
        """Punches under which cells are crossed, where their cells are, and the crossed ones."""
        for part, own, found in zip(self.work.parts, self.work.own, self.under, strict=True):
            if found is not None:
                yield part, own, found

    @computed_once
    def _change(self) -> tuple[ndarray, ndarray]:
        """Cells whose pressure settles the collocation points otherwise than `Work.at_cells` has
        it, (c,), and by how much under both laws, (2, n, c)."""
        (rows, cells, values), n, points = self.work.slopes, len(self.flat), self.work.at_cells
        own = self.crossed[cells]
        used = self.flat[rows % n] != own
        touched = self.crossed.copy()
        touched[cells[used]] = True
        columns, place = np.nonzero(touched)[0], np.cumsum(touched) - 1
        # crossed cells leave the slopes around them only, flat ones have none
        starts = np.append(0, np.cumsum(np.bincount(rows[used], minlength=2 * n)))
        entries = np.where(own, values, -values)[used], place[cells[used]], starts
        change = np.zeros((n, len(columns)))
        points.slopes.add(change, csr_matrix(entries, shape=(2 * n, len(columns))))
        change[:, self.crossed[columns]] -= points.rows[:, self.crossed]
        both = np.stack([change, change])
        for at, by in self._by_crossed(points.x):
            both[:, :, place[at]] += by
        return columns, both

    def _by_crossed(self, x: ndarray) -> Iterator[tuple[ndarray, ndarray]]:
        """Crossed cells under each punch, and what they settle points, see `CrossedCells`."""
        for (cells, *_), own, found in self._parts:
            yield found.cells + own.start, found.influence(cells.substrate, x)

    def settled(
        self, x: ndarray, whole: Settled, slopes: Any, laws: Sequence[ndarray]
    ) -> list[ndarray]:
        """Settlements of points under mean pressures of both laws, or of the first, (n, m) each.

        ``whole`` has those of cells with all slopes, ``slopes`` what these add.
        """
        pressures, of = np.hstack(laws), self.work.problem.cells.slopes.of
        others = np.where(self.crossed[:, None], 0.0, pressures)
        turned = np.where(self.flat[:, None], 0.0, of(pressures)) - of(others)
        settled = np.hsplit(whole(others) + slopes.apply(turned), len(laws))
        for cells, by in self._by_crossed(x):
            for out, matrix, pressure in zip(settled, by, laws, strict=False):
                out += matrix @ pressure[cells]
        return settled

    def _carried(self, law: int) -> tuple[ndarray, ndarray, ndarray]:
        """Crossed cells out of contact, their neighbours and shares, see `LineLaw`."""
        of = [(found.laws[law], own.start) for _, own, found in self._parts]
        pairs = np.hstack([law.pairs + start for law, start in of])
        return pairs[0], pairs[1], np.concatenate([law.share for law, _ in of])

    def pressures(self, law: int) -> ndarray:
        """By motions of unit size, (n, m)."""
        touching, (columns, change) = np.nonzero(self.in_contact)[0], self._change
        rows = self.work.at_cells.rows
        place = np.full(len(rows), -1)
        place[touching] = np.arange(len(touching))
        matrix, change = rows[np.ix_(touching, touching)], change[law, touching]
        inside = self.in_contact[columns]
        matrix[:, place[columns[inside]]] += change[:, inside]
        outer, inner, share = self._carried(law)
        by = rows[np.ix_(touching, outer)] + change[:, np.searchsorted(columns, outer)]
        np.add.at(matrix.T, place[inner], (by * share).T)
        planes = self.work.problem.system.planes[:, touching] / self.work.unit[:, None]
        pressures = np.zeros((len(rows), len(planes)))
        pressures[touching] = Factors.from_matrix(matrix).solve(planes.T)
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
            arms = found.triangles.centroids * found.triangles.areas * found.laws[law].density
            moments = np.stack([np.bincount(found.cell, arm, n)[crossed] for arm in arms])
            moments -= (cells.acting * cells.partition.areas)[:, crossed]
            resultants[3 * body + 1 : 3 * body + 3, crossed + own.start] += moments
        return np.linalg.inv(resultants / self.work.unit[:, None] @ pressures)

    def drawn_again(self, regions: Regions, position: Position) -> Regions:
        """Regions half way to those of the pressures under the load."""
        unit, again = self.pressures(0), list(regions)
        motion = position(self.by_forces(0, unit))
        pressure = unit @ motion
        moved = motion / self.work.unit @ self.work.problem.system.planes
        columns, change = self._change
        settled = self.work.at_cells.rows @ pressure + change[0] @ pressure[columns]
        gap = (settled - moved).clip(0)
        gap[self.in_contact] = 0.0
        for i, ((cells, *_), own, found) in enumerate(
            zip(self.work.parts, self.work.own, self.under, strict=True)
        ):
            if found is not None:
                inside = pressure[own] * found.laws[0].relative
                new = region_of(cells, np.where(found.in_contact, inside, 0.0).clip(0), gap[own])
                level = readonly((regions[i].level + new.level) / 2)
                again[i] = replace(regions[i], level=level)
        return again

    def compliances(self) -> tuple[ndarray, ndarray]:
        """Motions of unit size by forces on them, as of `Work`."""
        work, pressures, others = self.work, self.pressures(0), self.pressures(1)
        by_points, unit = self.by_forces(0, pressures), others @ self.by_forces(1, others)
        own = self._sectors()
        entries = work.problem.cells.entries(own.x)
        (settled,) = self.settled(own.x, entries.settlements, entries.sloping, [pressures])
        apart = settled.T - work.planes_at(own)
        done = (unit[own.cell].T * own.load) @ apart.T
        cell = work.sectors.cell
        away = np.nonzero(~self.crossed[cell] & self.in_contact[cell])[0]
        loads = work.loads_of(unit, self.flat)[:, away]
        points, far = work.at_sectors, np.zeros(work.planes.shape)
        settled, grown = self.settled(
            np.ascontiguousarray(points.x[:, away]),
            lambda whole: (points.rows @ whole)[away],
            points.slopes.at(away),
            [pressures, others],
        )
        far[:, away] = grown.T - work.planes[:, away]
        close = work.close(far)
        apart = settled.T - work.planes[:, away]
        kept, every = (
            by_points + (done + (loads * some) @ apart.T) @ by_points
            for some in (close[cell[away]], 1.0)
        )
        return kept, every

    def _sectors(self) -> Sectors:
        """Parts of the crossed cells that are in contact, under the pressures that grow."""
        out = []
        for _, own, found in self._parts:
            parts = int(found.part.max()) + 1
            key = found.cell.astype(np.int64) * parts + found.part
            key, at = np.unique(key, return_inverse=True)
            cell = key // parts
            load = found.triangles.areas * found.laws[1].density
            total = np.bincount(at, load)
            x = [np.bincount(at, load * a) / total for a in found.triangles.centroids]
            out.append(Sectors(np.stack(x), cell + own.start, total))
        return Sectors(*(np.concatenate(each, axis=-1) for each in zip(*out, strict=True)))


def on_lines(
    work: Any, contact: Contact, position: Position, drawn: Callable[[], Regions] | None = None
) -> tuple[ndarray, ndarray] | None:
    """Motions of unit size by forces on them, see `LineWork.compliances`, both of shape (m, m).

    None where contact covers the plans or fewer than 30 cells, where no matrix of up to 3000 cells
    is known, and where no line ends away from the corners of a plan. ``position`` takes such a
    compliance to the position under the load, in unit motions; ``drawn`` gives the regions of
    contact, if they serve others too.
    """
    known = isinstance(work.problem.operator, (ndarray, SymmetricMatrix))
    weighted = all(part.footprint.weights is not None for part in work.parts)
    touching, n = contact.touching, len(contact.touching)
    if not (known and weighted and n <= MOST and FEWEST <= touching.sum() < n):
        return None
    regions = regions_of(work, contact) if drawn is None else drawn()
    found = LineWork.of(work, regions, contact)
    if found is not None:
        found = LineWork.of(work, found.drawn_again(regions, position), contact)
    return None if found is None else found.compliances()


def regions_of(work: Any, contact: Contact) -> list[ContactRegion]:
    """Where each punch touches the ground."""
    gap = np.where(contact.touching, 0.0, contact.gap.clip(0))
    return [
        region_of(part.footprint, contact.pressure[own], gap[own])
        for part, own in zip(work.parts, work.own, strict=True)
    ]


def region_of(cells: Footprint, pressure: ndarray, gap: ndarray) -> ContactRegion:
    """Where one punch touches the ground."""
    return cells.triangles.region(pressure, gap, cells.substrate.surface.contact_modulus)


def _beside_corner(cells: Footprint, lines: list[ndarray]) -> bool:
    """Whether a line ends next to a corner of the plan."""
    corners = None if cells.weights is None else cells.weights.corners
    open_ends = [line[:, [0, -1]] for line in lines if (line[:, 0] != line[:, -1]).any()]
    if corners is None or len(corners.node) == 0 or not open_ends:
        return False
    ends = np.hstack(open_ends)
    away = np.hypot(*(ends[:, None] - corners.x.T[:, :, None])).min(axis=0)
    size = np.sqrt(cells.partition.areas)
    nearest = cKDTree(cells.partition.centroids.T).query(ends.T)[1]
    return bool((away < BESIDE * size[nearest]).any())
