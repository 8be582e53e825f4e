"""Periodic contact against exact solutions of wavy surfaces.

References: H. M. Westergaard, Bearing pressures and cracks, J. Appl. Mech. 6 (1939), for a
surface wavy in one direction; K. L. Johnson, J. A. Greenwood and J. G. Higginson, The contact of
elastic regular wavy surfaces, Int. J. Mech. Sci. 27 (1985), for one wavy in two.
"""

import pickle

import numpy as np
import pytest
from skfem import CellBasis, ElementQuad0, ElementTriP0, Functional, MeshQuad, MeshTri

from skfem_dual import (
    ConvergenceError,
    ElasticPunch,
    GradedHalfSpace,
    HalfSpace,
    InfluenceOperator,
    Layer,
    LayeredHalfSpace,
    MeasuredProfile,
    Paraboloid,
    PeriodicGround,
    RigidPunch,
    RigidPunches,
    flexible_settlement,
    load_path,
)
from skfem_dual.io import write_solution
from skfem_dual.post import fields

SOIL = HalfSpace(3.0, 0.3)
MODULUS = SOIL.contact_modulus
GROUNDS = (
    SOIL,
    GradedHalfSpace.init_linear(2.0, 0.25, 1.5),
    LayeredHalfSpace([Layer(0.3, 2.0, 0.3)], "bonded"),
)


def cells(nx, ny, lx=1.0, ly=1.0, order=None):
    mesh = MeshQuad.init_tensor(lx * np.arange(nx + 1) / nx, ly * np.arange(ny + 1) / ny)
    return CellBasis(mesh if order is None else mesh.restrict(order), ElementQuad0())


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.8])
def test_westergaard(ratio):
    """Width of contact and pressures of ``amplitude (1 - cos(2 pi x / length))``."""
    length, amplitude, n = 2.0, 0.01, 512
    full = np.pi * MODULUS * amplitude / length
    punch = RigidPunch(
        PeriodicGround(SOIL, (length, 1.0)),
        cells(n, 2, length),
        gap=lambda x: amplitude * (1 - np.cos(2 * np.pi * x[0] / length)),
    )
    solution = punch.solve(ratio * full * length, gap_rtol=1e-9)
    assert solution.success
    s = np.sin(np.pi * punch.collocation_points[0] / length)
    exact = 2 * full * np.sqrt((ratio - s**2).clip(0)) * np.sqrt(1 - s**2)
    assert np.abs(solution.pressure - exact).mean() < 4e-3 * ratio * full
    width = 2 * np.arcsin(np.sqrt(ratio)) / np.pi
    assert len(solution.contact) / (2 * n) == pytest.approx(width, abs=2.5 / n)


def egg_box(x):
    return 0.02 * (1 - np.cos(2 * np.pi * x[0]) * np.cos(2 * np.pi * x[1]))


def wavy(n, order=None):
    """Two waves with an amplitude of 0.02 in all."""
    punch = RigidPunch(
        PeriodicGround(SOIL, (1.0, 1.0)),
        cells(n, n, order=order),
        gap=egg_box,
    )
    return punch, np.sqrt(2) * np.pi * MODULUS * 0.02


def test_full_contact_of_a_surface_wavy_in_two_directions():
    """From the mean pressure sqrt(2) pi E* amplitude / length on, exact; in any order of cells."""
    punch, full = wavy(24, np.random.default_rng(0).permutation(576))
    x = punch.collocation_points
    wave = np.cos(2 * np.pi * x[0]) * np.cos(2 * np.pi * x[1])
    solution = punch.solve(1.001 * full)
    assert len(solution.contact) == 576
    assert solution.pressure == pytest.approx(full * (1.001 + wave), abs=1e-8 * full)
    assert solution.settlement == pytest.approx(0.02, rel=1e-8)  # the mean of the gap
    assert len(punch.solve(0.95 * full).contact) < 576


@pytest.mark.parametrize("ratio", [0.3, 1.2])
def test_the_active_set_finds_the_same(ratio):
    """In full contact too, where a uniform pressure is not told by settlements."""
    punch, full = wavy(12)
    one, other = (punch.solve(ratio * full, method=method) for method in ("auto", "active-set"))
    assert one.success
    assert other.success
    np.testing.assert_allclose(other.pressure, one.pressure, rtol=0, atol=1e-9 * full)
    assert other.settlement == pytest.approx(one.settlement, abs=1e-11)


def test_light_and_nearly_full_contact_of_a_surface_wavy_in_two_directions():
    """The asymptotes of Johnson, Greenwood and Higginson."""
    punch, full = wavy(256)
    light = punch.solve(0.002 * full, gap_rtol=1e-7)
    hertz = np.pi * (3 / (8 * np.pi) * 0.002) ** (2 / 3)
    assert light.contact_area == pytest.approx(hertz, rel=0.05)
    nearly = punch.solve(0.97 * full, gap_rtol=1e-7)
    assert 1 - len(nearly.contact) / 256**2 == pytest.approx(1.5 / np.pi * 0.03, rel=0.1)


