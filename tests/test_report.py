"""The report: a page that stands alone, with the numbers of the solution in it."""

import dataclasses
import re
import sys
import warnings
from base64 import b64decode
from datetime import datetime
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import numpy as np
import pytest
from marks import slow
from plans import disc, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP1, MeshTri

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    Plan,
    RigidPunch,
    RigidPunches,
    __version__,
    solve_plan,
)
from skfem_dual.contact import methods
from skfem_dual.grids import generate
from skfem_dual.grids.generate import polygon
from skfem_dual.io import read_mesh
from skfem_dual.report import figures, report_html, write_report
from skfem_dual.report.depth import depth_section
from skfem_dual.report.details import Details
from skfem_dual.report.input import ground_table
from skfem_dual.report.numbers import (
    Standing,
    characteristic_points,
    distance_inside,
    outline_corners,
    reach,
)
from skfem_dual.report.page import NONE, STYLE, Html, coordinate, escaped, number, one_to
from skfem_dual.report.pdf import require_pdf

SOIL = HalfSpace(30e6, 0.25)
DISC = DualMesh.from_mesh(disc(3))
COARSE = DualMesh.from_mesh(disc(2))
L_SHAPE = DualMesh.from_mesh(
    polygon([[-1.5, 1.5, 1.5, -0.5, -0.5, -1.5], [-1.5, -1.5, -0.5, -0.5, 1.5, 1.5]], n=80)
)
SPOKEN = {"title", "h1", "strong", "p"}
DATE = datetime(2024, 5, 6, 7, 8)
VOID = {"meta", "img", "br", "link", "input", "hr", "source", "base"}
URI = "data:image/png;base64,"


