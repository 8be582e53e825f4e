"""The pressure as a field to draw: the factor that varies slowly, times the laws of the edges.

Within the plan ``p = s w``. Under a rigid edge ``w`` is the inverse square root of the torsion
function, which is like the distance there and smooth inside; where contact ends smoothly it is
the square root of the distance to that line. A cell of mean pressure q has ``s = q / mean(w)``
where its load acts, and between the cells s is a polynomial fitted to those around.
"""

from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from skfem import CellBasis, ElementQuad0, ElementTriP1, ElementTriP2, MeshTri

from ..arguments import checked_integer
from ..contact.edges import presses_over
from ..contact.period import PeriodTriangles
from ..elements.balance import balanced, field_resultant
from ..elements.edge_weights import mean_weight
from ..elements.graded_rule import graded
from ..errors import ConvergenceError, MeshError
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.corners import signed_areas
from ..grids.fan import Fan
from ..grids.general import facet_numbers
from ..grids.outline import distance_to_segments
from ..grids.partition import Partition
from ..grids.planar import cross
from ..grids.refinement import Refinement
from ..ground.periodic import PeriodicGround
from ..messages import without_remedy
from ..operators.resources import refuse_beyond_memory
from ..solutions.pressures import CellPressures, checked_solution
from .postprocess import postprocess
from .regular import torsion

