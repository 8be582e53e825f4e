"""What the documentation says works as it stands there.

The pages are built by the slow tests, which need ``pip install '.[docs]'`` and Debian's packages
``chromium`` and ``chromium-driver``.
"""

import contextlib
import doctest
import importlib
import io
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from marks import slow

import skfem_dual
from skfem_dual.cli import main

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS) for path in (DOCS / "guide").glob("*.md"))
#: pages whose programs take longest
LONG = [
    Path("guide") / f"{name}.md"
    for name in (
        "command_line",
        "ground",
        "lift_off",
        "many_cells",
        "motions",
        "pictures",
        "structures",
    )
]
PROGRAMS = [
    Path("index.md"),
    Path("quickstart.md"),
    *(page for page in PAGES if page.stem != "index" and page not in LONG),
]
BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.M | re.S)
#: rows whose figures are others every time
VARY = re.compile(r"^ *(?:Residuals|Time \[s\]|Accuracy) .*", re.M)
#: numbers, in the words around them
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
#: modules on the pages of the reference beside the names of the package itself
MODULES = (
    "contact.exact",
    "contact.shapes",
    "elements.stresses",
    "grids.generate",
    "io",
    "report",
    "visuals.matplotlib",
    "visuals.pyvista",
)


@pytest.fixture
def load(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    monkeypatch.syspath_prepend(DOCS / "ext")
    yield importlib.import_module
    for name in [
        n for n, m in sys.modules.items() if str(DOCS) in str(getattr(m, "__file__", ""))
    ]:
        del sys.modules[name]


def shown_as(row: re.Match) -> str:
    """A row without its figures."""
    return re.sub(r"[\d.e+-]*\d", "#", row[0])


@pytest.mark.parametrize("page", [*PROGRAMS, *slow(*LONG)], ids=str)
def test_its_programs_run(page, tmp_path, monkeypatch, undrawn):
    """Each goes on where the one before ended, and prints what stands below it."""
    import matplotlib.pyplot as plt

    (tmp_path / "tests").symlink_to(ROOT / "tests")
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))
    assert blocks
    names, same = {"__name__": "page"}, doctest.OutputChecker().check_output
    for kind, block, expected in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            if kind == "sh":
                command = shlex.split(block)
                assert command[:3] == ["python", "-m", "skfem_dual"]
                assert main(command[3:]) == 0
            else:
                exec(compile(block, str(page), "exec"), names)
        found = printed.getvalue()
        expected, found = VARY.sub(shown_as, expected), VARY.sub(shown_as, found)
        if kind == "sh" and expected:
            assert NUMBER.sub("", found).split() == NUMBER.sub("", expected).split()
            numbers = [[float(x) for x in NUMBER.findall(text)] for text in (found, expected)]
            assert numbers[0] == pytest.approx(numbers[1], rel=1e-3)
        elif kind == "python":
            assert same(expected, found, doctest.NORMALIZE_WHITESPACE), found
    plt.close("all")
    for file in re.findall(
        r"--(?:png|svg|vtu|json|report) (\S+)", "".join(b for _, b, _ in blocks)
    ):
        assert (tmp_path / file).stat().st_size > 300


def documented() -> list[str]:
    """Names that the pages of the reference describe."""
    text = "".join(page.read_text(encoding="utf-8") for page in (DOCS / "api").glob("*.md"))
    return re.findall(
        r"^\.\. auto(?:class|function|exception|data):: skfem_dual\.(\S+)", text, re.M
    )


def test_reference_has_every_public_name_once():
    found = documented()
    assert len(set(found)) == len(found)
    assert set(skfem_dual.__all__) <= set(found)
    for name in MODULES:
        module = importlib.import_module(f"skfem_dual.{name}")
        public = getattr(module, "__all__", None) or [
            n
            for n, x in vars(module).items()
            if getattr(x, "__module__", None) == module.__name__ and not n.startswith("_")
        ]
        for n in public:
            assert f"{name}.{n}" in found or n in found, f"{name}.{n} is not in docs/api"


def test_reference_names_exist():
    for name in documented():
        module, _, last = f"skfem_dual.{name}".rpartition(".")
        assert getattr(importlib.import_module(module), last).__doc__, name


def test_sections_of_the_reference_name_members(load):
    found = load("docstrings").sections(DOCS / "api")
    assert ("RigidPunch", "solve") in found
    for owner, member in found:
        assert getattr(getattr(skfem_dual, owner), member).__doc__, f"{owner}.{member}"


def test_links_between_pages():
    """Files that are written by the build are left to the test of the pages."""
    built = ("gallery/", "_drawings/", "_notebook/", "_validation/")
    pages = [p for p in DOCS.rglob("*.md") if not p.relative_to(DOCS).parts[0].startswith("_")]
    assert len(pages) > 20
    for page in pages:
        text = page.read_text(encoding="utf-8")
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text):
            target = (page.parent / link).resolve()
            if not target.relative_to(DOCS).as_posix().startswith(built):
                assert target.is_file(), f"{page.name}: {link}"


