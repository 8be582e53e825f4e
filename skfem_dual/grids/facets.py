"""The facets of a triangulation, numbered as scikit-fem numbers them."""

import numpy as np
from skfem import MeshTri

from ..kernels.compiled import compiled, inputs


def number_facets(mesh: MeshTri) -> None:
    """Facets as scikit-fem numbers them when first asked, in a hundredth of the time."""
    m, n = mesh.t.shape[1], mesh.p.shape[1]
    facets, t2f = np.empty((2, 3 * m), np.int32), np.empty((3, m), np.int64)
    f2t = np.full((2, 3 * m), -1, np.int32)
    count = _number(*inputs(mesh.t), n, facets, t2f, f2t)
    mesh._facets, mesh._t2f = facets[:, :count].copy(), t2f
    mesh._f2t = f2t[:, :count].copy()


@compiled
def _number(t, n, facets, t2f, f2t):
    """Number facets by their lower, then by their higher node; returns how many there are."""
    m = t.shape[1]
    low, high = np.empty(3 * m, np.int32), np.empty(3 * m, np.int32)
    for k in range(3 * m):  # facets of each triangle: 01, 12, 02
        side, j = k // m, k % m
        a, b = t[side % 2, j], t[min(side + 1, 2), j]
        low[k], high[k] = min(a, b), max(a, b)
    order = np.arange(3 * m).astype(np.int32)
    for key in (high, low):  # sorted by counting, which keeps the order of what is alike
        starts = np.zeros(n + 1, np.int64)
        for k in range(3 * m):
            starts[key[k] + 1] += 1
        for node in range(n):
            starts[node + 1] += starts[node]
        ordered = np.empty_like(order)
        for k in order:
            ordered[starts[key[k]]] = k
            starts[key[k]] += 1
        order = ordered
    count = 0
    for i in range(3 * m):
        k = order[i]
        if i == 0 or low[k] != low[order[i - 1]] or high[k] != high[order[i - 1]]:
            facets[0, count], facets[1, count], f2t[0, count] = low[k], high[k], k % m
            count += 1
        elif k % m != f2t[0, count - 1]:
            f2t[1, count - 1] = k % m
        t2f[k // m, k % m] = count - 1
    return count
