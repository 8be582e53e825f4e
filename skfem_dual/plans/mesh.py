"""Triangulations of plans, and their refinement along true arcs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import MeshTri

from ..arguments import checked_indices, checked_integer
from ..errors import MeshError
from ..grids.checks import check_type
from ..grids.curves import Curve, Width
from ..grids.general import facet_numbers
from ..grids.planar import covered_twice, directed_sides
from ..grids.preprocess import repair
from ..grids.short_facets import SHORT, STEEPER
from ..grids.sizing import MOST, generated
from ..kernels.once import computed_once
from ..messages import place
from .parts import Part
from .rings import Ring

#: nodes on the edge lie within this part of a facet from the plan, on arcs beside it
OFF = 0.4
#: shares of a side up to which a node is in its end
END = 1e-6
#: part of a gap that facets of an arc beside it may take
SHARE = 1 / 3
#: points of a ring looked at for that, and how far off an arc they lie, over its radius
SAMPLES, ON = 2000, 0.1


def mesh_of(
    parts: tuple[Part, ...], size: float | None, n: int | None, graded: float | None
) -> MeshTri:
    """Triangulation of some parts, each a component; see `Plan.mesh`."""
    if isinstance(graded, str):
        raise ValueError(f"expected graded as a number in (0, 1] for plans, got {graded!r}")
    areas = np.array([o.area - sum(hole.area for hole in holes) for o, holes in parts])
    counts: list[int | None] = [n] * len(parts)
    if n is not None and len(parts) > 1:
        least = [1 + sum(ring.least for ring in (o, *holes)) for o, holes in parts]
        n = checked_integer("n", n, at_least=sum(least), at_most=MOST)
        counts = [max(k, round(n * a / areas.sum())) for k, a in zip(least, areas)]
    if size is not None and len(parts) > 1:  # a small part may have smaller triangles
        extents = [float(np.ptp(outline.box, axis=1).max()) for outline, _ in parts]
        sizes: list[float | None] = [min(size, extent / 2) for extent in extents]
    else:
        sizes = [size] * len(parts)
    rings: list[list[Ring]] = [[outline, *holes] for outline, holes in parts]

    def meshed(curves: Sequence[Sequence[Curve]]) -> MeshTri:
        each = zip(curves, sizes, counts, strict=True)
        return _together([generated(own, h, k, graded) for own, h, k in each])

    mesh = meshed(rings)
    if len(parts) == 1 or _overlap(mesh) is None:
        return mesh
    others = [tuple(ring for part in rings if part is not own for ring in part) for own in rings]
    each = zip(rings, others, strict=True)
    mesh = meshed(
        [[_Beside(ring.corners, ring.bulges, beside) for ring in own] for own, beside in each]
    )
    if (x := _overlap(mesh)) is not None:
        raise MeshError(
            f"expected parts as far apart as facets of this size are from their arcs, got some "
            f"that overlap near {place(x)}. Remedy: choose a smaller size or more nodes, or move "
            "them apart"
        )
    return mesh


def _overlap(mesh: MeshTri) -> ndarray | None:
    """Where parts of a mesh overlap; None if they do not."""
    boundary = mesh.boundary_facets()
    twice = covered_twice(mesh.p, *directed_sides(mesh, boundary))
    if len(twice) == 0:
        return None
    return np.asarray(mesh.p[:, mesh.facets[:, boundary[twice[0]]]].mean(axis=1))


@dataclass(frozen=True, eq=False)
class _Beside(Ring):
    """A ring beside those of other parts: where an arc is near one its facets are so short that
    they, and nodes that lie outside of it for its area, stay apart from the others."""

    others: tuple[Ring, ...]

    def points(self, k: int, width: Width | None = None) -> ndarray:
        """As of `Ring`, and more where that takes them."""
        usual = self.length / k
        x, room = self._narrow
        x, room = x[:, room < usual], room[room < usual]
        if len(room) == 0:
            return super().points(k, width)
        # so short that triangles grow from them, see `ShortFacets`
        room = min(1.0, 0.7 * SHORT * usual / room.min()) * room

        def limited(at: ndarray) -> ndarray:
            found = np.full(at.shape[1], usual) if width is None else width(at)
            away = np.hypot(*(at[:, :, None] - x[:, None]))
            return np.minimum(found, (room + STEEPER * away).min(axis=1))

        return super().points(k, limited)

    @computed_once
    def _narrow(self) -> tuple[ndarray, ndarray]:
        """Points of the ring and the longest facets there, infinite on straight sides."""
        x = super().points(SAMPLES)
        gap = np.min([ring.sides.distance(x) for ring in self.others], axis=0)
        sides, radius = self.sides, np.full(x.shape[1], np.inf)
        for i in np.nonzero(sides.curved)[0]:
            off = np.abs(np.hypot(*(x - sides.centre[:, i : i + 1])) - sides.radius[i])
            near = off <= ON * sides.radius[i]
            radius[near] = np.minimum(radius[near], sides.radius[i])
        # an arc is as far from its chord as the square of this over eight radii
        return x, np.sqrt(8 * SHARE * gap * radius)


def _together(meshes: list[MeshTri]) -> MeshTri:
    """One mesh of some components, with their boundaries; holes are numbered through."""
    if len(meshes) == 1:
        return meshes[0]
    nodes = np.cumsum([0, *(m.p.shape[1] for m in meshes)])
    mesh = MeshTri(
        np.hstack([m.p for m in meshes]),
        np.hstack([m.t + np.int32(k) for m, k in zip(meshes, nodes)]),
    )
    edge: list[int] = []
    holes: list[list[int]] = []
    for m, k in zip(meshes, nodes):
        for name, facets in (m.boundaries or {}).items():
            found = facet_numbers(mesh, *(m.facets[:, facets] + np.int32(k))).tolist()
            if name == "edge":
                edge += found
            else:
                holes.append(found)
    names = ["hole"] if len(holes) == 1 else [f"hole{i}" for i in range(len(holes))]
    tags = {"edge": edge} | dict(zip(names, holes))
    return mesh.with_boundaries({name: np.sort(f) for name, f in tags.items()})


def refined(parts: tuple[Part, ...], mesh: MeshTri, elements: ArrayLike | None) -> MeshTri:
    """The mesh with smaller triangles, its edge on the rings; see `Plan.refine`."""
    check_type(mesh)
    rings = [ring for outline, holes in parts for ring in (outline, *holes)]
    _nodes_along(rings, mesh)  # is it a mesh of this plan?
    bare = MeshTri(mesh.p, mesh.t)
    if elements is None:
        fine = bare.refined(1)
    else:
        fine = bare.refined(checked_indices("elements", elements, mesh.nelements, each="item"))
    p = fine.p.copy()
    for ring, (nodes, side) in zip(rings, _nodes_along(rings, fine)):
        p[:, nodes] = ring.moved_to_area(p[:, nodes], side)
    # bisected triangles may be too slender for a dual grid
    moved, _report = repair(MeshTri(p, fine.t))
    hole = np.concatenate([[False, *[True] * len(holes)] for _, holes in parts])
    facets, owner, _ = _places(rings, moved)
    names = ["hole"] if hole.sum() == 1 else [f"hole{i}" for i in range(hole.sum())]
    tags = {"edge": facets[~hole[owner]]}
    tags |= {name: facets[owner == i] for name, i in zip(names, np.nonzero(hole)[0])}
    return moved.with_boundaries(tags)


def _places(rings: list[Ring], mesh: MeshTri) -> tuple[ndarray, ndarray, ndarray]:
    """Facets on the boundary of a mesh, and the ring and the side of it on which each lies."""
    facets = mesh.boundary_facets()
    a, b = mesh.p[:, mesh.facets[:, facets]].swapaxes(0, 1)
    off = np.full(len(facets), np.inf)
    ring, side = np.zeros((2, len(facets)), dtype=int)
    for i, r in enumerate(rings):
        for k in range(1 if r.is_circle else len(r.bulges)):
            on = np.full(len(facets), k)
            far = np.max(
                [
                    r.sides.distance(x) if r.is_circle else r.sides.distance_to(x, on)
                    for x in (a, b, (a + b) / 2)
                ],
                axis=0,
            )
            ring, side = np.where(far < off, i, ring), np.where(far < off, k, side)
            off = np.minimum(far, off)
    away = off > OFF * np.hypot(*(b - a))
    if away.any():
        i = int(np.argmax(away))
        raise MeshError(
            f"expected a mesh of this plan, got {np.count_nonzero(away)} facets on the boundary "
            f"that are not on its outline, the first near {place(((a + b) / 2)[:, i])}. Remedy: "
            "make it by plan.mesh"
        )
    return facets, ring, side


def _nodes_along(rings: list[Ring], mesh: MeshTri) -> list[tuple[ndarray, ndarray]]:
    """For each ring the nodes of a mesh in order along it, and the side that has each.

    Corners belong to the side that starts there.
    """
    facets, ring, side = _places(rings, mesh)
    found = []
    for i, r in enumerate(rings):
        mine = ring == i
        nodes = mesh.facets[:, facets[mine]].ravel()
        if r.is_circle:
            nodes = np.unique(nodes)
            arm = mesh.p[:, nodes] - r.sides.centre[:, :1]
            nodes = nodes[np.argsort(np.arctan2(arm[1], arm[0]))]
            found.append((nodes, np.zeros(len(nodes), dtype=int)))
            continue
        own, nodes = np.unique(np.stack([np.tile(side[mine], 2), nodes]), axis=1)
        share = r.sides.shares(mesh.p[:, nodes], own)
        order = np.lexsort((share, own))
        nodes, own, share = nodes[order], own[order], share[order]
        inner = share < 1 - END
        starts = np.nonzero(np.abs(share) <= END)[0]
        if not np.array_equal(own[starts], np.arange(len(r.bulges))):
            away = r.corners[:, :, None] - mesh.p[:, None, nodes]
            lost = int(np.argmax(np.hypot(*away).min(axis=1)))
            raise MeshError(
                f"expected a mesh of this plan, with a node in every corner, got none at "
                f"{place(r.corners[:, lost])}. Remedy: make it by plan.mesh"
            )
        found.append((nodes[inner], own[inner]))
    return found
