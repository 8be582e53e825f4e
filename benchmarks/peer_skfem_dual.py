"""Our own part of peers.py, in a process of its own like the others."""

from time import perf_counter

import numpy as np
from eight_plans import make
from peer_common import PROBLEMS, best, contact, rough, roughness, serve
from skfem import CellBasis, ElementQuad0, MeshQuad, MeshTri

from skfem_dual import DualMesh, HalfSpace, Paraboloid, PeriodicGround, RigidPunch
from skfem_dual.grids.generate import disc, rectangle
from skfem_dual.operators.dense import moment_matrix
from skfem_dual.operators.influence_operator import InfluenceOperator

SOIL = HalfSpace(1.0, 0.0)


def plan_mesh(plan: str, n: int, kind: str, margin: float = 1.0) -> MeshTri:
    """About n nodes: regular ones drawn to the edge by a law, or "generated", maybe with a law.

    For the sphere a disc of ``margin`` times the radius of contact.
    """
    generated, _, law = kind.partition(" ")
    if generated != "generated":
        return make("square" if plan == "square" else "disc", kind, n).scaled(margin)
    if plan == "square":
        return rectangle(n=n, graded=law or None)
    return disc(n=n, radius=margin, graded=law or None)


def solve(
    plan: str, n: int, kind: str, grid: str, margin: float = 1.0
) -> tuple[int, float, float]:
    """Settlement of a punch with everything as it is by default."""
    start = perf_counter()
    mesh = plan_mesh(plan, n, kind, margin)
    meshed = perf_counter() - start
    dual = DualMesh.from_mesh(mesh)
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    punch = RigidPunch(SOIL, basis, gap=Paraboloid(1.0) if plan == "Hertz" else None)
    solution = punch.solve(PROBLEMS[plan][0])
    if not solution.success:
        raise RuntimeError(solution.message)
    return len(solution.pressure), meshed, solution.settlement


def regular(n: int, low: float, high: float) -> CellBasis:
    """n x n equal squares."""
    side = np.linspace(low, high, n + 1)
    return CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())


def press(n: int, force: float, tolerance: float, periodic: bool) -> np.ndarray:
    """Pressures under a rough surface on the unit square, which does not tilt."""
    ground = PeriodicGround(SOIL, (1.0, 1.0)) if periodic else SOIL
    surface = rough(n)
    punch = RigidPunch(ground, regular(n, 0, 1), gap=(surface.max() - surface).ravel())
    solution = punch.solve(force, tilt=(0, 0), gap_rtol=tolerance)
    if not solution.success:
        raise RuntimeError(solution.message)
    return solution.pressure.reshape(n, n)


def sphere(n: int, tolerance: float, margin: float, repeat: float, plan: str = "Hertz") -> dict:
    """Approach of a sphere on a regular grid; seconds from nothing, and of the solution alone."""

    def punched() -> RigidPunch:
        return RigidPunch(SOIL, regular(n, -margin, margin), gap=Paraboloid(1.0))

    force, exact = PROBLEMS[plan]
    solution, seconds, parallel = best(
        lambda: punched().solve(force, gap_rtol=tolerance), repeat, 20
    )
    punch = solution.punch
    _, alone, _ = best(lambda: punch.solve(force, gap_rtol=tolerance), repeat, 20)
    return {
        "cells": n * n,
        "error": solution.settlement / exact - 1,
        "mesh": 0.0,
        "seconds": seconds,
        "parallel": parallel,
        "alone": alone,
    }


def mesh(plan: str, n: int, kind: str, path: str, repeat: float) -> dict:
    """Write a mesh for the others."""
    made, seconds, _ = best(lambda: plan_mesh(plan, n, kind), repeat)
    np.savez(path, p=made.p, t=made.t)
    return {"seconds": seconds}


def assembly(mesh: str, repeat: float) -> dict:
    """Seconds from the basis on triangles to the matrix, exact and as operators have it.

    The latter takes the weights of the cells and a check of its error beside the entries, whose
    time is given too.
    """
    with np.load(mesh) as stored:
        triangles = MeshTri(stored["p"], stored["t"])
    basis = DualMesh.from_mesh(triangles).primal_basis()
    _, exact, parallel = best(lambda: RigidPunch(SOIL, basis).matrix.shape, repeat)
    operator, dense, _ = best(lambda: InfluenceOperator(SOIL, basis, method="dense"), repeat)
    cells = SOIL, operator.partition, operator.x, operator.weights
    _, entries, _ = best(lambda: moment_matrix(*cells, operator.rtol).shape, repeat)
    return {
        "cells": operator.shape[0],
        "seconds": {"exact": exact, "operator": dense, "entries": entries},
        "error": operator.row_error,
        "parallel": parallel,
    }


if __name__ == "__main__":
    serve(
        contact=contact(solve),
        mesh=mesh,
        assembly=assembly,
        rough=roughness(press),
        sphere=sphere,
    )
