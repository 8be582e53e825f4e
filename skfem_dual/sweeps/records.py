"""A file of results, found by the content of problem and case."""

import copyreg
import io
import pickle
import struct
import types
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from functools import cached_property, lru_cache
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher
from numba.np.ufunc.ufunc_base import UfuncBase
from skfem import Mesh
from skfem.assembly.basis import AbstractBasis
from skfem.element import Element

from ..bodies.body import Body
from ..bodies.elastic import ElasticPunch
from ..bodies.group import RigidPunches
from ..bodies.punch import RigidPunch
from ..bodies.punches import Punches
from ..elements.shape_functions import without_functions
from ..grids.cellwise import CellwiseBasis
from ..io.writing import PathLike

try:  # dask and loky bring it, and send classes of a script with it
    from cloudpickle import Pickler
except ImportError:
    from pickle import Pickler

Problem = Callable[..., Any]
#: bodies of records by their keys, those of equal cases in order
Stored = dict[bytes, deque[memoryview]]

MARK = b"skfem_dual sweep\n"
HEAD = struct.Struct("<Q32s")  # length and SHA-256 of what follows
BODIES = RigidPunch, ElasticPunch, RigidPunches, Punches
#: scalars of numpy that count as numbers and texts of Python, which they are in all they do
PLAIN = np.float64, np.int64, np.complex128, np.bool_, np.str_, np.bytes_
#: what these answer follows from the function they wrap alone
COMPILED_OR_CACHED: tuple[type[Any], ...] = Dispatcher, UfuncBase, type(lru_cache(abs))


def record(key: bytes, body: bytes) -> bytes:
    """What is appended to the file for one result."""
    content = key + body
    return MARK + HEAD.pack(len(content), sha256(content).digest()) + content


def append(file: io.FileIO, entry: bytes) -> None:
    """Hand an entry to the operating system; an OSError names the file."""
    left = memoryview(entry)
    try:
        while left:  # a disk that is nearly full takes a part
            left = left[file.write(left) :]
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file.name)) from error


def read_records(path: Path) -> tuple[Stored, int]:
    """Bodies by their keys, and the number of bytes that are no whole record.

    Raises
    ------
    ValueError
        If the file was not written by `sweep`.
    """
    data = path.read_bytes() if path.exists() else b""
    bodies: Stored = {}
    view, torn, at = memoryview(data), 0, 0
    while at < len(data):
        begin = at + len(MARK) + HEAD.size
        if data.startswith(MARK, at) and begin <= len(data):
            length, checksum = HEAD.unpack_from(data, at + len(MARK))
            content = view[begin : begin + length]
            if len(content) == length and sha256(content).digest() == checksum:
                bodies.setdefault(bytes(content[:32]), deque()).append(content[32:])
                at = begin + length
                continue
        following = data.find(MARK, at + 1)
        following = len(data) if following == -1 else following
        torn += following - at
        at = following
    if not bodies and not MARK.startswith(data[: len(MARK)]):
        raise ValueError(f"expected results of a sweep in {path}, or no such file")
    return bodies, torn


def pickled(value: Any, problem: Problem) -> bytes:
    """Pickle without what belongs to the problem, such as the punch of every solution."""
    return _pickled(value, problem, Pickler)


def lasting(body: bytes, value: Any, problem: Problem) -> bytes:
    """The ``body`` pickled from a value for a file: there classes of a script are named if they
    can be, as they are others in its next run."""
    if b"cloudpickle" not in body:
        return body
    try:
        return _pickled(value, problem, pickle.Pickler)
    except (pickle.PicklingError, AttributeError, TypeError):  # of functions
        return body


def _pickled(value: Any, problem: Problem, kind: Any) -> bytes:
    names = {id(part): name for name, part in _shared(problem).items()}

    class Sparing(kind):
        def persistent_id(self, obj: Any) -> str | None:
            return names.get(id(obj))

    file = io.BytesIO()
    Sparing(file, pickle.HIGHEST_PROTOCOL).dump(value)
    return file.getvalue()


def restored(body: bytes | memoryview, problem: Problem) -> Any:
    """The result pickled in a body, with the caller's own problem in it."""
    shared = _shared(problem)

    class Restoring(pickle.Unpickler):
        def persistent_load(self, name: str) -> Any:
            return shared[name]

    return Restoring(io.BytesIO(body)).load()


def _shared(problem: Problem) -> dict[str, Any]:
    """What results need not bring along, by names: what is solved, its punches and their cells.

    Not objects of users: one that a result is may have changed.
    """
    whole = getattr(problem, "__self__", problem)
    shared = {"problem": whole} if isinstance(whole, BODIES) else {}
    if isinstance(whole, (RigidPunches, Punches)):
        punches = whole.members if isinstance(whole, RigidPunches) else whole.punches
        shared |= {f"punch {i}": punch for i, punch in enumerate(punches)}
    if isinstance(whole, Punches) and whole.rigid is not None:
        shared["rigid"] = whole.rigid
    # the same pressed over their edges, as results have them
    bodies = [(name, part) for name, part in shared.items() if isinstance(part, Body)]
    shared |= {f"sharp {name}": part.sharp for name, part in bodies if part.edge_by_contact}
    cells = {
        f"cells of {name}": part.footprint
        for name, part in shared.items()
        if isinstance(part, (RigidPunch, ElasticPunch))
    }
    return shared | cells


