"""The punches that rigid bodies consist of."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np
from numpy import ndarray

from .footprint import Footprint
from .loaded_cells import LoadedCells, Operator, slices_of
from .system import ContactSystem


class Part(NamedTuple):
    """Cells of one punch of a body.

    Attributes
    ----------
    footprint : Footprint
        The cells.
    body : int
        Number of the body.
    centre : (2,) array of float
        Point of the body to which its position refers.
    """

    footprint: Footprint
    body: int
    centre: ndarray


def by_bodies(parts: Sequence[Part], values: Sequence[ndarray]) -> ndarray:
    """Motions or moments about the centroids of punches, (3, n_i) each, as those of their bodies
    about the centres of these, (3 m, n)."""
    own = slices_of([part.footprint for part in parts])
    out = np.zeros((3 * (1 + max(part.body for part in parts)), own[-1].stop))
    for (cells, body, centre), columns, value in zip(parts, own, values, strict=True):
        target = out[3 * body : 3 * body + 3, columns]
        target[:] = value
        target[1:] += (cells.centre - centre)[:, None] * value[0]
    return out


def flattened_resultants(parts: Sequence[Part], flat: ndarray) -> ndarray:
    """Forces and moments of unit pressures where some cells are flat, (n,) array of bool."""
    own = slices_of([part.footprint for part in parts])
    cells = (part.footprint.flattened(flat[some]) for part, some in zip(parts, own, strict=True))
    return by_bodies(parts, [some.resultants for some in cells])


def flattened_system(
    system: ContactSystem, parts: Sequence[Part], cells: LoadedCells, flat: ndarray
) -> ContactSystem:
    """The equations of all ``cells`` where some are flat."""
    matrix = cells.flattened_operator(cast(Operator, system.matrix), flat)
    acting = flattened_resultants(parts, flat)
    return replace(system, matrix=matrix, resultants=acting, nearby=system.approximate)
