"""Triangles of a wanted size in a domain bounded by circles and polygons."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy import ndarray
from scipy.spatial import Delaunay, cKDTree
from skfem import MeshTri

from ..arguments import checked_integer, checked_number, checked_size
from ..errors import MeshError, MeshWarning, warn
from .checks import crossing_condition
from .corners import Corners, numbered, signed_areas, unit
from .curves import Curve, require_digits, shares
from .outline import inside_loops
from .planar import cross
from .preprocess import silent
from .quality import smallest_angles
from .relocation import to_means
from .short_facets import STEEPER, ShortFacets

#: nodes of the largest triangulations that are tried
MOST = 10**8
#: length of boundary facets over the size, at least
FINEST = 1e-6
#: growth of the size of triangles per distance from the boundary
GROWTH = 0.2
#: where lattices start, over their spacing: out of symmetry, so that counts change by ones
STARTS = 0.137 + 0.071j, 0.31 + 0.22j, 0.05 + 0.4j, 0.43 + 0.13j
#: smallest angle in degrees with which no better start of the lattice is looked for
GOOD = 30.0
#: number of nodes above which one start must do
MANY = 20000
#: areas over squares of lengths, and sines of angles, that rounding may make of nothing
ROUND = 1e-10
#: sizes so many times as large that leave so many of the nodes: there are no fewer
GROWN, KEPT = 1.3, 0.97
#: nodes over those aimed at that short facets take alone; how many are told of, over and beyond
MANY_MORE, TOLD, BEYOND = 1.5, 4, 1000
#: first sizes may be so many times too small; points are found again for each step from there
FAR = 10.0
#: sparse systems solved for the means of neighbours
ROUNDS = 30
#: height of an equilateral triangle over its side
HEIGHT = np.sqrt(3) / 2


def generated(
    curves: Sequence[Curve],
    size: float | None,
    n: int | None,
    graded: float | None = None,
    nboundary: int | None = None,
) -> MeshTri:
    """Triangulate the domain inside the first curve and outside the others.

    Parameters
    ----------
    curves : sequence of Curve
        They neither meet nor surround each other, apart from the first.
    size, n, graded, nboundary
        As those of `generate.disc`; they are checked.
    """
    if (size is None) == (n is None):
        raise ValueError(f"expected either size or n, got size={size!r} and n={n!r}")
    if size is not None:
        size = checked_size("size", size)
        box = curves[0].box
        if size > np.ptp(box, axis=1).max():
            raise ValueError(f"expected a size smaller than the domain, got {size}")
        if np.prod(np.ptp(box, axis=1) / size) > MOST:
            raise ValueError(f"expected a size that gives at most {MOST:g} nodes, got {size:g}")
    else:
        n = checked_integer("n", n, at_least=1 + sum(c.least for c in curves), at_most=MOST)
    ratio = 1.0
    if graded is not None:
        ratio = checked_number("graded", graded, above=0, at_most=1)
        if ratio < FINEST:
            raise ValueError(f"expected graded of at least {FINEST:g}, got {ratio:g}")
        if nboundary is not None:
            raise ValueError("expected either nboundary or graded as a number, got both")
    if nboundary is not None:
        least = sum(c.least for c in curves)
        nboundary = checked_integer("nboundary", nboundary, at_least=least, at_most=MOST)
    require_digits(curves[0].box)
    mesh = triangulated(curves, size, n or 0, ratio, nboundary)
    if n is not None and (found := mesh.nvertices) > max(TOLD * n, n + BEYOND):
        ends = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]]
        shortest = np.hypot(*(ends[:, 1] - ends[:, 0])).min()
        warn(
            f"expected about {n} nodes, got {found}: facets as short as {shortest:.3g} have small "
            "triangles around them. Remedy: leave out corners that are so near each other",
            MeshWarning,
        )
    return mesh


def triangulated(
    curves: Sequence[Curve],
    size: float | None,
    n: int = 0,
    ratio: float = 1.0,
    nboundary: int | None = None,
) -> MeshTri:
    """Triangulate the domain inside the first curve and outside the others.

    Parameters
    ----------
    curves : sequence of Curve
        They neither meet nor surround each other, apart from the first.
    size : float, optional
        Length of the facets away from the boundary.
    n : int
        Number of nodes aimed at, if ``size`` is None.
    ratio : float
        Length of the boundary facets over ``size``.
    nboundary : int, optional
        Number of boundary nodes, instead.

    Returns
    -------
    MeshTri
        Boundary nodes first, with the domain to the left, then inner nodes, each the mean of
        its neighbours. Boundaries ``edge`` and ``hole``, or ``hole0``, ``hole1``, ...
    """
    trouble = None
    for finer in 0.8 ** np.arange(6):
        best, merit = None, -np.inf
        for start in STARTS:
            try:
                if size is None:
                    points, loops = _wanted(curves, n, finer * ratio, nboundary, start)
                else:
                    points, loops = _points(curves, size, finer * ratio, nboundary, start)
                mesh, angle = _relaxed(points, loops)
            except MeshError as error:
                trouble = error
                continue
            met = size is not None or points.shape[1] > MANY_MORE * n
            missed = 0.0 if met else max(abs(points.shape[1] - n) - 1, 0) / n
            # a node of a hundred too many is as bad as twenty degrees
            if angle - 2000 * missed > merit:
                best, merit = (mesh, loops), angle - 2000 * missed
            if best and (merit > GOOD or points.shape[1] > MANY):
                break
        if best:
            return _tagged(*best)
        if nboundary is not None:
            break
    raise MeshError(
        "no triangulation with a valid dual grid found at this size. Remedy: choose a smaller "
        "size, more nodes or more boundary nodes"
    ) from trouble


def _wanted(
    curves: Sequence[Curve], n: int, ratio: float, nboundary: int | None, start: complex
) -> tuple[ndarray, ndarray]:
    """Points of the size that gives about ``n`` of them."""
    low, high = 0.0, np.inf  # sizes that give too many and too few
    before = np.inf, 0
    size = float(np.sqrt(np.prod(np.ptp(curves[0].box, axis=1)) / n))
    least = sum(c.length for c in curves) / (ratio * n)  # with less the boundary alone has more
    if nboundary is None and least > FAR * size:
        size = least
    points, loops = best = _points(curves, size, ratio, nboundary, start)
    for _ in range(20):
        excess = points.shape[1] - n
        if abs(excess) < abs(best[0].shape[1] - n):
            best = points, loops
        # one node more or less takes a step of 1 / (2 n) of the size
        if abs(excess) <= n // 2000 or high < low * (1 + 1 / (8 * n)):
            break
        # so many are on the boundary and around short facets, whatever the size
        if excess > 0 and size > GROWN * before[0] and points.shape[1] > KEPT * before[1]:
            break
        before = size, points.shape[1]
        low, high = (size, high) if excess > 0 else (low, size)
        inner, wanted = points.shape[1] - loops[-1], n - loops[-1]
        guess = size * min(max(float(np.sqrt(max(inner, 1) / max(wanted, 1))), 0.5), 2.0)
        if not low < guess < high:
            guess = float(np.sqrt(low * high)) if 0 < low < high < np.inf else size
            guess *= 1.0 if guess != size else 1.3 if excess > 0 else 1 / 1.3
        size = guess
        points, loops = _points(curves, size, ratio, nboundary, start)
    return best


def _points(
    curves: Sequence[Curve], size: float, ratio: float, nboundary: int | None, start: complex
) -> tuple[ndarray, ndarray]:
    """Boundary points, a row of points facing them and lattices inside.

    Returns the points and the number of boundary points up to each curve, from 0.
    """
    lengths = np.array([c.length for c in curves])
    least = np.array([c.least for c in curves])
    total = nboundary or round(lengths.sum() / (ratio * size))
    counts = shares(total, lengths, least)
    boundary = [c.points(k) for c, k in zip(curves, counts)]
    edge, short = lengths.sum() / counts.sum(), None
    if nboundary is None and (short := ShortFacets.of(boundary, edge)) is not None:
        edge = ratio * size
        boundary = [c.points(k, partial(short.width, most=edge)) for c, k in zip(curves, counts)]
    counts = np.array([x.shape[1] for x in boundary])  # more where a curve asks for more
    boundary[1:] = [q[:, ::-1] for q in boundary[1:]]

    def depth(x: ndarray) -> ndarray:
        outer, *holes = (c.depth(x) for c in curves)
        return np.minimum.reduce([outer, *(-h for h in holes)])

    near = min(edge, 1.5 * size)  # boundary facets may be long
    # apexes of equilateral triangles on the boundary facets, thinned out at corners
    onward = np.hstack([np.diff(q, axis=1, append=q[:, :1]) for q in boundary])
    long = edge if short is None else np.hypot(*onward)
    high = near if short is None else np.minimum(long, near)
    row = np.hstack(boundary) + onward / 2
    row += HEIGHT * high / long * np.stack([-onward[1], onward[0]])
    high = np.broadcast_to(high, row.shape[1:])
    kept = depth(row) > 0.75 * HEIGHT * high
    row, high = row[:, kept], high[kept]
    close = cKDTree(row.T).query_pairs(0.65 * near, output_type="ndarray")
    if short is not None:
        apart = np.hypot(*(row[:, close[:, 0]] - row[:, close[:, 1]]))
        close = close[apart < 0.65 * high[close].min(axis=1)]
    row = np.delete(row, np.unique(close.max(axis=1, initial=0)), axis=1) if len(close) else row

    inside = _lattice(curves, depth, size, near, start, short)
    points = np.ascontiguousarray(np.hstack([*boundary, row, inside]))
    return points, np.cumsum([0, *counts])


def _lattice(
    curves: Sequence[Curve],
    depth: Callable[[ndarray], ndarray],
    size: float,
    edge: float,
    start: complex,
    short: ShortFacets | None,
) -> ndarray:
    """Hexagonal lattice behind the row, refined towards the boundary if ``edge`` is small, and
    around short facets.

    Each refinement adds the middles of the triangles, so distances shrink by sqrt(3).
    """
    least = min(edge, size) if short is None else min(edge, size, short.least)
    steepest = GROWTH if short is None else STEEPER

    def wanted(x: ndarray, d: ndarray) -> ndarray:
        width = np.minimum(edge + GROWTH * np.maximum(d, 0), size)
        return width if short is None else np.minimum(width, short.width(x, size))

    def level_of(width: ndarray | float) -> ndarray:
        return np.floor(0.5 - 2 * np.log(width / size) / np.log(3))

    def chosen(x: ndarray, d: ndarray, width: ndarray, level: int) -> ndarray:
        facing = edge if short is None else np.clip(width - STEEPER * d, least, edge)
        here = d > HEIGHT * facing + 0.5 * width
        if level:
            here &= level_of(width) >= level
        return x[:, here]

    (left, right), (bottom, top) = curves[0].box
    middle = complex((left + right) / 2, (bottom + top) / 2)
    m = int(np.ceil((top - bottom) / 2 / (size * HEIGHT))) + 2
    k = int(np.ceil((right - left) / 2 / size)) + 2
    rows, columns = np.arange(-m, m + 1)[:, None], np.arange(-k, k + 1)
    basis = complex(size)
    z = middle + size * start + basis * (columns + rows % 2 / 2 + 1j * HEIGHT * rows).ravel()
    d = depth(_plane(z))
    width = wanted(_plane(z), d)
    points = [chosen(_plane(z), d, width, 0)]
    for level in range(1, int(level_of(least)) + 1):
        reach = 2 * abs(basis)
        near = (d > -reach) & (level_of(np.maximum(width - steepest * reach, least)) >= level)
        basis *= (1 + np.exp(1j * np.pi / 3)) / 3  # to the middle of a triangle
        new = np.concatenate([z[near] + basis, z[near] + 2 * basis])
        d_new = depth(_plane(new))
        width_new = wanted(_plane(new), d_new)
        points.append(chosen(_plane(new), d_new, width_new, level))
        z, d = np.concatenate([z[near], new]), np.concatenate([d[near], d_new])
        width = np.concatenate([width[near], width_new])
    return np.hstack(points)


def _plane(z: ndarray) -> ndarray:
    """Complex numbers as points, shape (2, n)."""
    return z.view(float).reshape(-1, 2).T


def _relaxed(points: ndarray, loops: ndarray) -> tuple[MeshTri, float]:
    """The better of two triangulations, the second of the relocated points of the first, and its
    smallest angle in degrees, -inf if it has no dual grid."""
    first = _at_means(_inside(points, loops), loops)
    angle = _angle(first)
    if _delaunay(first):
        return first, angle
    second = _at_means(_inside(first.p, loops), loops)
    again = _angle(second)
    return (second, again) if again > angle + 1e-9 else (first, angle)


def _angle(mesh: MeshTri) -> float:
    """Smallest angle in degrees, -inf if a facet is not crossed by its rib."""
    if len(crossing_condition(Corners(mesh)).offending):
        return -np.inf
    return float(np.degrees(smallest_angles(mesh.p, mesh.t).min()))


def _delaunay(mesh: MeshTri) -> bool:
    """Whether the angles that face a facet nowhere add up to more than two right ones."""
    inner = np.nonzero(mesh.f2t[1] != -1)[0]
    ends, pair = mesh.facets[:, inner], mesh.f2t[:, inner]
    p, facing = mesh.p * unit(mesh.p), mesh.t[:, pair].sum(axis=0) - ends.sum(axis=0)
    arms = p[:, ends][:, :, None] - p[:, facing][:, None]
    sine, cosine = np.abs(cross(arms[:, 0], arms[:, 1])), np.sum(arms[:, 0] * arms[:, 1], axis=0)
    sum_of_angles = sine[0] * cosine[1] + cosine[0] * sine[1]
    return bool((sum_of_angles >= -ROUND * np.hypot(sine, cosine).prod(axis=0)).all())


def _at_means(mesh: MeshTri, loops: ndarray) -> MeshTri:
    """The mesh with its inner nodes at the means of their neighbours."""
    free = np.arange(mesh.p.shape[1]) >= loops[-1]
    p = np.ascontiguousarray(to_means(mesh, free, ROUNDS, silent)[0])
    return numbered(MeshTri(p, mesh.t))


def _inside(points: ndarray, loops: ndarray) -> MeshTri:
    """Delaunay's triangles to the left of the loops.

    Raises MeshError if a boundary facet or a node is lost.
    """
    # qhull loses digits far from the origin and overflows at some sizes
    local = (points - points.mean(axis=1, keepdims=True)) * unit(points)
    t = np.ascontiguousarray(Delaunay(local.T).simplices.T, dtype=np.int32)
    # triangles with nodes of the boundary alone may lie outside, or be flat
    only = np.nonzero((t < loops[-1]).all(axis=0))[0]
    start, end = _boundary(loops)
    v = local[:, t[:, only]]
    outside = ~inside_loops(v.mean(axis=1), local[:, start], local[:, end])
    longest = np.max(np.ptp(v, axis=1), axis=0)
    outside |= np.abs(signed_areas(local, t[:, only])) < ROUND * longest**2
    t = np.ascontiguousarray(np.delete(t, only[outside], axis=1))
    if t.shape[1] == 0:
        raise MeshError("no triangles are left, all are flat")
    mesh = numbered(MeshTri(points, t))
    along = np.sort([start, end], axis=0)
    edge = mesh.facets[:, mesh.boundary_facets()]
    if not np.array_equal(edge, along[:, np.lexsort(along[::-1])]):
        raise MeshError("facets on the boundary are lost")
    if not np.bincount(t.ravel(), minlength=points.shape[1]).all():
        raise MeshError("nodes are lost")
    return mesh


def _boundary(loops: ndarray) -> ndarray:
    """End points of the boundary facets, the domain to the left."""
    ends = np.arange(1, loops[-1] + 1)
    ends[loops[1:] - 1] = loops[:-1]
    return np.stack([np.arange(loops[-1]), ends])


def _tagged(mesh: MeshTri, loops: ndarray) -> MeshTri:
    facets = mesh.boundary_facets()
    loop = np.searchsorted(loops, mesh.facets[0, facets], side="right") - 1
    holes = len(loops) - 2
    names = ["edge", *(["hole"] if holes == 1 else [f"hole{i}" for i in range(holes)])]
    return mesh.with_boundaries({name: facets[loop == i] for i, name in enumerate(names)})
