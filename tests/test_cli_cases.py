"""Load cases, units and footings on the command line."""

import ast
import csv
import json
import re
import shlex
import sys
from datetime import date, datetime
from pathlib import Path

import numpy as np
import pytest
from plans import rectangle
from skfem import MeshTri
from test_cli import DATA, DISC, GROUND, run

import skfem_dual
from skfem_dual import DualMesh, HalfSpace, RigidPunch, RigidPunches
from skfem_dual.cli.messages import OPTIONS, in_options
from skfem_dual.cli.parser import EXAMPLES, day
from skfem_dual.grids import generate
from skfem_dual.report import figures

UNITS = ["--young", "30e3", "--poisson", "0.3", "--units", "kN,m"]
SOIL = HalfSpace(30e3, 0.3)
SITE = (512300.0, 231400.0)


@pytest.fixture
def footing(tmp_path):
    """A footing of 4 m by 2 m at site coordinates."""
    path = tmp_path / "footing.msh"
    mesh = rectangle(6, 2.0, 1.0).translated(SITE)
    mesh.save(path)
    return path, mesh


def cases_in(tmp_path, text, name="cases.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.usefixtures("undrawn")
def test_horizontal_loads(capsys, footing, tmp_path):
    """As options and as columns, on the terminal, in the table, as data and in the report."""
    path, mesh = footing
    punch = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), origin=SITE)
    shear = punch.solve(500.0, horizontal=(60.0, -20.0), torsion=45.0).shear
    load = ["--force", "500", "--horizontal", "60", "-20", "--torsion", "45"]
    code, out, err = run(capsys, "solve", path, *UNITS, *load)
    assert (code, err) == (0, [])
    table = {line[:19].strip(): line[19:] for line in out}
    x, y = 1000 * shear.displacement
    expected = f"({x:.5g}, {y:.5g}) mm, twist {1000 * shear.twist:.6g} ‰"
    assert table["Displacement"] == expected
    assert table["Horizontal force"] == "(60, -20) kN, torsion 45 kN·m"
    text = "name,force,hx,hy,torsion\nrest,500,0,0,0\nstorm,500,60,-20,45\n"
    cases, data, rows = cases_in(tmp_path, text), tmp_path / "out.json", tmp_path / "out.csv"
    files = ["--json", data, "--table", rows, "--report", tmp_path / "out.html"]
    code, out, err = run(capsys, "solve", path, *UNITS, "--loads", cases, *files)
    assert (code, err) == (0, [])
    (head,) = (line.split() for line in out if line.startswith("case "))
    (told,) = (line.split() for line in out if line.startswith("storm "))
    assert head[-4:] == ["Ux", "Uy", "twist", "contact"]
    moved = 1000 * np.array([*shear.displacement, shear.twist])
    assert np.array(told[-5:-2], dtype=float) == pytest.approx(moved, rel=1e-3)
    rest, storm = json.loads(data.read_text())["footings"][0]["cases"]
    assert rest["displacement"] == pytest.approx([0.0, 0.0])
    assert storm["displacement"] == pytest.approx(shear.displacement)
    assert storm["load"]["torsion"] == 45.0
    with rows.open() as file:
        assert float(list(csv.DictReader(file))[1]["twist"]) == pytest.approx(shear.twist)
    page = (tmp_path / "out.html").read_text()
    assert "Sliding and twisting" in page
    values = [float(v) for v in re.findall(r'value="([^"]*)"', page)]
    assert any(v == pytest.approx(1000 * shear.twist, rel=1e-9) for v in values)


def test_horizontal_loads_of_neighbours(capsys, tmp_path):
    left, right = tmp_path / "left.msh", tmp_path / "right.msh"
    rectangle(4, 1.0, 1.0).save(left)
    rectangle(4, 1.0, 1.0).translated((2.0, 0.0)).save(right)
    cases = cases_in(tmp_path, "name,footing,force,torsion\na,left,1,1\na,right,1,0\n")
    code, _, err = run(capsys, "solve", left, right, *UNITS, "--loads", cases)
    assert code == 2
    assert "how bases beside each other slide is not known" in err[-1]


