"""Bulbs of pressure: vertical stress in the ground below a footing.

Below a rigid eccentric annulus under a central force the vertical stress spreads and fades with
depth; the isobars of sigma_z in a vertical section are the bulbs of foundation engineering.

The same annulus on a crust, half a radius thick and ten times as stiff as the ground below: the
crust carries like a plate, with tension at its bottom, and spreads what reaches the ground below.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gallery import run
from skfem import CellBasis

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Profile,
    PunchSolution,
    RigidPunch,
    settlement_by_layers,
    stress_below,
    vertical_profile,
    vertical_section,
)
from skfem_dual.io import read_mesh

ANNULUS = Path(__file__).parents[1] / "tests" / "data" / "eccentric_annulus.msh"


@dataclass(frozen=True)
class Result:
    """On homogeneous ground and on the crust: sigma_z in a section along the x axis and below the
    middle; on the crust a profile below the annulus, and the shares of crust and ground in the
    settlement there."""

    solutions: tuple[PunchSolution, PunchSolution]
    sections: tuple[tuple[CellBasis, np.ndarray], ...]
    depths: np.ndarray
    below: np.ndarray
    profile: Profile
    shares: np.ndarray

    def __str__(self) -> str:
        rows = [f"{'depth / a':>10}{'sigma_z / mean p':>18}{'on the crust':>14}"]
        mean = self.solutions[0].mean_pressure
        for z, (s, t) in zip(self.depths, self.below.T / mean, strict=True):
            rows.append(f"{z:>10.2f}{s:>18.4f}{t:>14.4f}")
        crust, ground = self.shares / self.shares.sum()
        rows.append(f"settlement on the crust: {crust:.1%} from the crust, {ground:.1%} below it")
        return "\n".join(rows)


def main(n=140) -> Result:
    """Solve, and take n points along the section."""
    dual = DualMesh.from_mesh(read_mesh(ANNULUS))
    soil = HalfSpace(1.0, 0.25)
    crust = LayeredHalfSpace([Layer(0.5, 10.0, 0.25)], soil)
    solutions = tuple(RigidPunch(ground, dual.basis()).solve(1.0) for ground in (soil, crust))
    sections = tuple(vertical_section(s, (-2.0, 0.0), (2.0, 0.0), 3.0, n) for s in solutions)
    depths = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
    x = np.stack([np.zeros(6), np.zeros(6), depths])
    below = np.stack([stress_below(s, x).sigma_z for s in solutions])
    ring = (-0.9, 0.0)
    z = np.append(np.linspace(0.02, 2.0, n // 2), [0.5, 0.5001])
    profile = vertical_profile(solutions[1], ring, z)
    shares = settlement_by_layers(solutions[1], np.array(ring)[:, None])[:, 0]
    return Result(solutions, sections, depths, below, profile, shares)


def visualize(result: Result):
    """Isobars of sigma_z over the mean pressure, and the profile."""
    from skfem_dual.visuals.matplotlib import draw_interfaces, isobars, plot_profile

    levels = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]
    drawn = []
    for (basis, sigma), solution in zip(result.sections, result.solutions, strict=True):
        relative = sigma / solution.mean_pressure
        ax = isobars(basis, relative, levels, title=r"$\sigma_z$ / mean p")
        ax.set_xlabel("distance along the section")
        ax.set_ylabel("- depth")
        drawn.append(ax)
    draw_interfaces(drawn[1], result.profile.interfaces)
    profile = plot_profile(result.profile)
    return {"pressure_bulbs": drawn[0], "bulbs_below_a_crust": drawn[1], "profile": profile}


if __name__ == "__main__":
    run(main, visualize)
