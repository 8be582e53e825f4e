"""The kern of footings of any plan, and the moment-rotation curve up to overturning.

Under a force inside the kern a rigid footing keeps full contact. On an elastic half-space it
reaches a / 3 for a circle of radius a; linear pressures, the classical rule, give a / 4. Beyond it
the footing lifts off, turns more and more easily and falls over when the force reaches the edge of
the plan's convex hull.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run, sheet

from skfem_dual import DualMesh, HalfSpace, RigidPunch
from skfem_dual.bodies.paths import MomentRotation, moment_rotation
from skfem_dual.grids.generate import annulus, disc, polygon, rectangle

CLAY = HalfSpace(young=30e6, poisson=0.3)  # Pa
FORCE = 1.2e6  # N
SIDE = 3.0  # m, of the square footing
CORNERS = {
    "L-shape": [[-1.5, 1.5, 1.5, -0.5, -0.5, -1.5], [-1.5, -1.5, -0.5, -0.5, 1.5, 1.5]],
    "T-shape": [
        [-0.5, 0.5, 0.5, 1.5, 1.5, -1.5, -1.5, -0.5],
        [-1.5] * 2 + [0.5] * 2 + [1.5] * 2 + [0.5] * 2,
    ],
}


@dataclass(frozen=True)
class Result:
    """Footings by the names of their plans, and the curve of the square one."""

    footings: dict[str, RigidPunch]
    curve: MomentRotation

    def __str__(self) -> str:
        rows = [f"{'plan':<10}{'cells':<7}{'kern / plan':<13}kern's extent along x and y [m]"]
        for name, punch in self.footings.items():
            kern, areas = punch.kern(), punch.partition.areas
            extent = "  ".join(f"{a:+.3f}..{b:+.3f}" for a, b in zip(kern.min(1), kern.max(1)))
            rows.append(f"{name:<10}{len(areas):<7}{area(kern) / areas.sum():<13.4f}{extent}")
        curve = self.curve
        rows += [
            "",
            f"Square {SIDE:g} m x {SIDE:g} m, P = {FORCE / 1e6:g} MN, lift-off begins at ",
        ]
        rows[-1] += f"{curve.lift_off:.3f} m, overturning at {curve.overturning:.3f} m"
        rows.append(
            f"{'e [m]':<9}{'M [kNm]':<10}{'rotation [mrad]':<17}{'W0 [mm]':<9}contact / plan"
        )
        whole = SIDE**2
        for e, m, r, s in zip(curve.eccentricity, curve.moment, curve.rotation, curve.solutions):
            rows.append(
                f"{e:<9.3f}{m / 1e3:<10.1f}{1e3 * r:<17.3f}{1e3 * s.settlement:<9.2f}"
                f"{s.contact_area / whole:.4f}"
            )
        return "\n".join(rows)


def area(polygon) -> float:
    """Area of a counter-clockwise polygon (2, k)."""
    (x, y), (u, v) = polygon, np.roll(polygon, -1, axis=1)
    return float(np.sum(x * v - u * y) / 2)


def main(n=600, steps=20) -> Result:
    """Footings of about n dual cells; a curve of so many steps."""
    meshes = {
        "circle": disc(n=n, radius=SIDE / 2),
        "square": rectangle(SIDE, SIDE, n=n, graded=0.3),
        "L-shape": polygon(CORNERS["L-shape"], n=n),
        "T-shape": polygon(CORNERS["T-shape"], n=n),
        "annulus": annulus(SIDE / 4, SIDE / 2, n=n),
    }
    footings = {
        name: RigidPunch(CLAY, DualMesh.from_mesh(mesh).basis()) for name, mesh in meshes.items()
    }
    return Result(footings, moment_rotation(footings["square"], FORCE, steps=steps))


def visualize(result: Result):
    """Kerns of all plans; the curve, and where contact ends along it."""
    from skfem_dual.visuals.matplotlib import plot_kern, plot_moment_rotation

    pictures = {}
    for name in sorted(result.footings, key=lambda name: name != "L-shape"):
        ax = pictures[name] = sheet(3.7)
        plot_kern(result.footings[name], ax=ax)
        ax.get_legend().remove()
        ax.set_axis_off()
        legend_below(ax)
    curve = plot_moment_rotation(result.curve, ax=chart(3.6))
    curve.set_xlabel("rotation [rad]")
    curve.locator_params(axis="x", nbins=4)
    return pictures | {"overturning": curve, "edges": draw_edges(result.curve)}


def draw_edges(curve: MomentRotation):
    """Where contact ends in some of the steps."""
    from skfem_dual.visuals.isolines import smooth_line
    from skfem_dual.visuals.style import CONTACT, OUTLINE

    ax, half = chart(4.0), SIDE / 2
    ax.plot([-half, half, half, -half, -half], [-half, -half, half, half, -half], OUTLINE, lw=1.4)
    shares = curve.eccentricity / curve.overturning
    for wanted in (0.5, 0.7, 0.8, 0.9):
        step = np.abs(shares - wanted).argmin()
        lines = curve[step].contact_region.edge
        for line in lines:
            ax.plot(*smooth_line(line), color=CONTACT, lw=1.6)
        longest = max(lines, key=np.size)
        place = longest[:, np.abs(longest[1]).argmin()]
        white = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
        ax.text(*place, f"{shares[step]:.2f}", ha="center", va="center", fontsize=11, bbox=white)
    ax.set_title("edge of contact at M / overturning M")
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.set_xticks([-half, 0, half])
    ax.set_yticks([-half, 0, half])
    ax.spines[:].set_visible(False)
    return ax


if __name__ == "__main__":
    run(main, visualize)
