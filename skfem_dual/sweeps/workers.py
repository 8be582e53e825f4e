"""Which case is handed over to an executor when, what a worker does, and what if one dies."""

import multiprocessing
import os
import pickle
import platform
import threading
import traceback
from collections import deque
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import closing, nullcontext
from dataclasses import dataclass
from queue import SimpleQueue
from time import perf_counter
from typing import Any, NamedTuple

from ..errors import Told, warnings_kept
from ..kernels.limits import limited_threads
from .orphans import end_with_parent
from .records import Problem, pickled

Answers = Generator[tuple[int, "Answer"], None, None]

#: of cases that are left when there are no workers
NOT_RUN = "not run: workers died before and were not replaced, or were shut down"


@dataclass(frozen=True, eq=False, repr=False)
class Job:
    """All that makes a task of the number of a case."""

    token: bytes
    problem: Problem
    cases: list[Any]
    threads: int | None

    def task(self, number: int, carry: bool) -> "_Task":
        problem = self.problem if carry else None
        return _Task(self.token, problem, self.cases[number], self.threads)


def all_answers(executor: Executor | int | None, job: Job, waiting: deque[int]) -> Answers:
    """Numbers of cases with their answers, as they come."""
    if isinstance(executor, int):
        yield from _own_answers(executor, job, waiting)
    elif executor is None:
        yield from _answers(_Here(), job, waiting, 1)
    else:
        yield from _answers(executor, job, waiting)
    for number in waiting:
        yield number, Answer(error=NOT_RUN)


def _own_answers(workers: int, job: Job, waiting: deque[int]) -> Answers:
    """The same from worker processes of our own, which are replaced when one dies."""
    suspects: deque[int] = deque()  # cases under way when a worker died
    pool = _started(workers, job)
    try:
        while suspects or waiting:
            alone = bool(suspects)
            batch, window = (suspects, 1) if alone else (waiting, workers)
            broken = False
            with closing(_answers(pool, job, batch, window)) as answers:
                for number, answer in answers:
                    broken = broken or answer.broken
                    if not answer.broken:
                        yield number, answer
                    elif alone:
                        died = f"{answer.error}the case made its worker die again, also alone"
                        yield number, Answer(error=died)
                    else:
                        suspects.append(number)
            if broken:
                pool.shutdown()
                try:
                    pool = _started(workers, job)
                except RuntimeError:
                    waiting.extend(suspects)
                    return
    finally:
        pool.shutdown(cancel_futures=True)


def _started(workers: int, job: Job) -> ProcessPoolExecutor:
    """Worker processes that have the problem."""
    # a forked process would have locks, but not the threads, of BLAS and numba
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, _begin, (job.token, job.problem))
    try:
        for ready in [pool.submit(os.getpid) for _ in range(workers)]:
            ready.result()
    except BrokenExecutor as error:
        raise RuntimeError(
            'worker processes cannot start. Remedies: call sweep under if __name__ == "__main__": '
            "in a script; let the problem be of a module that they can import"
        ) from error
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise TypeError(
            f"expected a problem that can be pickled for worker processes: {error}. Remedy: a "
            "function of a module, a method of an object, or functools.partial of them"
        ) from error
    return pool


def _answers(
    executor: Executor, job: Job, waiting: deque[int], window: int | None = None
) -> Answers:
    """Answers of an executor; ends when it breaks, with the rest still ``waiting``.

    At most ``window`` cases are handed over at a time, by default twice as many as workers have
    been seen. The problem goes only to workers that turn out not to have it: it may be large,
    and they on other machines.
    """
    pending: dict[Future, int] = {}
    done: SimpleQueue[Future] = SimpleQueue()
    workers: set[str] = set()
    lacking: set[int] = set()
    broken = False
    try:
        while True:
            limit = window or 2 * max(cores(), len(workers))
            while waiting and not broken and len(pending) < limit:
                task = job.task(waiting[0], carry=waiting[0] in lacking)
                try:
                    future = executor.submit(_work, task)
                except RuntimeError as error:
                    if not (isinstance(error, BrokenExecutor) or "shutdown" in str(error)):
                        raise
                    broken = True
                else:
                    pending[future] = waiting.popleft()
                    future.add_done_callback(done.put)
            if not pending:
                return
            future = done.get()
            number = pending.pop(future)
            try:
                answer = future.result()
            except Exception as error:  # noqa: BLE001 - told; the other cases go on
                answer = Answer(error=error_text(error), broken=isinstance(error, BrokenExecutor))
            else:
                workers.add(answer.worker)
            broken = broken or answer.broken
            if answer.error is None and not answer.body:
                lacking.add(number)
                waiting.appendleft(number)
            else:
                yield number, answer
    finally:
        for future in pending:
            future.cancel()


class _Here(Executor):
    """Runs everything at once in this thread."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future:
        future: Future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@dataclass(frozen=True, eq=False, repr=False)
class _Task:
    """A case to run; the problem goes with it only where the worker may lack it."""

    token: bytes
    problem: Problem | None
    case: Any
    threads: int | None


class Answer(NamedTuple):
    """The pickled result with its time, or an error; neither if the worker has no problem."""

    worker: str = ""
    body: bytes = b""
    error: str | None = None
    broken: bool = False
    warned: tuple[Told, ...] = ()


#: by their content: the problems of sweeps in this process, and the last one sent to it
ours: dict[bytes, Problem] = {}
received: dict[bytes, Problem] = {}


def _begin(token: bytes, problem: Problem) -> None:
    end_with_parent()
    _receive(token, problem)


def _receive(token: bytes, problem: Problem) -> None:
    received.clear()  # what was there may hold a large matrix
    received[token] = problem


def _work(task: _Task) -> Answer:
    end_with_parent()
    worker = f"{platform.node()} {os.getpid()} {threading.get_ident()}"
    problem = ours.get(task.token)
    if problem is None:
        problem = received.get(task.token, task.problem)
        if problem is None:
            return Answer(worker)
        _receive(task.token, problem)
    with warnings_kept() as warned:  # of other processes and threads nobody would hear them
        answer = _run(problem, task)
    return answer._replace(worker=worker, warned=tuple(warned))


def _run(problem: Problem, task: _Task) -> Answer:
    try:
        with nullcontext() if task.threads is None else limited_threads(task.threads):
            start = perf_counter()
            case = task.case
            result = problem(**case) if isinstance(case, Mapping) else problem(case)
            seconds = perf_counter() - start
        return Answer(body=pickled((result, seconds), problem))
    except (Exception, SystemExit) as error:
        if isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            raise KeyboardInterrupt from error  # as a SystemError from compiled code
        return Answer(error=error_text(error))


def cores() -> int:
    """Cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def error_text(error: BaseException) -> str:
    """The traceback as text."""
    return "".join(traceback.format_exception(error))
