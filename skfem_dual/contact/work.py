"""The position of punches by the work of pressures: many times closer than by points.

Between the collocation points ground and punch are a little apart, as the pressure inside the
cells is not quite right. With pressures ``p`` of the load and ``r`` of a unit force, the work
``<r, A p>`` is the position conjugate to that force, which errors of ``p`` and ``r`` enter as a
product only (Thomson's principle, Betti's reciprocity). It is ``s + <r, e>``: the position ``s``
by collocation and how far the ground lies below the punch, ``e``, at one point or two in each
sector of the cells near the edge, and at three in dual cells farther off. Where the whole of a
shaped base touches, ``e`` counts from its shape.

Sources: C. E. Pearson, Theoretical Elasticity (1959), principles of work; R. Becker and
R. Rannacher, Acta Numerica 10 (2001) 1, residuals weighted by the dual problem.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import cast

import numpy as np
from numpy import ndarray

from ..elements.edge_weights import EdgeWeights
from ..elements.slope_correction import SlopeCorrection
from ..elements.slopes import Slopes
from ..kernels.once import computed_once
from ..operators.entries import Entries
from ..operators.factors import Factors, submatrix
from ..operators.influence_operator import COARSEST, InfluenceOperator
from ..operators.symmetric_matrix import SymmetricMatrix
from .along_lines import has_law, on_each, regions_of
from .compliances import position_under
from .line_work import Compliances, Points, Position
from .load import Constraints
from .loaded_cells import LoadedCells, slices_of
from .parts import Part, flattened_resultants, flattened_system
from .problem import DOZEN, Contact
from .sectors import Sectors, sectors
from .system import DENSE, ContactSystem

#: where ground and punch are apart by more than so much of a unit motion, on average over a cell,
#: the pressure in the cell is of another kind, as on thin layers that keep their volume: it is
#: left out
APART = 0.025
#: errors of settlements of the sectors may be so many times those of the equations
SECTORS = 3.0
#: on homogeneous ground from so many cells on rows take longer than settlements by moments under a
#: few loads
ROWS = 1500


@dataclass(frozen=True, eq=False)
class Work:
    """Positions of punches with edge-weighted cells by the work of their pressures, of flat ones
    and of those in full contact.

    Attributes
    ----------
    parts : tuple of Part
        The punches, their cells one after the other.
    cells : LoadedCells
        All of these.
    system : ContactSystem
        Their equations, three components of the position for each body.
    shape : callable, optional
        Gives the gap of the unloaded body at points (2, m), None if that is not known; None of
        flat ones.
    """

    parts: tuple[Part, ...]
    cells: LoadedCells
    system: ContactSystem
    shape: Callable[[ndarray], ndarray | None] | None = None

    @computed_once
    def sectors(self) -> Sectors:
        """Where the ground is looked at; of punches with constant pressures nowhere."""
        found = [Sectors(np.empty((2, 0)), np.empty(0, int), np.empty(0))]
        for (cells, *_), own in zip(self.parts, self.own):
            if cells.weights is not None:
                x, cell, load = sectors(cells.weights, not cells.on_dual_cells)
                found.append(Sectors(x, cell + own.start, load))
        x, cell, load = zip(*found, strict=True)
        return Sectors(np.hstack(x), np.concatenate(cell), np.concatenate(load))

    @computed_once
    def own(self) -> list[slice]:
        """Where the cells of each punch are among those of all."""
        return slices_of([part.footprint for part in self.parts])

    @computed_once
    def planes(self) -> ndarray:
        """Settlement of the sectors by motions of unit size, shape (m, nsectors)."""
        return self.planes_at(self.sectors)

    def planes_at(self, some: Sectors) -> ndarray:
        """The same of some sectors."""
        x, cell, _ = some
        planes = np.zeros((len(self.unit), len(cell)))
        for (_, body, centre), part in zip(self.parts, self.own):
            own = (part.start <= cell) & (cell < part.stop)
            planes[3 * body, own] = 1.0
            planes[3 * body + 1 : 3 * body + 3, own] = x[:, own] - centre[:, None]
        return planes / self.unit[:, None]

    @computed_once
    def rows(self) -> ndarray:
        """Settlement of the sectors under unit pressure on each cell, if these are few."""
        return self._in_sectors.matrix()

    @computed_once
    def at_cells(self) -> Points:
        """The collocation points, if a matrix is known."""
        matrix, cells = np.asarray(self.system.matrix), self.cells
        return Points(cells.collocation_points, matrix, cells.sloping)

    @computed_once
    def slopes(self) -> tuple[ndarray, ndarray, ndarray]:
        """Rows, columns and values of the matrix of `Slopes`, ascending in the first."""
        matrix = cast(Slopes, self.cells.slopes).matrix
        return (
            np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr)),
            matrix.indices,
            matrix.data,
        )

    @computed_once
    def _in_sectors(self) -> Entries:
        """What unit pressures on the cells make of the sectors."""
        return self.cells.entries(self.sectors.x)

    @property
    def sloping(self) -> SlopeCorrection | None:
        """What slopes inside the cells add there."""
        return self._in_sectors.sloping

    def sloped(self, pressures: ndarray) -> ndarray:
        """Settlements of the sectors under pressures (n, k), with the slopes of all cells: by
        moments or by rows, however many they are, so that a case is what it is alone."""
        if len(pressures) >= ROWS and self.cells.ground.remainder is None:
            return self._in_sectors.settlements(pressures, rough=True)
        return self.rows @ pressures

    def positions(
        self,
        constraints: Constraints,
        contact: Contact,
        on_line: Callable[[], Compliances | None] | None = None,
    ) -> ndarray | None:
        """Positions under a load with contact on some cells.

        Parameters
        ----------
        constraints : Constraints
            What is imposed.
        contact : Contact
            What was found.
        on_line : callable, optional
            Gives what `along_line` has, if that serves others too.

        Returns
        -------
        (2, m) array of float or None
            Leaving out cells where the punch is too far from the ground, and with all cells;
            None on fewer than a dozen cells, or where only products with a matrix are known and
            contact is not full.
        """
        position = partial(self.position, constraints)
        compliances = self._by_forces(contact, position, on_line)
        if compliances is None:
            return None
        return np.array([position(compliance) / self.unit for compliance in compliances])

    def holding(
        self, constraints: Constraints, contact: Contact
    ) -> tuple[ndarray, Compliances] | None:
        """Forces on the ground in the closest of `positions`, by motions, shape (m,), and what
        motions of unit size do by forces on them; None as there."""
        position = partial(self.position, constraints)
        compliances = self._by_forces(contact, position, None)
        if compliances is None:
            return None
        pressed = position(compliances[0]) - self.shift
        return self.unit * np.linalg.solve(compliances[0], pressed), compliances

    def _by_forces(
        self,
        contact: Contact,
        position: Position,
        on_line: Callable[[], Compliances | None] | None,
    ) -> Compliances | None:
        """Motions of unit size by forces on them, as `positions` has them."""
        touching = contact.touching
        if contact.compliances is not None:
            return contact.compliances
        if touching.sum() < min(DOZEN, len(touching)):
            return None
        if touching.all() and contact.flat is None:
            return self._in_full_contact
        lined = on_line() if on_line else self.along_line(contact, position)
        if lined is not None:
            return lined
        pressures = self._pressures(contact)
        return None if pressures is None else self._compliances(pressures, touching, contact.flat)

    def along_line(self, contact: Contact, position: Position) -> Compliances | None:
        """Motions of unit size by forces on them if pressures end along lines: see `on_each`."""
        if not has_law(self, contact):
            return None
        footprints = [part.footprint for part in self.parts]
        return on_each(self, [contact], [position], regions_of(footprints, self.own, [contact]))[0]

    def position(self, constraints: Constraints, compliance: ndarray) -> ndarray:
        """Motions of unit size under the load, (m,), by what forces on them do."""
        return position_under(constraints, self.unit, compliance, self.shift)

    @computed_once
    def unit(self) -> ndarray:
        """Largest settlements by the components of the position, the same for both tilts."""
        planes = self.system.planes
        planes = planes.reshape(-1, 3, planes.shape[1])
        radius = np.hypot(planes[:, 1], planes[:, 2]).max(axis=1)
        return np.column_stack([np.ones_like(radius), radius, radius]).ravel()

    @computed_once
    def shift(self) -> ndarray:
        """Motions of unit size by the shape of the base, all of which touches; shape (m,)."""
        if self.shape is None:
            return np.zeros(len(self.unit))
        system, pressures = self.system, self.system.unit_pressures / self.unit
        by_points, unit_forces = self._by_points(pressures, None)
        motion = by_points @ (system.resultants @ system.shape_pressures / self.unit)
        pressure = pressures @ motion - system.shape_pressures
        settled = self._settled(pressure[:, None], None, True)[0]
        return motion + unit_forces @ (settled + cast(ndarray, self.gaps) - motion @ self.planes)

    @computed_once
    def gaps(self) -> ndarray | None:
        """Gap of the unloaded body in the sectors, (nsectors,); None if it is not known."""
        x = self.sectors.x
        return np.zeros(x.shape[1]) if self.shape is None else self.shape(x)

    @computed_once
    def _in_full_contact(self) -> tuple[ndarray, ndarray]:
        pressures = self.system.unit_pressures / self.unit
        return self._compliances(pressures, np.ones(len(pressures), dtype=bool), None)

    @property
    def stiffness(self) -> ndarray:
        """Forces by motions, shape (m, m), with contact on all cells."""
        unit = self.unit
        return np.linalg.inv(self._in_full_contact[0]) * np.outer(unit, unit)

    def _pressures(self, contact: Contact) -> ndarray | None:
        """Pressures by motions of unit size with that contact, (n, m), if a matrix is known."""
        if contact.unit_pressures is not None:
            return contact.unit_pressures / self.unit
        system, touching = self.system, contact.touching
        known = isinstance(system.matrix, (np.ndarray, SymmetricMatrix))
        if contact.flat is not None:
            system = flattened_system(system, self.parts, self.cells, contact.flat)
        if touching.all():
            return system.unit_pressures / self.unit
        if not known:
            return None
        cells = np.nonzero(touching)[0]
        matrix = submatrix(np.asarray(system.matrix), cells, cells)
        pressures = np.zeros((len(touching), len(self.unit)))
        pressures[cells] = Factors.from_matrix(matrix).solve(system.planes[:, cells].T)
        return pressures / self.unit

    def _slopes(self, pressures: ndarray) -> ndarray:
        """Slopes in all cells, flat ones too, under some pressures (n, m); shape (m, 2, n)."""
        slopes = self.cells.slopes
        if slopes is None:
            return np.zeros((pressures.shape[1], 2, len(pressures)))
        return slopes.of_rows(pressures.T)

    def _settled(self, pressures: ndarray, flat: ndarray | None, full: bool) -> ndarray:
        """Settlement of the sectors under some pressures, shape (m, nsectors)."""
        settled = self._with_slopes(pressures, full)
        if flat is not None and self.sloping is not None:
            lost = np.where(flat, self._slopes(pressures), 0.0)
            settled = settled - self.sloping.apply(np.moveaxis(lost, 0, -1)).T
        return settled

    def settled_by(self, operator: InfluenceOperator, contact: Contact) -> ndarray:
        """Settlement of the sectors under the pressures found, (nsectors,), by an operator from
        cells that all have slopes."""
        settled = operator @ contact.pressure
        if contact.flat is not None and self.sloping is not None:
            lost = np.where(contact.flat, self.cells.slopes_of(contact.pressure), 0.0)
            settled = settled - self.sloping.apply(lost[..., None])[:, 0]
        return settled

    def _with_slopes(self, pressures: ndarray, full: bool) -> ndarray:
        """The same with slopes in all cells; those of full contact are asked for once, which is
        not worth the rows."""
        few, parts = len(pressures) <= DENSE, list(zip(self.parts, self.own, strict=True))
        if few and not full:
            return (self.rows @ pressures).T
        ground = self.system.matrix
        if not few and isinstance(ground, InfluenceOperator):
            rtol = min(SECTORS * ground.rtol, COARSEST)
            return ground.at(self.sectors.x, rtol).roughly(pressures).T
        settled = np.zeros((pressures.shape[1], len(self.sectors.cell)))
        for (cells, *_), own in parts:
            if few:
                settled += cells.settlements(self.sectors.x, pressures[own], rough=True).T
                continue
            operator = cells.fast_operator(self.sectors.x, cells.tolerance)
            for row, part in zip(settled, pressures[own].T):
                row += operator @ np.ascontiguousarray(part)
        return settled

    def loads_of(self, pressures: ndarray, flat: ndarray | None) -> ndarray:
        """Loads of the sectors under some pressures of shape (n, m), slopes too; (m, nsectors)."""
        x, cell, load = self.sectors
        inside, cells = pressures[cell].T, self.cells
        if cells.slopes is not None:
            slopes = self._slopes(pressures)
            if flat is not None:
                slopes = np.where(flat, 0.0, slopes)
            arm = x - cast(EdgeWeights, cells.weights).centroids.take(cell, axis=1)
            inside = inside + np.einsum("ik,mik->mk", arm, slopes[..., cell])
        return inside * load

    def close(self, apart: ndarray) -> ndarray:
        """Cells over which ground and punch are not far apart, (n,) array of bool, by how far
        they are in the sectors under motions of unit size, (m, nsectors)."""
        (_, cell, load), areas = self.sectors, self.system.areas
        mean = np.array([np.bincount(cell, load * e, len(areas)) for e in apart]) / areas
        mean = mean.reshape(-1, 3, len(areas))
        far = np.maximum(np.abs(mean[:, 0]), np.hypot(mean[:, 1], mean[:, 2]))
        return (far < APART).all(axis=0)

    def _compliances(
        self, pressures: ndarray, touching: ndarray, flat: ndarray | None
    ) -> tuple[ndarray, ndarray]:
        """Motions of unit size by forces on them; without the cells that are apart, and with."""
        cell = self.sectors.cell
        settled = self._settled(pressures, flat, bool(touching.all()))
        apart = np.where(touching[cell], settled - self.planes, 0.0)
        close = self.close(apart)
        by_points, unit_forces = self._by_points(pressures, flat)
        kept, every = (
            by_points + (unit_forces * some) @ apart.T @ by_points for some in (close[cell], 1.0)
        )
        return kept, every

    def _by_points(self, pressures: ndarray, flat: ndarray | None) -> tuple[ndarray, ndarray]:
        """Motions of unit size by forces on them as collocation has them, shape (m, m), and loads
        of the sectors under these forces, by pressures under such motions, (n, m)."""
        acting = self.system.resultants
        acting = acting if flat is None else flattened_resultants(self.parts, flat)
        by_points = np.linalg.inv((acting / self.unit[:, None]) @ pressures)
        return by_points, self.loads_of(pressures @ by_points, flat)

    def added(self, contact: Contact, position: ndarray, settled: ndarray) -> ndarray | None:
        """What work adds to the position of bodies that have others beside them.

        Parameters
        ----------
        contact : Contact
            What was found under the bodies.
        position : (m,) array of float
            By collocation.
        settled : (nsectors,) array of float
            Settlement of the sectors under the pressures of all, those of the others too.

        Returns
        -------
        (2, m) array of float or None
            As of `positions`.
        """
        touching, cell = contact.touching, self.sectors.cell
        pressures = self._pressures(contact)
        if pressures is None or touching.sum() < min(DOZEN, len(touching)):
            return None
        unit_forces = self._by_points(pressures, contact.flat)[1]
        gaps = cast(ndarray, self.gaps)
        beyond = settled + gaps - (position * self.unit) @ self.planes
        apart = np.where(touching[cell], beyond, 0.0)
        mean = np.bincount(cell, self.sectors.load * apart, len(touching))
        close = np.abs(mean) < APART * np.abs(settled).max() * self.system.areas
        added = [(unit_forces * some) @ apart for some in (close[cell], 1.0)]
        return np.array(added) / self.unit
