"""Plates of one thickness on the ground, against rigid and limp ones, and columns on them."""

import dataclasses
from types import SimpleNamespace

import meshio
import numpy as np
import pytest
from marks import slow
from scipy.sparse import diags
from skfem import (
    BilinearForm,
    CellBasis,
    ElementTriMorley,
    ElementTriP0,
    ElementTriP1,
    ElementTriP2,
    LinearForm,
    MeshTri,
)
from skfem.assembly import Dofs
from skfem.helpers import dd, ddot, eye, trace

from skfem_dual import (
    ConvergenceWarning,
    DualMesh,
    ElasticPunch,
    HalfSpace,
    Paraboloid,
    Plan,
    Plate,
    Punches,
    ResolutionWarning,
    RigidPunch,
    column_load,
    flexible_settlement,
)
from skfem_dual.bodies.plates import excess_under_columns
from skfem_dual.contact.one_sign import solved
from skfem_dual.grids.generate import annulus, polygon, rectangle
from skfem_dual.io import write_solution, write_structure
from skfem_dual.operators import resources
from skfem_dual.report.bodies import bodies_of
from skfem_dual.report.details import Details

SOIL = HalfSpace(young=30e3, poisson=0.3)
RAFT = Plate(thickness=0.4, young=30e6, poisson=0.2)
SITE = np.array([451204.5, 5411903.25])


def cells(n=120, at=(0.0, 0.0)):
    return DualMesh.from_mesh(rectangle(6.0, 4.0, n=n).translated(at)).basis()


def weight(basis):
    return LinearForm(lambda v, w: 1.0 * v).assemble(basis)


@pytest.fixture(scope="module")
def loaded():
    """The raft under a column with moments."""
    punch = RAFT.on(SOIL, cells())
    load = {"sides": (0.5, 0.8), "moments": (30.0, -45.0)}
    return punch.solve(column_load(punch.structure, (1.0, -0.5), 900.0, **load))


def test_the_same_as_by_forms_of_ones_own(loaded):
    basis = CellBasis(loaded.punch.structure.mesh, ElementTriMorley())
    D, nu = 30e6 * 0.4**3 / 12 / 0.96, 0.2

    @BilinearForm
    def bending(u, v, _):
        return D * ddot((1 - nu) * dd(u) + nu * eye(trace(dd(u)), 2), dd(v))

    own = ElasticPunch(SOIL, loaded.punch.basis, basis, bending.assemble(basis)).solve(loaded.f)
    assert own.pressure == pytest.approx(loaded.pressure, rel=1e-6, abs=1e-6)
    assert own.deflection_range == pytest.approx(loaded.deflection_range, rel=1e-8)


def test_force_and_moments_of_columns_are_kept(loaded):
    """The moments press down larger y, and smaller x."""
    x = 900 * 1.0 - 45, 900 * -0.5 + 30
    assert loaded.resultant == pytest.approx([900.0, *x], rel=1e-10)
    basis = loaded.punch.structure
    narrow = column_load(basis, (0.3, 0.2), 7.0, sides=(0.0, 0.5), moments=(2.0, 0.0))
    for f, by, expected in (
        (column_load(basis, (3.0, 2.0), 5.0), lambda x: x[0] + x[1], 25.0),  # in a corner
        (narrow, lambda x: 1 + x[1], 7.0 * 1.2 + 2.0),
    ):
        assert f @ basis.project(by) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("grid", ["dual", "triangles"])
def test_anywhere_on_the_site(loaded, grid):
    """Coordinates of maps have digits for 1e-10 of the plan."""
    dual = cells(at=SITE).dual
    punch = RAFT.on(SOIL, dual.basis() if grid == "dual" else dual.primal_basis(), origin=SITE)
    load = {"sides": (0.5, 0.8), "moments": (30.0, -45.0)}
    column = SITE + np.array([1.0, -0.5])
    far = punch.solve(column_load(punch.structure, column, 900.0, **load))
    assert far.resultant == pytest.approx([900.0, 855.0, -420.0], rel=1e-8)
    x = np.array([[0.0, 2.5, -2.5], [0.0, 1.5, 1.5]])
    close = 1e-5 if grid == "dual" else 1e-2
    assert far.deflection(x + SITE[:, None]) == pytest.approx(loaded.deflection(x), rel=close)


