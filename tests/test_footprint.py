import pickle

import numba
import numpy as np
import pytest
from plans import disc, rectangle
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import DualMesh, HalfSpace, Paraboloid, RigidPunch
from skfem_dual.contact.footprint import Footprint
from skfem_dual.elements.edge_correction import EdgeCorrection
from skfem_dual.elements.influence import influence_matrix
from skfem_dual.grids import generate
from skfem_dual.solutions.pressures import CellPressures

SOIL = HalfSpace(1.0, 0.25)


class Block:
    """Something else than a punch that stands on cells, with an even base."""

    gap = None

    def __init__(self, footprint):
        self.footprint = footprint


def pressures(footprint, pressure, gap=None, others=()):
    return CellPressures(
        punch=Block(footprint),
        pressure=pressure,
        gap=np.zeros(len(footprint)) if gap is None else gap,
        resultant=footprint.resultant(pressure),
        displacement_residual=0.0,
        complementarity_residual=0.0,
        iterations=0,
        success=True,
        message="",
        timings={},
        others=others,
    )


def test_resultants_of_linear_pressures():
    """Of a rectangle 4 x 2 around (3, 1): area 8, second moments 32 / 3 and 8 / 3."""
    mesh = rectangle(8, 2.0, 1.0).translated((3.0, 1.0))
    cells = Footprint.from_basis(
        SOIL, DualMesh.from_mesh(mesh).primal_basis(), "constant", origin=(1.0, 1.0)
    )
    assert cells.centre == pytest.approx([3.0, 1.0])
    found = cells.resultant(np.full(len(cells), 2.0))
    assert found == pytest.approx([16.0, 32.0, 0.0])
    x = cells.partition.centroids
    xx, xy, _ = cells.partition.polygons.second_moments.sum(axis=1)  # lost inside the cells
    assert cells.resultant(x[0] - 3.0) == pytest.approx([0.0, 32 / 3 - xx, -xy])


def test_answers_need_cells_only():
    """Pressures of any body answer as those of a punch with the same cells."""
    basis = DualMesh.from_mesh(disc(3)).basis()
    for punch in (
        RigidPunch(SOIL, basis, origin=(0.1, 0.0)),
        RigidPunch(SOIL, basis, gap=Paraboloid(2.0)),
    ):
        solution = punch.solve(0.1)
        cells = Footprint.from_basis(SOIL, basis, punch.edge, origin=punch.origin)
        other = pressures(cells, solution.pressure, solution.gap)
        x = np.random.default_rng(0).uniform(-1.5, 1.5, (2, 50))
        assert np.array_equal(other.ground_displacement(x), solution.displacement(x))
        assert np.array_equal(other.pressure_at(x), solution.pressure_at(x))
        assert np.array_equal(other.nodal_pressure()[1], solution.nodal_pressure()[1])
        assert other.contact_area == solution.contact_area
        assert other.force == solution.force == pytest.approx(0.1)
        assert other.centre_of_pressure == pytest.approx(solution.centre_of_pressure)
        again = punch.solve(0.1, start=other)  # a beginning for punches too
        assert again.pressure == pytest.approx(solution.pressure, rel=1e-9)


def test_pressures_on_other_cells():
    """Those of the cells around their centroids; none beside the punch."""
    coarse, fine = (DualMesh.from_mesh(disc(n)).primal_basis() for n in (2, 3))
    given = Footprint.from_basis(SOIL, coarse, "constant")
    start = pressures(given, np.arange(1.0, len(given) + 1))
    assert np.array_equal(start.pressures_on(given), start.pressure)
    wide = Footprint.from_basis(SOIL, DualMesh.from_mesh(disc(3).scaled(2.0)).primal_basis())
    on = start.pressures_on(wide)
    r = np.hypot(*wide.partition.centroids)
    assert (on[r > 1] == 0).all()
    assert (on[r < 0.9] > 0).all()
    # each triangle of the coarse mesh holds four of the fine one, inside of the circle
    on = start.pressures_on(Footprint.from_basis(SOIL, fine, "constant"))
    assert len(np.unique(on[on > 0])) == len(given)


