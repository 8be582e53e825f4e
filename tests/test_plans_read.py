"""Outlines from files, each written by the library of its format."""

import json
import sys

import ezdxf
import numpy as np
import pytest
import shapely
from scipy.interpolate import BSpline

from skfem_dual import MeshError, MeshWarning, Plan
from skfem_dual.plans.tables import corners_of_text

SITE = 451_200.0, 5_411_900.0
FRAME = shapely.Polygon(
    [(0, 0), (6, 0), (6, 4), (0, 4)], [[(1, 1), (2, 1), (2, 3)], [(4, 1), (5, 1), (5, 2)]]
)
APART = shapely.box(8, 0, 9, 1)


def drawing(path, draw):
    """A drawing with what a function puts into its model space, on the layer F."""
    document = ezdxf.new()
    draw(document.modelspace(), {"layer": "F"})
    document.saveas(path)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "0,0\n3,0\n3,1\n1,1\n1,3\n0,3\n",
        "x,y\n0,0\n3,0\n3,1\n1,1\n1,3\n0,3\n0,0\n",
        "Rechtswert;Hochwert\n0;0\n3,0;0\n3;1\n1;1\n1;3\n0;3\n",
        "Name;X [m];Y [m]\nA;0;0\nB;3,0;0\nC;3;1,0\nD;1;1\nE;1;3\nF;0;3\n",
        "\ufeff# corners\n0 3\n1 3\n1 1\n3 1\n3 0\n0 0\n",
        "Punkt;x;y\nA 1;\u22120,0;0\nA 2;3,0;0\nA 3;3;1\n1 000;1;1\nB;1;3\nC;0;3\n",
        "y\tx\n0\t0\n0\t3\n1\t3\n1\t1\n3\t1\n3\t0\n",
    ],
)
def test_corners_as_csv(tmp_path, text):
    path = tmp_path / "footing.csv"
    path.write_text(text, encoding="utf-8")
    plan = Plan.read(path)
    assert plan.area == 5.0
    assert plan.centroid == pytest.approx([1.1, 1.1])
    path.write_text(text.lstrip("\ufeff"), encoding="utf-16")  # as Unicode text of Excel
    assert Plan.read(path).area == 5.0


def test_thousands_of_corners(tmp_path):
    """Parted by blanks between semicolons; beside commas they are not guessed at."""
    path = tmp_path / "site.csv"
    path.write_text("x;y\n451 200,5;0\n451 203,5;0\n451 203,5;1\n451 200,5;1\n")
    assert Plan.read(path).area == pytest.approx(3.0)
    path.write_text("0,5 300,2\n3,5 300,2\n3,5 900,2\n")
    with pytest.raises(MeshError, match=r"line 1: expected x, y or x, y, bulge, got '0,5 300,2'"):
        Plan.read(path)


def test_rings_of_csv(tmp_path):
    """An empty line between outline and hole; a third column has bulges."""
    path = tmp_path / "ring.csv"
    path.write_text("x,y,bulge\n-2,0,1\n2,0,1\n\n-1,0,1\n1,0,1\n")
    plan = Plan.read(path)
    assert plan.area == pytest.approx(3 * np.pi)
    assert all(ring.is_circle for ring in plan.rings)
    assert corners_of_text(" 0,0  1,0.5 ") == [(0.0, 0.0, 0.0), (1.0, 0.5, 0.0)]


@pytest.mark.parametrize("shape", [FRAME, shapely.MultiPolygon([FRAME, APART])])
def test_wkt_and_geojson(tmp_path, shape):
    """As Windows writes them, with a mark of their encoding."""
    wkt, geojson = tmp_path / "plan.wkt", tmp_path / "plan.geojson"
    wkt.write_text("\ufeff" + shape.wkt)
    features = [{"type": "Feature", "properties": {}, "geometry": shapely.geometry.mapping(shape)}]
    nowhere = {"type": "Feature", "properties": {"name": "no place"}, "geometry": None}
    collection = json.dumps({"type": "FeatureCollection", "features": [*features, nowhere]})
    geojson.write_text("\ufeff" + collection)
    for path in (wkt, geojson):
        plan = Plan.read(path)
        assert plan.area == pytest.approx(shape.area)
        assert plan.centroid == pytest.approx([shape.centroid.x, shape.centroid.y])
        assert len(plan.parts) == len(shapely.get_parts(shape))
        x = np.random.default_rng(0).uniform(-1, 10, (2, 300))
        assert np.array_equal(plan.contains(x), shapely.contains_xy(shape, *x))


