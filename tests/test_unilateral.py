from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from marks import slow
from plans import disc, perturbed, rectangle
from scipy.sparse.linalg import aslinearoperator
from skfem import CellBasis, ElementQuad0, MeshQuad, MeshTri

from skfem_dual import (
    Cone,
    ConvergenceError,
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Load,
    Paraboloid,
    RigidPunch,
)
from skfem_dual.contact import exact, methods
from skfem_dual.contact.methods import find_contact
from skfem_dual.contact.unilateral import (
    CellForces,
    ContactProblem,
    How,
    active_set,
    conjugate_gradients,
)
from skfem_dual.grids.generate import disc as fine_disc
from skfem_dual.kernels.progress import progress_bar

UNIT = HalfSpace(1.0, 0.0)


def punch(mesh, grid="dual", substrate=UNIT, **options):
    dual = DualMesh.from_mesh(mesh)
    return RigidPunch(
        substrate, dual.basis() if grid == "dual" else dual.primal_basis(), **options
    )


def problem(of, load):
    """The complementarity problem of a punch under a load, motions those of its centroid."""
    s, c = of.system, load.constraints(of.origin - of.centre)
    return ContactProblem(
        s.matrix,
        s.areas,
        s.gap - c.fixed @ s.planes,
        c.motions.T @ s.planes,
        c.balance @ s.resultants,
        c.given,
    )


def test_an_inverse_that_leads_nowhere_is_left():
    """One of the wrong sign: no step along it does less work on the gaps."""
    given = problem(punch(disc(3)), Load(1.0, (0.5, 0.0)))
    found = conjugate_gradients(
        replace(given, inverse=-aslinearoperator(np.eye(len(given.areas))))
    )
    expected = conjugate_gradients(given)
    assert found.success
    assert found.pressure == pytest.approx(expected.pressure, abs=1e-7)
    assert len(found.history) > len(expected.history)


@pytest.mark.parametrize("grid", ["dual", "primal"])
@pytest.mark.parametrize(
    # Circle lifting off: trusted values of W0, tilt, area / pi and the edge on the x axis
    ("e", "settlement", "tilt", "area", "edge"),
    [*slow((0.35, 0.4999, 0.2626, 0.988, -0.91)), (0.5, 0.4821, 0.4190, 0.735, -0.33)],
)
def test_circle_lifting_off(e, settlement, tilt, area, edge, grid):
    size = {"dual": 1200, "primal": 600}[grid]
    solution = punch(fine_disc(n=size), grid).solve(1.0, (e, 0.0))
    assert solution.success
    assert solution.settlement == pytest.approx(settlement, abs=3e-4)
    assert solution.tilt == pytest.approx([tilt, 0.0], abs=5e-4)
    assert solution.contact_area / np.pi == pytest.approx(area, abs=4e-3)
    (line,) = solution.contact_region.edge
    assert np.interp(0.0, *line[::-1, np.argsort(line[1])]) == pytest.approx(edge, abs=0.02)
    assert (solution.pressure >= 0).all()
    assert (solution.gap >= 0).all()
    assert (solution.pressure * solution.gap == 0).all()
    assert solution.complementarity_residual < 1e-12
    assert solution.resultant == pytest.approx([1.0, e, 0.0], abs=1e-12)


def test_steps_do_not_depend_on_the_number_of_cells():
    """The approximate inverse is as good for few cells as for many, uniform and graded."""
    for mesh in (fine_disc(n=300), fine_disc(n=1200), fine_disc(n=1200, graded=0.02)):
        of = punch(mesh)
        constraints = Load(1.0, (0.5, 0.0)).constraints(np.zeros(2))
        contact, _ = find_contact(of.system, constraints, How(method="cg"))
        assert contact.success
        assert len(contact.history) < 15


def test_lift_off_with_edge_weights_at_600_cells():
    solution = punch(fine_disc(n=600)).solve(1.0, (0.5, 0.0))
    assert solution.settlement == pytest.approx(0.4821, rel=1e-3)
    assert solution.tilt[0] == pytest.approx(0.4190, rel=2e-3)