def test_columns_of_zeros_are_no_horizontal_loads(capsys, tmp_path):
    """Cells of tables say 0 where there is none: of neighbours, of no force, on smooth ground."""
    left, right = tmp_path / "left.msh", tmp_path / "right.msh"
    rectangle(4, 1.0, 1.0).save(left)
    rectangle(4, 1.0, 1.0).translated((2.0, 0.0)).save(right)
    zeros = "name,footing,force,hx,hy,torsion\na,left,1,0,0,0\na,right,1,0,0,0\n"
    cases = cases_in(tmp_path, zeros)
    assert run(capsys, "solve", left, right, *UNITS, "--loads", cases)[0] == 0
    cases = cases_in(tmp_path, "name,force,hx,hy\nnone,0,0,0\nsome,1,0,0\n")
    assert run(capsys, "solve", left, *UNITS, "--loads", cases)[0] == 0
    cases = cases_in(tmp_path, "name,force,hx,hy\nnone,0,0,0\nsome,1,0.1,0\n")
    assert run(capsys, "solve", left, *UNITS, "--loads", cases)[0] == 0


@pytest.mark.usefixtures("undrawn")
def test_pictures_of_nothing_are_told(capsys, tmp_path, footing):
    """The rest is written: the table and the page were lost, and pictures left out unsaid."""
    png, page, vtu = (tmp_path / f"out.{kind}" for kind in ("png", "html", "vtu"))
    files = ["--png", png, "--report", page, "--vtu", vtu]
    code, out, err = run(capsys, "solve", footing[0], *UNITS, "--settlement", "0", *files)
    assert code == 2
    assert out
    assert err == [f"skfem-dual: not written, as there is no pressure to draw: {png}"]
    assert page.exists()
    assert vtu.exists()
    assert not png.exists()
    loads = cases_in(tmp_path, "name,force\nlift,-1\n")
    code, _, err = run(capsys, "solve", footing[0], *UNITS, "--loads", loads, *files)
    assert code == 3
    assert err[-2] == f"skfem-dual: not written, as no case has a solution: {png}, {vtu}"


@pytest.mark.usefixtures("undrawn")
def test_settlements_as_of_another_unit_are_remarks(capsys, tmp_path, footing):
    """Once each, in the data and on the page."""
    page, data = tmp_path / "out.html", tmp_path / "out.json"
    soft = ["--young", "3", "--poisson", "0.3", "--units", "kN,m", "--force", "100"]
    code, _, err = run(capsys, "solve", footing[0], *soft, "--report", page, "--json", data)
    assert code == 0
    assert "far beyond small deformations" in err[0]
    (remark,) = json.loads(data.read_text())["remarks"]
    assert "far beyond small deformations" in remark
    assert page.read_text().count("far beyond small deformations") == 1


def test_the_centroid_is_the_origin(capsys, footing):
    path, _ = footing
    code, out, err = run(capsys, "solve", path, *UNITS, "--force", "500")
    assert (code, err) == (0, [])
    assert out[1] == "Origin             (512300, 231400), centroid of the plan"
    table = {line[:19].strip(): line[19:] for line in out}
    assert table["Tilt (Lx, Ly)"].endswith("‰")
    assert table["Force, acting at"] == "500 kN, (0, 0) m off the origin"
    expected = RigidPunch(SOIL, DualMesh.from_mesh(footing[1]).basis(), origin=SITE).solve(500.0)
    settlement, unit = table["Settlement W0"].split()
    assert (float(settlement), unit) == (pytest.approx(1000 * expected.settlement, rel=1e-5), "mm")
    mean, unit = table["Pressure mean"].split()
    assert (float(mean), unit) == (pytest.approx(500 / 8, rel=1e-5), "kPa")
    # another origin is the same load and the same footing
    load = ["--force", "500", "--at", "100", "0"]
    origin = ["--origin", str(SITE[0] - 100), str(SITE[1])]
    code, out, err = run(capsys, "solve", path, *UNITS, *load, *origin)
    assert code == 0
    assert "the origin (512200, 231400) is 98 off the plan" in err[0]
    assert "Remedy: leave out --origin for the centroid, (512300, 231400)" in err[0]
    # with digits enough for site coordinates
    code, out, err = run(
        capsys, "solve", path, *UNITS, *load, "--origin", str(SITE[0] - 9.875), "231400.125"
    )
    assert "the origin (512290.125, 231400.125) is 7.88 off the plan" in err[0]


