"""Table 2: values with random errors on two dual rectangular grids, before and after.

Three functions on 11 x 11 and 10 x 10 nodes, errors uniform in [-q, q]: root mean squares of the
errors before and after, mean and spread over many samples, beside the printed figures of one.

The last term of the functional is read in two ways: as it is printed, with means of four new
values, and with sums of four, D = 16 W2. The printed errors on the second grid, and what the paper
says of the best ratios W2 / W1 (a big one for f1, 1 for f2, a small one for f3), are those of
sums. On the first grid the printed errors are too small for errors up to q at all its nodes, even
before smoothing; those after are nearer to ours at its inner nodes. The table of gains has both
readings and three densities of the grids. At last, weights chosen by cross-validation stand beside
the best fixed ratio D : A.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from gallery import chart, legend_below, run

from skfem_dual import GridCouple, rectangular_couple
from skfem_dual.grids.couples import boundary_nodes
from skfem_dual.post.functional import CoupleFunctional, Neighbours, Weights
from skfem_dual.post.weights import gcv_weights

READINGS = ("sums", "means")
RATIOS = (1 / 16, 1 / 4, 1, 4, 16, 64, 256)
DENSITIES = (6, 11, 21)
COLUMNS = ("df old", "dg old", "df new", "dg new", "df new, inner nodes")


@dataclass(frozen=True)
class Row:
    """A function, the bound of its errors, the paper's W1 and W2 and its four figures."""

    function: Callable
    q: float
    weights: tuple[float, float]
    paper: tuple[float, float, float, float]


ROWS = {
    "f1 = (x - 0.5)(y - 0.5)": Row(
        lambda x: (x[0] - 0.5) * (x[1] - 0.5), 0.06, (16, 256), (0.0255, 0.0323, 0.0117, 0.0089)
    ),
    "f2 = x² + y²": Row(
        lambda x: x[0] ** 2 + x[1] ** 2, 0.03, (64, 64), (0.0127, 0.0173, 0.0041, 0.0036)
    ),
    "f3 = sin πx cos πy": Row(
        lambda x: np.sin(np.pi * x[0]) * np.cos(np.pi * x[1]),
        0.06,
        (64, 16),
        (0.0255, 0.0323, 0.0145, 0.0151),
    ),
}


@dataclass(frozen=True)
class Result:
    """Errors and gains.

    ``errors[reading, name]`` has mean and spread of each of the columns; ``gains[reading, name,
    k]`` the errors before over those after for each ratio on k x k nodes; ``validated[name]`` the
    mean error with weights by cross-validation and with the best ratio.
    """

    seeds: int
    errors: dict[tuple[str, str], np.ndarray]
    gains: dict[tuple[str, str, int], np.ndarray]
    validated: dict[str, tuple[float, float]]

    def __str__(self) -> str:
        lines = [f"Table 2, {self.seeds} samples: mean (spread), in brackets [the paper]"]
        for reading in READINGS:
            lines.append(f"{reading:<25}{'W1, W2':<9}" + "".join(f"{c:<26}" for c in COLUMNS))
            for name, row in ROWS.items():
                printed = *row.paper, None
                cells = "".join(
                    f"{f'{mean:.4f} ({spread:.4f})' + (f' [{p:.4f}]' if p else ''):<26}"
                    for (mean, spread), p in zip(self.errors[reading, name], printed, strict=True)
                )
                lines.append(f"{name:<25}{str(row.weights)[1:-1]:<9}{cells}")
        lines += ["", "Ratio of errors before and after, all nodes; W1 = 64, B = 16"]
        ratios = "".join(f"W2/W1 {r:<7g}" for r in RATIOS)
        lines.append(f"{'':<25}{'nodes':<9}{'reading':<9}{ratios}")
        for (reading, name, k), gains in self.gains.items():
            cells = "".join(f"{gain:<13.2f}" for gain in gains)
            lines.append(f"{name:<25}{f'{k} x {k}':<9}{reading:<9}{cells}")
        lines += ["", "Mean error with D : A by cross-validation, and with the best one"]
        for name, (chosen, best) in self.validated.items():
            lines.append(f"{name:<25}{chosen:.5f}  {best:.5f}  {chosen / best - 1:+.1%}")
        return "\n".join(lines)


def grids(k: int) -> GridCouple:
    """The couple of k x k and (k - 1) x (k - 1) nodes on the unit square."""
    lines = np.linspace(0, 1, k)
    return rectangular_couple(lines, lines)


