"""How much of each of two BEM solutions goes into the new field, and how much it is smoothed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.spatial import cKDTree

from ..contact.solution import PunchSolution
from .functional import Weights
from .regular import RegularCouple

#: rings of nodes at the edge whose values constant pressures get wrong
RINGS = 2
#: points of which a field is continued
NEAREST = 24
#: share of node-collocated dual cells beside triangles. Their opposite errors inside cancel with
#: shares of 0.29 to 0.37 on uniform, random and graded meshes of discs, ellipses, squares, Ls and
#: annuli; the smaller share errs on the side of the better solution
OPPOSED = 0.3
#: share of edge-weighted dual cells beside such triangles, which are twice as many. With 0.3 to
#: 0.5 both grids are better than the better one was, on the same plans; with 0.8 they are not
WEIGHTED = 0.4
#: strongest smoothing D : A
MOST = 2.0
#: largest share of dual cells where the errors are of one sign: little is extrapolated
LARGEST = 1.25


@dataclass(frozen=True, eq=False)
class Mixture:
    """What the smoothing of a couple of BEM solutions starts from.

    Attributes
    ----------
    values : (n + m,) array of float
        Regular parts at the nodes of both grids, see `RegularCouple`.
    share : float
        Share of the solution on dual cells in them, the rest is that of the triangles; NaN where
        both kept their own values.
    weights : Weights
        Of the smoothing.
    reason : str
        The criterion that applied.
    """

    values: ndarray
    share: float
    weights: Weights
    reason: str


def mixture(couple: RegularCouple, solutions: tuple[PunchSolution, PunchSolution]) -> Mixture:
    """What a couple of BEM solutions deserves, by what is known of their errors.

    Cells of constant pressure cannot follow the singular edge. Their two outer rings are wrong,
    and the load missing or in excess there biases all the rest: dual cells that collocate at
    their nodes give too little inside, cells that collocate at their centroids too much,
    triangles more so than dual cells. Edge-weighted cells have no such bias. So

    - two edge-weighted solutions, whose errors have little to do with each other, are mixed, and
      smoothing takes out what alternates from cell to cell;
    - solutions without a singular edge keep their values, and are smoothed;
    - with one of them, the other solution has no share;
    - opposite errors, of node-collocated dual cells and triangles, cancel in a fixed mixture,
      since both come from the edge; and
    - errors of one sign, of centroids on both grids, are extrapolated a little: to the mixture
      with which the field carries the load when its outer rings are continued from inside, as
      far as the roughness of the solutions lets that decide, and within bounds.

    A solution's outer rings are left out if its pressures are constant in the cells, and
    continued linearly from inside. Values are carried from one grid to the other by the
    functional's coefficients, corrected to be exact for quadratic fields on regular grids.

    The smoothing D : A is `MOST` if the differences between nodes and means around them alternate
    more than they do not, and none if they alternate less than half as much, by the medians: a
    field that is smooth but curved is left alone.
    A1 : A2 is inverse to the squares of these differences, from 1 : 4 to 4 : 1: the rougher
    solution is trusted less.
    """
    n = len(couple.dual)
    constant = [s.punch.weights is None and len(couple.singular) > 0 for s in solutions]
    pressures = np.concatenate([s.pressure for s in solutions])
    field = np.repeat([0, 1], [n, couple.dual.mesh.nelements])
    known = ~(_outer(couple, RINGS) & np.take(constant, field))
    if all(constant) and any(s.punch.substrate.remainder is not None for s in solutions):
        # on other ground the regular part is not smooth at the edge, it cannot be continued
        known[:] = True
    inside = [int(known[field == i].sum()) for i in (0, 1)]
    if min(inside) < 6:
        values = couple.from_pressures(pressures)
        reason = "too few cells away from the edge to tell the solutions' errors"
        return Mixture(values, np.nan, Weights(1.0, 1.0), reason)

    at_loads = pressures / couple.means
    for i in (0, 1):
        mine = field == i
        at_loads[mine] = continued(couple.acting[:, mine], at_loads[mine], known[mine])
    values = couple.from_pressures(at_loads * couple.means)
    if not any(constant):
        share, reason = np.nan, "errors alternate from cell to cell"
        if all(s.footprint.slopes is not None for s in solutions):
            share = WEIGHTED
            values = _mixed(couple, values, known, share)
        return Mixture(values, share, _smoothing(couple, values, known), reason)

    if constant[0] != constant[1]:
        share, reason = float(constant[1]), "only one solution is edge-weighted"
    elif solutions[0].punch.collocation == "node":
        share, reason = OPPOSED, "errors of opposite signs cancel"
    else:
        share = _balanced(couple, solutions, at_loads, values, known)
        share, reason = float(np.clip(share, 0.0, LARGEST)), "errors of one sign, balanced by load"
    values = _mixed(couple, values, known, share)
    everywhere = np.ones_like(known)
    return Mixture(values, share, _smoothing(couple, values, everywhere), reason)


def continued(x: ndarray, values: ndarray, known: ndarray) -> ndarray:
    """Values with those not known replaced by planes through the nearest known ones.

    The planes fit `NEAREST` points, weighted with the inverse distance.
    """
    wanted = ~known
    if not wanted.any():
        return values.copy()
    tree = cKDTree(x[:, known].T)
    distance, near = tree.query(x[:, wanted].T, k=min(NEAREST, int(known.sum())))
    size = distance[:, -1:]
    offset = (x[:, known][:, near] - x[:, wanted][:, :, None]) / size
    planes = np.stack([np.ones_like(distance), *offset], axis=-1)
    weighted = planes * (size / distance.clip(1e-12 * size))[..., None]
    normal = np.einsum("nki,nkj->nij", weighted, planes)
    # points on one line leave the slope across it open: none
    normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    right = np.einsum("nki,nk->ni", weighted, values[known][near])
    out = values.copy()
    out[wanted] = np.linalg.solve(normal, right[..., None])[:, 0, 0]
    return out


def _outer(couple: RegularCouple, rings: int) -> ndarray:
    """Nodes in the outer rings and triangles that touch them."""
    mesh = couple.dual.mesh
    outer = np.zeros(mesh.p.shape[1], dtype=bool)
    outer[mesh.facets[:, couple.singular]] = True
    for _ in range(rings - 1):
        outer[mesh.t[:, outer[mesh.t].any(axis=0)]] = True
    return np.concatenate([outer, outer[mesh.t].any(axis=0)])


def _means(couple: RegularCouple, values: ndarray) -> ndarray:
    """Means around each node of the other grid's values; continued to nodes without."""
    n, inner = len(couple.dual), couple.neighbours.inner[0]
    first, second = values[:n], values[n:]
    around = couple.neighbours.alpha @ second
    points = np.concatenate([~inner, np.ones(len(second), dtype=bool)])
    if not inner.all():
        known = np.concatenate([np.zeros(int((~inner).sum()), bool), np.ones(len(second), bool)])
        whole = np.concatenate([around[~inner], second])
        around[~inner] = continued(couple.x[:, points], whole, known)[: (~inner).sum()]
    return np.concatenate([around, couple.neighbours.beta @ first])


