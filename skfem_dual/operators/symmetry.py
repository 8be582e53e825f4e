"""Plans with rotations and mirror lines: matrices assembled and solved in independent blocks.

Where a motion g of the plane takes cells and collocation points to each other, the matrix of (5)
does not notice, ``d[g i, g j] = d[i, j]``: the ground looks the same from all sides. One row is
needed of every orbit of cells; and between vectors that change under the group like the rows of
its irreducible representations the matrix consists of a block for each of these, as for pressures
even and odd about a mirror line (Serre, Linear Representations of Finite Groups, 1977, 2.7; in
boundary elements Allgower, Boehmer, Georg and Miranda, SIAM J. Numer. Anal. 29 (1992) 534).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import gcd
from typing import NamedTuple

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..arguments import (
    checked_array,
    checked_indices,
    checked_instance,
    checked_integer,
    checked_number,
)
from ..elements.edge_weights import EdgeWeights
from ..elements.polygon_moments import polygon_moments
from ..errors import MeshError
from ..grids.partition import Partition
from ..grids.polygons import readonly, some
from ..kernels.once import ReadOnly, computed_once
from .representations import Component, representations

#: tolerance of a symmetry that is given, as that of `Symmetry.detect`
FOREIGN = 1e-4


class Saving(NamedTuple):
    """Entries to assemble, operations of the factorisation and memory: full over symmetric."""

    entries: float
    operations: float
    memory: float


@dataclass(frozen=True, eq=False, repr=False)
class Symmetry(ReadOnly):
    """Rotations about the centroid of a plan, and reflections, that take its cells to each other.

    Attributes
    ----------
    permutations : (order, n) array of int
        Cell to which each motion takes each cell: rotations by k turns of ``2 pi / rotations``,
        k = 0, 1, ..., then, if there is a mirror line, these after the reflection about it.
    rotations : int
        Number of rotations, with that by zero.
    mirror : float or None
        Angle between x axis and a mirror line; the others follow at every ``pi / rotations``.

    Raises
    ------
    TypeError, ValueError
        If a row of ``permutations`` is no permutation, or there are not as many as motions.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> print(Symmetry.detect(Partition.from_basis(dual.basis())))
    <skfem_dual Symmetry object>
      Group: C4v of order 8, a mirror line at 0.00°
      Cells: 545 in 81 orbits
      Saving: 6.73 times fewer entries, 42 times fewer operations, 7.93 times less memory
    """

    permutations: ndarray
    rotations: int
    mirror: float | None

    def __post_init__(self) -> None:
        rotations = checked_integer("rotations", self.rotations, at_least=1)
        if self.mirror is not None:
            object.__setattr__(self, "mirror", checked_number("mirror", self.mirror))
        n = checked_array("permutations", self.permutations, ("order", "n"), least=1).shape[1]
        order = rotations if self.mirror is None else 2 * rotations
        images = checked_indices("permutations", self.permutations, n, (order, n))
        reached = np.zeros(images.shape, dtype=bool)
        np.put_along_axis(reached, images, True, axis=1)
        if not reached.all():
            row, cell = np.argwhere(~reached)[0]
            raise ValueError(
                "expected permutations that take each cell to another, got none to cell "
                f"{cell} in row {row}"
            )
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "permutations", readonly(images, np.int32))

    @classmethod
    def detect(
        cls,
        partition: Partition,
        x: ndarray | None = None,
        weights: EdgeWeights | None = None,
        *,
        rotations: int | None = None,
        mirror: float | None = None,
        tol: float = 1e-10,
    ) -> "Symmetry":
        """The symmetry of some cells, of order 1 if they have none.

        Parameters
        ----------
        partition : Partition
            The cells.
        x : (2, n) array of float, optional
            Collocation point of each; the centroids by default.
        weights : EdgeWeights, optional
            How the pressure varies inside the cells.
        rotations, mirror : int and float, optional
            As of the class, where the symmetry is known; all that there is by default.
        tol : float
            How far points may be off, over the square root of the area of the plan.

        Raises
        ------
        TypeError, ValueError
            If an argument is of another kind or size, or out of range.
        MeshError
            If the cells do not have the symmetry that is given.
        """
        checked_instance("partition", partition, Partition)
        if weights is not None:
            checked_instance("weights", weights, EdgeWeights)
        tol = checked_number("tol", tol, at_least=0, at_most=1e-4)
        if rotations is not None:
            rotations = checked_integer("rotations", rotations, at_least=1, at_most=len(partition))
        if mirror is not None:
            mirror = checked_number("mirror", mirror, at_least=-100, at_most=100)
        cells = _Cells.from_partition(partition, x, weights, tol)
        if rotations is None and mirror is None:
            rotations, mirror = cells.search()
        rotations = 1 if rotations is None else rotations
        what = f"{rotations} rotations about its centroid"
        turn, wrong = cells.images(2 * np.pi / rotations)
        permutations = [np.arange(len(turn))]
        for _ in range(rotations - 1):
            permutations.append(turn[permutations[-1]])
        if mirror is not None and not len(wrong):
            what = f"a mirror line at {mirror:.6g} through its centroid"
            reflected, wrong = cells.images(2 * mirror, mirrored=True)
            permutations += [rotated[reflected] for rotated in permutations]
        if len(wrong):
            raise MeshError(
                f"expected a plan with {what}, got cells {some(wrong)} without a like one there, "
                "collocation point and edge included. Remedy: rotations=None, mirror=None to find "
                "what symmetry there is"
            )
        return cls(np.array(permutations), rotations, mirror)

    def __len__(self) -> int:
        return self.permutations.shape[1]

    def require(
        self, partition: Partition, x: ndarray | None = None, weights: EdgeWeights | None = None
    ) -> None:
        """Refuse cells that do not have this symmetry; arguments as of `detect`.

        Distances of collocation points, and what cells load the ground by, must be the same
        after every permutation, up to the largest tolerance of `detect`.

        Raises
        ------
        TypeError, ValueError
            If ``x`` are not as many points.
        MeshError
            If some cells differ from their images.
        """
        if len(self) != len(partition):
            raise MeshError(
                f"expected a symmetry of the {len(partition)} cells, got one of {len(self)}"
            )
        cells = _Cells.from_partition(partition, x, weights, FOREIGN)
        wrong = np.zeros(len(self), dtype=bool)
        for number, images in enumerate(self.permutations):
            turn = number % self.rotations
            angle, mirrored = 2 * np.pi * turn / self.rotations, number >= self.rotations
            if mirrored:
                angle += 2 * (self.mirror or 0.0)
            wrong |= cells.unlike(images, angle, mirrored)
        if wrong.any():
            raise MeshError(
                f"expected the symmetry of these cells, got one in which cells "
                f'{some(np.nonzero(wrong)[0])} differ from their images. Remedy: symmetry="auto"'
            )

    @computed_once
    def representatives(self) -> ndarray:
        """One cell of every orbit."""
        least = self.permutations.min(axis=0)
        return readonly(np.nonzero(least == np.arange(len(self)))[0], np.int32)

    @computed_once
    def components(self) -> tuple[Component, ...]:
        """The kinds of vectors that do not mix, one for each irreducible representation."""
        kinds = representations(self.rotations, self.mirror is not None)
        components = (
            Component.from_representation(self.permutations, self.representatives, representation)
            for representation in kinds
        )
        return tuple(part for part in components if len(part))

    @computed_once
    def saving(self) -> Saving:
        """How many times less a matrix with this symmetry takes than a full one."""
        n, parts = len(self), self.components
        return Saving(
            n / len(self.representatives),
            n**3 / sum((4 if part.twice else 1) * len(part) ** 3 for part in parts),
            n**2 / sum((2 if part.twice else 1) * len(part) ** 2 for part in parts),
        )

    def apply(self, functions: Sequence[Callable[[ndarray], ndarray]], q: ndarray) -> ndarray:
        """Sum of what a function for each component makes of its part in real vectors."""
        q = checked_array("q", q, None, each="cell")
        if q.shape[:1] != (len(self),):
            raise ValueError(f"expected values of {len(self)} cells, got shape {q.shape}")
        out = np.zeros((len(self), q.size // len(self)))
        for part, function in zip(self.components, functions):
            out += part.apply(function, q.reshape(out.shape))
        return out.reshape(q.shape)

    @property
    def name(self) -> str:
        """The group in the notation of Schoenflies: C1, Cs, C2, C2v, ..."""
        if self.mirror is None:
            return f"C{self.rotations}"
        return f"C{self.rotations}v" if self.rotations > 1 else "Cs"

    def __repr__(self) -> str:
        line = ""
        if self.mirror is not None:
            angle = np.degrees(self.mirror).round(6) % (180 / self.rotations)
            line = f", a mirror line at {angle:.2f}°"
        entries, operations, memory = self.saving
        return (
            f"<skfem_dual Symmetry object>\n  Group: {self.name} of order "
            f"{len(self.permutations)}{line}\n  Cells: {len(self)} in "
            f"{len(self.representatives)} orbits\n  Saving: {entries:.3g} times fewer entries, "
            f"{operations:.3g} times fewer operations, {memory:.3g} times less memory"
        )


@dataclass(frozen=True, eq=False)
class _Cells:
    """What a motion must not change; vectors are complex numbers.

    ``values`` (k, n) turn by ``spin`` (k, 1) times the angle of a rotation: 0 of scalars, 1 of
    vectors, 2 of second moments. They have no units and may differ by ``slack`` (n,), the
    ``points`` (n,) from the centroid of the plan by ``reach``.
    """

    points: ndarray
    values: ndarray
    spin: ndarray
    reach: float
    slack: ndarray

    @classmethod
    def from_partition(
        cls, partition: Partition, x: ndarray | None, weights: EdgeWeights | None, tol: float
    ) -> "_Cells":
        areas, p = partition.areas, _complex(partition.centroids)
        xx, xy, yy = partition.polygons.second_moments
        length = np.sqrt((xx + yy) / areas)
        values = [np.log(areas), np.log(length), (xx - yy + 2j * xy) / (xx + yy)]
        spin = [0, 0, 2]
        # how squares and regular triangles are turned, moments of higher degree tell
        m = polygon_moments(partition.polygons, 4)
        cubes = 6 * (m[3, 0] - 1j * m[0, 3]) + 6j * m[2, 1] - 6 * m[1, 2]
        towards = 6 * (m[3, 0] + 1j * m[0, 3]) + 2j * m[2, 1] + 2 * m[1, 2]
        fourth = 24 * (m[4, 0] - m[2, 2] + m[0, 4]) + 24j * (m[3, 1] - m[1, 3])
        values += [cubes / (areas * length**3), towards / (areas * length**3)]
        values.append(fourth / (areas * length**4))
        spin += [3, 1, 4]
        if x is not None:
            x = checked_array("x", x, partition.centroids.shape, each="cell")
            values, spin = [*values, (_complex(x) - p) / length], [*spin, 1]
        if weights is not None:
            values += [
                np.log(np.where(weights.weighted, weights.mean, 1.0)),
                _complex(weights.moment) / (areas * length),
            ]
            spin += [0, 1]
        # not less than rounding far from the origin
        reach = max(tol * np.sqrt(areas.sum()), 32 * np.finfo(float).eps * np.abs(p).max())
        middle, off = p @ areas / areas.sum(), 10 * reach * length / areas
        return cls(p - middle, np.array(values), np.array(spin)[:, None], reach, off)

    def search(self) -> tuple[int, float | None]:
        """Number of rotations and the angle of a mirror line."""
        radii = np.abs(self.points)
        order = np.argsort(radii)
        order = order[radii[order] > self.reach]
        rings = np.split(order, np.nonzero(np.diff(radii[order]) > 2 * self.reach)[0] + 1)
        # rotations leave no cell of a ring where it is, so their number divides that of its cells
        most = gcd(*map(len, rings))
        turns = [k for k in range(most, 1, -1) if most % k == 0]
        rotations = next((k for k in turns if not len(self.images(2 * np.pi / k)[1])), 1)
        # a mirror line takes a cell to one of its ring; the outermost has the best angles
        angles = np.angle(self.points[min(reversed(rings), key=len)])
        apart = (angles - angles[:1]) % (2 * np.pi)
        lines = angles[:1] + apart[apart < 2 * np.pi / rotations] / 2
        return rotations, next((a for a in lines if not len(self.images(2 * a, True)[1])), None)

    def _moved(self, angle: float, mirrored: bool) -> tuple[ndarray, ndarray]:
        """Points and values after a reflection and a rotation."""
        points, values = self.points, self.values
        if mirrored:
            points, values = points.conj(), values.conj()
        return np.exp(1j * angle) * points, np.exp(1j * angle * self.spin) * values

    def unlike(self, images: ndarray, angle: float, mirrored: bool) -> ndarray:
        """Whether each cell differs from the cell that is to be its image."""
        points, values = self._moved(angle, mirrored)
        off = np.abs(self.values[:, images] - values).max(axis=0)
        return (np.abs(self.points[images] - points) > self.reach) | (off > self.slack)

    def images(self, angle: float, mirrored: bool = False) -> tuple[ndarray, ndarray]:
        """Nearest cell to each after a reflection and a rotation, and those where it differs."""
        points, values = self._moved(angle, mirrored)
        tree = cKDTree(np.column_stack([self.points.real, self.points.imag]))
        apart, nearest = tree.query(np.column_stack([points.real, points.imag]))
        off = np.abs(self.values[:, nearest] - values).max(axis=0)
        shared = np.bincount(nearest)[nearest] > 1
        return nearest, np.nonzero((apart > self.reach) | (off > self.slack) | shared)[0]


def _complex(x: ndarray) -> ndarray:
    return x[0] + 1j * x[1]
