"""Compiled functions on disk, where damaged files count as missing.

numba would load them: at best that fails, until somebody removes them, at worst they run.
"""

import pickle
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile

DIGEST = sha256().digest_size


class _CheckedFiles(IndexDataCacheFile):
    """Files that begin with the SHA-256 of what follows and of numba's version."""

    def _load_index(self) -> dict:
        found = self._read(self._index_path)
        if found is None or found[0] != self._source_stamp:
            return {}
        return found[1]

    def _save_index(self, overloads: dict) -> None:
        self._write(self._index_path, (self._source_stamp, overloads))

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
        with self._open_for_write(path) as file:
            file.write(self._digest(body) + body)

    def _digest(self, body: bytes) -> bytes:
        return sha256(self._version.encode() + body).digest()


class CheckedCache(FunctionCache):
    """numba's cache of a function, in checked files.

    Raises
    ------
    RuntimeError
        If there is no folder to write to.
    """

    def __init__(self, function: Callable) -> None:
        super().__init__(function)
        self._cache_file = _CheckedFiles(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=self._impl.locator.get_source_stamp(),
        )
