"""Bodies of any kind on one ground: rigid punches beside structures that bend.

The equations are those of each body alone, one after the other, but for the ground, which settles
under the pressures of all: with the deflections ``T_b C_b L_b`` of every structure they are
``(A + T C L) p + g0 - T C f = planes' s`` and the balance of every body.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.linalg import block_diag
from scipy.sparse import block_diag as sparse_block_diag
from scipy.sparse import csr_matrix

from ..arguments import checked_flag, checked_sequence
from ..contact.by_work import Beside, added_by_work, met
from ..contact.edges import rough_of
from ..contact.footprint import Footprint
from ..contact.load import Constraints, Load
from ..contact.loaded_cells import Ground, LoadedCells, slices_of
from ..contact.one_sign import solved
from ..contact.pressed import Pressed
from ..contact.problem import Contact, Contribution, warn_of
from ..contact.system import ContactSystem
from ..contact.unilateral import How, Method
from ..contact.union import joint_operator, union
from ..contact.verify import verified
from ..kernels.once import FromFields, computed_once
from ..kernels.progress import Seconds, progress_bars, timed
from ..messages import shown
from ..operators.compliance import Structures
from ..operators.influence_operator import InfluenceOperator
from ..operators.yielding import YieldingOperator
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.group_solution import PunchesSolution
from ..solutions.punch_solution import PunchSolution
from .contributions import checked_load, contribution, require_balanced
from .elastic import ElasticPunch
from .group import RigidPunches
from .neighbours import (
    checked_names,
    over_edges,
    require_apart,
    require_one_ground,
    tell_of_coarse,
)
from .punch import RigidPunch


@dataclass(frozen=True, eq=False, repr=False)
class Punches(FromFields):
    """Rigid and elastic punches on one substrate that act on each other through the ground.

    A raft beside the footings of its neighbours, a stiff pier behind a wall that bends. Each body
    has its own load, motions and, if it bends, its own structure; bodies that a frame connects
    are one structure, or `RigidPunches` with a ``stiffness``.

    Parameters
    ----------
    punches : sequence of RigidPunch and ElasticPunch
        The bodies, all on the same substrate; their plans do not overlap.
    names : sequence of str, optional
        What messages call the punches; by default their numbers.

    Raises
    ------
    TypeError, ValueError
        If there is no punch, their substrates differ, their plans overlap, or there is not one
        name for each.

    Examples
    --------
    A footing leans towards a flexible slab beside it:

    >>> from skfem import BilinearForm, CellBasis, ElementTriMorley, LinearForm, MeshTri
    >>> from skfem.helpers import dd, ddot
    >>> from skfem_dual import DualMesh, ElasticPunch, HalfSpace, Punches, RigidPunch
    >>> soil, circle = HalfSpace(young=1.0, poisson=0.0), MeshTri.init_circle(3)
    >>> plate = CellBasis(circle.translated((2.5, 0.0)), ElementTriMorley())
    >>> bending = BilinearForm(lambda u, v, w: 0.01 * ddot(dd(u), dd(v)))
    >>> slab = ElasticPunch(
    ...     soil, DualMesh.from_mesh(plate.mesh).basis(), plate, bending.assemble(plate)
    ... )
    >>> footing = RigidPunch(soil, DualMesh.from_mesh(circle).basis())
    >>> both = Punches([footing, slab])
    >>> weight = LinearForm(lambda v, w: v).assemble(plate)
    >>> on_footing, on_slab = both.solve([{"force": 1.0}, weight]).solutions
    >>> bool(on_footing.tilt[0] > 0), f"{on_slab.force / on_footing.force:.4f}"
    (True, '3.1214')
    """

    punches: Sequence[RigidPunch | ElasticPunch]
    names: Sequence[str] = ()
    stiffness: ClassVar[None] = None  # no frame
    timings: dict[str, float] = field(default_factory=dict, init=False, compare=False)

    def __post_init__(self) -> None:
        punches = tuple(checked_sequence("punches", self.punches))
        bad = [p for p in punches if not isinstance(p, (RigidPunch, ElasticPunch))]
        if bad or not punches:
            came = shown(bad[0]) if bad else "none"
            raise TypeError(f"expected some RigidPunch or ElasticPunch, got {came}")
        names = checked_names(self.names, len(punches))
        require_one_ground(punches, names)
        require_apart(punches, names)
        object.__setattr__(self, "punches", punches)
        object.__setattr__(self, "names", names)

    @property
    def bodies(self) -> tuple[tuple[int], ...]:
        """Numbers of the punches of each body: each is one."""
        return tuple((i,) for i in range(len(self.punches)))

    @property
    def footprints(self) -> tuple[Footprint, ...]:
        """The cells of each punch."""
        return tuple(punch.footprint for punch in self.punches)

    @computed_once
    def rigid(self) -> RigidPunches | None:
        """The same bodies with the laws of lines of contact, if none of them bends."""
        rigid = [punch for punch in self.punches if isinstance(punch, RigidPunch)]
        return RigidPunches(rigid, names=self.names) if len(rigid) == len(self.punches) else None

    @computed_once
    def cells(self) -> LoadedCells:
        """The cells of all punches, one punch after the other."""
        return union(self.footprints)

    @computed_once
    def ground(self) -> ndarray | InfluenceOperator:
        """Settlement of all collocation points under unit pressure on each cell.

        Up to 4000 cells exact and dense, unless all punches have an ``rtol``.
        """
        with timed(self.timings, "assembly"):
            return joint_operator(self.footprints, self.cells)

    @computed_once
    def operator(self) -> YieldingOperator:
        """What the ground and all structures yield together under unit pressure on each cell."""
        return self._operator(self.ground, np.zeros(len(self.cells), dtype=bool))

    def _operator(self, ground: Ground, flat: ndarray) -> YieldingOperator:
        """The same where some cells are flat."""
        traces, loads, parts = [], [], []
        for punch, own in zip(self.punches, self.slices, strict=True):
            n = len(punch.footprint)
            if isinstance(punch, ElasticPunch):
                traces.append(punch.trace)
                loads.append(punch.loads_of(punch.footprint.flattened(flat[own])))
                parts.append(punch.balanced_compliance)
            else:
                traces.append(csr_matrix((n, 0)))
                loads.append(csr_matrix((0, n)))
        trace, load = (sparse_block_diag(blocks, "csr") for blocks in (traces, loads))
        return YieldingOperator(ground, Structures(tuple(parts)), trace, load)

    @computed_once
    def matrix(self) -> ndarray:
        """The same as an array, by one solution with the factors for each cell of a structure."""
        with timed(self.timings, "matrix"):
            return self.operator.to_dense()

    def solve(
        self,
        loads: Sequence[Load | Mapping | ArrayLike],
        *,
        unilateral: bool = True,
        method: Method = "auto",
        gap_rtol: float = 1e-10,
        progress: bool = False,
    ) -> PunchesSolution:
        """Pressures, positions and deflections of all bodies.

        Parameters
        ----------
        loads : sequence
            One for each punch: of a rigid one a `Load` or a mapping of its arguments, of an
            elastic one the load vector ``f`` of its structure, or a mapping with ``f`` and the
            values ``x`` of DOFs that are held.
        unilateral, method, gap_rtol, progress
            As of `ElasticPunch.solve`.

        Returns
        -------
        PunchesSolution
            With a `PunchSolution` or an `ElasticSolution` for each punch; with
            ``success=False`` and a `ConvergenceWarning` if the contact was not found.

        Raises
        ------
        TypeError, ValueError
            If there is not one load for each punch, a load does not fit its punch (says which),
            or loads cannot be balanced without tension.
        MemoryError
            If the memory at hand will not do.
        ConvergenceError
            If a body can move without resistance.
        """
        how, progress = (
            How.checked(unilateral, method, gap_rtol),
            checked_flag("progress", progress),
        )
        given = self._checked_loads(loads)
        if self.rigid is not None:
            options = how._asdict() | {"progress": progress}
            return replace(self.rigid.solve(given, **options), punches=self)
        tell_of_coarse(self)
        return self._solved(given, how, progress)

    def _solved(self, given: list[Any], how: How, progress: bool) -> PunchesSolution:
        seconds = Seconds()
        shares = self._shares(given, np.zeros(len(self.cells), dtype=bool))
        if how.unilateral:
            self._require_balance(given, shares)
        constraints = Constraints.together([share.constraints for share in shares])

        def short(added: ndarray, last: Contact | None) -> tuple[Contact, ndarray]:
            imposed = replace(constraints, fixed=constraints.fixed - added)
            return self._contact(given, imposed, how, last)

        def added(contact: Contact, position: ndarray) -> ndarray:
            return self._added(shares, contact, position)

        with progress_bars(progress):
            found = short(np.zeros(len(constraints.fixed)), None)
            if found[0].success:
                sharp = over_edges(self, found[0].pressure, self._sharp)
                if sharp is not None:
                    return sharp._solved(given, how, progress)
            contact, position = met(found, added, short)
        sloping = all(cells.slopes is not None for cells in self.footprints)
        # slopes reach farther out than flat cells, but turn there
        if how.unilateral and sloping and not contact.success:
            self._require_balance(given, self._shares(given, np.ones(len(self.cells), bool)))
        if contact.success and not how.unilateral:
            for name, punch in zip(self.names, self.punches, strict=True):
                if isinstance(punch, RigidPunch):
                    punch.warn_of_pulling(f"punch {name}: ")
        timings = self.timings | {"solution": seconds()}
        return PunchesSolution(self, self._solutions(given, shares, contact, position, timings))

    def _contact(
        self, given: list[Any], constraints: Constraints, how: How, last: Contact | None
    ) -> tuple[Contact, ndarray]:
        """Contact and positions by collocation, beginning with the contact found last."""

        def find(flat: ndarray, start: ndarray | None) -> tuple[Contact, ndarray]:
            system = self._system(self._shares(given, flat), flat, how.method == "active-set")
            rtol = getattr(self.ground, "rtol", 0.0)
            return verified(system, constraints, how, start, rtol=rtol)

        start = None if last is None else last.pressure
        return solved(self.cells, find, how.unilateral, start)

    def _added(self, shares: list[Contribution], contact: Contact, position: ndarray) -> ndarray:
        """What work adds to the positions of rigid bodies of which something is imposed."""
        ends = np.cumsum([len(share.planes) for share in shares])
        some = [
            (i, slice(end - len(share.planes), end))
            for i, (punch, share, end) in enumerate(zip(self.punches, shares, ends, strict=True))
            if isinstance(punch, RigidPunch) and not share.constraints.of_forces
        ]
        parts = [contact.under(own) for own in self.slices]
        return added_by_work(self.punches, parts, position, some)

    @computed_once
    def slices(self) -> list[slice]:
        """Where the cells of each punch are among those of all."""
        return slices_of(self.footprints)

    @computed_once
    def _sharp(self) -> dict[tuple[bool, ...], "Punches"]:
        """The same with edges of flat punches, by which of them press over theirs."""
        return {}

    def _shares(self, given: list[Any], flat: ndarray) -> list[Contribution]:
        each = zip(self.punches, given, self.slices, strict=True)
        return [contribution(punch, load, flat[cells]) for punch, load, cells in each]

    def _system(self, shares: list[Contribution], flat: ndarray, dense: bool) -> ContactSystem:
        """The equations where some cells are flat."""
        operator: YieldingOperator | ndarray = self.operator
        if flat.any():
            operator = self._operator(self.cells.flattened_operator(self.ground, flat), flat)
            operator = operator.to_dense() if dense else operator
        elif dense:
            operator = self.matrix
        return ContactSystem(
            operator,
            block_diag(*(share.planes for share in shares)),
            block_diag(*(share.resultants for share in shares)),
            np.concatenate([share.gap for share in shares]),
            np.concatenate([punch.partition.areas for punch in self.punches]),
            self.timings,
            self.operator.preconditioner if flat.any() else None,
        )

    def _checked_loads(self, loads: Sequence[Any]) -> list[Any]:
        loads = checked_sequence("loads", loads)
        if len(loads) != len(self.punches):
            raise ValueError(
                f"expected one load for each of the {len(self.punches)} punches, got {len(loads)}"
            )
        return [
            checked_load(f"loads[{i}]", punch, load)
            for i, (punch, load) in enumerate(zip(self.punches, loads, strict=True))
        ]

    def _require_balance(self, given: list[Any], shares: list[Contribution]) -> None:
        """Refuse loads of a body that pressures under it cannot balance."""
        operator, each = self.operator, zip(self.names, self.punches, given, shares, strict=True)
        for name, punch, load, share in each:
            try:
                require_balanced(punch, load, share, operator)
            except ValueError as error:
                raise ValueError(f"punch {name}: {error}") from None

    def _solutions(
        self,
        given: list[Any],
        shares: list[Contribution],
        contact: Contact,
        position: ndarray,
        timings: dict[str, float],
    ) -> tuple[PunchSolution | ElasticSolution, ...]:
        parts = [contact.under(own) for own in self.slices]
        moved = np.split(position, np.cumsum([len(share.planes) for share in shares])[:-1])
        pressed = tuple(map(Pressed.of, self.punches, parts))
        solutions: list[PunchSolution | ElasticSolution] = []
        for i, (punch, load) in enumerate(zip(self.punches, given, strict=True)):
            others, part, way = (*pressed[:i], *pressed[i + 1 :]), parts[i], moved[i]
            if isinstance(punch, RigidPunch):
                warn_of(part, rough_of(punch.partition, part, not punch.initial_gap.any()))
                times = punch.timings | timings
                beside = Beside(punch, load, part, way, others)
                found = PunchSolution.from_contact(punch, load, part, way, times, others, beside)
                solutions.append(found)
            else:
                f, held = load
                bent = ElasticSolution.from_contact(punch, f, held, part, way, timings, others)
                solutions.append(bent)
        return tuple(solutions)

    def __repr__(self) -> str:
        named = zip(self.names, self.punches, strict=True)
        lines = [f"  {type(p).__name__} {name}: {p.grid_description}" for name, p in named]
        head = f"<skfem_dual Punches object>\n  Substrate: {self.punches[0].substrate}"
        return "\n".join([head, *lines])
