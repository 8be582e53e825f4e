"""Scenes in space, drawn off-screen by pyvista and put into axes of matplotlib.

So type and scalar bars are those of the other pictures, and there is no ground behind them. In
all of them z points upwards, and what is pressed down is drawn deeper.
"""

from collections.abc import Sequence

import numpy as np
from gallery import sheet
from numpy import ndarray

from skfem_dual.visuals.levels import color_range
from skfem_dual.visuals.relief import Relief
from skfem_dual.visuals.scene import new_plotter
from skfem_dual.visuals.style import BODY, COLORMAP, CONTACT, GROUND, SETTLEMENT
from skfem_dual.visuals.subject import Subject

#: pixels of a scene, before what is empty around it is cut off
SIZE = (1300, 1000)
#: least breadth of what is left, over its height
BREADTH = 1.3
#: how light falls on surfaces
MATTE = {"ambient": 0.4, "diffuse": 0.65, "specular": 0.0}


def stage():
    """An empty scene."""
    plotter = new_plotter(True)
    plotter.window_size = list(SIZE)
    return plotter


def shown(
    plotter,
    label: str = "",
    cmap: str = COLORMAP,
    limits: tuple[float, float] = (0, 1),
    eye: Sequence[float] = (-0.8, -2.2, 1.3),
    bar: dict | None = None,
):
    """Axes with what is seen of a scene from the direction ``eye``, and a scalar bar below."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.ticker import MaxNLocator

    plotter.camera_position = [tuple(eye), (0, 0, 0), (0, 0, 1)]
    plotter.reset_camera()
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    image = cropped(plotter.screenshot(transparent_background=True, return_img=True))
    plotter.close()
    # wide enough for letters to be as large as in other pictures
    missing = max(0, int(BREADTH * len(image)) - image.shape[1])
    image = np.pad(image, ((0, 0), (missing // 2, missing - missing // 2), (0, 0)))
    ax = sheet()
    ax.imshow(image, interpolation="antialiased")
    if label:
        colored = ScalarMappable(Normalize(*limits), cmap)
        place = {"location": "bottom", "fraction": 0.06, "aspect": 35, "shrink": 0.8, "pad": 0.03}
        ticks = MaxNLocator(4)
        ax.figure.colorbar(colored, ax=ax, label=label, ticks=ticks, **place | (bar or {}))
    return ax


def cropped(image: ndarray) -> ndarray:
    """A picture without the transparent rows and columns around what is drawn, (m, n, 4)."""
    rows, columns = (np.flatnonzero(image[..., 3].any(axis=axis)) for axis in (1, 0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def add(plotter, p: ndarray, faces: ndarray, **options):
    """Polygons of equally many vertices; scalars at points or of polygons."""
    import pyvista

    mesh = pyvista.PolyData.from_regular_faces(p.T, faces.T)
    return plotter.add_mesh(mesh, **MATTE | {"show_scalar_bar": False} | options)


def columns(polygons, heights: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """A column on each polygon: points, triangles and the polygon of each triangle.

    Parameters
    ----------
    polygons : Polygons
        Of a partition, as `Partition.polygons` has them.
    heights : (n,) array of float
        One for each.
    """
    own = np.repeat(np.arange(len(heights)), polygons.sizes)
    p = polygons.p[:, polygons.indices]
    n, first = p.shape[1], polygons.offsets[:-1][own]
    k = np.arange(n)
    following = first + (k - first + 1) % polygons.sizes[own]
    middle = np.stack([np.bincount(own, x) for x in p]) / polygons.sizes
    low, high = np.vstack([p, np.zeros(n)]), np.vstack([p, heights[own]])
    points = np.hstack([low, high, np.vstack([middle, heights])])
    sides = [[k, following, n + k], [following, n + following, n + k]]
    t = np.hstack([*sides, [n + k, n + following, 2 * n + own]])
    return points, t, np.tile(own, 3)


def plate(outline: ndarray, height: ndarray | float, thickness: float):
    """A plate with vertical sides over a star-shaped outline: points and triangles."""
    n = outline.shape[1]
    k = np.arange(n)
    following = (k + 1) % n
    low = np.vstack([outline, np.broadcast_to(height, n)])
    high = low + np.array([[0.0], [0.0], [thickness]])
    p = np.hstack([low, high, high.mean(axis=1, keepdims=True)])
    sides = [[k, following, n + k], [following, n + following, n + k]]
    return p, np.hstack([*sides, [n + k, n + following, 0 * k + 2 * n]])


def bent(
    solution,
    label: str,
    values: ndarray | None = None,
    cmap: str = SETTLEMENT,
    limits: tuple[float, float] | None = None,
    bar: dict | None = None,
    eye: Sequence[float] = (-0.8, -2.2, 1.0),
    edge: str = CONTACT,
):
    """A structure on its ground with the edge of contact, displaced.

    Coloured by values at the points of `Relief.structure`, by default their displacements.
    """
    relief = Relief.of(solution)
    plotter = stage()
    origin = np.array([*solution.punch.centre, relief.level])[:, None]
    values = relief.displacement if values is None else values
    limits = limits or (float(values.min()), float(values.max()))
    add(plotter, relief.ground.p - origin, relief.ground.faces.T, color=GROUND)
    look = {"scalars": values, "clim": limits, "cmap": cmap}
    solid = {"show_edges": True, "edge_opacity": 0.25}
    more = solid if solution.punch.boundary is not None else {"smooth_shading": True}
    add(plotter, relief.structure.p - origin, relief.structure.faces.T, **look, **more)
    for line in relief.edge:
        add_line(plotter, line - origin, edge)
    return shown(plotter, label, cmap, limits, eye, bar)


def pressed(solution, label: str, scale: float = 1.0, eye: Sequence[float] = (-0.8, -2.2, 1.0)):
    """Pressures over ``scale`` below a structure, of which no more than an outline is seen."""
    relief = Relief.of(solution)
    plotter = stage()
    origin = np.array([*solution.punch.centre, relief.level])[:, None]
    field = Subject.of(solution, None, None, None, scale).pressed
    limits = color_range(field)[:2]
    surface = relief.on_plan(field)
    add(plotter, relief.ground.p - origin, relief.ground.faces.T, color=GROUND)
    body = {"color": BODY, "opacity": 0.25}
    add(plotter, relief.structure.p - origin, relief.structure.faces.T, **body)
    look = {"scalars": field.values, "clim": limits, "cmap": COLORMAP}
    add(plotter, surface.p - origin, surface.faces.T, **look)
    for line in relief.edge:
        add_line(plotter, line - origin)
    return shown(plotter, label, COLORMAP, limits, eye, {"extend": "max"})


def add_line(plotter, x: ndarray, color: str = CONTACT, width: float = 5) -> None:
    """A line through points of shape (3, n)."""
    import pyvista

    plotter.add_mesh(pyvista.lines_from_points(x.T), color=color, line_width=width, lighting=False)
