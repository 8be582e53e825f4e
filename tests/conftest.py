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

#: modules whose tests take longest: they begin, or one of them would end last and alone
LONG = {"test_plans_solve", "test_examples", "test_docs", "test_benchmarks", "test_sweep"}
#: modules that compile next to nothing: the second of two workers begins with them, while the
#: first compiles what both need
PLAIN = {
    "test_architecture",
    "test_generate",
    "test_checks",
    "test_couples",
    "test_preprocess",
    "test_dual_mesh",
    "test_general",
    "test_plans",
    "test_plans_read",
    "test_damaged_files",
    "test_surfaces",
    "test_tables",
    "test_arguments",
    "test_units",
    "test_functional",
    "test_cellwise",
    "test_partition",
    "test_strata",
    "test_hankel",
}

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


def pytest_collection_modifyitems(items):
    first, second, others = [], [], []
    for item in items:
        name = item.path.stem
        (first if name in LONG else second if name in PLAIN else others).append(item)
    ahead = max(len(items) // 2 - len(first), 0)
    items[:] = first + others[:ahead] + second + others[ahead:]


@pytest.fixture
def load(monkeypatch):
    """Imports a module of the benchmarks, for one test."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    monkeypatch.delitem(sys.modules, "plans", raising=False)  # tests have one of this name too
    yield importlib.import_module
    files = [(name, str(getattr(m, "__file__", ""))) for name, m in sys.modules.items()]
    for name in [name for name, file in files if str(BENCHMARKS) in file]:
        del sys.modules[name]


@pytest.fixture
def undrawn(monkeypatch):
    """Reports without the time that pictures take."""
    from skfem_dual.report import depth, figures

    picture = figures.Picture("data:image/png;base64,", 100)
    monkeypatch.setattr(figures, "_embedded", lambda *a, **k: picture)
    monkeypatch.setattr(depth, "profile_picture", lambda *a: picture)
