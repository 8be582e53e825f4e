"""A stiffness that has lost digits on its way resists what nothing resists."""

import numpy as np
import pytest
from elastic_bodies import SOIL, bending, kirchhoff
from scipy.io import mmread, mmwrite
from scipy.sparse import diags
from skfem import (
    BilinearForm,
    CellBasis,
    ElementTetP1,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    LinearForm,
    MeshTet,
    MeshTri,
)
from skfem.helpers import dot, grad
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual import DualMesh, ElasticPunch, HalfSpace, column_load, trace
from skfem_dual.grids import generate


@BilinearForm
def net(u, v, _):
    return dot(grad(u), grad(v))


@pytest.fixture(scope="module")
def plate():
    mesh = generate.rectangle(6.0, 4.0, n=32)
    basis, K = kirchhoff(mesh)
    return DualMesh.from_mesh(mesh).basis(), basis, 100 * K


def written(K, digits, folder):
    mmwrite(folder / "K.mtx", K, precision=digits)
    return mmread(folder / "K.mtx", spmatrix=True).tocsr()


@pytest.mark.parametrize("digits", [4, 5, 6, 7, 8])
def test_few_digits_take_no_load(plate, digits, tmp_path):
    """They resisted the tilts of a free plate, and kept up to a fifth of its load."""
    plan, basis, K = plate
    few = written(K, digits, tmp_path)
    with pytest.raises(ValueError, match=r"or of few digits|write them in double precision"):
        ElasticPunch(SOIL, plan, basis, few)
    held = basis.get_dofs().all()  # it is good to its digits
    assert ElasticPunch(SOIL, plan, basis, few, D=held).motions.shape[1] == 0


def test_single_precision_in_text_takes_no_load(plate, tmp_path):
    """Of more digits than it has."""
    plan, basis, K = plate
    single = written(K.astype(np.float32).astype(float), 12, tmp_path)
    with pytest.raises(ValueError, match=r"or of few digits|write them in double precision"):
        ElasticPunch(SOIL, plan, basis, single)


@pytest.mark.parametrize("size", [12345, 12345678])
def test_springs_beside_numbers_of_few_digits_hold(size):
    """A net of integers on springs at its corners, which carry most of the load."""
    basis = CellBasis(MeshTri.init_tensor(*[np.linspace(0, 1, 11)] * 2), ElementTriP1())
    K = BilinearForm(lambda u, v, _: 2 * dot(grad(u), grad(v))).assemble(basis)
    corners = np.isin(basis.doflocs, [0, 1]).all(axis=0)
    K.data = K.data.round()
    K = size * K.astype(int) + diags(100.0 * corners).astype(int)
    f = LinearForm(lambda v, _: 121.0 * v).assemble(basis)
    plan = DualMesh.from_mesh(basis.mesh).basis()
    whole, real = (
        ElasticPunch(HalfSpace(100.0, 0.0), plan, basis, k).solve(f) for k in (K, K.astype(float))
    )
    assert real.force == pytest.approx(whole.force)
    springs = 100 * real.displacement[corners].sum()
    assert real.force + springs == pytest.approx(121.0, rel=1e-8)
    assert springs > real.force


@pytest.mark.parametrize("digits", [12, 17])
def test_many_digits_carry_all(plate, digits, tmp_path):
    plan, basis, K = plate
    f = column_load(basis, (0.3, -0.5), 500.0)
    solution = ElasticPunch(SOIL, plan, basis, written(K, digits, tmp_path)).solve(f)
    assert solution.success
    assert solution.force == pytest.approx(500, rel=1e-9)


@pytest.mark.parametrize("held", [False, True])
def test_softness_is_no_rounding(held):
    """A long slab, of entries with few digits that are exact, bends by as little."""
    axes = (0.5 * np.arange(n) for n in (25, 9, 2))
    mesh = MeshTet.init_tensor(*axes).with_boundaries({"base": lambda x: x[2] == 0})
    basis = CellBasis(mesh, ElementVector(ElementTetP1()))
    K = linear_elasticity(*lame_parameters(30e6, 0.25)).assemble(basis)
    f = LinearForm(lambda v, w: -25.0 * v[2]).assemble(basis)
    D = basis.get_dofs(lambda x: x[0] == 0) if held else None
    plan = CellBasis(trace(mesh, "base"), ElementTriP0())
    exact, near = (
        ElasticPunch(HalfSpace(30e3, 0.3), plan, basis, k, boundary="base", D=D).solve(f)
        for k in (K, (1 + 1e-13) * K)
    )
    assert exact.success
    assert exact.cell_deflections == pytest.approx(near.cell_deflections, rel=1e-6)


def test_numbers_that_end_early_are_not_rounded():
    """Those of uniform grids do in decimals; and weak springs beside them hold."""
    basis = CellBasis(MeshTri().refined(2), ElementTriP1())
    K = BilinearForm(lambda u, v, _: 1250.625 * dot(grad(u), grad(v))).assemble(basis)
    plan = DualMesh.from_mesh(basis.mesh).basis()
    assert ElasticPunch(SOIL, plan, basis, K).compliance.motions.shape[1] == 1
    weak = K + diags([1e-2] * basis.N)  # above the last decimal
    assert ElasticPunch(SOIL, plan, basis, weak).compliance.motions.shape[1] == 0


@pytest.mark.parametrize("element", [ElementTriP2(), ElementTriMorley()])
def test_piles_inside_of_elements_hold(element):
    """Their forces go to and fro between DOFs, as those of rounding do."""
    basis = CellBasis(generate.rectangle(4.0, 4.0, n=60), element)
    bend = isinstance(element, ElementTriMorley)
    K = 2e5 * (bending if bend else net).assemble(basis)
    pile = basis.probes(np.array([[0.31], [0.17]]))
    f = LinearForm(lambda v, _: 50.0 * v).assemble(basis)
    plan = DualMesh.from_mesh(basis.mesh).basis()
    found = ElasticPunch(HalfSpace(30e3, 0.3), plan, basis, K + 1e4 * pile.T @ pile).solve(f)
    assert found.success
    taken = 1e4 * (pile @ found.displacement)[0]
    assert taken > 1.0
    assert found.force + taken == pytest.approx(
        f @ basis.project(lambda x: 1 + 0 * x[0]), rel=1e-6
    )