def test_a_load_off_the_plan_is_told_in_options(capsys, footing):
    code, out, err = run(capsys, "solve", footing[0], *UNITS, "--force", "1", "--at", "3", "0")
    assert (code, out) == (2, [])
    assert "outside the convex hull" in err[0]
    assert "--bilateral for ground that pulls" in err[0]
    assert "unilateral" not in err[0]
    assert in_options("got force=-1. Remedy: at= or origin=, or tilt=") == (
        "got force -1. Remedy: --at or --origin, or --tilt"
    )


def test_a_load_by_coordinates_of_the_plan_is_told_from_the_origin(capsys, footing):
    at = str(SITE[0] + 0.75), str(SITE[1] - 0.25)
    load = ["solve", footing[0], *UNITS, "--force", "1"]
    code, out, err = run(capsys, *load, "--at", *at)
    assert (code, out) == (2, [])
    assert err[0].endswith(
        "expected --at from the origin, (512300, 231400), got (512300.75, 231399.75), which is "
        "off the plan, and on it by its coordinates. Remedy: --at 0.75 -0.25"
    )
    code, _, err = run(capsys, *load, "--at", "0.75", "-0.25")
    assert (code, err) == (0, [])


def test_a_plan_in_millimetres_is_suspected(capsys, tmp_path):
    path = tmp_path / "footing.msh"
    rectangle(4, 2000.0, 1000.0).save(path)
    load = ["solve", path, "--young", "30e3", "--poisson", "0.3", "--force", "100"]
    code, _, err = run(capsys, *load, "--units", "kN,m")
    assert code == 0
    assert "footing.msh is 4000 m wide. Remedy: check that its coordinates are in" in err[0]
    for known in (["--units", "kN,mm"], []):
        assert run(capsys, *load, *known)[::2] == (0, [])


def test_arguments_that_have_options_are_in_messages():
    """A message that is changed takes its words on the command line along."""
    texts = []
    for path in Path(skfem_dual.__file__).parent.rglob("*.py"):
        if path.parent.name == "cli":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = [getattr(part, "value", "") for part in node.values]
                texts.append("".join(part if isinstance(part, str) else "_" for part in parts))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append(node.value)
    text = "\n".join(texts)
    assert not [argument for argument, _ in OPTIONS if not re.search(argument, text)]


def test_cases_from_a_table(capsys, tmp_path, footing):
    text = "name,force,x,y,mx,my\ndead,500,512300,231400,0,0\n"
    text += "wind,450,512300,231400.1,0,500\nwest,450,512301.2,231400,0,0\n"
    loads, table, data = cases_in(tmp_path, text), tmp_path / "out.csv", tmp_path / "out.json"
    files = ["--loads", loads, "--table", table, "--json", data, "--svg", tmp_path / "x.svg"]
    more = ["--allowable", "100", "--point", f"{SITE[0]},{SITE[1]}"]
    code, out, err = run(capsys, "solve", footing[0], *UNITS, *files, *more)
    assert (code, err) == (0, [])
    of = RigidPunch(SOIL, DualMesh.from_mesh(footing[1]).basis(), origin=SITE)
    expected = [
        of.solve(500.0),
        of.solve(450.0, at=(500 / 450, 0.1)),
        of.solve(450.0, at=(1.2, 0.0)),
    ]
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    found = json.loads(data.read_text())["footings"][0]["cases"]
    for row, case, solution in zip(rows, found, expected, strict=True):
        assert float(row["settlement"]) == pytest.approx(solution.settlement, rel=1e-7)
        assert case["settlement"] == float(row["settlement"])
        assert case["tilt"] == pytest.approx(solution.tilt, rel=1e-6, abs=1e-12)
        assert case["settlements"][-1] == pytest.approx(solution.settlement, rel=1e-7)
        assert row["success"] == "True"
    line = next(line for line in out if line.startswith("wind"))
    assert float(line.split()[1]) == pytest.approx(1000 * expected[1].settlement, rel=1e-4)
    largest = next(line for line in out if line.startswith("Least part in contact"))
    assert largest.endswith("west")
    assert "<svg" in (tmp_path / "x.svg").read_text()[:1000]