def test_stiff_and_limp_plates():
    basis = cells()
    stiff = Plate(4.0, 30e9, 0.2).on(SOIL, basis)
    solution = stiff.solve(column_load(stiff.structure, (0.4, 0.2), 500.0))
    rigid = RigidPunch(SOIL, basis).solve(500.0, at=(0.4, 0.2))
    x = np.array([[0.0, 2.9, -2.9], [0.0, 1.9, 1.9]])
    collocated = rigid.punch_displacement(x, collocated=True)
    assert solution.deflection(x) == pytest.approx(collocated, rel=1e-5)
    at = np.array([[0.0, 1.0], [0.0, -0.5]])
    settled = flexible_settlement(SOIL, basis, 12.0, at)
    for unilateral in (True, False):
        solution = limp(basis, 1e-3, unilateral)
        assert solution.deflection(at) == pytest.approx(settled, rel=5e-3)


def limp(basis, thickness, unilateral=False):
    """Under a load of 12 all over."""
    plate = Plate(thickness, 30e3, 0.2).on(SOIL, basis, edge="constant")
    return plate.solve(12.0 * weight(plate.structure), unilateral=unilateral)


@pytest.mark.parametrize("thickness", [5e-4, *slow(*np.geomspace(5e-4, 5e-3, 5)[1:])])
def test_limp_plates_as_far_as_rounding_lets(thickness):
    """Deflections are differences of far larger ones; that of the ground alone is known."""
    basis, at = cells(), np.zeros((2, 1))
    settled = flexible_settlement(SOIL, basis, 12.0, at)
    for unilateral in (True, False):
        solution = limp(basis, thickness, unilateral)
        assert solution.success
        assert solution.deflection(at) == pytest.approx(settled, rel=5e-4)


def test_plates_too_limp_for_rounding_are_told():
    with pytest.warns(ConvergenceWarning, match="by rounding deflections are known to"):
        assert not limp(cells(), 1e-4).success


def _frame(half, n):
    """Cells of a square frame with sides 2."""
    corners = np.array([[-1.0, 1, 1, -1], [-1, -1, 1, 1]])
    inner = (1 - 2 * half) * corners
    return DualMesh.from_mesh(polygon(corners, holes=[inner], n=n)).basis()


@pytest.mark.parametrize(
    "basis",
    [_frame(0.1, 40), _frame(0.05, 80), DualMesh.from_mesh(annulus(0.8, n=16)).basis()],
    ids=["frame", "thin frame", "ring"],
)
def test_cells_around_a_corner_whose_centroids_lie_outside(basis, tmp_path):
    """Deflections there are means over the cells: a stiff plate is a rigid punch."""
    stiff = Plate(10.0, 1e9, 0.2).on(HalfSpace(1.0, 0.3), basis)
    x = stiff.collocation_points
    assert (stiff.footprint.fan.locate(x) < 0).any()
    linear = stiff.structure.project(lambda x: 3 + 2 * x[0] - x[1])
    assert stiff.trace @ linear == pytest.approx(3 + 2 * x[0] - x[1], rel=1e-9)
    load = LinearForm(lambda v, w: (1 + 0.2 * w.x[0]) * v).assemble(stiff.structure)
    solution = stiff.solve(load)
    assert solution.success
    force, at = load @ stiff.structure.project(lambda x: 1 + 0 * x[0]), solution.centre_of_pressure
    assert solution.force == pytest.approx(force, rel=1e-9)
    rigid = RigidPunch(HalfSpace(1.0, 0.3), basis, origin=(0.0, 0.0)).solve(force, at=at)
    found = rigid.punch_displacement(x, collocated=True)
    assert solution.cell_deflections == pytest.approx(found, rel=1e-6)
    ((least, most),) = bodies_of(solution, Details())[0].deflections
    ends = rigid.punch_displacement(basis.partition.polygons.p, collocated=True)
    assert (least, most) == pytest.approx((ends.min(), ends.max()), rel=1e-4)
    pad = DualMesh.from_mesh(rectangle(1.0, 1.0, n=40).translated((9.0, 0.0))).basis()
    neighbours = Punches([stiff, RigidPunch(HalfSpace(1.0, 0.3), pad, origin=(9.0, 0.0))])
    found = neighbours.solve([load, {"force": 1.0}]).solutions
    write_solution(tmp_path / "both.vtu", *found)
    written = np.concatenate(meshio.read(tmp_path / "both.vtu").cell_data["displacement"])
    assert np.isin(found[0].cell_deflections.round(12), written.round(12)).all()


