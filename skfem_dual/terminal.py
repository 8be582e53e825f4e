"""What the command line takes from a terminal and gives to it."""

import argparse
import contextlib
import os
import re
import sys
from typing import Any, NoReturn

from .arguments import LARGEST, SMALLEST
from .io.tables import written_number
from .messages import one_line

#: an error or a warning takes one line of so many characters
LINE = 300


def number(text: str) -> float:
    """A number of the command line."""
    try:
        value = written_number(text)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"expected a number, got {one_line(repr(text), 40)}"
        ) from None
    shown = one_line(repr(text), 40)
    if not (value == 0 or SMALLEST <= abs(value) <= LARGEST):
        raise argparse.ArgumentTypeError(
            f"expected a finite number, 0 or from {SMALLEST:g} to {LARGEST:g} in size, got {shown}"
        )
    return value


def as_typed(text: str) -> str:
    """An argument with the bytes Python was told are no characters, taken as UTF-8."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


class _Once(argparse.Action):
    """An option with a value that is refused the second time: only the last would count."""

    def __call__(
        self, parser: argparse.ArgumentParser, found: Any, value: Any, name: str | None = None
    ) -> None:
        first = getattr(found, self.dest)
        if self.option_strings and first is not self.default:
            shown = one_line(f"{first} and {value}", 80)
            remedy = "all behind one" if self.nargs in ("+", "*") else "one of them"
            raise argparse.ArgumentError(self, f"expected once, got {shown}. Remedy: {remedy}")
        setattr(found, self.dest, value)


class Parser(argparse.ArgumentParser):
    """A parser whose errors take one line, whose numbers may read ``-1e6`` and whose options with
    a value are given once."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        for action in None, "store":
            self.register("action", action, _Once)
        # before Python 3.14 argparse takes -1e6 for an option
        self._negative_number_matcher = re.compile(r"^-(\.?\d|inf|nan)", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        if message.startswith("unrecognized arguments: ") and " -" not in message:
            message += (
                ". Remedy: quotes around words that belong together; all footings of solve side "
                "by side, options before or behind them; one mesh for check and dual"
            )
        self.exit(2, one_line(f"{self.prog}: error: {message} (see --help)", LINE) + "\n")


def print_table(table: str) -> None:
    """To stdout, unless it is closed or its reader has left."""
    if sys.stdout is None:
        return
    try:
        try:
            print(table, flush=True)
        except UnicodeEncodeError:  # the name of a file in a terminal that lacks its letters
            encoding = sys.stdout.encoding
            print(table.encode(encoding, "backslashreplace").decode(encoding), flush=True)
    except OSError as error:
        # what is left in the buffer would fail again at the end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):  # such as a full disk
            raise


def tell(text: str) -> None:
    """One line to stderr, unless it is closed."""
    if sys.stderr is not None:
        with contextlib.suppress(OSError):
            print(one_line(f"skfem-dual: {text}", LINE), file=sys.stderr)


def is_watched() -> bool:
    """Whether somebody looks at stderr, where progress is shown."""
    return sys.stderr is not None and sys.stderr.isatty()
