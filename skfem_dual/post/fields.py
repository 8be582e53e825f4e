"""The pressure as a field to draw: the factor that varies slowly, times the laws of the edges.

Within the plan ``p = s w``. Under a rigid edge ``w`` is the inverse square root of the torsion
function, which is like the distance there and smooth inside; where contact ends smoothly it is
the square root of the distance to that line. A cell of mean pressure q has ``s = q / mean(w)``
where its load acts, and between the cells s is a polynomial fitted to those around.
"""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from skfem import CellBasis, ElementQuad0, ElementTriP1, MeshTri

from ..arguments import checked_integer
from ..contact.edges import presses_over
from ..contact.period import PeriodTriangles
from ..elements.balance import balanced, field_resultant
from ..errors import ConvergenceError
from ..grids.cellwise import CellwiseBasis, nodal_mesh
from ..grids.fan import Fan
from ..grids.outline import edge_facets
from ..grids.partition import Partition
from ..ground.periodic import PeriodicGround
from ..messages import without_remedy
from ..operators.resources import refuse_beyond_memory
from ..solutions.pressures import CellPressures, checked_solution
from .edge_laws import EdgeLaws
from .postprocess import postprocess

#: square of the width of the fit, over the area of a cell
WIDTH = 1.5
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
    with constant pressures the whole edge of the plan, if their means grow to it by a law."""
    cells = solution.footprint
    if cells.weights is not None:
        return cells.weights.facets
    if cells.on_springs or not presses_over(cells.partition, solution.pressure):
        return np.zeros(0, dtype=int)
    return edge_facets(cells.partition)


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
