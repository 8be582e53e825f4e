"""What long work tells: progress bars where they are asked for, and the seconds it took."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from time import perf_counter
from typing import Protocol

_bars: ContextVar[bool] = ContextVar("progress bars", default=False)
_noted: ContextVar[float] = ContextVar("seconds of stages", default=0.0)


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


class Bar(Protocol):
    """What tells of progress."""

    def update(self, n: int = 1) -> object:
        """So many more are done."""

    def set_postfix_str(self, s: str) -> object:
        """What stands behind the bar."""


class _NoBar:
    """Tells nothing."""

    def update(self, n: int = 1) -> None:
        """Nothing."""

    def set_postfix_str(self, s: str) -> None:
        """Nothing."""


def progress_bar(
    shown: bool, desc: str, unit: str, total: int | None = None
) -> AbstractContextManager[Bar]:
    """A bar of tqdm, or none: those that tqdm does not show take its locks too, which forked
    processes share, and one that is killed never gives back."""
    if not shown:
        return nullcontext(_NoBar())
    from tqdm import tqdm

    return tqdm(total=total, desc=desc, unit=unit)


@contextmanager
def timed(timings: dict[str, float], what: str) -> Iterator[None]:
    """Note the seconds that a block takes, less those of stages inside."""
    seconds = Seconds()
    yield
    timings[what] = seconds()
    _noted.set(_noted.get() + timings[what])


class Seconds:
    """How many have passed since, less those that `timed` has noted: stages do not count twice,
    whichever of them is the first to ask for another."""

    def __init__(self) -> None:
        self._begin, self._noted = perf_counter(), _noted.get()

    def __call__(self) -> float:
        """So far."""
        return perf_counter() - self._begin - (_noted.get() - self._noted)
