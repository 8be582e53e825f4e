import numpy as np
import pytest

from skfem_dual import DualMesh, HalfSpace
from skfem_dual.elements.influence import influence_matrix
from skfem_dual.grids.generate import disc
from skfem_dual.grids.partition import Partition
from skfem_dual.operators.dense import moment_matrix

SOIL = HalfSpace(3.0, 0.2)
DUAL = DualMesh.from_mesh(disc(n=150, graded="quadratic"))


@pytest.mark.parametrize("basis", [DUAL.basis(), DUAL.primal_basis()], ids=["dual", "triangles"])
@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-6])
def test_points_anywhere(basis, rtol):
    """Inside of cells, on vertices and centroids, beside the plan; an even and an odd number."""
    partition = Partition.from_basis(basis)
    rng = np.random.default_rng(0)
    beside = rng.uniform(-1.5, 1.5, (2, 400))
    x = np.hstack([partition.centroids, partition.polygons.p, beside])
    for points in (x, x[:, :-1], x[:, :1]):
        exact = influence_matrix(SOIL, partition, points)
        found = moment_matrix(SOIL, partition, points, None, rtol)
        assert (np.abs(found - exact).sum(axis=1) < 3 * rtol * exact.sum(axis=1)).all()
