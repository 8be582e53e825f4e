import stat
import sys

import meshio
import numpy as np
import pytest
from plans import annulus, disc, polar
from skfem import CellBasis, ElementQuad0, ElementTriP0, ElementTriP1, MeshQuad, MeshTri

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    MeshError,
    MeshWarning,
    RigidPunch,
    RigidPunches,
)
from skfem_dual.grids import generate
from skfem_dual.grids.partition import Partition
from skfem_dual.grids.polygons import Polygons
from skfem_dual.io import (
    read_dual,
    read_mesh,
    read_polygons,
    read_substrate,
    write_dual,
    write_field,
    write_polygons,
    write_solution,
    write_whole,
)

MESH = MeshTri().refined(2)


def with_z(p, z):
    return np.vstack([p, np.broadcast_to(z, p.shape[1])]).T


@pytest.mark.parametrize("suffix", [".msh", ".vtk", ".vtu", ".xdmf", ".inp", ".mesh", ".off"])
def test_formats(tmp_path, suffix):
    path = tmp_path / f"plan{suffix}"
    file_format = {".msh": "gmsh"}.get(suffix)
    meshio.write(path, meshio.Mesh(with_z(MESH.p, 0.0), {"triangle": MESH.t.T}), file_format)
    found = read_mesh(path)
    assert type(found) is MeshTri
    assert found.p == pytest.approx(MESH.p, abs=1e-12)
    assert np.array_equal(found.t, MESH.t)
    assert len(DualMesh.from_mesh(found)) == MESH.p.shape[1]


@pytest.mark.parametrize("end", ["3.7", "3e5", "3abc", "3-1", "3,5", "3\n3 0 1 3"])
def test_off_files_are_read_to_their_end(tmp_path, end):
    """The reader would stop within the last number, and take what it has for a node."""
    path = tmp_path / "square.off"
    text = "OFF\n# of two triangles\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 "
    for sound in (text + "3\n\n", text + "3 # last", text.replace("3 0 2", "3\n0 2") + "3"):
        path.write_text(sound)
        assert read_mesh(path).nelements == 2
    path.write_text(text + end + "\n")
    with pytest.raises(MeshError, match="end with the last of 2 faces"):
        read_mesh(path)


def test_plane_in_space(tmp_path):
    path = tmp_path / "plan.vtu"
    meshio.write(path, meshio.Mesh(with_z(MESH.p, -1.5), {"triangle": MESH.t.T}))
    assert np.array_equal(read_mesh(path).p, MESH.p)
    meshio.write(path, meshio.Mesh(with_z(MESH.p, MESH.p[0] / 10), {"triangle": MESH.t.T}))
    with pytest.raises(MeshError, match=r"z runs from 0 to 0.1. Remedy"):
        read_mesh(path)
    meshio.write(path, meshio.Mesh(with_z(MESH.p, np.nan), {"triangle": MESH.t.T}))
    with pytest.raises(MeshError, match="plane"):
        read_mesh(path)


def test_tags_of_scikit_fem_survive(tmp_path):
    tagged = MESH.with_defaults().with_subdomains({"half": lambda x: x[0] < 0.5})
    path = tmp_path / "plan.vtu"
    tagged.save(path)
    found = read_mesh(path)
    assert set(found.boundaries) == {"left", "right", "bottom", "top"}
    assert np.array_equal(found.boundaries["left"], tagged.boundaries["left"])
    assert np.array_equal(found.subdomains["half"], tagged.subdomains["half"])


def test_groups_of_gmsh(request):
    found = read_mesh(request.path.parent / "data" / "eccentric_annulus.msh")
    assert set(found.boundaries) == {"edge", "hole"}
    assert set(found.subdomains) == {"footing"}
    radius = np.hypot(*found.p[:, found.facets[0, found.boundaries["edge"]]])
    assert radius == pytest.approx(1.0)


