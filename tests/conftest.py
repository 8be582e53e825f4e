"""Settings of all tests."""

import matplotlib
import scipy.linalg  # noqa: F401 - brings a BLAS of its own
from hypothesis import HealthCheck, settings
from threadpoolctl import threadpool_limits

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
