"""Figure 14: 28 contact problems, on triangles and on dual cells.

The paper tells K_TV = N_T / N_V of 28 problems, 1.6 to 1.9 (its own grid of Table 1 has 216 / 145,
1.49), and the processor times on both grids, but not which problems they were. Here they are
discs, ellipses, rectangles, polygons, letters, crosses and plans with holes, on meshes near
uniform or graded to the edge, under central and eccentric forces that leave all of the punch in
contact: P = E a^2, nu = 1/4, a = 1.

The time is that of one thread for matrix, factors and solution with constant pressures, the least
of some repetitions; several threads would count their waiting for each other as well. Fewer
unknowns only count if the answer is as good. "The application of the dual grid instead of the
initial triangulation does not make the accuracy of the solution worse more than 5-10 %", says the
paper; so the table has the errors too, of the settlement of the point where the force acts, with
constant pressures and with edge-weighted cells. The reference is the settlement with edge-weighted
dual cells on a finer mesh graded to the edge.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from time import thread_time

import numba
import numpy as np
from gallery import chart, draw_plan, legend_below, panels, run
from skfem import CellBasis, MeshTri
from threadpoolctl import threadpool_limits

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.grids.generate import annulus, disc, polygon, rectangle

SOIL = HalfSpace(young=1.0, poisson=0.25)
#: grids by their names, and ways in which the pressure varies inside their cells
GRIDS, EDGES = ("triangles", "dual cells"), ("constant", "singular")


def ellipse(size: float, *, ratio: float, graded) -> MeshTri:
    """Semiaxes 1 and 1 / ratio."""
    mesh = disc(size * np.sqrt(ratio), graded=graded)
    return MeshTri(mesh.p * np.array([[1.0], [1 / ratio]]), mesh.t)


def regular(sides: int):
    """Corners of a regular polygon, one of them at the top."""
    angle = np.pi / 2 + 2 * np.pi * np.arange(sides) / sides
    return np.array([np.cos(angle), np.sin(angle)])


def box(x: float, y: float, width: float, height: float):
    """Corners of a rectangle with its centre at (x, y)."""
    return [
        [x - width / 2, x + width / 2, x + width / 2, x - width / 2],
        [y - height / 2, y - height / 2, y + height / 2, y + height / 2],
    ]


SQUARE = box(0, 0, 2, 2)
OUTLINES = {
    "right triangle": [[-1, 1, -1], [-1, -1, 1]],
    "trapezium": [[-1, 1, 0.5, -0.5], [-0.6, -0.6, 0.6, 0.6]],
    "rhombus": [[0, 1, 0, -1], [-0.6, 0, 0.6, 0]],
    "L": [[-1, 1, 1, 0, 0, -1], [-1, -1, 0, 0, 1, 1]],
    "T": [[-0.4, 0.4, 0.4, 1, 1, -1, -1, -0.4], [-1, -1, 0.3, 0.3, 1, 1, 0.3, 0.3]],
    "U": [[-1, 1, 1, 0.4, 0.4, -0.4, -0.4, -1], [-1, -1, 1, 1, -0.3, -0.3, 1, 1]],
    "Z": [[-0.35, 1, 1, 0.35, 0.35, -1, -1, -0.35], [-1, -1, -0.35, -0.35, 1, 1, 0.35, 0.35]],
    "H": [
        [-1, -0.4, -0.4, 0.4, 0.4, 1, 1, 0.4, 0.4, -0.4, -0.4, -1],
        [-1, -1, -0.3, -0.3, -1, -1, 1, 1, 0.3, 0.3, 1, 1],
    ],
    "plus": [
        [-0.5, 0.5, 0.5, 1, 1, 0.5, 0.5, -0.5, -0.5, -1, -1, -0.5],
        [-1, -1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5, -0.5, -0.5],
    ],
    "thin cross": [
        [-0.3, 0.3, 0.3, 1, 1, 0.3, 0.3, -0.3, -0.3, -1, -1, -0.3],
        [-1, -1, -0.3, -0.3, 0.3, 0.3, 1, 1, 0.3, 0.3, -0.3, -0.3],
    ],
}


@dataclass(frozen=True)
class Problem:
    """A plan, how its mesh is graded, and how far from its centroid the force acts."""

    plan: str
    mesh: Callable[..., MeshTri]
    graded: str | float | None = None
    eccentricity: tuple[float, float] = (0.0, 0.0)

    @property
    def kind(self) -> str:
        """Of the mesh."""
        return "uniform" if self.graded is None else f"graded {self.graded}"

    def size(self, n: int) -> float:
        """Length of the facets of a uniform mesh of about n nodes."""
        coarse = self.mesh(size=0.4, graded=None)
        area = np.abs(coarse.mapping().detA).sum() / 2
        edge = coarse.facets[:, coarse.boundary_facets()]
        perimeter = np.hypot(*np.diff(coarse.p[:, edge], axis=1)).sum()
        # nodes have 0.87 h^2 each, those on the boundary half of it: n = a / h^2 + b / h
        a, b = area / (np.sqrt(3) / 2), perimeter / 2
        return float((b + np.sqrt(b**2 + 4 * a * n)) / (2 * n))


def of_outline(plan: str, graded=None, eccentricity=(0.0, 0.0)) -> Problem:
    return Problem(plan, partial(polygon, OUTLINES[plan]), graded, eccentricity)


CIRCLE = disc
ECCENTRIC = partial(annulus, 0.3, hole=(0.3, 0.0))
PROBLEMS = (
    Problem("circle", CIRCLE),
    Problem("circle", CIRCLE, None, (0.2, 0.0)),
    Problem("circle", CIRCLE, "sine", (0.1, 0.1)),
    Problem("ellipse 2 : 1", partial(ellipse, ratio=2)),
    Problem("ellipse 3 : 1", partial(ellipse, ratio=3), 0.5, (0.2, 0.0)),
    Problem("square", rectangle),
    Problem("square", rectangle, None, (0.1, 0.15)),
    Problem("square", rectangle, "sine"),
    Problem("rectangle 2 : 1", partial(rectangle, 2.0, 1.0)),
    Problem("rectangle 4 : 1", partial(rectangle, 2.0, 0.5), None, (0.2, 0.0)),
    Problem("rectangle 3 : 2", partial(rectangle, 2.0, 4 / 3), 0.5, (0.0, 0.15)),
    Problem("triangle", partial(polygon, regular(3))),
    of_outline("right triangle", None, (0.05, 0.05)),
    of_outline("trapezium", None, (0.1, 0.0)),
    of_outline("rhombus"),
    Problem("hexagon", partial(polygon, regular(6))),
    Problem("octagon", partial(polygon, regular(8)), 0.5, (0.15, 0.0)),
    of_outline("L"),
    of_outline("L", 0.5, (0.1, 0.1)),
    of_outline("T", None, (0.0, 0.1)),
    of_outline("U"),
    of_outline("Z", None, (0.1, 0.0)),
    of_outline("H"),
    of_outline("plus"),
    of_outline("thin cross", None, (0.1, 0.0)),
    Problem("annulus", partial(annulus, 0.5), None, (0.2, 0.0)),
    Problem("eccentric annulus", ECCENTRIC),
    Problem("two windows", partial(polygon, SQUARE, [box(x, 0, 0.5, 1) for x in (-0.45, 0.45)])),
)

#: colours and markers of both grids
GRID_LOOKS = tuple(zip(GRIDS, ("#c8401f", "#2c6fbb"), "^h", strict=True))


@dataclass(frozen=True)
class Answer:
    """What is measured of a problem.

    ``seconds[grid]`` with constant pressures; ``error[grid, edge]`` of the settlement under the
    force, relative to ``reference``.
    """

    dual: DualMesh
    at: np.ndarray
    reference: float
    seconds: dict[str, float]
    error: dict[tuple[str, str], float]


@dataclass(frozen=True)
class Result:
    """An answer for each of the problems, by their numbers from 1."""

    answers: dict[int, Answer]

    @property
    def factors(self) -> np.ndarray:
        """K_TV."""
        return np.array([a.dual.K_TV for a in self.answers.values()])

    def seconds(self, grid: str) -> np.ndarray:
        """Times of one thread."""
        return np.array([a.seconds[grid] for a in self.answers.values()])

    def errors(self, grid: str, edge: str) -> np.ndarray:
        """Relative errors of the settlement under the force."""
        return np.array([a.error[grid, edge] for a in self.answers.values()])

    def __str__(self) -> str:
        head = f"{'':<19}{'':<13}{'force off':<13}{'cells':<11}{'':<6}{'time [ms]':<14}"
        lines = [
            f"{'':<4}{head}error, constant     error, edge-weighted",
            f"{'':<4}{'plan':<19}{'mesh':<13}{'the centroid':<13}{'N_T':<6}{'N_V':<5}{'K_TV':<6}"
            f"{'T':<7}{'V':<7}" + f"{'T':<10}{'V':<10}" * 2,
        ]
        for number, a in self.answers.items():
            problem = PROBLEMS[number - 1]
            x, y = problem.eccentricity
            times = "".join(f"{1e3 * a.seconds[grid]:<7.1f}" for grid in GRIDS)
            errors = "".join(f"{a.error[grid, e]:<+10.1e}" for e in EDGES for grid in GRIDS)
            lines.append(
                f"{number:<4}{problem.plan:<19}{problem.kind:<13}{f'({x:g}, {y:g})':<13}"
                f"{a.dual.mesh.nelements:<6}{len(a.dual):<5}{a.dual.K_TV:<6.2f}{times}{errors}"
            )
        k, t = self.factors, self.seconds("triangles") / self.seconds("dual cells")
        lines += [
            "",
            f"K_TV {k.min():.2f} to {k.max():.2f}, mean {k.mean():.2f}; paper 1.6 to 1.9",
            f"time T / time V {t.min():.1f} to {t.max():.1f}, median {np.median(t):.1f}; paper "
            "1.6 to 1.9; exponent of N "
            f"{np.median(np.log(t) / np.log(k)):.1f}",
        ]
        for edge, name in zip(EDGES, ("constant", "edge-weighted"), strict=True):
            T, V = (np.abs(self.errors(grid, edge)) for grid in GRIDS)
            lines.append(
                f"{name}: rms error {rms(T):.1e} on T, {rms(V):.1e} on V; error V / error T "
                f"median {np.median(V / T):.2f}, V worse by more than 10 % in "
                f"{np.count_nonzero(V > 1.1 * T)} of {len(T)}"
            )
        return "\n".join(lines)


def rms(x) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(x))))


def settlement(basis: CellBasis, at, edge: str) -> float:
    """Of the point where the force acts."""
    solution = RigidPunch(SOIL, basis, edge=edge).solve(1.0, tuple(at))
    if solution.message != "full contact":
        raise RuntimeError(f"expected full contact under a force at {at}, got {solution.message}")
    return float(solution.punch_displacement(at[:, None])[0])


def answer(problem: Problem, n: int, reference: int, repeat: int) -> Answer:
    """Solve on both grids, and on the finer mesh."""
    fine = DualMesh.from_mesh(problem.mesh(size=problem.size(reference), graded=0.5)).basis()
    areas, centroids = fine.partition.areas, fine.partition.centroids
    at = centroids @ areas / areas.sum() + problem.eccentricity
    exact = settlement(fine, at, "singular")
    dual = DualMesh.from_mesh(problem.mesh(size=problem.size(n), graded=problem.graded))
    bases = dict(zip(GRIDS, (dual.primal_basis(), dual.basis()), strict=True))
    error = {
        (grid, edge): settlement(basis, at, edge) / exact - 1
        for grid, basis in bases.items()
        for edge in EDGES
    }
    times: dict[str, list[float]] = {grid: [] for grid in GRIDS}
    with one_thread():
        for _ in range(repeat):  # in turn: other load on the machine meets both
            for grid, basis in bases.items():
                begin = thread_time()
                settlement(basis, at, "constant")
                times[grid].append(thread_time() - begin)
    seconds = {grid: min(found) for grid, found in times.items()}
    return Answer(dual, at, exact, seconds, error)


@contextmanager
def one_thread() -> Iterator[None]:
    """Let the calling thread do all the work, also that of linear algebra."""
    threads = numba.config.NUMBA_NUM_THREADS
    numba.config.NUMBA_NUM_THREADS = 1
    try:
        with threadpool_limits(1):
            yield
    finally:
        numba.config.NUMBA_NUM_THREADS = threads


def main(n=500, reference=1200, repeat=3, every=1) -> Result:
    """Solve problems 1, 1 + every, ... on meshes of about n nodes, references on finer ones.

    Meshes graded by a number, those of all references among them, have half as many again.
    """
    return Result(
        {
            number: answer(problem, n, reference, repeat)
            for number, problem in list(enumerate(PROBLEMS, 1))[::every]
        }
    )


def visualize(result: Result):
    """The plans; errors, times and K_TV of all problems."""
    return {
        "plans": draw_plans(result),
        "errors": draw_errors(result),
        "seconds": draw_seconds(result),
        "effectivity": draw_factors(result),
    }


def draw_plans(result: Result):
    """Each with its force."""
    from skfem_dual.visuals.style import OUTLINE

    axes = panels(4, 7, 3.0)
    for ax, (number, a) in zip(axes, result.answers.items(), strict=False):
        draw_plan(a.dual.mesh, ax)
        ax.plot(*a.at, "+", color=OUTLINE, ms=6, mew=1.3)
        ax.set_xlim(-1.05, 1.05)
        ax.set_ylim(-1.05, 1.05)
        ax.set_title(number, fontsize=9, pad=1)
    for ax in axes:
        ax.set_axis_off()
    return axes[0]


def draw_errors(result: Result):
    """Of constant pressures filled, of edge-weighted cells hollow."""
    ax, number = chart(3.8), np.array(list(result.answers))
    for grid, color, marker in GRID_LOOKS:
        for edge, name in zip(EDGES, ("constant", "edge-weighted"), strict=True):
            look = {"color": color, "ms": 6, "mfc": color if edge == EDGES[0] else "none"}
            e = np.abs(result.errors(grid, edge))
            ax.semilogy(number, e, marker, label=f"{grid}, {name}", **look)
    ax.set_ylabel("error of the settlement")
    ax.set_xlabel("problem")
    legend_below(ax, handletextpad=0.2, columnspacing=1)
    return ax


def draw_seconds(result: Result):
    ax, number = chart(), np.array(list(result.answers))
    for grid, color, marker in GRID_LOOKS:
        ax.plot(number, 1e3 * result.seconds(grid), f"{marker}-", color=color, lw=1.4, label=grid)
    ax.set_ylim(bottom=0)
    ax.set_xlabel("problem")
    ax.set_ylabel("time of one thread [ms]")
    ax.legend()
    return ax


def draw_factors(result: Result):
    from skfem_dual.visuals.style import LIGHT, PRIMAL

    ax, number = chart(2.6), np.array(list(result.answers))
    ax.axhspan(1.6, 1.9, color=LIGHT, lw=0, label="paper")
    ax.bar(number, result.factors, width=0.6, color=PRIMAL, label="ours")
    ax.set_ylim(1, 2.3)
    ax.set_xlabel("problem")
    ax.set_ylabel("$K_{TV} = N_T / N_V$")
    ax.legend(ncols=2, loc="upper right")
    return ax


if __name__ == "__main__":
    run(main, visualize)
