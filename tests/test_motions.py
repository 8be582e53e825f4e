"""Horizontal and twisting motions of rigid bases."""

import numpy as np
import pytest
from marks import slow
from scipy.integrate import quad
from skfem import (
    BilinearForm,
    CellBasis,
    ElementQuad2,
    ElementTriP0,
    MeshQuad,
    MeshTri,
    condense,
    solve,
)
from skfem.helpers import dot, grad

from skfem_dual import (
    Cone,
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    Plan,
    RigidPunch,
)
from skfem_dual.contact import motions
from skfem_dual.contact.motions import Motions, moving
from skfem_dual.grids.corners import parted, signed_areas
from skfem_dual.grids.generate import disc, rectangle

NU, SHEAR = 0.3, 5.0
SOIL = HalfSpace(2 * SHEAR * (1 + NU), NU)
ROCK = LayeredHalfSpace([Layer(0.6, SOIL.young, NU)], "bonded")
CRUST = LayeredHalfSpace([Layer(0.4, SOIL.young, NU)], HalfSpace(SOIL.young / 5, NU))


def base(mesh, soil=SOIL, **options):
    return RigidPunch(soil, DualMesh.from_mesh(mesh).basis(), **options)


def circle(n=150, radius=2.0, soil=SOIL, *, graded=None, **options):
    return base(disc(n=n, graded=graded).scaled(radius), soil, **options)


def exact_circle(a, nu=NU, shear=SHEAR):
    """Stiffnesses (W0, Lx, Ly, Ux, Uy, twist) of a relaxed disc."""
    tilt, slide = 8 * a**3 / (3 * (1 - nu)), 8 * a / (2 - nu)
    return shear * np.array([4 * a / (1 - nu), tilt, tilt, slide, slide, 16 * a**3 / 3])


def scaled(stiffness, length):
    """Of motions of one size."""
    unit = np.array([1, 1 / length, 1 / length, 1, 1, 1 / length])
    return stiffness * np.outer(unit, unit)


@pytest.fixture(scope="module")
def unit_circle():
    return circle(300, 1.0)


def test_circle(unit_circle):
    stiffness = unit_circle.stiffness(full=True)
    exact = exact_circle(1.0)
    assert stiffness.diagonal() == pytest.approx(exact, rel=2e-4)
    rest = stiffness - np.diag(stiffness.diagonal())
    assert np.abs(rest).max() < 1e-5 * exact[0]


def test_circle_converges():
    exact = exact_circle(2.0)[3:5]
    errors = [
        np.abs(circle(n).stiffness(full=True).diagonal()[3:5] / exact - 1).max() for n in (25, 100)
    ]
    assert errors[1] < 0.4 * errors[0]


def test_motions_gain_from_cells_graded_to_the_edge():
    exact = exact_circle(1.0)
    uniform, graded = (
        np.abs(circle(n, 1.0, graded=g).stiffness(full=True).diagonal() / exact - 1)
        for n, g in ((300, None), (300, 0.2))
    )
    assert graded.max() < 6e-5
    assert (graded < 0.6 * uniform).all()


def test_circle_of_triangles():
    punch = RigidPunch(SOIL, CellBasis(disc(n=150).scaled(2.0), ElementTriP0()))
    found, exact = punch.stiffness(full=True).diagonal(), exact_circle(2.0)
    assert found[:5] == pytest.approx(exact[:5], rel=4e-4)
    assert found[5] == pytest.approx(exact[5], rel=1e-3)


