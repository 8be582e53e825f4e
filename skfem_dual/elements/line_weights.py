"""Pressures that end inside the cells: the square root of the distance to the line of contact.

Where contact ends smoothly the pressure falls like the root of the distance s to that line. Cells
that the line crosses or that lie near it are weighted by ``s^(1/2)`` in contact and zero beyond,
as at the edge of the plan by its law; the line cuts the triangles that fill them.

Source: K. L. Johnson, Contact Mechanics (1985), section 5.1.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray

from ..grids.fan import Fan
from ..grids.lines import Segments
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .edge_weights import EdgeWeights
from .law_moments import LawFactors

#: cells over which the root varies by less than this factor are left constant
VARIATION = 1.3
#: values of the law, linear in between; the first one beyond zero is all it is off
VALUES = 2**14
#: greatest value of the law over its mean in a cell of which a little is in contact
TINY = 30.0
#: cells farther from it than so many times as far as they reach from their centroid are not
#: looked at: over them the root varies by less
REACH = 4.0

_SQUARES = readonly(np.linspace(0, 1, VALUES)[None] ** 2)


@dataclass(frozen=True, eq=False)
class LineWeights(EdgeWeights):
    """The weight ``s^(1/2)``, zero beyond the line, on cells near the line of contact.

    Attributes
    ----------
    depth : (k,) array of float
        Distance s to the line at the points of the fan, negative out of contact.
    in_points : (n,) array of float
        The same in the collocation points of the cells; far from the line its sign is known.
    constant : (n,) array of bool, optional
        Cells that are not weighted wherever they lie.
    """

    depth: ndarray
    in_points: ndarray
    constant: ndarray | None = None

    @classmethod
    def from_lines(
        cls, partition: Partition, fan: Fan, lines: Segments, points: ndarray, touching: ndarray
    ) -> Self:
        """Of the lines where contact ends.

        Parameters
        ----------
        partition : Partition
            The n cells.
        fan : Fan
            Triangles of all of them.
        lines : Segments
            Lines with contact to their left.
        points : (2, n) array of float
            Collocation points of the cells.
        touching : (n,) array of bool
            Cells in contact, as far from the lines as they are not weighted.
        """
        size = np.sqrt(partition.areas)
        in_points = lines.signed_distance(points)
        near = np.abs(in_points) < REACH * partition.polygons.radii
        near[partition.across(near)] = True  # these carry, or are carried
        in_points = np.where(near, in_points, np.where(touching, size.max(), -size.max()))
        own = near[fan.cell]
        used = np.unique(fan.t[:, own])
        depth = lines.signed_distance(fan.p[:, used])
        depth = np.where(np.abs(depth) > 1e-9 * size.min(), depth, 0.0)
        everywhere = np.full(fan.p.shape[1], depth.max())
        everywhere[used] = depth
        fan = replace(fan, t=fan.t[:, own], cell=fan.cell[own], part=fan.part[own])
        fan, depth = fan.cut_at_zero(everywhere)
        ribs = np.empty(0, dtype=np.int32)
        return cls(partition, fan, ribs, readonly(depth), readonly(in_points))

    @computed_once
    def root(self) -> ndarray:
        """Root of the distance, and next to nothing out of contact."""
        root = np.sqrt(self.depth.clip(0))
        return readonly(root.clip(1e-20 * root.max()))

    @computed_once
    def factors(self) -> LawFactors:
        """``s``, over which ``s^(-1/2)`` is the weight."""
        most = self.root.max()
        values = readonly(most**2 * _SQUARES)
        own = np.zeros(len(self.partition), dtype=np.int32)
        return LawFactors(values, np.array([(VALUES - 1) / most]), own)

    def _means(self) -> tuple[ndarray, ndarray]:
        roots = self.root[self.fan.t]
        shares = np.stack([_mean_share(*np.roll(roots, -k, axis=0)) for k in range(3)])
        return shares.sum(axis=0), shares

    @computed_once
    def weighted(self) -> ndarray:
        """Whether each cell is weighted."""
        least, most = self.roots
        varied = (most > 1e-6 * self.root.max()) & (most > VARIATION * least)
        return readonly(varied if self.constant is None else varied & ~self.constant)

    @computed_once
    def tiny(self) -> ndarray:
        """Weighted cells of which only a little is in contact, (n,) array of bool."""
        most = self.roots[1]
        return readonly(self.weighted & (most > TINY * np.where(self.weighted, self.mean, np.inf)))

    def relative(self, cells: ndarray, root: ndarray) -> ndarray:
        """``w / mean(w)`` in some cells where the square root of the distance is ``root``."""
        return np.where(self.weighted[cells], root / self.mean[cells], 1.0)

    @property
    def in_contact(self) -> ndarray:
        """Whether each collocation point is in contact, (n,) array of bool."""
        return self.in_points > 0

    def at_points(self, pressure: ndarray) -> ndarray:
        """Pressures in the collocation points by means over the cells, shape (n,)."""
        root = np.sqrt(self.in_points.clip(0))
        return pressure * self.relative(np.arange(len(root)), root)

    @computed_once
    def carrying(self) -> tuple[ndarray, ndarray]:
        """Cells out of contact in their points that reach into it, beside neighbours that are in
        contact, (2, k), and what they carry of the mean pressures of these, (k,): as much, over
        the law, as the neighbours do."""
        n, sides, touching = len(self.partition), self.partition.neighbours, self.in_contact
        pairs = np.hstack([sides, sides[::-1]])
        # of cells far from the line, as beside holes between scattered ones, no law is known
        known = touching & np.isfinite(self.mean)
        pairs = pairs[:, (self.weighted & ~touching)[pairs[0]] & known[pairs[1]]]
        cell, other = np.divmod(np.unique(np.int64(n) * pairs[0] + pairs[1]), n)
        share = 1 / np.sum((self.centroids[:, cell] - self.centroids[:, other]) ** 2, axis=0)
        share *= self.mean[cell] / self.mean[other] / np.bincount(cell, share, n)[cell]
        return np.stack([cell, other]), share


def _mean_share(a: ndarray, b: ndarray, c: ndarray) -> ndarray:
    """Mean over a triangle of ``s^(1/2)`` times the barycentric coordinate of the vertex of a, by
    the roots of s in its vertices.

    By Hermite and Genocchi it is twice the divided difference of ``8/105 s^(7/2)`` at the four
    points a^2, a^2, b^2, c^2; all terms are positive.
    """
    s, q = b + c, b * c
    more, less = s * s + q, s * s - q
    top = 3 * a**5 * s + 6 * a**4 * s**2 + 4 * a**3 * s * more + 2 * a**2 * s**2 * more
    top += 4 * a * q * s * less + 2 * q**2 * less
    return 8 / 105 * top / ((a + b) ** 2 * (a + c) ** 2 * s)
