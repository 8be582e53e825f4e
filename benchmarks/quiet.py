"""A warning for benchmarks that start beside other work: their times would tell of that."""

import os

#: processes that ran on the average of the last minute, from which on there is a warning
BUSY = 0.5


def warn_beside_other_work() -> str:
    """Print, and return, a warning if the machine is or has just been busy; else nothing."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    if load <= BUSY:
        return ""
    message = (
        f"Warning: {load:.1f} processes ran in the last minute, before this benchmark began: its "
        "times are those\nof a machine that works on something else too, or just did."
    )
    print(message, flush=True)
    return message
