from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow

from skfem_dual import DualMesh, Plan
from skfem_dual.errors import MeshError, MeshWarning
from skfem_dual.grids.corners import signed_areas
from skfem_dual.grids.curves import along, check_loops, corners_of
from skfem_dual.grids.general import general_triangulation
from skfem_dual.grids.generate import annulus, disc, polar, polygon, rectangle
from skfem_dual.grids.partition import Partition
from skfem_dual.grids.preprocess import Quality, relocate
from skfem_dual.grids.quality import smallest_angles

EXCISED = np.array(
    [
        [-1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5, -0.5, -0.5, -1],
        [-0.5, -0.5, -1, -1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5],
    ]
)
L_SHAPE = np.array([[0, 2, 2, 1, 1, 0], [0, 0, 1, 1, 2, 2]])
SMALL = 0.2 * np.array([[-1, 1, 1, -1], [-1, -1, 1, 1]])
BESIDE = SMALL + np.array([[1.2], [0.1]])

UNIFORM = {
    "disc": lambda **k: disc(**k),
    "annulus": lambda **k: annulus(0.5, **k),
    "eccentric": lambda **k: annulus(0.3, hole=(0.3, 0.2), **k),
    "rectangle": lambda **k: rectangle(3, 1, **k),
    "excised square": lambda **k: polygon(EXCISED, **k),
    "re-entrant": lambda **k: polygon(L_SHAPE, **k),
    "holes": lambda **k: polygon(2 * EXCISED, [SMALL, BESIDE], **k),
    "triangle": lambda **k: polygon([[0, 1, 0.5], [0, 0, 0.9]], **k),
}


def area(mesh):
    return np.abs(signed_areas(mesh.p, mesh.t)).sum()


@pytest.mark.parametrize("shape", UNIFORM)
def test_columns_of_facets_are_never_sorted(shape, monkeypatch):
    """Facets are numbered by one sort of integers, in a tenth of the time; the mesh that comes
    has those of scikit-fem."""
    with monkeypatch.context() as without:
        without.delattr("skfem.mesh.Mesh.build_entities")
        mesh = UNIFORM[shape](n=150)
    outer = {name: mesh.facets[:, facets] for name, facets in mesh.boundaries.items()}
    ends = np.hstack(list(outer.values()))
    assert {tuple(pair) for pair in ends.T} == {
        tuple(mesh.facets[:, facet]) for facet in mesh.boundary_facets()
    }


def lengths(mesh):
    a, b = mesh.p[:, mesh.facets].swapaxes(0, 1)
    return np.hypot(*(b - a))


@pytest.mark.parametrize(
    ("make", "triangles", "nodes", "boundary"),
    [
        (lambda: disc(n=513, nboundary=80), 944, 513, 80),
        (lambda: polygon(EXCISED, n=608, nboundary=96), 1118, 608, 96),
        (lambda: annulus(0.3, n=539, hole=(0.3, 0), nboundary=149), 929, 539, 149),
    ],
)
def test_meshes_of_the_paper(make, triangles, nodes, boundary):
    """Figs. 10, 12 and 13."""
    mesh = make()
    assert mesh.nelements == pytest.approx(triangles, rel=0.02)
    assert mesh.p.shape[1] == pytest.approx(nodes, rel=0.02)
    assert len(mesh.boundary_nodes()) == boundary
    quality = Quality.of(mesh)
    assert quality.smallest_angle > 30
    assert quality.from_means < 1e-10


@pytest.mark.parametrize("name", UNIFORM)
@pytest.mark.parametrize("n", [150, 700])
def test_near_uniform(name, n):
    """Conditions a, b, c of section 4.2: size, shape, means."""
    mesh = UNIFORM[name](n=n)
    assert mesh.p.shape[1] == pytest.approx(n, rel=0.01)
    assert DualMesh.from_mesh(mesh)
    quality = Quality.of(mesh)
    assert quality.uncrossed == 0
    assert quality.smallest_angle > 30
    assert quality.from_means < 1e-10
    h = lengths(mesh)
    assert h.max() < 3 * h.min()
    assert np.abs(signed_areas(mesh.p, mesh.t)).std() < 0.3 * area(mesh) / mesh.nelements


