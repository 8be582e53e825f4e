"""Cases that sleep, fail, die: nothing is lost, nothing is run twice without need."""

import errno
import io
import multiprocessing
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections import defaultdict
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from numpy.testing import assert_allclose
from plans import disc
from threadpoolctl import threadpool_info

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Paraboloid,
    Plate,
    Punches,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    column_load,
)
from skfem_dual.errors import warn
from skfem_dual.grids.generate import rectangle
from skfem_dual.sweeps import workers
from skfem_dual.sweeps.outcomes import SweepResult
from skfem_dual.sweeps.records import fingerprint, pickled, restored
from skfem_dual.sweeps.run import _called, sweep

module = sys.modules["skfem_dual.sweeps.run"]
LOADS = [dict(force=1.0, at=(e, 0.0)) for e in np.linspace(0, 0.4, 12)]


def square(x):
    return x * x


def slow_square(x, seconds=0.02):
    time.sleep(seconds)
    return x * x


def fussy(x):
    if x == 3:
        raise ValueError("three will not do")
    return x * x


def deadly(x, once=""):
    """Kills its own process if a file is not there yet."""
    if once and not Path(once).exists():
        Path(once).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def limits(_):
    pools = {pool["num_threads"] for pool in threadpool_info()}
    time.sleep(0.02)  # so that every worker gets some
    return numba.config.NUMBA_NUM_THREADS, numba.get_num_threads(), pools


@lru_cache
def punch_of(poisson):
    return RigidPunch(HalfSpace(1.0, poisson), DualMesh.from_mesh(disc(2)).basis())


def settle(poisson, force):
    solution = punch_of(poisson).solve(force)
    return solution.settlement, solution.timings["assembly"]


class Heavy:
    """A problem that counts how often it is pickled."""

    pickled = 0

    def __call__(self, x):
        time.sleep(0.001)
        return x * x

    def __getstate__(self):
        Heavy.pickled += 1
        return {"nothing": None}


def fresh_punch(refinements=3):
    return RigidPunch(HalfSpace(1.0, 0.25), DualMesh.from_mesh(disc(refinements)).basis())


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        yield pool


@pytest.fixture
def calls(tmp_path):
    """A problem that leaves a line for each of its calls, and the lines."""
    log = tmp_path / "calls"
    log.touch()

    def problem(x):
        with open(log, "a") as file:
            file.write(f"{x}\n")
        return {"x": x, "square": np.array(x * x)}

    return problem, lambda: [int(line) for line in log.read_text().split()]


# --- ways to run


def test_success_of_several_results_in_one():
    """Of tuples, as groups answer, of what stands beside a solution, and of cases within."""
    punch = punch_of(0.2)
    beyond = {"force": 1.0, "at": (1.5, 0.0)}
    with pytest.warns(ConvergenceWarning):
        cases = punch.solve_many([{"force": 1.0}, beyond])
    for result in ((cases, 1.0), [(cases,), "said"], cases):
        with pytest.warns(ConvergenceWarning, match="have success=False.*the punch turns over"):
            found = sweep(lambda _, result=result: result, [0])
        assert not found.success
        assert "the punch turns over" in found.unsolved[0]
    assert sweep(lambda _: ((punch.solve(1.0), 2.0), [], "text"), [0]).success


def test_results_share_bodies_over_their_edges_and_without_structures():
    """Those are other objects of the problem: what they know is not computed for each result."""
    loads = [[{"force": 1.0}] * 2, [{"force": 2.0}] * 2]
    basis = DualMesh.from_mesh(disc(2)).basis()
    apart = DualMesh.from_mesh(disc(2).translated((3.0, 0.0))).basis()
    soil = HalfSpace(1.0, 0.2)
    both = Punches([RigidPunch(soil, basis), RigidPunch(soil, apart, origin=(3.0, 0.0))])
    found = sweep(both.solve, [{"loads": each} for each in loads]).results
    assert all(each.punches is both for each in found)
    assert found[0].solutions[0].punch is found[1].solutions[0].punch
    shaped = RigidPunch(HalfSpace(1.0, 0.2), basis, gap=Paraboloid(25.0))
    over = sweep(shaped.solve, [{"force": 1.0}, {"force": 2.0}]).results
    assert all(each.punch is shaped.sharp for each in over)


def test_one_after_the_other():
    seen = []
    found = sweep(square, range(5), on_result=lambda o: seen.append((o.number, o.result)))
    assert found.results == [0, 1, 4, 9, 16]
    assert seen == list(enumerate(found.results))
    assert found.success
    assert found.errors == {}
    assert all(outcome.seconds >= 0 for outcome in found.outcomes)
    assert sweep(square, []).results == []


def test_mappings_are_keywords_and_others_single_arguments():
    assert sweep(square, [dict(x=2), 3]).results == [4, 9]
    assert sweep(sum, [(1, 2), [3]]).results == [3, 3]


