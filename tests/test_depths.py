"""Tables of influence below the surface, against integrals over waves of other origin."""

import burmister
import numpy as np
import pytest
from marks import slow
from scipy.integrate import simpson
from scipy.special import jv

from skfem_dual import ConvergenceError, GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace
from skfem_dual.ground import depths
from skfem_dual.ground.depths import BITS, DEGREE, DepthTables, uniform_amplitudes

CRUST = LayeredHalfSpace([Layer(0.5, 10.0, 0.3)], HalfSpace(1.0, 0.45))
R = np.array([0.0, 0.01, 0.3, 1.0, 4.0, 19.0])


def table_values(tables, i, r):
    """The quantities of a table, in plain Python."""
    v = 1 + (r / tables.d) ** 2
    mantissa, exponent = np.frexp(v)
    part = (2 * mantissa - 1) * 2**BITS
    panel = ((exponent - 1) * 2**BITS + np.floor(part)).astype(int)
    t = 2 * (part - np.floor(part)) - 1
    powers = t[:, None] ** np.arange(DEGREE + 1)
    return np.einsum("rp,rpq->qr", powers, tables.coefficients[i, panel])


@pytest.mark.parametrize("z", [0.4, *slow(0.05, 0.5, 2.0)])
def test_layer_on_half_space(z):
    """Of Burmister's stress function, the integrals by Simpson's rule."""
    x = np.linspace(0, 1, 3001)[1:]
    length = 1 - z if z < 0.5 else z
    k = 45 * x**2 / length
    layers = [(0.5, 10.0, 0.3), (np.inf, 1.0, 0.45)]
    there = np.moveaxis([burmister.amplitudes(layers, None, q, z) for q in k], 0, 1)
    there[2:] *= 10.0
    alone = np.array(uniform_amplitudes(k, np.array([z]), 0.3))[:, 0]

    def symbols(a, ratio, nu):
        t, s, u, w = a
        both = ratio / (1 - nu) * u + 2 * nu / (1 - nu) * s
        return np.array([-s, -both, ratio / (1 + nu) * u, -t, w / (10 * k), u / (10 * k)])

    ratio, nu = (1.0, 0.3) if z <= 0.5 else (0.1, 0.45)
    f = (symbols(there, ratio, nu) - symbols(alone, 1.0, 0.3)) * k * 90 * x / length / (2 * np.pi)
    r = R[1:, None]
    waves = [jv(0, k * r), jv(0, k * r), jv(2, k * r) / r**2]
    waves += [jv(1, k * r) / r, jv(0, k * r), jv(1, k * r) / r]
    expected = np.array([simpson(w * q, x=x) for w, q in zip(waves, f, strict=True)])
    # the integral begins at the first wave
    expected[4] += f[4, 0] * x[0] / 2
    tables = DepthTables.from_ground(CRUST, np.array([z]), 20.0)
    found = table_values(tables, 0, R[1:])
    size = np.abs(table_values(tables, 0, R[:1]))
    assert np.abs((found - expected) / size).max() < 2e-6
    assert tables.error < 1e-8


@pytest.mark.parametrize(
    "ground",
    [CRUST, *slow(GradedHalfSpace.init_linear(1.0, 0.25, 1.0))],
    ids=["layer", "linear"],
)
def test_one_table_of_all_depths_or_one_of_each(ground):
    """Their lengths, wave numbers and panels differ."""
    z = np.array([0.3, 3.0])
    together = DepthTables.from_ground(ground, z, 30.0)
    for i in range(2):
        alone = DepthTables.from_ground(ground, z[i : i + 1], 25.0)
        one, other = table_values(alone, 0, R), table_values(together, i, R)
        assert np.abs(one - other).max() / np.abs(one).max() < 1e-7


def test_equal_layers_have_none():
    ground = LayeredHalfSpace([Layer(0.3, 2.0, 0.3), Layer(0.9, 2.0, 0.3)], HalfSpace(2.0, 0.3))
    tables = DepthTables.from_ground(ground, np.array([0.2, 0.3, 1.0, 5.0]), 20.0)
    assert np.abs(tables.coefficients).max() < 1e-9


def test_tables_that_are_not_good_are_refused(monkeypatch):
    monkeypatch.setattr(depths, "TOLERANCE", 1e-15)
    with pytest.raises(ConvergenceError, match=r"at depth 0\.5 and below to 1e-15, got.*Remedy"):
        DepthTables.from_ground(CRUST, np.array([0.5]), 5.0)
