"""The position of flat punches by the work of pressures: many times closer than by points.

Between the collocation points ground and punch are a little apart, as the pressure inside the
cells is not quite right. With pressures ``p`` of the load and ``r`` of a unit force, the work
``<r, A p>`` is the position conjugate to that force, which errors of ``p`` and ``r`` enter as a
product only (Thomson's principle, Betti's reciprocity). It is ``s + <r, e>``: the position ``s``
by collocation and how far the ground lies below the punch, ``e``, at one point in each sector of
the cells near the edge.

Sources: C. E. Pearson, Theoretical Elasticity (1959), principles of work; R. Becker and
R. Rannacher, Acta Numerica 10 (2001) 1, residuals weighted by the dual problem.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..elements.edge_weights import EdgeWeights
from ..kernels.once import computed_once
from ..operators.factors import Factors
from ..operators.symmetric_matrix import SymmetricMatrix
from .footprint import Footprint
from .load import Constraints
from .problem import DOZEN
from .system import ContactSystem

#: cells over which the weight varies by less than this factor hardly part from the punch
VARIATION = 1.5
#: where ground and punch are apart by more than so much of a unit motion, on average over a cell,
#: the pressure in the cell is of another kind, as in corners of triangles: it is left out
APART = 0.025


class Sectors(NamedTuple):
    """Parts of cells near the edge, one for each triangle of the mesh in which the cell has one.

    Attributes
    ----------
    x : (2, m) array of float
        Where the load of the sector acts.
    cell : (m,) array of int
        Its cell.
    load : (m,) array of float
        Its load by unit mean pressure on the cell.
    """

    x: ndarray
    cell: ndarray
    load: ndarray


def sectors(weights: EdgeWeights, on_dual_cells: bool) -> Sectors:
    """The sectors of dual cells; of other cells the triangles of their fan."""
    fan, (mean, off) = weights.fan, weights.of_triangles
    least, most = np.full(len(weights.weighted), np.inf), np.zeros(len(weights.weighted))
    np.minimum.at(least, fan.cell, weights.root[fan.t].min(axis=0))
    np.maximum.at(most, fan.cell, weights.root[fan.t].max(axis=0))
    own = np.nonzero((weights.weighted & (most > VARIATION * least))[fan.cell])[0]
    cell, load = fan.cell[own], (fan.areas * mean)[own] / weights.mean[fan.cell[own]]
    x = fan.p[:, fan.t[:, own]].mean(axis=1) + off[:, own]
    # of the points of a fan barycentres come last
    key = np.stack([cell, fan.t[:, own].max(axis=0) if on_dual_cells else own])
    (cell, _), sector = np.unique(key, axis=1, return_inverse=True)
    total = np.bincount(sector.ravel(), load, len(cell))
    x = np.stack([np.bincount(sector.ravel(), load * a, len(cell)) for a in x]) / total
    return Sectors(np.ascontiguousarray(x), cell, total)


@dataclass(frozen=True, eq=False)
class Work:
    """Positions of a flat punch with edge-weighted cells by the work of its pressures.

    Attributes
    ----------
    footprint : Footprint
        Its cells.
    system : ContactSystem
        Their equations.
    """

    footprint: Footprint
    system: ContactSystem

    @computed_once
    def sectors(self) -> Sectors:
        """Where the ground is looked at."""
        weights = self.footprint.weights
        if weights is None:
            raise ValueError('expected a punch with edge="singular", got constant pressures')
        return sectors(weights, self.footprint.on_dual_cells)

    @computed_once
    def rows(self) -> ndarray:
        """Settlement of the sectors under unit pressure on each cell, if these are few."""
        return self.footprint.influence(self.sectors.x)

    def positions(self, constraints: Constraints, touching: ndarray) -> ndarray | None:
        """Positions under a load with contact on some cells.

        Parameters
        ----------
        constraints : Constraints
            What is imposed.
        touching : (n,) array of bool
            The cells in contact.

        Returns
        -------
        (2, 3) array of float or None
            Leaving out cells where the punch is too far from the ground, and with all cells;
            None on fewer than a dozen cells, or where only products with a matrix are known and
            contact is not full.
        """
        if touching.sum() < min(DOZEN, len(touching)):
            return None
        if touching.all():
            compliances = self._in_full_contact
        elif isinstance(self.system.matrix, (np.ndarray, SymmetricMatrix)):
            compliances = self._compliances(self._pressures(touching), touching)
        else:
            return None
        unit = self._unit
        motions, fixed = unit[:, None] * constraints.motions, unit * constraints.fixed
        balance = constraints.balance * unit
        found = []
        for compliance in compliances:
            stiffness = np.linalg.inv(compliance)
            given = constraints.given - balance @ stiffness @ fixed
            y = np.linalg.solve(balance @ stiffness @ motions, given)
            found.append((fixed + motions @ y) / unit)
        return np.array(found)

    @computed_once
    def _unit(self) -> ndarray:
        """Largest settlements by the components of the position, the same for both tilts."""
        radius = np.hypot(*self.system.planes[1:]).max()
        return np.array([1.0, radius, radius])

    @computed_once
    def _in_full_contact(self) -> tuple[ndarray, ndarray]:
        pressures = self.system.unit_pressures / self._unit
        return self._compliances(pressures, np.ones(len(pressures), dtype=bool))

    def _pressures(self, touching: ndarray) -> ndarray:
        """Pressures by motions of unit size with contact on some cells, shape (n, m)."""
        cells = np.nonzero(touching)[0]
        matrix = np.asarray(self.system.matrix)[np.ix_(cells, cells)]
        pressures = np.zeros((len(touching), len(self._unit)))
        pressures[cells] = Factors.from_matrix(matrix).solve(self.system.planes[:, cells].T)
        return pressures / self._unit

    def _compliances(self, pressures: ndarray, touching: ndarray) -> tuple[ndarray, ndarray]:
        """Motions of unit size by forces on them; without the cells that are apart, and with."""
        x, cell, load = self.sectors
        cells = self.footprint
        settled = self.rows @ pressures if cells.few else _products(cells, x, pressures)
        apart = np.where(touching[cell], settled.T - cells.planes(x) / self._unit[:, None], 0.0)
        mean = np.array([np.bincount(cell, load * e, len(touching)) for e in apart])
        mean = np.array([np.abs(mean[0]), np.hypot(*mean[1:])]) / cells.partition.areas
        near = (mean < APART).all(axis=0)
        by_points = np.linalg.inv((self.system.resultants / self._unit[:, None]) @ pressures)
        unit_forces = (pressures @ by_points)[cell].T * load
        kept, every = (
            by_points + (unit_forces * some) @ apart.T @ by_points for some in (near[cell], 1.0)
        )
        return kept, every


def _products(cells: Footprint, x: ndarray, pressures: ndarray) -> ndarray:
    operator = cells.fast_operator(x, cells.tolerance)
    return np.stack([operator @ np.ascontiguousarray(p) for p in pressures.T], axis=1)
