"""Punches beside each other: that they do not overlap, and loads that they can bear."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy import ndarray
from skfem import CellBasis, ElementTriP0, MeshTri

from ..arguments import checked_choice, checked_instance, checked_sequence, checked_text
from ..contact.footprint import hulls
from ..contact.load import Load, require_compression, require_vertical
from ..errors import ResolutionWarning, warn
from ..grids.cellwise import nodal_mesh
from ..grids.checks import check_type
from ..grids.dual_mesh import DualMesh
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..grids.planar import covered_twice, directed_sides
from ..grids.polygons import some
from ..ground.periodic import PeriodicGround
from ..ground.substrates import Substrate, checked_substrate
from ..kernels.once import computed_in
from ..solutions.group_solution import PunchesSolution
from .arrangement import Arrangement
from .punch import RigidPunch

#: sizes of cells over the distance of a neighbour's centre from which on its tilt is off by a
#: hundredth, beside a circle; where they are twice as large it is a tenth
COARSE = 2.0


def punches_on(
    substrate: Substrate,
    mesh: MeshTri,
    names: Sequence[str] | None,
    grid: Literal["dual", "triangles"],
) -> tuple[list[str], list[RigidPunch]]:
    """Names of subdomains and a flat punch on each, as `RigidPunches.from_subdomains`.

    Raises
    ------
    TypeError, ValueError
        If an argument is not what it must be, or a subdomain does not exist.
    """
    checked_substrate(substrate)
    check_type(mesh)
    checked_choice("grid", grid, ("dual", "triangles"))
    known = sorted(mesh.subdomains or {})
    if not known:
        raise ValueError(
            "expected a mesh with subdomains, got one without. Remedy: "
            "mesh.with_subdomains({name: elements})"
        )
    names = known if names is None else checked_sequence("names", names)
    names = [checked_text("names", name) for name in names]
    missing = [name for name in names if name not in known]
    if missing or not names:
        raise ValueError(
            f"expected names of subdomains of the mesh, {known}, got {missing or 'none'}"
        )
    empty = [name for name in names if not len((mesh.subdomains or {})[name])]
    if empty:
        raise ValueError(
            f"expected elements in each subdomain, got none in {empty}. Remedy: leave it out of "
            "names="
        )
    return names, [_punch_on(substrate, mesh.restrict(name), grid) for name in names]


def _punch_on(
    substrate: Substrate, mesh: MeshTri, grid: Literal["dual", "triangles"]
) -> RigidPunch:
    """A flat punch on the whole of a mesh, its origin at the centroid of its plan."""
    dual = grid == "dual"
    basis = DualMesh.from_mesh(mesh).basis() if dual else CellBasis(mesh, ElementTriP0())
    centre = Partition.from_basis(basis).centre
    return RigidPunch(substrate, basis, origin=tuple(centre.tolist()))


def over_edges(
    group: Any,
    pressure: ndarray,
    known: dict[tuple[bool, ...], Any],
    edges: Sequence[ndarray | None] | None = None,
) -> Any:
    """Bodies with the edges of flat punches where shaped ones press over that of their plan.

    Parameters
    ----------
    group : RigidPunches or Punches
        The bodies.
    pressure : (n,) array of float
        Mean pressures of all cells.
    known : dict
        Such groups, by which of their bodies press over; takes a new one.
    edges : sequence of (k,) array of int, optional
        The ribs of each that are the edge; by default, and where there is None, all around.

    Returns
    -------
    RigidPunches or Punches, or None
        None if none of them presses over it.
    """
    each = zip(group.punches, group.slices, edges or [None] * len(group.punches), strict=True)
    over = [punch.over_edge(pressure[own], ribs) for punch, own, ribs in each]
    which = tuple(punch is not None for punch in over)
    if not any(which):
        return None
    punches = [sharp or punch for sharp, punch in zip(over, group.punches, strict=True)]
    return computed_in(known, which, lambda: replace(group, punches=punches))


def pressures_of(members: Sequence[RigidPunch], start: PunchesSolution | None) -> ndarray | None:
    """Those of the cells of all punches in a solution to begin with, of as many punches."""
    if start is None:
        return None
    checked_instance("start", start, PunchesSolution)
    if len(start.solutions) != len(members):
        raise ValueError(
            f"expected a solution of {len(members)} punches for start, got one of "
            f"{len(start.solutions)}"
        )
    parts = zip(members, start.solutions, strict=True)
    return np.concatenate([punch.pressures_of(part) for punch, part in parts])


def require_one_ground(punches: Sequence[Any], names: Sequence[str]) -> None:
    """Refuse bodies on different substrates, and on ground with a period."""
    if isinstance(punches[0].substrate, PeriodicGround):
        raise ValueError(
            "expected bodies on ground without a period, got a PeriodicGround. Remedy: one "
            "RigidPunch on all cells, with a gap that is the shape of all of them"
        )
    for name, punch in zip(names, punches, strict=True):
        if punch.substrate != punches[0].substrate:
            raise ValueError(
                f"expected all punches on one substrate, got {punches[0].substrate} under "
                f"punch {names[0]} and {punch.substrate} under punch {name}. Remedy: make the "
                "ground once for all punches"
            )


def require_apart(punches: Sequence[Any], names: Sequence[str]) -> None:
    """Refuse plans that overlap; they may touch."""
    points: list[ndarray] = []
    facets, inside, owner = [], [], []
    for number, punch in enumerate(punches):
        mesh = nodal_mesh(punch.basis)
        outer = mesh.boundary_facets()
        sides, middles = directed_sides(mesh, outer)
        facets.append(sum(p.shape[1] for p in points) + sides)
        points.append(mesh.p)
        inside.append(middles)
        owner.append(np.full(len(outer), number))
    bad = covered_twice(np.hstack(points), np.hstack(facets), np.hstack(inside))
    if len(bad):
        x = np.hstack(inside)[:, bad]
        around = [i for i, punch in enumerate(punches) if (punch.fan.locate(x) >= 0).any()]
        called = [names[i] for i in np.union1d(np.concatenate(owner)[bad], around)]
        raise ValueError(
            f"expected plans that do not overlap, got punches {some(called)} that do. Remedy: "
            "move them apart"
        )


def tell_of_coarse(group: Any) -> None:
    """Warn of cells that are too large for a small body of a group beside them."""
    cells = [punch.partition for punch in group.punches]
    ribs = [edge_ribs(own) for own in cells]
    of = np.repeat(np.arange(len(cells)), [len(own) for own in ribs])
    each = list(zip(cells, ribs, strict=True))
    size = np.concatenate([np.sqrt(own.areas[own.f2c[0, edge]]) for own, edge in each])
    begin, end = np.concatenate([own.ends(edge) for own, edge in each], axis=-1)
    along = end - begin
    square = np.sum(along**2, axis=0)
    worst, beside = COARSE, (0, 0)
    for body in group.bodies:
        arm = _middle([cells[i] for i in body])[:, None] - begin
        foot = (np.sum(arm * along, axis=0) / square).clip(0, 1)
        distance = np.hypot(*(arm - foot * along))
        distance[np.isin(of, body)] = np.inf  # of joined ones the centre may lie on their edges
        ratio = size / distance
        if ratio.max() > worst:
            worst, beside = ratio.max(), (int(of[np.argmax(ratio)]), body[0])
    if worst > COARSE:
        large, small = (group.names[i] for i in beside)
        warn(
            f"cells of punch {large} beside punch {small} are {worst:.2g} times as large as the "
            f"distance of its centre from them: the tilt of punch {small} may be off by some "
            f"hundredths. Remedy: cells of punch {large} that become smaller towards it",
            ResolutionWarning,
        )


def _middle(body: Sequence[Partition]) -> ndarray:
    """The centre of a plan, or of its cell next to that where it lies in a hole or a bay."""
    x = np.concatenate([cells.centroids for cells in body], axis=1)
    areas = np.concatenate([cells.areas for cells in body])
    centre = x @ areas / areas.sum()
    off = np.hypot(*(x - centre[:, None]))
    nearest = np.argmin(off)
    radius = np.concatenate([cells.polygons.radii for cells in body])[nearest]
    return centre if off[nearest] <= radius else x[:, nearest]


class Numbers(tuple):
    """Names that follow from how many punches there are, which they do anew where others are
    given: `dataclasses.replace` hands on what stands in the fields."""


def checked_names(names: Sequence[str], n: int) -> tuple[str, ...]:
    """What messages call n punches: names that differ, or their numbers if there are none.

    Raises
    ------
    TypeError, ValueError
        If these are no names, not as many, or two are the same.
    """
    called = tuple(checked_text("names", name) for name in checked_sequence("names", names))
    if not called or isinstance(names, Numbers):
        called = Numbers(map(str, range(n)))
    if len(called) != n or len(set(called)) < n:
        raise ValueError(f"expected {n} names that differ, one for each punch, got {called}")
    return called


def require_balance(together: Arrangement, loads: Sequence[Load], unilateral: bool) -> None:
    """Refuse loads of the bodies of a group that are not vertical or, on ground that does not
    pull, that no pressures can balance."""
    for body, load, centre, origin in zip(
        together.bodies, loads, together.centres, together.origins, strict=True
    ):
        called = "body " + "+".join(together.names[i] for i in body)
        require_vertical(called, load)
        if not unilateral:
            continue
        if load.force == 0 and len(together.bodies) > 1:
            raise ValueError(
                f"{called}: expected a positive force, got 0. Remedy: leave out bodies without a "
                "load, or give them their weight"
            )
        members = [together.punches[i] for i in body]
        around = hulls([punch.footprint for punch in members], centre)
        try:
            require_compression(load, origin, around, all(p.gap is None for p in members))
        except ValueError as error:
            raise ValueError(f"{called}: {error}") from None


def interaction_factors(
    group: Any, loads: Sequence[Load | Mapping], options: dict[str, Any]
) -> ndarray:
    """Settlements of bodies over those of each alone, see `RigidPunches.interaction_factors`."""
    if group.stiffness is not None:
        raise ValueError(
            "expected punches without a frame, which leaves none of them alone. Remedy: "
            "RigidPunches without stiffness="
        )
    loads = checked_sequence("loads", loads)
    together = group.solve(loads, **options)
    options.pop("start", None)
    factors = []
    for body, load in zip(group.bodies, loads, strict=True):
        joined = [tuple(range(len(body)))] if len(body) > 1 else ()
        alone = type(group)([group.punches[i] for i in body], joined).solve([load], **options)
        if alone[0].settlement == 0:
            raise ValueError(
                "expected loads that settle each body, got one without a settlement on punch "
                f"{group.names[body[0]]}: there is nothing to compare"
            )
        factors.append(together[body[0]].settlement / alone[0].settlement)
    return np.array(factors)
