import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem import CellBasis, ElementQuad0, MeshQuad, MeshTri

from skfem_dual.grids.lattice import PLACES, Lattice
from skfem_dual.grids.partition import Partition


def grid(nx=6, ny=4, dx=0.3, dy=0.7, at=(0.0, 0.0)):
    return MeshQuad.init_tensor(at[0] + dx * np.arange(nx + 1), at[1] + dy * np.arange(ny + 1))


def lattice_of(mesh):
    return Partition.from_mesh(mesh).lattice


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.floats(-1e4, 1e4), st.floats(1e-3, 1e3))
def test_places_are_those_of_the_centroids(seed, at, size):
    """Cells and vertices in any order and sense, some cells left out, anywhere, in any units."""
    rng = np.random.default_rng(seed)
    mesh = grid(7, 5, 0.3 * size, 0.7 * size, (at, -at / 3))
    cells = rng.choice(35, rng.integers(10, 36), replace=False)
    turned = np.array([np.roll(t[:: rng.choice([-1, 1])], rng.integers(4)) for t in mesh.t.T]).T
    partition = Partition.from_mesh(MeshQuad(mesh.p, turned).restrict(cells))
    lattice = partition.lattice
    assert lattice.spacing == pytest.approx((0.3 * size, 0.7 * size), rel=1e-8)
    assert len(np.unique(lattice.places)) == len(lattice) == len(partition)
    x = np.array(np.divmod(lattice.places, lattice.shape[1])) * np.array(lattice.spacing)[:, None]
    corner = partition.centroids.min(axis=1, keepdims=True)
    assert partition.centroids - corner == pytest.approx(x, abs=1e-10 * size + 1e-14 * abs(at))


def test_all_places_in_their_order():
    assert lattice_of(grid()).full
    assert not lattice_of(grid().restrict(np.arange(1, 24))).full
    mesh = grid()
    assert not lattice_of(MeshQuad(mesh.p, mesh.t[:, ::-1])).full
    single = lattice_of(grid(1, 1))
    assert (single.shape, single.places.tolist()) == ((1, 1), [0])


def moved(mesh, by):
    """One inner node moved along a diagonal."""
    p = mesh.p.copy()
    p[:, 8] += by
    return MeshQuad(p, mesh.t)


def turned(mesh, angle):
    c, s = np.cos(angle), np.sin(angle)
    return MeshQuad(np.array([[c, -s], [s, c]]) @ mesh.p, mesh.t)


@pytest.mark.parametrize(
    "mesh",
    [
        moved(grid(), 1e-8),
        turned(grid(), 1e-8),
        turned(grid(), 0.3),
        MeshQuad(np.array([[1, 0.2], [0, 1]]) @ grid().p, grid().t),
        MeshQuad.init_tensor(np.array([0, 1.0, 2.0, 3.1]), np.arange(4.0)),
        MeshQuad.init_tensor(np.arange(4.0) ** 2, np.arange(4.0)),
        MeshTri.init_tensor(np.arange(4.0), np.arange(4.0)),
        # few cells in a wide grid
        grid(2 * PLACES, 2, 1.0, 1.0).restrict([0, 4 * PLACES - 1]),
    ],
)
def test_other_cells_have_no_lattice(mesh):
    assert lattice_of(mesh) is None


def test_rounding_far_from_the_origin_is_no_distortion():
    assert lattice_of(grid(at=(4.5e6, -3e5))).shape == (6, 4)
    assert lattice_of(moved(grid(at=(4.5e6, -3e5)), 1e-6)) is None


def test_detected_once():
    partition = Partition.from_basis(CellBasis(grid(), ElementQuad0()))
    assert isinstance(partition.lattice, Lattice)
    assert partition.lattice is partition.lattice
