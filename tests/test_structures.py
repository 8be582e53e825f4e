"""Files and pictures of structures on the ground: what is in them, against what was solved."""

import dataclasses
import re

import meshio
import numpy as np
import pytest
from elastic_shapes import SOIL, block, plate
from marks import slow
from scipy.sparse import block_diag, diags, identity
from skfem import (
    BilinearForm,
    CellBasis,
    ElementQuad0,
    ElementQuad2,
    ElementTetP1,
    ElementTetP2,
    ElementTriP2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshHex,
    MeshQuad,
    MeshQuad2,
    MeshTet,
    MeshTri,
)
from skfem.helpers import ddot, dot, grad, sym_grad
from skfem.io.meshio import HEX_MAPPING
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import (
    DualMesh,
    ElasticPunch,
    RigidPunch,
    bearing_pressure,
    vertical_profile,
)
from skfem_dual.elements.point_values import vertex_values
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import annulus, rectangle
from skfem_dual.grids.surroundings import surroundings
from skfem_dual.io import write_structure
from skfem_dual.io.structures import KINDS
from skfem_dual.report import figures, report_html, write_report
from skfem_dual.report.numbers import LoadedPlan
from skfem_dual.solutions.displaced import gap_at
from skfem_dual.visuals.matplotlib import isobars
from skfem_dual.visuals.pyvista import deformed
from skfem_dual.visuals.relief import Relief


@pytest.fixture(scope="module")
def raft():
    return plate()


@pytest.fixture(scope="module")
def cube():
    return block(tilt=0.5, height=3.0)


def test_a_free_solid_neither_slides_nor_turns():
    """Nothing resists that: its displacement is as symmetric as its load."""
    held = block(young=100.0, kind=MeshHex)
    punch = held.punch
    free = ElasticPunch(SOIL, punch.basis, punch.structure, punch.stiffness, boundary="base")
    solution = free.solve(held.f)
    assert solution.pressure == pytest.approx(held.pressure, rel=1e-8)
    mesh = punch.structure.mesh
    u = vertex_values(punch.structure, solution.displacement)
    size = np.abs(u).max()
    assert np.abs(u[:2]).max() > 1e-3 * size
    mirrored = np.lexsort(np.round(mesh.p * [[-1], [1], [1]], 9))
    same = np.lexsort(np.round(mesh.p, 9))
    assert u[:, same] == pytest.approx(u[:, mirrored] * [[-1], [1], [1]], abs=1e-9 * size)
    x, y = mesh.p[:2]
    for part in (u[0], u[1], x * u[1] - y * u[0]):
        assert abs(part.sum()) < 1e-9 * len(x) * size


def areas(p, t):
    a, b = p[:, t[1]] - p[:, t[0]], p[:, t[2]] - p[:, t[0]]
    return (a[0] * b[1] - a[1] * b[0]) / 2


@pytest.mark.parametrize("beyond", [0.01, 0.05, 0.5])
@pytest.mark.parametrize("mesh", [MeshTri.init_lshaped().refined(2), annulus(0.5, n=150)])
def test_surroundings_fill_what_the_plan_leaves(mesh, beyond):
    """Of narrow ones a part was missing, or all."""
    dual = DualMesh.from_mesh(mesh)
    p, t = surroundings(dual.basis().partition, Fan.from_basis(dual.basis()), beyond)
    extent = np.ptp(mesh.p, axis=1)
    assert np.ptp(p, axis=1) == pytest.approx(extent + 2 * beyond * extent.max())
    whole = np.prod(np.ptp(p, axis=1))
    assert (areas(p, t) > 0).all()
    assert areas(p, t).sum() + dual.areas.sum() == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("away", [2.0, 20.0, 1000.0])
def test_surroundings_are_as_fine_beside_small_parts_as_these(away):
    """Ground beside footings in a row was cut by the length of the row, 11 % off near them."""
    small = rectangle(1.0, 1.0, n=60)
    basis = DualMesh.from_mesh(small + small.translated((away, 0.3))).basis()
    p, t = surroundings(basis.partition, Fan.from_basis(basis), 0.5)
    whole = np.prod(np.ptp(p, axis=1))
    assert (areas(p, t) > 0).all()
    assert areas(p, t).sum() + 2.0 == pytest.approx(whole, rel=1e-9)
    assert t.shape[1] < 6000
    x = p[:, t].mean(axis=1)
    beside = np.abs(x - np.array([[away], [0.3]])).max(axis=0) < 0.8
    sides = np.hypot(*(p[:, t] - p[:, np.roll(t, 1, axis=0)]))[:, beside]
    assert beside.sum() > 100
    assert sides.max() < 0.35


