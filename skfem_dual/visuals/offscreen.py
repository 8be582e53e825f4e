"""Whether VTK can draw, and one drawing at a time."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import cache, wraps
from typing import Any, NamedTuple, ParamSpec, TypeVar

from .style import MISSING

P = ParamSpec("P")
R = TypeVar("R")

#: draws one small window off-screen with the least of VTK
PROBE = (
    sys.executable,
    "-c",
    "import vtkmodules.vtkRenderingOpenGL2\n"
    "from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow\n"
    "window = vtkRenderWindow()\n"
    "window.SetOffScreenRendering(1)\n"
    "window.SetSize(8, 8)\n"
    "window.AddRenderer(vtkRenderer())\n"
    "window.Render()\n"
    "raise SystemExit(not window.SupportsOpenGL())\n",
)
WINDOW, EGL = "VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow"

#: neither VTK nor pyplot may be called from several threads
_drawing = threading.RLock()


def _forget() -> None:
    """A forked process has none of the threads that draw."""
    global _drawing
    _drawing = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)


def one_at_a_time(draw: Callable[P, R]) -> Callable[P, R]:
    """``draw`` so that other threads wait until it is done."""

    @wraps(draw)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _drawing:
            return draw(*args, **kwargs)

    return alone


class Trial(NamedTuple):
    """Whether VTK can draw, and does it without a word on stderr."""

    works: bool
    quiet: bool


@cache
def try_opengl(display: str | None, window: str | None) -> Trial:
    """Draw in a process of its own, once; that takes about a second.

    Parameters
    ----------
    display, window : str or None
        ``DISPLAY`` and ``VTK_DEFAULT_OPENGL_WINDOW`` of the process, if any.
    """
    chosen = {"DISPLAY": display, WINDOW: window}
    kept = {k: v for k, v in os.environ.items() if k not in chosen}
    environment = kept | {k: v for k, v in chosen.items() if v is not None}
    try:
        run = subprocess.run(PROBE, capture_output=True, timeout=60, env=environment)
    except subprocess.TimeoutExpired:
        return Trial(False, False)
    return Trial(run.returncode == 0, not run.stderr)


@one_at_a_time
def require_opengl() -> None:
    """On Linux, choose between X11 and EGL, and make sure that the choice works.

    VTK crashes without an exception where libraries are missing or ``DISPLAY`` names a server
    that has gone. Without a display it would try X11 first, with noise. A choice made in
    ``VTK_DEFAULT_OPENGL_WINDOW`` is left as it is.

    Raises
    ------
    RuntimeError
        If there is no working OpenGL.
    """
    if not sys.platform.startswith("linux"):
        return
    display, chosen = os.environ.get("DISPLAY"), os.environ.get(WINDOW)
    windows = [chosen] if chosen else [None, EGL] if display else [EGL]
    working = []
    for window in windows:
        trial = try_opengl(display, window)
        if trial.works:
            working.append(window)
            if trial.quiet:
                working = [window]
                break
    if working:
        if working[0]:
            os.environ[WINDOW] = working[0]
        return
    stale = f" DISPLAY is {display!r}: is there such a server?" if display else ""
    raise RuntimeError(
        "VTK finds no working OpenGL to draw with. Remedy: apt install libegl1 libgl1, or "
        f"draw with skfem_dual.visuals.matplotlib.{stale}"
    )


def require_pyvista() -> Any:  # pyvista's decorators hide its types from mypy
    """pyvista, able to draw.

    Raises
    ------
    ImportError
        If it is missing; names the remedy.
    RuntimeError
        As `require_opengl`.
    """
    try:
        import pyvista
    except ImportError as error:
        raise ImportError(MISSING.format("pyvista")) from error
    require_opengl()
    return pyvista
