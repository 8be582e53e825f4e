"""Two solutions on dual grids, one better field (Section 5)."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray
from skfem import CellBasis, ElementTriP1

from ..arguments import checked_choice, checked_flag
from ..contact.footprint import Footprint
from ..elements.balance import balanced, field_resultant
from ..grids.dual_mesh import DualMesh
from ..grids.mappings import own_mapping
from ..grids.outline import edge_facets
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly
from ..solutions.punch_solution import PunchSolution
from .checks import check_couple
from .conserve import Balance
from .functional import CoupleFunctional, Weights
from .laws import mixed
from .mixture import mixture, smoothing
from .regular import RegularCouple
from .weights import Choice
from .weights import chosen as chosen_weights


@dataclass(frozen=True, eq=False, repr=False)
class PostprocessedPressure(ReadOnly):
    """The field `postprocess` makes of two solutions; unpacks as ``basis, values``.

    Attributes
    ----------
    dual : DualMesh
        The couple of grids.
    basis : CellBasis
        First-order elements on the general triangulation: the nodes of the mesh, the barycentres
        of the triangles, the middles of boundary facets.
    values : (N,) array of float
        Its vector, compression positive; finite on a singular edge.
    on_cells : (n,) array of float
        Mean pressures on the dual cells, a vector of ``dual.basis()``. As of solutions with a
        singular edge their first moments are those with the law of the edge inside the cells;
        taken for constants there they carry the force alone, where `values` carry all.
    on_triangles : (m,) array of float
        The same on the triangles, a vector of ``dual.primal_basis()``.
    weights : Weights
        Of the functional, without smoothing on a singular edge with ``weights="auto"``.
    share : float
        With ``weights="auto"`` and a singular edge, that of the solution on dual cells; otherwise
        NaN, each kept its values.
    reason : str
        How the weights came about.
    """

    dual: DualMesh
    basis: CellBasis
    values: ndarray
    on_cells: ndarray
    on_triangles: ndarray
    weights: Weights
    share: float
    reason: str

    def __iter__(self) -> Iterator:
        return iter((self.basis, self.values))

    def nodal_pressure(self, *, conserve: bool = True) -> tuple[CellBasis, ndarray]:
        """First-order elements on the triangulation itself and the values at its nodes.

        Force and first moments are those of the field, by the least change of the values on the
        boundary, or of all if those cannot carry them; without ``conserve`` the values are its.

        Raises
        ------
        TypeError
            If ``conserve`` is neither True nor False.
        """
        mesh, n = self.dual.mesh, len(self.dual)
        nodal = CellBasis(mesh, ElementTriP1(), mapping=own_mapping(mesh))
        if not checked_flag("conserve", conserve):
            return nodal, self.values[:n]
        edge = np.isin(np.arange(n), mesh.boundary_nodes())
        middle = self.dual.centroids.mean(axis=1)
        resultant = field_resultant(self.basis, self.values, middle)
        return nodal, balanced(nodal, self.values[:n], resultant, middle, edge)

    def __repr__(self) -> str:
        w, how = self.weights, f"  {self.reason}, {self.share:.0%} from the dual cells"
        if np.isnan(self.share):
            how = (
                f"  Weights A {w.A1:.3g}, {w.A2:.3g}; B {w.B1:.3g}, {w.B2:.3g}; "
                f"C {w.C1:.3g}, {w.C2:.3g}; D {w.D1:.3g}, {w.D2:.3g}\n  {self.reason}"
            )
        return (
            "<skfem_dual PostprocessedPressure object>\n"
            f"  Nodes: {len(self.values)}, pressure {self.values.min():.6g} to "
            f"{self.values.max():.6g}\n{how}"
        )


def postprocess(
    on_cells: PunchSolution,
    on_triangles: PunchSolution,
    weights: Choice = "auto",
    *,
    edge: Literal["singular", "constant"] | None = None,
    conserve: bool = True,
) -> PostprocessedPressure:
    """One field of pressure from two solutions of one problem on dual grids.

    On a singular edge the default follows the law of the edge inside the cells, corners too.
    With other weights the regular parts of the pressures are smoothed, the factor of the inverse
    square root of a distance to the edge that knows of no corners, see `RegularCouple`.

    Parameters
    ----------
    on_cells, on_triangles : PunchSolution
        Solutions on ``dual.basis()`` and ``dual.primal_basis()`` of one `DualMesh`.
    weights : {"auto", "gcv"}, pair of float or Weights
        ``"auto"``: what the couple deserves by what is known of the errors of its solutions, from
        their mean up to the removal of opposite biases, see `mixture`. ``"gcv"``:
        generalised cross-validation, for random errors. A pair: the paper's W1 and W2 as
        `Weights.init_paper` reads them. `Weights`: all eight.
    edge : {"singular", "constant"}, optional
        Whether to divide the singularity out before the smoothing and to multiply it back, or to
        smooth the pressures themselves. By default ``"singular"``, the case of flat punches;
        ``"constant"`` if the punch has no sharp edge.
    conserve : bool
        Whether the field and the pressures on both grids carry force and moments of the
        solutions exactly, by the least change of their values; on a singular edge the field
        changes there only, and the pressures on both grids have their moments with the law of
        the edge inside the cells: taken for constants they carry the force.

    Returns
    -------
    PostprocessedPressure
        ``basis, values = postprocess(...)``, an ordinary basis of scikit-fem and its vector, and
        mean pressures of the cells of both grids. Where both solutions have lifted off, at
        a node and in all the cells around it, the pressure stays zero; it is nowhere negative
        if those of the solutions are not.

    Raises
    ------
    TypeError
        If a solution is not on the grids of a `DualMesh`, or weights are something else.
    ValueError
        If the solutions are not on the two grids of one `DualMesh`, or of two problems: with
        other origins, grounds, loads, gaps, or one on ground that pulls.
    ConvergenceError
        If the weights are so far apart that the minimum is not found, or hardly any pressures are
        left to conserve force and moments.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual, soil = DualMesh.from_mesh(MeshTri.init_circle(4)), HalfSpace(1.0, 0.0)
    >>> below = RigidPunch(soil, dual.basis(), edge="constant", collocation="node")
    >>> above = RigidPunch(soil, dual.primal_basis(), edge="constant")
    >>> basis, p = postprocess(below.solve(1.0), above.solve(1.0))
    >>> centre = p[np.argmin(np.hypot(*basis.doflocs))]
    >>> print(f"{centre:.4f}")  # exact for the circle: 0.1592
    0.1600
    """
    check_couple(on_cells, on_triangles)
    solutions = on_cells, on_triangles
    if edge is None:
        # a shaped punch has contact that ends inside its plan, without a singularity
        sharp = any(s.punch.sharp_edge for s in solutions)
        edge = "singular" if sharp else "constant"
    checked_choice("edge", edge, ("singular", "constant"))
    conserve = checked_flag("conserve", conserve)
    dual = on_cells.punch.basis.dual
    couple = RegularCouple(dual, _singular_facets(solutions) if edge == "singular" else _NONE)
    share, cells = np.nan, (on_cells.footprint, on_triangles.footprint)
    if isinstance(weights, str) and weights == "auto" and len(couple.singular):
        start = mixture(couple, solutions)
        chosen, share, reason, cells = Weights(1.0, 1.0), start.share, start.reason, start.cells
        grids = mixed(couple, start.laws, start.shares)
    else:
        chosen, reason, grids = _smoothed(couple, solutions, weights)
    grids = _kept(couple, solutions, grids)
    if conserve:
        loads = _loads(couple, cells[0]), _loads(couple, cells[1])
        resultants = np.array([s.footprint.resultants @ s.pressure for s in solutions])
        balance = Balance(couple, loads, resultants, cells[0].centre)
        first, second, field = (balance.completed(i, values) for i, values in enumerate(grids))
        grids = first, second, field
    return PostprocessedPressure(
        dual=dual,
        basis=couple.field_basis(),
        values=readonly(grids[2]),
        on_cells=readonly(grids[0]),
        on_triangles=readonly(grids[1]),
        weights=chosen,
        share=share,
        reason=reason,
    )


_NONE = np.empty(0, np.int32)
#: pressures of dual cells, of triangles, and of the field
Grids = tuple[ndarray, ndarray, ndarray]


def _smoothed(
    couple: RegularCouple, solutions: tuple[PunchSolution, PunchSolution], weights: Choice
) -> tuple[Weights, str, Grids]:
    """Weights, how they came about, and the pressures of both grids and the field with them."""
    n = len(couple.dual)
    values = couple.from_pressures(np.concatenate([s.pressure for s in solutions]))
    if isinstance(weights, str) and weights == "auto":
        chosen = smoothing(couple, values)
        alternate = "errors alternate from cell to cell"
        reason = alternate if chosen.D1 else "no errors alternate, both keep their pressures"
    else:
        chosen, reason = chosen_weights(weights, couple.neighbours, values[:n], values[n:])
    functional = CoupleFunctional(couple.neighbours, chosen)
    new = _signed(np.concatenate(functional.minimise(values[:n], values[n:])), solutions)
    new = np.where(_lifted(couple, solutions), 0.0, new)
    pressures = couple.to_pressures @ new
    return chosen, reason, (pressures[:n], pressures[n:], couple.to_field @ new)


def _kept(
    couple: RegularCouple, solutions: tuple[PunchSolution, PunchSolution], grids: Grids
) -> Grids:
    """Nothing where both have lifted off, nothing negative if nothing was."""
    lifted, n = _lifted(couple, solutions), len(couple.dual)
    # a middle of a facet on the boundary lies between two nodes
    mesh = couple.dual.mesh
    middles = lifted[mesh.facets[:, mesh.boundary_facets()]].all(axis=0)
    parts = lifted[:n], lifted[n:], np.append(lifted, middles)
    first, second, field = (
        np.where(zero, 0.0, _signed(values, solutions))
        for zero, values in zip(parts, grids, strict=True)
    )
    return first, second, field


def _signed(values: ndarray, solutions: tuple[PunchSolution, PunchSolution]) -> ndarray:
    return values.clip(min=0.0) if all((s.pressure >= 0).all() for s in solutions) else values


def _loads(couple: RegularCouple, cells: Footprint) -> ndarray:
    """Force and first moments about the centroid by unit pressures on the cells of one grid.

    Pressures with slopes inside the cells do not act where the law of the edge alone does.
    """
    if cells.slopes is None:
        n = len(couple.dual)
        part = slice(n) if cells.on_dual_cells else slice(n, None)
        return cells.planes(couple.acting[:, part]) * couple.areas[part]
    return cells.resultants


def _singular_facets(solutions: tuple[PunchSolution, PunchSolution]) -> ndarray:
    """Facets on the singular edge: those edge-weighted solutions know, or all."""
    for weights in (s.punch.weights for s in solutions):
        if weights is not None:
            return weights.facets
    return edge_facets(solutions[0].punch.partition)


def _lifted(couple: RegularCouple, solutions: tuple[PunchSolution, PunchSolution]) -> ndarray:
    """Nodes and triangles without pressure and with none around them."""
    zero, of_triangles = (s.pressure == 0 for s in solutions)
    t = couple.dual.mesh.t
    around = np.ones(len(zero), dtype=bool)
    around[t[:, ~of_triangles]] = False
    return np.concatenate([zero & around, of_triangles & zero[t].all(axis=0)])
