"""Plates of one thickness on the ground, and columns that stand on them.

Any stiffness assembled with scikit-fem is a structure; that of a raft is what is wanted most, and
all that the command line knows.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray
from scipy.sparse import csr_matrix
from skfem import BilinearForm, CellBasis, ElementQuad0, ElementTriMorley, MeshQuad, MeshTri
from skfem.helpers import dd, ddot, eye, trace
from skfem.mapping import Mapping

from ..arguments import Pair, checked_instance, checked_number, checked_pair, checked_size
from ..elements.load_matrix import load_matrix
from ..elements.point_values import locate, value_matrix
from ..elements.shape_functions import ShapeFunctions, ascends
from ..grids.cellwise import CellwiseBasis
from ..grids.fan import Fan
from ..grids.mappings import inverting, mapping_about_middle, own_mapping, places_of
from ..grids.partition import Partition
from ..ground.substrates import Substrate
from ..messages import place
from ..operators.resources import FEWER, refuse_beyond_memory
from ..solutions.elastic_solution import ElasticSolution
from .elastic import ElasticPunch

#: points of Gauss's rule along an element of a loaded line, and the most such pieces
POINTS, PIECES = 8, 1000
#: bytes that a cell under a plate takes until the answer, most of them for the plate's factors:
#: 157 to 202 KiB of 1000 to 12 000 cells of a rectangle
UNDER_PLATE = 200.0 * 2**10
#: how much too far plates bend under a column by Morley's element, over force and area of a
#: triangle by rigidity: 0.23 to 0.26 under one a fifth as wide as the length over which it bends
#: the plate, 0.12 where it is as wide, of an infinite plate by Hogg's integral
SOFT = 0.25
#: what diagonals of stiffnesses may differ by, as of one in single precision
DIAGONAL = 1e-5


def require_memory(cells: int) -> None:
    """Refuse a plate on so many cells that it does not fit into the memory at hand.

    Raises
    ------
    MemoryError
        If it does not.
    """
    refuse_beyond_memory(UNDER_PLATE * cells, f"a plate on {cells} cells takes", FEWER, cells)


class LocalMorley(ElementTriMorley):
    """Morley's element whose polynomials are of coordinates from the middle of the mesh, so that
    they have all digits wherever that is."""

    moved: tuple[Any, Mapping] | None = None

    def gbasis(self, mapping: Mapping, X: ndarray, i: int, tind: Any = None) -> tuple:
        """Functions in points of the reference element."""
        mesh, moved = mapping.mesh, self.moved
        if moved is None or moved[0] is not mesh:
            moved = self.moved = mesh, mapping_about_middle(mesh)
        return super().gbasis(moved[1], X, i, tind)


@dataclass(frozen=True)
class Plate:
    """A thin plate of one thickness, such as a raft, by Morley's element of scikit-fem.

    Parameters
    ----------
    thickness, young, poisson : float
        Its thickness, and moduli of its material.

    Raises
    ------
    TypeError, ValueError
        If one is no number, or not positive; Poisson's ratio is from 0 to less than 0.5.

    Examples
    --------
    >>> from skfem_dual import DualMesh, HalfSpace, Plate, column_load
    >>> from skfem_dual.grids.generate import rectangle
    >>> raft = Plate(thickness=0.4, young=30e6, poisson=0.2).on(
    ...     HalfSpace(young=30e3, poisson=0.3), DualMesh.from_mesh(rectangle(8, 5, n=150)).basis()
    ... )
    >>> solution = raft.solve(column_load(raft.structure, (1.0, 0.5), 900.0, sides=(0.4, 0.4)))
    >>> f"{solution.force:.6f} at {solution.centre_of_pressure.round(6)}"
    '900.000000 at [1.  0.5]'
    """

    thickness: float
    young: float
    poisson: float

    def __post_init__(self) -> None:
        values = {name: checked_size(name, getattr(self, name)) for name in ("thickness", "young")}
        values["poisson"] = checked_number("poisson", self.poisson, at_least=0, below=0.5)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def rigidity(self) -> float:
        """D = E t^3 / 12 / (1 - nu^2)."""
        return self.young * self.thickness**3 / 12 / (1 - self.poisson**2)

    def on(self, substrate: Substrate, basis: CellBasis, **options: Any) -> ElasticPunch:
        """The plate on the ground, free at its edge.

        Parameters
        ----------
        substrate, basis
            As of `ElasticPunch`. Of a `CellwiseBasis` the common refinement of both grids is the
            mesh of the plate, of any other its own.
        options
            Of `ElasticPunch`: ``D``, ``edge``, ``origin`` and others.

        Returns
        -------
        ElasticPunch
            `ElasticPunch.structure` is the plate's basis, anywhere in the plane.

        Raises
        ------
        TypeError
            If the basis or its elements are others.
        MemoryError
            Before the work, if the memory at hand will not do.
        """
        checked_instance("basis", basis, CellBasis)
        require_memory(basis.N)
        mesh = basis.dual.refinement if isinstance(basis, CellwiseBasis) else basis.mesh
        checked_instance("the mesh of a plate", mesh, MeshTri)
        if not ascends(mesh):  # the element takes directions of facets from that
            mesh = MeshTri(mesh.p, mesh.t)
        structure = CellBasis(mesh, LocalMorley(), mapping=own_mapping(mesh))
        return ElasticPunch(substrate, basis, structure, self.stiffness(structure), **options)

    def stiffness(self, basis: CellBasis) -> csr_matrix:
        """Matrix of the plate.

        Parameters
        ----------
        basis : CellBasis
            Of an element whose functions have second derivatives, as `skfem.ElementTriMorley`.

        Returns
        -------
        (N, N) csr_matrix
            ``D ((1 - nu) u_ij + nu u_kk delta_ij) v_ij``, integrated.

        Raises
        ------
        TypeError
            If it is no basis, or the functions of its element have no second derivatives.
        """
        checked_instance("basis", basis, CellBasis)
        _require_curvatures(basis, getattr(basis.basis[0][0], "hess", None))
        D, nu = self.rigidity, self.poisson

        @BilinearForm
        def bending(u: Any, v: Any, _: Any) -> Any:
            return D * ddot((1 - nu) * dd(u) + nu * eye(trace(dd(u)), 2), dd(v))

        return bending.assemble(basis)

    def moments(self, solution: ElasticSolution) -> ndarray:
        """Bending moments per length in the elements of the plate.

        They are large, and larger on finer meshes, under a force on a point: such a column
        takes its ``sides``.

        Parameters
        ----------
        solution : ElasticSolution
            Of an `ElasticPunch` whose structure is the plate.

        Returns
        -------
        (3, nelems) array of float
            Mean ``m_xx``, ``m_yy`` and ``m_xy`` of each element of the basis: positive ``m_xx``
            and ``m_yy`` pull the bottom of the plate, along x and along y.

        Raises
        ------
        TypeError
            If it is no solution of a structure, or that is no plate.
        ValueError
            If it is softer than this plate everywhere.
        """
        checked_instance("solution", solution, ElasticSolution)
        basis = solution.punch.structure
        field = basis.interpolate(solution.displacement)
        plain = not isinstance(field, tuple) and np.ndim(field) == 2
        _require_curvatures(basis, field.hess if plain else None)
        self._require_part_of(solution.punch)
        bent = np.asarray(dd(field))
        nu = self.poisson
        m = -self.rigidity * ((1 - nu) * bent + nu * eye(trace(bent), 2))
        means = (m * basis.dx).sum(axis=-1) / basis.dx.sum(axis=-1)
        return np.array([means[0, 0], means[1, 1], means[0, 1]])

    def _require_part_of(self, punch: ElasticPunch) -> None:
        """Refuse a plate that is stiffer than the structure everywhere, by the diagonals: other
        zones, walls and springs add to a softer one."""
        basis, own = punch.structure, np.zeros(punch.structure.N)
        for dofs, (function, *_) in zip(basis.element_dofs, basis.basis, strict=True):
            h = function.hess
            work = ddot(self.poisson * eye(trace(h), 2) + (1 - self.poisson) * h, h)
            own += np.bincount(dofs, self.rigidity * np.sum(work * basis.dx, axis=1), basis.N)
        bent = own > 0  # not of elements that the structure leaves out
        ratio = punch.stiffness.diagonal()[bent] / own[bent]
        if (most := float(ratio.max(initial=0.0))) < 1 - DIAGONAL:
            raise ValueError(
                "expected a plate of which the structure is, got one of whose stiffness it has "
                f"{most:.3g} at most. Remedy: the same thickness, young and poisson"
            )


def excess_under_columns(plate: Plate, basis: CellBasis, x: ndarray, force: ndarray) -> ndarray:
    """About how much too far a plate bends by its element under the forces of narrow columns in
    points (2, m), away from its edge."""
    areas = np.abs(own_mapping(basis.mesh).detA).ravel() / 2
    point, cell = locate(basis.mesh.p[:, basis.mesh.t], x)  # of several the largest
    largest = np.zeros(x.shape[1])
    np.maximum.at(largest, point, areas[cell])
    return SOFT * force * largest / plate.rigidity


def _require_curvatures(basis: CellBasis, curvatures: ndarray | None) -> None:
    if curvatures is None:
        raise TypeError(
            "expected a plate whose deflections have second derivatives, as of ElementTriMorley, "
            f"got one of {type(basis.elem).__name__}"
        )


def column_load(
    basis: CellBasis,
    x: Pair,
    force: float,
    *,
    sides: Pair = (0.0, 0.0),
    moments: Pair = (0.0, 0.0),
) -> ndarray:
    """Load vector of a column, or of what else stands on a rectangle of a plate.

    Parameters
    ----------
    basis : CellBasis
        Of the plate, with a scalar deflection.
    x : pair of float
        Middle of the rectangle.
    force : float
        Positive into the ground.
    sides : pair of float
        Of the rectangle along x and y, over which the load is spread: evenly, moments linearly.
        Without them it acts on the point.
    moments : pair of float
        ``mx`` and ``my``, positive where they press down the side of larger y, of larger x: those
        of tables of load cases. M1 and M2 of a `Load` are ``-my`` and ``mx``.

    Returns
    -------
    (N,) array of float
        Force and moments are kept to rounding on elements that can be flat in any slope.

    Raises
    ------
    TypeError, ValueError
        If an argument is none, or a part of the rectangle is beside the plate; if there are
        moments about an axis along which it has no side.
    """
    checked_instance("basis", basis, CellBasis)
    middle = np.array(checked_pair("x", x))
    force = checked_number("force", force)
    sides, (mx, my) = checked_pair("sides", sides), checked_pair("moments", moments)
    if min(sides) < 0:
        raise ValueError(f"expected sides of a column that are not negative, got {sides}")
    for side in filter(None, sides):
        checked_size("sides", side)
    turning = np.array([my, mx])  # along x and y
    for axis, side, moment in zip("xy", sides, turning, strict=True):
        if moment and not side:
            raise ValueError(
                f"expected a side along {axis} of the column with a moment of {moment:g} along "
                f"it, got none. Remedy: sides=, over which it is spread"
            )
    ShapeFunctions.of(basis, None)  # refuses what is no matter of places
    try:
        spread = _on_rectangle if all(sides) else _on_line
        return spread(basis, middle, np.array(sides), force, turning)
    except ValueError as error:
        raise ValueError(
            f"expected a column on the plate, got one at {place(middle)} with "
            f"sides {sides[0]:g} and {sides[1]:g}, in part beside it. Remedy: coordinates of the "
            "plan; shorter sides at its edge"
        ) from error


def _on_rectangle(
    basis: CellBasis, middle: ndarray, sides: ndarray, force: float, turning: ndarray
) -> ndarray:
    """Load vector of a pressure that is linear on a rectangle, with moments along x and y."""
    ends = middle[:, None] + np.array([-0.5, 0.5]) * sides[:, None]
    own = np.arange(basis.mesh.nelements) if basis.tind is None else basis.tind
    p, t = places_of(basis.mesh)
    corners = p[:, t[:, own]]
    beside = (corners.min(axis=1) > ends[:, 1:]) | (corners.max(axis=1) < ends[:, :1])
    near = own[~beside.any(axis=0)]  # of large plates few elements
    if not len(near):
        raise ValueError("expected a rectangle on the plate, got one beside it")
    rectangle = CellBasis(MeshQuad.init_tensor(*ends), ElementQuad0())
    cell, fan = Partition.from_basis(rectangle), Fan.from_basis(rectangle)
    # with_elements would number DOFs anew
    mesh, mapping, rule = basis.mesh, inverting(basis.mapping), basis.quadrature
    some = CellBasis(mesh, basis.elem, mapping, quadrature=rule, elements=near, dofs=basis.dofs)
    matrix = load_matrix(cell, None, fan, some, moments=True)
    # of the rectangle as its corners are rounded, at site coordinates
    area, (xx, _, yy) = cell.areas[0], cell.polygons.second_moments[:, 0]
    moved = turning - force * (cell.centroids[:, 0] - middle)
    return np.asarray(matrix @ np.array([force / area, *(moved / [xx, yy])]))


def _on_line(
    basis: CellBasis, middle: ndarray, sides: ndarray, force: float, turning: ndarray
) -> ndarray:
    """The same along a line, or in a point where it has no side, by points along elements."""
    along = int(np.argmax(sides))
    length, arms, shares = sides[along], np.zeros((2, 1)), np.ones(1)
    if length:
        size = np.sqrt(basis.dx.sum(axis=1).mean())
        pieces = min(int(np.ceil(length / size)), PIECES)
        points, weights = np.polynomial.legendre.leggauss(POINTS)
        places = (np.arange(pieces)[:, None] + (1 + points) / 2) / pieces - 0.5
        shares = np.tile(weights / (2 * pieces), pieces)
        arms = np.zeros((2, len(shares)))
        arms[along] = length * places.ravel()
    loads = shares * force
    if turning[along]:
        loads = loads + shares * 12 * turning[along] / length**2 * arms[along]
    return np.asarray(value_matrix(basis, middle[:, None] + arms).T @ loads)
