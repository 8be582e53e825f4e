"""Whether two solutions are those of one problem on the two grids of one `DualMesh`."""

import numpy as np
from numpy import ndarray

from ..contact.footprint import Footprint
from ..contact.shapes import gap_values
from ..grids.cellwise import CellwiseBasis
from ..ground.periodic import PeriodicGround
from ..ground.substrates import Substrate
from ..messages import place, shown
from ..solutions.punch_solution import PunchSolution

#: loads and gaps that differ by so much of their size are the same
SAME = 1e-9
#: forces of neighbours on two grids whose settlements are imposed differ by less than this
ABOUT = 0.1
#: wave numbers times the size of the plan at which grounds are compared
WAVES = np.array([0.3, 1.0, 3.0, 10.0, 30.0])
#: what to do where two problems are given
ALIKE = "Remedy: solve one problem on both grids"


def check_couple(on_cells: PunchSolution, on_triangles: PunchSolution) -> None:
    """Refuse what is not a couple of solutions on the two grids of one `DualMesh`.

    Raises
    ------
    TypeError
        If one is no solution, or not on its grid.
    ValueError
        If the meshes, origins, grounds, edges, gaps or loads are two, or ground pulls on one of
        the punches only.
    """
    for solution, grid in ((on_cells, "dual"), (on_triangles, "primal")):
        if not isinstance(solution, PunchSolution):
            raise TypeError(f"expected a PunchSolution, got {shown(solution)}")
        basis = solution.punch.basis
        if not (isinstance(basis, CellwiseBasis) and basis.grid == grid):
            raise TypeError(
                "expected solutions on dual.basis() and dual.primal_basis() of one DualMesh, in "
                f"this order; got one on {solution.punch.grid_description} for the {grid} grid"
            )
    first, second = (s.punch.basis.dual.mesh for s in (on_cells, on_triangles))
    if not (np.array_equal(first.p, second.p) and np.array_equal(first.t, second.t)):
        raise ValueError("expected solutions on the two grids of one DualMesh, got two meshes")
    if on_cells.punch.origin != on_triangles.punch.origin:
        raise ValueError(
            f"expected solutions with one origin, got {on_cells.punch.origin} and "
            f"{on_triangles.punch.origin}"
        )
    grounds = [s.punch.substrate for s in (on_cells, on_triangles)]
    if not _are_one(grounds[0], grounds[1], float(np.ptp(first.p, axis=1).max())):
        raise ValueError(
            f"expected solutions on one ground, got {grounds[0]} and {grounds[1]}. {ALIKE}"
        )
    _check_edges(on_cells, on_triangles)
    _check_gaps(on_cells, on_triangles)
    _check_pulls(on_cells, on_triangles)
    _check_loads(on_cells, on_triangles)
    _check_neighbours(on_cells, on_triangles)


def _are_one(one: Substrate, other: Substrate, size: float) -> bool:
    """Whether grounds are equal or, by functions made twice, yield alike to waves of such a
    length."""
    if one == other:
        return True
    if type(one) is not type(other) or isinstance(one, PeriodicGround):
        return False
    first, second = (ground.symbol(WAVES / size) for ground in (one, other))
    alike = np.allclose(first, second, rtol=SAME, atol=0.0)
    return one.surface == other.surface and bool(alike)


def _check_edges(one: PunchSolution, other: PunchSolution) -> None:
    """Edge-weighted cells must have one edge; constant ones know of none."""
    both = one.punch.weights, other.punch.weights
    if both[0] is None or both[1] is None:
        return
    edges = both[0].facets, both[1].facets
    if not np.array_equal(*edges):
        raise ValueError(
            f"expected solutions with one singular edge, got {len(edges[0])} facets of it on dual "
            f"cells and {len(edges[1])} on triangles. Remedy: the same edge_boundaries for both"
        )


def _check_pulls(one: PunchSolution, other: PunchSolution) -> None:
    """Ground must pull on both punches or on neither, which shows where cells have lifted off."""
    for pulled, lifted in ((one, other), (other, one)):
        if (pulled.pressure < 0).any() and (lifted.pressure == 0).any():
            raise ValueError(
                "expected solutions with or without lift-off, got one with negative pressures and "
                "one with cells out of contact. Remedy: the same unilateral= for both"
            )


