"""Flexible loads: settlements under given pressures, without a punch."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, ElementQuad0, ElementTriP0

from ..arguments import called, checked_array
from ..grids.mappings import own_mapping
from ..grids.partition import Partition
from ..ground.substrates import Substrate, checked_substrate
from .influence import surface_displacement
from .transfer import transfer


def flexible_settlement(
    substrate: Substrate,
    basis: CellBasis,
    pressure: float | ndarray | Callable[[ndarray], ndarray] | tuple[CellBasis, ndarray],
    x: ArrayLike | None = None,
) -> ndarray:
    """Settlement of the surface under pressures that are given.

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the loaded area, as for `RigidPunch`; or any other basis of
        scalars with its vector as ``pressure``, whose elements are then the cells.
    pressure : float, (N,) array of float, callable or tuple
        A uniform pressure; one for each cell; a function of coordinates of shape (2, ...), which
        is projected onto the cells; or a field, ``(basis, vector)`` of any mesh that the cells
        cover, of which each cell takes the mean: its force is kept.
    x : (2, m) array of float, optional
        Points anywhere on the surface; the centroids of the cells by default.

    Returns
    -------
    (m,) array of float
        Positive into the ground.

    Raises
    ------
    TypeError, ValueError
        If the ground or the basis is something else, or the pressures are not finite or not one
        per cell.

    Notes
    -----
    Every pair of a cell and a point takes some 20 ns. For more than about 1e4 of both
    ``InfluenceOperator(substrate, basis, edge="constant") @ pressure`` is faster, to 1e-6.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(5))
    >>> w = flexible_settlement(HalfSpace(1.0, 0.0), dual.basis(), 1.0, [[0.0], [0.0]])
    >>> print(f"{w[0]:.3f}")  # exact for the circle: 2
    2.000
    """
    checked_substrate(substrate)
    given: Any = pressure
    if (cells := cells_of(basis)) is not basis:
        if not (callable(given) or _is_pair(given) or np.ndim(given) == 0):
            given = basis, given
        basis = cells
    partition = Partition.from_basis(basis)
    if _is_pair(given):
        given = transfer(given[0], given[1], basis)
    if callable(given) and not isinstance(given, type):
        some = checked_array(
            "pressure", called("pressure", given, partition.centroids), None, each="point"
        )
        if some.shape not in ((), (len(partition),)):
            raise ValueError(
                "expected a function that gives one pressure for each point, got shape "
                f"{some.shape} for {len(partition)} points"
            )
        given = basis.project(given)
    values = checked_array("pressure", given, None, each="cell")
    if values.ndim == 0:
        values = np.full(len(partition), float(values))
    if values.shape != (len(partition),):
        raise ValueError(
            f"expected one number for pressure, or one for each of the {len(partition)} cells, "
            f"got shape {values.shape}"
        )
    return surface_displacement(
        substrate, partition, values, partition.centroids if x is None else x
    )


def _is_pair(pressure: Any) -> bool:
    """Whether it is a basis and its vector."""
    return isinstance(pressure, tuple) and len(pressure) == 2


def cells_of(basis: Any) -> Any:
    """Constants on the elements of a basis of scalars on a plane mesh; others as they are."""
    # the degree first: cells of a partition have theirs without the mesh, made when asked for
    plane = isinstance(basis, CellBasis) and basis.elem.maxdeg > 0 and basis.mesh.dim() == 2
    if not plane or [np.ndim(field) for field in basis.basis[0]] != [2]:
        return basis
    mesh = basis.mesh if basis.tind is None else basis.mesh.restrict(basis.tind)
    constant = ElementTriP0() if mesh.t.shape[0] == 3 else ElementQuad0()
    return CellBasis(mesh, constant, mapping=own_mapping(mesh))
