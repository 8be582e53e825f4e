"""The command line: ``python -m skfem_dual {solve,dual,check}``, or ``skfem-dual``."""

import warnings
from collections.abc import Sequence
from functools import partial

from ..startup import end_of_imports
from ..terminal import print_table, tell
from .files import check_files
from .messages import progress_of_compilation, show_warning, told
from .parser import build_parser

#: what may come of bad input or a bad environment; anything else is a fault of the program
BAD = (ValueError, TypeError, OSError, RuntimeError, ImportError, MemoryError, ArithmeticError)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Files are written before the table is printed, whatever becomes of the standard output.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process by default.

    Returns
    -------
    int
        0; 1 if ``check`` found a fault; 2 after an error, told in one line on stderr; 3 if
        ``solve`` found no solution that holds, told likewise; 4 if it did not reach the accuracy
        asked for; 130 if interrupted, 143 if asked to end by SIGTERM.
    """
    try:
        try:
            return _run(argv)
        except SystemError as error:  # of numba, where an interrupt comes inside of a kernel
            raise error.__cause__ or error from None
    except KeyboardInterrupt:
        tell("interrupted")
        return 130
    except BAD as error:
        tell(f"error: {told(error)}")
        return 2


def _run(argv: Sequence[str] | None) -> int:
    end_of_imports()
    options = build_parser().parse_args(argv)
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        warnings.simplefilter("ignore", DeprecationWarning)  # for who writes programs
        options.warned = []
        warnings.showwarning = partial(show_warning, options.warned)
        check_files(options)
        with progress_of_compilation(options):
            code, table = options.run(options)
        if table:
            print_table(table)
        return code
