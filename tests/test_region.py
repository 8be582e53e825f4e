from math import gamma

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plans import disc, perturbed, polar, rectangle
from skfem import CellBasis, ElementQuad0, MeshQuad, MeshTri

from skfem_dual import (
    DualMesh,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    MeasuredProfile,
    Paraboloid,
    PeriodicGround,
    RigidPunch,
    RoundedCylinder,
    evaluate,
)
from skfem_dual.contact import plan_triangles
from skfem_dual.contact.plan_triangles import PlanTriangles
from skfem_dual.contact.planes import PlaneFit
from skfem_dual.elements.balance import field_resultant
from skfem_dual.grids import generate
from skfem_dual.grids.cellwise import nodal_mesh
from skfem_dual.grids.corners import signed_areas
from skfem_dual.grids.partition import Partition

UNIT = HalfSpace(1.0, 0.0)


def region_of(partition, mesh, pressure, gap, modulus):
    """Region by pressures and gaps of cells."""
    triangles = PlanTriangles.of(partition, mesh)
    fitted = triangles.fitted(pressure, gap, modulus)
    return triangles.with_thin(fitted, pressure, gap * 0.75 * modulus)


def circle(mesh, basis, radius, centre):
    """Region of cells whose pressure and gap follow the law at a circle's edge exactly."""
    partition = Partition.from_basis(basis)
    s = radius - np.hypot(*(partition.centroids - np.array(centre)[:, None]))
    strength, modulus = 7.0, 3.0
    pressure = strength * np.sqrt(s.clip(0))
    gap = 4 * strength / (3 * modulus) * (-s).clip(0) ** 1.5
    return region_of(partition, mesh, pressure, gap, modulus)


@pytest.mark.parametrize("grid", ["dual", "primal", "quadrilaterals"])
def test_the_law_at_the_edge_is_read_off(grid):
    radius, centre = 0.57, (0.03, -0.02)
    if grid == "quadrilaterals":
        mesh = MeshQuad.init_tensor(np.linspace(-1, 1, 26), np.linspace(-1, 1, 26))
        basis = CellBasis(mesh, ElementQuad0())
    else:
        mesh = perturbed(rectangle(25), 0.01)
        dual = DualMesh.from_mesh(mesh)
        basis = dual.basis() if grid == "dual" else dual.primal_basis()
    region = circle(mesh, basis, radius, centre)
    assert region.area == pytest.approx(np.pi * radius**2, rel=1.5e-2)
    (line,) = region.edge
    assert np.array_equal(line[:, 0], line[:, -1])  # closed
    r = np.hypot(*(line - np.array(centre)[:, None]))
    assert r == pytest.approx(radius, abs=0.1 * 0.08)  # a tenth of a cell
    x, y = line
    enclosed = np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2
    assert enclosed == pytest.approx(region.area)  # contact to the left: counter-clockwise
    within = region.mesh
    areas = np.abs(signed_areas(within.p, within.t))
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(region.area, rel=1e-5)
    edge = within.p[:, within.boundary_nodes()]
    assert np.hypot(*(edge - np.array(centre)[:, None])) == pytest.approx(radius, abs=0.1 * 0.08)
    crossed = region.crossed(mesh)
    corners = np.hypot(*(mesh.p[:, mesh.t[:, crossed]] - np.array(centre)[:, None, None]))
    assert (corners.min(axis=0) < radius + 0.03).all()
    assert (corners.max(axis=0) > radius - 0.03).all()
    assert "Lines of its edge: 1" in repr(region)


def test_full_and_no_contact():
    mesh = disc(3)
    of = RigidPunch(UNIT, DualMesh.from_mesh(mesh).basis())
    full = of.solve(1.0).contact_region
    assert full.area == pytest.approx(np.pi)
    assert full.edge == []
    assert full.mesh.nelements == mesh.nelements
    assert len(full.crossed(mesh)) == 0
    none = of.solve(settlement=-1.0, tilt=(0, 0)).contact_region
    assert (none.area, none.edge) == (0.0, [])


