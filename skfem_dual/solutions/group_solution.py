"""Pressures under several punches and their positions."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import place_among
from ..contact.by_work import Beside, Member
from ..contact.load import Load
from ..contact.pressed import Pressed
from ..contact.problem import Contact
from ..kernels.once import ReadOnly, computed_once
from ..messages import shortened
from .elastic_solution import ElasticSolution
from .punch_solution import PunchSolution


@dataclass(frozen=True, eq=False, repr=False)
class PunchesSolution:
    """Pressures under several punches and their positions.

    Attributes
    ----------
    punches : RigidPunches or Punches
        The problem solved.
    solutions : tuple of PunchSolution or ElasticSolution
        One for each punch.
    """

    punches: Any
    solutions: tuple[Any, ...]

    def __getitem__(self, punch: int | str) -> Any:
        """Of a punch by its number or its name."""
        return self.solutions[place_among(self.punches.names, "punch", punch)]

    def __len__(self) -> int:
        return len(self.solutions)

    @property
    def success(self) -> bool:
        """Whether the contact regions were found."""
        return all(s.success for s in self.solutions)

    @property
    def message(self) -> str:
        """What the solver says; of those that were not found, each once."""
        said = [s.message for s in self.solutions if s.success == self.success]
        return "; ".join(dict.fromkeys(said))

    @property
    def iterations(self) -> int:
        """Iterations in which they were found."""
        return max(s.iterations for s in self.solutions)

    @property
    def force(self) -> ndarray:
        """Resultant of each body, shape (nbodies,)."""
        return np.array([sum(self[i].force for i in body) for body in self.punches.bodies])

    @property
    def frame_forces(self) -> ndarray:
        """Forces and moments about the origins that the frame takes from the loads.

        `K s`; where force and moments are imposed on a body what these leave, as under a stiff
        frame hardly a digit is left of `K s`.

        Returns
        -------
        (nbodies, 3) array of float
            Load of each body less the resultant of its pressures; zero without a frame.
        """
        first = [self[body[0]] for body in self.punches.bodies]
        if self.punches.stiffness is None:
            return np.zeros((len(first), 3))
        positions = np.array([s.positions[0] for s in first])
        taken = (self.punches.stiffness @ positions.ravel()).reshape(positions.shape)
        framed = _framed(self.punches)
        for own, body, held in zip(taken, self.punches.bodies, framed, strict=True):
            share = self[body[0]].load
            if not held or (load := share.body).force is None or load.tilt is not None:
                continue
            own[:] = [load.force, *load.moments_of(load.force)]
            for i in body:
                force, *moments = self[i].resultant
                arm = np.array(self[i].footprint.origin) - share.origin
                own -= [force, *(moments + force * arm)]
        return taken

    def ground_displacement(self, x: ArrayLike) -> ndarray:
        """Settlement of the ground at points of shape (2, ...), under all punches.

        Positive into the ground.

        Raises
        ------
        TypeError, ValueError
            As `PunchSolution.ground_displacement`.
        """
        return self[0].ground_displacement(x)

    def displacement(self, x: ArrayLike) -> ndarray:
        """The same as `ground_displacement`."""
        return self.ground_displacement(x)

    def __repr__(self) -> str:
        names = [shortened(name, 14) for name in self.punches.names]
        width = max(7, *(len(name) + 2 for name in names))
        head = (
            f"  {'punch':<{width}}force        settlement   tilt                      contact area"
        )
        rows = [
            f"  {name:<{width}}{s.force:<13.6g}{how_moved(s):<39}{s.contact_area:.6g}"
            for name, s in zip(names, self.solutions, strict=True)
        ]
        return "\n".join(["<skfem_dual PunchesSolution object>", head, *rows])

    def plot(self, **options: Any) -> Any:
        """The same as `PunchSolution.plot`, under all punches."""
        from ..visuals.matplotlib import isobars

        return isobars(self, **options)

    def _repr_html_(self) -> str:
        from ..visuals.notebook import group_html

        return group_html(self)


def _framed(punches: Any) -> ndarray:
    """Which bodies a frame holds, (nbodies,) array of bool."""
    if punches.stiffness is None:
        return np.zeros(len(punches.bodies), dtype=bool)
    return np.asarray(punches.stiffness.any(axis=1).reshape(-1, 3).any(axis=1))


def how_moved(solution: PunchSolution | ElasticSolution) -> str:
    """Settlement and tilt of a rigid punch, or how far one that bends has gone."""
    if isinstance(solution, ElasticSolution):
        least, most = solution.deflection_range
        return f"{least:.6g} to {most:.6g}, bends"
    tilt = solution.tilt
    return f"{solution.settlement:<13.6g}({tilt[0]:.4g}, {tilt[1]:.4g})"


@dataclass(frozen=True, eq=False)
class GroupAnswer(ReadOnly):
    """Positions of all bodies of a group by the work of the pressures, computed on demand.

    Attributes
    ----------
    group : RigidPunches
        The group.
    loads : tuple of Load
        What was imposed on its bodies.
    contact : Contact
        What was found.
    position : (m,) array of float
        By collocation.
    elsewhere : dict
        Takes the solutions on other grids, for `Bounds`.
    """

    group: Any
    loads: tuple[Load, ...]
    contact: Contact
    position: ndarray
    elsewhere: dict[tuple[str, str], PunchesSolution] = field(default_factory=dict)

    @computed_once
    def positions(self) -> ndarray | None:
        """Those of the bodies one after the other, see `Work.positions`; shape (2, 3 nbodies)."""
        if self.group.by_work.amid_many(self.contact):
            added = self.group.by_work.added_amid(self.contact, self.position)
            return self.group.arrangement.imposed(self.loads).keeping(self.position + added)
        if not self.group.works(self.contact):
            return None
        return self.group.work.positions(self.group.arrangement.imposed(self.loads), self.contact)


def answers_of(
    punches: Any,
    loads: tuple[Load, ...],
    contact: Contact,
    position: ndarray,
    timings: dict[str, float],
) -> tuple[PunchSolution, ...]:
    """Those of each punch, from contact and positions of all."""
    parts = [contact.under(cells, i) for i, cells in enumerate(punches.slices)]
    others = tuple(map(Pressed.of, punches.members, parts))
    solutions = {}
    together = None
    if all(punch.gap is None for punch in punches.members):
        together = GroupAnswer(punches, loads, contact, position)
    for number, (body, held) in enumerate(zip(punches.bodies, _framed(punches), strict=True)):
        moved = position[3 * number : 3 * number + 3]
        for i in body:
            punch = punches.members[i]
            own = moved.copy()
            own[0] += moved[1:] @ (punch.centre - punches.centres[number])
            settlement = own[0] + own[1:] @ (punch.origin - punch.centre)
            # joined punches and those under a frame have a position, not a load, of their own
            load = loads[number]
            if len(body) > 1 or held:
                found = {"settlement": float(settlement), "tilt": tuple(own[1:].tolist())}
                load = replace(punches.arrangement.share_of(number, load), **found)
            around = others[:i] + others[i + 1 :]
            member: Member | Beside | None = None
            if together is not None:
                member = Member(together, number, punch.origin - punches.centres[number])
            elif number in punches.by_work.beside_shaped:
                member = Beside(punch, load, parts[i], own, around)
            solutions[i] = PunchSolution.from_contact(
                punch, load, parts[i], own, punch.timings | timings, around, member
            )
    return tuple(solutions[i] for i in range(len(punches.members)))
