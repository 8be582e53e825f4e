"""Run by its path in a process of its own: one mesh file through meshio, to stdout.

It imports nothing of the package, which would take longer than most files.
"""

import contextlib
import io
import pickle
import sys
from typing import Any


def read(path: str, file_format: str | None) -> tuple[str, Any]:
    """What became of reading: ("mesh", its parts), ("missing", a package) or ("error", why)."""
    import meshio

    told = io.StringIO()  # meshio prints its reasons and exits
    try:
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            found = meshio.read(path, file_format)
    except ImportError as error:
        return "missing", error.name or str(error)
    except MemoryError:
        return "error", "it asks for far more memory than the file is large"
    except (Exception, SystemExit) as error:  # noqa: BLE001 - told to the caller
        return "error", told.getvalue().strip() or str(error) or type(error).__name__
    kept = ("points", "cell_data", "point_data", "field_data", "cell_sets")
    parts = {name: getattr(found, name) for name in kept}
    return "mesh", parts | {"cells": [(block.type, block.data) for block in found.cells]}


def limit_memory(size: int) -> None:
    """Leave room for ``size`` bytes beside what the process has; not on every system."""
    try:
        import resource
        from pathlib import Path

        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except (ImportError, OSError):
        return
    limit = pages * resource.getpagesize() + size
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def main(path: str, file_format: str, size: str) -> None:
    """Read with at most ``size`` bytes of memory and write the pickled answer."""
    import meshio  # noqa: F401 - before the limit
    import numpy as np

    np.zeros(1)
    limit_memory(int(size))
    answer = pickle.dumps(read(path, file_format or None), pickle.HIGHEST_PROTOCOL)
    sys.stdout.buffer.write(answer)


if __name__ == "__main__":
    main(*sys.argv[1:])