class Page(HTMLParser):
    """Elements of a page; fails where they are not well formed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.attributes, self.classes = [], [], [], []
        self.tables, self.cell, self.texts = [], None, {}
        self.feed(text)
        self.close()
        assert not self.open, f"never closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)
        if tag in SPOKEN:
            self.texts.setdefault(tag, []).append("")
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append({"text": "", "values": []})
        elif tag == "data":
            value = float(dict(attrs)["value"])
            if "table" in self.open:
                self.tables[-1][-1][-1]["values"].append(value)

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "table" in self.open and {"td", "th"} & set(self.open):
            self.tables[-1][-1][-1]["text"] += data
        for tag in SPOKEN & set(self.open):
            self.texts[tag][-1] += data

    @property
    def rows(self):
        """Cells of the rows by the text of the first cell, the first of that name."""
        found = {}
        for table in self.tables:
            for name, *cells in table:
                found.setdefault(name["text"], cells)
        return found

    def values(self, name):
        return [v for cell in self.rows[name] for v in cell["values"]]

    def text(self, name):
        return self.rows[name][0]["text"]

    def said(self, tag="p"):
        return " ".join(self.texts.get(tag, []))


def solved(dual=DISC, force=1.2e6, at=(0.1, 0.05), soil=SOIL, **options):
    return RigidPunch(soil, dual.basis(), **options).solve(force, at)


def page(solution, **options):
    return Page(report_html(solution, **options))


# ---------------------------------------------------------------- the page as a whole


@pytest.fixture(scope="module")
def annulus():
    mesh = read_mesh(Path(__file__).parent / "data" / "eccentric_annulus.msh")
    solution = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis()).solve(1.2e6, (0.6, 0.05))
    text = report_html(solution, mesh_name="annulus.msh", date=DATE)
    return solution, text


def test_page_stands_alone(annulus):
    text = annulus[1]
    found = Page(text)
    assert 0 < len(annulus[0].contact) < len(annulus[0].pressure)  # drawn with its edge
    assert text.startswith("<!DOCTYPE html>")
    assert text.count("</html>") == 1
    assert not {"script", "link", "iframe", "object", "base"} & set(found.tags)
    assert all(v.startswith("data:image/") for _, name, v in found.attributes if name == "src")
    assert not [a for a in found.attributes if a[1] in ("href", "srcset", "action", "background")]
    assert not re.search(r"https?://|url\(|@import", text)
    names = {value for tag, name, value in found.attributes if (tag, name) == ("meta", "name")}
    assert "viewport" in names
    assert "@media print" in text
    assert found.tags.count("img") == found.tags.count("figure") == 4
    assert all(value for _, name, value in found.attributes if name == "alt")


def test_pictures_are_small_drawings_without_references(annulus):
    text = annulus[1]
    assert len(text) < 700_000
    pictures = re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', text)
    assert len(pictures) == 4
    for picture in pictures:
        root = ElementTree.fromstring(b64decode(picture))
        assert root.tag.endswith("svg")
        links = [v for node in root.iter() for k, v in node.attrib.items() if k.endswith("href")]
        assert all(link.startswith(("#", "data:image/png")) for link in links)
    mesh = b64decode(pictures[0]).decode()
    assert mesh.count("<path") < 100  # one for all the lines of a grid
    assert max(mesh.count("L "), mesh.count("M ")) > 2000


def test_pictures_leave_matplotlib_alone_and_do_not_depend_on_it(annulus):
    """One over the plan, as all of these are drawn, and the profile."""
    solution, text = annulus
    figures_before = plt.get_fignums()
    with plt.style.context("dark_background"):
        before = dict(plt.rcParams)
        again, _ = figures.isobar_picture(solution, Standing(solution))
        profile = depth_section(solution, Details())
        assert plt.rcParams == before
    assert plt.get_fignums() == figures_before
    assert again.uri in text
    assert profile in text
    assert "2024-05-06 07:08" in text


def test_many_lines_become_pixels(monkeypatch):
    monkeypatch.setattr(figures, "LINES", 10)
    solution = solved()
    found = figures.mesh_picture(solution, Standing(solution))
    assert b64decode(found.uri.removeprefix(URI)).startswith(b"\x89PNG")
    assert 300 < found.width < 800


@pytest.mark.usefixtures("undrawn")
def test_user_texts_are_escaped():
    nasty = '<script>alert("1")</script> & \'\x00\udcff'
    text = report_html(solved(), title=nasty, mesh_name=nasty, remarks=[nasty])
    text.encode("utf-8")
    found = Page(text)
    assert "script" not in found.tags
    shown = nasty.replace("\x00", "\ufffd").replace("\udcff", "?")
    assert found.texts["title"] == found.texts["h1"] == [shown]
    assert found.text("Mesh") == shown
    assert shown in found.said("p")
    assert "\x00" not in text


# ---------------------------------------------------------------- numbers


def shown(text):
    """The number a reader sees."""
    text = text.replace("\u202f", "").replace("−", "-").replace(" ", "")
    return float(re.sub(r"×10(-?\d+)", r"e\1", text))


@pytest.mark.parametrize(
    "value",
    [0.0, 1.0, -2.5, 0.018838412, 1.2e6, 30e6, 999999.6, -1.23456e-7, 4.5e9, 1e-4, 9.99996e8],
)
def test_numbers_read_as_written(value):
    found = number(value)
    text = re.sub(r"<.*?>", "", found)
    assert shown(text) == pytest.approx(value, rel=6e-5)
    assert float(re.search('value="(.*?)"', found)[1]) == value


def test_small_pieces():
    assert number(np.nan) == number(np.inf) == "–"
    assert "30\u202f000\u202f000" in number(30e6)
    assert "−1.2346 × 10<sup>−7</sup>" in number(-1.23456e-7)
    assert escaped("a < b") == "a &lt; b"
    assert escaped(Html("<br>")) == "<br>"
    assert ">512\u202f345.25<" in coordinate(512345.25, 3.0)
    assert coordinate(-1.6e-17, 1.0) == number(0.0)
    assert one_to(0.0) == one_to(1e-3, negligible=True) == "level"
    assert re.sub("<.*?>", "", one_to(-0.002)) == "1 : 500"


@pytest.mark.usefixtures("undrawn")
def test_results_are_those_of_the_solution():
    solution = solved()
    found = page(solution)
    for name, expected in {
        "Settlement W0 of the origin": solution.settlement,
        "Tilt Lx, along x": solution.tilt[0],
        "Contact area": solution.contact_area,
        "Mean pressure on the contact area": solution.mean_pressure,
        "Largest mean pressure of a cell": solution.pressure.max(),
        "Smallest mean pressure of a cell": solution.pressure.min(),
        "Force P": 1.2e6,
        "Young's modulus E": 30e6,
    }.items():
        assert found.values(name)[0] == expected
    for name, cells in found.rows.items():  # what is read is what is meant
        for cell in cells:
            if len(cell["values"]) == 1 and re.fullmatch(r"[\d\u202f.−× ]+", cell["text"]):
                value = cell["values"][0]
                assert shown(cell["text"]) == pytest.approx(value, rel=6e-2, abs=0), name
    place = solution.punch.partition.centroids[:, np.argmax(solution.pressure)]
    assert found.values("in the cell around") == pytest.approx(place)
    strength = solution.edge_coefficient().values.max()
    assert found.values("Largest strength at the edge")[0] == strength
    assert found.values("of the area of the plan") == pytest.approx([100.0])
    assert __version__ in found.text("Versions")
    assert np.__version__ in found.text("Versions")
    assert found.text("Converged") == "yes"
    assert "caution" not in [value for _, _, value in found.attributes]


@pytest.mark.usefixtures("undrawn")
def test_corners_settle_like_a_rigid_body():
    """Against a plane fitted to the settlements of the ground under the punch."""
    dual = DualMesh.from_mesh(rectangle(8, 1.0, 2.0).translated((3.0, 1.0)))
    solution = solved(dual, at=(2.9, 1.2), origin=(0.2, -0.1))
    assert solution.success
    assert (solution.gap == 0).all()
    x = solution.punch.collocation_points
    ground = solution.displacement(x)
    plane = np.linalg.lstsq(np.column_stack([np.ones(x.shape[1]), *x]), ground, rcond=None)[0]
    found = page(solution)
    table = next(t for t in found.tables if t[0][0]["text"] == "Point")
    corners = {(2.0, -1.0): "A", (4.0, -1.0): "B", (4.0, 3.0): "C", (2.0, 3.0): "D"}
    assert len(table) == 5
    for name, *cells in table[1:]:
        cx, cy, w = (cell["values"][0] for cell in cells)
        assert corners.pop((round(cx, 9), round(cy, 9))) == name["text"]
        # by the work of the pressures, not in the collocation points only
        assert w == pytest.approx(plane @ [1.0, cx, cy], rel=2e-3)
        assert w == pytest.approx(solution.punch_displacement([[cx], [cy]])[0], rel=1e-12)
    assert not corners
    at = solution.punch_displacement([[2, 4, 4, 2], [-1, -1, 3, 3]])
    assert found.values("Largest settlement")[0] == pytest.approx(at.max())
    assert found.values("Smallest settlement")[0] == pytest.approx(at.min())
    assert found.values("Difference of both") == pytest.approx([np.ptp(at)])
    centre = found.values("Settlement of the centroid of the plan")
    assert centre == pytest.approx(solution.punch_displacement([[3.0], [1.0]]))


@pytest.mark.usefixtures("undrawn")
def test_slopes():
    punch = RigidPunch(SOIL, DISC.basis())
    found = page(punch.solve(settlement=0.1, tilt=(0.002, -0.001)))
    assert found.values("Tilt Lx, along x") == pytest.approx([0.002, 500.0])
    assert found.values("Tilt Ly, along y") == pytest.approx([-0.001, 1000.0])
    assert found.values("Tilt in all") == pytest.approx([np.sqrt(5e-6), 447.2136])
    assert found.values("Direction in which it goes downfrom the x axis, anticlockwise") == [
        pytest.approx(-26.565)
    ]
    assert found.values("Largest settlement")[0] == pytest.approx(0.1 + np.sqrt(5e-6), rel=1e-3)
    level = page(punch.solve(1.2e6))
    assert level.text("Tilt in all").endswith("level")
    assert not [name for name in level.rows if name.startswith("Direction")]


def polygon_points(n, turn=0.0):
    angle = 2 * np.pi * np.arange(n) / n + turn
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("shift", [0.0, 1e7])
def test_characteristic_points(shift):
    def points(p, corners=()):
        corners = p[:, list(corners)] if corners else np.empty((2, 0))
        return characteristic_points(p + shift, corners + shift) - shift

    square = np.array([[0.0, 2.0, 2.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0, 0.5]])
    assert points(square, range(4)) == pytest.approx(square[:, :4], abs=1e-6)
    turned = np.array([[0.8, -0.6], [0.6, 0.8]]) @ square
    assert points(turned, range(4)) == pytest.approx(turned[:, :4], abs=1e-6)
    assert sorted(points(turned)[0]) == pytest.approx(sorted(turned[0, :4]), abs=1e-6)
    # curves: the extreme points, the middle of a facet where it lies on one
    assert points(polygon_points(72)) == pytest.approx(
        np.array([[0, 1, 0, -1], [-1, 0, 1, 0]]), abs=1e-6
    )
    flat = points(polygon_points(36, np.pi / 36))
    assert np.hypot(*flat) == pytest.approx(np.cos(np.pi / 36), abs=1e-6)
    assert points(polygon_points(16)).shape == (2, 4)
    assert points(polygon_points(8), range(8)).shape == (2, 8)
    # both: a half-circle has two corners and a crown
    half = polygon_points(72)[:, :37]
    expected = np.array([[-1, 1, 0], [0, 0, 1]])
    assert points(half, (36, 0)) == pytest.approx(expected, abs=1e-6)


def test_reserves_by_hand():
    square = np.array([[0.0, 2.0, 2.0, 0.0], [0.0, 0.0, 2.0, 2.0]])
    centre = np.array([1.0, 1.0])
    assert reach(square, centre, np.array([1.25, 1.0])) == pytest.approx(4.0)
    assert reach(square, centre, np.array([3.0, 1.5])) == pytest.approx(0.5)
    assert reach(square, centre, centre) == np.inf
    assert np.isnan(reach(square, np.array([3.0, 1.0]), centre))
    assert distance_inside(square, np.array([0.25, 1.0])) == pytest.approx(0.25)
    assert distance_inside(square, np.array([2.5, 1.0])) == pytest.approx(-0.5)
    several = np.array([[1.25, 1.0, np.nan], [1.0, 1.0, np.nan]])
    assert reach(square, centre, several) == pytest.approx([4.0, np.inf, np.nan], nan_ok=True)
    assert distance_inside(square, several) == pytest.approx([0.75, 1.0, np.nan], nan_ok=True)


# ---------------------------------------------------------------- contact and load


TO_EDGE = "Distance to the edge of the convex hull"
LIFT, TURN = (
    "Reserve against lifting off1 or more: whole base in contact",
    ("Reserve against overturning1: it turns over"),
)


@pytest.mark.usefixtures("undrawn")
def test_circle_within_its_kern():
    """The kern of a circle reaches a / 3, its hull a."""
    found = page(solved(at=(0.2, 0.0)))
    assert found.text("Within the kern") == "yes: whole base in contact"
    assert found.values(LIFT) == pytest.approx([1 / 0.6], rel=2e-2)
    assert found.values(TURN) == pytest.approx([5.0], rel=1e-2)
    assert found.values(TO_EDGE) == pytest.approx([0.8], rel=2e-2)
    assert found.values("Part of the plan out of contact") == [0.0]
    central = page(solved(at=(0.0, 0.0)))
    assert central.text(LIFT) == central.text(TURN) == "the force acts in the centroid"


@pytest.mark.usefixtures("undrawn")
def test_circle_lifting_off():
    """At e = 0.5 a 0.735 of the plan stay in contact."""
    solution = solved(at=(0.5, 0.0))
    found = page(solution)
    assert found.values("of the area of the plan") == pytest.approx([73.5], abs=2)
    assert found.values("Part of the plan out of contact") == pytest.approx([26.5], abs=2)
    assert found.text("Within the kern") == "no: the punch lifts off"
    assert found.values(LIFT) == pytest.approx([2 / 3], rel=2e-2)
    assert found.values(TURN) == pytest.approx([2.0], rel=1e-2)
    assert int(found.text("Iterations for the contact region")) == solution.iterations > 0
    assert found.tags.count("img") == 4


@pytest.mark.usefixtures("undrawn")
def test_ground_that_pulls():
    solution = RigidPunch(SOIL, DISC.basis()).solve(1.2e6, (0.7, 0.0), unilateral=False)
    found = page(solution)
    assert "NOT CONVERGED" not in found.said("strong")
    assert found.text("Within the kern").startswith("no: the ground has to pull")
    share = 100 * solution.punch.partition.areas[solution.pressure < 0].sum() / np.pi
    assert share > 10
    assert f"pull on {share:.3g} % of the plan" in found.said()
    assert "Caution" in found.said("strong")
    beyond = page(RigidPunch(SOIL, DISC.basis()).solve(1.2e6, (1.2, 0.0), unilateral=False))
    assert "the punch turns over" in beyond.said()
    assert beyond.values(TURN)[0] < 1


@pytest.mark.usefixtures("undrawn")
def test_not_converged_is_glaring(monkeypatch):
    real = methods.conjugate_gradients
    monkeypatch.setattr(methods, "conjugate_gradients", lambda p, x, rtol, *_: real(p, x, rtol, 1))
    with pytest.warns(ConvergenceWarning):
        solution = RigidPunch(SOIL, DISC.basis()).solve(1.2e6, (0.5, 0.0), method="cg")
    assert not solution.success
    found = page(solution, title="Pier 3", remarks=[solution.message])
    assert found.texts["title"] == found.texts["h1"] == ["NOT CONVERGED: Pier 3"]
    assert ("div", "class", "fault") in found.attributes
    assert "do not use these results" in found.said("strong")
    assert found.said().count(solution.message) == 1
    assert found.text("Converged") == "NO"
    fine = solved()
    assert "NOT CONVERGED" not in report_html(fine)


@pytest.mark.usefixtures("undrawn")
def test_moments_alone():
    solution = RigidPunch(SOIL, L_SHAPE.basis()).solve(0.0, moments=(1e5, 2e5), unilateral=False)
    text = report_html(solution)
    assert "nan" not in re.sub(r'src="[^"]*"', "", text).lower()
    assert "Isobars of p / max |p|" in text
    found = Page(text)
    assert "no force" in found.text("Resultant")
    assert found.values("Mean pressure on the contact area") == [0.0]
    assert found.rows["Force [F]"][0]["values"] == [0.0]
    assert found.values("First moment along x [F·L]")[:2] == pytest.approx([-1e5, -1e5])
    assert found.values("First moment along y [F·L]")[:2] == pytest.approx([2e5, 2e5])
    moments = next(name for name in found.rows if name.startswith("Moments (Mx, My)"))
    assert found.values(moments) == [2e5, -1e5]
    about_y = page(RigidPunch(SOIL, COARSE.basis()).solve(1e6, moments=(0.0, 5.0)))
    assert "\N{MINUS SIGN}" not in about_y.text(moments)


@pytest.mark.usefixtures("undrawn")
def test_imposed_settlements():
    punch = RigidPunch(SOIL, DISC.basis())
    free = punch.solve(settlement=0.02, at=(0.1, 0.0))
    found = page(free)
    assert found.values("Settlement of the origin, imposed") == [0.02]
    rows = [row for table in found.tables for row in table if row[0]["text"] == "Force [F]"]
    (resultant,) = rows
    assert [cell["text"] for cell in resultant[1:4:2]] == ["free", "–"]
    assert resultant[2]["values"] == [free.force]
    assert found.values("Settlement of the origin [L]")[:3] == [0.02, 0.02, 0.0]
    assert found.values("First moment along x [F·L]")[0] == pytest.approx(0.1 * free.force)
    held = punch.solve(settlement=0.02, tilt=(0.001, 0.0))
    found = page(held)
    assert found.text("First moment along x [F·L]") == "free"
    assert found.values("Tilt (Lx, Ly), imposed") == [0.001, 0.0]


@pytest.mark.usefixtures("undrawn")
def test_resultant_against_the_load():
    solution = RigidPunch(SOIL, DISC.basis(), origin=(0.3, 0.0)).solve(
        1e6, (-0.2, 0.1), (3e4, 2e4)
    )
    standing = Standing(solution)
    assert standing.imposed == pytest.approx([1e6, -2e5 - 3e4, 1e5 + 2e4])
    assert solution.resultant - standing.imposed == pytest.approx(
        solution.resultant_residual, abs=1e-6
    )
    assert standing.imbalance.max() < 1e-12
    wrong = dataclasses.replace(solution, resultant=solution.resultant * 1.001)
    assert "do not balance the load" in page(wrong).said()


@pytest.mark.usefixtures("undrawn")
def test_far_from_the_origin():
    near = page(solved(L_SHAPE, at=(-0.3, -0.3)))
    away = np.array([512345.25, -4301234.5])
    dual = DualMesh.from_mesh(L_SHAPE.mesh.translated(tuple(away)))
    found = page(solved(dual, at=(-0.3, -0.3), origin=tuple(away)))
    assert found.values("Settlement W0 of the origin") == pytest.approx(
        near.values("Settlement W0 of the origin"), rel=1e-7
    )
    for name in (LIFT, TURN):
        assert found.values(name) == pytest.approx(near.values(name), rel=1e-6)
    assert found.values("The resultant acts at") == pytest.approx([*(away - 0.3)])
    assert "512\u202f344.95" in found.text("The resultant acts at")
    b = next(t for t in found.tables if t[0][0]["text"] == "Point")[2]
    assert b[1]["text"] == "512\u202f346.75"
    assert not [c for c in found.attributes if c[2] == "caution"]


@pytest.mark.usefixtures("undrawn")
def test_large_deformations_are_told():
    assert "far beyond small deformations" in page(solved(force=1.2e8)).said()


@pytest.mark.usefixtures("undrawn")
def test_cautions_of_several_cases():
    """Pages of one case had them, those of several had not."""
    punch = RigidPunch(SOIL, DISC.basis())
    loads = {
        "small": {"force": 1.2e6},
        "far": {"force": 1.2e6, "at": (2.0, 0.0)},
        "large": {"force": 1.2e8},
        "very large": {"force": 1.3e8},
    }
    said = page(punch.solve_many(loads, unilateral=False)).said()
    assert "far: The ground would have to pull on" in said
    assert "far: The resultant acts beyond the convex hull of the plan" in said
    assert "large: The largest settlement is" in said
    assert "So in the case very large." in said
    assert "small: " not in said


# ---------------------------------------------------------------- error and grids


def exact_settlement(force=1.2e6, ground=SOIL, radius=1.0):
    """Of a rigid circle: P / (2 E* a)."""
    return force / (2 * ground.contact_modulus * radius)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("grid", ["basis", "primal_basis"])
@pytest.mark.parametrize("edge", ["singular", "constant"])
def test_bounds_enclose_the_exact_circle(grid, edge):
    basis = getattr(DualMesh.from_mesh(generate.disc(n=200)), grid)()
    found = page(RigidPunch(SOIL, basis, edge=edge).solve(1.2e6, (0.1, 0.0)), units="N,m")
    low, high, half, relative, *_ = found.values("Settlement at the load [mm]")
    # W0 + L e, the tilt of a circle is 3 M / (4 E* a^3)
    exact = exact_settlement() + 0.75 * 1.2e6 * 0.1**2 / SOIL.contact_modulus
    assert low < 1e3 * exact < high
    assert half == pytest.approx((high - low) / 2)
    assert relative == pytest.approx(100 * (high - low) / (high + low))
    low, high, *_ = found.values("Tilt Lx [‰]")
    assert low < 1e3 * 0.75 * 1.2e6 * 0.1 / SOIL.contact_modulus < high
    assert "not proven" in found.said()


@pytest.mark.usefixtures("undrawn")
def test_a_coarse_mesh_is_told():
    coarse = DualMesh.from_mesh(rectangle(4))
    found = page(RigidPunch(SOIL, coarse.basis(), edge="constant").solve(1.2e6))
    assert "Use a finer mesh" in found.said()
    assert "Use a finer mesh" not in page(solved()).said()


@pytest.mark.usefixtures("undrawn")
def test_the_mesh_that_was_chosen():
    plan = Plan.from_polygon([(0, 0), (3, 0), (3, 2), (0, 2)])
    solution = solve_plan(plan, SOIL, 1.2e6, accuracy=1e-2)
    found = page(solution)
    assert "The mesh was chosen for an error of 0.01" in found.said()
    assert "reached" in found.said()
    trials = next(t for t in found.tables if t[0][0]["text"] == "Cells")
    assert [int(row[0]["text"]) for row in trials[1:]] == [
        trial.cells for trial in solution.accuracy.trials
    ]
    missed = dataclasses.replace(solution.accuracy, reached=False, message="out of time")
    said = page(dataclasses.replace(solution, accuracy=missed)).said()
    assert "NOT REACHED" in said
    assert "out of time" in said


# ---------------------------------------------------------------- ground, shapes, grids


@pytest.mark.usefixtures("undrawn")
def test_layers(monkeypatch):
    monkeypatch.setattr("skfem_dual.report.depth_of_footing", lambda *a: NONE)  # takes most time
    layers = [Layer(2.0, 20e6, 0.3, gradient=0.1), Layer(5.0, 40e6, 0.35)]
    found = page(solved(COARSE, soil=LayeredHalfSpace(layers, HalfSpace(60e6, 0.25))))
    table = next(t for t in found.tables if t[0][0]["text"].startswith("Ground"))
    values = [[v for cell in row for v in cell["values"]] for row in table[1:]]
    assert values == [
        [0.0, 2.0, 20e6, pytest.approx(24e6), 0.3],
        [2.0, 7.0, 40e6, 40e6, 0.35],
        [7.0, 60e6, 60e6, 0.25],
    ]

    def told(ground):
        return Page(ground_table(ground, Details().units))

    graded = GradedHalfSpace.init_linear(30e6, 0.25, 0.5)
    assert told(graded).text("Moduli") == "E = 3e+07 (1 + 0.5 z), nu = 0.25"
    below = told(LayeredHalfSpace(layers[:1], graded)).rows
    assert any(name.startswith("below 2E = 3e+07 (1 + 0.5 z)") for name in below)
    rigid = told(LayeredHalfSpace([Layer(1.0, 1e7, 0.3)], "smooth"))
    assert [cell["text"] for cell in rigid.rows["below 1"][:2]] == [
        "rigid",
        "the layer slides on it",
    ]


@pytest.mark.usefixtures("undrawn")
def test_edges_and_collocation():
    sides = {"edge": lambda x: np.hypot(*x) > 0.75, "hole": lambda x: np.hypot(*x) < 0.75}
    dual = DualMesh.from_mesh(generate.annulus(0.5, n=60).with_boundaries(sides))
    punch = RigidPunch(SOIL, dual.basis(), edge_boundaries=["edge", "hole"])
    found = page(punch.solve(1.0))
    assert "boundaries edge and hole like" in found.text("Pressure inside the cells")
    one = page(RigidPunch(SOIL, dual.basis(), edge_boundaries="edge").solve(1.0))
    assert "the boundary edge like" in one.text("Pressure inside the cells")
    facets = RigidPunch(SOIL, COARSE.basis(), edge_boundaries=COARSE.mesh.boundary_facets())
    assert "boundary facets like" in page(facets.solve(1.0)).text("Pressure inside the cells")
    listed = dataclasses.replace(facets, edge_boundaries=facets.edge_boundaries.tolist())
    assert "boundary facets like" in page(listed.solve(1.0)).text("Pressure inside the cells")
    node = page(solved(COARSE, edge="constant", collocation="node"))
    assert node.text("Pressure inside the cells") == "constant"
    assert node.text("Collocation points") == "nodes of the other grid"
    assert "Largest strength at the edge" not in node.rows


def test_shaped_punch(request):
    """A sphere touches in a circle inside the plan; nothing is unbounded."""
    dual = DualMesh.from_mesh(MeshTri.init_circle(2).scaled(2.0))
    punch = RigidPunch(SOIL, dual.basis(), gap=Paraboloid(50.0))
    solution = punch.solve(1e6)
    assert figures.isobar_picture(solution, Standing(solution))[0].uri
    p1 = CellBasis(dual.mesh, ElementTriP1())
    field = RigidPunch(SOIL, dual.basis(), gap=(p1, 0.01 * np.hypot(*dual.mesh.p) ** 2))
    assert figures.plan_picture(Standing(field.solve(1e6)), list("ABCD"), {}).uri
    request.getfixturevalue("undrawn")
    text = report_html(solution)
    found = Page(text)
    assert found.text("Shape of the punch") == "Paraboloid(radius=50.0, centre=(0.0, 0.0))"
    assert found.text("Kern").startswith("none")
    assert "unbounded" not in text
    assert "edge of contact" in text
    values = RigidPunch(SOIL, dual.basis(), gap=0.01 * np.hypot(*punch.collocation_points) ** 2)
    assert "gaps of one grid's cells" in page(values.solve(1e6)).said()


def test_quadrilaterals_have_no_other_grid(request):
    solution = RigidPunch(SOIL, CellBasis(polar(4, 16), ElementQuad0())).solve(1.2e6, (0.1, 0.0))
    standing = Standing(solution)
    assert figures.mesh_picture(solution, standing).uri
    assert figures.isobar_picture(solution, standing)[0].uri
    request.getfixturevalue("undrawn")
    text = report_html(solution)
    assert Page(text).text("Cells with a pressure each") == "64 cells of the mesh"
    assert "Mesh of the plan." in text
    assert "quadrilaterals, which have no other grid" in Page(text).said()


@pytest.mark.usefixtures("undrawn")
def test_neighbours():
    punches = [RigidPunch(SOIL, DISC.basis())]
    beside = DualMesh.from_mesh(DISC.mesh.translated((3.0, 0.0)))
    punches.append(RigidPunch(SOIL, beside.basis(), origin=(3.0, 0.0)))
    found = RigidPunches(punches).solve([{"force": 1e6}, {"force": 2e6}])
    report = page(found.solutions[0])
    assert report.text("Neighbouring punches on the same ground") == "1"
    assert "neighbouring" in report.text("Kern")
    assert "solved on the other grid" in report.said()


def test_nothing_pressed():
    """No load: zeros, no isobars and no division by them."""
    text = report_html(RigidPunch(SOIL, DISC.basis()).solve(0.0))
    assert "No isobars: expected a load" in text
    assert Page(text).tags.count("img") == 2


# ---------------------------------------------------------------- files and wrong arguments


@pytest.mark.usefixtures("undrawn")
def test_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    solution, path = solved(), tmp_path / "report.html"
    write_report(path, solution, title="Pier 3 · ν")
    assert Page(path.read_text(encoding="utf-8")).texts["h1"] == ["Pier 3 · ν"]
    path.write_text("old")
    monkeypatch.setattr(figures, "_embedded", lambda *a, **k: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_report(path, solution)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(ValueError, match=r"ending in .html, .pdf or .json, got .*report.txt"):
        write_report(tmp_path / "report.txt", solution)


def test_matplotlib_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match=r"pip install 'skfem-dual\[visuals\]'"):
        report_html(solved())


def test_deprecations_in_the_library_of_pdf(tmp_path, monkeypatch):
    """Which are not the user's, under python -W error."""
    fake = "import warnings\nwarnings.warn('HarfBuzz-Subset', DeprecationWarning)\n"
    (tmp_path / "weasyprint.py").write_text(fake)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "weasyprint", raising=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert require_pdf().__file__ == str(tmp_path / "weasyprint.py")
    del sys.modules["weasyprint"]


