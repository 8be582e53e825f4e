"""Meshes of triangles and quadrilaterals of any format of meshio."""

import logging
import re
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, overload

import numpy as np
from numpy import ndarray
from skfem import MeshQuad, MeshTri

from ..arguments import checked_choice
from ..errors import MeshError, MeshWarning, warn
from ..grids.checks import user_tags
from ..grids.polygons import some
from .cells import KINDS, changes, plain_cells, triangles, wanted_faces
from .guarded import read_through_meshio
from .writing import PathLike

#: boundaries as scikit-fem writes them: which sides of each cell
BY_SIDES = "skfem:b:"
#: dimension, number and name of a group in a file of Gmsh
NAMED = re.compile(rb'([0-3])\s+(\d+)\s+"(.*)"')
#: keyword and name where a file of Abaqus puts cells into a set
ELSET = re.compile(r"(?im)^\*(ELSET|ELEMENT)\b[^\n]*?ELSET\s*=\s*(\"[^\"\n]*\"|[^,\n]+)")
#: numbers of the cells' physical groups
GROUPS = "gmsh:physical"


@overload
def read_mesh(path: PathLike, *, quads: Literal["split"] = "split") -> MeshTri: ...
@overload
def read_mesh(path: PathLike, *, quads: Literal["keep"]) -> MeshTri | MeshQuad: ...
def read_mesh(path: PathLike, *, quads: Literal["split", "keep"] = "split") -> MeshTri | MeshQuad:
    """Read the triangles and quadrilaterals of a mesh file of any format that meshio reads.

    Named lines and areas (physical groups of Gmsh, cell sets, tags of scikit-fem) become
    boundaries and subdomains; files do not hold the sense of oriented boundaries. A damaged file
    is refused, also where a reader of meshio would wait for ever or take all memory: such readers
    run in a process of their own.

    Parameters
    ----------
    path : path
        Gmsh, VTK, VTU, XDMF, ... Points in space must lie in one plane z = const. Files ``.msh``
        are read as Gmsh's or Ansys Fluent's, by their content.
    quads : {"split", "keep"}
        Whether quadrilaterals are cut into two triangles each, along the diagonal that gives the
        better ones, those with a side of no length into one, or stay what they are, if there is
        nothing else: cells of
        ``CellBasis(mesh, ElementQuad0())``.

    Returns
    -------
    MeshTri, or MeshQuad
        The latter if quadrilaterals are kept and there are no triangles.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    TypeError
        If ``path`` is no path.
    ValueError
        If it is a folder, a pipe or a device, or ``quads`` is something else.
    MeshError
        If the file cannot be read, has no triangles or quadrilaterals, or both where the latter
        are kept, is not plane, or names points or cells that it does not have.

    Warns
    -----
    MeshWarning
        If quadrilaterals are split; if cells have nodes on their sides, of which they keep the
        corners only; if the file has other cells than these, lines and vertices, points that
        belong to none, or groups without a name, which are left out.
    """
    found = read_through_meshio(path)
    counts: dict[str, int] = {}
    for block in found.cells:
        counts[block.type] = counts.get(block.type, 0) + len(block.data)
    wanted = wanted_faces(counts, checked_choice("quads", quads, ("split", "keep")), path)
    points = _points(found.points, path)
    keep = [i for i, block in enumerate(found.cells) if block.type in KINDS]
    # xdmf and others hand over cells unsorted by kind: only what from_meshio understands
    parts = plain = [plain_cells(found.cells[i], len(points), path) for i in keep]
    if cut := wanted == "triangle" and any(part.kind == "quad" for part in plain):
        parts = triangles(plain, points)
    if not any(len(part.nodes) for part in parts if part.kind == wanted):
        raise MeshError(f"expected quadrilaterals with an area in {path}, got none")
    belongs = np.zeros(len(points), dtype=bool)
    for part in parts:
        if part.kind == wanted:
            belongs[part.nodes] = True
    used = np.nonzero(belongs)[0]
    if points.shape[1] == 3:
        _require_plane(points[used], path)
    if not (finite := np.isfinite(points[used, :2]).all(axis=1)).all():
        bad = used[~finite]
        raise MeshError(f"expected finite coordinates in {path}, got others in points {some(bad)}")
    if others := {k: n for k, n in counts.items() if k not in (*KINDS, "vertex")}:
        had = ", ".join(f"{n} {kind}" for kind, n in others.items())
        warn(
            f"{path}: only triangles and quadrilaterals are read; left out {had}",
            MeshWarning,
        )
    pieces = [
        np.bincount(part.source, minlength=len(whole.nodes))
        for part, whole in zip(parts, plain)
        if whole.kind == "quad"
    ]
    if told := changes(counts, wanted, sum(int(np.sum(made < 2)) for made in pieces)):
        warn(f"{path}: {told}", MeshWarning)
    sets = {
        name: [
            part.members(blocks[i] if i < len(blocks) else None, len(whole.nodes), name, path)
            for i, part, whole in zip(keep, parts, plain)
        ]
        for name, blocks in _groups(found, path).items()
    }
    data = {
        name: [part.data(blocks[i]) for i, part in zip(keep, parts)]
        for name, blocks in found.cell_data.items()
        if not (name.startswith(BY_SIDES) and cut)
    }
    if len(data) < len(found.cell_data):
        lost = ", ".join(n.removeprefix(BY_SIDES) for n in found.cell_data if n not in data)
        warn(
            f"{path}: left out the boundaries {lost}, numbered by sides of quadrilaterals. "
            'Remedy: quads="keep"',
            MeshWarning,
        )
    cells = [(part.kind, part.nodes) for part in parts]
    mesh = _tagged_mesh(points[:, :2], cells, data, sets, wanted, path)
    left_out = np.concatenate([part.left_out for part in parts])
    return _only_used(mesh, used, left_out, path)


