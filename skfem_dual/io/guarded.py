"""Files through meshio, whose readers may wait for ever or take all memory on damaged ones."""

import math
import os
import pickle
import re
import signal
import stat
import struct
import subprocess
import sys
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import MeshError
from ..messages import one_line
from . import reader
from .writing import PathLike

if TYPE_CHECKING:
    import meshio

#: seconds that a reader of its own process may take, or per megabyte if that is more
SECONDS, SECONDS_PER_MB = 6.0, 1.6
#: of these the processor may work so long on the file
CPU_SECONDS, CPU_SECONDS_PER_MB = 2.0, 1.2
#: bytes of memory that it may take, and per byte of the file
MEMORY, MEMORY_PER_BYTE = 500_000_000, 100
#: readers that end on any file, and but for Gmsh take memory in proportion to it
STEADY = {"gmsh", "vtk", "vtu", "xdmf", "off", "medit", "abaqus", "ply", "stl", "obj"}
#: what a header must hold, or a reader goes on looking for it
HEADERS = {
    "off": re.compile(rb"\A\s*OFF[^\n]*\n(\s*#[^\n]*\n|\s*\n)*\s*[^#\s]"),
    "ply": re.compile(rb"^end_header\s*$", re.MULTILINE),
}
#: the other data sets of VTK hold no triangles, but take memory for what they promise
UNSTRUCTURED = re.compile(rb"^\s*DATASET\s+UNSTRUCTURED_GRID\b", re.MULTILINE | re.IGNORECASE)
#: a number of a Gmsh file below 1
BELOW_ONE = re.compile(rb"[ \t](?:0|-\d+)\b")
ENDLESS = "its reader does not come to an end; the file is damaged or cut off"
#: what files begin with that are workbooks or other archives, new and old
ARCHIVES = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
#: reasons longer than this are cut
REASON = 160


