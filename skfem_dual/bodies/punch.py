"""A rigid punch pressed on a substrate: equations (3)-(5) of the paper."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar, Literal

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis

from ..arguments import Pair, checked_flag, checked_instance
from ..contact.edges import EdgeBoundaries
from ..contact.footprint import Collocation, Edge, Footprint, require_even
from ..contact.load import Constraints, Load, between_waves, load_of, require_compression
from ..contact.motions import require_carried
from ..contact.parts import Part
from ..contact.problem import Contact
from ..contact.sectors import gaps_beside
from ..contact.shapes import Gap
from ..contact.system import ContactSystem
from ..contact.unilateral import How, Method
from ..elements.balance import resist
from ..ground.periodic import PeriodicGround
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..kernels.progress import timed
from ..messages import shown
from ..operators.influence_operator import InfluenceOperator
from ..operators.resources import require_matrix
from ..operators.symmetric_matrix import SymmetricMatrix
from ..operators.symmetry import Symmetry
from ..solutions.cases_solution import CasesSolution
from ..solutions.pressures import CellPressures, checked_solution
from ..solutions.punch_solution import PunchSolution
from .body import Movable
from .cases import Cases, named, solve_cases
from .rigid import RigidBodies


@dataclass(frozen=True, eq=False, repr=False)
class RigidPunch(Movable, RigidBodies):
    """A rigid, smooth punch on an elastic substrate, flat or shaped.

    The unknowns are the mean pressures of the cells of a partition, and the displacement of the
    ground equals that of the punch in one point of every cell. Matrix and factors are computed
    once and serve any number of loads.

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace, LayeredHalfSpace or PeriodicGround
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the plan of the punch: ``dual.basis()``, ``dual.primal_basis()``,
        ``CellBasis(mesh, ElementTriP0())`` or ``CellBasis(mesh, ElementQuad0())``.
    edge : {"singular", "constant"}, optional
        How the pressure varies inside a cell. ``"singular"``: like the inverse square root of the
        distance to the edge of the plan, as under the edge of a flat punch, and in its corners
        by the exponents of their angles. ``"constant"``: not at all but along the line where
        contact ends; it is the paper's scheme, whose settlements of flat punches are tens of
        times less accurate. By default flat punches are singular; and so are shaped ones where
        their pressures grow to the edge of the plan, for which they are solved again, but on
        uniform grids from 256 cells on, whose fast transforms take constant pressures. Neither
        is where ground acts on far larger cells like springs: thin layers, E0 (1 + 1000 z).
    edge_boundaries : str, sequence of str or of int, optional
        The boundaries of the mesh that are such an edge, by their names or as facets; all of
        them by default. Where a punch is rounded off, for example, the pressure does not grow.
        The mesh is always the whole plan: there are no images beyond a line of symmetry.
    collocation : {"centroid", "node"}
        The point of each cell: its centroid, or, with constant pressures only, the node of the
        other grid that belongs to it (the node of the triangulation for dual cells). With
        constant pressures and centroids the settlement comes out too large, with nodes of dual
        cells too small.
    origin : pair of float
        The centre of the punch, to which settlement, force and moments refer.
    gap : callable, array or (CellBasis, vector), optional
        Shape of a punch that is not flat: its distance from the ground before they press on each
        other, positive where there is a slot. A function of coordinates of shape (2, n) from
        the coordinates' origin, such as those of `shapes`; one value for each collocation point;
        or a field of scikit-fem.
    rtol : float, optional
        Accuracy of the settlements under given pressures, see `InfluenceOperator`: far cells
        are summed up. By default dense with exact entries up to 4000 cells (on graded and layered
        ground to 1e-9 of the homogeneous entry and the error of the influence function), 1e-6
        and whatever is fastest beyond. Fast operators are solved by iterations.
    symmetry : "auto" or Symmetry, optional
        Mirror lines and rotations of the plan and its mesh, found or given: the matrix needs one
        row of each orbit of cells and is solved in independent blocks. ``print(symmetry)`` tells
        the saving. The load need not be symmetric.
    outline : (2, k) array of float, optional
        Points on the edge of the plan that span it, where the cells have nodes beside it, as on
        arcs, whose meshes keep the area: `Plan.hull`. Largest settlements are those of its
        points; by default of the vertices of the cells.
    corners : (2, m) array of float, optional
        Corners of the plan, re-entrant ones and those of holes too: `Plan.corners`. Reports name
        their settlements; by default they are where the edge of the mesh turns sharply, as it may
        do on coarse arcs, too.

    Raises
    ------
    TypeError
        If an argument is something else than what it must be.
    ValueError
        If boundaries are not on the edge of the plan, an outline spans another one, a shape is
        not finite in all cells or its size not theirs, or the punch is flat on a
        `PeriodicGround`; cells that do not fill its period are refused by `solve`.
    MeshError
        If the basis is not piecewise constant on cells of a plane region, or the cells do not
        have the symmetry that is given.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> punch = RigidPunch(HalfSpace(young=1.0, poisson=0.25), dual.basis())
    >>> solution = punch.solve(force=1.0)
    >>> print(f"{solution.settlement:.3f}")  # exact for the circle: 0.46875
    0.469
    """

    substrate: Substrate
    basis: CellBasis
    edge: Edge | None = None
    edge_boundaries: EdgeBoundaries | None = None
    collocation: Collocation = "centroid"
    origin: Pair = (0.0, 0.0)
    gap: Gap | None = None
    rtol: float | None = None
    symmetry: Literal["auto"] | Symmetry | None = None
    outline: ArrayLike | None = None
    corners: ArrayLike | None = None
    timings: dict[str, float] = field(default_factory=dict, init=False, compare=False)
    edge_by_contact: bool = field(default=False, init=False)
    _refined_by: ClassVar[str] = ", as by refine_to_contact on triangles"

    def __post_init__(self) -> None:
        self._own("basis", "gap", "edge_boundaries", "outline", "corners")
        flat, at_nodes = self.gap is None and not self._periodic, self.collocation == "node"
        self._choose_edge(flat, not (flat or self._periodic or at_nodes))
        symmetry = self.symmetry
        auto = symmetry is None or (isinstance(symmetry, str) and symmetry == "auto")
        if not (auto or isinstance(symmetry, Symmetry)):
            raise TypeError(f'expected symmetry "auto" or a Symmetry, got {shown(symmetry)}')
        # a basis that cannot be used is refused now, and so is a shape
        object.__setattr__(self, "origin", self.footprint.origin)
        self._warn()
        if self._periodic and not np.ptp(self.initial_gap) > 0:
            raise ValueError(
                "expected a shape for gap on a PeriodicGround, got a flat punch, under which the "
                "pressure is uniform"
            )

    @property
    def _periodic(self) -> bool:
        return isinstance(self.substrate, PeriodicGround)

    @computed_once
    def footprint(self) -> Footprint:
        """The cells under the punch, with all that pressures and gaps depend on."""
        return Footprint.from_basis(
            self.substrate,
            self.basis,
            "singular" if self.edge is None else self.edge,
            self.edge_boundaries,
            self.collocation,
            self.origin,
            self.rtol,
            self.outline,
            self.corners,
        )

    @computed_once
    def matrix(self) -> ndarray:
        """Settlement of each collocation point under unit pressure on each cell, d_ij of (5).

        Raises
        ------
        MemoryError
            Before the work, if the memory at hand will not hold it.
        """
        require_matrix(len(self.partition), len(self.partition))
        with timed(self.timings, "assembly"):
            return self.footprint.in_points.matrix()

    @computed_once
    def operator(self) -> ndarray | SymmetricMatrix | InfluenceOperator:
        """The matrix as an array, blocks of a symmetric one, or a fast summation of many cells."""
        symmetry, cells = self._symmetry, self.footprint
        regular = cells.regular or self._periodic
        if symmetry is None and self.rtol is None and cells.few and not regular:
            return self.matrix
        with timed(self.timings, "assembly"):
            if symmetry is not None:
                return cells.symmetric_matrix(symmetry)
            return cells.operator(cells.tolerance)

    @property
    def _rtol(self) -> float:
        """Accuracy of the operator's products."""
        return getattr(self.operator, "rtol", self.rtol or 0.0)

    @computed_once
    def _symmetry(self) -> Symmetry | None:
        """The symmetry to be used; None if there is none, or too little for so many cells."""
        if self.symmetry is None:
            return None
        if isinstance(self.symmetry, str):
            return self.footprint.usable_symmetry()
        self.symmetry.require(self.partition, self.collocation_points, self.weights)
        return self.symmetry

    @computed_once
    def system(self) -> ContactSystem:
        """The equations for pressures and the position of the plan's centroid."""
        return ContactSystem(
            self.operator,
            self.planes(self.collocation_points),
            self.footprint.resultants,
            self.initial_gap,
            self.partition.areas,
            self.timings,
            partition=self.partition,
        )

    @property
    def condition_number(self) -> float:
        """Condition number of the matrix in the 2-norm.

        The paper does not say what its degree of conditionality is. It prints 274.0 for the
        uniform polar grid of Table 1, where this number is 246.9; that of the matrix with its
        rows scaled to sums of one comes nearest, 275.4.
        """
        return self.system.condition_number

    def solve(
        self,
        force: float | None = None,
        at: Pair | None = None,
        moments: Pair | None = None,
        *,
        settlement: float | None = None,
        tilt: Pair | None = None,
        horizontal: Pair | None = None,
        torsion: float | None = None,
        unilateral: bool = True,
        method: Method = "auto",
        start: CellPressures | None = None,
        gap_rtol: float = 1e-10,
        progress: bool = False,
    ) -> PunchSolution:
        """Pressures and position of the punch under a load, in a position, or a mixture of both.

        Parameters
        ----------
        force, at, moments, settlement, tilt
            What is imposed; see `Load`.
        horizontal, torsion : pair of float, float, optional
            A force (Hx, Hy) on the base, in the plane of the ground, and a moment about the
            vertical through ``origin``, positive from x towards y. Cells in contact carry them by
            shear tractions, which neither slip nor change the pressures; see
            ``solution.shear``. With up to 4000 cells, and not on layers on a smooth rigid base.
        unilateral : bool
            Whether the contact region is found: the ground does not pull, and the punch lifts
            off where it would. If not, all cells stay in contact, the paper's (5).
        method : {"auto", "active-set", "cg"}
            How the contact region is found: a primal-dual active set, which takes a dense matrix;
            projected conjugate gradients, which only multiply by it; or, by default, conjugate
            gradients and, where the matrix is dense, the active set from where they end.
        start : PunchSolution or ElasticSolution, optional
            A solution nearby to begin with, on any grid and of any body.
        gap_rtol : float
            Accuracy of the gaps in contact where conjugate gradients find it, over the largest
            settlement. With 1e-3 or more the line of contact is not resolved inside cells, which
            saves most of the time.
        progress : bool
            Whether iterations show progress bars.

        Returns
        -------
        PunchSolution
            With ``success=False`` and a `ConvergenceWarning` if the contact region was not found.

        Raises
        ------
        TypeError
            If an argument is of another kind.
        ValueError
            If the load is incomplete, contradictory or not finite, or if no pressures can
            balance it: tension, moments without a force, or a resultant beyond the plan; or if
            ``gap_rtol`` is not positive and up to 0.01; or if the ground is not known to carry
            ``horizontal`` and ``torsion``, or hardly touches.
        ConvergenceError
            If the system of equations is singular.
        """
        how = How.checked(unilateral, method, gap_rtol)
        given = Load(force, at, moments, settlement, tilt, horizontal, torsion)
        load = self.acted_on(given, how.unilateral)
        progress = checked_flag("progress", progress)
        pressures = None if start is None else self.pressures_of(start)
        _, (solution,) = self._solved((load,), how, pressures, progress)
        _ = solution.shear  # what does not hold is told now
        return solution

    def solve_many(
        self,
        cases: Cases,
        *,
        unilateral: bool = True,
        method: Method = "auto",
        gap_rtol: float = 1e-10,
        progress: bool = False,
    ) -> CasesSolution:
        """Many load cases at a time, by superposition while all cells keep contact.

        Parameters
        ----------
        cases : mapping of str to Load or mapping, or sequence of them
            Loads, or keyword arguments of `Load`, by the names of the cases.
        unilateral, method, gap_rtol, progress
            As `solve`.

        Returns
        -------
        CasesSolution
            With ``success`` of each case; a `ConvergenceWarning` names one without. A load that
            turns the punch over is such a case, and no error.

        Raises
        ------
        TypeError, ValueError
            If a load is incomplete, contradictory or not finite; says which. Or as `solve`.
        """
        how = How.checked(unilateral, method, gap_rtol)
        names, given = named(cases)
        said = [f"load case {name!r}" for name in names]
        loads = [
            self.acted_on(load_of(*pair), how.unilateral, pair[0]) for pair in zip(said, given)
        ]
        single = [(load,) for load in loads]
        answers = solve_cases(self, names, single, how, checked_flag("progress", progress))
        answers.warn()
        return answers.of(0, self.footprint, loads)

    def acted_on(self, load: Load, unilateral: bool, name: str = "load") -> Load:
        """What acts under a load: on periodic ground no tilt, and a force without a place."""
        return between_waves(load, unilateral, name) if self._periodic else load

    def constraints(self, loads: tuple[Load, ...], unilateral: bool) -> Constraints:
        """What one load imposes; a ValueError where no pressures, or no ground, can balance it."""
        load = loads[0]
        require_carried(self.footprint, load)
        origin = self.origin - self.centre
        if unilateral:
            require_compression(load, origin, self.footprint.hulls, self.gap is None)
            require_even(self.footprint, self._shape, load)
        return load.constraints(origin)

    def works(self, contact: Contact) -> bool:
        """Of punches with edge-weighted cells, not all in a line, that are flat or touch with
        their whole base, whose shape is known between collocation points."""
        checked_instance("contact", contact, Contact)
        if self.weights is None or not resist(self.collocation_points, contact.touching):
            return False
        return self.gap is None or bool(contact.touching.all() and self.work.gaps is not None)

    @computed_once
    def _shape(self) -> Callable[[ndarray], ndarray | None] | None:
        return None if self.gap is None else partial(gaps_beside, self._same_shape())

    def answers(
        self,
        loads: tuple[Load, ...],
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
    ) -> tuple[PunchSolution, ...]:
        """The answer under one load, from contact and position."""
        return (PunchSolution.from_contact(self, loads[0], contact, position, timings),)

    @property
    def cells(self) -> Footprint:
        """The cells under the punch."""
        return self.footprint

    @property
    def parts(self) -> tuple[Part, ...]:
        """The only one."""
        return (Part(self.footprint, 0, self.centre),)

    def pressures_of(self, start: CellPressures) -> ndarray:
        """Pressures of the cells in a solution of any punch."""
        return checked_solution("start", start).pressures_on(self.footprint)

    def __repr__(self) -> str:
        return (
            f"<skfem_dual RigidPunch object>\n  Substrate: {self.substrate}\n"
            f"  Grid: {self.grid_description}"
        )
