"""Our own part of peers.py, in a process of its own like the others."""

from time import perf_counter

import numpy as np
from eight_plans import make
from peer_common import PROBLEMS, best, contact, serve
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, Paraboloid, RigidPunch
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
    serve(contact=contact(solve), mesh=mesh, assembly=assembly)
