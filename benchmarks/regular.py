"""Regular grids side by side with Tamaas and ContactMechanics: rough surfaces and a sphere.

    python benchmarks/regular.py                           512 x 512 points
    python benchmarks/regular.py --quick                   64 x 64
    python benchmarks/regular.py --python PATH/TO/python   peers of another environment

Every package runs in a process of its own with two threads and answers in turn, so that ratios
are of one run; what is not installed is skipped. The first call of every kind is not timed; of
the others the least time counts, from nothing to the pressures, and beside it the time of the
processors, which other work on the machine changes less.

1. A rough surface pressed on a half-space, free or periodic, with the same tolerance for all. Each
   package measures it in its own way, so the error of its pressures tells how far it has come: the
   root of the mean square of what is not that of a solution of ours to 1e-10, over the mean
   pressure.
2. Milliseconds to 1 %, 0.1 % and 0.01 % of the approach of a sphere, as in peers.py.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from peers import GOALS, Run, processes, quickest
from quiet import warn_beside_other_work

#: force on the unit square with E* = 1: contact on about a sixth of it
FORCE = 0.08
TOLERANCES = (1e-4, 1e-6)
GRIDS = (8, 12, 16, 24, 32, 48, 64, 96, 128)
NAMES = ("skfem_dual", "tamaas", "contactmechanics")


def rough(found: dict, folder: Path, n: int, tolerances=TOLERANCES, repeat: float = 5.0) -> dict:
    """Print the table; return {(periodic, tolerance, package): (answer, error)}."""
    print(
        f"\n1. Rough surface, {n} x {n} points\n{'':10}{'tolerance':>10}{'package':>18}"
        f"{'contact':>9}{'seconds':>9}{'ratio':>7}{'processor':>11}{'ratio':>7}{'error':>9}"
    )
    rows: dict = {}
    path = str(folder / "pressures.npy")
    for periodic in (False, True):
        setting = {"force": FORCE, "periodic": periodic, "path": path}
        for process in found.values():  # compiles, and plans transforms
            process.ask("rough", n=64, tolerance=1e-3, **setting)
        found["skfem_dual"].ask("rough", n=n, tolerance=1e-10, **setting)
        exact = np.load(path)
        for tolerance in tolerances:
            for name, process in found.items():
                answer = process.ask("rough", repeat, n=n, tolerance=tolerance, **setting)
                error = np.sqrt(np.mean((np.load(path) - exact) ** 2)) / exact.mean()
                rows[periodic, tolerance, name] = answer, float(error)
                own = rows[periodic, tolerance, "skfem_dual"][0]
                work = answer["seconds"] * answer["parallel"]
                ratios = (
                    answer["seconds"] / own["seconds"],
                    work / own["seconds"] / own["parallel"],
                )
                print(
                    f"{'periodic' if periodic else 'free':10}{tolerance:>10.0e}{name:>18}"
                    f"{100 * answer['contact']:>7.1f} %{answer['seconds']:>9.3g}{ratios[0]:>7.2f}"
                    f"{work:>11.3g}{ratios[1]:>7.2f}{error:>9.0e}",
                    flush=True,
                )
    return rows


def hertz(found: dict, sizes=GRIDS, repeat: float = 1.0) -> dict:
    """Print the table; return {package: {setting: [runs by size]}}."""
    print("\n2. Sphere: milliseconds from nothing, and with the operator at hand")
    runs: dict = {"ours": {}, "ours, solution alone": {}, "Tamaas": {}}
    for margin in (1.05, 1.25):
        for tolerance in (1e-2, 1e-4):
            setting = {"tolerance": tolerance, "margin": margin, "plan": "Hertz"}
            key = f"margin {margin:g}, tolerance {tolerance:g}"
            for n in sizes:
                answer = found["skfem_dual"].ask("sphere", repeat, n=n, **setting)
                alone = answer.pop("alone")
                runs["ours"].setdefault(key, []).append(Run(**answer))
                answer["seconds"] = alone
                runs["ours, solution alone"].setdefault(key, []).append(Run(**answer))
                if "tamaas" in found:
                    answer = found["tamaas"].ask("contact", repeat, n=n, **setting)
                    runs["Tamaas"].setdefault(key, []).append(Run(**answer))
    print(f"{'':24}" + "".join(f"{100 * goal:>10g} %" for goal in GOALS))
    for name, settings in runs.items():
        best = [quickest(settings, goal) for goal in GOALS] if settings else []
        texts = [f"{1e3 * b[0].seconds:.2f} ({b[0].cells})" if b else "-" for b in best]
        print(f"{name:24}" + "".join(f"{text:>12}" for text in texts), flush=True)
    return runs


def main(n: int = 512, python: str = sys.executable, tolerances=TOLERANCES, sizes=GRIDS) -> tuple:
    """Both tables."""
    print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
    with processes(python, NAMES) as found, tempfile.TemporaryDirectory() as folder:
        rows = rough(found, Path(folder), n, tolerances)
        return rows, hertz(found, sizes)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Regular grids beside peers.")
    parser.add_argument("--quick", action="store_true", help="a small grid")
    parser.add_argument("--python", default=sys.executable, help="interpreter of the peers")
    arguments = parser.parse_args()
    warn_beside_other_work()
    main(64 if arguments.quick else 512, arguments.python)
