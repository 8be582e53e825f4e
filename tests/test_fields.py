"""What leaves the solver carries what was solved."""

import numpy as np
import pytest
from marks import slow
from plans import annulus, disc, ellipse, polar, rectangle, renumbered
from skfem import (
    CellBasis,
    ElementQuad0,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    MeshQuad,
    MeshTri,
)

from skfem_dual import (
    DualMesh,
    HalfSpace,
    MeshError,
    Paraboloid,
    RigidPunch,
    evaluate,
    postprocess,
    pressure_field,
)
from skfem_dual.elements.balance import balanced, field_resultant
from skfem_dual.errors import ConvergenceError, ResolutionWarning
from skfem_dual.grids import generate
from skfem_dual.grids.corners import signed_areas
from skfem_dual.grids.generate import polygon
from skfem_dual.grids.outline import distance_to_segments
from skfem_dual.post.edge_laws import EdgeLaws

SOIL = HalfSpace(1.0, 0.25)


def star():
    angle = np.arange(10) * np.pi / 5
    radius = np.where(np.arange(10) % 2, 0.5, 1.0)
    return polygon((radius * [np.cos(angle), np.sin(angle)]), n=120)


def two_holes():
    square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    hole = np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])
    holes = [np.add(hole, middle).T for middle in ((0.45, 0.4), (-0.4, -0.45))]
    return polygon(np.transpose(square), holes=holes, n=150)


PLANS = {
    "thin ring": (lambda: annulus(3, 60, inner=0.9), (0.1, 0.05)),
    "L": (lambda: MeshTri.init_lshaped().refined(2), (-0.1, 0.15)),
    "two holes": (two_holes, (0.1, -0.05)),
    "star": (star, (0.05, 0.02)),
    "disc that lifts off": (lambda: disc(3), (0.5, 0.1)),
}


@pytest.fixture(scope="module", params=PLANS)
def couple(request):
    make, at = PLANS[request.param]
    dual = DualMesh.from_mesh(make())
    return [
        RigidPunch(SOIL, basis).solve(force=2.0, at=at)
        for basis in (dual.basis(), dual.primal_basis())
    ]


def assert_carries(solution, basis, values):
    size = np.ptp(basis.mesh.p)
    found = field_resultant(basis, values, solution.punch.origin)
    error = (found - solution.resultant) / (solution.force * np.array([1, size, size]))
    np.testing.assert_allclose(error, 0.0, atol=1e-12)


def test_every_export_carries_force_and_moments(couple):
    for solution, other in (couple, couple[::-1]):
        mesh = solution.contact_region
        assert_carries(solution, *solution.pressure_field(refine=1))
        assert_carries(solution, *solution.pressure_field(refine=2, other=other))
        assert_carries(solution, *solution.nodal_pressure())
        basis = CellBasis(MeshTri(mesh.p, mesh.t), ElementTriP2())
        f, x = solution.load_vector(basis), basis.doflocs
        found = np.array([f.sum(), *(x @ f)])
        np.testing.assert_allclose(found, solution.resultant, atol=3e-12)
    assert_carries(couple[0], *postprocess(*couple))


def test_moments_from_a_far_origin():
    """At site coordinates, moments from their origin: about the plan all is as exact."""
    site = np.array([4.5e5, 5.4e6])
    dual = DualMesh.from_mesh(rectangle(8).translated(site))
    shape, at = Paraboloid(1.0, tuple(site)), tuple(site + np.array([0.05, 0.02]))
    couple = [
        RigidPunch(SOIL, basis, gap=shape).solve(0.2, at=at)
        for basis in (dual.basis(), dual.primal_basis())
    ]
    for s, other in (couple, couple[::-1]):
        for field in (
            s.pressure_field(refine=1),
            s.pressure_field(refine=1, other=other),
            s.nodal_pressure(),
            postprocess(*couple),
        ):
            found = field_resultant(*field, site)
            np.testing.assert_allclose(found, [0.2, 0.01, 0.004], atol=1e-8)


@pytest.mark.parametrize("grid", ["dual", *slow("primal")])
def test_field_of_the_central_circle(grid):
    """p = P / (2 pi sqrt(1 - r^2)), by distance from the edge; cells are 0.08 wide."""
    dual = DualMesh.from_mesh(disc(4))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    solution = RigidPunch(SOIL, basis).solve(force=2 * np.pi)
    r, angle = np.random.default_rng(0).uniform([[0.0], [0.0]], [[0.995], [2 * np.pi]], (2, 5000))
    x, exact = r * [np.cos(angle), np.sin(angle)], 1 / np.sqrt(1 - r**2)
    nodal, field = (
        evaluate(*export, x, outside="zero") / exact - 1
        for export in (solution.nodal_pressure(), solution.pressure_field())
    )
    for begin, end, rms in ((0.015, 0.03, 0.012), (0.03, 0.08, 0.007), (0.08, 1.0, 0.004)):
        band = (r <= 1 - begin) & (r > 1 - end)
        assert np.sqrt(np.mean(field[band] ** 2)) < rms
        assert np.mean(nodal[band] ** 2) > 4 * np.mean(field[band] ** 2) or begin == 0.08


