import pickle
from dataclasses import replace

import numpy as np
import pytest
from marks import slow
from plans import disc, rectangle, sin_graded
from skfem import CellBasis, ElementQuad0, MeshQuad, MeshTri

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Load,
    Paraboloid,
    PeriodicGround,
    Punches,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    load_path,
)
from skfem_dual.bodies.group_work import PositionsByWork
from skfem_dual.contact import loaded_cells
from skfem_dual.grids import generate
from skfem_dual.operators import resources
from skfem_dual.operators.influence_operator import InfluenceOperator
from skfem_dual.operators.symmetric_matrix import SymmetricMatrix
from skfem_dual.operators.symmetry import Symmetry

UNIT = HalfSpace(1.0, 0.0)


def punch(mesh, grid="dual", substrate=UNIT, **options):
    dual = DualMesh.from_mesh(mesh)
    return RigidPunch(
        substrate, dual.basis() if grid == "dual" else dual.primal_basis(), **options
    )


def pair(distance, mesh=None, **options):
    mesh = disc(3) if mesh is None else mesh
    return RigidPunches(
        [
            punch(mesh.translated((x, 0.0)), origin=(x, 0.0), **options)
            for x in (-distance / 2, distance / 2)
        ]
    )


CENTRAL = [{"force": 1.0}, {"force": 1.0}]


def test_far_punches_settle_as_one_alone():
    """The other is a point force: settlement P / (pi E* d)."""
    alone = punch(disc(3)).solve(1.0).settlement
    for distance in (100.0, 10000.0):
        found = pair(distance).solve(CENTRAL)
        for s in found.solutions:
            expected = alone + 1 / (np.pi * distance)
            assert s.settlement == pytest.approx(expected, rel=1e-5)
        assert found[0].pressure == pytest.approx(found[1].pressure, rel=1e-2)
    assert pair(10000.0).interaction_factors(CENTRAL) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(("ground", "distance"), [("layer", 30.0), ("homogeneous", 1000.0)])
def test_a_body_without_load_far_from_the_others(ground, distance):
    """Its pressures are so small that rounding of the others' is large beside them."""
    layer = LayeredHalfSpace([Layer(0.8, 1.0, 0.45)], "bonded")
    soil = layer if ground == "layer" else HalfSpace(1.0, 0.25)
    at = [(0.0, 0.0), (distance, 0.0)]
    bodies = [
        RigidPunch(soil, DualMesh.from_mesh(generate.disc(n=100, centre=x)).basis(), origin=x)
        for x in at
    ]
    load = {"force": 1.0} if ground == "layer" else {"force": 0.0, "moments": (-1.0, 0.0)}
    found = RigidPunches(bodies).solve([load, {"force": 0.0}], unilateral=False)
    assert found.success, found.message
    alone = bodies[0].solve(**load, unilateral=False)
    assert found[0].settlement == pytest.approx(alone.settlement, rel=1e-6, abs=1e-9)
    assert np.abs(found[1].resultant_residual).max() < 1e-13


def test_reciprocity():
    """Maxwell and Betti: the force on a fixed punch by a moved one, either way."""
    group = RigidPunches(
        [punch(disc(4)), punch(rectangle(8, 0.5, 1.0).translated((2.0, 0.3)), origin=(2.0, 0.3))]
    )
    still, moved = Load(settlement=0.0, tilt=(0, 0)), Load(settlement=1.0, tilt=(0, 0))
    one = group.solve([moved, still], unilateral=False)
    two = group.solve([still, moved], unilateral=False)
    assert one[1].force == pytest.approx(two[0].force, rel=1e-3)
    assert one[1].force < 0


def test_neighbours_lean_towards_each_other():
    found = pair(2.5).solve(CENTRAL)
    left, right = found.solutions
    assert left.tilt[0] == pytest.approx(-right.tilt[0], rel=1e-6)
    assert left.tilt[0] > 0
    assert left.settlement == pytest.approx(right.settlement)
    for s in found.solutions:
        assert s.resultant == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
        assert np.abs(s.resultant_residual).max() < 1e-12
        x = s.punch.collocation_points
        assert s.displacement(x) == pytest.approx(
            s.punch_displacement(x, collocated=True), rel=1e-9
        )
    assert found.force == pytest.approx([1.0, 1.0])
    beside = np.array([[0.0], [0.0]])
    assert found.ground_displacement(beside) == pytest.approx(right.displacement(beside))
    factors = [pair(d).interaction_factors(CENTRAL)[0] for d in (2.5, 3.0, 5.0)]
    assert factors[0] > factors[1] > factors[2] > 1


@pytest.mark.parametrize("grid", ["dual", "triangles"])
def test_touching_halves_joined_rigidly_settle_as_the_whole(grid):
    mesh = MeshTri.init_tensor(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.with_subdomains(
        {"left": np.nonzero(middle[0] < 0)[0], "right": np.nonzero(middle[0] > 0)[0]}
    )
    whole = punch(mesh, "dual" if grid == "dual" else "primal")
    halves = RigidPunches.from_subdomains(UNIT, mesh, grid=grid, joined=[(0, 1)])
    assert halves.bodies == ((0, 1),)
    assert halves.punches[0].origin == pytest.approx((-0.5, 0.0))
    for at in ((0.1, 0.05), (0.55, 0.1)):  # full contact, and lifting off
        one = whole.solve(1.0, at)
        found = halves.solve([{"force": 1.0, "at": (at[0] + 0.5, at[1])}])
        assert found.force == pytest.approx([1.0])
        for s in found.solutions:
            assert s.tilt == pytest.approx(one.tilt, rel=2e-3)
            assert s.punch_displacement([[0.0], [0.0]]) == pytest.approx(one.settlement, rel=1e-3)
        assert sum(s.contact_area for s in found.solutions) == pytest.approx(
            one.contact_area, rel=2e-2
        )


def test_separate_halves_are_not_the_whole():
    """Each tilts by itself."""
    half = rectangle(4, 0.5, 1.0)
    group = RigidPunches([punch(half.translated((x, 0.0)), origin=(x, 0.0)) for x in (-0.5, 0.5)])
    found = group.solve([{"force": 1.0}, {"force": 1.0}])
    assert found[0].tilt[0] > 0.05
    assert found[1].tilt[0] < -0.05


def test_one_lifts_off_the_other_does_not():
    group = pair(2.5)
    found = group.solve([{"force": 1.0, "at": (-0.5, 0.0)}, {"force": 2.0}])
    assert found.success
    assert found.iterations > 0
    assert found[0].contact_area < 0.9 * np.pi
    assert found[1].contact_area == pytest.approx(np.pi)
    for s in found.solutions:
        assert s.complementarity_residual < 1e-10
    other = group.solve([{"force": 1.0, "at": (-0.5, 0.0)}, {"force": 2.0}], method="cg")
    assert other[0].pressure == pytest.approx(found[0].pressure, abs=1e-8)
    again = group.solve([{"force": 1.0, "at": (-0.52, 0.0)}, {"force": 2.0}], start=found)
    assert again.success
    loads = [{"force": 1.0}, {"force": 2.0}]
    together = group.interaction_factors(loads)
    assert group.interaction_factors(loads, start=found) == pytest.approx(together, rel=1e-9)
    with pytest.raises(ValueError, match="a solution of 1 punches for start, got one of 2"):
        RigidPunches(group.punches[:1]).solve(loads[:1], start=found)
    with pytest.raises(TypeError, match="True or False for progress"):
        group.solve(loads, progress="no")
    text = repr(found)
    assert "punch" in text
    assert len(text.splitlines()) == 4


def test_shapes_and_grounds():
    ground = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)
    group = RigidPunches(
        [
            punch(disc(2), substrate=ground),
            punch(
                disc(2).translated((3.0, 0.0)),
                "primal",
                ground,
                origin=(3.0, 0.0),
                gap=Paraboloid(2.0, (3.0, 0.0)),
            ),
        ]
    )
    found = group.solve([{"force": 1.0}, {"force": 0.2}])
    assert found[1].contact_area < 0.9 * np.pi
    assert "substrate" in repr(group).lower()


