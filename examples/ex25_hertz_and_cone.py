"""Sphere and cone on a half-space: a contact that is found, against the exact solutions.

Hertz: a^3 = 3 P R / (4 E*), settlement a^2 / R, pressure p0 sqrt(1 - r^2 / a^2); the cone has
P = pi a^2 E* tan(angle) / 2, settlement pi a tan(angle) / 2 and a logarithmic peak at its tip. The
dual cells are irregular and follow no circle of contact. Refining the mesh where contact ends
sharpens the radius, but not settlement and pressure in the middle.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch, check_mesh
from skfem_dual.bodies.refine import refine_to_contact
from skfem_dual.contact import exact
from skfem_dual.contact.shapes import Cone, Paraboloid
from skfem_dual.grids.generate import rectangle

SOIL = HalfSpace(young=1.0, poisson=0.25)
#: half the side of the square plan, which the contact of radius 1 does not fill
HALF = 1.2
RADIUS, ANGLE = 4.0, 0.3
SHAPES = {"sphere": (Paraboloid(RADIUS), RADIUS), "cone": (Cone(ANGLE), ANGLE)}


@dataclass(frozen=True)
class Result:
    """Solutions of both shapes on finer and finer meshes, all over or only where contact ends."""

    everywhere: dict[str, list[PunchSolution]]
    refined: dict[str, list[PunchSolution]]

    def __str__(self) -> str:
        rows = [f"{'shape':<9}{'mesh':<12}{'in contact':<12}{'of':<7}"]
        rows[0] += f"{'settlement':<13}{'radius':<13}peak, relative errors"
        for mesh, found in (("everywhere", self.everywhere), ("refined", self.refined)):
            for shape, solutions in found.items():
                for s in solutions:
                    counts = f"{len(s.contact):<12}{len(s.pressure):<7}"
                    values = "".join(f"{e:<+13.1e}" for e in errors(shape, s))
                    rows.append(f"{shape:<9}{mesh:<12}{counts}{values}".rstrip())
        return "\n".join(rows)


def force(shape: str) -> float:
    """For a contact of radius 1, from the solutions' proportions."""
    power = {"sphere": 3, "cone": 2}[shape]
    return known(shape, "radius", 1.0) ** -power


def known(shape: str, what: str, force: float, *x):
    """One of the exact solutions."""
    name = {"sphere": "hertz", "cone": "cone"}[shape]
    function = getattr(exact, f"{name}_{what}")
    return function(*x, force, SHAPES[shape][1], SOIL.young, SOIL.poisson)


def errors(shape: str, s: PunchSolution) -> list[float]:
    """Relative errors of settlement, radius and peak pressure, which is infinite for a cone."""
    p = force(shape)
    found = [s.settlement, np.sqrt(s.contact_area / np.pi)]
    right = [known(shape, "approach", p), known(shape, "radius", p)]
    if shape == "sphere":
        found.append(s.pressure.max())
        right.append(known(shape, "pressure", p, np.zeros(2)))
    return [a / b - 1 for a, b in zip(found, right, strict=True)]


def irregular(n: int) -> MeshTri:
    """A square with about n nodes, the inner ones moved at random."""
    mesh = rectangle(2 * HALF, 2 * HALF, n=n)
    inner, rng = mesh.interior_nodes(), np.random.default_rng(0)
    for size in 0.25 * 0.8 ** np.arange(10) * 2 * HALF / np.sqrt(n):
        p = mesh.p.copy()
        p[:, inner] += rng.uniform(-size, size, (2, len(inner)))
        if check_mesh(moved := MeshTri(p, mesh.t)).ok:
            return moved
    raise RuntimeError("no perturbed mesh has a dual grid")


def solve(shape: str, mesh: MeshTri, refinements: int = 0) -> list[PunchSolution]:
    """On a mesh, and on some refined from it to the edge of contact."""

    def make(mesh):
        return RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), gap=SHAPES[shape][0])

    return refine_to_contact(make, mesh, {"force": force(shape)}, refinements)


def main(cells=(125, 500, 4000), refinements=3) -> Result:
    """Solve with about so many cells in contact, and refine the coarsest mesh."""
    meshes = [irregular(round(n * 4 * HALF**2 / np.pi)) for n in cells]
    return Result(
        {shape: [solve(shape, mesh)[0] for mesh in meshes] for shape in SHAPES},
        {shape: solve(shape, meshes[0], refinements)[1:] for shape in SHAPES},
    )


def visualize(result: Result):
    """Pressures as columns, over the radius, and errors against the cells in contact."""
    pictures = {"sphere_cut_open": draw_columns(result.everywhere["sphere"][1])}
    pictures |= {shape: draw_pressures(result, shape) for shape in SHAPES}
    return pictures | {"errors": draw_errors(result)}


def draw_columns(s: PunchSolution):
    """Cells in contact behind y = 0."""
    from scenes import add, columns, shown, stage

    partition, p = s.punch.partition, s.pressure / s.mean_pressure
    points, t, cell = columns(partition.polygons, 0.6 * p)
    behind = (partition.centroids[1, cell] > 0) & (p[cell] > 0)
    plotter = stage()
    add(plotter, points, t[:, behind], scalars=p[cell][behind], clim=(0, 1.5), cmap="viridis")
    return shown(plotter, "p / mean p", limits=(0, 1.5), eye=(-0.5, -2, 0.9))


def draw_pressures(result: Result, shape: str):
    from skfem_dual.visuals.style import CONTACT, OUTLINE

    ax, s = chart(), result.everywhere[shape][1]
    mean = force(shape) / np.pi
    r = np.linspace(1e-3, 1.0, 300)
    line = known(shape, "pressure", force(shape), np.array([r, 0 * r])) / mean
    points = np.hypot(*s.punch.collocation_points), s.pressure / mean
    ax.plot(*points, ".", color=CONTACT, ms=7, label=f"{len(s.contact)} cells in contact")
    ax.plot(r, line, color=OUTLINE, lw=1.6, label="exact")
    ax.set_title(shape)
    ax.set_xlabel("r / a")
    ax.set_ylabel("p / mean p")
    ax.set_xlim(0, 1.2)
    ax.set_ylim(0, 1.1 * points[1].max())
    ax.legend(loc="upper right")
    return ax


def draw_errors(result: Result):
    """Of the sphere."""
    from matplotlib.ticker import NullFormatter

    from skfem_dual.visuals.curves import LINES

    ax = chart(3.9)
    for found, line in ((result.everywhere, "-o"), (result.refined, "--s")):
        solutions = found["sphere"]
        n = [len(s.contact) for s in solutions]
        values = np.abs([errors("sphere", s) for s in solutions]).T
        where = "" if found is result.everywhere else ", refined"
        for (color, _), name, e in zip(LINES, ("settlement", "radius", "peak"), values):
            ax.loglog(n, e, line, color=color, label=name + where)
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("cells in contact")
    ax.set_ylabel("relative error")
    legend_below(ax, handlelength=1.6, columnspacing=1)
    return ax


if __name__ == "__main__":
    run(main, visualize)
