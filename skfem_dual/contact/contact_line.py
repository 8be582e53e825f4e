"""Where contact ends, from pressures and gaps beside a line that is about there.

With the distance s to the edge of contact, ``p^2`` inside and ``gap^(2/3)`` outside are smooth
functions that vanish there, with slopes that depend on one strength K: see `ContactRegion`. Along
the line both are fitted to the cells around by polynomials in s, of second degree with a curvature
of its own on each side, and in the place along the line; their zero is the edge.
"""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..grids.lines import Segments
from ..grids.nearest import nearest
from ..kernels.compiled import compiled, inlined, inputs, vectorised
from .planes import PlaneFit

#: pairs of neighbours, one in contact, that tell the strength in a cell
AROUND = 7
#: cells a polynomial follows, and how much those in contact count: under what bends, the pressure
#: leaves its law sooner than the gap
FOLLOWED, INSIDE = 32, 0.03
#: points of a line over which its way is averaged
NEAREST = 3
#: of the polynomial: 1, s, the place, their product, s^2 inside and outside
TERMS = 6
#: of the normal equations, over their trace
RIDGE = 1e-7
#: parts of a whole that sum up to a half but for so much have their median between two values
HALF = 1e-9
#: the line moves by no more than this part of a cell
FARTHEST = 0.5


class Seen(NamedTuple):
    """What is seen of the cells of k pictures, one picture after the other.

    Attributes
    ----------
    x : (2, n) array of float
        Collocation points of the cells.
    sizes : (n,) array of float
        Roots of their areas.
    square, gaps : (n,) array of float
        There the square of the pressure, and the power 2/3 of 3 E* / 4 times the gap, both over
        the law of the edge of the plan.
    even : (2, 2) array of float
        A map of determinant one under which cells are about as long as wide, see `evening`: what
        is near is so there.
    """

    x: ndarray
    sizes: ndarray
    square: ndarray
    gaps: ndarray
    even: ndarray


def edge_distance(n: int, pairs: ndarray, starts: ndarray, cells: Seen) -> ndarray:
    """About the distance of cells to the edge of contact, positive in contact, in k pictures.

    Parameters
    ----------
    n : int
        Cells of each picture.
    pairs : (2, m) array of int
        Neighbours, one in contact and one not: their distances to the edge add up.
    starts : (k + 1,) array of int
        First pairs of the pictures.
    cells : Seen
        Of all pictures.
    """
    x, sizes, square, gaps, even = cells
    inside, k = square > 0, len(starts) - 1
    firsts, each = n * np.arange(k + 1), np.repeat(np.arange(k), np.diff(starts))
    i = np.where(inside[pairs[0]], *pairs)
    j = pairs.sum(axis=0) - i
    step, middle = x[:, i] - x[:, j], (x[:, i] + x[:, j]) / 2
    around = min(AROUND, np.diff(starts).min())
    centres, middles = even @ x, even @ middle
    near = nearest(middles, starts, centres, np.repeat(np.arange(k), n), around)
    followed = nearest(centres, firsts, middles, each, min(2 * AROUND, n))
    beside = followed.number
    used, distance = np.zeros(len(sizes), dtype=bool), np.empty(len(sizes))
    used[beside] = True
    slopes = PlaneFit.to(x, middle, followed).inverse[:, 1:]
    pairs_near = near.number, near.share
    _put_distances(*inputs(i, j, step, *pairs_near, beside, slopes, square, gaps, used), distance)
    return distance


