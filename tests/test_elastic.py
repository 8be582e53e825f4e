import numpy as np
import pytest
from elastic_bodies import (
    POISSON,
    SOIL,
    block_on,
    kirchhoff,
    mindlin,
    plate_on,
    point_load,
    position,
    raft,
    rigidity,
    settled,
    uniform,
)
from marks import slow
from plans import disc
from scipy.optimize import brentq
from scipy.sparse import csr_matrix, diags
from scipy.special import eval_jacobi, gammaln
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementHex1,
    ElementQuad0,
    ElementQuad1,
    ElementTriArgyris,
    ElementTriMini,
    ElementTriMorley,
    ElementTriP2,
    ElementVector,
    LinearForm,
    MeshHex,
    MeshQuad,
    MeshTri,
)
from skfem.helpers import dd, ddot, div, dot, grad
from skfem.models.elasticity import lame_parameters, linear_elasticity
from skfem.models.poisson import laplace

from skfem_dual import DualMesh, ElasticPunch, HalfSpace, Paraboloid, Plate, RigidPunch, trace
from skfem_dual.elements.load_matrix import load_matrix
from skfem_dual.errors import ConvergenceWarning
from skfem_dual.grids import generate
from skfem_dual.grids.fan import Fan

STRUCTURES = {
    "Morley on dual cells": lambda: plate_on("dual", kirchhoff),
    "Morley on quadrilaterals": lambda: plate_on("quadrilaterals", kirchhoff),
    "Mindlin on triangles": lambda: plate_on("triangles", mindlin),
    "tetrahedra on dual cells": lambda: block_on("dual"),
    "tetrahedra on triangles": lambda: block_on("triangles"),
    "hexahedra on quadrilaterals": lambda: block_on("quadrilaterals"),
}


def test_stiffness_is_a_read_only_copy():
    """Also of a matrix with entries in parts, which scipy adds up in place."""
    cells, structure, K, options = next(iter(STRUCTURES.values()))()
    parts = np.repeat(K.data / 2, 2), np.repeat(K.indices, 2), 2 * K.indptr
    twice = csr_matrix(parts, K.shape)
    punch = ElasticPunch(SOIL, cells, structure, twice, **options)
    f = punch.loads @ np.ones(punch.loads.shape[1])
    assert punch.solve(f).success
    assert twice.data.flags.writeable
    for matrix in (punch.loads, punch.stiffness):
        with pytest.raises(ValueError, match="read-only"):
            matrix.data[:] = 0


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the structure bends within cells")
def test_too_soft_to_spread_its_load():
    """Pressures are the load where that presses: iterations alone would not end.

    With fewer cells the thousandth iteration may happen to be accurate enough, as rounding has it.
    """
    mesh = generate.disc(n=300)
    structure = CellBasis(mesh, ElementTriMorley())
    K = BilinearForm(lambda u, v, _: 1e-9 * ddot(dd(u), dd(v))).assemble(structure)
    punch = ElasticPunch(SOIL, DualMesh.from_mesh(mesh).basis(), structure, K)
    f = LinearForm(lambda v, w: (w.x[0] > 0) * v).assemble(structure)
    found, direct = punch.solve(f), punch.solve(f, method="active-set")
    assert found.success
    assert found.pressure == pytest.approx(direct.pressure, abs=1e-8 * direct.pressure.max())
    inside = punch.partition.centroids[0] > 0.4
    assert np.mean(found.pressure[inside]) == pytest.approx(1.0, rel=0.05)
    assert np.all(found.pressure[punch.partition.centroids[0] < -0.4] < 0.05)
    with pytest.warns(ConvergenceWarning, match=r'softer than the ground.*Remedy: method="auto"'):
        assert not punch.solve(f, method="cg").success


@pytest.mark.parametrize("name", STRUCTURES)
def test_too_stiff_to_bend_is_the_rigid_punch(name):
    cells, structure, K, options = STRUCTURES[name]()
    punch = ElasticPunch(SOIL, cells, structure, 1e9 * K, **options)
    rigid = RigidPunch(SOIL, cells)
    for at in ((0.1, 0.05), (0.6, 0.2)):  # full contact, and lifted off
        s, r = punch.solve(point_load(punch, at)), rigid.solve(1.0, at)
        assert s.success
        assert position(s) == pytest.approx(
            [r.collocated_settlement, *r.collocated_tilt], rel=1e-6
        )
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
    expected = [rigid.collocated_settlement, *rigid.collocated_tilt]
    assert position(s) == pytest.approx(expected, rel=1e-6, abs=1e-7)


