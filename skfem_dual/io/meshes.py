"""Triangle meshes of any format of meshio."""

import logging
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from ..errors import MeshError, MeshWarning
from ..grids.checks import user_tags
from ..grids.polygons import some
from .guarded import read_through_meshio
from .writing import PathLike

#: cells that are read, with their numbers of nodes
KINDS = {"triangle": 3, "line": 2}


def read_mesh(path: PathLike) -> MeshTri:
    """Read the triangles of a mesh file of any format that meshio reads.

    Named lines and areas (physical groups of Gmsh, cell sets, tags of scikit-fem) become
    boundaries and subdomains. A damaged file is refused, also where a reader of meshio would
    wait for ever or take all memory: such readers run in a process of their own.

    Parameters
    ----------
    path : path
        Gmsh, VTK, VTU, XDMF, ... Points in space must lie in one plane z = const.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    TypeError
        If ``path`` is none.
    ValueError
        If it is a folder, a pipe or a device.
    MeshError
        If the file cannot be read, has no straight triangles, is not plane, or names points or
        cells that it does not have.

    Warns
    -----
    MeshWarning
        If the file has other cells than triangles, lines and vertices, points that belong to no
        triangle, or groups without a name; they are left out.
    """
    found = read_through_meshio(path)
    counts: dict[str, int] = {}
    for block in found.cells:
        counts[block.type] = counts.get(block.type, 0) + len(block.data)
    if not counts.get("triangle"):
        had = ", ".join(f"{n} {kind}" for kind, n in counts.items()) or "no cells"
        raise MeshError(
            f"expected straight triangles in {path}, got {had}. Remedy: mesh the plan with "
            "first-order triangles"
        )
    points = _points(found.points, path)
    keep = [i for i, block in enumerate(found.cells) if block.type in KINDS]
    # xdmf and others hand over cells unsorted by kind: only what from_meshio understands
    cells = [_cells(found.cells[i], len(points), path) for i in keep]
    belongs = np.zeros(len(points), dtype=bool)
    for kind, nodes in cells:
        if kind == "triangle":
            belongs[nodes] = True
    used = np.nonzero(belongs)[0]
    if points.shape[1] == 3:
        _require_plane(points[used], path)
    if not (finite := np.isfinite(points[used, :2]).all(axis=1)).all():
        bad = used[~finite]
        raise MeshError(f"expected finite coordinates in {path}, got others in points {some(bad)}")
    if others := {k: n for k, n in counts.items() if k not in (*KINDS, "vertex")}:
        had = ", ".join(f"{n} {kind}" for kind, n in others.items())
        warnings.warn(
            f"{path}: only triangles are read; left out {had}", MeshWarning, stacklevel=2
        )
    sets = {
        name: [_members(blocks, i, len(cells[k][1]), name, path) for k, i in enumerate(keep)]
        for name, blocks in user_tags(found.cell_sets).items()
    }
    data = {name: [blocks[i] for i in keep] for name, blocks in found.cell_data.items()}
    mesh = _tagged_mesh(points[:, :2], cells, data, found.field_data, sets, path)
    return _only_used(mesh, used, path)


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


def _cells(block: Any, n: int, path: PathLike) -> tuple[str, ndarray]:
    """The kind of the cells of a block and their nodes, all of them less than ``n``."""
    nodes = np.asarray(block.data)
    size = KINDS[block.type]
    if nodes.ndim != 2 or nodes.shape[1] != size or nodes.dtype.kind not in "iu":
        raise MeshError(
            f"expected {size} whole numbers for each {block.type} in {path}, got an array of "
            f"{nodes.dtype} of shape {nodes.shape}"
        )
    if nodes.size and (nodes.min() < 0 or nodes.max() >= n):
        wrong = np.nonzero(((nodes < 0) | (nodes >= n)).any(axis=1))[0]
        raise MeshError(
            f"expected nodes from 0 to {n - 1} in {path}, got {nodes[wrong[0]].tolist()} in "
            f"{block.type} {wrong[0]}, the first of {wrong.size}; numbers count from 0. Remedy: "
            "write the file again from the program that made the mesh"
        )
    return block.type, nodes.astype(np.int64)


def _members(blocks: Any, i: int, n: int, name: str, path: PathLike) -> ndarray:
    """Cells of block ``i`` that belong to a set, all of them less than ``n``."""
    members = blocks[i] if i < len(blocks) else None
    index = np.asarray([] if members is None else members)
    if index.size == 0:
        return np.zeros(0, dtype=np.int64)
    if index.ndim != 1 or index.dtype.kind not in "iu" or index.min() < 0 or index.max() >= n:
        raise MeshError(
            f"expected cells from 0 to {n - 1} in the set {name!r} of {path}, got "
            f"{some(index.ravel())}"
        )
    return index.astype(np.int64)


def _require_plane(points: ndarray, path: PathLike) -> None:
    z = points[:, 2]
    with np.errstate(over="ignore", invalid="ignore"):
        size, rise = np.ptp(points[:, :2], axis=0).max(), np.ptp(z)
    # not "> ...", which NaN would pass
    if not rise <= 1e-9 * size:
        raise MeshError(
            f"expected a plane mesh, z = const, in {path}; z runs from {z.min():g} to "
            f"{z.max():g}. Remedy: give the plan of the contact region in the x, y plane"
        )


def _tagged_mesh(
    points: ndarray,
    cells: list[tuple[str, ndarray]],
    cell_data: dict,
    field_data: dict,
    cell_sets: dict,
    path: PathLike,
) -> MeshTri:
    """The triangles with the tags that skfem finds."""
    import meshio
    from skfem.io.meshio import from_meshio

    slim = meshio.Mesh(
        points, cells, cell_data=cell_data, field_data=field_data, cell_sets=cell_sets
    )
    with _told_by("skfem.io.meshio") as told:
        try:
            mesh = from_meshio(slim, force_meshio_type="triangle")
        except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError) as error:
            raise MeshError(
                f"the tags in {path} cannot be read: {error!r}. Remedy: write the file without "
                "them, or again"
            ) from error
    if told and any(kind == "line" for kind, _ in cells):  # without lines there is nothing lost
        warnings.warn(f"{path}: left out tags of lines that cannot be read", MeshWarning, 3)
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


def _only_used(mesh: MeshTri, used: ndarray, path: PathLike) -> MeshTri:
    """The mesh with the points in ``used``, which its triangles have, and with named tags."""
    n = mesh.p.shape[1]
    if len(used) < n:
        unused = np.setdiff1d(np.arange(n), used)
        warnings.warn(
            f"{path}: left out {len(unused)} points that belong to no triangle: {some(unused)}",
            MeshWarning,
            stacklevel=3,
        )
    tags = [_named(kind, path) for kind in (mesh.boundaries, mesh.subdomains)]
    # keeps the order of the nodes, so facets and tags keep their numbers
    number = np.zeros(n, dtype=np.int32)
    number[used] = np.arange(len(used))
    return MeshTri(np.ascontiguousarray(mesh.p[:, used]), number[mesh.t], *tags)


def _named(tags: dict | None, path: PathLike) -> dict[str, ndarray] | None:
    """The tags with a name, but for Gmsh's curve numbers."""
    if tags and None in tags:
        warnings.warn(f"{path}: left out a group of cells without a name", MeshWarning, 4)
    return user_tags({k: v for k, v in (tags or {}).items() if k is not None}) or None
