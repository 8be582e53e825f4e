"""What a report says beyond the solution: who, what, units, and what the ground may bear."""

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy import ndarray

from ..arguments import (
    Pair,
    checked_instance,
    checked_pair,
    checked_sequence,
    checked_size,
    checked_text,
)
from ..bodies.plates import Plate
from ..io import CaseRow
from ..plans.search import Accuracy
from ..units import PLAIN, Units


@dataclass(frozen=True)
class Details:
    """Title and measures of a report.

    Attributes
    ----------
    title, project, author : str, optional
        As they stand on top.
    date : date or datetime, optional
        With the time of day if it has one; now by default.
    mesh_name : str, optional
        Where the mesh is from, such as the name of its file; names by commas of several.
    units : Units or str
        Of all numbers that go in, such as ``"kN,m"``, and those to read; see `Units`.
    allowable : float, optional
        Bearing pressure allowed, in force per length squared.
    points : sequence of pair of float
        Points of the plan, in its coordinates, whose settlements are wanted.
    profile : pair of float, optional
        Point below which stresses and strains are wanted; the plan's centroid by default.
    remarks : sequence of str
        Warnings to show on top, such as those of reading the mesh.
    accuracy : mapping of str to Accuracy
        How the meshes of footings were chosen, by their names, ``""`` of a single one; that of
        a `PlanSolution` is known.
    plates : mapping of str to Plate
        What structures are made of, by their names, ``""`` of a single one: told on the page, with
        the bending moments.
    columns : mapping of str to sequence of CaseRow
        What stands on structures, as `read_cases` has it with ``parts=True``, by their names,
        ``""`` of a single one: listed on the page.
    unsolved : mapping of str to str
        Cases of which there is no solution at all, by their names, and why: told and counted.

    Raises
    ------
    TypeError
        If something is of another kind.
    ValueError
        If units are not known, ``allowable`` is not positive, or points are not finite.
    """

    title: str | None = None
    project: str | None = None
    author: str | None = None
    date: datetime.date | None = None
    mesh_name: str | None = None
    units: Units = PLAIN
    allowable: float | None = None
    points: Sequence[Pair] = ()
    profile: Pair | None = None
    remarks: Sequence[str] = ()
    accuracy: Mapping[str, Accuracy] = field(default_factory=dict)
    plates: Mapping[str, Plate] = field(default_factory=dict)
    columns: Mapping[str, Sequence[CaseRow]] = field(default_factory=dict)
    unsolved: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("title", "project", "author", "mesh_name"):
            if (text := getattr(self, name)) is not None:
                checked_text(name, text)
        date = self.date
        if date is not None:
            checked_instance("date", date, datetime.date)
        if not isinstance(self.units, Units):
            object.__setattr__(self, "units", Units(self.units))
        for of, kind in (("accuracy", Accuracy), ("plates", Plate), ("unsolved", str)):
            checked_instance(of, getattr(self, of), Mapping)
            for name, record in getattr(self, of).items():
                checked_instance(f"{of}[{name!r}]", record, kind)
        checked_instance("columns", self.columns, Mapping)
        for name, rows in self.columns.items():
            for row in checked_sequence(f"columns[{name!r}]", rows):
                checked_instance(f"a row of columns[{name!r}]", row, CaseRow, "read_cases")
        remarks = checked_sequence("remarks", self.remarks)
        points = checked_sequence("points", self.points)
        found: dict[str, Any] = {
            "accuracy": dict(self.accuracy),
            "plates": dict(self.plates),
            "columns": dict(self.columns),
            "unsolved": dict(self.unsolved),
            "date": datetime.datetime.now().astimezone() if date is None else date,
            "allowable": self.allowable,
            "points": tuple(checked_pair(f"points[{i}]", x) for i, x in enumerate(points)),
            "remarks": tuple(checked_text("remarks", remark) for remark in remarks),
        }
        if self.profile is not None:
            found["profile"] = checked_pair("profile", self.profile)
        if self.allowable is not None:
            found["allowable"] = checked_size("allowable", self.allowable)
        for name, value in found.items():
            object.__setattr__(self, name, value)

    @property
    def told_date(self) -> str:
        """The date as it stands on a page."""
        time = " %H:%M" if isinstance(self.date, datetime.datetime) else ""
        return f"{self.date:%Y-%m-%d{time}}"

    @property
    def own_points(self) -> ndarray:
        """The points wanted, shape (2, k)."""
        return np.array(self.points, dtype=float).reshape(-1, 2).T
