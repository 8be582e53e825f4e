import json
import os
import re
import shlex
import signal
import subprocess
import sys
import warnings
from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import meshio
import numba
import numpy as np
import pytest
from marks import slow
from skfem import MeshTri

from skfem_dual import DualMesh, RigidPunch, __version__, startup
from skfem_dual.cli import main
from skfem_dual.cli.messages import COMPILING, progress_of_compilation, show_warning
from skfem_dual.errors import MeshWarning
from skfem_dual.io import read_dual, read_polygons, write_whole

DATA = Path(__file__).parent / "data"
DISC = str(DATA / "disc.msh")
DRAWING = str(DATA / "footing.dxf")
GROUND = ["--young", "1", "--poisson", "0.25"]


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """A file of a disc of few cells, of the area of the circle."""
    path = tmp_path_factory.mktemp("coarse") / "disc.msh"
    disc = MeshTri.init_circle(3)
    x = disc.p * np.sqrt(np.pi / DualMesh.from_mesh(disc).partition.areas.sum())
    meshio.write(path, meshio.Mesh(np.vstack([x, 0 * x[:1]]).T, {"triangle": disc.t.T}), "gmsh")
    return str(path)


def run(capsys, *args):
    """Exit code, lines of stdout, lines of stderr."""
    try:
        code = main([str(a) for a in args])
    except SystemExit as stop:
        code = stop.code
    found = capsys.readouterr()
    return code, found.out.splitlines(), found.err.splitlines()


def only_case(found):
    """The one case of the one footing."""
    (footing,) = found["footings"]
    (case,) = footing["cases"]
    return case


def test_solve(capsys, tmp_path):
    files = {k: tmp_path / f"out.{k}" for k in ("vtu", "json")}
    code, out, err = run(
        capsys, "solve", DISC, *GROUND, "--force", "1", "--at", "-0.1", "5e-2",
        "--edge", "constant", "--vtu", files["vtu"], "--json", files["json"],
    )  # fmt: skip
    assert (code, err) == (0, [])
    table = {line[:19].strip(): line[19:] for line in out}
    assert table["Grid"] == "513 dual cells, constant edge, centroid collocation"
    # the paper's disc of 944 triangles: 0.47216; exact for the circle: 0.46875
    assert float(table["Settlement W0"]) == pytest.approx(0.4722, abs=2e-4)
    assert table["Force, acting at"] == "1, (-0.1, 0.05)"
    assert {"import", "dual", "assembly", "factorisation"} <= set(
        re.findall("[a-z]+", table["Time [s]"])
    )
    found = json.loads(files["json"].read_text())
    assert (found["schema"], found["version"]) == ("skfem-dual/1", __version__)
    case = only_case(found)
    assert case["settlement"] == pytest.approx(float(table["Settlement W0"]), rel=1e-5)
    assert case["first_moments"] == pytest.approx([-0.1, 0.05])
    assert found["success"] is True
    polygons, data, _ = read_polygons(files["vtu"])
    assert data["pressure"] @ polygons.areas == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("options", "grid"),
    [
        (["--grid", "triangles"], "944 triangles, singular edge, centroid collocation"),
        (["--edge", "constant", "--collocation", "node"], "constant edge, node collocation"),
    ],
)
def test_grids_and_collocation(capsys, options, grid):
    code, out, _ = run(capsys, "solve", DISC, *GROUND, "--force", "1", *options)
    assert code == 0
    assert any(line.endswith(grid) for line in out)


def test_other_loads(capsys, coarse, tmp_path):
    """Moments with the paper's signs; a position instead of a load; another origin."""
    path = tmp_path / "out.json"
    to_file = ["--json", path]
    # mx presses down the side of larger y, my that of larger x
    pulled = ["--force", "-1e6", "--moments", "2e4", "3e4"]
    code, _, err = run(capsys, "solve", coarse, *GROUND, *pulled, *to_file)
    assert code == 2
    assert "does not pull" in err[0]
    run(capsys, "solve", coarse, *GROUND, *pulled, "--bilateral", *to_file)
    found = only_case(json.loads(path.read_text()))
    assert found["load"]["moments"] == [2e4, 3e4]
    assert found["force"] == pytest.approx(-1e6)
    assert found["first_moments"] == pytest.approx([3e4, 2e4])
    run(capsys, "solve", coarse, *GROUND, "--settlement", "0.5", "--tilt", "0.1", "-.1", *to_file)
    found = only_case(json.loads(path.read_text()))
    assert (found["settlement"], found["tilt"]) == (pytest.approx(0.5), pytest.approx([0.1, -0.1]))
    run(capsys, "solve", coarse, *GROUND, "--force", "1", "--origin", "0.2", "0", *to_file)
    assert only_case(json.loads(path.read_text()))["tilt"][0] > 0


