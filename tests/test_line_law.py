"""Pressures of shaped punches that end inside the cells, beside Hertz's."""

import numpy as np
import pytest
from marks import slow
from plans import perturbed
from scipy.special import ellipe, ellipk
from skfem import CellBasis, ElementQuad0, ElementTriP2, MeshQuad, MeshTri

from skfem_dual import (
    Cone,
    DualMesh,
    HalfSpace,
    MeasuredProfile,
    Paraboloid,
    RigidPunch,
    RigidPunches,
    load_path,
)
from skfem_dual.bodies import rigid
from skfem_dual.contact.exact import cone_pressure
from skfem_dual.contact.line_law import CellsOnLines
from skfem_dual.elements.line_weights import _mean_share
from skfem_dual.errors import ConvergenceWarning
from skfem_dual.grids.generate import disc, rectangle
from skfem_dual.ground.layered import Layer, LayeredHalfSpace
from skfem_dual.operators.symmetric_matrix import SymmetricMatrix

SOIL, A = HalfSpace(1.0, 0.0), 0.83
FORCE = 4 / 3 * A**3


def sphere(mesh, soil=SOIL):
    return RigidPunch(soil, DualMesh.from_mesh(mesh).basis(), gap=Paraboloid(1.0))


@pytest.fixture(scope="module")
def mesh():
    return perturbed(disc(n=820), 0.012)


@pytest.fixture(scope="module")
def pressed(mesh):
    return sphere(mesh).solve(FORCE)


def test_a_sphere_on_irregular_cells(pressed):
    assert 550 < np.sum(pressed.pressure > 0) < 580
    assert pressed.settlement == pytest.approx(A**2, rel=3e-5)
    assert pressed.contact_area == pytest.approx(np.pi * A**2, rel=6e-4)
    assert np.abs(pressed.tilt).max() < 5e-5
    assert pressed.complementarity_residual < 1e-12


def test_pressures_along_the_line(pressed):
    """Where constants are off by 8 % of the greatest pressure."""
    angle = np.linspace(0, 2 * np.pi, 2000)
    greatest = 2 * A / np.pi
    for r in (A - 0.05, A - 0.02, A + 0.03):
        x = r * np.array([np.cos(angle), np.sin(angle)])
        expected = greatest * np.sqrt(max(1 - (r / A) ** 2, 0.0))
        error = pressed.pressure_at(x) - expected
        assert np.sqrt(np.mean(error**2)) < 0.012 * greatest
    beyond = pressed.pressure_at(1.06 * A * np.array([np.cos(angle), np.sin(angle)]))
    assert not beyond.any()
    assert (pressed.pressure >= 0).all()
    basis, values = pressed.pressure_field()
    field = greatest * np.sqrt((1 - np.sum(basis.doflocs**2, axis=0) / A**2).clip(0))
    assert np.std(values - field) < 4e-3 * greatest


def in_the_middle(found):
    """Error of pressures in the middle, over the greatest: root of the mean square."""
    x = np.random.default_rng(0).uniform(-0.3, 0.3, (2, 4000))
    exact = 2 * A / np.pi * np.sqrt(1 - np.sum(x**2, axis=0) / A**2)
    return np.sqrt(np.mean((found.pressure_at(x) - exact) ** 2)) * np.pi / (2 * A)


def test_pressures_in_the_middle(pressed):
    """Constants in the cells are off by 1e-2, and so by 1e-3 in the mean."""
    assert in_the_middle(pressed) < 1e-4
    coarse = sphere(perturbed(disc(n=205), 0.024)).solve(FORCE)
    assert in_the_middle(pressed) < in_the_middle(coarse) / 2**2.5
    basis, field = pressed.pressure_field()
    assert field.max() == pytest.approx(2 * A / np.pi, rel=1e-4)
    basis, nodal = pressed.nodal_pressure(conserve=False)
    r = np.hypot(*basis.doflocs)
    exact = 2 * A / np.pi * np.sqrt((1 - (r / A) ** 2).clip(0))
    assert np.abs(nodal - exact)[r < 0.3].max() < 3e-4


def test_a_cone():
    """Farther from its tip than two cells."""
    angle, force = 0.2, np.pi / 2 * 0.8**2 * np.tan(0.2)
    punch = RigidPunch(SOIL, DualMesh.from_mesh(disc(n=600)).basis(), gap=Cone(angle))
    found = punch.solve(force)
    x = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 4000))
    x = x[:, (np.hypot(*x) > 0.2) & (np.hypot(*x) < 0.6)]
    error = found.pressure_at(x) - cone_pressure(x, force, angle, 1.0, 0.0)
    assert np.sqrt(np.mean(error**2)) < 2e-3 * force / (np.pi * 0.8**2)
    assert (found.pressure_at(np.random.default_rng(1).uniform(-1, 1, (2, 9999))) >= 0).all()


