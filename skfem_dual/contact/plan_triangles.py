"""Triangles of a plan on which the regions of contact of its cells are drawn.

Where contact ends smoothly the pressure falls like the square root of the distance s to its edge
and the gap opens like the power 3/2, with one strength K for both (K. L. Johnson, Contact
Mechanics, 1985, section 5.1): ``p = K s^(1/2)``, ``gap = 4 K s^(3/2) / (3 E*)``. So pressures and
gaps on both sides of the edge become distances to it, whose zero is the edge; `contact_line` finds
it once more by second degree. Where the edge meets that of the plan both grow by its law, too, and
are taken over it. No law is seen in cells that touch alone, or in rows and clusters as thin: there
the edge runs around them, and their areas count.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from skfem import Mesh

from ..elements.edge_weights import EdgeWeights
from ..grids.corners import quarters, signed_areas
from ..grids.evening import evening
from ..grids.lines import Segments
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly, computed_once
from .contact_line import AROUND, Seen, edge_distance, mean_of_nearest, moved_line
from .planes import PlaneFit
from .problem import DOZEN
from .region import ContactRegion

#: parts of the cells in contact under an even base of which a region may take in less neither of
#: them nor of their points: it is 0.84 to 1.05 on homogeneous ground, 0.5 and more on crusts that
#: bend within a cell
LEFT = 0.85, 0.65
#: sizes of a cell, farther than which the sign of the distance is all that counts
FAR = 3.0
MOVED = 2.5
#: of more cells only those up to so many from the edge of contact are looked at, for points on
#: triangles up to so many from it
MANY, CELLS, POINTS = 20_000, 9, 3
#: cells in contact within so many of one that has none but such beside it show where contact ends
SHOWN = 2
#: how far a line around a single cell is from its node, on the way to those beside it, to enclose
#: its area: a third of that of the triangles at the node
WHOLE = 3**-0.5
#: and how far outside the corners of cells that do not lie around nodes
SLIGHT = 1e-6
#: distance to the edge of contact by the gap beside, over that between cells, below which sides
#: are steep where the square of the pressure is above this part of its largest around
STEEP = 0.1, 0.5
#: part of the largest pressure of a spot above which a cell does not end in the contact of others,
#: if less than this part of it is inside
PRESSED = 0.5


@dataclass(frozen=True, eq=False)
class PlanTriangles(ReadOnly):
    """Triangles on which contact regions of the same cells are drawn.

    Attributes
    ----------
    partition : Partition
        The cells.
    p, t
        As of `ContactRegion`.
    weights : EdgeWeights or None
        The law of the plan's edge.
    cell : (N,) array of int
        A cell at each point.
    own : (N,) array of bool
        Points inside their cell; others are corners of several.
    """

    partition: Partition
    p: ndarray
    t: ndarray
    weights: EdgeWeights | None
    cell: ndarray
    own: ndarray

    @classmethod
    def of(
        cls, partition: Partition, mesh: Mesh, weights: EdgeWeights | None = None
    ) -> "PlanTriangles":
        """Those of a mesh of triangles, or a quarter each of quadrilaterals."""
        p, t = mesh.p, mesh.t
        cell, own = np.arange(len(partition)), np.ones(p.shape[1], dtype=bool)
        if not np.array_equal(partition.nodes, p):  # one for each node
            own[:] = False
            cell = np.empty(p.shape[1], dtype=int)
            cell[t] = np.arange(t.shape[1])
        halves = [signed_areas(p, t[[0, i, i + 1]]) for i in range(1, len(t) - 1)]
        clockwise = np.sum(halves, axis=0) < 0
        if len(t) == 4:
            cell = np.append(cell, np.arange(t.shape[1]))
            own = np.append(own, np.ones(t.shape[1], dtype=bool))
            p, t = quarters(p, t)
            clockwise = np.tile(clockwise, 4)
        if clockwise.any():
            t = np.where(clockwise, t[[0, 2, 1]], t)
        return cls(partition, readonly(p), readonly(t), weights, readonly(cell), readonly(own))

    @computed_once
    def _planes(self) -> PlaneFit:
        """From the centroids of the cells to the points."""
        return PlaneFit.to_nearest(self.partition.centroids, self.p, self._even)

    @computed_once
    def _even(self) -> ndarray:
        """A linear map under which the cells are about as long as wide, see `evening`."""
        return evening(self.partition.polygons)

    @computed_once
    def _sizes(self) -> ndarray:
        """Roots of the areas of the cells at the points, in the mean of those that meet there."""
        areas = self.partition.areas
        if self.own.all():
            return np.sqrt(areas[self.cell])
        n, t = self.p.shape[1], self.t.ravel()
        total = np.bincount(t, np.tile(areas[self._of_triangles], 3), n)
        return np.sqrt(total / np.bincount(t, minlength=n).clip(1))

    @computed_once
    def _of_triangles(self) -> ndarray:
        """Cell of each triangle, where there are points between cells."""
        # triangles are cells, or quarters of them in the same order
        return np.arange(self.t.shape[1]) % len(self.partition)

    def _near(self, some: ndarray) -> tuple[ndarray, ndarray]:
        """Cells and points near some cells, by their numbers."""
        near = np.zeros(len(self.partition), dtype=bool)
        near[some] = True
        points = near
        for ring in range(CELLS):
            points = near.copy() if ring == POINTS else points
            near[self.partition.across(near)] = True
        at = self.own & points[self.cell]
        if not self.own.all():
            at |= self._corners(points[self._of_triangles])
        return np.nonzero(near)[0], np.nonzero(at)[0]

    @computed_once
    def _whole(self) -> ContactRegion:
        """Contact everywhere."""
        return ContactRegion(self.p, self.t, readonly(np.ones(self.p.shape[1])))

    def fitted(self, pressure: ndarray, gap: ndarray, modulus: float) -> ContactRegion:
        """The part of the region with cells enough for the law of its edge to be seen."""
        return self.fitted_each(pressure[None], gap[None], modulus)[0]

    def fitted_each(self, pressure: ndarray, gap: ndarray, modulus: float) -> list[ContactRegion]:
        """The same of k pictures of the cells, (k, n) each."""
        level = np.full((len(pressure), self.p.shape[1]), -1.0)
        whole = np.asarray((gap <= 0).all(axis=1))
        drawn = (pressure > 0).any(axis=1) & ~whole
        if drawn.any():
            # pressures and gaps grow by the law of the edge
            law = 1.0 if self.weights is None else self.weights.in_cells
            known = pressure[drawn] / law, gap[drawn] * 0.75 * modulus / law
            level[drawn] = self._levels(*known)
        regions = [ContactRegion(self.p, self.t, readonly(own)) for own in level]
        return [self._whole if all_of_it else own for own, all_of_it in zip(regions, whole)]

    def with_thin(
        self, fitted: ContactRegion, pressure: ndarray, opening: ndarray, even: bool = False
    ) -> ContactRegion:
        """With the edge drawn around cells of thin contact, where no law is seen, and around
        those that end at steep sides, where pressures do not vanish; around all those of
        spots of which too little would be left.

        Under an ``even`` base it is seen wherever the fitted region reaches: rows of cells in
        contact lie along the edge of the plan, not on crests. Where it
        leaves out much, as on crusts, pressures fall sooner than by the law: points that touch
        are inside then.
        """
        if fitted is self._whole:
            return fitted
        inside = pressure > 0
        many = even and inside.sum() >= DOZEN
        if many and fitted.area < LEFT[0] * self.partition.areas[inside].sum():
            fitted = self._with_points(fitted, inside)
        held = self._held(fitted)
        thin = _thin(self.partition, inside, held) & ~(even & held)
        if not even:
            thin |= self._on_steep(pressure, opening, inside, held)
            fitted = self._with_gaps(fitted, inside, held)
        region = self._around(fitted, thin, inside)
        if not even:
            cut_off = self._cut_off(region, pressure) & ~thin
            if cut_off.any():
                thin |= self._outwards(cut_off, inside, held, SHOWN)
                region = self._around(fitted, thin, inside)
        unseen = self._unseen(region.areas, pressure, many) & ~thin
        return self._around(fitted, thin | unseen, inside) if unseen.any() else region

    def _held(self, region: ContactRegion) -> ndarray:
        """Cells whose middle a region holds; of those that have no point there, any corner."""
        held = region.level > 0
        if self.own.any():
            return held[self.own]
        return np.bincount(self._of_triangles, held[self.t].any(axis=0), len(self.partition)) > 0

    def _with_gaps(self, fitted: ContactRegion, inside: ndarray, held: ndarray) -> ContactRegion:
        """With the edge drawn around cells that are open alone, or in clusters as thin, amid
        contact, where no law is seen either: their areas do not count. Triangles, which have no
        points of their own, keep what is fitted."""
        if not self.own.any():
            return fitted
        spot, at_edge = self.partition.parts(~inside), np.zeros(len(inside), dtype=bool)
        at_edge[spot[self.partition.f2c[0, edge_ribs(self.partition)]]] = True
        gaps = _thin(self.partition, ~inside, ~held) & ~at_edge[spot]
        if not gaps.any():
            return fitted
        around = self._around(replace(fitted, level=-fitted.level), gaps, ~inside)
        return replace(fitted, level=readonly(-around.level))

    def _with_points(self, fitted: ContactRegion, inside: ndarray) -> ContactRegion:
        """With the points of cells in contact, where they have one each, on their side of the edge
        and those of others on the other."""
        touching, slight = inside[self.cell], SLIGHT * self._sizes
        level = np.where(touching, fitted.level.clip(slight), fitted.level.clip(None, -slight))
        return ContactRegion(self.p, self.t, readonly(np.where(self.own, level, fitted.level)))

    def _unseen(self, areas: ndarray, pressure: ndarray, many: bool) -> ndarray:
        """Cells of spots on which the mean pressure, by the ``areas`` of a region in triangles, is
        above the largest of a cell: they are too few, or too large for how it varies. Of
        ``many`` under an even base also those of which the region leaves out too much."""
        inside = pressure > 0
        spot, cell = self.partition.parts(inside), self._of_triangles
        if self.own.all():  # triangles between cells: a cell in contact, if there is one
            cell = self.cell[self.t]
            cell = np.take_along_axis(cell, inside[cell].argmax(axis=0)[None], axis=0)[0]
        counts, n = inside[cell], len(inside)
        seen = np.bincount(spot[cell[counts]], areas[counts], n)
        force = np.bincount(spot[inside], (pressure * self.partition.areas)[inside], n)
        largest = np.zeros(n)
        np.maximum.at(largest, spot[inside], pressure[inside])
        lost = seen * largest < force
        if many:
            lost |= seen < LEFT[1] * np.bincount(spot[inside], self.partition.areas[inside], n)
        return inside & lost[spot]

    def _around(self, fitted: ContactRegion, thin: ndarray, inside: ndarray) -> ContactRegion:
        """With the edge around some of the cells in contact instead."""
        if not thin.any():
            return fitted
        beside, cell = np.zeros(len(inside), dtype=bool), self._of_triangles
        beside[self.partition.across(thin)] = True
        beside &= ~inside
        level, size = fitted.level.copy(), np.sqrt(np.median(self.partition.areas[thin]))
        for cells, distance in ((thin, WHOLE), (beside, WHOLE - 1)):
            level[self.own & cells[self.cell]] = distance * size
        some = self._corners(beside[cell]) & ~self._corners(inside[cell])
        level[some] = np.minimum(level[some], (WHOLE - 1) * size)
        some = self._corners(thin[cell])
        level[some] = np.maximum(level[some], SLIGHT * size)
        holes = ~inside[cell] & some[self.t].all(axis=0)
        return ContactRegion(self.p, self.t, readonly(level), readonly(holes))

    def _on_steep(
        self, pressure: ndarray, opening: ndarray, inside: ndarray, held: ndarray
    ) -> ndarray:
        """Cells in contact beside such as are too far from the ground for the law of the edge,
        and the cells around that it takes out of contact."""
        sides, n = self.partition.neighbours, len(inside)
        unlike = self.partition.across(inside)
        i = np.where(inside[unlike[0]], *unlike)
        j = unlike.sum(axis=0) - i
        square = pressure.clip(0) ** 2
        inner = square.copy()  # of the neighbours too
        both = sides[:, inside[sides].all(axis=0)]
        np.maximum.at(inner, both[0], square[both[1]])
        np.maximum.at(inner, both[1], square[both[0]])
        # by the law of an edge near i, with the gap in j, p^2 = (opening / across)^2 d / across
        x = self.partition.centroids
        across = np.hypot(*(x[:, i] - x[:, j]))
        near = square[i] * across**2 < STEEP[0] * opening[j] ** 2
        steep = np.zeros(n, dtype=bool)
        steep[i[near & (square[i] > STEEP[1] * inner[i])]] = True
        return self._outwards(steep, inside, held)

    def _cut_off(self, region: ContactRegion, pressure: ndarray) -> ndarray:
        """Cells that press as those around, most of which the region leaves out: no law of an edge
        is seen in how they end, as where shapes bend away within a cell."""
        inside, most = pressure > 0, np.empty(len(pressure), dtype=bool)
        if self.own.all():
            most[self.cell] = region.level <= 0
        else:
            held = np.bincount(self._of_triangles, region.areas, len(pressure))
            most[:] = held < PRESSED * self.partition.areas
        spot, largest = self.partition.parts(inside), np.zeros(len(pressure))
        np.maximum.at(largest, spot[inside], pressure[inside])
        return inside & most & (pressure > PRESSED * largest[spot])

    def _outwards(
        self, cells: ndarray, inside: ndarray, held: ndarray, rings: int = CELLS
    ) -> ndarray:
        """Some cells, and those in contact around them that a region does not hold."""
        lost = cells.copy()
        for _ in range(rings if cells.any() else 0):
            lost[self.partition.across(lost)] = True
            lost &= inside
        return cells | (lost & ~held)

    def _corners(self, triangles: ndarray) -> ndarray:
        """Points that are corners of some triangles, by masks."""
        corners = np.zeros(len(self.own), dtype=bool)
        corners[self.t[:, triangles]] = True
        return corners & ~self.own

    def edges(self, level: ndarray) -> Segments:
        """Those of regions by their levels, (k, N)."""
        k, points = level.shape
        t = np.moveaxis(self.t + points * np.arange(k)[:, None, None], 0, 1).reshape(3, -1)
        return ContactRegion(np.tile(self.p, k), t, level.ravel()).segments(k)

    @computed_once
    def _cells_at(self) -> csr_matrix:
        """The cell of each point, or those that meet there, (N, n) of bool."""
        rows, columns = np.arange(len(self.cell)), self.cell
        if not self.own.all():
            rows, columns = self.t.ravel(), np.tile(self._of_triangles, 3)
        shape = len(self.cell), len(self.partition)
        return csr_matrix((np.ones(len(rows), bool), (rows, columns)), shape)

    def _levels(self, pressure: ndarray, opening: ndarray) -> ndarray:
        """``level`` of the regions, (k, N), from pressures and openings over the law of the plan's
        edge."""
        sides = self.partition.neighbours
        unit, inside = pressure.max(axis=1, keepdims=True), pressure > 0
        square, gaps = (pressure / unit) ** 2, (opening.clip(0) / unit) ** (2 / 3)
        level = np.where(inside, FAR, -FAR)[:, self.cell] * self._sizes
        unlike = inside[:, sides[0]] != inside[:, sides[1]]
        # pictures with as many pairs of cells to look at are drawn together
        pairs = np.minimum(unlike.sum(axis=1), AROUND)
        for number in np.unique(pairs[pairs > 0]):
            some = np.nonzero(pairs == number)[0]
            level[some] = self._drawn(sides, unlike[some], level[some], square[some], gaps[some])
        # planes may lead above zero where no cell is in contact, nor one across a side
        picture, side = np.nonzero(unlike)
        inside[picture, sides[:, side]] = True
        of, point = np.nonzero((level > 0) & ~inside[:, self.cell])
        if len(point):
            around = self._cells_at[point]
            met = inside[np.repeat(of, np.diff(around.indptr)), around.indices]
            out = ~np.logical_or.reduceat(met, around.indptr[:-1])
            level[of[out], point[out]] *= -1
        return level

    def _drawn(
        self, sides: ndarray, unlike: ndarray, level: ndarray, square: ndarray, gaps: ndarray
    ) -> ndarray:
        """``level`` of pictures by those of far cells, between some neighbours ``sides``."""
        k, n = square.shape
        picture, side = np.nonzero(unlike)
        pairs, points = sides[:, side], np.arange(level.shape[1])
        x, sizes = self.partition.centroids, np.sqrt(self.partition.areas)
        if n <= MANY:
            planes = self._planes
        else:
            near, points = self._near(pairs)
            pairs, n = np.searchsorted(near, pairs), len(near)
            x, sizes, square, gaps = x[:, near], sizes[near], square[:, near], gaps[:, near]
            planes = PlaneFit.to_nearest(x, self.p[:, points], self._even)
        tiled = np.tile(x, k), np.tile(sizes, k)
        cells = Seen(*tiled, square.ravel(), gaps.ravel(), self._even)
        starts = np.searchsorted(picture, np.arange(k + 1))
        distance = edge_distance(n, pairs + n * picture, starts, cells)
        distance = np.clip(distance, -FAR * cells.sizes, FAR * cells.sizes)
        level[:, points] = planes.values(distance.reshape(k, n))
        lines = self.edges(level)
        moved = moved_line(lines, n * np.arange(k + 1), cells)
        # points farther from the edge keep their distance to where it was
        near = np.abs(level[:, points]) < MOVED * self._sizes[points]
        of, point = np.nonzero(near & (np.diff(lines.starts) > 0)[:, None])
        point = points[point]
        at = self.p[:, point]
        found = np.copysign(lines.signed_distance(at, of), level[of, point])
        level[of, point] = found + mean_of_nearest(lines, moved, at, of)
        return level


def _thin(partition: Partition, inside: ndarray, held: ndarray) -> ndarray:
    """Cells in contact far from any that has none but such beside it.

    ``held`` are cells in a part of which there is contact by the law of its edge.
    """
    near = inside & held
    near[partition.across(inside)] = False
    for _ in range(SHOWN):
        near[partition.across(near)] = True
        near &= inside
    return inside & ~near
