"""Cells that the line of contact crosses, with pressures on the side in contact only.

Pressures end there like the root of the distance s to the line, and what moves the line a little
adds some that grow like ``s^(-1/2)``; both times the law of the edge of the plan, which the line
may meet. They are taken as uniform on small triangles, by their means.

Source: K. L. Johnson, Contact Mechanics (1985), section 5.1.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix

from ..grids.corners import signed_areas
from ..grids.fan import Fan
from ..grids.lines import Segments
from ..grids.partition import Partition
from ..grids.planar import ragged
from ..grids.polygons import Polygons
from ..ground.substrates import Substrate
from ..kernels.compiled import inputs
from ..kernels.threads import Threads
from .crossed_loads import Loads, fill
from .edge_weights import EdgeWeights, mean_weight
from .remainder import add_rows, remainder_blocks

#: cells farther from the line than so many times their size are not looked at
REACH = 4.0
#: lines cross cells whose centroids are not farther than their corners, but for rounding
ROUNDED = 1.000001


@dataclass(frozen=True, eq=False)
class LineLaw:
    """One of both pressures on crossed cells.

    Attributes
    ----------
    density : (m,) array of float
        Pressure on each triangle by unit mean pressure on its cell.
    pairs : (2, k) array of int
        Crossed cells whose centroids are out of contact, and those near of which they are not.
    share : (k,) array of float
        Mean pressure of the first by unit mean pressure of the second: they carry as much, over
        the law, as their neighbours do.
    relative : (n,) array of float
        What mean pressures are at the centroids, the law of the plan's edge apart.
    """

    density: ndarray
    pairs: ndarray
    share: ndarray
    relative: ndarray


@dataclass(frozen=True, eq=False)
class CrossedCells:
    """Triangles that fill the part of crossed cells that is in contact.

    Attributes
    ----------
    loads : Loads
        The m triangles, those of a cell one after the other.
    cells : (k,) array of int
        The cells, ascending.
    cell, part : (m,) array of int
        Cell of each triangle, and part of the cell, as of `Fan`.
    crossed, in_contact : (n,) array of bool
        Whether the line crosses each cell, and whether its centroid is in contact.
    laws : tuple of LineLaw
        Pressures like ``s^(1/2)`` and like ``s^(-1/2)``.
    """

    loads: Loads
    cells: ndarray
    cell: ndarray
    part: ndarray
    crossed: ndarray
    in_contact: ndarray
    laws: tuple[LineLaw, ...]

    @classmethod
    def from_lines(
        cls,
        partition: Partition,
        fan: Fan,
        weights: EdgeWeights,
        lines: Segments,
        touching: ndarray,
    ) -> list[Self | None]:
        """Those of the lines in some pictures; None where they cross no cell.

        Parameters
        ----------
        partition : Partition
            The n cells.
        fan : Fan
            Triangles of all of them.
        weights : EdgeWeights
            The law of the edge of the plan.
        lines : Segments
            Lines with contact to their left.
        touching : (k, n) array of bool
            Cells in contact, as far from the lines as they are not crossed.
        """
        k, n = touching.shape
        size, each = np.sqrt(partition.areas), np.repeat(np.arange(k), n)
        middle = lines.signed_distance(np.tile(partition.centroids, k), each).reshape(k, n)
        near = np.abs(middle) < REACH * size
        in_contact = np.where(near, middle > 0, touching)
        reached = near & (np.abs(middle) <= ROUNDED * partition.polygons.radii)
        fan, depth = _fan_of(fan, reached, lines)
        depth[np.abs(depth) < 1e-9 * size.min()] = 0.0
        crossed = reached.ravel()
        for side in (depth > 0, depth < 0):
            crossed &= np.bincount(fan.cell, side[fan.t].any(axis=0), k * n) > 0
        if not crossed.any():
            return [None] * k
        own = crossed[fan.cell]
        fan = replace(fan, t=fan.t[:, own], cell=fan.cell[own], part=fan.part[own])
        fan, depth = fan.cut_at_zero(depth)
        own = (depth[fan.t] > 0).any(axis=0)
        p, t, of = _quarters(fan.p, fan.t[:, own])
        cell, part = fan.cell[own][of], fan.part[own][of]
        new = p[:, len(depth) :], np.tile(fan.cell[own] // n, 3)
        depth = np.append(depth, lines.signed_distance(*new))
        depth = depth.clip(1e-12 * size.min())  # never zero, as is the root of the law of the edge
        square, law = depth[t], _edge_law(weights, p, t, cell % n)
        inner, areas = in_contact.ravel(), np.tile(partition.areas, k)
        pairs = _carrying(partition, crossed & ~inner, inner)
        laws, over = [], signed_areas(p, t)
        for values, power in zip(_roots(square), (0.5, -0.5), strict=True):
            load = np.bincount(cell, values * law * over, k * n)
            mean = np.where(crossed, load / areas, np.nan)
            there = np.where(in_contact, np.abs(middle), np.nan) ** power * weights.in_cells
            laws.append(_law(partition, pairs, values * law / mean[cell], mean, there.ravel()))
        (cells,) = np.nonzero(crossed)
        starts = np.append(np.searchsorted(cell, cells), len(cell))
        loads = Loads.of(p, t, starts, np.stack([law.density for law in laws]))
        whole = cls(loads, cells, cell, part, crossed, inner, tuple(laws))
        return [whole._picture(i, n) for i in range(k)]

    def _picture(self, i: int, n: int) -> Self | None:
        """Those of one picture of n cells."""
        some = slice(*np.searchsorted(self.cells, [i * n, i * n + n]).tolist())
        if some.start == some.stop:
            return None
        own, all_of_it = (
            slice(*self.loads.starts[[some.start, some.stop]]),
            slice(i * n, i * n + n),
        )
        pairs = slice(*np.searchsorted(self.laws[0].pairs[0], [i * n, i * n + n]))
        laws = tuple(
            LineLaw(
                law.density[own],
                law.pairs[:, pairs] - i * n,
                law.share[pairs],
                law.relative[all_of_it],
            )
            for law in self.laws
        )
        return replace(
            self,
            loads=self.loads.part(some),
            cells=self.cells[some] - i * n,
            cell=self.cell[own] - i * n,
            part=self.part[own],
            crossed=self.crossed[all_of_it],
            in_contact=self.in_contact[all_of_it],
            laws=laws,
        )

    @property
    def centroids(self) -> ndarray:
        """Of the triangles, (2, m)."""
        return self.loads.inertia[:2]

    @property
    def areas(self) -> ndarray:
        """Of the triangles, (m,)."""
        return self.loads.inertia[2]

    def influence(self, substrate: Substrate, x: ndarray, nlaws: int = 2) -> ndarray:
        """Settlements of points of shape (2, m) under unit mean pressures of each law on the k
        cells, or of the first, shape (nlaws, k, m)."""
        out, loads = np.empty((nlaws, len(self.cells), x.shape[1])), self.loads
        (points,), c = inputs(x), substrate.singular_coefficient
        with Threads() as run:
            run(lambda k: fill(k.start, k.stop, points, c, loads, out), len(self.cells))
        if substrate.remainder is not None:
            rest, m = np.zeros((x.shape[1], len(self.cell))), len(self.cell)
            none, offsets = np.empty((2, 0), dtype=int), np.arange(0, 3 * m + 1, 3)
            triangles = Polygons(loads.corners.reshape(2, -1), np.arange(3 * m), offsets)
            cells = Partition(triangles, none, none, triangles.centroids, none[0])
            with Threads() as run:
                for some, add in remainder_blocks(substrate, cells, None, x):
                    run(partial(add_rows, add, rest[:, some]), x.shape[1])
            rest = rest * loads.density[:nlaws, None]
            added = np.add.reduceat(rest, loads.starts[:-1], axis=2)
            out += added.swapaxes(1, 2)
        return out


def _fan_of(fan: Fan, reached: ndarray, lines: Segments) -> tuple[Fan, ndarray]:
    """Triangles of some cells in each of k pictures, (k, n) array of bool, and the distances of
    their points to lines; cells count on from one picture to the next."""
    (cells,), (n, points) = np.nonzero(reached.ravel()), (reached.shape[1], fan.p.shape[1])
    firsts = fan.starts[cells % n]
    owner, position = ragged(fan.starts[cells % n + 1] - firsts)
    triangle, cell = firsts[owner] + position, cells[owner]
    t = fan.t[:, triangle] + points * (cell // n)
    used = np.zeros(points * len(reached), dtype=bool)
    used[t] = True
    (which,) = np.nonzero(used)
    t, p = (np.cumsum(used) - 1)[t], fan.p[:, which % points]
    return Fan(p, t, cell, fan.part[triangle]), lines.signed_distance(p, which // points)


def _quarters(p: ndarray, t: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """Points and triangles, each cut in four, and the number of the triangle each lies in."""
    m, n = t.shape[1], p.shape[1]
    middles = ((p[:, t] + p[:, np.roll(t, -1, axis=0)]) / 2).reshape(2, -1)
    (a, b, c), (ab, bc, ca) = t, n + np.arange(3 * m).reshape(3, m)
    parts = [a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]
    quarters = np.stack([*map(np.array, parts)], axis=-1)  # those of a triangle together
    return np.hstack([p, middles]), quarters.reshape(3, -1), np.repeat(np.arange(m), 4)


def _edge_law(weights: EdgeWeights, p: ndarray, t: ndarray, cell: ndarray) -> ndarray:
    """Mean of the law of the edge over triangles."""
    used = np.zeros(p.shape[1], dtype=bool)
    used[t] = True
    root = np.empty(len(used))
    root[used] = np.sqrt(weights.phi_at(p[:, used]))
    root = root[t].clip(1e-10 * root[used].max())
    return mean_weight(*root) * weights.factor(cell, np.sqrt(np.mean(root**2, axis=0)))


def _roots(square: ndarray) -> tuple[ndarray, ndarray]:
    """Means over triangles of the root of what is linear, (3, m), and of its inverse."""
    a, b, c = np.sqrt(square)
    ab, bc, ca = a * b, b * c, c * a
    # as of `mean_weight`, a divided difference of 4/15 of the fifth power
    top = ab * (a * a + ab + b * b) + bc * (b * b + bc + c * c) + ca * (c * c + ca + a * a)
    top += 2 * ab * c * (a + b + c)
    return 8 / 15 * top / ((a + b) * (b + c) * (c + a)), mean_weight(a, b, c)


def _carrying(partition: Partition, outer: ndarray, inner: ndarray) -> ndarray:
    """Some cells and those among others whose pressures they carry, in k pictures of the cells,
    both (k n,) array of bool: their neighbours, and without such the neighbours of all these;
    shape (2, m)."""
    n, f2c = len(partition), partition.neighbours
    own, other = np.hstack([f2c, f2c[::-1]])
    picture, pair = np.nonzero(outer.reshape(-1, n)[:, own] & inner.reshape(-1, n)[:, other])
    cell, beside = picture * n + own[pair], other[pair]
    (alone,) = np.nonzero(outer & (np.bincount(cell, minlength=len(outer)) == 0))
    if len(alone):  # at the edge of the plan, where pressures are greatest
        sides = csr_matrix((np.ones(len(own)), (own, other)), shape=(n, n))
        farther = (sides[alone % n] @ sides).tocoo()
        to, column = alone[farther.row], farther.col
        found = inner[to - to % n + column]
        cell, beside = np.append(cell, to[found]), np.append(beside, column[found])
    cell, beside = np.divmod(np.unique(cell * n + beside), n)
    return np.stack([cell, cell - cell % n + beside])


def _law(
    partition: Partition, pairs: ndarray, density: ndarray, mean: ndarray, there: ndarray
) -> LineLaw:
    """From means over crossed cells, and values at centroids in contact, else NaN each."""
    (own, other), x, crossed = pairs, partition.centroids, ~np.isnan(mean)
    n = len(partition)
    share = 1 / np.sum((x[:, own % n] - x[:, other % n]) ** 2, axis=0)
    of_all = np.bincount(own, share, len(mean))[own]
    share *= mean[own] / np.where(crossed, mean, there)[other] / of_all
    inside = crossed & ~np.isnan(there)
    relative = np.divide(there, mean, out=np.ones_like(mean), where=inside)
    return LineLaw(density, pairs, share, relative)