def test_elements_without_second_derivatives_are_no_plate(loaded):
    basis = CellBasis(loaded.punch.structure.mesh, ElementTriP1())
    with pytest.raises(TypeError, match="second derivatives, as of ElementTriMorley, got one of"):
        RAFT.stiffness(basis)
    mixed = CellBasis(basis.mesh, ElementTriP1() * ElementTriP2())
    other = SimpleNamespace(structure=mixed)
    with pytest.raises(TypeError, match="second derivatives, as of ElementTriMorley, got one of"):
        RAFT.moments(dataclasses.replace(loaded, punch=other, displacement=np.zeros(mixed.N)))


def test_files_of_fine_structures_say_nothing(tmp_path, caplog):
    """scikit-fem logs that it puts more than a thousand vertices in order."""
    fine = CellBasis(rectangle(n=1100), ElementTriMorley())
    cells = DualMesh.from_mesh(rectangle(n=40)).basis()
    raft = ElasticPunch(SOIL, cells, fine, RAFT.stiffness(fine))
    solution = raft.solve(column_load(fine, (0.0, 0.0), 1.0), unilateral=False)
    caplog.clear()
    write_structure(tmp_path / "raft.vtu", solution)
    assert fine.mesh.nvertices > 1000
    assert not [record for record in caplog.records if record.name.startswith("skfem")]


def test_plates_that_the_structure_is_not(loaded, tmp_path):
    """Moments of another plate are refused; walls leave the plate a part of the structure."""
    for other in (dataclasses.replace(RAFT, thickness=0.8), dataclasses.replace(RAFT, young=50e6)):
        with pytest.raises(
            ValueError, match="a plate of which the structure is, got one of whose"
        ):
            other.moments(loaded)
        with pytest.raises(ValueError, match="a plate of which the structure is"):
            write_structure(tmp_path / "other.vtu", loaded, plate=other)
    with pytest.raises(TypeError, match="a Plate for plate, got 'steel'"):
        write_structure(tmp_path / "other.vtu", loaded, plate="steel")
    with pytest.raises(ValueError, match="of at most 100, got 1e\\+300"):
        write_structure(tmp_path / "other.vtu", loaded, beyond=1e300)
    assert not list(tmp_path.iterdir())
    structure, wall = loaded.punch.structure, np.zeros(loaded.punch.structure.N)
    wall[structure.nodal_dofs[0, :5]] = 1e9
    K = RAFT.stiffness(structure) + diags(wall)
    walled = ElasticPunch(SOIL, loaded.punch.basis, structure, K).solve(weight(structure))
    assert np.abs(RAFT.moments(walled)).max() > 0
    left = np.nonzero(structure.mesh.p[0, structure.mesh.t].mean(axis=0) < 0)[0]
    right = np.setdiff1d(np.arange(structure.mesh.nelements), left)
    thick = dataclasses.replace(RAFT, thickness=0.8)
    K = RAFT.stiffness(structure.with_elements(left)) + thick.stiffness(
        structure.with_elements(right)
    )
    zones = ElasticPunch(SOIL, loaded.punch.basis, structure, K).solve(weight(structure))
    assert np.abs(thick.moments(zones)[:, right]).max() > 0
    for wrong in (None, structure.mesh, "basis"):
        with pytest.raises(TypeError, match="a CellBasis for basis"):
            RAFT.stiffness(wrong)