def test_polylines_with_bulges_and_circles(tmp_path):
    """At site coordinates: half a circle on one side, a round hole, and the other sense."""

    def draw(space, layer):
        corners = [(0, 0, 0), (4, 0, 1), (4, 2, 0), (0, 2, 0)]
        space.add_lwpolyline(
            [(x + SITE[0], y + SITE[1], b) for x, y, b in corners],
            format="xyb",
            close=True,
            dxfattribs=layer,
        )
        space.add_circle((SITE[0] + 1, SITE[1] + 1), 0.5, dxfattribs=layer)
        old = space.add_polyline2d([(9, 0), (9, 1), (8, 1)], close=True, dxfattribs=layer)
        old.translate(*SITE, 0)

    plan = Plan.read(drawing(tmp_path / "a.dxf", draw))
    assert plan.area == pytest.approx(8 + np.pi / 2 - np.pi / 4 + 0.5, rel=1e-9)
    assert (len(plan.parts), len(plan.rings)) == (2, 3)


def test_lines_and_arcs_that_join(tmp_path):
    """In any order and sense, also mirrored; gaps below the tolerance are closed."""

    def draw(space, layer):
        space.add_line((2, 1), (0, 1), dxfattribs=layer)
        space.add_arc((0, 0), 1, 90, 270, dxfattribs=layer)
        space.add_line((2, -1 + 1e-8), (0, -1), dxfattribs=layer)
        # drawn from below: x and angles are mirrored
        mirrored = {"extrusion": (0, 0, -1), **layer}
        space.add_arc((-2, 0), 1, 90, 270, dxfattribs=mirrored)

    plan = Plan.read(drawing(tmp_path / "a.dxf", draw))
    assert plan.area == pytest.approx(4 + np.pi)
    assert plan.bounds == pytest.approx(np.array([[-1, 3], [-1, 1]]))
    assert plan.corners.shape == (2, 0)


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.1])
@pytest.mark.parametrize("up", [1, -1])
def test_ellipses(tmp_path, ratio, up):
    """A whole one, turned, and a half with a line, both from above and from below."""
    axis, side = (1.8, 2.4), {"extrusion": (0, 0, up)}
    for half in (False, True):

        def draw(space, layer, half=half):
            turn = (0, np.pi) if half else (0, 2 * np.pi)
            space.add_ellipse((5, 6), axis, ratio, *turn, dxfattribs=layer | side)
            if half:
                space.add_line((6.8, 8.4), (3.2, 3.6), dxfattribs=layer)

        plan = Plan.read(drawing(tmp_path / "a.dxf", draw))
        assert plan.area == pytest.approx(9 * np.pi * ratio / (1 + half), rel=2e-4)
        assert plan.corners.shape[1] == 2 * half
        if not half:
            assert plan.centroid == pytest.approx([5, 6])


