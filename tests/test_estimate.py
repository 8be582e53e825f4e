"""Brackets, indicators and marking from couples of solutions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from plans import annulus, disc, ellipse, perturbed, rectangle
from skfem import MeshTri

from skfem_dual import DualMesh, HalfSpace, RigidPunch, repair
from skfem_dual.contact.exact import circle_settlement, circle_tilt, ellipse_settlement
from skfem_dual.contact.shapes import Paraboloid
from skfem_dual.post.estimate import estimate_error, marked

SOIL = HalfSpace(1.0, 0.25)
MODULUS = 1 / (1 - 0.25**2)
SQUARE = 1 / (np.pi * MODULUS * 0.733576)
RECTANGLE = 1 / (np.pi * MODULUS * 1.063836)


def estimate(mesh, at=(0.0, 0.0), soil=SOIL, force=1.0):
    dual = DualMesh.from_mesh(mesh)
    below = RigidPunch(soil, dual.basis(), edge="constant", collocation="node")
    above = RigidPunch(soil, dual.primal_basis(), edge="constant")
    return estimate_error(below.solve(force, at), above.solve(force, at))


CASES = {
    "disc": (disc(3), circle_settlement(1.0, 1.0, 1.0, 0.25)),
    "graded disc": (disc(3, graded=True), circle_settlement(1.0, 1.0, 1.0, 0.25)),
    "random disc": (perturbed(disc(4), 0.015), circle_settlement(1.0, 1.0, 1.0, 0.25)),
    "ellipse": (ellipse(3), ellipse_settlement(1.0, (1.0, 0.5), 1.0, 0.25)),
    "square": (rectangle(14), SQUARE),
    "graded square": (rectangle(14, graded=True), SQUARE),
    "rectangle": (rectangle(8, 1.0, 2.0), RECTANGLE),
    "annulus": (annulus(6, 60), 1 / (np.pi * MODULUS * 0.6245354)),
}


@pytest.mark.parametrize(("mesh", "exact"), CASES.values(), ids=CASES)
def test_bracket_and_effectivity(mesh, exact):
    found = estimate(mesh)
    low, high = found.settlement
    # all of these plans are symmetric: no tilt, and none between two of the mesh
    assert found.bracketed.tolist() == [True, False, False]
    assert low < exact < high
    assert found.mixed_settlement == pytest.approx(exact, rel=2e-3)
    assert abs(found.mixed_settlement - exact) < 0.15 * (high - low)
    assert 0.7 < found.total / np.sqrt(high - exact) < 1.6
    assert repr(found).count("expected between: yes") == 1
    assert repr(found).count("expected between: no") == 2


@pytest.mark.parametrize("at", [(0.1, -0.2), (0.0, 0.15), (-0.02, 0.0)])
def test_bracket_of_tilts(at):
    found = estimate(perturbed(disc(4), 0.015), at)
    exact = np.array([circle_tilt(m, 1.0, 1.0, 0.25) for m in at])
    assert found.bracketed.tolist() == [True, *(m != 0 for m in at)]
    inside = (found.tilt[:, 0] < exact) & (exact < found.tilt[:, 1])
    assert inside[exact != 0].all()
    # under another sign of the load the other end is the larger
    turned = estimate(perturbed(disc(4), 0.015), (-at[0], -at[1]))
    assert turned.bracketed.tolist() == found.bracketed.tolist()


@pytest.mark.parametrize("e", [0.0, 0.1, 0.25, 0.28, 0.31])
@pytest.mark.parametrize("x", [-0.8, 0.0, 0.8])
def test_bracket_at_any_origin(e, x):
    """Where the tilt lifts the origin errors cancel: the exact value was not between."""
    dual = DualMesh.from_mesh(disc(4))
    kinds = {"edge": "constant", "collocation": "node"}, {"edge": "constant"}
    below, above = (
        RigidPunch(SOIL, basis, origin=(x, 0.0), **kind).solve(1.0, at=(e - x, 0.0))
        for basis, kind in zip((dual.basis(), dual.primal_basis()), kinds, strict=True)
    )
    found = estimate_error(below, above)
    low, high = found.settlement
    exact = circle_settlement(1.0, 1.0, 1.0, 0.25) + x * circle_tilt(e, 1.0, 1.0, 0.25)
    assert found.bracketed[0] == (1.5 * e * x > -0.2)
    assert low < exact < high or not found.bracketed[0]
    # that of tilts has nothing to do with the origin
    assert found.bracketed[1] == (e != 0)


def test_the_settlement_of_a_pure_moment_is_that_of_the_mesh():
    dual = DualMesh.from_mesh(perturbed(disc(3), 0.015))
    kinds = {"edge": "constant", "collocation": "node"}, {"edge": "constant"}
    pair = [
        RigidPunch(SOIL, basis, **kind).solve(0.0, moments=(0.0, 0.1), unilateral=False)
        for basis, kind in zip((dual.basis(), dual.primal_basis()), kinds, strict=True)
    ]
    assert not estimate_error(*pair).bracketed.any()


def test_edge_weighted_solutions_are_no_bracket():
    dual = DualMesh.from_mesh(disc(3))
    pair = [RigidPunch(SOIL, basis).solve(1.0) for basis in (dual.basis(), dual.primal_basis())]
    found = estimate_error(*pair)
    assert not found.bracketed.any()
    assert found.mixed_settlement == pytest.approx(found.settlement.mean())
    assert found.total < 0.6 * estimate(disc(3)).total


def test_indicators_add_up_and_scale():
    found = estimate(disc(3))
    assert np.sum(found.on_cells**2) == pytest.approx(np.sum(found.on_triangles**2))
    assert found.total**2 == pytest.approx(np.sum(found.on_triangles**2))
    # squares are energies: P^2 / (E* a)
    other = estimate(disc(3).scaled(2.0), soil=HalfSpace(10.0, 0.25), force=3.0)
    assert other.total**2 == pytest.approx(found.total**2 * 9 / (10 * 2))
    # the error sits at the edge
    r = np.hypot(*disc(3).p[:, disc(3).t].mean(axis=1))
    assert found.on_triangles[r > 0.8].min() > found.on_triangles[r < 0.5].max()


@given(hnp.arrays(float, st.integers(1, 30), elements=st.floats(0, 1e3)), st.floats(0.01, 1.0))
def test_marking_takes_the_fewest_cells_that_suffice(indicator, fraction):
    cells = marked(indicator, fraction)
    squares = np.sort(indicator**2)[::-1]
    assert (np.diff(cells) > 0).all()
    assert np.sum(indicator[cells] ** 2) >= fraction * squares.sum() * (1 - 1e-9)
    assert squares[: len(cells) - 1].sum() <= fraction * squares.sum()


def test_wrong_marking():
    with pytest.raises(ValueError, match="fraction above 0 and of at most 1, got 0"):
        marked(np.ones(3), 0)
    with pytest.raises(ValueError, match="finite indicator, got nan at cell 1"):
        marked(np.array([1.0, np.nan]))


def test_adaptive_refinement_beats_uniform():
    mesh = uniform = rectangle(6)
    for _ in range(2):
        uniform = uniform.refined()
    reference = estimate(uniform)
    for _ in range(8):
        found = estimate(mesh)
        if mesh.nelements >= 0.6 * uniform.nelements:
            break
        mesh = repair(mesh.refined(marked(found.on_triangles, 0.6)))[0]
    assert mesh.nelements < uniform.nelements
    error = found.settlement[1] - SQUARE
    assert 0 < error < 0.8 * (reference.settlement[1] - SQUARE)


def test_negative_indicators_are_refused():
    with pytest.raises(ValueError, match="expected indicators from 0 on, got -2 of cell 1"):
        marked(np.array([1.0, -2.0]), 0.5)


@pytest.mark.parametrize(("at", "gap"), [((0.55, 0.2), None), ((0.0, 0.0), Paraboloid(5.0))])
def test_no_bracket_of_punches_that_lift_off_or_are_shaped(at, gap):
    """The exact settlement of the first, 0.4113, is larger than both, on any mesh."""
    dual = DualMesh.from_mesh(disc(3))
    options = {"edge": "constant", "origin": (0.0, 0.0), "gap": gap}
    on_cells = RigidPunch(SOIL, dual.basis(), collocation="node", **options)
    on_triangles = RigidPunch(SOIL, dual.primal_basis(), **options)
    estimate = estimate_error(on_cells.solve(0.01, at=at), on_triangles.solve(0.01, at=at))
    assert not estimate.bracketed.any()
    assert estimate.mixed_settlement == pytest.approx(estimate.settlement.mean(), rel=1e-12)


def test_no_error_without_load():
    """Nothing was divided by nothing, and a cell without error was marked."""
    found = estimate(disc(2), force=0.0)
    assert not found.settlement.any()
    assert not found.on_triangles.any()
    assert len(marked(found.on_triangles)) == 0


@pytest.mark.parametrize(
    ("seed", "at"), [(9, (0.0, 0.0)), (0, (-0.00281, -0.00105))], ids=["central", "nearly central"]
)
def test_tilts_of_the_mesh_are_no_bracket(seed, at):
    """The exact tilt is not between two that irregular triangles make of it."""
    found = estimate(perturbed(disc(2), 0.02, seed), at)
    exact = circle_tilt(at[1], 1.0, 1.0, 0.25)
    assert not found.tilt[1, 0] < exact < found.tilt[1, 1]
    assert not found.bracketed[2]


def test_rounding_does_not_tilt():
    """Of a symmetric punch, however it is turned."""
    for angle in np.linspace(0, 0.5, 6):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        mesh = disc(2)
        found = estimate(MeshTri(turn @ mesh.p, mesh.t))
        assert found.bracketed.tolist() == [True, False, False]
