"""What isobars are drawn of: the pressure of a solution, or any field, where it is in contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from skfem import CellBasis

from ..arguments import checked_size
from ..contact.region import ContactRegion
from ..grids.cellwise import nodal_mesh
from ..messages import shown
from ..solutions.group_solution import PunchesSolution
from ..solutions.pressures import CellPressures, checked_solution
from .field import Field, continuous

if TYPE_CHECKING:
    from numpy import ndarray
from numpy.typing import ArrayLike

#: most triangles of a pressure that is drawn, and how often they are cut in four at most
TRIANGLES, REFINE = 50_000, 3


#: what isobars are drawn of
Drawn: TypeAlias = "CellPressures | Sequence[CellPressures] | PunchesSolution | CellBasis"


@dataclass(frozen=True, eq=False)
class Subject:
    """A continuous field and the part of it that is drawn.

    Attributes
    ----------
    field : Field
        On the whole plan.
    pressed : Field
        Where there is contact.
    contact : ContactRegion or None
        Where that is.
    title : str or None
        The quantity.
    singular : bool
        Whether it grows beyond all bounds to the edge.
    """

    field: Field
    pressed: Field
    contact: ContactRegion | None
    title: str | None
    singular: bool

    @classmethod
    def of(
        cls,
        pressure: Drawn,
        values: ArrayLike | None,
        title: str | None,
        contact: ContactRegion | None,
        scale: float | None = None,
    ) -> Subject:
        """Of solutions without values, or of a basis with the values of its DOFs.

        Raises
        ------
        TypeError
            If it is something else, or there is more than that.
        """
        if isinstance(pressure, PunchesSolution):
            pressure = pressure.solutions
        if isinstance(pressure, (CellPressures, tuple, list)):
            if values is not None or contact is not None:
                raise TypeError(
                    "expected a solution alone, got values or a contact region beside it. "
                    "Remedy: isobars(basis, values, contact=...)"
                )
            return cls._of_solutions(
                [pressure] if isinstance(pressure, CellPressures) else pressure, title, scale
            )
        if not isinstance(pressure, CellBasis):
            raise TypeError(
                f"expected a solution or a CellBasis to draw isobars of, got {shown(pressure)}. "
                "Remedy: isobars(punch.solve(...)), or isobars(basis, values)"
            )
        if scale is not None:
            raise TypeError("expected a scale with a solution only, got one with a basis")
        if values is None:
            raise TypeError(f"expected one value for each of the {pressure.N} DOFs, got none")
        field = continuous(pressure, values)
        pressed = field if contact is None else field.in_contact(contact)
        return cls(field, pressed, contact, title, False)

    @classmethod
    def _of_solutions(
        cls, solutions: Sequence[CellPressures], title: str | None, scale: float | None
    ) -> Subject:
        for solution in solutions:
            checked_solution("a solution to draw", solution)
        mean, quantity = pressure_scale(*solutions)
        title = quantity if title is None and scale is None else title
        scale = mean if scale is None else checked_size("scale", scale)
        fields, pressed = [], []
        for solution in solutions:
            basis, values = drawn_pressure(solution)
            fields.append(continuous(basis, values / scale))
            if solution.contact_area > 0 or len(solutions) == 1:
                pressed.append(fields[-1].in_contact(solution.contact_region))
        return cls(
            Field.together(fields),
            Field.together(pressed),
            ContactRegion.together([solution.contact_region for solution in solutions]),
            title,
            any(s.punch.sharp_edge for s in solutions),
        )


def pressure_scale(*solutions: CellPressures) -> tuple[float, str]:
    """What pressures are drawn over, and the name of their ratio.

    The mean pressure, or the largest of a cell where moments alone leave no mean.

    Raises
    ------
    ValueError
        If there is no pressure at all.
    """
    largest = max((float(np.abs(s.pressure).max()) for s in solutions), default=0.0)
    if largest == 0:
        raise ValueError("expected a load to draw isobars of, got no pressure at all")
    area = sum(solution.contact_area for solution in solutions)
    mean = sum(solution.force for solution in solutions) / area if area > 0 else 0.0
    return (mean, "p / mean p") if abs(mean) >= 1e-3 * largest else (largest, "p / max |p|")


def drawn_pressure(solution: CellPressures) -> tuple[CellBasis, ndarray]:
    """`CellPressures.pressure_field` on a mesh refined as often as a picture can show."""
    mesh = nodal_mesh(solution.punch.basis)
    triangles = mesh.nelements * (1 if len(mesh.t) == 3 else 4)
    refine = int(np.clip(np.log(TRIANGLES / triangles) / np.log(4), 0, REFINE))
    basis, pressure = solution.pressure_field(refine=refine)
    if solution.pressure.min() >= 0:  # what lies between cells that do not pull does not either
        pressure = pressure.clip(min=0.0)
    return basis, pressure
