"""Load cases from CSV files, and their answers into them."""

import csv
from typing import TYPE_CHECKING

from .writing import PathLike, write_whole

if TYPE_CHECKING:
    from ..contact.cases_solution import CasesSolution


def write_cases(path: PathLike, cases: "CasesSolution") -> None:
    """Write the table of cases to a CSV file, whole or not at all."""
    rows = cases.table()

    def write(part: str) -> None:
        with open(part, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)

    write_whole(path, write)
