"""Boussinesq's solution: stresses and displacements in a homogeneous half-space.

The axes are x, y on the surface and z down into the ground; stresses are compression positive.
With the potentials V, the integral of p/R over the load, and chi, that of p ln(R + z)::

    2 pi sigma_z = z V_zz - V_z        2 pi tau_zx = z V_xz
    2 pi sigma_x = z V_xx - 2 nu V_z + (1 - 2 nu) chi_xx
    2 pi tau_xy  = z V_xy            + (1 - 2 nu) chi_xy
    4 pi G u_z   = 2 (1 - nu) V - z V_z
    4 pi G u_x   = -z V_x - (1 - 2 nu) chi_x

Under uniform loads on polygons every derivative is by Gauss's theorem a sum over their ribs of
elementary functions.

Sources: A. E. H. Love, The stress produced in a semi-infinite solid by pressure on part of the
boundary, Phil. Trans. R. Soc. A 228 (1929); K. L. Johnson, Contact Mechanics (1985), chapter 3.
"""

import numpy as np

from ..kernels.compiled import compiled


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
def rib_stresses(dx, dy, z, tx, ty, length, nu):
    """2 pi times the share of a rib, of unit pressure on its left, in the six stresses.

    Seen from its beginning the point is at (dx, dy, z); (tx, ty) is its direction. The order is
    that of `Stresses`.
    """
    h, t1, t2, r1, r2, w, angle, turn = _rib(dx, dy, z, tx, ty, length)
    j = z * w / (r1 * r2)  # z times the integral of 1/R^3
    k = z * length * (t1 + t2) / ((r1 + r2) * r1 * r2)  # z (1/r1 - 1/r2)
    normal = (1 - 2 * nu) * angle - h * j
    shear = k - (1 - 2 * nu) * turn
    return (
        2 * nu * angle + ty * ty * normal - tx * ty * shear,
        2 * nu * angle + tx * tx * normal + tx * ty * shear,
        angle + h * j,
        -(tx * ty * normal + (ty * ty - tx * tx) / 2 * shear),
        -tx * z * j,
        ty * z * j,
    )


@compiled
def rib_displacements(dx, dy, z, tx, ty, length, nu):
    """4 pi G times the share of a rib in the three displacements, as in `rib_stresses`."""
    h, t1, _, _, r2, w, angle, turn = _rib(dx, dy, z, tx, ty, length)
    inverse = np.arcsinh(w)  # integral of 1/R
    # integral of 1 + ln(R + z): the 1 cancels around a cell
    log = length * np.log(r2 + z) + t1 * turn + z * inverse + h * angle
    outward = (1 - 2 * nu) * log + z * inverse
    down = 2 * (1 - nu) * h * inverse - (1 - 2 * nu) * z * angle
    return ty * outward, -tx * outward, down


@compiled
def force_stresses(x, y, z, nu):
    """2 pi times the six stresses at (x, y, z) from a unit force."""
    R = np.sqrt(x * x + y * y + z * z)
    r3, r5, c = 1 / R**3, 3 * z / R**5, 1 - 2 * nu
    # second derivatives of ln(R + z), and those of z / R with them
    first, second = c * (1 / (R * (R + z)) - z * r3), c * (2 * R + z) * r3 / (R + z) ** 2
    across = r5 - second
    return (
        x * x * across + first,
        y * y * across + first,
        z * z * r5,
        x * y * across,
        y * z * r5,
        x * z * r5,
    )


@compiled
def force_displacements(x, y, z, nu):
    """4 pi G times the three displacements at (x, y, z) from a unit force."""
    R = np.sqrt(x * x + y * y + z * z)
    outward = z / R**3 - (1 - 2 * nu) / (R * (R + z))
    return x * outward, y * outward, 2 * (1 - nu) / R + z * z / R**3
