"""Bulbs of pressure: vertical stress in the ground below a footing.

Below a rigid eccentric annulus under a central force the vertical stress spreads and fades with
depth; the isobars of sigma_z in a vertical section are the bulbs of foundation engineering.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gallery import run
from skfem import CellBasis

from skfem_dual import DualMesh, HalfSpace, PunchSolution, RigidPunch
from skfem_dual.contact.below import stress_below, vertical_section
from skfem_dual.io import read_mesh

ANNULUS = Path(__file__).parents[1] / "tests" / "data" / "eccentric_annulus.msh"


@dataclass(frozen=True)
class Result:
    """The solution, sigma_z in a section along the x axis, and below the middle."""

    solution: PunchSolution
    section: tuple[CellBasis, np.ndarray]
    depths: np.ndarray
    below: np.ndarray

    def __str__(self) -> str:
        rows = [f"{'depth / a':>10}{'sigma_z / mean p':>18}"]
        for z, s in zip(self.depths, self.below / self.solution.mean_pressure, strict=True):
            rows.append(f"{z:>10.2f}{s:>18.4f}")
        return "\n".join(rows)


def main(n=140) -> Result:
    """Solve, and take n points along the section."""
    dual = DualMesh.from_mesh(read_mesh(ANNULUS))
    solution = RigidPunch(HalfSpace(1.0, 0.25), dual.basis()).solve(1.0)
    section = vertical_section(solution, (-2.0, 0.0), (2.0, 0.0), 3.0, n)
    depths = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
    x = np.stack([np.zeros(6), np.zeros(6), depths])
    return Result(solution, section, depths, stress_below(solution, x).sigma_z)


def visualize(result: Result):
    """Isobars of sigma_z over the mean pressure."""
    from skfem_dual.visuals.matplotlib import isobars

    basis, sigma = result.section
    relative = sigma / result.solution.mean_pressure
    levels = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]
    ax = isobars(basis, relative, levels, title=r"$\sigma_z$ / mean p")
    ax.set_xlabel("distance along the section")
    ax.set_ylabel("- depth")
    return {"pressure_bulbs": ax}


if __name__ == "__main__":
    run(main, visualize)
