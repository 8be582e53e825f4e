from dataclasses import replace

import numpy as np
import pytest
from plans import disc, polar
from skfem import (
    CellBasis,
    Dofs,
    ElementQuad0,
    ElementQuad1,
    ElementTriP0,
    ElementTriP1,
    MeshQuad,
    MeshQuad2,
    MeshTet,
    MeshTri,
)

from skfem_dual import DualMesh, MeshError
from skfem_dual.grids.partition import Partition


@pytest.mark.parametrize("mesh", [disc(2), polar(4, 12), MeshTri.init_lshaped().refined(2)])
def test_ribs_of_a_mesh_bound_its_cells(mesh):
    partition = Partition.from_mesh(mesh)
    assert len(partition) == mesh.nelements
    a, b = partition.polygons.p[:, partition.facets].swapaxes(0, 1)
    cross = (a[0] * b[1] - a[1] * b[0]) / 2
    inner = partition.f2c[1] >= 0
    areas = np.bincount(partition.f2c[0], cross, len(partition))
    areas -= np.bincount(partition.f2c[1, inner], cross[inner], len(partition))
    assert areas == pytest.approx(partition.areas, rel=1e-10)
    assert partition.nodes == pytest.approx(partition.centroids)


def test_area_of_the_polar_grid():
    """Table 1: S / a^2 = 3.12869, the 40-gon."""
    assert Partition.from_mesh(polar()).areas.sum() == pytest.approx(3.12869, abs=5e-6)


def test_bases_of_constants_are_partitions():
    mesh = disc(2)
    dual = DualMesh.from_mesh(mesh)
    quads = MeshQuad().refined(2)
    for basis, n in (
        (dual.basis(), mesh.p.shape[1]),
        (dual.primal_basis(), mesh.nelements),
        (CellBasis(mesh, ElementTriP0()), mesh.nelements),
        (CellBasis(quads, ElementQuad0()), 16),
    ):
        assert len(Partition.from_basis(basis)) == n == basis.N
    assert Partition.from_basis(dual.primal_basis()).areas == pytest.approx(
        Partition.from_basis(CellBasis(mesh, ElementTriP0())).areas
    )


@pytest.mark.parametrize(
    ("basis", "message"),
    [
        (CellBasis(MeshTri(), ElementTriP1()), "got CellBasis of ElementTriP1"),
        (CellBasis(MeshQuad(), ElementQuad1()), "got CellBasis of ElementQuad1"),
        (CellBasis(MeshTri(), ElementTriP0()).boundary(), "got FacetBasis"),
        (MeshTri(), "got MeshTri1"),
        (None, "got NoneType"),
    ],
)
def test_other_bases_are_refused(basis, message):
    with pytest.raises(TypeError, match=message):
        Partition.from_basis(basis)


def test_parts_of_bases_are_refused():
    mesh = MeshTri().refined(2)
    for part in (
        CellBasis(mesh, ElementTriP0(), elements=[0, 1]),
        DualMesh.from_mesh(mesh).basis().with_elements([0, 1]),
    ):
        with pytest.raises(MeshError, match=r"got 2\. Remedy: restrict the mesh"):
            Partition.from_basis(part)


def test_gathered_numbering_is_refused():
    mesh = MeshTri()
    dofs = Dofs(mesh, ElementTriP0())
    dofs.interior_dofs = dofs.element_dofs = np.zeros((1, 2), dtype=np.int32)
    dofs.N = 1
    with pytest.raises(MeshError, match="one DOF for every cell"):
        Partition.from_basis(CellBasis(mesh, ElementTriP0(), dofs=dofs))


QUAD = np.array([[0, 1, 1, 0], [0, 0, 1, 1.0]])


@pytest.mark.parametrize(
    ("p", "t", "message"),
    [
        (QUAD, [0, 2, 1, 3], "convex quadrilaterals.*: 0"),
        (QUAD * [[1], [0]], [0, 1, 2, 3], "convex quadrilaterals"),
        (np.array([[0, 1, 0.2, 0], [0, 0, 0.2, 1]]), [0, 1, 2, 3], "convex quadrilaterals"),
        (QUAD * np.nan, [0, 1, 2, 3], "finite coordinates"),
    ],
)
def test_bad_quadrilaterals(p, t, message):
    with pytest.raises(MeshError, match=message):
        Partition.from_mesh(MeshQuad(p, np.array(t, dtype=np.int32)[:, None]))


