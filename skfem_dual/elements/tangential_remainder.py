"""Displacements of the surface by what stratified ground has beyond the homogeneous.

The same roads as in `deep_remainder`: cells far away, measured with the length over which the
kernels are smooth, act as clouds of points, others are cut until their parts are far away.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..ground.depths import smoothness
from ..ground.hankel import BITS, SQUARES, panel_at
from ..ground.stratified import Stratified
from ..kernels.compiled import compiled, inputs
from ..kernels.threads import Threads
from .clouds import DEGREES, Clouds
from .edge_weights import EdgeWeights, load_centroids
from .halving import CUTS, ROOM, RULE, RULE_WEIGHTS, next_part, size_of
from .moments import load_moments, reach_of
from .pieces import Pieces
from .strips import CellLoads

#: integrals over cells: of A, B cos 2t, B sin 2t, C cos t and C sin t as in `ShearTable`, t from
#: source to field point, and of the settlement under vertical forces
KINDS = 6


class ShearedCells(NamedTuple):
    """Cells under unit mean tractions and unit slopes, as the kernel takes them.

    Attributes
    ----------
    clouds : Clouds
        Of the mean tractions.
    weights : (ndensities, n, npoints) array of float
        Those of the clouds, under mean tractions, slopes along x and along y.
    pieces : Pieces
    rule : (3, k) array of float
        Barycentric coordinates of points in a triangle.
    rule_weights : (k,) array of float
    """

    clouds: Clouds
    weights: ndarray
    pieces: Pieces
    rule: ndarray
    rule_weights: ndarray

    @classmethod
    def from_cells(cls, partition: Partition, law: EdgeWeights | None, sloped: bool) -> Self:
        """Of cells with this law inside them."""
        pieces, n = Pieces.from_partition(partition, law), len(partition)
        centres = load_centroids(partition, law)
        radius = reach_of(pieces, centres)
        of_law = load_moments(pieces, centres, max(DEGREES) + 1)
        least = {degree: k * radius for degree, k in DEGREES.items()}
        clouds = []
        for unit in np.eye(3)[: 3 if sloped else 1]:
            load = CellLoads(partition, np.full(n, unit[0]), law, np.tile(unit[1:, None], (1, n)))
            clouds.append(Clouds.from_moments(centres, radius, load.moments(of_law), least))
        (weights,) = inputs(np.stack([c.weights for c in clouds]))
        rule, rule_weights = inputs(RULE, RULE_WEIGHTS)
        return cls(clouds[0], weights, pieces, rule, rule_weights)


def tangential_remainder(ground: Stratified, cells: ShearedCells, x: ndarray) -> ndarray:
    """Integrals over cells at points of shape (2, m), shape (ndensities, KINDS, m, n).

    Raises
    ------
    ValueError
        If the plan and the points reach farther than the table.
    """
    table = ground.shear
    plan = np.ptp(np.hstack([cells.pieces.vertices, x]), axis=1)
    ground.remainder.evaluate(ground.remainder.omega, np.hypot(*plan))
    smooth = float(smoothness(ground.strata, np.zeros(1))[0]) ** 2
    out = np.zeros((len(cells.weights), KINDS, x.shape[1], len(cells.clouds.radii)))

    def work(rows: slice) -> None:
        _add(*inputs(x[:, rows]), cells, table, smooth, table.nearest**2, out[:, :, rows])

    with Threads() as run:
        run(work, x.shape[1])
    return out


@compiled
def _add(x, cells, table, smooth, smallest, out):
    """Add the integrals; kernels are smooth over a length with the square ``smooth``."""
    clouds, weights, pieces, rule, rule_weights = cells
    centres, radii, least, px, py, starts, _ = clouds
    vertices, offsets, density, first, last = pieces
    kernels, stack = np.empty(4), np.empty(ROOM)
    force, sums = np.empty(weights.shape[0]), np.empty((weights.shape[0], KINDS))
    for i in range(x.shape[1]):
        for j in range(len(radii)):
            sums[:] = 0.0
            dx, dy = x[0, i] - centres[0, j], x[1, i] - centres[1, j]
            r2, cloud = dx * dx + dy * dy + smooth, 0
            while cloud < least.shape[0] and r2 > least[cloud, j]:
                cloud += 1
            if cloud > 0:
                for k in range(starts[cloud - 1], starts[cloud]):
                    for d in range(len(force)):
                        force[d] = weights[d, j, k]
                    a, b = dx - radii[j] * px[k], dy - radii[j] * py[k]
                    _add_force(a, b, force, table, smallest, kernels, sums)
            else:
                for piece in range(first[j], last[j]):
                    a = offsets[piece]
                    for b in range(a + 1, offsets[piece + 1] - 1):
                        for c, at in enumerate((a, b, b + 1)):
                            stack[0, 2 * c] = vertices[0, at] - centres[0, j]
                            stack[0, 2 * c + 1] = vertices[1, at] - centres[1, j]
                        _add_triangle(
                            dx, dy, density[piece], stack, rule, rule_weights,
                            table, smooth, smallest, force, kernels, sums,
                        )  # fmt: skip
            for d in range(len(force)):
                for c in range(KINDS):
                    out[d, c, i, j] += sums[d, c]


@compiled
def _add_triangle(
    x, y, density, stack, rule, rule_weights, table, smooth, smallest, force, kernels, sums
):
    """Add the first triangle of the stack, seen from the same point as (x, y), cut where near."""
    height, least = 1, size_of(stack[0]) * 0.25**CUTS
    while height > 0:
        height = next_part(x, y, stack, height, smooth, least)
        ax, ay, bx, by, cx, cy = stack[height]
        load = density * ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
        for g in range(len(rule_weights)):
            px = rule[0, g] * ax + rule[1, g] * bx + rule[2, g] * cx
            py = rule[0, g] * ay + rule[1, g] * by + rule[2, g] * cy
            force[0] = load * rule_weights[g]
            if len(force) > 1:
                force[1], force[2] = force[0] * px, force[0] * py
            _add_force(x - px, y - py, force, table, smallest, kernels, sums)


@compiled
def _add_force(x, y, force, table, smallest, kernels, sums):
    """Add forces seen at (x, y) from them."""
    coefficients, first = table.coefficients, table.first
    u = max(x * x + y * y, smallest)
    panel, t, _ = panel_at(first, u, BITS)
    polynomial = coefficients[panel]
    for q in range(4):
        kernels[q] = polynomial[SQUARES, q]
        for power in range(SQUARES - 1, -1, -1):
            kernels[q] = kernels[q] * t + polynomial[power, q]
    even, odd, coupling, down = kernels[0], kernels[1] / u, kernels[2] / np.sqrt(u), kernels[3]
    for d in range(len(force)):
        f = force[d]
        sums[d, 0] += f * even
        sums[d, 1] += f * odd * (x * x - y * y)
        sums[d, 2] += f * odd * 2 * x * y
        sums[d, 3] += f * coupling * x
        sums[d, 4] += f * coupling * y
        sums[d, 5] += f * down