def test_values_at_vertices():
    mesh = MeshTri().refined(2)
    basis = CellBasis(mesh, ElementTriP2())
    assert vertex_values(basis, basis.project(lambda x: x[0] * x[1])) == pytest.approx(
        mesh.p[0] * mesh.p[1], abs=1e-12
    )
    solid = MeshTet().refined(1)
    basis = CellBasis(solid, ElementVector(ElementTetP2()))
    u = basis.project(lambda x: np.array([x[1], x[2] ** 2, 1 + 0 * x[0]]))
    x, y, z = solid.p
    assert vertex_values(basis, u) == pytest.approx(np.array([y, z**2, 1 + 0 * x]), abs=1e-12)


def parts(path):
    """Points, displacements, and cell data with vertices by part and number."""
    mesh = meshio.read(path)
    data = {k: np.concatenate(v) for k, v in mesh.cell_data.items()}
    cells = [c for block in mesh.cells for c in block.data]
    return mesh.points.T, mesh.point_data["displacement"].T, data, cells


def test_plate_in_a_file(raft, tmp_path):
    path = tmp_path / "raft.vtu"
    write_structure(path, raft)
    p, moved, data, cells = parts(path)
    under = np.nonzero(data["part"] == 1)[0]
    order = under[np.argsort(data["cell"][under])]
    assert np.array_equal(data["pressure"][order], raft.pressure)
    assert np.array_equal(data["gap"][order], raft.gap)
    assert np.isnan(data["pressure"][data["part"] != 1]).all()
    corners = [p[:2, cells[i]] for i in order]
    shoelace = [0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() for x, y in corners]
    densities = np.column_stack([data["pressure"], data["first_moments"]])[order]
    force, *moments = raft.resultant
    moments += force * np.array(raft.punch.origin)
    assert np.abs(shoelace) @ densities == pytest.approx([force, *moments, 0.0], 1e-12, 1e-12)
    for part, settled in ((0, raft.deflection), (1, raft.ground_displacement)):
        points = np.unique(np.concatenate([cells[i] for i in np.nonzero(data["part"] == part)[0]]))
        assert -moved[2, points] == pytest.approx(settled(p[:2, points]), rel=1e-12)
    assert (moved[:2] == 0).all()
    t = raft.punch.structure.mesh.t.T
    assert [sorted(c.tolist()) for c in cells[: len(t)]] == np.sort(t).tolist()


def test_vertices_of_hexahedra_are_ordered_as_by_scikit_fem():
    assert KINDS[MeshHex][1] == HEX_MAPPING[:8]


@pytest.mark.parametrize("kind", [MeshTet, MeshHex])
def test_solid_in_a_file(kind, tmp_path):
    """A block too stiff to deform moves as a rigid body."""
    solution = block(kind=kind, height=3.0)
    path = tmp_path / "block.vtu"
    write_structure(path, solution)
    p, moved, data, cells = parts(path)
    solid = np.unique(np.concatenate([cells[i] for i in np.nonzero(data["part"] == 0)[0]]))
    w = -moved[2, solid]
    assert np.ptp(w) < 1e-4 * w.max()
    assert w == pytest.approx(solution.deflection([[0.0], [0.0]])[0], rel=1e-4)
    assert np.abs(moved[:2]).max() < 1e-4 * w.max()
    assert (p[2] >= 3.0).all()
    if kind is MeshHex:  # VTK wants the lower side first, turning anticlockwise as seen from above
        first = p[:, cells[0]]
        for corners in (first[:, :4], first[:, 4:]):
            centre = corners.mean(axis=1, keepdims=True)
            a, b = corners - centre, np.roll(corners, -1, axis=1) - centre
            assert (np.cross(a.T, b.T) @ (first[:, 4:].mean(1) - first[:, :4].mean(1)) > 0).all()


def upside_down(solution):
    """The same with z downwards."""
    punch = solution.punch
    mesh = MeshTet(punch.structure.mesh.p * [[1], [1], [-1]], punch.structure.mesh.t)
    mesh = mesh.with_boundaries(punch.structure.mesh.boundaries)
    basis = CellBasis(mesh, punch.structure.elem)
    flip = diags(np.where(punch.interface.settling == 0, 1.0, -1.0))
    turned = ElasticPunch(
        SOIL, punch.basis, basis, flip @ punch.stiffness @ flip, boundary="base", D=punch.D
    )
    return turned.solve(flip @ solution.f)


