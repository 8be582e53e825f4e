"""Triangles that carry uniform pressures, many to a cell, and what they settle.

Far from a cell its triangles act by a series about their centroid, nearer each by its second
moments, and next to it exactly.
"""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..kernels.compiled import compiled, inputs, vectorised
from .moments import far_influence, series_terms
from .ribs import rib_integral

#: sizes of a cell from which on its pressures act by a series, and of a triangle up to which it is
#: integrated over its sides; between them it acts by its second moments
FAR, EXACT = 5.0, 4.0
#: points as far as that but for rounding, on regular grids, are on the near side
ROUNDED = 1 + 1e-9
#: barycentric coordinates, (6, 3), and weights of a rule for fourth degree: G. R. Cowper, Int. J.
#: Numer. Methods Eng. 7 (1973) 405
A, B = 0.445948490915964886318329253883051, 0.0915762135097707434595714634022015
DEGREE_4 = (
    np.array(
        [[x, x, 1 - 2 * x] for x in (A, B)]
        + [[x, 1 - 2 * x, x] for x in (A, B)]
        + [[1 - 2 * x, x, x] for x in (A, B)]
    ),
    np.array([0.223381589678011465944498410540, 0.109951743655321867388834922793] * 3),
)


class Loads(NamedTuple):
    """Triangles and cells, as kernels take them.

    Attributes
    ----------
    corners : (2, m, 3) array of float
        Of the triangles.
    inertia : (6, m) array of float
        Their centroids, areas and second moments.
    exact : (m,) array of float
        Squares of distances up to which they are integrated over their sides.
    density : (2, m) array of float
        Of both laws.
    starts : (k + 1,) array of int
        First triangles of the cells.
    middles : (2, k) array of float
        Points of the cells.
    far : (k,) array of float
        Squares of distances from these from which on series serve.
    mass, terms : (2, k) and (2, 14, k) array of float
        Series of both laws, see `series_terms`.
    """

    corners: ndarray
    inertia: ndarray
    exact: ndarray
    density: ndarray
    starts: ndarray
    middles: ndarray
    far: ndarray
    mass: ndarray
    terms: ndarray

    @classmethod
    def of(cls, p: ndarray, t: ndarray, starts: ndarray, density: ndarray) -> "Loads":
        """Of triangles on points, those of a cell one after the other."""
        k, corners = len(starts) - 1, p[:, t.T]
        inertia, exact = np.empty((6, t.shape[1])), np.empty(t.shape[1])
        middles, far, moments = np.empty((2, k)), np.empty(k), np.zeros((2, 5, 5, k))
        given = inputs(corners, density, starts, *DEGREE_4)
        _integrate(*given, inertia, exact, middles, far, moments)
        factorials = np.array([1, 1, 2, 6, 24])
        moments /= (factorials[:, None] * factorials)[..., None]
        terms = np.stack([series_terms(own) for own in moments])
        exact, far = ROUNDED * EXACT**2 * exact, ROUNDED * FAR**2 * far
        return cls(corners, inertia, exact, density, starts, middles, far, moments[:, 0, 0], terms)

    def part(self, some: slice) -> "Loads":
        """Those of some cells."""
        starts = self.starts[some.start : some.stop + 1]
        own = slice(starts[0], starts[-1])
        of_cells = (each[..., some] for each in (self.middles, self.far, self.mass, self.terms))
        triangles = self.corners[:, own], self.inertia[:, own], self.exact[own]
        return Loads(*inputs(*triangles, self.density[:, own], starts - starts[0], *of_cells))


