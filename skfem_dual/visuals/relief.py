"""A structure that bends and the ground under it in space, displacements drawn larger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy import ndarray

from ..arguments import checked_choice, checked_instance, checked_number
from ..grids.surroundings import surroundings
from ..solutions.displaced import DisplacedStructure, gap_at
from ..solutions.elastic_solution import ElasticSolution
from .field import Field
from .isolines import smooth_line
from .levels import bar_marks, color_range, common_exponent, title_with_factor
from .offscreen import one_at_a_time
from .scene import add_bar, drawn_line, new_plotter
from .style import BODY, COLORMAP, CONTACT, GROUND, OUTLINE, checked_style
from .subject import Subject

if TYPE_CHECKING:
    import pyvista

#: the largest displacement as it is drawn, over the greatest extent of the structure
DRAWN = 0.2
#: surfaces in touch lie so far above each other, over the extent, that none shines through
ABOVE = 3e-3
#: width of the ground that is drawn, over the extent of the plan
BEYOND = 0.35
#: a plate of fewer triangles is cut finer: between its nodes it is curved
TRIANGLES = 2000

Shown = Literal["displacement", "pressure"]


@dataclass(frozen=True, eq=False)
class Surface:
    """Polygons of equally many vertices in space.

    Attributes
    ----------
    p : (3, n) array of float
        Displaced points.
    faces : (k, m) array of int
        Vertices of each polygon.
    """

    p: ndarray
    faces: ndarray


@dataclass(frozen=True, eq=False)
class Relief:
    """Structure and ground, displaced.

    Attributes
    ----------
    scale : float
        How many times larger than they are displacements are drawn, and the gap of the unloaded
        structure with them.
    structure : Surface
        A plate, or the boundary of a solid.
    displacement : (n,) array of float
        At its points: deflection of a plate, length of the displacement of a solid.
    ground : Surface
        The surface of the ground, a little deeper than it is.
    edge : list of (3, k) arrays of float
        The edge of contact, a little higher than it is.
    level : float
        Height at which the ground lay.
    """

    solution: ElasticSolution
    scale: float
    structure: Surface
    displacement: ndarray
    ground: Surface
    edge: list[ndarray]
    level: float

    @classmethod
    def of(cls, solution: ElasticSolution, scale: float | None = None) -> Relief:
        """Of a solution, by default displaced so that it is seen."""
        punch = solution.punch
        structure = DisplacedStructure.of(solution, TRIANGLES)
        mesh, moved, level = structure.mesh, structure.displacement, structure.level
        up = punch.interface.up
        solid, size = mesh.dim() == 3, float(np.ptp(structure.p, axis=1).max())
        faces = (mesh.facets[:, mesh.boundary_facets()] if solid else mesh.t).T
        length, at = np.sqrt(np.sum(moved**2, axis=0)), moved + structure.rise
        around, t = surroundings(punch.partition, punch.fan, BEYOND)
        t = np.hstack([punch.fan.t, t + punch.fan.p.shape[1]])
        around = np.hstack([punch.fan.p, around])
        settled = solution.ground_displacement(around)
        largest = max(np.sqrt(np.sum(at**2, axis=0)).max(), np.abs(settled).max())
        if scale is None:
            scale = _round(DRAWN * size / largest) if largest > 0 else 1.0
        layer = ABOVE * size
        lines = [smooth_line(line) for line in solution.contact_region.edge]
        return cls(
            solution,
            scale,
            Surface(structure.p + scale * at, faces),
            length if solid else -moved[2],
            Surface(np.vstack([around, level - up * (layer + scale * settled)]), t.T),
            [
                np.vstack([x, level + up * (2 * layer - scale * solution.ground_displacement(x))])
                for x in lines
            ],
            level,
        )

    def on_plan(self, field: Field) -> Surface:
        """The triangles of a field on the plan, a little above the structure."""
        above, punch = ABOVE * np.ptp(self.structure.p, axis=1).max(), self.solution.punch
        down = self.solution.deflection(field.p) - gap_at(punch, field.p)
        z = self.level + punch.interface.up * (above - self.scale * down)
        return Surface(np.vstack([field.p, z]), field.t.T)


def _round(value: float) -> float:
    """1, 2 or 5 times a power of ten, not above."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(k for k in (1, 2, 5) if k * power <= value * (1 + 1e-12)) * power)


