"""Lines of equal values on triangles, and where to label them."""

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .field import Field

#: width and height of a label, in parts of the greater extent of the plan
LABEL_SIZE = (0.065, 0.032)


def isoline(field: Field, level: float) -> tuple[ndarray, ndarray]:
    """Where a continuous field takes the value ``level``.

    Returns
    -------
    segments : (2, n, 2) array of float
        Coordinates of both ends of one segment in each triangle that is crossed:
        ``segments[:, i, 0]`` to ``segments[:, i, 1]``.
    lines : (n,) array of int
        Number of the connected line each segment is part of.
    """
    above = field.values[field.t] > level
    triangle, side = np.nonzero((above != np.roll(above, -1, axis=0)).T)  # two in each triangle
    ends = np.sort([field.t[side, triangle], field.t[(side + 1) % 3, triangle]], axis=0)
    (p, q), (a, b) = field.p[:, ends].swapaxes(0, 1), field.values[ends]
    segments = (p + (level - a) / (b - a) * (q - p)).reshape(2, -1, 2)
    sides, number = np.unique(ends[0] * field.p.shape[1] + ends[1], return_inverse=True)
    joined = coo_array((np.ones(len(number) // 2), number.reshape(-1, 2).T), (len(sides),) * 2)
    return segments, connected_components(joined, directed=False)[1][number[::2]]


def label_points(field: Field, levels: ndarray) -> dict[int, ndarray]:
    """One point for the label of each level, on its longest line.

    Labels keep away from each other and from other lines. A level has no label if its lines
    are too short for one, or it would collide with another.

    Parameters
    ----------
    field : Field
        A continuous field.
    levels : (n,) array of float
        The levels.

    Returns
    -------
    dict
        From the number of the level to the coordinates, shape (2,).
    """
    # distances in label sizes from here on
    scale = np.ptp(field.p, axis=1).max() * np.array(LABEL_SIZE)[:, None]
    middles, longest, lengths = [], [], []
    for level in levels:
        segments, lines = isoline(field, level)
        middle = segments.mean(axis=2) / scale
        dx, dy = (segments[..., 1] - segments[..., 0]) / scale
        length = np.bincount(lines, weights=np.hypot(dx, dy), minlength=1)
        middles.append(middle)
        longest.append(middle[:, lines == length.argmax()])
        lengths.append(length.max())
    outline = field.p[:, field.outline].mean(axis=1) / scale

    anchors: dict[int, ndarray] = {}
    for i in np.argsort(lengths).tolist():  # short lines choose first
        if lengths[i] < 4:
            continue
        candidates = longest[i]
        candidates = candidates[:, :: max(1, candidates.shape[1] // 500)]
        others = np.hstack([outline, *middles[:i], *middles[i + 1 :]])
        clear = cKDTree(others.T).query(candidates.T, p=np.inf)[0]
        apart = np.full(candidates.shape[1], np.inf)
        for point in anchors.values():
            apart = np.minimum(apart, abs(candidates - point[:, None]).max(axis=0))
        best = np.argmax(np.minimum(clear, 1) + np.minimum(apart / 6, 1))
        if apart[best] > 1.2:
            anchors[i] = candidates[:, best]
    return {i: point * scale[:, 0] for i, point in anchors.items()}
