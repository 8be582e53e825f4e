"""The edge of a plan, or the part of it that is named, and weights that grow towards it."""

from collections.abc import Sequence

import numpy as np
from numpy import ndarray
from skfem import CellBasis

from ..arguments import checked_indices, checked_text
from ..elements.edge_weights import EdgeWeights
from ..grids.cellwise import nodal_mesh
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..ground.seen import even_at_edge, seen_by
from ..ground.stratified import Stratified
from ..ground.substrates import Substrate
from ..messages import shown
from .problem import DOZEN, Contact

EdgeBoundaries = str | Sequence[str] | Sequence[int] | ndarray

#: part of the cells in contact that has contact all around: where less has, as on rough shapes, no
#: law of a line or of an edge holds, and pressures are up to twice as far off with one
INNER = 0.4
#: and part up to which contact is hardly wider than a cell: 0 to 0.1 on crusts, 0.2 and more where
#: punches on homogeneous ground lift off
NARROW = 0.15
#: and part on the edge, or next to it, from which on it is a strip along that
ALONG = 0.75
#: part of the load on the cells at the edge up to which it does not matter that pressures grow
#: there; it falls like the root of their size
COUNTS = 0.01
#: how many times as much as constant cells others pull beside a crust where they fail: discs of
#: 300 and 1000 nodes, dual cells and triangles, on crusts of 20 to 10 000 times what is below
BEYOND = 1.2


def grows_to_edge(substrate: Substrate, basis: CellBasis) -> bool:
    """Whether pressures under a flat base grow to the edge of the plan inside cells by a law."""
    if not isinstance(substrate, Stratified):
        return True
    cells = Partition.from_basis(basis)
    return not even_at_edge(substrate, cells.areas[cells.f2c[0, edge_ribs(cells)]])


def weights_of(
    substrate: Substrate, basis: CellBasis, partition: Partition, boundaries: EdgeBoundaries | None
) -> EdgeWeights:
    """Weights that grow to the edge of the plan, or to the part of it on some boundaries."""
    ribs = edge_ribs(partition)
    if boundaries is not None:
        ribs = ribs[np.isin(partition.boundary[ribs], _named_facets(basis, boundaries))]
        if len(ribs) == 0:
            raise ValueError(
                f"expected boundaries with facets on the edge of the plan, got {boundaries!r}. "
                'Remedy: edge="constant" if there is no such edge'
            )
    seen = seen_by(substrate, partition.areas[partition.f2c[0, ribs]])
    return EdgeWeights.from_basis(basis, partition, ribs, seen)


def inner_share(partition: Partition, inside: ndarray, others: ndarray | None = None) -> float:
    """Part of the cells in contact, (n,) array of bool, that has contact all around; with some
    ``others`` among these."""
    inner = inside.copy()
    inner[partition.across(inside)] = False
    inner = inner if others is None else inner | others
    return float(inner.sum() / max(inside.sum(), 1))


def _rim(partition: Partition, ribs: ndarray) -> ndarray:
    """Cells on some ribs of the edge of a plan, (n,) array of bool."""
    rim = np.zeros(len(partition), dtype=bool)
    rim[partition.f2c[0, ribs]] = True
    return rim


def _ending(partition: Partition, inside: ndarray, ribs: ndarray) -> ndarray:
    """Cells on some ribs of the edge of a plan, next to which along it some are not in contact."""
    ends, cell = partition.facets[:, ribs], partition.f2c[0, ribs]
    out = np.zeros(partition.polygons.p.shape[1], dtype=bool)
    out[ends[:, ~inside[cell]]] = True
    return np.asarray(cell[out[ends].any(axis=0)])


def narrow(parts: Sequence[tuple[Partition, ndarray]], even: bool) -> str:
    """A warning if a body touches along lines of cells hardly wider than one: an ``even`` one as
    on a stiff crust that bends away from it inside, another along the edge of its plan. Contact
    may be far narrower than they are. ``parts`` are its cells and which of them touch."""
    total, count = sum(len(own) for _, own in parts), sum(int(own.sum()) for _, own in parts)
    inner = sum(inner_share(cells, own) * own.sum() for cells, own in parts)
    if count in (0, total) or count < DOZEN or inner > NARROW * count:
        return ""
    rim = sum(int(own[_rim(cells, edge_ribs(cells))].sum()) for cells, own in parts)
    if not even and rim < ALONG * count:  # it is rough
        return ""
    return (
        f"contact on {count} of {total} cells is hardly anywhere wider than one: "
        "its area, which may be many times too large, and the position are rough. Remedy: smaller "
        "cells along the edge"
    )