def test_rough_shapes_do_not_pull():
    """Slopes that would turn pressures negative between hills are left out."""
    hills = lambda x: 0.3 * np.sum(x**2, axis=0) + 0.02 * np.cos(23 * x[0]) * np.cos(19 * x[1])  # noqa: E731
    found = RigidPunch(SOIL, DualMesh.from_mesh(disc(n=600)).basis(), gap=hills).solve(0.5)
    assert found.success
    assert found.flat.any()
    assert not found.slopes[:, found.flat].any()
    assert found.pressure_at(np.random.default_rng(1).uniform(-1, 1, (2, 9999))).min() == 0


def ellipse(a, b):
    """Curvatures, settlement and force of contact on an ellipse, with the largest pressure 1.

    Source: K. L. Johnson, Contact Mechanics (1985), section 4.2.
    """
    m = 1 - (b / a) ** 2
    k, e = ellipk(m), ellipe(m)
    return b / (a**2 * m) * np.array([k - e, (a / b) ** 2 * e - k]), b * k, 2 / 3 * np.pi * a * b


@pytest.mark.parametrize("angle", [0.7, *slow(0.0)])
def test_an_ellipse_on_stretched_cells(angle):
    """What is near is so by cells: by plain distance it lies in a row across the contact."""
    a, b = 0.8, 0.08
    curvatures, settlement, force = ellipse(a, b)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    mesh = rectangle(2, 2, n=1000)
    mesh = MeshTri(turned @ (mesh.p * [[1], [0.13]]), mesh.t)
    shape = lambda x: curvatures @ np.tensordot(turned.T, x, 1) ** 2  # noqa: E731
    punch = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), gap=shape)
    found = punch.solve(force)
    assert found.settlement == pytest.approx(settlement, rel=4e-4)
    assert found.pressure.max() == pytest.approx(1, rel=5e-3)
    assert found.contact_area == pytest.approx(np.pi * a * b, rel=1e-2)


@pytest.mark.parametrize("seed", [227, 98])
def test_no_peaks_inside_uneven_cells(seed):
    """Rows and columns at random: pressures were up to 25 times too high in points."""
    random = np.random.default_rng(seed)
    nx, ny = random.integers(10, 18, 2)
    x, y = (1.4 * np.r_[-1, np.sort(random.uniform(-1, 1, n - 1)), 1] for n in (nx, ny))
    dual = DualMesh.from_mesh(MeshTri.init_tensor(x, y))
    found = RigidPunch(SOIL, dual.basis(), gap=Paraboloid(1.0)).solve(4 / 3)
    x = np.random.default_rng(0).uniform(-0.9, 0.9, (2, 4000))
    greatest = found.pressure_at(x[:, np.hypot(*x) < 0.85]).max()
    assert found.pressure.max() < 2 * (2 / np.pi)
    assert greatest < 2.5 * (2 / np.pi)
    assert found.settlement == pytest.approx(1, rel=3e-2)


def test_an_ellipse_on_cells_of_many_lengths():
    """Cells that reach into the contact by a little, and rows a thousandth as wide as others."""
    n, (a, b) = 35, (0.789, 0.458)
    curvatures, settlement, force = ellipse(a, b)
    x = np.linspace(-1, 1, n)
    mesh = MeshTri.init_tensor(x, np.where(x < 0, x, x**3))
    turn, middle = np.array([[0.790, 0.613], [-0.613, 0.790]]), np.array([-0.056, -0.142])
    shape = lambda x: curvatures @ np.tensordot(turn, x - middle[:, None], 1) ** 2  # noqa: E731
    found = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), gap=shape).solve(force, at=middle)
    assert found.settlement == pytest.approx(settlement, rel=1e-4)
    assert found.pressure.max() == pytest.approx(1, rel=1e-2)


def test_loads_carry_the_same_law(pressed):
    fine = CellBasis(disc(n=150).scaled(1.01), ElementTriP2())
    f, x = pressed.load_vector(fine), fine.doflocs
    assert [f.sum(), *(x @ f)] == pytest.approx([FORCE, 0, 0], abs=1e-12)
    # integral of p r^2 is 2/5 a^2 of the force
    assert np.sum(x**2, axis=0) @ f == pytest.approx(0.4 * A**2 * FORCE, rel=5e-4)
    assert pressed.force == pytest.approx(FORCE, rel=1e-12)


