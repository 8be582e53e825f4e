"""Errors and warnings of the package."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple


class MeshError(ValueError):
    """A mesh or partition that cannot be used; names the first offenders and the remedy."""


class MeshWarning(UserWarning):
    """Input that was changed or left out on reading, or that looks wrong.

    Such as unused nodes of a mesh, an outline that is cleaned up, an origin off the plan or
    settlements that tell of mixed units.
    """


class ConvergenceError(RuntimeError):
    """A system of equations that could not be solved, with the likely cause."""


class ConvergenceWarning(UserWarning):
    """An answer that is returned with ``success=False``."""


class ResolutionWarning(UserWarning):
    """An answer that is returned, but may be less accurate than it looks or than was asked for.

    Mostly since cells are too coarse for the ground or for the contact.
    """


class Told(NamedTuple):
    """A warning and its kind."""

    message: str
    category: type[Warning]


#: whose lines are passed over: our own, and those through which dataclasses are replaced
PACKAGES = __name__.split(".")[0], "dataclasses"
_kept: ContextVar[list[Told] | None] = ContextVar("warnings kept", default=None)


def warn(message: str, category: type[Warning]) -> None:
    """Warn at the line that called the package, unless warnings are kept; see `warnings_kept`."""
    kept = _kept.get()
    if kept is None:
        frame, level = sys._getframe(), 1
        while frame.f_back and str(frame.f_globals.get("__name__")).split(".")[0] in PACKAGES:
            frame, level = frame.f_back, level + 1
        warnings.warn(message, category, stacklevel=level)
    else:
        kept.append(Told(message, category))


@contextmanager
def warnings_kept() -> Iterator[list[Told]]:
    """Keep what is warned of in the block, in this thread only.

    `warnings.catch_warnings` changes what all threads of the process see.
    """
    kept: list[Told] = []
    token = _kept.set(kept)
    try:
        yield kept
    finally:
        _kept.reset(token)