def test_lift_off(capsys, coarse, tmp_path):
    path = tmp_path / "out.json"
    load = ["--force", "1", "--at", "0.5", "0"]
    code, out, err = run(capsys, "solve", coarse, *GROUND, *load, "--json", path)
    assert (code, err) == (0, [])
    assert any("contact on" in line for line in out)
    found = only_case(json.loads(path.read_text()))
    assert found["contact_area"] == pytest.approx(0.735 * np.pi, rel=1e-2)
    assert found["pressure"]["min_of_cells"] == 0
    assert found["iterations"] > 0
    assert found["complementarity_residual"] < 1e-12


def test_moduli_in_another_unit_are_suspected(capsys, coarse):
    """Megapascals for kilopascals: a disc settles by half of its radius."""
    load = ["--force", "30", "--units", "kN,m"]
    code, _, err = run(capsys, "solve", coarse, "--young", "30", "--poisson", "0.3", *load)
    assert code == 0
    assert "a settlement is 22.7 % of the extent of the plan" in err[0]
    code, _, err = run(capsys, "solve", coarse, "--young", "30e3", "--poisson", "0.3", *load)
    assert (code, err) == (0, [])


def test_named_edges(capsys):
    annulus = DATA / "eccentric_annulus.msh"
    load = [*GROUND, "--force", "1"]
    found = []
    for names in ((), ("--edge-boundaries", "edge"), ("--edge-boundaries", "edge", "hole")):
        code, out, err = run(capsys, "solve", annulus, *load, *names)
        assert (code, err) == (0, [])
        found.append(next(line for line in out if line.startswith("Settlement")))
    assert found[0] == found[2] != found[1]
    code, _, err = run(capsys, "solve", annulus, *load, "--edge-boundaries", "rim")
    assert code == 2
    assert "['edge', 'hole'], got ['rim']" in err[0]


def test_layered_ground(capsys, coarse, tmp_path):
    """One layer H = a bonded to a rigid base: W E0 a / P = 0.195493."""
    ground = tmp_path / "ground.toml"
    ground.write_text(
        'base = "bonded"\n[[layers]]\nthickness = 1.0\nyoung = 1.0\npoisson = 0.25\n'
    )
    code, out, err = run(capsys, "solve", coarse, "--substrate", ground, "--force", "1")
    assert (code, err) == (0, [])
    settlement = next(line for line in out if line.startswith("Settlement"))
    assert float(settlement[19:]) == pytest.approx(0.195493, rel=3e-3)
    assert any("Layer(thickness=1.0" in line for line in out)


def test_pictures(capsys, coarse, tmp_path):
    files = [tmp_path / "isobars.png", tmp_path / "isobars.svg", tmp_path / "both.png"]
    load = [*GROUND, "--force", "1", "--at", "0.1", "0"]
    assert run(capsys, "solve", coarse, *load, "--png", files[0], "--svg", files[1])[0] == 0
    assert run(capsys, "dual", coarse, "--png", files[2])[0] == 0
    assert files[0].read_bytes().startswith(b"\x89PNG")
    assert "<svg" in files[1].read_text()[:1000]
    assert min(f.stat().st_size for f in files) > 10_000
    assert sorted(tmp_path.iterdir()) == sorted(files)