def test_wrong_arguments():
    solution = solved()
    with pytest.raises(TypeError, match=r"expected a PunchSolution.*got 1\.0"):
        report_html(1.0)
    with pytest.raises(
        TypeError, match=r"got \(.*Remedy: several bodies or cases by their names, dict"
    ):
        report_html((solution, solution))
    with pytest.raises(TypeError, match="Remedy: make an object of it"):
        report_html(type(solution))
    with pytest.raises(TypeError, match="expected a Details for details, got 1"):
        report_html(solution, details=1)
    with pytest.raises(TypeError, match=r"accuracy\[''\]"):
        report_html(solution, accuracy={"": 1e-3})
    with pytest.raises(TypeError, match=r"'allowable', .*got \['allowed'\]"):
        report_html(solution, allowed=200.0)


@pytest.mark.parametrize("n", [60, 100, 150, 240])
@pytest.mark.parametrize("grid", ["basis", "primal_basis"])
def test_corners_of_a_hole_whatever_the_cells_there(n, grid):
    """The middle of a cell at a re-entrant corner may lie beyond one of its own ribs."""
    square = np.array([[0.0, 4, 4, 0], [0, 0, 4, 4]])
    mesh = polygon(square, holes=[1.5 + square / 4], n=n)
    partition = getattr(DualMesh.from_mesh(mesh), grid)().partition
    corners = outline_corners(partition)
    assert corners[:, :4] == pytest.approx(square)
    hole = [[1.5, 1.5, 2.5, 2.5], [1.5, 2.5, 2.5, 1.5]]  # the plan to the left of its sides
    assert corners[:, 4:] == pytest.approx(np.array(hole))


