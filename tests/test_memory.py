"""Memory at hand: of the machine, of limits of the process and of its control groups."""

import subprocess
import sys
from pathlib import Path

import pytest

from skfem_dual.kernels import memory
from skfem_dual.kernels.memory import available_memory


@pytest.fixture
def unlimited(monkeypatch):
    """Whatever limits this process has."""
    monkeypatch.setattr(memory, "resource", None)


def system(root, files):
    """Files of a system below a folder."""
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return str(root)


MACHINE = {"proc/meminfo": "MemTotal: 9000000 kB\nMemAvailable: 8000000 kB\n"}


def test_at_hand():
    assert available_memory() > 2**20


@pytest.mark.usefixtures("unlimited")
def test_of_the_machine(tmp_path):
    assert available_memory(system(tmp_path, MACHINE)) == 8e6 * 1024
    odd = {"proc/self/cgroup": "\n0::/caf\xe9\nnone\n"}
    assert available_memory(system(tmp_path, MACHINE | odd)) == 8e6 * 1024


@pytest.mark.usefixtures("unlimited")
@pytest.mark.parametrize("where", ["a/b", "a", ""])
def test_of_groups_of_version_2(tmp_path, where):
    """Of any group above, less what is used, but not the files that are kept there."""
    group = f"sys/fs/cgroup/{where}/"
    files = {
        "proc/self/cgroup": "0::/a/b\n",
        "sys/fs/cgroup/a/memory.max": "max\n",
        "sys/fs/cgroup/a/memory.current": "7\n",
        group + "memory.max": "3000000\n",
        group + "memory.current": "1500000\n",
        group + "memory.stat": "anon 900000\ninactive_file 200000\nactive_file 300000\n",
    }
    assert available_memory(system(tmp_path, MACHINE | files)) == 2e6


@pytest.mark.usefixtures("unlimited")
def test_of_groups_of_version_1_in_a_container(tmp_path):
    """Whose own paths are those outside of it."""
    group = "sys/fs/cgroup/memory/"
    files = {
        "proc/self/cgroup": "5:cpu,cpuacct:/x\n4:memory:/docker/0123\n",
        group + "memory.limit_in_bytes": "3000000\n",
        group + "memory.usage_in_bytes": "4500000\n",
        group + "memory.stat": "inactive_file 7\ntotal_inactive_file 500000\n",
    }
    assert available_memory(system(tmp_path, MACHINE | files)) == 0.0


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="does not tell what is used")
def test_of_limits_of_the_process():
    code = (
        "import resource; from pathlib import Path; from skfem_dual.kernels import memory\n"
        "hard = resource.getrlimit(resource.RLIMIT_AS)[1]\n"
        "resource.setrlimit(resource.RLIMIT_AS, (2**32, hard))\n"
        "limited = next(memory._of_process(Path('/')))\n"
        "taken = bytearray(2**28)\n"
        "print(limited, next(memory._of_process(Path('/'))))\n"
        "assert memory.available_memory() <= limited - 2**27"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    limited, rest = map(float, done.stdout.split())
    assert 0 < limited < 2**32
    assert limited - rest == pytest.approx(2**28, rel=0.1)
