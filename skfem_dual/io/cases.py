"""Load cases from CSV files, and their answers into them."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..arguments import LARGEST, SMALLEST, Pair, checked_flag, checked_instance, checked_sequence
from ..messages import one_line, shown
from ..solutions.cases_solution import CasesSolution
from ..units import PLAIN, Units
from .tables import cell_number, read_table, unit_factor
from .writing import PathLike, checked_path, write_whole

#: endings of files that are read as something else than text
OTHERS = (".xlsx", ".xls", ".ods", ".json", ".html", ".pdf", ".vtu", ".npy")
#: columns of a table of loads; only the name and the force, or a load per area, must be there
KNOWN = ("name", "footing", "force", "x", "y", "ex", "ey", "mx", "my", "hx", "hy", "torsion")
#: and those of loads on parts of a plate
PARTS = ("bx", "by", "q")
#: other words for them
ALSO = {
    **dict.fromkeys(("case", "load case", "lastfall", "cas", "cas de charge"), "name"),
    **dict.fromkeys(("fundament", "semelle"), "footing"),
    **dict.fromkeys(("p", "v", "f", "n", "kraft", "kräfte", "last", "load"), "force"),
}
#: what they measure
QUANTITY = {
    **dict.fromkeys(("force", "hx", "hy"), "force"),
    **dict.fromkeys(("x", "y", "ex", "ey", "bx", "by"), "length"),
    **dict.fromkeys(("mx", "my", "torsion"), "moment"),
    "q": "pressure",
}


@dataclass(frozen=True)
class CaseRow:
    """A load case of one footing, as a line of a file has it.

    Attributes
    ----------
    where : str
        File and line, for messages.
    name, footing : str
        Of the case; of the footing, empty if that is not said.
    force : float
        Into the ground.
    at : pair of float or None
        Where it acts, in the coordinates of the plan.
    eccentricity : pair of float or None
        Or where it acts from the origin.
    moments : pair of float
        Mx about the x axis, positive where it presses down the side of larger y; My about the y
        axis, positive where it presses down the side of larger x. About the point of the force.
    horizontal : pair of float or None
        Force along x and y in the plane of the base.
    torsion : float or None
        Moment about the vertical through the origin, positive from x towards y.
    sides : pair of float
        On a plate: of the rectangle over which force and moments are spread, along x and y.
    spread : float
        On a plate: force per area, all over it.
    """

    where: str
    name: str
    footing: str
    force: float
    at: Pair | None
    eccentricity: Pair | None
    moments: Pair
    horizontal: Pair | None = None
    torsion: float | None = None
    sides: Pair = (0.0, 0.0)
    spread: float = 0.0

    def point(self, origin: Pair) -> Pair:
        """Where the force acts, in the coordinates of the plan."""
        ex, ey = self.eccentricity or (0.0, 0.0)
        return self.at or (origin[0] + ex, origin[1] + ey)

    def load(self, origin: Pair) -> dict[str, float | Pair]:
        """Arguments of `Load`, for a punch with this origin."""
        at = self.eccentricity or (0.0, 0.0)
        if self.at is not None:
            at = self.at[0] - origin[0], self.at[1] - origin[1]
        mx, my = self.moments
        moments: dict[str, float | Pair] = {"moments": (-my, mx)} if mx or my else {}
        shear = {"horizontal": self.horizontal, "torsion": self.torsion}
        carried = {name: value for name, value in shear.items() if value is not None}
        return {"force": self.force, "at": at, **moments, **carried}


def read_cases(
    path: PathLike, units: Units | str = PLAIN, *, parts: bool = False
) -> tuple[CaseRow, ...]:
    """Read load cases from a CSV file with a line of headings.

    Parameters
    ----------
    path : path
        Columns ``name`` and ``force``; where the force acts, ``x, y`` in the coordinates of the
        plan or ``ex, ey`` from the origin, which is meant without them; moments ``mx, my``;
        horizontal forces ``hx, hy`` and ``torsion``; and ``footing`` where there are several.
        Headings may have units, such as ``force [kN]``. Commas, semicolons or tabs part the
        columns; with the latter two decimal commas are read, too. Empty lines and those that
        begin with ``#`` do not count.
    units : Units or str
        To which units of headings are changed, such as ``"kN,m"``; needed if there are any.
    parts : bool
        Whether lines of one name are parts of one case, as the columns on a plate. Then there may
        be sides ``bx, by`` of rectangles over which they are spread, and ``q``, a force per area.

    Returns
    -------
    tuple of CaseRow
        One for each line, in their order.

    Raises
    ------
    FileNotFoundError, TypeError
        If there is no such file, or it is no path.
    ValueError
        If a column is missing or not known, something is no number, or a case is named twice;
        says in which line.
    """
    units = units if isinstance(units, Units) else Units(units)
    texts = {"name", "footing", *(word for word, is_ in ALSO.items() if is_ != "force")}
    where, headings, rows = read_table(path, texts)
    heads = [ALSO.get(head.name, head.name) for head in headings]
    _require_heads(heads, where, (*KNOWN, *PARTS) if parts else KNOWN)
    factors = {
        name: unit_factor(head, QUANTITY.get(name, ""), units, where)
        for name, head in zip(heads, headings, strict=True)
    }
    cases = tuple(_case(factors, cells, place) for place, cells in rows)
    if not any(any(case.horizontal or ()) or case.torsion for case in cases):
        # columns are there, but no such loads
        cases = tuple(replace(case, horizontal=None, torsion=None) for case in cases)
    if checked_flag("parts", parts):
        return cases
    seen: dict[tuple[str, str], str] = {}
    for case in cases:
        key = case.name, case.footing
        if key in seen:
            raise ValueError(
                f"{case.where}: expected another name than {case.name!r}, see {seen[key]}"
            )
        seen[key] = case.where
    return cases


def write_cases(path: PathLike, *tables: CasesSolution, footings: Sequence[str] = ()) -> None:
    """Write the table of cases to a CSV file, whole or not at all; of footings by their names.

    Parameters
    ----------
    path : path
        The file.
    *tables : CasesSolution
        Of each footing, one after the other.
    footings : sequence of str
        Their names, for a first column; none by default.

    Raises
    ------
    TypeError, ValueError
        If there are no tables, one is something else, or there are not as many names.
    OSError
        If the file cannot be written.
    """
    for number, cases in enumerate(tables):
        checked_instance(f"table {number}", cases, CasesSolution)
    footings = checked_sequence("footings", footings)
    if not tables or len(footings) not in (0, len(tables)):
        raise ValueError(
            "expected at least one table, and a name for each of them or none, got "
            f"{len(tables)} and {len(footings)}"
        )
    rows = [row for cases in tables for row in cases.table()]
    if footings:
        names = [name for name, cases in zip(footings, tables, strict=True) for _ in cases.names]
        rows = [{"footing": name, **row} for name, row in zip(names, rows, strict=True)]
    write_rows(path, rows)


def write_rows(path: PathLike, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows by the names of their columns to a CSV file, whole or not at all."""
    if Path(checked_path(path)).suffix.lower() in OTHERS:
        raise ValueError(f"expected a file name ending in .csv, got {shown(path)}")
    columns = dict.fromkeys(name for row in rows for name in row)  # some have more

    def write(part: str) -> None:
        with Path(part).open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, columns, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    write_whole(path, write)