def test_a_solid_with_z_downwards_is_the_same(tmp_path):
    """Also if its walls bear a part of the load."""
    free = block(tilt=0.5, young=50.0, n=3)
    base = free.punch.structure
    held = base.get_dofs(lambda x: (x[0] < -0.99) & (x[2] > 0.9)).all()
    punch = dataclasses.replace(free.punch, D=held)
    found = [punch.solve(free.f)]
    found.append(upside_down(found[0]))
    assert found[0].vertical_reaction < -0.05 * found[0].force
    assert found[1].vertical_reaction == pytest.approx(found[0].vertical_reaction, rel=1e-9)
    assert found[1].pressure == pytest.approx(found[0].pressure, rel=1e-9)
    ps, us, reliefs = [], [], [Relief.of(solution) for solution in found]
    for solution in found:
        write_structure(tmp_path / "f.vtu", solution)
        p, moved, *_ = parts(tmp_path / "f.vtu")
        ps.append(p)
        us.append(moved)
    flip = np.array([[1], [1], [-1]])
    size = np.abs(us[0]).max()
    assert ps[1] == pytest.approx(flip * ps[0], abs=1e-12)
    assert us[1] == pytest.approx(flip * us[0], abs=1e-9 * size)
    for surface in ("structure", "ground"):
        one, other = (getattr(relief, surface).p for relief in reliefs)
        assert other == pytest.approx(flip * one, abs=1e-9)
    assert reliefs[1].edge[0] == pytest.approx(flip * reliefs[0].edge[0], abs=1e-9)


def test_the_displacement_of_several_fields_is_that_on_which_pressure_works(tmp_path):
    """Rotations come first here; z is downwards, as the component named is into the ground."""
    free = upside_down(block(young=50.0, n=3))
    mesh = free.punch.structure.mesh
    element = ElementVector(ElementTetP1())
    own = CellBasis(mesh, element)
    basis = CellBasis(mesh, element * element)
    K = linear_elasticity(*lame_parameters(50.0, 0.3)).assemble(own)
    rotations, u = basis.split_indices()
    both = block_diag([identity(own.N), K]).tocsr()
    order = np.empty(basis.N, int)
    order[np.append(rotations, u)] = np.arange(basis.N)
    f = np.zeros(basis.N)
    f[u] = LinearForm(lambda v, w: v[2]).assemble(FacetBasis(mesh, element, facets="top"))
    shared = {"boundary": "base", "stiffness": both[order][:, order]}
    solution = ElasticPunch(SOIL, free.punch.basis, basis, component=5, **shared).solve(f)
    assert solution.success
    write_structure(tmp_path / "f.vtu", solution)
    moved = parts(tmp_path / "f.vtu")[1]
    assert moved[:, : mesh.nvertices] == pytest.approx(
        solution.displacement[u][own.nodal_dofs], rel=1e-12
    )


def _of_second_order():
    mesh = MeshQuad.init_tensor(*2 * [np.linspace(-1, 1, 5)])
    return MeshQuad2.from_mesh(mesh), None, CellBasis(mesh, ElementQuad0())


def _on_a_part():
    """With vertices that no element has, before and after those of the structure."""
    mesh = MeshQuad.init_tensor(np.linspace(-3, 1, 9), np.linspace(-1, 1, 5))
    mesh = MeshQuad(np.hstack([mesh.p, [[9.0], [9.0]]]), mesh.t)
    mesh = mesh.with_subdomains({"raft": lambda x: x[0] > -1})
    return mesh, "raft", CellBasis(mesh.restrict("raft"), ElementQuad0())


@pytest.mark.parametrize("make", [_of_second_order, *slow(_on_a_part)])
def test_structures_on_any_mesh_by_their_vertices(make, tmp_path):
    mesh, elements, cells = make()
    basis = CellBasis(mesh, ElementQuad2() * ElementVector(ElementQuad2()), elements=elements)

    @BilinearForm
    def bending(u, r, v, s, _):
        return 0.1 * ddot(sym_grad(r), sym_grad(s)) + 10.0 * dot(grad(u) - r, grad(v) - s)

    @LinearForm
    def load(v, s, w):
        return (1 + w.x[0]) * v

    unused = np.setdiff1d(np.arange(basis.N), basis.element_dofs)
    punch = ElasticPunch(SOIL, cells, basis, bending.assemble(basis), D=unused)
    solution = punch.solve(load.assemble(basis))
    write_structure(tmp_path / "f.vtu", solution)
    p, moved, data, corners = parts(tmp_path / "f.vtu")
    under = np.unique(np.concatenate([c for c, k in zip(corners, data["part"]) if k == 0]))
    assert len(under) == 25
    assert (data["part"] == 0).sum() == 16
    assert np.isfinite(moved).all()
    assert -moved[2, under] == pytest.approx(solution.deflection(p[:2, under]), rel=1e-12)
    relief = Relief.of(solution)
    assert relief.displacement == pytest.approx(solution.deflection(relief.structure.p[:2]))


