"""A report of a solution for engineers: one page that needs nothing else, as HTML or PDF."""

import json
import os
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast

from .. import __version__
from ..arguments import checked_instance
from ..io import write_whole
from ..io.writing import PathLike
from ..solutions.cases_solution import CasesSolution
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.group_solution import PunchesSolution
from ..solutions.punch_solution import PunchSolution
from .bearing import points_section
from .bodies import ReportedBody, bodies_of
from .cases import bearing_of_bodies, cases_sections
from .checks import Solved, error_section, resultant_section, solver_section, warnings_of
from .data import plain, report_data
from .depth import depth_of_footing
from .details import Details
from .footing import Footing
from .input import input_section
from .numbers import Standing
from .page import NONE, Html, joined, page
from .pdf import require_pdf, write_pdf
from .results import in_short, position_section, pressure_section, standing_section
from .sliding import sliding_section
from .structure import structure_sections

TITLE = "Rigid punch on elastic ground"
STRUCTURE = "Structure on elastic ground"
SEVERAL = "Foundations on elastic ground"
SUFFIXES = (".html", ".pdf", ".json")

KINDS = (PunchSolution, ElasticSolution, PunchesSolution, CasesSolution, Mapping)
#: load cases of a body
Cases = CasesSolution | Mapping[str, PunchSolution] | Mapping[str, ElasticSolution]
Reported = (
    PunchSolution
    | ElasticSolution
    | PunchesSolution
    | Cases
    | Mapping[str, PunchSolution | ElasticSolution | Cases]
)


def write_report(path: PathLike, solution: Reported, **options: Any) -> None:
    """Write `report_html` to a file ending in ``.html`` or ``.pdf``, whole or not at all.

    Parameters
    ----------
    path : path
        The file. A PDF takes WeasyPrint, ``pip install 'skfem-dual[pdf]'``. The same for other
        programs is one ending in ``.json``, whose fields are described in the guide.
    solution, options
        As for `report_html`.

    Raises
    ------
    ValueError
        If the suffix is another, or as `report_html`.
    TypeError, ImportError
        As `report_html`, or if WeasyPrint is missing.
    OSError
        If the file cannot be written.
    """
    checked_instance("path", path, (str, os.PathLike))
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"expected a file name ending in .html, .pdf or .json, got {path}")
    if suffix == ".pdf":
        require_pdf()
    if suffix == ".json":
        return write_data(path, report_data(_bodies(solution, _details(**options))))
    text = report_html(solution, **options)
    if suffix == ".pdf":
        write_whole(path, lambda part: write_pdf(part, text))
    else:
        write_whole(path, lambda part: Path(part).write_text(text, encoding="utf-8"))
    return None


def write_data(path: PathLike, data: Mapping[str, Any]) -> None:
    """Write `report_data` and what else is known to a JSON file, whole or not at all.

    Numbers that are not finite become ``null``.

    Parameters
    ----------
    path : path
        The file.
    data : mapping
        By names, of what JSON knows, and of arrays.

    Raises
    ------
    TypeError
        If ``data`` is no mapping, or has what JSON does not know.
    OSError
        If the file cannot be written.
    """
    checked_instance(
        "data", data, Mapping, "write_report of the solution, to a file ending in .json"
    )
    text = json.dumps(plain(data), indent=2, allow_nan=False) + "\n"
    write_whole(path, lambda part: Path(part).write_text(text, encoding="utf-8"))


def _details(details: Details | None = None, **said: Any) -> Details:
    known = [each.name for each in fields(Details)]
    if unknown := [name for name in said if name not in known]:
        raise TypeError(f"expected options of reports, {known}, got {unknown}")
    given = Details() if details is None else checked_instance("details", details, Details)
    return replace(given, **said)


def _bodies(solution: Reported, details: Details) -> list[ReportedBody]:
    remedy = "several bodies or cases by their names, dict(left=first, right=second)"
    checked_instance("solution", solution, KINDS, "" if isinstance(solution, type) else remedy)
    return bodies_of(solution, details)


def report_html(solution: Reported, *, details: Details | None = None, **said: Any) -> str:
    """A page with input, results and checks of a solution.

    Of a rigid punch the problem is solved on the other grid of the mesh, too, which tells how
    far the numbers may be off, see `PunchSolution.bounds`; of cases that with the largest
    pressure under each footing.

    Parameters
    ----------
    solution : PunchSolution, ElasticSolution, CasesSolution or mapping of str to them
        What to report, on any grid: one load of a punch or a structure, or load cases; those of a
        structure are a mapping of their names to solutions. Several bodies on the same ground,
        rigid ones and structures, are a mapping of their names to any of these; or what a group
        answers, and a mapping of the names of its load cases to that.
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
        If a solution is something else.
    ValueError
        If units are not known, or points are not on the plan.
    ImportError
        If matplotlib is missing.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> solution = RigidPunch(HalfSpace(30e3, 0.25), dual.basis()).solve(1.2e3, (0.1, 0.05))
    >>> text = report_html(solution, title="Pier 3", units="kN,m")
    >>> "<h1>Pier 3</h1>" in text
    True
    """
    details = _details(details, **said)
    mesh_name = "mesh in memory" if details.mesh_name is None else details.mesh_name
    bodies = _bodies(solution, details)
    if isinstance(solution, ElasticSolution):
        title, success = STRUCTURE, solution.success
        parts = structure_sections(solution, mesh_name, details, __version__)
    else:
        success = all(body.success.all() for body in bodies)
        titles = {TITLE if isinstance(body, Footing) else STRUCTURE for body in bodies}
        title = titles.pop() if len(titles) == 1 else SEVERAL
        if isinstance(solution, PunchSolution):
            parts = _punch_sections(solution, mesh_name, cast(Footing, bodies[0]))
        else:
            parts = cases_sections(bodies, mesh_name, __version__)
    title = title if details.title is None else details.title
    failed = "" if success else f"{_failure(bodies)}: "
    who = [text for text in (details.project, details.author) if text is not None]
    subtitle = " · ".join([*who, details.told_date, mesh_name])
    return page(failed + title, f"{subtitle} · skfem_dual {__version__}", joined(parts))


def _failure(bodies: list[ReportedBody]) -> str:
    """What heads a page some of whose cases failed: all by loads without equilibrium, or others
    by iterations, which leave a solution."""
    failed = [
        solution
        for body in bodies
        for solution, found in zip(body.solutions, body.success, strict=True)
        if not found
    ]
    return "NO SOLUTION" if all(each is None for each in failed) else "NOT CONVERGED"


def _punch_sections(solution: PunchSolution, mesh_name: str, footing: Footing) -> list[Html]:
    details, standing = footing.details, cast(Standing, footing.standing)
    return [
        warnings_of(standing, details.remarks),
        in_short(solution, standing),
        input_section(solution, standing, mesh_name),
        position_section(solution, standing),
        pressure_section(solution, standing),
        bearing_of_bodies([footing]),
        NONE if not details.points else points_section([footing]),
        standing_section(standing, footing.wanted),
        sliding_section(footing),
        depth_of_footing(footing),
        resultant_section(solution, standing),
        error_section(standing, footing.accuracy),
        solver_section([Solved(solution)], __version__, details.units),
    ]
