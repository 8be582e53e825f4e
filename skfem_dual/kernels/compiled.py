"""Compilation of the hot loops."""

import contextlib

import numba
import numpy as np
from numpy import ndarray

from .disk import CheckedCache


def compiled(function):
    """``function`` compiled on first use, without Python's lock; kept on disk where possible."""
    return _kept(function, numba.njit(nogil=True)(function))


def vectorised(function):
    """``function`` compiled as by `compiled`, with sums in the order the compiler prefers.

    The order is fixed once it is compiled: the same input gives the same bits. Divisions by zero
    give infinities.
    """
    options = {
        "nogil": True, "error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}
    }  # fmt: skip
    return _kept(function, numba.njit(**options)(function))


def inputs(*arrays: ndarray) -> tuple[ndarray, ...]:
    """Arrays that a kernel reads: contiguous and read-only, as it is compiled for every kind."""
    views = [np.ascontiguousarray(a)[...] for a in arrays]
    for view in views:
        view.flags.writeable = False
    return tuple(views)


def _kept(function, dispatcher):
    """The dispatcher of a function with a cache on disk."""
    if hasattr(dispatcher, "enable_caching"):  # not where numba is told not to compile
        with contextlib.suppress(RuntimeError):  # numba finds no folder to write to
            dispatcher._cache = CheckedCache(function)
    return dispatcher
