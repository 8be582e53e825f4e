"""Lines of equal values on triangles, and where to label them."""

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .field import Field

#: width of a letter, margins beside a label and its height with those above and below it, in
#: heights of a letter
WIDTH, PAD, HEIGHT = 0.66, 0.5, 1.3
#: a line with a label is so many times as long as half the label
LONG = 7.0
NO_MARKS = np.empty((2, 0))
#: how often corners of an edge of contact are cut
CUTS = 3


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


def label_boxes(
    field: Field, levels: ndarray, texts: list[str], letter: float, marks: ndarray = NO_MARKS
) -> dict[int, ndarray]:
    """Room for the label of each level, upright and on one of its lines.

    A box is inside the field, and neither other labels nor lines of other levels nor the edge
    run through it, and marks are as far off. A level has no label if there is no such place.

    Parameters
    ----------
    field : Field
        A continuous field.
    levels : (n,) array of float
        The levels.
    texts : list of str
        The labels.
    letter : float
        Height of a letter, in units of the coordinates.
    marks : (2, k) array of float
        Middles of marks, up to a letter wide.

    Returns
    -------
    dict
        From the number of the level to the lower left and the upper right corner, shape (2, 2).
    """
    lines = [isoline(field, level) for level in levels]
    edge = samples(field.p[:, field.outline].transpose(0, 2, 1), letter / 4)
    drawn = [samples(segments, letter / 4) for segments, _ in lines]
    longest, lengths = zip(*(_longest(*line) for line in lines), strict=True)
    half = letter / 2 * np.array([[WIDTH * len(text) + PAD, HEIGHT] for text in texts])
    found: dict[int, ndarray] = {}
    for i in np.argsort(lengths).tolist():  # short lines choose first
        if lengths[i] < LONG * half[i, 0]:
            continue
        scale = half[i, :, None]
        candidates = samples(longest[i], letter / 4)
        candidates = candidates[:, :: max(1, candidates.shape[1] // 500)]
        others = np.hstack([edge, *drawn[:i], *drawn[i + 1 :]])
        clear = _off(others, candidates, scale)
        clear = np.minimum(clear, _off(marks, candidates, scale + letter / 2))
        apart = np.full(candidates.shape[1], np.inf)
        for box in found.values():
            centre, size = box.mean(axis=1), np.ptp(box, axis=1) / 2
            reach = abs(candidates - centre[:, None]) / (half[i] + size)[:, None]
            apart = np.minimum(apart, reach.max(axis=0))
        room = (clear > 1.1) & (apart > 1.2)
        if room.any():
            liking = np.minimum(clear, 2) + np.minimum(apart / 4, 1)
            best = candidates[:, np.argmax(np.where(room, liking, -np.inf))]
            found[i] = best[:, None] + half[i][:, None] * [-1, 1]
    return found


def _off(points: ndarray, candidates: ndarray, half: ndarray) -> ndarray:
    """How far boxes in the candidates are off all points, in their half widths and heights."""
    return cKDTree((points / half).T).query((candidates / half).T, p=np.inf)[0]


def _longest(segments: ndarray, lines: ndarray) -> tuple[ndarray, float]:
    """The segments of the longest line, and its length."""
    length = np.bincount(lines, np.hypot(*(segments[..., 1] - segments[..., 0])), minlength=1)
    return segments[:, lines == length.argmax()], float(length.max())


def within(segments: ndarray, low: ndarray, high: ndarray) -> ndarray:
    """The parts of segments, (2, n, 2), inside a box; those with ends that are no numbers are
    left out."""
    a, b = segments[..., 0], segments[..., 1]
    way = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = ((corner[:, None] - a) / way for corner in (low, high))
    enter = np.fmin(first, last).max(axis=0).clip(0.0, 1.0)  # along an axis nothing or inf
    leave = np.fmax(first, last).min(axis=0).clip(0.0, 1.0)
    inside = enter < leave  # false of what is no number
    a, way = a[:, inside], way[:, inside]
    return np.stack([a + enter[inside] * way, a + leave[inside] * way], axis=-1)


def samples(segments: ndarray, step: float) -> ndarray:
    """Points along segments, shape (2, n, 2), not farther apart than a step."""
    a, b = segments[..., 0], segments[..., 1]
    pieces = np.maximum(1, np.ceil(np.hypot(*(b - a)) / step).astype(int))
    segment = np.repeat(np.arange(len(pieces)), pieces)
    k = np.arange(len(segment)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return a[:, segment] + (k + 0.5) / pieces[segment] * (b - a)[:, segment]


def smooth_line(line: ndarray) -> ndarray:
    """An edge of contact without the kinks it has from triangle to triangle.

    By means of neighbouring points, between which corners are cut again and again: unlike splines
    that stays near them.

    Source: G. Chaikin, An algorithm for high speed curve generation, Computer Graphics and Image
    Processing 3 (1974).

    Parameters
    ----------
    line : (2, k) array of float
        Points in order; a closed line ends where it begins.

    Returns
    -------
    (2, n) array of float
        With the same ends, or closed.
    """
    step = np.hypot(*np.diff(line, axis=1))
    # around whole cells most of the points lie at corners, next to each other
    usual = np.median(step[step >= 1e-3 * step.max()])
    kept = np.append(True, step > 0.2 * usual)
    if not kept[-1]:  # but the end instead of the one before it
        kept[np.nonzero(kept)[0][-1]], kept[-1] = False, True
    x = line[:, kept]
    if x.shape[1] < 6:
        return line
    closed = bool(np.all(line[:, 0] == line[:, -1]))
    x = x[:, :-1] if closed else x

    def nearer(x: ndarray, share: float) -> ndarray:
        """Points so much nearer to the middle between their neighbours; ends stay."""
        middle = (np.roll(x, 1, axis=1) + np.roll(x, -1, axis=1)) / 2
        if not closed:
            middle[:, [0, -1]] = x[:, [0, -1]]
        return x + share * (middle - x)

    # a bend is none of the kinks: what it loses by both steps is given back
    x = nearer(x, 0.5)
    x = 2 * x - nearer(x, 0.5)
    x = 2 * x - nearer(x, 0.25)
    begin, end = x[:, :1], x[:, -1:]
    for _ in range(CUTS):
        a, b = (x, np.roll(x, -1, axis=1)) if closed else (x[:, :-1], x[:, 1:])
        x = np.stack([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b], axis=2).reshape(2, -1)
    return np.hstack([x, x[:, :1]] if closed else [begin, x, end])
