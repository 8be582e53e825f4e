"""What a report of several cases and footings says, and the same as data."""

import json
import sys
from dataclasses import replace
from datetime import date, datetime
from html import unescape

import numpy as np
import pytest
from plans import disc, rectangle
from scipy.spatial import ConvexHull
from test_report import L_SHAPE, Page

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Plan,
    RigidPunch,
    RigidPunches,
    bearing_pressure,
    stress_below,
)
from skfem_dual.grids.generate import annulus
from skfem_dual.report import report_html, write_report
from skfem_dual.report.bodies import between, bodies_of
from skfem_dual.report.data import SCHEMA, plain, report_data, substrate_data
from skfem_dual.report.details import Details
from skfem_dual.report.numbers import outline_corners

SOIL = HalfSpace(30e3, 0.3)
SAID = {"units": "kN,m", "allowable": 250.0, "title": "Pier 3", "author": "A. Engineer"}


@pytest.fixture(scope="module")
def cases():
    punch = RigidPunch(SOIL, L_SHAPE.basis(), origin=(-0.3, -0.3))
    return punch.solve_many(
        {
            "dead": {"force": 400.0},
            "wind": {"force": 380.0, "moments": (-250.0, 0.0)},
            "south": {"force": 380.0, "moments": (0.0, 40.0)},
        }
    )


@pytest.mark.usefixtures("undrawn")
def test_page_of_cases(cases):
    found = Page(report_html(cases, points=[(-1.0, -1.0)], **SAID))
    table = next(t for t in found.tables if t[0][0]["text"] == "Case" and len(t[0]) == 8)
    heads = [cell["text"] for cell in table[0]]
    assert heads[1] == "Settlement of the origin [mm]"
    for k, (name, *cells) in enumerate(table[1:]):
        assert name["text"] == cases.names[k]
        values = [cell["values"][0] for cell in cells[:6]]
        assert values[0] == pytest.approx(1000 * cases.settlement[k])
        assert values[1:3] == pytest.approx(1000 * cases.tilt[:, k])
        assert values[3] == pytest.approx(1000 * cases.largest_settlement[k])
        assert values[4] == pytest.approx(cases.largest_pressure[k])  # kPa are kN/m^2
        assert values[5] == pytest.approx(100 * cases.contact_share[k])
        # the kern is used up where the base begins to lift off
        assert (cells[6]["values"][0] > 100) == (cases.contact_share[k] < 1)
    moments = next(t for t in found.tables if t[0][-1]["text"] == "My [kN·m]")
    assert moments[2][-1]["values"] == [250.0]
    assert moments[3][-2]["values"] == [40.0]
    wind = cases["wind"]
    corners = next(t for t in found.tables if t[0][0]["text"] == "Point")
    assert len(corners) == 1 + 6 + 1  # all corners, the re-entrant one too, and the point wanted
    for name, x, y, least, largest, case in corners[1:]:
        at = np.array([x["values"][0], y["values"][0]])
        w = [1000 * cases[k].punch_displacement(at[:, None])[0] for k in range(3)]
        assert least["values"][0] == pytest.approx(min(w))
        assert largest["values"][0] == pytest.approx(max(w)), name
        assert case["text"] == cases.names[int(np.argmax(w))]
    used = next(t for t in found.tables if t[0][-1]["text"] == "Largest / allowable")
    assert used[2][3]["values"] == pytest.approx([100 * wind.mean_pressure / 250.0])
    assert "kept by the mean pressures, and exceeded by the largest pressure" in found.said()
    assert found.texts["h1"] == ["Pier 3"]
    assert "A. Engineer" in found.said()


