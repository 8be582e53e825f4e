"""Positions of flat punches that lift off, by pressures that end along the line of contact."""

import numpy as np
import pytest
from plans import sin_graded, to_area
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, Load, RigidPunch, RigidPunches
from skfem_dual.elements import crossed_loads
from skfem_dual.elements.crossed import CrossedCells, _roots
from skfem_dual.grids.generate import disc, rectangle
from skfem_dual.grids.lines import Segments
from skfem_dual.ground.layered import Layer, LayeredHalfSpace
from skfem_dual.kernels.compiled import inputs

SOIL = HalfSpace(1.0, 0.0)
#: circle: settlement of the middle and tilt by eccentricity, on 3000 cells that grow from both the
#: edge and the line of contact, to the digits that 2000 and 3000 have in common
CIRCLE = {0.5: (0.482107, 0.41917), 0.7: (0.258676, 0.984494), 0.8: (-0.30667, 1.90979)}


def flat(mesh, grid="dual", soil=SOIL):
    dual = DualMesh.from_mesh(mesh)
    return RigidPunch(soil, dual.basis() if grid == "dual" else dual.primal_basis())


def graded(n):
    mesh = disc(n=n)
    mesh = MeshTri(mesh.p / np.hypot(*mesh.p).max(), mesh.t)
    return to_area(sin_graded(mesh), np.pi)


@pytest.fixture(scope="module", params=["uniform", "graded", "triangles"])
def punch(request):
    n = 320 if request.param == "triangles" else 600
    mesh = graded(n) if request.param == "graded" else disc(n=n)
    return flat(mesh, "primal" if request.param == "triangles" else "dual")


@pytest.mark.parametrize("e", CIRCLE)
def test_circle(punch, e):
    """Where pressures that end with the cells leave 1.2e-3 at 0.7 and 3.4e-3 at 0.8.

    On triangles, in all directions: 6e-4 at 0.7 and 3e-3 at 0.8, tilts 4e-4 and 7e-4.
    """
    settlement, tilt = CIRCLE[e]
    found = punch.solve(1.0, at=(0.6 * e, 0.8 * e))
    within = {0.5: 1e-4, 0.7: 3e-4, 0.8: 1.5e-3}[e]
    within *= 1.0 if punch.footprint.on_dual_cells else 2.2
    assert found.settlement == pytest.approx(settlement, rel=within)
    within = 4e-4 if punch.footprint.on_dual_cells else 7e-4
    assert found.tilt == pytest.approx([0.6 * tilt, 0.8 * tilt], abs=within * tilt)


@pytest.mark.parametrize("grid", ["dual", "triangles"])
def test_no_jumps_as_the_load_turns(grid):
    """Where all but the tip of a triangle at the edge is out of contact, and on 28 to 32 cells.

    Without a pressure in such triangles, jumps are 5e-3 and more; where contact on fewer than 30
    cells ends with them, 2e-2.
    """
    mesh = disc(n=320) if grid == "triangles" else to_area(MeshTri.init_circle(3), np.pi)
    punch = flat(mesh, grid)
    found = []
    for angle in np.arange(0.4, 0.56, 0.02):
        solution = punch.solve(1.0, at=(0.8 * np.cos(angle), 0.8 * np.sin(angle)))
        assert solution.success
        found.append([solution.settlement, np.hypot(*solution.tilt)])
    exact, jumps = CIRCLE[0.8], np.abs(np.diff(found, axis=0)).max(axis=0)
    within = 2.5e-3 if grid == "triangles" else 5e-3
    assert np.abs(np.array(found) - exact).max() < within
    assert jumps.max() < 0.8 * within


def test_square():
    """Over a side, and over two of them; 2500 and 3500 cells that grow from edge and line."""
    punch = flat(rectangle(n=600))
    over_a_side = punch.solve(1.0, at=(0.7, 0.0))
    assert over_a_side.settlement == pytest.approx(0.372865, rel=5e-5)
    assert over_a_side.tilt == pytest.approx([0.445814, 0.0], abs=5e-5)
    over_two = punch.solve(1.0, at=(0.4, 0.4))
    assert over_two.settlement == pytest.approx(0.417618, rel=5e-5)
    assert over_two.tilt == pytest.approx([0.218114] * 2, rel=2e-4)
    # the line ends in two corners, where pressures have other exponents
    through_corners = punch.solve(1.0, at=(0.6, 0.6))
    assert through_corners.settlement == pytest.approx(0.21877, rel=1.5e-3)


def test_layers_and_groups():
    """A layer like what is below it, and a group of one, are nothing new."""
    mesh = disc(n=120)
    alone = flat(mesh).solve(1.0, at=(0.65, 0.1))
    layered = LayeredHalfSpace([Layer(1.0, 1.0, 0.0)], SOIL)
    others = [
        flat(mesh, soil=layered).solve(1.0, at=(0.65, 0.1)),
        RigidPunches([flat(mesh)]).solve([{"force": 1.0, "at": (0.65, 0.1)}])[0],
    ]
    for found in others:
        assert found.settlement == pytest.approx(alone.settlement, rel=1e-7)
        assert found.tilt == pytest.approx(alone.tilt, rel=1e-7)