class Legendre:
    """Circular raft under a load on its middle, a = E* = 1, by Ritz: no cells, no elements.

    The pressure ``c_k P_2k(t) / t``, t = sqrt(1 - (r / radius)^2), settles the ground up to the
    radius of contact by ``radius l_k c_k P_2k(t)`` with ``l_k = (Gamma(k + 1/2) / k!)^2``, a
    polynomial in r^2. Beyond it a ring without a load, ``w' = 2 B r + C / r``, follows.
    """

    def __init__(self, D, patch, radius=1.0, terms=40):
        self.terms, self.radius = terms, radius
        z, weights = np.polynomial.legendre.leggauss(4 * terms)  # 2 pi r dr = pi dz / 2
        once = 2 * self.modes(z, 1)  # w' / r
        twice = once + 2 * (1 + z) * self.modes(z, 2)  # w''
        bent = np.pi / 2 * weights / radius**2
        whole, mixed = ((once + twice) * bent) @ (once + twice).T, (once * bent) @ twice.T
        k = np.arange(terms)
        yields = radius * np.exp(2 * (gammaln(k + 0.5) - gammaln(k + 1)))
        matrix = D * (whole - (1 - POISSON) * (mixed + mixed.T))
        matrix += radius**2 * np.diag(2 * np.pi / (4 * k + 1) / yields)
        slope = 2 / radius * self.modes(np.ones(1), 1)[:, 0]
        ratio = (1 - POISSON) / (1 + POISSON)  # 2 B / C of a ring whose outer edge is free
        per_slope = 1 / (ratio * radius + 1 / radius)
        stiffness = 2 * np.pi * D * (1 - POISSON) * per_slope * (1 / radius - radius)
        matrix += stiffness * np.outer(slope, slope)
        load = self.modes((1 + z) * (patch / radius) ** 2 - 1) @ weights / 2
        self.coefficients = np.linalg.solve(matrix, load)
        self.C = per_slope * (slope @ self.coefficients)
        self.B = self.C * ratio / 2
        #: of the pressure, which is not singular where contact ends
        self.strength = (self.coefficients / yields) @ self.modes(np.ones(1))[:, 0]

    @classmethod
    def lifting_off(cls, D, patch):
        """With the radius at which the pressure ends like the root of the distance."""
        radius = brentq(lambda radius: cls(D, patch, radius).strength, 1.2 * patch, 1.0)
        return cls(D, patch, radius)

    def modes(self, z, m=0):
        """m-th derivatives by (r / radius)^2 of all P_2k(t)."""
        rows = [np.zeros_like(z)] * m
        for k in range(m, self.terms):
            factor = np.prod(-(k + 0.5 + np.arange(m)))
            rows.append(factor * eval_jacobi(k - m, m, m - 0.5, -z))
        return np.array(rows)

    def deflection(self, r):
        r, c = np.asarray(r, dtype=float), self.radius
        beyond = np.maximum(r, c)
        ring = self.B * (beyond**2 - c**2) + self.C * np.log(beyond / c)
        return self.coefficients @ self.modes(2 * (np.minimum(r, c) / c) ** 2 - 1) + ring


def ring(r, n=48):
    angle = 2 * np.pi * np.arange(n) / n
    return r * np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    ("K", "cells"),
    [(0.01, 150), (1000, 150), *slow((0.001, 400), (0.1, 150), (1, 150), (10, 150))],
)
def test_brown(K, cells):
    """Circle under a uniform load; the edge by default is the better one at every stiffness.

    As soon as cells see the strip in which the pressure under a soft plate grows.
    """
    radii = np.array([0.0, 0.5, 0.99])
    exact = np.pi * Legendre(rigidity(K), 1.0).deflection(radii)
    errors = {}
    for edge in (None, "constant"):
        punch = raft(K, generate.disc(n=cells), edge=edge)
        s = punch.solve(uniform(punch), unilateral=False)
        found = [s.deflection(ring(r)).mean() for r in radii]
        errors[edge] = np.abs(found - exact).max()
        assert s.force == pytest.approx(uniform(punch) @ settled(punch), rel=1e-10)
    assert errors[None] < (1.2e-2 if K < 0.1 else 6e-3)
    assert errors[None] < 0.7 * errors["constant"]


