"""Position of a rigid punch and the pressures under it: what a solver answers."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..elements.influence import flat_points
from ..grids.polygons import readonly
from .load import Load
from .pressures import CellPressures
from .problem import Contact

#: up to so many cells a printed solution tells the condition number, in a few milliseconds
REPR_CONDITION = 2000
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PunchSolution(CellPressures):
    """Pressures under a rigid punch and its position.

    Attributes
    ----------
    punch : RigidPunch
        The problem solved.
    load : Load
        What was imposed.
    pressure : (n,) array of float
        Mean pressure on each cell, compression positive; a vector of ``punch.basis``.
    gap : (n,) array of float
        Distance of punch and ground in the collocation points, zero in contact.
    settlement : float
        Settlement W0 of ``punch.origin``, positive into the ground.
    tilt : (2,) array of float
        Inclinations (Lx, Ly): the punch settles by ``W0 + Lx x + Ly y``, from the origin.
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
    others : tuple of (RigidPunch, array)
        Punches beside this one on the same ground, with their pressures.
    """

    load: Load
    settlement: float
    tilt: ndarray
    resultant_residual: ndarray

    @classmethod
    def from_contact(
        cls,
        punch: Any,
        load: Load,
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
        others: tuple[tuple[Any, ndarray], ...] = (),
    ) -> "PunchSolution":
        """The answer, from contact and position of the plan's centroid.

        ``others`` are the punches beside it, with their pressures.
        """
        pressure, shift = contact.pressure, punch.centre - punch.origin
        resultant = punch.footprint.resultant(pressure)
        imposed = resultant.copy()
        if load.force is not None:
            imposed[0] = load.force
        if load.tilt is None:
            imposed[1:] = imposed[0] * np.array(load.at or (0.0, 0.0)) + load.first_moments
        # what the ground settles is what remains of the gap, less the punch's shape and motion
        settled = (
            contact.gap - punch.initial_gap + position @ punch.planes(punch.collocation_points)
        )
        return cls(
            punch=punch,
            load=load,
            pressure=readonly(pressure),
            gap=readonly(np.where(contact.touching, 0.0, contact.gap.clip(0))),
            settlement=float(position[0] - position[1:] @ shift),
            tilt=readonly(position[1:]),
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
        )

    @property
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm; computed when asked for."""
        return self.punch.condition_number

    def displacement(self, x: ArrayLike) -> ndarray:
        """Settlement of the ground at points of shape (2, ...), under the punch or beside it."""
        return self.ground_displacement(x)

    def punch_displacement(self, x: ArrayLike) -> ndarray:
        """Settlement ``W0 + Lx x + Ly y`` of the punch at points of shape (2, ...)."""
        x, shape = flat_points(x)
        w = self.settlement + self.tilt @ (x - np.array(self.footprint.origin)[:, None])
        return w.reshape(shape)

    def table(self) -> dict[str, str]:
        """Rows of ``repr`` by their names, without the condition number."""
        rows, scale = super().table(), max(abs(self.settlement), TINY)
        areas = self.footprint.partition.areas
        size = np.array([1.0, *[np.sqrt(areas.sum())] * 2])
        load = np.abs(self.pressure) @ areas
        residual = np.abs(self.resultant_residual / size).max() / load if load > 0 else 0.0
        first = {name: rows.pop(name) for name in ("Grid", "Substrate")}
        last = {name: rows.pop(name) for name in ("Result", "Time [s]")}
        position = {
            "Settlement W0": f"{self.settlement:.6g}",
            "Tilt (Lx, Ly)": f"({self.tilt[0]:.6g}, {self.tilt[1]:.6g})",
        }
        residuals = {
            "Residuals": (
                f"load {residual:.0e}, displacement {self.displacement_residual / scale:.0e}"
            )
        }
        return first | position | rows | residuals | last

    def __repr__(self) -> str:
        rows = self.table()
        if len(self.pressure) <= REPR_CONDITION:
            last = {name: rows.pop(name) for name in ("Result", "Time [s]")}
            rows |= {"Condition number": f"{self.condition_number:.4g}"} | last
        lines = [f"  {name:<18}{value}" for name, value in rows.items()]
        return "\n".join(["<skfem_dual PunchSolution object>", *lines])
