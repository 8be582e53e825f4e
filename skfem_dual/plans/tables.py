"""Corners of outlines as lines of text."""

import re
from pathlib import Path

from ..errors import MeshError
from ..io.guarded import shortened
from ..io.tables import Heading

#: x, y and the bulge of the side that starts there
Corner = tuple[float, float, float]

#: numbers of a corner: x, y and, if wanted, the bulge of the side that starts there
COLUMNS = 2, 3
#: names of columns in a header, in any case; others are left out
NAMES = {
    **dict.fromkeys(("x", "easting", "rechtswert"), 0),
    **dict.fromkeys(("y", "northing", "hochwert"), 1),
    "bulge": 2,
}


def rings_of_table(text: str, path: object) -> list[list[Corner]]:
    """Rings of corners, one a line; an empty line begins another ring.

    Raises
    ------
    MeshError
        If there are none, or a line is not one of numbers; it tells which.
    """
    lines = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    lines = [(i, line) for i, line in lines if not line.startswith("#")]
    filled = [line for _, line in lines if line]
    if not filled:
        raise MeshError(f"expected corners in {path}, got an empty file")
    decimal_comma = ";" in filled[0]
    columns = _columns(_fields(filled[0]))
    header = filled[0] if columns else None
    rings: list[list[Corner]] = [[]]
    for number, line in lines:
        if line == header:
            header = None
        elif not line.strip(",; \t"):
            rings.append([])
        else:
            fields = _fields(line)
            if columns and len(fields) > max(columns):
                fields = [fields[i] for i in columns]
            rings[-1].append(_corner(fields, decimal_comma, line, number, path))
    return [ring for ring in rings if ring]


def unit_of_table(path: Path) -> str | None:
    """Unit of the first coordinate by the header of a table of corners, if it has one."""
    lines = (line.strip() for line in path.read_text(encoding="utf-8-sig").splitlines())
    fields = _fields(next((line for line in lines if line and not line.startswith("#")), ""))
    columns = _columns(fields)
    return (Heading.of(fields[columns[0]]).unit or None) if columns else None


def corners_of_text(text: str) -> list[Corner]:
    """Corners of one ring: ``"0,0 12,0 12,8"``, triples with bulges.

    Raises
    ------
    MeshError
        If an item is not two or three numbers.

    Examples
    --------
    >>> corners_of_text("0,0 2,0,1 2,2 0,2")
    [(0.0, 0.0, 0.0), (2.0, 0.0, 1.0), (2.0, 2.0, 0.0), (0.0, 2.0, 0.0)]
    """
    items = text.split()
    return [
        _corner(item.split(","), False, item, i, "the corners") for i, item in enumerate(items, 1)
    ]


def _fields(line: str) -> list[str]:
    """The columns of a line."""
    for separator in (";", "\t", ","):
        if separator in line:
            return [field.strip().strip('"') for field in line.split(separator)]
    return line.split()


def _columns(fields: list[str]) -> list[int]:
    """Places of x, y and bulge by a header; none if the line is no header."""
    words = [re.sub(r"[\s\[(].*", "", field.lower()) for field in fields]
    found = {NAMES[word]: i for i, word in reversed(list(enumerate(words))) if word in NAMES}
    return [found[k] for k in sorted(found)] if {0, 1} <= set(found) else []


def _corner(
    fields: list[str], decimal_comma: bool, line: str, number: int, path: object
) -> Corner:
    while len(fields) > COLUMNS[0] and not fields[-1]:
        fields = fields[:-1]
    try:
        values: tuple[float, ...] = tuple(
            float(f.replace(",", ".") if decimal_comma else f) for f in fields
        )
    except ValueError:
        values = ()
    if len(values) not in COLUMNS:
        raise MeshError(
            f"expected x, y or x, y, bulge, got {shortened(line, 60)!r} in line {number} of "
            f"{path}. Remedy: one corner a line, with a header that names x and y if there are "
            "more columns, and an empty line between rings"
        )
    return values[0], values[1], values[2] if len(values) == 3 else 0.0