@one_at_a_time
def deformed(
    solution: ElasticSolution,
    *,
    show: Shown = "displacement",
    scale: float | None = None,
    title: str | None = None,
    cmap: str = COLORMAP,
    off_screen: bool = True,
) -> pyvista.Plotter:
    """Draw a structure on the ground in space, displaced, with the edge of contact.

    Parameters
    ----------
    solution : ElasticSolution
        Of a plate or a solid.
    show : {"displacement", "pressure"}
        What is coloured: the deflection of a plate, the length of the displacement of a solid;
        or the contact pressure over its mean, under a solid that is drawn transparent.
    scale : float, optional
        How many times larger than they are displacements are drawn, and the gap of the unloaded
        structure with them. By default a round number that makes the largest 8 to 20 % of the
        extent of the structure.
    title : str, optional
        Quantity and unit, above the scalar bar.
    cmap : str
        Name of a matplotlib colour map.
    off_screen : bool
        Whether to draw into memory, for ``screenshot("deformed.png")``; otherwise ``show()``
        opens a window.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ImportError
        If pyvista is missing.
    RuntimeError
        If there is no working OpenGL.
    TypeError, ValueError
        If an argument is of another kind, ``scale`` is not positive, or pressures are asked for
        and there are none.
    """
    checked_instance("solution", solution, ElasticSolution)
    checked_choice("show", show, ("displacement", "pressure"))
    checked_style(title, cmap, off_screen=off_screen)
    if scale is not None:
        scale = checked_number("scale", scale, above=0)
    relief = Relief.of(solution, scale)
    origin = np.array([*solution.punch.centre, relief.level])[:, None]
    pressed, solid = show == "pressure", solution.punch.boundary is not None
    coloured = Coloured.of(relief, pressed, title)
    low, high, below, beyond = coloured.limits
    exponent = common_exponent([low, high])
    plotter = new_plotter(off_screen)
    _add(plotter, relief.ground, origin, color=GROUND, smooth_shading=True)
    if pressed:
        see_through = {"opacity": 0.25} if solid else {}
        _add(plotter, relief.structure, origin, color=BODY, **see_through)
    faceted = {"show_edges": True, "edge_opacity": 0.25}
    actor = _add(
        plotter,
        coloured.surface,
        origin,
        scalars=coloured.values,
        clim=(low, high),
        cmap=cmap,
        annotations=bar_marks(low, high, below, beyond, exponent),
        show_scalar_bar=False,
        **(faceted if solid and not pressed else {"smooth_shading": True}),
    )
    for line in relief.edge:
        _add_line(plotter, line - origin)
    _look(plotter, title_with_factor(coloured.title, exponent), actor, relief)
    return plotter


@dataclass(frozen=True, eq=False)
class Coloured:
    """The surface that is coloured, by what, between which limits and whether values pass them."""

    surface: Surface
    values: ndarray
    limits: tuple[float, float, bool, bool]
    title: str

    @classmethod
    def of(cls, relief: Relief, pressed: bool, title: str | None) -> Coloured:
        """The structure by its displacement, or the plan by the pressure."""
        if pressed:
            subject = Subject.of(relief.solution, None, title, None)
            field = subject.pressed
            limits, name = color_range(field), subject.title or ""
            return cls(relief.on_plan(field), field.values, limits, name)
        solid = relief.solution.punch.boundary is not None
        values = relief.displacement
        name = "displacement" if solid else "deflection"
        limits = float(values.min()), float(values.max()), False, False
        return cls(relief.structure, values, limits, name if title is None else title)


def _add(plotter: Any, surface: Surface, origin: ndarray, **options: Any) -> Any:
    import pyvista

    mesh = pyvista.PolyData.from_regular_faces((surface.p - origin).T, surface.faces)
    return plotter.add_mesh(mesh, **{"ambient": 0.35, "diffuse": 0.7} | options)


def _add_line(plotter: Any, x: ndarray) -> None:
    import pyvista

    plotter.add_mesh(pyvista.lines_from_points(x.T), **drawn_line(CONTACT, 6))


def _look(plotter: Any, title: str, colored: Any, relief: Relief) -> None:
    """From the front and above, with a scalar bar and the scale."""
    plotter.window_size = [1200, 800]
    up = relief.solution.punch.interface.up
    plotter.camera_position = [(-0.8, -2.2, up), (0, 0, 0), (0, 0, up)]
    plotter.reset_camera()
    plotter.camera.zoom(1.2)
    plotter.camera.SetWindowCenter(0.14, -0.03)
    add_bar(plotter, colored, title, 0.87, 0.2, 0.6)
    shaped = " and gap" if relief.solution.punch.gap is not None else ""
    plotter.add_text(
        f"displacements{shaped} × {relief.scale:g}", position=(20, 16), font_size=11, color=OUTLINE
    )
