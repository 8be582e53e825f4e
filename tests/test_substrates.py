import numpy as np
import pytest
from scipy.integrate import quad

from skfem_dual import GradedHalfSpace, HalfSpace


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


def test_table_of_ground_that_stiffens_fast():
    """Its slope at the surface tells the wave numbers that count."""
    ground = GradedHalfSpace.init_exponential(1.0, 0.3, ratio=10.0, length=0.05)
    assert ground.error < 1e-9
    same = GradedHalfSpace.init_profile(lambda z: 10 - 9 * np.exp(-z / 0.05), 0.3, length=0.002)
    assert ground.influence(np.logspace(-3, 0, 7)) == pytest.approx(
        same.influence(np.logspace(-3, 0, 7)), rel=1e-8
    )
