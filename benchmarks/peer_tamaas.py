"""Contact by Tamaas on regular grids; run by peers.py in an environment that has it."""

import numpy as np
import tamaas as tm
from peer_common import PROBLEMS, contact, heights, rough, roughness, serve


def solve(plan: str, n: int, tolerance: float, margin: float) -> tuple[int, float, float]:
    """Approach by the conjugate gradients of Polonsky and Keer on n x n points."""
    size, surface = heights(plan, n, margin)
    model = tm.ModelFactory.createModel(tm.model_type.basic_2d, [size, size], [n, n])
    model.E, model.nu = 1.0, 0.0
    # a half-space that is not periodic, by convolution on twice the points
    tm.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tm.PolonskyKeerRey(model, surface, tolerance)
    solver.setIntegralOperator("dcfft")
    solver.solve(PROBLEMS[plan][0] / size**2)
    # its displacements have no level of their own. The mean weighted by the pressure is the work
    # done, whose error is that of the pressure squared
    pressure, settlement = model.traction, np.zeros((n, n))
    model.operators["dcfft"](pressure, settlement)
    return n * n, 0.0, float(np.average(settlement - surface, weights=pressure))


def press(n: int, force: float, tolerance: float, periodic: bool) -> np.ndarray:
    """Pressures under a rough surface on the unit square."""
    model = tm.ModelFactory.createModel(tm.model_type.basic_2d, [1.0, 1.0], [n, n])
    model.E, model.nu = 1.0, 0.0
    if not periodic:
        tm.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tm.PolonskyKeerRey(model, rough(n), tolerance)
    if not periodic:
        solver.setIntegralOperator("dcfft")
    solver.max_iter = 5000
    solver.solve(force)
    return model.traction


if __name__ == "__main__":
    tm.set_log_level(tm.LogLevel.error)
    tm.initialize(2)
    serve(contact=contact(solve), rough=roughness(press))
