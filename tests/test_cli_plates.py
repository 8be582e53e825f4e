"""Plates on the command line, alone and beside rigid footings, and all of them as data."""

import csv
import json
import re

import meshio
import numpy as np
import pytest
from skfem import LinearForm
from test_cli import run
from test_cli_cases import SITE, UNITS, cases_in

from skfem_dual import DualMesh, HalfSpace, Plan, Plate, Punches, RigidPunch, column_load
from skfem_dual.bodies.plates import excess_under_columns
from skfem_dual.grids.generate import rectangle
from skfem_dual.io import CaseRow, write_solution
from skfem_dual.report import report_html, write_report
from skfem_dual.report.details import Details

SOIL = HalfSpace(30e3, 0.3)
PLATE = ["--plate", "0.4,30e6,0.2"]
COLUMNS = f"""\
name, force [kN], x, y, bx, by, mx, my, q [kN/m²]
weight, 0, 0, 0, 0, 0, 0, 0, 10
wind, 600, {SITE[0] + 1}, {SITE[1] + 1}, 0.4, 0.4, 0, 30, 10
wind, 800, {SITE[0] + 5}, {SITE[1] + 3}, 0.4, 0.6, -20, 0, 0
"""


@pytest.fixture
def raft(tmp_path, monkeypatch):
    """Corners of a raft of 6 m by 4 m on the site, and its loads."""
    monkeypatch.chdir(tmp_path)
    x, y = SITE
    corners = "".join(f"{x + a},{y + b}\n" for a, b in ((0, 0), (6, 0), (6, 4), (0, 4)))
    (tmp_path / "raft.csv").write_text(corners)
    cases_in(tmp_path, COLUMNS)
    return ["solve", "raft.csv", *UNITS]


def balanced(structure, case):
    """Force and first moments of the cells, from the origin."""
    areas, cells = np.array(structure["areas"]), case["in_cells"]
    force = areas @ np.array(cells["pressure"])
    first = areas @ np.array(cells["first_moments"]) - force * np.array(structure["origin"])
    return [force, *first]