def test_matrices_are_not_pickled():
    group = pair(3.0)
    found = group.solve(CENTRAL)
    assert not {"system", "_centres"} & set(group.__getstate__())
    again = pickle.loads(pickle.dumps(found))
    assert again[0].pressure == pytest.approx(found[0].pressure)
    assert again.punches.solve(CENTRAL)[1].settlement == found[1].settlement


@pytest.mark.parametrize("n", [400, *slow(2500)])
def test_many_cells_are_one_operator(n, monkeypatch, capsys):
    """As the dense matrix answers, in full contact and lifting off, with both kinds of edges."""
    monkeypatch.setattr(loaded_cells, "DENSE", 50)
    mesh = generate.disc(n=n)
    punches = [
        punch(mesh.translated((-1.2, 0.0)), origin=(-1.2, 0.0)),
        punch(sin_graded(mesh).translated((1.2, 0.0)), origin=(1.2, 0.0), edge="constant"),
    ]
    many = RigidPunches(punches)
    assert isinstance(many.operator, InfluenceOperator)
    loads = [{"force": 1.0, "at": (-0.5, 0.1)}, {"force": 2.0}]
    answers = many.solve(loads, progress=True), many.solve(loads, unilateral=False)
    assert "GMRES" in capsys.readouterr().err
    assert answers[0][0].contact_area < 0.9 * np.pi
    monkeypatch.setattr(loaded_cells, "DENSE", 10**4)
    dense = RigidPunches(punches)
    assert isinstance(dense.operator, np.ndarray)
    expected = dense.solve(loads), dense.solve(loads, unilateral=False)
    for one, other in zip(answers, expected):
        assert one.success
        for found, true in zip(one.solutions, other.solutions):
            settlement = true.collocated_settlement
            assert found.collocated_settlement == pytest.approx(settlement, rel=3e-6)
            tilt = true.collocated_tilt
            assert found.collocated_tilt == pytest.approx(tilt, rel=1e-5, abs=1e-5 * settlement)
            size = np.abs(true.pressure).max()
            assert found.pressure == pytest.approx(true.pressure, abs=1e-3 * size)
            assert found.resultant_residual == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("substrate", [UNIT, LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")])
def test_union_of_cells_has_the_matrix_of_its_parts(substrate):
    """Also for punches that touch, with an edge on part of their boundary or none."""
    mesh = rectangle(4, 1.0, 1.0)
    group = RigidPunches(
        [
            punch(mesh, substrate=substrate),
            punch(disc(1).translated((0.0, 4.0)), "primal", substrate, edge="constant"),
            punch(mesh.translated((2.0, 0.0)), substrate=substrate),
        ],
        joined=[(0, 2)],
    )
    x = group.cells.collocation_points
    parts = np.hstack([p.influence(x) for p in group.members])
    assert group.cells.influence(x) == pytest.approx(parts, rel=1e-12)
    assert group.cells.operator(1e-6) == pytest.approx(parts, rel=1e-4, abs=1e-6 * parts.max())


def test_accuracy_and_symmetry_of_the_punches():
    """The least of the tolerances if all have one; mirror lines of the arrangement."""
    loads = [{"force": 1.0, "at": (0.2, 0.1)}, {"force": 2.0}]
    of = pair(2.5, disc(2))
    exact = of.solve(loads)
    some = RigidPunches([punch(disc(2), rtol=1e-3), punch(disc(2).translated((3.0, 0.0)))])
    assert some.cells.influence(some.cells.collocation_points) == pytest.approx(some.operator)
    for rtol in (1e-3, 1e-7):
        given = pair(2.5, disc(2), rtol=rtol)
        found = given.solve(loads)
        assert np.abs(given.operator / of.operator - 1).max() > 1e-12
        assert found[0].settlement == pytest.approx(exact[0].settlement, rel=rtol)
    symmetric = pair(2.5, disc(2), symmetry="auto")
    assert isinstance(symmetric.operator, SymmetricMatrix)
    assert symmetric.operator.symmetry.name == "C2v"
    found = symmetric.solve(loads)
    for one, other in zip(found.solutions, exact.solutions):
        assert one.pressure == pytest.approx(other.pressure, rel=1e-9)


def test_too_little_memory(monkeypatch):
    monkeypatch.setattr(resources, "available_memory", lambda: 1e6)
    with pytest.raises(MemoryError, match=r"0\.9537 MiB.*290 cells.*Remedy"):
        pair(3.0).solve(CENTRAL)


@pytest.mark.parametrize("gap_rtol", [0, 1, 10, -1e-6, np.nan])
def test_bad_accuracy_of_the_gaps(gap_rtol):
    with pytest.raises(ValueError, match="gap_rtol"):
        pair(3.0).solve(CENTRAL, gap_rtol=gap_rtol)


def test_bad_groups():
    with pytest.raises(TypeError, match="expected some RigidPunch, got none"):
        RigidPunches([])
    with pytest.raises(TypeError, match="got 1"):
        RigidPunches([1])
    with pytest.raises(ValueError, match="overlap, got punches 0, 1"):
        pair(1.0)
    with pytest.raises(ValueError, match="on one substrate"):
        RigidPunches(
            [punch(disc(1)), punch(disc(1).translated((3.0, 0)), substrate=HalfSpace(2.0, 0.0))]
        )
    square = CellBasis(MeshQuad().refined(2), ElementQuad0())
    waves = PeriodicGround(HalfSpace(1.0, 0.3), (1.0, 1.0))
    wavy = RigidPunch(waves, square, gap=lambda x: 0.01 * np.cos(2 * np.pi * x[0]))
    with pytest.raises(ValueError, match=r"without a period, .* one RigidPunch on all cells"):
        RigidPunches([wavy])
    for joined in ([(0, 1), (1, 0)], [(0, 2)]):
        with pytest.raises(ValueError, match="numbers of punches from 0 to 1, each once"):
            RigidPunches(pair(3.0).punches, joined)
    for names in (["left"], ["left", "left"]):
        with pytest.raises(ValueError, match="expected 2 names that differ"):
            RigidPunches(pair(3.0).punches, names=names)
    inside = [punch(disc(1)), punch(disc(1).scaled(0.3))]
    for pair_ in (inside, inside[::-1]):
        with pytest.raises(ValueError, match="overlap, got punches 0, 1"):
            RigidPunches(pair_)
    with pytest.raises(ValueError, match=r"positive semidefinite, got negative .* rows 0, 1, 2"):
        RigidPunches(pair(3.0).punches, stiffness=-np.eye(6))
    with pytest.raises(ValueError, match="got punches left, right that do"):
        RigidPunches([punch(disc(1))] * 2, names=["left", "right"])
    with pytest.raises(ValueError, match=r"without\. Remedy: mesh\.with_subdomains"):
        RigidPunches.from_subdomains(UNIT, disc(1))
    mesh = disc(1).with_subdomains({"all": np.arange(4)})
    for names, told in (["some"], r"\['some'\]"), ([], "none"):
        with pytest.raises(ValueError, match=rf"subdomains of the mesh, \['all'\], got {told}"):
            RigidPunches.from_subdomains(UNIT, mesh, names)
    empty = disc(1).with_subdomains({"all": np.arange(4), "none": np.empty(0, int)})
    with pytest.raises(ValueError, match=r"elements in each subdomain, got none in \['none'\]"):
        RigidPunches.from_subdomains(UNIT, empty)
    with pytest.raises(ValueError, match='"dual" or "triangles"'):
        RigidPunches.from_subdomains(UNIT, mesh, grid="primal")


@pytest.mark.parametrize(
    ("loads", "message"),
    [
        ([{"force": 1.0}], "one load for each of the 2 bodies, got 1"),
        ([{"force": 1.0}, {"force": 0.0}], "body 1: expected a positive force"),
        ([{"force": 1.0, "at": (2.0, 0.0)}, {"force": 1.0}], "body 0: expected a resultant"),
    ],
)
def test_bad_loads(loads, message):
    with pytest.raises(ValueError, match=message):
        pair(3.0).solve(loads)


def test_solutions_by_name():
    found = RigidPunches(pair(3.0).punches, names=["left", "right"]).solve([{"force": 1.0}] * 2)
    assert found["right"] is found[1]
    with pytest.raises(KeyError, match=r"expected the name of a punch, .* got 'east'"):
        found["east"]
    with pytest.raises(IndexError, match=r"expected a punch from 0 to 1, got 5"):
        found[5]
    assert len(found[0:2]) == len(list(found)) == 2


def test_errors_name_bodies():
    three = [punch(disc(1).translated((x, 0)), origin=(x, 0)) for x in (-3.0, 0.0, 3.0)]
    group = RigidPunches(three, joined=[(0, 2)], names=["left", "middle", "right"])
    with pytest.raises(ValueError, match=r"body middle: expected a positive force"):
        group.solve([{"force": 1.0}, {"force": 0.0}])
    with pytest.raises(ValueError, match=r"body left\+right: expected a positive force"):
        group.solve([{"force": 0.0}, {"force": 1.0}])


def column(p, q, stiffness, m):
    """Frame on m footings: a spring that resists their difference in settlement."""
    ends = np.zeros(3 * m)
    ends[3 * p], ends[3 * q] = 1.0, -1.0
    return stiffness * np.outer(ends, ends)


def framed(stiffness, m=2, **options):
    places = 2.5 * (np.arange(m) - (m - 1) / 2)
    return RigidPunches(
        [punch(disc(2).translated((x, 0.0)), origin=(x, 0.3), **options) for x in places],
        stiffness=stiffness,
    )


FRAMED = [{"force": 2.0, "at": (0.0, -0.3)}, {"force": 1.0, "at": (0.0, -0.3)}]


def test_frame_without_stiffness_is_none():
    alone, frame = framed(None).solve(FRAMED), framed(np.zeros((6, 6))).solve(FRAMED)
    for s, t in zip(alone.solutions, frame.solutions, strict=True):
        assert t.pressure == pytest.approx(s.pressure, rel=1e-9)
        assert [t.settlement, *t.tilt] == pytest.approx([s.settlement, *s.tilt], abs=1e-9)
    assert (alone.frame_forces == 0).all()
    assert (frame.frame_forces == 0).all()


def test_bodies_that_no_frame_holds_keep_their_loads():
    """Their balance was never looked at, as if the frame took a part."""
    mesh, frame = disc(2), np.zeros((9, 9))
    frame[:6, :6] = 0.1 * np.kron([[1, -1], [-1, 1]], np.eye(3))
    pads = [punch(mesh.translated((3.0 * i, 0.0)), origin=(3.0 * i, 0.0)) for i in range(3)]
    loads = [{"force": 1.0}, {"force": 2.0}, {"force": 1.0, "at": (0.2, 0.0)}]
    found = RigidPunches(pads, stiffness=frame).solve(loads)
    assert found[2].load.force == 1.0
    assert found[2].centre_of_pressure == pytest.approx([0.2, 0.0], abs=1e-9)
    assert found[0].load.force is None
    assert (found.frame_forces[2] == 0).all()
    assert found.frame_forces[0] == pytest.approx(-found.frame_forces[1], abs=1e-9)


@pytest.mark.parametrize("stiff", [1.0, 1e7])
def test_frames_are_the_same_in_any_unit_of_length(stiff):
    """Far from a metre they were no success, and without the positions by work."""
    ways = [[1.0, 1.5, 0.0, -1.0, 1.5, 0.0], [0, 1, 0, 0, -1, 0], [0, 0, 1, 0, 0, -1]]
    frame = stiff * sum(k * np.outer(w, w) for k, w in zip((3.0, 5.0, 1.0), ways, strict=True))

    def moved(length):
        def footing(x):
            mesh = disc(2).translated((x, 0.0)).scaled(length)
            return punch(mesh, origin=((x + 0.3) * length, 0.2 * length))

        units = np.diag([1.0, length, length] * 2)
        K = length * units @ frame @ units
        loads = (
            {"force": length**2, "at": (-0.2 * length, 0.1 * length)},
            {"force": 2 * length**2, "moments": (0.5 * length**3, 0.0)},
        )
        footings = [footing(x) for x in (-1.5, 1.5)]
        found = RigidPunches(footings, stiffness=K).solve(loads)
        assert found.success
        return [[s.settlement / length, *s.tilt] for s in found.solutions]

    expected = moved(1.0)
    for length in (1e-9, 1e-6, 1e-3, 1e8, 1e9):
        assert moved(length) == pytest.approx(np.array(expected), rel=1e-6)


@pytest.mark.parametrize("unilateral", [True, False])
def test_frame_and_ground_together_balance_the_loads(unilateral):
    """Any positive stiffness, loads that lift a footing in part."""
    root = np.random.default_rng(0).standard_normal((6, 6))
    K = root @ root.T / 50
    for loads in (FRAMED, [{"force": 2.0, "at": (0.6, 0.1)}, {"force": 0.2}]):
        found = framed(K).solve(loads, unilateral=unilateral)
        assert found.success
        y = np.concatenate([[s.settlement, *s.tilt] for s in found.solutions])
        given = [
            [load["force"], *(load["force"] * np.array(load.get("at", (0, 0))))] for load in loads
        ]
        resultants = np.array([s.resultant for s in found.solutions])
        assert resultants + (K @ y).reshape(2, 3) == pytest.approx(np.array(given), abs=1e-10)
        assert found.frame_forces == pytest.approx(np.array(given) - resultants, abs=1e-10)
        for s in found.solutions:
            x = s.punch.collocation_points[:, s.pressure > 0]
            assert s.displacement(x) == pytest.approx(
                s.punch_displacement(x, collocated=True), abs=1e-8
            )
            assert s.complementarity_residual < 1e-9 or not unilateral


@pytest.mark.parametrize("at", [(0.1, 0.2), (0.5, -0.2)])
def test_positions_found_under_loads_impose_these(at):
    """Of all bodies or of one, its settlement alone or its tilts too, by solve_many as well."""
    loads = [{"force": 2.0, "at": at}, {"force": 1.5, "at": (0.1, 0.0)}]
    group = pair(2.5)
    found = group.solve(loads)
    assert (len(found[0].contact) < len(found[0].pressure)) == (at[0] > 0.4)
    placed = [Load(settlement=s.settlement, tilt=tuple(s.tilt)) for s in found.solutions]
    pushed = {"settlement": found[0].settlement, "at": at}
    cases = placed, [placed[0], loads[1]], [pushed, loads[1]]
    answers = [group.solve(case).solutions for case in cases]
    for solutions in (*answers, *zip(*group.solve_many(cases), strict=True)):
        for s, t in zip(found.solutions, solutions, strict=True):
            assert t.resultant == pytest.approx(s.resultant, abs=2e-5)
            assert t.positions[0] == pytest.approx(s.positions[0], abs=1e-6)
            if at[0] < 0.4:
                assert t.resultant == pytest.approx(s.resultant, abs=1e-12)


@pytest.mark.parametrize("method", ["auto", "cg"])
def test_reactions_beside_imposed_settlements_are_found_in_groups(method):
    """Of two bodies of three: the forces are those under which the settlements were found."""
    group = RigidPunches(
        [punch(disc(2).translated((x, 0.0)), origin=(x, 0.0)) for x in (-2.5, 0.0, 2.5)]
    )
    at = [(0.3, 0.1), (0.1, -0.4), (-0.2, 0.3)]
    found = group.solve([Load(force=f, at=a) for f, a in zip((1.0, 2.0, 1.5), at)])
    pushed = [Load(settlement=s.settlement, at=a) for s, a in zip(found.solutions, at)]
    again = group.solve([pushed[0], Load(force=2.0, at=at[1]), pushed[2]], method=method)
    assert again.success
    for s, t in zip(found.solutions, again.solutions, strict=True):
        assert t.resultant == pytest.approx(s.resultant, abs=1e-6)
        assert t.settlement == pytest.approx(s.settlement, rel=1e-6)


@pytest.mark.parametrize("method", ["auto", "cg"])
def test_settlements_that_no_force_causes_are_told(method):
    """The neighbour settles it farther, and does not pull."""
    load = [Load(force=5.0), Load(settlement=0.1, at=(0.3, 0.2))]
    with pytest.warns(ConvergenceWarning, match="no force was found"):
        assert not pair(2.2, disc(2)).solve(load, method=method).success


def test_under_a_frame_no_body_is_alone():
    with pytest.raises(ValueError, match="without a frame"):
        framed(np.zeros((6, 6))).interaction_factors(FRAMED)


def test_frame_stays_where_lines_of_contact_have_their_law():
    """Two spheres, a spring k between their settlements: each bears its load less that of it."""
    k = 0.3
    spheres = [
        punch(disc(3).translated((x, 0.0)), origin=(x, 0.0), gap=Paraboloid(2.0, (x, 0.0)))
        for x in (-1.25, 1.25)
    ]
    found = RigidPunches(spheres, stiffness=column(0, 1, k, 2)).solve(
        [{"force": 0.3}, {"force": 0.2}]
    )
    left, right = found.solutions
    assert found.success
    assert left.line is not None
    taken = k * (left.settlement - right.settlement)
    assert taken > 0.01
    assert found.force == pytest.approx([0.3 - taken, 0.2 + taken], abs=1e-10)


def test_stiff_frame_joins():
    """A frame too stiff to bend is the joined body."""
    # of the plane through all: from positions to what is left of them
    levers = np.array([[1, -1.25, 0], [0, 1, 0], [0, 0, 1], [1, 1.25, 0], [0, 1, 0], [0, 0, 1]])
    rigid, _ = np.linalg.qr(levers)
    K = 1e8 * (np.eye(6) - rigid @ rigid.T)
    bodies = framed(None).punches
    joined = RigidPunches(bodies, joined=[(0, 1)])
    force, x = 3.0, 0.2  # of the middle
    frame = framed(K).solve([{"force": force, "at": (x + 1.25, -0.3)}, {"force": 0.0}])
    one = joined.solve([{"force": force, "at": (x + 1.25, -0.3)}])
    for s, t in zip(frame.solutions, one.solutions, strict=True):
        # what each bears is by work under a frame, in one body by collocation; positions by work
        # on each alone, and on both as one, are alike up to products of errors
        assert s.pressure == pytest.approx(t.pressure, rel=4e-3)
        assert s.force == pytest.approx(t.force, rel=2e-4)
        assert s.tilt == pytest.approx(t.tilt, abs=1e-6)
        assert s.settlement == pytest.approx(t.settlement, rel=2e-6)


@pytest.mark.parametrize("link", [1e9, 1e11])
def test_pile_beside_a_stiff_frame(link):
    """It is as stiff as the ground, and was taken for rounding of the link."""
    pile = np.zeros((6, 6))
    pile[3, 3] = 1.0
    found = framed(column(0, 1, link, 2) + pile).solve(FRAMED, unilateral=False)
    assert found.success
    forces = [s.force for s in found.solutions]
    assert sum(forces) + found.solutions[1].settlement == pytest.approx(3.0, rel=1e-5)
    least = framed(column(0, 1, 1e6, 2) + pile).solve(FRAMED, unilateral=False)
    assert forces == pytest.approx([s.force for s in least.solutions], rel=1e-4)


def test_springs_lost_beside_a_frame_are_no_success():
    pile = np.zeros((6, 6))
    pile[3, 3] = 1.0
    with pytest.warns(ConvergenceWarning, match="forces on bodies and frame are off by"):
        found = framed(column(0, 1, 1e14, 2) + pile).solve(FRAMED, unilateral=False)
    assert not found.success


def test_frame_takes_from_the_loaded_one():
    """By hand: two equal footings far apart, a spring k between their settlements."""
    far = 1e3
    bodies = [punch(disc(2).translated((x, 0.0)), origin=(x, 0.0)) for x in (0.0, far)]
    c = 1 / (bodies[0].solve(1.0).settlement - 1 / (np.pi * far))
    k = 0.7
    found = RigidPunches(bodies, stiffness=column(0, 1, k, 2)).solve(
        [{"force": 1.0}, {"force": 0.0}]
    )
    difference = 1 / (c + 2 * k)
    assert found.force == pytest.approx([1 - k * difference, k * difference], rel=1e-6)
    assert found.frame_forces[:, 0] == pytest.approx([k * difference, -k * difference], rel=1e-6)


def test_imposed_settlement_under_a_frame():
    found = framed(column(0, 1, 0.5, 2)).solve(
        [{"settlement": 1.0, "tilt": (0, 0)}, {"force": 0.5}]
    )
    left, right = found.solutions
    assert left.settlement == pytest.approx(1.0)
    assert left.tilt == pytest.approx([0, 0])
    taken = 0.5 * (right.settlement - left.settlement)
    assert right.force + taken == pytest.approx(0.5, abs=1e-10)
    # with nothing left to move the frame bears what its stiffness says
    imposed = [{"settlement": w, "tilt": (0, 0)} for w in (1.0, 1.5)]
    held = framed(column(0, 1, 0.5, 2)).solve(imposed)
    assert held.success
    assert held.frame_forces[:, 0] == pytest.approx([-0.25, 0.25])


def test_frame_without_a_matrix(monkeypatch):
    K = column(0, 1, 0.5, 2)
    dense = framed(K).solve(FRAMED)
    fast = framed(K, rtol=1e-8).solve(FRAMED)
    monkeypatch.setattr(loaded_cells, "DENSE", 10)
    free = framed(K, rtol=1e-8)
    assert isinstance(free.operator, InfluenceOperator)
    for found in (fast, free.solve(FRAMED), pickle.loads(pickle.dumps(free)).solve(FRAMED)):
        for s, t in zip(found.solutions, dense.solutions, strict=True):
            assert s.settlement == pytest.approx(t.settlement, rel=1e-6)


def test_frames_that_are_refused():
    with pytest.raises(ValueError, match=r"stiffness of shape \(6, 6\), got \(3, 3\)"):
        framed(np.eye(3))
    with pytest.raises(ValueError, match=r"symmetric stiffness, got K\["):
        framed(np.eye(6) + np.eye(6, k=1))
    with pytest.raises(ValueError, match="positive"):
        framed(-np.eye(6))
    with pytest.raises(ValueError, match="negative energy"):
        framed(np.eye(6) + 2 * (np.eye(6, k=1) + np.eye(6, k=-1)))
    with pytest.raises(TypeError, match="stiffness as an array of numbers"):
        framed("stiff")
    frame = framed(column(0, 1, 1.0, 2))
    with pytest.raises(ValueError, match="balance without tension"):
        frame.solve([{"force": -2.0}, {"force": 1.0}])
    with pytest.raises(ValueError, match="imposed where their reactions act"):
        frame.solve([{"settlement": 1.0, "at": (0.2, 0.0)}, {"force": 1.0}])


@pytest.mark.filterwarnings("ignore::skfem_dual.ResolutionWarning")
def test_a_body_on_a_few_cells_and_one_on_all():
    """The few do not spoil the other: its settlement is that of four times as many cells."""
    loads = [{"force": 1.0, "at": (-0.8, 0.0)}, {"force": 1.0}]
    few, many = (pair(3.0, disc(n)).solve(loads) for n in (2, 3))
    assert few[1].settlement == pytest.approx(many[1].settlement, rel=5e-4)
    assert few[0].settlement == pytest.approx(many[0].settlement, abs=0.06)


def test_a_body_that_its_neighbour_leaves_in_the_air():
    """Held higher than the ground settles beside the other: no contact, and nothing is lost."""
    both = pair(2.5)
    found = both.solve([{"force": 1.0, "at": (-0.2, 0.0)}, {"settlement": 0.01}])
    assert found.success
    assert found[1].contact_area == 0.0
    assert found[1].settlement == pytest.approx(0.01, rel=1e-14)
    alone = both.punches[0].solve(1.0, at=(-0.2, 0.0))
    assert found[0].settlement == pytest.approx(alone.settlement, rel=1e-3)
    assert found[0].collocated_settlement == pytest.approx(alone.collocated_settlement, rel=1e-12)


@pytest.mark.parametrize("unilateral", [True, False])
def test_frames_of_any_stiffness(unilateral):
    """Far stiffer than the ground they join the bodies: forces are not what rounding leaves."""
    link = np.zeros((6, 6))
    link[[0, 3], [0, 3]], link[[0, 3], [3, 0]] = 1.0, -1.0
    loads = [{"force": 1.0}, {"force": 2.0}]
    found = []
    for stiffness in 1e4, 1e8, 1e14, 1e18:
        framed = RigidPunches(pair(3.0).punches, stiffness=stiffness * link)
        solution = framed.solve(loads, unilateral=unilateral)
        assert solution.success
        assert sum(each.force for each in solution) == pytest.approx(3.0, rel=1e-11)
        found.append([each.settlement for each in solution])
    assert found[0] == pytest.approx(found[-1], rel=1e-4)
    for each in found[1:3]:
        assert each == pytest.approx(found[-1], rel=1e-8)
    assert found[-1][0] == pytest.approx(found[-1][1], rel=1e-12)


def small_beside_large(distance, names=()):
    """A disc of radius 0.04 beside a disc of radius 1 with 60 cells."""
    large = punch(generate.disc(n=60))
    x = large.partition.polygons.p[0].max() + distance + 0.04
    small = punch(disc(3).scaled(0.04).translated((x, 0.0)), origin=(x, 0.0))
    return RigidPunches([large, small], names=names)


@pytest.mark.parametrize("solve", ["solve", "solve_many"])
def test_far_larger_cells_beside_a_small_body_are_told(solve):
    loads = [{"force": 1.0}, {"force": 1e-3}]
    loads = loads if solve == "solve" else [loads]
    with pytest.warns(ResolutionWarning, match=r"cells of punch raft beside punch pad .* 3\."):
        getattr(small_beside_large(0.02, ("raft", "pad")), solve)(loads)
    with pytest.warns(ResolutionWarning, match=r"cells of punch 0 beside punch 1 are"):
        Punches(small_beside_large(0.02).punches).solve([{"force": 1.0}, {"force": 1e-3}])
    getattr(small_beside_large(0.1), solve)(loads)


def beside(radius, x):
    """A disc with its centre at (x, 0)."""
    return punch(disc(2).scaled(radius).translated((x, 0.0)), origin=(x, 0.0))


def test_a_ring_around_another_body_is_not_taken_for_a_small_one():
    """Its centre is beside the other body, its cells are not."""
    inner, ring = beside(0.2, 0.21), punch(generate.annulus(0.5, n=200))
    found = RigidPunches([inner, ring]).solve([{"force": 1.0}, {"force": 2.0}])
    assert found.success
    with pytest.warns(ResolutionWarning, match=r"cells of punch 1 beside punch 0 are"):
        RigidPunches([beside(0.01, 0.485), ring]).solve([{"force": 0.1}, {"force": 2.0}])


def test_messages_of_cases_are_those_of_their_punch():
    """That of all was told of each: contact on 66 of 122 cells of one in full contact."""
    group, case = pair(3.0), [{"force": 1.0, "at": (0.9, 0.0)}, {"force": 1.0}]
    with pytest.warns(ConvergenceWarning, match="1 of 2 load cases without a solution"):
        first, second = group.solve_many([case, [{"force": -1.0}, {"force": 1.0}]])
    alone = group.solve(case)
    assert first.messages[0] == alone[0].message != second.messages[0]
    assert second.messages[0] == alone[1].message == "full contact"
    assert first.messages[1] == second.messages[1]
    assert "expected" in first.messages[1]


def test_messages():
    """Those of all, each once; of a path one for each load."""
    group = pair(3.0)
    both = group.solve([{"force": 1.0}, {"force": 1.0}])
    assert both.success
    assert both.message == both[0].message
    path = load_path(punch(disc(2)), [{"force": 1.0}, {"force": 2.0}])
    assert path.messages == tuple(s.message for s in path.solutions)
    assert "LoadPath object" in repr(path)


def test_joined_with_their_centre_on_the_edge_between_them():
    halves = [
        RigidPunch(HalfSpace(1.0, 0.0), DualMesh.from_mesh(MeshTri.init_tensor(x, y)).basis())
        for x, y in (
            (np.linspace(-1, 0, 9), np.linspace(-1, 1, 9)),
            (np.linspace(0, 1, 9), np.linspace(-1, 1, 9)),
        )
    ]
    found = RigidPunches(halves, joined=[(0, 1)]).solve([{"force": 1.0}])
    assert np.all(found.success)


def test_shaped_halves_joined_rigidly_settle_as_the_whole():
    """Contact of a sphere on 45 and 73 cells is one: its line has a law, as under the whole."""
    radius, a, c, at = 2.0, 0.45, np.array([0.1, 0.05]), np.array([0.02, 0.1])
    force, gap = 4 / 3 * a**3 / radius, Paraboloid(radius=radius, centre=tuple(c))
    mesh = MeshTri.init_tensor(np.linspace(-1, 1, 25), np.linspace(-0.7, 0.7, 17))
    left = mesh.p[0, mesh.t].mean(axis=0) < 0
    meshes = [mesh.restrict(np.nonzero(own)[0]) for own in (left, ~left)]
    found = RigidPunches([punch(m, gap=gap) for m in meshes], joined=[(0, 1)]).solve(
        [{"force": force, "at": tuple(at)}]
    )
    assert all(solution.line is not None for solution in found.solutions)
    tilt = (at - c) / radius
    settlement = a**2 / radius - c @ tilt - radius * (tilt @ tilt) / 2
    assert found[0].settlement == pytest.approx(settlement, rel=4e-4)
    assert found[0].tilt == pytest.approx(tilt, abs=4e-3 * np.abs(tilt).max())
    # two feet with as many cells in contact are not one
    feet = [
        punch(mesh.restrict(np.nonzero(left)[0]).translated((x, 0.0)), gap=Paraboloid(1.0, (y, 0)))
        for x, y in ((0.5, 0.0), (4.5, 4.0))
    ]
    alone = RigidPunches(feet, joined=[(0, 1)]).solve([{"settlement": 0.08, "tilt": (0, 0)}])
    assert all(30 < (solution.pressure > 0).sum() < 60 for solution in alone.solutions)
    assert all(solution.line is None for solution in alone.solutions)


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize(
    ("shift", "digits"), [((-3.0, 0.0), 1e-13), ((1.0, 0.5), 1e-13), ((1e5, -3e4), 1e-6)]
)
def test_origins_do_not_decide_under_a_frame(shift, digits, unilateral):
    """A beam on two feet, one of which lifts off; its stiffness is changed exactly."""
    span, bending = 6.0, 2e4
    beam = np.array(
        [
            [12, 6 * span, -12, 6 * span],
            [6 * span, 4 * span**2, -6 * span, 2 * span**2],
            [-12, -6 * span, 12, -6 * span],
            [6 * span, 2 * span**2, -6 * span, 4 * span**2],
        ]
    )
    frame = np.zeros((6, 6))
    frame[np.ix_([0, 1, 3, 4], [0, 1, 3, 4])] = bending / span**3 * beam
    mesh, soil = rectangle(4, 1.0, 1.0), HalfSpace(30e3, 0.3)

    def positions(dx, dy):
        back = np.eye(6)
        back[0, 1:3] = back[3, 4:6] = -dx, -dy
        feet = [
            RigidPunch(
                soil, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x + dx, dy)
            )
            for x in (0.0, span)
        ]
        loads = [
            {"force": force, "at": (ex - dx, ey - dy)}
            for force, ex, ey in ((200.0, -0.5, 0.2), (400.0, 0.7, 0.1))
        ]
        found = RigidPunches(feet, stiffness=back.T @ frame @ back).solve(
            loads, unilateral=unilateral
        )
        assert sum(s.force for s in found.solutions) == pytest.approx(600.0, rel=1e-12)
        return back @ np.concatenate([[s.settlement, *s.tilt] for s in found.solutions])

    assert positions(*shift) == pytest.approx(positions(0.0, 0.0), rel=digits)


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("load", [{"force": 1e5}, {"settlement": 0.003}])
@pytest.mark.parametrize("off", [0.0, 1e-9, 1e-6, 0.08])
def test_springs_between_hinges_wherever_the_origins_are(off, load, unilateral):
    """Rows of zeros became rows of rounding: loads were refused, or their body turned over."""
    soil, mesh, spring = HalfSpace(30e6, 0.3), generate.rectangle(1.3, 0.7, n=40), 5e7
    frame = np.zeros((6, 6))
    frame[np.ix_([0, 3], [0, 3])] = spring * np.array([[1, -1], [-1, 1]])
    rng = np.random.default_rng(3)
    for a, b in rng.uniform(-5, 5, (3, 2, 2)) + np.array([[0.0, 0.0], [9.0, 9.0]]):
        feet = [
            RigidPunch(
                soil,
                DualMesh.from_mesh(mesh.translated(tuple(x))).basis(),
                origin=tuple(x + off * np.array([1.0, -0.4])),
            )
            for x in (a, b)
        ]
        s = RigidPunches(feet, stiffness=frame).solve(
            [load, {"force": 2e5}], unilateral=unilateral
        )
        assert s.success
        taken = spring * (s[1].settlement - s[0].settlement)
        assert s[1].force == pytest.approx(2e5 - taken, rel=1e-9)
        if "force" in load:
            assert s[0].force == pytest.approx(1e5 + taken, rel=1e-9)
        else:
            assert s[0].settlement == pytest.approx(0.003)


def test_what_joins_punches_does_not_change_them():
    """Variants of a group kept edges freed for another one, and numbers as names."""
    mesh = generate.rectangle(1.3, 1.0, n=50)
    given = [punch(mesh.translated((x, 0.0)), origin=(x, 0.0)) for x in (0.0, 1.3)]
    loads, apart = [{"force": 1.0}] * 2, RigidPunches(given)
    joined = RigidPunches(given, joined=[(0, 1)])
    assert joined.punches == tuple(given)
    assert len(joined.members[0].weights.ribs) < len(given[0].weights.ribs)
    again = replace(joined, joined=())
    assert again.members == apart.members
    assert again.solve(loads)[0].settlement == apart.solve(loads)[0].settlement
    third = punch(mesh.translated((5.0, 0.0)))
    for each in (apart, Punches(given)):
        assert replace(each, punches=[*given, third]).names == ("0", "1", "2")
    with pytest.raises(ValueError, match="expected 3 names that differ"):
        replace(replace(apart, names=("a", "b")), punches=[*given, third])


def test_contact_is_rough_under_bodies_not_under_parts_of_one():
    """Four cells of one half touch beside a hundred of the other."""
    mesh = generate.rectangle(4.0, 2.0, n=300)
    left = mesh.p[0, mesh.t].mean(axis=0) < 0
    halves = [punch(mesh.restrict(np.nonzero(own)[0])) for own in (left, ~left)]
    found = RigidPunches(halves, joined=[(0, 1)]).solve(
        [{"force": 1.0, "at": tuple(np.array([1.48, 0.2]) - halves[0].origin)}]
    )
    assert 0 < (found[0].pressure > 0).sum() < 12 < (found[1].pressure > 0).sum()


def test_no_factors_of_loads_that_settle_nothing():
    with pytest.raises(ValueError, match=r"loads that settle each body, got one .* on punch 0"):
        pair(4.0).interaction_factors([{"settlement": 0.0}, {"force": 1.0}])


def test_centres_are_read_only():
    """The equations refer to them."""
    for centre in pair(4.0).centres:
        with pytest.raises(ValueError, match="read-only"):
            centre += 1.0


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("across", [1e-16, 1e-12, 2e-8, 3e-8, -4.4e-8, 1e-6])
def test_beams_that_rounding_has_turned(across, unilateral):
    """Along y but for cos(pi / 2): what they resist of the other tilt is nothing beside the
    ground, and no hinge."""
    feet = [
        punch(generate.disc(n=60).translated((0.0, 5.0 * i)), origin=(0.0, 5.0 * i))
        for i in range(3)
    ]
    loads = [{"force": 500.0 + 300 * i, "at": (0.1, 0.05)} for i in range(3)]

    def solved(along):
        stiffness, span = np.zeros((9, 9)), 5.0
        shear = np.array([1, span / 2, -1, span / 2])
        ends = np.outer(shear, shear) * 12 / span**2
        ends[np.ix_([1, 3], [1, 3])] += np.array([[1, -1], [-1, 1]])
        for i in range(2):
            ways = np.zeros((4, 9))
            ways[0, 3 * i] = ways[2, 3 * i + 3] = 1.0
            ways[1, 3 * i + 1 : 3 * i + 3] = ways[3, 3 * i + 4 : 3 * i + 6] = along
            stiffness += ways.T @ ends @ ways
        return RigidPunches(feet, stiffness=stiffness).solve(loads, unilateral=unilateral)

    turned, straight = solved((across, 1.0)), solved((0.0, 1.0))
    assert turned.success
    for s, t in zip(turned, straight, strict=True):
        assert s.settlement == pytest.approx(t.settlement, rel=1e-10 + abs(across))
        assert s.tilt == pytest.approx(t.tilt, rel=1e-10 + 100 * abs(across))


def test_a_spring_that_is_nothing_beside_the_ground_is_a_hinge():
    stiff = framed(column(0, 1, 10.0, 2)).solve(FRAMED)
    soft = column(0, 1, 10.0, 2)
    soft[1, 1] = 1e-14
    found = framed(soft).solve(FRAMED)
    assert found.success
    for s, t in zip(found, stiff, strict=True):
        assert s.settlement == pytest.approx(t.settlement, rel=1e-10)


def test_many_that_lift_off_have_positions_by_work(monkeypatch):
    """Each by itself: 91 cells far from all others are nearer to the disc alone."""
    alone, load = punch(generate.disc(n=90)).solve(1.0, at=(0.0, 0.7)), {"force": 1.0}
    monkeypatch.setattr(
        PositionsByWork, "amid_many", lambda self, contact: not contact.touching.all()
    )
    far = [generate.disc(n=90).translated((1e4 * i, 0.0)) for i in range(2)]
    pair = RigidPunches([punch(mesh, origin=(1e4 * i, 0.0)) for i, mesh in enumerate(far)])
    found = pair.solve([load | {"at": (0.0, 0.7)}] * 2)
    for s in found:
        sunk, collocated, exact = (
            v[0] + 0.7 * v[2]
            for v in (
                (s.settlement, *s.tilt),
                (s.collocated_settlement, *s.collocated_tilt),
                (alone.settlement, *alone.tilt),
            )
        )
        exact += 1 / (np.pi * 1e4)  # by the other
        assert abs(sunk - exact) < 2e-5 < 1e-3 < abs(collocated - exact)
        assert abs(s.tilt[1] - alone.tilt[1]) < 0.7 * abs(s.collocated_tilt[1] - alone.tilt[1])
    held = pair.solve([{"settlement": s.settlement, "tilt": tuple(s.tilt)} for s in found])
    assert held.success
    for s, t in zip(held, found, strict=True):
        assert (s.settlement, *s.tilt) == pytest.approx((t.settlement, *t.tilt), abs=1e-9)
        assert s.resultant == pytest.approx(t.resultant, abs=1e-6)


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e9])
def test_frames_are_judged_by_themselves(size):
    """However soft they are beside the ground."""
    turned, negative = np.eye(6), np.eye(6)
    turned[0, 3], turned[3, 0] = -1.0, 1.0
    negative[[0, 3], [3, 0]] = 2.0
    with pytest.raises(ValueError, match="expected a symmetric stiffness"):
        framed(size * turned)
    with pytest.raises(ValueError, match="negative energy: -1"):
        framed(size * negative)


