"""Triangulations of plans, near uniform or graded to the edge, and polar grids."""

from collections.abc import Sequence

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import MeshQuad, MeshTri

from ..arguments import (
    checked_choice,
    checked_circle,
    checked_flag,
    checked_integer,
    checked_place,
    checked_sequence,
    checked_size,
)
from ..messages import shown
from .checks import dual_conditions
from .corners import Corners, numbered
from .curves import Circle, Curve, Polygon, check_loops, corners_of
from .report import require
from .sizing import MOST, generated

#: laws of distances from 0 in the middle to 1 at the edge
LAWS = {
    "sine": lambda s: np.sin(np.pi / 2 * s),
    "quadratic": lambda s: s * (2 - np.abs(s)),
}

Grading = str | float | None


def disc(
    size: float | None = None,
    n: int | None = None,
    *,
    radius: float = 1.0,
    centre: Sequence[float] = (0.0, 0.0),
    graded: Grading = None,
    nboundary: int | None = None,
    true_area: bool = True,
) -> MeshTri:
    """Triangulation of a disc.

    Parameters
    ----------
    size : float, optional
        Length of the facets, of the largest if graded by a number; a law makes those in the middle
        longer, by its slope there.
    n : int, optional
        Number of nodes aimed at; either ``size`` or ``n`` is given.
    radius, centre : float, (2,) array of float
        Of the circle.
    graded : {"sine", "quadratic"} or float, optional
        None: near uniform; triangles of similar size close to equilateral, every inner node the
        mean of its neighbours (conditions a, b, c of Section 4.2 of the paper). A name: such a
        triangulation drawn to the edge by ``r = sin(pi s / 2)`` or ``r = 1 - (1 - s)^2``,
        where ``s`` is its distance to the centre over the radius; the triangles at the edge
        are flat. A number from 0 to 1: the length of boundary facets over ``size``; lengths
        grow by 0.2 for every unit of distance to the boundary, and triangles stay close to
        equilateral.
    nboundary : int, optional
        Number of boundary nodes; by default it follows from the size. As triangles grow gradually
        from the boundary, many of these take more than ``n`` nodes: 120 beside ``n=150`` make 494.
    true_area : bool
        Whether the polygon of the boundary nodes has the area of the circle, for a settlement tens
        of times closer to that of the circle; else its nodes lie on the circle.

    Returns
    -------
    MeshTri
        With the boundary ``edge`` and a valid dual grid. The same arguments give the same mesh.

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong; `MeshError` if the size is too coarse for the domain.

    Examples
    --------
    The triangulation of Fig. 10 of the paper has 944 triangles, 513 and 80 boundary nodes:

    >>> disc(n=513, nboundary=80)
    <skfem MeshTri1 object>
      Number of elements: 944
      Number of vertices: 513
      Number of nodes: 513
      Named boundaries [# facets]: edge [80]
    """
    middle, radius = checked_circle(centre, radius)
    inscribed = not checked_flag("true_area", true_area)
    mesh = _generate([Circle(middle, radius, inscribed)], size, n, graded, nboundary)
    if not isinstance(graded, str):
        return mesh
    x = mesh.p - np.array(middle)[:, None]
    s = np.hypot(*x) / radius
    return _moved(mesh, np.array(middle)[:, None] + x * _ratio(LAWS[graded](s), s))


