"""Pictures of the ground below the surface, drawn with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy import ndarray

from ..arguments import checked_instance
from ..solutions.below import Profile
from .axes import checked_axes, inked, letter, pyplot
from .curves import LINES
from .offscreen import one_at_a_time
from .style import OUTLINE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: of lines at zero
GREY = "#b8b8b8"


@one_at_a_time
def plot_profile(profile: Profile, *, title: str | None = None) -> Axes:
    """Plot stresses, vertical strain and settlement over the depth below a point.

    Parameters
    ----------
    profile : Profile
        From `vertical_profile`.
    title : str, optional
        Above the panels.

    Returns
    -------
    Axes
        The first of three panels of a new figure: sigma_z, sigma_x and sigma_y, compression
        positive; the vertical strain; the settlement. Lines across them are interfaces, at which
        curves may jump.

    Raises
    ------
    ImportError
        If matplotlib is missing.
    TypeError
        If ``profile`` is something else.
    ValueError
        If it has fewer than two depths.
    """
    checked_instance("profile", profile, Profile, "make one by vertical_profile")
    if len(profile.depth) < 2:
        raise ValueError(f"expected at least 2 depths to plot, got {len(profile.depth)}")
    plt = pyplot()
    figure, axes = plt.subplots(1, 3, figsize=(7.6, 4.4), sharey=True, layout="compressed")
    order = np.argsort(profile.depth)
    stress = profile.stresses
    panels = [
        ("stress", [(r"$\sigma_z$", stress.sigma_z), (r"$\sigma_x$", stress.sigma_x),
                    (r"$\sigma_y$", stress.sigma_y)]),
        ("vertical strain", [(r"$\varepsilon_z$", profile.strain)]),
        ("settlement", [("$u_z$", profile.displacement[2])]),
    ]  # fmt: skip
    depth, parts = profile.depth[order], _between(profile.depth[order], profile.interfaces)
    for ax, (name, curves) in zip(axes, panels, strict=True):
        for (color, style), (label, values) in zip(LINES, curves, strict=False):
            ink = inked(ax, color)
            for i, part in enumerate(parts):
                own = values[order][part]
                marker = "." if own.size == 1 else None  # a line of one point is none
                entry = label if i == 0 else None
                ax.plot(own, depth[part], style, color=ink, label=entry, marker=marker)
        for interface in profile.interfaces[profile.interfaces < depth[-1]]:
            ax.axhline(interface, color=OUTLINE, linewidth=0.8, linestyle=(0, (6, 3)))
        ax.axvline(0, color=GREY, linewidth=0.8, zorder=0)
        ax.set_xlabel(name)
        ax.xaxis.tick_top()
        ax.xaxis.set_label_position("top")
        ax.ticklabel_format(axis="x", scilimits=(-2, 4))
        ax.locator_params(axis="x", nbins=4)
        ax.spines[["bottom", "right"]].set_visible(False)
        ax.show = plt.show
    axes[0].legend(frameon=False, fontsize=letter(0.9))
    axes[0].set_ylim(depth[-1], 0)
    axes[0].set_ylabel("depth")
    if title is not None:
        figure.suptitle(title, fontsize=letter(1.1))
    return axes[0]


def _between(depth: ndarray, interfaces: ndarray) -> list[ndarray]:
    """Indices of ascending depths, layer by layer; in an interface those of the upper one."""
    layer = np.searchsorted(interfaces, depth)
    return [part for i in range(len(interfaces) + 1) if len(part := np.nonzero(layer == i)[0])]


@one_at_a_time
def draw_interfaces(ax: Axes, interfaces: ndarray) -> None:
    """Draw the interfaces of layers into a picture of a vertical section.

    Parameters
    ----------
    ax : Axes
        Of a picture of `vertical_section`, such as of `isobars`.
    interfaces : (k,) array of float
        Their depths, positive; those below the section are left out.

    Raises
    ------
    TypeError
        If ``ax`` is something else.
    """
    if checked_axes(ax) is None:
        raise TypeError("expected matplotlib's Axes for ax, got None")
    bottom = min(ax.get_ylim())
    for depth in np.asarray(interfaces):
        if -depth > bottom:
            ax.axhline(-depth, color=OUTLINE, linewidth=1.2, linestyle=(0, (6, 3)), zorder=3)
