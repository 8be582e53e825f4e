"""The ground below punches: profiles, shares of layers and sections, on stratified ground."""

import numpy as np
import pytest
from marks import slow
from plans import disc
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    BilinearForm,
    CellBasis,
    ElementQuad2,
    ElementTriP0,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshQuad,
    MeshTri,
    condense,
)

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Plan,
    ResolutionWarning,
    RigidPunch,
    RigidPunches,
    displacement_below,
    settlement_by_layers,
    stress_below,
    vertical_profile,
    vertical_section,
)
from skfem_dual.elements.depth import components
from skfem_dual.elements.strips import CellLoads
from skfem_dual.grids.generate import disc as round_disc
from skfem_dual.grids.partition import Partition

ROCK = LayeredHalfSpace([Layer(0.5, 1.0, 0.3), Layer(1.5, 0.2, 0.4)], "bonded")
CRUST = LayeredHalfSpace([Layer(0.7, 5.0, 0.2)], HalfSpace(1.0, 0.45))
BASIS = DualMesh.from_mesh(disc(3)).basis()


@pytest.fixture(scope="module")
def on_rock():
    return RigidPunch(ROCK, BASIS).solve(1.0, at=(0.1, 0.0))


@pytest.fixture(scope="module")
def on_crust():
    return RigidPunch(CRUST, BASIS).solve(1.0)


def test_far_from_the_origin(on_crust):
    """At site coordinates as at the origin, near the edge too."""
    far = np.array([[4.5e5], [5.4e6]])
    cells = DualMesh.from_mesh(disc(3).translated(far.ravel())).basis()
    there = RigidPunch(CRUST, cells, origin=far.ravel()).solve(1.0)
    x, z = np.array([[0.9, 1.1], [0.1, 0.2]]), np.full((1, 2), 0.05)
    for quantity in (stress_below, displacement_below):
        expected = np.asarray(quantity(on_crust, np.vstack([x, z])))
        found = np.asarray(quantity(there, np.vstack([x + far, z])))
        assert found == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    shares = [settlement_by_layers(s, y) for s, y in ((on_crust, x), (there, x + far))]
    assert shares[1] == pytest.approx(shares[0], abs=1e-6 * shares[0].max())


@pytest.mark.parametrize(
    "look",
    [
        lambda s, x: stress_below(s, x).sigma_z,
        displacement_below,
        lambda s, x: settlement_by_layers(s, x[:2], [1.0]),
        lambda s, x: vertical_profile(s, x[:2, 0], x[2]).strain,
        lambda s, x: vertical_section(s, (0, 0), (1, 0), 1.0, n=4)[1],
    ],
    ids=["stress", "displacement", "layers", "profile", "section"],
)
def test_what_horizontal_loads_add_is_told_to_be_left_out(on_crust, look):
    x = np.array([[0.5], [0.0], [0.4]])
    pushed = RigidPunch(CRUST, BASIS).solve(1.0, horizontal=(0.2, 0.0))
    with pytest.warns(ResolutionWarning, match="those of the vertical load; those of the hor"):
        found = look(pushed, x)
    assert found == pytest.approx(look(on_crust, x))
    unpushed = RigidPunch(CRUST, BASIS).solve(1.0, horizontal=(0.0, 0.0))
    assert found == pytest.approx(look(unpushed, x))


@pytest.mark.parametrize("at", [(0.3, -0.2), (1.4, 0.0)], ids=["under", "beside"])
def test_strains_add_up_to_settlements(on_rock, at):
    """Of each layer, by Gauss points over its depth, and down to the rock."""
    s, w = np.polynomial.legendre.leggauss(16)
    x = np.array(at)[:, None]
    parts = settlement_by_layers(on_rock, x)[:, 0]
    assert parts.sum() == pytest.approx(on_rock.ground_displacement(x)[0], rel=1e-12)
    for part, (top, bottom) in zip(parts, [(0.0, 0.5), (0.5, 2.0)], strict=True):
        depths = (top + bottom) / 2 + (bottom - top) / 2 * s
        strain = vertical_profile(on_rock, at, depths).strain
        assert strain @ w * (bottom - top) / 2 == pytest.approx(part, abs=2e-4 * parts.sum())


