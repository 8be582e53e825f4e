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
#: use, and the name of what of it can be given back
GROUPS = {
    "": ("", "memory.max", "memory.current", "inactive_file"),
    "memory": (
        "memory",
        "memory.limit_in_bytes",
        "memory.usage_in_bytes",
        "total_inactive_file",
    ),
}


def available_memory(root: str = "/") -> float:
    """Bytes that can be used without swapping, as far as the system tells; else infinity.

    The least of what the machine, ``ulimit`` and containers leave; ``root`` is where the files of
    the system are.
    """
    at = Path(root)
    return max(0.0, min([_of_machine(at), *_of_process(at), *_of_groups(at)]))


def _of_machine(root: Path) -> float:
    try:
        return 1024.0 * _entry(root / "proc/meminfo", "MemAvailable:")
    except (OSError, ValueError):
        pass
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (OSError, ValueError, AttributeError):
        return NONE


def _of_process(root: Path) -> Iterator[float]:
    """What limits of the address space and of data leave."""
    if resource is None:
        return
    for limit, name in ((resource.RLIMIT_AS, "VmSize:"), (resource.RLIMIT_DATA, "VmData:")):
        most = resource.getrlimit(limit)[0]
        if most != resource.RLIM_INFINITY:
            try:
                yield most - 1024.0 * _entry(root / "proc/self/status", name)
            except (OSError, ValueError):
                yield float(most)


def _of_groups(root: Path) -> Iterator[float]:
    """What limits of the control groups leave that the process is in, as those of containers."""
    try:
        lines = (root / "proc/self/cgroup").read_text().splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        for controller in GROUPS.keys() & set(controllers.split(",")):
            folder, limit, usage, inactive = GROUPS[controller]
            top = root / "sys/fs/cgroup" / folder
            own = top / path.lstrip("/")
            # inside of a container paths may be those outside of it
            for group in {top, own, *own.parents} - set(top.parents):
                try:
                    most = int((group / limit).read_text())  # or "max"
                    used = int((group / usage).read_text())
                    yield most - used + _entry(group / "memory.stat", inactive)
                except (OSError, ValueError):
                    pass


def _entry(file: Path, name: str) -> int:
    """The number after a name in a file of the system."""
    for line in file.read_text().splitlines():
        words = line.split()
        if words and words[0] == name:
            return int(words[1])
    raise ValueError(f"expected {name} in {file}")
