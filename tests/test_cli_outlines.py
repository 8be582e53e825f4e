"""Outlines on the command line."""

import json
import re

import ezdxf
import numpy as np
import pytest

from skfem_dual import HalfSpace, Plan, solve_plan
from skfem_dual.cli import main
from skfem_dual.plans.drawings import unit_of_drawing

GROUND = ["--young", "30e6", "--poisson", "0.25"]
CORNERS = "0,0 3,0 3,1 1,1 1,3 0,3"
PLAN = Plan.from_polygon([(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)])


def run(capsys, *arguments):
    code = main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    return code, out, err


def rows(out):
    return {line[:19].strip(): line[19:].strip() for line in out.splitlines()}


def test_corners(capsys):
    """As the library, from the centroid; what was asked for is told."""
    code, out, err = run(capsys, "solve", "--corners", CORNERS, *GROUND, "--force", "1e6")
    assert (code, err) == (0, "")
    found = rows(out)
    expected = solve_plan(PLAN, HalfSpace(30e6, 0.25), 1e6)
    assert float(found["Settlement W0"]) == pytest.approx(expected.settlement, rel=1e-5)
    assert found["Origin"] == "(1.1, 1.1), centroid of the plan"
    assert found["Accuracy"].split(";")[0] == str(expected.accuracy).split(";")[0]


