"""How far a couple of solutions is from the exact one, and where to refine the mesh."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from ..arguments import checked_array, checked_number
from ..grids.mappings import own_mapping
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly
from ..solutions.punch_solution import PunchSolution
from .checks import check_couple

#: how many times the relative distance of both settlements that of bracketing tilts may be: they
#: are two to four times as far apart where the load tilts the punch; others differ by anything
APART = 1.0, 5.0
#: inclinations of the length of the plan, over the settlement, that are zero but for rounding
ROUNDING = 1e-9
#: share of node-collocated dual cells in a settlement whose errors cancel to first order
SHARE = 0.4


@dataclass(frozen=True, eq=False, repr=False)
class CoupleEstimate(ReadOnly):
    """What two solutions on dual grids tell of their errors; see `estimate_error`.

    Attributes
    ----------
    settlement : (2,) array of float
        Smaller and larger settlement of the two.
    tilt : (2, 2) array of float
        Smaller and larger inclination Lx, and Ly.
    bracketed : (3,) array of bool
        Whether the exact settlement, Lx and Ly are expected between them. The settlement: of
        flat punches in full contact with constant pressures, dual cells collocated at their nodes
        and triangles at their centroids; not where the inclination lifts the origin by a fifth of
        the settlement of the centroid or more, nor where that is as small as what the inclinations
        differ by over the plan. An inclination, besides: where the triangles tilt more in the same
        direction, by about as much as such solutions do. One that is zero by symmetry has the
        signs of the mesh and is not. Found so under given loads on every valid mesh tried, of
        inclinations but 2 of 153, on triangles with angles of 1 to 2 degrees; not proven.
    mixed_settlement : float
        Mixture of both in which their errors cancel to first order, if they bracket the exact
        value; the mean of both otherwise.
    on_triangles : (m,) array of float
        Indicator of each triangle, in units of an energy; its squares add up.
    on_cells : (n,) array of float
        The same for the dual cells.
    """

    settlement: ndarray
    tilt: ndarray
    bracketed: ndarray
    mixed_settlement: float
    on_triangles: ndarray
    on_cells: ndarray

    @property
    def total(self) -> float:
        """Root of the sum of squares of the indicators."""
        return float(np.sqrt(np.sum(self.on_triangles**2)))

    def __repr__(self) -> str:
        rows = [
            f"  {name}: {low:.6g} to {high:.6g}, exact value expected between: "
            f"{'yes' if between else 'no'}"
            for name, (low, high), between in zip(
                ("Settlement", "Tilt Lx", "Tilt Ly"),
                (self.settlement, *self.tilt),
                self.bracketed,
                strict=True,
            )
        ]
        rows += [f"  Mixed settlement: {self.mixed_settlement:.6g}"]
        rows += [f"  Indicator: {self.total:.4g}"]
        return "\n".join(["<skfem_dual CoupleEstimate object>", *rows])


def estimate_error(on_cells: PunchSolution, on_triangles: PunchSolution) -> CoupleEstimate:
    """Bracket of the settlement and indicators of the error from a couple of solutions.

    Parameters
    ----------
    on_cells, on_triangles : PunchSolution
        Solutions of one problem on ``dual.basis()`` and ``dual.primal_basis()``. The bracket
        needs ``edge="constant"``, ``collocation="node"`` on the dual cells, and a flat punch in
        full contact.

    Returns
    -------
    CoupleEstimate

    Raises
    ------
    TypeError, ValueError
        As `postprocess`.

    Notes
    -----
    The indicator of a triangle T is the root of ``c h_T`` times the integral over T of the squared
    difference of both pressures, with the size ``h_T`` and the substrate's c in c / r: the square
    of a norm weaker by half an order than that of L2, in which errors of pressures are energies.
    It is an indicator: what it is of the true error is measured, not bounded
    (`benchmarks/postprocess.py`).

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> mesh = MeshTri.init_sqsymmetric().refined(3).translated((-0.5, -0.5))
    >>> dual, soil = DualMesh.from_mesh(mesh), HalfSpace(1.0, 0.0)
    >>> below = RigidPunch(soil, dual.basis(), edge="constant", collocation="node")
    >>> above = RigidPunch(soil, dual.primal_basis(), edge="constant")
    >>> estimate = estimate_error(below.solve(1.0), above.solve(1.0))
    >>> low, high = estimate.settlement
    >>> bool(low < 1 / (np.pi * 0.5 * 0.733576) < high)  # exact for the square
    True
    """
    check_couple(on_cells, on_triangles)
    solutions = on_cells, on_triangles
    constant = all(s.punch.weights is None for s in solutions)
    full = all(s.punch.gap is None and len(s.contact) == len(s.pressure) for s in solutions)
    opposite = constant and full and on_cells.punch.collocation == "node"
    settlement = np.array([s.settlement for s in solutions])
    tilt = np.stack([s.tilt for s in solutions], axis=1)
    dual, punch = on_cells.punch.basis.dual, on_cells.punch
    length = np.sqrt(punch.partition.areas.sum())
    by_tilt = (np.array(punch.origin) - punch.footprint.centre) @ tilt
    middle = settlement - by_tilt
    bracketed = opposite & np.append(
        _settlements_apart(middle, by_tilt, length * tilt), _tilts_apart(middle, length * tilt)
    )
    share = SHARE if bracketed[0] else 0.5

    triangle = np.arange(dual.refinement.nelements) // 6
    difference = on_cells.pressure[dual.refinement_cells] - on_triangles.pressure[triangle]
    area = np.abs(own_mapping(dual.refinement).detA) / 2
    size = np.sqrt(dual.primal_partition.areas)[triangle]
    squares = punch.footprint.ground.singular_coefficient * size * area * difference**2
    return CoupleEstimate(
        settlement=readonly(np.sort(settlement)),
        tilt=readonly(np.sort(tilt, axis=1)),
        bracketed=readonly(bracketed),
        mixed_settlement=float(share * settlement[0] + (1 - share) * settlement[1]),
        on_triangles=readonly(np.sqrt(np.bincount(triangle, squares))),
        on_cells=readonly(np.sqrt(np.bincount(dual.refinement_cells, squares))),
    )


def _settlements_apart(settlement: ndarray, by_tilt: ndarray, tilt: ndarray) -> bool:
    """Whether errors of settlements, those at the centroid and what the inclination adds at the
    origin, do not cancel: those of the inclination, which are larger, are opposed only if small.
    """
    small = np.abs(settlement) <= np.ptp(tilt, axis=1).max()  # of the mesh, under moments alone
    opposed = (settlement * by_tilt < 0) & (APART[1] * np.abs(by_tilt) >= np.abs(settlement))
    return not (small | opposed).any()


def _tilts_apart(settlement: ndarray, tilt: ndarray) -> ndarray:
    """Whether inclinations, shape (2, 2), differ as those of dual cells and triangles do.

    They are settlements over the length of the plan, beside settlements at its centroid.
    """
    (low, high), (on_cells, on_triangles) = settlement, tilt.T
    step = on_triangles - on_cells
    tilted = np.minimum(abs(on_cells), abs(on_triangles)) > ROUNDING * abs(settlement).max()
    settled = max(abs(high + low), np.finfo(float).tiny)  # none without load
    least, most = (
        factor * abs(high - low) / settled * abs(on_cells + on_triangles) for factor in APART
    )
    # with the sign of the inclination: triangles tilt more
    step = step * np.sign(on_cells + on_triangles)
    return tilted & (on_cells * on_triangles > 0) & (least <= step) & (step <= most)


def marked(indicator: ndarray, fraction: float = 0.5) -> ndarray:
    """The fewest cells that hold a fraction of the sum of squares (Dörfler's marking).

    Parameters
    ----------
    indicator : (m,) array of float
        Indicators of cells, as `CoupleEstimate.on_triangles`.
    fraction : float
        Above 0, up to 1; the larger, the more cells.

    Returns
    -------
    array of int
        Their numbers, ascending, for ``mesh.refined``.

    Raises
    ------
    TypeError
        If an argument is of another kind.
    ValueError
        If ``fraction`` is not above 0 and up to 1, there is no indicator, or one is negative or
        not finite.

    Examples
    --------
    >>> marked(np.array([0.1, 2.0, 0.5, 1.0]), 0.9)
    array([1, 3])
    """
    indicator = checked_array("indicator", indicator, ("ncells",), least=1, each="cell")
    fraction = checked_number("fraction", fraction, above=0, at_most=1)
    if (indicator < 0).any():
        k = int(np.argmax(indicator < 0))
        raise ValueError(f"expected indicators from 0 on, got {indicator[k]:g} of cell {k}")
    largest = indicator.max(initial=0.0)
    squares = (indicator * np.ldexp(1.0, -int(np.frexp(largest)[1]))) ** 2
    order = np.argsort(squares)[::-1]
    sums = np.cumsum(squares[order])
    enough = int(np.searchsorted(sums, fraction * sums[-1] * (1 - 1e-12))) + int(largest > 0)
    return np.sort(order[:enough])
