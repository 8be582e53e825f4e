"""Small structures on the ground: a plate that lifts off, a block of tetrahedra."""

import numpy as np
from skfem import (
    BilinearForm,
    CellBasis,
    ElementHex1,
    ElementTetP2,
    ElementTriMorley,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshTet,
)
from skfem.helpers import dd, ddot, eye, trace
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import DualMesh, HalfSpace
from skfem_dual.bodies.elastic import ElasticPunch
from skfem_dual.grids.generate import disc
from skfem_dual.grids.trace import trace as plan_of

SOIL = HalfSpace(young=1.0, poisson=0.0)


def plate(ratio=0.01, n=150, centre=(0.0, 0.0), factor=1.0):
    """A circular raft under a load of one on its middle."""
    dual = DualMesh.from_mesh(disc(n=n).translated(centre))
    basis = CellBasis(dual.refinement, ElementTriMorley())

    @BilinearForm
    def bending(u, v, _):
        return ratio / 12 / 0.96 * ddot(0.8 * dd(u) + 0.2 * eye(trace(dd(u)), 2), dd(v))

    @LinearForm
    def load(v, w):
        r = np.hypot(w.x[0] - centre[0], w.x[1] - centre[1])
        return (r < 0.3) * v

    f = load.assemble(basis)
    f *= factor / f[basis.nodal_dofs[0]].sum()
    return ElasticPunch(SOIL, dual.basis(), basis, bending.assemble(basis)).solve(f)


def block(young=1e6, tilt=0.0, kind=MeshTet, n=4, height=0.0):
    """A cube on the ground under a vertical load on its top, two DOFs of freedom in the plane
    and one of turning held in the middle of its base."""
    x = np.linspace(-1, 1, n + 1)
    mesh = kind.init_tensor(x, x, np.linspace(0, 2, n + 1)).translated((0.0, 0.0, height))
    mesh = mesh.with_boundaries(
        {"base": lambda x: x[2] < height + 1e-9, "top": lambda x: x[2] > height + 2 - 1e-9}
    )
    element = ElementVector(ElementTetP2() if kind is MeshTet else ElementHex1())
    basis = CellBasis(mesh, element)
    K = linear_elasticity(*lame_parameters(young, 0.3)).assemble(basis)
    load = LinearForm(lambda v, w: -v[2] * (1 + tilt * w.x[0]))
    f = load.assemble(FacetBasis(mesh, element, facets="top"))
    middle, side = (
        np.argmin(np.linalg.norm(mesh.p - [[a], [0.0], [height]], axis=0)) for a in (0.0, 1.0)
    )
    held = np.append(basis.nodal_dofs[:2, middle], basis.nodal_dofs[1, side])
    dual = DualMesh.from_mesh(plan_of(mesh, "base")) if kind is MeshTet else None
    if dual is not None:
        cells = dual.basis()
    else:
        from skfem import ElementQuad0

        cells = CellBasis(plan_of(mesh, "base"), ElementQuad0())
    return ElasticPunch(SOIL, cells, basis, K, boundary="base", D=held).solve(f)
