"""Where contact ends, from pressures and gaps beside a line that is about there.

With the distance s to the edge of contact, ``p^2`` inside and ``gap^(2/3)`` outside are smooth
functions that vanish there, with slopes that depend on one strength K: see `ContactRegion`. Along
the line both are fitted to the cells around by polynomials in s, of second degree with a curvature
of its own on each side, and in the place along the line; their zero is the edge.
"""

import numpy as np
from numpy import ndarray

from ..grids.lines import Segments
from ..grids.nearest import nearest
from .planes import PlaneFit

#: pairs of neighbours, one in contact, that tell the strength in a cell
AROUND = 7
#: cells a polynomial follows, and how much those in contact count: under what bends, the pressure
#: leaves its law sooner than the gap
FOLLOWED, INSIDE = 32, 0.03
#: points of a line over which its way is averaged
NEAREST = 3
#: of the normal equations, over their trace
RIDGE = 1e-7
#: the line moves by no more than this part of a cell
FARTHEST = 0.5
#: places on lines at a time, so that what they take stays in the cache
CHUNK = 1024


def edge_distance(
    n: int,
    pairs: ndarray,
    starts: ndarray,
    x: ndarray,
    sizes: ndarray,
    square: ndarray,
    gaps: ndarray,
) -> ndarray:
    """About the distance of cells to the edge of contact, positive in contact, in k pictures.

    Parameters
    ----------
    n : int
        Cells of each picture.
    pairs : (2, m) array of int
        Neighbours, one in contact and one not: their distances to the edge add up.
    starts : (k + 1,) array of int
        First pairs of the pictures.
    x, sizes, square, gaps
        As of `moved_line`.
    """
    inside, k = square > 0, len(starts) - 1
    firsts, each = n * np.arange(k + 1), np.repeat(np.arange(k), np.diff(starts))
    i = np.where(inside[pairs[0]], *pairs)
    j = pairs.sum(axis=0) - i
    step, middle = x[:, i] - x[:, j], (x[:, i] + x[:, j]) / 2
    around = min(AROUND, np.diff(starts).min())
    near = nearest(middle, starts, x, np.repeat(np.arange(k), n), around)[0]
    beside = nearest(x, firsts, middle, each, min(2 * AROUND, n))[0]
    across = 0.8 * np.hypot(*step)
    planes, distance = PlaneFit.to(x, middle, beside), np.empty(len(sizes))
    used = np.zeros(len(sizes), dtype=bool)
    used[beside] = True
    for some in (used, used, slice(None)):  # the direction across follows from the distances
        strength = np.median(_strength(square[i], gaps[j], across)[near[some]], axis=1)
        both = square[some] * strength**3, -gaps[some] * strength
        distance[some] = np.where(inside[some], *both)
        slope = planes(distance)[1:]
        normal = slope / np.hypot(*slope)
        across = np.maximum(np.sum(normal * step, axis=0), 0.3 * np.hypot(*step))
    return distance


def _strength(f: ndarray, g: ndarray, across: ndarray) -> ndarray:
    """The root z = K^(-2/3) of ``f z^3 + g z = across``, by Newton's method from above: from at
    most half as much again five steps lead to rounding."""
    with np.errstate(divide="ignore"):
        z = np.minimum(np.cbrt(across / f), across / g)
    for _ in range(5):
        z = z - (f * z**3 + g * z - across) / (3 * f * z**2 + g)
    return z


def moved_line(
    lines: Segments, starts: ndarray, x: ndarray, sizes: ndarray, square: ndarray, gaps: ndarray
) -> tuple[ndarray, ndarray]:
    """Points on lines and how far beyond them contact ends.

    Parameters
    ----------
    lines : Segments
        About where contact ends, in pictures.
    starts : (k + 1,) array of int
        First cells of the pictures.
    x : (2, n) array of float
        Collocation points of the cells.
    sizes : (n,) array of float
        Roots of their areas.
    square, gaps : (n,) array of float
        There the square of the pressure, and the power 2/3 of 3 E* / 4 times the gap, both over
        the law of the edge of the plan.

    Returns
    -------
    (2, m) and (m,) array of float
        Points and distances, positive where contact ends farther out.
    """
    along, picture = lines.end - lines.begin, lines.picture
    points, tangents = (lines.begin + lines.end) / 2, along / np.hypot(*along)
    near = nearest(x, starts, points, picture, min(FOLLOWED, np.diff(starts).min()))[0]
    used = np.zeros(x.shape[1], dtype=bool)
    used[near] = True
    of = np.repeat(np.arange(len(starts) - 1), np.diff(starts))[used]
    distance = np.empty(x.shape[1])
    distance[used] = lines.signed_distance(x[:, used], of)  # the region is to the left
    cells = x, sizes, distance, square, gaps
    moved = np.empty(len(near))
    for begin in range(0, len(moved), CHUNK):
        some = slice(begin, begin + CHUNK)
        around = (values[..., near[some]] for values in cells)
        moved[some] = _beyond(points[:, some], tangents[:, some], *around)
    return points, moved


def mean_of_nearest(
    lines: Segments, moved: tuple[ndarray, ndarray], at: ndarray, of: ndarray
) -> ndarray:
    """Mean of what `moved_line` has in the points nearest to others, ``of`` some pictures; zero
    in pictures without lines."""
    points, by = moved
    near, square = nearest(points, lines.starts, at, of, NEAREST)
    known = np.isfinite(square)
    return np.sum(np.append(by, 0.0)[near] * known, axis=1) / known.sum(axis=1).clip(1)


def _beyond(
    points: ndarray,
    tangents: ndarray,
    x: ndarray,
    sizes: ndarray,
    distance: ndarray,
    square: ndarray,
    gaps: ndarray,
) -> ndarray:
    """How far beyond m points contact ends, by the k cells around each; these as (..., m, k)."""
    inner = square > 0
    size = np.sqrt(np.median(sizes**2, axis=1))[:, None]
    arm = x - points[:, :, None]
    along = np.einsum("im,imk->mk", tangents, arm) / size
    s = distance / size
    squares = np.where(inner, s**2, 0.0), np.where(inner, 0.0, s**2)
    columns = np.stack([np.ones(s.shape), s, along, s * along, *squares], axis=1)
    # cells beyond a ridge of the distance, between two lines, count little
    weight = np.exp(-(np.sum((arm / size) ** 2, axis=0)) / 2) * np.where(inner, INSIDE, 1.0)
    weighted = columns * weight[:, None]
    matrix = weighted @ columns.swapaxes(1, 2)
    matrix += RIDGE * np.trace(matrix, axis1=1, axis2=2)[:, None, None] * np.eye(6)
    gaps = gaps / np.cbrt(size**2)
    # value and slope on the line by the values of the cells
    rows = np.linalg.inv(matrix)[:, :2] @ weighted
    strength = np.max(square / np.maximum(s, 0.5), axis=1)
    for _ in range(3):  # K^2 times the size, by which gaps are compared with pressures
        values = np.where(inner, square, -np.cbrt(strength**2)[:, None] * gaps)
        start, slope = (rows @ values[..., None])[..., 0].T
        strength = np.where(slope > 0, slope, strength)
    moved = np.divide(start, slope, out=np.zeros_like(start), where=slope > 0)
    known = np.sum(weight * ~inner, axis=1) > 0.5
    return np.where(known, moved.clip(-FARTHEST, FARTHEST), 0.0) * size[:, 0]