def test_ellipse():
    """Under Q / (2 pi a b sqrt(1 - x^2/a^2 - y^2/b^2)) the ground moves as one; all chords through
    a point carry pi / sqrt(cos^2/a^2 + sin^2/b^2) times its factor."""
    a, b = 2.0, 1.0
    mesh = disc(n=150)
    mesh = type(mesh)(mesh.p * np.array([[a], [b]]), mesh.t)
    soil = HalfSpace(2 * (1 + NU), NU)
    found = RigidPunch(soil, CellBasis(mesh, ElementTriP0())).stiffness(full=True)

    def flexibility(first, second):
        def of_chord(t):
            part = (1 - NU) + NU * np.cos(t) ** 2
            return part / np.sqrt((np.cos(t) / first) ** 2 + (np.sin(t) / second) ** 2)

        return quad(of_chord, 0, np.pi)[0] / (4 * np.pi * a * b)

    assert found[3, 3] == pytest.approx(1 / flexibility(a, b), rel=1e-3)
    assert found[4, 4] == pytest.approx(1 / flexibility(b, a), rel=1e-3)


@pytest.mark.parametrize(
    ("nu", "n"),
    [
        (0.4, 150),
        *slow((0.2, 300), (0.0, 600)),
    ],
)
def test_bonded_circle(nu, n):
    """Mossakovskii's vertical stiffness, and torsion, which nothing couples to."""
    soil = HalfSpace(2 * SHEAR * (1 + nu), nu)
    stiffness = circle(n, 1.0, soil).stiffness(full=True, rough=True)
    vertical = 4 * SHEAR * np.log(3 - 4 * nu) / (1 - 2 * nu)
    assert stiffness[0, 0] == pytest.approx(vertical, rel=1e-3)
    assert stiffness[5, 5] == pytest.approx(16 * SHEAR / 3, rel=3e-4)
    # tilted down at x > 0 the ground is drawn there, which the base holds back; so along y
    assert stiffness[3, 1] < 0
    assert stiffness[3, 1] == pytest.approx(stiffness[4, 2], rel=1e-3)


def test_incompressible_ground_couples_nothing():
    punch = circle(60, soil=HalfSpace(3.0, 0.5))
    smooth, rough = punch.stiffness(full=True), punch.stiffness(full=True, rough=True)
    assert scaled(rough, 2.0) == pytest.approx(scaled(smooth, 2.0), rel=2e-3, abs=1e-3)


def test_bonded_is_stiffer():
    punch = base(rectangle(3.0, 1.0, n=40))
    rough, smooth = (
        scaled(punch.stiffness(full=True, rough=bonded), 1.5) for bonded in (True, False)
    )
    for own, free in (slice(3), slice(3, 6)), (slice(3, 6), slice(3)):
        # free to follow the other motions it is the least that bonded ground resists
        least = rough[own, own] - rough[own, free] @ np.linalg.solve(
            rough[free, free], rough[free, own]
        )
        more = np.linalg.eigvalsh(least - smooth[own, own])
        assert more.min() > -1e-3 * smooth.max()
    assert (rough.diagonal() > smooth.diagonal()).all()


@pytest.mark.parametrize("soil", [CRUST, *slow(SOIL)], ids=["layers", "homogeneous"])
@pytest.mark.parametrize("rough", [False, True])
def test_reciprocity_of_collocation(rough, soil):
    """Before it is made symmetric the stiffness is so up to the error of the discretisation."""
    cells = base(rectangle(3.0, 1.0, n=60), soil).footprint
    found = Motions(cells, rough, np.ones(len(cells), dtype=bool)).collocated_stiffness
    assert np.abs(found - found.T).max() < (0.05 if rough else 1e-3) * np.abs(found).max()


@pytest.mark.parametrize("rough", [True, *slow(False)])
def test_objectivity(rough):
    mesh = rectangle(3.0, 1.0, n=40)
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    there = np.eye(6)
    there[1:3, 1:3] = there[3:5, 3:5] = turn
    still = base(mesh).stiffness(full=True, rough=rough)
    turned = base(type(mesh)(turn @ mesh.p, mesh.t)).stiffness(full=True, rough=rough)
    assert turned == pytest.approx(there @ still @ there.T, rel=1e-6, abs=1e-6 * still.max())


