"""What must be looked after before the other modules are imported, which takes a second.

On the command line that happens before `cli.main` can catch anything: Ctrl-C and errors take one
line there too.
"""

import os
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

#: seconds after which a signal that was lost comes again
AGAIN = 0.02


def is_command() -> bool:
    """Whether this process is ``python -m skfem_dual`` or ``skfem-dual``."""
    arguments = sys.orig_argv
    as_module = any(pair == ("-m", __package__) for pair in pairwise(arguments))
    return as_module or Path(sys.argv[0] if sys.argv else "").stem == "skfem-dual"


def guard_imports() -> None:
    """Let Ctrl-C and errors of imports end the process with one line on stderr.

    Until `end_of_imports`; other programs that import the package are left alone.
    """
    if threading.current_thread() is not threading.main_thread() or not is_command():
        return
    sys.excepthook = _told
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupted)


def require_threads() -> None:
    """Refuse numbers of threads that numba would refuse without naming them.

    Raises
    ------
    ValueError
        If ``NUMBA_NUM_THREADS`` is set to something else than a positive whole number.
    """
    threads = os.environ.get("NUMBA_NUM_THREADS")
    if threads is None or "numba" in sys.modules:
        return
    if not threads.strip().isdecimal() or int(threads) == 0:
        raise ValueError(
            f"expected a positive whole number in NUMBA_NUM_THREADS, got {threads!r}. Remedy: "
            "unset it, or set it to the number of cores"
        )


def end_of_imports() -> None:
    """Give errors and Ctrl-C back to Python; a request to end lets files be put in order."""
    if sys.excepthook is _told:
        sys.excepthook = sys.__excepthook__
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, _ended)
        sys.unraisablehook = _asked_again
    if signal.getsignal(signal.SIGINT) is _interrupted:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def leaving_at_once() -> Iterator[None]:
    """Let signals end a command at once while libraries are imported that bear no exceptions.

    Nothing has been written then. Other programs are left alone.
    """
    handlers = {signal.SIGINT: _interrupted, signal.SIGTERM: _terminated}
    usual = signal.default_int_handler, _ended
    if threading.current_thread() is not threading.main_thread() or not is_command():
        handlers = {}
    before = {n: signal.getsignal(n) for n in handlers if signal.getsignal(n) in usual}
    for number in before:
        signal.signal(number, handlers[number])
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _terminated(number: int, frame: object) -> None:
    os._exit(128 + number)


def _interrupted(number: int, frame: object) -> None:
    _leave("interrupted", 130)


def _ended(number: int, frame: object) -> None:
    raise SystemExit(128 + number)


def _asked_again(lost: "sys.UnraisableHookArgs") -> None:
    """Finalisers lose the exceptions of signals: those come once more when these have ended."""
    numbers = {SystemExit: signal.SIGTERM, KeyboardInterrupt: signal.SIGINT}
    if lost.exc_type not in numbers:
        sys.__unraisablehook__(lost)
        return
    timer = threading.Timer(AGAIN, _signalled, (numbers[lost.exc_type],))
    timer.daemon = True
    timer.start()


def _signalled(number: signal.Signals) -> None:
    """Signal the main thread, also where it waits for something, if the system can."""
    main = threading.main_thread().ident
    if main is not None and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main, number)
    else:
        interrupt_main(number)


def _told(kind: type[BaseException], error: BaseException, trace: object) -> None:
    reason = " ".join(str(error).split()) or kind.__name__
    _leave(f"error: cannot start: {reason[:250]}", 2)


def _leave(text: str, code: int) -> None:
    # at once: the modules are half imported
    os.write(2, f"skfem-dual: {text}\n".encode(errors="backslashreplace"))
    os._exit(code)


guard_imports()
require_threads()
