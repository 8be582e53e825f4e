"""Positions by the work of the pressures, against exact ones, invariances and what is imposed."""

from math import gamma

import numpy as np
import pytest
from marks import slow
from plans import disc, perturbed, rectangle, renumbered
from skfem import CellBasis, ElementTriP0, MeshTri

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    RigidPunch,
    RigidPunches,
)
from skfem_dual.contact.sectors import sectors
from skfem_dual.contact.system import DENSE
from skfem_dual.grids.generate import annulus
from skfem_dual.grids.generate import disc as fine_disc
from skfem_dual.grids.generate import rectangle as drawn_rectangle

UNIT = HalfSpace(1.0, 0.0)
#: side 2: settlement under a unit force, and tilt by a unit moment
SQUARE = 0.433916, 0.480589


def punch(mesh, grid="dual", substrate=UNIT, **options):
    dual = DualMesh.from_mesh(mesh)
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    return RigidPunch(substrate, basis, **options)


@pytest.mark.parametrize("n", [150, 600])
def test_circle(n):
    """Several times closer than by collocation."""
    found = punch(fine_disc(n=n)).solve(1.0)
    assert abs(2 * found.settlement - 1) < 0.2 * abs(2 * found.collocated_settlement - 1)
    assert abs(2 * found.settlement - 1) < 0.018 / n


def test_thin_ring():
    """Against a mesh of eight times the cells: collocation is off by three times as much."""
    found = punch(annulus(0.8, n=200)).solve(1.0)
    exact = 0.557026  # 1750 and 3500 cells, graded to both edges
    assert abs(found.settlement - exact) < 0.3 * abs(found.collocated_settlement - exact)


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_square(grid):
    """With corners, on both grids alike."""
    found = punch(rectangle(16), grid).solve(1.0, at=(0.1, 0.0))
    assert found.settlement == pytest.approx(SQUARE[0], rel=8e-5)
    assert found.tilt[0] == pytest.approx(0.1 * SQUARE[1], rel=3e-4)


@pytest.mark.parametrize("stretched", [*slow(0.28), 0.1])
def test_triangles_stretched_across_the_edge(stretched):
    """Load that grows to the end of a long triangle acts at points inside it."""
    even = drawn_rectangle(2, 2, n=800)
    dual = DualMesh.from_mesh(MeshTri(even.p * [[1], [stretched]], even.t))
    by_dual, by_triangles = (
        RigidPunch(HalfSpace(1.0, 0.0), basis).solve(1.0).settlement
        for basis in (dual.basis(), dual.primal_basis())
    )
    assert by_triangles == pytest.approx(by_dual, rel=1e-4)
    x, *_ = sectors(RigidPunch(HalfSpace(1.0, 0.0), dual.primal_basis()).footprint.weights, True)
    assert (np.abs(x) <= [[1], [stretched]]).all()


@pytest.mark.parametrize("at", [(0.1, 0.05), (0.45, 0.2)])
def test_it_turns_and_scales_with_the_problem(at):
    """Also lifted off; to rounding, though the sectors come in another order."""
    mesh, (c, s) = perturbed(disc(3), 0.02), (0.6, 0.8)
    turn, at = np.array([[c, -s], [s, c]]), np.array(at)
    one = punch(mesh).solve(2.0, at=at)
    moved = mesh.translated((0.0, 0.0))
    moved = type(mesh)(3.0 * turn @ mesh.p, mesh.t)
    other = punch(moved, substrate=HalfSpace(5.0, 0.0)).solve(2.0, at=3.0 * turn @ at)
    assert other.settlement == pytest.approx(one.settlement / 15, rel=1e-10)
    assert other.tilt == pytest.approx(turn @ one.tilt / 45, rel=1e-9)


@pytest.mark.parametrize("stretched", [1.0, 8 / 7])
def test_numbering_does_not_move_it(stretched):
    """Where the load of a cell leans to no side, thirds of it are not told by its first corner."""
    mesh = MeshTri.init_tensor(np.linspace(0, 1, 9), stretched * np.linspace(0, 1, 9)[:8])
    x = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.restrict(np.nonzero((x[0] < 0.5) | (x[1] < 0.4))[0])
    others = [mesh] + [renumbered(mesh, seed) for seed in range(4)]
    one, *found = (punch(other, origin=(0.4, 0.4)).solve(1.0, at=(0.05, 0.02)) for other in others)
    for other in found:
        assert other.settlement == pytest.approx(one.settlement, rel=1e-11)
        assert other.tilt == pytest.approx(one.tilt, rel=1e-10)


