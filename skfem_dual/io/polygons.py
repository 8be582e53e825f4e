"""Dual grids and solutions as polygons in VTU files."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy import ndarray
from skfem import MeshTri

from ..arguments import checked_instance
from ..errors import MeshError
from ..grids.dual_mesh import DualMesh
from ..grids.polygons import Polygons
from ..ground.periodic import PeriodicGround
from ..messages import shown
from ..numeric import require_unmasked
from ..solutions.elastic_solution import ElasticSolution
from ..solutions.pressures import CellPressures
from ..solutions.punch_solution import PunchSolution
from .guarded import read_through_meshio
from .writing import PathLike, require_vtu, vtu_name, write_whole


def write_dual(path: PathLike, dual: DualMesh) -> None:
    """Write a dual grid as polygons to a VTU file, from which `read_dual` restores it.

    Cell data: ``cell``, the number of the cell, and ``node``, the node of the triangulation that
    belongs to it. Tags are not kept.

    Parameters
    ----------
    path : path
        The file, ending in ``.vtu``.
    dual : DualMesh
        The grid, with its triangulation.

    Raises
    ------
    TypeError
        If ``dual`` is no `DualMesh`.
    ValueError
        If the suffix is not ``.vtu``.
    OSError
        If the file cannot be written.
    """
    checked_instance("dual", dual, DualMesh, "DualMesh.from_mesh(mesh)")
    write_polygons(path, dual.polygons, {"node": dual.mesh.p.T})


def read_dual(path: PathLike) -> DualMesh:
    """Read the dual grid written by `write_dual`.

    Three cells meet in the barycentre of every triangle and name its nodes.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    DualMesh
        On a mesh without tags.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    TypeError
        If ``path`` is no path.
    ValueError
        If it is a folder, a pipe or a device.
    MeshError
        If the file was not written by `write_dual`.
    """
    polygons, cell_data, _ = read_polygons(path)
    if "node" not in cell_data:
        raise MeshError(f"expected cell data 'node' in {path}, got {sorted(cell_data)}")
    node = np.asarray(cell_data["node"])
    if node.ndim != 2 or node.shape[1] != 2 or not np.isfinite(node.astype(float)).all():
        raise MeshError(f"expected two coordinates of the node of each cell in {path}")
    cells = np.repeat(np.arange(len(polygons)), polygons.sizes)
    order = np.argsort(polygons.indices, kind="stable")
    three = np.nonzero(np.bincount(polygons.indices) == 3)[0]
    triples = cells[order][np.isin(polygons.indices[order], three)].reshape(-1, 3)
    mesh = MeshTri(np.ascontiguousarray(node.T), np.ascontiguousarray(triples.T))
    other = (
        f"expected the 1-type dual of a triangulation in {path}, as write_dual has it, got other "
        "polygons. Remedy: read_polygons"
    )
    try:
        dual = DualMesh.from_mesh(mesh)
    except MeshError as error:
        raise MeshError(other) from error
    if not np.array_equal(_rings(dual.polygons), _rings(polygons)):
        raise MeshError(other)
    return dual


def _rings(polygons: Polygons) -> ndarray:
    """Indices of all polygons, each from its least on; where they begin is that of the order of
    nodes in triangles, of which files have none."""
    offsets, sizes = polygons.offsets[:-1], polygons.sizes
    cell = np.repeat(np.arange(len(polygons)), sizes)
    least = np.lexsort((polygons.indices, cell))[offsets] - offsets
    turned = np.arange(len(cell)) - offsets[cell] + least[cell]
    return polygons.indices[offsets[cell] + turned % sizes[cell]]


def write_solution(path: PathLike, *solutions: PunchSolution | ElasticSolution) -> None:
    """Write a solution, or those of neighbours, to a VTU file: pressures and displacements.

    A structure that bends is written whole by `write_structure`, here beside neighbours.

    Cell data of the polygons: ``cell``, ``footing`` (its number), ``pressure``, ``first_moments``
    and ``displacement`` (of the punch in the centroid); point data: ``displacement`` of the
    ground. `read_polygons` reads the file again.

    ``pressure`` and ``first_moments`` are means over the cells, of ``p`` and of ``(p x, p y, 0)``
    in the coordinates of the file, with the law inside the cells. Times the areas of the cells,
    which is what "Integrate Variables" of ParaView sums up, they are the force and the first
    moments to rounding. The pressure times the coordinates of centroids is not.

    Parameters
    ----------
    path : path
        The file, ending in ``.vtu``.
    *solutions : PunchSolution or ElasticSolution
        One of a rigid punch, or those of neighbours.

    Raises
    ------
    TypeError
        If something is no solution, there is none, or the only one is of a structure.
    ValueError
        If the suffix is not ``.vtu``, or the ground has a period.
    OSError
        If the file cannot be written.
    """
    kinds = (PunchSolution, ElasticSolution) if len(solutions) > 1 else PunchSolution
    remedy = "write_structure for what bends, *solutions for neighbours, write_field for a field"
    for solution in solutions or (None,):
        checked_instance("solution", solution, kinds, remedy)
    if any(isinstance(s.footprint.substrate, PeriodicGround) for s in solutions):
        raise ValueError(
            "expected ground without a period, which moves beside cells too. Remedy: "
            "write_field(path, solution.punch.basis, solution.pressure)"
        )
    parts = [solution.punch.partition for solution in solutions]
    every = list(zip(solutions, parts, strict=True))
    write_polygons(
        path,
        Polygons.together([part.polygons for part in parts]),
        {
            "footing": np.repeat(np.arange(len(parts)), [len(part) for part in parts]),
            "pressure": np.concatenate([solution.pressure for solution in solutions]),
            "first_moments": np.vstack([first_moments(solution) for solution in solutions]),
            "displacement": np.concatenate([_of_body(solution) for solution in solutions]),
        },
        {
            "displacement": np.concatenate(
                [solution.ground_displacement(part.polygons.p) for solution, part in every]
            )
        },
    )


def _of_body(solution: PunchSolution | ElasticSolution) -> ndarray:
    """How far the base goes in the middle of each cell."""
    if isinstance(solution, ElasticSolution):
        return solution.cell_deflections
    return solution.punch_displacement(solution.punch.partition.centroids)


def first_moments(solution: CellPressures) -> ndarray:
    """Means of ``(p x, p y, 0)`` over each cell, as files have vectors, shape (n, 3)."""
    return np.pad(solution.mean_moments.T, ((0, 0), (0, 1)))


def write_polygons(
    path: PathLike,
    polygons: Polygons,
    cell_data: Mapping[str, ndarray] | None = None,
    point_data: Mapping[str, ndarray] | None = None,
) -> None:
    """Write polygons with data to a VTU file, whole or not at all.

    A file holds one block for each number of vertices; the cell data ``cell`` keeps the order.

    Parameters
    ----------
    path : path
        The file, ending in ``.vtu``.
    polygons : Polygons
        n polygons on N points.
    cell_data, point_data : mapping of str to (n,) or (n, k), (N,) or (N, k) arrays, optional
        Numbers or vectors to write, by their names.

    Raises
    ------
    TypeError
        If the polygons are something else, or data no numbers by their names.
    ValueError
        If the suffix is not ``.vtu``, the shape of the data does not fit, some are masked, or
        they are called ``cell``, nothing or what cannot be printed.
    OSError
        If the file cannot be written.
    """
    import meshio

    checked_instance("polygons", polygons, Polygons)
    require_vtu(path)
    cell_data = _checked_data("cell", cell_data, len(polygons))
    point_data = _checked_data("point", point_data, polygons.p.shape[1])
    if "cell" in cell_data:
        raise ValueError(
            'expected another name than "cell" of cell data, which are the numbers of the cells'
        )
    cell_data["cell"] = np.arange(len(polygons))
    blocks = list(blocks_of(polygons))
    mesh = meshio.Mesh(
        np.vstack([polygons.p, np.zeros(polygons.p.shape[1])]).T,
        [("polygon", vertices) for _, vertices in blocks],
        point_data={vtu_name(k): v for k, v in point_data.items()},
        cell_data={vtu_name(k): [v[cells] for cells, _ in blocks] for k, v in cell_data.items()},
    )
    write_whole(path, lambda part: meshio.write(part, mesh, file_format="vtu"))


def _checked_data(kind: str, data: Mapping[str, Any] | None, n: int) -> dict[str, ndarray]:
    """Numbers or vectors for each of n cells or points by their names."""
    out = {}
    for name, values in checked_instance(f"{kind}_data", data or {}, Mapping).items():
        require_unmasked(f"{kind} data {shown(name)}", values)
        values = np.asarray(values)
        if not isinstance(name, str) or values.dtype.kind not in "biuf":
            raise TypeError(
                f"expected real numbers by their names for {kind}_data, got {shown(name)}: "
                f"{shown(values)}"
            )
        if values.ndim == 0 or len(values) != n:
            raise ValueError(
                f"expected {n} values of {kind} data {name!r}, got "
                f"{len(values) if values.ndim else values}"
            )
        if values.ndim > 2 or 0 in values.shape[1:]:
            raise ValueError(
                f"expected {n} numbers or vectors of {kind} data {name!r}, got an array of shape "
                f"{values.shape}. Remedy: tensors as vectors of their components"
            )
        out[name] = values.astype(_written(values.dtype), copy=False)
    return out


def _written(dtype: np.dtype) -> np.dtype:
    """The type of numbers in a VTU file, which has neither half nor long doubles nor booleans."""
    if dtype.kind == "f" and dtype.itemsize not in (4, 8):
        return np.dtype(np.float64)
    return np.dtype(np.int8) if dtype.kind == "b" else dtype


def blocks_of(polygons: Polygons) -> Iterator[tuple[ndarray, ndarray]]:
    """Polygons with equally many vertices: their numbers, and the vertices of each, (n, k)."""
    for size in np.unique(polygons.sizes):
        cells = np.nonzero(polygons.sizes == size)[0]
        yield cells, polygons.indices[polygons.offsets[cells][:, None] + np.arange(size)]


def read_polygons(path: PathLike) -> tuple[Polygons, dict[str, ndarray], dict[str, ndarray]]:
    """Read what `write_polygons` wrote.

    Parameters
    ----------
    path : path
        The file.

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
    TypeError
        If ``path`` is no path.
    ValueError
        If it is a folder, a pipe or a device.
    MeshError
        If the file has no numbered polygons.
    """
    mesh = read_through_meshio(path, "vtu")
    if "cell" not in mesh.cell_data:
        raise MeshError(f"expected polygons with cell data 'cell' in {path}")
    loops = [np.asarray(loop) for block in mesh.cells for loop in block.data]
    numbers = np.concatenate(mesh.cell_data["cell"])
    order = np.argsort(numbers, axis=0, kind="stable")
    if not np.array_equal(numbers[order], np.arange(len(loops))):
        raise MeshError(f"expected cells numbered from 0 to {len(loops) - 1} in {path}")
    if not loops or any(loop.ndim != 1 or loop.dtype.kind not in "iu" for loop in loops):
        raise MeshError(f"expected polygons of whole node numbers in {path}")
    loops = [loops[i] for i in order]
    polygons = Polygons(
        mesh.points[:, :2].T,
        np.concatenate(loops),
        np.concatenate([[0], np.cumsum([len(loop) for loop in loops])]),
    )
    cell_data = {k: np.concatenate(v)[order] for k, v in mesh.cell_data.items() if k != "cell"}
    return polygons, cell_data, dict(mesh.point_data)