def test_origin():
    """Motions of another point do the same work."""
    by = np.array([0.7, -1.1])
    here, there = (circle(60, origin=tuple(o)).stiffness(full=True) for o in (0 * by, by))
    motion = np.array([0.3, 0.1, -0.2, 0.4, 0.5, 0.6])
    w, lx, ly, ux, uy, twist = motion
    same = [w + lx * by[0] + ly * by[1], lx, ly, ux - twist * by[1], uy + twist * by[0], twist]
    assert moving(by) @ motion == pytest.approx(same)
    assert same @ there @ same == pytest.approx(motion @ here @ motion, rel=1e-12)


def test_far_from_the_origin():
    """At site coordinates as at the origin, in units of the largest stiffness of a kind."""
    mesh, far = disc(n=40), (4.5e5, 5.4e6)
    for rough in (False, True):
        here = base(mesh).stiffness(full=True, rough=rough)
        there = base(mesh.translated(far), origin=far).stiffness(full=True, rough=rough)
        assert there == pytest.approx(here, abs=1e-7 * here.max())


def test_torsion_of_circle(unit_circle):
    """Traction 3 T r / (4 pi a^3 sqrt(a^2 - r^2)) around the centre, twist 3 T / (16 G a^3)."""
    punch, torsion = unit_circle, 2.0
    solution = punch.solve(1.0, torsion=torsion)
    shear = solution.shear
    assert shear.twist == pytest.approx(3 * torsion / (16 * SHEAR), rel=1.5e-4)
    assert shear.displacement == pytest.approx(0.0, abs=2e-6 * shear.twist)
    x = punch.partition.centroids
    r = np.hypot(*x)
    inner = (r < 0.8) & (r > 0.1)
    around = (x[0] * shear.traction[1] - x[1] * shear.traction[0]) / r
    exact = 3 * torsion * r / (4 * np.pi * np.sqrt(1 - r**2))
    assert around[inner] == pytest.approx(exact[inner], rel=0.02)
    assert solution.pressure == pytest.approx(punch.solve(1.0).pressure)


def test_tractions_balance_the_load():
    punch = base(rectangle(3.0, 1.0, n=60), origin=(0.4, 0.2))
    shear = punch.solve(1.0, at=(-0.3, -0.2), horizontal=(0.3, -0.2), torsion=0.5).shear
    qx, qy = shear.traction
    # punch.resultants are integrals of 1, x and y from the centroid
    (hx, _, yqx), (hy, xqy, _) = punch.resultants @ qx, punch.resultants @ qy
    dx, dy = punch.centre - np.array([0.4, 0.2])
    assert (hx, hy) == pytest.approx((0.3, -0.2))
    assert xqy + dx * hy - yqx - dy * hx == pytest.approx(0.5)
    load = [0.3, -0.2, 0.5]
    assert shear.stiffness @ [*shear.displacement, shear.twist] == pytest.approx(load)
    moved = shear.displacements([[0.4, 1.4], [0.2, 0.2]])
    assert moved[:, 0] == pytest.approx(shear.displacement)
    assert moved[:, 1] - moved[:, 0] == pytest.approx([0.0, shear.twist])


def torsion_of_disc(compliance, reach):
    """Torsional stiffness of the unit disc on ground with the compliance 1 + f(k) across waves
    over that of its surface, 1 the shear modulus there, f fallen to nothing at ``reach``.

    The twisting traction has the transform int chi(t) sin(k t) dt; dual integral equations as of
    I. N. Sneddon, Mixed Boundary Value Problems in Potential Theory (1966), section 4.6.
    """
    t, w = np.polynomial.legendre.leggauss(24)
    t, w = (t + 1) / 2, w / 2
    edges = np.linspace(0, reach, 60)
    g, gw = np.polynomial.legendre.leggauss(12)
    k = (edges[:-1, None] + np.diff(edges)[:, None] * (g + 1) / 2).ravel()
    f = (np.diff(edges)[:, None] * gw / 2).ravel() * (compliance(k) - 1)
    waves = np.sin(np.outer(t, k))
    matrix = np.eye(len(t)) + 2 / np.pi * (waves * f) @ waves.T * w
    return 4 * np.pi * np.sum(w * t * np.linalg.solve(matrix, 4 * t / np.pi))


