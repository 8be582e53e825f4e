"""Drawing grids, fields and isobars with pyvista: pictures at once, also without a display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, Mesh2D

from ..arguments import checked_flag
from ..contact.region import ContactRegion
from ..grids.checks import MeshReport
from ..grids.couples import GridCouple
from ..grids.dual_mesh import DualMesh
from .field import Field
from .isolines import isoline, label_boxes, smooth_line
from .levels import (
    bar_marks,
    choose_levels,
    color_range,
    common_exponent,
    short_numbers,
    title_with_factor,
)
from .offscreen import one_at_a_time
from .relief import deformed
from .scene import (
    LETTER,
    PLAN,
    add_lines,
    add_points,
    add_texts,
    new_plotter,
    surface,
    view,
    with_bar,
)
from .style import (
    COLORMAP,
    CONTACT,
    OUTLINE,
    SEPARATED,
    DrawnLayer,
    band_colors,
    checked_style,
    fineness,
    layers,
)
from .subject import Drawn, Subject

if TYPE_CHECKING:
    import pyvista

__all__ = ["deformed", "draw", "isobars", "plot"]

UNLIT: dict[str, Any] = {"lighting": False, "show_scalar_bar": False}


@one_at_a_time
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
    legend, off_screen = checked_flag("legend", legend), checked_flag("off_screen", off_screen)
    drawn = list(layers(grid, nodes, report))
    origin = drawn[0].p.mean(axis=1, keepdims=True)
    drawn = [replace(layer, p=layer.p - origin) for layer in drawn]
    plotter = new_plotter(off_screen)
    for height, layer in enumerate(drawn):
        if layer.facets is None:
            add_points(plotter, layer.p, layer.color, 1.2 * layer.width, height)
        else:
            add_lines(plotter, layer.p[:, layer.facets.T], layer.color, layer.width, height)
    if not legend:
        return view(plotter, drawn[0].p, origin)
    _legend(plotter, drawn)
    return view(
        plotter, drawn[0].p, origin, right=90 + 8 * max(len(layer.label) for layer in drawn)
    )


@one_at_a_time
def plot(
    basis: CellBasis,
    values: ArrayLike,
    *,
    title: str | None = None,
    clim: Sequence[float] | None = None,
    cmap: str = COLORMAP,
    edges: bool = False,
    contact: ContactRegion | None = None,
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
    contact : ContactRegion, optional
        ``solution.contact_region``: its edge is drawn, and nothing but a neutral colour where
        the punch has lifted off.
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
        ``clim`` is not increasing; or ``contact`` is no region, or that of another plan.
    """
    checked_style(title, cmap, edges=edges, off_screen=off_screen)
    field = Field.from_basis(basis, values)
    pressed = field if contact is None else field.in_contact(contact)
    origin = field.p.mean(axis=1, keepdims=True)
    field, pressed = _moved(field, -origin), _moved(pressed, -origin)
    low, high, below, beyond = color_range(pressed, clim)
    exponent = common_exponent([low, high])
    plotter = new_plotter(off_screen)
    drawn = surface(pressed)
    (drawn.cell_data if field.flat else drawn.point_data)["values"] = pressed.values
    marks = bar_marks(low, high, below, beyond, exponent)
    colored = plotter.add_mesh(
        drawn, scalars="values", clim=(low, high), cmap=cmap, annotations=marks, **UNLIT
    )
    if edges:
        width = 1.2 * fineness(len(np.unique(field.cells)))
        add_lines(plotter, field.p[:, field.ribs.T], OUTLINE, width, 1)
    add_lines(plotter, field.p[:, field.outline.T], OUTLINE, 2, 2)
    _separation(plotter, contact, field, origin)
    return with_bar(plotter, colored, title_with_factor(title, exponent), field.p, origin)


