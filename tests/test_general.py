import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plans import annulus, disc, perturbed, rectangle
from skfem import MeshQuad, MeshTri
from skfem.generic_utils import OrientedBoundary

from skfem_dual import DualMesh, check_mesh
from skfem_dual.errors import MeshError
from skfem_dual.grids.checks import crossing_condition, triangulation_conditions
from skfem_dual.grids.corners import Corners, signed_areas
from skfem_dual.grids.general import (
    dual_nodes,
    facet_numbers,
    general_triangulation,
)
from skfem_dual.grids.preprocess import improve
from skfem_dual.grids.quality import smallest_angles

DIAGONALS = ["best", "rib", "facet"]


def invalid():
    """A square whose dual grid is not valid."""
    p = np.array([[0, 1, 1, 0, 0.06, 0.94, 0.5], [0, 0, 1, 1, 0.04, 0.02, 0.5]])
    t = [[0, 1, 5], [0, 5, 4], [4, 5, 6], [0, 4, 3], [4, 6, 3], [5, 1, 2], [5, 2, 6], [6, 2, 3]]
    return MeshTri(p, np.ascontiguousarray(np.array(t).T))


MESHES = {
    "one triangle": MeshTri.init_refdom,
    "square": lambda: rectangle(4),
    "disc": lambda: disc(3),
    "random": lambda: perturbed(rectangle(8), 0.05, seed=2),
    "re-entrant": lambda: MeshTri.init_lshaped().refined(2),
    "annulus": lambda: annulus(3, 24),
    "invalid": invalid,
}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]()


def area(mesh):
    return np.abs(signed_areas(mesh.p, mesh.t)).sum()


def ok(mesh):
    return all(c.ok for c in triangulation_conditions(Corners(mesh)))


@pytest.mark.parametrize("diagonal", DIAGONALS)
def test_nodes_counts_and_area(mesh, diagonal):
    general = general_triangulation(mesh, diagonal)
    n, m = mesh.p.shape[1], mesh.nelements
    boundary = mesh.boundary_facets()
    assert np.array_equal(general.p[:, :n], mesh.p)
    assert general.p[:, n : n + m] == pytest.approx(mesh.p[:, mesh.t].mean(axis=1))
    middles = mesh.p[:, mesh.facets[:, boundary]].mean(axis=1)
    assert general.p[:, n + m :] == pytest.approx(middles)
    assert general.nelements == 2 * mesh.nfacets
    assert len(general.boundary_facets()) == 2 * len(boundary)
    assert area(general) == pytest.approx(area(mesh), rel=1e-13)
    assert ok(general)


def test_diagonals(mesh):
    """Ribs become facets where they cross theirs; the best cut is the better of both."""
    general = {d: general_triangulation(mesh, d) for d in DIAGONALS}
    n = mesh.p.shape[1]
    inner = np.nonzero(mesh.f2t[1] != -1)[0]
    crossed = ~np.isin(inner, crossing_condition(Corners(mesh)).offending)
    ribs = n + mesh.f2t[:, inner]
    assert np.array_equal(facet_numbers(general["rib"], *ribs) >= 0, crossed)
    assert (facet_numbers(general["facet"], *mesh.facets[:, inner]) >= 0).all()
    angle = {
        d: smallest_angles(g.p, g.t).reshape(-1, 2).min(axis=1)[inner] for d, g in general.items()
    }
    assert angle["best"] == pytest.approx(np.maximum(angle["rib"], angle["facet"]))


def test_the_mesh_called_invalid_is_so():
    assert not check_mesh(invalid()).ok


@pytest.mark.parametrize("name", [name for name in MESHES if name != "invalid"])
def test_nodes_of_the_dual_grid(name):
    dual = DualMesh.from_mesh(MESHES[name]())
    general = general_triangulation(dual)
    assert general.p[:, dual_nodes(dual)] == pytest.approx(dual.p, abs=1e-15)
    assert np.array_equal(general.p[:, : len(dual)], dual.mesh.p)
    assert np.array_equal(general.t, general_triangulation(dual.mesh).t)


