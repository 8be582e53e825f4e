"""Dense matrix of settlements with far cells by their moments.

The series of 1 / r about the centroid of each cell, in Cartesian moments (Jackson, Classical
Electrodynamics, chapter 4).
"""

from functools import partial

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..elements.edge_weights import EdgeWeights
from ..elements.moments import Multipoles, far_influence, series_terms
from ..elements.near import NearField
from ..elements.remainder import add_rows, remainder_blocks
from ..grids.partition import Partition
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from ..kernels.threads import Threads

#: cells nearer than so many of their radii are exact if the error is to be 1e-6; it falls like
#: the fifth power
EXACT_RADII = 3.7
#: and never farther than so many: behind the ends of long cells the series does not converge
LEAST_RADII = 1.5
#: cells that are looked at together
CLUSTER = 16
#: points that are looked at together
BLOCK = 32


def moment_matrix(
    substrate: Substrate,
    partition: Partition,
    x: ndarray,
    weights: EdgeWeights | None,
    rtol: float,
) -> ndarray:
    """Settlements at points under unit mean pressure on each cell.

    As `influence_matrix`, with the dipoles of edge-weighted cells, and up to an error of about
    ``rtol`` of the settlements under pressures of one sign.

    Returns
    -------
    (m, ncells) array of float
        Settlement per unit pressure, positive into the ground.
    """
    loads = Multipoles.about_centroids(partition, weights, 4)
    m = substrate.singular_coefficient * loads.moments
    sources = inputs(loads.centres, m[0, 0], series_terms(m))
    near = max(EXACT_RADII * (1e-6 / rtol) ** 0.2, LEAST_RADII) * partition.polygons.radii
    limits = inputs(loads.centres, near, *_clusters(loads.centres, near))
    direct = NearField.from_partition(substrate, partition, weights, np.arange(len(partition)))
    matrix = np.empty((x.shape[1], len(partition)))
    numbers = cKDTree(x.T, leafsize=BLOCK).indices  # those of a block lie together

    def work(rows: slice) -> None:
        own, points = inputs(numbers[rows], x[:, numbers[rows]])
        _from_moments(points, *sources, own, matrix)
        begin = np.arange(0, len(own), BLOCK)
        blocks = np.stack([begin, np.minimum(begin + BLOCK, len(own))])
        lists = _near_cells(points, blocks, *limits)
        values = np.empty(np.diff(lists[0]) @ np.diff(blocks, axis=0)[0])
        direct.fill(points, blocks, lists, values)
        _put(blocks, *lists, values, own, matrix)

    with Threads() as run:
        run(work, x.shape[1])
        for cells, add in remainder_blocks(substrate, partition, weights, x):
            run(partial(add_rows, add, matrix[:, cells]), x.shape[1])
    return matrix


def _clusters(centres: ndarray, near: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    """Cells in an order in which `CLUSTER` of them lie together, and circles around them.

    No point outside of a circle is near to a cell of its cluster.
    """
    order = cKDTree(centres.T, leafsize=CLUSTER).indices
    starts = np.arange(0, len(order), CLUSTER)
    low, high = (f.reduceat(centres[:, order], starts, axis=1) for f in (np.minimum, np.maximum))
    middle = (low + high) / 2
    own = np.repeat(np.arange(len(starts)), CLUSTER)[: len(order)]
    reach = np.hypot(*(centres[:, order] - middle[:, own])) + near[order]
    return order, middle, np.maximum.reduceat(reach, starts)


@vectorised
def _from_moments(x, centres, forces, terms, rows, matrix):
    """Fields of moments up to the fourth degree, also where they are too near.

    Of two points at a time: what is known of the cells is read half as often.
    """
    m = x.shape[1]
    for i in range(0, m, 2):
        k = min(i + 1, m - 1)
        one, other, x1, y1, x2, y2 = rows[i], rows[k], x[0, i], x[1, i], x[0, k], x[1, k]
        for j in range(forces.shape[0]):
            matrix[one, j] = _field(x1, y1, centres, forces, terms, j)
            matrix[other, j] = _field(x2, y2, centres, forces, terms, j)


@inlined
def _field(x, y, centres, forces, terms, j):
    dx, dy = x - centres[0, j], y - centres[1, j]
    return forces[j] / np.sqrt(dx * dx + dy * dy) + far_influence(dx, dy, 0.0, terms, j)


@compiled
def _near_cells(x, blocks, centres, near, order, middle, reach):
    """Starts and cells of lists of cells nearer than ``near`` to a circle around each block."""
    n = centres.shape[1]
    starts, cells = np.zeros(blocks.shape[1] + 1, np.int64), np.empty(64, np.int32)
    count = 0
    for block in range(blocks.shape[1]):
        if count + n > cells.shape[0]:
            larger = np.empty(2 * count + n, np.int32)
            larger[:count] = cells[:count]
            cells = larger
        begin, end = blocks[0, block], blocks[1, block]
        x0, y0 = np.mean(x[0, begin:end]), np.mean(x[1, begin:end])
        radius = 0.0
        for i in range(begin, end):
            radius = max(radius, np.hypot(x[0, i] - x0, x[1, i] - y0))
        for cluster in range(reach.shape[0]):
            away = np.hypot(x0 - middle[0, cluster], y0 - middle[1, cluster])
            if away > reach[cluster] + radius:
                continue
            for k in range(cluster * CLUSTER, min(cluster * CLUSTER + CLUSTER, n)):
                j = order[k]
                if np.hypot(x0 - centres[0, j], y0 - centres[1, j]) <= near[j] + radius:
                    cells[count] = j
                    count += 1
        starts[block + 1] = count
    return starts, cells[:count]


@compiled
def _put(blocks, starts, cells, values, rows, matrix):
    """Put the entries of blocks into the matrix."""
    at = 0
    for block in range(blocks.shape[1]):
        for i in range(blocks[0, block], blocks[1, block]):
            for k in range(starts[block], starts[block + 1]):
                matrix[rows[i], cells[k]] = values[at]
                at += 1