def annulus(
    inner: float,
    outer: float = 1.0,
    size: float | None = None,
    n: int | None = None,
    *,
    hole: Sequence[float] = (0.0, 0.0),
    graded: Grading = None,
    nboundary: int | None = None,
    true_area: bool = True,
) -> MeshTri:
    """Triangulation of a concentric or eccentric annulus.

    Parameters
    ----------
    inner, outer : float
        Radii of the hole and of the annulus, whose centre is the origin.
    hole : (2,) array of float
        Centre of the hole.
    size, n, nboundary, true_area
        As for `disc`, for each circle; ``nboundary`` counts the nodes on both.
    graded : {"sine", "quadratic"} or float, optional
        As for `disc`, but a law holds to both edges: with ``u`` from -1 on the hole to 1 on the
        outer circle, along circles that pass from one to the other, ``sin(pi u / 2)`` or
        ``u (2 - |u|)``.

    Returns
    -------
    MeshTri
        With the boundaries ``edge`` and ``hole`` and a valid dual grid.

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong; `MeshError` if the size is too coarse for the domain.

    Examples
    --------
    The triangulation of Fig. 13 of the paper has 929 triangles and 539 nodes, 149 of them on the
    boundary; the number of nodes is met nearly:

    >>> annulus(0.3, n=539, hole=(0.3, 0.0), nboundary=149).nelements
    939
    """
    inner, outer = checked_size("inner", inner), checked_size("outer", outer)
    middle = checked_place("hole", hole)
    if np.hypot(*middle) + inner >= outer:
        raise ValueError(
            f"expected the hole to lie inside the circle of radius {outer}, got a hole of "
            f"radius {inner} at {middle}"
        )
    inscribed = not checked_flag("true_area", true_area)
    curves = [Circle((0.0, 0.0), outer, inscribed), Circle(middle, inner, inscribed)]
    mesh = _generate(curves, size, n, graded, nboundary)
    if not isinstance(graded, str):
        return mesh
    # circle s from 0 on the hole to 1 outside has the centre (1 - s) c, the radius r + s dr
    c = np.array(middle)[:, None]
    r, dr = inner, outer - inner
    y = mesh.p - c
    linear, square = np.sum(y * c, axis=0) - r * dr, np.sum(c * c) - dr**2
    constant = np.sum(y * y, axis=0) - r**2
    s = -(linear + np.sqrt(np.maximum(linear**2 - square * constant, 0.0))) / square
    onward = (1 + LAWS[graded](2 * s - 1)) / 2
    outward = (mesh.p - (1 - s) * c) / (r + s * dr)
    return _moved(mesh, (1 - onward) * c + (r + onward * dr) * outward)


def rectangle(
    width: float = 2.0,
    height: float = 2.0,
    size: float | None = None,
    n: int | None = None,
    *,
    graded: Grading = None,
    nboundary: int | None = None,
) -> MeshTri:
    """Triangulation of a rectangle whose centre is the origin.

    Parameters
    ----------
    width, height : float
        Lengths of the sides along the first and the second axis.
    size, n, nboundary
        As for `disc`.
    graded : {"sine", "quadratic"} or float, optional
        As for `disc`; a law holds for both coordinates over half the sides.

    Returns
    -------
    MeshTri
        With the boundary ``edge`` and a valid dual grid.

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong; `MeshError` if the size is too coarse for the domain.
    """
    half = np.array([[checked_size("width", width)], [checked_size("height", height)]]) / 2
    corners = half * np.array([[-1.0, 1, 1, -1], [-1, -1, 1, 1]])
    mesh = _generate([Polygon(corners)], size, n, graded, nboundary)
    if not isinstance(graded, str):
        return mesh
    return _moved(mesh, half * LAWS[graded](mesh.p / half), boundary=True)


def polygon(
    outline: ArrayLike | Sequence,
    holes: Sequence = (),
    size: float | None = None,
    n: int | None = None,
    *,
    graded: float | None = None,
    nboundary: int | None = None,
) -> MeshTri:
    """Triangulation of a polygon, with holes if wanted; corners may be re-entrant.

    Parameters
    ----------
    outline : (2, k) array of float, or sequence of pairs
        Corners in order, in either sense.
    holes : sequence of (2, k) arrays of float, or of sequences of pairs
        Corners of the holes.
    size, n, nboundary
        As for `disc`; ``nboundary`` counts the nodes on outline and holes. Without it triangles
        around sides far shorter than the others are as small as these, and grow by 0.4 for every
        unit of distance, which may take more than ``n`` nodes.
    graded : float, optional
        The length of boundary facets over ``size``, as for `disc`.

    Returns
    -------
    MeshTri
        With a valid dual grid, the boundary ``edge`` and, if there are holes, ``hole`` or
        ``hole0``, ``hole1``, ...

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong, as when sides cross or a hole is not inside; `MeshError` if the
        size is too coarse for the domain.

    Examples
    --------
    The excised square of Fig. 12 of the paper has 1118 triangles and 608 nodes, 96 of them on
    the boundary; the number of nodes is met nearly:

    >>> x = [-1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5, -0.5, -0.5, -1]
    >>> y = [-0.5, -0.5, -1, -1, -0.5, -0.5, 0.5, 0.5, 1, 1, 0.5, 0.5]
    >>> polygon([x, y], n=608, nboundary=96).nelements
    1122
    """
    if isinstance(graded, str):
        raise ValueError(f"expected graded as a number from 0 to 1 for polygons, got {graded!r}")
    loops = [corners_of("outline", outline)]
    for i, hole in enumerate(checked_sequence("holes", holes)):
        loops.append(corners_of(f"holes[{i}]", hole))
    check_loops(loops)
    return _generate([Polygon(loop) for loop in loops], size, n, graded, nboundary)