def test_cases_without_a_solution_are_named(capsys, tmp_path, footing):
    loads = cases_in(tmp_path, "name,force,ex,ey\ndead,1,0,0\ngale,1,2.5,0\nlift,-1,0,0\n")
    code, _, err = run(capsys, "solve", footing[0], *UNITS, "--loads", loads)
    assert code == 3
    assert err[-1].startswith(
        "skfem-dual: no solution in 2 of 3 cases, gale and lift; gale: expected"
    )


def test_many_cases_without_a_solution_are_counted(capsys, tmp_path, footing):
    """Names were cut in the middle, and what was expected was cut away."""
    rows = "".join(f"a case with a long name {i},1,2.5,0\n" for i in range(12))
    loads = cases_in(tmp_path, "name,force,ex,ey\n" + rows)
    code, _, err = run(capsys, "solve", footing[0], *UNITS, "--loads", loads)
    assert code == 3
    assert "in 12 of 12 cases; a case with a long name 0: expected a resultant within" in err[-1]
    assert "Remedy: move the load by more than" in err[-1]


def test_the_outline_that_turns_over_is_named(capsys, tmp_path):
    for name, x in (("left", 0), ("right", 5)):
        corners = f"x,y\n{x},0\n{x + 2},0\n{x + 2},2\n{x},2\n"
        (tmp_path / f"{name}.csv").write_text(corners)
    loads = cases_in(tmp_path, "name,footing,force,ex,ey\na,left,1,0,0\na,right,1,2.5,0\n")
    footings = [str(tmp_path / f"{name}.csv") for name in ("left", "right")]
    code, _, err = run(capsys, "solve", *footings, *UNITS, "--loads", loads)
    assert code == 3
    assert err[-1].startswith("skfem-dual: no solution: body right: expected a resultant within")


@pytest.mark.usefixtures("undrawn")
def test_a_case_that_turns_over(capsys, tmp_path, footing):
    loads = cases_in(tmp_path, "name,force,ex,ey\ndead,1,0,0\ngale,1,2.5,0\n")
    table, data, page = (tmp_path / f"out.{kind}" for kind in ("csv", "json", "html"))
    files = ["--loads", loads, "--table", table, "--json", data, "--report", page]
    code, out, err = run(capsys, "solve", footing[0], *UNITS, *files)
    assert code == 3
    assert any(line.startswith("skfem-dual: no solution in gale: expected a res") for line in err)
    for text in (*err, *(file.read_text() for file in (table, data, page))):
        assert "unilateral" not in text  # it is --bilateral here
    dead, gale = json.loads(data.read_text())["footings"][0]["cases"]
    assert dead.keys() == gale.keys()  # what is not known is null
    assert gale["settlement"] is gale["pressure"] is None
    assert any(line.startswith("gale") and "NO SOLUTION" in line for line in out)
    with table.open(newline="") as file:
        assert [row["success"] for row in csv.DictReader(file)] == ["True", "False"]


