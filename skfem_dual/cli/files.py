"""The files a command reads and writes, looked at before any work."""

import argparse
from pathlib import Path

from ..io import require_outputs
from ..io.guarded import require_file

SUFFIXES = {
    "png": (".png",),
    "svg": (".svg", ".pdf"),
    "vtu": (".vtu",),
    "json": (".json",),
    "report": (".html",),
}


def check_files(options: argparse.Namespace) -> None:
    """Refuse input that is no file and output that cannot be written, before any work."""
    inputs = {"MESH": options.mesh}
    if getattr(options, "substrate", None) is not None:
        inputs["--substrate"] = options.substrate
    for name, path in inputs.items():
        require_file(path, f"a file for {name}")
    outputs = {f"--{n}": p for n in SUFFIXES if (p := getattr(options, n, None)) is not None}
    for name, path in outputs.items():
        suffixes = SUFFIXES[name[2:]]
        if Path(path).suffix not in suffixes:
            raise ValueError(
                f"expected a file name ending in {' or '.join(suffixes)} for {name}, got {path}"
            )
    require_outputs(outputs, inputs)
    if "--png" in outputs:
        from ..visuals.offscreen import require_pyvista

        require_pyvista()
    if {"--svg", "--report"} & set(outputs):
        from ..visuals.axes import pyplot

        pyplot()