OLD_GMSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "edge"
1 2 "joint"
2 1 "raft"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
4
1 1 2 1 1 1 2
2 1 2 2 2 1 3
3 2 2 1 1 1 2 3
4 2 2 1 1 1 3 4
$EndElements
"""


@pytest.mark.parametrize("written", [None, "ascii", "binary"])
def test_groups_of_older_gmsh(tmp_path, written):
    """Numbers count anew in each dimension, lines inside of the plan are boundaries."""
    path = tmp_path / "plan.msh"
    path.write_text(OLD_GMSH)
    if written:
        again = meshio.gmsh.read(path)
        meshio.gmsh.write(path, again, "2.2", binary=written == "binary")
    found = read_mesh(path)
    assert {k: v.tolist() for k, v in found.subdomains.items()} == {"raft": [0, 1]}
    assert set(found.boundaries) == {"edge", "joint"}
    for name, ends in (("edge", [0, 1]), ("joint", [0, 2])):
        assert found.facets[:, found.boundaries[name]].T.tolist() == [ends]


def test_one_name_for_lines_and_areas(request, tmp_path):
    """Of which meshio keeps one."""
    path = tmp_path / "plan.msh"
    path.write_text(OLD_GMSH.replace('"raft"', '"edge"'))
    found = read_mesh(path)
    assert {k: v.tolist() for k, v in found.subdomains.items()} == {"edge": [0, 1]}
    assert set(found.boundaries) == {"edge", "joint"}
    text = (request.path.parent / "data" / "disc.msh").read_text()
    path.write_text(text.replace('"footing"', '"edge"'))
    newer = read_mesh(path)
    assert set(newer.boundaries) == set(newer.subdomains) == {"edge"}
    assert len(newer.boundaries["edge"]) == len(newer.boundary_facets())


def test_lines_that_a_group_has_twice_count_once(tmp_path):
    path = tmp_path / "plan.msh"
    twice = OLD_GMSH.replace("$Elements\n4", "$Elements\n5\n5 1 2 2 2 3 1")
    path.write_text(twice)
    assert len(read_mesh(path).boundaries["joint"]) == 1


def test_groups_of_gmsh_without_a_name(request, tmp_path):
    text = (request.path.parent / "data" / "disc.msh").read_text()
    path = tmp_path / "plan.msh"
    for kept, lost in (('1 1 "edge"', "2 of areas"), ('2 2 "footing"', "1 of lines")):
        path.write_text(text.replace('2\n1 1 "edge"\n2 2 "footing"', f"1\n{kept}"))
        with pytest.warns(MeshWarning, match=f"groups of cells without a name: {lost}. Remedy"):
            found = read_mesh(path)
        assert [*(found.boundaries or {}), *(found.subdomains or {})] == [kept.split('"')[1]]


def test_other_cells_are_named_and_left_out(tmp_path):
    path = tmp_path / "mixed.vtu"
    p = np.hstack([MESH.p, [[2.0, 3.0, 3.0, 2.0], [0.0, 0.0, 1.0, 1.0]]])
    tetra = MESH.p.shape[1] + np.arange(4)[None]
    cells = {"triangle": MESH.t.T, "tetra": tetra, "line": MESH.facets[:, :3].T}
    meshio.write(path, meshio.Mesh(with_z(p, 0.0), cells))
    with pytest.warns(MeshWarning) as caught:
        found = read_mesh(path)
    messages = [str(w.message) for w in caught]
    assert any("left out 1 tetra" in m for m in messages)
    assert any("4 points that belong to no triangle: 25, 26, 27, 28" in m for m in messages)
    assert np.array_equal(found.p, MESH.p)


def test_text_of_stl_does_not_overflow(tmp_path):
    """Where a binary file has the number of its triangles, it has letters."""
    path = tmp_path / "plan.stl"
    meshio.write(path, meshio.Mesh(with_z(MESH.p, 0.0), {"triangle": MESH.t.T}))
    assert read_mesh(path).t.shape == MESH.t.shape


def test_a_format_whose_package_is_missing(tmp_path, monkeypatch):
    path = tmp_path / "plan.xdmf"
    meshio.write(path, meshio.Mesh(with_z(MESH.p, 0.0), {"triangle": MESH.t.T}))
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MeshError, match=r"without h5py\. .* pip install 'skfem-dual\[hdf5\]'"):
        read_mesh(path)


def test_nothing_to_read(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_mesh(tmp_path / "none.msh")
    path = tmp_path / "broken.msh"
    path.write_text("not a mesh\n")
    with pytest.raises(MeshError, match=r"cannot read .*broken.msh"):
        read_mesh(path)
    path = tmp_path / "what.xyz123"
    path.write_text("not a mesh\n")
    with pytest.raises(MeshError, match="cannot read"):
        read_mesh(path)
    path = tmp_path / "tetra.vtu"
    meshio.write(path, meshio.Mesh(np.eye(4, 3), {"tetra": [[0, 1, 2, 3]]}))
    with pytest.raises(MeshError, match=r"expected triangles or quadrilaterals in .*got 1 tetra"):
        read_mesh(path)


def test_quadrilaterals_are_split_and_told(tmp_path):
    """A grid of rectangles and one kite, cut where the triangles are better; tags go along."""
    grid = MeshQuad.init_tensor(np.linspace(0, 2, 5), np.linspace(0, 1, 4)).with_defaults()
    grid = grid.with_subdomains({"half": lambda x: x[0] < 1.0})
    path = tmp_path / "grid.vtu"
    grid.save(path)
    with pytest.warns(MeshWarning) as caught:
        found = read_mesh(path)
    cut, lost = (str(w.message) for w in caught)
    assert "12 quadrilaterals are cut into two triangles each" in cut
    assert "left out the boundaries left, bottom, right, top" in lost
    assert found.nelements == 24
    assert Partition.from_mesh(found).areas == pytest.approx(2 / 24)
    assert len(found.subdomains["half"]) == 12
    assert found.p[0, found.t[:, found.subdomains["half"]]].max() == pytest.approx(1.0)
    assert found.boundaries is None
    kite = np.array([[0.0, 2.0, 2.5, 2.0], [0.0, -0.3, 0.0, 0.3], [0, 0, 0, 0]]).T
    meshio.write(path, meshio.Mesh(kite, {"quad": [[0, 1, 2, 3]]}))
    with pytest.warns(MeshWarning, match="1 quadrilaterals"):
        areas = Partition.from_mesh(read_mesh(path)).areas
    assert areas == pytest.approx([0.375, 0.375])  # not 0.6 and 0.15


def test_collapsed_quadrilaterals_are_triangles(tmp_path):
    """Corners at one place, as in the middle of polar grids, or twice the same."""
    path = tmp_path / "plan.vtu"
    grid = generate.polar(3, 8)
    MeshQuad(grid.p, grid.t).with_subdomains({"last": np.arange(7, 24)}).save(path)
    with pytest.warns(MeshWarning, match="24 .* into two triangles each, but 8 with sides of no"):
        found = read_mesh(path)
    assert found.t.shape == (3, 8 + 2 * 16)
    dual = DualMesh.from_mesh(found)
    assert (len(dual), dual.areas.sum()) == (25, pytest.approx(np.pi))
    assert found.subdomains["last"].tolist() == list(range(7, 40))

    p = with_z(np.array([[0, 1, 1, 0, 2, 2], [0, 0, 1, 1, 0, 1.0]]), 0.0)
    cells = [("line", [[1, 4]]), ("quad", [[1, 4, 5, 5], [0, 1, 2, 3], [1, 5, 2, 2]])]
    sets = {"right": [[], [0, 2]], "edge": [[0], []]}
    path = tmp_path / "plan.inp"
    meshio.write(path, meshio.Mesh(p, cells, cell_sets=sets))
    with pytest.warns(MeshWarning, match="but 2 with sides"):
        found = read_mesh(path)
    assert found.t.shape == (3, 4)
    corners = [sorted(found.t[:, k].tolist()) for k in found.subdomains["right"]]
    assert corners == [[1, 4, 5], [1, 2, 5]]
    assert found.facets[:, found.boundaries["edge"]].ravel().tolist() == [1, 4]


def test_quadrilaterals_are_kept_as_cells(tmp_path):
    grid = polar(4, 12).with_boundaries({"edge": lambda x: np.hypot(*x) > 0.9})
    path = tmp_path / "polar.vtu"
    grid.save(path)
    found = read_mesh(path, quads="keep")
    assert isinstance(found, MeshQuad)
    assert np.array_equal(found.t, grid.t)
    assert set(found.boundaries) == {"edge"}
    p = np.vstack([MESH.p, np.zeros(MESH.p.shape[1])]).T
    meshio.write(path, meshio.Mesh(p, {"triangle": MESH.t.T, "quad": [[0, 1, 2, 3]]}))
    with pytest.raises(MeshError, match=r'quadrilaterals only in .* Remedy: quads="split"'):
        read_mesh(path, quads="keep")


@pytest.mark.parametrize("kind", ["triangle6", "quad8"])
def test_corners_of_cells_of_second_order(tmp_path, kind):
    """Nodes on the sides are left out, which is told once."""
    linear = MESH if kind == "triangle6" else MeshQuad().refined(2)
    t = linear.t
    corners = range(len(t))
    middles = linear.p.shape[1] + linear.t2f
    if kind == "triangle6":  # facets of scikit-fem: 01, 12, 02
        assert np.array_equal(np.sort(linear.facets[:, linear.t2f[1]], 0), np.sort(t[1:], 0))
    p = np.hstack([linear.p, linear.p[:, linear.facets].mean(axis=1)])
    path = tmp_path / "second.vtu"
    meshio.write(path, meshio.Mesh(with_z(p, 0.0), {kind: np.vstack([t, middles]).T}))
    with pytest.warns(MeshWarning) as caught:
        found = read_mesh(path, quads="keep")
    (told,) = caught
    assert f"of {linear.nelements} {kind} the corners are kept" in str(told.message)
    assert np.array_equal(found.p, linear.p)
    assert np.array_equal(found.t[list(corners)], t)


def test_msh_by_content(tmp_path):
    """Ansys Fluent's meshes have the suffix of Gmsh's."""
    path = tmp_path / "fluent.msh"
    ansys = meshio.Mesh(MESH.p.T, {"triangle": MESH.t.T})
    meshio.write(path, ansys, file_format="ansys")
    found = read_mesh(path)
    assert np.array_equal(found.t, MESH.t)
    assert found.p == pytest.approx(MESH.p)


@pytest.mark.parametrize("mesh", [disc(2), annulus(3, 24), MeshTri.init_lshaped().refined(2)])
def test_dual_grids_come_back_unchanged(tmp_path, mesh):
    dual = DualMesh.from_mesh(mesh)
    path = tmp_path / "dual.vtu"
    write_dual(path, dual)
    again = read_dual(path)
    assert np.array_equal(again.mesh.p, dual.mesh.p)
    assert np.array_equal(again.mesh.t, np.sort(dual.mesh.t, axis=0))
    assert np.array_equal(again.p, dual.p)
    assert np.array_equal(again.polygons.indices, dual.polygons.indices)
    # any reader of VTU sees polygons with the cells' numbers
    blocks = meshio.read(path)
    assert {b.type for b in blocks.cells} == {"polygon"}
    numbers = np.concatenate(blocks.cell_data["cell"])
    assert np.array_equal(np.sort(numbers), np.arange(len(dual)))


@pytest.mark.parametrize("turned", [np.flipud, lambda t: np.roll(t, 1, axis=0), None])
def test_dual_grids_of_triangles_in_any_order_come_back(tmp_path, turned):
    """Where a cell's polygon begins is that of the order of nodes, of which files have none."""
    mesh = disc(3)
    t = MeshTri(mesh.p, mesh.t).oriented().t if turned is None else turned(mesh.t)
    dual, path = DualMesh.from_mesh(MeshTri(mesh.p, t, sort_t=False)), tmp_path / "dual.vtu"
    write_dual(path, dual)
    again = read_dual(path)
    assert np.array_equal(again.mesh.p, mesh.p)
    assert np.array_equal(again.mesh.t, np.sort(mesh.t, axis=0))
    assert again.areas == pytest.approx(dual.areas, rel=1e-14)


