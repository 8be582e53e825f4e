"""Bounds of settlement and tilt against exact values."""

from functools import cache

import numpy as np
import pytest
from marks import slow
from plans import disc, perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshTri

from skfem_dual import (
    Bounds,
    Cone,
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    RigidPunch,
    RigidPunches,
)
from skfem_dual.elements.resolution import margin
from skfem_dual.errors import ConvergenceError, MeshError
from skfem_dual.grids.generate import disc as fine_disc
from skfem_dual.grids.generate import polygon as fine_polygon
from skfem_dual.grids.generate import rectangle as fine_rectangle

UNIT = HalfSpace(1.0, 0.0)


def solve(mesh, grid="dual", load=None, **options):
    dual = DualMesh.from_mesh(mesh)
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    return RigidPunch(UNIT, basis, **options).solve(**(load or {"force": 1.0, "at": (0.1, 0.05)}))


@pytest.mark.parametrize("grid", ["dual", "primal"])
@pytest.mark.parametrize("options", [{}, {"edge": "constant"}])
@pytest.mark.parametrize(
    ("mesh", "settlement", "tilt"),
    [
        (fine_disc(n=200), 0.5, 0.75),
        (perturbed(rectangle(12), 0.02), 0.433916, 0.480589),
    ],
)
def test_exact_values_lie_within(mesh, settlement, tilt, grid, options):
    """Of circle and square, at the point where the force acts."""
    bounds = solve(mesh, grid, **options).bounds
    exact = tilt * np.array([0.1, 0.05])
    assert bounds.at == (0.1, 0.05)
    low, high = bounds.settlement
    assert low < settlement + exact @ bounds.at < high
    assert (bounds.tilt[:, 0] < exact).all()
    assert (exact < bounds.tilt[:, 1]).all()
    # narrow where the pressure grows to the edge inside the cells
    assert high - low < (5e-3 if not options else 0.2) * settlement
    assert bounds.settlement_by == ("found", "found")


def test_neighbours():
    """Of each punch beside the other, lifted off too, as on finer meshes of both."""

    def pair(n):
        punches = [
            RigidPunch(UNIT, DualMesh.from_mesh(fine_disc(n=n).translated((x, 0.0))).basis())
            for x in (0.0, 2.2)
        ]
        loads = {"force": 1.0, "at": (0.45, 0.1)}, {"force": 0.7, "at": (2.2, 0.1)}
        return RigidPunches(punches).solve(loads)

    for found, fine in zip(pair(80).solutions, pair(500).solutions, strict=True):
        bounds = found.bounds
        low, high = bounds.settlement
        assert low < fine.settlement + fine.tilt @ bounds.at < high
        assert (bounds.tilt[:, 0] < fine.tilt).all()
        assert (fine.tilt < bounds.tilt[:, 1]).all()
        assert high - low < 0.02 * high


def test_what_pushes_changes_no_bounds(monkeypatch):
    """And is not solved for on the other grid, of twice as many cells."""
    still = solve(disc(2)).bounds
    monkeypatch.setattr("skfem_dual.contact.motions.DENSE", 50)  # between 41 and 64
    load = {"force": 1.0, "at": (0.1, 0.05), "horizontal": (0.1, -0.2), "torsion": 0.05}
    pushed = solve(disc(2), load=load)
    assert pushed.shear is not None
    assert np.array_equal(pushed.bounds.settlement, still.settlement)
    assert np.array_equal(pushed.bounds.tilt, still.tilt)


def test_a_group_without_any_load():
    punches = [
        RigidPunch(UNIT, DualMesh.from_mesh(disc(1).translated((x, 0.0))).basis())
        for x in (0.0, 2.2)
    ]
    for found in RigidPunches(punches).solve([{"force": 0.0}] * 2, unilateral=False):
        assert not found.bounds.settlement.any()
        assert not found.bounds.tilt.any()


def test_they_scale_with_load_and_ground():
    mesh = disc(2)
    one = solve(mesh).bounds
    basis = DualMesh.from_mesh(mesh).basis()
    other = RigidPunch(HalfSpace(5.0, 0.0), basis).solve(10.0, at=(0.1, 0.05)).bounds
    assert other.settlement == pytest.approx(2 * one.settlement, rel=1e-10)
    assert other.tilt == pytest.approx(2 * one.tilt, rel=1e-8)


