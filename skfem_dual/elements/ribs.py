"""Integrals of 1/r over polygons, closed on their ribs.

Seen from the field point, the integral over a polygon is a sum over its ribs, each with the
triangle of the point and the rib. Cells share ribs, so a rib is integrated once and counted for
the cell on its left, against the cell on its right.

Sources: A. E. H. Love, The stress produced in a semi-infinite solid by pressure on part of the
boundary, Phil. Trans. R. Soc. A 228 (1929), for the potential of a polygon; D. R. Wilton et al.,
Potential integrals for uniform and linear source distributions on polygonal and polyhedral
domains, IEEE Trans. Antennas Propag. 32 (1984), for the sum over sides.
"""

from typing import NamedTuple, Self

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..kernels.compiled import compiled, inlined, inputs

#: a rib is far, or farther, if its ends are together farther than so many of its lengths
FAR, FARTHER = 4, 12


class Ribs(NamedTuple):
    """The ribs of a partition, as kernels take them.

    Attributes
    ----------
    p : (2, k) array of float
        Vertices.
    facets : (2, nribs) array of int
        Begin and end of each rib.
    f2c : (2, nribs) array of int
        Cells on its left and on its right, -1 for none.
    """

    p: ndarray
    facets: ndarray
    f2c: ndarray

    @classmethod
    def from_partition(cls, partition: Partition) -> Self:
        """All ribs, in the order of ``partition.facets``."""
        return cls(*inputs(partition.polygons.p, partition.facets, partition.f2c))


@inlined
def atanh_series(z):
    """atanh(q) / q for z = q^2 <= 1 / FAR^2, to rounding."""
    s = z / 21 + 1 / 19
    s = s * z + 1 / 17
    s = s * z + 1 / 15
    s = s * z + 1 / 13
    s = s * z + 1 / 11
    s = s * z + 1 / 9
    s = s * z + 1 / 7
    s = s * z + 1 / 5
    s = s * z + 1 / 3
    return s * z + 1


@inlined
def short_series(z):
    """The same for z <= 1 / FARTHER^2."""
    s = z / 11 + 1 / 9
    s = s * z + 1 / 7
    s = s * z + 1 / 5
    s = s * z + 1 / 3
    return s * z + 1


@compiled
def rib_integral(x, y, ax, ay, lx, ly, length, r1, r2):
    """Integral of 1/r over the triangle of the field point and a rib, positive on its left.

    The rib leads from (ax, ay) by (lx, ly); r1, r2 are the distances of its ends.
    """
    dx, dy = x - ax, y - ay
    cross = lx * dy - ly * dx
    if abs(cross) <= 1e-17 * length * length or r1 == 0.0 or r2 == 0.0:
        return 0.0
    h = cross / length
    if r1 + r2 > FAR * length:
        # 2 atanh(q): the logarithms below would cancel
        q = length / (r1 + r2)
        return 2 * h * q * atanh_series(q * q)
    t1 = -(lx * dx + ly * dy) / length
    t2 = t1 + length
    if t1 >= 0:
        return h * np.log((r2 + t2) / (r1 + t1))
    if t2 <= 0:
        return h * np.log((r1 - t1) / (r2 - t2))
    return h * np.log((r2 + t2) * (r1 - t1) / (h * h))