@compiled
def _integrate(corners, density, starts, rule, weights, inertia, exact, middles, far, moments):
    """Inertia of triangles and squares of their radii; centroids of cells, squares of their radii
    and integrals of products of the coordinates from there, (2, 5, 5, k), under both laws."""
    for j in range(starts.shape[0] - 1):
        total, mx, my = 0.0, 0.0, 0.0
        for k in range(starts[j], starts[j + 1]):
            x, y = corners[0, k], corners[1, k]
            cx, cy = (x[0] + x[1] + x[2]) / 3, (y[0] + y[1] + y[2]) / 3
            area = ((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) / 2
            xx, xy, yy, radius = 0.0, 0.0, 0.0, 0.0
            for i in range(3):
                dx, dy = x[i] - cx, y[i] - cy
                xx, xy, yy = xx + dx * dx, xy + dx * dy, yy + dy * dy
                radius = max(radius, dx * dx + dy * dy)
            inertia[0, k], inertia[1, k], inertia[2, k], exact[k] = cx, cy, area, radius
            inertia[3, k], inertia[4, k], inertia[5, k] = (
                area / 12 * xx,
                area / 12 * xy,
                area / 12 * yy,
            )
            total, mx, my = total + area, mx + area * cx, my + area * cy
        mx, my = mx / total, my / total
        middles[0, j], middles[1, j], far[j] = mx, my, 0.0
        for k in range(starts[j], starts[j + 1]):
            for i in range(3):
                dx, dy = corners[0, k, i] - mx, corners[1, k, i] - my
                far[j] = max(far[j], dx * dx + dy * dy)
            for q in range(weights.shape[0]):
                dx, dy = -mx, -my
                for i in range(3):
                    dx += rule[q, i] * corners[0, k, i]
                    dy += rule[q, i] * corners[1, k, i]
                load = weights[q] * inertia[2, k]
                for law in range(2):
                    power = density[law, k] * load
                    for a in range(5):
                        value = power
                        for b in range(5 - a):
                            moments[law, a, b, j] += value
                            value *= dy
                        power *= dx


@vectorised
def fill(begin, end, x, c, loads, out):
    """Settlements under one law or both on some cells, ``out`` of shape (nlaws, k, m)."""
    corners, inertia, exact, density, starts, middles, far, mass, terms = loads
    m = x.shape[1]
    near, x0, y0 = np.empty(m, np.int64), np.empty(m), np.empty(m)
    value, one, two = np.empty(m), np.empty(m), np.empty(m)
    for j in range(begin, end):
        for law in range(out.shape[0]):
            own = terms[law]
            for i in range(m):
                dx, dy = x[0, i] - middles[0, j], x[1, i] - middles[1, j]
                r = np.sqrt(dx * dx + dy * dy)
                out[law, j, i] = c * (mass[law, j] / r + far_influence(dx, dy, far[j], own, j))
        count = 0
        for i in range(m):
            dx, dy = x[0, i] - middles[0, j], x[1, i] - middles[1, j]
            if dx * dx + dy * dy < far[j]:
                near[count], x0[count], y0[count] = i, x[0, i], x[1, i]
                one[count], two[count] = 0.0, 0.0
                count += 1
        for k in range(starts[j], starts[j + 1]):
            cx, cy, area = inertia[0, k], inertia[1, k], inertia[2, k]
            xx, xy, yy = inertia[3, k], inertia[4, k], inertia[5, k]
            for i in range(count):
                dx, dy = x0[i] - cx, y0[i] - cy
                f = 1 / (dx * dx + dy * dy)
                turned = 3 * f * (xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy) - xx - yy
                value[i] = np.sqrt(f) * (area + f * turned / 2)
            for i in range(count):
                dx, dy = x0[i] - cx, y0[i] - cy
                if dx * dx + dy * dy < exact[k]:
                    value[i] = _over_triangle(x0[i], y0[i], corners, k)
            for i in range(count):
                one[i] += density[0, k] * value[i]
                two[i] += density[1, k] * value[i]
        for i in range(count):
            out[0, j, near[i]] = c * one[i]
            if out.shape[0] > 1:
                out[1, j, near[i]] = c * two[i]


@compiled
def _over_triangle(x, y, corners, k):
    """Integral of 1/r over a triangle."""
    total = 0.0
    ax, ay = corners[0, k, 2], corners[1, k, 2]
    r1 = np.sqrt((x - ax) ** 2 + (y - ay) ** 2)
    for end in range(3):
        bx, by = corners[0, k, end], corners[1, k, end]
        r2 = np.sqrt((x - bx) ** 2 + (y - by) ** 2)
        lx, ly = bx - ax, by - ay
        total += rib_integral(x, y, ax, ay, lx, ly, np.sqrt(lx * lx + ly * ly), r1, r2)
        ax, ay, r1 = bx, by, r2
    return total
