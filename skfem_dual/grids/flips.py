"""Flips of facets that let the ribs of the dual grid cross their facets."""

from dataclasses import replace

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from .checks import CROSSING_MARGIN, crossing_condition
from .corners import Corners, barycentres, signed_areas
from .general import carried_boundaries, lasting_facets
from .planar import cross
from .quality import smallest_angles

#: sweeps at most
SWEEPS = 20


def flipped(mesh: MeshTri, everywhere: bool) -> tuple[MeshTri, int]:
    """Flip facets near those not crossed by their corresponded ribs, as long as it helps.

    A flip helps if then fewer facets of its two triangles are not crossed or, if they are as
    many, the smallest angle of its triangles is larger. ``everywhere`` takes all facets. Each
    sweep flips facets with no triangle in common, the best of their surroundings.

    Returns
    -------
    mesh : MeshTri
        The nodes of the mesh; triangles keep their subdomains.
    count : int
        Number of flips.
    """
    count = 0
    for _ in range(SWEEPS):
        facets, t = _helpful(mesh, everywhere)
        if len(facets) == 0:
            break
        count += len(facets)
        connectivity = mesh.t.copy()
        connectivity[:, mesh.f2t[:, facets].ravel()] = t.reshape(3, -1)
        after = replace(mesh, t=connectivity, _boundaries=None)
        mesh = replace(after, _boundaries=carried_boundaries(mesh, after) or None)
    return mesh, count


def _helpful(mesh: MeshTri, everywhere: bool) -> tuple[ndarray, ndarray]:
    """Facets to flip at once and the two triangles that replace each, shape (3, 2, nflips)."""
    missed = np.zeros(mesh.nfacets, dtype=bool)
    missed[crossing_condition(Corners(mesh)).offending] = True
    near = np.full(mesh.nelements, everywhere)
    near[mesh.f2t[:, missed]] = True
    candidate = ~lasting_facets(mesh) & near[mesh.f2t].any(axis=0)
    facet = np.nonzero(candidate)[0]

    a, b = mesh.facets[:, facet]
    pair = mesh.f2t[:, facet]
    c, d = mesh.t[:, pair].sum(axis=0) - a - b
    old = np.stack([[a, b, c], [a, b, d]], axis=1)
    new = np.stack([[c, d, a], [c, d, b]], axis=1)
    # c and d on different sides of the facet, a and b on different sides of the flipped one
    turn = signed_areas(mesh.p, new.reshape(3, -1)).reshape(2, -1)
    size = np.sum((mesh.p[:, c] - mesh.p[:, d]) ** 2, axis=0)
    convex = (turn[0] * turn[1] < 0) & (np.abs(turn).min(axis=0) > 1e-6 * size)
    facet, pair, a, b, c, d = facet[convex], pair[:, convex], *np.stack([a, b, c, d])[:, convex]
    old, new = old[..., convex], new[..., convex]

    angle = [smallest_angles(mesh.p, t).min(axis=0) for t in (old, new)]
    centre = barycentres(mesh)
    middle = mesh.p[:, new].mean(axis=1)  # of the new triangles, at a and at b
    after = _misses(mesh.p[:, c], mesh.p[:, d], middle[:, 0], middle[:, 1]).astype(int)
    before = missed[facet].astype(int)
    claimed = [*pair]
    for side in range(2):
        for k, corner in enumerate((a, b)):
            # the outer facet of the triangle on this side that ends in the corner
            around = mesh.t2f[:, pair[side]]
            mine = (mesh.facets[:, around] == corner).any(axis=0) & (around != facet)
            outer = around[mine.argmax(axis=0), np.arange(len(facet))]
            beyond = mesh.f2t[:, outer].sum(axis=0) - pair[side]
            inner = beyond != -1
            start, end = mesh.p[:, mesh.facets[:, outer]].swapaxes(0, 1)
            after += inner & _misses(start, end, middle[:, k], centre[:, beyond])
            before += missed[outer]
            claimed.append(np.where(inner, beyond, pair[side]))

    gain = angle[1] - angle[0]
    helps = (after < before) | ((after == before) & (gain > 1e-9))
    order = np.lexsort([-gain, after - before])
    rank = np.empty(len(order), dtype=int)
    rank[order] = np.arange(len(order))
    rank[~helps] = len(order)
    claims = np.stack(claimed)
    first = np.full(mesh.nelements, len(order))
    np.minimum.at(first, claims, np.broadcast_to(rank, claims.shape))
    wins = helps & (first[claims] == rank).all(axis=0)
    return facet[wins], new[..., wins]


def _misses(a: ndarray, b: ndarray, left: ndarray, right: ndarray) -> ndarray:
    """Whether the segment between two points on different sides of a-b misses it."""
    along = b - a
    to_left, to_right = left - a, right - a
    heights = [np.abs(cross(along, to)) for to in (to_left, to_right)]
    met = (heights[1] * to_left + heights[0] * to_right) / (heights[0] + heights[1])
    s = np.sum(met * along, axis=0) / np.sum(along**2, axis=0)
    return (s <= CROSSING_MARGIN) | (s >= 1 - CROSSING_MARGIN)
