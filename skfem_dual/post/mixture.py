"""How much of each of two BEM solutions goes into the new field, and how much it is smoothed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy import ndarray

from ..contact.footprint import Footprint
from ..grids.nearest import nearest
from ..ground.substrates import HalfSpace, Substrate
from ..solutions.punch_solution import PunchSolution
from .functional import Weights
from .laws import Law, means
from .regular import RegularCouple

#: points of which a field is continued
NEAREST = 24
#: share of node-collocated dual cells beside triangles. Their opposite errors inside cancel with
#: shares of 0.29 to 0.37 on uniform, random and graded meshes of discs, ellipses, squares, Ls and
#: annuli; the smaller share errs on the side of the better solution
OPPOSED = 0.3
#: part of the load that their mixture, continued to the edge, may miss
CARRIED = 0.03
#: the same of triangles of which one ring is continued. Polygons with 4 to 8 corners, some with
#: holes, of 100 to 600 nodes come out up to 1.05 times as far off as the closer solution with
#: less, up to twice as far, or four times, with more
SPOILT = 0.05
#: what dual cells have too much inside, over what triangles have more: 1.4 on uniform meshes, less
#: on graded ones; half of the former is safe on all
BEYOND = 0.7
#: a field continued by the law of the ground may be so far, over what it corrects, from one by the
#: law of homogeneous ground: at most 0.18 on layers half as thick again as the plan is wide, where
#: both are closer than what they correct; 0.4 and more on crusts and thin layers, where either may
#: be many times as far off
AGREE = 0.25
#: whose law is that of the edge alone
HOMOGENEOUS = HalfSpace(1.0, 0.0)
#: strongest smoothing D : A
MOST = 2.0
#: fewest cells a field is continued from
FEWEST = 6
#: pressures up to so much of the largest are none
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Mixture:
    """What is known of a couple of BEM solutions with a singular edge.

    Attributes
    ----------
    cells : pair of Footprint
        Dual cells and triangles, edge-weighted.
    laws : sequence of Law
        Pressures, of one or of both solutions, with the law of the edge inside the cells.
    shares : sequence of float
        Of them.
    share : float
        That of the solution on dual cells.
    reason : str
        The criterion that applied.
    """

    cells: tuple[Footprint, Footprint]
    laws: Sequence[Law]
    shares: Sequence[float]
    share: float
    reason: str


def mixture(couple: RegularCouple, solutions: tuple[PunchSolution, PunchSolution]) -> Mixture:
    """What a couple of BEM solutions deserves, by what is known of their errors.

    Edge-weighted cells have no bias, and the errors of two such solutions have little to do with
    each other: they are mixed in equal shares. Beside one of them, a solution with constant
    pressures has no share.

    Cells of constant pressure cannot follow the singular edge. Their outer rings are wrong, and
    the load missing or in excess there biases all the rest: dual cells that collocate at their
    nodes give too little inside, cells that collocate at their centroids too much, triangles more
    so than dual cells. Outer rings are continued from inside, the pressure over the law of the
    edge being linear there. Then

    - opposite errors, of node-collocated dual cells and triangles, cancel in a fixed mixture,
      since both come from the edge. Two rings are continued. If the mixture does not carry the
      load, there are too few cells to continue from: the triangles alone are taken, with one
      ring, times the linear function with which they do;
    - of errors of one sign, of centroids on both grids, that of dual cells is the smaller one.
      It is reduced by a part of the difference, and what is left of the load is that of the ring.

    Where one continued ring of triangles makes them carry far less or more than the load, as
    around holes, the closer solution keeps its pressures, in each part of the plan by itself.

    On ground that is not homogeneous the law of the edge has a factor, which is that of a disc:
    under other plans the pressure over it is not linear in the outer rings, most of all next to
    corners, and what is continued there may be many times as far off as the solutions. Where the
    factor moves the result by more than `AGREE` of what it corrects, neither is trusted: the
    closer solution keeps its pressures, with the law inside its cells.
    """
    weighted = [s.punch.weights is not None for s in solutions]
    raw = [Law(_edge_weighted(s), s.pressure) for s in solutions]
    cells = raw[0].cells, raw[1].cells
    if any(weighted):
        laws = [law for law, w in zip(raw, weighted, strict=True) if w]
        reason = "mean of both" if all(weighted) else "only one solution is edge-weighted"
        shares = [1 / len(laws)] * len(laws)
        return Mixture(cells, laws, shares, weighted[0] / len(laws), reason)
    opposed = solutions[0].punch.collocation == "node"
    closer = Mixture(cells, [raw[int(opposed)]], [1.0], float(not opposed), "")
    few = [_too_few(couple, law, outer) for law, outer in zip(raw, couple.outer(2))]
    loaded = np.bincount(_parts(couple, closer.laws[0]), closer.laws[0].pressure != 0) > 0
    kept = loaded & (few[0] | few[1])
    if (kept == loaded).all():
        reason = "too few cells away from the edge, those of the closer solution are kept"
        return replace(closer, reason=reason)

    def sharpened(laws: Sequence[Law], kept: ndarray) -> Mixture:
        found = _sharpened(couple, solutions, [_within(couple, law, ~kept) for law in laws])
        return _with_kept(couple, found, closer, kept)

    found = sharpened(raw, kept)
    if raw[0].weights.law is not None:
        plain = [Law(_edge_weighted(s, HOMOGENEOUS), s.pressure) for s in solutions]
        other = sharpened(plain, kept)
        own, by_other, by_closer = (
            means(couple, m.laws, m.shares) for m in (found, other, closer)
        )
        apart, moved = (couple.areas @ (own - p) ** 2 for p in (by_other, by_closer))
        if not apart <= AGREE**2 * moved:
            reason = "the law of the edge is not known, cells of the closer solution are kept"
            return replace(closer, reason=reason)
    law = _within(couple, raw[1], ~kept)
    ring = _continued(couple, law, couple.outer(1)[1])
    if not (spoilt := np.abs(_missed(couple, ring, law)) > SPOILT).any():
        return found
    kept = kept | spoilt
    if (kept == loaded).all():
        return replace(closer, reason="too coarse to continue, the closer solution is kept")
    return sharpened(raw, kept)


def _with_kept(couple: RegularCouple, found: Mixture, closer: Mixture, kept: ndarray) -> Mixture:
    """With the pressures of the closer solution in some parts of the plan."""
    if not kept.any():
        return found
    laws = [*found.laws, *(_within(couple, law, kept) for law in closer.laws)]
    reason = f"{found.reason}; {kept.sum()} of {len(kept)} parts keep those of the closer solution"
    return replace(found, laws=laws, shares=[*found.shares, 1.0], reason=reason)


def _within(couple: RegularCouple, law: Law, parts: ndarray) -> Law:
    """With pressures in some parts of the plan only."""
    return replace(law, pressure=np.where(parts[_parts(couple, law)], law.pressure, 0.0))


def _sharpened(
    couple: RegularCouple, solutions: tuple[PunchSolution, PunchSolution], raw: Sequence[Law]
) -> Mixture:
    """Constant pressures continued to the edge by the law of the edge, and their errors reduced
    by what is known of their signs."""
    cells = raw[0].cells, raw[1].cells
    rings = [couple.outer(k) for k in (1, 2)]
    if solutions[0].punch.collocation == "node":
        laws = [_continued(couple, *pair) for pair in zip(raw, rings[1], strict=True)]
        shares = [OPPOSED, 1 - OPPOSED]
        missed = [_missed(couple, *pair) for pair in zip(laws, raw, strict=True)]
        if np.abs(np.dot(shares, missed)).max() < CARRIED:
            return Mixture(cells, laws, shares, OPPOSED, "errors of opposite signs cancel")
        law = _continued(couple, raw[1], rings[0][1])
        law = _balanced(couple, law, solutions[1], np.ones(len(law.pressure), dtype=bool))
        return Mixture(cells, [law], [1.0], 0.0, "too coarse to mix, triangles are closer")
    first, second = (_continued(couple, *pair) for pair in zip(raw, rings[0], strict=True))
    excess = _apart(first, second, rings[1][1])
    law = replace(first, pressure=first.pressure * (1 - BEYOND * excess))
    law = _balanced(couple, law, solutions[0], rings[0][0])
    return Mixture(cells, [law], [1.0], 1.0, "errors of one sign, that of dual cells reduced")


def _edge_weighted(solution: PunchSolution, ground: Substrate | None = None) -> Footprint:
    """The cells of a solution, as if their pressure followed the law of the edge, on its ground
    or on another one."""
    punch = solution.punch
    if punch.weights is not None:
        return solution.footprint
    ground = punch.substrate if ground is None else ground
    return Footprint.from_basis(ground, punch.basis, origin=punch.origin)


def _known(law: Law, outer: ndarray) -> ndarray:
    """Cells in contact that are not in the outer rings."""
    return ~outer & (law.pressure != 0)


def _too_few(couple: RegularCouple, law: Law, outer: ndarray) -> ndarray:
    """Parts of the plan in contact with too few cells that are not in the outer rings."""
    of = _parts(couple, law)
    known, loaded = (np.bincount(of, each) for each in (_known(law, outer), law.pressure != 0))
    return (loaded > 0) & (known < FEWEST)


def _parts(couple: RegularCouple, law: Law) -> ndarray:
    """Number of the part of the plan in which each cell lies."""
    return couple.parts[0 if law.cells.on_dual_cells else 1]


def _missed(couple: RegularCouple, law: Law, raw: Law) -> ndarray:
    """Loads that the parts of the plan carry beyond those of the solution, over these."""
    area, of = law.cells.partition.areas, _parts(couple, law)
    beyond = np.bincount(of, area * (law.pressure - raw.pressure))
    loads = np.bincount(of, area * np.abs(raw.pressure))
    return np.divide(beyond, loads, out=np.zeros_like(loads), where=loads > 0)


def _continued(couple: RegularCouple, law: Law, outer: ndarray) -> Law:
    """With pressures in the outer rings that follow from those inside, in each part of the plan;
    zero stays zero."""
    cells, loaded, known = law.cells, law.pressure != 0, _known(law, outer)
    w, of = law.weights.in_cells, _parts(couple, law)
    s = law.pressure / w
    s[loaded] = continued(cells.acting[:, loaded], s[loaded], known[loaded], of[loaded])
    return replace(law, pressure=s * w)


def _balanced(couple: RegularCouple, law: Law, solution: PunchSolution, changed: ndarray) -> Law:
    """With pressures in some of the cells changed by a linear function times them, which gives
    each part of the plan force and moments as in the solution, in the mean square where they lie
    in a line."""
    cells, pressure, of = law.cells, law.pressure.copy(), _parts(couple, law)
    size = np.array([[1.0], *[[np.sqrt(cells.partition.areas.sum())]] * 2])
    planes, loads = cells.planes(cells.acting) / size, cells.resultants / size
    given = solution.footprint.resultants * solution.pressure / size
    for number in range(of.max() + 1):
        own, part = of == number, changed & (of == number)
        missing = given[:, own].sum(axis=1) - loads[:, own] @ pressure[own]
        shares = planes[:, part] * np.abs(pressure[part])
        factor = np.linalg.lstsq(loads[:, part] @ shares.T, missing, rcond=None)[0]
        pressure[part] += factor @ shares
    return replace(law, pressure=pressure)


def _apart(first: Law, second: Law, outer: ndarray) -> float:
    """How much more load inside the triangles have than the dual cells, relative."""
    inside = ~outer
    loads = [
        np.abs(np.bincount(element, load, len(outer)))[inside].sum()
        for _, element, _, load in (law.pieces() for law in (first, second))
    ]
    return float(loads[1] / loads[0] - 1)


def continued(x: ndarray, values: ndarray, known: ndarray, of: ndarray | None = None) -> ndarray:
    """Values with those not known replaced by planes through the nearest known ones.

    The planes fit `NEAREST` points, weighted with the inverse distance, of the same part where
    the numbers ``of`` parts are given.
    """
    wanted = ~known
    if not wanted.any():
        return values.copy()
    of = np.zeros(len(known), dtype=int) if of is None else of
    order = np.nonzero(known)[0]
    order = order[np.argsort(of[order], kind="stable")]
    counts = np.bincount(of[order], minlength=of.max() + 1)
    starts, count = np.append(0, np.cumsum(counts)), min(NEAREST, int(counts.max()))
    followed = nearest(x[:, order], starts, x[:, wanted], of[wanted], count)
    near, distance = order[followed.number], np.sqrt(followed.square)
    size = np.max(distance, axis=1, where=np.isfinite(distance), initial=0.0)[:, None]
    offset = (x[:, near] - x[:, wanted][:, :, None]) / size
    planes = np.stack([np.ones_like(distance), *offset], axis=-1)
    weighted = planes * (followed.share * size / distance.clip(1e-12 * size))[..., None]
    normal = np.einsum("nki,nkj->nij", weighted, planes)
    # points on one line leave the slope across it open: none
    normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    right = np.einsum("nki,nk->ni", weighted, values[near])
    out = values.copy()
    out[wanted] = np.linalg.solve(normal, right[..., None])[:, 0, 0]
    return out


def smoothing(couple: RegularCouple, values: ndarray) -> Weights:
    """The weights with which solutions without a singular edge are smoothed.

    D : A is `MOST` if the differences between nodes and means around them alternate more than
    they do not, and none if they alternate less than half as much, by the medians: a field that
    is smooth but curved is left alone. A1 : A2 is inverse to the squares of these differences,
    from 1 : 4 to 4 : 1: the rougher solution is trusted less. Nodes beside the end of contact do
    not count for D: its kink is no error, and smoothing would carry it to pressures that are
    closer. Where fewer than `FEWEST` are left nothing is smoothed.
    """
    residual = _residual(couple, values)
    n, (alpha, beta) = len(couple.dual), (couple.neighbours.alpha, couple.neighbours.beta)

    def around(x: ndarray) -> ndarray:
        return np.concatenate([alpha @ x[n:], beta @ x[:n]])

    smooth = around(around(residual))
    tiny = np.finfo(float).tiny
    loaded = np.abs(values) > ROUNDING * np.abs(values).max()
    beside = np.where(loaded, 0.0, 1.0)
    for _ in range(2):
        beside = beside + around(beside)
    inside = beside == 0
    if inside.sum() < FEWEST:
        return Weights(1.0, 1.0)
    noise, bias = (np.median(np.abs(x[inside])) for x in (residual - smooth, smooth))
    D = MOST * float(np.clip(2 * noise / max(bias, tiny) - 1, 0.0, 1.0))
    first, second = (np.mean(residual[part] ** 2) + tiny for part in (slice(n), slice(n, None)))
    trust = float(np.sqrt(np.clip(second / first, 1 / 4, 4)))
    return Weights(trust, 1 / trust, D1=D, D2=D)


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
