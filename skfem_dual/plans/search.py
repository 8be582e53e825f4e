"""Finer and finer meshes of a plan, until the answers on them are accurate enough."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from skfem import MeshTri

from ..arguments import Pair, checked_number
from ..bodies.punch import RigidPunch
from ..contact.hull import Hull
from ..contact.load import Load, require_compression
from ..contact.system import DENSE
from ..elements.resolution import crusted
from ..errors import MeshError, Told, warnings_kept
from ..grids.dual_mesh import DualMesh
from ..ground.substrates import Substrate
from ..kernels.once import computed_once
from ..messages import place
from ..operators.influence_operator import RTOL
from ..operators.resources import ENTRY, whole
from ..solutions.punch_solution import PunchSolution
from .plan import Plan

#: length of the facets on the edge over that of the largest
GRADED = 0.4
#: length of the largest facets on the first mesh, over twice the area by the perimeter
FIRST = 0.6
#: errors shrink with this power of the length of the facets at least, and as a rule
LEAST_ORDER, ORDER = 1.5, 2.0
#: share of the distance between the positions by work and by collocation that errors have at least
SHARE = 0.25
#: the same of the first two answers, which may be near each other by chance, and on crusts that
#: bend between cells
FIRST_ORDER, FIRST_SHARE = 1.0, 0.5
#: steps from one length to the next
SMALLEST_STEP, LARGEST_STEP = 0.5, 0.71
#: step where only the triangles that touch are made smaller
HALVED = 0.5
#: the longest that a step counts for where there are hardly more cells
LONGEST_STEP = 0.95
#: share of the accuracy asked for that the next mesh aims at
AIM = 0.7
#: cells grow with this power of the length of the facets, and seconds with that of the cells
GROWTH, SLOWER = 1.5, 1.7
#: meshes tried at most
MESHES = 12
#: and where there is no mesh of a length, so many times it
SHORTER = 1.0, 0.94, 0.88
#: so many cells are solved on in no time, whatever the limit
QUICK = 1000
#: nodes of slender plans over perimeter by length of facets, seconds that their triangulation
#: takes over the square of these, and how many are waited for without a limit
NODES, TRIANGULATED, SLENDER = 6.0, 1e-8, 60.0
#: part of the contact of a load that may lie where no load that is judged has some
ELSEWHERE = 0.2
#: lengths tried if the first is too coarse for the outline
TRIES = 6


@dataclass(frozen=True)
class Trial:
    """A mesh that was solved on.

    Attributes
    ----------
    cells : int
        Its dual cells.
    error : float
        The error estimated; NaN on the first, which has nothing to be compared with.
    seconds : float
        What mesh and solution took.
    """

    cells: int
    error: float
    seconds: float


@dataclass(frozen=True)
class Accuracy:
    """How an answer was reached.

    Attributes
    ----------
    asked : float
        The error allowed.
    error : float
        The error estimated: of the settlement of any point of the plan, over the settlement
        under the force, or over the largest of the plan where the resultant is so far off that
        this is less. If a settlement is imposed, of the force and of the moments, over the
        pressures, all taken positive, and that times the distance of the farthest point.
    reached : bool
        Whether it is at most what was asked for.
    message : str
        That, or what kept it from being reached.
    trials : tuple of Trial
        The meshes, coarsest first.
    """

    asked: float
    error: float
    reached: bool
    message: str
    trials: tuple[Trial, ...]

    @property
    def cells(self) -> int:
        """Cells of the answer."""
        return self.trials[-1].cells

    @property
    def seconds(self) -> float:
        """Seconds on the meshes of `trials`."""
        return sum(trial.seconds for trial in self.trials)

    def __str__(self) -> str:
        return (
            f"{self.error:.1e} estimated, {self.asked:.1e} asked"
            f"{'' if self.reached else ', NOT REACHED'}; {self.cells} cells, "
            f"{len(self.trials)} meshes, {self.seconds:.2f} s"
        )


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
    """What is solved on each mesh: a plan under some loads."""

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

    @computed_once
    def _hull(self) -> Hull:
        return Hull(self.plan.hull)

    def fault(self, load: Load) -> str:
        """Why no mesh can balance a load, empty if some may."""
        if not self.unilateral:
            return ""
        if load.force == 0 and load.shear is not None and load.shear.any():
            return "expected a positive force with horizontal forces and torsion, got 0"
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
            solutions = tuple(punch.solve(**asdict(load), **how) for load in self.loads)
            for solution in solutions:
                solution.positions  # noqa: B018 - their time is part of the answer's
        return Attempt(mesh, solutions, warned, size, perf_counter() - begin)


def governing(problem: Problem) -> Problem:
    """The same with fewer loads: that which acts farthest from the origin, and those that govern.

    These are the ones with the largest pressure, settlement and tilt and the least contact on the
    coarsest mesh. Loads that pull or turn the plan over have no say, nor have those so near its
    edge that the first meshes carry none there.

    Raises
    ------
    ValueError
        If all loads do.
    """
    if len(problem.loads) == 1:
        return problem
    faults = [problem.fault(load) for load in problem.loads]
    if all(faults):
        raise ValueError(
            f"expected a load that pressures balance, got {len(faults)} of which none is; the "
            f"first: {faults[0]}"
        )
    points = np.array([load.point or (0.0, 0.0) for load in problem.loads])
    stands = np.array([not fault for fault in faults])
    inwards = np.argsort(-np.hypot(*points.T), kind="stable")
    with warnings_kept():
        farthest, punch = _first_solved(problem, [int(k) for k in inwards if stands[k]])
        cases = punch.solve_many(problem.loads, unilateral=problem.unilateral)
    judged = {farthest}
    if cases.success.any():
        judged |= {extreme.number for extreme in cases.envelope()}
        judged = _with_contact_elsewhere(judged, cases.solutions, problem.plan.area)
    return replace(problem, loads=tuple(problem.loads[k] for k in sorted(judged)))


def _first_solved(problem: Problem, numbers: Sequence[int]) -> tuple[int, RigidPunch]:
    """The first of some loads that a coarse mesh carries, and the punch on that mesh."""
    for k in numbers:
        try:
            alone = replace(problem, loads=(problem.loads[k],))
            return k, alone.on_coarsest().solutions[0].punch
        except MeshError:  # whatever the load
            raise
        except ValueError as error:
            trouble = error
    raise trouble


def _with_contact_elsewhere(
    judged: set[int], solutions: Sequence[PunchSolution | None], area: float
) -> set[int]:
    """Those and cases in contact where none of them is, as long as less than half of the plan is
    looked at: only where cases that are judged touch meshes become finer."""
    found = {k: s for k, s in enumerate(solutions) if s is not None and s.success}
    areas = next(iter(found.values())).footprint.partition.areas
    touched = np.zeros(len(areas), dtype=bool)
    for k in judged & found.keys():
        touched[found[k].contact] = True
    for k, solution in found.items():
        if 2 * areas[touched].sum() > area:
            break
        own = solution.contact
        if areas[own[~touched[own]]].sum() > ELSEWHERE * areas[own].sum():
            judged = judged | {k}
            touched[own] = True
    return judged


def search(problem: Problem, accuracy: float, memory: float) -> tuple[Attempt, Accuracy]:
    """Finer meshes until the error is small enough, or one would take too much; see `Accuracy`."""
    layered = problem.substrate.remainder is not None  # its table is not the first mesh's time
    last = problem.on_coarsest()
    error, change, trials = np.inf, 0.0, [Trial(last.cells, np.nan, last.seconds)]
    message = "the accuracy asked for is reached"
    while not (error <= accuracy and last.trusted):
        aim = np.sqrt(AIM * accuracy / error) if error > accuracy else LARGEST_STEP
        step = float(np.clip(aim if len(trials) > 1 else 1, SMALLEST_STEP, LARGEST_STEP))
        foreseen = problem.cells_next(last, step)
        if reason := _beyond(trials, foreseen, problem.time_limit, memory, layered):
            message = f"the accuracy of {accuracy:.1e} is not reached: {reason}"
            break
        finer, step = problem.finer(last, step)
        if last.found and not finer.found and finer.cells > DENSE:
            # it is the tolerance of products without a matrix that will not do
            failed = next(s.message for s in finer.solutions if not s.success)
            message = (
                f"the accuracy of {accuracy:.1e} is not reached: the error is about {error:.1e} "
                f"with {last.cells} cells; with {finer.cells}, after {finer.seconds:.3g} s, "
                f"{failed}"
            )
            break
        first, cells = len(trials) == 1, finer.solutions[0].footprint.partition
        doubted = first or crusted(problem.substrate, cells)
        order, share = (FIRST_ORDER, FIRST_SHARE) if doubted else (LEAST_ORDER, SHARE)
        left = change * step**ORDER
        pairs = zip(finer.solutions, last.solutions, strict=True)
        change = max(difference(a, b) for a, b in pairs) / (step**-order - 1)
        error = max(change, left, share * max(map(inner_difference, finer.solutions)))
        error = error if finer.found else np.inf
        trials.append(Trial(finer.cells, error, finer.seconds))
        last = finer
    reached = error <= accuracy and last.trusted
    return last, Accuracy(accuracy, error, reached, message, tuple(trials))


def _beyond(
    trials: list[Trial], cells: int, time_limit: float | None, memory: float, layered: bool
) -> str:
    """Why a mesh with so many cells is too much; empty if it is not."""
    last = trials[-1]
    so_far = f"the error is about {last.error:.1e} with {last.cells} cells"
    if len(trials) == 1:
        so_far = f"one answer, with {last.cells} cells, tells no error"
    if len(trials) == MESHES:
        return f"{so_far} on the last of {MESHES} meshes"
    needed = ENTRY * cells**2 if cells <= DENSE else whole(cells, RTOL, layered)
    if needed > memory:
        return (
            f"{so_far}; about {cells} would take {needed / 2**20:.4g} MiB of the "
            f"{memory / 2**20:.4g} MiB allowed. Remedy: memory=, or accuracy="
        )
    seconds = last.seconds * (cells / last.cells) ** SLOWER
    spent = sum(trial.seconds for trial in trials)
    if time_limit is not None and spent + seconds > time_limit:
        return (
            f"{so_far} after {spent:.3g} s; about {cells} cells would take {seconds:.3g} s more, "
            f"{time_limit:g} s are allowed. Remedy: time_limit=, or accuracy="
        )
    return ""


def difference(one: PunchSolution, other: PunchSolution) -> float:
    """How far two answers to a problem are apart, as the error in `Accuracy`."""
    apart = _moved(one, one.positions[0] - other.positions[0])
    reaction = np.abs(one.resultant - other.resultant)
    reaction[1:] /= np.hypot(*_vertices(one)).max()
    return max(apart, _over(reaction.max(), np.abs(one.pressure) @ one.footprint.partition.areas))


def inner_difference(solution: PunchSolution) -> float:
    """How far the positions by work and by collocation of one answer are apart, alike."""
    return _moved(solution, solution.positions[0] - solution.positions[2])


def _moved(solution: PunchSolution, motion: np.ndarray) -> float:
    """The farthest a point of the plan moves, over the settlement under the force, or over the
    largest of the plan where that is less: moments may be those of a force far off, or of none."""
    vertices = _vertices(solution)
    largest = np.abs(solution.settlement + solution.tilt @ vertices).max()
    under = abs(solution.settlement + solution.tilt @ solution.centre_of_pressure)
    farthest = np.abs(motion[0] + motion[1:] @ vertices).max()
    return _over(farthest, float(np.fmin(under, largest)))


def _vertices(solution: PunchSolution) -> np.ndarray:
    """Vertices of the cells, from the origin."""
    cells = solution.footprint
    return cells.partition.polygons.p - np.array(cells.origin)[:, None]


def _over(change: float, size: float) -> float:
    """A change in parts of a size; none of none."""
    return float(change / size) if size > 0 else (np.inf if change > 0 else 0.0)