def test_solutions_come_back_unchanged(tmp_path):
    quads = CellBasis(polar(3, 8), ElementQuad0())
    for basis in (DualMesh.from_mesh(disc(2)).basis(), quads):
        solution = RigidPunch(HalfSpace(1.0, 0.2), basis).solve(1.0, at=(0.1, 0.2))
        path = tmp_path / "solution.vtu"
        write_solution(path, solution)
        polygons, cell_data, point_data = read_polygons(path)
        partition = solution.punch.partition
        assert np.array_equal(polygons.p, partition.polygons.p)
        assert np.array_equal(polygons.indices, partition.polygons.indices)
        assert np.array_equal(cell_data["pressure"], solution.pressure)
        assert cell_data["displacement"] == pytest.approx(
            solution.punch_displacement(partition.centroids)
        )
        assert np.array_equal(point_data["displacement"], solution.displacement(polygons.p))


def test_neighbours_are_written_together(tmp_path):
    mesh = disc(2)
    punches = [
        RigidPunch(HalfSpace(1.0, 0.2), DualMesh.from_mesh(mesh.translated((x, 0.0))).basis())
        for x in (0.0, 2.5)
    ]
    loads = {"force": 1.0}, {"force": 2.0, "at": (2.5, 0.1)}
    pair = RigidPunches(punches).solve(loads).solutions
    write_solution(tmp_path / "pair.vtu", *pair)
    polygons, cell_data, point_data = read_polygons(tmp_path / "pair.vtu")
    assert len(polygons) == 2 * len(punches[0].partition)
    forces = np.bincount(cell_data["footing"], cell_data["pressure"] * polygons.areas)
    assert forces == pytest.approx([1.0, 2.0])
    assert point_data["displacement"] == pytest.approx(pair[0].displacement(polygons.p))


