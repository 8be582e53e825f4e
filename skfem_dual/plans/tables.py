"""Corners of outlines as lines of text."""

import re
from pathlib import Path

from ..errors import MeshError
from ..io.guarded import text_of
from ..io.tables import (
    COORDINATES,
    SEPARATOR,
    Heading,
    cells_of,
    delimiter_of,
    make_numbers,
    parted_heads,
    written_number,
)
from ..messages import one_line

#: x, y and the bulge of the side that starts there
Corner = tuple[float, float, float]
#: how corners are written in a file, and in a text
IN_FILE = (
    "one corner a line, with a header that names x and y of more columns, and an empty line "
    "between rings"
)
IN_TEXT = "commas inside corners and blanks between them alone, such as 0,0 12,0 12,8"
#: where it is, and its cells
Row = tuple[str, list[str]]

#: numbers of a corner: x, y and, if wanted, the bulge of the side that starts there
COLUMNS = 2, 3
#: marks beside which commas are decimal, and what empty lines consist of
MARKS, EMPTY = ";\t", ",; \t"
#: names of columns in a header, in any case; others are left out
NAMES = COORDINATES | {"bulge": 2}
#: what stands in a cell for nothing
DASHES = "-", "–"


def rings_of_table(text: str, path: object) -> list[list[Corner]]:
    """Rings of corners, one a line; an empty line begins another ring.

    Raises
    ------
    MeshError
        If there are none, or a line is not one of numbers; it tells which.
    """
    lines = _lines(text)
    filled = [line for _, line in lines if line.strip(EMPTY)]
    if not filled:
        raise MeshError(f"expected corners in {path}, got an empty file")
    delimiter = _delimiter(filled[0])
    heads = parted_heads(filled[0], delimiter)
    columns = _columns(heads)
    if len(units := _units(heads, columns)) > 1:
        raise MeshError(
            f"expected x and y in one unit in the header of {path}, got {' and '.join(units)}. "
            "Remedy: change one of them"
        )
    header = filled[0] if columns else None
    rings: list[list[Row]] = [[]]
    for number, line in lines:
        if line == header:
            header = None
        elif not line.strip(EMPTY):
            rings.append([])
        else:
            fields, where = _fields(line, delimiter), f"{path}, line {number}"
            if columns:
                fields = _under_heads(fields, heads, columns, where)
            rings[-1].append((where, fields))
    if delimiter in MARKS:
        try:
            make_numbers([row for ring in rings for row in ring], range(COLUMNS[-1]), delimiter)
        except ValueError as error:
            raise MeshError(str(error)) from error
    return [[_corner(fields, where, IN_FILE) for where, fields in ring] for ring in rings if ring]


def unit_of_table(path: Path) -> str | None:
    """Unit of the coordinates by the header of a table of corners, if it has one."""
    first = next((line for _, line in _lines(text_of(path)) if line.strip(EMPTY)), "")
    fields = parted_heads(first, _delimiter(first))
    return next(iter(_units(fields, _columns(fields))), None)


def corners_of_text(text: str) -> list[Corner]:
    """Corners of one ring: ``"0,0 12,0 12,8"``, triples with bulges.

    Raises
    ------
    MeshError
        If there are no items, or one is not two or three numbers.

    Examples
    --------
    >>> corners_of_text("0,0 2,0,1 2,2 0,2")
    [(0.0, 0.0, 0.0), (2.0, 0.0, 1.0), (2.0, 2.0, 0.0), (0.0, 2.0, 0.0)]
    """
    items = [cells_of(item, ",") for item in text.split()]
    if not items:
        raise MeshError(f"expected corners, got none. Remedy: {IN_TEXT}")
    return [_corner(item, f"the corners, number {i}", IN_TEXT) for i, item in enumerate(items, 1)]


def _lines(text: str) -> list[tuple[int, str]]:
    """Numbers of lines and what they say, without remarks and what Excel is told first."""
    numbered = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    if numbered and SEPARATOR.match(numbered[0][1]):
        numbered = numbered[1:]
    return [(i, line) for i, line in numbered if not line.startswith("#")]


def _delimiter(line: str) -> str:
    """What parts the columns: a mark, or blanks."""
    mark = delimiter_of(line)
    return mark if mark in line else " "


def _fields(line: str, delimiter: str) -> list[str]:
    """The columns of a line."""
    return line.split() if delimiter == " " else cells_of(line, delimiter)


def _columns(fields: list[str]) -> list[int]:
    """Places of x, y and bulge by a header; none if the line is no header."""
    words = [re.sub(r"[\s\[(].*", "", Heading.of(field).name) for field in fields]
    found = {NAMES[word]: i for i, word in reversed(list(enumerate(words))) if word in NAMES}
    return [found[k] for k in sorted(found)] if {0, 1} <= set(found) else []


def _under_heads(fields: list[str], heads: list[str], columns: list[int], where: str) -> list[str]:
    """x, y and bulge of a line, which may end before an empty bulge.

    Raises
    ------
    MeshError
        If it has not as many cells as the header: some would stand under others' headings.
    """
    filled = len(fields)
    while filled > len(heads) and not fields[filled - 1]:
        filled -= 1
    bulge = len(heads) - 1 if len(columns) == 3 else None
    beside = filled > len(heads) > max(columns) + 1  # more words of what is left out
    if filled != len(heads) and not beside and not (filled == bulge == columns[-1]):
        remedy = "as many, with empty ones or a dash where there is nothing"
        if filled == 3 and len(heads) == 2:
            remedy = "the heading bulge, if the third number is that of the side that starts there"
        raise MeshError(
            f"expected as many cells as headings, {len(heads)}, in {where}, got "
            f"{filled}: {one_line(str(fields), 60)}. Remedy: {remedy}"
        )
    return [fields[i] for i in columns if i < filled]


def _units(heads: list[str], columns: list[int]) -> list[str]:
    """The units that x and y have in a header, each once."""
    units = (Heading.of(heads[i]).unit for i in columns[: COLUMNS[0]])
    return list(dict.fromkeys(unit for unit in units if unit))


def _corner(fields: list[str], where: str, remedy: str) -> Corner:
    shown = one_line(repr(",".join(fields)), 60)
    while len(fields) > COLUMNS[0] and (not fields[-1] or fields[-1] in DASHES):
        fields = fields[:-1]
    try:
        values = tuple(map(written_number, fields))
    except ValueError:
        values = ()
    if len(values) not in COLUMNS:
        raise MeshError(f"{where}: expected x, y or x, y, bulge, got {shown}. Remedy: {remedy}")
    return values[0], values[1], values[2] if len(values) == 3 else 0.0
