"""Attributes that are computed on first use, by one thread."""

import os
import threading
from functools import cached_property
from typing import Any, ClassVar, TypeVar, overload

from numpy import ndarray

_T = TypeVar("_T")


class computed_once(cached_property[_T]):
    """A cached property that is computed once, however many threads ask for it.

    `functools.cached_property` computes in every thread that asks at the same time or, before
    Python 3.12, lets all objects of a class wait for one lock. Here threads wait only for the
    same property of the same object: as long as no property needs itself, they cannot wait for
    each other in a circle. The lock is there only while it is needed, so that objects pickle,
    and may be frozen. An exception is nothing computed: the next to ask tries again. Arrays are
    read-only.

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

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> "computed_once[_T]": ...

    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> _T: ...

    def __get__(self, instance: object, owner: type[Any] | None = None) -> Any:
        if instance is None:
            return self
        name, known = str(self.attrname), instance.__dict__
        with _Held(instance, name):
            # only now is it certain that no other thread has computed it
            if name not in known:
                value = _shared(self.func(instance))
                # setting up an object may have stored more than was asked for
                known.setdefault(name, value)
            return known[name]


def remember(instance: object, name: str, value: Any) -> None:
    """Keep what has been computed for a `computed_once` of an object together with others.

    Raises
    ------
    TypeError
        If the name is that of something else.
    """
    if not isinstance(getattr(type(instance), name, None), computed_once):
        raise TypeError(f"expected the name of what is computed once, got {name!r}")
    with _Held(instance, name):
        instance.__dict__.setdefault(name, _shared(value))


def _shared(value: Any) -> Any:
    """The value, an array read-only: all who ask share it."""
    if isinstance(value, ndarray):
        value = value.view()
        value.flags.writeable = False
    return value


class _Held:
    """The lock of one property of one object, kept while some thread holds or awaits it."""

    guard = threading.Lock()
    locks: ClassVar[dict[tuple[int, str], tuple[Any, int]]] = {}

    def __init__(self, instance: object, name: str) -> None:
        self.key = id(instance), name

    def __enter__(self) -> None:
        with _Held.guard:
            lock, users = _Held.locks.get(self.key, (None, 0))
            lock = lock or threading.RLock()
            _Held.locks[self.key] = lock, users + 1
        lock.acquire()

    def __exit__(self, *exception: object) -> None:
        with _Held.guard:
            lock, users = _Held.locks.pop(self.key)
            if users > 1:
                _Held.locks[self.key] = lock, users - 1
        lock.release()


def _forget() -> None:
    """A forked process has none of the threads that held locks."""
    _Held.guard = threading.Lock()
    _Held.locks = {}


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
