import os
import signal
import sys
import time
import warnings
from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from threading import Event
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementQuad1,
    ElementQuad2,
    ElementTriArgyris,
    ElementTriDG,
    ElementTriP0,
    ElementTriP1,
    ElementTriP1DG,
    ElementTriP2,
    ElementTriP3,
    ElementVector,
    MeshLine,
    MeshQuad,
    MeshTri,
    MeshTri2,
)

from skfem_dual import (
    DualMesh,
    GridCouple,
    HalfSpace,
    Plan,
    RigidPunch,
    RigidPunches,
    check_mesh,
    general_triangulation,
)
from skfem_dual.bodies.paths import moment_rotation
from skfem_dual.contact.region import ContactRegion
from skfem_dual.contact.shapes import Paraboloid, Sphere
from skfem_dual.errors import ConvergenceWarning, ResolutionWarning
from skfem_dual.grids import generate
from skfem_dual.grids.corners import signed_areas
from skfem_dual.grids.generate import disc as fine_disc
from skfem_dual.grids.generate import rectangle
from skfem_dual.grids.outline import distance_to_segments
from skfem_dual.visuals import matplotlib as with_matplotlib
from skfem_dual.visuals import offscreen
from skfem_dual.visuals import pyvista as with_pyvista
from skfem_dual.visuals.field import Field, continuous
from skfem_dual.visuals.isolines import isoline, label_boxes, smooth_line
from skfem_dual.visuals.levels import (
    bar_marks,
    choose_levels,
    color_range,
    common_exponent,
    quantiles,
    round_ticks,
    short_numbers,
)
from skfem_dual.visuals.scene import BELOW, LEFT, PLAN, plan_ticks

BACKENDS = [with_matplotlib, with_pyvista]
DISC = MeshTri.init_circle(4)
COARSE = MeshTri.init_circle(2)
STRIPS = MeshTri.init_tensor(np.linspace(0, 1, 41), np.linspace(0, 1, 11))


def punch(mesh, scale=1.0, tilt=0.0):
    """Pressure under a flat circular punch, finite at the edge."""
    r = np.minimum(np.hypot(*mesh.p), 0.98)
    return scale * (1 + tilt * mesh.p[0]) / np.sqrt(1 - r**2)


def nodal(mesh):
    return CellBasis(mesh, ElementTriP1() if isinstance(mesh, MeshTri) else ElementQuad1())


@pytest.fixture(autouse=True)
def close_pictures():
    yield
    import matplotlib.pyplot as plt
    import pyvista

    plt.close("all")
    pyvista.close_all()


@pytest.fixture(scope="module")
def dual():
    return DualMesh.from_mesh(MeshTri.init_lshaped().refined(2))


# fields


def test_quadrilaterals_are_drawn_as_four_triangles():
    mesh = MeshQuad().refined(2)
    field = Field.from_basis(nodal(mesh), mesh.p[0] * mesh.p[1])
    assert field.t.shape == (3, 4 * mesh.nelements)
    assert np.isclose(field.areas.sum(), 1)
    assert np.allclose(field.values, field.p[0] * field.p[1])  # bilinear also in the middles
    flat = Field.from_basis(CellBasis(mesh, ElementQuad0()), np.arange(mesh.nelements))
    assert np.allclose(np.bincount(flat.cells, flat.areas), 1 / mesh.nelements)
    assert np.array_equal(flat.values, flat.cells)


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_cells_keep_area_outline_and_ribs(dual, grid):
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    field = Field.from_basis(basis, np.arange(basis.N))
    assert np.allclose(np.bincount(field.cells, field.areas), basis.partition.areas)
    length = lambda sides: np.hypot(*np.diff(field.p[:, sides], axis=1)[:, 0]).sum()  # noqa: E731
    ribs = basis.partition.facets[:, basis.partition.f2c[1] != -1]
    p = basis.partition.polygons.p
    assert np.isclose(length(field.outline), 8)
    assert np.isclose(length(field.ribs), np.hypot(*np.diff(p[:, ribs], axis=1)[:, 0]).sum())


def test_basis_on_some_elements_draws_these_only():
    elements = DISC.elements_satisfying(lambda x: x[0] > 0)
    basis = CellBasis(DISC, ElementTriP1(), elements=elements)
    field = Field.from_basis(basis, DISC.p[0])
    assert field.t.shape[1] == len(elements)
    assert field.values[field.t].min() > -0.2


def test_polar_grid_has_no_outline_along_its_rays():
    r, angles = np.linspace(0, 1, 4), np.arange(8) * np.pi / 4
    p = np.array([np.outer(r, f(angles)).ravel() for f in (np.cos, np.sin)])
    i, j = np.divmod(np.arange(24), 8)
    t = np.array([8 * i + j, 8 * i + 8 + j, 8 * i + 8 + (j + 1) % 8, 8 * i + (j + 1) % 8])
    field = Field.from_basis(CellBasis(MeshQuad(p, t), ElementQuad0()), np.arange(24.0))
    assert np.allclose(np.hypot(*field.p[:, field.outline.ravel()]), 1)
    assert field.outline.shape == (2, 8)
    assert field.ribs.shape == (2, 8 * 3 + 8 * 2)


# levels and numbers


@pytest.mark.parametrize("value", [1 / 3, 0.159, -123456.789, 0.0])
def test_fields_constant_but_for_rounding_have_one_colour(value):
    noise = 1 + 1e-15 * np.random.default_rng(0).random(DISC.nvertices)
    field = Field.from_basis(nodal(DISC), value * noise)
    low, high, *_ = color_range(field)
    assert low < value < high
    assert high - low == pytest.approx(abs(value) or 1.0)
    field = replace(field, values=np.where(np.arange(len(field.values)) == 3, 9.0, field.values))
    assert color_range(field)[1] == 9.0


@pytest.mark.parametrize("scale", [1.0, 2.3e5, -1e6, 1e-9])
def test_levels_at_a_singular_edge_part_the_area_evenly(scale):
    field = Field.from_basis(nodal(DISC), punch(DISC, scale))
    levels = choose_levels(field, singular=True)
    assert len(levels) == 8
    assert np.all(np.diff(levels) > 0)
    assert field.values.min() < levels[0]
    assert levels[-1] < field.values.max()
    radius = np.sort(np.sqrt(1 - (scale / levels) ** 2))  # area inside: radius**2
    assert np.all(np.diff([0, *radius**2, 1]) < 0.2)
    assert all(len(text) <= 5 for text in short_numbers(levels, common_exponent(levels)))


@settings(max_examples=20, deadline=None)
@given(
    middle=st.floats(-5, 5), scale=st.sampled_from([1e-9, 3e-3, 1.0, 7e5]), n=st.integers(3, 15)
)
def test_default_levels_are_equidistant_round_numbers(middle, scale, n):
    field = Field.from_basis(nodal(COARSE), scale * (COARSE.p[0] + middle))
    levels = choose_levels(field, n)
    low, high = field.values.min(), field.values.max()
    step = (levels[-1] - levels[0]) / (len(levels) - 1)
    assert np.diff(levels) == pytest.approx(np.full(len(levels) - 1, step))
    assert low < levels[0] < low + 1.05 * step
    assert high - 1.05 * step < levels[-1] < high
    assert 0.6 * n - 1 < len(levels) < 1.7 * n + 1
    digits = step / 10 ** np.floor(np.log10(step) + 1e-9)
    assert min(abs(digits - x) for x in (1, 2, 2.5, 5)) < 1e-6
    assert levels / step == pytest.approx(np.round(levels / step), abs=1e-6)
    if low < -0.1 * step and high > 0.1 * step:
        assert 0 in levels


@pytest.mark.parametrize("tilt", [1.5, 4.0])
def test_zero_is_a_level_where_a_singular_pressure_changes_sign(tilt):
    field = Field.from_basis(nodal(DISC), punch(DISC, tilt=tilt))
    levels = choose_levels(field, singular=True)
    assert 0 in levels
    assert levels[-1] > 0
    assert (levels[0] < 0) == (tilt > 2)  # hardly any area is below zero otherwise


