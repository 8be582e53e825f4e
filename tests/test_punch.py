"""Punches against exact solutions and trusted numbers (references of the project)."""

import pickle
from copy import deepcopy
from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from plans import annulus, disc, ellipse, perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, ElementTriP1, MeshQuad, MeshTri

from skfem_dual import (
    ConvergenceError,
    ConvergenceWarning,
    DualMesh,
    HalfSpace,
    Load,
    MeshError,
    Paraboloid,
    PunchSolution,
    RigidPunch,
)
from skfem_dual.contact import exact

SOIL = HalfSpace(1.0, 0.25)
UNIT = HalfSpace(1.0, 0.0)  # E* = 1


def punch(mesh, grid="dual", **options):
    """The paper's scheme, constant pressures, unless said otherwise."""
    options.setdefault("edge", "constant")
    dual = DualMesh.from_mesh(mesh)
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    return RigidPunch(options.pop("substrate", UNIT), basis, **options)


def test_uniform_polar_grid_of_table_1():
    """W/a = 0.47802 and mean square error 4.3265e-3, all printed digits."""
    problem = RigidPunch(SOIL, CellBasis(polar(10, 40), ElementQuad0()), edge="constant")
    solution = problem.solve(force=1.0)
    assert f"{solution.settlement:.5f}" == "0.47802"
    p = exact.circle_pressure(problem.partition.centroids, 1.0, 1.0)
    assert f"{np.mean((solution.pressure - p) ** 2):.4e}" == "4.3265e-03"
    # degree of conditionality 274.0 in print: nearest is the matrix with rows scaled to sum 1
    assert problem.condition_number == pytest.approx(246.9, abs=0.1)
    scaled = problem.matrix / problem.matrix.sum(axis=1, keepdims=True)
    assert np.linalg.cond(scaled) == pytest.approx(275.4, abs=0.1)


# plan of three sizes; exact stiffness by settlement and tilts with E* = 1, where known.
# Circle and ellipse: exact. Square, rectangle, annulus: computed by independent methods.
PLANS = {
    "disc": (lambda k, graded: disc(3 + k, graded), (2.0, 4 / 3, 4 / 3)),
    "ellipse": (
        lambda k, graded: ellipse(3 + k, 1.0, 0.5, graded),
        (1 / exact.ellipse_settlement(1.0, (1.0, 0.5), 1.0, 0.0), None, None),
    ),
    "square": (
        lambda k, graded: rectangle((11, 23, 46)[k], graded=graded),
        (np.pi * 0.733576, np.pi * 0.662348, np.pi * 0.662348),
    ),
    "rectangle": (
        lambda k, graded: rectangle((8, 16, 32)[k], 1.0, 2.0, graded),
        (np.pi * 1.063836, np.pi * 1.171241, np.pi * 3.201667),
    ),
    "annulus": (
        lambda k, graded: annulus((4, 8, 16)[k], (36, 72, 144)[k], 0.5, graded),
        (np.pi * 0.6245354, None, None),
    ),
}


def compliance_errors(name, k, graded, grid, collocation):
    mesh, stiffness = PLANS[name]
    K = punch(mesh(k, graded), grid, collocation=collocation).stiffness().diagonal()
    return np.array([s / found - 1 for s, found in zip(stiffness, K, strict=True) if s])


@pytest.mark.parametrize("graded", [False, True], ids=["uniform", "graded"])
@pytest.mark.parametrize("name", ["annulus", "rectangle", *slow("disc", "ellipse")])
def test_settlement_and_tilt_of_known_plans(name, graded):
    """About 150, 600 and 2200 cells: centroids above, nodes below the exact answer."""
    above = [compliance_errors(name, k, graded, "dual", "centroid") for k in range(3)]
    below = [compliance_errors(name, k, graded, "dual", "node") for k in range(3)]
    triangles = [compliance_errors(name, k, graded, "primal", "centroid") for k in range(2)]
    assert all((e > 0).all() for e in above + triangles)
    assert all((e < 0).all() for e in below)
    assert 0 < above[1][0] < 1e-2
    # twice as many cells along a line: half the error, a quarter when graded to the edge
    order = 1.6 if graded else 0.9
    assert (np.log2(above[1] / above[2]) > order).all()
    assert (np.log2(below[1] / below[2]) > order).all()
    if not graded:
        assert (np.log2(above[1] / above[2]) < 1.15).all()