def test_ground_that_pulls_keeps_contact_under_shapes():
    """Everywhere, also around cells that press alone."""
    basis = DualMesh.from_mesh(disc(4)).basis()
    waves = RigidPunch(UNIT, basis, gap=lambda x: 0.1 * (1 + np.sin(12 * x[0]) * np.cos(9 * x[1])))
    found = waves.solve(1.0, unilateral=False)
    assert 0 < np.sum(found.pressure > 0) < len(found.pressure)
    assert found.contact_area == pytest.approx(np.pi, rel=1e-10)


def test_lines_that_end_on_the_edge_of_the_plan():
    """A wide punch lifts off at both ends of a long footing that is bent downwards."""
    mesh = rectangle(12, 1.0, 3.0)
    of = RigidPunch(
        UNIT, DualMesh.from_mesh(mesh).basis(), edge="singular", gap=lambda x: 0.05 * x[1] ** 2
    )
    region = of.solve(0.2).contact_region
    assert len(region.edge) == 2
    for line in region.edge:
        assert np.abs(line[0, [0, -1]]) == pytest.approx(1.0)
        assert np.ptp(line[1]) < 0.8
    assert 0 < region.area < 12


def test_polar_grids():
    basis = CellBasis(polar(), ElementQuad0())
    found = RigidPunch(UNIT, basis).solve(1.0, (0.5, 0.0))
    assert found.contact_area / np.pi == pytest.approx(0.73355, abs=3e-3)


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-10, 10)] * 3), st.integers(0, 1000))
def test_planes_are_fitted_exactly(plane, seed):
    rng = np.random.default_rng(seed)
    x, at = rng.random((2, 40)), rng.random((2, 10))
    a, b, c = plane
    found = PlaneFit.to_nearest(x, at)(a + b * x[0] + c * x[1])
    assert found[0] == pytest.approx(a + b * at[0] + c * at[1], abs=1e-6)
    assert found[1] == pytest.approx(b, abs=1e-6)
    assert found[2] == pytest.approx(c, abs=1e-6)


def test_planes_through_points_on_a_line():
    x = np.stack([np.arange(5.0), np.zeros(5)])
    assert PlaneFit.to_nearest(x, x[:, :2])(2 * x[0])[:2] == pytest.approx(
        np.array([[0, 2], [2, 2]])
    )


def test_contact_is_the_same_on_both_grids():
    """Cells of two kinds, one sphere."""
    dual = DualMesh.from_mesh(perturbed(rectangle(24), 0.01))
    areas = [
        RigidPunch(UNIT, basis, gap=Paraboloid(1.0)).solve(0.2).contact_area
        for basis in (dual.basis(), dual.primal_basis())
    ]
    assert areas[0] == pytest.approx(areas[1], rel=2e-2)


@pytest.mark.parametrize("grid", ["dual", "primal"])
def test_the_edge_under_a_sphere(grid):
    """By exact pressures and gaps of Hertz's contact on cells 0.08 wide, to 1/25 of one.

    K. L. Johnson, Contact Mechanics (1985), equations (3.42) and (4.22).
    """
    a, dual = 0.6, DualMesh.from_mesh(perturbed(rectangle(25), 0.01))
    mesh = dual.mesh
    partition = Partition.from_basis(dual.basis() if grid == "dual" else dual.primal_basis())
    r = np.hypot(*partition.centroids)
    beyond = np.maximum(r, a)
    settled = (2 * a**2 - beyond**2) * np.arcsin(a / beyond)
    settled = (settled + a * np.sqrt(beyond**2 - a**2)) / np.pi  # p0 = 2 a / pi, R = E* = 1
    gap = np.where(r > a, r**2 / 2 - a**2 + settled, 0.0)
    pressure = 2 / np.pi * np.sqrt((a**2 - r**2).clip(0))
    region = region_of(partition, mesh, pressure, gap, 1.0)
    assert np.hypot(*region.edge[0]) == pytest.approx(a, abs=0.04 * 0.08)
    assert region.area == pytest.approx(np.pi * a**2, rel=4e-3)


def test_the_edge_of_contact_that_was_found():
    """A disc that lifts off: areas on far finer meshes, 16 000 and 64 000 cells, extrapolated."""
    found = RigidPunch(UNIT, DualMesh.from_mesh(generate.disc(n=600)).basis())
    for e, area, error in ((0.5, 0.73355, 1e-3), (0.7, 0.35378, 4e-3), (0.8, 0.19170, 1e-2)):
        solution = found.solve(1.0, (e, 0.0))
        assert solution.contact_area / np.pi == pytest.approx(area, rel=error)