@pytest.mark.parametrize("ground", GROUNDS)
def test_products_are_those_of_the_symbol(ground):
    """Each wave is only made larger or smaller, the mean taken away."""
    basis = cells(12, 8, 2.0, 0.9)
    periodic = PeriodicGround(ground, (2.0, 0.9))
    operator = InfluenceOperator(periodic, basis, edge="constant")
    assert operator.method == "toeplitz"
    assert operator.error < 1e-13
    x = operator.x
    for i, j in ((1, 0), (0, 2), (3, 3), (5, 0)):
        k = 2 * np.pi * np.array([i / 2.0, j / 0.9])
        wave = np.cos(k @ x)
        expected = ground.symbol(np.hypot(*k)) * wave
        assert operator @ (7 + wave) == pytest.approx(expected, abs=1e-9 * expected.max())
    assert periodic.symbol([0.0, 1.0]) == pytest.approx([0.0, ground.symbol(1.0)])
    assert periodic.symbol(0.0) == 0.0
    assert ground.symbol([]).shape == (0,)


def test_a_large_period_is_as_good_as_none():
    """Cells around the middle of a wide period, against the same without one."""
    n, side = 64, 1.0
    x = np.random.default_rng(0).random(n * n)
    basis = cells(n, n, side, side)
    middle = np.hypot(*(basis.mesh.p[:, basis.mesh.t].mean(axis=1) - 0.5)) < 0.06
    q = np.where(middle, x, 0.0)
    alone = InfluenceOperator(SOIL, basis, edge="constant") @ q
    periodic = InfluenceOperator(PeriodicGround(SOIL, (1, 1)), basis, edge="constant") @ q
    less = (periodic - alone)[middle]
    assert np.ptp(less) < 0.02 * alone.max()
    assert less.mean() < 0


def test_the_settlement_is_the_work_of_the_force():
    """The energy's derivative by the force, and solutions in any units."""
    punch, full = wavy(32)
    loads = full * np.array([0.199, 0.2, 0.201])
    solutions = [punch.solve(load) for load in loads]
    energy = [
        s.pressure @ (punch.operator @ s.pressure / 2 + punch.initial_gap) / 32**2
        for s in solutions
    ]
    assert (energy[2] - energy[0]) / (loads[2] - loads[0]) == pytest.approx(
        solutions[1].settlement, rel=1e-6
    )
    again = pickle.loads(pickle.dumps(punch)).solve(loads[1])
    assert np.array_equal(again.pressure, solutions[1].pressure)
    assert "PeriodicGround" in repr(again)
    assert np.isinf(again.condition_number)
    assert "inf" in repr(again)


def test_cases_and_paths():
    """As one by one: no case shares full contact with others."""
    punch, forces = wavy(32)[0], (2e-3, 5e-3, 9e-3)
    alone = [punch.solve(force) for force in forces]
    cases = punch.solve_many([{"force": force} for force in forces])
    path = load_path(punch, [{"force": force} for force in forces])
    for found in (cases.solutions, path.solutions):
        for one, other in zip(found, alone, strict=True):
            assert np.array_equal(one.pressure, other.pressure)
            assert one.settlement == other.settlement


@pytest.mark.filterwarnings("ignore:contact on 1 of 400 cells", "ignore:so few cells")
def test_gradients_that_end_on_one_cell():
    """Uniform pressures settle nothing here: there is no beginning again from all cells."""
    rough = 0.1 * np.random.default_rng(0).random(400)
    ground = PeriodicGround(HalfSpace(2.0, 0.3), (1.0, 1.0))
    s = RigidPunch(ground, cells(20, 20), gap=rough).solve(1e-12, method="cg")
    assert s.success or "the load alone tells their pressures" in s.message


@pytest.mark.parametrize("place", ["at", "moments", "tilt"])
def test_a_place_of_the_load_that_is_none(place):
    """As in tables of cases for other ground, too."""
    punch = wavy(32)[0]
    assert punch.solve(2e-3, **{place: (0, 0)}).settlement == punch.solve(2e-3).settlement


def flat(basis, **options):
    return RigidPunch(PeriodicGround(SOIL, (1.0, 1.0)), basis, **options)


