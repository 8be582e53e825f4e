"""Diagrams over numbers, and the kern of a plan, drawn with matplotlib."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import checked_instance, checked_text
from ..bodies.paths import MomentRotation
from ..bodies.punch import RigidPunch
from ..solutions.edge_coefficient import EdgeCoefficient
from .axes import diagram, draw_segments, inked, legend_below, letter, prepared
from .field import Field
from .offscreen import one_at_a_time
from .style import CONTACT, LIGHT, OUTLINE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: colours and dashes of curves in one picture, told apart in grey as well
LINES = ((OUTLINE, "-"), ("#c8401f", "--"), ("#2c6fbb", "-."), ("#7a7a7a", ":"))

#: part of the overturning moment up to which rotations are shown
SHOWN = 0.85


@one_at_a_time
def plot_edge(
    coefficient: EdgeCoefficient, *, title: str | None = None, ax: Axes | None = None
) -> Axes:
    """Plot the strength of the pressure's singularity along the contours of a plan.

    Parameters
    ----------
    coefficient : EdgeCoefficient
        From ``solution.edge_coefficient()``.
    title : str, optional
        Name and unit of the coefficient, beside its axis.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        One line for each contour over the length along it, the plan to the left.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError
        If ``coefficient`` is something else.
    """
    checked_instance("coefficient", coefficient, EdgeCoefficient)
    if title is not None:
        checked_text("title", title)
    ax = diagram(ax, (6.5, 3.8))
    contours = np.unique(coefficient.contour)
    for contour, (color, style) in zip(contours, cycle(LINES)):
        own, label = coefficient.contour == contour, f"contour {contour}"
        arc, values = coefficient.arc[own], coefficient.values[own]
        ax.plot(arc, values, style, color=inked(ax, color), label=label)
    if len(contours) > 1:
        ax.legend(frameon=False, fontsize=letter(0.9))
    ax.set_xlim(0, coefficient.arc.max())
    low, high = min(0, 1.1 * coefficient.values.min()), max(0, 1.1 * coefficient.values.max())
    if low < high:
        ax.set_ylim(low, high)
    ax.set_xlabel("length along the contour")
    ax.set_ylabel(title or r"$\lim\, p\,\sqrt{d}$")
    return ax


@one_at_a_time
def plot_kern(punch: RigidPunch, *, ax: Axes | None = None) -> Axes:
    """Draw the kern of a plan: under a force inside it the punch does not lift off.

    Parameters
    ----------
    punch : RigidPunch
        A flat punch.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        The outline of the plan, the kern and a cross where a force causes no tilt.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError
        If ``punch`` is something else.
    ValueError, ConvergenceError
        As `RigidPunch.kern`.
    """
    checked_instance("punch", punch, RigidPunch)
    corners = punch.kern() + np.array(punch.origin)[:, None]
    field = Field.from_basis(punch.basis, np.zeros(punch.basis.N))
    ax = prepared(ax, field.p)
    draw_segments(ax, field.p, field.outline, OUTLINE, 1.4)
    ax.fill(*corners, facecolor=LIGHT, edgecolor=CONTACT, linewidth=1.6, label="kern")
    stiffness = punch.stiffness()
    upright = stiffness[1:, 0] / stiffness[0, 0] + punch.origin
    ax.plot(*upright, "+", color=OUTLINE, markersize=7, label="force without tilt")
    legend_below(ax, 2)
    return ax


@one_at_a_time
def plot_moment_rotation(curve: MomentRotation, *, ax: Axes | None = None) -> Axes:
    """Plot the moment on a footing over its rotation, up to overturning.

    Parameters
    ----------
    curve : MomentRotation
        From `moment_rotation`.
    ax : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        Moment over the overturning moment against the rotation; of a flat footing also the start
        of lift-off, and the line of one that does not lift off. The rotation grows beyond all
        bounds: the axis ends at 85 % of the overturning moment, the curve goes on.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError
        If ``curve`` is something else.
    """
    checked_instance("curve", curve, MomentRotation)
    ax = diagram(ax, (6.2, 4.2))
    ink = inked(ax)
    note: dict[str, Any] = {"fontsize": letter(0.9), "color": ink}
    rotation, share = curve.rotation, curve.eccentricity / curve.overturning
    right = np.interp(SHOWN, share, rotation)
    ax.axhline(1.0, color=ink, linewidth=1, linestyle=":")
    ax.text(right, 1.01, "overturning", ha="right", va="bottom", **note)
    pulled = min(float(s.pressure.min()) for s in curve.solutions) < 0
    told = "ground pulls" if pulled else "ground does not pull"
    ax.plot(rotation, share, "-", color=ink, marker=".", label=told)
    if curve.lift_off > 0:
        # of a flat footing in full contact: linear in the eccentricity
        ends = np.array([curve.overturning, curve.lift_off]) * curve.direction[:, None]
        compliance = np.linalg.inv(curve[0].punch.stiffness())
        held, start = curve.direction @ (compliance @ [[1, 1], *ends])[1:] * curve[0].force
        ax.plot([rotation[0], held], [share[0], 1], "--", color="#7a7a7a", label="full contact")
        begin = curve.lift_off / curve.overturning
        ax.plot(start, begin, "o", color=CONTACT)
        ax.annotate(
            f"lift-off at {begin:.2f}",
            (start, begin),
            xytext=(10, -4),
            textcoords="offset points",
            va="top",
            **note,
        )
    if curve.lift_off > 0 or pulled:
        ax.legend(loc="lower right", frameon=False, fontsize=letter(0.9))
    ax.set_xlim(min(0, rotation.min()), right)
    ax.set_ylim(0, 1.08)
    ax.set_xlabel("rotation")
    ax.set_ylabel("moment / overturning moment")
    return ax
