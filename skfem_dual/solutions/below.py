"""Stresses and displacements in the ground below a punch."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike
from skfem import CellBasis, ElementTriP1, MeshTri

from ..arguments import (
    Pair,
    checked_array,
    checked_integer,
    checked_pair,
    checked_points,
    checked_size,
)
from ..contact.load import Load
from ..elements.depth import components, strata_of
from ..elements.stresses import Stresses
from ..elements.strips import CellLoads
from ..errors import ResolutionWarning, warn
from ..grids.polygons import readonly
from ..kernels.once import ReadOnly
from ..messages import apart, place, shown
from .pressures import CellPressures, checked_solution

#: cells of the largest sections
MOST = 10**7


def stress_below(solution: CellPressures, x: ArrayLike) -> Stresses:
    """Stresses in the ground below a punch or a structure and its neighbours.

    On any ground and with the pressure's law inside edge-weighted cells: one cell size below a
    singular edge sigma_z is good to 0.3 % of the mean pressure with 600 dual cells, in three
    tenths of that to 1 % in the mean along the edge, at single points to 3 %; with as many
    triangles to 0.5, 1 and 6 %. What layers and gradients add
    is found to 1e-6 of the pressure where cells are smaller than the ground's shortest length, and
    to 1e-8 of a force's influence at its depth; below a singular edge, where moduli vary from the
    surface on, to 3e-5 of the mean pressure in one cell size, to 5e-4 in three hundredths of that.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        On a `HalfSpace`, a `GradedHalfSpace` or a `LayeredHalfSpace`.
    x : (3, m) array of float
        Points in the ground, depths ``x[2] > 0``. Tables are made for each depth that occurs, in
        milliseconds in layers and some 20 ms where moduli vary: sections along lines of equal
        depth are cheap.

    Returns
    -------
    Stresses
        All components, compression positive, of the vertical load, without the ground's own
        weight; a `ResolutionWarning` tells of a horizontal one. In the interface of two layers
        those of the upper one.

    Raises
    ------
    TypeError
        If the ground is none of these.
    ValueError
        If a point is not in the ground: above its surface, or in its rigid base; or if it lies
        beyond a million times the greatest length of a stratified ground.
    ConvergenceError
        If moduli vary so that no good influence functions are found.

    Examples
    --------
    Rigid circle of radius 1 under a force of pi: on the axis
    ``sigma_z = (1 + 3 z^2) / (2 (1 + z^2)^2)``.

    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, RigidPunch
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> solution = RigidPunch(HalfSpace(1.0, 0.25), dual.basis()).solve(force=3.14159)
    >>> print(f"{stress_below(solution, [[0.0], [0.0], [1.0]]).sigma_z[0]:.3f}")
    0.500
    """
    return Stresses(*_fields(solution, x, (True, False))[:6])


def displacement_below(solution: CellPressures, x: ArrayLike) -> ndarray:
    """Displacements in the ground below a punch or a structure and its neighbours.

    Parameters
    ----------
    solution, x
        As of `stress_below`.

    Returns
    -------
    (3, m) array of float
        In the directions x, y and z, the last positive downwards.

    Raises
    ------
    TypeError, ValueError, ConvergenceError
        As `stress_below`.
    """
    return _fields(solution, x, (False, True))[6:]


def pushed(solution: CellPressures) -> bool:
    """Whether a horizontal load or torsion acts, which fields in depth leave out."""
    load = getattr(solution, "load", None)
    return isinstance(load, Load) and load.shear is not None and bool(load.shear.any())


def _fields(
    solution: CellPressures, x: ArrayLike, kinds: tuple[bool, bool] = (True, True)
) -> ndarray:
    """As `components`, under all bodies; they are on one ground."""
    checked_solution("solution", solution)
    if pushed(solution):
        warn(
            "stresses and displacements in depth are those of the vertical load; those of the "
            "horizontal force and torsion, which the tractions of solution.shear bring into the "
            "ground, are not added",
            ResolutionWarning,
        )
    loads = [
        CellLoads(cells.partition, p, cells.weights, cells.slopes_of(p))
        for cells, p in solution.all_pressures
    ]
    return components(solution.footprint.substrate, loads, x, kinds)


@dataclass(frozen=True, eq=False)
class Profile(ReadOnly):
    """Stresses, displacements and strain over the depth below a point of the surface.

    Attributes
    ----------
    x : (2,) array of float
        The point.
    depth : (m,) array of float
        The depths, positive, as they were given.
    stresses : Stresses
        Compression positive, in an interface those above it.
    displacement : (3, m) array of float
        In the directions x, y and z, the last positive downwards.
    strain : (m,) array of float
        Vertical strain, shortening positive.
    interfaces : (k,) array of float
        Depths at which layers end.
    """

    x: ndarray
    depth: ndarray
    stresses: Stresses
    displacement: ndarray
    strain: ndarray
    interfaces: ndarray

    def __repr__(self) -> str:
        of = {"sigma_z": self.stresses.sigma_z, "strain": self.strain}
        of["settlement"] = self.displacement[2]
        rows = [f"{name}: {each.min():.6g} to {each.max():.6g}" for name, each in of.items()]
        low, high = self.depth.min(), self.depth.max()
        return "\n  ".join(
            [
                f"<skfem_dual Profile object>\n  Below: {place(self.x)}",
                f"Depths: {len(self.depth)}, {low:.6g} to {high:.6g}",
                *rows,
            ]
        )


def vertical_profile(solution: CellPressures, at: Pair, depths: ArrayLike) -> Profile:
    """What the ground feels over the depth below a point.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        As for `stress_below`.
    at : pair of float
        The point of the surface, under the punch or beside it.
    depths : (m,) array of float
        Positive.

    Returns
    -------
    Profile

    Raises
    ------
    TypeError, ValueError, ConvergenceError
        As `stress_below`.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace, RigidPunch
    >>> crust = LayeredHalfSpace([Layer(1.0, 60e6, 0.3)], HalfSpace(10e6, 0.45))
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> solution = RigidPunch(crust, dual.basis()).solve(force=1e6)
    >>> profile = vertical_profile(solution, (0.0, 0.0), [0.5, 1.0, 2.0])
    >>> print(np.round(profile.stresses.sigma_z / 1e3), np.round(1e3 * profile.strain, 1))
    [73. 93. 59.] [0.7 3.2 5.1]
    """
    checked_solution("solution", solution)
    at = checked_pair("at", at)
    z = checked_array("depths", depths, ("m",), each="depth")
    if len(z) == 0:
        raise ValueError("expected at least one depth, got none")
    found = _fields(solution, np.vstack([np.tile(at, (len(z), 1)).T, z]))
    stress = Stresses(*found[:6])
    ground = solution.footprint.substrate
    strata = strata_of(ground)
    ratio, poisson = strata.moduli(z)
    sides = stress.sigma_x + stress.sigma_y
    strain = (stress.sigma_z - poisson * sides) / (ratio * ground.surface.young)
    interfaces = strata.interfaces
    return Profile(
        readonly(np.array(at)),
        readonly(z),
        Stresses(*map(readonly, stress)),
        readonly(found[6:]),
        readonly(strain),
        readonly(interfaces[np.isfinite(interfaces)]),
    )


def settlement_by_layers(
    solution: CellPressures, x: ArrayLike, depths: ArrayLike | None = None
) -> ndarray:
    """How much each layer contributes to the settlement of points of the surface.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        As for `stress_below`.
    x : (2, m) array of float
        Points of the surface.
    depths : (k,) array of float, optional
        Where one contribution ends and the next begins, ascending; by default the interfaces of
        the layers.

    Returns
    -------
    (n, m) array of float
        The shortening between the surface and the first depth, between depths, and below the
        last one, down to a rigid base or for ever. The sum is the settlement of the surface.

    Raises
    ------
    TypeError, ValueError, ConvergenceError
        As `stress_below`; and if the depths do not ascend.

    Examples
    --------
    >>> from skfem import MeshTri
    >>> from skfem_dual import DualMesh, HalfSpace, Layer, LayeredHalfSpace, RigidPunch
    >>> crust = LayeredHalfSpace([Layer(1.0, 60e6, 0.3)], HalfSpace(10e6, 0.45))
    >>> dual = DualMesh.from_mesh(MeshTri.init_circle(4))
    >>> solution = RigidPunch(crust, dual.basis()).solve(force=1e6)
    >>> parts = settlement_by_layers(solution, [[0.0], [0.0]])
    >>> print(np.round(1e3 * parts[:, 0], 1), f"{1e3 * solution.settlement:.1f}")
    [ 0.7 24.1] 24.8
    """
    checked_solution("solution", solution)
    x = checked_points("x", x)
    interfaces = strata_of(solution.footprint.substrate).interfaces
    z = interfaces[:-1]
    if depths is not None:
        z = checked_array("depths", depths, ("k",), each="depth")
        if (bad := np.nonzero(np.diff(z) <= 0)[0]).size:
            last, got = apart(*z[bad[0] : bad[0] + 2])
            raise ValueError(
                f"expected depths that ascend, got {got} after {last} at index {bad[0] + 1}"
            )
        if len(z) and abs(z[-1] - interfaces[-1]) <= 1e-12 * z[-1]:
            z = z[:-1]  # a rigid base does not move
    points = np.vstack([np.tile(x, len(z)), np.repeat(z, x.shape[1])])
    below = displacement_below(solution, points)[2].reshape(len(z), x.shape[1])
    moved = np.vstack([solution.ground_displacement(x), below, np.zeros(x.shape[1])])
    return moved[:-1] - moved[1:]


def vertical_section(
    solution: CellPressures, start: Pair, end: Pair, depth: float, n: int = 100
) -> tuple[CellBasis, ndarray]:
    """Vertical stress in a section of the ground, to draw its bulbs of pressure.

    Parameters
    ----------
    solution : PunchSolution or ElasticSolution
        As for `stress_below`.
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
        pressure, near a singular edge its mean over a strip.

    Raises
    ------
    ValueError
        If the section is empty, or reaches into a rigid base.
    TypeError, ConvergenceError
        As in `stress_below`.
    """
    checked_solution("solution", solution)
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