def test_a_raft_under_columns(capsys, raft, tmp_path):
    """On the terminal, as data, as a table, and as a file with bending moments."""
    files = ["--json", "out.json", "--table", "out.csv", "--vtu", "out.vtu"]
    loads = ["--loads", "cases.csv", "--point", f"{SITE[0] + 1},{SITE[1] + 1}"]
    code, out, err = run(capsys, *raft, *PLATE, "--cells", 40, *loads, *files)
    assert (code, err) == (0, [])
    assert "Plate              0.4 m thick, E 30000 MPa, nu 0.2" in out

    cells = DualMesh.from_mesh(Plan.read("raft.csv").mesh(n=40)).basis()
    middle = SITE[0] + 3, SITE[1] + 2
    plate = Plate(0.4, 30e6, 0.2)
    punch = plate.on(SOIL, cells, origin=middle)
    basis, (x, y) = punch.structure, SITE
    f = column_load(basis, (x + 1, y + 1), 600.0, sides=(0.4, 0.4), moments=(0.0, 30.0))
    f += column_load(basis, (x + 5, y + 3), 800.0, sides=(0.4, 0.6), moments=(-20.0, 0.0))
    found = json.loads((tmp_path / "out.json").read_text())
    (structure,) = found["structures"]
    weight, wind = structure["cases"]
    imposed = 600 + 800 + 240, 600 * -2 + 800 * 2 + 30, 600 * -1 + 800 * 1 - 20
    assert weight["force"] == pytest.approx(240.0, rel=1e-9)
    assert [wind["force"], *wind["first_moments"]] == pytest.approx(imposed, rel=1e-7)
    load = wind["load"]
    assert [load["force"], load["my"], load["mx"]] == pytest.approx(imposed, rel=1e-7)
    for case in (weight, wind):
        assert balanced(structure, case) == pytest.approx(
            [case["force"], *case["first_moments"]], rel=1e-9, abs=1e-4
        )
    f += 10.0 * LinearForm(lambda v, w: 1.0 * v).assemble(basis)
    w = punch.trace @ punch.solve(f).displacement
    assert wind["in_cells"]["deflection"] == pytest.approx(w, rel=1e-9)
    assert structure["plate"] == {"thickness": 0.4, "young": 30e6, "poisson": 0.2}

    with (tmp_path / "out.csv").open(newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert float(rows["wind"]["largest_deflection"]) == wind["deflection"]["largest"]
    line = next(line.split() for line in out if line.startswith("wind"))
    assert float(line[3]) == pytest.approx(1000 * wind["deflection"]["largest"], rel=1e-4)
    mesh = meshio.read("out.vtu")
    data = {name: np.concatenate(blocks) for name, blocks in mesh.cell_data.items()}
    plates = data["part"] == 0
    for i, m in enumerate(("mx", "my")):
        ends = data["moments"][plates, i].min(), data["moments"][plates, i].max()
        assert ends == pytest.approx(wind["moments"][m])
    assert np.isnan(data["moments"][~plates]).all()


@pytest.mark.usefixtures("raft")
def test_a_raft_under_its_own_weight_alone(capsys, tmp_path):
    cases_in(tmp_path, "name,q\nown weight,8\n", "own.csv")
    loads = ["--cells", 40, "--loads", "own.csv", "--table", "out.csv"]
    code, _, err = run(capsys, "solve", "raft.csv", *UNITS, "--plate", "0.4,30e6,0.2", *loads)
    assert (code, err) == (0, [])
    found = (tmp_path / "out.csv").read_text().splitlines()
    force = dict(zip(*(line.split(",") for line in found), strict=True))["force"]
    assert float(force) == pytest.approx(8 * 24, rel=1e-9)


@pytest.mark.usefixtures("raft")
def test_a_raft_beside_a_rigid_pad(capsys, tmp_path):
    """Two of them on one ground, with the difference of their settlements."""
    x, y = SITE
    (tmp_path / "pad.csv").write_text(
        "".join(f"{x + a},{y + b}\n" for a, b in ((7, 0), (9, 0), (9, 2), (7, 2)))
    )
    text = f"name,footing,force,x,y,q\na,raft,300,{x + 2},{y + 2},8\na,pad,200,{x + 8},{y + 1},0\n"
    cases_in(tmp_path, text, "both.csv")
    files = ["--json", "out.json", "--vtu", "out.vtu", "--table", "out.csv"]
    bodies = ["solve", "raft.csv", "pad.csv", *UNITS, "--plate", "raft=0.4,30e6,0.2"]
    loads = ["--cells", 40, "--loads", "both.csv", "--accuracy", "1e-2"]
    code, out, err = run(capsys, *bodies, *loads, *files)
    assert (code, err) == (0, [])
    found = json.loads((tmp_path / "out.json").read_text())
    (structure,), (pad,), (between,) = found["structures"], found["footings"], found["between"]
    case = structure["cases"][0]
    settled = pad["cases"][0]["settlement"] - case["mean_settlement"]  # its origin is its centroid
    assert between["differential_settlement"] == pytest.approx(settled, rel=1e-9)
    assert between["distance"] == pytest.approx(np.hypot(5, 1))
    assert case["force"] == pytest.approx(300 + 8 * 24, rel=1e-9)
    assert any(line.startswith("raft to pad: differential settlement") for line in out)
    mesh = meshio.read("out.vtu")
    assert sorted(set(np.concatenate(mesh.cell_data["footing"]))) == [0, 1]


def test_one_force_on_a_mesh(capsys, raft, tmp_path):
    mesh = Plan.read("raft.csv").mesh(n=40)
    mesh.save("mesh.msh")
    command = ["solve", "mesh.msh", *UNITS, *PLATE, "--grid", "triangles", "--force", 100]
    code, _, err = run(capsys, *command, "--at", 1, 0.5, "--json", "out.json")
    assert (code, err) == (0, [])
    (structure,) = json.loads((tmp_path / "out.json").read_text())["structures"]
    (case,) = structure["cases"]
    assert case["point"] == pytest.approx([SITE[0] + 4, SITE[1] + 2.5])
    assert structure["grid"].startswith(f"{mesh.nelements} ")
    code, _, err = run(capsys, *command, "--cells", 30)
    assert code == 2
    assert re.search(r"--cells with an outline \(.*\), got the mesh mesh.msh", err[0])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--plate", "0.4,30e6"], "Poisson's ratio T,E,NU, got '0.4,30e6'"),
        (["--plate", "0,30e6,0.2"], "positive thickness"),
        (["--plate", "0.4,30e6,0.7"], "poisson of at least 0 and below 0.5"),
        (["--plate", "slab=0.4,30e6,0.2"], "a footing among raft, .* got slab"),
        ([*PLATE, *PLATE], "one --plate for raft, got several"),
        (["--cells", "80"], "--plate with --cells"),
        (["--cells", "2", *PLATE, "--force", "1"], "--cells of at least 5, got 2"),
        ([*PLATE, "--settlement", "0.01"], "no --settlement with --plate"),
        (
            [*PLATE, "--collocation", "node"],
            "expected .*--collocation.* Remedy: leave it out",
        ),
        ([*PLATE, "--accuracy", "0.01"], "no --accuracy with --plate.* Remedy: --cells"),
        ([*PLATE], "--force or --loads with --plate, got neither"),
        ([*PLATE, "--force", "-5"], "case load: expected loads that pressures"),
        ([*PLATE, "--force", "5", "--at", "4", "0"], "--force: expected a column on the plate"),
        (
            [*PLATE, "--loads", "turn.csv"],
            "line 2: expected a side along x .* Remedy: bx and by in",
        ),
        ([*PLATE, "--loads", "slide.csv"], "line 2: expected vertical loads of a plate"),
        (["--loads", "cases.csv"], r"line 1: expected headings .* got 'bx', for plates only"),
    ],
)
def test_wrong_plates(capsys, raft, tmp_path, options, message):
    cases_in(tmp_path, "name,force,mx,my\na,100,0,5\n", "turn.csv")
    cases_in(tmp_path, "name,force,hx,hy\na,100,0,5\n", "slide.csv")
    few = ["--cells", "60"] if "--plate" in options and "--cells" not in options else []
    command = [*raft, *few, *options]
    code, _, err = run(capsys, *command)
    assert code == 2
    (line,) = err
    assert re.search(message, line), line


