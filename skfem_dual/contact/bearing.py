"""Pressures to compare with what the ground may bear.

Under the sharp edge of a rigid body the pressure of elastic ground grows beyond all bounds; the
ground yields there and passes its load on to what is beside, and the largest pressure of a cell
depends on its size. What is compared is the largest mean pressure on a circle, which does not.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_array

from ..arguments import checked_instance
from ..grids.outline import distance_to_segments, edge_ribs
from ..grids.partition import Partition
from ..grids.polygons import readonly
from .footprint import Footprint
from .pressures import CellPressures

#: radius of the circles, over that of the largest circle that fits into the plan
PART = 0.2
#: points of a circle, on rings of equal area and around
RINGS, AROUND = 5, 20


@dataclass(frozen=True, eq=False)
class Circles:
    """Circles in a plan, and the mean pressures on them.

    Attributes
    ----------
    x : (2, m) array of float
        Their centres, all over the plan and along its edge.
    radius : float
        Of all of them.
    means : (m, n) sparse array
        Mean pressures on the circles by unit pressures of the cells.
    """

    x: ndarray
    radius: float
    means: csr_array

    @classmethod
    def of(cls, footprint: Footprint) -> "Circles":
        """Circles a fifth as wide as the largest one in the plan."""
        partition = footprint.partition
        ribs = edge_ribs(partition)
        a, b = partition.polygons.p[:, partition.facets[:, ribs]].swapaxes(0, 1)
        x = partition.centroids
        distance = distance_to_segments(x, a, b)
        radius = PART * distance.max()
        along = _inside(partition, ribs, radius)
        touching = distance_to_segments(along, a, b) >= (1 - 1e-6) * radius
        x = np.hstack([x[:, distance >= radius], along[:, touching]])
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        rings = np.sqrt((np.arange(RINGS) + 0.5) / RINGS)
        arms = radius * np.kron(rings, [np.cos(angle), np.sin(angle)])
        points = (x[:, :, None] + arms[:, None]).reshape(2, -1)
        inside, cell, factor = footprint.pressure_factors(points)
        circle = np.repeat(np.arange(x.shape[1]), arms.shape[1])[inside]
        shape, share = (x.shape[1], len(partition)), factor / arms.shape[1]
        means = csr_array((share, (circle, cell)), shape=shape)
        if footprint.slopes is not None:
            arm = points[:, inside] - footprint.acting[:, cell]
            for along, slopes in zip(arm, footprint.slopes.along, strict=True):
                means = means + csr_array((share * along, (circle, cell)), shape=shape) @ slopes
        return cls(readonly(x), float(radius), means)

    def largest(self, pressure: ndarray) -> ndarray:
        """The largest mean pressure on a circle, by pressures of the cells, (n,) or (n, k)."""
        return (self.means @ pressure).max(axis=0)


def _inside(partition: Partition, ribs: ndarray, width: float) -> ndarray:
    """Points so far inside from the middles of ribs on the edge, and from their common ends."""
    facets = partition.facets[:, ribs]
    a, b = partition.polygons.p[:, facets].swapaxes(0, 1)
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
    arm = partition.centroids[:, partition.f2c[0, ribs]] - a
    normal = normal * np.sign(np.sum(arm * normal, axis=0))
    n = partition.polygons.p.shape[1]
    both = np.stack([sum(np.bincount(end, along, n) for end in facets) for along in normal])
    ends = np.unique(facets)
    both = both[:, ends]
    square = np.sum(both**2, axis=0)
    met = square > 1e-2  # not where the edge turns back on itself
    corners = partition.polygons.p[:, ends] + 2 * width * both / np.where(met, square, 1.0)
    return np.hstack([(a + b) / 2 + width * normal, corners[:, met]])


def bearing_pressure(solution: CellPressures) -> float:
    """Largest mean pressure on a circle, to compare with an allowable pressure.

    Under the sharp edge of a rigid body the pressure of elastic ground grows beyond all bounds,
    and the largest pressure of a cell depends on its size. The mean on a circle does not. Of all
    circles in the plan whose radius is a fifth of that of the largest one, that with the largest
    mean is taken; it may touch the edge.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        Whose pressure it is.

    Examples
    --------
    Under a round footing with a central force it is the mean pressure, and 1 % more:

    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> from skfem_dual.grids.generate import disc
    >>> dual = DualMesh.from_mesh(disc(n=300))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(3.14159)
    >>> print(f"{bearing_pressure(solution):.2f}")
    1.01
    """
    checked_instance("solution", solution, CellPressures)
    return float(Circles.of(solution.footprint).largest(solution.pressure))