def test_eccentric_force_on_a_disc():
    """e = 0.2 a < a / 3: tilt, and the pressure away from the edge."""
    e = np.array([0.16, -0.12])
    solution = punch(disc(5, graded=True), substrate=SOIL).solve(force=3.0, at=e)
    tilt = exact.circle_tilt(3.0 * e, 1.0, 1.0, 0.25)
    assert solution.tilt == pytest.approx(tilt, rel=2e-3)
    assert solution.settlement == pytest.approx(
        exact.circle_settlement(3.0, 1.0, 1.0, 0.25), rel=1e-3
    )
    x = solution.punch.partition.centroids
    inside = np.hypot(*x) < 0.8
    p = exact.circle_pressure(x, 3.0, 1.0, 3.0 * e)
    assert solution.pressure[inside] == pytest.approx(p[inside], rel=1e-2)
    assert np.sqrt(np.mean((solution.pressure / p - 1)[inside] ** 2)) < 3e-3


def test_pressure_at_the_nodes_of_triangles():
    """The mean over the triangles around a node comes near the exact pressure."""
    solution = punch(disc(5, graded=True), "primal").solve(force=1.0)
    basis, p = solution.nodal_pressure()
    assert isinstance(basis.elem, ElementTriP1)
    x = basis.doflocs
    inside = np.hypot(*x) < 0.8
    expected = exact.circle_pressure(x, 1.0, 1.0)
    assert np.sqrt(np.mean((p[inside] / expected[inside] - 1) ** 2)) < 5e-3


@settings(max_examples=30, deadline=None)
@given(
    st.tuples(*[st.floats(-1e3, 1e3, allow_subnormal=False)] * 5),
    st.floats(1e-3, 1e3),
)
def test_resultants_equal_the_load(load, size):
    """(4) with its signs: first moments P ex - M1 and P ey + M2, to 1e-10."""
    force, ex, ey, m1, m2 = load
    mesh = disc(2)
    solution = punch(MeshTri(size * mesh.p + 3.0 * size, mesh.t)).solve(
        force, (ex, ey), (m1, m2), unilateral=False
    )
    expected = np.array([force, force * ex - m1, force * ey + m2])
    partition = solution.punch.partition
    weights = solution.pressure * partition.areas
    found = np.array([weights.sum(), *(partition.centroids @ weights)])
    scale = np.abs(weights).sum() * np.array([1, 4 * size, 4 * size]) + np.abs(expected)
    assert (np.abs(found - expected) <= 1e-10 * scale).all()
    assert (np.abs(solution.resultant - expected) <= 1e-10 * scale).all()
    assert (np.abs(solution.resultant_residual) <= 1e-10 * scale).all()


def test_signs_of_the_moments():
    """M1 lessens the first moment in x, M2 raises that in y; the punch tilts towards its load."""
    problem = punch(disc(3))
    force, m1, m2 = 2.0, 0.3, -0.2
    solution = problem.solve(force, moments=(m1, m2))
    assert solution.resultant == pytest.approx([force, -m1, m2])
    same = problem.solve(force, at=(-m1 / force, m2 / force))
    assert same.pressure == pytest.approx(solution.pressure)
    assert same.centre_of_pressure == pytest.approx([-m1 / force, m2 / force])
    assert (solution.tilt < 0).all()


def test_displacements_of_ground_and_punch_agree_in_the_collocation_points():
    for collocation in ("centroid", "node"):
        problem = punch(perturbed(rectangle(8), 0.03), collocation=collocation)
        solution = problem.solve(1.0, at=(0.1, 0.2))
        x = problem.collocation_points
        assert solution.displacement(x) == pytest.approx(solution.punch_displacement(x))
        assert solution.displacement_residual < 1e-14
    # beside the punch the ground follows, less and less
    far = solution.displacement([[1.2, 2.0, 40.0], [0.0, 0.0, 0.0]])
    assert solution.settlement > far[0] > far[1] > far[2]
    assert far[2] == pytest.approx(UNIT.influence(40 - 0.1), rel=1e-3)


