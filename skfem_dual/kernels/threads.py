"""Threads for loops that release Python's lock."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter
from typing import Self

import numba

#: pieces into which work is cut, whatever the number of threads: so sums do not depend on it
PIECES = 16
#: items of a piece are a multiple of the first, and not more than the second, or as many as last
#: for long enough: arrays for temporary use stay small
GRAIN, MOST = 64, 256
#: nanoseconds that a piece lasts at least, if there are items for it: to hand it to another thread
#: takes some twenty thousand
LEAST = 500_000
#: seconds of work after which other threads start: beside other work that takes milliseconds
LONG = 0.005
#: transforms of up to so many items take less than a millisecond
ALONE = 2**16


def threads_for(items: int, alone: int = ALONE) -> int:
    """Threads for work on so many items: one where it is shorter than starting others, for up to
    ``alone`` of them."""
    return int(numba.config.NUMBA_NUM_THREADS) if items > alone else 1


class Threads:
    """As a context, a function that calls ``work`` on slices of ``range(m)`` from threads.

    The slices depend on ``m`` alone, and on the third argument: how many nanoseconds an item takes
    about, by its size, where that may be little. Other threads start once the work has lasted some
    milliseconds. The first exception of ``work`` comes through.

    Examples
    --------
    >>> slices = []
    >>> with Threads() as run:
    ...     run(slices.append, 100)
    >>> sorted(slices, key=lambda piece: piece.start)
    [slice(0, 64, None), slice(64, 100, None)]
    """

    def __init__(self) -> None:
        self._pool: ThreadPoolExecutor | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def __call__(self, work: Callable[[slice], None], m: int, each: int = LEAST) -> None:
        even, least = (-(-k // GRAIN) * GRAIN for k in (-(-m // PIECES), LEAST // max(each, 1)))
        size = max(GRAIN, min(even, MOST), least)
        pieces = [slice(start, min(start + size, m)) for start in range(0, m, size)]
        threads = numba.config.NUMBA_NUM_THREADS
        begin, first = perf_counter(), 0
        while first < len(pieces) and (
            threads == 1 or (self._pool is None and perf_counter() - begin < LONG)
        ):
            work(pieces[first])
            first += 1
        if len(pieces) - first < 2:
            for piece in pieces[first:]:
                work(piece)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(threads - 1)
        _share(self._pool, threads - 1, work, pieces[first:])


def _share(
    pool: ThreadPoolExecutor, helpers: int, work: Callable[[slice], None], pieces: list[slice]
) -> None:
    """Work on pieces in this thread, and in so many of the pool as there are for it."""
    left = iter(pieces)  # of which each takes the next

    def help_out() -> None:
        try:
            for piece in left:
                work(piece)
        finally:
            deque(left, maxlen=0)  # an exception ends the work of all

    helping = []
    try:
        for _ in range(min(helpers, len(pieces) - 1)):
            helping.append(pool.submit(help_out))
    except RuntimeError:  # no threads start once the main script has ended
        pool.shutdown()  # when those there are have done what they took
    help_out()
    for helper in helping:
        helper.result()
