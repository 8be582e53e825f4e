"""Who has a position by the work of pressures: a punch alone, and the members of a group."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from ..kernels.once import computed_once
from .along_lines import has_law, on_each, regions_of
from .line_work import Compliances
from .load import Constraints, Load
from .problem import Contact
from .region import ContactRegion


def moved(positions: ndarray, by: ndarray) -> ndarray:
    """Positions (W0, Lx, Ly) of shape (k, 3) of a point farther on by some way."""
    return positions @ np.vstack([[1.0, 0.0, 0.0], np.column_stack([by, np.eye(2)])])


@dataclass(frozen=True, eq=False)
class Alone:
    """A punch with no other beside it, whose position follows from the work of its pressures.

    Attributes
    ----------
    punch : RigidPunch
        The punch.
    load : Load
        What was imposed.
    contact : Contact
        What was found.
    """

    punch: Any
    load: Load
    contact: Contact

    @computed_once
    def region(self) -> ContactRegion:
        """Where it touches the ground."""
        return regions_of([self.punch.footprint], [slice(None)], [self.contact])[0][0]

    @computed_once
    def on_line(self) -> Compliances | None:
        """See `Work.along_line`."""
        work = self.punch.work
        if not has_law(work, self.contact):
            return None
        return on_each(work, [self.contact], [self.position], [[self.region]])[0]

    @computed_once
    def constraints(self) -> Constraints:
        """What the load imposes."""
        return self.load.constraints(self.punch.origin - self.punch.centre)

    def position(self, compliance: ndarray) -> ndarray:
        """As `Work.position`."""
        return self.punch.work.position(self.constraints, compliance)

    @property
    def works(self) -> bool:
        """Whether its position follows from the work."""
        return self.punch.works(self.contact)

    @property
    def positions(self) -> ndarray | None:
        """(W0, Lx, Ly), see `Work.positions`; shape (2, 3)."""
        if not self.works:
            return None
        punch = self.punch
        found = punch.work.positions(self.constraints, self.contact, on_line=lambda: self.on_line)
        return None if found is None else moved(found, punch.origin - punch.centre)


@dataclass(frozen=True, eq=False)
class Member:
    """A punch of a group, whose position follows from the work of all pressures.

    Attributes
    ----------
    answer : GroupAnswer
        That of the group.
    body : int
        Number of its body.
    origin : (2,) array of float
        Its origin from the point to which the position of the body refers.
    """

    answer: Any
    body: int
    origin: ndarray

    @property
    def positions(self) -> ndarray | None:
        """(W0, Lx, Ly), see `Work.positions`; shape (2, 3)."""
        found = self.answer.positions
        own = slice(3 * self.body, 3 * self.body + 3)
        return None if found is None else moved(found[:, own], self.origin)
