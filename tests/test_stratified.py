"""Graded and layered half-spaces against trusted numbers, limits and invariances.

Reference values: computed independently of this code, all digits given are trusted.
"""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from marks import slow
from plans import disc, sin_graded
from skfem import MeshTri

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
    RigidPunches,
    stress_below,
)
from skfem_dual.grids.generate import rectangle

LINEAR = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)
BONDED = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")
SMOOTH = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "smooth")
STIFF_TOP = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], HalfSpace(0.1, 0.25))
R = np.logspace(-3, 2, 41)


def error(substrate, r, expected):
    """Of the influence function, relative to that of the surface moduli."""
    return np.abs(substrate.influence(r) - expected) / substrate.surface.influence(r)


def test_influence_and_primitive_of_the_linear_ground():
    """Point-force influence, E = 1 + z, nu = 1/4."""
    r = np.array([0.1, 1.0, 10.0])
    expected = [2.2223031455, 0.08705057668, 1.26727275e-3]
    assert error(LINEAR, r, expected).max() < 1e-8
    found = LINEAR.primitive(np.array([1.0, 10.0]))
    scale = LINEAR.surface.primitive(np.array([1.0, 10.0]))
    assert np.abs(found - [0.144326675717, 0.402240751703]) / scale == pytest.approx(0, abs=1e-8)
    assert LINEAR.error < 1e-8


def test_uniform_load_on_a_layer():
    """Centre of a disc of radius a: w E / (q a) on H = a and 2a, bonded, nu = 1/4."""
    assert 2 * np.pi * BONDED.primitive(1.0) == pytest.approx(0.8436644949, abs=1e-8)
    deep = LayeredHalfSpace([Layer(2.0, 1.0, 0.25)], "bonded")
    assert 2 * np.pi * deep.primitive(1.0) == pytest.approx(1.2839458406, abs=1e-8)


def test_burmister():
    """Two layers, nu = 1/2, E1 / E2 = 10, h = a, disc centre: F2 = 0.4864731942."""
    ground = LayeredHalfSpace([Layer(1.0, 10.0, 0.5)], HalfSpace(1.0, 0.5))
    assert 2 * np.pi * ground.primitive(1.0) / 1.5 == pytest.approx(0.4864731942, abs=1e-8)


@pytest.mark.parametrize(("gradient", "expected"), [(1e5, 0.99998), *slow((1e3, 0.99800))])
def test_gibson(gradient, expected):
    """nu = 1/2, E = 1 + B z: the settlement under a uniform load tends to q / (2 G')."""
    ground = GradedHalfSpace.init_linear(1.0, 0.5, gradient)
    settlement = 2 * np.pi * ground.primitive(1.0) * 2 * gradient / 3
    # exact to 1e-9 of what the soft surface alone would give, which is gradient times more
    assert settlement == pytest.approx(expected, abs=1e-5 + 4e-9 * gradient)


@pytest.mark.parametrize(
    "ground",
    [
        LayeredHalfSpace([Layer(0.3, 1.0, 0.25), Layer(0.9, 1.0, 0.25)], HalfSpace(1.0, 0.25)),
        LayeredHalfSpace([Layer(0.3, 1.0, 0.25, 1e-12)], HalfSpace(1.0, 0.25)),
        GradedHalfSpace.init_profile(np.ones_like, 0.25, 1.0),
        GradedHalfSpace.init_exponential(1.0, 0.25, 1.0, 2.0),
    ],
    ids=["layers", "no gradient", "profile", "exponential"],
)
def test_equal_moduli_are_homogeneous(ground):
    assert error(ground, R, HalfSpace(1.0, 0.25).influence(R)).max() < 1e-9
    k = np.logspace(-3, 3, 13)
    assert ground.symbol(k) == pytest.approx(HalfSpace(1.0, 0.25).symbol(k), rel=1e-9)
    assert ground.primitive(R) == pytest.approx(HalfSpace(1.0, 0.25).primitive(R), rel=1e-9)


