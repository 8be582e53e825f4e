"""Fields at points, and carried over to other bases."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from plans import annulus, disc, perturbed, rectangle
from skfem import (
    CellBasis,
    ElementHex1,
    ElementLineP1,
    ElementQuad0,
    ElementQuad1,
    ElementQuad2,
    ElementQuadBFS,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    ElementTriRT0,
    ElementVector,
    Functional,
    MeshHex,
    MeshLine,
    MeshQuad,
    MeshQuad1DG,
    MeshQuad2,
    MeshTri,
    MeshTri1DG,
    MeshTri2,
)

from skfem_dual import (
    DualMesh,
    HalfSpace,
    InfluenceOperator,
    MeshError,
    RigidPunch,
    evaluate,
    flexible_settlement,
    transfer,
)
from skfem_dual.bodies.interface import require_facing
from skfem_dual.elements.balance import balanced, field_resultant
from skfem_dual.elements.shape_functions import ShapeFunctions
from skfem_dual.io import write_field

SQUARE = perturbed(rectangle(5), 0.1)
QUADRILATERALS = MeshQuad().refined(3).scaled(2.0).translated((-1.0, -1.0))


def plane(x):
    return 1 + 2 * x[0] - 3 * x[1]


@pytest.mark.parametrize(
    "basis",
    [
        CellBasis(SQUARE, ElementTriP1()),
        CellBasis(SQUARE, ElementTriP2()),
        CellBasis(SQUARE, ElementTriMorley()),
        CellBasis(QUADRILATERALS, ElementQuad1()),
    ],
)
def test_values_of_a_plane(basis):
    values = basis.project(plane)
    x = np.random.default_rng(0).uniform(-1, 1, (2, 4, 50))
    assert evaluate(basis, values, x) == pytest.approx(plane(x), abs=1e-12)


def test_points_on_the_boundary_are_inside_and_others_are_told():
    """On a circle turned by odd angles every point of the sides is met but for rounding."""
    mesh = disc(3)
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    mesh = MeshTri(turn @ mesh.p + [[100.0], [7.0]], mesh.t)
    basis = CellBasis(mesh, ElementTriP1())
    a, b = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]].swapaxes(0, 1)
    x = a[..., None] + np.linspace(0, 1, 11) * (b - a)[..., None]
    assert evaluate(basis, basis.doflocs[0], x) == pytest.approx(x[0], abs=1e-9)
    out = [[0.0], [0.0]]
    assert np.isnan(evaluate(basis, basis.doflocs[0], out)).all()
    assert evaluate(basis, basis.doflocs[0], out, outside="zero") == 0.0
    with pytest.raises(TypeError, match=r'"nan" or "zero", got 0\.0'):
        evaluate(basis, basis.doflocs[0], out, outside=0.0)
    with pytest.raises(ValueError, match="vector of shape"):
        evaluate(basis, basis.doflocs[0][1:], out)
    with pytest.raises(TypeError, match=r"a CellBasis for target, got .*Remedy: CellBasis\("):
        transfer(basis, basis.doflocs[0], mesh)
    with pytest.raises(TypeError, match="a scalar field, got one of ElementVector"):
        evaluate(CellBasis(mesh, ElementVector(ElementTriP1())), np.zeros(2 * basis.N), x)


def test_values_of_cells():
    dual = DualMesh.from_mesh(rectangle(4))
    numbers = np.arange(float(len(dual)))
    assert np.array_equal(evaluate(dual.basis(), numbers, dual.mesh.p), numbers)
    part = CellBasis(SQUARE, ElementTriP0(), elements=np.array([7, 3]))
    middle = SQUARE.p[:, SQUARE.t[:, [3, 7, 5]]].mean(axis=1)
    found = evaluate(part, np.arange(float(part.N)), middle)
    np.testing.assert_array_equal(found, [3.0, 7.0, np.nan])


@pytest.mark.parametrize(
    "target",
    [
        CellBasis(MeshTri().refined(4).scaled(3.0).translated((-1.4, -1.6)), ElementTriP1()),
        CellBasis(SQUARE, ElementTriP2()),
        CellBasis(MeshQuad().refined(3).scaled(3.0).translated((-1.4, -1.6)), ElementQuad2()),
    ],
)
def test_force_and_moments_go_along(target):
    basis = CellBasis(rectangle(6), ElementTriP1())
    values = np.random.default_rng(1).uniform(0, 1, basis.N)
    found = transfer(basis, values, target)
    expected = field_resultant(basis, values)
    assert field_resultant(target, found) == pytest.approx(expected, abs=1e-12)


def warped(n):
    """Quadrilaterals of the unit square that are no parallelograms."""
    mesh = MeshQuad().refined(n)
    x, inner = mesh.p.copy(), mesh.interior_nodes()
    x[:, inner] += 0.24 / 2**n * np.random.default_rng(0).uniform(-1, 1, (2, len(inner)))
    return MeshQuad(x, mesh.t)


@pytest.mark.parametrize("element", [ElementQuad1(), ElementQuad2()])
@pytest.mark.parametrize("intorder", [1, None, 8])
def test_planes_stay_planes_on_any_quadrilaterals(element, intorder):
    """Whatever the quadrature of the target."""
    source = CellBasis(MeshTri().refined(2), ElementTriP1())
    target = CellBasis(warped(2), element, intorder=intorder)
    found = transfer(source, plane(source.doflocs), target)
    assert found == pytest.approx(plane(target.doflocs), abs=1e-12)


@pytest.mark.parametrize("element", [ElementQuad1(), ElementQuad2()])
@pytest.mark.parametrize("scale", [1.0, 1.3])  # where the target is larger it has zeros beside
def test_force_and_moments_go_along_on_any_quadrilaterals(element, scale):
    rng = np.random.default_rng(2)
    source = CellBasis(warped(2), element)
    values = rng.uniform(0, 1, source.N)
    force, *moments = field_resultant(source, values)
    wide = MeshTri().refined(3).scaled(scale)
    cells = CellBasis(wide, ElementTriP0())
    areas = cells.dx.sum(axis=1)
    assert transfer(source, values, cells) @ areas == pytest.approx(force, rel=1e-13)
    for target in (CellBasis(wide, ElementTriP1()), CellBasis(warped(3).scaled(scale), element)):
        found = field_resultant(target, transfer(source, values, target))
        assert found == pytest.approx([force, *moments], rel=1e-12)


def test_fields_on_quadrilaterals_are_nearly_those_they_were():
    basis = CellBasis(warped(2), ElementQuad1())
    values = np.random.default_rng(3).uniform(0, 1, basis.N)
    assert transfer(basis, values, basis) == pytest.approx(values, abs=1e-6)


def test_a_refinement_takes_the_field_as_it_is():
    basis = CellBasis(SQUARE, ElementTriP1())
    values = np.random.default_rng(1).uniform(0, 1, basis.N)
    fine = CellBasis(SQUARE.refined(), ElementTriP2())
    found = transfer(basis, values, fine)
    assert found == pytest.approx(evaluate(basis, values, fine.doflocs), abs=1e-12)


def test_cells_take_means():
    """Of a plane the value in the centroid; the force is kept."""
    basis = CellBasis(QUADRILATERALS, ElementQuad1())
    dual = DualMesh.from_mesh(SQUARE)
    for cells in (dual.basis(), dual.primal_basis(), CellBasis(SQUARE, ElementTriP0())):
        found = transfer(basis, basis.project(plane), cells)
        assert found == pytest.approx(plane(cells.doflocs), abs=1e-12)


WIDE = rectangle(6).scaled(1.5).translated((0.1, -0.2))


@pytest.mark.parametrize(
    "cells",
    [
        DualMesh.from_mesh(WIDE).basis(),
        CellBasis(WIDE, ElementTriP0()),
        CellBasis(QUADRILATERALS.scaled(1.5), ElementQuad0()),
    ],
)
def test_cells_beyond_the_field_have_zeros(cells):
    basis = CellBasis(SQUARE, ElementTriP1())
    found = transfer(basis, basis.project(plane), cells)
    assert field_resultant(cells, found)[0] == pytest.approx(4.0, abs=1e-12)
    assert found[np.abs(cells.doflocs).max(axis=0) > 1.3] == pytest.approx(0.0)


@pytest.mark.parametrize(
    "small",
    [
        CellBasis(MeshTri().refined(2), ElementTriP1()),
        CellBasis(MeshTri().refined(2), ElementTriP0()),
        CellBasis(MeshQuad().refined(2), ElementQuad0()),
        DualMesh.from_mesh(MeshTri().refined(2)).basis(),
    ],
)
def test_a_target_that_is_too_small(small):
    basis = CellBasis(SQUARE, ElementTriP1())
    with pytest.raises(ValueError, match="3 of its area 4 lies outside"):
        transfer(basis, basis.doflocs[0], small)


def test_given_pressures_as_fields():
    """Settlements of the ground under what a punch exports are those of the punch."""
    dual, soil = DualMesh.from_mesh(disc(3)), HalfSpace(1.0, 0.25)
    solution = RigidPunch(soil, dual.basis()).solve(force=1.0)
    field, p = solution.pressure_field(refine=2)
    x = np.array([[0.0, 0.4, 3.0], [0.0, 0.2, 0.0]])
    expected = solution.displacement(x)
    assert flexible_settlement(soil, dual.basis(), (field, p), x) == pytest.approx(
        expected, rel=1.5e-2
    )
    assert flexible_settlement(soil, field, p, x) == pytest.approx(expected, rel=5e-3)
    cells = transfer(field, p, dual.basis())
    assert cells @ dual.areas == pytest.approx(1.0, abs=1e-12)
    operator = InfluenceOperator(soil, dual.basis())
    assert operator @ cells == pytest.approx(solution.settlement, rel=2e-2)


def test_points_of_any_shape_stand_in_forms():
    dual = DualMesh.from_mesh(annulus(3, 30))
    solution = RigidPunch(HalfSpace(1.0, 0.25), dual.basis()).solve(1.0, at=(0.1, 0.0))
    basis = CellBasis(dual.refinement, ElementTriP1(), intorder=12)
    force = Functional(lambda w: solution.pressure_at(w.x)).assemble(basis)
    assert force == pytest.approx(1.0, abs=0.03)  # Gauss points do not know the singularity
    x = np.random.default_rng(2).uniform(-1, 1, (2, 3, 4))
    for f in (solution.pressure_at, solution.displacement, solution.punch_displacement):
        assert np.array_equal(f(x), f(x.reshape(2, -1)).reshape(3, 4))
        assert f([0.7, 0.1]).shape == ()


def test_balanced_changes_little_and_keeps_zeros():
    basis = CellBasis(SQUARE, ElementTriP1())
    values = basis.doflocs[0].clip(0.0)
    wanted = field_resultant(basis, values, (0.2, 0.1)) * [1.1, 1.05, 1.0]
    found = balanced(basis, values, wanted, (0.2, 0.1))
    assert field_resultant(basis, found, (0.2, 0.1)) == pytest.approx(wanted, abs=1e-14)
    assert not found[values == 0].any()


def test_fields_in_files(tmp_path):
    dual = DualMesh.from_mesh(SQUARE)
    for basis, data, cells in (
        (CellBasis(SQUARE, ElementTriP1()), "point", "triangle"),
        (CellBasis(SQUARE, ElementTriP2()), "point", "triangle6"),
        (CellBasis(QUADRILATERALS, ElementQuad1()), "point", "quad"),
        (CellBasis(SQUARE, ElementTriP0()), "cell", "triangle"),
        (CellBasis(QUADRILATERALS, ElementQuad0()), "cell", "quad"),
        (dual.basis(), "cell", "polygon"),
    ):
        values = basis.project(plane)
        write_field(tmp_path / "field.vtu", basis, values, "p")
        found = meshio.read(tmp_path / "field.vtu")
        assert found.cells[0].type == cells
        if data == "point":
            assert found.point_data["p"] == pytest.approx(plane(found.points.T))
        elif cells != "polygon":
            middle = found.points[found.cells[0].data].mean(axis=1).T
            assert found.cell_data["p"][0] == pytest.approx(plane(middle))
        else:
            assert sorted(np.concatenate(found.cell_data["p"])) == pytest.approx(sorted(values))
    morley = CellBasis(SQUARE, ElementTriMorley())
    with pytest.raises(TypeError, match="ElementTriMorley"):
        write_field(tmp_path / "field.vtu", morley, np.zeros(morley.N))
    quads = MeshQuad2.from_mesh(QUADRILATERALS)
    bent = replace(quads, doflocs=quads.doflocs + 0.01 * np.sin(9 * quads.doflocs[::-1]))
    curved = CellBasis(bent, ElementQuad1())
    with pytest.raises(TypeError, match=r"cells are curved, got ElementQuad1 on a MeshQuad2"):
        write_field(tmp_path / "field.vtu", curved, np.zeros(curved.N))
    with pytest.raises(ValueError, match=r"\.vtu"):
        write_field(tmp_path / "field.vtk", dual.basis(), np.zeros(len(dual)))


def test_constants_on_curved_triangles_in_files(tmp_path):
    basis = CellBasis(MeshTri2.init_circle(2), ElementTriP0())
    write_field(tmp_path / "field.vtu", basis, np.arange(float(basis.N)), "p")
    found = meshio.read(tmp_path / "field.vtu")
    assert found.cells[0].type == "triangle6"
    assert np.hypot(*found.points[:, :2].T).max() == pytest.approx(1.0)
    assert found.cell_data["p"][0].tolist() == list(range(basis.N))


@pytest.mark.parametrize("element", [ElementTriP1(), ElementTriP2()])
def test_fields_on_curved_triangles_in_files(tmp_path, element):
    """Those of the first order were straightened: 4 % of the integral over a circle were lost."""
    basis = CellBasis(MeshTri2.init_circle(2), element, intorder=6)
    values = basis.doflocs[0] ** 2 + basis.doflocs[1]
    write_field(tmp_path / "field.vtu", basis, values, "p")
    found = meshio.read(tmp_path / "field.vtu")
    again = MeshTri2.load(tmp_path / "field.vtu")
    read = CellBasis(again, ElementTriP2(), intorder=6)
    at = {tuple(x): v for x, v in zip(found.points.tolist(), found.point_data["p"], strict=True)}
    nodes = np.array([at[*x, 0.0] for x in read.doflocs.T.tolist()])
    whole = [
        Functional(lambda w: w.u).assemble(own, u=own.interpolate(u))
        for own, u in ((basis, values), (read, nodes))
    ]
    assert whole[1] == pytest.approx(whole[0], rel=1e-12)


@pytest.mark.parametrize(
    "whole",
    [
        CellBasis(SQUARE, ElementTriP0()),
        CellBasis(SQUARE, ElementTriP1()),
        CellBasis(QUADRILATERALS, ElementQuad0()),
        DualMesh.from_mesh(SQUARE).basis(),
        DualMesh.from_mesh(SQUARE).primal_basis(),
    ],
)
def test_fields_on_some_elements_in_files(tmp_path, whole):
    left = whole.mesh.elements_satisfying(lambda x: x[0] < 0)[::-1]
    basis = whole.with_elements(left)
    values = np.arange(float(basis.N))
    write_field(tmp_path / "field.vtu", basis, values, "p")
    found = meshio.read(tmp_path / "field.vtu")
    written = np.sort(found.cells[0].data.T, axis=0)
    assert np.array_equal(written, np.sort(basis.mesh.t[:, left], axis=0))
    if not isinstance(basis.elem, ElementTriP1):
        assert np.array_equal(found.cell_data["p"][0], values[basis.element_dofs[0]])


@pytest.mark.parametrize("kind", [MeshTri1DG, MeshQuad1DG])
def test_fields_on_meshes_with_vertices_apart_in_files(tmp_path, kind):
    """They were written onto other places, as numbers of vertices are not those of places."""
    plain = MeshTri().refined(2) if kind is MeshTri1DG else MeshQuad().refined(2)
    mesh = kind.from_mesh(plain)
    constant = ElementTriP0() if kind is MeshTri1DG else ElementQuad0()
    linear = ElementTriP1() if kind is MeshTri1DG else ElementQuad1()
    for basis in (CellBasis(mesh, constant), CellBasis(mesh, linear)):
        values = basis.project(lambda x: 1 + x[0] + 2 * x[1])
        write_field(tmp_path / "f.vtu", basis, values)
        found = meshio.read(tmp_path / "f.vtu")
        p, (cells,) = found.points[:, :2].T, [block.data for block in found.cells]
        x, y = p[:, cells]
        areas = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
        assert areas == pytest.approx(1 / plain.nelements)
        if plain.nelements == basis.N:
            at, told = p[:, cells].mean(axis=2), found.cell_data["pressure"][0]
        else:
            at, told = p, found.point_data["pressure"]
        assert told == pytest.approx(1 + at[0] + 2 * at[1])
    higher = CellBasis(mesh, ElementTriP2() if kind is MeshTri1DG else ElementQuad2())
    with pytest.raises(TypeError, match=f"on a {kind.__name__}, got Element"):
        write_field(tmp_path / "f.vtu", higher, np.zeros(higher.N))


def bent(kind, mesh):
    """A mesh of second order whose sides bend, but whose elements keep their areas."""
    x = kind.from_mesh(mesh).doflocs.copy()
    x[0] += 0.15 * np.sin(3 * x[1])
    return kind(x, mesh.t)


@pytest.mark.parametrize(
    ("kind", "mesh", "element"),
    [(MeshTri2, MeshTri, ElementTriP2()), (MeshQuad2, MeshQuad, ElementQuad2())],
)
def test_fields_on_bent_elements_of_the_same_area_keep_force_and_moments(kind, mesh, element):
    basis = CellBasis(MeshTri().refined(3), ElementTriP1())
    x, y = basis.doflocs
    values = 1 + x - 2 * x * y
    lines = np.linspace(-0.5, 1.5, 9), np.linspace(-0.5, 1.5, 8)
    target = CellBasis(bent(kind, mesh.init_tensor(*lines)), element, intorder=8)
    found = field_resultant(target, transfer(basis, values, target))
    assert found == pytest.approx(field_resultant(basis, values), rel=1e-12)


def test_curved_elements_are_refused():
    """Their sides are not where those of their vertices are: part of the force would be lost."""
    curved = CellBasis(MeshTri2.init_circle(1), ElementTriP2())
    large = MeshTri().refined(3).scaled(2.4).translated((-1.2, -1.2))
    with pytest.raises(ValueError, match=r"straight sides, got elements 4, 5, .* of a MeshTri2"):
        transfer(curved, curved.ones(), CellBasis(large, ElementTriP1()))
    with pytest.raises(ValueError, match="straight sides"):
        evaluate(curved, curved.ones(), [[0.1], [0.2]])
    sheared = CellBasis(bent(MeshTri2, MeshTri().refined(2)), ElementTriP2())
    with pytest.raises(ValueError, match=r"straight sides, got elements 0, 1, .* of a MeshTri2"):
        evaluate(sheared, sheared.ones(), [[0.1], [0.2]])
    quarter = MeshTri2.from_mesh(large).doflocs.copy()
    dofs = MeshTri2.from_mesh(large).dofs.facet_dofs[0]
    quarter[:, dofs] += 0.1 * (large.p[:, large.facets[1]] - large.p[:, large.facets[0]])
    shifted = CellBasis(MeshTri2(quarter, large.t), ElementTriP2())
    assert evaluate(shifted, shifted.doflocs[0], [[0.1], [0.2]]) == pytest.approx(0.1)
    straight = CellBasis(MeshTri2.from_mesh(large), ElementTriP2())
    assert evaluate(straight, straight.doflocs[0], [[0.1], [0.2]]) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "basis", [CellBasis(MeshLine(), ElementLineP1()), CellBasis(MeshHex(), ElementHex1())]
)
def test_fields_in_files_are_plane(basis, tmp_path):
    with pytest.raises(TypeError, match="expected a mesh of triangles or quadrilaterals, got a"):
        write_field(tmp_path / "f.vtu", basis, np.ones(basis.N))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("element", "remedy"),
    [
        (ElementVector(ElementTriP1()), r"one of ElementVector. Remedy: .*basis.split"),
        (ElementVector(ElementTriP1(), 3), r"one of ElementVector. Remedy: .*basis.split"),
        (ElementTriP1() * ElementTriP2(), r"one of ElementComposite. Remedy: .*basis.split"),
        (ElementTriRT0(), r"one of ElementTriRT.$"),
    ],
)
def test_fields_that_are_not_scalar_are_refused(element, remedy):
    basis, scalar = CellBasis(SQUARE, element), CellBasis(SQUARE, ElementTriP1())
    cells = DualMesh.from_mesh(SQUARE).basis()
    for call in (
        lambda: evaluate(basis, basis.ones(), [[0.1], [0.2]]),
        lambda: transfer(basis, basis.ones(), scalar),
        lambda: transfer(scalar, scalar.ones(), basis),
        lambda: flexible_settlement(
            HalfSpace(1.0, 0.0), cells, (basis, basis.ones()), [[0.1], [0.2]]
        ),
    ):
        with pytest.raises(TypeError, match=remedy):
            call()


def test_functions_that_have_lost_their_digits_are_refused():
    """A force of 1200 became 2095; `evaluate` and `load_vector` refused these."""
    mesh = MeshQuad.init_tensor(np.linspace(-4, 4, 9), np.linspace(-3, 3, 7))
    near, far = (
        CellBasis(mesh.translated((at, -at)), ElementQuadBFS(), intorder=8) for at in (0.0, 300.0)
    )
    field = CellBasis(mesh.translated((300.0, -300.0)), ElementQuad1())
    with pytest.raises(ValueError, match="functions of ElementQuadBFS that are 1 in vertices"):
        transfer(field, field.doflocs[0], far)
    with pytest.raises(ValueError, match="functions of ElementQuadBFS that are 1 in vertices"):
        transfer(far, np.zeros(far.N), field)
    field = CellBasis(mesh, ElementQuad1())
    assert transfer(near, transfer(field, field.doflocs[0], near), field) == pytest.approx(
        field.doflocs[0], abs=1e-9
    )


def test_bases_that_do_not_know_where_their_dofs_are(tmp_path):
    mesh = MeshTri.init_tensor(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5))
    basis = CellBasis(mesh, ElementTriP1(), disable_doflocs=True)
    constant = CellBasis(mesh, ElementTriP0(), disable_doflocs=True)
    write_field(tmp_path / "f.vtu", constant, np.ones(constant.N))
    with pytest.raises(ValueError, match=r"knows where its DOFs are.*disable_doflocs"):
        write_field(tmp_path / "f.vtu", basis, np.zeros(basis.N))
    with pytest.raises(ValueError, match="a basis for structure that knows where its DOFs are"):
        require_facing(CellBasis(mesh, ElementTriMorley(), disable_doflocs=True), None)
    with pytest.raises(TypeError, match=r"expected a CellBasis on a 2-D mesh.*CompositeBasis"):
        ShapeFunctions.of(CellBasis(mesh, ElementTriP1()) * CellBasis(mesh, ElementTriP1()), None)


def test_targets_on_a_part_of_their_mesh():
    m = rectangle(6)
    half = np.nonzero(m.p[:, m.t].mean(axis=1)[0] < 0)[0]
    basis = CellBasis(m, ElementTriP1(), elements=half)
    found = transfer(basis, basis.doflocs[0], CellBasis(m, ElementTriP2(), elements=half))
    target = CellBasis(m, ElementTriP2())
    on = np.unique(target.element_dofs[:, half])
    assert found[on] == pytest.approx(target.doflocs[0, on], abs=1e-13)
    assert not np.delete(found, on).any()
    with pytest.raises(MeshError, match=r"expected a basis on all .* restrict the mesh"):
        transfer(basis, np.ones(basis.N), CellBasis(m, ElementTriP0(), elements=half))


SITE = (451204.7, 5411903.6)


def test_points_on_the_boundary_at_site_coordinates():
    m = disc(2).translated(SITE)
    f = m.boundary_facets()
    x = m.p[:, m.facets[:, f]].mean(axis=1)
    for basis in (CellBasis(m, ElementTriP1()), DualMesh.from_mesh(m).basis()):
        assert evaluate(basis, np.ones(basis.N), x) == pytest.approx(1.0, abs=1e-12)
    beside = x + 1e-3 * (x - m.p.mean(axis=1)[:, None])
    assert np.isnan(evaluate(basis, np.ones(basis.N), beside)).all()


@pytest.mark.parametrize("kind", ["nodes", "fine", "cells"])
def test_nothing_is_lost_at_site_coordinates(kind):
    m = disc(2).translated(SITE)
    dual = DualMesh.from_mesh(m)
    basis, target = {
        "nodes": (CellBasis(m, ElementTriP1()), CellBasis(m, ElementTriP1())),
        "fine": (CellBasis(m.refined(2), ElementTriP1()), CellBasis(m, ElementTriP1())),
        "cells": (dual.basis(), dual.primal_basis()),
    }[kind]
    values = np.random.default_rng(0).random(basis.N)
    found, middle = transfer(basis, values, target), np.array(SITE)[:, None, None]

    def loads(b, v):
        """Force and first moments."""
        planes = np.stack([np.ones(b.dx.shape), *(b.global_coordinates() - middle)])
        return np.sum(planes * np.asarray(b.interpolate(v)) * b.dx, axis=(1, 2))

    given = loads(basis, values)
    moments = slice(1 if kind == "cells" else 3)  # of means, only the force
    assert loads(target, found)[moments] == pytest.approx(given[moments], rel=1e-12, abs=1e-10)
    assert loads(target, found)[0] == pytest.approx(given[0], rel=1e-14)
    if kind == "nodes":
        assert found == pytest.approx(values, abs=1e-13)


@pytest.mark.parametrize("element", [ElementTriP1, ElementTriP2, ElementQuad1, ElementQuad2])
def test_meshes_with_vertices_apart_are_those_they_were_made_of(element):
    """Corners were looked up by numbers that are not those of places: -2.9 to 2.4 for 0 to 1.7."""
    kind = MeshTri if "Tri" in element.__name__ else MeshQuad
    plain = kind().refined(3)
    mesh = (MeshTri1DG if kind is MeshTri else MeshQuad1DG).from_mesh(plain)
    foot = MeshTri().refined(2).scaled(0.2).translated((0.4, 0.4))
    field = CellBasis(foot, ElementTriP1())
    punch = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(foot).basis(), origin=(0.5, 0.5))
    solution = punch.solve(1.0, at=(0.01, 0.0))
    apart, whole = CellBasis(mesh, element()), CellBasis(plain, element())
    values = transfer(field, field.ones(), whole)
    assert transfer(field, field.ones(), apart) == pytest.approx(values, abs=1e-12)
    assert transfer(apart, values, whole) == pytest.approx(values, abs=1e-12)
    x = np.random.default_rng(0).random((2, 50))
    assert evaluate(apart, values, x) == pytest.approx(evaluate(whole, values, x), abs=1e-12)
    assert solution.load_vector(apart) == pytest.approx(solution.load_vector(whole), abs=1e-14)
