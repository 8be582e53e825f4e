"""What is solved for a plan on every mesh, and how its meshes are made."""

from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import numpy as np
from skfem import MeshTri

from ..arguments import Pair, checked_number
from ..bodies.punch import RigidPunch
from ..contact.hull import Hull
from ..contact.load import Load, require_compression
from ..contact.system import DENSE
from ..errors import MeshError, Told, warn, warnings_kept
from ..grids.dual_mesh import DualMesh
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..messages import place
from ..solutions.punch_solution import PunchSolution
from .plan import Plan

#: length of the facets on the edge over that of the largest
GRADED = 0.4
#: length of the largest facets on the first mesh, over twice the area by the perimeter
FIRST = 0.6
#: the longest step from one length to the next
LARGEST_STEP = 0.71
#: step where only the triangles that touch are made smaller
HALVED = 0.5
#: the longest that a step counts for where there are hardly more cells
LONGEST_STEP = 0.95
#: cells grow with this power of the length of the facets
GROWTH = 1.5
#: where there is no mesh of a length, so many times it
SHORTER = 1.0, 0.94, 0.88
#: so many cells are solved on in no time, whatever the limit
QUICK = 1000
#: nodes of slender plans over perimeter by length of facets, seconds that their triangulation
#: takes over the square of these, and how many are waited for without a limit
NODES, TRIANGULATED, SLENDER = 6.0, 1e-8, 60.0
#: lengths tried if the first is too coarse for the outline
TRIES = 6


@dataclass(frozen=True, eq=False)
class Attempt:
    """A mesh and the solutions on it, what they warned of, the length of facets, and seconds."""

    mesh: MeshTri
    solutions: tuple[PunchSolution, ...]
    warned: list[Told]
    size: float
    seconds: float

    @property
    def cells(self) -> int:
        """Cells of the mesh."""
        return len(self.solutions[0].pressure)

    @property
    def trusted(self) -> bool:
        """Whether they solve the equations, on cells fine enough for ground and contact."""
        return self.found and not self.warned

    @property
    def found(self) -> bool:
        """Whether they solve the equations."""
        return all(solution.success for solution in self.solutions)


