"""Whether outlines cross or touch themselves or each other, and which lies in which."""

import numpy as np
from numpy import ndarray

from ..errors import MeshError
from ..grids.planar import cross, near_pairs, rounding
from ..messages import place
from .rings import Ring
from .sides import Sides

#: what is nearer than this part of the extent counts as touching
MARGIN = 1e-11
#: arcs with less bulge meet others as their chords do
NEARLY_STRAIGHT = 3e-5
#: neighbouring sides may meet so near their common corner, over the shorter of them
NEAR_CORNER = 1e-6


def require_simple(rings: list[Ring], names: list[str]) -> None:
    """Refuse rings that cross or touch themselves or each other.

    Raises
    ------
    MeshError
        With the names of the rings and where they meet.
    """
    start, end, bulge = (np.hstack(parts) for parts in zip(*map(_sides_of, rings)))
    # circles of flat arcs are so large that nothing is known of where they meet
    sides = Sides(start, end, np.where(np.abs(bulge) < NEARLY_STRAIGHT, 0.0, bulge))
    ring = np.repeat(np.arange(len(rings)), [len(r.bulges) for r in rings])
    onward = np.concatenate([np.roll(np.nonzero(ring == i)[0], -1) for i in range(len(rings))])
    tolerance = MARGIN * np.ptp(sides.extremes(), axis=1).max() + rounding(sides.start)
    first, second = _candidates(sides, tolerance)
    corner = np.full(len(first), np.nan)
    corner = np.where(onward[first] == second, second, corner)
    corner = np.where(onward[second] == first, first, corner)
    two = (onward[first] == second) & (onward[second] == first)  # both ends in common
    for points in _meetings(sides, first, second):
        met = np.isfinite(points).all(axis=0)
        for side in (first, second):
            met[met] = sides.distance_to(points[:, met], side[met]) <= tolerance
        length = NEAR_CORNER * np.minimum(sides.length[first], sides.length[second])
        for end, common in ((corner, np.isfinite(corner)), (second, two)):
            known = sides.start[:, np.where(common, end, 0).astype(int)]
            met &= ~(common & (np.hypot(*(points - known)) <= length + tolerance))
        if met.any():
            k = int(np.argmax(met))
            a, b = names[ring[first[k]]], names[ring[second[k]]]
            raise MeshError(
                "expected rings that neither cross nor touch themselves or each other, got "
                f"{f'{a} meeting itself' if a == b else f'{a} meeting {b}'} at "
                f"{place(points[:, k])}. Remedy: correct the corners there, or join rings that "
                "touch to one"
            )


def _sides_of(ring: Ring) -> tuple[ndarray, ndarray, ndarray]:
    return ring.sides.start, ring.sides.end, ring.bulges


def _candidates(sides: Sides, tolerance: float) -> tuple[ndarray, ndarray]:
    """Pairs of sides that may meet: their boxes do, or nearly."""
    # half a circle around the middle of the chord, or the whole of one that is more than half
    reach = np.where(np.abs(sides.bulge) > 1, 2 * sides.radius, np.hypot(*sides.chord) / 2)
    reach = np.where(sides.curved, reach, 0.0) + tolerance
    low = np.minimum(sides.start, sides.end) - reach
    high = np.maximum(sides.start, sides.end) + reach
    pairs = list(near_pairs(low, high))
    first, second = (np.concatenate(part) for part in zip(*pairs))
    return first, second


def _meetings(sides: Sides, first: ndarray, second: ndarray) -> list[ndarray]:
    """Points in which pairs of sides may meet: ends, and where their lines or circles do."""
    ends = [end[:, side] for side in (first, second) for end in (sides.start, sides.end)]
    one, other = sides.curved[first], sides.curved[second]
    # the line comes first: for circles that through both points in which they meet
    swapped = one & ~other
    first, second = np.where(swapped, second, first), np.where(swapped, first, second)
    along, base = sides.chord[:, first], sides.start[:, first]
    both = one & other
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        away = sides.centre[:, second] - sides.centre[:, first]
        apart = np.sum(away**2, axis=0)
        share = (apart + sides.radius[first] ** 2 - sides.radius[second] ** 2) / (2 * apart)
        base = np.where(both, sides.centre[:, first] + share * away, base)
        along = np.where(both, np.stack([-away[1], away[0]]), along)
        unit = along / np.hypot(*along)
        offset = sides.centre[:, second] - base
        foot = base + np.sum(offset * unit, axis=0) * unit
        inside = sides.radius[second] ** 2 - np.sum((foot - sides.centre[:, second]) ** 2, axis=0)
        half = np.sqrt(np.maximum(inside, 0.0)) * unit
        chord = sides.chord[:, second]
        straight = base + along * cross(sides.start[:, second] - base, chord) / cross(along, chord)
    any_arc = one | other
    return [*ends, *(np.where(any_arc, foot + sign * half, straight) for sign in (-1, 1))]


def nested(rings: list[Ring]) -> list[tuple[int, list[int]]]:
    """Outlines of parts and their holes: rings that lie in an even number of others, and in odd.

    Parameters
    ----------
    rings : list of Ring
        They do not meet.

    Returns
    -------
    list of (int, list of int)
        Numbers of each outline and of its holes.
    """
    inside = np.array([[_in(a, b) for b in rings] for a in rings])
    level = inside.sum(axis=1)
    parts: dict[int, list[int]] = {int(i): [] for i in np.nonzero(level % 2 == 0)[0]}
    for hole in np.nonzero(level % 2 == 1)[0]:
        around = np.nonzero(inside[hole])[0]
        parts[int(around[np.argmax(level[around])])].append(int(hole))
    return list(parts.items())


def _in(ring: Ring, other: Ring) -> bool:
    """Whether a ring lies in another one, which it does not meet."""
    return ring is not other and bool(other.sides.winding(ring.corners[:, :1])[0])


def require_parts(parts: list[tuple[Ring, tuple[Ring, ...]]], names: list[list[str]]) -> None:
    """Refuse holes outside their outline or in each other, and parts that overlap.

    ``names`` has for each part those of its outline and of its holes.

    Raises
    ------
    MeshError
        With the names of the rings and where.
    """
    for (outline, holes), (name, *hole_names) in zip(parts, names):
        for i, hole in enumerate(holes):
            where = place(hole.corners[:, 0])
            if not _in(hole, outline):
                raise MeshError(
                    f"expected {hole_names[i]}, near {where}, to lie inside {name}. Remedy: leave "
                    "it out, or correct its corners"
                )
            for j, other in enumerate(holes):
                if _in(hole, other):
                    raise MeshError(
                        f"expected {hole_names[i]}, near {where}, to lie outside {hole_names[j]}. "
                        "Remedy: leave it out, or make it a part of its own"
                    )
    for i, (outline, _) in enumerate(parts):
        for j, (other, holes) in enumerate(parts):
            if _in(outline, other) and not any(_in(outline, hole) for hole in holes):
                raise MeshError(
                    f"expected parts that do not overlap, got {names[i][0]}, near "
                    f"{place(outline.corners[:, 0])}, within {names[j][0]}. Remedy: make it a "
                    "hole, or leave it out"
                )
