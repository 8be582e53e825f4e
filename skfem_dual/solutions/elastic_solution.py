"""Deflections of a structure and the pressures under it: what a solver answers."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem.assembly.basis import AbstractBasis

from ..contact.edges import rough_of
from ..contact.pressed import Pressed
from ..contact.problem import Contact, warn_of
from ..elements.influence import flat_points
from ..elements.point_values import value_matrix
from ..errors import ResolutionWarning, warn
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from ..messages import place
from .pressures import CellPressures
from .punch_solution import TINY

#: forces on free DOFs that are not balanced, over the largest load
EQUILIBRIUM = 1e-6
#: the same, over the forces of which they are the sums, as long as that is little of the load
ROUNDING, LITTLE = 1e-10, 1e-3
#: forces do as much of the work that they might on a motion if they are mostly along it
ALONG = 0.1
#: work of a stiffness on its own motions that is rounding, over the root of the squares of that
#: of its entries: up to 2 EPS on free plates and solids
NOISE = 64 * float(np.finfo(float).eps)
#: pressures under a cell that are less of all pressures are rounding
UNLOADED = 1e-11
#: mean deflections of cells farther from those of their middles, over the largest, are told
BENT = 0.05


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ElasticSolution(CellPressures):
    """Pressures under a structure that bends, and its displacements.

    Attributes
    ----------
    punch : ElasticPunch
        The problem solved.
    f : (N,) array of float
        The load vector.
    displacement : (N,) array of float
        A vector of ``punch.structure``.
    reactions : (N,) array of float
        Forces by which DOFs are held, zero elsewhere.
    pressure : (n,) array of float
        Mean pressure on each cell, compression positive.
    gap : (n,) array of float
        Distance of structure and ground in the collocation points, zero in contact.
    resultant : (3,) array of float
        Integrals of ``p``, ``p x`` and ``p y``, from ``punch.origin``.
    equilibrium_residual : float
        Largest force on a free DOF that is not balanced, over the largest load, pressure or force
        of the values of held DOFs, in units of the root of the DOF's stiffness; or work of the
        stiffness on motions taken to meet no resistance, over that of these, if it is more.

    Notes
    -----
    Residuals of the contact, iterations, whether it was found, message and timings are named as
    those of `PunchSolution`.
    """

    f: ndarray
    displacement: ndarray
    reactions: ndarray
    equilibrium_residual: float

    @classmethod
    def from_contact(
        cls,
        punch: Any,
        f: ndarray,
        held: ndarray,
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
        others: tuple[Pressed, ...] = (),
    ) -> "ElasticSolution":
        """The answer, from loads, values of DOFs that are held, contact and motions."""
        fixed, flat = punch.compliance.fixed, contact.flat
        cells = punch.footprint if flat is None else punch.footprint.flattened(flat)
        pressed = punch.loads_of(cells) @ contact.pressure
        moved = punch.motions @ position
        bent, forces, residual, noise = _bent(punch, f, pressed, held, moved)
        displacement = punch.free_motions.steadied(bent + moved)
        reactions = np.zeros(len(f))
        reactions[fixed] = forces[fixed]
        if contact.success:
            contact = _in_equilibrium(punch, contact, forces, residual - noise, moved)
        warn_of(contact, rough_of(cells.partition, contact, not punch.initial_gap.any()))
        if contact.success:
            _warn_if_bent(punch, cells, displacement, contact.touching)
        # of the ground: what remains of the gap, less the structure's shape and deflection
        settled = contact.gap - punch.initial_gap + punch.trace @ displacement
        scale = max(np.abs(settled).max(), TINY)
        return cls(
            punch=punch,
            f=readonly(f),
            displacement=readonly(displacement),
            reactions=readonly(reactions),
            pressure=readonly(contact.pressure),
            gap=readonly(contact.clearance),
            resultant=readonly(cells.resultant(contact.pressure)),
            equilibrium_residual=residual,
            displacement_residual=contact.violation,
            complementarity_residual=max(contact.pulling, contact.violation / scale),
            iterations=len(contact.history),
            success=contact.success,
            message=contact.message or contact.description,
            timings=punch.timings | timings,
            flat=flat,
            others=others,
        )

    @property
    def vertical_reaction(self) -> float:
        """Sum of the vertical forces that hold the structure, positive into the ground: with the
        loads it is the force on the ground, less what springs in the stiffness take. In
        ``reactions`` are those of all DOFs, moments of slopes and horizontal forces among them.
        """
        return (
            float(self.reactions @ self.punch.interface.settling) if self.reactions.any() else 0.0
        )

    def deflection(self, x: ArrayLike) -> ndarray:
        """Deflection of the structure at points of the plan, positive into the ground.

        Parameters
        ----------
        x : (2, ...) array of float
            Points in any shape; of a solid those of its boundary above the ground.

        Returns
        -------
        (...) array of float

        Raises
        ------
        TypeError, ValueError
            If they are no points, or one lies beside the structure.
        """
        punch = self.punch
        points, shape = flat_points(x)
        values = value_matrix(punch.contact_basis, points, punch.component) @ self.displacement
        return (-values if punch.interface.upward else values).reshape(shape)

    @computed_once
    def contact_modulus(self) -> float:
        """E* of the ground and a solid together, the median at the line of contact.

        It follows from what both yield under single cells there. Beside a solid as soft as the
        ground gaps open twice as far as beside a rigid one. Plates bend, but loads on single cells
        do not dent them.
        """
        punch, cells = self.punch, self.footprint
        if punch.boundary is None:
            return super().contact_modulus
        line = np.unique(cells.partition.across(self.pressure > 0))
        if len(line) == 0:
            return super().contact_modulus
        x = np.ascontiguousarray(punch.collocation_points[:, line])
        ground = cells.influence(x)[np.arange(len(line)), line]
        lifted = punch.balanced_compliance.displacements(punch.loads_of(cells)[:, line].toarray())
        yields = np.sum(punch.trace[line].toarray() * lifted.T, axis=1)
        return super().contact_modulus / float(np.median(1 + yields.clip(0) / ground))

    @property
    def cell_deflections(self) -> ndarray:
        """Deflection of the collocation point of each cell, its centroid; where that lies outside
        of the structure, in a cell around a re-entrant corner, the mean over the cell; shape (n,).
        """
        return self.punch.trace @ self.displacement

    @property
    def deflection_range(self) -> tuple[float, float]:
        """Least and greatest deflection of the collocation points."""
        deflections = self.cell_deflections
        return float(deflections.min()), float(deflections.max())

    def load_vector(self, basis: AbstractBasis | None = None, **options: Any) -> ndarray:
        """The pressure as a load on finite elements, those of the structure by default.

        Parameters
        ----------
        basis, options
            As of `PunchSolution.load_vector`.

        Returns
        -------
        (N,) array of float
            Integrals of ``p v``; of a solid those of the traction ``-p n . v``. A plate is in
            equilibrium with ``f`` minus this load, a solid with ``f`` plus this load.

        Raises
        ------
        TypeError, ValueError
            As there; if options are given without a basis.
        """
        if basis is not None:
            return super().load_vector(basis, **options)
        if options:
            raise TypeError(f"expected a basis with {list(options)}, got none")
        pressed = self.punch.loads_of(self.footprint) @ self.pressure
        return -pressed if self.punch.interface.upward else pressed

    def _position_rows(self) -> dict[str, str]:
        least, most = self.deflection_range
        return {
            "Structure": f"{len(self.f)} DOFs of {type(self.punch.structure.elem).__name__}",
            "Deflection": f"{least:.6g} to {most:.6g}",
        }

    def _residuals(self) -> str:
        found, touching = self.equilibrium_residual, self.complementarity_residual
        return f"equilibrium {found:.0e}, contact {touching:.0e}"


def _bent(
    punch: Any, f: ndarray, pressed: ndarray, held: ndarray, moved: ndarray
) -> tuple[ndarray, ndarray, float, float]:
    """Displacements under the loads up to the motions, what is left of the forces, and
    `_unbalanced`."""
    K = punch.compliance.stiffness
    loads = f, pressed, K @ held

    def checked(bent: ndarray) -> tuple[ndarray, ndarray, float, float]:
        forces = K @ bent - f + pressed  # motions take no forces, but cancel by rounding
        return bent, forces, *_unbalanced(punch, loads, forces, bent, moved)

    bent, forces, residual, noise = found = checked(punch.lifted(f - pressed, held))
    if residual - noise <= EQUILIBRIUM:
        return found
    # long strips are hardly stiff along some ways: once more for what is left
    again = checked(bent - punch.lifted(forces, np.zeros(len(f))))
    return again if again[2] < residual else found


def _unbalanced(
    punch: Any, loads: tuple[ndarray, ...], forces: ndarray, bent: ndarray, moved: ndarray
) -> tuple[float, float]:
    """Forces that are not balanced over the largest load, and how much of them may be rounding."""
    K, unit = punch.compliance.stiffness, punch.compliance.units
    # those on DOFs that are held count as well: others may have none
    resisting = K.diagonal().clip(0.0)
    every = np.divide(1.0, np.sqrt(resisting), np.zeros(len(resisting)), where=resisting > 0)
    largest = max(*(np.abs(every * load).max() for load in loads), TINY)
    residual = float(np.abs(unit * forces).max() / largest)
    rounding = ROUNDING * float((unit * (abs(K) @ np.abs(bent))).max() / largest)
    # motions that springs too soft for the factors resist do work, more than by rounding
    ways = np.abs(punch.motions).T
    largest_entry, most = abs(K).max(), max(np.abs(moved).max(), TINY)  # squares remain numbers
    squares = (K / largest_entry).power(2) @ (moved / most) ** 2
    chance = largest_entry * most * np.sqrt((ways**2) @ squares)
    work = np.abs(punch.motions.T @ (K @ moved)) - NOISE * chance
    lost = work / np.maximum(ways @ np.abs(loads).sum(axis=0), TINY)
    return max(residual, float(lost.max(initial=0.0))), min(rounding, LITTLE)


def _in_equilibrium(
    punch: Any, contact: Contact, forces: ndarray, residual: float, moved: ndarray
) -> Contact:
    """The contact, without success where forces are not balanced or nothing tells a position."""
    free = punch.free_motions
    if not residual <= EQUILIBRIUM:
        idle = free.idle
        share = np.abs(idle.T @ forces) / np.maximum(np.abs(idle).T @ np.abs(forces), TINY)
        cause = (
            "pressures work on a mechanism, which neither the stiffness nor points in the middle "
            'of the cells resist. Remedy: full integration, hold it, D=, or edge="constant"'
            if (share > ALONG).any()
            else "likely cause: a stiffness of very different sizes together"
        )
        message = (
            f"the equations do not hold: forces of the structure are off by {residual:.1e} of "
            f"its loads; {cause}"
        )
        return replace(contact, success=False, message=message)
    force = np.abs(contact.pressure)
    # without any load it stays where it is
    if moved.any() and (lost := free.untold(force > UNLOADED * force.sum())):
        message = (
            f"{lost} presses on the ground nowhere, and nothing else tells its position. "
            "Remedy: loads that press it on the ground, or hold more of it, D="
        )
        return replace(contact, success=False, message=message)
    return contact


def _warn_if_bent(punch: Any, cells: Any, displacement: ndarray, touching: ndarray) -> None:
    bent, cell = punch.interface.bent_within(displacement, touching)
    if bent > BENT:
        at = place(cells.partition.centroids[:, cell])
        warn(
            f"the structure bends within cells: the mean deflection of cell {cell} at {at} is "
            f"{100 * bent:.2g} % of the largest off that of its middle, and deflections are "
            "rough. Remedy: smaller cells there",
            ResolutionWarning,
        )