def test_levels_of_a_partial_contact():
    partial = Field.from_basis(nodal(DISC), np.maximum(DISC.p[0] - 0.5, 0))
    for singular in (False, True):
        levels = choose_levels(partial, 5, singular)
        assert 4 <= len(levels) <= 6
        assert levels[0] > 0
    assert len(choose_levels(partial, 1)) in (1, 2)


@pytest.mark.parametrize(
    ("levels", "message"),
    [
        ([1.0, 1.0], "increasing levels"),
        ([2.0, 1.5], "increasing levels"),
        ([1.5, np.nan], "finite"),
        ([], "levels with at least 1 items"),
        (0, "levels from 1 to 1000, got 0"),
        ([10.0, 20.0], "expected a level between 1"),
        ([0.0, 20.0], "expected a level between 1"),
    ],
)
def test_wrong_levels_are_refused(levels, message):
    field = Field.from_basis(nodal(DISC), punch(DISC))
    with pytest.raises(ValueError, match=message):
        choose_levels(field, levels)


def test_color_range_leaves_out_the_singular_edge():
    field = Field.from_basis(nodal(DISC), punch(DISC))
    low, high, below, beyond = color_range(field)
    assert (low, below, beyond) == (field.values.min(), False, True)
    assert 2.5 < high < 4 < field.values.max()
    assert color_range(Field.from_basis(nodal(DISC), DISC.p[0])) == (-1, 1, False, False)
    assert color_range(field, (0, 2)) == (0, 2, False, True)
    constant = Field.from_basis(CellBasis(DISC, ElementTriP0()), np.ones(DISC.nelements))
    assert color_range(constant) == (0.5, 1.5, False, False)
    with pytest.raises(ValueError, match="low < high"):
        color_range(field, (2, 1))
    with pytest.raises(ValueError, match=r"finite clim\[1\], got nan"):
        color_range(field, (0, np.nan))
    with pytest.raises(TypeError, match="two numbers for clim"):
        color_range(field, (1,))


def test_quantiles_of_a_linear_field_on_a_square():
    mesh = MeshTri().refined(4)
    field = Field.from_basis(nodal(mesh), mesh.p[0])
    assert np.allclose(quantiles(field, [0, 0.25, 0.5, 1]), [0, 0.25, 0.5, 1], atol=0.02)


def test_numbers_are_short():
    assert short_numbers([0.1 + 0.2, 1.0], 0) == ["0.3", "1"]
    assert short_numbers([-2.4e-7, 1e-7], common_exponent([-2.4e-7, 1e-7])) == ["-240", "100"]
    assert short_numbers([1 / 3], 0) == ["0.333"]
    assert np.allclose(round_ticks(-1, 1, 5), [-1, -0.5, 0, 0.5, 1])


# isolines


@pytest.mark.parametrize("mesh", [DISC, MeshQuad().refined(4)], ids=["triangles", "quads"])
def test_isolines_of_a_paraboloid_are_circles(mesh):
    field = Field.from_basis(nodal(mesh), (mesh.p**2).sum(axis=0))
    segments, lines = isoline(field, 0.4)
    assert np.allclose(np.hypot(*segments), np.sqrt(0.4), atol=4e-3)
    assert set(lines) == {0}
    quarter = 1 if isinstance(mesh, MeshTri) else 0.25
    length = np.hypot(*(segments[..., 1] - segments[..., 0])).sum()
    assert np.isclose(length, quarter * 2 * np.pi * np.sqrt(0.4), rtol=5e-3)


def test_isolines_tell_loops_apart():
    mesh = MeshTri.init_tensor(np.linspace(-2, 2, 81), np.linspace(-1, 1, 41))
    field = Field.from_basis(
        nodal(mesh), np.minimum(*(np.hypot(mesh.p[0] - a, mesh.p[1]) for a in (-1, 1)))
    )
    segments, lines = isoline(field, 0.5)
    assert len(set(lines)) == 2
    for line in set(lines):
        assert len(set(np.sign(segments[0, lines == line].ravel()))) == 1


PLANS = {
    "disc": (DISC, lambda p: punch(DISC)),
    "tilted": (DISC, lambda p: punch(DISC, tilt=0.45)),
    "waves": (MeshTri().refined(5), lambda p: np.sin(9 * p[0]) * np.cos(7 * p[1])),
    "L": (MeshTri.init_lshaped().refined(4), lambda p: p[0] ** 2 + 0.5 * p[1]),
}


@pytest.mark.parametrize("letter", [0.02, 0.05])
@pytest.mark.parametrize(("mesh", "values"), PLANS.values(), ids=PLANS)
def test_boxes_of_labels_have_room(mesh, values, letter):
    field = Field.from_basis(nodal(mesh), values(mesh.p))
    levels = choose_levels(field)
    texts = short_numbers(levels, 0)
    boxes = label_boxes(field, levels, texts, letter)
    assert boxes
    low, high = np.array(list(boxes.values())).transpose(2, 0, 1)
    # off each other
    over = (low[:, None] < high[None]) & (low[None] < high[:, None])
    assert np.array_equal(over.all(axis=2), np.eye(len(low), dtype=bool))
    lines = {i: isoline(field, level)[0] for i, level in enumerate(levels)}
    edge = field.p[:, field.outline].transpose(0, 2, 1)
    for i, box in boxes.items():
        # on the line, in the middle of the box
        middle = box.mean(axis=1)[:, None]
        a, b = lines[i].transpose(2, 0, 1)
        a, b = (x[:, np.any(a != b, axis=0)] for x in (a, b))  # none through a node
        along = np.clip(np.sum((middle - a) * (b - a), 0) / np.sum((b - a) ** 2, 0), 0, 1)
        assert np.hypot(*(a + along * (b - a) - middle)).min() < 1e-9
        assert np.ptp(box, axis=1)[0] > 0.5 * letter * len(texts[i])
        # no other line and no edge in it, sampled far more finely than by the code
        for segments in [edge, *(line for j, line in lines.items() if j != i)]:
            t = np.linspace(0, 1, 40)
            x, y = segments[..., :1] * (1 - t) + segments[..., 1:] * t
            inside = (box[0, 0] < x) & (x < box[0, 1]) & (box[1, 0] < y) & (y < box[1, 1])
            assert not inside.any()


def test_labels_keep_off_what_is_plotted_before():
    """A mark where a label would be moves it, on the axes of a picture too."""
    from skfem_dual.visuals.matplotlib import isobars

    basis, values = nodal(DISC), punch(DISC, tilt=0.45)
    first = isobars(basis, values)
    marks = np.array([text.get_position() for text in first.texts]).T
    ax = first.figure.add_subplot()
    ax.plot(*marks, "o")
    texts = isobars(basis, values, ax=ax).texts
    assert len(texts) >= len(marks.T) - 2
    boxes = [text.get_window_extent().get_points() for text in texts]
    low, high = np.array(boxes).transpose(1, 2, 0)[..., None]
    dots = ax.transData.transform(marks.T).T[:, None]
    assert not ((low < dots) & (dots < high)).all(axis=0).any()


def test_lines_without_room_have_no_label():
    field = Field.from_basis(nodal(STRIPS), STRIPS.p[0])
    levels = np.array([0.5, 0.51, 0.52, 0.8])
    boxes = label_boxes(field, levels, ["0.50", "0.51", "0.52", "0.80"], 0.04)
    assert list(boxes) == [3]