@pytest.mark.parametrize(
    ("ground", "compliance"),
    [
        (CRUST, lambda k: (5 + np.tanh(0.4 * k)) / (1 + 5 * np.tanh(0.4 * k))),
        *slow((ROCK, lambda k: np.tanh(0.6 * k))),
    ],
    ids=["crust", "rock"],
)
def test_torsion_on_a_layer(ground, compliance):
    found = circle(200, 1.0, ground, graded=0.2).stiffness(full=True)[5, 5]
    assert found == pytest.approx(SHEAR * torsion_of_disc(compliance, 50.0), rel=3e-4)


def test_torsion_by_finite_elements():
    """On a layer with a gradient, on rock: the twist v / r of rings around the axis, in elements
    that are graded to the edge, whose energy lies above the least."""
    near = np.append(0.0, np.geomspace(1e-4, 0.5, 16))
    r = np.concatenate([[0.0, 0.25], 1 - near[::-1], 1 + near[1:], np.linspace(1.8, 5, 9)])
    z = np.append(near, [0.7, 1.0])
    mesh = MeshQuad.init_tensor(r, z)
    basis = CellBasis(mesh, ElementQuad2(), intorder=7)
    energy = BilinearForm(lambda u, v, w: w.x[0] ** 3 * (1 + 2 * w.x[1]) * dot(grad(u), grad(v)))
    K = 2 * np.pi * SHEAR * energy.assemble(basis)
    base = basis.get_dofs(lambda x: (x[1] == 0) & (x[0] <= 1)).flatten()
    held = basis.get_dofs(lambda x: (x[1] == 1) | (x[0] == 5)).flatten()
    twist = basis.zeros()
    twist[base] = 1.0
    twist = solve(*condense(K, x=twist, D=np.union1d(base, held)))
    ground = LayeredHalfSpace([Layer(1.0, SOIL.young, NU, 2.0)], "bonded")
    found = circle(150, 1.0, ground, graded=0.2).stiffness(full=True)[5, 5]
    assert found == pytest.approx(twist @ K @ twist, rel=1e-3)


EQUAL = LayeredHalfSpace([Layer(0.3, SOIL.young, NU), Layer(2.0, SOIL.young, NU)], SOIL)
THICK = LayeredHalfSpace([Layer(600.0, SOIL.young, NU)], HalfSpace(1.0, 0.1))


@pytest.mark.parametrize("rough", [False, True])
def test_equal_layers_are_homogeneous(rough):
    """But for the series by which sectors settle farther off on homogeneous ground."""
    found, exact = (circle(40, soil=s).stiffness(full=True, rough=rough) for s in (EQUAL, SOIL))
    off = np.abs(found - exact) / exact.max()
    assert off[:3, :3].max() < (1e-9 if rough else 2e-5)
    off[:3, :3] = 0.0
    assert off.max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("rough", [False, True])
def test_thick_layers(rough):
    """The ground below a layer of 300 radii is felt by 1 in 300."""
    found, exact = (circle(40, soil=s).stiffness(full=True, rough=rough) for s in (THICK, SOIL))
    assert found.diagonal() == pytest.approx(exact.diagonal(), rel=0.02)
    # torsion and tilts are felt less far
    assert found[[1, 5], [1, 5]] == pytest.approx(exact[[1, 5], [1, 5]], rel=1e-4)


@pytest.mark.parametrize("ratio", [2.0, *slow(4.0)])
def test_stratum_on_rock(ratio):
    """E. Kausel's and G. Gazetas's formulas for circles, which are good to some 5 %."""
    rock = LayeredHalfSpace([Layer(ratio, SOIL.young, NU)], "bonded")
    found = circle(40, 1.0, rock).stiffness(full=True).diagonal() / exact_circle(1.0)
    tilt, slide = 1 + 1 / (6 * ratio), 1 + 1 / (2 * ratio)
    expected = [1 + 1.28 / ratio, tilt, tilt, slide, slide, 1 + 1 / (10 * ratio)]
    assert found == pytest.approx(expected, rel=0.06)


