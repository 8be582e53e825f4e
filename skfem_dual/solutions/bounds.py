"""Between which values the exact position of a punch is expected."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy import ndarray
from skfem import MeshQuad1

from ..arguments import Pair
from ..contact.by_work import Member
from ..contact.load import Load, Share
from ..elements.resolution import margin
from ..errors import ConvergenceError, warnings_kept
from ..grids.cellwise import CellwiseBasis
from ..grids.dual_mesh import DualMesh
from ..grids.evening import evening
from ..grids.polygons import readonly
from ..ground.periodic import PeriodicGround
from ..kernels.once import ReadOnly, computed_in
from ..messages import shown, without_remedy
from ..operators.symmetry import Symmetry

#: half of a width over the largest distance of two positions of the punch, of settlement and tilt:
#: of flat punches with edge-weighted cells from those by work on triangles, and from those by
#: collocation; of shaped ones from those with a line of contact, and from those without
TRIANGLES, COLLOCATED, LINE, NO_LINE = (2.8, 3.0), (0.3, 0.5), (2.0, 2.0), 0.4
#: the same with constant pressures: in full contact, lifted off and of shaped punches
FULL, LIFTED, SHAPED = 0.9, 1.7, 3.0
#: least half of a width, over the size of the quantity: quadrature of the entries; by cells in
#: contact, with edge-weighted ones in full contact and lifted off, on plans without corners and
#: with, with these of shaped punches, with others, and where contact ends with the cells
FLOOR, ROUND, CORNERED = 1e-5, ((0.01, 0.02), (0.01, 0.08)), ((0.016, 0.02), (0.016, 0.08))
PRESSED_OVER, BY_CELLS, ENDS_WITH_CELLS = (0.2, 0.02), (0.02, 0.01), (0.3, 0.5)

#: how many times half widths are as large on crusts that bend away, where both grids err alike
CRUST = 3.0

Side = Literal["found", "proven"]


@dataclass(frozen=True, eq=False, repr=False)
class Bounds(ReadOnly):
    """Between which values the exact position of a punch is expected.

    Attributes
    ----------
    at : pair of float
        Point from the origin to which the settlement refers: that where the force acts, the
        origin where a position is imposed.
    settlement : (2,) array of float
        Least and largest settlement of that point.
    tilt : (2, 2) array of float
        Least and largest inclination Lx, and Ly.
    settlement_by : pair of str
        How the least and the largest value are known: ``"proven"``, as what is imposed, or
        ``"found"`` to hold in nearly all cases in which the exact value is known.
    tilt_by : pair of pairs of str
        The same for Lx and Ly.

    Notes
    -----
    The same problem is solved on the other grid of the mesh. The middle is the position on dual
    cells, the width follows from the farthest of those on triangles by the work of the pressures,
    and less from those by collocation. With constant pressures the
    middle is the solution's position, the others are those of dual cells collocated in their
    nodes, which settle too little, of their centroids, and of triangles, which settle too much;
    of shaped punches those with a line of contact count more, and without one errors are known
    to no less than the part of a cell. On thin bonded layers, where solutions on both grids err
    alike, they are wider by what the growth of the compliance with the wave number tells of the
    error. Differences of tilt are measured by the length of the vector.
    `benchmarks/bounds.py` counts how often the bounds of flat punches hold.
    """

    at: Pair
    settlement: ndarray
    tilt: ndarray
    settlement_by: tuple[Side, Side]
    tilt_by: tuple[tuple[Side, Side], tuple[Side, Side]]

    @classmethod
    def from_solution(cls, solution: Any) -> "Bounds":
        """Of a `PunchSolution`; solves the same problem on the other grid.

        Raises
        ------
        TypeError
            If it is something else.
        ValueError
            As `PunchSolution.bounds`.
        MeshError
            If the triangles have no valid dual grid.
        ConvergenceError
            If there is no solution on the other grid.
        """
        load = getattr(solution, "load", None)
        if not isinstance(load, Load):
            raise TypeError(f"expected a PunchSolution for bounds, got {shown(solution)}")
        if reason := why_none(solution):
            raise ValueError(reason)
        at = load.point or (0.0, 0.0) if load.force is not None else (0.0, 0.0)
        to_point = np.vstack([[1.0, *at], [0, 1, 0], [0, 0, 1]])
        with warnings_kept():  # those of the solution were told
            on_others = list(_on_other_grids(solution))
        found = [solution, *on_others]
        if _weighted(solution) and not _on_dual(solution):
            found.reverse()  # of both grids the dual cells are the middle, whichever was asked
        positions = [s.positions @ to_point.T for s in found]
        best, half = positions[0][0], _half(found, positions)
        imposed = np.array([load.settlement is not None, *[load.tilt is not None] * 2])
        half[imposed] = 0.0
        by: list[tuple[Side, Side]] = [
            ("proven", "proven") if i else ("found", "found") for i in imposed
        ]
        low, high = readonly(best - half), readonly(best + half)
        return cls(
            (float(at[0]), float(at[1])),
            readonly(np.array([low[0], high[0]])),
            readonly(np.stack([low[1:], high[1:]], axis=1)),
            by[0],
            (by[1], by[2]),
        )

    def lines(self) -> dict[str, str]:
        """Rows of tables by their names."""
        x, y = self.at
        name = f"W at ({x:.4g}, {y:.4g})" if (x, y) != (0.0, 0.0) else "W0"
        rows = {name: (self.settlement, self.settlement_by)}
        rows |= {f"L{axis}": (self.tilt[i], self.tilt_by[i]) for i, axis in enumerate("xy")}
        return {
            name: f"{low:.6g} to {high:.6g}, {by[0] if by[0] == by[1] else ' and '.join(by)}"
            for name, ((low, high), by) in rows.items()
        }

    def __repr__(self) -> str:
        lines = [f"  {name}: {line}" for name, line in self.lines().items()]
        return "\n".join(["<skfem_dual Bounds object>", *lines])


def _on_dual(solution: Any) -> bool:
    return bool(solution.footprint.on_dual_cells)


def _weighted(solution: Any) -> bool:
    """Whether it is flat with pressures that grow to the edge inside the cells."""
    return solution.punch.edge == "singular" and solution.punch.gap is None


def _half(found: list[Any], positions: list[ndarray]) -> ndarray:
    """Half of the widths of settlement, Lx and Ly about the position of the first solution."""
    solution, best = found[0], positions[0][0]
    shaped = solution.punch.gap is not None
    full = len(solution.contact) == len(solution.pressure)
    factors, weighted = TRIANGLES, _weighted(solution)
    worse: Pair | float = COLLOCATED
    closer = [not _on_dual(s) for s in found]
    if solution.line is not None:
        factors, worse, closer = LINE, NO_LINE, [s.line is not None for s in found]
    elif not weighted:
        worse = SHAPED if shaped else FULL if full else LIFTED
        closer = [False] * len(found)
    ends = shaped and not full and not any(closer[1:])
    least = ENDS_WITH_CELLS if ends else BY_CELLS
    if shaped and full and solution.punch.edge == "singular":
        least = PRESSED_OVER
    if weighted:
        corners = solution.footprint.weights.corners
        cornered = corners is not None and len(corners.node) > 0
        least = (CORNERED if cornered else ROUND)[0 if full else 1]
    half = np.zeros(3)
    for some, close in zip(positions, closer, strict=True):
        by = np.full((len(some), 2), worse)
        if close:
            by[: -1 if weighted else None] = factors
        off = np.abs(some - best)
        farthest = by * np.column_stack([off[:, 0], np.hypot(*off[:, 1:].T)])
        half = np.maximum(half, farthest.max(axis=0)[[0, 1, 1]])
    cells = solution.footprint
    if cells.bends_away:
        half *= CRUST
    length = np.sqrt(cells.partition.areas.sum())
    unit = np.array([length, 1.0, 1.0])
    size = unit * max(abs(best[0]) / length, np.hypot(*best[1:]))
    moved = np.array([abs(best[0]), *[np.hypot(*best[1:])] * 2])
    if shaped:  # whose position refers to an offset and a tilt of the shape that may be any
        x = solution.punch.collocation_points
        settled = solution.punch_displacement(x, collocated=True) - solution.punch.initial_gap
        size = moved = unit * np.abs(settled + solution.gap).max() / length
    count = _as_if_round(solution) if shaped else len(solution.contact)
    floor = np.array(least)[[0, 1, 1]] / max(count, 1)
    half = np.maximum(half, np.maximum(floor, max(FLOOR, cells.rtol or 0.0)) * size)
    # on thin layers that hardly change their volume both grids err alike
    return half + margin(cells.substrate, cells.partition) * moved


def _as_if_round(solution: Any) -> float:
    """Cells of a contact as long as wide, with as many across it as this one has."""
    cells, contact = solution.footprint.partition, solution.contact
    x = evening(cells.polygons) @ cells.centroids[:, contact]
    if x.shape[1] < 3:
        return x.shape[1]
    short, long = np.linalg.eigvalsh(np.cov(x))
    return float(x.shape[1] * np.sqrt(max(short, 0.0) / long))


def why_none(solution: Any) -> str:
    """Why there are no bounds, in words; empty if there are."""
    if not solution.success:
        return "expected a solution whose equations hold, for bounds; see its message"
    if isinstance(solution.footprint.substrate, PeriodicGround):
        return "expected ground without a period, for bounds: it takes one regular grid"
    group = _group(solution)
    alone = group is not None and not group.joined and group.stiffness is None
    if isinstance(solution.load, Share) or (solution.others and not alone):
        return (
            "expected neighbours that are rigid, flat and move alone, for bounds, got shaped or "
            "joined ones, a frame or a structure that bends. Remedy: solve the group on "
            "dual.basis() and on dual.primal_basis(), and compare"
        )
    for punch in group.punches if solution.others else [solution.punch]:
        if isinstance(punch.gap, (np.ndarray, list)):
            return (
                "expected the shape as a function or field, for bounds, got gaps of one grid's "
                "cells. Remedy: a function of the coordinates"
            )
        if not isinstance(punch.basis, CellwiseBasis) and isinstance(punch.basis.mesh, MeshQuad1):
            return (
                "expected cells of a mesh of triangles, for bounds, got quadrilaterals, which "
                "have no other grid. Remedy: DualMesh.from_mesh(mesh.to_meshtri()).basis()"
            )
    return ""


def _group(solution: Any) -> Any:
    """The rigid punches of which it is one; None if there are none."""
    return solution.member.answer.group if isinstance(solution.member, Member) else None


def _on_other_grids(solution: Any) -> Iterator[Any]:
    """Solutions of the same problem on the other grids of the mesh, of all meshes in a group."""
    punch = solution.punch
    on_dual = solution.footprint.on_dual_cells
    wanted = [("primal" if on_dual else "dual", "centroid")]
    if punch.edge == "constant":  # the first settles too little, the last too much
        wanted = [("dual", "node"), ("dual", "centroid"), ("primal", "centroid")]
    for grid, collocation in wanted:
        if (grid, collocation) == ("dual" if on_dual else "primal", punch.collocation):
            continue
        try:
            found = _on_other_grid(solution, grid, collocation)
        except ConvergenceError as error:  # its grid stands, for which the remedy is
            reason = without_remedy(error)
            raise ConvergenceError(
                f"no bounds: on the other grid {reason}. Remedy: a finer mesh"
            ) from error
        if not found.success:
            raise ConvergenceError(f"no bounds: on the other grid {found.message}")
        yield found


def _on_other_grid(solution: Any, grid: str, collocation: str) -> Any:
    """The solution of the same problem on another grid."""
    if solution.others:
        member = solution.member
        (number,) = member.answer.group.bodies[member.body]  # joined ones have no bounds
        return _of_group(member.answer, grid, collocation)[number]
    unilateral = bool((solution.pressure >= 0).all())
    body = _on(solution.punch, grid, collocation)
    return body.solve(**asdict(solution.load.upright), unilateral=unilateral)


def _of_group(answer: Any, grid: str, collocation: str) -> Any:
    """The solutions of all punches of a group, computed once."""

    def solved() -> Any:
        punches = [_on(punch, grid, collocation) for punch in answer.group.punches]
        pressure = answer.contact.pressure
        unilateral = bool((pressure >= 0).all() and pressure.any())  # no forces, no contact
        loads = [load.upright for load in answer.loads]
        return replace(answer.group, punches=punches).solve(loads, unilateral=unilateral)

    return computed_in(answer.elsewhere, (grid, collocation), solved)


def _on(punch: Any, grid: str, collocation: str) -> Any:
    """A punch on one of the grids of its mesh."""
    basis = punch.basis
    dual = basis.dual if isinstance(basis, CellwiseBasis) else DualMesh.from_mesh(basis.mesh)
    other = dual.basis() if grid == "dual" else dual.primal_basis()
    symmetry = "auto" if isinstance(punch.symmetry, Symmetry) else punch.symmetry
    edge = str(punch.edge) if punch.gap is None else punch.edge  # whatever the size of its cells
    return replace(punch, basis=other, edge=edge, collocation=collocation, symmetry=symmetry)
