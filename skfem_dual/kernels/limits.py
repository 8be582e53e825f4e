"""Limits of threads that belong to the whole process, asked for by any number of its threads.

Those of OpenBLAS and of numba's set-up are one for all threads: where calls overlap, the first
to end would lift the limits of the others, and the last would restore what it has found, the limit
of another. Here the least limit asked for holds until nobody asks for one.
"""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from typing import Literal

import numba
import threadpoolctl
from threadpoolctl import ThreadpoolController

#: rows of a matrix that BLAS itself leaves to one thread, and whose factors take some milliseconds
TINY, SMALL = 96, 640


class SharedLimit:
    """A limit that several threads ask for, in contexts; ``apply`` sets it, None lifts it."""

    def __init__(self, apply: Callable[[int | None], None]) -> None:
        self._apply = apply
        self._wanted: dict[object, tuple[int, int]] = {}  # by calls: limit, and of which thread
        self._applied: object = None
        self._lock = threading.Lock()

    @contextmanager
    def __call__(self, threads: int) -> Iterator[None]:
        call = object()
        try:
            with self._lock:
                self._wanted[call] = threads, threading.get_ident()
                self._change()
            yield
        finally:
            self._wanted.pop(call, None)  # first, and in one step: interrupts may come anywhere
            with self._lock:
                self._change()

    def _change(self) -> None:
        least = min((threads for threads, _ in list(self._wanted.values())), default=None)
        if least != self._applied:
            self._applied = "unknown"  # for the next to set, if this is interrupted
            self._apply(least)
            self._applied = least

    def watch_forks(self) -> None:
        """In forked processes, end what was asked for by threads that they do not have."""
        # no thread is about to change the limit meanwhile
        os.register_at_fork(
            before=self._lock.acquire,
            after_in_parent=self._lock.release,
            after_in_child=self._end_others,
        )

    def _end_others(self) -> None:
        here = threading.get_ident()
        try:
            self._wanted = {call: each for call, each in self._wanted.items() if each[1] == here}
            self._change()
        finally:
            self._lock.release()


class _Blas:
    """The libraries found, and the thread that holds their limit."""

    modules = 0
    libraries: ThreadpoolController
    held: ExitStack | None = None
    holder: ThreadPoolExecutor | None = None


def _limit_blas(threads: int | None) -> None:
    # threadpoolctl lets only the thread that has limited OpenBLAS change that, and with the
    # others nothing happens: one of our own may end before the limit does. One of its own, kept
    # as starting it takes longer than all else
    if _Blas.holder is None:
        _Blas.holder = ThreadPoolExecutor(1)
    try:
        holding = _Blas.holder.submit(_hold_blas, threads)
    except RuntimeError:  # its thread has ended with the main script
        _hold_blas(threads)
    else:
        holding.result()


def _hold_blas(threads: int | None) -> None:
    openblas = getattr(threadpoolctl, "OpenBLASController", None)
    if clear := getattr(openblas, "clear_controlling_thread", None):  # recent versions
        clear(force=True)  # whoever has limited it for good, or forked while it was limited
    if _Blas.held is not None:
        _Blas.held.close()
        _Blas.held = None
    if threads is not None:
        # kept here, as who asked may be interrupted while waiting
        _Blas.held = ExitStack()
        _Blas.held.enter_context(_libraries().limit(limits=threads, user_api="blas"))


def _libraries() -> ThreadpoolController:
    if _Blas.modules != len(sys.modules):  # an import may have brought a library
        _Blas.modules, _Blas.libraries = len(sys.modules), ThreadpoolController()
    return _Blas.libraries


def _forget() -> None:
    """A forked process has no thread that holds limits."""
    _Blas.holder = None


def _limit_numba(threads: int | None, known: int = numba.config.NUMBA_NUM_THREADS) -> None:
    numba.config.NUMBA_NUM_THREADS = known if threads is None else min(threads, known)


_blas, _numba = SharedLimit(_limit_blas), SharedLimit(_limit_numba)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
    _blas.watch_forks()
    _numba.watch_forks()


@contextmanager
def limited_threads(threads: int, what: Literal["blas", "all"] = "all") -> Iterator[None]:
    """At most so many threads of BLAS, or of BLAS, OpenMP and numba, for what is called inside.

    Other threads of the process may be limited as well while it lasts.
    """
    with ExitStack() as stack:
        if what == "all":
            # of this thread; the first call starts those of numba, in full number
            mask = numba.get_num_threads()
            stack.callback(numba.set_num_threads, mask)
            numba.set_num_threads(min(threads, mask))
            stack.enter_context(_numba(threads))
        stack.enter_context(_blas(threads))
        # of libraries that have a limit for each thread
        api = "blas" if what == "blas" else None
        stack.enter_context(_Blas.libraries.limit(limits=threads, user_api=api))
        yield


def threads_for_matrix(n: int) -> AbstractContextManager[None]:
    """One thread of BLAS inside for a matrix with up to `SMALL` rows, whose factors take
    milliseconds: threads that wait for others beside other work take many times as long."""
    return limited_threads(1, "blas") if TINY < n <= SMALL and not _alone() else nullcontext()


def _alone() -> bool:
    """Whether BLAS has one thread, without a limit that someone may lift."""
    found = _libraries().lib_controllers
    return _Blas.held is None and all(
        lib.num_threads == 1 for lib in found if lib.user_api == "blas"
    )
