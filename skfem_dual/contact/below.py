"""Stresses and displacements in the ground below a punch."""

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, ElementTriP1, MeshTri

from ..arguments import Pair, checked_instance, checked_integer, checked_pair, checked_size
from ..elements.stresses import Stresses, displacements, stresses
from ..messages import shown
from .pressures import CellPressures
from .solution import PunchSolution

#: cells of the largest sections
MOST = 10**7


def stress_below(solution: PunchSolution, x: ArrayLike) -> Stresses:
    """Stresses in the ground below a punch and its neighbours.

    The mean pressures of the cells act uniformly on their cells, also where the punch weights
    the cells along a singular edge. Below such an edge sigma_z is then off by a tenth of the
    mean pressure in a depth of one cell size, by 3 % in two and by 1 % in four; below the middle
    of a circle of 545 cells by less than 0.5 % of itself everywhere. Grading the mesh to the
    edge helps.

    Parameters
    ----------
    solution : PunchSolution
        Of a punch on a `HalfSpace`.
    x : (3, m) array of float
        Points in the ground, depths ``x[2] > 0``.

    Returns
    -------
    Stresses
        All components, compression positive, without the ground's own weight.

    Raises
    ------
    ValueError
        If a point is not in the ground, or the ground is not homogeneous.

    Examples
    --------
    Rigid circle of radius 1 under a force of pi: on the axis
    ``sigma_z = (1 + 3 z^2) / (2 (1 + z^2)^2)``.

    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.25), dual.basis()).solve(force=3.14159)
    >>> print(f"{stress_below(solution, [[0.0], [0.0], [1.0]]).sigma_z[0]:.2f}")
    0.50
    """
    checked_instance("solution", solution, CellPressures)
    parts = [stresses(c.substrate, c.partition, p, x, c.weights) for c, p in solution.all_pressures]
    return Stresses(*np.sum(parts, axis=0))


def displacement_below(solution: PunchSolution, x: ArrayLike) -> ndarray:
    """Displacements in the ground below a punch and its neighbours.

    The shape is (3, m), in the directions x, y, z; loads, points and errors are those of
    `stress_below`.
    """
    checked_instance("solution", solution, CellPressures)
    parts = [displacements(c.substrate, c.partition, p, x, c.weights) for c, p in solution.all_pressures]
    return np.sum(parts, axis=0)


def vertical_section(
    solution: PunchSolution, start: Pair, end: Pair, depth: float, n: int = 100
) -> tuple[CellBasis, ndarray]:
    """Vertical stress in a section of the ground, to draw its bulbs of pressure.

    Parameters
    ----------
    solution : PunchSolution
        Of a punch on a `HalfSpace`.
    start, end : pair of float
        Ends of a line on the surface.
    depth : float
        Depth of the section below the line.
    n : int
        Number of intervals along the line; those of the depth are about as long.

    Returns
    -------
    basis : CellBasis
        First-order basis on a MeshTri. Its first coordinate is the distance from ``start``, its
        second the *negative* depth, so that the surface is drawn on top.
    values : (N,) array of float
        The vector of sigma_z, compression positive; at the surface its limit from below, the
        mean pressure of the cell.

    Raises
    ------
    ValueError
        If the section is empty, or as in `stress_below`.
    """
    checked_instance("solution", solution, CellPressures)
    a = np.reshape(checked_pair("start", start), (2, 1))
    b = np.reshape(checked_pair("end", end), (2, 1))
    depth = checked_size("depth", depth)
    length = checked_size("distance from start to end", float(np.hypot(*(b - a))[0]))
    n = checked_integer("n", n, at_least=1, at_most=MOST)
    rows = max(1, round(n * depth / length))
    if n * rows > MOST:
        raise ValueError(f"expected at most {MOST:g} cells, got {n} times {shown(rows)}")
    mesh = MeshTri.init_tensor(np.linspace(0, length, n + 1), np.linspace(-depth, 0, rows + 1))
    s, z = mesh.p[0] / length, np.maximum(-mesh.p[1], 1e-9 * depth)
    values = stress_below(solution, np.vstack([(1 - s) * a + s * b, z])).sigma_z
    return CellBasis(mesh, ElementTriP1()), values
