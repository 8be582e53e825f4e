"""Galerkin boundary elements of NGSolve, hp on the square; run by peers.py where it is there."""

from itertools import pairwise

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
from ngsolve.bem import LaplaceSL
from peer_common import PROBLEMS, contact, serve

#: cells become so many times as narrow from each to the next towards the edge
RATIO = 0.15


def square(layers: int) -> ng.Mesh:
    """Quadrilaterals on the square, graded geometrically to all its sides."""
    half = np.append(1 - RATIO ** np.arange(layers), 1.0)
    x = np.concatenate([-half[:0:-1], half])
    mesh = netgen.Mesh(dim=3)
    mesh.Add(netgen.FaceDescriptor(surfnr=1, domin=0, domout=0, bc=1))
    at = [[mesh.Add(netgen.MeshPoint(netgen.Pnt(a, b, 0))) for b in x] for a in x]
    for low, high in pairwise(at):
        for a, b, c, d in zip(low, high, high[1:], low[1:]):
            mesh.Add(netgen.Element2D(1, [a, b, c, d]))
    return ng.Mesh(mesh)


def solve(plan: str, n: int, threads: int, more: int) -> tuple[int, float, float]:
    """Settlement of a flat square that stays in contact.

    The ``n`` layers of cells at each side have polynomials of a degree of one less; quadrature
    is of ``more`` orders than by default.
    """
    if plan != "square":
        raise ValueError(f"expected the square, got {plan}")
    ng.SetNumThreads(threads)
    functions = ng.SurfaceL2(square(n), order=n - 1)
    u, v = functions.TnT()
    with ng.TaskManager():
        # 1 / (4 pi r)
        layer = LaplaceSL(u * ng.ds(bonus_intorder=more)) * v * ng.ds(bonus_intorder=more)
        force = ng.LinearForm(v * ng.ds).Assemble()
        mass = ng.BilinearForm(u * v * ng.ds).Assemble()
        near = mass.mat.Inverse(inverse="sparsecholesky")
        density = ng.GridFunction(functions)
        inverse = ng.CGSolver(layer.mat, near, tol=1e-7, maxiter=500)
        density.vec.data = inverse * force.vec
        total = ng.InnerProduct(force.vec, density.vec)
    # the ground settles by the integral of p / (pi r), four times the single layer
    return functions.ndof, 0.0, PROBLEMS[plan][0] * 4 / total


if __name__ == "__main__":
    serve(contact=contact(solve))