@pytest.mark.parametrize(
    ("dual_cells", "edge", "at"),
    [
        (True, "singular", (0.1, 0.05)),
        (True, "singular", (0.6, 0.3)),
        (False, "singular", (0.4, -0.5)),
        (True, "constant", (0.6, 0.3)),
    ],
)
def test_integrals_over_a_file_have_force_and_moments(tmp_path, dual_cells, edge, at):
    """As ParaView and pyvista integrate them, far from the origin of coordinates too."""
    pyvista = pytest.importorskip("pyvista")
    middle = np.array([20.0, -7.0])
    dual = DualMesh.from_mesh(disc(3).translated(middle))
    basis = dual.basis() if dual_cells else CellBasis(dual.mesh, ElementTriP0())
    punch = RigidPunch(HalfSpace(1.0, 0.2), basis, edge=edge, origin=middle)
    solution = punch.solve(2.0, at)
    path = tmp_path / "punch.vtu"
    write_solution(path, solution)
    expected = 2.0 * np.array([1.0, *(middle + at)])
    found = pyvista.read(path).integrate_data()
    totals = [found["pressure"][0], *found["first_moments"][0, :2]]
    assert totals == pytest.approx(expected, rel=1e-12)
    polygons, data, _ = read_polygons(path)
    densities = np.column_stack([data["pressure"], data["first_moments"]])
    assert polygons.areas @ densities == pytest.approx([*expected, 0.0], rel=1e-12)


