"""Relocation of nodes: to the means of their neighbours, to the barycentres of their cells."""

from collections.abc import Callable

import numpy as np
from numpy import ndarray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import MeshTri

from .corners import signed_areas
from .planar import cross

#: relocation leaves the roundness of a triangle, 1 if equilateral and 0 if flat, above this
ROUNDNESS = 0.01
#: places of the nodes from which the next are extrapolated
WINDOW = 8
#: entries of banded matrices up to which these are factorised sooner than sparse ones
BANDED = 2**18
#: parts of so few nodes are not halved
LEAF = 64

Show = Callable[[int, float], None]


def to_means(mesh: MeshTri, free: ndarray, maxiter: int, show: Show) -> tuple[ndarray, int, str]:
    """Nodes at the mean of their neighbours, where ``free``.

    Nodes of triangles that would flip stay, and the others are found anew.

    Returns
    -------
    p : (2, nnodes) array of float
        The nodes.
    iterations : int
        Systems solved.
    failure : str
        What was not reached, if anything.
    """
    held = ~free
    admissible = _Admissible(mesh)
    a, b = mesh.facets
    ends, others = np.append(a, b), np.append(b, a)
    p, iteration = mesh.p, 0
    bad = np.full(mesh.nelements, bool(free.any()))
    while bad.any() and not held.all() and iteration < maxiter:
        iteration += 1
        p = mesh.p.copy()
        # moves, not places: far from the origin these have fewer digits
        right = [np.bincount(ends, d, len(held))[~held] for d in p[:, others] - p[:, ends]]
        p[:, ~held] += _solver(mesh, ~held)(np.stack(right, axis=1)).T
        bad = admissible.violated(p)
        show(iteration, float(np.count_nonzero(held & free)))
        held[mesh.t[:, bad]] = True
    if bad.any():
        p, held = mesh.p, np.ones_like(free)
    stayed, wanted = np.count_nonzero(held & free), np.count_nonzero(free)
    failure = (
        f"{stayed} of {wanted} nodes stayed where they were because triangles would flip; only "
        "the others are at the means of their neighbours"
    )
    return p, iteration, failure if stayed else ""


def to_centroids(
    mesh: MeshTri, free: ndarray, tol: float, maxiter: int, show: Show
) -> tuple[ndarray, int, str]:
    """Nodes at the area centroid of their cells, where ``free``; returns as `to_means`.

    The step to the centroids is smoothed by the inverse of the graph's Laplacian, which makes
    the number of iterations independent of that of the nodes, and accelerated.
    """
    if not free.any():
        return mesh.p, 0, ""
    degree = np.bincount(mesh.facets.ravel())[free].astype(float)
    solve = _solver(mesh, free)
    admissible = _Admissible(mesh)
    centroids = _CellCentroids(mesh)
    p = best = mesh.p
    least = np.inf
    nodes: list[ndarray] = []
    images: list[ndarray] = []
    for iteration in range(maxiter + 1):
        centroid, area = centroids(p)
        step = (centroid - p)[:, free]
        distance = float(np.max(np.hypot(*step) / np.sqrt(np.abs(area[free]))))
        if distance < least:
            least, best = distance, p
        show(iteration, distance)
        if distance <= tol or iteration == maxiter:
            break
        nodes = [*nodes, p[:, free].ravel()][-WINDOW:]
        images = [*images, nodes[-1] + 1.5 * solve((degree * step).T).T.ravel()][-WINDOW:]
        move = np.zeros_like(p)
        move[:, free] = _extrapolated(nodes, images).reshape(2, -1) - p[:, free]
        p, whole = admissible.limited(p, move)
        if not whole:  # the history leads out of the admissible places
            nodes, images = [], []
    failure = (
        f"after {iteration} iterations the farthest node is at {least:.1e} of the size of its "
        f"cell from the barycentre; expected {tol:.1e}"
    )
    return best, iteration, failure if least > tol else ""


def _extrapolated(nodes: list[ndarray], images: list[ndarray]) -> ndarray:
    """Anderson's acceleration of a fixed-point iteration that took ``nodes`` to ``images``."""
    g = np.stack(images)
    f = g - np.stack(nodes)
    df = np.diff(f, axis=0)
    weights = np.linalg.lstsq(df @ df.T, df @ f[-1], rcond=1e-14)[0] if len(df) else df[:, 0]
    return g[-1] - weights @ np.diff(g, axis=0)