def test_the_ground_meets_the_sphere(pressed):
    """Between the collocation points, too, and by exact sums in cells of both kinds."""
    x = np.random.default_rng(0).uniform(-0.55, 0.55, (2, 100))
    shape = pressed.settlement - np.sum(x**2, axis=0) / 2
    assert pressed.ground_displacement(x) == pytest.approx(shape, abs=2e-3 * A**2)
    points = pressed.punch.collocation_points[:, pressed.gap == 0]
    shape = pressed.settlement - np.sum(points**2, axis=0) / 2
    assert pressed.ground_displacement(points) == pytest.approx(shape, abs=1e-4 * A**2)


def test_means_of_roots_times_coordinates():
    """Of x over triangles, by hand."""
    roots = np.sqrt(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [2.0, 2.0, 2.0]]).T.clip(1e-40))
    assert _mean_share(*roots) == pytest.approx([16 / 105, 8 / 35, np.sqrt(2) / 3], rel=1e-12)
    rng = np.random.default_rng(0)
    a, b, c = rng.random((3, 1, 1))  # by Gauss's rule, in coordinates that take the root away
    x, w = np.polynomial.legendre.leggauss(40)
    u, v = np.meshgrid((1 + x) / 2, (1 + x) / 2)
    one, two = 1 - u, u * (1 - v)
    s = one * a**2 + two * b**2 + (u - two) * c**2
    expected = np.sum(np.outer(w, w) / 2 * u * np.sqrt(s) * one)
    assert _mean_share(a, b, c).item() == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("soil", [SOIL, *slow(LayeredHalfSpace([Layer(1.0, 1.0, 0.3)], SOIL))])
def test_beside_a_flat_footing_that_lifts_off(soil):
    """Whose cells without slopes count in the equations, and the order of both does not."""
    sphere = RigidPunch(soil, DualMesh.from_mesh(disc(n=150)).basis(), gap=Paraboloid(2.0))
    mesh = disc(n=100).translated((2.5, 0.0))
    footing = RigidPunch(soil, DualMesh.from_mesh(mesh).basis(), origin=(2.5, 0.0))
    loads = {"force": 0.3}, {"force": 0.1, "at": (0.5, 0.0)}
    pair = RigidPunches([sphere, footing]).solve(loads)
    assert pair.success
    assert pair[0].line is not None
    assert pair[1].flat.any()
    turned = RigidPunches([footing, sphere]).solve(loads[::-1])
    for one, other in zip(pair.solutions, turned.solutions[::-1], strict=True):
        assert one.pressure == pytest.approx(other.pressure, abs=1e-9 * one.pressure.max())
    # gaps by an operator of their own
    x = footing.collocation_points
    w = pair[1].ground_displacement(x) - pair[1].punch_displacement(x, collocated=True)
    assert w == pytest.approx(pair[1].gap, abs=1e-8 * pair[1].settlement)


def test_symmetric_cells():
    """By blocks of the matrix the same, lines and all."""
    mesh, gap = MeshTri.init_circle(4), Paraboloid(1.0, (0.1, 0.05))
    basis = DualMesh.from_mesh(mesh).basis()
    whole, blocks = (
        RigidPunch(SOIL, basis, gap=gap, symmetry=s).solve(0.2) for s in (None, "auto")
    )
    assert isinstance(blocks.punch.operator, SymmetricMatrix)
    assert whole.line is not None
    assert blocks.settlement == pytest.approx(whole.settlement, rel=1e-10)
    assert blocks.contact_area == pytest.approx(whole.contact_area, rel=1e-8)


def test_layers():
    """A layer like what is below it, whose matrix is made anew."""
    found = sphere(disc(n=300), LayeredHalfSpace([Layer(1.0, 1.0, 0.0)], SOIL)).solve(FORCE)
    assert found.line is not None
    assert found.settlement == pytest.approx(A**2, rel=1e-4)
    assert found.contact_area == pytest.approx(np.pi * A**2, rel=3e-3)


def test_a_force_beside_the_middle(mesh):
    """A sphere that is moved leaves the same traces elsewhere."""
    dual = DualMesh.from_mesh(mesh)
    moved = RigidPunch(SOIL, dual.basis(), gap=Paraboloid(1.0, (0.1, 0.05)), origin=(0.1, 0.05))
    found = moved.solve(4 / 3 * 0.6**3)
    assert found.settlement == pytest.approx(0.36, rel=1e-4)
    assert found.contact_area == pytest.approx(np.pi * 0.36, rel=2e-3)
    assert np.abs(found.tilt).max() < 1e-4