def test_bending_moments(loaded):
    """Of a deflection of the second degree, which the elements know exactly."""
    a, b, c = 1e-3, -2e-3, 5e-4
    bent = loaded.punch.structure.project(
        lambda x: a * x[0] ** 2 + b * x[1] ** 2 + c * x[0] * x[1]
    )
    m = RAFT.moments(dataclasses.replace(loaded, displacement=bent))
    D, nu = RAFT.rigidity, 0.2
    expected = [-2 * D * (a + nu * b), -2 * D * (b + nu * a), -D * (1 - nu) * c]
    assert m == pytest.approx(np.tile(np.reshape(expected, (3, 1)), m.shape[1]), rel=1e-5)
    m = RAFT.moments(loaded)
    assert m[0].max() > 5 * abs(m[0].min())  # the bottom is pulled below the column


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"x": (1,)}, "two numbers for x"),
        ({"x": (9.0, 0.0)}, r"column on the plate, got one at \(9, 0\)"),
        ({"x": (3.0, 0.0), "sides": (1.0, 1.0)}, "in part beside it. Remedy: coordinates"),
        ({"sides": (1.0, -1.0)}, "sides of a column that are not negative"),
        ({"moments": (1.0, 0.0)}, "a side along y of the column with a moment of 1"),
        ({"sides": (0.0, 1.0), "moments": (0.0, 2.0)}, "a side along x of the column"),
        ({"force": np.nan}, "finite force"),
        ({"basis": None}, "CellBasis for basis"),
    ],
)
def test_wrong_columns(loaded, wrong, message):
    load = {"basis": loaded.punch.structure, "x": (0.0, 0.0), "force": 1.0} | wrong
    with pytest.raises((ValueError, TypeError), match=message):
        column_load(**load)


def test_columns_on_bases_with_a_numbering_of_their_own():
    """A rectangle took DOFs as scikit-fem numbers them: a column of 900 pressed with 364."""
    mesh = rectangle(6.0, 4.0, n=60)
    dofs = Dofs(mesh, ElementTriMorley())
    new = np.random.default_rng(0).permutation(dofs.N)
    for kind in ("nodal_dofs", "facet_dofs", "element_dofs"):
        setattr(dofs, kind, new[getattr(dofs, kind)])
    bases = CellBasis(mesh, ElementTriMorley()), CellBasis(mesh, ElementTriMorley(), dofs=dofs)
    for sides in ((0.5, 0.8), (0.5, 0.0)):
        one, other = (column_load(basis, (1.2, 0.7), 900.0, sides=sides) for basis in bases)
        assert other[new] == pytest.approx(one, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    ("made_of", "message"),
    [
        ((0.0, 1.0, 0.2), "positive thickness"),
        ((0.4, "a", 0.2), "number for young"),
        ((0.4, 1.0, 0.5), "poisson of at least 0 and below 0.5"),
    ],
)
def test_wrong_plates(made_of, message):
    with pytest.raises((ValueError, TypeError), match=message):
        Plate(*made_of)


def test_too_many_cells_are_refused_before_the_work(monkeypatch):
    """Each takes 200 KiB."""
    basis = cells(n=100)
    monkeypatch.setattr(resources, "available_memory", lambda: 50 * 200.0 * 2**10)
    with pytest.raises(MemoryError, match=rf"9\.766 MiB.*plate on {basis.N} cells.*most 50 cells"):
        RAFT.on(SOIL, basis)


@pytest.mark.filterwarnings("ignore:contact on")
def test_cells_too_large_for_how_a_plate_bends_are_told():
    """Largest deflections of 253 mm were told where it is 40, and nothing said."""
    soil, thin, thick = HalfSpace(30e3, 0.3), Plate(0.01, 210e6, 0.3), Plate(0.1, 210e6, 0.3)
    dual = DualMesh.from_mesh(rectangle(10.0, 8.0, n=100))
    for plate in (thin, thick):
        raft = plate.on(soil, dual.basis())
        f = column_load(raft.structure, (0.0, 0.0), 500.0, sides=(0.3, 0.3))
        f = f + column_load(raft.structure, (3.0, 2.5), 300.0)
        if plate is thick:
            assert raft.solve(f).success
            continue
        with pytest.warns(ResolutionWarning, match="bends within cells: .* Remedy: smaller cells"):
            assert raft.solve(f).success


