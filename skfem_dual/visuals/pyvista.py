"""Drawing grids, fields and isobars with pyvista: pictures at once, also without a display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray
from skfem import CellBasis, Mesh2D

from ..grids.checks import MeshReport
from ..grids.couples import GridCouple
from ..grids.dual_mesh import DualMesh
from .field import CONTINUOUS, Field
from .isolines import isoline, label_points
from .levels import (
    choose_levels,
    color_range,
    common_exponent,
    round_ticks,
    short_numbers,
    title_with_factor,
)
from .offscreen import require_opengl
from .style import COLORMAP, MISSING, OUTLINE, Layer, band_colors, fineness, layers

if TYPE_CHECKING:
    import pyvista

#: pixels of the greater extent of the plan, and of the margins left, below and above it
PLAN, LEFT, BELOW, ABOVE = 800, 110, 80, 40
UNLIT: dict[str, Any] = {"lighting": False, "show_scalar_bar": False}


def draw(
    grid: Mesh2D | DualMesh | GridCouple,
    *,
    nodes: bool = False,
    report: MeshReport | None = None,
    legend: bool = True,
    off_screen: bool = True,
) -> pyvista.Plotter:
    """Draw a mesh, or both grids of a couple together as in Fig. 5 of the paper.

    Parameters
    ----------
    grid : MeshTri, MeshQuad, DualMesh or GridCouple
        What to draw.
    nodes : bool
        Whether to mark the nodes, of both grids if there are two.
    report : MeshReport, optional
        What `check_mesh` found: where required conditions are violated is marked.
    legend : bool
        Whether to name the lines beside the picture.
    off_screen : bool
        Whether to draw into memory, for ``screenshot("grid.png")``; otherwise ``show()`` opens
        a window.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ImportError
        If pyvista is missing.
    RuntimeError
        If there is no working OpenGL.
    TypeError
        If ``grid`` is something else.
    MeshError
        If its coordinates are not finite or vertices do not exist.
    """
    drawn = list(layers(grid, nodes, report))
    origin = drawn[0].p.mean(axis=1, keepdims=True)
    drawn = [replace(layer, p=layer.p - origin) for layer in drawn]
    plotter = _plotter(off_screen)
    for height, layer in enumerate(drawn):
        if layer.facets is None:
            _points(plotter, layer.p, layer.color, 1.2 * layer.width, height)
        else:
            _lines(plotter, layer.p[:, layer.facets.T], layer.color, layer.width, height)
    if not legend:
        return _view(plotter, drawn[0].p, origin)
    _legend(plotter, drawn)
    return _view(
        plotter, drawn[0].p, origin, right=90 + 8 * max(len(layer.label) for layer in drawn)
    )


def plot(
    basis: CellBasis,
    values,
    *,
    title: str | None = None,
    clim: Sequence[float] | None = None,
    cmap: str = COLORMAP,
    edges: bool = False,
    off_screen: bool = True,
) -> pyvista.Plotter:
    """Colour the cells or the triangles by their values.

    Parameters
    ----------
    basis : CellBasis
        Constants on cells (CellwiseBasis, ElementTriP0, ElementQuad0), drawn flat, or
        continuous of first order (ElementTriP1, ElementQuad1), drawn smoothly.
    values : (N,) array of float
        One value per DOF.
    title : str, optional
        Quantity and unit, above the scalar bar.
    clim : (low, high), optional
        Ends of the colour range. By default those of the values, but at most 1.5 interquartile
        ranges of the area beyond the quartiles, which the singular edge of a punch exceeds;
        the scalar bar is marked with < or > there.
    cmap : str
        Name of a matplotlib colour map.
    edges : bool
        Whether to draw the edges of the cells.
    off_screen : bool
        Whether to draw into memory, for ``screenshot("pressure.png")``; otherwise ``show()``
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
        If ``basis`` is of another kind, the values are not finite or not one per DOF, or
        ``clim`` is not increasing.
    """
    field, origin = _local(Field.from_basis(basis, values))
    low, high, below, beyond = color_range(field, clim)
    exponent = common_exponent([low, high])
    plotter = _plotter(off_screen)
    surface = _surface(field)
    (surface.cell_data if field.flat else surface.point_data)["values"] = field.values
    ticks = round_ticks(low, high)
    marks = dict(zip(ticks.tolist(), short_numbers(ticks, exponent)))
    marks |= {low: "<"} if below else {}
    marks |= {high: ">"} if beyond else {}
    colored = plotter.add_mesh(
        surface, scalars="values", clim=(low, high), cmap=cmap, annotations=marks, **UNLIT
    )
    if edges:
        width = 1.2 * fineness(len(np.unique(field.cells)))
        _lines(plotter, field.p[:, field.ribs.T], OUTLINE, width, 1)
    _lines(plotter, field.p[:, field.outline.T], OUTLINE, 2, 2)
    return _bar(plotter, colored, title_with_factor(title, exponent), field.p, origin)


def isobars(
    basis: CellBasis,
    values,
    levels: int | Sequence[float] | ndarray | None = None,
    *,
    title: str | None = None,
    labels: bool = True,
    cmap: str = COLORMAP,
    off_screen: bool = True,
) -> pyvista.Plotter:
    """Draw bands between isobars of a continuous field, the isobars and their values.

    Parameters
    ----------
    basis : CellBasis
        A continuous basis of first order (ElementTriP1 or ElementQuad1).
    values : (N,) array of float
        One value per DOF.
    levels : int or sequence of float, optional
        The values of the isobars, or how many. By default eight round numbers that part the
        area about equally.
    title : str, optional
        Quantity and unit, above the scalar bar; big numbers get a common factor there.
    labels : bool
        Whether to write the values on the isobars, once each where there is room.
    cmap : str
        Name of a matplotlib colour map.
    off_screen : bool
        Whether to draw into memory, for ``screenshot("isobars.png")``; otherwise ``show()``
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
        If ``basis`` is of another kind, the values are constant, not finite or not one per DOF,
        or the levels do not increase or none is between the values.
    """
    field, origin = _local(Field.from_basis(basis, values, CONTINUOUS))
    chosen = choose_levels(field, levels)
    n, exponent = len(chosen), common_exponent(chosen)
    texts = short_numbers(chosen, exponent)
    plotter = _plotter(off_screen)
    # bands meet without common points: what gleams through between them is of the lines' colour
    plotter.add_mesh(_surface(field), color=OUTLINE, lighting=False)
    colored = plotter.add_mesh(
        _bands(field, chosen),
        scalars="band",
        clim=(0, n + 1),
        cmap=band_colors(cmap, n + 1),
        annotations=dict(zip(range(1, n + 1), texts)),
        **UNLIT,
    )
    lines = np.concatenate([isoline(field, level)[0] for level in chosen], axis=1)
    _lines(plotter, lines, OUTLINE, 1.5, 1)
    _lines(plotter, field.p[:, field.outline.T], OUTLINE, 3, 2)
    if labels and (points := label_points(field, chosen)):
        _texts(
            plotter,
            np.array(list(points.values())).T,
            [texts[i] for i in points],
            background_color="white",
            background_opacity=0.6,
        )
    return _bar(plotter, colored, title_with_factor(title, exponent), field.p, origin)


def _plotter(off_screen: bool) -> Any:  # pyvista's decorators hide its types from mypy
    try:
        import pyvista
    except ImportError as error:
        raise ImportError(MISSING.format("pyvista")) from error
    require_opengl()
    plotter: Any = pyvista.Plotter(off_screen=off_screen, line_smoothing=True)
    plotter.set_background("white")
    return plotter


def _local(field: Field) -> tuple[Field, ndarray]:
    """The field about the middle of its points: VTK calculates in single precision."""
    origin = field.p.mean(axis=1, keepdims=True)
    return replace(field, p=field.p - origin), origin


def _raised(p: ndarray, layer: int = 0) -> ndarray:
    """Points in space, shape (n, 3); higher layers cover lower ones."""
    height = 1e-4 * layer * np.ptp(p, axis=1).max()
    return np.column_stack([*p, np.full(p.shape[1], height)])


def _surface(field: Field) -> pyvista.PolyData:
    import pyvista

    return pyvista.PolyData.from_regular_faces(_raised(field.p), field.t.T)


def _bands(field: Field, levels: ndarray) -> pyvista.PolyData:
    """The triangles cut along the isolines, with ``band``: how many levels lie below."""
    import pyvista
    from vtkmodules.vtkFiltersModeling import vtkBandedPolyDataContourFilter

    surface = _surface(field)
    surface.point_data["values"] = field.values
    surface.set_active_scalars("values")
    # pyvista's contour_banded knows equally spaced levels only
    cut = vtkBandedPolyDataContourFilter()
    cut.SetInputData(surface)
    for i, level in enumerate(levels):
        cut.SetValue(i, level)
    cut.Update()
    bands = pyvista.wrap(cut.GetOutput())
    # VTK's own numbers put triangles that are flat at a level or at the maximum a band too high
    values = bands.point_data_to_cell_data()["values"]
    bands.clear_data()
    bands.cell_data["band"] = np.searchsorted(levels, values).astype(float)
    return bands


def _lines(plotter: Any, ends: ndarray, color: str, width: float, layer: int) -> None:
    """Segments with the end points ``ends``, shape (2, n, 2)."""
    import pyvista

    if ends.size == 0:  # a single cell has no ribs
        return
    lines = pyvista.line_segments_from_points(_raised(ends.reshape(2, -1), layer))
    plotter.add_mesh(lines, color=color, line_width=width, lighting=False)


def _points(plotter: Any, p: ndarray, color: str, size: float, layer: int) -> None:
    plotter.add_points(
        _raised(p, layer),
        color=color,
        point_size=size,
        render_points_as_spheres=True,
        lighting=False,
    )


def _texts(plotter: Any, p: ndarray, texts: list[str], **options) -> None:
    plotter.add_point_labels(
        _raised(p, 3),
        texts,
        **{"justification_horizontal": "center", "justification_vertical": "center"} | options,
        font_size=16,
        bold=False,
        text_color="black",
        shape=None,
        show_points=False,
        always_visible=True,
    )


def _legend(plotter: Any, drawn: list[Layer]) -> None:
    """The names of the layers to the right of them."""
    low, high = drawn[0].p.min(axis=1), drawn[0].p.max(axis=1)
    unit = (high - low).max() / PLAN
    for i, layer in enumerate(drawn):
        x, y = high[0] + 30 * unit, (low + high)[1] / 2 + unit * 28 * (len(drawn) / 2 - i)
        place = np.array([[x, x + 30 * unit], [y, y]])
        if layer.facets is None:
            _points(plotter, place.mean(axis=1, keepdims=True), layer.color, 10, 0)
        else:
            _lines(plotter, place[:, None], layer.color, 3, 0)
        _texts(
            plotter,
            place[:, 1:] + [[10 * unit], [0]],
            [layer.label],
            justification_horizontal="left",
        )


def _view(plotter: Any, p: ndarray, origin: ndarray, right: int = 40) -> Any:
    """Look at the plan ``p`` from above, with axes and a margin of ``right`` pixels."""
    low, high = p.min(axis=1), p.max(axis=1)
    unit = (high - low).max() / PLAN
    # a narrow plan has room above it for the scalar bar, below it for its ticks
    room = np.maximum((high - low) / unit, PLAN / 3)
    width, height = room + np.array([LEFT + right, ABOVE + BELOW])
    plotter.window_size = [round(width), round(height)]
    x, y = (low + high) / 2 + unit / 2 * np.array([right - LEFT, ABOVE - BELOW])
    plotter.camera_position = [(x, y, PLAN * unit), (x, y, 0), (0, 1, 0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = height * unit / 2
    for axis, horizontal, vertical in ((0, "center", "top"), (1, "right", "center")):
        most = 2 + int((high - low)[axis] / unit / 160)
        shift = origin[axis, 0]
        ticks = round_ticks(low[axis] + shift, high[axis] + shift, most)
        ends = np.tile(low[:, None, None], (1, len(ticks), 2))
        ends[axis] = ticks[:, None] - shift
        ends[1 - axis] -= unit * np.array([8, 18])  # from the plan outwards
        _lines(plotter, ends, OUTLINE, 1.5, 0)
        ends[1 - axis] -= unit * 6
        _texts(
            plotter,
            ends[..., 1],
            short_numbers(ticks, 0),
            justification_horizontal=horizontal,
            justification_vertical=vertical,
        )
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    return plotter


def _bar(plotter: Any, colored, title: str, p: ndarray, origin: ndarray) -> Any:
    """The view of the plan ``p`` with a scalar bar of the actor ``colored`` on its right."""
    right = max(190, 40 + 10 * len(title))
    _view(plotter, p, origin, right)
    width, height = plotter.window_size
    plotter.add_scalar_bar(
        title,
        mapper=colored.mapper,
        n_labels=0,
        vertical=True,
        position_x=1 - (right / 2 + 20) / width,
        position_y=BELOW / height,
        width=60 / width,
        height=1 - (BELOW + ABOVE / 2) / height,
        color="black",
        title_font_size=18,
        label_font_size=16,
        font_family="arial",
    )
    return plotter
