"""Several rigid punches on one ground: neighbouring foundations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, cast

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from ..arguments import checked_array, checked_flag, checked_instance, checked_sequence
from ..contact.by_work import added_amid_others, added_by_work
from ..contact.edges import pulling
from ..contact.load import Constraints, Load, Share, load_of
from ..contact.loaded_cells import ExactRows, LoadedCells
from ..contact.parts import Part, by_bodies
from ..contact.problem import Contact
from ..contact.system import ContactSystem
from ..contact.unilateral import How, Method
from ..contact.union import in_blocks, joint_operator, rows_of, union
from ..elements.balance import resist
from ..grids.outline import edge_ribs
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
from .cases import Cases, named, solve_cases
from .frame import FramedSystem, about_centroids, about_origin, checked_stiffness, ground_stiffness
from .joined import bodies_of, checked_joined, free_of, free_ribs
from .neighbours import (
    checked_names,
    over_edges,
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
            matrix = checked_stiffness(self.stiffness, self._ground_stiffness)
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
    def bodies(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the punches of each body, in the order of their first ones."""
        return bodies_of([tuple(group) for group in self.joined], len(self.punches))

    @computed_once
    def members(self) -> tuple[RigidPunch, ...]:
        """The punches as they stand: with a singular edge only where they touch no other of their
        body."""
        found = list(self.punches)
        for body in self.bodies:
            parts = [self.punches[i].partition for i in body]
            for i in body:
                found[i] = free_of(self.punches[i], parts)
        return tuple(found)

    @computed_once
    def _edges(self) -> list[ndarray | None]:
        """Ribs at which punches touch no other of their body; None where there is no other."""
        found: list[ndarray | None] = [None] * len(self.punches)
        for body in (body for body in self.bodies if len(body) > 1):
            parts = [self.punches[i].partition for i in body]
            for i, own in zip(body, parts, strict=True):
                found[i] = free_ribs(own, edge_ribs(own), parts)
        return found

    @computed_once
    def parts(self) -> tuple[Part, ...]:
        """The punches, one after the other."""
        body_of = {i: number for number, body in enumerate(self.bodies) for i in body}
        return tuple(
            Part(punch.footprint, body_of[i], self.centres[body_of[i]])
            for i, punch in enumerate(self.members)
        )

    @computed_once
    def centres(self) -> tuple[ndarray, ...]:
        """Centroid of each body, to which its position refers."""
        weighed = [(p.centre, p.partition.areas.sum()) for p in self.members]
        return tuple(
            readonly(
                sum(weighed[i][0] * weighed[i][1] for i in body) / sum(weighed[i][1] for i in body)
            )
            for body in self.bodies
        )

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
        given = self._given("loads", loads)
        tell_of_coarse(self)
        how = How.checked(unilateral, method, gap_rtol)
        progress = checked_flag("progress", progress)
        return PunchesSolution(*self._solved(given, how, self._pressures_of(start), progress))

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
        loads = [self._given(f"load case {name!r}", case) for name, case in zip(names, given)]
        tell_of_coarse(self)
        found = solve_cases(self, names, loads, how, checked_flag("progress", progress))
        found.warn()
        answers: dict[int, CasesSolution] = {}
        for number, body in enumerate(self.bodies):
            own = [case[number] for case in loads]
            if len(body) > 1:  # what each of them takes is found
                own = [self.share_of(number, load) for load in own]
            answers |= {i: found.of(i, self.members[i].footprint, own) for i in body}
        return tuple(answers[i] for i in range(len(self.members)))

    def share_of(self, number: int, load: Load) -> Share:
        """What its punches take of the load of a body, with a position yet to be found."""
        first = self.members[self.bodies[number][0]]
        names = tuple(self.names[i] for i in self.bodies[number])
        return Share(settlement=0.0, tilt=(0, 0), body=load, names=names, origin=first.origin)

    def _given(self, name: str, loads: Sequence[Load | Mapping]) -> tuple[Load, ...]:
        loads = checked_sequence(name, loads)
        if len(loads) != len(self.bodies):
            raise ValueError(
                f"expected one load for each of the {len(self.bodies)} bodies, got "
                f"{len(loads)} in {name}"
            )
        return tuple(load_of(f"{name}[{number}]", load) for number, load in enumerate(loads))

    def constraints(self, loads: tuple[Load, ...], unilateral: bool) -> Constraints:
        """What the loads of all bodies impose; a ValueError where no pressures balance them."""
        require_balance(self, loads, self._origins, unilateral and self.stiffness is None)
        together = self.imposed(loads)
        if self.stiffness is not None:
            FramedSystem(self.system, together).require_balance(unilateral)
        return together

    def imposed(self, loads: tuple[Load, ...]) -> Constraints:
        """What the loads of all bodies impose, and the frame."""
        own = zip(self._given("loads", loads), self._origins, strict=True)
        parts = [load.constraints(origin) for load, origin in own]
        if self.stiffness is not None:
            each = zip(parts, self._origins, self.bodies, strict=True)
            parts = [about_origin(p, origin, self._width(body)) for p, origin, body in each]
        together, ground = Constraints.together(parts), self._ground_stiffness
        return replace(together, frame=self._frame, ground=ground)

    def _width(self, body: Sequence[int]) -> float:
        """How wide a body is, about."""
        return float(np.sqrt(self._area(body)))

    def _area(self, body: Sequence[int]) -> float:
        return float(sum(self.punches[i].partition.areas.sum() for i in body))

    @property
    def _ground_stiffness(self) -> ndarray:
        """About how stiff the ground is against the positions of the bodies."""
        areas = np.array([self._area(body) for body in self.bodies])
        return ground_stiffness(areas, self.punches[0].substrate.surface.contact_modulus)

    @computed_once
    def _frame(self) -> ndarray | None:
        """The stiffness of the frame, which refers to origins, to positions about centroids."""
        return None if self.stiffness is None else about_centroids(self.stiffness, self._origins)

    @property
    def _origins(self) -> list[ndarray]:
        """Those of the bodies, from the points to which their positions refer."""
        own = zip(self.bodies, self.centres, strict=True)
        return [self.members[body[0]].origin - centre for body, centre in own]

    def works(self, contact: Contact) -> bool:
        """Not of shaped punches, nor beside a body in the air or on cells in a line, which carry
        no moments, nor `amid_many`."""
        checked_instance("contact", contact, Contact)
        x, settled = self.cells.collocation_points, self.system.planes[::3]
        flat = all(punch.gap is None for punch in self.members) and not self.amid_many(contact)
        return flat and all(resist(x, contact.touching & (own != 0)) for own in settled)

    @computed_once
    def beside_shaped(self) -> tuple[int, ...]:
        """Numbers of bodies that are a flat punch beside shaped ones, without a frame: their
        positions are by work, too, see `Beside`."""
        flat = [punch.gap is None for punch in self.members]
        if all(flat) or self.stiffness is not None:
            return ()
        return tuple(n for n, (i, *more) in enumerate(self.bodies) if flat[i] and not more)

    def amid_many(self, contact: Contact) -> bool:
        """Whether work finds positions body by body, see `added_amid`: where flat punches lift
        off and no matrix is there, nor a frame."""
        known = isinstance(self.system.matrix, (np.ndarray, SymmetricMatrix))
        if known or self.stiffness is not None or contact.touching.all() or any(contact.lines):
            return False
        return all(p.gap is None and p.weights is not None for p in self.members)

    def added_amid(self, contact: Contact, position: ndarray) -> ndarray:
        """What work adds to positions by collocation, (2, m), see `added_amid_others`; nothing to
        those of joined punches."""
        parts = [contact.under(own, i) for i, own in enumerate(self.slices)]
        settled = self.work.settled_by(self._at_sectors, contact)
        alone = {body[0]: n for n, body in enumerate(self.bodies) if len(body) == 1}
        return added_amid_others(self.members, parts, position, settled, alone)

    @computed_once
    def _at_sectors(self) -> InfluenceOperator:
        """From the cells, which all have slopes, to the sectors where work looks."""
        return self.cells.fast_operator(self.work.sectors.x, self._rtol)

    def added(self, contact: Contact, position: ndarray) -> ndarray:
        """What work adds to positions of flat bodies among shaped ones or many others, (m,)."""
        if self.amid_many(contact):
            return self.added_amid(contact, position)[0]
        parts = [contact.under(own, i) for i, own in enumerate(self.slices)]
        some = [(self.bodies[n][0], slice(3 * n, 3 * n + 3)) for n in self.beside_shaped]
        return added_by_work(self.members, parts, position, some)

    def _pressures_of(self, start: PunchesSolution | None) -> ndarray | None:
        if start is None:
            return None
        checked_instance("start", start, PunchesSolution)
        if len(start.solutions) != len(self.members):
            raise ValueError(
                f"expected a solution of {len(self.members)} punches for start, got one of "
                f"{len(start.solutions)}"
            )
        parts = zip(self.members, start.solutions, strict=True)
        return np.concatenate([punch.pressures_of(part) for punch, part in parts])

    def over_edge(self, pressure: ndarray) -> "RigidPunches | None":
        """The same with edges of flat punches where shaped ones press over that of their plan."""
        pressure = checked_array("pressure", pressure, (len(self.cells),), each="cell")
        return over_edges(self, pressure, self._sharp, self._edges)

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
            At least 1 on homogeneous ground for forces without moments. Beside a load on a thin
            layer that keeps its volume the ground heaves: there they are less, or negative.

        Raises
        ------
        TypeError, ValueError
            As `solve`; and under a frame, which takes a part of the loads to the other bodies.
        """
        if self.stiffness is not None:
            raise ValueError(
                "expected punches without a frame, which leaves none of them alone. Remedy: "
                "RigidPunches without stiffness="
            )
        loads = checked_sequence("loads", loads)
        together = self.solve(loads, **options)
        options.pop("start", None)
        factors = []
        for body, load in zip(self.bodies, loads, strict=True):
            joined = [tuple(range(len(body)))] if len(body) > 1 else ()
            alone = RigidPunches([self.punches[i] for i in body], joined).solve([load], **options)
            if alone[0].settlement == 0:
                raise ValueError(
                    "expected loads that settle each body, got one without a settlement on punch "
                    f"{self.names[body[0]]}: there is nothing to compare"
                )
            factors.append(together[body[0]].settlement / alone[0].settlement)
        return np.array(factors)

    def __repr__(self) -> str:
        named = zip(self.names, self.punches, strict=True)
        lines = [f"  Punch {name}: {punch.grid_description}" for name, punch in named]
        bodies = ", ".join("+".join(self.names[i] for i in body) for body in self.bodies)
        head = f"<skfem_dual RigidPunches object>\n  Substrate: {self.punches[0].substrate}"
        return "\n".join([head, *lines, f"  Bodies: {bodies}"])