def test_profile(on_crust):
    profile = vertical_profile(on_crust, (0.2, 0.1), [0.3, 0.7, 1.5])
    x = np.array([[0.2] * 3, [0.1] * 3, [0.3, 0.7, 1.5]])
    assert np.array(profile.stresses) == pytest.approx(np.array(stress_below(on_crust, x)))
    assert profile.displacement == pytest.approx(displacement_below(on_crust, x))
    assert (profile.interfaces == [0.7]).all()
    assert not profile.strain.flags.writeable
    assert np.diff(profile.displacement[2]).max() < 0


def test_an_interface_that_is_a_sum():
    """.7 + .1 is a rounding error less than .8, where strains are still those above."""
    soil = LayeredHalfSpace([Layer(0.7, 60.0, 0.3), Layer(0.1, 60.0, 0.3)], HalfSpace(4.0, 0.45))
    solution = RigidPunch(soil, DualMesh.from_mesh(disc(3)).basis()).solve(1.0)
    above, at, below = vertical_profile(solution, (0.0, 0.0), [0.799999, 0.8, 0.800001]).strain
    assert soil.strata.interfaces[-2] < 0.8
    assert at == pytest.approx(above, rel=1e-4)
    assert below > 2 * at


def test_a_profile_has_depths(on_crust):
    with pytest.raises(ValueError, match="at least one depth, got none"):
        vertical_profile(on_crust, (0.25, 0.0), [])


def test_a_profile_is_told_in_a_few_lines(on_crust):
    profile = vertical_profile(on_crust, (0.25, 0.0), [0.5, 2.0])
    rows = repr(profile).splitlines()
    assert rows[:3] == [
        "<skfem_dual Profile object>",
        "  Below: (0.25, 0)",
        "  Depths: 2, 0.5 to 2",
    ]
    low, high = sorted(profile.strain)
    assert rows[4] == f"  strain: {low:.6g} to {high:.6g}"


def test_shares_of_any_depths(on_crust):
    x = np.array([[0.0, 0.5, 2.0], [0.0, 0.1, 0.0]])
    by_layers = settlement_by_layers(on_crust, x)
    finer = settlement_by_layers(on_crust, x, [0.3, 0.7, 2.0])
    assert finer.shape == (4, 3)
    assert finer[:2].sum(axis=0) == pytest.approx(by_layers[0], abs=1e-9)
    assert finer[2:].sum(axis=0) == pytest.approx(by_layers[1], rel=1e-9)
    alone = RigidPunch(HalfSpace(1.0, 0.3), BASIS).solve(1.0)
    whole = settlement_by_layers(alone, x)
    assert whole.shape == (1, 3)
    assert whole[0] == pytest.approx(alone.ground_displacement(x))


def test_stiff_crust_spreads_the_load(on_crust):
    """On the axis, a radius below its interface, against homogeneous ground."""
    alone = RigidPunch(HalfSpace(1.0, 0.45), BASIS).solve(1.0)
    x = [[0.0], [0.0], [1.7]]
    assert stress_below(on_crust, x).sigma_z < 0.9 * stress_below(alone, x).sigma_z


def test_section_of_layered_ground(on_crust):
    basis, values = vertical_section(on_crust, (-2.0, 0.0), (2.0, 0.0), 1.4, n=20)
    at = np.nonzero(np.hypot(basis.mesh.p[0] - 1.0, basis.mesh.p[1] + 0.8) < 1e-9)[0]
    expected = stress_below(on_crust, [[-1.0], [0.0], [0.8]]).sigma_z
    assert values[at] == pytest.approx(expected, rel=1e-6)


def test_neighbours_on_layers():
    punches = []
    for x in (-1.5, 1.5):
        dual = DualMesh.from_mesh(disc(2).translated((x, 0.0)))
        punches.append(RigidPunch(CRUST, dual.basis(), origin=(x, 0.0)))
    both = RigidPunches(punches).solve([{"force": 1.0}] * 2)
    left, right = (vertical_profile(s, (0.0, 0.0), [0.4, 1.0]) for s in both.solutions)
    assert left.strain == pytest.approx(right.strain, rel=1e-9)
    assert np.abs(left.displacement[:2]).max() < 1e-5 * left.displacement[2].min()


