"""Many problems through any executor: results as they come, kept in a file, ordered at the end."""

import uuid
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from types import FunctionType
from typing import Any

import numpy as np

from ..arguments import checked_flag, checked_integer, checked_sequence
from ..errors import ConvergenceWarning, warn
from ..io.guarded import require_file
from ..io.writing import PathLike
from ..kernels.progress import progress_bar
from ..messages import one_line, shown
from .records import (
    Problem,
    append,
    fingerprint,
    lasting,
    read_records,
    record,
    restored,
    restored_record,
)
from .workers import Job, all_answers, cores, error_text, ours

#: workers and threads beyond this are a mistake
MOST = 10_000


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one case.

    Attributes
    ----------
    number : int
        Place of the case in the list.
    case : object
        The case.
    result : object
        What the problem returned; None if it failed.
    error : str or None
        The traceback if it failed.
    seconds : float
        Time of the case in its worker; NaN if it failed.
    resumed : bool
        Whether the result comes from the file.
    """

    number: int
    case: Any
    result: Any = None
    error: str | None = None
    seconds: float = float("nan")
    resumed: bool = False


def _without_traceback(text: str) -> str:
    """What an error says in one line, by its traceback."""
    lines = text.splitlines()
    at = max((i for i, line in enumerate(lines) if line.startswith("  File ")), default=0)
    while at < len(lines) and lines[at].startswith("  "):
        at += 1
    return one_line(" ".join(lines[at:]), 200)


@dataclass(frozen=True, eq=False, repr=False)
class SweepResult:
    """What became of all cases, in their order.

    Attributes
    ----------
    outcomes : tuple of Outcome
        One for each case.
    torn : int
        Bytes of the file that are no whole record, because writing was interrupted; their cases
        have been run again.
    timings : dict of str to float
        Seconds of the sweep, and of all its cases in their workers.
    """

    outcomes: tuple[Outcome, ...]
    torn: int
    timings: dict[str, float]

    @property
    def results(self) -> list[Any]:
        """Results in the order of the cases; None where a case failed."""
        return [outcome.result for outcome in self.outcomes]

    @property
    def errors(self) -> dict[int, str]:
        """Tracebacks of the cases that failed, by their numbers."""
        return {o.number: o.error for o in self.outcomes if o.error is not None}

    @property
    def unsolved(self) -> dict[int, str]:
        """What results say, by the numbers of the cases, whose own ``success`` is not True."""
        return {o.number: _said(o.result) for o in self.outcomes if not _solved(o.result)}

    @property
    def success(self) -> bool:
        """Whether no case failed, and no result says that it is none: ``success`` of its own."""
        return not (self.errors or self.unsolved)

    @property
    def message(self) -> str:
        """How many cases failed or are not solved, and the first of them."""
        parts = [
            f"{len(found)} of {len(self.outcomes)} cases {what}, the first number "
            f"{next(iter(found))}: {_without_traceback(next(iter(found.values()))) or '-'}"
            for what, found in (("failed", self.errors), ("have success=False", self.unsolved))
            if found
        ]
        return "; ".join(parts) or "every case has its result"

    def __repr__(self) -> str:
        resumed = sum(outcome.resumed for outcome in self.outcomes)
        torn = f", {self.torn} torn bytes left out" if self.torn else ""
        rows = [
            ("Cases", f"{len(self.outcomes)}, {resumed} of them from the file{torn}"),
            ("Result", self.message),
            ("Time [s]", ", ".join(f"{k} {v:.3f}" for k, v in self.timings.items())),
        ]
        lines = [f"  {name:<18}{value}" for name, value in rows]
        return "\n".join(["<skfem_dual SweepResult object>", *lines])


def _solved(result: Any) -> bool:
    """Whether a result tells no failure; of several in one all must be found."""
    if isinstance(result, (tuple, list)):
        return all(map(_solved, result))
    success = getattr(result, "success", True)
    return not isinstance(success, (bool, np.bool_, np.ndarray)) or bool(np.all(success))


def _said(result: Any) -> str:
    """Its message, or that of the first in it without success."""
    if isinstance(result, (tuple, list)):
        return next((_said(part) for part in result if not _solved(part)), "")
    said = getattr(result, "message", "")
    if isinstance(said, str) and said:
        return said
    messages = getattr(result, "messages", ())
    if not isinstance(messages, (tuple, list)):
        return ""
    each = zip(messages, np.ravel(result.success))
    return next((str(text) for text, found in each if not found), "")


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
        run again. Failed cases are.
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
    outcomes: dict[int, Outcome] = {}
    torn = 0
    with ExitStack() as stack:
        bar = stack.enter_context(progress_bar(progress, "sweep", "case", len(cases)))

        def finish(
            number: int, result: Any = None, seconds: float = float("nan"), **more: Any
        ) -> None:
            outcome = Outcome(number, cases[number], result, seconds=seconds, **more)
            outcomes[number] = outcome
            bar.update()
            if on_result is not None:
                on_result(outcome)

        if file is not None:
            keys = [fingerprint((token, case)) for case in cases]
            stored, torn = read_records(Path(file))
            records = stack.enter_context(open(file, "ab", buffering=0))
            for number, key in enumerate(keys):
                # equal cases have a record each: the problem may be random
                if stored.get(key):
                    finish(
                        number,
                        *restored_record(stored[key].popleft(), problem, file),
                        resumed=True,
                    )
            stored.clear()
        waiting = deque(number for number in range(len(cases)) if number not in outcomes)
        ours[token] = problem
        stack.callback(ours.pop, token, None)
        for number, answer in stack.enter_context(closing(all_answers(executor, job, waiting))):
            error = answer.error
            try:
                for warned in answer.warned:  # here, wherever the case was run
                    warn(*warned)
                if error is None:
                    result, seconds = restored(answer.body, problem)
            except Exception as failure:  # noqa: BLE001 - told; the other cases go on
                error = error or error_text(failure)
            if error is not None:
                finish(number, error=error)
            else:
                if file is not None:
                    body = lasting(answer.body, (result, seconds), problem)
                    append(records, record(keys[number], body))
                finish(number, result, seconds)
    ordered = tuple(outcomes[number] for number in range(len(cases)))
    run = [o.seconds for o in ordered if o.error is None and not o.resumed]
    timings = {"sweep": perf_counter() - start, "cases": sum(run)}
    result = SweepResult(ordered, torn, timings)
    if not result.success:
        warn(result.message, ConvergenceWarning)
    return result


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
