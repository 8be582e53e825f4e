"""Whether cells are fine enough for the ground.

Over a layer thinner than the cells the ground's compliance grows with the wave number where the
cells no longer tell waves from each other: on very thin bonded layers that keep their volume, or
nearly so, settlements under a rigid punch come out with any sign. The estimate below was fitted to
the errors of rigid discs, squares, rings and L-shapes of 150 and 600 dual cells on layers of 0.01
to 0.5 radii, Poisson's ratios of 0 to 0.5; those of discs against `RigidDisc`. It tells the order
of the error, not more.
"""

import numpy as np
from numpy import ndarray

from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..ground.stratified import Stratified
from ..ground.substrates import Substrate

#: estimated error of the settlement from which on cells are called too coarse
ALLOWED = 0.025
#: the fitted factor, and the ratio of cells to the ground's length from which on it grows no more
FACTOR, MOST = 5e-4, 12.0
#: pressures that vary linearly over the cells leave this part of it
SLOPED = 0.4
#: cells smaller than so many lengths of the ground need not be looked at
FINE = 0.5


def coarseness(substrate: Stratified, h: ndarray, a: float) -> ndarray:
    """Estimated relative error of the settlement by cells of sizes ``h`` under a plan.

    Parameters
    ----------
    substrate : GradedHalfSpace or LayeredHalfSpace
        The ground.
    h : (n,) array of float
        Square roots of the areas of cells.
    a : float
        Twice the area of the plan over the length of its edge; the radius of a disc.

    Returns
    -------
    (n,) array of float
        Not negative; 0 where the compliance does not grow with the wave number.
    """
    k = np.pi / np.concatenate([h, 4 * h])
    short, long = (k * substrate.symbol(k)).reshape(2, -1)
    thin = np.minimum(h / substrate.lengths[0], MOST)
    return FACTOR * (h / a * thin * np.maximum(short / long - 1, 0)) ** 2


def too_coarse(substrate: Substrate, partition: Partition, sloped: bool = True) -> str | None:
    """What to warn of if the cells are too coarse for the ground, else None.

    ``sloped`` tells whether the pressure varies linearly over them.
    """
    h = float(np.sqrt(np.median(partition.areas)))
    if not isinstance(substrate, Stratified) or h < FINE * substrate.lengths[0]:
        return None
    begin, end = partition.polygons.p[:, partition.facets[:, edge_ribs(partition)]].swapaxes(0, 1)
    a = 2 * float(partition.areas.sum() / np.hypot(*(end - begin)).sum())
    finer = h * 2.0 ** (-np.arange(41) / 4)
    error = (SLOPED if sloped else 1.0) * coarseness(substrate, finer, a)
    if error[0] <= ALLOWED:
        return None
    cells = int(np.ceil(len(partition) * (h / finer[np.argmax(error <= ALLOWED)]) ** 2))
    return (
        f"{len(partition)} cells of a size of about {h:.3g} are too coarse for ground that varies "
        f"over {substrate.lengths[0]:.3g}: settlements may be off by some {100 * error[0]:.0f} %. "
        f"Remedy: about {cells} cells"
    )