def test_axes_of_pictures_have_the_unit(capsys, coarse, tmp_path, monkeypatch):
    from skfem_dual.visuals import pyvista

    shown = []

    def isobars(*args, **options):
        plotter = original(*args, **options)

        def screenshot(path):
            texts = [a for a in plotter.actors.values() if hasattr(a, "GetInput")]
            shown.extend(a.GetInput() for a in texts if isinstance(a.GetInput(), str))
            Path(path).touch()

        plotter.screenshot = screenshot
        return plotter

    original = pyvista.isobars
    monkeypatch.setattr(pyvista, "isobars", isobars)
    files = ["--png", tmp_path / "x.png", "--svg", tmp_path / "x.svg"]
    load = ["--young", "30e3", "--poisson", "0.3", "--force", "100", *files]
    assert run(capsys, "solve", coarse, *load, "--units", "kN,cm")[::2] == (0, [])
    assert "x, y [cm]" in shown
    assert "x [cm]" in (tmp_path / "x.svg").read_text()
    shown.clear()
    assert run(capsys, "solve", coarse, *load[:-2])[0] == 0
    assert not any("x, y" in text for text in shown)


def test_picture_of_moments_alone(capsys, coarse, tmp_path, monkeypatch):
    """Without a force the mean is next to nothing, and no measure."""
    from skfem_dual.visuals import matplotlib

    drawn = {}

    def isobars(solution, **options):
        drawn["axes"] = original(solution, **options)
        return drawn["axes"]

    original = matplotlib.isobars
    monkeypatch.setattr(matplotlib, "isobars", isobars)
    load = [*GROUND, "--settlement", "0", "--tilt", "0.1", "0", "--bilateral"]
    assert run(capsys, "solve", coarse, *load, "--svg", tmp_path / "x.svg")[0] == 0
    bar = drawn["axes"].figure.axes[1]
    assert bar.get_ylabel() == "p / max |p|"
    ticks = [float(label.get_text().replace("\u2212", "-")) for label in bar.get_yticklabels()]
    assert 0 in ticks
    assert np.abs(ticks).max() < 2  # over the largest mean of a cell
    code, _, err = run(
        capsys, "solve", coarse, *GROUND, "--force", "0", "--svg", tmp_path / "y.svg"
    )
    assert code == 2
    assert "not written, as there is no pressure to draw" in err[0]


def test_report(capsys, coarse, tmp_path, undrawn):
    """The same numbers as in the JSON file, the bounds of the settlement too."""
    files = [tmp_path / "report.html", tmp_path / "out.json"]
    solve = ["solve", coarse, *GROUND, "--force", "1", "--at", "0.5", "0"]
    args = [*solve, "--grid", "triangles", "--report", files[0], "--json", files[1]]
    assert run(capsys, *args)[0] == 0
    text, found = files[0].read_text(encoding="utf-8"), json.loads(files[1].read_text())
    case = only_case(found)
    assert "<td>disc.msh</td>" in text
    for name, value in {
        "Settlement W0 of the origin": case["settlement"],
        "Contact area": case["contact_area"],
        "Mean pressure on the contact area": case["pressure"]["mean"],
        "Largest mean pressure of a cell": case["pressure"]["max_of_cells"],
        "Largest mean pressure on a circle": case["pressure"]["largest"],
    }.items():
        assert f'<th scope="row">{name}</th><td><data value="{value!r}">' in text
    low = re.search(r'Settlement at the load \[L\]</th><td><data value="(.*?)">', text)[1]
    assert float(low) == found["error"]["bounds"]["settlement"][0]
    assert sorted(tmp_path.iterdir()) == sorted(files)


def test_report_tells_what_went_wrong(capsys, tmp_path, undrawn):
    """Warnings of the run; no bounds of a load that the triangles do not carry."""
    path, report = tmp_path / "mixed.vtu", tmp_path / "report.html"
    square = MeshTri().refined(3)
    p = np.vstack([square.p, np.zeros(square.p.shape[1])]).T
    meshio.write(path, meshio.Mesh(p, {"triangle": square.t.T, "tetra": [[0, 1, 3, 2]]}))
    load = [*GROUND, "--force", "1", "--at", "0", "0.477"]
    code, out, err = run(capsys, "solve", path, *load, "--report", report)
    assert code == 0
    text = report.read_text(encoding="utf-8")
    told = "quadrilaterals are read; left out 1 tetra"
    assert told in text
    assert sum(told in line for line in err) == 1
    assert "No bounds are known: " in text
    assert any(line.startswith("Bounds") and "none: " in line for line in out)


