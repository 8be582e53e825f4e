"""Figures 11a, 11b and 16: eccentric loads on homogeneous and graded ground.

A rigid circle under a force at 0.15 a from its centre, on a homogeneous half-space and on one with
E = E0 (1 + B z / h), B = 1, h / a = 1; and the square punch of Fig. 16 on the graded ground, with
P = E0 a^2 at (0.1 a, 0.15 a). The stiffer depth draws pressure away from the edge.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.grids.generate import disc, rectangle

GRADED = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)


@dataclass(frozen=True)
class Result:
    """Solutions by the names of their panels; P = E0 a^2."""

    solutions: dict[str, PunchSolution]

    def __str__(self) -> str:
        return "\n".join(
            f"{name}: W0 / a = {s.settlement:.5f}, tilt = ({s.tilt[0]:.5f}, {s.tilt[1]:.5f})"
            for name, s in self.solutions.items()
        )


def main(n=600) -> Result:
    """Solve the three problems with about n dual cells."""
    circle = DualMesh.from_mesh(disc(n=n, true_area=True)).basis()
    square = DualMesh.from_mesh(rectangle(2.0, 2.0, n=n)).basis()
    return Result(
        {
            "circle, homogeneous": RigidPunch(HalfSpace(1.0, 0.25), circle).solve(
                1.0, (0.15, 0.0)
            ),
            "circle, graded": RigidPunch(GRADED, circle).solve(1.0, (0.15, 0.0)),
            "square, graded": RigidPunch(GRADED, square).solve(1.0, (0.1, 0.15)),
        }
    )


def visualize(result: Result):
    """Isobars of the pressure over its mean, with the same levels."""
    import matplotlib.pyplot as plt

    from skfem_dual.visuals.matplotlib import isobars

    _, axes = plt.subplots(1, 3, figsize=(14, 4.4), layout="compressed")
    levels = np.array([0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0])
    for ax, (name, solution) in zip(axes, result.solutions.items(), strict=True):
        basis, p = solution.nodal_pressure()
        isobars(basis, p / solution.mean_pressure, levels, title="p / mean p", ax=ax)
        ax.set_title(name, fontsize=10)
        ax.plot(*solution.centre_of_pressure, "+", color="#c8401f", ms=9, mew=2)
    axes[0].show = plt.show
    return {"eccentric_load": axes[0]}


if __name__ == "__main__":
    run(main, visualize)
