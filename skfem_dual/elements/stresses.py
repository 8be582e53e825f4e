"""Stresses and displacements below cells, in any ground."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from ..grids.partition import Partition
from ..ground.substrates import Substrate
from .depth import components
from .edge_weights import EdgeWeights
from .strips import CellLoads


class Stresses(NamedTuple):
    """Components of the stress at m points, compression positive: minus Cauchy's tensor.

    Attributes
    ----------
    sigma_x, sigma_y, sigma_z : (m,) array of float
        Normal stresses.
    tau_xy, tau_yz, tau_zx : (m,) array of float
        Shear stresses; tau_zx > 0 on the side of positive x of a load.
    """

    sigma_x: ndarray
    sigma_y: ndarray
    sigma_z: ndarray
    tau_xy: ndarray
    tau_yz: ndarray
    tau_zx: ndarray

    # by identity, as other answers: tuples ask their arrays, which do not tell

    def __eq__(self, other: object) -> bool:
        return self is other

    def __ne__(self, other: object) -> bool:
        return self is not other

    def __hash__(self) -> int:
        return object.__hash__(self)

    @property
    def tensor(self) -> ndarray:
        """The components as a symmetric tensor of shape (3, 3, m)."""
        return np.stack(self)[[[0, 3, 5], [3, 1, 4], [5, 4, 2]]]


def stresses(
    substrate: Substrate,
    partition: Partition,
    pressure: ndarray,
    x: ArrayLike,
    weights: EdgeWeights | None = None,
) -> Stresses:
    """Stresses at points below cells, see `stress_below`.

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    partition : Partition
        The n cells.
    pressure : (n,) array of float
        Their mean pressures.
    x : (3, m) array of float
        Points in the ground, depths ``x[2] > 0``.
    weights : EdgeWeights, optional
        How the pressure varies inside the cells; uniform without.

    Raises
    ------
    TypeError, ValueError, ConvergenceError
        As in `stress_below`.
    """
    load = CellLoads(partition, pressure, weights)
    return Stresses(*components(substrate, [load], x, (True, False))[:6])


def displacements(
    substrate: Substrate,
    partition: Partition,
    pressure: ndarray,
    x: ArrayLike,
    weights: EdgeWeights | None = None,
) -> ndarray:
    """Displacements at points below cells, shape (3, m); as `stresses`."""
    load = CellLoads(partition, pressure, weights)
    return components(substrate, [load], x, (False, True))[6:]