def test_smooth_lines_stay_where_they_are():
    angle = np.sort(np.random.default_rng(0).uniform(0, np.pi, 60))
    noise = 0.0015 * np.random.default_rng(1).normal(size=60)
    rough = (1 + noise) * np.array([np.cos(angle), np.sin(angle)])
    found = smooth_line(rough)
    assert found[:, [0, -1]] == pytest.approx(rough[:, [0, -1]], abs=1e-3)
    assert np.abs(np.hypot(*found) - 1).max() < 0.004
    turns = [np.abs(np.diff(np.unwrap(np.arctan2(*np.diff(x))))).max() for x in (rough, found)]
    assert turns[1] < 0.2 * turns[0]
    assert np.array_equal(smooth_line(rough[:, :4]), rough[:, :4])
    closed = np.array([np.cos(angle * 2), np.sin(angle * 2)])
    closed = np.hstack([closed, closed[:, :1]])
    assert np.hypot(*(smooth_line(closed)[:, 0] - smooth_line(closed)[:, -1])) < 1e-6


def test_the_outline_of_one_cell_is_smoothed_without_a_word():
    """Contact on a single square cell of a rough surface, of which scipy would warn."""
    cell = np.array([[*[0] * 2, *[1] * 10, *[0] * 9], [*[0] * 7, *[1] * 10, *[0] * 4]])
    off = [
        [0, 1.183, -1.183, 0, 0.102, 0.179, 1.183, 1.183, 0.163, 0.082, 0, -1.183, 1.183, 0,
         -0.103, -0.238, -1.183, -1.183, -0.299, -0.152, 0],
        [0, -0.885, -0.885, 0.061, 0.196, 0.298, 1.481, -0.885, 0.298, 0.38, 0.461, 1.481, 1.481,
         0.478, 0.4, 0.298, -0.885, 1.481, 0.298, 0.146, 0],
    ]  # fmt: skip
    found = smooth_line(cell + 1e-6 * np.array(off))
    assert found.min() > -0.5
    assert found.max() < 1.5


def test_the_outline_of_some_cells_has_no_scallops():
    """Most of its points lie at the corners of the cells, next to each other."""
    along, none = np.repeat(np.arange(3.0), 5), np.zeros(15)
    block = np.array(
        [[*along, *none + 3, *3 - along, *none], [*none, *along, *none + 3, *3 - along]]
    )
    block += 1e-6 * np.random.default_rng(0).uniform(-1, 1, block.shape)
    found = smooth_line(np.hstack([block, block[:, :1]]))
    off = np.abs(found - 1.5).max(axis=0) - 1.5
    assert off.max() < 0.15
    assert off.min() > -0.3


# higher orders


@pytest.mark.parametrize(
    "mesh", [MeshTri().refined(2), MeshQuad().refined(2)], ids=["tri", "quad"]
)
def test_elements_of_higher_order_are_drawn_as_they_are(mesh):
    element = ElementTriP2() if isinstance(mesh, MeshTri) else ElementQuad2()
    basis = CellBasis(mesh, element)
    x, y = basis.doflocs
    field = continuous(basis, x**2 + y**2)
    assert field.values == pytest.approx(np.sum(field.p**2, axis=0), abs=2e-3)
    assert len(np.unique(field.p.round(9), axis=1).T) == field.p.shape[1]
    radius = np.hypot(*isoline(field, 0.49)[0])
    assert radius == pytest.approx(np.full_like(radius, 0.7), abs=1e-3)
    assert set(isoline(field, 0.49)[1]) == {0}  # one line across all elements


def test_fields_that_jump_or_have_directions_are_refused():
    jumping = CellBasis(DISC, ElementTriDG(ElementTriP1()))
    with pytest.raises(ValueError, match=r"jumps at .*project it onto ElementTriP1"):
        continuous(jumping, np.arange(jumping.N))
    with pytest.raises(ValueError, match="basis of scalars, got one of ElementVector"):
        continuous(CellBasis(DISC, ElementVector(ElementTriP2())), np.zeros(2))


# solutions


@pytest.fixture(scope="module")
def lifted():
    dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    return RigidPunch(HalfSpace(1.0, 0.0), dual.basis()).solve(1.0, (0.5, 0.0))


@pytest.mark.parametrize("visuals", BACKENDS)
def test_isobars_of_a_solution_are_those_of_its_pressure_field(visuals, lifted):
    levels = [0.4, 0.7, 1.5]
    picture = visuals.isobars(lifted, levels=levels, labels=False)
    x = contours(picture)
    if visuals is with_pyvista:  # drawn about the origin
        x = x + lifted.punch.basis.mesh.p.mean(axis=1, keepdims=True)
    inside = np.hypot(*x) < 0.93
    p = lifted.pressure_at(x[:, inside]) / lifted.mean_pressure
    nearest = np.abs(p[:, None] / np.array(levels) - 1).min(axis=1)
    assert np.median(nearest) < 0.05  # constants times the edge law in each cell
    # nothing where the punch has lifted off
    assert x[0].min() > min(line[0].min() for line in lifted.contact_region.edge) - 0.02


@pytest.fixture(scope="module")
def pair():
    mesh = MeshTri.init_circle(3)
    punches = [
        RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(mesh.translated((x, 0.0))).basis())
        for x in (0.0, 2.5)
    ]
    loads = {"force": 1.0, "at": (0.5, 0.0)}, {"force": 0.5, "at": (2.5, 0.0)}
    return RigidPunches(punches).solve(loads)


@pytest.mark.parametrize("visuals", BACKENDS)
def test_neighbours_are_drawn_together(visuals, pair):
    """On one scale: isobars run where the pressure of either is theirs, and on both plans."""
    levels = [0.3, 0.5]
    x = contours(visuals.isobars(pair, levels=levels, labels=False, scale=0.5))
    if visuals is with_matplotlib:
        same = contours(pair.plot(levels=levels, labels=False, scale=0.5))
        np.testing.assert_array_equal(same, x)
    if visuals is with_pyvista:
        x = x + np.hstack([s.punch.basis.mesh.p for s in pair]).mean(axis=1, keepdims=True)
    for centre, solution in zip((0.0, 2.5), pair.solutions, strict=True):
        on = np.hypot(x[0] - centre, x[1]) < 0.93
        p = solution.pressure_at(x[:, on]) / 0.5
        assert on.sum() > 20
        assert np.median(np.abs(p[:, None] / np.array(levels) - 1).min(axis=1)) < 0.05


@pytest.mark.parametrize("scale", [0.7, *slow(1.0)])
def test_labels_of_matplotlib_are_in_their_boxes(lifted, scale):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7 * scale, 6 * scale), layout="compressed")
    ax = with_matplotlib.isobars(lifted, ax=figure.add_subplot())
    figure.draw_without_rendering()
    texts = [text for text in ax.texts if text.get_text()]
    assert len(texts) >= 2
    boxes = np.array([text.get_window_extent().get_points() for text in texts])
    frame = ax.get_window_extent().get_points()
    low, high = boxes[:, 0], boxes[:, 1]
    assert np.all((low >= frame[0]) & (high <= frame[1]))
    over = (low[:, None] < high[None]) & (low[None] < high[:, None])
    assert np.array_equal(over.all(axis=2), np.eye(len(low), dtype=bool))
    corners = ax.transData.inverted().transform(np.vstack([low, high]))
    assert np.all(np.hypot(*corners.T) < 1)


def test_solutions_plot_themselves(lifted):
    ax = lifted.plot(title="p", levels=[0.5, 1.0])
    assert ax.figure.axes[1].get_ylabel() == "p"
    for visuals in BACKENDS:
        with pytest.raises(TypeError, match="a solution alone"):
            visuals.isobars(lifted, lifted.pressure)
        with pytest.raises(TypeError, match=r"one value for each of the .* DOFs, got none"):
            visuals.isobars(nodal(DISC))
        for other in (None, lifted.punch, DualMesh.from_mesh(DISC)):
            with pytest.raises(TypeError, match=r"a solution or a CellBasis .*punch\.solve\("):
                visuals.isobars(other)
        with pytest.raises(TypeError, match=r"got RigidPunch. Remedy: punch\.solve\("):
            visuals.isobars([lifted.punch])
    nothing = lifted.punch.solve(0.0)
    with pytest.raises(ValueError, match="expected a load to draw isobars of"):
        nothing.plot()