@pytest.mark.parametrize("grid", ["dual", *slow("primal")])
def test_field_of_an_ellipse_pressed_out_of_its_middle(grid):
    """Down to a twentieth of the width of the cells at the edge, where the polygon is still
    nearer to the ellipse than the points."""
    a, b, e = 1.0, 0.5, (0.1, 0.05)
    dual = DualMesh.from_mesh(ellipse(4, a, b))
    basis = dual.basis() if grid == "dual" else dual.primal_basis()
    field, p = RigidPunch(SOIL, basis).solve(force=1.0, at=e).pressure_field()
    r, angle = np.random.default_rng(1).uniform([[0.3], [0.0]], [[0.998], [2 * np.pi]], (2, 6000))
    x, y = r * np.cos(angle), r * np.sin(angle)
    exact = (1 + 3 * (e[0] * x / a + e[1] * y / b)) / (2 * np.pi * a * b * np.sqrt(1 - r**2))
    x = np.array([a * x, b * y])
    ends = field.mesh.p[:, field.mesh.facets[:, field.mesh.boundary_facets()]]
    d = distance_to_segments(x, ends[:, 0], ends[:, 1])
    error = evaluate(field, p, x, outside="zero") / exact - 1
    for begin, end, rms in ((0.003, 0.03, 0.015), (0.01, 0.03, 0.01), (0.03, 0.08, 0.007)):
        band = (d > begin) & (d <= end)
        assert np.sqrt(np.mean(error[band] ** 2)) < rms


@pytest.mark.parametrize("name", [*PLANS, "one ring", "two triangles", "polar"])
def test_refinements_fill_the_mesh_and_follow_the_law(name):
    more = {
        "one ring": lambda: annulus(1, 24),
        "two triangles": lambda: MeshTri(),
        "polar": lambda: polar(4, 16),
    }
    mesh = PLANS[name][0]() if name in PLANS else more[name]()
    quads, times = isinstance(mesh, MeshQuad), 4 if mesh.nelements < 100 else 2
    basis = CellBasis(mesh, ElementQuad0() if quads else ElementTriP0())
    punch = RigidPunch(SOIL, basis)
    solution = punch.solve(settlement=1.0, tilt=(0.0, 0.0), unilateral=False)
    laws = EdgeLaws.of(solution, times, punch.weights.facets)
    fine = laws.refined
    where = fine.base.p[:, fine.base.t[:, fine.parent]]
    np.testing.assert_allclose(
        np.einsum("dik,ik->dk", where, fine.shares), fine.mesh.p, atol=1e-14
    )
    areas = np.abs(signed_areas(fine.mesh.p, fine.mesh.t))
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(np.abs(signed_areas(fine.base.p, fine.base.t)).sum())
    if not quads:  # conforming: the boundary is that of the mesh
        ends = fine.mesh.p[:, fine.mesh.facets[:, fine.mesh.boundary_facets()]]
        sides = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]]
        lengths = [np.hypot(*(q[:, 1] - q[:, 0])).sum() for q in (ends, sides)]
        assert lengths[0] == pytest.approx(lengths[1])
    # the law is finite, positive and greatest on the edge, and no triangle is all on it
    assert not fine.edge[fine.mesh.t].all(axis=0).any()
    assert (laws.at_nodes > 0).all()
    # loads by cells and by the nodes of the refinement are integrals of the same law
    by_cells = laws.of_cells(punch.footprint)[0].sum()
    by_nodes = areas @ laws.at_nodes[fine.mesh.t].mean(axis=0)
    assert by_nodes == pytest.approx(by_cells, rel=0.1 if name == "two triangles" else 0.02)


def test_field_of_a_sphere():
    """Hertz: p = p0 sqrt(1 - r^2 / a^2)."""
    for basis in (DualMesh.from_mesh(disc(4)).basis(), CellBasis(polar(), ElementQuad0())):
        punch = RigidPunch(SOIL, basis, gap=Paraboloid(radius=1.0))
        modulus = SOIL.contact_modulus
        a = 0.6
        solution = punch.solve(force=4 / 3 * modulus * a**3)
        field, p = solution.pressure_field()
        r = np.hypot(*field.doflocs)
        exact = 2 * modulus * a / np.pi * np.sqrt((1 - (r / a) ** 2).clip(0))
        assert np.sqrt(np.mean((p - exact) ** 2)) < 0.03 * exact.max()
        assert not p[r > a * 1.05].any()
        assert_carries(solution, field, p)


