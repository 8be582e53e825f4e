"""Influence of horizontal forces on stratified ground."""

import numpy as np
import pytest
from marks import slow
from scipy.special import j0, j1, jv
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementQuad2,
    ElementTriP0,
    ElementVector,
    LinearForm,
    MeshQuad,
    MeshTri,
    condense,
    solve,
)
from skfem.helpers import ddot, sym_grad, trace

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    RigidPunch,
)
from skfem_dual.elements.load_matrix import points_in_pieces
from skfem_dual.elements.tangential import Tractions
from skfem_dual.grids.fan import Fan
from skfem_dual.grids.generate import disc, polygon
from skfem_dual.grids.partition import Partition
from skfem_dual.ground.hankel import BITS, ONE, SQUARES

CRUST = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], HalfSpace(0.2, 0.4))
ROCK = LayeredHalfSpace([Layer(1.0, 1.0, 0.25)], "bonded")
LINEAR = GradedHalfSpace.init_linear(1.0, 0.25, 1.0)


def values(ground, r):
    """The four kernels at distances of shape (m,), shape (4, m)."""
    table, bits = ground.shear, np.square(r).view(np.int64)
    shift = 52 - BITS
    t = (((bits & ((1 << shift) - 1)) | ONE).view(float) - 1) * (2 << BITS) - 1
    powers = t[:, None] ** np.arange(SQUARES + 1)
    return np.einsum("rp,rpq->qr", powers, table.coefficients[(bits >> shift) - table.first])


@pytest.mark.parametrize("k", [0.4, 2.0])
def test_compliance_by_plane_finite_elements(k):
    """Half a wave of load along the surface of two layers on rock, the second with a gradient."""
    layers = [Layer(0.5, 2.0, 0.2), Layer(1.0, 1.0, 0.35, 2.0)]
    ground = LayeredHalfSpace(layers, "bonded")
    x, z = np.linspace(0, np.pi / k, 9), np.linspace(0, 1.5, 13)
    mesh = MeshQuad.init_tensor(x, z)
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=8)

    @BilinearForm
    def stiffness(u, v, w):
        upper = w.x[1] < 0.5
        young = np.where(upper, 2.0, 1 + 2 * (w.x[1] - 0.5))
        nu = np.where(upper, 0.2, 0.35)
        e, f = sym_grad(u), sym_grad(v)
        volume = nu / (1 - 2 * nu) * trace(e) * trace(f)
        return young / (1 + nu) * (ddot(e, f) + volume)

    K = stiffness.assemble(basis)
    surface = basis.boundary(lambda x: x[1] == 0)
    sides = basis.get_dofs(lambda x: (x[0] == 0) | (x[0] == np.pi / k)).all("u^1")
    held = np.union1d(sides, basis.get_dofs(lambda x: x[1] == 1.5).all())
    shear = LinearForm(lambda v, w: v[0] * np.sin(k * w.x[0])).assemble(surface)
    pressure = LinearForm(lambda v, w: v[1] * np.cos(k * w.x[0])).assemble(surface)
    loads = np.column_stack([shear, pressure])
    moved = np.column_stack([solve(*condense(K, f, D=held)) for f in loads.T])
    compliance = loads.T @ moved / (np.pi / k / 2)
    q = ground.strata.compliance(np.array([k]))[:, 0] / (k * 2.0)
    print(compliance, q)
    assert compliance == pytest.approx(np.array([[q[0], q[1]], [q[1], q[2]]]), rel=1e-4)


@pytest.mark.parametrize("ground", [*slow(CRUST), ROCK], ids=["crust", "rock"])
def test_tables_against_integrals(ground):
    nodes, weights = np.polynomial.legendre.leggauss(30)
    edges = np.concatenate([[0.0], np.logspace(-8, -1, 29), np.arange(0.3, 20, 0.6)])
    k = (edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2).ravel()
    weights = (np.diff(edges)[:, None] * weights / 2).ravel() / (2 * np.pi)
    q11, q12, q22 = ground.strata.compliance(k)
    s = ground.strata.compliance_across(k)
    nu, r = 0.25, np.array([0.01, 0.3, 1.0, 3.0, 10.0])[:, None]
    s, q11, q22 = s - 2 * (1 + nu), q11 - 2 * (1 - nu**2), q22 - 2 * (1 - nu**2)
    q12 += (1 + nu) * (1 - 2 * nu)
    expected = [
        j0(k * r) @ (weights * (q11 + s) / 2),
        jv(2, k * r) @ (weights * (s - q11) / 2),
        -j1(k * r) @ (weights * q12),
        j0(k * r) @ (weights * q22),
    ]
    assert values(ground, r.ravel()) == pytest.approx(np.array(expected), abs=1e-9)