def test_full_contact_is_the_bilateral_solution():
    """Without negative pressures nothing is searched; e = a / 3 is in full contact."""
    of = punch(perturbed(rectangle(9), 0.02))
    for load in ({"force": 1.0}, {"force": 2.0, "at": (0.1, 0.05)}, {"settlement": 1.0}):
        found, expected = of.solve(**load), of.solve(**load, unilateral=False)
        assert np.array_equal(found.pressure, expected.pressure)
        assert found.settlement == expected.settlement
        assert found.message == "full contact"
        assert found.iterations == 0
        for method in ("active-set", "cg"):  # also when the methods begin with other pressures
            other = of.solve(**load, method=method, start=of.solve(1.0, (0.9, 0.0)))
            assert other.pressure == pytest.approx(expected.pressure, rel=1e-8)
    circle = punch(fine_disc(n=600)).solve(1.0, (1 / 3, 0.0))
    assert circle.message == "full contact"


@settings(max_examples=8, deadline=None)
@given(
    st.floats(0, 0.85),
    st.floats(0, 2 * np.pi),
    st.integers(0, 10**6),
    st.floats(0, 0.3),
    st.sampled_from(["dual", "primal"]),
)
def test_complementarity(e, angle, seed, roughness, grid):
    """Random loads on rough punches: conditions to 1e-10, both methods agree to 1e-8."""
    rng = np.random.default_rng(seed)
    mesh = perturbed(rectangle(7), 0.03, seed)
    n = len(mesh.p[0]) if grid == "dual" else mesh.nelements
    of = punch(mesh, grid, edge="singular", gap=roughness * rng.random(n))
    load = {"force": 1.0, "at": (e * np.cos(angle), e * np.sin(angle))}
    direct, iterative = (of.solve(**load, method=method) for method in ("active-set", "cg"))
    for found in (direct, iterative, of.solve(**load)):
        assert found.success
        assert found.complementarity_residual < 1e-10
        assert (found.pressure >= 0).all()
        assert (found.gap >= 0).all()
        assert (found.pressure * found.gap == 0).all()
        assert np.abs(found.resultant_residual).max() < 1e-10
    assert iterative.pressure == pytest.approx(direct.pressure, abs=1e-8 * direct.pressure.max())
    assert iterative.settlement == pytest.approx(direct.settlement, abs=1e-8)
    assert iterative.tilt == pytest.approx(direct.tilt, abs=1e-8)


@pytest.mark.filterwarnings("ignore:contact on")
@settings(max_examples=8, deadline=None)
@given(*[st.floats(-1, 1).map(lambda v: round(v, 9))] * 3)
@example(0.0, 0.0, 0.0)
def test_given_position(settlement, lx, ly):
    """The ground meets the punch where it is pushed in, and nowhere else."""
    of = punch(disc(3), gap=Cone(0.3))
    direct, iterative = (
        of.solve(settlement=settlement, tilt=(lx, ly), method=method)
        for method in ("active-set", "cg")
    )
    assert direct.success
    assert iterative.success
    largest = max(direct.pressure.max(), 1e-300)
    assert iterative.pressure == pytest.approx(direct.pressure, abs=1e-8 * largest)
    assert direct.complementarity_residual < 1e-10
    overlap = of.system.planes.T @ [settlement, lx, ly] - of.initial_gap
    if overlap.max() < 1e-12:
        assert direct.pressure.max() < 1e-10
    if overlap.max() < -1e-12:
        assert direct.message == "no contact"
        assert (direct.pressure == 0).all()
        assert direct.contact_area == 0
        assert direct.mean_pressure == 0
    if overlap.max() > 1e-12:
        assert direct.force > 0


def test_a_reaction_beside_the_given_settlement():
    """Not conjugate: conjugate gradients find the force under which it is the settlement."""
    of = punch(disc(3))
    found = of.solve(settlement=0.5, at=(0.5, 0.1))
    assert found.success
    assert found.settlement == pytest.approx(0.5)
    assert found.centre_of_pressure == pytest.approx([0.5, 0.1])
    again = of.solve(found.force, (0.5, 0.1))
    assert again.pressure == pytest.approx(found.pressure)
    iterated = of.solve(settlement=0.5, at=(0.5, 0.1), method="cg")
    assert iterated.success
    assert iterated.settlement == pytest.approx(0.5, rel=1e-9)
    assert iterated.pressure == pytest.approx(found.pressure, abs=1e-7 * found.pressure.max())


