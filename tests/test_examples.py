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
    a, b, c, d, square, lifted = result.solutions.values()
    assert a.settlement == pytest.approx(0.46875, rel=1e-3)
    assert a.tilt == pytest.approx([0.75 * 0.9375 * 0.15, 0.0], abs=2e-4)
    assert b.settlement == pytest.approx(0.2212284989, rel=2e-3)
    assert b.tilt[0] == pytest.approx(0.15 * 0.496333765, rel=3e-3)
    # less pressure at the edge, more in the middle
    spread = [s.pressure.max() / s.mean_pressure for s in (a, b)]
    assert spread[1] < spread[0]
    # references for E* = 1: settlement, tilt, part in contact, its edge on the axis
    for s, known in (
        (c, (0.4999, 0.2626, 0.988, -0.91)),
        (d, (0.4821, 0.4190, 0.735, -0.33)),
    ):
        line = max(s.contact_region.edge, key=np.size)
        assert s.settlement == pytest.approx(0.9375 * known[0], rel=1e-3)
        assert s.tilt[0] == pytest.approx(0.9375 * known[1], rel=2e-3)
        assert s.contact_area / np.pi == pytest.approx(known[2], abs=5e-3)
        assert line[0, np.abs(line[1]).argmin()] == pytest.approx(known[3], abs=0.02)
    assert square.contact_area == pytest.approx(4)
    assert lifted.contact_area < 2.5
    # no parabola: edges on finer meshes agree better with each other than with it
    from ex11_eccentric_load import Edge

    edges = [Edge.of(s) for s in result.refined]
    fine, coarse = edges[-1], edges[-2]
    inner = np.abs(fine.y) < 0.7
    order = np.argsort(coarse.y)
    between = fine.x[inner] - np.interp(fine.y[inner], coarse.y[order], coarse.x[order])
    assert np.abs(between).max() < 0.6 * fine.deviation[inner].max()
    assert (fine.deviation[[0, -1]] < -0.025).all()  # the circle draws it back
    assert 0.005 < fine.deviation.max() < 0.012


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


def check_ex16(result):
    from ex16_square_punch import disagreement

    assert sum(map(len, result.old)) == 113
    before = disagreement(result, *result.old)
    one, two = (disagreement(result, *new) for new in result.smoothed.values())
    assert two < 0.5 * before
    assert two < one < before


def check_ex17(result):
    for name in result.exact:
        old, paper, found = (
            result.rms(name, v[name]) for v in (result.old, result.paper, result.found)
        )
        assert found < paper < old
        assert found < 0.65 * old


def check_ex23(result):
    for plan in ("square", "L-shape"):
        n, (below, above, mixed), indicator = result.errors(plan, "adaptive")
        assert (below < 0).all()
        assert (above > 0).all()
        assert (np.abs(mixed) < 0.2 * above).all()
        effectivity = np.sqrt(indicator / above)
        assert 0.8 < effectivity.min() < effectivity.max() < 1.6
        m, (_, uniform, _), _ = result.errors(plan, "uniform")
        at = np.exp(np.interp(np.log(m[-1]), np.log(n), np.log(above)))
        assert at < 0.75 * uniform[-1]


def check_ex24(result):
    footings = result.footings
    circle = np.hypot(*footings["circle"].kern())
    assert circle == pytest.approx(0.5, rel=6e-3)  # a third of the radius
    turned = footings["square"].kern()
    assert np.sort(turned.max(axis=1)) == pytest.approx(-np.sort(turned.min(axis=1)), rel=1e-2)
    for punch in footings.values():
        # beyond the kern some cell would pull, inside none
        corners = punch.kern()
        upright = punch.stiffness()[1:, 0] / punch.stiffness()[0, 0]
        for k in range(0, corners.shape[1], corners.shape[1] // 4):
            out = corners[:, k] - upright
            assert punch.solve(1.0, tuple(upright + 0.95 * out)).message == "full contact"
            assert "contact on" in punch.solve(1.0, tuple(upright + 1.15 * out)).message
    curve = result.curve
    assert (np.diff(curve.rotation) > 0).all()
    full = curve.eccentricity < curve.lift_off
    compliance = 0.91 / (30e6 * 1.5**3 * np.pi * 0.662348)  # of the square: references
    slope = curve.rotation[full][1:] / curve.moment[full][1:]
    assert slope == pytest.approx(compliance, rel=3e-3)


def check_ex25(result):
    from ex25_hertz_and_cone import errors

    for shape, limits in (("sphere", (1e-3, 5e-3, 1e-3)), ("cone", (1e-3, 5e-3))):
        s = result.everywhere[shape][1]
        assert len(s.contact) == pytest.approx(500, rel=0.1)
        assert (np.abs(errors(shape, s)) < limits).all()
        coarse, fine = result.everywhere[shape][0], result.refined[shape][-1]
        assert abs(errors(shape, fine)[0]) < 0.5 * abs(errors(shape, coarse)[0])
        assert fine.force == pytest.approx(s.force)


def check_ex26(result):
    assert (np.diff(result.factors) < 0).all()
    assert (np.diff(result.tilts) < 0).all()
    factors, tilts = result.far
    assert (result.factors > factors).all()
    assert result.factors[-1] == pytest.approx(factors[-1], rel=1e-3)
    assert result.tilts[-1] == pytest.approx(tilts[-1], rel=0.02)
    equal, heavy = result.pictured.values()
    near = equal.punches.interaction_factors([{"force": 1.0}] * 2)
    assert near[0] == pytest.approx(result.factors[1], rel=1e-10)
    assert near[1] == pytest.approx(near[0], rel=1e-3)
    assert equal[0].tilt[0] == pytest.approx(-equal[1].tilt[0], rel=1e-2)
    assert heavy[0].contact_area < 3.7
    assert heavy[1].contact_area == pytest.approx(4)


SMALL = {
    "ex11_eccentric_load": {"refinements": 2},
    "ex20_edge_convergence": {"sizes": (60, 150, 350)},
    "ex23_adaptive": {"most": 700},
    "ex24_kern_and_overturning": {"n": 300, "steps": 10},
    "ex25_hertz_and_cone": {"cells": (125, 500), "refinements": 2},
    "ex26_neighbours": {"n": 150, "distances": (0.05, 0.2, 1.0, 16.0)},
}


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
