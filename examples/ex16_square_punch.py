"""Figure 16: isobars under an eccentrically loaded square before and after the Postprocessor.

A square punch 2a x 2a under P = E0 a^2 at (0.1 a, 0.15 a), on ground with E = E0 (1 + B z / h),
B = 1, h / a = 1, nu = 1/4. Grid A has 8 x 8 nodes, grid B the 7 x 7 barycentres of its cells.
Pressures are constant in the 49 cells of A and in the 64 cells around the nodes of A, as in the
paper, whose weights W1 = 256, W2 = 16 smooth all 113 values. "A considerable smoothing" they give
only if the last term of the functional has sums of four new values; with means, as it is printed,
hardly anything changes. `Weights.init_paper` has both readings, and Table 2 tells the same.
"""

from dataclasses import dataclass

import numpy as np
from gallery import run, sheet, without_axes
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import GradedHalfSpace, PunchSolution, RigidPunch, rectangular_couple
from skfem_dual.post.functional import Weights
from skfem_dual.post.smooth import SmoothedCouple, joined_field, smooth_couple

#: of the isobars
LEVELS = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.3, 1.6, 2.0])
SOIL = GradedHalfSpace.init_linear(young=1.0, poisson=0.25, gradient=1.0)


@dataclass(frozen=True)
class Result:
    """Both solutions, their pressures over the mean, and the smoothed ones by the reading."""

    around_nodes: PunchSolution
    in_cells: PunchSolution
    old: tuple[np.ndarray, np.ndarray]
    smoothed: dict[str, SmoothedCouple]

    def __str__(self) -> str:
        rows = [f"{len(self.old[0]) + len(self.old[1])} values"]
        for s in (self.around_nodes, self.in_cells):
            rows.append(f"W0 / a = {s.settlement:.5f}, tilt = ({s.tilt[0]:.5f}, {s.tilt[1]:.5f})")
        rows.append(f"disagreement of neighbours: {disagreement(self, *self.old):.3f}")
        for reading, new in self.smoothed.items():
            rows.append(f"W1 = 256, W2 = 16, {reading}: {disagreement(self, *new):.3f}")
        return "\n".join(rows)


def disagreement(result: Result, F, G) -> float:
    """Root mean square of values at inner nodes of A minus the means of B around them."""
    around = next(iter(result.smoothed.values())).grids.around_a
    inner = np.diff(around.indptr) == 4
    return float(np.sqrt(np.mean((F - around @ G / 4)[inner] ** 2)))


def solve(lines) -> PunchSolution:
    """Constant pressures on the rectangles between lines."""
    basis = CellBasis(MeshQuad.init_tensor(lines, lines), ElementQuad0())
    return RigidPunch(SOIL, basis, edge="constant").solve(1.0, (0.1, 0.15))


def at(solution: PunchSolution, points):
    """Pressures over the mean, of the cells that contain points."""
    return solution.pressure_at(points) / solution.mean_pressure


def main() -> Result:
    """Solve on both grids and smooth with the paper's weights in both readings."""
    lines = np.linspace(-1, 1, 8)
    couple = rectangular_couple(lines, lines)
    halfway = np.concatenate([[-1], (lines[1:] + lines[:-1]) / 2, [1]])
    around_nodes, in_cells = solve(halfway), solve(lines)
    old = at(around_nodes, couple.a.polygons.p), at(in_cells, couple.b.polygons.p)
    smoothed = {
        reading: smooth_couple(*old, couple, Weights.init_paper(256, 16, last=reading))
        for reading in ("sums", "means")
    }
    return Result(around_nodes, in_cells, old, smoothed)


def visualize(result: Result):
    """Isobars before the Postprocessor on the left half, after it on the right; all of them."""
    from skfem_dual.visuals.matplotlib import isobars

    couple = next(iter(result.smoothed.values())).grids
    before = joined_field(couple, *result.old)
    after = {name: new.field() for name, new in result.smoothed.items()}
    pictures = {"before_and_after": draw_halves(before, next(iter(after.values())))}
    for title, (basis, p) in {"before": before, **after}.items():
        ax = pictures[title] = sheet()
        isobars(basis, p, LEVELS, title="p / mean p", ax=ax)
        without_axes(ax, title if title == "before" else f"after, last term with {title}")
    return pictures


def draw_halves(left, right):
    """One square of two fields, each in its half."""
    from matplotlib.patches import Rectangle

    from skfem_dual.visuals.matplotlib import isobars

    ax = sheet(3.5)
    for (basis, p), x, title in ((left, -1, "before"), (right, 0, "after")):
        old = set(ax.get_children())
        isobars(basis, p, LEVELS, title="p / mean p" if x else "", labels=False, ax=ax)
        half = Rectangle((x, -1), 1, 2, transform=ax.transData)
        for artist in set(ax.get_children()) - old:
            artist.set_clip_path(half)
            if not x and getattr(artist, "colorbar", None):
                artist.colorbar.remove()  # one scalar bar does for both
        ax.text(x + 0.5, 1.06, title, ha="center")
    ax.axvline(0, color="white", lw=2)
    ax.set_axis_off()
    return ax


if __name__ == "__main__":
    run(main, visualize)
