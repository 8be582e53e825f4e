"""Drawings of the pages: ``python docs/drawings.py FOLDER`` writes them as SVG files.

They are about as wide as a page on a phone, so that their letters stay readable there.
"""

import sys
from functools import cache
from importlib import import_module
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from imports import House, floor_plan
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from skfem import CellBasis, ElementQuad0, MeshQuad, MeshTri

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Plan,
    PunchSolution,
    RigidPunch,
    check_mesh,
)
from skfem_dual.grids.generate import disc
from skfem_dual.visuals.curves import LINES
from skfem_dual.visuals.matplotlib import draw, isobars, plot
from skfem_dual.visuals.style import CONTACT, DUAL, FAULT, LIGHT, OUTLINE, PRIMAL

sys.path.append(str(Path(__file__).parents[1] / "examples"))
sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))

from dark import save_twins
from gallery import STYLE, legend_below, sheet
from grid_drawings import DRAWINGS, NOTE, drawing
from growth import draw as draw_growth
from growth import read

DATA = Path(__file__).parents[1] / "tests" / "data"
ARROW = {"arrowstyle": "-|>", "color": OUTLINE, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}


def draw_all(folder: Path) -> None:
    """Write all drawings into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, function in DRAWINGS.items():
        with plt.rc_context(STYLE | {"font.size": 11}):
            figure = function().figure
        # without a date the same drawing is the same file
        save_twins(figure, folder / f"{name}.svg", metadata={"Date": None})
        plt.close(figure)


def diagram(width: float = 4.6, height: float = 3.2) -> Axes:
    """Axes for curves."""
    return plt.figure(figsize=(width, height), layout="compressed").add_subplot()


@drawing
def footing() -> Axes:
    """The outline in the drawing of an L-shaped footing."""
    return Plan.read(DATA / "footing.dxf", layer="FOOTING").plot(sheet(2.5, 3.3))


@drawing
def edge_weighted() -> Axes:
    """Pressure in the cells along a radius, constant and weighted."""
    ax = diagram()
    dual = DualMesh.from_mesh(disc(n=150))
    soil = HalfSpace(1.0, 0.25)
    r = np.linspace(0, 1, 1500, endpoint=False)
    turn = 0.12
    x = r * np.array([[np.cos(turn)], [np.sin(turn)]])
    exact = 1 / (2 * np.pi * np.sqrt(1 - r**2))
    ax.plot(r, exact, color="#c9c9c9", lw=5, label="exact")
    kinds = (("constant", "constant cells"), ("singular", "edge-weighted cells"))
    for (edge, name), (color, style) in zip(kinds, LINES[1:], strict=False):
        p = RigidPunch(soil, dual.basis(), edge=edge).solve(1.0).pressure_at(x)
        ax.plot(r, np.where(p > 0, p, np.nan), style, color=color, lw=1.4, label=name)
    ax.set_xlim(0, 1)
    ax.set_ylim(0, 1.2)
    ax.set_xlabel("r / a")
    ax.set_ylabel(r"$p\,a^2 / P$")
    ax.legend(frameon=False, fontsize=9, loc="upper left")
    return ax


@drawing
def lift_off() -> Axes:
    """A circle that lifts off, in a section: ground, punch and pressures."""
    ax = diagram(4.6, 3.6)
    dual = DualMesh.from_mesh(disc(n=600))
    solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(1.0, at=(0.5, 0.0))
    x = np.linspace(-1.6, 1.6, 400)
    line = np.stack([x, np.zeros_like(x)])
    under = np.abs(x) <= 1
    punch = solution.punch_displacement(line)
    ground = solution.ground_displacement(line)
    ax.fill_between(x, ground, 1.5, color="#f2efe8", lw=0)
    ax.plot(x, ground, color=OUTLINE, lw=1.2)
    ax.plot(x[under], punch[under], color=CONTACT, lw=3, solid_capstyle="butt")
    shown = np.linspace(-0.96, 0.96, 25)
    p = solution.pressure_at(np.stack([shown, np.zeros_like(shown)]))
    here = np.stack([shown, np.zeros_like(shown)])
    for s, q, w in zip(shown, p, solution.ground_displacement(here), strict=True):
        if q > 0:
            foot = min(w + 0.9 * q, 1.45)
            arrow = {"arrowstyle": "-|>", "color": FAULT, "lw": 0.9}
            ax.annotate("", (s, w), (s, foot), arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0})
    ax.annotate("", (0.5, 0.68), (0.5, 0.02), arrowprops=ARROW)
    ax.text(0.56, 0.2, "$P$", **NOTE)
    ax.text(-1.0, -0.12, "rigid punch", color=CONTACT, fontsize=9.5)
    ax.text(-0.62, 0.42, "gap", **NOTE)
    ax.text(-1.5, 1.3, "ground", **NOTE)
    ax.text(-0.15, 1.3, "pressure $p$", color=FAULT, fontsize=9.5)
    ax.set_ylim(1.5, -0.25)
    ax.set_xlim(-1.6, 1.6)
    ax.set_xlabel("x / a")
    ax.set_ylabel(r"settlement $w\,E^* a / P$")
    return ax


@drawing
def influence() -> Axes:
    """Influence functions of three grounds over that of the first."""
    ax = diagram()
    first = HalfSpace(1.0, 0.25)
    grounds = {
        "homogeneous": first,
        "E = E₀ (1 + z / h)": GradedHalfSpace.init_linear(1.0, 0.25, 1.0),
        "layer h on rigid base": LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded"),
        "layer h on E₀ / 3": LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], HalfSpace(1 / 3, 0.25)),
    }
    r = np.geomspace(0.02, 10, 300)
    for (name, ground), (color, style) in zip(grounds.items(), LINES, strict=True):
        ax.semilogx(r, ground.influence(r) / first.influence(r), style, color=color, label=name)
    ax.set_ylim(-0.1, 3.1)
    ax.set_xlim(r[0], r[-1])
    ax.set_xlabel("r / h")
    ax.set_ylabel(r"$\omega$ over that of the surface moduli")
    ax.legend(frameon=False, fontsize=9)
    return ax


@drawing
def punch() -> Axes:
    """Fig. 6: the punch, its load and the signs, in an oblique view."""
    example = import_module("ex06_punch_on_half_space")
    return example.visualize(example.main())["punch"]


@drawing
def moments() -> Axes:
    """What positive moments of a table of loads press down, seen along their axes."""
    ax = diagram(4.6, 1.7)
    plate = np.array([[-1.0, 0.25], [1.0, -0.1], [0.96, -0.32], [-1.04, 0.03]])
    for shift, along, moment in ((0.0, "y", "$M_x > 0$"), (3.2, "x", "$M_y > 0$")):
        ax.plot([shift - 1.4, shift + 1.4], [0, 0], color=PRIMAL, linewidth=1, zorder=0)
        ax.add_patch(Polygon(np.add(plate, (shift, 0)), facecolor=LIGHT, edgecolor=OUTLINE))
        arrow = {"arrowstyle": "->", "color": OUTLINE, "connectionstyle": "arc3,rad=-0.5"}
        ax.annotate("", (shift + 0.6, 0.4), (shift - 0.6, 0.5), arrowprops=arrow)
        ax.text(shift + 0.75, 0.6, moment, fontsize=11)
        ax.annotate("", (shift - 0.5, -0.6), (shift - 1.4, -0.6), arrowprops={"arrowstyle": "->"})
        ax.text(shift - 0.4, -0.68, f"${along}$", fontsize=11)
    ax.set_xlim(-1.6, 5.2)
    ax.set_ylim(-0.9, 1.1)
    ax.set_axis_off()
    return ax


@drawing
def neighbours() -> Axes:
    """Fig. 15: the nodes around a node of either grid."""
    example = import_module("ex15_neighbour_nodes")
    return example.visualize(example.main())["neighbour_nodes"]


@drawing
def faults() -> Axes:
    """A mesh without a dual grid, the bad place marked."""
    mesh = faulty()
    ax = draw(mesh, report=check_mesh(mesh), ax=sheet(3.2, 4.2), legend=False)
    ax.set_axis_off()
    legend_below(ax)
    return ax


def faulty() -> MeshTri:
    """Slender triangles side by side: two barycentres see each other past their facet."""
    p = np.array([[0.0, 1.0, 1.9, 2.6, 0.4, 1.3, -0.4], [0.0, 0.0, 0.12, 1.0, 0.9, 1.3, -0.7]])
    t = np.array([[0, 1, 4], [1, 4, 5], [1, 2, 5], [2, 3, 5], [0, 1, 6], [1, 2, 6]]).T
    return MeshTri(p, np.ascontiguousarray(t, dtype=np.int32))


@cache
def eccentric() -> PunchSolution:
    """A circle under an eccentric force."""
    dual = DualMesh.from_mesh(disc(n=120))
    return RigidPunch(HalfSpace(1.0, 0.25), dual.basis()).solve(1.0, at=(0.2, 0.1))


@drawing
def picture_lifted() -> Axes:
    """Isobars under a punch that lifts off."""
    dual = DualMesh.from_mesh(disc(n=600))
    s = RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(1.0, at=(0.5, 0.0))
    return isobars(s, ax=sheet(3.4, 4.2))


@drawing
def picture_rough() -> Axes:
    """Pressures under a rough surface, cells without any left white."""
    n, side = 128, np.linspace(0, 1, 129)
    k = np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    waves = np.where((k >= 4) & (k <= 16), np.maximum(k, 1) ** -1.8, 0)
    heights = np.fft.irfft2(waves * np.exp(2j * np.pi * np.random.default_rng(0).random(k.shape)))
    gap = 1e-3 * (heights.max() - heights).ravel() / heights.std()
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    punch = RigidPunch(HalfSpace(2000.0, 0.35), cells, gap=gap)
    p = punch.solve(10.0, tilt=(0, 0), gap_rtol=1e-6).pressure.reshape(n, n)
    ax = diagram(4.4, 3.6)
    ax.spines[["top", "right"]].set_visible(True)
    image = ax.imshow(np.where(p > 0, p, np.nan).T, extent=(0, 1, 0, 1), origin="lower")
    ax.figure.colorbar(image, label="pressure [MPa]")
    ax.set(xlabel="x [mm]", ylabel="y [mm]")
    return ax


@drawing
def picture_draw() -> Axes:
    """What draw shows."""
    ax = sheet(3.9, 4.2)
    draw(eccentric().punch.basis.dual, ax=ax)
    return ax


@drawing
def picture_plot() -> Axes:
    """What plot shows."""
    s = eccentric()
    ax = sheet(3.4, 4.2)
    return plot(s.punch.basis, s.pressure / s.mean_pressure, title="p / mean p", ax=ax)


@drawing
def picture_isobars() -> Axes:
    """What isobars shows."""
    return isobars(eccentric(), ax=sheet(3.4, 4.2))


@drawing
def signs() -> Axes:
    """What is positive, with units, in a section along x."""
    ax = diagram(5.6, 4.4)
    middle, tilt, e = 0.95, 0.2, 0.5
    x = np.linspace(-1.0, 1.0, 2)
    far = np.append(np.linspace(-3.0, -1.0, 30), np.linspace(1.0, 3.0, 30))
    ground = (middle + tilt * np.sign(far)) * np.arcsin(1 / np.abs(far)) / (np.pi / 2)
    ax.fill_between(far, ground, 3.1, color="#f2efe8", lw=0)
    ax.plot(far, ground, color=OUTLINE, lw=1)
    ax.plot([-3, 3], [0, 0], color=PRIMAL, lw=0.8, ls="--")
    bottom = middle + tilt * x
    ax.fill_between(x, bottom - 0.22, bottom, facecolor=LIGHT, edgecolor=CONTACT, lw=1.2)

    def arrow(begin, end, text, at, color=OUTLINE, **options):
        ax.annotate("", end, begin, arrowprops=ARROW | {"color": color} | options)
        ax.text(*at, text, fontsize=9.5, color=color)

    arrow((-3.0, 0), (-2.3, 0), "$x$ [m]", (-2.75, -0.12))
    arrow((-3.0, 0), (-3.0, 0.9), "$z$ [m], depth", (-2.92, 0.85))
    arrow((e, -0.75), (e, 0.62), "force $P > 0$ [kN]", (e + 0.1, -0.55), FAULT)
    arrow((0, -0.3), (e, -0.3), r"$\varepsilon_x$", (0.15, -0.36))
    arrow((0, 0), (0, middle), "settlement\n$W_0 > 0$ [m]", (-0.98, 0.42))
    ax.plot(0, 0, "o", color=OUTLINE, ms=4)
    ax.text(-0.08, -0.1, "origin", fontsize=9.5, ha="right")
    arrow((1.1, 0.2), (1.1, 1.7), "", (0, 0), DUAL, connectionstyle="arc3,rad=-0.3")
    ax.text(
        1.42,
        1.12,
        "tilt $L_x > 0$ [–]\nmoment $M_y > 0$,\n$M_1 < 0$ [kNm]",
        fontsize=9.5,
        color=DUAL,
    )
    for at, length in zip(np.linspace(-0.9, 0.9, 7), (0.5, 0.3, 0.27, 0.28, 0.32, 0.42, 0.75)):
        top = middle + tilt * at + 0.03
        ax.annotate("", (at, top + length), (at, top), arrowprops=ARROW | {"color": CONTACT})
    ax.text(-1.05, 1.98, "pressure on the ground\n$p > 0$ [kN/m²]", fontsize=9.5, color=CONTACT)
    ax.add_patch(Polygon([(1.3, 2.3), (1.8, 2.3), (1.8, 2.7), (1.3, 2.7)], fc="none", ec=OUTLINE))
    arrow((1.55, 1.95), (1.55, 2.28), "", (0, 0))
    arrow((1.55, 3.05), (1.55, 2.72), "", (0, 0))
    ax.text(1.9, 2.58, r"$\sigma_z > 0$ [kN/m²]", fontsize=9.5)
    ax.text(-2.9, 2.85, r"ground: $E$ [kN/m²], $\nu$ [–]", fontsize=9.5)
    ax.set_xlim(-3.05, 3.05)
    ax.set_ylim(3.1, -0.9)
    ax.set_axis_off()
    return ax


@drawing
def growth() -> Axes:
    """Time and memory against the number of cells, as measured."""
    measured = Path(__file__).parent / "performance" / "growth.txt"
    return draw_growth(read(measured.read_text(encoding="utf-8")))


@drawing
def floors() -> Axes:
    """The modules of the package and what they import."""
    _, ax = plt.subplots(figsize=(6.4, 6.4), layout="constrained")
    floor_plan(ax, House.read(Path(__file__).parents[1]))
    return ax


if __name__ == "__main__":
    plt.switch_backend("agg")
    draw_all(Path(sys.argv[1]))
