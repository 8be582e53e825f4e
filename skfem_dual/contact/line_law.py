"""Shaped punches once more, with pressures that end where contact does, inside the cells.

Found by cells, contact ends between them, and their pressures are constant where those of smooth
contact fall like the root of the distance to its edge. So that edge is drawn under each shaped
body, the cells along it take this law, see `LineWeights`, and the equations are solved again:
collocation points in contact settle as the punch does, cells whose point is out of contact carry
in their part of it what their neighbours do. Twice: the edge follows the better pressures.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import block_diag, coo_matrix, csr_matrix, identity

from ..elements.edge_correction import EdgeCorrection
from ..elements.line_weights import LineWeights
from ..errors import ConvergenceError
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .footprint import ExactRows, Footprint
from .one_sign import solved
from .pressed import on_line
from .problem import Contact
from .system import ContactSystem
from .union import rows_of

#: solutions, and cells in contact from which on it has an edge along which pressures have the law
TIMES, FEWEST = 2, 60
#: solutions more where cells beyond the line press, as on rough shapes
STRAYS = 3
#: up to so many cells it is cheap to solve between those in contact again
MOST = 3000

#: contact and positions by a system with exact rows of its matrix, from pressures, verified
Solve = Callable[[ContactSystem, ExactRows, ndarray], tuple[Contact, ndarray]]


def with_line_law(
    problem: Any, solve: Solve, found: tuple[Contact, ndarray]
) -> tuple[Contact, ndarray]:
    """Contact and position of shaped rigid punches with the law of the line of contact.

    They are those found by cells where contact covers the plans or fewer than 60 cells, where the
    cells have another law or no matrix of up to 3000 of them, and where no contact on such lines
    is found: ``lines`` of the contact tell. What is found and does not obey the equations has no
    success.

    Parameters
    ----------
    problem : RigidBodies
        What is solved.
    solve : callable
        Contact and positions by equations.
    found : Contact and (m,) array of float
        By cells.
    """
    contact = found[0]
    small = isinstance(problem.operator, np.ndarray) and len(problem.cells) <= MOST
    if not (small and contact.success and problem.system.gap.any()):
        return found
    pressure, gap = contact.pressure, np.where(contact.touching, 0.0, contact.gap.clip(0))
    lines: tuple[LineWeights | None, ...] = ()
    for number in range(TIMES + STRAYS):
        if number < TIMES:
            lines = _lines(problem, pressure, gap)
        elif (others := _without_strays(problem, lines, gap)) is not None:
            lines = others
        else:
            break
        cells = CellsOnLines(problem, lines, np.zeros(len(pressure), dtype=bool))
        if all(line is None for line in lines):
            return found
        if (answer := cells.solved(solve, pressure > 0)) is None:
            return found
        again, moved = answer
        gap = np.where(again.touching, 0.0, again.gap.clip(0))
        pressure = cells.at_points(again.pressure, gap == 0)
        found = replace(again, history=(*contact.history, *again.history), lines=lines), moved
        if again.refuted:
            return found
    return found


def _without_strays(
    problem: Any, lines: tuple[LineWeights | None, ...], gap: ndarray
) -> tuple[LineWeights | None, ...] | None:
    """Lines with constant pressures in cells that press although their points lie beyond them:
    in the little of these that the line leaves, pressures would be huge. None if there are none.
    """
    found, some = [], False
    for line, own in zip(lines, problem.slices, strict=True):
        if line is not None:
            stray = line.tiny & ~line.in_contact & (gap[own] == 0)
            some |= bool(stray.any())
            known = False if line.constant is None else line.constant
            line = replace(line, constant=readonly(stray | known))
        found.append(line)
    return tuple(found) if some else None


def _lines(problem: Any, pressure: ndarray, gap: ndarray) -> tuple[LineWeights | None, ...]:
    """Under each punch the line where contact ends, by pressures and gaps in the points."""
    lines: list[LineWeights | None] = []
    for cells, own in zip(problem.footprints, problem.slices, strict=True):
        fit = cells.weights is None and cells.collocation == "centroid"
        shaped = problem.system.gap[own].any() and np.sum(pressure[own] > 0) >= FEWEST
        edge = []
        if fit and shaped:
            modulus = cells.substrate.surface.contact_modulus
            edge = cells.triangles.fitted(pressure[own], gap[own], modulus).edge
        law = cells.partition, cells.fan, edge, cells.collocation_points, gap[own] == 0
        lines.append(LineWeights.from_lines(*law) if edge else None)
    return tuple(lines)


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
        each = zip(self.problem.footprints, self.lines, self._own, strict=True)
        return tuple(on_line(cells, line).flattened(self.flat[own]) for cells, line, own in each)

    @property
    def _own(self) -> list[slice]:
        return self.problem.slices

    def flattened(self, flat: ndarray) -> "CellsOnLines":
        """With some cells flat, (n,) array of bool."""
        return replace(self, flat=flat) if flat.any() else self

    def turning(self, pressure: ndarray) -> ndarray:
        """Cells in a part of which slopes make positive pressures negative, (n,) array of bool."""
        each = zip(self.parts, self._own, strict=True)
        return np.concatenate([cells.turning(pressure[own]) for cells, own in each])

    @computed_once
    def carried(self) -> csr_matrix:
        """`LineWeights.carried` of all, shape (n, n)."""
        each = zip(self.parts, self.lines, strict=True)
        own = [identity(len(cells)) if line is None else line.carried() for cells, line in each]
        return csr_matrix(block_diag(own))

    def by_carried(self, matrix: ndarray) -> ndarray:
        """``matrix @ carried``: few cells carry anything but their own pressure."""
        shares = (self.carried - identity(len(self))).tocoo()
        few, row = np.unique(shares.row, return_inverse=True)
        beside, column = np.unique(shares.col, return_inverse=True)
        dense = coo_matrix((shares.data, (row, column)), (len(few), len(beside))).toarray()
        out = matrix.copy()
        out[:, beside] += matrix[:, few] @ dense
        return out

    def at_points(self, pressure: ndarray, touching: ndarray) -> ndarray:
        """Pressures in the collocation points by means over the cells; zero out of contact."""
        out = pressure.copy()
        for line, own in zip(self.lines, self._own, strict=True):
            if line is not None:
                out[own] = np.where(touching[own], line.at_points(pressure[own]), 0.0)
        return out

    def solved(self, solve: Solve, touching: ndarray) -> tuple[Contact, ndarray] | None:
        """Contact and positions, beginning with some cells in contact; None if not found."""
        begin = touching.astype(float)
        for line, own in zip(self.lines, self._own, strict=True):
            if line is not None:
                begin[own] = line.in_contact

        def find(flat: ndarray, start: ndarray | None) -> tuple[Contact, ndarray]:
            cells = self.flattened(flat)
            acting = self.by_carried(self.problem.resultants_of(cells.parts))
            matrix = self.by_carried(self.matrix_with(flat))
            system = replace(self.problem.system, matrix=matrix, resultants=acting)
            numbers, rows = rows_of(cells.parts)
            contact, position = solve(system, ExactRows(numbers, self.by_carried(rows)), begin)
            return replace(contact, pressure=self.carried @ contact.pressure), position

        try:
            contact, position = solved(self, find, True)
        except ConvergenceError:
            return None
        return (contact, position) if contact.success or contact.refuted else None

    @computed_once
    def matrix(self) -> ndarray:
        """Settlements of the collocation points by mean pressures of all cells."""
        x = self.problem.cells.collocation_points
        matrix = np.array(self.problem.operator)
        every = zip(self.parts, self.lines, self._own, self.problem.sloping, strict=True)
        for cells, line, own, sloping in every:
            if line is None or cells.slopes is None:
                continue
            if cells.substrate.remainder is None:
                block = np.ascontiguousarray(matrix[:, own])
                coefficient = cells.substrate.singular_coefficient
                EdgeCorrection.from_weights(line, coefficient, x).add_to(block)
            else:
                block = replace(cells, slopes=None).influence(x)
            sloping.add_to(block, cells.slopes)
            matrix[:, own] = block
        return matrix

    def matrix_with(self, flat: ndarray) -> ndarray:
        """The same where some cells are flat."""
        if not flat.any():
            return self.matrix
        matrix = self.matrix.copy()
        for cells, own, sloping in zip(self.parts, self._own, self.problem.sloping, strict=True):
            if cells.slopes is not None and flat[own].any():
                block = np.ascontiguousarray(matrix[:, own])
                sloping.add_to(block, cells.slopes.without(~flat[own]), -1.0)
                matrix[:, own] = block
        return matrix
