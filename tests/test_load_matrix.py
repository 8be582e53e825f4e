"""Pressures of cells as loads on finite elements."""

import re
from math import gamma

import numpy as np
import pytest
import skfem
from marks import slow
from plans import annulus, perturbed, rectangle
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementHex1,
    ElementLineP1,
    ElementQuad0,
    ElementQuad1,
    ElementQuad2,
    ElementQuadBFS,
    ElementQuadP,
    ElementTetP1,
    ElementTetP2,
    ElementTriArgyris,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshHex,
    MeshLine,
    MeshQuad,
    MeshTet,
    MeshTri,
    MeshTri2,
    condense,
    solve,
)
from skfem.models.elasticity import linear_elasticity
from skfem.models.poisson import unit_load

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    RigidPunch,
    load_matrix,
)
from skfem_dual.elements.load_matrix import graded
from skfem_dual.elements.shape_functions import ShapeFunctions
from skfem_dual.grids import generate
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.partition import Partition

SOIL = HalfSpace(1.0, 0.25)


def solved(basis, **options):
    return RigidPunch(SOIL, basis, **options).solve(force=1.0, at=(0.1, 0.05))


@pytest.fixture(scope="module")
def ring():
    return annulus(5, 40)


@pytest.fixture(scope="module", params=["dual", *slow("triangles")])
def solution(request, ring):
    dual = DualMesh.from_mesh(ring)
    return solved(dual.basis() if request.param == "dual" else dual.primal_basis())


def matrix_of(solution, basis, **options):
    punch = solution.punch
    return load_matrix(punch.partition, punch.weights, punch.fan, basis, **options)


def test_arguments_that_are_something_else():
    basis, other = (DualMesh.from_mesh(rectangle(n)).basis() for n in (3, 4))
    cells, fan = Partition.from_basis(basis), Fan.from_basis(basis)
    with pytest.raises(TypeError, match=r"Partition for partition, got CellwiseBasis.*from_basis"):
        load_matrix(basis, basis, basis, basis)
    with pytest.raises(TypeError, match="Fan for fan, got None"):
        load_matrix(cells, None, None, basis)
    with pytest.raises(TypeError, match="EdgeWeights for weights, got CellwiseBasis"):
        load_matrix(cells, basis, fan, basis)
    with pytest.raises(ValueError, match="expected fan of 16 cells, got 25"):
        load_matrix(cells, None, Fan.from_basis(other), basis)
    with pytest.raises(ValueError, match="expected weights of 16 cells, got 25"):
        load_matrix(cells, RigidPunch(SOIL, other).weights, fan, basis)
    with pytest.raises(ValueError, match="order from 0 to 19, got 20"):
        load_matrix(cells, None, fan, basis, order=20)
    with pytest.raises(TypeError, match="True or False for partial, got 'no'"):
        load_matrix(cells, None, fan, basis, partial="no")
    assert load_matrix(cells, None, fan, basis, order=19).sum() == pytest.approx(cells.areas.sum())


def elsewhere(n):
    return MeshTri().refined(n).scaled(2.4).translated((-1.2, -1.1))


def bent_quadrilaterals(n):
    mesh = MeshQuad.init_tensor(np.linspace(-1.1, 1.1, n), np.linspace(-1.1, 1.2, n + 3))
    return MeshQuad(mesh.p + 0.02 * np.sin(7 * mesh.p[::-1]), mesh.t)


@pytest.mark.parametrize("order", [1, 2, 5])
def test_the_rule_is_exact_for_polynomials_times_the_weight(order):
    """Over the triangle (0, 0), (1, 0), (0, 1): Dirichlet's integral of x^i y^(j - 1/2)."""
    whole = np.eye(3)[..., None]
    v = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for i in range(order + 1):
        for j in range(order + 1 - i):
            found = 0.0
            for at, load in graded(whole, v[1][:, None], order):
                x, y = np.einsum("dv,vkq->dkq", v, at)
                found += np.sum(load * x**i * y**j) / 2
            exact = gamma(i + 1) * gamma(j + 0.5) / gamma(i + j + 2.5)
            assert found == pytest.approx(exact, rel=1e-13)