class _Admissible:
    """Places of the nodes in which no triangle flips or becomes too flat."""

    def __init__(self, mesh: MeshTri):
        self.t = mesh.t
        self.sense = np.sign(signed_areas(mesh.p, mesh.t))
        # flat triangles must not become flatter
        self.least = np.minimum(ROUNDNESS, self._roundness(mesh.p))

    def _roundness(self, p: ndarray) -> ndarray:
        v = p[:, self.t]
        squares = np.sum((v - v[:, [2, 0, 1]]) ** 2, axis=(0, 1))
        return 4 * np.sqrt(3) * self.sense * signed_areas(p, self.t) / squares

    def violated(self, p: ndarray) -> ndarray:
        """Triangles for which nodes at ``p`` are not admissible."""
        return self._roundness(p) < self.least

    def limited(self, p: ndarray, move: ndarray) -> tuple[ndarray, bool]:
        """``p`` moved as far as admissible, and whether that is the whole way.

        The steps at the nodes of triangles at fault are halved, in the end dropped.
        """
        share = np.ones(p.shape[1])
        while np.any(bad := self.violated(p + share * move)):
            nodes = np.unique(self.t[:, bad])
            share[nodes] = np.where(share[nodes] > 1e-3, share[nodes] / 2, 0.0)
        return p + share * move, bool(share.min() == 1)


class _CellCentroids:
    """Centroids and areas of the cells of inner nodes, for any places of the nodes.

    Unlike `Polygons` it takes cells that are not simple.
    """

    def __init__(self, mesh: MeshTri):
        self.mesh = mesh
        inner = np.nonzero(mesh.f2t[1] != -1)[0]
        (a, b), (left, right) = mesh.facets[:, inner], mesh.f2t[:, inner]
        apex = mesh.t[:, left].sum(axis=0) - a - b
        swapped = signed_areas(mesh.p, np.stack([a, b, apex])) < 0
        left, right = np.where(swapped, right, left), np.where(swapped, left, right)
        # seen from the first node of a facet the cell's rib runs from right to left
        self.node = np.concatenate([a, b])
        self.start, self.end = np.concatenate([right, left]), np.concatenate([left, right])

    def __call__(self, p: ndarray) -> tuple[ndarray, ndarray]:
        c = p[:, self.mesh.t].mean(axis=1)
        at = p[:, self.node]
        u, w = c[:, self.start] - at, c[:, self.end] - at
        double = cross(u, w)
        area = np.bincount(self.node, double, p.shape[1]) / 2
        moment = np.stack([np.bincount(self.node, m, p.shape[1]) for m in (u + w) * double / 6])
        return p + np.divide(moment, area, out=np.zeros_like(p), where=area != 0), area


def _solver(mesh: MeshTri, free: ndarray) -> Callable[[ndarray], ndarray]:
    """Solves for values at the nodes where ``free``, the others being zero, whose number of
    neighbours times value less those of the neighbours is given; shape (k, 2)."""
    n, number = np.count_nonzero(free), np.cumsum(free) - 1
    degree = np.bincount(mesh.facets.ravel(), minlength=len(free))[free]
    i, j = number[mesh.facets[:, free[mesh.facets].all(axis=0)]]
    # along the longer side of the domain neighbours are near each other
    x = mesh.p[:, free]
    order, place = np.argsort(x[np.argmax(np.ptp(x, axis=1))]), np.empty(n, dtype=int)
    place[order] = np.arange(n)
    first, last = np.sort([place[i], place[j]], axis=0)
    width = int(np.max(last - first, initial=0))
    if n * width <= BANDED:
        band = np.zeros((width + 1, n))
        band[0], band[last - first, first] = degree[order], -1.0
        factor = cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False)
        return lambda right: cho_solve_banded((factor, True), right[order])[place]
    order = _dissection(i, j, x)
    place[order] = np.arange(n)
    values = np.concatenate([np.full(2 * len(i), -1.0), degree[order]])
    at = [np.concatenate([place[k], place[m], np.arange(n)]) for k, m in ((i, j), (j, i))]
    factors = splu(csc_matrix((values, at), shape=(n, n)), permc_spec="NATURAL")
    return lambda right: factors.solve(right[order])[place]


def _dissection(i: ndarray, j: ndarray, p: ndarray) -> ndarray:
    """Order of elimination: halves, then the nodes between them, and the halves likewise.

    Fills in O(n log n) entries, fewer than orders found without coordinates. Nodes ``i`` and
    ``j`` are neighbours.
    """
    n = p.shape[1]
    i, j = np.append(i, j), np.append(j, i)
    part = np.zeros(n, dtype=int)
    level = np.full(n, 64)  # of the separator a node belongs to
    for depth in range(int(np.log2(max(n / LEAF, 1)))):
        place = np.empty(n, dtype=int)
        place[np.lexsort([p[depth % 2], part])] = np.arange(n)
        count = np.bincount(part, minlength=1 << depth)
        upper = 2 * (place - (np.cumsum(count) - count)[part]) >= count[part]
        whole = (part[i] == part[j]) & (level[i] == 64) & (level[j] == 64)
        level[i[whole & (upper[i] < upper[j])]] = depth
        part = 2 * part + upper
    return np.lexsort([part, -level])
