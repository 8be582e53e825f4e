"""Structures that bend on the ground: any stiffness assembled with scikit-fem.

A structure under the loads f and the pressures p of the ground deflects by
``w = C (f - L p) + Z y``: C is a generalised inverse of its stiffness, L the work of the pressures
by the law inside the cells, Z its motions without resistance. With its deflections T w in the
collocation points the gap to the ground and the balance of the motions,

    g = A p + g0 - T w = (A + T C L) p + (g0 - T C f) - T Z y,        Z' L p = Z' f,

are the equations of a rigid punch with another matrix: `ContactSystem` serves both, and a
structure too stiff to bend is the rigid punch of the same cells.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix
from skfem import CellBasis, FacetBasis
from skfem.assembly.basis import AbstractBasis

from ..arguments import Pair, checked_array, checked_flag, checked_sequence
from ..contact.edges import EdgeBoundaries
from ..contact.footprint import Edge, Footprint
from ..contact.load import Constraints
from ..contact.one_sign import solved
from ..contact.problem import Contact, Contribution
from ..contact.shapes import Gap
from ..contact.system import ContactSystem
from ..contact.unilateral import How, Method
from ..contact.verify import verified
from ..elements.shape_functions import picklable
from ..ground.substrates import Substrate, checked_substrate
from ..kernels.once import computed_once
from ..kernels.progress import Seconds, progress_bars, timed
from ..operators.compliance import BalancedCompliance, Compliance
from ..operators.yielding import YieldingOperator
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.pressures import CellPressures, checked_solution
from .body import Body
from .free_motions import FreeMotions
from .interface import Interface, require_facing
from .resisted import NO_BALANCE, compliance_of, require_resisted, work_on


@dataclass(frozen=True, eq=False, repr=False)
class ElasticPunch(Body):
    """A structure that bends, on an elastic substrate, in smooth contact.

    The structure is what scikit-fem has assembled: a stiffness on any basis of deflections, as of
    plates, or on a vector-valued basis of a solid. Its mesh may be that of the cells or any other
    that covers them. Its factors and the ground's matrix are computed once and serve any number
    of loads.

    Parameters
    ----------
    substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
        The ground.
    basis : CellwiseBasis or CellBasis
        Piecewise constants on the plan, the pressures; see `RigidPunch`.
    structure : CellBasis
        Of a plate: on a 2-D mesh, deflections positive into the ground. Of a solid: vector-valued
        on a 3-D mesh whose ``boundary`` is horizontal and has the shape of the plan.
    stiffness : (N, N) sparse matrix
        Symmetric, positive semidefinite. Motions without resistance are found; those that the
        ground does not resist either, as sliding of a solid, must be free of loads or held.
    boundary : str or array of int, optional
        Of a solid: the facets that face the ground, by name or number, as scikit-fem takes them.
    component : int, optional
        Of a basis of several fields the scalar component that is the deflection; see
        `load_matrix`. By default the first scalar field of a plate, the outward normal
        displacement of a solid.
    D : array of int, DofsView or dict of them, optional
        DOFs that are held, as in scikit-fem's `condense`; their values are given to `solve`.
    edge : {"singular", "constant"}, optional
        How the pressure varies inside the cells at the edge of the plan, see `RigidPunch`.
        By default as there. ``"singular"`` is closer for plates of every stiffness: the pressure
        under a soft one grows at the edge, too, in a strip as wide as the stiffness carries;
        where cells are wider than that strip, ``"constant"`` is closer.
    edge_boundaries, origin, rtol
        As of `RigidPunch`.
    gap : callable, array or (CellBasis, vector), optional
        Distance of the unloaded structure from the ground (camber), see `RigidPunch`.

    Raises
    ------
    TypeError
        If an argument is of another kind.
    ValueError
        If sizes do not agree, the structure does not cover the plan, or the stiffness is not
        symmetric or not positive semidefinite.

    Examples
    --------
    A circular plate on the ground, free to lift off:

    >>> from skfem import BilinearForm, CellBasis, ElementTriMorley, LinearForm, MeshTri
    >>> from skfem.helpers import dd, ddot, eye, trace
    >>> from skfem_dual import DualMesh, ElasticPunch, HalfSpace
    >>> mesh = MeshTri.init_circle(4)
    >>> plate = CellBasis(mesh, ElementTriMorley())
    >>> @BilinearForm
    ... def bending(w, v, _):
    ...     return 0.01 * ddot(0.8 * dd(w) + 0.2 * eye(trace(dd(w)), 2), dd(v))
    >>> soil, cells = HalfSpace(young=1.0, poisson=0.0), DualMesh.from_mesh(mesh).basis()
    >>> raft = ElasticPunch(soil, cells, plate, bending.assemble(plate))
    >>> f = LinearForm(lambda v, w: (w.x[0] ** 2 + w.x[1] ** 2 < 0.1) * v).assemble(plate)
    >>> s = raft.solve(f)
    >>> bool(s.contact_area < 0.9 * 3.14), f"{s.force / f[plate.nodal_dofs[0]].sum():.9f}"
    (True, '1.000000000')
    """

    substrate: Substrate
    basis: CellBasis
    structure: AbstractBasis
    stiffness: Any
    boundary: Any = None
    component: int | None = None
    D: Any = None
    edge: Edge | None = None
    edge_boundaries: EdgeBoundaries | None = None
    origin: Pair = (0.0, 0.0)
    gap: Gap | None = None
    rtol: float | None = None
    timings: dict[str, float] = field(default_factory=dict, init=False, compare=False)
    edge_by_contact: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        checked_substrate(self.substrate)
        self._own("basis", "structure", "stiffness", "boundary", "D", "gap", "edge_boundaries")
        self._choose_edge(self.gap is None, self.gap is not None)
        require_facing(self.structure, self.boundary)
        object.__setattr__(self, "origin", self.footprint.origin)
        # what does not fit is refused now
        self.loads  # noqa: B018
        self.compliance  # noqa: B018
        self.trace  # noqa: B018
        self._warn()

    def __getstate__(self) -> dict[str, Any]:
        """What makes the punch."""
        return super().__getstate__() | {"structure": picklable(self.structure)}

    @computed_once
    def footprint(self) -> Footprint:
        """The cells under the structure, with all that pressures and gaps depend on."""
        return Footprint.from_basis(
            self.substrate,
            self.basis,
            "singular" if self.edge is None else self.edge,
            self.edge_boundaries,
            "centroid",
            self.origin,
            self.rtol,
        )

    @computed_once
    def compliance(self) -> Compliance:
        """What the structure yields, and its motions without resistance."""
        with timed(self.timings, "structure"):
            return compliance_of(self.structure, self.stiffness, self.D)

    @computed_once
    def balanced_compliance(self) -> BalancedCompliance:
        """The same while pressures like its motions bear what is not balanced."""
        bearing = self.loads @ (self.trace @ self.motions)
        return BalancedCompliance(self.compliance, self.motions, bearing)

    @computed_once
    def interface(self) -> Interface:
        """Where it faces the ground."""
        return Interface(self.structure, self.boundary, self.component, self.footprint)

    @property
    def contact_basis(self) -> CellBasis | FacetBasis:
        """The basis of the structure where it faces the ground: its own, or on the facets."""
        return self.interface.basis

    @property
    def loads(self) -> csr_matrix:
        """L, work of unit mean pressure on each cell against deflections, shape (N, n)."""
        return self.interface.loads

    def loads_of(self, cells: Footprint) -> csr_matrix:
        """Work of unit mean pressures with their slopes, if cells may be flat; shape (N, n)."""
        return self.interface.loads_of(cells)

    @property
    def trace(self) -> csr_matrix:
        """T, deflection of each collocation point, positive into the ground, shape (n, N).

        Where that of a cell around a re-entrant corner lies outside of the structure it is the
        mean over the cell, the same for linear deflections.
        """
        return self.interface.trace

    @computed_once
    def free_motions(self) -> FreeMotions:
        """What moves without resistance of the structure."""
        return FreeMotions(self.compliance, self.trace, self.partition)

    @property
    def motions(self) -> ndarray:
        """Displacements without resistance of the structure that move it against the ground,
        shape (N, m): settlement and tilts of a free one."""
        return self.free_motions.resisted

    @property
    def idle_motions(self) -> ndarray:
        """Displacements without resistance that leave the collocation points where they are,
        shape (N, k), as sliding does."""
        return self.free_motions.idle

    def require_load(self, f: ndarray, held: ndarray) -> None:
        """Refuse loads, with a ValueError, that leave out what nothing else holds."""
        self.free_motions.require_load(self._effective(f, held))

    @computed_once
    def operator(self) -> YieldingOperator:
        """What ground and structure yield together under unit pressure on each cell."""
        cells = self.footprint
        with timed(self.timings, "assembly"):
            exact, x = cells.rtol is None and cells.few, self.collocation_points
            ground = cells.influence(x) if exact else cells.operator(cells.tolerance)
        return YieldingOperator(ground, self.balanced_compliance, self.trace, self.loads)

    @computed_once
    def matrix(self) -> ndarray:
        """The same as an array, by one solution with the structure's factors for each cell."""
        with timed(self.timings, "matrix"):
            return self.operator.to_dense()

    def solve(
        self,
        f: ArrayLike,
        *,
        x: ArrayLike | None = None,
        unilateral: bool = True,
        method: Method = "auto",
        start: CellPressures | None = None,
        gap_rtol: float = 1e-10,
        progress: bool = False,
    ) -> ElasticSolution:
        """Deflections and pressures under loads.

        Parameters
        ----------
        f : (N,) array of float
            Load vector of the structure, as scikit-fem assembles it: of a plate positive into
            the ground.
        x : (N,) array of float, optional
            Values of the DOFs that are held, as in scikit-fem's `condense`: only those of ``D``
            count, all are finite. Zero by default.
        unilateral : bool
            Whether the contact region is found: the ground does not pull. If not, all cells stay
            in contact.
        method : {"auto", "active-set", "cg"}
            How it is found: by projected conjugate gradients, which only multiply; or by an
            active set, for which the structure's part of the matrix is computed, once. By
            default the first, and up to 4000 cells the second where that does not end soon, as
            under a structure that is far too soft to spread its load.
        start : ElasticSolution or PunchSolution, optional
            A solution nearby to begin with.
        gap_rtol : float
            Accuracy of the gaps in contact, over the largest displacement.
        progress : bool
            Whether iterations show progress bars.

        Returns
        -------
        ElasticSolution
            With ``success=False`` and a `ConvergenceWarning` if the contact was not found.

        Raises
        ------
        TypeError
            If an argument is of another kind.
        ValueError
            If sizes are wrong, loads are not finite, nothing resists them, or they cannot be
            balanced without tension; or if ``gap_rtol`` is not positive and up to 0.01.
        """
        f, held = self.checked_loads(f, x)
        how = How.checked(unilateral, method, gap_rtol)
        if start is not None:
            checked_solution("start", start)
        seconds = Seconds()
        constraints, sloped = self.share(f, held).constraints, np.zeros(len(self.partition), bool)

        def require_balance(flat: ndarray) -> None:
            if not self._system(f, held, flat, False).can_balance(constraints):
                raise ValueError(NO_BALANCE)

        if how.unilateral:
            self.require_load(f, held)
            require_balance(sloped)
        pressures = None if start is None else start.pressures_on(self.footprint)
        rtol = 0.0 if self.rtol is None else self.rtol

        def find(flat: ndarray, start: ndarray | None) -> tuple[Contact, ndarray]:
            system = self._system(f, held, flat, dense=method == "active-set")
            return verified(system, constraints, how, start, rtol=rtol)

        with progress_bars(checked_flag("progress", progress)):
            contact, position = solved(self.footprint, find, how.unilateral, pressures)
        # slopes reach farther out than flat cells, but turn there
        if how.unilateral and not contact.success and self.footprint.slopes is not None:
            require_balance(~sloped)
        if contact.success and (sharp := self.over_edge(contact.pressure)) is not None:
            return sharp.solve(f, x=x, **how._asdict(), progress=progress)
        timings = {"solution": seconds()}
        return ElasticSolution.from_contact(self, f, held, contact, position, timings)

    def solve_many(self, F: Iterable[ArrayLike], **options: Any) -> tuple[ElasticSolution, ...]:
        """Solutions under several loads, with the same factors.

        Parameters
        ----------
        F : (N, k) array or sequence of (N,) arrays of float
            Load vectors, the columns of an array.
        options
            Further arguments of `solve` for all of them.

        Returns
        -------
        tuple of ElasticSolution
            Of each load.

        Raises
        ------
        TypeError, ValueError
            As `solve`; says which load, from 0.
        """
        columns = F.T if isinstance(F, np.ndarray) and F.ndim == 2 else F
        found = []
        for number, f in enumerate(checked_sequence("F", columns)):
            try:
                found.append(self.solve(f, **options))
            except (TypeError, ValueError) as error:
                raise type(error)(f"load {number}: {error}") from error
        return tuple(found)

    def checked_loads(self, f: ArrayLike, x: ArrayLike | None) -> tuple[ndarray, ndarray]:
        """Loads, and values of the DOFs that are held.

        Raises
        ------
        TypeError, ValueError
            If sizes are wrong, values are not finite, or nothing resists the loads.
        """
        n, fixed = self.structure.N, self.compliance.fixed
        f, held = checked_array("f", f, (n,), each="DOF"), np.zeros(n)
        if x is not None:
            held[fixed] = checked_array("x", x, (n,), each="DOF")[fixed]
        loads = self._effective(f, held)
        require_resisted(self.structure, self.compliance, self.idle_motions, loads)
        return f, held

    def _system(self, f: ndarray, held: ndarray, flat: ndarray, dense: bool) -> ContactSystem:
        """The equations where some cells are flat."""
        planes, resultants, gap, _ = self.share(f, held, flat)
        operator, cells, areas = self.operator, self.footprint, self.partition.areas
        if flat.any():
            ground = cells.flattened_operator(operator.ground, flat)
            operator = replace(operator, ground=ground, loads=self.loads_of(cells.flattened(flat)))
        matrix = operator if not dense else operator.to_dense() if flat.any() else self.matrix
        nearby = self.operator.preconditioner if flat.any() else None
        return ContactSystem(matrix, planes, resultants, gap, areas, self.timings, nearby)

    def share(self, f: ndarray, held: ndarray, flat: ndarray | None = None) -> Contribution:
        """What the structure brings into the equations; cells may be flat, (n,) of bool."""
        cells = self.footprint if flat is None else self.footprint.flattened(flat)
        loads = self.loads if cells is self.footprint else self.loads_of(cells)
        return Contribution(
            (self.trace @ self.motions).T,
            self.motions.T @ loads,
            self.initial_gap - self.trace @ self.lifted(f, held),
            Constraints.forces(work_on(self.motions, self._effective(f, held))),
        )

    def _effective(self, f: ndarray, held: ndarray) -> ndarray:
        """Loads of the free DOFs, of the values of held ones too."""
        return f - self.compliance.stiffness @ held if held.any() else f

    def lifted(self, f: ndarray, held: ndarray) -> ndarray:
        """Displacements under the loads alone, up to the motions."""
        return self.balanced_compliance.displacements(self._effective(f, held)) + held

    def __repr__(self) -> str:
        element = type(self.structure.elem).__name__
        return (
            f"<skfem_dual ElasticPunch object>\n  Substrate: {self.substrate}\n"
            f"  Grid: {self.grid_description}\n"
            f"  Structure: {self.structure.N} DOFs of {element}, {self.motions.shape[1]} motions "
            "that only the ground resists"
        )
