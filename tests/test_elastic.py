import numpy as np
import pytest
from plans import disc, rectangle
from scipy.special import eval_jacobi, gammaln
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementHex1,
    ElementQuad0,
    ElementTetP1,
    ElementTriArgyris,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP2,
    ElementVector,
    LinearForm,
    MeshHex,
    MeshTet,
    MeshTri,
)
from skfem.helpers import dd, ddot, eye, grad, sym_grad
from skfem.helpers import trace as tr
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import (
    DualMesh,
    ElasticPunch,
    HalfSpace,
    RigidPunch,
    trace,
)
from skfem_dual.elements.load_matrix import load_matrix
from skfem_dual.elements.point_values import value_matrix
from skfem_dual.grids import generate
from skfem_dual.grids.fan import Fan

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
    basis = CellBasis(mesh, element or ElementTriMorley())
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
    element = ElementHex1() if grid == "quadrilaterals" else ElementTetP1()
    basis = Basis(mesh, ElementVector(element))
    K = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis)
    return cells, basis, K, {"boundary": "base"}


STRUCTURES = {
    "Morley on dual cells": lambda: plate_on("dual", kirchhoff),
    "Morley on quadrilaterals": lambda: plate_on("quadrilaterals", kirchhoff),
    "Mindlin on triangles": lambda: plate_on("triangles", mindlin),
    "tetrahedra on dual cells": lambda: block_on("dual"),
    "tetrahedra on triangles": lambda: block_on("triangles"),
    "hexahedra on quadrilaterals": lambda: block_on("quadrilaterals"),
}


@pytest.mark.parametrize("name", STRUCTURES)
def test_too_stiff_to_bend_is_the_rigid_punch(name):
    cells, structure, K, options = STRUCTURES[name]()
    punch = ElasticPunch(SOIL, cells, structure, 1e9 * K, **options)
    rigid = RigidPunch(SOIL, cells)
    for at in ((0.1, 0.05), (0.6, 0.2)):  # full contact, and lifted off
        s, r = punch.solve(point_load(punch, at)), rigid.solve(1.0, at)
        assert s.success
        assert position(s) == pytest.approx([r.settlement, *r.tilt], rel=1e-6)
        assert s.pressure == pytest.approx(r.pressure, abs=1e-6 * r.pressure.max())
        assert s.gap == pytest.approx(r.gap, abs=1e-6 * r.settlement)
        assert s.resultant == pytest.approx([1.0, *at], abs=1e-10)
        assert s.equilibrium_residual < 1e-10
    assert (s.gap > 0).any()


@pytest.mark.parametrize("edge", ["singular", "constant"])
def test_stiff_under_either_edge(edge):
    punch = raft(1e9, edge=edge)
    s = punch.solve(point_load(punch, (0.5, 0.0)))
    rigid = RigidPunch(SOIL, punch.basis, edge=edge).solve(1.0, (0.5, 0.0))
    assert position(s) == pytest.approx([rigid.settlement, *rigid.tilt], rel=1e-6, abs=1e-7)


class Legendre:
    """Circular raft under a uniform load, q = a = E* = 1, by Ritz: no cells, no elements.

    The pressure ``c_k P_2k(t) / t``, t = sqrt(1 - r^2), settles the circle by ``l_k c_k P_2k(t)``
    with ``l_k = (Gamma(k + 1/2) / k!)^2``, a polynomial in r^2.
    """

    def __init__(self, D, terms=40):
        self.terms = terms
        z, weights = np.polynomial.legendre.leggauss(4 * terms)  # 2 pi r dr = pi dz / 2
        weights = np.pi / 2 * weights
        once = 2 * self.modes(z, 1)  # w' / r
        twice = once + 2 * (1 + z) * self.modes(z, 2)  # w''
        whole, mixed = ((once + twice) * weights) @ (once + twice).T, (once * weights) @ twice.T
        k = np.arange(terms)
        eigenvalues = np.exp(2 * (gammaln(k + 0.5) - gammaln(k + 1)))
        matrix = D * (whole - (1 - POISSON) * (mixed + mixed.T))
        matrix += np.diag(2 * np.pi / (4 * k + 1) / eigenvalues)
        self.coefficients = np.linalg.solve(matrix, self.modes(z) @ weights)

    def modes(self, z, m=0):
        """m-th derivatives by r^2 of all P_2k(t)."""
        rows = [np.zeros_like(z)] * m
        for k in range(m, self.terms):
            factor = np.prod(-(k + 0.5 + np.arange(m)))
            rows.append(factor * eval_jacobi(k - m, m, m - 0.5, -z))
        return np.array(rows)

    def deflection(self, r):
        return self.coefficients @ self.modes(2 * np.asarray(r) ** 2 - 1)


