"""Many problems through any executor: results as they come, kept in a file, ordered at the end."""

import uuid
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from types import FunctionType
from typing import Any

from ..arguments import checked_flag, checked_integer, checked_sequence
from ..errors import ConvergenceWarning, warn
from ..io.guarded import require_file
from ..io.writing import PathLike
from ..kernels.progress import Bar, progress_bar
from ..messages import shown
from .outcomes import Outcome, SweepResult
from .records import (
    Problem,
    Stored,
    append,
    fingerprint,
    lasting,
    read_records,
    record,
    restored,
    restored_record,
)
from .workers import Answer, Job, all_answers, cores, error_text, ours

#: workers and threads beyond this are a mistake
MOST = 10_000


@dataclass(eq=False)
class _Course:
    """Outcomes of cases as they come, told to a bar and to who asked for them."""

    cases: list[Any]
    bar: Bar
    on_result: Callable[[Outcome], Any] | None
    outcomes: dict[int, Outcome] = field(default_factory=dict)

    def finish(
        self, number: int, result: Any = None, seconds: float = float("nan"), **more: Any
    ) -> None:
        """The outcome of a case is known."""
        outcome = Outcome(number, self.cases[number], result, seconds=seconds, **more)
        self.outcomes[number] = outcome
        self.bar.update()
        if self.on_result is not None:
            self.on_result(outcome)

    def resume(self, keys: list[bytes], stored: Stored, problem: Problem, file: PathLike) -> None:
        """The outcomes of cases whose results a file has."""
        for number, key in enumerate(keys):
            # equal cases have a record each: the problem may be random
            if stored.get(key):
                body = stored[key].popleft()
                self.finish(number, *restored_record(body, problem, file), resumed=True)
        stored.clear()

    def result(self, torn: int, start: float) -> SweepResult:
        """All outcomes in order."""
        ordered = tuple(self.outcomes[number] for number in range(len(self.cases)))
        run = [o.seconds for o in ordered if o.error is None and not o.resumed]
        timings = {"sweep": perf_counter() - start, "cases": sum(run)}
        return SweepResult(ordered, torn, timings)


def sweep(
    problem: Problem,
    cases: Iterable[Any],
    executor: Executor | int | None = None,
    *,
    file: PathLike | None = None,
    threads: int | None = None,
    on_result: Callable[[Outcome], Any] | None = None,
    progress: bool = False,
) -> SweepResult:
    """Solve a problem for many cases, one after the other or in parallel.

    Parameters
    ----------
    problem : callable
        Called as ``problem(**case)`` if the case is a mapping, else as ``problem(case)``. For
        many loads on one punch, ``punch.solve``: matrix and factors are computed once in every
        worker process, and the solutions belong to the one ``punch``. What it returns must
        pickle.
    cases : iterable
        Loads, plans, substrates: anything that pickles.
    executor : Executor, int or None
        None: one case after the other in this process. A number: so many worker processes for
        this sweep alone; if one of them dies, they are replaced, the cases it concerns are run
        once more, each alone, and a case that kills its worker again has failed. Any
        `concurrent.futures.Executor`: threads, processes, loky's, ``client.get_executor()`` of
        dask.distributed, mpi4py's; it is left running. If it breaks, cases without a result have
        failed.
    file : path, optional
        Results are appended to this file as they come, and cases whose results it has are not
        run again. Failed cases are; of equal cases as many as it has no results of.
    threads : int, optional
        Largest number of threads of BLAS, OpenMP and numba for each worker. By default the cores
        divided by the workers for a number of workers, 1 for an executor, and no limit without.
    on_result : callable, optional
        Called with the `Outcome` of each case, in this thread, as they come; those from the file
        first. An exception it raises ends the sweep.
    progress : bool
        Whether to show a bar (tqdm).

    Returns
    -------
    SweepResult
        Results and errors in the order of the cases.

    Raises
    ------
    TypeError
        If ``problem`` or ``on_result`` is not callable, ``cases`` are none, ``executor`` is no
        executor, ``file`` no path or ``threads`` not whole; or if what a file finds results by,
        the content of problem and cases, cannot be pickled.
    ValueError
        If ``threads`` or the number of workers is not positive, or ``file`` is something else.
    FileNotFoundError
        If the folder of ``file`` is missing.
    RuntimeError
        If own worker processes cannot start.

    Warns
    -----
    ConvergenceWarning
        If a case failed, or its result has ``success=False``.
    ResolutionWarning, MeshWarning
        What the package warns of in the cases that are run, wherever that is.

    Notes
    -----
    A result is found in the file by the content of problem and case: what pickles of objects,
    arrays, the code of functions, but neither cached properties, nor fields of dataclasses with
    ``init=False, compare=False``, nor what a function reads from its module or calls. After a
    change there, begin a new file. The file grows by one record for each result, with length and
    checksum; one that an interruption has torn is left out and its case run again. The records
    are pickled, as results may be any Python objects, so read only files that you trust. Each is
    handed to the operating system at once: an interrupted program loses none.

    In a script with a number of workers, or processes of other executors, the call belongs under
    ``if __name__ == "__main__":``. A sweep over several punches with several loads each computes
    every matrix once in a worker if ``functools.lru_cache`` decorates the function that makes a
    punch and cases with the same punch follow each other. Results bring no matrices along: what is
    computed from a solution later, as its settlement, is soonest asked for in the problem, which
    may return it beside the solution.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(3))
    >>> punch = RigidPunch(HalfSpace(1.0, 0.25), dual.basis())
    >>> found = sweep(punch.solve, [dict(force=1.0, at=(e, 0.0)) for e in (0.1, 0.2, 0.3)])
    >>> [f"{solution.tilt[0]:.2f}" for solution in found.results]  # exact for the circle
    ['0.07', '0.14', '0.21']
    """
    _require_arguments(problem, file, on_result)
    progress = checked_flag("progress", progress)
    executor = _checked_executor(executor)
    threads = _threads(executor, threads)
    cases = checked_sequence("cases", cases)
    start = perf_counter()
    token = _token(problem, needed=file is not None)
    job = Job(token, problem, cases, threads)
    torn = 0
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(progress, "sweep", "case", len(cases)))
        course = _Course(cases, bar, on_result)
        if file is not None:
            keys = [fingerprint((token, case)) for case in cases]
            stored, torn = read_records(Path(file))
            records = stack.enter_context(open(file, "ab", buffering=0))
            course.resume(keys, stored, problem, file)
        waiting = deque(number for number in range(len(cases)) if number not in course.outcomes)
        ours[token] = problem
        stack.callback(ours.pop, token, None)
        for number, answer in stack.enter_context(closing(all_answers(executor, job, waiting))):
            error, result, seconds = _received(answer, problem)
            if error is not None:
                course.finish(number, error=error)
            else:
                if file is not None:
                    body = lasting(answer.body, (result, seconds), problem)
                    append(records, record(keys[number], body))
                course.finish(number, result, seconds)
    found = course.result(torn, start)
    if not found.success:
        warn(found.message, ConvergenceWarning)
    return found


