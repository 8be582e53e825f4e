"""Structures and the ground under them in one VTU file."""

from typing import Any

import numpy as np
from numpy import ndarray
from skfem import MeshHex, MeshQuad, MeshTet, MeshTri

from ..arguments import checked_instance, checked_number
from ..bodies.plates import Plate
from ..grids.surroundings import surroundings
from ..solutions.displaced import DisplacedStructure
from ..solutions.elastic_solution import ElasticSolution
from .elements import positive
from .polygons import blocks_of, first_moments
from .writing import PathLike, require_vtu, write_whole

#: the ground is drawn no farther from a plan than so many of its extents
FARTHEST = 100
#: what VTK calls the elements, and the order of their vertices; the last is that of
#: skfem.io.meshio, whose import takes long
KINDS: dict[type, tuple[str, Any]] = {
    MeshTri: ("triangle", slice(None)),
    MeshQuad: ("quad", slice(None)),
    MeshTet: ("tetra", slice(None)),
    MeshHex: ("hexahedron", [0, 3, 6, 2, 1, 5, 7, 4]),
}


def write_structure(
    path: PathLike, solution: ElasticSolution, beyond: float = 0.5, *, plate: Plate | None = None
) -> None:
    """Write a structure and the ground to a VTU file, for ParaView and others.

    One file, so that "Warp By Vector" moves both. z is that of a solid, upwards for a plate; the
    ground lies where the structure stands, off which a ``gap=`` lifts it. Point data:
    ``displacement`` (3 components; of a plate and of the ground only the last, negative where they
    settle and z is upwards). Cell data: ``part``, 0 the structure, 1 the cells, 2 the ground
    around them; ``pressure``, ``first_moments`` and ``gap`` on the cells, NaN elsewhere; ``cell``,
    the number of an element, cell or triangle in its part; with ``plate`` ``moments``, its ``m_xx,
    m_yy, m_xy``.

    Integrated over part 1 ("Threshold", then "Integrate Variables" of ParaView), ``pressure`` is
    the force and ``first_moments``, the means of ``(p x, p y, 0)`` over the cells, the first
    moments in the coordinates of the file, both to rounding.

    Parameters
    ----------
    path : str or path
        Name of the file, ending in ``.vtu``; written whole or not at all.
    solution : ElasticSolution
        Of a plate on triangles or quadrilaterals, or a solid of tetrahedra or hexahedra.
        Elements of higher order are written by their vertices.
    beyond : float
        Width of the ground around the plan, over its greater extent.
    plate : Plate, optional
        What the structure is made of, if it is one.

    Raises
    ------
    TypeError
        If an argument or the mesh of the structure is of another kind.
    ValueError
        If the suffix is another, ``beyond`` is not positive or above 100, or the structure is
        softer than the plate everywhere.
    OSError
        If the file cannot be written.
    """
    import meshio

    checked_instance("solution", solution, ElasticSolution)
    beyond = checked_number("beyond", beyond, above=0, at_most=FARTHEST)
    if plate is not None:
        checked_instance("plate", plate, Plate)
    require_vtu(path)
    structure, punch = DisplacedStructure.of(solution), solution.punch
    kind, order = KINDS[type(structure.mesh)]
    t = positive(structure.p[: structure.mesh.dim()], structure.mesh.t[order])
    polygons, fan = punch.partition.polygons, punch.fan
    around, triangles = surroundings(punch.partition, fan, beyond)
    ground = np.hstack([polygons.p, around])
    level = np.full((1, ground.shape[1]), structure.level)
    settled = np.vstack(
        [np.zeros_like(ground), -punch.interface.up * solution.ground_displacement(ground)]
    )
    first = structure.p.shape[1]
    second = first + polygons.p.shape[1]
    blocks: list[tuple[str, ndarray]] = [(kind, t.T)]
    numbers = [np.arange(t.shape[1])]
    for cells, vertices in blocks_of(polygons):
        blocks.append(("polygon", first + vertices))
        numbers.append(cells)
    blocks.append(("triangle", second + triangles.T))
    numbers.append(np.arange(triangles.shape[1]))
    part = [0, *[1] * (len(blocks) - 2), 2]

    def on_part(which: int, values: ndarray) -> list[ndarray]:
        return [
            values[n] if k == which else np.full((len(n), *values.shape[1:]), np.nan)
            for k, n in zip(part, numbers, strict=True)
        ]

    moments = {} if plate is None else {"moments": on_part(0, plate.moments(solution).T)}

    mesh = meshio.Mesh(
        np.hstack([structure.p + structure.rise, np.vstack([ground, level])]).T,
        blocks,
        point_data={"displacement": np.hstack([structure.displacement, settled]).T},
        cell_data={
            "part": [np.full(len(n), k) for k, n in zip(part, numbers, strict=True)],
            "cell": numbers,
            "pressure": on_part(1, solution.pressure),
            "first_moments": on_part(1, first_moments(solution)),
            "gap": on_part(1, solution.gap),
            **moments,
        },
    )
    write_whole(path, lambda file: meshio.write(file, mesh, file_format="vtu"))
