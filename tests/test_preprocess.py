import warnings
from itertools import islice

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from marks import slow
from plans import annulus, disc
from scipy.spatial import Delaunay
from skfem import MeshQuad, MeshTri
from skfem.generic_utils import OrientedBoundary

from skfem_dual import DualMesh, check_mesh
from skfem_dual.errors import ConvergenceWarning, MeshError
from skfem_dual.grids import generate, relocation
from skfem_dual.grids.checks import triangulation_conditions
from skfem_dual.grids.corners import Corners, signed_areas
from skfem_dual.grids.flips import flipped
from skfem_dual.grids.general import lasting_facets
from skfem_dual.grids.preprocess import Quality, improve, relocate, repair
from skfem_dual.grids.quality import smallest_angles

AREAS = {"square": 4.0, "disc": np.pi, "L": 3.0}


def outline(kind, h):
    """Points on a boundary, about ``h`` apart; the corners alone if ``h`` is large."""
    if kind == "disc":
        angle = np.linspace(0, 2 * np.pi, max(6, round(2 * np.pi / h)), endpoint=False)
        return np.stack([np.cos(angle), np.sin(angle)])
    corners = [[-1, 1, 1, -1], [-1, -1, 1, 1]]
    if kind == "L":
        corners = [[-1, 1, 1, 0, 0, -1], [-1, -1, 0, 0, 1, 1]]
    corners = np.array(corners, dtype=float)
    sides = np.roll(corners, -1, axis=1) - corners
    parts = np.maximum(1, np.round(np.hypot(*sides) / h)).astype(int)
    return np.hstack(
        [a[:, None] + s[:, None] * np.arange(k) / k for a, s, k in zip(corners.T, sides.T, parts)]
    )


def random_mesh(seed, spacing=1.0):
    """Delaunay's triangulation of 50 to 400 random points and of points on the boundary."""
    rng = np.random.default_rng(seed)
    kind, n = ("square", "disc", "L")[seed % 3], int(rng.integers(50, 401))
    x = rng.uniform(-1, 1, (2, 5 * n))
    notch = (x > 0).all(axis=0) & (kind == "L")
    x = x[:, ~notch & ((np.hypot(*x) < 0.999) | (kind != "disc"))][:, :n]
    p = np.hstack([outline(kind, spacing * np.sqrt(1.15 * AREAS[kind] / n)), x])
    t = Delaunay(p.T).simplices.T
    middle = p[:, t].mean(axis=1)
    inside = ~((middle > 0).all(axis=0) & (kind == "L"))
    full = np.abs(signed_areas(p, t)) > 1e-10
    return MeshTri(p, np.ascontiguousarray(t[:, inside & full])).remove_unused_nodes()


def is_triangulation(mesh):
    return all(c.ok for c in triangulation_conditions(Corners(mesh)))


def area(mesh):
    return np.abs(signed_areas(mesh.p, mesh.t)).sum()


def spoilt(mesh, seed, rounds=2):
    """The mesh with random facets flipped."""
    rng = np.random.default_rng(seed)
    for _ in range(rounds):
        used, t = np.zeros(mesh.nelements, dtype=bool), mesh.t.copy()
        for f in rng.permutation(np.nonzero(~lasting_facets(mesh))[0])[: mesh.nfacets // 8]:
            left, right = mesh.f2t[:, f]
            a, b = mesh.facets[:, f]
            c, d = mesh.t[:, left].sum() - a - b, mesh.t[:, right].sum() - a - b
            new = np.array([[c, c], [d, d], [a, b]])
            turn = signed_areas(mesh.p, new)
            size = area(mesh) / mesh.nelements
            convex = turn[0] * turn[1] < 0 and np.abs(turn).min() > 0.02 * size
            if convex and not used[[left, right]].any():
                t[:, [left, right]] = new
                used[[left, right]] = True
        mesh = MeshTri(mesh.p, t)
    return mesh


def tight():
    """A mesh with few boundary nodes, and an inner node so fixed that the means flip triangles."""
    mesh = random_mesh(1, spacing=30.0)
    return mesh, mesh.interior_nodes()[:1]


MESHES = {
    "disc": lambda: disc(3),
    "graded": lambda: disc(3, graded=True),
    "annulus": lambda: annulus(3, 24),
    "random": lambda: random_mesh(4),
    "hull": lambda: random_mesh(1, spacing=30),
    "re-entrant": lambda: random_mesh(2),
}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]()