@pytest.mark.parametrize(
    ("shape", "grid"),
    [("sphere", "dual"), ("cone", "primal"), *slow(("sphere", "primal"), ("cone", "dual"))],
)
def test_sphere_and_cone_on_meshes_that_know_nothing_of_them(shape, grid):
    """About 500 cells in contact, irregular, off centre: settlements to 3e-5."""
    centre, a = np.array([0.03, 0.05]), 0.56
    size = 44 if grid == "dual" else 31
    mesh = perturbed(rectangle(size), 0.15 * 2 / size)
    args = (1.0, 0.0)
    if shape == "sphere":
        force, gap = 4 / 3 * a**3, Paraboloid(1.0, tuple(centre))
        approach = exact.hertz_approach(force, 1.0, *args)
        exact_pressure = lambda x: exact.hertz_pressure(x, force, 1.0, *args)  # noqa: E731
    else:
        force, gap = np.pi * a**2 * np.tan(0.3) / 2, Cone(0.3, tuple(centre))
        approach = exact.cone_approach(force, 0.3, *args)
        exact_pressure = lambda x: exact.cone_pressure(x, force, 0.3, *args)  # noqa: E731
    of = punch(mesh, grid, gap=gap, origin=tuple(centre))
    found = of.solve(force)
    assert 350 < len(found.contact) < 650
    assert found.settlement == pytest.approx(approach, rel=3e-5)
    assert np.sqrt(found.contact_area / np.pi) == pytest.approx(a, rel=1e-3)
    assert np.abs(found.tilt).max() < 5e-5
    x = of.partition.centroids - centre[:, None]
    if shape == "sphere":
        assert found.pressure.max() == pytest.approx(exact_pressure(0 * x).max(), rel=3e-3)
    between = (np.hypot(*x) < 0.8 * a) & (np.hypot(*x) > 0.2 * a)
    p = exact_pressure(x)
    error = (found.pressure - p)[between] / p[between].mean()
    assert np.sqrt(np.mean(error**2)) < 1e-2


@pytest.mark.slow
@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_sphere_with_4000_cells_in_contact(grid):
    centre, a = np.array([0.03, 0.05]), 0.56
    size = 127 if grid == "dual" else 90
    mesh = perturbed(rectangle(size), 0.15 * 2 / size)
    of = punch(mesh, grid, gap=Paraboloid(1.0, tuple(centre)), origin=tuple(centre))
    found = of.solve(4 / 3 * a**3)
    assert len(found.contact) > 3500
    assert found.settlement == pytest.approx(a**2, rel=1e-4)
    assert np.sqrt(found.contact_area / np.pi) == pytest.approx(a, rel=1e-3)
    assert found.pressure.max() == pytest.approx(2 * a / np.pi, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("e", "settlement", "tilt", "area", "edge"),
    [(0.35, 0.4999, 0.2626, 0.988, -0.91), (0.5, 0.4821, 0.4190, 0.735, -0.33)],
)
def test_circle_lifting_off_with_4000_cells(e, settlement, tilt, area, edge):
    found = punch(fine_disc(n=4000)).solve(1.0, (e, 0.0))
    assert found.success
    assert found.settlement == pytest.approx(settlement, abs=1e-4)
    assert found.tilt[0] == pytest.approx(tilt, abs=2e-4)
    assert found.contact_area / np.pi == pytest.approx(area, abs=3e-3)
    (line,) = found.contact_region.edge
    assert np.interp(0.0, *line[::-1, np.argsort(line[1])]) == pytest.approx(edge, abs=0.02)


def test_convergence_under_refinement():
    """At e = 0.5 a positions by points settle down at least in proportion to h, those by work
    begin nearer to where they go."""
    found = [punch(fine_disc(n=n)).solve(1.0, (0.5, 0.0)) for n in (75, 300, 1200)]
    by_work, _, by_points = np.array([s.positions[:, :2] for s in found]).swapaxes(0, 1)
    first, second = np.abs(np.diff(by_points, axis=0))
    assert (second < first / 2).all()
    assert (np.abs(by_work - by_work[2])[:2] < 0.6 * np.abs(by_points - by_work[2])[:2]).all()