@pytest.mark.parametrize(
    "at", [(0.7, 0.0), *slow(((0.1, 0.05),))], ids=["lifted off", "full contact"]
)
def test_punches_on_equal_layers_are_those_on_a_half_space(at):
    """By the work of pressures, too: what is beyond c / r comes on top of the same sums."""
    basis = DualMesh.from_mesh(disc(2)).basis()
    layers = LayeredHalfSpace([Layer(0.7, 1.0, 0.25)], HalfSpace(1.0, 0.25))
    one, other = (RigidPunch(g, basis).solve(1.0, at=at) for g in (layers, HalfSpace(1.0, 0.25)))
    assert one.settlement == pytest.approx(other.settlement, rel=1e-9)
    assert one.tilt == pytest.approx(other.tilt, rel=1e-9)
    assert one.pressure == pytest.approx(other.pressure, rel=1e-8)


@pytest.mark.slow
def test_splitting_a_layer_changes_nothing():
    split = LayeredHalfSpace([Layer(0.3, 1.0, 0.25), Layer(0.7, 1.0, 0.25)], "bonded")
    assert error(split, R, BONDED.influence(R)).max() < 1e-9
    graded = LayeredHalfSpace(
        [Layer(0.5, 1.0, 0.25, 1.0), Layer(0.5, 1.5, 0.25, 1 / 1.5)],
        GradedHalfSpace.init_linear(2.0, 0.25, 0.5),
    )
    assert error(graded, R, LINEAR.influence(R)).max() < 1e-8
    power = GradedHalfSpace.init_power(1.0, 0.25, 1.0, 1.0)
    assert error(power, R, LINEAR.influence(R)).max() < 1e-9


@pytest.mark.parametrize("unit", [1e-3, *slow(1e3)])
def test_length_of_a_profile_is_found(unit):
    """In any unit of length, as good as a given one."""
    found = GradedHalfSpace.init_profile(lambda z: 2 * (1 + z / unit), 0.25)
    assert found.length == pytest.approx(unit, rel=0.05)
    given = GradedHalfSpace.init_linear(2.0, 0.25, 1 / unit)
    assert error(found, R * unit, given.influence(R * unit)).max() < 1e-9
    slight = GradedHalfSpace.init_profile(lambda z: 1 + 0.2 * (1 - np.exp(-z / unit)), 0.25)
    assert 0.5 * unit < slight.length < 4 * unit
    soft = GradedHalfSpace.init_profile(np.ones_like, lambda z: 0.2 + 0.1 * z / (z + unit))
    assert 0.5 * unit < soft.length < 4 * unit


def test_stiffer_ground_settles_less():
    grounds = [
        STIFF_TOP,
        HalfSpace(1.0, 0.25),
        LINEAR,
        LayeredHalfSpace([Layer(1.0, 1.0, 0.25, 1.0)], "bonded"),
    ]
    found = np.array([ground.primitive(np.array([0.5, 1.0, 3.0])) for ground in grounds])
    assert (np.diff(found, axis=0) < 0).all()
    assert (BONDED.primitive(R) < SMOOTH.primitive(R)).all()


def test_far_and_near_limits():
    """Near by the ground is its surface, far away its base."""
    assert STIFF_TOP.influence(1e-6) == pytest.approx(
        HalfSpace(1.0, 0.25).influence(1e-6), rel=1e-5
    )
    assert STIFF_TOP.influence(1e4) == pytest.approx(HalfSpace(0.1, 0.25).influence(1e4), rel=1e-3)
    assert error(BONDED, 50.0, 0.0) < 1e-8


def test_scaling():
    """Lengths and moduli in other units."""
    ground = LayeredHalfSpace([Layer(3.0, 5e6, 0.25)], HalfSpace(5e5, 0.25))
    expected = STIFF_TOP.influence(R) / (5e6 * 3.0)
    assert error(ground, 3.0 * R, expected).max() < 1e-9


# W = W0 E0 a / P and tilt = (delta / a) E0 a^3 / M of a rigid circle in full contact
PUNCHES = [
    (GradedHalfSpace.init_linear(1.0, 0.25, 0.1), 0.3884265445, 0.668060194),
    (GradedHalfSpace.init_linear(1.0, 0.25, 0.5), 0.2794736165, 0.571777662),
    (LINEAR, 0.2212284989, 0.496333765),
    (GradedHalfSpace.init_linear(1.0, 0.5, 1.0), 0.1498643676, 0.362765675),
    (BONDED, 0.195493007289, 0.566018026363),
    (SMOOTH, 0.2132017851, 0.5940602539),
    (STIFF_TOP, 2.18606607872, 1.16856340458),
]