def test_solids_on_a_part_of_their_mesh_are_refused(cube):
    mesh = cube.punch.structure.mesh
    half = CellBasis(mesh, ElementVector(ElementTetP2()), elements=np.arange(20))
    with pytest.raises(TypeError, match=r"a basis on 20 of 384 elements of a MeshTet1\. Remedy"):
        dataclasses.replace(cube.punch, structure=half)


def test_file_refused(raft, tmp_path):
    with pytest.raises(ValueError, match=r"expected a file name ending in \.vtu"):
        write_structure(tmp_path / "raft.vtk", raft)
    with pytest.raises(TypeError, match="ElasticSolution"):
        write_structure(tmp_path / "raft.vtu", raft.punch)
    with pytest.raises(ValueError, match="beyond"):
        write_structure(tmp_path / "raft.vtu", raft, beyond=0.0)
    assert not list(tmp_path.iterdir())


def test_relief_of_a_plate(raft):
    relief = Relief.of(raft)
    p, scale = relief.structure.p, relief.scale
    assert p[2] == pytest.approx(-scale * raft.deflection(p[:2]), rel=1e-12)
    assert relief.displacement == pytest.approx(raft.deflection(p[:2]), rel=1e-12)
    assert 0.07 < scale * np.abs(relief.displacement).max() / 2 <= 0.2
    deeper = -relief.ground.p[2] / scale - raft.ground_displacement(relief.ground.p[:2])
    assert (deeper > 0).all()
    assert np.ptp(deeper) < 1e-12
    # the edge of contact lies on a circle, in the ground
    edge = np.hstack(relief.edge)
    assert np.hypot(*edge[:2]) == pytest.approx(np.sqrt(raft.contact_area / np.pi), rel=0.1)
    assert Relief.of(raft, 3.0).scale == 3.0


@pytest.mark.parametrize("given", ["function", "values"])
def test_a_gap_lifts_the_structure_off_the_ground(raft, tmp_path, given):
    """It was drawn sunk into the ground, also where it has lifted off."""

    def shape(x):
        return 0.3 * (x[0] ** 2 + x[1] ** 2)

    gap = shape if given == "function" else shape(raft.punch.collocation_points)
    solution = dataclasses.replace(raft.punch, gap=gap).solve(raft.f)
    write_structure(tmp_path / "raft.vtu", solution)
    p, moved, data, cells = parts(tmp_path / "raft.vtu")
    within = 1e-12 if given == "function" else 0.02
    under = np.unique(np.concatenate([c for c, k in zip(cells, data["part"]) if k == 0]))
    assert p[2, under] == pytest.approx(shape(p[:2, under]), abs=within)
    assert -moved[2, under] == pytest.approx(solution.deflection(p[:2, under]), rel=1e-12)
    relief = Relief.of(solution)
    x = relief.structure.p
    down = solution.deflection(x[:2]) - shape(x[:2])
    assert x[2] == pytest.approx(-relief.scale * down, abs=within * relief.scale)
    above = down - solution.ground_displacement(x[:2])
    assert above.max() < 0.05 * np.ptp(down)
    assert -above.min() == pytest.approx(solution.gap.max(), rel=0.3)


def test_a_gap_given_as_values_of_long_cells():
    """The nearest middles of long cells lie in a row: slopes across it were lost."""
    mesh = MeshQuad.init_tensor(np.linspace(0, 1, 5), np.linspace(0, 1, 25))
    cells = CellBasis(mesh, ElementQuad0())
    middles = mesh.p[:, mesh.t].mean(axis=1)
    punch = RigidPunch(SOIL, cells, gap=0.3 * middles[0] + 0.2 * middles[1] + 1)
    expected = 0.3 * mesh.p[0] + 0.2 * mesh.p[1] + 1
    assert gap_at(punch, mesh.p) == pytest.approx(expected, abs=1e-12)


