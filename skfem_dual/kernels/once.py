"""Attributes that are computed on first use, by one thread."""

import os
from collections.abc import Callable, MutableMapping
from copy import copy
from dataclasses import fields
from functools import cached_property
from threading import RLock
from typing import Any, Self, TypeVar, cast, overload

from numpy import ndarray

_T = TypeVar("_T")
#: of what is being computed, by dictionaries and keys: locks and how many threads want them
_locks: dict[tuple[int, Any], list[Any]] = {}
_counting = RLock()  # handlers of signals may ask while it is held


class computed_once(cached_property[_T]):
    """A cached property that is computed once, however many threads ask for it.

    `functools.cached_property` computes in every thread that asks at the same time or, before
    Python 3.12, lets all objects of a class wait for one lock. Here threads wait only for the same
    property of the same object: as long as no property needs itself, they cannot wait for each
    other in a circle. The lock is there only while it is needed, so that objects pickle, from a
    copy of what is known, as other threads may add to it, and may be frozen. An exception is
    nothing computed: the next to ask tries again. Arrays are read-only, in tuples as they come.

    Examples
    --------
    >>> class Plan:
    ...     @computed_once
    ...     def area(self):
    ...         print("computed")
    ...         return 2.0
    >>> plan = Plan()
    >>> plan.area + plan.area
    computed
    4.0
    """

    def __set_name__(self, owner: type[Any], name: str) -> None:
        super().__set_name__(owner, name)
        if owner.__getstate__ is object.__getstate__:
            owner.__getstate__ = _known  # type: ignore[assignment]

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> "computed_once[_T]": ...

    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> _T: ...

    def __get__(self, instance: object, owner: type[Any] | None = None) -> Any:
        if instance is None:
            return self
        # setting up an object may store more than was asked for
        return _first(instance, cast(str, self.attrname), self.func)


def _known(instance: object) -> dict[str, Any]:
    return dict(vars(instance))


class ReadOnly:
    """Objects whose arrays are read-only in pickles and copies, too.

    numpy makes those writable, and what has been computed from them would go stale.
    """

    def __setstate__(self, state: dict[str, Any]) -> None:
        freeze(state)
        self.__dict__.update(state)

    def __copy__(self) -> Self:
        """With the same arrays, which may be those of others."""
        other = object.__new__(type(self))
        other.__dict__.update(cast(dict, self.__getstate__() or {}))
        return other


class FromFields(ReadOnly):
    """Dataclasses of which pickles and copies hold the fields; the rest, many times larger, is
    computed again."""

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(cast(Any, self))}


def freeze(value: Any) -> None:
    """Make arrays read-only, also in tuples, lists, dictionaries, sparse matrices and meshes."""
    if isinstance(value, ndarray):
        value.flags.writeable = False
    elif isinstance(value, dict):
        freeze(list(value.values()))
    elif isinstance(value, (list, tuple)):
        for part in value:
            freeze(part)
    elif _is_sparse(value) or hasattr(type(value), "t2f"):
        freeze(vars(value))


def _is_sparse(value: Any) -> bool:
    # without asking for an attribute, for which others may compute
    return "indptr" in getattr(value, "__dict__", ())


def remember(instance: object, name: str, value: Any) -> None:
    """Keep what has been computed for a `computed_once` of an object together with others.

    Raises
    ------
    TypeError
        If the name is that of something else.
    """
    if not isinstance(getattr(type(instance), name, None), computed_once):
        raise TypeError(f"expected the name of what is computed once, got {name!r}")
    _first(instance, name, lambda _: value)


def _first(instance: object, name: str, compute: Callable[[Any], Any]) -> Any:
    return computed_in(instance.__dict__, name, lambda: _shared(compute(instance)))


def computed_in(known: MutableMapping[Any, Any], key: Any, compute: Callable[[], _T]) -> _T:
    """What is known under a key, or else computed by one thread while others wait."""
    own = id(known), key
    with _counting:
        lock = _locks.setdefault(own, [RLock(), 0])
        lock[1] += 1
    try:
        with lock[0]:
            # only now is it certain that no other thread has computed it
            return known[key] if key in known else known.setdefault(key, compute())
    finally:
        with _counting:
            lock[1] -= 1
            if not lock[1]:
                _locks.pop(own, None)


def _shared(value: Any) -> Any:
    """The value, arrays read-only, sparse ones too: all who ask share it."""
    if isinstance(value, ndarray):
        value = value.view()
        value.flags.writeable = False
    elif _is_sparse(value):
        value = copy(value) if value.has_canonical_format else value.copy()
        value.sum_duplicates()  # what scipy does in place where it is not done
        vars(value).update({name: _shared(part) for name, part in vars(value).items()})
    return value


def _forget() -> None:
    """A forked process has none of the threads that held locks."""
    global _counting
    _counting = RLock()
    _locks.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