def test_joined_punches_among_many_have_positions_by_collocation(monkeypatch):
    """The others do not."""
    monkeypatch.setattr(
        PositionsByWork, "amid_many", lambda self, contact: not contact.touching.all()
    )
    mesh = generate.rectangle(1.0, 1.0, n=40)
    feet = [punch(mesh.translated((x, 0.0)), origin=(x, 0.0)) for x in (0.0, 1.0, 5.0)]
    loads = [{"force": 1.0, "at": (0.9, 0.0)}, {"force": 1.0, "at": (0.4, 0.0)}]
    found = RigidPunches(feet, joined=[(0, 1)]).solve(loads)
    assert found.success
    assert found[1].settlement == found[1].collocated_settlement
    assert found[2].settlement != found[2].collocated_settlement


def test_a_joint_is_no_edge_over_which_a_shape_presses():
    """Contact within a square of two halves crosses their joint, beside its middle."""
    centre, force = (0.1, 0.05), 0.1
    grid = MeshTri.init_tensor(np.linspace(-0.5, 0.5, 11), np.linspace(-1.0, 1.0, 21))
    gap = Paraboloid(1.0, centre)
    halves = [punch(grid.translated((x, 0.0)), gap=gap) for x in (-0.5, 0.5)]
    group = RigidPunches(halves, joined=[(0, 1)])
    left, right = group.solve([{"force": force, "at": centre}]).solutions
    for half in (left, right):
        assert half.punch.edge == "constant"
        assert half.line is not None
    assert np.abs(left.tilt).max() < 5e-5
    # over the edge of the whole it presses
    wide = group.solve([{"force": 20.0, "at": centre}]).solutions
    assert {half.punch.edge for half in wide} == {"singular"}