@dataclass(frozen=True, eq=False)
class Problem:
    """What is solved on each mesh: a plan under some loads, without what pushes and twists."""

    plan: Plan
    substrate: Substrate
    loads: tuple[Load, ...]
    origin: Pair
    unilateral: bool
    progress: bool
    time_limit: float | None = None

    def __post_init__(self) -> None:
        if self.time_limit is not None:
            checked_number("time_limit", self.time_limit, above=0)

    @property
    def most(self) -> float:
        """Cells on which the loads can be solved."""
        return np.inf if all(load.shear is None for load in self.loads) else DENSE

    @computed_once
    def _hull(self) -> Hull:
        return Hull(self.plan.hull)

    def fault(self, load: Load) -> str:
        """Why no mesh can balance a load, empty if some may."""
        if load.force == 0 and load.shear is not None and load.shear.any():
            return "expected a positive force with horizontal forces and torsion, got 0"
        if not self.unilateral:
            return ""
        try:
            require_compression(load, np.array(self.origin), (self._hull, self._hull), True)
        except ValueError as error:
            return str(error)
        return ""

    def on_coarsest(self) -> Attempt:
        """On the coarsest mesh that will do.

        Raises
        ------
        TimeoutError
            If that has many cells and takes longer than the time limit, or than a minute without
            one: a solution takes about as long as its mesh.
        ValueError, MeshError
            If a load cannot be carried, or no mesh of the outline is found.
        """
        for load in self.loads:
            if fault := self.fault(load):
                raise ValueError(fault)
        size = FIRST * 2 * self.plan.area / sum(ring.length for ring in self.plan.rings)
        for shrink in LARGEST_STEP ** np.arange(TRIES):
            begin = perf_counter()
            self._require_not_slender(shrink * size)
            try:
                mesh = self.mesh(shrink * size)
                self._require_time(mesh, 2 * (perf_counter() - begin))
                return self.on(mesh, shrink * size, begin)
            except ValueError as error:  # the outline, or a load near its edge, takes finer ones
                trouble = error
        raise trouble

    def _require_not_slender(self, size: float) -> None:
        """Triangulation of long rows of nodes takes the square of their number."""
        nodes = round(NODES * sum(ring.length for ring in self.plan.rings) / size)
        seconds = TRIANGULATED * nodes**2
        allowed = SLENDER if self.time_limit is None else self.time_limit
        if nodes > 10 * QUICK and seconds > allowed:
            raise TimeoutError(
                f"expected a plan less slender, got one whose coarsest mesh takes {nodes} cells "
                f"or more and about {seconds:.2g} s, {allowed:g} s are allowed. Remedy: "
                "time_limit=, a shorter piece of the plan, or RigidPunch on a mesh of your own"
            )

    def _require_time(self, mesh: MeshTri, seconds: float) -> None:
        many = mesh.p.shape[1] > QUICK
        if many and self.time_limit is not None and seconds > self.time_limit:
            raise TimeoutError(
                f"expected a time limit above the {seconds:.2g} s or so that the coarsest mesh of "
                f"the plan takes, of {mesh.p.shape[1]} cells, got {self.time_limit:g} s. Remedy: "
                "time_limit=; slender plans take many cells"
            )

    def finer(self, last: Attempt, step: float) -> tuple[Attempt, float]:
        """On a mesh with facets ``step`` times as long, and the step that was taken.

        Where less than half of the plan touches the ground, whatever the load, the last mesh is
        halved there, and the rest stays as it is. Outlines that take short facets anyway have
        little more cells on coarse meshes: theirs is the step that cells tell.
        """
        begin = perf_counter()
        if (near := self.halved(last)) is None:
            size = step * last.size
            mesh = self.mesh(size)
            step = max(step, min((last.cells / mesh.p.shape[1]) ** (1 / GROWTH), LONGEST_STEP))
        else:
            step = HALVED
            size = step * last.size
            mesh = self.plan.refine(last.mesh, near)
        return self.on(mesh, size, begin), step

    def halved(self, last: Attempt) -> np.ndarray | None:
        """The triangles that touch and those around, if the next mesh halves only these."""
        touching = np.unique(np.concatenate([s.contact for s in last.solutions]))
        areas = last.solutions[0].footprint.partition.areas
        if 2 * areas[touching].sum() > self.plan.area:
            return None
        t = last.mesh.t
        for _ in range(2):
            near = np.isin(t, touching).any(axis=0)
            touching = np.unique(t[:, near])
        return np.nonzero(near)[0]

    def cells_next(self, last: Attempt, step: float) -> int:
        """About how many cells the mesh of `finer` has."""
        if (near := self.halved(last)) is None:
            return round(last.cells * step**-GROWTH)
        return round(last.cells + len(near) * (HALVED**-2 - 1) / 2)

    def mesh(self, size: float) -> MeshTri:
        """Of this length of facets, or little less where there is none."""
        for shorter in SHORTER:
            try:
                return self.plan.mesh(shorter * size, graded=GRADED)
            except MeshError as error:
                trouble = error
        if not len(angles := self.plan.corner_angles):
            raise trouble
        k = int(np.argmin(angles))
        raise MeshError(
            "expected a plan that can be triangulated, got one of which no mesh with a valid dual "
            f"grid is found; its sharpest corner, of {np.degrees(angles[k]):.2g} degrees, is at "
            f"{place(self.plan.corners[:, k])}. Remedy: cut off what is so thin"
        ) from trouble

    def on(self, mesh: MeshTri, size: float, begin: float) -> Attempt:
        """On a mesh, the making of which began at some time."""
        dual = DualMesh.from_mesh(mesh)
        with warnings_kept() as warned:
            punch = RigidPunch(
                self.substrate,
                dual.basis(),
                origin=self.origin,
                outline=self.plan.hull,
                corners=self.plan.corners,
            )
            how: dict[str, Any] = {"unilateral": self.unilateral, "progress": self.progress}
            solutions = tuple(punch.solve(**asdict(load.upright), **how) for load in self.loads)
            for solution in solutions:
                solution.positions  # noqa: B018 - their time is part of the answer's
        return Attempt(mesh, solutions, warned, size, perf_counter() - begin)

    def pushed(self, found: Attempt) -> tuple[PunchSolution, ...]:
        """The solutions with what pushes and twists, on the mesh found without it."""
        if all(load.shear is None for load in self.loads):
            return found.solutions
        known = {told.message for told in found.warned}
        punch = found.solutions[0].punch
        how: dict[str, Any] = {"unilateral": self.unilateral, "progress": self.progress}
        with warnings_kept() as warned:
            solutions = tuple(punch.solve(**asdict(load), **how) for load in self.loads)
        for told in warned:
            if told.message not in known:
                warn(told.message, told.category)
        return solutions
