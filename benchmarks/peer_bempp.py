"""Dense single layers of bempp-cl; run by peers.py in an environment that has it."""

import bempp_cl.api as bempp
import numpy as np
from bempp_cl.api.operators.boundary import laplace, sparse
from bempp_cl.api.utils.parameters import DefaultParameters
from peer_common import PROBLEMS, best, contact, serve


def space(mesh: str, kind: str):
    """Piecewise constants "DP0", or continuous linear functions "P1" up to the edge."""
    with np.load(mesh) as stored:
        p, t = stored["p"], stored["t"].astype(np.uint32)
    grid = bempp.Grid(np.vstack([p, np.zeros((1, p.shape[1]))]), t)
    if kind == "DP0":
        return bempp.function_space(grid, "DP", 0)
    return bempp.function_space(grid, "P", 1, include_boundary_dofs=True)


def matrix(functions, order: int) -> np.ndarray:
    """Galerkin matrix of 1 / (4 pi r) by quadrature of an order, 4 by default."""
    parameters = DefaultParameters()
    parameters.quadrature.regular = parameters.quadrature.singular = order
    layer = laplace.single_layer(functions, functions, functions, parameters=parameters)
    return bempp.as_matrix(layer.weak_form())


def solve(plan: str, n: int, mesh: str, kind: str, order: int) -> tuple[int, float, float]:
    """Settlement of a flat punch that stays in contact, on a mesh from a file."""
    functions = space(mesh, kind)
    galerkin = matrix(functions, order)
    mass = sparse.identity(functions, functions, functions).weak_form()
    force = mass @ np.ones(functions.global_dof_count)
    density = np.linalg.solve(galerkin, force)  # its time is nothing beside assembly's
    # the ground settles by the integral of p / (pi r), four times the single layer
    return len(force), 0.0, PROBLEMS[plan][0] * 4 / float(force @ density)


def assembly(mesh: str, repeat: float) -> dict:
    """Seconds from the space of piecewise constants to the matrix."""
    functions = space(mesh, "DP0")
    cells, seconds, parallel = best(lambda: len(matrix(functions, 4)), repeat)
    return {"cells": cells, "seconds": {"Galerkin": seconds}, "parallel": parallel}


if __name__ == "__main__":
    serve(contact=contact(solve), assembly=assembly)