@pytest.mark.parametrize("name", UNIFORM)
def test_size(name):
    mesh = UNIFORM[name](size=0.1)
    assert np.median(lengths(mesh)) == pytest.approx(0.1, rel=0.08)


@pytest.mark.parametrize("graded", [0.3, *slow(0.05)])
@pytest.mark.parametrize("name", UNIFORM)
def test_graded_by_size(name, graded):
    """Boundary facets are as asked, lengths grow by 0.2 per distance, triangles stay good."""
    size = 0.3
    mesh = UNIFORM[name](size=size, graded=graded)
    quality = Quality.of(mesh)
    assert quality.uncrossed == 0
    assert quality.smallest_angle > 24
    assert quality.from_means < 1e-9
    h, outer = lengths(mesh), mesh.boundary_facets()
    assert h[outer].mean() == pytest.approx(graded * size, rel=0.05)
    x = mesh.p[:, mesh.facets].mean(axis=1)
    away = np.min(np.hypot(*(x[:, :, None] - mesh.p[:, None, mesh.boundary_nodes()])), axis=1)
    wanted = np.minimum(size, graded * size + 0.2 * away)
    assert np.median(h / wanted) == pytest.approx(1, abs=0.2)
    assert (h < 2.2 * wanted).all()


@pytest.mark.parametrize("law", ["sine", "quadratic"])
def test_laws_of_a_disc(law):
    uniform = disc(n=400, true_area=False)
    mesh = disc(n=400, graded=law, true_area=False)
    assert np.array_equal(mesh.t, uniform.t)
    assert Quality.of(mesh).uncrossed == 0
    s, r = np.hypot(*uniform.p), np.hypot(*mesh.p)
    expected = np.sin(np.pi * s / 2) if law == "sine" else 1 - (1 - s) ** 2
    assert r == pytest.approx(expected, abs=1e-12)
    cross = mesh.p[0] * uniform.p[1] - mesh.p[1] * uniform.p[0]
    assert cross == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("law", ["sine", "quadratic"])
def test_laws_of_an_annulus_and_a_rectangle(law):
    f = (lambda u: np.sin(np.pi * u / 2)) if law == "sine" else (lambda u: u * (2 - abs(u)))
    uniform, mesh = (annulus(0.5, 2.0, n=400, graded=g, true_area=False) for g in (None, law))
    u, v = ((np.hypot(*m.p) - 1.25) / 0.75 for m in (uniform, mesh))
    assert v == pytest.approx(f(u), abs=1e-12)
    eccentric = annulus(0.3, n=500, hole=(0.4, 0.1), graded=law)
    assert Quality.of(eccentric).uncrossed == 0
    uniform, mesh = rectangle(4, 1, n=300), rectangle(4, 1, n=300, graded=law)
    half = np.array([[2.0], [0.5]])
    assert mesh.p / half == pytest.approx(f(uniform.p / half), abs=1e-12)
    assert Quality.of(mesh).uncrossed == 0


def test_areas():
    inscribed = disc(n=100, true_area=False)
    sides = len(inscribed.boundary_nodes())
    assert area(inscribed) == pytest.approx(sides / 2 * np.sin(2 * np.pi / sides))
    for graded in (None, "sine", 0.2):
        mesh = disc(n=100, radius=2, graded=graded)
        assert area(mesh) == pytest.approx(4 * np.pi)
        mesh = annulus(0.3, hole=(0.4, 0), n=200, graded=graded)
        assert area(mesh) == pytest.approx(np.pi * (1 - 0.09))
    assert area(rectangle(3, 2, n=100)) == pytest.approx(6)
    assert area(polygon(EXCISED, n=100)) == pytest.approx(3)
    assert area(polygon(EXCISED, [SMALL], n=200)) == pytest.approx(3 - 0.16)