BASES = {
    "P1": lambda m: CellBasis(m, ElementTriP1()),
    "P1 refined": lambda m: CellBasis(m.refined(), ElementTriP1()),
    "P2": lambda m: CellBasis(m, ElementTriP2()),
    "Morley": lambda m: CellBasis(m, ElementTriMorley()),
    "P2 elsewhere": lambda m: CellBasis(elsewhere(4), ElementTriP2()),
    "Q1": lambda m: CellBasis(bent_quadrilaterals(13), ElementQuad1()),
    "Q2": lambda m: CellBasis(bent_quadrilaterals(8), ElementQuad2()),
    "curved P2": lambda m: CellBasis(MeshTri2.init_circle(3).scaled(1.2), ElementTriP2()),
}  # fmt: skip


@pytest.mark.parametrize("name", BASES)
def test_force_and_moments_are_carried_to_rounding(solution, ring, name):
    basis = BASES[name](ring)
    f = solution.load_vector(basis)
    planes = [basis.project(g) for g in (lambda x: 1 + 0 * x[0], lambda x: x[0], lambda x: x[1])]
    np.testing.assert_allclose(planes @ f, [1.0, 0.1, 0.05], atol=1e-12)


@pytest.mark.parametrize("name", [*slow("P1"), "P2 elsewhere"])
@pytest.mark.parametrize("ground", [0, 1])
def test_laws_of_the_edge_that_follow_the_ground(ring, ground, name):
    """Graded and layered: no rule is exact for these, the moments of slopes are all the same."""
    soil = (
        GradedHalfSpace.init_linear(1.0, 0.3, 0.1),
        LayeredHalfSpace([Layer(0.3, 1.0, 0.45)], "bonded"),
    )[ground]
    punch = RigidPunch(soil, DualMesh.from_mesh(ring).primal_basis())
    basis = BASES[name](ring)
    f = punch.solve(force=1.0, at=(0.1, 0.05)).load_vector(basis)
    assert [f.sum(), *(basis.doflocs @ f)] == pytest.approx([1.0, 0.1, 0.05], abs=1e-13)


def test_argyris():
    """Its own coefficients of a plane carry more rounding."""
    mesh = rectangle(2)
    basis = CellBasis(mesh, ElementTriArgyris(), intorder=6)
    f = solved(DualMesh.from_mesh(rectangle(5)).basis()).load_vector(basis)
    planes = [basis.project(g) for g in (lambda x: 1 + 0 * x[0], lambda x: x[0], lambda x: x[1])]
    np.testing.assert_allclose(planes @ f, [1.0, 0.1, 0.05], atol=1e-10)


@pytest.mark.parametrize("edge", ["singular", "constant"])
def test_own_constants_take_the_areas(ring, edge):
    dual = DualMesh.from_mesh(ring)
    for basis in (dual.basis(), dual.primal_basis()):
        found = matrix_of(solved(basis, edge=edge), basis)
        areas = solved(basis, edge=edge).punch.partition.areas
        np.testing.assert_allclose(found.toarray(), np.diag(areas), atol=1e-14)


def test_nested_bases_agree(solution, ring):
    """Hat functions are sums of those of a refinement: no error of quadrature is left."""
    coarse, fine = (CellBasis(m, ElementTriP1()) for m in (ring, ring.refined()))
    f, g = solution.load_vector(coarse), solution.load_vector(fine)
    halves = fine.mesh.p.shape[1] - ring.p.shape[1]
    carried = g[:-halves].copy()
    for nodes in ring.facets:
        np.add.at(carried, nodes, g[-halves:] / 2)
    np.testing.assert_allclose(f, carried, atol=1e-15)


def test_polynomials_meet_integrals_of_the_punch_in_its_own_grid(solution, ring):
    """x^2 on a mesh that has nothing in common with the cells."""
    there = CellBasis(elsewhere(3), ElementTriP2())
    here = CellBasis(ring, ElementTriP2())
    values = [
        solution.load_vector(basis, order=3) @ basis.project(lambda x: x[0] ** 2 - x[0] * x[1])
        for basis in (here, there)
    ]
    assert values[0] == pytest.approx(values[1], abs=1e-13)


def test_uniform_pressure_is_scikit_fems_own_load():
    mesh = perturbed(rectangle(6), 0.05)
    basis = CellBasis(mesh.refined(), ElementTriP2())
    punch = RigidPunch(SOIL, CellBasis(mesh, ElementTriP0()), edge="constant")
    found = load_matrix(punch.partition, None, punch.fan, basis) @ np.ones(mesh.nelements)
    np.testing.assert_allclose(found, unit_load.assemble(basis), atol=1e-14)