def test_any_ground():
    ground = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)
    of = punch(disc(4), substrate=ground)
    direct = of.solve(1.0, (0.5, 0.0), method="active-set")
    iterative = of.solve(1.0, (0.5, 0.0), method="cg")
    assert iterative.pressure == pytest.approx(direct.pressure, abs=1e-8 * direct.pressure.max())
    assert direct.contact_area < np.pi


def test_products_are_enough_for_conjugate_gradients():
    of = punch(disc(4))
    dense = problem(of, Load(force=1.0, at=(0.5, 0.1)))
    sparse = problem(of, Load(force=1.0, at=(0.5, 0.1)))
    object.__setattr__(sparse, "matrix", aslinearoperator(of.matrix))
    one, two = conjugate_gradients(dense), conjugate_gradients(sparse)
    assert two.pressure == pytest.approx(one.pressure, abs=1e-9 * one.pressure.max())
    assert len(two.history) < 60
    assert two.history[-1] <= 1e-10


def test_exchanges_that_would_go_round_come_to_an_end():
    """Changing all wrong cells at once leads from two of the three cells to the next two."""
    D = np.array([[1.0, 2, 0], [0, 1, 2], [2, 0, 1]])  # K. G. Murty's example, a P-matrix
    none = np.empty((0, 3))
    problem = ContactProblem(D, np.ones(3), -np.ones(3), none, none, np.empty(0))
    found = active_set(problem, np.array([True, True, False]))
    assert found.success
    assert found.pressure == pytest.approx(1 / 3)
    assert found.history[:4] == (2, 2, 2, 2)


def test_cells_come_back():
    """Begun with a few cells only, both methods let the others in."""
    of = punch(disc(3))
    p = problem(of, Load(force=1.0, at=(0.4, 0.0)))
    few = np.zeros(len(of.partition), dtype=bool)
    few[:5] = True
    direct = active_set(p, few)
    iterative = conjugate_gradients(p, np.where(few, 1.0, 0.0))
    assert direct.success
    assert iterative.success
    expected = active_set(p, np.ones_like(few)).pressure
    assert direct.pressure == pytest.approx(expected)
    assert iterative.pressure == pytest.approx(expected, abs=1e-8 * expected.max())


def test_warm_start_on_another_grid():
    coarse = punch(disc(3)).solve(1.0, (0.6, 0.0))
    fine = punch(disc(4))
    cold = fine.solve(1.0, (0.6, 0.0), method="active-set")
    warm = fine.solve(1.0, (0.6, 0.0), method="active-set", start=coarse)
    assert warm.pressure == pytest.approx(cold.pressure)
    assert warm.iterations < cold.iterations
    with pytest.raises(TypeError, match="for start, got 3"):
        fine.solve(1.0, start=3)


def test_no_convergence_is_told(monkeypatch):
    of = punch(disc(3))
    p = problem(of, Load(force=1.0, at=(0.7, 0.0)))
    for found in (
        active_set(p, np.ones(len(of.partition), dtype=bool), most=2),
        conjugate_gradients(p, most=3),
    ):
        assert not found.success
        assert "no convergence in" in found.message
        assert len(found.history) in (2, 3)
    monkeypatch.setattr(methods, "active_set", lambda p, c, **how: active_set(p, c, 1, **how))
    monkeypatch.setattr(methods, "_from_all", lambda *arguments: None)
    with pytest.warns(ConvergenceWarning, match="no convergence in 1 iterations"):
        solution = of.solve(1.0, (0.7, 0.0), method="active-set")
    assert not solution.success
    assert "no convergence" in repr(solution)


def test_loads_that_cannot_be_balanced():
    """Straight into the solvers, which are not asked whether the load is possible."""
    of = punch(disc(2))
    p = problem(of, Load(force=1.0, at=(3.0, 0.0)))
    for found in (active_set(p, np.ones(len(of.partition), dtype=bool)), conjugate_gradients(p)):
        assert not found.success
        assert found.message


