from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from skfem_dual import GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace
from skfem_dual.errors import ConvergenceError
from skfem_dual.ground.seen import modulus_felt


def test_boussinesq():
    soil = HalfSpace(young=30e6, poisson=0.25)
    assert soil.contact_modulus == pytest.approx(32e6)
    assert soil.influence(2.0) == pytest.approx((1 - 0.25**2) / (np.pi * 30e6 * 2))
    assert soil.symbol(2.0) == pytest.approx(2 * (1 - 0.25**2) / (30e6 * 2))
    assert np.isinf(soil.influence(0.0))
    area, _ = quad(lambda r: soil.influence(r) * r, 0, 3)
    assert soil.primitive(3.0) == pytest.approx(area)


@pytest.mark.parametrize(
    ("young", "poisson", "error", "message"),
    [
        (0.0, 0.25, ValueError, "positive Young's modulus, got young=0"),
        (-1.0, 0.25, ValueError, "positive"),
        (np.nan, 0.25, ValueError, "finite young, got nan"),
        (np.inf, 0.25, ValueError, "finite young, got inf"),
        (1.0, 0.51, ValueError, "from 0 to 0.5, got poisson=0.51"),
        (1.0, -0.1, ValueError, "from 0 to 0.5"),
        (1.0, np.nan, ValueError, "finite poisson, got nan"),
        ("soft", 0.2, TypeError, "number for young, got 'soft'"),
        (1.0, None, TypeError, "number for poisson, got None"),
    ],
)
def test_bad_moduli(young, poisson, error, message):
    with pytest.raises(error, match=message):
        HalfSpace(young, poisson)


def crust(z):
    """Half as stiff again near the surface, over ground that stiffens with depth."""
    return (1 + 0.45 * np.exp(-z / 0.2)) * (1 + z / 30)


def test_a_crust_over_ground_that_goes_on_to_vary_is_seen():
    """It changes the modulus by less than the depth does; its influence was 3 % off, as layers
    with gradients tell."""
    ground = GradedHalfSpace.init_profile(crust, 0.3)
    edges = np.concatenate([np.linspace(0, 1, 41)[:-1], np.geomspace(1, 300, 41)])
    layers = [
        Layer(b - a, crust(a), 0.3, (crust(b) / crust(a) - 1) / (b - a))
        for a, b in pairwise(edges)
    ]
    other = LayeredHalfSpace(layers, HalfSpace(crust(300.0), 0.3))
    r = np.geomspace(1e-3, 1, 10)  # farther than that the layers end too soon
    assert ground.influence(r) == pytest.approx(other.influence(r), rel=1e-3)
    assert ground.error < 1e-8
    closer = GradedHalfSpace.init_profile(crust, 0.3, length=0.05)
    assert ground.influence(r) == pytest.approx(closer.influence(r), rel=1e-8)


@pytest.mark.parametrize(("length", "error"), [(9.0, 5e-7), (20.0, 2e-5)])
def test_errors_of_a_length_that_is_too_long_are_told(length, error):
    exact = GradedHalfSpace.init_linear(1.0, 0.3, 1.0)
    ground = GradedHalfSpace.init_profile(lambda z: 1 + z, 0.3, length)
    r = np.geomspace(1e-2, 30, 60)
    off = np.abs(ground.influence(r) / exact.influence(r) - 1).max()
    assert error < off < 3 * ground.error
    assert ground.error < 30 * off


def test_a_length_that_is_far_too_long_is_refused():
    ground = GradedHalfSpace.init_profile(crust, 0.3, length=70.0)
    with pytest.raises(ConvergenceError, match=r"vary over 70 or more.* a shorter length="):
        ground.influence(1.0)


def test_table_of_ground_that_stiffens_fast():
    """Its slope at the surface tells the wave numbers that count."""
    ground = GradedHalfSpace.init_exponential(1.0, 0.3, ratio=10.0, length=0.05)
    assert ground.error < 1e-9
    same = GradedHalfSpace.init_profile(lambda z: 10 - 9 * np.exp(-z / 0.05), 0.3, length=0.002)
    assert ground.influence(np.logspace(-3, 0, 7)) == pytest.approx(
        same.influence(np.logspace(-3, 0, 7)), rel=1e-8
    )


def test_profiles_in_single_precision_are_refused():
    """Rounding is noise to whoever integrates them: the influence at two points took 197 s."""
    with pytest.raises(TypeError, match="expected young in double precision, got float32"):
        GradedHalfSpace.init_profile(lambda z: (1 + z).astype(np.float32), 0.3)


@pytest.mark.parametrize(
    "ground", [HalfSpace(1.0, 0.3), LayeredHalfSpace([Layer(1.0, 1.0, 0.3)], HalfSpace(9.0, 0.2))]
)
def test_primitives_are_even(ground):
    assert ground.primitive(-2.0) == ground.primitive(2.0) > 0


def test_profiles_that_leave_their_range_below():
    with pytest.raises(ValueError, match=r"poisson from 0 to 0.5 .* Remedy: a profile that ends"):
        GradedHalfSpace.init_profile(lambda z: 1 + z, lambda z: 0.3 + 0.3 * z)
    with pytest.raises(ValueError, match=r"young positive at all depths, got -.* np.interp"):
        GradedHalfSpace.init_profile(lambda z: 1 - 0.3 * z, 0.3)


@pytest.mark.parametrize("depth", [0.02, 0.7, 1.5, 3.18])
def test_profiles_that_leave_their_range_in_between(depth):
    def dip(z, least):
        return 1 - (1 - least) * np.exp(-(((z - depth) / (0.05 * depth)) ** 2))

    with pytest.raises(ValueError, match=r"young positive at all depths, got -"):
        GradedHalfSpace(lambda z: (1 + z) * dip(z, -0.1 / (1 + depth)), 0.3, 2.0)
    with pytest.raises(ValueError, match=r"poisson from 0 to 0.5 at all depths, got -"):
        GradedHalfSpace.init_profile(lambda z: 1 + z, lambda z: 0.3 * dip(z, -0.3))


@pytest.mark.parametrize(
    "ground",
    [
        GradedHalfSpace.init_linear(1.0, 0.3, 5.0),
        LayeredHalfSpace([Layer(0.3, 1.0, 0.45)], "bonded"),
        LayeredHalfSpace([Layer(0.1, 9.0, 0.2)], HalfSpace(1.0, 0.3)),
    ],
)
def test_moduli_that_waves_feel(ground):
    """By the table or the symbol, whichever is at hand: that of the surface for the shortest."""
    for size in ground.lengths[0] * np.array([1e-3, 0.1, 1.0, 10.0, 100.0]):
        k = np.pi / size
        assert modulus_felt(ground, size) == pytest.approx(2 / (k * ground.symbol(k)), rel=1e-6)
    surface = ground.surface.contact_modulus
    assert modulus_felt(ground, 1e-4 * ground.lengths[0]) == pytest.approx(surface, rel=1e-3)
