"""What load cases answer: one row for each, and their envelope."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from ..arguments import place_among
from ..contact.along_lines import has_law, on_each
from ..contact.by_work import Alone
from ..contact.footprint import Footprint
from ..contact.load import Load
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly, computed_once, remember
from ..messages import shortened
from .bearing import Circles, bearing_pressure
from .punch_solution import PunchSolution

#: columns of `CasesSolution.table`
COLUMNS = (
    "name",
    "force",
    "x",
    "y",
    "settlement",
    "tilt_x",
    "tilt_y",
    "largest_settlement",
    "largest_pressure",
    "contact_share",
    "success",
    "message",
)
COUPLE = "mx", "my"
SLIDING = "hx", "hy", "torsion", "ux", "uy", "twist"
#: cells of cases that are looked at together: what they take stays in the cache
CELLS = 10_000


@dataclass(frozen=True)
class Extreme:
    """The case that governs a quantity, and its value there.

    Attributes
    ----------
    quantity : str
        What it is, a name of `CasesSolution`.
    value : float
        Its extreme value.
    number : int
        Of the case, from 0.
    name : str
        Of the case.
    """

    quantity: str
    value: float
    number: int
    name: str


@dataclass(frozen=True, eq=False, repr=False)
class CasesSolution(ReadOnly):
    """Answers of one rigid punch under several load cases.

    ``cases[i]`` and ``cases["name"]`` are the `PunchSolution` of a case: an IndexError or a
    KeyError if there is no such case, a ValueError where no pressures can balance its load.
    Arrays have one value for each case, NaN there, but what is imposed in `force` and `point`.

    Attributes
    ----------
    footprint : Footprint
        The cells under the punch.
    names : tuple of str
        Of the k cases.
    loads : tuple of Load
        What was imposed in each.
    solutions : tuple of PunchSolution or None
        None where no pressures can balance the load.
    messages : tuple of str
        What was found in each, or why not.
    """

    footprint: Footprint
    names: tuple[str, ...]
    loads: tuple[Load, ...]
    solutions: tuple[PunchSolution | None, ...]
    messages: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.solutions)

    def __getitem__(self, case: int | str) -> PunchSolution:
        number = place_among(self.names, "case", case)
        solution = self.solutions[number]
        if solution is None:
            raise ValueError(
                f"expected a case with a solution, got {self.names[number]!r}: "
                f"{self.messages[number]}"
            )
        return solution

    @computed_once
    def success(self) -> ndarray:
        """Whether the contact was found and the equations hold, see `verify`; shape (k,)."""
        return readonly(np.array([s is not None and s.success for s in self.solutions]))

    @computed_once
    def force(self) -> ndarray:
        """Forces imposed, or the resultants of imposed settlements; shape (k,)."""
        given = [load.force for load in self.loads]
        found = self._of(lambda s: s.force, ())
        return readonly(np.array([f if p is None else p for p, f in zip(given, found)]))

    @computed_once
    def point(self) -> ndarray:
        """Where the resultant acts, in the coordinates of the mesh; shape (2, k)."""
        found = self._of(lambda s: s.centre_of_pressure, (2,))
        imposed = np.array([load.point or (np.nan, np.nan) for load in self.loads])
        imposed[self.force == 0.0] = np.nan  # nothing acts there
        x = np.where(np.isfinite(imposed), imposed, found) + np.array(self.footprint.origin)
        return readonly(x.T)

    @computed_once
    def couple(self) -> ndarray:
        """Moments (mx, my), as in tables of loads, of resultants without a force, which act in no
        point; 0 of those with one; shape (2, k)."""
        found = self._of(lambda s: s.couple, (2,)).T
        return readonly(np.where(np.isfinite(self.point), 0.0, found))

    @computed_once
    def settlement(self) -> ndarray:
        """Settlements W0 of the origin, positive into the ground; shape (k,)."""
        return self._of(lambda s: s.settlement, (), lifting=True)

    @computed_once
    def tilt(self) -> ndarray:
        """Inclinations (Lx, Ly); shape (2, k)."""
        return self._of(lambda s: s.tilt, (2,), lifting=True).T

    @computed_once
    def slope(self) -> ndarray:
        """Inclinations in all, ``hypot(Lx, Ly)``; shape (k,)."""
        return readonly(np.hypot(*self.tilt))

    @computed_once
    def largest_settlement(self) -> ndarray:
        """Settlements of that point of the plan that settles most; shape (k,)."""
        arm = self.footprint.hull - np.array(self.footprint.origin)[:, None]
        return readonly((self.settlement + arm.T @ self.tilt).max(axis=0))

    @computed_once
    def largest_pressure(self) -> ndarray:
        """Largest mean pressures on a circle, see `bearing_pressure`; shape (k,).

        Cells along a line of contact count by their means."""
        return self._of(bearing_pressure, (), lifting=True)

    @computed_once
    def circles(self) -> Circles:
        """Circles on which pressures are compared."""
        return Circles.of(self.footprint)

    @computed_once
    def contact_area(self) -> ndarray:
        """Areas of contact; shape (k,)."""
        return self._of(lambda solution: solution.contact_area, (), lifting=True)

    @computed_once
    def contact_share(self) -> ndarray:
        """Parts of the plan's area in contact; shape (k,)."""
        area = self.footprint.partition.areas.sum()

        def share(solution: PunchSolution) -> float:  # all of it is 1, not less by rounding
            return solution.contact_area / area if solution.gap.any() else 1.0

        return self._of(share, (), lifting=True)

    @computed_once
    def sliding(self) -> ndarray:
        """Displacements Ux, Uy of the origin and twists under horizontal loads, (3, k); NaN in
        cases without."""

        def position(solution: PunchSolution) -> Any:
            shear = solution.shear
            return (np.nan,) * 3 if shear is None else (*shear.displacement, shear.twist)

        return self._of(position, (3,)).T

    @computed_once
    def _prepared(self) -> tuple[PunchSolution | None, ...]:
        """The solutions, with what is found in all that lift off together."""
        prepare([each for each in self.solutions if each is not None])
        return self.solutions

    def _of(
        self,
        quantity: Callable[[PunchSolution], Any],
        shape: tuple[int, ...],
        lifting: bool = False,
    ) -> ndarray:
        nothing, solutions = np.full(shape, np.nan), self._prepared if lifting else self.solutions
        found = [nothing if s is None else quantity(s) for s in solutions]
        return readonly(np.array(found, dtype=float).reshape(-1, *shape))

    def envelope(self) -> tuple[Extreme, ...]:
        """The cases that govern: largest pressure, settlement and tilt, least contact.

        Only cases with ``success`` count.

        Raises
        ------
        ValueError
            If there is none.

        Examples
        --------
        >>> from skfem import MeshTri
        >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
        >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
        >>> punch = RigidPunch(HalfSpace(30e3, 0.3), dual.basis())
        >>> cases = punch.solve_many({"own weight": {"force": 800.0},
        ...                           "wind": {"force": 900.0, "at": (0.6, 0.0)}})
        >>> [extreme.name for extreme in cases.envelope()]
        ['wind', 'wind', 'wind', 'wind']
        """
        if not self.success.any():
            raise ValueError(
                f"expected a case with a solution, got none; the first: {self.messages[0]}"
            )
        largest = {
            "largest_pressure": self.largest_pressure,
            "largest_settlement": self.largest_settlement,
            "slope": self.slope,
        }
        least = {"contact_share": self.contact_share}
        return extremes_of(self.names, self.success, largest, least)

    def table(self) -> list[dict[str, str | float | bool]]:
        """A row for each case, by the names of its columns, `COLUMNS`; those of `COUPLE` where
        cases have moments without a force, of `SLIDING` where they have horizontal loads."""
        columns = (
            self.names,
            self.force.tolist(),
            *self.point.tolist(),
            self.settlement.tolist(),
            *self.tilt.tolist(),
            self.largest_settlement.tolist(),
            self.largest_pressure.tolist(),
            self.contact_share.tolist(),
            self.success.tolist(),
            self.messages,
        )
        rows = [dict(zip(COLUMNS, row, strict=True)) for row in zip(*columns, strict=True)]
        if self.couple[:, self.success].any():
            for row, own in zip(rows, self.couple.T.tolist(), strict=True):
                row |= zip(COUPLE, own, strict=True)
        if any(load.shear is not None for load in self.loads):
            for row, load, own in zip(rows, self.loads, self.sliding.T.tolist(), strict=True):
                pushed = [0.0] * 3 if load.shear is None else load.shear.tolist()
                row |= zip(SLIDING, (*pushed, *own), strict=True)
        return rows

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write `table` to a CSV file, whole or not at all.

        Raises
        ------
        TypeError
            If ``path`` is no path.
        OSError
            If the file cannot be written.
        """
        from ..io.cases import write_cases

        write_cases(path, self)

    def __repr__(self) -> str:
        head = "  case          force        settlement   tilt                      contact"
        rows = [
            f"  {name:<14}{force:<13.6g}{w:<13.6g}{f'({lx:.4g}, {ly:.4g})':<26}{share:.3g}{pulls}"
            for name, force, w, lx, ly, share, pulls in zip(
                [shortened(name, 13) for name in self.names],
                self.force,
                self.settlement,
                *self.tilt,
                self.contact_share,
                ["" if s is None or s.pressure.min() >= 0 else ", pulls" for s in self.solutions],
            )
        ]
        if len(rows) > 12:
            rows = [*rows[:10], "  ...", rows[-1]]
        found = f"  {self.success.sum()} of {len(self)} found"
        return "\n".join(["<skfem_dual CasesSolution object>", head, *rows, found])

    def _repr_html_(self) -> str:
        from ..visuals.notebook import cases_html

        return cases_html(self)


def extremes_of(
    names: Sequence[str],
    success: ndarray,
    largest: Mapping[str, ndarray],
    least: Mapping[str, ndarray],
) -> tuple[Extreme, ...]:
    """Of the cases with ``success`` those in which quantities are largest, or least; shape (k,)
    each."""
    found = []
    for sign, quantities in ((1, largest), (-1, least)):
        for quantity, values in quantities.items():
            k = int(np.argmax(np.where(success, sign * values, -np.inf)))
            found.append(Extreme(quantity, float(values[k]), k, names[k]))
    return tuple(found)


def prepare(solutions: Sequence[PunchSolution]) -> None:
    """Find where contact ends, and what flat punches settle by it, under one punch that lifts off.

    The solutions keep what is found, as if each had looked for it.
    """
    # a shaped punch has other triangles in the cases that press over its edge
    alike: dict[int, list[PunchSolution]] = {}
    for each in solutions:
        if (each.gap > 0).any():
            alike.setdefault(id(each.punch.footprint), []).append(each)
    for lifting in alike.values():
        step = max(CELLS // len(lifting[0].gap), 1)
        for begin in range(0, len(lifting), step):
            some = lifting[begin : begin + step]
            _find_regions(some)
            _find_positions([s.member for s in some if isinstance(s.member, Alone) and s.success])


def _find_regions(solutions: Sequence[PunchSolution]) -> None:
    pressure = np.stack([each.pressure_in_points for each in solutions])
    gap = np.stack([each.gap for each in solutions])
    triangles = solutions[0].punch.footprint.triangles
    found = triangles.fitted_each(pressure, gap, solutions[0].contact_modulus)
    for each, region in zip(solutions, found, strict=True):
        remember(each, "contact_region", each.region_of(region))
        if isinstance(each.member, Alone) and each.line is None:
            remember(each.member, "region", region)


def _find_positions(members: Sequence[Alone]) -> None:
    some = [each for each in members if each.works and has_law(each.punch.work, each.contact)]
    if some:
        contacts, positions = [each.contact for each in some], [each.position for each in some]
        regions = [[each.region] for each in some]
        found = on_each(some[0].punch.work, contacts, positions, regions)
        for each, compliances in zip(some, found, strict=True):
            remember(each, "on_line", compliances)
