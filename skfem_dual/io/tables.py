"""Tables in CSV files."""

import csv
import re
from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ..messages import one_line
from ..units import Units
from .guarded import require_file, text_of
from .writing import PathLike

#: rows of a table
MANY = 100_000
#: thousands with blanks or apostrophes between them
GROUPED = re.compile(r"(?<![\d.,])[1-9]\d{0,2}(?:[ \u00a0\u2009\u202f'\u2019]\d{3})+(?!\d)")
#: may be a number with a decimal mark, or thousands
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}([.,]\d{3})+")
#: thousands parted by one mark beside a decimal one, which tells what the others are
PARTED = {
    mark: re.compile(rf"([+-]?[1-9]\d{{0,2}}(?:[{mark}]\d{{3}})+)([{decimal}]\d*)?")
    for mark, decimal in (".,", ",.")
}
#: what empty lines consist of
EMPTY = " ;,\t\r\n"
#: a first line that tells Excel what parts the columns
SEPARATOR = re.compile(r"sep=([^\w\s\"]|\t)\s*$", re.IGNORECASE)
#: quoted cells, such that go on, and lines of headings at most; inches have quotes inside
QUOTED, OPENED = re.compile(r'(^|[;,\t]) *"[^"]*"'), re.compile(r'(^|[;,\t]) *"')
HEADING_LINES = 20
#: the unit of a column: E [MPa], E (MPa), E / MPa, E in MPa
HEADING = re.compile(r"(.*?)\s*(?:[\[(]([^\[\]()]*)[\])]|/\s*(\S+)|\sin\s+(\S+))?\s*")


#: names of columns of coordinates, in lower case
COORDINATES = {
    **dict.fromkeys(("x", "easting", "rechtswert"), 0),
    **dict.fromkeys(("y", "northing", "hochwert"), 1),
}


class Heading(NamedTuple):
    """Name of a column in lower case, and its unit, if it has one."""

    name: str
    unit: str

    @classmethod
    def of(cls, text: str) -> "Heading":
        """As it is written, ``Force [kN]``.

        >>> Heading.of("Force [kN]"), Heading.of("E in MN/m²")
        (Heading(name='force', unit='kN'), Heading(name='e', unit='MN/m²'))
        """
        found = HEADING.fullmatch(text)
        name, *units = found.groups() if found else (text,)
        unit = next((unit.strip() for unit in units if unit), "")
        name = name.replace("\N{RIGHT SINGLE QUOTATION MARK}", "'")
        return cls(" ".join(name.lower().split()), "" if unit in ("-", "–", "1") else unit)


def parted_heads(line: str, delimiter: str | None) -> list[str]:
    """The headings of a line, parted by a mark or by blanks: units after blanks belong to those
    before, and empty ones at the end are none."""
    if delimiter in (None, " "):
        line, delimiter = re.sub(r"\s+(?=[\[(])", "", line), None
    heads = line.split() if delimiter is None else cells_of(line, delimiter)
    while heads and not heads[-1]:
        heads.pop()
    return heads


def read_table(
    path: PathLike, texts: Collection[str] = ()
) -> tuple[str, list[Heading], list[tuple[str, list[str]]]]:
    """Headings of a CSV file and where they are, ``path, line n``; cells of each row and where.

    Commas, semicolons or tabs part the columns, whichever the headings have. With semicolons and
    tabs decimal commas are read, too. Cells come with decimal points and without blanks between
    thousands, but for columns ``texts``. Empty lines and those that begin with ``#`` do not count,
    nor do empty columns on the right; a first line ``sep=;`` tells what parts the columns.

    Raises
    ------
    FileNotFoundError, TypeError
        If there is no such file, or it is no path.
    ValueError
        If it is no text, has no row below the headings or far too many, a row has more or fewer
        cells than the headings, or it cannot be told which marks are decimal.
    """
    path = require_file(path, "a CSV file")
    delimiter, numbered = _records(path)
    if not 2 <= len(numbered) <= MANY + 1:
        raise ValueError(
            f"expected a line of headings and 1 to {MANY} lines below in {path}, got "
            f"{len(numbered)} lines"
        )
    rows = []
    columns = max(i for i, head in enumerate(numbered[0][1], 1) if head)
    for number, cells in numbered:
        where = f"{path}, line {number}"
        while len(cells) > columns and not cells[-1]:  # empty columns of a sheet
            cells.pop()
        rows.append((where, cells))
        if len(cells) != columns:
            raise ValueError(
                f"{where}: expected {columns} columns, got {len(cells)}. Remedy: as many marks "
                "between them in each line, beside empty cells too"
            )
    (where, heads), *below = rows
    headings = [Heading.of(head) for head in heads]
    make_numbers(
        below, [i for i, head in enumerate(headings) if head.name not in texts], delimiter
    )
    return where, headings, below


