"""Regular grids: products by transforms against exact matrices of the same cells."""

import numpy as np
import pytest
from marks import slow
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import (
    ConvergenceWarning,
    GradedHalfSpace,
    HalfSpace,
    InfluenceOperator,
    Layer,
    LayeredHalfSpace,
    Paraboloid,
    RigidPunch,
    load_path,
)
from skfem_dual.contact import line_law
from skfem_dual.grids.partition import Partition
from skfem_dual.operators.iterative import solve_many
from skfem_dual.operators.toeplitz import FEW, BlockToeplitz, Convolution, symbol_on, wave_numbers

GROUNDS = {
    "homogeneous": (HalfSpace(2.0, 0.3), 1e-13),
    "graded": (GradedHalfSpace.init_linear(2.0, 0.25, 1.5), 1e-9),
    "layered": (LayeredHalfSpace([Layer(0.7, 2.0, 0.3)], "bonded"), 1e-9),
}


def plan(nx=24, ny=16, seed=0):
    """Three quarters of the cells of a grid with dx != dy, in any order."""
    mesh = MeshQuad.init_tensor(np.linspace(-1, 1, nx + 1), np.linspace(-1.2, 1.3, ny + 1))
    cells = np.random.default_rng(seed).permutation(nx * ny)
    return CellBasis(mesh.restrict(cells[: 3 * nx * ny // 4]), ElementQuad0())


def square(n, half=1.0):
    x = np.linspace(-half, half, n + 1)
    return CellBasis(MeshQuad.init_tensor(x, x), ElementQuad0())


@pytest.mark.parametrize("ground", ["homogeneous", "layered", *slow("graded")])
def test_against_the_exact_matrix(ground):
    ground, tolerance = GROUNDS[ground]
    basis = plan()
    matrix = RigidPunch(ground, basis, edge="constant").matrix
    operator = InfluenceOperator(ground, basis, edge="constant")
    assert operator.method == "toeplitz"
    assert max(operator.error, operator.row_error) < tolerance
    largest = matrix.max()
    assert np.abs(operator.to_dense() - matrix).max() < tolerance * largest
    assert np.abs(operator.rows([3, 200]) - matrix[[3, 200]]).max() < tolerance * largest
    assert operator.diagonal() == pytest.approx(matrix.diagonal(), rel=10 * tolerance)
    q = np.random.default_rng(0).normal(size=(len(matrix), 3))
    expected = matrix @ q
    assert np.abs(operator @ q - expected).max() < tolerance * np.abs(matrix).sum(axis=1).max()
    assert operator.T @ q[:, 0] == pytest.approx(operator @ q[:, 0])


@pytest.mark.parametrize("basis", [plan(12, 20, 1), square(14)], ids=["some", "all"])
def test_few_cells_are_multiplied_by_their_matrix(basis):
    lattice = Partition.from_basis(basis).lattice
    assert len(lattice) <= FEW
    operator = BlockToeplitz.from_substrate(HalfSpace(2.0, 0.3), lattice)
    q = np.random.default_rng(1).normal(size=(len(lattice), 2))
    for product in (operator.convolution, operator.inverse):
        expected = np.stack([product.by_transforms(column) for column in q.T], axis=1)
        assert product @ q == pytest.approx(expected, abs=1e-13 * np.abs(expected).max())
    assert operator @ q == pytest.approx(operator.to_dense() @ q, rel=1e-12)


def test_other_points_to_the_tolerance_that_was_asked():
    """Not to that of the transforms, which would take an exact matrix."""
    basis = CellBasis(MeshQuad().refined(6), ElementQuad0())
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, rtol=1e-4, edge="constant")
    assert operator.method == "toeplitz"
    x = np.random.default_rng(0).random((2, 6000))
    other = operator.at(x)
    assert (other.method, other.rtol) == ("fast", 1e-4)
    pressure = np.ones(len(operator.partition))
    exact = other.rows(np.arange(9)) @ pressure
    np.testing.assert_allclose((other @ pressure)[:9], exact, rtol=2e-4)
    assert operator.at(x[:, :9], rtol=0.0).method == "dense"


def test_a_row_of_cells_and_a_single_one():
    for nx, ny in ((1, 1), (5, 1), (1, 7)):
        mesh = MeshQuad.init_tensor(np.arange(nx + 1.0), 2 * np.arange(ny + 1.0))
        punch = RigidPunch(HalfSpace(1.0, 0.0), CellBasis(mesh, ElementQuad0()), edge="constant")
        operator = InfluenceOperator(punch.substrate, punch.basis, edge="constant")
        assert operator.toeplitz is not None
        assert operator @ np.ones(nx * ny) == pytest.approx(punch.matrix.sum(axis=1), rel=1e-13)


def test_what_is_not_toeplitz_keeps_its_road():
    basis, ground = plan(12, 8), HalfSpace(1.0, 0.0)
    assert InfluenceOperator(ground, basis).method == "dense"  # edge-weighted cells
    x = basis.mesh.p[:, :300]
    assert InfluenceOperator(ground, basis, edge="constant", collocation=x).method == "dense"
    for options in ({}, {"edge": "constant", "collocation": x}):
        with pytest.raises(ValueError, match='regular grid of cells for method="toeplitz"'):
            InfluenceOperator(ground, basis, method="toeplitz", **options)
    for method in ("dense", "fast"):
        operator = InfluenceOperator(ground, basis, 1e-5, method, edge="constant")
        assert operator.method == method


@pytest.mark.parametrize("ground", ["homogeneous", "layered", *slow("graded")])
def test_the_inverse_is_one_whatever_the_number_of_cells(ground):
    """Symmetric and positive; iterations hardly grow."""
    ground, _ = GROUNDS[ground]
    counts = []
    for n in (8, 16, 32):
        operator = InfluenceOperator(ground, square(n), edge="constant")
        inverse = operator.toeplitz.inverse
        matrix = np.array([inverse @ one for one in np.eye(64)]) if n == 8 else None
        if matrix is not None:
            assert matrix == pytest.approx(matrix.T, abs=1e-12 * np.abs(matrix).max())
            assert np.linalg.eigvalsh(matrix).min() > 0
        found = solve_many(operator, np.ones((n * n, 1)), 1e-8)
        assert found.success
        counts += found.iterations
    assert counts[-1] <= counts[0] + 8


def test_symbols_from_few_values():
    k = wave_numbers((30, 40), (0.1, 0.2))[3:]
    assert k.max() == pytest.approx(np.hypot(np.pi / 0.1, np.pi / 0.2))
    for ground, _ in GROUNDS.values():
        assert symbol_on(ground, k) == pytest.approx(ground.symbol(k), rel=1e-9)


def test_the_punch_is_the_same_on_both_roads(monkeypatch):
    """All that is imposed, and what only a matrix has, on few cells of a regular grid."""
    monkeypatch.setattr(line_law, "DENSE", 0)  # the law of the line of contact takes a matrix
    ground, basis, gap = HalfSpace(1.0, 0.3), plan(), Paraboloid(2.0, (0.1, 0.0))
    regular = RigidPunch(ground, basis, gap=gap)
    direct = RigidPunch(ground, basis, gap=gap)
    direct.__dict__["operator"] = direct.matrix
    assert regular.operator.method == "toeplitz"
    loads = (
        {"force": 0.5, "at": (0.1, 0.1)},
        {"force": 0.5, "tilt": (0.0, 0.1)},
        {"settlement": 0.2},
        {"settlement": 0.2, "tilt": (0.0, 0.0)},
        {"settlement": 0.2, "at": (0.0, 0.1)},
    )
    for load in loads:
        for options in ({}, {"method": "active-set"}, {"unilateral": False}):
            if options and load.get("at") == (0.0, 0.1):
                continue
            found, expected = regular.solve(**load, **options), direct.solve(**load, **options)
            assert found.success
            largest = np.abs(expected.pressure).max()
            assert found.pressure == pytest.approx(expected.pressure, abs=1e-7 * largest)
            assert found.settlement == pytest.approx(expected.settlement, rel=1e-8)
            assert found.tilt == pytest.approx(expected.tilt, abs=1e-8)
    assert regular.condition_number == pytest.approx(direct.condition_number, rel=1e-5)
    assert "Condition number" in repr(found)


def test_guided_cases_are_those_alone():
    """None of them is superposed, of products without columns."""
    punch = RigidPunch(HalfSpace(1.0, 0.0), square(20), gap=Paraboloid(1.0))
    loads = [{"force": force, "tilt": (0.0, 0.0)} for force in (0.1, 0.3)]
    alone = [punch.solve(**load).settlement for load in loads]
    assert punch.solve_many(loads).settlement == pytest.approx(alone, rel=1e-9)
    assert load_path(punch, loads).settlement == pytest.approx(alone, rel=1e-9)


def test_hertz_on_a_regular_grid():
    """A sphere of radius 1 pressed until the radius of contact is 1; h is 1/16 and 1/32."""
    errors = []
    for n in (40, 80):
        solution = RigidPunch(HalfSpace(1.0, 0.0), square(n, 1.25), gap=Paraboloid(1.0)).solve(
            4 / 3
        )
        assert solution.iterations < 30
        errors.append([solution.settlement - 1, solution.pressure.max() * np.pi / 2 - 1])
    assert np.abs(errors[1]).max() < 2e-3
    assert np.abs(errors[1]).max() < 0.5 * np.abs(errors[0]).max()


@pytest.mark.parametrize("rtol", [0.0, 1e-10])
def test_few_cells_are_solved_by_their_matrix_whatever_the_tolerance(rtol):
    """With the law of the line of contact: by products alone it was 34 times as far off."""
    basis, gap = square(15), Paraboloid(1.0)
    usual, asked = (
        RigidPunch(HalfSpace(1.0, 0.0), basis, gap=gap, rtol=value).solve(0.3, tilt=(0.0, 0.0))
        for value in (None, rtol)
    )
    assert usual.line is not None
    assert asked.settlement == pytest.approx(usual.settlement, rel=1e-12)


def test_transforms_that_go_wrong_are_found_out(monkeypatch):
    """Solutions are checked on exact rows, not by the products that found them."""
    punch = RigidPunch(HalfSpace(1.0, 0.0), square(20, 1.25), gap=Paraboloid(1.0))
    right = punch.solve(0.1)
    assert right.success
    product = Convolution.__matmul__
    monkeypatch.setattr(Convolution, "__matmul__", lambda self, q: 1.01 * product(self, q))
    with pytest.warns(ConvergenceWarning, match="equations do not hold"):
        wrong = punch.solve(0.1)
    assert not wrong.success


@pytest.mark.filterwarnings("ignore::skfem_dual.ResolutionWarning")
def test_contact_of_few_cells_is_found_by_the_active_set():
    """Conjugate gradients ended on two of the three cells that carry so little."""
    rng, shape = np.random.default_rng(113), (19, 31)
    mesh = MeshQuad.init_tensor(*(np.linspace(0, 1, n + 1) for n in shape))
    waves = np.hypot(*np.meshgrid(*(np.fft.fftfreq(n) * n for n in shape), indexing="ij"))
    waves[0, 0] = np.inf
    height = np.fft.fft2(rng.standard_normal(shape)) * waves ** -(1 + rng.uniform(0.3, 1.2))
    height = np.fft.ifft2(height).real.ravel()
    height *= 0.01 / height.std()
    ground = LayeredHalfSpace([Layer(0.01, 30.0, 0.3)], HalfSpace(1.0, 0.2))
    gap = height.max() - height
    punch = RigidPunch(ground, CellBasis(mesh, ElementQuad0()), gap=gap, origin=(0.5, 0.5))
    force = 0.01 * 10 ** rng.uniform(-6, -2)
    at = tuple(rng.uniform(-0.3, 0.3, 2))
    found = punch.solve(force=force, at=at)
    assert found.success
    assert found.force == pytest.approx(force, rel=1e-12)
    assert found.centre_of_pressure == pytest.approx(at, rel=1e-9)


@pytest.mark.parametrize("side", [1.0, 0.1])
def test_fine_grids_at_site_coordinates(side):
    """Rounding of coordinates is a part of the tolerance: such grids were refused."""
    settled = []
    for x, y in ((0.0, 0.0), (5e5, 5.4e6)):
        s = np.linspace(0, side, 33)
        basis = CellBasis(MeshQuad.init_tensor(x + s, y + s), ElementQuad0())
        middle = np.array([[x + side / 2], [y + side / 2]])
        punch = RigidPunch(
            HalfSpace(1.0, 0.3),
            basis,
            gap=lambda x, middle=middle: ((x - middle) ** 2).sum(axis=0) / side,
        )
        assert punch.operator.method == "toeplitz"
        settled.append(punch.solve(0.02 * side**2, tilt=(0, 0)).settlement)
        cells = s[1] - s[0]
        assert 1e-10 <= punch.operator.rtol <= max(1e-10, 2e-15 * y / cells)
    assert settled[1] == pytest.approx(settled[0], rel=1e-7)


def test_what_memory_does_not_hold_is_refused_before_the_work(monkeypatch):
    side = np.linspace(-1, 1, 71)
    cells = CellBasis(MeshQuad.init_tensor(side, side), ElementQuad0())
    punch = RigidPunch(HalfSpace(1.0, 0.25), cells, gap=Paraboloid(1.0))
    solution = punch.solve(0.1)
    monkeypatch.setattr("skfem_dual.operators.resources.available_memory", lambda: 100e6)
    for call in (
        lambda: punch.matrix,
        lambda: punch.operator.to_dense(),
        lambda: solution.pressure_field(),
    ):
        with pytest.raises(MemoryError, match=r"expected at most 95.37 MiB.*Remedy: "):
            call()
    assert solution.pressure_field(refine=0)[1].max() > 0


def test_transposed_products_of_complex_vectors():
    basis = CellBasis(MeshQuad().refined(5), ElementQuad0())
    operator = InfluenceOperator(HalfSpace(1.0, 0.0), basis, edge="constant")
    assert operator.method == "toeplitz"
    rng = np.random.default_rng(0)
    q = rng.random(1024) + 1j * rng.random(1024)
    expected = operator @ q
    for found in (operator.T @ q, operator.H @ q, operator.rmatvec(q), q @ operator):
        np.testing.assert_allclose(found, expected, rtol=1e-9)
