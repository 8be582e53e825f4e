"""The corners of a triangulation and their order around each node."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy import ndarray
from skfem import MeshTri


@dataclass(frozen=True, eq=False)
class Corners:
    """Corner ``k * M + j`` is vertex ``k``, counter-clockwise, of triangle ``j`` of ``M``.

    skfem sorts the vertices of a triangle, so its sense of rotation is found here and used
    nowhere else. Every corner starts one facet, which leads to the next corner of its triangle;
    an inner facet is started by two corners, one in each of its triangles.

    Attributes
    ----------
    node : (3 * M,) array of int
        Node at the corner.
    facet : (3 * M,) array of int
        Facet the corner starts.
    twin : (3 * M,) array of int
        The other corner that starts the same facet, -1 on the boundary.
    """

    node: ndarray
    facet: ndarray
    twin: ndarray

    @classmethod
    def from_mesh(cls, mesh: MeshTri) -> "Corners":
        """Corners of a mesh whose facets belong to one or two triangles each."""
        ccw = signed_areas(mesh.p, mesh.t) > 0
        node = np.where(ccw, mesh.t, mesh.t[[0, 2, 1]]).ravel()
        facet = np.where(ccw, mesh.t2f, mesh.t2f[::-1]).ravel().astype(np.int32)
        # the two corners of a facet add up to a number from which each yields the other
        both = np.bincount(facet, weights=np.arange(len(facet)))
        twin = (both[facet] - np.arange(len(facet))).astype(np.int32)
        twin[mesh.f2t[1, facet] == -1] = -1
        return cls(node, facet, twin)

    @property
    def triangle(self) -> ndarray:
        """Triangle of each corner."""
        return np.tile(np.arange(len(self.node) // 3, dtype=np.int32), 3)

    @property
    def before(self) -> ndarray:
        """The clockwise neighbour of each corner in its own triangle."""
        return np.roll(np.arange(len(self.node), dtype=np.int32), len(self.node) // 3)

    @cached_property
    def following(self) -> ndarray:
        """The next corner counter-clockwise around the same node, -1 where the fan ends."""
        return self.twin[self.before]

    @cached_property
    def first(self) -> ndarray:
        """The corner with which the fan of each node begins; on the boundary no other can."""
        first = np.empty(self.node.max() + 1, dtype=np.int32)
        reverse = np.arange(len(self.node))[::-1]
        first[self.node[reverse]] = reverse
        starts = np.nonzero(self.twin == -1)[0]
        first[self.node[starts]] = starts
        return first

    @cached_property
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


def signed_areas(p: ndarray, t: ndarray) -> ndarray:
    """Area of each triangle, negative where its vertices run clockwise."""
    a, b = p[:, t[1]] - p[:, t[0]], p[:, t[2]] - p[:, t[0]]
    return (a[0] * b[1] - a[1] * b[0]) / 2
