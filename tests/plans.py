"""Plans of punches as meshes, for the tests."""

import numpy as np
from skfem import MeshQuad, MeshTri


def sin_graded(mesh):
    """The mesh of a unit disc, drawn to its edge: r = sin(pi s / 2)."""
    s = np.hypot(*mesh.p)
    factor = np.divide(np.sin(np.pi * s / 2), s, out=np.ones_like(s), where=s > 0)
    return MeshTri(mesh.p * factor, mesh.t)


def to_area(mesh, area):
    """The mesh scaled about the origin to an area."""
    v = mesh.p[:, mesh.t]
    a, b = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    return mesh.scaled(float(np.sqrt(area / np.abs(a[0] * b[1] - a[1] * b[0]).sum() * 2)))


def disc(refinements, graded=False):
    """Unit disc of 145, 545, 2113 nodes for 3, 4, 5 refinements, with the circle's area."""
    mesh = MeshTri.init_circle(refinements)
    return to_area(sin_graded(mesh) if graded else mesh, np.pi)


def ellipse(refinements, a=1.0, b=0.5, graded=False):
    """Ellipse with semiaxes a, b, of its area."""
    mesh = disc(refinements, graded)
    return MeshTri(mesh.p * np.array([[a], [b]]), mesh.t)


def rectangle(n, a=1.0, b=1.0, graded=False):
    """Rectangle 2a x 2b of n x n b / a squares, each cut in two, diagonals symmetric."""
    m = round(n * b / a)
    x, y = np.linspace(-1, 1, n + 1), np.linspace(-1, 1, m + 1)
    if graded:
        x, y = np.sin(np.pi * x / 2), np.sin(np.pi * y / 2)
    mesh = MeshTri.init_tensor(a * x, b * y)
    return mesh


def annulus(rings, sectors, inner=0.5, graded=False):
    """Concentric annulus of outer radius 1, of its area."""
    s = np.linspace(-1, 1, rings + 1)
    s = np.sin(np.pi * s / 2) if graded else s
    r = (1 + inner) / 2 + (1 - inner) / 2 * s
    ring, sector = np.meshgrid(np.arange(rings + 1), np.arange(sectors), indexing="ij")
    angle = 2 * np.pi * (sector + 0.5 * ring) / sectors
    p = np.stack([(r[ring] * np.cos(angle)).ravel(), (r[ring] * np.sin(angle)).ravel()])
    i, j = (k.ravel() for k in np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij"))
    at = lambda i, j: i * sectors + j % sectors  # noqa: E731
    lower = np.stack([at(i, j), at(i, j + 1), at(i + 1, j)])
    upper = np.stack([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
    return to_area(MeshTri(p, np.hstack([lower, upper])), np.pi * (1 - inner**2))


def polar(rings=10, sectors=40):
    """The uniform polar grid of Table 1, straight quadrilaterals."""
    r, angle = np.linspace(0, 1, rings + 1), np.linspace(0, 2 * np.pi, sectors + 1)
    grid = MeshQuad.init_tensor(r, angle)
    return MeshQuad(
        np.array([grid.p[0] * np.cos(grid.p[1]), grid.p[0] * np.sin(grid.p[1])]), grid.t
    )


def perturbed(mesh, size, seed=0):
    """The mesh with its inner nodes moved at random by up to ``size`` in each coordinate."""
    p = mesh.p.copy()
    inner = mesh.interior_nodes()
    p[:, inner] += np.random.default_rng(seed).uniform(-size, size, (2, len(inner)))
    return MeshTri(p, mesh.t)


def renumbered(mesh, seed):
    """With nodes, triangles and the vertices of these in another order."""
    rng = np.random.default_rng(seed)
    number, order = rng.permutation(mesh.nvertices), rng.permutation(mesh.nelements)
    p = np.empty_like(mesh.p)
    p[:, number] = mesh.p
    t = rng.permuted(number[mesh.t[:, order]], axis=0)
    return MeshTri(p, np.ascontiguousarray(t))


def two_holes():
    """A rectangle with two holes."""
    m = MeshTri.init_tensor(np.arange(8.0), np.arange(5.0))
    x, y = m.p[:, m.t].mean(axis=1)
    hole = (abs(x - 2.5) < 0.5) | (abs(x - 5) < 1)
    return m.remove_elements(np.nonzero(hole & (abs(y - 2) < 1))[0])


def two_parts(away):
    """Two squares, the second one moved by ``away`` along both axes."""
    m = rectangle(4)
    return MeshTri(np.hstack([m.p, m.p + away]), np.hstack([m.t, m.t + m.p.shape[1]]).copy())