@pytest.fixture(scope="module")
def group():
    """A raft and a pad, solved together."""
    cells = DualMesh.from_mesh(Plan.from_polygon([(0, 0), (6, 0), (6, 4), (0, 4)]).mesh(n=40))
    raft = Plate(0.4, 30e6, 0.2).on(SOIL, cells.basis(), origin=(3.0, 2.0))
    pad = DualMesh.from_mesh(Plan.circle((8.0, 2.0), 1.0).mesh(n=30))
    punch = RigidPunch(SOIL, pad.basis(), origin=(8.0, 2.0))
    load = column_load(raft.structure, (2.0, 1.0), 500.0)
    return Punches([raft, punch]).solve([load, {"force": 300.0, "at": (0.1, 0.0)}])


@pytest.mark.usefixtures("undrawn")
def test_several_bodies_as_they_are_solved(group, tmp_path):
    """A page and data of all bodies, without naming them."""
    text = report_html(group)
    assert "Results, 0" in text
    assert "Differential settlements" in text
    write_report(tmp_path / "out.json", group)
    found = json.loads((tmp_path / "out.json").read_text())
    (structure,), (pad,) = found["structures"], found["footings"]
    (case,) = structure["cases"]
    assert balanced(structure, case) == pytest.approx([500.0, -500.0, -500.0], rel=1e-9)
    raft = group.solutions[0]
    assert case["in_cells"]["gap"] == raft.gap.tolist()
    assert pad["cases"][0]["first_moments"] == pytest.approx([30.0, 0.0], abs=1e-9)
    w = raft.punch.partition.areas @ (raft.punch.trace @ raft.displacement) / 24.0
    difference = group.solutions[1].settlement - w
    assert found["between"][0]["differential_settlement"] == pytest.approx(difference)
    with pytest.raises(TypeError, match="write_structure for what bends"):
        write_solution(tmp_path / "out.vtu", raft)