def test_it_does_not_depend_on_the_origin():
    mesh, at = perturbed(disc(3), 0.02), np.array([0.2, -0.1])
    one, other = (punch(mesh, origin=o).solve(1.0, at=at - o) for o in ((0.0, 0.0), (0.7, 0.4)))
    x = [[0.3], [0.5]]
    assert other.punch_displacement(x) == pytest.approx(one.punch_displacement(x), rel=1e-12)
    assert other.tilt == pytest.approx(one.tilt, rel=1e-10)


def test_full_contact_is_linear():
    of = punch(perturbed(rectangle(9), 0.02))
    a, b, both = (
        of.solve(**load)
        for load in (
            {"force": 1.0},
            {"force": 2.0, "at": (0.1, 0.05)},
            {"force": 3.0, "at": (0.2 / 3, 0.1 / 3)},
        )
    )
    assert a.settlement + b.settlement == pytest.approx(both.settlement, rel=1e-12)
    assert a.tilt + b.tilt == pytest.approx(both.tilt, rel=1e-10)


def test_reciprocity():
    """Settlement by a moment is tilt by a force."""
    of = punch(perturbed(rectangle(9, 1.0, 0.6), 0.03), origin=(0.3, 0.1))
    centred = of.solve(1.0, unilateral=False)
    turned = of.solve(1.0, moments=(-1.0, 0.0), unilateral=False)
    by_moment = turned.settlement - centred.settlement
    assert centred.tilt[0] == pytest.approx(by_moment, rel=2e-5)


def test_what_is_imposed_is_kept():
    of = punch(fine_disc(n=150), origin=(0.1, 0.0))
    held = of.solve(settlement=0.5, tilt=(0.01, -0.02))
    assert (held.settlement, *held.tilt) == pytest.approx((0.5, 0.01, -0.02), rel=1e-14)
    assert of.solve(1.0, tilt=(0.02, 0.0)).tilt == pytest.approx([0.02, 0.0], rel=1e-14)
    assert of.solve(settlement=0.5).settlement == pytest.approx(0.5, rel=1e-14)


@pytest.mark.parametrize(("at", "rtol"), [((0.1, 0.05), 1e-12), ((0.5, 0.1), 2e-5)])
def test_positions_found_under_a_load_impose_it(at, rtol):
    """To rounding in full contact; the line of contact depends on the position a little."""
    of = punch(fine_disc(n=150), origin=(0.1, 0.0))
    load = of.solve(2.0, at=at)
    cases = (
        {"settlement": load.settlement, "tilt": tuple(load.tilt)},
        {"settlement": load.settlement, "at": at},
        {"force": 2.0, "tilt": tuple(load.tilt)},
    )
    for found in (*(of.solve(**case) for case in cases), *of.solve_many(cases)):
        assert found.success
        assert found.resultant == pytest.approx(load.resultant, rel=rtol)
        assert found.positions[0] == pytest.approx(load.positions[0], rel=rtol)
        assert found.pressure == pytest.approx(load.pressure, rel=rtol, abs=10 * rtol)


def test_forces_in_positions_are_as_close_as_positions_under_loads():
    """A circle, whose stiffness is 2."""
    of = punch(fine_disc(n=600))
    assert of.solve(settlement=1.0, tilt=(0.0, 0.0)).force == pytest.approx(2.0, rel=3e-5)
    assert of.solve(settlement=1.0).force == pytest.approx(2.0, rel=3e-5)


def test_where_the_origin_hardly_settles_the_reaction_is_that_of_the_position():
    """The punch turns about its origin nearly: collocated positions end far beside."""
    of = punch(fine_disc(n=150))
    load = of.solve(1.0, at=(0.7, 0.3))
    assert abs(load.settlement) < 2e-3 * load.tilt[0]
    assert of.solve(settlement=load.settlement, at=(0.7, 0.3)).force == pytest.approx(1, rel=1e-9)


