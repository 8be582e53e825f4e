"""The corners of a triangulation and their order around each node."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skfem import MeshTri

from ..kernels.compiled import inputs
from ..kernels.once import computed_once


@dataclass(frozen=True, eq=False)
class Corners:
    """Corner ``k * M + j`` is vertex ``k``, counter-clockwise, of triangle ``j`` of ``M``.

    skfem sorts the vertices of a triangle, so its sense of rotation is found here and used
    nowhere else. Every corner starts one facet, which leads to the next corner of its triangle;
    an inner facet is started by two corners, one in each of its triangles.

    Everything is computed when first asked for.

    Parameters
    ----------
    mesh : MeshTri
        A mesh whose facets belong to one or two triangles each.
    """

    mesh: MeshTri

    @computed_once
    def _unit(self) -> float:
        return unit(self.mesh.p)

    @computed_once
    def _ccw(self) -> ndarray:
        return signed_areas(self.mesh.p, self.mesh.t) > 0

    @computed_once
    def node(self) -> ndarray:
        """Node at each corner."""
        return np.where(self._ccw, self.mesh.t, self.mesh.t[[0, 2, 1]]).ravel()

    @computed_once
    def facet(self) -> ndarray:
        """Facet each corner starts."""
        t2f = self.mesh.t2f.astype(np.int32)
        return np.where(self._ccw, t2f, t2f[::-1]).ravel()

    @computed_once
    def twin(self) -> ndarray:
        """The other corner that starts the same facet, -1 on the boundary."""
        # the two corners of a facet add up to a number from which each yields the other
        both = np.bincount(self.facet, weights=np.arange(len(self.facet)))
        twin = (both[self.facet] - np.arange(len(self.facet))).astype(np.int32)
        twin[self.mesh.f2t[1, self.facet] == -1] = -1
        return twin

    @computed_once
    def barycentres(self) -> ndarray:
        """Barycentre of each triangle, shape (2, M)."""
        return barycentres(self.mesh)

    @computed_once
    def crossing_parameters(self) -> ndarray:
        """Where the line through the barycentres of a facet's triangles meets it.

        0 at the first node of the facet, 1 at the second; 1/2 on the boundary.
        """
        every = np.arange(self.mesh.nfacets)
        return self._parameters(every, lambda elements: self.barycentres.take(elements, axis=1))

    def _parameters(self, facets: ndarray, barycentres: Callable[[ndarray], ndarray]) -> ndarray:
        """Those of some facets by the barycentres of some triangles."""
        mesh, s = self.mesh, np.full(len(facets), 0.5)
        inner = np.nonzero(mesh.f2t[1, facets] != -1)[0]
        facets = facets[inner]
        a, d = (mesh.p.take(end, axis=1) for end in mesh.facets.take(facets, axis=1))
        first, second = (barycentres(side) - a for side in mesh.f2t.take(facets, axis=1))
        d = (d - a) * self._unit  # fourth powers follow
        first, second = first * self._unit, second * self._unit
        height, other = (np.abs(d[0] * c[1] - d[1] * c[0]) for c in (first, second))
        along, beyond = (d[0] * c[0] + d[1] * c[1] for c in (first, second))
        s[inner] = (other * along + height * beyond) / ((height + other) * (d[0] ** 2 + d[1] ** 2))
        return s

    def crossings_of(self, facets: ndarray) -> ndarray:
        """Where that is on some facets, shape (2, k)."""
        ends = self.mesh.facets.take(facets, axis=1)
        start, end = (self.mesh.p.take(node, axis=1) for node in ends)
        return start + self._parameters(facets, partial(barycentres, self.mesh)) * (end - start)

    @computed_once
    def triangle(self) -> ndarray:
        """Triangle of each corner."""
        return np.tile(np.arange(len(self.node) // 3, dtype=np.int32), 3)

    @property
    def before(self) -> ndarray:
        """The clockwise neighbour of each corner in its own triangle."""
        return np.roll(np.arange(len(self.node), dtype=np.int32), len(self.node) // 3)

    @computed_once
    def following(self) -> ndarray:
        """The next corner counter-clockwise around the same node, -1 where the fan ends."""
        return self.twin[self.before]

    @computed_once
    def first(self) -> ndarray:
        """The corner with which the fan of each node begins; on the boundary no other can."""
        first = np.empty(self.node.max() + 1, dtype=np.int32)
        reverse = np.arange(len(self.node))[::-1]
        first[self.node[reverse]] = reverse
        starts = np.nonzero(self.twin == -1)[0]
        first[self.node[starts]] = starts
        return first

    @computed_once
    def rank(self) -> ndarray:
        """Position of each corner in the fan of its node; -1 where the fan does not reach it."""
        rank = np.full(len(self.node), -1, dtype=np.int32)
        first = corner = self.first
        position = 0
        while len(corner):
            rank[corner] = position
            position += 1
            corner = self.following[corner]
            going = (corner != -1) & (corner != first)
            corner, first = corner[going], first[going]
        return rank


def facets_of(t: ndarray, n: int) -> tuple[ndarray, ndarray, ndarray]:
    """``facets``, ``t2f`` and ``f2t`` of a MeshTri with n nodes, as skfem numbers them.

    By one sort of integers: skfem sorts columns, which takes ten times as long.
    """
    a, b, c = t
    start, end = np.concatenate([a, b, a]), np.concatenate([b, c, c])
    keys = np.minimum(start, end).astype(np.int64) * n + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    first = np.concatenate([[True], keys[1:] != keys[:-1]])
    t2f = np.empty(len(keys), dtype=np.int32)
    t2f[order] = np.cumsum(first) - 1
    f2t = np.stack([order[first], order[np.append(first[1:], True)]]) % t.shape[1]
    f2t[1, f2t[0] == f2t[1]] = -1
    facets = np.stack(np.divmod(keys[first], n))
    return facets.astype(np.int32), t2f.reshape(3, -1), f2t.astype(np.int32)


def numbered(mesh: MeshTri) -> MeshTri:
    """The mesh itself, which now knows its facets, see `facets_of`."""
    mesh._facets, mesh._t2f, mesh._f2t = facets_of(mesh.t, mesh.nvertices)
    return mesh


def unit(p: ndarray) -> float:
    """Power of two with which coordinates have a range near 1: multiplication is exact."""
    return float(np.ldexp(1.0, -int(np.frexp(np.ptp(p, axis=1).max())[1])))


def signed_areas(p: ndarray, t: ndarray) -> ndarray:
    """Area of each triangle, negative where its vertices run clockwise."""
    first, second, third = (p.take(vertex, axis=1) for vertex in t)
    a, b = second - first, third - first
    return (a[0] * b[1] - a[1] * b[0]) / 2


def parted(mesh: MeshTri) -> MeshTri:
    """The mesh with a node for each part where parts touch in a single one; without tags."""
    n, facets = mesh.nelements, np.nonzero(mesh.f2t[1] >= 0)[0]
    ends, beside = mesh.facets[:, facets], mesh.f2t[:, facets]
    # corners of triangles, at an end of a facet, that are next to each other
    first, second = (n * np.argmax(mesh.t[:, None, k] == ends, axis=0) + k for k in beside)
    pairs = coo_array((np.ones(first.size), (first.ravel(), second.ravel())), shape=(3 * n, 3 * n))
    _, fan = connected_components(pairs, directed=False)
    _, corner, t = np.unique(fan, return_index=True, return_inverse=True)
    return MeshTri(*inputs(mesh.p[:, mesh.t.ravel()[corner]], t.reshape(3, n).astype(np.int32)))


def quarters(p: ndarray, t: ndarray) -> tuple[ndarray, ndarray]:
    """Quadrilaterals as four triangles each around their middles, one side of all after the other:
    points, to which the middles are added, and triangles."""
    middle = p.shape[1] + np.arange(t.shape[1])
    triangles = np.hstack([[t[i], t[(i + 1) % 4], middle] for i in range(4)], dtype=np.int32)
    return np.hstack([p, p[:, t].mean(axis=1)]), triangles


def lone_first(t: ndarray, inside: ndarray) -> ndarray:
    """Triangles turned so that the vertex that is alone inside, or outside, comes first."""
    alone = np.argmax(inside == (inside.sum(axis=0) == 1), axis=0)
    return np.take_along_axis(t, (alone + np.arange(3)[:, None]) % 3, axis=0)


def barycentres(mesh: MeshTri, elements: ndarray | slice = slice(None)) -> ndarray:
    """Barycentre of each triangle, all or some, shape (2, ntriangles)."""
    a, b, c = (mesh.p.take(vertex, axis=1) for vertex in mesh.t[:, elements])
    return a + ((b - a) + (c - a)) / 3