def test_a_single_structure_as_data(group, tmp_path):
    raft = group.solutions[0]
    write_report(tmp_path / "out.json", raft, units="kN,m", plates={"": Plate(0.4, 30e6, 0.2)})
    found = json.loads((tmp_path / "out.json").read_text())
    assert found["footings"] == []
    assert found["structures"][0]["cases"][0]["moments"]["mx"][1] > 0
    with pytest.raises(TypeError, match=r"expected a Plate for plates\[''\]"):
        write_report(tmp_path / "out.json", raft, plates={"": 0.4})
    with pytest.raises(ValueError, match=r"plates by the names of bodies, \[''\], got \['raft'\]"):
        write_report(tmp_path / "out.json", raft, plates={"raft": Plate(0.4, 30e6, 0.2)})


@pytest.mark.usefixtures("undrawn")
def test_a_thickness_in_another_unit_is_suspected(capsys, raft, tmp_path):
    """On the terminal, on the page and as data."""
    load = ["--force", "300", "--cells", "40"]
    files = ["--json", "out.json", "--report", "out.html"]
    code, _, err = run(capsys, *raft, "--plate", "400,30e6,0.2", *load, *files)
    assert code == 0
    told = "thickness of the plate is 6.67e+03 % of the extent of the plan"
    assert told in err[0]
    assert "Remedy: check the unit of the thickness in --plate" in err[0]
    assert told in (tmp_path / "out.html").read_text()
    (remark,) = json.loads((tmp_path / "out.json").read_text())["remarks"]
    assert told in remark
    assert run(capsys, *raft, *PLATE, *load)[::2] == (0, [])


@pytest.mark.usefixtures("undrawn")
def test_remedies_of_plates_are_options(capsys, raft, tmp_path):
    """Of cases without a solution nothing stood in files and on pages, which told of success."""
    cases_in(tmp_path, COLUMNS.replace("wind, 800", "wind, -5800"))
    loads = ["--loads", "cases.csv", "--cells", "20", "--table", "out.csv"]
    files = ["--json", "out.json", "--report", "out.html"]
    code, out, err = run(capsys, *raft, *PLATE, *loads, *files)
    assert code == 3
    assert err[0].startswith("skfem-dual: no solution in wind: expected loads")
    assert err[0].endswith("Remedy: move them or --bilateral for ground that pulls")
    with open("out.csv", encoding="utf-8") as file:
        weight, wind = csv.DictReader(file)
    assert [weight["success"], wind["success"], wind["force"]] == ["True", "False", "nan"]
    assert wind["message"].startswith("expected loads")
    assert [line.split()[0] for line in out if "NO SOLUTION" in line] == ["wind"]
    found = json.loads((tmp_path / "out.json").read_text())
    assert found["success"] is False
    first, second = found["structures"][0]["cases"]
    assert (first["success"], second["success"], second["force"]) == (True, False, None)
    assert first.keys() == second.keys()
    page = (tmp_path / "out.html").read_text()
    assert "NO SOLUTION in the case wind" in page
    assert "wind (NO SOLUTION)" in page
    assert re.search(r"Cases with a solution.*?1 of 2", page, re.S)
    head, _, _, wind = COLUMNS.splitlines()
    cases_in(tmp_path, f"{head}\n{wind.replace('800', '-5800')}\n")
    (tmp_path / "out.csv").unlink()
    code, _, err = run(capsys, *raft, *PLATE, *loads)
    assert (code, len(err)) == (2, 1)
    assert err[0].startswith("skfem-dual: error: case wind: expected loads")
    assert not (tmp_path / "out.csv").exists()


def test_a_million_cells_under_a_plate_are_refused_before_their_mesh(capsys, raft, monkeypatch):
    monkeypatch.setattr(Plan, "mesh", None)
    monkeypatch.setattr("skfem_dual.operators.resources.available_memory", lambda: 2.0**33)
    code, _, err = run(capsys, *raft, *PLATE, "--loads", "cases.csv", "--cells", "1000000")
    assert code == 2
    assert "a plate on 1000000 cells takes about 1.953e+05 MiB. Remedy: at most 41943" in err[0]


