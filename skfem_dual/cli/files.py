"""The files a command reads and writes, looked at before any work."""

import argparse
from pathlib import Path

from ..io import require_outputs
from ..io.guarded import require_file
from ..startup import leaving_at_once

SUFFIXES = {
    "png": (".png",),
    "svg": (".svg", ".pdf"),
    "vtu": (".vtu",),
    "json": (".json",),
    "table": (".csv",),
    "report": (".html", ".pdf"),
}


def check_files(options: argparse.Namespace) -> None:
    """Refuse input that is no file and output that cannot be written, before any work.

    Also libraries that are missing for what is to be written.
    """
    meshes = options.mesh if isinstance(options.mesh, list) else [options.mesh]
    inputs = {"MESH" if len(meshes) == 1 else f"MESH {i}": m for i, m in enumerate(meshes, 1)}
    for name in ("substrate", "loads"):
        if getattr(options, name, None) is not None:
            inputs[f"--{name}"] = getattr(options, name)
    for name, path in inputs.items():
        require_file(path, f"a file for {name}")
    outputs = {f"--{n}": p for n in SUFFIXES if (p := getattr(options, n, None)) is not None}
    for name, path in outputs.items():
        suffixes = SUFFIXES[name[2:]]
        if Path(path).suffix.lower() not in suffixes:
            raise ValueError(
                f"expected a file name ending in {' or '.join(suffixes)} for {name}, got {path}"
            )
    require_outputs(outputs, inputs)
    if "--png" in outputs:
        from ..visuals.offscreen import require_pyvista

        with leaving_at_once():
            _ = require_pyvista().Plotter  # for which it imports most of VTK
    if {"--svg", "--report"} & set(outputs):
        from ..visuals.axes import pyplot

        pyplot()
    if Path(outputs.get("--report", "")).suffix.lower() == ".pdf":
        from ..report.pdf import require_pdf

        require_pdf()
