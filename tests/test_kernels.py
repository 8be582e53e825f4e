import runpy

import numba
import pytest

from skfem_dual.kernels import compiled as module
from skfem_dual.kernels.compiled import compiled

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