def test_they_surround_the_solution():
    found = solve(perturbed(disc(3), 0.02), load={"force": 1.0, "at": (0.5, 0.1)})
    w = found.punch_displacement(np.array([[0.5], [0.1]]))[0]
    assert found.bounds.settlement.mean() == pytest.approx(w, rel=1e-12)
    assert found.bounds.tilt.mean(axis=1) == pytest.approx(found.tilt, rel=1e-12)
    assert not found.bounds.settlement.flags.writeable


def test_what_is_imposed_is_proven():
    bounds = solve(disc(2), load={"settlement": 0.5, "tilt": (0.01, 0.0)}).bounds
    assert bounds.settlement == pytest.approx([0.5, 0.5], rel=1e-12)
    assert bounds.settlement_by == ("proven", "proven")
    assert bounds.tilt_by == (("proven", "proven"),) * 2
    guided = solve(disc(2), load={"force": 1.0, "tilt": (0.01, 0.0)}).bounds
    assert guided.settlement[0] < 0.5 < guided.settlement[1]
    assert guided.tilt[0] == pytest.approx([0.01, 0.01], rel=1e-12)


def test_triangles_of_an_ordinary_basis():
    mesh = disc(2)
    of = RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()))
    found, known = of.solve(1.0).bounds, solve(mesh, "primal", {"force": 1.0}).bounds
    assert found.settlement == pytest.approx(known.settlement, rel=1e-10)


@pytest.mark.parametrize("n", [100, 250])
def test_meshes_graded_to_the_edge(n):
    """Where the positions on both grids may agree better than each with the exact one."""
    low, high = solve(
        fine_rectangle(2.0, 2.0, n=n, graded=0.3), load={"force": 1.0}
    ).bounds.settlement
    assert low < 0.433916 < high
    assert high - low < 5e-4 * high


@pytest.mark.parametrize("n", [100, *slow(170, 300)])
@pytest.mark.parametrize(
    ("ground", "exact"),
    # by meshes of 1000, 2000 and 3900 cells, to 1e-6
    [
        (HalfSpace(1.0, 0.3), 0.2443018),
        (
            LayeredHalfSpace([Layer(1, 50, 0.3), Layer(2, 10, 0.45)], HalfSpace(80, 0.2)),
            7.20879e-3,
        ),
    ],
)
def test_acute_corners(ground, exact, n):
    """Where both grids settle too little, by nearly as much."""
    mesh = fine_polygon([(0, 0), (6, 0), (5, 3)], n=n, graded=0.3)
    punch = RigidPunch(ground, DualMesh.from_mesh(mesh).basis(), origin=(3.5, 1.0))
    low, high = punch.solve(1.0).bounds.settlement
    assert low < exact < high
    assert high - low < 0.05 / n * exact


@pytest.mark.parametrize("n", [150, *slow(220, 300)])
@pytest.mark.parametrize(
    ("thickness", "poisson", "exact"),
    # of the mean of meshes with 3900 cells, even ones and graded ones
    [(0.12, 0.45, 5.4472e-3), (0.2, 0.5, 3.9190e-3)],
)
def test_thin_layers_that_hardly_change_their_volume(thickness, poisson, exact, n):
    """Where solutions on both grids err alike."""
    soil = LayeredHalfSpace([Layer(thickness, 2.5, poisson)], "bonded")
    basis = DualMesh.from_mesh(fine_disc(n=n)).basis()
    low, high = RigidPunch(soil, basis).solve(1.0, (0.17, -0.11)).bounds.settlement
    assert low < exact < high
    assert high - low < 0.015 * exact


@pytest.mark.parametrize(
    "soil",
    [UNIT, LayeredHalfSpace([Layer(0.26, 1.0, 0.5)], "bonded")],
    ids=["homogeneous", "thin"],
)
def test_both_grids_have_the_same(soil):
    dual = DualMesh.from_mesh(fine_disc(n=150))
    bases = dual.basis(), dual.primal_basis()
    one, other = (RigidPunch(soil, basis).solve(1.0).bounds for basis in bases)
    assert one.settlement == pytest.approx(other.settlement, rel=1e-9)
    assert one.tilt == pytest.approx(other.tilt, abs=1e-9 * one.settlement[1])
    # Fredholm's equation of the second kind with 320 points
    assert soil is UNIT or one.settlement[0] < 0.01286488 < one.settlement[1]