@pytest.mark.parametrize("method", ["auto", "active-set", "cg"])
def test_a_load_nearer_to_a_corner_than_cells_carry_is_refused(method):
    """Slopes inside cells reach there, and turn: what was told was another cause, or none."""
    raft = Plate(0.3, 30e6, 0.2).on(SOIL, DualMesh.from_mesh(rectangle(2.0, 1.4, n=130)).basis())
    f = raft.structure.probes(np.array([[0.97], [0.679]])).T @ [1.0]
    with pytest.raises(ValueError, match=r"beyond its outermost cells"):
        raft.solve(f, method=method)
    with pytest.raises(ValueError, match=r"punch 0: expected loads that pressures"):
        Punches([raft]).solve([f])


def test_triangles_whose_vertices_do_not_ascend():
    """Functions that follow the directions of facets had lost tilts: loads moved by metres."""
    mesh, load = rectangle(8.0, 5.0, n=60), {"sides": (1.0, 1.0)}
    found = []
    for own in (mesh, mesh.oriented()):
        raft = Plate(0.4, 30e6, 0.2).on(SOIL, CellBasis(own, ElementTriP0()))
        found.append(raft.solve(column_load(raft.structure, (1.0, 0.5), 900.0, **load)))
    place = found[1].resultant[1:] / found[1].force + found[1].punch.origin
    assert place == pytest.approx((1.0, 0.5), rel=1e-9)
    assert found[1].deflection_range == pytest.approx(found[0].deflection_range, rel=1e-9)
    morley = CellBasis(mesh.oriented(), ElementTriMorley())
    for refused in (
        lambda: column_load(morley, (1.0, 0.5), 900.0, **load),
        lambda: found[0].load_vector(morley),
    ):
        with pytest.raises(ValueError, match=r"vertices ascend, for ElementTriMorley.*MeshTri\("):
            refused()
    assert found[0].load_vector(CellBasis(mesh.oriented(), ElementTriP2())).sum() == (
        pytest.approx(found[0].force)
    )


@pytest.mark.parametrize("length", [1e-9, 1e-6, 1e6])
def test_free_plates_are_the_same_in_any_unit_of_length(length):
    """Slopes of tilts are as large in all of them: below 1e-8 they were taken for idle."""

    def settled(unit):
        grid = DualMesh.from_mesh(MeshTri.init_circle(2).scaled(unit)).basis()
        raft = Plate(0.1 * unit, 500.0, 0.2).on(HalfSpace(1.0, 0.0), grid)
        at, sides = (0.3 * unit, 0.1 * unit), (0.2 * unit, 0.2 * unit)
        found = raft.solve(column_load(raft.structure, at, unit**2, sides=sides))
        assert found.success
        return np.array(found.deflection_range) / unit

    assert settled(length) == pytest.approx(settled(1.0), rel=1e-8)


def two_plates(loads, spring=0.0):
    """Soft plates side by side, the first one on a spring."""
    square = MeshTri.init_tensor(*[np.linspace(0, 1, 5)] * 2)
    cells = CellBasis(square + square.translated((1.5, 0.0)), ElementTriP0())
    raft = Plate(0.05, 1e-2, 0.2).on(HalfSpace(1.0, 0.3), cells)
    Q = raft.structure.probes(np.array([[0.3], [0.6]]))
    raft = dataclasses.replace(raft, stiffness=raft.stiffness + spring * (Q.T @ Q))
    places = (0.3, 0.6), (2.1, 0.4)
    return raft, sum(column_load(raft.structure, x, F) for x, F in zip(places, loads, strict=True))


def test_pressures_below_zero_by_rounding_are_zero():
    """-2e-16 beside 15 was no success."""
    raft, f = two_plates((1.0, 0.5), spring=1.0)
    with pytest.warns(ResolutionWarning):
        solution = raft.solve(f)
    assert solution.success
    assert solution.pressure.min() == 0.0


def test_a_part_without_a_load_beside_a_soft_one_is_told_with_a_remedy():
    raft, f = two_plates((1.0, 0.0))
    with pytest.raises(ValueError, match=r"got none on the part .* Remedy: its weight"):
        raft.solve(f)


