"""Values as they are shown in messages."""

import math
import reprlib
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy import ndarray

#: characters of an argument in a message
LONGEST = 160
#: sizes of numbers that are written without a power of ten, and what is rounding beside them
SMALL, LARGE, NOISE = 1e-4, 1e9, 1e-7
#: decimals by which a column may have more than its largest number takes
MORE = 2


class _Shown(reprlib.Repr):
    """Arguments in messages: short, and never an error of their own."""

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() > 64:  # Python refuses to print thousands of digits
            return f"an integer of {round(x.bit_length() * math.log10(2))} digits"
        return repr(x)

    def repr_instance(self, x: Any, level: int) -> str:
        if isinstance(x, type):
            return f"the class {x.__name__}"
        if isinstance(x, ndarray):
            return f"an array of {x.dtype} of shape {x.shape}"
        if x is None or isinstance(x, (bool, complex, float, np.generic)):
            return repr(x)
        return type(x).__name__


def place(x: Sequence[float] | ndarray) -> str:
    """A point, with digits enough for site coordinates.

    >>> place((451204.8, 5411903.6))
    '(451204.8, 5411903.6)'
    >>> place((451206172.87, 5411901606.21))
    '(451206172.87, 5411901606.21)'
    """
    digits = 10 if max(abs(x[0]), abs(x[1])) < 1e8 else 13  # in mm
    return f"({x[0]:.{digits}g}, {x[1]:.{digits}g})"


def shown(value: Any) -> str:
    """An argument as text for messages.

    >>> shown("rim"), shown(float), shown(np.zeros(3)), shown(10**400)  # doctest: +ELLIPSIS
    ("'rim'", 'the class float', 'an array of float64 of shape (3,)', 'an integer of 400 digits')
    """
    text = _Shown().repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def shortened(text: str, most: int) -> str:
    """A name that is cut where it is too long: its end tells as much as its begin.

    >>> shortened("wind", 8), shortened("1.35 G + 1.5 Q + wind from west", 20)
    ('wind', '1.35 G + 1…from west')
    """
    if len(text) <= most:
        return text
    return f"{text[: most // 2]}…{text[len(text) - (most - most // 2 - 1) :]}"


def one_line(text: str, length: int) -> str:
    """``text`` in one line; where it is longer than ``length``, its middle is left out.

    The remedy at its end stays, with the place before it, or two thirds of the length of it.

    >>> one_line("expected this in a.csv, got that at (1, 2). Remedy: mend it", 50)
    'expected this ... that at (1, 2). Remedy: mend it'
    """
    text = " ".join(text.split())
    if len(text) <= length:
        return text
    remedy, most = text.rfind("Remed"), 2 * length // 3
    if remedy < 0:
        tail = text[-(length // 3) :]
    elif len(text) - remedy > most:
        tail = f"{text[remedy:][: most - 4]} ..."
    else:
        tail = text[-most:]
        tail = tail[max(tail.find(" ", 0, tail.find("Remed")), 0) :]  # whole words
    return f"{text[: length - len(tail) - 5].rstrip()} ... {tail.lstrip()}"


def without_remedy(message: object) -> str:
    """A message, or that of an error, where another remedy follows.

    >>> without_remedy(ValueError("expected this, got that. Remedy: mend it"))
    'expected this, got that'
    """
    return str(message).partition(". Remedy")[0]


def listed(words: Sequence[str]) -> str:
    """Words in a row.

    >>> listed(["largest pressure"]), listed(["tilt", "contact"]), listed(["a", "b", "c"])
    ('largest pressure', 'tilt and contact', 'a, b and c')
    """
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def decimals_of(values: Iterable[float], digits: int) -> int | None:
    """With how many decimals numbers stand in one column, so that the largest has its digits and
    the others, but those that are rounding, have two.

    None if that takes many more decimals, or the largest is very large or small.

    >>> decimals_of([11.3749, 9.5, 0.0, 1e-9], 5), decimals_of([1200.0, 900.0], 5)
    (3, 0)
    >>> decimals_of([379.02, 49.01, 0.3519], 4), decimals_of([379.02, 0.003519], 4)
    (2, None)
    """
    sizes = [abs(value) for value in values if np.isfinite(value) and value]
    if not sizes or not SMALL <= max(sizes) < LARGE:
        return None
    least = min(size for size in sizes if size > NOISE * max(sizes))
    decimals, two = (
        max(k - 1 - int(f"{size:.{k - 1}e}".partition("e")[2]), 0)
        for k, size in ((digits, max(sizes)), (2, least))
    )
    if two > decimals + MORE:
        return None
    decimals = max(decimals, two)
    texts = [f"{size:.{decimals}f}" for size in sizes]
    ends = min(len(text) - len(text.rstrip("0")) for text in texts)
    return max(decimals - ends, 0)


def apart(*numbers: float) -> tuple[str, ...]:
    """Numbers as text with six digits, or with as many as tell those apart that differ.

    >>> apart(0.5, 0.25), apart(0.5, 0.50000001)
    (('0.5', '0.25'), ('0.5', '0.50000001'))
    """
    for digits in range(6, 17):
        texts = tuple(f"{number:.{digits}g}" for number in numbers)
        if len(set(texts)) == len(set(numbers)):
            return texts
    return tuple(f"{number:.17g}" for number in numbers)
