"""Couples of rectangular grids (Fig. 2a, b)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_array, checked_choice, checked_mask
from ..errors import MeshError
from ..messages import apart
from .couples import GridCouple, Kind, grid_of
from .partition import Partition


@dataclass(frozen=True, eq=False)
class _Tensor:
    """A grid of some rectangles of a tensor grid.

    ``node``, ``cell``, ``along_x`` and ``along_y`` hold the numbers of nodes, cells and ribs in
    the lattice, -1 where there is none; ``p`` the coordinates of the nodes.
    """

    p: ndarray
    node: ndarray
    cell: ndarray
    along_x: ndarray
    along_y: ndarray

    @classmethod
    def from_cells(cls, x: ndarray, y: ndarray, present: ndarray) -> "_Tensor":
        ring = np.pad(present, 1)
        along_x, along_y = ring[1:-1, 1:] | ring[1:-1, :-1], ring[1:, 1:-1] | ring[:-1, 1:-1]
        wide = np.pad(along_x, ((1, 1), (0, 0)))
        node = wide[1:] | wide[:-1]
        i, j = np.nonzero(node)
        p = np.stack([x[i], y[j]])
        along_x, along_y = _numbers(along_x), _numbers(along_y)
        along_y[along_y >= 0] += along_x.max() + 1
        return cls(p, _numbers(node), _numbers(present), along_x, along_y)

    def partition(self, nodes: ndarray) -> Partition:
        node, ring = self.node, np.pad(self.cell, 1, constant_values=-1)
        corners = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]])
        indices = corners[:, self.cell >= 0].T
        ribs = [
            np.stack([tail, head, left, right])[:, rib >= 0]
            for rib, tail, head, left, right in (
                (self.along_x, node[:-1], node[1:], ring[1:-1, 1:], ring[1:-1, :-1]),
                (self.along_y, node[:, :-1], node[:, 1:], ring[:-1, 1:-1], ring[1:, 1:-1]),
            )
        ]
        tail, head, left, right = np.hstack(ribs)
        return grid_of(
            self.p,
            indices.ravel(),
            4 * np.arange(len(indices) + 1),
            np.stack([tail, head]),
            np.stack([left, right]),
            nodes,
        )


def _numbers(mask: ndarray) -> ndarray:
    """Numbers from 0 where ``mask`` is true, -1 elsewhere."""
    numbers = np.full(mask.shape, -1)
    numbers[mask] = np.arange(np.count_nonzero(mask))
    return numbers


def rectangular_couple(
    x: ArrayLike,
    y: ArrayLike,
    *,
    missing: ArrayLike | None = None,
    around: Literal["inner", "all"] | ndarray = "inner",
) -> GridCouple:
    """A grid A of rectangles and the dual grid B with its nodes at their barycentres (Figure 2).

    The cells of B are rectangles that join four barycentres, beyond the edge of A those of
    cells mirrored there.

    Parameters
    ----------
    x, y : (nx,), (ny,) array of float
        Increasing coordinates of the lines of A.
    missing : (nx - 1, ny - 1) array of bool, optional
        Rectangles left out: holes, notches, gaps between parts.
    around : {"inner", "all"} or (nx, ny) array of bool
        Nodes of A with a cell of B around them. ``"inner"`` gives the minimal grid B,
        ``"all"`` the maximal one (Definition 4); a mask one in between (Fig. 2b), its values
        where A has no node are ignored.

    Returns
    -------
    GridCouple
        Nodes, cells and ribs are numbered in the order of the lattice, ``y`` fastest.

    Raises
    ------
    TypeError, ValueError
        If something is no array of numbers or booleans, or ``around`` another word.
    MeshError
        If the arrays do not make a grid, or there is no such dual grid: no inner node or a cell
        without one for ``"inner"``; a gap of one rectangle between the cells of B for
        ``"all"``; an inner node that ``around`` leaves out.

    Examples
    --------
    >>> rectangular_couple(range(8), range(8))
    <skfem_dual GridCouple object>
      Kind: 2-type, B minimal
      A: 49 cells, 112 ribs, 64 nodes, area 49
      B: 36 cells, 84 ribs, 49 nodes, area 36
      Corresponded ribs: 84
    """
    x = checked_array("x", x, ("n",), least=2, error=MeshError)
    y = checked_array("y", y, ("n",), least=2, error=MeshError)
    for name, c in (("x", x), ("y", y)):
        if len(bad := np.nonzero(~(np.diff(c) > 0))[0]):
            i = bad[0]
            first, second = apart(*c[i : i + 2])
            raise MeshError(
                f"expected increasing coordinates {name}, got {first} and {second} at index "
                f"{i} and {i + 1}"
            )
    present = np.ones((len(x) - 1, len(y) - 1), dtype=bool)
    if missing is not None:
        present &= ~checked_mask("missing", missing, present.shape, error=MeshError)
    if not present.any():
        raise MeshError("expected a rectangle that is not missing")
    kind, cells = _cells(present, around)
    a = _Tensor.from_cells(x, y, present)
    b = _Tensor.from_cells(_middles(x), _middles(y), cells)
    ribs = [
        np.stack([one, other])[:, (one >= 0) & (other >= 0)]
        for one, other in ((a.along_x, b.along_y[1:-1]), (a.along_y, b.along_x[:, 1:-1]))
    ]
    node_in_a, node_in_b = b.node[1:-1, 1:-1][present], a.node[cells]
    return GridCouple(
        kind,
        a.partition(b.p[:, node_in_a]),
        b.partition(a.p[:, node_in_b]),
        node_in_a,
        node_in_b,
        np.hstack(ribs),
    )


def _cells(present: ndarray, around: str | ndarray) -> tuple[Kind, ndarray]:
    """Nodes of A with a cell of B around them, shape (nx, ny), and the kind of the couple; errors
    as of `rectangular_couple`."""
    kinds: dict[str, Kind] = {"inner": "minimal", "all": "maximal"}
    kind: Kind
    ring = np.pad(present, 1).astype(int)
    count = ring[1:, 1:] + ring[1:, :-1] + ring[:-1, 1:] + ring[:-1, :-1]
    if isinstance(around, str):
        checked_choice("around", around, kinds)
        kind, cells = kinds[around], count > (3 if around == "inner" else 0)
    else:
        kind = "2-type"
        cells = checked_mask("around", around, count.shape, error=MeshError) & (count > 0)
        if np.any(left_out := (count == 4) & ~cells):
            raise MeshError(
                f"expected a cell around every inner node (Definition 3, condition 1); nodes "
                f"{_places(left_out)} have none"
            )
    if not cells.any():
        raise MeshError(
            "expected nodes with a cell of B around them, got none: a grid without inner nodes "
            "has no minimal dual grid. Remedy: refine it, or around='all'"
        )
    grown = np.pad(cells, 1)
    corners = np.stack([grown[1:, 1:], grown[1:, :-1], grown[:-1, 1:], grown[:-1, :-1]])
    nodes_in_cells = corners[:, 1:-1, 1:-1]
    if np.any(bare := present & ~nodes_in_cells.any(axis=0)):
        raise MeshError(
            "expected every rectangle to be next to a node with a cell of B (Definition 3, "
            f"condition 2); rectangles {_places(bare)} are not. Remedy: refine the grid there, "
            "or around='all'"
        )
    if np.any(closed := ~present & nodes_in_cells.all(axis=0)):
        raise MeshError(
            "expected the cells of B to leave gaps and holes of A open (Definition 3, condition "
            f"1); they close the missing rectangles {_places(closed)}. Remedy: refine the grid, "
            "or leave out some boundary nodes with a mask"
        )
    return kind, cells


def _middles(x: ndarray) -> ndarray:
    """Middles of the intervals of ``x``, with one mirrored interval at each end."""
    middle = (x[1:] + x[:-1]) / 2
    return np.concatenate([2 * x[:1] - middle[:1], middle, 2 * x[-1:] - middle[-1:]])


def _places(mask: ndarray) -> str:
    places = [f"({i}, {j})" for i, j in np.argwhere(mask)[:6]]
    return ", ".join(places[:5]) + (", ..." if len(places) > 5 else "")
