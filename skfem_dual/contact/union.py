"""Cells of several bodies taken together: one partition, one operator."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..elements.edge_weights import EdgeWeights
from ..elements.law_moments import LawFactors
from ..elements.slopes import Around, Slopes
from ..grids.fan import Fan
from ..grids.partition import Partition
from ..grids.polygons import Polygons, readonly
from ..kernels.once import computed_once
from ..operators.entries import some_rows
from ..operators.influence_operator import InfluenceOperator
from ..operators.resources import ENTRY, refuse_beyond_memory
from .footprint import Footprint
from .loaded_cells import ExactRows, LoadedCells, slices_of


def union(parts: Sequence[LoadedCells]) -> LoadedCells:
    """The cells of all parts, one after the other, on the ground of the first.

    Parts keep their weights: the edge of one is none for the cells of another.
    """
    partition = _union_of_partitions([part.partition for part in parts])
    points = np.hstack([part.collocation_points for part in parts])
    weights = _union_of_weights(parts, partition)
    slopes = None if weights is None else _union_of_slopes(parts, weights)
    return LoadedCells(parts[0].substrate, partition, weights, slopes, points)


def matrix_of(parts: Sequence[LoadedCells]) -> ndarray:
    """From the cells of all parts to their collocation points, exact.

    Raises
    ------
    MemoryError
        Before the work, if the memory at hand will not do.
    """
    slices = slices_of(parts)
    n = slices[-1].stop
    remedy = "rtol=1e-6 for all punches, or coarser meshes"
    refuse_beyond_memory(ENTRY * n**2, f"the matrix of {n} cells and its factors take", remedy)
    matrix = np.empty((n, n))
    for rows, at in zip(slices, parts, strict=True):
        for columns, under in zip(slices, parts, strict=True):
            matrix[rows, columns] = under.influence(at.collocation_points)
    return matrix


def joint_operator(parts: Sequence[Footprint], cells: LoadedCells) -> ndarray | InfluenceOperator:
    """From all cells to their collocation points, as accurate as any of the parts asks for.

    Up to 4000 cells exact and dense, unless all parts have an ``rtol``; beyond, the least of
    these. ``cells`` is the union of the parts.
    """
    if in_blocks(parts, cells):
        return matrix_of(parts)
    return cells.operator(min(part.tolerance for part in parts))


def in_blocks(parts: Sequence[Footprint], cells: LoadedCells) -> bool:
    """Whether their operator is made of those of the parts: each on the ground as it sees it
    alone, which for cells of different sizes on thin skins is not one."""
    return any(part.rtol is None for part in parts) and cells.few


def rows_of(parts: Sequence[LoadedCells]) -> ExactRows:
    """Some rows of that matrix."""
    x = np.hstack([part.collocation_points for part in parts])
    i = some_rows(x.shape[1], x.shape[1])
    x = np.ascontiguousarray(x[:, i])
    return ExactRows(i, np.hstack([part.influence(x) for part in parts]))


def _union_of_partitions(parts: list[Partition]) -> Partition:
    """Ribs of different parts are not shared, and boundaries keep the facets of their meshes."""
    points = _firsts([part.polygons.p.shape[1] for part in parts])
    cells = _firsts([len(part) for part in parts])
    return Partition(
        Polygons.together([part.polygons for part in parts]),
        np.hstack([part.facets + first for part, first in zip(parts, points)]),
        np.hstack(
            [np.where(part.f2c >= 0, part.f2c + first, -1) for part, first in zip(parts, cells)]
        ),
        np.hstack([part.nodes for part in parts]),
        np.concatenate([part.boundary for part in parts]),
    )


def _union_of_weights(parts: Sequence[LoadedCells], partition: Partition) -> EdgeWeights | None:
    cells = _firsts([len(part) for part in parts])
    ribs = _firsts([part.partition.facets.shape[1] for part in parts])
    weighted = [i for i, part in enumerate(parts) if part.weights is not None]
    weights = [part.weights for part in parts if part.weights is not None]
    if not weights:
        return None
    fans = [each.fan for each in weights]
    points = _firsts([fan.p.shape[1] for fan in fans])
    fan = Fan(
        readonly(np.hstack([fan.p for fan in fans])),
        readonly(np.hstack([fan.t + first for fan, first in zip(fans, points)]), np.int32),
        readonly(
            np.concatenate([fan.cell + cells[i] for fan, i in zip(fans, weighted)]), np.int32
        ),
        np.concatenate([fan.part for fan in fans]),
    )
    edge = np.concatenate([each.ribs + ribs[i] for each, i in zip(weights, weighted)])
    return _UnionWeights(partition, fan, edge, tuple(weights), cells[weighted])


def _union_of_slopes(parts: Sequence[LoadedCells], weights: EdgeWeights) -> Slopes:
    """Parts without slopes have none here, and none take theirs from another part."""
    around, moments = [], []
    for part in parts:
        slopes, n = part.slopes, len(part)
        if slopes is None:
            slopes = Slopes.from_partition(part.partition).without(np.ones(n, dtype=bool))
        around.append(slopes.around)
        moments.append(np.zeros((2, 2, n)) if part.slopes is None else slopes.second_moments)
    known = Around.together(around), readonly(np.concatenate(moments, axis=2))
    return Slopes(weights.partition, weights, *known)


@dataclass(frozen=True, eq=False)
class _UnionWeights(EdgeWeights):
    """Weights whose distances are those to the edge of the own part."""

    parts: tuple[EdgeWeights, ...]
    first: ndarray  # cell of each part

    @computed_once
    def root(self) -> ndarray:
        """Square root of phi at the points of the fan."""
        return readonly(np.concatenate([part.root for part in self.parts]))

    @computed_once
    def factors(self) -> LawFactors:
        """The laws of the parts, and that of each cell."""
        values, per_root, _ = zip(*(part.factors for part in self.parts))
        # of cells that see no law of the ground, as on thin skins, all factors are one
        most = max(table.shape[1] for table in values)
        values = tuple(v if v.shape[1] == most else np.ones((len(v), most)) for v in values)
        own = np.searchsorted(self.first, np.arange(len(self.partition)), "right") - 1
        return LawFactors(
            np.vstack(values), np.concatenate(per_root), own.clip(0).astype(np.int32)
        )


def _firsts(counts: Sequence[int]) -> ndarray:
    """Number of the first of so many things of each part."""
    return np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(int)
