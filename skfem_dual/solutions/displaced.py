"""A structure and its displacements in space, for files and pictures."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from skfem import Mesh, MeshHex, MeshQuad, MeshTet, MeshTri

from ..contact.planes import PlaneFit
from ..contact.sectors import gaps_beside
from ..elements.point_values import vertex_values
from ..elements.shape_functions import place_worked_on
from ..grids.evening import evening
from ..kernels.compiled import inputs
from .elastic_solution import ElasticSolution

#: meshes by their vertices; those of higher order are of these kinds too
KINDS: tuple[Any, ...] = MeshTri, MeshQuad, MeshTet, MeshHex


@dataclass(frozen=True, eq=False)
class DisplacedStructure:
    """The elements of a structure, by their vertices, and where they go.

    Attributes
    ----------
    mesh : Mesh
        The elements, straight and in their order, with no vertices but their own.
    p : (3, n) array of float
        Vertices; those of a plate have the height zero.
    displacement : (3, n) array of float
        At the vertices; of a plate the last component only, settlements negative.
    rise : (3, n) array of float
        From there to where the unloaded structure stands: its gap, away from the ground.
    level : float
        Height of the ground.
    """

    mesh: Mesh
    p: ndarray
    displacement: ndarray
    rise: ndarray
    level: float

    @classmethod
    def of(cls, solution: ElasticSolution, least: int = 0) -> "DisplacedStructure":
        """Of a solution; a plate is cut finer to have so many elements at least.

        Raises
        ------
        TypeError
            If the structure is of other elements.
        """
        punch = solution.punch
        basis = punch.structure
        kind = next((kind for kind in KINDS if isinstance(basis.mesh, kind)), None)
        if kind is None:
            raise TypeError(
                "expected a structure of triangles, quadrilaterals, tetrahedra or hexahedra, got "
                f"a {type(basis.mesh).__name__}"
            )
        t = basis.mesh.t if basis.tind is None else basis.mesh.t[:, basis.tind]
        used, t = np.unique(t, return_inverse=True)
        p, t = inputs(basis.mesh.p[:, used], t.reshape(len(basis.mesh.t), -1))
        mesh = kind(p, t, sort_t=False)  # rows in a row, or scikit-fem logs a warning
        if mesh.dim() == 3:
            own = punch.contact_basis
            level = float(own.mesh.p[2, own.mesh.facets[:, own.find]].mean())
            moved = _of_solid(solution)[:, used]
            return cls(mesh, mesh.p, moved, _upwards(solution, mesh.p[:2]), level)
        while mesh.nelements < least:
            mesh = mesh.refined()
        flat = np.zeros((1, mesh.nvertices))
        moved = np.vstack([flat, flat, -solution.deflection(mesh.p)])
        return cls(mesh, np.vstack([mesh.p, flat]), moved, _upwards(solution, mesh.p), 0.0)


def _of_solid(solution: ElasticSolution) -> ndarray:
    """Displacements at the vertices of the mesh, shape (3, n), of the field on which the pressure
    works. Where that is not the third component of a vector no horizontal ones are known."""
    punch = solution.punch
    basis = punch.structure
    shapes = [np.shape(field)[:-2] for field in basis.basis[0]]
    field, at = place_worked_on(shapes, basis.elem, punch.component, True)
    values = vertex_values(basis, solution.displacement, field)
    moved = values.copy() if at == (2,) else np.zeros((3, values.shape[-1]))
    moved[2] = -punch.interface.up * punch.interface.sense * values[at]
    return moved


def _upwards(solution: ElasticSolution, x: ndarray) -> ndarray:
    """The gap of the unloaded structure at points (2, m), as vectors away from the ground."""
    rise = np.zeros((3, x.shape[1]))
    rise[2] = solution.punch.interface.up * gap_at(solution.punch, x)
    return rise


def gap_at(punch: Any, x: ndarray) -> ndarray:
    """Gap between an unloaded body and the ground at points (2, m).

    Where the shape is given as values of cells, or is not defined at all of the points, it is that
    of planes through the cells around.
    """
    if punch.gap is None:
        return np.zeros(x.shape[1])
    if (gap := gaps_beside(punch.gap, x)) is not None:
        return gap
    even = evening(punch.partition.polygons)
    return PlaneFit.to_nearest(punch.collocation_points, x, even).values(punch.initial_gap)
