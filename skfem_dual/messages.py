"""Values as they are shown in messages."""

import math
import reprlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy import ndarray

#: characters of an argument in a message
LONGEST = 160


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
    """
    return f"({x[0]:.10g}, {x[1]:.10g})"


def shown(value: Any) -> str:
    """An argument as text for messages.

    >>> shown("rim"), shown(float), shown(np.zeros(3)), shown(10**400)  # doctest: +ELLIPSIS
    ("'rim'", 'the class float', 'an array of float64 of shape (3,)', 'an integer of 400 digits')
    """
    text = _Shown().repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


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