@pytest.mark.parametrize(
    ("ground", "settlement", "tilt", "grid"),
    [
        *((*PUNCHES[i], "dual") for i in (2, 5)),
        *slow(*((*PUNCHES[i], "dual") for i in (0, 1, 3, 4, 6))),
        *slow(*((*known, "primal") for known in PUNCHES[2::2])),
    ],
)
def test_rigid_circle(ground, settlement, tilt, grid):
    """545 cells, 1024 triangles drawn to the edge; and less accurate with fewer."""
    found = []
    for refinements in (3, 4):
        dual = DualMesh.from_mesh(disc(refinements, graded=True))
        basis = dual.basis() if grid == "dual" else dual.primal_basis()
        compliance = np.linalg.inv(RigidPunch(ground, basis).stiffness()).diagonal()
        found.append(np.abs(compliance[:2] / [settlement, tilt] - 1))
    assert found[1][0] < 5e-4
    assert found[1][1] < 2e-3
    assert found[1][0] < found[0][0] + 1e-5


def test_pressure_under_a_circle_on_the_linear_ground():
    """p a^2 / P at r / a = 0, 0.3, 0.5, 0.7, 0.9 under a central force."""
    dual = DualMesh.from_mesh(disc(4, graded=True))
    solution = RigidPunch(LINEAR, dual.basis()).solve(1.0)
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False) + 0.01
    expected = {0.3: 0.204275, 0.5: 0.216509, 0.7: 0.244841, 0.9: 0.349874}
    for r, p in expected.items():
        at = solution.pressure_at(r * np.stack([np.cos(angle), np.sin(angle)]))
        assert at.mean() == pytest.approx(p, rel=5e-3)


def test_displacement_agrees_with_the_punch():
    dual = DualMesh.from_mesh(
        MeshTri(sin_graded(MeshTri.init_circle(3)).p, MeshTri.init_circle(3).t)
    )
    problem = RigidPunch(LINEAR, dual.basis())
    solution = problem.solve(1.0, at=(0.1, 0.0))
    x = problem.collocation_points
    assert solution.displacement(x) == pytest.approx(
        solution.punch_displacement(x, collocated=True)
    )
    far = solution.displacement([[30.0], [0.0]])
    assert far[0] == pytest.approx(LINEAR.influence(30.0 - 0.1), rel=2e-3)


@pytest.mark.parametrize(
    "ground",
    [
        BONDED,
        LINEAR,
        *slow(
            GradedHalfSpace.init_exponential(1.0, 0.2, 3.0, 2.0),
            GradedHalfSpace.init_power(1.0, 0.2, 0.5, 2.0),
        ),
    ],
)
def test_pickle(ground):
    again = pickle.loads(pickle.dumps(ground))
    assert np.array_equal(again.influence(R), ground.influence(R))


def test_text():
    assert "E = 1 (1 + 1 z)" in repr(LINEAR)
    assert "bonded" in repr(BONDED)


def test_range():
    with pytest.raises(ValueError, match=r"expected distances up to .*, got 2e\+07"):
        LINEAR.influence(2e7)
    with pytest.raises(ValueError, match="finite radius, got nan at index 1"):
        LINEAR.primitive(np.array([1.0, np.nan]))
    assert np.isinf(LINEAR.influence(0.0))


