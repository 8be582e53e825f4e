"""Six stresses and three displacements below cells, in any ground.

Uniform cells on the homogeneous half-space with the moduli of the surface are exact: neighbouring
cells share ribs, so every rib counts once, with the jump of the pressure across it. To them are
added what the pressure varies inside the cells, by strips near by and clouds of points from afar,
and what the ground has beyond that half-space, see `deep_remainder`.
"""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import checked_array
from ..grids.partition import Partition
from ..ground.strata import Strata
from ..ground.stratified import Stratified
from ..ground.substrates import HalfSpace, Substrate
from ..kernels.compiled import compiled, inputs
from ..kernels.threads import Threads
from ..messages import shown
from .boussinesq import (
    force_displacements,
    force_stresses,
    rib_displacements,
    rib_stresses,
)
from .clouds import Clouds
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
    ribs, nu = _LoadedRibs.from_pressure(load.partition, load.pressure), surface.poisson
    stress, displacement = kinds
    out = np.zeros((9, x.shape[1]))
    varying = _Varying.from_loads(load, x)

    def work(rows: slice) -> None:
        at, part = np.ascontiguousarray(x[:, rows]), np.zeros((9, rows.stop - rows.start))
        if stress:
            _stresses(*inputs(at), ribs, nu, part)
        if displacement:
            _displacements(*inputs(at), ribs, nu, part[6:])
        if varying is not None:
            _add_varying(*inputs(at), varying, nu, stress, displacement, part)
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
    """

    begin: ndarray
    along: ndarray
    length: ndarray
    jump: ndarray

    @classmethod
    def from_pressure(cls, partition: Partition, pressure: ndarray) -> Self:
        """Of a partition under one pressure per cell."""
        left, right = np.append(pressure, 0.0)[partition.f2c]
        a, b = partition.polygons.p[:, partition.facets].swapaxes(0, 1)
        length = np.hypot(*(b - a))
        loaded = (left != right) & (length > 0)
        along = (b - a)[:, loaded] / length[loaded]
        return cls(*inputs(a[:, loaded], along, length[loaded], (left - right)[loaded]))


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
    """

    clouds: Clouds
    strips: Strips
    number: ndarray

    @classmethod
    def from_loads(cls, loads: CellLoads, x: ndarray) -> Self | None:
        """Of the cells that are weighted and loaded, or sloped; None without any."""
        varies = (loads.weighted & (loads.pressure != 0)) | loads.slope.any(axis=0)
        cells = np.nonzero(varies)[0]
        if not len(cells):
            return None
        varying, uniform = (
            Pieces.from_partition(loads.partition, w).of(cells) for w in (loads.weights, None)
        )
        centres = loads.acting[:, cells]
        radius = np.maximum(reach_of(varying, centres), reach_of(uniform, centres))
        degree = max(CLOUDS)
        moments = loads.moments(load_moments(varying, centres, degree + 1), cells)
        moments -= loads.pressure[cells] * load_moments(uniform, centres, degree)
        least = {d: k * radius for d, k in CLOUDS.items()}
        clouds = Clouds.from_moments(centres, radius, moments, least)
        # points as near to a cell as strips need
        distance, _ = cKDTree(x.T).query(np.vstack([centres, 0 * radius]).T)
        near = np.nonzero(distance <= IN_STRIPS * radius)[0]
        number = np.full(len(cells), -1)
        number[near] = np.arange(len(near))
        return cls(clouds, Strips.from_loads(loads, cells[near]), *inputs(number))


@compiled
def _stresses(x, ribs, nu, out):
    """2 pi times the stresses."""
    begin, along, length, jump = ribs
    for i in range(x.shape[1]):
        sx = sy = sz = txy = tyz = tzx = 0.0
        for f in range(length.shape[0]):
            g = jump[f]
            a, b, c, d, e, h = rib_stresses(
                x[0, i] - begin[0, f], x[1, i] - begin[1, f], x[2, i],
                along[0, f], along[1, f], length[f], nu,
            )  # fmt: skip
            sx, sy, sz = sx + g * a, sy + g * b, sz + g * c
            txy, tyz, tzx = txy + g * d, tyz + g * e, tzx + g * h
        out[0, i], out[1, i], out[2, i] = sx, sy, sz
        out[3, i], out[4, i], out[5, i] = txy, tyz, tzx


@compiled
def _displacements(x, ribs, nu, out):
    """4 pi G times the displacements."""
    begin, along, length, jump = ribs
    for i in range(x.shape[1]):
        ux = uy = uz = 0.0
        for f in range(length.shape[0]):
            a, b, c = rib_displacements(
                x[0, i] - begin[0, f], x[1, i] - begin[1, f], x[2, i],
                along[0, f], along[1, f], length[f], nu,
            )  # fmt: skip
            ux, uy, uz = ux + jump[f] * a, uy + jump[f] * b, uz + jump[f] * c
        out[0, i], out[1, i], out[2, i] = ux, uy, uz


@compiled
def _add_varying(x, loads, nu, stress, displacement, out):
    """Add 2 pi times the stresses and 4 pi G times the displacements of the variation."""
    clouds, strips, number = loads
    centres, radii, least, px, py, starts, weights = clouds
    begin, along, length, jump, ribs = strips
    for i in range(x.shape[1]):
        z = x[2, i]
        for j in range(number.shape[0]):
            dx, dy = x[0, i] - centres[0, j], x[1, i] - centres[1, j]
            r2, cloud = dx * dx + dy * dy + z * z, 0
            while cloud < least.shape[0] and r2 > least[cloud, j]:
                cloud += 1
            if cloud > 0:
                for k in range(starts[cloud - 1], starts[cloud]):
                    a, b = dx - radii[j] * px[k], dy - radii[j] * py[k]
                    force = weights[j, k]
                    if stress:
                        _add(out[:6], i, force, force_stresses(a, b, z, nu))
                    if displacement:
                        _add(out[6:], i, force, force_displacements(a, b, z, nu))
                continue
            for f in range(ribs[number[j]], ribs[number[j] + 1]):
                a, b = x[0, i] - begin[0, f], x[1, i] - begin[1, f]
                tx, ty, g = along[0, f], along[1, f], jump[f]
                if stress:
                    _add(out[:6], i, g, rib_stresses(a, b, z, tx, ty, length[f], nu))
                if displacement:
                    _add(out[6:], i, g, rib_displacements(a, b, z, tx, ty, length[f], nu))


@compiled
def _add(out, i, factor, values):
    for c in range(len(values)):
        out[c, i] += factor * values[c]