def wall(mesh, z):
    return mesh.facets_satisfying(lambda x: np.abs(x[2] - z) < 1e-9)


SOLIDS = [
    (MeshTet, ElementTetP1()),
    (MeshTet, ElementTetP2()),
    (MeshHex, ElementHex1()),
]


@pytest.mark.parametrize(
    ("kind", "elem", "z"),
    [
        *[(*solid, 2.0) for solid in SOLIDS],
        (*SOLIDS[0], 3.0),
        *slow(*((*solid, 3.0) for solid in SOLIDS[1:])),
    ],
)
def test_traction_on_a_solid(kind, elem, z):
    """Force and moments through the bottom push up, through the top down."""
    x = np.linspace(-1, 1, 4)
    mesh = kind.init_tensor(x, x, np.linspace(2, 3, 3))
    inner = rectangle(4, 0.9, 0.8)
    s = solved(DualMesh.from_mesh(inner).basis())
    basis = FacetBasis(mesh, ElementVector(elem), facets=wall(mesh, z))
    f = s.load_vector(basis)
    up = 1.0 if z == 2.0 else -1.0
    x = basis.doflocs
    vertical = np.arange(basis.N) % 3 == 2
    assert not f[~vertical].any()
    found = [f.sum(), *(x[:2, vertical] @ f[vertical])]
    np.testing.assert_allclose(found, up * np.array([1.0, 0.1, 0.05]), atol=1e-12)


def test_a_block_of_tetrahedra_in_equilibrium():
    """Nodal forces of a linear elastic block balance the pressure on its base."""
    mesh = MeshTet.init_tensor(*[np.linspace(-1, 1, 5)] * 2, np.linspace(0, 1, 3))
    elem = ElementVector(ElementTetP1())
    solid = Basis(mesh, elem)
    base = FacetBasis(mesh, elem, facets=wall(mesh, 0.0))
    f = solved(DualMesh.from_mesh(rectangle(7)).basis()).load_vector(base)
    stiffness = BilinearForm(linear_elasticity(1.0, 1.0)).assemble(solid)
    top = solid.get_dofs(wall(mesh, 1.0))
    u = solve(*condense(stiffness, f, D=top))
    reactions = (stiffness @ u - f)[top.all("u^3")]
    x = solid.doflocs[:, top.all("u^3")]
    other = [(stiffness @ u - f)[top.all(c)].sum() for c in ("u^1", "u^2")]
    np.testing.assert_allclose(other, 0.0, atol=1e-12)
    assert reactions.sum() == pytest.approx(-1.0, abs=1e-12)
    # horizontal reactions at the top, at z = 1, take part in the moments
    r1, r2 = ((stiffness @ u - f)[top.all(c)] for c in ("u^1", "u^2"))
    assert reactions @ x[0] - r1.sum() == pytest.approx(-0.1, abs=1e-12)
    assert reactions @ x[1] - r2.sum() == pytest.approx(-0.05, abs=1e-12)


def test_each_entry_on_site_coordinates():
    """Middles of sides are rounded off the edge, where thin slivers have much of the load."""
    mesh, found = generate.disc(n=90), []
    for off in (0.0, 1e6):
        moved = MeshTri(mesh.p + off, mesh.t)
        punch = RigidPunch(
            HalfSpace(1.0, 0.3), DualMesh.from_mesh(moved).basis(), origin=(off, off)
        )
        found.append(punch.solve(1.0).load_vector(CellBasis(moved, ElementTriP1())))
    assert found[1] == pytest.approx(found[0], abs=1e-8 * found[0].max())


def test_components():
    mesh = rectangle(4)
    s = solved(DualMesh.from_mesh(mesh).basis())
    f = s.load_vector(CellBasis(mesh, ElementTriP1()))
    plate = CellBasis(mesh, ElementTriP1() * ElementVector(ElementTriP1()))
    deflection = plate.split_indices()[0]
    g = s.load_vector(plate)
    np.testing.assert_allclose(g[deflection], f, rtol=1e-13)
    assert np.count_nonzero(g) == np.count_nonzero(f)
    flat = CellBasis(mesh, ElementVector(ElementTriP1()))
    np.testing.assert_allclose(s.load_vector(flat, component=1)[1::2], f, rtol=1e-13)
    with pytest.raises(TypeError, match="component="):
        s.load_vector(flat)
    with pytest.raises(ValueError, match="from 0 to 1, got 2"):
        s.load_vector(flat, component=2)


