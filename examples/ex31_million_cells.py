"""A million cells: a rough surface in contact, and a rigid footing by the fast operator.

A matrix of a million rows and columns would take 8 terabytes. The fast operator takes time and
memory in proportion to the number of cells, and is as accurate as it is told to be. A rigid circle
under a force at a / 4 from its centre has the exact settlement P / (2 a E*) and tilt
3 M / (4 a^3 E*). Its mesh, graded to the edge, is refined again and again, and its boundary put
back on the circle. By default it goes up to some thousand cells, with ``--n 1000000`` to a
million.

A rough surface needs its million: 1024 x 1024 heights, waves of all lengths from a quarter of the
side down to eight cells, pressed by a rigid plane until a tenth of the side is in contact. On a
regular grid products are Fourier transforms, and the contact is found in seconds.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from gallery import chart, run, sheet, without_axes
from numpy import ndarray
from skfem import CellBasis, ElementQuad0, ElementTriP1, MeshQuad, MeshTri

from skfem_dual import DualMesh, HalfSpace, InfluenceOperator, PunchSolution, RigidPunch
from skfem_dual.contact.exact import circle_settlement, circle_tilt
from skfem_dual.grids.generate import disc
from skfem_dual.operators.iterative import solve_many
from skfem_dual.visuals.style import COLORMAP, GROUND, OUTLINE

SOIL = HalfSpace(young=1.0, poisson=0.25)
ECCENTRICITY = 0.25
#: force on the rough surface, over E a^2
PRESS = 0.003
#: nodes of the first mesh, and of the finest that is drawn
FIRST, DRAWN = 290, 20_000


@dataclass(frozen=True)
class Row:
    """What one mesh took: seconds, bytes, errors."""

    cells: int
    mesh: float
    setup: float
    product: float
    solution: float
    histories: tuple[tuple[float, ...], ...]
    memory: int
    operator: float
    settlement: float
    tilt: float

    def __str__(self) -> str:
        iterations = "/".join(str(len(h) - 1) for h in self.histories)
        return (
            f"{self.cells:<9}{self.mesh:<8.2f}{self.setup:<10.2f}{self.product:<11.4f}"
            f"{iterations:<12}{self.solution:<12.2f}{self.memory / 2**20:<8.1f}"
            f"{self.operator:<12.1e}{self.settlement:<+12.1e}{self.tilt:+.1e}"
        )


@dataclass(frozen=True)
class Result:
    """Rows from coarse to fine, their meshes, and the pressures on the last."""

    rows: list[Row]
    meshes: list[MeshTri]
    pressure: ndarray
    rough: PunchSolution

    def __str__(self) -> str:
        head = (
            f"{'cells':<9}{'mesh s':<8}{'set-up s':<10}{'product s':<11}{'iterations':<12}"
            f"{'solution s':<12}{'MiB':<8}{'operator':<12}{'settlement':<12}tilt"
        )
        share = len(self.rough.contact) / len(self.rough.pressure)
        last = f"rough surface: {self.rough.message}, {share:.1%} of the cells"
        return "\n".join([f"{'':<70}relative errors of", head, *map(str, self.rows), "", last])


def refined(mesh: MeshTri) -> MeshTri:
    """Twice as fine, with the boundary nodes on one circle of the area of the unit circle."""
    mesh = mesh.refined()
    p, edge = mesh.p.copy(), mesh.boundary_nodes()
    p[:, edge] /= np.hypot(*p[:, edge])
    area = abs(np.linalg.det((p[:, mesh.t[1:]] - p[:, None, mesh.t[0]]).T)).sum() / 2
    return MeshTri(p * np.sqrt(np.pi / area), mesh.t)


def meshes(n: int) -> Iterator[MeshTri]:
    """From coarse to fine, up to about n nodes."""
    mesh = disc(n=FIRST, graded=0.2)
    while True:
        yield mesh
        if 4 * mesh.nvertices > 1.3 * n:
            return
        mesh = refined(mesh)


def measured(mesh: MeshTri, rtol: float, start: float) -> tuple[Row, ndarray]:
    """Solve on a mesh that was begun at the time ``start``; what it took, and the pressures.

    `RigidPunch` does the same beyond 4000 cells; here with the fast operator in any case.
    """
    dual = DualMesh.from_mesh(mesh)
    meshed = perf_counter()
    punch = RigidPunch(SOIL, dual.basis())
    cells = punch.partition, punch.collocation_points, punch.footprint.slopes
    operator = InfluenceOperator.from_partition(SOIL, *cells, rtol, method="fast")
    ready = perf_counter()
    operator @ np.ones(len(dual))
    multiplied = perf_counter()
    iterated = solve_many(operator, punch.planes(operator.x).T, rtol)
    unit = iterated.solution
    # settlement and tilts by which the pressures balance the force
    position = np.linalg.solve(punch.resultants @ unit, [1.0, ECCENTRICITY, 0.0])
    end = perf_counter()
    moduli = SOIL.young, SOIL.poisson
    row = Row(
        cells=len(dual),
        mesh=meshed - start,
        setup=ready - meshed,
        product=multiplied - ready,
        solution=end - multiplied,
        histories=iterated.residuals,
        memory=operator.memory,
        operator=operator.error,
        settlement=position[0] / circle_settlement(1.0, 1.0, *moduli) - 1,
        tilt=position[1] / circle_tilt(ECCENTRICITY, 1.0, *moduli) - 1,
    )
    return row, unit @ position


def rough_surface(n: int, seed: int = 0) -> PunchSolution:
    """A plane pressed on n x n cells of a unit square whose heights have the slope 0.06, rms."""
    waves = np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    kept = (waves >= 4) & (waves <= n / 8)
    phases = np.exp(2j * np.pi * np.random.default_rng(seed).random(waves.shape))
    heights = np.fft.irfft2(np.where(kept, waves.clip(1) ** -1.8, 0) * phases)
    slope = np.sqrt(np.mean(np.sum(np.square(np.gradient(heights, 1 / n)), axis=0)))
    gap = 0.06 / slope * (heights.max() - heights).ravel()
    side = np.linspace(0, 1, n + 1)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    return RigidPunch(SOIL, cells, gap=gap).solve(PRESS, tilt=(0, 0), gap_rtol=1e-4)


def main(n=5000, rtol=1e-6, heights=1024) -> Result:
    """Solve on meshes of up to about n nodes; a rough surface of so many heights squared."""
    measured(next(meshes(FIRST)), rtol, 0.0)  # compiles
    rows, used, start = [], [], perf_counter()
    for mesh in meshes(n):
        row, pressure = measured(mesh, rtol, start)
        rows.append(row)
        used.append(mesh)
        start = perf_counter()
    return Result(rows, used, pressure, rough_surface(heights))


def visualize(result: Result):
    """A corner of the rough surface in space; where it touches; the circle, errors, seconds."""
    return {
        "corner": draw_corner(result.rough),
        "rough_surface": draw_contact(result.rough),
        "circle": draw_circle(result),
        "errors": draw_rows(result, ("settlement", "tilt", "operator"), "relative error"),
        "seconds": draw_rows(result, ("setup", "solution", "product"), "seconds"),
    }


def relative(s: PunchSolution) -> ndarray:
    """Pressures over the mean of the cells in contact, as the grid has them."""
    n = round(np.sqrt(len(s.pressure)))
    return s.pressure.reshape(n, n) / s.pressure[s.contact].mean()


def draw_contact(s: PunchSolution):
    """Pressures of the cells in contact, on the colour of the others."""
    from matplotlib import colormaps

    p = relative(s)
    ax, colors = sheet(3.9), colormaps[COLORMAP].with_extremes(bad=GROUND)
    image = ax.imshow(np.where(p > 0, p, np.nan).T, vmin=0, vmax=3, cmap=colors, origin="lower")
    ax.figure.colorbar(image, label="p / mean p in contact", extend="max", shrink=0.8)
    ax.set_title(f"{len(s.contact):,} of {p.size:,} cells".replace(",", " "))
    return ax


def draw_corner(s: PunchSolution):
    """The heights of a corner, 300 cells wide, and the pressure on their peaks."""
    from scenes import add, shown, stage

    p = relative(s)
    m = min(len(p), 300)
    gap, p = (v[:m, :m] for v in (s.punch.gap.reshape(p.shape), p))
    x = np.array(np.meshgrid(np.arange(m), np.arange(m), indexing="ij")).reshape(2, -1) / m
    i = np.arange(m * m).reshape(m, m)
    faces = np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]]).reshape(4, -1)
    points = np.vstack([x, -0.18 * gap.ravel() / np.ptp(gap)])
    values = np.where(p > 0, p, np.nan).ravel()
    plotter = stage()
    look = {"nan_color": GROUND, "clim": (0, 3), "cmap": COLORMAP, "smooth_shading": True}
    add(plotter, points, faces, scalars=values, **look)
    label, bar = "p / mean p in contact", {"extend": "max"}
    return shown(plotter, label, COLORMAP, (0, 3), (-0.6, -2, 1.4), bar)


def draw_circle(result: Result):
    """Isobars on one of the meshes."""
    from skfem_dual.visuals.matplotlib import isobars

    # refinement keeps the numbers of the nodes, and a node has the number of its cell
    drawn = max((m for m in result.meshes if m.nvertices <= DRAWN), key=lambda m: m.nvertices)
    some = drawn.nvertices
    mesh = MeshTri(np.ascontiguousarray(result.meshes[-1].p[:, :some]), drawn.t)
    levels = [0.4, 0.5, 0.6, 0.75, 1.0, 1.5, 2.0, 3.0]
    ax, p = sheet(3.6), np.pi * result.pressure[:some]
    ax.plot(ECCENTRICITY, 0, "+", color=OUTLINE, ms=13, mew=2.5)
    isobars(CellBasis(mesh, ElementTriP1()), p, levels, title="p / mean p", ax=ax)
    without_axes(ax, f"{result.rows[-1].cells} cells")
    return ax


def draw_rows(result: Result, names: tuple[str, ...], unit: str):
    """What the meshes took, from coarse to fine."""
    from matplotlib.ticker import NullLocator

    from skfem_dual.visuals.curves import LINES

    ax, n = chart(), [row.cells for row in result.rows]
    labels = {"setup": "set-up", "operator": "operator, on sampled rows"}
    for (color, style), name in zip(LINES, names, strict=False):
        values = np.abs([getattr(row, name) for row in result.rows])
        look = {"color": color, "marker": "o", "mfc": "white"}
        ax.loglog(n, values, style, label=labels.get(name, name), **look)
    ax.set_xticks(n, labels=n)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_xlabel("dual cells")
    ax.set_ylabel(unit)
    ax.legend()
    return ax


if __name__ == "__main__":
    run(main, visualize)
