"""Contact by ContactMechanics on regular grids; run by peers.py in an environment that has it."""

import numpy as np
from ContactMechanics import FreeFFTElasticHalfSpace, PeriodicFFTElasticHalfSpace
from ContactMechanics.Systems import NonSmoothContactSystem
from peer_common import PROBLEMS, contact, heights, rough, roughness, serve
from SurfaceTopography import Topography


def solve(plan: str, n: int, tolerance: float, margin: float) -> tuple[int, float, float]:
    """Approach by the conjugate gradients of Polonsky and Keer on n x n points."""
    size, surface = heights(plan, n, margin)
    force, exact = PROBLEMS[plan]
    ground = FreeFFTElasticHalfSpace((n, n), 1.0, (size, size))
    system = NonSmoothContactSystem(ground, Topography(surface, (size, size)))
    found = system.minimize_proxy(external_force=force, pentol=tolerance * exact)
    if not found.success:
        raise RuntimeError(found.message)
    settlement = np.asarray(found.x)[:n, :n]
    # weighted by the forces, as for Tamaas
    return n * n, 0.0, float(np.average(settlement - surface, weights=np.asarray(found.jac)))


def press(n: int, force: float, tolerance: float, periodic: bool) -> np.ndarray:
    """Pressures under a rough surface on the unit square; tolerance over the surface's height."""
    ground = PeriodicFFTElasticHalfSpace if periodic else FreeFFTElasticHalfSpace
    surface = rough(n)
    topography = Topography(surface, (1.0, 1.0), periodic=periodic)
    system = NonSmoothContactSystem(ground((n, n), 1.0, (1.0, 1.0)), topography)
    found = system.minimize_proxy(
        external_force=force, pentol=tolerance * np.ptp(surface), maxiter=5000
    )
    if not found.success:
        raise RuntimeError(found.message)
    return np.asarray(found.jac)[:n, :n] * n**2


if __name__ == "__main__":
    serve(contact=contact(solve), rough=roughness(press))
