"""Pressure against what the ground may bear, settlements of points."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..messages import listed
from ..units import Units
from .details import Details
from .footing import Between, Footing
from .page import (
    NONE,
    Html,
    amount,
    coordinate,
    number,
    one_to,
    paragraph,
    percent,
    section,
    symbol,
    table,
)
from .results import axes_of

#: by how much of it pressures exceed an allowable one for which the area was made
ROUNDING = 1e-9


class Borne(NamedTuple):
    """Pressures in a case, the mean and the largest on a circle, and whether they solve it."""

    name: str
    mean: float
    largest: float
    success: bool


def bearing_section(
    borne: Sequence[Borne], circles: Sequence[float], details: Details, *, repeats: bool = False
) -> Html:
    """Mean and largest pressures, against the allowable one if there is one.

    ``circles`` are the radii of those on which the largest ones are means; where pressures repeat
    they stay within a period.
    """
    unit, allowable = details.units.pressure, details.allowable
    head = ["Footing, case", f"Mean [{unit.symbol}]", f"Largest [{unit.symbol}]"]
    if allowable is not None:
        head += ["Mean / allowable", "Largest / allowable"]
    rows = []
    compared = [
        [value / (allowable or np.nan) if success else np.nan for value in values]
        for _, *values, success in borne
    ]
    for (name, *values, _), used in zip(borne, compared, strict=True):
        shares = [percent(value) for value in used] if allowable else []
        rows.append((name, *(amount(value, unit, 4) for value in values), *shares))
    stated = ""
    if allowable is not None:
        stated = f". {_verdict(np.array(compared))}"
    limit = [] if allowable is None else [
        paragraph("Allowable pressure: ", amount(allowable, unit), " ", symbol(unit), stated, ".")
    ]  # fmt: skip
    radii = listed(list(dict.fromkeys(f"{radius:.3g}" for radius in circles)))
    what = (
        "The mean pressure is the force over the area in contact. The largest pressure is the "
        f"largest mean on a circle with a radius of {radii} {details.units.length.symbol}, a "
        "fifth of that of the largest circle that fits into the plan, or the mean pressure where "
        "contact is narrower than that: under the sharp edge of a "
        "stiff base on elastic ground the pressure grows beyond all bounds, the ground yields "
        "there, and what a cell at the edge bears depends on its size; the mean on a circle "
        "hardly does. The strength of the ground itself is not checked."
    )
    if repeats:
        what += (
            " Circles stay within one period, and the largest pressure depends on where that "
            "begins."
        )
    return section(
        "Bearing pressure", table(rows, head, "", numeric=True), *limit, paragraph(what)
    )


def _verdict(used: ndarray) -> str:
    """What is said of mean and largest pressures over the allowable one, (k, 2); NaN without."""
    solved = used[np.isfinite(used).all(axis=1)]
    if len(solved) == 0:
        return "Whether it is kept is not known: nothing was found"
    mean, largest = solved.max(axis=0)
    full = 1 + ROUNDING
    said = "It is kept" if max(mean, largest) <= full else "It is EXCEEDED"
    if max(mean, largest) > full >= mean:
        said = "It is kept by the mean pressures, and exceeded by the largest pressure"
    if missing := len(used) - len(solved):
        said += f". This holds for what was found; there are {missing} without a solution"
    return said


def points_section(footings: Sequence[Footing]) -> Html:
    """Settlements of corners and points over all cases."""
    units = footings[0].details.units
    sink = units.displacement
    head = ["Point", *axes_of(units), f"Least [{sink.symbol}]", f"Largest [{sink.symbol}]", "Case"]
    rows = []
    for footing in footings:
        size = 1.0 if footing.standing is None else footing.standing.size
        good = footing.cases.success
        if not good.any():
            continue
        for i, (name, x) in enumerate(footing.points.items()):
            w = np.where(good, footing.settlements[:, i], np.nan)
            most = int(np.nanargmax(w))
            rows.append(
                (
                    footing.called(name),
                    *(coordinate(c, size) for c in x),
                    amount(np.nanmin(w), sink),
                    amount(w[most], sink),
                    footing.cases.names[most],
                )
            )
    return section(
        "Settlements of corners and points",
        table(rows, head, "Settlements of corners and points over all cases", numeric=True),
        paragraph(
            "A rigid base does not bend: the angular distortion between any two points of it is "
            "its tilt along their line."
        ),
    )


def differences_section(pairs: Sequence[Between], units: Units) -> Html:
    """Between bodies, in the cases in which they are largest."""
    if not pairs:
        return NONE
    head = ["Bodies", f"Distance [{units.length.symbol}]"]
    head += [
        f"Differential settlement [{units.displacement.symbol}]",
        "Angular distortion",
        "Case",
    ]
    rows = [
        (
            f"{p.first} – {p.second}",
            number(p.distance),
            amount(p.difference, units.displacement),
            one_to(p.distortion),
            p.case,
        )
        for p in pairs
    ]
    return section(
        "Differential settlements",
        table(rows, head, "Largest differences, the second less the first", numeric=True),
        paragraph(
            "Differences of mean settlements, of a rigid base that of its centroid, and "
            "these over the distance of the centroids."
        ),
    )
