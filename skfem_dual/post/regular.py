"""The regular part of pressures: what is left after the edge's singularity is divided out.

Under a flat punch the pressure grows like ``1 / sqrt(d)`` towards the edge. It is written
``p = s w`` with ``w = phi^(-1/2)``, where phi vanishes on the edge like the distance and is smooth
inside, as the distance is not (it has ridges): the solution of ``-laplace(phi) = 1``, Prandtl's
torsion function. Under a circle or an ellipse it makes ``s`` constant for a central force. A cell
of mean pressure q has ``s = q / mean(w)`` at the point where its load acts, whatever was assumed
of the pressure inside it.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import block_array, csr_array, diags_array, eye_array
from skfem import CellBasis, ElementTriP1, MeshTri
from skfem.models.poisson import laplace, unit_load

from ..elements.edge_weights import EdgeWeights
from ..grids.corners import signed_areas
from ..grids.dual_mesh import DualMesh
from ..grids.fan import Fan
from ..grids.general import general_triangulation
from ..grids.mappings import own_mapping
from ..grids.partition import Partition
from ..grids.planar import cross
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .functional import Neighbours, factorised


@dataclass(frozen=True, eq=False)
class TorsionWeights(EdgeWeights):
    """The weight ``w = phi^(-1/2)`` with given values of phi at the points of the fan."""

    phi: ndarray

    @computed_once
    def root(self) -> ndarray:
        """Square root of phi at the points of the fan; never zero, so that means are finite."""
        return readonly(np.sqrt(self.phi.clip(1e-40 * self.phi.max())))


@dataclass(frozen=True, eq=False)
class RegularCouple:
    """Regular parts at the nodes of a couple of grids, and the fields that belong to them.

    Vectors of regular parts hold the values at the nodes of the mesh first, then those at the
    barycentres of the triangles; vectors of pressures those of dual cells, then of triangles.

    Attributes
    ----------
    dual : DualMesh
        The couple of grids.
    singular : (k,) array of int
        Facets of the mesh on the singular edge. Without any w = 1, and s is the pressure.
    """

    dual: DualMesh
    singular: ndarray

    @computed_once
    def neighbours(self) -> Neighbours:
        """Coefficients of the functional."""
        return Neighbours.of(self.dual)

    @computed_once
    def partitions(self) -> tuple[Partition, Partition]:
        """Dual cells and triangles."""
        return self.dual.partition, self.dual.primal_partition

    @computed_once
    def parts(self) -> tuple[ndarray, ndarray]:
        """Numbers of the parts of the plan in which dual cells and triangles lie."""
        of_cells = self.dual.partition.parts(np.ones(len(self.dual), dtype=bool))
        return of_cells, of_cells[self.dual.mesh.t[0]]

    @computed_once
    def areas(self) -> ndarray:
        """Areas of dual cells and triangles."""
        return np.concatenate([grid.areas for grid in self.partitions])

    @computed_once
    def x(self) -> ndarray:
        """The nodes of the mesh and the barycentres, shape (2, n + m)."""
        return np.hstack([grid.nodes for grid in self.partitions])

    @computed_once
    def general(self) -> MeshTri:
        """The general triangulation, on whose nodes the fields live."""
        return general_triangulation(self.dual)

    @computed_once
    def general_areas(self) -> ndarray:
        """Areas of its triangles."""
        return np.abs(signed_areas(self.general.p, self.general.t))

    @computed_once
    def edge_nodes(self) -> ndarray:
        """Whether each node of the general triangulation lies on the singular edge."""
        on_edge = np.zeros(self.general.p.shape[1], dtype=bool)
        on_edge[self.dual.mesh.facets[:, self.singular]] = True
        boundary = self.dual.mesh.boundary_facets()
        on_edge[self.x.shape[1] :] = np.isin(boundary, self.singular)
        return on_edge

    def outer(self, rings: int) -> tuple[ndarray, ndarray]:
        """Dual cells in the outer rings along the singular edge, and triangles that touch them."""
        mesh = self.dual.mesh
        outer = np.zeros(mesh.p.shape[1], dtype=bool)
        outer[mesh.facets[:, self.singular]] = True
        for _ in range(rings - 1):
            outer[mesh.t[:, outer[mesh.t].any(axis=0)]] = True
        return outer, outer[mesh.t].any(axis=0)

    @computed_once
    def phi(self) -> ndarray:
        """The torsion function at the nodes of the general triangulation."""
        # along the ribs no triangle has all its nodes on the edge
        mesh = general_triangulation(self.dual, "rib")
        return torsion(CellBasis(mesh, ElementTriP1()), self.edge_nodes)

    @computed_once
    def weights(self) -> tuple[TorsionWeights, TorsionWeights] | None:
        """How the pressure varies inside dual cells and triangles; None without an edge."""
        if len(self.singular) == 0:
            return None
        mesh, dual = self.dual.mesh, self.dual
        n, m = mesh.p.shape[1], mesh.nelements
        # a crossing lies on the rib between two barycentres, or is the middle of its facet
        ends = n + dual.facets[:, : mesh.nfacets]
        a, b = self.general.p[:, ends].swapaxes(0, 1)
        inner = mesh.f2t[1] != -1
        share = np.ones(mesh.nfacets)
        share[inner] = (np.hypot(*(dual.crossings - a)) / np.hypot(*(b - a)))[inner]
        at_middle = ends.max(axis=0)
        crossing = np.where(
            inner, (1 - share) * self.phi[ends[0]] + share * self.phi[ends[1]], self.phi[at_middle]
        )
        first = np.concatenate([self.phi[:n], crossing, self.phi[n : n + m]])
        values = first, self.phi[: n + m]
        fans = Fan.from_dual(dual), Fan.from_mesh(mesh)
        each = zip(self.partitions, fans, values, strict=True)
        on_cells, on_triangles = (TorsionWeights(g, f, np.empty(0), phi) for g, f, phi in each)
        return on_cells, on_triangles

    @computed_once
    def means(self) -> ndarray:
        """Means of w over dual cells and triangles."""
        if self.weights is None:
            return np.ones(self.x.shape[1])
        return np.concatenate([w.mean for w in self.weights])

    @computed_once
    def acting(self) -> ndarray:
        """Where the loads of dual cells and triangles act, shape (2, n + m)."""
        grids = self.partitions if self.weights is None else self.weights
        return np.hstack([grid.centroids for grid in grids])

    def from_pressures(self, pressures: ndarray) -> ndarray:
        """Regular parts at the nodes from pressures of cells; exact where they are linear."""
        s = pressures / self.means
        n = len(self.dual)
        offset, t = self.x - self.acting, self.dual.mesh.t
        slopes = _nodal_slopes(self.acting[:, :n], t)
        s[:n] = s[:n] + sum(d * (slope @ s[:n]) for d, slope in zip(offset[:, :n], slopes))
        slopes = _slopes(self.x[:, :n], t)
        s[n:] = s[n:] + sum(d * (slope @ s[:n]) for d, slope in zip(offset[:, n:], slopes))
        return s

    @computed_once
    def to_pressures(self) -> csr_array:
        """Takes regular parts at the nodes to mean pressures of cells, the inverse map."""
        n, m = len(self.dual), self.dual.mesh.nelements
        offset, t = self.x - self.acting, self.dual.mesh.t
        at_nodes = sum(
            diags_array(d) @ slope
            for d, slope in zip(offset[:, :n], _nodal_slopes(self.x[:, :n], t))
        )
        in_triangles = sum(
            diags_array(d) @ slope for d, slope in zip(offset[:, n:], _slopes(self.x[:, :n], t))
        )
        carry = block_array([[eye_array(n) - at_nodes, None], [-in_triangles, eye_array(m)]])
        return csr_array(diags_array(self.means) @ carry)

    @computed_once
    def to_field(self) -> csr_array:
        """Takes regular parts to the pressures at the nodes of the general triangulation.

        Where the pressure is infinite, on the singular edge, the nodes take the finite values with
        which the triangles beside them carry their loads.
        """
        total, known = self.general.p.shape[1], self.x.shape[1]
        mesh = self.dual.mesh
        middles = np.arange(known, total)
        ends = mesh.facets[:, mesh.boundary_facets()]
        rows = np.concatenate([np.arange(known), np.tile(middles, 2)])
        columns = np.concatenate([np.arange(known), ends.ravel()])
        share = np.concatenate([np.ones(known), np.full(ends.size, 0.5)])
        factor = np.ones(total)
        if len(self.singular):
            factor = self._field_weights()
        return csr_array((share * factor[rows], (rows, columns)), shape=(total, known))

    def _field_weights(self) -> ndarray:
        """w at the nodes of the general triangulation, finite on the edge."""
        mesh, edge = self.general, self.edge_nodes
        grid, fan = Partition.from_mesh(mesh), Fan.from_mesh(mesh)
        phi = np.append(self.phi, self.phi[mesh.t].mean(axis=0))
        mean = TorsionWeights(grid, fan, np.empty(0), phi).mean
        w = np.zeros(len(edge))
        w[~edge] = self.phi[~edge] ** -0.5
        return self.completed(w, mean)

    def completed(self, values: ndarray, mean: ndarray) -> ndarray:
        """A field with finite values on the singular edge, by its means over the triangles of the
        general triangulation: what the other nodes leave of a triangle's load is shared by its
        nodes on the edge."""
        t, edge, areas = self.general.t, self.edge_nodes, self.general_areas
        at_edge = edge[t]
        values = np.where(edge, 0.0, values)
        left = (mean - values[t].sum(axis=0) / 3) * areas / at_edge.sum(axis=0).clip(1)
        load, area = (
            np.bincount(t[at_edge], np.tile(x, (3, 1))[at_edge], len(edge))[edge]
            for x in (left, areas / 3)
        )
        values[edge] = load / area
        return values

    def field_basis(self) -> CellBasis:
        """First-order elements on the general triangulation."""
        return CellBasis(self.general, ElementTriP1(), mapping=own_mapping(self.general))


def torsion(basis: CellBasis, held: ndarray) -> ndarray:
    """The torsion function: zero at the DOFs that are held, (N,) array of bool, else positive."""
    free, values = np.nonzero(~held)[0], np.zeros(basis.N)
    matrix = laplace.assemble(basis)[free][:, free]
    values[free] = factorised(matrix).solve(unit_load.assemble(basis)[free])
    # flat triangles and corners may break the maximum principle
    values[free] = values[free].clip(1e-6 * values.max())
    return values


def _edges(p: ndarray, t: ndarray) -> tuple[ndarray, ndarray]:
    """Slopes of hat functions times twice the signed area, shape (2, 3, m), and that area."""
    v = p[:, t]
    opposite = np.roll(v, -2, axis=1) - np.roll(v, -1, axis=1)
    first, second = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    return np.stack([-opposite[1], opposite[0]]), cross(first, second)


def _slopes(p: ndarray, t: ndarray) -> list[csr_array]:
    """Takes values at points ``p`` to the two slopes of the planes through triangles ``t``."""
    hats, twice = _edges(p, t)
    triangle = np.tile(np.arange(t.shape[1]), (3, 1))
    place = triangle.ravel(), t.ravel()
    shape = t.shape[1], p.shape[1]
    return [csr_array(((hat / twice).ravel(), place), shape=shape) for hat in hats]


def _nodal_slopes(p: ndarray, t: ndarray) -> list[csr_array]:
    """Takes values at points to their slopes there, means over triangles weighted by area."""
    hats, twice = _edges(p, t)
    n, m = p.shape[1], t.shape[1]
    triangle = np.tile(np.arange(m), (3, 1)).ravel()
    around = csr_array((np.ones(3 * m), (t.ravel(), triangle)), shape=(n, m))
    # no division by the areas: triangles between centroids may be flat
    total = 1 / (around @ np.abs(twice))
    return [
        diags_array(total)
        @ around
        @ csr_array(((hat * np.sign(twice)).ravel(), (triangle, t.ravel())), shape=(m, n))
        for hat in hats
    ]