@pytest.mark.usefixtures("undrawn")
def test_resultants_of_cases_as_of_one(cases):
    """Where each acts and its reserves, with the words of a page of that case alone."""
    found = Page(report_html(cases, **SAID))
    head, *rows = next(t for t in found.tables if len(t[0]) > 2 and t[0][2]["text"] == "ex [m]")
    heads = [cell["text"].removesuffix(" [m]") for cell in head]
    assert heads[2:4] == ["ex", "ey"]
    assert heads[5:] == ["Reserve against lifting off", "Reserve against overturning"]
    for name, *cells in rows:
        alone = Page(report_html(cases[name["text"]], **SAID))
        from_origin = np.add(cells[0]["values"], (0.3, 0.3))
        assert [cell["values"][0] for cell in cells[1:3]] == pytest.approx(from_origin, abs=1e-9)
        for k in (1, 4, 5, 6):
            (own,) = (row for text, row in alone.rows.items() if text.startswith(heads[k]))
            assert cells[k - 1]["values"] == pytest.approx(own[0]["values"], abs=1e-9), heads[k]


@pytest.mark.usefixtures("undrawn")
def test_a_case_without_solution_is_told():
    punch = RigidPunch(SOIL, L_SHAPE.basis())
    with pytest.warns(ConvergenceWarning):
        cases = punch.solve_many({"dead": {"force": 1.0}, "gale": {"force": 1.0, "at": (3, 0)}})
    found = Page(report_html(cases))
    assert found.texts["h1"][0].startswith("NO SOLUTION: ")
    solver = next(t for t in found.tables if t[0][0]["text"] == "Solver")
    assert [cell["text"] for cell in solver[1][:2]] == ["Case", "dead"]
    assert "NO SOLUTION in the case gale" in found.said("strong")
    data = report_data(bodies_of(cases, Details()))
    assert (data["success"], data["footings"][0]["cases"][1]["success"]) == (False, False)
    assert data["footings"][0]["cases"][1]["settlement"] is None
    with pytest.warns(ConvergenceWarning):
        nothing = punch.solve_many([{"force": 1.0, "at": (3, 0)}])
    text = report_html(nothing)
    assert "NO SOLUTION" in text
    lost = replace(cases["dead"], success=False, message="gave up")
    both = Page(report_html(replace(cases, solutions=(lost, None))))
    assert both.texts["h1"][0].startswith("NOT CONVERGED: ")  # not for loads alone
    # nor does what does not hold count against the allowable pressure, or for it
    wild = replace(cases["dead"], pressure=99 * cases["dead"].pressure, success=False)
    mixed = replace(cases, solutions=(cases["dead"], wild))
    (body,) = bodies_of(mixed, Details(allowable=1.0))
    assert np.nanmax(body.utilisation) == pytest.approx(bearing_pressure(cases["dead"]))
    said = "kept. This holds for what was found; there are 1 without a solution"
    assert said in unescape(report_html(mixed, allowable=1e3))
    (over,) = (t[1] for t in Page(text).tables if t[0][-1]["text"].endswith("overturning"))
    assert 0 < over[-1]["values"][0] < 1
    assert over[-2]["values"][0] < 0  # beyond the edge
    json.dumps(report_data(bodies_of(nothing, Details())), allow_nan=False)


def pair_of_footings():
    meshes = {"left": rectangle(8, 1.0, 1.5), "right": disc(3).translated((4.0, 1.0))}
    punches = [
        RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), origin=(3.9, 1.1) if i else (0, 0))
        for i, mesh in enumerate(meshes.values())
    ]
    loads = {
        "dead": [{"force": 300.0}, {"force": 100.0}],
        "wind": [{"force": 200.0, "at": (0.2, 0.1)}, {"force": 150.0}],
    }
    return dict(zip(meshes, RigidPunches(punches).solve_many(loads), strict=True))


@pytest.mark.usefixtures("undrawn")
def test_between_footings():
    found = pair_of_footings()
    (pair,) = between(bodies_of(found, Details()))
    w = [
        [c[k].punch_displacement(c.footprint.centre[:, None])[0] for c in found.values()]
        for k in range(2)
    ]
    difference = [b - a for a, b in w]
    k = int(np.argmax(np.abs(difference)))
    assert pair.difference == pytest.approx(difference[k])
    assert pair.case == ("dead", "wind")[k]
    assert pair.distance == pytest.approx(np.hypot(4.0, 1.0), rel=1e-9)
    page = Page(report_html(found, points=[(0.1, 0.1), (4.1, 1.0)], **SAID))
    assert page.values("left – right")[1] == pytest.approx(1000 * pair.difference)
    names = [row[0]["text"] for table in page.tables for row in table]
    assert "left, P1" in names
    assert "right, P2" in names
    assert "right, P1" not in names  # a point is that of the footing it lies on
    with pytest.raises(ValueError, match=r"points on the plan, got \(2, 0\), 1 off it"):
        report_html(found, points=[(2.0, 0.0)], mesh_name="pair")