def test_results_come_as_they_are_ready_and_end_in_order():
    seconds, seen = [0.2, 0.1, 0.0], []
    cases = [dict(x=i, seconds=s) for i, s in enumerate(seconds)]
    with ThreadPoolExecutor(3) as pool:
        found = sweep(slow_square, cases, pool, on_result=lambda o: seen.append(o.number))
    assert seen == [2, 1, 0]
    assert found.results == [0, 1, 4]


def test_threads_need_no_pickle_of_the_problem():
    lock = threading.Lock()  # cannot be pickled
    with ThreadPoolExecutor(2) as pool:
        assert sweep(lambda x: (lock.locked(), x), [1, 2], pool).results == [
            (False, 1),
            (False, 2),
        ]


def test_processes(processes):
    cases = [dict(x=x, seconds=0.02 * (x % 2)) for x in range(10)]
    assert sweep(slow_square, cases, processes).results == [x * x for x in range(10)]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems fork unsafely or not at all")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_forked_processes_inherit_the_problem():
    lock = threading.Lock()  # cannot be pickled
    with ProcessPoolExecutor(2, multiprocessing.get_context("fork")) as pool:
        found = sweep(lambda x: (lock.locked(), x), range(6), pool, threads=None)
    assert found.results == [(False, x) for x in range(6)]


@pytest.mark.slow
def test_loky():
    loky = pytest.importorskip("loky")
    pool = loky.ProcessPoolExecutor(2)
    try:
        assert sweep(lambda x: x * x, range(6), pool).results == [x * x for x in range(6)]
    finally:
        pool.shutdown()


class Elsewhere(Executor):
    """What mpi4py's executor is to a sweep: tasks and results travel as pickles."""

    def __init__(self):
        self.tasks = []

    def submit(self, fn, /, *args, **kwargs):
        task = pickle.dumps((fn, args, kwargs))
        self.tasks.append(len(task))
        future = Future()
        fn, args, kwargs = pickle.loads(task)
        future.set_result(pickle.loads(pickle.dumps(fn(*args, **kwargs))))
        return future


class NotHere(dict):
    """The problems of this process, as another process sees them."""

    def __setitem__(self, key, value):
        pass


def test_any_executor(monkeypatch):
    monkeypatch.setattr(workers, "ours", NotHere())
    monkeypatch.setattr(workers, "received", {})
    punch, far = fresh_punch(), Elsewhere()
    found = sweep(punch.solve, LOADS, far)
    assert_allclose(
        [s.tilt[0] for s in found.results],
        [punch.solve(**load).tilt[0] for load in LOADS],
        atol=1e-12,
    )
    # the mesh travels once, to the first worker
    assert sum(size > 10_000 for size in far.tasks) <= 2 * workers.cores()
    # the sweep after it finds the problem there, and one of another problem does not
    assert sweep(punch.solve, LOADS[:1], far).success
    assert sweep(punch_of(0.3).solve, LOADS[:1], far).success
    assert len(workers.received) == 1


def test_a_worker_that_lacks_the_problem_is_sent_it(monkeypatch):
    """Workers one after the other forget it: each case is run all the same."""
    monkeypatch.setattr(workers, "ours", NotHere())
    forgetful = NotHere()
    monkeypatch.setattr(workers, "received", forgetful)
    assert sweep(square, range(20), Elsewhere()).results == [x * x for x in range(20)]


def test_the_problem_travels_to_workers_not_to_cases(processes):
    Heavy.pickled = 0
    found = sweep(Heavy(), range(200), processes)
    assert found.results == [x * x for x in range(200)]
    assert 1 <= Heavy.pickled < 100  # about twice for each core


# --- cases that fail, workers that die


@pytest.mark.parametrize("where", ["here", "threads", "processes"])
def test_a_failed_case_is_told_and_the_others_go_on(where, processes):
    pools = {"here": None, "threads": ThreadPoolExecutor(2), "processes": processes}
    with pytest.warns(ConvergenceWarning, match="1 of 5 cases failed, the first number 3: Value"):
        found = sweep(fussy, range(5), pools[where])
    assert found.results == [0, 1, 4, None, 16]
    assert list(found.errors) == [3]
    assert "in fussy" in found.errors[3]
    assert "three will not do" in found.errors[3]
    assert not found.success
    assert np.isnan(found.outcomes[3].seconds)
    assert "three will not do" in repr(found)
    assert isinstance(found, SweepResult)
    pools["threads"].shutdown()


def warning_square(x):
    if x > 1:
        warn(f"{x} cells", ResolutionWarning)
    return fussy(x)


@pytest.mark.parametrize("where", ["here", "threads", "processes"])
def test_warnings_of_cases_are_those_of_the_sweep(where, processes):
    """They come to the filters of the caller, whichever process or thread runs the cases."""
    with ThreadPoolExecutor(1) as threads, warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        pool = {"here": None, "threads": threads, "processes": processes}[where]
        line = sys._getframe().f_lineno + 1
        sweep(warning_square, [1, 2, 3], pool)
    told = sorted(str(w.message) for w in seen if w.category is ResolutionWarning)
    assert told == ["2 cells", "3 cells"]
    assert {(w.filename, w.lineno) for w in seen} == {(__file__, line)}


