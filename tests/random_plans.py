"""Random plans of footings, grounds and loads with their answers, for tests and benchmarks."""

import numpy as np

from skfem_dual import (
    DualMesh,
    GradedHalfSpace,
    HalfSpace,
    Layer,
    LayeredHalfSpace,
    Plan,
    RigidPunch,
)

KINDS = "rectangle", "star", "L", "T", "disc", "annulus", "rounded", "frame", "stadium", "two"


def random_plan(rng, kind):
    """A plan of this kind, turned, scaled and moved."""
    a, b = rng.uniform(1, 4), 1.0
    u, v = rng.uniform(0.25, 0.6, 2)
    angle, scale = rng.uniform(0, 2 * np.pi), np.exp(rng.uniform(0, 3))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = rng.uniform(-100, 100, 2)

    def placed(corners, holes=()):
        def moved(ring):
            ring = np.array([(*c, 0.0)[:3] for c in ring], dtype=float)
            ring[:, :2] = scale * ring[:, :2] @ turn.T + shift
            return [tuple(c) for c in ring]

        return Plan.from_polygon(moved(corners), [moved(h) for h in holes])

    box = [(0, 0), (a, 0), (a, b), (0, b)]
    if kind == "rectangle":
        return placed(box)
    if kind == "star":
        k = int(rng.integers(5, 10))
        t = 2 * np.pi * np.arange(k) / k
        return placed((rng.uniform(0.5, 1, k) * np.stack([np.cos(t), np.sin(t)])).T)
    if kind == "L":
        return placed([(0, 0), (a, 0), (a, u * b), (v * a, u * b), (v * a, b), (0, b)])
    if kind == "T":
        c, w = a / 2, v * a / 2
        stem = [(c - w, 0), (c + w, 0), (c + w, u), (a, u), (a, b), (0, b), (0, u), (c - w, u)]
        return placed(stem)
    if kind == "disc":
        return Plan.circle(tuple(shift), scale)
    if kind == "annulus":
        r = rng.uniform(0.2, 0.7)
        off = rng.uniform(0, 0.8) * (1 - r) * np.array([np.cos(angle), np.sin(angle)])
        hole = Plan.circle(tuple(shift + scale * off), scale * r)
        return Plan.circle(tuple(shift), scale, holes=[hole])
    if kind == "rounded":
        r, q = 0.4 * u * b, np.tan(np.pi / 8)
        ring = [(r, 0), (a - r, 0, q), (a, r), (a, b - r, q), (a - r, b), (r, b, q), (0, b - r)]
        return placed([*ring, (0, r, q)])
    if kind == "frame":
        x, y = (a * u / 2, a * (1 - v / 2)), (b * v / 2, b * (1 - u / 2))
        return placed(box, [[(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]])
    if kind == "stadium":
        return placed([(0, 0), (a, 0, 1.0), (a, b), (0, b, 1.0)])
    one = [(0, 0), (v * a, 0), (v * a, b), (0, b)]
    other = [(x + (1.15 + u) * v * a, y * 0.8) for x, y in one]
    return placed(one) + placed(other)


def random_ground(rng, size):
    """Homogeneous for every second, or with moduli that vary over the size of the plan."""
    poisson = rng.uniform(0, 0.45)
    pick = rng.uniform()
    if pick < 0.6:
        return HalfSpace(1.0, poisson)
    if pick < 0.8:
        return GradedHalfSpace.init_linear(1.0, poisson, rng.uniform(0.2, 2) / size)
    layer = Layer(rng.uniform(0.4, 2) * size, 1.0, poisson)
    return LayeredHalfSpace([layer], HalfSpace(rng.uniform(0.3, 5), 0.3))


def random_load(rng, plan):
    """A force in the middle, within or beyond the kern, from the plan's centroid."""
    share = rng.choice([0.0, 0.25, 0.5]) * rng.uniform(0.5, 1)
    while True:
        x = rng.uniform(plan.bounds[:, 0], plan.bounds[:, 1])
        if plan.contains(x):
            return {"force": 1.0, "at": tuple(share * (x - plan.centroid))}


def error(solution, settlement, tilt):
    """Error of the settlement of any point of the plan, over that under the force."""
    x = solution.footprint.partition.polygons.p - np.array(solution.punch.origin)[:, None]
    under = settlement + tilt @ solution.centre_of_pressure
    return np.abs(solution.settlement - settlement + (solution.tilt - tilt) @ x).max() / under


def random_case(seed, n):
    """A plan, ground and load, and the answer on a fine mesh."""
    rng = np.random.default_rng(seed)
    plan = random_plan(rng, KINDS[seed % len(KINDS)])
    ground, load = random_ground(rng, np.sqrt(plan.area)), random_load(rng, plan)
    punch = RigidPunch(
        ground,
        DualMesh.from_mesh(plan.mesh(n=n, graded=0.25)).basis(),
        origin=tuple(plan.centroid),
    )
    truth = punch.solve(**load)
    return plan, ground, load, (truth.settlement, truth.tilt)


def in_plan(plan, load):
    return load | {"at": tuple(plan.centroid + load["at"])}
