"""What influence operators are made from: the ground as cells see it, their law, the points."""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy import ndarray
from skfem import CellBasis

from ..elements.edge_weights import EdgeWeights
from ..elements.flexible import cells_of
from ..elements.influence import as_points
from ..elements.resolution import require_sizes
from ..elements.slopes import Slopes
from ..grids.lattice import Lattice
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..ground.seen import seen_by
from ..ground.substrates import Substrate
from ..messages import shown

#: how the pressure varies inside cells
Edge = Literal["singular", "constant"] | EdgeWeights | Slopes
#: where settlements are found
Collocation = Literal["centroid", "node"] | ndarray


class Discretisation(NamedTuple):
    """Loaded cells and the points that settle.

    Attributes
    ----------
    ground : Substrate
        As the cells see it.
    partition : Partition
        The cells.
    weights : EdgeWeights or None
        Their law of the edge, if they have one.
    slopes : Slopes or None
        How the pressure varies inside beside that.
    x : (2, m) array of float
        The points.
    """

    ground: Substrate
    partition: Partition
    weights: EdgeWeights | None
    slopes: Slopes | None
    x: ndarray

    @classmethod
    def of(
        cls, substrate: Substrate, basis: CellBasis | Partition, edge: Edge, points: Collocation
    ) -> "Discretisation":
        """By arguments of `InfluenceOperator`.

        Raises
        ------
        TypeError, ValueError
            If one is none of those, or there is no point.
        """
        basis = cells_of(basis)
        partition = basis if isinstance(basis, Partition) else Partition.from_basis(basis)
        ground = _ground(substrate, partition, edge)
        weights, slopes = _law(ground, basis, partition, edge)
        x = readonly(_points(partition, points))
        if x.shape[1] == 0:
            raise ValueError("expected at least one point to settle, got none")
        return cls(ground, partition, weights, slopes, x)

    @property
    def lattice(self) -> Lattice | None:
        """The regular grid on which the matrix is Toeplitz."""
        even = self.weights is None and self.slopes is None
        if even and np.array_equal(self.x, self.partition.centroids):
            return self.partition.lattice
        return None


def _ground(
    substrate: Substrate,
    partition: Partition,
    edge: Edge,
) -> Substrate:
    """The ground as cells of a singular edge see it, as under a `RigidPunch`."""
    if not isinstance(edge, str) or edge != "singular":
        return substrate
    return seen_by(substrate, partition.areas[partition.f2c[0, edge_ribs(partition)]])


def _law(
    ground: Substrate,
    basis: CellBasis | Partition,
    partition: Partition,
    edge: Edge,
) -> tuple[EdgeWeights | None, Slopes | None]:
    """How the pressure varies inside cells; None if it does not."""
    if isinstance(edge, Slopes):
        law: Any = "constant" if edge.weights is None else edge.weights
        return _law(ground, basis, partition, law)[0], edge
    if isinstance(edge, EdgeWeights):
        if len(edge.mean) != len(partition):
            raise ValueError(
                f"expected weights of {len(partition)} cells for edge, got {len(edge.mean)}"
            )
        return edge, None
    if not isinstance(edge, str) or edge not in ("singular", "constant"):
        raise ValueError(
            f'expected edge "singular" or "constant", or EdgeWeights, got {shown(edge)}'
        )
    if edge == "constant":
        return None, None
    if isinstance(basis, Partition):
        raise ValueError(
            'expected edge "constant" or EdgeWeights with a partition, got "singular". Remedy: '
            "a basis, whose mesh tells the weights"
        )
    require_sizes(partition)
    weights = EdgeWeights.from_basis(basis, partition, edge_ribs(partition), ground)
    return weights, Slopes.from_weights(weights)


def _points(partition: Partition, collocation: Collocation) -> ndarray:
    """Field points, shape (2, m)."""
    if not isinstance(collocation, str):
        return as_points(collocation)
    if collocation not in ("centroid", "node"):
        raise ValueError(
            f'expected collocation "centroid" or "node", or points, got {collocation!r}'
        )
    return partition.nodes if collocation == "node" else partition.centroids