def test_gradient_by_many_thin_layers():
    """Layers with the modulus of their middles, of 1/20 and 1/40: an error of second order."""
    below, k = HalfSpace(2.0, 0.25), np.logspace(-1, 1, 7)
    graded = LayeredHalfSpace([Layer(1.0, 1.0, 0.25, 1.0)], below).strata
    errors = []
    for n in (20, 40):
        steps = [Layer(1 / n, 1 + (i + 0.5) / n, 0.25) for i in range(n)]
        found = LayeredHalfSpace(steps, below).strata.compliance_across(k) / steps[0].young
        errors.append(np.abs(found - graded.compliance_across(k)).max())
    assert errors[1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)


def _kernels(ground, r):
    """Those of the whole ground."""
    young, nu = ground.surface.young, ground.surface.poisson
    plain = (1 + nu) / (2 * np.pi) * np.array([2 - nu, nu, 1 - 2 * nu, 2 * (1 - nu)])
    rest = 0.0 if isinstance(ground, HalfSpace) else values(ground, r)
    return (plain[:, None] / r + rest) / young


def test_thin_layer_is_not_seen_from_afar():
    thin = LayeredHalfSpace([Layer(1e-4, 5.0, 0.1)], HalfSpace(1.0, 0.3))
    r = np.array([1.0, 10.0])
    found, below = (
        _kernels(g, r)
        for g in (thin, LayeredHalfSpace([Layer(1.0, 1.0, 0.3)], HalfSpace(1.0, 0.3)))
    )
    assert found == pytest.approx(below, rel=2e-3)


@pytest.mark.parametrize("ground", [CRUST, *slow(LINEAR)], ids=["layer", "gradient"])
def test_cells_near_and_far(ground):
    """Under the same traction on all cells these do not matter, though forces in large ones are
    cut and in small ones put together."""
    mesh, x = disc(n=20), np.array([[0.1, 0.7, 2.0], [0.2, -0.1, 1.0]])
    found = []
    for fine in (mesh, mesh.refined()):
        basis = CellBasis(fine, ElementTriP0())
        sheared = Tractions(Partition.from_basis(basis), Fan.from_basis(basis))
        found.append(sheared.displacements(ground, x, normal=True).sum(axis=3))
    assert found[0] == pytest.approx(found[1], rel=1e-5, abs=1e-6)
    # reciprocity of the kernels: up to the sign of the arm, those of shear and pressure agree
    assert found[0][2, :, :2] == pytest.approx(-found[0][:2, :, 2].T, rel=1e-12)


def test_laws_inside_cells():
    """The law of the edge and slopes, against forces in many points of all triangles."""
    cells = RigidPunch(CRUST, DualMesh.from_mesh(disc(n=30)).basis()).footprint
    traction = 1 + cells.weights.centroids[0]
    sheared = Tractions(cells.partition, cells.fan, cells.weights, cells.slopes)
    x = np.array([[1.1], [0.4]])
    plain = Tractions.displacements(sheared, CRUST.surface, x, normal=True)
    found = (sheared.displacements(CRUST, x, normal=True) - plain)[:, 0] @ traction
    fan = cells.weights.fan
    whole = np.arange(len(fan.cell)), np.repeat(np.eye(3)[..., None], len(fan.cell), axis=2)
    points = points_in_pieces(cells.weights, fan, whole, 8)
    arm = points.x - cells.weights.centroids[:, points.cell]
    slopes = cells.slopes.of(traction)[:, points.cell]
    force = points.weight * (traction[points.cell] + np.sum(slopes * arm, axis=0))
    way = x - points.x
    r = np.hypot(*way)
    even, odd, coupling, down = values(CRUST, r)
    (c, s), cos2 = way / r, (way[0] ** 2 - way[1] ** 2) / r**2
    expected = [
        [even + odd * cos2, 2 * odd * c * s, -coupling * c],
        [2 * odd * c * s, even - odd * cos2, -coupling * s],
        [coupling * c, coupling * s, down],
    ]
    # weighted triangles act as uniform ones whose loads act in the same points
    assert found == pytest.approx(np.array(expected) @ force, abs=1e-4)


def test_mirrored_bases_that_lift_off_slide_alike():
    """Cells are cut along the edge of contact whatever the sense of their vertices."""
    mesh = polygon([(0, 0), (3, 0.3), (2.5, 2), (1, 3)], n=60)
    mesh = mesh.translated(tuple(-mesh.p.mean(axis=1)))

    def moved(sign):
        mirrored = MeshTri(mesh.p * [[1.0], [sign]], mesh.t)
        punch = RigidPunch(HalfSpace(1.0, 0.3), CellBasis(mirrored, ElementTriP0()))
        found = punch.solve(
            1.0, (0.6, -0.6 * sign), horizontal=(0.1, 0.2 * sign), torsion=0.1 * sign
        )
        return np.append(found.shear.displacement, found.shear.twist) * [1.0, sign, sign]

    assert moved(-1.0) == pytest.approx(moved(1.0), rel=1e-8)