def test_tags():
    mesh = annulus(0.3, 2, hole=(0.5, 0), n=400, true_area=False)
    x = mesh.p[:, mesh.facets]
    assert np.hypot(*x[..., mesh.boundaries["edge"]]) == pytest.approx(2)
    assert np.hypot(*(x[..., mesh.boundaries["hole"]] - [[[0.5]], [[0]]])) == pytest.approx(0.3)
    mesh = polygon(2 * EXCISED, [SMALL, BESIDE], size=0.2)
    assert set(mesh.boundaries) == {"edge", "hole0", "hole1"}
    assert np.array_equal(
        np.sort(np.concatenate(list(mesh.boundaries.values()))), mesh.boundary_facets()
    )
    assert np.abs(mesh.p[:, mesh.facets[:, mesh.boundaries["hole0"]]]).max() <= 0.2
    assert list(disc(n=50).boundaries) == list(disc(n=50, graded="sine").boundaries) == ["edge"]


def test_corners_are_nodes():
    mesh = polygon(EXCISED[:, ::-1], n=300)
    for corner in EXCISED.T:
        assert np.hypot(*(mesh.p - corner[:, None])).min() < 1e-15


def test_boundary_nodes_come_first_and_evenly():
    mesh = disc(n=200, nboundary=45)
    assert np.array_equal(mesh.boundary_nodes(), np.arange(45))
    angle = np.unwrap(np.arctan2(mesh.p[1, :45], mesh.p[0, :45]))
    assert np.diff(angle) == pytest.approx(2 * np.pi / 45)


def test_skfem_has_nothing_to_complain_of(caplog):
    mesh = rectangle(n=1500)
    general_triangulation(relocate(mesh, "cells")[0])
    disc(n=1500, graded="sine")
    polar(40, 40)
    assert caplog.text == ""


def test_deterministic():
    for make in (lambda: disc(n=300), lambda: polygon(L_SHAPE, n=300, graded=0.2)):
        one, two = make(), make()
        assert np.array_equal(one.p, two.p)
        assert np.array_equal(one.t, two.t)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(0.5, 1.0), min_size=5, max_size=9),
    st.floats(0, 6),
    st.floats(0.01, 100),
    st.integers(60, 300),
)
def test_star_polygons(radii, turn, scale, n):
    """Any polygon without sharp corners, anywhere and of any scale."""
    angle = turn + 2 * np.pi * np.arange(len(radii)) / len(radii)
    outline = scale * (np.array(radii) * np.stack([np.cos(angle), np.sin(angle)]) + 3)
    mesh = polygon(outline, n=n)
    x, y = outline
    exact = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2
    assert area(mesh) == pytest.approx(exact, rel=1e-11)
    assert mesh.p.shape[1] == pytest.approx(n, rel=0.06)
    quality = Quality.of(mesh)
    assert quality.uncrossed == 0
    assert quality.smallest_angle > 15


@settings(max_examples=15, deadline=None)
@given(st.floats(0.05, 0.6), st.floats(0, 0.9), st.floats(0, 6.3), st.integers(150, 400))
def test_eccentric_annuli(inner, share, direction, n):
    away = share * (0.92 - inner)
    hole = away * np.cos(direction), away * np.sin(direction)
    mesh = annulus(inner, hole=hole, n=n)
    assert area(mesh) == pytest.approx(np.pi * (1 - inner**2), rel=1e-12)
    assert DualMesh.from_mesh(mesh).topology == (1, 1)


def test_polar_grid():
    """Table 1: 400 elements of the relative area 3.12869."""
    mesh = polar(10, 40, true_area=False)
    partition = Partition.from_mesh(mesh)
    assert mesh.nelements == len(partition) == 400
    assert partition.areas.sum() == pytest.approx(3.12869, abs=1e-5)
    assert np.bincount(mesh.t2f.ravel()).max() == 2
    assert len(mesh.boundaries["edge"]) == 40
    assert np.hypot(*mesh.p[:, mesh.facets[:, mesh.boundaries["edge"]]]) == pytest.approx(1)
    assert np.sort(np.hypot(*mesh.p).reshape(11, 40)[:, 0]) == pytest.approx(np.linspace(0, 1, 11))


@pytest.mark.parametrize("law", ["sine", "quadratic"])
def test_graded_polar_grid(law):
    mesh = polar(6, 30, radius=2, graded=law)
    assert Partition.from_mesh(mesh).areas.sum() == pytest.approx(4 * np.pi)
    s = np.linspace(0, 1, 7)
    expected = np.sin(np.pi * s / 2) if law == "sine" else 1 - (1 - s) ** 2
    r = np.hypot(*mesh.p).reshape(7, 30)
    assert r / r.max() == pytest.approx(np.repeat(expected[:, None], 30, axis=1))