def cells_missed(mesh):
    """Distance of the inner nodes to the centroids of their dual cells over the cells' size."""
    dual = DualMesh.from_mesh(mesh)
    inner = mesh.interior_nodes()
    away = np.hypot(*(dual.centroids - mesh.p)) / np.sqrt(dual.areas)
    return away[inner].max()


def test_means(mesh):
    moved, report = relocate(mesh)
    assert report.success
    assert report.iterations == 1
    assert report.after.from_means < 1e-10
    a, b = moved.facets
    ends, others = np.append(a, b), np.append(b, a)
    means = np.stack([np.bincount(ends, x[others]) for x in moved.p]) / np.bincount(ends)
    inner = mesh.interior_nodes()
    assert moved.p[:, inner] == pytest.approx(means[:, inner], abs=1e-13)


@pytest.mark.parametrize(("n", "radius"), [(600, 3.0), (2000, 1.0)])
def test_means_at_site_coordinates(n, radius):
    """As near to them as the coordinates' rounding, which is no fault of the mesh."""
    mesh, site = generate.disc(n=n, radius=radius), np.array([[5e5], [5.4e6]])
    here, _ = relocate(mesh)
    there, report = relocate(MeshTri(mesh.p + site, mesh.t))
    assert report.success
    assert there.p - site == pytest.approx(here.p, abs=2e-9)
    (means,) = (c for c in check_mesh(there).conditions if "means of their" in c.expected)
    assert len(means.offending) == 0
    p, node = there.p.copy(), there.interior_nodes()[0]
    p[:, node] += 1e-7 * radius
    moved = check_mesh(MeshTri(p, there.t))
    (means,) = (c for c in moved.conditions if "means of their" in c.expected)
    assert node in means.offending


@pytest.mark.parametrize("banded", [0, relocation.BANDED])
def test_means_by_banded_and_by_sparse_factors(banded, monkeypatch):
    monkeypatch.setattr(relocation, "BANDED", banded)
    mesh = generate.polygon(
        [(0, 0), (5, 0), (5, 1), (0, 1)], [[(1, 0.3), (2, 0.3), (1, 0.8)]], n=700
    )
    free = np.ones(mesh.p.shape[1], dtype=bool)
    free[mesh.boundary_nodes()] = False
    shaken = mesh.p + np.where(free, 0.003 * np.random.default_rng(0).normal(size=mesh.p.shape), 0)
    p, _, failure = relocation.to_means(MeshTri(shaken, mesh.t), free, 3, lambda *_: None)
    assert not failure
    assert p == pytest.approx(mesh.p, abs=1e-13)  # whose inner nodes are at the means


def test_centroids_of_cells(mesh):
    seen = []
    moved, report = relocate(mesh, "cells", progress=lambda *state: seen.append(state))
    assert report.success
    assert cells_missed(moved) < 1.01e-6
    # the count of iterations does not grow with that of the nodes
    assert report.iterations < 40
    assert [i for i, _ in seen] == list(range(report.iterations + 1))
    assert seen[-1][1] < 1e-6 < seen[0][1]


@pytest.mark.parametrize("to", ["neighbours", "cells"])
def test_what_stays(mesh, to):
    before = mesh.p.copy()
    moved, _ = relocate(mesh, to)
    assert np.array_equal(mesh.p, before)
    assert np.array_equal(moved.t, mesh.t)
    held = mesh.boundary_nodes()
    assert np.array_equal(moved.p[:, held], mesh.p[:, held])
    free = np.setdiff1d(np.arange(mesh.p.shape[1]), held)
    assert (moved.p[:, free] != mesh.p[:, free]).any(axis=0).mean() > 0.9
    assert np.array_equal(
        np.sign(signed_areas(moved.p, moved.t)), np.sign(signed_areas(mesh.p, mesh.t))
    )
    assert is_triangulation(moved)
    assert area(moved) == pytest.approx(area(mesh), rel=1e-12)


@pytest.mark.parametrize("to", ["neighbours", "cells"])
def test_fixed_nodes_stay(to):
    mesh = random_mesh(4)
    fixed = mesh.interior_nodes()[::7]
    moved, report = relocate(mesh, to, fixed=fixed)
    assert report.success
    assert np.array_equal(moved.p[:, fixed], mesh.p[:, fixed])
    assert (moved.p != mesh.p).any(axis=0).sum() == len(mesh.interior_nodes()) - len(fixed)
    assert relocate(mesh, to, fixed=mesh.interior_nodes())[1].message == "all nodes are fixed"


def test_iterations_do_not_grow():
    counts = [relocate(MeshTri.init_circle(k), "cells")[1].iterations for k in (3, 4, 5)]
    assert max(counts) <= 10