def restored_record(body: memoryview, problem: Problem, path: PathLike) -> Any:
    """`restored` of a body from the file at ``path``; a ValueError if that fails."""
    try:
        return restored(body, problem)
    except Exception as error:
        raise ValueError(
            f"a result in {path} cannot be loaded: {error!r}. Remedy: import what it needs, or "
            "begin a new file"
        ) from error


def fingerprint(value: Any) -> bytes:
    """SHA-256 of the content of a value: the same in any process, whatever has been cached.

    Raises
    ------
    TypeError
        If it holds something without content, such as a lock or an open file.
    """
    known: dict[int, tuple[Any, bytes]] = {}  # the values too, or their ids would be used again

    def of(value: Any) -> bytes:
        if id(value) not in known:
            known[id(value)] = value, b"a value inside itself"
            plain = value
            if isinstance(value, np.generic):
                plain = value.item() if isinstance(value, PLAIN) else np.asarray(value)
            name = f"{type(plain).__module__}.{type(plain).__qualname__}".encode()
            content = b"".join(sha256(part).digest() for part in (name, *_parts(plain, of)))
            known[id(value)] = value, sha256(content).digest()
        return known[id(value)][1]

    return of(value)


def _parts(value: Any, of: Callable[[Any], bytes]) -> Iterable[bytes]:
    """Bytes that tell a value from others of its type; ``of`` does so for what it holds."""
    if value is None or type(value) in (bool, int, float, complex, str, bytes):
        return [repr(value).encode()]
    if type(value) is np.ndarray and not value.dtype.hasobject:
        return [repr((_kind(value.dtype), value.shape)).encode(), value.tobytes()]
    if type(value) in (dict, types.MappingProxyType):
        return sorted(of(key) + of(item) for key, item in value.items())
    if type(value) in (set, frozenset):
        return sorted(map(of, value))
    if type(value) in (list, tuple):
        return map(of, value)
    if isinstance(value, type):
        return [f"{value.__module__}.{value.__qualname__}".encode()]
    if isinstance(value, types.BuiltinFunctionType):  # of a module, or bound to what holds data
        own = value.__self__
        bound = () if own is None or isinstance(own, types.ModuleType) else (own,)
        return [f"{value.__module__}.{value.__qualname__}".encode(), *map(of, bound)]
    if isinstance(value, types.ModuleType):
        return [value.__name__.encode()]
    if isinstance(value, PurePath):  # which pickles by the parts it was made of
        return [str(value).encode()]
    if isinstance(value, types.CodeType):
        takes = value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount
        names = value.co_names, value.co_varnames
        return map(of, (value.co_code, value.co_consts, *names, takes, value.co_flags))
    if isinstance(value, types.FunctionType):
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        own = (value.__module__, value.__qualname__, value.__code__, cells)
        return map(of, (*own, value.__defaults__, value.__kwdefaults__))
    if isinstance(value, types.MethodType):
        return map(of, (value.__func__, value.__self__))
    if isinstance(value, COMPILED_OR_CACHED):
        return [of(value.__wrapped__)]
    if isinstance(value, Mesh):  # which keeps facets and the like beside its fields once asked
        return map(of, ((f.name, getattr(value, f.name)) for f in fields(value)))
    if isinstance(value, CellwiseBasis):  # which sets up the rest once asked
        made = value.dual, value.grid, value.__dict__["_deferred"], value.__dict__.get("tind")
        return map(of, made)
    if isinstance(value, AbstractBasis):  # which keeps coordinates and the like, as mappings do
        kept = ((k, v) for k, v in vars(value).items() if k[0] != "_" and k != "mapping")
        return sorted(map(of, kept))
    if isinstance(value, Element):  # what plate elements have made of text does not pickle
        value = without_functions(value)
    if reduce := copyreg.dispatch_table.get(type(value)):
        reduced = reduce(value)
    else:
        reduced = value.__reduce_ex__(pickle.HIGHEST_PROTOCOL)
    if isinstance(reduced, str):  # a global name, which pickle looks for
        pickle.dumps(value)
        return [reduced.encode()]
    function, arguments, state, items, pairs = (*reduced, None, None, None)[:5]
    if isinstance(value, (set, frozenset)):  # the order of its items is another in each process
        arguments = set(value)
    made = function, arguments, list(items or ()), dict(pairs or ())
    return map(of, (*made, _content(value, state)))


def _kind(dtype: np.dtype) -> Any:
    """What an element of an array is: names, kinds and places of its fields, if it has such."""
    if dtype.names is None:
        return dtype.str if dtype.subdtype is None else (_kind(dtype.base), dtype.shape)
    fields: Any = dtype.fields
    return [(name, _kind(fields[name][0]), fields[name][1]) for name in dtype.names]


def _content(value: Any, state: Any) -> Any:
    """The state of a value without what is computed from the rest of it, and without notes:
    fields that neither make nor compare it."""
    if isinstance(state, tuple):  # what is in slots comes second
        return tuple(_content(value, part) for part in state)
    if not isinstance(state, dict):
        return state
    declared = fields(value) if is_dataclass(value) else ()
    notes = {field.name for field in declared if not (field.init or field.compare)}
    return {
        name: part
        for name, part in state.items()
        if name not in notes and not isinstance(getattr(type(value), name, None), cached_property)
    }
