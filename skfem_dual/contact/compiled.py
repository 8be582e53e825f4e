"""Compilation of the hot loops."""

import numba


def compiled(function):
    """``function`` compiled on first use, without Python's lock; kept on disk where possible."""
    try:
        return numba.njit(nogil=True, cache=True)(function)
    except RuntimeError:  # numba finds no folder to write to
        return numba.njit(nogil=True)(function)
