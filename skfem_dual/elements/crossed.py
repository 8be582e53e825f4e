"""Cells that the line of contact crosses, with pressures on the side in contact only.

Pressures end there like the root of the distance s to the line, and what moves the line a little
adds some that grow like ``s^(-1/2)``; both times the law of the edge of the plan, which the line
may meet. They are taken as uniform on small triangles, by their means.

Source: K. L. Johnson, Contact Mechanics (1985), section 5.1.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.fan import Fan
from ..grids.lines import signed_distance
from ..grids.partition import Partition
from ..grids.polygons import Polygons
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.once import computed_once
from ..kernels.threads import Threads
from .edge_weights import EdgeWeights, mean_weight
from .graded_rule import graded
from .moments import far_influence, load_moments, series_terms
from .pieces import Pieces
from .remainder import add_rows, remainder_blocks
from .ribs import rib_integral

#: cells farther from the line than so many times their size are not looked at
REACH = 4.0
#: sizes of a cell from which on its pressures act by a series, and of a triangle up to which it is
#: integrated over its sides; between them it acts by its second moments
FAR, EXACT = 5.0, 4.0


@dataclass(frozen=True, eq=False)
class LineLaw:
    """One of both pressures on crossed cells.

    Attributes
    ----------
    density : (m,) array of float
        Pressure on each triangle by unit mean pressure on its cell.
    pairs : (2, k) array of int
        Crossed cells whose centroids are out of contact, and neighbours of which they are not.
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
    triangles : Polygons
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

    triangles: Polygons
    cells: ndarray
    cell: ndarray
    part: ndarray
    crossed: ndarray
    in_contact: ndarray
    laws: tuple[LineLaw, LineLaw]

    @classmethod
    def from_lines(
        cls,
        partition: Partition,
        fan: Fan,
        weights: EdgeWeights,
        lines: list[ndarray],
        touching: ndarray,
    ) -> Self | None:
        """Those of some lines; None if they cross no cell.

        Parameters
        ----------
        partition : Partition
            The n cells.
        fan : Fan
            Triangles of all of them.
        weights : EdgeWeights
            The law of the edge of the plan.
        lines : list of (2, k) array of float
            Lines with contact to their left.
        touching : (n,) array of bool
            Cells in contact, as far from the lines as they are not crossed.
        """
        size = np.sqrt(partition.areas)
        middle = signed_distance(partition.centroids, lines)
        near = np.abs(middle) < REACH * size
        own = near[fan.cell]
        used = np.unique(fan.t[:, own])
        depth = np.zeros(fan.p.shape[1])
        depth[used] = signed_distance(fan.p[:, used], lines)
        depth[np.abs(depth) < 1e-9 * size.min()] = 0.0
        crossed = near.copy()
        for side in (depth > 0, depth < 0):
            crossed &= np.bincount(fan.cell, own & side[fan.t].any(axis=0), len(near)) > 0
        if not crossed.any():
            return None
        own = crossed[fan.cell]
        fan = replace(fan, t=fan.t[:, own], cell=fan.cell[own], part=fan.part[own])
        fan, depth = fan.cut_at_zero(depth)
        own = (depth[fan.t] > 0).any(axis=0)
        t = fan.t[:, own]
        p, t, of = _quarters(fan.p, t)
        cell, part = fan.cell[own][of], fan.part[own][of]
        in_contact = np.where(near, middle > 0, touching)
        depth = np.append(depth, signed_distance(p[:, len(depth) :], lines))
        depth = depth.clip(1e-12 * size.min())  # never zero, as is the root of the law of the edge
        square, law = depth[t], _edge_law(weights, p, t, cell)
        rising, growing = _roots(square)
        triangles = Polygons(p, t.T.ravel(), np.arange(0, t.size + 1, 3))
        at_middle = np.where(in_contact, np.abs(middle), np.nan)
        pairs = _carrying(partition, crossed & ~in_contact, in_contact)
        laws = []
        for values, power in ((rising, 0.5), (growing, -0.5)):
            load = np.bincount(cell, values * law * triangles.areas, len(near))
            mean = np.where(crossed, load / partition.areas, np.nan)
            there = at_middle**power * weights.in_cells
            density = values * law / mean[cell]
            laws.append(_law(partition, pairs, density, mean, there))
        known = np.nonzero(crossed)[0], cell, part, crossed, in_contact
        return cls(triangles, *known, (laws[0], laws[1]))

    def influence(self, substrate: Substrate, x: ndarray) -> ndarray:
        """Settlements of points of shape (2, m) under unit mean pressures of each law on the k
        cells, shape (2, m, k)."""
        out, loads = np.empty((2, len(self.cells), x.shape[1])), self._loads
        (points,), c = inputs(x), substrate.singular_coefficient
        with Threads() as run:
            run(lambda k: _fill(k.start, k.stop, points, c, loads, out), len(self.cells))
        out = out.swapaxes(1, 2)
        if substrate.remainder is not None:
            rest = np.zeros((x.shape[1], len(self.cell)))
            none = np.empty((2, 0), dtype=int)
            cells = Partition(self.triangles, none, none, self.triangles.centroids, none[0])
            with Threads() as run:
                for some, add in remainder_blocks(substrate, cells, None, x):
                    run(partial(add_rows, add, rest[:, some]), x.shape[1])
            out = out + np.add.reduceat(rest * loads.density[:, None], loads.starts[:-1], axis=2)
        return out

    @computed_once
    def _loads(self) -> "Loads":
        triangles, ends = self.triangles, np.searchsorted(self.cell, self.cells, "right")
        starts = np.append(0, ends)
        corners = triangles.p[:, triangles.indices.reshape(-1, 3)]
        centroids, areas = triangles.centroids, triangles.areas
        radii = np.hypot(*(corners - centroids[..., None])).max(axis=1)
        total = np.add.reduceat(areas, starts[:-1])
        middles = np.add.reduceat(areas * centroids, starts[:-1], axis=1) / total
        of = np.repeat(np.arange(len(self.cells)), np.diff(starts))
        each, density = np.arange(len(of)), np.stack([law.density for law in self.laws])
        pieces = Pieces(
            corners.reshape(2, -1), triangles.offsets, np.ones(len(of)), each, each + 1
        )
        reach = np.hypot(*(corners - middles[:, of, None])).max(axis=1)
        far = (FAR * np.maximum.reduceat(reach, starts[:-1])) ** 2
        moments = load_moments(pieces, middles[:, of], 4)[:, :, None] * density
        moments = np.add.reduceat(moments, starts[:-1], axis=3)
        inertia = np.vstack([centroids, areas, triangles.second_moments])
        terms = series_terms(moments).swapaxes(0, 1)
        known = corners, inertia, (EXACT * radii) ** 2, density, starts, middles, far
        return Loads(*inputs(*known, moments[0, 0], terms))


