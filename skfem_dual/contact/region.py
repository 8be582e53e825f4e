"""Where a punch touches the ground, with an edge finer than the cells.

Where contact ends smoothly the pressure falls like the square root of the distance s to its edge
and the gap opens like the power 3/2, with one strength K for both (K. L. Johnson, Contact
Mechanics, 1985, section 5.1): ``p = K s^(1/2)``, ``gap = 4 K s^(3/2) / (3 E*)``. So pressures and
gaps on both sides of the edge become distances to it, whose zero is the edge; `contact_line` finds
it once more by second degree. Where the edge meets that of the plan both grow by its law, too, and
are taken over it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree
from skfem import Mesh

from ..elements.edge_weights import EdgeWeights
from ..grids.corners import signed_areas
from ..grids.lines import signed_distance
from ..grids.mappings import own_mapping
from ..grids.partition import Partition
from ..grids.planar import contours
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .contact_line import moved_line

#: neighbours over which planes are fitted and strengths averaged
AROUND = 7
#: planes through points nearly on one line, by the determinant of their equations, are fitted
#: with more care; planes at a time
FLAT, CHUNK = 1e-5, 4096
#: points of a line over which its way is averaged
NEAREST = 3
#: sizes of a cell, farther than which the sign of the distance is all that counts
FAR = 3.0
#: of more cells only those up to so many from the edge of contact are looked at, for points on
#: triangles up to so many from it
MANY, CELLS, POINTS = 20_000, 9, 3


@dataclass(frozen=True, eq=False, repr=False)
class ContactRegion:
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
    """

    p: ndarray
    t: ndarray
    level: ndarray

    @classmethod
    def from_cells(
        cls, partition: Partition, mesh: Mesh, pressure: ndarray, gap: ndarray, modulus: float
    ) -> "ContactRegion":
        """From pressures and gaps of cells.

        Parameters
        ----------
        partition : Partition
            The n cells.
        mesh : Mesh
            The mesh they belong to, of triangles or quadrilaterals.
        pressure, gap : (n,) array of float
            Of each cell.
        modulus : float
            Contact modulus E* of the surface.
        """
        return PlanTriangles.of(partition, mesh).region(pressure, gap, modulus)

    @classmethod
    def together(cls, regions: Sequence["ContactRegion"]) -> "ContactRegion":
        """Those under several bodies."""
        firsts = np.cumsum([0, *(region.p.shape[1] for region in regions)])
        t = np.hstack([region.t + first for region, first in zip(regions, firsts)])
        p, level = (np.hstack([getattr(r, name) for r in regions]) for name in ("p", "level"))
        return cls(readonly(p), readonly(t), readonly(level))

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
    def _cut(self) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """Triangles the edge runs through, turned so that one vertex is alone on its side.

        Their vertices, whether that one is in contact, and where on the sides from it to the
        second and third vertex the edge passes, in parts of them.
        """
        inside = self._inside
        crossed = inside.any(axis=0) & ~inside.all(axis=0)
        t, inside = self.t[:, crossed], inside[:, crossed]
        alone = np.argmax(inside == (inside.sum(axis=0) == 1), axis=0)
        t = np.take_along_axis(t, (alone + np.arange(3)[:, None]) % 3, axis=0)
        a, b, c = self.level[t]
        return t, a > 0, a / (a - b), a / (a - c)

    @computed_once
    def area(self) -> float:
        """Area of the region."""
        t, inside, onward, back = self._cut
        corner = signed_areas(self.p, t) * onward * back
        whole = self.t[:, self._inside.all(axis=0)]
        parts = np.where(inside, corner, signed_areas(self.p, t) - corner)
        return float(signed_areas(self.p, whole).sum() + parts.sum())

    @computed_once
    def edge(self) -> list[ndarray]:
        """The edge of contact inside the plan: lines of shape (2, k), the region to their left.

        Where contact reaches the edge of the plan, that edge is not part of it; a line that ends
        there is open, others end where they begin.
        """
        (lone, second, third), inside, *_ = self._cut
        if len(lone) == 0:
            return []
        a, b = np.where(inside, [second, third], [third, second])
        sides = np.sort([[lone, a], [lone, b]], axis=1).astype(np.int64)
        number, order = contours(sides[:, 0] * self.p.shape[1] + sides[:, 1], np.zeros(len(lone)))
        # from one end of each side, whichever triangle it is seen from: closed lines close
        first, last = sides.swapaxes(0, 1)
        share = self.level[first] / (self.level[first] - self.level[last])
        begin, end = np.moveaxis(
            self.p[:, first] + share * (self.p[:, last] - self.p[:, first]), 1, 0
        )
        lines = np.split(order, np.nonzero(np.diff(number))[0] + 1)
        return [readonly(np.hstack([begin[:, i], end[:, i[-1:]]])) for i in lines]

    def crossed(self, mesh: Mesh) -> ndarray:
        """Elements of a mesh through which the edge runs, for ``mesh.refined``.

        They are those with one of the edge's segments in them; ``mesh`` may be the one of the
        solution or another of the same plan.
        """
        if not self.edge:
            return np.empty(0, dtype=np.int64)
        middles = np.hstack([(line[:, 1:] + line[:, :-1]) / 2 for line in self.edge])
        return np.unique(mesh.element_finder(own_mapping(mesh))(*middles))