def test_cells_far_from_the_edge_do_not_count(monkeypatch):
    """Of many cells those near it are looked at: the same edge, on cells without symmetries."""
    mesh = perturbed(rectangle(40), 0.008)
    dual = DualMesh.from_mesh(mesh)
    for basis in (dual.basis(), dual.primal_basis()):
        whole = circle(mesh, basis, 0.57, (0.03, -0.02))
        monkeypatch.setattr(plan_triangles, "MANY", 0)
        near = circle(mesh, basis, 0.57, (0.03, -0.02))
        monkeypatch.undo()
        assert near.area == pytest.approx(whole.area, rel=1e-12)
        assert near.edge[0] == pytest.approx(whole.edge[0], abs=1e-12)
        assert np.array_equal(near.level > 0, whole.level > 0)
        assert np.abs(near.level - whole.level).max() > 0.01  # beyond, only the sign is known


def grids():
    """Bases of cells of three kinds, 16 times 16 nodes or quadrilaterals."""
    lines = np.linspace(0, 1, 17)
    dual = DualMesh.from_mesh(MeshTri.init_tensor(lines, lines))
    regular = CellBasis(MeshQuad.init_tensor(lines, lines), ElementQuad0())
    return {"dual": dual.basis(), "primal": dual.primal_basis(), "regular": regular}


@pytest.mark.parametrize("grid", ["dual", "primal", "regular"])
def test_cells_that_touch_alone_count_whole(grid):
    basis = grids()[grid]
    cells = Partition.from_basis(basis)
    some = np.zeros(len(cells), dtype=bool)
    for at in ((0.3, 0.4), (0.71, 0.32), (0.6, 0.8), (0.01, 0.6)):
        some[np.argmin(np.hypot(*(cells.centroids.T - at).T))] = True
    mesh = nodal_mesh(basis)
    found = region_of(cells, mesh, np.where(some, 2.0, 0.0), 1.0 * ~some, 1.0)
    assert found.area == pytest.approx(cells.areas[some].sum(), rel=1e-4)
    assert len(found.edge) == 4


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("grid", ["dual", "primal", "regular"])
def test_white_noise(grid, monkeypatch):
    """Nearly all that touches touches alone or in thin clusters, whose cells are counted."""
    basis = grids()[grid]
    n = len(Partition.from_basis(basis))
    heights = 0.03 * np.random.default_rng(0).standard_normal(n)
    punch = RigidPunch(UNIT, basis, gap=heights - heights.min(), origin=(0.5, 0.5))
    for force, rel in ((1e-3, 0.05), (1e-2, 0.05), (0.1, 0.09)):
        found = punch.solve(force)
        areas = punch.footprint.partition.areas[found.gap == 0]
        assert found.contact_area == pytest.approx(areas.sum(), rel=rel)
        assert found.mean_pressure * found.contact_area == pytest.approx(force)
        monkeypatch.setattr(plan_triangles, "MANY", 0)
        near = punch.solve(force).contact_area
        monkeypatch.undo()
        # the same but for corners of triangles, which are looked at with one of theirs
        assert near == pytest.approx(found.contact_area, rel=0.04)


def test_rough_surfaces():
    """Wave lengths down to four cells.

    Cells counted are too many by ``(pi - 1 + log(2)) / 24`` of a cell for each side between one in
    contact and one out of it: V. A. Yastrebov, G. Anciaux, J.-F. Molinari, Tribology
    International 114 (2017) 161-171.
    """
    n = 64
    k = np.hypot(*np.meshgrid(np.fft.fftfreq(n, 1 / n), np.fft.fftfreq(n, 1 / n)))
    amplitude = np.where((k >= 2) & (k <= 16), k.clip(1) ** -1.8, 0)
    noise = np.random.default_rng(0).standard_normal((n, n))
    heights = np.fft.ifft2(np.fft.fft2(noise) * amplitude).real
    lines = np.linspace(0, 1, n + 1)
    basis = CellBasis(MeshQuad.init_tensor(lines, lines), ElementQuad0())
    x, y = (n * Partition.from_basis(basis).centroids).astype(int)
    gap = 0.02 / heights.std() * (heights - heights.min())[x, y]
    punch = RigidPunch(UNIT, basis, gap=gap, origin=(0.5, 0.5))
    for force in (0.01, 0.1):
        found = punch.solve(force)
        inside, (i, j) = found.gap == 0, punch.footprint.partition.f2c
        sides = np.sum((j >= 0) & (inside[i] != inside[j]))
        expected = (inside.sum() - (np.pi - 1 + np.log(2)) / 24 * sides) / n**2
        assert found.contact_area == pytest.approx(expected, rel=0.06)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("grid", ["dual", "primal", "regular"])