def test_data_must_fit(tmp_path):
    square = Polygons([[0, 1, 1, 0], [0, 0, 1, 1]], [0, 1, 2, 3], [0, 4])
    with pytest.raises(ValueError, match="expected 1 values of cell data 'p', got 2"):
        write_polygons(tmp_path / "x.vtu", square, {"p": np.zeros(2)})
    with pytest.raises(ValueError, match="expected 4 values of point data 'w', got 1"):
        write_polygons(tmp_path / "x.vtu", square, None, {"w": np.zeros(1)})
    with pytest.raises(ValueError, match="expected 1 values of cell data 'p', got 3"):
        write_polygons(tmp_path / "x.vtu", square, {"p": 3})
    with pytest.raises(ValueError, match='another name than "cell"'):
        write_polygons(tmp_path / "x.vtu", square, {"cell": [0]})
    for data, got in (
        ({"p": ["x"]}, "'p': an array of <U1"),
        ({"p": [1j]}, "'p': "),
        ({1: [0.0]}, "1: "),
    ):
        with pytest.raises(
            TypeError, match=f"real numbers by their names for cell_data, got {got}"
        ):
            write_polygons(tmp_path / "x.vtu", square, data)
    with pytest.raises(ValueError, match=r"1 numbers or vectors of cell data 's', got .*1, 3, 3"):
        write_polygons(tmp_path / "x.vtu", square, {"s": np.zeros((1, 3, 3))})
    masked = np.ma.masked_equal([0.0, 1.0, 2.0, 3.0], 2.0)
    with pytest.raises(ValueError, match="point data 'w' without masked values, got some"):
        write_polygons(tmp_path / "x.vtu", square, None, {"w": masked})
    with pytest.raises(ValueError, match="a name of data in one printed line, got ''"):
        write_polygons(tmp_path / "x.vtu", square, {"": [0.0]})
    with pytest.raises(TypeError, match="a Mapping for cell_data, got 3"):
        write_polygons(tmp_path / "x.vtu", square, 3)
    with pytest.raises(ValueError, match=r"ending in \.vtu"):
        write_polygons(tmp_path / "x.vtk", square)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["p < q", "a & b", 'the "real" p', "p > 0", "Δσ in µN/m²", "&lt;"]
)
def test_names_of_data_come_back(tmp_path, name):
    pyvista = pytest.importorskip("pyvista")
    path, triangles = tmp_path / "x.vtu", CellBasis(MESH, ElementTriP1())
    dual = DualMesh.from_mesh(MESH)
    write_polygons(path, dual.polygons, {name: dual.areas}, {name: dual.polygons.p[0]})
    _, cell_data, point_data = read_polygons(path)
    assert cell_data[name] == pytest.approx(dual.areas)
    assert name in point_data
    write_field(path, triangles, triangles.doflocs[0], name)
    assert name in pyvista.read(path).point_data
    write_field(path, dual.basis(), dual.areas, name)
    assert name in pyvista.read(path).cell_data


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        (3, TypeError, "text for the name of data, got 3"),
        ("", ValueError, "a name of data in one printed line, got ''"),
        ("p\n", ValueError, r"a name of data in one printed line, got 'p\\n'"),
    ],
)
def test_names_that_cannot_be_written(tmp_path, name, error, message):
    basis = CellBasis(MESH, ElementTriP1())
    with pytest.raises(error, match=message):
        write_field(tmp_path / "x.vtu", basis, basis.doflocs[0], name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", [np.float16, np.longdouble, np.float32, ">f8", bool, np.uint8])
def test_data_of_any_precision(tmp_path, kind):
    square = Polygons([[0, 1, 1, 0], [0, 0, 1, 1]], [0, 1, 2, 3], [0, 4])
    given = np.array([[1, 0, 0]], dtype=kind)
    write_polygons(tmp_path / "x.vtu", square, {"p": given})
    _, found, _ = read_polygons(tmp_path / "x.vtu")
    assert np.array_equal(found["p"], given)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (
            lambda path: write_dual(path, MESH),
            "expected a DualMesh for dual, got MeshTri1. Remedy",
        ),
        (lambda path: write_solution(path), "expected a PunchSolution for solution, got None"),
        (lambda path: write_solution(path, 1.0), "expected a PunchSolution for solution, got 1.0"),
        (
            lambda path: write_polygons(path, MESH),
            "expected a Polygons for polygons, got MeshTri1",
        ),
        (lambda path: write_field(path, MESH, []), "expected a CellBasis for basis, got MeshTri1"),
    ],
)
def test_only_what_has_such_a_file_is_written(tmp_path, write, message):
    with pytest.raises(TypeError, match=message):
        write(tmp_path / "x.vtu")
    assert list(tmp_path.iterdir()) == []