def test_quadrilateral_cells():
    mesh = MeshQuad().refined(3).translated((-0.4, -0.45))
    s = solved(CellBasis(mesh, ElementQuad0()))
    basis = CellBasis(MeshTri().refined(2).translated((-0.4, -0.45)), ElementTriP1())
    f = s.load_vector(basis)
    found = [f.sum(), *(basis.doflocs @ f)]
    np.testing.assert_allclose(found, [1.0, 0.1, 0.05], atol=1e-13)


#: those of scikit-fem with scalar values
ELEMENTS = [
    name for name in dir(skfem) if re.match(r"Element(Tri|Quad)(?!RT|BDM|N\d|HHJ|DG|P$)", name)
]
DEAR = ["ElementQuadBFS", "ElementTriArgyris"]


@pytest.mark.parametrize("name", [*sorted({*ELEMENTS} - {*DEAR}), *slow(*DEAR)])
def test_uniform_pressure_on_any_element(name):
    """As scikit-fem integrates it: on the element, on vectors of it and without continuity."""
    of, mesh = getattr(skfem, name), MeshTri if "Tri" in name else MeshQuad
    structure = mesh.init_tensor(np.linspace(-1, 1, 3), np.linspace(-1, 1, 4))
    cells = CellBasis(rectangle(2), ElementTriP0())
    punch = RigidPunch(SOIL, cells, edge="constant")
    for element in (of(), ElementVector(of(), 3), skfem.ElementDG(of())):
        basis = CellBasis(structure, element, intorder=10)
        matrix = load_matrix(punch.partition, None, punch.fan, basis)
        load = LinearForm(lambda v, w: v if v.ndim == 2 else v[2])
        found = matrix @ np.ones(cells.mesh.nelements)
        np.testing.assert_allclose(found, load.assemble(basis), atol=1e-12)


def test_elements_of_high_degree():
    mesh = MeshQuad.init_tensor(*2 * [np.linspace(-0.4, 0.5, 4)])
    s = solved(CellBasis(mesh, ElementQuad0()))
    basis = CellBasis(mesh, ElementQuadP(5), intorder=10)
    f = s.load_vector(basis)
    low = s.load_vector(CellBasis(mesh, ElementQuad2()))
    for x in (lambda x: x[0] ** 2 * x[1], lambda x: x[1] ** 2 + x[0]):
        expected = low @ CellBasis(mesh, ElementQuad2()).project(x)
        assert f @ basis.project(x) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("side", [(0.0, 0.0), (0.4, 0.0), (0.0, 0.3)], ids=str)
def test_plate_elements_on_quadrilaterals(side):
    """Rectangles, where few values say all of the functions, parallelograms and trapezoids."""
    mesh = rectangle(4)
    grid = MeshQuad.init_tensor(np.linspace(-1, 1, 4), np.linspace(-1, 1, 3))
    for of in (mesh, grid):
        of.doflocs[0] += side[0] * of.p[1] + side[1] * of.p[0] * of.p[1]
    basis = CellBasis(grid, ElementQuadBFS(), intorder=12)
    punch = RigidPunch(SOIL, CellBasis(mesh, ElementTriP0()), edge="constant")
    found = load_matrix(punch.partition, None, punch.fan, basis) @ np.ones(mesh.nelements)
    np.testing.assert_allclose(found, unit_load.assemble(basis), atol=1e-12)


def test_plate_elements_on_rectangles_beside_the_origin_are_polynomials():
    """Whose coefficients are of the coordinates themselves and lose digits."""
    grid = MeshQuad.init_tensor(np.linspace(0, 5, 9), np.linspace(0, 2, 5))
    mesh = rectangle(4).scaled((1.0, 0.5)).translated((2.5, 1.0))
    basis = CellBasis(grid, ElementQuadBFS(), intorder=12)
    assert ShapeFunctions.of(basis, None)._polynomial
    s = RigidPunch(SOIL, CellBasis(mesh, ElementTriP0()), origin=(2.5, 1.0)).solve(2.0, (0.3, 0.1))
    load, arm = s.load_vector(basis), basis.zeros()
    deflection, slope = basis.nodal_dofs[:2]
    arm[deflection], arm[slope] = grid.p[0], 1.0
    assert load[deflection].sum() == pytest.approx(2.0, rel=1e-11)
    assert load @ arm == pytest.approx(2.0 * 2.8, rel=1e-11)