GAP = {"gap": lambda x: x[0]}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PeriodicGround(SOIL, (1.0, 0.0)), "period"),
        (lambda: PeriodicGround(PeriodicGround(SOIL, (1, 1)), (1, 1)), "ground without a period"),
        (lambda: flat(cells(8, 8)), "a shape for gap"),
        (lambda: flat(cells(8, 8), gap=np.ones(64)), "a shape for gap"),
        (lambda: flat(cells(8, 8), edge="singular", **GAP), 'edge "constant"'),
        (lambda: flat(cells(8, 8, 2.0), **GAP).operator, r"period 1 x 1 .* 64 of 64 .* on 2 x 1"),
        (lambda: flat(cells(8, 8, order=np.arange(60)), **GAP).operator, "60 of 64 cells"),
        (
            lambda: flat(CellBasis(MeshTri(), ElementTriP0()), **GAP).operator,
            "regular grid of rectangles",
        ),
        (lambda: flat(cells(8, 8), **GAP).solve(settlement=1.0), "a force alone"),
        (lambda: flat(cells(8, 8), **GAP).solve(1.0, at=(0.1, 0)), "a force alone"),
        (lambda: flat(cells(8, 8), **GAP).solve(1.0, tilt=(0.1, 0)), "a force alone"),
        (lambda: flat(cells(8, 8), **GAP).solve(1.0, unilateral=False), "a force alone"),
        (lambda: flat(cells(8, 8), **GAP).stiffness(), "solve under a force"),
        (lambda: flat(cells(8, 8), **GAP).solve(1.0).bounds, "ground without a period, for b"),
        (
            lambda: write_solution("a.vtu", flat(cells(8, 8), **GAP).solve(1.0)),
            r"Remedy: write_field\(path, solution.punch.basis, solution.pressure\)",
        ),
        (lambda: load_path(flat(cells(8, 8), **GAP), [{"settlement": 1.0}]), "load 0: expected a"),
        (
            lambda: flat(cells(8, 8), **GAP).solve_many({"b": {"settlement": 1.0}}),
            "load case 'b': .* got settlement: ",
        ),
        (lambda: flat(cells(8, 8), **GAP).matrix, "ground without a period"),
        (
            lambda: flat(cells(8, 8), **GAP).solve(1.0).displacement([[0.5], [0.5]]),
            "ground without a period",
        ),
        (
            lambda: RigidPunches.from_subdomains(PeriodicGround(SOIL, (1.0, 1.0)), MeshTri()),
            "ground without a period",
        ),
        (
            lambda: flexible_settlement(
                PeriodicGround(SOIL, (1.0, 1.0)), cells(8, 8), np.ones(64), [[0.0], [0.0]]
            ),
            "ground without a period",
        ),
        (
            lambda: ElasticPunch(PeriodicGround(SOIL, (1, 1)), cells(8, 8), cells(8, 8), None),
            "ground without a period",
        ),
        (
            lambda: InfluenceOperator(
                PeriodicGround(SOIL, (1, 1)), cells(8, 8), method="fast", edge="constant"
            ),
            '"auto" or "toeplitz"',
        ),
        (
            lambda: RigidPunch(
                PeriodicGround(SOIL, (1, 1)), cells(8, 8), gap=lambda x: x[0] ** 2
            ).solve(force=-1.0),
            "does not pull on a PeriodicGround",
        ),
    ],
)
def test_what_a_period_does_not_allow(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_fields_do_not_depend_on_where_the_period_is_cut():
    """The fit and the distance to the edge of contact go on beyond the cut: 31 % off before."""
    n = 24
    side = np.linspace(0, 1, n + 1)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    ground = PeriodicGround(HalfSpace(1.0, 0.0), (1.0, 1.0))
    rng, k = np.random.default_rng(0), np.hypot(*np.meshgrid(*[np.fft.fftfreq(n, 1 / n)] * 2))
    rough = np.where((k >= 1) & (k < 6), np.maximum(k, 1) ** -1.8, 0.0)
    heights = np.fft.ifft2(rough * np.exp(2j * np.pi * rng.random(k.shape))).real
    heights *= 0.01 / heights.std()
    fields = []
    for i, j in ((0, 0), (12, 0), (7, 9)):
        rolled = MeasuredProfile.from_heights(np.roll(heights, (i, j), (0, 1)), 1 / n)
        solution = RigidPunch(ground, cells, gap=rolled).solve(force=0.01)
        basis, values = solution.pressure_field(1)
        assert basis.mesh.p.min() == pytest.approx(0.0, abs=1e-12)
        force = Functional(lambda w: w.p).assemble(basis, p=basis.interpolate(values))
        assert force == pytest.approx(0.01, rel=1e-12)
        x = np.rint(12 * n * basis.doflocs).astype(int)
        moved = (x - 12 * np.array([[i], [j]])) % (12 * n)
        own = (x < 12 * n).all(axis=0)  # once of what is twice
        fields.append(values[own][np.lexsort(moved[:, own])])
    for field in fields[1:]:
        assert field == pytest.approx(fields[0], abs=0.01 * fields[0].max())


def test_fields_that_would_lose_the_force_are_refused(monkeypatch):
    side = np.linspace(0, 1, 9)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    ground = PeriodicGround(HalfSpace(1.0, 0.0), (1.0, 1.0))
    solution = RigidPunch(ground, cells, gap=Paraboloid(1.0, (0.5, 0.5))).solve(force=0.01)
    found = fields._unbalanced

    def nothing(*given):
        basis, values = found(*given)
        return basis, 0.0 * values

    monkeypatch.setattr(fields, "_unbalanced", nothing)
    with pytest.raises(ConvergenceError, match=r"could carry the force\. Remedy: smaller cells"):
        solution.pressure_field(1)
