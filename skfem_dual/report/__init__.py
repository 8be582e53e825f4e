"""A report of a solution for engineers: one HTML page that needs nothing else."""

import os
from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..arguments import checked_flag, checked_instance, checked_sequence, checked_text
from ..contact.elastic_solution import ElasticSolution
from ..contact.punch import RigidPunch
from ..contact.solution import PunchSolution
from ..grids.cellwise import CellwiseBasis
from ..io import write_whole
from ..io.writing import PathLike
from .checks import error_section, resultant_section, solver_section, warnings_of
from .input import input_section
from .numbers import Standing
from .page import Html, joined, page
from .results import in_short, position_section, pressure_section, standing_section
from .structure import structure_sections

TITLE = "Rigid punch on elastic ground"
STRUCTURE = "Structure on elastic ground"


def write_report(
    path: PathLike, solution: PunchSolution | ElasticSolution, **options: Any
) -> None:
    """Write `report_html` to a file ending in ``.html``, whole or not at all.

    Parameters
    ----------
    path : path
        The file.
    solution : PunchSolution or ElasticSolution
        What to report.
    options
        As for `report_html`.

    Raises
    ------
    ValueError
        If the suffix is another, or as `report_html`.
    TypeError, ImportError
        As `report_html`.
    """
    checked_instance("path", path, (str, os.PathLike))
    if Path(path).suffix != ".html":
        raise ValueError(f"expected a file name ending in .html, got {path}")
    text = report_html(solution, **options)
    write_whole(path, lambda part: Path(part).write_text(text, encoding="utf-8"))


def report_html(
    solution: PunchSolution | ElasticSolution,
    *,
    title: str | None = None,
    mesh_name: str | None = None,
    couple: PunchSolution | None = None,
    remarks: Sequence[str] = (),
    date: datetime | None = None,
) -> str:
    """A page with input, results and checks of a solution.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        What to report, on any grid.
    title : str, optional
        Heading of the page.
    mesh_name : str, optional
        Where the mesh is from, such as the name of its file.
    couple : PunchSolution, optional
        Of a rigid punch the same problem on the other grid of the `DualMesh`, from which the
        error is estimated; `solve_on_other_grid` finds it.
    remarks : sequence of str
        Warnings to show on top, such as those of reading the mesh.
    date : datetime, optional
        Now by default.

    Returns
    -------
    str
        HTML without scripts, with its pictures inside; every number is in the attribute ``value``
        of its element ``data`` with all digits.

    Raises
    ------
    TypeError
        If a solution is something else, or ``couple`` is given but not one on dual cells and
        the other on triangles of one `DualMesh`; or with an ElasticSolution.
    ValueError
        If ``couple`` has another mesh, origin, load or ground.
    ImportError
        If matplotlib is missing.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> solution = RigidPunch(HalfSpace(30e6, 0.25), dual.basis()).solve(1.2e6, (0.1, 0.05))
    >>> text = report_html(solution, title="Pier 3", couple=solve_on_other_grid(solution))
    >>> "<h1>Pier 3</h1>" in text
    True
    """
    checked_instance("solution", solution, (PunchSolution, ElasticSolution))
    for name, text in (("title", title), ("mesh_name", mesh_name)):
        if text is not None:
            checked_text(name, text)
    remarks = [checked_text("remarks", remark) for remark in checked_sequence("remarks", remarks)]
    if date is not None:
        checked_instance("date", date, datetime)
    date = datetime.now().astimezone() if date is None else date
    mesh_name = "mesh in memory" if mesh_name is None else mesh_name
    if isinstance(solution, ElasticSolution):
        if couple is not None:
            raise TypeError("expected no couple of an ElasticSolution, got one")
        parts = structure_sections(solution, mesh_name, remarks, __version__)
    else:
        parts = _punch_sections(solution, couple, mesh_name, remarks)
    if title is None:
        title = STRUCTURE if isinstance(solution, ElasticSolution) else TITLE
    failed = "" if solution.success else "NOT CONVERGED: "
    subtitle = f"{date:%Y-%m-%d %H:%M} · {mesh_name} · skfem_dual {__version__}"
    return page(failed + title, subtitle, joined(parts))


def _punch_sections(
    solution: PunchSolution,
    couple: PunchSolution | None,
    mesh_name: str,
    remarks: Sequence[str],
) -> list[Html]:
    if couple is not None:
        _check_same_problem(solution, couple)
    standing = Standing(solution)
    return [
        warnings_of(solution, standing, couple, remarks),
        in_short(solution, standing),
        input_section(solution, standing, mesh_name),
        position_section(solution, standing),
        pressure_section(solution, standing),
        standing_section(solution, standing),
        resultant_section(solution, standing),
        error_section(solution, standing, couple),
        solver_section(solution, couple, __version__),
    ]


def _check_same_problem(solution: PunchSolution, couple: PunchSolution) -> None:
    checked_instance("couple", couple, PunchSolution)
    if couple.load != solution.load:
        raise ValueError(f"expected a couple under {solution.load}, got one under {couple.load}")
    ground, other = solution.punch.substrate, couple.punch.substrate
    if ground != other and repr(ground) != repr(other):
        raise ValueError(f"expected a couple on {ground}, got one on {other}")


def solve_on_other_grid(
    solution: PunchSolution, *, unilateral: bool | None = None, progress: bool = False
) -> PunchSolution:
    """The same problem on the triangles instead of the dual cells, or the reverse.

    Under a flat punch dual cells with constant pressures are collocated in their nodes, so that
    the solutions enclose the exact settlement, see `estimate_error`.

    Parameters
    ----------
    solution : PunchSolution
        On ``dual.basis()`` or ``dual.primal_basis()``.
    unilateral : bool, optional
        As for `RigidPunch.solve`; by default unless the ground pulls in ``solution``.
    progress : bool
        Whether iterations show progress bars.

    Raises
    ------
    TypeError
        If ``solution`` is something else, or not on a grid of a `DualMesh`.
    ValueError
        If its punch has the gaps of its cells for a shape, or neighbours; or as
        `RigidPunch.solve`.
    ConvergenceError
        As `RigidPunch.solve`.
    """
    checked_instance("solution", solution, PunchSolution)
    progress = checked_flag("progress", progress)
    punch, basis = solution.punch, solution.punch.basis
    if not isinstance(basis, CellwiseBasis):
        raise TypeError(
            "expected a solution on dual.basis() or dual.primal_basis() of a DualMesh, got one "
            f"on {punch.grid_description}"
        )
    if solution.others:
        raise ValueError("expected a single punch, got one with neighbours on the same ground")
    if isinstance(punch.gap, (np.ndarray, list)):
        raise ValueError("expected the shape as a function or field, got gaps of one grid's cells")
    to_dual = basis.grid == "primal"
    enclosing = punch.edge == "constant" and punch.gap is None
    other = RigidPunch(
        punch.substrate,
        basis.dual.basis() if to_dual else basis.dual.primal_basis(),
        edge=punch.edge,
        edge_boundaries=punch.edge_boundaries,
        collocation="node" if to_dual and enclosing else "centroid",
        origin=punch.origin,
        gap=punch.gap,
        rtol=punch.rtol,
        symmetry=None if punch.symmetry is None else "auto",
    )
    if unilateral is None:
        unilateral = bool((solution.pressure >= 0).all())
    unilateral = checked_flag("unilateral", unilateral)
    found_before = unilateral and solution.iterations > 0 and solution.success
    return other.solve(
        **asdict(solution.load),
        unilateral=unilateral,
        start=solution if found_before else None,
        progress=progress,
    )
