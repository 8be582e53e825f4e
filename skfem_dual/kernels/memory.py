"""Memory that can be used: that of the machine, of the limits of the process and of its group."""

import os
from collections.abc import Iterator
from pathlib import Path

try:
    import resource
except ImportError:  # not on Windows
    resource = None  # type: ignore[assignment]

#: no limit
NONE = float("inf")
#: of control groups in versions 2 and 1: where they are, the files of their limit and of what they
#: use, and how names of what of it can be given back begin
GROUPS = {
    "": ("", "memory.max", "memory.current", ""),
    "memory": ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_"),
}
#: files that are kept as long as nobody needs their place
GIVEN_BACK = "inactive_file", "active_file", "slab_reclaimable"


def available_memory(root: str = "/") -> float:
    """Bytes that can be used without swapping, as far as the system tells; else infinity.

    The least of what the machine, ``ulimit`` and containers leave; ``root`` is where the files of
    the system are.
    """
    at = Path(root)
    return max(0.0, min([_of_machine(at), *_of_process(at), *_of_groups(at)]))


def _of_machine(root: Path) -> float:
    try:
        return 1024.0 * _entries(root / "proc/meminfo")["MemAvailable:"]
    except (OSError, KeyError):
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (OSError, ValueError, AttributeError):
        return NONE


def _of_process(root: Path) -> Iterator[float]:
    """What limits of the address space and of data leave, where the system tells what is used."""
    for limit, name in (("RLIMIT_AS", "VmSize:"), ("RLIMIT_DATA", "VmData:")):
        if not hasattr(resource, limit):
            continue
        most = resource.getrlimit(getattr(resource, limit))[0]
        if most != resource.RLIM_INFINITY:
            try:
                yield most - 1024.0 * _entries(root / "proc/self/status")[name]
            except (OSError, KeyError):
                yield float(most)


def _of_groups(root: Path) -> Iterator[float]:
    """What limits of the control groups leave that the process is in, as those of containers."""
    try:
        lines = (root / "proc/self/cgroup").read_text(errors="replace").splitlines()
    except OSError:
        return
    for _, controllers, path in (line.split(":", 2) for line in lines if line.count(":") > 1):
        for controller in GROUPS.keys() & set(controllers.split(",")):
            folder, limit, usage, begin = GROUPS[controller]
            top = root / "sys/fs/cgroup" / folder
            own = top / path.lstrip("/")
            # inside of a container paths may be those outside of it
            for group in {top, own, *own.parents} - set(top.parents):
                try:
                    most = int((group / limit).read_text())  # or "max"
                    used = int((group / usage).read_text())
                    kept = _entries(group / "memory.stat")
                except (OSError, ValueError):
                    continue
                yield most - used + sum(kept.get(begin + name, 0) for name in GIVEN_BACK)


def _entries(file: Path) -> dict[str, int]:
    """Numbers by the names before them, of a file of the system."""
    words = map(str.split, file.read_text(errors="replace").splitlines())
    return {line[0]: int(line[1]) for line in words if len(line) > 1 and line[1].isdigit()}