def require_file(path: PathLike, what: str) -> Path:
    """The path of a regular file that exists.

    Raises
    ------
    TypeError
        If it is no path.
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is a folder, a pipe, a device, or has no name.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"expected the path of {what}, got {type(path).__name__}")
    text = str(path)
    if not text or "\0" in text:
        raise ValueError(f"expected the path of {what}, got {text!r}")
    try:
        mode = Path(path).stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise FileNotFoundError(f"no such file: {path}") from None
    if not stat.S_ISREG(mode):
        kind = "folder" if stat.S_ISDIR(mode) else "pipe, socket or device"
        raise ValueError(f"expected {what}, got the {kind} {path}. Remedy: name a regular file")
    return Path(path)


def text_of(path: Path) -> str:
    """Text of a file in UTF-8, or in UTF-16 with its mark, as Excel writes Unicode text.

    Raises
    ------
    ValueError
        If it is something else.
    """
    content = path.read_bytes()
    if content.startswith(ARCHIVES):
        raise ValueError(
            f"expected text in {path}, got a workbook or another archive. Remedy: save its table "
            "as CSV"
        )
    marked = content.startswith((BOM_UTF16_LE, BOM_UTF16_BE))
    try:
        return content.decode("utf-16" if marked else "utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise ValueError(
            f"expected text in UTF-8 in {path}, got the byte 0x{content[error.start]:02x} in line "
            f"{line}. Remedy: save it as UTF-8, in Excel as the kind of file CSV UTF-8"
        ) from error


def read_through_meshio(path: PathLike, file_format: str | None = None) -> "meshio.Mesh":
    """The meshio mesh of a file; every failure as an error that names the file.

    Readers that may not end, or take memory for what a damaged header promises, run in a
    process of their own with limits of time and memory.

    Raises
    ------
    FileNotFoundError, TypeError
        If there is no such file, or it is no path.
    MeshError
        If the file cannot be read.
    """
    import meshio

    path = require_file(path, "a mesh file")
    if path.stat().st_size == 0:
        raise MeshError(f"expected a mesh in {path}, which is empty")
    if path.suffix.lower() == ".msh" and file_format is None:  # meshio would try Ansys first
        file_format = "ansys" if _begins_with_bracket(path) else "gmsh"
    formats = {file_format} if file_format else _formats_of(path)
    if not formats:
        raise MeshError(
            f"meshio cannot read {path}: no format has such a name. Remedy: name it by its "
            "format, for instance .msh (Gmsh), .vtu, .vtk, .xdmf; outlines are read by Plan.read"
        )
    if "xdmf" in formats:
        _require_files_named_in(path)
    if "gmsh" in formats:
        _require_node_numbers(path)
    if "off" in formats:
        _require_all_of_off(path)
    if _is_steady(path, formats):
        outcome, found = reader.read(str(path), file_format)
    else:
        outcome, found = _read_apart(path, file_format)
    if outcome == "missing":
        remedy = "'skfem-dual[hdf5]'" if found == "h5py" else found
        raise MeshError(f"meshio cannot read {path} without {found}. Remedy: pip install {remedy}")
    if outcome == "error":
        raise MeshError(f"meshio cannot read {path}: {one_line(found, REASON)}")
    try:
        return meshio.Mesh(**found)
    except (ValueError, TypeError, LookupError) as error:
        raise MeshError(f"meshio cannot read {path}: {one_line(str(error), REASON)}") from error


def _begins_with_bracket(path: Path) -> bool:
    """Whether a file has the sections of Ansys Fluent, those of Gmsh begin with a dollar sign."""
    with open(path, "rb") as file:
        return file.read(1000).lstrip().startswith(b"(")


def _formats_of(path: Path) -> set[str]:
    import meshio

    suffixes = [s.lower() for s in path.suffixes]
    names = ["".join(suffixes[i:]) for i in range(len(suffixes))]
    return {f for name in names for f in meshio.extension_to_filetypes.get(name, [])}


def _is_steady(path: Path, formats: set[str]) -> bool:
    """Whether the reader is sure to end, with memory in proportion to the file."""
    size = path.stat().st_size
    if not formats <= STEADY or not size:
        return False
    with open(path, "rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as content:
        for name in formats & set(HEADERS):
            if not HEADERS[name].search(content):
                raise MeshError(f"meshio cannot read {path}: its header of {name} is not complete")
        if "vtk" in formats and not UNSTRUCTURED.search(content):
            return False
        return "gmsh" not in formats or _promises_little(content, size)


def _promises_little(content: mmap, size: int) -> bool:
    """Whether no count and no node number of a Gmsh file exceeds its size.

    The reader takes memory for as many nodes as the largest number. One that is sparse is no
    fault: the file is then only read apart.
    """
    begin, end = content.find(b"$Nodes"), content.find(b"$EndNodes")
    if begin < 0 or end < 0:
        return False
    version = content[: content.find(b"$EndMeshFormat")].split()[1:3]
    if version == [b"4.1", b"1"]:
        return _largest_binary_number(content[begin:end].partition(b"\n")[2]) <= size
    if version[1:] != [b"0"]:  # other binary ones are rare
        return False
    large = re.compile(rb"^[ \t]*(?:\d+[ \t]+)*\d{%d,}\b(?!\.)" % len(str(size)), re.MULTILINE)
    return not large.search(content, begin, end)


def _require_node_numbers(path: Path) -> None:
    """Refuse cells of a Gmsh file in text with node numbers below 1: the reader would take other
    nodes for them."""
    with open(path, "rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as content:
        begin, end = content.find(b"$Elements"), content.find(b"$EndElements")
        version = content[: content.find(b"$EndMeshFormat")].split()[1:3]
        if begin < 0 or version[1:] != [b"0"] or not BELOW_ONE.search(content, begin, end):
            return
        lines = content[begin:end].splitlines()[2:]
    grouped, left = version[0].startswith(b"4"), 0
    for line in lines:
        try:
            fields = [int(field) for field in line.split()]
            if grouped and not left:  # the head of a block
                left = fields[3]
                continue
            left -= 1
            nodes = fields[1:] if grouped else fields[3 + fields[2] :]
        except (ValueError, IndexError):  # damaged, of which the reader tells
            return
        if min(nodes, default=1) < 1:
            raise MeshError(
                f"expected node numbers from 1 in {path}, got {min(nodes)} in element {fields[0]}."
                " Remedy: number the nodes from 1, as in the section $Nodes"
            )


def _require_all_of_off(path: Path) -> None:
    """Refuse an OFF file whose reader would stop within its last number, or before its end."""
    with open(path, "rb") as file:
        lines = [words for line in file if (words := line.partition(b"#")[0].split())]
    try:
        points, faces = map(int, lines[1][:2])
    except (ValueError, IndexError):  # damaged, of which the reader tells
        return
    left = sum(map(len, lines[2:])) - 3 * points - 4 * faces
    last = lines[-1][-1]
    if left > 0 or not last.removeprefix(b"-").isdigit():
        got = f"{left} numbers more" if left > 0 else repr(last.decode("utf-8", "replace"))
        raise MeshError(
            f"expected {path} to end with the last of {faces} faces, as its header has them, and "
            f"the number of a node, got {got}. Remedy: write the file again"
        )


def _largest_binary_number(nodes: bytes) -> float:
    """The largest count and number in the nodes of a binary Gmsh file 4.1."""
    try:
        blocks, *counts = struct.unpack_from("=4Q", nodes)
        at = 32
        for _ in range(blocks):
            n = struct.unpack_from("=3iQ", nodes, at)[-1]
            numbers = np.frombuffer(nodes, np.uint64, n, at + 20)
            counts += [n, int(numbers.max(initial=0))]
            at += 20 + 32 * n
    except (struct.error, ValueError, OverflowError):  # cut off
        return math.inf
    return max(counts)


def _require_files_named_in(path: Path) -> None:
    """Refuse an XDMF file that keeps its data in a pipe or device, on which a reader waits."""
    named = re.compile(rb"<DataItem\b[^>]*?(?:HDF|Binary)[^>]*>([^<]*)<", re.IGNORECASE)
    with open(path, "rb") as file:
        names = {found.group(1).strip() for found in named.finditer(file.read())}
    for name in {n.decode("utf-8", "replace").split(":")[0] for n in names}:
        target = path.resolve().parent / name
        if "\0" in name or (target.exists() and not target.is_file()):
            raise MeshError(
                f"expected data of {path} in a regular file, got {name!r}. Remedy: name the file "
                "that holds them"
            )


def _read_apart(path: Path, file_format: str | None) -> Any:
    """As `reader.read` in a process of its own, with limits of time and memory."""
    size = path.stat().st_size
    seconds = max(SECONDS, SECONDS_PER_MB * size / 1e6)
    cpu = CPU_SECONDS + CPU_SECONDS_PER_MB * size / 1e6
    limits = [str(MEMORY + MEMORY_PER_BYTE * size), str(cpu)]
    command = [sys.executable, "-P", reader.__file__, str(path), file_format or "", *limits]
    try:
        found = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=seconds,
            check=True,
        )
    except subprocess.TimeoutExpired:
        return "error", ENDLESS
    except subprocess.CalledProcessError as error:
        ended = hasattr(signal, "SIGXCPU") and error.returncode == -signal.SIGXCPU
        return "error", ENDLESS if ended else "its reader broke down; the file is damaged"
    return pickle.loads(found.stdout)
