import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from plans import annulus, disc, perturbed, rectangle, two_holes, two_parts
from skfem import MeshTri
from skfem.generic_utils import OrientedBoundary

from skfem_dual import DualMesh, check_mesh
from skfem_dual.grids.corners import numbered, signed_areas
from skfem_dual.io import read_mesh

DATA = Path(__file__).parent / "data"


MESHES = {
    "one triangle": lambda: (MeshTri.init_refdom(), 1, 0),
    "square": lambda: (rectangle(6), 1, 0),
    "disc": lambda: (disc(3), 1, 0),
    "random": lambda: (perturbed(rectangle(8), 0.03), 1, 0),
    "re-entrant": lambda: (MeshTri.init_lshaped().refined(2), 1, 0),
    "annulus": lambda: (annulus(3, 24), 1, 1),
    "two parts": lambda: (two_parts(5.0), 2, 0),
    "two holes": lambda: (two_holes(), 1, 2),
    "adaptive": lambda: (MeshTri().refined(2).refined(np.array([3, 4, 11])), 1, 0),
    "Gmsh disc": lambda: (read_mesh(DATA / "disc.msh"), 1, 0),
    "Gmsh excised square": lambda: (read_mesh(DATA / "excised_square.msh"), 1, 0),
    "Gmsh annulus": lambda: (read_mesh(DATA / "eccentric_annulus.msh"), 1, 1),
}


@pytest.fixture(params=MESHES)
def case(request):
    mesh, parts, holes = MESHES[request.param]()
    return DualMesh.from_mesh(mesh), parts, holes


def test_counting_identities(case):
    """Section 2: N* = M + 2 N_b, L* = L + 2 N_b, M* = N, and (1) with holes."""
    dual, parts, holes = case
    mesh = dual.mesh
    n, ribs, cells = mesh.p.shape[1], mesh.nfacets, mesh.nelements
    nb = len(mesh.boundary_nodes())
    assert dual.nboundary == nb
    assert dual.topology == (parts, holes)
    assert dual.p.shape[1] == cells + 2 * nb
    assert dual.facets.shape[1] == ribs + 2 * nb
    assert len(dual) == n
    assert cells == 2 * (n - parts) - nb + 2 * holes
    assert pytest.approx(cells / n) == dual.K_TV


def test_cells_partition_the_domain(case):
    dual, *_ = case
    total = np.abs(signed_areas(dual.mesh.p, dual.mesh.t)).sum()
    assert dual.areas.sum() == pytest.approx(total, rel=1e-13)
    # every cell is the union of its triangles of the common refinement
    sub = np.abs(signed_areas(dual.refinement.p, dual.refinement.t))
    assert np.bincount(dual.refinement_cells, sub) == pytest.approx(dual.areas, rel=1e-12)
    assert np.bincount(np.arange(len(sub)) // 6, sub) == pytest.approx(
        np.abs(signed_areas(dual.mesh.p, dual.mesh.t)), rel=1e-12
    )


def test_ribs_bound_the_cells(case):
    """Left and right of every rib: the cells' areas and centroids from the ribs alone."""
    dual, *_ = case
    a, b = dual.p[:, dual.facets].swapaxes(0, 1)
    cross = (a[0] * b[1] - a[1] * b[0]) / 2
    n = len(dual)
    inner = dual.f2c[1] >= 0

    def total(values):
        return np.bincount(dual.f2c[0], values, n) - np.bincount(
            dual.f2c[1, inner], values[inner], n
        )

    areas = total(cross)
    assert areas == pytest.approx(dual.areas, rel=1e-10)
    for k in range(2):
        moment = total(cross * (a[k] + b[k]) / 3)
        assert moment / areas == pytest.approx(dual.centroids[k], abs=1e-10)


