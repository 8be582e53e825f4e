"""Outlines: what is within, and meshes that keep it."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from skfem import CellBasis, ElementTriP1, Functional

from skfem_dual import DualMesh, MeshError, Plan
from skfem_dual.grids.generate import polygon
from skfem_dual.grids.preprocess import Quality
from skfem_dual.plans.sides import Sides

L_SHAPE = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
QUARTER = float(np.tan(np.pi / 8))
#: a slot with round ends, as a stadium of straight part 2 and radius 1
STADIUM = [(0, -1), (2, -1, 1.0), (2, 1), (0, 1, 1.0)]
#: a square of side 2 with half a circle of radius 1/2 cut out of its right side
BITTEN = [(0, 0), (2, 0), (2, 0.5, -1.0), (2, 1.5), (2, 2), (0, 2)]


def area(mesh):
    return DualMesh.from_mesh(mesh).partition.areas.sum()


def moved(corners, angle, scale, shift):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x = np.array([c[:2] for c in corners]) @ turn.T * scale + shift
    return [(*p, *c[2:]) for p, c in zip(x.tolist(), corners)]


def clockwise(corners):
    """The same sides in the other order."""
    x, b = [c[:2] for c in corners], [(*c, 0.0)[2] for c in corners]
    return [(*p, -bulge) for p, bulge in zip(x[::-1], np.roll(b[::-1], -1))]


@pytest.mark.parametrize(
    ("plan", "exact", "centroid"),
    [
        (Plan.from_polygon(L_SHAPE), 5.0, (1.1, 1.1)),
        (Plan.from_polygon(STADIUM), 4 + np.pi, (1, 0)),
        # half a disc lies 4 r / 3 pi behind its diameter
        (
            Plan.from_polygon(BITTEN),
            4 - np.pi / 8,
            ((4 - np.pi / 8 * (2 - 2 / (3 * np.pi))) / (4 - np.pi / 8), 1),
        ),
        (Plan.circle((3, 4), 2), 4 * np.pi, (3, 4)),
        (Plan.circle((0, 0), 2, holes=[Plan.circle((0.5, 0), 1)]), 3 * np.pi, (-0.5 / 3, 0)),
        (Plan.from_polygon([(0, 0), (2, 0)], bulges=[1, 1]), np.pi, (1, 0)),
    ],
)
def test_area_and_centroid(plan, exact, centroid):
    """Closed forms, also at site coordinates."""
    for vector in ((0.0, 0.0), (451_200.0, 5_411_900.0)):
        here = plan.translated(vector)
        assert here.area == pytest.approx(exact, rel=1e-12 if vector[0] == 0 else 1e-8)
        assert here.centroid == pytest.approx(np.add(centroid, vector), abs=1e-8, rel=0)
    assert plan.scaled(3.0).area == pytest.approx(9 * exact)


def test_extent_and_corners():
    plan = Plan.from_polygon(STADIUM)
    assert plan.bounds == pytest.approx(np.array([[-1, 3], [-1, 1]]))
    assert plan.corners.shape == (2, 0)  # arcs go on from straight sides smoothly
    plan = Plan.from_polygon(L_SHAPE)
    assert plan.corner_angles == pytest.approx(np.pi * np.array([0.5, 0.5, 0.5, 1.5, 0.5, 0.5]))
    # of holes the plan is outside; half a circle begins at a right angle
    bitten = Plan.from_polygon(BITTEN, holes=[[(0.2, 0.2), (0.4, 0.2), (0.2, 0.4)]])
    angles = dict(zip(map(tuple, bitten.corners.T.tolist()), bitten.corner_angles / np.pi))
    assert [angles[2.0, 0.5], angles[0.2, 0.2], angles[0.4, 0.2]] == pytest.approx(
        [0.5, 1.5, 1.75]
    )


@settings(max_examples=40)
@given(
    st.sampled_from([L_SHAPE, STADIUM]),
    st.floats(0, 6.3),
    st.floats(0.01, 1e3),
    st.integers(0, 5),
    st.booleans(),
    st.booleans(),
)
def test_sense_start_and_closure_do_not_matter(corners, angle, scale, first, turned, closed):
    """Nor does where the plan lies, but for what moves with it."""
    shift = np.array([3.0, -7.0]) * scale
    ring = moved(corners, angle, scale, shift)
    ring = ring[first % len(ring) :] + ring[: first % len(ring)]
    ring = clockwise(ring) if turned else ring
    plan, other = Plan.from_polygon(ring + ring[:1] * closed), Plan.from_polygon(corners)
    assert plan.area == pytest.approx(scale**2 * other.area)
    centroid = moved([other.centroid], angle, scale, shift)[0]
    assert plan.centroid == pytest.approx(centroid, abs=1e-9 * scale)
    x = np.random.default_rng(0).uniform(-1.5, 3.5, (2, 200))
    y = np.array(moved(x.T, angle, scale, shift)).T
    assert np.array_equal(plan.contains(y), other.contains(x))


@pytest.mark.parametrize("as_given", [list, np.array, lambda c: np.array(c).T, tuple])
def test_corners_in_any_form(as_given):
    assert Plan.from_polygon(as_given(L_SHAPE)).area == 5.0
    mesh = polygon(as_given(L_SHAPE), n=60)
    assert area(mesh) == pytest.approx(5.0)


def test_arcs_that_are_hardly_curved():
    """Their middles are where those of circles are, however large these become."""
    for bulge in np.concatenate([[0.0], np.geomspace(1e-16, 1e-3, 40)]):
        sides = Sides(np.zeros((2, 1)), np.array([[1.0], [0.0]]), np.array([bulge]))
        middle = sides.at(np.array([0]), np.array([0.5]))[:, 0]
        assert middle == pytest.approx([0.5, -bulge / 2], abs=1e-8)
        assert sides.distance(np.array([[0.5], [0.3]])) == pytest.approx(0.3 + bulge / 2, abs=1e-8)
        assert sides.length == pytest.approx(1 + 2 / 3 * bulge**2, rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.0, 2.5])
def test_rings_that_touch_are_refused_and_close_ones_are_none(angle):
    """Tangent circles, corners on sides and sides on sides, however turned."""
    turned = lambda corners: moved(corners, angle, 1.0, 0.0)  # noqa: E731
    outline = turned([(0, 0), (2, 0), (2, 2), (0, 2)])
    for gap, meet in (0.0, True), (1e-10, False):
        for hole in (
            Plan.circle(turned([(1.0, 0.5 + gap)])[0], 0.5),
            turned([(1.0, gap), (1.5, 1.0), (0.5, 1.0)]),
            turned([(0.5, gap), (1.5, gap), (1.0, 1.0)]),
        ):
            if meet:
                with pytest.raises(MeshError, match="cross nor touch"):
                    Plan.from_polygon(outline, holes=[hole])
            else:
                assert len(Plan.from_polygon(outline, holes=[hole]).rings) == 2


def test_sides_meet_in_their_corner_alone():
    """Hexagons of straight sides and flat arcs, where these meet at small angles too."""
    rng = np.random.default_rng(0)
    for _ in range(100):
        a = np.arange(6) * np.pi / 3 + rng.uniform(-0.2, 0.2, 6) + rng.uniform(0, 1)
        corners = 1e3 + np.stack([np.cos(a), np.sin(a)]) * rng.uniform(0.9, 1, 6)
        bulges = rng.choice([0, 0.05, -0.05, 1e-3, -1e-3, -1e-5, 1e-6, 1e-7], 6)
        assert Plan.from_polygon(corners, bulges=bulges).area > 1
    # an arc that comes back to the side beside it at once
    for off, crosses in (1e-5, True), (-1e-5, False):
        bulge = -np.tan((np.pi / 2 + np.arcsin(off)) / 4)
        arc = (0.5 + off / 2, np.sqrt(0.25 - off**2 / 4), bulge)
        if crosses:
            with pytest.raises(MeshError, match="meeting itself"):
                Plan.from_polygon([(0, 0), (1, 0), arc])
        else:
            assert Plan.from_polygon([(0, 0), (1, 0), arc]).area > 0


def test_contains_by_distance():
    """Against distances, also for points on the chords of arcs."""
    x = np.mgrid[-1.5:3.6:0.25, -1.5:1.6:0.25] + 1e-9
    x[:, :, 6] = np.stack([x[0, :, 6], np.zeros(x.shape[1])])
    stadium = np.hypot(x[0] - x[0].clip(0, 2), x[1]) < 1
    assert np.array_equal(Plan.from_polygon(STADIUM).contains(x), stadium)
    ring = Plan.circle((1, 0), 1.4, holes=[Plan.circle((1, 0), 0.6)])
    r = np.hypot(x[0] - 1, x[1])
    assert np.array_equal(ring.contains(x), (r < 1.4) & (r > 0.6))
    bitten = Plan.from_polygon(BITTEN)
    x = [[0.5, 1.4, 1.6, 1.6], [1.0, 1.0, 1.0, 0.6]]
    assert bitten.contains(x).tolist() == [True, True, False, True]


def test_arc_through_three_points():
    """The bulge of any arc from its points."""
    for angle in (-5.0, -2.0, -0.1, 0.3, 3.0, 6.0):
        t = np.array([0.4, 0.4 + 0.3 * angle, 0.4 + angle])
        start, through, end = (tuple(p) for p in np.stack([np.cos(t), np.sin(t)]).T)
        assert Plan.bulge(start, through, end) == pytest.approx(np.tan(angle / 4))
    assert Plan.bulge((0, 0), (1, 0), (3, 0)) == pytest.approx(0, abs=1e-15)


PLANS = {
    "L": Plan.from_polygon(L_SHAPE),
    "stadium": Plan.from_polygon(STADIUM),
    "ring": Plan.circle((1, 2), 2, holes=[Plan.circle((1.5, 2), 0.8)]),
    "rounded": Plan.from_polygon(
        [(0.3, 0), (2.7, 0, QUARTER), (3, 0.3), (3, 2), (0, 2), (0, 0.3, QUARTER)]
    ),
    "two": Plan.from_polygon(L_SHAPE, [Plan.circle((0.5, 0.5), 0.2)])
    + Plan.circle((2.5, 2.5), 0.6),
}


@pytest.mark.parametrize("name", PLANS)
@pytest.mark.parametrize("graded", [None, 0.4])
def test_meshes_have_the_area_of_the_plan(name, graded):
    plan = PLANS[name]
    mesh = plan.mesh(n=200, graded=graded)
    dual = DualMesh.from_mesh(mesh)
    assert dual.partition.areas.sum() == pytest.approx(plan.area, rel=1e-12)
    assert mesh.p.shape[1] == pytest.approx(200, rel=0.1)
    # every corner is a node
    gaps = np.hypot(*(mesh.p[:, :, None] - plan.corners[:, None])).min(axis=0)
    assert gaps.max(initial=0) < 1e-12
    holes = len(plan.rings) - len(plan.parts)
    names = {0: [], 1: ["hole"]}[holes]
    assert list(mesh.boundaries) == ["edge", *names]
    assert sum(map(len, mesh.boundaries.values())) == len(mesh.boundary_facets())


@pytest.mark.parametrize("n", [80, 320])
@pytest.mark.parametrize("graded", [None, 0.4])
def test_meshes_of_arcs_beside_straight_sides_have_its_second_moments(n, graded):
    """Area that chords lack at the ends of an arc was made good at its top: 1.8e-3 with 80."""
    mesh = Plan.from_polygon([(0, 0), (1, 0, 1.0), (1, 1), (0, 1, 1.0)]).mesh(n=n, graded=graded)
    y = CellBasis(mesh, ElementTriP1(), intorder=2)
    found = Functional(lambda w: (w.x[1] - 0.5) ** 2).assemble(y)
    assert found == pytest.approx(1 / 12 + np.pi / 64, rel=3 / n**2)


@pytest.mark.parametrize("name", PLANS)
def test_arcs_stay_arcs_when_refined(name):
    """Nodes come nearer to the outline with the square of the length, the area stays."""
    plan = PLANS[name]
    meshes = [plan.mesh(n=100)]
    for _ in range(2):
        meshes.append(plan.refine(meshes[-1]))
    off = []
    for mesh in meshes:
        assert area(mesh) == pytest.approx(plan.area, rel=1e-12)
        edge = mesh.p[:, mesh.boundary_nodes()]
        off.append(np.min([ring.sides.distance(edge) for ring in plan.rings], axis=0).max())
    assert meshes[2].nelements == pytest.approx(16 * meshes[0].nelements, rel=1e-3)
    if name == "L":
        assert max(off) < 1e-12
    else:
        # from two pieces of an arc on somewhat faster: only the one inner node is moved
        assert 3.5 < off[0] / off[1] < 6.5
        assert 3.5 < off[1] / off[2] < 5
    assert set(meshes[2].boundaries) == set(meshes[0].boundaries)


def test_refined_in_places():
    """Some triangles at the arc; the rest of the mesh stays, and the dual grid is valid."""
    plan = PLANS["ring"]
    mesh = plan.mesh(n=150)
    marked = np.nonzero(mesh.p[0, mesh.t].mean(axis=0) > 2.4)[0]
    fine = plan.refine(plan.refine(mesh, marked), [0, 1])
    assert area(fine) == pytest.approx(plan.area, rel=1e-12)
    assert Quality.of(fine).uncrossed == 0
    assert mesh.nelements < fine.nelements < 3 * mesh.nelements


@pytest.mark.parametrize("name", ["ring", "stadium"])
def test_nodes_stay_on_arcs_between_small_triangles(name):
    """Long chords elsewhere do not move them off."""
    plan = PLANS[name]
    mesh = plan.mesh(n=60)
    for _ in range(5):
        mesh = plan.refine(
            mesh, np.nonzero(mesh.p[0, mesh.t].mean(axis=0) > mesh.p[0].max() - 0.3)[0]
        )
    assert area(mesh) == pytest.approx(plan.area, rel=1e-12)
    facets = mesh.facets[:, mesh.boundary_facets()]
    length, long = (
        np.hypot(*(mesh.p[:, facets[1]] - mesh.p[:, facets[0]])),
        np.zeros(mesh.nvertices),
    )
    np.maximum.at(long, facets.ravel(), np.tile(length, 2))
    nodes = np.unique(facets)
    off = np.min([ring.sides.distance(mesh.p[:, nodes]) for ring in plan.rings], axis=0)
    least = min(ring.sides.radius[ring.sides.curved].min() for ring in plan.rings)
    assert long.max() > 10 * long[nodes].min()
    assert np.all(off < 0.5 * long[nodes] ** 2 / least)


def test_a_mesh_of_another_plan_is_refused():
    with pytest.raises(MeshError, match=r"a mesh of this plan, got .* not on its outline"):
        PLANS["L"].refine(PLANS["stadium"].mesh(n=60))
    square = Plan.from_polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    halved = Plan.from_polygon([(0, 0), (0.01, 0), (1, 0), (1, 1), (0, 1)])
    with pytest.raises(MeshError, match=r"a node in every corner, got none at \(0.01, 0\)"):
        halved.refine(square.mesh(n=60))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Plan.from_polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), r"itself at \(0.5, 0.5\)"),
        (
            lambda: Plan.from_polygon([(0, 0), (1, 0), (2, 0)]),
            r"got none at \(., 0\), where the line turns back",
        ),
        (lambda: Plan.from_polygon([(0, 0), (1e-200, 0), (0, 1e-200)]), "extent from 1e-100 on"),
        (
            lambda: Plan.from_polygon([(0, 0), (1, 0), (1, 0), (0, 1)]),
            r"without duplicate corners, got corners 1 and 2 both at \(1, 0\)",
        ),
        (
            lambda: Plan.from_polygon([(0, 0), (2, 0), (2 + 3e-7, 0), (4, 0), (4, 3), (0, 3)]),
            r"without duplicate corners, got corners 1 and 2 both at \(2, 0\)",
        ),
        (
            lambda: Plan.from_polygon([(0, 0), (2, 0), (2, 1), (2, -1), (0, 1)]),
            r"got none at \(2, 1\), where",
        ),
        (
            lambda: Plan.from_polygon(L_SHAPE, [[(4, 4), (5, 4), (5, 5)]]),
            r"hole 0, near \(4, 4\), to lie inside the outline",
        ),
        (
            lambda: Plan.from_polygon(L_SHAPE, [[(0.5, 0.5), (1.5, 0.5), (0.5, 1.5)]]),
            r"hole 0 meeting the outline at \(1, 1\)",
        ),
        (
            lambda: Plan.circle((0, 0), 2, [Plan.circle((0, 0), 1), Plan.circle((0.1, 0), 0.5)]),
            "hole 1, near .* to lie outside hole 0",
        ),
        (
            lambda: Plan.circle((0, 0), 2, [Plan.circle((0, 0), 1), Plan.circle((1, 0), 0.5)]),
            "hole 0 meeting hole 1 at",
        ),
        (
            # sides along an axis whose boxes are apart by rounding
            lambda: (
                Plan.from_polygon([(0, 0), (0.3, 0), (0.3, 0.2), (0, 0.2)])
                + Plan.from_polygon([(0.1 + 0.2, -0.2), (1, -0.2), (1, 0.4), (0.1 + 0.2, 0.4)])
            ),
            r"part 1 meeting .*\(0.3, ",
        ),
        (lambda: Plan.circle((0, 0), 2, [Plan.circle((1, 0), 1)]), r"hole 0 at \(2, .*\)"),
        (lambda: Plan.circle((0, 0), 1) + Plan.circle((2, 0), 1), r"part 1 at \(1, "),
        (
            lambda: Plan.circle((0, 0), 2) + Plan.circle((0, 0), 1),
            "outline of part 1, near .*within the outline of part 0",
        ),
        # the bulge of one side reaches another one
        (
            lambda: Plan.from_polygon(
                [(0, 0), (2, 0), (2, 0.4), (1.8, 0.4, -1.0), (0.2, 0.4), (0, 0.4)]
            ),
            r"meeting itself at",
        ),
        (lambda: Plan.from_rings([]), "expected at least one ring"),
        (lambda: Plan.from_polygon(np.zeros((2, 0))), "expected at least 3 points for corners"),
        (
            lambda: Plan.from_polygon([(0, 0), (1, 1)]),
            "expected at least 3 points for corners, got 2",
        ),
    ],
)
def test_outlines_that_are_none(make, message):
    with pytest.raises(MeshError, match=message):
        make()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Plan.from_polygon([(0, 0, 1), (1, 0, 1)]), "two triples"),
        (lambda: Plan.from_polygon([(0, 0), (1, 0), (0, 1)], bulges=[1]), r"bulges of shape"),
        (lambda: Plan.from_polygon([(0, 0), (1, 0), (0, np.nan)]), "finite corners"),
        (lambda: Plan.from_polygon([[1, 2, 3, 4]]), r"pairs \(x, y\).*got shape \(1, 4\)"),
        (lambda: Plan.from_polygon([(0, 0, 2e3), (1, 0), (0, 1)]), "bulges up to 1000"),
        (lambda: Plan.circle((0, 0), -1), "positive radius"),
        (lambda: Plan.circle((0, 0), 2, [PLANS["two"]]), "one part without holes for holes"),
        (lambda: Plan.bulge((0, 0), (0, 0), (1, 0)), "three points that differ"),
        (lambda: PLANS["L"].mesh(n=100, graded="sine"), "graded as a number"),
        (lambda: PLANS["two"].mesh(n=5), "expected n from"),
    ],
)
def test_wrong_numbers(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_wrong_types():
    with pytest.raises(TypeError, match=r"a list of pairs \(x, y\)"):
        Plan.from_polygon("0,0 1,0 0,1")
    with pytest.raises(TypeError, match="expected a sequence for holes"):
        Plan.from_polygon(L_SHAPE, 3)
    with pytest.raises(TypeError, match=r"got \(0, 0\). Remedy: Plan.from_polygon"):
        Plan([(0, 0), (1, 0), (0, 1)])
    with pytest.raises(ValueError, match="at least one part"):
        Plan(())
    with pytest.raises(TypeError):
        PLANS["L"] + 1


def test_rings_find_their_places():
    """Outlines, holes and islands in any order."""
    circles = [Plan.circle((0, 0), r) for r in (1.0, 4.0, 2.0, 3.0)]
    plan = Plan.from_rings([*circles, Plan.circle((9, 0), 1.0)])
    assert plan.area == pytest.approx(np.pi * (16 - 9 + 4 - 1 + 1))
    assert len(plan.parts) == 3
    assert plan.contains([[3.5, 2.5, 1.5, 0.5, 9.0], [0.0] * 5]).tolist() == [
        True,
        False,
        True,
        False,
        True,
    ]


def test_picture():
    """Drawn with the holes open, and corners numbered as `corners` has them."""
    plan = PLANS["two"]
    ax = plan.plot()
    canvas = ax.figure.canvas
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba())[::-1]
    inside = np.array([(0.5, 2.0), (2.5, 2.5), (0.5, 0.5), (2.0, 2.0)])
    column, row = ax.transData.transform(inside).round().astype(int).T
    filled = (image[row, column, :3] < 250).any(axis=1)
    assert filled.tolist() == plan.contains(inside.T).tolist() == [True, True, False, False]
    assert [t.get_text() for t in ax.texts] == [str(i) for i in range(plan.corners.shape[1])]
    plt.close("all")


def test_plans_too_far_away_for_their_size():
    """Their coordinates have no digits left, by which meshes ended in an error of scipy."""
    for away in (1e9, 1e12):
        plan = Plan.from_polygon([(away, 0), (away + 2, 0), (away + 2, 2)])
        assert plan.area == pytest.approx(2.0, rel=1e-4)
    with pytest.raises(MeshError, match=r"size of 2 at 1e\+15. Remedy: coordinates from a point"):
        Plan.from_polygon([(1e15, 0), (1e15 + 2, 0), (1e15 + 2, 2)])


@pytest.mark.parametrize("n", [60, 100, 200])
@pytest.mark.parametrize("gap", [0.05, 0.01, 0.001, *slow(0.02, 0.003)])
@pytest.mark.parametrize("name", ["circles", "square", "ringed"])
def test_parts_close_beside_arcs_do_not_overlap(name, gap, n):
    """Nodes of arcs lie outside of them for their area: facets are short where others are near."""
    disc = Plan.circle((0, 0), 1)
    plan = {
        "circles": lambda: disc + Plan.circle((2 + gap, 0), 1),
        "square": lambda: disc + rectangle((1 + gap, -1), (3, 1)),
        "ringed": lambda: disc + rectangle((-2, -2), (2, 2), Plan.circle((0, 0), 1 + gap)),
    }[name]()
    mesh = plan.mesh(n=n)
    dual = DualMesh.from_mesh(mesh)  # which no place covered twice has
    assert dual.areas.sum() == pytest.approx(plan.area, rel=1e-12)


@pytest.mark.parametrize("gap", [0.002, *slow(0.005, 0.01)])
@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_discs_of_other_sizes_close_to_each_other(angle, gap):
    """Facets grow from where they are short by less than the gap does."""
    away = (3.5 + gap) * np.array([np.cos(angle), np.sin(angle)])
    plan = Plan.circle((0, 0), 1) + Plan.circle(tuple(away), 2.5)
    for n in (40, 100, 300):
        dual = DualMesh.from_mesh(plan.mesh(n=n))
        assert dual.areas.sum() == pytest.approx(plan.area, rel=1e-12)


def rectangle(low, high, *holes):
    (a, b), (c, d) = low, high
    return Plan.from_polygon([(a, b), (c, b), (c, d), (a, d)], list(holes))


def test_no_arc_leads_through_a_point_beyond_its_ends():
    with pytest.raises(ValueError, match=r"between start and end for through, got \(3, 0\)"):
        Plan.bulge((0, 0), (3, 0), (2, 0))
    assert Plan.bulge((0, 0), (1.5, 0), (2, 0)) == 0.0
    with pytest.raises(ValueError, match="between start and end for through"):
        Plan.bulge((0, 0), (0.3, 0.9), (0.1, 0.3))


@pytest.mark.parametrize("bulge", [0.0, 3e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3, 0.0299, 0.0301, 0.5])
def test_centroids_of_flat_arcs(bulge):
    """By a parabola or a sector; walls of rounded coordinates have such arcs."""
    plan = Plan.from_polygon([(0, 0), (2, 0, bulge), (2, 2), (0, 2)])
    angle = 4 * np.arctan(bulge)
    if bulge < 1e-2:
        area, moment = 4 * bulge / 3, 4 * bulge / 3 * (2 + 2 * bulge / 5)
    else:
        radius = 1 / np.sin(angle / 2)
        area = radius**2 * (angle - np.sin(angle)) / 2
        moment = (
            area * (2 - radius * np.cos(angle / 2)) + 2 / 3 * radius**3 * np.sin(angle / 2) ** 3
        )
    assert plan.area == pytest.approx(4 + area, rel=1e-9)
    assert plan.centroid[0] == pytest.approx((4 + moment) / (4 + area), abs=1e-9)
    assert plan.centroid[1] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("bulge", [0.0, 2e-9, 1e-8, 1e-6, 1e-5, 1e-4, 1e-2])
def test_flat_arcs_that_cross_are_refused(bulge):
    square = [(0, 0, bulge), (2, 0), (2, 2), (0, 2)]
    with pytest.raises(MeshError, match="neither cross nor touch"):
        Plan.from_polygon(square, holes=[[(0.8, 0.5), (1.1, -0.2), (1.3, 0.6)]])
    with pytest.raises(MeshError, match="neither cross nor touch"):
        Plan.from_polygon([(0, 0, bulge), (2, 2, bulge), (2, 0.3, bulge), (-0.1, 2.1, bulge)])
