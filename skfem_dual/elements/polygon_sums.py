"""Integrals of polynomials over r on polygons, at points near them, many points together.

With P a polynomial and r the distance from the field point, Green's second identity takes
integrals over the polygon to its sides, as the Laplacian of r^k is k^2 r^(k - 2)::

    int P / r = oint (P dr/dn - r dP/dn) + int r Q,    Q the Laplacian of P
    int r Q = 1/9 (oint (Q dr^3/dn - r^3 dQ/dn) + int r^3 S),  S that of Q

and so on; the gradient of r is the unit vector from the field point. Along a side P, Q and S are
polynomials of the way along it, the same for all field points, and integrals of its powers over r
follow from one logarithm by a recurrence.

Source: D. R. Wilton et al., Potential integrals for uniform and linear source distributions on
polygonal and polyhedral domains, IEEE Trans. Antennas Propag. 32 (1984), for uniform and linear P.
"""

import numpy as np

from ..kernels.compiled import compiled, vectorised
from .law_polynomials import DEGREE, LOWER, LOWER_TERMS, TERMS
from .ribs import FAR, atanh_series
from .segments import LOG2, ROOT_HALF

#: points that are looked at together at most, always a multiple of the second
LANES, STEP = 32, 8
#: what is known of a side: where it begins, the unit vector to its end and its length; values of
#: P, of its normal derivative, of Q, of its normal derivative and S; values of the polynomial for
#: first moments, of its derivatives along and across the side, and the normal ones of these
PLACE, VALUE, NORMAL, SECOND, THIRD, FOURTH = 0, 5, 10, 14, 17, 19
FIRST, RISES, BENDS, KNOWN = 20, 23, 27, 29
#: terms of one degree of a polynomial from here on
STARTS = tuple(d * (d + 1) // 2 for d in range(DEGREE + 1))


@compiled
def put_side(sides, count, ax, ay, bx, by, polynomials, cx, cy, size, room):
    """Put a side of a polygon behind ``count`` others, unless it is a point; returns how many.

    ``polynomials`` are those of `law_polynomials`, about (cx, cy) over ``size``; one is added to
    the second. ``room`` of shape (2, TERMS) is for temporary use.
    """
    ux, uy = bx - ax, by - ay
    length = np.sqrt(ux * ux + uy * uy)
    if length == 0.0:
        return count
    ux, uy, side = ux / length, uy / length, sides[count]
    side[:5] = ax, ay, ux, uy, length
    # across the side, then along it; of degree d the term with t^k is the k-th
    p, own = room
    own[:] = polynomials[:TERMS]
    _moved(own, DEGREE, (ax - cx) / size, (ay - cy) / size, ux, uy, size, p)
    for i in range(5):
        side[VALUE + i] = p[STARTS[i] + i]
    for i in range(4):
        side[NORMAL + i] = p[STARTS[i + 1] + i]
    for i in range(3):
        along = (i + 2) * (i + 1) * p[STARTS[i + 2] + i + 2]
        side[SECOND + i] = (along + 2 * p[STARTS[i + 2] + i]) / 3
    for i in range(2):
        along = (i + 2) * (i + 1) * p[STARTS[i + 3] + i + 2]
        side[THIRD + i] = (along + 6 * p[STARTS[i + 3] + i]) / 9
    side[FOURTH] = (24 * (p[STARTS[4]] + p[STARTS[4] + 4]) + 8 * p[STARTS[4] + 2]) / 45
    own[:LOWER_TERMS] = polynomials[TERMS:]
    _moved(own, LOWER, (ax - cx) / size, (ay - cy) / size, ux, uy, size, p)
    side[FIRST], side[FIRST + 1], side[FIRST + 2] = 1 + p[0], p[2], p[5]
    side[RISES], side[RISES + 1] = p[2] / 3, 2 * p[5] / 3
    side[RISES + 2], side[RISES + 3] = p[1] / 3, p[4] / 3
    side[BENDS], side[BENDS + 1] = p[4] / 9, 2 * p[3] / 9
    return count + 1


@compiled
def _moved(terms, degree, x, y, ux, uy, size, out):
    """Coefficients from the point (x, y) on, along (uy, -ux) and (ux, uy) in full length."""
    for j in range(degree):
        for first in range(degree - j):
            for i in range(degree - j - 1, first - 1, -1):
                d = i + j
                terms[STARTS[d] + j] += x * terms[STARTS[d + 1] + j]
    for i in range(degree):
        for first in range(degree - i):
            for j in range(degree - i - 1, first - 1, -1):
                d = i + j
                terms[STARTS[d] + j] += y * terms[STARTS[d + 1] + j + 1]
    out[0], power = terms[0], 1.0
    for d in range(1, degree + 1):
        # x = uy h + ux t, y = uy t - ux h, by Horner's scheme in y
        power /= size
        begin = STARTS[d]
        out[begin] = terms[begin + d]
        for j in range(d):
            # times y, and the next term times a power of x
            out[begin + j + 1] = uy * out[begin + j]
            for k in range(j, 0, -1):
                out[begin + k] = uy * out[begin + k - 1] - ux * out[begin + k]
            out[begin] *= -ux
            binomial = terms[begin + d - j - 1]
            for k in range(j + 2):
                share = binomial
                for _ in range(j + 1 - k):
                    share *= uy
                for _ in range(k):
                    share *= ux
                out[begin + k] += share
                binomial = binomial * (j + 1 - k) / (k + 1)
        for k in range(d + 1):
            out[begin + k] *= power


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
    room : (6, LANES) array of float
        For temporary use.
    sums : (4, LANES) array of float
        Integrals of P / r, of 1 / r, and of both components of the unit vectors from the points
        times one more than the second polynomial.
    """
    bits = room.view(np.int64)
    sums[:] = 0.0
    for s in range(count):
        side = sides[s]
        ax, ay, ux, uy, length = side[0], side[1], side[2], side[3], side[4]
        p0, p1, p2, p3, p4 = side[5], side[6], side[7], side[8], side[9]
        n0, n1, n2, n3 = side[10], side[11], side[12], side[13]
        q0, q1, q2, b0, b1, f0 = side[14], side[15], side[16], side[17], side[18], side[19]
        w0, w1, w2 = side[20], side[21], side[22]
        g0, g1, e0, e1, c0, c1 = side[23], side[24], side[25], side[26], side[27], side[28]
        for i in range(x.shape[0]):
            dx, dy = x[i] - ax, y[i] - ay
            ex, ey = dx - length * ux, dy - length * uy
            d1, d2 = np.sqrt(dx * dx + dy * dy), np.sqrt(ex * ex + ey * ey)
            h, t1 = ux * dy - uy * dx, -(ux * dx + uy * dy)
            t2 = t1 + length
            on_line = abs(h) <= 1e-17 * length or d1 == 0.0 or d2 == 0.0
            h = 0.0 if on_line else h
            u1, u2 = d1 + abs(t1), d2 + abs(t2)
            above = u2 if t1 >= 0 else (u1 if t2 <= 0 else u1 * u2)
            below = u1 if t1 >= 0 else (u2 if t2 <= 0 else h * h)
            room[0, i] = 1.0 if on_line else above / below
            room[1, i], room[2, i], room[3, i], room[4, i] = h, t1, d1, d2
        for i in range(x.shape[0]):
            power = (bits[0, i] - ROOT_HALF) >> 52
            bits[0, i] = bits[0, i] - (power << 52)
            room[5, i] = power
        for i in range(x.shape[0]):
            m, h, t1, d1, d2 = room[0, i], room[1, i], room[2, i], room[3, i], room[4, i]
            near = d1 + d2 <= FAR * length
            q = (m - 1 if near else length) / (m + 1 if near else d1 + d2)
            log2 = room[5, i] * LOG2 if near else 0.0
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