def test_a_warning_that_is_an_error_is_that_of_its_case(tmp_path):
    """The others go on, and the case is run again where it is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", ResolutionWarning)
        warnings.simplefilter("ignore", ConvergenceWarning)
        found = sweep(warning_square, [1, 2, 4], file=tmp_path / "s")
    assert [outcome.result for outcome in found.outcomes] == [1, None, None]
    assert "ResolutionWarning: 2 cells" in found.outcomes[1].error
    with pytest.warns(ResolutionWarning, match="[24] cells"):
        again = sweep(warning_square, [1, 2, 4], file=tmp_path / "s")
    assert again.results == [1, 4, 16]
    assert [outcome.resumed for outcome in again.outcomes] == [True, False, False]


def halved(x):
    found = SimpleNamespace(success=x > 1, message=f"{x} is too small", value=x / 2)
    return found if x else SimpleNamespace(success=np.array([True, False]), message="one of two")


@pytest.mark.parametrize("file", [None, "a.sweep"])
def test_results_without_success_are_told(tmp_path, file):
    """Also where they are from a file: the sweep said that every case has its result."""
    file = None if file is None else tmp_path / file
    for _ in range(2):
        with pytest.warns(ConvergenceWarning, match="2 of 3 cases have success=False"):
            found = sweep(halved, [2, 1, 0], file=file)
        assert not found.success
        assert found.unsolved == {1: "1 is too small", 2: "one of two"}
        assert not found.errors
        assert found.message.endswith("the first number 1: 1 is too small")
    assert sweep(halved, [2, 3]).success


def refused(x):
    raise ValueError(f"expected settings:\n  a > 0, got a = {x}\n")


def test_errors_of_several_lines_are_told_whole():
    with pytest.warns(ConvergenceWarning, match="2 of 2 cases failed"):
        found = sweep(refused, [-3, -4])
    assert found.message.endswith("number 0: ValueError: expected settings: a > 0, got a = -3")


def test_a_case_that_exits_has_failed():
    with pytest.warns(ConvergenceWarning, match="number 1: SystemExit: no mesh"):
        found = sweep(lambda x: sys.exit("no mesh") if x else x, [0, 1, 0])
    assert found.results == [0, None, 0]


def test_results_that_do_not_pickle_have_failed():
    with pytest.warns(ConvergenceWarning, match="1 of 2 cases"):
        found = sweep(lambda x: x or threading.Lock(), [0, 1])
    assert found.results == [None, 1]


class Unwilling:
    def __reduce__(self):
        return fussy, (3,)


def test_results_that_do_not_load_have_failed(tmp_path):
    with pytest.warns(ConvergenceWarning, match="three will not do"):
        found = sweep(lambda x: x or Unwilling(), [0, 1], file=tmp_path / "s")
    assert found.results == [None, 1]


@pytest.mark.parametrize("workers", slow(1, 2))
def test_own_workers_are_replaced_when_they_die(workers, tmp_path):
    cases = [dict(x=x) for x in range(8)]
    cases[3] = dict(x=3, once=str(tmp_path / "once"))
    assert sweep(deadly, cases, workers).results == [x * x for x in range(8)]
    assert (tmp_path / "once").exists()


class Mortal(Executor):
    """Breaks with a certain case, and with what else is under way."""

    def __init__(self, killer):
        self.killer, self.broken = killer, False

    def submit(self, fn, /, *args, **kwargs):
        if self.broken:
            raise BrokenExecutor("broken before")
        future, self.broken = Future(), args[0].case == self.killer
        if self.broken:
            future.set_exception(BrokenExecutor("broken now"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


@pytest.mark.parametrize(
    ("pools", "lost"), [(5, [3]), (3, [3]), (2, [3, 4, 5, 6, 7]), (1, [3, 4, 5, 6, 7])]
)
def test_a_case_that_kills_its_worker_twice_has_failed(pools, lost, monkeypatch):
    """The others are not to blame, as long as there are new workers."""
    started = iter([Mortal(3) for _ in range(pools)])

    def start(workers, job):
        if (pool := next(started, None)) is None:
            raise RuntimeError("no more processes")
        return pool

    monkeypatch.setattr(workers, "_started", start)
    with pytest.warns(ConvergenceWarning, match=f"{len(lost)} of 8 cases failed"):
        found = sweep(square, range(8), 2)
    assert found.results == [None if x in lost else x * x for x in range(8)]
    assert ("also alone" in found.errors[3]) == (pools > 1)
    assert all("not run" in found.errors[x] for x in lost[1:])


@pytest.mark.skipif(sys.platform != "linux", reason="other systems fork unsafely or not at all")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_broken_executor_is_told_and_the_file_resumes(tmp_path):
    file = tmp_path / "s"
    cases = [dict(x=x) for x in range(40)]
    cases[10] = dict(x=10, once=str(tmp_path / "once"))
    with (
        ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as pool,
        pytest.warns(ConvergenceWarning, match="terminated"),
    ):
        found = sweep(deadly, cases, pool, file=file)
    assert found.results[:10] == [x * x for x in range(10)]
    assert list(found.errors) == list(range(10, 40))
    assert "not run" in found.errors[39]
    again = sweep(deadly, cases, file=file)
    assert again.results == [x * x for x in range(40)]
    assert [o.resumed for o in again.outcomes] == [o.error is None for o in found.outcomes]


@pytest.mark.slow
def test_dask_loses_nothing_when_a_worker_is_killed():
    distributed = pytest.importorskip("distributed")
    cases = [dict(x=x, seconds=0.1) for x in range(24)]
    killed = []
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = client.run(os.getpid)

        def kill_one(outcome):
            if outcome.number >= 3 and not killed:
                killed.extend(list(pids.values())[:1])
                os.kill(killed[0], signal.SIGKILL)

        found = sweep(slow_square, cases, client.get_executor(), on_result=kill_one)
        assert killed
        assert killed[0] not in client.run(os.getpid).values()
    assert found.success
    assert found.results == [x * x for x in range(24)]


def test_own_workers_that_cannot_start():
    with pytest.raises(TypeError, match="problem that can be pickled"):
        sweep(lambda x: x, [1], 1)


@pytest.mark.slow
def test_scripts_without_a_guard(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("from skfem_dual.sweeps.run import sweep\nsweep(abs, [1], 1)\n")
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert 'call sweep under if __name__ == "__main__"' in ended.stderr


# --- the file


@pytest.mark.parametrize("interrupted", [0, 1, 5])
def test_an_interrupted_sweep_resumes(interrupted, tmp_path, calls):
    problem, log = calls

    def interrupt(outcome):
        if outcome.number == interrupted:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(problem, range(8), file=tmp_path / "s", on_result=interrupt)
    assert log() == list(range(interrupted + 1))
    found = sweep(problem, range(8), file=tmp_path / "s")
    assert log() == list(range(8))
    assert [int(result["square"]) for result in found.results] == [x * x for x in range(8)]
    assert [outcome.resumed for outcome in found.outcomes] == [x <= interrupted for x in range(8)]
    assert found.torn == 0
    assert f"{interrupted + 1} of them from the file" in repr(found)


def test_a_full_disk_is_told_with_the_file(tmp_path, monkeypatch):
    """What fits is written, and found once there is room."""
    file = tmp_path / "s"
    sweep(square, range(2), file=file)
    room = file.stat().st_size * 3 // 4  # for one record and a half
    file.unlink()

    class Full(io.FileIO):
        def write(self, data):
            fits = min(room - self.tell(), len(data))
            if fits == 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(data[:fits])

    with monkeypatch.context() as patch:
        patch.setattr(module, "open", lambda file, mode, **_: Full(file, mode), raising=False)
        with pytest.raises(OSError, match="No space left on device") as error:
            sweep(square, range(2), file=file)
    assert (error.value.errno, error.value.filename) == (errno.ENOSPC, str(file))
    found = sweep(square, range(2), file=file)
    assert [outcome.resumed for outcome in found.outcomes] == [True, False]
    assert found.torn > 0


def test_a_changed_list_of_cases_resumes(tmp_path, calls):
    problem, log = calls
    sweep(problem, [1, 2, 3], file=tmp_path / "s")
    found = sweep(problem, [4, 3, 1], file=tmp_path / "s")
    assert [result["x"] for result in found.results] == [4, 3, 1]
    assert log() == [1, 2, 3, 4]


def test_equal_cases_are_run_as_often_as_they_are_listed(tmp_path, calls):
    problem, log = calls
    sweep(problem, [7, 7], file=tmp_path / "s")
    found = sweep(problem, [7, 7, 7], file=tmp_path / "s")
    assert log() == [7, 7, 7]
    assert [outcome.resumed for outcome in found.outcomes] == [True, True, False]


def test_failed_cases_are_run_again(tmp_path):
    with pytest.warns(ConvergenceWarning):
        sweep(fussy, range(5), file=tmp_path / "s")
    with pytest.warns(ConvergenceWarning):
        found = sweep(fussy, range(5), file=tmp_path / "s")
    assert [outcome.resumed for outcome in found.outcomes] == [True, True, True, False, True]


def test_results_of_another_problem_are_left_alone(tmp_path):
    def power(exponent):
        return lambda x: x**exponent

    assert sweep(power(2), [3], file=tmp_path / "s").results == [9]
    assert sweep(power(3), [3], file=tmp_path / "s").results == [27]
    found = sweep(power(2), [3], file=tmp_path / "s")
    assert found.outcomes[0].resumed
    assert found.results == [9]


def test_solutions_in_the_file_belong_to_the_punch(tmp_path):
    """The file grows by pressures, not by matrices; ground and mesh may be made anew."""
    first = sweep(fresh_punch().solve, LOADS, file=tmp_path / "s")
    assert (tmp_path / "s").stat().st_size < 10_000 * len(LOADS)
    punch = fresh_punch()
    again = sweep(punch.solve, LOADS, file=tmp_path / "s")
    assert all(outcome.resumed for outcome in again.outcomes)
    assert all(solution.punch is punch for solution in again.results)
    for a, b in zip(first.results, again.results):
        assert np.array_equal(a.pressure, b.pressure)
    assert "matrix" not in punch.__dict__
    other = RigidPunch(HalfSpace(1.0, 0.3), punch.basis)
    assert not sweep(other.solve, LOADS[:1], file=tmp_path / "s").outcomes[0].resumed


def test_solutions_of_groups_belong_to_their_punches():
    """They bring no punches and no cells along, and have bounds, which solve the group again."""
    ground = GradedHalfSpace.init_linear(1.0, 0.3, 1.0)
    mesh = rectangle(1.0, 1.0, n=25)
    group = RigidPunches(
        [
            RigidPunch(
                ground, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x, 0)
            )
            for x in (0.0, 1.5)
        ]
    )
    loads = [{"force": 1.0}, {"force": 2.0}]
    here = group.solve(loads)
    assert len(pickled(here, group.solve)) < 1e4
    again, cases = (
        restored(pickled(found, problem), problem)
        for found, problem in (
            (here, group.solve),
            (group.solve_many({"one": loads}), group.solve_many),
        )
    )
    assert all(s.punch is punch for s, punch in zip(again.solutions, group.punches, strict=True))
    assert again[1].bounds.settlement == pytest.approx(here[1].bounds.settlement, rel=1e-12)
    assert all(c.footprint is p.footprint for c, p in zip(cases, group.punches, strict=True))


def test_a_killed_program_resumes(tmp_path):
    """Another process, with other hashes of strings, is killed while it writes results."""
    file = tmp_path / "s"
    code = (
        "import sys\n"
        f"sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
        "from test_sweep import slow_square\n"
        "from skfem_dual.sweeps.run import sweep\n"
        "cases = [dict(x=x, seconds=0.0) for x in range(100)]\n"
        "sweep(slow_square, [*cases, dict(x=100, seconds=1e5)], file=sys.argv[1])\n"
    )
    program = subprocess.Popen([sys.executable, "-c", code, file])
    while program.poll() is None and not (file.exists() and file.stat().st_size > 500):
        time.sleep(0.02)
    assert program.poll() is None
    program.kill()
    program.wait()
    found = sweep(slow_square, [dict(seconds=0.0, x=x) for x in range(4)], file=file)
    assert found.results == [0, 1, 4, 9]
    assert sum(outcome.resumed for outcome in found.outcomes) >= 3


@pytest.fixture(scope="module")
def four_records(tmp_path_factory):
    file = tmp_path_factory.mktemp("records") / "s"
    sweep(square, range(4), file=file)
    return file, file.read_bytes()


@settings(max_examples=30)
@given(data=st.data())
def test_a_torn_record_is_left_out(data, four_records):
    file, content = four_records
    size = len(content) // 4
    kept = data.draw(st.integers(0, len(content)))
    file.write_bytes(content[:kept])
    found = sweep(square, range(4), file=file)
    assert found.results == [0, 1, 4, 9]
    assert [outcome.resumed for outcome in found.outcomes] == [i < kept // size for i in range(4)]
    assert found.torn == kept % size
    # what was appended behind the torn record is found
    assert all(outcome.resumed for outcome in sweep(square, range(4), file=file).outcomes)


@settings(max_examples=30)
@given(data=st.data())
def test_damage_costs_one_record(data, four_records):
    file, content = four_records
    place = data.draw(st.integers(0, len(content) - 1))
    damaged = bytearray(content)
    damaged[place] ^= data.draw(st.integers(1, 255))
    file.write_bytes(damaged)
    found = sweep(square, range(4), file=file)
    assert found.results == [0, 1, 4, 9]
    assert sum(outcome.resumed for outcome in found.outcomes) == 3
    assert found.torn == len(content) // 4


def test_other_files_are_left_alone(tmp_path):
    file = tmp_path / "mesh.msh"
    file.write_text("$MeshFormat")
    with pytest.raises(ValueError, match="results of a sweep"):
        sweep(square, [1], file=file)
    assert file.read_text() == "$MeshFormat"
    with pytest.raises(FileNotFoundError):
        sweep(square, [1], file=tmp_path / "no folder" / "s")


def test_results_in_the_file_that_do_not_load(tmp_path, monkeypatch):
    sweep(partial(dict, number=Number(1)), [dict()], file=tmp_path / "s")
    monkeypatch.delattr(sys.modules[__name__], "Number")
    with pytest.raises(ValueError, match="cannot be loaded"):
        sweep(partial(dict, number=Number_(1)), [dict()], file=tmp_path / "s")


# --- content


@dataclass(frozen=True)
class Number:
    value: float
    notes: dict = field(default_factory=dict, init=False, compare=False)
    offset: float = field(default=0.0, init=False)

    @cached_property
    def root(self):
        return self.value**0.5


Number_ = Number


class Plain:
    def __init__(self, value):
        self.value = value

    @cached_property
    def root(self):
        return self.value**0.5


class Scaled:
    def __init__(self, function, factor):
        self.__wrapped__, self.factor = function, factor

    def __call__(self, x):
        return self.factor * self.__wrapped__(x)


class Slotted:
    __slots__ = ("value",)


class Named(dict):
    pass


class Listed(list):
    pass


class Gathered(set):
    pass


def having(value, /, **attributes):
    """The value, with attributes that no argument of its class tells."""
    for name, attribute in attributes.items():
        object.__setattr__(value, name, attribute)
    return value


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner),
    max_leaves=8,
)


@settings(max_examples=25)
@given(VALUES)
def test_content_survives_pickling(value):
    assert fingerprint(pickle.loads(pickle.dumps(value))) == fingerprint(value)


def test_content_of_a_structure_survives_use_and_pickling():
    """Plate elements make functions of text when they are used first, which do not pickle."""
    punch = Plate(0.3, 30e6, 0.2).on(HalfSpace(1.0, 0.3), DualMesh.from_mesh(disc(2)).basis())
    fresh = fingerprint(punch)
    assert punch.solve(column_load(punch.structure, (0.1, 0.0), 1.0)).success
    assert fingerprint(punch) == fresh
    assert fingerprint(pickle.loads(pickle.dumps(punch))) == fresh


@settings(max_examples=40)
@given(VALUES, VALUES)
def test_contents_differ_where_values_do(a, b):
    # repr tells 1 from True and 0.0 from -0.0, but also orders of dictionaries
    if a != b:
        assert fingerprint(a) != fingerprint(b)
    if repr(a) == repr(b):
        assert fingerprint(a) == fingerprint(b)


def scaled(factor):
    return lambda x: factor * x


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ({"a": 1.0}.get, {"a": 2.0}.get),
        (partial(map, {"a": 1.0}.get), partial(map, {"a": 2.0}.get)),
        ("{a} {b}".format, "{a}".format),
        (np.arange(3).item, np.arange(4).item),
    ],
)
def test_methods_of_other_data_are_other_contents(a, b):
    """Those of builtin types were told by their names, and found each other's results."""
    assert fingerprint(a) != fingerprint(b)
    assert fingerprint(np.sin) == fingerprint(np.sin)
    assert fingerprint(len) == fingerprint(len)