def _residual(couple: RegularCouple, values: ndarray) -> ndarray:
    """Values minus the means, around each node, of the means around its neighbours."""
    n, (alpha, beta) = len(couple.dual), (couple.neighbours.alpha, couple.neighbours.beta)
    means = _means(couple, values)
    residual = values - np.concatenate([alpha @ means[n:], beta @ means[:n]])
    residual[:n][~couple.neighbours.inner[0]] = 0.0
    return residual


def _smoothing(couple: RegularCouple, values: ndarray, known: ndarray) -> Weights:
    """The weights of the smoothing."""
    residual = np.where(known, _residual(couple, values), 0.0)
    n, (alpha, beta) = len(couple.dual), (couple.neighbours.alpha, couple.neighbours.beta)
    smooth = np.concatenate([alpha @ (beta @ residual[:n]), beta @ (alpha @ residual[n:])])
    tiny = np.finfo(float).tiny
    loaded = known & (values != 0)
    if not loaded.any():
        return Weights(1.0, 1.0)
    # medians: a kink where contact ends is neither
    noise, bias = (np.median(np.abs(x[loaded])) for x in (residual - smooth, smooth))
    D = MOST * float(np.clip(2 * noise / max(bias, tiny) - 1, 0.0, 1.0))
    first, second = (np.mean(residual[part] ** 2) + tiny for part in (slice(n), slice(n, None)))
    trust = float(np.sqrt(np.clip(second / first, 1 / 4, 4)))
    return Weights(trust, 1 / trust, D1=D, D2=D)


def _balanced(
    couple: RegularCouple,
    solutions: Sequence[PunchSolution],
    at_loads: ndarray,
    values: ndarray,
    known: ndarray,
) -> float:
    """Share of the first solution for which continued fields carry the load."""
    n = len(couple.dual)
    area = couple.areas
    size = np.sqrt(area.sum())
    # from the plan's centroid and in units of the force
    centre = couple.acting @ area / area.sum()
    planes = np.vstack([np.ones_like(area), (couple.acting - centre[:, None]) / size])
    pressures = np.concatenate([s.pressure for s in solutions])
    excess = planes * area * (at_loads * couple.means - pressures)
    load = np.abs(pressures * area)
    parts, tiny = (slice(0, n), slice(n, None)), np.finfo(float).tiny
    first, second = (excess[:, part].sum(axis=1) / max(load[part].sum(), tiny) for part in parts)
    residual, rough = _residual(couple, values), []
    for part in parts:
        inside = known[part]
        size_of_values = max(np.mean(values[part][inside] ** 2), tiny)
        rough.append(np.mean(residual[part][inside] ** 2) / size_of_values)
    apart = first - second
    return float((rough[1] - second @ apart) / max(apart @ apart + sum(rough), tiny))


def _mixed(couple: RegularCouple, values: ndarray, known: ndarray, share: float) -> ndarray:
    """Both solutions mixed at the nodes of both grids, continued where one is not known."""
    n = len(couple.dual)
    # half of what two passes take off comes from one; exact for quadratic fields
    carried = _means(couple, values + _residual(couple, values) / 2)
    inner = couple.neighbours.inner[0]
    alpha, beta, trusted = couple.neighbours.alpha, couple.neighbours.beta, known.astype(float)
    around = np.concatenate([alpha @ trusted[n:], beta @ trusted[:n]]) > 0.999
    around[:n][~inner] = known[n:].all()
    own = np.repeat([share, 1 - share], [n, len(values) - n])
    there = (known | (own == 0)) & (around | (own == 1))
    return continued(couple.x, own * values + (1 - own) * carried, there)
