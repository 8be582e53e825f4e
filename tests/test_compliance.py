import numpy as np
import pytest
from scipy.sparse import block_diag, csc_matrix, diags, random_array
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementTetP1,
    ElementTriArgyris,
    ElementTriMorley,
    ElementVector,
    MeshTet,
    MeshTri,
)
from skfem.helpers import dd, ddot, eye, trace
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_dual.operators.compliance import Compliance

NOTHING = np.empty(0, dtype=int)


@BilinearForm
def bending(u, v, _):
    return ddot(0.8 * dd(u) + 0.2 * eye(trace(dd(u)), 2), dd(v))


def plate(element=None, mesh=None):
    basis = CellBasis(mesh or MeshTri.init_circle(3), element or ElementTriMorley())
    return bending.assemble(basis).tocsc()


def block():
    basis = Basis(MeshTet().refined(2), ElementVector(ElementTetP1()))
    return linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis).tocsc()


def slopes_first():
    """A plate of which DOFs taken by chance are slopes and curvatures only."""
    basis = CellBasis(MeshTri.init_circle(3), ElementTriArgyris())
    K = bending.assemble(basis).tocsc()
    chance = np.argsort(np.random.default_rng(0).random(K.shape[0]))
    others = np.setdiff1d(np.arange(K.shape[0]), slopes := basis.nodal_dofs[1:4].ravel()[:40])
    order = np.empty(K.shape[0], dtype=int)
    order[chance] = np.append(slopes, others)
    return K[order][:, order]


def strip():
    return plate(mesh=MeshTri.init_tensor(np.linspace(0, 30, 121), np.linspace(0, 1, 5)))


def together():
    return block_diag([plate(), block(), 4.0 * plate()], "csc")


@pytest.mark.parametrize(
    ("structure", "motions"),
    [
        (plate, 3),
        (lambda: plate(ElementTriArgyris(), MeshTri.init_circle(2)), 3),
        (strip, 3),
        (slopes_first, 3),
        (block, 6),
        (together, 12),
        (lambda: csc_matrix([[2.0, -1, -1], [-1, 2, -1], [-1, -1, 2]]), 1),
    ],
)
def test_motions_are_those_without_resistance(structure, motions):
    K = structure()
    found = Compliance(K, NOTHING).motions
    assert found.shape == (K.shape[0], motions)
    assert np.linalg.matrix_rank(found) == motions
    forces = np.abs(K) @ np.abs(found)
    assert (np.abs(K @ found) <= 1e-9 * forces.max()).all()


@pytest.mark.parametrize("structure", [plate, block, together])
def test_displacements_balance_the_loads(structure):
    K, rng = structure(), np.random.default_rng(0)
    compliance = Compliance(K, NOTHING)
    loads = K @ rng.standard_normal((K.shape[0], 3))  # without resultants
    found = compliance.displacements(loads)
    assert np.abs(K @ found - loads).max() < 1e-9 * np.abs(loads).max()
    assert compliance.displacements(loads[:, 0]) == pytest.approx(found[:, 0], abs=1e-12)


def test_generalised_inverse_is_symmetric():
    K = plate()
    a, b = np.random.default_rng(1).standard_normal((2, K.shape[0]))
    solve = Compliance(K, NOTHING).displacements
    assert a @ solve(b) == pytest.approx(b @ solve(a), rel=1e-10)


def test_fixed_dofs_stay_and_motions_that_they_allow_remain():
    K = plate()
    held = np.array([0])  # a vertex: two tilts are left
    structure = Compliance(K, held)
    assert structure.motions.shape[1] == 2
    assert (structure.motions[held] == 0).all()
    whole = Compliance(K, np.arange(K.shape[0]))
    assert whole.motions.shape[1] == 0
    assert (whole.displacements(np.ones(K.shape[0])) == 0).all()


def test_units_of_dofs_do_not_matter():
    K, unit = plate(), 10.0 ** np.random.default_rng(2).uniform(-8, 8, plate().shape[0])
    scaled = (diags(unit) @ K @ diags(unit)).tocsc()
    assert Compliance(scaled, NOTHING).motions.shape[1] == 3


def test_digits_of_a_stiffness_do_not_matter():
    """Rigid motions do the work of rounding then, and are none the less without resistance."""
    basis = Basis(MeshTet().refined(2), ElementVector(ElementTetP1()))
    K = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis).tocsc()
    K.data = np.array([float(f"{entry:.11e}") for entry in K.data])
    kinds = np.tile(np.arange(3), basis.N // 3)
    assert Compliance(K, NOTHING, basis.doflocs, kinds).motions.shape[1] == 6


def test_mechanisms_are_refused():
    """200 bars at random hold 600 DOFs."""
    bars = random_array((200, 600), density=0.05, rng=np.random.default_rng(0), format="csc")
    with pytest.raises(ValueError, match="mechanism beyond them among its 600 DOFs"):
        Compliance(csc_matrix(bars.T @ bars), NOTHING)


def test_order_of_elimination_does_not_matter():
    """DOFs of a node together, with less fill."""
    basis = Basis(MeshTet().refined(3), ElementVector(ElementTetP1()))
    K = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis).tocsc()
    alone, together = Compliance(K, NOTHING), Compliance(K, NOTHING, basis.doflocs)
    loads = K @ np.random.default_rng(0).standard_normal(basis.N)
    for structure in (alone, together):
        assert K @ structure.displacements(loads) == pytest.approx(loads, abs=1e-10)
    fill = [s._inverse.factors.L.nnz for s in (together, alone)]
    assert fill[0] < 0.95 * fill[1]


def test_refused():
    K = plate()
    with pytest.raises(ValueError, match=r"negative energy.*signs"):
        Compliance((K - 1e-3 * diags(K.diagonal())).tocsc(), NOTHING)
    with pytest.raises(ValueError, match="positive stiffness of every DOF, got -"):
        Compliance(-K, NOTHING)
    skew = K.tolil()
    skew[3, 5] += 1.0
    with pytest.raises(ValueError, match=r"symmetric stiffness, got K\["):
        Compliance(skew.tocsc(), NOTHING)
    loose = K.tolil()
    loose[7, :] = 0
    loose[:, 7] = 0
    with pytest.raises(ValueError, match=r"got 0 of DOF 7, 1 in all"):
        Compliance(loose.tocsc(), NOTHING)


@pytest.mark.parametrize("seed", range(3))
def test_many_plates_under_one_frame_hang_together(seed):
    """Each turns freely and all settle together: a few DOFs by chance do not hold every one."""
    square = MeshTri.init_tensor(*2 * [np.linspace(0, 1, 4)])
    K, n = plate(mesh=square), 36
    middle = CellBasis(square, ElementTriMorley()).probes(np.array([[0.51], [0.48]]))
    feet, chain = block_diag([middle] * n), diags([1.0, -1.0], [0, 1], shape=(n - 1, n))
    whole = csc_matrix(block_diag([K] * n) + 0.1 * feet.T @ (chain.T @ chain) @ feet)
    order = np.random.default_rng(seed).permutation(whole.shape[0])
    structure = Compliance(csc_matrix(whole[order][:, order]), NOTHING)
    assert structure.motions.shape[1] == 1 + 2 * n
    loads = structure.stiffness @ np.random.default_rng(seed).standard_normal(len(order))
    assert structure.stiffness @ structure.displacements(loads) == pytest.approx(loads, abs=1e-9)