@settings(max_examples=4, deadline=None)
@given(st.floats(0, 2 * np.pi), st.floats(1e-3, 1e3), st.integers(0, 1000))
def test_invariance(angle, size, seed):
    """Turned, scaled and renumbered: the same contact."""
    mesh = perturbed(disc(3), 0.02)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    order = np.random.default_rng(seed).permutation(mesh.p.shape[1])
    place = np.argsort(order)
    other = MeshTri(size * turn @ mesh.p[:, order] + 5 * size, place[mesh.t])
    one = punch(mesh).solve(1.0, (0.45, 0.1))
    moved = punch(other, origin=(5 * size, 5 * size))
    two = moved.solve(3.0, tuple(size * turn @ [0.45, 0.1]))
    assert two.settlement == pytest.approx(3 * one.settlement / size)
    assert two.tilt == pytest.approx(turn @ one.tilt * 3 / size**2)
    assert two.pressure == pytest.approx(
        3 / size**2 * one.pressure[order], abs=1e-9 * 3 / size**2 * one.pressure.max()
    )
    assert two.contact_area == pytest.approx(size**2 * one.contact_area, rel=1e-3)


def test_contact_of_a_flat_punch_does_not_depend_on_the_force():
    of = punch(disc(4))
    one, two = of.solve(1.0, (0.6, 0.0)), of.solve(1e6, (0.6, 0.0))
    assert np.array_equal(one.contact, two.contact)
    assert two.pressure == pytest.approx(1e6 * one.pressure)


@pytest.mark.parametrize("gap_rtol", [0, 1, 10, -1e-6, np.nan])
def test_bad_accuracy_of_the_gaps(gap_rtol):
    """It was taken for the largest violation whatever it was: 10 is met by no solution at all."""
    of = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(disc(2)).basis())
    for method in ("auto", "cg", "active-set"):
        with pytest.raises(ValueError, match="gap_rtol"):
            of.solve(1.0, at=(0.5, 0.0), method=method, gap_rtol=gap_rtol)
    with pytest.raises(TypeError, match="number for gap_rtol, got 'fine'"):
        of.solve(1.0, gap_rtol="fine")


def test_forces_on_millions_of_cells_balance():
    """From nothing, and from forces of which half pull."""
    n = 2**21
    ones, areas = np.ones((1, n)), np.full(n, 1 / n)
    forces = CellForces.from_problem(
        ContactProblem(np.empty(0), areas, np.zeros(n), ones, ones * areas, np.array([0.08]))
    )
    for start in (np.zeros(n), np.linspace(-1, 1, n) / n):
        force = forces.balanced(start)
        assert force.min() >= 0
        assert force.sum() == pytest.approx(0.08, rel=1e-12)


@pytest.mark.filterwarnings("ignore::skfem_dual.ResolutionWarning")
@pytest.mark.parametrize("seed", [None, 0, 1])
@pytest.mark.parametrize("method", ["auto", "active-set"])
def test_contact_on_one_row_of_cells(seed, method):
    """A central load does not turn the punch about it."""
    mesh = MeshTri.init_tensor(np.linspace(-3, 3, 9), np.linspace(-1, 1, 9))
    if seed is not None:
        order = np.random.default_rng(seed).permutation(mesh.p.shape[1])
        mesh = MeshTri(mesh.p[:, order], np.argsort(order)[mesh.t])
    shaped = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(mesh).basis(), gap=Paraboloid(1.5))
    for force in 0.02, 0.1:
        found = shaped.solve(force, method=method)
        assert found.success
        assert len(found.contact) <= 5
        held = shaped.solve(force, tilt=(0.0, 0.0))
        assert found.settlement == pytest.approx(held.settlement, rel=1e-9)
        beside = shaped.solve(force, at=(1e-6, 0.0))
        assert found.settlement == pytest.approx(beside.settlement, rel=1e-3)


def test_a_line_of_cells_bears_no_load_beside_it():
    """What the load would turn without resistance is no contact."""
    x = np.linspace(-1, 1, 5)
    points = np.vstack([x, 0 * x])
    matrix = np.eye(5) + 0.1
    planes = np.vstack([np.ones(5), points])
    problem = ContactProblem(matrix, np.ones(5), np.zeros(5), planes, planes, np.zeros(3))
    for load, bears in ([1.0, 0.2, 0.0], True), ([1.0, 0.2, 0.1], False):
        found = active_set(replace(problem, given=np.array(load)), np.ones(5, dtype=bool))
        assert found.success == bears
        if bears:
            assert planes @ found.pressure == pytest.approx(load, abs=1e-12)
            assert found.motion[2] == pytest.approx(0.0, abs=1e-12)