def test_means_of_roots():
    """Of x over triangles, by hand."""
    square = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [2.0, 2.0, 2.0]]).T
    root, inverse = _roots(square.clip(1e-40))
    assert root == pytest.approx([8 / 15, 4 / 5, np.sqrt(2)], rel=1e-12)
    assert inverse == pytest.approx([8 / 3, 4 / 3, np.sqrt(0.5)], rel=1e-12)


def test_crossed_cells_near_and_far(monkeypatch):
    """Series and second moments against integrals over the sides of all triangles."""
    cells = flat(disc(n=120)).footprint
    line = np.array([[0.31, 0.36, 0.31], [-0.9, 0.0, 0.9]])  # contact to its left
    lines = Segments(line[:, :-1], line[:, 1:], np.array([0, 2]))
    touching = cells.partition.centroids[0] < 0.3
    x = np.hstack([cells.partition.centroids, cells.partition.nodes, [[30.0], [40.0]]])

    def influence():
        law = cells.partition, cells.fan, cells.weights
        (found,) = CrossedCells.from_lines(*law, lines, touching[None])
        return found, found.influence(SOIL, x)

    found, soon = influence()
    for name in ("FAR", "EXACT"):
        monkeypatch.setattr(crossed_loads, name, np.inf)
    _, exact = influence()
    assert np.abs(soon - exact).max() < 1e-4 * np.abs(exact).max()
    areas = cells.partition.areas[found.cells]
    assert exact[..., -1] == pytest.approx(np.array([areas, areas]) / np.pi / 50, rel=0.03)


@pytest.mark.parametrize("name", ["EXACT", "FAR"])
def test_points_just_as_far_as_rules_reach(name, monkeypatch):
    """Whatever their rounding they are on the near side; what lies farther is not."""
    distance, corner, around = (
        getattr(crossed_loads, name),
        2 * np.pi * (np.arange(3) / 3 + 0.1),
        np.linspace(0, 2 * np.pi, 100),
    )
    corners = np.array([0.3 + np.cos(corner), np.sin(corner) - 0.7])
    triangle = corners, np.array([[0], [1], [2]]), np.array([0, 1]), np.ones((2, 1))

    def settled(factor, reach=distance):
        monkeypatch.setattr(crossed_loads, name, reach)
        loads, out = crossed_loads.Loads.of(*triangle), np.empty((1, 1, 100))
        x = loads.middles + factor * distance * np.array([np.cos(around), np.sin(around)])
        crossed_loads.fill(0, 1, *inputs(x), 1.0, loads.part(slice(0, 1)), out)
        return out[0, 0]

    near = settled(1.0, np.inf)
    for factor in (1 - 1e-12, 1.0, 1 + 1e-12):
        assert settled(factor) == pytest.approx(near, rel=1e-11)
    farther = settled(1 + 1e-6, 0.0)
    assert settled(1 + 1e-6) == pytest.approx(farther, rel=1e-11)
    assert np.abs(farther / near - 1).max() > 1e-5


def test_sides_of_a_sharp_line():
    """In front of its tip all is to its left, whichever of both segments a point is nearer to."""
    line = np.array([[-1.0, 0.0, -1.0], [0.1, 0.0, -0.2]])
    tip = Segments(line[:, :-1], line[:, 1:], np.array([0, 2]))
    x = np.array([[0.5, 0.5, -0.5, -0.5, -0.5], [0.2, -0.2, 0.5, -0.5, 0.0]])
    distance = tip.signed_distance(x)
    assert distance[:2] == pytest.approx([np.hypot(0.5, 0.2)] * 2, rel=1e-12)
    assert (np.sign(distance) == [1, 1, 1, 1, -1]).all()


def test_thin_cells_do_without():
    """Cells twelve times as long as wide: with the law the strip settles a quarter too much."""
    coarse = disc(n=150)
    coarse = MeshTri(coarse.p * np.array([[12.0], [1.0]]), coarse.t)
    few, many = (flat(mesh).solve(1.0, at=(6.0, 0.5)) for mesh in (coarse, coarse.refined()))
    assert few.settlement == pytest.approx(many.settlement, rel=3e-3)
    assert few.tilt == pytest.approx(many.tilt, rel=3e-3)


@pytest.mark.filterwarnings("ignore::skfem_dual.ResolutionWarning")
@pytest.mark.parametrize("force", [0.3, 0.1, 0.01])
def test_a_neighbour_that_hardly_touches_has_no_line(force):
    """On a few cells, all of which the line would cross, nothing would bear its load."""
    soil = HalfSpace(20e3, 0.3)
    big = flat(rectangle(12, 8, n=150), soil=soil)
    dual = DualMesh.from_mesh(rectangle(4, 8, n=150).translated((10.0, 0.0)))
    small = RigidPunch(soil, dual.basis(), origin=(10.0, 0.0))
    found = RigidPunches([big, small]).solve([Load(1200.0, (3.0, 0.0)), Load(force)])
    assert np.sum(found.solutions[1].gap == 0) < 16
    assert found.success
    alone, beside = big.solve(1200.0, at=(3.0, 0.0)), found.solutions[0]
    assert beside.settlement == pytest.approx(alone.settlement, rel=1e-3)
    assert beside.tilt == pytest.approx(alone.tilt, rel=1e-2, abs=1e-2 * alone.tilt[0])
