"""Values measured on two dual grids: fewer random errors."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, ElementTriP1, MeshTri

from ..grids.couples import GridCouple
from ..grids.dual_mesh import DualMesh
from ..grids.general import general_triangulation
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly
from .functional import CoupleFunctional, Neighbours, Weights
from .weights import Choice, chosen


@dataclass(frozen=True, eq=False, repr=False)
class SmoothedCouple(ReadOnly):
    """New values at the nodes of two dual grids; unpacks as ``first, second``.

    Attributes
    ----------
    grids : DualMesh or GridCouple
        The couple.
    first, second : (M,) and (N,) array of float, or (M, k) and (N, k)
        New values at the nodes of the first and of the second grid.
    weights : Weights
        Of the functional.
    reason : str
        How they came about.
    """

    grids: DualMesh | GridCouple
    first: ndarray
    second: ndarray
    weights: Weights
    reason: str

    def __iter__(self) -> Iterator[ndarray]:
        return iter((self.first, self.second))

    def __repr__(self) -> str:
        w = self.weights
        return (
            "<skfem_dual SmoothedCouple object>\n"
            f"  Nodes: {len(self.first)} and {len(self.second)}\n"
            f"  Weights A {w.A1:.3g}, {w.A2:.3g}; B {w.B1:.3g}, {w.B2:.3g}; "
            f"C {w.C1:.3g}, {w.C2:.3g}; D {w.D1:.3g}, {w.D2:.3g}: {self.reason}"
        )

    def field(self) -> tuple[CellBasis, ndarray]:
        """The values of both grids together as a continuous piecewise linear field.

        Returns
        -------
        basis : CellBasis
            First-order elements on the general triangulation of a `DualMesh`, where the middle of
            a boundary facet takes the mean of its ends; or, for a `GridCouple`, on triangles
            between each node of B and the sides of the cell of A around it.
        values : (N,) or (N, k) array of float
            Its vector, or k of them.
        """
        return joined_field(self.grids, self.first, self.second)


def smooth_couple(
    F: ArrayLike, G: ArrayLike, grids: DualMesh | GridCouple, weights: Choice = "gcv"
) -> SmoothedCouple:
    """Smooth values with random errors, given at the nodes of two dual grids (Section 5.1).

    Parameters
    ----------
    F : (M,) or (M, k) array of float
        Values at the nodes of the first grid: of the triangulation, or of grid A. Columns are
        smoothed with the same weights.
    G : (N,) or (N, k) array of float
        Values at the nodes of the second grid: the barycentres of the triangles, or the nodes
        of grid B.
    grids : DualMesh or GridCouple
        The grids.
    weights : {"gcv"}, pair of float or Weights
        Generalised cross-validation; the paper's W1 and W2 as `Weights.init_paper` reads them;
        or all eight weights.

    Returns
    -------
    SmoothedCouple
        ``U, V = smooth_couple(F, G, grids)``.

    Raises
    ------
    ValueError
        If there is not one finite value for each node, or the weights are wrong.
    TypeError
        If ``grids`` or ``weights`` are something else.
    MeshError
        If a cell is not star-shaped about its node.

    Examples
    --------
    >>> from skfem_dual import rectangular_couple
    >>> lines = np.linspace(0, 1, 11)
    >>> couple = rectangular_couple(lines, lines)
    >>> p, q = couple.a.polygons.p, couple.b.polygons.p
    >>> rng = np.random.default_rng(0)
    >>> F, G = (x[0] * x[1] + rng.uniform(-0.06, 0.06, x.shape[1]) for x in (p, q))
    >>> U, V = smooth_couple(F, G, couple)
    >>> print(f"{np.std(F - p[0] * p[1]):.3f} -> {np.std(U - p[0] * p[1]):.3f}")
    0.037 -> 0.020
    """
    neighbours = Neighbours.of(grids)
    F, G = neighbours.checked(F, G)
    choice, reason = chosen(weights, neighbours, F, G)
    first, second = CoupleFunctional(neighbours, choice).minimise(F, G)
    return SmoothedCouple(grids, readonly(first), readonly(second), choice, reason)


def joined_field(
    grids: DualMesh | GridCouple, F: ArrayLike, G: ArrayLike
) -> tuple[CellBasis, ndarray]:
    """Values at the nodes of two grids as a field, see `SmoothedCouple.field`."""
    F, G = np.asarray(F, dtype=float), np.asarray(G, dtype=float)
    if isinstance(grids, DualMesh):
        mesh = grids.mesh
        ends = mesh.facets[:, mesh.boundary_facets()]
        values = np.concatenate([F, G, F[ends].mean(axis=0)])
        return CellBasis(general_triangulation(grids), ElementTriP1()), values
    cells, node = grids.a.polygons, grids.node_in_a
    following = np.arange(1, len(cells.indices) + 1)
    following[cells.offsets[1:] - 1] = cells.offsets[:-1]
    apex = np.repeat(node, cells.sizes)
    t = np.stack([cells.indices, cells.indices[following], cells.p.shape[1] + apex])[:, apex >= 0]
    p = np.hstack([cells.p, grids.b.polygons.p])
    # maximal grids B have nodes beyond A: left out
    used, t = np.unique(t, return_inverse=True)
    t = np.ascontiguousarray(t.reshape(3, -1), dtype=np.int32)
    mesh = MeshTri(np.ascontiguousarray(p[:, used]), t)
    return CellBasis(mesh, ElementTriP1()), np.concatenate([F, G])[used]