class Loads(NamedTuple):
    """Triangles and cells, as kernels take them.

    Attributes
    ----------
    corners : (2, m, 3) array of float
        Of the triangles.
    inertia : (6, m) array of float
        Their centroids, areas and second moments.
    exact : (m,) array of float
        Squares of distances up to which they are integrated over their sides.
    density : (2, m) array of float
        Of both laws.
    starts : (k + 1,) array of int
        First triangles of the cells.
    middles : (2, k) array of float
        Points of the cells.
    far : (k,) array of float
        Squares of distances from these from which on series serve.
    mass, terms : (2, k) and (2, 14, k) array of float
        Series of both laws, see `series_terms`.
    """

    corners: ndarray
    inertia: ndarray
    exact: ndarray
    density: ndarray
    starts: ndarray
    middles: ndarray
    far: ndarray
    mass: ndarray
    terms: ndarray


@vectorised
def _fill(begin, end, x, c, loads, out):
    """Settlements under both laws on some cells, ``out`` of shape (2, k, m)."""
    corners, inertia, exact, density, starts, middles, far, mass, terms = loads
    m = x.shape[1]
    near, x0, y0 = np.empty(m, np.int64), np.empty(m), np.empty(m)
    value, one, two = np.empty(m), np.empty(m), np.empty(m)
    for j in range(begin, end):
        for law in range(2):
            own = terms[law]
            for i in range(m):
                dx, dy = x[0, i] - middles[0, j], x[1, i] - middles[1, j]
                r = np.sqrt(dx * dx + dy * dy)
                out[law, j, i] = c * (mass[law, j] / r + far_influence(dx, dy, far[j], own, j))
        count = 0
        for i in range(m):
            dx, dy = x[0, i] - middles[0, j], x[1, i] - middles[1, j]
            if dx * dx + dy * dy < far[j]:
                near[count], x0[count], y0[count] = i, x[0, i], x[1, i]
                one[count], two[count] = 0.0, 0.0
                count += 1
        for k in range(starts[j], starts[j + 1]):
            cx, cy, area = inertia[0, k], inertia[1, k], inertia[2, k]
            xx, xy, yy = inertia[3, k], inertia[4, k], inertia[5, k]
            for i in range(count):
                dx, dy = x0[i] - cx, y0[i] - cy
                f = 1 / (dx * dx + dy * dy)
                turned = 3 * f * (xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy) - xx - yy
                value[i] = np.sqrt(f) * (area + f * turned / 2)
            for i in range(count):
                dx, dy = x0[i] - cx, y0[i] - cy
                if dx * dx + dy * dy < exact[k]:
                    value[i] = _over_triangle(x0[i], y0[i], corners, k)
            for i in range(count):
                one[i] += density[0, k] * value[i]
                two[i] += density[1, k] * value[i]
        for i in range(count):
            out[0, j, near[i]], out[1, j, near[i]] = c * one[i], c * two[i]


