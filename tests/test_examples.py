"""Every example solves what it says and draws it; figures against exact values."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from skfem_dual import check_mesh
from skfem_dual.grids.duality import check_dual

FOLDER = Path(__file__).parents[1] / "examples"
NAMES = sorted(path.stem for path in FOLDER.glob("ex*.py"))


def load(name, monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


def check_ex08(result):
    assert result.constant.settlement == pytest.approx(0.46875, rel=1e-2)
    assert result.weighted.settlement == pytest.approx(0.46875, rel=3e-4)


def check_ex11(result):
    solutions = result.solutions
    circle = solutions["circle, homogeneous"]
    assert circle.settlement == pytest.approx(0.46875, rel=1e-3)
    assert circle.tilt == pytest.approx([0.75 * 0.9375 * 0.15, 0.0], abs=2e-4)
    graded = solutions["circle, graded"]
    assert graded.settlement == pytest.approx(0.2212284989, rel=2e-3)
    assert graded.tilt[0] == pytest.approx(0.15 * 0.496333765, rel=3e-3)
    # less pressure at the edge, more in the middle
    spread = [s.pressure.max() / s.mean_pressure for s in (circle, graded)]
    assert spread[1] < spread[0]


def check_ex20(result):
    for mesh in ("uniform", "graded", "random"):
        n, weighted = result.errors[mesh, "edge-weighted"]
        below, above = (result.errors[mesh, f"constant, {c}"][1] for c in ("node", "centroid"))
        assert (below < 0).all()
        assert (above > 0).all()
        assert (10 * np.abs(weighted) < above).all()
        order = np.log(above[0] / above[-1]) / np.log(n[-1] / n[0])
        assert order == pytest.approx(1.0 if mesh == "graded" else 0.5, abs=0.15)


def check_ex01(result):
    assert check_dual(result.one_type).ok
    assert check_dual(result.extremal).ok
    assert check_dual(result.extremal.swapped()).ok
    assert result.extremal.swapped().kind == "minimal"


def check_ex02(result):
    for name in ("extremal", "general", "acute"):
        assert check_dual(getattr(result, name)).ok
    assert not check_dual(result.obtuse).ok


def check_ex03(result):
    assert check_mesh(result.dual.mesh).ok
    assert not result.report.ok
    assert "(the first joins nodes 0 and 1)" in str(result.error)


def check_ex04(result):
    for dual, general, report in result.rows.values():
        assert report.success
        assert report.after.smallest_angle > report.before.smallest_angle
        n = len(dual) + dual.mesh.nelements + dual.nboundary
        assert general.p.shape[1] == n
    assert result.rows["neighbours"][2].after.from_means < 1e-9


def check_ex05(result):
    for dual in result.duals.values():
        assert 1.6 < dual.K_TV < 1.9  # the paper's range
        assert check_mesh(dual.mesh).measures[0].values.min() > 30  # degrees


def check_ex21(result):
    for name, exact in (("homogeneous", 0.46875), ("graded", 0.2212284989)):
        finite, boundary = result.finite[name], result.boundary[name]
        assert finite.settlement == pytest.approx(exact, rel=1.5e-4)
        assert boundary.settlement == pytest.approx(finite.settlement, rel=1e-3)


def check_ex22(result):
    # far below, the force of one: 3 P / (2 pi z^2)
    expected = 3 / (2 * np.pi * result.depths[-1] ** 2)
    assert result.below[-1] == pytest.approx(expected, rel=3e-2)
    assert (np.diff(result.below[2:]) < 0).all()


SMALL = {"ex20_edge_convergence": {"sizes": (60, 150, 350)}}


@pytest.mark.parametrize("name", NAMES)
def test_example(name, monkeypatch, tmp_path):
    example = load(name, monkeypatch)
    assert example.__doc__
    result = example.main(**SMALL.get(name, {}))
    assert str(result)
    globals()[f"check_{name.split('_')[0]}"](result)
    pictures = example.visualize(result)
    from gallery import save

    for title, picture in pictures.items():
        assert hasattr(picture, "show")
        save(picture, tmp_path / title)
        assert (tmp_path / f"{title}.png").stat().st_size > 10_000
    import matplotlib.pyplot as plt

    plt.close("all")


def test_examples_run_as_scripts(monkeypatch, tmp_path, capsys):
    example = load("ex08_pressure_along_radius", monkeypatch)
    from gallery import run

    monkeypatch.setattr(sys, "argv", ["ex08", "--save", str(tmp_path / "pictures")])
    run(example.main, example.visualize)
    assert "0.46875" in capsys.readouterr().out
    assert {p.suffix for p in (tmp_path / "pictures").iterdir()} == {".png", ".svg"}
    import matplotlib.pyplot as plt

    plt.close("all")