def test_splines(tmp_path):
    """Through points of a circle, and with kinks, which are corners."""
    angle = np.linspace(0, 2 * np.pi, 25)

    def round_one(space, layer):
        space.add_spline(np.stack([np.cos(angle), np.sin(angle)], axis=1), dxfattribs=layer)

    plan = Plan.read(drawing(tmp_path / "a.dxf", round_one))
    assert plan.area == pytest.approx(np.pi, rel=2e-3)

    def kinked(space, layer):
        points = [(0, 0), (3, 0), (3, 2), (0, 2), (0, 0)]
        space.add_open_spline(points, degree=1, dxfattribs=layer)

    plan = Plan.read(drawing(tmp_path / "a.dxf", kinked))
    assert plan.area == pytest.approx(6.0, rel=1e-12)
    assert plan.corners.shape[1] == 4

    def without_ends(space, layer):  # of knots that are equally far apart; one without length
        spline = space.add_spline(dxfattribs=layer)
        spline.set_closed([(0, 0, 0), (3, 0, 0), (3, 2, 0), (0, 2, 0)], degree=3)
        space.add_open_spline([(9, 9)] * 4, dxfattribs=layer)

    with pytest.warns(MeshWarning, match="left out 1 of the shapes, no longer than"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", without_ends))
    assert plan.corners.shape[1] == 0
    assert plan.centroid == pytest.approx([1.5, 1.0])
    around = np.array([(0, 0), (3, 0), (3, 2), (0, 2)] * 2)[:7]
    x, y = BSpline(np.arange(11), around, 3)(np.linspace(3, 7, 10001)).T
    assert plan.area == pytest.approx(abs(np.sum(x[:-1] * np.diff(y))), rel=1e-3)


def test_outlines_in_blocks(tmp_path):
    """Where nothing else is drawn there; on their layer, turned, scaled, in blocks of blocks."""

    def draw(space, layer):
        inner, outer = (space.doc.blocks.new(name) for name in ("inner", "outer"))
        inner.add_lwpolyline([(0, 0), (3, 0), (3, 2, 0, 0, 1.0), (0, 2)], close=True)
        outer.add_blockref("inner", (1, 1), dxfattribs={"xscale": -2, "yscale": 2})
        space.add_blockref("outer", SITE, dxfattribs=layer | {"rotation": 30})
        space.add_text("raft", dxfattribs=layer)

    with pytest.warns(MeshWarning, match="left out 1 TEXT"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", draw), layer="F")
    assert plan.area == pytest.approx(4 * (6 + np.pi * 9 / 8), rel=1e-9)

    def beside(space, layer):
        draw(space, layer)
        space.add_circle((0, 0), 1, dxfattribs=layer)

    with pytest.warns(MeshWarning, match="left out 1 INSERT, 1 TEXT"):
        assert Plan.read(drawing(tmp_path / "a.dxf", beside)).area == pytest.approx(np.pi)


def test_layers(tmp_path):
    def draw(space, layer):
        space.add_circle((0, 0), 1, dxfattribs=layer)
        space.add_line((-9, 0), (9, 0), dxfattribs={"layer": "axes"})
        space.add_text("A", dxfattribs=layer)

    path = drawing(tmp_path / "a.dxf", draw)
    with pytest.raises(MeshError, match=r"has 'F' \(1 shape\), 'axes' \(1 shape\).*layer="):
        Plan.read(path)
    with pytest.raises(MeshError, match=r"on the layer 'G' in .*, got 'F'"):
        Plan.read(path, layer="G")
    with pytest.warns(MeshWarning, match="left out 1 TEXT"):
        assert Plan.read(path, layer="f").area == pytest.approx(np.pi)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            [((0, 0), (1, 0)), ((1, 0), (0, 1)), ((0, 1), (0, 0.01))],
            r"an end at \(0, 0\); the next one is 0.01 away, at \(0, 0.01\).*tol= greater",
        ),
        (
            [((0, 0), (1, 0)), ((1, 0), (0, 1)), ((0, 1), (0, 0)), ((0, 0), (-1, 0))],
            r"got 3 that meet at \(0, 0\)",
        ),
    ],
)
def test_lines_that_do_not_close(tmp_path, lines, message):
    def draw(space, layer):
        for a, b in lines:
            space.add_line(a, b, dxfattribs=layer)

    path = drawing(tmp_path / "a.dxf", draw)
    with pytest.raises(MeshError, match=message):
        Plan.read(path)
    if len(lines) == 3:
        assert Plan.read(path, tol=0.02).area == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "", "expected corners in .*a.csv, got an empty file"),
        (
            "a.csv",
            "0,0\n1,0\nnorth\n",
            r"a.csv, line 3: expected x, y or x, y, bulge, got 'north'",
        ),
        ("a.csv", "x,y\n0,0\n1,0\nnorth\n", "as many cells as headings, 2, in .*, line 4, got 1"),
        # cells that are lost, or stand under no heading: the others would be taken for them
        (
            "a.csv",
            "x,y\n0,0\n4,0,1\n4,2\n",
            "headings, 2, in .*a.csv, line 3, got 3.*heading bulge",
        ),
        ("a.csv", "no,x,y\n1,0,0\n2,8,0\n3,6\n", "headings, 3, in .*a.csv, line 4, got 2"),
        ("a.csv", "x,y,bulge,no\n0,0,0,1\n8,0,0,2\n8,6,3\n", "headings, 4, in .*, line 4, got 3"),
        (
            "a.csv",
            "x;y\n0;0\n1,500;0\n2;1\n",
            "line 3: expected a number, got '1,500', whose comma",
        ),
        ("a.csv", "x;y\n0;0\n1,5;0\n2.5;1\n", "line 4: expected decimal commas or decimal points"),
        ("a.csv", "0,0\n1,1\n1,0\n0,1\n", r"a.csv: expected rings .* at \(0.5, 0.5\)"),
        ("a.wkt", "POLYGON((0 0, 1 0", "expected WKT in .*a.wkt: ParseException"),
        ("a.wkt", "LINESTRING(0 0, 1 0, 1 1)", "expected polygons in .*, got LineString"),
        ("a.wkt", "POLYGON EMPTY", "expected polygons in .*, got none"),
        ("a.wkt", "CURVEPOLYGON(CIRCULARSTRING(0 0,1 1,2 0,1 -1,0 0))", "expected WKT in .*a.wkt"),
        (
            "a.wkt",
            "POLYGON((0 0, 2 0, 2 2, 0 0), (3 3, 4 3, 4 4, 3 3))",
            r"holes inside their outline in .*a.wkt, got one at \(3, 3\) outside",
        ),
        (
            "a.wkt",
            "MULTIPOLYGON(((1 1,3 1,3 3,1 3,1 1)),((0 0,4 0,4 4,0 4,0 0)))",
            r"polygons apart in .*a.wkt, got polygon 0 at \(1, 1\) inside polygon 1. Remedy",
        ),
        (
            "a.wkt",
            "POLYGON((0 0,9 0,9 9,0 9,0 0),(2 2,2 8,8 8,8 2,2 2),(4 4,6 4,6 6,4 6,4 4))",
            r"holes beside each other in .*a.wkt, got one at \(4, 4\) inside another. Remedy",
        ),
        ("a.geojson", "{}", "expected GeoJSON in"),
        ("a.wkt", "POLYGON((0 0, 1 0, 1 1, 0 1))", "Remedy: end each ring with its first point"),
        ("a.geojson", "[1", "expected GeoJSON in"),
        ("a.geojson", 100_000 * "[", "expected GeoJSON in .*: nested too deeply"),
        ("a.geojson", "[]", "expected GeoJSON in .*: an object with a type"),
        (
            "a.geojson",
            '{"type": "Feature", "geometry": null}',
            "expected polygons in .*, got none",
        ),
        ("a.csv", "0,0\n1_0,0\n9,9\n", "line 2: expected x, y or x, y, bulge, got '1_0,0'"),
        ("a.csv", "0,0\n\u0663,0\n9,9\n", "line 2: expected x, y or x, y, bulge, got '.,0'"),
        ("a.dxf", "what", "expected a DXF drawing in"),
        ("a.dxf", "0\nSECTION\n", "expected a DXF drawing in .*: the file ends too soon"),
        ("a.xyz", "", "a file ending in .csv, .txt, .wkt"),
        ("a.csv", "x [m],y [cm]\n0,0\n2,0\n2,90\n", r"x and y in one unit .*, got m and cm\. Rem"),
    ],
)
def test_files_that_have_no_outline(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(MeshError, match=message):
        Plan.read(path)


@pytest.mark.parametrize(
    "name",
    [
        "urn:ogc:def:crs:OGC:1.3:CRS84",
        "urn:ogc:def:crs:EPSG::4258",
        "urn:ogc:def:crs:EPSG:9.8:4269",
        "EPSG:4326",
    ],
)
def test_degrees_are_refused(tmp_path, name):
    path = tmp_path / "a.geojson"
    degrees = {"type": "name", "properties": {"name": name}}
    path.write_text(json.dumps({"crs": degrees, **shapely.geometry.mapping(APART)}))
    with pytest.raises(MeshError, match=r"coordinates as lengths in .*, got degrees"):
        Plan.read(path)


def test_damaged_entities(tmp_path):
    """A line without an end, and one that is of no known kind."""
    path = drawing(tmp_path / "a.dxf", lambda space, layer: space.add_line((0, 0), (1, 0)))
    text = path.read_text()
    path.write_text(text.replace(" 11\n1.0\n 21\n0.0\n 31\n0.0\n", ""))
    with pytest.raises(MeshError, match=r"expected a LINE with end in .*a.dxf, got one without"):
        Plan.read(path)
    path.write_text(text.replace("AcDbEntity\n  8\n0\n100\nAcDbLine", "?").replace("LINE", "?"))
    with pytest.raises(MeshError, match=r"arcs, circles or other curves on the layer '0'"):
        Plan.read(path, layer="0")


@pytest.mark.parametrize("rise", [0.0, 1e-6, 1.0])
@pytest.mark.parametrize("kind", ["LINE", "POLYLINE", "SPLINE"])
def test_what_is_not_at_one_height_is_refused(tmp_path, kind, rise):
    corners = [(0, 0, 3), (1, 0, 3 + rise), (1, 1, 3 + rise), (0, 1, 3)]

    def draw(space, layer):
        for k in range(4):
            if kind == "LINE":
                space.add_line(corners[k], corners[(k + 1) % 4], dxfattribs=layer)
        if kind == "POLYLINE":
            space.add_polyline3d(corners, close=True, dxfattribs=layer)
        if kind == "SPLINE":
            space.add_open_spline([*corners, corners[0]], 1, dxfattribs=layer)

    path = drawing(tmp_path / "a.dxf", draw)
    if rise == 1.0:
        with pytest.raises(MeshError, match=rf"y plane, got a {kind} out of it .*, z from 3 to 4"):
            Plan.read(path)
    else:
        assert Plan.read(path).area == pytest.approx(1.0)


def test_collections_of_collections(tmp_path):
    path = tmp_path / "a.wkt"
    polygons = "MULTIPOLYGON(((0 0,4 0,4 3,0 3,0 0)),((5 0,6 0,6 1,5 1,5 0)))"
    path.write_text(f"GEOMETRYCOLLECTION(GEOMETRYCOLLECTION({polygons}))")
    assert Plan.read(path).area == pytest.approx(13.0)


def test_whole_arcs_are_circles(tmp_path):
    def draw(space, layer):
        space.add_arc((3, 1), 2.0, 30, 390, dxfattribs=layer)
        space.add_arc((3, 1), 1.0, 0, 360, dxfattribs=layer)

    plan = Plan.read(drawing(tmp_path / "a.dxf", draw))
    assert plan.area == pytest.approx(3 * np.pi)
    assert all(ring.is_circle for ring in plan.rings)


@pytest.mark.parametrize("short", [1e-4, 1e-5, 1e-6, 1e-9])
@pytest.mark.parametrize("up", [1, -1])
def test_arcs_that_are_nearly_circles_are_not_points(short, up, tmp_path):
    def hole(space, layer):
        space.add_lwpolyline([(0, 0), (12, 0), (12, 8), (0, 8)], close=True, dxfattribs=layer)
        space.add_arc(
            (6 * up, 4), 2.5, 30, 390 - short, dxfattribs=layer | {"extrusion": (0, 0, up)}
        )

    plan = Plan.read(drawing(tmp_path / "a.dxf", hole))
    assert plan.area == pytest.approx(96 - np.pi * 2.5**2, rel=1e-6)

    def alone(space, layer):
        space.add_arc((6, 4), 2.5, 0, 360 - short, dxfattribs=layer)

    assert Plan.read(drawing(tmp_path / "a.dxf", alone)).area == pytest.approx(
        np.pi * 2.5**2, rel=1e-6
    )


@pytest.mark.parametrize("start", [0.0, 0.1, 152.2, 359.9])
def test_arcs_of_a_whole_turn_are_circles(start, tmp_path):
    """A turn is 360 degrees but for rounding, which was taken for all of it."""

    def draw(space, layer):
        space.add_arc((6, 4), 2.5, start, start + 360, dxfattribs=layer)

    (ring,) = Plan.read(drawing(tmp_path / "a.dxf", draw)).rings
    assert ring.is_circle

    def reduced(space, layer):
        space.add_arc((6, 4), 2.5, start, (start + 1e-13) % 360, dxfattribs=layer)

    (ring,) = Plan.read(drawing(tmp_path / "b.dxf", reduced)).rings
    assert ring.is_circle


def test_what_lies_astray_swallows_no_hole(tmp_path):
    """Ends within a millionth of the extent join, some metres if something is at the origin."""
    x, y = 451200.0, 5411900.0

    def footing(space, layer):
        ring = [(x, y), (x + 12, y), (x + 12, y + 8), (x, y + 8)]
        for i in range(4):
            space.add_line(ring[i], ring[(i + 1) % 4], dxfattribs=layer)
        space.add_circle((x + 6, y + 4), 2.5, dxfattribs=layer)
        space.add_circle((x + 1, y + 1), 1e-9, dxfattribs=layer)
        space.add_line((0, 0), (0, 0), dxfattribs=layer)

    with pytest.warns(MeshWarning, match="left out 2 of the shapes, no longer than 1.2e-05 or"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", footing))
    assert plan.area == pytest.approx(96 - np.pi * 2.5**2, rel=1e-9)

    def stray(space, layer):
        footing(space, layer)
        space.add_circle((0, 0), 0.1, dxfattribs=layer)

    path = drawing(tmp_path / "a.dxf", stray)
    with pytest.raises(MeshError, match=r"shapes up to 12, with one at \(0, 0\). Remedy: erase"):
        Plan.read(path)
    with pytest.warns(MeshWarning, match="left out 2 of the shapes"):
        plan = Plan.read(path, tol=1.0)
    assert plan.area == pytest.approx(96 - np.pi * (2.5**2 - 0.1**2), rel=1e-9)


def test_what_does_not_show_is_left_out(tmp_path):
    def draw(space, layer):
        space.add_circle((0, 0), 2, dxfattribs=layer)
        space.add_circle((0, 0), 1, dxfattribs=layer | {"invisible": 1})

    with pytest.warns(MeshWarning, match="left out 1 hidden CIRCLE; only lines and curves that"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", draw), layer="F")
    assert plan.area == pytest.approx(4 * np.pi)

    def blocks(space, layer):
        for name, radius in (("shown", 2), ("hole", 1)):
            space.doc.blocks.new(name).add_circle((0, 0), radius)
        space.add_blockref("shown", (0, 0))
        space.add_blockref("hole", (0, 0), dxfattribs={"invisible": 1})

    with pytest.warns(MeshWarning, match="left out 1 hidden INSERT"):
        plan = Plan.read(drawing(tmp_path / "b.dxf", blocks))
    assert plan.area == pytest.approx(4 * np.pi)

    def of_others(space, layer):
        space.doc.blocks.new("hole").add_circle((0, 0), 1, dxfattribs=layer)
        space.add_circle((0, 0), 2, dxfattribs=layer)
        space.add_blockref("hole", (0, 0), dxfattribs={"invisible": 1})

    with pytest.warns(MeshWarning, match="left out 1 hidden INSERT"):
        plan = Plan.read(drawing(tmp_path / "c.dxf", of_others), layer="F")
    assert plan.area == pytest.approx(4 * np.pi)


def test_blocks_with_something_on_the_layer_are_told(tmp_path):
    def draw(space, layer):
        inner, outer = (space.doc.blocks.new(name) for name in ("inner", "outer"))
        inner.add_circle((0, 0), 1, dxfattribs=layer)
        outer.add_blockref("inner", (0, 0))
        space.add_circle((0, 0), 2, dxfattribs=layer)
        space.add_blockref("outer", (0, 0), dxfattribs={"layer": "inserts"})

    with pytest.warns(MeshWarning, match="left out 1 INSERT"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", draw), layer="F")
    assert plan.area == pytest.approx(4 * np.pi)


def test_a_drawing_without_an_outline(tmp_path):
    path = drawing(tmp_path / "a.dxf", lambda space, layer: space.add_text("A"))
    with pytest.raises(MeshError, match=r"arcs, circles or other curves in .*, got 1 TEXT"):
        Plan.read(path)


@pytest.mark.parametrize("closed", [True, False])
def test_what_is_drawn_twice_counts_once(tmp_path, closed):
    """To and fro, from another corner, with an arc, and a line without length beside it."""
    corners = [(0, 0, 0), (2, 0, 0.5), (2, 1, 0), (0, 1, 0)]
    back = [(2, 1, -0.5), (2, 0, 0), (0, 0, 0), (0, 1, 0)]

    def draw(space, layer):
        for ring in (corners, back):
            if closed:
                space.add_lwpolyline(ring, format="xyb", close=True, dxfattribs=layer)
            else:
                for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                    space.add_lwpolyline([a, (*b[:2], 0)], format="xyb", dxfattribs=layer)
        space.add_line((2, 0), (2, 0), dxfattribs=layer)

    with pytest.warns(MeshWarning, match=f"left out {2 if closed else 5} of the shapes"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", draw))
    once = Plan.from_polygon(corners)
    assert plan.area == pytest.approx(once.area, rel=1e-12)
    assert plan.centroid == pytest.approx(once.centroid, rel=1e-12)


@pytest.mark.parametrize("tol", [0.06, 0.1, 0.2, 0.3])
def test_shapes_near_each_other_are_two(tmp_path, tol):
    """Farther than what joins ends, but nearer than ten times as far: one hole was left out."""

    def draw(space, layer):
        corners = [(0, 0), (100, 0), (100, 60), (0, 60)]
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            space.add_line(a, (b[0] - 0.05, b[1]), dxfattribs=layer)
        for y in (29.65, 30.1):
            space.add_circle((50, y), 0.2, dxfattribs=layer)
        space.add_circle((50, 30.1 + 0.04), 0.2, dxfattribs=layer)  # sloppily drawn twice

    with pytest.warns(MeshWarning, match="left out 1 of the shapes"):
        plan = Plan.read(drawing(tmp_path / "a.dxf", draw), tol=tol)
    assert len(plan.rings) == 3
    assert plan.area == pytest.approx(6000 - 2 * np.pi * 0.2**2, rel=1e-3)


@pytest.mark.parametrize(("name", "package"), [("a.wkt", "shapely"), ("a.dxf", "ezdxf")])
def test_remedy_for_missing_packages(tmp_path, monkeypatch, name, package):
    """Corners as CSV do without."""
    (tmp_path / name).write_text("")
    (tmp_path / "a.csv").write_text("0,0\n1,0\n0,1\n")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=rf"{package} reads .*pip install 'skfem-dual\[plans\]'"):
        Plan.read(tmp_path / name)
    assert Plan.read(tmp_path / "a.csv").area == 0.5


def test_options_of_drawings_only(tmp_path):
    (tmp_path / "a.csv").write_text("0,0\n1,0\n0,1\n")
    with pytest.raises(ValueError, match="layer and tol for DXF drawings only"):
        Plan.read(tmp_path / "a.csv", layer="F")
    with pytest.raises(FileNotFoundError, match="no such file"):
        Plan.read(tmp_path / "none.csv")


def test_rows_of_corners_may_end_before_an_empty_bulge(tmp_path):
    path = tmp_path / "stadium.csv"
    path.write_text("no,x,y,bulge\n1,0,0\n2,4,0,1\n3,4,2,,\n4,0,2,1,\n")
    assert Plan.read(path).area == pytest.approx(8 + np.pi)
    path.write_text("sep=;\nx;y;bulge;name\n0;0;-;A\n4;0;1;B\n4;2;–;C\n0;2;1;\n", encoding="utf-8")
    assert Plan.read(path).area == pytest.approx(8 + np.pi)


def test_polylines_that_were_smoothed(tmp_path):
    """Points of the frame that steers the curve were corners beside those of the curve."""
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    curve, document = np.stack([5 + 4 * np.cos(angle), 5 + 3 * np.sin(angle)]), ezdxf.new("R2000")
    frame = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]
    line = document.modelspace().add_polyline2d([*frame, *curve.T.tolist()], close=True)
    line.dxf.flags |= 4
    for i, vertex in enumerate(line.vertices):
        vertex.dxf.flags = 16 if i < len(frame) else 8
    document.saveas(tmp_path / "smoothed.dxf")
    x, y = curve
    area = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
    assert Plan.read(tmp_path / "smoothed.dxf", tol=1e-9).area == pytest.approx(area, rel=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "x [m] y [m]\n0 0\n2 0\n2 3\n0 3\n",
        "x,y,\n0,0\n2,0\n2,3\n0,3\n",
        "x y name\n0 0 corner A\n2 0 B\n2 3 C\n0 3 -\n",
        "x/m;y/m\n0;0\n2;0\n2;3\n0;3\n",
    ],
)
def test_headings_with_units_and_words_beside_corners(text, tmp_path):
    path = tmp_path / "plan.csv"
    path.write_text(text)
    assert Plan.read(path).area == 6.0