def _received(answer: Answer, problem: Problem) -> tuple[str | None, Any, float]:
    """The error of an answer, or its result and seconds; what it warned of is told."""
    error, result, seconds = answer.error, None, float("nan")
    try:
        for warned in answer.warned:  # here, wherever the case was run
            warn(*warned)
        if error is None:
            result, seconds = restored(answer.body, problem)
    except Exception as failure:  # noqa: BLE001 - told; the other cases go on
        error = error or error_text(failure)
    return error, result, seconds


def _token(problem: Problem, needed: bool) -> bytes:
    """What tells a problem from others: its content, or if that is not ``needed`` just a name."""
    try:
        return fingerprint((problem, _called(problem)))
    except Exception:
        if needed:
            raise
        return uuid.uuid4().bytes  # good for threads, which do not pickle the problem


def _called(problem: Problem) -> bytes:
    """What tells the code that an object is called by, or a class makes its objects with; nothing
    of compiled code, or of such that holds something without content."""
    whole, name = (
        (problem, "__init__") if isinstance(problem, type) else (type(problem), "__call__")
    )
    code = getattr(whole, name)
    if not isinstance(code, FunctionType):
        return b""
    try:
        return fingerprint(code)
    except Exception:  # noqa: BLE001 - whatever reading or pickling raises
        return b""


def _require_arguments(problem: object, file: object, on_result: object) -> None:
    """Refuse what is no problem, no name of a file or no function."""
    if not callable(problem):
        raise TypeError(f"expected a callable problem such as punch.solve, got {shown(problem)}")
    if file is not None:
        _require_results(file)
    if on_result is not None and not callable(on_result):
        raise TypeError(f"expected a function for on_result, got {shown(on_result)}")


def _require_results(file: Any) -> None:
    """Refuse what is no file of results and cannot become one."""
    try:
        require_file(file, "a file for results of a sweep")
    except FileNotFoundError:  # it is begun
        folder = Path(file).parent
        if not folder.is_dir():
            raise FileNotFoundError(
                f"no such folder for results of a sweep: {folder}. Remedy: make it first"
            ) from None


def _checked_executor(executor: Any) -> Executor | int | None:
    """The executor, a number of workers as an integer."""
    if executor is None or isinstance(executor, Executor):
        return executor
    try:
        return checked_integer("executor", executor, at_least=1, at_most=MOST)
    except TypeError:
        raise TypeError(
            f"expected a concurrent.futures.Executor, a number of workers or None, got "
            f"{shown(executor)}. Remedy for a client of dask: client.get_executor()"
        ) from None


def _threads(executor: Executor | int | None, threads: int | None) -> int | None:
    """The limit of threads in a worker."""
    if threads is not None:
        return checked_integer("threads", threads, at_least=1, at_most=MOST)
    if isinstance(executor, int):
        return max(1, cores() // executor)
    return None if executor is None else 1
