"""A report of a solution for engineers: one page that needs nothing else, as HTML or PDF."""

import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..arguments import checked_flag, checked_instance
from ..contact.cases_solution import CasesSolution
from ..contact.elastic_solution import ElasticSolution
from ..contact.punch import RigidPunch
from ..contact.solution import PunchSolution
from ..grids.cellwise import CellwiseBasis
from ..io import write_whole
from ..io.writing import PathLike
from .bearing import bearing_section, points_section
from .cases import cases_sections
from .checks import error_section, resultant_section, solver_section, warnings_of
from .depth import depth_section
from .details import Details
from .footing import Footing, footings_of
from .input import input_section
from .numbers import Standing
from .page import NONE, Html, joined, page
from .pdf import require_pdf, write_pdf
from .results import in_short, position_section, pressure_section, standing_section
from .structure import structure_sections

TITLE = "Rigid punch on elastic ground"
STRUCTURE = "Structure on elastic ground"
SUFFIXES = (".html", ".pdf")

Reported = PunchSolution | ElasticSolution | CasesSolution | Mapping[str, CasesSolution]


def write_report(path: PathLike, solution: Reported, **options: Any) -> None:
    """Write `report_html` to a file ending in ``.html`` or ``.pdf``, whole or not at all.

    Parameters
    ----------
    path : path
        The file. A PDF takes WeasyPrint, ``pip install 'skfem-dual[pdf]'``.
    solution, options
        As for `report_html`.

    Raises
    ------
    ValueError
        If the suffix is another, or as `report_html`.
    TypeError, ImportError
        As `report_html`, or if WeasyPrint is missing.
    """
    checked_instance("path", path, (str, os.PathLike))
    suffix = Path(path).suffix
    if suffix not in SUFFIXES:
        raise ValueError(f"expected a file name ending in {' or '.join(SUFFIXES)}, got {path}")
    if suffix == ".pdf":
        require_pdf()
    text = report_html(solution, **options)
    if suffix == ".pdf":
        write_whole(path, lambda part: write_pdf(part, text))
    else:
        write_whole(path, lambda part: Path(part).write_text(text, encoding="utf-8"))


def report_html(
    solution: Reported,
    *,
    couple: PunchSolution | None = None,
    details: Details | None = None,
    **said: Any,
) -> str:
    """A page with input, results and checks of a solution.

    Parameters
    ----------
    solution : PunchSolution, ElasticSolution, CasesSolution or mapping of str to CasesSolution
        What to report, on any grid: one load, a structure, load cases, or those of several
        footings on the same ground by their names.
    couple : PunchSolution, optional
        Of a rigid punch the same problem on the other grid of the `DualMesh`, from which the
        error is estimated; `solve_on_other_grid` finds it. With cases, that of the case with the
        largest pressure under the first footing.
    details : Details, optional
        What else it says, or as keyword arguments:
    **said
        ``title``, ``project``, ``author``, ``date``, ``mesh_name``, ``units`` (such as
        ``"kN,m"``: the page is then in units engineers read), ``allowable`` (bearing pressure),
        ``points`` (whose settlements are wanted), ``profile`` (a
        point below which the ground is looked at) and ``remarks``; see `Details`.

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
        If ``couple`` has another mesh, origin, load or ground, or units are not known.
    ImportError
        If matplotlib is missing.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> solution = RigidPunch(HalfSpace(30e3, 0.25), dual.basis()).solve(1.2e3, (0.1, 0.05))
    >>> text = report_html(
    ...     solution, title="Pier 3", units="kN,m", couple=solve_on_other_grid(solution)
    ... )
    >>> "<h1>Pier 3</h1>" in text
    True
    """
    details = Details(**said) if details is None else replace(details, **said)
    checked_instance("details", details, Details)
    kinds = (PunchSolution, ElasticSolution, CasesSolution, Mapping)
    checked_instance("solution", solution, kinds)
    mesh_name = "mesh in memory" if details.mesh_name is None else details.mesh_name
    footings = [] if isinstance(solution, ElasticSolution) else footings_of(solution, details)
    if isinstance(solution, ElasticSolution):
        if couple is not None:
            raise TypeError("expected no couple of an ElasticSolution, got one")
        parts = structure_sections(
            solution, mesh_name, details.remarks, __version__, details.units
        )
    elif isinstance(solution, PunchSolution):
        parts = _punch_sections(solution, couple, mesh_name, footings)
    else:
        standing = footings[0].standing
        if couple is not None and standing is not None:
            _check_same_problem(standing.solution, couple)
        parts = cases_sections(footings, couple, mesh_name, __version__)
    title = details.title
    if title is None:
        title = STRUCTURE if isinstance(solution, ElasticSolution) else TITLE
    if isinstance(solution, ElasticSolution):
        success = solution.success
    else:
        success = all(footing.cases.success.all() for footing in footings)
    failed = "" if success else "NOT CONVERGED: "
    who = [text for text in (details.project, details.author) if text is not None]
    subtitle = " · ".join([*who, f"{details.date:%Y-%m-%d %H:%M}", mesh_name])
    return page(failed + title, f"{subtitle} · skfem_dual {__version__}", joined(parts))


def _punch_sections(
    solution: PunchSolution,
    couple: PunchSolution | None,
    mesh_name: str,
    footings: list[Footing],
) -> list[Html]:
    if couple is not None:
        _check_same_problem(solution, couple)
    details = footings[0].details
    standing = Standing(solution, details.units)
    return [
        warnings_of(solution, standing, couple, details.remarks),
        in_short(solution, standing),
        input_section(solution, standing, mesh_name),
        position_section(solution, standing),
        pressure_section(solution, standing),
        bearing_section(footings),
        NONE if not details.points else points_section(footings, []),
        standing_section(solution, standing),
        depth_section(footings[0]),
        resultant_section(solution, standing),
        error_section(solution, standing, couple),
        solver_section(solution, couple, __version__, details.units),
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