def test_spheres_on_few_cells(grid):
    """Areas beside those of Hertz: as good as cells counted at first, then ever better."""
    basis = grids()[grid]
    size = np.sqrt(np.median(Partition.from_basis(basis).areas))
    errors = []
    for a in (0.6, 1.2, 1.7, 2.9, 4.4):
        radius, pairs = a * size, []
        for centre in ((0.5, 0.5), (0.506, 0.514), (0.5 + size / 2, 0.5), (0.48, 0.528)):
            punch = RigidPunch(UNIT, basis, gap=Paraboloid(1.0, centre), origin=centre)
            found = punch.solve(4 / 3 * radius**3)
            count = punch.footprint.partition.areas[found.gap == 0].sum()
            pairs.append([found.contact_area, count])
        errors.append(np.sqrt(np.mean((np.array(pairs) / (np.pi * radius**2) - 1) ** 2, axis=0)))
    fitted, counted = np.transpose(errors)
    assert (fitted < 1.2 * counted + 0.1).all()
    assert (fitted[2:] < counted[2:] / 1.3).all()
    assert (fitted[1:] < 1.1 * fitted[:-1]).all()
    assert fitted[-1] < 0.02


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("grid", ["dual", "triangles"])
def test_a_flat_end_on_two_rows_of_cells(grid):
    """No law of the edge is seen: cells count whole instead of a quarter of them."""
    gap, areas = RoundedCylinder(0.3, 2.0, (0.25, 0.5)), []
    for k in (2, 4):
        dual = DualMesh.from_mesh(MeshTri.init_symmetric().refined(k))
        basis = dual.basis() if grid == "dual" else dual.primal_basis()
        punch = RigidPunch(HalfSpace(1.0, 0.3), basis, gap=gap, origin=(0.5, 0.5))
        found = punch.solve(0.003)
        areas.append(found.contact_area)
        assert found.mean_pressure < found.pressure.max()
        _, values = found.pressure_field()
        assert values.min() >= 0
        assert values.max() < 1.5 * found.pressure.max()
    assert areas[0] == pytest.approx(areas[1], rel=0.4)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("settlement", [0.0125, 0.015, 0.016])
def test_a_post_beside_a_ball(settlement):
    """Of two spots that on too few cells counts whole, and keeps its force in the field."""
    post, ball = RoundedCylinder(0.15, 2.0), Paraboloid(1.5, (-2.0, 0.0))
    mesh = MeshQuad.init_tensor(np.linspace(-3, 1, 27), np.linspace(-1, 1, 14))
    basis = CellBasis(mesh, ElementQuad0())
    punch = RigidPunch(UNIT, basis, gap=lambda x: np.minimum(post(x), ball(x) - 0.1))
    found = punch.solve(settlement=settlement, tilt=(0.0, 0.0))
    cells = found.footprint.partition
    own = cells.centroids[0] > -1
    assert 3 < np.sum(own & (found.pressure > 0)) < 12 < np.sum(found.pressure > 0)
    field, values = found.pressure_field()
    right = field.mesh.p[0, field.mesh.t].mean(axis=0) > -1
    force = np.sum((field.interpolate(values) * field.dx)[right])
    assert force == pytest.approx(found.pressure[own] @ cells.areas[own], rel=0.05)