def test_lifted_off():
    """Cells without contact carry nothing, and what remains is softer."""
    punch = circle(100, 1.0)
    held = punch.solve(1.0, horizontal=(0.1, 0.0), torsion=0.1)
    lifted = punch.solve(1.0, at=(0.6, 0.0), horizontal=(0.1, 0.0), torsion=0.1)
    free = lifted.pressure == 0
    assert free.sum() > 10
    assert not lifted.shear.traction[:, free].any()
    assert np.abs(lifted.shear.traction[:, ~free]).max(axis=0).min() > 0
    softer = np.linalg.eigvalsh(held.shear.stiffness - lifted.shear.stiffness)
    assert softer.min() > 0
    assert lifted.shear.traction @ punch.partition.areas == pytest.approx([0.1, 0.0], abs=1e-15)


@pytest.mark.parametrize("dual", [True, False])
@pytest.mark.parametrize(
    ("shape", "rtol"), [(Paraboloid(5.0), 1e-3), *slow((Cone(np.arctan(0.1)), 4e-3))]
)
def test_contact_that_ends_under_the_base(shape, rtol, dual):
    """What sticks is the circle of contact, not the cells it runs through.

    Exact: K. L. Johnson, Contact Mechanics (1985), sections 3.7 and 3.9.
    """
    grid = DualMesh.from_mesh(disc(n=600 if dual else 300))
    radius, modulus = 0.7, SOIL.young / (1 - NU**2)
    force = modulus * radius**2 * (4 * radius / 15 if rtol == 1e-3 else 0.1 * np.pi / 2)
    punch = RigidPunch(SOIL, grid.basis() if dual else grid.primal_basis(), gap=shape)
    solution = punch.solve(force, torsion=1.0)
    assert solution.contact_area == pytest.approx(np.pi * radius**2, rel=rtol)
    exact = np.diag(exact_circle(radius)[3:])
    assert solution.shear.stiffness == pytest.approx(exact, rel=2 * rtol, abs=rtol * exact.max())
    assert solution.shear.traction @ punch.partition.areas == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("soil", [CRUST, *slow(SOIL)])
def test_both_grids_agree_on_what_lifted_off(soil):
    """Within 1 %, as do the areas of contact; cells that stick whole are 3 % apart."""
    grid = DualMesh.from_mesh(disc(n=150))
    load = {"at": (0.55, 0.2), "horizontal": (1.0, 0.0), "torsion": 1.0}
    one, other = (
        RigidPunch(soil, basis).solve(1.0, **load).shear
        for basis in (grid.basis(), grid.primal_basis())
    )
    assert one.stiffness == pytest.approx(
        other.stiffness, rel=1e-2, abs=1e-2 * one.stiffness[0, 0]
    )


@pytest.mark.parametrize("angle", [0.3, *slow(1.1)])
def test_contact_that_ends_turns_with_the_base(angle):
    c, s = np.cos(angle), np.sin(angle)
    turn, load = np.array([[c, -s], [s, c]]), np.array([0.3, -0.1])
    mesh = disc(n=80)
    turned = MeshTri(turn @ mesh.p, np.random.default_rng(0).permutation(mesh.t.T).T.copy())
    one, other = (
        base(m).solve(1.0, at=tuple(q @ [0.6, 0.1]), horizontal=tuple(q @ load), torsion=0.2).shear
        for m, q in ((mesh, np.eye(2)), (turned, turn))
    )
    assert other.displacement == pytest.approx(turn @ one.displacement, rel=1e-9)
    assert other.twist == pytest.approx(one.twist, rel=1e-9)
    assert other.traction == pytest.approx(turn @ one.traction, rel=1e-8, abs=1e-9)


def test_more_triangles_than_a_matrix_takes(monkeypatch):
    """Their dual cells take their place."""
    punch = circle(100, 1.0)
    lifted = punch.solve(1.0, at=(0.6, 0.0), torsion=0.1).shear
    monkeypatch.setattr(motions, "DENSE", 50)
    again = punch.solve(1.0, at=(0.6, 0.0), torsion=0.1).shear
    assert again.twist != lifted.twist
    assert again.stiffness == pytest.approx(lifted.stiffness, rel=2e-3, abs=0.04)


