"""A campaign against the package: random and wrong input of all kinds, judged by itself.

    python benchmarks/campaign.py                    all kinds
    python benchmarks/campaign.py arguments meshes   some of them
    python benchmarks/campaign.py --part 0.1         every tenth trial
    python benchmarks/campaign.py --list unclear     and what was found, one line each

Every kind runs in a process of its own, which is ended and started anew behind a trial that hangs
or crashes; memory is limited. Trials are drawn from ``--seed``. The tree under test is the one
from which ``skfem_dual`` is imported.
"""

import argparse
import contextlib
import importlib
import json
import os
import queue
import resource
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

#: where the trials of each kind are made: module, and the arguments of its ``trials``
KINDS = {
    "arguments": ("campaign_arguments", {}),
    "pictures": ("campaign_arguments", {"pictures": True}),
    "meshes": ("campaign_meshes", {}),
    "problems": ("campaign_problems", {}),
    "mesh files": ("campaign_files", {"what": "meshes"}),
    "ground files": ("campaign_files", {"what": "grounds"}),
    "record files": ("campaign_files", {"what": "records"}),
    "command lines": ("campaign_files", {"what": "commands"}),
}
OUTCOMES = ("fine", "clear", "unclear", "wrong", "hang", "crash")
#: seconds after which a trial counts as hanging, and until a process has started
PATIENCE, START = 20.0, 180.0
#: bytes of address space a process may take
MEMORY = 12 * 2**30

Found = tuple[str, str, str]


def made(kind: str, seed: int, part: float) -> Iterator[tuple]:
    """The trials of a kind, or an even part of them: label, and what runs and judges it."""
    module, options = KINDS[kind]
    trials = importlib.import_module(module).trials(
        **options, **({} if "arg" in module else {"seed": seed})
    )
    for i, trial in enumerate(trials):
        if int((i + seed) * part) != int((i + seed + 1) * part):
            yield trial


def work(kind: str, seed: int, part: float, first: int) -> None:
    """What a process does: run trials and write a line before and after each."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    out = os.fdopen(os.dup(1), "w", buffering=1)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    # words among the arguments may be taken for files to write
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for i, (label, run) in enumerate(made(kind, seed, part)):
            if i >= first:
                out.write(json.dumps([i, label]) + "\n")
                outcome, note = run()
                out.write(json.dumps([outcome, label, " ".join(note.split())[:200]]) + "\n")
    out.write(json.dumps(["done"]) + "\n")


def found_in(kind: str, seed: int = 0, part: float = 1.0) -> Iterator[Found]:
    """Outcome, label and note of every trial of a kind."""
    first, finished = 0, False
    while not finished:
        command = [sys.executable, __file__, "--worker", kind, str(seed), str(part), str(first)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        lines: queue.Queue = queue.Queue()
        threading.Thread(target=_pump, args=(process.stdout, lines), daemon=True).start()
        label, patience, begun = "(start)", START, first
        while True:
            try:
                line = lines.get(timeout=patience)
            except queue.Empty:
                process.kill()
                yield "hang", label, f"more than {patience:.0f} s"
                break
            if line is None:
                yield "crash", label, f"process ended with {process.wait()}"
                break
            item = json.loads(line)
            if item == ["done"]:
                finished = True
                break
            if len(item) == 2:
                first, label = item
                patience = PATIENCE if first > begun else START
            else:
                yield tuple(item)
        process.wait()
        if label == "(start)" and not finished:
            return
        first += 1


def _pump(stream, lines: queue.Queue) -> None:
    with stream:
        for line in stream:
            lines.put(line)
    lines.put(None)


def main(kinds=tuple(KINDS), seed: int = 0, part: float = 1.0, show=()) -> dict[str, Counter]:
    """Run some kinds and print the table of their outcomes; return the counts."""
    counts = {}
    print(f"{'':16}{'tried':>8}" + "".join(f"{name:>9}" for name in OUTCOMES) + f"{'s':>8}")
    for kind in kinds:
        begin, counts[kind] = perf_counter(), Counter()
        for outcome, label, note in found_in(kind, seed, part):
            counts[kind][outcome] += 1
            if outcome in show:
                print(f"  {outcome}: {label}: {note}", flush=True)
        row = "".join(f"{counts[kind][name]:9}" for name in OUTCOMES)
        print(f"{kind:16}{counts[kind].total():8}{row}{perf_counter() - begin:8.0f}", flush=True)
    return counts


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        sys.path.insert(0, str(Path(__file__).parent))
        work(sys.argv[2], int(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5]))
        sys.exit()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], default=[])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--part", type=float, default=1.0)
    parser.add_argument("--list", nargs="*", choices=OUTCOMES, default=[])
    given = parser.parse_args()
    main(given.kinds or list(KINDS), given.seed, given.part, given.list)
