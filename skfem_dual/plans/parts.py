"""The parts of a plan, each an outline with its holes: what they must be, and their measures."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from ..arguments import checked_sequence
from ..errors import MeshError
from ..grids.curves import require_digits
from ..grids.planar import convex_hull
from ..grids.polygons import readonly
from ..messages import shown
from .crossings import nested, require_parts, require_simple
from .rings import SMOOTH, Ring

#: outline and holes, counter-clockwise
Part = tuple[Ring, tuple[Ring, ...]]


class Parts(NamedTuple):
    """All parts of a plan together; its measures are described in `Plan`."""

    each: tuple[Part, ...]

    @classmethod
    def checked(cls, value: Any) -> "Parts":
        """A sequence of parts, each as it should be.

        Raises
        ------
        TypeError
            If it is no sequence, or something in it is no part.
        ValueError
            If there is none.
        MeshError
            If they are too far from (0, 0) for their size.
        """
        parts = tuple(map(_part, checked_sequence("parts", value)))
        if not parts:
            raise ValueError("expected at least one part, got none")
        found = cls(parts)
        require_digits(found.bounds)
        return found

    @classmethod
    def from_rings(cls, rings: tuple[Ring, ...]) -> "Parts":
        """Of rings in any order: what lies in an odd number of others is a hole.

        Raises
        ------
        MeshError
            If there is none, or their sides cross or touch.
        """
        if not rings:
            raise MeshError("expected at least one ring, got none")
        require_simple(list(rings), [f"ring {i}" for i in range(len(rings))])
        found = nested(list(rings))
        return cls(tuple((rings[i], tuple(rings[h] for h in holes)) for i, holes in found))

    def require_apart(self) -> None:
        """Refuse rings that cross or touch, holes that are not inside and parts that overlap.

        Raises
        ------
        MeshError
            With the names of the rings and where.
        """
        names = self._names()
        require_simple(self.rings, [name for part in names for name in part])
        require_parts(list(self.each), names)

    def _names(self) -> list[list[str]]:
        """What the rings are called in messages."""
        several = len(self.each) > 1
        return [
            [
                f"the outline of part {i}" if several else "the outline",
                *(f"hole {h}" + f" of part {i}" * several for h in range(len(holes))),
            ]
            for i, (_, holes) in enumerate(self.each)
        ]

    def only_ring(self, name: str) -> Ring:
        """The ring, if there is no other, or a ValueError."""
        ring, *others = self.rings
        if others:
            holes = len(self.rings) - len(self.each)
            raise ValueError(
                f"expected a Plan of one part without holes for {name}, got {len(self.each)} "
                f"parts with {holes} holes"
            )
        return ring

    @property
    def rings(self) -> list[Ring]:
        """Outline and holes, part by part."""
        return [ring for outline, holes in self.each for ring in (outline, *holes)]

    @property
    def signed(self) -> list[tuple[int, Ring]]:
        """The rings, each with the sign by which it counts: -1 of holes."""
        return [
            (sign, ring)
            for outline, holes in self.each
            for sign, ring in ((1, outline), *((-1, hole) for hole in holes))
        ]

    @property
    def area(self) -> float:
        """Area."""
        return float(sum(sign * ring.area for sign, ring in self.signed))

    @property
    def centroid(self) -> ndarray:
        """Centre of area, shape (2,)."""
        middle = self.bounds.mean(axis=1)
        moments = sum(
            sign * (ring.first_moments - ring.area * middle) for sign, ring in self.signed
        )
        return readonly(middle + moments / self.area)

    @property
    def bounds(self) -> ndarray:
        """Lower left and upper right corner as columns, shape (2, 2)."""
        boxes = np.hstack([outline.box for outline, _ in self.each])
        return readonly(np.stack([boxes.min(axis=1), boxes.max(axis=1)], axis=1))

    @property
    def hull(self) -> ndarray:
        """Corners of the convex hull, shape (2, k)."""
        sides = [outline.sides for outline, _ in self.each]
        points = np.hstack([part for s in sides for part in (s.around(), s.extremes())])
        return readonly(convex_hull(points))

    @property
    def corners(self) -> ndarray:
        """Corners of all rings, where their direction changes; shape (2, k)."""
        return readonly(np.hstack([r.corners[:, np.abs(r.turns) > SMOOTH] for r in self.rings]))

    @property
    def corner_angles(self) -> ndarray:
        """Angles inside in the corners, shape (k,)."""
        angles = [
            np.pi - sign * ring.turns[np.abs(ring.turns) > SMOOTH] for sign, ring in self.signed
        ]
        return readonly(np.concatenate(angles))

    def contains(self, x: ndarray) -> ndarray:
        """Whether points of shape (2, ...) lie inside."""
        flat = x.reshape(2, -1)
        inside = sum(sign * ring.sides.winding(flat) for sign, ring in self.signed)
        return np.asarray(inside > 0).reshape(x.shape[1:])

    def mapped(self, move: Callable[[ndarray], ndarray]) -> tuple[Part, ...]:
        """The parts with all corners moved, and the bulges they have."""

        def moved(ring: Ring) -> Ring:
            return Ring(readonly(move(ring.corners)), ring.bulges)

        return tuple((moved(o), tuple(map(moved, holes))) for o, holes in self.each)

    @property
    def kinds_of_sides(self) -> str:
        """How many sides there are of each kind, as "8 straight, 1 circle"."""
        circles = sum(ring.is_circle for ring in self.rings)
        others = [ring for ring in self.rings if not ring.is_circle]
        arcs = sum(int(np.count_nonzero(ring.sides.curved)) for ring in others)
        straight = sum(len(ring.bulges) for ring in others) - arcs
        counts = {"straight": straight, "arc": arcs, "circle": circles}
        kinds = [
            f"{count} {word}{'s' * (count != 1 and word != 'straight')}"
            for word, count in counts.items()
            if count
        ]
        return ", ".join(kinds)


def _part(value: Any) -> Part:
    """A part as it should be."""
    match value:
        case [Ring() as outline, [*holes]] if all(isinstance(hole, Ring) for hole in holes):
            return outline, tuple(holes)
    raise TypeError(
        "expected a Ring and a tuple of Rings, its holes, for each of the parts of a Plan, got "
        f"{shown(value)}. Remedy: Plan.from_polygon(corners)"
    )
