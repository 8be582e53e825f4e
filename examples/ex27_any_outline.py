"""A footing of any plan from its outline, under an eccentric load.

The foundation slab of a building with a chamfered corner, a wing and a courtyard is given by the
corners of its outline and of the hole, nothing else. A tower stands in the wing: the load acts far
from the middle, and the far side of the slab lifts off. Settlement, tilts and the area in contact
on finer and finer meshes, near uniform and graded to the edge, stand beside each other.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run, sheet

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.grids.generate import polygon

OUTLINE = np.array([[0, 22, 26, 26, 16, 16, 0], [0, 0, 4, 14, 14, 20, 20.0]])  # m
COURTYARD = np.array([[5, 12, 12, 5], [6, 6, 13, 13.0]])
CLAY = HalfSpace(young=30e6, poisson=0.3)  # Pa
FORCE = 60e6  # N
AT = (17.5, 7.0)
MESHES = {"near uniform": None, "graded to the edge": 0.3}


@dataclass(frozen=True)
class Result:
    """Solutions on meshes from coarse to fine by the names of their kinds."""

    solutions: dict[str, list[PunchSolution]]

    @property
    def finest(self) -> PunchSolution:
        """On the last graded mesh."""
        return self.solutions["graded to the edge"][-1]

    def differences(self, kind: str) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of cells; how far corners and contact area are from those of the finest mesh.

        Corners by their greatest difference over the greatest settlement, the area by its part
        of the plan; shape (2, k).
        """
        found, finest = self.solutions[kind], self.finest
        w = finest.punch_displacement(OUTLINE)
        corners = [np.abs(s.punch_displacement(OUTLINE) - w).max() / w.max() for s in found]
        areas = [abs(share(s) - share(finest)) for s in found]
        return np.array([len(s.pressure) for s in found]), np.array([corners, areas])

    def __str__(self) -> str:
        rows = [
            f"{'mesh':<20}{'cells':<7}{'settlement [mm] under the load':<32}"
            f"{'tilt [mrad]':<20}contact / plan"
        ]
        for kind, found in self.solutions.items():
            for s in found:
                w = 1e3 * s.punch_displacement(np.array([AT]).T)[0]
                tilt = "({:+.4f}, {:+.4f})".format(*1e3 * s.tilt)
                rows.append(f"{kind:<20}{len(s.pressure):<7}{w:<32.3f}{tilt:<20}{share(s):.4f}")
        w = ", ".join(f"{x:.1f}" for x in 1e3 * self.finest.punch_displacement(OUTLINE))
        return "\n".join([*rows, "", f"settlement of the corners [mm]: {w}"])


def share(s: PunchSolution) -> float:
    """Part of the plan in contact."""
    return s.contact_area / s.punch.partition.areas.sum()


def main(sizes=(150, 300, 600, 1200, 2400)) -> Result:
    """Solve with about so many dual cells."""
    solutions: dict[str, list[PunchSolution]] = {}
    for kind, graded in MESHES.items():
        solutions[kind] = []
        for n in sizes:
            dual = DualMesh.from_mesh(polygon(OUTLINE, [COURTYARD], n=n, graded=graded))
            solutions[kind].append(RigidPunch(CLAY, dual.basis()).solve(FORCE, AT))
    return Result(solutions)


def visualize(result: Result):
    """Isobars with the edge of contact and the settlement of the corners; convergence."""
    from skfem_dual.visuals.matplotlib import isobars
    from skfem_dual.visuals.style import OUTLINE as INK

    ax, s = sheet(3.6), result.finest
    basis, p = s.pressure_field(refine=2)
    levels = [50, 100, 150, 200, 250, 300, 400, 600]
    ax.plot(*AT, "+", color=INK, ms=13, mew=2.5)
    isobars(basis, p / 1e3, levels, title="p [kPa]", contact=s.contact_region, ax=ax)
    middle = OUTLINE.mean(axis=1)
    for x, w in zip(OUTLINE.T, 1e3 * s.punch_displacement(OUTLINE), strict=True):
        side = np.sign(x - middle)
        ax.annotate(
            f"{w:.0f} mm",
            x,
            4 * side,
            textcoords="offset points",
            ha="right" if side[0] > 0 else "left",
            va="bottom" if side[1] > 0 else "top",
            bbox={"facecolor": "#ffffffb0", "edgecolor": "none", "pad": 1.0},
        )
    ax.margins(0.12)
    ax.set_axis_off()
    return {"any_outline": ax, "convergence": draw_convergence(result)}


def draw_convergence(result: Result):
    from matplotlib.ticker import NullLocator

    from skfem_dual.visuals.curves import LINES

    ax = chart(3.9)
    for kind, marker in zip(MESHES, "os", strict=True):
        n, values = result.differences(kind)
        for (color, style), name, value in zip(LINES, ("corners", "contact area"), values):
            kept = value > 0  # all but the finest itself
            look = {"color": color, "ls": style, "marker": marker, "mfc": "white"}
            ax.loglog(n[kept], value[kept], label=f"{name}, {kind}", **look)
    ax.set_xticks(n, labels=n)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel("dual cells")
    ax.set_ylabel("difference from the finest")
    legend_below(ax, handlelength=1.8, columnspacing=1)
    return ax


if __name__ == "__main__":
    run(main, visualize)
