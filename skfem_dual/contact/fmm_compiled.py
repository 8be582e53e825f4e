"""Compilation of loops that a processor may run through several numbers at a time."""

import numba


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