def test_given_position():
    problem = punch(disc(3), origin=(0.2, -0.1))
    loaded = problem.solve(2.0, (0.1, 0.05), (0.02, 0.01))
    placed = problem.solve(settlement=loaded.settlement, tilt=loaded.tilt)
    assert placed.pressure == pytest.approx(loaded.pressure, rel=1e-10)
    assert placed.resultant == pytest.approx(loaded.resultant, rel=1e-12)
    assert problem.stiffness() @ [loaded.settlement, *loaded.tilt] == pytest.approx(
        loaded.resultant
    )


def test_guided_punch():
    """A force with a given tilt, and a settlement with a free tilt."""
    problem = punch(rectangle(6, 1.0, 2.0))
    guided = problem.solve(force=1.5, tilt=(0.1, -0.05))
    assert guided.force == pytest.approx(1.5)
    assert guided.tilt == pytest.approx([0.1, -0.05])
    pushed = problem.solve(settlement=0.3, at=(0.1, 0.2))
    assert pushed.settlement == pytest.approx(0.3)
    assert pushed.centre_of_pressure == pytest.approx([0.1, 0.2])
    with_moments = problem.solve(settlement=0.3, at=(0.1, 0.2), moments=(0.01, 0.02))
    force = with_moments.force
    assert with_moments.resultant[1:] == pytest.approx([force * 0.1 - 0.01, force * 0.2 + 0.02])


def test_stiffness_is_nearly_symmetric_and_follows_the_origin():
    mesh = perturbed(rectangle(10), 0.02)
    K = punch(mesh).stiffness()
    assert pytest.approx(K.T, abs=2e-2 * K[0, 0]) == K
    shift = np.array([0.3, -0.7])
    moved = MeshTri(mesh.p + shift[:, None], mesh.t)
    assert punch(moved, origin=shift).stiffness() == pytest.approx(K)
    T = np.eye(3)
    T[0, 1:] = shift  # settlement of the plan's old origin by motions about the new one
    assert punch(moved).stiffness() == pytest.approx(T.T @ K @ T)


def test_far_from_the_origin():
    """No digits are lost where the coordinates are large."""
    near = punch(disc(3)).solve(1.0, (0.1, 0.05))
    mesh = disc(3)
    far = punch(MeshTri(mesh.p + 1e4, mesh.t), origin=(1e4, 1e4)).solve(1.0, (0.1, 0.05))
    assert far.settlement == pytest.approx(near.settlement, rel=1e-10)
    assert far.tilt == pytest.approx(near.tilt, rel=1e-9)


def test_scaling():
    """Settlement goes with P (1 - nu^2) / (E a)."""
    mesh = disc(3)
    one = punch(mesh).solve(1.0, (0.1, 0.0))
    big = punch(MeshTri(7.0 * mesh.p, mesh.t), substrate=HalfSpace(5e6, 0.3)).solve(
        3e5, (0.7, 0.0)
    )
    factor = 3e5 * (1 - 0.3**2) / (5e6 * 7)
    assert big.settlement == pytest.approx(factor * one.settlement)
    assert big.tilt == pytest.approx(factor / 7 * one.tilt, abs=1e-12)
    assert big.pressure == pytest.approx(3e5 / 49 * one.pressure)
    assert big.condition_number == pytest.approx(one.condition_number)


def test_triangles_of_skfem_and_of_the_dual_mesh_are_the_same_problem():
    mesh = disc(3)
    ours = punch(mesh, "primal").solve(1.0)
    theirs = RigidPunch(UNIT, CellBasis(mesh, ElementTriP0()), edge="constant").solve(1.0)
    assert theirs.pressure == pytest.approx(ours.pressure)
    _, values = theirs.nodal_pressure()
    assert values == pytest.approx(ours.nodal_pressure()[1])


def test_condition_number():
    problem = punch(perturbed(rectangle(9), 0.03))
    assert problem.condition_number == pytest.approx(np.linalg.cond(problem.matrix), rel=1e-6)
    single = punch(MeshTri.init_refdom(), "primal")
    assert single.condition_number == 1.0


def test_bilateral_contact_pulls_and_says_so():
    """Beyond a / 3 the ground would have to pull."""
    problem = punch(disc(3))
    pulled = problem.solve(1.0, at=(0.6, 0.0), unilateral=False)
    assert pulled.pressure.min() < 0
    n = np.sum(pulled.pressure < 0)
    assert f"pull on {n} cells" in pulled.message
    assert "pull" in repr(pulled)
    assert problem.solve(1.0, at=(0.2, 0.0)).message == "full contact"