def test_notebooks_show_tables_and_pictures(lifted, monkeypatch):
    dual = lifted.punch.basis.dual
    objects = lifted, dual, check_mesh(dual.mesh)
    pages = [shown._repr_html_() for shown in objects]
    for html in pages:
        parsed = ElementTree.fromstring(html)
        rows = [[cell.text for cell in row] for row in parsed.iter("tr")]
        assert all(len(row) == 2 for row in rows)
        assert len(rows) > 4
        data = next(parsed.iter("img")).get("src").removeprefix("data:image/png;base64,")
        assert 3_000 < len(b64decode(data)) < 100_000
    settlement = lifted.table()["Settlement W0"]
    assert f">{settlement}<" in pages[0]
    nothing = lifted.punch.solve(0.0)._repr_html_()
    assert "No picture: expected a load" in nothing
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for shown in objects:
        html = shown._repr_html_()
        assert "<tr>" in html
        assert "No picture: matplotlib is needed" in html
        assert "<img" not in html


def test_notebooks_show_groups_and_cases(lifted):
    """A row for each punch and each of a dozen cases, all with as many columns."""
    punch, mesh = lifted.punch, lifted.punch.basis.dual.mesh.translated((5.0, 0.0))
    other = RigidPunch(punch.substrate, DualMesh.from_mesh(mesh).basis(), origin=(5.0, 0.0))
    pair = RigidPunches([punch, other], names=["<left>", "right"]).solve([{"force": 1.0}] * 2)
    cases = punch.solve_many([{"force": f} for f in np.arange(1.0, 16.0)])
    for shown, count in ((pair, 3), (cases, 14)):
        parsed = ElementTree.fromstring(shown._repr_html_())
        rows = [[cell.text for cell in row] for row in parsed.iter("tr")]
        assert len(rows) == count
        assert len({len(row) for row in rows[:-1]}) == 1
        assert next(parsed.iter("img")).get("src").startswith("data:image/png")
    assert "&lt;left&gt;" in pair._repr_html_()
    with pytest.warns(ConvergenceWarning, match="1 of 1 load cases"):
        none = punch.solve_many([{"force": 1.0, "at": (9.0, 0.0)}])
    assert "<img" not in none._repr_html_()


# pictures


def datasets(plotter):
    """What is drawn, in order."""
    mappers = [getattr(actor, "mapper", None) for actor in plotter.actors.values()]
    return [mapper.dataset for mapper in mappers if hasattr(mapper, "dataset")]


def contours(picture):
    """Coordinates (2, n) of all isobars in a picture."""
    if hasattr(picture, "collections"):
        sets = [
            c for c in picture.collections if type(c).__name__ == "TriContourSet" and not c.filled
        ]
        return np.vstack([path.vertices for path in sets[0].get_paths()]).T
    lines = [d for d in datasets(picture) if d.n_lines]
    return lines[0].points.T[:2]


@pytest.mark.parametrize("visuals", BACKENDS)
def test_isobars_are_drawn_where_they_belong(visuals):
    picture = visuals.isobars(nodal(DISC), (DISC.p**2).sum(axis=0), [0.25, 0.64], labels=False)
    radius = np.hypot(*contours(picture))
    assert np.all(np.isclose(radius, 0.5, atol=5e-3) | np.isclose(radius, 0.8, atol=5e-3))
    assert set(radius.round(1)) == {0.5, 0.8}
    assert callable(picture.show)


def test_bands_of_pyvista_have_the_right_areas():
    mesh = MeshTri.init_circle(5)
    picture = with_pyvista.isobars(nodal(mesh), (mesh.p**2).sum(axis=0), [0.2, 0.4, 0.8])
    bands = next(d for d in datasets(picture) if "band" in d.cell_data)
    sizes = bands.compute_cell_sizes()["Area"]
    areas = np.bincount(bands.cell_data["band"].astype(int), weights=sizes)
    assert np.allclose(areas, np.pi * np.array([0.2, 0.2, 0.4, 0.2]), atol=0.02)
    notes = picture.scalar_bar.GetLookupTable().annotations
    assert list(notes.values()) == ["0.2", "0.4", "0.8"]


def test_a_triangle_flat_at_a_level_belongs_to_the_band_below():
    mesh = MeshTri().refined(2)
    bands = with_pyvista._bands(
        Field.from_basis(nodal(mesh), np.minimum(mesh.p[0], 0.5)), np.array([0.25, 0.5])
    )
    assert set(bands.cell_data["band"]) == {0, 1}


@pytest.mark.parametrize("visuals", BACKENDS)
@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_cells_have_the_colour_of_their_value(visuals, grid, dual):
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    values = np.random.default_rng(0).normal(size=basis.N)
    picture = visuals.plot(basis, values, clim=(-1, 1), edges=True, title="p [Pa]")
    if visuals is with_matplotlib:
        drawn = picture.collections[0].get_array()
        assert picture.collections[0].get_clim() == (-1, 1)
        assert picture.figure.axes[1].get_ylabel() == "p [Pa]"
    else:
        surface = next(iter(picture.actors.values())).mapper
        drawn = surface.dataset.cell_data["values"]
        assert surface.scalar_range == (-1, 1)
        assert picture.scalar_bar.GetTitle() == "p [Pa]"
    assert np.array_equal(drawn, values[basis.element_dofs[0]])


@pytest.mark.parametrize("visuals", BACKENDS)
def test_draw_shows_both_grids(visuals, dual):
    picture = visuals.draw(dual, nodes=True)
    mesh = dual.mesh
    expected = [(mesh.f2t[1] != -1).sum(), mesh.nfacets, (mesh.f2t[1] == -1).sum()]
    if visuals is with_matplotlib:
        assert [len(c.get_segments()) for c in picture.collections] == expected
        assert [line.get_xydata().shape[0] for line in picture.lines] == [
            len(dual),
            dual.p.shape[1],
        ]
        names = [text.get_text() for text in picture.get_legend().get_texts()]
        assert names[:2] == ["triangulation", "dual grid"]
        assert picture.get_aspect() == 1
    else:
        drawn = datasets(picture)[:5]
        assert [d.n_lines for d in drawn[:3]] == expected
        assert [d.n_points for d in drawn[3:]] == [len(dual), dual.p.shape[1]]


@pytest.mark.parametrize(
    ("scale", "tilt"),
    [(2.3e5, 0.45), *slow((1.0, 0.0), (-1e6, 0.0))],
    ids=["pascals", "unit", "negative"],
)
def test_pictures_are_written(scale, tilt, tmp_path):
    field = punch(DISC, scale, tilt)
    title = "contact pressure [Pa]"
    with_pyvista.isobars(nodal(DISC), field, title=title).screenshot(tmp_path / "a.png")
    axes = with_matplotlib.isobars(nodal(DISC), field, title=title)
    for name in ("b.png", "b.svg"):
        axes.figure.savefig(tmp_path / name)
    for name in ("a.png", "b.png", "b.svg"):
        assert 10_000 < (tmp_path / name).stat().st_size < 600_000
    assert "<image" not in (tmp_path / "b.svg").read_text()


def test_ticks_of_both_axes_have_one_step():
    """Also where extents differ by rounding, or one is shorter than a step."""
    disc = plan_ticks(np.array([-0.4999, -0.4981]), np.array([0.5003, 0.4981]))
    assert np.diff(disc[0]) == pytest.approx(np.diff(disc[1])[0])
    strip = plan_ticks(np.array([0.0, 0.1]), np.array([12.0, 0.9]))
    assert strip[0] == pytest.approx(np.arange(0, 13, 2))
    assert strip[1].tolist() == [0.5]
    assert not np.signbit(strip[0][0])
    site = plan_ticks(np.array([451200.0, 5411900.0]), np.array([451212.0, 5411908.0]))
    assert site[1] == pytest.approx(5411900.0 + np.arange(0, 9, 2), abs=1e-6)
    small = plan_ticks(np.array([456788.62, 5412345.07]), np.array([456789.62, 5412346.27]))
    assert small[1] == pytest.approx(5412345.2 + 0.2 * np.arange(6), abs=1e-8)