@pytest.mark.usefixtures("raft", "undrawn")
@pytest.mark.parametrize("plate", [[*PLATE, "--cells", "40"], []])
def test_couples_and_forces_that_pull_are_told(capsys, tmp_path, plate):
    """Of plates the table, the data and the page had nothing of them."""
    x, y = SITE[0] + 3, SITE[1] + 2
    sides = ("bx,by", "1,1") if plate else ("", "")
    text = f"name,force,x,y,mx,my,{sides[0]}\nturns,0,{x},{y},30,40,{sides[1]}\n"
    cases_in(tmp_path, text + f"pulls,-50,{x + 1},{y},0,0,{sides[1]}\n")
    files = ["--table", "out.csv", "--json", "out.json", "--report", "out.html", "--quiet"]
    loads = ["--loads", "cases.csv", "--bilateral", "--origin", x, y]
    code, _, err = run(capsys, "solve", "raft.csv", *UNITS, *plate, *loads, *files)
    assert (code, err) == (0, [])
    with (tmp_path / "out.csv").open(newline="") as file:
        turns, pulls = csv.DictReader(file)
    assert [float(turns[m]) for m in ("mx", "my")] == pytest.approx([30.0, 40.0], rel=1e-6)
    assert (turns["x"], float(turns["force"])) == ("nan", 0.0)
    assert [float(pulls[c]) for c in "xy"] == pytest.approx([x + 1, y], abs=1e-6)
    assert [float(pulls[m]) for m in ("mx", "my")] == [0.0, 0.0]
    found = json.loads((tmp_path / "out.json").read_text())
    _, pulled = (found["structures"] or found["footings"])[0]["cases"]
    assert pulled["point"] == pytest.approx([x + 1, y], abs=1e-6)
    page = (tmp_path / "out.html").read_text()
    assert ("Origin of moments" if plate else "Origin of settlement and moments") in page
    (told,) = re.findall(r"<table[^>]*>(?:(?!</table>).)*mx \[kN·m\]</th>.*?</table>", page, re.S)
    values = [float(v) for v in re.findall(r'value="([^"]*)"', told)]
    assert min(abs(v - 30) for v in values) < 1e-6
    assert min(abs(v - 40) for v in values) < 1e-6


@pytest.mark.usefixtures("undrawn")
def test_columns_are_listed(capsys, raft, tmp_path):
    """On the page with their units, as data as they went in, in the coordinates of the plan."""
    cases_in(tmp_path, COLUMNS)
    files = ["--json", "out.json", "--report", "out.html"]
    code, _, err = run(
        capsys, *raft, *PLATE, "--loads", "cases.csv", "--cells", "40", "--quiet", *files
    )
    assert (code, err) == (0, [])
    (structure,) = json.loads((tmp_path / "out.json").read_text())["structures"]
    x, y = SITE
    named = ("case", "force", "x", "y", "bx", "by", "mx", "my", "q")
    assert [tuple(column[name] for name in named) for column in structure["columns"]] == [
        ("weight", 0, 0, 0, 0, 0, 0, 0, 10),
        ("wind", 600, x + 1, y + 1, 0.4, 0.4, 0, 30, 10),
        ("wind", 800, x + 5, y + 3, 0.4, 0.6, -20, 0, 0),
    ]
    page = (tmp_path / "out.html").read_text()
    (listed,) = re.findall(r"<caption>Loads on the structure</caption>(.*?)</table>", page, re.S)
    heads = re.findall(r'<th scope="col">(.*?)</th>', listed)
    over = ["acting at [m]", "over [m]", "Mx [kN·m]", "My [kN·m]", "all over [kPa]"]
    assert heads == ["Case", "Force [kN]", *over]
    rows = re.findall(r'<th scope="row">(.*?)</th>(.*?)</tr>', listed)
    found = [(name, [float(v) for v in re.findall(r'value="([^"]*)"', row)]) for name, row in rows]
    assert found == [
        ("weight", [0, 0, 0, 10]),
        ("wind", [600, x + 1, y + 1, 0.4, 0.4, 0, 30, 10]),
        ("wind", [800, x + 5, y + 3, 0.4, 0.6, -20, 0, 0]),
    ]
    with pytest.raises(TypeError, match=r"CaseRow for a row of columns\['a'\].*read_cases"):
        Details(columns={"a": [(1.0, 2.0)]})


