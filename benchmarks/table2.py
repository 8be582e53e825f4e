"""Table 2 of the paper: values with random errors on two dual rectangular grids.

    python benchmarks/table2.py            200 seeds, a minute
    python benchmarks/table2.py --small    20 seeds

Three functions on 11 x 11 and 10 x 10 nodes, errors uniform in [-q, q]: root mean squares of the
errors before and after, mean and spread over the seeds, beside the paper's figures (one sample).
Then the ratio of errors before and after for several W2 / W1 and three densities of the grids,
and for weights chosen by cross-validation against the best fixed ratio.
"""

import argparse
from dataclasses import dataclass

import numpy as np

from skfem_dual import GridCouple, rectangular_couple
from skfem_dual.grids.couples import boundary_nodes
from skfem_dual.post.functional import CoupleFunctional, Neighbours, Weights
from skfem_dual.post.weights import gcv_weights

RATIOS = (1 / 16, 1 / 4, 1, 4, 16, 64, 256)
DENSITIES = (6, 11, 21)


@dataclass(frozen=True)
class Row:
    """A function, the bound of its errors, the paper's W1 and W2 and its four figures."""

    function: object
    q: float
    weights: tuple[float, float]
    paper: tuple[float, float, float, float]


ROWS = {
    "f1 = (x - 0.5)(y - 0.5)": Row(
        lambda x: (x[0] - 0.5) * (x[1] - 0.5), 0.06, (16, 256), (0.0255, 0.0323, 0.0117, 0.0089)
    ),
    "f2 = x^2 + y^2": Row(
        lambda x: x[0] ** 2 + x[1] ** 2, 0.03, (64, 64), (0.0127, 0.0173, 0.0041, 0.0036)
    ),
    "f3 = sin(pi x) cos(pi y)": Row(
        lambda x: np.sin(np.pi * x[0]) * np.cos(np.pi * x[1]),
        0.06,
        (64, 16),
        (0.0255, 0.0323, 0.0145, 0.0151),
    ),
}


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


def table(seeds: int) -> dict[str, np.ndarray]:
    """The paper's table: (before a, b; after a, b; after at inner nodes of a), (mean, spread)."""
    couple = grids(11)
    neighbours, found = Neighbours.of(couple), {}
    inner = np.ones(121, dtype=bool)
    inner[boundary_nodes(couple.a)] = False
    print(f"Table 2, {seeds} seeds: mean (spread), in brackets [the paper]")
    columns = ("df old", "dg old", "df new", "dg new", "df new, inner nodes")
    print(f"{'':<27}{'W1, W2':<10}" + "".join(f"{c:<26}" for c in columns))
    for name, row in ROWS.items():
        exact, errors = samples(row, couple, seeds)
        functional = CoupleFunctional(neighbours, Weights.init_paper(*row.weights))
        new = after(functional, exact, errors)
        all_rms = [*map(rms, errors), *map(rms, new), rms(new[0][inner])]
        found[name] = np.array([[r.mean(), r.std()] for r in all_rms])
        cells = [
            f"{mean:.4f} ({spread:.4f})" + (f" [{row.paper[i]:.4f}]" if i < 4 else "")
            for i, (mean, spread) in enumerate(found[name])
        ]
        print(f"{name:<27}{str(row.weights)[1:-1]:<10}" + "".join(f"{c:<26}" for c in cells))
    return found


def gains(seeds: int) -> dict[tuple[str, int, float], float]:
    """Errors before over errors after, for ratios W2 / W1 with W1 = 64, and densities."""
    found = {}
    print("\nRatio of errors before and after, all nodes; W1 = 64, B = 16")
    print(f"{'':<27}{'nodes':<9}" + "".join(f"W2/W1 {r:<7g}" for r in RATIOS))
    for name, row in ROWS.items():
        for k in DENSITIES:
            couple = grids(k)
            neighbours = Neighbours.of(couple)
            exact, errors = samples(row, couple, seeds)
            for ratio in RATIOS:
                functional = CoupleFunctional(neighbours, Weights.init_paper(64, 64 * ratio))
                new = after(functional, exact, errors)
                found[name, k, ratio] = float(
                    rms(np.vstack(errors)).mean() / rms(np.vstack(new)).mean()
                )
            cells = "".join(f"{found[name, k, r]:<13.2f}" for r in RATIOS)
            print(f"{name:<27}{f'{k} x {k}':<9}" + cells)
    return found


def cross_validation(seeds: int, k: int = 11) -> dict[str, tuple[float, float]]:
    """Mean error with weights by cross-validation, and with the best ratio D : A."""
    couple = grids(k)
    neighbours, found = Neighbours.of(couple), {}
    print(f"\nMean error with D : A by cross-validation, and with the best one; {k} x {k} nodes")
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
        print(f"{name:<27}{np.mean(chosen):.5f}  {best:.5f}  {np.mean(chosen) / best - 1:+.1%}")
    return found


def main(seeds: int = 200):
    """Print all tables and return them."""
    return table(seeds), gains(seeds), cross_validation(max(seeds // 4, 5))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true")
    main(20 if parser.parse_args().small else 200)