def test_two_footings(capsys, tmp_path):
    meshes = {"left": rectangle(6), "right": rectangle(6).translated((2.5, 0.0))}
    for name, mesh in meshes.items():
        mesh.save(tmp_path / f"{name}.msh")
    text = "name,footing,force\ndead,left,500\ndead,right,300\n"
    loads, data = cases_in(tmp_path, text), tmp_path / "out.json"
    paths = [tmp_path / f"{name}.msh" for name in meshes]
    options = [*UNITS, "--loads", loads, "--json", data]
    code, out, err = run(capsys, "solve", *paths, *options, "--quiet")
    assert (code, out, err) == (0, [], [])
    punches = [
        RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), origin=(2.5 * i, 0.0))
        for i, mesh in enumerate(meshes.values())
    ]
    expected = RigidPunches(punches).solve([{"force": 500.0}, {"force": 300.0}])
    found = json.loads(data.read_text())
    for footing, solution in zip(found["footings"], expected.solutions, strict=True):
        assert footing["cases"][0]["settlement"] == pytest.approx(solution.settlement, rel=1e-8)
    difference = expected[1].settlement - expected[0].settlement
    assert found["between"][0]["differential_settlement"] == pytest.approx(difference, rel=1e-6)
    # a footing without a load, or one that is not there
    for text, message in (
        ("name,footing,force\ndead,left,500\n", "a load of footing right in case 'dead'"),
        ("name,footing,force\ndead,middle,5\n", "line 2: expected a footing among left, right"),
    ):
        options = [*UNITS, "--loads", cases_in(tmp_path, text)]
        code, out, err = run(capsys, "solve", *paths, *options)
        assert (code, out, len(err)) == (2, [], 1)
        assert message in err[0]


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--loads", DISC, "--force", "1"], "either --loads or --force"),
        (["--force", "1", "--table", "x.csv"], "--loads with --table"),
        (["--force", "1", "--profile", "0", "0"], "--report or --json with --profile"),
        (["--force", "1", "--title", "T"], "--report or --json with --title, got neither"),
        (["--force", "1", "--units", "kN"], "FORCE,LENGTH"),
        (["--force", "1", "--point", "1;2"], "two numbers X,Y"),
        (["--force", "1", "--point", "7,0", "--units", "kN,m"], "points on the plan"),
        (["--force", "1", "--date", "May"], "a date YYYY-MM-DD"),
        (["--loads", "none.csv"], "no such file: none.csv"),
        (["--force", "1", "--allowable", "-3"], "allowable"),
    ],
)
def test_wrong_options(capsys, args, message):
    code, out, err = run(capsys, "solve", DISC, *GROUND, *args)
    assert (code, out, len(err)) == (2, [], 1)
    assert message in err[0]


@pytest.mark.parametrize(
    ("text", "found"),
    [("2024-01-02", date(2024, 1, 2)), ("2024-01-02 10:30", datetime(2024, 1, 2, 10, 30))],
)
def test_dates(text, found):
    assert day(text) == found
    assert type(day(text)) is type(found)


def test_points_and_large_settlements_over_all_cases(capsys, footing, tmp_path):
    """Points wanted are told, and units doubted, of the case that settles most, too."""
    cases_in(tmp_path, "name,force,ex,ey\na,1e9,0,0\nb,0.9e9,0.5,0.2\n")
    point = ["--point", f"{SITE[0] + 1},{SITE[1] + 1}"]
    solve = ["solve", footing[0], *UNITS]
    code, out, err = run(capsys, *solve, "--loads", tmp_path / "cases.csv", *point)
    assert code == 0
    assert any(re.match(r"Settlement P1 +\S+ to \S+ mm", line) for line in out)
    alone = cases_in(tmp_path, "name,force,ex,ey\na,1e9,0,0\n", "alone.csv")
    _, _, said = run(capsys, *solve, "--loads", alone)
    shares = [float(re.search(r"a settlement is (\S+) %", text[0])[1]) for text in (err, said)]
    assert shares[0] >= shares[1]


