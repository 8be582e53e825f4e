"""Where contact ends, from pressures and gaps beside a line that is about there.

With the distance s to the edge of contact, ``p^2`` inside and ``gap^(2/3)`` outside are smooth
functions that vanish there, with slopes that depend on one strength K: see `ContactRegion`. Along
the line both are fitted to the cells around by polynomials in s, of second degree with a curvature
of its own on each side, and in the place along the line; their zero is the edge.
"""

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..grids.lines import segments, signed_distance

#: cells a polynomial follows, and how much those in contact count: under what bends, the pressure
#: leaves its law sooner than the gap
AROUND, INSIDE = 32, 0.03
#: of the normal equations, over their trace
RIDGE = 1e-7
#: the line moves by no more than this part of a cell
FARTHEST = 0.5
#: places on lines at a time, so that what they take stays in the cache
CHUNK = 1024


def moved_line(
    lines: list[ndarray], x: ndarray, sizes: ndarray, pressure: ndarray, opening: ndarray
) -> tuple[ndarray, ndarray]:
    """Points on lines and how far beyond them contact ends.

    Parameters
    ----------
    lines : list of (2, k) array of float
        About where contact ends.
    x : (2, n) array of float
        Collocation points of the cells.
    sizes : (n,) array of float
        Roots of their areas.
    pressure, opening : (n,) array of float
        Pressure and 3 E* / 4 times the gap there, both over the law of the edge of the plan.

    Returns
    -------
    (2, m) and (m,) array of float
        Points and distances, positive where contact ends farther out.
    """
    a, b = segments(lines)
    points, tangents = (a + b) / 2, (b - a) / np.hypot(*(b - a))
    near = cKDTree(x.T).query(points.T, min(AROUND, x.shape[1]))[1].reshape(points.shape[1], -1)
    used, unit = np.unique(near), pressure.max()
    distance = np.empty(x.shape[1])
    distance[used] = signed_distance(x[:, used], lines)  # the region is to the left
    gaps = (opening.clip(0) / unit) ** (2 / 3)
    cells = x, sizes, distance, (pressure / unit) ** 2, gaps
    moved = np.empty(len(near))
    for begin in range(0, len(moved), CHUNK):
        some = slice(begin, begin + CHUNK)
        around = (values[..., near[some]] for values in cells)
        moved[some] = _beyond(points[:, some], tangents[:, some], *around)
    return points, moved


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