@pytest.mark.parametrize(
    "cells", [[(4, 6), (5, 5), (5, 6), (6, 6), (6, 7)], [(4, 5), (5, 4), (5, 5), (5, 6)]]
)
def test_lines_around_islands_stay_near_them(cells):
    """Splines through as many knots as points left the plan."""
    grid = MeshQuad.init_tensor(np.linspace(0, 20, 21), np.linspace(0, 20, 21))
    middle = grid.p[:, grid.t].mean(axis=1).astype(int)
    gap = np.where([tuple(c) in cells for c in middle.T.tolist()], 0.0, 5.0)
    punch = RigidPunch(HalfSpace(2.0, 0.3), CellBasis(grid, ElementQuad0()), gap=gap)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResolutionWarning)
        edge = punch.solve(settlement=0.1, tilt=(0, 0)).contact_region.edge
    for line in edge:
        far = distance_to_segments(smooth_line(line), line[:, :-1], line[:, 1:])
        assert far.max() < 0.3


def test_long_numbers_have_room():
    """pyvista leaves out texts that would leave the window."""
    mesh = rectangle(1.0, 1.2, n=30)
    here, there = (
        with_pyvista.draw(DualMesh.from_mesh(mesh.translated(at))).window_size
        for at in ((0.0, 0.0), (456789.12, 15412345.67))
    )
    assert there[0] > here[0]
    assert there[1] == here[1]


@pytest.mark.parametrize(
    ("clim", "ends"),
    [((0.0, 1.0), {0.0: "< 0", 1.0: "> 1"}), ((0.0, 0.5005), {0.5005: "> 0.5005"})],
)
def test_bars_keep_the_numbers_at_their_ends(clim, ends):
    basis = DualMesh.from_mesh(fine_disc(n=20)).basis()
    plotter = with_pyvista.plot(basis, np.linspace(-1, 2, basis.N), clim=clim)
    (bar,) = plotter.scalar_bars.values()
    table = bar.GetLookupTable()
    found = {
        table.GetAnnotatedValue(i).ToDouble(): str(table.GetAnnotation(i))
        for i in range(table.GetNumberOfAnnotatedValues())
    }
    assert ends.items() <= found.items()


def test_the_edge_of_contact_is_drawn_as_near_as_it_is_found():
    """Under a sphere it is a circle."""
    radius, a = 20.0, 0.6487
    dual = DualMesh.from_mesh(fine_disc(n=300))
    solution = RigidPunch(HalfSpace(1.0, 0.0), dual.basis(), gap=Sphere(radius)).solve(
        4 / 3 * a**3 / radius
    )
    (line,) = solution.contact_region.edge
    found, drawn = (np.abs(np.hypot(*x) - a).max() for x in (line, smooth_line(line)))
    assert drawn < 1.5 * found


def test_the_outline_has_no_gaps():
    """In every column of pixels between its ends the lower side of a plan is dark."""
    wide = DualMesh.from_mesh(rectangle(12.0, 4.0, n=60))
    solution = RigidPunch(HalfSpace(1.0, 0.3), wide.basis()).solve(1.0, at=(1.0, 0.3))
    image = with_pyvista.isobars(solution, labels=False).screenshot(return_img=True)
    side = image[-BELOW - 4 : -BELOW + 4, LEFT + 5 : LEFT + PLAN - 5]
    assert (side.max(axis=2).min(axis=0) < 128).all()


QUADS = MeshQuad().refined(2)


@pytest.mark.parametrize(
    "drawn",
    [
        lambda dual: with_pyvista.draw(dual, legend=False),
        lambda dual: with_pyvista.plot(nodal(DISC), punch(DISC)),
        *slow(
            lambda dual: with_pyvista.draw(QUADS),
            lambda dual: with_pyvista.plot(
                CellBasis(QUADS, ElementQuad0()), np.arange(QUADS.nelements)
            ),
        ),
    ],
    ids=["dual grid", "nodal values", "quadrilaterals", "cells"],
)
def test_screenshots_are_not_blank_and_fill_the_window(dual, drawn):
    image = drawn(dual).screenshot(return_img=True)
    rows, columns = np.nonzero((image != 255).any(axis=2))
    assert np.ptp(rows) > 0.85 * image.shape[0]
    assert np.ptp(columns) > 0.85 * image.shape[1]
    assert np.all(image[:5] == 255)


@pytest.mark.parametrize("visuals", BACKENDS)
def test_one_triangle_can_be_drawn(visuals):
    mesh = MeshTri(np.array([[0.0, 1, 0], [0, 0, 1]]), np.array([[0], [1], [2]]))
    pictures = (
        visuals.draw(DualMesh.from_mesh(mesh), nodes=True),
        visuals.plot(CellBasis(mesh, ElementTriP0()), [1.0], edges=True),
        visuals.isobars(nodal(mesh), [0.0, 1.0, 3.0]),
    )
    assert all(hasattr(picture, "show") for picture in pictures)


def test_matplotlib_draws_into_given_axes():
    from matplotlib.figure import Figure

    left, right = Figure().subplots(1, 2)
    assert with_matplotlib.draw(MeshQuad(), ax=left) is left
    assert with_matplotlib.plot(nodal(DISC), punch(DISC), ax=right) is right


# errors


@pytest.mark.parametrize("visuals", BACKENDS)
def test_wrong_arguments_are_refused(visuals):
    basis, p = nodal(DISC), punch(DISC)
    flat = CellBasis(DISC, ElementTriP0())
    with pytest.raises(ValueError, match=r"one of ElementTriP0.*pressure_field"):
        visuals.isobars(flat, np.ones(flat.N))
    with pytest.raises(ValueError, match="got ElementTriP2"):
        visuals.plot(CellBasis(DISC, ElementTriP2()), p)
    with pytest.raises(ValueError, match=f"{basis.N} DOFs, got shape \\(3,\\)"):
        visuals.isobars(basis, p[:3])
    with pytest.raises(ValueError, match="finite values, got nan at DOF"):
        visuals.plot(basis, np.where(np.arange(basis.N) == 7, np.nan, p))
    with pytest.raises(ValueError, match=r"size of values of at most 1e\+100, got 1e\+308"):
        visuals.isobars(basis, 1e308 * np.sign(basis.doflocs[0]))
    with pytest.raises(ValueError, match="the constant 2"):
        visuals.isobars(basis, np.full(basis.N, 2.0))
    with pytest.raises(TypeError, match="CellBasis, got MeshTri"):
        visuals.plot(DISC, p)
    with pytest.raises(TypeError, match="got MeshLine"):
        visuals.draw(MeshLine())
    with pytest.raises(TypeError, match="unexpected keyword"):
        visuals.draw(DISC, color="red")


@pytest.mark.parametrize(
    ("visuals", "missing"), [(with_matplotlib, "matplotlib"), (with_pyvista, "pyvista")]
)
def test_missing_libraries_are_named(visuals, missing, monkeypatch):
    monkeypatch.setitem(sys.modules, missing, None)
    for picture in (
        lambda: visuals.draw(DISC),
        lambda: visuals.plot(nodal(DISC), punch(DISC)),
        lambda: visuals.isobars(nodal(DISC), punch(DISC)),
    ):
        with pytest.raises(ImportError, match=r"pip install 'skfem-dual\[visuals\]'"):
            picture()


def test_plans_name_the_missing_library(monkeypatch):
    for name in ("matplotlib", "matplotlib.pyplot", "matplotlib.patches", "matplotlib.path"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=r"pip install 'skfem-dual\[visuals\]'"):
        Plan.circle((0.0, 0.0), 1.0).plot()


