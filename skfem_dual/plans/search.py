"""Finer and finer meshes of a plan, until the answers on them are accurate enough."""

from dataclasses import dataclass

import numpy as np

from ..contact.motions import require_carried
from ..contact.system import DENSE
from ..elements.resolution import crusted
from ..operators.influence_operator import RTOL
from ..operators.resources import ENTRY, whole
from ..solutions.punch_solution import PunchSolution
from .problem import LARGEST_STEP, Attempt, Problem

#: errors shrink with this power of the length of the facets at least, and as a rule
LEAST_ORDER, ORDER = 1.5, 2.0
#: share of the distance between the positions by work and by collocation that errors have at least
SHARE = 0.25
#: the same of the first two answers, which may be near each other by chance, and on crusts that
#: bend between cells
FIRST_ORDER, FIRST_SHARE = 1.0, 0.5
#: the shortest step from one length to the next
SMALLEST_STEP = 0.5
#: share of the accuracy asked for that the next mesh aims at
AIM = 0.7
#: seconds grow with this power of the cells
SLOWER = 1.7
#: meshes tried at most
MESHES = 12


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
        pressures, all taken positive, and that times the distance of the farthest point. Infinite
        of one mesh, which tells none; `PunchSolution.bounds` do.
    reached : bool
        Whether it is at most what was asked for, of solutions without warnings.
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
        known = np.isfinite(self.error)
        return (
            f"{f'{self.error:.1e}' if known else 'none'} estimated, {self.asked:.1e} asked"
            f"{'' if self.reached else ', NOT REACHED'}; {self.cells} cells, "
            f"{len(self.trials)} meshes, {self.seconds:.2f} s"
        )


def search(problem: Problem, accuracy: float, memory: float) -> tuple[Attempt, Accuracy]:
    """Finer meshes until the error is small enough, or one would take too much; see `Accuracy`."""
    layered = problem.substrate.remainder is not None  # its table is not the first mesh's time
    last = problem.on_coarsest()
    for load in problem.loads:
        require_carried(last.solutions[0].footprint, load)
    error, change, trials = np.inf, 0.0, [Trial(last.cells, np.nan, last.seconds)]
    message = "the accuracy asked for is reached"
    while not (error <= accuracy and last.trusted):
        aim = np.sqrt(AIM * accuracy / error) if error > accuracy else LARGEST_STEP
        step = float(np.clip(aim if len(trials) > 1 else 1, SMALLEST_STEP, LARGEST_STEP))
        foreseen = problem.cells_next(last, step)
        if reason := _beyond(problem, trials, foreseen, memory, layered):
            message = f"the accuracy of {accuracy:.1e} is not reached: {reason}"
            break
        finer, step = problem.finer(last, step)
        if finer.cells > problem.most:  # more than foreseen
            message = _beyond(problem, trials, finer.cells, memory, layered)
            message = f"the accuracy of {accuracy:.1e} is not reached: {message}"
            break
        if last.found and not finer.found and finer.cells > DENSE:
            # it is the tolerance of products without a matrix that will not do
            failed = next(s.message for s in finer.solutions if not s.success)
            failed, *_ = failed.partition(". Remedy: ")  # for who has the solution
            message = (
                f"the accuracy of {accuracy:.1e} is not reached: the error is about {error:.1e} "
                f"with {last.cells} cells; with {finer.cells}, after {finer.seconds:.3g} s, "
                f"{failed}. Remedy: accuracy=, or a load farther from the edge of the plan"
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
    problem: Problem, trials: list[Trial], cells: int, memory: float, layered: bool
) -> str:
    """Why a mesh with so many cells is too much; empty if it is not."""
    last, time_limit = trials[-1], problem.time_limit
    so_far = f"the error is about {last.error:.1e} with {last.cells} cells"
    if len(trials) == 1:
        so_far = f"one answer, with {last.cells} cells, tells no error"
    if len(trials) == MESHES:
        return f"{so_far} on the last of {MESHES} meshes"
    if cells > problem.most:
        return (
            f"{so_far}; about {cells} are more than the {problem.most} on which horizontal forces "
            "and torsion are solved. Remedy: accuracy=, or the vertical load alone"
        )
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
