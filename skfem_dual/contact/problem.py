"""Contact to be found, and contact that was found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..elements.line_weights import LineWeights
from ..errors import ConvergenceWarning, ResolutionWarning, warn
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly
from ..operators.iterative import Product
from .load import Constraints

#: contact on fewer cells is rough
DOZEN = 12


class Contribution(NamedTuple):
    """What a body under its load brings into the equations, of one body or of several.

    Attributes
    ----------
    planes, resultants, gap
        As of `ContactSystem`.
    constraints : Constraints
        What is imposed on it.
    """

    planes: ndarray
    resultants: ndarray
    gap: ndarray
    constraints: Constraints


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Complementarity of pressures and gaps in n cells with k unknown motions.

    Attributes
    ----------
    matrix : (n, n) array or LinearOperator
        Settlement of each collocation point under unit pressure on each cell.
    areas : (n,) array of float
        Areas of the cells.
    gap : (n,) array of float
        Gaps of the punch before it moves and presses.
    planes : (k, n) array of float
        Settlement of the collocation points by each unit motion, all of one size.
    resultants : (k, n) array of float
        Force or moment conjugate to each motion by unit pressure on each cell.
    given : (k,) array of float
        The forces and moments imposed.
    inverse : LinearOperator, optional
        Approximate inverse of the matrix; times the areas nearly symmetric, and positive.
    conjugate : bool
        Whether the resultants are conjugate to the motions, as those that are given are not where
        a settlement is imposed elsewhere than its reaction acts.
    """

    matrix: ndarray | Product
    areas: ndarray
    gap: ndarray
    planes: ndarray
    resultants: ndarray
    given: ndarray
    inverse: Product | None = None
    conjugate: bool = True


@dataclass(frozen=True, eq=False)
class Contact(ReadOnly):
    """What a method found.

    Attributes
    ----------
    pressure : (n,) array of float
        Pressures, none negative unless the ground may pull.
    motion : (k,) array of float
        Motions y.
    gap : (n,) array of float
        Gaps under the load; in contact what remains of them.
    touching : (n,) array of bool
        The cells in contact.
    success : bool
        Whether the method converged.
    message : str
        If not, why.
    history : tuple of float
        In each iteration: cells that changed side (active set), or the largest violation of the
        conditions on the gap over the largest settlement (conjugate gradients).
    residual : float
        Violation of the conditions on the gap that was found afterwards.
    flat : (n,) array of bool, optional
        Cells in which the pressure does not follow the cells around, see `Slopes`, as it would
        turn negative; None if there are none.
    lines : tuple of LineWeights or None
        Under each body how pressures end along the line of contact, None where with the cells;
        empty if they do so under all.
    unit_pressures : (n, m) array of float, optional
        By unit motions of bodies with that contact, if they are known.
    compliances : pair of (m, m) array of float, optional
        Those that told the forces under which it was found, where these keep positions imposed:
        see `Work.holding`.
    """

    pressure: ndarray
    motion: ndarray
    gap: ndarray
    touching: ndarray
    success: bool = True
    message: str = ""
    history: tuple[float, ...] = ()
    residual: float = 0.0
    flat: ndarray | None = None
    lines: tuple[LineWeights | None, ...] = ()
    unit_pressures: ndarray | None = None
    compliances: tuple[ndarray, ndarray] | None = None

    def __post_init__(self) -> None:
        for name in ("pressure", "motion", "gap", "touching"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @classmethod
    def nowhere(
        cls, problem: ContactProblem, motion: ndarray | None = None, message: str = ""
    ) -> "Contact":
        """None in any cell, after a motion; a message tells why none was found."""
        motion = np.zeros(len(problem.given)) if motion is None else motion
        nothing, gap = np.zeros(len(problem.areas)), problem.gap - motion @ problem.planes
        return cls(nothing, motion, gap, nothing > 0, not message, message)

    @property
    def clearance(self) -> ndarray:
        """Gaps without what remains of them in contact, and of overlap: none negative."""
        return np.where(self.touching, 0.0, self.gap.clip(0))

    @property
    def line(self) -> LineWeights | None:
        """How pressures end along the line of contact under the only body."""
        return self.lines[0] if self.lines else None

    def under(self, cells: slice | ndarray, number: int = 0) -> "Contact":
        """The same under one of several bodies, by its cells and its number."""
        pressure, gap, touching = self.pressure[cells], self.gap[cells], self.touching[cells]
        flat = None if self.flat is None or not self.flat[cells].any() else self.flat[cells]
        lines = self.lines[number : number + 1]
        part = replace(self, pressure=pressure, gap=gap, touching=touching, flat=flat, lines=lines)
        return replace(part, unit_pressures=None, compliances=None)

    @property
    def pulling(self) -> float:
        """Largest negative pressure over the largest of all; zero if none is negative."""
        largest = np.abs(self.pressure).max()
        return float(-self.pressure.min() / largest) if self.pressure.min() < 0 else 0.0

    @property
    def violation(self) -> float:
        """Largest distance between ground and punch in contact, or overlap elsewhere."""
        own = np.where(self.touching, np.abs(self.gap), -self.gap).max()
        return float(max(own, self.residual, 0.0))

    @property
    def description(self) -> str:
        """What the contact is, in words."""
        touching, pulled = self.touching, int(np.sum(self.pressure < 0))
        if not touching.any():
            return "no contact" if self.gap.any() else "contact without pressure"
        if not touching.all():
            return f"contact on {touching.sum()} of {len(touching)} cells"
        also = f"; the ground would have to pull on {pulled} cells" if pulled else ""
        return "full contact" + also

    @property
    def rough(self) -> str:
        """A warning if contact that was found ends on fewer than a dozen cells."""
        count = int(np.sum(self.pressure > 0))
        if self.touching.all():  # also where the ground pulls
            return ""
        if not 0 < count < min(DOZEN, len(self.touching)):
            return ""
        return (
            f"contact on {count} of {len(self.touching)} cells, fewer than {DOZEN}: pressures and "
            "settlement are rough; likely cause: cells too large for the contact. Remedy: smaller "
            "cells where it is"
        )


def warn_of(contact: Contact, rough: Sequence[str] | None = None) -> None:
    """Warn the caller of a solver of contact that was not found, or is rough; by default under the
    one body that there is."""
    if not contact.success:
        warn(contact.message, ConvergenceWarning)
        return
    for message in rough_under(contact, [slice(None)]) if rough is None else rough:
        warn(message, ResolutionWarning)


def rough_under(contact: Contact, parts: Sequence[slice | ndarray]) -> list[str]:
    """Warnings of contact on few cells, of the bodies where there are some."""
    return [few for cells in parts if (few := contact.under(cells).rough)]
