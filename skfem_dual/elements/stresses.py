"""Stresses and displacements in a homogeneous half-space below uniformly loaded cells.

The axes are x, y on the surface and z down into the ground. With the potentials V, the integral
of p/R over the cells, and chi, that of p ln(R + z), Boussinesq's solution is::

    2 pi sigma_z = z V_zz - V_z        2 pi tau_zx = z V_xz
    2 pi sigma_x = z V_xx - 2 nu V_z + (1 - 2 nu) chi_xx
    2 pi tau_xy  = z V_xy            + (1 - 2 nu) chi_xy
    4 pi G u_z   = 2 (1 - nu) V - z V_z
    4 pi G u_x   = -z V_x - (1 - 2 nu) chi_x

By Gauss's theorem every derivative is a sum over ribs of elementary functions. As on the surface,
neighbouring cells share ribs, so every rib counts once, with the jump of the pressure across it.

Sources: A. E. H. Love, The stress produced in a semi-infinite solid by pressure on part of the
boundary, Phil. Trans. R. Soc. A 228 (1929); K. L. Johnson, Contact Mechanics (1985), chapter 3.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..arguments import checked_array
from ..grids.partition import Partition
from ..ground.substrates import HalfSpace, Substrate
from ..kernels.compiled import compiled, inputs
from ..kernels.threads import Threads
from ..messages import shown


class Stresses(NamedTuple):
    """Components of the stress at m points, compression positive: minus Cauchy's tensor.

    Attributes
    ----------
    sigma_x, sigma_y, sigma_z : (m,) array of float
        Normal stresses.
    tau_xy, tau_yz, tau_zx : (m,) array of float
        Shear stresses; tau_zx > 0 on the side of positive x of a load.
    """

    sigma_x: ndarray
    sigma_y: ndarray
    sigma_z: ndarray
    tau_xy: ndarray
    tau_yz: ndarray
    tau_zx: ndarray

    @property
    def tensor(self) -> ndarray:
        """The components as a symmetric tensor of shape (3, 3, m)."""
        return np.stack(self)[[[0, 3, 5], [3, 1, 4], [5, 4, 2]]]


def stresses(
    substrate: Substrate, partition: Partition, pressure: ndarray, x: ArrayLike
) -> Stresses:
    """Stresses at points of shape (3, m) under one pressure per cell; see `stress_below`."""
    ground, x = _checked(substrate, x)
    out = np.empty((6, x.shape[1]))
    ribs = _LoadedRibs.from_pressure(partition, pressure)
    nu = ground.poisson

    def work(rows: slice) -> None:
        part = np.empty((6, rows.stop - rows.start))
        _stresses(*inputs(x[:, rows]), ribs, nu, part)
        out[:, rows] = part

    with Threads() as run:
        run(work, x.shape[1])
    return Stresses(*out / (2 * np.pi))


def displacements(
    substrate: Substrate, partition: Partition, pressure: ndarray, x: ArrayLike
) -> ndarray:
    """Displacements at points of shape (3, m) under one pressure per cell; shape (3, m)."""
    ground, x = _checked(substrate, x)
    out = np.empty((3, x.shape[1]))
    ribs = _LoadedRibs.from_pressure(partition, pressure)
    nu = ground.poisson

    def work(rows: slice) -> None:
        part = np.empty((3, rows.stop - rows.start))
        _displacements(*inputs(x[:, rows]), ribs, nu, part)
        out[:, rows] = part

    with Threads() as run:
        run(work, x.shape[1])
    return out * (1 + nu) / (2 * np.pi * ground.young)


def _checked(substrate: Substrate, x: ArrayLike) -> tuple[HalfSpace, ndarray]:
    if not isinstance(substrate, HalfSpace):
        raise ValueError(
            f"expected a homogeneous HalfSpace, got {shown(substrate)}: the solution "
            "below its surface is not closed. Remedy: skfem_dual.elements.stresses.stresses("
            "HalfSpace(young, poisson), punch.partition, solution.pressure, x) lets the same "
            "pressures act on a homogeneous ground"
        )
    x = checked_array("x", x, (3, "m"), each="point")
    if (bad := np.nonzero(~(x[2] > 0))[0]).size:
        raise ValueError(
            "expected points in the ground, with finite depths z > 0; the first that is not: "
            f"{bad[0]}, with z={x[2, bad[0]]:g}"
        )
    return substrate, x


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


@compiled
def _rib(dx, dy, z, tx, ty, length):
    """What all sums consist of, for a point at (dx, dy, z) from the beginning of a rib.

    Returns
    -------
    h : float
        Distance of the point to the left of the rib.
    t1, t2, r1, r2 : float
        The rib's ends seen from the point: coordinates along the rib, distances.
    w : float
        (t2 r1 - t1 r2) / (h^2 + z^2): the integral of 1 / R^3 is w / (r1 r2), that of 1 / R is
        asinh(w).
    angle : float
        Solid angle of the rib and the point's projection, integral of h / (R (R + z)).
    turn : float
        ln((r2 + z) / (r1 + z)).
    """
    h = tx * dy - ty * dx
    t1 = -(tx * dx + ty * dy)
    t2 = t1 + length
    ll = h * h + z * z
    r1, r2 = np.sqrt(t1 * t1 + ll), np.sqrt(t2 * t2 + ll)
    # without cancellation
    w = length * (t1 + t2) / (t2 * r1 + t1 * r2) if t1 * t2 > 0 else (t2 * r1 - t1 * r2) / ll
    # difference of atan(t h / (ll + z r)) at the ends
    angle = np.arctan2(h * ll * (length + z * w), (ll + z * r1) * (ll + z * r2) + h * h * t1 * t2)
    turn = np.log1p(length * abs(t1 + t2) / ((r1 + r2) * (min(r1, r2) + z)))
    return h, t1, t2, r1, r2, w, angle, turn if t2 > -t1 else -turn


@compiled
def _stresses(x, ribs, nu, out):
    """2 pi times the stresses."""
    begin, along, length, jump = ribs
    for i in range(x.shape[1]):
        z = x[2, i]
        sx = sy = sz = txy = tyz = tzx = 0.0
        for f in range(length.shape[0]):
            tx, ty = along[0, f], along[1, f]
            h, t1, t2, r1, r2, w, angle, turn = _rib(
                x[0, i] - begin[0, f], x[1, i] - begin[1, f], z, tx, ty, length[f]
            )
            j = z * w / (r1 * r2)  # z times the integral of 1/R^3
            k = z * length[f] * (t1 + t2) / ((r1 + r2) * r1 * r2)  # z (1/r1 - 1/r2)
            normal = (1 - 2 * nu) * angle - h * j
            shear = k - (1 - 2 * nu) * turn
            g = jump[f]
            sx += g * (2 * nu * angle + ty * ty * normal - tx * ty * shear)
            sy += g * (2 * nu * angle + tx * tx * normal + tx * ty * shear)
            sz += g * (angle + h * j)
            txy -= g * (tx * ty * normal + (ty * ty - tx * tx) / 2 * shear)
            tyz -= g * tx * z * j
            tzx += g * ty * z * j
        out[0, i], out[1, i], out[2, i] = sx, sy, sz
        out[3, i], out[4, i], out[5, i] = txy, tyz, tzx


@compiled
def _displacements(x, ribs, nu, out):
    """4 pi G times the displacements."""
    begin, along, length, jump = ribs
    for i in range(x.shape[1]):
        z = x[2, i]
        ux = uy = uz = 0.0
        for f in range(length.shape[0]):
            tx, ty = along[0, f], along[1, f]
            h, t1, _, _, r2, w, angle, turn = _rib(
                x[0, i] - begin[0, f], x[1, i] - begin[1, f], z, tx, ty, length[f]
            )
            inverse = np.arcsinh(w)  # integral of 1/R
            # integral of 1 + ln(R + z): the 1 cancels around a cell
            log = length[f] * np.log(r2 + z) + t1 * turn + z * inverse + h * angle
            outward = jump[f] * ((1 - 2 * nu) * log + z * inverse)
            ux += ty * outward
            uy -= tx * outward
            uz += jump[f] * (2 * (1 - nu) * h * inverse - (1 - 2 * nu) * z * angle)
        out[0, i], out[1, i], out[2, i] = ux, uy, uz
