"""Positions of rigid bodies beside each other by the work of the pressures: of which it tells
them, and what it adds to those by collocation."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..contact.by_work import added_amid_others, added_by_work
from ..contact.problem import Contact
from ..contact.work import Work
from ..elements.balance import resist
from ..kernels.once import computed_once
from ..operators.influence_operator import InfluenceOperator
from ..operators.symmetric_matrix import SymmetricMatrix
from .arrangement import Arrangement


@dataclass(frozen=True, eq=False)
class PositionsByWork:
    """Of the bodies of a group.

    Attributes
    ----------
    together : Arrangement
        Which bodies these are.
    work : Work
        That of all pressures.
    rtol : float
        Accuracy of the operator's products.
    """

    together: Arrangement
    work: Work
    rtol: float

    def works(self, contact: Contact) -> bool:
        """Whether it tells all: not of shaped punches, nor beside a body in the air or on cells in
        a line, which carry no moments, nor `amid_many`."""
        x, settled = self.work.cells.collocation_points, self.work.system.planes[::3]
        flat = all(punch.gap is None for punch in self.together.members)
        if not flat or self.amid_many(contact):
            return False
        return all(resist(x, contact.touching & (own != 0)) for own in settled)

    @computed_once
    def beside_shaped(self) -> tuple[int, ...]:
        """Numbers of bodies of one punch, where some are shaped and no frame is on them: their
        positions are by work one by one, see `Beside`."""
        flat = all(punch.gap is None for punch in self.together.members)
        if flat or self.together.stiffness is not None:
            return ()
        return tuple(n for n, body in enumerate(self.together.bodies) if len(body) == 1)

    def amid_many(self, contact: Contact) -> bool:
        """Whether work finds positions body by body, see `added_amid`: where flat punches lift
        off and no matrix is there, nor a frame."""
        known = isinstance(self.work.system.matrix, (np.ndarray, SymmetricMatrix))
        framed = self.together.stiffness is not None
        if known or framed or contact.touching.all() or any(contact.lines):
            return False
        return all(p.gap is None and p.weights is not None for p in self.together.members)

    def added_amid(self, contact: Contact, position: ndarray) -> ndarray:
        """What work adds to positions by collocation, (2, m), see `added_amid_others`; nothing to
        those of joined punches."""
        parts = [contact.under(own, i) for i, own in enumerate(self.work.own)]
        settled = self.work.settled_by(self._at_sectors, contact)
        alone = {body[0]: n for n, body in enumerate(self.together.bodies) if len(body) == 1}
        return added_amid_others(self.together.members, parts, position, settled, alone)

    @computed_once
    def _at_sectors(self) -> InfluenceOperator:
        """From the cells, which all have slopes, to the sectors where work looks."""
        return self.work.cells.fast_operator(self.work.sectors.x, self.rtol)

    def added(self, contact: Contact, position: ndarray) -> ndarray:
        """What work adds to positions of bodies, some of them shaped, or of many others, (m,)."""
        if self.amid_many(contact):
            return self.added_amid(contact, position)[0]
        parts = [contact.under(own, i) for i, own in enumerate(self.work.own)]
        some = [(self.together.bodies[n][0], slice(3 * n, 3 * n + 3)) for n in self.beside_shaped]
        return added_by_work(self.together.members, parts, position, some)
