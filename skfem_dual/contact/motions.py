"""Sliding and twisting of a rigid base.

A relaxed base carries horizontal forces by shear tractions alone: these press nowhere, and
pressures push nothing aside. Under a rough one, bonded to the ground, shear tractions and
pressures are coupled. The motions follow from the work of the tractions as in `work`.

Sources: K. L. Johnson, Contact Mechanics (1985), sections 3.7 and 3.9; V. I. Mossakovskii, The
fundamental mixed problem of the theory of elasticity for a half-space with a circular line
separating the boundary conditions, J. Appl. Math. Mech. 18 (1954), for the bonded disc.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, ElementTriP0

from ..elements.influence import flat_points
from ..elements.slopes import Slopes
from ..elements.tangential import Tractions
from ..grids.corners import parted
from ..grids.dual_mesh import DualMesh
from ..grids.flips import flipped
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..ground.stratified import Stratified
from ..ground.substrates import HalfSpace
from ..kernels.once import ReadOnly, computed_once
from ..messages import shown
from ..operators.factors import Factors
from .edges import weights_of
from .footprint import Footprint
from .load import Load
from .region import ContactRegion
from .sectors import Sectors, sectors
from .system import DENSE

#: squares of radii over areas, and areas over those of a neighbour, of slivers
THIN, TINY = 20.0, 0.02


def require_carried(footprint: Footprint, load: Load) -> None:
    """Refuse horizontal loads that no cell in contact can carry, with a ValueError."""
    if load.shear is None:
        return
    holding(footprint)
    if load.force == 0 and load.shear.any():
        raise ValueError(
            "expected a positive force with horizontal forces and torsion, which cells in "
            "contact carry, got 0. Remedy: stiffness(full=True) for a base without weight"
        )


def holding(cells: Footprint) -> HalfSpace | Stratified:
    """The ground; a ValueError where it does not hold shear tractions, or on so many cells."""
    ground = cells.substrate
    if not isinstance(ground, (HalfSpace, Stratified)):
        raise ValueError(
            "expected a HalfSpace, GradedHalfSpace or LayeredHalfSpace for horizontal and "
            f"twisting motions, got {shown(ground)}: of other grounds settlements only are known"
        )
    if not cells.few:
        raise ValueError(
            f"expected up to {DENSE} cells for horizontal and twisting motions, whose matrix is "
            f"dense, got {len(cells)}. Remedy: a coarser mesh"
        )
    if isinstance(ground, Stratified):
        ground.check_holding()
    return ground


@dataclass(frozen=True, eq=False)
class Motions(ReadOnly):
    """Tractions by rigid motions: three horizontal ones, or all six under a rough base.

    Motions are (Ux, Uy, twist), preceded under a rough base by (W0, Lx, Ly), all at the centroid
    of the plan; the twist is positive from x towards y.

    Attributes
    ----------
    footprint : Footprint
        The n cells.
    rough : bool
        Whether pressures and shear tractions are coupled.
    touching : (n,) array of bool
        The cells that carry tractions.
    """

    footprint: Footprint
    rough: bool
    touching: ndarray

    def __post_init__(self) -> None:
        holding(self.footprint)

    @computed_once
    def _cells(self) -> Footprint:
        """With the law of the edge of homogeneous ground where shear tractions are alone: that of
        pressures, which fall off behind the edge of a crust, is not theirs."""
        cells = self.footprint
        if self.rough or cells.weights is None or cells.weights.law is None:
            return cells
        weights = replace(cells.weights, law=None)
        if cells.slopes is None:
            return replace(cells, weights=weights)
        # with none where they have none, as in slivers
        flat = abs(cells.slopes.matrix).sum(axis=1).reshape(2, -1).max(axis=0) == 0
        slopes = Slopes.from_weights(weights).without(np.asarray(flat).ravel())
        return replace(cells, weights=weights, slopes=slopes)

    @computed_once
    def _tractions(self) -> Tractions:
        cells = self._cells
        slopes = cells.slopes
        if slopes is not None and not self.touching.all():
            # beside the line of contact there is nothing to compare a cell with
            beside = (abs(slopes.matrix) @ ~self.touching).reshape(2, -1).any(axis=0)
            slopes = slopes.without(beside | ~self.touching)
        return Tractions(cells.partition, cells.fan, cells.weights, slopes)

    def _planes(self, plane: ndarray) -> ndarray:
        """Components of displacements by motions, (m, c, k), from (1, x, y) of shape (3, k).

        Times loads likewise the components of the resultants by tractions.
        """
        one, x, y = plane
        zero = np.zeros_like(one)
        rows = [[one, zero], [zero, one], [-y, x]]
        if self.rough:
            vertical = [[zero, zero, p] for p in plane]
            rows = [*vertical, *([*row, zero] for row in rows)]
        return np.array(rows)

    def _displacements(self, x: ndarray) -> ndarray:
        """Displacements at points of shape (2, k) by the cells that touch, (c k, c ntouching)."""
        ground = holding(self._cells)
        found = self._tractions.displacements(ground, x, normal=self.rough)
        c = len(found)
        return found[..., self.touching].reshape(c * x.shape[1], -1)

    @computed_once
    def tractions(self) -> ndarray:
        """Mean tractions of cells by unit motions, shape (m, c, n): along x, y and downwards."""
        cells, own = self._cells, np.nonzero(self.touching)[0]
        x = cells.collocation_points[:, own]
        planes = self._planes(cells.planes(x))
        matrix = self._displacements(np.ascontiguousarray(x))
        found = Factors.from_matrix(matrix).solve(planes.reshape(len(planes), -1).T)
        out = np.zeros((*planes.shape[:2], len(cells)))
        out[..., own] = found.T.reshape(planes.shape)
        return readonly(out)

    def resultants(self, tractions: ndarray) -> ndarray:
        """Forces conjugate to the motions by tractions of shape (..., c, n), shape (..., m)."""
        cells = self._cells
        arms = cells.resultants
        slopes = self._tractions.slopes
        if slopes is not None and slopes is not cells.slopes:
            arms = cells.planes(cells.acting) * cells.partition.areas
            arms[1:] += slopes.first_moments
        return np.einsum("...cn,mcn->...m", tractions, self._planes(arms))

    @computed_once
    def collocated_stiffness(self) -> ndarray:
        """Forces by motions with which ground and base meet in the collocation points."""
        return self.resultants(self.tractions).T

    @computed_once
    def stiffness(self) -> ndarray:
        """Forces by motions, symmetric, shape (m, m): by work, where the edge is singular and all
        cells touch, otherwise by collocation."""
        stiffness = self.collocated_stiffness
        cells = self._cells
        if cells.weights is not None and self.touching.all() and cells.resisting:
            flexibility = np.linalg.inv(stiffness)
            flexibility = flexibility + flexibility.T @ self._work @ flexibility
            stiffness = np.linalg.inv(flexibility)
        return readonly((stiffness + stiffness.T) / 2)

    @computed_once
    def _work(self) -> ndarray:
        """Work of the tractions by unit motions on how far the ground is ahead of the base."""
        cells = self._cells
        x, cell, load = self._sectors
        tractions, slopes = self.tractions, self._tractions.slopes
        inside = tractions[..., cell]
        if slopes is not None and cells.weights is not None:
            arm = x - cells.weights.centroids[:, cell]
            for part, slope in zip(arm, slopes.along, strict=True):
                rise = (slope @ tractions.reshape(-1, len(cells)).T).T.reshape(tractions.shape)
                inside = inside + part * rise[..., cell]
        m = len(tractions)
        moved = self._displacements(x) @ tractions[..., self.touching].reshape(m, -1).T
        ahead = moved.T - self._planes(cells.planes(x)).reshape(m, -1)
        return (inside * load).reshape(m, -1) @ ahead.T

    @computed_once
    def _sectors(self) -> Sectors:
        cells = self._cells
        if cells.weights is None:
            return Sectors(np.empty((2, 0)), np.empty(0, int), np.empty(0))
        return sectors(cells.weights)


def moving(by: ndarray) -> ndarray:
    """Takes (W0, Lx, Ly, Ux, Uy, twist) of a point to those of a point farther on by some way."""
    out = np.eye(6)
    out[0, 1:3] = by
    out[3:5, 5] = -by[1], by[0]
    return out


@dataclass(frozen=True, eq=False, repr=False)
class ShearSolution(ReadOnly):
    """Shear tractions under a rigid base, and how it slides and twists.

    Attributes
    ----------
    horizontal : (2,) array of float
        The force (Hx, Hy) imposed on the base.
    torsion : float
        The moment imposed about the vertical through the origin, positive from x towards y.
    displacement : (2,) array of float
        Horizontal displacement (Ux, Uy) of the origin.
    twist : float
        Rotation about the vertical, positive from x towards y.
    traction : (2, n) array of float
        Mean shear tractions on the ground in each cell, along x and y; none where the base has
        lifted off. Times the areas they sum up to the forces; the torsion has part of its arms
        inside the cells.
    stiffness : (3, 3) array of float
        Maps ``(Ux, Uy, twist)`` to ``(Hx, Hy, T)``.
    origin : (2,) array of float
        The point to which displacement and moment refer.
    """

    horizontal: ndarray
    torsion: float
    displacement: ndarray
    twist: float
    traction: ndarray
    stiffness: ndarray
    origin: ndarray

    @classmethod
    def from_motions(
        cls, motions: Motions, closer: ndarray, origin: ndarray, load: ndarray
    ) -> Self:
        """Under (Hx, Hy, T) from an origin, without coupling to pressures.

        ``closer`` is a stiffness against motions of the centre of the plan, from which the
        position follows, as tractions do from that of the motions.
        """
        shift = moving(motions.footprint.centre - origin)[3:, 3:]
        stiffness = shift.T @ closer @ shift
        by_points = np.linalg.solve(motions.collocated_stiffness, np.linalg.solve(shift.T, load))
        position = np.linalg.solve(stiffness, load) + 0.0  # no zeros with a sign
        traction = np.tensordot(by_points, motions.tractions, 1)
        return cls(
            horizontal=readonly(load[:2]),
            torsion=float(load[2]),
            displacement=readonly(position[:2]),
            twist=float(position[2]),
            traction=readonly(traction),
            stiffness=readonly(stiffness),
            origin=readonly(origin),
        )

    def displacements(self, x: ArrayLike) -> ndarray:
        """Horizontal displacement of the base at points of shape (2, ...), of the same shape.

        Along x and along y, positive as these.

        Raises
        ------
        TypeError, ValueError
            If they are no points, or not finite.
        """
        x, shape = flat_points(x)
        arm = x - self.origin[:, None]
        moved = self.displacement[:, None] + self.twist * np.stack([-arm[1], arm[0]])
        return moved.reshape(2, *shape)

    def table(self) -> dict[str, str]:
        """Rows of ``repr`` by their names."""
        (hx, hy), (ux, uy) = self.horizontal, self.displacement
        return {
            "Horizontal force": f"({hx:.6g}, {hy:.6g}), torsion {self.torsion:.6g}",
            "Displacement": f"({ux:.6g}, {uy:.6g}), twist {self.twist:.6g}",
        }

    def __repr__(self) -> str:
        lines = [f"  {name:<18}{value}" for name, value in self.table().items()]
        return "\n".join(["<skfem_dual ShearSolution object>", *lines])


def require_grip(touching: ndarray) -> None:
    """Refuse horizontal loads, with a ValueError, where fewer than two cells touch."""
    if touching.sum() < 2:
        raise ValueError(
            "expected contact on two cells or more for horizontal forces and torsion, got contact "
            f"on {touching.sum()}. Remedy: a larger vertical force, or smaller cells"
        )


def sliding(
    cells: Footprint, region: ContactRegion, touching: ndarray, load: ndarray, full: Motions
) -> ShearSolution:
    """Under (Hx, Hy, T) with contact in a region, without coupling to pressures.

    Tractions are those of the cells that touch, whole; the position is that of triangles that end
    where contact does: by whole cells twists were up to a quarter too small.

    Raises
    ------
    ValueError
        If fewer than two cells touch.
    """
    require_grip(touching)
    origin = np.array(cells.origin)
    if touching.all():
        return ShearSolution.from_motions(full, full.stiffness, origin, load)
    within = filling(cells, region)
    own = Motions(within, False, np.ones(len(within), dtype=bool))
    shift = moving(within.centre - cells.centre)[3:, 3:]
    stiffness = shift.T @ own.collocated_stiffness @ shift
    closer = (stiffness + stiffness.T) / 2
    return ShearSolution.from_motions(Motions(cells, False, touching), closer, origin, load)


def filling(cells: Footprint, region: ContactRegion) -> Footprint:
    """Cells that fill a region of contact up to its edge, which is rigid there too."""
    # strips of contact one cell wide may hang together in single nodes
    mesh, ground = parted(region.mesh), cells.substrate
    basis = CellBasis(mesh, ElementTriP0())
    if mesh.nelements > DENSE:
        basis = DualMesh.from_mesh(flipped(mesh, False)[0]).basis()
    partition = Partition.from_basis(basis)
    weights = weights_of(ground, basis, partition, None)
    slopes, thin = Slopes.from_weights(weights), _slivers(partition)
    if thin.any():  # what slopes make of them is no traction
        beside = (abs(slopes.matrix) @ thin).reshape(2, -1).any(axis=0)
        slopes = slopes.without(thin | beside)
    law = weights, slopes, partition.centroids
    return Footprint(ground, partition, *law, basis, "singular", "centroid", cells.origin, None)


def _slivers(partition: Partition) -> ndarray:
    """Cells that are thin, or tiny beside a neighbour, as the edge of contact cuts them off next
    to vertices; (n,) array of bool."""
    areas, (i, j) = partition.areas, partition.neighbours
    largest = areas.copy()
    np.maximum.at(largest, i, areas[j])
    np.maximum.at(largest, j, areas[i])
    thin = partition.polygons.radii**2 > THIN * areas
    return np.asarray(thin | (areas < TINY * largest))