def _require_heads(heads: list[str], where: str, known: tuple[str, ...]) -> None:
    for head in heads:
        if head not in known:
            of_plates = ", for plates only" if head in PARTS else ""
            raise ValueError(
                f"{where}: expected headings among {', '.join(known)}, got "
                f"{one_line(repr(head), 40)}{of_plates}"
            )
        if heads.count(head) > 1:
            raise ValueError(f"{where}: expected each heading once, got {head} twice")
    loads = () if "q" in heads else ("force",)
    for needed in ("name", *loads):
        if needed not in heads:
            raise ValueError(f"{where}: expected a heading {needed}, got {', '.join(heads)}")
    for pair in (("x", "y"), ("ex", "ey"), ("mx", "my"), ("hx", "hy"), ("bx", "by")):
        if len(set(pair) & set(heads)) == 1:
            raise ValueError(f"{where}: expected both {' and '.join(pair)}, got one of them")
    if {"x", "ex"} <= set(heads):
        raise ValueError(f"{where}: expected either x, y or ex, ey, got both")


def _case(factors: dict[str, float], cells: list[str], where: str) -> CaseRow:
    found = dict(zip(factors, cells, strict=True))
    if not found["name"]:
        raise ValueError(f"{where}: expected a name, got none")

    def number(name: str) -> float:
        if not found[name]:
            raise ValueError(
                f"{where}: expected a number for {name}, got none. Remedy: 0 where there is none"
            )
        return factors[name] * cell_number(found[name], name, where, SMALLEST, LARGEST)

    def pair(a: str, b: str) -> Pair | None:
        return (number(a), number(b)) if a in found else None

    return CaseRow(
        where,
        found["name"],
        found.get("footing", ""),
        number("force") if "force" in found else 0.0,
        pair("x", "y"),
        pair("ex", "ey"),
        pair("mx", "my") or (0.0, 0.0),
        pair("hx", "hy"),
        number("torsion") if "torsion" in found else None,
        pair("bx", "by") or (0.0, 0.0),
        number("q") if "q" in found else 0.0,
    )