@pytest.mark.parametrize(("K", "rtol"), [(1.0, 1e-8), *slow((1e7, 1e-8), (1e-7, 1e-5))])
def test_hundreds_of_cells(K, rtol):
    """The ground may pull, but does not: the same pressures, soft or stiff."""
    punch = raft(K, generate.disc(n=400), edge="constant")
    f = uniform(punch)
    s = punch.solve(f, unilateral=False)
    assert s.success
    assert s.pressure == pytest.approx(punch.solve(f).pressure, rel=rtol)
    assert s.force == pytest.approx(f @ settled(punch), rel=1e-10)


def patch(basis, radius=0.2):
    """Uniform, of the force one, whatever the mesh of the plate."""
    dual = DualMesh.from_mesh(generate.disc(radius=radius, n=200))
    cells = dual.partition
    loads = load_matrix(cells, None, Fan.from_dual(dual), basis)
    return loads @ np.ones(len(cells)) / cells.areas.sum()


def lifted(K, n):
    """Errors of centre, edge and radius of contact with Argyris on the triangles."""
    mesh = generate.disc(n=n)
    plate, stiffness = kirchhoff(mesh, ElementTriArgyris())
    cells = DualMesh.from_mesh(mesh).basis()
    s = ElasticPunch(SOIL, cells, plate, rigidity(K) * stiffness).solve(patch(plate))
    assert s.success
    assert s.force == pytest.approx(1.0, rel=1e-10)
    x = np.column_stack([[0.0, 0.0], ring(0.99)])
    centre, *edge = s.deflection(x)
    exact = Legendre.lifting_off(rigidity(K), 0.2)
    found = np.array([centre, np.mean(edge), np.sqrt(s.contact_area / np.pi)])
    return np.abs(found - [*exact.deflection([0.0, 0.99]), exact.radius])


def test_lifts_off():
    # the radius to a tenth of a cell
    assert (lifted(0.1, 150) < (5e-4, 5e-3, 0.1 * np.sqrt(np.pi / 150))).all()


@pytest.mark.slow
@pytest.mark.parametrize(("K", "bounds"), [(0.01, (1e-3, 4e-3, 1e-2)), (0.1, (1e-4, 3e-4, 1e-3))])
def test_lift_off_converges(K, bounds):
    """At least of the first order in h."""
    coarse, fine = lifted(K, 150), lifted(K, 600)
    assert (fine < 0.65 * coarse).all()
    assert (fine < bounds).all()


def test_infinite_plate_under_a_point_force():
    """w0 = P l^2 / (3 sqrt(3) D), l^3 = 2 D / E*, on a disc of radius 12 l."""
    D, mesh = 0.5, disc(3)
    mesh = MeshTri(12.0 * mesh.p * np.hypot(*mesh.p) ** 0.7, mesh.t)  # drawn to the middle
    plate, stiffness = kirchhoff(mesh, ElementTriArgyris())
    punch = ElasticPunch(SOIL, DualMesh.from_mesh(mesh).basis(), plate, D * stiffness)
    s = punch.solve(point_load(punch, (0.0, 0.0)), unilateral=False)
    assert s.deflection([0.0, 0.0]) == pytest.approx(1 / (3 * np.sqrt(3) * D), rel=5e-3)


def soft_block(n):
    """Settlements of the top of a tall block beyond its shortening, under a uniform load.

    With either law at the edge of its base.
    """
    sides = [np.linspace(-0.5, 0.5, n + 1)] * 2 + [np.linspace(0, 3, 2 * n + 1)]
    mesh = MeshHex.init_tensor(*sides).with_boundaries({"base": lambda x: x[2] == 0})
    basis = Basis(mesh, ElementVector(ElementHex1()), intorder=3)  # exact in boxes
    K = linear_elasticity(*lame_parameters(0.5, 0.0)).assemble(basis)
    top = basis.boundary(mesh.facets_satisfying(lambda x: x[2] == 3))
    f = LinearForm(lambda v, w: -v[2]).assemble(top)
    cells = CellBasis(trace(mesh, "base"), ElementQuad0())
    found = []
    for edge in ("singular", "constant"):
        s = ElasticPunch(SOIL, cells, basis, K, boundary="base", edge=edge).solve(f)
        assert s.force == pytest.approx(1.0, rel=1e-10)
        assert s.equilibrium_residual < 1e-10
        found.append(f @ s.displacement - 3 / 0.5)
    return found