@pytest.mark.usefixtures("undrawn")
def test_a_ring_around_a_footing_has_no_angular_distortion_to_it():
    meshes = {"pad": disc(3), "ring": annulus(1.5, 2.0, n=60)}
    punches = [RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis()) for mesh in meshes.values()]
    solved = RigidPunches(punches).solve_many({"dead": [{"force": 300.0}, {"force": 900.0}]})
    found = dict(zip(meshes, solved, strict=True))
    assert between(bodies_of(found, Details())) == []
    assert "Angular distortion" not in report_html(found, mesh_name="pad and ring")


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("when", "page", "data"),
    [
        (date(2024, 5, 6), "2024-05-06 · ", "2024-05-06"),
        (datetime(2024, 5, 6), "2024-05-06 00:00 · ", "2024-05-06T00:00:00"),
    ],
)
def test_a_date_has_the_time_of_day_that_was_given(cases, when, page, data):
    details = Details(date=when, **SAID)
    assert f" · {page}" in report_html(cases, details=details)
    assert report_data(bodies_of(cases, details))["date"] == data


def test_data_is_the_page(cases):
    """Every number of the JSON file, against the solutions."""
    when = datetime(2024, 5, 6, 7, 8)
    details = Details(points=[(-1.0, -1.0)], date=when, **SAID)
    footings = bodies_of(cases, details)
    data = json.loads(json.dumps(report_data(footings), allow_nan=False))
    assert data["schema"] == SCHEMA == "skfem-dual/1"
    assert (data["units"], data["date"], data["allowable"]) == ("kN,m", "2024-05-06T07:08:00", 250)
    assert data["substrate"] == {"kind": "homogeneous", "young": 30e3, "poisson": 0.3}
    (footing,) = data["footings"]
    assert len(footing["points"]) == 7
    for k, case in enumerate(footing["cases"]):
        solution = cases[k]
        assert case["settlement"] == solution.settlement
        assert case["tilt"] == solution.tilt.tolist()
        at = np.array([[p["x"], p["y"]] for p in footing["points"]]).T
        assert case["settlements"] == pytest.approx(solution.punch_displacement(at))
        assert case["pressure"]["mean"] == pytest.approx(solution.mean_pressure)
        mean = solution.mean_pressure / 250.0
        assert case["utilisation"]["mean"] == pytest.approx(mean)
    assert footing["cases"][1]["load"]["moments"] == [0.0, 250.0]
    assert {e["quantity"] for e in footing["envelope"]} == {
        "largest_pressure", "largest_settlement", "slope", "contact_share",
    }  # fmt: skip
    stress = footing["stress_profile"]
    governing = cases[stress["case"]]
    x = np.vstack([*np.repeat(governing.punch.centre[:, None], 11, axis=1), stress["depth"]])
    assert stress["stress"] == pytest.approx(stress_below(governing, x).sigma_z)


def test_ground_as_data():
    layered = LayeredHalfSpace([Layer(2.0, 20.0, 0.3, 0.1)], "bonded")
    assert substrate_data(layered) == {
        "kind": "layered",
        "layers": [{"thickness": 2.0, "young": 20.0, "poisson": 0.3, "gradient": 0.1}],
        "base": "bonded",
    }
    graded = substrate_data(GradedHalfSpace.init_linear(20.0, 0.3, gradient=0.5))
    assert (graded["kind"], graded["young"], graded["poisson"]) == ("graded", 20.0, 0.3)
    assert plain({"a": [np.float64(1.5), np.nan], "b": np.bool_(True)}) == {
        "a": [1.5, None],
        "b": True,
    }


