"""The Postprocessor: couples of solutions before and after, error estimates, a million nodes.

    python benchmarks/postprocess.py            a minute
    python benchmarks/postprocess.py --all      all plans and grids, more than half an hour
    python benchmarks/postprocess.py --small    small grids only

Pressures are compared by their means over the cells of both grids: those of a solution, by the
pressure inside its cells, with those of the new field. Errors are root mean squares, weighted by
area, over all cells and over those farther than 0.1 from the edge, relative to the pressure, or
to 0.3 of the mean pressure where that is more. True means under full contact of discs and
ellipses on homogeneous ground are exact, their loads follow from integrals around the cells;
others are those of edge-weighted dual cells of the mesh with each triangle cut in sixteen.
"""

import argparse
import resource
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from eight_plans import PLANS, make
from quiet import warn_beside_other_work
from skfem import CellBasis, ElementTriP0, MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, RigidPunch
from skfem_dual.grids.generate import disc
from skfem_dual.grids.outline import distance_to_segments
from skfem_dual.post.estimate import estimate_error
from skfem_dual.post.functional import CoupleFunctional, Neighbours, Weights
from skfem_dual.post.postprocess import postprocess

SOIL = HalfSpace(1.0, 0.0)
STEEP = GradedHalfSpace.init_linear(1.0, 0.25, 5.0)
NODE = {"edge": "constant", "collocation": "node"}
CENTROID = {"edge": "constant"}
#: options of the punches on dual cells and on triangles
COUPLES = {
    "node": (NODE, CENTROID),
    "centroid": (CENTROID, CENTROID),
    "weighted": ({}, {}),
    "node, weighted": (NODE, {}),
    "weighted, centroid": ({}, CENTROID),
}
#: plan, eccentricity of the force along x, kind of mesh
PLANS_AND_LOADS = (("disc", 0.0), ("disc", 0.15), ("disc", 0.3), ("ellipse", 0.0))
KINDS = ("uniform", "random", "sine", "quadratic", "adaptive")
CASES = (
    *((plan, e, kind) for plan, e in PLANS_AND_LOADS for kind in KINDS),
    ("generated disc", 0.15, "uniform"),
    ("generated disc", 0.15, "graded"),
)
CORNERS = tuple(
    (plan, e, kind)
    for plan in ("square", "rectangle", "L-shape", "annulus")
    for kind in ("uniform", "sine", "quadratic")
    for e in (0.0, 0.15)
)
#: of the first by default
SOME = tuple((plan, e, kind) for plan, e, kind in CASES if e < 0.3 and kind in ("uniform", "sine"))
#: beyond the kern
LIFTED = tuple(("disc", e, kind) for e in (0.5, 0.7) for kind in ("uniform", "sine"))


def cell_means(partition, e: float, ratio: float) -> np.ndarray:
    """Exact mean pressure on cells under a unit force at (e, 0); semiaxes 1 and ``ratio``.

    The load of a cell is the integral around it of ``g(r, theta) d theta``, where g is the
    integral of p r from the centre outward. Ribs of the edge lie on the true edge.
    """
    s, weight = np.polynomial.legendre.leggauss(24)
    s, weight = (s + 1) / 2, weight / 2
    place, weight = s**2 * (3 - 2 * s), weight * 6 * s * (1 - s)  # dense at both ends
    p = partition.polygons.p / np.array([[1.0], [ratio]])
    a, b = p[:, partition.facets].swapaxes(0, 1)
    edge = partition.f2c[1] < 0
    x = a[:, :, None] + (b - a)[:, :, None] * place
    r = np.hypot(*x)
    turn = (a[0] * b[1] - a[1] * b[0])[:, None] / r**2 * weight
    cosine = x[0] / r
    r = np.where(edge[:, None], 1.0, r.clip(max=1.0))
    q = np.sqrt(1 - r**2)
    g = (1 - q) + 3 * e * cosine * (np.arcsin(r) - r * q) / 2
    around = np.sum(g * turn, axis=1) / (2 * np.pi)
    load = np.bincount(partition.f2c[0], around, len(partition))
    inner = ~edge
    load -= np.bincount(partition.f2c[1, inner], around[inner], len(partition))
    return load / partition.areas


