"""Meshes and results through meshio: any triangle mesh in, polygons and solutions out as VTU."""

import contextlib
import io
import os
import tempfile
import tomllib
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from .contact.solution import PunchSolution
from .errors import MeshError, MeshWarning
from .grids.checks import user_tags
from .grids.dual_mesh import DualMesh
from .grids.polygons import Polygons, some
from .ground.graded import GradedHalfSpace
from .ground.layered import Layer, LayeredHalfSpace
from .ground.substrates import HalfSpace

PathLike = str | os.PathLike[str]


def read_mesh(path: PathLike) -> MeshTri:
    """Read the triangles of a mesh file of any format that meshio reads.

    Named lines and areas (physical groups of Gmsh, cell sets, tags of scikit-fem) become
    boundaries and subdomains.

    Parameters
    ----------
    path : path
        Gmsh, VTK, VTU, XDMF, ... Points in space must lie in one plane z = const.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file cannot be read, has no straight triangles or is not plane.

    Warns
    -----
    MeshWarning
        If the file has other cells than triangles, lines and vertices, or points that belong to
        no triangle; they are left out.
    """
    from skfem.io.meshio import from_meshio

    path = Path(path)
    # meshio would take .msh for a file of Ansys
    found = _read(path, "gmsh" if path.suffix == ".msh" else None)
    counts: dict[str, int] = {}
    for block in found.cells:
        counts[block.type] = counts.get(block.type, 0) + len(block.data)
    if not counts.get("triangle"):
        had = ", ".join(f"{n} {kind}" for kind, n in counts.items()) or "no cells"
        raise MeshError(
            f"expected straight triangles in {path}, got {had}. Remedy: mesh the plan with "
            "first-order triangles"
        )
    points = np.asarray(found.points, dtype=float)
    if points.shape[1] == 3:
        _require_plane(points[np.unique(found.cells_dict["triangle"])], path)
    if others := {k: n for k, n in counts.items() if k not in ("triangle", "line", "vertex")}:
        had = ", ".join(f"{n} {kind}" for kind, n in others.items())
        warnings.warn(
            f"{path}: only triangles are read; left out {had}", MeshWarning, stacklevel=2
        )
    return _only_used(_tagged_mesh(from_meshio, found), path)


def _read(path: Path, file_format: str | None):
    """The meshio mesh of a file; every failure as an error that names the file."""
    import meshio

    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    told = io.StringIO()  # meshio prints its reasons and exits
    try:
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            return meshio.read(path, file_format)
    except ImportError as error:
        raise MeshError(
            f"meshio cannot read {path} without {error.name}. Remedy: pip install {error.name}"
        ) from error
    except (Exception, SystemExit) as error:
        reason = " ".join((told.getvalue() or str(error)).split()) or type(error).__name__
        raise MeshError(f"meshio cannot read {path}: {reason}") from error


def _require_plane(points: ndarray, path: Path) -> None:
    z = points[:, 2]
    size = np.ptp(points[:, :2], axis=0).max()
    # not "> ...", which NaN would pass
    if not np.ptp(z) <= 1e-9 * size:
        raise MeshError(
            f"expected a plane mesh, z = const, in {path}; z runs from {z.min():g} to "
            f"{z.max():g}. Remedy: give the plan of the contact region in the x, y plane"
        )


def _tagged_mesh(from_meshio: Callable, found) -> MeshTri:
    """The triangles of a meshio mesh with the tags that skfem finds."""
    import meshio

    keep = [i for i, block in enumerate(found.cells) if block.type in ("triangle", "line")]
    # xdmf and others hand over cells unsorted by kind: only what from_meshio understands
    slim = meshio.Mesh(
        np.asarray(found.points, dtype=float)[:, :2],
        [found.cells[i] for i in keep],
        cell_data={k: [v[i] for i in keep] for k, v in found.cell_data.items()},
        field_data=found.field_data,
        cell_sets={k: [v[i] for i in keep] for k, v in found.cell_sets.items()},
    )
    return from_meshio(slim, force_meshio_type="triangle")