def test_an_executor_that_is_shut_down():
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.warns(ConvergenceWarning, match="2 of 2 cases failed.*or were shut down"):
        found = sweep(square, [1.0, 2.0], executor)
    assert not found.success


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (dict(a=1, b=2), dict(b=2, a=1)),
        ({"one", "two", "three"}, {"three", "two", "one"}),
        (np.float64(0.1), 0.1),
        (np.arange(6)[::2], np.array([0, 2, 4])),
        (np.array([1, "a"], dtype=object), np.array([1, "a"], dtype=object)),
        (scaled(2), scaled(2)),
        (partial(square, x=1), partial(square, x=1)),
        (partial(square, np.sin), partial(square, np.sin)),
        (re.compile("a"), re.compile("a")),
        (Path("a/b"), Path("a") / "b"),
        (np.random.default_rng(1), np.random.default_rng(1)),
        (having(Named(a=1, b=2), c=3), having(Named(b=2, a=1), c=3)),
        (Gathered({"one", "two", "three"}), Gathered({"three", "two", "one"})),
    ],
)
def test_equal_contents(a, b):
    assert fingerprint(a) == fingerprint(b)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (np.arange(6), np.arange(6.0)),
        (np.zeros((2, 3)), np.zeros((3, 2))),
        (scaled(2), scaled(3)),
        (lambda x: x + 1, lambda x: x + 2),
        (lambda x, y=1: x, lambda x, y=2: x),
        (partial(square, x=1), partial(square, x=2)),
        (Plain(1), Plain(2)),
        (Plain(1).__init__, Plain(2).__init__),
        (Number(1), Number(2)),
        (np.array([None, 1]), np.array([None, 2])),
        (np.random.default_rng(1), np.random.default_rng(2)),
        (sum, max),
        (np.sin, np.cos),
        (re.compile("a"), re.compile("b")),
        (re.compile("a"), re.compile("a", re.IGNORECASE)),
        (int, float),
        (np, os),
        (lru_cache(scaled(2)), lru_cache(scaled(3))),
        (numba.vectorize(scaled(2)), numba.vectorize(scaled(3))),
        (Scaled(square, 1), Scaled(square, 10)),
        (having(Number(1), offset=1.0), having(Number(1), offset=2.0)),
        (having(Number(1), unit="m"), having(Number(1), unit="mm")),
        (having(Slotted(), value=1), having(Slotted(), value=2)),
        (having(Named(a=1), unit="m"), having(Named(a=1), unit="mm")),
        (having(Listed([1]), unit="m"), having(Listed([1]), unit="mm")),
        (having(Gathered([1]), unit="m"), having(Gathered([1]), unit="mm")),
        (defaultdict(int, a=1), defaultdict(float, a=1)),
    ],
)
def test_different_contents(a, b):
    assert fingerprint(a) != fingerprint(b)


