"""Figure 15: the nodes of either grid around a node of the other.

The Postprocessor compares the value at a node with the mean of those around it: each node Q_j of
grid B has the corners of its cell of grid A around it, and each inner node P_i of A those of its
cell of B. In homogeneous rectangular grids they are four with a quarter each; nodes at the edge of
A have none. The coefficients of any couple are mean value coordinates, see `Neighbours`.
"""

from dataclasses import dataclass

import numpy as np
from gallery import dots, legend_below, run, segments, sheet

from skfem_dual import GridCouple, rectangular_couple
from skfem_dual.post.functional import Neighbours
from skfem_dual.visuals.style import DUAL, OUTLINE, PRIMAL


@dataclass(frozen=True)
class Result:
    """The couple, who is around whom, and the nodes drawn, one of each grid."""

    couple: GridCouple
    neighbours: Neighbours
    drawn: tuple[int, int]

    @property
    def around(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes of B around that of A drawn, and of A around that of B, from the upper left."""
        rows = zip(
            (self.neighbours.alpha, self.neighbours.beta),
            self.drawn,
            (self.couple.b.polygons.p, self.couple.a.polygons.p),
            strict=True,
        )
        found = []
        for matrix, node, p in rows:
            nodes = matrix[[node]].indices
            x, y = p[:, nodes] - p[:, nodes].mean(axis=1, keepdims=True)
            found.append(nodes[np.argsort((3 * np.pi / 4 - np.arctan2(y, x)) % (2 * np.pi))])
        return found[0], found[1]

    def __str__(self) -> str:
        inner = self.neighbours.inner
        rows = [
            f"nodes of {name}: {len(has)}, with neighbours {has.sum()}"
            for name, has in zip("AB", inner, strict=True)
        ]
        i, j = self.drawn
        a, b = self.around
        rows += [f"P_{i}: Q at {a.tolist()}", f"Q_{j}: P at {b.tolist()}"]
        weights = np.unique(np.hstack([self.neighbours.alpha.data, self.neighbours.beta.data]))
        return "\n".join(
            [*rows, f"coefficients: {', '.join(f'{w:g}' for w in weights.round(12))}"]
        )


def main(k: int = 5) -> Result:
    """A homogeneous grid of k x k nodes and the one of its barycentres."""
    couple = rectangular_couple(range(k), range(k))
    nodes = [
        int(np.argmin(np.hypot(*(grid.polygons.p - np.array(place)[:, None]))))
        for grid, place in ((couple.a, (k - 2.0, 1.0)), (couple.b, (0.5, k - 2.5)))
    ]
    return Result(couple, Neighbours.of(couple), (nodes[0], nodes[1]))


def visualize(result: Result):
    """Both grids, and the stars of two nodes."""
    ax, a, b = sheet(4.2), result.couple.a, result.couple.b
    segments(ax, a.polygons.p, a.facets, PRIMAL, 1.2, label="grid A")
    segments(ax, b.polygons.p, b.facets, DUAL, 1.0, "--", label="grid B")
    dots(ax, a.polygons.p, OUTLINE, 4)
    dots(ax, b.polygons.p, DUAL, 4)
    around_a, around_b = result.around
    i, j = result.drawn
    star(ax, b.polygons.p[:, j], a.polygons.p[:, around_b], OUTLINE, "$Q_j$", "$P_{{i{}}}$")
    star(ax, a.polygons.p[:, i], b.polygons.p[:, around_a], DUAL, "$P_i$", "$Q_{{j{}}}$")
    legend_below(ax)
    return {"neighbour_nodes": ax}


def star(ax, centre, around, color: str, name: str, names: str) -> None:
    """A node, arrows to it from those around it, and their names."""
    other = DUAL if color == OUTLINE else OUTLINE
    note = {"ha": "center", "va": "center", "zorder": 5, "fontsize": 12.5, "color": OUTLINE}
    for k, place in enumerate(around.T, 1):
        arrow = {"arrowstyle": "-|>", "color": color, "lw": 1.3, "shrinkA": 4, "shrinkB": 5}
        ax.annotate("", centre, place, arrowprops=arrow, zorder=4)
        ax.text(*(place + np.sign(place - centre) * [0.1, 0.16]), names.format(k), **note)
    dots(ax, around, color, 8)
    dots(ax, centre[:, None], other, 8)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    ax.text(centre[0] + 0.28, centre[1], name, bbox=box, **note)


if __name__ == "__main__":
    run(main, visualize)
