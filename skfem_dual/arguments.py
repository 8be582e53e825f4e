"""What public functions ask of their arguments, with errors that say what to change.

Each check answers the argument as a plain value: a float, an int, a C-contiguous array in native
byte order. Messages name the argument, what was expected and what came.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, TypeVar

import numpy as np
from numpy import ndarray

from .messages import shown
from .numeric import array_of, place_of, require_shape, require_unmasked, require_within, scalar

Pair = tuple[float, float]
#: sizes beyond these powers of ten are refused: products of three of them must remain numbers
LARGEST, SMALLEST = 1e100, 1e-100
#: of circles and outlines farther away than so many of their sizes numbers have no four digits
FARTHEST = 1e12

_T = TypeVar("_T")


def checked_number(
    name: str,
    value: Any,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> float:
    """``value`` as a finite number within its limits.

    Parameters
    ----------
    name : str
        The argument, for messages.
    value : real number
        Of Python or numpy; no bool, no text, no array of one dimension or more.
    above, at_least, below, at_most : float, optional
        Limits without and with the limit itself. ``above=0`` refuses denormal numbers too, by
        which nothing can be divided.

    Raises
    ------
    TypeError
        If it is no real number.
    ValueError
        If it is not finite, or beyond a limit.

    Examples
    --------
    >>> checked_number("poisson", np.float32(0.25), at_least=0, at_most=0.5)
    0.25
    >>> checked_number("poisson", 0.7, at_least=0, at_most=0.5)
    Traceback (most recent call last):
    ValueError: expected poisson from 0 to 0.5, got 0.7
    """
    require_unmasked(name, value)
    try:
        number = float(scalar(value, "__float__"))
    except (TypeError, ValueError):
        raise TypeError(f"expected a number for {name}, got {shown(value)}") from None
    except OverflowError:
        raise ValueError(f"expected a finite {name}, got {shown(value)}") from None
    if not math.isfinite(number):
        raise ValueError(f"expected a finite {name}, got {number}")
    require_within(name, number, above, at_least, below, at_most)
    if above == 0 and number < np.finfo(float).tiny:
        raise ValueError(f"expected {name} of at least {np.finfo(float).tiny:.3g}, got {number!r}")
    return number


def checked_size(name: str, value: Any) -> float:
    """``value`` as a positive length, modulus or other size, from 1e-100 to 1e100.

    Errors as `checked_number`.
    """
    number = checked_number(name, value, above=0)
    if not SMALLEST <= number <= LARGEST:
        raise ValueError(
            f"expected {name} from {SMALLEST:g} to {LARGEST:g}, got {number:g}. "
            "Remedy: choose units in which sizes are near 1"
        )
    return number


def checked_integer(
    name: str, value: Any, *, at_least: int | None = None, at_most: int | None = None
) -> int:
    """``value`` as an integer within its limits, which it may equal.

    Raises
    ------
    TypeError
        If it is no integer; 3.0 is none.
    ValueError
        If it is beyond a limit.
    """
    require_unmasked(name, value)
    try:
        number = int(scalar(value, "__index__"))
    except (TypeError, ValueError):
        raise TypeError(f"expected an integer for {name}, got {shown(value)}") from None
    require_within(name, number, None, at_least, None, at_most)
    return number


def checked_pair(name: str, value: Any) -> Pair:
    """``value`` as two finite numbers; errors as `checked_number`."""
    try:
        if isinstance(value, (str, bytes, set, frozenset, dict)):  # their items are no numbers
            raise TypeError
        x, y = value
    except (TypeError, ValueError):
        raise TypeError(f"expected two numbers for {name}, got {shown(value)}") from None
    return checked_number(f"{name}[0]", x), checked_number(f"{name}[1]", y)


def checked_place(name: str, value: Any) -> Pair:
    """``value`` as two coordinates up to 1e100 in size; errors as `checked_number`."""
    x, y = checked_pair(name, value)
    if max(abs(x), abs(y)) > LARGEST:
        raise ValueError(f"expected coordinates of {name} up to {LARGEST:g}, got ({x:g}, {y:g})")
    return x, y


def checked_circle(centre: Any, radius: Any) -> tuple[Pair, float]:
    """Centre and radius of a circle whose points differ from each other.

    Raises
    ------
    TypeError, ValueError
        If the radius is not positive, or the centre more than 1e12 radii from the origin.
    """
    (x, y), radius = checked_place("centre", centre), checked_size("radius", radius)
    if max(abs(x), abs(y)) > FARTHEST * radius:
        raise ValueError(
            f"expected centre up to {FARTHEST:g} radii from the origin, got ({x:g}, {y:g}) with a "
            f"radius of {radius:g}: the numbers do not tell its points apart. Remedy: an origin "
            "nearby"
        )
    return (x, y), radius


def checked_array(
    name: str,
    value: Any,
    shape: tuple[int | str, ...] | None,
    *,
    least: int = 0,
    each: str = "",
    error: type[ValueError] = ValueError,
    order: Literal["C", "K"] = "C",
) -> ndarray:
    """``value`` as finite numbers in an array.

    Parameters
    ----------
    name : str
        The argument, for messages.
    value : array_like of real numbers
        Also nested lists and tuples, in any byte order.
    shape : tuple of int or str, or None
        Sizes; those with a name are free, but equal where the name is. None: any shape; "..."
        in the end: any more.
    least : int
        The least size along the last axis.
    each : str
        What the last axis counts, such as "cell".
    error : type
        Raised instead of a ValueError, such as `MeshError`.
    order : {"C", "K"}
        The layout: row after row, or as it comes.

    Returns
    -------
    ndarray of float
        In native byte order, C-contiguous unless ``order`` is "K"; the argument itself if it is
        such an array.

    Raises
    ------
    TypeError
        If something is not a real number.
    ValueError
        If it has another shape, or something is not finite: the first place is named.

    Examples
    --------
    >>> checked_array("points", [[0, 1, 2], [0, 0, 1]], (2, "n"))
    array([[0., 1., 2.], [0., 0., 1.]])
    >>> checked_array("pressure", [1.0, np.inf], (2,), each="cell")
    Traceback (most recent call last):
    ValueError: expected finite pressure, got inf at cell 1
    """
    array = array_of(name, value, "iuf", "numbers")
    if shape is not None:
        require_shape(name, array, shape, least, error)
    with np.errstate(over="ignore"):  # of long doubles, found below
        array = np.asarray(array, dtype=float, order=order)
    if not np.isfinite(array).all():
        i = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise error(f"expected finite {name}, got {float(array[i])} at {place_of(i, each)}")
    return array


def checked_points(
    name: str, value: Any, dim: int = 2, *, least: int = 0, error: type[ValueError] = ValueError
) -> ndarray:
    """``value`` as coordinates of shape (dim, n); errors as `checked_array`."""
    return checked_array(name, value, (dim, "n"), least=least, each="point", error=error)


def checked_indices(
    name: str,
    value: Any,
    size: int,
    shape: tuple[int | str, ...] = ("n",),
    *,
    least: int = 0,
    each: str = "",
    error: type[ValueError] = ValueError,
) -> ndarray:
    """``value`` as indices from ``least``, 0 or -1, to ``size - 1`` in an array of `numpy.intp`.

    Raises
    ------
    TypeError
        If something is not an integer.
    ValueError
        If it has another shape, or an index is out of range: the first place is named.
    """
    array = array_of(name, value, "iu", "integers")
    require_shape(name, array, shape, 0, error)
    if ((array < least) | (array >= size)).any():
        i = tuple(int(k) for k in np.argwhere((array < least) | (array >= size))[0])
        allowed = f"from {least} to {size - 1}" if size else "of nothing"
        raise error(f"expected {name} {allowed}, got {array[i]} at {place_of(i, each)}")
    return np.asarray(array, dtype=np.intp, order="C")


def called(name: str, function: Callable[[ndarray], Any], x: ndarray) -> Any:
    """What a function returns at all points ``x``.

    Raises
    ------
    ValueError
        If it compares arrays as if they were single numbers.
    """
    try:
        return function(x)
    except ValueError as error:
        if "truth value of an array" not in str(error):
            raise
        raise ValueError(
            f"expected a function of an array of all points for {name}, got one that compares it "
            "as a single number. Remedy: np.where for cases"
        ) from error


def checked_mask(
    name: str, value: Any, shape: tuple[int, ...], *, error: type[ValueError] = ValueError
) -> ndarray:
    """``value`` as booleans of the shape given; errors as `checked_array`."""
    array = array_of(name, value, "b", "booleans")
    require_shape(name, array, shape, 0, error)
    return np.asarray(array, dtype=bool, order="C")


def checked_text(name: str, value: Any) -> str:
    """``value`` itself, if it is text, or a TypeError."""
    if not isinstance(value, str):
        raise TypeError(f"expected text for {name}, got {shown(value)}")
    return value


def checked_sequence(name: str, value: Any) -> list:
    """The items of ``value``, or a TypeError if it is text, a mapping or not iterable."""
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        raise TypeError(f"expected a sequence for {name}, got {shown(value)}")
    try:
        return list(value)
    except TypeError:  # arrays without dimensions
        raise TypeError(f"expected a sequence for {name}, got {shown(value)}") from None


def place_among(names: Sequence[str], what: str, key: Any) -> Any:
    """The number of what is asked for by its name; others than names as they are.

    Raises
    ------
    KeyError, IndexError
        If there is none of this name or number.
    """
    if isinstance(key, str):
        if key not in names:
            raise KeyError(f"expected the name of a {what}, {list(names)}, got {key!r}")
        return names.index(key)
    if isinstance(key, (int, np.integer)) and not -len(names) <= key < len(names):
        raise IndexError(f"expected a {what} from 0 to {len(names) - 1}, got {key}")
    return key


def checked_flag(name: str, value: Any) -> bool:
    """``value`` as True or False, or a TypeError; 0 and 1 will do."""
    if isinstance(value, (bool, np.bool_)) or (
        isinstance(value, (int, np.integer)) and value in (0, 1)
    ):
        return bool(value)
    raise TypeError(f"expected True or False for {name}, got {shown(value)}")


def checked_instance(name: str, value: _T, kinds: type | tuple[type, ...], remedy: str = "") -> _T:
    """``value`` itself, if it is an object of one of ``kinds``.

    Raises
    ------
    TypeError
        If it is something else; of a class instead of an object of it that is said.

    Examples
    --------
    >>> checked_instance("mesh", dict, dict)
    Traceback (most recent call last):
    TypeError: expected a dict for mesh, got the class dict. Remedy: make an object of it
    """
    if isinstance(value, kinds):
        return value
    kinds = kinds if isinstance(kinds, tuple) else (kinds,)
    names = " or ".join(kind.__name__ for kind in kinds)
    if not remedy and isinstance(value, type) and issubclass(value, kinds):
        remedy = "make an object of it"
    article = "an" if names[0] in "AEIOaeio" else "a"
    remedy = remedy and f". Remedy: {remedy}"
    raise TypeError(f"expected {article} {names} for {name}, got {shown(value)}{remedy}")


def checked_choice(name: str, value: Any, choices: Iterable[str]) -> str:
    """``value`` itself, if it is one of some words.

    Raises
    ------
    TypeError
        If it is no text.
    ValueError
        If it is another word.

    Examples
    --------
    >>> checked_choice("grid", "both", ("dual", "primal"))
    Traceback (most recent call last):
    ValueError: expected grid "dual" or "primal", got 'both'
    """
    *rest, last = (f'"{choice}"' for choice in choices)
    words = f"{', '.join(rest)} or {last}" if rest else last
    if not isinstance(value, str):
        raise TypeError(f"expected {name} {words}, got {shown(value)}")
    if f'"{value}"' not in (*rest, last):
        raise ValueError(f"expected {name} {words}, got {shown(value)}")
    return value