def test_solutions_are_not_heavier_for_their_cells():
    """A pickled solution has the basis of its punch once, and no matrix."""
    punch = RigidPunch(SOIL, DualMesh.from_mesh(disc(3)).basis())
    bare = len(pickle.dumps(punch))
    solution = punch.solve(1.0)
    assert len(pickle.dumps(solution)) < bare + 40 * 8 * len(solution.pressure)
    again = pickle.loads(pickle.dumps(solution))
    assert again.footprint is again.punch.footprint
    assert again.force == solution.force


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"edge": "sharp"}, 'edge "singular" or "constant", got \'sharp\''),
        ({"collocation": "node"}, 'collocation "centroid" with edge "singular"'),
        ({"edge": "constant", "collocation": "middle"}, "got 'middle'"),
        ({"edge": "constant", "edge_boundaries": "rim"}, 'edge "singular" where'),
        ({"edge_boundaries": "rim"}, r"names of boundaries of the mesh, \[\], got \['rim'\]"),
        ({"rtol": 0.1}, "rtol from 0 to 0.01, got 0.1"),
        ({"origin": (0.0, np.inf)}, "finite origin"),
    ],
)
def test_bad_footprints(options, message):
    basis = DualMesh.from_mesh(disc(1)).basis()
    with pytest.raises(ValueError, match=message):
        Footprint.from_basis(SOIL, basis, **options)
    with pytest.raises(TypeError, match="expected a substrate"):
        Footprint.from_basis(HalfSpace, basis)


def test_points_in_any_byte_order_and_lists_of_them():
    punch = RigidPunch(HalfSpace(1.0, 0.25), DualMesh.from_mesh(disc(3)).basis())
    x = np.random.default_rng(0).uniform(-1, 1, (2, 5))
    matrix = punch.influence(x)
    for same in (x.astype(">f8"), x.tolist(), np.asfortranarray(x), [tuple(row) for row in x]):
        np.testing.assert_array_equal(punch.influence(same), matrix)
    with pytest.raises(ValueError, match=r"shape \(2, m\), got \(3, 1\)"):
        punch.influence([[0.0], [0.0], [0.0]])


def test_entries_are_the_sum_of_their_parts():
    """What is added to blocks of rows, and added to whole matrices one after the other."""
    cells = RigidPunch(HalfSpace(1.0, 0.25), DualMesh.from_mesh(disc(3)).basis()).footprint
    x = np.random.default_rng(0).uniform(-1, 1, (2, 200))
    matrix = influence_matrix(cells.substrate, cells.partition, x)
    uniform = matrix.copy()
    c = cells.substrate.singular_coefficient
    EdgeCorrection.from_weights(cells.weights, c, x).add_to(matrix)
    cells.slope_correction(x).add_to(matrix, cells.slopes)
    np.testing.assert_allclose(cells.influence(x), matrix, rtol=1e-14, atol=1e-15)
    assert np.abs(matrix - uniform).max() > 0.01 * uniform.max()


@pytest.mark.parametrize("x", [None, np.array([[0.0, 0.3, -2.0], [0.1, 0.95, 3.0]])])
def test_settlements_are_the_matrix_times_the_pressures(x):
    """Sums over ribs and dipoles under several pressures, and a matrix with slopes within."""
    footprint = Footprint.from_basis(SOIL, DualMesh.from_mesh(disc(4)).basis())
    x = footprint.collocation_points if x is None else x
    pressures = np.random.default_rng(0).standard_normal((len(footprint), 3))
    matrix, found = footprint.influence(x), footprint.settlements(x, pressures)
    assert found == pytest.approx(matrix @ pressures, abs=1e-13 * np.abs(matrix).sum(axis=1).max())
    assert footprint.settlements(x, pressures[:, 0]) == pytest.approx(found[:, 0], abs=1e-14)


@pytest.mark.parametrize("edge", ["singular", "constant"])
def test_rough_settlements_by_moments(edge, monkeypatch):
    """In cells, beside them and far off; constant pressures more closely the farther cells are
    integrated."""
    footprint = Footprint.from_basis(SOIL, DualMesh.from_mesh(disc(4)).basis(), edge)
    rng = np.random.default_rng(0)
    x = np.hstack([footprint.collocation_points[:, ::9], rng.uniform(-1.5, 1.5, (2, 100))])
    pressure = np.stack([np.ones(len(footprint)), footprint.collocation_points[0]], axis=1)
    exact = footprint.settlements(x, pressure)
    errors = []
    monkeypatch.setattr("skfem_dual.elements.moment_sums.FEW", 300)
    for reach in (3.0, 6.0):
        monkeypatch.setattr("skfem_dual.elements.moment_sums.REACH", reach)
        monkeypatch.setattr("skfem_dual.elements.moment_sums.APART", 1.33 * reach)
        found = footprint.settlements(x, pressure, rough=True)
        errors.append(float(np.abs(found - exact).max() / np.abs(exact).max()))
    # slopes are dipoles beyond 2.5 radii in what is called exact
    assert errors[0] < (5e-5 if edge == "singular" else 1e-5)
    assert edge == "singular" or errors[1] < errors[0] / 10
    one = footprint.settlements(x, pressure[:, 0], rough=True)
    assert one == pytest.approx(found[:, 0], rel=1e-14)