def test_files_of_others_are_refused(tmp_path):
    path = tmp_path / "x.vtu"
    MESH.save(path)
    with pytest.raises(MeshError, match="cell data 'cell'"):
        read_polygons(path)
    write_polygons(path, DualMesh.from_mesh(MESH).polygons)
    with pytest.raises(MeshError, match="expected cell data 'node'"):
        read_dual(path)
    partition = DualMesh.from_mesh(MESH).primal_partition
    write_polygons(path, partition.polygons, {"node": partition.nodes.T})
    with pytest.raises(MeshError, match="expected the 1-type dual of a triangulation"):
        read_dual(path)
    path.write_text("<VTKFile>")
    with pytest.raises(MeshError, match="cannot read"):
        read_polygons(path)
    with pytest.raises(FileNotFoundError):
        read_polygons(tmp_path / "none.vtu")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda mesh: mesh.cell_data["cell"][0].__setitem__(0, 99), "cells numbered from 0 to 24"),
        (lambda mesh: mesh.cells[0].data.__setitem__((0, 1), 10**6), "expected indices from 0 to"),
        (lambda mesh: mesh.cells[0].data.__setitem__((0, 1), -1), "expected indices from 0 to"),
        (lambda mesh: mesh.cell_data["node"][0].__setitem__((0, 0), np.nan), "two coordinates"),
    ],
)
def test_damaged_dual_grids(tmp_path, change, message):
    path = tmp_path / "dual.vtu"
    write_dual(path, DualMesh.from_mesh(MESH))
    mesh = meshio.read(path)
    change(mesh)
    meshio.write(path, mesh)
    with pytest.raises(MeshError, match=message):
        read_dual(path)


def test_names_of_libraries_end_in_small_letters(tmp_path):
    """By which they know formats; the file has the name asked for."""
    seen = []
    write_whole(tmp_path / "A.PNG", lambda part: seen.append(part[-4:]))
    assert seen == [".png"]
    assert [path.name for path in tmp_path.iterdir()] == ["A.PNG"]


