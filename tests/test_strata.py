"""Waves of load in layers and gradients, against Love's stress function and the equations."""

import burmister
import numpy as np
import pytest

from skfem_dual import GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace
from skfem_dual.ground.depths import uniform_amplitudes

K = np.logspace(-2, 1.3, 9)
DEPTHS = np.array([0.02, 0.3, 0.5, 0.9, 1.2])
LINEAR = GradedHalfSpace.init_linear(1.0, 0.25, 1.0)
LAYERS = [(0.5, 1.0, 0.2), (0.7, 8.0, 0.5)]


def layered(base):
    return LayeredHalfSpace([Layer(*layer) for layer in LAYERS], base)


@pytest.mark.parametrize("base", [HalfSpace(0.2, 0.4), "bonded", "smooth"], ids=str)
def test_layers(base):
    """Two layers on soft ground or rock."""
    found = np.array(layered(base).strata.amplitudes(K, DEPTHS))
    rigid = isinstance(base, str)
    layers = LAYERS if rigid else [*LAYERS, (np.inf, base.young, base.poisson)]
    expected = np.array(
        [[burmister.amplitudes(layers, base if rigid else None, k, z) for k in K] for z in DEPTHS]
    )
    assert found == pytest.approx(np.moveaxis(expected, -1, 0), rel=1e-9, abs=1e-11)
    if rigid:
        fixed = [2, 3] if base == "bonded" else [0, 3]
        assert np.abs(found[fixed, -1]).max() < 1e-14


@pytest.mark.parametrize(
    "ground",
    [
        HalfSpace(3.0, 0.3),
        LayeredHalfSpace([Layer(0.3, 3.0, 0.3), Layer(0.9, 3.0, 0.3)], HalfSpace(3.0, 0.3)),
        LayeredHalfSpace(
            [Layer(0.4, 3.0, 0.3, 1e-13)],
            GradedHalfSpace.init_profile(lambda z: 3 * np.ones_like(z), 0.3, 1.0),
        ),
    ],
    ids=["half-space", "layers", "gradients"],
)
def test_equal_strata_are_homogeneous(ground):
    found = np.array(ground.strata.amplitudes(K, DEPTHS))
    assert found == pytest.approx(np.array(uniform_amplitudes(K, DEPTHS, 0.3)), abs=1e-10)


def test_gradient_by_many_thin_layers():
    """Layers with the modulus of their middles, of 1/50 and 1/100: an error of second order."""
    depths = np.array([0.5, 1.0])
    exact = np.array(
        LayeredHalfSpace([Layer(1.0, 1.0, 0.25, 1.0)], HalfSpace(2.0, 0.25)).strata.amplitudes(
            K, depths
        )
    )
    errors = []
    for n in (50, 100):
        steps = [Layer(1 / n, 1 + (i + 0.5) / n, 0.25) for i in range(n)]
        ground = LayeredHalfSpace(steps, HalfSpace(2.0, 0.25))
        # displacements refer to the modulus of the first layer
        found = np.array(ground.strata.amplitudes(K, depths))
        found[2:] /= steps[0].young
        errors.append(np.abs(found - exact).max())
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


def test_equations_of_waves_in_a_gradient():
    """u' = k w + t / mu, w' = -n k u + s / M, s' = -k t, t' = k^2 E' u + n k s by differences."""
    h = 1e-3
    z = 0.7 + h * np.arange(-3, 4)
    found = np.array(LINEAR.strata.amplitudes(K, z))
    rate = np.einsum("z,qzk->qk", np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * h), found)
    (t, s, u, w), E, nu = found[:, 3], 1.7, 0.25
    n, oedometric = nu / (1 - nu), E * (1 - nu) / (1 + nu) / (1 - 2 * nu)
    expected = [
        K * (E / (1 - nu**2) * u + n * s),
        -K * t,
        K * (w + 2 * (1 + nu) / E * t),
        K * (-n * u + s / oedometric),
    ]
    assert rate == pytest.approx(np.array(expected), abs=2e-8)


def test_moduli_at_depths():
    strata = layered(LINEAR).strata
    ratio, nu = strata.moduli(np.array([0.1, 0.5, 0.6, 1.2, 1.2 + 1.0]))
    assert ratio == pytest.approx([1, 1, 8, 8, 2])
    assert nu == pytest.approx([0.2, 0.2, 0.5, 0.5, 0.25])
    assert strata.interfaces == pytest.approx([0.5, 1.2, np.inf])
