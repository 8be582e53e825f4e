"""The same footing on homogeneous, graded and layered ground.

A rigid rectangle, 4 m x 3 m, with a force of 2 MN beside its middle, stands on six kinds of
ground with the same modulus at the surface: homogeneous; growing with depth; a soft layer on stiff
ground; a stiff crust on soft ground; a soft layer in between; a layer on rock. Softer ground below
spreads the trough far beyond the footing and draws pressure to its edge. Stiffer ground below,
rock above all, does the opposite.

First, rigid circles on seven such grounds stand beside numbers of an independent method, integral
equations of the axisymmetric problem, good to all digits given.
"""

from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run, sheet, without_axes

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    PunchSolution,
    RigidPunch,
)
from skfem_dual.grids.generate import disc, rectangle

LAYER = [Layer(thickness=1.0, young=1.0, poisson=0.25)]
#: with W E0 a / P and tilt E0 a^3 / M of a rigid circle of radius a = 1
CIRCLES = {
    "E = E0 (1 + 0.1 z / a)": (
        GradedHalfSpace.init_linear(1.0, 0.25, 0.1),
        (0.3884265445, 0.668060194),
    ),
    "E = E0 (1 + 0.5 z / a)": (
        GradedHalfSpace.init_linear(1.0, 0.25, 0.5),
        (0.2794736165, 0.571777662),
    ),
    "E = E0 (1 + z / a)": (
        GradedHalfSpace.init_linear(1.0, 0.25, 1.0),
        (0.2212284989, 0.496333765),
    ),
    "the same, nu = 1/2": (
        GradedHalfSpace.init_linear(1.0, 0.5, 1.0),
        (0.1498643676, 0.362765675),
    ),
    "layer of a bonded to rock": (
        LayeredHalfSpace(LAYER, "bonded"),
        (0.195493007289, 0.566018026363),
    ),
    "layer of a on smooth rock": (LayeredHalfSpace(LAYER, "smooth"), (0.2132017851, 0.5940602539)),
    "layer of a on E0 / 10": (
        LayeredHalfSpace(LAYER, HalfSpace(0.1, 0.25)),
        (2.18606607872, 1.16856340458),
    ),
}

#: the rectangle, in m and N, and what it stands on, in Pa
SIDES, FORCE, AT = (4.0, 3.0), 2e6, (0.25, 0.0)
GROUNDS = {
    "homogeneous, 20 MPa": HalfSpace(20e6, 0.3),
    "20 MPa at the surface, + 10 MPa / m": GradedHalfSpace.init_linear(20e6, 0.3, 0.5),
    "2 m of 20 MPa on 100 MPa": LayeredHalfSpace([Layer(2.0, 20e6, 0.3)], HalfSpace(100e6, 0.3)),
    "1 m of 20 MPa on 4 MPa": LayeredHalfSpace([Layer(1.0, 20e6, 0.3)], HalfSpace(4e6, 0.3)),
    "1 m of 20 MPa, 1 m of 4 MPa on 100 MPa": LayeredHalfSpace(
        [Layer(1.0, 20e6, 0.3), Layer(1.0, 4e6, 0.3)], HalfSpace(100e6, 0.3)
    ),
    "2 m of 20 MPa on rock": LayeredHalfSpace([Layer(2.0, 20e6, 0.3)], "bonded"),
}