def _only_used(mesh: MeshTri, path: Path) -> MeshTri:
    """The mesh without points that belong to no triangle and without Gmsh's curve numbers."""
    used = np.zeros(mesh.p.shape[1], dtype=bool)
    used[mesh.t] = True
    if not used.all():
        unused = np.nonzero(~used)[0]
        warnings.warn(
            f"{path}: left out {len(unused)} points that belong to no triangle: {some(unused)}",
            MeshWarning,
            stacklevel=3,
        )
    # keeps the order of the nodes, so facets and tags keep their numbers
    number = np.cumsum(used, dtype=np.int32) - 1
    return MeshTri(
        np.ascontiguousarray(mesh.p[:, used]),
        number[mesh.t],
        user_tags(mesh.boundaries) or None,
        user_tags(mesh.subdomains) or None,
    )


def read_substrate(path: PathLike) -> HalfSpace | GradedHalfSpace | LayeredHalfSpace:
    """Read the ground from a TOML file.

    Layers from the surface down, if any, and what lies below them; ``gradient`` may be left out::

        [[layers]]
        thickness = 2.0
        young = 20e6
        poisson = 0.3
        gradient = 0.1  # E = young (1 + gradient z) from the top of the layer

        [base]
        young = 60e6
        poisson = 0.25
        gradient = 0.05

    or, for a rigid base, ``base = "bonded"`` or ``base = "smooth"`` before the layers.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is no TOML, has other or too few entries, or values out of range.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    try:
        found = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"expected TOML in {path}: {error}") from error
    _require_keys(path, "the file", found, {"base"}, {"layers"})
    base, layers = found["base"], found.get("layers", [])
    if not isinstance(layers, list) or not all(isinstance(layer, dict) for layer in layers):
        raise ValueError(f"expected tables [[layers]] in {path}, got layers = {layers!r}")
    for layer in layers:
        _require_keys(path, "a layer", layer, {"thickness", "young", "poisson"}, {"gradient"})
    if isinstance(base, dict):
        _require_keys(path, "base", base, {"young", "poisson"}, {"gradient"})
        gradient = base.pop("gradient", 0.0)
        ground = GradedHalfSpace.init_linear(**base, gradient=gradient) if gradient else None
        base = ground or HalfSpace(**base)
    if not layers:
        if isinstance(base, str):
            raise ValueError(f"expected layers on the base {base!r} in {path}, got none")
        return base
    return LayeredHalfSpace([Layer(**layer) for layer in layers], base)


def _require_keys(path: Path, what: str, found: dict, needed: set, optional: set) -> None:
    if missing := needed - set(found):
        raise ValueError(f"expected {sorted(missing)} in {what} of {path}, got {sorted(found)}")
    if unknown := set(found) - needed - optional:
        raise ValueError(
            f"expected no other entries than {sorted(needed | optional)} in {what} of {path}, "
            f"got {sorted(unknown)}"
        )


def write_dual(path: PathLike, dual: DualMesh) -> None:
    """Write a dual grid as polygons to a VTU file, from which `read_dual` restores it.

    Cell data: ``cell``, the number of the cell, and ``node``, the node of the triangulation that
    belongs to it. Tags are not kept.
    """
    write_polygons(path, dual.polygons, {"node": dual.mesh.p.T})


def read_dual(path: PathLike) -> DualMesh:
    """Read the dual grid written by `write_dual`.

    Three cells meet in the barycentre of every triangle and name its nodes.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file was not written by `write_dual`.
    """
    polygons, cell_data, _ = read_polygons(path)
    if "node" not in cell_data:
        raise MeshError(f"expected cell data 'node' in {path}, got {sorted(cell_data)}")
    cells = np.repeat(np.arange(len(polygons)), polygons.sizes)
    order = np.argsort(polygons.indices, kind="stable")
    three = np.nonzero(np.bincount(polygons.indices) == 3)[0]
    triples = cells[order][np.isin(polygons.indices[order], three)].reshape(-1, 3)
    dual = DualMesh.from_mesh(
        MeshTri(np.ascontiguousarray(cell_data["node"].T), np.ascontiguousarray(triples.T))
    )
    if not np.array_equal(dual.polygons.indices, polygons.indices):
        raise MeshError(f"the cells in {path} are not the 1-type dual of a triangulation")
    return dual


def write_solution(path: PathLike, solution: PunchSolution) -> None:
    """Write a solution to a VTU file: polygons with pressures and displacements.

    Cell data: ``cell``, ``pressure``, ``displacement`` (of the punch in the centroid); point
    data: ``displacement`` of the ground. `read_polygons` reads the file again.
    """
    partition = solution.punch.partition
    write_polygons(
        path,
        partition.polygons,
        {
            "pressure": solution.pressure,
            "displacement": solution.punch_displacement(partition.centroids),
        },
        {"displacement": solution.displacement(partition.polygons.p)},
    )


def write_polygons(
    path: PathLike,
    polygons: Polygons,
    cell_data: Mapping[str, ndarray] | None = None,
    point_data: Mapping[str, ndarray] | None = None,
) -> None:
    """Write polygons with data to a VTU file, whole or not at all.

    A file holds one block for each number of vertices; the cell data ``cell`` keeps the order.

    Raises
    ------
    ValueError
        If the suffix is not ``.vtu`` or the length of the data does not fit.
    """
    import meshio

    if Path(path).suffix != ".vtu":
        raise ValueError(f"expected a file name ending in .vtu, got {path}")
    cell_data = {"cell": np.arange(len(polygons)), **(cell_data or {})}
    for kind, data, n in (
        ("cell", cell_data, len(polygons)),
        ("point", point_data or {}, polygons.p.shape[1]),
    ):
        for name, values in data.items():
            if len(values) != n:
                raise ValueError(f"expected {n} values of {kind} data {name!r}, got {len(values)}")
    groups = [np.nonzero(polygons.sizes == k)[0] for k in np.unique(polygons.sizes)]
    blocks = []
    for group in groups:
        places = polygons.offsets[group][:, None] + np.arange(polygons.sizes[group[0]])
        blocks.append(("polygon", polygons.indices[places]))
    mesh = meshio.Mesh(
        np.vstack([polygons.p, np.zeros(polygons.p.shape[1])]).T,
        blocks,
        point_data={k: np.asarray(v) for k, v in (point_data or {}).items()},
        cell_data={k: [np.asarray(v)[g] for g in groups] for k, v in cell_data.items()},
    )
    write_whole(path, lambda part: meshio.write(part, mesh, file_format="vtu"))


def read_polygons(path: PathLike) -> tuple[Polygons, dict[str, ndarray], dict[str, ndarray]]:
    """Read what `write_polygons` wrote.

    Returns
    -------
    polygons : Polygons
        In their original order.
    cell_data, point_data : dict of str to array
        Data of the cells, in their original order, and of the points.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file has no numbered polygons.
    """
    mesh = _read(Path(path), "vtu")
    if "cell" not in mesh.cell_data:
        raise MeshError(f"expected polygons with cell data 'cell' in {path}")
    order = np.argsort(np.concatenate(mesh.cell_data["cell"]))
    loops = [loop for block in mesh.cells for loop in block.data]
    loops = [loops[i] for i in order]
    polygons = Polygons(
        mesh.points[:, :2].T,
        np.concatenate(loops),
        np.concatenate([[0], np.cumsum([len(loop) for loop in loops])]),
    )
    cell_data = {k: np.concatenate(v)[order] for k, v in mesh.cell_data.items() if k != "cell"}
    return polygons, cell_data, dict(mesh.point_data)


def write_whole(path: PathLike, write: Callable[[str], object]) -> None:
    """Let ``write`` produce a file that replaces ``path`` only when complete.

    ``write`` gets the name of a temporary file in the same folder, with the same suffix.
    """
    path = Path(path)
    handle, part = tempfile.mkstemp(suffix=path.suffix, prefix=f".{path.stem}-", dir=path.parent)
    os.close(handle)
    try:
        write(part)
        # a temporary file is private; a result is as readable as any new file
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(part, 0o666 & ~umask)
        os.replace(part, path)
    finally:
        Path(part).unlink(missing_ok=True)
