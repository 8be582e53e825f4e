import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from elastic_bodies import SOIL, block_on, point_load, position, raft, uniform
from marks import slow
from plans import disc

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    ElasticPunch,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Load,
    Plate,
    Punches,
    RigidPunch,
    RigidPunches,
    Sphere,
    column_load,
)
from skfem_dual.grids.generate import rectangle

BESIDE = 2.3


@cache
def footing(x=0.0, substrate=SOIL):
    cells = DualMesh.from_mesh(disc(3).translated((x, 0.0))).basis()
    return RigidPunch(substrate, cells, origin=(x, 0.0))


def slab(K, x=BESIDE, **options):
    return raft(K, disc(3).translated((x, 0.0)), origin=(x, 0.0), **options)


@pytest.mark.parametrize("substrate", [SOIL, *slow(GradedHalfSpace.init_linear(1.0, 0.3, 0.5))])
@pytest.mark.parametrize("at", [0.1, 0.5])  # full contact, and lifted off
def test_too_stiff_to_bend_is_a_group_of_rigid_punches(substrate, at):
    rigid = RigidPunches([footing(0.0, substrate), footing(BESIDE, substrate)])
    expected = rigid.solve([{"force": 1.0}, {"force": 2.0, "at": (at, 0.0)}])
    stiff = slab(1e9, substrate=substrate)
    loads = [{"force": 1.0}, 2 * point_load(stiff, (BESIDE + at, 0.0))]
    answer = Punches([footing(0.0, substrate), stiff]).solve(loads)
    assert answer.success
    first, second = answer.solutions
    assert first.collocated_settlement == pytest.approx(
        expected[0].collocated_settlement, rel=1e-6
    )
    assert first.collocated_tilt == pytest.approx(expected[0].collocated_tilt, abs=1e-6)
    tilt = expected[1].collocated_tilt
    moved = expected[1].collocated_settlement - BESIDE * tilt[0], *tilt
    assert position(second) == pytest.approx(moved, rel=1e-6, abs=1e-6)
    for s, r in zip(answer.solutions, expected.solutions, strict=True):
        assert s.pressure == pytest.approx(r.pressure, abs=1e-5 * r.pressure.max())
    assert first.settlement == pytest.approx(expected[0].settlement, rel=5e-5)
    x = np.array([[1.15, 4.0], [0.3, 0.0]])
    assert answer.displacement(x) == pytest.approx(expected.displacement(x), rel=1e-6)


@pytest.mark.parametrize("at", [0.0, 0.2])
def test_far_from_a_structure_a_circle_is_where_it_is_alone(at):
    """By work, beside exact values, from which points alone leave it farther away."""
    rigid, far = footing(), slab(0.05, 1e3)
    group = Punches([rigid, far])
    first = group.solve([{"force": 1.0, "at": (at, 0.0)}, 1e-3 * uniform(far)])[0]
    modulus = SOIL.young / (1 - SOIL.poisson**2)
    exact = 1 / (2 * modulus), 3 * at / (4 * modulus)
    assert (first.settlement, first.tilt[0]) == pytest.approx(exact, rel=5e-4, abs=1e-8)
    off = abs(first.collocated_settlement - exact[0])
    assert abs(first.settlement - exact[0]) < 0.4 * off
    alone = rigid.solve(1.0, at=(at, 0.0))
    assert first.settlement == pytest.approx(alone.settlement, rel=2e-5)
    assert first.tilt == pytest.approx(alone.tilt, rel=2e-5, abs=1e-7)


