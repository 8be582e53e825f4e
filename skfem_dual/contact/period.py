"""Contact regions over a period, whose cells go on beyond its edge."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray
from skfem import MeshQuad

from ..grids.lattice import Lattice
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from .plan_triangles import PlanTriangles
from .region import ContactRegion

#: cells beyond the edge that decide on where contact ends beside it
BEYOND = 12


@dataclass(frozen=True, eq=False)
class PeriodTriangles(PlanTriangles):
    """Triangles on a period: where it is cut does not decide on the contact.

    Attributes
    ----------
    lattice : Lattice
        Of the cells, which fill the period.
    """

    lattice: Lattice

    @classmethod
    def over(cls, plan: PlanTriangles, lattice: Lattice) -> Self:
        """Those of a plan that is a period."""
        return cls(plan.partition, plan.p, plan.t, plan.weights, plan.cell, plan.own, lattice)

    @computed_once
    def _beyond(self) -> tuple[PlanTriangles, ndarray]:
        """Triangles of the cells and those around the period, and which cell each of them is."""
        wide = PlanTriangles.of(Partition.from_mesh(self._mesh), self._mesh)
        (nx, ny), middles = self.lattice.shape, wide.partition.centroids
        i, j = np.floor((middles - self._low[:, None]) / self._step).astype(int)
        at = np.empty(nx * ny, dtype=int)
        at[self.lattice.places] = np.arange(nx * ny)
        return wide, at[(i % nx) * ny + j % ny]

    @computed_once
    def _mesh(self) -> MeshQuad:
        """The cells of the period and those around it."""
        lines = [
            low + step * np.arange(-BEYOND, n + BEYOND + 1)
            for low, step, n in zip(self._low, self.lattice.spacing, self.lattice.shape)
        ]
        return MeshQuad.init_tensor(*lines)

    def around(self, region: ContactRegion) -> tuple[ContactRegion, MeshQuad, ndarray]:
        """A region of the period on the cells beyond its edge as well, the mesh of these, and
        which cell of the period each of them is."""
        wide, cell = self._beyond

        def inside(x: ndarray) -> ndarray:
            sixths = np.rint(6 * (x - self._low[:, None]) / self._step).astype(int)
            sixths %= 6 * np.array(self.lattice.shape)[:, None]
            return self._low[:, None] + sixths * self._step / 6

        level = readonly(region.level[self._found(self.p, inside(wide.p))])
        middles = (each.p[:, each.t].mean(axis=1) for each in (self, wide))
        triangles = self._found(next(middles), inside(next(middles)))
        holes = readonly(np.broadcast_to(region.holes, region.t.shape[1])[triangles])
        return replace(region, p=wide.p, t=wide.t, level=level, holes=holes), self._mesh, cell

    @computed_once
    def _low(self) -> ndarray:
        return self.p.min(axis=1)

    @computed_once
    def _step(self) -> ndarray:
        return np.array(self.lattice.spacing)[:, None]

    @computed_once
    def _inner(self) -> tuple[ndarray, ndarray]:
        """Which of the points and triangles of `_beyond` are those of the period."""
        wide, _ = self._beyond
        points = self._found(wide.p, self.p)
        return points, self._found(*(each.p[:, each.t].mean(axis=1) for each in (wide, self)))

    def _found(self, among: ndarray, x: ndarray) -> ndarray:
        """Numbers of points among others, all in multiples of a sixth of a cell."""
        of, wanted = (
            np.rint(6 * (y - self._low[:, None]) / self._step).astype(int) for y in (among, x)
        )
        width = np.ptp(of[1]) + 1
        keys = of[0] * width + of[1]
        order = np.argsort(keys)
        return order[np.searchsorted(keys[order], wanted[0] * width + wanted[1])]

    def fitted_each(self, pressure: ndarray, gap: ndarray, modulus: float) -> list[ContactRegion]:
        """As of `PlanTriangles`, on the cells beyond the edge as well."""
        wide, cell = self._beyond
        return wide.fitted_each(pressure[:, cell], gap[:, cell], modulus)

    def with_thin(
        self, fitted: ContactRegion, pressure: ndarray, opening: ndarray, even: bool = False
    ) -> ContactRegion:
        """As of `PlanTriangles`, on the period."""
        (wide, cell), (points, triangles) = self._beyond, self._inner
        found = wide.with_thin(fitted, pressure[cell], opening[cell], even)
        holes = np.broadcast_to(found.holes, found.t.shape[1])[triangles]
        level = readonly(found.level[points])
        return replace(found, p=self.p, t=self.t, level=level, holes=readonly(holes))


def nodes_alike(lattice: Lattice, p: ndarray, values: ndarray) -> ndarray:
    """Values at the nodes of a period, where those on opposite sides of it are one."""
    low, (nx, ny) = p.min(axis=1, keepdims=True), lattice.shape
    i, j = np.rint((p - low) / np.array(lattice.spacing)[:, None]).astype(int)
    node = (i % nx) * ny + j % ny
    return (np.bincount(node, values) / np.bincount(node))[node]
