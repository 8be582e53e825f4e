"""What an accuracy costs: processor time of `solve_plan` over that of the mesh that would do.

    python benchmarks/plan_cost.py
    python benchmarks/plan_cost.py --plans 20      fewer

Random plans, grounds and loads, to 1e-3 of the settlement. The coarsest mesh that would have done
is the first whose answer is so close to one on about 1200 cells, of meshes each of which has
facets two thirds or so as long as the one before. Its own time is one: a mesh, its dual grid, the
answer.
"""

import argparse
import sys
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from skfem_dual import HalfSpace, Load, Plan, solve_plan
from skfem_dual.plans.problem import FIRST, LARGEST_STEP, Problem

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from random_plans import error, in_plan, random_case

ACCURACY = 1e-3


def cost(seed: int, fine: int = 1200) -> tuple[bool, float]:
    """Whether the accuracy is kept, and its cost; NaN if none of ten meshes would have done."""
    plan, ground, load, truth = random_case(seed, fine)
    begin = process_time()
    solution = solve_plan(plan, ground, **in_plan(plan, load), accuracy=ACCURACY)
    seconds = process_time() - begin
    kept = error(solution, *truth) < ACCURACY
    problem = Problem(plan, ground, (Load(**load),), tuple(plan.centroid), True, False)
    size = FIRST * 2 * plan.area / sum(ring.length for ring in plan.rings)
    for k in range(10):
        begin, length = process_time(), size * LARGEST_STEP**k
        attempt = problem.on(problem.mesh(length), length, perf_counter())
        spent = process_time() - begin
        if error(attempt.solutions[0], *truth) < ACCURACY:
            return kept, seconds / spent
    return kept, np.nan


def main(plans: int = 200, fine: int = 1200) -> np.ndarray:
    """Print the shares and quartiles; return what was kept and what it cost, in two rows."""
    solve_plan(Plan.circle((0, 0), 1.0), HalfSpace(1.0, 0.0), 1.0)  # compiles
    found = np.array([cost(seed, fine) for seed in range(plans)]).T
    quartiles = np.nanquantile(found[1], (0.25, 0.5, 0.75))
    print(f"{plans} plans, {found[0].mean():.1%} within {ACCURACY:.0e}")
    print("cost, quartiles: " + ", ".join(f"{quartile:.2f}" for quartile in quartiles))
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plans", type=int, default=200, metavar="N")
    main(parser.parse_args().plans)
