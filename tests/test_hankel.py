"""Tables of influence functions from symbols whose transforms are known."""

import numpy as np
import pytest
from scipy.special import k0

from skfem_dual import GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace, Plan
from skfem_dual.ground.compliance import homogeneous, through_graded, through_homogeneous
from skfem_dual.ground.hankel import RadialTable, table_value
from skfem_dual.ground.symbols import Symbol, Tail, wave_numbers

R = np.logspace(-4, 2, 61)


def symbol_of(function, lengths, *, algebraic):
    return Symbol.from_values(function(wave_numbers(lengths)), lengths, algebraic)


def table_of(function, lengths, *, algebraic):
    return RadialTable.from_symbol(symbol_of(function, lengths, algebraic=algebraic), lengths)


def test_single_wave_numbers_see_thin_seams():
    """Between moduli that hardly vary the integration stepped over them."""

    def stiffness(z):
        return 1 - 0.99 * np.exp(-(((z - 5) / 0.02) ** 2))

    smooth = GradedHalfSpace.init_profile(stiffness, 0.3)
    z = np.append(0, np.linspace(4.88, 5.12, 400))
    moduli = stiffness((z[1:] + z[:-1]) / 2)
    layers = [Layer(h, young, 0.3) for h, young in zip(np.diff(z), moduli, strict=True)]
    seam = LayeredHalfSpace(layers, HalfSpace(1.0, 0.3))
    for k in (0.03, 0.1, 0.3):
        assert smooth.symbol(k) == pytest.approx(seam.symbol(k), rel=1e-8)
        assert smooth.symbol([k, 1.0])[0] == pytest.approx(smooth.symbol(k), rel=1e-9)
    assert smooth.symbol(np.full(300, 0.1)) == pytest.approx(seam.symbol(0.1), rel=1e-8)


def test_symbols_are_known_between_and_beyond_their_nodes():
    k = np.logspace(-4, 5, 200)
    decaying = symbol_of(lambda k: np.exp(-k), (1.0, 1.0), algebraic=False)
    assert decaying(k) == pytest.approx(np.exp(-k), abs=1e-12)
    power = symbol_of(lambda k: k / (k * k + 0.49), (1.0, 1.0), algebraic=True)
    assert power(k) == pytest.approx(k / (k * k + 0.49), abs=1e-8)


def test_symbol_that_decays_exponentially():
    """exp(-k) belongs to 1 / sqrt(1 + r^2), whose primitive is sqrt(1 + r^2) - 1."""
    table = table_of(lambda k: np.exp(-k), (1.0, 1.0), algebraic=False)
    omega = table.evaluate(table.omega, R)
    assert 2 * np.pi * omega == pytest.approx(1 / np.hypot(1, R), abs=1e-9)
    primitive = R * table.evaluate(table.primitive_over_r, R)
    # without cancellation for small r
    assert 2 * np.pi * primitive == pytest.approx(R**2 / (1 + np.hypot(1, R)), rel=1e-6)


def test_symbol_that_decays_like_a_power():
    """k / (k^2 + b^2) belongs to K0(b r), with a logarithm at r = 0."""
    b = 0.7
    table = table_of(lambda k: k / (k * k + b * b), (1.0, 1.0), algebraic=True)
    omega = table.evaluate(table.omega, R)
    assert 2 * np.pi * omega * R == pytest.approx(k0(b * R) * R, abs=1e-8)


def test_tail_is_found():
    tail = Tail(3.0, np.array([1.0, -2.0, 0.5, 0.0, 0.3, -0.1]))
    k = np.logspace(-1, 3, 400)
    fitted = Tail.from_values(k, tail.symbol(k), 1.0, 6)
    assert fitted.b == tail.b
    assert fitted.symbol(k[k > 10]) == pytest.approx(tail.symbol(k[k > 10]), rel=1e-9)
    assert Tail.from_values(k, k, 1.0, 0).symbol(k) == pytest.approx(np.zeros(400), abs=0)


def test_kernel_and_table_agree():
    table = table_of(lambda k: np.exp(-k), (1.0, 2.0), algebraic=False)
    values = [table_value(table.omega, table.start, table.width, r) for r in R]
    assert values == pytest.approx(table.evaluate(table.omega, R), rel=1e-13)
    nearest = table_value(table.omega, table.start, table.width, table.nearest)
    assert table_value(table.omega, table.start, table.width, 0.0) == nearest


def test_layer_in_closed_form_solves_the_equation():
    """A homogeneous layer by its exponential and by integration of Riccati's equation."""
    k = np.array([0.3, 1.0, 4.0])
    below = homogeneous(np.full(3, 0.2), 0.4)
    pair = np.tile(np.eye(2), (3, 1, 1)), np.moveaxis(below[[0, 1, 1, 2]].reshape(2, 2, 3), -1, 0)
    exact = through_homogeneous(pair, k * 1.5, 2.0, 0.3)
    moduli = lambda z: (np.full(3, 2.0), np.full(3, 0.3))  # noqa: E731
    path = through_graded(below, k, np.full(3, 1.5), moduli, down=True)
    for found, expected in zip(path, exact, strict=True):
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-10)


def test_tables_and_what_plans_compute_are_read_only():
    """What is computed from them would go stale."""
    table = GradedHalfSpace.init_linear(1.0, 0.3, 1.0).remainder
    plan = Plan.from_polygon([(0, 0), (1, 0, 1.0), (1, 1), (0, 1)])
    for array in (table.omega, table.primitive_over_r, plan.rings[0].box, plan.rings[0].turns):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0.0