def means(solution, dual: DualMesh) -> np.ndarray:
    """Mean pressures over dual cells and triangles, by the pressure inside the cells."""
    load = solution.load_vector(CellBasis(dual.refinement, ElementTriP0()))
    element = np.arange(len(load)) // 6
    on_cells, on_triangles = np.bincount(dual.refinement_cells, load), np.bincount(element, load)
    return np.concatenate(
        [on_cells / dual.partition.areas, on_triangles / dual.primal_partition.areas]
    )


@dataclass(frozen=True)
class Case:
    """A plan and the exact pressures on both of its grids."""

    dual: DualMesh
    e: float
    soil: HalfSpace | GradedHalfSpace
    exact: np.ndarray
    areas: np.ndarray
    far: np.ndarray

    @classmethod
    def of(cls, plan: str, e: float, kind: str, n: int, soil=None) -> "Case":
        """On a ground; without, exact under a disc or an ellipse on ``SOIL`` in full contact."""
        if plan == "generated disc":
            mesh = disc(n=n, graded=0.3 if kind == "graded" else None)
        else:
            mesh = make(plan, kind, n)
        dual = DualMesh.from_mesh(mesh)
        grids = dual.partition, dual.primal_partition
        ends = mesh.p[:, mesh.facets[:, mesh.f2t[1] == -1]].swapaxes(0, 1)
        centroids = np.hstack([grid.centroids for grid in grids])
        if soil is None:
            ratio = 0.5 if plan == "ellipse" else 1.0
            exact = np.concatenate([cell_means(grid, e, ratio) for grid in grids])
        else:
            fine = DualMesh.from_mesh(mesh.refined(2)).basis()
            centre = grids[0].centroids @ grids[0].areas / grids[0].areas.sum()
            exact = means(RigidPunch(soil, fine).solve(1.0, centre + np.array([e, 0.0])), dual)
        areas = np.concatenate([grid.areas for grid in grids])
        far = distance_to_segments(centroids, *ends) > 0.1
        return cls(dual, e, soil or SOIL, exact, areas, far)

    def solutions(self, couple: str):
        """Of both punches."""
        grid, bases = self.dual.partition, (self.dual.basis(), self.dual.primal_basis())
        centre = grid.centroids @ grid.areas / grid.areas.sum()
        return [
            RigidPunch(self.soil, basis, **options).solve(1.0, centre + np.array([self.e, 0.0]))
            for basis, options in zip(bases, COUPLES[couple], strict=True)
        ]

    def errors(self, pressures) -> np.ndarray:
        """Relative errors, rows: dual cells, triangles, both; columns: away from the edge, all."""
        n = len(self.dual)
        least = 0.3 * (self.exact @ self.areas) / self.areas.sum()
        square = ((pressures - self.exact) / np.maximum(self.exact, least)) ** 2
        first = np.arange(len(square)) < n
        return np.array(
            [
                [
                    np.sqrt(np.average(square[part & where], weights=self.areas[part & where]))
                    for where in (self.far, np.ones_like(self.far))
                ]
                for part in (first, ~first, np.ones_like(first))
            ]
        )


def couples(n: int = 600, cases=CASES, names=tuple(COUPLES), soil=SOIL) -> dict:
    """Print the errors before and after; return {(case, couple): (dual, triangles, after)}."""
    print(f"\nErrors of pressures on {soil or SOIL}, about {n} dual cells:")
    print("away from the edge / overall")
    columns = ("dual cells", "triangles", "both", "over the better")
    print(f"{'plan':<15}{'e':<6}{'mesh':<11}{'couple':<20}" + "".join(f"{c:<18}" for c in columns))
    found = {}
    for plan, e, kind in cases:
        case = Case.of(plan, e, kind, n, soil)
        for name in names:
            solutions = case.solutions(name)
            new = postprocess(*solutions)
            pressures = [means(s, case.dual) for s in solutions]
            pressures.append(np.concatenate([new.on_cells, new.on_triangles]))
            rows = np.array([case.errors(p)[2] for p in pressures])
            found[(plan, e, kind), name] = rows
            ratio = rows[2] / rows[:2].min(axis=0)
            cells = "".join(f"{f'{a:.1e} / {b:.1e}':<18}" for a, b in rows)
            cells += f"{ratio[0]:.2f} / {ratio[1]:.2f}"
            print(f"{plan:<15}{e:<6}{kind:<11}{name:<20}{cells}", flush=True)
    print("\nRatios, median (worst): away from the edge / overall")
    for name in names:
        ratios = np.array([r[2] / r[:2].min(axis=0) for (_, c), r in found.items() if c == name])
        middle, worst = np.median(ratios, axis=0), ratios.max(axis=0)
        text = " / ".join(f"{m:.2f} ({w:.2f})" for m, w in zip(middle, worst, strict=True))
        print(f"  {name:<20}{text}")
    return found


