"""Ellipses and splines of drawings as arcs of circles.

Source: K. M. Bolton, Biarc curves, Computer-Aided Design 7 (1975): two arcs from one point to
another, along the tangents in both.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy import ndarray

from ..grids.planar import cross
from .sides import Sides

#: pieces of a span at most
MOST = 64
#: arcs stay within this part of the extent of the curve
CLOSE = 1e-4
#: tangents in the ends of spans are those so near them, over the span: a curve may turn there
BESIDE = 1e-6

#: points, and directions along the curve, at parameters; both (2, n)
Curve = Callable[[ndarray], tuple[ndarray, ndarray]]


def arcs_of(entity: Any) -> tuple[ndarray, ndarray, bool]:
    """Corners (2, n) of arcs along an ellipse or a spline, bulges of the sides that start there,
    and whether the last of them closes a ring.

    Arcs go on in their directions; there are so many that the curve is nowhere farther off them
    than `CLOSE`.
    """
    spans, curve = _ellipse(entity) if entity.dxftype() == "ELLIPSE" else _spline(entity)
    pieces, off, extent = 1, np.inf, 1.0
    while pieces <= MOST and off > CLOSE * extent:
        share = np.arange(pieces) / pieces
        begin = (spans[:-1, None] + np.diff(spans)[:, None] * share).ravel()
        length = np.repeat(np.diff(spans) / pieces, pieces)
        x = np.append(curve(begin)[0], curve(spans[-1:])[0], axis=1)
        moves = (np.diff(x, axis=1) != 0).any(axis=0)
        if not moves.any():
            return x[:, [0, -1]], np.zeros(2), False
        begin, length = begin[moves], length[moves]
        start, end = x[:, :-1][:, moves], x[:, 1:][:, moves]
        along, onward = (curve(begin + k * length)[1] for k in (BESIDE, 1 - BESIDE))
        sides, off = _biarcs(start, end, along, onward), 0.0
        first = 2 * np.arange(len(begin))
        for k in (0.25, 0.5, 0.75):
            between = curve(begin + k * length)[0]
            near = [sides.distance_to(between, first + i) for i in (0, 1)]
            off = max(off, float(np.minimum(*near).max(initial=0.0)))
        extent, pieces = np.ptp(x, axis=1).max(), 2 * pieces
    if np.hypot(*(x[:, -1] - x[:, 0])) <= CLOSE**2 * extent:
        return sides.start, sides.bulge, True
    return np.hstack([sides.start, x[:, -1:]]), np.append(sides.bulge, 0.0), False


def _biarcs(start: ndarray, end: ndarray, along: ndarray, onward: ndarray) -> Sides:
    """Two arcs each from starts to ends, in the directions ``along`` there and ``onward`` here."""
    v = end - start
    along, onward = (np.where(a.any(axis=0), a, v) for a in (along, onward))
    along, onward = along / np.hypot(*along), onward / np.hypot(*onward)
    twice, square = np.sum(v * (along + onward), axis=0), np.sum(v * v, axis=0)
    bent = 2 * (1 - np.sum(along * onward, axis=0)).clip(min=0.0)
    # of the two lengths of tangents up to the joint that with no division by what may be zero
    reach = square / (twice + np.sqrt(twice**2 + bent * square))
    joint = (start + end + reach * (along - onward)) / 2
    first, second = joint - start, end - joint
    bulges = [
        np.tan(np.arctan2(cross(a, b), np.sum(a * b, axis=0)) / 2)
        for a, b in ((along, first), (second, onward))
    ]
    starts = np.stack([start, joint], axis=2).reshape(2, -1)
    ends = np.stack([joint, end], axis=2).reshape(2, -1)
    return Sides(starts, ends, np.stack(bulges, axis=1).ravel())


def _ellipse(ellipse: Any) -> tuple[ndarray, Curve]:
    """Ends of quarters, and the curve."""
    begin = float(ellipse.dxf.start_param)
    turn = (float(ellipse.dxf.end_param) - begin) % (2 * np.pi) or 2 * np.pi
    quarters = int(np.ceil(2 * turn / np.pi - 1e-9))
    middle = _plane([ellipse.dxf.center])

    def curve(t: ndarray) -> tuple[ndarray, ndarray]:
        return _plane(ellipse.vertices(t)), _plane(ellipse.vertices(t + np.pi / 2)) - middle

    return begin + turn * np.linspace(0, 1, quarters + 1), curve


def _spline(spline: Any) -> tuple[ndarray, Curve]:
    """Knots, between which it is smooth, and the curve."""
    tool = spline.construction_tool()
    every = tool.knots()
    low, high = every[tool.degree], every[-1 - tool.degree]
    knots = np.unique(every)

    def curve(t: ndarray) -> tuple[ndarray, ndarray]:
        points, along = zip(*tool.derivatives(t, 1), strict=True)
        return _plane(points), _plane(along)

    return knots[(low <= knots) & (knots <= high)], curve


def _plane(points: Any) -> ndarray:
    return np.array([(p.x, p.y) for p in points], dtype=float).T