def test_dual(capsys, tmp_path):
    path = tmp_path / "dual.vtu"
    code, out, err = run(capsys, "dual", DATA / "eccentric_annulus.msh", "--vtu", path)
    assert (code, err) == (0, [])
    assert "Triangles: 929, K_TV = 1.72" in out
    assert len(read_dual(path)) == 539


def test_check(capsys, tmp_path):
    code, out, _ = run(capsys, "check", DISC)
    assert code == 0
    assert not [line for line in out if line.startswith("FAIL")]
    assert any("smallest angle" in line for line in out)
    path = tmp_path / "kites.vtu"  # Fig. 3c
    p = np.array([(0, 0, 0), (1, 0, 0), (2.8, 1, 0), (2.8, -1, 0)], dtype=float)
    meshio.write(path, meshio.Mesh(p, {"triangle": [[0, 1, 2], [0, 1, 3]]}))
    code, out, _ = run(capsys, "check", path)
    assert code == 1
    assert "crossed by the segment" in out[-1]
    assert "Remedy" in out[-1]
    picture = tmp_path / "kites.png"
    assert run(capsys, "check", path, "--png", picture)[0] == 1
    assert picture.stat().st_size > 5_000
    # and solving refuses it
    code, out, err = run(capsys, "solve", path, *GROUND, "--force", "1")
    assert (code, out, len(err)) == (2, [], 1)
    assert "Remedy" in err[0]


LOAD = [*GROUND, "--force", "1"]


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["solve", "none.msh", *LOAD], "no such file: none.msh"),
        (["solve", __file__, *LOAD], "meshio cannot read"),
        (["solve", DISC, "--young", "0", "--poisson", "0", "--force", "1"], "positive Young"),
        (["solve", DISC, "--young", "1", "--poisson", "2", "--force", "1"], "from 0 to 0.5"),
        (["solve", DISC, *GROUND], "either a force or a settlement, got neither"),
        (["solve", DISC, *LOAD, "--settlement", "1"], "got both"),
        (["solve", DISC, *LOAD, "--at", "0", "0", "--tilt", "0", "0"], "tilt or a load point"),
        (["solve", DISC, *GROUND, "--force", "nan"], "expected a finite number"),
        (["solve", DISC, *GROUND, "--force", "heavy"], "expected a number, got 'heavy'"),
        (["solve", DISC, *GROUND, "--force", "1_0"], "expected a number, got '1_0'"),
        (["solve", DISC, *LOAD, "--at", "1"], "expected 2 arguments"),
        (["solve", DISC, *LOAD, "--grid", "hexagons"], "invalid choice: 'hexagons'"),
        (["solve", DISC, "--force", "1"], "either --young and --poisson or --substrate"),
        (["solve", DISC, *LOAD, "--substrate", __file__], "either --young and --poisson or"),
        (["solve", DISC, "--young", "1", "--force", "1"], "either --young and --poisson or"),
        (["solve", DISC, "--substrate", "no.toml", "--force", "1"], "no such file: no.toml"),
        (["solve", DISC, *LOAD, "--png", "isobars.jpg"], "ending in .png for --png"),
        (["solve", DISC, *LOAD, "--svg", "isobars.png"], "ending in .svg or .pdf"),
        (["solve", DISC, *LOAD, "--report", "report.txt"], "ending in .html or .pdf for --report"),
        (["solve", DISC, *LOAD, "--vtu", "no/such/folder/x.vtu"], "no such folder for --vtu"),
        (["solve", DISC, *LOAD, "--collocation", "node"], 'centroid" with edge "singular"'),
        (["dual", DISC, "--colour", "red"], "unrecognized arguments"),
        ([], "arguments are required"),
        (["bake", DISC], "invalid choice: 'bake'"),
        (["check", DRAWING], "; outlines, for the command solve, end in .csv"),
    ],
)
def test_errors_take_one_line_and_exit_with_2(capsys, args, message):
    code, out, err = run(capsys, *args)
    assert (code, out) == (2, [])
    assert len(err) == 1
    assert "error: " in err[0]
    assert message in err[0]