def test_a_file_of_that_name(capsys, tmp_path, monkeypatch):
    """It was taken for the corners of an option that was not there."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "corners").write_text("0,0\n4,0\n4,3\n")
    code, _, err = run(capsys, "solve", "corners", *GROUND, "--force", "1")
    assert code == 2
    assert "cannot read corners: no format" in err


def test_a_file_of_corners_with_cases(capsys, tmp_path):
    """The mesh serves all cases, and the farthest from the middle is as accurate as asked for."""
    outline, cases, out = (tmp_path / name for name in ("l.csv", "cases.csv", "out.json"))
    outline.write_text("x,y\n" + CORNERS.replace(" ", "\n") + "\n")
    cases.write_text("name,force,x,y\nself,1e6,1.1,1.1\nwind,1e6,1.3,0.9\n")
    arguments = ["--loads", cases, "--accuracy", "2e-3", "--json", out]
    code, printed, _ = run(capsys, "solve", outline, *GROUND, *arguments)
    assert code == 0
    assert "2.0e-03 asked" in printed
    (footing,) = json.loads(out.read_text())["footings"]
    truth = solve_plan(PLAN, HalfSpace(30e6, 0.25), 1e6, at=(1.3, 0.9), accuracy=5e-4)
    wind = next(case for case in footing["cases"] if case["name"] == "wind")
    assert wind["settlement"] == pytest.approx(truth.settlement, rel=4e-3)


def test_a_case_that_turns_over(capsys, tmp_path):
    """It is told, and neither chooses the mesh nor keeps the others from being solved."""
    cases, out = tmp_path / "cases.csv", tmp_path / "out.json"
    cases.write_text("name,force,ex,ey\nself,1e6,0,0\ngale,1e6,3,0\n")
    arguments = ["--loads", cases, "--json", out, "--accuracy", "1e-2"]
    code, printed, err = run(capsys, "solve", "--corners", CORNERS, *GROUND, *arguments)
    assert code == 3
    assert "gale: expected a resultant within the plan" in err
    assert "NO SOLUTION" in printed
    (footing,) = json.loads(out.read_text())["footings"]
    assert [case["success"] for case in footing["cases"]] == [True, False]
    alone = solve_plan(PLAN, HalfSpace(30e6, 0.25), 1e6, accuracy=1e-2)
    assert footing["cases"][0]["settlement"] == pytest.approx(alone.settlement, rel=1e-7)
    record = footing["accuracy"]
    assert record["reached"]
    assert record["trials"][-1]["cells"] == footing["cells"] == alone.accuracy.cells


def test_cases_of_which_none_has_a_solution(capsys, tmp_path):
    """As with a mesh: each is told, and the files are written, wherever the origin is."""
    cases, table, out = (tmp_path / name for name in ("cases.csv", "table.csv", "out.json"))
    for rows in ("a,1e6,5,5\nb,1e6,6,6\n", "a,-1,1,1\n"):
        cases.write_text("name,force,x,y\n" + rows)
        files = ["--loads", cases, "--table", table, "--json", out, "--origin", "9", "9"]
        code, printed, err = run(capsys, "solve", "--corners", CORNERS, *GROUND, *files)
        assert code == 3
        assert "NO SOLUTION" in printed
        assert "no solution" in err
        (footing,) = json.loads(out.read_text())["footings"]
        assert not any(case["success"] for case in footing["cases"])
        assert table.read_text().count("expected a") == rows.count("\n")


def test_origin_and_moments(capsys):
    """A moment about the y axis presses down the side of larger x."""
    load = ["--force", "1e6", "--moments", "0", "1e5", "--origin", "1", "1"]
    _, out, _ = run(capsys, "solve", "--corners", CORNERS, *GROUND, *load)
    found = rows(out)
    expected = solve_plan(PLAN, HalfSpace(30e6, 0.25), 1e6, at=(1.1, 1.0), origin=(1.0, 1.0))
    tilt = [float(x) for x in found["Tilt (Lx, Ly)"].strip("()").split(",")]
    assert tilt == pytest.approx(expected.tilt.tolist(), rel=1e-2)
    assert found["Origin"] == "(1, 1), from --origin"


def test_what_is_not_reached_is_told(capsys):
    options = ["--force", "1", "--accuracy", "1e-5", "--time-limit", "0.01"]
    code, out, err = run(capsys, "solve", "--corners", CORNERS, *GROUND, *options)
    assert code == 4
    assert "NOT REACHED" in rows(out)["Accuracy"]
    assert "Remedy: --time-limit, or --accuracy" in err
    assert len(err.splitlines()) == 1


def test_warnings_of_the_run_are_remarks(capsys, tmp_path, undrawn):
    """The page and the data have those told on the terminal."""
    page, data = tmp_path / "out.html", tmp_path / "out.json"
    load = ["--force", "100", "--accuracy", "1e-2", "--origin", "5", "5", "--at", "-3.9", "-3.9"]
    arguments = ["--corners", CORNERS, *GROUND, *load, "--json", data, "--report", page]
    code, _, err = run(capsys, "solve", *arguments)
    assert code == 0
    (remark,) = json.loads(data.read_text())["remarks"]
    assert remark.startswith("the origin (5, 5) is 4.24 off the plan")
    assert remark in err
    assert remark in page.read_text()


@pytest.mark.parametrize(
    "options",
    [
        ["--force", "1e6", "--accuracy", "1e-2"],
        ["--plate", "0.5,30e9,0.2", "--cells", "60", "--loads", "all_over.csv"],
    ],
)
def test_points_on_the_outline(capsys, tmp_path, monkeypatch, options):
    """On arcs they are outside the polygon of the mesh; corners are rounded at sites."""
    monkeypatch.chdir(tmp_path)
    ring, out = tmp_path / "ring.csv", tmp_path / "out.json"
    ring.write_text("53,70,1\n47,70,1\n\n52,70,1\n48,70,1\n")
    (tmp_path / "all_over.csv").write_text("name,force,q\nsnow,0,1e4\n")
    places = [(50, 73), (50 + 3 / np.sqrt(2), 70 + 3 / np.sqrt(2)), (50, 68), (53.001, 70)]
    points = [word for x, y in places for word in ("--point", f"{x},{y}")]
    code, _, err = run(capsys, "solve", ring, *GROUND, *options, *points, "--json", out)
    assert (code, err) == (0, "")
    found = json.loads(out.read_text())
    ((body,),) = filter(None, (found["footings"], found["structures"]))
    wanted = [(p["x"], p["y"]) for p in body["points"] if p["name"].startswith("P")]
    assert wanted == places
    case = body["cases"][0]
    first, second, *_ = case["settlements"][-4:]  # the ring is round
    assert first == pytest.approx(second, rel=1e-2)
    assert first == pytest.approx(case["settlements"][0], rel=1e-2)


@pytest.mark.parametrize(
    ("plan", "point", "off"),
    [(["--corners", CORNERS], "2,1.1", "0.1"), (["{mesh}"], "0,1.1", "0.1")],
)
def test_points_off_the_plan_are_refused_before_the_work(
    capsys, request, monkeypatch, plan, point, off
):
    monkeypatch.setattr("skfem_dual.cli.footings.solve_outline", None)  # a call is a TypeError
    monkeypatch.setattr("skfem_dual.cli.footings.RigidPunch", None)
    mesh = request.path.parent / "data" / "disc.msh"
    plan = [a.format(mesh=mesh) for a in plan]
    code, _, err = run(capsys, "solve", *plan, *GROUND, "--force", "1", "--point", point)
    assert code == 2
    assert re.search(f"expected points on the plan, got .*, {off}.* off it", err)


def test_points_between_the_nodes_of_a_round_mesh(capsys, request, tmp_path):
    mesh, out = request.path.parent / "data" / "disc.msh", tmp_path / "out.json"
    angles = np.linspace(0.0, 2 * np.pi, 15)
    points = [word for a in angles for word in ("--point", f"{np.cos(a)},{np.sin(a)}")]
    code, _, err = run(capsys, "solve", mesh, *GROUND, "--force", "1", *points, "--json", out)
    assert (code, err) == (0, "")
    (footing,) = json.loads(out.read_text())["footings"]
    assert sum(point["name"].startswith("P") for point in footing["points"]) == len(angles)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "either MESH or --corners, got neither"),
        (["{mesh}", "--corners", CORNERS], "either MESH or --corners, got both"),
        (["{mesh}", "--accuracy", "1e-3"], "--accuracy with an outline"),
        (["{mesh}", "--time-limit", "3"], "--time-limit with an outline"),
        (["{drawing}"], "Remedy: --layer with one of these names"),
        (["--corners", CORNERS, "--layer", "A"], "--layer with a drawing (.dxf)"),
        (["{drawing}", "--layer", "FOOTING", "--grid", "triangles"], "a mesh with --grid"),
        (["--corners", CORNERS, "--drawn-in", "mm"], "expected --units with --drawn-in"),
        (["{mesh}", "--drawn-in", "mm", "--units", "kN,m"], "--drawn-in with an outline"),
        (["--corners", "0,0 1,1 1,0 0,1"], "meeting itself at (0.5, 0.5)"),
        (["--corners", "0,0 1,x"], "got '1,x'"),
        (["--corners", "0,0;2,0;2,2"], "got '0,0;2,0;2,2'. Remedy: commas inside corners and"),
        (["--corners", "(0,0) (2,0) (2,2)"], "blanks between them alone, such as 0,0 12,0 12,8"),
        (["--corners", ""], "expected corners, got none. Remedy: commas inside corners"),
        (["--corners", "0,0 1,0"], "at least 3 points for --corners, got 2"),
    ],
)
def test_what_has_no_use(capsys, request, arguments, message):
    data = request.path.parent / "data"
    names = {"mesh": data / "disc.msh", "drawing": data / "footing.dxf"}
    arguments = [a.format(**names) for a in arguments]
    code, out, err = run(capsys, "solve", *arguments, *GROUND, "--force", "1")
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1


def test_a_drawing_at_site_coordinates(capsys, request):
    """The centroid is the origin: the force acts there, and nothing turns over."""
    path = request.path.parent / "data" / "footing.dxf"
    arguments = ["--layer", "footing", "--force", "6e6", "--accuracy", "3e-2"]
    code, out, _ = run(capsys, "solve", path, *GROUND, *arguments)
    assert code == 0
    area = 12 * 4 + 5 * 5 - np.pi * 0.75**2 + (1 - np.pi / 4)
    assert float(rows(out)["Contact area"]) == pytest.approx(area, rel=1e-5)


def test_a_case_that_only_pushes_leaves_the_others(capsys, tmp_path):
    """Ground that pulls balances no force, but nothing in contact carries what pushes."""
    path, loads = tmp_path / "pad.csv", tmp_path / "loads.csv"
    path.write_text("0,0\n4,0\n4,3\n0,3\n")
    loads.write_text("name,force,hx,hy\npushed,0,10,0\nboth,400,10,0\n")
    code, out, _ = run(capsys, "solve", path, *GROUND, "--loads", loads, "--bilateral")
    assert code == 3
    pushed, both = (row for row in out.splitlines() if row.startswith(("pushed", "both ")))
    assert "NO SOLUTION" in pushed
    assert "100 %" in both


def test_ground_that_pulls_is_told_in_tables(capsys, tmp_path):
    """Cells on which it would have to are in contact, too."""
    path, loads = tmp_path / "pad.csv", tmp_path / "loads.csv"
    path.write_text("0,0\n4,0\n4,3\n0,3\n")
    loads.write_text("name,force,ex,ey\nedge,400,1.5,0\nmiddle,400,0,0\n")
    arguments = "solve", path, *GROUND, "--loads", loads, "--origin", "2", "1.5"
    _, out, _ = run(capsys, *arguments, "--bilateral")
    edge, middle = (row for row in out.splitlines() if row.startswith(("edge ", "middle ")))
    assert re.search(r"100 %  ground pulls on \d\d\.\d %$", edge)
    assert middle.endswith("100 %")
    _, out, _ = run(capsys, *arguments)
    assert "ground pulls" not in out


def test_a_table_of_corners_in_another_unit(capsys, tmp_path):
    path = tmp_path / "pad.csv"
    path.write_text("x [mm]; y [mm]\n0; 0\n3000; 0\n3000; 2000,0\n0; 2000\n")
    ground = "--young", "30e3", "--poisson", "0.25", "--force", "100", "--accuracy", "0.1"
    arguments = ["solve", path, *ground, "--units", "kN,m"]
    code, _, err = run(capsys, *arguments[:-2])
    assert code == 2
    assert "units of all input beside that of the heading, got none and mm. Remedy: --units" in err
    _, _, err = run(capsys, *arguments)
    assert "drawn in mm (its header), --units says m, which is taken. Remedy: --drawn-in mm" in err
    _, out, err = run(capsys, *arguments, "--drawn-in", "mm")
    assert err == ""
    assert rows(out)["Contact area"] == "6 m²"
    _, _, err = run(capsys, *arguments, "--drawn-in", "cm")
    assert "drawn in mm (its header), --drawn-in says cm, which is taken" in err


@pytest.mark.parametrize(("number", "told"), [(21, "US survey ft"), (99, "number 99")])
def test_a_drawing_in_a_unit_of_no_symbol(tmp_path, number, told):
    """Survey feet were taken for none, and a number of no unit was a traceback."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = number
    document.saveas(tmp_path / "pad.dxf")
    assert told in unit_of_drawing(tmp_path / "pad.dxf")