def _points(points: Any, path: PathLike) -> ndarray:
    """Coordinates of shape (n, 2 or 3)."""
    try:
        points = np.asarray(points, dtype=float)
    except (ValueError, TypeError) as error:
        raise MeshError(f"expected numbers as coordinates in {path}: {error}") from error
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise MeshError(
            f"expected two or three coordinates of each point in {path}, got an array of shape "
            f"{points.shape}"
        )
    return points


def _require_plane(points: ndarray, path: PathLike) -> None:
    z = points[:, 2]
    with np.errstate(over="ignore", invalid="ignore"):
        size, rise = np.ptp(points[:, :2], axis=0).max(), np.ptp(z)
    # not "> ...", which NaN would pass; other coordinates are looked at later
    if np.isfinite(points[:, :2]).all() and not rise <= 1e-9 * size:
        raise MeshError(
            f"expected a plane mesh, z = const, in {path}; z runs from {z.min():g} to "
            f"{z.max():g}. Remedy: give the plan of the contact region in the x, y plane"
        )


def _groups(found: Any, path: PathLike) -> dict[str, list]:
    """Cells of each block in sets and in groups of Gmsh, but for its curve numbers.

    Gmsh numbers the groups of each dimension anew. Those without a name are told.
    """
    sets = _sets(found, path)
    names = {tuple(v): k for k, v in found.field_data.items() if np.shape(v) == (2,)}
    names |= _names(path)
    unnamed: set[str] = set()
    for i, (block, tags) in enumerate(zip(found.cells, found.cell_data.get(GROUPS, []))):
        if block.type not in KINDS:
            continue
        tags = np.abs(tags)  # of a reversed line it is negative
        for number in np.unique(tags[tags != 0]):  # 0 is none
            name = names.get((number, block.dim))
            if name is None:
                unnamed.add(f"{number} of {'lines' if block.dim == 1 else 'areas'}")
                continue
            members = sets.setdefault(name, [None] * len(found.cells))
            if members[i] is None or not len(members[i]):  # MSH 4.1 has all groups of a cell there
                members[i] = np.nonzero(tags == number)[0]
    if unnamed:
        warn(
            f"{path}: left out groups of cells without a name: {some(sorted(unnamed))}. Remedy: "
            "name physical groups in Gmsh",
            MeshWarning,
        )
    return sets


