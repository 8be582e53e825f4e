"""Threads for loops that release Python's lock."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numba

#: pieces into which work is cut, whatever the number of threads: so sums do not depend on it
PIECES = 16
#: items of a piece are a multiple of this
GRAIN = 64


def in_blocks(work: Callable[[slice], None], m: int) -> None:
    """Call ``work`` on slices of ``range(m)`` from threads; the kernels release the GIL."""
    threads = numba.config.NUMBA_NUM_THREADS
    size = max(128, min(256, -(-m // threads)))
    blocks = [slice(start, min(start + size, m)) for start in range(0, m, size)]
    if len(blocks) < 2:  # starting threads would take longer
        for block in blocks:
            work(block)
        return
    with ThreadPoolExecutor(threads) as pool:
        # list: wait for all, and let an exception through
        list(pool.map(work, blocks))


class Threads:
    """As a context, a function that calls ``work`` on slices of ``range(m)`` from threads.

    Examples
    --------
    >>> found = []
    >>> with Threads() as run:
    ...     run(found.append, 100)
    >>> found
    [slice(0, 64, None), slice(64, 100, None)]
    """

    def __enter__(self) -> Callable[[Callable[[slice], None], int], None]:
        self._pool: ThreadPoolExecutor | None = None
        return self._run

    def __exit__(self, *exception) -> None:
        if self._pool is not None:
            self._pool.shutdown()

    def _run(self, work: Callable[[slice], None], m: int) -> None:
        size = GRAIN * -(-m // (GRAIN * PIECES))
        pieces = [slice(start, min(start + size, m)) for start in range(0, m, max(size, 1))]
        threads = numba.config.NUMBA_NUM_THREADS
        if len(pieces) < 4 or threads == 1:  # handing them over would take longer
            for piece in pieces:
                work(piece)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(threads)
        # list: wait for all, and let an exception through
        list(self._pool.map(work, pieces))
