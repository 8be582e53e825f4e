"""Compilation of the hot loops."""

import numba
import numpy as np
from numpy import ndarray


def compiled(function):
    """``function`` compiled on first use, without Python's lock; kept on disk where possible."""
    try:
        return numba.njit(nogil=True, cache=True)(function)
    except RuntimeError:  # numba finds no folder to write to
        return numba.njit(nogil=True)(function)


def vectorised(function):
    """``function`` compiled as by `compiled`, with sums in the order the compiler prefers.

    The order is fixed once it is compiled: the same input gives the same bits. Divisions by zero
    give infinities.
    """
    options = {
        "nogil": True, "error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz", "arcp"}
    }  # fmt: skip
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # numba finds no folder to write to
        return numba.njit(**options)(function)


def inputs(*arrays: ndarray) -> tuple[ndarray, ...]:
    """Arrays that a kernel reads: contiguous and read-only, as it is compiled for every kind."""
    views = [np.ascontiguousarray(a)[...] for a in arrays]
    for view in views:
        view.flags.writeable = False
    return tuple(views)