def test_what_does_not_cover_the_plan_is_told():
    mesh = rectangle(4)
    s = solved(DualMesh.from_mesh(mesh).basis())
    half = CellBasis(mesh.restrict(mesh.p[0, mesh.t].mean(axis=0) > 0), ElementTriP1())
    with pytest.raises(ValueError, match=r"2 of their area 4 lies outside \(50 %\)"):
        s.load_vector(half)
    assert 0.4 < s.load_vector(half, partial=True).sum() < 0.8
    beside = CellBasis(mesh.translated((9.0, 0.0)), ElementTriP1())
    assert not s.load_vector(beside, partial=True).any()
    twice = MeshTri(np.hstack([mesh.p, mesh.p]), np.hstack([mesh.t, mesh.t + mesh.p.shape[1]]))
    with pytest.raises(ValueError, match="more than once"):
        s.load_vector(CellBasis(twice, ElementTriP1()))
    with pytest.raises(ValueError, match="one plane z = const"):
        s.load_vector(FacetBasis(MeshTet(), ElementTetP1()))
    line = CellBasis(MeshLine(), ElementLineP1())
    with pytest.raises(TypeError, match="got CellBasis on a MeshLine1"):
        s.load_vector(line)
    with pytest.raises(TypeError, match="got FacetBasis"):
        s.load_vector(FacetBasis(mesh, ElementTriP1()))


def test_functions_of_another_mesh_are_told():
    """Plate elements keep functions from their first use: scikit-fem's bases are then wrong."""
    mesh = rectangle(4)
    s = solved(DualMesh.from_mesh(mesh).basis())
    element = ElementTriMorley()
    expected = s.load_vector(CellBasis(mesh, element))
    renumbered = MeshTri(mesh.p, mesh.t[:, ::-1])
    with pytest.raises(ValueError, match=r"kept from another mesh. .*ElementTriMorley\(\) anew"):
        s.load_vector(CellBasis(renumbered, element))
    with pytest.raises(ValueError, match="on the 8 elements of the mesh, got those of"):
        s.load_vector(CellBasis(rectangle(2), ElementVector(element)), component=1)
    found = s.load_vector(CellBasis(renumbered, ElementTriMorley()))
    assert np.sort(found) == pytest.approx(np.sort(expected), abs=1e-12)


def test_plate_elements_far_from_the_origin_are_told():
    """Forces would be off by 2e-3 there, and deflections of a raft by 8 %."""
    far = rectangle(4).translated((4.5e5, 5.4e6))
    s = RigidPunch(SOIL, DualMesh.from_mesh(far).basis(), origin=(4.5e5, 5.4e6)).solve(1.0)
    with pytest.raises(ValueError, match=r"far from the origin.* mesh\.translated to the origin"):
        s.load_vector(CellBasis(far, ElementTriMorley()))


@pytest.mark.parametrize(
    ("element", "at", "cells"),
    [
        (ElementTriMorley, (3e3, -1e3), 4),
        (ElementTriArgyris, (30.0, -10.0), 4),
        (ElementTriArgyris, (1.9, 0.0), 16),
    ],
)
def test_plate_elements_off_the_origin_carry_forces_to_rounding(element, at, cells):
    """Where functions of the coordinates themselves have half of their digits left."""
    mesh = rectangle(cells).translated(at)
    s = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), origin=at).solve(1.0, at=(0.1, 0.05))
    basis = CellBasis(mesh, element())
    f = s.load_vector(basis)[basis.nodal_dofs[0]]
    assert f.sum() == pytest.approx(1.0, abs=2e-11 if cells > 4 else 1e-12)


