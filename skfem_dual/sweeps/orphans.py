"""Worker processes end when the process that started them has died, even by kill -9."""

import multiprocessing
import os
import threading
from multiprocessing import connection

#: seconds between two looks at the parent
PERIOD = 0.5

#: by their numbers the processes that are looking: a forked one inherits the others, but not their
#: threads, nor those that would release a lock
_looking: dict[int, object] = {}


def end_with_parent() -> None:
    """Watch the parent of a worker process of multiprocessing or loky; elsewhere do nothing.

    Idle workers wait for tasks on a pipe that they hold open themselves, for ever if nobody is
    left to close it.
    """
    process, first = multiprocessing.parent_process(), object()
    if process is None or _looking.setdefault(os.getpid(), first) is not first:
        return
    # None from loky; for a fork server the only sign, for forked workers none, as others of them
    # hold the other end
    ends = [process.sentinel] if process.sentinel is not None else []
    threading.Thread(target=_watch, args=(os.getppid(), ends), daemon=True).start()


def _watch(parent: int, ends: list[int]) -> None:
    while os.getppid() == parent and not connection.wait(ends, PERIOD):
        pass
    os._exit(1)
