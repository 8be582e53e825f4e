"""Pressures to compare with what the ground may bear.

Under the sharp edge of a rigid body the pressure of elastic ground grows beyond all bounds; the
ground yields there in a narrow strip, and the largest pressure of a cell depends on its size. What
is compared is the largest pressure further inside, which does not.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..arguments import checked_instance
from ..grids.outline import distance_to_segments
from ..grids.polygons import readonly
from .footprint import Footprint
from .pressures import CellPressures

#: width of the strip along a singular edge that is left out, over the radius of the largest circle
#: that fits into the plan
STRIP = 0.1


@dataclass(frozen=True, eq=False)
class InnerPoints:
    """Points off the singular edge of a plan, and the pressure there by those of the cells.

    Attributes
    ----------
    x : (2, m) array of float
        The points.
    cell : (m,) array of int
        The cell each lies in.
    factor : (m,) array of float
        Pressure there over the mean of the cell.
    width : float
        Width of the strip that is left out; zero without a singular edge.
    """

    x: ndarray
    cell: ndarray
    factor: ndarray
    width: float

    @classmethod
    def of(cls, footprint: Footprint) -> "InnerPoints":
        """Points all over the plan and along the strip; centroids if no edge is singular."""
        partition, weights = footprint.partition, footprint.weights
        if weights is None:
            n = len(partition)
            return cls(partition.centroids, np.arange(n), np.ones(n), 0.0)
        a, b = partition.polygons.p[:, partition.facets[:, weights.ribs]].swapaxes(0, 1)
        x = np.hstack([partition.centroids, partition.polygons.p])
        distance = distance_to_segments(x, a, b)
        width = STRIP * distance.max()
        normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
        arm = partition.centroids[:, partition.f2c[0, weights.ribs]] - a
        along = (a + b) / 2 + width * normal * np.sign(np.sum(arm * normal, axis=0))
        inner = distance_to_segments(along, a, b) >= (1 - 1e-6) * width
        x = np.hstack([x[:, distance >= width], along[:, inner]])
        inside, cell, factor = footprint.pressure_factors(x)
        return cls(readonly(x[:, inside]), readonly(cell), readonly(factor), float(width))

    def largest(self, pressure: ndarray) -> tuple[float, ndarray]:
        """The largest pressure in the points, by those of the cells, and where it is."""
        found = self.factor * pressure[self.cell]
        most = int(np.argmax(found))
        return float(found[most]), self.x[:, most]


def bearing_pressure(solution: CellPressures) -> float:
    """Largest pressure away from a singular edge, to compare with an allowable one.

    Under the sharp edge of a rigid body the pressure of elastic ground grows beyond all bounds:
    a strip along it is left out, a tenth as wide as the radius of the largest circle that fits
    into the plan. Without a singular edge it is the largest mean pressure of a cell.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        Whose pressure it is.

    Examples
    --------
    On a circle of radius a it is that at the distance 0.9 a from its centre, 1.15 of the mean:

    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(3.14159)
    >>> print(f"{bearing_pressure(solution):.1f}")
    1.1
    """
    checked_instance("solution", solution, CellPressures)
    return InnerPoints.of(solution.footprint).largest(solution.pressure)[0]
