"""How good a triangulation and the cells of its dual grid are; nothing here decides validity."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from ..kernels.once import ReadOnly, computed_once
from .corners import unit
from .planar import cross, rounding
from .polygons import readonly
from .report import Condition, Measure, where

#: a node nearer than this part of its facets to the mean of its neighbours counts as the mean
MEAN_MARGIN = 1e-8


@dataclass(frozen=True, eq=False)
class MeshQuality(ReadOnly):
    """Quantities of a triangulation that meets the structural conditions.

    Parameters
    ----------
    mesh : MeshTri
        The triangulation.
    """

    mesh: MeshTri

    @computed_once
    def sides(self) -> ndarray:
        """Sides of each triangle in ascending order, shape (3, ntriangles)."""
        v = self.mesh.p[:, self.mesh.t]
        return readonly(np.sort(np.hypot(*(np.roll(v, -1, axis=1) - v)), axis=0))

    @computed_once
    def smallest_angles(self) -> ndarray:
        """Smallest angle of each triangle in degrees."""
        return readonly(np.degrees(smallest_angles(self.mesh.p, self.mesh.t)))

    @computed_once
    def aspects(self) -> ndarray:
        """Circumradius over twice the inradius of each triangle: 1 if equilateral."""
        sides = self.sides * unit(self.mesh.p)  # fourth powers follow
        return readonly(np.prod(sides, axis=0) * sides.sum(axis=0) / (4 * self._twice_areas**2))

    @computed_once
    def from_means(self) -> ndarray:
        """Distance of each inner node from the mean of its neighbours, in its mean facet length.

        NaN at boundary nodes.
        """
        p, (a, b) = self.mesh.p, self.mesh.facets
        ends, others = np.append(a, b), np.append(b, a)
        count = np.bincount(ends)
        away = np.stack([np.bincount(ends, d) for d in p[:, others] - p[:, ends]]) / count
        length = np.bincount(ends, np.hypot(*(p[:, others] - p[:, ends]))) / count
        offset = np.hypot(*away) / length
        offset[self.mesh.boundary_nodes()] = np.nan
        return readonly(offset)

    @computed_once
    def starless(self) -> tuple[ndarray, ndarray]:
        """Nodes whose dual cells are not star-shaped: about the node, about the centroid.

        A cell is star-shaped about a point if its ribs run counter-clockwise around the point.
        """
        mesh = self.mesh
        (a, b), boundary = mesh.facets, mesh.boundary_facets()
        pa, pb = mesh.p[:, a], mesh.p[:, b]
        ends = mesh.p[:, mesh.t].mean(axis=1)[:, mesh.f2t]
        middle = (pa + pb)[:, boundary] / 2
        ends[:, 1, boundary] = middle
        # seen from its node `a` a rib runs from the right of the facet to the left
        left = cross(pb - pa, ends[:, 0] - pa) > 0
        begin, end = np.where(left, ends[:, ::-1], ends).swapaxes(0, 1)
        # the cell of a boundary node has half of two facets besides, with the domain on the left
        left, pa, pb = left[boundary], pa[:, boundary], pb[:, boundary]
        node = np.concatenate([a, b, a[boundary], b[boundary]])
        start = np.hstack([begin, end, np.where(left, pa, middle), np.where(left, middle, pb)])
        stop = np.hstack([end, begin, np.where(left, middle, pa), np.where(left, pb, middle)])

        around = mesh.p[:, node]
        twice = cross(start - around, stop - around)
        n = mesh.p.shape[1]
        centroids = (
            np.stack([np.bincount(node, twice * x, n) for x in (start + stop - 2 * around) / 3])
            / np.bincount(node, twice, n)
            + mesh.p
        )
        around = centroids[:, node]
        full = slice(2 * len(a))  # a half of a boundary facet ends in the node
        return (
            readonly(np.unique(node[full][twice[full] <= 0])),
            readonly(np.unique(node[cross(start - around, stop - around) <= 0])),
        )

    @property
    def _twice_areas(self) -> ndarray:
        v = self.mesh.p[:, self.mesh.t] * unit(self.mesh.p)
        return np.abs(cross(v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]))

    def conditions(self) -> Iterator[Condition]:
        """Conditions that are sufficient or desirable for the dual grid, not necessary."""
        c, b, a = self.sides**2
        m, n = self.mesh.t.shape[1], self.mesh.p.shape[1]
        yield Condition(
            "a^2 + b^2 < 5 c^2 for the sides a > b > c, sufficient (2)",
            "triangle",
            where(a + b >= 5 * c),
            required=False,
            total=m,
        )
        yield Condition(
            "a^2 - b^2 < 3 c^2 for the sides a > b > c, sufficient",
            "triangle",
            where(a - b >= 3 * c),
            required=False,
            total=m,
        )
        inner = np.isfinite(self.from_means)
        far = self.from_means > MEAN_MARGIN + rounding(self.mesh.p) / self.sides[0].min()
        yield Condition(
            "inner nodes to be the means of their neighbours",
            "node",
            where(far),
            "relocate the inner nodes",
            f"up to {np.max(self.from_means[inner]):.2g} facet lengths away" if far.any() else "",
            required=False,
            total=int(inner.sum()),
        )
        for point, starless in zip(("nodes", "centroids"), self.starless):
            yield Condition(
                f"dual cells star-shaped about their {point}",
                "cell",
                starless,
                required=False,
                total=n,
            )

    def measures(self) -> Iterator[Measure]:
        """Quantities with their worst values."""
        yield Measure(
            "smallest angle (degrees)",
            "triangle",
            self.smallest_angles,
            int(np.argmin(self.smallest_angles)),
        )
        yield Measure(
            "largest aspect ratio R / 2r", "triangle", self.aspects, int(np.argmax(self.aspects))
        )


def smallest_angles(p: ndarray, t: ndarray) -> ndarray:
    """Smallest angle of each triangle in radians; ``t`` has the shape (3, ...)."""
    v = p[:, t]
    onward, back = np.roll(v, -1, axis=1) - v, np.roll(v, 1, axis=1) - v
    # twice the area is common to the three angles: the smallest has the largest product of sides
    double = np.abs(cross(onward[:, 0], back[:, 0]))
    return np.arctan2(double, np.sum(onward * back, axis=0).max(axis=0))