def _records(path: Path) -> tuple[str, list[tuple[int, list[str]]]]:
    """What parts the columns; cells of lines that are not empty, and the numbers of these.

    Quoted cells may go on in the next lines, whatever these begin with.
    """
    lines = text_of(path).splitlines(keepends=True)
    found: list[tuple[int, list[str]]] = []
    delimiter, at = "", 0
    while at < len(lines):
        begin, line = at, lines[at]
        if line.lstrip().startswith("#") or not line.strip(EMPTY):
            at += 1
            continue
        if not delimiter and (told := SEPARATOR.match(line)):
            delimiter, at = told[1], at + 1
            continue
        delimiter = delimiter or delimiter_of(_heading(lines[at:]))
        read = partial(csv.reader, delimiter=delimiter, skipinitialspace=True)
        reader = read((lines[k] for k in range(begin, len(lines))), strict=True)
        try:
            cells = next(reader)
            at += reader.line_num
        except csv.Error as error:
            if line.count('"') % 2 or len(line) > csv.field_size_limit():
                raise ValueError(
                    f"{path}, line {begin + 1}: expected a quoted cell that ends before the next "
                    f"column, got {one_line(line, 40)!r}. Remedy: a quote at its end, or none"
                ) from error
            cells, at = next(read([line])), at + 1  # such as blanks behind a quote
        found.append((begin + 1, [" ".join(cell.splitlines()).strip() for cell in cells]))
    return delimiter, [(number, cells) for number, cells in found if any(cells)]


def _heading(lines: list[str]) -> str:
    """The first line, without quoted cells, which may go on in the next ones."""
    text = ""
    for line in lines[:HEADING_LINES]:
        text += line
        if not OPENED.search(rest := QUOTED.sub(r"\1", text)):
            return rest
    return lines[0]


def delimiter_of(line: str) -> str:
    """What parts the columns, by their first line: semicolons or tabs before commas."""
    return next((mark for mark in ";\t" if mark in line), ",")


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without blanks around."""
    (cells,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
    return [cell.strip() for cell in cells]


def make_numbers(
    rows: Sequence[tuple[str, list[str]]], columns: Sequence[int], delimiter: str
) -> None:
    """Turn cells of rows, each with where it is, into what `float` reads, in place.

    Nothing remains between thousands; with delimiters other than commas decimal commas are points.
    There 1.000 may be either, unless another number shows what points are: 0.5, or 1.000,5, or
    1.000.000.
    Rows may be shorter than others.

    Raises
    ------
    ValueError
        If it cannot be told which marks are decimal.
    """
    for _, cells in rows:
        for i in columns:
            if i < len(cells):
                joined = GROUPED.sub(lambda number: re.sub(r"\D", "", number[0]), cells[i])
                cells[i] = joined.replace("\N{MINUS SIGN}", "-")
    if delimiter != ",":
        _make_points(rows, columns)


def _make_points(rows: Sequence[tuple[str, list[str]]], columns: Sequence[int]) -> None:
    """Turn decimal commas of cells into points; refuse what may be either."""
    places = [(where, cells, i) for where, cells in rows for i in columns if i < len(cells)]
    for mark, parted in PARTED.items():
        matches = [(cells, i, parted.fullmatch(cells[i])) for _, cells, i in places]
        if any(match and (match[2] or match[1].count(mark) > 1) for *_, match in matches):
            for cells, i, match in matches:
                if match:
                    cells[i] = cells[i].replace(mark, "")
    found = [(where, cells[i]) for where, cells, i in places]
    commas = [item for item in found if "," in item[1]]
    points = [item for item in found if re.fullmatch(r"[-+]?[\d.,]*\.[\d.,eE+-]*", item[1])]
    remedy = "Remedy: one decimal mark in all of the table, nothing between thousands"
    if points and commas:
        (where, other), (_, cell) = points[0], commas[0]
        raise ValueError(
            f"{where}: expected decimal commas or decimal points, got {one_line(other, 40)!r} "
            f"beside {one_line(cell, 40)!r}. {remedy}"
        )
    marked = commas or points
    if marked and all(THOUSANDS.fullmatch(cell) for _, cell in marked):
        (where, cell), mark = marked[0], "comma" if commas else "point"
        raise ValueError(
            f"{where}: expected a number, got {one_line(cell, 40)!r}, whose {mark} may be decimal "
            f"or part thousands. {remedy}, such as {re.sub('[.,]', '', cell)} or {cell}0"
        )
    for _, cells, i in places:
        cells[i] = cells[i].replace(",", ".")


def unit_factor(heading: Heading, quantity: str, units: Units, where: str) -> float:
    """What numbers below a heading are multiplied by to be in units; one without a unit.

    Raises
    ------
    ValueError
        If the heading has a unit of something else, or there are no units to change it to.
    """
    if not heading.unit:
        return 1.0
    shown = one_line(f"{heading.name} in {heading.unit}", 60)
    if not quantity:
        raise ValueError(f"{where}: expected a heading without a unit, got {shown}")
    if not units.named:
        raise ValueError(
            f"{where}: expected units to which those of the headings are changed, got none and "
            f'{shown}. Remedy: units="kN,m", on the command line --units kN,m; or headings '
            "without units"
        )
    try:
        return units.factor(heading.unit, quantity)
    except ValueError as error:
        raise ValueError(f"{where}, heading {heading.name}: {error}") from None


def written_number(text: str) -> float:
    """What `float` reads of a number as tables write it, in figures 0 to 9.

    Raises
    ------
    ValueError
        If it is none.
    """
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return float(text)


def cell_number(text: str, name: str, where: str, least: float, most: float) -> float:
    """The number in a cell, zero or in a range of sizes."""
    shown = one_line(repr(text), 40)
    try:
        value = written_number(text)
    except ValueError:
        remedy = ". Remedy: a decimal point" if "," in text else ""
        raise ValueError(f"{where}: expected a number for {name}, got {shown}{remedy}") from None
    if not (value == 0 or least <= abs(value) <= most):
        raise ValueError(
            f"{where}: expected a finite number for {name}, 0 or from {least:g} to {most:g} in "
            f"size, got {shown}"
        )
    return value
