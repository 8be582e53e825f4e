"""The pressure inside the cells: the law of the edge times what varies slowly."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import CellBasis

from ..contact.footprint import Footprint
from ..elements.curvature import Curvature
from ..elements.line_weights import LineWeights
from ..grids.cellwise import nodal_mesh, nodal_values
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly, computed_once


@dataclass(frozen=True, eq=False)
class InsideCells(ReadOnly):
    """Pressures at points and nodes from the means of the cells.

    Attributes
    ----------
    footprint : Footprint
        The cells.
    pressure : (n,) array of float
        Their mean pressures.
    line : LineWeights or None
        The law along a line of contact they were found with.
    """

    footprint: Footprint
    pressure: ndarray
    line: LineWeights | None

    @computed_once
    def slopes(self) -> ndarray:
        """Slopes of the pressure over the law of the edge in each cell, see `Slopes`; (2, n)."""
        return readonly(self.footprint.slopes_of(self.pressure))

    @computed_once
    def curvature(self) -> Curvature | None:
        """How smooth pressures bend inside the cells: of those found with a line of contact."""
        slopes = self.footprint.slopes
        if self.line is None or slopes is None:
            return None
        return Curvature.of(slopes, self.pressure)

    def over_law(self, cell: ndarray, x: ndarray) -> ndarray:
        """Pressure over ``w / mean(w)`` in some cells, at points of shape (2, ...)."""
        arm = x - self.footprint.acting[:, cell]
        if self.curvature is not None:
            return self.pressure[cell] + self.curvature.rise(cell, arm)
        return self.pressure[cell] + np.sum(self.slopes[:, cell] * arm, axis=0)

    def at_points(self, x: ndarray) -> ndarray:
        """Pressure at points (2, m), infinite on a singular edge, zero beside the cells; (m,)."""
        inside, cell, factor = self.footprint.pressure_factors(x)
        inner = self.over_law(cell, x[:, inside])
        out = np.zeros(x.shape[1])
        out[inside] = np.where(inner == 0, 0.0, factor) * inner
        return out

    def at_nodes(self) -> tuple[CellBasis, ndarray]:
        """Pressure at the nodes of the mesh, on a singular edge the means of cells; its basis and
        vector."""
        basis, weights = self.footprint.basis, self.footprint.weights
        pressure = self.pressure
        if weights is not None:
            # the nodes of the mesh are the first points of a fan; dual cell i is that of node i
            mesh, on_dual = nodal_mesh(basis), self.footprint.on_dual_cells
            nodes = np.arange(len(pressure)) if on_dual else mesh.t
            cells = np.broadcast_to(np.arange(len(pressure)), nodes.shape)
            own, root = weights.weighted[cells], np.full(nodes.shape, np.inf)
            root[own] = weights.root[weights.fan.places(nodes[own])]
            inner = (root > 1e-9 * weights.root.max()) | (self.line is not None)
            inside = self.over_law(cells, mesh.p[:, nodes])
            pressure = np.where(inner, weights.relative(cells, root) * inside, pressure)
        return nodal_values(basis, pressure)