def test_equilibrium_is_untouched():
    found = punch(fine_disc(n=150)).solve(1.0, at=(0.1, 0.0))
    x = found.punch.collocation_points
    assert found.resultant == pytest.approx([1.0, 0.1, 0.0], abs=1e-12)
    settled = found.displacement(x)
    assert settled == pytest.approx(found.punch_displacement(x, collocated=True), rel=1e-9)
    assert settled != pytest.approx(found.punch_displacement(x), rel=1e-5)


def test_lifted_off():
    """Closer than by collocation, against a mesh of four times the cells."""
    fine = punch(fine_disc(n=1200, graded=0.3)).solve(1.0, at=(0.5, 0.0))
    found = punch(fine_disc(n=300)).solve(1.0, at=(0.5, 0.0))
    assert len(found.contact) < len(found.pressure)
    assert found.flat is not None
    exact = np.array([fine.settlement, fine.tilt[0]])
    off = np.abs(found.positions[:, :2] / exact - 1)
    assert (off[0] < [1.5e-4, 2e-4]).all()
    assert (off[0] < [0.8, 0.1] * off[2]).all()


@pytest.mark.filterwarnings("ignore:150 cells of a size")
def test_a_thin_incompressible_layer_keeps_its_collocated_settlement():
    """Ground and punch are too far apart in all cells near the edge."""
    ground = LayeredHalfSpace([Layer(0.02, 1.0, 0.49)], "bonded")
    found = punch(fine_disc(n=150), substrate=ground).solve(1.0)
    assert found.settlement == pytest.approx(found.collocated_settlement, rel=2e-3)
    assert found.positions[1, 0] > 1.02 * found.settlement


@pytest.mark.parametrize(
    ("options", "force"),
    [({"edge": "constant"}, 1.0), ({"edge": "singular", "gap": Paraboloid(1.0)}, 0.5)],
)
def test_others_keep_the_collocated_position(options, force):
    found = punch(disc(3), **options).solve(force)
    assert found.settlement == found.collocated_settlement


@pytest.mark.parametrize("grid", ["basis", "primal_basis"])
@pytest.mark.parametrize("power", [2, 4, 8])
def test_shaped_punches_pressed_over_their_edge(grid, power):
    """Under ``r^n`` a circle that touches settles by ``P / 2 + kappa / (n + 1)`` (Sneddon)."""
    kappa = np.sqrt(np.pi) / 2 * power * gamma(power / 2) / gamma(power / 2 + 0.5)
    settled, tilt = 1.5 * kappa, 0.1 * kappa
    force = 2 * (settled - kappa / (power + 1))
    basis = getattr(DualMesh.from_mesh(fine_disc(n=150)), grid)()
    shaped = RigidPunch(HalfSpace(1.0, 0.0), basis, gap=lambda x: np.hypot(*x) ** power)
    at = 4 * tilt / 3 / force
    found = shaped.solve(force, at=(at, 0.0))
    assert found.settlement == pytest.approx(settled, rel=1e-4 if power == 2 else 6e-4)
    assert found.tilt == pytest.approx([tilt, 0.0], abs=3e-5 * settled)
    assert abs(found.collocated_settlement - settled) > 2 * abs(found.settlement - settled)
    bounds = found.bounds
    assert bounds.settlement[0] < settled + tilt * at < bounds.settlement[1]
    assert bounds.tilt[0, 0] < tilt < bounds.tilt[0, 1]
    again = shaped.solve(settlement=found.settlement, tilt=found.tilt)
    assert again.resultant == pytest.approx(found.resultant, abs=1e-8 * force)


def test_shapes_known_in_collocation_points_only_keep_the_collocated_position():
    """In sectors a constant gap in each cell would be a step: a plane is met by its slope."""
    basis = DualMesh.from_mesh(fine_disc(n=150)).basis()

    def shape(x):
        return 0.1 * np.hypot(*x) ** 2 + 0.3 * x[0]

    for of in (lambda x: shape(x), shape(RigidPunch(UNIT, basis).collocation_points)):
        found = RigidPunch(UNIT, basis, gap=of).solve(3.0)
        assert found.punch.edge == "singular"
        assert found.tilt == pytest.approx([0.3, 0.0], abs=1e-5)
        assert found.settlement == pytest.approx(1.5 + 0.2 / 3, rel=1e-3)