@pytest.mark.parametrize("n", [3, *slow(8)])
def test_soft_tall_block_converges(n):
    """Both laws at the edge lead to one settlement, from either side and faster than h."""
    coarse, fine = soft_block(n), soft_block(2 * n)
    assert coarse[0] < fine[0] < fine[1] < coarse[1]
    assert fine[1] - fine[0] < (coarse[1] - coarse[0]) / 2.5
    assert 0.866 < fine[0] < fine[1] < 0.946  # mean settlements of a rigid square, a loose one


def ball_on_ground(n, force=0.002):
    """A solid under a ball of radius one on ground as soft: radius and greatest pressure."""
    young, poisson = 1.0, 0.3
    t = np.linspace(-1, 1, 2 * n + 1)
    across, up = np.sign(t) * np.abs(t) ** 2.2, np.linspace(0, 1, n + 1) ** 2.2
    mesh = MeshHex.init_tensor(across, across, up)
    mesh = mesh.with_boundaries({"base": lambda x: x[2] == 0, "top": lambda x: x[2] == up[-1]})
    basis = Basis(mesh, ElementVector(ElementHex1()))
    K = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    f = LinearForm(lambda v, w: -force / 4 * v[2]).assemble(basis.boundary("top"))
    cells = CellBasis(trace(mesh, "base"), ElementQuad0())
    soil, gap = HalfSpace(young, poisson), Paraboloid(1.0)
    s = ElasticPunch(soil, cells, basis, K, boundary="base", gap=gap).solve(f)
    x, load = s.footprint.partition.centroids, s.pressure * s.footprint.partition.areas
    modulus = young / (1 - poisson**2) / 2  # 1 / E* = 1 / E1* + 1 / E2*
    radius = np.cbrt(3 * force / (4 * modulus))
    peak = 1.5 * force / (np.pi * radius**2)
    by_moment = np.sqrt(2.5 * (load @ np.sum(x**2, axis=0)) / force)
    by_area = np.sqrt(s.contact_area / np.pi)
    assert s.success
    return np.array([by_moment / radius, s.pressure.max() / peak, by_area / radius]) - 1


@pytest.mark.slow
def test_two_elastic_bodies_are_those_of_hertz():
    assert (np.abs(ball_on_ground(8)) < (0.03, 0.03, 0.13)).all()


@pytest.mark.slow
def test_two_elastic_bodies_approach_hertz():
    """As the solid grows over its contact the cells there grow fewer: both have to go on."""
    assert (np.abs(ball_on_ground(14)) < (0.005, 0.005, 0.06)).all()


def slender():
    """A beam of a row of hexahedra."""
    mesh = MeshHex.init_tensor(np.linspace(0, 10, 21), np.linspace(0, 1, 3), np.array([0, 0.5]))
    mesh = mesh.with_boundaries({"base": lambda x: x[2] == 0})
    basis = Basis(mesh, ElementVector(ElementHex1()))
    K = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis)
    return CellBasis(trace(mesh, "base"), ElementQuad0()), basis, K, {"boundary": "base"}


SPRUNG = {
    "block": lambda: block_on("dual"),
    "beam": slender,
    "plate": lambda: plate_on("dual", kirchhoff),
}


def at_corners(basis):
    """DOFs in the plane that keep a solid from sliding, and vertical ones, of three corners."""
    mesh = basis.mesh
    low, high = mesh.p[:2].min(axis=1), mesh.p[:2].max(axis=1)
    corners = np.zeros((mesh.dim(), 3))
    corners[:2] = np.array([low, [high[0], low[1]], [low[0], high[1]]]).T
    a, b, c = (np.linalg.norm(mesh.p - x[:, None], axis=0).argmin() for x in corners.T)
    if mesh.dim() == 2:
        return np.empty(0, dtype=int), basis.nodal_dofs[0, [a, b, c]]
    level = np.append(basis.nodal_dofs[:2, a], basis.nodal_dofs[1, b])
    return level, basis.nodal_dofs[2, [a, b, c]]


