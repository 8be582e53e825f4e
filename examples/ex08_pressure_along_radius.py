"""Pressure along the radius of a circular punch: constant and edge-weighted cells.

Figures 8 and 9 of the paper compare the pressure under a rigid circle with the exact one,

    p(r) = P / (2 pi a sqrt(a^2 - r^2)).

Constant pressures on cells, here on the dual grid of a near-uniform triangulation with 513 nodes,
cannot follow it to the edge, and its neighbours pay for that. With edge-weighted cells, one more
curve, the unknowns are still the mean pressures of the same cells.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gallery import run

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.contact.exact import circle_pressure, circle_settlement
from skfem_dual.io import read_mesh

DISC = Path(__file__).parents[1] / "tests" / "data" / "disc.msh"


@dataclass(frozen=True)
class Result:
    """Solutions with constant and with edge-weighted cells under P = E a^2, nu = 1/4."""

    constant: PunchSolution
    weighted: PunchSolution

    def __str__(self) -> str:
        exact = circle_settlement(1.0, 1.0, 1.0, 0.25)
        rows = [f"exact settlement W / a: {exact:.5f}"]
        for name, solution in (("constant", self.constant), ("edge-weighted", self.weighted)):
            w = solution.settlement
            rows.append(f"{name} cells: {w:.5f}, relative error {w / exact - 1:+.1e}")
        return "\n".join(rows)


def main(path=DISC) -> Result:
    """Solve on the same mesh with both."""
    mesh = read_mesh(path)
    dual = DualMesh.from_mesh(mesh)
    # the polygon of the boundary nodes gets the area of the circle
    dual = DualMesh.from_mesh(mesh.scaled(float(np.sqrt(np.pi / dual.areas.sum()))))
    soil = HalfSpace(young=1.0, poisson=0.25)
    return Result(
        *(
            RigidPunch(soil, dual.basis(), edge=edge).solve(1.0)
            for edge in ("constant", "singular")
        )
    )


def visualize(result: Result):
    """The whole radius, and the last tenth of it."""
    import matplotlib.pyplot as plt

    from skfem_dual.visuals.curves import LINES

    _, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="compressed")
    for ax, (start, end, top) in zip(axes, ((0, 1, 0.9), (0.9, 1, 3.2)), strict=True):
        r = np.linspace(start, end, 600, endpoint=False)
        x = np.stack([r, np.zeros_like(r)])
        # along the radius through the middles of boundary facets, where the polygon ends first
        turn = np.pi / 80
        x = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ x
        curves = (
            ("exact", circle_pressure(x, 1.0, 1.0)),
            ("constant cells", result.constant.pressure_at(x)),
            ("edge-weighted cells", result.weighted.pressure_at(x)),
        )
        for (label, p), (color, style) in zip(curves, LINES, strict=False):
            ax.plot(r, np.where(p > 0, p, np.nan), style, color=color, label=label)
        ax.set_xlim(start, end)
        ax.set_ylim(0, top)
        ax.set_xlabel("r / a")
        ax.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel(r"$p\,a^2 / P$")
    axes[0].legend(frameon=False, loc="upper left")
    axes[0].show = plt.show
    return {"pressure_along_radius": axes[0]}


if __name__ == "__main__":
    run(main, visualize)
