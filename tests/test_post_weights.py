"""Weights by cross-validation, and Table 2 of the paper."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import MeshTri

from skfem_dual import DualMesh, rectangular_couple
from skfem_dual.post.functional import CoupleFunctional, Neighbours
from skfem_dual.post.smooth import smooth_couple
from skfem_dual.post.weights import gcv_weights, smoothing_weights


@pytest.fixture
def table2(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "examples")
    yield importlib.import_module("ex18_table2")
    sys.modules.pop("ex18_table2", None)


def test_errors_of_table_2(table2):
    """The reading with sums has the printed errors of the second grid, that with means has not."""
    found = table2.table(30)
    for name, row in table2.ROWS.items():
        sums, means = found["sums", name], found["means", name]
        # uniform errors have the standard deviation q / sqrt(3)
        assert sums[:2, 0] == pytest.approx(row.q / np.sqrt(3), rel=0.03)
        (mean, spread), printed = sums[3], row.paper[3]
        assert abs(mean - printed) < 3.5 * spread
        assert abs(means[3, 0] - printed) > 2 * means[3, 1]
        assert abs(mean - printed) < 0.5 * abs(means[3, 0] - printed)


def test_ratio_of_weights_and_density(table2):
    """Best: a big ratio for f1, 1 for f2, a small one for f3, says the paper; denser is better."""
    found = table2.gains(10)
    gains = {(name[:2], k): g for (reading, name, k), g in found.items() if reading == "sums"}
    best = {name: table2.RATIOS[int(np.argmax(gains[name, 11]))] for name in ("f1", "f2", "f3")}
    one = table2.RATIOS.index(1)
    assert best["f1"] == max(table2.RATIOS)
    assert gains["f2", 11][one] > 0.99 * gains["f2", 11].max()
    assert best["f3"] == 1 / 4
    for name in ("f1", "f2", "f3"):
        assert gains[name, 6].max() < gains[name, 11].max() < gains[name, 21].max()
    # read with means, f3 wants a big ratio as well
    means = {
        name[:2]: g for (reading, name, k), g in found.items() if (reading, k) == ("means", 11)
    }
    assert table2.RATIOS[int(np.argmax(means["f3"]))] == 4


@pytest.mark.slow
def test_cross_validation_is_near_the_best_weights(table2):
    for chosen, best in table2.cross_validation(2).values():
        assert chosen < 1.07 * best


@pytest.mark.slow
def test_cross_validation_over_many_seeds(table2):
    for chosen, best in table2.cross_validation(100).values():
        assert chosen < 1.05 * best


@pytest.mark.parametrize("exact", [0, 1500])
def test_trace_and_its_estimate_are_near_the_trace(monkeypatch, exact):
    monkeypatch.setattr("skfem_dual.post.weights.EXACT", exact)
    lines = np.linspace(0, 1, 11)
    neighbours = Neighbours.of(rectangular_couple(lines, lines))
    rng = np.random.default_rng(0)
    p = rectangular_couple(lines, lines)
    F, G = (
        np.sin(3 * g.polygons.p[0]) + rng.normal(0, 0.1, n) for g, n in ((p.a, 121), (p.b, 100))
    )
    y, unit = np.concatenate([F, G]), np.eye(221)

    def score(log_ratio):
        functional = CoupleFunctional(neighbours, smoothing_weights(2.0**log_ratio))
        smoother = np.concatenate(functional.minimise(unit[:121], unit[121:]))
        return np.sum((y - smoother @ y) ** 2) / (1 - np.trace(smoother) / 221) ** 2

    logs = np.arange(-3, 7)
    least = min(score(x) for x in logs)
    chosen = np.log2(gcv_weights(neighbours, F, G).D1)
    assert score(chosen) < (1.01 if exact == 0 else 1.002) * least


@pytest.mark.parametrize("exact", [0, 1500])
def test_numbers_of_nodes_do_not_matter(monkeypatch, exact):
    monkeypatch.setattr("skfem_dual.post.weights.EXACT", exact)
    rng = np.random.default_rng(2)
    mesh = MeshTri.init_tensor(np.linspace(0, 2, 9), np.linspace(0, 1, 6))
    nodes, triangles = rng.permutation(mesh.nvertices), rng.permutation(mesh.nelements)
    t = np.argsort(nodes)[mesh.t[:, triangles]]
    grids = [DualMesh.from_mesh(m) for m in (mesh, MeshTri(mesh.p[:, nodes], t))]
    F, G = rng.normal(size=mesh.nvertices), rng.normal(size=mesh.nelements)
    F[mesh.p[0] < 0.8] = G[mesh.p[0, mesh.t].max(axis=0) < 0.8] = 0.0  # as out of contact
    one = smooth_couple(F, G, grids[0])
    other = smooth_couple(F[nodes], G[triangles], grids[1])
    assert_allclose(other.weights.D1, one.weights.D1, rtol=1e-9)
    assert_allclose(other.first, one.first[nodes], atol=1e-12)
    assert_allclose(other.second, one.second[triangles], atol=1e-12)


@pytest.mark.parametrize("exact", [0, 1500])
@pytest.mark.parametrize("factor", [1e-165, 1e160, -1.0])
def test_neither_size_nor_sign_of_values_matters(monkeypatch, exact, factor):
    monkeypatch.setattr("skfem_dual.post.weights.EXACT", exact)
    rng = np.random.default_rng(0)
    lines = np.linspace(0, 1, 7)
    neighbours = Neighbours.of(rectangular_couple(lines, lines))
    F, G = (rng.normal(size=n) for n in neighbours.alpha.shape)
    one, other = (gcv_weights(neighbours, k * F, k * G).D1 for k in (1.0, factor))
    assert other == pytest.approx(one, rel=1e-9)


def test_extremes_of_cross_validation():
    lines = np.linspace(0, 1, 9)
    couple = rectangular_couple(lines, lines)
    neighbours = Neighbours.of(couple)
    p, q = couple.a.polygons.p, couple.b.polygons.p
    rng = np.random.default_rng(0)
    noise = [rng.normal(size=n) for n in neighbours.alpha.shape]
    assert gcv_weights(neighbours, *noise).D1 > 100
    wave = [np.cos(9 * x[0]) * np.cos(8 * x[1]) for x in (p, q)]
    assert gcv_weights(neighbours, *wave).D1 < 0.5
