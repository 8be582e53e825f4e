"""Whether cells are fine enough for the ground.

Over a layer thinner than the cells the ground's compliance grows with the wave number where the
cells no longer tell waves from each other: on very thin bonded layers that keep their volume, or
nearly so, settlements under a rigid punch come out with any sign. The estimate below was fitted to
the errors of rigid discs of 150 to 600 dual cells and triangles, even and graded ones, on bonded
layers of 0.01 to 0.2 radii, with Poisson's ratios of 0 to 0.5, against dual integral equations. It
tells the order of the error, not more.

Over soft layers some ten times thinner than the cells the part c / r of the influence function
and its remainder nearly cancel, and what weighted cells leave of the second shows; under thinner
skins cells see the ground below, see `Seen`. That was fitted to rectangles and discs of 60 and 240
cells on layers of 0.001 to 0.03 half widths, and to even quadrilaterals and triangles with 3 to 8
across on powers of the depth.

Under narrow plans pressures fall from the middle to the edge as they do under no disc, whose law
the cells have. Where waves of some cells feel the ground far stiffer than its surface, on thin
layers, settlements are too large then, more so with few cells across, see `too_coarse`. That was
fitted to rectangles of 1 and 4 widths with 2 to 12 cells across, and discs of 30 to 600, on bonded
layers of 0.01 to 0.2 widths, with Poisson's ratios of 0.3 to 0.5.

Tilts across a plan are off where most of its resistance lies inside of cells, see `_few_across`:
rectangles of 3 and 6 widths with a row of triangles to four rows of quadrilaterals on 20 grounds.

A base bonded to the ground holds a thin layer that keeps its volume from above, too: the layer is
up to four times as stiff to long waves then, and stiffnesses need finer cells, see
`bonded_too_coarse`.
"""

import numpy as np
from numpy import ndarray
from scipy.linalg import eigh

from ..errors import MeshError
from ..grids.outline import edge_ribs
from ..grids.partition import Partition
from ..ground.seen import even_at_edge, seen_by
from ..ground.stratified import Stratified
from ..ground.substrates import Substrate

#: estimated error of the settlement from which on cells are called too coarse
ALLOWED = 0.027
#: and beyond which it tells nothing any more
MOST = 10.0
#: the same of tilts across a plan that few cells lie across
ALLOWED_TILT = 0.05
#: the fitted factor and power of how the compliance grows
FACTOR, POWER = 3.5e-5, 2.5
#: the same of an error that is seldom exceeded, on fine cells too: what bounds lacked under discs
#: and rings of 150 to 600 cells on bonded layers of 0.06 to 0.3, with Poisson's ratios of 0 to 0.5
MARGIN, SQUARE = 3e-4, 2.0
#: the fitted factors on dual cells and elements by the part of a plan's width that one takes, and
#: the power of how stiff waves of eight cells feel the ground
ACROSS, ELEMENTS_ACROSS, STIFF = 4e-4, 1.2e-3, 1.2
#: the fitted factors of the error of bonded bases on dual cells and on triangles: discs of 100 to
#: 1100 cells on bonded layers of 0.05 to 0.3 radii that keep their volume, against finite elements
BONDED, BONDED_TRIANGLES = 3e-4, 2.4e-3
#: how many times as stiff to short waves as to ones four times as long ground with a crust is
CRUST = 1.5
#: how many times as soft as the ground under a cell a surface without end would be where the error
#: is that of the whole; and the same of triangles and quadrilaterals
CANCELLED, IN_ELEMENTS = 150.0, 45.0
#: sizes of cells whose moments remain numbers, and those of the ground's waves
SIZES = 1e-20, 1e20
#: cells smaller than so many lengths of the ground need not be looked at, and larger ones than so
#: many are hardly meant
FINE, FARTHEST = 0.5, 1e5


def coarseness(substrate: Stratified, h: ndarray) -> ndarray:
    """Estimated relative error of the settlement by cells of sizes ``h``.

    Parameters
    ----------
    substrate : GradedHalfSpace or LayeredHalfSpace
        The ground.
    h : (n,) array of float
        Square roots of the areas of cells.

    Returns
    -------
    (n,) array of float
        Not negative; 0 where the compliance does not grow with the wave number.
    """
    return FACTOR * growth(substrate, h) ** POWER