def test_the_answer():
    begin = perf_counter()
    solution = punch(disc(3)).solve(2.0, at=(0.1, 0.0))
    seconds = perf_counter() - begin
    assert isinstance(solution, PunchSolution)
    assert solution.success
    text = repr(solution)
    for part in (
        "145 dual cells, constant edge, centroid",
        "Settlement W0",
        "Tilt",
        "Condition number",
        "Time",
    ):
        assert part in text
    assert solution.contact_area == pytest.approx(np.pi)
    assert solution.mean_pressure == pytest.approx(2 / np.pi)
    assert set(solution.timings) == {"assembly", "factorisation", "solution"}
    assert 0 < sum(solution.timings.values()) < seconds  # no stage counts twice
    again = pickle.loads(pickle.dumps(solution))
    assert np.array_equal(again.pressure, solution.pressure)
    with pytest.raises(ValueError, match="read-only"):
        solution.pressure[0] = 0.0
    assert "RigidPunch" in repr(solution.punch)
    assert "dual cells" in repr(solution.punch)


def test_no_load_no_pressure():
    solution = punch(disc(2)).solve(0.0)
    assert (solution.pressure == 0).all()
    assert np.isnan(solution.centre_of_pressure).all()
    assert "full contact" in repr(solution)


@pytest.mark.parametrize(
    ("load", "error", "message"),
    [
        ({}, ValueError, "either a force or a settlement, got neither"),
        ({"force": 1.0, "settlement": 1.0}, ValueError, "got both"),
        ({"force": 1.0, "at": (0, 0), "tilt": (0, 0)}, ValueError, "tilt or a load point"),
        ({"force": 1.0, "moments": (0, 0), "tilt": (0, 0)}, ValueError, "tilt or a load point"),
        ({"force": np.nan}, ValueError, "finite force, got nan"),
        ({"force": "much"}, TypeError, "number for force, got 'much'"),
        ({"force": 1.0, "at": 0.1}, TypeError, "two numbers for at, got 0.1"),
        ({"force": 1.0, "at": (0.1, np.inf)}, ValueError, "finite at"),
        ({"force": 1.0, "moments": (1, 2, 3)}, TypeError, "two numbers for moments"),
        ({"settlement": 1.0, "tilt": (np.nan, 0)}, ValueError, "finite tilt"),
        ({"force": -1.0}, ValueError, "expected a force into the ground"),
        ({"force": 0.0, "moments": (1, 0)}, ValueError, "expected a positive force"),
        ({"force": 0.0, "tilt": (1, 0)}, ValueError, "expected a positive force"),
        ({"force": 1.0, "at": (0.0, 1.1)}, ValueError, "outside the convex hull of the plan"),
        ({"force": 1.0, "moments": (-2, 0)}, ValueError, "outside the convex hull of the plan"),
        ({"force": 1.0, "at": (0.95, 0.0)}, ValueError, "than its outermost cells"),
        ({"force": 1.0, "method": "magic", "at": (0.5, 0.0)}, ValueError, "expected method"),
    ],
)
def test_bad_loads(load, error, message):
    with pytest.raises(error, match=message):
        punch(disc(1)).solve(**load)


def test_origins_off_the_plan_are_told_with_loads_that_are():
    """Meshes at site coordinates meet the default origin, with which no load is on the plan."""
    far = punch(disc(1).translated((4.5e5, 5.4e6)))
    with pytest.raises(
        ValueError, match=r"or the origin, which is 5.*e\+06 off the plan, origin="
    ):
        far.solve(1.0)
    with pytest.raises(ValueError, match=r"got one at \(451204\.8, 0\) from.* middle, or unil"):
        punch(disc(1)).solve(1.0, at=(451204.8, 0.0))


def test_bad_problems():
    basis = DualMesh.from_mesh(disc(1)).basis()
    with pytest.raises(TypeError, match="expected a substrate such as HalfSpace, got 3"):
        RigidPunch(30e6, basis)
    with pytest.raises(ValueError, match='"centroid" or "node", got \'barycentre\''):
        RigidPunch(UNIT, basis, collocation="barycentre")
    with pytest.raises(ValueError, match='"singular" or "constant", got \'sharp\''):
        RigidPunch(UNIT, basis, edge="sharp")
    with pytest.raises(ValueError, match='collocation "centroid" with edge "singular"'):
        RigidPunch(UNIT, basis, collocation="node")
    with pytest.raises(TypeError, match="two numbers for origin"):
        RigidPunch(UNIT, basis, origin=0.0)
    with pytest.raises(TypeError, match="basis of piecewise constants"):
        RigidPunch(UNIT, disc(1))
    with pytest.raises(MeshError, match=r"all \d+ elements"):
        RigidPunch(UNIT, basis.with_elements([0]))