@vectorised
def _put_distances(
    i: ndarray,
    j: ndarray,
    step: ndarray,
    near: ndarray,
    share: ndarray,
    beside: ndarray,
    slopes: ndarray,
    square: ndarray,
    gaps: ndarray,
    used: ndarray,
    distance: ndarray,
) -> None:
    """Distances of cells by the strengths of the pairs ``near`` them; the direction across the
    edge follows from those of the cells ``beside`` each pair."""
    length = np.hypot(step[0], step[1])
    across, strength = 0.8 * length, np.empty(len(i))
    some, parts = np.empty(near.shape[1]), np.empty(near.shape[1])
    for last in (False, False, True):
        for k in range(len(i)):
            strength[k] = _strength(square[i[k]], gaps[j[k]], across[k])
        for cell in range(len(distance)):
            if last or used[cell]:
                for k in range(len(some)):
                    some[k], parts[k] = strength[near[cell, k]], share[cell, k]
                z = _median(some, parts)
                inside = square[cell] > 0
                distance[cell] = square[cell] * z * z * z if inside else -gaps[cell] * z
        for k in range(len(i)):
            along_x, along_y = 0.0, 0.0
            for at in range(beside.shape[1]):
                along_x += slopes[k, 0, at] * distance[beside[k, at]]
                along_y += slopes[k, 1, at] * distance[beside[k, at]]
            slope = np.hypot(along_x, along_y)
            onward = (along_x * step[0, k] + along_y * step[1, k]) / slope
            across[k] = max(0.3 * length[k], onward)


@compiled
def _median(values: ndarray, shares: ndarray) -> float:
    """That of a few values with shares, which are sorted."""
    total = shares[0]
    for k in range(1, len(values)):
        value, share, at = values[k], shares[k], k
        total += share
        while at > 0 and values[at - 1] > value:
            values[at], shares[at] = values[at - 1], shares[at - 1]
            at -= 1
        values[at], shares[at] = value, share
    lower, upper = 0, len(values) - 1
    below, above = shares[lower], shares[upper]
    while below < (0.5 - HALF) * total:
        lower += 1
        below += shares[lower]
    while above < (0.5 - HALF) * total:
        upper -= 1
        above += shares[upper]
    return (values[lower] + values[upper]) / 2


@inlined
def _strength(f: float, g: float, across: float) -> float:
    """The root z = K^(-2/3) of ``f z^3 + g z = across``, by Newton's method from above: from at
    most half as much again five steps lead to rounding."""
    z = min(np.cbrt(across / f), across / g)
    for _ in range(5):
        z = z - (f * z * z * z + g * z - across) / (3 * f * z * z + g)
    return z


def moved_line(lines: Segments, starts: ndarray, cells: Seen) -> tuple[ndarray, ndarray]:
    """Points on lines and how far beyond them contact ends.

    Parameters
    ----------
    lines : Segments
        About where contact ends, in pictures.
    starts : (k + 1,) array of int
        First cells of the pictures.
    cells : Seen
        Of all pictures.

    Returns
    -------
    (2, m) and (m,) array of float
        Points and distances, positive where contact ends farther out.
    """
    x, sizes, square, gaps, even = cells
    along, picture = lines.end - lines.begin, lines.picture
    points, tangents = (lines.begin + lines.end) / 2, along / np.hypot(*along)
    centres, count = even @ x, min(FOLLOWED, np.diff(starts).min())
    near, _, share = nearest(centres, starts, even @ points, picture, count)
    used = np.zeros(x.shape[1], dtype=bool)
    used[near] = True
    of = np.repeat(np.arange(len(starts) - 1), np.diff(starts))[used]
    distance = np.empty(x.shape[1])
    distance[used] = lines.signed_distance(x[:, used], of)  # the region is to the left
    moved = np.empty(len(near))
    known = near, share, x, sizes, distance, square, gaps, even
    _put_moved(*inputs(points, tangents, *known), moved)
    return points, moved


def mean_of_nearest(
    lines: Segments, moved: tuple[ndarray, ndarray], at: ndarray, of: ndarray
) -> ndarray:
    """Mean of what `moved_line` has in the points nearest to others, ``of`` some pictures; zero
    in pictures without lines."""
    points, by = moved
    near, _, share = nearest(points, lines.starts, at, of, NEAREST)
    return np.sum(np.append(by, 0.0)[near] * share, axis=1) / share.sum(axis=1).clip(1)


