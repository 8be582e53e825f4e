"""Positions of flat punches that lift off, by the work of pressures that end along a line.

Found by cells, contact ends between them, which leaves the tilt a part in a thousand off where
contact is small. So the line is drawn where it ends, and in the cells that it crosses pressures
vanish like the root of the distance, those of unit forces grow like its inverse, as the line moves
with the force, see `CrossedCells`.

Where the line meets the edge of the plan the contact runs into a narrow strip, and the pressure is
that of a strip: ``(s / d)^(1/2)`` with the distance d to the edge.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix, hstack

from ..elements.balance import resist
from ..elements.crossed import CrossedCells
from ..kernels.once import computed_once, remember
from ..operators.factors import Factors, submatrix
from .problem import Contact
from .sectors import Sectors, gathered

Position = Callable[[ndarray], ndarray]
Compliances = tuple[ndarray, ndarray]


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
    nlaws : int
        How many laws of `CrossedCells` are asked for.
    """

    work: Any
    under: tuple[CrossedCells | None, ...]
    crossed: ndarray
    in_contact: ndarray
    flat: ndarray
    nlaws: int

    @classmethod
    def of(
        cls, work: Any, under: tuple[CrossedCells | None, ...], contact: Contact, nlaws: int
    ) -> "LineWork | None":
        """By the cells crossed under each punch; None if there are none.

        A punch under which hardly a cell remains in contact keeps it as its cells have it.
        """
        bears = [
            found is not None and resist(cells.partition.centroids, found.in_contact)
            for (cells, *_), found in zip(work.parts, under, strict=True)
        ]
        under = tuple(found if ok else None for found, ok in zip(under, bears, strict=True))
        if all(found is None for found in under):
            return None
        in_contact, crossed = contact.touching.copy(), np.zeros(len(contact.touching), dtype=bool)
        for own, found in zip(work.own, under, strict=True):
            if found is not None:
                in_contact[own], crossed[own] = found.in_contact, found.crossed
        flat = crossed if contact.flat is None else crossed | contact.flat
        return cls(work, under, crossed, in_contact, flat, nlaws)

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
        find_changes(self.work, [self])
        return self.change

    @computed_once
    def by_crossed(self) -> tuple[ndarray, ndarray]:
        """What crossed cells settle the collocation points by each law, (nlaws, k, n); their
        numbers."""
        by, cells = zip(*self._by_crossed(self.work.at_cells.x, self.nlaws), strict=True)
        return np.concatenate(by, axis=1), np.concatenate(cells)

    def _by_crossed(self, x: ndarray, nlaws: int) -> Iterator[tuple[ndarray, ndarray]]:
        """What crossed cells under each punch settle points, see `CrossedCells`; their numbers."""
        for (cells, *_), own, found in self._parts:
            yield found.influence(cells.ground, x, nlaws), found.cells + own.start

    @computed_once
    def laws(self) -> tuple[ndarray, ndarray]:
        """`pressures` by both."""
        return self.pressures(0), self.pressures(1)

    @computed_once
    def others(self) -> ndarray:
        """The same of cells that are not crossed, (n, 2 m)."""
        return np.where(self.crossed[:, None], 0.0, np.hstack(self.laws))

    @computed_once
    def slopes(self) -> ndarray:
        """Slopes in the cells under both laws, (2, n, 2 m)."""
        of = self.work.cells.slopes.of
        return np.where(self.flat[:, None], 0.0, of(np.hstack(self.laws)))

    def settled(self, sloping: Any, known: ndarray, slopes: ndarray) -> list[ndarray]:
        """Settlements of the points of a `SlopeCorrection` under both laws, (k, m) each: what is
        ``known``, what it adds by some slopes, and crossed cells."""
        settled = np.hsplit(known + sloping.apply(slopes), 2)
        for by, cells in self._by_crossed(sloping.x, 2):
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
        by, change, matrix = by[:, :, touching], self.change[:, touching], self.work.at_cells.rows
        place = np.full(len(matrix), -1)
        place[touching] = np.arange(len(touching))
        own, inside = submatrix(matrix, touching, touching), self.in_contact[columns]
        own[:, place[columns[inside]]] += change[inside].T
        outer, inner, _ = self._carried(0)
        there = self.in_contact[cells]
        special = np.union1d(cells[there], inner)
        # those out of contact have neither rows nor slopes of their own
        without = submatrix(matrix, touching, outer).T + change[np.searchsorted(columns, outer)]
        parts = np.zeros((self.nlaws, len(special), len(touching)))
        share = np.zeros((len(special), len(outer)))
        at = np.searchsorted(special, inner), np.arange(len(outer))
        for law, part in enumerate(parts):
            part[np.searchsorted(special, cells[there])] = by[law, there]
            share[at] = self._carried(law)[2]
            part += share @ (without + by[law, np.searchsorted(cells, outer)])
        own[:, place[special]] += parts[0].T
        # the second law asks for more than refinement is for
        factors = Factors.from_matrix(own, single=self.nlaws == 1)
        return touching, factors, place[special], (parts[-1] - parts[0]).T

    def pressures(self, law: int) -> ndarray:
        """By motions of unit size, (n, m)."""
        touching, factors, special, more = self._equations
        planes = self.work.system.planes[:, touching] / self.work.unit[:, None]
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

    def by_forces(self, law: int, pressures: ndarray) -> ndarray:
        """Motions of unit size by forces on them, as the collocation points have them."""
        slopes = self.work.cells.slopes
        forces = self.work.system.resultants @ pressures
        lost = np.where(self.flat[:, None], slopes.of(pressures), 0.0)
        for (_, body, _), own in zip(self.work.parts, self.work.own, strict=True):
            moments = np.einsum("ijn,jnk->ik", slopes.second_moments[..., own], lost[:, own])
            forces[3 * body + 1 : 3 * body + 3] -= moments
        for (cells, body, _), own, found in self._parts:
            crossed, n = found.cells, len(cells)
            arms = found.centroids * found.areas * found.laws[law].density
            moments = np.stack([np.bincount(found.cell, arm, n)[crossed] for arm in arms])
            moments -= (cells.acting * cells.partition.areas)[:, crossed]
            forces[3 * body + 1 : 3 * body + 3] += moments @ pressures[own][crossed]
        return np.linalg.inv(forces / self.work.unit[:, None])

    def under_load(self, position: Position) -> tuple[ndarray, ndarray]:
        """Pressures under the load at the centroids of the cells, the law of the plan's edge
        apart, and gaps; (n,) each."""
        unit = self.pressures(0)
        motion = position(self.by_forces(0, unit))
        pressure = unit @ motion
        moved = motion / self.work.unit @ self.work.system.planes
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

        ``own`` are the `sectors` and ``at_own`` these as points, where rows are those without
        slopes; ``whole`` is what the sectors of all cells settle by `others` with all slopes.
        """
        work, (pressures, others) = self.work, self.laws
        by_points, unit = self.by_forces(0, pressures), others @ self.by_forces(1, others)
        settled, _ = self.settled(at_own.slopes, at_own.rows @ self.others, self.slopes)
        apart = settled.T - work.planes_at(own)
        done = (unit[own.cell].T * own.load) @ apart.T
        cell = work.sectors.cell
        away = np.nonzero(~self.crossed[cell] & self.in_contact[cell])[0]
        loads = work.loads_of(unit, self.flat)[:, away]
        turned = self.slopes - work.cells.slopes.of(self.others)
        settled, grown = self.settled(work.sloping.at(away), whole[away], turned)
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
            load = found.areas * found.laws[1].density
            (x, cell, total), _ = gathered(found.centroids, load, found.cell, found.part)
            out.append(Sectors(x, cell + own.start, total))
        return Sectors(*(np.concatenate(each, axis=-1) for each in zip(*out, strict=True)))


def find_changes(work: Any, lined: Sequence[LineWork]) -> None:
    """`LineWork.change` of several cases, which keep it."""
    points, ends = work.at_cells, np.cumsum([len(each.columns[0]) for each in lined])
    change = np.zeros((len(points.rows), ends[-1]))
    points.slopes.add(change, hstack([each.columns[1] for each in lined], format="csr"))
    for each, own in zip(lined, np.split(change, ends[:-1], axis=1), strict=True):
        found, crossed = np.ascontiguousarray(own.T), each.crossed[each.columns[0]]
        found[crossed] -= points.rows.take(np.nonzero(each.crossed)[0], axis=1).T
        remember(each, "change", found)
