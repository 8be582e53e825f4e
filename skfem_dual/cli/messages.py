"""Errors and warnings in one line each, with remedies in words of the command line."""

import argparse
import re
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import Any

from ..errors import ConvergenceWarning, MeshWarning, ResolutionWarning
from ..kernels.compiled import when_compiling
from ..terminal import is_watched, tell

#: how arguments of the library are called here
OPTIONS = (
    (r"unilateral=False", "--bilateral"),
    (r"at= or origin=", "--at or --origin"),
    # what only programs can do
    (r", as by refine_to_contact on triangles", ""),
    (r"; the settlement of the ground beside it is solution\.ground_displacement\(x\)", ""),
    (r"; or pressure_field with a larger refine, nodal_pressure with conserve=False", ""),
    (r", or tol= greater than it, now \S+", ""),
    (r"\. Remedy: stiffness\(full=True\) for a base without weight", ""),
    (r"\. Remedy: go on from this solution, start=", ""),
    (r"\. Remedy: quads=\"keep\"", ""),
    (r"\. Remedy: solve the group on dual\.basis\(\) and on .*, and compare", ""),
    (
        r"outlines are read by Plan\.read",
        "outlines, for the command solve, end in .csv, .wkt, .geojson or .dxf",
    ),
    (r"sides=, over which it is spread", "bx and by in the table, over which it is spread"),
    (r"method=\"cg\"", "a coarser mesh"),
    (r"time_limit=?", "--time-limit"),
    (r"memory=, or ", ""),
    (r", hold the structure, D=,", ""),
    # numbers may be from a table
    (r"\bgot (force|settlement|tilt)=(?!=)", r"got \1 "),
    (r"edge=\"constant\"", "--edge constant"),
    (r"\b(force|at|moments|settlement|tilt|origin|collocation|accuracy|layer)=(?!=)", r"--\1 "),
)


#: what takes the time of a first run
COMPILING = "compiling for up to half a minute, once after an installation"


def progress_of_compilation(options: argparse.Namespace) -> AbstractContextManager:
    """Tells of compilation where progress is shown."""
    if getattr(options, "progress", False) or is_watched():
        return when_compiling(partial(tell, COMPILING))
    return nullcontext()


def how_of(options: argparse.Namespace) -> dict[str, Any]:
    """How solvers are called."""
    watched = options.progress or is_watched()
    return {"unilateral": not options.bilateral, "progress": watched}


def show_warning(warned: list[str], message: Warning | str, *where: object) -> None:
    """Tell a warning in one line, and keep it for reports if it is about the problem."""
    text = told(message)
    if isinstance(message, (MeshWarning, ConvergenceWarning, ResolutionWarning)):
        warned.append(text)
    tell(f"warning: {text}")


def told(error: BaseException | Warning | str) -> str:
    """What is said, or the name of the error, in one line."""
    return in_options(" ".join(str(error).split())) or type(error).__name__


def in_options(text: str) -> str:
    """``text`` with the names of options in place of those of arguments.

    >>> in_options("Remedy: unilateral=False for ground that pulls")
    'Remedy: --bilateral for ground that pulls'
    """
    for argument, option in OPTIONS:
        text = re.sub(argument, option, text)
    return re.sub(r"(--\w+) (?=[,.;)]|$)", r"\1", text)