def growth(substrate: Stratified, h: ndarray) -> ndarray:
    """By how much of it the compliance grows to waves of cells of sizes ``h`` from ones four times
    as long, (n,) array; not negative."""
    return np.maximum(1 / _stiffening(substrate, h) - 1, 0)


def crusted(substrate: Substrate, partition: Partition) -> bool:
    """Whether the ground is much stiffer to waves half as long as the cells than to longer ones:
    what a crust does at the edge of contact is then seen by finer cells only."""
    if not isinstance(substrate, Stratified):
        return False
    h = np.array([mean_size(partition, 1)])
    return bool(_stiffening(substrate, h / 2)[0] > CRUST)


def has_crust(substrate: Substrate, partition: Partition) -> bool:
    """Whether the ground is much stiffer to waves of the cells than to ones as long as the plan is
    wide, so that it pulls under a plan in full contact."""
    if not isinstance(substrate, Stratified):
        return False
    k = np.pi / np.sqrt([partition.areas.min(), partition.areas.sum()])
    short, long = k * substrate.symbol(k)
    return bool(long > CRUST * short)


def _stiffening(substrate: Stratified, h: ndarray) -> ndarray:
    """Compliance to waves four times as long as cells of sizes ``h``, over that to ones as short,
    (n,) array."""
    k = np.pi / np.concatenate([h, 4 * h])
    short, long = (k * substrate.symbol(k)).reshape(2, -1)
    return long / short


def margin(substrate: Substrate, partition: Partition) -> float:
    """Relative error of the settlement by some cells that is seldom exceeded, as far as it is due
    to the growth of the compliance, on dual cells and triangles alike; 0 on homogeneous ground."""
    if not isinstance(substrate, Stratified):
        return 0.0
    return MARGIN * float(growth(substrate, np.array([mean_size(partition, 2)]))[0]) ** SQUARE


def mean_size(partition: Partition, power: int) -> float:
    """Square root of the mean area of the cells, each with a power of its own as weight."""
    return float(np.sqrt(np.average(partition.areas, weights=partition.areas**power)))


def require_sizes(partition: Partition) -> None:
    """Refuse cells so large or small that their moments are no numbers.

    Raises
    ------
    MeshError
        If they are.
    """
    largest = float(np.sqrt(partition.areas.max()))
    if not SIZES[0] < largest < SIZES[1]:
        raise MeshError(
            f"expected cells of sizes from {SIZES[0]:g} to {SIZES[1]:g}, got {largest:.3g}. "
            "Remedy: choose units in which sizes are near 1"
        )


def too_coarse(substrate: Substrate, partition: Partition, sloped: bool = True) -> str | None:
    """What to warn of if the cells are too coarse for the ground, else None.

    ``sloped`` tells whether the pressure varies linearly over them.
    """
    if not isinstance(substrate, Stratified):
        return None
    # of graded meshes the largest cells follow waves worst; parts cancel over all of the plan
    h, usual = mean_size(partition, 2), mean_size(partition, 1)
    if h < FINE * substrate.lengths[0]:
        return None
    if h > FARTHEST * substrate.lengths[0]:
        return (
            f"ground that varies over {substrate.lengths[0]:.3g}, {h / substrate.lengths[0]:.0e} "
            "times less than the size of the cells, is that of other units or of a gradient that "
            "is no part of the modulus. Remedy: ground in the units of the mesh"
        )
    finer, c = _finer(h), None
    error = coarseness(substrate, finer)
    edge = partition.areas[partition.f2c[0, edge_ribs(partition)]]
    even = even_at_edge(substrate, edge)
    if sloped:
        k = np.pi / (finer * usual / h)
        if even:
            return (
                f"no law of the edge holds on ground that varies over {substrate.lengths[0]:.3g} "
                f"inside cells of a size of about {np.sqrt(edge.mean()):.3g}: settlements may be "
                'off by some per cent, or by far more. Remedy: edge="constant" and no '
                "edge_boundaries"
            )
        c = seen_by(substrate, edge).singular_coefficient
        waves = np.array([k, np.pi / (4 * finer)])
        near, far = 2 * np.pi * c / (waves * substrate.symbol(waves.ravel()).reshape(2, -1))
        on_dual_cells = partition.polygons.sizes.max() > 4
        factor = ACROSS if on_dual_cells else ELEMENTS_ACROSS
        across = factor * far**STIFF * finer / _width(partition)
        error = np.maximum(error, across)
        error += (near / (CANCELLED if on_dual_cells else IN_ELEMENTS)) ** 2
    told = _told(substrate, len(partition), finer, error, "settlements and tilts")
    return told or (_few_across(substrate, partition, c) if sloped or even else None)


