"""The ground below a footing: stress, strain and settlement with depth, and what layers yield."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..arguments import Pair
from ..errors import warnings_kept
from ..ground.stratified import Stratified
from ..ground.substrates import HalfSpace
from ..solutions.below import Profile, pushed, settlement_by_layers, vertical_profile
from ..solutions.pressures import CellPressures
from .details import Details
from .figures import profile_picture
from .footing import Footing
from .page import (
    NONE,
    Html,
    amount,
    figure,
    joined,
    number,
    percent,
    placed,
    section,
    table,
    titled,
)

#: depths of the profile, over the greater extent of the plan; a rigid base takes the last place
DEPTHS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0])
#: an interface is looked at on both sides, below it deeper by this part
JUST_BELOW = 1e-6
#: depths between which ground without layers is looked at, over the same
PARTS = np.array([0.5, 1.0, 2.0])
#: steps of the drawing between two of the depths
STEPS = 4


class Below(NamedTuple):
    """What a report tells of the ground below a footing.

    Attributes
    ----------
    profile : Profile
        Over the depth.
    curve : Profile
        The same at more depths, for a drawing.
    depths : (k,) array of float
        Where one part of the ground ends and the next begins, interfaces if there are any.
    parts : (k + 1,) array of float
        What each part of the ground contributes to the settlement of the surface.
    bottom : float
        Where the last one ends: at a rigid base, or infinite.
    """

    profile: Profile
    curve: Profile
    depths: ndarray
    parts: ndarray
    bottom: float


def governing_solution(footing: Footing) -> CellPressures | None:
    """The solution of the governing case, if there is one."""
    return footing.cases.solutions[footing.governing]


def below(solution: CellPressures | None, at: Pair | None) -> Below | None:
    """At a point, or else the plan's centroid.

    None if only the surface of the ground is known, or nothing presses on it.
    """
    if solution is None or not solution.pressure.any():
        return None
    footprint = solution.footprint
    ground = footprint.substrate
    if not isinstance(ground, (HalfSpace, Stratified)):
        return None
    if at is None:
        at = tuple(footprint.centre.tolist())
    extent = footprint.partition.extent
    interfaces = ground.strata.interfaces
    lowest = min(DEPTHS[-1] * extent, interfaces[-1])
    inside = interfaces[interfaces < lowest]
    both = np.append(inside, (1 + JUST_BELOW) * inside)
    even = ground.strata.on_interfaces(DEPTHS / DEPTHS[-1] * lowest)
    depths = np.union1d(even, both)
    numbers = np.arange(1, STEPS * len(depths) + 1) / STEPS
    closer = np.interp(numbers, np.arange(len(depths) + 1), [0.0, *depths])
    finite = interfaces[:-1]
    parted = finite if len(finite) else PARTS / DEPTHS[-1] * lowest
    with warnings_kept():  # pages say that horizontal loads are left out
        profile = vertical_profile(solution, at, depths)
        curve = vertical_profile(solution, at, closer)
        parts = settlement_by_layers(solution, np.reshape(at, (2, 1)), parted)[:, 0]
    return Below(profile, curve, parted, parts, float(interfaces[-1]))


def depth_of_footing(footing: Footing) -> Html:
    """In its governing case."""
    case = footing.cases.names[footing.governing]
    return depth_section(governing_solution(footing), footing.details, footing.name, case)


def depth_section(
    solution: CellPressures | None, details: Details, name: str = "", case: str = "load"
) -> Html:
    """Stress, strain and settlement with depth."""
    found = below(solution, details.profile)
    if solution is None or found is None:
        return NONE
    profile, units = found.profile, details.units
    stress, sink = units.pressure, units.displacement
    rows = [
        (number(z), amount(s, stress), number(e, 4), amount(w, sink))
        for z, s, e, w in zip(
            profile.depth, profile.stresses.sigma_z, profile.strain, profile.displacement[2]
        )
    ]
    head = (
        f"Depth [{units.length.symbol}]",
        f"Vertical stress [{stress.symbol}]",
        "Vertical strain",
        f"Settlement [{sink.symbol}]",
    )
    bounds = np.array([0.0, *found.depths, found.bottom])
    shares = [
        (
            f"{top:.4g} – {end:.4g}" if np.isfinite(end) else f"below {top:.4g}",
            amount(part, sink),
            percent(part / found.parts.sum()),
        )
        for top, end, part in zip(bounds, bounds[1:], found.parts, strict=False)
    ]
    extent = solution.footprint.partition.extent
    where = joined(["below the point ", placed(profile.x, extent)])
    plain = "below the centroid of the plan" if details.profile is None else "at depth"
    return section(
        titled("Stress with depth", name),
        table(rows, head, "", numeric=True),
        figure(
            profile_picture(found.curve, units),
            f"Stresses, strain and settlement {plain}",
            joined(
                ["Stresses, vertical strain and settlement ", where,
                 ", without the ground's own weight",
                 " and the horizontal load" if pushed(solution) else "",
                 f", in the case {case}. Interfaces of "
                 "layers are there twice, above and below."]
            ),
        ),
        table(
            shares,
            (f"Depth [{units.length.symbol}]", f"Shortening [{sink.symbol}]", "Share"),
            "What the ground contributes to the settlement of its surface there",
            numeric=True,
        ),
    )  # fmt: skip