def test_corresponded_ribs_cross_inside_both(case):
    dual, *_ = case
    mesh = dual.mesh
    assert np.array_equal(dual.corresponded[: mesh.nfacets], np.arange(mesh.nfacets))
    assert (dual.corresponded[mesh.nfacets :] == -1).all()
    p, q = mesh.p[:, mesh.facets].swapaxes(0, 1)
    c, d = dual.p[:, dual.facets[:, : mesh.nfacets]].swapaxes(0, 1)
    for start, end in ((p, q), (c, d)):
        along, to = end - start, dual.crossings - start
        size = np.sum(along**2, axis=0)
        assert np.abs(along[0] * to[1] - along[1] * to[0]) == pytest.approx(0, abs=1e-12)
        s = np.sum(along * to, axis=0) / size
        inner = mesh.f2t[1] != -1
        assert ((s[inner] > 0) & (s[inner] < 1)).all()
        # on the boundary the rib ends in the middle of its facet
        assert ((s > -1e-12) & (s < 1 + 1e-12)).all()
    # the cells of a rib are those of the ends of its facet
    assert np.array_equal(np.sort(dual.f2c[:, : mesh.nfacets], axis=0), np.sort(mesh.facets, 0))


def test_each_node_lies_in_its_own_cell_only(case):
    dual, *_ = case
    from matplotlib.path import Path as Loop

    inner = dual.mesh.interior_nodes()
    for i in range(len(dual)):
        held = inner[Loop(dual.polygons[i].T).contains_points(dual.mesh.p[:, inner].T)]
        assert held.tolist() == ([i] if i in inner else [])
        if i not in inner:  # the boundary node is the first vertex of its polygon
            assert np.array_equal(dual.polygons[i][:, 0], dual.mesh.p[:, i])


def test_inner_cells_join_barycentres_directly():
    dual = DualMesh.from_mesh(disc(3))
    m = dual.mesh.nelements
    valence = np.bincount(dual.mesh.t.ravel())
    inner = dual.mesh.interior_nodes()
    assert np.array_equal(dual.polygons.sizes[inner], valence[inner])
    outer = dual.mesh.boundary_nodes()
    assert np.array_equal(dual.polygons.sizes[outer], valence[outer] + 3)
    for i in inner:
        loop = dual.polygons.indices[dual.polygons.offsets[i] : dual.polygons.offsets[i + 1]]
        assert (loop < m).all()
        assert (dual.mesh.t[:, loop] == i).any(axis=0).all()


@st.composite
def triangulations(draw):
    """A jittered grid with triangles taken out, numbered and turned at random."""
    nx, ny = draw(st.integers(2, 6)), draw(st.integers(2, 6))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    m = MeshTri.init_tensor(np.arange(nx + 1.0), np.arange(ny + 1.0))
    p = m.p + rng.uniform(-0.12, 0.12, m.p.shape)
    keep = rng.random(m.nelements) > draw(st.sampled_from([0.0, 0.1, 0.3]))
    assume(keep.any())
    t = m.t[:, keep]
    used, t = np.unique(t, return_inverse=True)
    t = t.reshape(3, -1)
    number = rng.permutation(len(used))
    p = p[:, used][:, np.argsort(number)]
    t = number[t][:, rng.permutation(t.shape[1])]
    turned = rng.random(t.shape[1]) < 0.5
    t[:, turned] = t[::-1, turned]
    return MeshTri(np.ascontiguousarray(p), np.ascontiguousarray(t), sort_t=False)


@settings(max_examples=60, deadline=None)
@given(triangulations())
def test_random_triangulations(mesh):
    assume(check_mesh(mesh).ok)  # parts that touch in one node are refused
    dual = DualMesh.from_mesh(mesh)
    parts, holes = dual.topology
    nb = len(mesh.boundary_nodes())
    assert mesh.nelements == 2 * (len(dual) - parts) - nb + 2 * holes
    area = np.abs(signed_areas(mesh.p, mesh.t)).sum()
    assert dual.areas.sum() == pytest.approx(area, rel=1e-13)
    # skfem's own sorting of the triangles changes nothing
    other = DualMesh.from_mesh(MeshTri(mesh.p, mesh.t))
    assert other.areas == pytest.approx(dual.areas, rel=1e-12)
    # each triangle holds its own barycentre as the one inner node of the dual grid
    assert np.array_equal(
        np.bincount(dual.polygons.indices[dual.polygons.indices < mesh.nelements]),
        np.full(mesh.nelements, 3),
    )


def test_renumbering_renumbers_the_cells():
    mesh = disc(3)
    rng = np.random.default_rng(0)
    number, order = rng.permutation(mesh.p.shape[1]), rng.permutation(mesh.nelements)
    dual = DualMesh.from_mesh(mesh)
    other = DualMesh.from_mesh(
        MeshTri(mesh.p[:, np.argsort(number)].copy(), number[mesh.t][:, order].copy())
    )
    assert other.areas[number] == pytest.approx(dual.areas, rel=1e-14)
    assert other.centroids[:, number] == pytest.approx(dual.centroids, abs=1e-14)