def test_files_are_written_whole_or_not_at_all(tmp_path):
    path = tmp_path / "result.txt"
    path.write_text("old")

    def fails(part):
        with open(part, "w") as file:
            file.write("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_whole(path, fails)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    write_whole(path, lambda part: open(part, "w").close())
    assert path.read_text() == ""
    assert path.stat().st_mode & stat.S_IRUSR


def write(tmp_path, text):
    path = tmp_path / "ground.toml"
    path.write_text(text)
    return path


def test_grounds(tmp_path):
    base = "[base]\nyoung = 60e6\npoisson = 0.25\n"
    assert read_substrate(write(tmp_path, base)) == HalfSpace(60e6, 0.25)
    assert read_substrate(write(tmp_path, "\ufeff" + base)) == HalfSpace(60e6, 0.25)
    graded = read_substrate(write(tmp_path, base + "gradient = 0.5\n"))
    assert isinstance(graded, GradedHalfSpace)
    assert graded.influence(1.0) == pytest.approx(
        GradedHalfSpace.init_linear(60e6, 0.25, 0.5).influence(1.0)
    )
    layer = "[[layers]]\nthickness = 2\nyoung = 20e6\npoisson = 0.3\ngradient = 0.1\n"
    ground = read_substrate(write(tmp_path, layer + layer + base))
    assert ground.layers == (Layer(2.0, 20e6, 0.3, 0.1),) * 2
    assert ground.base == HalfSpace(60e6, 0.25)


BASE = "[base]\nyoung = 1.0\npoisson = 0.2\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("young = ", "expected TOML"),
        ("young = 1.0", r"expected a table \[base\] .* got young. Remedy"),
        ("", r"expected a table \[base\] .* got nothing"),
        ('base = "bonded"', "expected layers on the base 'bonded'"),
        ('base = "glued"\n[[layers]]\nthickness=1\nyoung=1\npoisson=0.2', "got 'glued'"),
        ("[base]\nyoung = 1.0", r"expected \['poisson'\] in base"),
        ("[base]\nyoung = 1.0\npoisson = 0.2\ndensity = 2.0", r"got \['density'\]"),
        ("layers = 3\n[base]\nyoung = 1.0\npoisson = 0.2", "layers = 3"),
        ("[base]\nyoung = -1.0\npoisson = 0.2", "positive Young's modulus"),
        ("base = 3", r'"bonded" or "smooth" as base in .*ground.toml, got 3'),
        ("base = ''", "as base in .*ground.toml, got ''"),
        (BASE + 'gradient = ""', "number for gradient in base of .*ground.toml.* got ''"),
        (BASE + "gradient = {}", "number for gradient in base of .*got {}"),
        (BASE + "gradient = false", "number for gradient in base of .*got False"),
        (BASE + "gradient = nan", "number for gradient in base of .*got nan"),
        (BASE + "gradient = 1e308", "number for gradient in base of .*got 1e.308"),
        (BASE + "gradient = 1e-310", "number for gradient in base of .*got 1e-310"),
        ("[base]\nyoung = true\npoisson = 0.2", "number for young in base of .*got True"),
        ("[base]\nyoung = 1\npoisson = [0.2]", r"number for poisson in base of .*got \[0.2\]"),
        (
            f"[base]\nyoung = {'9' * 400}\npoisson = 0.2",
            "young in base of .*an integer of 400 digits",
        ),
        (f"[base]\nyoung = 0x{'f' * 9000}\npoisson = 0.2", "young in base of .*10837 digits"),
        (f"[base]\nyoung = {'9' * 5000}\npoisson = 0.2", "expected TOML"),
        (f"base = {'[' * 9000}", "expected TOML"),
        (f"[[layers]]\nthickness = 1e-308\nyoung = 1\npoisson = 0.2\n{BASE}", "in layer 1 of"),
        (
            f"[[layers]]\nthickness=1\nyoung=1\npoisson=0.2\ngradient=-2\n{BASE}",
            "layer 1 of .*ground.toml: expected a positive Young's modulus at the bottom",
        ),
        ("[[layers]]\nyoung = 1.0\n[base]\nyoung = 1.0\npoisson = 0.2", "in layer 1 of"),
    ],
)
def test_bad_grounds(tmp_path, text, message):
    with pytest.raises((ValueError, TypeError), match=message):
        read_substrate(write(tmp_path, text))


