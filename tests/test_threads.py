"""One punch, many threads: the answers are those of one thread, bit by bit."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numba
import numpy as np
import pytest
from plans import disc
from scipy.spatial import cKDTree
from skfem.mapping import MappingAffine

from skfem_dual import DualMesh, HalfSpace, LayeredHalfSpace, Paraboloid, RigidPunch, RigidPunches
from skfem_dual.grids import outline
from skfem_dual.ground.layered import Layer
from skfem_dual.kernels import threads
from skfem_dual.kernels.threads import Threads
from skfem_dual.sweeps.run import sweep

SOIL = HalfSpace(1.0, 0.25)
THREADS = 8


def plain():
    return RigidPunch(SOIL, DualMesh.from_mesh(disc(3)).basis())


def symmetric():
    return RigidPunch(SOIL, DualMesh.from_mesh(disc(2)).basis(), symmetry="auto")


def layered():
    ground = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")
    return RigidPunch(ground, DualMesh.from_mesh(disc(2)).primal_basis())


def shaped():
    basis = DualMesh.from_mesh(disc(3)).basis()
    return RigidPunch(SOIL, basis, gap=Paraboloid(2.0))


def to_a_tolerance():
    return RigidPunch(SOIL, DualMesh.from_mesh(disc(3)).basis(), rtol=1e-5)


def pair():
    mesh = disc(2)
    return RigidPunches(
        [
            RigidPunch(
                SOIL, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x, 0.0)
            )
            for x in (-1.3, 1.3)
        ]
    )


LOADS = [
    dict(force=1.0, at=(0.1, 0.0)),
    dict(force=1.0, at=(0.3, 0.2), unilateral=False),
    dict(force=1.0, at=(0.5, 0.1), method="active-set"),
    dict(force=1.0, at=(0.5, 0.2), method="cg", gap_rtol=1e-6),
    dict(force=2.0, at=(0.6, 0.0)),
]
PUNCHES = {
    "plain": (plain, LOADS),
    "symmetric": (symmetric, LOADS),
    "layered": (layered, LOADS),
    "shaped": (shaped, [dict(load, force=0.3) for load in LOADS if "unilateral" not in load]),
    "to a tolerance": (to_a_tolerance, LOADS),
    "pair": (pair, [dict(loads=[{"force": 1.0}, {"force": 2.0, "at": (e, 0)}]) for e in (0, 0.6)]),
}


def bits(solution):
    parts = getattr(solution, "solutions", (solution,))
    assert all(part.success for part in parts)
    return [
        (part.pressure.tobytes(), part.settlement, part.tilt.tobytes(), part.gap.tobytes())
        for part in parts
    ]


def rounds_at_once(name, rounds):
    make, loads = PUNCHES[name]
    alone, punch = make(), make()
    serial = [bits(alone.solve(**load)) for load in loads]
    for number in range(rounds):
        if number % 25 == 24:  # what is computed once is asked for by all at a time
            punch = make()
        gate = Barrier(THREADS)

        def work(i, punch=punch, gate=gate, number=number):
            gate.wait(timeout=60)
            which = (i + number) % len(loads)
            return which, bits(punch.solve(**loads[which]))

        with ThreadPoolExecutor(THREADS) as pool:
            for which, found in pool.map(work, range(THREADS)):
                assert found == serial[which]


@pytest.mark.parametrize("name", PUNCHES)
def test_answers_do_not_depend_on_threads(name):
    rounds_at_once(name, 2)


@pytest.mark.slow
@pytest.mark.parametrize("name", PUNCHES)
def test_answers_do_not_depend_on_threads_in_500_rounds(name):
    rounds_at_once(name, 500)


def test_a_sweep_over_threads():
    punch = plain()
    loads = [dict(force=1.0, at=(e, 0.0)) for e in np.linspace(0, 0.6, 10)]
    with ThreadPoolExecutor(THREADS) as pool:
        found = sweep(plain().solve, loads, pool)
    for load, solution in zip(loads, found.results, strict=True):
        assert bits(solution) == bits(punch.solve(**load))


def test_solutions_are_shared():
    """What a solution computes when it is asked, and the grids below it."""
    solution = plain().solve(1.0, at=(0.6, 0.0))
    alone = plain().solve(1.0, at=(0.6, 0.0))
    x = np.array([[0.0, 0.4, 1.5], [0.0, 0.3, 0.1]])

    def ask(one):
        region = one.contact_region
        basis = one.punch.basis
        return [
            *map(np.ndarray.tobytes, (region.level, one.displacement(x), one.pressure_at(x))),
            region.area,
            one.nodal_pressure()[1].tobytes(),
            basis.doflocs.tobytes(),
            basis.dx.tobytes(),
            np.asarray(basis.basis[0][0]).tobytes(),
        ]

    gate = Barrier(THREADS)

    def work(_):
        gate.wait(timeout=60)
        return ask(solution)

    expected = ask(alone)
    with ThreadPoolExecutor(THREADS) as pool:
        assert all(found == expected for found in pool.map(work, range(THREADS)))


def test_mappings_are_filled_by_one_thread(monkeypatch):
    """A mapping of scikit-fem that others see half filled for a while, as they may."""
    fill = MappingAffine._init_Ab

    def slowly(mapping):
        mapping._A = np.full((2, 2, mapping.mesh.nelements), np.nan)
        mapping._b = np.full((2, mapping.mesh.nelements), np.nan)
        time.sleep(0.02)
        fill(mapping)

    monkeypatch.setattr(MappingAffine, "_init_Ab", slowly)
    solution = plain().solve(1.0, at=(0.6, 0.0))
    mesh, dual = disc(3), solution.punch.basis.dual
    gate = Barrier(THREADS)

    def work(number):
        gate.wait(timeout=60)
        basis = (dual.basis if number % 2 else dual.primal_basis)()
        return [
            basis.dx.sum(),
            solution.nodal_pressure()[0].dx.sum(),
            solution.contact_region.crossed(mesh).sum(),
        ]

    with ThreadPoolExecutor(THREADS) as pool:
        found = np.array(list(pool.map(work, range(THREADS))))
    area = dual.partition.areas.sum()
    assert np.allclose(found[:, :2], area, rtol=1e-12)
    assert np.ptp(found[:, 2]) == 0


class Closed(ThreadPoolExecutor):
    """A pool after so many tasks, as those of concurrent.futures are once the main script ends."""

    left = 0

    def submit(self, *work):
        if self.left == 0:
            raise RuntimeError("cannot schedule new futures after interpreter shutdown")
        self.left -= 1
        return super().submit(*work)


@pytest.mark.parametrize("left", [0, 1])
def test_work_that_outlives_the_main_script(monkeypatch, left):
    """In threads that it leaves, and in functions of atexit: all is done, each piece once."""
    monkeypatch.setattr(Closed, "left", left)
    monkeypatch.setattr(threads, "ThreadPoolExecutor", Closed)
    monkeypatch.setattr(threads, "LONG", 0.0)
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 4)
    done = []
    with Threads() as run:
        for _ in range(2):
            run(done.append, 1000)
    starts = sorted(piece.start for piece in done)
    assert starts == [start for start in range(0, 1000, 64) for _ in range(2)]


def test_errors_of_helping_threads_come_through(monkeypatch):
    """And end the work of the others."""
    monkeypatch.setattr(threads, "LONG", 0.0)
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    here, failed, done = threading.current_thread(), threading.Event(), []

    def work(piece):
        if threading.current_thread() is not here:
            failed.set()
            raise FloatingPointError(str(piece.start))
        assert failed.wait(timeout=10)
        time.sleep(0.005)
        done.append(piece)

    with Threads() as run, pytest.raises(FloatingPointError):
        run(work, 1000)
    assert len(done) < 15


def test_short_work_is_cut_into_few_pieces():
    """All items are in one piece each, in order; quick ones in fewer pieces."""
    for m in (0, 1, 64, 217, 5000):
        counts = []
        for each in (10**6, 2000, 1):
            slices = []
            with Threads() as run:
                run(slices.append, m, each)
            slices.sort(key=lambda piece: piece.start)
            items = [i for piece in slices for i in range(piece.start, piece.stop)]
            assert items == list(range(m))
            counts.append(len(slices))
        assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 1


def test_searches_in_trees_take_as_many_threads_as_are_allowed(monkeypatch):
    monkeypatch.setattr(outline, "ONE_BY_ONE", 0)
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 3)
    asked = []

    class Tree(cKDTree):
        def query(self, *args, workers=1, **options):
            asked.append(workers)
            return super().query(*args, workers=workers, **options)

    monkeypatch.setattr(outline, "cKDTree", Tree)
    ends = np.array([[0.0, 1.0], [0.0, 0.0]])
    for m in (10, outline.MANY + 1):
        x = np.stack([np.linspace(0, 1, m), np.linspace(1, 2, m)])
        assert outline.distance_to_segments(x, ends[:, :1], ends[:, 1:]) == pytest.approx(x[1])
    assert asked == [1, 1, 3, 3]