@pytest.mark.parametrize("rtol", [None, 1e-9, 1e-6])
@pytest.mark.parametrize(("one", "other"), [(2, 4), (4, 2), (2, 3)])
def test_cells_of_different_sizes_on_a_thin_skin(one, other, rtol):
    """The skin is part of what varies in the smaller ones only."""
    skin = LayeredHalfSpace([Layer(0.004, 20.0, 0.3)], HalfSpace(1.0, 0.3))
    circles = MeshTri.init_circle(one), MeshTri.init_circle(other).translated((2.5, 0.0))
    feet = [
        punch(mesh, substrate=skin, origin=(x, 0.0), rtol=rtol)
        for mesh, x in zip(circles, (0.0, 2.5), strict=True)
    ]
    found = RigidPunches(feet).solve([{"force": 1.0}] * 2)
    assert found.success
    for each in found.solutions:  # of init_circle(5)
        assert each.settlement == pytest.approx(0.569, rel=2e-2)


def test_grip_is_asked_of_the_cells_of_the_own_body():
    """Bodies stand in the order of their first punches, whatever the order within them."""
    sphere = punch(
        disc(2).translated((3.0, 0.0)), gap=Paraboloid(0.5, (3.0, 0.0)), edge="constant"
    )
    ends = [punch(disc(2).translated((x, 0.0)), edge="constant") for x in (0.0, 6.0)]
    group = RigidPunches([ends[0], sphere, ends[1]], joined=[(2, 0)])
    assert group.bodies == ((1,), (2, 0))
    assert [len(own) for own in group.cells_of_bodies] == [
        len(sphere.cells),
        2 * len(ends[0].cells),
    ]
    assert (group.cells_of_bodies[0] == np.arange(len(sphere.cells)) + len(ends[0].cells)).all()


