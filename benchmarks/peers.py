"""Beside bempp-cl, NGSolve, Tamaas and ContactMechanics: assembly, contact, time to accuracy.

    python benchmarks/peers.py                           all sizes
    python benchmarks/peers.py --quick                   small sizes
    python benchmarks/peers.py --python PATH/TO/python   peers of another environment

Every package runs in a process of its own with two threads and answers in turn, so that ratios
are of one run; what is not installed is skipped. The first call of every kind, with imports and
compilation, is not timed; of the others the least time counts. Times of solutions go from nothing
to the settlement: mesh or grid, matrix or transforms, solution.

1. Assembly of the dense matrix of 1/r between the triangles of a disc.
2. Time and error of the settlement of flat punches and of the approach of a sphere.
3. Milliseconds to 1 %, 0.1 % and 0.01 % of the exact one: of all settings of a package the
   quickest with which this and all larger sizes, of which there is one at least, come as close.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from quiet import warn_beside_other_work

FOLDER = Path(__file__).parent
THREADS = 2
GOALS = (1e-2, 1e-3, 1e-4)
PLANS = ("disc", "square", "Hertz")

# What each package may choose from.
#
# Tamaas and ContactMechanics: Polonsky-Keer conjugate gradients on a half-space that is not
# periodic, points in powers of two, just around the punch or some more than the contact. Stopped
# late or soon: the settlement is taken such that it errs like the square of the pressures.
# Scaling the points of the disc to its area was worse.
GRIDS = (16, 32, 64, 128, 256, 512)
REGULAR = [
    *({"plan": p, "tolerance": t, "margin": 1.0} for p in PLANS[:2] for t in (1e-2, 1e-3, 1e-4)),
    *({"plan": "Hertz", "tolerance": t, "margin": m} for m in (1.05, 1.1, 1.25)
      for t in (1e-2, 1e-4)),
]  # fmt: skip
# bempp-cl: constants or linear functions up to the edge, on meshes graded to it, of which the
# quadratic law was best, regular or irregular; the default quadrature, and one that goes on
# converging where that stops. It solves no contact problems.
MESHES = (20, 40, 80, 160, 320, 640, 1280)
GALERKIN = [
    {"plan": plan, "mesh": mesh, "kind": kind, "order": order}
    for plan in PLANS[:2]
    for mesh, kind, order in (
        ("quadratic", "DP0", 4),
        ("generated quadratic", "DP0", 4),
        ("quadratic", "P1", 4),
        ("generated quadratic", "P1", 4),
        ("quadratic", "P1", 6),
    )
]
# NGSolve: polynomials on quadrilaterals graded to the edge, of a higher degree with each layer of
# cells; products by a fast multipole method, on one thread and on two. The square only.
LAYERS = (2, 3, 4, 5)
SPECTRAL = [
    {"plan": "square", "threads": threads, "more": more}
    for threads in (1, THREADS)
    for more in (0, 3)
]
# Ours: all defaults; the mesh is for the user to choose. Regular meshes, as the others have them,
# uniform or drawn to the edge, and beside them irregular ones from grids.generate.
NODES = (*MESHES, 2560)
OURS = [
    *({"plan": plan, "kind": kind, "grid": grid} for plan in PLANS[:2]
      for kind in ("uniform", "sine") for grid in ("dual", "triangles")),
    *({"plan": "Hertz", "kind": "uniform", "grid": grid, "margin": m} for m in (1.1, 1.25)
      for grid in ("dual", "triangles")),
]  # fmt: skip
GENERATED = [s | {"kind": "generated"} for s in OURS if s["kind"] == "uniform"]


NAMES = ("skfem_dual", "bempp", "tamaas", "contactmechanics", "ngsolve")


@dataclass(frozen=True)
class Method:
    """One row of the tables: which process, with which settings and sizes."""

    name: str
    process: str
    settings: list[dict]
    sizes: tuple[int, ...]


METHODS = (
    Method("Tamaas", "tamaas", REGULAR, GRIDS),
    Method("ContactMechanics", "contactmechanics", REGULAR, GRIDS),
    Method("bempp-cl", "bempp", GALERKIN, MESHES),
    Method("NGSolve, hp", "ngsolve", SPECTRAL, LAYERS),
    Method("ours", "skfem_dual", OURS, NODES),
    Method("ours, generated", "skfem_dual", GENERATED, NODES),
)
OWN = ("ours", "ours, generated")


@dataclass(frozen=True)
class Run:
    """Cells or points, relative error, seconds for the mesh and in all, threads at work."""

    cells: int
    error: float
    mesh: float
    seconds: float
    parallel: float


class Process:
    """A package that answers questions, see peer_common.serve."""

    def __init__(self, name: str, python: str, errors):
        threads = {
            f"{pool}_NUM_THREADS": str(THREADS) for pool in ("OMP", "OPENBLAS", "MKL", "NUMBA")
        }
        self.name, self.errors = name, errors
        self.popen = subprocess.Popen(
            [python, "-W", "ignore", str(FOLDER / f"peer_{name}.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=os.environ | threads,
        )

    def ask(self, task: str, repeat: float = 0.0, **question) -> dict:
        """Ask and wait for the answer, the best of what can be repeated in so many seconds."""
        question |= {"task": task, "repeat": repeat}
        print(json.dumps(question), file=self.popen.stdin, flush=True)
        return self.answer()

    def answer(self) -> dict:
        """The next answer; what packages print themselves, before the first, is skipped."""
        for line in self.popen.stdout:
            try:
                return json.loads(line)
            except json.JSONDecodeError:
                continue
        self.errors.seek(0)
        raise RuntimeError(self.errors.read().strip() or "the process ended without a word")

    def close(self) -> None:
        self.popen.stdin.close()
        self.popen.stdout.close()
        self.popen.wait()


@contextmanager
def processes(python: str, names: tuple[str, ...] = NAMES) -> Iterator[dict[str, Process]]:
    """Those packages that are installed; prints which are not."""
    with ExitStack() as stack:
        found = {}
        for name in names:
            errors = stack.enter_context(tempfile.TemporaryFile("w+"))
            process = Process(name, sys.executable if name == "skfem_dual" else python, errors)
            stack.callback(process.close)
            try:
                process.answer()
            except RuntimeError as error:
                reason = str(error).splitlines()[-1]
                if name == "skfem_dual" or not reason.startswith("ModuleNotFoundError"):
                    raise
                print(f"{name}: skipped, {reason} in {python}; pip install skfem-dual[bench]")
                continue
            found[name] = process
        yield found


def assembly(found: dict[str, Process], folder: Path, sizes, rounds: int, repeat: float) -> dict:
    """Print the table; return {(triangles, what): seconds}."""
    print(
        "\n1. Dense matrix of 1/r on the triangles of a disc, nanoseconds an entry"
        "\n   bempp-cl: Galerkin by quadrature, more accurate for a number of unknowns than "
        "collocation."
        "\n   ours: settlement of centroids under edge-weighted cells; exact; as operators have "
        "it, with the"
        "\n   weights of the cells and a check of the error of rows; of these the entries alone"
    )
    names = ["exact", "operator", "entries", "Galerkin"]
    print(
        f"{'triangles':>10}{'bempp-cl':>10}"
        + "".join(f"{name:>10}{'ratio':>8}" for name in names[:3])
        + f"{'row error':>11}{'threads':>22}"
    )
    askable = [found[name] for name in ("skfem_dual", "bempp") if name in found]
    times = {}
    for n in (20, *sizes):
        path = str(folder / "assembly.npz")
        found["skfem_dual"].ask("mesh", plan="disc", n=n // 2, kind="uniform", path=path)
        answers = {p.name: [] for p in askable}
        for p in askable * rounds:
            answers[p.name].append(p.ask("assembly", 10 * repeat, mesh=path))
        if n == 20:  # compiles
            continue
        own = answers["skfem_dual"][0]
        every = [answer for given in answers.values() for answer in given]
        least = {
            name: min(
                (a["seconds"][name] for a in every if name in a["seconds"]), default=float("nan")
            )
            for name in names
        }
        rates = [seconds / own["cells"] ** 2 * 1e9 for seconds in least.values()]
        threads = ", ".join(
            f"{name[:5]} {max(a['parallel'] for a in given):.1f}"
            for name, given in answers.items()
        )
        print(
            f"{own['cells']:>10}{rates[3]:>10.1f}"
            + "".join(f"{rate:>10.2f}{rates[3] / rate:>8.1f}" for rate in rates[:3])
            + f"{own['error']:>11.1e}{threads:>22}",
            flush=True,
        )
        times |= {(own["cells"], name): seconds for name, seconds in least.items()}
    return times


def measure(
    found: dict[str, Process], folder: Path, limit: float, rounds: int, repeat: float, most: int
) -> dict:
    """All methods in turn: {(plan, method): {setting: [runs by size]}}.

    Sizes, of which the first ``most`` are tried, grow until one takes longer than the limit.
    """
    everything: dict = {}
    for current in range(rounds):
        for method in METHODS:
            if method.process not in found:
                continue
            for setting in method.settings:
                key, choice = (setting["plan"], method.name), _describe(setting)
                runs = everything.setdefault(key, {}).setdefault(choice, [])
                for i, n in enumerate(method.sizes[:most]):
                    if current and (i >= len(runs) or runs[i].seconds > 0.2 * limit):
                        break
                    if i == 0:
                        _run(found, method, setting, n, folder, 0.0)  # not timed
                    run = _run(found, method, setting, n, folder, repeat)
                    if current:
                        runs[i] = min(runs[i], run, key=lambda r: r.seconds)
                        continue
                    runs.append(run)
                    if run.seconds > limit:
                        break
    return everything


def _run(found, method: Method, setting: dict, n: int, folder: Path, repeat: float) -> Run:
    setting, mesh = dict(setting), 0.0
    if kind := setting.get("mesh"):  # is made by us
        setting["mesh"] = str(folder / "mesh.npz")
        mesh = found["skfem_dual"].ask(
            "mesh", repeat, plan=setting["plan"], n=n, kind=kind, path=setting["mesh"]
        )["seconds"]
    answer = found[method.process].ask("contact", repeat, n=n, **setting)
    return Run(
        answer["cells"],
        answer["error"],
        mesh + answer["mesh"],
        mesh + answer["seconds"],
        answer["parallel"],
    )


def _describe(setting: dict) -> str:
    return ", ".join(f"{v}" if isinstance(v, str) else f"{k} {v:g}" for k, v in setting.items()
                     if k != "plan" and (k, v) != ("margin", 1.0))  # fmt: skip


def reached(runs: list[Run], goal: float) -> Run | None:
    """The quickest of the sizes from which on all are within the goal, if two or more are."""
    late = next((i for i in range(len(runs), 0, -1) if abs(runs[i - 1].error) >= goal), 0)
    return min(runs[late:], key=lambda run: run.seconds) if len(runs) > late + 1 else None


def quickest(settings: dict[str, list[Run]], goal: float) -> tuple[Run, str] | None:
    """The setting that reaches the goal soonest."""
    able = [(r, name) for name, runs in settings.items() if (r := reached(runs, goal))]
    return min(able, key=lambda pair: pair[0].seconds, default=None)


def print_contact(everything: dict) -> None:
    """Table 2: of each method the setting that is best at 0.1 %, else the most accurate."""
    print("\n2. Unilateral contact: cells or points, error of the settlement, milliseconds")
    print("   (bempp-cl and NGSolve find no contact: flat punches that stay in contact)")
    for (plan, name), settings in sorted(everything.items(), key=lambda pair: pair[0][0]):
        best = quickest(settings, 1e-3)
        choice = best[1] if best else min(settings, key=lambda c: abs(settings[c][-1].error))
        runs = settings[choice]
        print(f"{plan:<8}{name:<18}{choice}; threads {max(r.parallel for r in runs):.1f}")
        for first in range(0, len(runs), 5):
            print(" " * 8 + "".join(
                f"{r.cells:>8} {r.error:+.1e}{r.seconds * 1e3:>7.1f}"
                for r in runs[first : first + 5]
            ))  # fmt: skip


def print_accuracy(everything: dict) -> dict[tuple[str, str, float], tuple[float, str]]:
    """Table 3; return {(plan, method, goal): (seconds, setting)} of what was reached."""
    print("\n3. Milliseconds to accuracy, and those for the mesh in them; cells or points")
    print(f"{'':<26}" + "".join(f"{g:>26.2%}" for g in GOALS))
    seconds = {}
    for (plan, name), settings in sorted(everything.items(), key=lambda pair: pair[0][0]):
        cells = []
        for goal in GOALS:
            if best := quickest(settings, goal):
                run = best[0]
                seconds[plan, name, goal] = run.seconds, best[1]
                cells.append(f"{run.seconds * 1e3:.1f} ({run.mesh * 1e3:.1f}), {run.cells}")
            else:
                last = min((runs[-1] for runs in settings.values()), key=lambda r: abs(r.error))
                cells.append(f"no: {abs(last.error):.0e} at {last.seconds * 1e3:.0f}")
        print(f"{plan:<8}{name:<18}" + "".join(f"{c:>26}" for c in cells))
    print("   no: the most accurate of the largest sizes tried, and its milliseconds")
    return seconds


def print_ratios(seconds: dict[tuple[str, str, float], tuple[float, str]]) -> None:
    """What was aimed at, measured, with the meshes of both."""
    print("\nTime of the best peer over ours, and the meshes and settings of both")
    for plan in PLANS:
        for goal in GOALS:
            peers = {
                name: t
                for (p, name, g), t in seconds.items()
                if (p, g) == (plan, goal) and name not in OWN
            }
            best = min(peers, key=peers.__getitem__, default="no peer")
            for name in OWN:
                if own := seconds.get((plan, name, goal)):
                    ratio = f" {peers[best][0] / own[0]:.2g} ({peers[best][1]})" if peers else ""
                    print(
                        f"{plan:<8}{goal:>6.2%}  {name:<16}{own[0] * 1e3:>8.1f} ms ({own[1]}); "
                        f"{best}{ratio}"
                    )
    print(
        "Aims: flat punches to 0.1 % at least 5, to 0.01 % in less than 300 ms; the sphere to "
        "0.1 % at least\n1/3 of Tamaas. Smooth contact on a regular grid is the home ground of "
        "methods by Fourier transforms,\nas Tamaas and ContactMechanics are."
    )


def main(
    python: str = sys.executable,
    sizes: tuple[int, ...] = (1000, 4000, 8000),
    limit: float = 3.0,
    rounds: int = 2,
    repeat: float = 0.3,
    most: int = 99,
) -> tuple[dict, dict, dict]:
    """Print all tables; return the numbers of the first, all runs, and the times to accuracy."""
    with tempfile.TemporaryDirectory() as name, processes(python) as found:
        folder = Path(name)
        print(f"{THREADS} threads for each; threads: processor time over time")
        times = assembly(found, folder, sizes, rounds, repeat)
        everything = measure(found, folder, limit, rounds, repeat, most)
    print_contact(everything)
    seconds = print_accuracy(everything)
    print_ratios(seconds)
    return times, everything, seconds


if __name__ == "__main__":
    warn_beside_other_work()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--python", default=sys.executable, help="of an environment with peers")
    options = parser.parse_args()
    if options.quick:
        main(options.python, sizes=(1000,), limit=0.5, rounds=1, repeat=0.1)
    else:
        main(options.python)