@pytest.mark.filterwarnings("ignore:contact on")
@pytest.mark.parametrize("grid", ["basis", "primal_basis"])
@pytest.mark.parametrize(("power", "n"), [(10, 300), (14, 300), (14, 600), (20, 600)])
def test_shapes_with_steep_sides(grid, power, n):
    """Under ``r^n`` (Sneddon): cells that press as those around were left out, up to a quarter."""
    basis = getattr(DualMesh.from_mesh(generate.disc(n=n)), grid)()
    punch = RigidPunch(UNIT, basis, gap=lambda x: np.hypot(*x) ** power)
    kappa = np.sqrt(np.pi) / 2 * power * gamma(power / 2) / gamma(power / 2 + 0.5)
    for radius in (0.4, 0.5, 0.65):
        found = punch.solve(2 * power / (power + 1) * kappa * radius ** (power + 1))
        assert 0.97 < found.contact_area / (np.pi * radius**2) < 1.14


def test_rows_along_the_edge_of_a_flat_punch():
    """A strip that lifts off across both axes, on few cells and on many."""
    few, many = (
        RigidPunch(UNIT, DualMesh.from_mesh(generate.rectangle(8.0, 1.0, n=n)).basis())
        for n in (60, 960)
    )
    for at, rel in (((2.4, 0.35), 0.12), ((1.6, 0.3), 0.03)):  # cells counted whole: 0.19, 0.04
        fine = many.solve(1.0, at=at).contact_area
        assert few.solve(1.0, at=at).contact_area == pytest.approx(fine, rel=rel)


@pytest.mark.parametrize("grid", ["quadrilaterals", "basis", "primal_basis"])
@pytest.mark.parametrize("case", ["flat", "sphere", "rough"])
def test_the_order_of_the_cells_of_regular_grids(grid, case):
    """Renumbered, turned by 90 degrees and mirrored: the same contact, to rounding."""
    lines = np.linspace(-1, 1, 18 if grid == "quadrilaterals" else 13)
    kind = MeshQuad if grid == "quadrilaterals" else MeshTri
    mesh = kind.init_tensor(lines, lines)
    height = {
        "flat": None,
        "sphere": lambda x: 0.5 * (x**2).sum(axis=0),
        "rough": lambda x: 0.1 * np.sin(7 * x[0] + 1) * np.cos(6 * x[1]) + 0.05 * x[0] * x[1],
    }[case]
    at = (0.8, 0.0) if case == "flat" else (0.0, 0.0)
    found = []
    for seed, place in (
        (None, np.eye(2)),
        (1, np.array([[0, -1], [1, 0]])),
        (2, np.diag([1, -1])),
    ):
        p, t = np.ascontiguousarray(place @ mesh.p), mesh.t
        if seed is not None:
            rng = np.random.default_rng(seed)
            number = rng.permutation(mesh.nvertices)
            t = number[t[:, rng.permutation(mesh.nelements)]]
            t = np.roll(t if len(t) == 4 else rng.permuted(t, axis=0), seed, axis=0)
            p = p[:, np.argsort(number)]
        own = kind(p, np.ascontiguousarray(t))
        quads = grid == "quadrilaterals"
        basis = (
            CellBasis(own, ElementQuad0()) if quads else getattr(DualMesh.from_mesh(own), grid)()
        )
        gap = height and (lambda x, back=place.T: height(np.tensordot(back, x, 1)))
        solution = RigidPunch(UNIT, basis, gap=gap).solve(0.2, at=tuple(place @ at))
        x = place.T @ Partition.from_basis(basis).centroids
        order = np.lexsort(np.round(x, 9))
        level = np.sort(solution.contact_region.level)
        values = [solution.contact_area, solution.settlement, *(place.T @ solution.tilt)]
        found.append((np.array(values), solution.pressure[order], level))
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            assert two == pytest.approx(one, abs=1e-10 * np.abs(one).max())


@pytest.mark.parametrize("n", [32, 64])
@pytest.mark.parametrize("pillars", [1, 8])
def test_flat_tops_with_steep_sides(n, pillars):
    """Gaps far too wide for the law of the edge drew it deep into cells in contact."""
    q = np.linspace(0.0, 1.0, n + 1)
    cells = CellBasis(MeshQuad.init_tensor(q, q), ElementQuad0())

    def gap(x):
        return np.where(((pillars * x) % 1 < 0.5).all(axis=0), 0.0, 0.1)

    for ground, load in (
        (PeriodicGround(HalfSpace(1.0, 0.0), (1.0, 1.0)), {}),
        (HalfSpace(1.0, 0.0), {"tilt": (0.0, 0.0)}),
    ):
        s = RigidPunch(ground, cells, gap=gap).solve(force=1e-3, **load)
        pressed = s.punch.partition.areas[s.pressure > 0].sum()
        assert pressed == pytest.approx(0.25, rel=1e-9)
        assert s.contact_area == pytest.approx(0.25, rel=0.05)
        assert s.mean_pressure == pytest.approx(4e-3, rel=0.05)


