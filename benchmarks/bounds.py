"""How often the exact settlement and tilt lie within the bounds of a solution, how wide these are.

    python benchmarks/bounds.py [--cases 500] [--seed 0] [--workers 2] [--file FILE]

Plans, meshes of 100 to 300 dual cells, grounds and loads are drawn at random; a third of the
loads lift the punch off. The exact position is that on a far finer mesh. Medians of widths and
errors are over the size of the quantity. With a file an interrupted run goes on where it ended.
"""

import argparse
import warnings
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
    sweep,
)
from skfem_dual.grids.generate import annulus, disc, polygon, rectangle

FINE, FINE_LIFTED = 1300, 2600
QUANTITIES = "settlement", "tilt Lx", "tilt Ly"


@dataclass(frozen=True)
class Case:
    """A random problem; every choice follows from its number.

    Attributes
    ----------
    number, seed : int
    fine : int or None
        Nodes of the mesh for the exact position; by default as many as are needed.
    """

    number: int
    seed: int = 0
    fine: int | None = None

    @property
    def random(self) -> np.random.Generator:
        return np.random.default_rng([self.seed, self.number])


@dataclass(frozen=True)
class Found:
    """What was found in a case.

    Attributes
    ----------
    what : str
        Plan, mesh, ground, whether the punch lifts off.
    groups : tuple of str
        Those of the table to which it belongs.
    exact, low, high, found, scale : (3,) array of float
        Settlement under the force, Lx and Ly: exact, bounds, of the solution, their size.
    """

    what: str
    groups: tuple[str, ...]
    exact: ndarray
    low: ndarray
    high: ndarray
    found: ndarray
    scale: ndarray

    @property
    def holds(self) -> ndarray:
        """Whether the exact value lies within the bounds, (3,)."""
        return (self.low <= self.exact) & (self.exact <= self.high)


def star(random: np.random.Generator) -> ndarray:
    """Corners of a polygon without sharp angles."""
    k = random.integers(5, 9)
    angle = 2 * np.pi * (np.arange(k) + random.uniform(-0.15, 0.15, k)) / k
    return random.uniform(0.7, 1.0, k) * np.stack([np.cos(angle), np.sin(angle)])


def plan(random: np.random.Generator):
    """Name of a plan and a function that triangulates it."""
    name = random.choice(["disc", "ellipse", "annulus", "rectangle", "L", "star"])
    if name == "disc":
        return name, disc
    if name == "ellipse":
        ratio = random.uniform(0.4, 0.9)

        def ellipse(**options) -> MeshTri:
            mesh = disc(**options)
            return MeshTri(mesh.p * np.array([[1.0], [ratio]]), mesh.t)

        return name, ellipse
    if name == "annulus":
        inner = random.uniform(0.2, 0.7)
        return name, lambda **options: annulus(inner, **options)
    if name == "rectangle":
        height = random.uniform(0.6, 2.0)
        return name, lambda **options: rectangle(2.0, height, **options)
    if name == "L":
        a, b = random.uniform(0.6, 1.4, 2)
        corners = np.array([[0, 2, 2, a, a, 0], [0, 0, b, b, 2, 2]]) - 1.0
        return name, lambda **options: polygon(corners, **options)
    corners = star(random)
    return name, lambda **options: polygon(corners, **options)


def ground(random: np.random.Generator):
    """Name of a kind of ground, and one of it."""
    kind = random.choice(["homogeneous", "graded", "layer"], p=[0.6, 0.2, 0.2])
    nu = random.uniform(0.0, 0.5)
    if kind == "homogeneous":
        return kind, HalfSpace(1.0, nu)
    if kind == "graded":
        return kind, GradedHalfSpace.init_linear(1.0, nu, random.uniform(0.3, 5.0))
    base = "bonded" if random.random() < 0.5 else HalfSpace(random.uniform(0.2, 5.0), 0.3)
    layer = Layer(random.uniform(0.4, 1.5), 1.0, random.uniform(0.0, 0.45))
    return kind, LayeredHalfSpace([layer], base)


