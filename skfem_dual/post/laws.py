"""Pressures by the laws inside cells: their means over both grids, their values between.

Edge-weighted cells tell the pressure in every point, and so the loads of the cells of the other
grid too. Triangles that lie in one cell of each grid have their exact loads.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ..contact.footprint import Footprint
from ..elements.edge_weights import EdgeWeights
from ..grids.dual_mesh import DualMesh
from ..grids.fan import Fan
from .regular import RegularCouple, TorsionWeights


@dataclass(frozen=True, eq=False)
class Law:
    """Mean pressures on one grid of a `DualMesh`, and how they vary inside its cells.

    Attributes
    ----------
    cells : Footprint
        Edge-weighted cells.
    pressure : (n,) array of float
        Their mean pressures.
    """

    cells: Footprint
    pressure: ndarray

    @property
    def weights(self) -> EdgeWeights:
        """The law of the edge."""
        if self.cells.weights is None:
            raise ValueError("expected edge-weighted cells, got uniform ones")
        return self.cells.weights

    def at_nodes(self, couple: RegularCouple) -> ndarray:
        """Pressure at the nodes of the general triangulation, means of the cells that meet there;
        zero on the singular edge."""
        mesh = couple.dual.mesh
        n, m, ends = mesh.p.shape[1], mesh.nelements, mesh.boundary_facets()
        nodes, triangles, middles = np.arange(n), np.arange(m), n + m + np.arange(len(ends))
        if self.cells.on_dual_cells:
            where = nodes, np.tile(n + triangles, 3), np.tile(middles, 2)
            cells = nodes, mesh.t.ravel(), mesh.facets[:, ends].ravel()
        else:
            where = mesh.t.ravel(), n + triangles, middles
            cells = np.tile(triangles, 3), triangles, mesh.f2t[0, ends]
        point, cell = np.concatenate(where), np.concatenate(cells)
        inner = ~couple.edge_nodes
        point, cell = point[inner[point]], cell[inner[point]]
        x, root = couple.general.p, np.zeros(len(inner))
        root[inner] = np.sqrt(self.weights.phi_at(x[:, inner]))
        slopes, arm = self.cells.slopes_of(self.pressure), x[:, point] - self.cells.acting[:, cell]
        values = self.pressure[cell] + np.sum(slopes[:, cell] * arm, axis=0)
        values = self.weights.relative(cell, root[point]) * values
        sums, numbers = (np.bincount(point, each, len(inner)) for each in (values, None))
        return sums / numbers.clip(1)

    def pieces(self) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """Dual cell, triangle, centroid (2, k) and load of k triangles that fill both grids."""
        on_dual, weights = self.cells.on_dual_cells, self.weights
        if on_dual:
            weights = replace(weights, fan=self.cells.fan)
        else:
            weights = _cut(weights, self.cells.basis.dual)
        fan, (mean, off) = weights.fan, weights.of_triangles
        cell, weighted = fan.cell, weights.weighted[fan.cell]
        middle = fan.p[:, fan.t].mean(axis=1)
        arm = middle + np.where(weighted, off, 0.0) - weights.centroids[:, cell]
        inside = self.pressure[cell]
        inside = inside + np.sum(self.cells.slopes_of(self.pressure)[:, cell] * arm, axis=0)
        load = np.where(weighted, mean / weights.mean[cell], 1.0) * fan.areas * inside
        node, element = (cell, fan.part) if on_dual else (fan.part, cell)
        return node, element, middle, load


def _cut(weights: EdgeWeights, dual: DualMesh) -> TorsionWeights:
    """The law of triangles on those cut by the dual cells: phi remains linear along their sides,
    but in triangles halved next to corners."""
    weights = weights.with_fan(Fan.from_refinement(dual))
    mesh, fan, phi = dual.mesh, weights.fan, weights.root**2
    whole = np.ones(mesh.nfacets, dtype=bool)
    whole[mesh.t2f[:, np.bincount(fan.cell, minlength=mesh.nelements) > 6]] = False
    a, b = mesh.p[:, mesh.facets].swapaxes(0, 1)
    crossing = len(dual) + np.arange(mesh.nfacets)
    share = np.hypot(*(fan.p[:, crossing] - a)) / np.hypot(*(b - a))
    linear = (1 - share) * phi[mesh.facets[0]] + share * phi[mesh.facets[1]]
    phi[crossing] = np.where(whole, linear, phi[crossing])
    return TorsionWeights(
        weights.partition, fan, weights.ribs, phi, law=weights.law, corners=weights.corners
    )


def means(couple: RegularCouple, laws: Sequence[Law], shares: Sequence[float]) -> ndarray:
    """Means over dual cells, then over triangles, of some pressures mixed in shares."""
    total, n = np.zeros(len(couple.areas)), len(couple.dual)
    for law, share in zip(laws, shares, strict=True):
        node, element, _, load = law.pieces()
        for cell in (node, n + element):
            total += np.bincount(cell, share * load, len(total))
    return total / couple.areas


def mixed(
    couple: RegularCouple, laws: Sequence[Law], shares: Sequence[float]
) -> tuple[ndarray, ndarray, ndarray]:
    """Means over dual cells and over triangles of some pressures, mixed in shares, and their field
    on the general triangulation."""
    grid = Fan.from_mesh(couple.general)
    sizes = len(couple.dual), couple.dual.mesh.nelements, couple.general.nelements
    loads = [np.zeros(size) for size in sizes]
    values = np.zeros(couple.general.p.shape[1])
    for law, share in zip(laws, shares, strict=True):
        node, element, middle, load = law.pieces()
        triangle = grid.cell[grid.locate(middle)]
        for total, cell in zip(loads, (node, element, triangle), strict=True):
            total += np.bincount(cell, share * load, len(total))
        values += share * law.at_nodes(couple)
    on_cells, on_triangles = couple.partitions
    field = couple.completed(values, loads[2] / couple.general_areas)
    return loads[0] / on_cells.areas, loads[1] / on_triangles.areas, field
