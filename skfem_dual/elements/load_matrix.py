"""Pressures of cells as loads on finite elements.

The integrals of ``p v`` with the pressure ``p = q w / mean(w)`` inside the cells, ``w`` the weight
of `EdgeWeights`. The triangles of the cells are cut along the sides of the finite elements; on
every piece ``w^(-2)`` is linear and the test functions are smooth. In the direction in which w
varies the Gauss points are those of its inverse, in which the load has no singularity: the rule
is exact for polynomials up to its order, on the edge of the plan too.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_matrix, csr_matrix
from skfem.assembly.basis import AbstractBasis
from skfem.mapping import MappingAffine
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from ..arguments import checked_flag, checked_instance, checked_integer
from ..grids.cellwise import HIGHEST
from ..grids.fan import Fan
from ..grids.partition import Partition
from ..grids.polygons import some
from .edge_weights import EdgeWeights, load_centroids
from .graded_rule import area_of, graded
from .overlaps import overlaps
from .shape_functions import ShapeFunctions

#: part of the area of all cells that may be missing, as by the digits of a file, if it is no more
#: than the second part of that of one; and by rounding how much of its radius times its greatest
#: coordinate
MISSING, OF_CELL, ROUNDING = 1e-9, 0.01, 8 * float(np.finfo(float).eps)
#: values of test functions computed at a time
CHUNK = 2**18


def load_matrix(
    partition: Partition,
    weights: EdgeWeights | None,
    fan: Fan,
    basis: AbstractBasis,
    *,
    order: int | None = None,
    component: int | None = None,
    partial: bool = False,
    moments: bool = False,
) -> csr_matrix:
    """Loads on finite elements by unit mean pressure on each cell.

    Parameters
    ----------
    partition : Partition
        The n cells.
    weights : EdgeWeights, optional
        How the pressure varies inside them; uniform without.
    fan : Fan
        Triangles that fill all the cells, those of the weights among them.
    basis : CellBasis or FacetBasis
        Any scikit-fem basis on a mesh of triangles or convex quadrilaterals that covers the
        cells, or on facets of a 3-D mesh in a plane z = const that do. Its mesh and that of the
        cells need not have anything in common. Elements with curved sides are taken as their
        mappings have them, but the plan is shared out between them along straight sides.
    order : int, optional
        Degree up to which products with the test functions are integrated exactly; by default
        the degree of the basis, at least 1, and two more where its mapping is not affine, but at
        most 19, with ``moments`` 18.
    component : int, optional
        The scalar component of the test functions that the pressure works on, counted through
        all fields of the element. By default, on facets of a 3-D mesh, the traction
        ``-p n`` works on the first vector-valued field, n the outward normal; else the pressure
        works on the first scalar field, or on the last component of a vector of three.
    partial : bool
        Whether the basis may cover only a part of the cells; the rest of the load is left out.
    moments : bool
        Whether columns are appended for unit slopes of the pressure along x and along y inside
        the cells, see `Slopes`.

    Returns
    -------
    (basis.N, n) or (basis.N, 3 n) csr_matrix
        Times the mean pressures of the cells, a vector to stand on the right-hand side. Where
        the basis contains linear functions it has the force of the pressures to rounding, and
        with the columns for their slopes, or where they are constant times the law of the
        edge, their moments.

    Raises
    ------
    TypeError
        If an argument is something else, or no field tells which component.
    ValueError
        If weights or fan are those of another number of cells, there is no rule of that order,
        the test functions have no such component, or the basis does not cover the cells, covers
        them twice or is not in a horizontal plane.
    """
    _require_of_one(partition, weights, fan)
    partial, moments = checked_flag("partial", partial), checked_flag("moments", moments)
    target = ShapeFunctions.of(basis, component)
    if order is not None:
        order = checked_integer("order", order, at_least=0, at_most=HIGHEST - moments)
    else:
        # moments of cells take the first degree, whatever the test functions
        order = max(basis.elem.maxdeg, 1) + (0 if isinstance(target.mapping, MappingAffine) else 2)
        order = min(order, HIGHEST - moments)  # ElementQuadP asks for more than it has
    pieces = overlaps(fan.p[:, fan.t], target.cells)
    cell = fan.cell[pieces.first]
    covered = np.bincount(cell, pieces.share * fan.areas[pieces.first], len(partition))
    whole = _whole(partition, covered, partial)
    places = pieces.first, pieces.vertices
    points = points_in_pieces(weights, fan, places, order + moments)
    points = _balanced(partition, weights, points, whole)
    factors = np.ones((1, len(points.cell)))
    if moments:
        factors = np.vstack([factors, _arms(partition, weights, points, whole)])
    n, size = len(partition), max(1, CHUNK // basis.Nbfun)
    out = csr_matrix((basis.N, 3 * n if moments else n))
    parts = (factors[:, i : i + size] for i in range(0, factors.shape[1], size))
    for some_points, factor in zip(points.chunks(size), parts, strict=True):
        element = pieces.second[some_points.piece]
        values = target.values(element, some_points.x) * some_points.weight
        worked_on = values.any(axis=1)
        values, runs = values[worked_on], np.flatnonzero(np.diff(some_points.piece, prepend=-1))
        rows = basis.element_dofs[np.ix_(worked_on, element[runs])]
        for k, each in enumerate(factor):
            columns = np.broadcast_to(k * n + some_points.cell[runs], rows.shape)
            sums = np.add.reduceat(values * each, runs, axis=1)
            entries = sums.ravel(), (rows.ravel(), columns.ravel())
            out = out + coo_matrix(entries, shape=out.shape).tocsr()
    return out


def _require_of_one(partition: Partition, weights: EdgeWeights | None, fan: Fan) -> None:
    """Refuse what is no partition, and weights and fans of other cells than its."""
    checked_instance("partition", partition, Partition, "Partition.from_basis(basis)")
    checked_instance("fan", fan, Fan, "Fan.from_basis(basis)")
    numbers = {"fan": int(fan.cell.max()) + 1}
    if weights is not None:
        checked_instance("weights", weights, EdgeWeights, "None for uniform pressures")
        numbers["weights"] = len(weights.partition)
    for name, number in numbers.items():
        if number != len(partition):
            raise ValueError(f"expected {name} of {len(partition)} cells, got {number}")


def _whole(partition: Partition, covered: ndarray, partial: bool) -> ndarray:
    """Cells whose load is made good, by the areas of them that are covered: at the edge a sliver
    may carry as much as the root of its share. All of them but for ``partial``."""
    areas = partition.areas
    rounding = ROUNDING * partition.polygons.radii * np.abs(partition.centroids).max(axis=0)
    twice = np.nonzero(covered > (1 + 1e-6) * areas + rounding)[0]
    if len(twice):
        raise ValueError(
            f"expected a basis that covers each cell once, got cells {some(twice)} covered more "
            "than once. Remedy: a mesh, or facets, that do not overlap"
        )
    allowed, missing = MISSING * areas.sum(), areas - covered
    whole = missing < np.minimum(allowed, OF_CELL * areas) + rounding
    outside = missing[missing > rounding].sum()
    if not partial and (outside > allowed or not whole.all()):
        share = 100 * outside / areas.sum()
        raise ValueError(
            f"expected a basis that covers all cells, but {outside:.4g} of their area "
            f"{areas.sum():.6g} lies outside ({share:.3g} %), the first in cell "
            f"{np.argmax(missing > rounding)}. Remedy: a mesh of the whole plan with the same "
            "boundary, facets on arcs too; or, of a load vector, partial=True to leave out the "
            "load outside"
        )
    return whole


@dataclass(frozen=True, eq=False)
class Points:
    """Points with the loads of cells under unit mean pressure, and where they are."""

    x: ndarray
    weight: ndarray
    piece: ndarray
    cell: ndarray

    def chunks(self, size: int) -> Iterator["Points"]:
        for start in range(0, len(self.weight), size):
            part = slice(start, start + size)
            yield Points(self.x[:, part], self.weight[part], self.piece[part], self.cell[part])


def points_in_pieces(
    weights: EdgeWeights | None, fan: Fan, pieces: tuple[ndarray, ndarray], order: int
) -> Points:
    """Points in pieces of triangles of the fan, for polynomials times the weight."""
    triangle, vertices = pieces
    weighted = np.zeros(len(triangle), dtype=bool)
    if weights is not None:
        weighted = weights.weighted[fan.cell[triangle]]
    uniform, varying = np.nonzero(~weighted)[0], np.nonzero(weighted)[0]
    X, W = get_quadrature(RefTri, max(order, 1))
    rule = np.vstack([1 - X.sum(axis=0), X])  # barycentric coordinates of the points
    at = np.einsum("ijk,jq->ikq", vertices[..., uniform], rule)
    load = np.broadcast_to(2 * W, at.shape[1:])
    parts = [(uniform, at, load * area_of(vertices[..., uniform])[:, None])]
    if weights is not None and len(varying):
        square = weights.roots_in(fan, triangle[varying]) ** 2
        mean = weights.mean[fan.cell[triangle[varying]]]
        for at, load in graded(vertices[..., varying], square, order):
            root = np.sqrt(np.einsum("ikq,ik->kq", at, square))
            factor = weights.factor(fan.cell[triangle[varying]], root)
            parts.append((varying, at, load * factor / mean[:, None]))
    piece = np.concatenate([np.repeat(own, at.shape[2]) for own, at, _ in parts])
    at = np.hstack([at.reshape(3, -1) for _, at, _ in parts])
    load = np.concatenate([load.ravel() for _, _, load in parts])
    keep = load != 0  # some rules have negative weights
    piece, at, load = piece[keep], at[:, keep], load[keep]
    own = triangle[piece]
    x = np.einsum("dvk,vk->dk", fan.p[:, fan.t[:, own]], at)
    return Points(x, load * fan.areas[own], piece, fan.cell[own])


def _balanced(
    partition: Partition, weights: EdgeWeights | None, points: Points, whole: ndarray
) -> Points:
    """Rounding and slivers made good: loads of whole cells have their areas as total and act
    where the solver has them act, by a factor that is linear in each cell."""
    planes = _planes(partition, weights, points)
    given = np.zeros((3, len(partition)))
    given[0] = partition.areas
    factor = 1 + _missing(points, planes, whole, np.ones(len(points.cell)), given)
    return Points(points.x, points.weight * factor, points.piece, points.cell)


def _arms(
    partition: Partition, weights: EdgeWeights | None, points: Points, whole: ndarray
) -> ndarray:
    """Unit slopes in balanced points, (2, k), without a force over whole cells and with the
    moments that the solver knows: the rule is not exact where the law is that of the ground."""
    law = partition.polygons.second_moments[[0, 1, 1, 2]].reshape(2, 2, -1)
    law = law if weights is None else weights.second_moments
    planes, size = _planes(partition, weights, points), np.sqrt(partition.areas)
    arms = planes[1:] * size[points.cell]
    for arm, second in zip(arms, law, strict=True):
        given = np.vstack([np.zeros(len(size)), second / size])
        arm += _missing(points, planes, whole, arm, given)
    return arms


def _planes(partition: Partition, weights: EdgeWeights | None, points: Points) -> ndarray:
    """One and both coordinates of points from where the mean pressure of their cell acts, over
    its size; shape (3, k)."""
    acting = load_centroids(partition, weights)
    arm = (points.x - acting[:, points.cell]) / np.sqrt(partition.areas)[points.cell]
    return np.vstack([np.ones(arm.shape[1]), arm])


def _missing(
    points: Points, planes: ndarray, whole: ndarray, values: ndarray, given: ndarray
) -> ndarray:
    """What is added to values in points, (k,), linear in each cell, for their integrals times
    planes to be those given, (3, n), in whole cells."""
    factor = missing_planes(points, planes, whole, values, given)
    return np.sum(planes * factor[:, points.cell], axis=0)


def missing_planes(
    points: Points, planes: ndarray, whole: ndarray, values: ndarray, given: ndarray
) -> ndarray:
    """How much of each plane, (3, n), is added to values in points, (k,), for their integrals
    times planes to be those given, (3, n), in whole cells."""
    n = len(whole)

    def total(values: ndarray) -> ndarray:
        return np.bincount(points.cell, points.weight * values, minlength=n)

    # counts of nothing are integers
    matrix = np.array([[total(a * b) for a in planes] for b in planes], dtype=float)
    missing = given - np.array([total(values * a) for a in planes])
    matrix[..., ~whole], missing[:, ~whole] = np.eye(3)[..., None], 0.0
    return np.linalg.solve(matrix.transpose(2, 0, 1), missing.T[..., None])[..., 0].T