def rough_of(cells: Partition, contact: Contact, even: bool) -> list[str]:
    """Warnings of contact under one body on few cells, or hardly wider than one."""
    found = contact.rough, narrow([(cells, contact.touching)], even)
    return [message for message in found if message]


def presses_over(partition: Partition, pressure: ndarray, ribs: ndarray | None = None) -> bool:
    """Whether mean pressures of shape (n,) grow to the edge of the plan, as under a flat punch:
    to these ribs of it, or to all.

    Those of contact that ends inside, or just there, fall to it; on rough shapes, whose contact is
    thin, they grow by chance. A strip of contact along the edge is none of these.
    """
    areas, inside = partition.areas, pressure > 0
    ribs = edge_ribs(partition) if ribs is None else ribs
    rim = _rim(partition, ribs)
    beside = np.zeros(len(areas), dtype=bool)
    beside[partition.across(rim)] = True
    beside &= ~rim
    along = rim & inside & ((inside & (rim | beside)).sum() >= ALONG * inside.sum())
    along[_ending(partition, inside, ribs)] = False
    if inner_share(partition, inside, along) < INNER:
        return False
    force = pressure * areas
    at_edge, next_to_it = force[rim].sum(), force[beside].sum()
    counts = at_edge > COUNTS * np.abs(force).sum()
    return bool(counts and at_edge * areas[beside].sum() > next_to_it * areas[rim].sum())


def pulling(areas: ndarray, pressure: ndarray, constant: ndarray | None = None) -> str:
    """A warning if pressures under a mere settlement, (n,), pull by more than they press in the
    mean: cells too thin for the law of the edge make its equations nearly singular.

    Beside a stiff crust the ground does so in truth, and ``constant`` pressures in the cells too.
    """
    mean = pressure @ areas / areas.sum()
    if pressure.min() >= -abs(mean):
        return ""
    cause = "cells too long and thin for the law of the edge"
    remedy = 'edge="constant", or cells about as long as wide'
    if constant is not None:
        true = constant.min() / (constant @ areas / areas.sum())
        if pressure.min() / mean > BEYOND * min(true, -1.0):
            return ""
        cause += ", or too coarse for a crust"
        remedy = "smaller cells about as long as wide"
    pulled = np.nonzero(pressure < 0)[0]
    return (
        f"under a mere settlement the ground would have to pull on {len(pulled)} cells, "
        f"the first {pulled[:5].tolist()}, by up to {abs(pressure.min() / mean):.3g} times "
        f"the mean pressure: positions and stiffness are off; likely cause: {cause}. "
        f"Remedy: {remedy}"
    )


def where_named(names: EdgeBoundaries | None) -> str:
    """What part of the boundary of a plan its edge is, to be told; empty if it is all of it."""
    if names is None:
        return ""
    if isinstance(names, str):
        return f"the boundary {names}"
    if len(names) and all(isinstance(name, str) for name in names):
        return f"the boundaries {' and '.join(map(str, names))}"
    return f"{len(names)} boundary facets"


def _named_facets(basis: CellBasis, names: EdgeBoundaries) -> ndarray:
    given = [names] if isinstance(names, str) else names
    if not isinstance(given, (Sequence, np.ndarray)) or getattr(given, "ndim", 1) != 1:
        raise TypeError(f"expected names or facets for edge_boundaries, got {shown(names)}")
    mesh = nodal_mesh(basis)
    if len(given) and not isinstance(given[0], str):
        return checked_indices("edge_boundaries", given, mesh.nfacets)
    known = mesh.boundaries or {}
    given = [checked_text("a name in edge_boundaries", name) for name in given]
    if missing := [name for name in given if name not in list(known)]:
        raise ValueError(
            f"expected names of boundaries of the mesh, {sorted(known)}, got {missing}"
        )
    return np.concatenate([np.empty(0), *(known[name] for name in given)])
