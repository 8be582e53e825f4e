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
from scipy.sparse import block_diag, csr_matrix, eye_array
from scipy.spatial import cKDTree

from ..elements.crossed import CrossedCells
from ..elements.influence import influence_matrix
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
    rows, without : (k, n) array of float
        With the slopes of all cells, and without.
    slopes : SlopeCorrection
        What these add.
    """

    x: ndarray
    rows: ndarray
    without: ndarray
    slopes: Any

    @classmethod
    def of(cls, cells: Any, x: ndarray, rows: ndarray) -> "Points":
        """Points and their rows."""
        slopes, without = cells.slope_correction(x), rows.copy()
        slopes.add_to(without, cells.slopes, -1.0)
        return cls(x, rows, without, slopes)


class Influence(NamedTuple):
    """Settlement of points by unit pressures on cells, (k, n), those of crossed cells left to
    triangles under each punch that has some, (k, m)."""

    rows: ndarray
    triangles: list[ndarray]


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

    def influence(self, points: Points) -> Influence:
        """Settlements of points."""
        rows = points.rows.copy()
        points.slopes.add_to(rows, self.work.problem.cells.slopes.without(~self.flat), -1.0)
        rows[:, self.crossed] -= points.without[:, self.crossed]
        by = [
            influence_matrix(cells.substrate, found.triangles, points.x)
            for (cells, *_), _, found in self._parts
        ]
        return Influence(rows, by)

    @computed_once
    def _at_cells(self) -> Influence:
        return self.influence(self.work.at_cells)

    def settled(self, influence: Influence, law: int, pressures: Any) -> ndarray:
        """Settlements by mean pressures of one law, (n, k) array or sparse matrix."""
        rows, triangles = influence
        settled = rows @ pressures
        for by, (_, own, found) in zip(triangles, self._parts, strict=True):
            settled += by @ (found.laws[law].density @ pressures[own])
        return settled

    def pressures(self, law: int) -> ndarray:
        """By motions of unit size, (n, m)."""
        touching = np.nonzero(self.in_contact)[0]
        blocks = [
            eye_array(len(part.footprint)) if found is None else found.laws[law].carried
            for part, found in zip(self.work.parts, self.under, strict=True)
        ]
        carried = csr_matrix(block_diag(blocks))[:, touching]
        planes = self.work.problem.system.planes[:, touching] / self.work.unit[:, None]
        matrix = self.settled(self._at_cells, law, carried)[touching]
        return carried @ Factors.from_matrix(matrix).solve(planes.T)

    def by_forces(self, law: int, pressures: ndarray) -> ndarray:
        """Motions of unit size by forces on them, as the collocation points have them."""
        resultants = np.array(self.work.problem.flattened_resultants(self.flat))
        for (cells, body, _), own, found in self._parts:
            triangles, density = found.triangles, found.laws[law].density
            moments = (triangles.centroids * triangles.areas) @ density
            moments -= np.where(found.crossed, cells.acting * cells.partition.areas, 0.0)
            resultants[3 * body + 1 : 3 * body + 3, own] += moments
        return np.linalg.inv(resultants / self.work.unit[:, None] @ pressures)

    def drawn_again(self, regions: Regions, position: Position) -> Regions:
        """Regions half way to those of the pressures under the load."""
        unit, again = self.pressures(0), list(regions)
        motion = position(self.by_forces(0, unit))
        pressure = unit @ motion
        moved = motion / self.work.unit @ self.work.problem.system.planes
        gap = (self.settled(self._at_cells, 0, pressure) - moved).clip(0)
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
        points = Points.of(work.problem.cells, own.x, work.rows_at(own.x))
        apart = self.settled(self.influence(points), 0, pressures).T - work.planes_at(own)
        done = (unit[own.cell].T * own.load) @ apart.T
        influence, cell = self.influence(work.at_sectors), work.sectors.cell
        away = ~self.crossed[cell] & self.in_contact[cell]
        loads = np.where(away, work.loads_of(unit, self.flat), 0.0)
        close = work.close(np.where(away, self.settled(influence, 1, others).T - work.planes, 0.0))
        apart = self.settled(influence, 0, pressures).T - work.planes
        kept, every = (
            by_points + (done + (loads * some) @ apart.T) @ by_points
            for some in (close[cell], 1.0)
        )
        return kept, every

    def _sectors(self) -> Sectors:
        """Parts of the crossed cells that are in contact, under the pressures that grow."""
        out = []
        for _, own, found in self._parts:
            key = np.stack([found.cell, found.part])
            (cell, _), at = np.unique(key, axis=1, return_inverse=True)
            load = found.triangles.areas * np.asarray(found.laws[1].density.sum(axis=1)).ravel()
            total = np.bincount(at.ravel(), load)
            x = [np.bincount(at.ravel(), load * a) / total for a in found.triangles.centroids]
            out.append(Sectors(np.stack(x), cell + own.start, total))
        return Sectors(*(np.concatenate(each, axis=-1) for each in zip(*out, strict=True)))


def on_lines(work: Any, contact: Contact, position: Position) -> tuple[ndarray, ndarray] | None:
    """Motions of unit size by forces on them, see `LineWork.compliances`, both of shape (m, m).

    None where contact covers the plans or fewer than 30 cells, where no matrix of up to 3000 cells
    is known, and where no line ends away from the corners of a plan. ``position`` takes such a
    compliance to the position under the load, in unit motions.
    """
    known = isinstance(work.problem.operator, (ndarray, SymmetricMatrix))
    weighted = all(part.footprint.weights is not None for part in work.parts)
    touching, n = contact.touching, len(contact.touching)
    if not (known and weighted and n <= MOST and FEWEST <= touching.sum() < n):
        return None
    gap = np.where(touching, 0.0, contact.gap.clip(0))
    regions = [
        region_of(part.footprint, contact.pressure[own], gap[own])
        for part, own in zip(work.parts, work.own, strict=True)
    ]
    found = LineWork.of(work, regions, contact)
    if found is not None:
        found = LineWork.of(work, found.drawn_again(regions, position), contact)
    return None if found is None else found.compliances()


def region_of(cells: Footprint, pressure: ndarray, gap: ndarray) -> ContactRegion:
    """Where one punch touches the ground."""
    return cells.triangles.fitted(pressure, gap, cells.substrate.surface.contact_modulus)


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
