"""The remainder's integrals over cells, against quadrature of the influence function."""

from itertools import pairwise

import numpy as np
import pytest
from plans import perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, ElementTriP0, MeshTri

from skfem_dual import DualMesh, GradedHalfSpace, HalfSpace, Layer, LayeredHalfSpace
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.elements.influence import influence_matrix, surface_displacement
from skfem_dual.elements.remainder import Pieces
from skfem_dual.grids.outline import edge_ribs
from skfem_dual.grids.partition import Partition

GROUNDS = {
    "graded": GradedHalfSpace.init_linear(2.0, 0.25, 1.5),
    "layered": LayeredHalfSpace([Layer(0.7, 2.0, 0.3)], "bonded"),
}
BASES = {
    "dual": DualMesh.from_mesh(perturbed(rectangle(4), 0.06)).basis(),
    "re-entrant": DualMesh.from_mesh(MeshTri.init_lshaped().refined(1)).basis(),
    "triangles": CellBasis(perturbed(rectangle(3), 0.05), ElementTriP0()),
    "polar": CellBasis(polar(2, 8), ElementQuad0()),
}


def by_quadrature(ground, polygon, x, n=24):
    """Over the signed triangles of the point and the sides; Phi along each ray."""
    gauss, weights = np.polynomial.legendre.leggauss(n)
    total = 0.0
    for a, b in zip(polygon.T - x, np.roll(polygon, -1, axis=1).T - x, strict=True):
        d = b - a
        cross = a[0] * b[1] - a[1] * b[0]
        if abs(cross) <= 1e-13 * (d @ d):
            continue
        foot = float(np.clip(-(a @ d) / (d @ d), 0, 1))
        height = abs(cross) / np.hypot(*d)
        for start, end in ((0, foot), (foot, 1)):
            if end <= start:
                continue
            # panels that shrink towards the foot
            far = np.hypot(*d) * (end - start)
            steps = max(1, int(np.ceil(np.log2(far / height + 1))) + 2)
            edges = np.concatenate([[0.0], 2.0 ** np.arange(-steps, 1)])
            if end == foot:
                edges = 1 - edges[::-1]
            for lower, upper in pairwise(edges):
                s = start + (end - start) * (lower + (upper - lower) * (gauss + 1) / 2)
                r = np.hypot(*(a[:, None] + s * d[:, None]))
                part = (end - start) * (upper - lower) / 2
                total += cross * part * np.sum(weights * ground.primitive(r) / r**2)
    return total


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("name", BASES)
def test_entries_equal_quadrature(name, ground):
    ground, partition = GROUNDS[ground], Partition.from_basis(BASES[name])
    x = np.hstack([partition.centroids, partition.polygons.p[:, ::4]])[:, ::3]
    x = np.hstack([x, [[1.9, 0.1], [0.3, -2.5]]])
    D = influence_matrix(ground, partition, x)
    expected = np.array(
        [
            [by_quadrature(ground, partition.polygons[j], xi) for j in range(len(partition))]
            for xi in x.T
        ]
    )
    # relative to the row, as the error of the far cells is of third order in their size
    scale = np.abs(expected).sum(axis=1, keepdims=True)
    assert np.abs(D - expected).max() < 3e-5 * scale.max()
    near = np.hypot(*(x[:, :, None] - partition.centroids[:, None])) < 0.5
    assert np.abs((D - expected) / scale)[near].max() < 1e-6


def test_finer_cells_meet_the_circle():
    """The sum of all entries is the settlement under a uniform load."""
    ground = GROUNDS["graded"]
    square = Partition.from_basis(DualMesh.from_mesh(rectangle(24)).basis())
    coarse = Partition.from_basis(DualMesh.from_mesh(rectangle(3)).basis())
    x = np.array([[0.0, 0.9, 3.0], [0.0, 0.2, 1.0]])
    whole = [influence_matrix(ground, part, x).sum(axis=1) for part in (square, coarse)]
    assert whole[0] == pytest.approx(whole[1], rel=2e-5)


def test_without_a_matrix():
    ground, partition = GROUNDS["layered"], Partition.from_basis(BASES["dual"])
    rng = np.random.default_rng(0)
    pressure, x = rng.standard_normal(len(partition)), rng.uniform(-2, 2, (2, 300))
    D = influence_matrix(ground, partition, x)
    w = surface_displacement(ground, partition, pressure, x)
    assert w == pytest.approx(D @ pressure, abs=1e-12)


def test_beyond_the_table():
    tiny = GradedHalfSpace.init_linear(1.0, 0.25, 1e9)
    with pytest.raises(ValueError, match="range of the substrate's table"):
        influence_matrix(tiny, Partition.from_basis(BASES["dual"]), [[0.0], [0.0]])


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("name", BASES)
def test_pieces_carry_the_load_of_their_cells(name, weighted):
    """Its sum is the area of the cell, its centroid that of the pressure."""
    partition = Partition.from_basis(BASES[name])
    weights = None
    if weighted:
        weights = EdgeWeights.from_basis(BASES[name], partition, edge_ribs(partition))
        assert weights.weighted.any()
    pieces = Pieces.from_partition(partition, weights)
    middles = (partition if weights is None else weights).centroids
    for j in range(len(partition)):
        total, first = 0.0, np.zeros(2)
        for k in range(pieces.first[j], pieces.last[j]):
            v = pieces.vertices[:, pieces.begin[k] : pieces.end[k]]
            w = np.roll(v, -1, axis=1)
            cross = v[0] * w[1] - v[1] * w[0]
            load = pieces.density[k] * cross.sum() / 2
            centroid = np.sum((v + w) * cross, axis=1) / (3 * cross.sum())
            total += load
            first += load * (centroid + pieces.shift[:, k])
        assert total == pytest.approx(partition.areas[j], rel=1e-12)
        assert first / total == pytest.approx(middles[:, j], abs=1e-12)


def test_homogeneous_ground_has_none():
    assert HalfSpace(1.0, 0.2).remainder is None