@pytest.mark.parametrize(
    ("ground", "deep"),
    [(CRUST, 1e4), *slow((GradedHalfSpace.init_linear(1.0, 0.3, 0.5), 30.0))],
    ids=["crust", "linear"],
)
def test_depths_of_any_size_together(ground, deep):
    """The same as alone; far below as on the ground that is there."""
    solution = RigidPunch(ground, BASIS).solve(1.0)
    x = np.array([[0.2, 0.2, 0.2], [0.1, 0.1, 0.1], [1e-3, 1.0, deep]])
    together = displacement_below(solution, x)[2]
    alone = [displacement_below(solution, x[:, i : i + 1])[2, 0] for i in range(3)]
    # of 1e4 times more near the surface
    assert together == pytest.approx(alone, rel=1e-5, abs=1e-9)
    if ground is CRUST:
        far = (2 * (1 - 0.45) + 1) * 1.45 / (2 * np.pi * 1e4)
        assert alone[2] == pytest.approx(far, rel=1e-3)
    with pytest.raises(ValueError, match=r"distances and depths up to .*, got 1e\+30.*Remedy"):
        displacement_below(solution, [[0.0], [0.0], [1e30]])
    assert stress_below(solution, np.empty((3, 0))).tensor.shape == (3, 3, 0)


def test_no_points(on_rock):
    nowhere = np.empty((2, 0))
    assert on_rock.displacement(nowhere).shape == (0,)
    assert settlement_by_layers(on_rock, nowhere).shape == (2, 0)


@pytest.mark.parametrize(
    ("depths", "message"),
    [
        ([0.5, 0.4], "depths that ascend, got 0.4 after 0.5 at index 1"),
        ([0.50000001, 0.5], "depths that ascend, got 0.5 after 0.50000001 at index 1"),
        ([1.0, 2.5], "above the rigid base at depth 2; the first that is not: 1, with z=2.5"),
        ([0.0, 1.0], "finite depths z > 0; the first that is not: 0"),
    ],
)
def test_bad_depths(on_rock, depths, message):
    with pytest.raises(ValueError, match=message):
        settlement_by_layers(on_rock, [[0.0], [0.0]], depths)


@BilinearForm
def stiffness(u, v, w):
    r, z = w.x
    shear = (1 + z) / (2 * (1 + w.nu))
    lame = 2 * shear * w.nu / (1 - 2 * w.nu)
    e, f = ((q.grad[0, 0], q[0] / r, q.grad[1, 1]) for q in (u, v))
    slide = (u.grad[0, 1] + u.grad[1, 0]) * (v.grad[0, 1] + v.grad[1, 0])
    return (lame * sum(e) * sum(f) + shear * (2 * sum(a * b for a, b in zip(e, f)) + slide)) * r