CORNERS = {
    "pillar of 8": lambda i, j: (abs(i - 11.5) < 4) & (abs(j - 11.5) < 4),
    "pillars of 6": lambda i, j: (i % 8 < 6) & (j % 8 < 6),
    "pits": lambda i, j: (i % 4 != 1) | (j % 4 != 1),
    "pits of 2": lambda i, j: (i % 4 > 1) | (j % 4 > 1),
    "round": lambda i, j: np.hypot(i - 11.5, j - 11.5) < 6.3,
}


@pytest.mark.parametrize("tops", CORNERS.values(), ids=CORNERS)
def test_corners_of_flat_tops_and_pits(tops):
    """Cells in contact all around were holes there, up to 24 % of the area."""
    line = np.linspace(-1.0, 1.0, 25)
    cells = CellBasis(MeshQuad.init_tensor(line, line), ElementQuad0())

    def gap(x):
        return np.where(tops(*np.floor(12 * (x + 1)).astype(int)), 0.0, 1.0)

    s = RigidPunch(HalfSpace(1.0, 0.0), cells, gap=gap).solve(force=0.05)
    high = gap(s.punch.collocation_points) == 0
    assert np.array_equal(s.pressure > 0, high)
    assert s.contact_area == pytest.approx(s.punch.partition.areas[high].sum(), rel=1e-3)
    field, p = s.pressure_field()
    x = s.punch.collocation_points[:, high]
    assert evaluate(field, p, x).min() > 0.2 * s.mean_pressure


@pytest.mark.parametrize(("n", "off"), [(24, 0.013), (32, 0.011), (48, 0.006)])
def test_gaps_hardly_wider_than_a_cell(n, off):
    """Amid contact the law of its edge saw none: 0.99 was in contact for 0.945, which is found
    by 96 and 160 cells along a period."""
    rng, m = np.random.default_rng(1), np.arange(-8, 9)
    k = np.hypot(m[:, None], m)
    phases = np.exp(2j * np.pi * rng.random(k.shape))
    waves = np.where((k >= 2) & (k <= 8), np.maximum(k, 1) ** -1.8, 0) * phases
    turn = np.exp(2j * np.pi * np.outer((np.arange(n) + 0.5) / n, m))
    height = (turn @ waves @ turn.T).real
    side = np.linspace(0.0, 1.0, n + 1)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    ground, gap = PeriodicGround(UNIT, (1.0, 1.0)), 1e-2 * (height.max() - height)
    s = RigidPunch(ground, cells, gap=gap.ravel() / height.std()).solve(force=0.2)
    assert s.contact_area == pytest.approx(0.945, abs=off)


@pytest.mark.parametrize("size", [0.3, 3.0])
def test_flat_ends_with_small_roundings(size):
    """Contact ends within the rounding, which is less than a cell: 0.55 to 0.7 of the area."""
    b, rounding = 0.6 * size, 1e-3 * size
    cells = DualMesh.from_mesh(generate.disc(n=600, radius=size)).basis()
    punch = RigidPunch(HalfSpace(1.0, 0.0), cells, gap=RoundedCylinder(b, rounding))
    s = punch.solve(0.3 * size**2)
    assert s.contact_area == pytest.approx(np.pi * b**2, rel=0.08)


@pytest.mark.parametrize("digits", [6, 8, 10])
def test_digits_of_coordinates_do_not_decide_on_the_contact_area(digits):
    """On a regular grid eight cells are as far from a corner as the last one that counts."""
    line = np.linspace(-1.0, 1.0, 25)
    mesh = MeshQuad.init_tensor(line, line)

    def gap(x):
        waves = 0.3 * np.cos(7 * x[0] + 1) * np.cos(5 * x[1])
        return 0.05 * (x[0] ** 2 + 0.7 * x[1] ** 2 + waves)

    areas = []
    for p in (mesh.p, np.round(mesh.p, digits)):
        basis = CellBasis(MeshQuad(p, mesh.t), ElementQuad0())
        punch = RigidPunch(HalfSpace(1.0, 0.3), basis, gap=gap)
        areas.append(punch.solve(force=0.02, at=(0.1, -0.05)).contact_area)
    assert areas[1] == pytest.approx(areas[0], rel=10.0 ** (1 - digits))