def polar(
    rings: int,
    sectors: int,
    *,
    radius: float = 1.0,
    graded: str | None = None,
    true_area: bool = True,
) -> MeshQuad:
    """Polar grid of quadrilaterals on a disc, that of Table 1 of the paper.

    Parameters
    ----------
    rings, sectors : int
        Number of cells along the radius and around.
    radius : float
        Of the disc.
    graded : {"sine", "quadratic"}, optional
        None: rings of equal width; otherwise drawn to the edge by ``r = sin(pi s / 2)`` or
        ``r = 1 - (1 - s)^2``.
    true_area : bool
        Whether the cells together have the area of the circle; else they lie in it, as in the
        paper.

    Returns
    -------
    MeshQuad
        Straight cells, ring by ring, with the boundary ``edge``. Those in the middle are
        triangles, quadrilaterals with a side of no length: a node at the centre for every
        sector, so that no facet has more than two cells.

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong.

    Examples
    --------
    >>> polar(10, 40).nelements
    400
    """
    rings = checked_integer("rings", rings, at_least=1)
    sectors = checked_integer("sectors", sectors, at_least=3)
    if rings * sectors > MOST:
        raise ValueError(f"expected at most {MOST:g} cells, got {shown(rings * sectors)}")
    r = np.linspace(0, 1, rings + 1)
    if graded is not None:
        r = LAWS[checked_choice("graded", graded, LAWS)](r)
    r *= checked_size("radius", radius)
    step = 2 * np.pi / sectors
    if checked_flag("true_area", true_area):
        r *= np.sqrt(step / np.sin(step))
    angle = np.tile(step * np.arange(sectors), rings + 1)
    p = np.repeat(r, sectors) * np.stack([np.cos(angle), np.sin(angle)])
    ring, sector = (k.ravel() for k in np.mgrid[:rings, :sectors])
    a, b = sectors * ring + sector, sectors * ring + (sector + 1) % sectors
    mesh = MeshQuad(p, np.stack([a, a + sectors, b + sectors, b]).astype(np.int32))
    outside = (mesh.facets >= sectors * rings).all(axis=0)
    return mesh.with_boundaries({"edge": np.nonzero(outside)[0]})


def _generate(
    curves: Sequence[Curve],
    size: float | None,
    n: int | None,
    graded: Grading,
    nboundary: int | None,
) -> MeshTri:
    """Near uniform if a law draws it to the edge afterwards."""
    if isinstance(graded, str):
        checked_choice("graded", graded, LAWS)
        graded = None
    return generated(curves, size, n, graded, nboundary)


def _moved(mesh: MeshTri, p: ndarray, boundary: bool = False) -> MeshTri:
    """The mesh with its inner nodes, or all nodes, at ``p``."""
    if not boundary:  # exactly where they were, maybe outside the circle to give it its area
        held = mesh.boundary_nodes()
        p[:, held] = mesh.p[:, held]
    moved = MeshTri(np.ascontiguousarray(p), mesh.t)
    require(dual_conditions(Corners(numbered(moved))))
    return moved.with_boundaries(mesh.boundaries)


def _ratio(a: ndarray, b: ndarray) -> ndarray:
    return np.divide(a, b, out=np.ones_like(a), where=b > 0)