def test_drawings_are_those_of_the_pages(load):
    drawings = load("drawings")
    used = set()
    for page in [*DOCS.glob("*.md"), *(DOCS / "guide").glob("*.md")]:
        used |= set(re.findall(r"_drawings/(\w+)\.svg", page.read_text(encoding="utf-8")))
    assert used == set(drawings.DRAWINGS)


@pytest.mark.slow
def test_drawings(load, tmp_path):
    drawings = load("drawings")
    drawings.draw_all(tmp_path)
    for name in drawings.DRAWINGS:
        assert (tmp_path / f"{name}.svg").stat().st_size > 5_000


def test_pages_of_examples(load, tmp_path):
    pages = load("example_pages")
    script = (
        '"""A title: with stars *.\n\nText, ``a*b`` and x_.\n\n    p = |q|\n    r\n\nKept::\n\n'
        '    s*\n"""\n\nimport numpy\n\n\ndef main(n=1):\n    return n\n\n\n'
        'if __name__ == "__main__":\n    run(main, visualize)\n'
    )
    path = tmp_path / "ex01_title.py"
    path.write_text(script)
    found = pages.page_source(path, {"n": 2})
    assert found.startswith(
        '"""\nA title: with stars \\\\*\n======================\n\nText, ``a*b`` and x\\\\_.\n\n'
        ".. code-block:: text\n\n    p = |q|\n    r\n\nKept::\n\n    s*\n"
    )
    assert found.endswith(
        '\n\n# %%\n\nif __name__ == "__main__":\n    run(main, visualize, n=2)\n'
    )
    compile(found, "page", "exec")
    path.write_text("print()")
    with pytest.raises(ValueError, match=r"expected a docstring .* in ex01_title\.py"):
        pages.page_source(path, {})
    mark = ".. GENERATED FROM PYTHON SOURCE LINES 1-2\n"
    page = (
        f"note\n.. rst-class:: sphx-glr-example-title\nhead\n{mark}code\n"
        f"{mark}\n.. code-block:: Python\n\n\n    call\n\n.. image::\n\n given\n"
        ".. _sphx_glr_download_x:\n\nfooter\n"
    )
    words = pages.rearranged(page, "ex01_couples").split()
    known = ("note", "head", "given", "code", "call", "footer")
    assert [w for w in words if w in known] == ["head", "given", "code", "call"]
    assert "examples/ex01_couples.py``" in " ".join(words)
    with pytest.raises(ValueError, match="expected a page"):
        pages.rearranged("no page", "x")


def test_every_example_has_a_page(load, tmp_path):
    pages = load("example_pages")
    old = tmp_path / "gallery" / "paper" / "ex00_gone.py.md5"
    old.parent.mkdir(parents=True)
    old.touch()
    pages.copy_examples(ROOT / "examples", tmp_path / "pages", tmp_path / "gallery")
    assert not old.exists()
    names = {path.stem for path in (ROOT / "examples").glob("ex*.py")}
    copies = list((tmp_path / "pages").rglob("ex*.py"))
    assert {path.stem for path in copies} == names
    for path in copies:
        compile(path.read_text(encoding="utf-8"), str(path), "exec")


def test_examples_run_without_a_command_line(monkeypatch, capsys):
    """As in the gallery: with options for main, and pictures shown."""
    monkeypatch.syspath_prepend(ROOT / "examples")
    gallery = importlib.import_module("gallery")
    monkeypatch.setattr(sys, "argv", ["ex00"])
    shown = []

    class Picture:
        def show(self):
            shown.append(self)

    gallery.run(lambda n=1: n, lambda result: {"a": Picture(), "b": Picture()}, n=7)
    assert capsys.readouterr().out == "7\n"
    assert len(shown) == 2


def test_validation(load):
    """What is quick to compute; the whole below."""
    validation = load("validation")
    for name in ("rigid_circle", "uniform_load", "printed"):
        for row in validation.TABLES[name]():
            assert row.met, str(row)
    row = validation.Row("x", "2.50e-3", 0.0025123, 1e-2)
    assert str(row) == "| x | 2.50e-3 | 2.51e-3 | +5e-3 | 1e-2 |"
    row = validation.Row("x", "-0.91", -0.932, 0.02, absolute=True)
    assert str(row) == "| x | -0.91 | -0.93 | -2e-2 | 2e-2 absolute, **missed** |"


def test_tables_of_performance(load):
    measure = load("measure")
    names = ("performance.md", "robustness.md")
    page = "\n".join((DOCS / name).read_text(encoding="utf-8") for name in names)
    assert set(re.findall(r"^```\{measured\} (\w+)", page, re.M)) == set(measure.BENCHMARKS)
    for command in measure.BENCHMARKS.values():
        assert (ROOT / "benchmarks" / command[0]).is_file()
    header = measure.header(["edge.py"])
    assert "$ python benchmarks/edge.py" in header
    assert "cores" in header
    assert str(ROOT) not in header