@compiled
def _over_triangle(x, y, corners, k):
    """Integral of 1/r over a triangle."""
    total = 0.0
    ax, ay = corners[0, k, 2], corners[1, k, 2]
    r1 = np.sqrt((x - ax) ** 2 + (y - ay) ** 2)
    for end in range(3):
        bx, by = corners[0, k, end], corners[1, k, end]
        r2 = np.sqrt((x - bx) ** 2 + (y - by) ** 2)
        lx, ly = bx - ax, by - ay
        total += rib_integral(x, y, ax, ay, lx, ly, np.sqrt(lx * lx + ly * ly), r1, r2)
        ax, ay, r1 = bx, by, r2
    return total


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
    used, at = np.unique(t, return_inverse=True)
    root = np.sqrt(weights.phi_at(p[:, used]))[at.reshape(t.shape)]
    root = root.clip(1e-10 * root.max())
    return mean_weight(*root) * weights.factor(cell, np.sqrt(np.mean(root**2, axis=0)))


def _roots(square: ndarray) -> tuple[ndarray, ndarray]:
    """Means over triangles of the root of what is linear, (3, m), and of its inverse."""
    whole = np.repeat(np.eye(3)[..., None], square.shape[1], axis=2)
    root, inverse = np.zeros((2, square.shape[1]))
    for at, load in graded(whole, square, 2):  # exact
        root += np.sum(load * np.einsum("ikq,ik->kq", at, square), axis=1)
        inverse += load.sum(axis=1)
    return root, inverse


def _carrying(partition: Partition, outer: ndarray, inner: ndarray) -> ndarray:
    """Some cells and their neighbours among others, both (n,) array of bool; shape (2, k)."""
    n, f2c = len(partition), partition.f2c
    pairs = np.hstack([f2c, f2c[::-1]])
    pairs = pairs[:, (pairs.min(axis=0) >= 0) & outer[pairs[0]] & inner[pairs[1]]]
    return np.stack(np.divmod(np.unique(pairs[0].astype(np.int64) * n + pairs[1]), n))


def _law(
    partition: Partition, pairs: ndarray, density: ndarray, mean: ndarray, there: ndarray
) -> LineLaw:
    """From means over crossed cells, and values at centroids in contact, else NaN each."""
    (own, other), x, crossed = pairs, partition.centroids, ~np.isnan(mean)
    share = 1 / np.sum((x[:, own] - x[:, other]) ** 2, axis=0)
    of_all = np.bincount(own, share, len(mean))[own]
    share *= mean[own] / np.where(crossed, mean, there)[other] / of_all
    inside = crossed & ~np.isnan(there)
    relative = np.divide(there, mean, out=np.ones_like(mean), where=inside)
    return LineLaw(density, pairs, share, relative)