def test_lines_of_one_column_are_taken_together(capsys, raft, tmp_path):
    """Dead and live load in lines of their own silenced the warning."""
    load = ["--plate", "0.1,30e6,0.2", "--cells", "100", "--loads", "cases.csv", "--quiet"]
    said = []
    for lines, force in ((1, 900), (3, 300)):
        line = f"s,{force},{SITE[0] + 3},{SITE[1] + 2},0.3,0.3\n"
        cases_in(tmp_path, "name,force,x,y,bx,by\n" + lines * line)
        said.append(run(capsys, *raft, *load)[2])
    assert said[0] == said[1]
    assert any("deflection under the column" in line for line in said[0])


def test_too_few_cells_for_an_outline_are_told_by_their_option(capsys, raft, tmp_path):
    ring = [f"{np.cos(t)},{np.sin(t)}" for t in np.linspace(0, 2 * np.pi, 200, endpoint=False)]
    (tmp_path / "round.csv").write_text("\n".join(ring) + "\n")
    given = [*PLATE, "--cells", "20", "--force", "100"]
    code, _, err = run(capsys, "solve", "round.csv", *UNITS, *given)
    assert code == 2
    assert "expected --cells from" in err[0]


def test_cells_too_large_for_a_column_are_told(capsys):
    """Against Hogg's infinite plate, on which a square column stands."""
    plate, side = Plate(0.5, 30e6, 0.2), 0.54
    modulus = 30e3 / (1 - 0.3**2)
    length = (2 * plate.rigidity / modulus) ** (1 / 3)
    k, turn = np.linspace(1e-6, 200 / length, 20001), 2 * np.pi * (np.arange(32) + 0.5) / 32
    half = side / 2 / np.pi
    patch = np.mean(
        [np.sinc(k * np.cos(t) * half) * np.sinc(k * np.sin(t) * half) for t in turn], axis=0
    )
    exact = (
        900 / (2 * np.pi) * np.trapezoid(k * patch / (plate.rigidity * k**4 + modulus * k / 2), k)
    )
    basis = DualMesh.from_mesh(rectangle(12 * length, 12 * length, n=150)).basis()
    punch, at = plate.on(SOIL, basis), np.zeros((2, 1))
    load = column_load(punch.structure, (0.0, 0.0), 900.0, sides=(side, side))
    found = punch.solve(load, unilateral=False).deflection(at)[0] - exact
    expected = excess_under_columns(plate, punch.structure, at, np.array([900.0]))[0]
    assert 0.7 < expected / found < 1.5

    options = ["--young", "30e3", "--poisson", 0.3, "--plate", "0.5,30e6,0.2", "--force", 900]
    corners = "0,0 32,0 32,32 0,32"
    code, _, err = run(capsys, "solve", "--corners", corners, *options, "--cells", 300)
    assert code == 0
    told = r"under the column at \(16, 16\) is too large by up to \S+ %.*Remedy: --cells \d+"
    assert re.search(told, " ".join(err))


def test_pages_of_one_solution_and_of_cases_tell_the_same_input(raft):
    """What stands on a structure, and the motions that are imposed on a footing."""
    dual = DualMesh.from_mesh(rectangle(6, 4, n=40))
    plate = Plate(0.4, 30e6, 0.2)
    slab = plate.on(SOIL, dual.basis())
    s = slab.solve(column_load(slab.structure, (1.0, 0.5), 500.0, sides=(0.4, 0.4)))
    row = CaseRow("", "load", "", 500.0, (1.0, 0.5), None, (0.0, 0.0), sides=(0.4, 0.4))
    options = {"columns": {"": [row]}, "plates": {"": plate}}
    for page in (report_html(s, **options), report_html({"": {"load": s}}, **options)):
        assert "Loads on the structure" in page
    footing = RigidPunch(SOIL, dual.basis())
    moved = {"settlement": 0.0123, "tilt": (0.001, 0.0)}
    for found in (footing.solve(**moved), footing.solve_many({"a": moved, "b": {"force": 1.0}})):
        page = report_html(found)
        given = page[page.index("<h2>Input") :]
        assert "0.0123" in given[: given.index("</section>")]
