"""An octagonal base of a wind turbine: six stiffnesses on layers, and a storm that lifts it off.

Whoever computes the oscillations of a turbine wants the stiffness of its base against all six
motions. Tables have it for circles, on a half-space or on one layer over rock (G. Gazetas and
E. Kausel), with the radius of the circle of equal area or, for tilt and torsion, of equal second
moments. Here it is that of the octagon on the layers there are: relaxed or rough, that is bonded.
Torsion reaches less deep than tilt, and tilt less deep than sliding: each has its own ground.

In the storm the base lifts off. What remains in contact carries the shear, and slides and twists
more easily: the force of the wind goes through the origin and not through what is in contact.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run, sheet
from numpy import ndarray

from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace, PunchSolution, RigidPunch
from skfem_dual.grids.generate import polygon

#: in m, N: width of the octagon, E and nu of the layers on rock
WIDTH = 18.0
CLAY, SAND = Layer(5.0, 80e6, 0.3), Layer(13.0, 240e6, 0.3)
SOILS = {
    "half-space of clay": HalfSpace(CLAY.young, CLAY.poisson),
    "clay on rock": LayeredHalfSpace([Layer(18.0, CLAY.young, CLAY.poisson)], "bonded"),
    "clay and sand on rock": LayeredHalfSpace([CLAY, SAND], "bonded"),
}
MOTIONS = {"settlement": 0, "tilt": 1, "sliding": 3, "torsion": 5}
#: weight with ballast; thrust and its moment, torsion
STORM = {"force": 16e6, "at": (5.2, 0.0), "horizontal": (0.9e6, 0.0), "torsion": 4e6}


def circles(depth: float = np.inf) -> ndarray:
    """Stiffnesses by the formulas for circles, on the clay alone or on rock at some depth."""
    area = 2 * np.tan(np.pi / 8) * WIDTH**2
    polar = area * WIDTH**2 / 8 * (1 + np.tan(np.pi / 8) ** 2 / 3)
    a, b = np.sqrt(area / np.pi), (2 * polar / np.pi) ** 0.25
    nu, shear = CLAY.poisson, CLAY.young / (2 * (1 + CLAY.poisson))
    settlement = 4 * a / (1 - nu) * (1 + 1.28 * a / depth)
    tilt = 8 * b**3 / (3 * (1 - nu)) * (1 + b / (6 * depth))
    sliding = 8 * a / (2 - nu) * (1 + a / (2 * depth))
    return shear * np.array([settlement, tilt, sliding, 16 / 3 * b**3 * (1 + b / (10 * depth))])


@dataclass(frozen=True)
class Result:
    """Stiffnesses (6, 6) by ground, relaxed and rough, and the storm on the last ground."""

    relaxed: dict[str, ndarray]
    rough: dict[str, ndarray]
    storm: PunchSolution

    @property
    def on_rock(self) -> ndarray:
        """Of circles on clay on rock, by the formulas, over those on the half-space."""
        return circles(18.0) / circles()

    def over_circle(self, stiffness: ndarray) -> ndarray:
        """Over those of circles on the half-space."""
        return stiffness.diagonal()[list(MOTIONS.values())] / circles()

    def __str__(self) -> str:
        head = "".join(f"{name:>12}" for name in MOTIONS)
        rows = [f"{'over circles on clay alone':<34}{head}"]
        table = "".join(f"{v:12.3f}" for v in self.on_rock)
        rows.append(f"{'circles, clay on rock':<34}{table}")
        for name in self.relaxed:
            for kind, found in (("relaxed", self.relaxed), ("rough", self.rough)):
                values = "".join(f"{v:12.3f}" for v in self.over_circle(found[name]))
                rows.append(f"{f'{name}, {kind}':<34}{values}")
        s = self.storm
        share = s.contact_area / s.punch.partition.areas.sum()
        rows.append(
            f"storm: {100 * share:.0f} % in contact, {1e3 * s.settlement:.1f} mm settled, "
        )
        x, y = 1e3 * s.shear.displacement
        rows[-1] += f"slid by ({x:.2f}, {y:.2f}) mm, twisted by {1e3 * s.shear.twist:.3f} mm/m"
        return "\n".join(rows)


def main(n=500) -> Result:
    """The octagon on three grounds, with about n nodes."""
    angles = np.pi / 8 + np.pi / 4 * np.arange(8)
    corners = WIDTH / 2 / np.cos(np.pi / 8) * np.array([np.cos(angles), np.sin(angles)])
    basis = DualMesh.from_mesh(polygon(corners, n=n)).basis()
    punches = {name: RigidPunch(soil, basis) for name, soil in SOILS.items()}
    return Result(
        {name: punch.stiffness(full=True) for name, punch in punches.items()},
        {name: punch.stiffness(full=True, rough=True) for name, punch in punches.items()},
        punches["clay and sand on rock"].solve(**STORM),
    )


def visualize(result: Result):
    """Pressures and shear tractions in the storm; stiffnesses over those of circles."""
    from skfem_dual.visuals.curves import LINES
    from skfem_dual.visuals.matplotlib import isobars

    ax, s = sheet(3.9), result.storm
    isobars(s, scale=1e3, title="pressure [kPa]; arrows: shear", labels=False, ax=ax)
    # on the singular edge and the line of contact tractions grow without bounds
    size = np.hypot(*s.shear.traction)
    common = np.median(size[s.pressure > 0])
    inner = np.nonzero((s.pressure > 0) & (size < 2 * common))[0]
    x, q = s.punch.partition.centroids[:, inner], s.shear.traction[:, inner] / common
    ax.quiver(*x, *(0.6 * q), color="black", width=0.0035, scale=1, scale_units="xy")
    ax.set_axis_off()
    bars = chart(4.4)
    for i in range(len(MOTIONS)):
        for k, soil in enumerate(SOILS):
            color = LINES[k][0]
            low, high = (
                result.over_circle(found[soil])[i] for found in (result.relaxed, result.rough)
            )
            at = i + 0.26 * (k - 1)
            bars.bar(at, high, 0.22, color=color, alpha=0.4)
            bars.bar(at, low, 0.22, color=color, label=soil if i == 0 else None)
        level = result.on_rock[i]
        bars.plot([i - 0.38, i + 0.38], [level, level], color="black", lw=1.2, ls="--")
    bars.plot([], [], color="black", lw=1.2, ls="--", label="table of circles, clay on rock")
    bars.set_xticks(range(len(MOTIONS)), MOTIONS)
    bars.set_ylabel("stiffness over that of the circle\non clay; pale what is added if rough")
    legend_below(bars, columnspacing=1)
    return {"wind_turbine_storm": ax, "wind_turbine_stiffness": bars}


if __name__ == "__main__":
    run(main, visualize)
