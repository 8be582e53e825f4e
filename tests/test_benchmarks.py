"""The benchmarks still run, and their small versions show what the full ones claim."""

import sys

import numpy as np
import pytest
from marks import slow


def test_edge(load, capsys):
    edge = load("edge")
    found = edge.main(sizes=(150,), plans=("disc", "L-shape"), kinds=("uniform", "adaptive"))
    for (*_, scheme), errors in found.items():
        settlement, tilt = np.abs(errors[:, :2]).T
        if scheme == "singular":
            assert settlement.max() < 5e-4
            assert tilt.max() < 1e-3
        else:
            assert settlement.min() > 1e-3
    assert "edge-weighted" in capsys.readouterr().out


def test_substrates(load, capsys, monkeypatch):
    substrates = load("substrates")
    some = {k: v for k, v in substrates.grounds().items() if k in ("E0 (1 + z)", "layer, bonded")}
    monkeypatch.setattr(substrates, "grounds", lambda: some)
    found = substrates.tables(n=20)
    assert all(build > 0 and ratio > 0 for build, ratio in found.values())
    errors = substrates.punches(sizes=(60,))
    assert all(abs(e[0, 1]) < 5e-3 for e in errors.values())
    assert "bonded" in capsys.readouterr().out


def test_grids(load, capsys):
    grids = load("grids")
    found = grids.main(sizes=(200,))
    assert {name for _, name in found} == set(grids.WORK)
    assert "Voronoi" in capsys.readouterr().out


def test_edge_time(load, capsys):
    edge_time = load("edge_time")
    assert list(edge_time.set_up(sizes=(150,))) == [150]
    found = edge_time.to_accuracy(plans=("disc",), ladder=(30, 150))
    weighted, constant = (
        dict((n, e) for n, e, _ in found["disc", k]) for k in ("singular", "constant")
    )
    assert all(10 * weighted[n] < constant[n] for n in weighted)
    assert "0.01 %" in capsys.readouterr().out


def test_small(load, capsys, monkeypatch):
    small = load("small")
    monkeypatch.setattr(small, "starts", lambda runs: {"import, s": 0.5})
    monkeypatch.setattr(small, "alone", lambda tree, *given: small.measured(*given))
    (found,) = small.main(sizes=(30,), runs=1)
    assert {"law of the edge", "slopes in cells"} <= set(found["30"])
    assert "dual grid to answer" in capsys.readouterr().out


def test_cases(load, capsys):
    rows = load("cases").main(cells=150, count=8)
    for (_, lifting), row in rows.items():
        assert row.cases.success.all()
        assert np.sum(row.cases.contact_share < 1) == (4 if lifting else 0)
    assert "lifted" in capsys.readouterr().out


def test_plan_cost(load, capsys):
    ((kept, cost),) = load("plan_cost").main(plans=1, fine=400).T
    assert kept
    assert np.isfinite(cost)
    assert "1 plans, 100.0% within 1e-03" in capsys.readouterr().out


def test_unilateral(load, capsys):
    unilateral = load("unilateral")
    rows = unilateral.main(sizes=(150,))
    assert len(rows) == 4
    for row in rows.values():
        assert row.difference < 1e-8
        for s in row.solutions.values():
            assert s.complementarity_residual < 1e-9
            assert len(s.contact) < len(s.pressure)
            assert s.iterations > 0
    assert "conj. gradients" in capsys.readouterr().out


class Here:
    """What answers like the process of a package."""

    def __init__(self, **tasks):
        self.tasks = tasks

    def ask(self, task, repeat=0.0, **question):
        return self.tasks[task](repeat=repeat, **question)


@pytest.fixture(params=["here", *slow("process")])
def ours(request, load):
    """Our part of the comparisons with peers, in this process or in one of its own."""
    if request.param == "here":
        own, common = load("peer_skfem_dual"), load("peer_common")
        yield {"skfem_dual": Here(rough=common.roughness(own.press), sphere=own.sphere)}
    else:
        with load("peers").processes(sys.executable, ("skfem_dual",)) as found:
            yield found


def test_regular(load, ours, capsys, tmp_path):
    """Without peers; both tolerances are met, and a sphere as far as its grids go."""
    regular = load("regular")
    rows = regular.rough(ours, tmp_path, 32, (1e-2, 1e-4), repeat=0.0)
    runs = regular.hertz(ours, (8, 16), repeat=0.0)
    for periodic in (False, True):
        loose, strict = (rows[periodic, t, "skfem_dual"] for t in (1e-2, 1e-4))
        assert 0.05 < strict[0]["contact"] < 0.5
        assert strict[1] < 2e-2
        assert strict[1] <= loose[1]
    assert min(abs(run.error) for part in runs["ours"].values() for run in part) < 1e-3
    assert "solution alone" in capsys.readouterr().out