@pytest.mark.parametrize("grid", ["dual", *slow("triangles")])
@pytest.mark.parametrize("n", [150, 200, *slow(300)])
def test_squares_on_a_stiff_crust(n, grid):
    """Both grids err alike at corners, where the law is that of a disc; by 1200 graded cells."""
    crust = LayeredHalfSpace([Layer(0.1, 20.0, 0.3)], HalfSpace(1.0, 0.45))
    dual = DualMesh.from_mesh(fine_rectangle(2.0, 2.0, n=n))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    exact = settlement_on_many(crust)
    low, high = RigidPunch(crust, basis).solve(1.0, unilateral=False).bounds.settlement
    assert low < exact < high
    assert high - low < 1e-2 * exact


@cache
def settlement_on_many(ground):
    mesh = fine_rectangle(2.0, 2.0, n=1200, graded=0.25)
    return (
        RigidPunch(ground, DualMesh.from_mesh(mesh).basis())
        .solve(1.0, unilateral=False)
        .settlement
    )


def test_crusts_are_not_taken_for_thin_layers():
    basis = DualMesh.from_mesh(fine_disc(n=150)).basis()
    crust = LayeredHalfSpace([Layer(0.25, 4.0, 0.3)], HalfSpace(1.0, 0.3))
    found = RigidPunch(crust, basis).solve(1.0, (0.17, -0.11))
    assert margin(crust, found.footprint.partition) == 0.0
    low, high = found.bounds.settlement
    assert high - low < 1e-3 * high


def test_lifted_off():
    """Where the line of contact lies alike between the cells of both grids; of 4000 cells."""
    mesh = fine_rectangle(2.0, 1.4, n=260)
    found = solve(mesh, load={"force": 1.0, "at": (-0.05, 0.38)}, origin=(0.0, 0.0))
    assert len(found.contact) < len(found.pressure)
    low, high = found.bounds.tilt.T
    assert (low < [-0.03420, 0.41547]).all()
    assert (high > [-0.03419, 0.41548]).all()
    assert (high - low < 1e-3 * high[1]).all()


@pytest.mark.parametrize(
    ("n", "radius", "width"), [(250, 0.6, 2e-3), (150, 0.45, 3e-2)], ids=["line", "cells"]
)
def test_shaped_punches(n, radius, width):
    """A paraboloid: approach a^2 / R, P = 4 E* a^3 / 3 R."""
    found = solve(fine_disc(n=n), load={"force": 4 / 3 * radius**3}, gap=Paraboloid(1.0))
    assert (found.line is not None) == (width < 0.01)
    low, high = found.bounds.settlement
    assert low < radius**2 < high
    assert high - low < width * radius**2


@pytest.mark.parametrize(
    "options",
    [
        {"load": {"force": 1.0, "at": (0.55, 0.1)}, "edge": "constant"},  # lifted off
        {"load": {"force": 1.0, "at": (0.55, 0.1)}, "edge": "constant", "collocation": "node"},
        {"load": {"force": 2.5, "at": (0.1, 0.05)}, "gap": Paraboloid(1.0)},  # over its edge
        {"load": {"force": 0.6, "at": (0.1, 0.05)}, "gap": Paraboloid(1.0), "edge": "constant"},
        {"load": {"force": 1.0, "at": (0.6, 0.1), "unilateral": False}},
    ],
)
@pytest.mark.parametrize("n", [60, *slow(120, 240)])
def test_bounds_of_all_kinds_hold_and_are_of_use(n, options):
    """Against edge-weighted cells on the refined mesh, and not far wider than what is missed."""
    mesh = fine_disc(n=n)
    found = solve(mesh, **options)
    exact = solve(mesh.refined(2), **{k: v for k, v in options.items() if k in ("load", "gap")})
    bounds = found.bounds
    low, high = bounds.settlement
    assert low < exact.settlement + exact.tilt @ bounds.at < high
    assert (bounds.tilt[:, 0] < exact.tilt).all()
    assert (exact.tilt < bounds.tilt[:, 1]).all()
    constant = options.get("edge") == "constant" and "gap" not in options
    assert high - low < (3.5 / np.sqrt(n) if constant else 0.03) * high


