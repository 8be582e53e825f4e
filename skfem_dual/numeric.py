"""Numbers and arrays of numbers out of what comes from outside, and what came if it is none.

Python, numpy and lists of both have many kinds of them: here is which count, within which limits
and of which shapes. `arguments` has the checks that functions call.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from .messages import apart, shown


def scalar(value: Any, protocol: str) -> Any:
    """``value`` if it may be turned into a plain number by ``protocol``, or a TypeError."""
    if isinstance(value, (np.generic, ndarray)):
        if value.ndim or value.dtype.kind not in ("iu" if protocol == "__index__" else "iuf"):
            raise TypeError
        return value.item()
    kind = type(value)
    if kind is bool or not (hasattr(kind, protocol) or hasattr(kind, "__index__")):
        raise TypeError
    return value


def require_within(
    name: str,
    number: float,
    above: float | None,
    at_least: float | None,
    below: float | None,
    at_most: float | None,
) -> None:
    """Refuse a number beyond a limit with a ValueError."""
    inside = (
        (above is None or number > above)
        and (at_least is None or number >= at_least)
        and (below is None or number < below)
        and (at_most is None or number <= at_most)
    )
    if inside:
        return
    if isinstance(number, int):
        got = shown(number)
    else:  # not as the limit that it misses by little
        got, *_ = apart(number, *(x for x in (above, at_least, below, at_most) if x is not None))
    if above == 0 and below is at_most is None:
        raise ValueError(f"expected a positive {name}, got {got}")
    if at_least is not None and at_most is not None:
        raise ValueError(f"expected {name} from {at_least:g} to {at_most:g}, got {got}")
    limits = (
        ("above", above),
        ("of at least", at_least),
        ("below", below),
        ("of at most", at_most),
    )
    texts = [f"{word} {limit:g}" for word, limit in limits if limit is not None]
    raise ValueError(f"expected {name} {' and '.join(texts)}, got {got}")


def require_unmasked(name: str, value: Any) -> None:
    """Refuse masked values, a number too, with a ValueError: numpy forgets that they are."""
    if np.ma.is_masked(value):
        raise ValueError(f"expected {name} without masked values, got some. Remedy: fill them")


def array_of(name: str, value: Any, kinds: str, wanted: str) -> ndarray:
    """``value`` as an array of the kinds of dtype given, empty lists as well."""
    try:
        array = np.asarray(value)
    except (TypeError, ValueError, OverflowError):  # lists of unequal lengths, and worse
        raise TypeError(
            f"expected {name} as an array of {wanted}, got {shown(value)}, of unequal parts"
        ) from None
    require_unmasked(name, value)
    # an empty list is an array of floats
    if array.dtype.kind not in kinds and (array.size or array.dtype.kind not in "iuf"):
        raise TypeError(f"expected {name} as an array of {wanted}, got {_unlike(value, array)}")
    return array


def _unlike(value: Any, array: ndarray) -> str:
    """What came instead of numbers; of lists the first item that is none."""
    if array.dtype.kind == "O" and array.ndim:
        for i, item in enumerate(array.ravel()):
            if not isinstance(item, (int, float, np.number)) or isinstance(item, bool):
                return f"{shown(item)} at {place_of(np.unravel_index(i, array.shape), '')}"
            if isinstance(item, int) and item.bit_length() > 63:
                return f"{shown(item)} at {place_of(np.unravel_index(i, array.shape), '')}"
    return shown(value)


def require_shape(
    name: str, array: ndarray, shape: tuple[int | str, ...], least: int, error: type[ValueError]
) -> None:
    """Refuse an array of another shape, or with too few items along its last axis."""
    sizes: dict[str, int] = {}
    fits = array.ndim == len(shape) or (shape[-1:] == ("...",) and array.ndim >= len(shape) - 1)
    fits = fits and all(
        size == "..." or got == (sizes.setdefault(size, got) if isinstance(size, str) else size)
        for size, got in zip(shape, array.shape)
    )
    if not fits:
        text = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
        turned = array.ndim == 2 == len(shape) and array.shape[1] == shape[0]
        remedy = ". Remedy: transpose it" if turned else ""
        raise error(f"expected {name} of shape ({text}), got {array.shape}{remedy}")
    if least and array.shape[-1] < least:
        raise error(f"expected {name} with at least {least} items, got {array.shape[-1]}")


def place_of(index: Sequence[Any], each: str) -> str:
    """Where in an array: the number of the item the last axis counts, or all indices."""
    if each and len(index):
        return f"{each} {int(index[-1])}"
    return f"index {', '.join(str(int(k)) for k in index) or '()'}"