def cut_in_four(grid, cell):
    """A grid with one of its cells in four, which the cells beside do not follow."""
    ring = grid.p[:, grid.t[:, cell]]
    middle, between = ring.mean(axis=1, keepdims=True), (ring + np.roll(ring, -1, axis=1)) / 2
    n, p = grid.p.shape[1], np.hstack([grid.p, middle, between])
    around, corner = n + 1 + np.arange(4), grid.t[:, cell]
    four = np.stack([corner, around, np.full(4, n), np.roll(around, 1)])
    return MeshQuad(p, np.hstack([np.delete(grid.t, cell, axis=1), four]).astype(np.int32))


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_hanging_nodes_of_quadrilaterals(angle):
    """The rim of the four cells was taken for an edge of the plan."""
    c, s = np.cos(angle), np.sin(angle)
    grid = MeshQuad.init_tensor(np.linspace(0, 2, 9), np.linspace(0, 2, 9))
    cell = int(np.argmin(np.hypot(*(grid.p[:, grid.t].mean(axis=1) - 0.9))))
    mesh = cut_in_four(grid, cell)
    mesh = MeshQuad(np.array([[c, -s], [s, c]]) @ mesh.p, mesh.t)
    n = grid.p.shape[1]
    with pytest.raises(MeshError, match=f"hanging nodes.*4 nodes.*: {n + 1}, {n + 2}, {n + 3}, "):
        Partition.from_mesh(mesh)
    # all cells in four are a grid again
    assert len(Partition.from_mesh(grid.refined())) == 256


@pytest.mark.parametrize("size", [1e-95, 1e-80, 1.0, 1e80, 1e95])
def test_quadrilaterals_of_any_size(size):
    """Products of two areas leave the range of numbers."""
    line = np.linspace(0, 1, 5) ** 1.2
    grid = MeshQuad.init_tensor(line, line)
    sheared = grid.p + np.array([[0.1], [0.0]]) * grid.p[1]  # no lattice
    assert len(Partition.from_mesh(MeshQuad(size * sheared, grid.t))) == 16


def test_quadrilaterals_on_top_of_each_other():
    grid = MeshQuad.init_tensor(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    inner = grid.interior_nodes()
    other = np.arange(grid.p.shape[1])
    other[inner] = len(other) + np.arange(len(inner))
    twice = MeshQuad(np.hstack([grid.p, grid.p[:, inner]]), np.hstack([grid.t, other[grid.t]]))
    with pytest.raises(MeshError, match="different sides of it; 16 facets"):
        Partition.from_mesh(twice)
    with pytest.raises(MeshError, match="different sides of it"):
        Partition.from_mesh(MeshQuad(QUAD, np.array([[0, 1, 2, 3]] * 2, dtype=np.int32).T))


def test_shared_middle_of_a_polar_grid():
    grid = polar(2, 8)
    middle = np.nonzero(np.hypot(*grid.p) < 1e-12)[0]
    t = np.where(np.isin(grid.t, middle), middle[0], grid.t)
    with pytest.raises(MeshError, match="its own node in the middle"):
        Partition.from_mesh(MeshQuad(grid.p, t).remove_unused_nodes())


@pytest.mark.parametrize(
    ("part", "message"),
    [
        ({"facets": [[0], [1]]}, r"facets of shape \(2, 9\), got \(2, 1\)"),
        ({"f2c": np.full((2, 9), 7)}, "f2c from -1 to 3, got 7 at index 0, 0"),
        ({"f2c": np.full((2, 9), -1)}, "a cell on the left of every rib.*rib 0 has none"),
        ({"nodes": np.full((2, 4), np.nan)}, "expected finite nodes, got nan"),
        ({"nodes": np.zeros((2, 3))}, r"nodes of shape \(2, 4\), got \(2, 3\)"),
        ({"boundary": [0.5] * 9}, "boundary as an array of integers"),
        ({"polygons": None}, "a Polygons for polygons"),
    ],
)
def test_partitions_by_hand(part, message):
    """They ended in an IndexError of the check that uses them."""
    cells = Partition.from_mesh(MeshTri.init_tensor(*[np.linspace(0, 1, n) for n in (3, 2)]))
    with pytest.raises((TypeError, MeshError), match=message):
        replace(cells, **part)


def test_other_meshes():
    with pytest.raises(MeshError, match="MeshQuad"):
        Partition.from_mesh(MeshQuad2())
    with pytest.raises(TypeError, match="MeshTet"):
        Partition.from_mesh(MeshTet())


def test_faults_of_triangles_are_found_here_too():
    mesh = MeshTri(QUAD, np.array([[0, 0], [1, 2], [2, 3]]))
    mesh.doflocs[0, 3] = np.nan
    with pytest.raises(MeshError, match="finite coordinates"):
        Partition.from_mesh(mesh)


def test_quadrilaterals_with_unused_nodes_are_refused():
    """What is drawn of contact would read memory that nothing was written to."""
    line = np.linspace(0.0, 1.0, 5)
    for bent in (0.0, 0.05):
        grid = MeshQuad.init_tensor(line, line)
        p = np.hstack([grid.p + bent * grid.p[::-1] ** 2, [[3.0], [3.0]]])
        with pytest.raises(MeshError, match="every node to belong to a quadrilateral; 1 node"):
            Partition.from_mesh(MeshQuad(p, grid.t))
