"""Several rigid punches on one ground: neighbouring foundations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, cast

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from ..arguments import checked_array, checked_flag, checked_instance, checked_sequence
from ..contact.edges import pulling
from ..contact.load import Constraints, Load
from ..contact.loaded_cells import ExactRows, LoadedCells
from ..contact.parts import Part, by_bodies
from ..contact.problem import Contact
from ..contact.system import ContactSystem
from ..contact.unilateral import How, Method
from ..contact.union import in_blocks, joint_operator, rows_of, union
from ..grids.polygons import readonly
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..kernels.progress import timed
from ..messages import shown
from ..operators.influence_operator import InfluenceOperator
from ..operators.symmetric_matrix import SymmetricMatrix
from ..solutions.cases_solution import CasesSolution
from ..solutions.group_solution import PunchesSolution, answers_of
from ..solutions.punch_solution import PunchSolution
from .arrangement import Arrangement
from .cases import Cases, named, solve_cases
from .frame import FramedSystem, checked_stiffness
from .group_work import PositionsByWork
from .joined import checked_joined
from .neighbours import (
    checked_names,
    interaction_factors,
    over_edges,
    pressures_of,
    punches_on,
    require_apart,
    require_balance,
    require_one_ground,
    tell_of_coarse,
)
from .punch import RigidPunch
from .rigid import RigidBodies


@dataclass(frozen=True, eq=False, repr=False)
class RigidPunches(RigidBodies):
    """Rigid punches on one substrate that act on each other through the ground.

    Each is a body with its own load, settlement and tilt; punches that are ``joined`` move as
    one body. Where joined punches touch, the pressure is not singular. The equations of all cells
    are as accurate as the ``rtol`` of any punch asks for, see `operator`.

    Parameters
    ----------
    punches : sequence of RigidPunch
        The punches, all on the same substrate.
    joined : sequence of sequence of int
        Numbers of the punches that are joined rigidly, for example ``[(0, 1)]``. Their load
        refers to the origin of the first.
    stiffness : (3 m, 3 m) array of float or sparse matrix, optional
        Of a frame on the m bodies, against their positions (W0, Lx, Ly) one after the other, from
        their origins: what a frame program condenses to its supports. Symmetric and positive
        semidefinite; rows of zeros are hinges. Loads then act on bodies and frame together.
    names : sequence of str, optional
        What messages call the punches; by default their numbers.

    Raises
    ------
    TypeError, ValueError
        If there is no punch, their substrates differ, their plans overlap, ``joined`` names a
        punch twice or one that does not exist, ``stiffness`` has another shape or is not
        symmetric and positive semidefinite, or ``names`` are not one for each punch.

    Examples
    --------
    Two footings beside each other settle more, and lean towards each other:

    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace
    >>> soil, circle = HalfSpace(1.0, 0.0), MeshTri.init_circle(3)
    >>> left, right = (
    ...     RigidPunch(soil, DualMesh.from_mesh(circle.translated((x, 0))).basis(), origin=(x, 0))
    ...     for x in (-1.5, 1.5)
    ... )
    >>> pair = RigidPunches([left, right]).solve([{"force": 1.0}, {"force": 1.0}])
    >>> [round(s.settlement, 2) for s in pair.solutions], bool(pair[0].tilt[0] > 0)
    ([0.61, 0.61], True)
    """

    punches: Sequence[RigidPunch]
    joined: Sequence[Sequence[int]] = ()
    stiffness: Any = None
    names: Sequence[str] = ()
    timings: dict[str, float] = field(default_factory=dict, init=False, compare=False)

    def __post_init__(self) -> None:
        punches = tuple(checked_sequence("punches", self.punches))
        bad = [shown(p) for p in punches if not isinstance(p, RigidPunch)]
        if bad or not punches:
            raise TypeError(f"expected some RigidPunch, got {bad[0] if bad else 'none'}")
        names = checked_names(self.names, len(punches))
        require_one_ground(punches, names)
        groups = checked_joined(self.joined, len(punches))
        require_apart(punches, names)
        object.__setattr__(self, "punches", punches)
        object.__setattr__(self, "joined", tuple(groups))
        object.__setattr__(self, "names", names)
        if self.stiffness is not None:
            ground = Arrangement(punches, groups).ground_stiffness
            matrix = checked_stiffness(self.stiffness, ground)
            object.__setattr__(self, "stiffness", readonly(matrix))

    @classmethod
    def from_subdomains(
        cls,
        substrate: Substrate,
        mesh: MeshTri,
        names: Sequence[str] | None = None,
        grid: Literal["dual", "triangles"] = "dual",
        joined: Sequence[Sequence[int]] = (),
    ) -> "RigidPunches":
        """One flat punch on each subdomain of a mesh, its origin at the centroid of its plan.

        Parameters
        ----------
        substrate : HalfSpace, GradedHalfSpace or LayeredHalfSpace
            The ground.
        mesh : MeshTri
            A mesh with subdomains.
        names : sequence of str, optional
            Their names; by default all, in alphabetical order.
        grid : {"dual", "triangles"}
            Whether cells are those of the dual grid or triangles.
        joined : sequence of sequence of int
            As for the class.

        Raises
        ------
        TypeError
            If an argument is of another kind.
        ValueError
            If a subdomain does not exist, or ``joined`` does not fit.
        MeshError
            If the triangles of a subdomain have no valid dual grid.
        """
        found, punches = punches_on(substrate, mesh, names, grid)
        return cls(punches, joined, names=found)

    @computed_once
    def arrangement(self) -> Arrangement:
        """How the punches stand together."""
        return Arrangement(self.punches, self.joined, self.stiffness, self.names)

    @property
    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the punches of each body, in the order of their first ones."""
        return self.arrangement.bodies

    @property
    def members(self) -> tuple[RigidPunch, ...]:
        """The punches as they stand: with a singular edge only where they touch no other of their
        body."""
        return self.arrangement.members

    @property
    def parts(self) -> tuple[Part, ...]:
        """The punches, one after the other."""
        return self.arrangement.parts

    @property
    def centres(self) -> tuple[ndarray, ...]:
        """Centroid of each body, to which its position refers."""
        return self.arrangement.centres

    @computed_once
    def cells(self) -> LoadedCells:
        """The cells of all punches, one punch after the other."""
        return union(self.footprints)

    @computed_once
    def operator(self) -> ndarray | SymmetricMatrix | InfluenceOperator:
        """From all cells to all collocation points, as accurate as any of the punches asks for.

        Up to 4000 cells exact and dense, unless all punches have an ``rtol``; beyond, the least of
        these. If all have a ``symmetry``, that of the whole arrangement is looked for and used.

        Raises
        ------
        MemoryError
            Before the work, if the memory at hand will not do.
        """
        with timed(self.timings, "assembly"):
            symmetric = all(punch.symmetry is not None for punch in self.members)
            found = self.cells.usable_symmetry() if symmetric and self.stiffness is None else None
            if found is not None:
                return self.cells.symmetric_matrix(found)
            return joint_operator(self.footprints, self.cells)

    @computed_once
    def exact_rows(self) -> ExactRows:
        """Some rows of the matrix, computed apart from it."""
        blocks = isinstance(self.operator, ndarray) and in_blocks(self.footprints, self.cells)
        return rows_of(self.footprints) if blocks else cast(ExactRows, self.cells.exact_rows)

    @property
    def _rtol(self) -> float:
        """Accuracy of the operator's products."""
        return getattr(self.operator, "rtol", min(p.rtol or 0.0 for p in self.members))

    @computed_once
    def system(self) -> ContactSystem:
        """The equations for all pressures and the positions of the bodies."""
        planes = [punch.planes(punch.collocation_points) for punch in self.members]
        return ContactSystem(
            self.operator,
            by_bodies(self.parts, planes),
            self.resultants_of(self.footprints),
            np.concatenate([p.initial_gap for p in self.members]),
            np.concatenate([p.partition.areas for p in self.members]),
            self.timings,
            partition=self.cells.partition,
        )

    def solve(
        self,
        loads: Sequence[Load | Mapping],
        *,
        unilateral: bool = True,
        method: Method = "auto",
        start: PunchesSolution | None = None,
        gap_rtol: float = 1e-10,
        progress: bool = False,
    ) -> PunchesSolution:
        """Pressures and positions of all bodies under one load each.

        Parameters
        ----------
        loads : sequence of Load or mapping
            What is imposed on each body, in the order of `bodies`; keyword arguments of `Load`.
        unilateral, method, gap_rtol, progress
            As `RigidPunch.solve`.
        start : PunchesSolution, optional
            A solution nearby to begin with, of as many punches.

        Returns
        -------
        PunchesSolution
            With ``success=False`` and a `ConvergenceWarning` if the contact was not found.

        Raises
        ------
        TypeError
            If an argument is of another kind.
        ValueError
            If there is not one load for each body, a load is impossible (says which), or
            ``gap_rtol`` is not positive and up to 0.01.
        MemoryError
            If the memory at hand will not do.
        ConvergenceError
            If the system of equations is singular.
        """
        given = self.arrangement.loads_of("loads", loads)
        tell_of_coarse(self)
        how = How.checked(unilateral, method, gap_rtol)
        progress, begin = checked_flag("progress", progress), pressures_of(self.members, start)
        return PunchesSolution(*self._solved(given, how, begin, progress))

    def solve_many(
        self,
        cases: Cases,
        *,
        unilateral: bool = True,
        method: Method = "auto",
        gap_rtol: float = 1e-10,
        progress: bool = False,
    ) -> tuple[CasesSolution, ...]:
        """Many load cases, each with one load for each body.

        Parameters
        ----------
        cases : mapping of str to sequence of Load or mapping, or sequence of them
            Loads of the bodies by the names of the cases.
        unilateral, method, gap_rtol, progress
            As `RigidPunch.solve`.

        Returns
        -------
        tuple of CasesSolution
            Of each punch.

        Raises
        ------
        TypeError, ValueError
            If there is not one load for each body, a load is incomplete, contradictory or not
            finite (says which), or under a frame.
        """
        how = How.checked(unilateral, method, gap_rtol)
        if self.stiffness is not None:
            raise ValueError(
                "expected punches without a frame. Remedy: solve case by case; reports take what "
                "is answered by the names of the cases"
            )
        names, given = named(cases)
        together = self.arrangement
        loads = [together.loads_of(f"load case {n!r}", case) for n, case in zip(names, given)]
        tell_of_coarse(self)
        found = solve_cases(self, names, loads, how, checked_flag("progress", progress))
        found.warn()
        each = enumerate(self.members)
        return tuple(found.of(i, p.footprint, together.taken_by(i, loads)) for i, p in each)

    def constraints(self, loads: tuple[Load, ...], unilateral: bool) -> Constraints:
        """What the loads of all bodies impose; a ValueError where no pressures balance them."""
        together = self.arrangement
        require_balance(together, loads, unilateral and self.stiffness is None)
        imposed = together.imposed(loads)
        if self.stiffness is not None:
            FramedSystem(self.system, imposed).require_balance(unilateral)
        return imposed

    @computed_once
    def by_work(self) -> PositionsByWork:
        """Positions of the bodies by the work of the pressures."""
        return PositionsByWork(self.arrangement, self.work, self._rtol)

    def works(self, contact: Contact) -> bool:
        """See `PositionsByWork.works`."""
        return self.by_work.works(checked_instance("contact", contact, Contact))

    def added(self, contact: Contact, position: ndarray) -> ndarray:
        """What work adds to positions of bodies, some of them shaped, or of many others, (m,)."""
        return self.by_work.added(contact, position)

    def over_edge(self, pressure: ndarray) -> "RigidPunches | None":
        """The same with edges of flat punches where shaped ones press over that of their plan."""
        pressure = checked_array("pressure", pressure, (len(self.cells),), each="cell")
        return over_edges(self, pressure, self._sharp, self.arrangement.edges)

    def warn_of_pulling(self, name: str = "") -> None:
        """Warn of punches that would have to be pulled down alone, too, see `RigidPunch`."""
        areas, pressures = self.cells.partition.areas, self.system.unit_pressures
        each = zip(self.members, self.names, self.parts, self.slices, strict=True)
        for punch, called, part, own in each:
            if pulling(areas[own], pressures[own, 3 * part.body]):
                punch.warn_of_pulling(f"{name}punch {called}: ")

    @computed_once
    def _sharp(self) -> dict[tuple[bool, ...], "RigidPunches"]:
        """Such groups, by which of their punches press over."""
        return {}

    def answers(
        self,
        loads: tuple[Load, ...],
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
    ) -> tuple[PunchSolution, ...]:
        """Of each punch, from contact and positions of all."""
        return answers_of(self, loads, contact, position, timings)

    def interaction_factors(self, loads: Sequence[Load | Mapping], **options: Any) -> ndarray:
        """Settlement of each body over its settlement alone on the ground, under the same load.

        Parameters
        ----------
        loads
            As `solve`.
        options
            Further arguments of `solve`; ``start`` is of the bodies together.

        Returns
        -------
        (nbodies,) array of float
            Of the settlements of the origins. On homogeneous ground at least 1 for forces on
            origins in the middle of plans; elsewhere bodies that lean towards each other may lift
            them: there they are less, or negative. So they are beside a load on a thin layer that
            keeps its volume, where the ground heaves.

        Raises
        ------
        TypeError, ValueError
            As `solve`; and under a frame, which takes a part of the loads to the other bodies.
        """
        return interaction_factors(self, loads, options)

    def __repr__(self) -> str:
        named = zip(self.names, self.punches, strict=True)
        lines = [f"  Punch {name}: {punch.grid_description}" for name, punch in named]
        bodies = ", ".join("+".join(self.names[i] for i in body) for body in self.bodies)
        head = f"<skfem_dual RigidPunches object>\n  Substrate: {self.punches[0].substrate}"
        return "\n".join([head, *lines, f"  Bodies: {bodies}"])