def _check_gaps(one: PunchSolution, other: PunchSolution) -> None:
    """Gaps must be one; arrays, with values in other points on each grid, are not compared."""
    gaps = one.punch.gap, other.punch.gap
    if (gaps[0] is None) != (gaps[1] is None):
        raise ValueError("expected solutions under one punch, got a flat and a shaped one")
    if gaps[0] is gaps[1] or not all(callable(gap) or isinstance(gap, tuple) for gap in gaps):
        return
    # where one was solved: profiles need not reach farther
    x, a = one.punch.collocation_points, one.punch.initial_gap
    b = gap_values(gaps[1], x)
    off = np.abs(a - b)
    if not off.max() <= SAME * np.abs([a, b]).max():
        i = int(np.argmax(off))
        raise ValueError(
            f"expected solutions under one punch, got gaps of {a[i]:.6g} and {b[i]:.6g} at "
            f"{place(x[:, i])}. {ALIKE}"
        )


def _check_loads(one: PunchSolution, other: PunchSolution) -> None:
    """What is imposed must be the same, however it is said."""
    imposed = [_imposed(solution) for solution in (one, other)]
    if imposed[0].keys() != imposed[1].keys():
        raise ValueError(
            f"expected solutions under the same load, got {' with '.join(imposed[0])} and "
            f"{' with '.join(imposed[1])} imposed. {ALIKE}"
        )
    size = float(np.ptp(one.punch.basis.dual.mesh.p, axis=1).max())
    for name, value in imposed[0].items():
        second = imposed[1][name]
        scale = np.maximum(np.abs([value, second]).max(axis=0), _rounded(name, one, value, size))
        if (np.abs(value - second) > SAME * scale).any():
            raise ValueError(
                f"expected solutions under the same load, got {name} {value.tolist()} and "
                f"{second.tolist()}. Remedy: solve both under one of them"
            )


def _check_neighbours(one: PunchSolution, other: PunchSolution) -> None:
    """The bodies beside must be as many, on the same plans, and pressed about as much: where their
    settlement is imposed, forces are as far apart as their two grids are."""
    beside = one.others, other.others
    if len(beside[0]) != len(beside[1]):
        raise ValueError(
            f"expected solutions beside the same bodies, got {len(beside[0])} and "
            f"{len(beside[1])} beside them. Remedy: solve the whole group on both grids"
        )
    for k, (first, second) in enumerate(zip(*beside, strict=True)):
        plans = first.body.footprint, second.body.footprint
        areas = [plan.partition.areas.sum() for plan in plans]
        size = np.sqrt(max(areas))
        apart = np.abs(plans[0].centre - plans[1].centre).max()
        if abs(areas[0] - areas[1]) > SAME * size**2 or apart > SAME * _far(plans[0], size):
            raise ValueError(
                f"expected solutions beside the same bodies, got body {k} beside them on a plan "
                f"of area {areas[0]:.6g} at {place(plans[0].centre)} and on one of "
                f"{areas[1]:.6g} at {place(plans[1].centre)}. Remedy: solve the whole group on "
                "both grids"
            )
        forces = [float(each.pressure @ each.cells.partition.areas) for each in (first, second)]
        total = max(float(np.abs(b.pressure) @ b.cells.partition.areas) for b in (first, second))
        if abs(forces[0] - forces[1]) > ABOUT * total:
            raise ValueError(
                f"expected solutions beside the same loads, got forces of {forces[0]:.6g} and "
                f"{forces[1]:.6g} of body {k} beside them. Remedy: solve the whole group under "
                "the same loads on both grids"
            )


def _far(plan: Footprint, size: float) -> float:
    """What rounding of coordinates refers to."""
    return max(size, float(np.abs(plan.centre).max()))


def _rounded(name: str, solution: PunchSolution, value: ndarray, size: float) -> ndarray | float:
    """What differences of a value imposed refer to at least, on a plan of such a size."""
    if name == "forces and first moments":
        return abs(value[0]) * np.array([1.0, size, size])
    if name == "the point of the reaction":
        return size
    if name == "the tilt":
        return max(float(np.abs(value).max()), abs(solution.collocated_settlement) / size)
    return 0.0


def _imposed(solution: PunchSolution) -> dict[str, ndarray]:
    """Names and values of what a load imposes."""
    load = solution.load
    found = {}
    if load.settlement is not None:
        found["the settlement"] = np.array([load.settlement])
    if load.tilt is not None:
        found["the tilt"] = np.array(load.tilt)
    if load.force is not None:
        moments = load.moments_of(load.force)
        if load.tilt is not None:
            found["the force"] = np.array([load.force])
        else:
            found["forces and first moments"] = np.array([load.force, *moments])
    elif load.tilt is None:
        found["the point of the reaction"] = np.array(load.at or (0.0, 0.0))
    return found
