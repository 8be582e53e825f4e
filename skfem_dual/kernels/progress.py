"""What long work tells: progress bars where they are asked for, and the seconds it took."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from time import perf_counter

_bars: ContextVar[bool] = ContextVar("progress bars", default=False)


@contextmanager
def progress_bars(shown: bool) -> Iterator[None]:
    """Whether iterations inside the block show progress bars, also those that serve every load."""
    token = _bars.set(shown)
    try:
        yield
    finally:
        _bars.reset(token)


def bars_shown() -> bool:
    """Whether they are."""
    return _bars.get()


@contextmanager
def timed(timings: dict[str, float], what: str) -> Iterator[None]:
    """Note the seconds a block takes."""
    begin = perf_counter()
    yield
    timings[what] = perf_counter() - begin
