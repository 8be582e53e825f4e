import copy
import pickle

import numpy as np
import pytest
from plans import disc, polar, rectangle
from skfem import (
    BilinearForm,
    CellBasis,
    ElementQuad0,
    ElementTriP0,
    ElementTriP1,
    Functional,
    LinearForm,
    MeshTri,
)

from skfem_dual import CellwiseBasis, DualMesh
from skfem_dual.grids.cellwise import nodal_values


@pytest.fixture(scope="module")
def dual():
    mesh = disc(2).with_subdomains({"right": lambda x: x[0] > 0})
    return DualMesh.from_mesh(mesh.with_boundaries({"upper": lambda x: x[1] > 0}))


@pytest.fixture(params=["dual", "primal"])
def basis(request, dual):
    return CellwiseBasis(dual, request.param)


@BilinearForm
def mass(u, v, _):
    return u * v


@LinearForm
def load(v, w):
    return (w.x[0] + 2.0) * v


def test_forms(basis):
    areas = basis.partition.areas
    M = mass.assemble(basis)
    assert M.shape == (basis.N, basis.N)
    assert M.diagonal() == pytest.approx(areas, rel=1e-12)
    assert abs(M).sum() == pytest.approx(areas.sum())
    assert load.assemble(basis) == pytest.approx((basis.partition.centroids[0] + 2) * areas)
    total = Functional(lambda w: w.p * w.x[0] ** 0).assemble(basis, p=np.arange(1.0 * basis.N))
    assert total == pytest.approx(areas @ np.arange(basis.N))


def test_overlap_of_the_two_grids(dual):
    overlap = mass.assemble(dual.primal_basis(), dual.basis())
    assert overlap.shape == (len(dual), dual.mesh.nelements)
    assert np.asarray(overlap.sum(axis=1)).ravel() == pytest.approx(dual.areas)
    assert np.asarray(overlap.sum(axis=0)).ravel() == pytest.approx(dual.primal_partition.areas)


def test_project_interpolate_interpolator(basis):
    values = np.random.default_rng(0).random(basis.N)
    assert basis.project(basis.interpolate(values)) == pytest.approx(values)
    mean = basis.project(lambda x: 3 * x[0] - x[1])
    c = basis.partition.centroids
    assert mean == pytest.approx(3 * c[0] - c[1], abs=1e-12)
    at = basis.interpolator(values)(0.999 * basis.partition.nodes)
    assert at == pytest.approx(values)


def test_orders_that_scikit_fem_has(dual):
    for make in (dual.basis, dual.primal_basis):
        with pytest.raises(ValueError, match="expected intorder from 0 to 19, got 20"):
            make(intorder=20)
    basis = dual.basis(intorder=19)
    assert basis.dx.sum() == pytest.approx(dual.areas.sum())
    length = basis.boundary(intorder=30).dx.sum()  # facets have rules of any order
    assert length == pytest.approx(basis.boundary().dx.sum())


def test_doflocs_are_centroids(basis):
    assert np.array_equal(basis.doflocs, basis.partition.centroids)


def test_both_share_quadrature_points(dual):
    a, b = dual.basis(intorder=3), dual.primal_basis(intorder=3)
    assert np.array_equal(a.global_coordinates(), b.global_coordinates())
    fine = a.with_element(ElementTriP1())
    assert type(fine) is CellBasis
    assert np.array_equal(a.quadrature[0], fine.quadrature[0])
    x = fine.project(lambda x: x[0])
    assert Functional(lambda w: w.u * w.p).assemble(a, u=fine.interpolate(x), p=a.ones()) == (
        pytest.approx(0, abs=1e-12)
    )


def test_with_element_keeps_the_numbering_of_constants(basis):
    again = basis.with_element(ElementTriP0())
    assert again.N == basis.N
    assert np.array_equal(again.element_dofs, basis.element_dofs)
    part = basis.with_elements("right").with_element(ElementTriP1())
    assert part.nelems == basis.with_elements("right").nelems < basis.nelems


