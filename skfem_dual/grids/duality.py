"""Definitions 1 to 4 as a check of any couple of grids."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..messages import shown
from .couples import GridCouple, boundary_nodes
from .dual_mesh import DualMesh
from .partition import Partition
from .planar import (
    MARGIN,
    containing,
    covered_twice,
    cross,
    line_crossings,
    on_segments,
    rounding,
    self_crossing,
)
from .report import Condition, Report, where


@dataclass(frozen=True, eq=False, repr=False)
class DualReport(Report):
    """What `check_dual` found; ``ok`` if the couple is of the kind it claims to be.

    Attributes
    ----------
    conditions : tuple of Condition
        The conditions of Definitions 1 to 4; offending indices count cells, ribs and nodes of
        A or B as ``entity`` says. Those of Definition 4 are information unless claimed.
    """


def check_dual(couple: GridCouple | DualMesh) -> DualReport:
    """Test a couple of grids against Definitions 1 to 4, by geometry alone.

    Which node lies in which cell, where ribs cross and which ribs bound a cell is found anew;
    how the couple was made is not trusted.

    Parameters
    ----------
    couple : GridCouple or DualMesh
        The couple; a DualMesh is tested as 1-type (Definition 2).

    Returns
    -------
    DualReport

    Raises
    ------
    TypeError
        If ``couple`` is something else.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> check_dual(DualMesh.from_mesh(MeshTri().refined(2))).ok
    True
    """
    if isinstance(couple, DualMesh):
        couple = GridCouple.from_dual(couple)
    if not isinstance(couple, GridCouple):
        raise TypeError(f"expected a GridCouple or a DualMesh, got {shown(couple)}")
    one_type = couple.kind == "1-type"
    a, b = couple.a, couple.b
    conditions = [*_partition(a, "A"), *_partition(b, "B"), *_graphs(couple)]
    on_edge = np.zeros(a.polygons.p.shape[1], dtype=bool)
    if one_type:  # boundary nodes of A are nodes of B too, on the boundaries of their cells
        on_edge[boundary_nodes(a)] = True
    places_b = _Places(a, b.polygons.p, couple.node_in_a, "A", "B")
    places_a = _Places(b, a.polygons.p, couple.node_in_b, "B", "A", on_edge)
    conditions += [*places_b.conditions(), *places_a.conditions(), _crossings(couple)]
    conditions += [
        places.inner(boundary_nodes(grid)) for places, grid in ((places_a, a), (places_b, b))
    ]
    if one_type:
        conditions += [_same_edge(a, b, "A", "B"), _same_edge(b, a, "B", "A")]
    else:
        inner = np.ones(a.polygons.p.shape[1], dtype=bool)
        inner[boundary_nodes(a)] = False
        conditions += [
            Condition(
                "every node of A in a cell of B (Definition 4, maximal)",
                "node of A",
                where(~places_a.held),
                required=couple.kind == "maximal",
            ),
            Condition(
                "in every cell of B an inner node of A (Definition 4, minimal)",
                "cell of B",
                where(~places_a.holds(inner)),
                required=couple.kind == "minimal",
            ),
        ]
    return DualReport(tuple(conditions))


def _partition(grid: Partition, name: str) -> Iterator[Condition]:
    """That a grid is a partition, without which the other conditions say nothing."""
    yield _sides(grid, name)
    polygons = grid.polygons
    yield Condition(
        f"cells of {name} whose sides do not cross each other",
        f"cell of {name}",
        self_crossing(polygons),
    )
    # cells lie to the left of their sides: only at ribs with one cell can their number change
    rim = np.nonzero(grid.f2c[1] < 0)[0]
    length = np.hypot(*np.subtract(*grid.ends(rim)))
    rim, length = (each[length > rounding(polygons.p)] for each in (rim, length))
    (start, end), cell = grid.ends(rim), grid.f2c[0, rim]
    normal = np.stack([start[1] - end[1], end[0] - start[0]]) / length
    inside = (start + end) / 2 + normal * (polygons.areas / polygons.radii)[cell]
    yield Condition(
        f"no place covered twice by {name}",
        f"rib of {name}",
        rim[covered_twice(polygons.p, grid.facets[:, rim], inside)],
        "parts with these boundary ribs overlap: remove or move one",
    )


def _sides(grid: Partition, name: str) -> Condition:
    """That ribs and cells belong together."""
    polygons, (start, end) = grid.polygons, grid.facets
    following = np.arange(1, len(polygons.indices) + 1)
    following[polygons.offsets[1:] - 1] = polygons.offsets[:-1]
    cell = np.repeat(np.arange(len(polygons)), polygons.sizes)
    left, right = (side >= 0 for side in grid.f2c)
    n = np.int64(polygons.p.shape[1])
    sides = polygons.indices * n + polygons.indices[following]
    ribs = np.append((start * n + end)[left], (end * n + start)[right])
    beside = np.append(grid.f2c[0, left], grid.f2c[1, right])
    _, number = np.unique(np.append(sides, ribs), return_inverse=True)
    number = number * len(polygons) + np.append(cell, beside)
    # every side and rib is there once, so nothing needs to be made unique
    apart = np.setxor1d(number[: len(sides)], number[len(sides) :], assume_unique=True)
    return Condition(
        f"the ribs of {name} as sides of its cells",
        f"cell of {name}",
        np.unique(apart % len(polygons)),
    )


def _graphs(couple: GridCouple) -> list[Condition]:
    """Definition 1, condition 1: corresponded ribs join corresponded nodes."""
    wrong, conditions = np.zeros(couple.ribs.shape[1], dtype=bool), []
    grids = (couple.a, couple.b)
    for grid, other, node, rib, partner in (
        (*grids, couple.node_in_a, *couple.ribs),
        (*grids[::-1], couple.node_in_b, *couple.ribs[::-1]),
    ):
        cells, ends = grid.f2c[:, rib], other.facets[:, partner]
        joined = np.where(cells >= 0, node[cells], -2)
        # the nodes in the cells beside a rib are the ends of its partner
        known = (joined == -2) | (joined == ends) | (joined == ends[::-1])
        wrong |= ~known.all(axis=0) | (joined[0] == joined[1])
    for name, grid, node, rib in (
        ("A", couple.a, couple.node_in_b, couple.ribs[0]),
        ("B", couple.b, couple.node_in_a, couple.ribs[1]),
    ):
        # all ribs at a node bound the cell around it, so they have partners there
        enclosed = np.zeros(grid.polygons.p.shape[1], dtype=bool)
        enclosed[node[node >= 0]] = True
        count = np.bincount(rib, minlength=grid.facets.shape[1])
        bad = (count > 1) | (enclosed[grid.facets].any(axis=0) & (count == 0))
        bad[rib[wrong]] = True
        conditions.append(
            Condition(
                f"a corresponded rib between the corresponded nodes for each rib of {name} at a "
                "node in a cell (Definition 1, condition 1)",
                f"rib of {name}",
                where(bad),
                "the graphs are not dual: mend the corresponded nodes and ribs",
            )
        )
    return conditions


class _Places:
    """The nodes ``x`` of one grid in the cells of the other, each found by its coordinates.

    Nodes ``on_edge`` may be on the boundaries of their own cells.
    """

    def __init__(
        self,
        grid: Partition,
        x: ndarray,
        node: ndarray,
        name: str,
        other: str,
        on_edge: ndarray | None = None,
    ):
        self.grid, self.node, self.name, self.other = grid, node, name, other
        cell, point, depth = containing(grid.polygons, x)
        inside = depth > MARGIN
        if on_edge is not None:
            inside |= on_edge[point] & (node[cell] == point) & (depth > -MARGIN)
        self.cell, self.point = cell[inside], point[inside]
        self.held = np.zeros(x.shape[1], dtype=bool)
        self.held[self.point] = True

    def holds(self, wanted: ndarray) -> ndarray:
        """Which cells contain one of the nodes marked in ``wanted``."""
        held = np.zeros(len(self.grid), dtype=bool)
        held[self.cell[wanted[self.point]]] = True
        return held

    def conditions(self) -> list[Condition]:
        """Definition 1, conditions 2 and 3."""
        own = np.zeros(len(self.grid), dtype=bool)
        own[self.cell[self.point == self.node[self.cell]]] = True
        count = np.bincount(self.cell, minlength=len(self.grid))
        return [
            Condition(
                f"the corresponded node of {self.other} in each cell of {self.name} "
                "(Definition 1, condition 2)",
                f"cell of {self.name}",
                where(~own),
                "relocate the nodes, or mend their numbers",
            ),
            Condition(
                f"one node of {self.other} in each cell of {self.name} "
                "(Definition 1, condition 3)",
                f"cell of {self.name}",
                where(count != 1),
                "relocate the nodes",
            ),
        ]

    def inner(self, boundary: ndarray) -> Condition:
        """Definition 3, condition 1."""
        free = ~self.held
        free[boundary] = False
        return Condition(
            f"each inner node of {self.other} in a cell of {self.name} "
            "(Definition 3, condition 1)",
            f"node of {self.other}",
            where(free),
            "relocate the nodes, or add cells around them",
        )


def _crossings(couple: GridCouple) -> Condition:
    """Definition 1, condition 4; ribs are straight because they are pairs of nodes."""
    (rib, partner), a, b = couple.ribs, couple.a, couple.b
    start, end = a.ends(rib)
    tail, head = b.ends(partner)
    s, t = line_crossings(start, end, tail, head)
    # in a 1-type couple the partner of a boundary rib ends in it: the rest is outside
    least = np.full(len(rib), MARGIN)
    if couple.kind == "1-type":
        edge = a.f2c[1, rib] < 0
        u, v = (end - start)[:, edge], (head - tail)[:, edge]
        with np.errstate(divide="ignore", invalid="ignore"):  # parallel ribs do not cross
            blur = rounding(start, tail) * np.hypot(*u) / np.abs(cross(u, v))
        least[edge] = -MARGIN - np.nan_to_num(blur, posinf=0.0)
    inner = (s > MARGIN) & (s < 1 - MARGIN) & (t > least) & (t < 1 - least)
    return Condition(
        "corresponded ribs to cross in a point inside both (Definition 1, condition 4)",
        "rib of A",
        np.unique(rib[~inner]),
        "relocate the nodes or flip the ribs",
    )


def _same_edge(grid: Partition, other: Partition, name: str, other_name: str) -> Condition:
    """Definition 2: both grids on one domain."""
    edge, rim = (np.nonzero((g.f2c < 0).any(axis=0))[0] for g in (grid, other))
    a, b = grid.ends(edge)
    points = np.hstack([a, (a + b) / 2, b])
    on = on_segments(points, *other.ends(rim))
    return Condition(
        f"the boundary of {name} on that of {other_name} (Definition 2)",
        f"rib of {name}",
        edge[~on.reshape(3, -1).all(axis=0)],
        "let both grids fill the same domain",
    )