@pytest.fixture
def fresh_probe(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    offscreen.try_opengl.cache_clear()
    yield
    offscreen.try_opengl.cache_clear()


def test_missing_opengl_is_an_error_not_a_crash(monkeypatch, fresh_probe):
    crash = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
    monkeypatch.setattr(offscreen, "PROBE", (sys.executable, "-c", crash))
    with pytest.raises(RuntimeError, match="apt install libegl1 libgl1"):
        with_pyvista.draw(DISC)
    monkeypatch.setenv("DISPLAY", ":99")  # of a server that has gone
    with pytest.raises(RuntimeError, match="DISPLAY is ':99'"):
        with_pyvista.draw(DISC)


def test_probe_runs_once(monkeypatch, fresh_probe, tmp_path):
    count = tmp_path / "count"
    script = f"open({str(count)!r}, 'a').write('x')"
    monkeypatch.setattr(offscreen, "PROBE", (sys.executable, "-c", script))
    offscreen.require_opengl()
    offscreen.require_opengl()
    assert Path(count).read_text() == "x"


def test_a_display_that_has_gone_leaves_egl(monkeypatch, fresh_probe, tmp_path):
    """Where X11 fails and EGL works, EGL it is, without another word."""
    script = "import os; raise SystemExit('VTK_DEFAULT_OPENGL_WINDOW' not in os.environ)"
    monkeypatch.setattr(offscreen, "PROBE", (sys.executable, "-c", script))
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "")  # to be as it was at the end
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW")
    offscreen.require_opengl()
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkEGLRenderWindow"


def test_one_picture_at_a_time():
    """Threads that draw wait for each other; one that draws within a picture does not."""
    inside, most = [], []

    @offscreen.one_at_a_time
    def draw(depth=1):
        inside.append(depth)
        most.append(len(inside))
        time.sleep(0.002)
        if depth:
            draw(depth - 1)
        inside.pop()

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(draw, [1] * 8))
    assert max(most) == 2
    assert len(most) == 16


def test_coefficient_along_the_edge():
    from skfem_dual.visuals.matplotlib import plot_edge

    dual = DualMesh.from_mesh(MeshTri().refined(3))
    coefficient = RigidPunch(HalfSpace(1, 0), dual.basis()).solve(1, (0.5, 0.5)).edge_coefficient()
    axes = plot_edge(coefficient, title="K")
    (line,) = axes.lines
    assert np.array_equal(line.get_ydata(), coefficient.values)
    assert np.array_equal(line.get_xdata(), coefficient.arc)
    assert axes.get_ylabel() == "K"
    assert axes.get_ylim()[0] == 0
    import matplotlib.pyplot as plt

    plt.close(axes.figure)
    with pytest.raises(
        TypeError, match="expected an EdgeCoefficient for coefficient, got an array"
    ):
        plot_edge(coefficient.values)


def test_bad_places_are_marked():
    from skfem_dual import MeshError, check_mesh
    from skfem_dual.visuals.style import FAULT, layers

    kites = MeshTri(
        np.array([[0.0, 1.0, 2.8, 2.8], [0.0, 0.0, 1.0, -1.0]]), np.array([[0, 0], [1, 1], [2, 3]])
    )
    marks = [m for m in layers(kites, False, check_mesh(kites)) if m.color == FAULT]
    assert np.array_equal(marks[0].facets, [[0], [1]])
    assert marks[1].p == pytest.approx(np.array([[0.5], [0.0]]))
    assert [m.label for m in marks] == ["facets at fault", "their middles"]
    good = MeshTri().refined(2)
    assert not [m for m in layers(good, False, check_mesh(good)) if m.color == FAULT]
    line = np.array([[0, 1.0, 2.0, 9.0], [0, 0, 0, 0]])
    for p, entity in ((line, "node"), (line[:, :3], "triangle")):
        bad = MeshTri(p, np.array([[0], [1], [2]]))
        (mark,) = [m for m in layers(bad, False, check_mesh(bad)) if m.color == FAULT]
        assert mark.label == f"{entity}s at fault"
    worse = MeshTri(np.hstack([good.p, line + 9.0]), np.hstack([good.t, [[25], [26], [27]]]))
    with pytest.raises(ValueError, match="a report of the mesh drawn, got one of a larger"):
        list(layers(good, False, check_mesh(worse)))
    with pytest.raises(ValueError, match="report with a mesh or a DualMesh only"):
        list(layers(GridCouple.from_dual(DualMesh.from_mesh(good)), False, check_mesh(good)))
    good.doflocs[0, 0] = np.nan
    with pytest.raises(MeshError, match="finite coordinates"):
        list(layers(good, False))


@pytest.mark.parametrize("n", [6, 8])
def test_edges_of_neighbours_that_touch_are_drawn(n):
    """Where their nodes coincide they were left out: two plans looked like one."""
    meshes = [
        MeshTri.init_tensor(np.linspace(x, x + 2.0, 7), np.linspace(0.0, 1.0, m))
        for x, m in ((0.0, 6), (2.0, n))
    ]
    fields = [Field.from_basis(CellBasis(m, ElementTriP1()), m.p[0]) for m in meshes]
    both = Field.together(fields)
    sides = both.p[0][both.outline]
    assert (sides == 2.0).all(axis=0).sum() == 5 + n - 1
    plan = ContactRegion.together([ContactRegion(m.p, m.t, np.ones(m.p.shape[1])) for m in meshes])
    assert both.in_contact(plan).outline.shape == both.outline.shape


@pytest.mark.slow
def test_far_from_the_origin_and_single_levels():
    mesh = MeshTri.init_circle(3)
    values = np.hypot(*mesh.p) ** 2
    near = with_pyvista.isobars(nodal(mesh), values).screenshot(return_img=True)
    far = with_pyvista.isobars(nodal(mesh.translated((1e6, 2e6))), values)
    image = far.screenshot(return_img=True)
    # the same picture but for the numbers on the axes, which take more room on the left
    middle = slice(200, 600), slice(-800, -400)
    assert np.mean(np.abs(image[middle].astype(int) - near[middle])) < 2
    for levels in (1, [0.5]):
        axes = with_matplotlib.isobars(nodal(mesh), values, levels)
        assert len(axes.collections) >= 2


# contact that ends inside the plan


def half_disc(mesh=DISC):
    """Contact right of x = 0.1."""
    return ContactRegion(mesh.p, mesh.oriented().t, mesh.p[0] - 0.1)


HALF_DISC = np.pi / 2 - np.arcsin(0.1) - 0.1 * np.sqrt(0.99)


@pytest.fixture(scope="module")
def circle():
    return RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(DISC).basis())


@pytest.mark.parametrize("kind", ["nodal", "general", "cells", "triangles"])
def test_fields_end_at_the_edge_of_contact(kind):
    dual = DualMesh.from_mesh(DISC)
    basis = {
        "nodal": lambda: nodal(DISC),
        "general": lambda: nodal(general_triangulation(DISC)),
        "cells": dual.basis,
        "triangles": dual.primal_basis,
    }[kind]()
    whole = Field.from_basis(basis, np.arange(basis.N) + 1.0)
    field = whole.in_contact(half_disc())
    assert field.areas.sum() == pytest.approx(HALF_DISC, rel=3e-3)
    assert field.p[0].min() == pytest.approx(0.1)
    assert (np.bincount(field.cells, field.areas, whole.cells.max() + 1) < 0.2).all()
    if field.flat:
        assert np.array_equal(field.values, field.cells + 1.0)
    else:
        assert (field.values[field.p[0] < 0.1 + 1e-12] == 0).all()
        assert (field.values[field.p[0] > 0.1 + 1e-12] >= 1).all()