def test_a_picture_that_cannot_be_drawn_leaves_the_rest(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    corners = np.array([[0, 1, 1, 0, 0.5], [0, 0, 1, 1, 0.5]])
    MeshTri(corners, np.array([[0, 1, 2, 3], [1, 2, 3, 0], [4] * 4])).save("four.vtu")
    options = ["--grid", "triangles", "--edge", "constant", "--svg", "i.svg", "--json", "o.json"]
    code, out, err = run(capsys, "solve", "four.vtu", *GROUND, "--force", "1", *options)
    assert code == 2
    assert err[-1].startswith("skfem-dual: not written: i.svg: expected a field with isobars")
    assert (tmp_path / "o.json").exists()
    assert any(line.startswith("Settlement W0") for line in out)


@pytest.mark.parametrize("begin", [b"PK\x03\x04", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"])
def test_workbooks_are_told_as_such(capsys, tmp_path, begin):
    """As loads and as ground; as outlines it is told which files these are."""
    path = tmp_path / "book.xlsx"
    path.write_bytes(begin + b"\x14\x00\xfe\xff")
    said = f"expected text in {path}, got a workbook or another archive. Remedy: save its table"
    for arguments, told in (
        ([DISC, *GROUND, "--loads", path], said),
        ([DISC, "--substrate", path, "--force", "1"], said),
        ([path, *GROUND, "--force", "1"], "outlines, for the command solve, end in .csv, .wkt"),
    ):
        code, _, err = run(capsys, "solve", *arguments)
        assert (code, len(err)) == (2, 1)
        assert told in err[0]


def test_several_meshes(capsys):
    other = str(DATA / "eccentric_annulus.msh")
    for meshes, options, message in (
        ([DISC, other], ["--force", "1"], "--loads with several meshes"),
        ([DISC, DISC], ["--loads", DISC], "meshes with different names, got disc, disc"),
        ([DISC, other], ["--loads", DISC, "--origin", "0", "0"], "one mesh with --origin"),
    ):
        code, out, err = run(capsys, "solve", *meshes, *GROUND, *options)
        assert (code, out, len(err)) == (2, [], 1)
        assert message in err[0]


def test_what_is_missing_is_told_before_the_work(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr("skfem_dual.cli.footings.RigidPunch", None)
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    report = ["--report", tmp_path / "x.pdf"]
    code, out, err = run(capsys, "solve", DISC, *GROUND, "--force", "1", *report)
    assert (code, out, len(err)) == (2, [], 1)
    assert "pip install 'skfem-dual[pdf]'" in err[0]
    folder = tmp_path / "folder.csv"
    folder.mkdir()
    code, _, err = run(capsys, "solve", DISC, *GROUND, "--loads", folder)
    assert (code, len(err)) == (2, 1)
    assert "got the folder" in err[0]


@pytest.mark.slow
def test_examples_of_the_help(capsys, tmp_path, monkeypatch):
    """As they stand there."""
    monkeypatch.chdir(tmp_path)
    picture = figures.Picture("data:image/png;base64,", 100)  # takes most time
    monkeypatch.setattr("skfem_dual.report.figures._embedded", lambda *a, **k: picture)
    monkeypatch.setattr("skfem_dual.report.depth.profile_picture", lambda *a: picture)
    for name, shift in (("footing", 0.0), ("left", 0.0), ("right", 3.0)):
        rectangle(6).translated((shift, 0.0)).save(f"{name}.msh")
    cases_in(tmp_path, "thickness, E, nu\n2, 20e3, 0.3\n, 60e3, 0.3\n", "layers.csv")
    twelve = "".join(f"case {i},{500 + 10 * i},{10 * i},{5 * i}\n" for i in range(12))
    cases_in(tmp_path, f"name,force,mx,my\n{twelve}")
    cases_in(tmp_path, "0,0\n4,0\n4,3\n0,3\n", "raft.csv")
    columns = "name,force,x,y,bx,by\nlive,300,1,1,.4,.4\nlive,200,3,2,.4,.4\n"
    cases_in(tmp_path, columns, "columns.csv")
    both = "".join(f"dead,{name},500,0,0\nwind,{name},450,0,80\n" for name in ("left", "right"))
    cases_in(tmp_path, f"name,footing,force,mx,my\n{both}", "pair.csv")
    text = EXAMPLES.split("exit codes")[0].replace("\\\n", " ")
    commands = [line for line in text.splitlines() if "skfem-dual solve" in line]
    assert len(commands) == 4
    for command in commands:
        words = shlex.split(command)
        code, out, err = run(capsys, *words[1:])
        assert (code, err) == (0, []), command
        assert out
        for file in ("--report", "--table", "--json"):
            if file in words:
                assert (tmp_path / words[words.index(file) + 1]).stat().st_size > 300
    assert np.isfinite(json.loads((tmp_path / "results.json").read_text())["seconds"]["all"])


def test_contact_narrower_than_a_cell_is_told_with_a_remedy_for_the_command_line(tmp_path, capsys):
    crust, loads = tmp_path / "crust.csv", tmp_path / "loads.csv"
    crust.write_text("thickness,young,poisson\n0.2,1.0,0.3\n,0.01,0.3\n")
    loads.write_text("case,force\na,1\nb,2\n")
    generate.disc(n=150).save(str(tmp_path / "disc.vtk"))
    found = run(capsys, "solve", tmp_path / "disc.vtk", "--substrate", crust, "--loads", loads)
    assert found[0] == 0
    (told,) = (line for line in found[2] if "wider than one" in line)
    assert told.endswith(
        "Remedy: smaller cells along the edge; first in case 'a' (2 of 2 load cases)"
    )
