"""Rings from corners in any common form."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from ..arguments import (
    LARGEST,
    Pair,
    checked_array,
    checked_instance,
    checked_number,
    checked_pair,
)
from ..errors import MeshError
from ..grids.polygons import readonly
from ..messages import place, shown
from .crossings import require_simple
from .rings import SMOOTH, Ring
from .sides import bulge_through

#: corners nearer to each other than this part of the extent are the same: no mesh tells them
SAME = 2e-7
#: plans with less area than this part of the square of the extent, and arcs so flat, have none
FLAT = 1e-9
#: an arc of more than 359.7 degrees is a circle
LARGEST_BULGE = 1e3
#: bulge of an arc that is no less than a whole circle, but for rounding
WHOLE = 1e12


def ring_of(name: str, corners: Any, bulges: Any) -> Ring:
    """A ring, counter-clockwise, from corners in either sense, closed or not.

    Parameters
    ----------
    name : str
        What they are, for messages.
    corners : sequence of pairs or triples, or array of float
        As in `Plan.from_polygon`.
    bulges : (n,) array of float, optional
        Unless the corners have them.

    Raises
    ------
    TypeError, ValueError
        If something is no number, or of another shape.
    MeshError
        If corners repeat, or enclose no area.
    """
    x, b = _coordinates(name, corners)
    if bulges is not None:
        if b is not None:
            raise ValueError(f"expected bulges either in {name} or on their own, got both")
        b = checked_array("bulges", bulges, (x.shape[1],), each="corner")
    b = np.zeros(x.shape[1]) if b is None else b
    if np.any(np.abs(b) > LARGEST_BULGE):
        i = int(np.argmax(np.abs(b)))
        raise ValueError(
            f"expected bulges up to {LARGEST_BULGE:g}, got {b[i]:g} at corner {i}. Remedy: "
            "Plan.circle for whole circles"
        )
    least = 2 if b.any() else 3
    if x.shape[1] < least:
        raise MeshError(f"expected at least {least} points for {name}, got {x.shape[1]}")
    extent = np.ptp(x, axis=1).max()
    if 0 < extent < 1 / LARGEST:
        raise MeshError(
            f"expected {name} of an extent from {1 / LARGEST:g} on, got {extent:.3g}. Remedy: "
            "choose units in which sizes are near 1"
        )
    if x.shape[1] > 1 and np.hypot(*(x[:, -1] - x[:, 0])) <= SAME * extent:  # closed
        x, b = x[:, :-1], b[:-1]
    same = np.hypot(*(np.roll(x, -1, axis=1) - x)) <= SAME * extent
    if same.any():
        i = int(np.argmax(same))
        raise MeshError(
            f"expected {name} without duplicate corners, got corners {i} and "
            f"{(i + 1) % x.shape[1]} both at {place(x[:, i])}. Remedy: leave one out"
        )
    ring = Ring(readonly(np.ascontiguousarray(x)), readonly(np.array(b)))
    folded = np.abs(ring.turns) > np.pi - SMOOTH * 1e-2
    if folded.any():
        raise MeshError(
            f"expected {name} with angles between their sides, got none at "
            f"{place(x[:, int(np.argmax(folded))])}, where the line turns back. Remedy: leave "
            "that corner out, or move it"
        )
    if abs(ring.area) <= FLAT * extent**2:
        require_simple([ring], [name])  # loops of opposite senses
        raise MeshError(
            f"expected {name} to enclose an area, got {x.shape[1]} corners on one line, from "
            f"{place(x.min(axis=1))} to {place(x.max(axis=1))}"
        )
    return ring if ring.area > 0 else ring.reversed


def bulge_of(start: Pair, through: Pair, end: Pair) -> float:
    """Bulge of the arc from one corner to another through a third point, see `Plan.bulge`."""
    pairs = {"start": start, "through": through, "end": end}
    a, m, b = (np.array(checked_pair(name, x)) for name, x in pairs.items())
    size = np.hypot(*(b - a))
    if size == 0 or min(np.hypot(*(m - a)), np.hypot(*(m - b))) <= FLAT * size:
        raise ValueError("expected three points that differ from each other for an arc")
    bulge = bulge_through(a, m, b)
    if (m - a) @ (m - b) > 0 and (bulge == 0 or abs(bulge) > WHOLE):
        raise ValueError(
            f"expected a point between start and end for through, got {place(m)} beyond them "
            "on their line, where no arc leads"
        )
    return bulge


def _coordinates(name: str, corners: Any) -> tuple[ndarray, ndarray | None]:
    """Coordinates of shape (2, n), and bulges if there are any."""
    if not isinstance(corners, ndarray):
        wanted = "a list of pairs (x, y); circles are plans, of several rings Plan.from_rings"
        checked_instance(name, corners, (Sequence, ndarray), wanted)
        if isinstance(corners, str):
            raise TypeError(f"expected a list of pairs (x, y) for {name}, got {shown(corners)}")
        corners = list(corners)
        if len({np.size(c) for c in corners}) > 1 and {np.size(c) for c in corners} <= {2, 3}:
            corners = [(*c, 0.0) if len(c) == 2 else tuple(c) for c in corners]
    x = checked_array(name, corners, None)
    if x.shape == (2, 3) and not isinstance(corners, ndarray):
        raise ValueError(
            f"expected {name} as pairs (x, y), got two triples: three corners as (2, n), or two "
            "with bulges? Remedy: three pairs, or two and bulges="
        )
    if x.ndim != 2 or (len(x) != 2 and x.shape[1] not in (2, 3)):
        raise ValueError(
            f"expected {name} as pairs (x, y), an array (n, 2) or (2, n), got shape {x.shape}"
        )
    x = x if len(x) == 2 and x.shape != (2, 2) else x.T
    if not x.size:
        raise MeshError(f"expected at least 3 points for {name}, got none")
    bulges = x[2] if len(x) == 3 else None
    for value in (x[:2].min(), x[:2].max()):
        checked_number(f"coordinates of {name}", float(value), at_least=-LARGEST, at_most=LARGEST)
    return x[:2], bulges
