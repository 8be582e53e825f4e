"""Workers of sweeps end with the program that started them, even if it is killed."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from types import SimpleNamespace

import pytest
from marks import slow

from skfem_dual.sweeps import orphans
from skfem_dual.sweeps.orphans import end_with_parent

SCRIPT = """
import multiprocessing, os, sys, time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from skfem_dual import sweep

def told(x):
    Path(sys.argv[1], str(os.getpid())).touch()
    time.sleep(0.2)
    return x

if __name__ == "__main__":
    kind, workers = sys.argv[2], int(sys.argv[3])
    if kind == "own":
        executor = workers
    elif kind == "loky":
        import loky
        executor = loky.ProcessPoolExecutor(workers)
    else:
        executor = ProcessPoolExecutor(workers, multiprocessing.get_context(kind))
    sweep(told, range(100_000), executor)
"""


def is_alive(pid):
    """Whether a process runs; one that has ended may still wait to be fetched."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize(
    ("kind", "number"),
    [("own", 1), *slow(("own", 2), ("spawn", 2), ("forkserver", 2), ("fork", 2), ("loky", 2))],
)
def test_workers_end_when_their_parent_is_killed(kind, number, tmp_path):
    script, seen = tmp_path / "script.py", tmp_path / "seen"
    script.write_text(SCRIPT)
    seen.mkdir()
    program = subprocess.Popen(
        [sys.executable, script, seen, kind, str(number)],
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + 120
        while len(list(seen.iterdir())) < number and time.monotonic() < deadline:
            time.sleep(0.1)
        program.kill()
        program.wait()
        workers = [int(file.name) for file in seen.iterdir()]
        assert len(workers) == number
        deadline = time.monotonic() + 20
        while any(map(is_alive, workers)) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not [pid for pid in workers if is_alive(pid)]
    finally:
        for file in seen.iterdir():
            if is_alive(int(file.name)):
                os.kill(int(file.name), signal.SIGKILL)


def test_workers_look_once_also_when_forked(monkeypatch):
    """A forked one inherits what is known of others, but none of their threads."""
    parent = SimpleNamespace(sentinel=None)
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: parent)
    monkeypatch.setattr(orphans, "_watch", lambda *_: started.put(os.getpid()))
    monkeypatch.setattr(orphans, "_looking", {os.getpid() + 1: object()})
    started = SimpleQueue()
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: end_with_parent(), range(20)))
    assert started.get(timeout=10) == os.getpid()
    assert started.empty()


def test_programs_of_their_own_are_left_alone():
    """Whoever runs a sweep may go on when a shell that started it has ended."""
    before = {thread.name for thread in threading.enumerate()}
    end_with_parent()
    assert {thread.name for thread in threading.enumerate()} == before