def test_warnings_take_one_line(capsys, tmp_path):
    path = tmp_path / "mixed.vtu"
    p = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    cells = {"triangle": [[0, 1, 2], [0, 2, 3]], "tetra": [[0, 1, 2, 3]]}
    meshio.write(path, meshio.Mesh(p, cells))
    code, _, err = run(capsys, "dual", path)
    assert code == 0
    told = "only triangles and quadrilaterals are read; left out 1 tetra"
    assert err == [f"skfem-dual: warning: {path}: {told}"]


def test_deprecations_in_other_packages_are_not_told(capsys, monkeypatch):
    def read(path, *args, **options):
        warnings.warn("required by future versions", DeprecationWarning, stacklevel=1)
        warnings.warn("left out", MeshWarning, stacklevel=1)
        return MeshTri().refined()

    monkeypatch.setattr("skfem_dual.cli.grids.read_mesh", read)
    code, _, err = run(capsys, "dual", DISC)
    assert (code, err) == (0, ["skfem-dual: warning: left out"])


def test_outputs_are_checked_before_the_work(capsys, tmp_path, monkeypatch):
    """Nothing is solved, nothing is written, and the mesh survives."""
    monkeypatch.setattr("skfem_dual.cli.footings.RigidPunch", None)  # a call would be a TypeError
    mesh, ground = tmp_path / "plan.msh", tmp_path / "ground.toml"
    mesh.write_bytes(Path(DISC).read_bytes())
    ground.write_text("[base]\nyoung = 1\npoisson = 0.25\n")
    (tmp_path / "soft.vtu").symlink_to(mesh)
    (tmp_path / "hard.json").hardlink_to(mesh)
    (tmp_path / "soft.html").symlink_to(ground)
    (tmp_path / "folder.json").mkdir()
    before = sorted(tmp_path.iterdir())
    load = ["solve", mesh, "--substrate", ground, "--force", "1"]
    for outputs, message in (
        (["--vtu", tmp_path / "soft.vtu"], "another file for --vtu than for MESH"),
        (["--json", tmp_path / "hard.json"], "another file for --json than for MESH"),
        (["--report", tmp_path / "soft.html"], "another file for --report than for --substrate"),
        (["--json", tmp_path / "folder.json"], "got the folder"),
    ):
        code, out, err = run(capsys, *load, *outputs)
        assert (code, out, len(err)) == (2, [], 1)
        assert message in err[0]
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    monkeypatch.setitem(sys.modules, "pyvista", None)
    for name in ("x.png", "x.svg", "x.html"):
        option = "--report" if name == "x.html" else f"--{name[2:]}"
        code, out, err = run(capsys, *load, option, tmp_path / name)
        assert (code, out, len(err)) == (2, [], 1)
        assert "Remedy: pip install 'skfem-dual[visuals]'" in err[0]
    assert sorted(tmp_path.iterdir()) == before
    assert mesh.read_bytes() == Path(DISC).read_bytes()


def test_a_solution_that_does_not_hold(capsys, coarse, tmp_path, monkeypatch):
    """Exit code 3, told in the table, on stderr and in the file."""

    def solve(punch, *args, **kwargs):
        found = original(punch, *args, **kwargs)
        return replace(
            found, success=False, message="the contact cycles", collocated_settlement=np.nan
        )

    original = RigidPunch.solve
    monkeypatch.setattr(RigidPunch, "solve", solve)
    path = tmp_path / "out.json"
    code, out, err = run(capsys, "solve", coarse, *GROUND, "--force", "1", "--json", path)
    assert code == 3
    assert [line for line in out if line.startswith("Success") and "NO" in line]
    assert err == ["skfem-dual: no solution: the contact cycles"]
    found = json.loads(path.read_text())
    assert found["success"] is False
    assert only_case(found)["settlement"] is None


@pytest.mark.parametrize(
    "number", ["inf", "-inf", "nan", "1e400", "1e-320", "1e101", "9" * 400, "9" * 5000, "0x1", ""]
)
@pytest.mark.parametrize("option", ["--young", "--force", "--origin"])
def test_numbers_out_of_any_range(capsys, option, number):
    again = [number] if option == "--origin" else []
    code, out, err = run(capsys, "solve", DISC, *LOAD, f"{option}", number, *again)
    assert (code, out, len(err)) == (2, [], 1)
    assert f"argument {option}: expected a" in err[0]
    assert len(err[0]) <= 300