@pytest.mark.parametrize("kind", [Number, Plain])
def test_what_is_cached_is_no_content(kind):
    used = kind(2.0)
    assert used.root == 2.0**0.5
    if kind is Number:
        used.notes["found"] = "later"
    assert fingerprint(used) == fingerprint(kind(2.0))


def test_a_mesh_that_has_been_used_is_the_same():
    """It keeps facets, mapping and trees in attributes of its own."""
    used = disc(2)
    assert len(used.facets.T)
    assert len(used.mapping().A)
    assert used.element_finder()([0.0], [0.0])
    assert fingerprint(used) == fingerprint(disc(2))
    assert fingerprint(used) != fingerprint(used.with_boundaries({"all": lambda x: x[0] < 2}))


def test_a_punch_that_has_been_solved_is_the_same():
    punch = fresh_punch()
    before = fingerprint(punch.solve)
    solution = punch.solve(1.0)
    repr(solution)
    solution.pressure_at([[0.0], [0.0]])
    assert fingerprint(punch.solve) == before == fingerprint(fresh_punch().solve)
    assert fingerprint(fresh_punch(2).solve) != before


def test_compiled_functions_have_the_content_of_their_source():
    assert fingerprint(numba.njit(square)) == fingerprint(numba.njit(square))
    assert fingerprint(numba.njit(square)) != fingerprint(numba.njit(fussy))


