"""Points in circles against all pairs."""

import numpy as np
import pytest

from skfem_dual.grids.nearby import in_circles


@pytest.mark.parametrize("few", [0, 2**20])
@pytest.mark.parametrize("spread", [0, 3, 15])
def test_against_all_pairs(spread, few, monkeypatch):
    """Circles whose radii lie ``spread`` powers of ten apart, also beside all points, by squares
    and without."""
    monkeypatch.setattr("skfem_dual.grids.nearby.FEW", few)
    rng = np.random.default_rng(spread)
    x = rng.normal(size=(2, 300)) * 10 ** rng.uniform(-spread, 0, 300) + 1e3
    centres = np.hstack([x[:, :100], rng.uniform(-9, 9, (2, 50)) + 1e3, [[1e9, 0], [1e3, -1e9]]])
    radii = 10 ** rng.uniform(-spread, 1, centres.shape[1])
    points, offsets = in_circles(radii, centres, x)
    d = x[:, None] - centres[:, :, None]
    inside = np.sum(d * d, axis=0) <= radii[:, None] ** 2
    assert 0 < inside.sum() < inside.size
    assert offsets[-1] == inside.sum()
    for k, own in enumerate(inside):
        assert sorted(points[offsets[k] : offsets[k + 1]]) == np.nonzero(own)[0].tolist()


def test_none():
    """No points, no circles, circles that are points, and one point on the edge of its circle."""
    one, none = np.zeros((2, 1)), np.empty((2, 0))
    assert [len(part) for part in in_circles(np.ones(1), one, none)] == [0, 2]
    assert [len(part) for part in in_circles(np.empty(0), none, one)] == [0, 1]
    assert in_circles(np.zeros(1), one, one)[0].tolist() == [0]
    assert in_circles(np.ones(1), one, np.array([[1.0], [0.0]]))[0].tolist() == [0]
