"""Stresses and displacements below cells by what stratified ground has beyond the homogeneous.

It is smooth over a length: cells far away, measured with it, act as clouds of points, others are
cut until their parts are far away. Where moduli vary from the surface on it is not smooth next to
that, and sees how the law of the edge falls inside triangles: those of near cells are in strips.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..grids.partition import Partition
from ..ground.depths import BITS, DEGREE, FIRST_PANEL, DepthTables
from ..ground.hankel import panel_at
from ..ground.stratified import Stratified
from ..kernels.compiled import compiled, inputs
from ..kernels.threads import Threads
from .clouds import DEGREES, Clouds
from .edge_weights import EdgeWeights
from .halving import CUTS, ROOM, RULE, RULE_WEIGHTS, next_part, size_of
from .moments import load_moments, reach_of
from .pieces import Pieces
from .strips import CellLoads, area_of, weighted_strips

#: where moduli vary from the surface on, depths less than this part of a cell count as this
SHALLOW = 1e-5
#: depths whose tables are made at a time
DEPTHS = 64


class _Clouds(NamedTuple):
    """Cells and their pressures, as the kernel takes them."""

    clouds: Clouds
    pieces: Pieces
    pressure: ndarray
    slopes: ndarray
    rule: ndarray
    rule_weights: ndarray


def deep_remainder(ground: Stratified, loads: Sequence[CellLoads], x: ndarray) -> ndarray:
    """Six stresses and three displacements at points of shape (3, m), shape (9, m)."""
    smooth = ground.strata.layers[0].uniform
    clouds = [_clouds(load, None if smooth else x[:2]) for load in loads]
    plans = np.hstack([load.partition.polygons.p for load in loads])
    beyond = 2 * max(c.clouds.radii.max() for c in clouds)
    cell = np.sqrt(min(load.partition.areas.min() for load in loads))
    rows, number = np.unique(_table_depths(ground, cell, x[2]), return_inverse=True)
    order = np.argsort(number, kind="stable")
    out = np.zeros((9, x.shape[1]))
    for first in range(0, len(rows), DEPTHS):
        begin, end = np.searchsorted(number[order], [first, first + DEPTHS])
        some = order[begin:end]
        at = x[:2, some]
        farthest = float(np.hypot(*np.ptp(np.hstack([plans, at]), axis=1)) + beyond)
        tables = DepthTables.from_ground(ground, rows[first : first + DEPTHS], farthest)
        for own in clouds:
            out[:, some] += _below(own, tables, at, number[some] - first)
    return out


def _below(loads: _Clouds, tables: DepthTables, x: ndarray, which: ndarray) -> ndarray:
    """At points of shape (2, m), each with the number of its depth."""
    out = np.zeros((9, x.shape[1]))
    (coefficients,) = inputs(tables.coefficients)

    def work(piece: slice) -> None:
        at, own = inputs(x[:, piece], which[piece])
        part = np.zeros((9, len(own)))
        _add(at, own, loads, coefficients, tables.d, part)
        out[:, piece] = part

    with Threads() as run:
        run(work, len(which))
    return out


def _clouds(load: CellLoads, x: ndarray | None) -> _Clouds:
    """With strips in weighted cells that are near some of the points ``x``, if any are given."""
    pieces, centres = Pieces.from_partition(load.partition, load.weights), load.acting
    radius = reach_of(pieces, centres)
    moments = load.moments(load_moments(pieces, centres, max(DEGREES) + 1))
    clouds = Clouds.from_moments(
        centres, radius, moments, {degree: k * radius for degree, k in DEGREES.items()}
    )
    if x is not None and load.weights is not None:
        distance, _ = cKDTree(x.T).query(centres.T)
        (near,) = np.nonzero(load.weighted & (distance <= 1.001 * min(DEGREES.values()) * radius))
        if len(near):
            pieces = pieces.with_triangles(*_strips(load.partition, load.weights, near))
    return _Clouds(clouds, pieces, *inputs(load.pressure, load.slopes_or_zero, RULE, RULE_WEIGHTS))


def _strips(
    partition: Partition, weights: EdgeWeights, cells: ndarray
) -> tuple[ndarray, ndarray, ndarray]:
    """Triangles (2, 3, k) that the strips of some cells make, their densities and cells."""
    unit = CellLoads(partition, np.ones(len(partition)), weights)
    x, density, cell = weighted_strips(unit, weights, cells)
    x = np.concatenate([x[:, [0, 1, 2]], x[:, [0, 2, 3]]], axis=2)
    area = area_of(x)
    own = np.nonzero(area)[0]  # strips that end in an apex make one only
    x = np.where(area > 0, x, x[:, ::-1])
    return x[..., own], np.tile(density, 2)[own], np.tile(cell, 2)[own]


def _table_depths(ground: Stratified, cell: float, z: ndarray) -> ndarray:
    """Depths at which tables are made: interfaces as these are, none next to a varying surface."""
    strata = ground.strata
    z = strata.on_interfaces(z)
    if strata.layers[0].uniform:
        return z
    shallow = SHALLOW * min(cell, ground.lengths[0])
    return np.maximum(z, shallow)


@compiled
def _add(x, which, loads, coefficients, d, out):
    """Add the remainder at points with tables of some numbers."""
    clouds, pieces, pressure, slopes, rule, rule_weights = loads
    centres, radii, least, px, py, starts, weights = clouds
    vertices, offsets, density, first, last = pieces
    sums, stack = np.empty(9), np.empty(ROOM)
    square = d * d
    for i in range(x.shape[1]):
        table = coefficients[which[i]]
        sums[:] = 0.0
        for j in range(pressure.shape[0]):
            gx, gy = slopes[0, j], slopes[1, j]
            if pressure[j] == 0.0 and gx == 0.0 and gy == 0.0:
                continue
            dx, dy = x[0, i] - centres[0, j], x[1, i] - centres[1, j]
            r2, cloud = dx * dx + dy * dy + square, 0
            while cloud < least.shape[0] and r2 > least[cloud, j]:
                cloud += 1
            if cloud > 0:
                for k in range(starts[cloud - 1], starts[cloud]):
                    _add_force(
                        dx - radii[j] * px[k], dy - radii[j] * py[k],
                        weights[j, k], table, square, sums,
                    )  # fmt: skip
                continue
            plane = pressure[j] - gx * centres[0, j] - gy * centres[1, j], gx, gy
            for piece in range(first[j], last[j]):
                a = offsets[piece]
                for b in range(a + 1, offsets[piece + 1] - 1):
                    stack[0, 0], stack[0, 1] = vertices[0, a], vertices[1, a]
                    stack[0, 2], stack[0, 3] = vertices[0, b], vertices[1, b]
                    stack[0, 4], stack[0, 5] = vertices[0, b + 1], vertices[1, b + 1]
                    _add_triangle(
                        x[0, i], x[1, i], density[piece], plane, stack,
                        rule, rule_weights, table, square, sums,
                    )  # fmt: skip
        for q in range(9):
            out[q, i] += sums[q]


@compiled
def _add_triangle(x, y, density, plane, stack, rule, rule_weights, table, square, sums):
    """Add a triangle under a plane times a density, the first of the stack, cut where near."""
    height, smallest = 1, size_of(stack[0]) * 0.25**CUTS
    while height > 0:
        height = next_part(x, y, stack, height, square, smallest)
        ax, ay, bx, by, cx, cy = stack[height]
        ux, uy, vx, vy = bx - ax, by - ay, cx - ax, cy - ay
        load = density * (ux * vy - uy * vx) / 2
        for g in range(rule_weights.shape[0]):
            px = rule[0, g] * ax + rule[1, g] * bx + rule[2, g] * cx
            py = rule[0, g] * ay + rule[1, g] * by + rule[2, g] * cy
            force = load * rule_weights[g] * (plane[0] + plane[1] * px + plane[2] * py)
            _add_force(x - px, y - py, force, table, square, sums)


@compiled
def _add_force(x, y, force, table, square, sums):
    """Add the remainder of a force seen at (x, y) from it."""
    panel, t, _ = panel_at(FIRST_PANEL, 1.0 + (x * x + y * y) / square, BITS)
    polynomial = table[panel]
    sz, total, difference = polynomial[DEGREE, 0], polynomial[DEGREE, 1], polynomial[DEGREE, 2]
    shear, down, outward = polynomial[DEGREE, 3], polynomial[DEGREE, 4], polynomial[DEGREE, 5]
    for power in range(DEGREE - 1, -1, -1):
        sz = sz * t + polynomial[power, 0]
        total = total * t + polynomial[power, 1]
        difference = difference * t + polynomial[power, 2]
        shear = shear * t + polynomial[power, 3]
        down = down * t + polynomial[power, 4]
        outward = outward * t + polynomial[power, 5]
    sums[0] += force * (total + difference * (x * x - y * y)) / 2
    sums[1] += force * (total - difference * (x * x - y * y)) / 2
    sums[2] += force * sz
    sums[3] += force * difference * x * y
    sums[4] += force * shear * y
    sums[5] += force * shear * x
    sums[6] += force * outward * x
    sums[7] += force * outward * y
    sums[8] += force * down