def in_a_row(n, turn=0.0, at=0.0):
    """Squares in a row, and how far points are along it and beside it."""
    way = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    mesh = MeshQuad.init_tensor(np.linspace(-1, 1, n + 1), np.array([-1, 1]) / n)
    cells = CellBasis(MeshQuad(way @ mesh.p + at, mesh.t), ElementQuad0())
    return cells, lambda x: np.einsum("ij,j...->i...", way.T, x - at)


@pytest.mark.parametrize("turn", [0.0, 0.5])
@pytest.mark.parametrize("method", ["auto", "cg", "active-set"])
def test_cells_in_a_row_do_not_resist_turning_about_it(method, turn):
    """Once their arms of 1e-17 did, by tilts of 1e14, with success."""
    cells, seen = in_a_row(300, turn)
    with pytest.raises(ConvergenceError, match=r"without resistance.* or impose tilt=\(0, 0\)"):
        RigidPunch(UNIT, cells, edge="constant").solve(0.01, method=method)
    punch = RigidPunch(UNIT, cells, gap=lambda x: seen(x)[0] ** 2)
    guided = punch.solve(0.01, tilt=(0.0, 0.0), method=method)
    free = punch.solve(0.01, method=method)
    assert free.success
    assert free.settlement == pytest.approx(guided.settlement, rel=1e-8)
    np.testing.assert_allclose(free.tilt, 0.0, atol=1e-12)


@pytest.mark.parametrize("at", [0.0, 0.3, 4.5e5])
@pytest.mark.parametrize("method", ["auto", "cg", "active-set"])
def test_contact_in_a_row_amid_other_cells(method, at):
    """Of a ridge along a row of a grid, wherever the origin is."""
    sides = np.linspace(-1, 1, 22) + at
    cells = CellBasis(MeshQuad.init_tensor(sides, sides), ElementQuad0())
    ridge = lambda x: np.abs(x[1] - at) + 0.02 * (x[0] - at) ** 2  # noqa: E731
    s = RigidPunch(UNIT, cells, gap=ridge, origin=(at, at)).solve(0.02, method=method)
    assert s.success
    assert len(s.contact) == 21
    assert np.abs(s.tilt).max() < 1e-10


@pytest.mark.parametrize("turn", [0.0, 0.5, 2.0])
def test_loads_beside_a_line_of_cells_are_no_rounding(turn):
    """A millionth of a percent of the load's arm is beside the line, the last digit is on it."""
    way = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    planes = np.vstack([np.ones(5), way @ [np.linspace(-1, 1, 5), np.zeros(5)]])
    problem = ContactProblem(np.eye(5) + 0.1, np.ones(5), np.zeros(5), planes, planes, np.zeros(3))
    for beside, bears in (1e-15, True), (1e-8, False):
        load = np.array([1.0, *way @ [0.2, beside]])
        found = active_set(replace(problem, given=load), np.ones(5, dtype=bool))
        assert found.success == bears


def test_a_light_body_beside_a_heavy_one_bears_its_load():
    """Its pressures are no rounding of those beside it."""
    planes = np.kron(np.eye(2), np.ones(2))
    loads = np.array([1.0, 1e-11])
    problem = ContactProblem(np.eye(4), np.ones(4), np.zeros(4), planes, planes, loads)
    for found in active_set(problem, np.ones(4, dtype=bool)), conjugate_gradients(problem):
        assert found.success
        assert found.pressure == pytest.approx(loads.repeat(2) / 2, rel=1e-9)


def test_no_bar_is_made_where_none_is_shown(monkeypatch):
    """Even one that is not shown takes locks that forked processes share."""

    def tqdm(*args, **kwargs):
        raise AssertionError("made a bar")

    monkeypatch.setattr("tqdm.tqdm", tqdm)
    with progress_bar(False, "contact", "it", total=2) as bar:
        bar.update()
        bar.set_postfix_str("violation")
    with pytest.raises(AssertionError, match="made a bar"):
        progress_bar(True, "contact", "it")
    solution = RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(disc(2)).basis()).solve(
        1.0, at=(0.7, 0.0), method="cg"
    )
    assert solution.success
