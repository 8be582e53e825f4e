"""Dense matrix of settlements with far cells by their moments.

The series of 1 / r about the centroid of each cell, in Cartesian moments (Jackson, Classical
Electrodynamics, chapter 4).
"""

from functools import partial

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..elements.edge_weights import EdgeWeights
from ..elements.moments import Multipoles, radii
from ..elements.near import NearField
from ..elements.remainder import add_rows, remainder_blocks
from ..grids.partition import Partition
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from ..kernels.threads import Threads

#: cells nearer than so many of their radii are exact if the error is to be 1e-6; it falls like
#: the fourth power
EXACT_RADII = 5.0
#: third moments count up to where they make so many times the error of a cell's settlement
THIRD = 30.0
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
    loads = Multipoles.about_centroids(partition, weights, 3)
    centres, m = loads.centres, substrate.singular_coefficient * loads.moments
    third = np.stack([m[3, 0], m[2, 1], m[1, 2], m[0, 3]])
    near = EXACT_RADII * (1e-6 / rtol) ** 0.25 * radii(partition.polygons)
    known = (9 * np.abs(third).sum(axis=0) / (THIRD * rtol * m[0, 0])) ** (1 / 3)
    moments = inputs(m[0, 0], m[1, 0], m[0, 1], m[2, 0], m[1, 1], m[0, 2])
    limits = inputs(near, known, third, *_clusters(centres, np.maximum(near, known)))
    direct = NearField.from_partition(substrate, partition, weights, np.arange(len(partition)))
    matrix = np.empty((x.shape[1], len(partition)))
    numbers = cKDTree(x.T, leafsize=BLOCK).indices  # those of a block lie together

    def work(rows: slice) -> None:
        own, points = inputs(numbers[rows], x[:, numbers[rows]])
        _from_moments(points, *centres, *moments, own, matrix)
        begin = np.arange(0, len(own), BLOCK)
        blocks = np.stack([begin, np.minimum(begin + BLOCK, len(own))])
        starts, cells = _near_cells(points, blocks, centres, *limits, own, matrix)
        values = np.empty(np.diff(starts) @ np.diff(blocks, axis=0)[0])
        direct.fill(points, blocks, (starts, cells), values)
        _put(blocks, starts, cells, values, own, matrix)

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
def _from_moments(x, cx, cy, m, m10, m01, m20, m11, m02, rows, matrix):
    """Fields of moments up to the second degree, also where they are too near."""
    for i in range(x.shape[1]):
        x0, y0, row = x[0, i], x[1, i], rows[i]
        for j in range(cx.shape[0]):
            dx, dy = x0 - cx[j], y0 - cy[j]
            f = 1 / np.sqrt(dx * dx + dy * dy)
            ux, uy = f * dx, f * dy
            a = m20[j] * (3 * ux * ux - 1) + m02[j] * (3 * uy * uy - 1) + 3 * m11[j] * ux * uy
            matrix[row, j] = f * (m[j] + f * (m10[j] * ux + m01[j] * uy + f * a))


@compiled
def _near_cells(x, blocks, centres, near, known, third, order, middle, reach, rows, matrix):
    """Starts and cells of lists of cells nearer than ``near`` to a circle around each block.

    Third moments of the others up to the distance ``known`` of a point are added to its row.
    """
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
            if (
                np.hypot(x0 - middle[0, cluster], y0 - middle[1, cluster])
                > reach[cluster] + radius
            ):
                continue
            for k in range(cluster * CLUSTER, min(cluster * CLUSTER + CLUSTER, n)):
                j = order[k]
                distance = np.hypot(x0 - centres[0, j], y0 - centres[1, j]) - radius
                if distance <= near[j]:
                    cells[count] = j
                    count += 1
                elif distance <= known[j]:
                    for i in range(begin, end):
                        dx, dy = x[0, i] - centres[0, j], x[1, i] - centres[1, j]
                        matrix[rows[i], j] += _cubic(dx, dy, known[j], third[:, j])
        starts[block + 1] = count
    return starts, cells[:count]


@inlined
def _cubic(dx, dy, known, third):
    """Field of the third moments of a cell, up to the distance ``known``."""
    r2 = dx * dx + dy * dy
    if r2 > known * known:
        return 0.0
    xx, yy = 15 * dx * dx / r2, 15 * dy * dy / r2
    cubic = dx * (third[0] * (xx - 9) + third[2] * (yy - 3))
    cubic += dy * (third[1] * (xx - 3) + third[3] * (yy - 9))
    return cubic / (r2 * r2 * np.sqrt(r2))


@compiled
def _put(blocks, starts, cells, values, rows, matrix):
    """Put the entries of blocks into the matrix."""
    at = 0
    for block in range(blocks.shape[1]):
        for i in range(blocks[0, block], blocks[1, block]):
            for k in range(starts[block], starts[block + 1]):
                matrix[rows[i], cells[k]] = values[at]
                at += 1
