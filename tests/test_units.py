"""Units: pressures and settlements in what engineers read."""

import pytest

from skfem_dual.units import PLAIN, Units


@pytest.mark.parametrize(
    ("text", "pressure", "kilopascals", "displacement", "millimetres"),
    [
        ("kN,m", "kPa", 1.0, "mm", 1000.0),
        ("N,mm", "kPa", 1000.0, "mm", 1.0),
        ("MN, m", "kPa", 1000.0, "mm", 1000.0),
        ("kN,cm", "kPa", 1e4, "mm", 10.0),
        ("N,m", "kPa", 1e-3, "mm", 1000.0),
    ],
)
def test_metric(text, pressure, kilopascals, displacement, millimetres):
    units = Units(text)
    assert (units.pressure.symbol, units.displacement.symbol) == (pressure, displacement)
    assert units.pressure.factor == pytest.approx(kilopascals, rel=1e-14)
    assert units.modulus.factor == pytest.approx(kilopascals / 1000, rel=1e-14)
    assert units.displacement.factor == pytest.approx(millimetres, rel=1e-14)
    assert units.slope.factor == 1000.0


def test_feet_and_inches():
    units = Units("kip,ft")
    assert (units.pressure.symbol, units.pressure.factor) == ("ksf", 1.0)
    assert units.displacement.factor == pytest.approx(12.0, rel=1e-14)
    # 1 psi = 0.144 ksf
    assert Units("lbf,in").pressure.factor == pytest.approx(0.144, rel=1e-12)
    # 1 kip/ft^2 = 47.88 kPa
    metric = Units("N,m").pressure.factor * 4448.2216152605 / 0.3048**2
    assert metric == pytest.approx(47.880259, rel=1e-7)


def test_any_consistent_units():
    assert Units() == PLAIN
    assert not PLAIN.named
    assert {PLAIN.pressure.factor, PLAIN.displacement.factor, PLAIN.slope.factor} == {1.0}


@pytest.mark.parametrize(
    ("text", "message"),
    [("kN", "FORCE,LENGTH"), ("m,kN", "FORCE,LENGTH"), ("kN,ft", "both units metric")],
)
def test_wrong_units(text, message):
    with pytest.raises(ValueError, match=message):
        Units(text)
    with pytest.raises(TypeError, match="text for units"):
        Units(3)


@pytest.mark.parametrize(
    ("symbol", "quantity", "factor"),
    [
        ("MPa", "pressure", 1e3),
        ("kN/m²", "pressure", 1.0),
        ("MN m", "moment", 1e3),
        ("kN-m", "moment", 1.0),
        ("kN.m", "moment", 1.0),
        ("kN⋅m", "moment", 1.0),
        ("kip-ft", "moment", 1.3558179483314004),
        ("mm", "length", 1e-3),
    ],
)
def test_factors_of_other_units(symbol, quantity, factor):
    assert Units("kN,m").factor(symbol, quantity) == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize(
    ("symbol", "quantity"),
    [("kN/m-2", "pressure"), ("kN.m-2", "pressure"), ("kN-", "force"), ("m-1", "length")],
)
def test_signs_are_not_taken_for_products(symbol, quantity):
    with pytest.raises(ValueError, match=f"expected a unit of {quantity} such as"):
        Units("kN,m").factor(symbol, quantity)


@pytest.mark.parametrize(
    ("symbol", "quantity"), [("mN", "force"), ("mPa", "pressure"), ("mNm", "moment")]
)
def test_thousandths_are_not_millions(symbol, quantity):
    with pytest.raises(ValueError, match=r"thousandths of a newton. Remedy: MN"):
        Units("mN,m")
    with pytest.raises(ValueError, match=r"thousandths.* capital M"):
        Units("kN,m").factor(symbol, quantity)


@pytest.mark.parametrize(
    ("text", "meant"),
    [("kn,m", "kN,m"), ("KN, M", "kN,m"), ("Mn,mm", "MN,mm"), ("KIP,ft", "kip,ft")],
)
def test_capitals_do_not_count(text, meant):
    assert Units(text) == Units(meant)
    assert Units(text).text == meant


def test_factors_of_what_is_no_unit():
    for wrong in (("MPa", "density"), (None, "pressure"), ("MPa", 3)):
        with pytest.raises((TypeError, ValueError), match="expected"):
            Units("kN,m").factor(*wrong)
    with pytest.raises(ValueError, match=r"known units, such as Units\(.kN,m.\)"):
        Units().factor("MPa", "pressure")


@pytest.mark.parametrize("symbol", ["mPa", "m Pa", "m·Pa", "m N/m2"])
def test_thousandths_with_a_separator_are_refused_too(symbol):
    with pytest.raises(ValueError, match="thousandths"):
        Units("kN,m").factor(symbol, "pressure")