@pytest.mark.parametrize("corner", [(0.0, 0.0), (1e6, 2e6)])
def test_fields_far_from_the_origin_end_at_the_edge_of_contact(corner):
    mesh = MeshTri.init_circle(3).translated(corner)
    region = ContactRegion(mesh.p, mesh.oriented().t, mesh.p[0] - corner[0] - 0.1)
    for basis in (DualMesh.from_mesh(mesh).basis(), nodal(general_triangulation(mesh))):
        field = Field.from_basis(basis, np.ones(basis.N)).in_contact(region)
        assert field.areas.sum() == pytest.approx(region.area, rel=1e-7)


def test_isolines_stay_connected_where_triangles_are_cut():
    field = Field.from_basis(nodal(DISC), np.ones(DISC.nvertices)).in_contact(half_disc())
    segments, lines = isoline(field, 0.5)
    assert set(lines) == {0}
    assert (segments[0] > 0.1).all()


def test_contact_of_another_plan_or_without_area_is_refused():
    field = Field.from_basis(nodal(DISC), DISC.p[0])
    with pytest.raises(ValueError, match="one without the point"):
        field.in_contact(half_disc(DISC.scaled(0.5)))
    lifted = ContactRegion(DISC.p, DISC.t, np.full(DISC.nvertices, -1.0))
    with pytest.raises(ValueError, match="without area"):
        field.in_contact(lifted)
    with pytest.raises(TypeError, match="ContactRegion for contact, got an array"):
        field.in_contact(DISC.p)


@pytest.mark.parametrize("visuals", BACKENDS)
def test_isobars_and_edge_of_contact(visuals):
    region = half_disc()
    picture = visuals.isobars(nodal(DISC), 1 + DISC.p[0], [0.5, 1.5], labels=False, contact=region)
    x = contours(picture)[0]
    assert x.min() > 0.05  # on the way to zero at the edge
    assert np.isclose(x, 0.5, atol=0.02).any()
    if visuals is with_matplotlib:
        line = picture.lines[0].get_xdata()
        assert picture.lines[0].get_zorder() > 2.5
    else:
        _isobars, _outline, edge, *_axes = (d for d in datasets(picture) if d.n_lines)
        line = edge.points[:, 0] + DISC.p[0].mean()
    assert line == pytest.approx(np.full(len(line), 0.1), abs=1e-6)
    full = ContactRegion(DISC.p, DISC.t, np.ones(DISC.nvertices))
    same = visuals.isobars(nodal(DISC), DISC.p[0], [0.5], labels=False, contact=full)
    assert contours(same)[0] == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("visuals", BACKENDS)
def test_cells_out_of_contact_are_neutral(visuals, circle):
    solution = circle.solve(1.0, (0.6, 0.0))
    region = solution.contact_region
    picture = visuals.plot(circle.basis, solution.pressure, contact=region)
    if visuals is with_matplotlib:
        drawn = picture.collections[0].get_paths()
        x = np.concatenate([path.vertices[:, 0] for path in drawn])
        assert len(picture.lines) == len(region.edge)
    else:
        surface = next(iter(picture.actors.values())).mapper.dataset
        x = surface.points[:, 0] + DualMesh.from_mesh(DISC).refinement.p[0].mean()
        image = picture.screenshot(return_img=True)
        neutral = (image == 0xEC).all(axis=2).mean()
        assert neutral > 0.1
    assert x.min() >= min(line[0].min() for line in region.edge) - 1e-6


@pytest.mark.parametrize("at", [(0.5, 0.2), *slow(((0.1, 0.0),))])
def test_pictures_of_contact_are_written(circle, at, tmp_path):
    solution = circle.solve(1.0, at)
    basis, p = solution.nodal_pressure()
    axes = with_matplotlib.isobars(basis, p, contact=solution.contact_region)
    axes.figure.savefig(tmp_path / "a.svg")
    assert "<image" not in (tmp_path / "a.svg").read_text()
    plotter = with_pyvista.isobars(basis, p, contact=solution.contact_region)
    plotter.screenshot(tmp_path / "a.png")


def test_kern_is_drawn_in_its_plan():
    mesh = MeshTri.init_lshaped().refined(3).translated((2.0, 0.0))
    punch = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(mesh).basis(), origin=(1.5, 0.5))
    axes = with_matplotlib.plot_kern(punch)
    (kern,) = axes.patches
    assert np.allclose(kern.get_xy()[:-1].T, punch.kern() + np.array([[1.5], [0.5]]))
    (upright,) = axes.lines
    stiffness = punch.stiffness()
    assert upright.get_xydata()[0] - [1.5, 0.5] == pytest.approx(
        stiffness[1:, 0] / stiffness[0, 0]
    )
    assert kern.contains_point(axes.transData.transform(upright.get_xydata()[0]))
    length = sum(np.hypot(*np.diff(s, axis=0).T).sum() for s in axes.collections[0].get_segments())
    assert length == pytest.approx(8)
    with pytest.raises(TypeError, match="expected a RigidPunch for punch, got DualMesh"):
        with_matplotlib.plot_kern(DualMesh.from_mesh(mesh))


@pytest.mark.filterwarnings("ignore:contact on")  # at last on less than a dozen cells
def test_moment_rotation_curve(circle):
    curve = moment_rotation(circle, 2.0, (0.0, 1.0), steps=8)
    axes = with_matplotlib.plot_moment_rotation(curve)
    lines = {line.get_label(): line.get_xydata() for line in axes.lines}
    found = lines["ground does not pull"]
    assert np.array_equal(found[:, 0], curve.rotation)
    assert np.array_equal(found[:, 1], curve.eccentricity / curve.overturning)
    begin, end = lines["full contact"]
    assert end == pytest.approx([2 * 0.75 * curve.overturning, 1.0], rel=5e-3)
    assert begin == pytest.approx(found[0])
    assert axes.lines[-1].get_xydata()[0] == pytest.approx([0.5, 1 / 3], rel=0.02)
    assert "rotation" in axes.get_xlabel()
    assert "overturning" in axes.get_ylabel()
    with pytest.raises(TypeError, match="expected a MomentRotation for curve, got an array"):
        with_matplotlib.plot_moment_rotation(curve.moment)


@pytest.mark.filterwarnings("ignore:contact on")  # at last on less than a dozen cells
def test_moment_rotation_curve_of_a_shaped_punch_has_no_lift_off():
    dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    punch = RigidPunch(HalfSpace(1.0, 0.0), dual.basis(), gap=Paraboloid(4.0))
    axes = with_matplotlib.plot_moment_rotation(moment_rotation(punch, 0.2, steps=4))
    assert axes.get_legend() is None
    assert len(axes.lines) == 2


def test_backends_share_their_options():
    import inspect

    for name in ("draw", "plot", "isobars"):
        options = [inspect.signature(getattr(v, name)).parameters for v in BACKENDS]
        assert options[0].keys() - {"ax"} == options[1].keys() - {"off_screen"}


def test_site_coordinates_are_written_with_all_digits():
    """No power of ten beside the axes, none subtracted."""
    axes = with_matplotlib.draw(DISC.translated((451204.0, 5411903.0)))
    axes.figure.canvas.draw()
    for axis, amid in ((axes.xaxis, 451204), (axes.yaxis, 5411903)):
        assert axis.get_offset_text().get_text() == ""
        ticks = [float(label.get_text()) for label in axis.get_ticklabels()]
        assert np.abs(np.array(ticks) - amid).max() < 2


@pytest.mark.parametrize(("width", "height"), [(40.0, 1.5), (20.0, 1.0), (3.0, 2.0), (1.5, 40.0)])
def test_numbers_and_names_of_slender_plans_do_not_overlap(width, height):
    mesh = MeshTri.init_tensor(np.linspace(0, width, 11), np.linspace(0, height, 11))
    axes = with_matplotlib.draw(mesh.translated((451000.0, 5411000.0)))
    axes.figure.canvas.draw()
    numbers = [label.get_window_extent() for label in axes.get_xticklabels()]
    assert all(a.x1 <= b.x0 for a, b in pairwise(numbers))
    beside = [label.get_window_extent() for label in axes.get_yticklabels()]
    assert beside
    assert not any(a.overlaps(b) for a, b in pairwise(beside))
    below = axes.get_legend().get_window_extent().y1
    assert all(box.y0 >= below for box in numbers)