def test_with_elements_keeps_the_numbering(basis):
    part = basis.with_elements("right")
    assert isinstance(part, CellwiseBasis)
    assert part.N == basis.N
    area = Functional(lambda w: 1.0 + 0 * w.x[0])
    v = basis.mesh.p[:, basis.mesh.t[:, basis.mesh.subdomains["right"]]]
    expected = np.abs(
        (v[0, 1] - v[0, 0]) * (v[1, 2] - v[1, 0]) - (v[0, 2] - v[0, 0]) * (v[1, 1] - v[1, 0])
    ).sum()
    assert area.assemble(part) == pytest.approx(expected / 2)
    assert np.count_nonzero(mass.assemble(part).diagonal()) < basis.N


def test_boundary_keeps_the_numbering(basis):
    values = np.arange(1.0 * basis.N)
    trace = basis.boundary("upper")
    assert trace.N == basis.N
    found = Functional(lambda w: w.p).assemble(trace, p=trace.interpolate(values))
    mesh = basis.dual.mesh
    facets = mesh.boundaries["upper"]
    a, b = mesh.p[:, mesh.facets[:, facets]].swapaxes(0, 1)
    ends = values[mesh.facets[:, facets]].mean(axis=0)
    cells = ends if basis.grid == "dual" else values[mesh.f2t[0, facets]]
    assert found == pytest.approx(np.hypot(*(b - a)) @ cells)
    with pytest.raises(NotImplementedError, match="whole basis"):
        basis.with_elements([0]).boundary()


def test_pickle(basis):
    again = pickle.loads(pickle.dumps(basis))
    assert again.grid == basis.grid
    assert np.array_equal(again.element_dofs, basis.element_dofs)
    assert mass.assemble(again).diagonal() == pytest.approx(basis.partition.areas)


def test_plot(basis):
    axes = basis.plot(basis.doflocs[0])
    assert axes.collections
    import matplotlib.pyplot as plt

    plt.close(axes.figure)


def test_get_dofs_speaks_of_elements_and_answers_cells(basis):
    cells = basis.get_dofs(elements=[0, 1]).flatten()
    assert np.array_equal(cells, np.unique(basis.element_dofs[0, :2]))


def test_the_other_name_is_refused(dual):
    with pytest.raises(ValueError, match='"dual" or "primal", got \'both\''):
        CellwiseBasis(dual, "both")


def test_nodal_values(dual):
    values = np.random.default_rng(0).random(len(dual))
    nodal, at_nodes = nodal_values(dual.basis(), values)
    assert nodal.mesh is dual.mesh
    assert np.array_equal(at_nodes, values)
    # on triangles: exact for constants, second order for linear fields on symmetric meshes
    primal = dual.primal_basis()
    assert nodal_values(primal, primal.ones())[1] == pytest.approx(1.0)
    square = DualMesh.from_mesh(rectangle(8))
    x = square.primal_partition.centroids[0]
    nodal, at_nodes = nodal_values(square.primal_basis(), x)
    inner = square.mesh.interior_nodes()
    assert at_nodes[inner] == pytest.approx(square.mesh.p[0, inner])


def test_nodal_values_of_quadrilaterals_and_bad_lengths(dual):
    basis = CellBasis(polar(4, 12), ElementQuad0())
    nodal, values = nodal_values(basis, basis.ones())
    assert values == pytest.approx(1.0)
    assert len(values) == nodal.N
    with pytest.raises(ValueError, match=r"shape \(48,\), got \(3,\)"):
        nodal_values(basis, np.ones(3))
    with pytest.raises(ValueError, match=r"expected values of shape \(\d+,\), got \(3, "):
        nodal_values(dual.basis(), np.ones((3, dual.basis().N)))


def test_two_parts_of_a_mesh():
    m = MeshTri().refined(1)
    both = MeshTri(np.hstack([m.p, m.p + 3]), np.hstack([m.t, m.t + m.p.shape[1]]).copy())
    basis = DualMesh.from_mesh(both).basis()
    assert mass.assemble(basis).diagonal().sum() == pytest.approx(2.0)


