"""Flexible loads: settlements under given pressures, without a punch."""

from collections.abc import Callable

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis

from ..arguments import checked_array
from ..grids.partition import Partition
from ..ground.substrates import Substrate, checked_substrate
from .influence import surface_displacement


def flexible_settlement(
    substrate: Substrate,
    basis: CellBasis,
    pressure: float | ndarray | Callable[[ndarray], ndarray],
    x: ArrayLike | None = None,
) -> ndarray:
    """Settlement of the surface under pressures that are given.

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the loaded area, as for `RigidPunch`.
    pressure : float, (N,) array of float or callable
        A uniform pressure; one for each cell; or a function of coordinates of shape (2, ...),
        which is projected onto the cells. A field of another scikit-fem basis on the same mesh
        is projected by ``basis.project(basis.with_element(elem).interpolate(vector))``.
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
    partition = Partition.from_basis(basis)
    if callable(pressure):
        pressure = basis.project(pressure)
    values = checked_array("pressure", pressure, None, each="cell")
    if values.ndim == 0:
        values = np.full(len(partition), float(values))
    if values.shape != (len(partition),):
        raise ValueError(
            f"expected one pressure, or one for each of the {len(partition)} cells, got "
            f"shape {values.shape}"
        )
    return surface_displacement(
        substrate, partition, values, partition.centroids if x is None else x
    )
