"""Whether VTK can draw without a display."""

import os
import subprocess
import sys
from functools import cache

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


@cache
def opengl_works() -> bool:
    """Whether VTK can draw, tried once in a process of its own, which takes about a second."""
    try:
        return subprocess.run(PROBE, capture_output=True, timeout=60).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def require_opengl() -> None:
    """Choose EGL on Linux without a display, and make sure that it works.

    VTK would try X11 first, with noise, and it crashes without an exception where the libraries
    are missing. A choice made in ``VTK_DEFAULT_OPENGL_WINDOW`` is left as it is.

    Raises
    ------
    RuntimeError
        If there is no working OpenGL.
    """
    if not sys.platform.startswith("linux") or os.environ.get("DISPLAY"):
        return
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    if not opengl_works():
        raise RuntimeError(
            "VTK finds no working OpenGL to draw with. Remedy: apt install libegl1 libgl1, or "
            "draw with skfem_dual.visuals.matplotlib"
        )