def ring(r, n=48):
    angle = 2 * np.pi * np.arange(n) / n
    return r * np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    ("K", "cells"), [(0.001, 600), (0.01, 150), (0.1, 150), (1, 150), (10, 150), (1000, 150)]
)
def test_brown(K, cells):
    """Circle under a uniform load; the edge by default is the better one at every stiffness.

    As soon as cells see the strip in which the pressure under a soft plate grows.
    """
    radii = np.array([0.0, 0.5, 0.99])
    exact = Legendre(rigidity(K)).deflection(radii)
    errors = {}
    for edge in (None, "constant"):
        punch = raft(K, generate.disc(n=cells, true_area=True), edge=edge)
        s = punch.solve(uniform(punch), unilateral=False)
        found = [s.deflection(ring(r)).mean() for r in radii]
        errors[edge] = np.abs(found - exact).max()
        assert s.force == pytest.approx(uniform(punch) @ settled(punch), rel=1e-10)
    assert errors[None] < (1.2e-2 if K < 0.1 else 5e-3)
    assert errors[None] < 0.7 * errors["constant"]


def settled(punch):
    """DOFs of a plate that settles by one."""
    return punch.structure.project(lambda x: 1.0 + 0.0 * x[0])


#: lift-off under a uniform patch of radius 0.2: deflections at centre and edge, contact radius
LIFTED = {0.01: (2.36406, -0.65500, 0.3984), 0.1: (1.381462, 0.193612, 0.7114)}


def patch(basis, radius=0.2):
    """Uniform, of the force one, whatever the mesh of the plate."""
    dual = DualMesh.from_mesh(generate.disc(radius=radius, n=200, true_area=True))
    cells = dual.partition
    loads = load_matrix(cells, None, Fan.from_dual(dual), basis)
    return loads @ np.ones(len(cells)) / cells.areas.sum()


def lifted(K, n):
    """Errors of centre, edge and radius of contact with Argyris on the triangles."""
    mesh = generate.disc(n=n, true_area=True)
    plate, stiffness = kirchhoff(mesh, ElementTriArgyris())
    cells = DualMesh.from_mesh(mesh).basis()
    s = ElasticPunch(SOIL, cells, plate, rigidity(K) * stiffness).solve(patch(plate))
    found = [s.deflection([0.0, 0.0]), s.deflection(ring(0.998)).mean()]
    assert s.success
    assert s.force == pytest.approx(1.0, rel=1e-10)
    return np.abs(np.append(found, np.sqrt(s.contact_area / np.pi)) - LIFTED[K])


def test_lifts_off():
    assert (lifted(0.1, 150) < (3e-3, 6e-3, 5e-3)).all()


@pytest.mark.slow
@pytest.mark.parametrize("K", LIFTED)
def test_lift_off_converges(K):
    """At least of the first order in h, the centre of nearly the second for stiffer plates."""
    coarse, fine = lifted(K, 150), lifted(K, 600)
    assert (fine < 0.65 * coarse).all()
    assert fine[0] < (5e-4 if K == 0.1 else 3e-3)
    assert fine[0] < coarse[0] / 4
    assert fine[2] < 7e-3


def test_infinite_plate_under_a_point_force():
    """w0 = P l^2 / (3 sqrt(3) D), l^3 = 2 D / E*, on a disc of radius 12 l."""
    D, mesh = 0.5, disc(3)
    mesh = MeshTri(12.0 * mesh.p * np.hypot(*mesh.p) ** 0.7, mesh.t)  # drawn to the middle
    plate, stiffness = kirchhoff(mesh, ElementTriArgyris())
    punch = ElasticPunch(SOIL, DualMesh.from_mesh(mesh).basis(), plate, D * stiffness)
    s = punch.solve(point_load(punch, (0.0, 0.0)), unilateral=False)
    assert s.deflection([0.0, 0.0]) == pytest.approx(1 / (3 * np.sqrt(3) * D), rel=5e-3)
