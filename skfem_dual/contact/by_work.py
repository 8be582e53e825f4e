"""Who has a position by the work of pressures: a punch alone, or beside others."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray

from ..kernels.once import computed_once
from .along_lines import has_law, on_each, regions_of
from .line_work import Compliances
from .load import Constraints, Load
from .pressed import Pressed, settlement
from .problem import Contact
from .region import ContactRegion
from .system import DENSE

#: positions imposed are met in so many solutions at most, and not again once what work adds to
#: them changes by so little of the largest: by a hundredth or less each time
PASSES, CLOSE = 6, 1e-9
#: changes that are more than those of a cell that comes into contact and leaves it in turn
ROUGH = 1e-3


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


def _tells(punch: Any, contact: Contact) -> bool:
    """Whether work does of a punch beside others."""
    return len(punch.footprint) <= DENSE and punch.works(contact)


def added_amid_others(
    punches: Sequence[Any],
    contacts: Sequence[Contact],
    position: ndarray,
    settled: ndarray,
    bodies: Mapping[int, int],
) -> ndarray:
    """What the work of unit forces on each punch alone, on the settlement by all pressures, adds
    to positions.

    Parameters
    ----------
    punches, contacts : sequence of RigidPunch and of Contact
        And what was found under each.
    position : (3 m,) array of float
        Of the bodies by collocation.
    settled : (nsectors,) array of float
        Settlement of the sectors of all, one after the other, under the pressures of all.
    bodies : mapping of int to int
        From the numbers of punches that are one to that of their body.

    Returns
    -------
    (2, 3 m) array of float
        As of `Work.added`; zero where work tells nothing.
    """
    added, begin = np.zeros((2, len(position))), 0
    for i, (punch, contact) in enumerate(zip(punches, contacts, strict=True)):
        work = punch.work
        here = slice(begin, begin + len(work.sectors.cell))
        begin = here.stop
        if i in bodies and _tells(punch, contact):
            own = slice(3 * bodies[i], 3 * bodies[i] + 3)
            more = work.added(contact, position[own], settled[here])
            added[:, own] = 0.0 if more is None else more
    return added


def added_by_work(
    punches: Sequence[Any],
    contacts: Sequence[Contact],
    position: ndarray,
    some: Iterable[tuple[int, slice]],
) -> ndarray:
    """What work adds to positions by collocation (m,) of some punches beside others, by their
    numbers and where their positions are; zero for all else and where it tells nothing."""
    pressed, added = list(map(Pressed.of, punches, contacts)), np.zeros(len(position))
    for i, own in some:
        more = _added(punches[i], contacts[i], position[own], pressed[:i] + pressed[i + 1 :])
        added[own] = 0.0 if more is None else more[0]
    return added


def _added(
    punch: Any, contact: Contact, position: ndarray, others: Sequence[Pressed]
) -> ndarray | None:
    """The same of one punch; two rows as of `Work.positions`, None where it tells nothing."""
    if not _tells(punch, contact):
        return None
    bodies = Pressed.of(punch, contact), *others
    pressures = [(body.cells, body.pressure) for body in bodies]
    return punch.work.added(contact, position, settlement(pressures, punch.work.sectors.x))


def met(
    found: tuple[Contact, ndarray],
    added: Callable[[Contact, ndarray], ndarray],
    solve: Callable[[ndarray, Contact], tuple[Contact, ndarray]],
) -> tuple[Contact, ndarray]:
    """Contact and positions by collocation that work leads to those imposed.

    Parameters
    ----------
    found : Contact and (m,) array of float
        With the positions imposed by collocation.
    added : callable
        What work adds to positions by collocation, (m,); zero where nothing is imposed.
    solve : callable
        Contact and positions short of those imposed by so much, from the contact found last.
    """
    by_points, short = found, np.zeros(len(found[1]))
    for _ in range(PASSES):
        contact, position = found
        more = added(contact, position) if contact.success else short
        change, size = (np.abs(a).max(initial=0.0) for a in (more - short, position))
        if change <= CLOSE * size:
            return found
        last = solve(more, contact)
        if not last[0].success:
            return unmet(contact, last[0]), position
        found, short = last, more
    # of contacts that take turns work tells different positions, or none
    return found if change <= ROUGH * size else by_points


def unmet(contact: Contact, last: Contact) -> Contact:
    """The contact, as the one in which positions imposed are nearer by work was not found."""
    message = f"positions imposed are not met by work: {last.message}"
    return replace(contact, success=False, message=message)


@dataclass(frozen=True, eq=False)
class Beside:
    """A punch beside bodies that bend or are shaped, whose position follows from the work that
    unit forces on the punch alone do on the settlement by all pressures.

    Attributes
    ----------
    punch, load, contact
        As of `Alone`.
    position : (3,) array of float
        Of the plan's centroid, by collocation.
    others : tuple of Pressed
        The bodies beside it.
    """

    punch: Any
    load: Load
    contact: Contact
    position: ndarray
    others: tuple[Pressed, ...]

    @property
    def positions(self) -> ndarray | None:
        """(W0, Lx, Ly), see `Work.positions`; shape (2, 3). What is imposed is kept."""
        added = _added(self.punch, self.contact, self.position, self.others)
        if added is None:
            return None
        ahead = self.punch.origin - self.punch.centre
        return moved(self.load.constraints(ahead).keeping(self.position + added), ahead)


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
