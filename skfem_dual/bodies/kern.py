"""The kern of a plan: where a force may act without the punch lifting off.

The pressure is linear in the point where a unit force acts, so each cell gives a half-plane and
the kern is their intersection, by duality the polar of a convex hull (Ziegler, Lectures on
Polytopes, 1995, section 2.3).
"""

import numpy as np
from numpy import ndarray
from scipy.spatial import ConvexHull

from ..contact.planes import PlaneFit
from ..contact.system import ContactSystem
from ..contact.unilateral import solve_scaled
from ..errors import ConvergenceError, ResolutionWarning, warn
from ..grids.evening import evening
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..grids.polygons import readonly
from ..messages import place

#: least pressure under a mere settlement, over the mean, below which a kern depends on the mesh:
#: there by 4 % on 100 cells, more where cells are smaller
NEARLY = 0.05


def kern(system: ContactSystem, partition: Partition, acting: ndarray, centre: ndarray) -> ndarray:
    """Convex polygon of the force positions with pressure everywhere.

    The pressure under a force at e is that under pure settlement times ``1 + a . (e - e0)``, e0
    where the force acts that causes no tilt. Singular at the edge as both pressures are, their
    ratio a is smooth there and continued to the edge by planes through the cells.

    Parameters
    ----------
    system : ContactSystem
        Of a flat punch, its position that of ``centre``; see `require_pressing`.
    partition : Partition
        Its cells.
    acting : (2, n) array of float
        Where the pressure of each cell acts.
    centre : (2,) array of float
        The point the position refers to.

    Returns
    -------
    (2, k) array of float
        Vertices, counter-clockwise.

    Raises
    ------
    ConvergenceError
        If so few cells resist no tilt.
    """
    unit, stiffness = system.unit_pressures, system.stiffness
    # tilts by how far they move the edge of the plan, whatever the unit of length
    scale = np.diag([1.0, *[1 / partition.extent] * 2])
    tilted = scale @ solve_scaled(scale @ stiffness @ scale, scale[:, 1:])
    by_moment = unit @ tilted * stiffness[0, 0]
    ratio = (by_moment / unit[:, :1]).T
    ends = np.unique(partition.facets[:, edge_ribs(partition)])
    edge = partition.polygons.p[:, ends]
    planes = PlaneFit.to_nearest(acting, edge, evening(partition.polygons))
    on_edge = np.stack([planes(a)[0] for a in ratio])
    # the half-planes 1 + a . d >= 0 have the polygon polar to the hull of the points -a
    hull = ConvexHull(-np.hstack([ratio, on_edge]).T)
    d = -hull.equations[:, :2] / hull.equations[:, 2:]
    d = d[np.argsort(np.arctan2(d[:, 1], d[:, 0]))].T
    return readonly(d + (centre + stiffness[1:, 0] / stiffness[0, 0])[:, None])


def require_pressing(system: ContactSystem, partition: Partition) -> None:
    """Refuse a flat punch of which pure settlement does not press on every cell, with a
    ConvergenceError; warn of one that hardly does."""
    settled = system.unit_pressures[:, 0]
    bad, least = settled <= 0, int(settled.argmin())
    if bad.any():
        among = bad.copy()
        among[partition.across(bad)] = False
        remedy = (
            "There is none: the ground would have to pull on all cells around it, as inside the "
            "plan on a stiff crust"
            if among.any()
            else "Remedy: improve the mesh, its cells differ too much from their neighbours"
        )
        raise ConvergenceError(
            "expected pressure on all cells under pure settlement for a kern, got none on cell "
            f"{np.nonzero(among if among.any() else bad)[0][0]}. {remedy}"
        )
    share = settled[least] / (settled @ partition.areas / partition.areas.sum())
    if share < NEARLY:
        warn(
            f"pressures under a mere settlement fall to {100 * share:.2g} % of their mean on cell "
            f"{least} at {place(partition.centroids[:, least])}: the ground pulls there under "
            "hardly any moment, and the kern may be too large. Remedy: smaller cells",
            ResolutionWarning,
        )
