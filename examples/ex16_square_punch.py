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
from gallery import panels, run
from skfem import CellBasis, ElementQuad0, MeshQuad

from skfem_dual import GradedHalfSpace, PunchSolution, RigidPunch, rectangular_couple
from skfem_dual.post.functional import Weights
from skfem_dual.post.smooth import SmoothedCouple, joined_field, smooth_couple

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
    """Isobars before and after."""
    from skfem_dual.visuals.matplotlib import isobars

    _, axes = panels(3, width=4.4, height=4.3)
    levels = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.3, 1.6, 2.0])
    couple = next(iter(result.smoothed.values())).grids
    fields = {"a) before": joined_field(couple, *result.old)}
    for letter, (reading, new) in zip("bc", result.smoothed.items(), strict=True):
        fields[f"{letter}) after, last term with {reading}"] = new.field()
    for ax, (title, (basis, p)) in zip(axes, fields.items(), strict=True):
        isobars(basis, p, levels, title="p / mean p", ax=ax)
        ax.set_title(title, fontsize=10)
    return {"square_punch": axes[0]}


if __name__ == "__main__":
    run(main, visualize)
