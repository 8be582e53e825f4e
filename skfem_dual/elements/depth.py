"""Six stresses and three displacements below cells, in any ground.

Uniform cells on the homogeneous half-space with the moduli of the surface are exact: neighbouring
cells share ribs, so every rib counts once, with the jump of the pressure across it. To them are
added what the pressure varies inside the cells, by strips near by and clouds of points from afar,
and what the ground has beyond that half-space, see `deep_remainder`. Of many cells those far away
act together, see `clusters`.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import LARGEST, SMALLEST, checked_array
from ..grids.partition import Partition
from ..ground.strata import Strata
from ..ground.stratified import Stratified
from ..ground.substrates import HalfSpace, Substrate
from ..kernels.compiled import compiled, inputs, vectorised
from ..kernels.threads import Threads
from ..messages import shown
from .boussinesq import (
    force_displacements,
    force_stresses,
    rib_displacements,
    rib_stresses,
)
from .clouds import Clouds
from .clusters import Clusters
from .deep_remainder import deep_remainder
from .moments import load_moments, reach_of
from .pieces import Pieces
from .strips import CellLoads, Strips


def components(
    substrate: Substrate,
    loads: Sequence[CellLoads],
    x: ArrayLike,
    kinds: tuple[bool, bool] = (True, True),
) -> ndarray:
    """Six stresses and three displacements, shape (9, m), under all loads; see `stresses`.

    ``kinds`` tells whether stresses and displacements are wanted; what is not is of no use.
    """
    x = checked_depths(substrate, x)
    for load in loads:
        checked_array("pressure", load.pressure, (len(load.partition),), each="cell")
    out = sum((_homogeneous(substrate.surface, load, x, kinds) for load in loads), np.zeros(()))
    if isinstance(substrate, Stratified):
        out = out + deep_remainder(substrate, loads, x)
    return out


def _homogeneous(
    surface: HalfSpace, load: CellLoads, x: ndarray, kinds: tuple[bool, bool]
) -> ndarray:
    """On the half-space with the moduli of the surface."""
    nu, clusters = surface.poisson, Clusters.from_loads(load)
    ribs = _LoadedRibs.from_pressure(load.partition, load.pressure, clusters)
    out = np.zeros((9, x.shape[1]))
    varying = _Varying.from_loads(load, x, clusters)

    def work(rows: slice) -> None:
        at, part = np.ascontiguousarray(x[:, rows]), np.zeros((9, rows.stop - rows.start))
        _add_loads(*inputs(at), clusters, ribs, varying, nu, kinds, part)
        out[:, rows] = part

    with Threads() as run:
        run(work, x.shape[1])
    out[:6] /= 2 * np.pi
    out[6:] *= (1 + nu) / (2 * np.pi * surface.young)
    return out


def strata_of(substrate: Substrate) -> Strata:
    """Strata of a ground, or a TypeError if it has none."""
    if isinstance(substrate, type) or not isinstance(substrate, (HalfSpace, Stratified)):
        raise TypeError(
            f"expected a HalfSpace, GradedHalfSpace or LayeredHalfSpace, got {shown(substrate)}: "
            "of other grounds only the surface is known"
        )
    return substrate.strata


def checked_depths(substrate: Substrate, x: ArrayLike) -> ndarray:
    """Points in the ground, shape (3, m).

    Raises
    ------
    TypeError, ValueError
        As in `stress_below`.
    """
    strata = strata_of(substrate)
    x = checked_array("x", x, (3, "m"), each="point")
    if (bad := np.nonzero(~(x[2] > 0))[0]).size:
        raise ValueError(
            "expected points in the ground, with finite depths z > 0; the first that is not: "
            f"{bad[0]}, with z={x[2, bad[0]]:g}"
        )
    sizes = np.abs(x).max(axis=0, initial=0.0)
    if (bad := np.nonzero((sizes > LARGEST) | (x[2] < SMALLEST))[0]).size:
        raise ValueError(
            f"expected coordinates up to {LARGEST:g} and depths from {SMALLEST:g} on; the first "
            f"point beyond: {bad[0]}"
        )
    bottom = strata.interfaces[-1]
    if (bad := np.nonzero(x[2] > bottom * (1 + 1e-12))[0]).size:
        raise ValueError(
            f"expected points above the rigid base at depth {bottom:g}; the first that is not: "
            f"{bad[0]}, with z={x[2, bad[0]]:g}"
        )
    return x


class _LoadedRibs(NamedTuple):
    """Ribs across which the pressure jumps.

    Attributes
    ----------
    begin : (2, k) array of float
        Where they begin.
    along : (2, k) array of float
        Their directions, of unit length.
    length : (k,) array of float
    jump : (k,) array of float
        Pressure on the left less that on the right.
    starts : (nclusters + 1,) array of int
        Where those of each cluster without parts begin; others have none.
    """

    begin: ndarray
    along: ndarray
    length: ndarray
    jump: ndarray
    starts: ndarray

    @classmethod
    def from_pressure(cls, partition: Partition, pressure: ndarray, clusters: Clusters) -> Self:
        """Of a partition under one pressure per cell; ribs between clusters once in each."""
        left, right = np.append(pressure, 0.0)[partition.f2c]
        own, other = np.append(clusters.of, -1)[partition.f2c]
        a, b = partition.polygons.p[:, partition.facets].swapaxes(0, 1)
        length = np.hypot(*(b - a))
        rib = np.tile(np.arange(len(length)), 2)
        same = own == other
        jump = np.concatenate([left - np.where(same, right, 0), -np.where(same, 0, right)])
        cluster = np.concatenate([own, other])
        order = np.argsort(cluster, kind="stable")
        order = order[(jump[order] != 0) & (length[rib[order]] > 0)]
        rib = rib[order]
        starts = np.searchsorted(cluster[order], np.arange(len(clusters.after) + 1))
        along = (b - a)[:, rib] / length[rib]
        return cls(*inputs(a[:, rib], along, length[rib], jump[order], starts))


#: cells act from afar from so many of their radii on, strips nearer by; degrees of clouds and the
#: radii from which on they serve
IN_STRIPS = 3.0
CLOUDS = {6: IN_STRIPS, 4: 6.0, 2: 20.0}


class _Varying(NamedTuple):
    """What the pressure of cells is beyond its mean.

    Attributes
    ----------
    clouds : Clouds
        Of the cells in which it varies.
    strips : Strips
        Of those near some point.
    number : (k,) array of int
        Of each cell in these, -1 for none.
    starts : (nclusters + 1,) array of int
        Where the cells of each cluster without parts begin; others have none.
    """

    clouds: Clouds
    strips: Strips
    number: ndarray
    starts: ndarray

    @classmethod
    def from_loads(cls, loads: CellLoads, x: ndarray, clusters: Clusters) -> Self:
        """Of the cells that are weighted and loaded, or sloped; of none if there are none."""
        varies = (loads.weighted & (loads.pressure != 0)) | loads.slopes_or_zero.any(axis=0)
        cells = np.nonzero(varies)[0]
        cells = cells[np.argsort(clusters.of[cells], kind="stable")]
        starts = np.searchsorted(clusters.of[cells], np.arange(len(clusters.after) + 1))
        centres, radius, moments = _variation(loads, cells, max(CLOUDS))
        least = {d: k * radius for d, k in CLOUDS.items()}
        clouds = Clouds.from_moments(centres, radius, moments, least)
        # points as near to a cell as strips need
        distance, _ = cKDTree(x.T).query(np.vstack([centres, 0 * radius]).T)
        # more than those by rounding, as these would carry nothing
        near = np.nonzero(distance <= 1.001 * IN_STRIPS * radius)[0]
        near = near[np.argsort(cells[near])]
        number = np.full(len(cells), -1)
        number[near] = np.arange(len(near))
        return cls(clouds, Strips.from_loads(loads, cells[near]), *inputs(number, starts))


def _variation(loads: CellLoads, cells: ndarray, degree: int) -> tuple[ndarray, ndarray, ndarray]:
    """Where the loads of some cells act, how far these reach, and moments of what the loads are
    beyond their means."""
    centres = loads.acting[:, cells]
    if not len(cells):
        return centres, np.empty(0), np.empty((degree + 1, degree + 1, 0))
    varying, uniform = (
        Pieces.from_partition(loads.partition, w).of(cells) for w in (loads.weights, None)
    )
    radius = np.maximum(reach_of(varying, centres), reach_of(uniform, centres))
    moments = loads.moments(load_moments(varying, centres, degree + 1), cells)
    return (
        centres,
        radius,
        moments - loads.pressure[cells] * load_moments(uniform, centres, degree),
    )


@compiled
def _add_loads(x, clusters, ribs, varying, nu, kinds, out):
    """Add 2 pi times the stresses and 4 pi G times the displacements."""
    stress, displacement = kinds
    for i in range(x.shape[1]):
        at, cluster = (x[0, i], x[1, i], x[2, i]), 0
        while cluster < clusters.after.shape[0]:
            if _add_cloud(at, clusters.clouds, cluster, nu, stress, displacement, out, i):
                cluster = clusters.after[cluster]
                continue
            cluster += 1  # what has no parts is followed by the next
            own = ribs.starts[cluster - 1], ribs.starts[cluster]
            _add_ribs(at, ribs, own, nu, stress, displacement, out, i)
            for j in range(varying.starts[cluster - 1], varying.starts[cluster]):
                if not _add_cloud(at, varying.clouds, j, nu, stress, displacement, out, i):
                    strips, number = varying.strips, varying.number[j]
                    own = strips.starts[number], strips.starts[number + 1]
                    _add_ribs(at, strips, own, nu, stress, displacement, out, i)


@vectorised
def _add_cloud(at, clouds, j, nu, stress, displacement, out, i):
    """Add points that stand for a load, if it is far enough from a point; returns whether."""
    centres, radii, least, px, py, starts, weights = clouds
    dx, dy, z, cloud = at[0] - centres[0, j], at[1] - centres[1, j], at[2], 0
    square = dx * dx + dy * dy + z * z
    while cloud < least.shape[0] and square > least[cloud, j]:
        cloud += 1
    if cloud == 0:
        return False
    if stress:
        sx, sy, sz, xy, yz, zx = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(starts[cloud - 1], starts[cloud]):
            force = weights[j, k]
            a, b = dx - radii[j] * px[k], dy - radii[j] * py[k]
            fx, fy, fz, gx, gy, gz = force_stresses(a, b, z, nu)
            sx, sy, sz = sx + force * fx, sy + force * fy, sz + force * fz
            xy, yz, zx = xy + force * gx, yz + force * gy, zx + force * gz
        _add(out[:6], i, 1.0, (sx, sy, sz, xy, yz, zx))
    if displacement:
        ux, uy, uz = 0.0, 0.0, 0.0
        for k in range(starts[cloud - 1], starts[cloud]):
            force = weights[j, k]
            a, b = dx - radii[j] * px[k], dy - radii[j] * py[k]
            fx, fy, fz = force_displacements(a, b, z, nu)
            ux, uy, uz = ux + force * fx, uy + force * fy, uz + force * fz
        _add(out[6:], i, 1.0, (ux, uy, uz))
    return True


@compiled
def _add_ribs(at, ribs, own, nu, stress, displacement, out, i):
    """Add what some ribs give at a point."""
    for f in range(own[0], own[1]):
        a, b, z = at[0] - ribs.begin[0, f], at[1] - ribs.begin[1, f], at[2]
        tx, ty, length, g = ribs.along[0, f], ribs.along[1, f], ribs.length[f], ribs.jump[f]
        if stress:
            _add(out[:6], i, g, rib_stresses(a, b, z, tx, ty, length, nu))
        if displacement:
            _add(out[6:], i, g, rib_displacements(a, b, z, tx, ty, length, nu))


@compiled
def _add(out, i, factor, values):
    for c in range(len(values)):
        out[c, i] += factor * values[c]
