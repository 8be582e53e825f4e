"""Integrals of polynomials over r on polygons, at points near them, many points together.

With P a polynomial and r the distance from the field point, Green's second identity takes
integrals over the polygon to its sides, as the Laplacian of r^k is k^2 r^(k - 2)::

    int P / r = oint (P dr/dn - r dP/dn) + int r Q,    Q the Laplacian of P
    int r Q = 1/9 (oint (Q dr^3/dn - r^3 dQ/dn) + int r^3 S),  S that of Q

and so on; the gradient of r is the unit vector from the field point. Along a side P, Q and S are
polynomials of the way along it, the same for all field points, and integrals of its powers over r
follow from one logarithm by a recurrence.

P is continued to the field point: digits are lost by about the fourth power of its distance over
the width of the polygon, six of them at 2.5 radii from one ten times as long as wide.

Source: D. R. Wilton et al., Potential integrals for uniform and linear source distributions on
polygonal and polyhedral domains, IEEE Trans. Antennas Propag. 32 (1984), for uniform and linear P.
"""

import numpy as np

from ..kernels.compiled import compiled, vectorised
from .law_polynomials import DEGREE, TERMS
from .ribs import FAR, atanh_series
from .segments import LOG2, ROOT_HALF, from_point

#: points that are looked at together at most, always a multiple of the second
LANES, STEP = 32, 8
#: what is known of a side: where it begins, the unit vector to its end and its length; values of
#: P, of its normal derivative, of Q, of its normal derivative and S; values of the polynomial for
#: first moments, of its derivatives along and across the side, and the normal ones of these
VALUE, NORMAL, SECOND, THIRD, FOURTH = 5, 10, 14, 17, 19
FIRST, RISES, BENDS, KNOWN = 20, 23, 27, 29
#: terms of one degree of a polynomial from here on
STARTS = tuple(d * (d + 1) // 2 for d in range(DEGREE + 1))


@compiled
def put_side(sides, count, ax, ay, bx, by, polynomials, size, room):
    """Put a side of a polygon behind ``count`` others, unless it is a point; returns how many.

    ``polynomials`` are those of `law_polynomials`, of the coordinates over ``size``, or nothing;
    one is added to the second. ``room``, three arrays of TERMS, is for temporary use.
    """
    ux, uy = bx - ax, by - ay
    length = np.sqrt(ux * ux + uy * uy)
    if length == 0.0:
        return count
    ux, uy = ux / length, uy / length
    sides[count, 0], sides[count, 1] = ax, ay
    sides[count, 2], sides[count, 3], sides[count, 4] = ux, uy, length
    for k in range(5, KNOWN):
        sides[count, k] = 0.0
    sides[count, FIRST] = 1.0
    if polynomials.shape[0] > 0:
        x, y, u, v = ax / size, ay / size, ux / size, uy / size
        _put_values(polynomials, x, y, u, v, room, sides, count)
        _put_lower(polynomials, x, y, u, v, sides, count)
    return count + 1


@compiled
def _put_values(terms, x, y, u, v, room, sides, s):
    """Put those of the first polynomial on a side from (x, y) by (u, v)."""
    own, powers, p = room
    for k in range(TERMS):
        own[k] = terms[k]
    for j in range(DEGREE):
        for first in range(DEGREE - j):
            for i in range(DEGREE - j - 1, first - 1, -1):
                own[STARTS[i + j] + j] += x * own[STARTS[i + j + 1] + j]
    for i in range(DEGREE):
        for first in range(DEGREE - i):
            for j in range(DEGREE - i - 1, first - 1, -1):
                own[STARTS[i + j] + j] += y * own[STARTS[i + j + 1] + j + 1]
    # powers of x = v h + u t by ascending powers of t, then Horner's scheme in y = v t - u h
    powers[0] = 1.0
    for d in range(1, DEGREE + 1):
        begin, before = STARTS[d], STARTS[d - 1]
        powers[begin], powers[begin + d] = v * powers[before], u * powers[before + d - 1]
        for k in range(1, d):
            powers[begin + k] = v * powers[before + k] + u * powers[before + k - 1]
    for d in range(DEGREE + 1):
        begin = STARTS[d]
        p[begin] = own[begin + d]
        for j in range(1, d + 1):
            term, at = own[begin + d - j], STARTS[j]
            p[begin + j] = v * p[begin + j - 1] + term * powers[at + j]
            for k in range(j - 1, 0, -1):
                p[begin + k] = v * p[begin + k - 1] - u * p[begin + k] + term * powers[at + k]
            p[begin] = term * powers[at] - u * p[begin]
    for i in range(5):
        sides[s, VALUE + i] = p[STARTS[i] + i]
    for i in range(4):
        sides[s, NORMAL + i] = p[STARTS[i + 1] + i]
    for i in range(3):
        second = (i + 2) * (i + 1) * p[STARTS[i + 2] + i + 2] + 2 * p[STARTS[i + 2] + i]
        sides[s, SECOND + i] = second / 3
    for i in range(2):
        third = (i + 2) * (i + 1) * p[STARTS[i + 3] + i + 2] + 6 * p[STARTS[i + 3] + i]
        sides[s, THIRD + i] = third / 9
    fourth = 24 * (p[STARTS[4]] + p[STARTS[4] + 4]) + 8 * p[STARTS[4] + 2]
    sides[s, FOURTH] = fourth / 45


@compiled
def _put_lower(terms, x, y, u, v, sides, s):
    """Put those of the second polynomial."""
    one, gx, gy = terms[TERMS], terms[TERMS + 1], terms[TERMS + 2]
    xx, xy, yy = terms[TERMS + 3], terms[TERMS + 4], terms[TERMS + 5]
    sides[s, FIRST] = 1 + one + x * (gx + x * xx + y * xy) + y * (gy + y * yy)
    gx, gy = gx + 2 * x * xx + y * xy, gy + x * xy + 2 * y * yy
    along, across = gx * u + gy * v, gx * v - gy * u
    bend, over = xx * u * u + xy * u * v + yy * v * v, xx * v * v - xy * u * v + yy * u * u
    turn = 2 * u * v * (xx - yy) + xy * (v * v - u * u)
    sides[s, FIRST + 1], sides[s, FIRST + 2] = along, bend
    sides[s, RISES], sides[s, RISES + 1] = along / 3, 2 * bend / 3
    sides[s, RISES + 2], sides[s, RISES + 3] = across / 3, turn / 3
    sides[s, BENDS], sides[s, BENDS + 1] = turn / 9, 2 * over / 9


@vectorised
def add_sides(x, y, sides, count, room, sums):
    """Integrals over a polygon at some points.

    Parameters
    ----------
    x, y : (LANES,) array of float
        Points.
    sides : (k, KNOWN) array of float
        See `put_side`; the polygon is on their left.
    count : int
        Number of sides.
    room : (6, k * LANES) array of float
        For temporary use.
    sums : (4, LANES) array of float
        Integrals of P / r, of 1 / r, and of both components of the unit vectors from the points
        times one more than the second polynomial.
    """
    bits, width = room.view(np.int64), x.shape[0]
    sums[:] = 0.0
    # all sides before what takes them up: each waits for one step of its own only
    for s in range(count):
        ax, ay, ux, uy, length = sides[s, 0], sides[s, 1], sides[s, 2], sides[s, 3], sides[s, 4]
        for i in range(width):
            h, t1, d1, d2, ratio = from_point(x[i] - ax, y[i] - ay, ux, uy, length)
            k = s * width + i
            room[0, k] = ratio
            room[1, k], room[2, k], room[3, k], room[4, k] = h, t1, d1, d2
    for k in range(count * width):
        power = (bits[0, k] - ROOT_HALF) >> 52
        bits[0, k] = bits[0, k] - (power << 52)
        room[5, k] = power
    for s in range(count):
        ux, uy, length = sides[s, 2], sides[s, 3], sides[s, 4]
        p0, p1, p2, p3 = sides[s, 5], sides[s, 6], sides[s, 7], sides[s, 8]
        p4, n0, n1, n2 = sides[s, 9], sides[s, 10], sides[s, 11], sides[s, 12]
        n3, q0, q1, q2 = sides[s, 13], sides[s, 14], sides[s, 15], sides[s, 16]
        b0, b1, f0, w0 = sides[s, 17], sides[s, 18], sides[s, 19], sides[s, 20]
        w1, w2, g0, g1 = sides[s, 21], sides[s, 22], sides[s, 23], sides[s, 24]
        e0, e1, c0, c1 = sides[s, 25], sides[s, 26], sides[s, 27], sides[s, 28]
        for i in range(width):
            k = s * width + i
            m, h, t1, d1, d2 = room[0, k], room[1, k], room[2, k], room[3, k], room[4, k]
            near = d1 + d2 <= FAR * length
            q = (m - 1 if near else length) / (m + 1 if near else d1 + d2)
            log2 = room[5, k] * LOG2 if near else 0.0
            square, end = d1 * d1, length * d2
            # powers of the way over r, then times r and times r^3
            j0 = log2 + 2 * q * atanh_series(q * q)
            j1 = d2 - d1 - t1 * j0
            j2 = (end - 3 * t1 * j1 - square * j0) / 2
            end *= length
            j3 = (end - 5 * t1 * j2 - 2 * square * j1) / 3
            end *= length
            j4 = (end - 7 * t1 * j3 - 3 * square * j2) / 4
            end *= length
            j5 = (end - 9 * t1 * j4 - 4 * square * j3) / 5
            k0, k1 = j2 + 2 * t1 * j1 + square * j0, j3 + 2 * t1 * j2 + square * j1
            k2, k3 = j4 + 2 * t1 * j3 + square * j2, j5 + 2 * t1 * j4 + square * j3
            m0, m1 = k2 + 2 * t1 * k1 + square * k0, k3 + 2 * t1 * k2 + square * k1
            value = p0 * j0 + p1 * j1 + p2 * j2 + p3 * j3 + p4 * j4
            value += q0 * k0 + q1 * k1 + q2 * k2 + f0 * m0
            sloped = n0 * k0 + n1 * k1 + n2 * k2 + n3 * k3
            sums[0, i] += h * value - sloped - b0 * m0 - b1 * m1
            sums[1, i] += h * j0
            along = c0 * m0 - h * (g0 * k0 + g1 * k1)
            across = w0 * k0 + w1 * k1 + w2 * k2 + c1 * m0 - h * (e0 * k0 + e1 * k1)
            sums[2, i] += uy * across + ux * along
            sums[3, i] += uy * along - ux * across
