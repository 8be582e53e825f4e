"""What a small problem takes, stage by stage, in processor time on one thread.

    python benchmarks/small.py                  50 to 2437 cells of a disc
    python benchmarks/small.py --small          50 cells only
    python benchmarks/small.py --beside TREE    the same with another tree of the package, in turn

Milliseconds, the least of some runs: the mesh, its dual grid with the law of the edge, the exact
matrix under uniform cells, what the law of the edge and slopes add to it, pressures by settlement
and tilts, and all from the mesh to the printed answer. Then nanoseconds for an entry, the import
beyond that of scikit-fem, and a command from start to end, which find bytecode and compiled code
on disk.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import process_time

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
SIZES = (50, 217, 631, 2437)
GIVEN = (
    "--corners",
    "0,0 12,0 12,8 0,8",
    "--young",
    "30e3",
    "--poisson",
    "0.3",
    "--force",
    "4000",
)
IMPORT = """
from time import process_time
import skfem
begin = process_time()
import skfem_dual
print(process_time() - begin)
"""


def best(work: Callable[[], object], runs: int) -> float:
    """Least processor time of some runs, in seconds, after one that compiles."""
    times = []
    work()
    for _ in range(runs):
        begin = process_time()
        work()
        times.append(process_time() - begin)
    return min(times)


def stages(n: int, runs: int) -> dict[str, float]:
    """Milliseconds of each stage with ``n`` nodes, and nanoseconds of an entry."""
    from skfem import MeshTri

    from skfem_dual import DualMesh, HalfSpace, RigidPunch
    from skfem_dual.elements.influence import influence_matrix
    from skfem_dual.grids.generate import disc, polygon

    mesh, soil = disc(n=n), HalfSpace(1.0, 0.0)

    def punch() -> RigidPunch:
        fresh = MeshTri(mesh.p.copy(), mesh.t.copy())  # nothing known of it
        return RigidPunch(soil, DualMesh.from_mesh(fresh).basis())

    ready = punch()
    cells, system = ready.footprint, ready.system
    uniform = soil, cells.partition, cells.collocation_points
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    entries = best(lambda: influence_matrix(*uniform), runs)
    every = cells.entries(cells.collocation_points)
    edge = best(lambda: replace(every, slopes=None).matrix(), runs)
    found = {
        "mesh of a disc": best(lambda: disc(n=n), runs),
        "mesh of a square": best(lambda: polygon(square, n=n), runs),
        "dual grid, edge law": best(lambda: punch().footprint, runs),
        "uniform cells": entries,
        "law of the edge": edge - entries,
        "slopes in cells": best(lambda: replace(every).matrix(), runs) - edge,
        "unit pressures": best(lambda: replace(system).unit_pressures, runs),
        "dual grid to answer": best(lambda: repr(punch().solve(1.0)), runs),
    }
    table = {name: 1e3 * seconds for name, seconds in found.items()}
    return table | {"ns an entry": 1e9 * entries / len(cells) ** 2}


def starts(runs: int) -> dict[str, float]:
    """Seconds of processor time of imports and of a command, the least of some runs after one
    that writes bytecode."""
    command = [sys.executable, "-m", "skfem_dual", "solve", *GIVEN]
    imports, commands = [], []
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"PYTHONPYCACHEPREFIX": folder, "PYTHONDONTWRITEBYTECODE": ""}
        options = {"capture_output": True, "check": True, "env": environment}
        for _ in range(1 + runs):
            found = subprocess.run([sys.executable, "-c", IMPORT], **options)
            imports.append(float(found.stdout))
            begin = os.times()
            subprocess.run(command, **options)
            end = os.times()
            spent = end.children_user + end.children_system
            commands.append(spent - begin.children_user - begin.children_system)
    return {"import, s": min(imports[1:]), "a command, s": min(commands[1:])}


def measured(sizes: tuple[int, ...], runs: int) -> dict[str, dict[str, float]]:
    """All figures of this tree, by the number of cells; of starts without one."""
    found = {str(n): stages(n, runs if n < 1000 else max(runs // 3, 1)) for n in sizes}
    return found | {"": starts(runs)}


def alone(tree: str, sizes: tuple[int, ...], runs: int) -> dict[str, dict[str, float]]:
    """`measured` in a process of its own, on one thread."""
    code = "import json, sys, small; print(json.dumps(small.measured(*json.loads(sys.argv[1]))))"
    environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": tree}
    found = subprocess.run(
        [sys.executable, "-c", code, json.dumps([sizes, runs])],
        cwd=Path(__file__).parent,  # where -c looks first
        env=environment,
        capture_output=True,
        text=True,
    )
    if found.returncode:
        raise RuntimeError(f"the run of {tree} failed:\n{found.stderr}")
    return json.loads(found.stdout.splitlines()[-1])


def main(
    sizes: tuple[int, ...] = SIZES, runs: int = 6, beside: str | None = None
) -> list[dict[str, dict[str, float]]]:
    """Print the table; return the figures of each tree, this one last."""
    trees = [*([str(Path(beside).resolve())] if beside else []), str(Path(__file__).parents[1])]
    found = [alone(tree, sizes, runs) for tree in trees]
    if hasattr(os, "getloadavg") and os.getloadavg()[0] > 1.5:
        print("measured beside other work: times are longer than on a quiet machine")
    print("processor time on one thread, ms" + (", before and after" if beside else ""))
    columns = [key for key in found[0] if key]
    width = 10 * len(found)
    print(f"{'cells':<22}" + "".join(f"{n:>{width}}" for n in columns))
    for row in found[0][columns[0]]:
        figures = [f"{each[n][row]:>10.1f}" for n in columns for each in found]
        print(f"{row:<22}" + "".join(figures))
    for row in found[0][""]:
        print(f"{row:<22}" + "".join(f"{each[''][row]:>10.2f}" for each in found))
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--beside", metavar="TREE")
    given = parser.parse_args()
    main((50,) if given.small else SIZES, beside=given.beside)