@pytest.mark.parametrize("grid", ["basis", *slow("primal_basis")])
def test_units_do_not_move_the_field(grid):
    """No rounding decides where cells are cut that the line of contact crosses."""
    mesh = polygon([[-1, 1, 1, -1], [-1, -1, 1, 1]], n=250)
    fields = []
    for unit in (1.0, 1e3):
        cells = getattr(DualMesh.from_mesh(mesh.scaled(unit)), grid)()
        punch = RigidPunch(HalfSpace(1.0, 0.3), cells, gap=Paraboloid(2.0 * unit))
        solution = punch.solve(0.15 * unit**2, at=(0.04 * unit, 0.02 * unit))
        assert solution.line is not None
        fields.append(solution.pressure_field()[1])
    assert fields[1] == pytest.approx(fields[0], abs=1e-9 * fields[0].max())


@pytest.mark.parametrize("grid", ["basis", *slow("primal_basis")])
@pytest.mark.parametrize("case", [*slow("whole"), "lifts off", "sphere"])
def test_renumbering_turning_and_mirroring_do_not_move_the_field(grid, case):
    mesh = polygon([[-1, 1, 1, -1], [-1, -1, 0.7, 1]], n=250)
    x, fields, levels = np.random.default_rng(1).uniform(-0.6, 0.6, (2, 300)), [], []
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    at = np.array((0.4, 0.15) if case == "lifts off" else (0.04, 0.02))
    for seed, place in ((None, np.eye(2)), (0, turn), (1, np.diag([1, -1]))):
        own = MeshTri(np.ascontiguousarray(place @ mesh.p), mesh.t)
        own = own if seed is None else renumbered(own, seed)
        gap = Paraboloid(2.0) if case == "sphere" else None
        punch = RigidPunch(SOIL, getattr(DualMesh.from_mesh(own), grid)(), gap=gap)
        solution = punch.solve(0.15, at=tuple(place @ at))
        assert (solution.line is not None) == (case == "sphere")
        fields.append(evaluate(*solution.pressure_field(refine=2), place @ x, outside="zero"))
        levels.append(np.sort(solution.contact_region.level))
    for field, level in zip(fields[1:], levels[1:], strict=True):
        assert field == pytest.approx(fields[0], abs=1e-9 * fields[0].max())
        assert level == pytest.approx(levels[0], abs=1e-9)


def test_one_node_carries_no_moments():
    """It has a force and no arm: refused at every node, whatever rounding makes of the matrix."""
    basis = CellBasis(disc(2), ElementTriP1())
    for k in range(basis.N):
        x, values = basis.doflocs[:, k], np.zeros(basis.N)
        values[k] = 1.0
        with pytest.raises(ConvergenceError, match="too few nodes have pressures"):
            balanced(basis, values, np.array([1.0, 0.3, -0.2]), (0.1, 0.0))
        own = field_resultant(basis, values)
        assert balanced(basis, values, 2 * own, (0.0, 0.0)) == pytest.approx(2 * values)
        assert own[1:] == pytest.approx(own[0] * x, abs=0.2 * own[0])


def test_what_is_balanced_does_not_pull():
    """Far from the middle, where one linear function would turn pressures into tension."""
    basis = CellBasis(disc(3), ElementTriP1())
    pulled = 0
    for x in (0.3, 0.5, 0.6):
        wanted = np.array([1.0, x, 0.1])
        values = np.exp(-4 * np.sum((basis.doflocs + 0.2) ** 2, axis=0))
        values[basis.doflocs[0] < -0.6] = 0.0
        signed = balanced(basis, np.where(values == 0, -1e-300, values), wanted, (0.0, 0.0))
        found = balanced(basis, values, wanted, (0.0, 0.0))
        assert found.min() >= 0
        assert (found[values == 0] == 0).all()
        assert field_resultant(basis, found) == pytest.approx(wanted, rel=1e-12)
        pulled += signed.min() < -0.01 * signed.max()
    assert pulled


def test_wrong_refinements():
    solution = RigidPunch(SOIL, DualMesh.from_mesh(rectangle(4)).basis()).solve(1.0)
    with pytest.raises(ValueError, match="refine from 0 to 6, got 9"):
        solution.pressure_field(9)
    with pytest.raises(TypeError, match="expected an integer for refine"):
        solution.pressure_field(1.5)
    with pytest.raises(TypeError, match="True or False for conserve, got 'no'"):
        solution.nodal_pressure(conserve="no")