def shaken(mesh: MeshTri, random: np.random.Generator) -> MeshTri:
    """Inner nodes moved by a tenth of the facets; as it was if that has no valid dual grid."""
    p, inner = mesh.p.copy(), mesh.interior_nodes()
    a, b = mesh.p[:, mesh.facets].swapaxes(0, 1)
    step = 0.1 * np.median(np.hypot(*(b - a)))
    p[:, inner] += random.uniform(-step, step, (2, len(inner)))
    return MeshTri(p, mesh.t)


def solved(soil, mesh, grid: str, origin, at):
    dual = DualMesh.from_mesh(mesh)
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    return RigidPunch(soil, basis, origin=origin).solve(1.0, at=at)


def measure(case: Case) -> Found:
    """Bounds and exact position of a case."""
    random = case.random
    (name, make), (kind, soil) = plan(random), ground(random)
    grid = str(random.choice(["dual", "triangles"], p=[0.75, 0.25]))
    n = int(random.integers(100, 300))
    mesh_kind = str(random.choice(["uniform", "graded", "shaken"]))
    mesh = make(
        n=n if grid == "dual" else n // 2 + 20, graded=0.3 if mesh_kind == "graded" else None
    )
    if mesh_kind == "shaken":
        mesh = shaken(mesh, random)
    lifted = random.random() < 1 / 3
    angle, share = (
        random.uniform(0, 2 * np.pi),
        random.uniform(0.35, 0.6) if lifted else random.uniform(0, 0.2),
    )
    half = np.ptp(mesh.p, axis=1) / 2
    at = share * half * np.array([np.cos(angle), np.sin(angle)])
    origin = tuple(RigidPunch(soil, DualMesh.from_mesh(mesh).basis()).centre.tolist())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        answer = solved(soil, mesh, grid, origin, at)
        lifts = not (answer.pressure > 0).all()
        fine = case.fine or (FINE_LIFTED if lifts else FINE)
        exact = solved(soil, make(n=fine, graded=0.5 if lifts else 0.15), "dual", origin, at)
        bounds = answer.bounds
    to_point = np.array([[1.0, *at], [0, 1, 0], [0, 0, 1]])
    true, found = (to_point @ np.array([s.settlement, *s.tilt]) for s in (exact, answer))
    size = np.sqrt(answer.punch.partition.areas.sum())
    scale = np.array([true[0], *[max(np.abs(true[1:]).max(), true[0] / size)] * 2])
    low, high = np.vstack([bounds.settlement, bounds.tilt]).T
    groups = (grid, "lifted off" if lifts else "full contact", kind)
    what = f"{case.number}: {name}, {mesh_kind}, n {len(answer.pressure)}, {', '.join(groups)}"
    return Found(what, groups, true, low, high, found, scale)


def table(found: list[Found]) -> str:
    """Share of cases within the bounds, and their widths, by groups."""
    names = ["all", *sorted({name for one in found for name in one.groups})]
    rows = [
        f"{'':<14}{'cases':>6}  " + "".join(f"{q:<34}" for q in QUANTITIES),
        f"{'':<22}" + f"{'within':<9}{'half width':<12}{'over error':<13}" * 3,
    ]
    for name in names:
        some = [one for one in found if name == "all" or name in one.groups]
        holds = np.mean([one.holds for one in some], axis=0)
        half = np.median([(one.high - one.low) / 2 / one.scale for one in some], axis=0)
        error = np.median([abs(one.found - one.exact) / one.scale for one in some], axis=0)
        parts = zip(holds, half, half / error, strict=True)
        cells = "".join(f"{f'{h:.1%}':<9}{w:<12.1e}{r:<13.1f}" for h, w, r in parts)
        rows.append(f"{name:<14}{len(some):>6}  {cells}")
    for one in found:
        if not one.holds.all():
            beyond = np.maximum(one.low - one.exact, one.exact - one.high).clip(0) / one.scale
            rows.append(f"missed by {np.round(beyond, 7)} in {one.what}")
    return "\n".join(rows)


def main(cases=500, seed=0, workers=None, file=None, fine=None) -> list[Found]:
    """Print the table."""
    chosen = [Case(number, seed, fine) for number in range(cases)]
    result = sweep(measure, chosen, executor=workers, file=file)
    found = [one for one in result.results if one is not None]
    print(table(found))
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--file")
    options = parser.parse_args()
    main(options.cases, options.seed, options.workers, options.file)