@pytest.mark.slow
def test_finite_elements_of_graded_ground():
    """A uniform load on the unit circle, E = 1 + z: axisymmetric finite elements, whose cylinder
    ends 32 radii away."""
    d = 2.0 ** (np.arange(-24, 31) / 6)
    lines = np.concatenate([(1 - d[d <= 1])[::-1], [1], 1 + d])
    mesh = MeshQuad.init_tensor(lines, np.append(0, d))
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
    (radius, depth), (r, z) = mesh.p.max(axis=1), basis.doflocs
    radial = np.zeros(basis.N, dtype=bool)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        radial[dofs[0]] = True
    fixed = (radial & ((r == 0) | (r == radius))) | (~radial & (z == depth))
    loaded = mesh.facets_satisfying(lambda x: (x[1] == 0) & (x[0] < 1), boundaries_only=True)
    load = LinearForm(lambda v, w: v[1] * w.x[0]).assemble(
        FacetBasis(mesh, basis.elem, facets=loaded)
    )
    A, b, u, free = condense(stiffness.assemble(basis, nu=0.25), load, D=np.flatnonzero(fixed))
    u[free] = splu(A.tocsc()).solve(b)
    at = np.array([[0.25, 0.75, 1.25, 2.5], [0.6, 1.3, 0.5, 1.7]])
    elements = mesh.element_finder()(*at)
    local = mesh.mapping().invF(at[:, :, None], tind=elements)
    strain, moved = [], []
    for i, e in enumerate(elements):
        point = Basis(
            mesh, basis.elem, elements=np.array([e]), quadrature=(local[:, i], np.ones(1))
        )
        field = point.interpolate(u)
        g, value = field.grad[..., 0, 0], np.array(field)[:, 0, 0]
        strain.append([g[0, 0], value[0] / at[0, i], g[1, 1], g[0, 1] + g[1, 0]])
        moved.append(value)
    strain = np.array(strain).T
    young = 1 + at[1]
    shear, lame = young / 2.5, young * 0.25 / 1.25 / 0.5
    expected = [lame * strain[:3].sum(axis=0) + 2 * shear * e for e in strain[:3]]
    expected = -np.array([*expected, shear * strain[3]])
    cells = CellBasis(round_disc(n=1500), ElementTriP0())
    partition = Partition.from_basis(cells)
    ground = GradedHalfSpace.init_linear(1.0, 0.25, 1.0)
    x = np.vstack([at[:1], 0 * at[:1], at[1:]])
    found = components(ground, [CellLoads(partition, np.ones(len(partition)), None)], x)
    assert found[[0, 1, 2, 5]] == pytest.approx(expected, abs=5e-4)
    assert found[[6, 8]] == pytest.approx(np.array(moved).T, abs=3e-3)


@pytest.mark.parametrize("point", [(0.0, 0.0, 1e-200), (1e103, 0.0, 0.3), (0.0, 0.0, 1e155)])
def test_points_beyond_numbers_are_refused(on_rock, point):
    for quantity in (stress_below, displacement_below):
        with pytest.raises(ValueError, match=r"up to 1e\+100 .* from 1e-100 on; .*: 1"):
            quantity(on_rock, np.array([(0.1, 0.0, 0.5), point]).T)


@pytest.mark.parametrize("depth", [1e-6, *slow(1e-5, 1e-3)])
def test_shortening_next_to_a_varying_surface(depth):
    """Of a shallow part it is its depth times the strain in it."""
    ground = GradedHalfSpace.init_linear(1.0, 0.3, 20.0)
    basis = CellBasis(MeshTri.init_circle(3), ElementTriP0())
    s = RigidPunch(ground, basis, edge="constant").solve(1.0, unilateral=False)
    x = s.punch.partition.centroids[:, :1]
    above = s.ground_displacement(x)[0]
    below, again = (displacement_below(s, np.vstack([x, [[z]]]))[2, 0] for z in (depth, 2 * depth))
    assert above - below == pytest.approx(below - again, rel=0.2)


def test_stresses_below_an_edge_obey_the_law_of_hooke_in_a_gradient():
    """The law of the edge falls in triangles, whose means alone are 8 % of the pressure off."""
    plan = Plan.from_polygon([(0, 0), (6, 0), (6, 2), (2, 2), (2, 5), (0, 5)])
    basis = DualMesh.from_mesh(plan.mesh(n=200)).basis()
    punch = RigidPunch(GradedHalfSpace.init_linear(10.0, 0.3, 2.0), basis, origin=(2, 1.5))
    solution, z, h = punch.solve(plan.area, at=(0.1, 0.0)), 0.02, 2e-4
    for at in ((3.0, 0.005), (1.2, 4.99)):
        strain = vertical_profile(solution, at, [z]).strain[0]
        w = vertical_profile(solution, at, z + h * np.array([-2, -1, 1, 2])).displacement[2]
        slope = (w[0] - 8 * w[1] + 8 * w[2] - w[3]) / (12 * h)
        assert 10 * (slope + strain) == pytest.approx(0, abs=3e-4)  # the mean pressure is 1