def test_no_ground(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        read_substrate(tmp_path / "none.toml")


def test_groups_of_reversed_lines_in_one_block(tmp_path):
    """Their tags are negative, those of the others positive: one boundary."""
    path = tmp_path / "reversed.msh"
    path.write_text(
        '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 5 "edge"\n2 7 "plan"\n'
        "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n"
        "$Elements\n6\n1 1 2 5 1 1 2\n2 1 2 -5 2 3 2\n3 1 2 5 3 3 4\n4 1 2 -5 4 1 4\n"
        "5 2 2 7 1 1 2 3\n6 2 2 7 1 1 3 4\n$EndElements\n"
    )
    mesh = read_mesh(path)
    assert len(mesh.boundaries["edge"]) == 4
    assert len(mesh.subdomains["plan"]) == 2


MESH_22 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
5
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
5 .5 .5 0
$EndNodes
$Elements
4
1 2 2 0 1 1 2 {}
2 2 2 0 1 2 3 5
3 2 2 0 1 3 4 5
4 2 2 0 1 4 1 5
$EndElements
"""
MESH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Nodes
1 5 1 5
2 0 0 5
1
2
3
4
5
0 0 0
1 0 0
1 1 0
0 1 0
.5 .5 0
$EndNodes
$Elements
1 4 1 4
2 0 2 4
1 1 2 {}
2 2 3 5
3 3 4 5
4 4 1 5
$EndElements
"""


@pytest.mark.parametrize("text", [MESH_22, MESH_41])
def test_node_numbers_of_gmsh_begin_at_one(tmp_path, text):
    """meshio takes the last nodes for 0 and below: the mesh was complete."""
    path = tmp_path / "a.msh"
    path.write_text(text.format(5))
    assert read_mesh(path).nelements == 4
    for number in (0, -1):
        path.write_text(text.format(number))
        with pytest.raises(MeshError, match=rf"numbers from 1 in .*, got {number} in element 1\."):
            read_mesh(path)


def test_nodes_that_a_file_does_not_define(tmp_path):
    path = tmp_path / "a.inp"
    path.write_text(
        "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n*ELEMENT, TYPE=CPS3\n1, 1, 2, 9\n"
    )
    with pytest.raises(MeshError, match=r"names a node or a group that it does not define \(.*9"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("*ELSET,ELSET=W\n1,3\n", ""),
        ("*elset, elset=W, generate\n1,3,2\n", ""),
        ("*ELSET,ELSET=W\nA,B\n", "W"),
        ("*ELSET,ELSET=W\nA,3\n", "W"),
        ("*ELSET,ELSET=W\n1,2\n*ELSET,ELSET=W\n3\n", "W"),
        ("*ELSET,ELSET=S,GENERATE\n1,3,1\n*ELSET,ELSET=W\nS,1\n", "W"),
        ("*ELSET,ELSET=W\n1,2\n*Elset, elset=w\n3\n", "W"),
        ("*ELEMENT,TYPE=CPS3,ELSET=W\n4,1,5,2\n*ELEMENT,TYPE=CPS3,ELSET=W\n5,4,3,6\n", "W"),
    ],
)
def test_sets_of_abaqus_are_whole_or_left_out(tmp_path, lines, told):
    """Of sets of sets, and of sets that go on, a part was taken for the whole."""
    path = tmp_path / "a.inp"
    path.write_text(
        "*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,2,0\n6,2,1\n*ELEMENT,TYPE=CPS3,ELSET=A\n1,1,2,3\n"
        "2,1,3,4\n*ELEMENT,TYPE=CPS4,ELSET=B\n3,2,5,6,3\n" + lines
    )
    with pytest.warns(MeshWarning) as record:
        subdomains = read_mesh(path).subdomains
    assert subdomains["A"].tolist() == [0, 1]
    assert subdomains["B"].tolist() == [2, 3]
    left = [str(w.message) for w in record if "left out the sets" in str(w.message)]
    if told:
        assert told not in subdomains
        assert f"left out the sets {told}, " in left[0]
    else:
        assert subdomains["W"].tolist() == [0, 2, 3]
        assert not left


def test_layers_on_rock_in_files(tmp_path):
    """In the words of messages, which had led to themselves."""
    layer = "[[layers]]\nthickness = 2.0\nyoung = 30e3\npoisson = 0.3\n"
    path = tmp_path / "rock.toml"
    path.write_text(layer + 'base = "bonded"\n')
    with pytest.raises(ValueError, match=r'base = "bonded" as the first line .* one of a layer'):
        read_substrate(path)
    for word in ("bonded", "rigid"):
        path.write_text(f'base = "{word}"\n' + layer)
        assert read_substrate(path).base == "bonded"
    path = tmp_path / "rock.csv"
    for last, message in (("3,4e4,0.3", "rigid and empty cells"), ("rigid", "beside empty cells")):
        path.write_text("thickness,E,nu\n2,3e4,0.3\n" + last + "\n")
        with pytest.raises(ValueError, match=message):
            read_substrate(path)
    path.write_text("thickness,E,nu\n2,3e4,0.3\nrigid,,\n")
    assert read_substrate(path).base == "bonded"