def test_who_has_it(mesh):
    of = sphere(mesh)
    few = of.solve(4 / 3 * 0.2**3)
    assert few.line is None
    assert of.solve(FORCE, unilateral=False).line is None
    flat = RigidPunch(SOIL, of.basis).solve(1.0, (0.5, 0.0))
    assert flat.line is None
    with pytest.raises(ValueError, match="singular"):
        of.solve(FORCE).edge_coefficient()


def test_entries_of_the_line_are_checked(monkeypatch):
    """An entry that is off by a hundredth is seen by rows that do not come from the matrix."""
    assemble = CellsOnLines.matrix.func
    punch = sphere(disc(n=300))
    number = next(
        i for i in punch.exact_rows.numbers if np.hypot(*punch.collocation_points[:, i]) < 0.5
    )

    def corrupt(self):
        matrix = assemble(self)
        matrix[number, number] *= 1.01
        return matrix

    assert punch.solve(FORCE).success
    monkeypatch.setattr(CellsOnLines, "matrix", property(corrupt))
    with pytest.warns(ConvergenceWarning, match=f"under cell {number} settles by"):
        found = punch.solve(FORCE)
    assert found.line is not None
    assert not found.success


def test_the_tolerance_is_that_of_the_caller(monkeypatch):
    """Positions on the line that are off by 1e-5 are within a tolerance of 1e-6 only."""
    punch, answer = sphere(disc(n=300)), rigid.find_contact

    def off(system, constraints, how, start):
        contact, position = answer(system, constraints, how, start)
        return contact, position * (1 + 1e-5 * (how.method == "active-set"))

    monkeypatch.setattr(rigid, "find_contact", off)
    assert punch.solve(FORCE, gap_rtol=1e-6).success
    with pytest.warns(ConvergenceWarning, match="apart in contact"):
        assert not punch.solve(FORCE, gap_rtol=1e-8).success


def test_coarse_gaps_leave_the_line_out():
    punch = sphere(disc(n=300))
    coarse, fine = (punch.solve(FORCE, gap_rtol=tolerance) for tolerance in (1e-3, 1e-4))
    assert coarse.line is None
    assert fine.line is not None
    errors = [abs(found.settlement / A**2 - 1) for found in (coarse, fine)]
    assert errors[0] < 2e-3
    assert 5 * errors[1] < errors[0]
    assert punch.solve_many([{"force": FORCE}], gap_rtol=1e-3)[0].line is None


def same(one, other, rtol=1e-10):
    assert one.line is not None
    assert one.settlement == pytest.approx(other.settlement, rel=rtol)
    assert one.tilt == pytest.approx(other.tilt, abs=rtol)
    assert np.abs(one.pressure - other.pressure).max() < rtol * other.pressure.max()
    assert np.abs(one.gap - other.gap).max() < rtol
    assert one.contact_area == pytest.approx(other.contact_area, rel=rtol)


def test_many_cases_are_those_alone():
    punch = sphere(disc(n=300))
    cases = [{"force": f * FORCE, "at": (e, 0.0)} for f, e in ((1.0, 0.0), (0.4, 0.1), (0.7, 0.0))]
    alone = [punch.solve(**case) for case in cases]
    for found, expected in zip(punch.solve_many(cases).solutions, alone, strict=True):
        same(found, expected)
    for found, expected in zip(load_path(punch, cases).solutions, alone, strict=True):
        same(found, expected)


def test_groups():
    """One body in a group is itself, one far from the other nearly so, and cases are as alone."""
    mesh, far = disc(n=300), 1e4
    one = sphere(mesh)
    moved = DualMesh.from_mesh(mesh.translated((far, 0.0))).basis()
    other = RigidPunch(SOIL, moved, gap=Paraboloid(1.0, (far, 0.0)), origin=(far, 0.0))
    basis = DualMesh.from_mesh(disc(n=50).translated((0.0, far))).basis()
    flat = RigidPunch(SOIL, basis, origin=(0.0, far))
    alone, load = one.solve(FORCE), {"force": FORCE}
    same(RigidPunches([one]).solve([load])[0], alone)
    group = RigidPunches([one, flat, other])
    loads = [load, {"force": 1.0}, {"force": 0.7 * FORCE}]
    first, middle, last = group.solve(loads)
    assert first.settlement == pytest.approx(alone.settlement, rel=3e-4)
    assert first.contact_area == pytest.approx(alone.contact_area, rel=1e-6)
    assert last.settlement == pytest.approx(one.solve(0.7 * FORCE).settlement, rel=3e-4)
    assert middle.line is None
    for found, expected in zip(group.solve_many([loads]), (first, middle, last), strict=True):
        if expected is not middle:
            same(found.solutions[0], expected)
    # settlements beside all of them count the law of each
    x = one.collocation_points[:, first.gap == 0]
    shape = first.punch_displacement(x) - np.sum(x**2, axis=0) / 2
    assert last.ground_displacement(x) == pytest.approx(shape, abs=1e-9)