def test_corners_of_outlines():
    corners = outline_corners(L_SHAPE.basis().partition)
    expected = [[-1.5, 1.5, 1.5, -0.5, -0.5, -1.5], [-1.5, -1.5, -0.5, -0.5, 1.5, 1.5]]
    assert corners == pytest.approx(np.array(expected))
    assert outline_corners(DualMesh.from_mesh(disc(4)).basis().partition).shape == (2, 0)
    hole = Plan.circle((0, 0), 0.3)
    plan = Plan.from_polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)], holes=[hole])
    coarse = DualMesh.from_mesh(plan.mesh(n=100, graded=0.4))
    assert len(coarse.mesh.boundaries["hole"]) < 13
    assert outline_corners(coarse.basis().partition).shape == (2, 4)
    far = DualMesh.from_mesh(L_SHAPE.mesh.translated((5e5, -4e6))).basis().partition
    assert outline_corners(far) - [[5e5], [-4e6]] == pytest.approx(np.array(expected), abs=1e-8)


@pytest.mark.usefixtures("undrawn")
def test_units_do_not_change_the_answer():
    """The same footing in kN and m, and in N and mm: the page reads the same."""
    pages = []
    for scale, force, units in ((1.0, 1.0, "kN,m"), (1e3, 1e3, "N,mm")):
        mesh = rectangle(6).scaled(scale)
        soil = HalfSpace(30e3 * force / scale**2, 0.3)
        solution = RigidPunch(soil, DualMesh.from_mesh(mesh).basis()).solve(
            500.0 * force, (0.1 * scale, 0.0)
        )
        pages.append(Page(report_html(solution, units=units)))
    for name in (
        "Settlement W0 of the origin",
        "Tilt in all",
        "Mean pressure on the contact area",
        "Largest mean pressure on a circle",
        "Young's modulus E",
    ):
        metres, millimetres = (page.rows[name] for page in pages)
        assert metres[0]["values"] == pytest.approx(millimetres[0]["values"], rel=1e-9)
        assert metres[1]["text"] == millimetres[1]["text"]  # the unit
    assert pages[0].text("Young's modulus E") == "30"
    assert pages[0].rows["Young's modulus E"][1]["text"] == "MPa"


@pytest.mark.slow
def test_pdf(tmp_path, cases):
    weasyprint = pytest.importorskip("weasyprint")
    path = tmp_path / "report.pdf"
    write_report(path, cases, **SAID)
    assert path.read_bytes().startswith(b"%PDF-")
    assert len(weasyprint.HTML(string=report_html(cases, **SAID)).render().pages) >= 3
    assert [p.name for p in tmp_path.iterdir()] == ["report.pdf"]


def test_pdf_without_its_library(tmp_path, cases, monkeypatch):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(ImportError, match=r"pip install 'skfem-dual\[pdf\]'"):
        write_report(tmp_path / "report.pdf", cases)
    assert not list(tmp_path.iterdir())


def test_wrong_details(cases):
    for error, said, message in (
        (ValueError, {"units": "kN"}, "FORCE,LENGTH"),
        (ValueError, {"allowable": -1.0}, "allowable"),
        (TypeError, {"points": [1.0]}, r"points\[0\]"),
        (TypeError, {"author": 3}, "text for author"),
        (TypeError, {"allowed": 1.0}, "allowed"),
    ):
        with pytest.raises(error, match=message):
            report_html(cases, **said)
    with pytest.raises(ValueError, match="solutions of some bodies"):
        report_html({})
    with pytest.raises(TypeError, match="footing 'left'"):
        report_html({"left": 3})


def within(polygon, centre, point):
    """Distance of a point from the centre over that of the polygon's edge behind it."""
    a, b = np.array(polygon), np.roll(np.array(polygon), -1, axis=0)
    normal = np.stack([(b - a)[:, 1], -(b - a)[:, 0]])
    normal *= np.sign(np.sum(normal * (a - centre).T, axis=0))
    return np.max((point - centre) @ normal / np.sum(normal * (a - centre).T, axis=0))


