"""Run by its path in a process of its own: one mesh file through meshio, to stdout.

It imports nothing of the package, which would take longer than most files.
"""

import contextlib
import io
import math
import pickle
import sys
from pathlib import Path
from typing import Any


def read(path: str, file_format: str | None) -> tuple[str, Any]:
    """What became of reading: ("mesh", its parts), ("missing", a package) or ("error", why)."""
    import meshio
    import numpy as np

    told = io.StringIO()  # meshio prints its reasons and exits
    quiet = contextlib.redirect_stdout(told), contextlib.redirect_stderr(told)
    try:
        # sizes of a binary STL that is not one overflow
        with quiet[0], quiet[1], np.errstate(over="ignore"):
            found = meshio.read(path, file_format)
    except ImportError as error:
        return "missing", error.name or str(error)
    except MemoryError:
        return "error", "it asks for far more memory than the file is large"
    except (KeyError, IndexError) as error:  # whose words are a number or a name
        where = told.getvalue().strip() or str(error)
        return "error", f"it names a node or a group that it does not define ({where})"
    except (Exception, SystemExit) as error:  # noqa: BLE001 - told to the caller
        return "error", told.getvalue().strip() or str(error) or type(error).__name__
    kept = ("points", "cell_data", "point_data", "field_data", "cell_sets")
    parts = {name: getattr(found, name) for name in kept}
    return "mesh", parts | {"cells": [(block.type, block.data) for block in found.cells]}


def limit(memory: int, seconds: float) -> None:
    """So much memory and processor time beside what the process has used; not on every system."""
    try:
        import resource
    except ImportError:
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    cpu = math.ceil(used.ru_utime + used.ru_stime + seconds)
    resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 1))
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except OSError:
        return
    most = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (most, most))


def main(path: str, file_format: str, memory: str, seconds: str) -> None:
    """Read within the limits and write the pickled answer."""
    import meshio  # noqa: F401 - not within the limits

    limit(int(memory), float(seconds))
    answer = pickle.dumps(read(path, file_format or None), pickle.HIGHEST_PROTOCOL)
    sys.stdout.buffer.write(answer)


if __name__ == "__main__":
    main(*sys.argv[1:])