def test_little_of_a_cell_in_contact_does_not_carry_it():
    """Where cells beyond the line press, their pressures would be many times the others."""
    hills = lambda x: 0.1 * np.sum(x**2, axis=0) + 0.01 * np.cos(14 * x[0]) * np.cos(11 * x[1])  # noqa: E731
    mesh = perturbed(disc(n=600), 0.012)
    found = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis(), gap=hills).solve(0.1)
    assert found.success
    assert found.line.constant.any()
    x = np.random.default_rng(1).uniform(-1, 1, (2, 9999))
    assert found.pressure_at(x).max() < 2 * found.pressure.max()


def test_thin_contact_of_rough_shapes_has_none():
    """Among islands of few cells pressures with the law are farther from those of finer cells."""
    heights = np.random.default_rng(3).random((18, 18))
    heights = MeasuredProfile((np.linspace(-1.2, 1.2, 18),) * 2, 1e-2 * heights)

    def pressed(k):
        side = np.interp(np.arange(15 * k + 1) / k, np.arange(16), np.linspace(-1, 1, 16) ** 3 / 5)
        side += 0.8 * np.linspace(-1, 1, 15 * k + 1)
        cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
        return RigidPunch(SOIL, cells, gap=heights)

    mean = pressed(3).solve(0.02, gap_rtol=1e-3).pressure.reshape(15, 3, 15, 3).mean(axis=(1, 3))
    coarse = pressed(1)
    errors = [
        np.linalg.norm(coarse.solve(0.02, gap_rtol=rtol).pressure - mean.ravel())
        for rtol in (1e-10, 1e-3)
    ]
    assert np.sum(coarse.solve(0.02).pressure > 0) >= 60
    assert errors[0] <= 1.01 * errors[1] < 0.5 * np.linalg.norm(mean)


@pytest.mark.filterwarnings("ignore::skfem_dual.ResolutionWarning")
@pytest.mark.parametrize("force", [1e-3, 1e-5, 1e-6])
def test_a_flat_neighbour_that_hardly_touches(force):
    """In either order the sphere has its law, as alone."""
    mesh = MeshTri.init_sqsymmetric().translated((-0.5, -0.5)).scaled(2.0).refined(2)
    flat = RigidPunch(SOIL, DualMesh.from_mesh(mesh).basis())
    cells = DualMesh.from_mesh(MeshTri.init_circle(3).translated((2.3, 0.0))).basis()
    sphere = RigidPunch(SOIL, cells, origin=(2.3, 0.0), gap=Paraboloid(2.0, (2.3, 0.0)))
    light, heavy = {"force": force, "at": (0.0, -0.1)}, {"force": 0.3}
    alone = sphere.solve(0.3)
    found = [
        RigidPunches([flat, sphere]).solve([light, heavy])[1],
        RigidPunches([sphere, flat]).solve([heavy, light])[0],
    ]
    for each in found:
        assert each.success
        assert each.line is not None
        assert each.settlement == pytest.approx(alone.settlement, rel=force + 1e-5)
    assert found[0].settlement == pytest.approx(found[1].settlement, rel=1e-9)


@pytest.mark.parametrize("seed", [1, 3, 7])
def test_cells_scattered_over_the_plan(seed):
    """Beside those on the line lie some so far from it that their law is not known: NaN."""
    rng = np.random.default_rng(seed)
    mesh = MeshQuad.init_tensor(np.linspace(-1, 1, 18), np.linspace(-1, 1, 24))
    mesh = mesh.restrict(np.nonzero(rng.random(mesh.nelements) < 0.35)[0])
    gap = 0.05 * rng.random(mesh.nelements)
    punch = RigidPunch(
        HalfSpace(1.0, 0.3), CellBasis(mesh, ElementQuad0()), gap=gap, edge="constant"
    )
    found = punch.solve(force=0.3)
    assert found.success
    assert found.force == pytest.approx(0.3, rel=1e-12)
