"""Rigid bodies on the ground, one or several: contact under loads, found and verified."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy import ndarray

from ..contact.by_work import met, unmet
from ..contact.edges import narrow
from ..contact.footprint import Footprint
from ..contact.line_law import with_line_law
from ..contact.load import Constraints, Load
from ..contact.loaded_cells import ExactRows, LoadedCells, slices_of
from ..contact.methods import find_contact
from ..contact.one_sign import solved
from ..contact.parts import Part, by_bodies, flattened_system
from ..contact.problem import Contact, rough_under, warn_of
from ..contact.system import ContactSystem
from ..contact.unilateral import How
from ..contact.verify import Verification
from ..contact.work import Work
from ..elements.slope_correction import SlopeCorrection
from ..errors import ResolutionWarning, warn
from ..kernels.limits import threads_for_matrix
from ..kernels.once import FromFields, computed_once
from ..kernels.progress import Seconds, progress_bars
from ..solutions.punch_solution import PunchSolution
from .frame import FramedSystem

#: tolerance of gaps from which on contact ends with the cells: by about as much of the settlement
#: the law of its line moves bodies on some hundred cells
COARSE = 1e-3
#: forces that keep positions imposed are found so often at most, and not again once they change
#: by so little: by a hundredth or less each time
PASSES, CLOSE = 6, 1e-6
#: part of the load by which that may be off
ROUGH = 1e-3


class RigidBodies(FromFields, ABC):
    """What is solved under one set of loads or many: a punch, or several.

    Attributes
    ----------
    timings : dict of str to float
        Seconds of assembly and factorisation.
    """

    timings: dict[str, float]
    #: what makes cells smaller where contact is
    _refined_by: ClassVar[str] = ""

    @property
    @abstractmethod
    def cells(self) -> LoadedCells:
        """The cells of all punches."""

    @property
    @abstractmethod
    def parts(self) -> tuple[Part, ...]:
        """The punches, one after the other."""

    @property
    def footprints(self) -> tuple[Footprint, ...]:
        """Their cells."""
        return tuple(part.footprint for part in self.parts)

    @computed_once
    def slices(self) -> list[slice]:
        """Where the cells of each punch are among those of all."""
        return slices_of(self.footprints)

    @property
    def cells_of_bodies(self) -> list[ndarray]:
        """Numbers of the cells of each body, those of joined punches together."""
        own: dict[int, list[ndarray]] = {}
        for part, cells in zip(self.parts, self.slices, strict=True):
            own.setdefault(part.body, []).append(np.arange(cells.start, cells.stop))
        return [np.concatenate(own[body]) for body in range(len(own))]

    def rough(self, contact: Contact) -> list[str]:
        """Warnings of contact on few cells, or hardly wider than one."""
        found = rough_under(contact, self.cells_of_bodies)
        parts = list(zip(self.parts, self.slices, strict=True))
        for body in range(len(self.cells_of_bodies)):
            own = [(part.footprint.partition, cells) for part, cells in parts if part.body == body]
            even = not any(self.system.gap[cells].any() for _, cells in own)
            found.append(narrow([(one, contact.touching[cells]) for one, cells in own], even))
        return [message + self._refined_by for message in found if message]

    @computed_once
    def sloping(self) -> tuple[SlopeCorrection, ...]:
        """What slopes inside the cells of each punch, smooth ones if they have none of their own,
        add to the settlements of all collocation points."""
        ground, x = self.cells.ground, self.cells.collocation_points
        slopes = [cells.slopes or cells.smooth for cells in self.footprints]
        return tuple(SlopeCorrection.from_slopes(own, ground, x) for own in slopes)

    @property
    @abstractmethod
    def operator(self) -> Any:
        """From all cells to their collocation points."""

    @property
    @abstractmethod
    def system(self) -> ContactSystem:
        """The equations."""

    @property
    def exact_rows(self) -> ExactRows | None:
        """Some rows of the matrix, computed apart from it; None if there are none."""
        return self.cells.exact_rows

    @property
    @abstractmethod
    def _rtol(self) -> float:
        """Accuracy of the operator's products."""

    def resultants_of(self, footprints: Sequence[Footprint]) -> ndarray:
        """Forces and moments of unit pressures on the cells of the punches, with other laws."""
        return by_bodies(self.parts, [cells.resultants for cells in footprints])

    @abstractmethod
    def constraints(self, loads: tuple[Load, ...], unilateral: bool) -> Constraints:
        """What the loads impose; a ValueError where no pressures can balance them."""

    @property
    def _shape(self) -> Callable[[ndarray], ndarray | None] | None:
        """See `Work.shape`."""
        return None

    @computed_once
    def work(self) -> Work:
        """Positions by the work of the pressures."""
        return Work(self.parts, self.cells, self.system, self._shape)

    @abstractmethod
    def works(self, contact: Contact) -> bool:
        """Whether positions follow from the work of the pressures."""

    def added(self, contact: Contact, position: ndarray) -> ndarray:
        """What work adds to positions of flat bodies among shaped ones, (m,)."""
        return np.zeros(len(position))

    @abstractmethod
    def over_edge(self, pressure: ndarray) -> Self | None:
        """The same with edges of flat punches where shaped ones, whose edges were not chosen,
        press over that of their plan; None if none does."""

    @abstractmethod
    def warn_of_pulling(self, name: str = "") -> None:
        """Warn where pressures under mere settlements show that the law of the edge fails; with a
        ``name`` said first."""

    @abstractmethod
    def answers(
        self,
        loads: tuple[Load, ...],
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
    ) -> tuple[PunchSolution, ...]:
        """Of each punch, from contact and positions of all."""

    def verification(self, constraints: Constraints, how: How) -> Verification:
        """What is asked of an answer."""
        return Verification(self.system, constraints, how, self.exact_rows, self._rtol)

    def _solved(
        self, loads: tuple[Load, ...], how: How, start: ndarray | None, progress: bool
    ) -> tuple[Self, tuple[PunchSolution, ...]]:
        """The bodies with edges as the contact has them, and the answers of each punch under
        loads; ``start`` as of `solved`."""
        constraints = self.constraints(loads, how.unilateral)
        seconds = Seconds()
        with progress_bars(progress):
            contact, position = self.contact(constraints, how, start)
        if contact.success and (sharp := self.over_edge(contact.pressure)) is not None:
            return sharp._solved(loads, how, contact.pressure, progress)
        timings = self.timings | {"solution": seconds()}
        warn_of(contact, self.rough(contact))
        if contact.success and not how.unilateral:
            self.warn_of_pulling()
        return self, self.answers(loads, contact, position, timings)

    def contact(
        self, constraints: Constraints, how: How, start: ndarray | None = None
    ) -> tuple[Contact, ndarray]:
        """Contact and positions, verified; ``start`` as of `solved`."""
        return self.kept(constraints, how, self._collocated(constraints, how, start))

    def kept(
        self, constraints: Constraints, how: How, found: tuple[Contact, ndarray]
    ) -> tuple[Contact, ndarray]:
        """The same under the forces on the ground that by work keep the positions imposed, and
        balance the frame, where positions follow from it: whoever imposes the position under a
        load has the pressures of that load."""
        if constraints.of_forces:
            return found

        def short(added: ndarray, last: Contact) -> tuple[Contact, ndarray]:
            imposed = replace(constraints, fixed=constraints.fixed - added)
            return self._collocated(imposed, how, last.pressure)

        found = by_points = met(found, self.added, short)
        (last, _), acting, off = found, np.zeros(len(constraints.fixed)), 0.0
        for _ in range(PASSES):
            held = None
            if last.success and self.works(last):
                held = self.work.holding(constraints, last)
            if held is None:  # of the contact under that force work tells nothing
                return by_points
            own = held[0] / self.work.unit  # forces, and moments over lengths
            change, size = np.abs(own - acting / self.work.unit).max(), np.abs(own).max()
            if change <= CLOSE * size:
                off = 0.0
                break
            off = float(change / size)
            acting, compliances = held
            start = None if last.touching.all() else last.pressure
            last, position = self._collocated(Constraints.forces(acting), how, start)
            if not last.success and constraints.frame is not None:  # no position is imposed
                warn(
                    "the position is that by collocation: under the forces that by work balance "
                    f"the frame no contact is found ({last.message}). Remedy: smaller cells",
                    ResolutionWarning,
                )
                return by_points
            if not last.success:
                return unmet(found[0], last), found[1]
            found = replace(last, compliances=compliances), position
        if off > ROUGH:
            warn(
                f"cells come into contact and leave it in turn under the position imposed: it is "
                f"that of a load {100 * off:.2g} % off the one told. Remedy: smaller cells where "
                "contact ends",
                ResolutionWarning,
            )
        return found

    def _collocated(
        self, constraints: Constraints, how: How, start: ndarray | None
    ) -> tuple[Contact, ndarray]:
        def find(flat: ndarray, start: ndarray | None) -> tuple[Contact, ndarray]:
            return self.flattened(constraints, flat, start, how)

        rows = 0 if self.cells.regular else len(self.cells)
        # infinite loads are refused there
        with np.errstate(over="ignore", invalid="ignore"), threads_for_matrix(rows):
            answer = solved(self.cells, find, how.unilateral, start)
            return self.with_line_law(constraints, how, answer)

    def with_line_law(
        self, constraints: Constraints, how: How, found: tuple[Contact, ndarray]
    ) -> tuple[Contact, ndarray]:
        """The same with the law of the line of contact, where it has one and gaps are to be closer
        than it brings them."""
        on_line = how._replace(method="active-set")
        if not how.unilateral or how.gap_rtol >= COARSE:
            return found

        def solve(system: ContactSystem, start: ndarray) -> tuple[Contact, ndarray]:
            return self.equations(system, constraints).found(on_line, start)

        def verify(
            system: ContactSystem, exact: ExactRows, contact: Contact, position: ndarray
        ) -> Contact:
            equations = self.equations(system, constraints)
            return equations.verified(on_line, exact, self._rtol, contact, position)

        return with_line_law(self, solve, verify, found)

    def flattened(
        self, constraints: Constraints, flat: ndarray, start: ndarray | None, how: How
    ) -> tuple[Contact, ndarray]:
        """Contact and positions where some cells are flat, (n,) array of bool, and verified."""
        system = self.system
        if flat.any():
            system = flattened_system(system, self.parts, self.cells, flat)
        rows = self.cells.flattened_rows(self.exact_rows, flat)
        equations = self.equations(system, constraints)
        contact, position = equations.found(how, start)
        return equations.verified(how, rows, self._rtol, contact, position), position

    def equations(
        self, system: ContactSystem, constraints: Constraints
    ) -> "GroundEquations | FramedSystem":
        """What a ``system`` of the bodies' cells has to obey under loads."""
        of = GroundEquations if constraints.frame is None else FramedSystem
        return of(system, constraints)


@dataclass(frozen=True, eq=False)
class GroundEquations:
    """Of bodies that nothing but the ground holds."""

    system: ContactSystem
    constraints: Constraints

    def found(self, how: How, start: ndarray | None) -> tuple[Contact, ndarray]:
        """Contact and positions of the bodies, from pressures to begin with."""
        return find_contact(self.system, self.constraints, how, start)

    def verified(
        self, how: How, exact: ExactRows | None, rtol: float, contact: Contact, position: ndarray
    ) -> Contact:
        """The contact, without success where equations, or ``exact`` rows, do not hold."""
        return Verification(self.system, self.constraints, how, exact, rtol)(contact, position)
