import numba
import pytest

from skfem_dual.kernels.compiled import compiled


def test_without_a_folder_for_caches(monkeypatch):
    original = numba.njit

    def no_cache(*args, **options):
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return original(*args, **options)

    monkeypatch.setattr(numba, "njit", no_cache)
    assert compiled(lambda x: 2 * x)(3.0) == pytest.approx(6.0)
