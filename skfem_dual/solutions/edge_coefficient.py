"""How strong the singularity of the pressure is along the edge of a plan."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..elements.edge_weights import EdgeWeights
from ..grids.partition import Partition
from ..grids.planar import contours
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly


@dataclass(frozen=True, eq=False)
class EdgeCoefficient(ReadOnly):
    """Limit of ``p sqrt(d)`` at the edge, d the distance to it, along the contours of a plan.

    Attributes
    ----------
    x : (2, k) array of float
        Points on the edge, one for each cell there, in order along each contour, the plan to
        the left.
    values : (k,) array of float
        The coefficient there, pressure times the square root of a length.
    contour : (k,) array of int
        Number of the contour, ascending.
    arc : (k,) array of float
        Length of the contour up to there.
    """

    x: ndarray
    values: ndarray
    contour: ndarray
    arc: ndarray


def coefficient_of(
    partition: Partition, weights: EdgeWeights, pressure: ndarray, slopes: ndarray
) -> EdgeCoefficient:
    """Of mean pressures (n,) and slopes (2, n) of edge-weighted cells."""
    cells = partition.f2c[0, weights.ribs]
    contour, order = contours(partition.facets[:, weights.ribs], cells)
    ribs, cells = weights.ribs[order], cells[order]
    a, b = partition.ends(ribs)
    end = np.cumsum(np.hypot(*(b - a)))
    begin = np.append(0, end[:-1])
    # a cell may own several ribs in a row: one value halfway along them
    first = np.nonzero((np.diff(cells, prepend=-1) != 0) | (np.diff(contour, prepend=-1) != 0))
    last = np.append(first[0][1:], len(ribs)) - 1
    halfway = (begin[first] + end[last]) / 2
    rib = np.searchsorted(end, halfway)
    s = (halfway - begin[rib]) / (end[rib] - begin[rib])
    contour, cells = contour[first], cells[first]
    starts = begin[first][np.searchsorted(contour, contour)]
    x = a[:, rib] + s * (b - a)[:, rib]
    rise = slopes[:, cells] * (x - weights.centroids[:, cells])
    inside = pressure[cells] + rise.sum(axis=0)
    return EdgeCoefficient(
        x=readonly(x),
        values=readonly(inside / weights.mean[cells]),
        contour=readonly(contour),
        arc=readonly(halfway - starts),
    )