def test_long_errors_are_cut(capsys):
    code, _, err = run(capsys, "check", "x" * 200 + "/" + "y" * 200 + ".msh")
    assert (code, len(err)) == (2, 1)
    assert len(err[0]) <= 300


def command(*args, shell="", **environment):
    """A process of the command line; ``shell`` follows the command."""
    words = [sys.executable, "-m", "skfem_dual", *map(str, args)]
    return subprocess.run(
        ["bash", "-o", "pipefail", "-c", f"{shlex.join(words)} {shell}"],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )


@pytest.mark.parametrize(
    ("shell", "code", "environment"),
    [
        ("| true", 0, {}),
        *slow(
            ("| true", 0, {"PYTHONUNBUFFERED": "1"}),
            (">&-", 0, {}),
            (">/dev/full", 2, {}),
            ("", 0, {"PYTHONIOENCODING": "ascii"}),
        ),
    ],
)
def test_files_are_written_whatever_becomes_of_the_table(
    coarse, tmp_path, shell, code, environment
):
    mesh, path = tmp_path / "größe.msh", tmp_path / "out.vtu"
    mesh.write_bytes(Path(coarse).read_bytes())
    found = command("dual", mesh, "--vtu", path, shell=shell, **environment)
    assert found.returncode == code
    assert found.stderr.count("\n") == (code > 0)
    assert len(read_dual(path)) == 145


def test_before_the_command_line_is_imported():
    found = command("check", DISC, NUMBA_NUM_THREADS="0")
    assert (found.returncode, found.stdout, found.stderr.count("\n")) == (2, "", 1)
    assert "expected a positive whole number in NUMBA_NUM_THREADS, got '0'. Rem" in found.stderr


def test_ctrl_c(tmp_path, capsys, monkeypatch):
    """One line and 130, also while modules are imported, here one that takes long."""
    (tmp_path / "numba.py").write_text("import time\nprint('begun', flush=True)\ntime.sleep(60)\n")
    places = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    process = subprocess.Popen(
        [sys.executable, "-m", "skfem_dual", "check", DISC],
        env=os.environ | {"PYTHONPATH": places},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # jobs in the background of a shell ignore the signal, and so would their children
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    with process:
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, "skfem-dual: interrupted\n")

    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    def interrupted_in_a_kernel(*args, **kwargs):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    for solve in (interrupted, interrupted_in_a_kernel):
        monkeypatch.setattr(RigidPunch, "solve", solve)
        assert run(capsys, "solve", DISC, *LOAD) == (130, [], ["skfem-dual: interrupted"])


def test_asked_to_end_while_a_file_is_written(tmp_path, monkeypatch):
    """Nothing of it is left."""

    def write(part):
        assert Path(part).exists()
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(sys, "excepthook", startup._told)  # as in a process of the command line
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        startup.end_of_imports()
        assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
        with pytest.raises(SystemExit) as ended:
            write_whole(tmp_path / "report.html", write)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert ended.value.code == 143
    assert not list(tmp_path.iterdir())


signals = pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)]
)


