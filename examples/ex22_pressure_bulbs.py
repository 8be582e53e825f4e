"""Bulbs of pressure: vertical stress in the ground below a footing.

Below a rigid eccentric annulus under a central force the vertical stress spreads and fades with
depth; the isobars of sigma_z in a vertical section are the bulbs of foundation engineering.

The same annulus on a crust, half a radius thick and ten times as stiff as the ground below: the
crust carries like a plate, with tension at its bottom, and spreads what reaches the ground below.

First the bulb of an L-shaped raft on layers, cut open: a stiff layer lies between softer ones.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from gallery import chart, run
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
from skfem_dual.grids.generate import polygon
from skfem_dual.io import read_mesh

ANNULUS = Path(__file__).parents[1] / "tests" / "data" / "eccentric_annulus.msh"


#: an L-shaped raft, on layers, and the stress over the mean pressure that bounds its bulb
RAFT = np.array([[-1.0, 1.0, 1.0, 0.0, 0.0, -1.0], [-1.0, -1.0, 0.0, 0.0, 1.0, 1.0]])
LAYERS = LayeredHalfSpace([Layer(0.5, 1.0, 0.25), Layer(0.7, 4.0, 0.25)], HalfSpace(1.0, 0.25))
INTERFACES = (0.5, 1.2)
LEAST = 0.1


@dataclass(frozen=True)
class Bulb:
    """sigma_z over the mean pressure of the raft, on the grid of three lines."""

    lines: tuple[np.ndarray, np.ndarray, np.ndarray]
    sigma: np.ndarray


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
    bulb: Bulb

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
    return Result(solutions, sections, depths, below, profile, shares, cut_open(n // 4))


def cut_open(n: int) -> Bulb:
    """Below the rigid raft under a central force, behind y = -1 / 2; n points across."""
    s = RigidPunch(LAYERS, DualMesh.from_mesh(polygon(RAFT, n=150)).basis()).solve(
        1.0, at=(-1 / 6, -1 / 6)
    )
    x, y = np.linspace(-2.2, 2, n), np.linspace(-0.5, 2, 2 * n // 3)
    lines = x, y, np.linspace(0.01, 3.3, n)
    points = np.stack(np.meshgrid(*lines, indexing="ij"))
    sigma = stress_below(s, points.reshape(3, -1)).sigma_z.reshape(points.shape[1:])
    return Bulb(lines, sigma / s.mean_pressure)


def visualize(result: Result):
    """The bulb cut open; isobars of sigma_z over the mean pressure, and the profile."""
    from skfem_dual.visuals.matplotlib import draw_interfaces, isobars, plot_profile
    from skfem_dual.visuals.style import STRESS

    levels = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0]
    pictures = {"bulb_cut_open": draw_bulb(result.bulb)}
    names = ("homogeneous", "below_a_crust")
    for name, section, solution in zip(names, result.sections, result.solutions, strict=True):
        basis, sigma = section
        ax = pictures[name] = chart(3.9)
        relative = sigma / solution.mean_pressure
        isobars(basis, relative, levels, title=r"$\sigma_z$ / mean p", cmap=STRESS, ax=ax)
        ax.set_xlabel("distance along the section / a")
        ax.set_ylabel("- depth / a")
    draw_interfaces(pictures["below_a_crust"], result.profile.interfaces)
    return pictures | {"profile": plot_profile(result.profile)}


def draw_bulb(bulb: Bulb):
    """What of the ground behind y = -1 / 2 bears more than a tenth of the mean pressure."""
    import pyvista
    from scenes import MATTE, add, add_line, plate, shown, stage

    from skfem_dual.visuals.style import BODY, OUTLINE, STRESS

    x, y, z = bulb.lines
    limits, plotter = (0.0, 0.8), stage()
    ground = pyvista.RectilinearGrid(x, y, -z[::-1])
    ground["sigma"] = bulb.sigma[:, :, ::-1].ravel(order="F")
    look = {"scalars": "sigma", "clim": limits, "cmap": STRESS, "show_scalar_bar": False}
    skin = ground.contour([LEAST], scalars="sigma")
    plotter.add_mesh(skin, smooth_shading=True, **MATTE, **look)
    for normal, place in (("y", (0, y[0] + 1e-6, 0)), ("z", (0, 0, -z[0] - 1e-6))):
        cut = ground.slice(normal=normal, origin=place)
        cut = cut.clip_scalar(scalars="sigma", value=LEAST, invert=False)
        plotter.add_mesh(cut, n_colors=8, lighting=False, **look)
    for depth in INTERFACES:
        inside = x[bulb.sigma[:, 0, np.abs(z - depth).argmin()] > LEAST][[0, -1]]
        ends = np.array([inside, [y[0] - 0.01] * 2, [-depth] * 2])
        add_line(plotter, ends, OUTLINE, 3)
    add(plotter, *plate(RAFT, 0.02, 0.12), color=BODY)
    return shown(plotter, r"$\sigma_z$ / mean p", STRESS, limits, (-1.2, -2, 0.9))


if __name__ == "__main__":
    run(main, visualize)
