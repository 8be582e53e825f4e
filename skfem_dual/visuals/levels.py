"""Numbers of a picture: levels of isobars, colour range, short labels."""

from collections.abc import Sequence

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_array, checked_integer, checked_pair
from .field import Field

#: more isobars than this are a mistake
MOST = 1000
#: numbers closer to the end of a scalar bar, in parts of it, make room for what is told there
CLOSE = 0.04
#: values that differ by less of the largest are constant but for rounding
ROUNDING = 1e-9


def quantiles(field: Field, fractions: Sequence[float] | ndarray) -> ndarray:
    """Values below which the field stays on the given fractions of the area.

    Triangles on which a field is constant do not count, nor does a minimum of piecewise
    constants: the separated part of a contact says nothing about the rest.
    """
    negligible = 1e-9 * np.ptp(field.values)
    if field.flat:
        samples, varying = field.values[None], field.values - field.values.min() > negligible
    else:  # a linear function has these means on the quarters of a triangle
        corners = field.values[field.t]
        samples = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6 @ corners
        varying = np.ptp(corners, axis=0) > negligible
    if not varying.any():
        return np.full(np.shape(fractions), field.values.min())
    samples, area = samples[:, varying], field.areas[varying]
    order = np.argsort(samples, axis=None)
    area = np.tile(area, len(samples))[order]
    share = (np.cumsum(area) - area / 2) / area.sum()
    ends = field.values.min(), field.values.max()
    return np.interp(fractions, [0, *share, 1], [ends[0], *samples.ravel()[order], ends[1]])


def roundest(low: float, high: float) -> float:
    """The roundest number between two: a multiple of the greatest possible 1, 2 or 5 times 10^k.

    >>> roundest(1.43, 1.58), roundest(-270.0, -130.0), roundest(0.622, 0.711)
    (1.5, -200.0, 0.7)
    """
    exponent = int(np.floor(np.log10(max(abs(low), abs(high))))) + 1
    while True:
        for step in (10, 5, 2):
            unit = step * 10.0 ** (exponent - 1)
            first, last = np.ceil(low / unit), np.floor(high / unit)
            if first <= last:
                multiple = np.clip(np.round((low + high) / 2 / unit), first, last)
                # the shortest decimal, not 0.7000000000000001
                return float(f"{multiple * unit:.12g}") + 0.0  # no -0
        exponent -= 1


def choose_levels(
    field: Field, levels: int | Sequence[float] | ndarray | None = None, singular: bool = False
) -> ndarray:
    """Levels of isobars.

    Parameters
    ----------
    field : Field
        A field that is not constant.
    levels : int or sequence of float, optional
        The levels, or about how many, 8 by default. Chosen levels are round numbers in equal
        steps, in the range of `color_range`.
    singular : bool
        Whether the field grows beyond all bounds to the edge, where levels in equal steps would
        crowd: chosen ones then are round numbers at quantiles of the area, and zero where the
        sign changes.

    Returns
    -------
    (n,) array of float
        Increasing.

    Raises
    ------
    ValueError
        If the field is constant, or the levels are not finite and increasing or none is
        inside the range of the field.
    """
    low, high = field.values.min(), field.values.max()
    if high - low <= ROUNDING * max(abs(low), abs(high)):
        raise ValueError(f"expected a field with isobars, got the constant {low:.6g}")
    if levels is None or isinstance(levels, (int, np.integer)):
        n = 8 if levels is None else checked_integer("levels", levels, at_least=1, at_most=MOST)
        if not singular:
            return equal_steps(*color_range(field)[:2], n)
        between = (np.arange(1, n + 1) + np.array([[-0.4], [0.4]])) / (n + 1)
        ranges = quantiles(field, between).T
        chosen = np.unique([roundest(a, b) for a, b in ranges if a < b])
        if low < 0 < high:
            chosen[np.argmin(abs(chosen))] = 0.0
        return chosen
    chosen = checked_array("levels", levels, ("n",), least=1)
    if not np.all(np.diff(chosen) > 0):
        raise ValueError(f"expected increasing levels, got {chosen.tolist()}")
    if not np.any((low < chosen) & (chosen < high)):
        raise ValueError(
            f"expected a level between {low:.6g} and {high:.6g}, got {chosen.tolist()}. Remedy: "
            "of solutions, drawn over their mean pressure, scale=1.0 for levels of the pressure"
        )
    return chosen


