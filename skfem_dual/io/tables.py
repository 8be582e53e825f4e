"""Tables in CSV files."""

import csv

from .guarded import require_file, shortened
from .writing import PathLike

#: rows of a table
MANY = 100_000


def read_table(path: PathLike) -> list[tuple[str, list[str]]]:
    """Cells of each row of a CSV file, and where it is, ``path, line n``; headings first.

    Commas, semicolons or tabs part the columns, whichever the headings have. Empty lines and those
    that begin with ``#`` do not count.

    Raises
    ------
    FileNotFoundError, TypeError
        If there is no such file, or the path is none.
    ValueError
        If it is no text, has no row below the headings or far too many, or a row has more or
        fewer cells than the headings.
    """
    path = require_file(path, "a CSV file")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"expected text in UTF-8 in {path}: {error}") from error
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip(" ;,\t") and not line.lstrip().startswith("#")
    ]
    if not 2 <= len(numbered) <= MANY + 1:
        raise ValueError(
            f"expected a line of headings and 1 to {MANY} lines below in {path}, got "
            f"{len(numbered)} lines"
        )
    heads = numbered[0][1]
    delimiter = next((mark for mark in ";\t" if mark in heads), ",")
    count = len(next(csv.reader([heads], delimiter=delimiter)))
    rows = []
    for number, line in numbered:
        (cells,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
        where = f"{path}, line {number}"
        if len(cells) != count:
            raise ValueError(f"{where}: expected {count} columns, got {len(cells)}")
        rows.append((where, [cell.strip() for cell in cells]))
    return rows


def cell_number(text: str, name: str, where: str, least: float, most: float) -> float:
    """The number in a cell, zero or in a range of sizes."""
    shown = shortened(repr(text), 40)
    try:
        value = float(text)
    except ValueError:
        remedy = ". Remedy: a decimal point" if "," in text else ""
        raise ValueError(f"{where}: expected a number for {name}, got {shown}{remedy}") from None
    if not (value == 0 or least <= abs(value) <= most):
        raise ValueError(
            f"{where}: expected a finite number for {name}, 0 or from {least:g} to {most:g} in "
            f"size, got {shown}"
        )
    return value