@pytest.mark.parametrize("kind", [RigidPunches, Punches])
def test_flat_beside_a_sphere_by_work(kind):
    """As alone but for what the sphere settles; positions imposed have the forces of the loads."""
    flat, far = footing(), 1e3
    group, load = kind([flat, ball(far)]), {"force": 1.0, "at": (0.2, 0.0)}
    first = group.solve([load, {"force": 0.1}])[0]
    alone, beside = flat.solve(1.0, at=(0.2, 0.0)), 0.1 / (np.pi * far)
    assert first.settlement == pytest.approx(alone.settlement + beside, rel=1e-5)
    assert first.tilt == pytest.approx(alone.tilt, rel=1e-5, abs=1e-6)
    for imposed in (
        {"settlement": first.settlement, "tilt": tuple(first.tilt)},
        {"settlement": first.settlement, "at": (0.2, 0.0)},
        {"force": 1.0, "tilt": tuple(first.tilt)},
    ):
        again = group.solve([imposed, {"force": 0.1}])[0]
        assert again.settlement == pytest.approx(first.settlement, rel=1e-8)
        assert again.tilt == pytest.approx(first.tilt, rel=1e-7, abs=1e-9)
        assert again.resultant == pytest.approx(first.resultant, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("beside", ["flat", "shaped", "structure"])
def test_positions_imposed_that_work_does_not_reach(beside, monkeypatch):
    """Told, with the pressures of the positions by collocation."""
    kind, by_collocation = RigidPunches, "_collocated"
    other, load = ball(BESIDE) if beside == "shaped" else footing(BESIDE), {"force": 0.1}
    if beside == "structure":
        kind, by_collocation, other = Punches, "_contact", slab(1.0)
        load = 0.1 * uniform(other)
    solve, found = getattr(kind, by_collocation), []

    def only_once(*arguments):
        contact, position = solve(*arguments)
        found.append(contact)
        if len(found) > 1:
            contact = replace(contact, success=False, message="not found")
        return contact, position

    monkeypatch.setattr(kind, by_collocation, only_once)
    with pytest.warns(ConvergenceWarning, match="not met by work: not found"):
        answer = kind([footing(), other]).solve([{"settlement": 0.5, "tilt": (0.0, 0.0)}, load])
    assert not answer.success
    first = answer.solutions[0]
    assert np.array_equal(first.pressure, found[0].pressure[: len(first.pressure)])


@cache
def ball(x=0.0):
    cells = DualMesh.from_mesh(disc(3).translated((x, 0.0))).basis()
    return RigidPunch(SOIL, cells, gap=Sphere(4.0, (x, 0.0)), origin=(x, 0.0))


@pytest.mark.parametrize("other", [footing, ball])
def test_rigid_bodies_alone_are_a_group_of_rigid_punches(other):
    """With the laws of the line of contact, under flat ones that lift off and shaped ones."""
    pair = [footing(), other(BESIDE)]
    loads = [{"force": 0.1, "at": (0.7, 0.0)}, {"force": 0.1}]
    expected, answer = RigidPunches(pair).solve(loads), Punches(pair).solve(loads)
    assert answer.success
    first, second = expected.solutions
    by_work = first.settlement != pytest.approx(first.collocated_settlement, rel=1e-4)
    assert by_work or second.line is not None
    for s, r in zip(answer.solutions, expected.solutions, strict=True):
        assert np.array_equal(s.positions, r.positions)
        assert np.array_equal(s.pressure, r.pressure)
    assert isinstance(answer.punches, Punches)


def test_settlements_beside_their_reactions_and_a_structure():
    """The forces found lead to the settlements that were imposed."""
    soft = slab(0.05)
    group, f = Punches([footing(), soft, footing(-BESIDE)]), uniform(soft)
    places = [(0.6, 0.1), (0.1, 0.2)]
    settled = [{"settlement": w, "at": at} for w, at in zip((1.0, 1.2), places)]
    imposed = group.solve([settled[0], f, settled[1]])
    assert imposed.success
    assert len(imposed[0].contact) < len(imposed[0].pressure)
    forces = [{"force": imposed[i].force, "at": at} for i, at in zip((0, 2), places)]
    again = group.solve([forces[0], f, forces[1]])
    assert again[0].settlement == pytest.approx(1.0, rel=1e-8)
    assert again[2].settlement == pytest.approx(1.2, rel=1e-8)
    peak = again[1].pressure.max()
    assert imposed[1].pressure == pytest.approx(again[1].pressure, abs=1e-8 * peak)


@pytest.mark.slow
def test_bodies_feel_the_ground_that_others_press():
    """Each alone, on ground that the others have settled, found in turn until nothing moves."""
    rigid, soft = footing(), slab(0.05)
    f = uniform(soft)
    together = Punches([rigid, soft]).solve([{"force": 1.0, "at": (0.2, 0.0)}, f])
    alone = soft.solve(f)
    for _ in range(12):
        hollow = alone.ground_displacement
        under_rigid = RigidPunch(SOIL, rigid.basis, gap=hollow, edge="singular")
        on_rigid = under_rigid.solve(1.0, at=(0.2, 0.0))
        hollow = on_rigid.displacement
        alone = ElasticPunch(
            SOIL, soft.basis, soft.structure, soft.stiffness, gap=hollow, edge="singular"
        ).solve(f)
    settled = on_rigid.settlement  # by work: on ground pressed by others, and of that shape
    assert together[0].settlement == pytest.approx(settled, rel=3e-6)
    settled = on_rigid.collocated_settlement
    assert together[0].collocated_settlement == pytest.approx(settled, rel=1e-7)
    assert together[0].collocated_tilt == pytest.approx(on_rigid.collocated_tilt, abs=1e-7)
    peak = alone.pressure.max()
    assert together[1].pressure == pytest.approx(alone.pressure, abs=1e-6 * peak)
    assert soft.trace @ together[1].displacement == pytest.approx(
        soft.trace @ alone.displacement, rel=1e-6
    )


def test_every_load_is_balanced():
    block_cells, block, K, options = block_on("dual")
    solid = ElasticPunch(SOIL, block_cells, block, 10 * K, **options)
    loads = [
        {"settlement": 0.9, "tilt": (0.0, 0.0)},
        point_load(solid, (0.3, 0.0)),
        uniform(held := slab(0.1, 3.5)),
    ]
    answer = Punches([footing(-3.0), solid, held]).solve(loads)
    assert answer.success
    assert answer[0].settlement == 0.9
    assert answer[1].resultant == pytest.approx([1.0, 0.3, 0.0], abs=1e-10)
    area = held.partition.areas.sum()
    assert answer[2].resultant == pytest.approx([area, 0.0, 0.0], abs=1e-10)
    for s in answer.solutions[1:]:
        assert s.equilibrium_residual < 1e-10
    assert answer.force == pytest.approx([answer[0].force, 1.0, area])
    assert not answer.frame_forces.any()


def test_order_does_not_matter():
    rigid, soft = footing(), slab(0.05)
    load, f = {"force": 1.0}, uniform(soft)
    one, other = Punches([rigid, soft]), Punches([soft, rigid])
    a, b = one.solve([load, f]), other.solve([f, load])
    dense = one.solve([load, f], method="active-set")
    for p, q, r in zip(a.solutions, b.solutions[::-1], dense.solutions, strict=True):
        peak = p.pressure.max()
        assert q.pressure == pytest.approx(p.pressure, abs=1e-8 * peak)
        assert r.pressure == pytest.approx(p.pressure, abs=1e-7 * peak)


def test_answer_of_a_pickle():
    cells, block, K, options = block_on("dual")
    both = Punches([footing(-3.0), ElasticPunch(SOIL, cells, block, K, **options)])
    loads = [{"force": 1.0}, point_load(both.punches[1], (0.3, 0.0))]
    answer, again = both.solve(loads), pickle.loads(pickle.dumps(both)).solve(loads)
    for s, r in zip(answer.solutions, again.solutions, strict=True):
        assert np.array_equal(s.pressure, r.pressure)


def test_a_solid_alone_in_a_group_is_alone():
    soft = slab(0.02)
    f = point_load(soft, (BESIDE + 0.3, 0.1))
    for unilateral in (True, False):
        together = Punches([soft]).solve([f], unilateral=unilateral)[0]
        alone = soft.solve(f, unilateral=unilateral)
        assert together.pressure == pytest.approx(alone.pressure, abs=1e-9)
        assert together.displacement == pytest.approx(alone.displacement, abs=1e-9)


def test_supports_of_a_structure():
    edge = slab(0.05)
    left = edge.structure.get_dofs(lambda x: np.isclose(x[0], BESIDE - 1)).all("u")
    held = slab(0.05, D=left)
    f, x = uniform(held), np.full(held.structure.N, 0.4)
    answer = Punches([footing(), held]).solve([{"force": 1.0}, {"f": f, "x": x}])[1]
    assert answer.success
    assert answer.displacement[left] == pytest.approx(0.4, abs=1e-14)
    total = f[held.structure.nodal_dofs[0]].sum()
    assert answer.force - answer.reactions.sum() == pytest.approx(total, rel=1e-10)


def test_shown():
    both = Punches([footing(), slab(0.1)])
    assert "ElasticPunch 1: " in repr(both)
    assert "ElasticPunch slab: " in repr(Punches(both.punches, names=["pad", "slab"]))
    answer = both.solve([{"force": 1.0}, uniform(both.punches[1])])
    assert "bends" in repr(answer)


def test_bad_groups():
    with pytest.raises(TypeError, match="expected some RigidPunch or ElasticPunch, got none"):
        Punches([])
    pad, near = footing(), slab(1.0, 0.5)
    with pytest.raises(TypeError, match="got 3"):
        Punches([pad, 3])
    with pytest.raises(ValueError, match="on one substrate"):
        Punches([pad, slab(1.0, substrate=HalfSpace(2.0, 0.0))])
    with pytest.raises(ValueError, match=r"do not overlap, got punches 0, 1"):
        Punches([pad, near])
    with pytest.raises(ValueError, match=r"overlap, got punches pad, slab"):
        Punches([pad, near], names=["pad", "slab"])
    with pytest.raises(ValueError, match="expected 2 names that differ"):
        Punches([pad, slab(1.0)], names=["pad", "pad"])


@pytest.fixture(scope="module")
def pair():
    both = Punches([footing(), slab(0.1)])
    return both, {"force": 1.0}, uniform(both.punches[1])


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        (lambda load, f: [load], ValueError, "one load for each of the 2"),
        (lambda load, f: [load, f[1:]], ValueError, r"loads\[1\]: expected f of shape"),
        (lambda load, f: [load, {"g": f}], TypeError, r"keys f and x of loads\[1\]"),
        (lambda load, f: [load, Load(1.0)], TypeError, "expected a load vector"),
        (lambda load, f: [f, f], TypeError, r"loads\[0\]"),
        (lambda load, f: [load, -f], ValueError, "punch 1: .*would take tension"),
        (lambda load, f: [load, 0 * f], ValueError, "punch 1: .*leave out bodies"),
        (lambda load, f: [{"force": 1.0, "at": (2.0, 0.0)}, f], ValueError, "punch 0: .*plan"),
        (lambda load, f: [{"force": 0.0}, f], ValueError, "punch 0: .*leave out bodies"),
    ],
)
def test_bad_loads(pair, change, kind, words):
    both, load, f = pair
    with pytest.raises(kind, match=words):
        both.solve(change(load, f))


