"""Figures 11 and 16: eccentric loads, lift-off, and the edge of contact that is no parabola.

A rigid circle under a force at 0.15 a from its centre, on a homogeneous half-space and on one with
E = E0 (1 + B z / h), B = 1, h / a = 1: the stiffer depth draws pressure away from the edge. Beyond
a / 3 the circle lifts off, here at 0.35 a and 0.5 a. The square is that of Fig. 16 on the graded
ground, P = E0 a^2 at (0.1 a, 0.15 a), and the same farther out, where it lifts off.

The edge of contact at 0.5 a is compared with the parabola x = c0 + c1 y^2 nearest to it. Meshes
refined to that edge show that they differ, most of all near the circle, as the paper says.
"""

import re
from dataclasses import dataclass

import numpy as np
from gallery import chart, run, sheet, without_axes

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.bodies.refine import refine_to_contact
from skfem_dual.grids.generate import disc, rectangle

SOIL = HalfSpace(young=1.0, poisson=0.25)
GRADED = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)


@dataclass(frozen=True)
class Edge:
    """Edge of contact and the parabola x = c0 + c1 y^2 nearest to it.

    Least squares over the length of the edge; ``deviation`` is x less that of the parabola.
    """

    x: np.ndarray
    y: np.ndarray
    parabola: tuple[float, float]
    deviation: np.ndarray
    rms: float

    @classmethod
    def of(cls, solution: PunchSolution) -> "Edge":
        """Of the one line where contact ends."""
        (line,) = solution.contact_region.edge
        length = np.pad(np.hypot(*np.diff(line)), 1)
        weight = length[1:] + length[:-1]
        x, y = line
        terms, root = np.column_stack([np.ones_like(y), y**2]), np.sqrt(weight)
        parabola = np.linalg.lstsq(terms * root[:, None], x * root)[0]
        deviation = x - terms @ parabola
        rms = np.sqrt(np.average(deviation**2, weights=weight))
        return cls(x, y, tuple(parabola.tolist()), deviation, float(rms))


@dataclass(frozen=True)
class Result:
    """Solutions by the names of their panels, P = E0 a^2; those on refined meshes."""

    solutions: dict[str, PunchSolution]
    refined: list[PunchSolution]

    def __str__(self) -> str:
        rows = [f"{'':<30}{'W0 / a':<10}{'tilt':<20}contact area / plan"]
        for name, s in self.solutions.items():
            tilt = f"({s.tilt[0]:.5f}, {s.tilt[1]:.5f})"
            share = s.contact_area / s.punch.partition.areas.sum()
            rows.append(f"{name:<30}{s.settlement:<10.5f}{tilt:<20}{share:.4f}")
        rows += ["", "Edge of contact at e = 0.5 a, in a, less the nearest parabola:"]
        rows.append(f"{'cells':<8}{'c0':<10}{'c1':<10}{'rms':<10}{'greatest':<10}at the circle")
        for s in self.refined:
            e = Edge.of(s)
            rows.append(
                f"{len(s.pressure):<8}{e.parabola[0]:<10.4f}{e.parabola[1]:<10.4f}{e.rms:<10.4f}"
                f"{e.deviation.max():<+10.4f}{e.deviation[[0, -1]].mean():+.4f}"
            )
        return "\n".join(rows)


def on_disc(mesh) -> RigidPunch:
    """The circle on homogeneous ground."""
    return RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis())


def main(n=600, refinements=3) -> Result:
    """Solve with about n dual cells; refine them to the edge of contact."""
    mesh = disc(n=n)
    circle = on_disc(mesh)
    square = RigidPunch(GRADED, DualMesh.from_mesh(rectangle(2.0, 2.0, n=n)).basis())
    load = {"force": 1.0, "at": (0.5, 0.0)}
    return Result(
        {
            "a) circle, e = 0.15 a": circle.solve(1.0, (0.15, 0.0)),
            "b) circle, graded, e = 0.15 a": RigidPunch(GRADED, circle.basis).solve(
                1.0, (0.15, 0.0)
            ),
            "c) circle, e = 0.35 a": circle.solve(1.0, (0.35, 0.0)),
            "d) circle, e = 0.5 a": circle.solve(**load),
            "square, graded, (0.1, 0.15) a": square.solve(1.0, (0.1, 0.15)),
            "square, graded, (0.4, 0.6) a": square.solve(1.0, (0.4, 0.6)),
        },
        refine_to_contact(on_disc, mesh, load, refinements),
    )


def visualize(result: Result):
    """Isobars of the pressure over its mean, with the same levels; the edge and the parabola."""
    from skfem_dual.visuals.matplotlib import isobars
    from skfem_dual.visuals.style import OUTLINE

    levels = np.array([0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 1.0, 1.5, 2.0])
    pictures = {}
    # first what lifts off most
    for name in sorted(result.solutions, key=lambda k: result.solutions[k].contact_area):
        ax = pictures[re.sub(r"\W+", "_", name)] = sheet(3.5)
        s = result.solutions[name]
        ax.plot(*s.centre_of_pressure, "+", color=OUTLINE, ms=13, mew=2.5)
        isobars(s, levels=levels, ax=ax)
        without_axes(ax, name)
    return pictures | {"contact_edge": draw_edge(result), "deviation": draw_deviation(result)}


def draw_edge(result: Result):
    from skfem_dual.visuals.style import CONTACT, OUTLINE

    ax, edge = chart(3.8), Edge.of(result.refined[-1])
    angle = np.linspace(0, 2 * np.pi, 400)
    ax.plot(np.cos(angle), np.sin(angle), color=OUTLINE, lw=1.4)
    ax.plot(edge.x, edge.y, color=CONTACT, lw=2.6, label="edge of contact")
    y = np.linspace(-0.95, 0.95, 200)
    c0, c1 = edge.parabola
    ax.plot(c0 + c1 * y**2, y, "--", color=OUTLINE, lw=1.4, label="nearest parabola")
    ax.set_xlim(-0.66, -0.24)
    ax.set_ylim(-0.95, 0.95)
    ax.set_xlabel("x / a, drawn larger than y / a")
    ax.set_ylabel("y / a")
    ax.text(-0.64, 0.7, "circle")
    ax.legend(loc="center left")
    return ax


def draw_deviation(result: Result):
    from skfem_dual.visuals.style import CONTACT, OUTLINE

    ax = chart()
    for share, s in zip(np.linspace(0.3, 1, len(result.refined)), result.refined, strict=True):
        edge, label = Edge.of(s), f"{len(s.pressure)} cells"
        ax.plot(edge.y, edge.deviation, color=CONTACT, lw=2, alpha=share, label=label)
    ax.axhline(0, color=OUTLINE, lw=1, ls="--")
    ax.set_xticks([-0.8, -0.4, 0.0, 0.4, 0.8])
    ax.set_xlabel("y / a")
    ax.set_ylabel("edge less parabola, in a")
    ax.legend(loc="lower center")
    return ax


if __name__ == "__main__":
    run(main, visualize)
