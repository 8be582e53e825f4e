"""What the triangles of one grid and the convex cells of another have in common.

Every overlap is a convex polygon: the triangle clipped by the sides of the cell (Sutherland and
Hodgman, Communications of the ACM 17, 1974). It is cut into triangles, given by barycentric
coordinates of the first triangle, so that what vanishes on its sides vanishes there exactly.
"""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..grids.nearby import in_circles
from ..kernels.compiled import compiled, inputs
from .graded_rule import area_of

#: distances that count as zero, over the size of a triangle
ROUNDING = 1e-12
#: circles that touch meet, whatever the rounding
MORE = 1 + 1e-9
#: pairs clipped at a time
CHUNK = 2**18


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Triangles, each in one triangle of the first grid and in one cell of the second.

    Attributes
    ----------
    first : (k,) array of int
        Triangle of the first grid.
    second : (k,) array of int
        Cell of the second grid.
    vertices : (3, 3, k) array of float
        Barycentric coordinates in the triangle of the first grid, first axis, of the three
        vertices, second axis.
    """

    first: ndarray
    second: ndarray
    vertices: ndarray

    @property
    def share(self) -> ndarray:
        """Area of each over that of its triangle of the first grid."""
        return area_of(self.vertices)


def overlaps(triangles: ndarray, cells: ndarray) -> Overlaps:
    """Cut triangles along the sides of convex cells.

    Parameters
    ----------
    triangles : (2, 3, m) array of float
        Vertices of triangles of positive area.
    cells : (2, k, n) array of float
        Vertices of convex triangles (k = 3) or quadrilaterals (k = 4) in either sense.
    """
    middle = triangles.mean(axis=(1, 2))[:, None, None]
    triangles, cells = triangles - middle, ordered(cells - middle)
    at, beside = neighbours(triangles, cells)
    none = np.empty(0, dtype=np.int64)
    parts = [(none, none, np.empty((3, 3, 0)))]
    for start in range(0, len(at), CHUNK):
        i, j = at[start : start + CHUNK], beside[start : start + CHUNK]
        found = np.zeros((len(i), 7, 3))
        count = np.zeros(len(i), dtype=np.int64)
        arrays = triangles.transpose(2, 1, 0), cells.transpose(2, 1, 0)
        _clip(*inputs(i, j, *arrays), np.abs(middle).sum(), ROUNDING, found, count)
        for k in range(2, 7):  # the fan of triangles around the first vertex
            own = np.nonzero(count > k)[0]
            parts.append((i[own], j[own], found[own][:, [0, k - 1, k]].transpose(2, 1, 0)))
    first, second, vertices = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
    pieces = Overlaps(first, second, vertices)
    order = np.nonzero(pieces.share > 1e-14)[0]
    order = order[np.argsort(first[order], kind="stable")]
    return Overlaps(first[order], second[order], vertices[..., order])


def ordered(cells: ndarray) -> ndarray:
    """Convex cells with their vertices counter-clockwise."""
    arm = cells - cells.mean(axis=1, keepdims=True)
    order = np.argsort(np.arctan2(arm[1], arm[0]), axis=0)
    return np.take_along_axis(cells, order[None], axis=1)


def neighbours(triangles: ndarray, cells: ndarray) -> tuple[ndarray, ndarray]:
    """Pairs of triangles and cells whose circles around their middles meet."""
    (x, r), (y, s) = _circles(triangles), _circles(cells)
    found = [np.empty((2, 0), dtype=np.int64)]
    size = np.floor(np.log2(s))
    for each in np.unique(size):  # cells of about one size at a time
        members = np.nonzero(size == each)[0]
        points, offsets = in_circles(MORE * (r + s[members].max()), x, y[:, members])
        at, beside = np.repeat(np.arange(len(r)), np.diff(offsets)), members[points]
        meet = np.hypot(*(x[:, at] - y[:, beside])) <= MORE * (r[at] + s[beside])
        found.append(np.stack([at[meet], beside[meet]]))
    at, beside = np.hstack(found)
    return at, beside


def _circles(v: ndarray) -> tuple[ndarray, ndarray]:
    middle = v.mean(axis=1)
    return middle, np.hypot(*(v - middle[:, None])).max(axis=0)


@compiled
def _clip(at, beside, triangles, cells, away, rounding, found, count):
    a = np.empty((8, 3))
    b = np.empty((8, 3))
    d = np.empty(8)
    corners = np.empty(3)
    for pair in range(at.shape[0]):
        v, c = triangles[at[pair]], cells[beside[pair]]
        size = max(abs(v[1, 0] - v[0, 0]) + abs(v[1, 1] - v[0, 1]),
                   abs(v[2, 0] - v[0, 0]) + abs(v[2, 1] - v[0, 1]))  # fmt: skip
        tiny = rounding * (size + 1e-3 * (away + abs(v[0, 0]) + abs(v[0, 1])))
        n = 3
        a[:3] = 0.0
        for i in range(3):
            a[i, i] = 1.0
        for side in range(c.shape[0]):
            onward = (side + 1) % c.shape[0]
            tx, ty = c[onward, 0] - c[side, 0], c[onward, 1] - c[side, 1]
            length = np.sqrt(tx * tx + ty * ty)
            if length <= tiny:
                continue
            for i in range(3):
                corners[i] = tx * (v[i, 1] - c[side, 1]) - ty * (v[i, 0] - c[side, 0])
                corners[i] /= length
                if abs(corners[i]) <= tiny:
                    corners[i] = 0.0
            for i in range(n):
                d[i] = a[i, 0] * corners[0] + a[i, 1] * corners[1] + a[i, 2] * corners[2]
                if abs(d[i]) <= tiny:
                    d[i] = 0.0
            m = 0
            for i in range(n):
                last = (i - 1) % n
                if (d[i] > 0 and d[last] < 0) or (d[i] < 0 and d[last] > 0):
                    s = d[last] / (d[last] - d[i])
                    for k in range(3):
                        b[m, k] = a[last, k] + s * (a[i, k] - a[last, k])
                    m += 1
                if d[i] >= 0:
                    for k in range(3):
                        b[m, k] = a[i, k]
                    m += 1
            n, a, b = m, b, a
            if n < 3:
                break
        if n >= 3:
            count[pair] = n
            for i in range(n):
                for k in range(3):
                    found[pair, i, k] = a[i, k]