def test_where_a_period_is_cut_does_not_matter():
    n = 24
    line = np.linspace(0.0, 1.0, n + 1)
    cells = CellBasis(MeshQuad.init_tensor(line, line), ElementQuad0())
    x, y = cells.mesh.p[:, cells.mesh.t].mean(axis=1)
    waves = (3 * x + 2 * y, 4 * x - 3 * y + 0.16, x + 5 * y + 0.3)
    gap = 0.01 * sum(1 - np.cos(2 * np.pi * w) for w in waves).reshape(n, n)
    ground = PeriodicGround(HalfSpace(1.0, 0.3), (1.0, 1.0))
    found = [
        RigidPunch(ground, cells, gap=np.roll(gap, shift, (0, 1)).ravel()).solve(force=0.02)
        for shift in ((0, 0), (3, 0), (7, 11))
    ]
    areas = [s.contact_area for s in found]
    assert areas == pytest.approx([areas[0]] * 3, rel=1e-7)
    nodal = [s.nodal_pressure() for s in found]
    greatest = [values.max() for _, values in nodal]
    assert greatest == pytest.approx([greatest[0]] * 3, rel=1e-9)
    basis, values = nodal[0]
    assert field_resultant(basis, values)[0] == pytest.approx(0.02, rel=1e-12)


@pytest.mark.parametrize("seed", [4, 5])
def test_no_contact_without_a_cell_in_contact(seed):
    """Of a rough surface, where planes led above zero on an edge of the plan."""
    n, rng = 32, np.random.default_rng(seed)
    k = np.hypot(np.fft.fftfreq(n, 1 / n)[:, None], np.fft.rfftfreq(n, 1 / n))
    size = np.where((k >= 2) & (k <= 6), np.maximum(k, 1) ** -1.8, 0.0)
    heights = np.fft.irfft2(size * np.exp(2j * np.pi * rng.random(k.shape)), (n, n))
    mesh = MeshQuad.init_tensor(*[np.linspace(0, 1, n + 1)] * 2)
    gap = MeasuredProfile.from_heights(0.01 * heights / heights.std(), 1 / n)
    punch = RigidPunch(HalfSpace(2.0, 0.3), CellBasis(mesh, ElementQuad0()), gap=gap)
    found = punch.solve(0.01, tilt=(0, 0))
    x = punch.collocation_points[:, found.pressure > 0]
    drawn = found.contact_region
    middles = drawn.p[:, drawn.t[:, drawn.areas > 0]].mean(axis=1)
    far = np.abs(middles[:, :, None] - x[:, None]).max(axis=0).min(axis=1)
    assert far.max() < 1.6 / n


@pytest.mark.parametrize(
    ("grid", "n", "error"),
    [("quads", 128, 0.15), ("dual", 256, 0.06), ("triangles", 256, 0.06), ("dual", 600, 0.05)],
)
def test_contact_along_the_edge_on_a_crust(grid, n, error):
    """Pressures fall sooner than by the law: areas were down to two thirds; 1.10 +- 0.01 on all
    fine grids, and no smaller than what touches on coarse ones by more than 15 %."""
    ground = LayeredHalfSpace([Layer(0.4, 1.0, 0.3)], HalfSpace(0.1, 0.3))
    if grid == "quads":
        mesh = MeshQuad.init_tensor(np.linspace(-1, 1, 17), np.linspace(-0.5, 0.5, 9))
        basis = CellBasis(mesh, ElementQuad0())
    else:
        dual = DualMesh.from_mesh(generate.rectangle(2.0, 1.0, n=n))
        basis = dual.basis() if grid == "dual" else dual.primal_basis()
    found = RigidPunch(ground, basis).solve(1.0)
    assert found.contact_area == pytest.approx(1.10, rel=error)