def test_milliseconds_beside_others(load):
    """Out of a text like that of `benchmarks/peers.py`, and out of what it printed last."""
    milliseconds = load("measure").milliseconds
    text = (
        "3. Milliseconds to accuracy, and more\n              1.00%     0.10%\n"
        "Hertz   ours      6.8 (0.4), 24    13.3 (1.1), 150\n"
        "disc    Tamaas    0.8 (0.0), 256    no: 9e-04 at 1271\n   no: the most accurate\n"
    )
    assert milliseconds(text, "0.10%") == {
        ("ours", "Hertz"): "13.3",
        ("Tamaas", "disc"): "not reached",
    }
    with pytest.raises(ValueError, match="5%"):
        milliseconds(text, "5%")
    found = milliseconds((DOCS / "performance" / "peers.txt").read_text(), "0.10%")
    assert all(float(found["ours", plan]) > 0 for plan in ("disc", "square", "Hertz"))


def test_front_page_has_a_picture_for_each_program(load):
    front = load("front")
    page = front.PAGE.read_text(encoding="utf-8")
    assert re.findall(r"_front/(\w+)\.png", page) == list(front.PICTURES)
    for name, program in zip(front.PICTURES, front.programs(), strict=True):
        assert f"\n{name} = " in program


def test_surfaces_of_scenes_are_light(load):
    """Without points that no face has, and of the same shape with fewer of the others."""
    import pyvista

    turning = load("turning")
    ball = pyvista.Sphere(radius=1.0, theta_resolution=130, phi_resolution=130)
    found = turning.lighter(ball)
    assert ball.n_points > 1.5 * turning.MOST > 1.2 * found.n_points
    assert abs(found.volume / ball.volume - 1) < 1e-3
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 0.0]]
    assert turning.lighter(pyvista.PolyData(corners, faces=[3, 0, 1, 2])).n_points == 3


def test_measured_tables_name_no_paths():
    for path in (DOCS / "performance").glob("*.txt"):
        assert not re.search(r"(?m)(?<![\w.:/])/(?:home|root|tmp|work|Users)/", path.read_text())


@pytest.mark.slow
def test_all_of_validation(load):
    validation = load("validation")
    rows = [row for rows in validation.TABLES.values() for row in rows()]
    assert len(rows) > 70
    for row in rows:
        assert row.met, str(row)


def test_notebook_has_all_programs_of_its_page(load):
    page = (DOCS / "quickstart.md").read_text(encoding="utf-8")
    cells = load("notebook").notebook(page)["cells"]
    programs = [block for kind, block, _ in BLOCK.findall(page) if kind == "python"]
    assert ["".join(c["source"]) for c in cells if c["cell_type"] == "code"] == [
        program.strip() for program in programs
    ]
    text = "\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "markdown")
    assert ".md)" not in text
    assert "```text" not in text


@pytest.mark.slow
def test_notebook_runs(load, tmp_path):
    """In a kernel of its own; a cell that fails raises."""
    import nbformat
    from nbclient import NotebookClient

    (tmp_path / "tests").symlink_to(ROOT / "tests")
    path = tmp_path / "quickstart.ipynb"
    load("notebook").write_notebook(DOCS / "quickstart.md", path)
    found = nbformat.read(path, as_version=4)
    nbformat.validate(found)
    NotebookClient(found, resources={"metadata": {"path": str(tmp_path)}}).execute()
    printed = [o.get("text", "") for c in found.cells for o in c.get("outputs", ())]
    assert any("settlement" in text.lower() for text in printed)
    assert (tmp_path / "isobars.png").stat().st_size > 10_000


@pytest.mark.slow
def test_pages_build_and_show(load, tmp_path):
    """Sphinx gives no warning; headless Chromium finds nothing wrong on any page."""
    pytest.importorskip("sphinx", reason="needs the extra docs")
    build = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-b", "html"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    subprocess.run([*build, str(DOCS), str(tmp_path)], check=True, env=environment)
    faults = load("check_pages").check(tmp_path)
    assert faults == []


def test_floors_and_circles_of_a_house(load, tmp_path):
    imports = load("imports")
    files = {
        "__init__": "from .c import x\n",
        "low": "import numpy\n\nBOTH = 1\n",
        "room/__init__": '"""Nothing."""\n',
        "room/a": "from ..low import BOTH\n",
        "room/b": "from ..low import BOTH\nfrom . import a\n\n\ndef f():\n"
        '    """Says\n    much."""\n    from ..c import x\n\n    return x\n',
        "c": "from .room.b import f\nfrom .low import BOTH\n",
    }
    for name, text in files.items():
        path = tmp_path / "skfem_dual" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    house = imports.House.read(tmp_path)
    assert house.floors == {"low": 0, "room.a": 1, "room.b": 2, "c": 3}
    assert house.rooms == {"low": ["low"], "room": ["room.a", "room.b"], "c": ["c"]}
    assert house.floors_within("room") == 2
    assert [sorted(circle) for circle in house.circles] == [["c", "room.b"]]
    assert house.steps["room.b"] == {"room.a"}
    assert house.steps["c"] == {"room.b"}
    assert house.functions == {"room.b.f": 3}
    with pytest.raises(ValueError, match="expected no circles of imports"):
        imports.floors({"a": {"b"}, "b": {"a"}})
