"""Compilation and threads."""

import errno
import importlib
import os
import runpy
import shutil
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from time import sleep
from typing import NamedTuple

import numba
import numpy as np
import pytest

from skfem_dual.kernels import compiled as module
from skfem_dual.kernels import disk
from skfem_dual.kernels import threads as running
from skfem_dual.kernels.compiled import compiled, inlined, inputs, vectorised, when_compiling
from skfem_dual.kernels.threads import LEAST, Threads

SCRIPT = """
from skfem_dual.kernels.compiled import compiled

@compiled
def cubed(x):
    return x * x * x
"""


def test_without_a_folder_for_caches(monkeypatch):
    def no_cache(function):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(module, "CheckedCache", no_cache)
    assert compiled(lambda x: 2 * x)(3.0) == pytest.approx(6.0)


class Shifted(NamedTuple):
    values: np.ndarray
    shift: float


@inlined
def _sum_of_squares(shifted):
    total = 0.0
    for value in shifted.values:
        total += (value - shifted.shift) ** 2
    return total


@pytest.mark.parametrize("decorator", [compiled, vectorised])
def test_kernels_take_named_tuples_and_inlined_functions(decorator):
    kernel = decorator(lambda shifted: 2 * _sum_of_squares(shifted))
    (values,) = inputs(np.arange(10.0)[::2])
    # 0, 2, 4, 6, 8 about their mean 4
    assert kernel(Shifted(values, 4.0)) == pytest.approx(80.0, rel=1e-15)


def test_inputs_are_contiguous_and_read_only():
    a = np.arange(12.0).reshape(3, 4)
    transposed, same = inputs(a.T, a)
    assert transposed.flags.c_contiguous
    assert np.array_equal(transposed, a.T)
    assert not transposed.flags.writeable
    assert not same.flags.writeable
    assert np.shares_memory(same, a)
    a[0, 0] = 1.0  # what the caller has stays as it was
    assert same[0, 0] == 1.0


@pytest.mark.parametrize("m", [0, 1, 64, 65, 300, 1024, 5000, 100_000])
def test_work_is_cut_into_the_same_pieces_for_any_number_of_threads(monkeypatch, m):
    cuts = []
    for threads in (1, 2, 7):
        monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", threads)
        pieces = []
        with Threads() as run:
            run(pieces.append, m)
        cuts.append(sorted((piece.start, piece.stop) for piece in pieces))
    assert cuts[0] == cuts[1] == cuts[2]
    # one after the other from 0 to m, none too long for arrays of temporary use
    bounds = [0, *(stop for _, stop in cuts[0])]
    assert [start for start, _ in cuts[0]] == bounds[:-1]
    assert bounds[-1] == m
    assert max(np.diff(bounds), default=0) <= 256