#: where the square root of the distance to the line of contact levels off, over the greatest
FAR = 0.25
#: square of the width of the fit, over the area of a cell
WIDTH = 1.5
#: degree of products with the laws that are integrated over cells
ORDER = 4
#: root of phi on the edge, over its greatest
TINY = 1e-20
#: barycentric coordinates, and depths over the greatest, that are zero
ROUNDING = 1e-8
#: of the slopes in the fit
RIDGE = 1e-5
#: pressures over those of cells around where contact ends: as under a ball that touches one cell
MOST = 1.5
#: bytes that a triangle takes, and each of those it is cut into
OF_TRIANGLE, OF_SMALL = 3500.0, 550.0


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
        Its vector, with force and first moments of the solution to rounding, on ground with a
        period, where moments depend on where it is cut, with its force. Nodes on a singular
        edge have the finite values with which the triangles there carry their load.

    Raises
    ------
    TypeError, ValueError
        If ``refine`` is not a whole number from 0 to 6, or the solutions are no couple.
    MeshError
        If a part of the plan with a singular edge is one triangle.
    ConvergenceError
        If contact on a few cells leaves too few nodes to carry force and moments.
    MemoryError
        Before the work, if the memory at hand will not do.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(force=1.0)
    >>> basis, p = pressure_field(solution)
    >>> print(f"{p[np.argmin(np.hypot(*basis.doflocs))]:.2f}")  # exact for the circle: 0.159
    0.16
    """
    checked_solution("solution", solution)
    if other is not None:
        checked_solution("other", other)
    refine = checked_integer("refine", refine, at_least=0, at_most=6)
    pressure = _smoothed(solution, other)
    if isinstance(solution.footprint.substrate, PeriodicGround):
        return _on_period(solution, pressure, refine)
    basis, values = _unbalanced(solution, pressure, refine, _singular_facets(solution))
    return basis, balanced(basis, values, solution.resultant, solution.footprint.origin)


def _singular_facets(solution: CellPressures) -> ndarray:
    """Facets of the mesh towards which pressures grow: those whose law the cells have; of cells
    with constant pressures the whole edge of the plan, if their means grow to it."""
    cells = solution.footprint
    if cells.weights is not None:
        return cells.weights.facets
    if not presses_over(cells.partition, solution.pressure):
        return np.zeros(0, dtype=int)
    return nodal_mesh(cells.basis).boundary_facets()


def _unbalanced(
    solution: Any, pressure: ndarray, refine: int, singular: ndarray
) -> tuple[CellBasis, ndarray]:
    """The field with the resultant that it happens to have; ``singular`` as `_singular_facets`."""
    triangles = solution.contact_region.t.shape[1]
    refuse_beyond_memory(
        triangles * (OF_TRIANGLE + OF_SMALL * 4.0**refine),
        f"a field on {triangles} triangles that are cut in four {refine} times takes",
        "a smaller refine",
    )
    laws = EdgeLaws.of(solution, refine, singular)
    loads = laws.of_cells(solution.punch.footprint)
    values = laws.at_nodes * laws.between(_fitted(solution, laws, pressure, loads))
    if (solution.pressure >= 0).all():
        values = values.clip(0.0)
    if laws.depth is not None:
        values = np.minimum(values, _most(solution, laws, pressure, loads))
    return CellBasis(laws.refined.mesh, ElementTriP1()), values


def _on_period(
    solution: CellPressures, pressure: ndarray, refine: int
) -> tuple[CellBasis, ndarray]:
    """The field on a period, by the cells around it too, with its force."""
    triangles = cast(PeriodTriangles, solution.punch.footprint.triangles)
    region, mesh, cell = triangles.around(solution.contact_region)
    basis = CellBasis(mesh, ElementQuad0())
    cells = SimpleNamespace(
        weights=None, partition=Partition.from_mesh(mesh), fan=Fan.from_basis(basis), basis=basis
    )
    wide = SimpleNamespace(
        contact_region=region,
        punch=SimpleNamespace(footprint=cells),
        footprint=cells,
        pressure=solution.pressure[cell],
    )
    found, values = _unbalanced(wide, pressure[cell], refine, np.zeros(0, dtype=int))
    x = found.mesh.p[:, found.mesh.t].mean(axis=1)
    own = np.abs(x - triangles.p.mean(axis=1)[:, None])
    half = np.ptp(triangles.p, axis=1)[:, None] / 2
    elements = np.nonzero((own < half).all(axis=0))[0]
    nodes = np.unique(found.mesh.t[:, elements])
    basis = CellBasis(found.mesh.restrict(elements), ElementTriP1())
    values = values[nodes]
    carried, force = field_resultant(basis, values)[0], float(solution.resultant[0])
    if carried <= 0 < force:
        raise ConvergenceError(
            "too few nodes have pressures that could carry the force. Remedy: smaller cells, or "
            "a larger refine"
        )
    return basis, values * (force / carried if carried > 0 else 0.0)


def _smoothed(solution: Any, other: Any) -> ndarray:
    """Pressures of cells, by the Postprocessor if there are two solutions."""
    if other is None:
        return solution.pressure
    dual = getattr(solution.footprint.basis, "grid", None) == "dual"
    try:
        found = postprocess(*((solution, other) if dual else (other, solution)))
    except ConvergenceError as error:
        reason = without_remedy(error)
        raise ConvergenceError(
            f"{reason}. Remedy: leave out other=, or smaller cells where contact is"
        ) from error
    return found.on_cells if dual else found.on_triangles


@dataclass(frozen=True, eq=False)
class EdgeLaws:
    """How the pressure varies towards the edges of plan and contact, on a refinement.

    Attributes
    ----------
    refined : Refinement
        Of the mesh, quadrilaterals cut around their middles.
    kept : (m,) array of int
        Triangles of the contact region that the base of the refinement has.
    phi : (n,) array of float
        Coefficients, of Bernstein, of the torsion function: one at each node and one at each
        facet of the base. Zero on the singular edge; ones without one.
    depth : (n,) array of float or None
        The same for the distance to the line where contact ends smoothly, negative without
        contact; None if there is no such line.
    """

    refined: Refinement
    kept: ndarray
    phi: ndarray
    depth: ndarray | None

    @classmethod
    def of(cls, solution: CellPressures, refine: int, facets: ndarray) -> "EdgeLaws":
        """Towards some facets of the mesh, and towards where contact ends inside."""
        region, cells = solution.contact_region, solution.punch.footprint
        areas = signed_areas(region.p, region.t)
        # quadrilaterals in the middle of a polar grid have sides without length
        kept = np.nonzero(areas > 1e-14 * areas.max())[0]
        base = MeshTri(region.p, np.ascontiguousarray(region.t[:, kept]))
        singular = np.zeros(base.nfacets, dtype=bool)
        kept_ones = facet_numbers(base, *nodal_mesh(cells.basis).facets[:, facets])
        singular[kept_ones[kept_ones >= 0]] = True
        depth = None
        if region.edge:
            a = np.hstack([line[:, :-1] for line in region.edge])
            b = np.hstack([line[:, 1:] for line in region.edge])
            x = np.hstack([base.p, base.p[:, base.facets].mean(axis=1)])
            level = np.append(region.level, region.level[base.facets].mean(axis=0))
            depth = _bernstein(base, np.copysign(distance_to_segments(x, a, b), level))
        refined, phi = Refinement.towards(base, singular, refine), _torsion(base, singular)
        inside = phi[np.vstack([base.t, base.p.shape[1] + base.t2f])].any(axis=0)
        if not inside.all():
            raise MeshError(
                "expected parts of a plan of several triangles, got triangle "
                f"{kept[np.argmin(inside)]} alone, where pressures have no value inside. Remedy: "
                "a finer mesh, mesh.refined()"
            )
        return cls(refined, kept, phi, depth)

    def _closing(self, parent: ndarray, shares: ndarray) -> ndarray | float:
        """Square root of the distance to the line where contact ends, levelling off far from
        it, where the distance has ridges."""
        if self.depth is None:
            return 1.0
        depth = _quadratic(self.refined.base, self.depth, parent, shares)
        return np.sqrt(np.tanh(depth.clip(0.0) / (FAR * self.depth.max())))

    @cached_property
    def at_nodes(self) -> ndarray:
        """The laws at the nodes."""
        return self.edge_at_nodes * self._closing(self.refined.parent, self.refined.shares)

    @cached_property
    def edge_at_nodes(self) -> ndarray:
        """That of the edge at the nodes, such that between them triangles have their load in the
        mean: a little less than its values, and finite on a singular edge."""
        parent, shares, edge = self.refined.parent, self.refined.shares, self.refined.edge
        mesh = self.refined.mesh
        root = np.sqrt(_quadratic(self.refined.base, self.phi, parent, shares))
        w = np.divide(1.0, root, out=np.zeros_like(root), where=~edge)
        root = root.clip(TINY * root.max())
        load = mean_weight(*root[mesh.t])
        area = np.abs(signed_areas(mesh.p, mesh.t))
        # what is left is made good by the nodes inside first, then by those on the edge
        at_edge = edge[mesh.t]
        beside = at_edge.any(axis=0)
        for part, nodes in ((~beside, ~at_edge), (beside, at_edge)):
            left = (load - w[mesh.t].mean(axis=0)) * area * part / nodes.sum(axis=0).clip(1)
            share = area * part / 3
            total, areas = (
                np.bincount(mesh.t.ravel(), (x * nodes).ravel(), len(w)) for x in (left, share)
            )
            w += np.divide(total, areas, out=np.zeros_like(w), where=areas > 0)
        return w

    def of_cells(self, cells: Any) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """Integral of the laws over each cell, where it acts, how far it spreads around there,
        (3, n) along xx, xy and yy, and the integral of that of the edge alone."""
        fan, base = cells.fan, self.refined.base
        parent, corners, phi = self._in_fan(fan, cells.basis)
        grade = phi
        if self.depth is not None:
            # cut where contact ends; away from a singular edge the root of the distance to that
            # line is all that varies
            deep = np.empty(fan.p.shape[1])
            deep[fan.t] = _quadratic(base, self.depth, parent, corners)
            deep[np.abs(deep) < ROUNDING * deep.max()] = 0.0
            fan, deep = fan.cut_at_zero(deep)
            parent, corners, phi = self._in_fan(fan, cells.basis)
            grade = np.where((phi > 0).all(axis=0), np.abs(deep[fan.t]), phi)
        whole = np.repeat(np.eye(3)[..., None], len(parent), axis=2)
        sums = np.zeros((7, len(cells.partition)))
        centre = cells.partition.centroids[:, fan.cell]  # there is no cancellation near it
        for at, load in graded(whole, grade, ORDER):
            shares = np.einsum("ivk,vkq->ikq", corners, at)
            linear = np.einsum("vk,vkq->kq", grade, at)
            exact = _quadratic(base, self.phi, parent[:, None], shares)
            ratio = np.divide(linear, exact, out=np.zeros_like(exact), where=exact > 0)
            load = load * np.sqrt(ratio) * fan.areas[:, None]
            sums[6] += np.bincount(fan.cell, load.sum(axis=1), sums.shape[1])
            load = load * self._closing(parent[:, None], shares)
            x, y = np.einsum("dvk,vkq->dkq", fan.p[:, fan.t] - centre[:, None], at)
            for row, factor in zip(sums, (1.0, x, y, x * x, x * y, y * y), strict=False):
                row += np.bincount(fan.cell, (load * factor).sum(axis=1), sums.shape[1])
        total = np.where(sums[0] > 0, sums[0], 1.0)
        (x, y), squares = sums[1:3] / total, sums[3:6] / total
        acting = np.stack([x, y]) + cells.partition.centroids
        return sums[0], acting, squares - [x * x, x * y, y * y], sums[6]

    def _in_fan(self, fan: Fan, basis: CellBasis) -> tuple[ndarray, ndarray, ndarray]:
        """Of each triangle of a fan that of the base it is in, the coordinates there, first axis,
        of its vertices, second axis, and phi in these."""
        mesh, base = nodal_mesh(basis), self.refined.base
        # quadrilaterals were cut around their middles in the same order
        element = fan.part if len(mesh.t) == 4 else fan.part % mesh.nelements
        parent = np.searchsorted(self.kept, element)
        corners = _coordinates(base.p[:, base.t[:, parent]], fan.p[:, fan.t])
        return parent, corners, _quadratic(base, self.phi, parent, corners)

    def between(self, planes: ndarray) -> ndarray:
        """Values at the nodes from values and slopes at those of the base, shape (3, n).

        The cubic of Bazeley, Cheung, Irons and Zienkiewicz (1965) in each triangle, exact for
        polynomials of the second degree.
        """
        shares, base = self.refined.shares, self.refined.base
        t = base.t[:, self.refined.parent]
        p, (s, sx, sy) = base.p[:, t], planes[:, t]
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


def _coordinates(triangles: ndarray, x: ndarray) -> ndarray:
    """Barycentric coordinates, first axis, of points (2, k, m) in m triangles that have them."""
    a, b, c = triangles.swapaxes(0, 1)
    twice = cross(b - a, c - a)
    second = cross(x - a[:, None], (c - a)[:, None]) / twice
    third = cross((b - a)[:, None], x - a[:, None]) / twice
    shares = np.stack([1 - second - third, second, third])
    return np.where(shares > ROUNDING, shares, 0.0)


def _torsion(base: MeshTri, singular: ndarray) -> ndarray:
    """Coefficients of the torsion function of the plan, positive inside."""
    basis = CellBasis(base, ElementTriP2())
    if not singular.any():
        return np.ones(basis.N)
    n, held = base.p.shape[1], np.zeros(basis.N, dtype=bool)
    held[base.facets[:, singular]] = True
    held[n:] = singular
    values = torsion(basis, held)
    out = _bernstein(base, values)
    least = np.maximum(out[base.facets].mean(axis=0) / 2, values[n:] / 2)
    out[n:] = np.where(singular, 0.0, np.maximum(out[n:], least))
    return out


def _bernstein(base: MeshTri, values: ndarray) -> ndarray:
    """Coefficients of second degree from values at nodes and middles of facets."""
    n = base.p.shape[1]
    ends = values[base.facets].mean(axis=0)
    return np.append(values[:n], 2 * values[n:] - ends)


def _quadratic(base: MeshTri, c: ndarray, parent: ndarray, shares: ndarray) -> ndarray:
    """Values of a function of second degree at points in triangles of the base.

    Sums of products of what is not negative: zero or positive if the coefficients are.
    """
    n, (a, b, d) = base.p.shape[1], shares
    at, beside = c[base.t[:, parent]], 2 * c[n + base.t2f[:, parent]]
    out = at[0] * a**2 + at[1] * b**2 + at[2] * d**2
    return out + beside[0] * a * b + beside[1] * b * d + beside[2] * a * d


def _most(
    solution: CellPressures, laws: EdgeLaws, pressure: ndarray, loads: tuple[ndarray, ...]
) -> ndarray:
    """The largest pressures at the nodes of the refinement, by those of the cells around.

    Where contact ends on cells of which it leaves a sliver, their loads tell of no pressure.
    """
    base, refined = laws.refined.base, laws.refined
    factor = pressure * solution.punch.footprint.partition.areas / loads[-1]
    around = _around(solution, base).astype(bool)
    largest = around.multiply(factor).max(axis=1).toarray().ravel()
    return MOST * laws.edge_at_nodes * largest[base.t[:, refined.parent]].max(axis=0)


def _fitted(
    solution: CellPressures, laws: EdgeLaws, pressure: ndarray, loads: tuple[ndarray, ...]
) -> ndarray:
    """The factor s and its slopes at the nodes of the base, shape (3, n).

    Polynomials of the second degree are fitted to the cells around, in the least squares; those
    beyond a hole or a gap do not count.
    """
    cells, base = solution.punch.footprint, laws.refined.base
    areas, n = cells.partition.areas, base.p.shape[1]
    total, acting, spread, whole = loads
    s = pressure * areas / np.where(total > 0, total, 1.0)
    trust = np.where(pressure != 0, total / whole, 0.0) ** 2  # by what the end of contact leaves
    around = _around(solution, base)
    node, cell = around.nonzero()
    arm = acting[:, cell] - base.p[:, node]
    measure = _measures(cells.partition, around)
    at = measure[..., node]
    x, y = np.einsum("ijk,jk->ik", at, arm)
    square, nearest = x**2 + y**2, np.full(n, np.inf)
    pressed = trust[cell] > 0
    np.minimum.at(nearest, node[pressed], square[pressed])
    # over that of the nearest: between long and thin cells all are far in the root of their area
    weight = np.exp((nearest[node] - square).clip(max=0.0) / WIDTH) * trust[cell]
    # means over the cells
    beside = np.einsum("ijk,jlk,lmk->imk", at, spread[[[0, 1], [1, 2]]][..., cell], at)
    xx, xy, yy = np.array([x * x, x * y, y * y]) + beside[[0, 0, 1], [0, 1, 1]]
    terms = [np.ones(len(node)), x, y, xx, xy, yy]

    def sums(values: ndarray) -> ndarray:
        return np.bincount(node, weight * values, n)

    matrix = np.array([[sums(a * b) for a in terms] for b in terms]).transpose(2, 0, 1)
    # where few cells are left the polynomial is of a lower degree; terms of the second degree
    # weigh the same in all directions
    heavy = RIDGE * np.diag([0.0, 1.0, 1.0, 10.0, 5.0, 10.0])
    matrix += matrix[:, :1, :1] * heavy
    matrix[matrix[:, 0, 0] < 1e-12] = np.eye(6)
    right = np.array([sums(a * s[cell]) for a in terms]).T
    found = np.linalg.solve(matrix, right[..., None])[:, :3, 0].T
    found[1:] = np.einsum("ijn,jn->in", measure, found[1:])
    return found


def _measures(partition: Partition, around: csr_matrix) -> ndarray:
    """Symmetric matrices, (2, 2, nodes), by which arms from nodes become numbers: the cells around
    are in the mean as long as wide, and of area one."""
    some = around.getnnz(axis=1) > 0  # quadrilaterals without area leave nodes without cells
    cells, areas = around[some].astype(bool).astype(float), partition.areas
    xx, xy, yy = (cells @ (partition.polygons.second_moments / areas**2).T).T
    det = np.sqrt(xx * yy - xy * xy)
    size = (cells @ np.sqrt(areas)) / cells.getnnz(axis=1)
    # the inverse root of a matrix of two rows, by Cayley and Hamilton
    root = np.array([[yy + det, -xy], [-xy, xx + det]])
    out = np.zeros((2, 2, len(some)))
    out[..., some] = root / (size * np.sqrt(det * (xx + yy + 2 * det)))
    return out


def _around(solution: CellPressures, base: MeshTri) -> csr_matrix:
    """Cells around each node of the base, up to the second ring; shape (nodes, cells)."""
    n, t = base.p.shape[1], base.t
    rows, columns = np.repeat(t, 3, axis=0).ravel(), np.tile(t, (3, 1)).ravel()
    beside = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    basis = solution.footprint.basis
    mesh = nodal_mesh(basis)
    if isinstance(basis, CellwiseBasis) and basis.grid == "dual":
        return beside @ beside
    m = mesh.nelements
    places = mesh.t.ravel(), np.tile(np.arange(m), len(mesh.t))
    vertices = csr_matrix((np.ones(mesh.t.size), places), shape=(n, m))
    return beside @ vertices
