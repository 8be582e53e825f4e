"""What a check found: conditions with their offenders, and measures of quality."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..errors import MeshError
from ..kernels.once import ReadOnly
from .polygons import some


@dataclass(frozen=True, eq=False)
class Condition(ReadOnly):
    """One condition and where it is not met.

    Attributes
    ----------
    expected : str
        The condition in words.
    entity : str
        What the indices count: ``"node"``, ``"triangle"``, ``"facet"``, ``"cell of B"``, ...
    offending : array of int
        Indices of the entities that violate the condition; empty if it is met.
    remedy : str
        What the user can do.
    detail : str
        More about the first offender.
    required : bool
        Whether the condition decides; otherwise it is information.
    total : int, optional
        How many entities were tested.
    """

    expected: str
    entity: str
    offending: ndarray
    remedy: str = ""
    detail: str = ""
    required: bool = True
    total: int | None = None

    @property
    def ok(self) -> bool:
        """Whether the condition is met."""
        return len(self.offending) == 0

    def message(self) -> str:
        """The condition, the first offenders and the remedy in one line."""
        n = len(self.offending)
        detail = f" ({self.detail})" if self.detail else ""
        remedy = f". Remedy: {self.remedy}" if self.remedy else ""
        return (
            f"expected {self.expected}; {n} {self._noun(n)} violate{'s' if n == 1 else ''} this: "
            f"{some(self.offending)}{detail}{remedy}"
        )

    def line(self) -> str:
        """The condition and whether it is met, for a report."""
        mark = "ok  " if self.ok else "FAIL" if self.required else "no  "
        if self.ok or self.required:
            return f"{mark}  {self.expected}"
        n = len(self.offending)
        of = "" if self.total is None else f" of {self.total}"
        detail = f" ({self.detail})" if self.detail else ""
        noun = self._noun(n if self.total is None else self.total)
        return f"{mark}  {self.expected}: not at {n}{of} {noun}{detail}"

    def _noun(self, n: int) -> str:
        first, *rest = self.entity.split(" ", 1)
        return " ".join([first if n == 1 else first + "s", *rest])


@dataclass(frozen=True, eq=False)
class Measure(ReadOnly):
    """A quantity of quality, one value per entity.

    Attributes
    ----------
    name : str
        The quantity, with its unit.
    entity : str
        What the values belong to, ``"triangle"`` or ``"node"``.
    values : array of float
        One value per entity, NaN where the quantity means nothing.
    worst : int
        The entity of the worst value.
    """

    name: str
    entity: str
    values: ndarray
    worst: int

    def line(self) -> str:
        """The worst value, for a report."""
        return f"      {self.name}: {self.values[self.worst]:.3g} at {self.entity} {self.worst}"


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    """What a check found.

    Attributes
    ----------
    conditions : tuple of Condition
        The conditions tested, those that are required and those that inform.
    measures : tuple of Measure
        Quality.
    """

    conditions: tuple[Condition, ...] = ()
    measures: tuple[Measure, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether all required conditions are met."""
        return not self.violated

    @property
    def violated(self) -> tuple[Condition, ...]:
        """The required conditions that are not met."""
        return tuple(c for c in self.conditions if c.required and not c.ok)

    def lines(self) -> list[str]:
        """Conditions, measures, and what violates the conditions, line by line."""
        lines = [condition.line() for condition in self.conditions]
        lines += [measure.line() for measure in self.measures]
        return lines + [c.message() for c in self.violated]

    def __repr__(self) -> str:
        return "\n  ".join([f"<skfem_dual {type(self).__name__} object>", *self.lines()])

    def _repr_html_(self) -> str:
        from ..visuals.notebook import report_html

        return report_html(self)


def require(conditions: Iterator[Condition]) -> None:
    """Raise MeshError for the first required condition that is not met."""
    for condition in conditions:
        if condition.required and not condition.ok:
            raise MeshError(condition.message())


def where(offending: ArrayLike) -> ndarray:
    """Indices at which a mask is true, read-only."""
    indices = np.flatnonzero(offending)
    indices.setflags(write=False)
    return indices
