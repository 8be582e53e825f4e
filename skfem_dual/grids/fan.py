"""Cells of a partition cut into triangles, on which fields inside the cells live."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray
from skfem import CellBasis, Mesh

from ..kernels.compiled import compiled, inputs
from ..kernels.once import ReadOnly, computed_once, remember
from .cellwise import CellwiseBasis
from .corners import lone_first, signed_areas
from .dual_mesh import DualMesh
from .mappings import places_of
from .nearby import in_circles
from .planar import ragged, rounding
from .polygons import readonly

#: circles around triangles looked at together, for the memory to stay small
TOGETHER = 2**13
#: circles along the longest side of a triangle, at most
THIN = 100


@dataclass(frozen=True, eq=False)
class Fan(ReadOnly):
    """Triangles that fill cells of a partition, all or some.

    Attributes
    ----------
    p : (2, npoints) array of float
        Points, among them the vertices of the triangles; the nodes of the mesh come first.
    t : (3, m) array of int
        The triangles, counter-clockwise.
    cell : (m,) array of int
        Cell of each triangle, ascending.
    part : (m,) array of int
        Of dual cells the element of the mesh in which each triangle lies; around the middle of an
        element that, and the number of elements for each side before the triangle's own.
    numbers : (k,) array of int, optional
        Of some cells, whose vertices alone are kept: numbers of the first points in the fan of
        all cells. The others are new.
    """

    p: ndarray
    t: ndarray
    cell: ndarray
    part: ndarray
    numbers: ndarray | None = None

    @classmethod
    def from_basis(cls, basis: CellBasis, cells: ndarray | None = None) -> "Fan":
        """Of a basis that is a partition, see `Partition.from_basis`; of ``cells`` only."""
        if isinstance(basis, CellwiseBasis) and basis.grid == "dual":
            return cls.from_dual(basis.dual, cells)
        mesh = basis.dual.mesh if isinstance(basis, CellwiseBasis) else basis.mesh
        fan = cls.from_mesh(mesh, cells)
        return fan if cells is None else fan._compact()

    @classmethod
    def from_dual(cls, dual: DualMesh, cells: ndarray | None = None) -> "Fan":
        """Dual cells, all or some, consist of triangles of the common refinement."""
        mesh = dual.mesh
        wanted = np.full(len(dual), cells is None)
        if cells is not None:
            wanted[cells] = True
        elements = np.nonzero(wanted[mesh.t].any(axis=0))[0]
        t = dual.refined_triangles(elements)
        own = np.nonzero(wanted[t[0]])[0]  # the first vertex is the node in the cell
        t, element = t.take(own, axis=1), elements[own // 6]
        if cells is None:
            return cls._sorted(dual.refinement_nodes, t, t[0], element)
        numbers, compact = _numbered(t, len(dual) + mesh.nfacets + mesh.nelements)
        return cls._sorted(dual.some_refinement_nodes(numbers), compact, t[0], element, numbers)

    @classmethod
    def from_refinement(cls, dual: DualMesh) -> "Fan":
        """The triangles of the mesh of a dual grid, cut by it: ``part`` is their dual cell."""
        refinement = dual.refinement
        element = np.arange(refinement.nelements) // 6
        return cls._sorted(refinement.p, refinement.t, element, dual.refinement_cells)

    @classmethod
    def from_mesh(cls, mesh: Mesh, cells: ndarray | None = None) -> "Fan":
        """Triangles or quadrilaterals, all or some, cut around the mean of their vertices."""
        p, t = places_of(mesh)
        k, m = t.shape
        cells = np.arange(m) if cells is None else np.asarray(cells)
        own, middle = t[:, cells], p.shape[1] + cells
        p = np.hstack([p, p.take(t, axis=1).mean(axis=1)])
        t = np.hstack([[own[i], own[(i + 1) % k], middle] for i in range(k)])
        part = (cells + mesh.nelements * np.arange(k)[:, None]).ravel()
        return cls._sorted(p, t, np.tile(cells, k), part)

    @classmethod
    def _sorted(
        cls, p: ndarray, t: ndarray, cell: ndarray, part: ndarray, numbers: ndarray | None = None
    ) -> "Fan":
        areas = signed_areas(p, t)
        t, areas = np.where(areas < 0, t[[0, 2, 1]], t), np.abs(areas)
        # quadrilaterals in the middle of a polar grid have sides without length
        full = areas > 1e-14 * np.bincount(cell, areas)[cell]
        if not full.all():
            t, cell, part, areas = t[:, full], cell[full], part[full], areas[full]
        return cls._by_cell(p, t, cell, part, numbers, areas)

    @classmethod
    def _by_cell(
        cls,
        p: ndarray,
        t: ndarray,
        cell: ndarray,
        part: ndarray,
        numbers: ndarray | None = None,
        areas: ndarray | None = None,
    ) -> "Fan":
        order = np.argsort(cell, kind="stable")
        fan = cls(
            readonly(p),
            readonly(t.take(order, axis=1), np.int32),
            readonly(cell[order], np.int32),
            readonly(part[order], np.int32),
            None if numbers is None else readonly(numbers, np.int32),
        )
        if areas is not None:
            remember(fan, "areas", readonly(areas[order]))
        return fan

    def _compact(self) -> "Fan":
        """With the vertices of its triangles only."""
        numbers, t = _numbered(self.t, self.p.shape[1])
        p, numbers = readonly(self.p.take(numbers, axis=1)), readonly(numbers, np.int32)
        return replace(self, p=p, t=readonly(t), numbers=numbers)

    def halved(self, found: Callable[[ndarray, ndarray], ndarray], times: int) -> "Fan":
        """With some sides of triangles cut in halves, so often.

        Parameters
        ----------
        found : callable
            Of the points and of the triangles (3, k) that are new, all in the beginning, to the
            `side_keys` of the sides to cut, ascending.
        times : int
            How often at most.

        Returns
        -------
        Fan
            Triangles are cut in two, or in four with those halved too that have a triangle with
            two others. Middles follow the other points.
        """
        p, t, cell, part = self.p, self.t, self.cell, self.part
        new = t
        for _ in range(times):
            n, cut = p.shape[1], found(p, new)
            if len(cut) == 0:
                break
            cut, beside, place = _closed(t, n, cut)
            p = np.hstack([p, p[:, np.divmod(cut, n)].mean(axis=1)])
            new, of = _cut(t[:, beside], n + place, place >= 0)
            whole = np.ones(t.shape[1], dtype=bool)
            whole[beside] = False
            of = np.append(np.nonzero(whole)[0], beside[of])
            t, cell, part = np.hstack([t[:, whole], new]), cell[of], part[of]
        if p is self.p:
            return self
        return Fan._by_cell(p, t, cell, part, self.numbers)

    def cut_at_zero(self, values: ndarray) -> tuple["Fan", ndarray]:
        """With triangles cut where a function is zero that is given at the points and linear in
        them, and its values: new points follow the others."""
        at = values[self.t]
        crossed = (at > 0).any(axis=0) & (at < 0).any(axis=0)
        whole, cut = np.nonzero(~crossed)[0], np.nonzero(crossed)[0]
        a, b, c = lone_first(self.t[:, cut], at[:, cut] > 0)
        # the diagonal from the vertex farther from the line, whatever their order
        turned = np.abs(values[b]) < np.abs(values[c])
        b, c = np.where(turned, c, b), np.where(turned, b, c)
        ab, ac = self.p.shape[1] + np.arange(2 * len(cut)).reshape(2, -1)
        shares = [values[a] / (values[a] - values[end]) for end in (b, c)]
        ends = zip(shares, (b, c), strict=True)
        new = [self.p[:, a] + share * (self.p[:, end] - self.p[:, a]) for share, end in ends]
        parts = [a, ab, ac], [ab, b, ac], [b, c, ac]
        t = np.hstack([self.t[:, whole], *map(np.array, parts)])
        of = np.concatenate([whole, *[cut] * 3])
        fan = Fan._sorted(np.hstack([self.p, *new]), t, self.cell[of], self.part[of])
        return fan, np.append(values, np.zeros(2 * len(cut)))

    def with_cells_of(self, other: "Fan") -> "Fan":
        """With the triangles of another fan in the cells that it has: one of the same cells, or of
        some of them, with triangles cut."""
        own = np.nonzero(~np.isin(self.cell, other.cell))[0]
        n, k = self.p.shape[1], other.p.shape[1]
        numbers = np.arange(n) if other.numbers is None else other.numbers
        new = np.arange(len(numbers), k)
        t = np.append(numbers, n + new - len(numbers))[other.t]
        t, p = np.hstack([self.t[:, own], t]), np.hstack([self.p, other.p[:, new]])
        cell, part = np.append(self.cell[own], other.cell), np.append(self.part[own], other.part)
        return Fan._by_cell(p, t, cell, part)

    def places(self, points: ndarray) -> ndarray:
        """Where it has some points of the fan of all cells."""
        return points if self.numbers is None else np.searchsorted(self.numbers, points)

    def same(self, triangle: ndarray, other: "Fan") -> ndarray:
        """Numbers that triangles have in another fan, which cuts their cells as this one."""
        cell = self.cell[triangle]
        return triangle - self.starts[cell] + other.starts[cell]

    @computed_once
    def areas(self) -> ndarray:
        """Area of each triangle."""
        return readonly(signed_areas(self.p, self.t))

    @computed_once
    def starts(self) -> ndarray:
        """Triangles of cell ``i``, up to the last that has some, are those from ``starts[i]`` to
        ``starts[i + 1]``."""
        return readonly(np.searchsorted(self.cell, np.arange(self.cell[-1] + 2)))

    def coordinates(self, triangle: ndarray, x: ndarray) -> ndarray:
        """Barycentric coordinates of points in triangles, one each; shape (3, m)."""
        v = self.p[:, self.t[:, triangle]] - x[:, None]
        onward, last = np.roll(v, -1, axis=1), np.roll(v, -2, axis=1)
        return (onward[0] * last[1] - onward[1] * last[0]) / (2 * self.areas[triangle])

    def locate(self, x: ndarray) -> ndarray:
        """Triangle that contains each point of shape (2, m), -1 outside all of them."""
        # many circles pay for many points
        many = min(8 * x.shape[1] / self.t.shape[1], THIN)
        circled, middle, reach, longest = self._circles(many) if many > 1 else self._few_circles
        blur = rounding(self.p)  # points farther out are outside
        least = -1e-9 - blur * longest / (2 * self.areas)
        reach = reach + blur
        points, offsets = in_circles(reach, middle, x)
        deepest, depth = np.full(x.shape[1], -1), np.full(x.shape[1], -np.inf)
        for begin in range(0, len(circled), TOGETHER):
            ends = offsets[begin : begin + TOGETHER + 1]
            point = points[ends[0] : ends[-1]]
            triangle = np.repeat(circled[begin : begin + TOGETHER], np.diff(ends))
            inside = self.coordinates(triangle, x[:, point]).min(axis=0)
            kept = np.nonzero(inside >= np.maximum(depth[point], least[triangle]))[0]
            # the triangle deepest around a point wins
            kept = kept[np.argsort(inside[kept], kind="stable")]
            deepest[point[kept]], depth[point[kept]] = triangle[kept], inside[kept]
        return deepest

    @computed_once
    def _few_circles(self) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """One around each triangle."""
        return self._circles(1.0)

    def _circles(self, most: float) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """Circles that cover the triangles together: triangle, centre and radius of each; and the
        longest sides of the triangles.

        Thin triangles have several, so many at most, along their longest sides: one would hold
        the points of as many others as they are longer than high.
        """
        v = self.p[:, self.t]
        sides = np.roll(v, -1, axis=1) - v
        k = np.argmax(np.hypot(*sides), axis=0), np.arange(v.shape[2])
        start, along = v[:, *k], sides[:, *k]
        length = np.hypot(*along)
        high = 2 * self.areas / length
        many = np.maximum(length / np.maximum(2 * high, length / most), 1).astype(int)
        of, i = ragged(many)
        arm = v.sum(axis=1) - 3 * start - along  # of the third vertex
        lift = arm - along * (np.sum(arm * along, axis=0) / length**2)
        middle = start[:, of] + along[:, of] * ((i + 0.5) / many[of]) + lift[:, of] / 2
        reach = np.hypot(length / (2 * many), high / 2)[of]
        single = many[of] == 1
        mean = v.mean(axis=1)
        middle[:, single] = mean[:, of[single]]
        reach[single] = np.hypot(*(v - mean[:, None])).max(axis=0)[of[single]]
        # a little more: points on the boundary are inside
        return of, middle, 1.000001 * reach, length


def _numbered(t: ndarray, n: int) -> tuple[ndarray, ndarray]:
    """Which of n points triangles have, ascending, and the triangles by their numbers in these."""
    used = np.zeros(n, dtype=bool)
    used[t] = True
    return np.nonzero(used)[0], (np.cumsum(used, dtype=np.int32) - 1)[t]


def _closed(t: ndarray, n: int, cut: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """`side_keys` of sides to cut, those of triangles with two others among them; the triangles
    that have any, and the numbers of their sides among those, -1 for others."""
    ends = np.zeros(n, dtype=np.int8)
    ends[np.concatenate(np.divmod(cut, n))] = 1
    # third sides end where the two others do
    beside = np.nonzero(ends[t].sum(axis=0) >= 2)[0]
    keys, side = np.unique(side_keys(t.take(beside, axis=1), n), return_inverse=True)
    halved = np.zeros(len(keys), dtype=bool)
    halved[np.searchsorted(keys, cut)] = True
    (side,) = inputs(side.reshape(3, -1))
    _close(side, halved)
    place = np.where(halved, np.cumsum(halved) - 1, -1)[side]
    some = np.nonzero((place >= 0).any(axis=0))[0]
    return keys[halved], beside[some], place.take(some, axis=1)


@compiled
def _close(side, halved):
    """Halve third sides of triangles until none has just two that are."""
    again = True
    while again:
        again = False
        for k in range(side.shape[1]):
            a, b, c = side[:, k]
            if np.int64(halved[a]) + halved[b] + halved[c] == 2:
                halved[a], halved[b], halved[c], again = True, True, True, True


def _cut(t: ndarray, middle: ndarray, halved: ndarray) -> tuple[ndarray, ndarray]:
    """Parts of triangles of which one side is halved, or all are, and the triangle of each.

    ``middle`` has the points in the middles of the sides, (3, m), ``halved`` which are halved.
    """
    half, quarters = (np.nonzero(halved.sum(axis=0) == k)[0] for k in (1, 3))
    (a, b, c), (ab, bc, ca) = t[:, quarters], middle[:, quarters]
    turn = (halved[:, half].argmax(axis=0) + np.arange(3)[:, None]) % 3, half
    (d, e, f), de = t[turn], middle[turn][0]
    parts = [a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca], [d, de, f], [de, e, f]
    new = np.hstack([*map(np.array, parts)]).astype(t.dtype)
    return new, np.concatenate([*[quarters] * 4, half, half])


def side_keys(t: ndarray, n: int) -> ndarray:
    """``i n + j`` for the sides of triangles between the points ``i < j`` of n, shape (3, m)."""
    t = t.astype(np.int64)
    onward = t[[1, 2, 0]]
    return np.minimum(t, onward) * n + np.maximum(t, onward)
