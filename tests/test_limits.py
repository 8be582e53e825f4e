"""Limits of threads of the whole process."""

import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from time import sleep

import numba
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from skfem_dual.kernels import limits
from skfem_dual.kernels.limits import SharedLimit, limited_threads, threads_for_matrix


def blas():
    return sorted(lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas")


def test_the_least_limit_holds_until_nobody_asks_for_one():
    applied = []
    limit = SharedLimit(applied.append)
    first, second, third = limit(3), limit(1), limit(2)
    first.__enter__()
    second.__enter__()
    third.__enter__()
    second.__exit__(None, None, None)
    first.__exit__(None, None, None)
    third.__exit__(None, None, None)
    assert applied == [3, 1, 2, None]


@pytest.mark.parametrize("what", ["blas", "all"])
def test_overlapping_calls_of_threads(what):
    """The first to end does not lift the limit of the other, and the last lifts all."""
    before = blas(), numba.config.NUMBA_NUM_THREADS
    inside, first_has_ended = threading.Barrier(2, timeout=10), threading.Event()

    def work(number):
        with limited_threads(1, what):
            inside.wait()
            if number:
                assert first_has_ended.wait(timeout=10)
            seen = set(blas())
        if not number:
            first_has_ended.set()
        return seen

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(work, range(2))) == [{1}, {1}]
    assert (blas(), numba.config.NUMBA_NUM_THREADS) == before


def test_limits_of_another_thread_that_never_lifts_them():
    """OpenBLAS obeys the thread that has limited it, and nobody else."""
    before = blas()
    forever = threadpool_limits(2, "blas")
    try:
        with ThreadPoolExecutor(1) as pool:

            def work():
                with limited_threads(1, "blas"):
                    return set(blas())

            assert pool.submit(work).result() == {1}
    finally:
        forever.restore_original_limits()
    assert blas() == before


def test_a_limit_that_another_may_lift_is_asked_for_again():
    """As many threads as BLAS has by itself need no limit, which takes longer than a small matrix;
    with two, one is asked for even where somebody has limited them to one by now."""
    before = blas()
    with threadpool_limits(2, "blas"):
        other = limited_threads(1, "blas")
        other.__enter__()
        with threads_for_matrix(200):
            other.__exit__(None, None, None)
            assert set(blas()) == {1}
    with threadpool_limits(1, "blas"), threads_for_matrix(200):
        assert set(blas()) == {1}
    assert blas() == before


def test_limits_after_the_main_script(monkeypatch):
    """Solving goes on in a thread that it leaves, and pools of threads take nothing any more."""
    closed = ThreadPoolExecutor(1)
    closed.shutdown()
    monkeypatch.setattr(limits._Blas, "holder", closed)
    with threadpool_limits(2, "blas"):
        before = blas()
        with limited_threads(1, "blas"):
            assert set(blas()) == {1}
        assert blas() == before


@pytest.mark.parametrize("which", [0, 1])
def test_interrupted_while_a_limit_is_set_or_lifted(which):
    """The next to ask sets what was interrupted."""
    applied = []

    def apply(threads):
        if len(applied) == which:
            applied.append("interrupted")
            raise KeyboardInterrupt
        applied.append(threads)

    limit = SharedLimit(apply)
    with pytest.raises(KeyboardInterrupt), limit(1):
        pass
    with limit(1):
        assert applied[-1] == 1
    assert applied[-1] is None


@pytest.mark.parametrize("which", [0, 1])
def test_interrupted_while_blas_is_limited(monkeypatch, which):
    """By another thread, which goes on: BLAS kept one thread for the rest of the process."""

    def interrupt():
        raise KeyboardInterrupt

    class Interrupted(ThreadPoolExecutor):
        calls = 0

        def submit(self, *work):
            future = super().submit(*work)
            if self.calls == which:
                future.result()
                future.result = interrupt
            self.calls += 1
            return future

    with threadpool_limits(2, "blas"), Interrupted(1) as holder:
        monkeypatch.setattr(limits._Blas, "holder", holder)
        with pytest.raises(KeyboardInterrupt), limited_threads(1, "blas"):
            pass
        assert set(blas()) == {2}
        with limited_threads(1, "blas"):
            assert set(blas()) == {1}
        assert set(blas()) == {2}


def in_forked_process(check):
    """Whether it holds there; not if it does not come to an end."""
    process = os.fork()
    if process == 0:
        signal.alarm(10)
        code = 1
        try:
            code = 0 if check() else 2
        finally:
            os._exit(code)
    return os.waitpid(process, 0)[1] == 0


def limited_to_one():
    with limited_threads(1):
        return set(blas()) == {1}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_limits_of_other_threads_end():
    """They have no threads in a forked process, which stayed limited for good."""
    asked, done = threading.Event(), threading.Event()

    def work():
        with limited_threads(1):
            asked.set()
            assert done.wait(timeout=30)

    with threadpool_limits(2, "blas"), ThreadPoolExecutor(1) as pool:
        other = pool.submit(work)
        assert asked.wait(timeout=10)
        assert set(blas()) == {1}
        assert in_forked_process(lambda: set(blas()) == {2} and limited_to_one())
        done.set()
        other.result()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_limits_of_the_thread_that_forks_go_on():
    with threadpool_limits(2, "blas"):
        limit = limited_threads(1)
        limit.__enter__()

        def lifted():
            kept = set(blas()) == {1}
            limit.__exit__(None, None, None)
            return kept and set(blas()) == {2}

        assert in_forked_process(lifted)
        limit.__exit__(None, None, None)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_while_another_thread_changes_limits(monkeypatch):
    """Locks that it held at that time were released by nobody."""
    changing = threading.Event()

    def apply(threads):
        changing.set()
        sleep(0.05)

    monkeypatch.setattr(limits._numba, "_apply", apply)
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(limited_to_one)
        assert changing.wait(timeout=10)
        assert in_forked_process(limited_to_one)
        assert other.result()