def test_far_from_the_origin(ring):
    """At site coordinates as at the origin."""
    far = ring.translated((4.5e5, 5.4e6))
    s = RigidPunch(SOIL, DualMesh.from_mesh(far).basis(), origin=(4.5e5, 5.4e6)).solve(1.0)
    f = s.load_vector(CellBasis(far.refined(), ElementTriP1()))
    x = far.refined().p - np.array([[4.5e5], [5.4e6]])
    np.testing.assert_allclose([f.sum(), *(x @ f)], [1.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("grid", ["basis", "primal_basis"])
def test_slivers_by_the_digits_of_a_file_carry_their_load(grid):
    """At the edge they have the root of their area of it: 2e-5 was lost; or they are refused."""
    mesh = generate.polygon([(0, 0), (1 / 3, 0), (1 / 3, 0.7), (0, 0.7)], n=60)
    cells = getattr(DualMesh.from_mesh(mesh), grid)()
    solution = RigidPunch(SOIL, cells, origin=(0.15, 0.4)).solve(1.0)

    def rounded(digits):
        p = np.vectorize(lambda x: float(f"{x:.{digits}g}"))(mesh.p)
        return Basis(MeshTri(p, mesh.t), ElementTriP1())

    for basis in map(rounded, (9, 10, 11)):
        load = solution.load_vector(basis)
        assert load.sum() == pytest.approx(1.0, rel=1e-14)
        np.testing.assert_allclose(basis.mesh.p @ load, [0.15, 0.4], rtol=1e-14)
    with pytest.raises(ValueError, match="lies outside"):
        solution.load_vector(rounded(8))


def test_cells_that_are_slivers_are_no_slivers_of_cells():
    """A row of them outside of the mesh of loads is less than all may lack, but whole cells."""
    x = np.linspace(0, 1, 5)
    thin = MeshTri.init_tensor(np.append(x, 1 + 5e-10), x)
    partition, fan = Partition.from_basis(b := CellBasis(thin, ElementTriP0())), Fan.from_basis(b)
    short = CellBasis(MeshTri.init_tensor(x, x), ElementTriP1())
    with pytest.raises(ValueError, match="lies outside"):
        load_matrix(partition, None, fan, short)
    part = load_matrix(partition, None, fan, short, partial=True)
    assert part.sum(axis=0).A1.sum() == pytest.approx(1.0, rel=1e-9)


def test_slivers_of_rounding_far_from_the_origin_are_no_load_left_out():
    """The line of contact cuts slivers off triangles: once 8e-6 of the force was lost."""
    site = np.array([4.5e5, 5.4e6])
    far = generate.rectangle(2.0, 1.3, n=120).translated(site)
    cells, shape = CellBasis(far, ElementTriP0()), Paraboloid(1.0, tuple(site))
    s = RigidPunch(SOIL, cells, gap=shape, origin=tuple(site)).solve(0.3, at=(0.05, 0.05))
    f = s.load_vector(CellBasis(far, ElementTriP1()))
    found = np.array([f.sum(), *((far.p - site[:, None]) @ f)])
    np.testing.assert_allclose(found, s.resultant, rtol=1e-9, atol=1e-9)


def test_constants_take_what_their_elements_carry():
    """Loads of elements are the sums of those of their parts."""
    s = solved(DualMesh.from_mesh(rectangle(5)).basis())
    coarse = MeshTri.init_tensor(np.linspace(-1.2, 1.2, 8), np.linspace(-1.2, 1.2, 6))
    fine = coarse.refined(2)
    parent = coarse.element_finder()(*fine.p[:, fine.t].mean(axis=1))
    found, parts = (s.load_vector(CellBasis(mesh, ElementTriP0())) for mesh in (coarse, fine))
    sums = np.bincount(parent, parts, coarse.nelements)
    assert found == pytest.approx(sums, abs=1e-13)


@pytest.mark.parametrize(
    "options",
    [{}, {"edge": "constant"}, {"gap": Paraboloid(3.0)}, {"gap": Paraboloid(300.0)}],
    ids=["flat", "constant", "line of contact", "over the edge"],
)
def test_the_matrix_of_what_a_solution_presses_with(options):
    """By the cells of the solution, as the guide has it: those of the punch have other laws where
    contact ends, and cells without slopes ended in an error."""
    punch = RigidPunch(
        HalfSpace(30e6, 0.3), DualMesh.from_mesh(generate.disc(n=200)).basis(), **options
    )
    solution = punch.solve(3e6, at=(0.1, 0.0))
    basis = CellBasis(MeshQuad().refined(4).scaled(2.4).translated((-1.2, -1.2)), ElementQuad1())
    under = solution.footprint
    matrix = load_matrix(under.partition, under.weights, under.fan, basis, moments=True)
    f, expected = under.with_slopes(matrix) @ solution.pressure, solution.load_vector(basis)
    assert f == pytest.approx(expected, abs=1e-12 * expected.max())
    assert f @ basis.doflocs[0] == pytest.approx(0.1 * 3e6, rel=1e-9)
