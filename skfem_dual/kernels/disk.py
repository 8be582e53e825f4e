"""Compiled functions on disk, where damaged files and old ones count as missing.

numba would load them: at best that fails, until somebody removes them, at worst they run. It looks
at the file of a function only, not at functions and numbers of others that are compiled into it,
at options and at the fields of tuples.
"""

import os
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.types.containers import BaseTuple
from numpy import ndarray

DIGEST = sha256().digest_size
#: in names of files, as of Python's own: without docstrings and asserts code is another
OPTIMISED = f".opt-{sys.flags.optimize}" if sys.flags.optimize else ""


class _CheckedFiles(IndexDataCacheFile):
    """Files that begin with the SHA-256 of what follows and of numba's version."""

    def __init__(self, dispatcher: Any, cache_path: str, filename_base: str) -> None:
        super().__init__(cache_path, filename_base, None)
        self._dispatcher = dispatcher

    @cached_property
    def _sources(self) -> bytes:
        """Digest of all that is compiled: asked for on first use, as names may follow later."""
        return sha256(b"\n".join(_compiled_into(self._dispatcher, set()))).digest()

    def _load_index(self) -> dict:
        found = self._read(self._index_path)
        if found is None or found[0] != self._sources:
            return {}
        return {key: name for key, (name, fields) in found[1].items() if fields == _fields(key[0])}

    def _save_index(self, overloads: dict) -> None:
        told = {key: (name, _fields(key[0])) for key, name in overloads.items()}
        self._write(self._index_path, (self._sources, told))

    def _load_data(self, name: str) -> Any:
        found = self._read(self._data_path(name))
        if found is None:
            raise FileNotFoundError(name)  # numba then compiles
        return found

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _read(self, path: str) -> Any:
        """What was written, or None if it is not there, damaged, of another numba, or of classes
        that have another place by now."""
        try:
            content = Path(path).read_bytes()
        except OSError:
            return None
        body = content[DIGEST:]
        if content[:DIGEST] != self._digest(body):
            return None
        try:
            return pickle.loads(body)
        except (AttributeError, ImportError):
            return None

    def _write(self, path: str, value: Any) -> None:
        body = self._dump(value)
        try:
            with self._open_for_write(path) as file:
                file.write(self._digest(body) + body)
        except BaseException:
            # the index is written first: code of other sources would pass for what it tells
            with suppress(OSError):
                os.unlink(path)
            raise

    def _digest(self, body: bytes) -> bytes:
        return sha256(self._version.encode() + body).digest()


class CheckedCache(FunctionCache):
    """numba's cache of a function, in checked files, or without them where the disk is full.

    Raises
    ------
    RuntimeError
        If there is no folder to write to.
    """

    def __init__(self, dispatcher: Any) -> None:
        super().__init__(dispatcher.py_func)
        name = self._impl.filename_base + OPTIMISED
        self._cache_file = _CheckedFiles(dispatcher, self._cache_path, name)

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):  # it is compiled, and can be called
            super().save_overload(sig, data)


def _fields(types: Iterable[Any]) -> list[Any]:
    """Fields of named tuples among the types of arguments, which are found by their names."""
    tuples = [kind for kind in types if isinstance(kind, BaseTuple)]
    return [(getattr(kind, "fields", ()), _fields(kind.types)) for kind in tuples]


def _compiled_into(called: Any, known: set[Callable]) -> Iterator[bytes]:
    """The code and the options of a function, and of all that it calls and reads of modules."""
    function = getattr(called, "py_func", called)
    known.add(function)
    options = getattr(called, "targetoptions", {})
    yield repr([(k, sorted(v) if isinstance(v, set) else v) for k, v in options.items()]).encode()
    names = set()
    for code in _codes(function.__code__):
        constants = [c for c in code.co_consts if not isinstance(c, CodeType)]
        yield code.co_code
        yield repr((code.co_names, code.co_varnames, constants)).encode()
        names |= set(code.co_names)
    for name in sorted(names & function.__globals__.keys()):
        value = function.__globals__[name]
        code = getattr(value, "py_func", value)
        if isinstance(code, FunctionType):
            if code not in known:
                yield from _compiled_into(value, known)
        elif isinstance(value, type):
            yield repr((name, getattr(value, "_fields", ()))).encode()
        elif isinstance(value, ndarray):
            yield value.tobytes()
        elif isinstance(value, (int, float, complex, str, tuple)):
            yield repr(value).encode()


def _codes(code: CodeType) -> Iterator[CodeType]:
    """That of a function, and of those inside of it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)