def bonded_too_coarse(substrate: Substrate, partition: Partition) -> str | None:
    """What to warn of if the cells are too coarse for a base bonded to the ground, else None.

    The error estimated grows as ground that is held sideways yields more to waves of the cells
    than to ones four times as long, and than to waves of the plan's width. It tells the order of
    the error, not more.
    """
    if not isinstance(substrate, Stratified):
        return None
    finer = _finer(mean_size(partition, 2))
    k = np.concatenate([np.pi / finer, np.pi / (4 * finer), [1 / _width(partition)]])
    along, coupling, down = substrate.compliance(k)
    yielding = (down - coupling**2 / along) / k
    short, long = np.split(yielding[:-1], 2)
    factor = BONDED_TRIANGLES if partition.polygons.sizes.max() == 3 else BONDED
    error = factor * short / long * short / yielding[-1]
    return _told(substrate, len(partition), finer, error, "stiffnesses of a bonded base")


def _few_across(substrate: Stratified, partition: Partition, c: float | None) -> str | None:
    """The message about tilts across a plan that few cells lie across.

    What the plan's moment of inertia has more than that of its cells' centroids is lost where
    pressures do not vary inside them, ``c`` None; where they do it resists as homogeneous ground
    with a part ``c / r`` does, more or less than this one.
    """
    areas, x = partition.areas, partition.centroids - partition.centre[:, None]
    of_centroids = (areas * x) @ x.T
    xx, xy, yy = partition.polygons.second_moments.sum(axis=1)
    share, along = eigh(of_centroids, of_centroids + np.array([[xx, xy], [xy, yy]]))
    width = np.sqrt(12 / (along[:, 0] @ along[:, 0]) / areas.sum())  # of a rectangle
    error = 1 / max(share[0], 0.5) - 1
    if c is not None:
        k = np.pi / np.array([width])
        stiffer = 2 * np.pi * c / float((k * substrate.symbol(k))[0])
        error = (1 - share[0]) ** 2 * abs(np.log(stiffer))
    if error <= ALLOWED_TILT:
        return None
    rows = "five" if c is None else "three"
    return (
        f"{len(partition)} cells, few of which lie across a plan about {width:.3g} wide on ground "
        f"that varies over {substrate.lengths[0]:.3g}: tilts across it may be off by some "
        f"{100 * min(error, 1):.0f} %. Remedy: {rows} rows of cells across, or twice as many of "
        "triangles"
    )


def _width(partition: Partition) -> float:
    """Of a plan: twice its area over the length of its edge, of a disc its radius."""
    a, b = partition.ends(edge_ribs(partition))
    return float(2 * partition.areas.sum() / np.hypot(*(b - a)).sum())


def _finer(h: float) -> ndarray:
    """A size of cells and smaller ones, among which is that of a remedy."""
    return h * 2.0 ** (-np.arange(41) / 4)


def _told(
    substrate: Stratified, count: int, finer: ndarray, error: ndarray, what: str
) -> str | None:
    """The message about so many cells, from the errors by their size and by smaller ones."""
    if error[0] <= ALLOWED:
        return None
    fine = np.append(finer, finer[-1])[np.nonzero(error > ALLOWED)[0][-1] + 1]
    cells = int(np.ceil(count * (finer[0] / fine) ** 2))
    remedy = f"about {cells} cells"
    if error[-1] > ALLOWED:
        remedy = f"ground in the units of the mesh, as even {cells} cells would be too coarse"
    return (
        f"{count} cells of a size of about {finer[0]:.3g} are too coarse for ground that varies "
        f"over {substrate.lengths[0]:.3g}: {what} may be off by some "
        f"{100 * min(error[0], MOST):.0f} %{' and more' * bool(error[0] > MOST)}. Remedy: {remedy}"
    )