def test_printed():
    small, large = solve(disc(2)), solve(disc(4))
    low, high = small.bounds.settlement
    assert f"W at (0.1, 0.05) {low:.6g} to {high:.6g}, found" in repr(small)
    assert "see solution.bounds" in repr(large)
    assert "bounds" not in large.__dict__
    assert "W at (0.1, 0.05): " in repr(small.bounds)
    assert isinstance(small.bounds, Bounds)
    assert "Lx: " in repr(small.bounds)


def test_none():
    quads = RigidPunch(UNIT, CellBasis(polar(4, 12), ElementQuad0())).solve(1.0)
    with pytest.raises(ValueError, match="cells of a mesh of triangles, for bounds"):
        quads.bounds  # noqa: B018
    assert "Bounds" not in repr(quads)
    mesh = disc(2)
    pair = RigidPunches(
        [
            RigidPunch(UNIT, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x, 0))
            for x in (0.0, 3.0)
        ]
    ).solve([{"force": 1.0}] * 2)
    joined = RigidPunches(pair.punches.punches, joined=[(0, 1)]).solve([{"force": 1.0}])
    with pytest.raises(ValueError, match="flat and move alone, for bounds, got shaped or joined"):
        joined[0].bounds  # noqa: B018
    framed = RigidPunches(pair.punches.punches[:1], stiffness=np.eye(3)).solve([{"force": 1.0}])
    with pytest.raises(ValueError, match="or joined ones, a frame"):
        framed[0].bounds  # noqa: B018
    gap = np.zeros(len(mesh.p[0]))
    with pytest.raises(ValueError, match="gaps of one grid's cells"):
        solve(mesh, gap=gap).bounds  # noqa: B018
    with pytest.raises(TypeError, match="expected a PunchSolution for bounds, got 1"):
        Bounds.from_solution(1)


def test_triangles_without_a_dual_grid():
    """What prevents bounds is told, and does not prevent printing."""
    mesh = perturbed(disc(3), 0.045, seed=4)
    of = RigidPunch(UNIT, CellBasis(mesh, ElementTriP0())).solve(1.0)
    with pytest.raises(MeshError):
        of.bounds  # noqa: B018
    assert "see solution.bounds" in repr(of)


def test_another_grid_that_cannot_stand():
    """Four dual cells of two triangles: the remedy is not that of the solution's own cells."""
    found = RigidPunch(UNIT, DualMesh.from_mesh(MeshTri()).basis()).solve(1.0, (0.5, 0.5))
    assert found.success
    with pytest.raises(ConvergenceError, match=r"on the other grid the punch .* a finer mesh$"):
        found.bounds  # noqa: B018


@pytest.mark.parametrize(
    ("n", "half", "centre"), [((5, 38), 1.3, (0.0, 0.0)), *slow(((6, 68), 1.6, (-0.07, 0.03)))]
)
def test_contact_a_few_cells_across(n, half, centre):
    """Those across tell how close its position is, not all of them."""
    mesh = MeshTri.init_tensor(*(np.linspace(-half, half, k + 1) for k in n))
    basis = DualMesh.from_mesh(mesh).primal_basis()
    cone = RigidPunch(HalfSpace(1.0, 0.0), basis, gap=Cone(np.pi / 4, centre=centre))
    low, high = cone.solve(np.pi / 2, at=centre).bounds.settlement
    assert low < np.pi / 2 < high
    assert high - low < 0.1


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_bounds_do_not_depend_on_an_offset_of_the_shape(grid):
    dual = DualMesh.from_mesh(disc(3))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    widths, rest = [], []
    for offset, slope in ((0.0, 0.0), (-0.09, 0.0), (9.0, 0.0), (0.0, 0.5)):

        def gap(x, offset=offset, slope=slope):
            return (x**2).sum(axis=0) / 4 + offset + slope * x[0]

        bounds = RigidPunch(HalfSpace(1.0, 0.0), basis, gap=gap).solve(0.05).bounds
        widths.append(np.diff([bounds.settlement, *bounds.tilt]).ravel())
        rest.append(np.mean(bounds.settlement) - offset)
    for width in widths[1:]:
        assert width == pytest.approx(widths[0], rel=1e-6)
    assert rest == pytest.approx([rest[0]] * 4, rel=1e-6)