def equal_steps(low: float, high: float, n: int) -> ndarray:
    """Multiples of 1, 2, 2.5 or 5 times a power of ten between two numbers, about n of them."""
    unit = 10.0 ** np.floor(np.log10((high - low) / n))
    found = []
    for step in unit * np.array([0.5, 1, 2, 2.5, 5, 10, 20]):
        margin = 0.02 * step  # at the very ends there is no line
        first, last = np.ceil((low + margin) / step), np.floor((high - margin) / step)
        # the shortest decimal, no -0
        found.append([float(f"{k * step:.12g}") + 0.0 for k in np.arange(first, last + 1)])
    return np.array(min((f for f in found if f), key=lambda f: abs(len(f) - n)))


def color_range(
    field: Field, clim: Sequence[float] | None = None
) -> tuple[float, float, bool, bool]:
    """Ends of the colour range, and whether values lie below and above it.

    Without ``clim`` an end is that of the values, but at most 1.5 interquartile ranges of the
    area beyond the quartile (Tukey's fences).

    Raises
    ------
    ValueError
        If ``clim`` is not two finite, increasing numbers.
    """
    smallest, greatest = float(field.values.min()), float(field.values.max())
    if clim is None:
        if greatest - smallest <= ROUNDING * max(abs(smallest), abs(greatest)):
            half = (abs(greatest) or 1) / 2
            return smallest - half, greatest + half, False, False
        lower, upper = quantiles(field, [0.25, 0.75])
        # most of the area may have one value
        varies = upper - lower > ROUNDING * (greatest - smallest)
        reach = 1.5 * (upper - lower) if varies else np.inf
        low, high = max(smallest, float(lower - reach)), min(greatest, float(upper + reach))
    else:
        low, high = checked_pair("clim", clim)
        if not low < high:
            raise ValueError(f"expected clim = (low, high) with low < high, got {clim!r}")
    return low, high, smallest < low, greatest > high


def common_exponent(values: ArrayLike) -> int:
    """The power of ten, a multiple of three, to take out of numbers too long to read.

    >>> common_exponent([1.05, 3]), common_exponent([2.4e5, 7e5]), common_exponent([2e-6, 3e-6])
    (0, 3, -6)
    """
    size = np.abs(values)
    typical = np.median(size[size > 0]) if np.any(size > 0) else 1.0
    return 0 if 1e-2 <= typical < 1e4 else 3 * int(np.floor(np.log10(typical) / 3))


def short_numbers(values: ArrayLike, exponent: int) -> list[str]:
    """``values / 10**exponent`` with as few digits as tell them apart.

    >>> short_numbers([1.05, 1.5, 3.0], 0), short_numbers([2.4e5, 1.2e6], 3)
    (['1.05', '1.5', '3'], ['240', '1200'])
    """
    scaled = np.asarray(values, dtype=float) / 10.0**exponent
    precision = 0.02 * np.min(np.diff(scaled)) if len(scaled) > 1 else 0.001 * abs(scaled[0])
    for digits in range(12):
        texts = [f"{x:.{digits}f}" for x in scaled]
        if np.all(abs(np.array(texts, dtype=float) - scaled) <= precision):
            break
    return [f"{float(text):.12g}" for text in texts]


def title_with_factor(title: str | None, exponent: int) -> str:
    """The title of the scalar bar with the power of ten taken out of its numbers."""
    factor = f"× 1e{exponent}" if exponent else ""
    return " ".join(part for part in (title, factor) if part)


def round_ticks(low: float, high: float, most: int = 6) -> ndarray:
    """At most ``most`` round, equally spaced numbers between two."""
    from matplotlib.ticker import MaxNLocator

    locator = MaxNLocator(most - 1, steps=[1, 2, 5, 10])
    ticks = np.asarray(locator.tick_values(low, high))
    margin = 1e-9 * (high - low)
    return ticks[(ticks >= low - margin) & (ticks <= high + margin)]


def bar_marks(
    low: float, high: float, below: bool, beyond: bool, exponent: int
) -> dict[float, str]:
    """Numbers beside a scalar bar from ``low`` to ``high``; at ends that values pass, which."""
    ticks = round_ticks(low, high)
    marks = dict(zip(ticks.tolist(), short_numbers(ticks, exponent), strict=True))
    for end, sign, passed in ((low, "<", below), (high, ">", beyond)):
        if passed:
            marks = {
                at: text for at, text in marks.items() if abs(at - end) > CLOSE * (high - low)
            }
            marks[end] = f"{sign} {end / 10.0**exponent:.4g}"
    return marks