@dataclass(frozen=True, eq=False)
class PlanTriangles:
    """Triangles on which contact regions of the same cells are drawn.

    Attributes
    ----------
    partition : Partition
        The cells.
    p, t
        As of `ContactRegion`.
    law : (n,) array of float
        The law of the plan's edge in the middles of the cells: pressures and gaps grow by it.
    cell : (N,) array of int
        A cell at each point.
    """

    partition: Partition
    p: ndarray
    t: ndarray
    law: ndarray
    cell: ndarray

    @classmethod
    def of(
        cls, partition: Partition, mesh: Mesh, weights: EdgeWeights | None = None
    ) -> "PlanTriangles":
        """Those of a mesh of triangles, or a quarter each of quadrilaterals."""
        p, t = mesh.p, mesh.t
        cell = np.arange(len(partition))
        if not np.array_equal(partition.nodes, p):  # one for each node
            cell = np.empty(p.shape[1], dtype=int)
            cell[t] = np.arange(t.shape[1])
        halves = [signed_areas(p, t[[0, i, i + 1]]) for i in range(1, len(t) - 1)]
        clockwise = np.sum(halves, axis=0) < 0
        if len(t) == 4:
            middle = p.shape[1] + np.arange(t.shape[1])
            cell = np.append(cell, np.arange(t.shape[1]))
            p = np.hstack([p, p[:, t].mean(axis=1)])
            t = np.hstack([[t[i], t[(i + 1) % 4], middle] for i in range(4)], dtype=np.int32)
            clockwise = np.tile(clockwise, 4)
        if clockwise.any():
            t = np.where(clockwise, t[[0, 2, 1]], t)
        law = np.ones(len(partition)) if weights is None else weights.in_cells
        return cls(partition, readonly(p), readonly(t), law, readonly(cell))

    @computed_once
    def _planes(self) -> "PlaneFit":
        """From the centroids of the cells to the points."""
        return PlaneFit.to_nearest(self.partition.centroids, self.p)

    def _near(self, sides: ndarray, some: ndarray) -> tuple[ndarray, ndarray]:
        """Cells and points near some cells, by their numbers; neighbours are beside ``sides``."""
        near = np.zeros(len(self.partition), dtype=bool)
        near[some] = True
        points = near
        for ring in range(CELLS):
            points = near.copy() if ring == POINTS else points
            near[sides[:, near[sides[0]] != near[sides[1]]]] = True
        return np.nonzero(near)[0], np.nonzero(points[self.cell])[0]

    @computed_once
    def _whole(self) -> ContactRegion:
        """Contact everywhere."""
        return ContactRegion(self.p, self.t, readonly(np.ones(self.p.shape[1])))

    def region(self, pressure: ndarray, gap: ndarray, modulus: float) -> ContactRegion:
        """`ContactRegion.from_cells`."""
        if (gap <= 0).all():
            return self._whole
        level = np.full(self.p.shape[1], -1.0)
        if (pressure > 0).any():
            opening = gap * 0.75 * modulus / self.law
            level = self._level(pressure / self.law, opening)
        return ContactRegion(self.p, self.t, readonly(level))

    def _level(self, pressure: ndarray, opening: ndarray) -> ndarray:
        """``level`` of the region, from pressures and openings over the law of the plan's edge."""
        cells, inside = self.partition, pressure > 0
        x, sizes = cells.centroids, np.sqrt(cells.areas)
        sides = cells.f2c[:, cells.f2c[1] >= 0]
        pairs = sides[:, inside[sides[0]] != inside[sides[1]]]
        level = np.where(inside[self.cell], FAR, -FAR) * sizes[self.cell]
        points = np.arange(len(level))
        if len(cells) <= MANY:
            planes = self._planes
        else:
            near, points = self._near(sides, pairs)
            pairs = np.searchsorted(near, pairs)
            x, sizes, pressure, opening = x[:, near], sizes[near], pressure[near], opening[near]
            planes = PlaneFit.to_nearest(x, self.p[:, points])
        level[points] = planes(_edge_distance(x, sizes, pairs, pressure, opening))[0]
        if not (lines := ContactRegion(self.p, self.t, level).edge):
            return level
        on_line, moved = moved_line(lines, x, sizes, pressure, opening)
        distance = np.copysign(signed_distance(self.p[:, points], lines), level[points])
        nearest = cKDTree(on_line.T).query(self.p[:, points].T, min(NEAREST, len(moved)))[1]
        level[points] = distance + moved[nearest.reshape(len(points), -1)].mean(axis=1)
        return level


