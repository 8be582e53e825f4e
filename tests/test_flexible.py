import numpy as np
import pytest
from plans import disc
from skfem import CellBasis, ElementTriP1, MeshTri

from skfem_dual import DualMesh, HalfSpace, InfluenceOperator, Layer, LayeredHalfSpace
from skfem_dual.contact.exact import uniform_circle_displacement
from skfem_dual.elements.flexible import flexible_settlement

DUAL = DualMesh.from_mesh(disc(5))
SOIL = HalfSpace(2.0, 0.3)


def test_uniform_circle():
    r = np.array([0.0, 0.5, 1.5, 4.0])
    w = flexible_settlement(SOIL, DUAL.basis(), 3.0, [r, 0 * r])
    assert w == pytest.approx(uniform_circle_displacement(r, 3.0, 1.0, 2.0, 0.3), rel=3e-4)
    rock = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")
    centre = flexible_settlement(rock, DUAL.primal_basis(), 1.0, [[0.0], [0.0]])
    assert centre == pytest.approx([0.8436644949], rel=3e-4)


def test_pressures_of_all_kinds():
    basis = DUAL.basis()
    x = DUAL.centroids[:, ::50]
    linear = flexible_settlement(SOIL, basis, lambda x: 1 + x[0], x)
    assert linear == pytest.approx(flexible_settlement(SOIL, basis, 1 + DUAL.centroids[0], x))
    fine = basis.with_element(ElementTriP1())
    field = fine.interpolate(fine.project(lambda x: 1 + x[0]))
    assert flexible_settlement(SOIL, basis, basis.project(field), x) == pytest.approx(linear)
    assert len(flexible_settlement(SOIL, basis, 1.0)) == basis.N


@pytest.mark.parametrize(
    ("pressure", "message"),
    [
        (np.ones(3), r"one for each of the 2113 cells, got shape \(3,\)"),
        (np.nan, "finite pressure, got nan"),
        (lambda x: x, r"one pressure for each point, got shape \(2, 2113\) for 2113 points"),
        (lambda x: np.nan * x[0], "finite pressure"),
    ],
)
def test_bad_pressures(pressure, message):
    with pytest.raises(ValueError, match=message):
        flexible_settlement(SOIL, DUAL.basis(), pressure)


def test_vectors_of_other_bases_as_lists_and_numbers():
    basis = CellBasis(MeshTri.init_circle(3), ElementTriP1())
    one, x = np.ones(basis.N), [[0.0], [0.1]]
    expected = flexible_settlement(SOIL, basis, one, x)
    for pressure in (one.tolist(), 1.0, (basis, one), lambda x: 1.0 + 0 * x[0]):
        assert flexible_settlement(SOIL, basis, pressure, x) == pytest.approx(expected, rel=1e-12)


def test_bases_on_some_elements_load_these_only():
    """A number or a function pressed on the whole mesh."""
    mesh = MeshTri.init_tensor(np.linspace(0, 3, 7), np.linspace(0, 1, 4))
    half = np.nonzero(mesh.p[0][mesh.t].mean(axis=0) < 1.5)[0][::-1].copy()
    soil, far = HalfSpace(1.0, 0.0), [[1e5], [0.0]]
    basis = CellBasis(mesh, ElementTriP1(), elements=half)
    for pressure in (1.0, np.ones(basis.N), lambda x: 1 + 0 * x[0], (basis, np.ones(basis.N))):
        force = np.pi * 1e5 * flexible_settlement(soil, basis, pressure, far)
        assert force == pytest.approx(1.5, rel=1e-4)
    middles = mesh.p[:, mesh.t[:, half]].mean(axis=1)
    found = flexible_settlement(soil, basis, 1.0)
    assert found == pytest.approx(flexible_settlement(soil, basis, 1.0, middles), rel=1e-12)
    operator = InfluenceOperator(soil, basis, edge="constant")
    assert operator @ np.ones(len(half)) == pytest.approx(found, rel=1e-12)