def test_too_few_cells_cannot_resist_tilting():
    with pytest.raises(ConvergenceError, match="move without resistance"):
        punch(MeshTri.init_refdom(), "primal").solve(1.0)


def test_mechanisms_are_refused_however_they_are_turned():
    """Two triangles, three quadrilaterals in a row, one cell: too few or on one line."""
    for angle in (0.0, 0.1, 0.3, 0.7, 1.0):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        two = MeshTri(turn @ MeshTri().p, MeshTri().t)
        row = MeshQuad.init_tensor(np.arange(4.0), np.arange(2.0))
        row = MeshQuad(turn @ row.p, row.t)
        for basis in (
            CellBasis(two, ElementTriP0()),
            CellBasis(row, ElementQuad0()),
            CellBasis(MeshQuad(turn @ MeshQuad().p, MeshQuad().t), ElementQuad0()),
        ):
            with pytest.raises(ConvergenceError, match="move without resistance"):
                RigidPunch(UNIT, basis).solve(1.0, (0.1, 0.1))
            with pytest.raises(ConvergenceError, match="move without resistance"):
                RigidPunch(UNIT, basis).kern()


def test_a_load_for_a_force_is_told():
    with pytest.raises(TypeError, match=r"a number for force, got a Load. Remedy: its fields"):
        punch(disc(2), "dual").solve(Load(force=1.0))


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_shaped_punches_do_not_tilt_across_a_row(angle):
    """With success they had a tilt that the shape contradicts, since no cell resists it."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])

    def wedge(x):
        along, across = turn.T @ x
        return (along - 1.5) ** 2 / 60 + 0.2 * across

    def solver(rows):
        mesh = MeshQuad.init_tensor(np.linspace(0, 3, 31), np.linspace(0, 0.3, rows + 1))
        basis = CellBasis(MeshQuad(turn @ mesh.p, mesh.t), ElementQuad0())
        return RigidPunch(UNIT, basis, gap=wedge, origin=turn @ [1.5, 0.15])

    row, message = solver(1), "even across a row of cells.*side, or impose tilt"
    with pytest.raises(ValueError, match=message):
        row.solve(0.02)
    guided = row.solve(0.02, tilt=(0, 0))
    assert guided.success
    with pytest.warns(ConvergenceWarning, match=f"1 of 2 load cases without a.*{message}"):
        cases = row.solve_many([{"force": 0.02}, {"force": 0.02, "tilt": (0, 0)}])
    assert cases.settlement == pytest.approx([np.nan, guided.settlement], rel=1e-9, nan_ok=True)
    assert solver(2).solve(0.02).tilt == pytest.approx(turn @ [0, 0.2], abs=1e-9)


def test_cells_on_top_of_each_other_are_refused():
    q = MeshQuad().refined(2)
    for shift in (0.0, 0.3):
        twice = MeshQuad(np.hstack([q.p, q.p + shift]), np.hstack([q.t, q.t + q.p.shape[1]]))
        with pytest.raises(MeshError, match="covered twice"):
            RigidPunch(UNIT, CellBasis(twice, ElementQuad0()))


def test_slips():
    dual = DualMesh.from_mesh(disc(1))
    with pytest.raises(TypeError, match="got DualMesh"):
        RigidPunch(UNIT, dual)
    with pytest.raises(TypeError, match="expected a substrate"):
        RigidPunch(HalfSpace, dual.basis())
    solution = RigidPunch(UNIT, dual.basis()).solve(1.0, (0.3, 0.1))
    with pytest.raises(ValueError, match=r"shape \(2, \.\.\.\)"):
        solution.punch_displacement([0.5, 0.2, 0.1])
    with pytest.raises(ConvergenceError):
        RigidPunch(UNIT, dual.basis()).solve(10.0, (1e308, 1e308), unilateral=False)


def test_variants_have_the_edge_of_their_own_shape():
    """`replace` hands the default on, which was then taken for chosen."""
    basis = DualMesh.from_mesh(disc(4)).basis()
    shaped = RigidPunch(HalfSpace(1.0, 0.3), basis, gap=Paraboloid(1.0))
    flat = RigidPunch(HalfSpace(1.0, 0.3), basis)
    for variant, fresh, force in (
        (replace(shaped), shaped, 2.0),
        (pickle.loads(pickle.dumps(replace(shaped, symmetry=None))), shaped, 2.0),
        (replace(flat, gap=Paraboloid(1.0)), shaped, 0.5),
        (replace(shaped, gap=None), flat, 1.0),
    ):
        assert variant.edge == fresh.edge
        found, expected = variant.solve(force), fresh.solve(force)
        assert found.pressure == pytest.approx(expected.pressure, rel=1e-12)
    chosen = replace(shaped, edge="constant")
    assert not chosen.edge_by_contact
    assert replace(chosen, gap=None).edge == "constant"


def test_a_shape_changed_later_is_none_of_the_punch():
    """Variants and pickles were of the values that stand in the array now."""
    basis = DualMesh.from_mesh(disc(2)).basis()
    gap = np.linspace(0.0, 0.1, len(RigidPunch(SOIL, basis).partition))
    punch = RigidPunch(SOIL, basis, gap=gap)
    expected = punch.solve(0.2).settlement
    gap[:] = 0.0
    assert pickle.loads(pickle.dumps(punch)).solve(0.2).settlement == expected
    assert replace(punch, rtol=1e-9).solve(0.2).settlement == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("copied", [lambda x: pickle.loads(pickle.dumps(x)), deepcopy])
def test_copies_do_not_go_stale(copied):
    """Their shape could be changed, but not what had been computed from it."""
    known = punch(disc(2), edge="constant")
    shaped = copied(replace(known, gap=known.partition.centroids[0] ** 2))
    solution = copied(shaped.solve(1.0))
    arrays = shaped.gap, solution.pressure, solution.gap, solution.resultant
    assert not any(array.flags.writeable for array in arrays)
    assert not solution.collocated_tilt.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        shaped.gap[:] = 0


def test_an_outline_spans_the_plan_instead_of_the_cells():
    """It is where settlements are the largest, and all else stays as it is."""
    basis, angle = DualMesh.from_mesh(disc(2)).basis(), np.linspace(0, 2 * np.pi, 400)
    rim = 0.9 * np.stack([np.cos(angle), np.sin(angle)])
    inner, plain = RigidPunch(UNIT, basis, outline=rim), RigidPunch(UNIT, basis)
    rim[:] = 7.0
    load = {"force": 1.0, "at": (0.3, 0.0)}
    cases, others = inner.solve_many([load]), plain.solve_many([load])
    assert cases.settlement == others.settlement
    tilt = others.tilt[0, 0]
    assert cases.largest_settlement == pytest.approx(cases.settlement + 0.9 * tilt, rel=1e-4)
    assert pickle.loads(pickle.dumps(inner)).footprint.hull.max() == pytest.approx(0.9, rel=1e-4)
    assert replace(inner, edge="constant").footprint.hull.max() == pytest.approx(0.9, rel=1e-4)
    for wrong in [[0.0, 1.0]], np.zeros((2, 2)), "rim", 1e3 * inner.outline, inner.outline + 5.0:
        with pytest.raises((TypeError, ValueError), match="outline"):
            RigidPunch(UNIT, basis, outline=wrong)
    for wrong in [0.0, 1.0], np.zeros((3, 2)), "A":
        with pytest.raises((TypeError, ValueError), match="corners"):
            RigidPunch(UNIT, basis, corners=wrong)


@pytest.mark.parametrize("full", [False, True])
def test_stiffness_of_cells_that_resist_no_tilt(full):
    """One cell, or a row: what collocation tells, as with constant pressures."""
    row = MeshQuad.init_tensor(np.linspace(0.0, 5.0, 6), np.linspace(0.0, 1.0, 2))
    for mesh in (MeshQuad(), row):
        stiffness = RigidPunch(SOIL, CellBasis(mesh, ElementQuad0())).stiffness(full=full)
        assert np.isfinite(stiffness).all()
        assert stiffness[0, 0] > 0
