"""Settlements under weighted cells against independent quadrature."""

from dataclasses import replace

import numpy as np
import pytest
from marks import slow
from plans import perturbed, rectangle
from scipy.integrate import quad
from skfem import CellBasis, ElementQuad0, ElementTriP0, ElementTriP1, MeshQuad, MeshTri

from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace
from skfem_dual.elements.edge_correction import EdgeCorrection
from skfem_dual.elements.edge_weights import EdgeWeights
from skfem_dual.elements.influence import influence_matrix
from skfem_dual.elements.law_moments import LawFactors, Triangles, law_moments
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.outline import edge_ribs
from skfem_dual.grids.partition import Partition
from skfem_dual.ground.rigid_disc import edge_law
from skfem_dual.kernels.compiled import inputs
from skfem_dual.post.regular import TorsionWeights


def weighted_settlement(p, root, x):
    """Integral of phi^(-1/2) / r over a triangle with a vertex on the point x.

    Along a ray of length R from x the integrand is 1/sqrt(phi), phi linear: the integral over
    the ray is 2 R / (sqrt(phi(0)) + sqrt(phi(R))), what remains is one-dimensional.
    """
    a, b = p[:, 1] - x, p[:, 2] - x
    d = b - a
    cross = a[0] * b[1] - a[1] * b[0]

    def ray(t):
        point = a + t * d
        phi = (1 - t) * root[1] ** 2 + t * root[2] ** 2
        return 2 * cross / np.hypot(*point) / (root[0] + np.sqrt(phi))

    foot = float(np.clip(-(a @ d) / (d @ d), 0, 1))
    return sum(
        quad(ray, lower, upper, epsrel=1e-10, limit=200)[0]
        for lower, upper in ((0, foot), (foot, 1))
        if upper - lower > 1e-12  # a foot that is an end but for rounding
    )


def settlement_of_cell(weights, j, x):
    """Of w / mean(w) on cell j, E* = 1, by splitting its triangles at the point."""
    fan = weights.fan
    total = 0.0
    for triangle in range(fan.starts[j], fan.starts[j + 1]):
        t = fan.t[:, triangle]
        phi_x = fan.coordinates(np.array([triangle]), x[:, None])[:, 0] @ weights.root[t] ** 2
        for k in range(3):
            i, o = t[k], t[(k + 1) % 3]
            p = np.column_stack([x, fan.p[:, i], fan.p[:, o]])
            area = np.linalg.det(p[:, 1:] - p[:, :1])
            if abs(area) > 1e-15:
                root = np.array([np.sqrt(max(phi_x, 0)), weights.root[i], weights.root[o]])
                total += weighted_settlement(p, root, x)
    return total / (weights.mean[j] * np.pi)


def weights_of(basis):
    partition = Partition.from_basis(basis)
    return EdgeWeights.from_basis(basis, partition, edge_ribs(partition))


def weights_of_square(n):
    return weights_of(DualMesh.from_mesh(perturbed(rectangle(n), 0.2 / n)).basis())


@pytest.fixture
def by_strips(monkeypatch):
    """Strips in all weighted cells, at all points, as many as are asked for."""
    monkeypatch.setattr("skfem_dual.elements.edge_correction.IN_STRIPS", 1e9)
    monkeypatch.setattr("skfem_dual.elements.law_strips.STEEP", 0.0)
    monkeypatch.setattr("skfem_dual.elements.near_sums.BESIDE", 1e9)
    return lambda most: monkeypatch.setattr("skfem_dual.elements.law_strips.STRIPS", most)


@pytest.mark.parametrize(
    "weights",
    [
        weights_of_square(3),
        *slow(weights_of(DualMesh.from_mesh(MeshTri.init_lshaped().refined(1)).basis())),
        weights_of(CellBasis(perturbed(rectangle(3), 0.05), ElementTriP0())),
        weights_of(CellBasis(MeshQuad().refined(2), ElementQuad0())),
    ],
    ids=["dual cells", "re-entrant", "triangles", "squares"],
)
def test_own_settlement_equals_quadrature(weights, request):
    """In the cell's own centroid: polynomials and strips against a quadrature that has none.

    The point must lie in all triangles' half-planes for phi to stay positive on the rays, so the
    cells are taken whose triangles each see it with positive phi.
    """
    partition, fan = weights.partition, weights.fan
    x = partition.centroids
    uniform = influence_matrix(HalfSpace(1.0, 0.0), partition, x)
    coarse, fine = uniform.copy(), uniform.copy()
    EdgeCorrection.from_weights(weights, 1 / np.pi, x).add_to(coarse)
    request.getfixturevalue("by_strips")(100)
    EdgeCorrection.from_weights(replace(weights), 1 / np.pi, x).add_to(fine)
    tested = 0
    for j in np.nonzero(weights.weighted)[0]:
        triangles = np.arange(fan.starts[j], fan.starts[j + 1])
        phi = np.sum(
            fan.coordinates(triangles, np.tile(x[:, j : j + 1], len(triangles)))
            * weights.root[fan.t[:, triangles]] ** 2,
            axis=0,
        )
        if (phi > 0).all():
            exact = settlement_of_cell(weights, j, x[:, j])
            assert coarse[j, j] == pytest.approx(exact, rel=5e-3)
            assert fine[j, j] == pytest.approx(exact, rel=5e-6)
            tested += 1
    assert tested > 3