@pytest.mark.usefixtures("undrawn")
def test_data_tells_what_was_solved():
    """All fields of a footing and its cases, by public attributes and by hand."""
    punch = RigidPunch(SOIL, L_SHAPE.basis(), origin=(-0.3, -0.2))
    load = {"force": 380.0, "at": (0.02, 0.05), "moments": (-30.0, 20.0)}
    pushed = {"horizontal": (12.0, -7.0), "torsion": 3.0}
    cases = punch.solve_many({"pushed": load | pushed, "dead": {"force": 100.0}})
    said = {"project": "Bridge", "mesh_name": "L.msh", "remarks": ["a remark"]}
    data = json.loads(json.dumps(report_data(bodies_of(cases, Details(**SAID, **said)))))
    assert [data[k] for k in ("title", "project", "author", "mesh", "remarks")] == [
        "Pier 3", "Bridge", "A. Engineer", "L.msh", ["a remark"],
    ]  # fmt: skip
    (footing,), cells = data["footings"], punch.partition
    p = cells.polygons.p
    exact = {
        "name": "", "cells": len(cells), "edge": "singular",
        "edge_boundaries": None, "collocation": "centroid",
        "shape": "flat", "origin": [-0.3, -0.2], "accuracy": None,
    }  # fmt: skip
    assert {k: footing[k] for k in exact} == exact
    assert np.array(footing["extent"]) == pytest.approx(np.array([p.min(axis=1), p.max(axis=1)]))
    assert footing["area"] == pytest.approx(cells.areas.sum())
    centre = cells.centroids @ cells.areas / cells.areas.sum()
    assert footing["centroid"] == pytest.approx(centre)
    assert np.array(footing["kern"]) == pytest.approx(punch.kern().T + punch.origin)
    assert footing["circle_radius"] == pytest.approx(cases.circles.radius)
    assert {"grid", "points", "envelope", "error", "stress_profile", "cases"} == (
        set(footing) - set(exact) - {"area", "extent", "centroid", "kern", "circle_radius"}
    )
    case, s = footing["cases"][0], cases["pushed"]
    hull = p[:, ConvexHull(p.T).vertices]
    point = np.array([-0.3, -0.2]) + s.resultant[1:] / s.force
    mean, largest = s.force / s.contact_area, bearing_pressure(s)
    equations = ConvexHull(hull.T).equations
    expected = {
        "name": "pushed", "success": True, "message": s.message, "iterations": s.iterations,
        "load": {
            "force": 380.0, "at": [0.02, 0.05], "moments": [20.0, 30.0], "settlement": None,
            "tilt": None, "horizontal": [12.0, -7.0], "torsion": 3.0,
        },
        "seconds": s.timings,
    }  # fmt: skip
    numbers = {
        "force": s.force, "point": point, "first_moments": s.resultant[1:],
        "settlement": s.settlement, "tilt": s.tilt,
        "largest_settlement": s.punch_displacement(hull).max(),
        "settlements": s.punch_displacement([[q[k] for q in footing["points"]] for k in "xy"]),
        "contact_area": s.contact_area, "contact_share": s.contact_area / cells.areas.sum(),
        "pressure": {
            "mean": mean, "largest": largest,
            "min_of_cells": s.pressure.min(), "max_of_cells": s.pressure.max(),
        },
        "utilisation": {
            "mean": mean / 250, "largest": largest / 250,
            "kern": within(footing["kern"], centre, point),
            "overturning": within(hull.T, centre, point),
        },
        "edge_distance": -np.max(equations[:, :2] @ point + equations[:, 2]),
        "displacement": s.shear.displacement, "twist": s.shear.twist,
        "complementarity_residual": s.complementarity_residual,
        "displacement_residual": s.displacement_residual,
        "resultant_residual": s.resultant_residual,
    }  # fmt: skip
    assert {k: case[k] for k in expected} == expected
    assert set(case) == set(expected) | set(numbers)
    for name, value in numbers.items():
        assert case[name] == pytest.approx(value, rel=1e-9, abs=1e-12), name
    assert case["utilisation"]["kern"] > 1.5 * case["utilisation"]["overturning"] > 0