def test_structures(load, capsys):
    structures = load("structures")
    rows = structures.main((60,), (5,), 0)
    assert set(rows) == {("raft", 60), ("block", 5)}
    for row in rows.values():
        assert row.solution.success
        assert row.difference < 1e-7
        assert row.solution.equilibrium_residual < 1e-10
        assert 0 < len(row.solution.contact) < len(row.solution.pressure)
        assert min(row.cpu, row.wall, row.dense) > 0
    assert "balance" in capsys.readouterr().out


def test_mutation(load):
    """Faults stand where they change what is done, and each alone."""
    mutation = load("mutation")
    source = (
        'def f(x: int = 1) -> "a < b":\n'
        '    """x < 1"""\n'
        "    if x < 2 and not x:\n"
        '        raise ValueError(f"{x + 1} " + "é" * 2)\n'
        "    x += 0.5\n"
        "    return max(x) if x else -x\n"
    )
    faults = mutation.faults(source)
    changed = [mutation.inserted(source, fault).splitlines() for fault in faults]
    assert len({tuple(lines) for lines in changed}) == len(faults)
    lines = source.splitlines()
    for fault, other in zip(faults, changed, strict=True):
        compile("\n".join(other), "f", "exec")
        assert [i for i, (a, b) in enumerate(zip(lines, other, strict=True)) if a != b] == [
            fault.line - 1
        ]
    assert sorted((fault.line, fault.new) for fault in faults) == [
        (1, "(2)"),
        (3, "(3)"),
        (3, "(x < 2 or not x)"),
        (3, "(x <= 2)"),
        (3, "(x > 2)"),
        (3, "(x)"),
        (4, "pass"),
        (5, "(1.0)"),
        (5, "x -= 0.5"),
        (6, "(max(x) if not x else -x)"),
        (6, "(x)"),
        (6, "min"),
    ]


def test_a_fault_is_seen_or_not(load, tmp_path, monkeypatch):
    mutation = load("mutation")
    path = tmp_path / "skfem_dual" / "one.py"
    path.parent.mkdir()
    path.write_text("def f(x):\n    return x + 1\n")
    monkeypatch.setitem(mutation.TESTS, "one", ["one"])
    # tests that see only that another number is added
    monkeypatch.setattr(mutation, "passes", lambda *_: "2" not in path.read_text())
    assert mutation.study(None, tmp_path, "one", None) == (2, ["one:2: x + 1  ->  (x - 1)"])
    assert path.read_text() == "def f(x):\n    return x + 1\n"
    path.write_text("x = 2\n")
    with pytest.raises(RuntimeError, match="the tests of one fail without any fault"):
        mutation.study(None, tmp_path, "one", None)


def test_bounds(load, capsys):
    bounds = load("bounds")
    found = bounds.main(cases=1, fine=300)
    assert len(found) == 1
    assert np.all([one.holds for one in found])
    for one in found:
        assert (one.low <= one.found).all()
        assert (one.found <= one.high).all()
    assert "full contact" in capsys.readouterr().out


@pytest.mark.parametrize("process", ["here", *slow("own")])
def test_growth(load, capsys, tmp_path, monkeypatch, process):
    growth = load("growth")
    if process == "here":
        monkeypatch.setattr(growth, "of_its_own", growth.solve)
    (small,) = growth.main(sizes=(500,), lift=True)
    large = growth.solve(1500, lift=True)
    assert abs(large.error) < abs(small.error) < 1e-3
    assert abs(large.lifted) < 2e-3
    assert 0 < large.steps < 40
    assert 0 < small.ready < small.seconds
    text = capsys.readouterr().out
    assert "lift-off" in text
    (again,) = growth.read(text)
    assert (again.cells, again.steps) == (small.cells, small.steps)
    assert again.processor == pytest.approx(small.processor, abs=0.006)
    assert again.memory == pytest.approx(small.memory, abs=6e6)
    assert [again.error, again.lifted] == pytest.approx([small.error, small.lifted], rel=0.06)
    growth.plot([small, large], str(tmp_path / "growth.png"))
    assert (tmp_path / "growth.png").stat().st_size > 1e4


def test_a_busy_machine_is_told(load, capsys, monkeypatch):
    quiet = load("quiet")
    monkeypatch.setattr(quiet.os, "getloadavg", lambda: (3.6, 1.0, 1.0), raising=False)
    assert quiet.warn_beside_other_work() in capsys.readouterr().out
    monkeypatch.setattr(quiet.os, "getloadavg", lambda: (0.1, 3.0, 3.0), raising=False)
    assert quiet.warn_beside_other_work() == ""
