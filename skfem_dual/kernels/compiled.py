"""Compilation of the hot loops, and how they take their arrays.

Kernels take what belongs together as a `typing.NamedTuple` of arrays. They unpack it once, before
their loops: every time a tuple is handed on, all its arrays are counted, by all threads.

Short loops of a constant number of steps, up to some 32, are written out before they could be
vectorised: such loops run over the length of an array.
"""

import contextlib
from collections.abc import Callable

import numba
import numpy as np
from numba.core.event import Event, Listener, install_listener
from numpy import ndarray

from .disk import CheckedCache


def compiled(function: Callable) -> Callable:
    """``function`` compiled on first use, without Python's lock; kept on disk where possible."""
    return _njit(function)


def vectorised(function: Callable) -> Callable:
    """``function`` compiled as by `compiled`, with sums in the order the compiler prefers.

    The order is fixed once it is compiled: the same input gives the same bits. Divisions by zero
    give infinities.
    """
    return _njit(function, error_model="numpy", fastmath={"reassoc", "contract", "nsz", "arcp"})


def inlined(function: Callable) -> Callable:
    """``function`` as a part of every kernel that calls it, with that kernel's options.

    Where it has loops, arrays that it takes are counted at every call.
    """
    return numba.njit(inline="always")(function)


def inputs(*arrays: ndarray) -> tuple[ndarray, ...]:
    """Arrays that a kernel reads: contiguous and read-only, as it is compiled for every kind."""
    return tuple([_input(a) for a in arrays])


def _input(a: ndarray) -> ndarray:
    flags = a.flags
    if type(a) is ndarray and flags.c_contiguous and not flags.writeable:
        return a
    view = np.ascontiguousarray(a)[...]
    view.setflags(write=False)
    return view


def when_compiling(call: Callable[[], object]) -> contextlib.AbstractContextManager:
    """Call something once, when the first kernel is compiled that is not on disk."""
    return install_listener("numba:compile", _First(call))


class _First(Listener):
    def __init__(self, call: Callable[[], object]) -> None:
        self.calls = [call]

    def on_start(self, event: Event) -> None:
        while self.calls:
            self.calls.pop()()

    def on_end(self, event: Event) -> None:
        pass


def _njit(function: Callable, **options: object) -> Callable:
    dispatcher = numba.njit(nogil=True, **options)(function)
    if hasattr(dispatcher, "enable_caching"):  # not where numba is told not to compile
        with contextlib.suppress(RuntimeError):  # numba finds no folder to write to
            dispatcher._cache = CheckedCache(dispatcher)
    return dispatcher
