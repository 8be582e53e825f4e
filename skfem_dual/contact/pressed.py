"""Bodies on the ground and what they press with: the cells under them with all their laws."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..elements.line_weights import LineWeights
from ..operators.entries import EXACT
from .footprint import Footprint
from .problem import Contact

#: up to so many pairs of points and cells displacements are summed exactly
FEW = 10**8


def on_line(footprint: Footprint, line: LineWeights | None) -> Footprint:
    """Cells that are weighted along a line of contact, if there is one, and follow those around
    away from it."""
    if line is None:
        return footprint
    slopes = replace(footprint.smooth, weights=line).without(line.weighted | ~line.in_contact)
    return replace(footprint, weights=line, slopes=slopes)


class Pressed(NamedTuple):
    """A body on the ground and what it presses with.

    Attributes
    ----------
    body : RigidPunch or ElasticPunch
        The body.
    pressure : (n,) array of float
        Mean pressures of its cells.
    flat, line
        As of `PunchSolution`.
    """

    body: Any
    pressure: ndarray
    flat: ndarray | None
    line: LineWeights | None

    @classmethod
    def of(cls, body: Any, contact: Contact) -> Self:
        """A body with the contact under it."""
        return cls(body, contact.pressure, contact.flat, contact.line)

    @property
    def cells(self) -> Footprint:
        """The cells, without slopes in those that are flat, weighted along the line of contact."""
        cells = on_line(self.body.footprint, self.line)
        return cells if self.flat is None else cells.flattened(self.flat)


def settlement(pressures: Iterable[tuple[Footprint, ndarray]], x: ndarray) -> ndarray:
    """Settlement of the ground in points (2, m) under pressures of some cells, (m,)."""
    w = np.zeros(x.shape[1])
    for cells, p in pressures:
        if len(p) * x.shape[1] > FEW and cells.tolerance >= EXACT:
            w += cells.fast_operator(x, cells.tolerance) @ p
        else:
            w += cells.settlements(x, p)
    return w