def test_refinement_and_quadrature_wait_until_they_are_asked_for():
    dual = DualMesh.from_mesh(MeshTri().refined(2))
    basis = dual.basis()
    assert len(dual) == basis.N
    assert basis.partition is dual.partition
    assert "refinement" not in dual.__dict__
    assert "CellwiseBasis" in repr(basis)
    assert "refinement" in dual.__dict__
    assert basis.dx.sum() == pytest.approx(1.0)
    for name in ("basis", "nelems", "X", "doflocs", "mapping"):
        assert getattr(dual.basis(), name) is not None
    with pytest.raises(AttributeError, match="no attribute 'normals'"):
        basis.normals  # noqa: B018
    assert len(copy.copy(dual.basis()).dx) == dual.refinement.nelements


def test_boundaries_fill_a_mapping_of_their_own():
    """That of the basis may be shared by threads, which would fill it together."""
    basis = DualMesh.from_mesh(MeshTri.init_circle(2)).basis()
    assert basis.boundary().mapping is not basis.mapping
    assert not basis.mapping.__dict__.get("_B")


def test_states_do_not_grow_while_they_are_pickled(dual):
    basis = dual.basis()
    state = basis.__getstate__()
    _ = basis.dofs
    assert len(state) < len(basis.__getstate__())


@pytest.mark.parametrize(
    "elements",
    [
        {0, 1},
        [lambda x: x[0] < 0.5],
        (lambda x: x[0] < 0.5, [0, 1]),
        [np.array([0, 1]), {3}],
        [[0, 1], [2]],
    ],
)
def test_parts_of_elements_as_scikit_fem_takes_them(elements):
    dual = DualMesh.from_mesh(MeshTri().refined(2))
    plain = CellBasis(dual.refinement, ElementTriP0(), elements=elements)
    assert np.array_equal(dual.basis().with_elements(elements).tind, plain.tind)


@pytest.mark.parametrize("elements", ["a", ["a"], [["a"]]])
def test_parts_of_elements_that_are_none(elements):
    with pytest.raises(ValueError, match=r"expected tags among \[\] for elements, got 'a'"):
        DualMesh.from_mesh(MeshTri().refined(1)).basis().with_elements(elements)


@pytest.mark.parametrize(
    "elements",
    [
        np.arange(48) < 5,
        list(np.arange(5)),
        tuple(np.arange(5)),
        range(5),
        [np.arange(48) < 3, [3, 4]],
        [np.int64(4), 0, 1, 2, 3],
    ],
)
def test_masks_and_integers_of_numpy_are_parts_of_elements(elements):
    basis = DualMesh.from_mesh(MeshTri().refined(1)).basis()
    part = CellwiseBasis(basis.dual, elements=elements)
    assert part.tind.tolist() == list(range(5)) == basis.with_elements(elements).tind.tolist()
    assert basis.with_elements(np.int64(3)).tind.tolist() == [3]


@pytest.mark.parametrize("made", [lambda x: True, lambda x: x > 0, lambda x: np.arange(3)])
def test_functions_that_return_no_mask_are_refused(made):
    basis = DualMesh.from_mesh(MeshTri().refined(1)).basis()
    with pytest.raises(ValueError, match=r"a mask of shape \(48,\) .* for elements, got shape"):
        basis.with_elements(made)
    with pytest.raises(ValueError, match=r"for midpoints of shape \(2, \d+\) for facets"):
        basis.boundary(made)


def test_masks_and_lists_are_parts_of_facets():
    basis = DualMesh.from_mesh(MeshTri().refined(1)).basis()
    facets = basis.mesh.boundary_facets()
    mask = np.isin(np.arange(basis.mesh.nfacets), facets)
    for form in (mask, list(facets), set(facets), tuple(facets)):
        assert np.array_equal(basis.boundary(form).find, np.sort(facets))


@pytest.mark.parametrize(
    "none", [[], np.array([], int), np.zeros(48, bool), lambda x: x[0] > 99, [[], []]]
)
def test_parts_without_elements_are_refused(none):
    basis = DualMesh.from_mesh(MeshTri().refined(1)).basis()
    with pytest.raises(ValueError, match="expected some of the 48 for elements, got none"):
        basis.with_elements(none)
