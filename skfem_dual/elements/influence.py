"""Settlement of the ground under uniformly loaded polygonal cells.

Seen from the field point, the integral of 1/r over a polygon is a sum over its ribs, closed for
each. Neighbouring cells share ribs, so every rib is integrated once and counted for the cell on
its left, against the cell on its right.
"""

import numpy as np
from numpy import ndarray

from ..grids.partition import Partition
from ..ground.substrates import Substrate
from ..kernels.compiled import compiled, inputs
from ..kernels.threads import in_blocks
from .edge_weights import EdgeWeights
from .remainder import remainder_rows


def influence_matrix(
    substrate: Substrate, partition: Partition, x: ndarray, weights: EdgeWeights | None = None
) -> ndarray:
    """Settlements at points under unit pressure on each cell: the d_ij of (5).

    Parameters
    ----------
    substrate : Substrate
        The ground.
    partition : Partition
        The loaded cells.
    x : (2, m) array of float
        Field points anywhere on the surface, also on ribs and nodes.
    weights : EdgeWeights, optional
        How the load varies inside edge-weighted cells, for what the influence function has
        beyond c / r; for c / r the variation is left to `EdgeCorrection`.

    Returns
    -------
    (m, ncells) array of float
        Settlement per unit pressure, positive into the ground.

    Examples
    --------
    The centre of a square with sides 2 settles by 8 asinh(1) / (pi E*):

    >>> from skfem import MeshQuad
    >>> from skfem_dual import HalfSpace
    >>> square = Partition.from_mesh(MeshQuad.init_tensor([-1.0, 1.0], [-1.0, 1.0]))
    >>> D = influence_matrix(HalfSpace(1.0, 0.0), square, [[0.0], [0.0]])
    >>> bool(np.isclose(D[0, 0], 8 * np.arcsinh(1) / np.pi, rtol=1e-14))
    True
    """
    x = as_points(x)
    matrix = np.zeros((x.shape[1], len(partition)))
    ribs = _ribs(partition)
    c = substrate.singular_coefficient
    in_blocks(lambda rows: _fill(*inputs(x[:, rows]), *ribs, c, matrix[rows]), x.shape[1])
    if substrate.remainder is not None:
        add = remainder_rows(substrate.remainder, partition, weights, x)
        factor = 1 / substrate.surface.young
        in_blocks(lambda rows: add(rows, factor, matrix[rows]), x.shape[1])
    return matrix


def surface_displacement(
    substrate: Substrate,
    partition: Partition,
    pressure: ndarray,
    x: ndarray,
    weights: EdgeWeights | None = None,
) -> ndarray:
    """Settlements at points ``x`` of shape (2, m) under one pressure per cell; no matrix."""
    x = as_points(x)
    # each rib counts with the jump of the pressure across it
    jump = np.append(pressure, 0.0)[partition.f2c]
    jump = substrate.singular_coefficient * (jump[0] - jump[1])
    out = np.empty(x.shape[1])
    ribs = _ribs(partition)
    in_blocks(lambda rows: _sum(*inputs(x[:, rows]), *ribs, jump, out[rows]), x.shape[1])
    if substrate.remainder is not None:
        add = remainder_rows(substrate.remainder, partition, weights, x)

        def work(rows: slice) -> None:
            block = np.zeros((rows.stop - rows.start, len(partition)))
            add(rows, 1 / substrate.surface.young, block)
            out[rows] += block @ pressure

        in_blocks(work, x.shape[1])
    return out


def as_points(x) -> ndarray:
    """``x`` as coordinates of shape (2, m).

    Raises
    ------
    ValueError
        If it has another shape or is not finite.
    """
    x = np.asarray(x, dtype=float)
    if x.ndim != 2 or x.shape[0] != 2:
        raise ValueError(f"expected points of shape (2, m), got {x.shape}")
    if not np.isfinite(x).all():
        bad = np.nonzero(~np.isfinite(x).all(axis=0))[0]
        raise ValueError(f"expected finite points; the first that is not: {bad[0]}")
    return x


def flat_points(x) -> tuple[ndarray, tuple[int, ...]]:
    """Points of any shape (2, ...) as coordinates of shape (2, m), and the shape behind the 2.

    Raises
    ------
    ValueError
        If there are no two coordinates, or one is not finite.
    """
    x = np.asarray(x, dtype=float)
    if x.ndim == 0 or x.shape[0] != 2:
        raise ValueError(f"expected points of shape (2, ...), got {x.shape}")
    return as_points(x.reshape(2, -1)), x.shape[1:]


def _ribs(partition: Partition) -> tuple[ndarray, ...]:
    p = partition.polygons.p
    along = p[:, partition.facets[1]] - p[:, partition.facets[0]]
    return inputs(p, partition.facets, partition.f2c, along, np.hypot(*along))


@compiled
def _distances(x, y, p, r):
    for k in range(p.shape[1]):
        dx, dy = p[0, k] - x, p[1, k] - y
        r[k] = np.sqrt(dx * dx + dy * dy)


@compiled
def _rib_integral(x, y, ax, ay, lx, ly, length, r1, r2):
    """Integral of 1/r over the triangle of the field point and a rib, positive on its left.

    The rib leads from (ax, ay) by (lx, ly); r1, r2 are the distances of its ends.
    """
    dx, dy = x - ax, y - ay
    cross = lx * dy - ly * dx
    if abs(cross) <= 1e-17 * length * length or r1 == 0.0 or r2 == 0.0:
        return 0.0
    h = cross / length
    if r1 + r2 > 4 * length:
        # 2 atanh(q): the logarithms below would cancel
        q = length / (r1 + r2)
        z = q * q
        s = z / 21 + 1 / 19
        s = s * z + 1 / 17
        s = s * z + 1 / 15
        s = s * z + 1 / 13
        s = s * z + 1 / 11
        s = s * z + 1 / 9
        s = s * z + 1 / 7
        s = s * z + 1 / 5
        s = s * z + 1 / 3
        s = s * z + 1
        return 2 * h * q * s
    t1 = -(lx * dx + ly * dy) / length
    t2 = t1 + length
    if t1 >= 0:
        return h * np.log((r2 + t2) / (r1 + t1))
    if t2 <= 0:
        return h * np.log((r1 - t1) / (r2 - t2))
    return h * np.log((r2 + t2) * (r1 - t1) / (h * h))


@compiled
def _fill(x, p, facets, f2c, along, length, c, matrix):
    """Add c times the integrals of 1/r over all cells to the rows of ``matrix``."""
    r = np.empty(p.shape[1])
    for i in range(x.shape[1]):
        x0, y0 = x[0, i], x[1, i]
        _distances(x0, y0, p, r)
        for f in range(facets.shape[1]):
            a, b = facets[0, f], facets[1, f]
            value = c * _rib_integral(
                x0, y0, p[0, a], p[1, a], along[0, f], along[1, f], length[f], r[a], r[b]
            )
            matrix[i, f2c[0, f]] += value
            if f2c[1, f] >= 0:
                matrix[i, f2c[1, f]] -= value


@compiled
def _sum(x, p, facets, f2c, along, length, jump, out):
    """Integrals of 1/r with the weight ``jump`` of each rib."""
    r = np.empty(p.shape[1])
    for i in range(x.shape[1]):
        x0, y0 = x[0, i], x[1, i]
        _distances(x0, y0, p, r)
        total = 0.0
        for f in range(facets.shape[1]):
            a, b = facets[0, f], facets[1, f]
            total += jump[f] * _rib_integral(
                x0, y0, p[0, a], p[1, a], along[0, f], along[1, f], length[f], r[a], r[b]
            )
        out[i] = total
