"""Figure 2: couples of rectangular grids, and the duality of Delaunay and Voronoi.

A rectangular grid has dual grids whose nodes are the barycentres of its cells. The Voronoi cells
of points are dual to their Delaunay triangulation as graphs always, but in the sense of
Definitions 1 and 3, where every node lies in its own cell and corresponded ribs cross, only if all
triangles are acute.
"""

from dataclasses import dataclass

import numpy as np
from gallery import fill_cells, legend_below, run, sheet, without_axes

from skfem_dual.grids.couples import GridCouple
from skfem_dual.grids.duality import check_dual
from skfem_dual.grids.rectangles import rectangular_couple
from skfem_dual.grids.voronoi import delaunay_voronoi

#: radii and numbers of points around a central one
RINGS = ((0.5, 6), (1.0, 12))


@dataclass(frozen=True)
class Result:
    """The couples of the three panels, and Voronoi cells of points with obtuse triangles."""

    extremal: GridCouple
    general: GridCouple
    acute: GridCouple
    obtuse: GridCouple

    def __str__(self) -> str:
        rows = []
        for name in ("extremal", "general", "acute", "obtuse"):
            report = check_dual(getattr(self, name))
            faults = "; ".join(c.message() for c in report.violated)
            rows.append(f"{name}: {'dual' if report.ok else 'not dual: ' + faults}")
        return "\n".join(rows)


def main() -> Result:
    """Make the couples."""
    x = np.array([0.0, 1.0, 2.2, 3.0, 4.2, 5.0])
    y = np.array([0.0, 0.8, 2.0, 3.0, 4.0])
    # B goes beyond A on the left and below only
    around = np.ones((len(x), len(y)), dtype=bool)
    around[-1], around[:, -1] = False, False
    rings = [r * np.exp(2j * np.pi * (np.arange(k) + r / 2) / k) for r, k in RINGS]
    points = np.concatenate([[0], *rings])
    acute = np.array([points.real, points.imag])
    shaken = acute + np.random.default_rng(1).uniform(-0.2, 0.2, acute.shape)
    return Result(
        rectangular_couple(x, y),
        rectangular_couple(x, y, around=around),
        delaunay_voronoi(acute),
        delaunay_voronoi(shaken),
    )


def visualize(result: Result):
    """Voronoi cells; what the figure has beside them, and the couple that is not dual."""
    from skfem_dual.visuals.matplotlib import draw

    first = sheet(3.9)
    draw(result.acute, ax=first, nodes=True, legend=False)
    fill_cells(first, result.acute.b.polygons)
    first.set_axis_off()
    legend_below(first)
    pictures = {"voronoi": first}
    for name, couple, title in (
        ("extremal", result.extremal, "rectangular, extremal"),
        ("general", result.general, "rectangular, general"),
        ("obtuse", result.obtuse, "obtuse triangles: not dual"),
    ):
        ax = pictures[name] = sheet()
        draw(couple, ax=ax, nodes=True, legend=False)
        without_axes(ax, title)
    return pictures


if __name__ == "__main__":
    run(main, visualize)