def on_springs(name, ratio, young=1.0, vertical=True):
    """A structure held by D against sliding, and on springs instead; where these are vertical."""
    cells, basis, K, options = SPRUNG[name]()
    level, upright = at_corners(basis)
    held = ElasticPunch(SOIL, cells, basis, young * K, D=level, **options)
    springs = np.zeros(basis.N)
    springs[np.append(level, upright) if vertical else level] = ratio * young
    sprung = ElasticPunch(SOIL, cells, basis, young * K + diags(springs), **options)
    x = np.array([basis.mesh.p[:2].mean(axis=1), basis.mesh.p[:2].max(axis=1)]).T
    f = 1e-2 * point_load(held, x[:, 0]) + 1e-3 * point_load(held, 0.7 * x[:, 0] + 0.3 * x[:, 1])
    return held, sprung, upright, f, x


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("ratio", [1e-8, *slow(1e-2, 1e-5)])
@pytest.mark.parametrize("name", ["block", "beam"])
def test_springs_against_sliding_change_nothing(name, ratio, unilateral):
    """Vertical loads and smooth ground do no work on them, however soft they are.

    Rounding of these loads is all that they feel.
    """
    held, sprung, _, f, x = on_springs(name, ratio, vertical=False)
    expected = held.solve(f, unilateral=unilateral)
    found = sprung.solve(f, unilateral=unilateral)
    assert found.success, found.message
    assert found.deflection(x) == pytest.approx(expected.deflection(x), rel=1e-9 + 1e-16 / ratio)


@pytest.mark.filterwarnings("ignore:the structure bends within cells")
@pytest.mark.parametrize("ratio", [1e-5, *slow(1e-8, 1e-2)])
@pytest.mark.parametrize("name", SPRUNG)
def test_springs_below_are_forces_on_a_structure_without(name, ratio):
    """By the deflections of their ends under unit forces there, and under the load."""
    free, sprung, upright, f, x = on_springs(name, ratio)
    units = np.zeros((len(f), 3))
    units[upright, range(3)] = 1.0
    by_load, *by_forces = free.solve_many(np.column_stack([f, units]), unilateral=False)
    ends = np.array([s.displacement[upright] for s in by_forces]).T
    forces = np.linalg.solve(np.eye(3) / ratio + ends, by_load.displacement[upright])
    moved = np.array([s.deflection(x) for s in by_forces]).T @ forces
    found = sprung.solve(f, unilateral=False)
    assert found.success, found.message
    # rounding over the smallest ratio
    assert found.deflection(x) == pytest.approx(by_load.deflection(x) - moved, rel=1e-6)


@pytest.mark.parametrize("name", ["block", "plate"])
def test_springs_that_are_taken_for_none_are_no_success(name):
    """Too soft to be told from rounding beside the structure, but not beside the ground."""
    _, sprung, _, f, _ = on_springs(name, 1e-8, young=1e6)
    with pytest.warns(ConvergenceWarning, match="forces of the structure are off by"):
        assert not sprung.solve(f, unilateral=False).success


@pytest.mark.parametrize(
    ("thickness", "stiffness"), [(0.8, 1e4), *slow((0.5, 1e3), (2.0, 1e3), (2.0, 1e5))]
)
def test_a_pile_under_a_raft_of_concrete(thickness, stiffness):
    """One spring does little work beside that of the entries, and was taken for rounding."""
    dual = DualMesh.from_mesh(generate.rectangle(8.0, 5.0, n=300))
    structure = CellBasis(dual.refinement, ElementTriMorley())
    pile, column = (structure.probes(np.array(x)[:, None]) for x in ((-3.0, 1.5), (0.7, 0.2)))
    K = Plate(thickness, 30e6, 0.2).stiffness(structure) + stiffness * pile.T @ pile
    found = ElasticPunch(HalfSpace(30e3, 0.3), dual.basis(), structure, K).solve(
        column.T @ [1000.0], unilateral=False
    )
    assert found.success, found.message
    borne = stiffness * (pile @ found.displacement)[0]
    assert found.force + borne == pytest.approx(1000.0, abs=1e-4)


def test_bubbles_have_no_place():
    """scikit-fem gives NaN for it: as if they were anywhere."""
    cells, _, _, _ = plate_on("triangles", mindlin)
    structure = CellBasis(cells.mesh, ElementTriP2() * ElementVector(ElementTriMini()), intorder=6)
    bend = Plate(0.5, 100.0, 0.2)

    @BilinearForm
    def form(w, turn, v, turned, _):
        slope = lambda u: (grad(u) + np.swapaxes(grad(u), 0, 1)) / 2  # noqa: E731
        moments = (1 - bend.poisson) * ddot(slope(turn), slope(turned))
        moments += bend.poisson * div(turn) * div(turned)
        return bend.rigidity * moments + 20 * dot(grad(w) - turn, grad(v) - turned)

    K = form.assemble(structure)
    f = LinearForm(lambda v, turned, w: (2 + w.x[0]) * v).assemble(structure)
    assert np.isnan(structure.doflocs).any()
    found = ElasticPunch(SOIL, cells, structure, K).solve(f)
    structure.doflocs = np.where(np.isnan(structure.doflocs), 0.3, structure.doflocs)
    placed = ElasticPunch(SOIL, cells, structure, K).solve(f)
    assert found.success
    assert found.pressure == pytest.approx(placed.pressure, rel=1e-8)
    total = f @ structure.project(lambda x: (np.ones_like(x[0]), 0 * x))
    assert found.force == pytest.approx(total, rel=1e-9)