@vectorised
def _put_moved(
    points: ndarray,
    tangents: ndarray,
    near: ndarray,
    share: ndarray,
    x: ndarray,
    sizes: ndarray,
    distance: ndarray,
    square: ndarray,
    gaps: ndarray,
    even: ndarray,
    moved: ndarray,
) -> None:
    """How far beyond points contact ends, by polynomials in the cells ``near`` each, (m, k)."""
    count = near.shape[1]
    areas, parts = np.empty(count), np.empty(count)
    columns, weights = np.empty((TERMS, count)), np.empty(count)
    matrix, rows = np.empty((TERMS, TERMS)), np.empty((TERMS, 2))
    for i in range(len(moved)):
        for k in range(count):
            areas[k], parts[k] = sizes[near[i, k]] ** 2, share[i, k]
        root, strength, outside = np.sqrt(_median(areas, parts)), 0.0, 0.0
        # across the line, normal to its tangent, cells reach as far as this
        nx, ny = -tangents[1, i], tangents[0, i]
        size = root / np.hypot(
            even[0, 0] * nx + even[0, 1] * ny, even[1, 0] * nx + even[1, 1] * ny
        )
        for k in range(count):
            j = near[i, k]
            dx, dy = (x[0, j] - points[0, i]) / root, (x[1, j] - points[1, i]) / root
            s, along, inner = distance[j] / size, tangents[0, i] * dx, square[j] > 0
            along += tangents[1, i] * dy
            ax = even[0, 0] * dx + even[0, 1] * dy
            ay = even[1, 0] * dx + even[1, 1] * dy
            # cells beyond a ridge of the distance, between two lines, count little
            weights[k] = share[i, k] * np.exp(-(ax * ax + ay * ay) / 2)
            weights[k] *= INSIDE if inner else 1.0
            outside += 0.0 if inner else weights[k]
            columns[0, k], columns[1, k], columns[2, k] = 1.0, s, along
            columns[3, k] = s * along
            columns[4, k], columns[5, k] = s * s if inner else 0.0, 0.0 if inner else s * s
            if share[i, k] > 0:
                strength = max(strength, square[j] / max(s, 0.5))
        _put_equations(columns, weights, matrix, rows)
        if not outside > 0.5 or not _solved(matrix, rows):
            moved[i] = 0.0
            continue
        unit, start, slope = np.cbrt(size * size), 0.0, 0.0
        for _ in range(3):  # K^2 times the size, by which gaps are compared with pressures
            start, slope, factor = 0.0, 0.0, np.cbrt(strength * strength) / unit
            for k in range(count):
                j = near[i, k]
                value = weights[k] * (square[j] if square[j] > 0 else -factor * gaps[j])
                for a in range(TERMS):
                    start += rows[a, 0] * columns[a, k] * value
                    slope += rows[a, 1] * columns[a, k] * value
            strength = slope if slope > 0 else strength
        beyond = start / slope if slope > 0 else 0.0
        moved[i] = min(max(beyond, -FARTHEST), FARTHEST) * size


@inlined
def _put_equations(columns: ndarray, weights: ndarray, matrix: ndarray, rows: ndarray) -> None:
    """Normal equations for the value and the slope on the line."""
    trace = 0.0
    for a in range(TERMS):
        for b in range(a + 1):
            total = 0.0
            for k in range(len(weights)):
                total += columns[a, k] * columns[b, k] * weights[k]
            matrix[a, b] = total
        trace += matrix[a, a]
        rows[a, 0], rows[a, 1] = 0.0, 0.0
    for a in range(TERMS):
        matrix[a, a] += RIDGE * trace
    rows[0, 0], rows[1, 1] = 1.0, 1.0


@compiled
def _solved(matrix: ndarray, rows: ndarray) -> bool:
    """Solve a few equations by the lower half of their positive matrix, after Cholesky."""
    n = len(matrix)
    for a in range(n):
        for b in range(a + 1):
            total = matrix[a, b]
            for k in range(b):
                total -= matrix[a, k] * matrix[b, k]
            if a > b:
                matrix[a, b] = total / matrix[b, b]
            elif total > 0.0:
                matrix[a, a] = np.sqrt(total)
            else:
                return False
    for k in range(rows.shape[1]):
        for a in range(n):
            for b in range(a):
                rows[a, k] -= matrix[a, b] * rows[b, k]
            rows[a, k] /= matrix[a, a]
        for a in range(n - 1, -1, -1):
            for b in range(a + 1, n):
                rows[a, k] -= matrix[b, a] * rows[b, k]
            rows[a, k] /= matrix[a, a]
    return True