def test_narrow_gaps_are_met_by_finer_boundaries():
    hole = [[0.02, 0.5, 0.5], [0.3, 0.3, 0.5]]
    mesh = polygon([[0, 1, 1, 0], [0, 0, 1, 1]], [hole], size=0.3)
    assert DualMesh.from_mesh(mesh).topology == (1, 1)
    assert area(mesh) == pytest.approx(1 - 0.048)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: disc(), "either size or n, got size=None and n=None"),
        (lambda: disc(0.1, 100), "either size or n"),
        (lambda: disc(-1.0), "expected a positive size, got -1"),
        (lambda: disc(np.nan), "expected a finite size, got nan"),
        (lambda: disc(5.0), "expected a size smaller than the domain"),
        (lambda: disc(n=2), r"expected n from 4 to 1e.08, got 2"),
        (lambda: disc(0.1, radius=0), "expected a positive radius, got 0"),
        (lambda: disc(0.1, graded="cosine"), 'expected graded "sine" or "quadratic"'),
        (lambda: disc(0.1, graded=1.5), "expected graded above 0 and of at most 1, got 1.5"),
        (lambda: rectangle(1, 1, n=99, graded=1e-300), "graded of at least 1e-06, got 1e-300"),
        (lambda: disc(0.1, graded=0.5, nboundary=9), "either nboundary or graded as a number"),
        (lambda: disc(0.1, nboundary=2), r"expected nboundary from 3 to 1e.08, got 2"),
        (lambda: annulus(1.0, 0.5, 0.1), "the hole to lie inside the circle of radius 0.5"),
        (lambda: annulus(0.5, 1.0, 0.1, hole=(0.6, 0)), "the hole to lie inside"),
        (lambda: rectangle(0, 1, 0.1), "expected a positive width"),
        (
            lambda: polygon([[0, 1], [0, 1]], size=0.1),
            "expected outline with at least 3 items, got 2",
        ),
        (lambda: polygon(np.eye(3, 4), size=0.1), r"outline of shape \(2, n\), got \(3, 4\)"),
        (lambda: polygon(1e101 * EXCISED, n=30), r"coordinates of outline of at most 1e\+100"),
        (lambda: polygon(EXCISED, size=0.1, graded="sine"), "graded as a number"),
        (lambda: polygon([[0, 1, 0, 1], [0, 1, 1, 0]], size=0.1), "neither cross nor touch"),
        (lambda: polygon([[0, 2, 1, 1], [0, 0, 0, 1]], size=0.1), "neither cross nor touch"),
        # a hole that touches a side along an axis within rounding, and one that touches a corner
        *(
            (
                lambda hole=hole: polygon([[0, 1, 1, 0], [0, 0, 1, 1]], [hole], size=0.1),
                "neither cross nor touch",
            )
            for hole in (
                [[0.3, 0.6, 0.45], [1e-15, 0.3, 0.3]],
                [[1e-15, 0.6, 0.45], [1e-15, 0.3, 0.5]],
            )
        ),
        (
            lambda: polygon([[0, 1, 1, 0, 0], [0, 0, 1, 1, 0]], size=0.1),
            "repeated corners, but those following corners 4 are",
        ),
        (
            lambda: polygon([[0, 1, 1, 1, 0], [0, 0, 0, 1, 1]], size=0.1),
            "repeated corners, but those following corners 1 are",
        ),
        (lambda: polygon(EXCISED, [SMALL, 0.5 * SMALL], 0.1), "hole 1 to lie outside hole 0"),
        (lambda: polygon(EXCISED, [SMALL + 5], 0.1), "hole 0 to lie inside the outline"),
        (lambda: polygon(EXCISED, [5 * SMALL], 0.1), "neither cross nor touch"),
        (lambda: polygon(EXCISED, [9 * SMALL], 0.1), "hole 0 to lie inside the outline"),
        (lambda: polar(0, 40), "expected rings of at least 1, got 0"),
        (lambda: polar(3, 2), "expected sectors of at least 3, got 2"),
        (lambda: polar(3, 6, graded="linear"), 'expected graded "sine" or "quadratic"'),
    ],
)
def test_wrong_arguments(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_arguments_of_wrong_types():
    with pytest.raises(TypeError, match=r"expected an integer for n, got 10\.5"):
        disc(n=10.5)
    with pytest.raises(TypeError, match="expected two numbers for centre"):
        disc(0.1, centre=(0, 0, 0))
    for circle in (partial(disc, n=40), partial(Plan.circle, radius=1.0)):
        with pytest.raises(
            ValueError, match=r"expected centre up to 1e\+12 radii from the origin"
        ):
            circle(centre=(1e16, 0.0))
    with pytest.raises(TypeError, match="expected a sequence for holes"):
        polygon(EXCISED, 3, 0.1)
    with pytest.raises(TypeError, match="expected True or False for true_area"):
        disc(0.1, true_area="outside")


def test_too_few_boundary_nodes():
    with pytest.raises(MeshError, match="choose a smaller size, more nodes or more boundary"):
        annulus(0.3, hole=(0.69, 0), n=400, nboundary=10)


@pytest.mark.parametrize("n", [4, 6, 9])
def test_very_few_nodes(n):
    assert disc(n=n).p.shape[1] >= 3


@pytest.mark.parametrize(("length", "n"), [(10, 20), (50, 100), (100, 200)])
def test_strips(length, n):
    mesh = rectangle(length, 1.0, n=n)
    assert mesh.p.shape[1] == pytest.approx(n, rel=0.15)


def test_far_from_the_origin():
    mesh = disc(n=300, radius=5.0, centre=(456789.0, 5432100.0))
    assert mesh.p.shape[1] == pytest.approx(300, rel=0.03)


@pytest.mark.parametrize("sizes", [{"n": 50}, {"size": 0.4}])
def test_too_far_from_the_origin(sizes):
    """Where no digits are left, as of plans."""
    corners = np.array([[0, 2, 2], [0, 0, 2.0]])
    assert polygon(corners + 1e12, **sizes).nelements > 20
    with pytest.raises(MeshError, match=r"size of 2 at 1e\+15. Remedy: coordinates from a point"):
        polygon(corners + 1e15, **sizes)


@pytest.mark.parametrize("sense", [1, -1])
def test_senses_of_small_outlines_far_from_the_origin(sense):
    """A kite of a centimetre at site coordinates."""
    kite = 0.01 * np.array([[0, 1, 1.1, 1, 0], [0, 0, 0.5, 1, 1]])[:, ::sense]
    found = corners_of("outline", kite + np.array([[4.5e5], [5.4e6]]))
    assert signed_areas(found[:, :3], np.array([[0], [1], [2]]))[0] > 0


@pytest.mark.slow
def test_a_plan_all_of_whose_triangles_are_flat():
    with pytest.raises(MeshError, match="no triangulation with a valid dual grid found"):
        rectangle(1.0, 1e-11, n=30)


@pytest.mark.parametrize("short", [0.1, 1e-3, *slow(0.01)])
@pytest.mark.parametrize("n", [100, 800])
def test_short_sides_have_small_triangles_around(short, n):
    """A step, a slot and a chamfer; triangles as long as the others would be slivers."""
    outline = [(0, 0), (4, 0), (4, 0.5), (4 + short, 0.5), (4 + short, 0), (10 - short, 0)]
    outline += [(10, short), (10, 6), (5, 6), (5, 6 - short), (0, 6 - short)]
    mesh = polygon(outline, n=n)
    assert np.degrees(smallest_angles(mesh.p, mesh.t).min()) > 10
    assert mesh.nvertices < max(1.02 * n, 600)
    length = np.hypot(*np.diff(mesh.p[:, mesh.facets], axis=1)[:, 0])
    assert 0.3 * short < length.min() <= 1.01 * short
    assert length.max() > 0.5 * np.sqrt(60 / n)


def test_far_more_nodes_than_asked_for_are_told():
    """Corners so near each other that each pair takes hundreds of triangles."""
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    angle = np.sort(np.append(angle, angle + 1e-5))
    outline = np.stack([5 * np.cos(angle), 4 * np.sin(angle)])
    with pytest.warns(MeshWarning, match=r"about 100 nodes, got \d+: facets as short as 4.*e-05"):
        polygon(outline, n=100)


def test_small_holes_have_small_triangles_around():
    """Of the area of the plan, whose arcs have nodes in unequal distances."""
    holes = [Plan.circle((2, 2), 0.03), Plan.circle((7, 3), 0.4)]
    quarter = np.tan(np.pi / 8)
    outline = [(0, 0), (9.9, 0, quarter), (10, 0.1), (10, 5), (9, 6, -0.2), (0, 6)]
    plan = Plan.from_polygon(outline, holes)
    mesh = plan.mesh(n=200)
    assert np.degrees(smallest_angles(mesh.p, mesh.t).min()) > 15
    assert area(mesh) == pytest.approx(plan.area, rel=1e-13)
    assert [len(mesh.boundaries[name]) >= 12 for name in ("hole0", "hole1")] == [True, True]


@pytest.mark.parametrize("angle", np.linspace(0, 3, 7))
@pytest.mark.parametrize(("at", "apart"), [(0.3, 1e-10), (5e6, 1e-6)])
def test_rings_touch_by_rounding_and_not_from_a_distance(angle, at, apart):
    """A corner on a side, a side on a side, and two holes end to end, however turned."""
    c, s = np.cos(angle), np.sin(angle)
    for gap, meet in (0.0, True), (apart, False):
        for holes in (
            [[(0.7, gap), (1.5, 1.0), (0.5, 1.0)]],
            [[(0.5, gap), (1.5, gap), (1.0, 1.0)]],
            [
                [(0.5, 1.0), (1.0 - gap / 2, 1.0), (0.7, 1.5)],
                [(1.0 + gap / 2, 1.0), (1.5, 1.0), (1.2, 0.5)],
            ],
        ):
            rings = [[(0, 0), (2, 0), (2, 2), (0, 2)], *holes]
            loops = [np.array([[c, -s], [s, c]]) @ np.array(ring).T + at for ring in rings]
            if meet:
                with pytest.raises(ValueError, match="neither cross nor touch"):
                    check_loops(loops)
            else:
                check_loops(loops)


@pytest.mark.parametrize("rise", [0.0, 1e-15, 1e-12, 1e-6, 0.01])
def test_parts_of_a_side_by_their_widths(rise):
    """As many as the integral of 1 / width, of even widths and of linear ones."""
    x = lambda _, share: np.stack([100 * share, 0 * share])  # noqa: E731
    width = lambda x: 0.1 * (1 + rise * x[0])  # noqa: E731
    side, share = along(1, np.array([100.0]), 1, x, width)
    parts = 10 * np.log(1 + 100 * rise) / rise if rise > 1e-9 else 1000
    assert len(side) == round(parts)
    ends = np.log1p(rise * 100 * share) / rise if rise > 1e-9 else 100 * share
    assert np.diff(ends) == pytest.approx(ends[1], rel=0.02)


@pytest.mark.parametrize("nboundary", [30, 40, 60])
def test_short_sides_leave_boundary_nodes_to_the_long_ones(nboundary):
    """Of a rectangle with rounded corners there were up to 20 too many."""
    t = np.linspace(0, np.pi / 2, 7)
    middles = (2.9, 1.9), (0.1, 1.9), (0.1, 0.1), (2.9, 0.1)
    arcs = [
        np.array([x + 0.1 * np.cos(t + k * np.pi / 2), y + 0.1 * np.sin(t + k * np.pi / 2)])
        for k, (x, y) in enumerate(middles)
    ]
    mesh = polygon(np.hstack(arcs), n=400, nboundary=nboundary)
    assert len(mesh.boundary_facets()) == nboundary
    assert len(annulus(0.02, n=300, nboundary=40).boundary_facets()) == 40


def test_sides_that_cross_are_told_with_the_place():
    with pytest.raises(ValueError, match=r"they do near \(0.5, 0.5\)"):
        polygon([[0, 1, 0, 1], [0, 1, 1, 0]], size=0.1)
    hole = [[90, 110, 90], [40, 50, 60]]
    with pytest.raises(ValueError, match=r"they do near \(100, [45]5\)"):
        polygon([[0, 100, 100, 0], [0, 0, 100, 100]], holes=[hole], n=60)
