"""Figure 6: a flat and smooth punch on an elastic half-space.

The punch of any plan settles by W0 + Lx x + Ly y under a force P at (eps_x, eps_y) and moments M1
and M2 about the axes: a force through another point with the same first moments, P eps_x - M1
and P eps_y + M2, does the same. The plan drawn is solved with both.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run, sheet

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.grids.generate import polygon
from skfem_dual.visuals.style import CONTACT, FAULT, LIGHT, OUTLINE, PRIMAL

FORCE, AT, MOMENTS = 1.0, (0.2, -0.15), (0.05, 0.08)
THICKNESS = 0.22
ARROW = {"arrowstyle": "-|>", "color": OUTLINE, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}


@dataclass(frozen=True)
class Result:
    """The outline, and the punch under force and moments and under one force elsewhere."""

    outline: np.ndarray
    moments: PunchSolution
    moved: PunchSolution

    def __str__(self) -> str:
        rows = [f"{'':<28}{'W0 / a':<11}{'Lx':<11}Ly"]
        for name, s in (
            (f"force {AT}, moments {MOMENTS}", self.moments),
            (f"force ({', '.join(f'{x:g}' for x in self.moved.centre_of_pressure)})", self.moved),
        ):
            rows.append(f"{name:<46}{s.settlement:<11.6f}{s.tilt[0]:<+11.6f}{s.tilt[1]:<+.6f}")
        return "\n".join(rows)


def main(n: int = 300) -> Result:
    """Solve on about n dual cells, E = a = 1, nu = 1/4."""
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    outline = 1.25 * (1 + 0.07 * np.cos(3 * angle)) * np.array([np.cos(angle), np.sin(angle)])
    punch = RigidPunch(HalfSpace(1.0, 0.25), DualMesh.from_mesh(polygon(outline, n=n)).basis())
    moved = (AT[0] - MOMENTS[0] / FORCE, AT[1] + MOMENTS[1] / FORCE)
    return Result(outline, punch.solve(FORCE, AT, moments=MOMENTS), punch.solve(FORCE, moved))


def visualize(result: Result):
    """The punch, its load and the signs, in an oblique view."""
    from matplotlib.patches import Polygon
    from scipy.spatial import ConvexHull

    ax = sheet(3.1)
    square = np.array([[-2.2, 2.2, 2.2, -2.2], [-2.1, -2.1, 2.1, 2.1]])
    ax.add_patch(Polygon(view(*square).T, facecolor="#f2efe8", edgecolor=PRIMAL, lw=0.8))
    top = view(*result.outline, -THICKNESS)
    hull = np.hstack([view(*result.outline), top])
    side = hull[:, ConvexHull(hull.T).vertices]
    for corners, color in ((side, LIGHT), (top, "#fdf3ef")):
        ax.add_patch(Polygon(corners.T, facecolor=color, edgecolor=CONTACT, lw=1.2, zorder=2))
    draw_axes(ax)
    draw_load(ax)
    mark(ax, "ground, $z = 0$", view(-1.3, -2.1), 0.05, 0.14)
    ax.set_xlim(-3.3, 3.4)
    ax.set_ylim(-1.95, 2.15)
    return {"punch": ax}


def view(x, y, z=0.0):
    """x to the right, y towards the reader, z down: a right-handed system."""
    return np.array([x - 0.5 * y, -0.4 * y - z])


def mark(ax, name: str, place, dx: float, dy: float, **more) -> None:
    """A letter beside a place."""
    note = {"ha": "center", "va": "center", "fontsize": 12.5, "color": OUTLINE}
    ax.text(place[0] + dx, place[1] + dy, name, **note | more)


def draw_axes(ax) -> None:
    """The axes x and y on the punch, z into the ground."""
    top = view(0, 0, -THICKNESS)
    for name, (x, y), dx, dy in (("$x$", (3.1, 0), 0.15, 0.0), ("$y$", (0, 3.3), -0.15, -0.05)):
        ax.annotate("", view(x, y, -THICKNESS), top, arrowprops=ARROW, zorder=3)
        mark(ax, name, view(x, y, -THICKNESS), dx, dy)
    ax.plot(*np.stack([top, view(0, 0, 1.15)], axis=1), ":", color=OUTLINE, lw=1.2, zorder=3)
    ax.annotate("", view(0, 0, 1.75), view(0, 0, 1.15), arrowprops=ARROW, zorder=3)
    mark(ax, "$z$", view(0, 0, 1.75), 0.17, 0.05)


def draw_load(ax) -> None:
    """Force and eccentricities, larger than those solved, and moments."""
    x, y = 0.55, -0.5
    point = view(x, y, -THICKNESS)
    for foot in ((x, 0), (0, y)):
        line = np.stack([view(*foot, -THICKNESS), point], axis=1)
        ax.plot(*line, ":", color=OUTLINE, lw=1.2, zorder=3)
    ax.annotate("", point, view(x, y, -1.75), arrowprops=ARROW | {"lw": 2.4}, zorder=4)
    mark(ax, "$P$", view(x, y, -1.6), 0.2, 0.0)
    mark(ax, r"$\varepsilon_x$", view(0.36, 0, -THICKNESS), 0.0, -0.13, zorder=4)
    mark(ax, r"$\varepsilon_y$", view(0, -0.3, -THICKNESS), -0.17, 0.03, zorder=4)
    mark(ax, "$C$", point, 0.16, 0.02, zorder=4)
    r = 0.36
    turning(ax, lambda s: view(2.45, r * np.cos(s), r * np.sin(s) - THICKNESS))
    mark(ax, "$M_2$", view(2.45, 0, -THICKNESS), 0.1, 0.62, color=FAULT)
    turning(ax, lambda s: view(r * np.sin(s), 2.5, r * np.cos(s) - THICKNESS))
    mark(ax, "$M_1$", view(0, 2.5, -THICKNESS), -0.62, 0.1, color=FAULT)


def turning(ax, circle) -> None:
    """An arrow around an axis: three quarters of a circle in space."""
    s = np.linspace(0.9, 0.9 + 1.6 * np.pi, 60)
    line = np.stack([circle(angle) for angle in s], axis=1)
    ax.plot(*line[:, :-3], color=FAULT, lw=1.6, zorder=4)
    arrow = ARROW | {"color": FAULT, "lw": 1.6}
    ax.annotate("", line[:, -1], line[:, -5], arrowprops=arrow, zorder=4)


if __name__ == "__main__":
    run(main, visualize)
