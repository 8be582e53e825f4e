"""Values of finite elements at points of a plan."""

import numpy as np
from numpy import ndarray
from scipy.sparse import coo_matrix, csr_matrix
from skfem import CellBasis
from skfem.assembly.basis import AbstractBasis

from ..grids.polygons import some
from .overlaps import neighbours, ordered
from .shape_functions import ShapeFunctions

#: points so far outside of every cell, over its size, are inside but for rounding
ROUNDING = 1e-9
#: and so far over their distance from the origin
FAR = 4 * float(np.finfo(float).eps)


def locate(cells: ndarray, x: ndarray) -> tuple[ndarray, ndarray]:
    """Points and the convex cells that contain them, in pairs.

    Parameters
    ----------
    cells : (2, k, n) array of float
        Vertices of convex cells in either sense.
    x : (2, m) array of float
        Points; one on a side belongs to all of the cells there, one outside to none.

    Returns
    -------
    (k,) and (k,) array of int
        Points, ascending, and their cells.
    """
    middle = cells.mean(axis=(1, 2))[:, None]
    cells, x = ordered(cells - middle[..., None]), x - middle
    point, cell = neighbours(x[:, None], cells)
    a = cells[:, :, cell]
    along, arm = np.roll(a, -1, axis=1) - a, x[:, None, point] - a
    length = np.hypot(*along)
    with np.errstate(invalid="ignore", divide="ignore"):  # sides without length
        inside = (along[0] * arm[1] - along[1] * arm[0]) / length
    depth = np.where(length > 0, inside, np.inf).min(axis=0)
    keep = depth > -np.maximum(ROUNDING * length.max(axis=0), FAR * np.abs(middle).max())
    order = np.argsort(point[keep], kind="stable")
    return point[keep][order], cell[keep][order]


def value_matrix(basis: AbstractBasis, x: ndarray, component: int | None = None) -> csr_matrix:
    """Takes DOFs to values at points of a plan.

    On sides between elements, where those that do not conform jump, it takes the mean value.

    Parameters
    ----------
    basis : CellBasis or FacetBasis
        As of `load_matrix`.
    x : (2, m) array of float
        The points.
    component : int, optional
        As of `load_matrix`: by default that on which pressure works, with its sign.

    Returns
    -------
    (m, basis.N) csr_matrix

    Raises
    ------
    ValueError
        If a point lies outside of the mesh or the facets.
    """
    matrix, bad = values_inside(basis, x, component)
    if len(bad):
        raise ValueError(
            f"expected a basis that covers all points, but points {some(bad)} lie outside, the "
            f"first at ({x[0, bad[0]]:.6g}, {x[1, bad[0]]:.6g})"
        )
    return matrix


def values_inside(
    basis: AbstractBasis, x: ndarray, component: int | None = None
) -> tuple[csr_matrix, ndarray]:
    """As `value_matrix`, with nothing in the rows of points outside, and the numbers of these."""
    functions = ShapeFunctions.of(basis, component)
    point, cell = locate(functions.cells, x)
    count = np.bincount(point, minlength=x.shape[1])
    used, own = np.unique(cell, return_inverse=True)  # few points are in few of the cells
    values = functions.on(used).values(own, x[:, point]) / count[point]
    columns = basis.element_dofs[:, cell]
    rows = np.broadcast_to(point, columns.shape)
    shape = x.shape[1], basis.N
    entries = values.ravel(), (rows.ravel(), columns.ravel())
    return coo_matrix(entries, shape=shape).tocsr(), np.nonzero(count == 0)[0]


def vertex_values(basis: CellBasis, vector: ndarray, which: int = 0) -> ndarray:
    """Values of a field at the vertices of its mesh, means over the elements around each.

    Parameters
    ----------
    basis : CellBasis
        Any.
    vector : (N,) array of float
        Its vector.
    which : int
        Number of the field, if there are several.

    Returns
    -------
    (..., n) array of float
        At the points ``basis.mesh.p``, NaN in those that are no vertices of the elements. Of a
        vector-valued field the components come first.
    """
    mesh, corners = basis.mesh, basis.mesh.elem.refdom.p
    at_vertices = CellBasis(
        mesh,
        basis.elem,
        mapping=basis.mapping,
        quadrature=(corners, np.ones(corners.shape[1])),
        elements=basis.tind,
        dofs=basis.dofs,
    )
    field = at_vertices.interpolate(vector)
    values = np.asarray(field[which] if isinstance(field, tuple) else field)
    vertices = (mesh.t if basis.tind is None else mesh.t[:, basis.tind]).T.ravel()
    n = mesh.p.shape[1]
    flat = values.reshape(-1, vertices.size)
    sums = np.array([np.bincount(vertices, row, n) for row in flat])
    count = np.bincount(vertices, minlength=n)
    means = np.full(sums.shape, np.nan)
    np.divide(sums, count, out=means, where=count > 0)
    return means.reshape(*values.shape[:-2], n)