def test_groups_far_off_act_as_their_cells_do(monkeypatch):
    """More nearly the farther off they are, by the fifth power; the same on all threads."""
    module = "skfem_dual.elements.moment_sums."
    footprint = Footprint.from_basis(SOIL, DualMesh.from_mesh(generate.disc(n=2000)).basis())
    rng = np.random.default_rng(3)
    x = rng.uniform(-1.5, 1.5, (2, 1000))
    pressure = rng.uniform(0.5, 1.5, (len(footprint), 3))

    def settled(**kwargs):
        for name, value in kwargs.items():
            monkeypatch.setattr(module + name, value)
        return footprint.settlements(x, pressure, rough=True)

    usual = settled()
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 3)
    monkeypatch.setattr("skfem_dual.kernels.threads.LONG", 0.0)
    assert (settled() == usual).all()
    single = settled(FEW=len(footprint) + 1)
    apart = [np.abs(settled(FEW=1000, APART=a) - single).max() for a in (4.0, 8.0)]
    assert apart[1] < apart[0] / 16
    assert 0 < apart[0] < 2e-6 * np.abs(single).max()


def test_groups_are_as_symmetric_as_the_plan():
    """A pure tilt has no force, and a central force no tilt, to rounding."""
    x = np.linspace(-1, 1, 34)
    basis = CellBasis(MeshQuad.init_tensor(x, x), ElementQuad0())
    punch = RigidPunch(SOIL, basis)
    tilted = punch.solve(settlement=0.0, tilt=(1.0, 0.0), unilateral=False)
    assert not tilted.acts
    assert np.abs(punch.solve(1.0).tilt).max() < 1e-13


def test_rough_settlements_nowhere():
    footprint = Footprint.from_basis(SOIL, DualMesh.from_mesh(generate.disc(n=700)).basis())
    found = footprint.settlements(np.empty((2, 0)), np.ones((len(footprint), 2)), rough=True)
    assert found.shape == (0, 2)


@pytest.mark.parametrize(("size", "force"), [(1e-12, 1e30), (1e15, 1e-30), (1.0, 0.0)])
def test_rough_settlements_in_any_units(size, force, monkeypatch):
    monkeypatch.setattr("skfem_dual.elements.moment_sums.FEW", 300)
    rng = np.random.default_rng(1)
    x, pressure = rng.uniform(-1.5, 1.5, (2, 50)), force * rng.random((545, 2))
    at = np.array([[4.5e5], [5.4e6]])
    mesh = disc(4)

    def settled(mesh, x):
        footprint = Footprint.from_basis(SOIL, DualMesh.from_mesh(mesh).basis())
        return footprint.settlements(x, pressure, rough=True)

    usual = settled(mesh, x)
    np.testing.assert_allclose(settled(mesh.scaled(size), size * x), size * usual, rtol=2e-6)
    np.testing.assert_allclose(settled(mesh.translated(at[:, 0]), x + at), usual, rtol=2e-6)


def test_the_edges_that_are_named_are_told():
    mesh = rectangle(6, 1.0, 1.5).with_boundaries(
        {"west": lambda x: x[0] < -1 + 1e-9, "east": lambda x: x[0] > 1 - 1e-9}
    )
    basis = DualMesh.from_mesh(mesh).basis()
    facets = mesh.boundaries["west"].tolist()
    told = {"west": "the boundary west", ("west", "east"): "the boundaries west and east"}
    for names, where in [*told.items(), (facets, f"{len(facets)} boundary facets")]:
        punch = RigidPunch(SOIL, basis, edge_boundaries=names)
        assert f"dual cells, singular edge on {where}, centroid" in repr(punch.solve(1.0))
    assert "dual cells, singular edge, centroid" in repr(RigidPunch(SOIL, basis))
