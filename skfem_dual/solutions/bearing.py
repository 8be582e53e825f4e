"""Pressures to compare with what the ground may bear.

Under the sharp edge of a rigid body the pressure of elastic ground grows beyond all bounds; the
ground yields there and passes its load on to what is beside, and the largest pressure of a cell
depends on its size. What is compared is the largest mean pressure on a circle, which hardly does,
or that on all of the contact where it is narrower than the circle.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_array
from scipy.special import roots_legendre

from ..contact.footprint import Footprint
from ..grids.outline import distance_to_segments, edge_ribs, inside_loops, places
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly, computed_in
from .pressures import CellPressures, checked_solution

#: radius of the circles, over that of the largest circle that fits into the plan
PART = 0.2
#: points of a circle, on rings that are closer to its edge, where pressures are singular if it is
#: also that of the plan, and around
RINGS, AROUND = 4, 32
#: relative error of the radius of the largest circle
CLOSE = 1e-10
#: squares that are looked at together while they are wider than a part of it, and then: of a ridge
#: along which circles are equally large they need not be all
SQUARES, WIDER, FEWER = 2**13, 0.02, 128


@dataclass(frozen=True, eq=False)
class Circles(ReadOnly):
    """Circles in a plan, and the mean pressures on them.

    Attributes
    ----------
    x : (2, m) array of float
        Their centres, all over the plan and along its edge.
    radius : float
        Of all of them.
    means : (m, n) sparse array
        Mean pressures on the circles by unit pressures of the cells.
    rises : (m, 2 n) sparse array
        By unit slopes of the pressure along x in the cells, then along y.
    """

    x: ndarray
    radius: float
    means: csr_array
    rises: csr_array

    @classmethod
    def of(cls, footprint: Footprint) -> "Circles":
        """Circles a fifth as wide as the largest one in the plan, kept as long as the cells.

        They turn with the plan, and hardly depend on the cells."""
        return computed_in(_known, footprint, lambda: cls._of(footprint))

    @classmethod
    def _of(cls, footprint: Footprint) -> "Circles":
        partition = footprint.partition
        ribs = edge_ribs(partition)
        a, b = partition.ends(ribs)
        radius = PART * _widest(partition, a, b)
        x = np.hstack([partition.centroids, _inside(partition, ribs, radius)])
        x = x[:, distance_to_segments(x, a, b) >= (1 - 1e-6) * radius]
        arms, weights = _points_of_a_circle()
        off = x - partition.centre[:, None]
        points = (x[:, :, None] + radius * _turned(arms, off)).reshape(2, -1)
        inside, cell, factor = footprint.pressure_factors(points)
        circle = np.repeat(np.arange(x.shape[1]), len(weights))[inside]
        share, n = factor * np.tile(weights, x.shape[1])[inside], len(partition)
        means = csr_array((share, (circle, cell)), shape=(x.shape[1], n))
        rise = (share * (points[:, inside] - footprint.acting[:, cell])).ravel()
        at = np.tile(circle, 2), np.concatenate([cell, n + cell])
        rises = csr_array((rise, at), shape=(x.shape[1], 2 * n))
        return cls(readonly(x), float(radius), means, rises)

    def largest(self, solution: CellPressures) -> float:
        """The largest mean pressure on a circle."""
        means = self.means @ solution.pressure + self.rises @ solution.slopes.ravel()
        return float(means.max())


_known: WeakKeyDictionary[Footprint, Circles] = WeakKeyDictionary()


def _widest(partition: Partition, a: ndarray, b: ndarray) -> float:
    """Radius of the largest circle in the plan, whose edge is given by segments.

    Squares that cover it are divided where they may hold a middle of a larger circle than is
    known: the distance to the edge grows no faster than one goes.
    """
    x, half, best = partition.centroids, partition.polygons.radii, 0.0
    while True:
        distance = np.where(inside_loops(x, a, b), 1, -1) * distance_to_segments(x, a, b)
        best = max(best, distance.max())
        bound = distance + np.sqrt(2) * half
        some = np.nonzero(bound > (1 + CLOSE) * best)[0]
        if len(some) == 0:
            return float(best)
        most = SQUARES if half.max() > WIDER * best else FEWER
        some = some[np.argsort(-bound[some], kind="stable")[:most]]
        half = np.tile(half[some] / 2, 4)
        quarters = np.repeat([[-1, 1, -1, 1], [-1, -1, 1, 1]], len(some), axis=1)
        x = np.tile(x[:, some], 4) + half * quarters


def _points_of_a_circle() -> tuple[ndarray, ndarray]:
    """Points (2, k) of the unit circle and weights for the mean over it, (k,).

    By Gauss's rule in u, where ``1 - r^2 = (1 - u)^2``: roots of the distance to its edge become
    smooth.
    """
    u, weights = roots_legendre(RINGS)
    u = (1 + u) / 2
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    points = np.kron(np.sqrt(u * (2 - u)), [np.cos(angle), np.sin(angle)])
    return points, np.repeat(weights * (1 - u) / AROUND, AROUND)


def _turned(arms: ndarray, towards: ndarray) -> ndarray:
    """Points (2, k) turned from the first axis to directions (2, m), with which plans turn;
    (2, m, k)."""
    length = np.hypot(*towards)
    known = length > 1e-9 * length.max()
    cos, sin = np.where(known, towards / np.where(known, length, 1.0), [[1.0], [0.0]])[..., None]
    return np.stack([cos * arms[0] - sin * arms[1], sin * arms[0] + cos * arms[1]])


def _inside(partition: Partition, ribs: ndarray, width: float) -> ndarray:
    """Points so far inside from the middles of ribs on the edge, and from their common ends."""
    facets = partition.facets[:, ribs]
    a, b = partition.polygons.p[:, facets].swapaxes(0, 1)
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
    arm = partition.centroids[:, partition.f2c[0, ribs]] - a
    normal = normal * np.sign(np.sum(arm * normal, axis=0))
    points = [(a + b) / 2 + width * normal]
    ends, number = np.unique(facets, return_inverse=True)
    number, x = number.reshape(facets.shape), partition.polygons.p[:, ends]
    place = places(x, 1e-10 * np.ptp(x, axis=1).max())
    seams = [place] if place.max() < len(ends) - 1 else []
    for one in [np.arange(len(ends)), *seams]:  # each part of a mesh alone, and across seams
        at, (_, first) = one[number], np.unique(one, return_index=True)
        n = len(first)
        both = np.stack([sum(np.bincount(end, along, n) for end in at) for along in normal])
        square = np.sum(both**2, axis=0)
        met = square > 1e-2  # not where the edge turns back on itself
        points.append((x[:, first] + 2 * width * both / np.where(met, square, 1.0))[:, met])
    return np.hstack(points)


def bearing_pressure(solution: CellPressures) -> float:
    """Largest mean pressure on a circle, to compare with an allowable pressure.

    Under the sharp edge of a rigid body the pressure of elastic ground grows beyond all bounds,
    and the largest pressure of a cell depends on its size. The mean on a circle hardly depends on
    it, except on layers thinner than the cells, where percents need smaller cells, and on arcs
    meshed with few cells: it is 7 % too high under a stadium of 60 dual cells, 4 to 15 % under
    rings of 60, 1 % under those of 130 and more; and on strips with one cell or two across, where
    it is 14 to 22 % too high. Of all circles in the plan whose radius is a
    fifth of that of the largest one, that with the largest mean is taken; it may touch the edge.
    Where contact has become narrower than the circle the mean on it tells nothing: the answer is
    never less than the force over the area in contact. On periodic ground circles stay within one
    period, so the answer depends on where that begins.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        Whose pressure it is.

    Returns
    -------
    float
        The mean pressure.

    Raises
    ------
    TypeError
        If it is no solution of one body.

    Examples
    --------
    Under a round footing with a central force it is 1.013 of the mean pressure; being the largest
    of many, on coarse meshes a little more:

    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> from skfem_dual.grids.generate import disc
    >>> dual = DualMesh.from_mesh(disc(n=300))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(3.14159)
    >>> print(f"{bearing_pressure(solution):.2f}")
    1.02
    """
    checked_solution("solution", solution)
    largest = Circles.of(solution.punch.footprint).largest(solution)
    # in full contact some circle bears more than the mean, and no region need be found
    return max(largest, solution.mean_pressure) if solution.gap.any() else largest
