"""The facets of a mesh, numbered as scikit-fem numbers them."""

import numpy as np
from skfem import Mesh

from ..kernels.compiled import compiled, inputs


def number_facets(mesh: Mesh) -> None:
    """Facets of triangles or quadrilaterals as scikit-fem numbers them when first asked, in a
    hundredth of the time; nothing is done if they are known."""
    if hasattr(mesh, "_facets"):
        return
    (k, m), n = mesh.t.shape, mesh.p.shape[1]
    facets, t2f = np.empty((2, k * m), np.int32), np.empty((k, m), np.int64)
    f2t = np.full((2, k * m), -1, np.int32)
    count = _number(*inputs(mesh.t.astype(np.int32, copy=False)), n, facets, t2f, f2t)
    mesh._f2t, mesh._t2f = f2t[:, :count].copy(), t2f
    mesh._facets = facets[:, :count].copy()


@compiled
def _number(t, n, facets, t2f, f2t):
    """Number facets by their lower, then by their higher node; returns how many there are."""
    sides, m = t.shape
    low, high = np.empty(sides * m, np.int32), np.empty(sides * m, np.int32)
    for side in range(sides):  # 01, 12, ... and 0 with the last
        first, second = (side, side + 1) if side + 1 < sides else (0, side)
        for j in range(m):
            a, b = t[first, j], t[second, j]
            low[side * m + j], high[side * m + j] = min(a, b), max(a, b)
    order = np.arange(sides * m).astype(np.int32)
    for key in (high, low):  # sorted by counting, which keeps the order of what is alike
        starts = np.zeros(n + 1, np.int64)
        for node in key:
            starts[node + 1] += 1
        for node in range(n):
            starts[node + 1] += starts[node]
        ordered = np.empty_like(order)
        for k in order:
            ordered[starts[key[k]]] = k
            starts[key[k]] += 1
        order = ordered
    count = 0
    for i in range(sides * m):
        k = order[i]
        if i == 0 or low[k] != low[order[i - 1]] or high[k] != high[order[i - 1]]:
            facets[0, count], facets[1, count], f2t[0, count] = low[k], high[k], k % m
            count += 1
        elif k % m != f2t[0, count - 1]:
            f2t[1, count - 1] = k % m
        t2f[k // m, k % m] = count - 1
    return count