def test_bodies_are_called_by_their_names(pair):
    both, load, f = pair
    named = Punches(both.punches, ["pad", "slab"])
    with pytest.raises(ValueError, match=r"punch slab: .*would take tension"):
        named.solve([load, -f])
    rigid = Punches([footing(), footing(3.0)], ["pad", "pier"])
    with pytest.raises(ValueError, match=r"body pier: .*the punch turns over"):
        rigid.solve([load, {"force": 1.0, "at": (2.0, 0.0)}])


def test_loads_are_read_once():
    """Also where the edge of a shaped body is seen while it is solved."""
    both, soft = Punches([ball(), slab(0.1)]), slab(0.1)
    loads = [{"force": 3.0}, uniform(soft)]
    assert both.solve(load for load in loads)[0].pressure == pytest.approx(
        both.solve(loads)[0].pressure
    )


def test_a_body_held_where_it_is_beside_a_structure():
    """A settlement of 0 is a position as others are: the pad keeps ground down that heaves."""
    soil = LayeredHalfSpace([Layer(0.4, 1.0, 0.5)], "bonded")
    bends = Plate(0.3, 200.0, 0.2).on(soil, DualMesh.from_mesh(rectangle(2.0, 1.3, n=60)).basis())
    f = column_load(bends.structure, (0.0, 0.0), 1.0, sides=(1.0, 1.0))
    pad = DualMesh.from_mesh(rectangle(0.5, 0.5, n=40).translated((1.5, 0.0))).basis()
    both = Punches([bends, RigidPunch(soil, pad, origin=(1.5, 0.0))])
    held, near = (
        both.solve([f, {"settlement": w, "tilt": (0.0, 0.0)}])[1].force for w in (0.0, 1e-12)
    )
    assert held == pytest.approx(near, rel=1e-6)
    assert held > 0.01
