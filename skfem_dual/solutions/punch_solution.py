"""Position of a rigid punch and the pressures under it: what a solver answers."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_flag
from ..contact.by_work import Alone, Beside, Member
from ..contact.load import Load
from ..contact.motions import ShearSolution, sliding
from ..contact.pressed import Pressed
from ..contact.problem import Contact
from ..contact.region import ContactRegion
from ..contact.system import DENSE
from ..elements.influence import flat_points
from ..grids.polygons import readonly
from ..kernels.once import computed_once
from ..messages import place
from .bounds import Bounds, why_none
from .pressures import CellPressures

TINY = float(np.finfo(float).tiny)
#: origins no farther off the plan, over the root of its area, are on it
NEAR = 0.01


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PunchSolution(CellPressures):
    """Pressures under a rigid punch and its position.

    Attributes
    ----------
    punch : RigidPunch
        The problem solved.
    load : Load
        What was imposed. Of punches that are joined or under a frame the position that was found;
        what was imposed on the body is its ``body``.
    pressure : (n,) array of float
        Mean pressure on each cell, compression positive; a vector of ``punch.basis``.
    gap : (n,) array of float
        Distance of punch and ground in the collocation points, zero in contact.
    collocated_settlement : float
        Settlement W0 of ``punch.origin``, positive into the ground, with which the punch meets
        the ground in the collocation points; see `settlement` for a closer one.
    collocated_tilt : (2,) array of float
        Inclinations (Lx, Ly) likewise.
    resultant : (3,) array of float
        Integrals of ``p``, ``p x`` and ``p y``, from the origin.
    resultant_residual : (3,) array of float
        Resultant minus the imposed load; zero where a position was imposed.
    displacement_residual : float
        Largest distance of ground and punch in a collocation point in contact, or overlap
        beside it.
    complementarity_residual : float
        Largest violation of ``p >= 0``, ``gap >= 0`` and ``p gap = 0`` in a cell: pressures over
        their largest, gaps over the largest settlement of the ground.
    iterations : int
        Iterations in which the contact region was found; none where that is the whole plan.
    success : bool
        Whether the contact region was found and the equations hold, see `verify`.
    message : str
        What was found, or why not.
    timings : dict of str to float
        Seconds of assembly, factorisation and solution.
    others : tuple of Pressed
        Punches beside this one on the same ground, with their pressures.
    flat : (n,) array of bool or None
        Cells in which the pressure does not follow the cells around, see `Slopes`, as it would
        turn negative; None if there are none.
    line : LineWeights or None
        Of a shaped punch: how pressures end along the line of contact, inside the cells, by the
        root of the distance to it; cells that it crosses have a pressure, and those whose
        collocation point is out of contact a gap, too. None where pressures end with the cells.
    member : Alone, Beside, Member or None
        What tells its position by work: alone, beside others, or in a group of flat punches.
    """

    load: Load
    collocated_settlement: float
    collocated_tilt: ndarray
    resultant_residual: ndarray
    member: Alone | Beside | Member | None = None

    @classmethod
    def from_contact(
        cls,
        punch: Any,
        load: Load,
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
        others: tuple[Pressed, ...] = (),
        member: Alone | Beside | Member | None = None,
    ) -> "PunchSolution":
        """The answer, from contact and position of the plan's centroid.

        ``others`` are the punches beside it; of a group it is a ``member``.
        """
        if member is None and not others:
            member = Alone(punch, load, contact)
        pressure, shift = contact.pressure, punch.centre - punch.origin
        resultant = Pressed.of(punch, contact).cells.resultant(pressure)
        imposed = resultant.copy()
        if load.force is not None:
            imposed[0] = load.force
        if load.tilt is None:
            imposed[1:] = load.moments_of(imposed[0])
        # what the ground settles is what remains of the gap, less the punch's shape and motion
        settled = (
            contact.gap - punch.initial_gap + position @ punch.planes(punch.collocation_points)
        )
        return cls(
            punch=punch,
            load=load,
            pressure=pressure,
            gap=readonly(contact.clearance),
            collocated_settlement=float(position[0] - position[1:] @ shift),
            collocated_tilt=readonly(position[1:]),
            resultant=readonly(resultant),
            resultant_residual=readonly(resultant - imposed),
            displacement_residual=contact.violation,
            complementarity_residual=max(
                contact.pulling, contact.violation / max(np.abs(settled).max(), TINY)
            ),
            iterations=len(contact.history),
            success=contact.success,
            message=contact.message or contact.description,
            timings=timings,
            others=others,
            flat=contact.flat,
            line=contact.line,
            member=member,
        )

    @computed_once
    def contact_region(self) -> ContactRegion:
        """Where punch and ground touch, with an edge that runs inside the cells."""
        if isinstance(self.member, Alone) and self.line is None:
            return self.region_of(self.member.region)
        return super().contact_region

    @property
    def settlement(self) -> float:
        """Settlement W0 of ``punch.origin``, positive into the ground, as close as is known.

        Of flat punches with edge-weighted cells that of the work of the pressures, see `Work`;
        cells in which ground and punch are apart by more than 2.5 % of the settlement on average
        do not take part, and where the punch lifts off pressures end along the line of contact,
        not with the cells as those of the solution, see `LineWork`; beside structures and shaped
        punches with the cells. Likewise of shaped ones pressed over the edge of their plan while
        all of their base touches. Of others that of collocation. A settlement that is imposed is
        returned, to rounding; the pressures are those of the load that moves the punch there.
        """
        return float(self.positions[0, 0])

    @property
    def tilt(self) -> ndarray:
        """Inclinations (Lx, Ly), by the work of the pressures as the settlement, shape (2,).

        The punch settles by ``W0 + Lx x + Ly y``, from the origin.
        """
        return self.positions[0, 1:]

    @computed_once
    def positions(self) -> ndarray:
        """Three rows of (W0, Lx, Ly), shape (3, 3): the closest estimate, by the work of the
        pressures on all cells, and by collocation; all the same where work tells nothing."""
        collocated = np.array([self.collocated_settlement, *self.collocated_tilt])
        found = None
        if self.member is not None and self.success:
            found = self.member.positions
        if found is None:
            found = np.array([collocated, collocated])
        return readonly(np.vstack([found, collocated]))

    @computed_once
    def bounds(self) -> Bounds:
        """Between which values the exact settlement and tilt are expected; computed on demand.

        Solves the same problem on the other grid of the mesh, in a few times the time of the
        solution. Printed with the solution once computed.

        Raises
        ------
        ValueError
            If the punch has neighbours that are not flat or do not move alone, stands under a
            frame or on quadrilateral cells, its shape is that of one grid's cells only, or the
            equations do not hold.
        MeshError
            If the triangles have no valid dual grid.
        ConvergenceError
            If there is no solution on the other grid, as on one or two triangles.

        Examples
        --------
        >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
        >>> from skfem_dual.grids.generate import disc
        >>> basis = DualMesh.from_mesh(disc(n=150)).basis()
        >>> low, high = RigidPunch(HalfSpace(1.0, 0.0), basis).solve(1.0).bounds.settlement
        >>> bool(low < 0.5 < high)  # exact for the circle
        True
        """
        return Bounds.from_solution(self)

    @computed_once
    def shear(self) -> ShearSolution | None:
        """How the punch slides and twists under its horizontal load; None without one.

        Raises
        ------
        ValueError
            If fewer than two cells touch.
        """
        load = self.load.shear
        if load is None or not (load.any() or self.pressure.any()):
            return None
        touching, full = self.pressure != 0, self.punch.relaxed_motions
        return sliding(self.footprint, self.contact_region, touching, load, full)

    @property
    def condition_number(self) -> float:
        """Condition number of the punch's own matrix in the 2-norm; computed when asked for."""
        return self.punch.condition_number

    def displacement(self, x: ArrayLike) -> ndarray:
        """The same as `ground_displacement`; of structures ``displacement`` is their vector."""
        return self.ground_displacement(x)

    def punch_displacement(self, x: ArrayLike, *, collocated: bool = False) -> ndarray:
        """Settlement ``W0 + Lx x + Ly y`` of the punch at points of shape (2, ...).

        With ``collocated`` in the position in which it meets the ground in collocation points.
        Coordinates x and y are here those from ``punch.origin``, points are in those of the plan.

        Raises
        ------
        TypeError, ValueError
            If they are no points, or not finite, or ``collocated`` is neither True nor False.
        """
        x, shape = flat_points(x)
        settlement, *tilt = self.positions[2 if checked_flag("collocated", collocated) else 0]
        w = settlement + tilt @ (x - np.array(self.footprint.origin)[:, None])
        return w.reshape(shape)

    def _position_rows(self) -> dict[str, str]:
        rows = self._origin_off_plan | {
            "Settlement W0": f"{self.settlement:.6g}",
            "Tilt (Lx, Ly)": f"({self.tilt[0]:.6g}, {self.tilt[1]:.6g})",
        }
        return rows if self.shear is None else rows | self.shear.table()

    def _residuals(self) -> str:
        moved = self.punch_displacement(self.punch.collocation_points)
        # a punch may hardly move where its shape is pressed into the ground
        settled = moved + self.gap - self.punch.initial_gap
        scale = max(np.abs([moved, settled]).max(), TINY)
        misfit = abs(self.displacement_residual) / scale
        areas = self.footprint.partition.areas
        size = np.array([1.0, *[np.sqrt(areas.sum())] * 2])
        load = np.abs(self.pressure) @ areas
        residual = np.abs(self.resultant_residual / size).max() / load if load > 0 else 0.0
        return f"load {residual:.0e}, displacement {misfit:.0e}"

    @property
    def _origin_off_plan(self) -> dict[str, str]:
        """A row that tells of an origin to which nothing near the plan refers."""
        plan, origin = self.footprint.hulls[1], self.footprint.origin - self.footprint.centre
        off = plan.beyond(origin)
        if off <= NEAR * np.sqrt(self.footprint.partition.areas.sum()):
            return {}
        return {"Origin": f"{place(self.footprint.origin)}, {off:.3g} off the plan"}

    def _on_demand(self) -> dict[str, str]:
        rows = {}
        if "bounds" in self.__dict__:
            name, line = next(iter(self.bounds.lines().items()))
            rows["Bounds"] = f"{name} {line}"
        elif not why_none(self):
            rows["Bounds"] = "see solution.bounds"
        if self.others:  # the matrix is that of all
            return rows
        system = self.punch.__dict__.get("system")
        if "condition_number" in getattr(system, "__dict__", {}):
            rows["Condition number"] = f"{self.condition_number:.4g}"
        elif len(self.pressure) <= DENSE:
            rows["Condition number"] = "see solution.condition_number"
        return rows