def test_where_contact_is_not_found_on_constant_cells_that_is_told(monkeypatch):
    """And nothing is asked of slopes, which they do not have."""
    raft, f = two_plates((1.0, 0.5))
    raft = dataclasses.replace(raft, edge="constant", gap=Paraboloid(30.0, (1.2, 0.5)))
    assert raft.footprint.slopes is None

    def lost(*given):
        contact, position = solved(*given)
        return dataclasses.replace(contact, success=False, message="lost"), position

    monkeypatch.setattr("skfem_dual.bodies.elastic.solved", lost)
    with pytest.warns(ConvergenceWarning, match="lost"):
        assert not raft.solve(f).success


@pytest.mark.parametrize("sides", [(10.0, 0.0), *slow(((10.0, 0.3),), ((12.0, 6.0),))])
def test_loads_that_are_spread_over_many_elements(sides):
    """Walls and slabs: as in many short pieces, or as an area load of the whole plate."""
    plate = Plate(0.25, 30e6, 0.2)
    slab = plate.on(HalfSpace(30e3, 0.3), DualMesh.from_mesh(rectangle(12, 6, n=300)).basis())
    basis = slab.structure
    found = column_load(basis, (0.0, 0.0), 1000.0, sides=sides)
    if sides == (12.0, 6.0):
        expected = LinearForm(lambda v, w: 1000.0 / 72 * v).assemble(basis)
    else:
        n = 400
        pieces = (np.arange(n) + 0.5) / n * 10.0 - 5.0
        own = [(x, 0.0) for x in pieces]
        side = (10.0 / n, sides[1])
        expected = sum(column_load(basis, x, 1000.0 / n, sides=side) for x in own)
    one, other = (plate.moments(slab.solve(f)) for f in (found, expected))
    assert np.abs(one - other).max() < 5e-3 * np.abs(other).max()


def test_rectangles_that_reach_a_little_beyond_the_plate_are_refused():
    slab = Plate(0.25, 30e6, 0.2).on(
        HalfSpace(30e3, 0.3), DualMesh.from_mesh(rectangle(12, 6, n=60)).basis()
    )
    for x in ((5.51, 0.0), (60.0, 0.0)):
        with pytest.raises(ValueError, match="expected a column on the plate"):
            column_load(slab.structure, x, 1.0, sides=(1.0, 0.3))


def test_columns_exactly_on_a_slanted_edge():
    """Elements are found there by rounding, too."""
    corners = np.array([[0.3, 0.1], [6.7, 4.9], [3.7, 8.9], [-2.7, 4.1]])
    mesh = Plan.from_polygon([tuple(x) for x in corners]).mesh(n=60)
    plate = Plate(0.4, 30e6, 0.2)
    basis = plate.on(HalfSpace(30e3, 0.3), DualMesh.from_mesh(mesh).basis()).structure
    share = np.linspace(0.03, 0.97, 40)
    x = corners[:1].T * (1 - share) + corners[1:2].T * share
    excess = excess_under_columns(plate, basis, x, np.ones(40))
    assert (excess > 0).all()


@pytest.mark.parametrize("site", [0.0, 5e5, 5e6])
@pytest.mark.parametrize("sides", [(0.3, 0.3), (4.0, 0.4), (4.0, 0.0), (0.0, 0.0)])
def test_columns_keep_force_and_moments_on_site_coordinates(sides, site):
    """Corners of rectangles are rounded there, by parts of their area."""
    mesh = rectangle(12, 6, n=100).translated((site, site))
    cells = DualMesh.from_mesh(mesh).basis()
    slab = Plate(0.25, 30e6, 0.2).on(HalfSpace(30e3, 0.3), cells, origin=(site, site))
    mx, my = (moment if side else 0.0 for moment, side in zip((0.3, -0.2), sides[::-1]))
    x = (site + 0.123, site + 0.2)
    found = slab.solve(column_load(slab.structure, x, 7.0, sides=sides, moments=(mx, my)))
    expected = [7.0, 7.0 * (x[0] - site) + my, 7.0 * (x[1] - site) + mx]
    assert found.resultant[0] == pytest.approx(7.0, abs=1e-12)
    assert found.resultant == pytest.approx(expected, abs=1e-11 + 1e-15 * site)