@pytest.mark.parametrize(
    "law", [None, edge_law(LayeredHalfSpace([Layer(0.05, 1.0, 0.25)], "bonded"), 1.0)]
)
def test_strips_carry_no_load_of_their_own(law, by_strips):
    """Far away they are the dipoles of the cells; also in triangles along which phi is constant,
    or nearly so."""
    mesh = rectangle(12)
    basis = DualMesh.from_mesh(mesh).basis()
    partition, fan = Partition.from_basis(basis), Fan.from_basis(basis)
    linear = CellBasis(mesh, ElementTriP1())
    phi = linear.probes(fan.p) @ (1 - np.abs(mesh.p).max(axis=0)).clip(0)
    weights = TorsionWeights(partition, fan, np.empty(0), phi, law=law)
    assert (np.ptp(weights.root[weights.fan.t], axis=0) < 1e-12).any()
    x = np.array([[12.0], [8.0]])
    near = EdgeCorrection.from_weights(weights, 1.0, x).near.toarray()
    assert np.abs(near * np.hypot(*x) / partition.areas).max() < 2e-5


def test_far_settlement_is_that_of_the_weighted_centroid():
    weights = weights_of_square(6)
    partition = weights.partition
    soil = HalfSpace(1.0, 0.0)
    x = np.array([[30.0, -20.0, 3.0], [1.0, 40.0, -50.0]])
    D = influence_matrix(soil, partition, x)
    EdgeCorrection.from_weights(weights, soil.singular_coefficient, x).add_to(D)
    r = np.hypot(*(x[:, :, None] - weights.centroids[:, None]))
    assert pytest.approx(partition.areas * soil.influence(r), rel=3e-5) == D


def test_apply_equals_the_dense_correction():
    weights = weights_of_square(8)
    partition = weights.partition
    rng = np.random.default_rng(0)
    x = np.hstack([partition.centroids, rng.uniform(-1.5, 1.5, (2, 50)), partition.nodes])
    correction = EdgeCorrection.from_weights(weights, 1.0, x)
    dense = np.zeros((x.shape[1], len(partition)))
    correction.add_to(dense)
    q = rng.standard_normal(len(partition))
    assert correction.apply(q) == pytest.approx(dense @ q, abs=1e-13)
    nowhere = EdgeCorrection.from_weights(weights, 1.0, np.empty((2, 0)))
    assert [nowhere.apply(p).shape for p in (q, np.ones((len(q), 2)))] == [(0,), (0, 2)]
    # linear cost: as many near entries for each cell on any mesh
    assert correction.near.nnz < 40 * len(partition)


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_far_settlements_equal_strips(grid, request):
    """Where the exact correction ends the series takes over almost without a step."""
    dual = DualMesh.from_mesh(perturbed(rectangle(8), 0.02))
    weights = weights_of(dual.basis() if grid == "dual" else dual.primal_basis())
    x, areas = weights.partition.centroids, weights.partition.areas
    found, exact = np.zeros((2, x.shape[1], len(areas)))
    EdgeCorrection.from_weights(weights, 1.0, x).add_to(found)
    request.getfixturevalue("by_strips")(12)
    EdgeCorrection.from_weights(replace(weights), 1.0, x).add_to(exact)
    r = np.hypot(*(x[:, :, None] - x[:, None]))
    off = np.abs(found - exact) * r / areas
    distance = r / weights.partition.polygons.radii
    for nearer, farther, most in ((2, 3, 1e-3), (3, 6, 1e-4), (6, 99, 1e-5)):
        some = (nearer < distance) & (distance < farther)
        assert some.any()
        assert off[some].max() < most


def test_moments_are_those_of_triangles():
    """First ones against divided differences; a law that is nearly constant has next to none."""
    weights = weights_of(DualMesh.from_mesh(perturbed(rectangle(8), 0.02)).basis())
    first = np.stack([weights.moments[1, 0], weights.moments[0, 1]])
    of_cells = weights.moment[:, weights.weighted]
    assert first == pytest.approx(of_cells, abs=1e-13 * np.abs(of_cells).max())
    p = np.array([[0.0, 3.0, 1.0], [0.0, 0.0, 2.0]])
    root, one = np.sqrt([1.0, 1.0 + 1e-9, 1.0 - 1e-9]), np.array([1.0])
    law = LawFactors(*inputs(np.ones((1, 2)), np.zeros(1), np.zeros(1, np.int32)))
    t = np.array([[0], [1], [2]], np.int32)
    triangles = Triangles(*inputs(p, t, root, np.array([0, 1]), one), law)
    found = law_moments(triangles, np.zeros((2, 1)), np.zeros(1, dtype=np.int32))
    assert np.abs(found).max() < 1e-8


def test_points_next_to_centroids():
    """Nodes of a regular mesh are centroids of dual cells but for rounding."""
    grid = np.linspace(-1, 1, 9)
    weights = weights_of(DualMesh.from_mesh(MeshTri.init_tensor(grid, grid)).basis())
    centroids = weights.partition.centroids[:, weights.weighted]
    at, near = (
        EdgeCorrection.from_weights(weights, 1.0, np.ascontiguousarray(x)).apply(np.ones(81))
        for x in (centroids, centroids + 1e-16)
    )
    assert near == pytest.approx(at, rel=1e-6, abs=1e-9)


def test_strips_are_kept_or_cut_when_needed(monkeypatch):
    weights = weights_of_square(5)
    x = weights.partition.centroids
    kept = EdgeCorrection.from_weights(weights, 1.0, x)
    assert len(weights.strips.segments) > 0
    monkeypatch.setattr("skfem_dual.elements.law_strips.KEPT", 0)
    weights = replace(weights)
    cut = EdgeCorrection.from_weights(weights, 1.0, x)
    assert len(weights.strips.segments) == 0
    np.testing.assert_array_equal(cut.near.toarray(), kept.near.toarray())