def test_a_part_of_one_triangle_has_no_field():
    mesh = MeshTri.init_refdom()
    s = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(mesh).basis(), origin=(1 / 3, 1 / 3))
    with pytest.raises(MeshError, match=r"got triangle 0 alone.* Remedy: a finer mesh"):
        s.solve(1.0, unilateral=False).pressure_field()


@pytest.mark.parametrize("seed", [2, *slow(6)])
def test_rough_contact_has_no_peaks_of_its_own(seed):
    """Cells of which the end of contact leaves a sliver tell of no pressure in it."""
    n, rng = 24, np.random.default_rng(seed)
    line = np.linspace(0.0, 1.0, n + 1)
    basis = CellBasis(MeshQuad.init_tensor(line, line), ElementQuad0())
    k = np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    waves = np.where((k >= 2) & (k <= 5), np.maximum(k, 1) ** -1.8, 0)
    height = np.fft.irfft2(waves * np.exp(2j * np.pi * rng.random(k.shape)))
    height *= 1e-2 / height.std()
    punch = RigidPunch(HalfSpace(1.0, 0.3), basis, gap=(height.max() - height).ravel())
    for force in (0.003, 0.03):
        s = punch.solve(force=force, tilt=(0, 0))
        field, p = s.pressure_field(refine=2)
        assert p.max() < 2 * s.pressure.max()
        assert field_resultant(field, p) == pytest.approx(s.resultant, rel=1e-9)


def test_constant_cells_follow_the_law_of_the_edge():
    """Together to a fiftieth, where cubics between constant means were off by a sixth."""
    dual = DualMesh.from_mesh(generate.disc(n=300))
    below = RigidPunch(SOIL, dual.basis(), edge="constant", collocation="node").solve(1.0)
    above = RigidPunch(SOIL, dual.primal_basis(), edge="constant").solve(1.0)
    r, angle = np.random.default_rng(1).uniform([[0.0], [0.0]], [[0.95], [2 * np.pi]], (2, 3000))
    x, exact = r * np.array([np.cos(angle), np.sin(angle)]), 1 / (2 * np.pi * np.sqrt(1 - r**2))
    for field, most in (
        (pressure_field(below, other=above), 0.02),
        (pressure_field(above, other=below), 0.02),
        (above.pressure_field(), 0.07),
    ):
        assert evaluate(*field, x) == pytest.approx(exact, rel=most)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_fields_between_long_cells_near_their_ends(turn):
    """Cells ten times as long as wide have as many around them along as across."""
    cos, sin = np.cos(turn), np.sin(turn)
    place = np.array([[cos, -sin], [sin, cos]])

    def strip(nx, ny):
        mesh = MeshQuad.init_tensor(np.linspace(-1, 1, nx + 1), np.linspace(-10, 10, ny + 1))
        mesh = MeshQuad(place @ mesh.p, mesh.t)
        return RigidPunch(SOIL, CellBasis(mesh, ElementQuad0())).solve(1.0)

    x = place @ np.array([np.linspace(-0.9, 0.9, 91), np.full(91, 8.5)])
    field = strip(15, 15).pressure_field(refine=2)
    assert evaluate(*field, x) == pytest.approx(strip(20, 60).pressure_at(x), rel=0.05)


@pytest.mark.parametrize("kind", ["triangles", "quadrilaterals"])
def test_fields_between_long_and_thin_cells_have_no_holes(kind):
    """At a node far from all middles, in the root of the areas, the field was zero."""
    at = np.append(0.0, np.geomspace(3e-3, 1, 8)) / 2
    at = np.append(at, 1 - at[-2::-1])
    mesh = (MeshTri if kind == "triangles" else MeshQuad).init_tensor(at, at)
    element = ElementTriP0() if kind == "triangles" else ElementQuad0()
    punch = RigidPunch(HalfSpace(1.0, 0.0), CellBasis(mesh, element), origin=(0.5, 0.5))
    basis, values = punch.solve(1.0).pressure_field()
    x, y = basis.doflocs
    edge = values[(x < 1e-12) & (y > 0.05) & (y < 0.95)]
    assert edge.min() > 0.7 * np.median(edge)


def test_on_few_nodes_nothing_pulls():
    """The force and moments of three cells take tension on those of a coarse field."""
    mesh = generate.rectangle(2.0, 2.0, n=60)
    punch = RigidPunch(HalfSpace(1.0, 0.3), DualMesh.from_mesh(mesh).basis(), edge="constant")
    with pytest.warns(ResolutionWarning, match="3 of 61 cells"):
        solution = punch.solve(0.05, at=tuple(0.88 * mesh.p[:, 0]))
    for refine in (0, 1):
        with pytest.raises(ConvergenceError, match=r"without tension.*larger refine"):
            solution.pressure_field(refine=refine)
    assert solution.pressure_field(refine=2)[1].min() >= 0.0