def test_a_drawing_in_another_unit(capsys, tmp_path):
    """It is taken as it stands, which is told, unless its unit is named."""
    path = tmp_path / "pad.dxf"
    document = ezdxf.new(units=ezdxf.units.MM)
    corners = [(0, 0), (3000, 0), (3000, 2000), (0, 2000)]
    document.modelspace().add_lwpolyline(corners, close=True)
    document.saveas(path)
    ground = "--young", "30e3", "--poisson", "0.25", "--force", "100", "--accuracy", "0.1"
    arguments = ["solve", path, *ground, "--units", "kN,m"]
    _, out, err = run(capsys, *arguments)
    assert "drawn in mm ($INSUNITS), --units says m, which is taken. Remedy: --drawn-in mm" in err
    assert rows(out)["Contact area"] == "6e+06 m²"
    _, out, err = run(capsys, *arguments, "--drawn-in", "mm")
    assert err == ""
    assert rows(out)["Contact area"] == "6 m²"
    assert rows(out)["Origin"] == "(1.5, 1), centroid of the plan"
    _, out, err = run(capsys, *arguments, "--drawn-in", "m")
    assert err == ""
    assert rows(out)["Contact area"] == "6e+06 m²"
    _, _, err = run(capsys, *arguments[:-1], "kN,mm")
    assert err == ""


def test_a_second_layer_is_refused(capsys):
    with pytest.raises(SystemExit) as end:
        main(["solve", "a.dxf", "--layer", "A", "--layer", "B", *GROUND, "--force", "1"])
    assert end.value.code == 2
    assert "--layer: expected once, got A and B. Remedy" in capsys.readouterr().err
