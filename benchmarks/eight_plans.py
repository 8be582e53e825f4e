"""Eight plans on five kinds of meshes of any size: what accuracy is measured on."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial import Delaunay
from scipy.special import ellipk, elliprd
from skfem import MeshTri

from skfem_dual import check_mesh

# u in [-1, 1] from edge to edge, or [0, 1] from the centre to the edge
GRADINGS: dict[str, Callable] = {
    "uniform": lambda u: u,
    "sine": lambda u: np.sin(np.pi * u / 2),
    "quadratic": lambda u: np.sign(u) * (1 - (1 - np.abs(u)) ** 2),
}
KINDS = (*GRADINGS, "random", "adaptive")


@dataclass(frozen=True)
class Plan:
    """A plan: its meshes, and force and moments by unit settlement and tilts for E* = 1.

    Stiffnesses of the disc and the ellipse are exact, those of the square, the rectangle and the
    annulus under a central force are known from elsewhere; the others were extrapolated from
    constants on sine-graded triangles of 2400, 4800 and 9600 cells, to about 5e-6.
    """

    mesh: Callable[[int, Callable], MeshTri]
    stiffness: tuple[float, float, float]
    area: float | None = None
    onto_edge: Callable | None = None  # takes boundary nodes of curved plans to the true edge


def rings(n):
    """Rings of the hexagonal lattice: distance, side, place on the side from 0 to 1, triangles."""
    k = max(2, round((-3 + np.sqrt(12 * n - 3)) / 6))
    ring = np.concatenate([[0], np.repeat(np.arange(1, k + 1), 6 * np.arange(1, k + 1))])
    step = np.concatenate([[0], *(np.arange(6 * i) for i in range(1, k + 1))])
    side, place = np.divmod(step, np.maximum(ring, 1))
    share = place / np.maximum(ring, 1)
    lattice = ring * _on_side(side, share)
    t = Delaunay(lattice.T).simplices.T
    return ring / k, side, share, np.ascontiguousarray(t, dtype=np.int32)


def _on_side(side, share):
    """Points on the sides of the regular hexagon of side 1."""
    corner = np.exp(1j * np.pi / 3 * side)
    z = corner * (1 - share + share * np.exp(1j * np.pi / 3))
    return np.array([z.real, z.imag])


def hexagon(n, law):
    """A regular hexagon of side 1; graded along its sides too, to its corners."""
    s, side, share, t = rings(n)
    return MeshTri(law(s) * _on_side(side, (1 + law(2 * share - 1)) / 2), t)


def disc(n, law):
    """The rings of the hexagon drawn to circles."""
    s, side, share, t = rings(n)
    angle = np.pi / 3 * (side + share)
    return MeshTri(law(s) * np.array([np.cos(angle), np.sin(angle)]), t)


def ellipse(n, law):
    mesh = disc(n, law)
    return MeshTri(mesh.p * np.array([[1.0], [0.5]]), mesh.t)


def tensor(xs, ys, n, law, keep=lambda x, y: np.ones(x.shape, dtype=bool)):
    """Rectangles between the lines xs and ys, each graded to all its sides."""

    def lines(ends, h):
        parts = [
            (a + b) / 2 + (b - a) / 2 * law(np.linspace(-1, 1, max(2, round((b - a) / h)) + 1))
            for a, b in pairwise(ends)
        ]
        return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])

    trial = [np.array(a) for a in (xs, ys)]
    middles = [(a[1:] + a[:-1]) / 2 for a in trial]
    x, y = np.meshgrid(*middles, indexing="ij")
    area = (np.outer(np.diff(xs), np.diff(ys)) * keep(x, y)).sum()
    h = np.sqrt(area / n)
    mesh = MeshTri.init_tensor(lines(xs, h), lines(ys, h))
    out = np.nonzero(~keep(*mesh.p[:, mesh.t].mean(axis=1)))[0]
    return mesh.remove_elements(out) if len(out) else mesh


def square(n, law):
    return tensor([-1, 1], [-1, 1], n, law)


def rectangle(n, law):
    return tensor([-1, 1], [-2, 2], n, law)


def l_shape(n, law):
    return tensor([-1, 0, 1], [-1, 0, 1], n, law, lambda x, y: (x < 0) | (y < 0))


def excised(n, law):
    ends = [-1, -0.5, 0.5, 1]
    return tensor(ends, ends, n, law, lambda x, y: (np.abs(x) < 0.5) | (np.abs(y) < 0.5))


def annulus(n, law):
    rings = max(2, round(np.sqrt(n * 0.5 / 4.7)))
    sectors = round(n / (rings + 1))
    r = 0.75 + 0.25 * law(np.linspace(-1, 1, rings + 1))
    ring, sector = np.meshgrid(np.arange(rings + 1), np.arange(sectors), indexing="ij")
    angle = 2 * np.pi * (sector + 0.5 * ring) / sectors
    p = np.stack([(r[ring] * np.cos(angle)).ravel(), (r[ring] * np.sin(angle)).ravel()])
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij"))

    def at(i, j):
        return i * sectors + j % sectors

    lower = np.stack([at(i, j), at(i, j + 1), at(i + 1, j)])
    upper = np.stack([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
    return MeshTri(p, np.hstack([lower, upper]))


def onto_circles(*radii):
    """Points to the nearest of some circles around the origin."""

    def project(p):
        r = np.hypot(*p)
        nearest = np.argmin(np.abs(r - np.array(radii)[:, None]), axis=0)
        return p * np.array(radii)[nearest] / r

    return project


def onto_ellipse(p):
    q = p * np.array([[1.0], [2.0]])
    return p / np.hypot(*q)


PLANS = {
    "disc": Plan(disc, (2.0, 4 / 3, 4 / 3), np.pi, onto_circles(1.0)),
    "ellipse": Plan(
        ellipse,
        (
            np.pi / ellipk(0.75),
            np.pi / elliprd(0, 0.25, 1),
            np.pi / elliprd(0, 1, 0.25),
        ),
        np.pi / 2,
        onto_ellipse,
    ),
    "square": Plan(square, (np.pi * 0.733576, np.pi * 0.662348, np.pi * 0.662348)),
    "rectangle": Plan(rectangle, (np.pi * 1.063836, np.pi * 1.171241, np.pi * 3.201667)),
    "L-shape": Plan(l_shape, (1.925276, 1.484215, 1.484215)),
    "excised": Plan(excised, (2.013249, 1.376430, 1.376430)),
    "hexagon": Plan(hexagon, (1.829118, 1.023181, 1.023181)),
    "annulus": Plan(
        annulus, (np.pi * 0.6245354, 1.32807, 1.32807), np.pi * 0.75, onto_circles(1.0, 0.5)
    ),
}


def make(name: str, kind: str, n: int) -> MeshTri:
    """A mesh of about n nodes; curved plans are scaled to their true area."""
    plan = PLANS[name]
    if kind == "random":
        mesh = _perturbed(plan.mesh(n, GRADINGS["uniform"]))
    elif kind == "adaptive":
        mesh = _adaptive(plan, n)
    else:
        mesh = plan.mesh(n, GRADINGS[kind])
    return mesh if plan.area is None else mesh.scaled(float(np.sqrt(plan.area / _area(mesh))))


def _perturbed(mesh: MeshTri) -> MeshTri:
    """Inner nodes moved at random by up to a quarter of the mean spacing, fewer if need be."""
    inner = mesh.interior_nodes()
    h = np.sqrt(_area(mesh) / mesh.p.shape[1])
    for size in 0.25 * 0.8 ** np.arange(10):
        p = mesh.p.copy()
        p[:, inner] += np.random.default_rng(0).uniform(-size * h, size * h, (2, len(inner)))
        if check_mesh(MeshTri(p, mesh.t)).ok:
            return MeshTri(p, mesh.t)
    raise RuntimeError("no perturbation of this mesh has a dual grid")


def _adaptive(plan: Plan, n: int) -> MeshTri:
    """A coarse uniform mesh refined by scikit-fem where it touches the edge, twice."""
    for coarse in range(n // 8, n, max(1, n // 40)):
        mesh = plan.mesh(coarse, GRADINGS["uniform"])
        for _ in range(2):
            edge = np.isin(mesh.t, mesh.boundary_nodes()).any(axis=0)
            mesh = mesh.refined(np.nonzero(edge)[0])
            if plan.onto_edge:
                p = mesh.p.copy()
                p[:, mesh.boundary_nodes()] = plan.onto_edge(p[:, mesh.boundary_nodes()])
                mesh = MeshTri(p, mesh.t)
        if mesh.p.shape[1] >= 0.9 * n and check_mesh(mesh).ok:
            return mesh
    raise RuntimeError("no refined mesh of this size has a dual grid")


def _area(mesh: MeshTri) -> float:
    return float(np.abs(mesh.mapping().detA).sum() / 2)
