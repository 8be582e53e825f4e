"""Outlines of plans, drawn with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from ..plans.plan import Plan
from ..plans.rings import SMOOTH, Ring
from .axes import prepared
from .offscreen import one_at_a_time
from .style import OUTLINE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: radians of an arc between points it is drawn through
STEP = np.pi / 90
#: more corners are not numbered
NUMBERED = 40


@one_at_a_time
def draw_plan(plan: Plan, ax: Axes | None = None) -> Axes:
    """The plan to scale, its corners numbered, and its centroid; see `Plan.plot`."""
    lines = [_line(ring) for ring in plan.rings]
    ax = prepared(ax, np.hstack(lines))
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    signs = [s for _, holes in plan.parts for s in (1, *[-1] * len(holes))]
    path = Path.make_compound_path(
        *(Path(x.T[::sign], closed=True) for x, sign in zip(lines, signs))
    )
    ax.add_patch(PathPatch(path, facecolor="#dfe6ee", edgecolor=OUTLINE, linewidth=1.4))
    ax.plot(*plan.centroid, "+", color=OUTLINE, markersize=9, label="centroid")
    if plan.corners.shape[1] <= NUMBERED:
        _number(plan, signs, ax)
    ax.margins(0.08)
    ax.ticklabel_format(style="plain", useOffset=False)  # site coordinates as they are
    ax.autoscale_view()
    return ax


def _number(plan: Plan, signs: list[int], ax: Axes) -> None:
    """Numbers of the corners, beside the plan."""
    away = []
    for sign, ring in zip(signs, plan.rings):
        onward = ring.sides.directions[0]
        inward = onward + (np.pi - ring.turns) / 2  # halves the angle of the ring
        there = np.abs(ring.turns) > SMOOTH
        away.append(-sign * 9 * np.stack([np.cos(inward), np.sin(inward)])[:, there])
    ax.plot(*plan.corners, ".", color=OUTLINE, markersize=5)
    for i, (x, step) in enumerate(zip(plan.corners.T, np.hstack(away).T)):
        ax.annotate(
            str(i), x, step, textcoords="offset points", ha="center", va="center", fontsize=8
        )


def _line(ring: Ring) -> ndarray:
    """Points along a ring, closed; shape (2, n)."""
    parts = np.ceil(np.abs(ring.sides.angle) / STEP).astype(int).clip(1)
    side = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(parts.sum()) - (np.cumsum(parts) - parts)[side]) / parts[side]
    x = ring.sides.at(side, share)
    return np.hstack([x, x[:, :1]])