def _sets(found: Any, path: PathLike) -> dict[str, list]:
    """Cells of each block in sets that meshio tells. Of sets of other sets, and of those that an
    Abaqus file goes on with, it tells a part: they are left out, and told."""
    sets: dict[str, list] = {k: list(v) for k, v in user_tags(found.cell_sets).items()}
    parts: Counter[tuple[str, str]] = Counter()
    if Path(path).suffix.lower() == ".inp":
        text = Path(path).read_text(encoding="utf-8", errors="replace")
        found_at = (
            (kind.casefold(), name.strip().casefold()) for kind, name in ELSET.findall(text)
        )
        parts.update(found_at)
    bad = [
        name
        for name, blocks in sets.items()
        if len(blocks) != len(found.cells)
        or max(map(np.ndim, blocks)) > 1
        or max(parts[kind, name.casefold()] for kind in ("elset", "element")) > 1
    ]
    if bad:
        warn(
            f"{path}: left out the sets {some(sorted(bad))}, of other sets or in several parts. "
            "Remedy: each as one list of its own cells",
            MeshWarning,
        )
    return {name: blocks for name, blocks in sets.items() if name not in bad}


def _names(path: PathLike) -> dict[tuple[int, int], str]:
    """Names of groups in a file of Gmsh by their number and dimension: of equal ones of lines and
    areas meshio keeps one."""
    names: dict[tuple[int, int], str] = {}
    if Path(path).suffix.lower() != ".msh":
        return names
    with Path(path).open("rb") as file:
        for line in file:
            if line.startswith((b"$Entities", b"$Nodes")):  # behind the names
                break
            if row := NAMED.fullmatch(line.strip()):
                names[int(row[2]), int(row[1])] = row[3].decode(errors="replace")
    return names


def _tagged_mesh(
    points: ndarray,
    cells: list[tuple[str, ndarray]],
    cell_data: dict,
    cell_sets: dict,
    wanted: str,
    path: PathLike,
) -> MeshTri | MeshQuad:
    """The triangles, or quadrilaterals, with the tags that skfem finds."""
    import meshio
    from skfem.io.meshio import from_meshio

    # without field_data, in which from_meshio looks for names whatever the dimension
    slim = meshio.Mesh(points, cells, cell_data=cell_data, cell_sets=cell_sets)
    with _told_by("skfem.io.meshio") as told:
        try:
            mesh = from_meshio(slim, force_meshio_type=wanted)
        except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
            raise MeshError(
                f"the tags in {path} cannot be read: {error!r}. Remedy: write the file without "
                "them, or again"
            ) from error
    if told and any(kind == "line" for kind, _ in cells):  # without lines there is nothing lost
        warn(f"{path}: left out tags of lines that cannot be read", MeshWarning)
    return mesh


@contextmanager
def _told_by(name: str) -> Iterator[list[str]]:
    """Messages that this thread sends to a logger, which does not get them."""
    told: list[str] = []
    here = threading.get_ident()

    def keep(record: logging.LogRecord) -> bool:
        if record.thread != here:
            return True
        told.append(record.getMessage())
        return False

    logger = logging.getLogger(name)
    logger.addFilter(keep)
    try:
        yield told
    finally:
        logger.removeFilter(keep)


def _only_used(
    mesh: MeshTri | MeshQuad, used: ndarray, known: ndarray, path: PathLike
) -> MeshTri | MeshQuad:
    """The mesh with the points in ``used``, which its cells have.

    Others are told, but for those in ``known``.
    """
    n = mesh.p.shape[1]
    unused = np.setdiff1d(np.arange(n), np.append(used, known))
    if len(unused):
        warn(
            f"{path}: left out {len(unused)} points that belong to no triangle: {some(unused)}",
            MeshWarning,
        )
    tags = [user_tags(kind) or None for kind in (mesh.boundaries, mesh.subdomains)]
    # keeps the order of the nodes, so facets and tags keep their numbers
    number = np.zeros(n, dtype=np.int32)
    number[used] = np.arange(len(used))
    return type(mesh)(np.ascontiguousarray(mesh.p[:, used]), number[mesh.t], *tags)