def ended(program):
    """Exit code and standard error of a program of its own."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60)
    return done.returncode, done.stderr


@signals
def test_asked_to_end_while_libraries_are_imported(number, code):
    """VTK bears no exception then: a command ended in a segmentation fault, one time in four."""
    program = (
        "import os, signal, sys\n"
        "from skfem_dual import startup\n"
        "startup.is_command = lambda: True\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "signal.signal(signal.SIGTERM, startup._ended)\n"
        "try:\n"
        "    with startup.leaving_at_once():\n"
        f"        signal.raise_signal({int(number)})\n"
        "except BaseException:\n"
        "    os._exit(1)\n"
    )
    assert ended(program)[0] == code
    before = signal.getsignal(number)
    with startup.leaving_at_once():  # other programs are left alone
        assert signal.getsignal(number) is before
    assert signal.getsignal(number) is before


@signals
def test_asked_to_end_in_a_finaliser(number, code):
    """Python loses exceptions there: the signal comes once more, also to one who waits."""
    program = (
        "import signal, sys, time\n"
        "from skfem_dual import startup\n"
        "class Dies:\n"
        "    def __del__(self):\n"
        f"        signal.raise_signal({int(number)})\n"
        "sys.excepthook = startup._told\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "startup.end_of_imports()\n"
        "Dies()\n"
        "begin = time.monotonic()\n"
        "try:\n"
        "    time.sleep(30)\n"
        "except KeyboardInterrupt:\n"
        "    sys.exit(130 if time.monotonic() < begin + 20 else 0)\n"
        "except SystemExit as asked:\n"
        "    sys.exit(asked.code if time.monotonic() < begin + 20 else 0)\n"
    )
    assert ended(program) == (code, b"")


@pytest.mark.skipif(sys.platform != "linux", reason="of names of files in bytes")
def test_words_in_other_characters_than_those_of_the_terminal(tmp_path):
    """They came as surrogates, or as question marks, in pages and files."""
    page, data = tmp_path / "a.html", tmp_path / "a.json"
    words = ["--title", "Größe", "--author", "Jörg", "--report", page, "--json", data]
    done = command("solve", DISC, *LOAD, *words, LC_ALL="C", PYTHONUTF8="0")
    assert done.returncode == 0, done.stderr
    assert "<title>Größe" in page.read_text(encoding="utf-8")
    assert "Jörg" in page.read_text(encoding="utf-8")
    assert json.loads(data.read_text(encoding="utf-8"))["title"] == "Größe"


def test_files_on_both_sides_of_options(capsys):
    found = run(capsys, "solve", DISC, *LOAD, DISC)
    assert found[0] == 2
    assert "Remedy: quotes around words that belong together; all footings" in found[2][0]


@pytest.mark.parametrize(
    ("option", "name"),
    [("vtu", "A.VTU"), ("report", "A.Html"), ("json", "A.JSON"), ("svg", "A.Pdf")],
)
def test_endings_in_capitals(capsys, tmp_path, option, name):
    code, _, err = run(capsys, "solve", DISC, *LOAD, f"--{option}", tmp_path / name)
    assert (code, err) == (0, [])
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_help_and_version(capsys):
    code, out, _ = run(capsys, "solve", "--help")
    assert code == 0
    for option in (
        "--young",
        "--at EX EY",
        "--moments MX MY",
        "--grid {dual,triangles}",
        "--report",
    ):
        assert option in "\n".join(out)
    assert "--report FILE" in "\n".join(out)
    assert run(capsys, "--version")[1] == [f"skfem-dual {__version__}"]


@pytest.mark.parametrize(
    ("args", "code", "out", "err"),
    [
        (["check", "none.msh"], 2, "", "skfem-dual: error: no such file: none.msh\n"),
        *slow((["dual", DISC], 0, "Cells (nodes of the triangulation): 513", "")),
    ],
)
def test_as_a_module(args, code, out, err):
    found = command(*args)
    assert found.returncode == code
    for text, told in (found.stdout, out), (found.stderr, err):
        assert told in text
        assert bool(text) == bool(told)


@pytest.mark.slow
def test_a_reader_that_leaves_early():
    found = command("check", DISC, shell="| true")
    assert found.stderr == ""


@pytest.mark.parametrize("shown", [True, False])
def test_compilation_is_told_where_progress_is(capsys, shown):
    with progress_of_compilation(Namespace(progress=shown)):
        assert numba.njit(lambda x: x + 1.0)(1.0) == 2.0
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"skfem-dual: {COMPILING}"] * shown


def test_warnings_of_other_packages_are_no_remarks(capsys):
    """Reports caution of what the problem is, not of what they are made with."""
    warned = []
    for warning in MeshWarning("two parts"), FutureWarning("another version"):
        show_warning(warned, warning)
    assert warned == ["two parts"]
    assert "warning: another version" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--json", "--force", "--loads", "--units"])
def test_options_given_twice_are_refused(capsys, option):
    """Only the last would count."""
    values = {"--force": ("1", "2"), "--units": ("kN,m", "N,mm")}.get(option, ("a.csv", "b.csv"))
    with pytest.raises(SystemExit) as ended:
        main(["solve", DISC, option, values[0], option, values[1]])
    assert ended.value.code == 2
    assert re.search(f"{option}.*: expected once, got ", capsys.readouterr().err)