def test_a_body_of_no_punch_is_refused():
    with pytest.raises(ValueError, match="expected numbers of punches from 0 to 0, each once"):
        RigidPunches([punch(disc(2))], joined=[()])


@pytest.mark.parametrize("k", [1e2, 1e10, 1e16])
def test_forces_of_a_stiff_frame(k):
    """What the load and the pressures of each body leave, whatever is left of the stiffness."""
    found = framed(column(0, 1, k, 2)).solve(FRAMED)
    assert found.success
    for i, load in enumerate(FRAMED):
        s = found[i]
        arm = np.array(load.get("at", (0.0, 0.0)))
        imposed = np.array([load["force"], *(load["force"] * arm)])
        imposed[1:] += Load(**load).first_moments
        assert found.frame_forces[i] == pytest.approx(imposed - s.resultant, abs=1e-12)


def test_joined_punches_with_a_symmetry_of_their_own():
    """A part of the edge has another one."""
    square = rectangle(4)
    alone = punch(square)
    given = Symmetry.detect(alone.partition, alone.partition.centroids, alone.weights)
    halves = [
        punch(square.translated((x, 0.0)), origin=(x, 0.0), symmetry=own)
        for x, own in ((0.0, given), (2.0, None))
    ]
    group = RigidPunches(halves, joined=[(0, 1)])
    assert group.members[0].symmetry == "auto"
    assert np.isfinite(group.members[0].stiffness()).all()