@pytest.mark.usefixtures("undrawn")
@pytest.mark.filterwarnings("ignore::skfem_dual.ConvergenceWarning")
def test_what_is_not_known_is_not_kept():
    """The allowable pressure, where cases have no solution."""
    punch = RigidPunch(SOIL, DualMesh.from_mesh(disc(2)).basis())
    loads = {"stands": {"force": 1.0}, "tips": {"force": 1.0, "at": (5.0, 0.0)}}
    text = report_html(punch.solve_many(loads), allowable=99.0)
    assert "It is kept. This holds for what was found; there are 1 without a solution" in text
    text = report_html(punch.solve_many({"tips": loads["tips"]}), allowable=99.0)
    assert "Whether it is kept is not known" in text
    assert "It is kept" not in text


@pytest.mark.parametrize("site", [*slow(((0.0, 0.0),)), (451000.0, 5411000.0)])
def test_pictures_of_slender_plans_have_room(monkeypatch, site):
    """Without a warning of matplotlib, and the legend below everything else."""
    drawn = []

    def written(figure, vector):
        picture = original(figure, vector)
        for legend in figure.legends:
            top = legend.get_window_extent().y1
            drawn.append(min(ax.get_tightbbox().y0 for ax in figure.axes) - top)
        return picture

    original = figures._written
    monkeypatch.setattr(figures, "_written", written)
    picture = figures.Picture(URI, 100)  # of another kind
    monkeypatch.setattr("skfem_dual.report.depth.profile_picture", lambda *a: picture)
    mesh = polygon([[0.0, 40.0, 40.0, 0.0], [0.0, 0.0, 1.5, 1.5]], n=80).translated(site)
    punch = RigidPunch(
        SOIL, DualMesh.from_mesh(mesh).basis(), origin=(site[0] + 20, site[1] + 0.75)
    )
    report_html(punch.solve(5e3), units="kN,m")
    assert len(drawn) == 3
    assert min(drawn) >= 0


def test_exponents_are_within_their_line():
    """WeasyPrint has letters nearly as large for them: they touched the rule above."""
    (rule,) = re.findall(r"^sup {(.*)}$", STYLE, re.MULTILINE)
    size = float(re.search(r"font-size: (\S+)em", rule)[1])
    rise = float(re.search(r"vertical-align: (\S+)em", rule)[1])
    figure, ascent = 0.75, 0.9  # heights over the size of letters
    assert size * (rise + figure) <= ascent
    assert size * rise > 0.2
