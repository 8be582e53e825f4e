"""Cases that the default run has no time for."""

import pytest


def slow(*cases):
    """Each of them, a value or the tuple of several, as a parameter that is marked ``slow``."""
    each = (case if isinstance(case, tuple) else (case,) for case in cases)
    return [pytest.param(*values, marks=pytest.mark.slow) for values in each]
