"""How time and memory grow with the number of cells, from ten thousand on.

    python benchmarks/growth.py                            1e4, 1e5, 1e6 cells
    python benchmarks/growth.py --sizes 10000 10000000     other numbers of cells
    python benchmarks/growth.py --lift                     lift-off as well, of up to a million
    python benchmarks/growth.py --plot growth.png          a picture as well

A rigid disc on uniform dual cells, from the mesh to settlement and pressures in full contact; then
under a force at half its radius, where it lifts off. Each size runs in a process of its own, whose
greatest memory is told; compiled code is there before. Sizes beyond the memory are left out.
Errors are those of the settlement: exact in full contact, against trusted digits where it lifts
off.
"""

import argparse
import json
import subprocess
import sys
from dataclasses import asdict, dataclass, replace
from time import perf_counter, process_time
from typing import TYPE_CHECKING

import numpy as np
from fast_operator import SOIL, rings
from quiet import warn_beside_other_work
from skfem import MeshTri

from skfem_dual import DualMesh, RigidPunch
from skfem_dual.operators.resources import available_memory, whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZES = (10_000, 100_000, 1_000_000)
#: settlement of the disc times E* a / P, in full contact and lifting off at half its radius
FULL, LIFTED = 0.5, 0.4821
#: cells whose solution takes every kernel
FIRST = 20_000
#: lift-off is left out beyond so many cells; from so many on its iterations show their progress
MOST, SHOWN = 1_000_000, 300_000


@dataclass(frozen=True)
class Growth:
    """Seconds, bytes and errors of one size.

    Attributes
    ----------
    cells : int
    ready, seconds, lifting : float
        Seconds until products and an approximate inverse are there, until the answer in full
        contact, and of lift-off alone; NaN if that was left out.
    processor : float
        Processor time of all threads up to the answer in full contact.
    memory : float
        Greatest memory of the process, in bytes; NaN where that is not known.
    error, lifted : float
        Relative errors of the settlements.
    steps : int
        Iterations of lift-off.
    """

    cells: int
    ready: float
    seconds: float
    processor: float
    memory: float
    error: float
    lifting: float = float("nan")
    lifted: float = float("nan")
    steps: int = 0


def solve(n: int, lift: bool) -> Growth:
    """One size, in this process."""
    first = _punch(rings(min(n, FIRST)))  # compiles, all that more cells take
    first.solve(1.0)
    first.solve(1.0, (0.5, 0.0))
    del first
    mesh = rings(n)
    start, processor = perf_counter(), process_time()
    punch = _punch(mesh)
    punch.system.approximate  # noqa: B018
    ready = perf_counter() - start
    error = punch.solve(1.0).settlement / FULL - 1  # with the position by work
    seconds, processor = perf_counter() - start, process_time() - processor
    cells = len(punch.partition)
    row = Growth(cells, ready, seconds, processor, greatest_memory(), error)
    if not lift:
        return row
    start = perf_counter()
    found = punch.solve(1.0, (0.5, 0.0), progress=n >= SHOWN)
    if not found.success:
        raise RuntimeError(f"{cells} cells: {found.message}")
    lifted = found.settlement / LIFTED - 1
    return replace(
        row,
        memory=greatest_memory(),
        lifting=perf_counter() - start,
        lifted=lifted,
        steps=found.iterations,
    )


def _punch(mesh: MeshTri) -> RigidPunch:
    return RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), rtol=1e-6)


def greatest_memory() -> float:
    """Of this process, in bytes."""
    try:
        import resource
    except ImportError:  # not on Windows
        return float("nan")
    unit = 1 if sys.platform == "darwin" else 1024
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)


def of_its_own(n: int, lift: bool) -> Growth:
    """One size, in a process of its own; its progress bars and errors come through."""
    command = [sys.executable, __file__, "--one", str(n), *["--lift"] * lift]
    found = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return Growth(**json.loads(found.stdout))


def main(sizes=SIZES, lift: bool = False) -> list[Growth]:
    """Print the table; return its rows."""
    warn_beside_other_work()
    print(
        f"{'cells':>10}{'set-up s':>10}{'answer s':>10}{'CPU s':>9}{'us/cell':>9}{'GB':>7}"
        f"{'kB/cell':>9}{'error':>10}" + f"{'lift-off s':>12}{'steps':>7}{'error':>10}" * lift
    )
    rows = []
    for n in sizes:
        if (needed := whole(n, 1e-6, False)) > (there := available_memory()):
            print(f"left out: {n} cells take about {needed / 1e9:.1f} GB of {there / 1e9:.1f} GB")
            continue
        row = of_its_own(n, lift and n <= MOST)
        rows.append(row)
        text = (
            f"{row.cells:>10}{row.ready:>10.2f}{row.seconds:>10.2f}"
            f"{row.processor:>9.2f}{1e6 * row.processor / row.cells:>9.1f}"
            f"{row.memory / 1e9:>7.2f}{row.memory / 1e3 / row.cells:>9.2f}{row.error:>+10.1e}"
        )
        if row.steps:
            text += f"{row.lifting:>12.2f}{row.steps:>7}{row.lifted:>+10.1e}"
        print(text, flush=True)
    return rows


def read(text: str) -> list[Growth]:
    """The rows of what `main` prints, to its digits."""
    rows = []
    for line in text.splitlines():
        first, *others = line.split() or [""]
        if first.isdigit() and len(others) in (7, 10):
            ready, seconds, processor, _, memory, _, error, *lifted = map(float, others)
            lifting, steps, off = lifted or (float("nan"), 0, float("nan"))
            found = int(first), ready, seconds, processor, 1e9 * memory, error
            rows.append(Growth(*found, lifting, off, int(steps)))
    return rows


def draw(rows: list[Growth]) -> "Axes":
    """Processor time and memory over the number of cells; the axes of the latter."""
    import matplotlib.pyplot as plt

    _, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.0), layout="constrained")
    cells = np.array([row.cells for row in rows])
    times = np.array([row.processor for row in rows])
    left.loglog(cells, times, "o-")
    left.loglog(cells, times[0] / cells[0] * cells, color="0.6", lw=1, ls="--", label="linear")
    left.set_title("processor time [s]")
    left.legend(frameon=False)
    right.loglog(cells, memory := np.array([row.memory / 1e9 for row in rows]), "o-")
    right.set_title("greatest memory [GB]")
    for axes, values in ((left, times), (right, memory)):  # whole powers of ten have numbers
        low, high = np.floor(np.log10(values.min())), np.ceil(np.log10(values.max()))
        axes.set(xlabel="dual cells", ylim=(10**low, 10 ** max(high, low + 1)))
        axes.yaxis.set_minor_formatter("")
        axes.grid(alpha=0.3)
    return right


def plot(rows: list[Growth], path: str) -> None:
    """Draw processor time and memory over the number of cells into a file."""
    import matplotlib.pyplot as plt

    figure = draw(rows).figure
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES, metavar="N")
    parser.add_argument("--lift", action="store_true", help="lift-off as well")
    parser.add_argument("--plot", metavar="FILE", help="a picture as well")
    parser.add_argument("--one", type=int, metavar="N", help="one size here, its row as JSON")
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(asdict(solve(arguments.one, arguments.lift))))
    else:
        table = main(arguments.sizes, arguments.lift)
        if arguments.plot:
            plot(table, arguments.plot)
