"""Figures 17-19: three functions, their values with random errors, and the smoothed ones.

Values on 11 x 11 and 10 x 10 nodes of two dual rectangular grids carry errors uniform in [-q, q].
The Postprocessor with the paper's weights, and with the ratio of weights that generalised
cross-validation finds from the data alone.
"""

from dataclasses import dataclass

import numpy as np
from gallery import panels, run, sheet, without_axes

from skfem_dual import GridCouple, rectangular_couple
from skfem_dual.post.smooth import SmoothedCouple, joined_field, smooth_couple

#: function, bound of the errors, weights W1 and W2
FUNCTIONS = {
    "(x - 0.5)(y - 0.5)": (lambda x: (x[0] - 0.5) * (x[1] - 0.5), 0.06, (16, 256)),
    "x² + y²": (lambda x: x[0] ** 2 + x[1] ** 2, 0.03, (64, 64)),
    "sin πx cos πy": (lambda x: np.sin(np.pi * x[0]) * np.cos(np.pi * x[1]), 0.06, (64, 16)),
}


@dataclass(frozen=True)
class Result:
    """For each function: exact, with errors, and smoothed by the paper's weights and by GCV."""

    couple: GridCouple
    exact: dict[str, tuple[np.ndarray, np.ndarray]]
    old: dict[str, tuple[np.ndarray, np.ndarray]]
    paper: dict[str, SmoothedCouple]
    found: dict[str, SmoothedCouple]

    def rms(self, name: str, values) -> float:
        """Root mean square of errors at all nodes."""
        return float(
            np.sqrt(np.mean((np.hstack(list(values)) - np.hstack(self.exact[name])) ** 2))
        )

    def __str__(self) -> str:
        rows = []
        for name in self.exact:
            old, paper, found = (
                self.rms(name, v[name]) for v in (self.old, self.paper, self.found)
            )
            ratio = self.found[name].weights.D1
            rows.append(
                f"{name:<20}rms {old:.4f} -> {paper:.4f} (weights of the paper), {found:.4f} "
                f"(cross-validation, D : A = {ratio:.3g})"
            )
        return "\n".join(rows)


def main(k: int = 11, seed: int = 0) -> Result:
    """Smooth the three functions."""
    lines = np.linspace(0, 1, k)
    couple = rectangular_couple(lines, lines)
    points = couple.a.polygons.p, couple.b.polygons.p
    rng = np.random.default_rng(seed)
    exact, old, paper, found = {}, {}, {}, {}
    for name, (function, q, weights) in FUNCTIONS.items():
        exact[name] = function(points[0]), function(points[1])
        old[name] = tuple(e + rng.uniform(-q, q, len(e)) for e in exact[name])
        paper[name] = smooth_couple(*old[name], couple, weights)
        found[name] = smooth_couple(*old[name], couple)
    return Result(couple, exact, old, paper, found)


def visualize(result: Result):
    """Each function with random errors on the left half, smoothed on the right; the exact one."""
    pictures = {}
    for i, name in enumerate(result.exact, 1):
        values = [v[name] for v in (result.exact, result.old, result.paper, result.found)]
        e = [joined_field(result.couple, *v) for v in values]
        levels = np.linspace(e[0][1].min(), e[0][1].max(), 12)[1:-1]
        before, after = (result.rms(name, values[k]) for k in (1, 3))
        ax = pictures[f"f{i}"] = sheet(3.6)
        draw_halves(ax, e[1], e[3], levels)
        ax.set_title(f"{name}\nerror {before:.3f}         smoothed {after:.3f}")
    for i, name in enumerate(result.exact, 1):
        axes = panels(1, 2, 2.9)
        for ax, v, title in zip(axes, (result.exact, result.paper), ("exact", "paper's weights")):
            field = joined_field(result.couple, *v[name])
            exact = np.hstack(result.exact[name])
            levels = np.linspace(exact.min(), exact.max(), 12)[1:-1]
            contours(ax, field, levels)
            without_axes(ax, title)
        pictures[f"f{i}_exact"] = axes[0]
    return pictures


def contours(ax, field, levels) -> list:
    """Bands and lines of a field."""
    basis, f = field
    place = (*basis.mesh.p, basis.mesh.t.T)
    bands = ax.tricontourf(*place, f, levels=levels, cmap="viridis", extend="both", alpha=0.8)
    ax.set_aspect("equal")
    return [bands, ax.tricontour(*place, f, levels=levels, colors="#1a1a1a", linewidths=0.9)]


def draw_halves(ax, left, right, levels) -> None:
    """Two fields, each in its half of the unit square."""
    from matplotlib.patches import Rectangle

    for field, x in ((left, 0.0), (right, 0.5)):
        half = Rectangle((x, 0), 0.5, 1, transform=ax.transData)
        for lines in contours(ax, field, levels):
            lines.set_clip_path(half)
    ax.axvline(0.5, color="white", lw=2)


if __name__ == "__main__":
    run(main, visualize)
