"""The comparison with other packages still runs; those not installed are skipped and named."""

import sys
from dataclasses import replace

import numpy as np
import pytest


def test_tables(load, capsys, monkeypatch):
    peers = load("peers")
    fewer = tuple(replace(m, settings=m.settings[::2]) for m in peers.METHODS)
    monkeypatch.setattr(peers, "METHODS", fewer)
    times, everything, seconds = peers.main(sizes=(150,), limit=9.0, rounds=1, repeat=0.0, most=2)
    out = capsys.readouterr().out
    for name in ("bempp", "tamaas", "contactmechanics", "ngsolve"):
        used = any(m.process == name and ("disc", m.name) in everything for m in peers.METHODS)
        assert used != (f"{name}: skipped, ModuleNotFoundError" in out)
    (cells,) = {n for n, _ in times}
    assert 0.5 * 150 < cells < 2 * 150
    assert min(times[cells, "exact"], times[cells, "operator"]) > 0
    # forty nodes are enough
    assert ("square", "ours", 1e-3) in seconds
    for plan in ("disc", "square"):
        assert min(abs(runs[1].error) for runs in everything[plan, "ours"].values()) < 1e-3
        assert "home ground" in out


def test_another_failure_than_a_missing_package_is_shown(load, tmp_path, monkeypatch):
    peers = load("peers")
    for name in ("skfem_dual", "bempp"):
        (tmp_path / f"peer_{name}.py").write_text('raise ValueError("broken")')
    monkeypatch.setattr(peers, "FOLDER", tmp_path)
    with pytest.raises(RuntimeError, match="ValueError: broken"), peers.processes(sys.executable):
        pass


def test_what_a_package_prints_is_no_answer(load, tmp_path, monkeypatch):
    """bempp tells on standard output that it misses Gmsh, when it is imported."""
    peers = load("peers")
    answers = """print('no gmsh'); print('{"ready": true}', flush=True)"""
    (tmp_path / "peer_skfem_dual.py").write_text(answers)
    monkeypatch.setattr(peers, "FOLDER", tmp_path)
    with peers.processes(sys.executable, ("skfem_dual",)) as found:
        assert list(found) == ["skfem_dual"]


def test_reached(load):
    peers = load("peers")
    runs = [
        peers.Run(10, 5e-4, 0, 1.0, 1),  # by chance
        peers.Run(20, -2e-3, 0, 2.0, 1),
        peers.Run(40, 9e-4, 0, 4.0, 1),
        peers.Run(80, -9e-5, 0, 3.0, 1),
    ]
    assert peers.reached(runs, 1e-2) is runs[0]
    assert peers.reached(runs, 1e-3) is runs[3]
    assert peers.reached(runs, 1e-4) is None  # maybe by chance
    assert peers.reached(runs[:2], 1e-3) is None
    assert peers.quickest({"a": runs[:2], "b": runs}, 1e-3) == (runs[3], "b")


@pytest.mark.parametrize("plan", ["disc", "square", "Hertz"])
def test_regular_grid(load, plan):
    common = load("peer_common")
    side, surface = common.heights(plan, 64, 1.25)
    area = (side / 64) ** 2
    assert surface.shape == (64, 64)
    assert surface.max() == pytest.approx(0, abs=area)
    np.testing.assert_array_equal(surface, surface[::-1])
    np.testing.assert_array_equal(surface, surface.T)
    if plan == "Hertz":  # the radius of contact is 1, where the sphere is 1/2 higher
        assert side == 2.5
        assert (surface > -0.5).sum() * area == pytest.approx(np.pi, rel=1e-2)
    else:
        exact = {"disc": np.pi, "square": 4.0}[plan]
        assert (surface == 0).sum() * area == pytest.approx(exact, rel=1e-2)
        assert surface.min() < -common.PROBLEMS[plan][1]  # no contact around it
