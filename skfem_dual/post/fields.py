"""The pressure as a field to draw: the factor that varies slowly, times the laws of the edges.

Within the plan ``p = s w``. Under a rigid edge ``w`` is the inverse square root of the torsion
function, which is like the distance there and smooth inside; where contact ends smoothly it is
the square root of the distance to that line. A cell of mean pressure q has ``s = q / mean(w)``
where its load acts, and between the cells s is a polynomial fitted to those around.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from skfem import CellBasis, ElementTriP1, MeshTri
from skfem.models.poisson import laplace, unit_load

from ..arguments import checked_instance, checked_integer
from ..contact.pressures import CellPressures
from ..elements.balance import balanced
from ..elements.load_matrix import graded
from ..elements.overlaps import overlaps
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.corners import signed_areas
from ..grids.fan import Fan
from ..grids.outline import distance_to_segments
from ..grids.planar import cross
from ..kernels.once import computed_once
from .postprocess import postprocess

#: where the square root of the distance to the line of contact levels off, over the greatest
FAR = 0.4
#: square of the width of the fit, over the area of a cell
WIDTH = 1.5
#: of the slopes in the fit
RIDGE = 1e-5


def pressure_field(
    solution: CellPressures, refine: int = 3, other: Any = None
) -> tuple[CellBasis, ndarray]:
    """The pressure under a punch as a first-order field on a refinement of the mesh.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        On any kind of cells.
    refine : int
        How often the triangles are cut in four.
    other : PunchSolution, optional
        The solution of the same problem on the other grid of the `DualMesh`; the pressures are
        then smoothed by `postprocess` first.

    Returns
    -------
    basis : CellBasis
        ElementTriP1 on the refinement; quadrilaterals are cut around their middles before.
    values : (N,) array of float
        Its vector, with force and first moments of the solution to rounding. Nodes on a singular
        edge have the finite values with which the triangles there carry their load.

    Raises
    ------
    TypeError, ValueError
        If ``refine`` is not a whole number from 0 to 6, or the solutions are no couple.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(force=1.0)
    >>> basis, p = pressure_field(solution)
    >>> print(f"{p[np.argmin(np.hypot(*basis.doflocs))]:.3f}")  # exact for the circle: 0.159
    0.159
    """
    checked_instance("solution", solution, CellPressures)
    if other is not None:
        checked_instance("other", other, CellPressures)
    laws = EdgeLaws.of(solution, checked_integer("refine", refine, at_least=0, at_most=6))
    s = _fitted(solution, laws, _smoothed(solution, other))
    values = laws.at_nodes * laws.between(s)
    if (solution.pressure >= 0).all():
        values = values.clip(0.0)
    basis = CellBasis(laws.mesh, ElementTriP1())
    return basis, balanced(basis, values, solution.resultant, solution.footprint.origin)


def _smoothed(solution: Any, other: Any) -> ndarray:
    """Pressures of cells, by the Postprocessor if there are two solutions."""
    if other is None:
        return solution.pressure
    if getattr(solution.footprint.basis, "grid", None) == "dual":
        return postprocess(solution, other).on_cells
    return postprocess(other, solution).on_triangles


@dataclass(frozen=True, eq=False)
class EdgeLaws:
    """How the pressure varies towards the edges of plan and contact, on a refinement.

    Attributes
    ----------
    base, mesh : MeshTri
        The mesh, its quadrilaterals cut around their middles, and its refinement.
    singular : (N,) array of bool
        Whether each node of the refinement is on the singular edge.
    depth : (N,) array of float or None
        Distance to the line where contact ends smoothly, negative without contact; None if
        there is no such line.
    """

    base: MeshTri
    mesh: MeshTri
    singular: ndarray
    depth: ndarray | None

    @classmethod
    def of(cls, solution: CellPressures, refine: int) -> "EdgeLaws":
        region, cells = solution.contact_region, solution.footprint
        areas = signed_areas(region.p, region.t)
        # quadrilaterals in the middle of a polar grid have sides without length
        base = MeshTri(region.p, region.t[:, areas > 1e-14 * areas.max()])
        singular = np.zeros(base.nfacets, dtype=bool)
        if cells.weights is not None:
            facets = np.unique(cells.partition.boundary[cells.weights.ribs])
            ends = np.sort(nodal_mesh(cells.basis).facets[:, facets], axis=0)
            n = base.p.shape[1]
            singular = np.isin(np.array([n, 1]) @ base.facets, np.array([n, 1]) @ ends)
        mesh = base.with_boundaries({"singular": np.nonzero(singular)[0]}).refined(refine)
        on_edge = np.zeros(mesh.p.shape[1], dtype=bool)
        on_edge[mesh.facets[:, mesh.boundaries["singular"]]] = True
        depth = None
        if region.edge:
            a = np.hstack([line[:, :-1] for line in region.edge])
            b = np.hstack([line[:, 1:] for line in region.edge])
            laws = cls(base, mesh, on_edge, None)
            parent, shares = laws._parents
            level = np.sum(region.level[base.t[:, parent]] * shares, axis=0)
            depth = np.copysign(distance_to_segments(mesh.p, a, b), level)
        return cls(base, mesh, on_edge, depth)

    @computed_once
    def _parents(self) -> tuple[ndarray, ndarray]:
        """A triangle of the base that has each node, and its barycentric coordinates there."""
        m, base = self.mesh, self.base
        # uniform refinement keeps the order of the triangles in each of its four parts
        of_triangle = np.tile(np.arange(base.nelements), m.nelements // base.nelements)
        parent = np.empty(m.p.shape[1], dtype=np.int64)
        parent[m.t] = of_triangle
        a, b, c = base.p[:, base.t[:, parent]].swapaxes(0, 1)
        twice = cross(b - a, c - a)
        second, third = cross(m.p - a, c - a) / twice, cross(b - a, m.p - a) / twice
        return parent, np.stack([1 - second - third, second, third])

    @computed_once
    def phi(self) -> ndarray:
        """The torsion function at the nodes, zero on the singular edge; ones without one."""
        phi = np.ones(self.mesh.p.shape[1])
        if self.singular.any():
            hats = CellBasis(self.mesh, ElementTriP1())
            free = np.nonzero(~self.singular)[0]
            stiffness, load = laplace.assemble(hats), unit_load.assemble(hats)
            matrix = stiffness[free][:, free].tocsc()
            options = {"SymmetricMode": True}
            factors = splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
            phi[:] = 0.0
            phi[free] = factors.solve(load[free])
            # flat triangles may break the maximum principle
            phi[free] = phi[free].clip(1e-6 * phi.max())
        return phi

    @computed_once
    def _reach(self) -> float:
        return 1.0 if self.depth is None else FAR * float(self.depth.max())

    def _closing(self, depth: ndarray) -> ndarray:
        """Square root of the distance to the line where contact ends, levelling off far from
        it, where the distance has ridges."""
        return np.sqrt(np.tanh(depth.clip(0.0) / self._reach))

    @computed_once
    def at_nodes(self) -> ndarray:
        """The laws at the nodes, on a singular edge finite: what the other nodes leave of the
        load of a triangle is shared by its nodes there."""
        mesh, edge = self.mesh, self.singular
        w = np.zeros(len(edge))
        w[~edge] = self.phi[~edge] ** -0.5
        near = np.nonzero(edge[mesh.t].any(axis=0))[0]
        t = mesh.t[:, near]
        if len(near):
            area = np.abs(signed_areas(mesh.p, t))
            whole = np.repeat(np.eye(3)[..., None], len(near), axis=2)
            load = sum(load.sum(axis=1) for _, load in graded(whole, self.phi[t], 0))
            at_edge = edge[t]
            # triangles with all their vertices on the edge have no law of their own
            full = at_edge.all(axis=0)
            left = np.where(full, 0.0, (load - w[t].sum(axis=0) / 3) * area / at_edge.sum(axis=0))
            share = np.where(full, 0.0, area / 3)
            total, areas = (
                np.bincount(t[at_edge], np.tile(x, (3, 1))[at_edge], len(edge))
                for x in (left, share)
            )
            w[edge] = (total / np.where(areas > 0, areas, 1.0))[edge]
        return w if self.depth is None else w * self._closing(self.depth)

    def of_cells(self, fan: Fan, n: int) -> tuple[ndarray, ndarray, ndarray]:
        """Integral of the laws over each cell, where it acts, and the part of w left there by
        the end of contact."""
        t = self.mesh.t
        t = np.where(signed_areas(self.mesh.p, t) < 0, t[[0, 2, 1]], t)
        pieces = overlaps(self.mesh.p[:, t], fan.p[:, fan.t])
        own, cell = t[:, pieces.first], fan.cell[pieces.second]
        area = signed_areas(self.mesh.p, t)[pieces.first, None]
        sums = np.zeros((4, n))
        for at, load in graded(pieces.vertices, self.phi[own], 1):
            load = load * area
            sums[3] += np.bincount(cell, load.sum(axis=1), n)
            if self.depth is not None:
                load = load * self._closing(np.einsum("vk,vkq->kq", self.depth[own], at))
            x = np.einsum("dvk,vkq->dkq", self.mesh.p[:, own], at)
            for row, values in zip(sums, (load, load * x[0], load * x[1]), strict=False):
                row += np.bincount(cell, values.sum(axis=1), n)
        total = np.where(sums[0] > 0, sums[0], 1.0)
        return sums[0], sums[1:3] / total, sums[0] / sums[3]

    def between(self, planes: ndarray) -> ndarray:
        """Values at the nodes from values and slopes at those of the base, shape (3, n).

        The cubic of Bazeley, Cheung, Irons and Zienkiewicz (1965) in each triangle, exact for
        polynomials of the second degree.
        """
        parent, shares = self._parents
        t = self.base.t[:, parent]
        p, (s, sx, sy) = self.base.p[:, t], planes[:, t]
        out = np.sum(s * shares**2 * (3 - 2 * shares), axis=0)
        bubble = np.prod(shares, axis=0)
        out += 2 * bubble * s.sum(axis=0)
        for i in range(3):
            for j in range(3):
                if i != j:
                    step = p[:, j] - p[:, i]
                    slope = sx[i] * step[0] + sy[i] * step[1]
                    out += slope * (shares[i] ** 2 * shares[j] + bubble / 2)
        return out


def _fitted(solution: CellPressures, laws: EdgeLaws, pressure: ndarray) -> ndarray:
    """The factor s and its slopes at the nodes of the base, shape (3, n).

    Polynomials of the second degree are fitted to the cells around, in the least squares; those
    beyond a hole or a gap do not count.
    """
    cells, base = solution.footprint, laws.base
    areas, n = cells.partition.areas, base.p.shape[1]
    total, acting, left = laws.of_cells(cells.fan, len(areas))
    s = pressure * areas / np.where(total > 0, total, 1.0)
    trust = np.where(pressure != 0, left, 0.0) ** 2
    around = _around(solution, base)
    node, cell = around.nonzero()
    arm = acting[:, cell] - base.p[:, node]
    length = np.sqrt(areas[cell])
    size = (np.bincount(node, length, n) / np.bincount(node, minlength=n))[node]
    x, y = arm / size
    weight = np.exp(-(x**2 + y**2) / WIDTH) * trust[cell]
    terms = [np.ones(len(node)), x, y, x**2, x * y, y**2]

    def sums(values: ndarray) -> ndarray:
        return np.bincount(node, weight * values, n)

    matrix = np.array([[sums(a * b) for a in terms] for b in terms]).transpose(2, 0, 1)
    # where few cells are left the polynomial is of a lower degree
    heavy = np.diag([0.0, RIDGE, RIDGE, 10 * RIDGE, 10 * RIDGE, 10 * RIDGE])
    matrix += matrix[:, :1, :1] * heavy
    matrix[matrix[:, 0, 0] < 1e-12] = np.eye(6)
    right = np.array([sums(a * s[cell]) for a in terms]).T
    found = np.linalg.solve(matrix, right[..., None])[:, :3, 0].T
    found[1:] /= _spread(node, size, n)
    return found


def _spread(node: ndarray, size: ndarray, n: int) -> ndarray:
    out = np.ones(n)
    out[node] = size
    return out


def _around(solution: CellPressures, base: MeshTri) -> csr_matrix:
    """Cells around each node of the base, up to the second ring; shape (nodes, cells)."""
    n, t = base.p.shape[1], base.t
    sides = np.hstack([t, np.roll(t, 1, axis=0)])
    rows = np.concatenate([sides[0], sides[1], sides[2], np.arange(n)])
    columns = np.concatenate([*np.roll(sides, 1, axis=0), np.arange(n)])
    beside = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    basis = solution.footprint.basis
    mesh = nodal_mesh(basis)
    if isinstance(basis, CellwiseBasis) and basis.grid == "dual":
        return beside @ beside
    m = mesh.nelements
    places = mesh.t.ravel(), np.tile(np.arange(m), len(mesh.t))
    vertices = csr_matrix((np.ones(mesh.t.size), places), shape=(n, m))
    return beside @ vertices