@pytest.mark.filterwarnings("ignore:contact on 4 of 41 cells")
def test_frames_that_no_forces_balance_by_work_have_the_position_by_collocation():
    """Of a foot loaded 100 times less than the other, on which force and frame all but cancel: it
    was told of positions imposed, of which there are none."""
    soil, beam = HalfSpace(30e3, 0.3), np.array([1, 1.25, 0, -1, 1.25, 0.0])
    feet = [
        RigidPunch(soil, DualMesh.from_mesh(mesh.translated((x, 0.0))).basis(), origin=(x, 0.0))
        for mesh in [generate.rectangle(1.5, 1.5, n=40)]
        for x in (0.0, 2.5)
    ]
    group = RigidPunches(feet, stiffness=1e5 * np.outer(beam, beam))
    with pytest.warns(ResolutionWarning, match="the position is that by collocation"):
        found = group.solve([{"force": 10.0, "at": (0.4, 0.3)}, {"force": 0.1}])
    assert all(solution.success for solution in found)
    assert [s.force for s in found] == pytest.approx([9.8625, 0.2375], rel=0.03)
    assert sum(s.force for s in found) == pytest.approx(10.1, rel=1e-12)


@pytest.mark.filterwarnings("ignore:contact on 3 of 61 cells")
def test_the_active_set_begins_anew_where_contact_shrank_to_nothing():
    """A ball beside a slab, off its middle: from full contact too few cells are left."""
    soil = HalfSpace(30e3, 0.3)
    slab, ball = (
        RigidPunch(
            soil,
            DualMesh.from_mesh(generate.rectangle(2.0, 2.0, n=60).translated((x, 0.0))).basis(),
            origin=(x, 0.0),
            gap=gap,
        )
        for x, gap in ((0.0, None), (3.0, lambda x: ((x[0] - 3) ** 2 + x[1] ** 2) / 20))
    )
    loads = [{"force": 100.0}, {"force": 10.0, "at": (0.2, 0.1)}]
    found = {
        method: RigidPunches([slab, ball]).solve(loads, method=method)
        for method in ("auto", "active-set")
    }
    for by_auto, by_set in zip(*found.values(), strict=True):
        assert by_set.success
        assert by_set.settlement == pytest.approx(by_auto.settlement, rel=1e-6)
