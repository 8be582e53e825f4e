"""Two grids and what corresponds to what in them: all couples of Definitions 2, 3 and 4."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_array

from ..arguments import checked_choice, checked_indices, checked_instance
from ..errors import MeshError
from ..kernels.once import ReadOnly, computed_once
from .dual_mesh import DualMesh
from .partition import Partition
from .polygons import Polygons, readonly

#: what B is to A: Definition 2; Definition 3; the extremal couples of Definition 4
Kind = Literal["1-type", "2-type", "maximal", "minimal"]


@dataclass(frozen=True, eq=False, repr=False)
class GridCouple(ReadOnly):
    """Two grids A and B and what corresponds to what in them.

    Build it with `GridCouple.from_dual`, `rectangular_couple`, `minimal_couple`,
    `maximal_couple` or `delaunay_voronoi`; test it with `check_dual`.

    Parameters
    ----------
    kind : {"1-type", "2-type", "maximal", "minimal"}
        What B is to A: dual in the sense of Definition 2, of Definition 3, and the maximal or
        minimal grid of Definition 4.
    a, b : Partition
        The grids. The nodes of a grid, in the words of the paper, are the vertices of its
        cells, ``a.polygons.p`` and ``b.polygons.p``.
    node_in_a : (ncells_a,) array of int
        Node of B in each cell of A, -1 if there is none.
    node_in_b : (ncells_b,) array of int
        Node of A in each cell of B, -1 if there is none.
    ribs : (2, k) array of int
        Pairs of corresponded ribs, columns of ``a.facets`` and of ``b.facets``.
    unbounded : array of int
        Cells of B that are unbounded on the whole plane and were cut off.

    Raises
    ------
    TypeError
        If something is no partition or no array of integers.
    ValueError
        If ``kind`` is another.
    MeshError
        If the arrays do not fit together.
    """

    kind: Kind
    a: Partition
    b: Partition
    node_in_a: ndarray
    node_in_b: ndarray
    ribs: ndarray
    unbounded: ndarray = field(default_factory=lambda: np.empty(0, int))

    def __post_init__(self) -> None:
        checked_choice("kind", self.kind, ("1-type", "2-type", "maximal", "minimal"))
        a, b = (checked_instance(x, getattr(self, x), Partition) for x in ("a", "b"))
        nodes_a, nodes_b = a.polygons.p.shape[1], b.polygons.p.shape[1]
        found = {
            name: checked_indices(
                name, getattr(self, name), n, shape, least=least, error=MeshError
            )
            for name, n, shape, least in (
                ("node_in_a", nodes_b, (len(a),), -1),
                ("node_in_b", nodes_a, (len(b),), -1),
                ("ribs", max(a.facets.shape[1], b.facets.shape[1]), (2, "n"), 0),
                ("unbounded", len(b), ("n",), 0),
            )
        }
        for row, grid in zip(found["ribs"], (a, b)):
            checked_indices("ribs", row, grid.facets.shape[1], error=MeshError)
        for name, value in found.items():
            object.__setattr__(self, name, readonly(value, np.int32))

    @classmethod
    def from_dual(cls, dual: DualMesh) -> "GridCouple":
        """A triangulation and its 1-type dual grid; a TypeError for anything else."""
        checked_instance("dual", dual, DualMesh, "DualMesh.from_mesh(mesh)")
        return cls(
            "1-type",
            dual.primal_partition,
            dual.partition,
            np.arange(dual.mesh.nelements),
            np.arange(len(dual)),
            np.tile(np.arange(dual.mesh.nfacets), (2, 1)),
        )

    def __repr__(self) -> str:
        kind = {"maximal": "2-type, B maximal", "minimal": "2-type, B minimal"}
        lines = [f"Kind: {kind.get(self.kind, self.kind)}"]
        for name, grid in (("A", self.a), ("B", self.b)):
            lines.append(
                f"{name}: {len(grid)} cells, {grid.facets.shape[1]} ribs, "
                f"{grid.polygons.p.shape[1]} nodes, area {grid.areas.sum():.4g}"
            )
        lines.append(f"Corresponded ribs: {self.ribs.shape[1]}")
        if len(self.unbounded):
            lines.append(f"Cells of B cut off: {len(self.unbounded)}")
        return "\n  ".join(["<skfem_dual GridCouple object>", *lines])

    def swapped(self) -> "GridCouple":
        """The couple with A and B exchanged: maximal becomes minimal, by Proposition 1.

        Raises
        ------
        MeshError
            If the couple is 1-type, which is not mutual, or cells of B were cut off.
        """
        if self.kind == "1-type":
            raise MeshError("expected a 2-type couple: the 1-type relation is not mutual")
        if len(self.unbounded):
            raise MeshError("expected bounded cells, got cells of B that were cut off")
        other: dict[Kind, Kind] = {"maximal": "minimal", "minimal": "maximal"}
        return GridCouple(
            other.get(self.kind, self.kind),
            self.b,
            self.a,
            self.node_in_b,
            self.node_in_a,
            self.ribs[::-1],
        )

    @computed_once
    def around_a(self) -> csr_array:
        """Nodes of B that surround each node of A (Section 5), ones in a sparse matrix.

        Shape (nodes of A, nodes of B). Row ``i`` holds the vertices of the cell of B around
        node ``i``; it is empty if there is none, and for the boundary nodes of a 1-type couple,
        which lie on the boundaries of their cells.
        """
        boundary = boundary_nodes(self.a) if self.kind == "1-type" else np.empty(0, int)
        return _surrounding(self.b.polygons, self.node_in_b, self.a.polygons.p.shape[1], boundary)

    @computed_once
    def around_b(self) -> csr_array:
        """Nodes of A that surround each node of B, as `around_a`."""
        n = self.b.polygons.p.shape[1]
        return _surrounding(self.a.polygons, self.node_in_a, n, np.empty(0, int))


def _surrounding(polygons: Polygons, node: ndarray, n: int, but: ndarray) -> csr_array:
    row = np.repeat(node, polygons.sizes)
    held = (row >= 0) & ~np.isin(row, but)
    place = row[held], polygons.indices[held]
    return csr_array((np.ones(len(place[0])), place), shape=(n, polygons.p.shape[1]))


def boundary_nodes(grid: Partition) -> ndarray:
    """Nodes of a grid on the boundary of its domain."""
    return np.unique(grid.facets[:, (grid.f2c < 0).any(axis=0)])


def grid_of(
    p: ndarray, indices: ndarray, offsets: ndarray, facets: ndarray, f2c: ndarray, nodes: ndarray
) -> Partition:
    """A partition from its polygons and ribs, ribs on the boundary in either direction."""
    outside = f2c[0] < 0
    facets, f2c = (np.where(outside, x[::-1], x) for x in (facets, f2c))
    boundary = np.where(f2c[1] < 0, np.arange(facets.shape[1]), -1)
    return Partition(Polygons(p, indices, offsets), facets, f2c, nodes, boundary)