def test_the_mesh_may_be_changed_afterwards():
    mesh = MeshTri().refined(2)
    dual = DualMesh.from_mesh(mesh)
    before = dual.p.copy()
    mesh.p[:] = 0.0
    assert np.array_equal(dual.p, before)
    assert dual.mesh.p.max() == 1.0
    assert not dual.mesh.t.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        dual.mesh.p[0, 0] = 1.0


def test_tags_carry_over_to_the_refinement():
    mesh = MeshTri().refined(2).with_defaults().with_subdomains({"half": lambda x: x[0] < 0.5})
    inner = mesh.facets_satisfying(lambda x: np.isclose(x[0], 0.5), boundaries_only=False)
    ori = (mesh.p[0][mesh.t].mean(axis=0)[mesh.f2t[0, inner]] > 0.5).astype(np.int32)
    mesh = mesh.with_boundaries({"middle": OrientedBoundary(inner, ori)})
    refinement = DualMesh.from_mesh(mesh).refinement
    x = refinement.p[:, refinement.facets].mean(axis=1)
    assert len(refinement.boundaries["left"]) == 2 * len(mesh.boundaries["left"])
    assert x[0, refinement.boundaries["left"]] == pytest.approx(0)
    assert (refinement.p[0, refinement.t[:, refinement.subdomains["half"]]] <= 0.5 + 1e-12).all()
    assert len(refinement.subdomains["half"]) == 6 * len(mesh.subdomains["half"])
    middle = refinement.boundaries["middle"]
    assert x[0, middle] == pytest.approx(0.5)
    sides = refinement.f2t[middle.ori, middle]
    assert (refinement.p[0, refinement.t[:, sides]].mean(axis=0) < 0.5).all()


def test_tags_of_plain_boundaries_stay_plain():
    mesh = MeshTri().refined(1).with_boundaries({"left": lambda x: x[0] < 0.1})
    tag = DualMesh.from_mesh(mesh).refinement.boundaries["left"]
    assert not isinstance(tag, OrientedBoundary)


def test_refined_meshes_have_duals():
    mesh = MeshTri.init_lshaped().refined(1)
    for marked in ([0, 5], [2, 9, 17]):
        mesh = mesh.refined(np.array(marked))
        dual = DualMesh.from_mesh(mesh)
        assert dual.areas.sum() == pytest.approx(3.0)
    assert len(DualMesh.from_mesh(mesh.refined(2))) > len(dual)


def test_pickle_and_census():
    dual = DualMesh.from_mesh(disc(3))
    again = pickle.loads(pickle.dumps(dual))
    assert np.array_equal(again.p, dual.p)
    for array in (again.p, again.facets, again.mesh.p, again.mesh.t, again.mesh.facets):
        assert not array.flags.writeable
    assert "K_TV = 1.77" in repr(dual)
    assert "145" in repr(again)


def test_a_hub_of_many_triangles():
    n = 20000
    angle = 2 * np.pi * np.arange(n) / n
    p = np.hstack([[[0.0], [0.0]], [np.cos(angle), np.sin(angle)]])
    t = np.stack([np.zeros(n), 1 + np.arange(n), 1 + (np.arange(n) + 1) % n]).astype(np.int32)
    dual = DualMesh.from_mesh(MeshTri(p, t))
    assert dual.polygons.sizes[0] == n
    assert dual.areas.sum() == pytest.approx(n / 2 * np.sin(2 * np.pi / n))


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.integers(3, 30), st.integers(1, 60))
def test_facets_are_numbered_as_skfem_does(seed, n, m):
    """Also of triangles that share facets with several others, or all nodes."""
    t = np.random.default_rng(seed).permuted(np.tile(np.arange(n), (m, 1)), axis=1)[:, :3].T
    expected = MeshTri(np.zeros((2, n)), np.ascontiguousarray(t))
    mesh = numbered(MeshTri(expected.p, expected.t))
    for name in ("facets", "t2f", "f2t"):
        assert np.array_equal(getattr(mesh, name), getattr(expected, name))
