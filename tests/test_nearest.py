"""The nearest points and lines, in pictures."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from skfem_dual.grids import nearest as searched
from skfem_dual.grids.lines import Segments
from skfem_dual.grids.nearest import nearest

RANDOM = np.random.default_rng(5)


@pytest.mark.parametrize("one_by_one", [2**20, 0])
def test_nearest_points(one_by_one, monkeypatch):
    """By trees for each picture; where a picture has fewer points they are infinitely far."""
    monkeypatch.setattr(searched, "ONE_BY_ONE", one_by_one)
    counts = [40, 5, 0, 200]
    for some in (counts, counts[-1:]):
        starts = np.cumsum([0, *some])
        x, at = RANDOM.random((2, starts[-1])), RANDOM.random((2, 60))
        of = RANDOM.integers(0, len(some), 60)
        near, square, share = nearest(x, starts, at, of, 7)
        assert (share == np.isfinite(square)).all()
        for i in range(60):
            own = x[:, starts[of[i]] : starts[of[i] + 1]].T
            m = min(7, len(own))
            assert np.isinf(square[i, m:]).all()
            if m:
                distance, number = cKDTree(own).query(at[:, i], range(1, m + 1))
                assert np.sqrt(square[i, :m]) == pytest.approx(distance, rel=1e-12)
                assert (near[i, :m] - starts[of[i]] == number).all()


def test_lines_of_pictures():
    """As if each picture were alone; infinite without lines."""
    angle = np.linspace(0, 2 * np.pi, 50)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    drawn = [[circle], [], [0.5 * circle, 2 + circle[:, ::-1]]]
    sides = [[line[:, [i, i + 1]] for line in lines for i in range(49)] for lines in drawn]
    ends = np.array([side for picture in sides for side in picture])
    picture = np.repeat(np.arange(3), [len(each) for each in sides])
    lines = Segments.from_ends(ends[..., 0].T, ends[..., 1].T, picture, 3)
    x = RANDOM.uniform(-2, 3, (2, 90))
    of = np.arange(90) % 3
    found = lines.signed_distance(x, of)
    assert np.isinf(found[of == 1]).all()
    for i in (0, 2):
        own = slice(*lines.starts[[i, i + 1]])
        alone = Segments(lines.begin[:, own], lines.end[:, own], np.array([0, len(sides[i])]))
        assert np.array_equal(found[of == i], alone.signed_distance(x[:, of == i]))
    inside = np.hypot(*x[:, of == 0]) < np.cos(np.pi / 49)
    assert (found[of == 0][inside] > 0).all()


@pytest.mark.parametrize("one_by_one", [2**20, 0])
def test_those_tied_have_equal_shares(one_by_one, monkeypatch):
    """On a regular grid in any units and order: 4 around a point, and three eighths of 8."""
    monkeypatch.setattr(searched, "ONE_BY_ONE", one_by_one)
    x = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0), indexing="ij")).reshape(2, -1)
    at = x[:, (x > 1.5).all(axis=0) & (x < 8.5).all(axis=0)] + 0.5
    arm = np.abs(x[:, None] - at[:, :, None])
    exact = 1.0 * (arm.max(axis=0) < 1) + 3 / 8 * (np.sort(arm, axis=0) == [[[0.5]], [[1.5]]]).all(
        0
    )
    of, starts = np.zeros(at.shape[1], dtype=int), np.array([0, 144])
    order = RANDOM.permutation(144)
    for unit, origin in ((1, 0), (0.7, 0), (3e-12, 0), (1 / 3, 0.1)):
        near, _, share = nearest((unit * x + origin)[:, order], starts, unit * at + origin, of, 7)
        shares = np.zeros(exact.shape)
        np.add.at(shares, (np.arange(len(near))[:, None], order[near]), share)
        assert shares == pytest.approx(exact)


@pytest.mark.parametrize("one_by_one", [2**20, 0])
def test_more_tied_than_looked_for_first(one_by_one, monkeypatch):
    """All around the middle of a circle, and none where there are fewer than are looked for."""
    monkeypatch.setattr(searched, "ONE_BY_ONE", one_by_one)
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    circle, middle = np.stack([np.cos(angle), np.sin(angle)]), np.zeros((2, 1))
    near, _, share = nearest(circle, np.array([0, 60]), middle, np.zeros(1, dtype=int), 7)
    assert np.array_equal(np.sort(near), [np.arange(60)])
    assert share == pytest.approx(7 / 60)
    both = np.hstack([circle, circle[:, :3]])
    _, square, share = nearest(both, np.array([0, 60, 63]), np.zeros((2, 2)), np.arange(2), 7)
    assert share.sum(axis=1) == pytest.approx([7, 3])
    assert np.array_equal(np.isinf(square[1]), np.arange(60) >= 3)


def test_the_side_at_sharp_bends():
    """Where segments of very different lengths meet, the nearer middle is that of the shorter."""
    line = np.array([[-1.0, 0.0, 0.001], [0.0, 0.0, 0.01]])
    bend = Segments(line[:, :-1], line[:, 1:], np.array([0, 2]))
    x = np.array([[0.2, -0.4, 0.3], [-0.001, 0.1, -0.1]])
    assert np.array_equal(np.sign(bend.signed_distance(x)), [-1, 1, -1])
    sharp = np.array([[-1.0, 0.0, -0.01], [0.0, 0.0, 0.001]])
    bend = Segments(sharp[:, :-1], sharp[:, 1:], np.array([0, 2]))
    beside = np.array([[0.01, 0.01, 0.001], [0.05, -0.05, 0.2]])
    assert (bend.signed_distance(beside) < 0).all()