def estimates(
    sizes=(150, 600), plans=("disc", "square", "L-shape", "annulus", "rectangle")
) -> dict:
    """Print brackets and effectivities; return {(plan, kind, n): (errors, effectivity)}."""
    print("\nSettlement, central force: relative errors of the bracket's ends and of the mixture;")
    print("effectivity: indicator over the root of the energy P |W - W exact| of the triangles")
    print(
        f"{'plan':<12}{'mesh':<11}{'cells':<8}{'below':<11}{'above':<11}{'mixed':<11}effectivity"
    )
    found = {}
    for plan in plans:
        for kind in ("uniform", "random", "sine", "adaptive"):
            for n in sizes:
                dual = DualMesh.from_mesh(make(plan, kind, n))
                below = RigidPunch(SOIL, dual.basis(), **NODE)
                above = RigidPunch(SOIL, dual.primal_basis(), **CENTROID)
                estimate = estimate_error(below.solve(1.0), above.solve(1.0))
                exact = 1 / PLANS[plan].stiffness[0]
                values = np.append(estimate.settlement, estimate.mixed_settlement)
                effectivity = estimate.total / np.sqrt(abs(values[1] - exact))
                found[plan, kind, n] = values / exact - 1, effectivity
                errors = "".join(f"{e:<+11.1e}" for e in values / exact - 1)
                print(f"{plan:<12}{kind:<11}{len(dual):<8}{errors}{effectivity:.2f}", flush=True)
    return found


def large(sizes=(10_000, 100_000, 1_000_000)) -> dict[int, tuple[float, ...]]:
    """Print seconds and memory for grids of about so many nodes, those of both counted."""
    print("\nMinimum of the functional, W1 = 16, W2 = 256, square: seconds")
    print(f"{'unknowns':<10}{'neighbours':<12}{'matrix':<9}{'first':<9}{'second':<9}peak MB")
    found = {}
    for n in sizes:
        lines = np.linspace(0, 1, round(np.sqrt(n / 3)) + 1)
        dual = DualMesh.from_mesh(MeshTri.init_tensor(lines, lines))
        seconds = [perf_counter()]
        neighbours = Neighbours.of(dual)
        seconds.append(perf_counter())
        functional = CoupleFunctional(neighbours, Weights.init_paper(16, 256))
        unknowns = functional.matrix.shape[0]
        seconds.append(perf_counter())
        rng = np.random.default_rng(0)
        for _ in range(2):
            functional.minimise(*(rng.uniform(-1, 1, k) for k in neighbours.alpha.shape))
            seconds.append(perf_counter())
        found[unknowns] = tuple(np.diff(seconds))
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        times = "".join(f"{s:<9.2f}" for s in found[unknowns][1:])
        print(f"{unknowns:<10}{found[unknowns][0]:<12.2f}{times}{peak:.0f}", flush=True)
    return found


if __name__ == "__main__":
    warn_beside_other_work()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--all", action="store_true")
    options, three = parser.parse_args(), ("node", "centroid", "weighted")
    if options.small:
        couples(150, CASES[:3])
        estimates((150,))
        large((10_000,))
    elif options.all:
        couples()
        for size in (200, 600):
            couples(size, CORNERS, three)
        couples(200, CORNERS[::2], three, STEEP)
        couples(600, LIFTED, three)
        estimates()
        large()
    else:
        couples(600, SOME, three)
        couples(150, CORNERS[::4], three)
        couples(150, CORNERS[::12], three, STEEP)
        couples(150, LIFTED[::2], three)
        estimates((150, 600), ("disc", "square", "L-shape"))
        large((10_000, 100_000))
