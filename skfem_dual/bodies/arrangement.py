"""How rigid punches stand together: which are one body, where they touch, what a frame on them
takes, and so what loads impose on them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ..arguments import checked_sequence
from ..contact.load import Constraints, Load, Share, load_of
from ..contact.parts import Part
from ..grids.outline import edge_ribs
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .frame import about_centroids, about_origin, ground_stiffness
from .joined import bodies_of, free_of, free_ribs
from .punch import RigidPunch


@dataclass(frozen=True, eq=False)
class Arrangement:
    """Punches on one ground.

    Attributes
    ----------
    punches : tuple of RigidPunch
        The punches.
    joined : tuple of tuple of int
        Numbers of those that are joined rigidly.
    stiffness : (3 m, 3 m) array of float or None
        Of a frame on the m bodies, against positions of their origins.
    names : tuple of str
        What messages call the punches.
    """

    punches: Sequence[RigidPunch]
    joined: Sequence[Sequence[int]]
    stiffness: ndarray | None = None
    names: Sequence[str] = ()

    @computed_once
    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the punches of each body, in the order of their first ones."""
        return bodies_of([tuple(group) for group in self.joined], len(self.punches))

    @computed_once
    def members(self) -> tuple[RigidPunch, ...]:
        """The punches as they stand: with a singular edge only where they touch no other of their
        body."""
        found = list(self.punches)
        for body in self.bodies:
            parts = [self.punches[i].partition for i in body]
            for i in body:
                found[i] = free_of(self.punches[i], parts)
        return tuple(found)

    @computed_once
    def edges(self) -> list[ndarray | None]:
        """Ribs at which punches touch no other of their body; None where there is no other."""
        found: list[ndarray | None] = [None] * len(self.punches)
        for body in (body for body in self.bodies if len(body) > 1):
            parts = [self.punches[i].partition for i in body]
            for i, own in zip(body, parts, strict=True):
                found[i] = free_ribs(own, edge_ribs(own), parts)
        return found

    @computed_once
    def parts(self) -> tuple[Part, ...]:
        """The punches, one after the other."""
        body_of = {i: number for number, body in enumerate(self.bodies) for i in body}
        return tuple(
            Part(punch.footprint, body_of[i], self.centres[body_of[i]])
            for i, punch in enumerate(self.members)
        )

    @computed_once
    def centres(self) -> tuple[ndarray, ...]:
        """Centroid of each body, to which its position refers."""
        weighed = [(p.centre, p.partition.areas.sum()) for p in self.members]
        return tuple(
            readonly(
                sum(weighed[i][0] * weighed[i][1] for i in body) / sum(weighed[i][1] for i in body)
            )
            for body in self.bodies
        )

    def loads_of(self, name: str, loads: Sequence[Load | Mapping]) -> tuple[Load, ...]:
        """One load for each body, a TypeError or ValueError if it is something else."""
        loads = checked_sequence(name, loads)
        if len(loads) != len(self.bodies):
            raise ValueError(
                f"expected one load for each of the {len(self.bodies)} bodies, got "
                f"{len(loads)} in {name}"
            )
        return tuple(load_of(f"{name}[{number}]", load) for number, load in enumerate(loads))

    def share_of(self, number: int, load: Load) -> Share:
        """What its punches take of the load of a body, with a position yet to be found."""
        first = self.members[self.bodies[number][0]]
        names = tuple(self.names[i] for i in self.bodies[number])
        return Share(settlement=0.0, tilt=(0, 0), body=load, names=names, origin=first.origin)

    def taken_by(self, i: int, cases: Sequence[tuple[Load, ...]]) -> list[Load]:
        """Of the loads of all bodies in each case that of the body of a punch, or its share."""
        number = self.parts[i].body
        own = [case[number] for case in cases]
        if len(self.bodies[number]) > 1:  # what each of them takes is found
            return [self.share_of(number, load) for load in own]
        return own

    def imposed(self, loads: tuple[Load, ...]) -> Constraints:
        """What the loads of all bodies impose, and the frame."""
        own = zip(self.loads_of("loads", loads), self.origins, strict=True)
        parts = [load.constraints(origin) for load, origin in own]
        if self.stiffness is not None:
            each = zip(parts, self.origins, self.bodies, strict=True)
            parts = [about_origin(p, origin, self._width(body)) for p, origin, body in each]
        together, ground = Constraints.together(parts), self.ground_stiffness
        return replace(together, frame=self._frame, ground=ground)

    def _width(self, body: Sequence[int]) -> float:
        """How wide a body is, about."""
        return float(np.sqrt(self._area(body)))

    def _area(self, body: Sequence[int]) -> float:
        return float(sum(self.punches[i].partition.areas.sum() for i in body))

    @property
    def ground_stiffness(self) -> ndarray:
        """About how stiff the ground is against the positions of the bodies."""
        areas = np.array([self._area(body) for body in self.bodies])
        return ground_stiffness(areas, self.punches[0].substrate.surface.contact_modulus)

    @computed_once
    def _frame(self) -> ndarray | None:
        """The stiffness of the frame, which refers to origins, to positions about centroids."""
        return None if self.stiffness is None else about_centroids(self.stiffness, self.origins)

    @property
    def origins(self) -> list[ndarray]:
        """Those of the bodies, from the points to which their positions refer."""
        own = zip(self.bodies, self.centres, strict=True)
        return [self.members[body[0]].origin - centre for body, centre in own]