def test_tags_are_kept():
    mesh = MeshTri().refined(3).with_defaults().with_subdomains({"half": lambda x: x[0] < 0.5})
    inner = mesh.facets_satisfying(
        lambda x: np.isclose(x[1], 0.25) & (x[0] > 0.5), boundaries_only=False
    )
    mesh = mesh.with_boundaries({"line": OrientedBoundary(inner, np.zeros(len(inner)))})
    free = np.setdiff1d(mesh.interior_nodes(), mesh.facets[:, inner])
    free = free[~np.isclose(mesh.p[0, free], 0.5)]
    p = mesh.p.copy()
    p[:, free] += np.random.default_rng(0).uniform(-0.03, 0.03, (2, len(free)))
    shaken = MeshTri(p, mesh.t).with_boundaries(mesh.boundaries)
    shaken = shaken.with_subdomains(mesh.subdomains)
    for to in ("neighbours", "cells"):
        moved, _ = relocate(shaken, to)
        held = np.setdiff1d(np.arange(p.shape[1]), free)
        assert np.array_equal(moved.p[:, held], mesh.p[:, held])
        assert moved.boundaries.keys() == mesh.boundaries.keys()
        assert np.array_equal(moved.boundaries["line"].ori, mesh.boundaries["line"].ori)
        assert np.array_equal(moved.subdomains["half"], mesh.subdomains["half"])


def test_triangles_that_would_flip():
    mesh, fixed = tight()
    with pytest.warns(ConvergenceWarning, match=r"\d+ of \d+ nodes stayed"):
        moved, report = relocate(mesh, fixed=fixed)
    assert not report.success
    assert "FAILURE" in repr(report)
    assert is_triangulation(moved)
    assert np.array_equal(
        np.sign(signed_areas(moved.p, moved.t)), np.sign(signed_areas(mesh.p, mesh.t))
    )
    # the nodes that moved are at the means of their neighbours
    a, b = moved.facets
    ends, others = np.append(a, b), np.append(b, a)
    means = np.stack([np.bincount(ends, x[others]) for x in moved.p]) / np.bincount(ends)
    went = (moved.p != mesh.p).any(axis=0)
    assert 0 < went.sum() < len(mesh.interior_nodes()) - 1
    assert moved.p[:, went] == pytest.approx(means[:, went], abs=1e-12)


def test_no_convergence_is_visible():
    mesh = random_mesh(4)
    with pytest.warns(ConvergenceWarning, match="after 2 iterations the farthest node"):
        moved, report = relocate(mesh, "cells", maxiter=2)
    assert not report.success
    assert is_triangulation(moved)


def test_a_mesh_without_inner_nodes():
    for to in ("neighbours", "cells"):
        moved, report = relocate(MeshTri(), to)
        assert report.success
        assert np.array_equal(moved.p, MeshTri().p)


def test_bar_of_progress(capsys):
    relocate(disc(3), "cells", progress=True)
    assert "relocation" in capsys.readouterr().err
    relocate(disc(3), "cells")
    assert capsys.readouterr() == ("", "")


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.5, 1.0, 30.0]))
def test_improve_never_worsens(seed, spacing):
    mesh = random_mesh(seed, spacing)
    assume(is_triangulation(mesh))
    better, report = improve(mesh)
    assert is_triangulation(better)
    assert report.before == Quality.of(mesh)
    assert report.after == Quality.of(better)
    assert not report.before.better(report.after)
    angles = [np.degrees(smallest_angles(m.p, m.t).min()) for m in (mesh, better)]
    assert (report.after.uncrossed, -angles[1]) <= (report.before.uncrossed, -angles[0] + 1e-9)


def test_improve_keeps_a_good_mesh():
    mesh = MeshTri.init_sqsymmetric().refined(2)
    better, report = improve(mesh)
    assert np.array_equal(better.p, mesh.p)
    assert report.message == "kept as it was"


@pytest.mark.parametrize("n", [15, *slow(40, 200)])
def test_repair_of_random_meshes(n):
    """Relocation mends nearly all of them, flips the rest."""
    meshes = (random_mesh(seed, spacing) for seed in range(104) for spacing in (1.0, 30.0))
    meshes = list(islice(filter(is_triangulation, meshes), n))
    assert len(meshes) == n
    invalid = flips = 0
    for mesh in meshes:
        invalid += not check_mesh(mesh).ok
        mended, report = repair(mesh)
        flips += report.flips > 0
        assert check_mesh(mended).ok
        assert report.success
        assert report.after.uncrossed == 0
        assert area(mended) == pytest.approx(area(mesh), rel=1e-12)
        held = mesh.boundary_nodes()
        assert np.array_equal(mended.p[:, held], mesh.p[:, held])
    assert invalid >= 0.97 * n
    assert flips <= 3