@pytest.mark.parametrize("each", [0, 1, 90, 5000, 10**6])
def test_pieces_of_items_that_take_little_last_for_long_enough(each):
    pieces = []
    with Threads() as run:
        run(pieces.append, 100_000, each)
    sizes = [piece.stop - piece.start for piece in sorted(pieces, key=lambda piece: piece.start)]
    assert sum(sizes) == 100_000
    assert all(size * each >= LEAST or len(sizes) == 1 for size in sizes[:-1])
    assert max(sizes) <= max(LEAST // max(each, 1) + 64, 256)  # and others can take some


def test_short_work_starts_no_threads(monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 4)
    names = set()
    with Threads() as run:
        monkeypatch.setattr(running, "LONG", np.inf)
        run(lambda piece: names.add(threading.current_thread()), 640)
        assert names == {threading.current_thread()}
        monkeypatch.setattr(running, "LONG", 0)
        run(lambda piece: (sleep(0.001), names.add(threading.current_thread())), 640)
    assert len(names) > 1
    assert sum(thread.is_alive() for thread in names) == 1  # the others end with the context


def test_errors_in_threads_come_through():
    def work(some):
        raise FloatingPointError(str(some.start))

    with Threads() as run, pytest.raises(FloatingPointError):
        run(work, 5000)


def test_damaged_caches_are_compiled_anew(tmp_path, monkeypatch):
    """Files cut off, emptied or with other bytes, index and code: the same result each time."""
    script, cache = tmp_path / "script.py", tmp_path / "cache"
    script.write_text(SCRIPT)
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(cache))

    def is_loaded():
        cubed = runpy.run_path(str(script))["cubed"]
        assert cubed(3.0) == 27.0
        return sum(cubed.stats.cache_hits.values()) == 1

    assert not is_loaded()
    assert is_loaded()
    index, code = (next(cache.rglob(f"*.{kind}")) for kind in ("nbi", "nbc"))
    whole = code.read_bytes()
    for path, content in (
        (index, b""),
        (index, index.read_bytes()[:-20]),
        (code, whole[: len(whole) // 2]),
        (code, whole[:2000] + bytes([whole[2000] ^ 1]) + whole[2001:]),
    ):
        path.write_bytes(content)
        assert not is_loaded()
        assert is_loaded()
    code.unlink()
    assert not is_loaded()


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_full_disk(tmp_path, monkeypatch, kind):
    """The kernel works, and code of before is not taken for what could not be written."""
    script, cache = tmp_path / "script.py", tmp_path / "cache"
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(cache))
    script.write_text(SCRIPT)
    assert runpy.run_path(str(script))["cubed"](3.0) == 27.0
    script.write_text(SCRIPT.replace("x * x * x", "x ** 3 + 1"))
    open_for_write = disk._CheckedFiles._open_for_write

    @contextmanager
    def full(files, path):
        with open_for_write(files, path) as file:
            if path.endswith(kind):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            yield file

    with monkeypatch.context() as patch:
        patch.setattr(disk._CheckedFiles, "_open_for_write", full)
        assert runpy.run_path(str(script))["cubed"](3.0) == 28.0
    assert not list(cache.rglob(f"*.{kind}*"))
    assert runpy.run_path(str(script))["cubed"](3.0) == 28.0


def test_caches_of_classes_that_have_moved_are_compiled_anew(tmp_path, monkeypatch):
    """As after an update, the file of the kernel being the same."""
    other, script = tmp_path / "moved_classes.py", tmp_path / "script.py"
    told = "from typing import NamedTuple\nclass {}(NamedTuple):\n    x: float\n"
    script.write_text(f"import moved_classes\n{SCRIPT.replace('x * x * x', 'x.x ** 3')}")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    for name in ("Before", "After"):
        other.write_text(told.format(name))
        monkeypatch.delitem(sys.modules, "moved_classes", raising=False)
        importlib.invalidate_caches()
        found = runpy.run_path(str(script))
        cubed = found["cubed"](getattr(found["moved_classes"], name)(3.0))
        assert cubed == 27.0
    monkeypatch.delitem(sys.modules, "moved_classes")


def test_what_is_compiled_into_a_kernel_may_change(tmp_path, monkeypatch):
    """Functions and numbers of other files, the file of the kernel being the same."""
    other, script = tmp_path / "moved_functions.py", tmp_path / "script.py"
    told = (
        "from skfem_dual.kernels.compiled import inlined\n"
        "B = {}\n@inlined\ndef f(x):\n    return {}\n"
    )
    kernel = SCRIPT.replace("x * x * x", "f(x) + B")
    script.write_text(f"from moved_functions import B, f\n{kernel}")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    for number, term, expected in ((1.0, "x", 4.0), (10.0, "x", 13.0), (10.0, "x * x", 19.0)):
        other.write_text(told.format(number, term))
        for hits in (0, 1):
            monkeypatch.delitem(sys.modules, "moved_functions", raising=False)
            importlib.invalidate_caches()
            shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
            cubed = runpy.run_path(str(script))["cubed"]
            assert cubed(3.0) == expected
            assert sum(cubed.stats.cache_hits.values()) == hits
    monkeypatch.delitem(sys.modules, "moved_functions")


TUPLES = """\
from typing import NamedTuple
import numpy as np
from skfem_dual.kernels.compiled import compiled, vectorised
Point = NamedTuple("Point", [(name, float) for name in {order!r}])
@{decorator}
def kernel(p):
    return (p.a - 2.0 * p.b) / (p.b - 1.0)
@compiled
def made(x):
    p = Point(x, 1.0)
    return p.a
"""


def test_fields_and_options_of_a_kernel_may_change(tmp_path, monkeypatch):
    """Fields of tuples that it takes and that it makes; what is divided by zero."""
    (tmp_path / "own_tuples.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))

    def changed(order, decorator):
        """With the stamp of the file as before."""
        path = tmp_path / "own_tuples.py"
        path.write_text(TUPLES.format(order=order, decorator=decorator).ljust(600))
        os.utime(path, (1e9, 1e9))
        monkeypatch.delitem(sys.modules, "own_tuples", raising=False)
        importlib.invalidate_caches()
        shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
        return importlib.import_module("own_tuples")

    for order, made in (("ab", 5.0), ("ba", 1.0), ("ba", 1.0)):
        own = changed(order, "compiled")
        assert own.kernel(own.Point(a=10.0, b=2.0)) == 6.0
        assert own.made(5.0) == made
    assert sum(own.kernel.stats.cache_hits.values()) == 1
    assert sum(own.made.stats.cache_hits.values()) == 1
    with pytest.raises(ZeroDivisionError):
        own.kernel(own.Point(a=10.0, b=1.0))
    own = changed("ba", "vectorised")
    assert np.isinf(own.kernel(own.Point(a=10.0, b=1.0)))
    monkeypatch.delitem(sys.modules, "own_tuples")


def test_code_without_docstrings_has_caches_of_its_own(tmp_path, monkeypatch):
    """Under python -OO, that of a plain run was compiled anew, and then the other way round."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.replace("return", '"""The cube."""\n    return'))
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))

    def is_loaded(level):
        monkeypatch.setattr(disk, "OPTIMISED", f".opt-{level}" if level else "")
        found = {"__name__": "script"}
        exec(compile(script.read_text(), script, "exec", optimize=level), found)
        assert found["cubed"](3.0) == 27.0
        return sum(found["cubed"].stats.cache_hits.values()) == 1

    assert [is_loaded(level) for level in (0, 2, 0, 2)] == [False, False, True, True]


def test_when_compiling_calls_once():
    calls = []
    with when_compiling(lambda: calls.append("begun")):
        assert not calls
        assert numba.njit(lambda x: x + 1.0)(1.0) == 2.0
        assert numba.njit(lambda x: x + 2.0)(1.0) == 3.0
    assert calls == ["begun"]
    with when_compiling(lambda: calls.append("begun")):
        pass
    numba.njit(lambda x: x + 3.0)(1.0)
    assert calls == ["begun"]


@pytest.mark.slow
def test_kernels_stay_within_their_arrays(tmp_path):
    """Of all kinds of problems, compiled so that indices are looked at."""
    here = Path(__file__).parent
    tests = [
        str(here / f"test_{name}.py") for name in ("below", "slopes", "unilateral", "motions")
    ]
    bounds = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "0", *tests],
        env=os.environ | bounds,
        cwd=here.parent,
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 0, ended.stdout[-2000:]