def test_functions_of_numpy_that_have_no_name_are_refused():
    """All of them are called alike."""
    with pytest.raises(pickle.PicklingError, match="lambda"):
        fingerprint(np.frompyfunc(lambda x: x + 1, 1, 1))


def test_values_inside_themselves():
    loop = [1]
    loop.append(loop)
    other = [2]
    other.append(other)
    assert fingerprint(loop) == fingerprint(pickle.loads(pickle.dumps(loop)))
    assert fingerprint(loop) != fingerprint(other)


def test_what_has_no_content_is_refused_only_where_there_is_a_file(tmp_path):
    lock = threading.Lock()
    assert sweep(lambda x: (lock.locked(), x), [1]).results == [(False, 1)]
    with pytest.raises(TypeError, match="lock"):
        sweep(lambda x: (lock.locked(), x), [1], file=tmp_path / "s")
    assert not (tmp_path / "s").exists()


# --- threads and factors


def test_threads_inside_workers_are_limited(processes):
    assert sweep(limits, range(6), processes).results == [(1, 1, {1})] * 6
    # and outside the sweep they are not
    known, mask, _ = processes.submit(limits, 0).result()
    assert known == mask == numba.config.NUMBA_NUM_THREADS


def test_limits_hold_while_cases_overlap_and_are_lifted_at_the_end():
    """The first case to end must not lift the limits of the others, nor the last keep them."""
    before = limits(0)
    cases = [dict(x=x, seconds=0.01 + 0.02 * (x % 3)) for x in range(12)]
    seen = []

    def watch(x, seconds):
        seen.append(limits(0))
        time.sleep(seconds)
        seen.append(limits(0))

    with ThreadPoolExecutor(3) as pool:
        sweep(watch, cases, pool)
    assert seen == [(1, 1, {1})] * 24
    assert limits(0) == before


