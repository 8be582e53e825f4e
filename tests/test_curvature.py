"""Pressures of the second degree inside cells: exact functions, quadrature, what is not smooth."""

import numpy as np
import pytest
from plans import perturbed
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshQuad, MeshTri

from skfem_dual import DualMesh
from skfem_dual.elements.curvature import Curvature
from skfem_dual.elements.slopes import Slopes
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.partition import Partition

MESH = perturbed(MeshTri.init_tensor(*[np.linspace(-1, 1, 13)] * 2), 0.02)
BASES = {
    "dual": DualMesh.from_mesh(MESH).basis(),
    "triangles": CellBasis(MESH, ElementTriP0()),
    "quadrilaterals": CellBasis(
        MeshQuad.init_tensor(*[np.linspace(-1, 1, 13)] * 2), ElementQuad0()
    ),
}


def on_cells(basis, p, *coefficients):
    """Slopes, triangles with their midpoints of sides, and means of a function of 2nd degree."""
    slopes, fan = Slopes.from_partition(Partition.from_basis(basis)), Fan.from_basis(basis)
    v = fan.p[:, fan.t]
    x = (v + np.roll(v, 1, axis=1)) / 2  # exact for the second degree
    mean = np.bincount(fan.cell, fan.areas * p(x, *coefficients).mean(axis=0))
    return slopes, fan, x, mean / slopes.partition.areas


def bowl(x, a, b, c, d, e, f):
    return a + b * x[0] + c * x[1] + d * x[0] ** 2 / 2 + e * x[0] * x[1] + f * x[1] ** 2 / 2


@pytest.mark.parametrize("name", BASES)
def test_the_second_degree_is_exact(name):
    slopes, fan, x, mean = on_cells(
        BASES[name], bowl, *(found := (9.0, 0.3, -0.7, -2.0, 0.9, 1.4))
    )
    curved = Curvature.of(slopes, mean)
    known, c = curved.bends.any(axis=0), slopes.partition.centroids
    assert np.sum(~known) <= 2  # in corners
    assert curved.bends[:, known] == pytest.approx(np.array(found[3:])[:, None] + 0 * c[0, known])
    slope = 0.3 - 2.0 * c[0] + 0.9 * c[1]
    assert curved.slopes[0, known] == pytest.approx(slope[known], abs=1e-10)
    pressure = mean[fan.cell] + curved.rise(np.tile(fan.cell, (3, 1)), x - c[:, None, fan.cell])
    own = known[fan.cell]
    assert pressure[:, own] == pytest.approx(bowl(x, *found)[:, own], abs=1e-10)


@pytest.mark.parametrize("name", BASES)
def test_means_are_kept_and_nothing_pulls(name):
    """Of a bump that ends in a kink between the cells."""
    slopes, fan, x, mean = on_cells(BASES[name], lambda x: (0.5 - np.sum(x**2, axis=0)).clip(0))
    curved, c = Curvature.of(slopes, mean), slopes.partition.centroids
    rise = curved.rise(np.tile(fan.cell, (3, 1)), x - c[:, None, fan.cell]).mean(axis=0)
    assert np.abs(np.bincount(fan.cell, fan.areas * rise)).max() < 1e-16
    corners = fan.p[:, fan.t]
    bent = curved.bends.any(axis=0)
    assert 20 < bent.sum() < 0.8 * len(mean)
    pressure = mean[fan.cell] + curved.rise(
        np.tile(fan.cell, (3, 1)), corners - c[:, None, fan.cell]
    )
    assert pressure[:, bent[fan.cell]].min() >= 0


def test_noise_does_not_bend():
    slopes, _, _, mean = on_cells(BASES["dual"], bowl, *np.zeros(6))
    noise = 1 + np.random.default_rng(0).uniform(size=len(mean))
    curved = Curvature.of(slopes, noise)
    assert np.mean(curved.bends.any(axis=0)) < 0.1
    none = slopes.without(np.ones(len(mean), dtype=bool))
    assert not Curvature.of(none, noise).bends.any()
