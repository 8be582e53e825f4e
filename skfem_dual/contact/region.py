"""Where a punch touches the ground, with an edge finer than the cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import Mesh, MeshTri

from ..grids.corners import lone_first, signed_areas
from ..grids.lines import Segments
from ..grids.mappings import own_mapping
from ..grids.planar import contours
from ..grids.polygons import readonly
from ..kernels.compiled import inputs
from ..kernels.once import ReadOnly, computed_once, freeze

#: triangles are cut no nearer to a vertex than in so much of a side
CUT = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class ContactRegion(ReadOnly):
    """The part of the plan in contact.

    Attributes
    ----------
    p : (2, N) array of float
        Points: the nodes of the mesh, and the middles of quadrilaterals.
    t : (3, m) array of int
        Triangles on them, counter-clockwise.
    level : (N,) array of float
        About the distance to the edge of contact inside the plan, positive in contact and
        linear in each triangle; far from it the sign is all that counts.
    holes : (m,) array of bool, or False
        Triangles out of contact between corners of cells in thin contact; False without any.
    """

    p: ndarray
    t: ndarray
    level: ndarray
    holes: ndarray | bool = False

    @classmethod
    def together(cls, regions: Sequence["ContactRegion"]) -> "ContactRegion":
        """Those under several bodies."""
        firsts = np.cumsum([0, *(region.p.shape[1] for region in regions)])
        t = np.hstack([region.t + first for region, first in zip(regions, firsts)])
        p, level = (np.hstack([getattr(r, name) for r in regions]) for name in ("p", "level"))
        holes = np.hstack([np.broadcast_to(r.holes, r.t.shape[1]) for r in regions])
        return cls(readonly(p), readonly(t), readonly(level), readonly(holes))

    def __repr__(self) -> str:
        return (
            f"<skfem_dual ContactRegion object>\n  Area: {self.area:.6g} of "
            f"{signed_areas(self.p, self.t).sum():.6g}\n  Lines of its edge: {len(self.edge)}"
        )

    @computed_once
    def _inside(self) -> ndarray:
        """Whether the vertices of the triangles are in contact, shape (3, m)."""
        return (self.level > 0)[self.t]

    @computed_once
    def _crossed(self) -> ndarray:
        """Whether the edge runs through each triangle."""
        return np.asarray(self._inside.any(axis=0) & ~self._inside.all(axis=0))

    @computed_once
    def _cut(self) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """Triangles the edge runs through, turned so that one vertex is alone on its side.

        Their vertices, whether that one is in contact, and where on the sides from it to the
        second and third vertex the edge passes, in parts of them.
        """
        t, inside = self.t[:, self._crossed], self._inside[:, self._crossed]
        t = lone_first(t, inside)
        a, b, c = self.level[t]
        return t, a > 0, a / (a - b), a / (a - c)

    @computed_once
    def area(self) -> float:
        """Area of the region."""
        return float(self.areas.sum())

    @computed_once
    def areas(self) -> ndarray:
        """Area of the region in each triangle, (m,)."""
        areas = signed_areas(self.p, self.t)
        if not self._inside.all():
            _, inside, onward, back = self._cut
            part, crossed = onward * back, areas[self._crossed]
            areas = np.where(self._inside.all(axis=0), areas, 0.0)
            areas[self._crossed] = crossed * np.where(inside, part, 1 - part)
        return np.where(self.holes, 0.0, areas)

    @computed_once
    def _sides(self) -> tuple[ndarray, ndarray, ndarray]:
        """Pieces of the edge, the region to their left: the sides of triangles they run between,
        shape (2, 2, m), and their begins and ends, (2, m) each; triangles ascending."""
        (lone, second, third), inside, *_ = self._cut
        a, b = np.where(inside, [second, third], [third, second])
        sides = np.sort([[lone, a], [lone, b]], axis=1).astype(np.int64)
        # from one end of each side, whichever triangle it is seen from: closed lines close
        first, last = sides.swapaxes(0, 1)
        share = self.level[first] / (self.level[first] - self.level[last])
        ends = self.p[:, first] + share * (self.p[:, last] - self.p[:, first])
        return sides, *np.moveaxis(ends, 1, 0)

    def segments(self, k: int) -> Segments:
        """The edge, of a region that is made of k pictures of one plan."""
        triangle = np.nonzero(self._crossed)[0]
        picture = triangle // max(self.t.shape[1] // k, 1)
        return Segments.from_ends(*self._sides[1:], picture, k)

    @computed_once
    def edge(self) -> list[ndarray]:
        """The edge of contact inside the plan: lines of shape (2, k), the region to their left.

        Where contact reaches the edge of the plan, that edge is not part of it; a line that ends
        there is open, others end where they begin.
        """
        sides, begin, end = self._sides
        if begin.shape[1] == 0:
            return []
        keys = sides[:, 0] * self.p.shape[1] + sides[:, 1]
        number, order = contours(keys, np.zeros(begin.shape[1]))
        lines = np.split(order, np.nonzero(np.diff(number))[0] + 1)
        return [readonly(np.hstack([begin[:, i], end[:, i[-1:]]])) for i in lines]

    @computed_once
    def mesh(self) -> MeshTri:
        """The region as triangles, those through which the edge runs cut along it.

        They are cut no nearer to a vertex than in a thousandth of a side: where the edge follows
        sides, their area differs from `area` by up to 4e-3.

        Raises
        ------
        ValueError
            If there is no contact.
        """
        (lone, second, third), inside, *_ = self._cut
        # the diagonal from the vertex farther from the edge, whatever their order
        turned = np.abs(self.level[third]) < np.abs(self.level[second])
        second, third = np.where(turned, third, second), np.where(turned, second, third)
        n = self.p.shape[1]

        def between(a: ndarray, b: ndarray) -> ndarray:
            """Numbers of the points where the edge passes between vertices, or of these."""
            return np.minimum(a, b).astype(np.int64) * n + np.maximum(a, b)

        onward, back = between(lone, second), between(lone, third)
        vertices = [between(k, k) for k in (lone, second, third)]
        corner = np.stack([vertices[0], onward, back])[:, inside]
        halves = np.stack([[onward, *vertices[1:]], [onward, vertices[2], back]], axis=-1)
        rest = halves[:, ~inside].reshape(3, -1)
        whole = self.t[:, self._inside.all(axis=0) & np.logical_not(self.holes)]
        t = np.hstack([between(whole, whole), corner, rest])
        if t.shape[1] == 0:
            raise ValueError("expected contact, got none")
        points, t = np.unique(t, return_inverse=True)
        a, b = points // n, points % n
        rise = self.level[a] - self.level[b]
        share = np.divide(self.level[a], rise, where=a < b, out=np.zeros(len(points)))
        share[a < b] = share[a < b].clip(CUT, 1 - CUT)
        p = self.p[:, a] + share * (self.p[:, b] - self.p[:, a])
        mesh = MeshTri(*inputs(p, t.reshape(3, -1)))
        freeze(mesh)
        return mesh

    def crossed(self, mesh: Mesh) -> ndarray:
        """Elements of a mesh through which the edge runs, for ``mesh.refined``.

        They are those with one of the edge's segments in them; ``mesh`` may be the one of the
        solution or another of the same plan.
        """
        if not self.edge:
            return np.empty(0, dtype=np.int64)
        middles = np.hstack([(line[:, 1:] + line[:, :-1]) / 2 for line in self.edge])
        return np.unique(mesh.element_finder(own_mapping(mesh))(*middles))