def test_limits_here_only_when_asked_for():
    before = limits(0)
    assert sweep(limits, [0]).results == [before]
    assert sweep(limits, [0], threads=1).results == [(1, 1, {1})]
    assert limits(0) == before


def test_own_workers_share_the_cores():
    assert module._threads(2, None) == max(1, workers.cores() // 2)
    assert module._threads(10_000, None) == 1
    assert module._threads(2, 3) == 3
    assert module._threads(None, None) is None


def test_a_worker_factorises_once(processes):
    punch = fresh_punch()
    found = sweep(punch.solve, LOADS, processes)
    assert_allclose(
        [solution.tilt[0] for solution in found.results],
        [punch.solve(**load).tilt[0] for load in LOADS],
        atol=1e-12,
    )
    assert all(solution.punch is punch for solution in found.results)
    # the clock of an assembly tells it from any other
    assemblies = {solution.timings["assembly"] for solution in found.results}
    assert len(assemblies) <= 2
    # a sweep after it, with the same punch made anew, finds the factors
    again = sweep(fresh_punch().solve, LOADS, processes)
    assert {solution.timings["assembly"] for solution in again.results} <= assemblies


def test_several_punches_are_kept_by_a_cache(processes):
    cases = [dict(poisson=nu, force=f) for nu in (0.2, 0.3) for f in (1.0, 2.0, 3.0, 4.0)]
    found = sweep(settle, cases, processes)
    assert len({assembly for _, assembly in found.results}) <= 4
    settlements = np.array([w for w, _ in found.results]).reshape(2, 4)
    assert_allclose(settlements / settlements[:, :1], [[1, 2, 3, 4]] * 2, rtol=1e-12)


# --- the surface


def test_progress(capsys):
    sweep(square, range(3))
    assert capsys.readouterr() == ("", "")
    sweep(square, range(3), progress=True)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "sweep" in shown.err
    assert "3/3" in shown.err


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((None, []), TypeError, "callable problem"),
        ((square, [], "threads"), TypeError, r"get_executor\(\)"),
        ((square, [], True), TypeError, "number of workers"),
        ((square, [], 0), ValueError, "executor from 1 to 10000, got 0"),
    ],
)
def test_wrong_arguments(arguments, error, message):
    with pytest.raises(error, match=message):
        sweep(*arguments)


