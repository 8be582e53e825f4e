"""Tables and small pictures of objects for notebooks."""

from __future__ import annotations

import io
from base64 import b64encode
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ConvergenceError
from ..grids.dual_mesh import DualMesh
from ..grids.report import Report
from ..solutions.cases_solution import CasesSolution
from ..solutions.group_solution import PunchesSolution, how_moved
from ..solutions.pressures import CellPressures
from .axes import pyplot
from .matplotlib import draw, isobars
from .style import OUTLINE, PRIMAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: inches and points per inch of a picture, and up to so many cells there is one
SIZE, RESOLUTION, CELLS = (4.6, 3.6), 90, 20_000
#: cases that are listed
ROWS = 12


def solution_html(solution: CellPressures) -> str:
    """The rows of a solution and its isobars."""

    def drawn(ax: Axes) -> None:
        isobars(solution, ax=ax)

    return _page(type(solution).__name__, solution.table().items(), drawn, len(solution.pressure))


def group_html(group: PunchesSolution) -> str:
    """A row for each punch, and the isobars under all."""

    def drawn(ax: Axes) -> None:
        isobars(group.solutions, ax=ax)

    heads = "", "force", "settlement, tilt", "contact area"
    rows = [
        (name, f"{s.force:.6g}", how_moved(s), f"{s.contact_area:.6g}")
        for name, s in zip(group.punches.names, group.solutions, strict=True)
    ]
    cells = sum(len(s.pressure) for s in group.solutions)
    return _page(type(group).__name__, [heads, *rows], drawn, cells)


def cases_html(cases: CasesSolution) -> str:
    """A row for each of the first cases, and the isobars of that with the largest pressure of
    those with success."""

    def drawn(ax: Axes) -> None:
        largest = np.where(cases.success, cases.largest_pressure, -np.inf)
        isobars(cases[int(np.argmax(largest))], ax=ax)

    table = cases.table()
    rows = [[_told(value) for value in row.values()] for row in table[:ROWS]]
    if len(table) > ROWS:
        rows.append([f"{len(table) - ROWS} more"])
    found = drawn if cases.success.any() else None
    return _page(type(cases).__name__, [list(table[0]), *rows], found, len(cases.footprint))


def _told(value: str | float | bool) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def mesh_html(dual: DualMesh) -> str:
    """The census of a dual grid and both grids."""

    def drawn(ax: Axes) -> None:
        draw(dual, legend=False, ax=ax)

    rows = (line.strip().split(": ", 1) for line in repr(dual).splitlines()[1:])
    return _page("DualMesh", ((name, value) for name, value in rows), drawn, len(dual))


def report_html(report: Report) -> str:
    """What a check found, and how its measures are distributed."""

    def drawn(ax: Axes) -> None:
        ax.set_axis_off()
        n = len(report.measures)
        for i, measure in enumerate(report.measures):
            below = ax.inset_axes((0.0, 1 - (i + 0.6) / n, 1.0, 0.5 / n))
            below.hist(measure.values, bins=30, color=PRIMAL)
            below.axvline(measure.values[measure.worst], color=OUTLINE, linewidth=0.8)
            below.set_yticks([])
            below.spines[["top", "right", "left"]].set_visible(False)
            below.set_title(measure.name, fontsize=8)
            below.tick_params(labelsize=7)

    rows = [
        ("ok" if c.ok else "FAIL" if c.required else "no", c.expected if c.ok else c.message())
        for c in report.conditions
    ]
    rows += [(m.name, f"{m.values[m.worst]:.3g} at {m.entity} {m.worst}") for m in report.measures]
    return _page(type(report).__name__, rows, drawn if report.measures else None, 0)


def _page(
    name: str, rows: Iterable[Sequence[str]], drawn: Callable[[Axes], None] | None, cells: int
) -> str:
    """A heading, a table and what is drawn into axes, or a note why it is not."""
    cell = '<td style="text-align:left">{}</td>'
    lines = "".join(
        f"<tr>{''.join(cell.format(escape(text)) for text in row)}</tr>" for row in rows
    )
    picture = ""
    if drawn and cells > CELLS:
        picture = f"<p>No picture beyond {CELLS} cells: plot() draws it.</p>"
    elif drawn:
        try:
            picture = _image(name, drawn)
        except (ImportError, ValueError, ConvergenceError) as error:  # nothing to draw, or with
            picture = f"<p>No picture: {escape(str(error))}.</p>"
    return f"<div><b>{escape(name)}</b><table>{lines}</table>{picture}</div>"


def _image(name: str, drawn: Callable[[Axes], None]) -> str:
    """A picture inside HTML; no window shows it."""
    pyplot()
    from matplotlib.figure import Figure

    figure, buffer = Figure(figsize=SIZE, layout="compressed"), io.BytesIO()
    drawn(figure.add_subplot())
    figure.savefig(buffer, format="png", dpi=RESOLUTION)
    data = b64encode(buffer.getvalue()).decode()
    return f'<img alt="{escape(name)}" src="data:image/png;base64,{data}"/>'