def test_relief_of_a_solid(cube):
    relief = Relief.of(cube, 2.0)
    mesh = cube.punch.structure.mesh
    u = vertex_values(cube.punch.structure, cube.displacement)
    assert np.array_equal(relief.structure.p, mesh.p + 2 * u)
    assert len(relief.structure.faces) == 6 * 4 * 4 * 2
    assert relief.level == pytest.approx(3.0)
    assert (relief.ground.p[2] < 3.0).all()


@pytest.mark.slow
def test_deformed(raft, cube, tmp_path):
    for solution, show in ((raft, "displacement"), (cube, "pressure")):
        picture = deformed(solution, show=show, title="kPa" if show == "pressure" else None)
        picture.screenshot(tmp_path / "deformed.png")
        assert (tmp_path / "deformed.png").stat().st_size > 10_000
        image = picture.image
        assert len(np.unique(image.reshape(-1, 3), axis=0)) > 200
        picture.close()


def test_deformed_refuses(raft):
    with pytest.raises(TypeError, match="ElasticSolution"):
        deformed(raft.punch)
    with pytest.raises(ValueError, match="scale"):
        deformed(raft, scale=-1.0)
    with pytest.raises(ValueError, match="displacement"):
        deformed(raft, show="stress")


def test_isobars_and_notebooks(raft):
    import matplotlib.pyplot as plt

    ax = isobars(raft)
    assert ax.get_lines()  # the edge of contact
    page = raft._repr_html_()
    assert "Deflection" in page
    assert "data:image/png" in page
    plt.close("all")


def test_report(raft, tmp_path, request):
    assert figures.deflection_picture(raft, LoadedPlan(raft)).uri
    request.getfixturevalue("undrawn")
    path = tmp_path / "raft.html"
    write_report(path, raft, title="Raft 3", mesh_name="raft.msh")
    text = path.read_text(encoding="utf-8")
    assert "<h1>Raft 3</h1>" in text
    headings = re.findall(r"<h2>(.*?)</h2>", text)
    assert headings == [
        "Input",
        "Deflections",
        "Contact and pressure",
        "Bearing pressure",
        "Stress with depth",
        "Check of the equilibrium",
        "Solver",
    ]
    assert text.count("<figure>") == 4
    for word in ("Tilt", "Kern", "overturn", "rigid", "NOT CONVERGED"):
        assert word not in text
    values = [float(v) for v in re.findall(r'<data value="([^"]*)"', text)]
    radius = raft.punch.basis.dual.mesh.p[0].max()
    edge = raft.deflection([[0.999999 * radius], [0.0]])[0]
    deflections = raft.punch.trace @ raft.displacement
    for value in (deflections.max(), raft.contact_area, raft.force, raft.pressure.max()):
        assert value in values
    assert np.abs(np.array(values) - edge).min() < 1e-4 * abs(edge)


@pytest.mark.usefixtures("undrawn")
def test_report_says_what_was_asked_for(raft):
    """Pressures against an allowable one, deflections of points, stresses below one."""
    said = dict(allowable=1.01 * raft.mean_pressure, points=[(0.1, 0.2)], profile=(0.3, 0.0))
    text = report_html(raft, **said)
    values = [float(v) for v in re.findall(r'<data value="([^"]*)"', text)]
    extent = np.ptp(raft.punch.partition.polygons.p, axis=1).max()
    deep = vertical_profile(raft, (0.3, 0.0), [0.1 * extent])
    at = raft.deflection([[0.1], [0.2]])[0]
    for value in (bearing_pressure(raft), at, deep.stresses.sigma_z[0]):
        assert np.abs(np.array(values) - value).min() < 1e-7 * value
    assert "It is kept by the mean pressures, and exceeded by the largest pressure" in text
    with pytest.raises(ValueError, match=r"expected points on the plan, got \(3, 0\), 2.* off it"):
        report_html(raft, points=[(0, 0), (3, 0)])


@pytest.mark.usefixtures("undrawn")
def test_report_of_a_solid_and_of_no_solution(cube):
    text = report_html(cube)
    assert "Structure on elastic ground" in text
    assert "Largest reaction of the 3 DOFs held" in text
    failed = report_html(dataclasses.replace(cube, success=False, message="gave up"))
    assert "<h1>NOT CONVERGED: Structure on elastic ground</h1>" in failed
    assert "gave up" in failed
    with pytest.raises(TypeError, match=r"expected options of reports, .* got \['couple'\]"):
        report_html(cube, couple=cube)