def test_workers_as_an_integer_of_numpy(monkeypatch):
    monkeypatch.setattr(workers, "_started", lambda number, job: ThreadPoolExecutor(number))
    assert sweep(square, range(3), np.int64(2)).results == [0, 1, 4]


@pytest.mark.parametrize(
    ("file", "error", "message"),
    [
        ("", ValueError, "expected the path of a file for results of a sweep, got ''"),
        ("a\0b", ValueError, r"results of a sweep, got 'a\\x00b'"),
        (".", ValueError, "results of a sweep, got the folder .. Remedy: name a regular file"),
        ("missing/s", FileNotFoundError, "no such folder for results of a sweep: missing. Rem"),
        (b"s", TypeError, "results of a sweep, got bytes"),
    ],
)
def test_wrong_files(file, error, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=message):
        sweep(square, [1], file=file)
    assert not list(tmp_path.iterdir())


def test_wrong_threads():
    with pytest.raises(ValueError, match="threads from 1 to 10000, got 0"):
        sweep(square, [], threads=0)


def test_repr():
    lines = repr(sweep(square, range(3))).splitlines()
    assert lines[0] == "<skfem_dual SweepResult object>"
    assert lines[1].split() == ["Cases", "3,", "0", "of", "them", "from", "the", "file"]
    assert lines[2].split(maxsplit=1) == ["Result", "every case has its result"]
    assert lines[3].startswith("  Time [s]          sweep ")


def test_interrupts_in_compiled_code_end_a_sweep():
    """They come as the cause of a SystemError."""

    def problem(x):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    with pytest.raises(KeyboardInterrupt):
        sweep(problem, [1.0, 2.0])


class Model:
    """Called, or with a method that returns it."""

    def __init__(self, factor):
        self.factor, self.found = factor, None

    def __call__(self, x):
        return self.factor * x

    def fit(self, x):
        self.found = self.factor * x
        return self


def test_results_that_are_the_object_of_the_problem():
    """Each is what it was when its case was solved."""
    found = sweep(Model(2).fit, [1.0, 2.0, 3.0], executor=2)
    assert [result.found for result in found.results] == [2.0, 4.0, 6.0]


def test_keys_of_results_tell_what_problems_tell():
    rows = np.array([(1.0, 2.0)], dtype=[("force", float), ("e", float)])
    turned = np.array([(1.0, 2.0)], dtype=[("e", float), ("force", float)])
    for one, other in (
        (rows, turned),
        (rows[0], turned[0]),
        (np.float32(0.5), 0.5),
        (np.int8(100), 100),
        (np.datetime64(5, "ns"), 5),
        (lambda a: 1, lambda *a: 1),
        (lambda a, b=1: 1, lambda a, *, b=1: 1),
    ):
        assert fingerprint(one) != fingerprint(other)
    assert fingerprint(np.float64(0.5)) == fingerprint(0.5)
    assert fingerprint(np.int64(3)) == fingerprint(3)


def test_called_objects_are_told_by_their_code(tmp_path, monkeypatch):
    file = tmp_path / "s"
    assert sweep(Model(2), [1.0], file=file).results == [2.0]
    monkeypatch.setattr(Model, "__call__", lambda self, x: self.factor * x + 100)
    assert sweep(Model(2), [1.0], file=file).results == [102.0]


def test_classes_of_a_script_are_its_own_when_resumed(tmp_path):
    """Also if cloudpickle is there, which takes them along."""
    script = tmp_path / "script.py"
    script.write_text(
        "import enum\n"
        "from skfem_dual import sweep\n"
        "class Verdict(enum.Enum):\n"
        "    SAFE, UNSAFE = 1, 2\n"
        "def judge(e):\n"
        "    return Verdict.UNSAFE if e > 0.5 else Verdict.SAFE\n"
        "found = sweep(judge, [0.1, 0.9], file='s')\n"
        "resumed = [outcome.resumed for outcome in found.outcomes]\n"
        "print(resumed, [result is Verdict.UNSAFE for result in found.results])\n"
    )
    for resumed in False, True:
        ended = subprocess.run(
            [sys.executable, script.name], cwd=tmp_path, capture_output=True, text=True, check=True
        )
        assert ended.stdout == f"{[resumed] * 2} [False, True]\n"


def test_keys_of_what_has_none(tmp_path):
    """Fields of tables in another order, and objects called by what holds a lock."""
    table = np.array([(1.0, 2.0, 3.0)], dtype=[("E", float), ("nu", float), ("t", float)])
    rows = table[["nu", "E"]]
    assert fingerprint(rows) != fingerprint(table[["E", "nu"]])
    lock = threading.Lock()

    class Locked:
        def __call__(self, row):
            with lock:
                return float(row["nu"])

    found = sweep(Locked(), list(rows), ThreadPoolExecutor(1))
    assert found.results == [2.0]
    assert _called(Locked()) == b"" != _called(Model(1))
