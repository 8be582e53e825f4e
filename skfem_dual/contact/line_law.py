"""Shaped punches once more, with pressures that end where contact does, inside the cells.

Found by cells, contact ends between them, and their pressures are constant where those of smooth
contact fall like the root of the distance to its edge. So that edge is drawn under each shaped
body, the cells along it take this law, see `LineWeights`, and the equations are solved again:
collocation points in contact settle as the punch does, cells whose point is out of contact carry
in their part of it what their neighbours do. Twice: the edge follows the better pressures.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from ..elements.edge_correction import EdgeCorrection
from ..elements.line_weights import LineWeights
from ..errors import ConvergenceError
from ..grids.outline import edge_ribs, on_ribs
from ..grids.polygons import readonly
from ..kernels.compiled import compiled, inputs
from ..kernels.once import computed_once
from ..operators.symmetric_matrix import SymmetricMatrix
from .edges import INNER, inner_share
from .footprint import Footprint
from .loaded_cells import ExactRows
from .one_sign import solved
from .parts import Part
from .pressed import on_line
from .problem import Contact
from .system import DENSE, ContactSystem
from .union import rows_of

#: solutions, and cells in contact from which on it has an edge along which pressures have the law
TIMES, FEWEST = 2, 60
#: pressures so many times those found by cells are peaks, means over cells and the greatest in
#: them; and those of less than so much of their largest are no matter
PEAK, LOW = (1.5, 3.0), 0.2
#: solutions more where cells beyond the line press, as on rough shapes
STRAYS = 3

#: contact and positions by a system, from pressures; and whether they obey its equations and
#: exact rows of its matrix
Solve = Callable[[ContactSystem, ndarray], tuple[Contact, ndarray]]
Verify = Callable[[ContactSystem, ExactRows, Contact, ndarray], Contact]


def with_line_law(
    problem: Any, solve: Solve, verify: Verify, found: tuple[Contact, ndarray]
) -> tuple[Contact, ndarray]:
    """Contact and position of shaped rigid punches with the law of the line of contact.

    They are those found by cells where contact covers the plans or fewer than 60 cells, or is as
    thin as on rough shapes, where the cells have another law or no matrix of up to 4000 of them,
    and where no contact on such lines is found, or only with peaks: ``lines`` of the contact tell.
    What is found and does not obey the equations has no success.

    Parameters
    ----------
    problem : RigidBodies
        What is solved.
    solve, verify : callable
        Contact and positions by equations, and whether they obey them.
    found : Contact and (m,) array of float
        By cells.
    """
    contact = found[0]
    known = isinstance(problem.operator, (np.ndarray, SymmetricMatrix))
    small = known and len(problem.cells) <= DENSE
    if not (small and contact.success and problem.system.gap.any()):
        return found
    pressure, gap = contact.pressure, contact.clearance
    lines: tuple[LineWeights | None, ...] = ()
    last: OnLines | None = None
    peaks = np.zeros(len(pressure), dtype=bool)
    for number in range(TIMES + STRAYS):
        if number < TIMES:
            lines = _lines(problem, pressure, gap)
        elif (others := _without_strays(problem, lines, gap, peaks)) is not None:
            lines = others
        else:
            break
        if all(line is None for line in lines):
            break
        cells = CellsOnLines(problem, lines, np.zeros(len(pressure), dtype=bool))
        if (answer := cells.solved(solve, pressure > 0)) is None:
            break
        peaks = cells.peaks(answer.contact.pressure, contact.pressure)
        last = last if peaks.any() else answer
        gap = answer.contact.clearance
        pressure = cells.at_points(answer.contact.pressure, gap == 0)
    if last is None:
        return found
    again = last.verified(verify)
    history = (*contact.history, *again.history)
    return replace(again, history=history, lines=last.cells.lines), last.position


def _without_strays(
    problem: Any, lines: tuple[LineWeights | None, ...], gap: ndarray, peaks: ndarray
) -> tuple[LineWeights | None, ...] | None:
    """Lines with constant pressures in cells with peaks, and in those that press although their
    points lie beyond them: in the little of these that the line leaves, pressures would be huge.
    None if there are none.
    """
    found, some = [], False
    for line, own in zip(lines, problem.slices, strict=True):
        if line is not None:
            stray = line.tiny & ~line.in_contact & (gap[own] == 0)
            stray = stray | (line.weighted & peaks[own])
            some |= bool(stray.any())
            known = False if line.constant is None else line.constant
            line = replace(line, constant=readonly(stray | known))
        found.append(line)
    return tuple(found) if some else None


def _lines(problem: Any, pressure: ndarray, gap: ndarray) -> tuple[LineWeights | None, ...]:
    """Under each punch the line where contact ends, by pressures and gaps in the points."""
    lines: list[LineWeights | None] = []
    each = zip(problem.footprints, problem.slices, _are_wide(problem, pressure > 0), strict=True)
    for cells, own, wide in each:
        fit = cells.weights is None and cells.collocation == "centroid"
        edge = None
        if wide and fit and problem.system.gap[own].any() and not cells.on_springs:
            modulus = cells.contact_modulus
            edge = cells.triangles.fitted(pressure[own], gap[own], modulus).segments(1)
        if edge is None or edge.starts[-1] == 0:
            lines.append(None)
            continue
        law = cells.partition, cells.fan, edge, cells.collocation_points, gap[own] == 0
        lines.append(LineWeights.from_lines(*law))
    return tuple(lines)


def _are_wide(problem: Any, inside: ndarray) -> ndarray:
    """Under which punches contact has cells enough, and not in thin rows and clusters, for such a
    law: all of a contact that goes on under joined ones."""
    cells = [part.footprint.partition for part in problem.parts]
    own = [inside[some] for some in problem.slices]
    contact = _contacts(problem.parts, own)
    counts = np.array([some.sum() for some in own])
    inner = counts * [inner_share(*each) for each in zip(cells, own, strict=True)]
    counts, inner = np.bincount(contact, counts), np.bincount(contact, inner)
    return ((counts >= FEWEST) & (inner >= INNER * counts))[contact]


def _contacts(parts: Sequence[Part], inside: Sequence[ndarray]) -> ndarray:
    """Numbers of contacts under each punch, those that go on across a common edge as one."""
    number = np.arange(len(parts))
    ribs = []
    for (cells, *_), own in zip(parts, inside, strict=True):
        edge = edge_ribs(cells.partition) if len(parts) > 1 else np.empty(0, int)
        ribs.append(edge[own[cells.partition.f2c[0, edge]]])
    for i, j in combinations(range(len(parts)), 2):
        if parts[i].body == parts[j].body and len(ribs[i]) and len(ribs[j]):
            one, other = parts[i].footprint.partition, parts[j].footprint.partition
            if on_ribs(one, ribs[i], other, ribs[j]).any():
                number[number == number[j]] = number[i]
    return number


@dataclass(frozen=True, eq=False)
class CellsOnLines:
    """The cells of a problem, weighted along lines of contact.

    Attributes
    ----------
    problem : RigidBodies
        What is solved.
    lines : tuple of LineWeights or None
        Under each punch.
    flat : (n,) array of bool
        Cells whose pressures do not follow those around.
    """

    problem: Any
    lines: tuple[LineWeights | None, ...]
    flat: ndarray

    def __len__(self) -> int:
        return len(self.flat)

    @computed_once
    def parts(self) -> tuple[Footprint, ...]:
        """Those of each punch."""
        each = zip(self.problem.footprints, self.lines, self.problem.slices, strict=True)
        return tuple(on_line(cells, line).flattened(self.flat[own]) for cells, line, own in each)

    def flattened(self, flat: ndarray) -> "CellsOnLines":
        """With some cells flat, (n,) array of bool."""
        return replace(self, flat=flat) if flat.any() else self

    def turning(self, pressure: ndarray) -> ndarray:
        """Cells in a part of which slopes make positive pressures negative, (n,) array of bool."""
        each = zip(self.parts, self.problem.slices, strict=True)
        return np.concatenate([cells.turning(pressure[own]) for cells, own in each])

    def carried(self, pressure: ndarray) -> ndarray:
        """Mean pressures by those of the cells in contact in their points, (n,): others that
        reach into the contact carry as much, over the law, as their neighbours do."""
        cells, others, shares = self._carrying
        return pressure + np.bincount(cells, shares * pressure[others], len(pressure))

    @computed_once
    def _carrying(self) -> tuple[ndarray, ndarray, ndarray]:
        """`LineWeights.carrying` of all."""
        each = zip(self.lines, self.problem.slices, strict=True)
        found = [(line.carrying, own.start) for line, own in each if line is not None]
        pairs = np.hstack([pairs + start for (pairs, _), start in found])
        cells, others, shares = inputs(*pairs, np.concatenate([own for (_, own), _ in found]))
        return cells, others, shares

    def carry(self, matrix: ndarray) -> ndarray:
        """A ``matrix`` for mean pressures, changed into one for those that `carried` takes."""
        _carry(*self._carrying, matrix)
        return matrix

    def at_points(self, pressure: ndarray, touching: ndarray) -> ndarray:
        """Pressures in the collocation points by means over the cells; zero out of contact."""
        out = pressure.copy()
        for line, own in zip(self.lines, self.problem.slices, strict=True):
            if line is not None:
                out[own] = np.where(touching[own], line.at_points(pressure[own]), 0.0)
        return out

    def peaks(self, pressure: ndarray, by_cells: ndarray) -> ndarray:
        """Cells with pressures far above those found by cells there and beside, in the mean or
        somewhere in them, (n,) array of bool."""
        around, most = by_cells.copy(), pressure.copy()
        each = zip(self.problem.footprints, self.lines, self.problem.slices, strict=True)
        for cells, line, own in each:
            i, j = cells.partition.neighbours + own.start
            np.maximum.at(around, i, by_cells[j])
            np.maximum.at(around, j, by_cells[i])
            if line is not None:
                most[own] *= line.relative(np.arange(len(line.mean)), line.roots[1])
        around = around.clip(LOW * by_cells.max())
        return np.asarray((pressure > PEAK[0] * around) | (most > PEAK[1] * around))

    def solved(self, solve: Solve, touching: ndarray) -> "OnLines | None":
        """Contact and positions, beginning with some cells in contact; None if not found.

        Punches without a line that hardly touch may lose all that they stand on at first: the
        second time they begin with all their cells.
        """
        begin, whole = touching.astype(float), np.ones(len(touching))
        for line, own in zip(self.lines, self.problem.slices, strict=True):
            if line is not None:
                begin[own] = whole[own] = line.in_contact
        found = self._solved(solve, begin)
        return found or (None if (begin == whole).all() else self._solved(solve, whole))

    def _solved(self, solve: Solve, begin: ndarray) -> "OnLines | None":
        last = None

        def find(flat: ndarray, start: ndarray | None) -> tuple[Contact, ndarray]:
            nonlocal last
            cells = self.flattened(flat)
            last = cells, *solve(cells.system, begin)
            return replace(last[1], pressure=cells.carried(last[1].pressure)), last[2]

        try:
            contact, _ = solved(self, find, True)
        except ConvergenceError:
            return None
        return OnLines(*last, contact) if last is not None and contact.success else None

    @computed_once
    def system(self) -> ContactSystem:
        """The equations for pressures that `carried` takes."""
        system = self.problem.system
        acting = self.carry(np.array(self.problem.resultants_of(self.parts)))
        return replace(system, matrix=self.matrix, resultants=acting, nearby=system.approximate)

    @property
    def exact_rows(self) -> ExactRows:
        """Some rows of their matrix, computed apart from it."""
        numbers, rows = rows_of(self.parts)
        return ExactRows(numbers, self.carry(rows))

    @computed_once
    def matrix(self) -> ndarray:
        """Settlements of the collocation points by pressures that `carried` takes."""
        problem, x = self.problem, self.problem.cells.collocation_points
        matrix = np.array(problem.operator)
        each = problem.footprints, self.parts, self.lines, problem.slices, problem.sloping
        for whole, cells, line, own, sloping in zip(*each, strict=True):
            if cells.slopes is None or (line is None and cells is whole):
                continue
            block = np.ascontiguousarray(matrix[:, own])
            if line is None:  # the matrix has the slopes of flat cells too
                sloping.add_to(block, whole.slopes.without(~self.flat[own]), -1.0)
            else:
                if cells.substrate.remainder is None:
                    coefficient = cells.substrate.singular_coefficient
                    EdgeCorrection.from_weights(line, coefficient, x).add_to(block)
                else:
                    block = replace(cells, slopes=None).influence(x)
                sloping.add_to(block, cells.slopes)
            if not np.shares_memory(block, matrix):
                matrix[:, own] = block
        return self.carry(matrix)


class OnLines(NamedTuple):
    """What was found with the law of lines of contact.

    Attributes
    ----------
    cells : CellsOnLines
        The cells and their equations.
    solution : Contact
        Of these.
    position : (m,) array of float
        Of the bodies.
    contact : Contact
        The same with all the pressures that are carried.
    """

    cells: CellsOnLines
    solution: Contact
    position: ndarray
    contact: Contact

    def verified(self, verify: Verify) -> Contact:
        """The contact, without success where the equations do not hold."""
        cells, solution, position, contact = self
        checked = verify(cells.system, cells.exact_rows, solution, position)
        pressure, history, flat = contact.pressure, contact.history, contact.flat
        return replace(checked, pressure=pressure, history=history, flat=flat)


@compiled
def _carry(cells: ndarray, others: ndarray, shares: ndarray, matrix: ndarray) -> None:
    for i in range(matrix.shape[0]):
        for k in range(cells.shape[0]):
            matrix[i, others[k]] += shares[k] * matrix[i, cells[k]]
