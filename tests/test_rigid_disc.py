"""Pressures under rigid discs against trusted digits, and the law of the edge they give."""

import numpy as np
import pytest
from marks import slow

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace, RigidPunch
from skfem_dual.grids.generate import disc
from skfem_dual.ground.rigid_disc import EdgeLaw, RigidDisc, edge_law


def layer(thickness, poisson=0.25, base="bonded", young=1.0):
    return LayeredHalfSpace([Layer(thickness, young, poisson)], base)


@pytest.mark.parametrize(
    ("ground", "settlement"),
    [
        (GradedHalfSpace.init_linear(1.0, 0.25, 0.1), 0.3884265445),
        (GradedHalfSpace.init_linear(1.0, 0.25, 1.0), 0.2212284989),
        (GradedHalfSpace.init_linear(1.0, 0.5, 1.0), 0.1498643676),
        (layer(1.0), 0.195493007289),
        (layer(1.0, base="smooth"), 0.2132017851),
        (layer(1.0, base=HalfSpace(0.1, 0.25)), 2.18606607872),
    ],
)
def test_settlement(ground, settlement):
    """Trusted digits, from the equations solved by other means."""
    assert RigidDisc.on(ground, 1.0).settlement == pytest.approx(settlement, rel=5e-8)


@pytest.mark.parametrize(
    ("ground", "pressures", "digits"),
    [
        (
            GradedHalfSpace.init_linear(1.0, 0.25, 1.0),
            [0.198725, 0.204275, 0.216509, 0.244841, 0.349874],
            5e-5,  # the moduli vary at the surface: the series converges slowly
        ),
        (
            layer(1.0),
            [0.2176780296, 0.2184528797, 0.2225574788, 0.2399703784, 0.3367326740],
            1e-9,
        ),
    ],
)
def test_pressure(ground, pressures, digits):
    r = np.array([0.0, 0.3, 0.5, 0.7, 0.9])
    found = RigidDisc.on(ground, 1.0).regular(1 - r) / np.sqrt(1 - r**2)
    assert found == pytest.approx(pressures, rel=digits)


def test_force_of_the_pressure():
    """The integral over the disc is 1, by the substitution r dr = -eta deta."""
    eta, weights = np.polynomial.legendre.leggauss(80)
    eta, weights = (eta + 1) / 2, weights / 2
    for ground in (layer(0.1), GradedHalfSpace.init_linear(1.0, 0.3, 5.0)):
        regular = RigidDisc.on(ground, 1.0).regular(1 - np.sqrt(1 - eta**2))
        assert 2 * np.pi * weights @ regular == pytest.approx(1.0, rel=1e-9)


def test_homogeneous_ground_has_the_plain_law():
    assert edge_law(HalfSpace(1.0, 0.3), 1.0) is None
    same = edge_law(layer(0.3, base=HalfSpace(1.0, 0.25)), 1.0)
    assert same.factors == pytest.approx(np.ones(len(same.factors)), abs=1e-9)


def test_small_plans_see_the_surface_only():
    ground = GradedHalfSpace.init_linear(1.0, 0.25, 1.0)
    law = edge_law(ground, 2e-6)
    assert law.factors == pytest.approx(np.ones(len(law.factors)), abs=1e-5)
    assert edge_law(ground, 1e-300) is None


def test_unit_of_length():
    plain = edge_law(layer(0.2), 1.0)
    scaled = edge_law(layer(0.2e3, young=7.0), 1e3)
    assert scaled.reach == pytest.approx(1e3 * plain.reach)
    assert scaled.factors == pytest.approx(plain.factors, rel=1e-8)


@pytest.mark.parametrize("thickness", [0.05, 0.1, 0.2])
def test_law_stays_positive(thickness):
    """On a crust over soft ground the pressure falls to nothing inside; the law does not."""
    ground = layer(thickness, base=HalfSpace(0.01, 0.25))
    regular = RigidDisc.on(ground, 1.0).regular(np.linspace(0, 1, 200))
    assert regular.min() < 0.02 * regular[0]
    law = EdgeLaw.of(RigidDisc.on(ground, 1.0))
    assert law.factors[0] == 1
    assert (law.factors > 0).all()
    assert law.steepness > 0.5
    assert law.pulls


@pytest.mark.parametrize(
    ("thickness", "ratio", "pulls"),
    [(0.1, 5, False), (0.1, 10, True), (0.2, 5, False), (0.2, 10, True), (0.5, 7.4, False)],
)
def test_crusts_that_bend_away(thickness, ratio, pulls):
    """Those that nearly do, too: the pressure vanishes and comes again inside."""
    ground = LayeredHalfSpace([Layer(thickness, ratio, 0.3)], HalfSpace(1.0, 0.45))
    assert edge_law(ground, 1.0).pulls == pulls


def test_the_first_of_two_dips_tells():
    """Where the second became the deeper one, the level jumped."""
    levels = []
    for young in (0.0129, 0.0130):
        layers = [Layer(0.03, 1.0, 0.3), Layer(0.5, 0.1, 0.3)]
        law = edge_law(LayeredHalfSpace(layers, HalfSpace(young, 0.45)), 1.0, 0.1)
        levels.append(law.factors)
    assert levels[1] == pytest.approx(levels[0], abs=5e-3)


def test_where_the_law_levels_off_depends_on_the_cells():
    """Those finer than the way to the bottom have pressures that follow it; for coarser ones it
    tells what lies where inside them."""
    ground = layer(0.1, base=HalfSpace(0.1, 0.25))
    fine, between, coarse = (edge_law(ground, 1.0, width) for width in (0.05, 0.16, 0.3))
    assert fine.factors == pytest.approx(edge_law(ground, 1.0).factors)
    least = [law.factors.min() for law in (fine, between, coarse)]
    assert least == sorted(least, reverse=True)
    assert least[0] > 2 * least[2]
    # far inside it is that of the ground: the ratio to the edge is kept to some percent
    assert fine.factors[-1] == pytest.approx(coarse.factors[-1], rel=0.06)
    # a law that does not fall is the same for all cells
    soft = layer(0.3)
    assert edge_law(soft, 1.0, 0.3).factors == pytest.approx(edge_law(soft, 1.0).factors, rel=5e-3)
    assert not edge_law(soft, 1.0).pulls


def test_same_ground_and_size_is_computed_once():
    ground = layer(0.4)
    assert edge_law(ground, 1.0) is edge_law(ground, 1.0)


@pytest.mark.parametrize("grid", ["dual", *slow("triangles")])
@pytest.mark.parametrize(
    "ground",
    [
        GradedHalfSpace.init_linear(1.0, 0.25, 10.0),
        layer(0.1),
        layer(0.2, base=HalfSpace(0.1, 0.25)),
        *slow(GradedHalfSpace.init_linear(1.0, 0.25, 5.0), layer(0.2)),
    ],
)
def test_cells_meet_the_disc(ground, grid):
    """Uniform cells on steep and thin ground, within what homogeneous ground has."""
    dual = DualMesh.from_mesh(disc(n=300))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    found = RigidPunch(ground, basis).solve(1.0, unilateral=False).settlement
    assert found == pytest.approx(RigidDisc.on(ground, 1.0).settlement, rel=1e-3)
