"""Run benchmarks and keep what they print for the page of performance.

    python docs/measure.py                            all, one after the other, each for minutes
    python docs/measure.py edge grids                 some
    python docs/measure.py peers --python PATH/TO/python   one, with options of its own

Each output goes to ``docs/performance/NAME.txt``, whole or not at all, below a description of the
machine. Figures are worth keeping only if nothing else runs.
"""

import argparse
import os
import platform
import re
import subprocess
import sys
from collections.abc import Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from time import monotonic, sleep

from skfem_dual.io import write_whole

ROOT = Path(__file__).parents[1]
#: scripts in ``benchmarks`` with their arguments, by the names of the files
BENCHMARKS: dict[str, list[str]] = {
    "edge": ["edge.py"],
    "positions": ["positions.py"],
    "edge_time": ["edge_time.py"],
    "small": ["small.py"],
    "grids": ["grids.py"],
    "substrates": ["substrates.py"],
    "fast_operator": ["fast_operator.py", "--million"],
    "growth": ["growth.py", "--lift"],
    "unilateral": ["unilateral.py"],
    "cases": ["cases.py"],
    "postprocess": ["postprocess.py"],
    "peers": ["peers.py"],
    "regular": ["regular.py"],
    "campaign": ["campaign.py"],
}
#: processes that may run on the average of a minute where one begins, and seconds to wait for that
QUIET, PATIENCE = 0.4, 300.0
PACKAGES = ("skfem-dual", "numpy", "scipy", "numba", "scikit-fem")


def header(command: Sequence[str]) -> str:
    """The machine, versions, the day and the command; nothing that tells whose machine it is."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    rows = (
        f"{date.today():%Y-%m-%d}, {processor()}, {os.cpu_count()} cores, {memory()}",
        f"{platform.system()}, Python {platform.python_version()}, {versions}",
        f"load average before: {load:.2f}",
    )
    return "\n".join([*rows, "", f"$ python benchmarks/{' '.join(command)}", "", ""])


def processor() -> str:
    """The model of the processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def memory() -> str:
    """The memory of the machine."""
    if not hasattr(os, "sysconf"):
        return "memory unknown"
    return f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 2**30:.0f} GiB"


def wait_until_quiet() -> None:
    """Wait for what has run before to leave the average; not for work that does not end."""
    end = monotonic() + PATIENCE
    while hasattr(os, "getloadavg") and os.getloadavg()[0] > QUIET and monotonic() < end:
        sleep(1.0)


def measure(name: str, options: Sequence[str] = ()) -> None:
    """Run a benchmark, with options beside its usual ones, and write its output.

    Of paths in the options only the last names are written.

    Raises
    ------
    RuntimeError
        If it fails; the file is then left as it was.
    """
    wait_until_quiet()
    script, *arguments = [*BENCHMARKS[name], *options]
    text = header([script, *(Path(a).name if os.sep in a else a for a in arguments)])
    path = ROOT / "benchmarks" / script
    found = subprocess.run(
        [sys.executable, str(path), *arguments], cwd=path.parent, capture_output=True, text=True
    )
    if found.returncode:
        raise RuntimeError(f"benchmarks/{script} failed:\n{found.stderr}")
    target = ROOT / "docs" / "performance" / f"{name}.txt"
    target.parent.mkdir(exist_ok=True)
    lines = found.stdout.replace(str(ROOT), ".").splitlines()
    text += "".join(f"{line.rstrip()}\n" for line in lines)
    write_whole(target, lambda part: Path(part).write_text(text, encoding="utf-8"))


def milliseconds(text: str, accuracy: str) -> dict[tuple[str, str], str]:
    """Milliseconds by package and problem, out of what ``benchmarks/peers.py`` prints.

    Raises
    ------
    ValueError
        If there is no such accuracy.
    """
    head, *rows = text.partition("3. Milliseconds to accuracy")[2].splitlines()[1:]
    if accuracy not in head.split():
        raise ValueError(f"expected one of {', '.join(head.split())}, got {accuracy}")
    column = head.split().index(accuracy) + 2
    found = {}
    for row in rows:
        cells = re.split(r"\s{2,}", row)
        if len(cells) < column + 1:
            return found
        reached = re.match(r"[\d.]+ ", cells[column])
        found[cells[1], cells[0]] = reached[0].strip() if reached else "not reached"
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(BENCHMARKS))
    known, options = parser.parse_known_args()
    names = known.names or list(BENCHMARKS)
    if options and len(names) > 1:
        parser.error("expected one benchmark to have options of its own")
    if unknown := set(names) - set(BENCHMARKS):
        parser.error(f"expected some of {', '.join(BENCHMARKS)}, got {', '.join(unknown)}")
    for name in names:
        print(name, flush=True)
        measure(name, options)