def test_positions_imposed_where_the_last_cells_touch():
    """Whether these touch under the force by work or not: what is imposed is kept."""
    basis = DualMesh.from_mesh(disc(3)).basis()
    shaped = RigidPunch(UNIT, basis, gap=lambda x: 0.3 * np.hypot(*x) ** 2, edge="singular")
    other = DualMesh.from_mesh(disc(2).translated((50.0, 0.0))).basis()
    pair = RigidPunches([shaped, RigidPunch(UNIT, other, origin=(50.0, 0.0))])
    for settlement in np.arange(0.566, 0.572, 1e-3):
        load = {"settlement": settlement, "tilt": (0.0, 0.0)}
        both = pair.solve([load, {"force": 1e-3}])
        for found in (shaped.solve(**load), both[0]):
            assert found.success
            assert found.settlement == pytest.approx(settlement, rel=1e-9)
            assert found.force == pytest.approx(2 * (settlement - 0.2), rel=4e-3)


def test_operators_and_symmetry_find_the_same():
    mesh = disc(3)
    one, *others = (
        punch(mesh, **options).solve(1.0, at=(0.1, 0.0))
        for options in ({}, {"symmetry": "auto"}, {"rtol": 1e-7})
    )
    for other in others:
        assert other.settlement == pytest.approx(one.settlement, rel=1e-6)
        assert other.tilt == pytest.approx(one.tilt, abs=1e-6)


@pytest.mark.parametrize("basis", ["dual", "primal", "triangles"])
def test_sectors_carry_the_loads_of_their_cells(basis):
    mesh = perturbed(disc(3), 0.02)
    dual = DualMesh.from_mesh(mesh)
    bases = dual.basis(), dual.primal_basis(), CellBasis(mesh, ElementTriP0())
    of = RigidPunch(UNIT, dict(zip(("dual", "primal", "triangles"), bases))[basis])
    x, cell, load = sectors(of.weights, twofold=basis != "dual")
    own = np.unique(cell)
    n = len(of.partition)
    assert np.bincount(cell, load, n)[own] == pytest.approx(of.partition.areas[own])
    for i in range(2):  # and act where these do
        acting = np.bincount(cell, load * x[i], n)[own] / of.partition.areas[own]
        assert acting == pytest.approx(of.acting[i, own], abs=1e-12)
    assert of.partition.f2c[0, of.weights.ribs].tolist() == [
        c for c in of.partition.f2c[0, of.weights.ribs] if c in own
    ]


def test_coarse_products_of_many_cells():
    """Those at the sectors may be coarser yet, but not than products can be."""
    coarse = punch(fine_disc(n=4100), rtol=1e-2)
    assert len(coarse.partition) > DENSE
    assert coarse.solve(1.0).settlement == pytest.approx(0.5, rel=1e-2)


@pytest.mark.parametrize("unit", [1e-9, 1e9, 1e16])
def test_positions_in_any_unit_of_length(unit):
    """In full contact, and imposed on contact that lifts off."""
    mesh = disc(3)
    found = []
    for size in (1.0, unit):
        punch = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(mesh.scaled(size)).basis())
        full = punch.solve(size**2, (0.3 * size, 0.1 * size))
        lifted = punch.solve(0.1 * size**2, tilt=(0.18, 0.28))
        found.append([full.settlement / size, lifted.settlement / size, *full.tilt])
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_no_matter_how_a_large_cell_in_the_middle_is_numbered():
    size = 100 ** np.linspace(0, 1, 7)
    x = np.r_[0, np.cumsum(np.r_[size, size[::-1]])]
    mesh = MeshTri.init_tensor(x / x[-1], x / x[-1]).translated((-0.5, -0.5))

    def tilts(order):
        numbered = MeshTri(mesh.p[:, order], np.argsort(order)[mesh.t])
        punch = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(numbered).basis())
        return [punch.solve(1.0, at=at).tilt for at in ((0, 0), (0.1, 0.0))]

    usual = tilts(np.arange(mesh.p.shape[1]))
    assert np.abs(usual[0]).max() < 1e-8
    other = tilts(np.random.default_rng(0).permutation(mesh.p.shape[1]))
    np.testing.assert_allclose(other, usual, atol=1e-8)