@dataclass(frozen=True)
class Result:
    """Compliances of circles, (W E0 a / P, tilt E0 a^3 / M); solutions for the rectangle."""

    circles: dict[str, np.ndarray]
    rectangles: dict[str, PunchSolution]

    def __str__(self) -> str:
        rows = [
            f"{'rigid circle on':<28}{'W E0 a / P':<13}{'known':<13}{'error':<11}"
            f"{'tilt E0 a3 / M':<16}{'known':<13}error"
        ]
        for name, (w, tilt) in self.circles.items():
            known = CIRCLES[name][1]
            rows.append(
                f"{name:<28}{w:<13.7f}{known[0]:<13.7f}{w / known[0] - 1:<+11.1e}"
                f"{tilt:<16.7f}{known[1]:<13.7f}{tilt / known[1] - 1:+.1e}"
            )
        rows += [
            "",
            f"{'rectangle on':<42}{'settlement [mm]':<17}{'tilt [mrad]':<13}"
            "pressure in the middle / mean",
        ]
        for name, s in self.rectangles.items():
            middle = s.pressure_at([[0.0], [0.0]])[0] / s.mean_pressure
            w, tilt = 1e3 * s.settlement, 1e3 * s.tilt[0]
            rows.append(f"{name:<42}{w:<17.2f}{tilt:<13.3f}{middle:.3f}")
        return "\n".join(rows)


def main(n=600, circles=tuple(CIRCLES)) -> Result:
    """Solve with about n dual cells, graded to the edge; the circles on some grounds or all."""
    circle = DualMesh.from_mesh(disc(n=n, graded="sine")).basis()
    lever, compliances = 0.1, {}
    for name in circles:
        found = RigidPunch(CIRCLES[name][0], circle).solve(1.0, (lever, 0.0))
        compliances[name] = np.array([found.settlement, found.tilt[0] / lever])
    footing = DualMesh.from_mesh(rectangle(*SIDES, n=n, graded="sine")).basis()
    return Result(
        compliances,
        {name: RigidPunch(ground, footing).solve(FORCE, AT) for name, ground in GROUNDS.items()},
    )


def visualize(result: Result):
    """Settlements of the surface and pressures in the middle section; isobars."""
    from skfem_dual.visuals.matplotlib import isobars
    from skfem_dual.visuals.style import OUTLINE

    pictures = {"settlements": draw_settlements(result), "pressures": draw_pressures(result)}
    levels = [0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0]
    for i, (name, s) in enumerate(result.rectangles.items()):
        ax = pictures[f"isobars_{i}"] = sheet(3.2)
        ax.plot(*AT, "+", color=OUTLINE, ms=11, mew=2.2)
        isobars(s, levels=levels, ax=ax)
        without_axes(ax, f"{name}: {1e3 * s.settlement:.1f} mm")
    return pictures


def draw_settlements(result: Result):
    ax, half = chart(5.0), SIDES[0] / 2
    r = np.linspace(-3.5 * half, 3.5 * half, 561)
    for (color, style), (name, s) in zip(styles(), result.rectangles.items(), strict=True):
        w = 1e3 * s.ground_displacement(np.stack([r, np.zeros_like(r)]))
        ax.plot(r, w, linestyle=style, color=color, label=name)
    ax.set_xlim(r[0], r[-1])
    ax.invert_yaxis()
    ax.set_xlabel("x [m]")
    ax.set_ylabel("settlement of the surface [mm]")
    legend_below(ax, 1, handlelength=3)
    return ax


def draw_pressures(result: Result):
    ax, half = chart(5.0), SIDES[0] / 2
    inside = np.linspace(-0.985 * half, 0.985 * half, 301)
    for (color, style), (name, s) in zip(styles(), result.rectangles.items(), strict=True):
        basis, p = s.nodal_pressure()
        p = basis.interpolator(p / s.mean_pressure)(np.stack([inside, np.zeros_like(inside)]))
        ax.plot(inside, p, linestyle=style, color=color, label=name)
    ax.set_xlim(-half, half)
    ax.set_ylim(0, 2.5)
    ax.set_xlabel("x [m]")
    ax.set_ylabel("p / mean p")
    legend_below(ax, 1, handlelength=3)
    return ax


def styles():
    """Colours and dashes of the grounds."""
    from skfem_dual.visuals.curves import LINES

    return (*LINES, ("#1f9e89", (0, (8, 2))), ("#b07d12", (0, (4, 1, 1, 1, 1, 1))))


if __name__ == "__main__":
    run(main, visualize)