def test_nothing_moves_nothing():
    """Zeros have no sign, which tables and reports would show."""
    still = circle(60, 1.0).solve(1.0, at=(0.6, 0.0), horizontal=(0.0, 0.0), torsion=0.0).shear
    assert not np.signbit([*still.displacement, still.twist]).any()


def test_constant_edge_is_coarser():
    exact = exact_circle(2.0)
    found = circle(200, edge="constant").stiffness(full=True).diagonal()
    assert found == pytest.approx(exact, rel=0.05)
    assert (found < exact).all()


def test_what_is_printed():
    text = repr(circle(60).solve(1.0, horizontal=(0.1, 0.0)))
    assert "Horizontal force  (0.1, 0), torsion 0" in text


def test_refused():
    punch = circle(60)
    sliding = circle(60, soil=LayeredHalfSpace([Layer(1.0, 1.0, 0.3)], "smooth"))
    with pytest.raises(ValueError, match=r"they slide away. Remedy"):
        sliding.stiffness(full=True)
    with pytest.raises(ValueError, match="holds horizontal forces"):
        sliding.solve(1.0, torsion=1.0)
    with pytest.raises(ValueError, match="expected full=True with rough=True"):
        punch.stiffness(rough=True)
    with pytest.raises(TypeError, match="two numbers for horizontal"):
        punch.solve(1.0, horizontal=1.0)
    with pytest.raises(ValueError, match="torsion"):
        punch.solve(1.0, torsion=np.nan)
    with pytest.raises(ValueError, match="expected a positive force with horizontal"):
        punch.solve(0.0, torsion=1.0)


def test_contact_that_hangs_together_in_single_nodes():
    """Strips one triangle wide along an edge: their mesh is none for cells as it is."""
    plan = Plan.circle((0.0, 0.0), 1.0) + Plan.from_polygon([(2, 0), (3, 0), (3, 2), (2.5, 2)])
    punch = RigidPunch(HalfSpace(1.0, 0.3), CellBasis(plan.mesh(n=100), ElementTriP0()))
    at = 0.11189467226614545, -0.5696321453621682
    found = punch.solve(1.0, at=at, horizontal=(0.1, 0.0))
    assert found.success
    region = found.contact_region.mesh
    apart = parted(region)
    assert apart.p.shape[1] > region.p.shape[1]
    areas = np.abs(signed_areas(apart.p, apart.t))
    assert areas == pytest.approx(np.abs(signed_areas(region.p, region.t)), rel=1e-12)
    moved = punch.solve(1.0, at=(at[0], at[1] + 1e-6), horizontal=(0.1, 0.0))
    assert found.shear.displacement == pytest.approx(moved.shear.displacement, rel=1e-3, abs=1e-4)


def test_slivers_of_contact_do_not_tell_how_it_twists():
    """Where the edge of contact passes next to a vertex their slopes did: the plan and its mirror
    image twisted by 6 % more and less."""
    ground = LayeredHalfSpace([Layer(2.0, 60e6, 0.3), Layer(3.0, 10e6, 0.4)], "bonded")
    mesh = Plan.from_polygon([(0, 0), (12, 0), (12, 4), (5, 4), (5, 9), (0, 9)]).mesh(n=150)
    middle = mesh.p.mean(axis=1)
    at = 0.6 * (mesh.p[:, np.argmax(mesh.p[0])] - middle) + middle
    twists = []
    for sign in (1, -1):
        mirrored = MeshTri(mesh.p * [[1], [sign]], mesh.t)
        punch = RigidPunch(ground, CellBasis(mirrored, ElementTriP0()))
        found = punch.solve(1e6, at=(at[0], sign * at[1]), torsion=sign * 1e5)
        twists.append(sign * found.shear.twist)
    assert twists[1] == pytest.approx(twists[0], rel=1e-4)
