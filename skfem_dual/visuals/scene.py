"""Scenes of pyvista in which plans are seen from above, in pixels."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from .field import Field
from .levels import round_ticks, roundest, short_numbers
from .offscreen import one_at_a_time, require_pyvista
from .style import OUTLINE

if TYPE_CHECKING:
    import pyvista

#: pixels of the greater extent of the plan, and of the margins left, at least, below and above it
PLAN, LEFT, BELOW, ABOVE = 800, 110, 80, 40
#: size of texts in pixels, and how wide a digit of them and what stands beside numbers are
LETTER, DIGIT, BESIDE = 16, 9, 34
#: what VTK calls fonts that come from a file
FROM_FILE = 4
#: least height of a number beside a scalar bar
LEAST = 20
#: ticks along the longer side of a plan
MOST = 7
#: finer pixels along one that is seen, over which lines are as wide as they are said to be
WIDER = 2.0


def new_plotter(off_screen: bool) -> Any:  # pyvista's decorators hide its types from mypy
    """A plotter with a white background, or an error that names the remedy."""
    plotter: Any = require_pyvista().Plotter(off_screen=off_screen)
    plotter.screenshot = one_at_a_time(plotter.screenshot)
    plotter.set_background("white")
    # several samples of lines alone leave gaps where their segments meet
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def raised(p: ndarray, layer: int = 0) -> ndarray:
    """Points in space, shape (n, 3); higher layers cover lower ones."""
    height = 1e-4 * layer * np.ptp(p, axis=1).max()
    return np.column_stack([*p, np.full(p.shape[1], height)])


def surface(field: Field, layer: int = 0) -> pyvista.PolyData:
    """The field's triangles in a layer."""
    import pyvista

    return pyvista.PolyData.from_regular_faces(raised(field.p, layer), field.t.T)


def add_lines(plotter: Any, ends: ndarray, color: str, width: float, layer: int) -> None:
    """Segments with the end points ``ends``, shape (2, n, 2)."""
    import pyvista

    if ends.size == 0:  # a single cell has no ribs
        return
    lines = pyvista.line_segments_from_points(raised(ends.reshape(2, -1), layer))
    plotter.add_mesh(lines, **drawn_line(color, width))


def drawn_line(color: str, width: float) -> dict[str, Any]:
    """How a line so wide is drawn."""
    return {"color": color, "line_width": WIDER * width, "lighting": False}


def add_points(plotter: Any, p: ndarray, color: str, size: float, layer: int) -> None:
    """Round points."""
    plotter.add_points(
        raised(p, layer),
        color=color,
        point_size=WIDER * size,
        render_points_as_spheres=True,
        lighting=False,
    )


def add_texts(plotter: Any, p: ndarray, texts: list[str], **options: Any) -> None:
    """Texts about points, above all else."""
    plotter.add_point_labels(
        raised(p, 3),
        texts,
        **{"justification_horizontal": "center", "justification_vertical": "center"} | options,
        font_size=LETTER,
        bold=False,
        text_color="black",
        shape=None,
        show_points=False,
        always_visible=True,
    )


def plan_ticks(low: ndarray, high: ndarray) -> list[ndarray]:
    """Round numbers along x and along y of a plan, in equal steps on both."""
    # far from the origin differences of ticks are not round
    step = round_ticks(0.0, float((high - low).max()), MOST)[1]
    found = []
    for a, b in zip(low, high, strict=True):
        ticks = np.arange(np.ceil(a / step - 1e-9), np.floor(b / step + 1e-9) + 1)
        found.append(step * ticks + 0.0 if len(ticks) else np.array([roundest(a, b)]))  # no -0
    return found


def view(plotter: Any, p: ndarray, origin: ndarray, right: int = 40) -> Any:
    """Look at the plan ``p`` from above, with axes and a margin of ``right`` pixels."""
    low, high = p.min(axis=1), p.max(axis=1)
    unit = (high - low).max() / PLAN
    # a narrow plan has room above it for the scalar bar, below it for its ticks
    room = np.maximum((high - low) / unit, PLAN / 3)
    marked = plan_ticks(low + origin[:, 0], high + origin[:, 0])
    numbers = [short_numbers(ticks, 0) for ticks in marked]
    left = max(LEFT, BESIDE + DIGIT * max(map(len, numbers[1])))
    width, height = room + np.array([left + right, ABOVE + BELOW])
    plotter.window_size = [round(width), round(height)]
    x, y = (low + high) / 2 + unit / 2 * np.array([right - left, ABOVE - BELOW])
    plotter.camera_position = [(x, y, PLAN * unit), (x, y, 0), (0, 1, 0)]
    plotter.enable_parallel_projection()
    plotter.camera.parallel_scale = height * unit / 2
    for axis, horizontal, vertical in ((0, "center", "top"), (1, "right", "center")):
        shift, ticks = origin[axis, 0], marked[axis]
        ends = np.tile(low[:, None, None], (1, len(ticks), 2))
        ends[axis] = ticks[:, None] - shift
        ends[1 - axis] -= unit * np.array([8, 18])  # from the plan outwards
        add_lines(plotter, ends, OUTLINE, 1.5, 0)
        ends[1 - axis] -= unit * 6
        add_texts(
            plotter,
            ends[..., 1],
            numbers[axis],
            justification_horizontal=horizontal,
            justification_vertical=vertical,
        )
    plotter.reset_camera_clipping_range()
    return plotter


def name_axes(plotter: Any, text: str) -> None:
    """What the axes of a plan are, in the corner that both leave free."""
    plotter.add_text(
        text,
        position=(0.15 * LEFT, 0.15 * BELOW),
        font_size=LETTER // 2,  # pyvista takes half the pixels
        color="black",
        font="arial",
    )


def with_bar(plotter: Any, colored: Any, title: str, p: ndarray, origin: ndarray) -> Any:
    """The view of the plan ``p`` with a scalar bar of the actor ``colored`` on its right."""
    right = max(190, 40 + 10 * len(title))
    view(plotter, p, origin, right)
    width, height = plotter.window_size
    bottom, top = BELOW / height, 1 - ABOVE / 2 / height
    add_bar(plotter, colored, title, 1 - (right / 2 + 20) / width, bottom, top - bottom)
    return plotter


def _font() -> str:
    """The font that matplotlib brings along."""
    from matplotlib import get_data_path

    return str(Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf")


def add_bar(plotter: Any, colored: Any, title: str, x: float, y: float, height: float) -> None:
    """A scalar bar of an actor, its lower left corner at x and y, in parts of the window."""
    lookup, room = colored.mapper.lookup_table, height * plotter.window_size[1]
    numbers = lookup.GetNumberOfAnnotatedValues()
    every = max(1, int(np.ceil(numbers * LEAST / room)))
    for i in reversed(range(numbers)):
        if i % every:
            lookup.RemoveAnnotation(lookup.GetAnnotatedValue(i))
    bar = plotter.add_scalar_bar(
        title.replace("|", "\N{DIVIDES}"),  # VTK takes them for columns
        mapper=colored.mapper,
        n_labels=0,
        vertical=True,
        position_x=x,
        position_y=y,
        width=60 / plotter.window_size[0],
        height=height,
        color="black",
        title_font_size=18,
        label_font_size=16,
        font_family="arial",
    )
    # the font of VTK leaves out what it has no letters for, as exponents and Greek
    bar.GetTitleTextProperty().SetFontFamily(FROM_FILE)
    bar.GetTitleTextProperty().SetFontFile(_font())
