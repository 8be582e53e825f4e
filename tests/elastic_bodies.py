"""Structures on the ground, for the tests."""

import numpy as np
from plans import disc, rectangle
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementHex1,
    ElementQuad0,
    ElementTetP1,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP2,
    ElementVector,
    LinearForm,
    MeshHex,
    MeshTet,
)
from skfem.helpers import dd, ddot, eye, grad, sym_grad
from skfem.helpers import trace as tr
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import (
    DualMesh,
    ElasticPunch,
    HalfSpace,
    trace,
)
from skfem_dual.elements.point_values import value_matrix

SOIL = HalfSpace(1.0, 0.0)
POISSON = 0.2  # of the plates


@BilinearForm
def bending(u, v, _):
    """A plate of rigidity one."""
    return ddot((1 - POISSON) * dd(u) + POISSON * eye(tr(dd(u)), 2), dd(v))


@BilinearForm
def shearing(w, a, v, b, _):
    """A plate of rigidity one that also shears, with the rotations a."""
    strain = sym_grad(a)
    moment = (1 - POISSON) * strain + POISSON * eye(tr(strain), 2)
    return ddot(moment, sym_grad(b)) + 100 * sum((grad(w) - a) * (grad(v) - b))


@LinearForm
def load(v, w):
    return w.q * v


def rigidity(K):
    """Of Brown's relative stiffness, with a = E* = 1."""
    return K / 12 / (1 - POISSON**2)


def kirchhoff(mesh, element=None):
    """Of Argyris' element, if any, curvatures are of the third degree."""
    basis = CellBasis(mesh, element or ElementTriMorley(), intorder=6 if element else None)
    return basis, bending.assemble(basis)


def mindlin(mesh):
    basis = CellBasis(mesh, ElementTriP2() * ElementVector(ElementTriP2()))
    return basis, shearing.assemble(basis)


def raft(K, mesh=None, **options):
    """A circular plate on dual cells of the stiffness K of Brown."""
    dual = DualMesh.from_mesh(disc(3) if mesh is None else mesh)
    plate, stiffness = kirchhoff(dual.refinement)
    options = {"substrate": SOIL} | options
    return ElasticPunch(
        basis=dual.basis(), structure=plate, stiffness=rigidity(K) * stiffness, **options
    )


def uniform(punch):
    return load.assemble(punch.structure, q=1.0)


def point_load(punch, x, force=1.0):
    """A force on a plate or, through all points above, on the nodes of a solid."""
    basis = punch.structure
    if basis.mesh.dim() == 2:
        return force * value_matrix(basis, np.array(x)[:, None]).toarray()[0]
    mesh = basis.mesh
    top = mesh.p[2] == mesh.p[2].max()
    # forces on the nodes of the top, linear in x and y, that have the resultant
    planes = np.vstack([np.ones(top.sum()), mesh.p[:2, top]])
    forces = planes.T @ np.linalg.solve(planes @ planes.T, force * np.array([1.0, *x]))
    f = np.zeros(basis.N)
    f[basis.nodal_dofs[2, top]] = -forces
    return f


def position(s):
    """Settlement of the origin and tilts of a structure that does not bend."""
    x = s.punch.collocation_points
    planes = np.vstack([np.ones(x.shape[1]), x])
    return np.linalg.lstsq(planes.T, s.deflection(x), rcond=None)[0]


def plate_on(grid, make):
    """Cells of a grid and a plate on triangles."""
    mesh = rectangle(8)
    dual = DualMesh.from_mesh(mesh)
    cells = {
        "dual": dual.basis(),
        "triangles": CellBasis(mesh, ElementTriP0()),
        "quadrilaterals": CellBasis(squares(), ElementQuad0()),
    }[grid]
    basis, stiffness = make(mesh)
    return cells, basis, stiffness, {}


def squares():
    return trace(
        MeshHex.init_tensor(*[np.linspace(-1, 1, 9)] * 2, np.array([0.0, 1])), lambda x: x[2] == 0
    )


def block_on(grid, height=1.0, n=6):
    """Cells on the base of a block of tetrahedra or hexahedra."""
    sides = [np.linspace(-1, 1, n + 1)] * 2 + [np.linspace(0, height, 3)]
    mesh = (MeshHex if grid == "quadrilaterals" else MeshTet).init_tensor(*sides)
    mesh = mesh.with_boundaries({"base": lambda x: x[2] == 0})
    plan = trace(mesh, "base")
    cells = {
        "dual": lambda: DualMesh.from_mesh(plan).basis(),
        "triangles": lambda: CellBasis(plan, ElementTriP0()),
        "quadrilaterals": lambda: CellBasis(plan, ElementQuad0()),
    }[grid]()
    if grid == "quadrilaterals":
        basis = Basis(mesh, ElementVector(ElementHex1()), intorder=3)  # exact in boxes
    else:
        basis = Basis(mesh, ElementVector(ElementTetP1()))
    K = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis)
    return cells, basis, K, {"boundary": "base"}


def settled(punch):
    """DOFs of a plate that settles by one."""
    return punch.structure.project(lambda x: 1.0 + 0.0 * x[0])