def test_scalar_bars_of_long_plans_have_room_for_their_numbers():
    dual = DualMesh.from_mesh(rectangle(100.0, 1.0, n=100))
    figure = with_matplotlib.isobars(
        RigidPunch(HalfSpace(1.0, 0.3), dual.basis()).solve(1.0)
    ).figure
    figure.canvas.draw()
    numbers = [label.get_window_extent() for label in figure.axes[1].get_xticklabels()]
    assert all(a.x1 <= b.x0 for a, b in pairwise(numbers))


@pytest.mark.parametrize("height", [*slow(3.0, 9.0), 30.0])
def test_scalar_bars_of_slender_plans_are_as_high(height):
    """Sizes of bars are parts of the width of the axes: they were a third as high."""
    dual = DualMesh.from_mesh(rectangle(1.0, height, n=40))
    solution = RigidPunch(HalfSpace(1.0, 0.3), dual.basis()).solve(1.0)
    figure = with_matplotlib.isobars(solution).figure
    figure.canvas.draw()
    plan, bar = (axes.get_window_extent() for axes in figure.axes)
    assert bar.height > 0.8 * plan.height
    assert bar.x0 > plan.x1
    assert bar.width < 0.1 * plan.height


@pytest.mark.parametrize("element", [ElementTriP2, ElementTriP3, ElementTriArgyris])
def test_fields_of_higher_order_on_some_elements(element):
    mesh, some = rectangle(2.0, 1.0, n=40), np.array([5, 3, 8, 40, 7, 12])
    basis = CellBasis(mesh, element(), elements=some)
    field = continuous(basis, CellBasis(mesh, element()).project(lambda x: x[0] * x[1]))
    assert field.values == pytest.approx(field.p[0] * field.p[1], abs=1e-9)
    assert np.abs(signed_areas(field.p, field.t)).sum() == pytest.approx(basis.dx.sum(), rel=1e-9)


@pytest.mark.parametrize("visuals", BACKENDS)
def test_curved_and_discontinuous_elements_are_refused(visuals):
    curved = MeshTri2.init_circle(1)
    for element in (ElementTriP1(), ElementTriP2()):
        basis = CellBasis(curved, element)
        with pytest.raises(ValueError, match=r"straight elements .* got a MeshTri2\. Remedy"):
            visuals.isobars(basis, basis.ones())
    basis = CellBasis(rectangle(1.0, 1.0, n=20), ElementTriP1DG())
    with pytest.raises(ValueError, match="one of ElementTriP1DG that jumps"):
        visuals.isobars(basis, np.arange(basis.N))
    field = continuous(basis, basis.project(lambda x: x[0]))
    assert field.values == pytest.approx(field.p[0])


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_forked_processes_draw_while_others_do():
    """The thread that draws is not there to end."""
    drawing, done = Event(), Event()

    @offscreen.one_at_a_time
    def draw():
        drawing.set()
        assert done.wait(timeout=30)

    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(draw)
        assert drawing.wait(timeout=10)
        process = os.fork()
        if process == 0:
            signal.alarm(10)
            offscreen.one_at_a_time(lambda: os._exit(0))()
        assert os.waitpid(process, 0)[1] == 0
        done.set()
        other.result()


def marks_in_a_box(draw):
    from matplotlib.figure import Figure

    from skfem_dual.visuals.axes import marks_on

    ax = Figure().add_subplot()
    draw(ax)
    return marks_on(ax, np.array([0.0, 0.0]), np.array([1.0, 0.45]), 0.1)


def test_lines_on_axes_are_seen_between_their_points():
    """Where they are on the plan, however far they go on."""

    def draw(ax):
        ax.plot([-1e5, 1e5, np.nan, 2.0, 2.0], [-5e4, 5e4, np.nan, 0.0, 1.0])
        ax.plot([3.0], [3.0], "o", linestyle="none")

    x, y = marks_in_a_box(draw)
    assert (x[-1], y[-1]) == (3.0, 3.0)
    assert 8 < len(x) < 15
    assert y[:-1] == pytest.approx(x[:-1] / 2)
    assert np.hypot(np.diff(x[:-1]), np.diff(y[:-1])).max() < 0.1 + 1e-9


def test_scatters_on_axes_are_seen():
    def draw(ax):
        ax.scatter([0.5, np.nan], [0.25, 0.0])
        ax.tricontour([0.0, 1, 0], [0.0, 0, 1], [0.0, 1, 2])

    assert marks_in_a_box(draw).tolist() == [[0.5], [0.25]]


def test_legends_fit_their_figures():
    """Four entries under a slender plan take two columns."""
    dual = DualMesh.from_mesh(generate.rectangle(4.0, 8.0, n=40))
    ax = with_matplotlib.draw(dual, nodes=True)
    ax.figure.canvas.draw()
    names, whole = ax.get_legend().get_window_extent(), ax.figure.bbox
    assert whole.x0 <= names.x0 < names.x1 <= whole.x1


@pytest.mark.parametrize("layout", [None, "constrained", "compressed"])
def test_pictures_in_parts_of_figures(layout, solution_of_disc):
    """Subfigures, and bars whose titles stay on the figure."""
    import matplotlib.pyplot as plt

    whole = plt.figure(layout=None if layout == "compressed" else layout)  # of one grid only
    for part in whole.subfigures(1, 2):
        assert with_matplotlib.isobars(solution_of_disc, ax=part.add_subplot()).texts
    _, ax = plt.subplots(figsize=(6, 4), layout=layout)
    basis = DualMesh.from_mesh(generate.rectangle(12.0, 4.0, n=60)).basis()
    with_matplotlib.plot(basis, basis.partition.centroids[0], title="p [kPa]", ax=ax)
    ax.figure.canvas.draw()
    assert ax.figure.axes[-1].xaxis.label.get_window_extent().y0 > 0
    plt.close("all")


def test_titles_of_scalar_bars(solution_of_disc):
    """VTK takes | for columns, and leaves out what its own font has no letters for."""
    plotter = with_pyvista.isobars(solution_of_disc, title="max |p| · 10⁻³", levels=60)
    (bar,) = plotter.scalar_bars.values()
    assert bar.GetTitle() == "max \N{DIVIDES}p\N{DIVIDES} · 10⁻³"
    assert Path(bar.GetTitleTextProperty().GetFontFile()).is_file()
    height = bar.GetHeight() * plotter.window_size[1]
    assert 20 * bar.GetLookupTable().GetNumberOfAnnotatedValues() <= height + 20
    plotter.close()


@pytest.fixture(scope="module")
def solution_of_disc():
    return RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(generate.disc(n=60)).basis()).solve(
        1.0, at=(0.1, 0.0)
    )


def test_ends_of_bars_that_values_pass():
    assert bar_marks(0.0, 2.0, False, False, 0) == {
        0.0: "0",
        0.5: "0.5",
        1.0: "1",
        1.5: "1.5",
        2.0: "2",
    }
    marks = bar_marks(0.1, 2.02, True, True, 0)
    assert (marks[0.1], marks[2.02]) == ("< 0.1", "> 2.02")
    assert 2.0 not in marks


def test_curves_are_seen_on_a_dark_background(solution_of_disc):
    import matplotlib.pyplot as plt

    with plt.style.context("dark_background"):
        for ax in (
            with_matplotlib.plot_edge(solution_of_disc.edge_coefficient()),
            with_matplotlib.plot_moment_rotation(
                moment_rotation(solution_of_disc.punch, 1.0, unilateral=False)
            ),
        ):
            assert ax.lines[0].get_color() == "white"
    plt.close("all")
