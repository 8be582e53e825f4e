"""Settings of all tests."""

import importlib
import sys
from pathlib import Path

import matplotlib
import pytest
import scipy.linalg  # noqa: F401 - brings a BLAS of its own
from hypothesis import HealthCheck, settings
from threadpoolctl import threadpool_limits

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"

matplotlib.use("agg")
# the same examples in every run: what passes here passes elsewhere
settings.register_profile(
    "reproducible",
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)
settings.load_profile("reproducible")

# the matrices here are small: threads of BLAS would only stand in each other's way
threadpool_limits(1, "blas")


@pytest.fixture
def load(monkeypatch):
    """Imports a module of the benchmarks, for one test."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    monkeypatch.delitem(sys.modules, "plans", raising=False)  # tests have one of this name too
    yield importlib.import_module
    files = [(name, str(getattr(m, "__file__", ""))) for name, m in sys.modules.items()]
    for name in [name for name, file in files if str(BENCHMARKS) in file]:
        del sys.modules[name]