@pytest.mark.parametrize("stiffness", [1e-6, *slow(0.1, 1e-3, 100.0)])
@pytest.mark.parametrize("grid", ["dual", "quadrilaterals"])
def test_a_solid_on_springs_slides_and_turns_only(grid, stiffness):
    """The ground resists none of its motions: as with three DOFs that keep it from sliding."""
    cells, basis, K, options = block_on(grid)
    base, (along, across, up) = basis.boundary("base"), basis.nodal_dofs
    springs = BilinearForm(lambda u, v, w: stiffness * u[2] * v[2]).assemble(base)
    f = LinearForm(lambda v, w: -(2 + w.x[0]) * v[2]).assemble(base)
    corner, other = (np.argmin(np.hypot(*(basis.mesh.p[:2].T - c).T)) for c in ([-1, -1], [1, -1]))
    level = np.array([along[corner], across[corner], across[other]])
    one, two = (
        ElasticPunch(SOIL, cells, basis, K + springs, D=D, **options).solve(f, unilateral=False)
        for D in (None, level)
    )
    assert one.success
    assert one.equilibrium_residual < 1e-6
    largest = np.abs(two.pressure).max()
    assert one.pressure == pytest.approx(two.pressure, abs=1e-6 * largest)
    carried = -(springs @ one.displacement)[up].sum()
    assert one.force + carried == pytest.approx(-f[up].sum(), rel=1e-6)


@pytest.mark.parametrize("body", ["solid", "plate"])
def test_hexahedra_and_quadrilaterals_at_site_coordinates(body):
    """There scikit-fem's Newton iteration has no digits left, from a kilometre on."""
    x = np.linspace(-1, 1, 4)

    def deflections(site):
        plan = MeshQuad.init_tensor(x, x).translated(site)
        if body == "solid":
            mesh = MeshHex.init_tensor(x, x, np.linspace(0, 1, 3)).translated((*site, 0.0))
            basis = CellBasis(mesh, ElementVector(ElementHex1()), intorder=3)
            K = linear_elasticity(*lame_parameters(10.0, 0.3)).assemble(basis)
            base = {"boundary": mesh.facets_satisfying(lambda x: x[2] == 0)}
            f = -1.0 * (np.arange(basis.N) == basis.nodal_dofs[2, np.argmax(mesh.p[2])])
        else:
            basis, base = CellBasis(plan, ElementQuad1()), {}
            K = laplace.assemble(basis)
            f = laplace.assemble(basis).diagonal()
        punch = ElasticPunch(SOIL, CellBasis(plan, ElementQuad0()), basis, K, **base)
        s = punch.solve(f, unilateral=False)
        forces = s.load_vector(s.punch.contact_basis)
        assert s.success
        assert abs(forces.sum()) == pytest.approx(abs(f.sum()), rel=1e-9)
        return s.deflection(plan.p)

    np.testing.assert_allclose(deflections((4.5e5, 5.4e6)), deflections((0.0, 0.0)), rtol=1e-6)


@pytest.mark.parametrize(
    ("held", "at", "force"),
    [(11, (1.6, 0.3), 0.6), (34, (0.2, 0.3), 0.8), (11, (1.75, -0.3), 0.6), (20, (0.2, 0.3), 0.5)],
)
def test_two_slabs_one_of_which_nearly_leaves_the_ground(held, at, force):
    """Block pivoting went through contact of too few cells, and gave up there."""
    slab = generate.rectangle(1.0, 1.2, n=24)
    mesh = slab + slab.translated((1.5, 0.0))
    basis, K = kirchhoff(mesh)
    load = LinearForm(lambda v, w: 0.3 * v).assemble(basis)
    load += force * basis.probes(np.array(at)[:, None]).toarray()[0]
    raft = ElasticPunch(
        HalfSpace(0.1, 0.3),
        DualMesh.from_mesh(mesh).basis(),
        basis,
        1e3 * K,
        D=basis.nodal_dofs[0][[held]],
    )
    one, other = (raft.solve(load, method=method) for method in ("auto", "active-set"))
    assert one.success
    assert other.success
    assert other.pressure == pytest.approx(one.pressure, abs=1e-7 * one.pressure.max())