def _edge_distance(
    x: ndarray, sizes: ndarray, pairs: ndarray, pressure: ndarray, opening: ndarray
) -> ndarray:
    """About the distance of each cell to the edge of contact, positive in contact.

    ``pairs`` are neighbours, one in contact and one not: their distances to the edge add up.
    ``opening`` is 3 E* / 4 times the gap.
    """
    inside = pressure > 0
    opening = (opening.clip(0) / pressure.max()) ** (2 / 3)
    pressure = pressure / pressure.max()
    i = np.where(inside[pairs[0]], *pairs)
    j = pairs.sum(axis=0) - i
    step, middle = x[:, i] - x[:, j], (x[:, i] + x[:, j]) / 2
    near = cKDTree(middle.T).query(x.T, min(AROUND, len(i)))[1].reshape(x.shape[1], -1)
    across = 0.8 * np.hypot(*step)
    distance, planes = np.empty(len(pressure)), PlaneFit.to_nearest(x, middle, 2 * AROUND)
    for _ in range(3):  # the direction across the edge follows from the distances
        strength = np.median(_strength(pressure[i] ** 2, opening[j], across)[near], axis=1)
        distance = np.where(inside, pressure**2 * strength**3, -opening * strength)
        slope = planes(distance)[1:]
        normal = slope / np.hypot(*slope)
        across = np.maximum(np.sum(normal * step, axis=0), 0.3 * np.hypot(*step))
    # the law holds nearby only; far from the edge the sign is all that counts
    return np.clip(distance, -FAR * sizes, FAR * sizes)


def _strength(f: ndarray, g: ndarray, across: ndarray) -> ndarray:
    """The root z = K^(-2/3) of ``f z^3 + g z = across``, by Newton's method from above."""
    with np.errstate(divide="ignore"):
        z = np.minimum(np.cbrt(across / f), across / g)
    for _ in range(30):
        z = z - (f * z**3 + g * z - across) / (3 * f * z**2 + g)
    return z


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """Planes fitted to the nearest values of points, for any number of values.

    Attributes
    ----------
    near : (m, around) array of int
        The points each plane follows.
    inverse : (m, 3, around) array of float
        Value and both slopes of each plane by unit values there.
    """

    near: ndarray
    inverse: ndarray

    @classmethod
    def to_nearest(cls, x: ndarray, at: ndarray, around: int = AROUND) -> "PlaneFit":
        """Planes at points ``at``, shape (2, m), each following so many of the points ``x``."""
        near = cKDTree(x.T).query(at.T, min(around, x.shape[1]))[1].reshape(at.shape[1], -1)
        inverse = np.empty((len(near), 3, near.shape[1]))
        for begin in range(0, len(near), CHUNK):
            some = slice(begin, begin + CHUNK)
            inverse[some] = _planes(x[:, near[some]] - at[:, some, None])
        return cls(near, inverse)

    def __call__(self, values: ndarray) -> ndarray:
        """Value and both slopes of each plane, shape (3, m)."""
        return (self.inverse @ values[self.near][..., None])[..., 0].T


def _planes(arm: ndarray) -> ndarray:
    """Values and slopes of m planes by unit values at k points, (m, 3, k), from (2, m, k)."""
    reach = np.hypot(*arm).max(axis=1, keepdims=True)
    rows = np.stack([np.ones(arm.shape[1:]), *(arm / reach)], axis=1)
    matrix = rows @ rows.swapaxes(1, 2)
    # points on one line give no slope across it
    clear = np.linalg.det(matrix) > FLAT * np.prod(np.diagonal(matrix, axis1=1, axis2=2), axis=1)
    inverse = np.empty(rows.shape)
    inverse[clear] = np.linalg.solve(matrix[clear], rows[clear])
    inverse[~clear] = np.linalg.pinv(rows[~clear].swapaxes(1, 2), rcond=1e-6)
    inverse[:, 1:] /= reach[:, :, None]
    return inverse


def fitted_planes(x: ndarray, values: ndarray, at: ndarray) -> ndarray:
    """Values and slopes at points ``at`` of planes fitted to the nearest values of ``x``, (3, m).

    `PlaneFit` serves several values at the same points.
    """
    return PlaneFit.to_nearest(x, at)(values)