@one_at_a_time
def isobars(
    pressure: Drawn,
    values: ArrayLike | None = None,
    levels: int | Sequence[float] | ndarray | None = None,
    *,
    title: str | None = None,
    labels: bool = True,
    cmap: str = COLORMAP,
    contact: ContactRegion | None = None,
    scale: float | None = None,
    off_screen: bool = True,
) -> pyvista.Plotter:
    """Draw bands between isobars of a continuous field, the isobars and their values.

    Parameters
    ----------
    pressure : PunchSolution, ElasticSolution, PunchesSolution or CellBasis
        A solution, whose pressure over its mean is drawn as `PunchSolution.pressure_field` has
        it, with the edge of contact; or those of neighbours, also as a sequence; or any
        continuous scalar basis, also of higher order.
    values : (N,) array of float, optional
        One value per DOF of the basis.
    levels : int or sequence of float, optional
        The values of the isobars, of a solution over ``scale``, or about how many. By default
        about eight round numbers in equal steps, zero among them where the sign changes; of a
        solution with a singular edge round numbers that divide the area about equally.
    title : str, optional
        Quantity and unit, above the scalar bar; big numbers get a common factor there.
    labels : bool
        Whether to write the values on the isobars, once each where there is room: inside the
        plan and off other lines and labels.
    cmap : str
        Name of a matplotlib colour map.
    contact : ContactRegion, optional
        Of a basis, ``solution.contact_region``: its edge is drawn, where the field falls to
        zero, and nothing but a neutral colour where the punch has lifted off.
    scale : float, optional
        What the pressure of a solution is divided by; by default its mean.
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
        If ``pressure`` is of another kind, the values are constant, not finite or not one per DOF,
        the levels do not increase or none is between the values, or ``contact`` is no region or
        that of another plan.
    """
    checked_style(title, cmap, labels=labels, off_screen=off_screen)
    subject = Subject.of(pressure, values, title, contact, scale)
    field, pressed, contact = subject.field, subject.pressed, subject.contact
    origin = field.p.mean(axis=1, keepdims=True)
    field, pressed = _moved(field, -origin), _moved(pressed, -origin)
    chosen = choose_levels(pressed, levels, subject.singular)
    n, exponent = len(chosen), common_exponent(chosen)
    texts = short_numbers(chosen, exponent)
    plotter = new_plotter(off_screen)
    # bands meet without common points: what gleams through between them is of the lines' colour
    plotter.add_mesh(surface(pressed), color=OUTLINE, lighting=False)
    colored = plotter.add_mesh(
        _bands(pressed, chosen),
        scalars="band",
        clim=(0, n + 1),
        cmap=band_colors(cmap, n + 1),
        annotations=dict(zip(range(1, n + 1), texts)),
        **UNLIT,
    )
    lines = np.concatenate([isoline(pressed, level)[0] for level in chosen], axis=1)
    add_lines(plotter, lines, OUTLINE, 1.5, 1)
    add_lines(plotter, field.p[:, field.outline.T], OUTLINE, 3, 2)
    _separation(plotter, contact, field, origin)
    letter = LETTER * np.ptp(field.p, axis=1).max() / PLAN
    if labels and (boxes := label_boxes(pressed, chosen, texts, letter)):
        add_texts(
            plotter,
            np.array([box.mean(axis=1) for box in boxes.values()]).T,
            [texts[i] for i in boxes],
            background_color="white",
            background_opacity=0.85,
        )
    title = title_with_factor(subject.title, exponent)
    return with_bar(plotter, colored, title, field.p, origin)


def _separation(
    plotter: Any, contact: ContactRegion | None, field: Field, origin: ndarray
) -> None:
    """The area out of contact, and the edge between."""
    if contact is None or not contact.edge:
        return
    plotter.add_mesh(surface(field, -1), color=SEPARATED, lighting=False)
    lines = map(smooth_line, contact.edge)
    ends = [np.stack([line[:, :-1], line[:, 1:]], axis=2) for line in lines]
    add_lines(plotter, np.concatenate(ends, axis=1) - origin[:, :, None], CONTACT, 6, 3)


def _moved(field: Field, by: ndarray) -> Field:
    """Pictures lie about the origin: VTK calculates in single precision."""
    return replace(field, p=field.p + by)


def _bands(field: Field, levels: ndarray) -> pyvista.PolyData:
    """The triangles cut along the isolines, with ``band``: how many levels lie below."""
    import pyvista
    from vtkmodules.vtkFiltersModeling import vtkBandedPolyDataContourFilter

    whole = surface(field)
    whole.point_data["values"] = field.values
    whole.set_active_scalars("values")
    # pyvista's contour_banded knows equally spaced levels only
    cut = vtkBandedPolyDataContourFilter()
    cut.SetInputData(whole)
    for i, level in enumerate(levels):
        cut.SetValue(i, level)
    cut.Update()
    bands = pyvista.wrap(cut.GetOutput())
    # VTK's own numbers put triangles that are flat at a level or at the maximum a band too high
    values = bands.point_data_to_cell_data()["values"]
    bands.clear_data()
    bands.cell_data["band"] = np.searchsorted(levels, values).astype(float)
    return bands


def _legend(plotter: Any, drawn: list[DrawnLayer]) -> None:
    """The names of the layers to the right of them."""
    low, high = drawn[0].p.min(axis=1), drawn[0].p.max(axis=1)
    unit = (high - low).max() / PLAN
    for i, layer in enumerate(drawn):
        x, y = high[0] + 30 * unit, (low + high)[1] / 2 + unit * 28 * (len(drawn) / 2 - i)
        place = np.array([[x, x + 30 * unit], [y, y]])
        if layer.facets is None:
            add_points(plotter, place.mean(axis=1, keepdims=True), layer.color, 10, 0)
        else:
            add_lines(plotter, place[:, None], layer.color, 3, 0)
        add_texts(
            plotter,
            place[:, 1:] + [[10 * unit], [0]],
            [layer.label],
            justification_horizontal="left",
        )