def test_tags_carry_over():
    mesh = MeshTri().refined(3).with_defaults().with_subdomains({"half": lambda x: x[0] < 0.5})
    inner = mesh.facets_satisfying(lambda x: np.isclose(x[1], 0.5), boundaries_only=False)
    ori = (mesh.p[1, mesh.t].mean(axis=0)[mesh.f2t[0, inner]] > 0.5).astype(int)
    plain = mesh.facets_satisfying(lambda x: np.isclose(x[0], 0.25), boundaries_only=False)
    mesh = mesh.with_boundaries(
        {"middle": OrientedBoundary(inner, ori), "plain": plain, "gmsh:x": plain}
    )
    general = general_triangulation(mesh, "rib")
    x = general.p[:, general.facets].mean(axis=1)
    for name, axis, at in (("left", 0, 0), ("right", 0, 1), ("bottom", 1, 0), ("top", 1, 1)):
        facets = general.boundaries[name]
        assert x[axis, facets] == pytest.approx(at)
        assert len(np.unique(facets)) == 2 * len(mesh.boundaries[name])
    assert x[0, general.boundaries["plain"]] == pytest.approx(0.25)
    assert len(general.boundaries["plain"]) == len(plain)
    assert not isinstance(general.boundaries["plain"], OrientedBoundary)
    assert "gmsh:x" not in general.boundaries
    half = general.subdomains["half"]
    assert (general.p[0][general.t[:, half]] <= 0.5 + 1e-12).all()
    assert np.abs(signed_areas(general.p, general.t))[half].sum() == pytest.approx(0.5)
    middle = general.boundaries["middle"]
    assert x[1, middle] == pytest.approx(0.5)
    sides = general.f2t[middle.ori, middle]
    assert (general.p[1, general.t[:, sides]].mean(axis=0) < 0.5).all()


def test_orientation_of_a_tagged_boundary():
    mesh = MeshTri().refined(2)
    outer = mesh.boundary_facets()
    tag = OrientedBoundary(outer, np.zeros(len(outer), dtype=int))
    found = general_triangulation(mesh.with_boundaries({"all": tag})).boundaries["all"]
    assert len(found) == 2 * len(outer)
    assert not found.ori.any()


def test_no_tags_stay_none():
    general = general_triangulation(disc(3))
    assert general.boundaries is None
    assert general.subdomains is None


def test_refinement():
    """Four times: away from the boundary angles stay, with `improve` at the boundary, too."""
    plain = improved = disc(2)
    for _ in range(4):
        plain = general_triangulation(plain)
        improved, _ = improve(general_triangulation(improved))
    assert check_mesh(plain).ok
    assert check_mesh(improved).ok
    assert area(plain) == pytest.approx(np.pi)
    angles = np.degrees(smallest_angles(plain.p, plain.t))
    middle = np.hypot(*plain.p[:, plain.t].mean(axis=1)) < 0.7
    assert angles[middle].min() > 30
    assert np.median(angles) > 45
    angles = np.degrees(smallest_angles(improved.p, improved.t))
    assert angles.min() > 15
    assert angles.mean() > 50


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.floats(0, 2 * np.pi), st.floats(0.01, 100), st.booleans())
def test_invariance(seed, turn, scale, mirror):
    """Moved, scaled, mirrored, renumbered: the same triangles."""
    rng = np.random.default_rng(seed)
    mesh = perturbed(rectangle(5), 0.06, seed)
    number = rng.permutation(mesh.p.shape[1])
    rotation = scale * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = rotation @ mesh.p + rng.uniform(-5, 5, (2, 1))
    if mirror:
        moved = moved[::-1]
    other = MeshTri(np.ascontiguousarray(moved[:, np.argsort(number)]), number[mesh.t])
    one, two = general_triangulation(mesh), general_triangulation(other)
    assert area(two) == pytest.approx(scale**2 * area(one), rel=1e-12)
    angles = [np.sort(smallest_angles(g.p, g.t)) for g in (one, two)]
    assert angles[0] == pytest.approx(angles[1], abs=1e-9)


def test_smallest_angles():
    p = np.array([[0.0, 1, 0, 0.5], [0, 0, 1, np.sqrt(0.75)]])
    t = np.array([[0, 0, 2], [1, 1, 0], [2, 3, 1]])
    assert np.degrees(smallest_angles(p, t)) == pytest.approx([45, 60, 45])


def test_wrong_arguments():
    with pytest.raises(ValueError, match=r'expected diagonal .* got "?\'?worst'):
        general_triangulation(MeshTri(), "worst")
    with pytest.raises(TypeError, match="expected a skfem MeshTri, got MeshQuad1"):
        general_triangulation(MeshQuad())
    with pytest.raises(MeshError, match="positive area"):
        general_triangulation(MeshTri(np.array([[0.0, 1, 2], [0, 0, 0]]), [[0], [1], [2]]))


@pytest.mark.parametrize("height", [1e-12, 3e-14])
def test_slivers_give_a_triangulation_or_are_refused(height):
    mesh = MeshTri().refined(2).scaled((1.0, height))
    if height < 1e-13:
        with pytest.raises(MeshError, match="thicker than rounding errors"):
            general_triangulation(mesh)
    else:
        general = general_triangulation(mesh)
        assert all(c.ok for c in triangulation_conditions(Corners(general)))
