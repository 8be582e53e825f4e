"""Pictures of the front page, and scenes: ``python docs/front.py FOLDER`` draws what it computes.

Pictures have neither background nor letters, and so stand on light and dark pages.
"""

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from matplotlib.image import imsave

from skfem_dual import ElasticSolution, PunchSolution
from skfem_dual.grids.surroundings import surroundings
from skfem_dual.visuals.relief import Relief
from skfem_dual.visuals.style import COLORMAP, GROUND

sys.path.append(str(Path(__file__).parents[1] / "examples"))

from scenes import add, cropped
from turning import write_scene

PAGE = Path(__file__).parent / "index.md"
#: pixels of a picture before it is cropped
SIZE = (1100, 700)
#: pressures over their mean up to which they are drawn; their height over the plan's extent
HIGHEST, HEIGHT = 1.7, 0.2
#: the largest settlement as it is drawn, over the plan's extent
SUNK = 0.12


def programs() -> list[str]:
    """The programs of the page; each goes on where the one before ended."""
    return re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.M | re.S)


def relief(plotter: pyvista.Plotter, solution: PunchSolution) -> None:
    """The contact pressure as a body on the ground, cut off near the edge."""
    basis, p = solution.pressure_field()
    p = np.minimum(p[basis.nodal_dofs[0]] / solution.mean_pressure, HIGHEST)
    mesh, clim = basis.mesh, (p.min(), HIGHEST)
    around, t = surroundings(solution.punch.partition, solution.punch.fan, 0.1)
    add(plotter, np.vstack([around, np.zeros_like(around[0])]), t, color=GROUND)
    top = np.vstack([mesh.p, HEIGHT / HIGHEST * np.ptp(mesh.p, axis=1).max() * p])
    look = {"clim": clim, "cmap": COLORMAP}
    add(plotter, top, mesh.t, scalars=p, smooth_shading=True, **look)
    a, b = mesh.facets[:, mesh.boundary_facets()]
    wall = np.stack([a, b, b + len(p), a + len(p)])
    foot = top * [[1], [1], [0]]
    add(plotter, np.hstack([top, foot]), wall, scalars=np.append(p, 0 * p), **look)


def deflected(plotter: pyvista.Plotter, solution: ElasticSolution) -> None:
    """The raft as it bends, and the ground."""
    shapes = Relief.of(solution)
    add(plotter, shapes.ground.p, shapes.ground.faces.T, color=GROUND, smooth_shading=True)
    bent, w = shapes.structure, shapes.displacement
    add(plotter, bent.p, bent.faces.T, scalars=w, cmap=COLORMAP, smooth_shading=True)


def sunk(plotter: pyvista.Plotter, solution: PunchSolution) -> None:
    """The plan as it settles with its cells and their pressures, and the ground."""
    punch = solution.punch
    fan, size = punch.fan, np.ptp(punch.fan.p, axis=1).max()
    around, t = surroundings(punch.partition, fan, 0.25)
    w = solution.ground_displacement(around)
    scale = SUNK * size / w.max()
    add(plotter, np.vstack([around, -scale * w]), t, color=GROUND, smooth_shading=True)
    basis, p = solution.pressure_field()
    p, x = p[basis.nodal_dofs[0]] / solution.mean_pressure, basis.mesh.p
    z = -scale * solution.punch_displacement(x)
    look = {"scalars": p, "clim": (p.min(), 1.3), "cmap": COLORMAP}
    add(plotter, np.vstack([x, z]), basis.mesh.t, **look)
    cells = punch.partition.polygons
    z = 0.003 * size - scale * solution.punch_displacement(cells.p)
    loops = np.split(cells.indices, cells.offsets[1:-1])
    lines = np.hstack([np.r_[len(k) + 1, k, k[0]] for k in loops])
    cells = pyvista.PolyData(np.vstack([cells.p, z]).T, lines=lines)
    plotter.add_mesh(cells, color="white", line_width=1.2, opacity=0.6, lighting=False)


#: a picture for each program, of the name that it leaves behind
PICTURES: dict[str, Callable[[pyvista.Plotter, Any], None]] = {
    "footing": relief,
    "raft": deflected,
    "outline": sunk,
}


def draw_front(folder: Path, scenes: Path) -> None:
    """Run the programs of the page and write their pictures and scenes into folders."""
    for place in (folder, scenes):
        place.mkdir(parents=True, exist_ok=True)
    names: dict = {}
    for program in programs():
        exec(compile(program, PAGE.name, "exec"), names)
    for name, draw in PICTURES.items():
        plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
        draw(plotter, names[name])
        plotter.view_vector((-0.35, -1.0, 0.85), (0, 0, 1))
        plotter.camera.zoom(1.3)
        plotter.enable_anti_aliasing("ssaa")
        image = plotter.screenshot(transparent_background=True)
        imsave(folder / f"{name}.png", np.ascontiguousarray(cropped(image)))
        plotter.camera.zoom(1 / 1.3)
        write_scene(plotter, scenes / f"{name}.html", "skfem_dual: turn it with the mouse")
        plotter.close()


if __name__ == "__main__":
    draw_front(Path(sys.argv[1]), Path(sys.argv[1]))
