"""Punches that are joined rigidly: which are one body, and where they touch."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy import ndarray

from ..arguments import checked_integer, checked_sequence
from ..errors import warnings_kept
from ..grids.outline import edge_ribs, on_ribs
from ..grids.partition import Partition
from ..operators.symmetry import Symmetry
from .punch import RigidPunch


def checked_joined(joined: Sequence[Sequence[int]], n: int) -> list[tuple[int, ...]]:
    """Numbers of the punches of each group, out of n.

    Raises
    ------
    TypeError, ValueError
        If these are no numbers, or a punch is named twice or does not exist.
    """
    groups = [
        tuple(checked_integer("joined", i) for i in checked_sequence("joined", group))
        for group in checked_sequence("joined", joined)
    ]
    named = [i for group in groups for i in group]
    known = all(0 <= i < n for i in named) and all(groups)
    if len(set(named)) < len(named) or not known:
        raise ValueError(
            f"expected numbers of punches from 0 to {n - 1}, each once, for joined, got {groups}"
        )
    return groups


def free_of(punch: RigidPunch, parts: list[Partition]) -> RigidPunch:
    """``punch`` with a singular edge only where it touches no other of ``parts``."""
    if punch.weights is None:
        return punch
    ribs, own = punch.weights.ribs, punch.partition
    free = free_ribs(own, ribs, parts)
    if len(free) == len(ribs):
        return punch
    with warnings_kept():  # told when it was made
        if len(free) == 0:
            return replace(punch, edge="constant", edge_boundaries=None)
        # a symmetry that was given may be none of what is left of the edge
        symmetry = "auto" if isinstance(punch.symmetry, Symmetry) else punch.symmetry
        return replace(punch, edge_boundaries=np.unique(own.boundary[free]), symmetry=symmetry)


def free_ribs(own: Partition, ribs: ndarray, parts: Sequence[Partition]) -> ndarray:
    """Those of some ribs on the edge of ``own`` that are on the edge of no other of ``parts``."""
    touches = np.zeros(len(ribs), dtype=bool)
    for part in parts:
        if part is not own:
            touches |= on_ribs(own, ribs, part, edge_ribs(part))
    return ribs[~touches]


def bodies_of(joined: Sequence[tuple[int, ...]], n: int) -> tuple[tuple[int, ...], ...]:
    """Numbers of the n punches of each body, in the order of their first ones."""
    alone = set(range(n)).difference(*joined)
    return tuple(sorted([*joined, *((i,) for i in alone)]))