@pytest.mark.parametrize("seed", [5, *slow(44, 86, 47, 74, 77, 83)])
def test_repair_with_flips(seed):
    """Spoilt and hardly any boundary nodes: relocation is not enough."""
    mesh = spoilt(random_mesh(seed, spacing=30.0), seed, rounds=12)
    assert is_triangulation(mesh)
    assert Quality.of(improve(mesh)[0]).uncrossed > 0
    mended, report = repair(mesh)
    assert report.flips > 0
    assert check_mesh(mended).ok
    assert area(mended) == pytest.approx(area(mesh), rel=1e-12)
    assert mended.nelements == mesh.nelements


def tagged(mesh):
    """A square with sides, a half and an oriented line across as tags."""
    mesh = MeshTri(mesh.p, mesh.t).with_defaults()
    mesh = mesh.with_subdomains({"half": lambda x: x[0] < 0.5})
    line = mesh.facets_satisfying(lambda x: np.isclose(x[1], 0.5), boundaries_only=False)
    ori = (mesh.p[1, mesh.t].mean(axis=0)[mesh.f2t[0, line]] > 0.5).astype(int)
    return mesh.with_boundaries({"line": OrientedBoundary(line, ori)})


def test_flips_keep_tags():
    mesh = tagged(MeshTri.init_tensor(np.linspace(0, 1, 9), np.linspace(0, 1, 9)))
    bad = mesh
    for seed in range(8):
        bad = tagged(spoilt(bad, seed, rounds=1))
    assert is_triangulation(bad)
    assert Quality.of(bad).uncrossed > 0
    better, count = flipped(bad, everywhere=True)
    assert count > 0
    assert Quality.of(better).uncrossed < Quality.of(bad).uncrossed
    assert better.boundaries.keys() == bad.boundaries.keys()
    for name, axis, at in (("left", 0, 0), ("top", 1, 1), ("line", 1, 0.5)):
        x = better.p[:, better.facets[:, better.boundaries[name]]]
        assert x[axis] == pytest.approx(at)
        assert len(better.boundaries[name]) == 8
    tag = better.boundaries["line"]
    sides = better.f2t[tag.ori, tag]
    assert (better.p[1, better.t[:, sides]].mean(axis=0) < 0.5).all()
    half = better.subdomains["half"]
    assert np.abs(signed_areas(better.p, better.t))[half].sum() == pytest.approx(0.5)
    assert better.p[0, better.t[:, half]].max() == 0.5


def test_repair_leaves_a_valid_mesh():
    mesh = disc(3)
    same, report = repair(mesh)
    assert same is mesh
    assert report.iterations == report.flips == 0


def test_what_cannot_be_repaired():
    # the one inner facet cannot be flipped: its quadrilateral is not convex
    p = np.array([[0.0, 1, 4, 5], [0, 0, 1, -1]])
    mesh = MeshTri(p, np.array([[0, 0], [1, 1], [2, 3]]))
    with pytest.raises(MeshError, match=r"after relocation and flips; 2 nodes violate this: 0, 1"):
        repair(mesh)


def test_nothing_is_warned_of_by_improve_and_repair():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh, fixed = tight()
        _, report = improve(mesh, fixed=fixed)
    assert report.success


def test_reports_are_readable():
    text = repr(relocate(random_mesh(4))[1])
    assert "Smallest angle, degrees: " in text
    assert "Success: inner nodes are at the means of the neighbours" in text


def test_wrong_arguments():
    mesh = disc(3)
    with pytest.raises(ValueError, match='expected to "neighbours" or "cells"'):
        relocate(mesh, "middle")
    with pytest.raises(ValueError, match=f"fixed from 0 to {mesh.p.shape[1] - 1}"):
        relocate(mesh, fixed=[mesh.p.shape[1]])
    with pytest.raises(ValueError, match="expected maxiter of at least 1, got 0"):
        relocate(mesh, maxiter=0)
    with pytest.raises(TypeError, match="fixed as an array of integers"):
        improve(mesh, fixed=[0.5])
    for function in (relocate, improve, repair):
        with pytest.raises(TypeError, match="expected a skfem MeshTri"):
            function(MeshQuad())
    flat = MeshTri(np.array([[0.0, 1, 2], [0, 0, 0]]), [[0], [1], [2]])
    with pytest.raises(MeshError, match="positive area"):
        relocate(flat)