@pytest.mark.parametrize(
    ("make", "kind", "message"),
    [
        (lambda: GradedHalfSpace.init_linear(0.0, 0.2, 1.0), ValueError, "positive Young"),
        (lambda: GradedHalfSpace.init_linear(1.0, 0.6, 1.0), ValueError, "from 0 to 0.5"),
        (lambda: GradedHalfSpace.init_linear(1.0, 0.2, 0.0), ValueError, "positive gradient"),
        (lambda: GradedHalfSpace.init_linear(1.0, 0.2, "x"), TypeError, "number for gradient"),
        (
            lambda: GradedHalfSpace.init_power(1.0, 0.2, 3.0, 1.0),
            ValueError,
            "exponent above 0 and below 2, got 3",
        ),
        (
            lambda: GradedHalfSpace.init_profile(lambda z: z, 0.2, 1.0),
            ValueError,
            "at the surface",
        ),
        (
            lambda: GradedHalfSpace.init_profile(lambda z: 1 - z, 0.2, 1.0),
            ValueError,
            "young positive at all depths",
        ),
        (
            lambda: GradedHalfSpace.init_profile(np.ones_like, lambda z: 0.3 + z, 1.0),
            ValueError,
            "poisson from 0 to 0.5",
        ),
        (lambda: GradedHalfSpace.init_profile(np.ones_like, 0.2, -1.0), ValueError, "length"),
        (lambda: GradedHalfSpace.init_profile(float, 0.2), TypeError, "for young, got the class"),
        (lambda: Layer(0.0, 1.0, 0.2), ValueError, "positive thickness"),
        (lambda: Layer(1.0, 1.0, 0.2, -1.0), ValueError, "at the bottom of the layer"),
        (lambda: LayeredHalfSpace([], "bonded"), ValueError, "at least one layer, got none"),
        (lambda: LayeredHalfSpace([1.0], "bonded"), TypeError, "sequence of Layer"),
        (lambda: LayeredHalfSpace([Layer(1, 1, 0.2)], "glued"), TypeError, "got 'glued'"),
        (
            lambda: LayeredHalfSpace([Layer(1, 1, 0.2, 0.5)], "smooth"),
            ValueError,
            "without gradient on a smooth",
        ),
    ],
)
def test_bad_grounds(make, kind, message):
    with pytest.raises(kind, match=message):
        make()


def test_equal_layers_are_one_ground():
    one, other = (LayeredHalfSpace([Layer(1.0, 1.0, 0.2)], HalfSpace(2.0, 0.3)) for _ in "12")
    assert one == other
    assert len({one, other}) == 1
    assert one != LayeredHalfSpace([Layer(1.0, 1.0, 0.2)], "bonded")


class Modulus:
    """A profile that is no function, equal to others and without a hash."""

    def __call__(self, z):
        return 1 + z

    def __eq__(self, other):
        return isinstance(other, Modulus)


@pytest.mark.parametrize(
    "make",
    [
        lambda: GradedHalfSpace.init_linear(1.0, 0.2, 0.5),
        lambda: GradedHalfSpace.init_exponential(1.0, 0.2, 3.0, 2.0),
        lambda: GradedHalfSpace.init_power(1.0, 0.2, 0.5, 2.0),
        lambda: LayeredHalfSpace([Layer(1.0, 1.0, 0.2)], GradedHalfSpace.init_linear(1, 0.2, 1)),
        lambda: GradedHalfSpace.init_profile(Modulus(), 0.2),
    ],
)
def test_equal_gradients_are_one_ground(make):
    """Made twice, or pickled apart: neighbours stand on one ground."""
    again = pickle.loads(pickle.dumps(make()))
    assert make() == make() == again
    assert len({make(), make(), again}) == 1
    assert make() != GradedHalfSpace.init_linear(1.0, 0.2, 0.6)
    square = rectangle(1.0, 1.0, n=20)
    punches = [
        RigidPunch(make(), DualMesh.from_mesh(square.translated((x, 0.0))).basis(), origin=(x, 0))
        for x in (0.0, 2.0)
    ]
    assert len(RigidPunches(punches).punches) == 2


def test_bad_numbers():
    with pytest.raises(TypeError, match="expected a number for thickness, got None"):
        Layer(None, 1.0, 0.2)
    with pytest.raises(TypeError, match="expected a number for ratio, got 'a'"):
        GradedHalfSpace.init_exponential(1.0, 0.2, "a", 1.0)


@pytest.mark.parametrize(
    "soil",
    [
        LINEAR,
        GradedHalfSpace.init_exponential(1.0, 0.25, 0.5, 1.0),
        GradedHalfSpace.init_power(1.0, 0.25, 0.5, 1.0),
        LayeredHalfSpace([Layer(0.5, 1.0, 0.25)], "bonded"),
        LayeredHalfSpace([Layer(0.5, 1.0, 0.25), Layer(1.0, 0.1, 0.4)], HalfSpace(0.1, 0.25)),
    ],
)
def test_underflow_is_no_error(soil):
    """Even where users want to be told of it."""
    mesh, x = disc(2), np.array([[0.1], [0.2], [0.5]])
    with np.errstate(all="raise"):
        ground = replace(soil)  # computes its table anew
        punch = RigidPunch(ground, DualMesh.from_mesh(mesh).basis())
        solution = punch.solve(1.0, at=(0.6, 0.0))
        assert solution.success
        assert np.isfinite(stress_below(solution, x)).all()
        assert np.isfinite(punch.stiffness(full=True)).all()
