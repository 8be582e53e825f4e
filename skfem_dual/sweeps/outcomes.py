"""What became of the cases of a sweep."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..messages import one_line


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one case.

    Attributes
    ----------
    number : int
        Place of the case in the list.
    case : object
        The case.
    result : object
        What the problem returned; None if it failed.
    error : str or None
        The traceback if it failed.
    seconds : float
        Time of the case in its worker; NaN if it failed.
    resumed : bool
        Whether the result comes from the file.
    """

    number: int
    case: Any
    result: Any = None
    error: str | None = None
    seconds: float = float("nan")
    resumed: bool = False


def _without_traceback(text: str) -> str:
    """What an error says in one line, by its traceback."""
    lines = text.splitlines()
    at = max((i for i, line in enumerate(lines) if line.startswith("  File ")), default=0)
    while at < len(lines) and lines[at].startswith("  "):
        at += 1
    return one_line(" ".join(lines[at:]), 200)


@dataclass(frozen=True, eq=False, repr=False)
class SweepResult:
    """What became of all cases, in their order.

    Attributes
    ----------
    outcomes : tuple of Outcome
        One for each case.
    torn : int
        Bytes of the file that are no whole record, because writing was interrupted; their cases
        have been run again.
    timings : dict of str to float
        Seconds of the sweep, and of all its cases in their workers.
    """

    outcomes: tuple[Outcome, ...]
    torn: int
    timings: dict[str, float]

    @property
    def results(self) -> list[Any]:
        """Results in the order of the cases; None where a case failed."""
        return [outcome.result for outcome in self.outcomes]

    @property
    def errors(self) -> dict[int, str]:
        """Tracebacks of the cases that failed, by their numbers."""
        return {o.number: o.error for o in self.outcomes if o.error is not None}

    @property
    def unsolved(self) -> dict[int, str]:
        """What results say, by the numbers of the cases, whose own ``success`` is not True."""
        return {o.number: _said(o.result) for o in self.outcomes if not _solved(o.result)}

    @property
    def success(self) -> bool:
        """Whether no case failed, and no result says that it is none: ``success`` of its own."""
        return not (self.errors or self.unsolved)

    @property
    def message(self) -> str:
        """How many cases failed or are not solved, and the first of them."""
        parts = [
            f"{len(found)} of {len(self.outcomes)} cases {what}, the first number "
            f"{next(iter(found))}: {_without_traceback(next(iter(found.values()))) or '-'}"
            for what, found in (("failed", self.errors), ("have success=False", self.unsolved))
            if found
        ]
        return "; ".join(parts) or "every case has its result"

    def __repr__(self) -> str:
        resumed = sum(outcome.resumed for outcome in self.outcomes)
        torn = f", {self.torn} torn bytes left out" if self.torn else ""
        rows = [
            ("Cases", f"{len(self.outcomes)}, {resumed} of them from the file{torn}"),
            ("Result", self.message),
            ("Time [s]", ", ".join(f"{k} {v:.3f}" for k, v in self.timings.items())),
        ]
        lines = [f"  {name:<18}{value}" for name, value in rows]
        return "\n".join(["<skfem_dual SweepResult object>", *lines])


def _solved(result: Any) -> bool:
    """Whether a result tells no failure; of several in one all must be found."""
    if isinstance(result, (tuple, list)):
        return all(map(_solved, result))
    success = getattr(result, "success", True)
    return not isinstance(success, (bool, np.bool_, np.ndarray)) or bool(np.all(success))


def _said(result: Any) -> str:
    """Its message, or that of the first in it without success."""
    if isinstance(result, (tuple, list)):
        return next((_said(part) for part in result if not _solved(part)), "")
    said = getattr(result, "message", "")
    if isinstance(said, str) and said:
        return said
    messages = getattr(result, "messages", ())
    if not isinstance(messages, (tuple, list)):
        return ""
    each = zip(messages, np.ravel(result.success))
    return next((str(text) for text, found in each if not found), "")