def samples(row: Row, couple: GridCouple, seeds: int):
    """Exact values and errors on both grids, one column for each seed."""
    exact = [row.function(grid.polygons.p)[:, None] for grid in (couple.a, couple.b)]
    errors = [
        np.stack(
            [
                np.random.default_rng([seed, i]).uniform(-row.q, row.q, len(values))
                for seed in range(seeds)
            ],
            axis=1,
        )
        for i, values in enumerate(exact)
    ]
    return exact, errors


def rms(errors) -> np.ndarray:
    """Root mean square of each column."""
    return np.sqrt(np.mean(np.asarray(errors) ** 2, axis=0))


def after(functional: CoupleFunctional, exact, errors):
    """Errors of the new values on both grids."""
    old = [e + error for e, error in zip(exact, errors, strict=True)]
    return [new - e for new, e in zip(functional.minimise(*old), exact, strict=True)]


def table(seeds: int) -> dict[tuple[str, str], np.ndarray]:
    """Mean and spread of the columns, by reading and function."""
    couple = grids(11)
    neighbours, found = Neighbours.of(couple), {}
    inner = np.ones(121, dtype=bool)
    inner[boundary_nodes(couple.a)] = False
    for reading in READINGS:
        for name, row in ROWS.items():
            exact, errors = samples(row, couple, seeds)
            weights = Weights.init_paper(*row.weights, last=reading)
            new = after(CoupleFunctional(neighbours, weights), exact, errors)
            columns = [*map(rms, errors), *map(rms, new), rms(new[0][inner])]
            found[reading, name] = np.array([[r.mean(), r.std()] for r in columns])
    return found


def gains(seeds: int) -> dict[tuple[str, str, int], np.ndarray]:
    """Errors before over errors after for the ratios W2 / W1 with W1 = 64."""
    found = {}
    for name, row in ROWS.items():
        for k in DENSITIES:
            couple = grids(k)
            neighbours = Neighbours.of(couple)
            exact, errors = samples(row, couple, seeds)
            before = rms(np.vstack(errors)).mean()
            for reading in READINGS:
                weights = [Weights.init_paper(64, 64 * r, last=reading) for r in RATIOS]
                functionals = [CoupleFunctional(neighbours, w) for w in weights]
                new = [rms(np.vstack(after(f, exact, errors))).mean() for f in functionals]
                found[reading, name, k] = before / np.array(new)
    return found


def cross_validation(seeds: int, k: int = 11) -> dict[str, tuple[float, float]]:
    """Mean error with weights by cross-validation, and with the best ratio D : A."""
    couple = grids(k)
    neighbours, found = Neighbours.of(couple), {}
    for name, row in ROWS.items():
        exact, errors = samples(row, couple, seeds)
        best = min(
            rms(np.vstack(after(CoupleFunctional(neighbours, w), exact, errors))).mean()
            for w in (Weights(1.0, 1.0, D1=2.0**i, D2=2.0**i) for i in np.arange(-4, 12, 0.5))
        )
        chosen = []
        for seed in range(seeds):
            one = [e[:, [seed]] for e in errors]
            old = [e + error for e, error in zip(exact, one, strict=True)]
            functional = CoupleFunctional(neighbours, gcv_weights(neighbours, *old))
            chosen.append(rms(np.vstack(after(functional, exact, one)))[0])
        found[name] = float(np.mean(chosen)), float(best)
    return found


def main(seeds: int = 100) -> Result:
    """All tables over so many samples."""
    return Result(seeds, table(seeds), gains(seeds), cross_validation(max(seeds // 4, 5)))


def visualize(result: Result):
    """Gains over the ratio of weights, by reading and density, a picture for each function."""
    from skfem_dual.visuals.curves import LINES
    from skfem_dual.visuals.style import CONTACT

    pictures = {}
    for i, (name, row) in enumerate(ROWS.items(), 1):
        ax = pictures[f"f{i}"] = chart(3.9)
        for k, (color, _) in zip(DENSITIES, LINES, strict=False):
            for reading, style in zip(READINGS, ("-", ":"), strict=True):
                y, label = result.gains[reading, name, k], f"{k} x {k}, {reading}"
                ax.semilogx(RATIOS, y, style, color=color, marker=".", base=2, label=label)
        ratio = row.weights[1] / row.weights[0]
        ax.axvline(ratio, color=CONTACT, lw=1.2)
        ax.text(ratio, 0.04, " paper", color=CONTACT, transform=ax.get_xaxis_transform())
        ax.set_ylim(0, 3.5)
        ax.set_xticks([1 / 16, 1, 16, 256], ["1/16", "1", "16", "256"])
        ax.set_xlabel("$W_2 / W_1$")
        ax.set_ylabel("error before / after")
        ax.set_title(name)
        legend_below(ax, handlelength=1.4)
    return pictures


if __name__ == "__main__":
    run(main, visualize)
